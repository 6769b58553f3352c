"""The published curving study, Grossi (2025), section 6.1.1: SIMPACK Rail, R 250 m, 20 m/s.

Tolerances: what one parameter set reaches without tuning (friction, rail inclination and the
rounding of the transitions are not stated in the source): yaw 3 %, Y/Q 3 %, sum |Y| 4 %, lateral
displacement 1 %, dQ/Q0 peak 5 %, roll 8 %.
"""

import csv

import numpy as np
import pytest
from railsim.definitions.loading import load_track, load_vehicle
from railsim.simulation import simulate

TOLERANCE = {
    "dQ_over_Q0": 0.05, "sum_abs_Y": 0.04, "Y_over_Q": 0.03, "wheelset_roll": 0.08,
    "wheelset_yaw": 0.03, "wheelset_lateral": 0.01,
}
SIGN = {"wheelset_yaw": -1.0, "wheelset_lateral": -1.0}  # right-hand curve: outwards is left
UNIT = {"kN": 1e3, "mrad": 1e-3, "mm": 1e-3, "1": 1.0}


@pytest.fixture(scope="module")
def published(reference_dir):
    lines = (reference_dir / "curving_study_r250.csv").read_text().splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {row["quantity"]: row for row in rows}


@pytest.fixture(scope="module")
def track():
    return load_track("curve_r250")


@pytest.fixture(scope="module")
def manchester(track):
    return simulate(load_vehicle("coach_manchester"), track, speed=20.0)


@pytest.fixture(scope="module")
def flexicoil(track):
    return simulate(load_vehicle("coach_flexicoil"), track, speed=20.0)


def measured(result, quantity):
    """Value of the leading wheelset as the study reads it."""
    middle = int(np.argmin(np.abs(result.time - 19.8)))
    if quantity == "dQ_over_Q0":
        return result.dQ_over_Q0[:, 0, 0].max()
    if quantity == "Y_over_Q":
        return result.Y_over_Q[middle, 0, 0]
    return result[quantity][middle, 0]


@pytest.mark.parametrize("quantity", list(TOLERANCE))
@pytest.mark.parametrize("coach", ["manchester", "flexicoil"])
def test_coach_agrees_with_the_published_study(published, coach, quantity, request):
    row = published[quantity]
    expected = SIGN.get(quantity, 1.0) * float(row[coach]) * UNIT[row["unit"]]
    result = request.getfixturevalue(coach)
    assert measured(result, quantity) == pytest.approx(expected, rel=TOLERANCE[quantity])


@pytest.mark.parametrize("quantity", list(TOLERANCE))
def test_difference_between_the_suspensions_agrees(published, manchester, flexicoil, quantity):
    """Flexicoil minus Manchester in per cent: within 2 points, and right in sign above 0.5 %."""
    row = published[quantity]
    expected = 100.0 * (float(row["flexicoil"]) / float(row["manchester"]) - 1.0)
    found = 100.0 * (measured(flexicoil, quantity) / measured(manchester, quantity) - 1.0)
    assert found == pytest.approx(expected, abs=2.0)
    if abs(expected) > 0.5:
        assert found * expected > 0.0


def test_peak_of_dQ_lies_near_the_end_of_the_entry_transition(manchester):
    peak = manchester.distance[np.argmax(manchester.dQ_over_Q0[:, 0, 0])]
    assert peak == pytest.approx(346.0, abs=5.0)


def test_r500_runs_with_the_same_parameters_and_is_gentler(manchester):
    result = simulate(load_vehicle("coach_manchester"), load_track("curve_r500"), speed=20.0)
    assert result.status == "complete"
    assert abs(measured(result, "wheelset_yaw")) < 0.6 * abs(measured(manchester, "wheelset_yaw"))
