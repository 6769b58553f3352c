"""Where the rails are under each wheelset, and the plane through their tops.

Irregularities displace the rails in the axes of the track frame, (y_l, z_l) and (y_r, z_r) over
the arc length.  Under a wheelset they make a track of their own, with

- its middle y_m, z_m, the mean of both rails: alignment and longitudinal level;
- its roll rho = asin((z_r - z_l)/2 b_0), 2 b_0 = 1.5 m: the cross level.  It turns the rail heads
  and the axes of Y and Q as cant does;
- the rails' distances from the middle in that plane, +-(y_r - y_l)/2: the gauge.

So rails are the same whether written as plan, vertical profile and cant or as irregularities.
Slopes along the track are those of the rails' *shape*: rails are at rest, and a wheel that follows
them does not slip.

**Motion of a rail itself.**  `Work.rail_motion[w, side]` holds what a rail yields under its wheel,
in the axes of the plane: displacement y, z [m] and velocity y', z' [m/s].  It adds to the rail's
position and to its rate and, other than a shape, is a velocity of the rail's material, against
which the wheel slips.  On rigid rails all four are zero.
"""

from math import asin, sqrt

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.system import AHEAD, ARC_LENGTH, SPEED
from railsim.kernels.track_frame import (
    MU_LEFT,
    Y_LEFT,
    Y_RIGHT,
    Z_LEFT,
    Z_RIGHT,
    cell_of,
    polynomial,
)

CANT_BASE = 1.5  # m, 2 b_0

# columns of Work.plane[w]: middle of the rails, their slopes; roll of the plane, its sine, cosine
# and rate along the track; change of the vertical slope along the track
MIDDLE_Y, MIDDLE_Z, SLOPE_Y, SLOPE_Z, ROLL, SINE, COSINE, ROLL_SLOPE, BEND_Z = range(9)
PLANE_SIZE = 16  # whole cache lines

# columns of Work.rail[w, side]: friction; distance of the rail to the right of its nominal position
# in the plane, its slope; slope of the rail in the frame's lateral direction, that slope's change
FRICTION, ASIDE, ASIDE_SLOPE, RAIL_SLOPE, RAIL_BEND = range(5)
RAIL_SIZE = 8

# columns of Work.rail_motion[w, side]
MOTION_Y, MOTION_Z, MOTION_Y_RATE, MOTION_Z_RATE = range(4)
MOTION_SIZE = 4

# columns of Work.rate_change[side]: how the rates of a wheel beside its rail are about to change
CHANGE_Y, CHANGE_Z, CHANGE_ROLL = range(3)
CHANGES = 4


@compiled
def locate_rails(track, wheelset_body, frame, cell, cell_u, plane, rail):
    """Rails under all wheelsets into `plane` and `rail`.

    Parameters
    ----------
    track : TrackTables
    wheelset_body, frame : int64[w], int64[n]
        Body of each wheelset, track frame of each body.
    cell, cell_u : int64[f], float64[f]
        Where the frames are, see `track_frame.cell_of`.
    plane : float64[w, PLANE_SIZE];  rail : float64[w, 2, RAIL_SIZE]
        Where no rail is displaced only the friction is written.
    """
    c = track.rail
    for w in range(wheelset_body.shape[0]):
        f = frame[wheelset_body[w]]
        i, u = cell[f], cell_u[f]
        for side in range(2):
            m = MU_LEFT + side
            rail[w, side, FRICTION], _, _ = polynomial(
                c[i, m, 0], c[i, m, 1], c[i, m, 2], c[i, m, 3], u
            )
        if track.has_irregularity:
            locate_displaced(c, i, u, w, plane, rail)


@compiled(python=False)
def locate_displaced(c, i, u, w, plane, rail):
    """Plane and rails of wheelset `w` from the displacements in cell `i` of the tables `c`."""
    y_l, y_l1, y_l2 = polynomial(
        c[i, Y_LEFT, 0], c[i, Y_LEFT, 1], c[i, Y_LEFT, 2], c[i, Y_LEFT, 3], u
    )
    z_l, z_l1, z_l2 = polynomial(
        c[i, Z_LEFT, 0], c[i, Z_LEFT, 1], c[i, Z_LEFT, 2], c[i, Z_LEFT, 3], u
    )
    y_r, y_r1, y_r2 = polynomial(
        c[i, Y_RIGHT, 0], c[i, Y_RIGHT, 1], c[i, Y_RIGHT, 2], c[i, Y_RIGHT, 3], u
    )
    z_r, z_r1, z_r2 = polynomial(
        c[i, Z_RIGHT, 0], c[i, Z_RIGHT, 1], c[i, Z_RIGHT, 2], c[i, Z_RIGHT, 3], u
    )
    sine = (z_r - z_l) / CANT_BASE
    cosine = sqrt(1.0 - sine * sine)
    plane[w, MIDDLE_Y] = 0.5 * (y_l + y_r)
    plane[w, MIDDLE_Z] = 0.5 * (z_l + z_r)
    plane[w, SLOPE_Y] = 0.5 * (y_l1 + y_r1)
    plane[w, SLOPE_Z] = 0.5 * (z_l1 + z_r1)
    plane[w, ROLL] = asin(sine)
    plane[w, SINE] = sine
    plane[w, COSINE] = cosine
    plane[w, BEND_Z] = 0.5 * (z_l2 + z_r2)
    plane[w, ROLL_SLOPE] = (z_r1 - z_l1) / (CANT_BASE * cosine)
    wider, widening = 0.5 * (y_r - y_l), 0.5 * (y_r1 - y_l1)
    rail[w, 0, ASIDE], rail[w, 0, ASIDE_SLOPE] = -wider, -widening
    rail[w, 1, ASIDE], rail[w, 1, ASIDE_SLOPE] = wider, widening
    rail[w, 0, RAIL_SLOPE], rail[w, 0, RAIL_BEND] = y_l1, y_l2
    rail[w, 1, RAIL_SLOPE], rail[w, 1, RAIL_BEND] = y_r1, y_r2


@compiled(python=False)
def predict_rate_changes(system, work, w, state):
    """How the rates of wheelset `w` beside its rails will have changed after `AHEAD`.

    The rails' slopes are those where the wheelset will then be; the wheelset is taken to keep its
    acceleration, so that nothing changes for one that follows its rails.  Of `Work.rate_change` are
    written rates of y, z [m/s] and roll [rad/s] by side; zero beyond the end of the track's table.
    """
    plane, rail, rate_change, h = work.plane, work.rail, work.rate_change, work.watch[AHEAD]
    b = system.contact.body[w]
    speed = state[SPEED]
    own = 12 * system.bodies.kind.shape[0] + system.internal.kind.shape[0] + 6 * b
    s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]] + speed * h
    i, u = cell_of(system.track, s)
    change = speed if i >= 0 else 0.0
    for side in range(2):
        y_slope, z_slope = 0.0, 0.0
        if i >= 0:
            y, z = (Y_RIGHT, Z_RIGHT) if side else (Y_LEFT, Z_LEFT)
            c = system.track.rail
            _, y_slope, _ = polynomial(c[i, y, 0], c[i, y, 1], c[i, y, 2], c[i, y, 3], u)
            _, z_slope, _ = polynomial(c[i, z, 0], c[i, z, 1], c[i, z, 2], c[i, z, 3], u)
        arm = (side - 0.5) * CANT_BASE * plane[w, COSINE]
        now = plane[w, SLOPE_Z] + arm * plane[w, ROLL_SLOPE]
        rate_change[side, CHANGE_Y] = (
            change * (rail[w, side, RAIL_SLOPE] - y_slope) + h * state[own + 1]
        )
        rate_change[side, CHANGE_Z] = change * (now - z_slope) + h * state[own + 2]
        rate_change[side, CHANGE_ROLL] = h * state[own + 3]


@compiled(inline=True)
def against_rails(plane, w, y, z, roll, left_y, left_z, right_y, right_z):
    """Lateral displacement and roll of wheelset `w` against its irregular, deflected rails.

    The displacement is that of the wheelset's centre from the middle of the rails, along the line
    over their tops; the roll is that against this line.

    Parameters
    ----------
    plane : float64[w, PLANE_SIZE]
    y, z, roll : float
        Centre of the wheelset in the track frame, z from the rail tops [m], and its roll [rad].
    left_y, left_z, right_y, right_z : float
        What the rails yield, in the axes of their plane [m].
    """
    sine, cosine = plane[w, SINE], plane[w, COSINE]
    y -= plane[w, MIDDLE_Y]
    z -= plane[w, MIDDLE_Z]
    lean = (right_z - left_z) / CANT_BASE
    across = cosine * y + sine * z - 0.5 * (left_y + right_y)
    up = cosine * z - sine * y - 0.5 * (left_z + right_z)
    return across + lean * up, roll - plane[w, ROLL] - lean


@compiled(in_loop=False)
def recorded_against_rails(track, body, offset, height, first, size, states, plane, rail, found):
    """`against_rails` of all wheelsets in recorded states.

    Parameters
    ----------
    track : TrackTables
    body : int64[w]
        Body of each wheelset.
    offset, height : float64[w]
        Of each wheelset from the reference body along the track and from the rail tops [m].
    first, size : int
        Where the rails of the first wheelset stand in a state, and how far the next ones are from
        them; a size of 0: rails are rigid.
    states : float64[time, n_state]
    plane : float64[w, PLANE_SIZE];  rail : float64[w, 2, RAIL_SIZE]
        Scratch; the planes as those of smooth rails.
    found : float64[time, w, 2]
        Lateral displacement [m] and roll [rad] (output).
    """
    yielded = np.zeros(4)
    for i in range(states.shape[0]):
        for w in range(body.shape[0]):
            if track.has_irregularity:
                cell, u = cell_of(track, states[i, ARC_LENGTH] + offset[w])
                if cell >= 0:
                    locate_displaced(track.rail, cell, u, w, plane, rail)
            if size > 0:
                yielded = states[i, first + size * w : first + size * w + 4]
            b = 6 * body[w]
            y, z, roll = states[i, b + 1], states[i, b + 2] + height[w], states[i, b + 3]
            found[i, w, 0], found[i, w, 1] = against_rails(
                plane, w, y, z, roll, yielded[0], yielded[1], yielded[2], yielded[3]
            )
