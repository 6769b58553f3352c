"""Rigid contact geometry against an independent search, and the landmarks of known pairs."""

from dataclasses import replace

import numpy as np
import pytest
from independent_contact import lowest_gap, rail_points
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from railsim.contact import contact_geometry
from railsim.contact.curves import single_valued_part
from railsim.errors import InputError
from railsim.kernels.contact_geometry import rail_height
from railsim.profiles import load_profile
from railsim.profiles.builtin import s1002_height

WHEEL_Y = np.arange(-60.0, 60.0, 0.02)
WHEEL = 1e-3 * WHEEL_Y, 1e-3 * s1002_height(WHEEL_Y)
LATERAL_BEYOND = np.linspace(-0.0345, 0.0075, 61)
PAIRS = {
    "60E1 1:40": ("60E1", 0.025, (10.228, 26.0265)),
    "60E1 1:20": ("60E1", 0.05, (10.228, 26.0265)),
    "benchmark": ("benchmark", 0.025, (10.49979, 25.98803)),
}


def test_rail_between_its_nodes_is_the_cubic_of_their_heights_and_slopes():
    """Hermite's, as scipy has it, from the first cell to the last; straight beyond."""
    rng = np.random.default_rng(4)
    y = -0.03 + 0.004 * np.arange(9)
    z, slope = 1e-3 * rng.normal(size=9), 0.3 * rng.normal(size=9)
    cubic = CubicHermiteSpline(y, z, slope)
    rail = [rail_height.py_func(at, -0.03, 0.004, z, slope) for at in LATERAL_BEYOND]
    height, inclination, node = np.array(rail).T
    inner = np.clip(LATERAL_BEYOND, y[0], y[-1])
    expected = cubic(inner) + cubic(inner, 1) * (LATERAL_BEYOND - inner)
    np.testing.assert_allclose(height, expected, atol=1e-15)
    np.testing.assert_allclose(inclination, cubic(inner, 1), atol=1e-12)
    np.testing.assert_array_equal(node, np.searchsorted(y[1:-1], LATERAL_BEYOND))


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=() if name == "60E1 1:40" else pytest.mark.further)
        for name in PAIRS
    ],
)
def pair(request):
    name, inclination, half_widths = PAIRS[request.param]
    geometry = contact_geometry(
        load_profile("S1002"),
        load_profile(name),
        inclination=inclination,
        lateral=np.linspace(-0.008, 0.008, 321),
    )
    angle = np.arctan(1 / 40) if name == "benchmark" else np.arctan(inclination)
    return geometry, rail_points(half_widths, np.tan(angle))


def independent_contact(rail, y):
    """Roll, rolling radii and contact angles of a rigid wheelset, sides left and right."""

    def sides(roll):
        right = lowest_gap(*WHEEL, *rail, y, roll, 0.0, 0.46)
        left = lowest_gap(*WHEEL, *rail, -y, -roll, 0.0, 0.46)
        return left, right

    def difference(roll):
        left, right = sides(roll)
        return right[0] - left[0]

    roll = brentq(difference, -0.012, 0.012, xtol=1e-9)
    slope = np.gradient(rail[1], rail[0])
    return roll, [
        (0.46 + np.interp(on_wheel, *WHEEL), np.arctan(-np.interp(on_rail, rail[0], slope)))
        for _, on_wheel, on_rail in sides(roll)
    ]


def test_radii_and_angles_agree_with_an_independent_search(pair):
    geometry, rail = pair
    jumps = np.array([lateral for lateral, _ in geometry.jumps(0.4e-3)] or [1.0])
    checked = 0
    for i in range(3, geometry.lateral.size, 14):
        y = geometry.lateral[i]
        if np.min(np.abs(jumps - y)) < 1e-4:
            continue
        roll, sides = independent_contact(rail, y)
        assert geometry.roll[i] == pytest.approx(roll, abs=2e-6)
        for side, (radius, angle) in enumerate(sides):
            # the independent search resolves 0.01 mm on the wheel where the gap is flat
            assert geometry.rolling_radius[i, side] == pytest.approx(radius, abs=0.01e-3)
            assert geometry.contact_angle[i, side] == pytest.approx(angle, abs=1e-3)
        checked += 1
    assert checked > 15


def test_jumps_lie_where_an_independent_search_finds_them(pair):
    geometry, rail = pair
    for lateral, side in geometry.jumps(2e-3):
        if not 0.0 < lateral < 0.0060 or side != "right":
            continue
        radii = [independent_contact(rail, lateral + d)[1][1][0] for d in (-5e-5, 5e-5)]
        assert radii[1] - radii[0] > 2e-5  # the jump's other sides are within 0.05 mm


def test_landmarks_of_s1002_on_60e1():
    # PHYSICS.md, section 6: read to about 0.1 mm and two digits
    geometry = contact_geometry(load_profile("S1002"), load_profile("60E1"))
    angle = np.interp(
        [0.0048, 0.0052, 0.0061, 0.0064], geometry.lateral, np.degrees(geometry.contact_angle[:, 1])
    )
    assert angle[0] < 8.0 < 15.0 < angle[1] < angle[2] < 30.0
    assert angle[3] == pytest.approx(70.0, abs=0.5)
    secant = [np.interp(y, geometry.lateral, geometry.delta_r) / (2 * y) for y in (0.001, 0.003)]
    assert secant == pytest.approx([0.31, 0.16], abs=0.006)
    assert geometry.equivalent_conicity([0.001, 0.003]) == pytest.approx([0.36, 0.18], abs=0.006)


def test_mirrored_displacement_mirrors_everything():
    geometry = contact_geometry(load_profile("S1002"), load_profile("60E1"))
    # round-off: both sides use the same numbers
    np.testing.assert_allclose(geometry.roll, -geometry.roll[::-1], atol=1e-12)
    np.testing.assert_allclose(
        geometry.rolling_radius, geometry.rolling_radius[::-1, ::-1], atol=1e-12
    )
    np.testing.assert_allclose(geometry.contact_y, -geometry.contact_y[::-1, ::-1], atol=1e-9)


def test_smaller_left_wheel_adds_to_the_radius_difference():
    wheel, rail = load_profile("S1002"), load_profile("60E1")
    lateral = np.array([-0.012, -0.011])  # both contacts move little here
    same = contact_geometry(wheel, rail, lateral=lateral)
    different = contact_geometry(wheel, rail, radius=(0.459, 0.460), lateral=lateral)
    assert np.all(np.isfinite(different.delta_r))
    assert different.rolling_radius[0, 0] - same.rolling_radius[0, 0] < -0.5e-3


def test_wider_gauge_moves_the_flange_contact_outwards():
    wheel, rail = load_profile("S1002"), load_profile("60E1")
    lateral = np.linspace(0.0, 0.015, 301)

    def flange_contact(**how):
        geometry = contact_geometry(wheel, rail, lateral=lateral, **how)
        return lateral[np.argmax(geometry.contact_angle[:, 1] > 1.2)]

    standard = flange_contact()
    # half of what gauge or back-to-back distance change, to a step of 0.05 mm and the roll
    assert flange_contact(gauge=1.441) - standard == pytest.approx(0.003, abs=1e-4)
    assert flange_contact(back_to_back=1.357) - standard == pytest.approx(0.0015, abs=1e-4)


@pytest.mark.parametrize(
    ("gauge", "words"),
    [
        (1.60, "falls between the rails"),
        (1.52, "falls between"),
        (1.40, "flange stands on"),
        (1.42, "flange touches"),
    ],
)
def test_gauge_that_does_not_fit_is_refused(gauge, words):
    with pytest.raises(InputError, match=words):
        contact_geometry(load_profile("S1002"), load_profile("60E1"), gauge=gauge)


def test_flange_touches_the_edge_of_a_rail_cut_vertically():
    """The innermost point of a rail with a vertical face is the edge, at half the gauge."""
    rail = load_profile("60E1")
    cut = replace(rail, y=np.maximum(rail.y, -0.030))
    found = contact_geometry(
        load_profile("S1002"), cut, inclination=0.0, lateral=[-0.008, -0.005, 0.005, 0.008]
    )
    at_flange = found.wheel_y < -0.035
    assert at_flange.tolist() == [[True, False], [True, False], [False, True], [False, True]]
    np.testing.assert_allclose(np.abs(found.contact_y[at_flange]), 0.7175, atol=5e-5)


@pytest.mark.parametrize("start", [3, 4, 5, 6])
def test_part_of_a_contour_around_a_point_ends_at_undercuts_and_steep_faces(start):
    """Back by half a metre before the fourth point, a face of slope 5 behind the seventh one."""
    y = np.array([0.0, 1.0, 2.0, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5])
    z = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 5.0, 5.0])
    assert single_valued_part(y, z, start, 1.5) == slice(3, 7)
    assert single_valued_part(y, z, start, 6.0) == slice(3, 9)
