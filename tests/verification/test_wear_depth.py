"""Depth of wear over the profile: areas are kept, places are those of the patches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import railsim
from railsim.assessment.wear import pearce_sherratt_1991
from railsim.assessment.wear_depth import SPACING, grid, spread, worn_depth, worn_profile
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.profiles import load_profile


@given(st.floats(-0.05, 0.05), st.floats(0.5e-3, 8e-3))
@settings(max_examples=30)
def test_half_ellipse_keeps_area_and_middle(place, width):
    heights = spread(np.array([place]), np.array([width]), np.array([2e-6]))
    assert np.sum(heights) * SPACING == pytest.approx(2e-6, rel=1e-9)
    assert np.sum(heights * grid()) * SPACING / 2e-6 == pytest.approx(place, abs=SPACING)
    # height in the middle: area/(pi b/2)
    if width > 2e-3:
        assert np.max(heights) == pytest.approx(2e-6 / (0.5 * np.pi * width), rel=0.02)


def test_worn_profile_loses_the_area_of_the_wear():
    profile = load_profile("S1002")
    depth = spread(np.array([0.0, -0.03]), np.array([5e-3, 2e-3]), np.array([1e-12, 3e-12]))
    worn = worn_profile(profile, depth, 1e6)
    y = np.linspace(-0.069, 0.059, 20_001)
    lost = np.interp(y, profile.y, profile.z) - np.interp(y, worn.y, worn.z)
    # points of the profile up to 1 mm apart
    assert np.trapezoid(lost, y) == pytest.approx(4e-6, rel=0.02)
    assert lost.min() > -1e-12


def test_outer_leading_wheel_wears_at_its_flange_in_a_curve():
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250"), speed=20.0,
        start=385.0, duration=1.5, settings=Settings(outputs={"contact_patches": True}),
    )  # fmt: skip
    steady = run.distance > 395.0
    depth = worn_depth(run, 0, 0)
    assert grid()[np.argmax(depth)] < -0.025
    inner = worn_depth(run, 0, 1)
    assert abs(grid()[np.argmax(inner)]) < 0.03
    ways = np.gradient(run.distance)
    area = np.sum(pearce_sherratt_1991(run.T_gamma[:, 0, 0], 0.92) * ways) / np.sum(ways)
    assert np.sum(depth) * SPACING == pytest.approx(area, rel=1e-6)
    assert steady.any()


def test_run_without_patches_is_refused():
    run = railsim.simulate(railsim.load_vehicle("coach_manchester"),
                           railsim.load_track("straight"), speed=20.0, duration=0.1)  # fmt: skip
    with pytest.raises(InputError, match="contact_patches"):
        worn_depth(run, 0, 0)
