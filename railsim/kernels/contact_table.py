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

import numpy as np

from railsim.kernels import jit

TREAD, FLANGE_ROOT, FLANGE = range(3)
N_PATCH = 3
N_FIELD = 8

TAN_GAMMA = 7

# results of `look_up` beyond the eight fields: gradients of g and of K
G_Y, G_ROLL, G_W, K_Y, K_ROLL, K_W = range(8, 14)
LOOK_UP_SIZE = 14

# outside of the table
INSIDE, BELOW_Y, ABOVE_Y, OUTSIDE_ROLL, OUTSIDE_W = range(5)

# A patch whose gap at the nearest node exceeds the wheel's height by more than this is skipped:
# the node differs from the exact place by less (half a cell in y at a slope of 3).
FAR = 4.0e-4
LEVER = 0.75

MOST_ITERATIONS = 30  # of `coupled_approaches`; some four are needed
SETTLED = 1e-14  # relative change of the approaches below which they have converged


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
def spline_weights(t):
    """Weights of the uniform cubic B-spline and their derivatives at t in [0, 1)."""
    s = 1.0 - t
    t2 = t * t
    return (
        s * s * s / 6.0,
        (4.0 + t2 * (3.0 * t - 6.0)) / 6.0,
        (4.0 + s * s * (3.0 * s - 6.0)) / 6.0,
        t2 * t / 6.0,
        -0.5 * s * s,
        t * (1.5 * t - 2.0),
        s * (2.0 - 1.5 * s),
        0.5 * t2,
    )


@jit
def look_up(contact, table, patch, iy, ir, iw, ty, tr, tw, out, first=0):
    """Fields of one patch and the gradients of g and K into ``out[first:first + LOOK_UP_SIZE]``.

    Sums are kept in scalars, not in `out`: the compiler then puts the eight fields of a node,
    which lie side by side, into vector registers (2.5 times faster than sums in an array).
    """
    b0, b1, b2, b3, d0, d1, d2, d3 = spline_weights(ty)
    r0, r1, r2, r3, e0, e1, e2, e3 = spline_weights(tr)
    v = contact.values
    g = K = y = z = x = a = b = t = 0.0
    g_y = g_roll = g_w = K_y = K_roll = K_w = 0.0
    for jw in range(2):
        weight_w = tw if jw == 1 else 1.0 - tw
        slope_w = 1.0 if jw == 1 else -1.0
        for jr in range(4):
            if jr == 0:
                weight_r, slope_r = r0, e0
            elif jr == 1:
                weight_r, slope_r = r1, e1
            elif jr == 2:
                weight_r, slope_r = r2, e2
            else:
                weight_r, slope_r = r3, e3
            i, j = iw + jw, ir - 1 + jr
            weight = weight_w * weight_r
            g_here = K_here = g_slope = K_slope = 0.0
            for m in range(4):
                if m == 0:
                    weight_y, slope_y = b0, d0
                elif m == 1:
                    weight_y, slope_y = b1, d1
                elif m == 2:
                    weight_y, slope_y = b2, d2
                else:
                    weight_y, slope_y = b3, d3
                k = iy - 1 + m
                share = weight * weight_y
                g_node = v[table, patch, i, j, k, 0]
                K_node = v[table, patch, i, j, k, 1]
                g_here += weight_y * g_node
                K_here += weight_y * K_node
                g_slope += slope_y * g_node
                K_slope += slope_y * K_node
                y += share * v[table, patch, i, j, k, 2]
                z += share * v[table, patch, i, j, k, 3]
                x += share * v[table, patch, i, j, k, 4]
                a += share * v[table, patch, i, j, k, 5]
                b += share * v[table, patch, i, j, k, 6]
                t += share * v[table, patch, i, j, k, 7]
            g += weight * g_here
            K += weight * K_here
            g_y += weight * g_slope
            K_y += weight * K_slope
            g_roll += weight_w * slope_r * g_here
            K_roll += weight_w * slope_r * K_here
            g_w += slope_w * weight_r * g_here
            K_w += slope_w * weight_r * K_here
    out[first], out[first + 1], out[first + 2], out[first + 3] = g, K, y, z
    out[first + 4], out[first + 5], out[first + 6], out[first + 7] = x, a, b, t
    g_y /= contact.dy
    K_y /= contact.dy
    out[first + G_Y] = g_y
    out[first + K_Y] = K_y
    # the table's lateral coordinate moves with roll: the chain rule
    out[first + G_ROLL] = g_roll / contact.droll - contact.shear[table] * g_y
    out[first + K_ROLL] = K_roll / contact.droll - contact.shear[table] * K_y
    out[first + G_W] = g_w / contact.dw
    out[first + K_W] = K_w / contact.dw


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
