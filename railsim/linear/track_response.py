"""What a vehicle on straight track answers to irregularities: its state space with track inputs.

About steady rolling, with u_w the displacement of the rails under wheelset w (alignment,
longitudinal level, cross level, gauge) and ' the derivative along the track,

    x' = A x + sum_w (B_w0 u_w + B_w1 u_w' + B_w2 u_w''),      y likewise with C and D,

by central differences of the equations of motion.  All wheelsets see the same track: wheelset w
stands l_w ahead of the reference body, hence over the angular wave number k at the speed V

    H(k) = C (i k V - A)^-1 B(k) + D(k),    B(k) = sum_w exp(i k l_w) sum_j (i k)^j B_wj.

The matrix i k V - A is solved by Schur's form A = Z T Z*, which exists for a free vehicle too,
whose two zero eigenvalues have one eigenvector.  Outputs are what accelerometers read (see
`railsim.result.sensors`: of a small roll, y reads -g roll as well), Q, Y and the lateral
displacements of the wheelsets against their deflected rails, as `wheelset_lateral` of a run.

What this model does not hold of the contact forces of a wheelset is an input too: an acceleration d
of it in y, z, roll and yaw, which a force -m d_y on the rails and moments belong to.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import schur

from railsim.arrays import Complexes, Floats, Integers
from railsim.constants import GRAVITY
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.system import System
from railsim.linear.circle import POSITION
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.system import jacobian, without_forceless
from railsim.linear.vehicle import LinearVehicle
from railsim.model.work import against_rails
from railsim.notation import SIDES
from railsim.result.sensors import Sensor

QUANTITIES = ("alignment", "level", "cross_level", "gauge")
"""Irregularities [m]; the cross level as height of the left rail over the right one."""
# y_left, z_left, y_right, z_right by one metre of each
RAILS = np.array(
    [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, -0.5, 0.0, 0.5], [-0.5, 0.0, 0.5, 0.0]]
)
ORDERS = 3  # displacement of the rails, its slope and the slope's change
STEPS = (1e-8, 1e-7, 1e-6)  # of these in difference quotients [m, 1, 1/m]
FORCES = ("Q", "Y")
COMPONENTS = (1, 2, 3, 5)  # of a wheelset whose accelerations are partly unknown: y, z, roll, yaw
TOGETHER = 4096  # wave numbers that are solved at once


@dataclass(frozen=True)
class TrackResponse:
    """State space of a vehicle with track inputs u at one speed: y = C x + D u + R x'.

    The inputs are displacements of the rails, their slopes and curvatures.
    """

    speed: float  # [m/s]
    # readings, such as ``axlebox_1_left.z``, ``floor.roll_rate``; forces, such as ``Q.1.left``
    outputs: tuple[str, ...]
    offsets: Floats  # of the wheelsets from the reference body along the track [m]
    A: Floats
    B: Floats
    C: Floats  # apart from accelerations
    D: Floats
    R: Floats
    rows: Integers  # where the accelerations of the wheelsets in y, z, roll, yaw stand in x'
    own: Floats  # outputs by unknown accelerations of the wheelsets, beside R
    steady: Floats  # outputs in steady rolling

    def over(self, wave_numbers: Floats) -> Complexes:
        """Frequency response H over the angular wave number, complex128[k, output, input].

        Inputs are the quantities, then the unknown accelerations of the wheelsets.

        `wave_numbers`: 2 pi over the wavelength [rad/m].
        """
        C = self.C + self.R @ self.A
        D = self.D + np.einsum("mn,nwqo->mwqo", self.R, self.B)
        unknown = self.rows.ravel()
        direct = self.own.reshape(len(self.own), -1) + self.R[:, unknown]
        found = np.empty((len(wave_numbers), len(C), len(QUANTITIES) + len(unknown)), complex)
        T, Z = schur(self.A, output="complex")
        B = np.einsum("nm,nwqo->mwqo", Z.conj(), self.B)
        E, CZ = Z.conj().T[:, unknown], C @ Z
        for begin in range(0, len(wave_numbers), TOGETHER):
            part = slice(begin, begin + TOGETHER)
            k = wave_numbers[part]
            shift = np.exp(1j * k[:, None] * self.offsets)[:, :, None]
            shift = shift * (1j * k[:, None, None]) ** np.arange(ORDERS)
            x = np.einsum("nwqo,kwo->nkq", B, shift, optimize=True)
            x = np.concatenate([x, np.repeat(E[:, None], len(k), axis=1)], axis=2)
            turn = 1j * self.speed * k[:, None]
            for i in range(len(T) - 1, -1, -1):
                x[i] += np.tensordot(T[i, i + 1 :], x[i + 1 :], 1)
                x[i] /= turn - T[i, i]
            found[part] = np.einsum("mn,nkq->kmq", CZ, x, optimize=True)
            found[part, :, : len(QUANTITIES)] += np.einsum("mwqo,kwo->kmq", D, shift, optimize=True)
            found[part, :, len(QUANTITIES) :] += direct
        return found


def track_response(
    vehicle: LinearVehicle, sensors: Mapping[str, Sensor], speed: float
) -> TrackResponse:
    """Return the state space of a vehicle with track inputs.

    `vehicle`: on straight track, its wheelsets free; `sensors`: what reads accelerations; `speed`:
    [m/s]. Raises ModelError: there is no steady rolling, or a derivative is not finite.
    """
    track = vehicle.system.track
    rail = track.rail.copy()
    system = vehicle.system._replace(track=track._replace(rail=rail, has_irregularity=1))
    free = FreeVehicle(vehicle.model, system, vehicle.steady(speed))
    offsets = system.frame_offset[system.bodies.frame[system.contact.body]]
    x, c = free.x, free.coordinates

    def rates_and_forces(x: Floats) -> Floats:
        rates, state = free.rate(x), free.state.copy()
        state[c.indices] = x
        Q, Y = (free.work.wheel[:, :, column] for column in (W_Q, W_Y))
        lateral = against_rails(system, state[None])[0, :, 0]
        return np.concatenate([rates, Q.ravel(), Y.ravel(), Y.sum(axis=1), lateral])

    of_states = jacobian(lambda rows: np.array([rates_and_forces(row) for row in rows]), x, c.steps)
    columns = [*of_states.T]
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
                    ends.append(rates_and_forces(x))
                columns.append((ends[0] - ends[1]) / (2.0 * step))
        rail[cell] = smooth
    whole = without_forceless(np.transpose(columns), c.forceless)
    n, count = len(x) - len(c.forceless), len(offsets)  # rates without force stand last
    inputs = whole[:, n:].reshape(len(whole), count, len(QUANTITIES), ORDERS)
    C, R, names = _readings(sensors, free, n)
    return TrackResponse(
        speed,
        (*names, *_of_wheelsets(len(offsets))),
        offsets,
        whole[:n, :n],
        inputs[:n],
        np.concatenate([C, whole[n:, :n]]),
        np.concatenate([np.zeros((len(C), *inputs.shape[1:])), inputs[n:]]),
        np.concatenate([R, np.zeros((6 * count, n))]),
        np.array([[c.velocity_of[int(b), k] for k in COMPONENTS] for b in system.contact.body]),
        _forces_of(system, len(C)),
        np.concatenate([np.zeros(len(C)), rates_and_forces(x)[len(x) :]]),
    )


def _of_wheelsets(count: int) -> list[str]:
    """Names of the outputs Q, Y, sum of Y and lateral displacement."""
    wheels = product(FORCES, range(1, count + 1), SIDES)
    names = [f"{force}.{number}.{side}" for force, number, side in wheels]
    return names + [f"{name}.{w + 1}" for name in ("sum_Y", "lateral") for w in range(count)]


def _forces_of(system: System, before: int) -> Floats:
    """What Q and Y have of unknown accelerations of the wheelsets, float64[m, w, component].

    With F_y = -m d_y on the rails at the radius r below the axle, the moments about x leave
    dQ_left - dQ_right = (I_x d_roll + r m d_y)/b0, and dQ_left + dQ_right = -m d_z.
    """
    bodies, count = system.contact.body, len(system.contact.body)
    own = np.zeros((before + 6 * count, count, len(COMPONENTS)))
    base = system.track.rail_base
    for w, b in enumerate(bodies):
        mass, roll = system.bodies.mass[b], system.bodies.inertia[b, 0]
        for side, sign in enumerate((1.0, -1.0)):
            Q = before + 2 * w + side
            turned = sign * np.array([system.bodies.radius[b] * mass, 0.0, roll, 0.0]) / base
            own[Q, w] = turned + np.array([0.0, -0.5 * mass, 0.0, 0.0])
            own[Q + 2 * count, w, 0] = -0.5 * mass
        own[before + 4 * count + w, w, 0] = -mass
    return own


def _power(order: int, u: float) -> Floats:
    """Coefficients of (v - u)^order / order! over v, by rising powers."""
    return np.array(([1.0], [-u, 1.0], [0.5 * u * u, -u, 0.5])[order])


def _readings(
    sensors: Mapping[str, Sensor], free: FreeVehicle, n: int
) -> tuple[Floats, Floats, list[str]]:
    """C and R of what sensors read along x, y, z and of their roll rate, and their names."""
    bodies, c = free.model.index.bodies, free.coordinates
    C, R, names = [], [], []
    for name, sensor in sensors.items():
        b = bodies.index(sensor.body)

        def row(component: int, known: Mapping[tuple[int, int], int], b: int = b) -> Floats:
            """Unit row of a displacement or velocity; zero where the body does not move so."""
            found = known.get((b, component))
            return np.zeros(n) if found is None else np.eye(1, n, found)[0]

        turn = np.array([row(k, c.velocity_of) for k in (3, 4, 5)])
        pitch = np.zeros(n) if sensor.axlebox else row(4, c.position_of)
        turn[1] *= not sensor.axlebox
        point = np.array([row(k, c.velocity_of) for k in (0, 1, 2)])
        point += np.cross(turn, np.array(sensor.arm)[:, None], axis=0)
        R += [*point, np.zeros(n)]
        C += [GRAVITY * pitch, -GRAVITY * row(3, c.position_of), np.zeros(n), row(3, c.velocity_of)]
        names += [f"{name}.{axis}" for axis in ("x", "y", "z", "roll_rate")]
    return np.reshape(C, (-1, n)), np.reshape(R, (-1, n)), names
