"""Equivalent conicity where it is known in closed form."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

from railsim.contact import equivalent_conicity
from railsim.errors import ModelError

Y = np.linspace(-0.008, 0.008, 321)


def test_conical_wheelset_has_its_own_conicity_at_every_amplitude():
    found = equivalent_conicity(Y, 2 * Y / 20, np.linspace(0.0005, 0.0075, 30))
    np.testing.assert_allclose(found, 0.05, rtol=1e-12)  # exact by pieces: round-off


def test_off_centre_wheelset_has_the_same_conicity():
    found = equivalent_conicity(Y, 2 * (Y - 0.002) / 20, [0.001, 0.003])
    np.testing.assert_allclose(found, 0.05, rtol=1e-10)


def test_dead_zone_gives_the_closed_form():
    gap, slope, amplitude = 0.003, 0.2, 0.005
    delta_r = 2 * slope * np.sign(Y) * np.maximum(np.abs(Y) - gap, 0.0)
    # quarter wave: harmonic over amplitude - gap, then straight across the gap
    stroke, omega = amplitude - gap, np.sqrt(2 * slope)
    quarter = 0.5 * np.pi / omega + gap / (stroke * omega)
    expected = 0.5 * np.pi**2 / (2 * quarter) ** 2
    assert equivalent_conicity(Y, delta_r, [amplitude])[0] == pytest.approx(expected, rel=1e-9)


def test_within_the_dead_zone_it_is_zero():
    delta_r = np.sign(Y) * np.maximum(np.abs(Y) - 0.003, 0.0)
    assert equivalent_conicity(Y, delta_r, [0.002])[0] == 0.0


def test_points_on_the_straight_pieces_of_a_function_change_nothing():
    """Ends and middle of the oscillation lie between points of the coarse function."""
    coarse = np.array([-8e-3, -3.7e-3, -1.1e-3, 0.4e-3, 2.9e-3, 8e-3])
    delta_r = np.array([-2.1e-3, -0.6e-3, -0.3e-3, 0.1e-3, 0.2e-3, 1.9e-3])
    fine = np.union1d(coarse, Y)
    amplitudes = [0.0009, 0.0021, 0.0043]
    found = equivalent_conicity(coarse, delta_r, amplitudes)
    expected = equivalent_conicity(fine, np.interp(fine, coarse, delta_r), amplitudes)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_wave_of_a_curved_function_agrees_with_time_integration():
    delta_r = 0.1 * Y + 3000.0 * Y**3 + 5.0 * Y**2
    amplitude = 0.005
    conicity = equivalent_conicity(Y, delta_r, [amplitude])[0]
    e, r0 = 1.5, 0.46
    wavelength = 2 * np.pi * np.sqrt(e * r0 / (2 * conicity))

    # start at the end of the oscillation whose other end is 2 amplitudes away
    def stroke(start):
        def crossing(x, state):
            return state[1]

        crossing.terminal, crossing.direction = True, 1.0
        solution = solve_ivp(
            lambda x, s: (s[1], -np.interp(s[0], Y, delta_r) / (e * r0)),
            (0, 100),
            (start, 0.0),
            events=crossing,
            rtol=1e-9,
            atol=1e-13,
            max_step=0.1,
        )
        return start - solution.y[0, -1], solution.t[-1]

    starts = np.array([0.0045, 0.0055])
    strokes = [stroke(s)[0] for s in starts]
    for _ in range(6):
        slope = (strokes[1] - strokes[0]) / (starts[1] - starts[0])
        starts = np.array([starts[1], starts[1] + (2 * amplitude - strokes[1]) / slope])
        strokes = [strokes[1], stroke(starts[1])[0]]
        if abs(strokes[1] - 2 * amplitude) < 1e-9:
            break
    # the integrator meets a kink at every node of the function
    assert 2 * stroke(starts[1])[1] == pytest.approx(wavelength, rel=1e-5)


def test_unstable_wheelset_has_no_conicity():
    assert np.isnan(equivalent_conicity(Y, -0.1 * Y, [0.003])[0])


def test_amplitude_beyond_the_function_is_not_invented():
    assert np.isnan(equivalent_conicity(Y, 0.1 * Y, [0.009])[0])


@pytest.mark.parametrize("middle", [2e-3, -2e-3])
def test_an_oscillation_that_leaves_the_function_on_one_side_has_no_conicity(middle):
    found = equivalent_conicity(Y, 2 * (Y - middle) / 20, [5.9e-3, 6.1e-3])
    assert found[0] == pytest.approx(0.05)
    assert np.isnan(found[1])


def test_nonsense_is_refused():
    with pytest.raises(ModelError, match="increasing"):
        equivalent_conicity([0.0, 0.0, 1.0], [0.0, 1.0, 2.0], [0.1])
    with pytest.raises(ModelError, match="two or more"):
        equivalent_conicity([0.0], [0.0], [0.1])
    with pytest.raises(ModelError, match="positive"):
        equivalent_conicity([0.0, 1.0], [0.0, 1.0], [-0.1])


def wavelength_integral(y, delta_r, low, high):
    """I over an oscillation between two places, by Gauss and Kronrod between its nodes.

    y = middle - amplitude cos(t) takes the singularities of the ends away.
    """
    middle, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    knots = np.unique(np.clip(y, low, high))
    potential = make_interp_spline(y, delta_r, k=1).antiderivative()
    top = float(potential(high))

    def integrand(t):
        at = middle - amplitude * np.cos(t)
        return amplitude * np.sin(t) / np.sqrt(2.0 * max(top - float(potential(at)), 1e-300))

    ends = np.arccos(np.clip((middle - knots) / amplitude, -1.0, 1.0))
    return sum(quad(integrand, a, b, epsrel=1e-9)[0] for a, b in pairwise(ends))


FALLING = np.array([-1.9, -1.2, -0.3, 0.5, 0.4, -0.1, -0.4, 0.3, 1.4, 2.0]) * 1e-3
JUMPS = np.array([-1.9, -1.8, -0.3, -0.25, -0.2, 0.1, 0.15, 1.4, 1.5, 3.0]) * 1e-3
"""Radius differences that fall between rising flanks, as of worn wheels, and in steps."""


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize(("delta_r", "amplitude"), [
    (FALLING, 5.2e-3), (FALLING, 6.4e-3), (JUMPS, 0.8e-3), (JUMPS, 3.1e-3), (JUMPS, 6.4e-3),
])  # fmt: skip
@pytest.mark.parametrize(("width", "height"), [(1.0, 1.0), (2.5, 0.3)])
def test_conicity_is_that_of_the_wavelength_by_quadrature(delta_r, amplitude, turn, width, height):
    """In the mirror the same; of a wider and lower function less by the ratio of both."""
    y = 1e-3 * np.array([-8.0, -6.5, -4.0, -2.0, -0.7, 0.9, 2.2, 3.7, 6.2, 8.0])
    potential = make_interp_spline(y, delta_r, k=1).antiderivative()

    def excess(centre):
        return float(potential(centre + amplitude) - potential(centre - amplitude))

    centre = brentq(excess, y[0] + amplitude, y[-1] - amplitude, xtol=1e-15)
    whole = wavelength_integral(y, delta_r, centre - amplitude, centre + amplitude)
    seen = (width * y, height * delta_r)
    seen = seen if turn > 0.0 else tuple(-values[::-1] for values in seen)
    (found,) = equivalent_conicity(*seen, [width * amplitude])
    assert found == pytest.approx(0.5 * np.pi**2 / whole**2 * height / width, rel=1e-6)
