"""Peaks and mid-curve values of a result whose arrays are known."""

import numpy as np
import pytest
from example_result import arrays, attributes, example_result

from railsim.notation import QUANTITIES
from railsim.result import Result, mid_curves, peak, peaks


def small(values, distance=(0.0, 10.0, 20.0)):
    return Result(
        {"time": [0.0, 1.0, 2.0], "distance": distance, "Q": values},
        {name: QUANTITIES[name] for name in ("time", "distance", "Q")},
        {"wheelset": ["lead"], "side": ["left", "right"]},
        attributes(),
    )


def test_peak_names_value_place_and_time():
    result = small([[[1.0, 2.0]], [[3.0, -7.0]], [[5.0, 6.0]]])
    largest = peak(result, "Q")
    assert (largest.value, largest.time, largest.distance) == (-7.0, 1.0, 10.0)
    assert largest.labels == {"wheelset": "lead", "side": "right"}
    assert largest.shown == pytest.approx(-0.007)
    assert peak(result, "Q", "max").value == 6.0
    assert peak(result, "Q", "min").value == -7.0


def test_peak_leaves_out_what_is_not_a_number():
    assert peak(small([[[np.nan, 2.0]], [[3.0, 1.0]], [[0.0, np.nan]]]), "Q").value == 3.0


def test_unloading_and_overload_are_both_listed():
    found = [p.value for p in peaks(example_result()) if p.quantity.name == "dQ_over_Q0"]
    values = arrays()["dQ_over_Q0"]
    assert found == [values.max(), values.min()]


def test_mid_curve_values_are_those_at_the_middle_of_the_circle():
    (middle,) = mid_curves(example_result())
    assert middle.radius == pytest.approx(250.0)
    assert middle.time == pytest.approx(390.0 / 20.0)
    np.testing.assert_allclose(middle.values["wheelset_yaw"][0], -9.6e-3)
    yaw = next(p for p in middle.peaks if p.quantity.name == "wheelset_yaw")
    assert yaw.value == pytest.approx(-9.6e-3)
    assert yaw.labels == {"wheelset": "front.outer.wheelset"}


def test_mid_curve_values_are_interpolated_between_instants():
    result = small([[[0.0, 0.0]], [[1.0, 2.0]], [[2.0, 4.0]]], distance=[380.0, 385.0, 395.0])
    (middle,) = mid_curves(result)
    np.testing.assert_allclose(middle.values["Q"], [[1.5, 3.0]])


def test_no_mid_curve_values_before_the_curve():
    assert mid_curves(example_result(duration=15.0)) == ()
