"""Force elements between two bodies, evaluated in global axes.

Springs derive from a potential of the bodies' positions, so that an undamped vehicle conserves
energy exactly:

- link: U(L) of the distance L between two points, force along the line (tension positive);
- mount: U(d) with d = R_1^T (P_2 - P_1) in the axes of body 1; its gradient puts the force at P_2
  on *both* bodies.  A shear spring takes half of its stiffness in the axes of each body, with P_1
  and P_2 the body-fixed places of its mid-height: the lateral force then acts at mid-height, as in
  a sheared column with parallel ends, and both end moments follow;
- rotation: U = tr(K_d (1 - R)), R = R_1^T R_2, K_d = (k_1 + k_2 + k_3)/2 - diag(k): moments
  k_i theta_i for small angles.

Rates are those of d itself, v_2 - v_1 - omega_1 x (P_2 - P_1), so that a damper's power is
force times rate.  Dampers with a series stiffness, friction pads and air springs have internal
states (see `internal`).
"""

from math import sqrt

from railsim.kernels import compiled
from railsim.kernels.internal import AIR, PAD, curve_value
from railsim.kernels.lanes import (
    LANES,
    add_to_pairs,
    eight_from,
    load_lanes,
    load_rows,
    spread,
    square_root,
    starts,
    store_lanes,
)
from railsim.kernels.rotation import cross, turned, turned_back
from railsim.kernels.system import (
    BOTH_ENDS,
    DAMPING_Z,
    FORCE,
    FRICTION,
    LINK_SIZE,
    MOUNT_SIZE,
    ONE_SIDED,
    POSE_SIZE,
    PRELOAD_Z,
    PUSH,
    ROTATES,
    STIFFNESS_Z,
)


@compiled(inline=True)
def end_of(body, end, which):
    """Where the rows in `Work.pose` of one end's bodies start, for eight elements."""
    return (
        body[which[0], end] * POSE_SIZE,
        body[which[1], end] * POSE_SIZE,
        body[which[2], end] * POSE_SIZE,
        body[which[3], end] * POSE_SIZE,
        body[which[4], end] * POSE_SIZE,
        body[which[5], end] * POSE_SIZE,
        body[which[6], end] * POSE_SIZE,
        body[which[7], end] * POSE_SIZE,
    )


@compiled(inline=True)
def motion_of(pose, rows):
    """Attitude, position, velocity and angular velocity of eight bodies."""
    r0, r1, r2, r3, r4, r5, r6, r7 = load_rows(pose, rows, 0, 8)
    r8, x, y, z, vx, vy, vz, w1 = load_rows(pose, rows, 8, 8)
    w2, w3 = load_rows(pose, rows, 16, 2)
    return (r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z), (vx, vy, vz), (w1, w2, w3)


@compiled(inline=True)
def gap(pose, one, two, x1, y1, z1, x2, y2, z2):
    """Attitudes and angular velocities of both bodies, arms, distance of the points and its rate.

    Arms a, b from the centres to the points, the vector g between the points and its rate w, all in
    global axes.
    """
    R1, X1, V1, W1 = motion_of(pose, one)
    R2, X2, V2, W2 = motion_of(pose, two)
    ax, ay, az = turned(R1, x1, y1, z1)
    bx, by, bz = turned(R2, x2, y2, z2)
    ux, uy, uz = cross(W1[0], W1[1], W1[2], ax, ay, az)
    vx, vy, vz = cross(W2[0], W2[1], W2[2], bx, by, bz)
    g = (X2[0] - X1[0] + bx - ax, X2[1] - X1[1] + by - ay, X2[2] - X1[2] + bz - az)
    w = (V2[0] + vx - V1[0] - ux, V2[1] + vy - V1[1] - uy, V2[2] + vz - V1[2] - uz)
    return R1, R2, W1, W2, (ax, ay, az), (bx, by, bz), g, w


@compiled(inline=True)
def link_laws(links, curves, first, n, inner, drive, laws):
    """Forces of internal states and tables of `n` links; `laws`: elongations, rates, forces."""
    for k in range(n):
        e = first + k
        rate = laws[LANES + k]
        force = 0.0
        m = links.internal[e]
        if m >= 0:
            force += inner[m]
            drive[m, 0] = rate
        if links.curve[e, 0] >= 0:
            force += curve_value(curves, links.curve[e, 0], laws[k])
        if links.curve[e, 1] >= 0:
            force += curve_value(curves, links.curve[e, 1], rate)
        laws[2 * LANES + k] = force


@compiled(merge=True)
def link_forces(links, curves, inner, drive, laws, pose):
    """Add the forces of all point-to-point elements to the bodies' rows in `pose`."""
    count = links.body.shape[0]
    zero = spread(0.0)
    for first in range(0, count, LANES):
        n = min(count - first, LANES)
        which = eight_from(first, count)
        one, two = end_of(links.body, 0, which), end_of(links.body, 1, which)
        row = starts(which, LINK_SIZE)
        x1, y1, z1, x2, y2, z2, nominal, stiffness = load_rows(links.row, row, 0, 8)
        damping, preload = load_rows(links.row, row, 8, 2)
        _, _, _, _, a, b, g, w = gap(pose, one, two, x1, y1, z1, x2, y2, z2)
        length = square_root(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        nx, ny, nz = g[0] / length, g[1] / length, g[2] / length
        rate = nx * w[0] + ny * w[1] + nz * w[2]
        elongation = length - nominal
        store_lanes(laws, 0, elongation)
        store_lanes(laws, LANES, rate)
        link_laws(links, curves, first, n, inner, drive, laws)
        force = preload + stiffness * elongation + damping * rate + load_lanes(laws, 2 * LANES)
        fx, fy, fz = force * nx, force * ny, force * nz
        m1, m2, m3 = cross(a[0], a[1], a[2], fx, fy, fz)
        n1, n2, n3 = cross(b[0], b[1], b[2], fx, fy, fz)
        add_to_pairs(
            pose,
            one,
            two,
            PUSH,
            (zero, zero, fx, fy, fz, m1, m2, m3),
            (zero, zero, -fx, -fy, -fz, -n1, -n2, -n3),
            n,
        )


@compiled(inline=True)
def limit_of(mounts, e, k, normal):
    """Largest friction force of mount `e` along axis `k` under the load `normal`."""
    return mounts.friction[e, k, 0] + mounts.friction[e, k, 1] * normal


@compiled(python=False)
def grip(mounts, internal, e, normal, inner):
    """Factor that brings the friction forces of a pad that slides in any direction to its limit.

    With q the forces over their limits, |q| - e q_z <= 1; e = mu/tan(angle) of a wedge, else 0.  A
    wedge without mass, on a spring force F and under a smooth face at `angle` to the column,
    presses on the column with N = (F + T_z)/tan(angle), T_z being the friction force on the side
    frame, downwards positive: |T| <= mu N.
    """
    square, z, skew = 0.0, 0.0, 0.0
    for k in range(3):
        m = mounts.internal[e, k]
        if m >= 0:
            limit = limit_of(mounts, e, k, normal)
            z = inner[m] / limit if limit > 0.0 else 0.0
            square += z * z
            skew = internal.parameter[m, 2]
    size = sqrt(square) - skew * z
    return 1.0 / size if size > 1.0 else 1.0


@compiled(inline=True)
def axis_law(mounts, internal, curves, e, k, d, rate, normal, inner, drive):
    """Force along axis `k` of mount `e` of its table and internal state; `normal` loads a pad."""
    force = 0.0
    if mounts.curve[e, k] >= 0:
        force += curve_value(curves, mounts.curve[e, k], d)
    m = mounts.internal[e, k]
    if m >= 0:
        if internal.kind[m] == PAD:
            limit = limit_of(mounts, e, k, normal)
            drive[m, 0], drive[m, 1] = rate, limit
            if internal.parameter[m, 1] == 0.0:
                force += min(limit, max(-limit, inner[m]))
            elif limit > 0.0:
                force += inner[m] * grip(mounts, internal, e, normal, inner)
        elif internal.kind[m] == AIR:
            drive[m, 0] = d
            force += internal.parameter[m, 0] * (d - inner[m])
        else:
            drive[m, 0] = rate
            force += inner[m]
    if k == 2 and mounts.flags[e, FRICTION] == ONE_SIDED:
        force += lifted_part(mounts, e, d, rate, normal)
    return force


@compiled(inline=True)
def pad_load(mounts, curves, e, z):
    """Vertical spring force that loads the friction pads of mount `e` at its deflection `z`.

    It counts in the direction of the preload; of a pad without tension, which body 1 carries, as
    compression.
    """
    if mounts.flags[e, FRICTION] == 0:
        return 0.0
    preload = mounts.row[e, PRELOAD_Z]
    force = preload + mounts.row[e, STIFFNESS_Z] * z
    if mounts.flags[e, FRICTION] == ONE_SIDED:
        if mounts.curve[e, 2] >= 0:
            force += curve_value(curves, mounts.curve[e, 2], z)
        return max(0.0, force)
    if preload == 0.0:
        return abs(force)
    return max(0.0, force if preload > 0.0 else -force)


@compiled(inline=True)
def lifted_part(mounts, e, z, rate, normal):
    """What takes the tension out of the spring and damper of a pad that only presses."""
    spring = mounts.row[e, PRELOAD_Z] + mounts.row[e, STIFFNESS_Z] * z
    damper = mounts.row[e, DAMPING_Z] * rate
    if normal <= 0.0:
        return -spring - damper
    return max(0.0, normal + damper) - normal - damper


@compiled(inline=True)
def mount_laws(mounts, internal, curves, first, law, end, inner, drive, laws):
    """Forces of internal states and tables of mounts; `laws`: deflections, rates, forces."""
    for i in range(law, end):
        e, k = mounts.law[i] // 3, mounts.law[i] % 3
        lane = e - first
        d, rate = laws[k * LANES + lane], laws[(3 + k) * LANES + lane]
        normal = pad_load(mounts, curves, e, laws[2 * LANES + lane])
        laws[(6 + k) * LANES + lane] = axis_law(
            mounts, internal, curves, e, k, d, rate, normal, inner, drive
        )


@compiled(inline=True)
def in_axes_of(R, W, g, w):
    """Deflection R^T g in a body's axes, and its rate R^T (w - omega x g)."""
    x, y, z = cross(W[0], W[1], W[2], g[0], g[1], g[2])
    return turned_back(R, g[0], g[1], g[2]), turned_back(R, w[0] - x, w[1] - y, w[2] - z)


@compiled(inline=True)
def rotation_moment(R1, R2, W1, W2, k1, k2, k3, c1, c2, c3):
    """Moment on body 1 of the rotational potential tr(K_d (1 - R_1^T R_2)) and its damping."""
    # off-diagonal terms of R_1^T R_2
    r12 = R1[0] * R2[1] + R1[3] * R2[4] + R1[6] * R2[7]
    r13 = R1[0] * R2[2] + R1[3] * R2[5] + R1[6] * R2[8]
    r21 = R1[1] * R2[0] + R1[4] * R2[3] + R1[7] * R2[6]
    r23 = R1[1] * R2[2] + R1[4] * R2[5] + R1[7] * R2[8]
    r31 = R1[2] * R2[0] + R1[5] * R2[3] + R1[8] * R2[6]
    r32 = R1[2] * R2[1] + R1[5] * R2[4] + R1[8] * R2[7]
    wx, wy, wz = turned_back(R1, W2[0] - W1[0], W2[1] - W1[1], W2[2] - W1[2])
    return turned(
        R1,
        k2 * r32 - k3 * r23 + c1 * wx,
        k3 * r13 - k1 * r31 + c2 * wy,
        k1 * r21 - k2 * r12 + c3 * wz,
    )


@compiled(merge=True)
def mount_forces(mounts, internal, curves, inner, drive, laws, pose):
    """Add the forces of all three-axis elements to the bodies' rows in `pose`.

    The force acts in the axes of body 1, of a shear spring half of it in those of body 2.  The
    gradient of the potential puts the moment g x f on the body whose axes they are, besides the
    forces +-f at the points.
    """
    count = mounts.body.shape[0]
    zero = spread(0.0)
    law = 0
    for first in range(0, count, LANES):
        n = min(count - first, LANES)
        which = eight_from(first, count)
        both_ends, rotates = 0, 0
        for e in range(first, first + n):
            both_ends |= mounts.flags[e, BOTH_ENDS]
            rotates |= mounts.flags[e, ROTATES]
        end = law
        while end < mounts.law.shape[0] and mounts.law[end] < 3 * (first + n):
            end += 1
        one, two = end_of(mounts.body, 0, which), end_of(mounts.body, 1, which)
        row = starts(which, MOUNT_SIZE)
        x1, y1, z1, x2, y2, z2, share_1, share_2 = load_rows(mounts.row, row, 0, 8)
        kx, ky, kz, cx, cy, cz, fx_0, fy_0 = load_rows(mounts.row, row, 8, 8)
        fz_0, k1, k2, k3, c1, c2, c3 = load_rows(mounts.row, row, 16, 7)
        R1, R2, W1, W2, a, b, g, w = gap(pose, one, two, x1, y1, z1, x2, y2, z2)
        d, rate = in_axes_of(R1, W1, g, w)
        tx = fx_0 + kx * d[0] + cx * rate[0]
        ty = fy_0 + ky * d[1] + cy * rate[1]
        tz = fz_0 + kz * d[2] + cz * rate[2]
        if law < end:
            for k in range(3):
                store_lanes(laws, k * LANES, d[k])
                store_lanes(laws, (3 + k) * LANES, rate[k])
                store_lanes(laws, (6 + k) * LANES, zero)
            mount_laws(mounts, internal, curves, first, law, end, inner, drive, laws)
            law = end
            tx = tx + load_lanes(laws, 6 * LANES)
            ty = ty + load_lanes(laws, 7 * LANES)
            tz = tz + load_lanes(laws, 8 * LANES)
        fx, fy, fz = turned(R1, share_1 * tx, share_1 * ty, share_1 * tz)
        m1, m2, m3 = cross(g[0], g[1], g[2], fx, fy, fz)
        n1, n2, n3 = spread(0.0), spread(0.0), spread(0.0)
        if both_ends:
            d, rate = in_axes_of(R2, W2, g, w)
            sx, sy, sz = turned(
                R2,
                share_2 * (fx_0 + kx * d[0] + cx * rate[0]),
                share_2 * (fy_0 + ky * d[1] + cy * rate[1]),
                share_2 * (fz_0 + kz * d[2] + cz * rate[2]),
            )
            n1, n2, n3 = cross(g[0], g[1], g[2], sx, sy, sz)
            fx, fy, fz = fx + sx, fy + sy, fz + sz
        if rotates:
            x, y, z = rotation_moment(R1, R2, W1, W2, k1, k2, k3, c1, c2, c3)
            m1, m2, m3 = m1 + x, m2 + y, m3 + z
            n1, n2, n3 = n1 - x, n2 - y, n3 - z
        x, y, z = cross(a[0], a[1], a[2], fx, fy, fz)
        m1, m2, m3 = m1 + x, m2 + y, m3 + z
        x, y, z = cross(b[0], b[1], b[2], fx, fy, fz)
        add_to_pairs(
            pose,
            one,
            two,
            PUSH,
            (zero, zero, fx, fy, fz, m1, m2, m3),
            (zero, zero, -fx, -fy, -fz, n1 - x, n2 - y, n3 - z),
            n,
        )


@compiled(python=False)
def load_component(table, first, last, at, k):
    """Component `k` of a load at `at`: linear between its rows, constant beyond them."""
    if at <= table[first, 0]:
        return table[first, k]
    i = first
    while i < last - 1 and at > table[i + 1, 0]:
        i += 1
    if i == last - 1:
        return table[i, k]
    share = (at - table[i, 0]) / (table[i + 1, 0] - table[i, 0])
    return table[i, k] + share * (table[i + 1, k] - table[i, k])


@compiled(merge=True)
def load_forces(loads, time, s, frame_offset, bodies, frames, pose):
    """Add the given forces and torques at `time` and `s` to the bodies' rows in `pose`."""
    for e in range(loads.body.shape[0]):
        b = loads.body[e]
        first, last = loads.start[e], loads.start[e + 1]
        f = bodies.frame[b]
        at = s + frame_offset[f] if loads.flags[e, 2] else time
        c1 = load_component(loads.table, first, last, at, 1)
        c2 = load_component(loads.table, first, last, at, 2)
        c3 = load_component(loads.table, first, last, at, 3)
        in_track = loads.flags[e, 1]
        x, y, z = 0.0, 0.0, 0.0
        for k in range(3):
            a1 = frames[f, 3 + k * 3] if in_track else pose[b, 3 * k]
            a2 = frames[f, 4 + k * 3] if in_track else pose[b, 3 * k + 1]
            a3 = frames[f, 5 + k * 3] if in_track else pose[b, 3 * k + 2]
            value = a1 * c1 + a2 * c2 + a3 * c3
            if k == 0:
                x = value
            elif k == 1:
                y = value
            else:
                z = value
        if loads.flags[e, 0]:
            pose[b, FORCE + 3] += x
            pose[b, FORCE + 4] += y
            pose[b, FORCE + 5] += z
            continue
        p1, p2, p3 = loads.point[e, 0], loads.point[e, 1], loads.point[e, 2]
        lx = pose[b, 0] * p1 + pose[b, 1] * p2 + pose[b, 2] * p3
        ly = pose[b, 3] * p1 + pose[b, 4] * p2 + pose[b, 5] * p3
        lz = pose[b, 6] * p1 + pose[b, 7] * p2 + pose[b, 8] * p3
        pose[b, FORCE] += x
        pose[b, FORCE + 1] += y
        pose[b, FORCE + 2] += z
        pose[b, FORCE + 3] += ly * z - lz * y
        pose[b, FORCE + 4] += lz * x - lx * z
        pose[b, FORCE + 5] += lx * y - ly * x
