"""Force elements between two bodies, evaluated in global axes.

Springs derive from a potential of the bodies' positions, so that an undamped vehicle conserves
energy exactly:

- link: U(L) of the distance L between two points, force along the line (tension positive);
- mount: U(d) with d = R_1^T (P_2 - P_1) in the axes of body 1; its gradient puts the force at P_2
  on *both* bodies.  A shear spring takes half of its stiffness in the axes of each body, with P_1
  and P_2 the body-fixed points at its mid-height: the lateral force then acts at mid-height, as in
  a sheared column with parallel ends, and both end moments follow;
- rotation: U = tr(K_d (1 - R)), R = R_1^T R_2, K_d = (k_1 + k_2 + k_3)/2 - diag(k): moments
  k_i theta_i for small angles.

Rates are those of d itself, v_2 - v_1 - omega_1 x (P_2 - P_1), so that a damper's power is
force times rate.  Dampers with a series stiffness, friction pads and air springs have internal
states (see `internal`).
"""

from math import exp, sqrt

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.element_columns import (
    BOTH_ENDS,
    DAMPING_Z,
    FRICTION,
    ONE_SIDED,
    PRELOAD_Z,
    ROTATES,
    STIFFNESS_Z,
    link_columns,
    mount_columns,
)
from railsim.kernels.internal import AIR, PAD, curve_value
from railsim.kernels.lanes import (
    LANES,
    add_to_pairs,
    lane_numbers,
    load_lanes,
    load_rows,
    row_starts,
    splat,
    square_root,
    store_lanes,
)
from railsim.kernels.system import FORCE, FORCE_LINE, MOMENT, POSE_SIZE
from railsim.kernels.track_frame import ATTITUDE
from railsim.kernels.vectors import (
    add_at,
    by_axis,
    cross,
    dot,
    matrix_at,
    minus,
    negative,
    plus,
    rotate,
    rotate_back,
    times,
    vector_at,
)


@compiled(inline=True)
def pose_rows(body, end, lanes):
    """Where the rows in `Work.pose` of one end's bodies start, for eight elements."""
    a, b, c, d = body[lanes[0], end], body[lanes[1], end], body[lanes[2], end], body[lanes[3], end]
    e, f, g, h = body[lanes[4], end], body[lanes[5], end], body[lanes[6], end], body[lanes[7], end]
    return row_starts((a, b, c, d, e, f, g, h), POSE_SIZE)


@compiled(inline=True)
def body_motion(pose, rows):
    """Attitude, position, velocity and angular velocity of eight bodies."""
    r0, r1, r2, r3, r4, r5, r6, r7 = load_rows(pose, rows, 0, 8)
    r8, x, y, z, vx, vy, vz, w1 = load_rows(pose, rows, 8, 8)
    w2, w3 = load_rows(pose, rows, 16, 2)
    return (r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z), (vx, vy, vz), (w1, w2, w3)


@compiled(inline=True)
def relative_motion(pose, b1, b2, point_1, point_2):
    """Motion of points of body 2 against points of body 1, in global axes.

    Returns
    -------
    R1, R2, omega_1, omega_2 : attitudes and angular velocities of both bodies
    a, b : arms from the centres of gravity to the points
    g, w : vector from point 1 to point 2, and its rate
    """
    R1, X1, V1, omega_1 = body_motion(pose, b1)
    R2, X2, V2, omega_2 = body_motion(pose, b2)
    a, b = rotate(R1, point_1), rotate(R2, point_2)
    g = minus(plus(minus(X2, X1), b), a)
    w = minus(minus(plus(V2, cross(omega_2, b)), V1), cross(omega_1, a))
    return R1, R2, omega_1, omega_2, a, b, g, w


@compiled(inline=True)
def add_force_pair(pose, b1, b2, force, moment_1, moment_2, n):
    """Add a force and a moment to `n` bodies `b1`, the opposite force and a moment to `b2`."""
    zero = splat(0.0)
    fx, fy, fz = force
    m1, m2, m3 = moment_1
    n1, n2, n3 = moment_2
    on_1 = (zero, zero, fx, fy, fz, m1, m2, m3)
    add_to_pairs(pose, b1, b2, FORCE_LINE, on_1, (zero, zero, -fx, -fy, -fz, n1, n2, n3), n)


# Entries of `Work.laws` after those of the elements at hand: the time for which forces of tables
# and pads without tension are predicted [s], and the largest rate at which one will change [N/s].
HORIZON, STOP_RATE = 9 * LANES, 9 * LANES + 1
LAWS_SIZE = 10 * LANES


@compiled(python=False)
def update_stop_rate(laws, force, next_force):
    """Update the largest rate of stops by a change from `force` to `next_force`."""
    laws[STOP_RATE] = max(laws[STOP_RATE], abs(next_force - force) / laws[HORIZON])


@compiled(python=False)
def table_force(curves, index, d, rate, laws):
    """Force of a table at the deflection `d`; steps in which it changes fast are divided."""
    force = curve_value(curves, index, d)
    if laws[HORIZON] > 0.0:
        update_stop_rate(laws, force, curve_value(curves, index, d + laws[HORIZON] * rate))
    return force


@compiled(python=False)
def set_link_laws(system, work, first, n, internals):
    """Forces of internal states and tables of `n` links; `laws`: elongations, rates, forces."""
    links, curves, drive, laws = system.links, system.curves, work.drive, work.laws
    for k in range(n):
        e = first + k
        rate = laws[LANES + k]
        force = 0.0
        m = links.internal[e]
        if m >= 0:
            force += internals[m]
            drive[m, 0] = rate
        if unlikely(links.curve[e, 0] >= 0):
            force += table_force(curves, links.curve[e, 0], laws[k], rate, laws)
        if unlikely(links.curve[e, 1] >= 0):
            force += curve_value(curves, links.curve[e, 1], rate)
        laws[2 * LANES + k] = force


@compiled(inline=True)
def link_tension(system, work, first, n, motion, internals):
    """Direction and tension of `n` links, in lanes; `laws` keeps their elongations and rates.

    ``motion``: see `relative_motion`, and the link's columns.
    """
    g, w, (nominal, stiffness, damping, preload) = motion
    length = square_root(dot(g, g))
    direction = g[0] / length, g[1] / length, g[2] / length
    rate = dot(direction, w)
    elongation = length - nominal
    laws = work.laws
    store_lanes(laws, 0, elongation)
    store_lanes(laws, LANES, rate)
    set_link_laws(system, work, first, n, internals)
    force = preload + stiffness * elongation + damping * rate + load_lanes(laws, 2 * LANES)
    return direction, force


@compiled(python=False)
def add_link_forces(system, work, internals):
    """Add the forces of all point-to-point elements to the bodies' rows in `pose`.

    internals : float64[m]
        Internal states of elements.
    """
    links, pose = system.links, work.pose
    count = links.body.shape[0]
    for first in range(0, count, LANES):
        n = min(count - first, LANES)
        lanes = lane_numbers(first, count)
        b1, b2 = pose_rows(links.body, 0, lanes), pose_rows(links.body, 1, lanes)
        point_1, point_2, law = link_columns(links.row, lanes)
        _, _, _, _, a, b, g, w = relative_motion(pose, b1, b2, point_1, point_2)
        direction, force = link_tension(system, work, first, n, (g, w, law), internals)
        f = times(force, direction)
        add_force_pair(pose, b1, b2, f, cross(a, f), negative(cross(b, f)), n)


@compiled(inline=True)
def friction_limit(friction, e, k, normal):
    """Largest friction force of mount `e` along axis `k` under the load `normal`."""
    return friction[e, k, 0] + friction[e, k, 1] * normal


@compiled(python=False)
def friction_reduction(system, friction, e, normal, internals):
    """Factor that reduces the friction forces of a pad that slides in any direction to its limit.

    With q the forces over their limits, |q| - e q_z <= 1; e = mu/tan(angle) of a wedge, else 0.  A
    wedge without mass, on a spring force F and under a smooth face at `angle` to the column,
    presses on the column with N = (F + T_z)/tan(angle), T_z being the friction force on the side
    frame, downwards positive: |T| <= mu N.
    """
    mounts, internal = system.mounts, system.internal
    square, z, skew = 0.0, 0.0, 0.0
    for k in range(3):
        m = mounts.internal[e, k]
        if m >= 0:
            limit = friction_limit(friction, e, k, normal)
            z = internals[m] / limit if limit > 0.0 else 0.0
            square += z * z
            skew = internal.parameter[m, 2]
    size = sqrt(square) - skew * z
    return 1.0 / size if size > 1.0 else 1.0


@compiled(python=False)
def axis_force(system, work, e, k, motion, internals):
    """Force along axis `k` of mount `e` of its table and internal state.

    ``motion``: deflection, its rate, and the load on a pad.
    """
    mounts, internal, curves = system.mounts, system.internal, system.curves
    friction, drive, laws = work.friction, work.drive, work.laws
    d, rate, normal = motion
    force = 0.0
    if mounts.curve[e, k] >= 0:
        force += table_force(curves, mounts.curve[e, k], d, rate, laws)
    m = mounts.internal[e, k]
    if m >= 0:
        if internal.kind[m] == PAD:
            limit = friction_limit(friction, e, k, normal)
            drive[m, 0], drive[m, 1] = rate, limit
            if internal.parameter[m, 1] == 0.0:
                force += min(limit, max(-limit, internals[m]))
            elif limit > 0.0:
                force += internals[m] * friction_reduction(system, friction, e, normal, internals)
        elif internal.kind[m] == AIR:
            drive[m, 0] = d
            force += internal.parameter[m, 0] * (d - internals[m])
        else:
            drive[m, 0] = rate
            force += internals[m]
    if unlikely(k == 2 and mounts.flags[e, FRICTION] == ONE_SIDED):
        force += lift_off_force(mounts, e, d, rate, normal)
        if laws[HORIZON] > 0.0:
            update_stop_rate(laws, normal, pad_load(mounts, curves, e, d + laws[HORIZON] * rate))
    return force


@compiled(python=False)
def pad_load(mounts, curves, e, z):
    """Vertical spring force that loads the friction pads of mount `e` at its deflection `z`.

    It counts in the direction of the preload; of a pad without tension, which body 1 carries, as
    compression.
    """
    if mounts.flags[e, FRICTION] == 0:
        return 0.0
    preload = mounts.row[e, PRELOAD_Z]
    force = preload + mounts.row[e, STIFFNESS_Z] * z
    if mounts.curve[e, 2] >= 0:
        force += curve_value(curves, mounts.curve[e, 2], z)
    if mounts.flags[e, FRICTION] == ONE_SIDED:
        return max(0.0, force)
    if preload == 0.0:
        return abs(force)
    return max(0.0, force if preload > 0.0 else -force)


@compiled(inline=True)
def lift_off_force(mounts, e, z, rate, normal):
    """Force that cancels the tension of spring and damper of a pad that only presses."""
    spring = mounts.row[e, PRELOAD_Z] + mounts.row[e, STIFFNESS_Z] * z
    damper = mounts.row[e, DAMPING_Z] * rate
    if normal <= 0.0:
        return -spring - damper
    return max(0.0, normal + damper) - normal - damper


@compiled(python=False)
def set_mount_laws(system, work, block, internals):
    """Forces of internal states and tables of mounts; `laws`: deflections, rates, forces.

    ``block``: first mount, first of `Mounts.law` and the mount after the last one.  Returns the
    next of `Mounts.law`.
    """
    mounts, internal, laws = system.mounts, system.internal, work.laws
    first, law, stop = block
    while law < mounts.law.shape[0] and mounts.law[law, 0] < stop:
        e, k, m = mounts.law[law, 0], mounts.law[law, 1], mounts.law[law, 2]
        lane = e - first
        law += 1
        d, rate = laws[k * LANES + lane], laws[(3 + k) * LANES + lane]
        if m >= 0 and internal.kind[m] != PAD and internal.kind[m] != AIR:
            work.drive[m, 0] = rate
            laws[(6 + k) * LANES + lane] = internals[m]
            continue
        normal = pad_load(mounts, system.curves, e, laws[2 * LANES + lane])
        laws[(6 + k) * LANES + lane] = axis_force(system, work, e, k, (d, rate, normal), internals)
    return law


@compiled(inline=True)
def in_body_axes(R, omega, g, w):
    """Deflection R^T g in a body's axes, and its rate R^T (w - omega x g)."""
    return rotate_back(R, g), rotate_back(R, minus(w, cross(omega, g)))


@compiled(inline=True)
def between(d_1, d_2, share):
    """Deflection of an internal state: d_1 + share (d_2 - d_1), the mean of both ends' axes.

    F(d) halves along both ends' axes is then the gradient of its potential; share 0 gives d_1.
    """
    return plus(d_1, times(share, minus(d_2, d_1)))


@compiled(inline=True)
def spring_damper(law, d, rate):
    """F_0 + K d + C d', axis by axis."""
    stiffness, damping, preload = law
    return plus(plus(preload, by_axis(stiffness, d)), by_axis(damping, rate))


@compiled(inline=True)
def nonlinear_force(system, work, block, d, rate, internals):
    """Forces of states and tables of a block of mounts, and what `set_mount_laws` returns."""
    laws = work.laws
    zero = splat(0.0)
    for k in range(3):
        store_lanes(laws, k * LANES, d[k])
        store_lanes(laws, (3 + k) * LANES, rate[k])
        store_lanes(laws, (6 + k) * LANES, zero)
    law = set_mount_laws(system, work, block, internals)
    forces = load_lanes(laws, 6 * LANES), load_lanes(laws, 7 * LANES), load_lanes(laws, 8 * LANES)
    return forces, law


@compiled(inline=True)
def rotation_moment(R1, R2, omega_1, omega_2, law):
    """Angles, their rates and the moment on body 1 in its axes; tr(K_d (1 - R_1^T R_2)), damping.

    The angles are the antisymmetric part of R_1^T R_2.
    """
    (k1, k2, k3), damping = law
    # off-diagonal terms of R_1^T R_2
    r12 = R1[0] * R2[1] + R1[3] * R2[4] + R1[6] * R2[7]
    r13 = R1[0] * R2[2] + R1[3] * R2[5] + R1[6] * R2[8]
    r21 = R1[1] * R2[0] + R1[4] * R2[3] + R1[7] * R2[6]
    r23 = R1[1] * R2[2] + R1[4] * R2[5] + R1[7] * R2[8]
    r31 = R1[2] * R2[0] + R1[5] * R2[3] + R1[8] * R2[6]
    r32 = R1[2] * R2[1] + R1[5] * R2[4] + R1[8] * R2[7]
    rate = rotate_back(R1, minus(omega_2, omega_1))
    spring = k2 * r32 - k3 * r23, k3 * r13 - k1 * r31, k1 * r21 - k2 * r12
    angle = 0.5 * (r32 - r23), 0.5 * (r13 - r31), 0.5 * (r21 - r12)
    return angle, rate, plus(spring, by_axis(damping, rate))


@compiled(python=False)
def update_friction_limits(system, work):
    """Limits of pads with friction that falls: r + (1 - r) exp(-|v|/v_s) of those at rest.

    v is the rate of the deflection, of a pad that slides in any direction that along all its axes
    (Bo, Pavelescu 1982; as in the elastic pads of Canudas de Wit et al. 1995 it is not reduced by
    the rate of the pad's own elastic deflection).
    """
    mounts, internal = system.mounts, system.internal
    laws, pose, friction = work.laws, work.pose, work.friction
    for i in range(mounts.falling.shape[0]):
        e = mounts.falling[i]
        lanes = lane_numbers(e, e + 1)
        b1, b2 = pose_rows(mounts.body, 0, lanes), pose_rows(mounts.body, 1, lanes)
        point_1, point_2, _, _, _ = mount_columns(mounts.row, lanes)
        R1, _, omega_1, _, _, _, g, w = relative_motion(pose, b1, b2, point_1, point_2)
        _, rate = in_body_axes(R1, omega_1, g, w)
        for k in range(3):
            store_lanes(laws, k * LANES, rate[k])
        for k in range(3):
            m = mounts.internal[e, k]
            together = m >= 0 and internal.parameter[m, 1] > 0.0
            square = 0.0
            for j in range(3):
                if j == k or (together and mounts.internal[e, j] >= 0):
                    square += laws[j * LANES] * laws[j * LANES]
            ratio = mounts.friction[e, k, 2]
            share = ratio + (1.0 - ratio) * exp(-sqrt(square) / mounts.friction[e, k, 3])
            friction[e, k, 0] = share * mounts.friction[e, k, 0]
            friction[e, k, 1] = share * mounts.friction[e, k, 1]


@compiled(python=False)
def add_mount_forces(system, work, internals):
    """Add the forces of all three-axis elements to the bodies' rows in `pose`.

    The force acts in the axes of body 1, of shear and air springs half of it in those of body 2.
    The gradient of the potential puts the moment g x f on the body whose axes they are, besides
    the forces +-f at the points.  ``internals``: internal states.
    """
    mounts, pose = system.mounts, work.pose
    count = mounts.body.shape[0]
    law = 0
    for first in range(0, count, LANES):
        n = min(count - first, LANES)
        lanes = lane_numbers(first, count)
        both_ends, rotates = 0, 0
        for e in range(first, first + n):
            both_ends |= mounts.flags[e, BOTH_ENDS]
            rotates |= mounts.flags[e, ROTATES]
        b1, b2 = pose_rows(mounts.body, 0, lanes), pose_rows(mounts.body, 1, lanes)
        point_1, point_2, share, spring, rotation = mount_columns(mounts.row, lanes)
        R1, R2, omega_1, omega_2, a, b, g, w = relative_motion(pose, b1, b2, point_1, point_2)
        d, rate = in_body_axes(R1, omega_1, g, w)
        t, t_2 = spring_damper(spring, d, rate), (splat(0.0), splat(0.0), splat(0.0))
        if both_ends:
            d_2, rate_2 = in_body_axes(R2, omega_2, g, w)
            t_2 = spring_damper(spring, d_2, rate_2)
            d, rate = between(d, d_2, share[1]), between(rate, rate_2, share[1])
        if law < mounts.law.shape[0] and mounts.law[law, 0] < first + n:
            forces, law = nonlinear_force(system, work, (first, law, first + n), d, rate, internals)
            t, t_2 = plus(t, forces), plus(t_2, forces)
        f = rotate(R1, times(share[0], t))
        moment_1 = cross(g, f)
        moment_2 = splat(0.0), splat(0.0), splat(0.0)
        if both_ends:
            f_2 = rotate(R2, times(share[1], t_2))
            moment_2 = cross(g, f_2)
            f = plus(f, f_2)
        if rotates:
            _, _, m = rotation_moment(R1, R2, omega_1, omega_2, rotation)
            m = rotate(R1, m)
            moment_1, moment_2 = plus(moment_1, m), minus(moment_2, m)
        moment_1, moment_2 = plus(moment_1, cross(a, f)), minus(moment_2, cross(b, f))
        add_force_pair(pose, b1, b2, f, moment_1, moment_2, n)


@compiled(python=False)
def load_component(table, first, last, x, k):
    """Component `k` of a load at `x`: linear between its rows, constant beyond them."""
    if x <= table[first, 0]:
        return table[first, k]
    i = first
    while i < last - 1 and x > table[i + 1, 0]:
        i += 1
    if i == last - 1:
        return table[i, k]
    share = (x - table[i, 0]) / (table[i + 1, 0] - table[i, 0])
    return table[i, k] + share * (table[i + 1, k] - table[i, k])


@compiled(python=False)
def add_load_forces(system, work, time, s):
    """Add the given forces and torques at `time` and `s` to the bodies' rows in `pose`."""
    loads, pose = system.loads, work.pose
    for e in range(loads.body.shape[0]):
        b = loads.body[e]
        first, last = loads.start[e], loads.start[e + 1]
        f = system.bodies.frame[b]
        x = s + system.frame_offset[f] if loads.flags[e, 2] else time
        components = (
            load_component(loads.table, first, last, x, 1),
            load_component(loads.table, first, last, x, 2),
            load_component(loads.table, first, last, x, 3),
        )
        R = matrix_at(pose, b, 0)
        axes = matrix_at(work.frames, f, ATTITUDE) if loads.flags[e, 1] else R
        v = rotate(axes, components)
        if loads.flags[e, 0]:
            add_at(pose, b, MOMENT, v)
            continue
        add_at(pose, b, FORCE, v)
        add_at(pose, b, MOMENT, cross(rotate(R, vector_at(loads.point, e, 0)), v))
