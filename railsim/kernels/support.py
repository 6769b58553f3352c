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
one for u, in which u' is also the slip: `settle_rates` solves for it.

How the fast scheme advances it: `support_step`.

Source of the model: moving track models as of Iwnicki (2006), Handbook of Railway Vehicle Dynamics,
chapter 6; Popp and Schiehlen (2003), System Dynamics and Long-Term Behaviour.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rails import MOTION_Y, MOTION_Y_RATE, MOTION_Z, MOTION_Z_RATE
from railsim.kernels.system import LAST_STEP

# columns of a wheelset's track in the state: u, u', r_0, s_0, u''
RAIL_DOF, DOF = 4, 7
RATE, MEAN_RATE, MEAN_CHANGE, ACCELERATION = DOF, 2 * DOF, 3 * DOF, 4 * DOF
# then what the slopes of the contact forces have learnt at each wheel, see `learn`: what is added
# to those of Y and Q over y and over the lateral slip; y and slip of the last step; error of the
# forces foreseen where the rails have moved for it already; set of the patches, in bits
LEARNT = 5 * DOF
L_Y_Y, L_Z_Y, L_Y_SLIP, L_Z_SLIP, L_WAY, L_SLIP, L_ERROR_Y, L_ERROR_Z, L_PATCHES = range(9)
LEARNT_SIZE = 9
# and the weight of the mean rate before the last step, g in `support_step`
WEIGHT = LEARNT + 2 * LEARNT_SIZE
SUPPORT_SIZE = WEIGHT + 1
# what an evaluation does to the rails: nothing; settles them after a step of the fast scheme, see
# `correct_support`; finds the rates of a massless track, see `settle_rates`
# integers of numpy: a function called with literals of Python is compiled for each value
AS_GIVEN, AFTER_STEP, BALANCED = map(np.int64, range(3))
# share of the static wheel load by which forces may differ from those foreseen; imbalance of a
# massless track (N, N m); evaluations allowed for either
SETTLED, BALANCE = 2e-4, 1e-2
# share of the static wheel load, lateral and vertical, up to which the forces' slopes say how the
# forces change as the rails are corrected; beyond it the contact is evaluated again
BY_SLOPES_Y, BY_SLOPES_Z = 2e-3, 2e-2
MOST_CORRECTIONS, MOST_BALANCES = 10, 50

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
# set of the patches that carry, in bits; errors of the forces foreseen
PATCHES, ERROR_Y, ERROR_Z = 19, 20, 21
SUPPORT_COLUMNS = 24  # whole cache lines
# columns of Work.support_step[w]: 0 to 6 right-hand sides and solution, then the wheelset's motion
# before the step, see `note_wheelset`, and the factors of pads and ballast
MOTION, PADS, BALLAST = DOF, DOF + 11, DOF + 12
# imbalance of the rails one correction ago, what corrections are multiplied by, and whether one
# is left to the next step
BEFORE, RELAXATION, PENDING = DOF + 13, DOF + 17, DOF + 19
# whether its contact is not to be evaluated again
SKIP = DOF + 20
# heights of wheels that are not round, left and right, and their rates
HEIGHTS = DOF + 21
SUPPORT_STEP = 32
# share of the creep law's slope that what is learnt may take away: a rail stays damped
LEAST_SHARE = 0.8
# mass that makes the imbalance of forces on a massless track an acceleration (kg)
REFERENCE_MASS = 100.0


@compiled
def factors(variation, s, out):
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
def locate_support(system, work, s):
    """Factors of stiffness and damping under each wheelset, the reference body being at `s`.

    No correction of the rails waits in an evaluation that has only begun.
    """
    for w in range(work.support_step.shape[0]):
        work.support_step[w, PENDING] = 0.0
        work.support_step[w, SKIP] = 0.0
        work.support_step[w, PADS] = 1.0
        work.support_step[w, BALLAST] = 1.0
        if system.support.variation.shape[0] > 0:
            f = system.bodies.frame[system.contact.body[w]]
            factors(system.support.variation, s + system.frame_offset[f], work.support_step[w])


@compiled(python=False)
def track_forces(support, track, u, first, k, c, out, sign):
    """Add `sign` times the forces of pads and ballast, k K x + c C x with x at ``u[first:]``.

    Parameters
    ----------
    track : float64[SUPPORT_STEP]
        For the factors of pads and ballast.
    out : float64[...]
        Its first 7 entries take the forces on the degrees of freedom, resistance positive.
    """
    row = support.row
    base = row[HALF_BASE]
    y, z, roll = 0.0, 0.0, 0.0
    for side in range(2):
        arm = (2.0 * side - 1.0) * base
        i = first + 2 * side
        f_y = (u[i] - u[first + 4]) * sign * track[PADS] * (k * row[K_PAD_Y] + c * row[C_PAD_Y])
        f_z = (
            (u[i + 1] - u[first + 5] - arm * u[first + 6])
            * sign
            * track[PADS]
            * (k * row[K_PAD_Z] + c * row[C_PAD_Z])
        )
        out[2 * side] += f_y
        out[2 * side + 1] += f_z
        y += f_y
        z += f_z
        roll += arm * f_z
    if support.sleeper:
        much = sign * track[BALLAST]
        out[4] += much * (k * row[K_BALLAST_Y] + c * row[C_BALLAST_Y]) * u[first + 4] - y
        out[5] += much * (k * row[K_BALLAST_Z] + c * row[C_BALLAST_Z]) * u[first + 5] - z
        out[6] += much * (k * row[K_BALLAST_ROLL] + c * row[C_BALLAST_ROLL]) * u[first + 6] - roll


@compiled(inline=True)
def product(contact, matrix, y, z, roll):
    """Matrix K or D of a contact times a motion of the wheel against the rail: forces (Y, Q)."""
    m = matrix
    return (
        contact[m] * y + contact[m + 1] * z + contact[m + 2] * roll,
        contact[m + 3] * y + contact[m + 4] * z + contact[m + 5] * roll,
    )


@compiled(inline=True)
def rail_matrix(contact, y, z, c, k):
    """Matrix of a rail's y and z, row by row, c D + k K with `y` and `z` on its diagonal; 1/det."""
    p = y + c * contact[D + Y_Y] + k * contact[K + Y_Y]
    q = c * contact[D + Y_Z] + k * contact[K + Y_Z]
    r = c * contact[D + Z_Y] + k * contact[K + Z_Y]
    t = z + c * contact[D + Z_Z] + k * contact[K + Z_Z]
    return p, q, r, t, 1.0 / (p * t - q * r)


@compiled(python=False)
def solve_track(support, track, side, m, c, k):
    """Solve (m M + c (C + D) + k (K + K_c)) x = b for one wheelset's track.

    The rails are eliminated side by side; what is left is 3 by 3.  D and K_c: damping and stiffness
    of the contacts as seen by the rails.

    Parameters
    ----------
    track : float64[SUPPORT_STEP]
        b in its first 7 entries on entry, x on return.
    side : float64[2, SUPPORT_COLUMNS]
        See `Work.support`.
    """
    row = support.row
    base, rail = row[HALF_BASE], m * row[M_RAIL]
    a_y = track[PADS] * (c * row[C_PAD_Y] + k * row[K_PAD_Y])
    a_z = track[PADS] * (c * row[C_PAD_Z] + k * row[K_PAD_Z])
    much = track[BALLAST]
    s_yy = m * row[M_SLEEPER] + much * (c * row[C_BALLAST_Y] + k * row[K_BALLAST_Y])
    s_zz = m * row[M_SLEEPER] + much * (c * row[C_BALLAST_Z] + k * row[K_BALLAST_Z])
    s_rr = m * row[I_SLEEPER] + much * (c * row[C_BALLAST_ROLL] + k * row[K_BALLAST_ROLL])
    s_yz, s_yr, s_zy, s_zr, s_ry, s_rz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    b_y, b_z, b_r = track[4], track[5], track[6]
    for i in range(2):
        arm = (2.0 * i - 1.0) * base
        p, q, r, t, inverse = rail_matrix(side[i], rail + a_y, rail + a_z, c, k)
        x_y = inverse * (t * track[2 * i] - q * track[2 * i + 1])
        x_z = inverse * (p * track[2 * i + 1] - r * track[2 * i])
        track[2 * i], track[2 * i + 1] = x_y, x_z
        if support.sleeper:
            b_y += a_y * x_y
            b_z += a_z * x_z
            b_r += arm * a_z * x_z
            # pad and contact in series
            e_yy = a_y - a_y * a_y * t * inverse
            e_zz = a_z - a_z * a_z * p * inverse
            e_yz = a_y * a_z * q * inverse
            e_zy = a_y * a_z * r * inverse
            s_yy += e_yy
            s_yz += e_yz
            s_yr += arm * e_yz
            s_zy += e_zy
            s_zz += e_zz
            s_zr += arm * e_zz
            s_ry += arm * e_zy
            s_rz += arm * e_zz
            s_rr += base * base * e_zz
    if not support.sleeper:
        track[4], track[5], track[6] = 0.0, 0.0, 0.0
        return
    # the matrix is far from singular: ballast on its diagonal
    f = s_zy / s_yy
    s_zz -= f * s_yz
    s_zr -= f * s_yr
    b_z -= f * b_y
    f = s_ry / s_yy
    s_rz -= f * s_yz
    s_rr -= f * s_yr
    b_r -= f * b_y
    f = s_rz / s_zz
    roll = (b_r - f * b_z) / (s_rr - f * s_zr)
    z = (b_z - s_zr * roll) / s_zz
    y = (b_y - s_yz * z - s_yr * roll) / s_yy
    track[4], track[5], track[6] = y, z, roll
    for i in range(2):
        arm = (2.0 * i - 1.0) * base
        p, q, r, t, inverse = rail_matrix(side[i], rail + a_y, rail + a_z, c, k)
        f_y, f_z = a_y * y, a_z * (z + arm * roll)
        track[2 * i] += inverse * (t * f_y - q * f_z)
        track[2 * i + 1] += inverse * (p * f_z - r * f_y)


@compiled(inline=True)
def mass_of(row, k):
    """Mass or moment of inertia of degree of freedom `k`."""
    if k < RAIL_DOF:
        return row[M_RAIL]
    return row[M_SLEEPER] if k < DOF - 1 else row[I_SLEEPER]


@compiled(python=False)
def imbalance(system, work, state, w):
    """F - C u' - K u of the track under wheelset `w` into ``work.support_step[w, :7]``."""
    first = support_begin(system) + SUPPORT_SIZE * w
    track = work.support_step[w]
    for k in range(DOF):
        track[k] = 0.0
    for side in range(2):
        track[2 * side] = work.support[w, side, F_Y]
        track[2 * side + 1] = work.support[w, side, F_Z]
    track_forces(system.support, track, state, first, 1.0, 0.0, track, -1.0)
    track_forces(system.support, track, state, first + RATE, 0.0, 1.0, track, -1.0)


@compiled(inline=True)
def support_begin(system):
    """Index of the first wheelset's track in the state."""
    return 18 * system.bodies.kind.shape[0] + 2 * system.internal.kind.shape[0]


@compiled(python=False)
def support_rates(system, work, state, derivative):
    """Rates of the track's displacements and of their rates.

    Of a massless track the latter is the imbalance of forces over `REFERENCE_MASS`, zero once
    `settle_rates` has found the rates.
    """
    support = system.support
    if not support.elastic:
        return
    row = support.row
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        imbalance(system, work, state, w)
        for k in range(DOF):
            mass = REFERENCE_MASS if support.massless else mass_of(row, k)
            moves = k < RAIL_DOF or support.sleeper
            derivative[first + k] = state[first + RATE + k] if moves else 0.0
            derivative[first + RATE + k] = work.support_step[w, k] / mass if moves else 0.0


@compiled(python=False)
def settle_rates(system, work, state):
    """One Newton step for the rates of a massless track, with the forces just evaluated.

    The slopes are those of `Work.support`, an estimate for the creep forces.  A wheelset whose
    forces balance to `BALANCE` is not changed: it does not depend on the others.

    Returns
    -------
    bool : whether rates changed, so that the forces are to be evaluated again.
    """
    changed = False
    for w in range(work.support.shape[0]):
        first = support_begin(system) + SUPPORT_SIZE * w
        imbalance(system, work, state, w)
        track = work.support_step[w]
        own = 0.0
        for k in range(DOF):
            own = max(own, abs(track[k]))
        if own < BALANCE:
            continue
        changed = True
        solve_track(system.support, track, work.support[w], 0.0, 1.0, 0.0)
        for k in range(DOF):
            state[first + RATE + k] += track[k]
    return changed


@compiled(python=False)
def rail_motions(system, work, state):
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
def complete_slopes(system, work, state):
    """Forces on the rails, and what their slopes have learnt at the same set of patches."""
    for w in range(work.support.shape[0]):
        if work.support_step[w, SKIP] > 0.0:
            continue
        for side in range(2):
            contact = work.support[w, side]
            contact[F_Y], contact[F_Z] = work.wheel[w, side, W_Y], work.wheel[w, side, W_Q]
            i = support_begin(system) + SUPPORT_SIZE * w + LEARNT + LEARNT_SIZE * side
            if state[i + L_PATCHES] != contact[PATCHES]:
                continue
            contact[K + Y_Y] += state[i + L_Y_Y]
            contact[K + Z_Y] += state[i + L_Z_Y]
            across = max(-LEAST_SHARE * contact[D_Y_SLIP], state[i + L_Y_SLIP])
            contact[D + Y_Y] += across
            contact[D_Y_SLIP] += across
            contact[D + Z_Y] += state[i + L_Z_SLIP]
            contact[D_Z_SLIP] += state[i + L_Z_SLIP]


@compiled(python=False)
def evaluations(system, state, rails):
    """How often the contact forces may be evaluated again for the rails: `rails` as `AS_GIVEN`."""
    if rails == AFTER_STEP and system.support.elastic and state[LAST_STEP] > 0.0:
        return MOST_CORRECTIONS  # a step has been taken
    if rails == BALANCED and system.support.elastic and system.support.massless:
        return MOST_BALANCES
    return 0
