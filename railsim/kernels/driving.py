"""Effects of the speed of travel: traction, the held reference body, fixed bodies."""

from railsim.kernels import compiled
from railsim.kernels.rotation import sine_cosine
from railsim.kernels.state import ARC_LENGTH, SPEED, TIME, velocity_begin
from railsim.kernels.system import (
    AXLEBOX,
    BRAKES,
    FORCE,
    FREE,
    MOMENT,
    OVER_DISTANCE,
    RADIUS,
    SLIP_BEGIN,
    SLIP_END,
    TABLE,
    Y_0,
    Z_0,
)
from railsim.kernels.track_frame import OMEGA, OMEGA_S

# speed of the wheel's circumference below which a brake's torque decreases linearly to 0 (m/s)
FULL_BRAKE_SPEED = 0.1
# that speed over the vehicle's, at most: no wheel that rolls loses its brake before the standstill
ROLLING_SHARE = 0.5


@compiled(python=False)
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


@compiled(python=False)
def add_traction(system, work, speed):
    """Traction less running resistance of a free-running vehicle, on the reference body."""
    drive, bodies, frames, pose = system.drive, system.bodies, work.frames, work.pose
    force, _ = table_value_slope(drive.table, speed)
    force -= drive.resistance[0] + speed * (drive.resistance[1] + speed * drive.resistance[2])
    b = bodies.reference
    f = bodies.frame[b]
    for k in range(3):
        pose[b, FORCE + k] += force * frames[f, 3 + 3 * k]


@compiled(python=False)
def braking_share(rim, speed):
    """Share of a brake's torque against a tread that turns with `rim` [m/s], in its sense."""
    return min(1.0, max(-1.0, rim / min(FULL_BRAKE_SPEED, ROLLING_SHARE * speed)))


@compiled(python=False)
def axle_torque(drives, e, frame_offset, bodies, state):
    """Torque of one drive or brake on its wheelset, forwards positive [N m]."""
    time, s, speed = state[TIME], state[ARC_LENGTH], state[SPEED]
    w = drives.body[e, 1]
    first, demand, end = drives.start[2 * e], drives.start[2 * e + 1], drives.start[2 * e + 2]
    torque, _ = table_value_slope(drives.table[first:demand], speed)
    if end > demand:
        over_distance = drives.row[e, OVER_DISTANCE] > 0.0
        x = s + frame_offset[bodies.frame[w]] if over_distance else time
        factor, _ = table_value_slope(drives.table[demand:end], x)
        torque *= factor
    # forwards it turns about the negative y axis
    rolling = -state[velocity_begin(bodies.kind.shape[0]) + 6 * w + 4] * bodies.row[w, RADIUS]
    if drives.row[e, BRAKES] > 0.0:
        torque = -torque
    if torque < 0.0:
        torque *= braking_share(rolling, speed)
    if drives.row[e, SLIP_END] > 0.0:
        slip_begin, slip_end = drives.row[e, SLIP_BEGIN], drives.row[e, SLIP_END]
        slip = (rolling - speed) / speed if torque > 0.0 else (speed - rolling) / speed
        torque *= min(1.0, max(0.0, (slip_end - slip) / (slip_end - slip_begin)))
    return torque


@compiled(python=False)
def add_axle_torques(system, work, state):
    """Driving and braking torques on wheelsets, their reactions on the bodies that carry them."""
    drives, pose = system.drives, work.pose
    for e in range(drives.body.shape[0]):
        b, w = drives.body[e, 0], drives.body[e, 1]
        torque = axle_torque(drives, e, system.frame_offset, system.bodies, state)
        for k in range(3):
            moment = torque * pose[w, 3 * k + 1]
            pose[w, MOMENT + k] -= moment
            pose[b, MOMENT + k] += moment


@compiled(in_loop=False)
def write_axle_torques(drives, frame_offset, bodies, states, torque):
    """Torques of drives and brakes in recorded states, summed over those of a wheelset.

    Parameters
    ----------
    drives, frame_offset, bodies
        Of the system, see `railsim.kernels.system`.
    states : float64[time, n_state]
    torque : float64[time, body]
        Forwards positive [N m] (output).
    """
    for i in range(states.shape[0]):
        torque[i] = 0.0
        for e in range(drives.body.shape[0]):
            torque[i, drives.body[e, 1]] += axle_torque(drives, e, frame_offset, bodies, states[i])


@compiled(python=False)
def speed_change(system, work, state, derivative):
    """V' as prescribed, or as it follows from the forces in free running [m/s2]."""
    drive, bodies, frames = system.drive, system.bodies, work.frames
    if drive.mode == TABLE:
        # V(s) gives V' = V dV/ds
        _, slope = table_value_slope(drive.table, state[ARC_LENGTH])
        return state[SPEED] * slope
    if drive.mode == FREE:
        b = bodies.reference
        f = bodies.frame[b]
        y = state[6 * b + 1] + bodies.row[b, Y_0]
        z = state[6 * b + 2] + bodies.row[b, Z_0]
        return derivative[velocity_begin(bodies.kind.shape[0]) + 6 * b] / (
            1.0 + frames[f, OMEGA + 1] * z - frames[f, OMEGA + 2] * y
        )
    return 0.0


@compiled(python=False)
def apply_speed_change(system, work, state, rate, derivative):
    """Subtract V' (e_x + omega x r) from the relative accelerations of all bodies."""
    bodies, frames = system.bodies, work.frames
    n = bodies.kind.shape[0]
    for b in range(n):
        if bodies.kind[b] == AXLEBOX:
            continue
        f = bodies.frame[b]
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        x = state[6 * b]
        y = state[6 * b + 1] + bodies.row[b, Y_0]
        z = state[6 * b + 2] + bodies.row[b, Z_0]
        v = velocity_begin(n) + 6 * b
        derivative[v] -= rate * (1.0 + w2 * z - w3 * y)
        derivative[v + 1] -= rate * (w3 * x - w1 * z)
        derivative[v + 2] -= rate * (w1 * y - w2 * x)


@compiled(python=False)
def hold_reference(bodies, work, derivative):
    """Keep the reference body's x; the force that holds it is part of its acceleration."""
    b = bodies.reference
    index = velocity_begin(bodies.kind.shape[0]) + 6 * b
    for i in range(3):
        work.acceleration[b, i] -= derivative[index] * work.relative[b, i]
    derivative[6 * b] = 0.0
    derivative[index] = 0.0


@compiled(python=False)
def turn_fixed(bodies, frames, state):
    """Rotate fixed bodies with their track frames: u = C^T w_F, r' = 0."""
    speed = state[SPEED]
    n = bodies.kind.shape[0]
    for k in range(bodies.fixed.shape[0]):
        b = bodies.fixed[k]
        f = bodies.frame[b]
        sr, cr = sine_cosine(state[6 * b + 3])
        sp, cp = sine_cosine(state[6 * b + 4])
        sy, cy = sine_cosine(state[6 * b + 5])
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        # C^T = Ry(-pitch) Rx(-roll) Rz(-yaw)
        w1, w2 = cy * w1 + sy * w2, cy * w2 - sy * w1
        w2, w3 = cr * w2 + sr * w3, cr * w3 - sr * w2
        w1, w3 = cp * w1 - sp * w3, cp * w3 + sp * w1
        v = velocity_begin(n) + 6 * b
        state[v], state[v + 1], state[v + 2] = 0.0, 0.0, 0.0
        state[v + 3], state[v + 4], state[v + 5] = speed * w1, speed * w2, speed * w3


@compiled(python=False)
def hold_fixed(bodies, work, speed, rate, derivative):
    """Hold fixed bodies; the forces that hold them are part of their accelerations.

    u' = C^T (V^2 omega_s + V' omega), `rate` being V'.
    """
    frames, C, acceleration = work.frames, work.relative, work.acceleration
    n = bodies.kind.shape[0]
    for k in range(bodies.fixed.shape[0]):
        b = bodies.fixed[k]
        f, v = bodies.frame[b], velocity_begin(n) + 6 * b
        for i in range(3):
            turn = 0.0
            for j in range(3):
                acceleration[b, i] -= derivative[v + j] * C[b, 3 * j + i]
                turn += C[b, 3 * j + i] * (
                    speed * speed * frames[f, OMEGA_S + j] + rate * frames[f, OMEGA + j]
                )
            acceleration[b, 3 + i] = turn
        for i in range(6):
            derivative[6 * b + i] = 0.0
            derivative[v + i] = 0.0
