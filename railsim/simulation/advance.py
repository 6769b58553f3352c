"""From a prepared run to its end: the time loop, chunk by chunk.

Between two chunks there is time for progress, Ctrl-C and for writing.
"""

import time
from dataclasses import InitVar, dataclass, field
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
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.kernels.vibration import AMPLITUDE
from railsim.model.assembly import Model
from railsim.model.equilibrium import Equilibrium
from railsim.model.time_step import SCHEMES, divide_strikes
from railsim.model.uneven_wheels import rolling
from railsim.model.work import no_extremes, work_arrays
from railsim.result import MemorySink, Sink
from railsim.result.hunting import SEEN, thinned
from railsim.simulation.outputs import OutputPlan
from railsim.simulation.step_choice import StepChoice

# Longest chunk in outputs, and in steps: some hundredths of a second of computing by the fast
# scheme, and below a second by the other one
ROWS, STEPS = 2000, 64_000
ROUND_OFF = 1e-9  # s

# what a chunk changes in the work arrays: counts of patches and of steps, extremes, times without
# load, vibrations, commands and samples; and where the rails have been displaced
COUNTED = ("events", "extremes", "unloaded", "vibration", "counts", "memory", "rail_motion")


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
    # commands, samples and memory of laws at the beginning, see `railsim.kernels.control_records`
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
    """A run on its way: its time loop, what that reads and writes, and where it is."""

    prepared: Preparation
    plan: OutputPlan
    sink: Sink
    settings: InitVar[Settings]
    status: int = RUNNING  # how it ended, see `railsim.kernels.status`
    where: int = 0  # likewise
    cpu_time: float = 0.0  # what the time loop took [s]
    wall_time: float = 0.0  # what all of the run took [s]
    error: Exception | None = None  # in writing its output, or why it cannot begin
    stopped: str = ""  # why it cannot go on at the speed that it has reached
    # for the reader of its result, see `railsim.simulation.remarks`
    remarks: list[str] = field(default_factory=list)
    # what shows whether it hunts, see `railsim.result.hunting`
    swings: MemorySink = field(default_factory=lambda: MemorySink(only=SEEN))

    def __post_init__(self, settings: Settings) -> None:
        prepared, model = self.prepared, self.prepared.model
        wheelsets = len(model.index.wheelsets)
        # largest and smallest values so far, see `railsim.kernels.extremes`
        self.extremes: Floats = no_extremes(wheelsets)
        self.evaluated: Floats = no_extremes(wheelsets)  # since the evaluation began
        self.swings.begin(self.plan.coordinates)
        self.scheme = SCHEMES[settings.scheme]
        self.recorder = self.plan.recorder(ROWS)
        self.system = rolling(model.system, model.wheels, model.check, model.rails)
        self.work = work_arrays(self.system)
        self.state: Floats = prepared.state.copy()
        self.work.memory[:] = prepared.memory
        self.unloaded = np.zeros_like(self.work.unloaded)  # before the evaluation [s]
        self.derivative = np.zeros_like(self.state)
        self.stages = np.zeros((3, len(self.state)))
        # whether nothing was before the state
        self.fresh = prepared.fresh and not prepared.state[LAST_STEP]
        self.evaluates = bool(self.state[TIME] >= prepared.evaluation - ROUND_OFF)
        self.varies = prepared.steps.varies
        # equal steps of distance while the speed changes: the last step of an interval ends there
        self.spacing = settings.output_spacing if self.varies else None
        self._entries: dict[object, Any] = {}
        self._prepared: tuple[float, float] | None = None  # step and speed of the last call

    @property
    def events(self) -> Integers:
        """Loaded patches, those out of the creep law's range; look-ups beyond the table's yaw."""
        return np.asarray(self.work.events[:, [0, 1, 4]].sum(axis=0))

    @property
    def ended(self) -> bool:
        """Whether it has ended before its end, but for what the time loop says."""
        return self.error is not None or bool(self.stopped)

    def left(self) -> float:
        """Time to its end at the present speed [s]."""
        return self.prepared.left(self.state)

    def invoke(self, function: Any, *args: object) -> Any:
        """Call a compiled function of system and work arrays, without a search for types."""
        call = self._entries.get(function, function)
        result = call(self.system, self.work, *args)
        if call is function:
            self._entries[function] = entry(function, self.system, self.work, *args)
        return result

    def next_step(self) -> tuple[float, int] | None:
        """Step and number of steps to the next output; none at the end, or where there is none."""
        if self.left() <= ROUND_OFF:
            return None
        if self.spacing is not None:
            self.invoke(right_hand_sides, self.state[None], self.derivative[None])
        speed = self.state[SPEED]
        try:
            return self.prepared.steps.at(speed, self.derivative[SPEED])
        except RailsimError as error:  # no equilibrium at this speed, or no stable step
            if self.state[TIME] > self.prepared.state[TIME]:
                self.stopped = f"the run cannot go on at {speed:.3g} m/s: {error}"
            else:
                self.error = error
        except Exception as error:
            self.error = error
        return None

    def begin_evaluation(self) -> None:
        """Begin with new extremes where the part of the run begins that is evaluated."""
        begin = self.prepared.evaluation
        if not self.evaluates and self.state[TIME] >= begin - ROUND_OFF:
            take_extremes(self.extremes, self.work.extremes)
            self.work.extremes[:] = no_extremes(self.work.extremes.shape[1])
            self.unloaded[:] = self.work.unloaded
            self.work.vibration[..., AMPLITUDE] = 0.0  # else that of the start is the largest
            self.evaluates = True

    def last_record(self) -> tuple[int, int, int]:
        """Record the state at the end: status, where, number of records."""
        memory = self.work.memory.copy()  # a run that goes on from here samples this instant itself
        status, where, _, rows = self.call(1.0, Chunk(0, 0, 1, int(self.fresh), 1))
        self.work.memory[:] = memory
        return status, where, rows

    def call(self, step: float, chunk: Chunk) -> tuple[int, int, int, int]:
        """Call the time loop; its status, where, number of steps, of records with those before."""
        begin = time.thread_time()  # a library's idle threads may still be spinning
        if (prepared := (step, self.state[SPEED])) != self._prepared:  # 8 us of a single step's 30
            self._prepared = prepared
            divide_strikes(self.system, self.work, self.scheme, *prepared)
        arrays = self.state, self.derivative, self.stages, self.recorder
        status, where, steps, rows = self.invoke(time_loop, *arrays, self.scheme, step, chunk)
        self.fresh = self.fresh and steps == 0
        self.cpu_time += time.thread_time() - begin
        return status, where, steps, rows

    def write(self, rows: int) -> None:
        """Hand the records of a chunk to the sink."""
        if rows == 0:
            return
        try:
            chunk = self.plan.chunk(self.recorder, rows, self.prepared.balance.Q0)
            self.swings.append(thinned(chunk))
            self.sink.append(chunk)
            self.stopped = self.stopped or chunk.wrong
        except Exception as error:
            self.error = error

    def arrays(self) -> list[NDArray[Any]]:
        """All arrays that the run goes on from: its state first."""
        return [self.state, *(getattr(self.work, name) for name in COUNTED), self.extremes]

    def save(self) -> SavedState:
        """All that the run goes on from, a copy."""
        motion, *counted = (one.copy() for one in self.arrays())
        grid = self.fresh, self.evaluates, float(self.derivative[SPEED])
        return SavedState(motion, tuple(counted), grid)

    def restore(self, state: SavedState) -> None:
        """Go back to a state."""
        for here, values in zip(self.arrays(), (state.motion, *state.counted), strict=True):
            here[...] = values
        self.fresh, self.evaluates, self.derivative[SPEED] = state.grid[-3:]
        self._prepared = None

    def take_last_extremes(self) -> None:
        """Take those to the end into the extremes."""
        take_extremes(self.extremes, self.work.extremes)
        if self.evaluates:
            take_extremes(self.evaluated, self.work.extremes)


def take_extremes(before: Floats, later: Floats) -> None:
    """Take the extremes of a later part of a run into those of all before it."""
    for row, beyond in ((MAX, later[MAX] > before[MAX]), (MIN, later[MIN] < before[MIN])):
        before[row : row + 3][:, beyond] = later[row : row + 3][:, beyond]
