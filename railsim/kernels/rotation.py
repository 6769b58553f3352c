"""Sine and cosine of the small angles that vehicles and tracks turn through."""

from math import cos, sin

from railsim.kernels import compiled
from railsim.kernels.lanes import any_beyond, cosine, sine, square_root, where_beyond

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


@compiled(inline=True)
def _arc_series(x):
    """Taylor's series of the inverse sine to x^21: what is left out is below 1e-22 of it."""
    q = x * x
    terms = 46189.0 / 5505024.0 * q + 12155.0 / 1245184.0
    terms = terms * q + 6435.0 / 557056.0
    terms = terms * q + 143.0 / 10240.0
    terms = terms * q + 231.0 / 13312.0
    terms = terms * q + 63.0 / 2816.0
    terms = terms * q + 35.0 / 1152.0
    terms = terms * q + 5.0 / 112.0
    terms = terms * q + 3.0 / 40.0
    terms = terms * q + 1.0 / 6.0
    return x + x * q * terms


@compiled(inline=True)
def arc_sine_lanes(x):
    """Inverse sine of eight numbers, beyond 0.125 by four halvings of the angle."""
    found = _arc_series(x)
    if any_beyond(x, SMALL):
        y = x
        for _ in range(4):
            y = y / square_root(2.0 + 2.0 * square_root(1.0 - y * y))
        found = where_beyond(x, SMALL, 16.0 * _arc_series(y), found)
    return found
