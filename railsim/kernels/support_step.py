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
    beside,
    eight_in_pairs,
    eight_of_pairs,
    larger,
    load_rows,
    pair_starts,
    spread,
    starts,
    store_rows,
    where_beyond,
)
from railsim.kernels.learning import learn, relax_corrections
from railsim.kernels.rails import PAIRS, PLANE_SIZE, RAIL_SIZE, SINE, locate_rails
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, velocity_begin
from railsim.kernels.support import (
    ACCELERATION,
    BY_SLOPES_Y,
    BY_SLOPES_Z,
    DOF,
    ERROR_Y,
    F_Y,
    FOOT_Y_STIFFNESS,
    HEIGHTS,
    L_ERROR_Y,
    L_WAY,
    LEARNT,
    LEARNT_SIZE,
    MEAN_CHANGE,
    MEAN_RATE,
    MOST_CORRECTIONS,
    MOVED,
    PADS,
    PENDING,
    RAIL_DOF,
    RATE,
    SETTLED,
    SUPPORT_COLUMNS,
    SUPPORT_SIZE,
    SUPPORT_STEP,
    WEIGHT,
    D,
    K,
    imbalance,
    load_track,
    plus_part,
    product,
    solve_track,
    store_track,
    support_begin,
    track_forces,
    track_rows,
    weighed,
)
from railsim.kernels.system import AGAIN, BODY_SIZE, RATES_SIZE, WHOLE, WHOLE_TOLERANCE, Z_0
from railsim.kernels.wheel_surface import foreseen_heights


@compiled(python=False)
def remember_track(system, work, state):
    """Initialise the memory of `step_support` from `state`."""
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        work.support_step[w, PENDING] = 0.0
        for k in range(2 * LEARNT_SIZE):
            state[first + LEARNT + k] = 0.0
        for k in range(DOF):
            state[first + MEAN_RATE + k] = state[first + RATE + k]
            state[first + MEAN_CHANGE + k] = 0.0
            state[first + ACCELERATION + k] = 0.0


@compiled(inline=True)
def motion_of_wheelsets(system, work, state, wheels):
    """Motion of the wheelsets of eight wheels in the planes of their rails.

    Lateral position less the rail's displacement aside, vertical position, with the height of a
    wheel that is not round, and roll, all against the rails' shape; their rates against it; speed
    at which the wheelset, yawed against the rail, slips across it.  With the rail's slope y' in the
    lateral rate and in the slip the material's speed across, y_rate - V yaw, is their sum.
    """
    n, speed = system.bodies.kind.shape[0], state[SPEED]
    body = eight_of_pairs(system.contact.body, wheels)
    own = starts(body, 6)
    height = load_rows(system.bodies.row, starts(body, BODY_SIZE), Z_0, 1)[0]
    _, y, z, roll, _, yaw, _, _ = load_rows(state, own, 0, 8)
    _, y_rate, z_rate, roll_rate = load_rows(state, own, velocity_begin(n), 4)
    middle_y, middle_z, _, slope_z, lean, sine, cosine, lean_slope = load_rows(
        work.plane, pair_starts(wheels, 0, PLANE_SIZE, 0), 0, 8
    )
    _, aside, _, slope = load_rows(work.rail, starts(wheels, RAIL_SIZE), 0, 4)
    turn = speed * lean_slope
    y, z = y - middle_y, z + height - middle_z
    y, z = cosine * y + sine * z, cosine * z - sine * y
    if system.contact.surface_of.shape[0] > 0:
        heights = pair_starts(wheels, 0, SUPPORT_STEP, 1)
        z = z + load_rows(work.support_step, heights, HEIGHTS, 1)[0]
        z_rate = z_rate + load_rows(work.support_step, heights, HEIGHTS + 2, 1)[0]
    return (
        y - aside,
        z,
        roll - lean + slope_z * yaw,
        y_rate - speed * slope + height * turn,
        z_rate - speed * slope_z,
        roll_rate - turn,
        speed * (slope - yaw),
    )


@compiled(python=False)
def note_heights(system, work, state):
    """Heights of wheels that are not round."""
    if system.contact.surface_of.shape[0] > 0:
        for w in range(work.support.shape[0]):
            foreseen_heights(system, work, state, w, work.support_step[w], HEIGHTS)


@compiled(python=False)
def note_wheelsets(system, work, state):
    """Store the motion of the wheelsets before a step."""
    count = work.support.shape[0]
    note_heights(system, work, state)
    for first in range(0, count, PAIRS):
        wheels = eight_in_pairs(first, count)
        motion = motion_of_wheelsets(system, work, state, wheels)
        store_rows(work.motion, starts(wheels, LANES), 0, motion)


@compiled(inline=True)
def since_noted(work, wheels, motion):
    """By how much the motion of wheelsets has changed since it was noted."""
    noted = load_rows(work.motion, starts(wheels, LANES), 0, 7)
    return (
        motion[0] - noted[0],
        motion[1] - noted[1],
        motion[2] - noted[2],
        motion[3] - noted[3],
        motion[4] - noted[4],
        motion[5] - noted[5],
        motion[6] - noted[6],
    )


@compiled(python=False)
def step_support(system, work, state, h, last):
    """Advance the track under all wheelsets by `h`, with bodies, position and speed after it.

    Slopes learn from the forces found, and rails whose correction has waited for the step move, see
    `correct_support`.  `last`: length of the step before.
    """
    locate_rails(system, work, state[ARC_LENGTH])
    note_heights(system, work, state)
    count = work.support.shape[0]
    for first in range(0, count, PAIRS):
        wheels = eight_in_pairs(first, count)
        load = load_rows(system.contact.load, pair_starts(wheels, 0, 1, 0), 0, 1)[0]
        learnt = pair_starts(wheels, support_begin(system) + LEARNT, SUPPORT_SIZE, LEARNT_SIZE)
        learn(work, state, learnt, starts(wheels, SUPPORT_COLUMNS), load, last)
        motion = motion_of_wheelsets(system, work, state, wheels)
        step_tracks(system, work, state, wheels, learnt, since_noted(work, wheels, motion), h, last)


@compiled(inline=True)
def step_tracks(system, work, state, wheels, learnt, change, h, last):
    """Advance the tracks under eight wheels whose wheelsets move by `change`."""
    support = system.support
    row, g = support.row, h / (h + last)
    rails, sleepers = track_rows(system, wheels)
    factors = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2)
    u, rate = load_track(state, rails, sleepers, 0), load_track(state, rails, sleepers, RATE)
    mean = load_track(state, rails, sleepers, MEAN_RATE)
    slower = load_track(state, rails, sleepers, MEAN_CHANGE)
    waits = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PENDING, 1)[0]
    if any_beyond(waits, 0.5):
        rows, thirds = step_rows(wheels)
        r = load_track(work.support_step, rows, thirds, 0)
        weights = pair_starts(wheels, support_begin(system) + WEIGHT, SUPPORT_SIZE, 0)
        c = 1.0 + load_rows(state, weights, 0, 1)[0]
        u, rate = plus_part(u, last * waits, r), plus_part(rate, c * waits, r)
        mean, slower = plus_part(mean, waits, r), plus_part(slower, c / last * waits, r)
    # what is known of -(C u' + K u) after the step
    b = track_forces(support, factors, u, mean, g)
    if not support.massless:
        b = plus_part(b, g, weighed(row, slower))
        b = plus_part(b, (1.0 + g) / h, weighed(row, plus_part(rate, g, mean)))
    own = starts(wheels, SUPPORT_COLUMNS)
    f_y, f_z, k0, k1, k2, k3, k4, k5 = load_rows(work.support, own, 0, 8)
    d0, d1, d2, d3, d4, d5, slip_y, slip_z = load_rows(work.support, own, D, 8)
    y, z, roll, y_rate, z_rate, roll_rate, slip = change
    v_y = y_rate + rate[0] + g * mean[0]
    v_z = z_rate + rate[1] + g * mean[1]
    K, D_ = (k0, k1, k2, k3, k4, k5), (d0, d1, d2, d3, d4, d5)
    k_y, k_z = product(K, y, z, roll)
    d_y, d_z = product(D_, v_y, v_z, roll_rate)
    b = (
        b[0] + f_y + k_y + d_y + slip_y * slip,
        b[1] + f_z + k_z + d_z + slip_z * slip,
        b[2],
        b[3],
        b[4],
    )
    r = solve_track(support, factors, K, D_, b, (1.0 + g) * (1.0 + g) / h, 1.0 + g, h)
    store_rows(state, learnt, L_WAY, (y - h * r[0],))
    weights = pair_starts(wheels, support_begin(system) + WEIGHT, SUPPORT_SIZE, 0)
    store_rows(state, weights, 0, (spread(g),))
    after = combined(1.0 + g, r, -g, mean)
    changed = combined(1.0 / h, after, -1.0 / h, rate)
    store_track(state, rails, sleepers, 0, plus_part(u, h, r))
    store_track(state, rails, sleepers, RATE, after)
    store_track(state, rails, sleepers, MEAN_RATE, r)
    store_track(state, rails, sleepers, MEAN_CHANGE, changed)
    store_track(state, rails, sleepers, ACCELERATION, combined(1.0 + g, changed, -g, slower))


@compiled(inline=True)
def step_rows(wheels):
    """Where the columns of rails and sleepers in `Work.support_step` begin."""
    return (pair_starts(wheels, 0, SUPPORT_STEP, 2), pair_starts(wheels, RAIL_DOF, SUPPORT_STEP, 0))


@compiled(inline=True)
def combined(a, x, b, y):
    """A x + b y of five Lanes each."""
    return (
        a * x[0] + b * y[0],
        a * x[1] + b * y[1],
        a * x[2] + b * y[2],
        a * x[3] + b * y[3],
        a * x[4] + b * y[4],
    )


@compiled(python=False)
def change_forces(system, work, state, wheels, waits, h):
    """Change the forces between wheelsets and rails as moving the rails will, linearly.

    The motion is the mean rate r in ``work.support_step[w, :7]`` over a step `h`, found here from
    the imbalance there: displacements change by h r, rates by c r.  Forces on the wheelset act at
    its contacts; longitudinal creep forces, creepages and patches remain those of the evaluation.
    """
    rows, sleepers = step_rows(wheels)
    own = starts(wheels, SUPPORT_COLUMNS)
    weights = pair_starts(wheels, support_begin(system) + WEIGHT, SUPPORT_SIZE, 0)
    c = 1.0 + load_rows(state, weights, 0, 1)[0]
    stiffness, damping = load_rows(work.support, own, K, 6), load_rows(work.support, own, D, 6)
    factors = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2)
    b = load_track(work.support_step, rows, sleepers, 0)
    r = solve_track(system.support, factors, stiffness, damping, b, c * c / h, c, h)
    store_track(work.support_step, rows, sleepers, 0, r)
    foot_y, foot_z, contact = load_rows(work.support, own, FOOT_Y_STIFFNESS, 3)
    zero = spread(0.0)
    part = where_beyond(contact, 0.0, waits, zero)
    k_y, k_z = product(stiffness, r[0], r[1], zero)
    d_y, d_z = product(damping, r[0], r[1], zero)
    f_y, f_z = -part * (h * k_y + c * d_y), -part * (h * k_z + c * d_z)
    F = load_rows(work.support, own, F_Y, 2)
    store_rows(work.support, own, F_Y, (F[0] + f_y, F[1] + f_z))
    wheel = starts(wheels, WHEEL_COLUMNS)
    Q, Y = load_rows(work.wheel, wheel, W_Q, 2)
    store_rows(work.wheel, wheel, W_Q, (Q + f_z, Y + f_y))
    sine, cosine = load_rows(work.plane, pair_starts(wheels, 0, PLANE_SIZE, 0), SINE, 2)
    y, z = cosine * f_y - sine * f_z, cosine * f_z + sine * f_y
    moment = where_beyond(contact, 0.0, (foot_y * f_z - foot_z * f_y) / contact, zero)
    body = starts(eight_of_pairs(system.contact.body, wheels), RATES_SIZE)
    force = load_rows(work.rail_force, body, 1, 3)
    store_rows(
        work.rail_force,
        body,
        1,
        (
            force[0] - (y + beside(y)),
            force[1] - (z + beside(z)),
            force[2] - (moment + beside(moment)),
        ),
    )


@compiled(python=False)
def correct_support(system, work, state, left):
    """One Newton step for the rails after a step of the fast scheme.

    `step_support` foresees the forces by the slopes of one evaluation.  Where the contact moves
    over a curved profile or begins to slide, the forces in the new position differ from those, and
    without a correction the scheme has order one.  The rails' accelerations of the state are
    those of the forces foreseen, so that the imbalance F - M u'' - C u' - K u is the difference.

    Imbalances up to `SETTLED` of the static wheel load stay.  Up to `BY_SLOPES_Y`, `BY_SLOPES_Z`
    the forces change by their slopes and the rails move before the next step: evaluated again, a
    state has the same forces, whatever shares the call.  Beyond, the rails move at once, and the
    contact of this wheelset is evaluated again; where no evaluation is `left`, the slopes serve
    there, too.  In short steps the shares are less in proportion: what counts is by how much the
    forces lag.

    Returns
    -------
    bool : whether rails have moved, so that the forces are to be evaluated again.
    """
    h, count = state[LAST_STEP], work.support.shape[0]
    share = min(1.0, h / work.watch[WHOLE_TOLERANCE])
    moved = False
    for first in range(0, count, PAIRS):
        wheels = eight_in_pairs(first, count)
        if judge_imbalance(system, work, state, wheels, share, left):
            moved = True
            move_rails(system, work, state, wheels, h, left == MOST_CORRECTIONS)
            for w in range(first, min(first + PAIRS, count)):
                work.events[w, AGAIN] += np.int64(work.support_step[w, MOVED])
    if moved:
        return True
    for first in range(0, count, PAIRS):
        wheels = eight_in_pairs(first, count)
        waits = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PENDING, 1)[0]
        if any_beyond(waits, 0.5):
            change_forces(system, work, state, wheels, waits, h)
    return False


@compiled(inline=True)
def judge_imbalance(system, work, state, wheels, share, left):
    """Store the imbalance of the tracks under eight wheels and what is to be done about it.

    Returns whether any is to be corrected at once: `MOVED`.
    """
    b = imbalance(system, work, state, wheels)
    if not system.support.massless:
        rails, sleepers = track_rows(system, wheels)
        acceleration = load_track(state, rails, sleepers, ACCELERATION)
        b = plus_part(b, -1.0, weighed(system.support.row, acceleration))
    rows, thirds = step_rows(wheels)
    store_track(work.support_step, rows, thirds, 0, b)
    store_rows(work.support, starts(wheels, SUPPORT_COLUMNS), ERROR_Y, (b[0], b[1]))
    zero, one = spread(0.0), spread(1.0)
    load = share * load_rows(system.contact.load, pair_starts(wheels, 0, 1, 0), 0, 1)[0]
    y, z = b[0] / load, b[1] / load
    moves = where_beyond(y, BY_SLOPES_Y, one, where_beyond(z, BY_SLOPES_Z, one, zero))
    if left == 0:
        moves = zero
    moves = larger(moves, beside(moves))
    waits = where_beyond(y, SETTLED, one, where_beyond(z, SETTLED, one, zero))
    waits = larger(waits, beside(waits)) * (one - moves)
    step = pair_starts(wheels, 0, SUPPORT_STEP, 0)
    skip = (one - moves) * (1.0 - work.parts[WHOLE])
    store_rows(work.support_step, step, PENDING, (waits, skip, moves))
    return any_beyond(moves, 0.5)


@compiled(python=False)
def move_rails(system, work, state, wheels, h, begins):
    """Correct the rails of those wheelsets whose forces are to be evaluated again."""
    rails, sleepers = track_rows(system, wheels)
    own, step = starts(wheels, SUPPORT_COLUMNS), pair_starts(wheels, 0, SUPPORT_STEP, 0)
    moves = load_rows(work.support_step, step, MOVED, 1)[0]
    begin = support_begin(system)
    learnt = pair_starts(wheels, begin + LEARNT, SUPPORT_SIZE, LEARNT_SIZE)
    error_y, error_z = load_rows(state, learnt, L_ERROR_Y, 2)
    rows, thirds = step_rows(wheels)
    b = load_track(work.support_step, rows, thirds, 0)
    either = error_y * error_y + error_z * error_z
    free = where_beyond(either, 0.0, spread(0.0), moves)
    store_rows(state, learnt, L_ERROR_Y, (error_y + free * b[0], error_z + free * b[1]))
    y, z = relax_corrections(work, state, wheels, learnt, b[0], b[1], begins)
    c = 1.0 + load_rows(state, pair_starts(wheels, begin + WEIGHT, SUPPORT_SIZE, 0), 0, 1)[0]
    r = solve_track(
        system.support,
        load_rows(work.support_step, step, PADS, 2),
        load_rows(work.support, own, K, 6),
        load_rows(work.support, own, D, 6),
        (y, z, b[2], b[3], b[4]),
        c * c / h,
        c,
        h,
    )
    move_part(state, rails, sleepers, 0, h * moves, r)
    move_part(state, rails, sleepers, RATE, c * moves, r)
    move_part(state, rails, sleepers, MEAN_RATE, moves, r)
    move_part(state, rails, sleepers, MEAN_CHANGE, c / h * moves, r)
    move_part(state, rails, sleepers, ACCELERATION, c * c / h * moves, r)


@compiled(inline=True)
def move_part(state, rails, sleepers, first, factor, r):
    """Add a multiple of the mean rate to the entries of tracks from `first` on."""
    there = load_track(state, rails, sleepers, first)
    store_track(state, rails, sleepers, first, plus_part(there, factor, r))
