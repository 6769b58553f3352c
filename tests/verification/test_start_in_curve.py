"""A run that begins in a curve in its steady state: what a long run-in comes to."""

from types import SimpleNamespace

import numpy as np
import pytest
from dynamics import load_vehicle
from rig import test_vehicle

import railsim
from railsim.constants import GRAVITY
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.flatten import flatten
from railsim.kernels import state as state_columns
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.status import RUNNING
from railsim.kernels.time_loop import RK4, time_loop
from railsim.linear.steady import NotConverged
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.work import work_arrays
from railsim.simulation import auxiliary_track, run_in
from railsim.stability import curving as stability_curving

STEADY = Settings(start_state="steady")
SPEED = 20.0
LONG = 40.0  # s in the curve: the slowest mode, the car's sway, decays with 0.25 1/s at least


def curve(support, radius=250.0):
    """A long curve with cant."""
    track = railsim.load_track("curve_r250").replace(
        plan=[{"type": "CIR", "length": 400.0, "radius": radius}],
        cant=[{"type": "CST", "length": 400.0, "cant": np.copysign(0.15, radius)}],
    )
    return track.replace(support={"preset": "rigid"}) if support == "rigid" else track


def started(vehicle, track, remark=None):
    """Wheel forces and internal states where a run begins, each over its own scale."""
    balance = equilibrium(assemble(vehicle, track, Settings()), SPEED)
    model = balance.model
    state, _ = run_in.start_state(model, balance, track, 200.0, 1e-3, 0, None, remark)
    work, derivative = work_arrays(model.system), np.zeros_like(state)
    right_hand_side(model.system, work, state, derivative)
    inner = slice(12 * model.index.n_bodies, 12 * model.index.n_bodies + len(work.drive))
    return work.wheel[:, :, [W_Q, W_Y]] / balance.Q0.mean(), state[inner] / balance.Q0.mean()


@pytest.mark.parametrize(
    ("name", "support", "radius"),
    [("coach_manchester", "rigid", -400.0), ("coach_flexicoil", "elastic", 300.0)],
)
def test_steady_start_is_the_end_of_a_long_run_in(name, support, radius, monkeypatch):
    """Forces of wheels and dampers within 1e-4 of the wheel load; exp(-0.25 * 40) is 5e-5."""
    monkeypatch.setattr(run_in, "TIMES", (4.0, LONG))
    vehicle, track, remarks = load_vehicle(name), curve(support, radius), []
    newton, run = started(vehicle, track, remarks.append), started(vehicle, track)
    assert not remarks
    for one, other in zip(newton, run, strict=True):
        assert one == pytest.approx(other, abs=1e-4)


@pytest.mark.parametrize("remark", [None, print])
@pytest.mark.parametrize(("radius", "cant"), [(1000.0, 0.0), (-1000.0, 0.0), (np.inf, 0.06)])
def test_rails_guide_by_what_curve_or_cant_alone_asks_for(radius, cant, remark, monkeypatch):
    """Sum of Y over that of Q: h/1.5 m - v^2/(R g), radii positive to the right; 10 % after 2 s."""
    monkeypatch.setattr(run_in, "TIMES", (2.0, 2.0))
    kind = {"type": "STR"} if np.isinf(radius) else {"type": "CIR", "radius": radius}
    track = railsim.load_track("straight").replace(
        plan=[{**kind, "length": 400.0}], cant=[{"type": "CST", "length": 400.0, "cant": cant}]
    )
    Q, Y = started(load_vehicle("coach_manchester"), track, remark)[0].sum(axis=(0, 1))
    quotient = Y / Q
    assert quotient == pytest.approx(cant / 1.5 - SPEED**2 / radius / 9.81, rel=0.1)


def test_nothing_moves_in_a_run_from_the_steady_state():
    """1 s on elastic rails; 1e-5 of the static wheel load is what Newton's method leaves."""
    result = railsim.simulate(
        load_vehicle("coach_manchester"),
        curve("elastic", 500.0),
        speed=SPEED,
        start=100.0,
        duration=1.0,
        settings=STEADY,
    )
    assert result.remarks == ()
    for values in (result.Q, result.Y):
        assert np.max(np.ptp(values, axis=0)) < 1e-5 * np.max(result.Q0)


def test_where_newton_fails_the_run_in_is_used_which_is_said(monkeypatch):
    """The same state as without asking for the steady one, and a remark."""

    def failed(*_):
        raise NotConverged("no steady state; it was not looked for")

    monkeypatch.setattr(run_in, "follow", failed)
    monkeypatch.setattr(run_in, "TIMES", (1.0, 1.0))
    vehicle, track, remarks = load_vehicle("coach_manchester"), curve("rigid", 600.0), []
    assert np.array_equal(started(vehicle, track, remarks.append)[0], started(vehicle, track)[0])
    assert remarks == [
        "The run begins with a run-in, as Newton's method found no steady state; "
        "it was not looked for."
    ]


def test_friction_elements_need_their_run_in(monkeypatch):
    """What they hold depends on the way into the curve."""
    monkeypatch.setattr(run_in, "TIMES", (1.0, 1.0))
    remarks = []
    started(test_vehicle("two_axle_wagon"), curve("rigid", 600.0), remarks.append)
    assert remarks == [
        "The run begins with a run-in: the forces of friction elements depend on the history."
    ]


def test_curving_has_what_the_way_leaves_in_friction_elements():
    """Means of a run of 15 s in the curve, of quotients too: it does not come to rest.

    The table of the two curves is of the outer wheel on either hand.
    """
    wagon, radius, cant = load_vehicle("wagon_y25"), 300.0, 0.1
    found = railsim.curving(wagon, radius=[radius, -radius], cant=cant, cant_deficiency=[0.1])
    assert any("friction elements hold" in remark for remark in found.remarks)
    right, left = found.table().records()
    for name in ("Q", "Y_over_Q", "T_gamma"):
        assert left[name] == pytest.approx(right[name], rel=1e-3)
    for name in ("Y", "lateral", "attack"):
        assert left[name] == pytest.approx(-right[name], rel=1e-3)
    assert right["Y_over_Q"] == pytest.approx(-right["Y"] / right["Q"], rel=1e-4)
    track = railsim.load_track("straight").replace(
        plan=[
            {"type": "STR", "length": 30.0},
            {"type": "CLO", "length": 80.0},
            {"type": "CIR", "length": 420.0, "radius": radius},
        ],
        cant=[
            {"type": "CST", "length": 30.0, "cant": 0.0},
            {"type": "LIR", "length": 80.0},
            {"type": "CST", "length": 420.0, "cant": cant},
        ],
    )
    run = railsim.simulate(wagon, track, speed=float(found.speed[0, 0]), until=400.0)
    still = run["distance"] > 340.0
    for name, values in (("Q", found.Q), ("Y", found.Y), ("T_gamma", found.T_gamma)):
        size = np.abs(values[0, 0, 0]).max()
        assert run[name][still].mean(axis=0) == pytest.approx(values[0, 0, 0], abs=0.03 * size)


def test_mean_of_a_vehicle_that_does_not_come_to_rest_in_a_curve(monkeypatch):
    """The sway of the two-axle wagon at 20 m/s lasts: all wheels hold what the cant does not."""
    monkeypatch.setattr(stability_curving, "SETTLING", 5.0)
    wagon, radius, cant = load_vehicle("wagon_uic_link"), 600.0, 0.1
    found = railsim.curving(wagon, radius=[radius], cant=cant, cant_deficiency=[0.05])
    assert found.converged.item() == stability_curving.MEAN
    square, phi = float(found.speed[0, 0]) ** 2, np.arcsin(cant / 1.5)
    beyond = square / radius * np.cos(phi) / 9.81 - np.sin(phi)
    weight = railsim.static_loads(wagon).Q0.sum()
    assert -found.sum_Y.sum() == pytest.approx(beyond * weight, rel=0.02)


@pytest.mark.parametrize("steps", [1, 2, 3, 7])
def test_a_way_of_any_number_of_steps_takes_each_of_them_and_records_none(steps, monkeypatch):
    """There is room for one record; a row at every second of three steps would be beyond it."""
    taken = []

    def loop(*arguments):
        chunk = arguments[-1]
        numbers = range(chunk.first, chunk.first + chunk.steps)
        assert chunk.every > numbers[-1]  # its numbers begin with 1
        assert bool(chunk.fresh) == (chunk.first == 1)
        taken.extend(numbers)
        return time_loop(*arguments)

    monkeypatch.setattr(auxiliary_track, "time_loop", loop)
    track = railsim.load_track("straight")
    balance = equilibrium(assemble(load_vehicle("coach_manchester"), track, Settings()), SPEED)
    monkeypatch.setattr(auxiliary_track, "WHEELSET_STEPS", 4 * 3)  # calls of three steps
    state = balance.state.copy()
    state[state_columns.SPEED] = SPEED
    begin = state[state_columns.ARC_LENGTH]
    way = balance.model, balance.model.system, state, 1e-3, steps, RK4
    assert auxiliary_track.advance(*way) == RUNNING
    assert taken == list(range(1, steps + 1))
    assert state[state_columns.ARC_LENGTH] - begin == pytest.approx(SPEED * 1e-3 * steps)


@pytest.mark.parametrize("start", ["run-in", "steady"])
def test_rails_are_supported_on_the_way_as_at_the_start(start):
    """Where rails are soft all around the start, what they are elsewhere makes no difference."""
    plan = [{"type": "CIR", "length": 800.0, "radius": 400.0}]
    cant = [{"type": "CST", "length": 800.0, "cant": 0.1}]
    curve = railsim.load_track("straight").replace(plan=plan, cant=cant)
    soft, stiff_before = (
        curve.replace(support={"preset": "ballasted", "variation": rows})
        for rows in ([[0.0, 0.3]], [[0.0, 1.0], [200.0, 1.0], [250.0, 0.3]])
    )
    coach, settings = railsim.load_vehicle("coach_manchester"), Settings(start_state=start)
    runs = [
        railsim.simulate(coach, track, speed=20.0, start=400.0, duration=1.0, settings=settings)
        for track in (soft, stiff_before)
    ]
    for run in runs:
        lateral = run["wheelset_lateral"][:, 0]
        assert lateral == pytest.approx(np.full(len(lateral), lateral[-1]), abs=2e-5)
    np.testing.assert_allclose(runs[0].Y, runs[1].Y, atol=1.0)


def test_rails_are_supported_as_at_the_start_between_two_rows():
    """Wheels begin within 2 kN (Y) and 5 kN (Q): their own places differ by 4 % of the factor."""
    plan = [{"type": "CIR", "length": 800.0, "radius": 400.0}]
    cant = [{"type": "CST", "length": 800.0, "cant": 0.1}]
    curve = railsim.load_track("straight").replace(plan=plan, cant=cant)
    varying, alike = (
        railsim.simulate(
            railsim.load_vehicle("coach_manchester"),
            curve.replace(support={"preset": "ballasted", "variation": rows}),
            speed=20.0, start=400.0, duration=0.05, settings=Settings(start_state="run-in"),
        )
        for rows in ([[300.0, 1.0], [500.0, 0.4]], [[0.0, 0.7]])
    )  # fmt: skip
    np.testing.assert_allclose(varying.Y, alike.Y, atol=2e3)
    np.testing.assert_allclose(varying.Q, alike.Q, atol=5e3)


@pytest.mark.parametrize(
    "changing",
    [
        {"support": {"variation": [[0.0, 1.0], [195.0, 1.0], [205.0, 5.0]]}},
        {"friction_table": [[0.0, 0.4], [180.0, 0.4], [195.0, 0.1]]},
    ],
)
def test_a_start_where_support_or_friction_changes_is_that_of_a_run_from_before(changing):
    """In Q and Y within 1 % of the wheel load, the vehicle standing on both sides of the change."""
    track = curve("elastic", 400.0).replace(**changing)
    coach, settings = railsim.load_vehicle("coach_manchester"), STEADY
    before, there = (
        railsim.simulate(coach, track, speed=SPEED, start=start, until=202.0, settings=settings)
        for start in (150.0, 200.0)
    )
    for name in ("Q", "Y"):
        forces = before[name].reshape(len(before.time), -1).T
        passed = np.array([np.interp(there.distance, before.distance, row) for row in forces]).T
        np.testing.assert_allclose(
            there[name].reshape(passed.shape), passed, atol=0.01 * there.Q0.mean()
        )


def test_way_to_a_start_on_uneven_rails_begins_before_the_transition():
    """The left rail 5 mm outwards all along: wheelsets within 10 um where the whole run has them.

    60 m before the start the vehicle is in the middle of the transition, twisted between curves.
    """
    coach = railsim.load_vehicle("coach_manchester")
    wide = railsim.load_track("curve_r250").replace(gauge_widening=[[0.0, 5e-3, 0.0]])
    here = railsim.simulate(coach, wide, speed=15.0, start=390.0, duration=0.01)
    way = railsim.simulate(coach, wide, speed=15.0, start=200.0, until=390.0)
    np.testing.assert_allclose(here.wheelset_lateral[0], way.wheelset_lateral[-1], atol=1e-5)
    np.testing.assert_allclose(here.Q[0], way.Q[-1], atol=5e-4 * way.Q.max())


def test_arms_turn_about_their_bushes_where_wheelsets_are_put_on_irregular_rails():
    """The end of the arm, x ahead of the axle and y beside it, stays at its height and at rest."""
    rough = {"type": "random", "spectrum": "erri_b176_high", "seed": 3, "fade": 0.0}
    track = railsim.load_track("straight").replace(irregularities=[rough])
    balance = equilibrium(
        assemble(railsim.load_vehicle("coach_flexicoil"), track, Settings()), SPEED
    )
    model, state = balance.model, balance.state.copy()
    state[-2] = 100.0
    run_in.follow_rails(model, state)
    moved = (state - balance.state)[: 12 * model.index.n_bodies].reshape(2, -1, 6)  # and rates
    for name, axle in zip(model.index.bodies, model.system.bodies.parent, strict=True):
        if axle < 0:
            continue
        x = 0.4 if ("inner" in name) == name.startswith("front") else -0.4
        y = 1.0 if name.endswith("right") else -1.0
        pitch = moved[:, model.index.bodies.index(name), 4]
        z, roll = moved[:, axle, 2], moved[:, axle, 3]
        assert np.abs(z[0]) > 1e-4
        np.testing.assert_allclose(x * pitch, z + y * roll, rtol=1e-2)  # the nest gives way too


@pytest.mark.parametrize("rows", [[[0.0, 0.3]], [[0.0, 1.0], [90.0, 1.0], [110.0, 0.5]]])
def test_on_straight_track_wheels_begin_on_the_rails_as_they_are_supported(rows):
    """Softer rails are pressed down further: nothing drops onto them when the run begins."""
    straight = railsim.load_track("straight")
    track = straight.replace(support={"preset": "ballasted", "variation": rows})
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), track, speed=5.0, start=100.0, duration=0.05
    )
    np.testing.assert_allclose(run.Q, np.broadcast_to(run.Q0, run.Q.shape), rtol=2e-2)
    np.testing.assert_allclose(run.Q[0], run.Q0, rtol=1e-3)


@pytest.mark.parametrize(("curvature", "cant", "asked"), [
    (0.0, 0.0, False), (2e-3, 0.0, True), (0.0, 0.1, True), (-2e-3, -0.1, True),
])  # fmt: skip
def test_friction_elements_begin_with_a_run_in_on_curve_or_cant_alone(
    monkeypatch, curvature, cant, asked
):
    monkeypatch.setattr(run_in, "_curve", lambda track, s: (curvature, cant))
    internal = SimpleNamespace(kind=np.array([run_in.PAD]))
    model, said = SimpleNamespace(system=SimpleNamespace(internal=internal)), []
    assert run_in._steady(model, None, None, 100.0, said.append) is None
    assert len(said) == asked


@pytest.mark.parametrize("name", ["coach_manchester", "wagon_y25"])
def test_a_free_run_on_a_gradient_begins_with_the_acceleration_that_it_keeps(name):
    """V' = -g sin(a) m/(m + sum I/r^2), and wheel loads that do not change: no shock at the start.

    From the state of a vehicle held at its speed they swayed by 0.4 and 2.2 % for seconds.
    """
    track = railsim.load_track("straight")
    rising = track.replace(vertical=[{"type": "CST", "length": track.length, "gradient": 0.04}])
    settings = Settings(drive={"mode": "free"})
    how = {"speed": 20.0, "start": 100.0, "duration": 1.0, "settings": settings}
    result = railsim.simulate(railsim.load_vehicle(name), rising, **how)
    assert np.ptp(result.Q, axis=0).max() < 5e-5 * result.Q0.mean()
    flat = flatten(railsim.load_vehicle(name))
    mass = sum(body.mass for body in flat.bodies)
    wheelsets = flat.of_kind("wheelset")
    rolling = sum(each.inertia[1] / np.mean(each.wheelset.radius) ** 2 for each in wheelsets)
    expected = -GRAVITY * np.sin(np.arctan(0.04)) * mass / (mass + rolling)
    assert 2.0 * (np.ptp(result.distance) - 20.0) == pytest.approx(expected, rel=1e-3)


def test_a_run_within_a_speed_ramp_begins_with_its_acceleration():
    """Wheel loads stay within 5e-4 in 1 s at 1 m/s2, where creep alone changes them; 1 % before."""
    ramp = [[float(s), float(np.sqrt(400.0 + 2.0 * (s - 100.0)))] for s in range(0, 400, 10)]
    settings = Settings(drive={"mode": "table", "speed_table": ramp})
    how = {"speed": 20.0, "start": 100.0, "duration": 1.0, "settings": settings}
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    result = railsim.simulate(coach, track, **how)
    assert np.ptp(result.Q, axis=0).max() < 5e-4 * result.Q0.mean()
