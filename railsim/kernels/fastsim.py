"""FASTSIM (Kalker 1982) for all contact patches at once.

Each elliptic patch is cut into `ny` strips of equal width along the rolling direction, each strip
into `nx` cells fitted to its length.  Traction grows from zero at the leading edge in proportion
to the rigid slip (the half-space replaced by springs) and is cut back along its own direction to
the parabolic bound ``2 mu N/(pi a b) (1 - (x/a)^2 - (y/b)^2)`` where it exceeds it.

The march along the strips is the outer loop, the strips of *all* patches the inner one: no step
of a strip depends on another strip, so that the inner loop has no branch and runs in SIMD.  Two
scalings make it short: tractions are divided by the bound at the middle of their strip, so that
the bound of march step k is one number for all strips; and the slip that drives a strip is
constant along it but for the lateral part of spin, which is linear in x.

Begin with `fastsim`.  `fastsim_workspace` allocates, outside the time loop, what it needs.

Sources: Kalker, J.J. (1982), A fast algorithm for the simplified theory of rolling contact,
Vehicle System Dynamics 11, 1-13; three flexibilities and signs as in docs/theory/creep.md.
"""

import math

import numpy as np

from . import jit

KALKER_U_MAX = 0.92  # the coefficient table covers |a - b| <= 0.92 (a + b): 1/24 <= a/b <= 24
WORK_ROWS = 8
WORK_LANES = 8  # strips are padded to a multiple of this, so that the SIMD loop has no remainder
# Added under the root: the least traction (relative to the bound) that counts is 1e-15.
_TINY = 1e-30
# Growth per cell relative to the bound beyond which the strip is in full sliding at once.
_GROWTH_MAX = 1e9


def fastsim_workspace(n_patch, ny):
    """Work array of `fastsim` for up to n_patch patches of ny strips, shape (8, n_columns)."""
    lanes = (n_patch * ny + WORK_LANES - 1) // WORK_LANES * WORK_LANES
    return np.zeros((WORK_ROWS, lanes))


@jit
def kalker_lookup(n, a, b, table, c11, c22, c23, c33):
    """Kalker's coefficients of n patches from the table of `railsim.contact.kalker.creep_tables`.

    Parameters
    ----------
    n : int
        Number of patches.
    a, b : ndarray, shape (>= n,)
        Semi-axes along and across the rolling direction, > 0 [m].
    table : ndarray, shape (n_node, 4)
        Coefficients over u = (a - b)/(a + b), uniform over -KALKER_U_MAX..KALKER_U_MAX [1].
    c11, c22, c23, c33 : ndarray, shape (>= n,), written
        Coefficients, linear between the nodes; outside the table its end values [1].
        For a = b = 0 (no contact) those of the circle.
    """
    last = table.shape[0] - 1
    scale = 0.5 * last / KALKER_U_MAX
    for i in range(n):
        total = a[i] + b[i]
        u = (a[i] - b[i]) / total if total > 0.0 else 0.0
        place = min(max((u + KALKER_U_MAX) * scale, 0.0), float(last))
        node = min(int(place), last - 1)
        w = place - node
        c11[i] = table[node, 0] + w * (table[node + 1, 0] - table[node, 0])
        c22[i] = table[node, 1] + w * (table[node + 1, 1] - table[node, 1])
        c23[i] = table[node, 2] + w * (table[node + 1, 2] - table[node, 2])
        c33[i] = table[node, 3] + w * (table[node + 1, 3] - table[node, 3])


@jit
def _strip_slopes(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, gx, gy, gs):
    """Growth of the scaled traction per cell of every strip: gx, gy constant, gs times x/l."""
    for i in range(n):
        first = i * ny
        if mu_N[i] > 0.0 and a[i] > 0.0 and b[i] > 0.0:
            # a dx / p0 with dx = 2 l/nx and p0 = 2 mu N/(pi a b); divided by l^2 below
            unit = math.pi * a[i] * a[i] * b[i] / (mu_N[i] * nx)
            per_L1 = 3.0 * G * c11[i] / (8.0 * a[i])
            per_L2 = 3.0 * G * c22[i] / (8.0 * a[i])
            per_L3 = 4.0 * G * c23[i] / (math.pi * a[i] * math.sqrt(a[i] / b[i]))
            sx = unit * xi_x[i] * per_L1
            sy = unit * xi_y[i] * per_L2
            spin = unit * phi[i] * per_L3
        else:
            sx = sy = spin = 0.0
        for j in range(ny):
            y = (2 * j + 1 - ny) / ny
            per_l = 1.0 / math.sqrt(1.0 - y * y)
            x_growth = (sx - spin * b[i] * y) * per_l
            y_growth = sy * per_l
            s_growth = spin * a[i]
            total = abs(x_growth) + abs(y_growth) + abs(s_growth)
            shrink = _GROWTH_MAX / total if total > _GROWTH_MAX else 1.0
            gx[first + j] = shrink * x_growth
            gy[first + j] = shrink * y_growth
            gs[first + j] = shrink * s_growth


@jit
def _march_step(m, weight, xi, centre, bound, gx, gy, gs, px, py, sum_x, sum_y, sum_m):
    """One cell further on all m strips: grow, cut back to the bound, add up.  The hot loop."""
    for c in range(m):
        x = px[c] + weight * gx[c]
        y = py[c] + weight * (gy[c] + xi * gs[c])
        f = min(1.0, bound / math.sqrt(x * x + y * y + _TINY))
        x *= f
        y *= f
        px[c] = x
        py[c] = y
        sum_x[c] += x
        sum_y[c] += y
        sum_m[c] += centre * y


@jit
def fastsim(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, work, T_x, T_y, M_z):
    """Tangential forces on the rail of n elliptic contact patches by FASTSIM.

    Parameters
    ----------
    n : int
        Number of patches; may be 0.
    nx, ny : int
        Cells along a strip, strips, both >= 1.
    a, b : ndarray, shape (>= n,)
        Semi-axes along and across the rolling direction [m].
    mu_N : ndarray, shape (>= n,)
        Friction coefficient times normal force [N]; where it or a semi-axis is not positive the
        force is zero.
    c11, c22, c23 : ndarray, shape (>= n,)
        Kalker's coefficients [1].
    G : float
        Shear modulus [Pa].
    xi_x, xi_y, phi : ndarray, shape (>= n,)
        Creepages, wheel minus rail (contact frame: x forward, t to the right, n into the rail)
        [1, 1, 1/m].
    work : ndarray, shape (8, >= n ny rounded up to a multiple of 8)
        From `fastsim_workspace`; contents before the call do not matter.
    T_x, T_y, M_z : ndarray, shape (>= n,), written
        Force on the rail and moment about n at the patch centre [N, N, N m].

    Notes
    -----
    Flexibilities L1 = 8a/(3 G c11), L2 = 8a/(3 G c22), L3 = pi a sqrt(a/b)/(4 G c23); traction and
    bound at the cells' centres (the first step is half a cell), slip at the middle of each step.
    Source: Kalker (1982).  Sign: the force on the rail has the sign of the creepage.
    """
    used = n * ny
    m = (used + WORK_LANES - 1) // WORK_LANES * WORK_LANES
    gx, gy, gs = work[0], work[1], work[2]
    px, py = work[3], work[4]
    sum_x, sum_y, sum_m = work[5], work[6], work[7]
    _strip_slopes(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, gx, gy, gs)
    for c in range(used, m):
        gx[c] = gy[c] = gs[c] = 0.0
    for c in range(m):
        px[c] = py[c] = 0.0
        sum_x[c] = sum_y[c] = sum_m[c] = 0.0
    for k in range(nx):
        centre = 1.0 - (2 * k + 1) / nx
        if k == 0:
            middle, weight = 1.0 - 0.5 / nx, 0.5
        else:
            middle, weight = 1.0 - 2.0 * k / nx, 1.0
        bound = 1.0 - centre * centre
        _march_step(m, weight, middle, centre, bound, gx, gy, gs, px, py, sum_x, sum_y, sum_m)
    for i in range(n):
        tx = ty = mx = my = 0.0
        for j in range(ny):
            c = i * ny + j
            y = (2 * j + 1 - ny) / ny
            l2 = 1.0 - y * y
            l = math.sqrt(l2)
            w = l * l2
            tx += w * sum_x[c]
            ty += w * sum_y[c]
            mx += w * y * sum_x[c]
            my += w * l * sum_m[c]
        # p0 times the area of a strip's cell: 2 mu N/(pi a b) (2 a l/nx) (2 b/ny)
        unit = max(mu_N[i], 0.0) * 8.0 / (math.pi * nx * ny)
        T_x[i] = unit * tx
        T_y[i] = unit * ty
        M_z[i] = unit * (a[i] * my - b[i] * mx)
