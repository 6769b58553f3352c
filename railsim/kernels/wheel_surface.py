"""Wheels that are not round: height of the contact over the wheel's angle.

The wheel's angle phi is what it has rolled since the beginning of the track, s/r0 less the
wheelset's coordinate `pitch`; material at the angle phi is at the bottom then.  With e(phi, y) the
radius at which the wheel stands on its rail, less that of the round wheel, its height is

    p = z - g + e,   p' = z' - g' + e_phi (V/r0 - pitch') + e_y y',

and the patch lies e_phi ahead of the axle: the path of the centre over the angle is the envelope
of the wheel's surface, max over psi of r(psi) cos(psi - phi), whose slope is r sin(psi - phi).  The
normal force has the moment N e_phi about the axle, so that it does no work over a turn.

Tables hold e, e_phi, e_y and e_phi_y at the nodes of an even grid, periodic in phi; bicubic between
them (Hermite), constant beyond the ends in y.
"""

from math import pi

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import (
    B_CHANGE,
    B_E_PHI,
    B_E_Y,
    B_HEIGHT,
    B_RADIUS,
    B_RATE,
    BUMP_SIZE,
)
from railsim.kernels.contact_table import G_ROLL, G_Y, N_PATCH, TREAD
from railsim.kernels.rail_parts import contact_height, near_range, plain_height, position_in_range
from railsim.kernels.rails import ROLL, SHIFT
from railsim.kernels.state import ARC_LENGTH, SPEED, velocity_begin
from railsim.kernels.system import HORIZON, RADIUS

# columns of Contact.surface_row: first row of its values and of its angles to the next flat, number
# of nodes over the angle and in y, first node and spacing in y [m]; length of its shortest flat and
# of the shortest wave all around it, which steps resolve [m]
FIRST, FIRST_FLAT, N_PHI, N_Y, Y0, DY, FLAT, WAVE = range(8)
SURFACE_ROW = 8
Y_HOLD = 5e-4  # m, lateral way on which predicted heights of rails keep their lateral position
DIVISION_RATE = 1e12  # N/s, rate of a force that has its step divided


@compiled(inline=True)
def wheel_angle(system, state, w):
    """Angle of wheelset `w`, rising while it rolls forward, and its rate V/r0 - pitch'.

    The pitch's own rate is still to be taken from the rate.
    """
    b = system.contact.body[w]
    radius = system.bodies.row[b, RADIUS]
    s = state[ARC_LENGTH] + system.frame_offset[system.bodies.frame[b]]
    return s / radius - state[6 * b + 4], state[SPEED] / radius


@compiled(inline=True)
def angle_cell(phi, n_phi):
    """Number of the cell at an angle, of `n_phi` around the wheel, and the part of it passed.

    Neither NaN nor an angle beyond all integers becomes an index.
    """
    x = phi * n_phi / (2.0 * pi)
    x -= n_phi * np.floor(x / n_phi)
    i = int(min(x, n_phi - 1.0)) if x > 0.0 else 0
    return i, x - i


@compiled(python=False)
def surface_height(contact, table, phi, y):
    """Height e [m] of a wheel at an angle and a lateral position, with e_phi [m] and e_y [1]."""
    row = contact.surface_row
    values = contact.surface
    n_phi, n_y = int(row[table, N_PHI]), int(row[table, N_Y])
    step = 2.0 * pi / n_phi
    i, x = angle_cell(phi, n_phi)
    after = i + 1 if i + 1 < n_phi else 0
    dy = row[table, DY]
    u = min(max((y - row[table, Y0]) / dy, 0.0), n_y - 1.0)
    j = min(int(u), n_y - 2) if u > 0.0 else 0  # also for NaN, which must not become an index
    u -= j
    inside = 1.0 if y > row[table, Y0] and y < row[table, Y0] + dy * (n_y - 1.0) else 0.0
    first = int(row[table, FIRST])
    a0, a1 = (1.0 + 2.0 * u) * (1.0 - u) * (1.0 - u), u * u * (3.0 - 2.0 * u)
    b0, b1 = dy * u * (1.0 - u) * (1.0 - u), dy * u * u * (u - 1.0)
    da, db0, db1 = 6.0 * u * (1.0 - u) / dy, (1.0 - u) * (1.0 - 3.0 * u), u * (3.0 * u - 2.0)
    e, e_phi, e_y = 0.0, 0.0, 0.0
    for end in range(2):
        k = first + (after if end else i) * n_y + j
        value = (
            a0 * values[k, 0] + a1 * values[k + 1, 0] + b0 * values[k, 2] + b1 * values[k + 1, 2]
        )
        slope = (
            a0 * values[k, 1] + a1 * values[k + 1, 1] + b0 * values[k, 3] + b1 * values[k + 1, 3]
        )
        value_y = (
            da * (values[k + 1, 0] - values[k, 0]) + db0 * values[k, 2] + db1 * values[k + 1, 2]
        )
        slope_y = (
            da * (values[k + 1, 1] - values[k, 1]) + db0 * values[k, 3] + db1 * values[k + 1, 3]
        )
        t = x if end else 1.0 - x
        sign = 1.0 if end else -1.0
        share, turn = t * t * (3.0 - 2.0 * t), sign * step * t * t * (t - 1.0)
        e += share * value + turn * slope
        e_y += share * value_y + turn * slope_y
        e_phi += sign * 6.0 * t * (1.0 - t) / step * value + t * (3.0 * t - 2.0) * slope
    return e, e_phi, inside * e_y


@compiled(python=False)
def angle_to_flat(contact, table, phi):
    """Angle that the wheel has still to roll until it is at a flat, 0 on one [rad]."""
    n_phi = int(contact.surface_row[table, N_PHI])
    i, _ = angle_cell(phi, n_phi)
    return contact.flat_ahead[int(contact.surface_row[table, FIRST_FLAT]) + i]


@compiled(python=False)
def store_surface_heights(system, work, state, w, side, wheel):
    """Heights of a wheel that is not round into `work.bump`, by patch.

    Returns
    -------
    float
        Largest e of the patches [m].
    """
    contact, bump, h = system.contact, work.bump, work.stepping[HORIZON]
    if contact.surface_of[w, side, TREAD] < 0:  # round
        for patch in range(N_PATCH):
            for k in range(BUMP_SIZE):
                bump[patch, k] = 0.0
        return 0.0
    phi, rate = wheel_angle(system, state, w)
    rate -= work.acceleration[contact.body[w], 4]
    most = 0.0
    for patch in range(N_PATCH):
        table = contact.surface_of[w, side, patch]
        for k in range(BUMP_SIZE):
            bump[patch, k] = 0.0
        if table < 0:
            continue
        shear = contact.shear[contact.table[w, side]]
        y = wheel.y - shear * wheel.roll
        e, e_phi, e_y = surface_height(contact, table, phi, y)
        bump[patch, B_HEIGHT] = e
        bump[patch, B_RADIUS] = e
        bump[patch, B_RATE] = e_phi * rate
        bump[patch, B_E_PHI] = e_phi
        bump[patch, B_E_Y] = e_y
        most = max(most, e)
        if h > 0.0:
            _, e_phi_1, _ = surface_height(contact, table, phi + rate * h, y)
            bump[patch, B_CHANGE] = (e_phi_1 - e_phi) * rate
            if angle_to_flat(contact, table, phi) < rate * h:
                work.force_rate[w] = DIVISION_RATE
    return most


@compiled(python=False)
def predict_tread_heights(system, work, state, w, track, first):
    """Heights e of both treads and their rates into ``track[first:first + 4]``.

    The next two are the lateral positions at which heights of rails are taken [m].
    """
    contact = system.contact
    b = contact.body[w]
    n = system.bodies.kind.shape[0]
    both_round = max(contact.surface_of[w, 0, TREAD], contact.surface_of[w, 1, TREAD]) < 0
    if both_round and not near_range(system, state, w):
        for k in range(4):
            track[first + k] = 0.0
        return
    phi, _ = wheel_angle(system, state, w)
    rate = -state[velocity_begin(n) + 6 * b + 4]  # the turn of the track's frame left out
    for side in range(2):
        sign = 2.0 * side - 1.0
        shear = contact.shear[contact.table[w, side]]
        roll = state[6 * b + 3] - work.plane[w, ROLL]
        y = sign * (state[6 * b + 1] - work.rail[w, side, SHIFT] - shear * roll)
        track[first + side] = track[first + 2 + side] = 0.0
        table = contact.surface_of[w, side, TREAD]
        if table >= 0:
            e, e_phi, _ = surface_height(contact, table, phi, y)
            track[first + side] = e
            track[first + 2 + side] = e_phi * rate
        for k in range(contact.rails.range_of.shape[0]):
            s, piece = position_in_range(system, state, w, side, k, state[6 * b + 5])
            if piece >= 0:
                # at the lateral position before the step: the rest is in the slopes of the forces
                if abs(track[first + 4 + side] - y) > Y_HOLD:
                    track[first + 4 + side] = y
                y = track[first + 4 + side]
                low, fall = contact_height(contact.rails, piece, s, y)
                track[first + side] += plain_height(contact.rails, piece, y) - low
                track[first + 2 + side] -= fall * state[SPEED]


@compiled(inline=True)
def subtract_height(look_up, first, bump, patch, shear):
    """Take the height of a wheel that is not round from the gap of a patch and its gradients."""
    look_up[first] -= bump[patch, B_HEIGHT]
    look_up[first + G_Y] -= bump[patch, B_E_Y]
    look_up[first + G_ROLL] += shear * bump[patch, B_E_Y]
