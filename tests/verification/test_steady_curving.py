"""Quasi-static curving and standing by Newton's method, against closed forms and the time loop."""

import warnings

import numpy as np
import pytest
from dynamics import Settings, load_track, load_vehicle, rotation, steady
from rig import test_vehicle
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from selection import points

import railsim
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.system import WHEELSET
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.kernels.track_frame import OMEGA
from railsim.linear.circle import POSITION, at_middle, circle
from railsim.linear.stationary import WALKING_PACE, on_cant, on_twist, roll_coefficient
from railsim.linear.steady import NotConverged, SteadyRolling, follow
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays
from railsim.simulation.run_in import settle_in_curve
from railsim.stability import curving as stability_curving
from railsim.stability.curving import _Search
from railsim.track.tables import track_tables

GRAVITY = 9.81


def curving(vehicle, radius, cant, speed, friction=None):
    """Steady state on a circle, its solver and the model."""
    track = load_track("curve_r250")
    balance = steady(vehicle, track, Settings(), speed)

    def along(share):
        part = circle(track, curvature=share / radius, cant=share * cant, friction=friction)
        return balance.model.system._replace(track=track_tables(part)), speed

    found, solver = follow(balance.model, along, at_middle(balance.state))
    return found, solver, balance


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize(
    ("profile", "radius", "lateral"),
    [
        ("cone_1in20", 2000.0, -3.258e-3),
        ("cone_1in20", -2000.0, 3.258e-3),
        ("cone_1in40", 4000.0, -3.377e-3),
    ],
)
def test_free_conical_wheelset_rolls_where_its_radii_fit_the_curve(profile, radius, lateral):
    """Q1: displacement computed independently, 0.5 %; yaw 0 +- 2 urad."""
    speed = 20.0
    cant = speed**2 / radius / GRAVITY * 1.5
    wheelset = test_vehicle("single_wheelset").with_values({"wheelset.profile": profile})
    found, *_ = curving(wheelset, radius, cant, speed)
    assert found[1] == pytest.approx(lateral, rel=5e-3)
    assert abs(found[5]) < 2e-6


def test_quantities_of_curving_follow_from_the_wheel_forces_and_turn_with_the_curve():
    """Y/Q outwards positive, (Q - Q0)/Q0 of the load on straight track, sum of Y of an axle.

    All axles together hold what the cant does not; to the left everything is mirrored.
    """
    coach, deficiency = load_vehicle("coach_manchester"), 0.05
    found = railsim.curving(coach, radius=[600.0, -400.0, 400.0], cant_deficiency=deficiency)
    Q0 = railsim.static_loads(coach).Q0
    assert found.converged.all()
    for side, outwards in ((0, -1.0), (1, 1.0)):
        quotient = outwards * found.Y[..., side] / found.Q[..., side]
        np.testing.assert_allclose(found.Y_over_Q[..., side], quotient)
        assert outwards * found.contact_y[..., side] == pytest.approx(0.7455, abs=0.04)
    np.testing.assert_allclose((1.0 + found.dQ_over_Q0) * Q0, found.Q, rtol=1e-9)
    np.testing.assert_allclose(found.sum_Y, found.Y[..., 0] + found.Y[..., 1])
    radius = found.radius[:, None, None]
    square = GRAVITY * np.abs(radius) * (0.15 + deficiency) / 1.5
    np.testing.assert_allclose(found.speed[..., None], np.sqrt(square))
    phi = np.arcsin(0.15 / 1.5)
    beyond = square / np.abs(radius) * np.cos(phi) - GRAVITY * np.sin(phi)
    held = -np.sign(radius) * beyond * Q0.sum() / GRAVITY
    assert found.sum_Y.sum(axis=-1) == pytest.approx(held, rel=5e-3)
    assert np.all(np.sign(radius) * found.car_roll < 0.0)  # outwards
    left, right = found.radius.tolist().index(-400.0), found.radius.tolist().index(400.0)
    for name in ("lateral", "attack", "sum_Y", "steering", "car_roll"):
        values = getattr(found, name)
        np.testing.assert_allclose(values[left], -values[right], rtol=1e-4, atol=1e-6)
    for name, sign in (("Q", 1.0), ("Y", -1.0), ("contact_y", -1.0), ("T_gamma", 1.0)):
        values = getattr(found, name)
        np.testing.assert_allclose(values[left], sign * values[right][..., ::-1], rtol=1e-4)
    assert found.wheelset_position == pytest.approx((10.78, 8.22, -8.22, -10.78))


def two_axles(places, longitudinal, lateral):
    """A wagon of 20 t on two wheelsets with springs of their own at 1 m from the middle [N/m]."""
    wheelset = {"mass": 1300.0, "inertia": [700.0, 100.0, 700.0], "radius": 0.46}
    body = {"mass": 20e3, "inertia": [2e4, 2e5, 2e5], "position": [0.0, 0.0, -1.2]}
    wheelsets, elements = {}, {}
    for name, x, kx, ky in zip(("front", "rear"), places, longitudinal, lateral, strict=True):
        at = {"position": [x, 0.0, -0.46], "profile": "cone_1in20"}
        wheelsets[name] = wheelset | at
        spring = {"kind": "bushing", "bodies": ["wagon", name], "sides": "both"}
        stiffness = {"stiffness": [kx, ky, 1e6], "damping": [1e4, 1e4, 2e4]}
        elements[f"of_{name}"] = spring | stiffness | {"point": [x, 1.0, -0.46]}
    named = {"format": "railsim-vehicle/1", "name": "two axles", "bodies": {"wagon": body}}
    return Vehicle.model_validate(named | {"wheelsets": wheelsets, "elements": elements})


def creep_coefficients(N):
    """f11, f22 [N], f23 [Nm] of a wheel of r 0.46 m on a head of R 0.3 m, N [N].

    Hertz; Kalker's table for nu 0.25 (1967) between b/a = 0.7 and 0.8.
    """
    flat, curved = 0.5 / 0.46, 0.5 / 0.3

    def excess(k):
        K, E = ellipk(1.0 - k**2), ellipe(1.0 - k**2)
        return (K - E) / (E / k**2 - K) - flat / curved

    k = brentq(excess, 0.1, 0.999)
    cube = 3.0 * ellipe(1.0 - k**2) * N / (2.0 * np.pi * (flat + curved) * 1.139e11 * k**2)
    ab = k * cube ** (2.0 / 3.0)
    table = (4.54, 4.36), (4.21, 3.99), (1.95, 1.75)
    c11, c22, c23 = (np.interp(k, (0.7, 0.8), column) for column in table)
    return 8.2e10 * ab * c11, 8.2e10 * ab * c22, 8.2e10 * ab**1.5 * c23


def radial(places, longitudinal, lateral, curvature):
    """Lateral displacements and yaw angles of both wheelsets, linear equations of the steady curve.

    After Boocock (1969) and Newland (1968): creep forces, springs and conicity; with the roll of
    the cones on the heads (Wickens 1965), the gravitational stiffness and the forces of spin.
    """
    r0, b0, taper, head = 0.46, 0.753 - 0.3 * (0.05 - 0.025), 0.05, 0.3
    roll = taper / (b0 - r0 * taper)
    conicity = roll * (b0 + head * taper)
    base = places[0] - places[1]
    shares = -places[1] / base, places[0] / base
    matrix, given = np.zeros((6, 6)), np.zeros(6)  # y and yaw of front, rear, wagon
    for i, (x, share) in enumerate(zip(places, shares, strict=True)):
        weight = (20e3 * share + 1300.0) * GRAVITY
        f11, f22, f23 = creep_coefficients(0.5 * weight)
        y, yaw = 2 * i, 2 * i + 1
        # springs stretch by `stretch` u - `laid`: where the wheelset lies on the circle
        across, turn = np.zeros(6), np.zeros(6)
        across[[4, 5, y]], turn[[5, yaw]] = (1.0, x, -1.0), (1.0, -1.0)
        for k, stretch, laid in (
            (2.0 * lateral[i], across, 0.5 * x**2 * curvature),
            (2.0 * longitudinal[i], turn, x * curvature),
        ):
            matrix -= k * np.outer(stretch, stretch)
            given -= k * stretch * laid
        matrix[y, yaw] += 2.0 * f22
        matrix[y, y] -= weight * roll
        given[y] += 2.0 * f23 * curvature
        matrix[yaw, y] -= 2.0 * f11 * b0 * conicity / r0
        given[yaw] += 2.0 * f11 * b0**2 * curvature
    return np.linalg.solve(matrix, given)[:4].reshape(2, 2).T


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize(
    ("longitudinal", "lateral"),
    [((1e4, 1e4), (1e6, 1e6)), ((1e6, 8e6), (5e5, 3e6)), ((3e6, 3e6), (1e6, 1e6))],
)
def test_two_unlike_axles_steer_as_the_linear_theory_says(longitudinal, lateral, monkeypatch):
    """Wide curve, balanced, Kalker's linear theory, friction 1.5; 2 % of the largest.

    Of steady rolling, which the theory has whether it is stable or not.

    The front wheelset is farther from the middle, and the springs of both differ.
    """
    monkeypatch.setattr(stability_curving, "GROWS", np.inf)
    places = (3.0, -2.5)
    vehicle = two_axles(places, longitudinal, lateral)
    track = load_track("straight").replace(support={"preset": "rigid"}, friction=1.5)
    for radius in (10000.0, -10000.0):
        found = railsim.curving(
            vehicle, track, radius=radius, cant=0.02, settings=Settings(creep_law="linear")
        )
        y, yaw = radial(places, longitudinal, lateral, 1.0 / radius)
        assert found.lateral.ravel() == pytest.approx(y, abs=0.02 * np.max(np.abs(y)))
        # a yaw angle counts by the force of its creep against that of the displacements
        allowed = 0.02 * max(np.max(np.abs(yaw)), np.max(np.abs(y)) * 0.05 / 0.46)
        assert found.attack.ravel() == pytest.approx(yaw, abs=allowed)


def test_a_row_of_the_table_shows_the_leading_wheelset_and_its_outer_wheel():
    """With a cant deficiency the outer wheel carries more; all values in the units of the head."""
    coach = load_vehicle("coach_manchester")
    found = railsim.curving(coach, radius=[400.0, -400.0], cant_deficiency=0.1, friction=0.3)
    for k, row in enumerate(found.table().rows):
        outer = int(np.argmax(found.Q[k, 0, 0, 0]))
        assert outer == k  # left in a curve to the right
        of_wheel = (values[k, 0, 0, 0] for values in (found.lateral, found.attack))
        forces = (values[k, 0, 0, 0, outer] for values in (found.Q, found.Y, found.Y_over_Q))
        given = found.radius[k], 0.1, 0.3, np.sqrt(GRAVITY * 400.0 * 0.25 / 1.5)
        assert row[:9] == pytest.approx([*given, *of_wheel, *forces])
        assert row[9] == pytest.approx(sum(found.T_gamma[k].ravel()))
        assert row[10] == ""


def test_where_steady_rolling_is_unstable_values_are_means_of_the_motion():
    """R 3000 m at 62.6 m/s: a run from 1 mm beside the steady state hunts, at 44.3 m/s it does not.

    The wear number of that run is ten times that of the steady state, 84 N.
    """
    coach, track = load_vehicle("coach_manchester"), load_track("straight")
    found = railsim.curving(coach, track, radius=3000.0, cant=0.1, cant_deficiency=[0.0, 0.1])
    assert found.converged.ravel().tolist() == [1, 3]
    runs = []
    for speed in found.speed[0]:
        layout = [{"type": "CIR", "length": 1500.0, "radius": 3000.0}]
        curve = track.replace(plan=layout, cant=[{"type": "CST", "length": 1500.0, "cant": 0.1}])
        beside = Settings(initial={"rear.inner.wheelset": {"y": 1e-3}})
        run = railsim.simulate(coach, curve, speed=float(speed), duration=20.0, settings=beside)
        late = run["time"] > 8.0
        runs.append((run["wheelset_lateral"][late, 2], run["T_gamma"][late].sum(axis=(1, 2))))
    (steady, wear), (hunting, more) = runs
    assert np.ptp(steady) < 1e-4
    assert np.mean(steady) == pytest.approx(found.lateral[0, 0, 0, 2], abs=1e-4)
    assert np.ptp(hunting) > 5e-3
    assert found.T_gamma[0].sum(axis=(1, 2, 3)) == pytest.approx(
        [wear.mean(), more.mean()], rel=0.05
    )


def test_positions_in_a_curve_are_those_of_the_steady_state():
    track = load_track("straight")
    search = _Search(load_vehicle("coach_manchester"), track, 0.15, Settings(), None)
    point = search.point(500.0, 0.03, 0.3)
    found = search.empty([500.0], [0.03], [0.3])
    search.fill(found, (0, 0, 0), point)
    _, (state,), how = point
    index = search.model.index
    assert how == found.converged[0, 0, 0] == 1

    def of(names, component):
        return state[[index.coordinate(name, component) for name in names]]

    assert found.attack[0, 0, 0] == pytest.approx(of(found.wheelsets, 5))
    assert found.lateral[0, 0, 0] == pytest.approx(of(found.wheelsets, 1), abs=1e-5)
    assert found.bogies == ("front.frame", "rear.frame")
    assert found.steering[0, 0, 0] == pytest.approx(of(found.bogies, 5))
    assert found.car_roll[0, 0, 0] == pytest.approx(of(["carbody"], 3)[0])


@points(
    ("name", "radius"),
    [(name, r) for name in ("coach_manchester", "coach_flexicoil") for r in (250.0, -600.0)],
    always=(0, 3),
)
def test_newton_finds_the_end_of_a_long_run(name, radius):
    """Q2: 0.3 % of the largest, wheel by wheel; run: 10 s into the curve, then 30 s more."""
    speed, cant = 20.0, np.copysign(0.15, radius)
    found, solver, balance = curving(load_vehicle(name), radius, cant, speed)
    model, system = balance.model, solver.system
    there = load_track("curve_r250").replace(
        plan=[{"type": "CIR", "length": 100.0, "radius": radius}],
        cant=[{"type": "CST", "length": 100.0, "cant": cant}],
    )
    state = settle_in_curve(model, balance, there, 50.0, 1e-3)
    derivative, stages = np.zeros_like(state), np.zeros((3, len(state)))
    work = work_arrays(system)
    for _ in range(60):
        state[-2] = POSITION
        status, *_ = time_loop(
            system,
            work,
            state,
            derivative,
            stages,
            empty_recorder(model, 1),
            FAST,
            1e-3,
            Chunk(1, 500, 1 << 40),
        )
        assert status == 0
    for column in (W_Q, W_Y):
        wheel = solver.work.wheel[:, :, column]
        assert work.wheel[:, :, column] == pytest.approx(wheel, abs=3e-3 * np.max(np.abs(wheel)))
    own = [6 * b + k for b in system.contact.body for k in (1, 5)]
    for k in (0, 1):
        at_end, expected = state[own[k::2]], found[own[k::2]]
        assert at_end == pytest.approx(expected, abs=3e-3 * np.max(np.abs(expected)))


@pytest.mark.parametrize(
    ("radius", "cant", "speed"),
    [(250.0, 0.15, 20.0), (400.0, 0.05, 12.0), (3000.0, 0.1, 60.0), (-300.0, -0.12, 22.0)],
)
def test_sums_of_forces_by_newton_and_euler(radius, cant, speed):
    """Q2: total Q and Y of the vehicle from masses, positions and the circle alone; 0.1 %.

    Each mass moves on its own circle; forces along the normal at the middle of the vehicle.
    """
    found, solver, balance = curving(load_vehicle("coach_manchester"), radius, cant, speed)
    system, state, work = solver.system, found, solver.work
    kappa, angle = 1.0 / radius, np.arcsin(cant / 1.5)
    need = np.zeros(2)
    for b, mass in enumerate(system.bodies.mass):
        y, z = state[6 * b + 1 : 6 * b + 3] + system.bodies.nominal[b]
        right = y * np.cos(angle) - z * np.sin(angle)
        offset = system.frame_offset[system.bodies.frame[b]] * kappa
        # towards the centre at the body's own position; its share along the middle's normal
        inwards = speed**2 * kappa * (1.0 - kappa * right) * np.cos(offset)
        need += mass * np.array(
            [
                inwards * np.cos(angle) - GRAVITY * np.sin(angle),
                GRAVITY * np.cos(angle) + inwards * np.sin(angle),
            ]
        )
    got = np.zeros(2)
    for w, b in enumerate(system.contact.body):
        turned = system.frame_offset[system.bodies.frame[b]] * kappa
        Y, Q = work.wheel[w, :, W_Y].sum(), work.wheel[w, :, W_Q].sum()
        along = -work.rail_force[b, 0]  # on the rail
        level = Y * np.cos(angle) - Q * np.sin(angle)  # horizontal, along the wheelset's normal
        down = Q * np.cos(angle) + Y * np.sin(angle)
        level = level * np.cos(turned) - along * np.sin(-turned)
        got += [
            level * np.cos(angle) + down * np.sin(angle),
            down * np.cos(angle) - level * np.sin(angle),
        ]
    weight = GRAVITY * np.sum(system.bodies.mass)
    assert got[1] == pytest.approx(need[1], rel=1e-3)
    assert -got[0] == pytest.approx(need[0], abs=1e-3 * max(abs(need[0]), 0.1 * weight))
    assert balance.Q0.sum() == pytest.approx(weight, rel=1e-9)


def test_a_trial_far_from_the_steady_state_is_no_warning():
    # the forces of one of its trials overflow
    soft = railsim.load_vehicle("coach_manchester", ["primary.stiffness.x=5376310"])
    deficiency = 1.5 * 20.0**2 / (250.0 * GRAVITY) - 0.15
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        track = railsim.load_track("curve_r250")
        railsim.curving(soft, track, radius=250.0, cant_deficiency=deficiency)


def test_no_steady_state_is_said_with_what_is_unbalanced():
    """Twice the speed that overturns: no wheel load can carry it."""
    with pytest.raises(NotConverged, match="no steady state"):
        curving(test_vehicle("single_bogie"), 250.0, 0.0, 120.0)


@pytest.fixture(scope="module")
def coach():
    return steady(
        load_vehicle("benchmark_vehicle1"), load_track("straight"), Settings(), WALKING_PACE
    )


@pytest.mark.parametrize(
    ("millimetres", "coefficient", "lateral"),
    [(30.0, 0.1929, 15.6), (60.0, 0.1928, 31.1), (100.0, 0.1899, 48.2), (150.0, 0.1857, 64.2)],
)
def test_standing_on_cant(coach, millimetres, coefficient, lateral):
    """Q3: roll coefficient 0.5 %; the car's y 0.5 % with wheelsets held, 1 % rolling."""
    for held, tolerance in ((True, 5e-3), (False, 1e-2)):
        standing = on_cant(coach, load_track("straight"), 1e-3 * millimetres, held=held)
        s = roll_coefficient(coach.model, standing, 1e-3 * millimetres, "carbody")
        assert s == pytest.approx(coefficient, rel=5e-3)
        y = 1e3 * standing.state[coach.model.index.coordinate("carbody", 1)]
        assert y == pytest.approx(lateral, rel=tolerance)


def test_wheel_loads_on_cant_balance_the_weights_about_the_rails(coach):
    """Every weight has its own height and displacement as levers; the rails hold across, too."""
    cant = 0.1
    standing = on_cant(coach, load_track("straight"), cant, held=True)
    bodies, phi = coach.model.system.bodies, np.arcsin(cant / 1.5)
    moment = 0.0
    for b, mass in enumerate(bodies.mass):
        y, z = bodies.nominal[b] + standing.state[6 * b + 1 : 6 * b + 3]
        moment += mass * GRAVITY * (y * np.cos(phi) - z * np.sin(phi))
    right_less_left = standing.Q[:, 1].sum() - standing.Q[:, 0].sum()
    assert 0.75 * right_less_left == pytest.approx(moment, rel=5e-4)


BOGIE = 7e-3 * 2.56 * np.array([0.5, -0.5, 0.5, -0.5])
BODY = 0.053 * np.array([0.5, 0.5, -0.5, -0.5])


@pytest.mark.parametrize(
    ("heights", "expected"),
    [(BOGIE, 0.1781), (BODY, 0.1387), (BOGIE + BODY, 0.3169), (-BODY, 0.1387)],
)
def test_unloading_on_twist(coach, heights, expected):
    """Q4: dQ/Q0 of the worst wheel, wheelsets held across the track; 1 %."""
    standing = on_twist(coach, load_track("straight"), heights, held=True)
    assert standing.unloading == pytest.approx(expected, rel=1e-2)
    assert standing.Q.sum() == pytest.approx(coach.Q0.sum(), rel=1e-4)


def test_forces_in_a_twisted_curve_balance_and_add_up():
    """R 150 m with twists of bogie and body: sums by Newton-Euler, loads superposed."""
    vehicle = load_vehicle("benchmark_vehicle1")
    _, solver, balance = curving(vehicle, 150.0, 0.0, WALKING_PACE)
    track, twist = load_track("curve_r250"), 5e-3 * np.array([1.28, -1.28, 1.28, -1.28])
    twisted = on_twist(balance, track, twist, curvature=1.0 / 150.0)
    alone = on_twist(balance, track, twist)
    mass = twisted.Q0.sum() / GRAVITY
    assert twisted.Q.sum() == pytest.approx(twisted.Q0.sum(), rel=1e-3)
    centrifugal = -mass * WALKING_PACE**2 / 150.0
    # against wheel forces of 30 kN; the wheelsets' frames are canted by 4 mrad
    assert twisted.Y.sum() == pytest.approx(centrifugal, abs=1e-4 * twisted.Q0.sum())
    added = solver.work.wheel[:, :, W_Q] + alone.Q - alone.Q0
    # the twist alone moves 13 % of a load; the creep forces of rolling wheelsets do not superpose
    np.testing.assert_allclose(twisted.Q, added, atol=0.05 * twisted.Q0.max())


@pytest.fixture(scope="module")
def rolling_on_twist():
    """Bogie and body twist of rolling wheelsets over the primary's lateral stiffness [N/m]."""
    key = "assemblies.bogie.assemblies.axle.elements.primary.stiffness"
    found = {}
    for lateral in (3.884e6, 1e6, 3e5, 3e4):
        vehicle = load_vehicle("benchmark_vehicle1", [f"{key}=[31.391e6, {lateral}, 1.22e6]"])
        balance = steady(vehicle, load_track("straight"), Settings(), WALKING_PACE)
        found[lateral] = [
            (
                on_twist(balance, load_track("straight"), heights),
                on_twist(balance, load_track("straight"), heights, held=True),
            )
            for heights in (BOGIE, BODY)
        ]
    return found


def test_lateral_forces_of_rolling_wheelsets_add_to_a_bogie_twist(rolling_on_twist):
    """Axles canted against each other stand 2 r0 phi = 5.5 mm apart, which the primary resists.

    Its lateral forces, r0 above the rails, are not in the closed formula: the softer it is across,
    the smaller the unloading, down to the formula less the lean of the axles about the rails,
    2 r0 phi/1.5 m of Q0 (next test).
    """
    unloading = [rolling.unloading for (rolling, _), _ in rolling_on_twist.values()]
    held = [held.unloading for (_, held), _ in rolling_on_twist.values()]
    assert np.all(np.diff(unloading) < 0.0)
    assert 1.15 * 0.1781 < unloading[0] < 1.3 * 0.1781
    lean = 0.5 * 7e-3 * 2.56 / 1.5
    # 1 % as for held wheelsets; measured 0.7 %, with 30 kN/m of lateral stiffness left
    assert unloading[-1] == pytest.approx(0.1781 - 2.0 * 0.46 * lean / 1.5, rel=0.01)
    assert held == pytest.approx([0.1781] * len(held), rel=2e-3)
    # Q is normal to each canted plane
    rolling = rolling_on_twist[3.884e6][0][0]
    assert rolling.Q.sum() == pytest.approx(rolling.Q0.sum(), rel=1e-3)


def test_a_body_twist_moves_the_weight_above_rolling_wheelsets(rolling_on_twist):
    """Rolling axles lean about the rails, held ones about their middle: r0 phi aside.

    The weight 2 Q0 so far beside the middle loads the lower wheel: 2 r0 phi/1.5 m of Q0.
    """
    rolling, held = rolling_on_twist[3e5][1]
    lean = 0.5 * 0.053 / 1.5
    moved = [0.5 * np.abs(at.Q[:, 0] - at.Q[:, 1]) / at.Q0[:, 0] for at in (held, rolling)]
    less = moved[0] - moved[1]
    # an estimate without suspension, hence in the mean of all wheelsets
    assert np.mean(less) == pytest.approx(2.0 * 0.46 * lean / 1.5, rel=0.02)
    # leading wheelsets take 6 % less of the lateral force, whose lever is r0; what is left are
    # contacts up to 0.4 mm beside the middle, to the same side on both rails: 2 (0.4 mm)/1.5 m
    lateral = np.abs(rolling.Y.sum(axis=1)) / rolling.Q0[:, 0]
    assert np.all(lateral[[0, 2]] < 0.95 * lateral[[1, 3]])
    np.testing.assert_allclose(less, 0.46 * lateral / 1.5, atol=7e-4)


def test_bodies_turn_with_their_track_frames():
    """u = C^T w with C = C_z(yaw) C_x(roll) C_y(pitch); a wheelset's axes do not spin.

    For any angles and any angular velocity of the frames; the spin u_2 of a wheelset stays.
    """
    coach, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    model = steady(coach, track, Settings(), 20.0).model
    solver, rng = SteadyRolling(model, model.system), np.random.default_rng(7)
    state = rng.uniform(-0.6, 0.6, model.n_state)
    state[-1] = 20.0
    w = solver.work.frames[:, OMEGA : OMEGA + 3]
    w[:] = rng.uniform(-0.1, 0.1, w.shape)
    found = state.copy()
    solver._turn_with_frames(found[None])
    n, kinds = model.index.n_bodies, model.system.bodies.kind
    assert {WHEELSET} < set(kinds)
    angles = state[: 6 * n].reshape(n, 6)[:, 3:]
    before, after = (x[6 * n : 12 * n].reshape(n, 6)[:, 3:] for x in (state, found))
    for b, (roll, pitch, yaw) in enumerate(angles):
        spins = kinds[b] == WHEELSET
        C = rotation(yaw, 2) @ rotation(roll, 0) @ rotation(0.0 if spins else pitch, 1)
        u = 20.0 * C.T @ w[model.system.bodies.frame[b]]
        u[1] = before[b, 1] if spins else u[1]
        np.testing.assert_allclose(after[b], u, atol=1e-12)


def test_a_way_on_which_a_flange_touches_is_passed_where_accelerations_lead():
    """There slopes change at once: Newton's method stopped at 89 %, and a run had to be taken."""
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.radius"
    coach = load_vehicle("coach_manchester", [f"{key}=[0.4598, 0.4602]"])
    track = load_track("straight").replace(friction=[0.3, 0.1])
    found = railsim.curving(coach, track, radius=2000.0, cant=0.0, cant_deficiency=0.11)
    assert found.converged.item() == 1
    held = -(43628.0 + 2.0 * 2615.0 + 4.0 * 1813.0) * GRAVITY * 0.11 / 1.5
    assert found.sum_Y.sum() == pytest.approx(held, rel=1e-3)
