"""Branches of periodic motions of a vehicle, followed by shooting from every motion that is known.

One begins where rest loses its stability, others at the ends of the branches that runs have found:
there the stable motion meets an unstable one and turns back.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from railsim.errors import ModelError
from railsim.linear.eigenmodes import LossOfStability
from railsim.stability.motion import VehicleMotion
from railsim.stability.periodic import Branch, PeriodicMotion
from railsim.stability.ramp import Diagram, Sustained
from railsim.stability.vehicle_flow import VehicleFlow

Progress = Callable[[float], None]
Start = Callable[[], tuple[Branch, PeriodicMotion] | None]

LARGEST_AMPLITUDE = 12e-3  # m, at which a branch is followed no further
ARC_STEP = 1.0  # units of the arc length, about 1 mm or 1 m/s
MOST_MOTIONS = 30  # of one branch
FIRST = 0.2e-3  # m, amplitude at which a branch's first shape is taken
RUNS = ("down", "further")  # branches of which the slowest motion begins another line
COVERED = 0.05  # relative difference of amplitudes within which a motion is on a known line


class _Line:
    """One branch as it is followed: its motions, and those where it turns back in speed."""

    def __init__(self) -> None:
        self.points = Diagram("continuation")
        self.folds: list[Sustained] = []
        self.remark = ""

    def follow(
        self, branch: Branch, start: PeriodicMotion, within: Callable[[PeriodicMotion], bool]
    ) -> None:
        """Append the motions from `start` on while they are `within`."""
        before = start
        try:
            for now in branch.followed(start, ARC_STEP, within):
                if before.tangent[-1] * now.tangent[-1] < 0.0 and before.amplitude > 0.0:
                    length = float(np.linalg.norm(now.tangent)) * ARC_STEP
                    fold = branch.fold(before, now, length)
                    self.folds.append(Sustained(fold.speed, fold.amplitude, fold.frequency))
                self.append(now)
                before = now
        except ModelError as error:
            self.remark = f"continuation: ended at {before.speed:.4g} m/s: {error}"

    def append(self, now: PeriodicMotion) -> None:
        """Add one motion."""
        line = self.points
        line.speed.append(now.speed)
        line.amplitude.append(now.amplitude)
        line.frequency.append(now.frequency)
        line.sum_Y_rms.append(float("nan"))
        line.stable.append(now.is_stable)


def followed_branches(
    motion: VehicleMotion,
    lost: LossOfStability,
    known: Sequence[Diagram],
    speeds: tuple[float, float],
    progress: Progress,
) -> tuple[list[Diagram], list[Sustained], list[str]]:
    """Follow the branch that begins at the loss of stability, and those that runs have found.

    Parameters
    ----------
    motion : VehicleMotion
    lost : LossOfStability
        Of rest, with the runs' own creep law.
    known : sequence of Diagram
        Branches of runs.
    speeds : tuple of 2 floats
        Range [m/s].
    progress : callable

    Returns
    -------
    list of Diagram, list of Sustained, list of str
        The branches, the first one that of the small motions; folds; remarks.
    """
    lines: list[_Line] = []
    starts: list[Start] = [] if lost.parameter is None else [partial(_birth, motion, lost)]
    remarks = [] if starts else ["continuation: no loss of stability at which it could begin"]
    starts += [partial(_at_end, motion, one) for one in known if one.direction in RUNS]
    for number, start in enumerate(starts):
        line = _Line()

        def within(now: PeriodicMotion, line: _Line = line, number: int = number) -> bool:
            share = len(line.points.speed) / MOST_MOTIONS
            progress(min(0.99, (number + share) / len(starts)))
            inside = speeds[0] < now.speed < speeds[1] and now.amplitude < LARGEST_AMPLITUDE
            return inside and len(line.points.speed) < MOST_MOTIONS

        try:
            found = start()
        except ModelError as error:
            remarks.append(f"continuation: {error}")
            continue
        if found is None or _is_covered(found[1], [one.points for one in lines]):
            continue
        line.follow(*found, within)
        remarks += [line.remark] if line.remark else []
        lines.append(line)
    folds = [fold for line in lines for fold in line.folds]
    return [line.points for line in lines], folds, remarks


def _is_covered(motion: PeriodicMotion, lines: Sequence[Diagram]) -> bool:
    """Whether a line passes a motion."""
    for line in lines:
        for before, after in pairwise(range(len(line.speed))):
            low, high = sorted((line.speed[before], line.speed[after]))
            if low <= motion.speed <= high:
                near = np.interp(
                    motion.speed,
                    (low, high),
                    sorted((line.amplitude[before], line.amplitude[after])),
                )
                if abs(near - motion.amplitude) < COVERED * motion.amplitude:
                    return True
    return False


def _at_end(motion: VehicleMotion, branch: Diagram) -> tuple[Branch, PeriodicMotion] | None:
    """The periodic motion at the slowest point of a branch of runs; None near rest."""
    alive = branch.alive
    k = min(alive, key=lambda number: branch.speed[number]) if alive else 0
    if not alive or branch.amplitude[k] < FIRST or not np.isfinite(branch.frequency[k]):
        return None
    speed, period = branch.speed[k], 1.0 / branch.frequency[k]
    flow = VehicleFlow(motion, speed)
    state = flow.reduced(branch.states[k])
    scale = flow.scale(state, period, speed, branch.amplitude[k])
    line = Branch(flow, scale, period_scale=0.05 * period, speed_scale=1.0)
    try:
        return line, line.nearest(state, period, speed)
    except ModelError:
        raise ModelError(
            f"the motion of {1e3 * branch.amplitude[k]:.2f} mm at {speed:.4g} m/s is not "
            "periodic to the accuracy of shooting: its branch is that of the runs"
        ) from None


def _birth(motion: VehicleMotion, lost: LossOfStability) -> tuple[Branch, PeriodicMotion]:
    """The branch at the bifurcation; its first shape is that of a small motion in the time loop."""
    speed = float(lost.parameter or 0.0)
    flow = VehicleFlow(motion, speed)
    frequency = float(lost.modes[0].frequencies[0])
    period = 1.0 / frequency
    # the scheme's memory settles
    state = motion.stretch(motion.rest(speed, FIRST), speed, speed, 2.0 * period).state
    rest = flow.reduced(motion.prepared.steady(speed).state)
    begin = flow.reduced(state) - rest
    quarter = flow.after((rest + begin)[None], np.array([0.25 * period]), np.array([speed]))[0]
    scale = flow.scale(rest + begin, period, speed, FIRST)
    branch = Branch(flow, scale, period_scale=0.05 * period, speed_scale=1.0)
    return branch, branch.beginning(rest, begin - 1j * (quarter - rest), frequency, speed)
