"""Wheel-rail contact of a vehicle on a rough track, made linear in the mean.

Profiles are no cones: the forces of a wheelset that moves by some millimetres have little to do
with the tangent at its middle.  A run over a track of the assumed spectrum is simulated; what the
accelerations of each wheelset in y and yaw have beyond the tangent's,

    e = a - (A x + B u),

is fitted by least squares over its lateral displacement against the rails, its yaw and their rates:
the linear system with the smallest mean square error (statistical linearisation, Booton 1954).
What remains, and all of e in z and roll, is noise of the state with the spectrum found.  The
wheelsets come over the same place one after the other, and what remains of them is alike there;
the spectrum is that of independent noises with the same effect on their sum, where it is larger.

In a curve a wheelset moves about another place of its profiles; the same fit about the means of a
run through it.  A mirror image changes neither the gains nor the spectra.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from railsim.arrays import Complexes, Floats, Integers
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import even_line
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import ModelError
from railsim.linear.circle import circle
from railsim.linear.track_response import COMPONENTS, ORDERS, RAILS, TrackResponse
from railsim.linear.vehicle import LinearVehicle
from railsim.observation.pieces import on_grid
from railsim.result import Result
from railsim.simulation.run import simulate
from railsim.track.irregularity import displacement

LENGTH, SEED, TAPER = 1500.0, 11, 60.0  # of the simulated run [m]
RATE = 1000.0  # 1/s
STEP = 0.25  # m
SMOOTHED = 0.15  # width of the average of spectra, over the wave number
LEAST = 1e-12  # (m/s2)2, (rad/s2)2


@dataclass(frozen=True)
class Noise:
    """Spectra of what the linear contact leaves out.

    `power` (float64[k, component]): Two-sided, of samples at `STEP`: of white noise its variance.
    Accelerations of a wheelset in y, z, roll, yaw, the mean of all wheelsets.
    """

    wave_numbers: Floats  # [rad/m], float64[k]
    power: Floats
    amplitude: float  # rms of the lateral displacement of the wheelsets against the rails [m]

    def at(self, wave_numbers: Floats, step: float) -> Floats:
        """Power for samples at a step [m], float64[k, component]."""
        power = [np.interp(wave_numbers, self.wave_numbers, row) for row in self.power.T]
        return np.asarray(np.transpose(power) * STEP / step + LEAST)


def with_mean_contact(
    vehicle: Vehicle,
    track: Track,
    linear: LinearVehicle,
    tangent: TrackResponse,
    irregularity: dict[str, object],
    curve: tuple[float, float] = (0.0, 0.0),
) -> tuple[TrackResponse, Noise]:
    """Return the response with the contact of a rough track, and the noise that remains.

    `vehicle`, `track`: Of the track the rails count; friction and support where `linear` takes
    them. `linear`, `tangent`: About steady rolling, at the speed in question. `irregularity`: Of
    the type ``random``, as in a track file.
    `curve`: Curvature and cant of the run [1/m, m]; what moves about its mean is fitted.
    Raises ModelError: The vehicle does not complete the run.
    """
    rough = circle(track, at=linear.at).replace(
        **even_line(LENGTH, *curve),
        irregularities=[{**irregularity, "type": "random", "seed": SEED}],
    )
    result = simulate(vehicle, rough, speed=tangent.speed, settings=Settings(output_rate=RATE))
    if result.status != "complete":
        raise ModelError(f"the run for the contact's linearisation: {result.status}")
    s = result["distance"]
    reach = float(np.max(np.abs(tangent.offsets))) + 2.0
    grid = np.arange(reach, float(s[-1]) - reach, STEP)
    k: Floats = 2.0 * np.pi * np.fft.rfftfreq(len(grid), STEP).astype(float)
    displacement_of = displacement(rough)
    assert displacement_of is not None  # it has irregularities
    window = _window(len(grid))

    def spectrum(values: Floats) -> Complexes:
        return np.fft.rfft((values - values.mean()) * window)

    # alignment, level, cross level and gauge of y_left, z_left, y_right, z_right
    u = np.stack([spectrum(row) for row in np.linalg.inv(RAILS.T) @ displacement_of(grid)[0]])
    x, places = _states(linear, tangent, result, lambda y: spectrum(on_grid(s, y, grid)))
    shift = np.exp(1j * k[:, None] * tangent.offsets)[:, :, None]
    shift = shift * (1j * k[:, None, None]) ** np.arange(ORDERS)
    driven = np.einsum("nwqo,kwo,qk->nk", tangent.B, shift, u, optimize=True)
    A, B = tangent.A.copy(), tangent.B.copy()
    hidden = np.setdiff1d(np.arange(len(A)), places)
    forcing = A[np.ix_(hidden, places)] @ x[places] + driven[hidden]
    system = 1j * tangent.speed * k[:, None, None] * np.eye(len(hidden)) - A[np.ix_(hidden, hidden)]
    x[hidden, 1:] = np.linalg.solve(system[1:], forcing.T[1:, :, None])[:, :, 0].T
    # at rest, elements that keep their state have no equation
    x[hidden, 0] = np.linalg.lstsq(system[0], forcing[:, 0], rcond=None)[0]
    inner = slice(int(TAPER / STEP), -int(TAPER / STEP))
    power = np.zeros((len(COMPONENTS), len(k)))
    common = np.zeros((len(COMPONENTS), len(k)), dtype=complex)
    amplitudes = []
    coordinates = linear.coordinates
    for w, b in enumerate(linear.model.system.contact.body):
        y, yaw = (coordinates.position_of[int(b), k] for k in (1, 5))
        states = [y, yaw, int(tangent.rows[w, 0]), int(tangent.rows[w, 3])]
        parts = x[states].copy()
        parts[0] -= u[0] * shift[:, w, 0]
        motion = np.fft.irfft(parts, len(grid), axis=1)
        amplitudes.append(motion[0, inner].std())
        for number, component in enumerate(COMPONENTS):
            row = tangent.rows[w, number]
            acceleration = spectrum(on_grid(s, result["body_acceleration"][:, b, component], grid))
            rest = np.fft.irfft(acceleration - tangent.A[row] @ x - driven[row], len(grid))
            if component in (1, 5):
                gain = np.linalg.lstsq(motion[:, inner].T, rest[inner], rcond=None)[0]
                A[row, states] += gain
                B[row, w, 0, 0] -= gain[0]
                rest = rest - gain @ motion
            own_part = np.fft.rfft(rest * window) / np.sqrt(np.sum(window**2))
            power[number] += np.abs(own_part) ** 2
            common[number] += own_part * np.conj(shift[:, w, 0])
    count = len(tangent.offsets)
    alone, together = (_smoothed(k, p / count) for p in (power, np.abs(common) ** 2))
    noise = Noise(k, np.maximum(alone, together).T, float(np.mean(amplitudes)))
    return replace(tangent, A=A, B=B), noise


def _window(n: int) -> Floats:
    """Cosine rise and fall over `TAPER` at both ends."""
    m = int(TAPER / STEP)
    window = np.ones(n)
    window[:m] = 0.5 - 0.5 * np.cos(np.pi * np.arange(m) / m)
    window[-m:] = window[:m][::-1]
    return window


def _states(
    linear: LinearVehicle,
    tangent: TrackResponse,
    result: Result,
    spectrum: Callable[[Floats], Complexes],
) -> tuple[Complexes, Integers]:
    """Spectra of the states that a result holds, and which these are."""
    c, n = linear.coordinates, len(tangent.A)
    places = np.flatnonzero(c.bodies[:n] >= 0)
    first = result["body_position"]
    x = np.zeros((n, len(spectrum(first[:, 0, 0]))), dtype=complex)
    for i in places:
        source = first if i < c.n_positions else result["body_velocity"]
        x[i] = spectrum(source[:, c.bodies[i], c.components[i]])
    return x, places


def _smoothed(k: Floats, power: Floats) -> Floats:
    """Mean over a band around each wave number."""
    total = np.concatenate([np.zeros((len(power), 1)), np.cumsum(power, axis=1)], axis=1)
    half = np.maximum(4, (SMOOTHED * np.arange(len(k))).astype(int))
    low = np.maximum(np.arange(len(k)) - half, 0)
    high = np.minimum(np.arange(len(k)) + half + 1, len(k))
    return np.asarray((total[:, high] - total[:, low]) / (high - low))
