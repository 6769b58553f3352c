"""Deflection, force and power of named elements, for the output; not part of the time loop's work.

The laws are those of `elements`, evaluated again at the recorded state.
"""

from math import sqrt

from railsim.kernels import compiled
from railsim.kernels.elements import axis_law, pad_load
from railsim.kernels.internal import curve_value
from railsim.kernels.system import (
    ANGULAR,
    DAMPING,
    DAMPING_X,
    LENGTH,
    POSITION,
    PRELOAD,
    PRELOAD_X,
    ROTATION_DAMPING_X,
    ROTATION_X,
    STIFFNESS,
    STIFFNESS_X,
    TRANSLATES,
    VELOCITY,
)

LINK, MOUNT = range(2)

# columns: deflection x y z (a link's along its line in x), angles about x y z, forces, moments,
# power taken from the bodies
DEFLECTION, ANGLE, FORCE, MOMENT, POWER = 0, 3, 6, 9, 12
ELEMENT_COLUMNS = 13


@compiled(python=False)
def element_outputs(system, work, inner, chosen, out):
    """Outputs of the elements ``chosen[e] = (group, index)`` into ``out[e, ELEMENT_COLUMNS]``."""
    for e in range(chosen.shape[0]):
        for k in range(ELEMENT_COLUMNS):
            out[e, k] = 0.0
        if chosen[e, 0] == LINK:
            link_output(system, work, inner, chosen[e, 1], e, out)
        else:
            mount_output(system, work, inner, chosen[e, 1], e, out)


@compiled
def end_point(pose, b, row, e, point):
    """Position and velocity of a point of body `b`, given in row `e` from `point` on; global."""
    x, y, z = row[e, point], row[e, point + 1], row[e, point + 2]
    px = pose[b, 0] * x + pose[b, 1] * y + pose[b, 2] * z
    py = pose[b, 3] * x + pose[b, 4] * y + pose[b, 5] * z
    pz = pose[b, 6] * x + pose[b, 7] * y + pose[b, 8] * z
    w1, w2, w3 = pose[b, ANGULAR], pose[b, ANGULAR + 1], pose[b, ANGULAR + 2]
    return (
        pose[b, POSITION] + px,
        pose[b, POSITION + 1] + py,
        pose[b, POSITION + 2] + pz,
        pose[b, VELOCITY] + w2 * pz - w3 * py,
        pose[b, VELOCITY + 1] + w3 * px - w1 * pz,
        pose[b, VELOCITY + 2] + w1 * py - w2 * px,
    )


@compiled(python=False)
def link_output(system, work, inner, index, e, out):
    """Elongation, force (tension positive) and power of a link."""
    links, curves, row = system.links, system.curves, system.links.row
    x1, y1, z1, u1, v1, w1 = end_point(work.pose, links.body[index, 0], row, index, 0)
    x2, y2, z2, u2, v2, w2 = end_point(work.pose, links.body[index, 1], row, index, 3)
    dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
    length = sqrt(dx * dx + dy * dy + dz * dz)
    rate = (dx * (u2 - u1) + dy * (v2 - v1) + dz * (w2 - w1)) / length
    elongation = length - row[index, LENGTH]
    force = row[index, PRELOAD] + row[index, STIFFNESS] * elongation + row[index, DAMPING] * rate
    if links.internal[index] >= 0:
        force += inner[links.internal[index]]
    if links.curve[index, 0] >= 0:
        force += curve_value(curves, links.curve[index, 0], elongation)
    if links.curve[index, 1] >= 0:
        force += curve_value(curves, links.curve[index, 1], rate)
    out[e, DEFLECTION] = elongation
    out[e, FORCE] = force
    out[e, POWER] = force * rate


@compiled(python=False)
def mount_output(system, work, inner, index, e, out):
    """Deflections, angles, forces, moments (on body 1, its axes) and power of a mount."""
    mounts, curves, internal = system.mounts, system.curves, system.internal
    i, j = mounts.body[index, 0], mounts.body[index, 1]
    pose, row = work.pose, mounts.row
    x1, y1, z1, u1, v1, w1 = end_point(pose, i, row, index, 0)
    x2, y2, z2, u2, v2, w2 = end_point(pose, j, row, index, 3)
    gx, gy, gz = x2 - x1, y2 - y1, z2 - z1
    a1, a2, a3 = pose[i, ANGULAR], pose[i, ANGULAR + 1], pose[i, ANGULAR + 2]
    vx = u2 - u1 - a2 * gz + a3 * gy
    vy = v2 - v1 - a3 * gx + a1 * gz
    vz = w2 - w1 - a1 * gy + a2 * gx
    if mounts.flags[index, TRANSLATES]:
        z = pose[i, 2] * gx + pose[i, 5] * gy + pose[i, 8] * gz
        normal = pad_load(mounts, curves, index, z)
        for k in range(3):
            d = pose[i, k] * gx + pose[i, 3 + k] * gy + pose[i, 6 + k] * gz
            rate = pose[i, k] * vx + pose[i, 3 + k] * vy + pose[i, 6 + k] * vz
            force = (
                row[index, PRELOAD_X + k]
                + row[index, STIFFNESS_X + k] * d
                + row[index, DAMPING_X + k] * rate
                + axis_law(mounts, internal, curves, index, k, d, rate, normal, inner, work.drive)
            )
            out[e, DEFLECTION + k] = d
            out[e, FORCE + k] = force
            out[e, POWER] += force * rate
    rotation_output(row, index, i, j, pose, e, out)


@compiled(python=False)
def rotation_output(row, index, i, j, pose, e, out):
    """Angles (antisymmetric part of R_1^T R_2), moments and their power."""
    wx = pose[j, ANGULAR] - pose[i, ANGULAR]
    wy = pose[j, ANGULAR + 1] - pose[i, ANGULAR + 1]
    wz = pose[j, ANGULAR + 2] - pose[i, ANGULAR + 2]
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        r_ba, r_ab = 0.0, 0.0
        for k in range(0, 9, 3):
            r_ba += pose[i, k + b] * pose[j, k + a]
            r_ab += pose[i, k + a] * pose[j, k + b]
        # m_axis = K_a R_ba - K_b R_ab in the order of `elements.rotation_moment`
        rate = pose[i, axis] * wx + pose[i, 3 + axis] * wy + pose[i, 6 + axis] * wz
        moment = (
            row[index, ROTATION_X + a] * r_ba
            - row[index, ROTATION_X + b] * r_ab
            + row[index, ROTATION_DAMPING_X + axis] * rate
        )
        out[e, ANGLE + axis] = 0.5 * (r_ba - r_ab)
        out[e, MOMENT + axis] = moment
        out[e, POWER] += moment * rate
