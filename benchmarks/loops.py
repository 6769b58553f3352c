"""Compiled loops over one part of the right-hand side, in the order in which it is called.

Each `many_...` repeats its part `n` times at one state, so that a call lasts some hundred
microseconds and Python's part in it does not count.  Everything is in the cache, and branches are
predicted: the sum of the parts is a lower bound of what they take in the time loop.
"""

from railsim.kernels import compiled
from railsim.kernels.contact_table import INSIDE, cell_weights, locate, look_up, stretched_roll
from railsim.kernels.creepages import creepages
from railsim.kernels.elements import link_forces, mount_forces
from railsim.kernels.fastsim import fastsim, kalker_lookup
from railsim.kernels.patches import side_by_side
from railsim.kernels.rhs import dynamics, kinematics, locate_frames, mechanics, rates_of_state
from railsim.kernels.state import ARC_LENGTH, SPEED
from railsim.kernels.support import AS_GIVEN
from railsim.kernels.wheel_contact import normal_contact
from railsim.kernels.wheel_rail import add_creep_forces, wheel_rail


@compiled
def many_right_hand_sides(system, work, state, derivative, n):
    """Everything, as RK4 calls it."""
    for _ in range(n):
        rates_of_state(system, work, state, derivative)


@compiled
def many_mechanics(system, work, state, derivative, n):
    """Everything, as the fast scheme calls it; the number of patches."""
    patches = 0
    for _ in range(n):
        _, _, patches = mechanics(system, work, state, derivative, AS_GIVEN)
    return patches


@compiled
def many_frames(system, work, state, derivative, n):
    """Track frames of all bodies."""
    origin = system.bodies.frame[system.bodies.reference]
    for _ in range(n):
        locate_frames(
            system.track,
            system.frame_offset,
            origin,
            state[ARC_LENGTH],
            work.frames,
            work.cell,
            work.cell_u,
        )


@compiled
def many_kinematics(system, work, state, derivative, n):
    """Positions, attitudes and velocities of all bodies."""
    for _ in range(n):
        kinematics(system, work, state)


@compiled
def many_links(system, work, state, derivative, n):
    """Point-to-point elements."""
    first = 12 * system.bodies.kind.shape[0]
    inner = state[first : first + system.internal.kind.shape[0]]
    for _ in range(n):
        link_forces(system, work, inner)


@compiled
def many_mounts(system, work, state, derivative, n):
    """Elements with three axes."""
    first = 12 * system.bodies.kind.shape[0]
    inner = state[first : first + system.internal.kind.shape[0]]
    for _ in range(n):
        mount_forces(system, work, inner)


@compiled
def many_wheel_rail(system, work, state, derivative, n):
    """All of the wheel-rail contact."""
    for _ in range(n):
        wheel_rail(system, work, state[SPEED], state)


@compiled
def many_normal_contacts(system, work, state, derivative, n):
    """Table look-up and normal forces of all wheels; the number of patches."""
    patches = 0
    for _ in range(n):
        _, _, patches = normal_contact(system, work, state[SPEED], state)
    return patches


@compiled
def many_creepages(system, work, state, patches, n):
    """Creepages and Kalker's coefficients of all patches."""
    patch = work.patch
    for _ in range(n):
        creepages(system, work, patches, state[SPEED], state)
        kalker_lookup(patches, side_by_side(patch), system.contact.kalker)


@compiled
def many_fastsims(system, work, state, patches, n):
    """FASTSIM of all patches."""
    law, arrays = system.contact.law, side_by_side(work.patch)
    for _ in range(n):
        fastsim(patches, law.n_x, law.n_y, arrays, law.G, work.creep.strips)


@compiled
def many_creep_forces(system, work, state, patches, n):
    """Creep forces put on the wheelsets, outputs of the wheels gathered."""
    for _ in range(n):
        add_creep_forces(system, work, patches, state[SPEED], state)


@compiled
def many_dynamics(system, work, state, derivative, n):
    """Accelerations of all bodies."""
    for _ in range(n):
        dynamics(system, work, state, derivative)


@compiled
def many_look_ups(system, work, state, derivative, n):
    """Look-ups of the tread of the leading right wheel; the number of them."""
    contact = system.contact
    b = contact.body[0]
    table = contact.table[0, 1]
    done = 0
    for _ in range(n):
        yaw = state[6 * b + 5]
        stretched, roll_slope = stretched_roll(state[6 * b + 3])
        where, iy, ir, iw, ty, tr, tw = locate(
            contact, table, state[6 * b + 1], state[6 * b + 3], stretched, yaw * yaw
        )
        if where == INSIDE:
            cell_weights(contact, ty, tr, roll_slope, work.weights)
            look_up(contact, table, 0, iy, ir, iw, tw, work.weights, work.look_up)
            done += 1
    return done


@compiled
def many_fastsim_patches(patches, n_x, n_y, arrays, shear_modulus, work, n):
    """FASTSIM of the first `patches` of some arrays of patches."""
    for _ in range(n):
        fastsim(patches, n_x, n_y, arrays, shear_modulus, work)
