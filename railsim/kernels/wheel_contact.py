"""Elastic normal contact of all wheels: see `wheel_rail` for the equations."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    B_CHANGE,
    B_E_PHI,
    B_K,
    B_K2,
    B_LEVER,
    B_RADIUS,
    B_RATE,
    B_RISE,
    BUMP_SIZE,
    CONTACT_JACOBIAN,
    FOOT_X,
    FOOT_X_PER_YAW,
    FOOT_Y,
    FOOT_Z,
    MU_N,
    NORMAL,
    NORMAL_DAMPING,
    PENETRATION,
    RISE,
    W_CHECK,
    W_LIFT,
    W_Q,
    W_Y,
    A,
    B,
)
from railsim.kernels.contact_damping import couple_patch_stiffness, store_patch_stiffness
from railsim.kernels.contact_table import (
    G_ROLL,
    G_W,
    G_Y,
    G_YY,
    INSIDE,
    K2_ROLL,
    K2_W,
    K2_Y,
    K_ROLL,
    K_W,
    K_Y,
    LOOK_UP_SIZE,
    N_PATCH,
    couple_approaches,
    find_cell,
    gap_curvature,
    is_far,
    look_up,
    patch_under_load,
    set_cell_weights,
    stretched_roll,
)
from railsim.kernels.elements import STOP_RATE
from railsim.kernels.rail_parts import COUNT, FIRST_PART, clamp, look_up_rail, position_in_range
from railsim.kernels.rails import (
    BEND_Z,
    CHANGE_ROLL,
    CHANGE_Y,
    CHANGE_Z,
    COSINE,
    FRICTION,
    MIDDLE_Y,
    MIDDLE_Z,
    MOTION_Y,
    MOTION_Y_RATE,
    MOTION_Z,
    MOTION_Z_RATE,
    RAIL_BEND,
    RAIL_SLOPE,
    ROLL,
    ROLL_SLOPE,
    SHIFT,
    SHIFT_SLOPE,
    SINE,
    SLOPE_Y,
    SLOPE_Z,
    predict_rate_changes,
)
from railsim.kernels.state import SPEED, velocity_begin
from railsim.kernels.status import RUNNING, WHEEL_LIFT, YAW_RANGE
from railsim.kernels.support import SKIP
from railsim.kernels.system import COS_ROLL, HORIZON, LATERAL, SECTIONS, SIN_ROLL, Y_0, Z_0
from railsim.kernels.table_ends import LIFT_RANGE, all_far, end_status, fall_status, section_status
from railsim.kernels.track_frame import OMEGA
from railsim.kernels.wheel_surface import DIVISION_RATE, store_surface_heights, subtract_height

# a wheel as far as this above its rail is followed to see whether it strikes within a step (m)
NEAR_GAP = 2e-3
STEEP = 3.0  # of a flange
MIN_TIME = 1e-9  # s, so that nothing is divided by zero
FADE = 30e-6  # penetration over which the contact damping is faded in (m)


@compiled(python=False)
def add_normal_contact(system, work, speed, state):
    """Look up all wheels, add elastic normal forces, list the active patches.

    Returns
    -------
    status, wheelset, n : int
        Status code, the wheelset it concerns, number of active patches.
    """
    contact = system.contact
    force, plane, wheelset = work.rail_force, work.plane, work.wheelset
    jacobian = work.contact_jacobian
    n_bodies = system.bodies.kind.shape[0]
    horizon = work.stepping[HORIZON]
    n = np.int64(0)  # a plain 0 would have everything that takes it compiled twice
    for w in range(contact.body.shape[0]):
        if system.support.elastic and work.support_step[w, SKIP] > 0.0:
            continue
        b = contact.body[w]
        for k in range(6):
            force[b, k] = 0.0
        for k in range(CONTACT_JACOBIAN):
            jacobian[b, k] = 0.0
        # the wheelset in the plane of the rails, and its rates there
        sine, cosine = plane[w, SINE], plane[w, COSINE]
        height = system.bodies.row[b, Z_0]
        y = state[6 * b + 1] - plane[w, MIDDLE_Y]
        z = state[6 * b + 2] - plane[w, MIDDLE_Z] + height
        y_rate = state[velocity_begin(n_bodies) + 6 * b + 1] - speed * plane[w, SLOPE_Y]
        z_rate = state[velocity_begin(n_bodies) + 6 * b + 2] - speed * plane[w, SLOPE_Z]
        y, z = cosine * y + sine * z, cosine * z - sine * y
        turn = speed * plane[w, ROLL_SLOPE]
        y_rate, z_rate = (
            cosine * y_rate + sine * z_rate + turn * z,
            cosine * z_rate - sine * y_rate - turn * y,
        )
        # rates of the Euler angles were left here by the kinematics
        yaw, yaw_rate = state[6 * b + 5], work.acceleration[b, 5]
        # a yawed axle on sloping rails is rolled against their plane
        slope, bend = plane[w, SLOPE_Z], plane[w, BEND_Z]
        wheelset[0], wheelset[1] = y, z - height
        wheelset[2], wheelset[3] = state[6 * b + 3] - plane[w, ROLL] + slope * yaw, yaw
        wheelset[4], wheelset[5] = y_rate, z_rate
        wheelset[6] = work.acceleration[b, 3] - turn + slope * yaw_rate + speed * bend * yaw
        wheelset[7] = yaw_rate
        wheelset[8], wheelset[9] = stretched_roll(wheelset[2])
        work.force_rate[w] = work.laws[STOP_RATE]
        if horizon > 0.0 and system.track.has_irregularity:
            predict_rate_changes(system, work, w, state)
        for side in range(2):
            status, n = add_wheel_contact(system, work, w, side, state, n)
            if unlikely(status != RUNNING):
                return status, w, n
        # from the plane to the track's axes; -dU/ds instead of the force along the track
        f_y, f_z = force[b, 1], force[b, 2]
        along = plane[w, ROLL_SLOPE] * (f_y * z - f_z * y - force[b, 3])
        f_y, f_z = cosine * f_y - sine * f_z, sine * f_y + cosine * f_z
        force[b, 0] += along - f_y * plane[w, SLOPE_Y] - f_z * slope + force[b, 3] * bend * yaw
        force[b, 1] = f_y
        force[b, 2] = f_z
        force[b, 5] += slope * force[b, 3]
    return RUNNING, 0, n


class WheelOnRail(NamedTuple):
    """A wheel on its rail, as if it were the right one: both seen in the plane of the rails.

    Attributes
    ----------
    sign : float           -1 for the left wheel, 1 for the right one
    y, z, roll, yaw : float   of the wheelset, less the rail's displacement [m, rad]
    y_rate, z_rate, roll_rate, yaw_rate : float   their rates [m/s, rad/s]
    """

    sign: float
    y: float
    z: float
    roll: float
    yaw: float
    y_rate: float
    z_rate: float
    roll_rate: float
    yaw_rate: float


@compiled(inline=True)
def relative_wheel_motion(work, w, side, speed):
    """How the wheel `side` of wheelset `w`, which `work.wheelset` describes, stands on its rail."""
    rail, wheelset, motion = work.rail, work.wheelset, work.rail_motion
    sign = 2.0 * side - 1.0
    shift, shift_slope = rail[w, side, SHIFT], rail[w, side, SHIFT_SLOPE]
    return WheelOnRail(
        sign,
        sign * (wheelset[0] - shift - motion[w, side, MOTION_Y]),
        wheelset[1] - motion[w, side, MOTION_Z],
        sign * wheelset[2],
        wheelset[3] - rail[w, side, RAIL_SLOPE],
        sign * (wheelset[4] - speed * shift_slope - motion[w, side, MOTION_Y_RATE]),
        wheelset[5] - motion[w, side, MOTION_Z_RATE],
        sign * wheelset[6],
        wheelset[7] - speed * rail[w, side, RAIL_BEND],
    )


@compiled(python=False)
def add_wheel_contact(system, work, w, side, state, n):
    """Normal forces of one wheel, added to its wheelset's generalised ones in `work.rail_force`.

    `work.wheelset`: the wheelset in the plane of its rails; `n` counts the active patches so far.

    Returns
    -------
    status, n : int
    """
    contact, wheelset = system.contact, work.wheelset
    approach = work.approach
    wheel = relative_wheel_motion(work, w, side, state[SPEED])
    table = contact.table[w, side]
    out_of_round = contact.surface_of.shape[0] > 0
    highest = 0.0
    if unlikely(out_of_round):
        highest = store_surface_heights(system, work, state, w, side, wheel)
    for k in range(contact.rails.range_of.shape[0]):
        s, piece = position_in_range(system, state, w, side, k, wheelset[3])
        if unlikely(piece >= 0):
            return add_section_contact(system, work, w, side, state, wheel, highest, s, piece, n)
    code, iy, ir, iw, ty, tr, tw = find_cell(
        contact, table, wheel.y, wheel.roll, wheel.sign * wheelset[8], wheel.yaw * wheel.yaw
    )
    if unlikely(code != INSIDE):
        return end_status(contact, table, code, wheel, wheel.sign * wheelset[8]), n
    if tw > 1.0:
        work.events[w, 4] += 1
    set_cell_weights(contact, ty, tr, wheelset[9], work.weights)
    closing = closing_distance(work, side, wheel)
    lift = 1.0
    for patch in range(N_PATCH):
        work.stiffness[patch] = 0.0
        work.stiffness[N_PATCH + patch] = 0.0
        approach[patch] = -1.0
        if is_far(contact, table, patch, iy, ir, iw, tr, tw, wheel.z + highest + closing):
            continue
        first = patch * LOOK_UP_SIZE
        look_up(contact, table, patch, iy, ir, iw, tw, work.weights, work.look_up, first)
        if unlikely(out_of_round):
            subtract_height(work.look_up, first, work.bump, patch, contact.shear[table])
        work.stiffness[patch] = work.look_up[first + 1]
        work.stiffness[N_PATCH + patch] = work.look_up[first + 2]
        approach[patch] = wheel.z - work.look_up[first]
        lift = min(lift, -approach[patch])
    couple_approaches(contact.coupling, table, work.stiffness, approach)
    elastic = system.support.elastic
    for patch in range(N_PATCH):
        if elastic and approach[patch] > 0.0:
            work.look_up[patch * LOOK_UP_SIZE + G_YY] = gap_curvature(
                contact, table, patch, iy, ir, iw, ty, tw, work.weights
            )
    clear_wheel(work.wheel, w, side, lift)
    begin = n
    for patch in range(N_PATCH):
        if approach[patch] > -NEAR_GAP - closing:
            n = add_patch_contact(system, work, w, side, patch, wheel, n)
    if elastic and n > begin + 1:
        couple_patch_stiffness(work, contact.coupling, table, begin, n)
    if unlikely(lift > LIFT_RANGE) and all_far(contact, table, iy, ir, iw, tr, wheel.z):
        return WHEEL_LIFT, n
    return RUNNING, n


@compiled(python=False)
def add_section_contact(system, work, w, side, state, wheel, highest, s, piece, n):
    """As `add_wheel_contact`, at the position `s` of a piece whose rails' sections change."""
    contact, wheelset, bump, approach = system.contact, work.wheelset, work.bump, work.approach
    rails, table = contact.rails, contact.table[w, side]
    stretched, yaw_2 = wheel.sign * wheelset[8], wheel.yaw * wheel.yaw
    code = find_cell(contact, table, wheel.y, wheel.roll, stretched, yaw_2)[0]
    if code != INSIDE:
        return section_status(contact, table, code, wheel, stretched), n
    stretched, slope, d_y, d_roll = clamp(rails, wheel.y, wheel.roll, stretched, wheelset[9])
    code, iy, ir, iw, ty, tr, tw = find_cell(rails, 0, wheel.y - d_y, wheel.roll, stretched, yaw_2)
    if code != INSIDE:
        return YAW_RANGE, n
    if tw > 1.0:
        work.events[w, 4] += 1
    set_cell_weights(rails, ty, tr, slope, work.weights)
    count = rails.piece[piece, COUNT]
    for patch in range(N_PATCH, N_PATCH * count):
        for k in range(BUMP_SIZE):
            bump[patch, k] = bump[patch % N_PATCH, k]
    lever = wheel.sign * rails.lever[piece]
    rate = state[SPEED] + state[6 * system.bodies.kind.shape[0] + 6 * contact.body[w]]
    rate -= lever * wheelset[7]
    # to see every zone that may touch, however steep
    closing = closing_distance(work, side, wheel)
    reach = wheel.z + highest + rails.lever[piece] * d_roll + STEEP * abs(d_y) + closing
    lift, nearest = 1.0, -1.0
    for number in range(count):
        first = N_PATCH * number
        depth = look_up_rail(
            system,
            work,
            (iy, ir, iw, tw, reach),
            (s, rate, lever),
            rails.piece[piece, FIRST_PART] + number,
            first,
        )
        nearest = max(nearest, depth)
        for patch in range(first, first + N_PATCH):
            if approach[patch] == 0.0:
                k = patch * LOOK_UP_SIZE
                shear, g_y = rails.shear[0], work.look_up[k + G_Y]
                work.look_up[k] += d_y * g_y + d_roll * (work.look_up[k + G_ROLL] + shear * g_y)
                for y, roll in ((K_Y, K_ROLL), (K2_Y, K2_ROLL)):
                    if d_roll != 0.0:  # beyond the tables the stiffness does not change any more
                        work.look_up[k + roll] = -shear * work.look_up[k + y]
                    if d_y != 0.0:
                        work.look_up[k + roll] += shear * work.look_up[k + y]
                        work.look_up[k + y] = 0.0
                subtract_height(work.look_up, k, bump, patch, shear)
                work.stiffness[first + patch] = work.look_up[k + 1]
                work.stiffness[first + patch + N_PATCH] = work.look_up[k + 2]
                approach[patch] = wheel.z - work.look_up[k]
                lift = min(lift, -approach[patch])
        stiffness = work.stiffness[2 * first : 2 * first + 2 * N_PATCH]
        couple_approaches(contact.coupling, table, stiffness, approach[first : first + N_PATCH])
    clear_wheel(work.wheel, w, side, lift)
    if lift > 0.0:  # rails rise towards it: when it will strike is not predicted
        work.force_rate[w] = DIVISION_RATE
    begin = n
    for patch in range(N_PATCH * count):
        p = approach[patch]
        if p > -NEAR_GAP - closing:
            n = add_patch_contact(system, work, w, side, patch, wheel, n)
        if p > 0.0:
            along = 0.4 * p * p * sqrt(p) * bump[patch, B_K] + p * p * p / 3.0 * bump[patch, B_K2]
            work.rail_force[contact.body[w], 0] -= along
            work.rail_force[contact.body[w], 5] += lever * along
    couple_patch_stiffness(work, contact.coupling, table, begin, n)
    return fall_status(rails, piece, wheel, nearest) if lift > NEAR_GAP else RUNNING, n


@compiled(inline=True)
def closing_distance(work, side, wheel):
    """How far a patch may come closer during the next step, a steep flange from the side [m]."""
    change = work.rate_change
    return work.stepping[HORIZON] * (
        abs(wheel.z_rate)
        + abs(change[side, CHANGE_Z])
        + STEEP * (abs(wheel.y_rate) + abs(change[side, CHANGE_Y]))
    )


@compiled(python=False)
def clear_wheel(wheel, w, side, lift):
    """Clear the outputs of a wheel but for its lift."""
    for k in range(W_CHECK):
        wheel[w, side, k] = 0.0
    wheel[w, side, W_LIFT] = lift


@compiled(python=False)
def add_patch_contact(system, work, w, side, patch, wheel, n):
    """Normal force of one patch; where it carries, the patch becomes number `n` of the active ones.

    Returns
    -------
    n : int
        Number of active patches.
    """
    contact, t, rate_change = system.contact, work.look_up, work.rate_change
    p, k = work.approach[patch], patch * LOOK_UP_SIZE
    p_rate = (
        wheel.z_rate
        - t[k + G_Y] * wheel.y_rate
        - t[k + G_ROLL] * wheel.roll_rate
        - t[k + G_W] * 2.0 * wheel.yaw * wheel.yaw_rate
        + work.bump[patch, B_RATE]
    )
    p_change = rate_change[side, CHANGE_Z] - wheel.sign * (
        t[k + G_Y] * rate_change[side, CHANGE_Y] + t[k + G_ROLL] * rate_change[side, CHANGE_ROLL]
    )
    p_change += work.bump[patch, B_CHANGE]
    horizon = work.stepping[HORIZON]
    p_0 = max(p, 0.0)
    root = sqrt(p_0)
    elastic = p_0 * root * (t[k + 1] + root * t[k + 2])
    change = max(abs(p_rate), abs(p_rate + p_change))
    rate = root * (1.5 * t[k + 1] + 2.0 * root * t[k + 2]) * change
    # also from a light touch, where the stiffness is still small; without branches, as whether it
    # comes closer alternates from step to step
    p_1 = max(p_0, p + horizon * (p_rate + max(p_change, 0.0)))
    root_1 = sqrt(p_1)
    gain = p_1 * root_1 * (t[k + 1] + root_1 * t[k + 2]) - elastic
    rate = max(rate, gain / max(horizon, MIN_TIME))
    if unlikely(work.stepping[SECTIONS] > 1.0):  # rails with masses: a blow begins with the damping
        fades = min(1.0, p_1 / FADE) - min(1.0, p_0 / FADE)
        rate += contact.damping * fades * change / max(horizon, MIN_TIME)
    rate *= max(1.0, work.stepping[LATERAL] * abs(t[k + G_Y]))
    work.force_rate[w] = max(work.force_rate[w], rate)
    if p > 0.0:
        c_y, c_z, a1, b1, tangent = patch_under_load(t, k, max(elastic, 0.0))
        cos_2 = 1.0 / (1.0 + tangent * tangent)
        fade = min(1.0, p / FADE)
        vertical = max(0.0, elastic + contact.damping * cos_2 * fade * p_rate)
        add_normal_force(work, contact.body[w], w, side, wheel, p, k, vertical)
        if unlikely(contact.surface_of.shape[0] + contact.rails.range_of.shape[0] > 0):
            # moment about the axle
            work.rail_force[contact.body[w], 4] += vertical * work.bump[patch, B_E_PHI]
            along = vertical * work.bump[patch, B_RISE]
            work.rail_force[contact.body[w], 0] -= along
            work.rail_force[contact.body[w], 5] += work.bump[patch, B_LEVER] * along
        cos_g = sqrt(cos_2)
        N = vertical / cos_g
        if N > 0.0:
            column = work.patch
            column[A, n] = a1
            column[B, n] = b1
            column[NORMAL, n] = N
            column[MU_N, n] = work.rail[w, side, FRICTION] * N
            column[ANGLE_COS, n] = cos_g
            column[ANGLE_SIN, n] = wheel.sign * tangent * cos_g
            # the normal meets the axle: c + lambda n lies on it, and n does not point along
            per_yaw = wheel.sign * (c_z * tangent - c_y)
            column[FOOT_X_PER_YAW, n] = per_yaw
            column[FOOT_X, n] = wheel.yaw * per_yaw + work.bump[patch, B_E_PHI]
            column[FOOT_Y, n] = wheel.sign * c_y
            column[FOOT_Z, n] = c_z + work.bump[patch, B_RADIUS]
            column[RISE, n] = work.bump[patch, B_RISE]
            column[PENETRATION, n] = p
            store_patch_stiffness(system, work, w, n, k, wheel.sign, p, vertical)
            column[NORMAL_DAMPING, n] = contact.damping * fade
            work.patch_index[n, 0] = w
            work.patch_index[n, 1] = side
            work.patch_index[n, 2] = patch
            n += 1
    return n


@compiled(python=False)
def add_normal_force(work, b, w, side, wheel, p, k, vertical):
    """Add a patch's generalised normal forces to those of wheelset `w`, body `b`.

    `p`: penetration; `k`: where the patch begins in `work.look_up`; `vertical`: its force there.
    """
    force, rail, t = work.rail_force, work.rail, work.look_up
    per_K, per_K2 = 0.4 * p * p * sqrt(p), p * p * p / 3.0
    q_y = wheel.sign * (vertical * t[k + G_Y] - per_K * t[k + K_Y] - per_K2 * t[k + K2_Y])
    q_yaw = (vertical * t[k + G_W] - per_K * t[k + K_W] - per_K2 * t[k + K2_W]) * 2.0 * wheel.yaw
    force[b, 0] -= q_y * rail[w, side, SHIFT_SLOPE] + q_yaw * rail[w, side, RAIL_BEND]
    force[b, 1] += q_y
    force[b, 2] -= vertical
    force[b, 3] += wheel.sign * (
        vertical * t[k + G_ROLL] - per_K * t[k + K_ROLL] - per_K2 * t[k + K2_ROLL]
    )
    force[b, 5] += q_yaw
    work.wheel[w, side, W_Q] += vertical
    work.wheel[w, side, W_Y] -= q_y


@compiled(python=False)
def complete_normal_force(system, work, b, state):
    """Moment vector from the generalised moments, and the force along the track.

    The wheelset's axes are C = Rz(yaw) Rx(roll); roll turns about its first axis, yaw about the
    track's normal: Q_roll = M_1, Q_yaw = M_2 sin roll + M_3 cos roll, and the normal force does no
    work on the spin, M_2 = 0, unless the wheel is not round, see `wheel_surface`.

    The potential does not depend on the position along a smooth track.  Moving along it with all
    relative coordinates held, v = e_x + omega x r and u = omega per metre, the contact does no
    work; hence F_x (1 + (omega x r)_x) = -F_y (omega x r)_y - F_z (omega x r)_z - M omega: on a
    twisted track the wheels climb the rails.  `force[b, 0]` brings the share of irregular rails.
    """
    bodies, frames, C, force = system.bodies, work.frames, work.relative, work.rail_force
    m1, m2 = force[b, 3], force[b, 4]
    m3 = (force[b, 5] - m2 * C[b, SIN_ROLL]) / C[b, COS_ROLL]
    mx = C[b, 0] * m1 + C[b, 1] * m2 + C[b, 2] * m3
    my = C[b, 3] * m1 + C[b, 4] * m2 + C[b, 5] * m3
    mz = C[b, 6] * m1 + C[b, 7] * m2 + C[b, 8] * m3
    f = bodies.frame[b]
    w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
    x = state[6 * b]
    y = state[6 * b + 1] + bodies.row[b, Y_0]
    z = state[6 * b + 2] + bodies.row[b, Z_0]
    along = (
        force[b, 1] * (w3 * x - w1 * z)
        + force[b, 2] * (w1 * y - w2 * x)
        + mx * w1
        + my * w2
        + mz * w3
    )
    force[b, 0] = (force[b, 0] - along) / (1.0 + w2 * z - w3 * y)
    force[b, 3] = mx
    force[b, 4] = my
    force[b, 5] = mz
