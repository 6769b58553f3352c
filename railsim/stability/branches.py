"""Branches of a bifurcation diagram: motions over speed, and where they end, jump or pass a limit.

The non-linear critical speed is the lowest at which an oscillation sustains itself on ideal track:
the lowest end of all branches.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.stability.motion import Stretch

THRESHOLD = 0.05e-3  # m, amplitude below which nothing hunts
RESOLUTION = 0.1  # m/s, of ends and jumps
DROP = 0.75  # ratio of neighbouring amplitudes of a branch between which it may jump
DEATH = 0.5  # the same of small amplitudes
SMALLEST_JUMP = 0.5e-3  # m; less is the growth of small motions from nothing
COLUMNS = ("speed", "amplitude", "frequency", "sum_Y_rms", "stable")


@dataclass(frozen=True)
class Point:
    """One motion of a branch."""

    speed: float  # [m/s]
    amplitude: float  # lateral, of the wheelset that moves most [m]
    frequency: float  # [Hz]
    sum_Y_rms: float = float("nan")  # largest of a wheelset's lateral force [N]
    stable: bool = True  # whether a run stays at it
    state: Floats = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    @property
    def hunts(self) -> bool:
        """Whether it is an oscillation that sustains itself."""
        return self.stable and self.amplitude > THRESHOLD

    def record(self) -> dict[str, Any]:
        """Return speed, amplitude, frequency and whether it is stable as plain data."""
        return {name: getattr(self, name) for name in (*COLUMNS[:3], COLUMNS[-1])}


def seen_at(speed: float, seen: Stretch, *, stable: bool = True) -> Point:
    """Return the motion that a stretch at a speed [m/s] shows."""
    return Point(speed, seen.amplitude, seen.frequency, seen.sum_Y_rms, stable, seen.state)


@dataclass
class Branch:
    """One branch of a bifurcation diagram."""

    direction: str  # how it was found
    points: list[Point] = field(default_factory=list)  # in the order in which they were found
    end: float = 0.0  # of a ramp the speed below which its motions only die [m/s]

    def column(self, name: str) -> Floats:
        """Return one of `COLUMNS` at all points."""
        return np.array([getattr(point, name) for point in self.points], dtype=float)

    @property
    def alive(self) -> list[Point]:
        """The points with an oscillation that sustains itself."""
        return [point for point in self.points if point.hunts]

    def amplitude_at(self, speed: float) -> float:
        """Amplitude at a speed, between the points too [m]."""
        order = np.argsort(self.column("speed"))
        return float(np.interp(speed, self.column("speed")[order], self.column("amplitude")[order]))

    def nearest(self, speed: float) -> Point:
        """The point nearest to a speed [m/s]."""
        return min(self.points, key=lambda point: abs(point.speed - speed))

    def pieces(self) -> list[list[Point]]:
        """Points of stable hunting without a jump between them, by rising speed."""
        found: list[list[Point]] = []
        before: Point | None = None
        for point in sorted(self.alive, key=lambda one: one.speed):
            if before is None or far_apart(before.amplitude, point.amplitude):
                found.append([])
            found[-1].append(point)
            before = point
        return found

    def record(self) -> dict[str, Any]:
        """Return the branch as plain data."""
        columns = {name: [getattr(point, name) for point in self.points] for name in COLUMNS}
        return {"direction": self.direction, **columns}


@dataclass(frozen=True)
class Jump:
    """Where a branch ends and the motion changes to another, or to rest."""

    direction: str  # of the change of speed
    speed: float  # of the last motion before [m/s]
    amplitude: float  # of that motion [m]
    to: float  # amplitude of the motion after, 0 of rest [m]


@dataclass(frozen=True)
class Limit:
    """The lowest speed of stable hunting beyond a limit."""

    speed: float | None  # [m/s]; None where the limit is not reached
    limit: float  # [m] or [N]
    reached: bool
    searched_to: float  # highest speed of the search [m/s]


def far_apart(one: float, other: float) -> bool:
    """Whether two amplitudes may belong to different motions."""
    return min(one, other) < (DROP if abs(one - other) > SMALLEST_JUMP else DEATH) * max(one, other)


def lowest_of(branches: Sequence[Branch]) -> Point | None:
    """The slowest motion of all branches that sustains itself, None where there is none."""
    alive = [point for branch in branches for point in branch.alive]
    return min(alive, key=lambda point: point.speed, default=None)


def jumps(branches: Sequence[Branch]) -> list[Jump]:
    """Return the jumps of the branches upwards and downwards."""
    found = []
    for branch in branches:
        if branch.direction not in ("up", "down"):
            continue
        for before, after in pairwise(branch.points):
            wide = abs(after.amplitude - before.amplitude) > SMALLEST_JUMP
            near = abs(after.speed - before.speed) <= RESOLUTION
            if wide and near and far_apart(before.amplitude, after.amplitude):
                to = after.amplitude if after.hunts else 0.0
                found.append(Jump(branch.direction, before.speed, before.amplitude, to))
    return found


def first_beyond(branches: Sequence[Branch], limit: float, column: str, high: float) -> Limit:
    """Return where stable hunting first exceeds a limit, between the points of a branch too."""
    beyond = [speed for branch in branches for speed in _beyond(branch.points, limit, column)]
    return Limit(min(beyond, default=None), limit, bool(beyond), high)


def _beyond(points: Sequence[Point], limit: float, column: str) -> Iterator[float]:
    alone = zip(points, points, strict=True)
    for point, neighbour in [*alone, *pairwise(points), *pairwise(points[::-1])]:
        value, other = getattr(point, column), getattr(neighbour, column)
        if point.hunts and value > limit:
            yield point.speed
            # the branch passes the limit between them, if both are on it
            jumps_between = far_apart(point.amplitude, neighbour.amplitude)
            if neighbour.hunts and other <= limit and not jumps_between:
                share = (limit - other) / (value - other)
                yield neighbour.speed + share * (point.speed - neighbour.speed)
