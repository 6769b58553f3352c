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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Floats, Integers
from railsim.definitions.settings import Settings
from railsim.errors import RailsimError
from railsim.kernels.compiler import entry
from railsim.kernels.extremes import MAX, MIN
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import ARC_LENGTH, LAST_STEP, SPEED, TIME
from railsim.kernels.status import RUNNING
from railsim.kernels.system import AGAIN, N_PARTS
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

Progress = Callable[[float], None]

# Longest chunk in outputs, and in steps of all its vehicles: some hundredths of a second of
# computing by the fast scheme, and below a second by the other one
ROWS, STEPS = 2000, 64_000
ROUND_OFF = 1e-9  # s

# what a chunk changes in the work arrays: counts of patches and of steps, extremes, times without
# load, vibrations, commands and samples; and where the rails have been displaced
COUNTED = ("events", "extremes", "unloaded", "vibration", "parts", "memory", "rail_motion")


@dataclass(frozen=True, eq=False)
class SavedState:
    """All that a run goes on from, as `Simulation.state` gives it; it can be pickled.

    - `motion`: float64[n_state], see `railsim.kernels.state`
    - `counted`: what steps count and remember: commands, samples, memory of laws, extremes
    - `grid`: where it is on the grid of steps
    - `begun`: begin of the step of the grid of which a part has been taken
    """

    motion: Floats
    counted: tuple[NDArray[Any], ...]
    grid: tuple[Any, ...]
    begun: "SavedState | None" = None


@dataclass
class Preparation:
    """Everything that is settled before the time loop starts."""

    model: Model  # the assembled vehicle on its track
    balance: Equilibrium  # its rest and steady rolling
    state: Floats  # at the beginning, float64[n_state]
    end_time: float  # where the run ends [s]
    end_distance: float  # where it ends if that comes first [m]
    steps: StepChoice  # step and output interval at any speed
    # commands, samples and memory of laws at the beginning, see `railsim.kernels.system.Own`
    memory: Floats
    evaluation: float = 0.0  # time from which on peaks are evaluated [s]
    fresh: bool = True  # whether nothing was before the initial state
    remarks: tuple[str, ...] = ()  # for the reader

    def left(self, state: Floats) -> float:
        """Time from `state` to the end of the run at the present speed [s]."""
        by_distance = (self.end_distance - state[ARC_LENGTH]) / state[SPEED]
        return float(min(self.end_time - state[TIME], by_distance))


@dataclass(eq=False)
class Run:
    """A run on its way."""

    prepared: Preparation
    plan: OutputPlan
    sink: Sink
    state: Floats  # where it is, float64[n_state]
    fresh: bool = True  # whether nothing was before `state`
    due: bool = True  # whether `state` is to be recorded
    status: int = RUNNING  # how it ended, see `railsim.kernels.status`
    where: int = 0  # likewise
    # loaded contact patches so far, and those out of the creep law's range; look-ups beyond the yaw
    # of the contact table
    events: Integers = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    # counts of steps and evaluations, see `railsim.kernels.system`
    parts: Integers = field(default_factory=lambda: np.zeros(N_PARTS, dtype=np.int64))
    again: int = 0  # how often the contact of one wheelset alone was evaluated again
    # of the wheel loads, see `railsim.kernels.vibration`; empty at its begin
    vibration: Floats = field(default_factory=lambda: np.zeros((0, 2, VIBRATION)))
    cpu_time: float = 0.0  # its share of what the time loop took [s]
    wall_time: float = 0.0  # its share of what all of the run took [s]
    together: int = 1  # most runs that have shared a call with it, itself included
    error: Exception | None = None  # in writing its output, or why it cannot begin
    stopped: str = ""  # why it cannot go on at the speed that it has reached
    # for the reader of its result, see `railsim.simulation.remarks`
    remarks: list[str] = field(default_factory=list)
    # what shows whether it hunts, see `railsim.result.hunting`
    swings: MemorySink = field(default_factory=lambda: MemorySink(only=SEEN))

    @property
    def ended(self) -> bool:
        """Whether it has ended before its end, but for what the time loop says."""
        return self.error is not None or bool(self.stopped)

    def __post_init__(self) -> None:
        wheelsets = len(self.prepared.model.index.wheelsets)
        # largest and smallest values so far, see `railsim.kernels.extremes`
        self.extremes: Floats = no_extremes(wheelsets)
        self.evaluated: Floats = no_extremes(wheelsets)  # since the evaluation began
        self.unloaded: Floats = np.zeros((wheelsets, 2))  # s in which each wheel carried nothing
        self.memory: Floats = self.prepared.memory.copy()
        self.swings.begin(self.plan.coordinates)


def advance(
    runs: Sequence[Run], settings: Settings, progress: Progress | None = None
) -> Iterator[Run]:
    """Take runs to their ends; yields each when it is there.

    `runs`: of the same track, start and end, and of these settings; `progress`: called repeatedly
    with the finished fraction of all runs.
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
        apart = Convoy(together, settings).to_the_end(moved)
        on_their_way = [run for group in apart for run in group]
        ended = [run for run in together if run not in on_their_way]
        done |= dict.fromkeys(ended, 1.0)
        yield from ended
        tell()
        waiting = apart + waiting


def _matching(runs: Sequence[Run], settings: Settings) -> list[list[Run]]:
    """Runs that can be one system: with one speed, last step and grid of contact tables."""
    if settings.drive.mode == "free":
        return [[run] for run in runs]
    groups: dict[tuple[float | int, ...], list[Run]] = {}
    for number, run in enumerate(runs):
        model = run.prepared.model
        # what follows commands or laws of one's own runs alone
        alone = number if len(model.system.own.memory) > 1 else -1
        # a strike on the way to the start divides the last step there
        key = alone, float(run.state[LAST_STEP]), *contact_grid(model)
        groups.setdefault(key, []).append(run)
    return list(groups.values())


class Convoy:
    """Runs that advance together, one or several."""

    def __init__(self, runs: Sequence[Run], settings: Settings) -> None:
        self._runs = runs
        self.scheme = SCHEMES[settings.scheme]
        models = [run.prepared.model for run in runs]
        self.ensemble = Ensemble(models, [run.plan.recorder(ROWS) for run in runs])
        self.system = self.ensemble.system
        self.work = work_arrays(self.system)
        self.state = self.ensemble.state([run.state for run in runs])
        for run, part in zip(runs, self.ensemble.parts, strict=True):
            if len(run.vibration):
                self.work.vibration[part.wheelsets] = run.vibration
        self.work.memory[:] = runs[0].memory
        self.derivative = np.zeros_like(self.state)
        self.stages = np.zeros((3, len(self.state)))
        self.fresh, self.due = runs[0].fresh, runs[0].due
        self.evaluates = self.state[TIME] >= runs[0].prepared.evaluation - ROUND_OFF
        self.varies = runs[0].prepared.steps.varies
        # equal steps of distance while the speed changes: the last step of an interval ends there
        self.spacing = settings.output_spacing if self.varies else None
        wheelsets = [len(model.system.contact.body) for model in models]
        self._shares = [number / sum(wheelsets) for number in wheelsets]
        self._entries: dict[object, Any] = {}

    def compiled(self, function: Any, *args: object) -> Any:
        """Call a compiled function of system and work arrays, without a search for types."""
        call = self._entries.get(function, function)
        result = call(self.system, self.work, *args)
        if call is function:
            self._entries[function] = entry(function, self.system, self.work, *args)
        return result

    def to_the_end(self, moved: Callable[[Sequence[Run], Floats], None]) -> list[list[Run]]:
        """Advance to the end, or to where runs part; return in which groups they go on."""
        apart = self.chunks(moved)
        if apart is None:
            self.give_back()
        return apart or []

    def chunks(self, moved: Callable[[Sequence[Run], Floats], None]) -> list[list[Run]] | None:
        """As `to_the_end`; None at the end, where the runs have neither states nor counts yet."""
        while self.left() > 1e-9 or self.due:
            begin = time.perf_counter()
            before = self.saved()
            choices = self.choices()
            if len(set(choices)) > 1 or self._errors():
                return self._parted(choices, before)
            status, where, rows = self._chunk(choices) if choices else self.last_record()
            if status != RUNNING and len(self._runs) > 1:
                return self._parted(self.ensemble.concerned(status, where), before)
            self.write(rows)
            spent = time.perf_counter() - begin
            for run, share in zip(self._runs, self._shares, strict=True):
                run.status, run.where = status, where
                run.wall_time += share * spent
            moved(self._runs, self.state)
            self.begin_evaluation()
            if status != RUNNING:
                break
            if self._errors():
                return self._parted([0] * len(self._runs))
        return None

    def left(self) -> float:
        """Time to the end at the present speed [s]."""
        return self._runs[0].prepared.left(self.state)

    def _errors(self) -> bool:
        return any(run.ended for run in self._runs)

    def choices(self) -> list[tuple[float, int]]:
        """Step and number of steps to the next output of every run; none at the end."""
        if self.left() <= 1e-9:
            return []
        if self.spacing is not None:
            self.compiled(right_hand_sides, self.state[None], self.derivative[None])
        speed, rate = self.state[SPEED], self.derivative[SPEED]
        choices = []
        for run in self._runs:
            try:
                choices.append(run.prepared.steps.at(speed, rate))
            except RailsimError as error:  # no equilibrium at this speed, or no stable step
                if self.state[TIME] > run.prepared.state[TIME]:
                    run.stopped = f"the run cannot go on at {speed:.3g} m/s: {error}"
                else:
                    run.error = error
                choices.append((math.nan, 0))
            except Exception as error:
                run.error = error
                choices.append((math.nan, 0))
        return choices

    def _chunk(self, choices: list[tuple[float, int]]) -> tuple[int, int, int]:
        """Advance by one chunk: status, where, number of records.

        Where the speed varies the step is chosen anew at every output.
        """
        rows, steps, most = 0, 0, max(1, STEPS // len(self._runs))
        while True:
            step, every = choices[0]
            intervals = 1 if self.varies else min(ROWS, max(1, most // every))
            status, where, rows = self._intervals(step, every, intervals, rows)
            steps += every
            ends = status != RUNNING or rows >= ROWS or steps >= most or self._evaluation_begins()
            if ends or not self.varies:
                return status, where, rows
            choices = self.choices()
            if len(set(choices)) != 1 or self._errors():  # at the end, or where runs part
                return status, where, rows

    def _intervals(
        self, step: float, every: int, intervals: int, rows: int
    ) -> tuple[int, int, int]:
        """Advance by some intervals between outputs after `rows` records of this chunk."""
        if not self.evaluates:  # whose begin is the end of a chunk
            before = self._runs[0].prepared.evaluation - self.state[TIME]
            intervals = min(intervals, max(1, math.ceil(before / (step * every) - ROUND_OFF)))
        n_steps = min(intervals * every, math.ceil(self.left() / step * (1.0 - 1e-9)))
        last = int(self.spacing is not None and n_steps == every)
        goal = self.state[ARC_LENGTH] + (self.spacing or 0.0)
        status, where, steps, rows = self.call(step, 0, n_steps - last, every, rows=rows)
        if last and status == RUNNING:
            # the last step of an interval of distance ends where the interval ends
            rest = duration(
                goal - self.state[ARC_LENGTH], self.state[SPEED], self.derivative[SPEED]
            )
            status, where, more, rows = self.call(rest, steps, 1, every, rows=rows)
            steps += more
        self.due = status == RUNNING and steps % every == 0
        return status, where, rows

    def _evaluation_begins(self) -> bool:
        """Whether the part of the run that is evaluated begins here."""
        begin = self._runs[0].prepared.evaluation
        return not self.evaluates and bool(self.state[TIME] >= begin - ROUND_OFF)

    def begin_evaluation(self) -> None:
        """Begin with new extremes where the part of the run begins that is evaluated."""
        if not self._evaluation_begins():
            return
        for run, part in zip(self._runs, self.ensemble.parts, strict=True):
            take_extremes(run.extremes, self.work.extremes[:, part.wheelsets])
        self.work.extremes[:] = no_extremes(self.work.extremes.shape[1])
        self.evaluates = True

    def last_record(self) -> tuple[int, int, int]:
        """Record the state at the end: status, where, number of records."""
        self.due = False
        memory = self.work.memory.copy()  # a run that goes on from here samples this instant itself
        status, where, _, rows = self.call(1.0, 0, 0, 1, closing=1)
        self.work.memory[:] = memory
        return status, where, rows

    def call(
        self, step: float, first: int, n_steps: int, every: int, closing: int = 0, rows: int = 0
    ) -> tuple[int, int, int, int]:
        """Call the time loop; its status, where, number of steps, of records with those before."""
        begin = time.thread_time()  # a library's idle threads may still be spinning
        most = max(1, STEPS // len(self._runs))
        divide_strikes(self.work, self.scheme, step, longest_part(self.system, self.state[SPEED]))
        at, end = first, first + n_steps
        while True:
            # more than one call only within one output interval, which records at its begin:
            # Ctrl-C is heard between calls
            chunk = Chunk(at, min(most, end - at), every, int(self.fresh), closing, rows)
            status, where, steps, rows = self.loop(step, chunk)
            at += steps
            self.fresh = self.fresh and steps == 0
            if status != RUNNING or at >= end:
                break
        spent = time.thread_time() - begin
        for run, share in zip(self._runs, self._shares, strict=True):
            run.cpu_time += share * spent
            run.together = max(run.together, len(self._runs))
        return status, where, at - first, rows

    def loop(self, step: float, chunk: Chunk) -> tuple[int, int, int, int]:
        """Call the time loop once."""
        arrays = self.state, self.derivative, self.stages, self.ensemble.recorder
        status, where, steps, rows = self.compiled(time_loop, *arrays, self.scheme, step, chunk)
        return status, where, steps, rows

    def write(self, rows: int) -> None:
        """Hand the records of a chunk to the runs' sinks."""
        if rows == 0:
            return
        for number, run in enumerate(self._runs):
            records = self.ensemble.records(number, rows)
            try:
                chunk = run.plan.chunk(records, rows, run.prepared.balance.Q0)
                run.swings.append(thinned(chunk))
                run.sink.append(chunk)
                run.stopped = run.stopped or chunk.wrong
            except Exception as error:
                run.error = error

    def saved(self) -> SavedState:
        """All that the runs go on from, a copy."""
        counted = tuple(getattr(self.work, name).copy() for name in COUNTED)
        grid = self.fresh, self.due, self.evaluates, float(self.derivative[SPEED])
        return SavedState(self.state.copy(), counted, grid)

    def restore(self, saved: SavedState) -> None:
        """Go back to a state."""
        self.state[:] = saved.motion
        for name, values in zip(COUNTED, saved.counted, strict=True):
            getattr(self.work, name)[...] = values
        self.fresh, self.due, self.evaluates, self.derivative[SPEED] = saved.grid[-4:]

    def _parted(self, keys: Sequence[object], before: SavedState | None = None) -> list[list[Run]]:
        """Runs grouped by equal keys, as they were before; those with an error are at their end."""
        if before is not None:
            self.restore(before)
        self.give_back()
        pairs = list(zip(self._runs, keys, strict=True))
        groups = [
            [run for run, other in pairs if other == key and not run.ended]
            for key in dict.fromkeys(keys)
        ]
        return [group for group in groups if group]

    def give_back(self) -> None:
        """Let the runs have their states and counts."""
        for run, part in zip(self._runs, self.ensemble.parts, strict=True):
            run.state = self.state[part.state]
            run.fresh, run.due = self.fresh, self.due
            run.events += self.work.events[part.wheelsets][:, [0, 1, 4]].sum(axis=0)
            take_extremes(run.extremes, self.work.extremes[:, part.wheelsets])
            if self.evaluates:
                take_extremes(run.evaluated, self.work.extremes[:, part.wheelsets])
            run.unloaded += self.work.unloaded[part.wheelsets]
            run.parts += self.work.parts
            run.again += int(self.work.events[part.wheelsets, AGAIN].sum())
            run.vibration = self.work.vibration[part.wheelsets].copy()
            run.memory = self.work.memory.copy()


def take_extremes(before: Floats, later: Floats) -> None:
    """Take the extremes of a later part of a run into those of all before it."""
    for row, beyond in ((MAX, later[MAX] > before[MAX]), (MIN, later[MIN] < before[MIN])):
        before[row : row + 3][:, beyond] = later[row : row + 3][:, beyond]
