"""Check rails: contact of the backs of flanges.

A check rail stands beside its running rail, the flangeway f(s) from its gauge face.  The back of
the wheel on this rail, a disc, meets it at the height of the first contact of both contours, z_c
below the axle and up to c ahead of or behind it: with q the clearance of the centred wheelset less
the flangeway (right side; the left one mirrored),

    p = -(q + f(s) + y - z_c roll) + c psi^2/(|psi| + psi_0),   N = k p + c_N p' >= 0,

y, roll and yaw psi against the rails.  The force acts at x_c, the slope of p over the yaw, which
goes to +-c; along the track it has the part N df/ds, so that what an entry flare does to the side
it takes from the run.  As c grows where the axle sinks, dc/dz = z_c/c, the rim of a yawed wheel is
lifted out of the flangeway by N z_c psi^2/(c (|psi| + psi_0)), and the normal force does no work on
the spin.  The friction mu N opposes the slip of the flange's back, which slides down
ahead of the axle, up behind it, and backwards below the rail's top.
"""

from math import sqrt

from railsim.kernels import compiled
from railsim.kernels.contact_columns import W_CHECK, W_CHECK_GAMMA
from railsim.kernels.state import ARC_LENGTH, velocity_begin
from railsim.kernels.support import SKIP

from .rails import MIDDLE_Y, RAIL_BEND, RAIL_SLOPE, ROLL, ROLL_SLOPE, SHIFT, SHIFT_SLOPE, SLOPE_Y

# columns of Contact.check: side, first and last row of its flangeway, stiffness [N/m], damping
# [N s/m], coefficient of friction
SIDE, FIRST, LAST, STIFFNESS, DAMPING, FRICTION = range(6)
CHECK_ROW = 6
# columns of Contact.check_wheel[w, c]: q [m], z_c [m], c [m], lateral position of the back from the
# wheelset's centre [m]
CLEARANCE, BELOW, REACH, BACK = range(4)
CHECK_WHEEL = 4
SMALL_YAW = 5e-4  # rad, psi_0
SMALL_SLIP = 0.02  # m/s, below which the friction falls to zero


@compiled(python=False)
def add_check_rails(system, work, speed, state):
    """Put the forces of check rails on the wheelsets, and into `work.wheel`."""
    contact, wheel = system.contact, work.wheel
    for w in range(contact.body.shape[0]):
        if system.support.elastic and work.support_step[w, SKIP] > 0.0:
            continue
        b = contact.body[w]
        s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]]
        for side in range(2):
            wheel[w, side, W_CHECK] = 0.0
            wheel[w, side, W_CHECK_GAMMA] = 0.0
        for c in range(contact.check.shape[0]):
            first, last = int(contact.check[c, FIRST]), int(contact.check[c, LAST])
            table = contact.check_flangeway
            if s >= table[first, 0] and s <= table[last, 0]:
                i = first
                while i < last - 1 and s > table[i + 1, 0]:
                    i += 1
                slope = (table[i + 1, 1] - table[i, 1]) / (table[i + 1, 0] - table[i, 0])
                flangeway = table[i, 1] + slope * (s - table[i, 0])
                add_check_rail(system, work, speed, state, w, c, flangeway, slope)


@compiled(python=False)
def add_check_rail(system, work, speed, state, w, c, flangeway, slope):
    """Force of check rail `c` on wheelset `w`, where its flangeway has a width and slope."""
    contact, force, wheel = system.contact, work.rail_force, work.wheel
    b = contact.body[w]
    side = int(contact.check[c, SIDE])
    sign = 2.0 * side - 1.0
    n = system.bodies.kind.shape[0]
    q, v = 6 * b, velocity_begin(n) + 6 * b
    z_c, reach = contact.check_wheel[w, c, BELOW], contact.check_wheel[w, c, REACH]
    roll, yaw = state[q + 3] - work.plane[w, ROLL], state[q + 5] - work.rail[w, side, RAIL_SLOPE]
    y = sign * (state[q + 1] - work.plane[w, MIDDLE_Y] - work.rail[w, side, SHIFT] - z_c * roll)
    size = abs(yaw) + SMALL_YAW
    p = reach * yaw * yaw / size - (contact.check_wheel[w, c, CLEARANCE] + flangeway + y)
    if p <= 0.0:
        return
    x_c = reach * yaw * (abs(yaw) + 2.0 * SMALL_YAW) / (size * size)
    # rates of the Euler angles were left here by the kinematics
    roll_rate = work.acceleration[b, 3] - speed * work.plane[w, ROLL_SLOPE]
    yaw_rate = work.acceleration[b, 5] - speed * work.rail[w, side, RAIL_BEND]
    y_rate = state[v + 1] - speed * (work.plane[w, SLOPE_Y] + work.rail[w, side, SHIFT_SLOPE])
    p_rate = x_c * yaw_rate - speed * slope - sign * (y_rate - z_c * roll_rate)
    N = contact.check[c, STIFFNESS] * p + contact.check[c, DAMPING] * p_rate
    work.force_rate[w] = max(work.force_rate[w], contact.check[c, STIFFNESS] * abs(p_rate))
    if N <= 0.0:
        return
    # the wheel's material at the contact: forward and down
    spin, x = state[v + 4], -sign * x_c
    forward, down = speed + state[v] + spin * z_c, state[v + 2] - spin * x
    slip = sqrt(forward * forward + down * down + SMALL_SLIP * SMALL_SLIP)
    friction = contact.check[c, FRICTION] * N / slip
    cy = sign * contact.check_wheel[w, c, BACK]
    fx, fy, fz = -friction * forward, sign * N, -friction * down
    force[b, 0] += fx + N * slope
    force[b, 1] += fy
    force[b, 2] += fz
    if reach > 0.0:
        force[b, 2] -= N * z_c * yaw * yaw / (size * reach)
    # of the normal force about the wheelset's own axes, so that it does no work on the spin
    roll_moment = -z_c * fy
    force[b, 3] += roll_moment + cy * fz
    force[b, 4] += yaw * roll_moment + z_c * fx - (x - yaw * cy) * fz
    force[b, 5] += x * fy - cy * (fx + N * slope)
    wheel[w, side, W_CHECK] += N
    wheel[w, side, W_CHECK_GAMMA] += friction * (forward * forward + down * down) / speed
