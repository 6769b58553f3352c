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
is what keeps x'' = 0.  Of a fixed body r' = 0 and u = C^T w_F, whatever the forces on it.

Source: standard relative kinematics, e.g. Shabana, Zaazaa, Sugiyama (2008), Railroad Vehicle
Dynamics, chapters 2 and 3; the choice of frames as in docs/theory.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.actuators import add_actuator_forces
from railsim.kernels.branches import unlikely
from railsim.kernels.driving import (
    add_axle_torques,
    add_traction,
    apply_speed_change,
    hold_fixed,
    hold_reference,
    speed_change,
    turn_fixed,
)
from railsim.kernels.elements import (
    HORIZON,
    STOP_RATE,
    add_link_forces,
    add_load_forces,
    add_mount_forces,
    body_motion,
    update_friction_limits,
)
from railsim.kernels.internal import internal_rate
from railsim.kernels.lanes import (
    LANES,
    add_rows,
    gather,
    gather_from,
    load_rows,
    row_starts,
    splat,
    store_rows,
)
from railsim.kernels.rotation import sine_cosine_lanes
from railsim.kernels.state import (
    ARC_LENGTH,
    SPEED,
    TIME,
    internal_begin,
    smoothed_begin,
    velocity_begin,
)
from railsim.kernels.status import END_OF_TRACK, LAW_NOT_FINITE, RUNNING, STANDSTILL
from railsim.kernels.support import (
    CORRECT_RAILS,
    KEEP_RAILS,
    SKIP,
    allowed_evaluations,
    correct_massless_rates,
    set_support_rates,
    update_factors,
)
from railsim.kernels.support_step import correct_support
from railsim.kernels.system import (
    BODY_SIZE,
    COS_ROLL,
    EVALUATIONS,
    FORCE,
    FORCE_LINE,
    FREE,
    I_2,
    MOMENT,
    POSE_SIZE,
    RAILS_AT,
    RATES_SIZE,
    RELATIVE_SIZE,
    SIN_ROLL,
    UNSETTLED_RAILS,
    Y_0,
    Z_0,
)
from railsim.kernels.track_frame import (
    ATTITUDE,
    FRAME_SIZE,
    OMEGA,
    load_frames,
    set_frames,
    track_cell,
)
from railsim.kernels.vectors import (
    add_at,
    by_axis,
    cross,
    dot,
    minus,
    plus,
    product,
    rotate,
    rotate_back,
    times,
    vector_at,
)
from railsim.kernels.wheel_rail import set_wheel_rail_forces

STANDSTILL_SPEED = 0.05  # m/s; creepage is a speed over the vehicle's speed


@compiled
def locate_frames(track, offset, origin, s, frames, cell, cell_u):
    """Evaluate all track frames; END_OF_TRACK where one lies outside the table.

    Origins and axes are those of frame `origin`, on the level (see `set_frames`): elements are
    stiff, and the round-off of coordinates counted from the start of the track would be forces of
    micronewtons; and the angles between the frames are small, which makes their sines cheap.
    """
    for f in range(offset.shape[0]):
        cell[f], cell_u[f] = track_cell(track, s + offset[f])
        if unlikely(cell[f] < 0):
            return END_OF_TRACK
    set_frames(track, cell, cell_u, origin, frames)
    return RUNNING


@compiled(inline=True)
def euler_rates(sin_roll, cos_roll, sin_pitch, cos_pitch, omega):
    """Rates of roll, pitch, yaw from the angular velocity relative to the frame, body axes.

    A wheelset's axes do not turn with its pitch: 0 and 1 stand for its sine and cosine.
    """
    about_x = cos_pitch * omega[0] + sin_pitch * omega[2]
    yaw_rate = (cos_pitch * omega[2] - sin_pitch * omega[0]) / cos_roll
    return about_x, omega[1] - yaw_rate * sin_roll, yaw_rate


@compiled(inline=True)
def store_motion(pose, offsets, R, X, V, omega):
    """Attitude, position, velocity and angular velocity of eight bodies; no force, no moment."""
    zero = splat(0.0)
    store_rows(pose, offsets, 0, R[:8])
    store_rows(pose, offsets, 8, (R[8], X[0], X[1], X[2], V[0], V[1], V[2], omega[0]))
    store_rows(pose, offsets, 16, (omega[1], omega[2], zero, zero, zero, zero, zero, zero))


@compiled(python=False)
def set_kinematics(system, work, state):
    """Poses and velocities of all bodies in global axes, rates of their coordinates.

    The latter (columns 3 to 5: roll, pitch, yaw) are in `Work.acceleration`, which keeps them
    until the accelerations are known.  Forces and moments in `pose` are set to zero.
    """
    bodies, frames, relative = system.bodies, work.frames, work.relative
    pose, rates, speed = work.pose, work.acceleration, state[SPEED]
    n = bodies.kind.shape[0]
    for first in range(0, bodies.whole.shape[0], LANES):
        b = gather_from(bodies.whole, first)
        x, y, z, roll, pitch, yaw = load_rows(state, row_starts(b, 6), 0, 6)
        _, _, _, _, y_0, z_0, radius, spins = load_rows(bodies.row, row_starts(b, BODY_SIZE), 0, 8)
        sr, cr = sine_cosine_lanes(roll)
        sp, cp = sine_cosine_lanes(pitch * (1.0 - spins))
        sy, cy = sine_cosine_lanes(yaw)
        # C = Rz(yaw) Rx(roll) Ry(pitch)
        C = (
            cy * cp - sy * sr * sp,
            -sy * cr,
            cy * sp + sy * sr * cp,
            sy * cp + cy * sr * sp,
            cy * cr,
            sy * sp - cy * sr * cp,
            -cr * sp,
            sr,
            cr * cp,
        )
        store_rows(relative, row_starts(b, RELATIVE_SIZE), 0, C[:8])
        store_rows(relative, row_starts(b, RELATIVE_SIZE), 8, (C[8], sr, cr, sp, cp))
        origin, A, turn, _ = load_frames(frames, row_starts(gather(bodies.frame, b), FRAME_SIZE))
        R = product(A, C)
        frame_omega = times(speed, turn)
        vx, vy, vz, u1, u2, u3 = load_rows(state, row_starts(b, 6), velocity_begin(n), 6)
        omega_f = rotate_back(C, frame_omega)
        r1, r2, r3 = euler_rates(sr, cr, sp, cp, minus((u1, u2, u3), omega_f))
        # elements sit on the axleboxes, which do not spin
        u2 = u2 + spins * (omega_f[1] + r3 * sr - u2)
        store_rows(rates, row_starts(b, RATES_SIZE), 3, (r1, r2 + spins * (speed / radius), r3))
        r = x, y + y_0, z + z_0
        v = plus((speed + vx, vy, vz), cross(frame_omega, r))
        store_motion(
            pose,
            row_starts(b, POSE_SIZE),
            R,
            plus(origin, rotate(A, r)),
            rotate(A, v),
            rotate(R, (u1, u2, u3)),
        )
    set_axlebox_poses(bodies, work, state)


@compiled(python=False)
def set_axlebox_poses(bodies, work, state):
    """Poses of the axleboxes: those of their wheelsets, turned by their own pitch."""
    pose, rates = work.pose, work.acceleration
    n = bodies.kind.shape[0]
    for first in range(0, bodies.axleboxes.shape[0], LANES):
        b = gather_from(bodies.axleboxes, first)
        carrier = row_starts(gather(bodies.parent, b), POSE_SIZE)
        s, c = sine_cosine_lanes(load_rows(state, row_starts(b, 6), 4, 1)[0])
        rate = load_rows(state, row_starts(b, 6), velocity_begin(n) + 4, 1)[0]
        store_rows(rates, row_starts(b, RATES_SIZE), 4, (rate,))
        R, X, V, omega = body_motion(pose, carrier)
        attitude = (
            c * R[0] - s * R[2],
            R[1],
            s * R[0] + c * R[2],
            c * R[3] - s * R[5],
            R[4],
            s * R[3] + c * R[5],
            c * R[6] - s * R[8],
            R[7],
            s * R[6] + c * R[8],
        )
        omega = plus(omega, times(rate, (R[1], R[4], R[7])))
        store_motion(pose, row_starts(b, POSE_SIZE), attitude, X, V, omega)


@compiled(python=False)
def remove_axle_moments(system, work, state):
    """Take from the moments of elements on a wheelset what would turn it about its axle.

    Elements sit on the axleboxes, which do not spin: of their moment M in the axes C = Rz(yaw)
    Rx(roll) only M_1 about the first axis and M_2 sin roll + M_3 cos roll about the track's normal
    act, and M_2 does no work on the spin.  It is carried by what keeps the axleboxes upright in the
    track frame; so that this does no work along the track either, M_2 times the turn of the frame
    per metre, less that of the axes held to it, goes into a force along the track:
    F_x (1 + (omega x r)_x) = M_2 (omega_2 cos yaw - omega_1 sin yaw)/cos roll, some 0.1 N.
    """
    bodies, frames, C, pose = system.bodies, work.frames, work.relative, work.pose
    for w in range(system.contact.body.shape[0]):
        b = system.contact.body[w]
        f = bodies.frame[b]
        sr, cr = C[b, SIN_ROLL], C[b, COS_ROLL]
        axle = pose[b, 1], pose[b, 4], pose[b, 7]
        m2 = dot(vector_at(pose, b, MOMENT), axle)
        about_normal = m2 * sr / cr
        turn = (C[b, 1] * frames[f, OMEGA] + C[b, 4] * frames[f, OMEGA + 1]) / (cr * cr)
        y = state[6 * b + 1] + bodies.row[b, Y_0]
        z = state[6 * b + 2] + bodies.row[b, Z_0]
        along = m2 * turn / (1.0 + frames[f, OMEGA + 1] * z - frames[f, OMEGA + 2] * y)
        normal = pose[b, 2], pose[b, 5], pose[b, 8]
        track = frames[f, ATTITUDE], frames[f, ATTITUDE + 3], frames[f, ATTITUDE + 6]
        add_at(pose, b, MOMENT, minus(times(about_normal, normal), times(m2, axle)))
        add_at(pose, b, FORCE, times(along, track))


@compiled(python=False)
def set_axlebox_pitch(bodies, work, derivative):
    """Pitch accelerations of the axleboxes; all other forces and moments act on their wheelsets."""
    pose, rates = work.pose, work.acceleration
    n = bodies.kind.shape[0]
    zero = splat(0.0)
    count = bodies.axleboxes.shape[0]
    for first in range(0, count, LANES):
        b = gather_from(bodies.axleboxes, first)
        carrier = row_starts(gather(bodies.parent, b), POSE_SIZE)
        inertia = load_rows(bodies.row, row_starts(b, BODY_SIZE), I_2, 1)[0]
        f1, f2, f3, m1, m2, m3 = load_rows(pose, row_starts(b, POSE_SIZE), FORCE, 6)
        _, r1, _, _, r4, _, _, r7 = load_rows(pose, carrier, 0, 8)
        axle = r1, r4, r7
        moment = dot((m1, m2, m3), axle)
        m1, m2, m3 = minus((m1, m2, m3), times(moment, axle))
        add_rows(pose, carrier, FORCE_LINE, (zero, zero, f1, f2, f3, m1, m2, m3), count - first)
        rate = load_rows(rates, row_starts(b, RATES_SIZE), 4, 1)[0]
        accelerations = zero, zero, zero, zero, moment / inertia, zero
        store_rows(derivative, row_starts(b, 6), 0, (zero, zero, zero, zero, rate, zero))
        store_rows(derivative, row_starts(b, 6), velocity_begin(n), accelerations)
        store_rows(rates, row_starts(b, RATES_SIZE), 0, accelerations)


@compiled(python=False)
def set_accelerations(system, work, state, derivative):
    """Accelerations of all bodies for V' = 0, and the rates of their coordinates.

    Leaves the absolute accelerations in body axes in `Work.acceleration`.
    """
    bodies, frames, relative, pose = system.bodies, work.frames, work.relative, work.pose
    rail_force, rates, speed = work.rail_force, work.acceleration, state[SPEED]
    set_axlebox_pitch(bodies, work, derivative)
    n = bodies.kind.shape[0]
    square, twice = speed * speed, 2.0 * speed
    for first in range(0, bodies.whole.shape[0], LANES):
        b = gather_from(bodies.whole, first)
        mass, i1, i2, i3, y_0, z_0, radius, spins = load_rows(
            bodies.row, row_starts(b, BODY_SIZE), 0, 8
        )
        vx, vy, vz, u1, u2, u3 = load_rows(state, row_starts(b, 6), velocity_begin(n), 6)
        roll_rate, pitch_rate, yaw_rate = load_rows(rates, row_starts(b, RATES_SIZE), 3, 3)
        store_rows(derivative, row_starts(b, 6), 0, (vx, vy, vz, roll_rate, pitch_rate, yaw_rate))
        _, A, omega, omega_s = load_frames(frames, row_starts(gather(bodies.frame, b), FRAME_SIZE))
        C = load_rows(relative, row_starts(b, RELATIVE_SIZE), 0, 8) + load_rows(
            relative, row_starts(b, RELATIVE_SIZE), 8, 1
        )
        fx, fy, fz, mx, my, mz = load_rows(pose, row_starts(b, POSE_SIZE), FORCE, 6)
        px, py, pz, qx, qy, qz = load_rows(rail_force, row_starts(b, RATES_SIZE), 0, 6)
        # force and moment in track axes, moment in body axes
        force = plus(rotate_back(A, (fx, fy, fz)), (px, py, pz))
        m = rotate_back(C, plus(rotate_back(A, (mx, my, mz)), (qx, qy, qz)))
        # gravity points along global z: the third row of A
        a = plus(
            (force[0] / mass, force[1] / mass, force[2] / mass),
            times(system.gravity, (A[6], A[7], A[8])),
        )
        # a wheelset's axes do not spin: take its own rotation out again
        o2 = u2 - spins * (pitch_rate - speed / radius)
        h1, h2, h3 = by_axis((i1, i2, i3), (u1, u2, u3))
        d1 = (m[0] - o2 * h3 + u3 * h2) / i1
        d2 = (m[1] - u3 * h1 + u1 * h3) / i2
        d3 = (m[2] - u1 * h2 + o2 * h1) / i3
        b1, b2, b3 = rotate_back(C, a)
        store_rows(rates, row_starts(b, RATES_SIZE), 0, (b1, b2, b3, d1, d2, d3))
        # relative acceleration in the moving frame
        x, y, z = load_rows(state, row_starts(b, 6), 0, 3)
        r = x, y + y_0, z + z_0
        centripetal = minus(times(dot(omega, r), omega), times(dot(omega, omega), r))
        along = splat(0.0), omega[2], -omega[1]  # omega x e_x, of the frame's own acceleration
        moving = plus(plus(centripetal, along), cross(omega_s, r))
        ax, ay, az = minus(
            minus(a, times(square, moving)), times(twice, cross(omega, (vx, vy, vz)))
        )
        store_rows(derivative, row_starts(b, 6), velocity_begin(n), (ax, ay, az, d1, d2, d3))


def right_hand_side(system, work, state, derivative):
    """Derivative of the whole state.

    See `set_body_rates`, which leaves out the internal states of elements.
    """
    return right_hand_sides(system, work, state[None], derivative[None])


@compiled
def right_hand_sides(system, work, states, derivatives):
    """Derivatives of several states, one a row, as for difference quotients.

    A call from Python unpacks a `System`, which takes longer than an evaluation.  Status,
    wheelset and number of patches are those of the last state, or of the first that is not
    `RUNNING`.
    """
    status, where, n_patches = RUNNING, 0, 0
    for k in range(states.shape[0]):
        status, where, n_patches = set_all_rates(system, work, states[k], derivatives[k])
        if status != RUNNING:
            break
    return status, where, n_patches


@compiled(python=False)
def set_all_rates(system, work, state, derivative):
    """As `right_hand_side`, within compiled code."""
    status, where, n_patches = set_body_rates(system, work, state, derivative, KEEP_RAILS)
    set_internal_rates(system, work, state, derivative)
    set_support_rates(system, work, state, derivative)
    return status, where, n_patches


@compiled(python=False)
def set_internal_rates(system, work, state, derivative):
    """Derivative of the internal states of elements."""
    first = internal_begin(system.bodies.kind.shape[0])
    for i in range(system.internal.kind.shape[0]):
        derivative[first + i] = internal_rate(
            system.internal, system.curves, i, state[first + i], work.drive[i, 0], work.drive[i, 1]
        )


@compiled(inline=True)
def copy_counts(events, support_step, first, to):
    """Copy the counts of patches: of repeated evaluations only the last one counts."""
    for w in range(events.shape[0]):
        if support_step.shape[0] > 0 and support_step[w, SKIP] > 0.0:
            continue
        events[w, to] = events[w, first]
        events[w, to + 1] = events[w, first + 1]


@compiled(python=False)
def set_body_rates(system, work, state, derivative, rail_mode):
    """Derivative of coordinates, velocities, position and speed; drives of the internal states.

    Parameters
    ----------
    system : System;  work : Work
    state, derivative : float64[n_state]
        See `railsim.kernels.state`; the velocities of fixed bodies in `state` are set.
    rail_mode : int
        What becomes of elastic rails in `state`, see `support.KEEP_RAILS`.

    Returns
    -------
    status, wheelset, n_patches : int
    """
    bodies = system.bodies
    n = bodies.kind.shape[0]
    time, s, speed = state[TIME], state[ARC_LENGTH], state[SPEED]
    if unlikely(not speed > STANDSTILL_SPEED):
        return STANDSTILL, 0, 0
    status = locate_frames(
        system.track,
        system.frame_offset,
        bodies.frame[bodies.reference],
        s,
        work.frames,
        work.cell,
        work.cell_u,
    )
    if status != RUNNING:
        return status, 0, 0
    if rail_mode != CORRECT_RAILS:
        work.stepping[RAILS_AT] = np.nan
    if system.support.elastic:
        update_factors(system, work, s)
    if unlikely(bodies.fixed.shape[0] > 0):
        turn_fixed(bodies, work.frames, state)
    set_kinematics(system, work, state)
    m = system.internal.kind.shape[0]
    internals = state[internal_begin(n) : smoothed_begin(n, m)]
    work.laws[HORIZON], work.laws[STOP_RATE] = work.stepping[0], 0.0
    add_link_forces(system, work, internals)
    if unlikely(system.mounts.falling.shape[0] > 0):
        update_friction_limits(system, work)
    add_mount_forces(system, work, internals)
    if unlikely(system.actuators.body.shape[0] > 0):
        where = add_actuator_forces(system, work, state, False)
        if where >= 0:
            return LAW_NOT_FINITE, where, 0
    remove_axle_moments(system, work, state)
    if unlikely(system.loads.body.shape[0] > 0):
        add_load_forces(system, work, time, s)
    if unlikely(system.actuators.body.shape[0] > 0):
        where = add_actuator_forces(system, work, state, True)
        if where >= 0:
            return LAW_NOT_FINITE, where, 0
    if unlikely(system.drives.body.shape[0] > 0):
        add_axle_torques(system, work, state)
    if unlikely(system.drive.mode == FREE):
        add_traction(system, work, speed)
    work.counts[EVALUATIONS] += 1
    remaining = allowed_evaluations(system, state, rail_mode)
    single = remaining == 0
    copy_counts(work.events, work.support_step, 0, 2)
    while True:  # one call only: it becomes part of this function
        status, where, n_patches = set_wheel_rail_forces(system, work, speed, state)
        if single or status != RUNNING:
            break
        if rail_mode == CORRECT_RAILS:
            changed = correct_support(system, work, state, remaining)
        else:
            changed = remaining > 0 and correct_massless_rates(system, work, state)
        if not changed:
            break
        remaining -= 1
        if remaining == 0:
            work.counts[UNSETTLED_RAILS] += 1
        copy_counts(work.events, work.support_step, 2, 0)
    if status != RUNNING:
        return status, where, n_patches
    set_accelerations(system, work, state, derivative)
    rate = speed_change(system, work, state, derivative)
    if unlikely(rate != 0.0):
        apply_speed_change(system, work, state, rate, derivative)
    hold_reference(bodies, work, derivative)
    if unlikely(bodies.fixed.shape[0] > 0):
        hold_fixed(bodies, work, speed, rate, derivative)
    derivative[TIME] = 1.0
    derivative[ARC_LENGTH] = speed
    derivative[SPEED] = rate
    return RUNNING, 0, n_patches
