"""The loop of wear without runs: shares of routes, parts of a step, rows, all in closed form."""

import gc
import sys
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

import railsim
from railsim.assessment.wear_depth import SPACING, deepest, spread
from railsim.contact import contact_geometry
from railsim.definitions import Settings
from railsim.errors import ModelError
from railsim.profiles import load_profile
from railsim.studies import wear_loop

COACH, STEP = railsim.load_vehicle("coach_manchester"), 1e5
ROUTES = ((10.0, 1.0), (20.0, 3.0), (30.0, 4.0))  # speeds [m/s], shares
CURVE = railsim.load_track("curve_r250").replace(
    plan=[{"type": "CIR", "length": 50.0, "radius": 250.0}],
    cant=[{"type": "CST", "length": 50.0, "cant": 0.1}],
)


@pytest.fixture
def worn(monkeypatch):
    """Steps of a loop whose wheels wear in one place in proportion to the speed, and its runs."""
    runs = []

    def simulate(_vehicle, _track, *, speed, progress, profiles, **_how):
        runs.append(profiles["S1002"].z)
        progress(1.0)
        return SimpleNamespace(status="complete", remarks=(), wheelsets=("a", "b"), speed=speed)

    def of_wheel(result, wheelset, side, _law):
        # wheel by wheel 0.7, 0.9, 1.1, 1.3 of the mean
        share = 0.7 + 0.2 * (2 * wheelset + side)
        return spread(np.zeros(1), np.full(1, 5e-3), np.array([share * rate[0] * result.speed]))

    rate = [0.0]
    monkeypatch.setattr(wear_loop, "simulate", simulate)
    monkeypatch.setattr(wear_loop, "worn_depth", of_wheel)

    def carried_out(of_speed, **how):
        rate[0] = of_speed
        routes = [(CURVE, speed, share) for speed, share in ROUTES]
        return wear_loop.wear_loop(COACH, routes, step=STEP, **how), runs

    return carried_out


def test_quantities_of_the_settings_leave_the_loop_what_it_needs(monkeypatch):
    """Else its first run lacks them."""
    seen = []

    def simulate(*_given, settings, **_how):
        seen.append(settings.outputs)
        raise ModelError("here")

    monkeypatch.setattr(wear_loop, "simulate", simulate)
    own = Settings(outputs={"quantities": ["Q"]})
    with pytest.raises(ModelError, match="here"):
        wear_loop.wear_loop(COACH, [(CURVE, 20.0, 1.0)], step=STEP, steps=1, settings=own)
    assert seen[0].quantities == ()
    assert seen[0].contact_patches


def test_what_a_run_leaves_is_gone_before_the_next_one(worn, monkeypatch):
    """A run holds the table of its profile, 0.1 GB; the command line collects rarely."""
    left, simulate = [], wear_loop.simulate

    def simulate_in_a_cycle(*given, **how):
        assert not [one for one in left if one() is not None]
        result = type("Run", (), vars(simulate(*given, **how)))()
        result.itself = result
        left.append(weakref.ref(result))
        return result

    monkeypatch.setattr(wear_loop, "simulate", simulate_in_a_cycle)
    monkeypatch.setattr(sys.modules[__name__], "ROUTES", ROUTES[:1])
    before = gc.get_threshold()
    gc.set_threshold(10**6)
    try:
        worn(1e-15, steps=3)
    finally:
        gc.set_threshold(*before)
    assert len(left) >= 3


@pytest.mark.parametrize("parts", [1, 3])
def test_routes_wear_by_their_shares_and_deep_steps_in_parts(worn, parts):
    new, mean = load_profile("S1002"), (10.0 + 3.0 * 20.0 + 4.0 * 30.0) / 8.0
    unit = deepest(new, spread(np.zeros(1), np.full(1, 5e-3), np.ones(1)))
    rate = (parts - 0.5) * 0.1e-3 / (unit * mean * STEP)
    done = []
    steps, runs = worn(rate, steps=2, progress=done.append)
    for number, step in enumerate(steps):
        assert (step.distance, step.length) == (number * STEP, STEP)
        assert np.sum(step.depth) * SPACING == pytest.approx(rate * mean, rel=1e-9)
        lost = np.trapezoid(step.profile.z - step.worn.z, step.profile.y)
        assert lost == pytest.approx(rate * mean * STEP, rel=1e-9)
    # each part of a step on the profile that the parts before have left, the same on all routes
    tips = np.array([z[np.argmin(np.abs(new.y))] for z in runs]).reshape(-1, len(ROUTES))
    assert len(tips) == 2 * parts
    assert np.ptp(tips, axis=1).max() == 0.0
    equal = (tips[-1, 0] - tips[0, 0]) / (2 * parts - 1)
    assert np.diff(tips[:, 0]) == pytest.approx(equal, rel=1e-3)  # the contour lengthens
    assert done[0] == pytest.approx(1.0 / (2 * len(ROUTES)))
    assert done[-1] == 1.0


def test_rows_hold_area_depth_place_and_the_conicity_at_3_mm(worn):
    steps, _ = worn(1e-14, steps=2)
    new, *_, last = rows = wear_loop.wear_rows(steps, COACH, CURVE)
    assert [row["distance"] for row in rows] == [0.0, STEP, 2.0 * STEP]
    assert [row["area"] for row in rows] == pytest.approx(1e-14 * 23.75 * STEP * np.arange(3))
    lost = steps[0].profile.z - steps[-1].worn.z
    assert (last["deepest"], last["deepest_y"]) == (lost.max(), steps[0].profile.y[lost.argmax()])
    assert last["deepest_y"] == pytest.approx(0.0, abs=1e-3)
    assert (new["area"], new["deepest"], new["deepest_y"]) == (0.0, 0.0, None)  # nowhere
    rail = load_profile("60E1")
    for row, wheel in ((new, steps[0].profile), (last, steps[-1].worn)):
        geometry = contact_geometry(wheel, (rail, rail), 0.46, 1.435, 0.025, 1.36)
        assert row["equivalent_conicity"] == geometry.equivalent_conicity([3e-3])[0]
    assert new["flange_height"] == pytest.approx(28e-3, abs=0.05e-3)
