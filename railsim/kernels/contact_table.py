"""Look-up of a contact table: gap and stiffness of one patch with their exact gradients.

A table holds, for the right wheel and over the wheelset's lateral displacement y, roll and
w = yaw^2, eight fields per patch (tread, flange root, flange):

    0 g      vertical displacement of the wheelset at which the patch touches (m)
    1 K      vertical stiffness: N_z = K p^(3/2) at the penetration p = z - g (N/m^1.5)
    2, 3     c_y, c_z of the contact point from the wheelset's centre, track axes (m)
    4        c_x / yaw (m/rad)
    5, 6     Hertz semi-axes at unit load, a = a1 N^(1/3) (m/N^(1/3))
    7        tan gamma, slope of the rail at the place of contact (1)

The table's values are the coefficients of uniform cubic B-splines in y and roll (twice
continuously differentiable, without overshoot) and are interpolated linearly in w.  The contact
force is the gradient of U = 2/5 K p^(5/2) *through this spline*, hence conservative by
construction, whatever the table holds.

The first axis of the grid is s = y - shear * roll, the lateral displacement of the wheel's foot,
see `railsim.contact.table`.
"""

from math import sqrt

import numba
import numpy as np

from railsim.kernels import jit
from railsim.kernels.contact_table_simd import sum_of_nodes

TREAD, FLANGE_ROOT, FLANGE = range(3)
N_PATCH = 3
N_FIELD = 8

TAN_GAMMA = 7

# results of `look_up`: the eight fields, then the gradients of all of them over y, roll and w
_Y, _ROLL, _W = N_FIELD, 2 * N_FIELD, 3 * N_FIELD
G_Y, K_Y = _Y, _Y + 1
G_ROLL, K_ROLL = _ROLL, _ROLL + 1
G_W, K_W = _W, _W + 1
LOOK_UP_SIZE = 4 * N_FIELD
N_WEIGHT = 16

# outside of the table
INSIDE, BELOW_Y, ABOVE_Y, OUTSIDE_ROLL, OUTSIDE_W = range(5)

# A patch whose gap at the nearest node exceeds the wheel's height by more than this is skipped:
# the node differs from the exact place by less (half a cell in y at a slope of 3).
FAR = 4.0e-4
LEVER = 0.75

MOST_ITERATIONS = 30  # of `coupled_approaches`; some four are needed
# Relative change of the approaches below which they have converged: Newton squares it once more.
SETTLED = 1e-8


@jit
def locate(contact, table, y, roll, w):
    """Cell and local coordinate in the three directions; a code if outside (see above)."""
    ty = (y - contact.shear[table] * roll - contact.y0) / contact.dy
    tr = (roll - contact.roll0) / contact.droll
    tw = w / contact.dw
    shape = contact.values.shape
    # comparisons are written so that NaN falls out of range
    if not ty >= 1.0:
        return BELOW_Y, 0, 0, 0, 0.0, 0.0, 0.0
    if not ty < shape[4] - 2.0:
        return ABOVE_Y, 0, 0, 0, 0.0, 0.0, 0.0
    if not (tr >= 1.0 and tr < shape[3] - 2.0):
        return OUTSIDE_ROLL, 0, 0, 0, 0.0, 0.0, 0.0
    if not tw < shape[2] - 1.0:
        return OUTSIDE_W, 0, 0, 0, 0.0, 0.0, 0.0
    iy = int(ty)
    ir = int(tr)
    iw = int(tw)
    return INSIDE, iy, ir, iw, ty - iy, tr - ir, tw - iw


@jit
def is_far(contact, table, patch, iy, ir, iw, tr, z):
    """Whether a patch is so far from touching that its look-up can be skipped."""
    node = contact.values[table, patch, iw, ir, iy, 0]
    return z - (node - LEVER * contact.droll * tr) < -FAR


@jit
def spline_weights(t, per_step, weights, first):
    """Four weights of the uniform cubic B-spline at t in [0, 1), four of its derivative.

    The derivative is over the coordinate whose grid has 1/`per_step` between nodes.
    """
    s = 1.0 - t
    t2 = t * t
    weights[first] = s * s * s / 6.0
    weights[first + 1] = (4.0 + t2 * (3.0 * t - 6.0)) / 6.0
    weights[first + 2] = (4.0 + s * s * (3.0 * s - 6.0)) / 6.0
    weights[first + 3] = t2 * t / 6.0
    weights[first + 4] = -0.5 * s * s * per_step
    weights[first + 5] = t * (1.5 * t - 2.0) * per_step
    weights[first + 6] = s * (2.0 - 1.5 * s) * per_step
    weights[first + 7] = 0.5 * t2 * per_step


@jit
def cell_weights(contact, ty, tr, weights):
    """Weights of a cell's nodes, the same for all patches of a wheel, into ``weights[16]``."""
    spline_weights(ty, 1.0 / contact.dy, weights, 0)
    spline_weights(tr, 1.0 / contact.droll, weights, 8)


def _sum_of_nodes_plain(values, first, row, slab, weights, tw, out, place):
    """Do what `contact_table_simd.sum_of_nodes` does."""
    flat = values.reshape(-1)
    starts = first + slab * np.arange(2)[:, None, None] + row * np.arange(4)[:, None]
    index = starts + N_FIELD * np.arange(4)
    nodes = flat[index[..., None] + np.arange(N_FIELD)]
    here = np.einsum("k,wrkf->wrf", weights[:4], nodes)
    slope = np.einsum("k,wrkf->wrf", weights[4:8], nodes)
    value = np.einsum("r,wrf->wf", weights[8:12], here)
    parts = (value, np.einsum("r,wrf->wf", weights[8:12], slope),
             np.einsum("r,wrf->wf", weights[12:16], here))
    sums = [*((1.0 - tw) * part[0] + tw * part[1] for part in parts), value[1] - value[0]]
    out[place:place + LOOK_UP_SIZE] = np.concatenate(sums)


_sum_of_nodes = _sum_of_nodes_plain if numba.config.DISABLE_JIT else sum_of_nodes


@jit
def look_up(contact, table, patch, iy, ir, iw, tw, weights, out, first=0):
    """Fields of one patch and their gradients into ``out[first:first + LOOK_UP_SIZE]``.

    `weights` as from `cell_weights`; gradients of fields other than g and K are those of the
    table's own coordinates.
    """
    shape = contact.values.shape
    row = shape[4] * N_FIELD
    slab = shape[3] * row
    start = ((table * N_PATCH + patch) * shape[2] + iw) * slab + (ir - 1) * row
    _sum_of_nodes(contact.values, start + (iy - 1) * N_FIELD, row, slab, weights, tw, out, first)
    shear = contact.shear[table]
    out[first + G_ROLL] -= shear * out[first + G_Y]
    out[first + K_ROLL] -= shear * out[first + K_Y]
    out[first + G_W] /= contact.dw
    out[first + K_W] /= contact.dw


@jit
def coupled_approaches(coupling, table, stiffness, approach):
    """Take from the penetrations what the neighbours' loads bend the surfaces.

    With e_i the patches' own approaches and N_i = K_i e_i^(3/2),

        e_i = p_i - sum_j kappa_ij N_j,
        U = sum_i 2/5 K_i e_i^(5/2) + sum_{i<j} kappa_ij N_i N_j

    and dU/dp_i = N_i, dU/dK_i = 2/5 e_i^(5/2): the forces stay the gradient of a potential.
    Newton's method on the three patches in a row; a patch that lifts off drops out.

    Parameters
    ----------
    stiffness : float64[3]   K, 0 for a patch that is not near
    approach : float64[3]    p (negative: apart) on entry, e on return, never below 0
    """
    p0, p1, p2 = approach[0], approach[1], approach[2]
    e0, e1, e2 = max(p0, 0.0), max(p1, 0.0), max(p2, 0.0)
    a, b = coupling[table, 0], coupling[table, 1]
    if e1 > 0.0 and (e0 > 0.0 or e2 > 0.0):
        k0, k1, k2 = stiffness[0], stiffness[1], stiffness[2]
        for _ in range(MOST_ITERATIONS):
            s0, s1, s2 = sqrt(e0), sqrt(e1), sqrt(e2)
            d0, d1, d2 = 1.5 * k0 * s0, 1.5 * k1 * s1, 1.5 * k2 * s2
            r0 = e0 - p0 + a * k1 * e1 * s1
            r1 = e1 - p1 + a * k0 * e0 * s0 + b * k2 * e2 * s2
            r2 = e2 - p2 + b * k1 * e1 * s1
            # rows 0 and 2 eliminated into row 1; one that has lifted off stays at zero
            on0 = 1.0 if e0 > 0.0 or r0 < 0.0 else 0.0
            on2 = 1.0 if e2 > 0.0 or r2 < 0.0 else 0.0
            pivot = 1.0 - on0 * a * a * d0 * d1 - on2 * b * b * d2 * d1
            c1 = (r1 - on0 * a * d0 * r0 - on2 * b * d2 * r2) / max(pivot, 0.1)
            c0 = on0 * (r0 - a * d1 * c1)
            c2 = on2 * (r2 - b * d1 * c1)
            e0, e1, e2 = max(e0 - c0, 0.0), max(e1 - c1, 0.0), max(e2 - c2, 0.0)
            if abs(c0) + abs(c1) + abs(c2) < SETTLED * (e0 + e1 + e2):
                break
    approach[0], approach[1], approach[2] = e0, e1, e2


def bounds(contact) -> np.ndarray:
    """Usable range of the tables, [[y], [roll], [w]] lower and upper."""
    shape = contact.values.shape
    return np.array([
        [contact.y0 + contact.dy, contact.y0 + (shape[4] - 2) * contact.dy],
        [contact.roll0 + contact.droll, contact.roll0 + (shape[3] - 2) * contact.droll],
        [0.0, (shape[2] - 1) * contact.dw],
    ])
