"""Non-linear critical speed by a ramp of falling speed, and bifurcation diagrams by steps of speed.

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
START = 3e-3  # m, displacement that excites hunting; halved where it derails
SMALL = 1e-5  # m, disturbance at the lower end of a diagram
HOLD = 10.0  # s, for the oscillation to settle above the critical speed
DECELERATION = 0.05  # m/s2
CONSTANT = 20.0  # s, of a run that decides whether an oscillation sustains itself
CHANGE = 0.02  # of the amplitude over half of it
MOST_HALVES = 10  # halves of such a run, at most
RESOLUTION = 0.1  # m/s
SETTLING = 2.0  # s between looks at a step of a diagram
MOST_SETTLING = 60  # looks; 1 m/s above a critical speed a coach's hunting grows by 0.1/s


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


@dataclass
class Diagram:
    """One branch of a bifurcation diagram.

    Attributes
    ----------
    direction : "up", "down", "ramp" or "continuation"
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

    def record(self) -> dict[str, Any]:
        """Return the branch as plain data."""
        return {
            name: getattr(self, name)
            for name in ("direction", "speed", "amplitude", "frequency", "sum_Y_rms", "stable")
        }


def excited(motion: Motion, speed: float) -> Stretch:
    """Excite hunting at a speed and let it settle; the end of what it then does.

    Raises
    ------
    LeftRange
        Even a small disturbance ends in a derailment.
    """
    amplitude = START
    while True:
        try:
            settled = motion.stretch(motion.rest(speed, amplitude), speed, speed, HOLD)
            return motion.stretch(settled.state, speed, speed, 2.0 * WINDOW)
        except LeftRange:
            amplitude *= 0.5
            if amplitude < SMALL:
                raise


def ramp(
    motion: Motion, low: float, high: float, progress: Progress | None = None
) -> tuple[Sustained, Diagram]:
    """Let the speed fall from `high` until hunting dies, then bisect with runs at constant speed.

    Returns
    -------
    Sustained, Diagram
        The critical speed, and the amplitude on the ramp.
    """
    branch = Diagram("ramp")
    seen = excited(motion, high)
    branch.add(high, seen)
    speed = high
    while seen.amplitude > THRESHOLD and speed > low:
        below = max(low, speed - DECELERATION * WINDOW)
        seen = motion.stretch(seen.state, speed, below, max(WINDOW, (speed - below) / DECELERATION))
        speed = below
        branch.add(speed, seen)
        if progress is not None:
            progress(0.7 * (high - speed) / (high - low))
    return _lowest(motion, branch, low), branch


def _lowest(motion: Motion, branch: Diagram, low: float) -> Sustained:
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
        found = sustained(motion, _state_at(branch, upper), upper)
        if found is not None:
            best = Sustained(upper, found.amplitude, found.frequency)
        elif upper >= branch.speed[0]:
            return Sustained(None)
        else:
            lower, upper, step = upper, min(branch.speed[0], upper + step), 2.0 * step
    while upper - lower > RESOLUTION:
        middle = 0.5 * (lower + upper)
        found = sustained(motion, _state_at(branch, middle), middle)
        if found is None:
            lower = middle
        else:
            upper, best = middle, Sustained(middle, found.amplitude, found.frequency)
    return best


def _state_at(branch: Diagram, speed: float) -> Floats:
    """State of the slowest point of a branch that hunts at a speed or above."""
    chosen = [
        k
        for k, v in enumerate(branch.speed)
        if v >= speed - 1e-9 and branch.amplitude[k] > THRESHOLD
    ]
    return branch.states[chosen[-1]]


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


def settled(motion: Motion, state: Floats, speed: float) -> Stretch:
    """Run at a constant speed until the amplitude changes no more, or has died."""
    before = np.inf
    for _ in range(MOST_SETTLING):
        seen = motion.stretch(state, speed, speed, SETTLING)
        if abs(seen.amplitude - before) < 0.1 * CHANGE * seen.amplitude:
            break
        if seen.amplitude < 0.02 * THRESHOLD and seen.amplitude < before:
            break
        state, before = seen.state, seen.amplitude
    return seen


def diagram(
    motion: Motion, speeds: Sequence[float], progress: Progress | None = None
) -> tuple[list[Diagram], Sustained]:
    """Bifurcation diagram by steps of speed upwards and then downwards with carried states.

    Parameters
    ----------
    motion : Motion
    speeds : sequence of float
        Rising [m/s].

    Returns
    -------
    list of Diagram, Sustained
        Branches up and down, and the lowest speed at which an oscillation sustains itself.  A
        branch upwards ends where the vehicle derails.
    """
    up, down = Diagram("up"), Diagram("down")
    total = 2 * len(speeds)
    state = motion.rest(speeds[0], SMALL)
    for speed in speeds:
        try:
            seen = settled(motion, _disturbed(motion, up, state, speed), speed)
        except LeftRange:
            break
        up.add(speed, seen)
        state = seen.state
        if progress is not None:
            progress(len(up.speed) / total)
    if not up.speed:
        return [up, down], Sustained(None)
    seen = excited(motion, up.speed[-1])
    for number, speed in enumerate(reversed(up.speed)):
        seen = settled(motion, seen.state, speed)
        down.add(speed, seen)
        if progress is not None:
            progress((len(speeds) + number + 1) / total)
    return [up, down], _lowest(motion, down, speeds[0])


def _disturbed(motion: Motion, up: Diagram, state: Floats, speed: float) -> Floats:
    """The carried state, or where it rests again one that is slightly disturbed."""
    if up.amplitude and up.amplitude[-1] < SMALL:
        return motion.rest(speed, SMALL)
    return state


def bifurcation_type(branches: Sequence[Diagram], resolution: float = 1.5) -> str:
    """``subcritical`` where the branches up and down differ at a speed, else ``supercritical``.

    ``none`` where nothing hunts.

    Parameters
    ----------
    branches : sequence of Diagram
        Up and down.
    resolution : float
        Ratio of two amplitudes that count as different.
    """
    up, down = branches
    size = {v: a for v, a in zip(up.speed, up.amplitude, strict=True)}
    if not any(a > THRESHOLD for a in (*up.amplitude, *down.amplitude)):
        return "none"
    differ = [
        v
        for v, a in zip(down.speed, down.amplitude, strict=True)
        if a > THRESHOLD and a > resolution * size.get(v, a)
    ]
    return "subcritical" if differ else "supercritical"
