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

Hot path: loops are inside the functions, arrays are indexed directly.  A row view (`R[b]`) costs a
reference count and a call with a whole `System` hundreds of words on the stack; together they made
the right-hand side four times slower.

Source: standard relative kinematics, e.g. Shabana, Zaazaa, Sugiyama (2008), Railroad Vehicle
Dynamics, chapters 2 and 3; the choice of frames as in docs/theory.
"""

from math import cos, sin

from railsim.kernels import jit, jit_internal
from railsim.kernels.elements import link_forces, load_forces, mount_forces
from railsim.kernels.internal import internal_rate
from railsim.kernels.rotation import sine_cosine
from railsim.kernels.status import END_OF_TRACK, RUNNING, STANDSTILL
from railsim.kernels.system import AXLEBOX, FREE, TABLE, WHEELSET
from railsim.kernels.track_frame import GRAVITY, OMEGA, OMEGA_S, heading, track_frame
from railsim.kernels.wheel_rail import wheel_rail

STANDSTILL_SPEED = 0.05  # m/s; creepage is a speed over the vehicle's speed


@jit
def locate_frames(track, offset, origin, s, frames, cell, cell_u):
    """Evaluate all track frames; END_OF_TRACK where one lies outside the table.

    Origins and axes are those of frame `origin`, on the level: elements are stiff, and the
    round-off of coordinates counted from the start of the track would be forces of micronewtons;
    and the angles between the frames are small, which makes their sines cheap.
    """
    turn = heading(track, s + offset[origin])
    for f in range(offset.shape[0]):
        cell[f], cell_u[f] = track_frame(track, s + offset[f], turn, frames, f)
        if cell[f] < 0:
            return END_OF_TRACK
    x, y, z = frames[origin, 0], frames[origin, 1], frames[origin, 2]
    sine, cosine = sin(turn), cos(turn)
    for f in range(offset.shape[0]):
        east, north = frames[f, 0] - x, frames[f, 1] - y
        frames[f, 0] = cosine * east + sine * north
        frames[f, 1] = cosine * north - sine * east
        frames[f, 2] -= z
    return RUNNING


@jit
def euler_rates(kind, sin_roll, cos_roll, sin_pitch, cos_pitch, w1, w2, w3):
    """Rates of roll, pitch, yaw from the angular velocity relative to the frame, body axes.

    A wheelset's axes do not turn with its pitch.
    """
    if kind != WHEELSET:
        w1, w3 = cos_pitch * w1 + sin_pitch * w3, cos_pitch * w3 - sin_pitch * w1
    yaw_rate = w3 / cos_roll
    return w1, w2 - yaw_rate * sin_roll, yaw_rate


@jit_internal
def attitudes(bodies, state, S, C):
    """C = Rz(yaw) Rx(roll) Ry(pitch) of all bodies but axleboxes; a wheelset's without Ry."""
    for b in range(bodies.kind.shape[0]):
        roll, pitch, yaw = state[6 * b + 3], state[6 * b + 4], state[6 * b + 5]
        if bodies.kind[b] == WHEELSET:
            pitch = 0.0
        sr, cr = sine_cosine(roll)
        sp, cp = sine_cosine(pitch)
        sy, cy = sine_cosine(yaw)
        S[b, 0], S[b, 1], S[b, 2], S[b, 3] = sr, cr, sp, cp
        C[b, 0] = cy * cp - sy * sr * sp
        C[b, 1] = -sy * cr
        C[b, 2] = cy * sp + sy * sr * cp
        C[b, 3] = sy * cp + cy * sr * sp
        C[b, 4] = cy * cr
        C[b, 5] = sy * sp - cy * sr * cp
        C[b, 6] = -cr * sp
        C[b, 7] = sr
        C[b, 8] = cr * cp


@jit
def kinematics(bodies, frames, speed, state, S, C, R, X, V, W, rates):
    """Poses and velocities of all bodies in global axes, rates of their coordinates.

    `rates` (columns 3 to 5: roll, pitch, yaw) is the array `Work.acceleration`, which keeps them
    until the accelerations are known.
    """
    n = bodies.kind.shape[0]
    attitudes(bodies, state, S, C)
    for b in range(n):
        if bodies.kind[b] == AXLEBOX:
            axlebox_kinematics(b, bodies.parent[b], n, state, R, X, V, W, rates)
            continue
        f = bodies.frame[b]
        for i in range(3):
            a1, a2, a3 = frames[f, 3 + 3 * i], frames[f, 4 + 3 * i], frames[f, 5 + 3 * i]
            R[b, 3 * i] = a1 * C[b, 0] + a2 * C[b, 3] + a3 * C[b, 6]
            R[b, 3 * i + 1] = a1 * C[b, 1] + a2 * C[b, 4] + a3 * C[b, 7]
            R[b, 3 * i + 2] = a1 * C[b, 2] + a2 * C[b, 5] + a3 * C[b, 8]
        f1 = speed * frames[f, OMEGA]
        f2 = speed * frames[f, OMEGA + 1]
        f3 = speed * frames[f, OMEGA + 2]
        v = 6 * n + 6 * b
        u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]
        g1 = C[b, 0] * f1 + C[b, 3] * f2 + C[b, 6] * f3
        g2 = C[b, 1] * f1 + C[b, 4] * f2 + C[b, 7] * f3
        g3 = C[b, 2] * f1 + C[b, 5] * f2 + C[b, 8] * f3
        r1, r2, r3 = euler_rates(bodies.kind[b], S[b, 0], S[b, 1], S[b, 2], S[b, 3],
                                 u1 - g1, u2 - g2, u3 - g3)
        if bodies.kind[b] == WHEELSET:
            # elements sit on the axleboxes, which do not spin
            u2 = g2 + r3 * S[b, 0]
            r2 += speed / bodies.radius[b]
        rates[b, 3], rates[b, 4], rates[b, 5] = r1, r2, r3
        W[b, 0] = R[b, 0] * u1 + R[b, 1] * u2 + R[b, 2] * u3
        W[b, 1] = R[b, 3] * u1 + R[b, 4] * u2 + R[b, 5] * u3
        W[b, 2] = R[b, 6] * u1 + R[b, 7] * u2 + R[b, 8] * u3
        x = state[6 * b]
        y = state[6 * b + 1] + bodies.nominal[b, 0]
        z = state[6 * b + 2] + bodies.nominal[b, 1]
        v1 = speed + f2 * z - f3 * y + state[v]
        v2 = f3 * x - f1 * z + state[v + 1]
        v3 = f1 * y - f2 * x + state[v + 2]
        for i in range(3):
            a1, a2, a3 = frames[f, 3 + 3 * i], frames[f, 4 + 3 * i], frames[f, 5 + 3 * i]
            X[b, i] = frames[f, i] + a1 * x + a2 * y + a3 * z
            V[b, i] = a1 * v1 + a2 * v2 + a3 * v3


@jit_internal
def axlebox_kinematics(b, p, n, state, R, X, V, W, rates):
    """Pose of axlebox `b`: that of its wheelset `p`, turned by its own pitch about the axle."""
    s, c = sine_cosine(state[6 * b + 4])
    rate = state[6 * n + 6 * b + 4]
    rates[b, 4] = rate
    for i in range(3):
        k = 3 * i
        R[b, k] = c * R[p, k] - s * R[p, k + 2]
        R[b, k + 1] = R[p, k + 1]
        R[b, k + 2] = s * R[p, k] + c * R[p, k + 2]
        X[b, i] = X[p, i]
        V[b, i] = V[p, i]
        W[b, i] = W[p, i] + R[p, k + 1] * rate


@jit_internal
def axlebox_dynamics(b, p, n, inertia, R, F, M, rates, derivative):
    """Pitch acceleration of axlebox `b`; everything else it hands to its wheelset `p`."""
    moment = 0.0
    for i in range(3):
        moment += M[b, i] * R[p, 3 * i + 1]
    for i in range(3):
        F[p, i] += F[b, i]
        M[p, i] += M[b, i] - moment * R[p, 3 * i + 1]
    for k in range(6):
        derivative[6 * b + k] = 0.0
        derivative[6 * n + 6 * b + k] = 0.0
    derivative[6 * b + 4] = rates[b, 4]
    derivative[6 * n + 6 * b + 4] = moment / inertia
    for k in range(6):
        rates[b, k] = 0.0
    rates[b, 4] = moment / inertia


@jit_internal
def dynamics(bodies, frames, speed, gravity, state, C, R, F, M, rail_force, rates, derivative):
    """Accelerations of all bodies for V' = 0, and the rates of their coordinates.

    Leaves the absolute accelerations in body axes in `rates` (`Work.acceleration`).
    """
    n = bodies.kind.shape[0]
    for k in range(n):
        b = n - 1 - k  # axleboxes are last in order: they hand their forces down first
        if bodies.kind[b] == AXLEBOX:
            axlebox_dynamics(b, bodies.parent[b], n, bodies.inertia[b, 1], R, F, M, rates,
                             derivative)
            continue
        f = bodies.frame[b]
        v = 6 * n + 6 * b
        for i in range(3):
            derivative[6 * b + i] = state[v + i]
            derivative[6 * b + 3 + i] = rates[b, 3 + i]
        u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]
        # force in track axes, moment in body axes
        f1 = frames[f, 3] * F[b, 0] + frames[f, 6] * F[b, 1] + frames[f, 9] * F[b, 2]
        f2 = frames[f, 4] * F[b, 0] + frames[f, 7] * F[b, 1] + frames[f, 10] * F[b, 2]
        f3 = frames[f, 5] * F[b, 0] + frames[f, 8] * F[b, 1] + frames[f, 11] * F[b, 2]
        m1 = R[b, 0] * M[b, 0] + R[b, 3] * M[b, 1] + R[b, 6] * M[b, 2]
        m2 = R[b, 1] * M[b, 0] + R[b, 4] * M[b, 1] + R[b, 7] * M[b, 2]
        m3 = R[b, 2] * M[b, 0] + R[b, 5] * M[b, 1] + R[b, 8] * M[b, 2]
        o2 = u2
        if bodies.kind[b] == WHEELSET:
            f1 += rail_force[b, 0]
            f2 += rail_force[b, 1]
            f3 += rail_force[b, 2]
            q1, q2, q3 = rail_force[b, 3], rail_force[b, 4], rail_force[b, 5]
            m1 += C[b, 0] * q1 + C[b, 3] * q2 + C[b, 6] * q3
            m2 += C[b, 1] * q1 + C[b, 4] * q2 + C[b, 7] * q3
            m3 += C[b, 2] * q1 + C[b, 5] * q2 + C[b, 8] * q3
            # the axes do not spin: take the wheelset's own rotation out again
            o2 = u2 - rates[b, 4] + speed / bodies.radius[b]
        mass = bodies.mass[b]
        a1 = f1 / mass + gravity * frames[f, GRAVITY]
        a2 = f2 / mass + gravity * frames[f, GRAVITY + 1]
        a3 = f3 / mass + gravity * frames[f, GRAVITY + 2]
        i1, i2, i3 = bodies.inertia[b, 0], bodies.inertia[b, 1], bodies.inertia[b, 2]
        h1, h2, h3 = i1 * u1, i2 * u2, i3 * u3
        d1 = (m1 - o2 * h3 + u3 * h2) / i1
        d2 = (m2 - u3 * h1 + u1 * h3) / i2
        d3 = (m3 - u1 * h2 + o2 * h1) / i3
        rates[b, 0] = C[b, 0] * a1 + C[b, 3] * a2 + C[b, 6] * a3
        rates[b, 1] = C[b, 1] * a1 + C[b, 4] * a2 + C[b, 7] * a3
        rates[b, 2] = C[b, 2] * a1 + C[b, 5] * a2 + C[b, 8] * a3
        rates[b, 3], rates[b, 4], rates[b, 5] = d1, d2, d3

        # relative acceleration in the moving frame
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        e1, e2, e3 = frames[f, OMEGA_S], frames[f, OMEGA_S + 1], frames[f, OMEGA_S + 2]
        x = state[6 * b]
        y = state[6 * b + 1] + bodies.nominal[b, 0]
        z = state[6 * b + 2] + bodies.nominal[b, 1]
        wr = w1 * x + w2 * y + w3 * z
        ww = w1 * w1 + w2 * w2 + w3 * w3
        v1, v2, v3 = state[v], state[v + 1], state[v + 2]
        square, twice = speed * speed, 2.0 * speed
        derivative[v] = (a1 - square * (w1 * wr - ww * x + e2 * z - e3 * y)
                         - twice * (w2 * v3 - w3 * v2))
        derivative[v + 1] = (a2 - square * (w3 + w2 * wr - ww * y + e3 * x - e1 * z)
                             - twice * (w3 * v1 - w1 * v3))
        derivative[v + 2] = (a3 - square * (-w2 + w3 * wr - ww * z + e1 * y - e2 * x)
                             - twice * (w1 * v2 - w2 * v1))
        derivative[v + 3] = d1
        derivative[v + 4] = d2
        derivative[v + 5] = d3


@jit
def table_value_slope(table, x):
    """Value and slope at `x` of a table of rows [x, value]: linear, constant beyond its ends."""
    last = table.shape[0] - 1
    if x < table[0, 0] or last == 0:
        return table[0, 1], 0.0
    if x >= table[last, 0]:
        return table[last, 1], 0.0
    i = 0
    while x >= table[i + 1, 0]:
        i += 1
    slope = (table[i + 1, 1] - table[i, 1]) / (table[i + 1, 0] - table[i, 0])
    return table[i, 1] + slope * (x - table[i, 0]), slope


@jit_internal
def add_traction(drive, bodies, frames, speed, F):
    """Traction less running resistance of a free-running vehicle, on the reference body."""
    force, _ = table_value_slope(drive.table, speed)
    force -= drive.resistance[0] + speed * (drive.resistance[1] + speed * drive.resistance[2])
    b = bodies.references[0]
    f = bodies.frame[b]
    for k in range(3):
        F[b, k] += force * frames[f, 3 + 3 * k]


@jit_internal
def speed_change(drive, bodies, frames, state, derivative):
    """V' as prescribed, or as it follows from the forces in free running [m/s2]."""
    if drive.mode == TABLE:
        # V(s) gives V' = V dV/ds
        _, slope = table_value_slope(drive.table, state[-2])
        return state[-1] * slope
    if drive.mode == FREE:
        b = bodies.references[0]
        f = bodies.frame[b]
        y = state[6 * b + 1] + bodies.nominal[b, 0]
        z = state[6 * b + 2] + bodies.nominal[b, 1]
        return derivative[6 * bodies.kind.shape[0] + 6 * b] / (
            1.0 + frames[f, OMEGA + 1] * z - frames[f, OMEGA + 2] * y)
    return 0.0


@jit_internal
def apply_speed_change(bodies, frames, state, rate, derivative):
    """Subtract V' (e_x + omega x r) from the relative accelerations of all bodies."""
    n = bodies.kind.shape[0]
    for b in range(n):
        if bodies.kind[b] == AXLEBOX:
            continue
        f = bodies.frame[b]
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        x = state[6 * b]
        y = state[6 * b + 1] + bodies.nominal[b, 0]
        z = state[6 * b + 2] + bodies.nominal[b, 1]
        v = 6 * n + 6 * b
        derivative[v] -= rate * (1.0 + w2 * z - w3 * y)
        derivative[v + 1] -= rate * (w3 * x - w1 * z)
        derivative[v + 2] -= rate * (w1 * y - w2 * x)


@jit_internal
def hold_reference(bodies, C, acceleration, derivative):
    """Keep the reference bodies' x; the force that holds one is part of its acceleration."""
    n = bodies.kind.shape[0]
    for k in range(bodies.references.shape[0]):
        b = bodies.references[k]
        held = 6 * n + 6 * b
        for i in range(3):
            acceleration[b, i] -= derivative[held] * C[b, i]
        derivative[6 * b] = 0.0
        derivative[held] = 0.0


@jit
def right_hand_side(system, work, state, derivative):
    """Derivative of the whole state.

    See `mechanics`, which leaves out the internal states of elements.
    """
    status, where, n_patches = mechanics(system, work, state, derivative)
    if status == RUNNING:
        first = 12 * system.bodies.kind.shape[0]
        for i in range(system.internal.kind.shape[0]):
            derivative[first + i] = internal_rate(system.internal, system.curves, i,
                                                  state[first + i], work.drive[i, 0],
                                                  work.drive[i, 1])
    return status, where, n_patches


@jit
def mechanics(system, work, state, derivative):
    """Derivative of coordinates, velocities, place and speed; drives of the internal states.

    Parameters
    ----------
    system : System;  work : Work
    state, derivative : float64[n_state]
        See `railsim.kernels.system`.

    Returns
    -------
    status, wheelset, n_patches : int
    """
    bodies = system.bodies
    n = bodies.kind.shape[0]
    time, s, speed = state[-3], state[-2], state[-1]
    if not speed > STANDSTILL_SPEED:
        return STANDSTILL, 0, 0
    status = locate_frames(system.track, system.frame_offset, bodies.frame[bodies.references[0]],
                           s, work.frames, work.cell, work.cell_u)
    if status != RUNNING:
        return status, 0, 0
    kinematics(bodies, work.frames, speed, state, work.S, work.C, work.R, work.X, work.V, work.W,
               work.acceleration)
    for b in range(n):
        for i in range(3):
            work.F[b, i] = 0.0
            work.M[b, i] = 0.0
    m = system.internal.kind.shape[0]
    inner = state[12 * n:12 * n + m]
    link_forces(system.links, system.curves, inner, work.drive, work.R, work.X, work.V, work.W,
                work.F, work.M)
    mount_forces(system.mounts, system.internal, system.curves, inner, work.drive, work.R, work.X,
                 work.V, work.W, work.F, work.M)
    if system.loads.body.shape[0] > 0:
        load_forces(system.loads, time, bodies, work.frames, work.R, work.F, work.M)
    if system.drive.mode == FREE:
        add_traction(system.drive, bodies, work.frames, speed, work.F)
    status, where, n_patches = wheel_rail(system, work, speed, state)
    if status != RUNNING:
        return status, where, n_patches
    dynamics(bodies, work.frames, speed, system.gravity, state, work.C, work.R, work.F, work.M,
             work.rail_force, work.acceleration, derivative)
    rate = speed_change(system.drive, bodies, work.frames, state, derivative)
    if rate != 0.0:
        apply_speed_change(bodies, work.frames, state, rate, derivative)
    hold_reference(bodies, work.C, work.acceleration, derivative)
    derivative[-3] = 1.0
    derivative[-2] = speed
    derivative[-1] = rate
    return RUNNING, 0, n_patches
