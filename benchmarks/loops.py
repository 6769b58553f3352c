"""Compiled loops over one part of the right-hand side, in the order in which it is called.

`many` repeats a part at one state, so that a call lasts some hundred microseconds and Python's part
in it does not count.  Everything is in the cache, and branches are predicted: the sum of the parts
is a lower bound of what they take in the time loop.
"""

from enum import IntEnum

from railsim.kernels import compiled
from railsim.kernels.contact_table import (
    INSIDE,
    find_cell,
    look_up,
    set_cell_weights,
    stretched_roll,
)
from railsim.kernels.creepages import set_creepages
from railsim.kernels.elements import add_link_forces, add_mount_forces
from railsim.kernels.fastsim import fastsim, look_up_kalker
from railsim.kernels.patches import patch_arrays
from railsim.kernels.rhs import (
    locate_frames,
    set_accelerations,
    set_all_rates,
    set_body_rates,
    set_kinematics,
)
from railsim.kernels.state import ARC_LENGTH, SPEED
from railsim.kernels.support import KEEP_RAILS
from railsim.kernels.wheel_contact import add_normal_contact
from railsim.kernels.wheel_rail import add_creep_forces, set_wheel_rail_forces


class Part(IntEnum):
    """What is repeated."""

    RIGHT_HAND_SIDE = 0  # everything, as RK4 calls it
    MECHANICS = 1  # everything, as the fast scheme calls it
    FRAMES = 2  # track frames of all bodies
    KINEMATICS = 3  # positions, attitudes and velocities of all bodies
    LINKS = 4  # point-to-point elements
    MOUNTS = 5  # elements with three axes
    WHEEL_RAIL = 6  # all of the wheel-rail contact
    NORMAL_CONTACT = 7  # table look-up and normal forces of all wheels
    CREEPAGES = 8  # creepages and Kalker's coefficients of all patches
    FASTSIM = 9  # of all patches
    CREEP_FORCES = 10  # put on the wheelsets, outputs of the wheels gathered
    DYNAMICS = 11  # accelerations of all bodies
    LOOK_UP = 12  # of the tread of the leading right wheel


@compiled
def many(part, system, work, state, derivative, patches, n):
    """Repeat a part `n` times; return the number of patches.

    One function for all parts: a function for each took a third longer to compile.
    """
    first = 12 * system.bodies.kind.shape[0]
    inner = state[first : first + system.internal.kind.shape[0]]
    origin = system.bodies.frame[system.bodies.reference]
    arrays, law, contact = patch_arrays(work.patch), system.contact.law, system.contact
    for _ in range(n):
        if part == Part.RIGHT_HAND_SIDE:
            set_all_rates(system, work, state, derivative)
        elif part == Part.MECHANICS:
            _, _, patches = set_body_rates(system, work, state, derivative, KEEP_RAILS)
        elif part == Part.FRAMES:
            locate_frames(
                system.track,
                system.frame_offset,
                origin,
                state[ARC_LENGTH],
                work.frames,
                work.cell,
                work.cell_u,
            )
        elif part == Part.KINEMATICS:
            set_kinematics(system, work, state)
        elif part == Part.LINKS:
            add_link_forces(system, work, inner)
        elif part == Part.MOUNTS:
            add_mount_forces(system, work, inner)
        elif part == Part.WHEEL_RAIL:
            set_wheel_rail_forces(system, work, state[SPEED], state)
        elif part == Part.NORMAL_CONTACT:
            _, _, patches = add_normal_contact(system, work, state[SPEED], state)
        elif part == Part.CREEPAGES:
            set_creepages(system, work, patches, state[SPEED], state)
            look_up_kalker(patches, arrays, contact.kalker)
        elif part == Part.FASTSIM:
            fastsim(patches, law.n_x, law.n_y, arrays, law.G, work.creep.strips)
        elif part == Part.CREEP_FORCES:
            add_creep_forces(system, work, patches, state[SPEED], state)
        elif part == Part.DYNAMICS:
            set_accelerations(system, work, state, derivative)
        else:
            _look_up(contact, work, state)
    return patches


@compiled
def _look_up(contact, work, state):
    b = contact.body[0]
    table = contact.table[0, 1]
    yaw = state[6 * b + 5]
    stretched, roll_slope = stretched_roll(state[6 * b + 3])
    where, iy, ir, iw, ty, tr, tw = find_cell(
        contact, table, state[6 * b + 1], state[6 * b + 3], stretched, yaw * yaw
    )
    if where == INSIDE:
        set_cell_weights(contact, ty, tr, roll_slope, work.weights)
        look_up(contact, table, 0, iy, ir, iw, tw, work.weights, work.look_up)


@compiled
def many_fastsim_patches(patches, n_x, n_y, arrays, shear_modulus, work, n):
    """FASTSIM of the first `patches` of some arrays of patches."""
    for _ in range(n):
        fastsim(patches, n_x, n_y, arrays, shear_modulus, work)
