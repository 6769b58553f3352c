"""Look-up of the tabulated full theory of rolling contact.

:mod:`railsim.contact.creep_table` describes the coordinates and makes the coefficients.  Per patch:
the scaled creepages q from cubic B-splines over log(a/b), direction angles and magnitude of q, then
a product of four cubic B-splines (256 nodes, three results side by side), which is twice
continuously differentiable.
"""

import math

import numba
import numpy as np

from . import compiled
from .creep_table_simd import sum_rows

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
# strides of the flattened table
_IN_PSI = 4 * (N_T + 3)
_IN_THETA = (N_PSI + 3) * _IN_PSI
_IN_RATIO = (N_THETA + 3) * _IN_THETA
# scratch: blocks of 16 patches, four in a row with 32 numbers each: the weights in log(a/b), theta,
# psi and t, the factors of T_x, T_y and M_z
_BLOCK, _RECORD = 16, 32
_LOG_MAX = math.log(RATIO_MAX)
_Q_MAX = 1e12  # nothing changes beyond; its square is finite
_ROUND_OFF = 1e-9
_NO_LOAD = 1e-200  # a bound below this is none [N]
_TINY = 1e-300


@compiled(python=False)
def _weights(position, intervals):
    """Interval of a uniform grid and the four weights of the cubic B-splines there."""
    position = position if position > 0.0 else 0.0  # also for NaN, which must not become an index
    position = min(position, float(intervals))
    node = min(int(position), intervals - 1)
    f = position - node
    g = 1.0 - f
    return (
        node,
        g * g * g / 6.0,
        (4.0 + 3.0 * f * f * (f - 2.0)) / 6.0,
        (4.0 + 3.0 * g * g * (g - 2.0)) / 6.0,
        f * f * f / 6.0,
    )


@compiled(python=False)
def _angle(y, x):
    """atan2(y, x) for x, y >= 0, not both zero, by a polynomial (Hastings type, error 2e-8).

    Odd in y/x and odd about pi/4 like atan2 itself: the symmetries of the table stay exact.
    Sums of pairs instead of Horner's chain, selection instead of branches: half the time.
    """
    longer = y if y > x else x
    shorter = x if y > x else y
    z = shorter / (longer + _TINY)
    s = z * z
    s_2 = s * s
    s_4 = s_2 * s_2
    low = (_ATAN[0] + s * _ATAN[1]) + s_2 * (_ATAN[2] + s * _ATAN[3])
    high = (_ATAN[4] + s * _ATAN[5]) + s_2 * (_ATAN[6] + s * _ATAN[7]) + s_4 * _ATAN[8]
    angle = z * (low + s_4 * high)
    return 0.5 * math.pi - angle if y > x else angle


@compiled(python=False)
def _ratio_spline(scale, r, column, r0, r1, r2, r3):
    """Factor of a creepage in q at the node r in log(a/b)."""
    return (
        r0 * scale[r, column] + r1 * scale[r + 1, column]
        + r2 * scale[r + 2, column] + r3 * scale[r + 3, column]
    )  # fmt: skip


def _sum_rows_plain(table, start, strides, weights, first, sums):
    """Do what `creep_table_simd.sum_rows` does."""
    weights = weights.ravel()[first : first + 12]
    total = np.zeros(16)
    for i in range(4):
        for j in range(4):
            for k in range(4):
                row = start + i * strides[0] + j * strides[1] + k * strides[2]
                total += weights[i] * weights[4 + j] * weights[8 + k] * table[row : row + 16]
    sums.ravel()[:16] = total


_sum_rows = _sum_rows_plain if numba.config.DISABLE_JIT else sum_rows


@compiled
def table_forces(n, patches, G, table, scale, scratch):
    """Tangential forces on the rail of n elliptic contact patches by the tabulated full theory.

    Parameters
    ----------
    n : int
        Number of patches.
    patches : Patches
        Read: semi-axes, mu N, creepages; written: T_x, T_y, M_z, outside: 1 for a loaded patch
        whose ratio a/b is outside the table; it got the values of the table's end.
    G : float
        Shear modulus [Pa].
    table : ndarray of float32, one dimension
        `railsim.contact.creep_table.CreepTable.coefficients`, flattened.
    scale : ndarray, shape (N_RATIO + 3, 4)
        `railsim.contact.creep_table.CreepTable.scale`.
    scratch : CreepScratch
        Any, its strips of shape (>= 5, >= 128).

    Notes
    -----
    Source: Kalker's full theory by our own solver; docs/validation/creep.md has the errors.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    xi_x, xi_y, phi, outside = patches.xi_x, patches.xi_y, patches.phi, patches.outside
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    work, offsets = scratch.strips, scratch.offsets
    width = work.shape[1]
    for first in range(0, n, _BLOCK):
        count = min(_BLOCK, n - first)
        # all offsets first, then all sums: the processor works on several patches at once
        for m in range(count):
            i = first + m
            row, at = 1 + (m >> 2), (m & 3) * _RECORD
            outside[i] = 0.0
            if not (mu_N[i] > _NO_LOAD and a[i] > 0.0 and b[i] > 0.0):
                offsets[m] = 0
                for k in range(16):
                    work[row, at + k] = 0.0
                for k in range(16, 19):
                    # NaN must stay visible
                    work[row, at + k] = 0.0 * (mu_N[i] + a[i] + b[i])
                continue
            log_ratio = math.log(a[i] / b[i])
            if abs(log_ratio) > _LOG_MAX + _ROUND_OFF:
                outside[i] = 1.0
            r, r0, r1, r2, r3 = _weights((log_ratio / _LOG_MAX + 1.0) * (0.5 * N_RATIO), N_RATIO)
            unit = G * a[i] * b[i] / mu_N[i]
            size = math.sqrt(a[i] * b[i])
            qx = unit * _ratio_spline(scale, r, 0, r0, r1, r2, r3) * xi_x[i]
            qy = unit * _ratio_spline(scale, r, 1, r0, r1, r2, r3) * xi_y[i]
            qs = unit * _ratio_spline(scale, r, 2, r0, r1, r2, r3) * size * phi[i]
            # reversal and mirror image: a quarter of all directions is enough
            turn_x = -1.0 if qx < 0.0 else 1.0
            turn_y = -1.0 if qs < 0.0 else 1.0
            qx = abs(qx)
            qy *= turn_y
            qs = abs(qs)
            if qx > _Q_MAX or abs(qy) > _Q_MAX or qs > _Q_MAX:
                peak = max(qx, abs(qy), qs)
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
            offsets[m] = r * _IN_RATIO + h * _IN_THETA + p * _IN_PSI + 4 * k
            work[row, at], work[row, at + 1] = r0, r1
            work[row, at + 2], work[row, at + 3] = r2, r3
            work[row, at + 4], work[row, at + 5] = h0, h1
            work[row, at + 6], work[row, at + 7] = h2, h3
            work[row, at + 8], work[row, at + 9] = p0, p1
            work[row, at + 10], work[row, at + 11] = p2, p3
            work[row, at + 12], work[row, at + 13] = k0, k1
            work[row, at + 14], work[row, at + 15] = k2, k3
            force = t * mu_N[i]
            work[row, at + 16] = turn_x * force
            work[row, at + 17] = turn_y * force
            work[row, at + 18] = turn_y * force * size
        for m in range(count):
            i = first + m
            row, at = 1 + (m >> 2), (m & 3) * _RECORD
            _sum_rows(table, offsets[m], (_IN_RATIO, _IN_THETA, _IN_PSI), work,
                         row * width + at, work)  # fmt: skip
            x = y = z = 0.0
            for k in range(4):
                x += work[row, at + 12 + k] * work[0, 4 * k]
                y += work[row, at + 12 + k] * work[0, 4 * k + 1]
                z += work[row, at + 12 + k] * work[0, 4 * k + 2]
            # the factors are NaN where an input is: so are the forces
            T_x[i] = work[row, at + 16] * x
            T_y[i] = work[row, at + 17] * y
            M_z[i] = work[row, at + 18] * z
