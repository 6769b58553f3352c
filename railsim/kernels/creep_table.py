"""Look-up of the tabulated full theory of rolling contact.

:mod:`railsim.contact.creep_table` describes the coordinates and makes the coefficients.  Per patch:
the scaled creepages q from cubic B-splines over log(a/b), direction angles and magnitude of q, then
a product of four cubic B-splines (256 nodes, three results side by side), which is twice
continuously differentiable.
"""

import math

import numba

from . import jit
from .creep_table_simd import sum_of_rows

RATIO_MAX = 20.0  # the table covers 1/20 <= a/b <= 20
N_RATIO, N_THETA, N_PSI, N_T = 14, 9, 20, 20  # intervals of log(a/b), theta, psi, t
T_HALF = 2.0  # |q| at which t = |q|/(|q| + T_HALF) is 1/2
# atan(z) = z times this polynomial in z^2, for 0 <= z <= 1; meets pi/4 at 1
_ATAN = (
    0.9999999726974483,
    -0.3333306595,
    0.1999247172,
    -0.1420249477,
    0.1063649758,
    -0.0749495276,
    0.0425822193,
    -0.0160019045,
    0.0028333177,
)
_LOG_MAX = math.log(RATIO_MAX)
_Q_MAX = 1e12  # nothing changes beyond; its square is finite
_ROUND_OFF = 1e-9
_NO_LOAD = 1e-200  # a bound below this is none [N]
_TINY = 1e-300


@jit
def _weights(place, intervals):
    """Interval of a uniform grid and the four weights of the cubic B-splines there."""
    place = place if place > 0.0 else 0.0  # also for NaN, which must not become an index
    place = min(place, float(intervals))
    node = min(int(place), intervals - 1)
    f = place - node
    g = 1.0 - f
    return (
        node,
        g * g * g / 6.0,
        (4.0 + 3.0 * f * f * (f - 2.0)) / 6.0,
        (4.0 + 3.0 * g * g * (g - 2.0)) / 6.0,
        f * f * f / 6.0,
    )


@jit
def _angle(y, x):
    """atan2(y, x) for x, y >= 0, not both zero, by a polynomial (Hastings type, error 2e-8).

    Odd in y/x and odd about pi/4 like atan2 itself: the symmetries of the table stay exact.
    """
    steep = y > x
    z = x / y if steep else y / (x + _TINY)
    s = z * z
    p = _ATAN[8]
    for k in range(7, -1, -1):
        p = p * s + _ATAN[k]
    angle = z * p
    return 0.5 * math.pi - angle if steep else angle


def _sum_of_rows_plain(table, offsets, weights, stride, sums):
    """Do what `creep_table_simd.sum_of_rows` does."""
    sums[:16] = 0.0
    for i in range(16):
        for j in range(4):
            first = offsets[i] + j * stride
            sums[:16] += weights[4 * i + j] * table[first : first + 16]


_sum_of_rows = _sum_of_rows_plain if numba.config.DISABLE_JIT else sum_of_rows


@jit
def table_forces(n, a, b, mu_N, G, xi_x, xi_y, phi, table, scale, offsets, work, T_x, T_y, M_z):
    """Tangential forces on the rail of n elliptic contact patches by the tabulated full theory.

    Parameters
    ----------
    n : int
        Number of patches.
    a, b, mu_N, G, xi_x, xi_y, phi
        As in `railsim.kernels.fastsim.fastsim`.
    table : ndarray of float32, one dimension
        `railsim.contact.creep_table.CreepTable.coefficients`, flattened.
    scale : ndarray, shape (N_RATIO + 3, 4)
        `railsim.contact.creep_table.CreepTable.scale`.
    offsets : ndarray of int64, shape (16,)
        Scratch.
    work : ndarray, shape (>= 2, >= 64)
        Scratch: that of `railsim.kernels.fastsim.fastsim_workspace` will do.
    T_x, T_y, M_z : ndarray, shape (>= n,), written
        Force on the rail and moment about the normal [N, N, N m].

    Returns
    -------
    outside : int
        Number of loaded patches whose ratio a/b is outside the table; they got the values of its
        end.

    Notes
    -----
    Source: Kalker's full theory by our own solver; docs/validation/creep.md has the errors.
    """
    acc, weights = work[0], work[1]
    row = 4 * (N_T + 3)
    plane = row * (N_PSI + 3)
    planes = N_THETA + 3
    outside = 0
    for i in range(n):
        if not (mu_N[i] > _NO_LOAD and a[i] > 0.0 and b[i] > 0.0):
            # NaN must stay visible
            T_x[i] = 0.0 * (mu_N[i] + a[i] + b[i])
            T_y[i] = 0.0
            M_z[i] = 0.0
            continue
        log_ratio = math.log(a[i] / b[i])
        if abs(log_ratio) > _LOG_MAX + _ROUND_OFF:
            outside += 1
        r, r0, r1, r2, r3 = _weights((log_ratio / _LOG_MAX + 1.0) * (0.5 * N_RATIO), N_RATIO)
        unit = G * a[i] * b[i] / mu_N[i]
        size = math.sqrt(a[i] * b[i])
        sx = r0 * scale[r, 0] + r1 * scale[r + 1, 0] + r2 * scale[r + 2, 0] + r3 * scale[r + 3, 0]
        sy = r0 * scale[r, 1] + r1 * scale[r + 1, 1] + r2 * scale[r + 2, 1] + r3 * scale[r + 3, 1]
        ss = r0 * scale[r, 2] + r1 * scale[r + 1, 2] + r2 * scale[r + 2, 2] + r3 * scale[r + 3, 2]
        qx = unit * sx * xi_x[i]
        qy = unit * sy * xi_y[i]
        qs = unit * ss * size * phi[i]
        # reversal and mirror image: a quarter of all directions is enough
        turn_x = -1.0 if qx < 0.0 else 1.0
        turn_y = -1.0 if qs < 0.0 else 1.0
        qx = abs(qx)
        qy *= turn_y
        qs = abs(qs)
        peak = max(qx, abs(qy), qs)
        if peak > _Q_MAX:
            qx *= _Q_MAX / peak
            qy *= _Q_MAX / peak
            qs *= _Q_MAX / peak
        across = math.sqrt(qy * qy + qs * qs)
        q = math.sqrt(qx * qx + across * across)
        t = q / (q + T_HALF)
        h, h0, h1, h2, h3 = _weights(_angle(across, qx) * (2.0 * N_THETA / math.pi), N_THETA)
        psi = _angle(qs, abs(qy))
        psi = psi if qy >= 0.0 else math.pi - psi
        p, p0, p1, p2, p3 = _weights(psi * (N_PSI / math.pi), N_PSI)
        k, k0, k1, k2, k3 = _weights(t * N_T, N_T)
        in_ratio = (r0, r1, r2, r3)
        in_theta = (h0, h1, h2, h3)
        for i_r in range(4):
            for i_h in range(4):
                step = 4 * i_r + i_h
                w = in_ratio[i_r] * in_theta[i_h]
                offsets[step] = ((r + i_r) * planes + h + i_h) * plane + p * row + 4 * k
                weights[4 * step] = w * p0
                weights[4 * step + 1] = w * p1
                weights[4 * step + 2] = w * p2
                weights[4 * step + 3] = w * p3
        _sum_of_rows(table, offsets, weights, row, acc)
        x = k0 * acc[0] + k1 * acc[4] + k2 * acc[8] + k3 * acc[12]
        y = k0 * acc[1] + k1 * acc[5] + k2 * acc[9] + k3 * acc[13]
        m = k0 * acc[2] + k1 * acc[6] + k2 * acc[10] + k3 * acc[14]
        force = t * mu_N[i]
        # t is NaN where a creepage is: so are the forces
        T_x[i] = turn_x * force * x
        T_y[i] = turn_y * force * y
        M_z[i] = turn_y * force * size * m
    return outside
