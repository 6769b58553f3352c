"""Bifurcation diagrams by runs at constant speed: every motion that a vehicle settles to.

Steps of speed upwards from a small disturbance and downwards from the largest motion, disturbances
of several sizes at every step, and a closer look where a branch ends or jumps.  Where two motions
are possible at a speed, the disturbance that decides between them is bisected: a run from there
begins near the unstable motion between them.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from railsim.stability.motion import LeftRange, Motion, Stretch
from railsim.stability.ramp import (
    CHANGE,
    EXCITATIONS,
    RESOLUTION,
    SMALL,
    THRESHOLD,
    WINDOW,
    Diagram,
    Floats,
    Progress,
    Sustained,
    hunting,
    lowest_on,
    moved,
)

DROP = 0.75  # ratio of neighbouring amplitudes of a branch between which it may jump
DEATH = 0.5  # the same of small amplitudes
ALIKE = 0.1  # relative difference of two amplitudes at a speed that count as one motion
SETTLING = 2.0  # s between looks at a step of a diagram
MOST_SETTLING = 60  # looks; 1 m/s above a critical speed a coach's hunting grows by 0.1/s
SMALLEST_JUMP = 0.5e-3  # m; less is the growth of small motions from nothing
THRESHOLDS = 4  # speeds between the ends of two branches at which the unstable motion is sought
HALVINGS = 6  # of the disturbance there
MOST_LINGERING = 20  # s of a run that decides for one of two motions
ARRIVED = 0.9  # share of the way between the two at which it has


def settled(motion: Motion, state: Floats, begin: float, speed: float) -> Stretch:
    """Go from one speed to another, and there until the amplitude changes no more, or has died."""
    state, before = moved(motion, state, begin, speed), np.inf
    for _ in range(MOST_SETTLING):
        seen = motion.stretch(state, speed, speed, SETTLING)
        if abs(seen.amplitude - before) < 0.1 * CHANGE * seen.amplitude:
            break
        if seen.amplitude < 0.02 * THRESHOLD and seen.amplitude < before:
            break
        state, before = seen.state, seen.amplitude
    return seen


def diagram(
    motion: Motion,
    speeds: Sequence[float],
    progress: Progress | None = None,
    *,
    excitations: Sequence[float] = EXCITATIONS,
    closer: bool = False,
) -> tuple[list[Diagram], Sustained]:
    """Bifurcation diagram by steps of speed upwards and then downwards with carried states.

    Parameters
    ----------
    motion : Motion
    speeds : sequence of float
        Rising [m/s].
    excitations : sequence of float
        Sizes of the disturbances [m].
    closer : bool
        Look for further motions from all disturbances at all speeds, add speeds to the branches
        where they end or jump, to `RESOLUTION`, and the unstable motions between two branches.

    Returns
    -------
    list of Diagram, Sustained
        Branches up and down, then the others, and the lowest speed at which an oscillation
        sustains itself.  A branch upwards ends where the vehicle derails.
    """
    tell = progress or (lambda _: None)
    up, down = Diagram("up"), Diagram("down")
    part = 0.25 if closer else 0.5
    for speed in speeds:
        try:
            up.add(speed, _upwards(motion, up, speed))
        except LeftRange:
            break
        tell(part * len(up.speed) / len(speeds))
    if not up.speed:
        return [up, down], Sustained(None)
    state, before = hunting(motion, up.speed[-1], excitations).state, up.speed[-1]
    for speed in reversed(up.speed):
        down.add(speed, settled(motion, state, before, speed))
        state, before = down.states[-1], speed
        tell(part * (1.0 + len(down.speed) / len(speeds)))
    if not closer:
        return [up, down], lowest_on(motion, down, speeds[0])
    branches = [up, down]
    for number, speed in enumerate(up.speed):
        branches += _further(motion, branches, speed, excitations)
        tell(0.5 + 0.25 * number / len(up.speed))
    branches = [_closer(motion, branch) for branch in branches]
    between = _thresholds(motion, branches, lambda share: tell(0.75 + 0.25 * share))
    return branches + between, lowest_of(branches, speeds[0])


def lowest_of(branches: Sequence[Diagram], low: float) -> Sustained:
    """The lowest speed of all branches at which an oscillation sustains itself."""
    found = [(branch.speed[k], branch, k) for branch in branches for k in branch.alive]
    if not found:
        return Sustained(None)
    speed, branch, k = min(found, key=lambda one: one[0])
    return Sustained(speed, branch.amplitude[k], branch.frequency[k], below=speed <= low)


def _upwards(motion: Motion, up: Diagram, speed: float) -> Stretch:
    """The next motion upwards; where the last one rests, from a small disturbance."""
    if not up.speed or up.amplitude[-1] < SMALL:
        return settled(motion, motion.rest(speed, SMALL), speed, speed)
    return settled(motion, up.states[-1], up.speed[-1], speed)


def _is_known(amplitude: float, branches: Sequence[Diagram], speed: float) -> bool:
    """Whether one of the branches has a motion of this amplitude at a speed."""
    for branch in branches:
        for k, v in enumerate(branch.speed):
            known = branch.amplitude[k]
            if v == speed and abs(known - amplitude) <= ALIKE * max(known, amplitude):
                return True
    return amplitude < THRESHOLD


def _further(
    motion: Motion, branches: Sequence[Diagram], speed: float, excitations: Sequence[float]
) -> list[Diagram]:
    """Branches of motions at a speed that no branch has, followed to both sides."""
    speeds = branches[0].speed
    found: list[Diagram] = []
    for size in excitations:
        try:
            seen = settled(motion, motion.rest(speed, size), speed, speed)
        except LeftRange:
            continue
        if _is_known(seen.amplitude, [*branches, *found], speed):
            continue
        sides = []
        for side in ([v for v in reversed(speeds) if v < speed], [v for v in speeds if v > speed]):
            sides.append(_followed(motion, branches, seen.state, [speed, *side]))
        here = Diagram("further")
        here.add(speed, seen)
        found.append(sides[0].taken(range(len(sides[0].speed))[::-1]) + here + sides[1])
    return found


def _followed(
    motion: Motion, branches: Sequence[Diagram], state: Floats, speeds: Sequence[float]
) -> Diagram:
    """A branch from the first of several speeds on, to its first motion that is known or dead."""
    line = Diagram("further")
    for before, speed in pairwise(speeds):
        try:
            seen = settled(motion, state, before, speed)
        except LeftRange:
            break
        line.add(speed, seen)
        state = seen.state
        if _is_known(seen.amplitude, branches, speed):
            break
    return line


def _closer(motion: Motion, branch: Diagram) -> Diagram:
    """The branch with more speeds where its amplitude changes much, as it does at its ends.

    Where rest loses its stability no more are needed: the eigenvalues tell that speed.
    """
    line = Diagram(branch.direction)
    for k in range(len(branch.speed)):
        if k:
            line = line + _between(motion, branch.taken([k - 1, k]))
        line = line + branch.taken([k])
    return line


def _between(motion: Motion, ends: Diagram) -> Diagram:
    """Points between two neighbouring ones, so many that no jump is wider than `RESOLUTION`."""
    none = Diagram(ends.direction)
    source = int(ends.direction == "further" and ends.amplitude[1] > ends.amplitude[0])
    if abs(ends.speed[1] - ends.speed[0]) <= RESOLUTION or ends.amplitude[source] < THRESHOLD:
        return none
    if not _far_apart(*ends.amplitude):
        return none
    middle = 0.5 * (ends.speed[0] + ends.speed[1])
    try:
        seen = settled(motion, ends.states[source], ends.speed[source], middle)
    except LeftRange:
        return none
    here = Diagram(ends.direction)
    here.add(middle, seen)
    before, after = ends.taken([0]) + here, here + ends.taken([1])
    return _between(motion, before) + here + _between(motion, after)


def _far_apart(one: float, other: float) -> bool:
    """Whether two amplitudes may belong to different motions."""
    share = DROP if abs(one - other) > SMALLEST_JUMP else DEATH
    return min(one, other) < share * max(one, other)


def _thresholds(motion: Motion, branches: Sequence[Diagram], tell: Progress) -> list[Diagram]:
    """Unstable motions between the branch upwards and the one downwards where both go on."""
    up, down = branches[:2]
    differ = [
        v
        for v, a in zip(down.speed, down.amplitude, strict=True)
        if a > THRESHOLD and _at(up, v)[1] < DROP * a
    ]
    if len(differ) < 2:
        return []
    line = Diagram("threshold")
    ends = min(differ), max(differ)
    for number, speed in enumerate(np.linspace(*ends, THRESHOLDS + 2)[1:-1].tolist()):
        try:
            upper, lower = (
                settled(motion, branch.states[k], branch.speed[k], speed)
                for branch in (down, up)
                for k in _at(branch, speed)[:1]
            )
        except LeftRange:
            continue
        if lower.amplitude < DROP * upper.amplitude:
            seen = _unstable(motion, speed, lower, upper)
            line.add(speed, seen)
            line.stable[-1] = False
        tell((number + 1) / THRESHOLDS)
    return [line] if line.speed else []


def _at(branch: Diagram, speed: float) -> tuple[int, float]:
    """Number of the nearest point of a branch, and its amplitude there, between its points."""
    order = np.argsort(branch.speed)
    speeds, amplitudes = np.array(branch.speed)[order], np.array(branch.amplitude)[order]
    nearest = int(np.argmin(np.abs(np.array(branch.speed) - speed)))
    return nearest, float(np.interp(speed, speeds, amplitudes))


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
                seen = motion.stretch(state, speed, speed, WINDOW)
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


def jumps(branches: Sequence[Diagram]) -> list[dict[str, Any]]:
    """Speeds at which a branch ends and the motion goes over to another, or to rest.

    Returns
    -------
    list of dict
        ``direction`` of the change of speed, ``speed`` of the last motion before [m/s],
        ``amplitude`` there and ``to``, that of the motion after [m].
    """
    found: list[dict[str, Any]] = []
    for branch in branches:
        if branch.direction not in ("up", "down"):
            continue
        points = list(zip(branch.speed, branch.amplitude, strict=True))
        for (speed, before), (other, after) in pairwise(points):
            is_jump = abs(after - before) > SMALLEST_JUMP and abs(other - speed) <= RESOLUTION
            if is_jump and _far_apart(before, after):
                found.append(
                    {
                        "direction": branch.direction,
                        "speed": speed,
                        "amplitude": before,
                        "to": after,
                    }
                )
    return found
