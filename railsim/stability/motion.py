"""Motion of a system over stretches of time, and of a vehicle on track without end.

Ramps of speed and bifurcation diagrams run on anything that can move for a while from a state, at a
speed that goes evenly from one value to another.  The vehicle does so by the time loop of runs, on
straight smooth track; its position is set back after each stretch.
"""

import math
from copy import copy
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from railsim.arrays import Floats
from railsim.errors import ModelError
from railsim.kernels.contact_columns import W_Y
from railsim.kernels.state import TIME
from railsim.kernels.status import RUNNING
from railsim.kernels.system import MAX_PARTS, TABLE, Drive, System
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.linear.circle import POSITION
from railsim.linear.eigenmodes import Eigenmodes
from railsim.linear.vehicle import LinearVehicle
from railsim.model.time_step import SCHEMES, Stability, divide_strikes, empty_recorder
from railsim.model.work import against_rails, work_arrays

OUTPUT_RATE = 200.0  # 1/s
LONGEST = 1.0  # s of a stretch that the table of the track holds
SHORTER = 4  # parts of a step, to see whether its length matters
SPEED_CLASS = 1.25  # ratio of the speeds that share a time step


class LeftRange(ModelError):
    """The motion left the range of the model, such as by a derailment."""


@dataclass(frozen=True)
class Stretch:
    """What a system did for a while."""

    state: Floats  # at the end
    time: Floats  # from the beginning of the stretch [s]
    lateral: Floats  # displacements of the wheelsets from the middle of their rails [m]
    sum_Y: Floats  # lateral forces of the wheelsets on the track [N]; zero where a system has none

    @property
    def amplitude(self) -> float:
        """Half the largest lateral travel of a wheelset [m]."""
        return float(0.5 * np.max(np.ptp(self.lateral, axis=0)))

    @property
    def frequency(self) -> float:
        """Of the wheelset that moves most, from its crossings of the mean; NaN without any [Hz]."""
        y = self.lateral[:, int(np.argmax(np.ptp(self.lateral, axis=0)))]
        y = y - 0.5 * (np.max(y) + np.min(y))
        rising = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
        if len(rising) < 2:
            return float("nan")
        share = y[rising] / (y[rising] - y[rising + 1])
        crossings = self.time[rising] + share * (self.time[rising + 1] - self.time[rising])
        return float((len(crossings) - 1) / (crossings[-1] - crossings[0]))

    @property
    def sum_Y_rms(self) -> float:
        """Largest rms of a wheelset's lateral force [N]."""
        return float(np.max(np.sqrt(np.mean(self.sum_Y**2, axis=0))))


class Motion(Protocol):
    """A system that can move for a while."""

    def rest(self, speed: float, amplitude: float) -> Floats:
        """State of steady rolling with a disturbance that moves a wheelset by `amplitude` [m]."""

    def stretch(self, state: Floats, begin: float, end: float, duration: float) -> Stretch:
        """Move for `duration` [s] while the speed goes evenly from `begin` to `end` [m/s].

        Raises LeftRange: the motion leaves the range of the model.
        """


class VehicleMotion:
    """A vehicle on straight track, moved by the time loop of runs.

    Steps in which a flange strikes are divided as in runs only where the vehicle leaves the range
    of the model without: that takes up to five times the time and moves no end of a branch by
    0.1 m/s.  On rigid rails all steps are halved instead: hollow wheels strike them so hard that
    steps of 1 ms throw a wheelset 1.6 mm further than those of 0.125 ms, of 0.5 ms 0.01 mm.

    `prepared`: on straight track; `scheme`: integration scheme, ``fast`` or ``rk4``; `mode`: one
    mode, in the shape of which the vehicle is disturbed: where all wheelsets are displaced alike,
    far less of a disturbance becomes hunting.
    """

    def __init__(self, linear: LinearVehicle, scheme: str, mode: Eigenmodes) -> None:
        self.prepared, self.model, self.system = linear, linear.model, linear.system
        self.scheme = scheme
        self._steps: dict[int, float] = {}
        self._parts = 1 if linear.system.support.elastic else 2
        self._allocate()
        names, known = linear.coordinates.names, mode.linearisation.names
        self._disturbed = linear.coordinates.indices[[names.index(name) for name in known]]
        lateral = [known.index(f"{wheelset}.y") for wheelset in self.model.index.wheelsets]
        self._shape = (mode.shapes[0] / np.max(np.abs(mode.shapes[0, lateral]))).real

    def _allocate(self) -> None:
        self._work = work_arrays(self.system)
        size = self.model.n_state
        self._derivative, self._stages = np.zeros(size), np.zeros((3, size))
        self._recorder = empty_recorder(self.model, int(LONGEST * OUTPUT_RATE) + 2)

    def own_copy(self) -> "VehicleMotion":
        """Return the same vehicle with arrays of its own, to move in another thread."""
        other = copy(self)
        other._allocate()
        return other

    def in_shorter_steps(self) -> "VehicleMotion":
        """Return the same vehicle in shorter steps, with arrays of its own."""
        other = self.own_copy()
        other._parts = SHORTER * self._parts
        return other

    def step_at(self, speed: float) -> float:
        """Time step at a speed: the shorter one of those at both ends of its class [s]."""
        number = math.floor(math.log(speed) / math.log(SPEED_CLASS) + 1e-9)
        for end in (number, number + 1):  # two classes share an end
            if end not in self._steps:
                of = self.model, self.system, self.prepared.steady(SPEED_CLASS**end), self.scheme
                self._steps[end] = Stability(*of, lambda _: ()).choose(1.0 / OUTPUT_RATE)
        return min(self._steps[number], self._steps[number + 1]) / self._parts

    def rest(self, speed: float, amplitude: float) -> Floats:
        """State of steady rolling with a disturbance that moves a wheelset by `amplitude` [m]."""
        state = self.prepared.steady(speed).copy()
        state[self._disturbed] += amplitude * self._shape
        state[TIME] = -1.0  # marks a state without memory
        return state

    def stretch(self, state: Floats, begin: float, end: float, duration: float) -> Stretch:
        """Move for `duration` [s] while the speed goes evenly from `begin` to `end` [m/s]."""
        try:
            return self._stretch(state, begin, end, duration)
        except LeftRange:  # a long step over a strike may throw a wheelset off its rails
            step = self.step_at(max(begin, end))
            divide_strikes(self.system, self._work, SCHEMES[self.scheme], step, max(begin, end))
            try:
                return self._stretch(state, begin, end, duration)
            finally:
                self._work.counts[MAX_PARTS] = 0

    def _stretch(self, state: Floats, begin: float, end: float, duration: float) -> Stretch:
        parts: list[Stretch] = []
        done = 0.0
        while done < duration - 1e-9:
            length = min(LONGEST, duration - done)
            v0, v1 = (begin + (end - begin) * t / duration for t in (done, done + length))
            parts.append(self._part(parts[-1].state if parts else state, v0, v1, length, done))
            done += length
        columns = ([getattr(part, name) for part in parts] for name in ("time", "lateral", "sum_Y"))
        return Stretch(parts[-1].state, *map(np.concatenate, columns))

    def _part(
        self, before: Floats, begin: float, end: float, duration: float, offset: float
    ) -> Stretch:
        state = before.copy()
        fresh = int(before[-3] < 0.0)
        state[-3:] = 0.0, POSITION, begin
        way = 0.5 * (begin + end) * duration
        table = np.array([[POSITION, begin], [POSITION + way, end]])
        system = self.system._replace(drive=Drive(TABLE, table, np.zeros(3)))
        step = self.step_at(begin)
        every = round(1.0 / OUTPUT_RATE / step)
        chunk = Chunk(0, max(1, round(duration / step)), every, fresh=fresh)
        rows = self.advance(system, state, step, chunk)
        wheel = self._recorder.wheel[:rows, :, :, W_Y]
        time = offset + step * every * np.arange(rows, dtype=np.float64)
        return Stretch(state, time, self.lateral(rows), wheel.sum(axis=2))

    def advance(self, system: System, state: Floats, step: float, chunk: Chunk) -> int:
        """Move a state by a chunk of steps; number of records; LeftRange: it leaves the model."""
        arrays = self._work, state, self._derivative, self._stages, self._recorder
        status, where, _, rows = time_loop(system, *arrays, SCHEMES[self.scheme], step, chunk)
        if status != RUNNING:
            raise LeftRange(self.model.index.sentence(status, where))
        if not np.isfinite(state).all():
            raise LeftRange("the state is not finite")
        return int(rows)

    def records(self, rows: int) -> Floats:
        """States recorded by the last chunk, float64[rows, n_state]."""
        return np.asarray(self._recorder.state[:rows].copy())

    def lateral(self, rows: int) -> Floats:
        """Lateral displacements of the wheelsets in these records [m]."""
        return np.asarray(against_rails(self.model.system, self._recorder.state[:rows])[..., 0])
