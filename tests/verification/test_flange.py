"""The vehicle at rest in flange contact, about which a step is judged; how often it is sought."""

import math

import numpy as np
import pytest
from dynamics import load_vehicle
from selection import points

import railsim
from railsim.definitions.mirror import mirrored_track
from railsim.definitions.settings import Settings
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.state import SPEED, velocity_begin
from railsim.linear.steady import NotConverged, SteadyRolling
from railsim.model import time_step
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.work import work_arrays
from railsim.simulation import flange, step_choice
from railsim.simulation.preparation import prepare

STEP = 1.25e-3


def rolling(name, track, speed):
    """Model and steady rolling on straight track."""
    balance = equilibrium(assemble(load_vehicle(name), track, Settings()), speed)
    return balance.model, balance.state, balance.Q0.mean()


def wheel_forces(system, state):
    """Y and Q of all wheels [N]."""
    work, derivative = work_arrays(system), np.zeros_like(state)
    right_hand_side(system, work, state, derivative)
    return work.wheel[:, :, [W_Q, W_Y]]


@pytest.fixture
def ways(monkeypatch):
    """Lengths of the ways over which vehicles are brought into the curve [m]."""
    found, plain = [], flange.advance

    def advance(model, system, state, step, steps, *more):
        found.append(steps * step * state[-1])
        return plain(model, system, state, step, steps, *more)

    monkeypatch.setattr(flange, "advance", advance)
    return found


@points("support", ["rigid", "ballasted"], always=(1,))
def test_state_of_rest_is_the_end_of_a_long_run(support, monkeypatch):
    """Wheel forces within 1e-4 of the load: the car's sway decays with 0.25 1/s at least."""
    track = railsim.load_track("curve_r250").replace(support={"preset": support})
    model, state, load = rolling("coach_manchester", track, 20.0)
    (found,) = flange.in_flange_contact(model, track, state, STEP)
    monkeypatch.setattr(flange, "TIMES", (4.0, 40.0))
    monkeypatch.setattr(SteadyRolling, "solve", not_converged)
    (settled,) = flange.in_flange_contact(model, track, state, STEP)
    one, other = wheel_forces(*found), wheel_forces(*settled)
    assert one / load == pytest.approx(other / load, abs=1e-4)


def not_converged(*_):
    """In place of Newton's method."""
    raise NotConverged("no steady state")


@pytest.mark.usefixtures("small_contact_tables")
def test_growth_does_not_depend_on_the_step_of_the_way():
    """Slopes learnt while the wheels vibrated on the way would change it by a fifth."""
    track = railsim.load_track("curve_r500")
    model, state, _ = rolling("power_car_china_star", track, 27.0)
    growths = [
        time_step._step_growth(
            model, *flange.in_flange_contact(model, track, state, step)[0], "fast", 6e-3
        )
        for step in (1.667e-3, 0.833e-3)
    ]
    assert growths[0] > 10.0
    assert growths[0] == pytest.approx(growths[1], rel=0.02)


def test_state_of_rest_at_low_speed_does_not_depend_on_the_speed_of_the_way(ways, monkeypatch):
    """Wheel forces at 1 m/s within 1e-6 of the load, from a way at 2 m/s and from one at 1 m/s."""
    track = railsim.load_track("curve_r250")
    model, state, load = rolling("coach_manchester", track, 1.0)
    (found,) = flange.in_flange_contact(model, track, state, 2.0 * STEP)
    monkeypatch.setattr(flange, "BEGIN", 0.0)
    (other,) = flange.in_flange_contact(model, track, state, 2.0 * STEP)
    assert [at[1][SPEED] for at in (found, other)] == [1.0, 1.0]
    assert len(ways) == 2
    forces = [wheel_forces(*at) / load for at in (found, other)]
    assert forces[0] == pytest.approx(forces[1], abs=1e-6)


def test_one_short_way_is_enough_without_friction_elements(ways):
    """Less than the vehicle and 50 m; with friction elements it settles for 6 s."""
    track = railsim.load_track("curve_r250")
    for name, least, most in (("coach_manchester", 40.0, 75.0), ("wagon_y25", 120.0, 160.0)):
        ways.clear()
        model, state, _ = rolling(name, track, 20.0)
        assert flange.in_flange_contact(model, track, state, STEP)
        assert len(ways) == 1
        assert least < ways[0] < most


def test_without_a_state_of_rest_the_vehicle_settles(ways, monkeypatch):
    """The long way follows the short one."""
    track = railsim.load_track("curve_r250")
    model, state, _ = rolling("coach_manchester", track, 20.0)
    monkeypatch.setattr(SteadyRolling, "solve", not_converged)
    assert flange.in_flange_contact(model, track, state, STEP)
    assert len(ways) == 2
    assert ways[1] > 120.0


def test_runs_of_a_class_share_one_way(ways, monkeypatch, tmp_path):
    """Two speeds within a factor of 1.2 and two coefficients of friction within 0.1."""
    monkeypatch.setattr(step_choice, "solution", lambda kind, inputs, solve, **_: solve())
    monkeypatch.setattr(step_choice, "_JUDGED", {})
    found = railsim.study(
        "coach_manchester",
        "curve_r250",
        [19.0, 21.0],
        grid={"track.friction": [0.31, 0.39]},
        duration=0.1,
        workers=1,
        keep="summary",
        out=tmp_path / "study",
    )
    assert [record["status"] for record in found.records] == 4 * ["complete"]
    assert len(ways) == 1


def with_friction(track, friction):
    """A track with the same friction on both rails."""
    return track.replace(friction=(friction, friction))


@pytest.mark.parametrize(
    ("name", "radius_track", "speed", "friction"),
    [("coach_manchester", "curve_r250", 18.5, 0.3), ("locomotive_coco_a", "curve_r500", 22.2, 0.4)],
)
@pytest.mark.usefixtures("small_contact_tables")
def test_state_led_to_another_speed_and_friction_is_the_one_found_there(
    name, radius_track, speed, friction
):
    """Wheel forces within 1e-4 of the load, and the growth of a step."""
    track = railsim.load_track(radius_track)
    model, state, load = rolling(name, with_friction(track, friction), speed)
    led = flange.at_rest_with(
        model, *flange.in_flange_contact(model, track, state, STEP), 1.2 * speed, 0.05
    )
    other = with_friction(track, friction - 0.05)
    model, state, _ = rolling(name, other, 1.2 * speed)
    (found,) = flange.in_flange_contact(model, other, state, STEP)
    assert led[1][-1] == found[1][-1]
    forces = [wheel_forces(*at) / load for at in (led, found)]
    assert forces[0] == pytest.approx(forces[1], abs=1e-4)


@pytest.mark.usefixtures("small_contact_tables")
def test_without_friction_wheelsets_turn_as_before_in_curves_of_either_hand():
    """No torque turns them; 1700 to 7200 rad/s without any cause made each hand another state."""
    right = with_friction(railsim.load_track("curve_r500"), 0.0)
    left = mirrored_track(right)
    forces = []
    for track in (right, left):
        model, state, load = rolling("coach_manchester", track, 25.0)
        ((system, found),) = flange.in_flange_contact(model, track, state, STEP)
        forces.append(wheel_forces(system, found) / load)
        spins = velocity_begin(model.index.n_bodies) + 6 * system.contact.body + 4
        radius = system.bodies.radius[system.contact.body]
        assert found[spins] == pytest.approx(-25.0 / radius, rel=1e-4)
    mirrored = forces[1][:, ::-1] * (1.0, -1.0)
    assert forces[0] == pytest.approx(mirrored, abs=1e-4)


def growth_beyond_the_vehicle(model, at, step):
    """Of one step about a state of rest in a curve [1/s]."""
    vehicle = max(0.0, time_step._vehicle_growth(model, *at))
    return time_step._step_growth(model, *at, "fast", step) - vehicle


@points(
    ("name", "radius", "speed", "friction", "growth"),
    [
        ("power_car_china_star", 250.0, 21.5, 0.24, 10.0),
        ("power_car_china_star", 250.0, 20.5, 0.17, 8.0),
        ("power_car_china_star", 300.0, 22.8, 0.22, 8.0),
    ],
    always=(0,),
)
@pytest.mark.usefixtures("small_contact_tables")
def test_runs_are_stable_where_one_end_of_their_class_does_not_tell(
    name, radius, speed, friction, growth, monkeypatch
):
    """2.5 ms have the margin at the lowest speed and highest friction of their classes."""
    monkeypatch.setattr(step_choice, "solution", lambda kind, inputs, solve, **_: solve())
    monkeypatch.setattr(step_choice, "_JUDGED", {})
    longest = time_step.MARGIN_ELASTIC * 2.5e-3
    track = curve_of(radius)
    of_class = 0.1 * math.ceil(friction / 0.1)
    run, end = with_friction(track, friction), with_friction(track, of_class)
    model, state, _ = rolling(name, end, step_choice.class_speed(speed))
    (at,) = flange.in_flange_contact(model, end, state, STEP)
    assert growth_beyond_the_vehicle(model, at, longest) < 1.0

    model, state, _ = rolling(name, run, speed)
    (at,) = flange.in_flange_contact(model, run, state, STEP)
    assert growth_beyond_the_vehicle(model, at, longest) > growth
    step, _ = prepare(load_vehicle(name), run, Settings(), speed, duration=1.0).steps.at(speed)
    assert growth_beyond_the_vehicle(model, at, time_step.MARGIN_ELASTIC * step) < 1.0


@pytest.mark.usefixtures("small_contact_tables")
def test_where_the_gauge_is_narrow_a_step_is_judged_as_in_a_curve_of_that_gauge(monkeypatch):
    """2.5 ms let Y sway by 7 % of Q0 where 12 mm are missing, 1.67 ms by 0.1 %."""
    monkeypatch.setattr(step_choice, "solution", lambda kind, inputs, solve, **_: solve())
    monkeypatch.setattr(step_choice, "_JUDGED", {})
    usual, name = railsim.load_track("curve_r250"), "power_car_china_star"
    narrow = usual.replace(gauge=usual.gauge - 0.012)
    rows = [[0.0, 0.0], [330.0, 0.0], [345.0, -0.004, -0.008], [445.0, 0.0]]
    varies = usual.replace(gauge_widening=rows)
    model, state, load = rolling(name, narrow, 20.0)
    (at,) = flange.in_flange_contact(model, narrow, state, STEP)
    step, _ = prepare(load_vehicle(name), varies, Settings(), 20.0, duration=1.0).steps.at(20.0)
    assert growth_beyond_the_vehicle(model, at, 2.5e-3) > 2.0
    assert growth_beyond_the_vehicle(model, at, step) < 1.0

    model, state, _ = rolling(name, varies, 20.0)
    (wide,) = flange.in_flange_contact(model, varies, state, STEP)
    (led,) = flange.at_narrowest_gauge(model, varies, wide)
    assert growth_beyond_the_vehicle(model, wide, 2.5e-3) < 1.0
    forces = [wheel_forces(*there) / load for there in (wide, led, at)]
    assert np.abs(forces[0] - forces[2]).max() > 0.1
    assert forces[1] == pytest.approx(forces[2], abs=2e-3)
    assert flange.at_narrowest_gauge(model, usual, wide) == []


def curve_of(radius):
    """The curve of R 250 m with another radius."""
    plan = (
        {"type": "STR", "length": 300.0},
        {"type": "CLO", "length": 60.0},
        {"type": "CIR", "length": 60.0, "radius": radius},
        {"type": "CLO", "length": 60.0},
        {"type": "STR", "length": 500.0},
    )
    return railsim.load_track("curve_r250").replace(plan=plan)


STR, CST = {"type": "STR", "length": 100.0}, {"type": "CST", "length": 100.0}


def curved(radius, cant):
    """A transition, a curve and a transition, 40, 60 and 40 m, of a plan and of its cant."""
    ends = {"type": "CLO", "length": 40.0}, {"type": "LIR", "length": 40.0}
    return (
        [ends[0], {"type": "CIR", "length": 60.0, "radius": radius}, ends[0], STR],
        [ends[1], {**CST, "length": 60.0, "cant": cant}, ends[1], {**CST, "cant": 0.0}],
    )


@pytest.mark.parametrize(
    ("curves", "found"),
    [
        ([(300.0, 0.1)], [(300.0, 0.1)]),
        ([(-300.0, -0.1)], [(-300.0, -0.1)]),
        ([(400.0, 0.1), (-300.0, -0.05)], [(-300.0, -0.05), (400.0, 0.1)]),
        ([(-300.0, -0.1), (400.0, 0.05)], [(-300.0, -0.1), (400.0, 0.05)]),
        ([(1501.0, 0.03), (1499.0, 0.03)], [(1499.0, 0.03)]),
        ([(1501.0, 0.03)], []),
    ],
)
def test_tight_curves_have_their_own_cant_and_are_none_above_1500_m(curves, found):
    plan, cant = [STR], [{**CST, "cant": 0.0}]
    for parts in (curved(*one) for one in curves):
        plan, cant = plan + parts[0], cant + parts[1]
    tight = flange.tight_curves(railsim.load_track("straight").replace(plan=plan, cant=cant))
    for curve, (radius, at) in zip(tight, found, strict=True):
        assert curve == pytest.approx((1.0 / radius, at), rel=1e-6)


@pytest.mark.parametrize("radius", [300.0, -300.0])
def test_a_track_that_ends_in_a_transition_is_tightest_there(radius):
    plan = [STR, {"type": "CLO", "length": 60.0, "radius_end": radius}]
    curve, *_ = flange.tight_curves(railsim.load_track("straight").replace(plan=plan))
    assert curve == pytest.approx((1.0 / radius, 0.0))


def test_step_is_stable_where_the_rails_of_a_curve_are_less_rough_than_those_before_it():
    """Smooth rails, friction 0.15 and 0.4 in the curve: the forces of the wheels stay.

    From output to output they change by less than 1e-4 of the wheel load (standard deviation).  A
    step of 2.5 ms, stable for the 0.45 before the curve, made Y change by 1.6 %; given for the
    friction of the curve alone it is refused.
    """
    curve = railsim.load_track("curve_r250")
    falling = curve.replace(
        friction_table=[[0.0, 0.45, 0.45], [50.0, 0.45, 0.45], [60.0, 0.15, 0.4]]
    )
    coach = load_vehicle("coach_manchester")
    result = railsim.simulate(coach, falling, speed=15.0, start=385.0, until=395.0)
    for forces in (result.Y, result.Q):
        assert np.max(np.std(np.diff(forces, axis=0), axis=0)) < 1e-4 * result.Q0.mean()


def test_step_is_stable_where_a_check_rail_guides_in_the_curve():
    """Smooth rails: forces change by less than 1e-4 of the load from output to output.

    A step of 1.67 ms, stable without the check rail, made Y change by 1.5 %.
    """
    way = [[250.0, 0.065], [260.0, 0.04], [450.0, 0.04], [460.0, 0.065]]
    rail = {"rail": "right", "friction": 0.4, "flangeway": way}
    track = railsim.load_track("curve_r250").replace(
        support={"preset": "rigid"}, friction=0.4, check_rail=[rail]
    )
    coach = load_vehicle("coach_manchester")
    result = railsim.simulate(coach, track, speed=15.0, start=385.0, until=395.0)
    for forces in (result.Y, result.Q):
        assert np.max(np.std(np.diff(forces, axis=0), axis=0)) < 1e-4 * result.Q0.mean()


def swaying(name, speed, *radii, until=255.0, drive=None, **changes):
    """How much Y and Q change from output to output in the first of several curves, smooth rails.

    Largest standard deviation, as a share of the wheel load; the curves are 60 m apart.
    """
    plan, cant = [STR], [{**CST, "cant": 0.0}]
    for radius in radii:
        parts = curved(radius, math.copysign(0.12, radius))
        plan, cant = plan + parts[0], cant + parts[1]
    plan[2]["length"] = cant[2]["length"] = 160.0
    track = railsim.load_track("straight").replace(plan=plan, cant=cant, **changes)
    settings = Settings(drive=drive) if drive else None
    how = {"start": 245.0, "until": until, "settings": settings}
    result = railsim.simulate(load_vehicle(name), track, speed=speed, **how)
    each = [np.std(np.diff(forces, axis=0), axis=0).max() for forces in (result.Y, result.Q)]
    return max(each) / result.Q0.mean()


RIGID = {"preset": "rigid"}


def test_step_is_stable_in_a_curve_before_one_that_is_too_tight_for_the_speed():
    """Nothing was judged where the vehicle leaves the tightest curve: 1.7 % at 1.67 ms."""
    assert swaying("coach_manchester", 20.0, 300.0, 80.0, support=RIGID, friction=0.5) < 1e-4


def test_step_is_stable_in_curves_of_both_hands():
    """Friction 0.15 and 0.4: 0.3 % at 2.5 ms, which the tighter curve to the right allows."""
    unlike = {"friction": (0.15, 0.4), "until": 260.0}
    assert swaying("coach_manchester", 15.0, -250.0, 249.0, **unlike) < 1e-4


def test_step_is_stable_at_the_highest_speed_of_its_class():
    """A run of changing speed was judged at the lowest: Y changed by 0.9 % at 1.67 ms."""
    track = with_friction(railsim.load_track("curve_r250"), 0.3).replace(support=RIGID)
    table = {"mode": "table", "speed_table": [[0.0, 22.1], [380.0, 22.1], [420.0, 22.0]]}
    how = {"start": 385.0, "until": 395.0, "settings": Settings(drive=table)}
    result = railsim.simulate(load_vehicle("power_car_china_star"), track, speed=22.1, **how)
    assert np.std(np.diff(result.Y, axis=0), axis=0).max() < 1e-4 * result.Q0.mean()
