"""Rails whose section changes along the track, several side by side, such as wing and nose.

Each rail, a part, has contact tables at nodes along the track (`railsim.contact.section_tables`).
Between them the fields are cubics whose slopes at the nodes are those of parabolas through three
neighbours, zero beside a node with the same table: once continuously differentiable.  The position
is that of the wheel itself,

    s_w = s + x - y_w yaw,

with the lateral position y_w of its nominal rolling circle, and the forces are the gradient of the
potential through all interpolations: along the track -dU/ds, which has the lever y_w in yaw.  The
gap's slope dg/ds is the fall of the rail where the wheel touches it, ahead of or behind the axle.
"""

from math import copysign, sqrt

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import B_CHANGE, B_K, B_K2, B_LEVER, B_RADIUS, B_RATE, B_RISE
from railsim.kernels.contact_table import (
    A1,
    B1,
    D_B1,
    FINE_ROLL,
    K2,
    K_ROLL,
    K_W,
    K_Y,
    LOOK_UP_SIZE,
    N_PATCH,
    N_WEIGHT,
    K,
    look_up,
    stretched_roll,
)
from railsim.kernels.state import ARC_LENGTH
from railsim.kernels.system import HORIZON

BEGIN, END = range(2)  # columns of RailTables.range_row
FIRST_PART, COUNT, PLAIN = range(3)  # of RailTables.piece
FIRST_NODE, N_NODES = range(2)  # of RailTables.part
NODES = 4  # of a cubic
NODE_WEIGHTS = 2 * NODES  # weights of the nodes and of their derivative, in `Work.weights`
FAR_GAP = 1.2e-3  # m, a patch whose gap exceeds the wheel's height by more is left out
NO_HEIGHT = 1.0  # m
YAW_REACH = 0.1  # m, more than a wheel runs ahead of its wheelset's middle
MIN_AXIS = 1e-6  # m/N^(1/3), least semi-axis of a patch: others have 2e-5 and more


@compiled(python=False)
def near_range(system, state, w):
    """Whether wheelset `w` is on a range of changing rails or, yawed, one of its wheels may be."""
    rails, b = system.contact.rails, system.contact.body[w]
    s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]] + state[6 * b]
    for k in range(rails.range_row.shape[0]):
        if rails.range_row[k, BEGIN] - s < YAW_REACH and s - rails.range_row[k, END] < YAW_REACH:
            return True
    return False


@compiled(python=False)
def position_in_range(system, state, w, side, k, yaw):
    """Position of a wheel from the begin of range `k` [m], and its piece, -1 where it has none."""
    rails = system.contact.rails
    piece = rails.range_of[k, w, side]
    if piece < 0:
        return 0.0, piece
    b = system.contact.body[w]
    s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]] + state[6 * b]
    s -= (2.0 * side - 1.0) * rails.lever[piece] * yaw
    begin = rails.range_row[k, BEGIN]
    if s < begin or s > rails.range_row[k, END]:
        return 0.0, np.int64(-1)
    return s - begin, piece


@compiled(python=False)
def section_cell(rails, part, s):
    """Node before `s` of a rail, -1 where the rail is not."""
    first = rails.part[part, FIRST_NODE]
    last = first + rails.part[part, N_NODES] - 1
    if last < first or s < rails.node_s[first] or s > rails.node_s[last]:
        return np.int64(-1)
    while last - first > 1:
        middle = (first + last) // 2
        if rails.node_s[middle] <= s:
            first = middle
        else:
            last = middle
    return first


@compiled(python=False)
def neighbour_node(rails, part, i, k):
    """Node `k` of the four around the cell behind node `i`: the rail's last one beyond its ends."""
    first = rails.part[part, FIRST_NODE]
    return min(max(i - 1 + k, first), first + rails.part[part, N_NODES] - 1)


@compiled(inline=True)
def node_gap(rails, number, iw, ir, iy):
    """Gap of a zone at a node of its table [m]."""
    return rails.values[number // N_PATCH, number % N_PATCH, iw, ir, iy, 0]


@compiled(inline=True)
def zone_number(rails, part, i, k, zone):
    """Number of a zone at node `k` of the four around the cell behind node `i`."""
    return rails.node_zone[neighbour_node(rails, part, i, k), zone]


@compiled(python=False)
def section_slope(rails, part, zone, s, default, cell, weights):
    """Slope of a zone's gap at another position, at the nearest node in y and roll [1].

    The node behind is nearer where it weighs more; `weights` as from `set_cell_weights`: 1 and 2
    are those of the cell's ends in y, 9 and 10 in roll.  A wheelset in the middle is on a node:
    were it that of its cell, round-off would decide which.
    """
    i = section_cell(rails, part, s)
    if i < 0:
        return default
    z1, z2 = rails.node_zone[i, zone], rails.node_zone[i + 1, zone]
    if z1 < 0 or z2 < 0:
        return default
    iy = cell[0] + int(weights[2] > weights[1])
    ir, iw = cell[1] + int(weights[10] > weights[9]), cell[2]
    step = node_gap(rails, z2, iw, ir, iy) - node_gap(rails, z1, iw, ir, iy)
    return step / (rails.node_s[i + 1] - rails.node_s[i])


@compiled(python=False)
def have_same_tables(rails, i, j):
    """Whether two nodes have the same tables."""
    zone = rails.node_zone
    return zone[i, 0] == zone[j, 0] and zone[i, 1] == zone[j, 1] and zone[i, 2] == zone[j, 2]


@compiled(python=False)
def set_node_weights(rails, part, i, s, out, first):
    """Weights of the four nodes around a cell at `s`, then of the derivative over s [1/m].

    With u = (s - s_1)/h and the slopes m_1, m_2 at the cell's ends,

        f = (1 + 2u)(1 - u)^2 f_1 + u^2 (3 - 2u) f_2 + h u (1 - u)((1 - u) m_1 - u m_2).

    The slope is 0 at both ends of a cell along which the rail keeps its section.
    """
    i_0, i_3 = neighbour_node(rails, part, i, 0), neighbour_node(rails, part, i, 3)
    x = rails.node_s
    h = x[i + 1] - x[i]
    u = (s - x[i]) / h
    v = 1.0 - u
    out[first] = out[first + 3] = out[first + 4] = out[first + 7] = 0.0
    out[first + 1], out[first + 2] = (1.0 + 2.0 * u) * v * v, u * u * (3.0 - 2.0 * u)
    out[first + 5], out[first + 6] = -6.0 * u * v / h, 6.0 * u * v / h
    level = have_same_tables(rails, i, i + 1)
    for end in range(2):
        outer, inner = (i_3, i + 1) if end else (i_0, i)
        if level or (outer != inner and have_same_tables(rails, outer, inner)):
            continue
        # slope at this end: a (f_2 - f_1)/h + (1 - a) (f_1 - f_0)/h_0, and likewise
        turn = -h * u * u * v if end else h * u * v * v
        d_turn = u * (3.0 * u - 2.0) if end else v * (1.0 - 3.0 * u)
        h_0 = abs(x[outer] - x[inner])
        a = h_0 / (h_0 + h) if h_0 > 0.0 else 1.0
        out[first + 1] -= a * turn / h
        out[first + 2] += a * turn / h
        out[first + 5] -= a * d_turn / h
        out[first + 6] += a * d_turn / h
        if h_0 > 0.0:
            c = (1.0 - a) / h_0
            c = -c if end else c
            out[first + 1 + end] += c * turn
            out[first + 3 * end] -= c * turn
            out[first + 5 + end] += c * d_turn
            out[first + 4 + 3 * end] -= c * d_turn


@compiled(python=False)
def nearest_y_node(rails, y):
    """Node of the tables nearest to a lateral position, the last one beyond their ends."""
    return min(max(int((y - rails.y0) / rails.dy + 0.5), 0), rails.values.shape[4] - 1)


@compiled(python=False)
def plain_height(rails, piece, y):
    """Height at which a wheel at `y` touches the plain rail, as `contact_height` [m]."""
    level, roll = NO_HEIGHT, rails.values.shape[3] // 2
    for zone in range(N_PATCH):
        number = rails.piece[piece, PLAIN] + zone
        level = min(level, node_gap(rails, number, 0, roll, nearest_y_node(rails, y)))
    return level


@compiled(python=False)
def contact_height(rails, piece, s, y):
    """Height at which a wheel at `y` touches the first of the rails, and its slope over s.

    At the nearest node in y, without roll and yaw: for what is predicted.

    Returns
    -------
    float, float
        Height, positive down, at most 1 m [m], and its derivative over s [1].
    """
    iy, roll = nearest_y_node(rails, y), rails.values.shape[3] // 2
    lowest, slope = NO_HEIGHT, 0.0
    for part in range(rails.piece[piece, COUNT]):
        part += rails.piece[piece, FIRST_PART]
        i = section_cell(rails, part, s)
        if i < 0:
            continue
        h = rails.node_s[i + 1] - rails.node_s[i]
        u = (s - rails.node_s[i]) / h
        for zone in range(N_PATCH):
            z1, z2 = rails.node_zone[i, zone], rails.node_zone[i + 1, zone]
            if z1 < 0 or z2 < 0:
                continue
            g, step = node_gap(rails, z1, 0, roll, iy), node_gap(rails, z2, 0, roll, iy)
            step -= g
            if g + u * step < lowest:
                lowest, slope = g + u * step, step / h
    return lowest, slope


@compiled(python=False)
def clamp(rails, y, roll, stretched, slope):
    """Clamp a wheel's position to the tables, beyond which gaps are continued linearly.

    A flange that climbs goes 25 mm aside and rolls the wheelset by 15 mrad.

    Parameters
    ----------
    y, roll, stretched, slope : float
        Lateral displacement [m], roll [rad], coordinate of it and its slope (`stretched_roll`).

    Returns
    -------
    float, float, float, float
        Coordinate of the roll and its slope, then what is left of the displacement [m] and roll.
    """
    margin = 1e-6
    foot_y = y - rails.shear[0] * roll
    y_min = rails.y0 + (1.0 + margin) * rails.dy
    y_max = rails.y0 + (rails.values.shape[4] - 2.0 - margin) * rails.dy
    d_y = foot_y - min(max(foot_y, y_min), y_max)
    limit = -(1.0 - margin) * (rails.roll0 + rails.droll)
    if abs(stretched) <= limit:
        return stretched, slope, d_y, 0.0
    # x = r/(1 + (r/F)^2)^(1/4), solved for r
    q = (limit / FINE_ROLL) ** 2
    roll_end = FINE_ROLL * sqrt(0.5 * q * (q + sqrt(q * q + 4.0)))
    _, slope = stretched_roll(roll_end)
    return copysign(limit, stretched), slope, d_y, roll - copysign(roll_end, roll)


@compiled(python=False)
def look_up_rail(system, work, cell, place, part, first):
    """Look up one rail of a piece for a wheel: patches from `first` on.

    `work.approach` is 0 for what was looked up and -1 for what is far.

    Parameters
    ----------
    cell : (int, int, int, float, float)
        iy, ir, iw, tw of the tables, and the wheel's height with what its surface adds [m].
    place : (float, float, float)
        Position from the begin of the range [m], its rate [m/s], lever [m].

    Returns
    -------
    float
        Greatest height of the wheel over a gap [m], at most 1 m below.
    """
    rails, weights, out, bump = system.contact.rails, work.weights, work.look_up, work.bump
    iy, ir, iw, tw, height = cell
    s, rate, lever = place
    for zone in range(N_PATCH):
        work.approach[first + zone] = -1.0
        work.stiffness[2 * first + zone] = work.stiffness[2 * first + N_PATCH + zone] = 0.0
    i = section_cell(rails, part, s)
    if i < 0:
        return -NO_HEIGHT
    set_node_weights(rails, part, i, s, weights, N_WEIGHT)
    scratch, nearest = out.shape[0] - LOOK_UP_SIZE, -NO_HEIGHT
    for zone in range(N_PATCH):
        z1, z2 = rails.node_zone[i, zone], rails.node_zone[i + 1, zone]
        z0, z3 = zone_number(rails, part, i, 0, zone), zone_number(rails, part, i, 3, zone)
        if min(z1, z2, z0, z3) < 0:
            continue
        depth = height - min(node_gap(rails, z1, iw, ir, iy), node_gap(rails, z2, iw, ir, iy))
        nearest = max(nearest, depth)
        if depth < -FAR_GAP:
            continue
        patch = first + zone
        work.approach[patch] = 0.0
        begin = patch * LOOK_UP_SIZE
        for q in range(LOOK_UP_SIZE):
            out[begin + q] = 0.0
        g_s = K_rate = K2_rate = 0.0
        for k in range(NODES):
            share, slope = weights[N_WEIGHT + k], weights[N_WEIGHT + NODES + k]
            if share == 0.0 and slope == 0.0:
                continue
            number = zone_number(rails, part, i, k, zone)
            table, row = number // N_PATCH, number % N_PATCH
            look_up(rails, table, row, iy, ir, iw, tw, weights, out, scratch)
            for q in range(LOOK_UP_SIZE):
                out[begin + q] += share * out[scratch + q]
            g_s += slope * out[scratch]
            K_rate += slope * out[scratch + K]
            K2_rate += slope * out[scratch + K2]
        # near where a zone ends along the track cubics fall below zero: it does not pull, and the
        # ellipse needs an extent
        if out[begin + K] < 0.0:
            out[begin + K] = K_rate = 0.0
            out[begin + K_Y] = out[begin + K_ROLL] = out[begin + K_W] = 0.0
            out[begin + K2] = max(out[begin + K2], 0.0)
        out[begin + A1] = max(out[begin + A1], MIN_AXIS)
        out[begin + B1] = max(out[begin + B1], MIN_AXIS)
        out[begin + D_B1] = max(out[begin + D_B1], MIN_AXIS - out[begin + B1])
        bump[patch, B_RISE] = -g_s
        bump[patch, B_K] = K_rate
        bump[patch, B_K2] = K2_rate
        bump[patch, B_LEVER] = lever
        # the wheel's radius is that at the patch; what is below the axle of it is less
        bump[patch, B_RADIUS] -= 0.5 * g_s * g_s * rails.shear[0]
        bump[patch, B_RATE] -= g_s * rate
        later = s + rate * work.stepping[HORIZON]
        if later > s:
            bump[patch, B_CHANGE] += rate * (
                g_s - section_slope(rails, part, zone, later, g_s, cell, weights)
            )
    return nearest
