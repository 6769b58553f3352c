"""Measured runs made ready for comparison: simulated alike, evaluated at the same places.

A run is simulated over the same track at the measured speed, low-passed before it is stored so that
nothing is folded into the band, and evaluated at the arc lengths of the measured values by a
spline of degree five over five values for the shortest period in the band: its error there is
2e-4 of the amplitude, and 2e-6 at half the frequency.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.measurement import Channel
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import InputError, ModelError, argument_error, input_error
from railsim.identification.parameters import Model, Parameter
from railsim.measurement import Measurement, counterpart
from railsim.measurement.counterpart import counterparts
from railsim.result import Result
from railsim.simulation import simulate
from railsim.simulation.remarks import silent

OVERSAMPLED = 5.0  # simulated values for the shortest period of the band
MOST_SAMPLED = 25.0  # measured ones; more are low-passed and left out
STEADY = 0.01  # change of the speed over its mean up to which it is constant
SLOWEST = 1.0  # m/s
FORGET = 2.0  # s, after which the start of a run is forgotten
LEAD = 100.0  # m, that a run begins ahead, as far as the track is there
SHORTEST = 4.0  # s
FEWEST = 6  # frequencies in the band, or in a third-octave band that is compared
DEGREE = 5  # of the spline
ALIKE = 20.0  # Hz, up to which runs are simulated for comparison
# where the speed varies nothing is low-passed: what is folded into the band lies far above it
VARYING_RATE, FAR_ABOVE = 400.0, 10.0  # 1/s at least; times the end of the band


@dataclass(frozen=True, eq=False)
class Run:
    """A measured run as it is simulated; small enough to be sent to a worker."""

    name: str
    track: Track
    load: str | None  # load case of the vehicle
    settings: Settings
    speed: float  # [m/s]
    start: float  # [m]
    until: float  # [m]
    selections: tuple[str, ...]  # quantities with labels
    amplifiers: tuple[Channel, ...] = field(repr=False)  # what each channel has been through
    at: Floats = field(repr=False)  # arc lengths of the measured values [m]

    def simulated(
        self, model: Model, parameters: Sequence[Parameter], x: Floats, slope: bool
    ) -> Floats:
        """Return the simulated channels at the measured places, float64[channel, time].

        NaN where the run does not get.  With `slope` their derivatives to the arc length below
        them.  Nothing is remarked.

        Raises ModelError, InputError: as `simulate`; the run does not reach its end.
        """
        from scipy.interpolate import make_interp_spline

        varied = self.model(model, parameters, x)
        try:
            with silent():
                try:
                    result = self.result(varied)
                except InputError:
                    if self.settings.step is None:
                        raise
                    # a stiffer variant needs a shorter step than the others
                    result = replace(self, settings=self.settings.replace(step=None)).result(varied)
        except ModelError as error:
            raise ModelError(f"{self.name}: {error}") from None
        if result.status != "complete":
            found = f"{result.status}: {result.attributes.get('status_reason', '')}"
            raise input_error(self.name, found, "parameters with which the run ends")
        time, distance = result["time"], result["distance"]
        rows = np.concatenate([[True], np.diff(distance) > 0.0])
        rate = 1.0 / float(np.median(np.diff(time)))
        count = len(self.selections)
        values = np.empty((2 * count if slope else count, len(self.at)))
        for k, (name, channel) in enumerate(zip(self.selections, self.amplifiers, strict=True)):
            at_sensor = counterpart.amplified(counterpart.series(result, name), rate, channel)
            spline = make_interp_spline(distance[rows], at_sensor[rows], DEGREE)
            values[k] = spline(self.at)
            if slope:
                values[count + k] = spline(self.at, 1)
        values[:, (self.at < distance[0]) | (self.at > distance[-1])] = np.nan
        return values

    def model(
        self, model: Model, parameters: Sequence[Parameter] = (), x: Sequence[float] | Floats = ()
    ) -> Model:
        """Return a model on the track and in the load of the run, at some coordinates."""
        variant = replace(model, track=self.track).with_parameters(parameters, x)
        if self.load is None:
            return variant
        return replace(variant, vehicle=variant.vehicle.with_values({"load": self.load}))

    def result(self, model: Model) -> Result:
        """Simulate the run with a model."""
        return simulate(
            model.vehicle,
            model.track,
            speed=self.speed if self.settings.drive.mode == "constant" else None,
            start=self.start,
            until=self.until,
            settings=self.settings,
            profiles=model.profiles,
        )

    def with_step_of(self, model: Model) -> "Run":
        """Return the run with a fixed step for all variants: that of the model."""
        if self.settings.drive.mode != "constant":
            return self
        probe = replace(self, until=self.start + max(1.0, self.speed * 0.1))
        with silent():
            result = probe.result(replace(model, track=self.track))
        return replace(self, settings=self.settings.replace(step=float(result.attributes["step"])))


@dataclass(frozen=True, eq=False)
class PreparedRun:
    """A run, and what was measured at the same places."""

    run: Run
    measured: Floats  # float64[channel, time], NaN where there is no value
    names: tuple[str, ...]  # of the channels
    # standard deviation of white noise in the band by channel, NaN where it is not known
    noise: Floats
    step: float  # time between two values [s]
    measurement: Measurement

    def moved(self, shift: float, stretch: float) -> "PreparedRun":
        """Return the run with its place on the track changed."""
        s = self.run.at
        return replace(self, run=replace(self.run, at=s + shift + stretch * (s - s[0])))


def model_of(
    vehicle: Vehicle | str | Path | None,
    measurements: list[Measurement],
    track: Track | None = None,
) -> Model:
    """Return what the runs are simulated with: the vehicle given, else that of the first file."""
    if vehicle is None:
        vehicle = measurements[0].definition.vehicle
    if vehicle is None:
        allowed = "a vehicle file; or the key 'vehicle' of the measurement"
        raise argument_error("vehicle", "none", allowed)
    if not isinstance(vehicle, Vehicle):
        vehicle = load_vehicle(vehicle)
    return Model(vehicle, track or track_of(measurements[0]))


def track_of(measurement: Measurement) -> Track:
    """Return the track that a measurement names."""
    name = measurement.definition.track
    if name is None:
        found, allowed = "no track", "the key 'track' of the measurement, or a track given"
        raise input_error(measurement.name, found, allowed, key="track")
    return load_track(name)


def prepare_run(
    measurement: Measurement, model: Model, band: tuple[float, float], track: Track | None = None
) -> PreparedRun:
    """Return a measured run ready for comparison in a band of frequencies [Hz].

    A constant channel is left out with a remark: its deviation from the simulated one would count.

    Raises InputError: channels that the vehicle does not have, no channel that changes, a band
    above what was sampled, a run too short or beyond the track.
    """
    track = track or track_of(measurement)
    counterpart.check_channels(measurement.name, measurement, model.vehicle)
    measurement = _without_standstill(measurement)
    high = band[1]
    if measurement.rate < 2.5 * high:
        found = f"{measurement.rate:.12g} values per second"
        allowed = f"{2.5 * high:.12g} at least for a band up to {high:g} Hz"
        raise input_error(measurement.name, found, allowed, key="rate")
    many = measurement.rate > MOST_SAMPLED * high
    thinner = measurement.resampled(MOST_SAMPLED * high) if many else measurement
    mean = float(np.mean(thinner.speed))
    steady = float(np.ptp(thinner.speed)) < STEADY * mean
    start = max(0.0, float(thinner.distance[0]) - LEAD)
    begin = max(start + FORGET * mean, float(thinner.distance[0]))
    end = min(track.length, float(thinner.distance[-1]))
    step = 1.0 / thinner.rate
    thinner = thinner.part(begin, end - 1e-9)
    if len(thinner.time) * step < SHORTEST:
        found = f"{max(0.0, end - begin):.0f} m on the track of {track.length:.0f} m"
        allowed = f"{SHORTEST * mean:.0f} m at least, {FORGET:g} s after the start of the run"
        raise input_error(measurement.name, found, allowed, key="distance")
    f = np.fft.rfftfreq(len(thinner.time), step)
    if (number := int(np.sum((f >= band[0]) & (f <= high)))) < FEWEST:
        found = f"{band[0]:g} to {high:g} Hz: {number} frequencies, {f[1]:.3g} Hz apart"
        allowed = f"{FEWEST} at least: a wider band or a longer run"
        raise input_error(measurement.name, found, allowed, key="band")
    outputs = counterpart.outputs_for(counterparts(measurement).values())
    constant = _constant_channels(thinner)
    dead = "does not change where runs are compared: a dead sensor? It is left out."
    measurement = measurement.with_remarks(*(f"{name} {dead}" for name in constant))
    names = tuple(name for name in counterparts(measurement) if name not in constant)
    channels = tuple(measurement.definition.channels[name] for name in names)
    settings_values: dict[str, Any] = {"output_rate": OVERSAMPLED * high, "outputs": outputs}
    if steady:
        outputs["low_pass"] = {"frequency": 2.0 * high}
    else:
        settings_values["output_rate"] = max(VARYING_RATE, FAR_ABOVE * high)
        rows = np.stack([measurement.distance, _smooth_speed(measurement)], axis=1)
        rows = rows[:: max(1, round(measurement.rate))]  # one for each second
        rising = np.diff(rows[:, 0], prepend=-np.inf) > 0.1
        settings_values["drive"] = {"mode": "table", "speed_table": rows[rising].tolist()}
    settings = Settings.model_validate(settings_values)
    run = Run(
        measurement.name, track, measurement.definition.load, settings, mean, start,
        min(end + 0.05 * mean, track.length), tuple(c.quantity for c in channels), channels,
        thinner.distance,
    )  # fmt: skip
    values = np.stack([thinner[name] for name in names])
    share = np.sqrt(2.0 * (high - band[0]) / measurement.rate)
    noise = np.array([np.nan if c.noise is None else c.noise * share for c in channels])
    return PreparedRun(run, values, names, noise, step, measurement)


def _constant_channels(measurement: Measurement) -> list[str]:
    """Return the channels without a change; raises InputError: there is no other channel."""
    channels = {name: measurement[name] for name in counterparts(measurement)}
    constant = [name for name, x in channels.items() if counterpart.rests(x)]
    if len(constant) == len(channels):
        found = "no value where runs are compared"
        if any(np.isfinite(x).any() for x in channels.values()):
            found = f"{', '.join(constant)}: no value that changes where runs are compared"
        raise input_error(measurement.name, found, "values; 'range', 'missing'?", key="channels")
    return constant


def _without_standstill(measurement: Measurement) -> Measurement:
    """Return a run without standstill at its ends; raises InputError: it stands in between."""
    s = measurement.distance
    slower = np.minimum(measurement.speed, _smooth_speed(measurement))
    moving = s[slower >= SLOWEST]
    part = measurement
    if len(moving) and slower[[0, -1]].min() < SLOWEST:
        remark = f"Stands before s = {moving[0]:.0f} m or behind {moving[-1]:.0f} m: left out."
        begin = np.nextafter(moving[0], np.inf)  # its place is that of standstill before it
        part = measurement.part(begin, moving[-1]).with_remarks(remark)
    v = _smooth_speed(part)
    k = int(np.argmin(v))
    if v[k] < SLOWEST:
        found = f"{max(0.0, v[k]):.2g} m/s at s = {part.distance[k]:.0f} m"
        allowed = f"{SLOWEST:g} m/s at least; a file for what is before and one for what is behind"
        raise input_error(measurement.name, found, allowed, key="speed")
    return part


def _smooth_speed(measurement: Measurement) -> Floats:
    """Return the measured speed as mean over a second [m/s]."""
    step = max(1, round(measurement.rate))
    padded = np.pad(measurement.speed, (step // 2, step - 1 - step // 2), mode="edge")
    return np.convolve(padded, np.ones(step) / step, "valid")


def simulated_run(measurement: Measurement, vehicle: Vehicle | str | Path | None = None) -> Result:
    """Simulate the run of a measurement, with the outputs that its channels are compared with.

    `measurement`: names the track, and the vehicle where none is given. Raises InputError,
    ModelError: as `simulate`; channels that the vehicle does not have.
    """
    model = model_of(vehicle, [measurement])
    counterpart.check_channels(measurement.name, measurement, model.vehicle)
    run = prepare_run(measurement, model, (0.1, min(ALIKE, 0.4 * measurement.rate))).run
    return run.result(run.model(model))
