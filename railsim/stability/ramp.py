"""Non-linear critical speed by a ramp of falling speed.

The non-linear critical speed is the lowest at which an oscillation sustains itself on ideal track.
A ramp undershoots it: the oscillation decays a few tenths of m/s late.  Hence runs at constant
speed from states of the ramp decide, and the speed is bisected (Polach 2006, Polach and Kaiser
2012).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.stability.motion import LeftRange, Motion, Stretch

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

THRESHOLD = 0.05e-3  # m, amplitude below which nothing hunts
WINDOW = 1.0  # s, over which an amplitude is taken
EXCITATIONS = (1e-3, 3e-3, 6e-3, 8e-3)  # m, disturbances; those that derail are halved
SMALL = 1e-5  # m, disturbance at the lower end of a diagram
HOLD = 10.0  # s, for the oscillation to settle above the critical speed
BRAKING = 0.5  # m/s2, to see where about hunting dies
DECELERATION = 0.05  # m/s2, of the ramp
LEAD = 6.0  # m/s above the end of that braking, where the ramp begins
CONSTANT = 20.0  # s, of a run that decides whether an oscillation sustains itself
CHANGE = 0.02  # of the amplitude over half of it
MOST_HALVES = 10  # halves of such a run, at most
RESOLUTION = 0.1  # m/s
STEP_DOWN = 0.95  # ratio of speeds, where every disturbance ends in a derailment


@dataclass(frozen=True)
class Sustained:
    """The lowest speed at which an oscillation sustains itself.

    Attributes
    ----------
    speed : float or None
        [m/s]; None where it does so at no speed of the range.
    amplitude, frequency : float
        There [m], [Hz].
    below : bool
        Whether it still does at the lower end of the range.
    """

    speed: float | None
    amplitude: float = float("nan")
    frequency: float = float("nan")
    below: bool = False

    def record(self) -> dict[str, Any] | None:
        """Return it as plain data, None where there is none."""
        if self.speed is None:
            return None
        return {"speed": self.speed, "amplitude": self.amplitude, "frequency": self.frequency}


COLUMNS = ("speed", "amplitude", "frequency", "sum_Y_rms", "stable")


@dataclass
class Diagram:
    """One branch of a bifurcation diagram.

    Attributes
    ----------
    direction : "up", "down", "further", "threshold", "ramp" or "continuation"
    speed, amplitude, frequency, sum_Y_rms : list of float
        [m/s], [m], [Hz], [N].
    stable : list of bool
        Whether the motion is; those that a run settles to are.
    states : list of float64[n]
        States at the ends of the steps.
    """

    direction: str
    speed: list[float] = field(default_factory=list)
    amplitude: list[float] = field(default_factory=list)
    frequency: list[float] = field(default_factory=list)
    sum_Y_rms: list[float] = field(default_factory=list)
    stable: list[bool] = field(default_factory=list)
    states: list[Floats] = field(default_factory=list)

    def add(self, speed: float, seen: Stretch) -> None:
        """Append what was seen at a speed."""
        self.speed.append(speed)
        self.amplitude.append(seen.amplitude)
        self.frequency.append(seen.frequency)
        self.sum_Y_rms.append(seen.sum_Y_rms)
        self.stable.append(True)
        self.states.append(seen.state)

    def taken(self, order: Sequence[int]) -> "Diagram":
        """Return some of the points, in this order."""
        lists = {name: [getattr(self, name)[k] for k in order] for name in (*COLUMNS, "states")}
        return Diagram(self.direction, **lists)

    def __add__(self, other: "Diagram") -> "Diagram":
        """Return the points of both, one after the other."""
        lists = {name: getattr(self, name) + getattr(other, name) for name in (*COLUMNS, "states")}
        return Diagram(self.direction, **lists)

    @property
    def top(self) -> float:
        """The highest speed [m/s]."""
        return max(self.speed, default=float("nan"))

    @property
    def alive(self) -> list[int]:
        """Numbers of the points with an oscillation that sustains itself."""
        return [
            k
            for k, (a, stable) in enumerate(zip(self.amplitude, self.stable, strict=True))
            if stable and a > THRESHOLD
        ]

    def record(self) -> dict[str, Any]:
        """Return the branch as plain data."""
        return {name: getattr(self, name) for name in ("direction", *COLUMNS)}


def excited(motion: Motion, speed: float, amplitude: float) -> Stretch:
    """Excite hunting at a speed and let it settle; the end of what it then does.

    Parameters
    ----------
    amplitude : float
        Of the disturbance; halved where it derails [m].

    Raises
    ------
    LeftRange
        Even a small disturbance ends in a derailment.
    """
    while True:
        try:
            reached = motion.stretch(motion.rest(speed, amplitude), speed, speed, HOLD)
            return motion.stretch(reached.state, speed, speed, 2.0 * WINDOW)
        except LeftRange:
            amplitude *= 0.5
            if amplitude < SMALL:
                raise


def hunting(motion: Motion, speed: float, excitations: Sequence[float]) -> Stretch:
    """What the largest disturbance ends in, or a smaller one where it dies."""
    for size in sorted(excitations, reverse=True):
        seen = excited(motion, speed, size)
        if seen.amplitude > THRESHOLD:
            break
    return seen


def moved(motion: Motion, state: Floats, begin: float, end: float) -> Floats:
    """A state at another speed, after braking or accelerating to it."""
    if abs(end - begin) < 1e-9:
        return state
    return motion.stretch(state, begin, end, abs(end - begin) / BRAKING).state


def ramp(
    motion: Motion,
    low: float,
    high: float,
    progress: Progress | None = None,
    excitations: Sequence[float] = EXCITATIONS,
) -> tuple[Sustained, Diagram]:
    """Let the speed fall from `high` until hunting dies, then bisect with runs at constant speed.

    Braking hard shows where about it dies; the ramp begins somewhat above, on a state from there.

    Parameters
    ----------
    motion : Motion
    low, high : float
        Range of speeds [m/s]; where every disturbance derails at `high`, a lower one is taken.
    excitations : sequence of float
        Sizes of the disturbances at the highest speed [m].

    Returns
    -------
    Sustained, Diagram
        The critical speed, and the amplitude on the ramp.
    """
    tell = progress or (lambda _: None)
    speed = high
    while True:
        try:
            seen = hunting(motion, speed, excitations)
            break
        except LeftRange:
            if speed <= low:
                raise
            speed = max(low, STEP_DOWN * speed)
    hard = Diagram("ramp")
    hard.add(speed, seen)
    _braked(motion, hard, low, BRAKING, lambda share: tell(0.3 * share))
    begin = min(hard.speed[0], hard.speed[-1] + LEAD)
    branch = hard.taken([k for k, v in enumerate(hard.speed) if v >= begin])
    _braked(motion, branch, low, DECELERATION, lambda share: tell(0.3 + 0.4 * share))
    return lowest_on(motion, branch, low), branch


def _braked(
    motion: Motion, branch: Diagram, low: float, deceleration: float, tell: Progress
) -> None:
    """Append what a system does while its speed falls, until it hunts no more."""
    top = branch.speed[-1]
    while branch.amplitude[-1] > THRESHOLD and branch.speed[-1] > low:
        speed = branch.speed[-1]
        below = max(low, speed - deceleration * WINDOW)
        duration = max(WINDOW, (speed - below) / deceleration)
        branch.add(below, motion.stretch(branch.states[-1], speed, below, duration))
        tell((top - below) / max(top - low, RESOLUTION))


def lowest_on(motion: Motion, branch: Diagram, low: float) -> Sustained:
    """Lowest sustained speed, from states of a branch of falling speed.

    The speeds between the last state that hunts and the first that does not are bisected; where
    the last one dies at constant speed too, it is sought further up.
    """
    alive = [k for k, a in enumerate(branch.amplitude) if a > THRESHOLD]
    if not alive:
        return Sustained(None)
    last = alive[-1]
    lower = branch.speed[min(last + 1, len(branch.speed) - 1)]
    if last == len(branch.speed) - 1:
        found = sustained(motion, branch.states[last], branch.speed[last])
        if found is not None:
            return Sustained(branch.speed[last], found.amplitude, found.frequency, below=True)
    best: Sustained | None = None
    upper, step = branch.speed[last], 2.0 * RESOLUTION
    while best is None:
        found = sustained(motion, _state_at(motion, branch, upper), upper)
        if found is not None:
            best = Sustained(upper, found.amplitude, found.frequency)
        elif upper >= branch.speed[0]:
            return Sustained(None)
        else:
            lower, upper, step = upper, min(branch.speed[0], upper + step), 2.0 * step
    while upper - lower > RESOLUTION:
        middle = 0.5 * (lower + upper)
        found = sustained(motion, _state_at(motion, branch, middle), middle)
        if found is None:
            lower = middle
        else:
            upper, best = middle, Sustained(middle, found.amplitude, found.frequency)
    return best


def _state_at(motion: Motion, branch: Diagram, speed: float) -> Floats:
    """State at a speed, braked from the slowest point of a branch that hunts there or above."""
    chosen = [
        k
        for k, v in enumerate(branch.speed)
        if v >= speed - 1e-9 and branch.amplitude[k] > THRESHOLD
    ]
    return moved(motion, branch.states[chosen[-1]], branch.speed[chosen[-1]], speed)


def sustained(motion: Motion, state: Floats, speed: float) -> Stretch | None:
    """What a system does after a long run at constant speed, None if its oscillation dies.

    Near the fold an oscillation that lasts settles as slowly as one that does not dies: the run
    goes on while the amplitude still falls.
    """
    half = 0.5 * CONSTANT - WINDOW
    before = np.inf
    for _ in range(MOST_HALVES):
        state = motion.stretch(state, speed, speed, half).state
        seen = motion.stretch(state, speed, speed, WINDOW)
        if seen.amplitude < THRESHOLD:
            return None
        if seen.amplitude > (1.0 - CHANGE) * before:
            return seen
        before, state = seen.amplitude, seen.state
    return None
