"""Forces between wheelsets and rails: elastic normal contact, creepages, creep forces.

Per wheel and patch, with the table's gap g and stiffness K (see `contact_table`):

- penetration p = z - g, less what the loads of neighbouring patches bend the surfaces; elastic
  normal force as the gradient of the potential U, which includes the terms from the change of the
  stiffnesses along the profile (`coupled_approaches`); place, direction and ellipse of the patch
  under its load (`under_load`); y, z, roll of the wheelset in the plane of the rails, yaw against
  each rail's own direction (see `rails`);
- contact damping c_N on the *geometric* rate of approach, faded in over 30 um, the sum never
  pulling;
- the rail at the patch has the direction d = (1, t_y, t_z), from the turn of the frame at that
  place, omega x rho, and the slopes of displaced rails; c from the wheelset's centre to the patch,
  c_x = (c_x/yaw)(yaw - t_y) - t_y c_y - t_z c_z with the table's (c_x/yaw);
- creepages from the velocity of the wheel's material at the patch, v = V e_x + w_F x r + r'
  + w_abs x c less that of the rail's material (none where the rail is rigid: a slope of its shape
  is no velocity), along d and at right angles to it, over V_p = V (1 + (omega x rho)_x) + x', the
  speed at which the patch runs along its rail;
- tangential forces by the creep law for all patches of the vehicle in one call.

Forces on the rail in the plane of the rails: Y = T_y cos g + N sin g, Q = -T_y sin g + N cos g with
the angle g > 0 where the normal leans to the right; on the wheel the opposite, with moment c x F.
"""

from math import sqrt

import numpy as np

from railsim.kernels import jit, jit_inline, jit_merged
from railsim.kernels.contact_table import (
    ABOVE_Y,
    BELOW_Y,
    G_ROLL,
    G_W,
    G_Y,
    INSIDE,
    K2_ROLL,
    K2_W,
    K2_Y,
    K_ROLL,
    K_W,
    K_Y,
    LOOK_UP_SIZE,
    N_PATCH,
    OUTSIDE_ROLL,
    cell_weights,
    coupled_approaches,
    is_far,
    locate,
    look_up,
    stretched_roll,
    under_load,
)
from railsim.kernels.creep import creep_forces, falling_friction
from railsim.kernels.cube_root import cube_root
from railsim.kernels.fastsim import kalker_lookup
from railsim.kernels.rails import (
    ASIDE,
    ASIDE_SLOPE,
    BEND_Z,
    COMING_ROLL,
    COMING_Y,
    COMING_Z,
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
    SINE,
    SLOPE_Y,
    SLOPE_Z,
    foresee,
    locate_rails,
)
from railsim.kernels.status import (
    DERAILED,
    INWARD_RANGE,
    ROLL_RANGE,
    RUNNING,
    WHEEL_LIFT,
    YAW_RANGE,
)
from railsim.kernels.support import (
    D_Y_ROLL,
    D_Y_SLIP,
    D_Y_Y,
    D_Y_Z,
    D_Z_ROLL,
    D_Z_SLIP,
    D_Z_Y,
    D_Z_Z,
    F_Y,
    F_Z,
    K_Y_ROLL,
    K_Y_Y,
    K_Y_Z,
    K_Z_ROLL,
    K_Z_Y,
    K_Z_Z,
    SUPPORT_COLUMNS,
    rail_motions,
)
from railsim.kernels.system import COS_ROLL, Y_0, Z_0
from railsim.kernels.track_frame import OMEGA

# rows of Work.patch: one column per active patch.  Angle and foot are in the plane of the rails:
# place of the patch from the wheelset's centre for a rail along x, and its x per yaw; normal and C
# in the track's axes, as is the direction of the rail at the patch, (1, turn_y, turn_z).
(
    A,
    B,
    NORMAL,
    MU_N,
    ANGLE_SIN,
    ANGLE_COS,
    C_X,
    C_Y,
    C_Z,
    XI_X,
    XI_Y,
    PHI,
    C11,
    C22,
    C23,
    C33,
    T_X,
    T_Y,
    M_Z,
    PENETRATION,
    BEYOND,
    NORMAL_STIFFNESS,
    NORMAL_DAMPING,
    LEAD,
    FOOT_X,
    FOOT_Y,
    FOOT_Z,
    TURN_Y,
    TURN_Z,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_SPEED,
) = range(32)
PATCH_ROWS = 32

# columns of Work.wheel[w, side]
W_Q, W_Y, W_XI_X, W_XI_Y, W_PHI, W_T_GAMMA, W_LIFT, W_NORMAL, W_T_GAMMA_SPIN = range(9)
WHEEL_COLUMNS = 9

# columns of Work.contact_jacobian[b], what the contact takes from the wheelset's speeds, for the
# implicit part of the step: creep forces along the track [N s/m], the same times the lever c_z
# [N s], in yaw [N m s]; then in y, z and roll [N s/m, N s, N m s] the upper half of the symmetric
# matrix of the creep forces across, and row by row that of the normal forces with the friction that
# follows them
J_ALONG, J_ALONG_LEVER, J_YAW, J_SLIP, J_NORMAL = 0, 1, 2, 3, 9
CONTACT_JACOBIAN = 18

# a wheel as far as this above its rail is followed to see whether it strikes within a step (m)
NEAR = 2e-3
FADE = 30e-6  # penetration over which the contact damping is faded in (m)
LIFT_RANGE = 0.05  # a wheel higher than this above its rail is beyond the model (m)


@jit_inline
def normal_contact(system, work, speed, state):
    """Look up all wheels, add elastic normal forces, list the active patches.

    Returns
    -------
    status, wheelset, n : int
        Status code, the wheelset it concerns, number of active patches.
    """
    contact = system.contact
    force, plane, above = work.rail_force, work.plane, work.above
    jacobian = work.contact_jacobian
    n_bodies = system.bodies.kind.shape[0]
    smoothed = 12 * n_bodies + system.internal.kind.shape[0]
    ahead = work.watch[0]
    n = np.int64(0)  # a plain 0 would have everything that takes it compiled twice
    for w in range(contact.body.shape[0]):
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
        y_rate = state[6 * n_bodies + 6 * b + 1] - speed * plane[w, SLOPE_Y]
        z_rate = state[6 * n_bodies + 6 * b + 2] - speed * plane[w, SLOPE_Z]
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
        above[0], above[1] = y, z - height
        above[2], above[3] = state[6 * b + 3] - plane[w, ROLL] + slope * yaw, yaw
        above[4], above[5] = y_rate, z_rate
        above[6] = work.acceleration[b, 3] - turn + slope * yaw_rate + speed * bend * yaw
        above[7] = yaw_rate
        above[8], above[9] = stretched_roll(above[2])
        work.swing[w] = 0.0
        if ahead > 0.0 and system.track.has_irregularity:
            own = smoothed + 6 * b
            place = state[-2] + system.frame_offset[system.bodies.frame[b]] + speed * ahead
            foresee(system.track, place, speed, w, plane, work.rail, state, own, ahead, work.coming)
        for side in range(2):
            status, n = wheel_contact(system, work, w, side, speed, n)
            if status != RUNNING:
                return status, w, n
        # from the plane to the track's axes; -dU/ds in place of the force along the track
        f_y, f_z = force[b, 1], force[b, 2]
        along = plane[w, ROLL_SLOPE] * (f_y * z - f_z * y - force[b, 3])
        f_y, f_z = cosine * f_y - sine * f_z, sine * f_y + cosine * f_z
        force[b, 0] += along - f_y * plane[w, SLOPE_Y] - f_z * slope - force[b, 3] * bend * yaw
        force[b, 1] = f_y
        force[b, 2] = f_z
        force[b, 5] += slope * force[b, 3]
    return RUNNING, 0, n


@jit_inline
def wheel_contact(system, work, w, side, speed, n):
    """Normal forces of one wheel, added to its wheelset's generalised ones in `work.rail_force`.

    `work.above` holds the wheelset in the plane of its rails, `n` counts the active patches so far.

    Returns
    -------
    status, n : int
    """
    contact, rail, above = system.contact, work.rail, work.above
    force, wheel, t = work.rail_force, work.wheel, work.look_up
    stiffness, approach, weights = work.stiffness, work.approach, work.weights
    b = contact.body[w]
    sign = 2.0 * side - 1.0
    motion, coming, ahead = work.rail_motion, work.coming, work.watch[0]
    swing = 0.0
    aside, aside_slope = rail[w, side, ASIDE], rail[w, side, ASIDE_SLOPE]
    bend = rail[w, side, RAIL_BEND]
    y = sign * (above[0] - aside - motion[w, side, MOTION_Y])
    z = above[1] - motion[w, side, MOTION_Z]
    roll = sign * above[2]
    yaw = above[3] - rail[w, side, RAIL_SLOPE]
    y_rate = sign * (above[4] - speed * aside_slope - motion[w, side, MOTION_Y_RATE])
    z_rate = above[5] - motion[w, side, MOTION_Z_RATE]
    roll_rate = sign * above[6]
    yaw_rate = above[7] - speed * bend
    table = contact.table[w, side]
    where, iy, ir, iw, ty, tr, tw = locate(contact, table, y, roll, sign * above[8], yaw * yaw)
    if where != INSIDE:
        return outside(where), n
    cell_weights(contact, ty, tr, above[9], weights)
    normal = 0.0
    lateral = 0.0
    lift = 1.0
    for patch in range(N_PATCH):
        stiffness[patch] = 0.0
        stiffness[N_PATCH + patch] = 0.0
        approach[patch] = -1.0
        if is_far(contact, table, patch, iy, ir, iw, tr, z):
            continue
        first = patch * LOOK_UP_SIZE
        look_up(contact, table, patch, iy, ir, iw, tw, weights, t, first)
        stiffness[patch] = t[first + 1]
        stiffness[N_PATCH + patch] = t[first + 2]
        approach[patch] = z - t[first]
        lift = min(lift, -approach[patch])
    coupled_approaches(contact.coupling, table, stiffness, approach)
    for patch in range(N_PATCH):
        p = approach[patch]
        if p <= -NEAR:
            continue
        k = patch * LOOK_UP_SIZE
        p_rate = (
            z_rate
            - t[k + G_Y] * y_rate
            - t[k + G_ROLL] * roll_rate
            - t[k + G_W] * 2.0 * yaw * yaw_rate
        )
        p_change = coming[side, COMING_Z] - sign * (
            t[k + G_Y] * coming[side, COMING_Y] + t[k + G_ROLL] * coming[side, COMING_ROLL]
        )
        if p <= 0.0:
            p += ahead * (p_rate + max(p_change, 0.0))
            if p > 0.0:
                root = sqrt(p)
                swing = max(swing, p * root * (t[k + 1] + root * t[k + 2]) / ahead)
            continue
        root = sqrt(p)
        change = max(abs(p_rate), abs(p_rate + p_change))
        swing = max(swing, root * (1.5 * t[k + 1] + 2.0 * root * t[k + 2]) * change)
        elastic = p * root * (t[k + 1] + root * t[k + 2])
        c_y, c_z, a1, b1, tangent = under_load(t, k, elastic)
        cos_2 = 1.0 / (1.0 + tangent * tangent)
        fade = min(1.0, p / FADE)
        vertical = max(0.0, elastic + contact.damping * cos_2 * fade * p_rate)
        per_K, per_K2 = 0.4 * p * p * root, p * p * p / 3.0
        q_y = sign * (vertical * t[k + G_Y] - per_K * t[k + K_Y] - per_K2 * t[k + K2_Y])
        q_yaw = (vertical * t[k + G_W] - per_K * t[k + K_W] - per_K2 * t[k + K2_W]) * 2.0 * yaw
        force[b, 0] -= q_y * aside_slope + q_yaw * bend
        force[b, 1] += q_y
        force[b, 2] -= vertical
        force[b, 3] += sign * (
            vertical * t[k + G_ROLL] - per_K * t[k + K_ROLL] - per_K2 * t[k + K2_ROLL]
        )
        force[b, 5] += q_yaw
        normal += vertical
        lateral -= q_y
        cos_g = sqrt(cos_2)
        N = vertical / cos_g
        if N <= 0.0:
            continue
        column = work.patch
        column[A, n] = a1
        column[B, n] = b1
        column[NORMAL, n] = N
        column[MU_N, n] = rail[w, side, FRICTION] * N
        column[ANGLE_COS, n] = cos_g
        column[ANGLE_SIN, n] = sign * tangent * cos_g
        # the normal meets the axle: c + lambda n lies on it, and n does not point along
        lead = sign * (c_z * tangent - c_y)
        column[LEAD, n] = lead
        column[FOOT_X, n] = yaw * lead
        column[FOOT_Y, n] = sign * c_y
        column[FOOT_Z, n] = c_z
        column[PENETRATION, n] = p
        column[NORMAL_STIFFNESS, n] = root * (1.5 * t[k + 1] + 2.0 * root * t[k + 2]) / cos_2
        column[NORMAL_DAMPING, n] = contact.damping * fade
        work.patch_index[n, 0] = w
        work.patch_index[n, 1] = side
        work.patch_index[n, 2] = patch
        n += 1
    wheel[w, side, W_Q] = normal
    wheel[w, side, W_Y] = lateral
    wheel[w, side, W_NORMAL] = 0.0
    wheel[w, side, W_XI_X] = 0.0
    wheel[w, side, W_XI_Y] = 0.0
    wheel[w, side, W_PHI] = 0.0
    wheel[w, side, W_T_GAMMA] = 0.0
    wheel[w, side, W_T_GAMMA_SPIN] = 0.0
    wheel[w, side, W_LIFT] = lift
    work.swing[w] = max(work.swing[w], swing)
    if lift > LIFT_RANGE and all_far(contact, table, iy, ir, iw, tr, z):
        return WHEEL_LIFT, n
    return RUNNING, n


@jit
def all_far(contact, table, iy, ir, iw, tr, z):
    """Whether every patch is more than LIFT_RANGE away from its rail."""
    for patch in range(N_PATCH):
        if z - contact.values[table, patch, iw, ir, iy, 0] > -LIFT_RANGE:
            return False
    return True


@jit
def outside(where):
    """Status code for a look-up outside the contact table."""
    if where == ABOVE_Y:
        return DERAILED
    if where == BELOW_Y:
        return INWARD_RANGE
    if where == OUTSIDE_ROLL:
        return ROLL_RANGE
    return YAW_RANGE


@jit_inline
def creepages(system, work, n, speed, state):
    """Places and creepages of the active patches, see the module's equations."""
    patch, C, frames, plane = work.patch, work.relative, work.frames, work.plane
    n_bodies = system.bodies.kind.shape[0]
    for k in range(n):
        w, side = work.patch_index[k, 0], work.patch_index[k, 1]
        b = system.contact.body[w]
        f = system.bodies.frame[b]
        w1, w2, w3 = frames[f, OMEGA], frames[f, OMEGA + 1], frames[f, OMEGA + 2]
        x = state[6 * b]
        y = state[6 * b + 1] + system.bodies.row[b, Y_0]
        z = state[6 * b + 2] + system.bodies.row[b, Z_0]
        v = 6 * n_bodies + 6 * b
        u1, u2, u3 = state[v + 3], state[v + 4], state[v + 5]
        a1 = C[b, 0] * u1 + C[b, 1] * u2 + C[b, 2] * u3
        a2 = C[b, 3] * u1 + C[b, 4] * u2 + C[b, 5] * u3
        a3 = C[b, 6] * u1 + C[b, 7] * u2 + C[b, 8] * u3
        # place and normal from the plane of the rails to the track's axes
        sine, cosine = plane[w, SINE], plane[w, COSINE]
        cy = cosine * patch[FOOT_Y, k] - sine * patch[FOOT_Z, k]
        cz = sine * patch[FOOT_Y, k] + cosine * patch[FOOT_Z, k]
        s = cosine * patch[ANGLE_SIN, k] - sine * patch[ANGLE_COS, k]
        c = cosine * patch[ANGLE_COS, k] + sine * patch[ANGLE_SIN, k]
        # direction of the rail at the patch, (1, turn_y, turn_z); the patch leads accordingly
        slope = work.rail[w, side, RAIL_SLOPE]
        cx = patch[FOOT_X, k] - slope * cy
        roll_slope = plane[w, ROLL_SLOPE]
        turn_z = (
            w1 * (y + cy)
            - w2 * (x + cx)
            + plane[w, SLOPE_Z]
            + roll_slope * (y + cy - plane[w, MIDDLE_Y])
        )
        cx -= turn_z * cz
        more = w3 * (x + cx) - w1 * (z + cz) - roll_slope * (z + cz - plane[w, MIDDLE_Z])
        turn_y = slope + more
        cx -= (patch[LEAD, k] + cy) * more
        # velocity of the wheel's material against that of the rail, along the rail and across it
        rail_y, rail_z = (
            work.rail_motion[w, side, MOTION_Y_RATE],
            work.rail_motion[w, side, MOTION_Z_RATE],
        )
        vx = speed * (1.0 + w2 * z - w3 * y) + state[v] + a2 * cz - a3 * cy
        vy = (
            state[v + 1]
            + speed * (w3 * x - w1 * z)
            + a3 * cx
            - a1 * cz
            - cosine * rail_y
            + sine * rail_z
        )
        vz = (
            state[v + 2]
            + speed * (w1 * y - w2 * x)
            + a1 * cy
            - a2 * cx
            - sine * rail_y
            - cosine * rail_z
        )
        rolling = speed * (1.0 + w2 * (z + cz) - w3 * (y + cy)) + state[v]
        patch[C_X, k] = cx
        patch[C_Y, k] = cy
        patch[C_Z, k] = cz
        patch[TURN_Y, k] = turn_y
        patch[TURN_Z, k] = turn_z
        patch[NORMAL_Y, k] = s
        patch[NORMAL_Z, k] = c
        patch[PATCH_SPEED, k] = rolling
        patch[XI_X, k] = (vx + turn_y * vy + turn_z * vz) / rolling
        patch[XI_Y, k] = ((vy - turn_y * vx) * c - (vz - turn_z * vx) * s) / rolling
        patch[PHI, k] = (a2 * s + a3 * c - a1 * (turn_y * s + turn_z * c)) / rolling


@jit_inline
def creep_slopes(ab, c11, c22, c23, G, mu_N, xi_x, xi_y, phi):
    """Slopes of the creep force along and across over the creepage in that direction [N].

    Those of the force mu N (1 - (1 - u/3)^3) in the direction of the linear one, u = |T_linear|/
    (mu N) <= 3 (Vermeulen and Johnson 1964, spin as in the linear theory): an estimate that serves
    the time step and does not enter the forces.
    """
    x = G * ab * c11 * xi_x / mu_N
    y = G * ab * (c22 * xi_y + c23 * sqrt(ab) * phi) / mu_N
    square = x * x + y * y
    u = sqrt(square)
    secant, tangent = 1.0, 1.0
    if u >= 3.0:
        secant, tangent = 1.0 / u, 0.0
    elif u > 1e-9:
        secant, tangent = 1.0 - u / 3.0 + square / 27.0, (1.0 - u / 3.0) ** 2
    share = x * x / (square + 1e-300)
    along = share * tangent + (1.0 - share) * secant
    across = share * secant + (1.0 - share) * tangent
    return G * ab * c11 * along, G * ab * c22 * across


@jit_inline
def begin_support(support):
    """Nothing yet acts on the rails."""
    for w in range(support.shape[0]):
        for side in range(2):
            for k in range(SUPPORT_COLUMNS):
                support[w, side, k] = 0.0


@jit_inline
def add_slopes(support, w, side, patch, k, across):
    """Add to the derivatives of the forces on a rail what patch `k` contributes.

    By a motion d of the wheel at the patch, N changes by k_N n d and c_N n d', and the creep force
    with it, being nearly proportional to N; T_y by the slope of the creep law, `across`, times
    t d'.
    """
    s, c = patch[ANGLE_SIN, k], patch[ANGLE_COS, k]
    cy, cz = patch[FOOT_Y, k], patch[FOOT_Z, k]
    share = patch[T_Y, k] / patch[NORMAL, k]
    f_y, f_z = s + share * c, c - share * s
    stiffness, damping = patch[NORMAL_STIFFNESS, k], patch[NORMAL_DAMPING, k]
    lever = c * cy - s * cz  # of the normal about the wheelset's centre
    support[w, side, K_Y_Y] += stiffness * f_y * s
    support[w, side, K_Y_Z] += stiffness * f_y * c
    support[w, side, K_Y_ROLL] += stiffness * f_y * lever
    support[w, side, K_Z_Y] += stiffness * f_z * s
    support[w, side, K_Z_Z] += stiffness * f_z * c
    support[w, side, K_Z_ROLL] += stiffness * f_z * lever
    arm = -c * cz - s * cy  # of the tangent
    support[w, side, D_Y_Y] += damping * f_y * s + across * c * c
    support[w, side, D_Y_Z] += damping * f_y * c - across * c * s
    support[w, side, D_Y_ROLL] += damping * f_y * lever + across * c * arm
    support[w, side, D_Z_Y] += damping * f_z * s - across * s * c
    support[w, side, D_Z_Z] += damping * f_z * c + across * s * s
    support[w, side, D_Z_ROLL] += damping * f_z * lever - across * s * arm
    support[w, side, D_Y_SLIP] += across * c * c
    support[w, side, D_Z_SLIP] -= across * s * c


@jit_inline
def add_damping(jacobian, b, patch, k, across):
    """Add what patch `k` takes from the wheelset's speeds in y, z and roll.

    Across, -T_y t with the slope `across` of the creep law; along the normal, -(N n + T_y t) with
    the contact damping, the creep force being nearly proportional to N.
    """
    s, c = patch[NORMAL_Y, k], patch[NORMAL_Z, k]
    cy, cz = patch[C_Y, k], patch[C_Z, k]
    arm = -c * cz - s * cy
    lever = c * cy - s * cz
    jacobian[b, J_SLIP] += across * c * c
    jacobian[b, J_SLIP + 1] -= across * c * s
    jacobian[b, J_SLIP + 2] += across * c * arm
    jacobian[b, J_SLIP + 3] += across * s * s
    jacobian[b, J_SLIP + 4] -= across * s * arm
    jacobian[b, J_SLIP + 5] += across * arm * arm
    damping = patch[NORMAL_DAMPING, k]
    share = patch[T_Y, k] / patch[NORMAL, k]
    f_y, f_z, f_roll = (
        damping * (s + share * c),
        damping * (c - share * s),
        damping * (lever + share * arm),
    )
    jacobian[b, J_NORMAL] += f_y * s
    jacobian[b, J_NORMAL + 1] += f_y * c
    jacobian[b, J_NORMAL + 2] += f_y * lever
    jacobian[b, J_NORMAL + 3] += f_z * s
    jacobian[b, J_NORMAL + 4] += f_z * c
    jacobian[b, J_NORMAL + 5] += f_z * lever
    jacobian[b, J_NORMAL + 6] += f_roll * s
    jacobian[b, J_NORMAL + 7] += f_roll * c
    jacobian[b, J_NORMAL + 8] += f_roll * lever


@jit_inline
def add_creep_forces(system, work, n, speed):
    """Put the tangential forces on the wheelsets and gather the wheels' outputs."""
    contact = system.contact
    patch, force, wheel = work.patch, work.rail_force, work.wheel
    for k in range(n):
        w, side = work.patch_index[k, 0], work.patch_index[k, 1]
        b = contact.body[w]
        s, c = patch[NORMAL_Y, k], patch[NORMAL_Z, k]
        turn_y, turn_z = patch[TURN_Y, k], patch[TURN_Z, k]
        T_x, T_y = patch[T_X, k], patch[T_Y, k]
        # T_x along (1, turn_y, turn_z), T_y and the normal at right angles to it
        fx = -T_x + T_y * (turn_y * c - turn_z * s)
        fy = -T_x * turn_y - T_y * c
        fz = -T_x * turn_z + T_y * s
        cx, cy, cz = patch[C_X, k], patch[C_Y, k], patch[C_Z, k]
        mz = patch[M_Z, k]
        force[b, 0] += fx
        force[b, 1] += fy
        force[b, 2] += fz
        force[b, 3] += cy * fz - cz * fy + mz * (turn_y * s + turn_z * c)
        force[b, 4] += cz * fx - cx * fz - mz * s
        force[b, 5] += cx * fy - cy * fx - mz * c
        # in the plane of the rails
        wheel[w, side, W_Q] -= T_y * patch[ANGLE_SIN, k]
        wheel[w, side, W_Y] += T_y * patch[ANGLE_COS, k]
        # written over the speed of travel: friction work per metre of the vehicle's way
        scale = patch[PATCH_SPEED, k] / speed
        wheel[w, side, W_T_GAMMA] += scale * (T_x * patch[XI_X, k] + T_y * patch[XI_Y, k])
        wheel[w, side, W_T_GAMMA_SPIN] += scale * mz * patch[PHI, k]
        if patch[NORMAL, k] > wheel[w, side, W_NORMAL]:
            wheel[w, side, W_NORMAL] = patch[NORMAL, k]
            wheel[w, side, W_XI_X] = scale * patch[XI_X, k]
            wheel[w, side, W_XI_Y] = scale * patch[XI_Y, k]
            wheel[w, side, W_PHI] = scale * patch[PHI, k]
        along, across = 0.0, 0.0
        if patch[MU_N, k] > 0.0:
            along, across = creep_slopes(
                patch[A, k] * patch[B, k],
                patch[C11, k],
                patch[C22, k],
                patch[C23, k],
                contact.reduction * contact.shear_modulus,
                patch[MU_N, k],
                patch[XI_X, k],
                patch[XI_Y, k],
                patch[PHI, k],
            )
            along, across = along / speed, across / speed
        if system.support.elastic:
            add_slopes(work.support, w, side, patch, k, across)
            # a rail that gives way is in series with the creep force
            across /= 1.0 + across * (c * c * work.compliance[0] + s * s * work.compliance[1])
        work.contact_jacobian[b, J_ALONG] += along
        work.contact_jacobian[b, J_ALONG_LEVER] += along * cz
        work.contact_jacobian[b, J_YAW] += along * cy * cy
        add_damping(work.contact_jacobian, b, patch, k, across)
        work.events[w, 0] += 1
        work.events[w, 1] += int(patch[BEYOND, k])
    if system.support.elastic:
        for w in range(contact.body.shape[0]):
            for side in range(2):
                work.support[w, side, F_Y] = wheel[w, side, W_Y]
                work.support[w, side, F_Z] = wheel[w, side, W_Q]


@jit_inline
def wheel_rail(system, work, speed, state):
    """All wheel-rail forces on the wheelsets, track axes, into ``work.rail_force``.

    Row b of `rail_force`: force (3) and moment about the wheelset's centre (3).

    Returns
    -------
    status, wheelset, n : int
        Status code, the wheelset it concerns, number of active patches.
    """
    locate_rails(
        system.track,
        system.contact.body,
        system.bodies.frame,
        work.cell,
        work.cell_u,
        work.plane,
        work.rail,
    )
    if system.support.elastic:
        rail_motions(system, work, state)
        begin_support(work.support)
    status, w, n = normal_contact(system, work, speed, state)
    if status != RUNNING:
        return status, w, n
    for k in range(system.contact.body.shape[0]):
        b = system.contact.body[k]
        complete_normal_force(b, system.bodies, work.frames, work.relative, state, work.rail_force)
    patch = work.patch
    for k in range(n):  # here and not above, where each patch would wait for its root
        third = cube_root(patch[NORMAL, k])
        patch[A, k] *= third
        patch[B, k] *= third
    creepages(system, work, n, speed, state)
    contact = system.contact
    kalker_lookup(
        n,
        patch[A],
        patch[B],
        contact.creep,
        patch[C11],
        patch[C22],
        patch[C23],
        patch[C33],
        patch[BEYOND],
    )
    if contact.friction_rest < 1.0:
        falling_friction(
            n,
            patch[MU_N],
            patch[XI_X],
            patch[XI_Y],
            patch[PATCH_SPEED],
            contact.friction_rest,
            contact.friction_decay,
        )
    creep_forces(
        contact.law,
        n,
        contact.n_x,
        contact.n_y,
        patch[A],
        patch[B],
        patch[MU_N],
        patch[C11],
        patch[C22],
        patch[C23],
        patch[C33],
        contact.shear_modulus,
        contact.reduction,
        contact.slip_reduction,
        patch[XI_X],
        patch[XI_Y],
        patch[PHI],
        contact.law_table,
        contact.law_scale,
        work.offsets,
        work.fastsim,
        patch[T_X],
        patch[T_Y],
        patch[M_Z],
        patch[BEYOND],
    )
    add_creep_forces(system, work, n, speed)
    return RUNNING, 0, n


@jit_merged
def complete_normal_force(b, bodies, frames, C, state, force):
    """Moment vector from the generalised moments, and the force along the track.

    The wheelset's axes are C = Rz(yaw) Rx(roll); roll turns about its first axis, yaw about the
    track's normal: Q_roll = M_1, Q_yaw = M_2 sin roll + M_3 cos roll, and the normal force does no
    work on the spin, M_2 = 0.

    The potential does not depend on the place along a smooth track.  Moving along it with all
    relative coordinates held, v = e_x + omega x r and u = omega per metre, the contact does no
    work; hence F_x (1 + (omega x r)_x) = -F_y (omega x r)_y - F_z (omega x r)_z - M omega: on a
    twisted track the wheels climb the rails.  `force[b, 0]` brings the share of irregular rails.
    """
    m1 = force[b, 3]
    m3 = force[b, 5] / C[b, COS_ROLL]
    mx = C[b, 0] * m1 + C[b, 2] * m3
    my = C[b, 3] * m1 + C[b, 5] * m3
    mz = C[b, 6] * m1 + C[b, 8] * m3
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
