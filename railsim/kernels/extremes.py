"""Largest and smallest values of a run, taken at the time loop's own steps.

Outputs are samples: between two of them a wheel may have struck its rail.  Rows of `Work.extremes`
are the largest value, its time and the arc length of the reference body there, then the same of the
smallest one; columns the quantities of each wheelset.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.contact_columns import W_Q, W_T_GAMMA, W_Y
from railsim.kernels.lanes import LANES, any_beyond, load_lanes, maximum, minimum, splat
from railsim.kernels.rails import position_on_rails
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
def add_unloaded_time(wheel, h, unloaded):
    """Add a step of length `h` to the time of every wheel that carries nothing."""
    for w in range(wheel.shape[0]):
        for side in range(2):
            if wheel[w, side, W_Q] <= 0.0:
                unloaded[w, side] += h


@compiled(python=False)
def update_extremes(system, work, state):
    """Update the extremes by the values of this instant."""
    wheel, plane, current, extremes = work.wheel, work.plane, work.current, work.extremes
    time, s = state[TIME], state[ARC_LENGTH]
    body = system.contact.body
    for w in range(body.shape[0]):
        b = 6 * body[w]
        for side in range(2):
            Q, Y = wheel[w, side, W_Q], wheel[w, side, W_Y]
            current[X_Q + side] = Q
            current[X_Y + side] = Y
            # a wheel that carries nothing has no derailment quotient
            current[X_Y_OVER_Q + side] = (2 * side - 1) * Y / Q if Q > 0.0 else np.nan
            current[X_T_GAMMA + side] = wheel[w, side, W_T_GAMMA]
        Y_left, Y_right = current[X_Y], current[X_Y_RIGHT]
        current[X_SUM_Y] = Y_left + Y_right
        current[X_SUM_ABS_Y] = abs(Y_left) + abs(Y_right)
        height = system.bodies.row[body[w], Z_0]
        y, z, roll = state[b + 1], state[b + 2] + height, state[b + 3]
        yaw = state[b + 5]
        current[X_LATERAL], current[X_ROLL] = position_on_rails(
            plane, system.track.rail_base, w, y, z, roll, yaw, work.rail_motion
        )
        current[X_YAW] = yaw
        high, low = EXTREMES * (MAX * body.shape[0] + w), EXTREMES * (MIN * body.shape[0] + w)
        excess = splat(0.0)
        for first in range(0, EXTREMES, LANES):
            now = load_lanes(current, first)
            max_0, min_0 = load_lanes(extremes, high + first), load_lanes(extremes, low + first)
            excess = excess + (maximum(max_0, now) - max_0) + (min_0 - minimum(min_0, now))
        if not unlikely(any_beyond(excess, 0.0)):
            continue
        for k in range(EXTREMES):  # those without a quantity are 0
            value = current[k]
            if value > extremes[MAX, w, k]:
                extremes[MAX, w, k] = value
                extremes[MAX + 1, w, k] = time
                extremes[MAX + 2, w, k] = s
            if value < extremes[MIN, w, k]:
                extremes[MIN, w, k] = value
                extremes[MIN + 1, w, k] = time
                extremes[MIN + 2, w, k] = s
