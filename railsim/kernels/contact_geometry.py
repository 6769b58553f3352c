"""Contact geometry of one wheel on one rail.

The wheel, turned by roll and yaw, is reduced to its trace (silhouette) line in the track's
cross-section: at the lateral position u of the axle the point u l + r e with

    e_x = t l_x,   e_y l_y + e_z l_z = -e_x l_x,   |e| = 1,   t = dr/du,   l the axle's direction,

is the one whose normal has no component along the rail.  The gap is measured vertically between
that line and the rail.
"""

import math
from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled


@compiled(in_loop=False)
def trace_line(u, r, t, roll, yaw, c_x, c_y, c_z, stretch):
    """Trace line of a wheel relative to the wheelset's centre, in track axes.

    Parameters
    ----------
    u, r, t : ndarray, shape (n,)
        Position along the axle from the wheelset's centre [m], radius [m], and dr/du [1].
    roll, yaw : float
        Attitude of the wheelset, C = Rz(yaw) Rx(roll) [rad].
    c_x, c_y, c_z : ndarray, shape (n,)
        Points of the line (output) [m].
    stretch : ndarray, shape (n,)
        1/cos of the angle between the wheel's surface there and the track plane, 0 where the
        profile is so steep against the yaw that no trace point exists (output) [1].
    """
    l_x = -math.sin(yaw) * math.cos(roll)
    l_y = math.cos(yaw) * math.cos(roll)
    l_z = math.sin(roll)
    m = math.sqrt(l_y * l_y + l_z * l_z)
    for k in range(u.size):
        e_x = t[k] * l_x
        along = -e_x * l_x / m
        rest = 1.0 - e_x * e_x - along * along
        across = math.sqrt(max(rest, 0.0))
        n_z = (along * l_z + across * l_y) / m - t[k] * l_z
        stretch[k] = math.sqrt(1.0 + t[k] * t[k]) / n_z if rest > 0.0 and n_z > 0.0 else 0.0
        c_x[k] = u[k] * l_x + r[k] * e_x
        c_y[k] = u[k] * l_y + r[k] * (along * l_y - across * l_z) / m
        c_z[k] = u[k] * l_z + r[k] * (along * l_z + across * l_y) / m


@compiled(in_loop=False)
def rail_height(Y, Y0, dY, z, slope):
    """Height and slope of the rail's surface at the lateral position `Y`, cubic, straight beyond.

    Parameters
    ----------
    Y : float
        Lateral position [m].
    Y0, dY : float
        First position and spacing of the nodes [m].
    z, slope : ndarray, shape (n_rail,)
        Height [m] and slope [1] at the nodes.

    Returns
    -------
    float, float, int
        Height [m], slope [1] and nearest lower node.
    """
    x = (Y - Y0) / dY
    n = z.size
    if not x > 0.0:
        return z[0] + slope[0] * (Y - Y0), slope[0], 0
    if not x < n - 1:
        return z[n - 1] + slope[n - 1] * (Y - Y0 - (n - 1) * dY), slope[n - 1], n - 2
    j = int(x)
    x -= j
    d0 = slope[j] * dY
    d1 = slope[j + 1] * dY
    rise = z[j + 1] - z[j]
    c2 = 3.0 * rise - 2.0 * d0 - d1
    c3 = d0 + d1 - 2.0 * rise
    return z[j] + x * (d0 + x * (c2 + x * c3)), (d0 + x * (2.0 * c2 + 3.0 * x * c3)) / dY, j


# Results of `rigid_contact`.
R_GAP, R_U, R_RADIUS, R_Y, R_SLOPE, R_INDEX = range(6)


@compiled(in_loop=False)
def rigid_contact(wheel, rail_Y0, rail_dY, rail_z, rail_slope, centre_height, y, roll, out):
    """First contact of a rigid wheel that is lowered onto its rail, without yaw.

    Parameters
    ----------
    wheel : ndarray, shape (3, n)
        Candidates u [m], r [m], dr/du [1] along the axle.
    rail_Y0, rail_dY, rail_z, rail_slope
        Rail as for `rail_height`.
    centre_height, y, roll : float
        Height of the wheelset's centre above the rail tops, its lateral displacement [m], its
        roll [rad].
    out : ndarray, shape (6,)
        Height at which the wheel touches [m], position u on the axle [m], rolling radius [m],
        lateral position [m] and slope [1] on the rail, candidate (-1 at the wheel's end).
    """
    cosine, sine = math.cos(roll), math.sin(roll)
    n = wheel.shape[1]
    least = 1e9
    best = 0
    for k in range(n):
        u, r = wheel[0, k], wheel[1, k]
        h = rail_height(y + u * cosine - r * sine, rail_Y0, rail_dY, rail_z, rail_slope)[0]
        h += centre_height - u * sine - r * cosine
        if h < least:
            least = h
            best = k
    u, r = wheel[0, best], wheel[1, best]
    # the gap's slope is interpolated to its zero between this candidate and a neighbour
    own = _gap_slope(wheel, best, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine)
    other = best - 1 if own > 0.0 else best + 1
    index = best
    if 0 <= other < n:
        there = _gap_slope(wheel, other, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine)
        if own * there < 0.0:
            x = own / (own - there)
            du = wheel[0, other] - u
            slope = wheel[2, best] + 0.5 * x * (wheel[2, other] - wheel[2, best])
            r += slope * x * du
            u += x * du
            least += 0.5 * own * x * du
    else:
        index = -1
    Y = y + u * cosine - r * sine
    out[R_GAP] = least
    out[R_U] = u
    out[R_RADIUS] = r
    out[R_Y] = Y
    out[R_SLOPE] = rail_height(Y, rail_Y0, rail_dY, rail_z, rail_slope)[1]
    out[R_INDEX] = index


@compiled(in_loop=False)
def _gap_slope(wheel, k, rail_Y0, rail_dY, rail_z, rail_slope, y, cosine, sine):
    """Derivative of the gap with respect to u at a candidate [1]."""
    u, r, t = wheel[0, k], wheel[1, k], wheel[2, k]
    slope = rail_height(y + u * cosine - r * sine, rail_Y0, rail_dY, rail_z, rail_slope)[1]
    return slope * (cosine - t * sine) - (sine + t * cosine)


class RigidPair(NamedTuple):
    """A wheel and its rail, as `rigid_contact` takes them."""

    wheel: np.ndarray
    rail_Y0: float
    rail_z: np.ndarray
    rail_slope: np.ndarray


@compiled(in_loop=False)
def _pair_contact(pair, rail_dY, centre_height, y, roll, out):
    rigid_contact(
        pair.wheel, pair.rail_Y0, rail_dY, pair.rail_z, pair.rail_slope, centre_height, y, roll, out
    )


@compiled(in_loop=False)
def rigid_sweep(lateral, right_pair, left_pair, rail_dY, centre_height, roll_max, roll, contacts):
    """Roll of a rigid wheelset on both rails, and its contacts, over the lateral displacement.

    The left side is given as a right one; it is looked up at -y and -roll.  The roll is the one
    nearest to the previous displacement's at which both wheels touch, found by bracketing and
    regula falsi (Illinois).

    Parameters
    ----------
    lateral : ndarray, shape (n,)
        Lateral displacements [m].
    right_pair, left_pair : RigidPair
        Wheel and rail of each side.
    rail_dY : float
        As for `rigid_contact` [m].
    centre_height, roll_max : float
        As for `rigid_contact`; largest roll that is tried [rad].
    roll : ndarray, shape (n,)
        Roll (output), nan where none was found [rad].
    contacts : ndarray, shape (n, 2, 6)
        Left and right contact as from `rigid_contact` (output).
    """
    left, right = np.empty(6), np.empty(6)
    previous = 0.0

    for i in range(lateral.size):
        y = lateral[i]
        step = 1e-4
        a = b = previous
        f_a = f_b = 0.0
        for trial in range(-1, 64):
            # away from the previous roll, in growing steps to both sides
            away = 0.0 if trial < 0 else step
            x = previous + (away if trial % 2 == 0 else -away)
            _pair_contact(right_pair, rail_dY, centre_height, y, x, right)
            _pair_contact(left_pair, rail_dY, centre_height, -y, -x, left)
            f = right[R_GAP] - left[R_GAP]
            if trial < 0:
                f_a = f_b = f
                if f == 0.0:
                    break
            elif f * f_b <= 0.0:
                a, f_a = x, f
                break
            elif trial % 2 == 1:
                step *= 1.5
                if step > 2.0 * roll_max:
                    break
        if f_a * f_b > 0.0:
            roll[i] = math.nan
            for k in range(6):
                contacts[i, 0, k] = math.nan
                contacts[i, 1, k] = math.nan
            continue
        x = b
        for _ in range(60):
            if f_a == f_b:
                break
            x = b - f_b * (b - a) / (f_b - f_a)
            _pair_contact(right_pair, rail_dY, centre_height, y, x, right)
            _pair_contact(left_pair, rail_dY, centre_height, -y, -x, left)
            f = right[R_GAP] - left[R_GAP]
            if f * f_b < 0.0:
                a, f_a = b, f_b
            else:
                f_a *= 0.5
            b, f_b = x, f
            if abs(f) < 1e-12 or abs(b - a) < 1e-13:
                break
        previous = x
        roll[i] = x
        contacts[i, 0] = left
        contacts[i, 1] = right
