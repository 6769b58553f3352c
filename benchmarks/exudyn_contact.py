"""Wheel-rail contact, bump stops and drive of the Exudyn coach: one compiled function.

Exudyn's axes are X = x, Y = -z, Z = y of railsim's, so that a wheelset's spin about its axle is the
last of the rotations Rx Ry Rz and the parametrisation stays regular.  The function takes the
absolute coordinates of the seven bodies, finds where they are in their track frames, calls
railsim's compiled contact, and gives generalised forces back.
"""

from math import asin, atan2, cos, sin

import numba
import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rhs import locate_frames, set_kinematics
from railsim.kernels.status import RUNNING
from railsim.kernels.system import Y_0, Z_0
from railsim.kernels.track_frame import OMEGA
from railsim.kernels.wheel_rail import set_wheel_rail_forces

HOLD_STIFFNESS, HOLD_DAMPING = 1e7, 1e6  # N/m, N s/m: keeps the car body at V t
OUTPUT = 0.005  # s


@compiled
def contact(system, work, speed, state):
    """`wheel_rail` as a function to call from code that numba compiles in its usual way.

    `wheel_rail` is put into its caller, and with it views of arrays that railsim's kernels do not
    count.  A caller that counts references would free them, and the arrays behind them, in use.
    """
    return set_wheel_rail_forces(system, work, speed, state)


@compiled
def poses(system, work, state):
    """`kinematics` likewise."""
    set_kinematics(system, work, state)


@numba.njit(cache=True)
def to_rail(x, y, z):
    """Exudyn's axes to railsim's."""
    return x, z, -y


@numba.njit(cache=True)
def rotation(q, A, G):
    """A = Rx Ry Rz and the columns of its angular velocity over the rates of the angles."""
    s1, c1 = sin(q[3]), cos(q[3])
    s2, c2 = sin(q[4]), cos(q[4])
    s3, c3 = sin(q[5]), cos(q[5])
    A[0, 0], A[0, 1], A[0, 2] = c2 * c3, -c2 * s3, s2
    A[1, 0] = c1 * s3 + s1 * s2 * c3
    A[1, 1] = c1 * c3 - s1 * s2 * s3
    A[1, 2] = -s1 * c2
    A[2, 0] = s1 * s3 - c1 * s2 * c3
    A[2, 1] = s1 * c3 + c1 * s2 * s3
    A[2, 2] = c1 * c2
    G[0, 0], G[1, 0], G[2, 0] = 1.0, 0.0, 0.0
    G[0, 1], G[1, 1], G[2, 1] = 0.0, c1, s1
    G[0, 2], G[1, 2], G[2, 2] = A[0, 2], A[1, 2], A[2, 2]


@numba.njit(cache=True)
def add_force(forces, b, G, arm, F, M):
    """Force F at `arm` from the centre, and moment M, all in Exudyn's global axes."""
    m0 = M[0] + arm[1] * F[2] - arm[2] * F[1]
    m1 = M[1] + arm[2] * F[0] - arm[0] * F[2]
    m2 = M[2] + arm[0] * F[1] - arm[1] * F[0]
    for k in range(3):
        forces[6 * b + k] += F[k]
        forces[6 * b + 3 + k] += G[b, 0, k] * m0 + G[b, 1, k] * m1 + G[b, 2, k] * m2


@numba.njit(cache=True)
def forces_of(model, stops, reference, t, q, q_t, forces, scratch, records):
    """Generalised forces on all bodies; a record every `OUTPUT`."""
    system, work = model
    bodies = system.bodies
    state, A, G, vector = scratch
    n = bodies.kind.shape[0]
    speed = state[-1]
    s = speed * t
    for k in range(forces.shape[0]):
        forces[k] = 0.0
    if (
        locate_frames(system.track, system.frame_offset, -1, s, work.frames, work.cell, work.cell_u)
        != RUNNING
    ):
        return -1
    angles = np.empty(6)
    for b in range(n):
        for k in range(6):
            angles[k] = q[6 * b + k] + reference[6 * b + k]
        rotation(angles, A[b], G[b])
        f = bodies.frame[b]
        frame = work.frames[f]
        X = to_rail(angles[0], angles[1], angles[2])
        V = to_rail(q_t[6 * b], q_t[6 * b + 1], q_t[6 * b + 2])
        w = np.zeros(3)
        for i in range(3):
            for k in range(3):
                w[i] += G[b, i, k] * q_t[6 * b + 3 + k]
        W = to_rail(w[0], w[1], w[2])
        # the body's y axis is Exudyn's local z axis
        axle = to_rail(A[b, 0, 2], A[b, 1, 2], A[b, 2, 2])
        r, v, u, e = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
        for i in range(3):
            for k in range(3):
                a = frame[3 + 3 * k + i]
                r[i] += a * (X[k] - frame[k])
                v[i] += a * V[k]
                u[i] += a * W[k]
                e[i] += a * axle[k]
        w1, w2, w3 = speed * frame[OMEGA], speed * frame[OMEGA + 1], speed * frame[OMEGA + 2]
        roll, yaw = asin(e[2]), atan2(-e[0], e[1])
        state[6 * b] = r[0]
        state[6 * b + 1] = r[1] - bodies.row[b, Y_0]
        state[6 * b + 2] = r[2] - bodies.row[b, Z_0]
        state[6 * b + 3] = roll
        state[6 * b + 4] = 0.0
        state[6 * b + 5] = yaw
        j = 6 * n + 6 * b
        state[j] = v[0] - speed - (w2 * r[2] - w3 * r[1])
        state[j + 1] = v[1] - (w3 * r[0] - w1 * r[2])
        state[j + 2] = v[2] - (w1 * r[1] - w2 * r[0])
        sr, cr, sy, cy = sin(roll), cos(roll), sin(yaw), cos(yaw)
        state[j + 3] = cy * u[0] + sy * u[1]
        state[j + 4] = -sy * cr * u[0] + cy * cr * u[1] + sr * u[2]
        state[j + 5] = sy * sr * u[0] - cy * sr * u[1] + cr * u[2]
    poses(system, work, state)
    status, _, _ = contact(system, work, speed, state)
    if status != RUNNING:
        return status
    for c in range(system.contact.body.shape[0]):
        b = system.contact.body[c]
        put_on(forces, b, work.frames[bodies.frame[b]], G, vector, work.rail_force[b])
    b = bodies.reference
    vector[0, :] = 0.0
    hold = np.zeros(6)
    hold[0] = -HOLD_STIFFNESS * state[6 * b] - HOLD_DAMPING * state[6 * n + 6 * b]
    put_on(forces, b, work.frames[bodies.frame[b]], G, vector, hold)
    for k in range(stops.body.shape[0]):
        bump_stop(forces, stops, k, A, G, q, reference, vector)
    row = int(records.count[0])
    if row < records.wheel.shape[0] and t >= OUTPUT * row - 1e-9:
        for c in range(system.contact.body.shape[0]):
            b = system.contact.body[c]
            for side in range(2):
                records.wheel[row, c, side, 0] = work.wheel[c, side, W_Q]
                records.wheel[row, c, side, 1] = work.wheel[c, side, W_Y]
            records.yaw[row, c] = state[6 * b + 5]
        records.count[0] += 1
    return RUNNING


@numba.njit(cache=True)
def put_on(forces, b, frame, G, vector, given):
    """Force and moment about the centre in track axes onto body `b`."""
    for half in range(2):
        x = y = z = 0.0
        for k in range(3):
            x += frame[3 + k] * given[3 * half + k]
            y += frame[6 + k] * given[3 * half + k]
            z += frame[9 + k] * given[3 * half + k]
        vector[half + 1, 0], vector[half + 1, 1], vector[half + 1, 2] = x, -z, y
    vector[0, :] = 0.0
    add_force(forces, b, G, vector[0], vector[1], vector[2])


@numba.njit(cache=True)
def bump_stop(forces, stops, k, A, G, q, reference, vector):
    """Lateral stop between bogie frame and car body, odd table over the way along the frame's y."""
    first, second = stops.body[k, 0], stops.body[k, 1]
    arms = np.zeros((2, 3))
    way = 0.0
    for i in range(3):
        for end in range(2):
            b = stops.body[k, end]
            for j in range(3):
                arms[end, i] += A[b, i, j] * stops.point[k, end, j]
        gap = (
            q[6 * second + i]
            + reference[6 * second + i]
            + arms[1, i]
            - q[6 * first + i]
            - reference[6 * first + i]
            - arms[0, i]
        )
        way += A[first, i, 2] * gap
    x = abs(way)
    last = stops.table.shape[0] - 2
    i = 0
    while i < last and x > stops.table[i + 1, 0]:
        i += 1
    slope = (stops.table[i + 1, 1] - stops.table[i, 1]) / (
        stops.table[i + 1, 0] - stops.table[i, 0]
    )
    force = stops.table[i, 1] + slope * (x - stops.table[i, 0])
    if way < 0.0:
        force = -force
    vector[2, :] = 0.0
    for i in range(3):
        vector[1, i] = force * A[first, i, 2]
    add_force(forces, first, G, arms[0], vector[1], vector[2])
    vector[1, :] = -vector[1, :]
    add_force(forces, second, G, arms[1], vector[1], vector[2])
