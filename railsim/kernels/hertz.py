"""Hertz contact of two smooth bodies, exact to round-off.

The elliptic integrals are Carlson's symmetric forms, by duplication: they have no cancellation
near circular patches and need no distinction between patches long along and long across the rail.

Source: H. Hertz (1881); K. L. Johnson, Contact Mechanics (1985), eq. 4.26, rewritten with
B. C. Carlson, Numerical computation of real or complex elliptic integrals (1995), eq. 2.1 to 2.28.
"""

import math

from railsim.kernels import compiled


@compiled(python=False)
def carlson_rf(x, y, z):
    """Symmetric elliptic integral of the first kind R_F(x, y, z) [1], at most one argument 0."""
    for _ in range(40):
        sx, sy, sz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = sx * sy + sy * sz + sz * sx
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        mean = (x + y + z) / 3.0
        dx, dy, dz = 1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean
        if max(abs(dx), abs(dy), abs(dz)) < 1e-3:
            break
    e2 = dx * dy + dy * dz + dz * dx
    e3 = dx * dy * dz
    return (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / math.sqrt(mean)


@compiled(python=False)
def carlson_rd(x, y, z):
    """Symmetric elliptic integral of the second kind R_D(x, y, z) [1], z > 0."""
    total, factor = 0.0, 1.0
    for _ in range(40):
        sx, sy, sz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = sx * sy + sy * sz + sz * sx
        total += factor / (sz * (z + shift))
        factor *= 0.25
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
        mean = 0.2 * (x + y + 3.0 * z)
        dx, dy, dz = 1.0 - x / mean, 1.0 - y / mean, 1.0 - z / mean
        if max(abs(dx), abs(dy), abs(dz)) < 1e-3:
            break
    ea = dx * dy
    eb = dz * dz
    e2 = ea - 6.0 * eb
    e3 = (3.0 * ea - 8.0 * eb) * dz
    e4 = 3.0 * (ea - eb) * eb
    e5 = ea * eb * dz
    series = (
        1.0
        - 3.0 * e2 / 14.0
        + e3 / 6.0
        + 9.0 * e2 * e2 / 88.0
        - 3.0 * e4 / 22.0
        - 9.0 * e2 * e3 / 52.0
        + 3.0 * e5 / 26.0
    )
    return 3.0 * total + factor * series / (mean * math.sqrt(mean))


@compiled(python=False)
def log_curvature_ratio(log_k):
    """Logarithm of A/B of the ellipse whose axis ratio b/a has the logarithm `log_k` [1]."""
    k2 = math.exp(2.0 * log_k)
    return math.log(carlson_rd(0.0, k2, 1.0) / carlson_rd(0.0, 1.0, k2))


@compiled(python=False)
def axis_ratio(A, B):
    """Axis ratio b/a of the Hertz ellipse for half relative curvatures A, B > 0 [1]."""
    target = math.log(A / B)
    x0 = 0.66 * target
    f0 = log_curvature_ratio(x0) - target
    x1 = x0 - 0.6 * f0
    for _ in range(40):
        f1 = log_curvature_ratio(x1) - target
        if abs(f1) < 2e-15 * (1.0 + abs(target)) or f1 == f0:
            break
        x0, x1, f0 = x1, x1 - f1 * (x1 - x0) / (f1 - f0), f1
    return math.exp(x1)


@compiled
def unit_load_ellipse(A, B, E_star):
    """Hertz ellipse under one newton.

    With k = b/a, Johnson's equation 4.26 reads in Carlson's integrals

        A = N R_D(0, k^2, 1)/(2 pi E* a^3),   B = N R_D(0, 1, k^2)/(2 pi E* a^3),
        approach = 3 N R_F(0, k^2, 1)/(2 pi E* a).

    Parameters
    ----------
    A, B : float
        Half the relative curvatures along and across the rail, both > 0 [1/m].
    E_star : float
        Equivalent modulus, 1/E* = 2 (1 - nu^2)/E for equal materials [Pa].

    Returns
    -------
    a1, b1 : float
        Semi-axes along and across: a = a1 N^(1/3) [m/N^(1/3)].
    d1 : float
        Approach: delta = d1 N^(2/3) [m/N^(2/3)].
    """
    k = axis_ratio(A, B)
    k2 = k * k
    a1 = (carlson_rd(0.0, k2, 1.0) / (2.0 * math.pi * E_star * A)) ** (1.0 / 3.0)
    d1 = 1.5 * carlson_rf(0.0, k2, 1.0) / (math.pi * E_star * a1)
    return a1, k * a1, d1


@compiled
def fill_ellipses(A, B, E_star, a1, b1, d1):
    """Fill `a1`, `b1`, `d1` (shape of `A`, one axis) with `unit_load_ellipse` of each pair."""
    for i in range(A.size):
        a1[i], b1[i], d1[i] = unit_load_ellipse(A[i], B[i], E_star)
