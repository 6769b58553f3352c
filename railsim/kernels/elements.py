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

from railsim.kernels import jit_inline, jit_internal
from railsim.kernels.internal import AIR, PAD, curve_value


@jit_inline
def push_pair(F, M, i, j, ax, ay, az, bx, by, bz, fx, fy, fz):
    """Put a force on body `i` at the arm a from its centre, the opposite on body `j` at b."""
    F[i, 0] += fx
    F[i, 1] += fy
    F[i, 2] += fz
    M[i, 0] += ay * fz - az * fy
    M[i, 1] += az * fx - ax * fz
    M[i, 2] += ax * fy - ay * fx
    F[j, 0] -= fx
    F[j, 1] -= fy
    F[j, 2] -= fz
    M[j, 0] -= by * fz - bz * fy
    M[j, 1] -= bz * fx - bx * fz
    M[j, 2] -= bx * fy - by * fx


@jit_internal
def link_forces(links, curves, inner, drive, R, X, V, W, F, M):
    """Add the forces of all point-to-point elements to `F`, `M`."""
    for e in range(links.body.shape[0]):
        i, j = links.body[e, 0], links.body[e, 1]
        px, py, pz = links.point[e, 0, 0], links.point[e, 0, 1], links.point[e, 0, 2]
        ax = R[i, 0] * px + R[i, 1] * py + R[i, 2] * pz
        ay = R[i, 3] * px + R[i, 4] * py + R[i, 5] * pz
        az = R[i, 6] * px + R[i, 7] * py + R[i, 8] * pz
        px, py, pz = links.point[e, 1, 0], links.point[e, 1, 1], links.point[e, 1, 2]
        bx = R[j, 0] * px + R[j, 1] * py + R[j, 2] * pz
        by = R[j, 3] * px + R[j, 4] * py + R[j, 5] * pz
        bz = R[j, 6] * px + R[j, 7] * py + R[j, 8] * pz
        dx = X[j, 0] + bx - X[i, 0] - ax
        dy = X[j, 1] + by - X[i, 1] - ay
        dz = X[j, 2] + bz - X[i, 2] - az
        length = sqrt(dx * dx + dy * dy + dz * dz)
        nx, ny, nz = dx / length, dy / length, dz / length
        rate = (
            nx * (V[j, 0] + W[j, 1] * bz - W[j, 2] * by - V[i, 0] - W[i, 1] * az + W[i, 2] * ay)
            + ny * (V[j, 1] + W[j, 2] * bx - W[j, 0] * bz - V[i, 1] - W[i, 2] * ax + W[i, 0] * az)
            + nz * (V[j, 2] + W[j, 0] * by - W[j, 1] * bx - V[i, 2] - W[i, 0] * ay + W[i, 1] * ax)
        )
        elongation = length - links.length[e]
        force = (links.spring[e, 2] + links.spring[e, 0] * elongation + links.spring[e, 1] * rate)
        m = links.internal[e]
        if m >= 0:
            force += inner[m]
            drive[m, 0] = rate
        if links.curve[e, 0] >= 0:
            force += curve_value(curves, links.curve[e, 0], elongation)
        if links.curve[e, 1] >= 0:
            force += curve_value(curves, links.curve[e, 1], rate)
        fx, fy, fz = force * nx, force * ny, force * nz
        push_pair(F, M, i, j, ax, ay, az, bx, by, bz, fx, fy, fz)


@jit_inline
def axis_force(mounts, internal, curves, e, k, d, rate, normal, inner, drive):
    """Force along axis `k` of mount `e` at deflection `d` and its rate; `normal` loads a pad."""
    force = mounts.preload[e, k] + mounts.stiffness[e, k] * d + mounts.damping[e, k] * rate
    if mounts.curve[e, k] >= 0:
        force += curve_value(curves, mounts.curve[e, k], d)
    m = mounts.internal[e, k]
    if m >= 0:
        if internal.kind[m] == PAD:
            limit = mounts.friction[e, k, 0] + mounts.friction[e, k, 1] * abs(normal)
            drive[m, 0], drive[m, 1] = rate, limit
            force += min(limit, max(-limit, inner[m]))
        elif internal.kind[m] == AIR:
            drive[m, 0] = d
            force += internal.parameter[m, 0] * (d - inner[m])
        else:
            drive[m, 0] = rate
            force += inner[m]
    return force


@jit_inline
def translation_force(mounts, internal, curves, e, i, j, inner, drive, R, X, V, W, F, M):
    """Force of a mount in the axes of body `i`, of a shear spring half of it in those of `j`.

    With the gap g = P_j - P_i and its global rate w, the deflection in a body's axes is R^T g, its
    rate R^T (w - omega x g), and the gradient of the potential puts the moment g x f on the body
    whose axes they are, besides the forces +-f at the points.
    """
    px, py, pz = mounts.point[e, 0, 0], mounts.point[e, 0, 1], mounts.point[e, 0, 2]
    ax = R[i, 0] * px + R[i, 1] * py + R[i, 2] * pz
    ay = R[i, 3] * px + R[i, 4] * py + R[i, 5] * pz
    az = R[i, 6] * px + R[i, 7] * py + R[i, 8] * pz
    px, py, pz = mounts.point[e, 1, 0], mounts.point[e, 1, 1], mounts.point[e, 1, 2]
    bx = R[j, 0] * px + R[j, 1] * py + R[j, 2] * pz
    by = R[j, 3] * px + R[j, 4] * py + R[j, 5] * pz
    bz = R[j, 6] * px + R[j, 7] * py + R[j, 8] * pz
    gx = X[j, 0] - X[i, 0] + bx - ax
    gy = X[j, 1] - X[i, 1] + by - ay
    gz = X[j, 2] - X[i, 2] + bz - az
    wx = V[j, 0] + W[j, 1] * bz - W[j, 2] * by - V[i, 0] - W[i, 1] * az + W[i, 2] * ay
    wy = V[j, 1] + W[j, 2] * bx - W[j, 0] * bz - V[i, 1] - W[i, 2] * ax + W[i, 0] * az
    wz = V[j, 2] + W[j, 0] * by - W[j, 1] * bx - V[i, 2] - W[i, 0] * ay + W[i, 1] * ax
    sx, sy, sz = 0.0, 0.0, 0.0
    ends = 1 + mounts.flags[e, 1]
    share = 1.0 / ends
    for end in range(ends):
        c = j if end else i
        vx = wx - W[c, 1] * gz + W[c, 2] * gy
        vy = wy - W[c, 2] * gx + W[c, 0] * gz
        vz = wz - W[c, 0] * gy + W[c, 1] * gx
        dx = R[c, 0] * gx + R[c, 3] * gy + R[c, 6] * gz
        dy = R[c, 1] * gx + R[c, 4] * gy + R[c, 7] * gz
        dz = R[c, 2] * gx + R[c, 5] * gy + R[c, 8] * gz
        rx = R[c, 0] * vx + R[c, 3] * vy + R[c, 6] * vz
        ry = R[c, 1] * vx + R[c, 4] * vy + R[c, 7] * vz
        rz = R[c, 2] * vx + R[c, 5] * vy + R[c, 8] * vz
        if mounts.flags[e, 4]:
            normal = 0.0
            if mounts.flags[e, 3]:
                normal = mounts.preload[e, 2] + mounts.stiffness[e, 2] * dz
            tx = axis_force(mounts, internal, curves, e, 0, dx, rx, normal, inner, drive)
            ty = axis_force(mounts, internal, curves, e, 1, dy, ry, normal, inner, drive)
            tz = axis_force(mounts, internal, curves, e, 2, dz, rz, normal, inner, drive)
        else:
            tx = mounts.preload[e, 0] + mounts.stiffness[e, 0] * dx + mounts.damping[e, 0] * rx
            ty = mounts.preload[e, 1] + mounts.stiffness[e, 1] * dy + mounts.damping[e, 1] * ry
            tz = mounts.preload[e, 2] + mounts.stiffness[e, 2] * dz + mounts.damping[e, 2] * rz
        fx = share * (R[c, 0] * tx + R[c, 1] * ty + R[c, 2] * tz)
        fy = share * (R[c, 3] * tx + R[c, 4] * ty + R[c, 5] * tz)
        fz = share * (R[c, 6] * tx + R[c, 7] * ty + R[c, 8] * tz)
        M[c, 0] += gy * fz - gz * fy
        M[c, 1] += gz * fx - gx * fz
        M[c, 2] += gx * fy - gy * fx
        sx += fx
        sy += fy
        sz += fz
    push_pair(F, M, i, j, ax, ay, az, bx, by, bz, sx, sy, sz)


@jit_inline
def rotation_moment(mounts, e, i, j, R, W, M):
    """Add the moment of the rotational potential tr(K_d (1 - R_1^T R_2)) and its damping."""
    k1, k2, k3 = mounts.rotation[e, 0], mounts.rotation[e, 1], mounts.rotation[e, 2]
    c1 = mounts.rotation_damping[e, 0]
    c2 = mounts.rotation_damping[e, 1]
    c3 = mounts.rotation_damping[e, 2]
    # off-diagonal terms of R_1^T R_2
    r12 = R[i, 0] * R[j, 1] + R[i, 3] * R[j, 4] + R[i, 6] * R[j, 7]
    r13 = R[i, 0] * R[j, 2] + R[i, 3] * R[j, 5] + R[i, 6] * R[j, 8]
    r21 = R[i, 1] * R[j, 0] + R[i, 4] * R[j, 3] + R[i, 7] * R[j, 6]
    r23 = R[i, 1] * R[j, 2] + R[i, 4] * R[j, 5] + R[i, 7] * R[j, 8]
    r31 = R[i, 2] * R[j, 0] + R[i, 5] * R[j, 3] + R[i, 8] * R[j, 6]
    r32 = R[i, 2] * R[j, 1] + R[i, 5] * R[j, 4] + R[i, 8] * R[j, 7]
    wx, wy, wz = W[j, 0] - W[i, 0], W[j, 1] - W[i, 1], W[j, 2] - W[i, 2]
    # moment on body 1, in its axes
    m1 = k2 * r32 - k3 * r23 + c1 * (R[i, 0] * wx + R[i, 3] * wy + R[i, 6] * wz)
    m2 = k3 * r13 - k1 * r31 + c2 * (R[i, 1] * wx + R[i, 4] * wy + R[i, 7] * wz)
    m3 = k1 * r21 - k2 * r12 + c3 * (R[i, 2] * wx + R[i, 5] * wy + R[i, 8] * wz)
    mx = R[i, 0] * m1 + R[i, 1] * m2 + R[i, 2] * m3
    my = R[i, 3] * m1 + R[i, 4] * m2 + R[i, 5] * m3
    mz = R[i, 6] * m1 + R[i, 7] * m2 + R[i, 8] * m3
    M[i, 0] += mx
    M[i, 1] += my
    M[i, 2] += mz
    M[j, 0] -= mx
    M[j, 1] -= my
    M[j, 2] -= mz


@jit_internal
def mount_forces(mounts, internal, curves, inner, drive, R, X, V, W, F, M):
    """Add the forces of all three-axis elements to `F`, `M`."""
    for e in range(mounts.body.shape[0]):
        i, j = mounts.body[e, 0], mounts.body[e, 1]
        if mounts.flags[e, 0]:
            translation_force(mounts, internal, curves, e, i, j, inner, drive, R, X, V, W, F, M)
        if mounts.flags[e, 2]:
            rotation_moment(mounts, e, i, j, R, W, M)


@jit_internal
def load_component(table, first, last, time, k):
    """Component `k` of a load at `time`: linear between its rows, constant beyond them."""
    if time <= table[first, 0]:
        return table[first, k]
    i = first
    while i < last - 1 and time > table[i + 1, 0]:
        i += 1
    if i == last - 1:
        return table[i, k]
    share = (time - table[i, 0]) / (table[i + 1, 0] - table[i, 0])
    return table[i, k] + share * (table[i + 1, k] - table[i, k])


@jit_internal
def load_forces(loads, time, bodies, frames, R, F, M):
    """Add the given forces and torques at `time` to `F`, `M`."""
    for e in range(loads.body.shape[0]):
        b = loads.body[e]
        first, last = loads.start[e], loads.start[e + 1]
        c1 = load_component(loads.table, first, last, time, 1)
        c2 = load_component(loads.table, first, last, time, 2)
        c3 = load_component(loads.table, first, last, time, 3)
        in_track = loads.flags[e, 1]
        f = bodies.frame[b]
        x, y, z = 0.0, 0.0, 0.0
        for k in range(3):
            a1 = frames[f, 3 + k * 3] if in_track else R[b, 3 * k]
            a2 = frames[f, 4 + k * 3] if in_track else R[b, 3 * k + 1]
            a3 = frames[f, 5 + k * 3] if in_track else R[b, 3 * k + 2]
            value = a1 * c1 + a2 * c2 + a3 * c3
            if k == 0:
                x = value
            elif k == 1:
                y = value
            else:
                z = value
        if loads.flags[e, 0]:
            M[b, 0] += x
            M[b, 1] += y
            M[b, 2] += z
            continue
        p1, p2, p3 = loads.point[e, 0], loads.point[e, 1], loads.point[e, 2]
        lx = R[b, 0] * p1 + R[b, 1] * p2 + R[b, 2] * p3
        ly = R[b, 3] * p1 + R[b, 4] * p2 + R[b, 5] * p3
        lz = R[b, 6] * p1 + R[b, 7] * p2 + R[b, 8] * p3
        F[b, 0] += x
        F[b, 1] += y
        F[b, 2] += z
        M[b, 0] += ly * z - lz * y
        M[b, 1] += lz * x - lx * z
        M[b, 2] += lx * y - ly * x
