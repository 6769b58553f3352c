"""Patches after Kik and Piotrowski alone: a circle in closed form, and mirror images."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from railsim.contact.curves import rail_curve, tape_circle_position, wheel_curve
from railsim.contact.table import Generator, TableGrid, strip_influence
from railsim.kernels.non_elliptic import kik_piotrowski, non_elliptic_axes
from railsim.kernels.table_slice import Zone
from railsim.profiles import load_profile

E_STAR, DELTA, VIRTUAL = 1.1e11, 80e-6, 0.55


def zone(y, h, radius):
    """Candidates at `y` with the gap `h` over a rail that is level."""
    width = np.gradient(y)
    fields = dict.fromkeys(Zone._fields, np.ones(len(y)))
    more = {"h": h, "du": width, "length": width, "c_y": y, "c_z": 0.0 * y, "slope": 0.0 * y}
    both = {name: np.zeros((1, len(y))) for name in ("wheel_curvature", "rail_curvature")}
    node = np.zeros(len(y), dtype=np.int64)
    filled = {"node": node, "low": 0, "high": len(y)}
    return Zone(**{**fields, **more, **both, "radius": radius, **filled})


def patch(of, centre=0.0):
    return kik_piotrowski(of, 0, len(of.h), centre, DELTA, E_STAR, strip_influence())


@pytest.mark.parametrize("node", [0, 400, 800])
def test_influence_of_an_ellipse_is_the_double_integral(node):
    strips = strip_influence()
    ratio = np.exp(strips.start + node * strips.spacing)  # b/a

    def strip(t):
        q = abs(t) * ratio / np.sqrt(1.0 - t**2)
        # u = asinh(x/q): no peak where q is small
        return quad(lambda u: np.sqrt(1.0 - (q * np.sinh(u)) ** 2), 0.0, np.arcsinh(1.0 / q))[0]

    whole = 4.0 * quad(lambda t: np.sqrt(1.0 - t**2) * strip(t), 0.0, 1.0)[0]
    assert np.exp(strips.whole[node]) == pytest.approx(whole, rel=1e-4)


def test_circle_is_the_closed_form():
    """x_l^2 = a^2 - s^2: I1 = 2 pi/3 a^3, I2 = pi^2 a^2/2, hence N = 4/3 E* delta a."""
    R = 0.3
    a = np.sqrt(VIRTUAL * DELTA * 2.0 * R)
    y = np.linspace(-1.2 * a, 1.2 * a, 481)
    found = patch(zone(y, 0.5 * y**2 / R, R + 0.0 * y))
    assert found[0] == pytest.approx(4.0 / 3.0 * E_STAR * DELTA * a, rel=5e-3)
    assert found[1:] == pytest.approx((a, a), rel=5e-3)


@pytest.mark.parametrize(("centre", "R"), [(-0.006, 0.3), (0.006, 0.1)])
def test_of_two_circles_side_by_side_the_patch_is_the_one_at_its_centre(centre, R):
    """Closed form of a circle, see above; both touch first at once and are apart under load."""
    y = np.linspace(-0.014, 0.014, 1401)
    radius = np.where(y < 0.0, 0.3, 0.1)
    of = zone(y, 0.5 * (np.abs(y) - 0.006) ** 2 / radius, radius)
    a = np.sqrt(VIRTUAL * DELTA * 2.0 * R)
    expected = 4.0 / 3.0 * E_STAR * DELTA * a, a, a
    assert patch(of, centre) == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize(("A", "B"), [(1.1, 1.1), (1.1, 4.0), (1.1, 0.3), (0.8, 12.0)])
@pytest.mark.parametrize("load", [8e3, 70e3])
def test_patches_of_an_ellipse_are_those_of_hertz(A, B, load):
    """Semi-axes at unit load; Johnson (1985), equation 4.26, in Carlson's integrals of scipy."""
    k = brentq(lambda k: A * elliprd(0, 1, k * k) - B * elliprd(0, k * k, 1), 1e-3, 1e3)
    a1 = (elliprd(0, k * k, 1) / (2.0 * np.pi * E_STAR * A)) ** (1.0 / 3.0)
    ellipse = a1, k * a1, 1.5 * elliprf(0, k * k, 1) / (np.pi * E_STAR * a1)
    width = np.sqrt(ellipse[2] * load ** (2.0 / 3.0) / B)
    y = np.linspace(-width, width, 481)
    of = zone(y, B * y**2, 0.5 / A + 0.0 * y)
    strips = strip_influence()
    found = non_elliptic_axes(of, 0, len(y), 0.0, A, B, ellipse, load, E_STAR, strips)
    assert found == pytest.approx(ellipse[:2], rel=1e-2)


def test_mirrored_contour_has_the_same_patch():
    """A contour that curves more to one side, its candidates closer there."""
    y = np.linspace(-0.004, 0.009, 301)
    y = y + 0.04 * y * np.abs(y) / 0.009
    y = np.sort(y)
    h = np.where(y < 0.0, 60.0, 4.0) * y**2
    one = zone(y, h, 0.46 + 5.0 * y)
    other = zone(-y[::-1], h[::-1], one.radius[::-1].copy())
    assert patch(one)[0] > 1e3
    np.testing.assert_allclose(patch(other), patch(one), rtol=1e-9)


def test_patches_on_the_border_of_two_zones_do_not_depend_on_what_was_computed_before():
    """A patch goes on in the neighbouring zone: its candidates there are those of its own node."""
    wheel = wheel_curve(load_profile("S1002"), 0.46, tape_circle_position(1.360), 1e-4)
    rail = rail_curve(load_profile("60E1"), 1.435, 0.025)
    grid = TableGrid(normal="kik-piotrowski")
    generator = Generator(wheel, rail, 0.46, 0.46, 82e9, 0.28, grid)
    s, zero = np.arange(-10e-3, 10e-3, 3e-4), np.zeros(1)
    forward, back = (generator.values(rail, y, zero, zero, 1) for y in (s, s[::-1]))
    np.testing.assert_array_equal(back[:, :, :, ::-1], forward)
