"""Where the rails are under each wheelset, and the plane through their tops.

Irregularities displace the rails in the axes of the track frame, (y_l, z_l) and (y_r, z_r) over
the arc length.  Under a wheelset they make a track of their own, with

- its middle y_m, z_m, the mean of both rails: alignment and longitudinal level;
- its roll rho = asin((z_r - z_l)/2 b_0), 2 b_0 the distance of the rails (1.5 m at 1435 mm): the
  cross level.  It turns the rail heads and the axes of Y and Q as cant does;
- the rails' distances from the middle in that plane, +-(y_r - y_l)/2: the gauge.

So rails are the same whether written as plan, vertical profile and cant or as irregularities.
Slopes along the track are those of the rails' *shape*: rails are at rest, and a wheel that follows
them does not slip.

**Motion of a rail itself.**  `Work.rail_motion[w, side]` holds what a rail yields under its wheel,
in the axes of the plane: displacement y, z [m] and velocity y', z' [m/s].  It adds to the rail's
position and to its rate and, other than a shape, is a velocity of the rail's material, against
which the wheel slips.  On rigid rails all four are zero.
"""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.lanes import (
    gather_pairs,
    load_lanes,
    load_rows,
    pair_starts,
    paired_numbers,
    row_starts,
    shift_seconds,
    square_root,
    store_rows,
    swap_pairs,
)
from railsim.kernels.rotation import arc_sine_lanes
from railsim.kernels.state import ARC_LENGTH, SPEED, smoothed_begin
from railsim.kernels.system import HORIZON, RAILS_AT
from railsim.kernels.track_frame import (
    MU_LEFT,
    Y_LEFT,
    Y_RIGHT,
    Z_LEFT,
    Z_RIGHT,
    polynomial,
    track_cell,
)

PAIRS = 4  # wheelsets in eight lanes, one a rail: left, right, left, ...
SIDES = np.array([-1.0, 1.0] * PAIRS)

# columns of Work.plane[w]: middle of the rails, their slopes; roll of the plane, its sine, cosine
# and rate along the track; second and third derivatives of z and roll along the track
MIDDLE_Y, MIDDLE_Z, SLOPE_Y, SLOPE_Z, ROLL, SINE, COSINE, ROLL_SLOPE = range(8)
BEND_Z, BEND_ROLL, THIRD_Z, THIRD_ROLL = range(8, 12)
PLANE_SIZE = 16  # whole cache lines

# columns of Work.rail[w, side]: friction; distance of the rail to the right of its nominal position
# in the plane, its slope; slope of the rail in the frame's lateral direction, that slope's change
FRICTION, SHIFT, SHIFT_SLOPE, RAIL_SLOPE, RAIL_BEND = range(5)
RAIL_SIZE = 8

# columns of Work.rail_motion[w, side]
MOTION_Y, MOTION_Z, MOTION_Y_RATE, MOTION_Z_RATE = range(4)
MOTION_SIZE = 4

# columns of Work.rate_change[side]: how the rates of a wheel beside its rail are about to change
CHANGE_Y, CHANGE_Z, CHANGE_ROLL = range(3)
RATE_CHANGE_SIZE = 4


@compiled
def locate_rails(system, work, s):
    """Rails under all wheelsets, the reference body being at arc length `s` [m].

    Beyond the end of the track's table a wheelset keeps what was under it.
    """
    if work.stepping[RAILS_AT] == s:
        return
    work.stepping[RAILS_AT] = s
    track, body, frame = system.track, system.contact.body, system.bodies.frame
    for w in range(body.shape[0]):
        i, u = track_cell(track, s + system.frame_offset[frame[body[w]]])
        if i >= 0:
            work.rail_cell[w], work.rail_u[w] = i, u
    interpolate_rails(track, work.rail_cell, work.rail_u, work.plane, work.rail)


@compiled(python=False)
def interpolate_rails(track, cell, cell_u, plane, rail):
    """Rails of wheelsets at `cell_u` [m] in the cells `cell` of a track's tables.

    Parameters
    ----------
    track : TrackTables
    cell, cell_u : int64[w], float64[w]
    plane : float64[w, PLANE_SIZE];  rail : float64[w, 2, RAIL_SIZE]
        Written; where no rail is displaced only the friction.
    """
    for first in range(0, cell.shape[0], PAIRS):
        wheels = paired_numbers(first, cell.shape[0])
        i, rails = row_starts(gather_pairs(cell, wheels), 24), row_starts(wheels, RAIL_SIZE)
        u = load_rows(cell_u, pair_starts(wheels, 0, 1, 0), 0, 1)[0]
        m0, m1, m2, m3 = load_rows(track.rail, shift_seconds(i, 4), 4 * MU_LEFT, 4)
        friction, _, _ = polynomial(m0, m1, m2, m3, u)
        if not track.has_irregularity:
            store_rows(rail, rails, FRICTION, (friction,))
            continue
        y0, y1, y2, y3, z0, z1, z2, z3 = load_rows(track.rail, shift_seconds(i, 8), 0, 8)
        y, y_slope, y_bend = polynomial(y0, y1, y2, y3, u)
        z, z_slope, z_bend = polynomial(z0, z1, z2, z3, u)
        side = load_lanes(SIDES, 0)
        sine = side * (z - swap_pairs(z)) / track.rail_base
        cosine = square_root(1.0 - sine * sine)
        planes = pair_starts(wheels, 0, PLANE_SIZE, 0)
        store_rows(
            plane,
            planes,
            0,
            (
                0.5 * (y + swap_pairs(y)),
                0.5 * (z + swap_pairs(z)),
                0.5 * (y_slope + swap_pairs(y_slope)),
                0.5 * (z_slope + swap_pairs(z_slope)),
                arc_sine_lanes(sine),
                sine,
                cosine,
                side * (z_slope - swap_pairs(z_slope)) / (track.rail_base * cosine),
            ),
        )
        third, per_width = 6.0 * z3, side / (track.rail_base * cosine)
        store_rows(
            plane,
            planes,
            BEND_Z,
            (
                0.5 * (z_bend + swap_pairs(z_bend)),
                per_width * (z_bend - swap_pairs(z_bend)),
                0.5 * (third + swap_pairs(third)),
                per_width * (third - swap_pairs(third)),
            ),
        )
        shift, shift_slope = 0.5 * (y - swap_pairs(y)), 0.5 * (y_slope - swap_pairs(y_slope))
        store_rows(rail, rails, 0, (friction, shift, shift_slope, y_slope, y_bend))


@compiled(python=False)
def predict_rate_changes(system, work, w, state):
    """How the rates of wheelset `w` beside its rails will have changed after `HORIZON`.

    The rails' slopes are those where the wheelset will then be; the wheelset is taken to keep its
    acceleration, so that nothing changes for one that follows its rails.  Of `Work.rate_change` are
    written rates of y, z [m/s] and roll [rad/s] by side; zero beyond the end of the track's table.
    """
    plane, rail, rate_change, h = work.plane, work.rail, work.rate_change, work.stepping[HORIZON]
    b = system.contact.body[w]
    speed = state[SPEED]
    row = smoothed_begin(system.bodies.kind.shape[0], system.internal.kind.shape[0]) + 6 * b
    s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]] + speed * h
    i, u = track_cell(system.track, s)
    change = speed if i >= 0 else 0.0
    for side in range(2):
        y_slope, z_slope = 0.0, 0.0
        if i >= 0:
            y, z = (Y_RIGHT, Z_RIGHT) if side else (Y_LEFT, Z_LEFT)
            c = system.track.rail
            _, y_slope, _ = polynomial(c[i, y, 0], c[i, y, 1], c[i, y, 2], c[i, y, 3], u)
            _, z_slope, _ = polynomial(c[i, z, 0], c[i, z, 1], c[i, z, 2], c[i, z, 3], u)
        arm = (side - 0.5) * system.track.rail_base * plane[w, COSINE]
        now = plane[w, SLOPE_Z] + arm * plane[w, ROLL_SLOPE]
        rate_change[side, CHANGE_Y] = (
            change * (rail[w, side, RAIL_SLOPE] - y_slope) + h * state[row + 1]
        )
        rate_change[side, CHANGE_Z] = change * (now - z_slope) + h * state[row + 2]
        rate_change[side, CHANGE_ROLL] = h * state[row + 3]


@compiled(inline=True)
def position_on_rails(plane, rail_base, w, y, z, roll, yaw, deflection):
    """Lateral displacement and roll of wheelset `w` against its irregular, deflected rails.

    The displacement is that of the wheelset's centre from the middle of the rails, along the line
    over their tops; the roll is that against this line, which a yawed axle on sloping rails is not
    at right angles to.

    Parameters
    ----------
    plane : float64[w, PLANE_SIZE]
    rail_base : float
        See `TrackTables` [m].
    y, z, roll, yaw : float
        Centre of the wheelset in the track frame, z from the rail tops [m]; roll and yaw [rad].
    deflection : float64[w, 2, 2 or more]
        y and z by which each rail yields, in the axes of their plane [m].
    """
    left_y, left_z = deflection[w, 0, MOTION_Y], deflection[w, 0, MOTION_Z]
    right_y, right_z = deflection[w, 1, MOTION_Y], deflection[w, 1, MOTION_Z]
    sine, cosine = plane[w, SINE], plane[w, COSINE]
    y -= plane[w, MIDDLE_Y]
    z -= plane[w, MIDDLE_Z]
    rail_roll = (right_z - left_z) / rail_base
    across = cosine * y + sine * z - 0.5 * (left_y + right_y)
    up = cosine * z - sine * y - 0.5 * (left_z + right_z)
    return across + rail_roll * up, roll - plane[w, ROLL] + plane[w, SLOPE_Z] * yaw - rail_roll


@compiled(in_loop=False)
def write_positions_on_rails(track, body, offset, height, states, deflection, plane, rail, out):
    """`position_on_rails` of all wheelsets in recorded states.

    Parameters
    ----------
    track : TrackTables
    body : int64[w]
        Body of each wheelset.
    offset, height : float64[w]
        Of each wheelset from the reference body along the track and from the rail tops [m].
    states : float64[time, n_state]
    deflection : float64[time, w, 2, 2]
        y and z by which each rail yields, in the axes of their plane [m].
    plane : float64[w, PLANE_SIZE];  rail : float64[w, 2, RAIL_SIZE]
        Scratch; the planes as those of smooth rails.
    out : float64[time, w, 2]
        Lateral displacement [m] and roll [rad] (output).
    """
    n = body.shape[0]
    cell, cell_u = np.zeros(n, dtype=np.int64), np.zeros(n)
    for i in range(states.shape[0]):
        for w in range(n if track.has_irregularity else 0):
            k, u = track_cell(track, states[i, ARC_LENGTH] + offset[w])
            if k >= 0:
                cell[w], cell_u[w] = k, u
        if track.has_irregularity:
            interpolate_rails(track, cell, cell_u, plane, rail)
        for w in range(n):
            b = 6 * body[w]
            y, z, roll = states[i, b + 1], states[i, b + 2] + height[w], states[i, b + 3]
            yaw = states[i, b + 5]
            out[i, w, 0], out[i, w, 1] = position_on_rails(
                plane, track.rail_base, w, y, z, roll, yaw, deflection[i]
            )
