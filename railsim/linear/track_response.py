"""What a vehicle on straight track answers to irregularities: its state space with track inputs.

About steady rolling, with u_w the displacement of the rails under wheelset w (alignment,
longitudinal level, cross level, gauge) and ' the derivative along the track,

    x' = A x + sum_w (B_w0 u_w + B_w1 u_w' + B_w2 u_w''),      y likewise with C and D,

by central differences of the equations of motion.  All wheelsets see the same track: wheelset w
stands l_w ahead of the reference body, hence over the angular wave number k at the speed V

    H(k) = C (i k V - A)^-1 B(k) + D(k),    B(k) = sum_w exp(i k l_w) sum_j (i k)^j B_wj.

The matrix i k V - A is solved by Schur's form A = Z T Z*, which exists for a free vehicle too,
whose two zero eigenvalues have one eigenvector.  Outputs are what accelerometers read (see
`railsim.result.sensors`: of a small roll, y reads -g roll as well), Q and Y.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from railsim.constants import GRAVITY
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.linear.circle import POSITION
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.vehicle import LinearVehicle
from railsim.result.sensors import Sensor

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

QUANTITIES = ("alignment", "level", "cross_level", "gauge")
"""Irregularities [m]; the cross level as height of the left rail over the right one."""
# y_left, z_left, y_right, z_right by one metre of each
RAILS = np.array(
    [
        [1.0, 0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0, 1.0],
        [0.0, -0.5, 0.0, 0.5],
        [-0.5, 0.0, 0.5, 0.0],
    ]
)
ORDERS = 3  # displacement of the rails, its slope and the slope's change
STEPS = (1e-8, 1e-7, 1e-6)  # of these in difference quotients [m, 1, 1/m]
FORCES = ("Q", "Y")
TOGETHER = 4096  # wave numbers that are solved at once


@dataclass(frozen=True)
class TrackResponse:
    """State space of a vehicle with track inputs at one speed.

    Attributes
    ----------
    speed : float
        [m/s].
    outputs : tuple of str
        Readings, such as ``axlebox_1_left.z``; ``roll_rate`` instead of an axis; wheel forces,
        such as ``Q.1.left``.
    offsets : float64[w]
        Of the wheelsets from the reference body along the track [m].
    A, C : float64[n, n], float64[m, n]
        State and output matrix.
    B, D : float64[n or m, wheelset, quantity, order]
        Of the displacements of the rails, their slopes and curvatures.
    """

    speed: float
    outputs: tuple[str, ...]
    offsets: Floats
    A: Floats
    B: Floats
    C: Floats
    D: Floats

    def over(self, wave_numbers: Floats, chosen: Sequence[int] | None = None) -> Complex:
        """Frequency response H over the angular wave number, complex128[k, output, quantity].

        Parameters
        ----------
        wave_numbers : float64[k]
            2 pi over the wavelength [rad/m].
        chosen : sequence of int, optional
            Outputs; all by default.
        """
        rows = slice(None) if chosen is None else list(chosen)
        C, D = self.C[rows], self.D[rows]
        found = np.empty((len(wave_numbers), len(C), len(QUANTITIES)), dtype=complex)
        T, Z = schur(self.A, output="complex")
        B, CZ = np.einsum("nm,nwqo->mwqo", Z.conj(), self.B), C @ Z
        for begin in range(0, len(wave_numbers), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            k = wave_numbers[part]
            shift = np.exp(1j * k[:, None] * self.offsets)[:, :, None]
            shift = shift * (1j * k[:, None, None]) ** np.arange(ORDERS)
            x = np.einsum("nwqo,kwo->nkq", B, shift, optimize=True)
            turn = 1j * self.speed * k[:, None]
            for i in range(len(T) - 1, -1, -1):
                x[i] += np.tensordot(T[i, i + 1 :], x[i + 1 :], 1)
                x[i] /= turn - T[i, i]
            found[part] = np.einsum("mn,nkq->kmq", CZ, x, optimize=True)
            found[part] += np.einsum("mwqo,kwo->kmq", D, shift, optimize=True)
        return found


def track_response(
    vehicle: LinearVehicle, sensors: Mapping[str, Sensor], speed: float
) -> TrackResponse:
    """Return the state space of a vehicle with track inputs.

    Parameters
    ----------
    vehicle : LinearVehicle
        On straight track, its wheelsets free.
    sensors : mapping of str to Sensor
        What reads accelerations.
    speed : float
        [m/s].

    Raises
    ------
    ModelError
        There is no steady rolling, or a derivative is not finite.
    """
    track = vehicle.system.track
    rail = track.rail.copy()
    system = vehicle.system._replace(track=track._replace(rail=rail, has_irregularity=1))
    free = FreeVehicle(vehicle.model, system, vehicle.steady(speed).state)
    offsets = system.frame_offset[system.bodies.frame[system.contact.body]]
    x, c = free.x, free.coordinates

    def evaluated(x: Floats) -> Floats:
        rates = free.rate(x)
        forces = [free.work.wheel[:, :, column].ravel() for column in (W_Q, W_Y)]
        return np.concatenate([rates, *forces])

    columns = []
    for k, step in enumerate(c.steps):
        moved = np.zeros(len(x))
        moved[k] = step
        columns.append((evaluated(x + moved) - evaluated(x - moved)) / (2.0 * step))
    for offset in offsets:
        cell, u = divmod(POSITION + float(offset) - track.s_start, track.ds)
        cell = int(cell)
        smooth = rail[cell].copy()
        for shares in RAILS:
            for order, step in enumerate(STEPS):
                ends = []
                for sign in (1.0, -1.0):
                    shape = np.zeros(4)
                    shape[: order + 1] = _power(order, u)
                    rail[cell] = smooth
                    rail[cell, :4] += sign * step * np.outer(shares, shape)
                    ends.append(evaluated(x))
                columns.append((ends[0] - ends[1]) / (2.0 * step))
        rail[cell] = smooth
    whole = np.transpose(columns)
    readings, names = _readings(sensors, free, whole)
    names += [
        f"{force}.{w + 1}.{side}"
        for force in FORCES
        for w in range(len(offsets))
        for side in ("left", "right")
    ]
    whole = np.concatenate([whole[: len(x)], readings, whole[len(x) :]])
    kept = np.setdiff1d(np.arange(len(x)), c.forceless)
    whole = _without_forceless(whole, c.forceless)
    n = len(kept)
    inputs = whole[:, n:].reshape(len(whole), len(offsets), len(QUANTITIES), ORDERS)
    return TrackResponse(
        speed, tuple(names), offsets, whole[:n, :n], inputs[:n], whole[n:, :n], inputs[n:]
    )


def _power(order: int, u: float) -> Floats:
    """Coefficients of (v - u)^order / order! over v, by rising powers."""
    return np.array(([1.0], [-u, 1.0], [0.5 * u * u, -u, 0.5])[order])


def _without_forceless(whole: Floats, w: NDArray[np.int64]) -> Floats:
    """Eliminate the rates of rails without mass, whose forces balance (see `FreeVehicle`)."""
    if not len(w):
        return whole
    rows, columns = (np.setdiff1d(np.arange(size), w) for size in whole.shape)
    solved = np.linalg.solve(whole[np.ix_(w, w)], whole[np.ix_(w, columns)])
    return np.asarray(whole[np.ix_(rows, columns)] - whole[np.ix_(rows, w)] @ solved)


def _readings(
    sensors: Mapping[str, Sensor], free: FreeVehicle, whole: Floats
) -> tuple[Floats, list[str]]:
    """Rows of what sensors read along x, y, z and of their roll rate, and their names."""
    bodies, c = free.model.index.bodies, free.coordinates
    n = c.n_positions

    def row(body: int, component: int, derivative: int) -> Floats:
        """Row of a displacement, velocity or acceleration; zero where a body does not move so."""
        first = 0 if derivative == 0 else n
        last = n if derivative == 0 else n + c.n_velocities
        there = (c.bodies[first:last] == body) & (c.components[first:last] == component)
        if not there.any():
            return np.zeros(whole.shape[1])
        index = first + int(np.flatnonzero(there)[0])
        return whole[index] if derivative == 2 else np.eye(1, whole.shape[1], index)[0]

    rows, names = [], []
    for name, sensor in sensors.items():
        b = bodies.index(sensor.body)
        turn = np.array([row(b, k, 2) for k in (3, 4, 5)])
        if sensor.axlebox:
            turn[1] = 0.0
        point = np.array([row(b, k, 2) for k in (0, 1, 2)]) + np.cross(
            turn, np.array(sensor.arm)[:, None], axis=0
        )
        roll, pitch = row(b, 3, 0), np.zeros(whole.shape[1])
        if not sensor.axlebox:
            pitch = row(b, 4, 0)
        point[0] += GRAVITY * pitch
        point[1] -= GRAVITY * roll
        rows += [*point, row(b, 3, 1)]
        names += [f"{name}.{axis}" for axis in ("x", "y", "z", "roll_rate")]
    return np.reshape(rows, (-1, whole.shape[1])), names


