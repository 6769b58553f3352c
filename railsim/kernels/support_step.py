"""Steps of the fast scheme for the moving track model of `support`.

The contact makes the track stiff: a rail of 60 kg on a contact of 1.2 GN/m vibrates at 700 Hz, and
creep forces damp it at 20 000 1/s.  `step_support` takes all of it implicitly by the two-step
backward differentiation formula (Curtiss and Hirschfelder 1952; L-stable, order two), linearised
once a step about the last evaluation, with the wheelset's motion over the step already known:

    r = (u_1 - u_0)/h,  u_1' = (1 + g) r - g r_0,  u_1'' = (1 + g) (u_1' - u_0')/h - g s_0

r_0 and s_0 are the mean rate and the mean acceleration of the step before, of length h_0, and the
state keeps them; g = h/(h + h_0), 1/2 in equal steps.  The forces themselves are those of the
contact at (q, u): the linearisation affects only the change of u within one step.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_Q, WHEEL_COLUMNS
from railsim.kernels.lanes import (
    LANES,
    any_beyond,
    gather_pairs,
    load_rows,
    maximum,
    pair_starts,
    paired_numbers,
    row_starts,
    splat,
    store_rows,
    swap_pairs,
    where_beyond,
)
from railsim.kernels.rails import PAIRS, PLANE_SIZE, RAIL_SIZE, SINE, locate_rails
from railsim.kernels.slope_adaptation import adapt_slopes, relax_imbalance
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, velocity_begin
from railsim.kernels.support import (
    ACCELERATION,
    DOF,
    ERROR_Y,
    F_Y,
    FOOT_Y_STIFFNESS,
    FORCE_TOLERANCE,
    HEIGHTS,
    L_ERROR_Y,
    L_MOTION,
    LMS,
    LMS_SIZE,
    MAX_CORRECTIONS,
    MEAN_CHANGE,
    MEAN_RATE,
    PADS,
    PENDING,
    RAIL_DOF,
    RATE,
    SLOPE_RANGE_Y,
    SLOPE_RANGE_Z,
    STEP_RATIO,
    SUPPORT_COLUMNS,
    SUPPORT_SIZE,
    SUPPORT_STEP,
    URGENT,
    D,
    K,
    contact_force,
    imbalance,
    inertia,
    load_track,
    plus_scaled,
    solve_track,
    store_track,
    support_begin,
    track_forces,
    track_offsets,
)
from railsim.kernels.system import ALL_WHEELS, BODY_SIZE, RATES_SIZE, REPEATS, TOLERANCE_STEP, Z_0
from railsim.kernels.wheel_surface import predict_tread_heights


@compiled(python=False)
def start_track_memory(system, work, state):
    """Initialise the memory of `step_support` from `state`."""
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        work.support_step[w, PENDING] = 0.0
        for k in range(2 * LMS_SIZE):
            state[first + LMS + k] = 0.0
        for k in range(DOF):
            state[first + MEAN_RATE + k] = state[first + RATE + k]
            state[first + MEAN_CHANGE + k] = 0.0
            state[first + ACCELERATION + k] = 0.0


@compiled(inline=True)
def wheelset_motion(system, work, state, wheels):
    """Motion of the wheelsets of eight wheels in the planes of their rails.

    Lateral position less the rail's displacement aside, vertical position, with the height of a
    wheel that is not round, and roll, all against the rails' shape; their rates against it; speed
    at which the wheelset, yawed against the rail, slips across it.  With the rail's slope y' in the
    lateral rate and in the slip the material's speed across, y_rate - V yaw, is their sum.
    """
    n, speed = system.bodies.kind.shape[0], state[SPEED]
    body = gather_pairs(system.contact.body, wheels)
    rows = row_starts(body, 6)
    height = load_rows(system.bodies.row, row_starts(body, BODY_SIZE), Z_0, 1)[0]
    _, y, z, roll, _, yaw, _, _ = load_rows(state, rows, 0, 8)
    _, y_rate, z_rate, roll_rate = load_rows(state, rows, velocity_begin(n), 4)
    middle_y, middle_z, _, slope_z, plane_roll, sine, cosine, roll_slope = load_rows(
        work.plane, pair_starts(wheels, 0, PLANE_SIZE, 0), 0, 8
    )
    _, shift, _, slope = load_rows(work.rail, row_starts(wheels, RAIL_SIZE), 0, 4)
    turn = speed * roll_slope
    y, z = y - middle_y, z + height - middle_z
    y, z = cosine * y + sine * z, cosine * z - sine * y
    if system.contact.surface_of.shape[0] > 0:
        heights = pair_starts(wheels, 0, SUPPORT_STEP, 1)
        z = z + load_rows(work.support_step, heights, HEIGHTS, 1)[0]
        z_rate = z_rate + load_rows(work.support_step, heights, HEIGHTS + 2, 1)[0]
    return (
        y - shift,
        z,
        roll - plane_roll + slope_z * yaw,
        y_rate - speed * slope + height * turn,
        z_rate - speed * slope_z,
        roll_rate - turn,
        speed * (slope - yaw),
    )


@compiled(python=False)
def update_wheel_heights(system, work, state):
    """Heights of wheels that are not round."""
    if system.contact.surface_of.shape[0] > 0:
        for w in range(work.support.shape[0]):
            predict_tread_heights(system, work, state, w, work.support_step[w], HEIGHTS)


@compiled(python=False)
def store_wheelset_motion(system, work, state):
    """Store the motion of the wheelsets before a step."""
    count = work.support.shape[0]
    update_wheel_heights(system, work, state)
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        motion = wheelset_motion(system, work, state, wheels)
        store_rows(work.motion, row_starts(wheels, LANES), 0, motion)


@compiled(inline=True)
def motion_change(work, wheels, motion):
    """Change of the wheelsets' motion since it was stored."""
    motion_0 = load_rows(work.motion, row_starts(wheels, LANES), 0, 7)
    return (
        motion[0] - motion_0[0],
        motion[1] - motion_0[1],
        motion[2] - motion_0[2],
        motion[3] - motion_0[3],
        motion[4] - motion_0[4],
        motion[5] - motion_0[5],
        motion[6] - motion_0[6],
    )


@compiled(python=False)
def step_support(system, work, state, h, h_0):
    """Advance the track under all wheelsets by `h`, with bodies, position and speed after it.

    Slopes learn from the forces found, and rails whose correction has waited for the step move, see
    `correct_support`.  `h_0`: length of the step before.
    """
    locate_rails(system, work, state[ARC_LENGTH])
    update_wheel_heights(system, work, state)
    count = work.support.shape[0]
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        load = load_rows(system.contact.load, pair_starts(wheels, 0, 1, 0), 0, 1)[0]
        lms = pair_starts(wheels, support_begin(system) + LMS, SUPPORT_SIZE, LMS_SIZE)
        adapt_slopes(work, state, lms, row_starts(wheels, SUPPORT_COLUMNS), load, h_0)
        motion = wheelset_motion(system, work, state, wheels)
        step_tracks(system, work, state, wheels, lms, motion_change(work, wheels, motion), h, h_0)


@compiled(inline=True)
def step_tracks(system, work, state, wheels, lms, change, h, h_0):
    """Advance the tracks under eight wheels whose wheelsets move by `change`."""
    support = system.support
    row, g = support.row, h / (h + h_0)
    rails, sleepers = track_offsets(system, wheels)
    factors = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2)
    u, rate = load_track(state, rails, sleepers, 0), load_track(state, rails, sleepers, RATE)
    r_0 = load_track(state, rails, sleepers, MEAN_RATE)
    s_0 = load_track(state, rails, sleepers, MEAN_CHANGE)
    later = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PENDING, 1)[0]
    if any_beyond(later, 0.5):
        r_rows, s_rows = step_offsets(wheels)
        r = load_track(work.support_step, r_rows, s_rows, 0)
        weights = pair_starts(wheels, support_begin(system) + STEP_RATIO, SUPPORT_SIZE, 0)
        c = 1.0 + load_rows(state, weights, 0, 1)[0]
        u, rate = plus_scaled(u, h_0 * later, r), plus_scaled(rate, c * later, r)
        r_0, s_0 = plus_scaled(r_0, later, r), plus_scaled(s_0, c / h_0 * later, r)
    # what is known of -(C u' + K u) after the step
    b = track_forces(support, factors, u, r_0, g)
    if not support.massless:
        b = plus_scaled(b, g, inertia(row, s_0))
        b = plus_scaled(b, (1.0 + g) / h, inertia(row, plus_scaled(rate, g, r_0)))
    rows = row_starts(wheels, SUPPORT_COLUMNS)
    f_y, f_z, k0, k1, k2, k3, k4, k5 = load_rows(work.support, rows, 0, 8)
    d0, d1, d2, d3, d4, d5, slip_y, slip_z = load_rows(work.support, rows, D, 8)
    y, z, roll, y_rate, z_rate, roll_rate, slip = change
    v_y = y_rate + rate[0] + g * r_0[0]
    v_z = z_rate + rate[1] + g * r_0[1]
    K, D_ = (k0, k1, k2, k3, k4, k5), (d0, d1, d2, d3, d4, d5)
    k_y, k_z = contact_force(K, y, z, roll)
    d_y, d_z = contact_force(D_, v_y, v_z, roll_rate)
    b = (
        b[0] + f_y + k_y + d_y + slip_y * slip,
        b[1] + f_z + k_z + d_z + slip_z * slip,
        b[2],
        b[3],
        b[4],
    )
    r = solve_track(support, factors, K, D_, b, (1.0 + g) * (1.0 + g) / h, 1.0 + g, h)
    store_rows(state, lms, L_MOTION, (y - h * r[0],))
    weights = pair_starts(wheels, support_begin(system) + STEP_RATIO, SUPPORT_SIZE, 0)
    store_rows(state, weights, 0, (splat(g),))
    rate_1 = linear_combination(1.0 + g, r, -g, r_0)
    s = linear_combination(1.0 / h, rate_1, -1.0 / h, rate)
    store_track(state, rails, sleepers, 0, plus_scaled(u, h, r))
    store_track(state, rails, sleepers, RATE, rate_1)
    store_track(state, rails, sleepers, MEAN_RATE, r)
    store_track(state, rails, sleepers, MEAN_CHANGE, s)
    store_track(state, rails, sleepers, ACCELERATION, linear_combination(1.0 + g, s, -g, s_0))


@compiled(inline=True)
def step_offsets(wheels):
    """Where the columns of rails and sleepers in `Work.support_step` begin."""
    return (pair_starts(wheels, 0, SUPPORT_STEP, 2), pair_starts(wheels, RAIL_DOF, SUPPORT_STEP, 0))


@compiled(inline=True)
def linear_combination(a, x, b, y):
    """A x + b y of five Lanes each."""
    return (
        a * x[0] + b * y[0],
        a * x[1] + b * y[1],
        a * x[2] + b * y[2],
        a * x[3] + b * y[3],
        a * x[4] + b * y[4],
    )


@compiled(python=False)
def extrapolate_forces(system, work, state, wheels, later, h):
    """Change the forces between wheelsets and rails as moving the rails will, linearly.

    The motion is the mean rate r in ``work.support_step[w, :7]`` over a step `h`, found here from
    the imbalance there: displacements change by h r, rates by c r.  Forces on the wheelset act at
    its contacts; longitudinal creep forces, creepages and patches remain those of the evaluation.
    """
    r_rows, s_rows = step_offsets(wheels)
    rows = row_starts(wheels, SUPPORT_COLUMNS)
    weights = pair_starts(wheels, support_begin(system) + STEP_RATIO, SUPPORT_SIZE, 0)
    c = 1.0 + load_rows(state, weights, 0, 1)[0]
    stiffness, damping = load_rows(work.support, rows, K, 6), load_rows(work.support, rows, D, 6)
    factors = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2)
    b = load_track(work.support_step, r_rows, s_rows, 0)
    r = solve_track(system.support, factors, stiffness, damping, b, c * c / h, c, h)
    store_track(work.support_step, r_rows, s_rows, 0, r)
    foot_y, foot_z, contact = load_rows(work.support, rows, FOOT_Y_STIFFNESS, 3)
    zero = splat(0.0)
    factor = where_beyond(contact, 0.0, later, zero)
    k_y, k_z = contact_force(stiffness, r[0], r[1], zero)
    d_y, d_z = contact_force(damping, r[0], r[1], zero)
    f_y, f_z = -factor * (h * k_y + c * d_y), -factor * (h * k_z + c * d_z)
    F = load_rows(work.support, rows, F_Y, 2)
    store_rows(work.support, rows, F_Y, (F[0] + f_y, F[1] + f_z))
    wheel = row_starts(wheels, WHEEL_COLUMNS)
    Q, Y = load_rows(work.wheel, wheel, W_Q, 2)
    store_rows(work.wheel, wheel, W_Q, (Q + f_z, Y + f_y))
    sine, cosine = load_rows(work.plane, pair_starts(wheels, 0, PLANE_SIZE, 0), SINE, 2)
    y, z = cosine * f_y - sine * f_z, cosine * f_z + sine * f_y
    moment = where_beyond(contact, 0.0, (foot_y * f_z - foot_z * f_y) / contact, zero)
    body = row_starts(gather_pairs(system.contact.body, wheels), RATES_SIZE)
    force = load_rows(work.rail_force, body, 1, 3)
    store_rows(
        work.rail_force,
        body,
        1,
        (
            force[0] - (y + swap_pairs(y)),
            force[1] - (z + swap_pairs(z)),
            force[2] - (moment + swap_pairs(moment)),
        ),
    )


@compiled(python=False)
def correct_support(system, work, state, remaining):
    """One Newton step for the rails after a step of the fast scheme.

    `step_support` foresees the forces by the slopes of one evaluation.  Where the contact moves
    over a curved profile or begins to slide, the forces in the new position differ from those, and
    without a correction the scheme has order one.  The rails' accelerations of the state are
    those of the forces predicted, so that the imbalance F - M u'' - C u' - K u is the difference.

    Imbalances up to `FORCE_TOLERANCE` of the static wheel load stay.  Up to `SLOPE_RANGE_Y`,
    `SLOPE_RANGE_Z` the forces change by their slopes and the rails move before the next step:
    evaluated again, a state has the same forces, whatever shares the call.  Beyond, the rails move
    at once, and the contact of this wheelset is evaluated again; without `remaining` evaluations
    the slopes serve there, too.  In short steps the shares are less in proportion: what counts is
    by how much the forces lag.

    Returns
    -------
    bool : whether rails have moved, so that the forces are to be evaluated again.
    """
    h, count = state[LAST_STEP], work.support.shape[0]
    share = min(1.0, h / work.stepping[TOLERANCE_STEP])
    moved = False
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        if classify_imbalance(system, work, state, wheels, share, remaining):
            moved = True
            correct_rails(system, work, state, wheels, h, remaining == MAX_CORRECTIONS)
            for w in range(first, min(first + PAIRS, count)):
                work.events[w, REPEATS] += np.int64(work.support_step[w, URGENT])
    if moved:
        return True
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        later = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PENDING, 1)[0]
        if any_beyond(later, 0.5):
            extrapolate_forces(system, work, state, wheels, later, h)
    return False


@compiled(inline=True)
def classify_imbalance(system, work, state, wheels, share, remaining):
    """Store the imbalance of the tracks under eight wheels and when it is corrected.

    Returns whether any is to be corrected at once: `URGENT`.
    """
    b = imbalance(system, work, state, wheels)
    if not system.support.massless:
        rails, sleepers = track_offsets(system, wheels)
        acceleration = load_track(state, rails, sleepers, ACCELERATION)
        b = plus_scaled(b, -1.0, inertia(system.support.row, acceleration))
    r_rows, s_rows = step_offsets(wheels)
    store_track(work.support_step, r_rows, s_rows, 0, b)
    store_rows(work.support, row_starts(wheels, SUPPORT_COLUMNS), ERROR_Y, (b[0], b[1]))
    zero, one = splat(0.0), splat(1.0)
    load = share * load_rows(system.contact.load, pair_starts(wheels, 0, 1, 0), 0, 1)[0]
    y, z = b[0] / load, b[1] / load
    urgent = where_beyond(y, SLOPE_RANGE_Y, one, where_beyond(z, SLOPE_RANGE_Z, one, zero))
    if remaining == 0:
        urgent = zero
    urgent = maximum(urgent, swap_pairs(urgent))
    later = where_beyond(y, FORCE_TOLERANCE, one, where_beyond(z, FORCE_TOLERANCE, one, zero))
    later = maximum(later, swap_pairs(later)) * (one - urgent)
    step = pair_starts(wheels, 0, SUPPORT_STEP, 0)
    skip = (one - urgent) * (1.0 - work.counts[ALL_WHEELS])
    store_rows(work.support_step, step, PENDING, (later, skip, urgent))
    return any_beyond(urgent, 0.5)


@compiled(python=False)
def correct_rails(system, work, state, wheels, h, first_pass):
    """Correct the rails of those wheelsets whose forces are to be evaluated again."""
    rails, sleepers = track_offsets(system, wheels)
    rows, step = row_starts(wheels, SUPPORT_COLUMNS), pair_starts(wheels, 0, SUPPORT_STEP, 0)
    urgent = load_rows(work.support_step, step, URGENT, 1)[0]
    begin = support_begin(system)
    lms = pair_starts(wheels, begin + LMS, SUPPORT_SIZE, LMS_SIZE)
    error_y, error_z = load_rows(state, lms, L_ERROR_Y, 2)
    r_rows, s_rows = step_offsets(wheels)
    b = load_track(work.support_step, r_rows, s_rows, 0)
    square = error_y * error_y + error_z * error_z
    unset = where_beyond(square, 0.0, splat(0.0), urgent)
    store_rows(state, lms, L_ERROR_Y, (error_y + unset * b[0], error_z + unset * b[1]))
    y, z = relax_imbalance(work, state, wheels, lms, b[0], b[1], first_pass)
    c = 1.0 + load_rows(state, pair_starts(wheels, begin + STEP_RATIO, SUPPORT_SIZE, 0), 0, 1)[0]
    r = solve_track(
        system.support,
        load_rows(work.support_step, step, PADS, 2),
        load_rows(work.support, rows, K, 6),
        load_rows(work.support, rows, D, 6),
        (y, z, b[2], b[3], b[4]),
        c * c / h,
        c,
        h,
    )
    add_scaled_motion(state, rails, sleepers, 0, h * urgent, r)
    add_scaled_motion(state, rails, sleepers, RATE, c * urgent, r)
    add_scaled_motion(state, rails, sleepers, MEAN_RATE, urgent, r)
    add_scaled_motion(state, rails, sleepers, MEAN_CHANGE, c / h * urgent, r)
    add_scaled_motion(state, rails, sleepers, ACCELERATION, c * c / h * urgent, r)


@compiled(inline=True)
def add_scaled_motion(state, rails, sleepers, first, factor, r):
    """Add a multiple of the mean rate to the entries of tracks from `first` on."""
    values = load_track(state, rails, sleepers, first)
    store_track(state, rails, sleepers, first, plus_scaled(values, factor, r))
