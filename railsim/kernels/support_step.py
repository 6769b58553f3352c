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

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rails import (
    ASIDE,
    COSINE,
    MIDDLE_Y,
    MIDDLE_Z,
    RAIL_SLOPE,
    ROLL,
    ROLL_SLOPE,
    SINE,
    SLOPE_Z,
    locate_displaced,
)
from railsim.kernels.support import (
    ACCELERATION,
    BEFORE,
    BY_SLOPES_Y,
    BY_SLOPES_Z,
    C_PAD_Y,
    C_PAD_Z,
    D_Y_SLIP,
    D_Z_SLIP,
    DOF,
    ERROR_Y,
    ERROR_Z,
    F_Y,
    F_Z,
    FOOT_Y_STIFFNESS,
    FOOT_Z_STIFFNESS,
    HEIGHTS,
    K_PAD_Y,
    K_PAD_Z,
    L_ERROR_Y,
    L_ERROR_Z,
    L_PATCHES,
    L_SLIP,
    L_WAY,
    L_Y_SLIP,
    L_Y_Y,
    L_Z_SLIP,
    L_Z_Y,
    LEARNT,
    LEARNT_SIZE,
    M_RAIL,
    MEAN_CHANGE,
    MEAN_RATE,
    MOST_CORRECTIONS,
    MOTION,
    PATCHES,
    PENDING,
    RATE,
    RELAXATION,
    SETTLED,
    SKIP,
    STIFFNESS,
    SUPPORT_SIZE,
    WEIGHT,
    D,
    K,
    imbalance,
    mass_of,
    product,
    solve_track,
    support_begin,
    track_forces,
)
from railsim.kernels.system import AGAIN, ARC_LENGTH, LAST_STEP, SPEED, WHOLE, WHOLE_TOLERANCE, Z_0
from railsim.kernels.track_frame import cell_of
from railsim.kernels.wheel_surface import foreseen_heights

# `learn`: scales of way and slip [m, m/s] in a step of this length [s]; share of an error that is
# learnt, what is added to the squares of way and slip, what a step forgets; share of the static
# wheel load from which on an error is large
WAY, SLIP, WHOLE_STEP = 5e-6, 2.5e-3, 1.25e-3
GAIN, REST, FORGOTTEN = 0.3, 0.05, 0.01
LARGE_Y, LARGE_Z = 0.1, 0.3
# bounds of what slopes learn [N/m, N s/m]: a rail stays damped
LEAST_K, MOST_K, MOST_D = -2e7, 3e8, 3e5


@compiled(inline=True)
def step_compliance(support, h, out):
    """Velocity of a rail per force over a step `h`, lateral and vertical, the sleeper held."""
    row = support.row
    mass = 2.25 / h * row[M_RAIL]
    out[0] = 1.0 / (mass + 1.5 * row[C_PAD_Y] + h * row[K_PAD_Y])
    out[1] = 1.0 / (mass + 1.5 * row[C_PAD_Z] + h * row[K_PAD_Z])


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


@compiled(python=False)
def note_wheelsets(system, work, state):
    """Store the positions of the wheelsets in the planes of their rails before a step.

    Slopes learn from the forces found, and rails whose correction has waited for the step move, see
    `correct_support`.
    """
    for w in range(work.support.shape[0]):
        track = work.support_step[w]
        first = support_begin(system) + SUPPORT_SIZE * w
        learn(work, state, first + LEARNT, w, system.contact.load[w], abs(state[LAST_STEP]))
        if track[PENDING] > 0.0:
            move_rails(track, state, first, state[LAST_STEP])
            track[PENDING] = 0.0
        note_wheelset(system, work, state, w)


@compiled(python=False)
def note_wheelset(system, work, state, w):
    """Motion of a wheelset in the plane of its rails into its row of `work.support_step`.

    Lateral and vertical position, roll and their rates, displacements of the rails.  The
    lateral rate is that of the material (slip); to first order in the roll of the plane.
    """
    n = system.bodies.kind.shape[0]
    b = system.contact.body[w]
    track, plane, speed = work.support_step[w], work.plane, state[SPEED]
    height = system.bodies.row[b, Z_0]
    q = 6 * b
    v = 6 * n + q
    turn = speed * plane[w, ROLL_SLOPE]
    track[MOTION] = state[q + 1] - plane[w, MIDDLE_Y] + height * plane[w, ROLL]
    track[MOTION + 1] = state[q + 2] - plane[w, MIDDLE_Z]
    track[MOTION + 2] = state[q + 3] - plane[w, ROLL]
    track[MOTION + 3] = state[v + 1] + height * turn
    track[MOTION + 4] = state[v + 2] - speed * plane[w, SLOPE_Z]
    track[MOTION + 5] = state[v + 3] - turn
    track[MOTION + 6] = work.rail[w, 0, ASIDE]
    track[MOTION + 7] = work.rail[w, 1, ASIDE]
    track[MOTION + 8] = speed * (work.rail[w, 0, RAIL_SLOPE] - state[q + 5])
    track[MOTION + 9] = speed * (work.rail[w, 1, RAIL_SLOPE] - state[q + 5])
    if system.contact.surface_of.shape[0] > 0:
        foreseen_heights(system, work, state, w, track, HEIGHTS)


@compiled(python=False)
def step_support(system, work, state, h, last):
    """Advance the track under all wheelsets by `h`, with bodies, position and speed after it.

    `last`: length of the step before.
    """
    support = system.support
    row, before = support.row, work.above
    g = h / (h + last)
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        b = system.contact.body[w]
        track = work.support_step[w]
        for k in range(10):
            before[k] = track[MOTION + k]
        heights = track[HEIGHTS], track[HEIGHTS + 1], track[HEIGHTS + 2], track[HEIGHTS + 3]
        if system.track.has_irregularity:
            f = system.bodies.frame[b]
            cell, cell_u = cell_of(system.track, state[ARC_LENGTH] + system.frame_offset[f])
            if cell >= 0:
                locate_displaced(system.track.rail, cell, cell_u, w, work.plane, work.rail)
        note_wheelset(system, work, state, w)
        z, roll = track[MOTION + 1] - before[1], track[MOTION + 2] - before[2]
        y_rate, z_rate = track[MOTION + 3] - before[3], track[MOTION + 4] - before[4]
        roll_rate = track[MOTION + 5] - before[5]
        for k in range(DOF):
            track[k] = 0.0
        # what is known of -(C u' + K u) after the step
        track_forces(support, track, state, first, 1.0, 0.0, track, -1.0)
        track_forces(support, track, state, first + MEAN_RATE, 0.0, 1.0, track, g)
        for k in range(DOF):
            track[k] += mass_of(row, k) * (
                (1.0 + g) / h * (state[first + RATE + k] + g * state[first + MEAN_RATE + k])
                + g * state[first + MEAN_CHANGE + k]
            )
        for side in range(2):
            contact = work.support[w, side]
            i = first + 2 * side
            y = track[MOTION] - before[0] - (track[MOTION + 6 + side] - before[6 + side])
            slip = track[MOTION + 8 + side] - before[8 + side]
            v_y = y_rate + state[i + RATE] + g * state[i + MEAN_RATE]
            v_z = z_rate + state[i + RATE + 1] + g * state[i + MEAN_RATE + 1]
            v_z += track[HEIGHTS + 2 + side] - heights[2 + side]
            k_y, k_z = product(contact, K, y, z + track[HEIGHTS + side] - heights[side], roll)
            d_y, d_z = product(contact, D, v_y, v_z, roll_rate)
            track[2 * side] += contact[F_Y] + k_y + d_y + contact[D_Y_SLIP] * slip
            track[2 * side + 1] += contact[F_Z] + k_z + d_z + contact[D_Z_SLIP] * slip
            learnt = first + LEARNT + LEARNT_SIZE * side
            state[learnt + L_WAY] = y
            state[learnt + L_SLIP] = v_y + slip
        state[first + WEIGHT] = g
        solve_track(support, track, work.support[w], (1.0 + g) * (1.0 + g) / h, 1.0 + g, h)
        for side in range(2):
            learnt = first + LEARNT + LEARNT_SIZE * side
            state[learnt + L_WAY] -= h * track[2 * side]
            state[learnt + L_SLIP] -= (1.0 + g) * track[2 * side]
        for k in range(DOF):
            rate = (1.0 + g) * track[k] - g * state[first + MEAN_RATE + k]
            state[first + k] += h * track[k]
            change = (rate - state[first + RATE + k]) / h
            state[first + ACCELERATION + k] = (1.0 + g) * change - g * state[
                first + MEAN_CHANGE + k
            ]
            state[first + MEAN_CHANGE + k] = change
            state[first + RATE + k] = rate
            state[first + MEAN_RATE + k] = track[k]


@compiled(python=False)
def learn(work, state, first, w, load, h):
    """Take the errors of the forces foreseen in the last step into the slopes at both wheels.

    Normalised least mean squares (Widrow and Hoff 1960): of an error e with the way y and the slip
    v of the step, in units of `WAY` and `SLIP` at 1.25 ms, the slopes take gain e y/(y^2 + v^2 +
    rest).  They are forgotten slowly, and at once where the set of patches changes, a wheel lifts
    or the error is large: there the contact is another one.
    """
    share = h / WHOLE_STEP if h > 0.0 else 1.0
    per_way, per_slip = 1.0 / (WAY * share), 1.0 / (SLIP * share)
    for side in range(2):
        contact = work.support[w, side]
        i = first + LEARNT_SIZE * side
        # the first error of the step, also where rails have moved for it at once
        d_y, d_z = state[i + L_ERROR_Y], state[i + L_ERROR_Z]
        if d_y == 0.0 and d_z == 0.0:
            d_y, d_z = contact[ERROR_Y], contact[ERROR_Z]
        y, v = per_way * state[i + L_WAY], per_slip * state[i + L_SLIP]
        keep, gain = 1.0 - FORGOTTEN * share, GAIN / (y * y + v * v + REST)
        patches = contact[PATCHES]
        another = patches == 0.0 or patches != state[i + L_PATCHES]
        if another or abs(d_y) > LARGE_Y * load or abs(d_z) > LARGE_Z * load:
            keep, gain = 0.0, 0.0
        y, v = gain * per_way * y, gain * per_slip * v
        state[i + L_Y_Y] = bounded(keep * state[i + L_Y_Y] + d_y * y, LEAST_K, MOST_K)
        state[i + L_Z_Y] = bounded(keep * state[i + L_Z_Y] + d_z * y, -MOST_K, MOST_K)
        state[i + L_Y_SLIP] = bounded(keep * state[i + L_Y_SLIP] + d_y * v, -MOST_D, MOST_D)
        state[i + L_Z_SLIP] = bounded(keep * state[i + L_Z_SLIP] + d_z * v, -MOST_D, MOST_D)
        state[i + L_ERROR_Y] = state[i + L_ERROR_Z] = 0.0
        state[i + L_PATCHES] = patches


@compiled(inline=True)
def bounded(value, least, most):
    """The value, not beyond its bounds."""
    return min(most, max(least, value))


@compiled(python=False)
def relax_correction(track, i, relaxation):
    """Multiply the imbalance of one rail so that the next correction does what the last missed.

    The relaxation of Irons and Tuck (1969) after Aitken: of the part of the slopes' error that
    dominates, convergence as with the secant.  A factor of zero asks for the first one.
    """
    y, z = track[i], track[i + 1]
    if track[relaxation] == 0.0:
        track[relaxation] = 1.0
    else:
        d_y, d_z = y - track[BEFORE + i], z - track[BEFORE + i + 1]
        square = d_y * d_y + d_z * d_z
        if square > 0.0:
            share = -(track[BEFORE + i] * d_y + track[BEFORE + i + 1] * d_z) / square
            track[relaxation] = min(3.0, max(0.3, share * track[relaxation]))
    track[BEFORE + i], track[BEFORE + i + 1] = y, z
    track[i], track[i + 1] = track[relaxation] * y, track[relaxation] * z


@compiled(python=False)
def change_forces(system, work, w, h, c):
    """Change the forces between wheelset `w` and its rails as moving the rails does, linearly.

    The motion is the mean rate r in ``work.support_step[w, :4]`` over a step `h`: displacements
    change by h r, rates by c r.  Forces on the wheelset act at its contacts; longitudinal creep
    forces, creepages and patches remain those of the evaluation.
    """
    b = system.contact.body[w]
    track, force = work.support_step[w], work.rail_force
    sine, cosine = work.plane[w, SINE], work.plane[w, COSINE]
    for side in range(2):
        contact = work.support[w, side]
        if contact[STIFFNESS] <= 0.0:
            continue
        r_y, r_z = track[2 * side], track[2 * side + 1]
        k_y, k_z = product(contact, K, -h * r_y, -h * r_z, 0.0)
        d_y, d_z = product(contact, D, -c * r_y, -c * r_z, 0.0)
        f_y, f_z = k_y + d_y, k_z + d_z
        contact[F_Y] += f_y
        contact[F_Z] += f_z
        work.wheel[w, side, W_Y] += f_y
        work.wheel[w, side, W_Q] += f_z
        moment = contact[FOOT_Y_STIFFNESS] * f_z - contact[FOOT_Z_STIFFNESS] * f_y
        force[b, 1] -= cosine * f_y - sine * f_z
        force[b, 2] -= cosine * f_z + sine * f_y
        force[b, 3] -= moment / contact[STIFFNESS]


@compiled(python=False)
def move_rails(track, state, first, h):
    """Add the mean rate in ``track[:7]`` over a step `h` to the motion that led to `state`."""
    c = 1.0 + state[first + WEIGHT]
    for k in range(DOF):
        r = track[k]
        state[first + k] += h * r
        state[first + RATE + k] += c * r
        state[first + MEAN_RATE + k] += r
        state[first + MEAN_CHANGE + k] += c / h * r
        state[first + ACCELERATION + k] += c * c / h * r


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
    h = state[LAST_STEP]
    share = min(1.0, h / work.watch[WHOLE_TOLERANCE])
    moved = False
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        track, contact = work.support_step[w], work.support[w]
        if track[SKIP] > 0.0:
            continue
        imbalance(system, work, state, w)
        if left == MOST_CORRECTIONS:
            track[RELAXATION] = track[RELAXATION + 1] = 0.0
        for k in range(DOF):
            track[k] -= mass_of(system.support.row, k) * state[first + ACCELERATION + k]
        for side in range(2):
            contact[side, ERROR_Y] = track[2 * side]
            contact[side, ERROR_Z] = track[2 * side + 1]
        y, z = max(abs(track[0]), abs(track[2])), max(abs(track[1]), abs(track[3]))
        load = share * system.contact.load[w]
        small = left == 0 or (y < BY_SLOPES_Y * load and z < BY_SLOPES_Z * load)
        track[PENDING] = 1.0 if small and max(y, z) >= SETTLED * load else 0.0
        if small:
            track[SKIP] = 1.0 - work.parts[WHOLE]
            continue
        moved = True
        work.events[w, AGAIN] += 1
        for side in range(2):
            i = first + LEARNT + LEARNT_SIZE * side
            if state[i + L_ERROR_Y] == 0.0 and state[i + L_ERROR_Z] == 0.0:
                state[i + L_ERROR_Y] = contact[side, ERROR_Y]
                state[i + L_ERROR_Z] = contact[side, ERROR_Z]
            relax_correction(track, 2 * side, RELAXATION + side)
        c = 1.0 + state[first + WEIGHT]
        solve_track(system.support, track, work.support[w], c * c / h, c, h)
        move_rails(track, state, first, h)
    if moved:
        return True
    for w in range(work.support.shape[0]):
        track = work.support_step[w]
        if track[PENDING] > 0.0:
            c = 1.0 + state[support_begin(system) + SUPPORT_SIZE * w + WEIGHT]
            solve_track(system.support, track, work.support[w], c * c / h, c, h)
            change_forces(system, work, w, h, c)
    return False
