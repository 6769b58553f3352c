"""From prepared runs to their ends: the time loop, chunk by chunk.

Between two chunks there is time for progress, Ctrl-C and for writing.  Runs of several vehicles
over one track advance together in one call (`railsim.simulation.ensemble`) for as long as they can;
a single run is the ensemble of one.

Each run is what it would be alone.  A chunk in which one of several vehicles leaves the range of
the model, or lifts or strikes a rail, is taken back: that vehicle goes on alone, to its own end,
and the others without it.  Runs also part where their steps differ.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.settings import Settings
from railsim.errors import RailsimError
from railsim.kernels.extremes import MAX, MIN
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.status import RUNNING
from railsim.kernels.system import AGAIN, ARC_LENGTH, N_PARTS, SPEED, TIME
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.kernels.vibration import VIBRATION
from railsim.model.assembly import Model
from railsim.model.equilibrium import Equilibrium
from railsim.model.time_step import SCHEMES, divide_strikes
from railsim.model.uneven_wheels import longest_part
from railsim.model.work import no_extremes, work_arrays
from railsim.result import MemorySink, Sink
from railsim.result.hunting import SEEN, thinned
from railsim.simulation.ensemble import Ensemble, contact_grid
from railsim.simulation.outputs import OutputPlan
from railsim.simulation.step_choice import StepChoice, duration

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

# Longest chunk in outputs, and in steps of all its vehicles: some hundredths of a second of
# computing by the fast scheme, and below a second by the other one
ROWS, STEPS = 1000, 64_000
ROUND_OFF = 1e-9  # s

# what a chunk changes in the work arrays: counts of patches and of steps, extremes, times without
# load, vibrations
COUNTED = ("events", "extremes", "unloaded", "vibration", "parts")


class _Before(NamedTuple):
    """What a chunk changes, as it was before."""

    state: Floats
    fresh: bool
    due: bool
    counted: list[NDArray[Any]]


@dataclass
class Preparation:
    """Everything that is settled before the time loop starts.

    Attributes
    ----------
    model, balance : Model, Equilibrium
        The assembled vehicle on its track; its rest and steady rolling.
    state : float64[n_state]
        Initial state.
    end_time, end_distance : float
        Where the run ends, whichever comes first [s], [m].
    steps : StepChoice
        Step and output interval at any speed.
    evaluation : float
        Time from which on peaks are evaluated [s].
    fresh : bool
        Whether nothing was before the initial state.
    remarks : tuple of str
        Remarks for the reader.
    """

    model: Model
    balance: Equilibrium
    state: Floats
    end_time: float
    end_distance: float
    steps: StepChoice
    evaluation: float = 0.0
    fresh: bool = True
    remarks: tuple[str, ...] = ()

    def left(self, state: Floats) -> float:
        """Time from `state` to the end of the run at the present speed [s]."""
        by_distance = (self.end_distance - state[ARC_LENGTH]) / state[SPEED]
        return float(min(self.end_time - state[TIME], by_distance))


@dataclass(eq=False)
class Run:
    """A run on its way.

    Attributes
    ----------
    prepared, plan, sink : Preparation, OutputPlan, Sink
        Where it begins and ends, what it outputs and where.
    state : float64[n_state]
        Where it is.
    fresh : bool
        Whether nothing was before `state`.
    due : bool
        Whether `state` is to be recorded.
    status, where : int
        How it ended, see `railsim.kernels.status`.
    events : int64[3]
        Loaded contact patches so far, and those out of the creep law's range; look-ups beyond the
        yaw of the contact table.
    extremes, evaluated : float64[6, w, EXTREMES]
        Largest and smallest values so far, see `railsim.kernels.extremes`; of all, and since the
        evaluation began.
    unloaded : float64[w, 2]
        Time during which each wheel has carried nothing [s].
    parts : int64[N_PARTS]
        Counts of steps and evaluations, see `railsim.kernels.system`.
    again : int
        How often the contact of one wheelset alone was evaluated again.
    vibration : float64[w, 2, VIBRATION]
        Vibrations of the wheel loads, see `railsim.kernels.vibration`; empty at its begin.
    cpu_time, wall_time : float
        Its share of what the time loop, and all of the run, took [s].
    together : int
        Most runs that have shared a call with it, itself included.
    error : Exception or None
        Error in writing its output, or why it cannot begin.
    stopped : str
        Why it cannot go on at the speed that it has reached; empty otherwise.
    remarks : list of str
        Remarks for the reader of its result, see `railsim.simulation.remarks`.
    swings : MemorySink
        What shows whether it hunts, see `railsim.result.hunting`.
    """

    prepared: Preparation
    plan: OutputPlan
    sink: Sink
    state: Floats
    fresh: bool = True
    due: bool = True
    status: int = RUNNING
    where: int = 0
    events: NDArray[np.int64] = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    parts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(N_PARTS, dtype=np.int64))
    again: int = 0
    vibration: Floats = field(default_factory=lambda: np.zeros((0, 2, VIBRATION)))
    cpu_time: float = 0.0
    wall_time: float = 0.0
    together: int = 1
    error: Exception | None = None
    stopped: str = ""
    remarks: list[str] = field(default_factory=list)
    swings: MemorySink = field(default_factory=lambda: MemorySink(only=SEEN))

    @property
    def ended(self) -> bool:
        """Whether it has ended before its end, but for what the time loop says."""
        return self.error is not None or bool(self.stopped)

    def __post_init__(self) -> None:
        wheelsets = len(self.prepared.model.index.wheelsets)
        self.extremes: Floats = no_extremes(wheelsets)
        self.evaluated: Floats = no_extremes(wheelsets)
        self.unloaded: Floats = np.zeros((wheelsets, 2))
        self.swings.begin(self.plan.coordinates)


def advance(
    runs: Sequence[Run], settings: Settings, progress: Progress | None = None
) -> Iterator[Run]:
    """Take runs to their ends; yields each when it is there.

    Parameters
    ----------
    runs : sequence of Run
        Of the same track, start and end, and of these settings.
    progress : callable, optional
        Called repeatedly with the finished fraction of all runs.
    """
    whole = {run: run.prepared.left(run.state) for run in runs}
    done = dict.fromkeys(whole, 0.0)

    def tell() -> None:
        if progress is not None:
            progress(sum(done.values()) / len(done))

    def moved(some: Sequence[Run], state: Floats) -> None:
        for run in some:
            done[run] = min(1.0, 1.0 - run.prepared.left(state) / whole[run])
        tell()

    waiting = _matching(runs, settings)
    while waiting:
        together = waiting.pop(0)
        apart = _Convoy(together, settings).to_the_end(moved)
        on_their_way = [run for group in apart for run in group]
        ended = [run for run in together if run not in on_their_way]
        done |= dict.fromkeys(ended, 1.0)
        yield from ended
        tell()
        waiting = apart + waiting


def _matching(runs: Sequence[Run], settings: Settings) -> list[list[Run]]:
    """Runs that can be one system: with one speed and one grid of contact tables."""
    if settings.drive.mode == "free":
        return [[run] for run in runs]
    groups: dict[tuple[float | int, ...], list[Run]] = {}
    for run in runs:
        groups.setdefault(contact_grid(run.prepared.model), []).append(run)
    return list(groups.values())


class _Convoy:
    """Runs that advance together, one or several."""

    def __init__(self, runs: Sequence[Run], settings: Settings) -> None:
        self._runs = runs
        self._scheme = SCHEMES[settings.scheme]
        models = [run.prepared.model for run in runs]
        self._ensemble = Ensemble(models, [run.plan.recorder(ROWS) for run in runs])
        self._system = self._ensemble.system
        self._work = work_arrays(self._system)
        self._state = self._ensemble.state([run.state for run in runs])
        for run, part in zip(runs, self._ensemble.parts, strict=True):
            if len(run.vibration):
                self._work.vibration[part.wheelsets] = run.vibration
        self._derivative = np.zeros_like(self._state)
        self._stages = np.zeros((3, len(self._state)))
        self._fresh, self._due = runs[0].fresh, runs[0].due
        self._evaluates = self._state[TIME] >= runs[0].prepared.evaluation - ROUND_OFF
        self._varies = runs[0].prepared.steps.varies
        # equal steps of distance while the speed changes: every interval is a chunk of its own
        self._spacing = settings.output_spacing if self._varies else None
        wheelsets = [len(model.system.contact.body) for model in models]
        self._shares = [number / sum(wheelsets) for number in wheelsets]

    def to_the_end(self, moved: Callable[[Sequence[Run], Floats], None]) -> list[list[Run]]:
        """Advance to the end, or to where runs part; return in which groups they go on."""
        while self._left() > 1e-9 or self._due:
            begin = time.perf_counter()
            before = _Before(
                self._state.copy(),
                self._fresh,
                self._due,
                [getattr(self._work, name).copy() for name in COUNTED],
            )
            choices = self._choices()
            if len(set(choices)) > 1 or self._errors():
                return self._parted(choices, before)
            status, where, rows = self._chunk(*choices[0]) if choices else self._last_record()
            if status != RUNNING and len(self._runs) > 1:
                return self._parted(self._ensemble.concerned(status, where), before)
            self._write(rows)
            spent = time.perf_counter() - begin
            for run, share in zip(self._runs, self._shares, strict=True):
                run.status, run.where = status, where
                run.wall_time += share * spent
            moved(self._runs, self._state)
            self._begin_evaluation()
            if status != RUNNING:
                break
            if self._errors():
                return self._parted([0] * len(self._runs))
        self._give_back()
        return []

    def _left(self) -> float:
        return self._runs[0].prepared.left(self._state)

    def _errors(self) -> bool:
        return any(run.ended for run in self._runs)

    def _choices(self) -> list[tuple[float, int]]:
        """Step and number of steps to the next output of every run; none at the end."""
        if self._left() <= 1e-9:
            return []
        if self._spacing is not None:
            right_hand_sides(self._system, self._work, self._state[None], self._derivative[None])
        speed, rate = self._state[SPEED], self._derivative[SPEED]
        choices = []
        for run in self._runs:
            try:
                choices.append(run.prepared.steps.at(speed, rate))
            except RailsimError as error:  # no equilibrium at this speed, or no stable step
                if self._state[TIME] > run.prepared.state[TIME]:
                    run.stopped = f"the run cannot go on at {speed:.3g} m/s: {error}"
                else:
                    run.error = error
                choices.append((math.nan, 0))
            except Exception as error:
                run.error = error
                choices.append((math.nan, 0))
        return choices

    def _chunk(self, step: float, every: int) -> tuple[int, int, int]:
        """Advance by one chunk: status, where, number of records."""
        at_most = max(1, STEPS // (every * len(self._runs)))
        intervals = 1 if self._varies else min(ROWS, at_most)
        if not self._evaluates:  # whose begin is the end of a chunk
            before = self._runs[0].prepared.evaluation - self._state[TIME]
            intervals = min(intervals, max(1, math.ceil(before / (step * every) - ROUND_OFF)))
        n_steps = min(intervals * every, math.ceil(self._left() / step * (1.0 - 1e-9)))
        last = int(self._spacing is not None and n_steps == every)
        goal = self._state[ARC_LENGTH] + (self._spacing or 0.0)
        status, where, steps, rows = self._call(step, 0, n_steps - last, every)
        if last and status == RUNNING:
            # the last step of an interval of distance ends where the interval ends
            rest = duration(
                goal - self._state[ARC_LENGTH], self._state[SPEED], self._derivative[SPEED]
            )
            status, where, more, first = self._call(rest, steps, 1, every)
            steps, rows = steps + more, rows + first
        self._due = status == RUNNING and steps % every == 0
        return status, where, rows

    def _begin_evaluation(self) -> None:
        """Begin with new extremes where the part of the run begins that is evaluated."""
        if self._evaluates or self._state[TIME] < self._runs[0].prepared.evaluation - ROUND_OFF:
            return
        for run, part in zip(self._runs, self._ensemble.parts, strict=True):
            _take_extremes(run.extremes, self._work.extremes[:, part.wheelsets])
        self._work.extremes[:] = no_extremes(self._work.extremes.shape[1])
        self._evaluates = True

    def _last_record(self) -> tuple[int, int, int]:
        """Record the state at the end: status, where, number of records."""
        self._due = False
        status, where, _, rows = self._call(1.0, 0, 0, 1, closing=1)
        return status, where, rows

    def _call(
        self, step: float, first: int, n_steps: int, every: int, closing: int = 0
    ) -> tuple[int, int, int, int]:
        begin = time.thread_time()  # a library's idle threads may still be spinning
        most = max(1, STEPS // len(self._runs))
        longest = longest_part(self._system, self._state[SPEED])
        divide_strikes(self._work, self._scheme, step, longest)
        at, end, rows = first, first + n_steps, 0
        while True:
            # more than one call only within one output interval, which records at its begin:
            # Ctrl-C is heard between calls
            status, where, steps, new = time_loop(
                self._system,
                self._work,
                self._state,
                self._derivative,
                self._stages,
                self._ensemble.recorder,
                self._scheme,
                step,
                Chunk(at, min(most, end - at), every, fresh=int(self._fresh), closing=closing),
            )
            at, rows = at + steps, rows + new
            self._fresh = self._fresh and steps == 0
            if status != RUNNING or at >= end:
                break
        spent = time.thread_time() - begin
        for run, share in zip(self._runs, self._shares, strict=True):
            run.cpu_time += share * spent
            run.together = max(run.together, len(self._runs))
        return status, where, at - first, rows

    def _write(self, rows: int) -> None:
        """Hand the records of a chunk to the runs' sinks."""
        if rows == 0:
            return
        for number, run in enumerate(self._runs):
            records = self._ensemble.records(number, rows)
            try:
                chunk = run.plan.chunk(records, rows, run.prepared.balance.Q0)
                run.swings.append(thinned(chunk))
                run.sink.append(chunk)
            except Exception as error:
                run.error = error

    def _parted(self, keys: Sequence[object], before: _Before | None = None) -> list[list[Run]]:
        """Runs grouped by equal keys, as they were before; those with an error are at their end."""
        if before is not None:
            self._state, self._fresh, self._due, counted = before
            for name, values in zip(COUNTED, counted, strict=True):
                getattr(self._work, name)[:] = values
        self._give_back()
        pairs = list(zip(self._runs, keys, strict=True))
        groups = [
            [run for run, other in pairs if other == key and not run.ended]
            for key in dict.fromkeys(keys)
        ]
        return [group for group in groups if group]

    def _give_back(self) -> None:
        """Let the runs have their states and counts."""
        for run, part in zip(self._runs, self._ensemble.parts, strict=True):
            run.state = self._state[part.state]
            run.fresh, run.due = self._fresh, self._due
            run.events += self._work.events[part.wheelsets][:, [0, 1, 4]].sum(axis=0)
            _take_extremes(run.extremes, self._work.extremes[:, part.wheelsets])
            if self._evaluates:
                _take_extremes(run.evaluated, self._work.extremes[:, part.wheelsets])
            run.unloaded += self._work.unloaded[part.wheelsets]
            run.parts += self._work.parts
            run.again += int(self._work.events[part.wheelsets, AGAIN].sum())
            run.vibration = self._work.vibration[part.wheelsets].copy()


def _take_extremes(before: Floats, later: Floats) -> None:
    """Take the extremes of a later part of a run into those of all before it."""
    for row, beyond in ((MAX, later[MAX] > before[MAX]), (MIN, later[MIN] < before[MIN])):
        before[row : row + 3][:, beyond] = later[row : row + 3][:, beyond]
