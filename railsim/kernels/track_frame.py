"""The track's moving frame: position, attitude and rates of turn at an arc length.

The frame at arc length s has its origin on the track centre line at rail-top level, x along the
track, y to the right in the track plane, z down.  Its attitude is A = Rz(psi) Ry(theta) Rx(phi):
heading, grade (nose up positive) and cant angle (left rail higher positive).

Tables hold one cubic polynomial per cell and quantity, so that the position is smooth and exact
where the plan is a straight, a circle or a clothoid, whatever the table's spacing.
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels import jit
from railsim.kernels.rotation import sine_cosine

# rows of TrackTables.coefficients
X, Y, Z, PSI, THETA, PHI = range(6)
# rows of TrackTables.rail
Y_LEFT, Z_LEFT, Y_RIGHT, Z_RIGHT, MU_LEFT, MU_RIGHT = range(6)

# columns of a frame row, see `track_frame`
ORIGIN = 0  # 0:3   origin in global axes (m)
ATTITUDE = 3  # 3:12  A, row by row
OMEGA = 12  # 12:15 rate of turn per metre, frame axes (1/m)
OMEGA_S = 15  # 15:18 its derivative along the track (1/m2)
GRAVITY = 18  # 18:21 direction of gravity in frame axes (1)
FRAME_SIZE = 21


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
    """

    s_start: float
    ds: float
    coefficients: np.ndarray
    rail: np.ndarray
    has_irregularity: int


@jit
def cell_of(track, s):
    """Cell index of arc length `s`, -1 outside the table, and the distance into the cell [m]."""
    position = (s - track.s_start) / track.ds
    i = int(np.floor(position))
    if not (position >= 0.0 and i < track.coefficients.shape[0]):
        return -1, 0.0
    return i, s - track.s_start - i * track.ds


@jit
def heading(track, s):
    """Heading of the track at arc length `s` [rad], 0 outside the table."""
    i, u = cell_of(track, s)
    c = track.coefficients
    if i < 0:
        return 0.0
    return c[i, PSI, 0] + u * (c[i, PSI, 1] + u * (c[i, PSI, 2] + u * c[i, PSI, 3]))


@jit
def track_frame(track, s, turn, frames, f):
    """Evaluate the track frame at arc length `s` [m] into ``frames[f, FRAME_SIZE]``.

    Its attitude is given in axes that are turned by the heading `turn` [rad] about the vertical.

    With s the arc length, the frame turns by omega = vee(A^T dA/ds) per metre; for the Euler angles
    psi, theta, phi (z, y, x) omega_1 = phi' - psi' sin theta, omega_2 = theta' cos phi
    + psi' cos theta sin phi, omega_3 = psi' cos theta cos phi - theta' sin phi.

    Returns
    -------
    cell : int
        -1 if `s` lies outside the table (then `frames` is unchanged).
    u : float
        Distance into the cell [m].
    """
    i, u = cell_of(track, s)
    if i < 0:
        return i, 0.0
    c = track.coefficients
    for k in range(3):
        frames[f, ORIGIN + k] = c[i, k, 0] + u * (c[i, k, 1] + u * (c[i, k, 2] + u * c[i, k, 3]))
    psi = c[i, PSI, 0] - turn + u * (c[i, PSI, 1] + u * (c[i, PSI, 2] + u * c[i, PSI, 3]))
    psi_1 = c[i, PSI, 1] + u * (2.0 * c[i, PSI, 2] + u * 3.0 * c[i, PSI, 3])
    psi_2 = 2.0 * c[i, PSI, 2] + 6.0 * u * c[i, PSI, 3]
    theta = c[i, THETA, 0] + u * (c[i, THETA, 1] + u * (c[i, THETA, 2] + u * c[i, THETA, 3]))
    theta_1 = c[i, THETA, 1] + u * (2.0 * c[i, THETA, 2] + u * 3.0 * c[i, THETA, 3])
    theta_2 = 2.0 * c[i, THETA, 2] + 6.0 * u * c[i, THETA, 3]
    phi = c[i, PHI, 0] + u * (c[i, PHI, 1] + u * (c[i, PHI, 2] + u * c[i, PHI, 3]))
    phi_1 = c[i, PHI, 1] + u * (2.0 * c[i, PHI, 2] + u * 3.0 * c[i, PHI, 3])
    phi_2 = 2.0 * c[i, PHI, 2] + 6.0 * u * c[i, PHI, 3]

    sp, cp = sine_cosine(psi)
    st, ct = sine_cosine(theta)
    sf, cf = sine_cosine(phi)
    frames[f, 3] = cp * ct
    frames[f, 4] = cp * st * sf - sp * cf
    frames[f, 5] = cp * st * cf + sp * sf
    frames[f, 6] = sp * ct
    frames[f, 7] = sp * st * sf + cp * cf
    frames[f, 8] = sp * st * cf - cp * sf
    frames[f, 9] = -st
    frames[f, 10] = ct * sf
    frames[f, 11] = ct * cf

    frames[f, 12] = phi_1 - psi_1 * st
    frames[f, 13] = theta_1 * cf + psi_1 * ct * sf
    frames[f, 14] = psi_1 * ct * cf - theta_1 * sf
    frames[f, 15] = phi_2 - psi_2 * st - psi_1 * theta_1 * ct
    frames[f, 16] = (theta_2 * cf - theta_1 * phi_1 * sf + psi_2 * ct * sf
                 - psi_1 * theta_1 * st * sf + psi_1 * phi_1 * ct * cf)
    frames[f, 17] = (psi_2 * ct * cf - psi_1 * theta_1 * st * cf - psi_1 * phi_1 * ct * sf
                 - theta_2 * sf - theta_1 * phi_1 * cf)
    # gravity points along global z: the third row of A
    frames[f, 18] = frames[f, 9]
    frames[f, 19] = frames[f, 10]
    frames[f, 20] = frames[f, 11]
    return i, u


@jit
def rail_state(track, cell, u, side, out):
    """Displacements y, z [m] and their slopes y', z' [1] of one rail into ``out[4]``; friction.

    Returns
    -------
    float : friction coefficient at this rail [1].
    """
    c = track.rail
    m = MU_LEFT + side
    mu = c[cell, m, 0] + u * (c[cell, m, 1] + u * (c[cell, m, 2] + u * c[cell, m, 3]))
    if track.has_irregularity:
        for k in range(2):
            row = 2 * side + k
            c1, c2, c3 = c[cell, row, 1], c[cell, row, 2], c[cell, row, 3]
            out[k] = c[cell, row, 0] + u * (c1 + u * (c2 + u * c3))
            out[2 + k] = c1 + u * (2.0 * c2 + u * 3.0 * c3)
    else:
        for k in range(4):
            out[k] = 0.0
    return mu
