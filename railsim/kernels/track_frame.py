"""The track's moving frame: position, attitude and rates of turn at an arc length.

The frame at arc length s has its origin on the track centre line at rail-top level, x along the
track, y to the right in the track plane, z down.  Its attitude is A = Rz(psi) Ry(theta) Rx(phi):
heading, grade (nose up positive) and cant angle (left rail higher positive).

Tables hold one cubic polynomial per cell and quantity, so that the position is smooth and exact
where the plan is a straight, a circle or a clothoid, whatever the table's spacing.
"""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.lanes import LANES, gather, lane_numbers, load_rows, row_starts, store_rows
from railsim.kernels.record import record
from railsim.kernels.rotation import sine_cosine_lanes

# rows of TrackTables.coefficients
X, Y, Z, PSI, THETA, PHI = range(6)
# rows of TrackTables.rail
Y_LEFT, Z_LEFT, Y_RIGHT, Z_RIGHT, MU_LEFT, MU_RIGHT = range(6)

# columns of a frame row, see `set_frames`
ORIGIN = 0  # 0:3   origin in global axes (m)
ATTITUDE = 3  # 3:12  A, row by row
OMEGA = 12  # 12:15 rate of turn per metre, frame axes (1/m)
OMEGA_S = 15  # 15:18 its derivative along the track (1/m2)
GRAVITY = 9  # 9:12 direction of gravity in frame axes (1): the third row of A
FRAME_SIZE = 24  # whole cache lines


@record
class TrackTables(NamedTuple):
    """Piecewise cubic tables over arc length, value = c0 + c1 u + c2 u^2 + c3 u^3, u = s - s_cell.

    Attributes
    ----------
    s_start, ds : float
        Arc length of the first cell's begin; length of a cell [m].
    coefficients : float64[n_cells, 6, 4]
        X, Y, Z of the centre line [m], psi, theta, phi [rad].
    rail : float64[n_cells, 6, 4]
        Displacement of the left and right rail, lateral (right positive) and vertical (down
        positive) in track axes [m]; friction coefficient left, right [1].
    has_irregularity : int
        0 where both rails are undisturbed: `rail`'s displacements are not looked up.
    rail_base : float
        Distance of the rails, over which their difference in height is the roll of the plane [m].
    """

    s_start: float
    ds: float
    coefficients: np.ndarray
    rail: np.ndarray
    has_irregularity: int
    rail_base: float


@compiled(inline=True)
def load_frames(frames, offsets):
    """Of eight frames: origin, attitude A, rate of turn per metre, its derivative over s."""
    x, y, z, a0, a1, a2, a3, a4 = load_rows(frames, offsets, 0, 8)
    a5, a6, a7, a8, w1, w2, w3, e1 = load_rows(frames, offsets, 8, 8)
    e2, e3 = load_rows(frames, offsets, 16, 2)
    return (x, y, z), (a0, a1, a2, a3, a4, a5, a6, a7, a8), (w1, w2, w3), (e1, e2, e3)


@compiled(python=False)
def track_cell(track, s):
    """Cell index of arc length `s`, -1 outside the table, and the distance into the cell [m]."""
    position = (s - track.s_start) / track.ds
    if not (position >= 0.0 and position < track.coefficients.shape[0]):  # NaN, inf: no index
        return -1, 0.0
    i = int(position)
    return i, s - track.s_start - i * track.ds


@compiled(inline=True)
def polynomial(c0, c1, c2, c3, u):
    """Cubic polynomial and its first two derivatives."""
    return (
        c0 + u * (c1 + u * (c2 + u * c3)),
        c1 + u * (2.0 * c2 + u * 3.0 * c3),
        2.0 * c2 + 6.0 * u * c3,
    )


@compiled(python=False)
def set_frames(track, cell, cell_u, origin, frames):
    """Evaluate track frames into ``frames[:, FRAME_SIZE]``.

    Origins and attitudes are given in those of frame `origin` on the level (its heading, not its
    grade and cant), or in global ones where `origin` is negative.

    With s the arc length, a frame turns by omega = vee(A^T dA/ds) per metre; for the Euler angles
    psi, theta, phi (z, y, x) omega_1 = phi' - psi' sin theta, omega_2 = theta' cos phi
    + psi' cos theta sin phi, omega_3 = psi' cos theta cos phi - theta' sin phi.

    Parameters
    ----------
    cell, cell_u : int64[f], float64[f]
        Where the frames are, see `track_cell`.
    """
    c = track.coefficients
    x_0, y_0, z_0, turn = 0.0, 0.0, 0.0, 0.0
    if origin >= 0:
        i, t = cell[origin], cell_u[origin]
        x_0, _, _ = polynomial(c[i, X, 0], c[i, X, 1], c[i, X, 2], c[i, X, 3], t)
        y_0, _, _ = polynomial(c[i, Y, 0], c[i, Y, 1], c[i, Y, 2], c[i, Y, 3], t)
        z_0, _, _ = polynomial(c[i, Z, 0], c[i, Z, 1], c[i, Z, 2], c[i, Z, 3], t)
        turn, _, _ = polynomial(c[i, PSI, 0], c[i, PSI, 1], c[i, PSI, 2], c[i, PSI, 3], t)
    sine, cosine = sin(turn), cos(turn)
    for first in range(0, cell.shape[0], LANES):
        lanes = lane_numbers(first, cell.shape[0])
        offsets = row_starts(gather(cell, lanes), 24)
        u = load_rows(cell_u, lanes, 0, 1)[0]
        x0, x1, x2, x3, y0, y1, y2, y3 = load_rows(c, offsets, 0, 8)
        z0, z1, z2, z3, p0, p1, p2, p3 = load_rows(c, offsets, 8, 8)
        t0, t1, t2, t3, f0, f1, f2, f3 = load_rows(c, offsets, 16, 8)
        x, _, _ = polynomial(x0, x1, x2, x3, u)
        y, _, _ = polynomial(y0, y1, y2, y3, u)
        z, _, _ = polynomial(z0, z1, z2, z3, u)
        # the difference first: headings grow, their differences are small
        psi, psi_1, psi_2 = polynomial(p0 - turn, p1, p2, p3, u)
        theta, theta_1, theta_2 = polynomial(t0, t1, t2, t3, u)
        phi, phi_1, phi_2 = polynomial(f0, f1, f2, f3, u)
        sp, cp = sine_cosine_lanes(psi)
        st, ct = sine_cosine_lanes(theta)
        sf, cf = sine_cosine_lanes(phi)
        east, north = x - x_0, y - y_0
        row = row_starts(lanes, FRAME_SIZE)
        store_rows(
            frames,
            row,
            0,
            (
                cosine * east + sine * north,
                cosine * north - sine * east,
                z - z_0,
                cp * ct,
                cp * st * sf - sp * cf,
                cp * st * cf + sp * sf,
                sp * ct,
                sp * st * sf + cp * cf,
            ),
        )
        store_rows(
            frames,
            row,
            8,
            (
                sp * st * cf - cp * sf,
                -st,
                ct * sf,
                ct * cf,
                phi_1 - psi_1 * st,
                theta_1 * cf + psi_1 * ct * sf,
                psi_1 * ct * cf - theta_1 * sf,
                phi_2 - psi_2 * st - psi_1 * theta_1 * ct,
            ),
        )
        store_rows(
            frames,
            row,
            16,
            (
                theta_2 * cf
                - theta_1 * phi_1 * sf
                + psi_2 * ct * sf
                - psi_1 * theta_1 * st * sf
                + psi_1 * phi_1 * ct * cf,
                psi_2 * ct * cf
                - psi_1 * theta_1 * st * cf
                - psi_1 * phi_1 * ct * sf
                - theta_2 * sf
                - theta_1 * phi_1 * cf,
            ),
        )
