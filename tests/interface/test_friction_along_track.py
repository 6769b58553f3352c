"""Friction that a table gives along the track, wherever friction is read: limits, conditions."""

import math

import numpy as np
import pytest
from made_record import made, track

import railsim
from railsim.assessment import assess
from railsim.assessment.safety import flange_angle
from railsim.profiles import load_profile

STRAIGHT = {"type": "STR", "length": 1000.0}
LOW_TO_HIGH = ((0.0, 0.2, 0.2), (1000.0, 0.6, 0.6))


def on_rails(rows):
    """A straight whose friction is that of a table, beside a coefficient that does not hold."""
    return track(STRAIGHT).replace(friction=(0.4, 0.4), friction_table=rows)


def outwards_on_the_left(quotient):
    def forces(_, s):
        return np.stack([np.full(s.shape, -quotient * 54.545e3), np.zeros(s.shape)], axis=-1)

    return forces


def test_nadals_limit_is_that_of_the_friction_under_the_wheel():
    """Y/Q 0.9 is above the limit from the place on where friction makes the limit 0.9."""
    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    forces = outwards_on_the_left(0.9)
    run = made(on_rails(LOW_TO_HIGH), 20.0, Y=forces, profiles=profiles)
    slope = math.tan(flange_angle(profiles["S1002"]))
    reached = 1000.0 * ((slope - 0.9) / (1.0 + 0.9 * slope) - 0.2) / 0.4
    (found,) = assess(run, "safety")
    wheel = found.safety["run"].wheels[0]
    assert wheel.climb_begin == pytest.approx(reached, abs=0.1)
    mu = 0.2 + 0.4 * float(run["wheelset_distance"][:, 0].clip(max=1000.0).max()) / 1000.0
    hardest = (slope - mu) / (1.0 + mu * slope)
    last = float(run["wheelset_distance"][-1, 0])
    assert wheel.climb_distance == pytest.approx(last - reached, abs=0.1)
    assert (wheel.Y_over_Q, wheel.limit) == pytest.approx((0.9, hardest), rel=1e-9)


def test_lubricated_stretch_is_not_a_test_on_dry_rails():
    dry, wet = ((0.0, 0.4, 0.4),), ((0.0, 0.4, 0.4), (500.0, 0.15, 0.4), (1000.0, 0.4, 0.4))
    states = {}
    for name, rows in (("dry", dry), ("wet", wet)):
        (found,) = assess(made(on_rails(rows), 36.0))
        states[name] = next(c for c in found.conditions if c.name == "friction")
    assert states["dry"].state == "met"
    assert (states["wet"].state, states["wet"].found) == ("not met", "0.15 to 0.4")


def test_runs_on_rails_of_different_friction_are_not_pooled():
    runs = {f"mu {mu}": made(on_rails(((0.0, mu, mu),)), 36.0) for mu in (0.3, 0.5)}
    (found,) = assess(runs)
    assert {report.population.name for report in found.zones} == {"friction 0.3", "friction 0.5"}


def test_curving_is_on_the_friction_that_the_track_begins_with():
    coach = railsim.load_vehicle("coach_manchester")
    by_table = on_rails(((0.0, 0.25, 0.25), (1000.0, 0.5, 0.5)))
    found = railsim.curving(coach, by_table, radius=400.0)
    expected = railsim.curving(coach, track(STRAIGHT), radius=[400.0], friction=[0.25])
    assert found.friction.tolist() == [0.25]
    np.testing.assert_allclose(found.Y, expected.Y, rtol=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_curving_takes_the_friction_of_each_rail_as_a_run_does(side):
    """One rail lubricated, curves to either hand: guiding forces of a run in its steady state."""
    length, radius, height = 2000.0, 300.0, 0.1
    on = track({"type": "CIR", "length": length, "radius": side * radius}, cant=side * height)
    on = on.replace(
        friction=(0.45, 0.12), cant=[{"type": "CST", "length": length, "cant": side * height}]
    )
    coach = railsim.load_vehicle("coach_manchester")
    found = railsim.curving(coach, on, radius=[side * radius], cant=height, cant_deficiency=[0.05])
    settings = railsim.Settings(start_state="steady")
    run = railsim.simulate(
        coach, on, speed=float(found.speed[0, 0]), duration=2.0, settings=settings
    )
    assert found.Y[0, 0, 0] == pytest.approx(run.Y[-1], rel=1e-3, abs=50.0)


def test_rise_of_a_climbing_wheel_is_that_above_its_rail():
    """A hump of 20 mm lifts the rail with the wheel: nothing climbs, whatever Y/Q says.

    With a coefficient of friction beyond the slope of the flange Nadal's limit is below zero, and
    each wheel is above it all the way.
    """
    hump = [{"type": "dip", "s": 40.0, "length": 30.0, "depth": -0.02}]
    track = railsim.load_track("straight").replace(friction=4.0, irregularities=hump)
    run = railsim.simulate(railsim.load_vehicle("coach_manchester"), track, speed=10.0, until=80.0,
                           settings=railsim.load_settings(None, ["output_rate=1000"]))  # fmt: skip
    (found,) = assess(run, "safety")
    ((report),) = found.safety.values()
    assert min(wheel.climb_distance for wheel in report.wheels) > 70.0
    assert max(wheel.rise for wheel in report.wheels) < 0.5e-3
