"""The fast scheme: one evaluation a step, of order two.

Velocity Verlet for the springs, velocities in it extrapolated by Adams and Bashforth for dampers,
contact forces that stiffen as 1/V taken linearly implicit (`damp_contact`), internal states of
elements advanced exactly for the drive in the middle of the step (see `internal`).  The state keeps
smoothed accelerations and the last drives.  Elastic rails: see `support_step`.
"""

from math import sqrt

from railsim.kernels import compiled
from railsim.kernels.actuators import ACTION, AXLE
from railsim.kernels.branches import unlikely
from railsim.kernels.contact_columns import (
    J_ALONG,
    J_CROSS,
    J_CROSS_YAW,
    J_NORMAL,
    J_SECANT,
    J_SECANT_C_Y,
    J_SECANT_C_Z,
    J_SECANT_YAW,
    J_SLIP,
)
from railsim.kernels.driving import table_value_slope
from railsim.kernels.internal import ends_pad, return_to_limit, state_after
from railsim.kernels.rails import BEND_ROLL, BEND_Z, THIRD_ROLL, THIRD_Z
from railsim.kernels.rhs import euler_rates
from railsim.kernels.state import (
    ARC_LENGTH,
    LAST_STEP,
    SPEED,
    TIME,
    drive_begin,
    internal_begin,
    smoothed_begin,
    velocity_begin,
)
from railsim.kernels.support_step import start_track_memory, step_support, store_wheelset_motion
from railsim.kernels.system import (
    AXLEBOX,
    COS_PITCH,
    COS_ROLL,
    I_1,
    I_2,
    I_3,
    MASS,
    SIN_PITCH,
    SIN_ROLL,
    TABLE,
    WHEELSET,
)
from railsim.kernels.track_frame import OMEGA_S
from railsim.kernels.transient import store_creepages
from railsim.kernels.vectors import matrix_at, minus, rotate_back, times, vector_at

# Weight of the last acceleration in the smoothed one, by which speeds are extrapolated: high enough
# to follow what a vehicle does (lag of 3 ms), low enough to leave out the ringing of the contacts
# at 200 Hz, which errors of the estimated damping would feed.
SMOOTHING = 0.3
# Irregular rigid rails: what a wheelset follows of them is known (`add_rail_accelerations`); its y,
# whose lag would be the main error of Y, is not smoothed, and other bodies are less: without, steps
# on side frames and friction wedges are judged stable that are not where a contact is stiffer.
RAIL_FACTOR, BODY_SMOOTHING = 1.0 - 0.25 * SMOOTHING, 0.6
# Elastic rails have no such ringing: nothing is smoothed.  An axlebox, as an arm on its bush, keeps
# the former: 98 Hz of the flexicoil coach's arms would be unstable at 1.67 ms without.  So does the
# spin of a driven or braked wheelset: a brake that holds it would chatter.
NO_SMOOTHING = 1.0
MAX_STEP_RATIO = 100.0
# The creep force of a wheelset that slides along the track has no slope, but the sign of the slip:
# where the secant times h/m, z, is above 1 the slip would alternate from step to step.  An implicit
# part of 1 - 1/z of the secant ends that; this is the 1, with what a secant may be short of slopes.
SECANT_LIMIT = 1.4
Y, SPIN = 1, 4  # components of a body along and about its y axis


@compiled(inline=True)
def implicitness(z):
    """Share of the new value at h times the damping rate: the trapezoid's 1/2, for large z 1 - 1/z.

    The former is of order two, the latter damps what is too fast to be followed.
    """
    return 0.5 if z < 2.0 else 1.0 - 1.0 / z


@compiled(python=False)
def damp_coordinate(rate, smooth, i, damping, inverse, h):
    """Take a damper of one coordinate linearly implicit; `inverse`: 1/mass."""
    z = h * damping * inverse
    theta_z = implicitness(z) * z
    rate[i] = (rate[i] + theta_z * smooth[i]) / (1.0 + theta_z)


@compiled(python=False)
def damp_slip(rate, smooth, i, j, lever, damping, inverse_i, inverse_j, h):
    """Take a damper of the speed of coordinate i + lever times that of j linearly implicit."""
    z = h * damping * (inverse_i + lever * lever * inverse_j)
    theta = implicitness(z)
    slip = rate[i] - smooth[i] + lever * (rate[j] - smooth[j])
    force = theta * h * damping / (1.0 + theta * z) * slip
    rate[i] -= force * inverse_i
    rate[j] -= force * lever * inverse_j


@compiled(python=False)
def damp_cross_section(jacobian, b, rate, smooth, v, inv_m, inv_I, h):
    """Take the contact's damping of the speeds in y, z and roll linearly implicit.

    `inv_m`, `inv_I`: inverse mass and moment of inertia.  The creep forces may be too fast to be
    followed; the contact damping is not, but it holds or feeds vibrations of a sliding flange.
    """
    J = jacobian
    t = J_SLIP
    z = h * ((J[b, t] + J[b, t + 3]) * inv_m + J[b, t + 5] * inv_I)
    f = implicitness(z) * h
    g = 0.5 * h
    i = J_NORMAL
    a11 = 1.0 + inv_m * (f * J[b, t] + g * J[b, i])
    a12 = inv_m * (f * J[b, t + 1] + g * J[b, i + 1])
    a13 = inv_m * (f * J[b, t + 2] + g * J[b, i + 2])
    a21 = inv_m * (f * J[b, t + 1] + g * J[b, i + 3])
    a22 = 1.0 + inv_m * (f * J[b, t + 3] + g * J[b, i + 4])
    a23 = inv_m * (f * J[b, t + 4] + g * J[b, i + 5])
    a31 = inv_I * (f * J[b, t + 2] + g * J[b, i + 6])
    a32 = inv_I * (f * J[b, t + 4] + g * J[b, i + 7])
    a33 = 1.0 + inv_I * (f * J[b, t + 5] + g * J[b, i + 8])
    d1 = rate[v + 1] - smooth[v + 1]
    d2 = rate[v + 2] - smooth[v + 2]
    d3 = rate[v + 3] - smooth[v + 3]
    c11, c12, c13 = a22 * a33 - a23 * a32, a13 * a32 - a12 * a33, a12 * a23 - a13 * a22
    inverse = 1.0 / (a11 * c11 + a21 * c12 + a31 * c13)
    rate[v + 1] = smooth[v + 1] + inverse * (c11 * d1 + c12 * d2 + c13 * d3)
    rate[v + 2] = smooth[v + 2] + inverse * (
        (a23 * a31 - a21 * a33) * d1 + (a11 * a33 - a13 * a31) * d2 + (a13 * a21 - a11 * a23) * d3
    )
    rate[v + 3] = smooth[v + 3] + inverse * (
        (a21 * a32 - a22 * a31) * d1 + (a12 * a31 - a11 * a32) * d2 + (a11 * a22 - a12 * a21) * d3
    )


@compiled(python=False)
def damp_coupled(bodies, work, b, rate, smooth, along, step, h_0):
    """Take the contact's damping of slip along, yaw, y, z and roll implicit together.

    At walking pace all of these are too fast to be followed, and wheelsets that slide in tight
    curves couple them: the largest eigenvalue of the whole matrix over that of its blocks may be
    as large as their number, and steps are stable up to some 3/2 of what the implicit part takes.
    `along`, `step`, `h_0`: see `damp_contact`.  `Work.slip_matrix` holds the matrix, the right-hand
    side, inverse masses and roots of the implicit shares.
    """
    n, x, w, s = 5, 5, 6, 7
    J, m, v, row = work.contact_jacobian[b], work.slip_matrix, 6 * b, bodies.row[b]
    lever, share = J[J_SECANT_C_Z] / J[J_SECANT], along / J[J_SECANT]
    inv_m, inv_I = 1.0 / row[MASS], 1.0 / row[I_2]
    m[0, w], m[1, w], m[4, w] = inv_m + lever * lever * inv_I, 1.0 / row[I_3], 1.0 / row[I_1]
    m[2, w] = m[3, w] = inv_m
    m[0, 0], m[1, 1], m[1, 0] = along, share * J[J_SECANT_YAW], -share * J[J_SECANT_C_Y]
    slip = m[0, x] = rate[v] - smooth[v] + lever * (rate[v + 4] - smooth[v + 4])
    m[1, x] = rate[v + 5] - smooth[v + 5]
    for i in range(3):
        m[2 + i, x] = rate[v + 1 + i] - smooth[v + 1 + i]
        m[2 + i, 0], m[2 + i, 1] = J[J_CROSS + i], -J[J_CROSS_YAW + i]
        for j in range(i + 1):
            m[2 + i, 2 + j] = J[J_SLIP + (i if j == 0 else i + j + 1)]
    z = h_0 * (m[2, 2] * inv_m + m[3, 3] * inv_m + m[4, 4] * m[4, w])
    m[0, s] = sqrt(step * implicitness(step * along * m[0, w]))
    m[1, s] = sqrt(h_0 * implicitness(h_0 * m[1, 1] * m[1, w]))
    m[2, s] = m[3, s] = m[4, s] = sqrt(h_0 * implicitness(z))
    for i in range(n):
        for j in range(i + 1):
            m[i, j] *= m[i, s] * m[j, s]
            m[j, i] = m[i, j]
    for i in range(3):
        for j in range(3):
            m[2 + i, 2 + j] += 0.5 * h_0 * J[J_NORMAL + 3 * i + j]
    for i in range(n):
        for j in range(n):
            m[i, j] *= m[i, w]
        m[i, i] += 1.0
    for k in range(n):  # far from singular: no pivots are needed
        for i in range(k + 1, n):
            f = m[i, k] / m[k, k]
            for j in range(k + 1, x + 1):
                m[i, j] -= f * m[k, j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            m[i, x] -= m[i, j] * m[j, x]
        m[i, x] /= m[i, i]
    force = (slip - m[0, x]) / m[0, w]
    rate[v] -= force * inv_m
    rate[v + 4] -= force * lever * inv_I
    rate[v + 5] = smooth[v + 5] + m[1, x]
    for i in range(3):
        rate[v + 1 + i] = smooth[v + 1 + i] + m[2 + i, x]


@compiled(python=False)
def damp_contact(bodies, work, b, rate, smooth, h, h_0):
    """Take the damping of wheelset `b` by its contacts linearly implicit over a step `h`.

    The explicit acceleration a is evaluated with the extrapolated velocity; the acceleration a_n of
    the step solves a_n + theta h M^-1 D (a_n - b) = a, b as in `step_fast`, D an estimate of that
    damping (linearly implicit methods: Hairer and Wanner, Solving ODE II, IV.7): exact D gives the
    trapezoidal rule, and an error of D counts with h^2.  D of rank one for the slip along the
    track, of x and spin; one matrix for y, z and roll; one number for yaw.  h is the length of the
    step over which the velocity was extrapolated, `h_0`; for the spin, which a longer step than
    that would not follow, the longer one.
    """
    v, jacobian = 6 * b, work.contact_jacobian
    inv_m, inv_I = 1.0 / bodies.row[b, MASS], 1.0 / bodies.row[b, I_2]
    secant, step = jacobian[b, J_SECANT], max(h_0, h)
    if secant > 0.0:
        lever = jacobian[b, J_SECANT_C_Z] / secant
        z = step * secant * (inv_m + lever * lever * inv_I)
        along = max(jacobian[b, J_ALONG], min(1.0, SECANT_LIMIT - 1.0 / z) * secant)
        if unlikely(jacobian[b, J_SECANT_C_Y] != 0.0):
            damp_coupled(bodies, work, b, rate, smooth, along, step, h_0)
            return
        damp_slip(rate, smooth, v, v + 4, lever, along, inv_m, inv_I, step)
        yaw = jacobian[b, J_SECANT_YAW] * along / secant
        damp_coordinate(rate, smooth, v + 5, yaw, 1.0 / bodies.row[b, I_3], h_0)
    damp_cross_section(jacobian, b, rate, smooth, v, inv_m, 1.0 / bodies.row[b, I_1], h_0)


@compiled(python=False)
def start_memory(system, work, state, derivative, h):
    """Start the memory of `step_fast` at `state`, as if accelerations had been the same before."""
    n, m = system.bodies.kind.shape[0], system.internal.kind.shape[0]
    rate = derivative[velocity_begin(n) : internal_begin(n)]
    smooth = state[smoothed_begin(n, m) : drive_begin(n, m)]
    for k in range(6 * n):
        smooth[k] = 0.0
    if system.track.has_irregularity and not system.support.elastic:
        start_on_rails(system, work, state, smooth)
    for b in range(n):
        if system.bodies.kind[b] == WHEELSET:
            damp_contact(system.bodies, work, b, rate, smooth, h, h)
    for k in range(6 * n):
        smooth[k] = rate[k]
    for i in range(m):
        state[drive_begin(n, m) + i] = work.drive[i, 0]
    if system.support.elastic:
        start_track_memory(system, work, state)
    state[LAST_STEP] = 0.0


@compiled(python=False)
def start_on_rails(system, work, state, smooth):
    """Start the smoothed accelerations of wheelsets with those of irregular rails."""
    square = state[SPEED] * state[SPEED]
    for w in range(system.contact.body.shape[0]):
        k = 6 * system.contact.body[w]
        smooth[k + 2] = square * work.plane[w, BEND_Z]
        smooth[k + 3] = square * work.plane[w, BEND_ROLL]


@compiled(python=False)
def add_rail_accelerations(system, work, state, smooth, h):
    """Add to the smoothed accelerations b what irregular rigid rails give to the wheelsets.

    A wheelset on its rails has their acceleration c in z and roll, c = V^2 d2z/ds2, and one of its
    own, r.  Let b be r smoothed plus c in the middle of the half step over which b extrapolates the
    speed, 3/4 h ahead: with dc/dt = V^3 d3z/ds3, constant over a step, that is
    b <- b + SMOOTHING (a - b) + h dc/dt (1 - SMOOTHING/4).  The last term is added here.
    """
    speed = state[SPEED]
    first, body = velocity_begin(system.bodies.kind.shape[0]), system.contact.body
    change = RAIL_FACTOR * h * speed * speed * speed
    for w in range(body.shape[0]):
        k = 6 * body[w]
        z, roll = change * work.plane[w, THIRD_Z], change * work.plane[w, THIRD_ROLL]
        smooth[k + 2] += z
        smooth[k + 3] += roll
        state[first + k + 2] += 0.5 * h * z
        state[first + k + 3] += 0.5 * h * roll


@compiled(python=False)
def step_fast(system, work, state, derivative, decay, h):
    """Advance `state` by `h` with the derivative already evaluated there.

    With the acceleration a of this step and b, the smoothed one of the steps before:
    u = v + h (a - b/2), q <- q + h u, b <- b + SMOOTHING (a - b), v <- u + h/2 b; on irregular
    rigid rails see `add_rail_accelerations`.

    v - h/2 b is the velocity in the middle of the last step; where that was of another length h_0,
    v is moved by (h_0 - h)/2 (a - b), so that it is that of a last step of length h.
    """
    bodies, C = system.bodies, work.relative
    n, m = bodies.kind.shape[0], system.internal.kind.shape[0]
    rate = derivative[velocity_begin(n) : internal_begin(n)]
    smooth = state[smoothed_begin(n, m) : drive_begin(n, m)]
    frames, half = work.frames, 0.5 * h * state[SPEED] * state[SPEED]
    if system.contact.transient != 0:
        store_creepages(system, work, state)
    if system.support.elastic:
        store_wheelset_motion(system, work, state)
    # negative in results of earlier versions
    h_0 = abs(state[LAST_STEP]) if state[LAST_STEP] != 0.0 else h
    shift = 0.5 * (h_0 - h)
    irregular = system.track.has_irregularity and not system.support.elastic
    for b in range(n):
        q = 6 * b
        v = velocity_begin(n) + q
        kind = bodies.kind[b]
        on_elastic_rails = system.support.elastic and kind != AXLEBOX
        beta = beta_y = beta_spin = NO_SMOOTHING if on_elastic_rails else SMOOTHING
        if irregular and kind != AXLEBOX:
            beta_y = NO_SMOOTHING if kind == WHEELSET else BODY_SMOOTHING
            beta = beta_spin = SMOOTHING if kind == WHEELSET else BODY_SMOOTHING
        if kind == WHEELSET:
            damp_contact(bodies, work, b, rate, smooth, h, h_0)
            for e in range(system.drives.body.shape[0]):
                if system.drives.body[e, 1] == b:
                    beta_spin = SMOOTHING
            for e in range(system.actuators.body.shape[0]):
                if system.actuators.codes[e, ACTION] == AXLE and system.actuators.body[e, 1] == b:
                    beta_spin = SMOOTHING
        d1 = (h + shift) * rate[q + 3] - (0.5 * h + shift) * smooth[q + 3]
        d2 = (h + shift) * rate[q + 4] - (0.5 * h + shift) * smooth[q + 4]
        d3 = (h + shift) * rate[q + 5] - (0.5 * h + shift) * smooth[q + 5]
        if kind < AXLEBOX:  # rigid bodies and wheelsets; fixed ones do not turn in their frames
            # the angles are those against the frame, whose own turn changes over the step
            turn = rotate_back(matrix_at(C, b, 0), vector_at(frames, bodies.frame[b], OMEGA_S))
            d1, d2, d3 = euler_rates(
                C[b, SIN_ROLL],
                C[b, COS_ROLL],
                C[b, SIN_PITCH],
                C[b, COS_PITCH],
                minus((d1, d2, d3), times(half, turn)),
            )
        for k in range(3):
            state[q + k] += h * (
                state[v + k] + (h + shift) * rate[q + k] - (0.5 * h + shift) * smooth[q + k]
            )
        state[q + 3] += h * (derivative[q + 3] + d1)
        state[q + 4] += h * (derivative[q + 4] + d2)
        state[q + 5] += h * (derivative[q + 5] + d3)
        for k in range(6):
            change = rate[q + k] - smooth[q + k]
            weight = beta_spin if k == SPIN else beta_y if k == Y else beta
            state[v + k] += h * rate[q + k] + (0.5 * weight * h + shift) * change
            smooth[q + k] += weight * change
    if irregular:
        add_rail_accelerations(system, work, state, smooth, h)
    drives = drive_begin(n, m)
    # after a step that is shorter by far there is nothing to extrapolate from
    ratio = h / h_0 if h < MAX_STEP_RATIO * h_0 else 0.0
    for i in range(m):
        k = internal_begin(n) + i
        drive = work.drive[i, 0] + 0.5 * ratio * (work.drive[i, 0] - state[drives + i])
        state[drives + i] = work.drive[i, 0]
        state[k] = state_after(
            system.internal, system.curves, i, state[k], drive, work.drive[i, 1], h, decay[i]
        )
        if ends_pad(system.internal, i):
            return_to_limit(system.internal, i, internal_begin(n), work.drive, state)
    state[LAST_STEP] = h
    advance_position(system.drive, state, derivative, h)
    if system.support.elastic:
        step_support(system, work, state, h, h_0)


@compiled(python=False)
def advance_position(drive, state, derivative, h):
    """Time, position and speed after a step; a speed table is met exactly."""
    state[ARC_LENGTH] += h * (state[SPEED] + 0.5 * h * derivative[SPEED])
    state[SPEED] += h * derivative[SPEED]
    state[TIME] += h
    if drive.mode == TABLE:
        state[SPEED], _ = table_value_slope(drive.table, state[ARC_LENGTH])
