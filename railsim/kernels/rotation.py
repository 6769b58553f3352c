"""Sine and cosine of the small angles that vehicles and tracks turn through."""

from math import cos, sin

from railsim.kernels import compiled
from railsim.kernels.lanes import any_beyond, cosine, sine, where_beyond

SMALL = 0.125  # rad; up to here the series below are exact to round-off


@compiled(inline=True)
def _series(x):
    """Taylor's series of sine and cosine to x^11: the neglected terms are below x^13/13! = 3e-22.

    Library functions take three times as long, and a vehicle needs some forty of them in each
    evaluation.
    """
    q = x * x
    s = x * (
        1.0
        - q
        * (1.0 / 6.0)
        * (
            1.0
            - q
            * (1.0 / 20.0)
            * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * (1.0 - q * (1.0 / 110.0))))
        )
    )
    c = 1.0 - q * (1.0 / 2.0) * (
        1.0
        - q
        * (1.0 / 12.0)
        * (
            1.0
            - q
            * (1.0 / 30.0)
            * (1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * (1.0 - q * (1.0 / 132.0))))
        )
    )
    return s, c


@compiled(python=False)
def sine_cosine(x):
    """Sine and cosine of `x` [rad], by a series where |x| <= 0.125."""
    if not abs(x) <= SMALL:
        return sin(x), cos(x)
    return _series(x)


@compiled(inline=True)
def sine_cosine_lanes(x):
    """As `sine_cosine`, of eight angles."""
    s, c = _series(x)
    if any_beyond(x, SMALL):
        s, c = where_beyond(x, SMALL, sine(x), s), where_beyond(x, SMALL, cosine(x), c)
    return s, c
