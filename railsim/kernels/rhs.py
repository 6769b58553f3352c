"""The right-hand side: state -> derivative, for bodies in track-following frames.

Each body has its own frame at s_b = s + offset with A(s_b) and rate of turn w_F = V omega; its
position in the frame is r, its attitude C = Rz(yaw) Rx(roll) Ry(pitch), a wheelset's without the
last.  With u the absolute angular velocity in body axes

    r'' = F/m + g - a_0 - w_F x (w_F x r) - dw_F x r - 2 w_F x r'
    a_0 = V^2 (0, omega_3, -omega_2) + V' e_x          dw_F = V^2 omega_s + V' omega
    u'  = I^-1 (M - Om x I u)

where Om is the angular velocity of the axes that I is expressed in: u itself for a rigid body,
C^T w_F + (roll', yaw' sin roll, yaw' cos roll) for a wheelset, so that its spin stays out of C and
the gyroscopic moment is exact.  The reference body's x is held: V' is given, or (free running) it
is what keeps x'' = 0.

Source: standard relative kinematics, e.g. Shabana, Zaazaa, Sugiyama (2008), Railroad Vehicle
Dynamics, chapters 2 and 3; the choice of frames as in docs/theory.
"""

from math import cos, sin

from railsim.kernels import jit
from railsim.kernels.elements import link_forces, mount_forces
from railsim.kernels.status import END_OF_TRACK, RUNNING
from railsim.kernels.system import AXLEBOX, FREE, WHEELSET
from railsim.kernels.track_frame import GRAVITY, OMEGA, OMEGA_S, cell_of, track_frame
from railsim.kernels.wheel_rail import wheel_rail


@jit
def locate_frames(system, work, s):
    """Evaluate all track frames; END_OF_TRACK where one lies outside the table."""
    for f in range(system.frame_offset.shape[0]):
        place = s + system.frame_offset[f]
        work.cell[f] = track_frame(system.track, place, work.frames[f])
        if work.cell[f] < 0:
            return END_OF_TRACK
        _, work.cell_u[f] = cell_of(system.track, place)
    return RUNNING


@jit
def euler_rates(kind, S, w1, w2, w3):
    """Rates of roll, pitch, yaw from the angular velocity relative to the frame, body axes.

    S holds sin, cos of roll and of pitch; a wheelset's axes do not turn with its pitch.
    """
    if kind != WHEELSET:
        w1, w3 = S[3] * w1 + S[2] * w3, S[3] * w3 - S[2] * w1
    yaw_rate = w3 / S[1]
    return w1, w2 - yaw_rate * S[0], yaw_rate


@jit
def body_kinematics(system, work, speed, state, b):
    """Attitude, position and velocities of body `b` in global axes; rates of its Euler angles."""
    bodies = system.bodies
    n = bodies.kind.shape[0]
    frame = work.frames[bodies.frame[b]]
    S, C, R = work.S[b], work.C[b], work.R[b]
    roll, pitch, yaw = state[6 * b + 3], state[6 * b + 4], state[6 * b + 5]
    S[0], S[1] = sin(roll), cos(roll)
    sy, cy = sin(yaw), cos(yaw)
    if bodies.kind[b] == WHEELSET:
        C[0], C[1], C[2] = cy, -sy * S[1], sy * S[0]
        C[3], C[4], C[5] = sy, cy * S[1], -cy * S[0]
        C[6], C[7], C[8] = 0.0, S[0], S[1]
    else:
        S[2], S[3] = sin(pitch), cos(pitch)
        C[0] = cy * S[3] - sy * S[0] * S[2]
        C[1] = -sy * S[1]
        C[2] = cy * S[2] + sy * S[0] * S[3]
        C[3] = sy * S[3] + cy * S[0] * S[2]
        C[4] = cy * S[1]
        C[5] = sy * S[2] - cy * S[0] * S[3]
        C[6] = -S[1] * S[2]
        C[7] = S[0]
        C[8] = S[1] * S[3]
    for i in range(3):
        a1, a2, a3 = frame[3 + 3 * i], frame[4 + 3 * i], frame[5 + 3 * i]
        R[3 * i] = a1 * C[0] + a2 * C[3] + a3 * C[6]
        R[3 * i + 1] = a1 * C[1] + a2 * C[4] + a3 * C[7]
        R[3 * i + 2] = a1 * C[2] + a2 * C[5] + a3 * C[8]

    f1, f2, f3 = speed * frame[OMEGA], speed * frame[OMEGA + 1], speed * frame[OMEGA + 2]
    v = 6 * n + 6 * b
    u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]
    g1 = C[0] * f1 + C[3] * f2 + C[6] * f3
    g2 = C[1] * f1 + C[4] * f2 + C[7] * f3
    g3 = C[2] * f1 + C[5] * f2 + C[8] * f3
    # rates of roll, pitch, yaw are kept in `acceleration` until the accelerations are known
    rates = work.acceleration[b]
    rates[3], rates[4], rates[5] = euler_rates(bodies.kind[b], S, u1 - g1, u2 - g2, u3 - g3)
    if bodies.kind[b] == WHEELSET:
        # elements sit on the axleboxes, which do not spin
        u2 = g2 + rates[5] * S[0]
        rates[4] += speed / bodies.radius[b]
    W = work.W[b]
    W[0] = R[0] * u1 + R[1] * u2 + R[2] * u3
    W[1] = R[3] * u1 + R[4] * u2 + R[5] * u3
    W[2] = R[6] * u1 + R[7] * u2 + R[8] * u3

    x = state[6 * b]
    y = state[6 * b + 1] + bodies.nominal[b, 0]
    z = state[6 * b + 2] + bodies.nominal[b, 1]
    v1 = speed + f2 * z - f3 * y + state[v]
    v2 = f3 * x - f1 * z + state[v + 1]
    v3 = f1 * y - f2 * x + state[v + 2]
    X, vel = work.X[b], work.V[b]
    for i in range(3):
        a1, a2, a3 = frame[3 + 3 * i], frame[4 + 3 * i], frame[5 + 3 * i]
        X[i] = frame[i] + a1 * x + a2 * y + a3 * z
        vel[i] = a1 * v1 + a2 * v2 + a3 * v3


@jit
def axlebox_kinematics(system, work, state, b):
    """Pose of an axlebox: its wheelset's, turned by its own pitch about the axle."""
    n = system.bodies.kind.shape[0]
    p = system.bodies.parent[b]
    s, c = sin(state[6 * b + 4]), cos(state[6 * b + 4])
    rate = state[6 * n + 6 * b + 4]
    work.acceleration[b, 4] = rate
    R, P = work.R[b], work.R[p]
    for i in range(3):
        k = 3 * i
        R[k] = c * P[k] - s * P[k + 2]
        R[k + 1] = P[k + 1]
        R[k + 2] = s * P[k] + c * P[k + 2]
        work.X[b, i] = work.X[p, i]
        work.V[b, i] = work.V[p, i]
        work.W[b, i] = work.W[p, i] + P[k + 1] * rate


@jit
def kinematics(system, work, speed, state):
    """Poses and velocities of all bodies; clears the force accumulators."""
    kind = system.bodies.kind
    for b in range(kind.shape[0]):
        if kind[b] == AXLEBOX:
            axlebox_kinematics(system, work, state, b)
        else:
            body_kinematics(system, work, speed, state, b)
        for i in range(3):
            work.F[b, i] = 0.0
            work.M[b, i] = 0.0


@jit
def axlebox_dynamics(system, work, b, derivative):
    """Pitch acceleration of an axlebox; everything else it hands to its wheelset."""
    n = system.bodies.kind.shape[0]
    p = system.bodies.parent[b]
    P = work.R[p]
    moment = 0.0
    for i in range(3):
        moment += work.M[b, i] * P[3 * i + 1]
    for i in range(3):
        work.F[p, i] += work.F[b, i]
        work.M[p, i] += work.M[b, i] - moment * P[3 * i + 1]
    for k in range(6):
        derivative[6 * b + k] = 0.0
        derivative[6 * n + 6 * b + k] = 0.0
    derivative[6 * b + 4] = work.acceleration[b, 4]
    derivative[6 * n + 6 * b + 4] = moment / system.bodies.inertia[b, 1]
    for k in range(6):
        work.acceleration[b, k] = 0.0
    work.acceleration[b, 4] = derivative[6 * n + 6 * b + 4]


@jit
def body_dynamics(system, work, speed, state, b, derivative):
    """Accelerations of body `b` for V' = 0, and the rates of its coordinates."""
    bodies = system.bodies
    n = bodies.kind.shape[0]
    frame = work.frames[bodies.frame[b]]
    C, R, S, rates = work.C[b], work.R[b], work.S[b], work.acceleration[b]
    v = 6 * n + 6 * b
    for k in range(3):
        derivative[6 * b + k] = state[v + k]
        derivative[6 * b + 3 + k] = rates[3 + k]
    u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]

    # force in track axes, moment in body axes
    F, M = work.F[b], work.M[b]
    f1 = frame[3] * F[0] + frame[6] * F[1] + frame[9] * F[2]
    f2 = frame[4] * F[0] + frame[7] * F[1] + frame[10] * F[2]
    f3 = frame[5] * F[0] + frame[8] * F[1] + frame[11] * F[2]
    m1 = R[0] * M[0] + R[3] * M[1] + R[6] * M[2]
    m2 = R[1] * M[0] + R[4] * M[1] + R[7] * M[2]
    m3 = R[2] * M[0] + R[5] * M[1] + R[8] * M[2]
    o1, o2, o3 = u1, u2, u3
    if bodies.kind[b] == WHEELSET:
        rail = work.rail_force[b]
        f1 += rail[0]
        f2 += rail[1]
        f3 += rail[2]
        m1 += C[0] * rail[3] + C[3] * rail[4] + C[6] * rail[5]
        m2 += C[1] * rail[3] + C[4] * rail[4] + C[7] * rail[5]
        m3 += C[2] * rail[3] + C[5] * rail[4] + C[8] * rail[5]
        # the axes do not spin: take the wheelset's own rotation out again
        o2 = u2 - rates[4] + speed / bodies.radius[b]
    mass = bodies.mass[b]
    g = system.gravity
    a1 = f1 / mass + g * frame[GRAVITY]
    a2 = f2 / mass + g * frame[GRAVITY + 1]
    a3 = f3 / mass + g * frame[GRAVITY + 2]
    i1, i2, i3 = bodies.inertia[b, 0], bodies.inertia[b, 1], bodies.inertia[b, 2]
    h1, h2, h3 = i1 * u1, i2 * u2, i3 * u3
    d1 = (m1 - o2 * h3 + o3 * h2) / i1
    d2 = (m2 - o3 * h1 + o1 * h3) / i2
    d3 = (m3 - o1 * h2 + o2 * h1) / i3
    rates[0] = C[0] * a1 + C[3] * a2 + C[6] * a3
    rates[1] = C[1] * a1 + C[4] * a2 + C[7] * a3
    rates[2] = C[2] * a1 + C[5] * a2 + C[8] * a3
    rates[3], rates[4], rates[5] = d1, d2, d3

    # relative acceleration in the moving frame
    w1, w2, w3 = frame[OMEGA], frame[OMEGA + 1], frame[OMEGA + 2]
    e1, e2, e3 = frame[OMEGA_S], frame[OMEGA_S + 1], frame[OMEGA_S + 2]
    x = state[6 * b]
    y = state[6 * b + 1] + bodies.nominal[b, 0]
    z = state[6 * b + 2] + bodies.nominal[b, 1]
    wr = w1 * x + w2 * y + w3 * z
    ww = w1 * w1 + w2 * w2 + w3 * w3
    v1, v2, v3 = state[v], state[v + 1], state[v + 2]
    square = speed * speed
    derivative[v] = a1 - square * (w1 * wr - ww * x + e2 * z - e3 * y) - 2.0 * speed * (
        w2 * v3 - w3 * v2)
    derivative[v + 1] = a2 - square * (w3 + w2 * wr - ww * y + e3 * x - e1 * z) - 2.0 * speed * (
        w3 * v1 - w1 * v3)
    derivative[v + 2] = a3 - square * (-w2 + w3 * wr - ww * z + e1 * y - e2 * x) - 2.0 * speed * (
        w1 * v2 - w2 * v1)
    derivative[v + 3] = d1
    derivative[v + 4] = d2
    derivative[v + 5] = d3


@jit
def apply_speed_change(system, work, state, driving, speed_rate, derivative):
    """Subtract V' (e_x + omega x r) from all bodies; in free running find V' first.  Return V'."""
    bodies = system.bodies
    n = bodies.kind.shape[0]
    if driving == FREE:
        b = bodies.reference
        frame = work.frames[bodies.frame[b]]
        y = state[6 * b + 1] + bodies.nominal[b, 0]
        z = state[6 * b + 2] + bodies.nominal[b, 1]
        speed_rate = derivative[6 * n + 6 * b] / (
            1.0 + frame[OMEGA + 1] * z - frame[OMEGA + 2] * y)
    if speed_rate != 0.0:
        for b in range(n):
            if bodies.kind[b] == AXLEBOX:
                continue
            frame = work.frames[bodies.frame[b]]
            w1, w2, w3 = frame[OMEGA], frame[OMEGA + 1], frame[OMEGA + 2]
            x = state[6 * b]
            y = state[6 * b + 1] + bodies.nominal[b, 0]
            z = state[6 * b + 2] + bodies.nominal[b, 1]
            v = 6 * n + 6 * b
            derivative[v] -= speed_rate * (1.0 + w2 * z - w3 * y)
            derivative[v + 1] -= speed_rate * (w3 * x - w1 * z)
            derivative[v + 2] -= speed_rate * (w1 * y - w2 * x)
    return speed_rate


@jit
def right_hand_side(system, work, state, driving, speed_rate, derivative):
    """Derivative of the whole state.

    Parameters
    ----------
    system : System;  work : Work
    state, derivative : float64[n_state]
        See `railsim.kernels.system`.
    driving : int
        PRESCRIBED: the speed changes by `speed_rate`; FREE: as the forces have it.
    speed_rate : float
        V' [m/s2], with PRESCRIBED.

    Returns
    -------
    status, wheelset, n_patches : int
    """
    bodies = system.bodies
    n = bodies.kind.shape[0]
    s, speed = state[-2], state[-1]
    status = locate_frames(system, work, s)
    if status != RUNNING:
        return status, 0, 0
    kinematics(system, work, speed, state)
    m = system.maxwell.shape[0]
    force = state[12 * n:12 * n + m]
    link_forces(system.links, system.curves, force, work.maxwell_rate, work)
    mount_forces(system.mounts, system.curves, force, work.maxwell_rate, work)
    status, where, n_patches = wheel_rail(system, work, speed, state)
    if status != RUNNING:
        return status, where, n_patches
    for k in range(n):
        b = n - 1 - k  # axleboxes last in order: they hand their forces down first
        if bodies.kind[b] == AXLEBOX:
            axlebox_dynamics(system, work, b, derivative)
        else:
            body_dynamics(system, work, speed, state, b, derivative)
    derivative[-1] = apply_speed_change(system, work, state, driving, speed_rate, derivative)
    derivative[-2] = speed
    held = 6 * bodies.reference
    derivative[held] = 0.0
    derivative[6 * n + held] = 0.0
    for i in range(m):
        c, k_s = system.maxwell[i, 0], system.maxwell[i, 1]
        derivative[12 * n + i] = k_s * (work.maxwell_rate[i] - force[i] / c)
    return RUNNING, 0, n_patches
