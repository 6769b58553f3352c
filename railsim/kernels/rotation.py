"""Sine and cosine of the small angles that vehicles and tracks turn through; rotations in lanes.

Matrices are tuples of nine, row by row.
"""

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


@compiled
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
def turned(R, x, y, z):
    """R times the vector (x, y, z)."""
    return (
        R[0] * x + R[1] * y + R[2] * z,
        R[3] * x + R[4] * y + R[5] * z,
        R[6] * x + R[7] * y + R[8] * z,
    )


@compiled(inline=True)
def turned_back(R, x, y, z):
    """R transposed times the vector (x, y, z)."""
    return (
        R[0] * x + R[3] * y + R[6] * z,
        R[1] * x + R[4] * y + R[7] * z,
        R[2] * x + R[5] * y + R[8] * z,
    )


@compiled(inline=True)
def cross(ax, ay, az, bx, by, bz):
    """Vector product a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled(inline=True)
def product(A, C):
    """Matrix product A C."""
    return (
        A[0] * C[0] + A[1] * C[3] + A[2] * C[6],
        A[0] * C[1] + A[1] * C[4] + A[2] * C[7],
        A[0] * C[2] + A[1] * C[5] + A[2] * C[8],
        A[3] * C[0] + A[4] * C[3] + A[5] * C[6],
        A[3] * C[1] + A[4] * C[4] + A[5] * C[7],
        A[3] * C[2] + A[4] * C[5] + A[5] * C[8],
        A[6] * C[0] + A[7] * C[3] + A[8] * C[6],
        A[6] * C[1] + A[7] * C[4] + A[8] * C[7],
        A[6] * C[2] + A[7] * C[5] + A[8] * C[8],
    )
