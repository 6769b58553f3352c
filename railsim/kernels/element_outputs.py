"""Deflection, force and power of named elements, for the output; not part of the time loop's work.

The laws are those of `elements`, evaluated again at the recorded state.
"""

from math import sqrt

from railsim.kernels import jit, jit_internal
from railsim.kernels.elements import axis_force
from railsim.kernels.internal import curve_value

LINK, MOUNT = range(2)

# columns: deflection x y z (a link's along its line in x), angles about x y z, forces, moments,
# power taken from the bodies
DEFLECTION, ANGLE, FORCE, MOMENT, POWER = 0, 3, 6, 9, 12
ELEMENT_COLUMNS = 13


@jit_internal
def element_outputs(system, work, inner, chosen, out):
    """Outputs of the elements ``chosen[e] = (group, index)`` into ``out[e, ELEMENT_COLUMNS]``."""
    for e in range(chosen.shape[0]):
        for k in range(ELEMENT_COLUMNS):
            out[e, k] = 0.0
        if chosen[e, 0] == LINK:
            link_output(system, work, inner, chosen[e, 1], e, out)
        else:
            mount_output(system, work, inner, chosen[e, 1], e, out)


@jit
def end_point(work, b, x, y, z):
    """Position and velocity of a point of body `b`, global axes."""
    R = work.R
    px = R[b, 0] * x + R[b, 1] * y + R[b, 2] * z
    py = R[b, 3] * x + R[b, 4] * y + R[b, 5] * z
    pz = R[b, 6] * x + R[b, 7] * y + R[b, 8] * z
    W = work.W
    return (
        work.X[b, 0] + px, work.X[b, 1] + py, work.X[b, 2] + pz,
        work.V[b, 0] + W[b, 1] * pz - W[b, 2] * py,
        work.V[b, 1] + W[b, 2] * px - W[b, 0] * pz,
        work.V[b, 2] + W[b, 0] * py - W[b, 1] * px,
    )


@jit_internal
def link_output(system, work, inner, index, e, out):
    """Elongation, force (tension positive) and power of a link."""
    links, curves = system.links, system.curves
    p, q = links.point, links.body
    x1, y1, z1, u1, v1, w1 = end_point(work, q[index, 0], p[index, 0, 0], p[index, 0, 1],
                                       p[index, 0, 2])
    x2, y2, z2, u2, v2, w2 = end_point(work, q[index, 1], p[index, 1, 0], p[index, 1, 1],
                                       p[index, 1, 2])
    dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
    length = sqrt(dx * dx + dy * dy + dz * dz)
    rate = (dx * (u2 - u1) + dy * (v2 - v1) + dz * (w2 - w1)) / length
    elongation = length - links.length[index]
    spring = links.spring
    force = spring[index, 2] + spring[index, 0] * elongation + spring[index, 1] * rate
    if links.internal[index] >= 0:
        force += inner[links.internal[index]]
    if links.curve[index, 0] >= 0:
        force += curve_value(curves, links.curve[index, 0], elongation)
    if links.curve[index, 1] >= 0:
        force += curve_value(curves, links.curve[index, 1], rate)
    out[e, DEFLECTION] = elongation
    out[e, FORCE] = force
    out[e, POWER] = force * rate


@jit_internal
def mount_output(system, work, inner, index, e, out):
    """Deflections, angles, forces, moments (on body 1, its axes) and power of a mount."""
    mounts, curves, internal = system.mounts, system.curves, system.internal
    i, j = mounts.body[index, 0], mounts.body[index, 1]
    R, W = work.R, work.W
    p = mounts.point
    x1, y1, z1, _, _, _ = end_point(work, i, p[index, 0, 0], p[index, 0, 1], p[index, 0, 2])
    x2, y2, z2, u2, v2, w2 = end_point(work, j, p[index, 1, 0], p[index, 1, 1], p[index, 1, 2])
    gx, gy, gz = x2 - x1, y2 - y1, z2 - z1
    lx, ly, lz = x2 - work.X[i, 0], y2 - work.X[i, 1], z2 - work.X[i, 2]
    vx = u2 - work.V[i, 0] - W[i, 1] * lz + W[i, 2] * ly
    vy = v2 - work.V[i, 1] - W[i, 2] * lx + W[i, 0] * lz
    vz = w2 - work.V[i, 2] - W[i, 0] * ly + W[i, 1] * lx
    if mounts.flags[index, 0]:
        normal = 0.0
        if mounts.flags[index, 3]:
            d = R[i, 2] * gx + R[i, 5] * gy + R[i, 8] * gz
            normal = mounts.preload[index, 2] + mounts.stiffness[index, 2] * d
        for k in range(3):
            d = R[i, k] * gx + R[i, 3 + k] * gy + R[i, 6 + k] * gz
            rate = R[i, k] * vx + R[i, 3 + k] * vy + R[i, 6 + k] * vz
            force = axis_force(mounts, internal, curves, index, k, d, rate, normal, inner,
                               work.drive)
            out[e, DEFLECTION + k] = d
            out[e, FORCE + k] = force
            out[e, POWER] += force * rate
    rotation_output(mounts, index, i, j, R, W, e, out)


@jit_internal
def rotation_output(mounts, index, i, j, R, W, e, out):
    """Angles (antisymmetric part of R_1^T R_2), moments and their power."""
    k = mounts.rotation
    wx, wy, wz = W[j, 0] - W[i, 0], W[j, 1] - W[i, 1], W[j, 2] - W[i, 2]
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        r_ba = R[i, b] * R[j, a] + R[i, 3 + b] * R[j, 3 + a] + R[i, 6 + b] * R[j, 6 + a]
        r_ab = R[i, a] * R[j, b] + R[i, 3 + a] * R[j, 3 + b] + R[i, 6 + a] * R[j, 6 + b]
        # m_axis = K_a R_ba - K_b R_ab in the order of `elements.rotation_moment`
        rate = R[i, axis] * wx + R[i, 3 + axis] * wy + R[i, 6 + axis] * wz
        moment = (k[index, a] * r_ba - k[index, b] * r_ab
                  + mounts.rotation_damping[index, axis] * rate)
        out[e, ANGLE + axis] = 0.5 * (r_ba - r_ab)
        out[e, MOMENT + axis] = moment
        out[e, POWER] += moment * rate
