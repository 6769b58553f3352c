"""Largest and smallest values of a run, taken at the time loop's own steps.

Outputs are samples: between two of them a wheel may have struck its rail.  Rows of `Work.extremes`
are the largest value, its time and the arc length of the reference body there, then the same of the
smallest one; columns the quantities of each wheelset.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import rarely
from railsim.kernels.contact_columns import W_Q, W_T_GAMMA, W_Y
from railsim.kernels.lanes import LANES, any_beyond, larger, load_lanes, smaller, spread
from railsim.kernels.rails import against_rails
from railsim.kernels.state import ARC_LENGTH, TIME
from railsim.kernels.system import Z_0

# columns of Work.extremes; those of a wheel are followed by the same of the right one
(
    X_Q,
    X_Q_RIGHT,
    X_Y,
    X_Y_RIGHT,
    X_Y_OVER_Q,
    X_Y_OVER_Q_RIGHT,
    X_T_GAMMA,
    X_T_GAMMA_RIGHT,
    X_SUM_Y,
    X_SUM_ABS_Y,
    X_LATERAL,
    X_ROLL,
    X_YAW,
) = range(13)
EXTREMES = 16
# rows
MAX, MIN = 0, 3


@compiled(python=False)
def note_unloaded(wheel, h, unloaded):
    """Add a step of length `h` to the time of every wheel that carries nothing."""
    for w in range(wheel.shape[0]):
        for side in range(2):
            if wheel[w, side, W_Q] <= 0.0:
                unloaded[w, side] += h


@compiled(python=False)
def note_extremes(system, work, state):
    """Take the values of this instant into the extremes."""
    wheel, plane, present, extremes = work.wheel, work.plane, work.present, work.extremes
    time, s = state[TIME], state[ARC_LENGTH]
    body = system.contact.body
    for w in range(body.shape[0]):
        b = 6 * body[w]
        for side in range(2):
            Q, Y = wheel[w, side, W_Q], wheel[w, side, W_Y]
            present[X_Q + side] = Q
            present[X_Y + side] = Y
            # a wheel that carries nothing has no derailment quotient
            present[X_Y_OVER_Q + side] = (2 * side - 1) * Y / Q if Q > 0.0 else np.nan
            present[X_T_GAMMA + side] = wheel[w, side, W_T_GAMMA]
        left, right = present[X_Y], present[X_Y_RIGHT]
        present[X_SUM_Y] = left + right
        present[X_SUM_ABS_Y] = abs(left) + abs(right)
        height = system.bodies.row[body[w], Z_0]
        y, z, roll = state[b + 1], state[b + 2] + height, state[b + 3]
        yaw = state[b + 5]
        present[X_LATERAL], present[X_ROLL] = against_rails(
            plane, system.track.rail_base, w, y, z, roll, yaw, work.rail_motion
        )
        present[X_YAW] = yaw
        high, low = EXTREMES * (MAX * body.shape[0] + w), EXTREMES * (MIN * body.shape[0] + w)
        beyond = spread(0.0)
        for first in range(0, EXTREMES, LANES):
            now = load_lanes(present, first)
            most, least = load_lanes(extremes, high + first), load_lanes(extremes, low + first)
            beyond = beyond + (larger(most, now) - most) + (least - smaller(least, now))
        if not rarely(any_beyond(beyond, 0.0)):
            continue
        for k in range(EXTREMES):  # those without a quantity are 0
            value = present[k]
            if value > extremes[MAX, w, k]:
                extremes[MAX, w, k] = value
                extremes[MAX + 1, w, k] = time
                extremes[MAX + 2, w, k] = s
            if value < extremes[MIN, w, k]:
                extremes[MIN, w, k] = value
                extremes[MIN + 1, w, k] = time
                extremes[MIN + 2, w, k] = s
