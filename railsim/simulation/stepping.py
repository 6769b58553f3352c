"""`Simulation`: a run that is taken step by step, read and acted on in between.

It is the loop of `simulate` on the same grid of steps.  A call that ends within a step of the grid
takes a part of it; the next one takes the whole step from its begin, so that the run keeps its
bits, or where a command has come in between goes on with what is left of it.
"""

import math
import time
from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.loading import check_types
from railsim.errors import argument_error, nearest
from railsim.kernels.actuators import COMMAND, send_command
from railsim.kernels.controllers import BASE, VALUE
from railsim.kernels.state import ARC_LENGTH, SPEED, TIME
from railsim.kernels.status import RUNNING
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.laws import allowed
from railsim.model.control import check_command
from railsim.model.time_step import NEVER, divide_strikes
from railsim.model.work import work_arrays
from railsim.notation import REQUESTED
from railsim.profiles import Profile
from railsim.result import Hdf5Sink, MemorySink, Result, Sink
from railsim.simulation.advance import ROUND_OFF, ROWS, STEPS, SavedState, take_extremes
from railsim.simulation.auxiliary_track import DOING
from railsim.simulation.conditions import Inputs, check_numbers, own_speed, state_before
from railsim.simulation.ending import end, verdict
from railsim.simulation.preparation import begin
from railsim.simulation.run_progress import Progress, RunProgress
from railsim.simulation.step_choice import duration as time_for

SHORTEST = 1e-12  # s
SHARE = 1e-3  # of a step: what is shorter is made up for by the next one


class Simulation:
    """A run that is taken step by step.

    Parameters
    ----------
    vehicle, track : Vehicle, Track
        As in `railsim.simulate`.
    start : float
        Arc length at which the reference body starts [m].
    speed, duration, until, settings, sink, profiles, resume, progress : as `railsim.simulate`
        Speed and end of the run, and how it is computed.
    record : bool or str or Path
        Whether the quantities are kept at the rate of the settings: in memory, or in a file of
        this name.  Without a record memory does not grow with the run, and `result` holds only
        the peaks over all steps.
    allow_code : bool
        Execute the user-defined laws that the files name, see `railsim.laws`.

    Raises InputError, ModelError as `railsim.simulate`.

    Examples
    --------
    >>> import railsim
    >>> vehicle = railsim.load_vehicle("coach_manchester")
    >>> track = railsim.load_track("curve_r250")
    >>> with railsim.Simulation(vehicle, track, speed=20.0, until=10.0) as sim:
    ...     while sim.step(0.1):
    ...         Q = sim.read("Q")
    ...     result = sim.result()
    >>> result.status, Q.shape
    ('complete', (4, 2))
    """

    def __init__(
        self,
        vehicle: Vehicle,
        track: Track,
        *,
        speed: float | str | None = None,
        start: float = 0.0,
        duration: float | None = None,
        until: float | None = None,
        settings: Settings | None = None,
        record: bool | str | Path = True,
        sink: Sink | None = None,
        progress: Progress | None = None,
        profiles: Mapping[str, Profile] | None = None,
        resume: Result | Mapping[str, Floats] | Floats | None = None,
        allow_code: bool = False,
    ) -> None:
        check_types([vehicle], track, settings=settings)
        if sink is not None and not hasattr(sink, "begin"):
            words = "; give a sink of railsim.result, or write the result by to_hdf5"
            raise TypeError(f"the sink is a {type(sink).__name__}{words}")
        settings = settings or Settings()
        before = None if resume is None else state_before(vehicle, track, settings, resume)
        if before is not None:
            speed, start = own_speed(before.motion, speed, start)
        inputs = Inputs.checked(track, settings, speed, start, duration, until)
        self._fraction = RunProgress(progress, inputs)
        self._sink = sink or (MemorySink() if isinstance(record, bool) else Hdf5Sink(record))
        try:
            with allowed(allow_code):
                run = begin(vehicle, inputs, self._sink, profiles, before, self._fraction)
        except BaseException:
            self._sink.abort()
            raise
        DOING.info("")
        self._vehicle, self._inputs, self._before, self._run = vehicle, inputs, before, run
        self._records = record is not False
        self._whole = max(run.left(), SHORTEST)
        self._phase, self._missing, self._behind, self._rows = 0, 0.0, 0.0, 0
        self._written = -math.inf
        self._length, self._every, self._goal = 0.0, 1, 0.0
        self._closed: Result | None = None
        self._begun: SavedState | None = None
        self._seen: Mapping[str, Floats] | None = None
        self._probe: Any = None  # work arrays and recorder where a state is evaluated

    @property
    def time(self) -> float:
        """Time [s]."""
        return float(self._run.state[TIME])

    @property
    def distance(self) -> float:
        """Arc length of the reference body [m]."""
        return float(self._run.state[ARC_LENGTH])

    @property
    def speed(self) -> float:
        """Speed of the reference body [m/s]."""
        return float(self._run.state[SPEED])

    @property
    def step_length(self) -> float:
        """Step of the loop at the present speed [s]."""
        if self._length == 0.0:
            self._begin_interval()
        return self._length

    @property
    def running(self) -> bool:
        """Whether the run goes on."""
        run, open_ = self._run, self._closed is None
        return open_ and run.status == RUNNING and not run.ended and run.left() > ROUND_OFF

    @property
    def status(self) -> str:
        """How the run stands: ``running``, or the status of its result."""
        return "running" if self.running else self._verdict()["status"]

    @property
    def status_reason(self) -> str:
        """Why the run has ended; empty while it goes on."""
        return "" if self.running else self._verdict()["status_reason"]

    def _verdict(self) -> dict[str, str]:
        """How the run has ended, by its extremes so far; on a copy: a state may be restored."""
        run = copy(self._run)
        run.extremes = run.extremes.copy()
        if self._closed is None:
            take_extremes(run.extremes, run.work.extremes)
        return verdict(run)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of what takes commands."""
        return self._run.prepared.model.index.actuators

    @property
    def readable(self) -> tuple[str, ...]:
        """Names of what can be read: signals of the vehicle, quantities of its results."""
        known = self._run.plan.quantities
        return (*self._run.prepared.model.index.signals, *(q.name for q in known if q.dims))

    def step(self, dt: float | None = None) -> bool:
        """Advance by a time, by default one step of the loop; whether the run goes on.

        The end of the run shortens the last call; a step that would begin beyond it is an error.

        Raises InputError: the run has ended, or `dt` is no positive time.
        """
        if not self.running:
            raise argument_error("step", self._ended_because(), "a new Simulation")
        if dt is None:
            dt = self._missing or self._next()
        elif not 0.0 < dt < math.inf:  # NaN is not
            raise argument_error("dt", f"found {dt} s", "a positive time")
        self._seen = None
        left = float(dt) + self._taken_back() + self._behind
        while left > SHARE * self._length and self.running:
            whole = self._next()
            if self._run.ended:
                break
            left -= self._part(left, whole)
        if self._missing > 0.0 and not self.running and self._run.status == RUNNING:
            self._taken_back()  # the run ends within a step, which it takes as a whole
            whole = self._next()
            self._part(self._missing or whole, whole)
        self._behind = left if self.running else 0.0
        self._raise_error()
        return self.running

    def _taken_back(self) -> float:
        """Take back the part of a step, where nothing has changed since it was begun; its time."""
        if self._begun is None:
            return 0.0
        now, behind = self.time, self._behind
        self.state = self._begun
        self._behind = behind
        return now - self.time

    def run(self, until: float | None = None, *, duration: float | None = None) -> bool:
        """Advance to an arc length [m] or by a time [s], else to the end; whether it goes on."""
        check_numbers(until=until, duration=duration)
        if until is None and duration is None:
            self._to_the_end()
        elif until is not None and duration is not None:
            raise argument_error("duration", "given together with `until`", "one of the two")
        elif until is None:
            return self.step(duration)
        elif math.isnan(until):
            raise argument_error("until", "found nan m", "a number")
        else:
            while self.running and until - self.distance > ROUND_OFF * self.speed:
                steps = self.step_length * (1 if self._run.varies else STEPS)
                self.step(min(self._missing + steps, (until - self.distance) / self.speed))
        return self.running

    def _to_the_end(self) -> None:
        """Advance to the end by whole steps, and hand on the records of up to `STEPS` at once."""
        self._taken_back()
        self._seen, self._behind = None, 0.0
        while self.running:
            begin, evaluated = time.perf_counter(), self._run.evaluates
            whole = self._next()
            most = min(ROWS, max(1, STEPS // max(1, self._every)))
            if not self._run.ended:
                self._part(most * self._every * whole, whole)
            if self._rows >= most or self._run.evaluates != evaluated or not self.running:
                self._flush()
            self._run.wall_time += time.perf_counter() - begin
            if self._records and self._rows == 0:
                self._fraction.of_run(min(1.0, 1.0 - self._run.left() / self._whole))
        self._raise_error()

    def _begin_interval(self) -> None:
        """Choose step and number of steps to the next output where the speed changes."""
        run = self._run
        if self._length == 0.0 or run.varies:
            self._length, self._every = run.next_step() or (math.nan, 0)
            self._goal = run.state[ARC_LENGTH] + (run.spacing or 0.0)

    def _next(self) -> float:
        """Length of the next step of the grid [s]."""
        run = self._run
        if self._phase == 0 and self._missing == 0.0:
            self._begin_interval()
        ahead = self._every - self._phase
        if run.spacing is None or ahead & (ahead - 1) or self._missing > 0.0 or run.ended:
            return self._length
        # the last step of an interval of distance ends where the interval ends; where 2, 4, 8, ...
        # steps are left as well, their number follows from how the speed has changed by then
        s, v = run.state[ARC_LENGTH], run.state[SPEED]
        left = max(time_for(self._goal - s, v, run.derivative[SPEED]), SHARE * self._length)
        if abs(left / self._length - ahead) > 0.5:
            ahead = math.ceil(left / self._length)
            self._every, self._length = self._phase + ahead, left / ahead
        return left if ahead == 1 else self._length

    def _part(self, most: float, whole: float) -> float:
        """Take whole steps, or a part of one, within a time `most` [s]; the time taken."""
        run, every = self._run, self._every
        if self._missing > 0.0:
            taken = self._missing if self._missing <= most + SHARE * whole else most
            self._call(taken, 1, 1, NEVER, whole=False)
            self._missing -= taken
            self._on_grid(int(self._missing <= SHORTEST))
            return taken
        steps = int(most / whole * (1.0 + ROUND_OFF) + SHARE)
        if steps == 0:
            self._begun = self.state
            self._call(most, self._phase, 1, every, whole=False)
            self._missing = whole - most
            return most
        steps = min(steps, STEPS, max(1, math.ceil(run.left() / whole * (1.0 - 1e-9))))
        if run.varies:  # of an interval of distance as far as to where `_next` looks
            ahead = every - self._phase
            half = 0 if run.spacing is None else (1 << (ahead - 1).bit_length()) >> 1
            steps = min(steps, ahead - half)
        elif self._records:
            steps = min(steps, (ROWS - self._rows) * every - self._phase)
        if not run.evaluates:
            steps = min(steps, every - self._phase)
        taken = self._call(whole, self._phase, steps, every)
        self._on_grid(taken)
        return whole * steps

    def _on_grid(self, steps: int) -> None:
        """Take note of whole steps that have been taken."""
        if steps:
            self._missing = 0.0
            self._phase = (self._phase + steps) % self._every
            if self._phase == 0:
                self._run.begin_evaluation()
            if self._rows >= ROWS:
                self._flush()

    def _call(self, h: float, first: int, steps: int, every: int, *, whole: bool = True) -> int:
        """Call the time loop with steps h [s]; the number of steps that it has taken."""
        run = self._run
        kept = 0.0 if whole else run.work.vibration.copy()  # of whole steps
        if not self._records:
            first, every = first + 1, NEVER
        chunk = Chunk(first, steps, every, int(run.fresh), 0, self._rows)
        run.status, run.where, taken, self._rows = run.call(h, chunk)
        if not whole:
            run.work.vibration[:] = kept
        if run.status != RUNNING:
            self._flush()
        return int(taken)

    def _flush(self) -> None:
        """Hand what has been recorded to the sink."""
        if self._rows:
            self._written = float(self._run.recorder.state[self._rows - 1, TIME])
        self._run.write(self._rows)
        self._rows = 0

    def _raise_error(self) -> None:
        if self._run.error is not None:
            raise self._run.error

    def _ended_because(self) -> str:
        if self._closed is not None:
            return "the run has ended: its result has been taken"
        return f"the run has ended at {self.time:.6g} s: {self.status_reason}"

    def _check_open(self, what: str) -> None:
        if self._closed is not None:
            raise argument_error(what, self._ended_because(), "a new Simulation")

    def set(self, actuator: str, value: float) -> None:
        """Give a command to an actuator; it stays until the next one.

        Raises InputError: no such actuator, or one that a controller commands; no finite number;
        too many commands on their way to an actuator with a delay; the result has been taken.
        """
        self._check_open("set")
        check_command(self._vehicle, "actuator", actuator, self.actuators)
        try:
            finite = math.isfinite(value)
        except TypeError:
            finite = False
        if not finite:
            raise argument_error("value", f"found {value!r} for '{actuator}'", "a finite number")
        run, number = self._run, self.actuators.index(actuator)
        memory = run.work.memory
        if value == memory[run.system.actuators.codes[number, COMMAND]]:
            return
        plain = getattr(send_command, "py_func", send_command)
        if not plain(run.system.actuators, memory, number, float(value), self.time):
            found = "more commands than one every 0.25 ms are on their way"
            raise argument_error("actuator", found, "fewer commands", actuator)
        self._note_moved("Actuators")

    def set_rails(self, displacement: Floats, velocity: Floats) -> None:
        """Displace the rails under the wheels, as another program's bridge or track does.

        They stay so until the next call; on rigid rails only, which they add to.

        Parameters
        ----------
        displacement, velocity : float64[wheelset, side, 2]
            Of the rail heads, lateral (right positive) and vertical (down positive) [m], [m/s].
            The lateral velocity is that of the rail's material, against which the wheel slips,
            the vertical one that under the moving wheel, with speed times slope.
        """
        self._check_open("set_rails")
        if self._run.system.support.elastic:
            raise argument_error("set_rails", "a track with a support", "rigid rails")
        motion = self._run.work.rail_motion
        given = {"displacement": np.asarray(displacement), "velocity": np.asarray(velocity)}
        for name, values in given.items():
            if values.shape not in ((), motion[..., :2].shape) or not np.isfinite(values).all():
                found = f"{values.shape} values, or not finite ones"
                raise argument_error(name, found, f"{motion[..., :2].shape} finite numbers")
        before = motion.copy()
        motion[..., :2], motion[..., 2:] = given.values()
        if not np.array_equal(motion, before):
            self._note_moved("Rails")

    def _note_moved(self, part: str) -> None:
        """Take note that the run does not follow from its inputs alone from here on."""
        self._seen = self._begun = None
        words = f"{part} were moved from outside: the stored inputs alone give another result."
        self._run.remarks = list(dict.fromkeys([*self._run.remarks, words]))

    def read(self, name: str) -> Any:
        """Return the present value of a signal, or of a quantity of the result [SI].

        Quantities are arrays without the dimension of time, such as ``Q`` by wheelset and side.

        Raises InputError: there is nothing of this name.
        """
        signals, values = self._run.prepared.model.index.signals, self._present()
        if name == "Q0":  # which has no dimension of time
            return self._run.prepared.balance.Q0.copy()
        if name in signals:
            base = self._run.system.signals.codes[signals.index(name), BASE]
            return float(self._probe[0].memory[base + VALUE])
        if name in values:
            value = np.asarray(values[name])
            return float(value[0]) if value.ndim == 1 else value[0].copy()
        found, allowed = f"nothing is called '{name}'", nearest(str(name), self.readable)
        if name in REQUESTED:
            found, allowed = f"'{name}' is not output", "ask for it in settings.outputs"
        raise argument_error("name", found, allowed)

    def _present(self) -> Mapping[str, Floats]:
        """Quantities at the present state, evaluated beside the loop."""
        if self._seen is not None:
            return self._seen
        run, length = self._run, self.step_length
        if self._probe is None:
            self._probe = work_arrays(run.system), run.plan.recorder(1)
        (work, recorder), state = self._probe, run.state.copy()
        work.memory[:] = run.work.memory
        work.rail_motion[:] = run.work.rail_motion
        divide_strikes(run.system, work, run.scheme, length, run.state[SPEED])
        still, chunk = np.zeros_like(state), Chunk(0, 0, 1, int(run.fresh), 1)
        status, where, _, _ = time_loop(
            run.system, work, state, still, run.stages, recorder, run.scheme, length, chunk
        )
        if status != RUNNING:
            run.status, run.where = status, where
            raise argument_error("read", self._ended_because())
        self._seen = run.plan.chunk(recorder, 1, run.prepared.balance.Q0)
        return self._seen

    # states

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Simulation cannot be pickled; its `state` can")

    @property
    def state(self) -> SavedState:
        """All that the run goes on from, a copy."""
        run, saved = self._run, self._run.save()
        grid = (self._phase, self._missing, self._behind, self._length, self._every, self._goal)
        return replace(saved, grid=(*grid, run.status, run.where, *saved.grid), begun=self._begun)

    @state.setter
    def state(self, saved: SavedState) -> None:
        run = self._run
        given, here = (
            [one.size for one in each] for each in ((saved.motion, *saved.counted), run.arrays())
        )
        if given != here:
            found = f"a state of {given} values"
            raise argument_error("state", found, f"{here}, those of this vehicle and track")
        recorded = run.recorder.state[: self._rows, TIME]
        if self._records and saved.motion[TIME] < self._written + SHORTEST:
            found = "an instant before what is recorded already"
            raise argument_error("state", found, "record=False")
        self._rows = int(np.searchsorted(recorded, saved.motion[TIME] - SHORTEST))
        run.restore(saved)
        grid = saved.grid
        self._phase, self._missing, self._behind, self._length, self._every, self._goal = grid[:6]
        run.status, run.where = grid[6:8]
        self._seen, self._begun = None, saved.begun

    def result(self) -> Result:
        """End the run where it is, and return its result."""
        if self._closed is None:
            run = self._run
            due = self._phase == 0 and self._missing == 0.0 and run.status == RUNNING
            if due:
                self._flush()
                run.status, run.where, rows = run.last_record()
                self._rows = rows * self._records
            self._flush()
            self._raise_error()
            run.take_last_extremes()
            self._closed = end(run, self._vehicle, self._inputs, self._before)
        return self._closed

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None and self._closed is None:
            self.result()
        self._sink.abort()
