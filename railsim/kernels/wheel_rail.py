"""Forces between wheelsets and rails: elastic normal contact, creepages, creep forces.

Per wheel and patch, with the table's gap g and stiffness K (see `contact_table`):

- penetration p = z - g, less what the loads of neighbouring patches bend the surfaces; elastic
  normal force as the gradient of the potential U, which includes the terms from the change of the
  stiffnesses along the profile (`couple_approaches`); position, direction and ellipse of the patch
  under its load (`patch_under_load`); y, z, roll of the wheelset in the plane of the rails, yaw
  against each rail's own direction (see `rails`);
- contact damping c_N on the *geometric* rate of approach, faded in over 30 um, the sum never
  pulling;
- the rail at the patch has the direction d = (1, t_y, t_z), from the turn of the frame at that
  point, omega x rho, and the slopes of displaced rails; c from the wheelset's centre to the patch,
  c_x = (c_x/yaw)(yaw - t_y) - t_y c_y - t_z c_z with the table's (c_x/yaw);
- creepages from the velocity of the wheel's material at the patch, v = V e_x + w_F x r + r'
  + w_abs x c less that of the rail's material (none where the rail is rigid: a slope of its shape
  is no velocity), along d and at right angles to it, over V_p = V (1 + (omega x rho)_x) + x', the
  speed at which the patch runs along its rail;
- tangential forces by the creep law for all patches of the vehicle in one call; they may follow
  the creepages (`transient`).

Forces on the rail in the plane of the rails: Y = T_y cos g + N sin g, Q = -T_y sin g + N cos g with
the angle g > 0 where the normal leans to the right; on the wheel the opposite, with moment c x F.
"""

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.check_rails import add_check_rails
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    BEYOND,
    C_X,
    C_Y,
    C_Z,
    J_ALONG,
    J_SECANT,
    J_SECANT_C_Z,
    J_SECANT_YAW,
    M_Z,
    NORMAL,
    NORMAL_DAMPING,
    NORMAL_STIFFNESS,
    NORMAL_Y,
    NORMAL_Z,
    PATCH_SPEED,
    PHI,
    SECANT_ALONG,
    SLOPE_ACROSS,
    SLOPE_ALONG,
    T_X,
    T_Y,
    TANGENT_Y,
    TANGENT_Z,
    W_C_Y,
    W_C_Z,
    W_NORMAL,
    W_PHI,
    W_Q,
    W_T_GAMMA,
    W_T_GAMMA_SPIN,
    W_XI_X,
    W_XI_Y,
    W_Y,
    XI_X,
    XI_Y,
    A,
    B,
)
from railsim.kernels.contact_damping import (
    COUPLING_SPEED,
    add_rail_slopes,
    add_slip_coupling,
    add_wheelset_damping,
    clear_support,
    estimate_creep_slopes,
)
from railsim.kernels.creep import creep_forces, reduce_friction
from railsim.kernels.creepages import set_creepages
from railsim.kernels.cube_root import cube_root
from railsim.kernels.fastsim import look_up_kalker
from railsim.kernels.patches import patch_arrays
from railsim.kernels.rails import locate_rails
from railsim.kernels.state import ARC_LENGTH, LAST_STEP
from railsim.kernels.status import RUNNING
from railsim.kernels.support import PATCHES, SKIP, add_lms_slopes, set_compliance, set_rail_motions
from railsim.kernels.system import IMPLICIT
from railsim.kernels.transient import delay_creepages, restore_creepages
from railsim.kernels.user_laws import user_friction
from railsim.kernels.wheel_contact import add_normal_contact, complete_normal_force


@compiled(python=False)
def add_creep_forces(system, work, n, speed, state):
    """Put the tangential forces on the wheelsets and gather the wheels' outputs."""
    contact = system.contact
    patch, force, wheel = work.patch, work.rail_force, work.wheel
    stiff = work.stepping[IMPLICIT] * abs(state[LAST_STEP])
    for k in range(n):
        w, side = work.patch_index[k, 0], work.patch_index[k, 1]
        b = contact.body[w]
        s, c = patch[NORMAL_Y, k], patch[NORMAL_Z, k]
        t_y, t_z = patch[TANGENT_Y, k], patch[TANGENT_Z, k]
        T_x, T_y = patch[T_X, k], patch[T_Y, k]
        # T_x along (1, t_y, t_z), T_y and the normal at right angles to it
        fx = -T_x + T_y * (t_y * c - t_z * s)
        fy = -T_x * t_y - T_y * c
        fz = -T_x * t_z + T_y * s
        cx, cy, cz = patch[C_X, k], patch[C_Y, k], patch[C_Z, k]
        mz = patch[M_Z, k]
        force[b, 0] += fx
        force[b, 1] += fy
        force[b, 2] += fz
        force[b, 3] += cy * fz - cz * fy + mz * (t_y * s + t_z * c)
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
            wheel[w, side, W_C_Y] = cy
            wheel[w, side, W_C_Z] = cz
        secant, across = patch[SECANT_ALONG, k], patch[SLOPE_ACROSS, k]
        damping = patch[NORMAL_DAMPING, k]
        if system.support.elastic:
            add_rail_slopes(work, w, side, k, across, contact.shear[contact.table[w, side]])
            work.support[w, side, PATCHES] += float(1 << work.patch_index[k, 2])
            # a rail that gives way is in series with creep force and contact
            y, z, lag = work.compliance[0], work.compliance[1], work.compliance[2]
            across /= 1.0 + across * (c * c * y + s * s * z)
            contact_damping = damping + lag * patch[NORMAL_STIFFNESS, k]
            damping /= 1.0 + contact_damping * (s * s * y + c * c * z)
        else:  # over long steps, see `model.time_step`
            damping += stiff * patch[NORMAL_STIFFNESS, k]
        work.contact_jacobian[b, J_ALONG] += patch[SLOPE_ALONG, k]
        work.contact_jacobian[b, J_SECANT] += secant
        work.contact_jacobian[b, J_SECANT_C_Z] += secant * cz
        work.contact_jacobian[b, J_SECANT_YAW] += secant * cy * cy
        add_wheelset_damping(work, b, k, across, damping)
        work.events[w, 0] += 1
        work.events[w, 1] += int(patch[BEYOND, k])
    if system.support.elastic:
        add_lms_slopes(system, work, state)


@compiled(python=False)
def set_wheel_rail_forces(system, work, speed, state):
    """All wheel-rail forces on the wheelsets, track axes, into ``work.rail_force``.

    Row b of `rail_force`: force (3) and moment about the wheelset's centre (3).

    Returns
    -------
    status, wheelset, n : int
        Status code, the wheelset it concerns, number of active patches.
    """
    locate_rails(system, work, state[ARC_LENGTH])
    if system.support.elastic:
        set_rail_motions(system, work, state)
        set_compliance(system, work, state)
        clear_support(work.support, work.support_step)
    status, w, n = add_normal_contact(system, work, speed, state)
    if status != RUNNING:
        return status, w, n
    for k in range(system.contact.body.shape[0]):
        b = system.contact.body[k]
        if system.support.elastic and work.support_step[k, SKIP] > 0.0:
            continue
        complete_normal_force(system, work, b, state)
    if unlikely(system.contact.check.shape[0] > 0):
        add_check_rails(system, work, speed, state)
    patch = work.patch
    for k in range(n):  # here and not above, where each patch would wait for its root
        third = cube_root(patch[NORMAL, k])
        patch[A, k] *= third
        patch[B, k] *= third
    set_creepages(system, work, n, speed, state)
    contact = system.contact
    patches = patch_arrays(patch)
    look_up_kalker(n, patches, contact.kalker)
    if unlikely(contact.friction_law != 0):
        user_friction(n, patches, patch[PATCH_SPEED], contact.friction_law, contact.friction_block)
    elif unlikely(contact.friction_rest < 1.0):
        reduce_friction(
            n, patches, patch[PATCH_SPEED], contact.friction_rest, contact.friction_decay
        )
    if unlikely(contact.transient != 0):
        delay_creepages(system, work, n, state)
    creep_forces(n, contact.law, patches, work.creep)
    G = contact.law.k_adhesion * contact.law.G
    slopes = patch[SLOPE_ALONG], patch[SLOPE_ACROSS], patch[SECANT_ALONG]
    estimate_creep_slopes(n, patches, speed, G, *slopes)
    if unlikely(contact.transient != 0):
        restore_creepages(system, work, n, state)
    if unlikely(speed < COUPLING_SPEED):
        add_slip_coupling(system, work, n)
    add_creep_forces(system, work, n, speed, state)
    return RUNNING, 0, n
