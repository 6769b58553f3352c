"""Non-linear critical speed by a ramp of falling speed.

A ramp undershoots the end of a branch: the oscillation decays a few tenths of m/s late.  Hence runs
at constant speed from states of the ramp decide, and the speed is bisected (Polach 2006, Polach and
Kaiser 2012).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from railsim.arrays import Floats
from railsim.stability.branches import RESOLUTION, THRESHOLD, Branch, Point, seen_at
from railsim.stability.motion import LeftRange, Motion, Stretch, VehicleMotion

Progress = Callable[[float], None]

WINDOW = 1.0  # s, over which an amplitude is taken
# m, disturbances, the largest beyond the clearance of flanges; those that derail are halved
EXCITATIONS = (1e-3, 3e-3, 6e-3, 8e-3, 11e-3)
SMALL = 1e-5  # m, disturbance at the lower end of a diagram
HOLD = 10.0  # s, for the oscillation to settle above the critical speed
BRAKING = 0.5  # m/s2, to see where about hunting dies
DECELERATION = 0.05  # m/s2, of the ramp
LEAD = 6.0  # m/s above the end of that braking, where the ramp begins
WHOLE = 4.0  # s, of a look at a motion too slow to be seen whole in a shorter one: 0.3 Hz, at least
CONSTANT = 20.0  # s, of a run that decides whether an oscillation sustains itself
CHANGE = 0.02  # of the amplitude over half of it
MOST_HALVES = 10  # halves of such a run, at most
MOST_GROWING = 30  # times HOLD, in which a motion grows to what it is led from, at most
STEP_DOWN = 0.95  # ratio of speeds, where every disturbance ends in a derailment
# Where further ramps begin above a speed at which rest is unstable: shares of a tenth of it, or of
# what is left to the end of hunting; the range may be narrow.
ONWARDS, ABOVE = (0.5, 0.1), 0.1
# Ratios of speeds at which other motions are sought below the slowest one: two that differ little,
# such as on the flange with 6.5 and 6.7 mm, may end 7 % apart.
CLOSE, BELOW = 0.95, 0.8
ABOVE_END = 0.5  # m/s, by which the end of a branch may move with the step


def excite(motion: Motion, speed: float, amplitude: float) -> Stretch:
    """Excite hunting at a speed by a disturbance [m] and let it settle; one that derails is halved.

    Raises LeftRange: even a small disturbance ends in a derailment.
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
        seen = excite(motion, speed, size)
        if seen.amplitude > THRESHOLD:
            break
    return seen


def grow(motion: Motion, seen: Stretch, speed: float) -> Stretch:
    """What a motion grows to, such as a sway of stuck friction by a tenth in 10 s.

    A ramp from a motion far smaller than that dies at speeds at which the grown one lasts.
    """
    with suppress(LeftRange):
        for _ in range(MOST_GROWING):
            further = motion.stretch(seen.state, speed, speed, HOLD)
            further = motion.stretch(further.state, speed, speed, 2.0 * WINDOW)
            if further.amplitude <= (1.0 + CHANGE) * seen.amplitude:
                break
            seen = further
    return seen


def at_speed(motion: Motion, state: Floats, begin: float, end: float) -> Floats:
    """A state at another speed, after braking or accelerating to it."""
    if abs(end - begin) < 1e-9:
        return state
    return motion.stretch(state, begin, end, abs(end - begin) / BRAKING).state


def looked_at(motion: Motion, state: Floats, speed: float, duration: float) -> Stretch:
    """A stretch at constant speed in which one period at least is seen, if anything moves.

    The amplitude of a part of a period is that of no motion.
    """
    seen = motion.stretch(state, speed, speed, duration)
    if np.isfinite(seen.frequency) or seen.amplitude < SMALL or duration >= WHOLE:
        return seen
    return motion.stretch(seen.state, speed, speed, WHOLE)


def ramp(
    motion: Motion,
    low: float,
    high: float,
    tell: Progress = lambda _: None,
    excitations: Sequence[float] = EXCITATIONS,
) -> tuple[Point | None, Branch]:
    """Let the speed fall from `high` until hunting dies, then bisect with runs at constant speed.

    Braking hard shows where about it dies; the ramp begins somewhat above, on a state from there.

    `low`, `high`: range of speeds [m/s]; where every disturbance or the braking after it derails at
    `high`, a lower one is taken; `excitations`: sizes of the disturbances at the highest speed [m].
    Returns: the slowest motion that sustains itself, and the amplitude on the ramp.
    """
    speed = high
    while True:
        hard: list[Point] = []
        try:
            seen = grow(motion, hunting(motion, speed, excitations), speed)
            hard.append(seen_at(speed, seen))
            _brake(motion, hard, low, BRAKING, lambda share: tell(0.3 * share))
            break
        except LeftRange:  # excited, or while it brakes
            if speed <= low:
                raise
            speed = max(low, min(STEP_DOWN * speed, hard[-1].speed if hard else speed))
    begin = min(hard[0].speed, hard[-1].speed + LEAD)
    points = [point for point in hard if point.speed >= begin]
    _brake(motion, points, low, DECELERATION, lambda share: tell(0.3 + 0.4 * share))
    lowest = _lowest(motion, points)
    return lowest, Branch("ramp", points, math.inf if lowest is None else lowest.speed)


def tops_above(speed: float, end: float) -> list[float]:
    """Speeds above one at which rest is unstable, below the end of a ramp, where others begin."""
    reach = min(ABOVE * speed, end - speed)
    return [speed + share * reach for share in ONWARDS]


def far_above(speed: float) -> float:
    """Speed above which hunting does not begin where rest loses its stability [m/s]."""
    return max(speed + 2.0, 1.05 * speed)


def below(
    motion: Motion, speed: float, low: float, excitation: float
) -> Iterator[tuple[Point, Branch]]:
    """Seek, by a disturbance [m] at speeds below the end of a ramp [m/s], motions that last there.

    Where one motion ends rounding may decide whether the vehicle changes to another.  From each
    that is found a ramp goes on: yields its slowest motion, and the amplitude on it.
    """
    ratio = CLOSE
    while (tried := ratio * speed) > low:
        ratio = BELOW * (1.0 if ratio == CLOSE else ratio)
        with suppress(LeftRange):  # every disturbance derails, or what it becomes
            seen = excite(motion, tried, excitation)
            if seen.amplitude > THRESHOLD and sustain(motion, seen.state, tried):
                lowest, branch = ramp(motion, low, tried, excitations=(excitation,))
                if lowest is not None:
                    yield lowest, branch
                    speed, ratio = lowest.speed, CLOSE


def _brake(
    motion: Motion, points: list[Point], low: float, deceleration: float, tell: Progress
) -> None:
    """Append what a system does while its speed falls, until it hunts no more."""
    top = points[-1].speed
    while points[-1].amplitude > THRESHOLD and points[-1].speed > low:
        speed, state = points[-1].speed, points[-1].state
        below = max(low, speed - deceleration * WINDOW)
        duration = max(WINDOW, (speed - below) / deceleration)
        points.append(seen_at(below, motion.stretch(state, speed, below, duration)))
        tell((top - below) / max(top - low, RESOLUTION))


def _lowest(motion: Motion, points: Sequence[Point]) -> Point | None:
    """The slowest sustained motion, from states of a ramp.

    The speeds between the last state that hunts and the first that does not are bisected; where
    the last one dies at constant speed too, it is sought further up.
    """
    alive = [point for point in points if point.hunts]
    if not alive:
        return None

    def sustained_at(speed: float) -> Point | None:
        """The motion sustained at a speed, from the slowest state that hunts there or above."""
        source = [point for point in alive if point.speed >= speed - 1e-9][-1]
        return sustain(motion, at_speed(motion, source.state, source.speed, speed), speed)

    upper, lower, step = alive[-1].speed, points[-1].speed, 2.0 * RESOLUTION
    best = sustained_at(upper)
    while best is None and upper < alive[0].speed:
        lower, upper, step = upper, min(alive[0].speed, upper + step), 2.0 * step
        best = sustained_at(upper)
    while best is not None and upper - lower > RESOLUTION:
        middle = 0.5 * (lower + upper)
        found = sustained_at(middle)
        if found is None:
            lower = middle
        else:
            upper, best = middle, found
    return best


def sustain(motion: Motion, state: Floats, speed: float) -> Point | None:
    """What a system does after a long run at constant speed, None if its oscillation dies.

    Near the fold an oscillation that lasts settles as slowly as one that does not dies: the run
    goes on while the amplitude still falls.
    """
    half = 0.5 * CONSTANT - WINDOW
    before = np.inf
    for _ in range(MOST_HALVES):
        state = motion.stretch(state, speed, speed, half).state
        seen = looked_at(motion, state, speed, WINDOW)
        if seen.amplitude < THRESHOLD:
            return None
        if seen.amplitude > (1.0 - CHANGE) * before:
            return seen_at(speed, seen)
        before, state = seen.amplitude, seen.state
    return None


def lasts_in_shorter_steps(motion: VehicleMotion, slowest: Point) -> bool:
    """Whether a motion lasts in shorter steps, at its speed or, at the end of its branch, above.

    At walking pace and in steps as long as the tread allows, creep forces on a flange alternate
    from step to step and may hold a wheelset there that would leave it.
    """
    finer = motion.in_shorter_steps()
    for speed in (slowest.speed, slowest.speed + ABOVE_END):
        with suppress(LeftRange):
            if sustain(finer, at_speed(finer, slowest.state, slowest.speed, speed), speed):
                return True
    return False
