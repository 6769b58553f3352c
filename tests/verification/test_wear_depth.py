"""Depth of wear over the profile: areas are kept, positions are those of the patches."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import railsim
from railsim.assessment.wear import LAWS, pearce_sherratt_1991
from railsim.assessment.wear_depth import (
    NEEDED,
    SPACING,
    deepest,
    grid,
    parts_of_step,
    spread,
    wheel_dimensions,
    worn_depth,
    worn_profile,
)
from railsim.contact.curves import tape_circle_position, wheel_curve
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.profiles import Profile, load_profile
from railsim.result import Result
from railsim.studies.wear_loop import wear_loop


@given(st.floats(-0.05, 0.05), st.floats(0.5e-3, 8e-3))
@settings(max_examples=30)
def test_half_ellipse_keeps_area_and_middle(middle, width):
    heights = spread(np.array([middle]), np.array([width]), np.array([2e-6]))
    assert np.sum(heights) * SPACING == pytest.approx(2e-6, rel=1e-9)
    assert np.sum(heights * grid()) * SPACING / 2e-6 == pytest.approx(middle, abs=SPACING)
    # height in the middle: area/(pi b/2)
    if width > 2e-3:
        assert np.max(heights) == pytest.approx(2e-6 / (0.5 * np.pi * width), rel=0.02)


def test_half_ellipses_add_up_and_are_computed_only_where_they_lie(monkeypatch):
    """Part of a half ellipse up to u: (t - sin t cos t)/pi, cos t = -u; also beyond the grid."""
    random = np.random.default_rng(3)
    y, b = random.uniform(-0.09, 0.09, 400), random.uniform(0.5e-3, 8e-3, 400)
    A, computed = random.uniform(0.0, 1e-12, 400), []
    arcsin = np.arcsin
    monkeypatch.setattr(np, "arcsin", lambda u: computed.append(u.size) or arcsin(u))
    found = spread(y, b, A)
    monkeypatch.undo()
    edges = np.append(grid() - 0.5 * SPACING, grid()[-1] + 0.5 * SPACING)
    t = np.arccos(-np.clip((edges[:, None] - y) / b, -1.0, 1.0))
    up_to = (t - np.sin(t) * np.cos(t)) / np.pi @ A
    assert np.allclose(found, np.diff(up_to) / SPACING, rtol=1e-9, atol=1e-12 * found.max())
    assert sum(computed) <= np.sum(2.0 * b / SPACING + 1.0)


def test_worn_profile_loses_the_area_of_the_wear():
    profile = load_profile("S1002")
    depth = spread(np.array([0.0, -0.03]), np.array([5e-3, 2e-3]), np.array([1e-12, 3e-12]))
    worn = worn_profile(profile, depth, 1e6)
    y = np.linspace(-0.069, 0.059, 20_001)
    lost = np.interp(y, profile.y, profile.z) - np.interp(y, worn.y, worn.z)
    assert np.trapezoid(lost, y) == pytest.approx(4e-6, rel=1e-4)  # S1002: points 0.05 mm apart
    assert lost.min() > -1e-12


@pytest.mark.parametrize("place", [-0.032, -0.02, 0.0])
def test_contact_in_one_place_wears_no_groove_sharper_than_a_gauge_corner(place):
    new = load_profile("S1002")
    depth = spread(np.array([place]), np.array([1e-3]), np.array([1e-6]))
    depth *= 0.3e-3 / deepest(new, depth)
    worn = worn_profile(new, depth, 1.0)

    def concave(profile):
        curve = wheel_curve(profile, 0.46, 0.75)
        near = np.abs(curve.y - place) < 6e-3
        return np.max(-curve.curvature[1][near])  # averaged over 2 mm

    # where the new wheel is as hollow as the corner, R 13 mm, the groove adds to it
    assert concave(worn) - concave(new) < 0.5 / 13e-3


@pytest.mark.parametrize("place", [-0.015, 0.015])
def test_hollow_counts_on_both_sides_of_the_nominal_rolling_circle(place):
    """A parabola of 2 mm over 30 mm in a tread of 1:40."""
    y = np.linspace(-0.055, 0.055, 11_001)
    flange = 0.028 * np.clip((-0.032 - y) / 0.02, 0.0, 1.0)
    tread = -y / 40.0 - 2e-3 * np.maximum(0.0, 1.0 - ((y - place) / 0.015) ** 2)
    found = wheel_dimensions(Profile("parabola", "wheel", y, tread + flange)).hollow
    # above the outer edge, -15/40 mm: 2 (1 - u^2) - 15 (1 - u)/40 mm at its largest over u
    u = np.linspace(-1.0, 1.0, 20_001)
    assert found == pytest.approx(1e-3 * np.max(2.0 * (1.0 - u**2) - 0.375 * (1.0 - u)), rel=1e-4)


def test_step_is_divided_where_the_profile_would_wear_by_more_than_a_tenth_of_a_millimetre():
    profile = load_profile("S1002")
    depth = spread(np.array([0.0]), np.array([5e-3]), np.array([1e-11]))
    worn = deepest(profile, depth) * 1e5
    assert 0.0 < worn < 0.1e-3
    assert parts_of_step(profile, depth, 1e5) == 1
    assert parts_of_step(profile, depth, 1e5 * 3.5e-4 / worn) == 4
    with pytest.raises(InputError, match=r"S1002.* 11 mm deep; .*at most 10 mm in a step"):
        parts_of_step(profile, depth, 1e5 * 11e-3 / worn)


def test_wear_too_deep_for_one_step_is_refused_with_the_step_that_is_not():
    depth = spread(np.array([0.0]), np.array([5e-3]), np.array([1e-11]))
    with pytest.raises(InputError, match=r"2000 km wear 1\.98 mm deep; .*at most 1 mm: 1010 km"):
        worn_profile(load_profile("S1002"), depth, 2e6)


def test_profile_of_few_points_is_refused():
    profile = load_profile("S1002")
    coarse = dataclasses.replace(profile, y=profile.y[::400], z=profile.z[::400])
    depth = spread(np.array([0.0]), np.array([2e-3]), np.array([1e-12]))
    with pytest.raises(InputError, match="points at most 1 mm apart"):
        worn_profile(coarse, depth, 1e6)


@pytest.mark.usefixtures("small_contact_tables")
def test_worn_profile_goes_back_into_the_simulation():
    """Two steps of 100 km in a curve: what a step wears off is missing in the next one's wheels."""
    curve = railsim.load_track("curve_r250").replace(
        plan=[{"type": "CIR", "length": 6.0, "radius": 1500.0}],
        cant=[{"type": "CST", "length": 6.0, "cant": 0.05}],
    )
    told = []
    first, second = wear_loop(
        railsim.load_vehicle("coach_manchester"), [(curve, 20.0, 1.0)], step=1e5, steps=2,
        settings=Settings(start_state="steady"), on_step=told.append,
    )  # fmt: skip
    assert told == [first, second]
    assert (first.distance, second.distance) == (0.0, 1e5)
    assert first.profile.name == "S1002"
    assert second.profile is first.worn
    for step in (first, second):
        lost = np.asarray(step.profile.z) - np.asarray(step.worn.z)
        worn = 1e5 * SPACING * np.sum(step.depth)
        assert np.trapezoid(lost, step.profile.y) == pytest.approx(worn, rel=1e-9)
        assert step.worn.name == "S1002 worn"
    # other contacts on worn wheels
    assert np.max(np.abs(second.depth - first.depth)) > 0.01 * np.max(first.depth)


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
    patches = pearce_sherratt_1991(run.patch_T_gamma[:, 0, 0], 0.92).sum(axis=-1)
    area = np.sum(patches * ways) / np.sum(ways)
    assert np.sum(depth) * SPACING == pytest.approx(area, rel=1e-6)
    assert steady.any()


@cache
def undisturbed():
    return railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("straight"), speed=20.0,
        duration=0.2, settings=Settings(outputs={"contact_patches": True}),
    )  # fmt: skip


def changed(run, arrays):
    """A run with other arrays."""
    arrays = {name: arrays.get(name, run[name]) for name in run}
    return Result(arrays, run.quantities, run.coordinates, run.attributes)


def test_law_is_applied_to_each_patch():
    """Two patches of 150 N: 25/D each, 50/D together, as much on the tread as on the flange."""
    made = undisturbed()
    each = np.zeros_like(made.patch_N)
    across, forces, zero = each.copy(), each.copy(), each.copy()
    each[..., 0] = each[..., 2] = 150.0
    forces[..., 0], forces[..., 2] = 5e3, 20e3
    across[:, :, 1, 0], across[:, :, 1, 2] = 0.75, 0.70
    patches = {
        "patch_T_gamma": each, "patch_T_x": forces, "patch_y": across, "patch_angle": zero,
        "patch_z": zero, "patch_b": zero + 2e-3, "T_gamma": made.T_gamma * 0.0 + 300.0,
    }  # fmt: skip
    depth = worn_depth(changed(made, patches), 0, 1) * SPACING
    middle = 0.5 * (0.75 + 0.70) - tape_circle_position(1.36)
    assert np.sum(depth) == pytest.approx(50.0 / 920.0 * 1e-9, rel=1e-9)
    assert np.sum(depth[grid() < middle]) == pytest.approx(25.0 / 920.0 * 1e-9, rel=1e-9)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("roll", [-5e-3, 5e-3])
def test_wear_lies_where_a_rolled_wheelset_touches(roll, side):
    """y = y' cos(roll) - z' sin(roll), z = y' sin(roll) + z' cos(roll): y' is worn."""
    made = undisturbed()
    zero = np.zeros_like(made.patch_N)
    out = (-1.0, 1.0)[side]
    place = tape_circle_position(1.36) + 0.01  # 10 mm outside of the rolling circle
    y, z = out * place, 0.46
    patches = {"patch_T_gamma": zero.copy(), "patch_T_x": zero.copy(), "patch_angle": zero,
               "patch_y": zero + y * np.cos(roll) - z * np.sin(roll),
               "patch_z": zero + y * np.sin(roll) + z * np.cos(roll), "patch_b": zero + 2e-3,
               "body_position": made.body_position.copy()}  # fmt: skip
    patches["patch_T_gamma"][..., 0], patches["patch_T_x"][..., 0] = 150.0, 5e3
    axle = made.bodies.index(made.wheelsets[0])
    patches["body_position"][:, axle, 3] = roll
    depth = worn_depth(changed(made, patches), 0, side)
    assert np.sum(grid() * depth) / np.sum(depth) == pytest.approx(0.01, abs=5e-5)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("place", [-0.034, -0.020, 0.0, 0.02])
def test_worn_area_of_the_laws_is_that_of_the_profiles(law, place):
    """Patch to profile by each law, to 1e-4; between contours, as a polygon (Gauss)."""
    made = undisturbed()
    patches = {name: np.zeros_like(made.patch_N) for name in NEEDED if name.startswith("patch_")}
    patches["patch_T_gamma"][..., 0], patches["patch_a"][..., 0] = 150.0, 4e-3
    patches["patch_b"][..., 0] = 3e-3
    patches["patch_y"][:, :, 1] = tape_circle_position(1.36) + place
    depth = worn_depth(changed(made, patches), 0, 1, LAWS[law])
    new, distance = load_profile("S1002"), 1e5
    worn = worn_profile(new, depth, distance)
    y = np.concatenate([new.y, np.asarray(worn.y)[::-1]])
    z = np.concatenate([new.z, np.asarray(worn.z)[::-1]])
    between = 0.5 * abs(np.sum(y * np.roll(z, -1) - z * np.roll(y, -1)))
    size = np.pi * 4e-3 * 3e-3
    expected = {
        "pearce_sherratt": 25.0 / 920.0 * 1e-9,
        "usfd": 5.3e-9 * 150.0 / (7850.0 * np.pi * 0.92),  # x = 4 N/mm2
    }
    assert 150.0 / (1e6 * size) < 10.4
    assert between == pytest.approx(expected[law] * distance, rel=1e-4)


def test_wear_numbers_of_the_patches_are_those_of_the_wheels():
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250"), speed=20.0,
        start=385.0, duration=0.5, settings=Settings(outputs={"contact_patches": True}),
    )  # fmt: skip
    assert np.max(np.sum(run.patch_N[:, 0, 0] > 0.0, axis=-1)) > 1
    np.testing.assert_allclose(run.patch_T_gamma.sum(axis=-1), run.T_gamma, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(run.patch_friction[run.patch_N > 0.0], 0.4, rtol=1e-12)  # of R 250


def test_run_without_patches_is_refused():
    run = railsim.simulate(railsim.load_vehicle("coach_manchester"),
                           railsim.load_track("straight"), speed=20.0, duration=0.1)  # fmt: skip
    with pytest.raises(InputError, match="contact_patches"):
        worn_depth(run, 0, 0)
