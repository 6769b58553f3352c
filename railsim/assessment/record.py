"""A result as a measured record: equal time steps, sampled finely enough, quantities complete.

A result is read part by part: a record of 100 km needs no more memory than one of 1 km.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.bogies import bogie_name
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import Fault, InputError
from railsim.result import Result
from railsim.result.sensors import Sensor, readings, sensors
from railsim.track.alignment import Alignment

if TYPE_CHECKING:
    from railsim.contact.geometry import ContactGeometry

FINE_ENOUGH = 1000.0  # samples per second of instantaneous values
WIDE_ENOUGH = 40.0  # Hz, low pass of a run: twice the corner of the filters of EN 14363 and UIC 518
ENOUGH = (
    f"at least {FINE_ENOUGH:g} samples per second (settings.output_rate=1000), or values low-pass "
    f"filtered by the run at {WIDE_ENOUGH:g} Hz or more (settings.outputs.low_pass)"
)
RUNNING = ("en14363", "uic518")
NEEDED = {
    **dict.fromkeys(RUNNING, ("Q", "Y", "wheelset_distance")),
    "comfort": ("wheelset_distance",),
    "wear": ("T_gamma", "xi_x"),
    "safety": ("Q", "Y_over_Q", "wheelset_distance"),
}
"""Quantities by standard, beside accelerations or the motion of the bodies."""
LEFT_OUT = "not assessed: "  # begin of a remark on a run
START = 3.0  # s after the start that are not assessed
MOTION = ("body_position", "body_velocity", "body_acceleration")
AMPLITUDE = 3e-3  # m, of the equivalent conicity
PIECE = 60.0  # s that are read at once by default


@dataclass(frozen=True)
class _Readings:
    """What was read last: parts of a run overlap by the margins of their filters."""

    first: int  # first row
    speed: Floats  # float64[row], of which they were made: at the ends of a part it differs [m/s]
    acceleration: Floats  # see `Record.readings`
    roll: Floats  # see `Record.readings`

    def overlap(self, rows: slice, speed: Floats) -> "_Readings | None":
        """Return what of these is part of other rows with their speeds, if anything is.

        Of both parts without the first and the last row, whose speeds are of one side.
        """
        begin = max(self.first, rows.start) + 1
        end = min(self.first + len(self.speed), rows.stop) - 1
        part = slice(begin - self.first, end - self.first)
        same = slice(begin - rows.start, end - rows.start)
        if begin >= end or not np.array_equal(self.speed[part], speed[same]):
            return None
        return _Readings(begin, self.speed[part], self.acceleration[part], self.roll[part])


def coarseness(settings: Settings, rate: float) -> tuple[str, str]:
    """Return how values of a run are too coarse, and what that loses; empty where they are not.

    `rate`: Of its output [1/s].
    """
    low_pass = settings.outputs.low_pass
    if low_pass is not None and low_pass.frequency < WIDE_ENOUGH:
        lost = "what the filters of the standards pass above is missing"
        return f"low-pass filtered at {low_pass.frequency:g} Hz by the run", lost
    if low_pass is None and rate < FINE_ENOUGH * (1.0 - 1e-3):
        lost = "components above half this rate may be aliased into the result"
        return f"{rate:.4g} samples per second", f"too few for instantaneous values, {lost}"
    return "", ""


class TooShort(InputError):
    """Of a run there is too little to assess."""


class Record:
    """A result as a measured record.

    `name`: Name of the run in messages. `coarse`: Accept a result that is sampled too coarsely.
    Raises InputError: unequal time steps, too few samples per second; TooShort: below 11 instants.
    """

    def __init__(self, result: Result, name: str, *, coarse: bool = False) -> None:
        self.result, self.name = result, name
        self.time, self.distance = result["time"], result["distance"]
        steps = np.diff(self.time)
        if len(steps) < 10:
            raise self.too_short(f"{len(self.time)} instants", "a longer run")
        # the last step of a run is shorter if the run ends between two outputs
        self.rows = len(self.time) - 1
        step = float(np.median(steps))
        self.rate = 1.0 / step
        if float(np.max(np.abs(steps[:-1] - step))) > 1e-3 * step:
            allowed = "a run with settings.output_rate, not output_spacing"
            raise self.fault("time", "unequal time steps", allowed)
        self.coarse, self._loss = coarseness(result.settings(), self.rate)
        if self.coarse and not coarse:
            allowed = f"{ENOUGH}; `coarse` assesses it nevertheless"
            raise self.fault("time", self.coarse, allowed)
        self._last: _Readings | None = None

    def fault(self, key: str, found: str, allowed: str) -> InputError:
        """Return the error for a property of the result that is not admissible."""
        return InputError([Fault(self.name, key, found, allowed, option=self.name)])

    def too_short(self, found: str, allowed: str) -> TooShort:
        """Return the error for a run of which too little is left to assess."""
        return TooShort(self.fault("time", found, allowed).faults)

    def need(self, names: Sequence[str], output: str) -> None:
        """Refuse a result that lacks some of `names`; InputError names the `output` to request."""
        missing = [name for name in names if name not in self.result]
        if missing:
            words = "is not in the result", f"run it with {output}"
            raise InputError(Fault(self.name, name, *words) for name in missing)

    def need_quantities(self, standard: str) -> None:
        """Refuse a result without the quantities of a standard."""
        names = NEEDED[standard]
        self.need(names, f"settings.outputs.quantities with {', '.join(names)}")

    def part(self, name: str, rows: slice) -> Floats:
        """Some rows of a quantity; InputError where a value is none, such as of a broken file."""
        values = self.result.part(name, rows)
        if not np.isfinite(values).all():
            raise self.fault(name, "holds values that are no numbers", "a result without")
        return values

    @cached_property
    def alignment(self) -> Alignment:
        """Geometry of the track."""
        return Alignment(self.result.track())

    @cached_property
    def geometry(self) -> "ContactGeometry | None":
        """Contact functions of the leading wheelset, rigid rails; None: profiles do not fit."""
        return self.geometry_with(0.0)

    def geometry_with(self, widening: float) -> "ContactGeometry | None":
        """As `geometry`, where the gauge is wider [m]."""
        # with the compiler, which most standards do without
        from railsim.contact.geometry import geometry_of

        wheelset = flatten(self.result.vehicle()).of_kind("wheelset")[0].wheelset
        track, profiles = self.result.track(), self.result.profiles
        if wheelset is None or not {*wheelset.profile, *track.rail} <= profiles.keys():
            return None
        return geometry_of(wheelset, track, profiles, widening)

    @cached_property
    def conicity(self) -> float:
        """Equivalent conicity of the leading wheelset for 3 mm; nan where it is not known [1]."""
        geometry = self.geometry
        return math.nan if geometry is None else float(geometry.equivalent_conicity([AMPLITUDE])[0])

    @cached_property
    def offsets(self) -> Floats:
        """Arc length of each wheelset relative to the reference body [m]."""
        return np.asarray(self.result.part("wheelset_distance", slice(0, 1))[0] - self.distance[0])

    @cached_property
    def bogies(self) -> dict[str, list[int]]:
        """Numbers of the wheelsets of each bogie."""
        bogies: dict[str, list[int]] = {}
        flat = flatten(self.result.vehicle())
        for w, wheelset in enumerate(flat.of_kind("wheelset")):
            bogies.setdefault(bogie_name(flat, wheelset), []).append(w)
        return bogies

    @cached_property
    def sensors(self) -> Mapping[str, Sensor]:
        """Sensors whose readings are available, by name."""
        every = sensors(self.result.vehicle())
        if "sensor_acceleration" in self.result:
            return {n: every[n] for n in self.result.coordinates["sensor"] if n in every}
        bodies = self.result.bodies if all(name in self.result for name in MOTION) else ()
        return {name: sensor for name, sensor in every.items() if sensor.body in bodies}

    @cached_property
    def _speed(self) -> Floats:
        """At every row [m/s]."""
        return np.gradient(self.distance, self.time)

    def sensor_offset(self, sensor: str) -> float:
        """Arc length of a sensor relative to the reference body [m]."""
        return self.sensors[sensor].along

    def readings(self, rows: slice) -> tuple[Floats, Floats]:
        """Accelerations [m/s2] and roll velocities [rad/s] of all sensors, see `readings`."""
        if "sensor_acceleration" in self.result:
            names = self.result.coordinates["sensor"]
            order = [names.index(name) for name in self.sensors]
            acceleration = self.part("sensor_acceleration", rows)[:, order]
            return acceleration, self.part("sensor_roll_rate", rows)[:, order]
        speed = self._speed[rows]
        previous = self._last and self._last.overlap(rows, speed)
        if previous is None:
            values = self._readings_of_motion(rows, speed)
        else:
            begin, end = previous.first, previous.first + len(previous.speed)
            before, after = slice(rows.start, begin), slice(end, rows.stop)
            first = self._readings_of_motion(before, speed[: begin - rows.start])
            last = self._readings_of_motion(after, speed[end - rows.start :])
            parts = zip(first, (previous.acceleration, previous.roll), last, strict=True)
            acceleration, roll = map(np.concatenate, parts)
            values = acceleration, roll
        self._last = _Readings(rows.start, speed, *values)
        return values

    def _readings_of_motion(self, rows: slice, speed: Floats) -> tuple[Floats, Floats]:
        """Readings from the motion of the bodies."""
        motion = {name: self.part(name, rows) for name in MOTION}
        motion["distance"] = self.distance[rows]
        return readings(self.sensors, motion, self.result.bodies, self.alignment, speed)

    def covered_range(self) -> tuple[float, float]:
        """Range of arc length that the whole vehicle covered after the start [m]."""
        offsets = [*self.offsets, *(self.sensor_offset(name) for name in self.sensors)]
        ahead, behind = max(0.0, *offsets), min(0.0, *offsets)
        first = int(np.searchsorted(self.time, self.time[0] + START))
        first = min(first, self.rows - 1)
        started = max(float(self.distance[first]), float(self.distance[0]) + ahead - behind)
        return started + ahead, float(self.distance[self.rows - 1]) + behind

    def speed_at(self, s: float) -> float:
        """Speed of the reference body at an arc length [m/s]."""
        i = int(np.clip(np.searchsorted(self.distance, s), 1, self.rows - 1))
        low, high = max(i - 5, 0), min(i + 5, self.rows - 1)
        way, time = (float(x[high] - x[low]) for x in (self.distance, self.time))
        return way / time

    def rows_between(self, begin: float, end: float, margin: float) -> slice:
        """Rows in which any part of the vehicle is between two arc lengths, with a margin [s]."""
        offsets = [0.0, *self.offsets, *(self.sensor_offset(name) for name in self.sensors)]
        extra = math.ceil(margin * self.rate)
        first = int(np.searchsorted(self.distance, begin - max(offsets))) - extra
        last = int(np.searchsorted(self.distance, end - min(offsets))) + extra
        return slice(max(0, first), min(self.rows, last + 1))

    def pieces(self, margin: float) -> Iterator[tuple[slice, slice]]:
        """Parts of the whole record after the start: rows to read, and which of them count."""
        first = int(np.searchsorted(self.time, self.time[0] + START))
        size, extra = math.ceil(PIECE * self.rate), math.ceil(margin * self.rate)
        for begin in range(first, self.rows, size):
            end = min(begin + size, self.rows)
            low, high = max(0, begin - extra), min(self.rows, end + extra)
            yield slice(low, high), slice(begin - low, end - low)

    def remarks(self) -> list[str]:
        """Notes on the record for the reader of the assessment."""
        remarks = [f"{self.name}: {remark}" for remark in self.result.remarks]
        if self.coarse:
            remarks.append(f"{self.name}: {self.coarse}: {self._loss}")
        return remarks
