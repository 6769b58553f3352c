"""What it means that a wheel has left its contact table."""

from railsim.kernels import compiled
from railsim.kernels.contact_table import ABOVE_Y, BELOW_Y, N_PATCH, OUTSIDE_ROLL
from railsim.kernels.status import BESIDE_RAIL, DERAILED, INWARD_RANGE, ROLL_RANGE, YAW_RANGE

DEEPEST = 1e-3  # penetration under some 2 MN, more than any wheel that climbs carries (m)
LIFT_RANGE = 0.05  # a wheel higher than this above its rail is beyond the model (m)


@compiled(python=False)
def all_far(contact, table, iy, ir, iw, tr, z):
    """Whether every patch is more than LIFT_RANGE away from its rail."""
    for patch in range(N_PATCH):
        if z - contact.values[table, patch, iw, ir, iy, 0] > -LIFT_RANGE:
            return False
    return True


@compiled
def outside(contact, table, where, wheel, stretched):
    """Status code for a look-up outside the contact table."""
    if where == ABOVE_Y:
        return DERAILED if has_climbed(contact, table, wheel, stretched) else BESIDE_RAIL
    if where == BELOW_Y:
        return INWARD_RANGE
    if where == OUTSIDE_ROLL:
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
        here = contact.values[table, patch, 0, ir, last, 0]
        following = contact.values[table, patch, 0, ir + 1, last, 0]
        if wheel.z > here + (tr - ir) * (following - here) + DEEPEST:
            return False
    return True
