"""What the track does to a vehicle: vertical profile, cant, friction, gauge, irregularities."""

from pathlib import Path

import numpy as np
import pytest
from dynamics import Settings, evaluate, load_vehicle, steady
from rig import test_vehicle
from selection import points

from railsim.definitions.loading import load_track
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.definitions.track.definition import Track
from railsim.kernels.contact_columns import W_NORMAL
from railsim.kernels.support import FORCE_TOLERANCE
from railsim.simulation import simulate
from railsim.simulation.run_in import follow_rails

DATA = Path(__file__).parents[1] / "data"

G = 9.81


def track(plan=None, **more):
    plan = plan or [{"type": "STR", "length": 1000.0}]
    return Track.model_validate({"format": "railsim-track/1", "name": "t", "plan": plan, **more})


def curve(radius=500.0, cant=0.1, length=250.0, **more):
    """Straight, clothoid, a long circle."""
    return track(
        [
            {"type": "STR", "length": 20.0},
            {"type": "CLO", "length": 80.0},
            {"type": "CIR", "length": length, "radius": radius},
        ],
        cant=[
            {"type": "CST", "length": 20.0, "cant": 0.0},
            {"type": "LIR", "length": 80.0},
            {"type": "CST", "length": length, "cant": cant},
        ],
        **more,
    )


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def masses(vehicle):
    """Mass of a vehicle and what its wheelsets' rotation adds [kg]."""
    system = steady(vehicle, track(), Settings(), 10.0).model.system
    axles = system.contact.body
    turning = np.sum(system.bodies.inertia[axles, 1] / system.bodies.radius[axles] ** 2)
    return np.sum(system.bodies.mass), turning


# vertical profile ---------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_crest_takes_and_sag_gives_the_load_of_m_v2_over_r(coach, sign):
    """R 10 km at 40 m/s: 1.63 % of the weight, met to 1 % of itself where the bounce has died."""
    gradient = 0.02 * sign
    profile = track(
        vertical=[
            {"type": "CST", "length": 100.0, "gradient": gradient},
            {"type": "LIR", "length": 400.0},
            {"type": "CST", "length": 500.0, "gradient": -gradient},
        ]
    )
    result = simulate(coach, profile, speed=40.0, until=420.0)
    middle = (result.distance > 330.0) & (result.distance < 400.0)
    mass, _ = masses(coach)
    lost = mass * G - result.Q.sum(axis=(1, 2))[middle]
    expected = sign * mass * 40.0**2 * (2 * 0.02 / 400.0)
    assert np.mean(lost) == pytest.approx(expected, rel=0.01)
    assert lost == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("slope", [0.04, -0.04])
def test_run_begins_on_a_gradient_as_it_goes_on(coach, slope):
    """Sum of Q = m g cos(theta); the force that holds the speed has its share in single loads."""
    profile = track(vertical=[{"type": "CST", "length": 1000.0, "gradient": slope}])
    result = simulate(coach, profile, speed=20.0, start=100.0, duration=2.0)
    mass, _ = masses(coach)
    total = result.Q.sum(axis=(1, 2))
    np.testing.assert_allclose(total, mass * G * np.cos(np.arctan(slope)), rtol=1e-6)
    np.testing.assert_allclose(result.Q, result.Q[:1].repeat(len(total), axis=0), atol=5.0)
    # the leading wheelset has more load uphill, and the last one downhill
    assert np.diff(result.Q[0, [0, -1], 0]) * slope < 0.0


def test_run_begins_in_a_curve_on_a_gradient_with_the_load_there(coach):
    """Sum of Q = m cos(theta) (g cos(phi) + V^2/R sin(phi)); the level one is 0.18 % more."""
    slope, radius, cant = 0.06, 500.0, 0.1
    level = [{"type": "CST", "length": 350.0, "gradient": slope}]
    result = simulate(
        coach, curve(radius, cant, vertical=level), speed=20.0, start=200.0, until=240
    )
    mass, _ = masses(coach)
    phi = np.arcsin(cant / 1.5)
    expected = mass * (G * np.cos(phi) + 20.0**2 / radius * np.sin(phi))
    total = result.Q.sum(axis=(1, 2))
    np.testing.assert_allclose(total, expected * np.cos(np.arctan(slope)), rtol=1e-4)


def test_free_coach_rolls_down_a_gradient_less_its_resistance(coach):
    """V' = (m g sin(theta) - W - W_c) / (m + sum(I/r0^2)), once the jerk of the start has died.

    W_c is what the creep forces take, T_x xi_x + T_y xi_y + M_z phi of all wheels: the spin of
    conical wheels costs 20 N.  Within 0.02 %: the wheels roll on radii a little off r0, 4 % of the
    mass turns with them.
    """
    slope, resistance = 0.02, 2000.0
    profile = track(vertical=[{"type": "CST", "length": 1000.0, "gradient": -slope}])
    drive = {"mode": "free", "resistance": (resistance, 0.0, 0.0)}
    result = simulate(coach, profile, speed=20.0, duration=8.0, settings=Settings(drive=drive))
    t, s = result.time, result.distance
    late = t > 4.0
    rate = 2.0 * np.polyfit(t[late], s[late], 2)[0]
    mass, turning = masses(coach)
    creep = (result.T_gamma + result.T_gamma_spin)[-1].sum()
    expected = (mass * G * np.sin(np.arctan(slope)) - resistance - creep) / (mass + turning)
    assert creep == pytest.approx(20.0, abs=2.0)
    assert rate == pytest.approx(expected, rel=2e-4)


def test_traction_accelerates_the_mass_and_the_turning_wheels(coach):
    """Within 0.1 %, as above: also the spin, which `fast` integrates linearly implicitly."""
    drive = {"mode": "free", "traction_table": ((0.0, 30e3), (100.0, 30e3))}
    result = simulate(coach, track(), speed=20.0, duration=8.0, settings=Settings(drive=drive))
    late = result.time > 4.0
    rate = 2.0 * np.polyfit(result.time[late], result.distance[late], 2)[0]
    mass, turning = masses(coach)
    assert rate == pytest.approx(30e3 / (mass + turning), rel=1e-3)


def test_frictional_power_is_what_a_coasting_coach_loses_in_a_curve(coach):
    """(m + sum(I/r0^2)) V V' = -P, once it has settled; the yawing bodies hold 0.05 % more."""
    settings = Settings(drive={"mode": "free"}, outputs={"frictional_power": True})
    result = simulate(coach, curve(), speed=20.0, settings=settings)
    t, s = result.time, result.distance
    late = t > t[-1] - 2.0
    rate, speed = np.polyfit(t[late] - t[-1] + 1.0, s[late], 2)[:2] * (2.0, 1.0)
    mass, turning = masses(coach)
    power = result["frictional_power"][late].sum(axis=(1, 2)).mean()
    assert power > 5e3
    assert power == pytest.approx(-(mass + turning) * speed * rate, rel=0.01)


def test_cant_about_the_inner_rail_is_cant_about_the_centre_when_steady(coach):
    centre = simulate(coach, curve(), speed=20.0)
    inner = simulate(coach, curve(cant_rotation="inner_rail"), speed=20.0)
    last = slice(-100, None)
    # what is left of the bounce on the ramp: the centre line rises by 50 mm in the second case
    assert inner.Q[last] == pytest.approx(centre.Q[last], rel=2e-3)
    assert np.max(np.abs(inner.Y[last] - centre.Y[last])) < 100.0


# rails --------------------------------------------------------------------------------------------


def test_friction_counts_by_side_and_along_the_track(coach):
    """The right rail loses its friction at s = 50 m, the left one at 250 m."""
    rows = (
        (0.0, 0.4, 0.4),
        (50.0, 0.4, 0.4),
        (50.5, 0.4, 0.0),
        (250.0, 0.4, 0.0),
        (250.5, 0.0, 0.0),
        (1000.0, 0.0, 0.0),
    )
    result = simulate(coach, curve(friction_table=rows), speed=20.0)
    s = result.wheelset_distance
    wear = result.T_gamma + result.T_gamma_spin
    in_curve = (s > 180.0) & (s < 249.0)
    assert np.all(wear[:, :, 1][s > 51.0] == 0.0)
    assert np.all(wear[:, :, 0][s > 251.0] == 0.0)
    assert np.all(wear[s < 49.0] > 0.0)
    assert np.max(wear[:, 0, 0][in_curve[:, 0]]) > 10.0


def test_coach_runs_with_one_rail_without_friction(coach):
    """Nothing guides the wheelsets then; they drift, slowly, and their loads stay."""
    result = simulate(coach, track(friction=[0.4, 0.0]), speed=20.0, until=200.0)
    assert result.status == "complete"
    assert np.all(result.T_gamma[:, :, 1] == 0.0)
    assert np.max(np.abs(result.wheelset_lateral)) < 5e-3
    assert np.max(np.abs(result.dQ_over_Q0)) < 0.05


def test_creep_forces_stay_within_friction(coach):
    balance = steady(coach, curve(friction=[0.4, 0.2]), Settings(), 20.0)
    model = balance.model
    state = balance.state.copy()
    for k, wheelset in enumerate(model.index.wheelsets):
        state[model.index.coordinate(wheelset, 5)] += 8e-3 * (-1) ** k
    work, _ = evaluate(model.system, state)
    for w, body in enumerate(model.system.contact.body):
        limit = 0.4 * work.wheel[w, 0, W_NORMAL] + 0.2 * work.wheel[w, 1, W_NORMAL]
        assert 0.8 * limit < np.hypot(*work.rail_force[body, :2]) < 1.2 * limit


def test_wider_gauge_lets_the_guiding_wheel_run_further_out(coach):
    """In flange contact the leading wheelset follows the outer rail: by what the gauge gains.

    The middle of the rails moves by half of that.
    """
    widening = 0.006
    rows = ((0.0, widening, 0.0), (1000.0, widening, 0.0))
    usual = simulate(coach, curve(250.0, 0.1, length=150.0), speed=15.0)
    wide = simulate(coach, curve(250.0, 0.1, length=150.0, gauge_widening=rows), speed=15.0)
    moved = wide.wheelset_lateral[-1, 0] - usual.wheelset_lateral[-1, 0]
    assert moved == pytest.approx(-0.5 * widening, abs=0.1e-3)
    leading = wide.bodies.index(wide.wheelsets[0])
    moved = wide.body_position[-1, leading, 1] - usual.body_position[-1, leading, 1]
    assert moved == pytest.approx(-widening, abs=0.1e-3)


@pytest.mark.usefixtures("small_contact_tables")
def test_widening_of_one_rail_moves_the_middle(coach):
    """On the straight the coach settles in the middle of its rails: half of the widening aside."""
    rows = ((0.0, 0.0, 0.004), (1000.0, 0.0, 0.004))
    result = simulate(coach, track(gauge_widening=rows), speed=15.0, until=400.0)
    last = result.distance > 350.0
    assert result.wheelset_lateral[last] == pytest.approx(0.0, abs=0.1e-3)
    wheelsets = [result.bodies.index(name) for name in result.wheelsets]
    assert result.body_position[last][:, wheelsets, 1] == pytest.approx(0.002, abs=0.1e-3)


def test_reverse_curve_mirrors_the_first_one(coach):
    """Steady values of the second curve are those of the first with left and right exchanged."""

    def arc(radius):
        return [
            {"type": "CLO", "length": 60.0},
            {"type": "CIR", "length": 160.0, "radius": radius},
            {"type": "CLO", "length": 60.0},
        ]

    def cant(height):
        return [
            {"type": "LIR", "length": 60.0},
            {"type": "CST", "length": 160.0, "cant": height},
            {"type": "LIR", "length": 60.0},
        ]

    straight = [{"type": "STR", "length": 20.0}]
    level = [{"type": "CST", "length": 20.0, "cant": 0.0}]
    reverse = track(
        straight + arc(400.0) + straight + arc(-400.0) + straight,
        cant=level + cant(0.1) + level + cant(-0.1) + level,
    )
    result = simulate(coach, reverse, speed=15.0)
    first = int(np.argmin(np.abs(result.distance - 225.0)))
    second = int(np.argmin(np.abs(result.distance - 525.0)))
    assert result.Q[second, :, ::-1] == pytest.approx(result.Q[first], rel=3e-3)
    assert np.max(np.abs(result.Y[second, :, ::-1] + result.Y[first])) < 150.0
    assert np.abs(result.Y[first]).max() > 10e3


# irregularities -----------------------------------------------------------------------------------


def harmonic(wavelength, amplitude, length=200.0, rails=("left", "right")):
    s = np.arange(20.0, length, wavelength / 40.0)
    z = amplitude * np.sin(2.0 * np.pi * (s - 20.0) / wavelength)
    rows = [
        (a, 0.0, b * ("left" in rails), 0.0, b * ("right" in rails))
        for a, b in zip(s.tolist(), z.tolist(), strict=True)
    ]
    return {"type": "measured", "rows": rows, "fade": 10.0}


def test_wheels_follow_a_slow_vertical_wave(coach):
    """At 5 m/s over 10 m waves (0.5 Hz) the wheelsets ride the wave, height for height.

    Heights count from those before the wave.  What is left is the change of the contact's elastic
    approach, 1 um for a load change of 2 %.
    """
    irregular = track(irregularities=[harmonic(10.0, 3e-3)])
    result = simulate(coach, irregular, speed=5.0, until=150.0)
    bodies = list(result.coordinates["body"])
    axles = [bodies.index(name) for name in result.coordinates["wheelset"]]
    z = result.body_position[:, axles, 2]
    s = result.wheelset_distance
    inside = (s > 40.0) & (s < 140.0)
    wave = 3e-3 * np.sin(2.0 * np.pi * (s - 20.0) / 10.0)
    assert np.max(np.abs(z - z[0] - wave)[inside]) < 5e-6


@pytest.mark.usefixtures("small_contact_tables")
def test_rates_of_irregularities_reach_the_contact():
    """A single wheelset is thrown up with the rail's vertical velocity: m z'' = Q - m g.

    Over waves of 5 m at 10 m/s z'' = 1 mm (2 pi 2 Hz)^2 = 0.158 m/s2, 1.6 % of its weight: the
    wheel force follows within 2 % of that; without the rail's rate in the contact damping and in
    the creepage it would not.
    """
    wheelset = test_vehicle("single_wheelset")
    irregular = track(irregularities=[harmonic(5.0, 1e-3)])
    result = simulate(wheelset, irregular, speed=10.0, until=120.0)
    s = result.distance
    inside = (s > 40.0) & (s < 110.0)
    wave = -1e-3 * (2.0 * np.pi * 2.0) ** 2 * np.sin(2.0 * np.pi * (s - 20.0) / 5.0)
    force = result.Q.sum(axis=(1, 2)) - 1813.0 * G
    # down is positive: a downward acceleration takes load off
    assert np.max(np.abs(force + 1813.0 * wave)[inside]) < 0.02 * 1813.0 * 0.158


def test_slow_run_over_a_twist_gives_the_static_change_of_load():
    """Wagon on linear springs: dQ 2 b0 = k b_s^2 theta, theta the twist over the wheelbase.

    Each axle's springs have the roll stiffness 2 k b_s^2, both are in series over the stiff body.
    2 b0 = 1.506 m between the contacts of S1002 on 60E1.  The rails are level under the wagon's
    middle, so that it does not lean to a side as a whole.  Within 2 %: the axles run up to 3 mm
    beside the middle of the rails with 98 kN on them, against a moment of 26 kN m (1 %), and the
    contacts turn a little under them (0.6 %).
    """
    wagon = test_vehicle("two_axle_wagon")
    data = wagon.model_dump(exclude_none=True)
    k = 4.0e6
    axle = data["assemblies"]["axle"]
    axle["elements"] = {
        "spring": {
            "kind": "bushing",
            "bodies": ["wagon", "wheelset"],
            "point": [0.0, 1.0, -0.46],
            "sides": "both",
            "stiffness": [5e6, 5e6, k],
            "damping": [0.0, 0.0, 40e3],
        }
    }
    wagon = type(wagon).model_validate(data)
    ramp = 1e-3  # cross level per metre
    s = np.arange(0.0, 80.0, 0.5)
    level = ramp * (np.abs(s - 37.5) - 17.5) * (s > 20.0)
    rows = [
        (a, 0.0, -0.5 * b, 0.0, 0.5 * b) for a, b in zip(s.tolist(), level.tolist(), strict=True)
    ]
    twisted = track(
        irregularities=[{"type": "measured", "rows": rows, "fade": 0.0}],
        support={"preset": "rigid"},
    )
    result = simulate(wagon, twisted, speed=2.0, until=60.0)
    row = int(np.argmin(np.abs(result.distance - 55.0)))
    base = 1.506
    expected = k * 1.0**2 * (ramp * 10.0 / base) / base
    change = result.Q[row] - result.Q0
    # the left rail rises: the front axle, ahead on the twist, is loaded on the left
    assert change == pytest.approx(np.array([[1, -1], [-1, 1]]) * expected, rel=0.02)


@points("support", ["rigid", "ballasted"], always=(0,))
@pytest.mark.usefixtures("small_contact_tables")
def test_irregular_rails_mirrored_give_the_mirrored_result(coach, support):
    """Left and right of everything exchanged, through dips, kinks, twists and random rails.

    On rigid rails only round-off differs.  On elastic ones it may decide, at single steps, whether
    an error of the forces is corrected: one up to `SETTLED` of the static wheel load is not.
    """
    irregular = curve(
        length=100.0,
        support={"preset": support},
        friction=[0.4, 0.3],
        gauge_widening=((0.0, 0.0, 0.0), (100.0, 0.002, 0.001)),
        irregularities=[
            {"type": "random", "spectrum": "erri_b176_low", "seed": 5, "begin": 15.0, "end": 150.0},
            {"type": "dip", "s": 40.0, "length": 2.0, "depth": 0.003, "rail": "left"},
            {"type": "kink", "s": 60.0, "length": 6.0, "offset": 0.003, "rail": "right"},
            {"type": "twist", "s": 80.0, "length": 8.0, "height": 0.004},
        ],
    )
    here = simulate(coach, irregular, speed=15.0)
    there = simulate(mirrored_vehicle(coach), mirrored_track(irregular), speed=15.0)
    largest = 2e-6 if support == "rigid" else FORCE_TOLERANCE * np.mean(here.Q0)  # N
    for difference in (here.Q - there.Q[:, :, ::-1], here.Y + there.Y[:, :, ::-1]):
        assert np.max(np.abs(difference)) < largest
        assert np.median(np.abs(difference)) < 1e-6
    assert np.max(np.abs(here.wheelset_yaw + there.wheelset_yaw)) < 1e-10
    assert np.ptp(here.Q) > 1.5e4  # it is no smooth run


@pytest.mark.usefixtures("small_contact_tables")
def test_slopes_that_have_learnt_wrongly_are_forgotten():
    """A leading wheel of the Co-Co locomotive in zone 3, 87.82 s after the start, whose lateral
    slope over the slip is at its bound: corrections had overshot fourfold, their relaxation was
    bounded at 0.3, and the imbalance of one step became a blow of 16 kN in the next.  Forces are
    those of half the step."""
    vehicle, track = load_vehicle("locomotive_coco_b"), load_track("en14363_zone3")
    state = np.load(DATA / "state_wrong_slopes.npy")
    Y = []
    for step in (1.25e-3, 0.625e-3):
        settings = Settings(step=step, output_rate=800.0)
        run = simulate(vehicle, track, resume=state, duration=0.02, settings=settings)
        Y.append(np.asarray(run["Y"])[:, 0, 1])
        assert not any("iterations" in remark for remark in run.attributes["remarks"])
    # the state still alternates from step to step by this much, before what was learnt is forgotten
    np.testing.assert_allclose(Y[0], Y[1], atol=0.3e3)


def test_wheelsets_start_on_irregular_rails_at_the_rates_of_their_displacements(coach):
    """At V the displacements of the start change at V d/ds, by differences over 2 mm."""
    rough = {"type": "random", "spectrum": "erri_b176_high", "seed": 3, "fade": 0.0}
    model = steady(coach, track(irregularities=[rough]), Settings(), 30.0).model
    n, axles = model.index.n_bodies, model.system.contact.body

    def started(s):
        state = np.zeros(model.n_state)
        state[-2:] = s, 30.0
        follow_rails(model, state)
        place, rate = state[: 12 * n].reshape(2, n, 6)[:, axles]
        return place, rate

    (before, _), (_, rate), (after, _) = (started(100.0 + ds) for ds in (-1e-3, 0.0, 1e-3))
    lateral_vertical_roll = slice(1, 4)
    change = 30.0 * (after - before)[:, lateral_vertical_roll] / 2e-3
    assert np.all(np.abs(change) > 1e-4)
    np.testing.assert_allclose(rate[:, lateral_vertical_roll], change, rtol=1e-2, atol=1e-5)
    # the nose along the rails: the axle leans with them about their tops, 0.46 m below
    (place, _), height = started(100.0), model.system.bodies.nominal[axles, 1]
    middle = [state[:, 1] + height * np.sin(state[:, 3]) for state in (before, after)]
    np.testing.assert_allclose(place[:, 5], (middle[1] - middle[0]) / 2e-3, rtol=1e-2, atol=1e-6)
