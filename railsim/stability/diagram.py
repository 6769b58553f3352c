"""Bifurcation diagrams by runs at constant speed: every motion that a vehicle settles to.

Steps of speed upwards from a small disturbance and downwards from the largest motion, disturbances
of several sizes at every step, and a closer look where a branch ends or jumps.  Where two motions
are possible at a speed, the disturbance that decides between them is bisected: a run from there
begins near the unstable motion between them.
"""

from collections.abc import Sequence
from itertools import count, pairwise

import numpy as np

from railsim.arrays import Floats
from railsim.stability import ramp
from railsim.stability.branches import (
    DROP,
    RESOLUTION,
    THRESHOLD,
    Branch,
    Point,
    far_apart,
    seen_at,
)
from railsim.stability.motion import LeftRange, Motion, Stretch

ALIKE = 0.1  # relative difference of two amplitudes at a speed that count as one motion
NEAR = 0.03  # relative difference of amplitudes that need not settle further
SETTLING = 2.0  # s between looks at a step of a diagram
MOST_SETTLING = 60  # looks; 1 m/s above a critical speed a coach's hunting grows by 0.1/s ...
ONE_WAY = 30  # ... and closer to it more slowly: they count from the last of so many to one side
THRESHOLDS = 4  # speeds between the ends of two branches at which the unstable motion is sought
HALVINGS = 6  # of the disturbance there
MOST_LINGERING = 20  # s of a run that decides for one of two motions
ARRIVED = 0.9  # share of the way between the two at which it has
AROUND = (0.8, 1.25)  # times the speeds where rest is left: where most of a diagram's stand ...
SHARE = 0.75  # ... this share of them
COARSE = 0.05  # of a speed where rest is left: distance of the speeds about it that is said


def speeds_about(unstable: Sequence[float], low: float, high: float, points: int) -> list[float]:
    """Speeds of a diagram: most of them where branches begin and end, the others above."""
    if not unstable:
        return list(np.linspace(low, high, points).tolist())
    least, most = max(low, AROUND[0] * min(unstable)), min(high, AROUND[1] * max(unstable))
    if most >= high or points < 4:
        return list(np.linspace(least, high, points).tolist())
    near = round(SHARE * points)
    above = np.linspace(most, high, points - near + 1)[1:]
    return [*np.linspace(least, most, near).tolist(), *above.tolist()]


def unresolved(speeds: Sequence[float], unstable: Sequence[float]) -> str:
    """Remark on speeds of a diagram that are far apart about those where rest is left [m/s].

    A small motion that begins there and ends or jumps before the next speed is not seen.
    """
    gaps = [(b - a, v) for a, b in pairwise(speeds) for v in unstable if a <= v < b]
    wide = [(gap, v) for gap, v in gaps if gap > COARSE * v]
    if not wide:
        return ""
    gap, speed = max(wide)
    return (
        f"bifurcation: about {speed:.4g} m/s, where rest is left, its speeds are {gap:.2g} m/s "
        "apart: a motion of a narrower range may be missed (--points)"
    )


def diagram(
    motion: Motion,
    speeds: Sequence[float],
    tell: ramp.Progress = lambda _: None,
    excitations: Sequence[float] = ramp.EXCITATIONS,
    low: float | None = None,
) -> list[Branch]:
    """Bifurcation diagram by steps of speed upwards and then downwards with carried states.

    Further motions are sought from all disturbances at all speeds; speeds are added to the branches
    where they end or jump, to `RESOLUTION`.

    `speeds`: rising [m/s]; `excitations`: sizes of the disturbances [m]; `low`: speed to which
    motions that last below the lowest speed are followed, in steps as the first one [m/s]. Returns:
    branches up and down, then the others, at last the unstable motions between two branches. A
    branch upwards ends where the vehicle derails.
    """
    up, down = Branch("up"), Branch("down")
    for speed in speeds:
        try:
            last = up.points[-1] if up.points else None
            if last is None or last.amplitude < ramp.SMALL:  # where it rests, a small disturbance
                seen = settle(motion, motion.rest(speed, ramp.SMALL), speed, speed)
            else:
                seen = settle(motion, last.state, last.speed, speed)
            up.points.append(seen_at(speed, seen))
        except LeftRange:
            break
        tell(0.25 * len(up.points) / len(speeds))
    if not up.points:
        return [up, down]
    reached = [point.speed for point in up.points]
    lower = _below(speeds, speeds[0] if low is None else low)
    state, before = ramp.hunting(motion, reached[-1], excitations).state, reached[-1]
    for speed in [*reversed(reached), *lower]:
        if speed < reached[0] and down.points[-1].amplitude <= THRESHOLD:
            break
        try:
            seen = settle(motion, state, before, speed)
        except LeftRange:  # while it brakes
            seen = ramp.hunting(motion, speed, excitations)
        down.points.append(seen_at(speed, seen))
        state, before = down.points[-1].state, speed
        tell(0.25 * (1.0 + min(1.0, len(down.points) / len(speeds))))
    branches = [up, down]
    for number, speed in enumerate(reached):
        branches += _further(motion, branches, speed, excitations, lower)
        tell(0.5 + 0.25 * number / len(reached))
    up, down = (_refine(motion, branch) for branch in branches[:2])
    branches[:2] = up, down
    between = _threshold(motion, up, down, lambda share: tell(0.75 + 0.25 * share))
    return [*branches, *([between] if between.points else [])]


def _below(speeds: Sequence[float], low: float) -> list[float]:
    """Falling speeds below the first ones, in steps as that between these, down to `low`."""
    first, step = speeds[0], max(speeds[1] - speeds[0], RESOLUTION) if len(speeds) > 1 else 1.0
    found = np.arange(first - step, low + 0.5 * step, -step).tolist()
    return [*found, low] if first - low > 1e-9 else []


def settle(
    motion: Motion, state: Floats, begin: float, speed: float, known: Sequence[float] = ()
) -> Stretch:
    """Go from one speed to another, and there until the amplitude changes no more, or has died.

    `known`: amplitudes of motions at that speed, with 0 for rest: near these it need not settle
    [m].
    """
    state, before = ramp.at_speed(motion, state, begin, speed), np.inf
    dead = THRESHOLD if 0.0 in known else 0.02 * THRESHOLD
    lasting, turned, grew = 0, 0, False
    for look in count(1):
        seen = ramp.looked_at(motion, state, speed, SETTLING)
        change = abs(seen.amplitude - before) / max(seen.amplitude, 1e-12)
        near = any(abs(a - seen.amplitude) < NEAR * a for a in known)
        if change < 0.1 * ramp.CHANGE or (near and change < 0.5 * ramp.CHANGE):
            break
        if seen.amplitude < dead and seen.amplitude < before:
            break
        if (seen.amplitude > before) != grew:
            turned, grew = look, not grew
        if look - turned >= ONE_WAY:
            lasting = look
        if look - lasting >= MOST_SETTLING:
            break
        state, before = seen.state, seen.amplitude
    return seen


def _is_known(point: Point, branches: Sequence[Branch]) -> bool:
    """Whether it is rest, or one of the branches has a motion of its amplitude at its speed."""
    return point.amplitude < THRESHOLD or any(
        abs(known - point.amplitude) <= ALIKE * max(known, point.amplitude)
        for known in _amplitudes(branches, point.speed)
    )


def _amplitudes(branches: Sequence[Branch], speed: float) -> list[float]:
    """Amplitudes of all motions at a speed, 0 for rest."""
    points = [point for branch in branches for point in branch.points if point.speed == speed]
    return [0.0, *(point.amplitude for point in points)]


def _further(
    motion: Motion,
    branches: Sequence[Branch],
    speed: float,
    excitations: Sequence[float],
    lower: Sequence[float],
) -> list[Branch]:
    """Branches of motions at a speed that no branch has, followed to both sides.

    `lower`: falling speeds below those of the branch upwards [m/s].
    """
    speeds = [point.speed for point in branches[0].points]
    below = [*(v for v in speeds[::-1] if v < speed), *lower]
    above = [v for v in speeds if v > speed]
    found: list[Branch] = []
    for size in excitations:
        known = _amplitudes([*branches, *found], speed)
        try:
            here = seen_at(speed, settle(motion, motion.rest(speed, size), speed, speed, known))
        except LeftRange:
            continue
        if not _is_known(here, [*branches, *found]):
            down, up = (_follow(motion, branches, here, side) for side in (below, above))
            found.append(Branch("further", [*down[:0:-1], *up]))
    return found


def _follow(
    motion: Motion, branches: Sequence[Branch], start: Point, speeds: Sequence[float]
) -> list[Point]:
    """A motion followed over several speeds, to the first that is known or dead."""
    points = [start]
    for speed in speeds:
        try:
            seen = settle(motion, points[-1].state, points[-1].speed, speed)
        except LeftRange:
            break
        points.append(seen_at(speed, seen))
        if _is_known(points[-1], branches):
            break
    return _refine(motion, Branch("further", points)).points


def _refine(motion: Motion, branch: Branch) -> Branch:
    """The branch with more speeds where its amplitude changes much, as it does at its ends.

    Where rest loses its stability no more are needed: the eigenvalues tell that speed.
    """
    points = branch.points[:1]
    for before, after in pairwise(branch.points):
        points += [*_between(motion, before, after), after]
    return Branch(branch.direction, points)


def _between(motion: Motion, before: Point, after: Point) -> list[Point]:
    """Points between two found in this order, so many that no jump is wider than `RESOLUTION`."""
    near = abs(after.speed - before.speed) <= RESOLUTION
    if near or before.amplitude < THRESHOLD or not far_apart(before.amplitude, after.amplitude):
        return []
    middle = 0.5 * (before.speed + after.speed)
    # near a fold what dies does so slowly: where rest follows, it is not waited for to the last
    known = [0.0] if after.amplitude < THRESHOLD else []
    try:
        here = seen_at(middle, settle(motion, before.state, before.speed, middle, known))
    except LeftRange:
        return []
    return [*_between(motion, before, here), here, *_between(motion, here, after)]


def _threshold(motion: Motion, up: Branch, down: Branch, tell: ramp.Progress) -> Branch:
    """Unstable motions between the branch upwards and the one downwards where both are followed."""
    line = Branch("threshold")
    differ = [
        point.speed
        for point in down.points
        if point.amplitude > THRESHOLD and up.amplitude_at(point.speed) < DROP * point.amplitude
    ]
    if len(differ) < 2:
        return line
    inside = np.linspace(min(differ), max(differ), THRESHOLDS + 2)[1:-1].tolist()
    for number, speed in enumerate(inside):
        near = [branch.nearest(speed) for branch in (down, up)]
        try:
            upper, lower = (settle(motion, one.state, one.speed, speed) for one in near)
        except LeftRange:
            continue
        if lower.amplitude < DROP * upper.amplitude:
            seen = _unstable(motion, speed, lower, upper)
            if abs(seen.amplitude - lower.amplitude) > ALIKE * lower.amplitude:  # not left at once
                line.points.append(seen_at(speed, seen, stable=False))
        tell((number + 1) / THRESHOLDS)
    return line


def _unstable(motion: Motion, speed: float, lower: Stretch, upper: Stretch) -> Stretch:
    """What a run does at first whose disturbance is just too small for the larger of two motions.

    The disturbance has the shape of that motion.  The unstable motion that it is near to is
    left within a second or two, for the one or the other.
    """
    rest = motion.rest(speed, 0.0)
    way = upper.amplitude - lower.amplitude
    least, most, below = lower.amplitude / upper.amplitude, 1.0, lower
    for _ in range(HALVINGS):
        share = 0.5 * (least + most)
        state, first = rest + share * (upper.state - rest), None
        for _ in range(MOST_LINGERING):
            try:
                seen = motion.stretch(state, speed, speed, ramp.WINDOW)
            except LeftRange:  # further than the larger motion
                seen = upper
                break
            first, state = first or seen, seen.state
            if abs(seen.amplitude - lower.amplitude - 0.5 * way) > (ARRIVED - 0.5) * way:
                break
        if seen.amplitude > lower.amplitude + 0.5 * way:
            most = share
        else:
            least, below = share, first or seen
    return below
