"""Moving track model: two rails on pads and a sleeper on ballast under each wheelset.

Degrees of freedom of the track under one wheelset, displacements from the unloaded position in
track axes: y and z of the left and of the right rail head, y, z and roll of the sleeper.  They move
along with the wheelset: no convective terms, no inertia from the track's curvature.
With the forces F = (Y, Q) of the wheels on the rails, pads between rail and sleeper and ballast
between sleeper and ground

    M u'' + C u' + K u = F(q - u, q' - u')

The contact sees wheel minus rail: displacement u beside the rail's irregularity, and the rate u' as
a velocity of the rail's *material*, so that it counts in the creepage (an irregularity's slope does
not).  Rail heads shift and do not turn.  Without masses M = 0, and the equation is one of order
one for u, in which u' is also the slip: `correct_massless_rates` solves for it.

How the fast scheme advances it: `support_step`.

Source of the model: moving track models as of Iwnicki (2006), Handbook of Railway Vehicle Dynamics,
chapter 6; Popp and Schiehlen (2003), System Dynamics and Long-Term Behaviour.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.contact_columns import W_Q, WHEEL_COLUMNS
from railsim.kernels.contact_table import N_PATCH
from railsim.kernels.lanes import (
    any_beyond,
    load_lanes,
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
from railsim.kernels.rails import MOTION_Y, MOTION_Y_RATE, MOTION_Z, MOTION_Z_RATE, PAIRS, SIDES
from railsim.kernels.state import LAST_STEP, contact_begin

# columns of a wheelset's track in the state: u, u', r_0, s_0, u''
RAIL_DOF, DOF = 4, 7
RATE, MEAN_RATE, MEAN_CHANGE, ACCELERATION = DOF, 2 * DOF, 3 * DOF, 4 * DOF
# then the adaptation of the slopes of contact forces at each wheel (least mean squares), see
# `slope_adaptation`: what is added to those of Y and Q over y; y of the last step; error of the
# forces predicted where the rails have moved for it already; set of the patches, in bits
LMS = 5 * DOF
L_Y_Y, L_Z_Y, L_MOTION, L_ERROR_Y, L_ERROR_Z, L_PATCHES = range(6)
LMS_SIZE = 6
# and the weight of the mean rate before the last step, g in `support_step`
STEP_RATIO = LMS + 2 * LMS_SIZE
SUPPORT_SIZE = STEP_RATIO + 1
# entries of a patch and of a wheelset's patches in the state before them, see `transient`
PATCH_STATE = 7
TRACED = 2 * N_PATCH  # patches of a wheel that are followed, of two rails side by side
TRANSIENT_SIZE = 2 * TRACED * PATCH_STATE
# what an evaluation does to the rails: nothing; settles them after a step of the fast scheme, see
# `correct_support`; finds the rates of a massless track, see `correct_massless_rates`
# integers of numpy: a function called with literals of Python is compiled for each value
KEEP_RAILS, CORRECT_RAILS, BALANCE_RATES = map(np.int64, range(3))
# share of the static wheel load by which forces may differ from those predicted; imbalance of a
# massless track (N, N m); evaluations allowed for either
FORCE_TOLERANCE, RATE_TOLERANCE = 2e-4, 1e-2
# share of the static wheel load, lateral and vertical, up to which the forces' slopes say how the
# forces change as the rails are corrected; beyond it the contact is evaluated again
SLOPE_RANGE_Y, SLOPE_RANGE_Z = 4e-3, 2e-2
MAX_CORRECTIONS, MAX_BALANCES = 10, 50
# share of a rail's inertia and pads that a contact may take away laterally: where a patch wanders
# into a flange its force falls as the wheel comes on, and the matrix would become singular
MAX_RELIEF = 0.5

# entries of Support.row: masses, then stiffness and damping of pads and ballast in y, z and roll
(
    M_RAIL,
    M_SLEEPER,
    I_SLEEPER,
    K_PAD_Y,
    C_PAD_Y,
    K_PAD_Z,
    C_PAD_Z,
    K_BALLAST_Y,
    C_BALLAST_Y,
    K_BALLAST_Z,
    C_BALLAST_Z,
    K_BALLAST_ROLL,
    C_BALLAST_ROLL,
    HALF_BASE,
) = range(14)
SUPPORT_ROW = 14

# columns of Work.support[w, side]: forces on the rail; two matrices of two rows (y, z), their
# derivatives by the wheel's y, z and roll and by their rates
F_Y, F_Z, K, D = 0, 1, 2, 8
Y_Y, Y_Z, Z_Y, Z_Z = 0, 1, 3, 4  # entries of such a matrix
# and by a lateral slip that is no motion of wheel or rail, from the wheelset's yaw
D_Y_SLIP, D_Z_SLIP = 14, 15
# position of the contact from the wheelset's centre times its stiffness, and that stiffness
FOOT_Y_STIFFNESS, FOOT_Z_STIFFNESS, STIFFNESS = 16, 17, 18
# set of the patches that carry, in bits; errors of the forces predicted
PATCHES, ERROR_Y, ERROR_Z = 19, 20, 21
SUPPORT_COLUMNS = 24  # whole cache lines
# columns of Work.support_step[w]: 0 to 6 right-hand sides and solution, then the factors of pads
# and ballast
PADS, BALLAST = DOF, DOF + 1
# imbalance of the rails one correction ago, what corrections are multiplied by, and whether one
# is left to the next step
LAST_IMBALANCE, RELAXATION, PENDING = DOF + 2, DOF + 6, DOF + 8
# whether its contact is not to be evaluated again
SKIP = DOF + 9
# whether its rails move at once
URGENT = DOF + 10
# heights of wheels that are not round, left and right, and their rates
HEIGHTS = DOF + 11
SUPPORT_STEP = 24  # whole cache lines
# mass that makes the imbalance of forces on a massless track an acceleration (kg)
REFERENCE_MASS = 100.0


@compiled
def set_factors(variation, s, out):
    """Factors of pads and ballast at arc length `s` into ``out[PADS]``, ``out[BALLAST]``."""
    last = variation.shape[0] - 1
    if s <= variation[0, 0] or last == 0:
        out[PADS], out[BALLAST] = variation[0, 1], variation[0, 2]
        return
    i = 0
    while i < last and s > variation[i + 1, 0]:
        i += 1
    if i == last:
        out[PADS], out[BALLAST] = variation[last, 1], variation[last, 2]
        return
    u = (s - variation[i, 0]) / (variation[i + 1, 0] - variation[i, 0])
    out[PADS] = variation[i, 1] + u * (variation[i + 1, 1] - variation[i, 1])
    out[BALLAST] = variation[i, 2] + u * (variation[i + 1, 2] - variation[i, 2])


@compiled(python=False)
def update_factors(system, work, s):
    """Factors of stiffness and damping under each wheelset, the reference body being at `s`.

    No correction of the rails waits in an evaluation that has only begun.
    """
    for w in range(work.support_step.shape[0]):
        work.support_step[w, PENDING] = 0.0
        work.support_step[w, SKIP] = 0.0
        work.support_step[w, PADS] = 1.0
        work.support_step[w, BALLAST] = 1.0
        if unlikely(system.support.variation.shape[0] > 0):
            f = system.bodies.frame[system.contact.body[w]]
            set_factors(system.support.variation, s + system.frame_offset[f], work.support_step[w])


@compiled(inline=True)
def load_track(state, rails, sleepers, first):
    """Entries from `first` on of tracks: y, z of the rails, then y, z, roll of the sleepers."""
    return load_rows(state, rails, first, 2) + load_rows(state, sleepers, first, 3)


@compiled(inline=True)
def store_track(state, rails, sleepers, first, values):
    """Store what `load_track` loads."""
    store_rows(state, rails, first, values[:2])
    store_rows(state, sleepers, first, values[2:])


@compiled(inline=True)
def track_offsets(system, wheels):
    """Where rails and sleepers of eight wheels begin in the state."""
    first = support_begin(system)
    return (
        pair_starts(wheels, first, SUPPORT_SIZE, 2),
        pair_starts(wheels, first + RAIL_DOF, SUPPORT_SIZE, 0),
    )


@compiled(inline=True)
def track_forces(support, factors, u, rate, g):
    """Forces of pads and ballast on rails and sleepers, g C u' - K u, of `u` and `rate`.

    Both as `load_track` gives them, as is the result; `factors` of pads and ballast.
    """
    row = support.row
    pads, ballast = factors
    arm = row[HALF_BASE] * load_lanes(SIDES, 0)
    y = g * row[C_PAD_Y] * (rate[0] - rate[2]) - row[K_PAD_Y] * (u[0] - u[2])
    z = g * row[C_PAD_Z] * (rate[1] - rate[3] - arm * rate[4])
    z = z - row[K_PAD_Z] * (u[1] - u[3] - arm * u[4])
    y, z = pads * y, pads * z
    if not support.sleeper:
        zero = splat(0.0)
        return y, z, zero, zero, zero
    roll = arm * z
    return (
        y,
        z,
        ballast * (g * row[C_BALLAST_Y] * rate[2] - row[K_BALLAST_Y] * u[2]) - (y + swap_pairs(y)),
        ballast * (g * row[C_BALLAST_Z] * rate[3] - row[K_BALLAST_Z] * u[3]) - (z + swap_pairs(z)),
        ballast * (g * row[C_BALLAST_ROLL] * rate[4] - row[K_BALLAST_ROLL] * u[4])
        - (roll + swap_pairs(roll)),
    )


@compiled(inline=True)
def contact_force(matrix, y, z, roll):
    """Matrix K or D of a contact times a motion of the wheel against the rail: forces (Y, Q)."""
    return (
        matrix[0] * y + matrix[1] * z + matrix[2] * roll,
        matrix[3] * y + matrix[4] * z + matrix[5] * roll,
    )


@compiled(inline=True)
def solve_track(support, factors, K, D, b, m, c, k):
    """Solve (m M + c (C + D) + k (K + K_c)) x = b for the tracks of four wheelsets.

    Of K_c the derivative of Y over y is limited, see `MAX_RELIEF`.

    The rails are eliminated side by side; what is left is 3 by 3, worked out in both lanes of a
    wheelset.

    Parameters
    ----------
    factors : two Lanes
        Of pads and ballast.
    K, D : six Lanes
        Stiffness and damping of the contact as seen by the rail, see `Work.support`.
    b : five Lanes
        y, z of the rails, then y, z and roll of the sleepers; x likewise.
    """
    row = support.row
    pads, ballast = factors
    base, rail = row[HALF_BASE], m * row[M_RAIL]
    arm = base * load_lanes(SIDES, 0)
    a_y = pads * (c * row[C_PAD_Y] + k * row[K_PAD_Y])
    a_z = pads * (c * row[C_PAD_Z] + k * row[K_PAD_Z])
    p = rail + a_y + c * D[0] + maximum(k * K[0], -MAX_RELIEF * (rail + a_y))
    q = c * D[1] + k * K[1]
    r = c * D[3] + k * K[3]
    t = rail + a_z + c * D[4] + k * K[4]
    inverse = 1.0 / (p * t - q * r)
    x_y, x_z = inverse * (t * b[0] - q * b[1]), inverse * (p * b[1] - r * b[0])
    if not support.sleeper:
        zero = splat(0.0)
        return x_y, x_z, zero, zero, zero
    sleeper = m * row[M_SLEEPER]
    # pad and contact in series
    yy, yz = a_y - a_y * a_y * t * inverse, a_y * a_z * q * inverse
    zy, zz = a_y * a_z * r * inverse, a_z - a_z * a_z * p * inverse
    yr, zr, ry = arm * yz, arm * zz, arm * zy
    b_y, b_z, b_r = a_y * x_y, a_z * x_z, arm * a_z * x_z
    b_y, b_z, b_r = (
        b[2] + (b_y + swap_pairs(b_y)),
        b[3] + (b_z + swap_pairs(b_z)),
        b[4] + (b_r + swap_pairs(b_r)),
    )
    s_rr = m * row[I_SLEEPER] + ballast * (c * row[C_BALLAST_ROLL] + k * row[K_BALLAST_ROLL])
    s_rr = s_rr + base * base * (zz + swap_pairs(zz))
    s_yy = sleeper + ballast * (c * row[C_BALLAST_Y] + k * row[K_BALLAST_Y]) + (yy + swap_pairs(yy))
    s_zz = sleeper + ballast * (c * row[C_BALLAST_Z] + k * row[K_BALLAST_Z]) + (zz + swap_pairs(zz))
    s_yz, s_zy, s_yr = yz + swap_pairs(yz), zy + swap_pairs(zy), yr + swap_pairs(yr)
    s_zr, s_ry = zr + swap_pairs(zr), ry + swap_pairs(ry)
    # the matrix is far from singular: ballast on its diagonal
    f = s_zy / s_yy
    s_rz = s_zr
    s_zz, s_zr, b_z = s_zz - f * s_yz, s_zr - f * s_yr, b_z - f * b_y
    f = s_ry / s_yy
    s_rz, s_rr, b_r = s_rz - f * s_yz, s_rr - f * s_yr, b_r - f * b_y
    f = s_rz / s_zz
    roll = (b_r - f * b_z) / (s_rr - f * s_zr)
    z = (b_z - s_zr * roll) / s_zz
    y = (b_y - s_yz * z - s_yr * roll) / s_yy
    f_y, f_z = a_y * y, a_z * (z + arm * roll)
    return (x_y + inverse * (t * f_y - q * f_z), x_z + inverse * (p * f_z - r * f_y), y, z, roll)


@compiled(inline=True)
def mass_of(row, k):
    """Mass or moment of inertia of degree of freedom `k`."""
    if k < RAIL_DOF:
        return row[M_RAIL]
    return row[M_SLEEPER] if k < DOF - 1 else row[I_SLEEPER]


@compiled(inline=True)
def inertia(row, x):
    """Masses times accelerations of rails and sleepers."""
    return (
        row[M_RAIL] * x[0],
        row[M_RAIL] * x[1],
        row[M_SLEEPER] * x[2],
        row[M_SLEEPER] * x[3],
        row[I_SLEEPER] * x[4],
    )


@compiled(inline=True)
def imbalance(system, work, state, wheels):
    """F - C u' - K u of the tracks under eight wheels, as `load_track` gives displacements."""
    rails, sleepers = track_offsets(system, wheels)
    factors = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2)
    u, rate = load_track(state, rails, sleepers, 0), load_track(state, rails, sleepers, RATE)
    y, z, s_y, s_z, s_r = track_forces(system.support, factors, u, rate, -1.0)
    f_y, f_z = load_rows(work.support, row_starts(wheels, SUPPORT_COLUMNS), F_Y, 2)
    return f_y + y, f_z + z, s_y, s_z, s_r


@compiled(inline=True)
def transient_begin(system):
    """Index of the first wheelset's patches in the state."""
    return contact_begin(system.bodies.kind.shape[0], system.internal.kind.shape[0])


@compiled(inline=True)
def support_begin(system):
    """Index of the first wheelset's track in the state."""
    contact = system.contact
    return transient_begin(system) + TRANSIENT_SIZE * contact.transient * contact.body.shape[0]


@compiled(python=False)
def set_support_rates(system, work, state, derivative):
    """Rates of the track's displacements and of their rates.

    Of a massless track the latter is the imbalance of forces over `REFERENCE_MASS`, zero once
    `correct_massless_rates` has found the rates.
    """
    support = system.support
    if not support.elastic:
        return
    row, count = support.row, work.support.shape[0]
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        rails, sleepers = track_offsets(system, wheels)
        store_track(derivative, rails, sleepers, RATE, imbalance(system, work, state, wheels))
    for w in range(count):
        first = support_begin(system) + SUPPORT_SIZE * w
        for k in range(DOF):
            mass = REFERENCE_MASS if support.massless else mass_of(row, k)
            moves = k < RAIL_DOF or support.sleeper
            derivative[first + k] = state[first + RATE + k] if moves else 0.0
            derivative[first + RATE + k] = derivative[first + RATE + k] / mass if moves else 0.0


@compiled(python=False)
def correct_massless_rates(system, work, state):
    """One Newton step for the rates of a massless track, with the forces just evaluated.

    The slopes are those of `Work.support`, an estimate for the creep forces.  A wheelset whose
    forces balance to `RATE_TOLERANCE` is not changed: it does not depend on the others.

    Returns
    -------
    bool : whether rates changed, so that the forces are to be evaluated again.
    """
    changed, count = False, work.support.shape[0]
    zero, one = splat(0.0), splat(1.0)
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        rails, sleepers = track_offsets(system, wheels)
        b = imbalance(system, work, state, wheels)
        largest = maximum(b[0] * b[0], b[1] * b[1])
        largest = maximum(maximum(largest, swap_pairs(largest)), maximum(b[2] * b[2], b[3] * b[3]))
        largest = maximum(largest, b[4] * b[4])
        if not any_beyond(largest, RATE_TOLERANCE * RATE_TOLERANCE):
            continue
        changed = True
        largest = where_beyond(largest, RATE_TOLERANCE * RATE_TOLERANCE, one, zero)
        x = solve_track(
            system.support,
            load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), PADS, 2),
            load_rows(work.support, row_starts(wheels, SUPPORT_COLUMNS), K, 6),
            load_rows(work.support, row_starts(wheels, SUPPORT_COLUMNS), D, 6),
            b,
            0.0,
            1.0,
            0.0,
        )
        u = load_track(state, rails, sleepers, RATE)
        store_track(state, rails, sleepers, RATE, plus_scaled(u, largest, x))
    return changed


@compiled(inline=True)
def plus_scaled(u, factor, x):
    """Five Lanes u plus a part of five others."""
    return (
        u[0] + factor * x[0],
        u[1] + factor * x[1],
        u[2] + factor * x[2],
        u[3] + factor * x[3],
        u[4] + factor * x[4],
    )


@compiled(python=False)
def set_rail_motions(system, work, state):
    """Displacements and velocities of the rails for `rails`."""
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        for side in range(2):
            i = first + 2 * side
            work.rail_motion[w, side, MOTION_Y] = state[i]
            work.rail_motion[w, side, MOTION_Z] = state[i + 1]
            work.rail_motion[w, side, MOTION_Y_RATE] = state[i + RATE]
            work.rail_motion[w, side, MOTION_Z_RATE] = state[i + RATE + 1]


@compiled(python=False)
def add_lms_slopes(system, work, state):
    """Forces on the rails; add to their slopes the adaptation made at the same set of patches."""
    count, begin = work.support.shape[0], support_begin(system) + LMS
    zero, one = splat(0.0), splat(1.0)
    for first in range(0, count, PAIRS):
        wheels = paired_numbers(first, count)
        rows = row_starts(wheels, SUPPORT_COLUMNS)
        y_y, z_y, _, _, _, patches_0 = load_rows(
            state, pair_starts(wheels, begin, SUPPORT_SIZE, LMS_SIZE), 0, LMS_SIZE
        )
        patches = load_rows(work.support, rows, PATCHES, 1)[0]
        skip = load_rows(work.support_step, pair_starts(wheels, 0, SUPPORT_STEP, 0), SKIP, 1)[0]
        _, _, k0, k1, k2, k3, k4, k5 = load_rows(work.support, rows, 0, 8)
        Q, Y = load_rows(work.wheel, row_starts(wheels, WHEEL_COLUMNS), W_Q, 2)
        take = where_beyond(patches - patches_0, 0.0, zero, one - skip)
        store_rows(work.support, rows, 0, (Y, Q, k0 + take * y_y, k1, k2, k3 + take * z_y, k4, k5))


@compiled(python=False)
def set_compliance(system, work, state):
    """Velocity that a force at the contact adds to a rail after the last step, see `step_support`.

    From (M c^2/h + c C + h K) r = F and u' = c r, c = 1 + g: 1/(c m/h + C + h K/c) of the rail on
    its pads, in series with that of half of the sleeper below: both rails yield alike.  Of
    `Work.compliance` lateral and vertical, and the time h/c in which a contact's stiffness counts
    as damping; zeros where no step has been taken.
    """
    row, h, out = system.support.row, abs(state[LAST_STEP]), work.compliance
    if h == 0.0:
        out[0] = out[1] = out[2] = 0.0
        return
    lag = h / (1.0 + state[support_begin(system) + STEP_RATIO])
    mass, sleeper = row[M_RAIL] / lag, row[M_SLEEPER] / lag
    out[0] = 1.0 / (mass + row[C_PAD_Y] + lag * row[K_PAD_Y])
    out[1] = 1.0 / (mass + row[C_PAD_Z] + lag * row[K_PAD_Z])
    out[2] = lag
    if system.support.sleeper:
        out[0] += 2.0 / (sleeper + row[C_BALLAST_Y] + lag * row[K_BALLAST_Y])
        out[1] += 2.0 / (sleeper + row[C_BALLAST_Z] + lag * row[K_BALLAST_Z])


@compiled(python=False)
def allowed_evaluations(system, state, rail_mode):
    """How often contact forces may be evaluated again for the rails, by `rail_mode`."""
    if rail_mode == CORRECT_RAILS and system.support.elastic and state[LAST_STEP] > 0.0:
        return MAX_CORRECTIONS  # a step has been taken
    if rail_mode == BALANCE_RATES and system.support.elastic and system.support.massless:
        return MAX_BALANCES
    return 0
