"""The track from accelerations: `irregularity`, and the wheel forces with it.

A vehicle in service reads accelerations; the smoother (`smoother.py`) returns the irregularities
that it has come over, and the forces of its wheels, each with its standard deviation.  Its fields
are alignment, level, cross level and gauge with the powers of a spectrum, and for each wheelset the
accelerations in y, z, roll and yaw that the linear contact leaves out (`contact.py`).

The linear model is one of straight track and constant speed; what a simulated run reads without
irregularities is taken off before, what it lacks else is in the runs by which its estimate is put
right (`simulated.py`).  With these its contact is that of the sharpest place of a piece.  A run is
divided into pieces (`pieces.py`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.fft import next_fast_len

from railsim.arrays import Complexes, Flags, Floats
from railsim.constants import CANT_BASE, GRAVITY
from railsim.contact.geometry import geometry_of
from railsim.definitions.excitations.spectra import SPECTRA
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections, is_uniform
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import Faults, ModelError, argument_error, input_error, nearest
from railsim.linear.track_response import QUANTITIES, TrackResponse, track_response
from railsim.linear.vehicle import LinearVehicle
from railsim.measurement import Measurement
from railsim.measurement.alignment import CURVATURES
from railsim.measurement.counterpart import amplifier
from railsim.observation import estimate, innovations
from railsim.observation.contact import Noise, with_mean_contact
from railsim.observation.estimate import Estimate, Irregularity, join_pieces, rms
from railsim.observation.innovations import KINDS, Powers, Sizes, likely_sizes, spectra_of
from railsim.observation.pieces import MARGIN, STEP, Piece, pieces_of, used_channels
from railsim.observation.simulated import CHANGE, SimulatedRun, refine
from railsim.observation.smoother import filtered
from railsim.result.sensors import READINGS, all_sensors
from railsim.simulation.remarks import silent
from railsim.track.alignment import Alignment

Progress = Callable[[float], None]

PERIOD = 60.0  # by which the period is longer than a piece [m]
NOISE = dict(zip(READINGS, (0.05, 1e-3), strict=True))  # m/s2, rad/s, of one value
BIAS = dict(zip(READINGS, (0.2, 5e-3), strict=True))
REMAINDER = 0.04  # of the power of what the linear contact leaves out, about a simulated run
# least power of it in y and yaw for the errors: intervals of twins cover their share
LOCAL = 0.08
SIMULATIONS = 25  # at most, for each piece
LEVEL = 30.0  # rms of what channels read over what is assumed: beyond this a unit is wrong
FLANGE = 0.7  # rad, contact angle
CHANNELS = ("lateral", "vertical", "cross_level", "gauge")  # of a spectrum, as `QUANTITIES`
STRAIGHT = 1e-5  # 1/m, curvature that counts as none
# Means over a length [m] that show another curve: twice a bias, half of 1/R at R = 2.5 km
WINDOW, MOST_Y, MOST_CURVATURE = 100.0, 0.4, 2e-4  # m/s2, 1/m


@dataclass(frozen=True)
class Assumed:
    """What is known of the track before the measurement, and of the sensors."""

    spectrum: str = "erri_b176_low"  # of `railsim.definitions.excitations.spectra.SPECTRA`
    scale: float = 1.0  # factor on its displacements
    wavelengths: tuple[float, float] = (3.0, 100.0)  # shortest and longest that the track has [m]
    # rms of a value of an accelerometer, of channels whose file does not say it [m/s2]
    noise: float = NOISE["sensor_acceleration"]
    # standard deviation of what accelerometers show at rest [m/s2]
    bias: float = BIAS["sensor_acceleration"]

    def check(self) -> None:
        """Raise InputError: what cannot be."""
        low, high = self.wavelengths
        known, faults = self.spectrum in SPECTRA, Faults()
        faults.require(known, "spectrum", f"found {self.spectrum}", nearest(self.spectrum, SPECTRA))
        faults.require(self.scale > 0.0, "scale", f"found {self.scale:.12g}", "a positive number")
        for name, value in (("noise", self.noise), ("bias", self.bias)):
            allowed = "a positive number of m/s2"
            faults.require(value > 0.0, name, f"found {value:.12g} m/s2", allowed)
        inside, allowed = 1.0 <= low < high <= 300.0, "shortest and longest, 1 to 300 m"
        faults.require(inside, "wavelengths", f"found {low:.12g} to {high:.12g} m", allowed)
        faults.check()

    def power(self, wave_numbers: Floats, points: int) -> Floats:
        """Two-sided power of the four quantities, float64[k, quantity]."""
        spectrum, step = SPECTRA[self.spectrum], wave_numbers[1]
        ends = 2.0 * np.pi / np.array(self.wavelengths[::-1])
        low, high = np.clip([wave_numbers - 0.5 * step, wave_numbers + 0.5 * step], *ends)
        power = np.zeros((len(wave_numbers), len(CHANNELS)))
        for number, channel in enumerate(CHANNELS):
            if channel in spectrum.channels:
                factor = self.scale**2 * (CANT_BASE**2 if channel == "cross_level" else 1.0)
                shares = spectrum.bin_variances(channel, low, high)
                power[:, number] = 0.5 * points * factor * shares
        return power


def irregularity(
    measurement: Measurement,
    vehicle: Vehicle,
    track: Track,
    *,
    assumed: Assumed | None = None,
    simulations: int = SIMULATIONS,
    progress: Progress | None = None,
) -> Irregularity:
    """Return the irregularities and wheel forces behind a measured run.

    `measurement`: With channels ``sensor_acceleration:POINT:AXIS`` or ``sensor_roll_rate:POINT``.
    `vehicle`, `track`: The vehicle that measured; plan, rails, gauge, friction and support of the
    track. `assumed`: Spectrum and noise. `simulations`: Most simulated runs for a piece of at most
    2 km, see `railsim.observation.simulated`; 0 for the linear estimate, whose contact knows
    neither curves nor speeds that change. `progress`: Called repeatedly with the finished
    fraction. Raises InputError: No channel that can be used, points that the vehicle does not have,
    a record too short or too slow, channels that are all much larger or smaller than is assumed.
    Raises ModelError: The vehicle cannot be linearised, or does not complete a run for it.
    """
    assumed = assumed or Assumed()
    assumed.check()
    if simulations < 0:
        raise argument_error("simulations", f"found {simulations}", "0 or more")
    used = used_channels(measurement, all_sensors(vehicle))
    remarks = list(measurement.remarks)
    if unused := [name for name in measurement.channels if name not in used]:
        remarks.append(f"Not used: {', '.join(unused)}; the smoother reads accelerations.")
    remarks += _other_curves(track, measurement, used)
    pieces = pieces_of(measurement, list(used))
    remarks += estimate.lengths_without_values(pieces)
    begin, end = measurement.distance[[0, -1]].tolist()
    if not is_uniform(track) and (begin < -MARGIN or end > track.length + MARGIN):
        found, allowed = f"{begin:.0f} to {end:.0f} m", f"0 to {track.length:.0f} m"
        allowed += f" as track '{track.name}' has it, on which the run is simulated"
        raise input_error(measurement.name, found, allowed, "distance")
    without = track.replace(irregularities=[])
    smooth = _Smooth(vehicle, without, assumed, measurement, used, simulations)
    estimates = []
    for number, piece in enumerate(pieces):
        estimates.append(smooth.estimate(piece))
        if progress is not None:
            progress((number + 1) / len(pieces))
    remarks += [*smooth.linear.remarks, *smooth.remarks]
    if not simulations:
        remarks += _curves(track, measurement)
    return join_pieces(measurement.name, vehicle.name, estimates, smooth.flanges, remarks, without)


def _other_curves(track: Track, record: Measurement, used: dict[str, str]) -> Iterator[str]:
    """Remark where a record has not the curves or cants of the track, by means over `WINDOW`.

    Compared are kappa, where there is a channel of it, and v^2 kappa - g sin(cant angle) with the
    median of all accelerations in y, each of which has its own bias.
    """
    s, v, plan = record.distance, np.maximum(record.speed, 1.0), Alignment(track)
    turns = [record[n] / (v if n == "yaw_rate" else 1.0) for n in CURVATURES if n in record]
    across = [record[n] for n in used if used[n].endswith(".y") and not record.channel(n).high_pass]
    kappa = plan.curvature(s)
    steady = v**2 * kappa - GRAVITY * np.sin(plan.cant_angle(s))
    edges = np.searchsorted(s, np.arange(s[0], s[-1], WINDOW)).tolist()
    for text, channels, of_track, most in (
        ("curvature of {:.2g} 1/m", turns[:1], kappa, MOST_CURVATURE),
        ("lateral acceleration of {:.2g} m/s2", across, steady, MOST_Y),
    ):
        rows = [slice(*ends) for ends in pairwise(edges) if channels]
        means = [[m for x in channels if np.isfinite(m := float(np.mean(x[row])))] for row in rows]
        read = np.array([np.median(np.array(values or [np.nan])) for values in means])
        off = read - np.array([np.mean(of_track[row]) for row in rows])
        if len(beyond := np.flatnonzero(np.abs(off) > most)):
            k = beyond[np.argmax(np.abs(off[beyond]))]
            place, has = f"s = {s[edges[k]]:.0f} to {s[edges[k + 1]]:.0f} m", read[k] - off[k] + 0.0
            yield (
                f"The record is not of the curves and cants of track '{track.name}': at {place} it "
                f"has a {text.format(read[k])} in the mean, the track one of {has:.2g}; they "
                f"differ by more than {most:g} in {len(beyond)} of {len(rows)} such lengths."
            )


def _curves(track: Track, measurement: Measurement) -> Iterator[str]:
    """Remark on curves, which the linear model does not have."""
    begin, end = measurement.distance[[0, -1]]
    curved = [c for c in curvature_sections(track)
              if (c.start_value or c.end_value) and c.begin < end and c.end > begin]  # fmt: skip
    if curved:
        low, high = min(c.begin for c in curved), max(c.end for c in curved)
        yield (
            f"The track has curves between s = {low:.0f} and {high:.0f} m; the linear contact is "
            "that of straight track: neither the estimate nor its standard deviations are to be "
            "relied upon there; simulated runs include the curves."
        )


class _Smooth:
    """The smoother of a vehicle for its channels, at any speed."""

    def __init__(
        self, vehicle: Vehicle, track: Track, assumed: Assumed, measurement: Measurement,
        used: dict[str, str], simulations: int,
    ) -> None:  # fmt: skip
        self.vehicle, self.track, self.assumed = vehicle, track, assumed
        self.simulations, self.name = simulations, measurement.name
        begin, end = measurement.distance[[0, -1]].tolist()
        self.linear = LinearVehicle(vehicle, track, at=0.5 * (begin + end))
        self.channels, self.used = list(used), list(used.values())
        self.filters = [measurement.channel(name) for name in used]
        kinds = [measurement.quantities[name].split(":")[0] for name in used]
        default = {**NOISE, "sensor_acceleration": assumed.noise}
        self.noise = np.array(
            [measurement.channel(n).noise or default[k] for n, k in zip(used, kinds, strict=True)]
        )
        bias = {**BIAS, "sensor_acceleration": assumed.bias}
        self.bias = np.array([bias[kind] for kind in kinds])
        self._alignment = Alignment(track)
        self.model = cache(self._model)
        self.remarks: list[str] = []  # on pieces, and channels that read what they should not
        self._wrong: set[int] | None = None
        self.flanges = _flanges(self.linear, track)
        self._last: tuple[tuple[float, ...], Complexes] | None = None

    def _model(self, speed: float, curvature: float, cant: float) -> tuple[TrackResponse, Noise]:
        """Linear vehicle and noise of its state at a speed [m/s], in a curve [1/m, m]."""
        tangent, a = track_response(self.linear, all_sensors(self.vehicle), speed), self.assumed
        rough = {"spectrum": a.spectrum, "wavelengths": list(a.wavelengths), "scale": a.scale}
        curve = curvature, cant
        with silent():
            return with_mean_contact(self.vehicle, self.track, self.linear, tangent, rough, curve)

    def _sharpest(self, piece: Piece) -> tuple[float, float]:
        """Curvature and cant where a piece is sharpest [1/m, m], three digits."""
        curvature = self._alignment.curvature(piece.grid)
        k = int(np.argmax(np.abs(curvature)))
        if abs(curvature[k]) < STRAIGHT:
            return 0.0, 0.0
        cant = CANT_BASE * np.sin(self._alignment.cant_angle(piece.grid[k : k + 1])[0])
        return float(f"{curvature[k]:.3g}"), float(f"{cant:.3g}")

    def _response(self, response: TrackResponse, k: Floats, key_of: tuple[float, ...]) -> Complexes:
        """H of all outputs, that of a constant left out; the last one is kept."""
        key = *key_of, len(k)
        if self._last is None or self._last[0] != key:
            shape = len(k), len(response.outputs), len(QUANTITIES) + response.rows.size
            H = np.zeros(shape, complex)
            H[1:] = response.over(k[1:])
            H[-1] = H[-1].real
            self._last = key, H
        return self._last[1]

    def estimate(self, piece: Piece) -> Estimate:
        """Return fields and forces of a piece with their standard deviations."""
        curve = self._sharpest(piece) if self.simulations else (0.0, 0.0)
        response, noise = self.model(piece.speed, *curve)
        n = len(piece.grid)
        points = 2 * next_fast_len((n + int(PERIOD / STEP) + 1) // 2, real=True)
        k: Floats = 2.0 * np.pi * np.fft.rfftfreq(points, STEP).astype(float)
        whole = self._response(response, k, (piece.speed, *curve))
        chosen = [response.outputs.index(name) for name in self.used]
        forces = [i for i, o in enumerate(response.outputs) if o[:2] in ("Q.", "Y.", "su", "la")]
        names = tuple(response.outputs[i] for i in forces)
        white = np.tile(self.noise**2 * piece.speed / piece.rate / STEP, (len(k), 1))
        white[0] += points * self.bias**2
        unknown = np.tile(noise.at(k, STEP), len(response.offsets))
        frequencies = k * piece.speed / (2.0 * np.pi)
        filters = np.stack([amplifier(channel, frequencies) for channel in self.filters], axis=1)
        seen = whole[:, chosen] * filters[:, :, None]
        seen[-1] = seen[-1].real
        powers = Powers(points, self.assumed.power(k, points), unknown, seen, white)
        outputs = dict(zip(self.used, self.filters, strict=True))
        run = SimulatedRun(self.vehicle, self.track, piece, outputs, list(names))
        read = piece.signals
        base = np.tile(response.steady[forces][:, None], n)
        if not run.is_steady:
            smooth = run(np.zeros((len(QUANTITIES), points)))
            if isinstance(smooth, str):
                raise ModelError(f"the run over the track without irregularities: {smooth}")
            read, base = read - smooth.channels, smooth.forces
        valid = self._valid_samples(powers, piece, read)
        sizes = likely_sizes(powers, spectra_of(read, valid, points))
        # what the contact leaves out goes with the irregularities: its size does not show yet
        fields = powers.fields(replace(sizes, contact=np.ones(len(KINDS))))
        covariance = fields.covariance()
        padded = (0, 0), (0, points - n)
        mean = fields.mean(np.pad(read, padded), np.pad(valid, padded))
        if self.simulations:
            outcome = self._refine(piece, run, powers, sizes, whole[:, forces], mean, valid)
            covariance, mean, base = outcome or (covariance, mean, base)
        return estimate.estimate_of(
            piece, np.fft.rfft(mean, axis=1), covariance, powers.track,
            (names, whole[:, forces], base),
        )  # fmt: skip

    def _refine(
        self, piece: Piece, run: SimulatedRun, powers: Powers, sizes: Sizes, forces: Complexes,
        mean: Floats, valid: Flags,
    ) -> tuple[Complexes, Floats, Floats] | None:  # fmt: skip
        """Fields about the simulated run that agrees with the measured one.

        Returns their covariance complex128[k, field, field], with the errors that are left; their
        mean float64[field, points]; what the forces have beyond the linear ones.  None where the
        first simulated run was not complete.
        """
        n, points, count = len(piece.grid), powers.points, len(QUANTITIES)
        H = powers.response[:, :, :count]
        gain = powers.fields(replace(sizes, contact=np.full(len(KINDS), REMAINDER))).gain(count)
        outcome = refine(
            run, lambda data: filtered(gain, data), lambda r: filtered(H, r),
            (piece.signals, valid), (mean[:count], rms(powers.track.T, points)), self.simulations,
        )  # fmt: skip
        place = f"s = {piece.grid[0]:.0f} to {piece.grid[-1]:.0f} m"
        if isinstance(outcome, str):
            self.remarks.append(f"{place}: the run simulated on the linear estimate is {outcome}. "
                             "The linear estimate is given.")  # fmt: skip
            return None
        if outcome.change > CHANGE:
            self.remarks.append(
                f"{place}: after {self.simulations} simulated runs the irregularities still change "
                f"by {outcome.change:.2g} of what is assumed for them ({CHANGE:g} asked)."
            )
        sizes = likely_sizes(powers, spectra_of(outcome.data[:, :n], valid, points))
        fields = powers.fields(sizes)
        mean = filtered(fields.gain(fields.power.shape[1]), outcome.data)
        # the data agree with the run, but the contact about it is not the one in the mean
        blunt = np.maximum(sizes.contact, (LOCAL, 0.0))
        covariance = powers.fields(replace(sizes, contact=blunt)).covariance()
        index = np.arange(count)
        covariance[:, index, index] += outcome.change**2 * powers.track
        base = outcome.reading.forces - filtered(forces[:, :, :count], outcome.fields)[:, :n]
        return covariance, mean, base

    def _valid_samples(self, powers: Powers, piece: Piece, read: Floats) -> Flags:
        """Where the channels say something; the first piece tells which of them are wrong."""
        if self._wrong is None:
            level = innovations.level_of(powers, spectra_of(read, piece.valid, powers.points))
            if not 1.0 / LEVEL < level < LEVEL:
                found = f"{level:.3g} times what the vehicle reads on '{self.assumed.spectrum}'"
                allowed = f"1/{LEVEL:g} to {LEVEL:g} times; the 'unit' of all channels, or 'scale'?"
                raise input_error(self.name, found, allowed, "channels")
            self._wrong, said = innovations.disagreeing_channels(powers, piece, read, self.channels)
            vertical = np.char.endswith(self.used, ".z")  # flanges make short waves in y
            said += innovations.shorter_waves(powers, piece, read, self.channels, vertical)
            self.remarks += said
        valid = piece.valid.copy()
        valid[list(self._wrong)] = False
        return valid


def _flanges(linear: LinearVehicle, track: Track) -> Floats:
    """Lateral displacement of each wheelset at which a flange touches [m]; inf where unknown."""
    bodies, clearances = {body.name: body for body in linear.model.flat.bodies}, []
    for b in linear.model.system.contact.body:
        wheelset = bodies[linear.model.index.bodies[int(b)]].wheelset
        assert wheelset is not None  # it has contacts
        geometry = geometry_of(wheelset, track, linear.model.profiles)
        steep = [] if geometry is None else np.abs(
            geometry.lateral[np.nanmax(geometry.contact_angle, axis=1) > FLANGE])  # fmt: skip
        clearances.append(float(np.min(steep, initial=np.inf)))
    return np.array(clearances)
