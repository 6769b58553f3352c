"""Cams of several arcs: transitions of the roller from arc to arc, and every arc alone.

Tangent arcs touch, so that equal positions are a double root (ill-conditioned) and equal rates a
simple one: the change is where the rates agree, and the gap that is left there is reported.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from railsim.definitions.mechanism.parts import Cam
from railsim.errors import InputError
from railsim.kernels import linkage as kernel
from railsim.mechanisms.assembly import constraints
from railsim.mechanisms.kinematics import Motion, solve

HALVINGS = 48
STILL = 1e-6  # share of the largest rate of a roller below which it stands still


@dataclass(frozen=True)
class Transition:
    """Change of a roller from one arc to the next."""

    joint: str  # the cam
    travel: float  # driver [rad or m]
    before: int  # arcs, counted from 1 in the order of the file
    after: int
    gap: float  # distance by which the arc after misses the roller's centre: 0 if tangent [m]
    rate_before: float  # of the roller's centre, dr/ds, on either arc [m/rad or 1]
    rate_after: float


def cam_rows(motion: Motion) -> dict[str, int]:
    """Row of every cam among the kernel's joints, by its name."""
    names = [n for n, j in motion.model.definition.joints.items() if isinstance(j, Cam)]
    rows = np.flatnonzero(motion.model.linkage.joint[:, 0] == kernel.CAM)
    return dict(zip(names, map(int, rows), strict=True))


def transitions(dense: Motion) -> tuple[Transition, ...]:
    """All changes of arcs along a motion, in its order."""
    found: list[Transition] = []
    for joint, row in cam_rows(dense).items():
        changes = np.flatnonzero(np.diff(dense.arcs[:, row])).tolist()
        found += [_transition(dense, joint, row, k) for k in changes]
    return tuple(found)


def _transition(dense: Motion, joint: str, row: int, k: int) -> Transition:
    model = dense.model
    low, high = float(dense.s[k]), float(dense.s[k + 1])
    before, after = int(dense.arcs[k, row]), int(dense.arcs[k + 1, row])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if solve(model, [middle]).arcs[0, row] == before:
            low = middle
        else:
            high = middle
    at = solve(model, [low])
    centre = model.definition.joints[joint].cam  # type: ignore[union-attr]
    rates, unit = [], np.eye(3 * model.linkage.n_bodies)[-1]  # of the driver
    for arc in (before, after):
        arcs = at.arcs[0].copy()
        arcs[row] = arc
        residual, jacobian = constraints(model, low, at.q[0], arcs)
        q1 = np.append(np.zeros(3), np.linalg.solve(jacobian, unit)).reshape(at.q1.shape)
        rates.append(replace(at, q1=q1, known={}).point(centre)[1][0])
    along = max(rates, key=np.linalg.norm)
    size, largest = np.linalg.norm(along), np.max(np.abs(dense.point(centre)[1]))
    along = along / size if size > STILL * largest else 0.0 * along
    earlier = int(model.linkage.joint[row, 4]) - 1
    gap = abs(float(residual[model.linkage.joint[row, 3]]))
    speeds = (float(rate @ along) for rate in rates)
    return Transition(joint, low, before - earlier, after - earlier, gap, *speeds)


def on_one_arc(motion: Motion, row: int, arc: int, beyond: float) -> Motion | None:
    """Positions with the roller kept on one arc, also a bit beyond where it leaves it.

    The cam is a row of the kernel's joints; `beyond` is a range of the driver, within that of the
    mechanism [rad or m].  None where the links cannot be assembled so far.
    """
    on = np.flatnonzero(motion.arcs[:, row] == arc)
    linkage = motion.model.linkage
    joints, ends = linkage.joint.copy(), linkage.arc_ends.copy()
    joints[row, 4:6] = arc, 1
    ends[arc, :4] = 0.0  # without ends
    free: Any = replace(motion.model, linkage=linkage._replace(joint=joints, arc_ends=ends))
    low, high = sorted((motion.model.start, motion.model.end))
    s = motion.s[on]
    begin, end = (float(np.clip(x, low, high)) for x in (np.min(s) - beyond, np.max(s) + beyond))
    start = replace(motion, s=s[:1], q=motion.q[on[:1]], arcs=motion.arcs[on[:1]], known={})
    try:
        return solve(free, np.linspace(begin, end, 101), start)
    except InputError:
        return None
