"""Look-up of a contact table: gap and stiffness of one patch with their exact gradients.

A table holds, for the right wheel and over the wheelset's lateral displacement y, roll and
w = yaw^2, twelve fields per patch (tread, flange root, flange):

    0 g      vertical displacement of the wheelset at which the patch touches (m)
    1, 2     K, K2: N_z = K e^(3/2) + K2 e^2 at the penetration e = z - g (N/m^1.5, N/m^2)
    3 a1     Hertz semi-axis along at unit load, a = a1 N^(1/3), under the middle load (m/N^(1/3))
    4, 5     c_y, c_z of the contact point from the wheelset's centre, track axes (m)
    6 b1     semi-axis across at unit load (m/N^(1/3))
    7        tan gamma, slope of the rail at the point of contact (1)
    8 to 11  what 4 to 7 gain under endless load: v + dv N/(N + HALF_LOAD)

The table's values are the coefficients of uniform cubic B-splines in y and roll (twice
continuously differentiable) and are interpolated linearly in w, whose nodes lie close together
where vehicles run, and continued linearly beyond the last of them.  The contact force is the
gradient of U = 2/5 K e^(5/2) + 1/3 K2 e^3 *through this spline*, hence conservative by
construction, whatever the table holds.  Only the first four fields, those of the force, have
gradients.  Stiffness and width of a patch are continued as far as `sum_nodes_limited` lets them.

The first axis of the grid is s = y - shear * roll, the lateral displacement of the wheel's foot,
see `railsim.contact.table`.
"""

from math import sqrt
from typing import NamedTuple

import numba
import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.contact_table_simd import sum_nodes
from railsim.kernels.record import record

TREAD, FLANGE_ROOT, FLANGE = range(3)
N_PATCH = 3
N_FIELD = 12
N_GRADIENT = 4  # the first so many have gradients

G, K, K2, A1, C_Y, C_Z, B1, TAN_GAMMA, D_C_Y, D_C_Z, D_B1, D_TAN_GAMMA = range(N_FIELD)

# results of `look_up`: the fields, then the gradients of the first four over y, roll and w
_Y = N_FIELD
_ROLL, _W = _Y + N_GRADIENT, _Y + 2 * N_GRADIENT
G_Y, K_Y, K2_Y = _Y, _Y + 1, _Y + 2
G_ROLL, K_ROLL, K2_ROLL = _ROLL, _ROLL + 1, _ROLL + 2
G_W, K_W, K2_W = _W, _W + 1, _W + 2
G_YY = _W + N_GRADIENT  # second derivative of the gap over y, see `gap_curvature`
LOOK_UP_SIZE = G_YY + 8  # whole cache lines
N_WEIGHT = 16

# outside of the table
INSIDE, BELOW_Y, ABOVE_Y, OUTSIDE_ROLL, OUTSIDE_W = range(5)

# A patch whose gap exceeds the wheel's height by more than this is skipped; it is taken at a node
# in y and between two in roll and w, which differs from the exact one by less (a cell at a slope of
# 3).
FAR_GAP = 4.0e-4
FINE_ROLL = 4e-3  # up to about this roll the nodes lie as close as in the middle [rad]

LOADS = (14e3, 45e3, 110e3)  # normal loads whose energies the table meets [N]
HALF_LOAD = 35e3  # half of the differences over the load have come [N]
MIDDLE_SHARE = LOADS[1] / (LOADS[1] + HALF_LOAD)

MAX_ITERATIONS = 30  # of `couple_approaches`; some four are needed
# Relative change of the approaches below which they have converged: Newton squares it once more.
TOLERANCE = 1e-8
MAX_W = 2.5  # over the last node of w: as far is the table continued
# Least share of the last node's stiffness and width that a continued patch keeps; root of the
# penetration at which stiffness is judged beside that at none [m^0.5].
MIN_SHARE, ROOT_DEPTH = 0.5, 0.01


@record
class RailTables(NamedTuple):
    """Contact tables of rails whose section changes, see `railsim.kernels.rail_parts`.

    Attributes
    ----------
    values : float64[z, 3, n_w, n_roll, n_y, 12]   zones, three to a table, each by its number
    shear : float64[z]           lever of roll in the tables' lateral coordinate [m]
    y0, dy, roll0, droll : float;  w : float64[n_w]   grid [m, rad, rad2]
    range_of : int64[k, w, 2]    piece of each range of the track for each wheel, else -1
    range_row : float64[k, 2]    begin and end of each range [m]
    piece : int64[p, 3]          first part and number of parts; first zone of the plain rail
    lever : float64[p]           lateral position of the nominal rolling circle [m]
    part : int64[q, 2]           first node and number of nodes of each rail
    node_s : float64[n]          positions from the begin of the range [m]
    node_zone : int64[n, 3]      numbers of their zones, -1 where nothing is near
    """

    values: np.ndarray
    shear: np.ndarray
    y0: float
    dy: float
    roll0: float
    droll: float
    w: np.ndarray
    range_of: np.ndarray
    range_row: np.ndarray
    piece: np.ndarray
    lever: np.ndarray
    part: np.ndarray
    node_s: np.ndarray
    node_zone: np.ndarray


@compiled
def stretched_roll(roll):
    """Coordinate of the roll on which the tables' nodes are evenly spaced, and its slope.

    roll/(1 + (roll/FINE_ROLL)^2)^(1/4): the roll itself near the middle, where a wheelset runs and
    a milliradian moves the contact by millimetres; its root far away.

    Returns
    -------
    float, float
        Coordinate [rad] and its derivative over the roll [1].
    """
    x = roll / FINE_ROLL
    square = 1.0 + x * x
    root = sqrt(sqrt(square))
    return roll / root, (1.0 - 0.5 * x * x / square) / root


@compiled
def find_cell(contact, table, y, roll, stretched, w):
    """Cell and local coordinate in the three directions; a code if outside (see above)."""
    ty = (y - contact.shear[table] * roll - contact.y0) / contact.dy
    tr = (stretched - contact.roll0) / contact.droll
    nodes = contact.w
    last = nodes.shape[0] - 2
    shape = contact.values.shape
    # comparisons are written so that NaN falls out of range
    if not ty >= 1.0:
        return BELOW_Y, 0, 0, 0, 0.0, 0.0, 0.0
    if not ty < shape[4] - 2.0:
        return ABOVE_Y, 0, 0, 0, 0.0, 0.0, 0.0
    if not (tr >= 1.0 and tr < shape[3] - 2.0):
        return OUTSIDE_ROLL, 0, 0, 0, 0.0, 0.0, 0.0
    if not w <= MAX_W * nodes[last + 1]:
        return OUTSIDE_W, 0, 0, 0, 0.0, 0.0, 0.0
    iy = int(ty)
    ir = int(tr)
    iw = 0
    while iw < last and w >= nodes[iw + 1]:
        iw += 1
    tw = (w - nodes[iw]) / (nodes[iw + 1] - nodes[iw])
    return INSIDE, iy, ir, iw, ty - iy, tr - ir, tw


@compiled(python=False)
def gap_curvature(contact, table, patch, iy, ir, iw, ty, tw, weights):
    """Second derivative of a patch's gap over y [1/m], the weights from `set_cell_weights`."""
    values = contact.values
    second = 1.0 - ty, 3.0 * ty - 2.0, 1.0 - 3.0 * ty, ty
    total = 0.0
    for row in range(4):
        for k in range(4):
            r, y = ir - 1 + row, iy - 1 + k
            g_0, g_1 = values[table, patch, iw, r, y, G], values[table, patch, iw + 1, r, y, G]
            total += weights[8 + row] * second[k] * (g_0 + tw * (g_1 - g_0))
    return total / (contact.dy * contact.dy)


@compiled(python=False)
def is_far(contact, table, patch, iy, ir, iw, tr, tw, z):
    """Whether a patch is so far from touching that its look-up can be skipped."""
    values = contact.values
    node, following = values[table, patch, iw, ir, iy, 0], values[table, patch, iw, ir + 1, iy, 0]
    yawed = values[table, patch, iw + 1, ir, iy, 0]
    return z - node - tr * (following - node) - tw * (yawed - node) < -FAR_GAP


@compiled(python=False)
def set_spline_weights(t, per_step, weights, first):
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


@compiled
def set_cell_weights(contact, ty, tr, roll_slope, weights):
    """Weights of a cell's nodes, the same for all patches of a wheel, into ``weights[16]``.

    `roll_slope` as from `stretched_roll`.
    """
    set_spline_weights(ty, 1.0 / contact.dy, weights, 0)
    set_spline_weights(tr, roll_slope / contact.droll, weights, 8)


def _sum_nodes_plain(values, first, row, slab, weights, tw, out, offset):
    """Do what `contact_table_simd.sum_nodes` does."""
    flat = values.reshape(-1)
    starts = first + slab * np.arange(2)[:, None, None] + row * np.arange(4)[:, None]
    index = starts + N_FIELD * np.arange(4)
    nodes = flat[index[..., None] + np.arange(N_FIELD)]
    here = np.einsum("k,wrkf->wrf", weights[:4], nodes)
    slope = np.einsum("k,wrkf->wrf", weights[4:8], nodes)
    value = np.einsum("r,wrf->wf", weights[8:12], here)
    parts = (
        value,
        np.einsum("r,wrf->wf", weights[8:12], slope)[:, :N_GRADIENT],
        np.einsum("r,wrf->wf", weights[12:16], here)[:, :N_GRADIENT],
    )
    sums = [
        *((1.0 - tw) * part[0] + tw * part[1] for part in parts),
        (value[1] - value[0])[:N_GRADIENT],
    ]
    out[offset : offset + G_YY] = np.concatenate(sums)


_sum_nodes = _sum_nodes_plain if numba.config.DISABLE_JIT else sum_nodes


@compiled(inline=True)
def continuation_share(edge, edge_y, edge_roll, value, value_y, value_roll):
    """Part of the way from a value at the last node to its continuation that is gone.

    With its derivatives after y and roll, from those of both values.
    """
    least = MIN_SHARE * edge
    if edge <= 0.0 or value >= least:
        return 1.0, 0.0, 0.0
    fall = edge - value
    gain = (edge - least) / (edge * fall * fall)
    share_y = gain * (edge * value_y - value * edge_y)
    return (edge - least) / fall, share_y, gain * (edge * value_roll - value * edge_roll)


@compiled(python=False)
def sum_nodes_limited(values, start, row, slab, weights, tw, out, first):
    """Do what `_sum_nodes` does, beyond the last node of w.

    A flange that is yawed comes to touch far ahead, where stiffness and width of its patch fall
    fast: along a straight line they would become negative, and the forces no numbers.  They go no
    further than to a share of what they are at the last node, the stiffness at no penetration and
    at `ROOT_DEPTH`; its gradients are those of what is left.
    """
    _sum_nodes(values, start, row, slab, weights, 1.0, out, first)
    k, k_y, k_roll = out[first + K], out[first + K_Y], out[first + K_ROLL]
    k2, k2_y, k2_roll = out[first + K2], out[first + K2_Y], out[first + K2_ROLL]
    a1, b1, d_b1 = out[first + A1], out[first + B1], out[first + D_B1]
    _sum_nodes(values, start, row, slab, weights, tw, out, first)
    fall, fall_y, fall_roll = (
        out[first + K] - k,
        out[first + K_Y] - k_y,
        out[first + K_ROLL] - k_roll,
    )
    fall2, fall2_y = out[first + K2] - k2, out[first + K2_Y] - k2_y
    fall2_roll = out[first + K2_ROLL] - k2_roll
    share, share_y, share_roll = continuation_share(
        k, k_y, k_roll, out[first + K], out[first + K_Y], out[first + K_ROLL]
    )
    share_2, share_2_y, share_2_roll = continuation_share(
        k + ROOT_DEPTH * k2, k_y + ROOT_DEPTH * k2_y, k_roll + ROOT_DEPTH * k2_roll,
        out[first + K] + ROOT_DEPTH * out[first + K2],
        out[first + K_Y] + ROOT_DEPTH * out[first + K2_Y],
        out[first + K_ROLL] + ROOT_DEPTH * out[first + K2_ROLL],
    )  # fmt: skip
    if share_2 < share:
        share, share_y, share_roll = share_2, share_2_y, share_2_roll
    if share < 1.0:
        out[first + K] = k + share * fall
        out[first + K_Y] = k_y + share * fall_y + share_y * fall
        out[first + K_ROLL] = k_roll + share * fall_roll + share_roll * fall
        out[first + K2] = k2 + share * fall2
        out[first + K2_Y] = k2_y + share * fall2_y + share_y * fall2
        out[first + K2_ROLL] = k2_roll + share * fall2_roll + share_roll * fall2
        out[first + K_W] = out[first + K2_W] = 0.0
    narrowest = min(out[first + B1], out[first + B1] + out[first + D_B1])
    share, _, _ = continuation_share(min(b1, b1 + d_b1), 0.0, 0.0, narrowest, 0.0, 0.0)
    if share < 1.0:
        out[first + A1] = a1 + share * (out[first + A1] - a1)
        out[first + B1] = b1 + share * (out[first + B1] - b1)
        out[first + D_B1] = d_b1 + share * (out[first + D_B1] - d_b1)


@compiled
def look_up(contact, table, patch, iy, ir, iw, tw, weights, out, first=0):
    """Fields of one patch and their gradients into ``out[first:first + LOOK_UP_SIZE]``.

    `weights` as from `set_cell_weights`; the gradient of a1 is that of the table's own coordinates.
    """
    shape = contact.values.shape
    row = shape[4] * N_FIELD
    slab = shape[3] * row
    start = ((table * N_PATCH + patch) * shape[2] + iw) * slab + (ir - 1) * row
    start += (iy - 1) * N_FIELD
    if unlikely(tw > 1.0):
        sum_nodes_limited(contact.values, start, row, slab, weights, tw, out, first)
    else:
        _sum_nodes(contact.values, start, row, slab, weights, tw, out, first)
    out[first + G_YY] = 0.0
    shear = contact.shear[table]
    out[first + G_ROLL] -= shear * out[first + G_Y]
    out[first + K_ROLL] -= shear * out[first + K_Y]
    out[first + K2_ROLL] -= shear * out[first + K2_Y]
    per_step = 1.0 / (contact.w[iw + 1] - contact.w[iw])
    out[first + G_W] *= per_step
    out[first + K_W] *= per_step
    out[first + K2_W] *= per_step


@compiled
def patch_under_load(t, first, vertical):
    """Position, direction and ellipse of a patch under a load, from a look-up at `t[first:]`.

    The ellipse of a given curvature along the rail is the longer the narrower it is, about as
    b^-0.39: the fraction is that power of the width over that under the middle load, within 2 %
    from 0.4 to 2.5 of it.

    Returns
    -------
    c_y, c_z, a1, b1, tangent : float
    """
    share = vertical / (vertical + HALF_LOAD)
    b1 = t[first + B1] + share * t[first + D_B1]
    middle = t[first + B1] + MIDDLE_SHARE * t[first + D_B1]
    a1 = t[first + A1] * (1.39 * middle + 0.61 * b1) / (0.61 * middle + 1.39 * b1)
    return (
        t[first + C_Y] + share * t[first + D_C_Y],
        t[first + C_Z] + share * t[first + D_C_Z],
        a1,
        b1,
        t[first + TAN_GAMMA] + share * t[first + D_TAN_GAMMA],
    )


@compiled
def couple_approaches(coupling, table, stiffness, approach):
    """Take from the penetrations what the neighbours' loads bend the surfaces.

    With e_i the patches' own approaches and N_i = K_i e_i^(3/2) + K2_i e_i^2,

        e_i = p_i - sum_j kappa_ij N_j,
        U = sum_i U_i(e_i) + sum_{i<j} kappa_ij N_i N_j,   dU_i/de_i = N_i,

    and dU/dp_i = N_i, dU/dK_i and dU/dK2_i are those of U_i alone: the forces stay the gradient of
    a potential.  Newton's method on the three patches in a row; a patch that lifts off drops out.

    Parameters
    ----------
    stiffness : float64[6]   K, then K2, of the patches; 0 for a patch that is not near
    approach : float64[3]    p (negative: apart) on entry, e of patches that are not on return
    """
    p0, p1, p2 = approach[0], approach[1], approach[2]
    e0, e1, e2 = max(p0, 0.0), max(p1, 0.0), max(p2, 0.0)
    a, b = coupling[table, 0], coupling[table, 1]
    if e1 > 0.0 and (e0 > 0.0 or e2 > 0.0):
        k0, k1, k2 = stiffness[0], stiffness[1], stiffness[2]
        c0, c1, c2 = stiffness[3], stiffness[4], stiffness[5]
        for _ in range(MAX_ITERATIONS):
            s0, s1, s2 = sqrt(e0), sqrt(e1), sqrt(e2)
            n0, n1, n2 = k0 + c0 * s0, k1 + c1 * s1, k2 + c2 * s2
            d0 = s0 * (1.5 * n0 + 0.5 * c0 * s0)
            d1 = s1 * (1.5 * n1 + 0.5 * c1 * s1)
            d2 = s2 * (1.5 * n2 + 0.5 * c2 * s2)
            r0 = e0 - p0 + a * n1 * e1 * s1
            r1 = e1 - p1 + a * n0 * e0 * s0 + b * n2 * e2 * s2
            r2 = e2 - p2 + b * n1 * e1 * s1
            # rows 0 and 2 eliminated into row 1; one that has lifted off stays at zero
            on0 = 1.0 if e0 > 0.0 or r0 < 0.0 else 0.0
            on2 = 1.0 if e2 > 0.0 or r2 < 0.0 else 0.0
            pivot = 1.0 - on0 * a * a * d0 * d1 - on2 * b * b * d2 * d1
            x1 = (r1 - on0 * a * d0 * r0 - on2 * b * d2 * r2) / max(pivot, 0.1)
            x0 = on0 * (r0 - a * d1 * x1)
            x2 = on2 * (r2 - b * d1 * x1)
            e0, e1, e2 = max(e0 - x0, 0.0), max(e1 - x1, 0.0), max(e2 - x2, 0.0)
            if abs(x0) + abs(x1) + abs(x2) < TOLERANCE * (e0 + e1 + e2):
                break
    # one that is apart keeps its distance, by which a strike is predicted
    approach[0] = e0 if p0 > 0.0 else p0
    approach[1] = e1 if p1 > 0.0 else p1
    approach[2] = e2 if p2 > 0.0 else p2
