"""Status of a wheel that has left its contact table, or stands on none of its rails."""

from railsim.kernels import compiled
from railsim.kernels.contact_table import ABOVE_Y, BELOW_Y, N_PATCH, OUTSIDE_ROLL
from railsim.kernels.rail_parts import plain_height
from railsim.kernels.status import (
    BESIDE_RAIL,
    DERAILED,
    FALLEN,
    INWARD_RANGE,
    ROLL_RANGE,
    RUNNING,
    WHEEL_LIFT,
    WRONG_SIDE,
    YAW_RANGE,
)

MAX_PENETRATION = 1e-3  # penetration under some 2 MN, more than any wheel that climbs carries (m)
LIFT_RANGE = 0.05  # a wheel higher than this above its rail is beyond the model (m)
FALL_DEPTH = 0.02  # depth below the plain rail to which no groove lets a wheel down (m)


@compiled(python=False)
def all_far(contact, table, iy, ir, iw, tr, z):
    """Whether every patch is more than LIFT_RANGE away from its rail."""
    for patch in range(N_PATCH):
        if z - contact.values[table, patch, iw, ir, iy, 0] > -LIFT_RANGE:
            return False
    return True


@compiled
def end_status(contact, table, code, wheel, stretched):
    """Status code for a look-up outside the contact table."""
    if code == ABOVE_Y:
        return DERAILED if has_climbed(contact, table, wheel, stretched) else BESIDE_RAIL
    if code == BELOW_Y:
        return INWARD_RANGE
    if code == OUTSIDE_ROLL:
        return ROLL_RANGE
    return YAW_RANGE


@compiled
def has_climbed(contact, table, wheel, stretched):
    """Whether a wheel stands as high as the end of the table, its flange's tip over the rail's top.

    A wheel that is beyond without having been lifted there, or presses itself into the rail deeper
    than any load does, was not carried there by its rail: the step or the model is unstable.
    """
    shape = contact.values.shape
    tr = (stretched - contact.roll0) / contact.droll
    ir = min(max(int(tr), 0), shape[3] - 2)
    last = shape[4] - 3  # the last node of the range
    for patch in range(N_PATCH):
        # the top is level: yaw does not change how high the tip stands on it
        z_1 = contact.values[table, patch, 0, ir, last, 0]
        z_2 = contact.values[table, patch, 0, ir + 1, last, 0]
        if wheel.z > z_1 + (tr - ir) * (z_2 - z_1) + MAX_PENETRATION:
            return False
    return True


@compiled
def section_status(contact, table, code, wheel, stretched):
    """Status code beyond the plain table where a rail's section changes: see `end_status`.

    There a rail may end or go aside, so that a wheel leaves it without having climbed it.
    """
    status = end_status(contact, table, code, wheel, stretched)
    return WRONG_SIDE if status == BESIDE_RAIL else status


@compiled(python=False)
def fall_status(rails, piece, wheel, nearest):
    """Status of a wheel that touches no rail of a piece and whose nearest one is so far below it.

    It falls; only where it is high above the plain rail it has been lifted.
    """
    depth = wheel.z + rails.lever[piece] * wheel.roll - plain_height(rails, piece, 0.0)
    if depth > FALL_DEPTH:
        return FALLEN
    return WHEEL_LIFT if nearest < -LIFT_RANGE and depth < -LIFT_RANGE else RUNNING
