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

import numba
import numpy as np
from numpy.typing import NDArray

from . import compiled, fastsim_simd
from .alignment import aligned_zeros
from .fastsim_simd import BOUNDS, PER_L, RESULTS, W_ACROSS, W_ALONG, W_SUM, Y_PER_L
from .lanes import LANES, load_part, maximum, minimum, splat, square_root, store_lanes, where_beyond

KALKER_U_MAX = 0.92  # the coefficient table covers |a - b| <= 0.92 (a + b): 1/24 <= a/b <= 24
WORK_ROWS = 16
_COLUMNS_MIN = 16  # least number of strips that a march takes (two vectors of eight)
# Added under the root: the least traction (relative to the bound) that counts is 1e-15.
_TINY = 1e-30
# A bound below this is none: its inverse would overflow [N].
_NO_LOAD = 1e-200
# Growth per cell relative to the bound beyond which the patch is in full sliding at once.
_GROWTH_MAX = 1e9


def fastsim_workspace(n_patch: int, ny: int, nx: int) -> NDArray[np.float64]:
    """Work array of `fastsim` for up to n_patch patches of nx by ny cells.

    Its last rows hold what depends on the grid only: the bound over a strip, 1/l of each strip
    (half of its length over a) and y/l, the weights of its sums.

    Returns
    -------
    work : ndarray, shape (WORK_ROWS, n_columns)
    """
    # eight more: the last block of patches runs over the last strip
    columns = max((n_patch * ny + 7) // 8 * 8 + 8, (max(nx, ny) + 7) // 8 * 8, 128)
    # an odd number of cache lines: rows 4 kB apart would all fall into the same sets of the cache
    columns = (columns // 8 | 1) * 8
    work = aligned_zeros((WORK_ROWS, columns))
    work[BOUNDS, :nx] = 1.0 - (1.0 - (2.0 * np.arange(nx) + 1.0) / nx) ** 2
    y = (2.0 * np.arange(ny) + 1.0 - ny) / ny
    l2 = 1.0 - y * y
    work[PER_L, :ny] = 1.0 / np.sqrt(l2)
    work[Y_PER_L, :ny] = y / np.sqrt(l2)
    work[W_SUM, :ny] = l2 * np.sqrt(l2)
    work[W_ALONG, :ny] = 2.0 / nx * l2 * l2
    work[W_ACROSS, :ny] = l2 * np.sqrt(l2) * y
    return work


@compiled(ordered=True)
def look_up_kalker(n, patches, table):
    """Kalker's coefficients of n patches from the table of `railsim.contact.kalker.creep_tables`.

    Parameters
    ----------
    n : int
        Number of patches.
    patches : Patches
        Read: semi-axes; written: c11, c22, c23, c33, linear between the nodes, outside the table
        its end values, for a = b = 0 (no contact) those of the circle; outside: 1 for a patch
        outside the table, else 0.
    table : ndarray, shape (n_node, 4)
        Coefficients over u = (a - b)/(a + b), uniform over -KALKER_U_MAX..KALKER_U_MAX [1].
    """
    a, b, outside = patches.a, patches.b, patches.outside
    c11, c22, c23, c33 = patches.c11, patches.c22, patches.c23, patches.c33
    last = table.shape[0] - 1
    scale = 0.5 * last / KALKER_U_MAX
    for i in range(n):
        total = a[i] + b[i]
        u = (a[i] - b[i]) / total if total > 0.0 else 0.0
        outside[i] = 1.0 if abs(u) > KALKER_U_MAX else 0.0
        # 0 first: the larger of it and NaN is 0, and NaN does not become an index
        position = min(max(0.0, (u + KALKER_U_MAX) * scale), float(last))
        node = min(int(position), last - 1)
        w = position - node
        c11[i] = table[node, 0] + w * (table[node + 1, 0] - table[node, 0])
        c22[i] = table[node, 1] + w * (table[node + 1, 1] - table[node, 1])
        c23[i] = table[node, 2] + w * (table[node + 1, 2] - table[node, 2])
        c33[i] = table[node, 3] + w * (table[node + 1, 3] - table[node, 3])


@compiled(inline=True)
def absolute(x):
    """|x|, lane by lane."""
    return maximum(x, -x)


@compiled(python=False)
def _patch_slopes(n, nx, patches, G, work):
    """Growth per cell of the scaled traction of every patch, at the middle strip.

    With p0 = 2 mu N/(pi a b), dx = 2 a/nx and the flexibilities, into rows 3 to 6 of work:
    dx xi_x/(L1 p0), dx xi_y/(L2 p0), dx phi a/(L3 p0), dx phi b/(L3 p0).  Zero without contact or
    friction.
    """
    per_cell, zero = math.pi * G / nx, splat(0.0)
    for i in range(0, n, LANES):
        count = n - i
        # of a number that is none or negative and 0 the larger one is 0
        a = maximum(load_part(patches.a, i, count), zero)
        b = maximum(load_part(patches.b, i, count), zero)
        mu_N = maximum(load_part(patches.mu_N, i, count), zero)
        unit = per_cell * a * b / where_beyond(mu_N, _NO_LOAD, mu_N, splat(1.0))
        narrow = square_root(b / where_beyond(a, 0.0, a, splat(1.0)))
        c23_phi = load_part(patches.c23, i, count) * load_part(patches.phi, i, count)
        spin = (4.0 / math.pi) * unit * c23_phi * narrow
        x = 0.375 * unit * load_part(patches.c11, i, count) * load_part(patches.xi_x, i, count)
        y = 0.375 * unit * load_part(patches.c22, i, count) * load_part(patches.xi_y, i, count)
        along, across = spin * a, spin * b
        total = absolute(x) + absolute(y) + absolute(along) + absolute(across)
        scale = minimum(splat(1.0), _GROWTH_MAX / (total + 1.0))
        scale = where_beyond(mu_N, _NO_LOAD, scale, zero)
        store_lanes(work[3], i, scale * x)
        store_lanes(work[4], i, scale * y)
        store_lanes(work[5], i, scale * along)
        store_lanes(work[6], i, scale * across)


@compiled
def _march_plain(work, m, nx, bounds):
    """Go along m strips from the leading edge: grow, cut back to the bound, add up.

    Rows of work: growth per cell in x and y at the leading edge's slip, growth by spin; sums of x
    and y traction, sum of the running sum of y; the rest is the state.
    """
    gx, gy, gs = work[0], work[1], work[2]
    sum_x, sum_y, sum_m = work[3], work[4], work[5]
    px, py, grow = work[6], work[7], work[8]
    for c in range(m):
        # a full step from here is the half step that the first cell needs
        grow[c] = gy[c] + gs[c]
        px[c] = -0.5 * gx[c]
        py[c] = -0.5 * grow[c] - 0.25 / nx * gs[c]
        sum_x[c] = sum_y[c] = sum_m[c] = 0.0
    for k in range(nx):
        bound = bounds[k]
        for c in range(m):
            x = px[c] + gx[c]
            y = py[c] + grow[c]
            f = min(1.0, bound / math.sqrt(x * x + y * y + _TINY))
            x *= f
            y *= f
            px[c] = x
            py[c] = y
            grow[c] -= 2.0 / nx * gs[c]
            sum_x[c] += x
            sum_y[c] += y
            sum_m[c] += sum_y[c]


@compiled
def _march_simd(work, m, nx, bounds):
    """Do what `_march_plain` does in blocks of 2 to 4 vectors of 8 strips; m >= 16."""
    vectors = m // 8
    blocks = (vectors + 3) // 4
    first = 0
    while blocks > 0:
        size = (vectors + blocks - 1) // blocks
        if size == 4:
            fastsim_simd.march_4(work, first, bounds, nx)
        elif size == 3:
            fastsim_simd.march_3(work, first, bounds, nx)
        else:
            fastsim_simd.march_2(work, first, bounds, nx)
        first += 8 * size
        vectors -= size
        blocks -= 1


_march = _march_simd if fastsim_simd.available() else _march_plain


def _spread_plain(work, n, ny):
    """Growth per cell in x, y and by spin of all strips (rows 0 to 2) from that of the patches."""
    for j in range(ny):
        strips = slice(j * n, (j + 1) * n)
        work[0, strips] = work[3, :n] * work[PER_L, j] - work[6, :n] * work[Y_PER_L, j]
        work[1, strips] = work[4, :n] * work[PER_L, j]
        work[2, strips] = work[5, :n]


def _gather_plain(work, n, ny):
    """Weighted sums over the strips of each patch into the rows `RESULTS`."""
    x, y, m = (work[k, : n * ny].reshape(ny, n) for k in (3, 4, 5))
    w, along, across = (work[k, :ny] for k in (W_SUM, W_ALONG, W_ACROSS))
    for k, value in zip(RESULTS, (w @ x, w @ y, along @ m, along @ y, across @ x), strict=True):
        work[k, :n] = value


_spread, _gather = (
    (_spread_plain, _gather_plain)
    if numba.config.DISABLE_JIT
    else (fastsim_simd.spread, fastsim_simd.gather)
)


@compiled(ordered=True)
def fastsim(n, nx, ny, patches, G, work):
    """Tangential forces on the rail of n elliptic contact patches by FASTSIM.

    Parameters
    ----------
    n : int
        Number of patches; may be 0.
    nx, ny : int
        Cells along a strip, strips, both >= 1.
    patches : Patches
        Read: semi-axes, mu N, c11, c22, c23, creepages; written: T_x, T_y, M_z.
    G : float
        Shear modulus [Pa].
    work : ndarray, shape (WORK_ROWS, >= n ny and >= nx)
        From `fastsim_workspace`, for the same nx and ny.

    Notes
    -----
    Flexibilities L1 = 8a/(3 G c11), L2 = 8a/(3 G c22), L3 = pi a sqrt(a/b)/(4 G c23); traction and
    bound at the cells' centres (the first step is half a cell), slip at the middle of each step.
    Source: Kalker (1982).  Sign: the force on the rail has the sign of the creepage.
    """
    columns = n * ny
    padded = max((columns + 7) // 8 * 8, _COLUMNS_MIN)
    _patch_slopes(n, nx, patches, G, work)
    _spread(work, n, ny)
    for c in range(columns, padded):
        work[0, c] = work[1, c] = work[2, c] = 0.0
    _march(work, padded, nx, work[BOUNDS])
    _gather(work, n, ny)
    sum_x, sum_y, running, along, across = RESULTS
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    for i in range(n):
        # p0 times the area of a cell at the middle: 2 mu N/(pi a b) (2 a/nx) (2 b/ny).  The
        # x-weighted sum of y traction follows from the sum of its running sum:
        # sum_k x_k q_k = 2/nx (sum_k sum_(i<=k) q_i) - (1 + 1/nx) sum_k q_k, x_k = 1 - (2k + 1)/nx
        unit = max(mu_N[i], 0.0) * 8.0 / (math.pi * nx * ny)
        T_x[i] = unit * work[sum_x, i]
        T_y[i] = unit * work[sum_y, i]
        M_z[i] = unit * (
            a[i] * (work[running, i] - 0.5 * (nx + 1) * work[along, i]) - b[i] * work[across, i]
        )
