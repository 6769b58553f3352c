"""The track from accelerations: `irregularity`, and the wheel forces with it.

A vehicle in service reads accelerations; the smoother (`smoother.py`) returns the irregularities
that it has come over, and the forces of its wheels, each with its standard deviation.  Its fields
are alignment, level, cross level and gauge with the powers of a spectrum, and for each wheelset the
accelerations in y, z, roll and yaw that the linear contact leaves out (`contact.py`).

The model is one of constant speed.  A run is divided into pieces that overlap, each with its mean
speed; a piece ends after `LONGEST` or where the speed has left a band of `SPEEDS`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from railsim.contact.geometry import geometry_of
from railsim.definitions.excitations.recording import ORDER
from railsim.definitions.excitations.spectra import SPECTRA
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import Fault, InputError, argument_fault, nearest
from railsim.linear.track_response import QUANTITIES, TrackResponse, track_response
from railsim.linear.vehicle import LinearVehicle
from railsim.measurement import Measurement
from railsim.observation.contact import Noise, in_the_mean
from railsim.observation.estimate import BANDS, Estimate, Irregularity, joined
from railsim.observation.grid import HALF, on_grid
from railsim.observation.smoother import Complex, Fields
from railsim.result.sensors import all_sensors

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Progress = Callable[[float], None]

STEP = 0.25  # m
LONGEST, OVERLAP, SHORTEST = 2000.0, 200.0, 300.0  # of pieces [m]
SPEEDS = 0.06  # largest over smallest speed of a piece, less 1
PERIOD = 60.0  # by which the period is longer than a piece [m]
MARGIN = 20.0  # at both ends of a record [m]
SLOWEST = 5.0  # m/s
NOISE = {"sensor_acceleration": 0.05, "sensor_roll_rate": 1e-3}  # m/s2, rad/s, of one value
BIAS = {"sensor_acceleration": 0.2, "sensor_roll_rate": 5e-3}
MODEL = 0.03  # error of the response over its rms: masses, springs, dampers that are not linear
AROUND_GAP = 8  # steps beside a gap that are left out
ALIKE, UNLIKE = 0.3, 3.0  # correlation, ratio of rms values: read, and said by other channels
BEYOND = 30.0  # power of what does not agree, over that which noise and model explain
FEWEST = 3  # channels of which one can be wrong
FLANGE = 0.7  # rad, contact angle
SEEN = 0.5  # share of the variance that the channels explain, below which nothing is filled in
CHANNELS = ("lateral", "vertical", "cross_level", "gauge")  # of a spectrum, as `QUANTITIES`
CANT = 1.5  # m, between the rails


@dataclass(frozen=True)
class Assumed:
    """What is known of the track before the measurement, and of the sensors.

    Attributes
    ----------
    spectrum : str
        Of `railsim.definitions.excitations.spectra.SPECTRA`.
    scale : float
        Factor on its displacements.
    wavelengths : tuple of float
        Shortest and longest wavelength that the track has [m].
    noise : float
        rms of a value of an accelerometer, of channels whose file does not say it [m/s2].
    bias : float
        Standard deviation of what accelerometers show at rest [m/s2].
    """

    spectrum: str = "erri_b176_low"
    scale: float = 1.0
    wavelengths: tuple[float, float] = (3.0, 100.0)
    noise: float = NOISE["sensor_acceleration"]
    bias: float = BIAS["sensor_acceleration"]

    def check(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        InputError
        """
        low, high = self.wavelengths
        checks = (
            (self.spectrum in SPECTRA, "spectrum", self.spectrum, nearest(self.spectrum, SPECTRA)),
            (self.scale > 0.0, "scale", f"{self.scale:g}", "a positive number"),
            (self.noise > 0.0, "noise", f"{self.noise:g} m/s2", "a positive number of m/s2"),
            (self.bias > 0.0, "bias", f"{self.bias:g} m/s2", "a positive number of m/s2"),
            (1.0 <= low < high <= 300.0, "wavelengths", f"{low:g} to {high:g} m",
             "shortest and longest, 1 to 300 m"),
        )  # fmt: skip
        faults = [
            argument_fault(name, "", f"found {f}", a) for right, name, f, a in checks if not right
        ]
        if faults:
            raise InputError(faults)

    def power(self, wave_numbers: Floats, points: int) -> Floats:
        """Two-sided power of the four quantities, float64[k, quantity]."""
        spectrum, step = SPECTRA[self.spectrum], wave_numbers[1]
        ends = 2.0 * np.pi / np.array(self.wavelengths[::-1])
        low, high = np.clip([wave_numbers - 0.5 * step, wave_numbers + 0.5 * step], *ends)
        found = np.zeros((len(wave_numbers), len(CHANNELS)))
        for number, channel in enumerate(CHANNELS):
            if channel in spectrum.channels:
                factor = self.scale**2 * (CANT**2 if channel == "cross_level" else 1.0)
                shares = spectrum.bin_variances(channel, low, high)
                found[:, number] = 0.5 * points * factor * shares
        return found


@dataclass(frozen=True)
class _Piece:
    """Part of a run at a nearly constant speed: its grid, signals, and where these exist."""

    grid: Floats
    signals: Floats
    there: Bools
    speed: float
    rate: float


def irregularity(
    measurement: Measurement,
    vehicle: Vehicle,
    track: Track,
    *,
    assumed: Assumed | None = None,
    progress: Progress | None = None,
) -> Irregularity:
    """Return the irregularities and wheel forces behind a measured run.

    Parameters
    ----------
    measurement : Measurement
        With channels ``sensor_acceleration:POINT:AXIS`` or ``sensor_roll_rate:POINT``.
    vehicle, track : Vehicle, Track
        The vehicle that measured; rails, gauge, friction and support of the track, straight.
    assumed : Assumed, optional
        Spectrum and noise.
    progress : callable, optional
        Called repeatedly with the finished fraction.

    Raises
    ------
    InputError
        No channel that can be used, points that the vehicle does not have, a record too short or
        too slow.
    ModelError
        The vehicle cannot be linearised, or does not complete the run that does so.
    """
    assumed = assumed or Assumed()
    assumed.check()
    known = all_sensors(vehicle)
    used = _used(measurement, known)
    remarks = list(measurement.remarks)
    left = [name for name in measurement.channels if name not in used]
    if left:
        remarks.append(f"Not used: {', '.join(left)}; the smoother reads accelerations.")
    pieces = _pieces(measurement, list(used))
    bare = track.replace(irregularities=[])
    linear = LinearVehicle(vehicle, bare)
    smooth = _Smooth(vehicle, bare, linear, assumed, measurement, used)
    found = []
    for number, piece in enumerate(pieces):
        found.append(smooth.estimate(piece))
        if progress is not None:
            progress((number + 1) / len(pieces))
    remarks += smooth.remarks() + _curves(track, measurement)
    return joined(measurement.name, vehicle.name, found, smooth.flanges, remarks)


def _curves(track: Track, measurement: Measurement) -> list[str]:
    """Remark on curves, which the model does not have."""
    begin, end = measurement.distance[[0, -1]]
    curved = [
        section
        for section in curvature_sections(track)
        if (section.start_value or section.end_value)
        and section.begin < end
        and section.end > begin
    ]
    if not curved:
        return []
    low, high = min(c.begin for c in curved), max(c.end for c in curved)
    return [
        f"The track has curves between s = {low:.0f} and {high:.0f} m; the model is one on "
        "straight track: alignment, Y and sum Y there are not to be relied upon."
    ]


def _used(measurement: Measurement, known: dict[str, Any]) -> dict[str, str]:
    """Outputs of the linear vehicle by channel: ``axlebox_1_left.z``."""
    used, faults = {}, []
    for name, quantity in measurement.quantities.items():
        kind, *labels = quantity.split(":")
        if kind not in NOISE:
            continue
        if labels[0] not in known:
            found = f"the vehicle has no sensor '{labels[0]}'"
            key = f"channels.{name}.quantity"
            faults.append(Fault(measurement.name, key, found, nearest(labels[0], known)))
            continue
        used[name] = f"{labels[0]}.{labels[1] if len(labels) > 1 else 'roll_rate'}"
    if not used and not faults:
        allowed = "sensor_acceleration:axlebox_1_left:z and others of axleboxes, frames and floor"
        faults.append(Fault(measurement.name, "channels", "no accelerations", allowed))
    if faults:
        raise InputError(faults)
    return used


def _pieces(measurement: Measurement, names: list[str]) -> list[_Piece]:
    """Divide a run where its speed changes."""
    s, v = measurement.distance, measurement.speed
    fault = None
    if s[-1] - s[0] < SHORTEST + 2.0 * MARGIN:
        fault = Fault(
            measurement.name, "distance", f"{s[-1] - s[0]:.0f} m", f"{SHORTEST:g} m at least"
        )
    elif v.min() < SLOWEST:
        fault = Fault(measurement.name, "speed", f"{v.min():.3g} m/s", f"{SLOWEST:g} m/s at least")
    if fault:
        raise InputError([fault])
    pieces, begin = [], float(s[0]) + MARGIN
    last = float(s[-1]) - MARGIN
    while True:
        inside = (s >= begin) & (s <= min(begin + LONGEST, last))
        speeds = v[inside]
        spread = np.maximum.accumulate(speeds) / np.minimum.accumulate(speeds) - 1.0
        count = int(np.searchsorted(spread, SPEEDS))
        end = float(s[inside][min(count, len(speeds)) - 1])
        end = min(max(end, begin + SHORTEST), last)
        if last - end < SHORTEST - OVERLAP:
            end = last
        pieces.append(_piece(measurement, names, begin, end))
        if end >= last:
            return pieces
        begin = end - OVERLAP


def _piece(measurement: Measurement, names: list[str], begin: float, end: float) -> _Piece:
    reach = HALF * STEP + 1.0
    part = measurement.part(begin - reach, end + reach)
    grid: Floats = begin + STEP * np.arange(int((end - begin) / STEP) + 1, dtype=np.float64)
    signals, there = [], []
    for name in names:
        x = part[name]
        unknown = np.isnan(x)
        lost = np.zeros(len(grid), dtype=bool)
        if unknown.all():
            signals.append(np.zeros(len(grid)))
            there.append(lost)
            continue
        if unknown.any():
            x = np.interp(part.distance, part.distance[~unknown], x[~unknown])
            near = np.searchsorted(grid, part.distance[unknown])
            lost[np.clip(near, 0, len(grid) - 1)] = True
            lost = np.convolve(lost, np.ones(2 * AROUND_GAP + 1), mode="same") > 0
        signals.append(on_grid(part.distance, x, grid))
        there.append(~lost)
    speed = float(np.mean(part.speed))
    return _Piece(grid, np.array(signals), np.array(there), speed, measurement.rate)


class _Smooth:
    """The smoother of a vehicle for its channels, at any speed."""

    def __init__(
        self,
        vehicle: Vehicle,
        track: Track,
        linear: LinearVehicle,
        assumed: Assumed,
        measurement: Measurement,
        used: dict[str, str],
    ) -> None:
        self.vehicle, self.track, self.linear, self.assumed = vehicle, track, linear, assumed
        self.channels, self.used, self.known = list(used), list(used.values()), all_sensors(vehicle)
        kinds = [measurement.quantities[name].split(":")[0] for name in used]
        default = {**NOISE, "sensor_acceleration": assumed.noise}
        self.noise = np.array(
            [measurement.channel(n).noise or default[k] for n, k in zip(used, kinds, strict=True)]
        )
        bias = {**BIAS, "sensor_acceleration": assumed.bias}
        self.bias = np.array([bias[kind] for kind in kinds])
        self._models: dict[float, tuple[TrackResponse, Noise]] = {}
        self.said: list[str] = []
        self._wrong: set[int] | None = None
        self.flanges = _flanges(linear, track)
        self._last: tuple[tuple[float, int], Complex] | None = None

    def remarks(self) -> list[str]:
        """Remarks on the model, and on channels that read another thing than they should."""
        return [*self.linear.remarks, *self.said]

    def model(self, speed: float) -> tuple[TrackResponse, Noise]:
        """Linear vehicle and noise of its state at a speed [m/s]."""
        if speed not in self._models:
            tangent = track_response(self.linear, self.known, speed)
            rough = {
                "spectrum": self.assumed.spectrum,
                "wavelengths": list(self.assumed.wavelengths),
                "scale": self.assumed.scale,
            }
            self._models[speed] = in_the_mean(self.vehicle, self.track, self.linear, tangent, rough)
        return self._models[speed]

    def estimate(self, piece: _Piece) -> Estimate:
        """Return fields and forces of a piece with their standard deviations."""
        speed = float(f"{piece.speed:.3g}")
        response, noise = self.model(speed)
        n = len(piece.grid)
        points = next_fast_len(n + int(PERIOD / STEP), real=True)
        k = _wave_numbers(points)
        power = self.assumed.power(k, points)
        unknown = np.tile(noise.at(k, STEP), len(response.offsets))
        whole = self._response(response, k, speed)
        chosen = [response.outputs.index(name) for name in self.used]
        H = whole[:, chosen]
        tracks = H[:, :, : len(QUANTITIES)]
        errors = (
            self.noise**2 * piece.speed / piece.rate / STEP
            + MODEL**2
            * np.einsum("kcq,kq,kcq->kc", tracks, power, tracks.conj(), optimize=True).real
        )
        errors[0] += points * self.bias**2
        fields = Fields(points, np.hstack([power, unknown]), H, errors)
        padded = ((0, 0), (0, points - n))
        if self._wrong is None:
            self._wrong = self._disagreeing(fields, piece)
        there = piece.there.copy()
        there[list(self._wrong)] = False
        mean = fields.mean(np.pad(piece.signals, padded), np.pad(there, padded))
        covariance = fields.covariance()
        return _estimate(piece, response, whole, mean, covariance, power)

    def _disagreeing(self, fields: Fields, piece: _Piece) -> set[int]:
        """Channels that read another thing than the others say; a remark on each.

        What the others say of channel c is y_c - (G^-1 y)_c/(G^-1)_cc.  The worst one is left out
        before the others are looked at again.
        """
        n, points = len(piece.grid), fields.points
        taper = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) * STEP / PERIOD)
        where = piece.there * taper
        read = np.pad(piece.signals - _means(piece.signals, piece.there), ((0, 0), (0, points - n)))
        read[:, :n] *= where
        spectra, left = np.fft.rfft(read, axis=1), list(range(len(read)))
        wrong: set[int] = set()
        G = fields.data_covariance()
        while len(left) > FEWEST and len(wrong) < len(read) // 3:
            inverse = np.linalg.inv(G[:, left][:, :, left])
            own = np.einsum("kcc->ck", inverse).real
            rest = np.einsum("kcd,dk->ck", inverse, spectra[left], optimize=True) / own
            said = np.fft.irfft(spectra[left] - rest, points, axis=1)
            beyond = np.mean(np.abs(rest) ** 2 * own, axis=1) / points
            product = np.sum(read[left] * said, axis=1)
            sizes = np.linalg.norm(read[left], axis=1), np.linalg.norm(said, axis=1)
            worst = int(np.argmax(beyond))
            name, c = self.channels[left[worst]], product[worst] / (sizes[0] * sizes[1])[worst]
            ratio = (sizes[0] / sizes[1])[worst]
            if c < -ALIKE:
                words = (
                    f"has the opposite sign of what the other channels say ({c:.2f}): 'reverse'?"
                )
            elif c > ALIKE and not 1.0 / UNLIKE < ratio < UNLIKE:
                words = f"is {ratio:.2g} times what the other channels say: another 'unit'?"
            elif c < ALIKE and beyond[worst] > BEYOND:
                words = (
                    f"does not agree with what the other channels say (correlation {c:.2f}): "
                    "another point or axis, or a clock that runs apart?"
                )
            else:
                break
            self.said.append(f"{name} {words} It is left out.")
            wrong.add(left.pop(worst))
        return wrong

    def _response(self, response: TrackResponse, k: Floats, speed: float) -> Complex:
        """H of all outputs, that of a constant left out; the last one is kept."""
        key = speed, len(k)
        if self._last is None or self._last[0] != key:
            H = np.zeros(
                (len(k), len(response.outputs), len(QUANTITIES) + response.rows.size), complex
            )
            H[1:] = response.over(k[1:])
            H[-1] = H[-1].real
            self._last = key, H
        return self._last[1]


def _estimate(
    piece: _Piece,
    response: TrackResponse,
    whole: Complex,
    mean: Floats,
    covariance: Complex,
    power: Floats,
) -> Estimate:
    n, points = len(piece.grid), mean.shape[1]
    k = _wave_numbers(points)
    number = len(QUANTITIES)
    spectra = np.fft.rfft(mean, axis=1)
    forces = [i for i, o in enumerate(response.outputs) if o[:2] in ("Q.", "Y.", "su", "la")]
    outputs = np.einsum("kcq,qk->ck", whole[:, forces], spectra, optimize=True)
    rest = np.einsum(
        "kcp,kpq,kcq->ck", whole[:, forces], covariance, whole[:, forces].conj(), optimize=True
    ).real
    own = covariance[:, range(number), range(number)].real.T
    power = power.T
    with np.errstate(invalid="ignore"):
        seen = np.where(power > 0.0, 1.0 - own / np.where(power > 0.0, power, 1.0), 0.0)
    kept = seen >= SEEN
    error = np.where(kept, own, power)
    found = np.where(kept, spectra[:number], 0.0)
    bands, deviations = {}, {}
    for name, gain in _gains(k).items():
        bands[name] = np.fft.irfft(gain * found, points, axis=1)[:, :n]
        deviations[name] = _rms(gain**2 * error, points)
    return Estimate(
        s=piece.grid,
        speed=piece.speed,
        values=np.fft.irfft(found, points, axis=1)[:, :n],
        deviations=_rms(error, points),
        bands=bands,
        band_deviations=deviations,
        wave_numbers=k,
        seen=seen,
        power=power,
        outputs=tuple(response.outputs[i] for i in forces),
        forces=np.fft.irfft(outputs, points, axis=1)[:, :n] + response.steady[forces][:, None],
        force_deviations=_rms(rest, points),
    )


def _means(x: Floats, there: Bools) -> Floats:
    count = np.maximum(there.sum(axis=1), 1)
    return np.asarray((np.where(there, x, 0.0).sum(axis=1) / count)[:, None])


def _flanges(linear: LinearVehicle, track: Track) -> Floats:
    """Lateral displacement of each wheelset at which a flange touches [m]; inf where unknown."""
    found = []
    for b in linear.model.system.contact.body:
        body = next(
            body
            for body in linear.model.flat.bodies
            if body.name == linear.model.index.bodies[int(b)]
        )
        assert body.wheelset is not None  # it has contacts
        geometry = geometry_of(body.wheelset, track, linear.model.profiles)
        touching = np.inf
        if geometry is not None:
            steep = np.nanmax(geometry.contact_angle, axis=1) > FLANGE
            if steep.any():
                touching = float(np.min(np.abs(geometry.lateral[steep])))
        found.append(touching)
    return np.array(found)


def _wave_numbers(points: int) -> Floats:
    return np.asarray(2.0 * np.pi * np.fft.rfftfreq(points, STEP), dtype=np.float64)


def _gains(k: Floats) -> dict[str, Floats]:
    """Magnitude of the band passes over the wave number, see `recording.band_passed`."""
    found = {}
    with np.errstate(divide="ignore"):
        for name, (shortest, longest) in BANDS.items():
            f = k / (2.0 * np.pi)
            below = np.where(f > 0.0, 1.0 / longest / f, np.inf) ** (2 * ORDER)
            found[name] = 1.0 / np.sqrt((1.0 + below) * (1.0 + (f * shortest) ** (2 * ORDER)))
    return found


def _rms(power: Floats, points: int) -> Floats:
    """Root of the variance of two-sided powers of the bins of `rfft`."""
    return np.asarray(np.sqrt((2.0 * power.sum(axis=1) - power[:, 0] - power[:, -1]) / points))
