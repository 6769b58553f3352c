"""Sine and cosine of the small angles that vehicles and tracks turn through."""

from math import cos, sin

from railsim.kernels import jit

SMALL = 0.125  # rad; up to here the series below are exact to round-off


@jit
def sine_cosine(x):
    """Sine and cosine of `x` [rad]; by Taylor's series to x^11 where |x| <= 0.125.

    The neglected terms are below x^13/13! = 3e-22.  The library functions take three times as
    long, and a vehicle needs some forty of them in each evaluation.
    """
    if not abs(x) <= SMALL:
        return sin(x), cos(x)
    q = x * x
    s = x * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (
        1.0 - q / 110.0)))))
    c = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (
        1.0 - q / 90.0 * (1.0 - q / 132.0)))))
    return s, c
