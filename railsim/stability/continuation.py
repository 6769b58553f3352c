"""Branches of periodic motions of a vehicle, followed by shooting from every motion that is known.

One begins where rest loses its stability, others on the branches that runs have found, near their
slow ends: there the stable motion meets an unstable one and turns back.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np

from railsim.errors import ModelError
from railsim.linear.stability_loss import LossOfStability
from railsim.stability.branches import RESOLUTION, Branch, Point
from railsim.stability.motion import LeftRange, VehicleMotion
from railsim.stability.periodic import PeriodicMotion, Shooting
from railsim.stability.vehicle_flow import VehicleFlow

Progress = Callable[[float], None]

LARGEST_AMPLITUDE = 12e-3  # m, at which a branch is followed no further
ARC_STEP = 1.5  # units of the arc length, about 1 mm or 1 m/s
MOST_MOTIONS = 20  # of one branch
FIRST = 0.2e-3  # m, amplitude at which a branch's first shape is taken, and below which it ends
FROM_END = 1.0  # m/s above the slow end of a branch of runs, where its motion is taken
OBSERVED = 10.0  # s of a run that tells why none is periodic
RUNS = ("up", "down", "further")  # branches of runs
COVERED = 0.2  # relative difference of amplitudes within which a motion is on a known line ...
SAME = 0.03, 0.005  # ... and of amplitude and frequency within which it is the same motion
APART = 0.01  # relative difference of frequencies with which two bogies hunt each for itself


@dataclass
class Continued:
    """What continuation found."""

    branches: list[Branch] = field(default_factory=list)
    # of the branch that begins where rest loses its stability the first motion at another speed
    begins: Point | None = None
    # where the branches turn back in speed, stable where one of the two motions beside it is
    folds: list[Point] = field(default_factory=list)
    # which were not followed, or not to their end, and why
    remarks: list[str] = field(default_factory=list)


def followed_branches(
    motion: VehicleMotion,
    lost: LossOfStability,
    branches: Sequence[Branch],
    speeds: tuple[float, float],
    progress: Progress,
) -> Continued:
    """Follow the branch that begins at the loss of stability, and those that runs have found.

    `lost`: of rest, with the runs' own creep law; `known`: branches of runs; `speeds`: range [m/s].
    """
    found = Continued()
    pieces = [piece for one in branches if one.direction in RUNS for piece in one.pieces()]
    pieces.sort(key=lambda piece: piece[0].speed)  # of two on one branch first the longer one

    def telling(number: int) -> Progress:
        return lambda share: progress((number + share) / (1.0 + len(pieces)))

    if lost.parameter is None:
        found.remarks.append("continuation: no loss of stability at which it could begin")
    else:
        born = partial(_birth, motion, lost)
        _follow(found, born, speeds, "the branch of small motions", telling(0), pieces)
        for branch in found.branches:
            away = (p for p in branch.points if abs(p.speed - lost.parameter) > 0.5 * RESOLUTION)
            found.begins = next(away, branch.points[0])
    tried: list[Sequence[Point]] = []
    for number, piece in enumerate(pieces, start=1):
        tell = telling(number)
        tell(0.0)
        seed = next((p for p in piece if p.speed >= piece[0].speed + FROM_END), piece[-1])
        lines = [*(branch.points for branch in found.branches), *tried]
        passed = (amplitude for line in lines for amplitude, _ in _passed_at(line, seed.speed))
        near = COVERED * seed.amplitude
        if seed.amplitude < FIRST or any(abs(one - seed.amplitude) < near for one in passed):
            continue
        tried.append(piece)
        name = (
            f"the branch of runs from {piece[0].speed:.4g} to {piece[-1].speed:.4g} m/s, "
            f"{1e3 * seed.amplitude:.2f} mm at {seed.speed:.4g} m/s,"
        )
        _follow(found, partial(_motion_near, motion, seed), speeds, name, tell, pieces)
    return found


def settled_to(branch: Branch, pieces: Sequence[Sequence[Point]]) -> Branch:
    """The branch with the motions stable that runs settle to, whatever their multipliers.

    Of contacts that come and go within a step difference quotients give no multipliers.  Amplitude
    and frequency have to be those of the run: with the bogies in another phase a motion is another
    one, and unstable as its multipliers say.
    """

    def seen_in_runs(point: Point) -> bool:
        return any(
            abs(amplitude - point.amplitude) < SAME[0] * point.amplitude
            and abs(frequency - point.frequency) < SAME[1] * point.frequency
            for piece in pieces
            for amplitude, frequency in _passed_at(piece, point.speed)
        )

    return Branch(
        branch.direction,
        [replace(point, stable=point.stable or seen_in_runs(point)) for point in branch.points],
    )


def _follow(
    continued: Continued,
    start: Callable[[], tuple[Shooting, PeriodicMotion]],
    speeds: tuple[float, float],
    name: str,
    tell: Progress,
    pieces: Sequence[Sequence[Point]],
) -> None:
    """Add the branch from a motion on, or a remark on why it ends."""
    points: list[Point] = []
    turns: list[tuple[int, Point]] = []  # folds, and the number of motions before each

    def within(now: PeriodicMotion) -> bool:
        inside = speeds[0] < now.speed < speeds[1] and now.amplitude < LARGEST_AMPLITUDE
        return inside and len(points) < MOST_MOTIONS

    try:
        shooting, before = start()
    except (ModelError, LeftRange) as error:
        continued.remarks.append(f"continuation: {name} is not followed: {error}")
        return
    try:
        for now in shooting.motions(before, ARC_STEP, within):
            rests = now.amplitude < min(FIRST, before.amplitude)
            if before.tangent[-1] * now.tangent[-1] < 0.0 and not rests:
                turns.append((len(points), _point(shooting.fold(before, now))))
            points.append(_point(now))
            tell(len(points) / MOST_MOTIONS)
            before = now
            if rests:  # beyond it the same motions follow, half a period later
                break
    except ModelError as error:
        continued.remarks.append(
            f"continuation: {name} is followed to {before.speed:.4g} m/s only: {error}"
        )
    if len(points) >= MOST_MOTIONS:
        continued.remarks.append(
            f"continuation: {name} is followed for {MOST_MOTIONS} motions only, "
            f"to {before.speed:.4g} m/s"
        )
    if points:
        branch = settled_to(Branch("continuation", points), pieces)
        continued.branches.append(branch)
        for number, fold in turns:
            beside = branch.points[max(0, number - 1) : number + 1]
            continued.folds.append(replace(fold, stable=any(point.stable for point in beside)))


def _point(motion: PeriodicMotion) -> Point:
    return Point(motion.speed, motion.amplitude, motion.frequency, stable=motion.is_stable)


def _passed_at(line: Sequence[Point], speed: float) -> Iterator[tuple[float, float]]:
    """Amplitudes and frequencies with which a line, which may turn back, passes a speed."""
    for before, after in pairwise(line):
        share = (speed - before.speed) / ((after.speed - before.speed) or np.inf)
        if 0.0 <= share <= 1.0:
            yield (
                before.amplitude + share * (after.amplitude - before.amplitude),
                before.frequency + share * (after.frequency - before.frequency),
            )


def _motion_near(motion: VehicleMotion, seed: Point) -> tuple[Shooting, PeriodicMotion]:
    """The periodic motion nearest to one of a run."""
    if not np.isfinite(seed.frequency):
        raise ModelError("the runs show no period")
    period, flow = 1.0 / seed.frequency, VehicleFlow(motion, seed.speed)
    state = flow.reduce(seed.state)
    scale = flow.scale(state, period, seed.speed, seed.amplitude)
    shooting = Shooting(flow, scale, period_scale=0.05 * period, speed_scale=1.0)
    try:
        return shooting, shooting.nearest(state, period, seed.speed)
    except ModelError:
        raise ModelError(f"{_why(motion, seed)}; its ends are those of the runs") from None


def _why(motion: VehicleMotion, seed: Point) -> str:
    """Why no periodic motion was found near to that of a run."""
    seen = motion.stretch(seed.state, seed.speed, seed.speed, OBSERVED)
    travel = 0.5 * np.ptp(seen.lateral, axis=0)
    rates = [
        replace(seen, lateral=seen.lateral[:, [w]]).frequency
        for w in np.flatnonzero(travel > FIRST)
    ]
    if np.ptp(rates) > APART * np.max(rates):
        words = ", ".join(f"{rate:.2f}" for rate in rates)
        return f"its motion is not periodic: the wheelsets hunt with {words} Hz"
    return "its motion is not periodic to the accuracy of shooting"


def _birth(motion: VehicleMotion, lost: LossOfStability) -> tuple[Shooting, PeriodicMotion]:
    """The branch at the bifurcation; its first shape is that of a small motion in the time loop."""
    if motion.prepared.sticking:
        raise ModelError(
            "friction elements that stick keep any force, so that no periodic motion stands alone "
            "(ramp and bifurcation find what runs settle to)"
        )
    speed = float(lost.parameter or 0.0)
    frequency = float(lost.modes[0].frequencies[0])
    period = 1.0 / frequency
    # hunting may be in the shape of another mode, in which nothing would be left but what dies out
    motion = VehicleMotion(motion.prepared, motion.scheme, lost.modes[0])
    # the scheme's memory settles
    state = motion.stretch(motion.rest(speed, FIRST), speed, speed, 2.0 * period).state
    flow = VehicleFlow(motion, speed)
    rest = flow.reduce(motion.prepared.steady(speed))
    begin = flow.reduce(state) - rest
    quarter = flow.after((rest + begin)[None], np.array([0.25 * period]), np.array([speed]))[0]
    scale = flow.scale(rest + begin, period, speed, FIRST)
    shooting = Shooting(flow, scale, period_scale=0.05 * period, speed_scale=1.0)
    return shooting, shooting.beginning(rest, begin - 1j * (quarter - rest), frequency, speed)
