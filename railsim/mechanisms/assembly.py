"""Assembly where Newton's method finds none, and the loop of links that cannot close.

Residuals of the joints are made small in the sense of least squares (Levenberg and Marquardt;
scipy), which also converges from poses near a dead point.  Where links cannot be assembled the
residuals of the least sum of squares obey `Phi_q^T Phi = 0`: they are in balance like forces in
the joints, and therefore differ from zero in the joints of that loop only which cannot close.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Flags, Floats, Integers
from railsim.definitions.mechanism.parts import Link, Prismatic, Revolute
from railsim.kernels import linkage_motion as motion_kernel
from railsim.mechanisms.model import Model

CLOSED = 1e-9  # residual, as a share of the mechanism's size, of a closed loop
TRIES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5)
"""Amounts by which the pose's angles are moved in turn: it may itself be a dead point [rad]."""
TIGHT = 1e3  # weight of the other joints where the gap of one joint is sought
IN_LOOP = 1e-3  # share of the largest residual from which a joint counts as one of the loop


@dataclass(frozen=True)
class OpenLoop:
    """A loop that cannot close."""

    joints: tuple[str, ...]  # in the order of the file
    blamed: str  # the rod of the loop, else the joint that is furthest open
    gap: float  # how far that joint stays open with all others closed; of a rod, distance of its
    # points less its length [m]
    rod: bool  # whether the blamed joint is a rod

    def __str__(self) -> str:
        loop = ", ".join(f"'{name}'" for name in self.joints)
        gap = f"{abs(self.gap) * 1e3:.3f} mm"
        side = "short" if self.gap > 0.0 else "long"
        found = f"is {gap} too {side}" if self.rod else f"stays {gap} open"
        return f"loop {loop}: '{self.blamed}' {found}"


def assemble(model: Model, s: float, pose: Floats, arcs: Integers) -> Floats | None:
    """The assembly at a value of the driver near a pose (n_bodies + 1, 3); None where none is.

    `arcs` are those of every cam's roller, shape (joint,).
    """
    generator = np.random.default_rng(0)
    for amount in TRIES:
        begin = pose.copy()
        begin[1:, 2] += amount * generator.uniform(-1.0, 1.0, len(pose) - 1)
        q, residual = _closest(model, s, begin, arcs, _scales(model))
        if np.max(np.abs(residual)) < CLOSED * model.linkage.size:
            return q
    return None


def open_loop(
    model: Model, s: float, pose: Floats, arcs: Integers, first: OpenLoop | None = None
) -> OpenLoop | None:
    """The loop that cannot close at a value of the driver; None where all of them close.

    With `first`, which opened first on the way there, no other loop is blamed.
    """
    scales = _scales(model)
    q, residual = _closest(model, s, pose, arcs, scales)
    sizes = {n: float(np.max(np.abs(residual[a:b]))) for n, (a, b) in model.joint_rows.items()}
    largest = max(sizes.values())
    if largest < CLOSED * model.linkage.size:
        return None
    loop = [name for name, size in sizes.items() if size > IN_LOOP * largest]
    if first is not None:
        loop = list(first.joints)
    joints = model.definition.joints

    def rank(name: str) -> tuple[bool, bool, float]:
        joint = joints[name]
        return isinstance(joint, Link), not isinstance(joint, Revolute | Prismatic), sizes[name]

    blamed = max(loop, key=rank) if first is None else first.blamed
    a, b = model.joint_rows[blamed]
    weights = TIGHT * scales
    weights[a:b] = scales[a:b]
    _, last = _closest(model, s, q, arcs, weights)
    gap = float(np.linalg.norm(last[a:b]))
    joint = joints[blamed]
    if isinstance(joint, Link):
        length = float(model.number(joint.length))
        gap = float(np.sqrt(max(length**2 + 2.0 * length * last[a], 0.0))) - length
    if abs(gap) < CLOSED * model.linkage.size:
        return None
    return OpenLoop(tuple(loop), blamed, gap, isinstance(joint, Link))


def dead_loop(model: Model, s: float, pose: Floats, arcs: Integers) -> tuple[str, ...]:
    """Joints of the loop that still moves at a dead point, with the driver held.

    Their constraints depend on each other and on those that hold the loop's ends, through which
    forces go to the driver: joints between bodies none of which belong to the loop are left out.
    """
    _, jacobian = constraints(model, s, pose, arcs)
    left, _, right = np.linalg.svd(jacobian / _scales(model, columns=True))
    force, motion = np.abs(left[:, -1]), np.abs(right[-1]).reshape(-1, 3).max(axis=1)
    moving = motion > IN_LOOP * np.max(motion)
    bodies: dict[str, Flags] = {}  # of each loaded joint, whether a body is one of its two
    for name, (a, b) in model.joint_rows.items():
        if np.max(force[a:b]) > IN_LOOP * np.max(force):
            bodies[name] = np.any(jacobian[a:b].reshape(b - a, -1, 3), axis=(0, 2))
    of_loop = np.any([those for those in bodies.values() if (those & moving).any()], axis=0)
    return tuple(name for name, those in bodies.items() if not (those & ~of_loop).any())


def _scales(model: Model, *, columns: bool = False) -> Floats:
    """Factors that make residuals, or coordinates, of angles comparable with those of lengths."""
    linkage = model.linkage
    scales = np.ones(3 * linkage.n_bodies)
    if columns:
        scales[2::3] = linkage.size
        return scales
    for name, (_, b) in model.joint_rows.items():
        if isinstance(model.definition.joints[name], Prismatic):
            scales[b - 1] = linkage.size
    if model.definition.driver.angle is not None:
        scales[-1] = linkage.size
    return scales


def constraints(model: Model, s: float, pose: Floats, arcs: Integers) -> tuple[Floats, Floats]:
    """Residuals, shape (n,), and Jacobian, shape (n, n), of joints and driver at a pose."""
    n = 3 * model.linkage.n_bodies
    residual, jacobian = np.zeros((1, n)), np.zeros((1, n, n))
    at = np.ascontiguousarray(pose[None])
    motion_kernel.jacobians(model.linkage, np.array([s]), at, arcs[None], residual, jacobian)
    return residual[0], jacobian[0]


def _closest(
    model: Model, s: float, pose: Floats, arcs: Integers, weights: Floats
) -> tuple[Floats, Floats]:
    """Pose with the least sum of squares of the weighted residuals, and its residuals."""
    from scipy.optimize import least_squares  # imported where it is needed: it takes a while

    columns = _scales(model, columns=True)

    def poses(x: Floats) -> Floats:
        q = pose.copy()
        q[1:] = (x / columns).reshape(-1, 3)
        return q

    def residual(x: Floats) -> Floats:
        return weights * constraints(model, s, poses(x), arcs)[0]

    def slope(x: Floats) -> Any:
        return weights[:, None] * constraints(model, s, poses(x), arcs)[1] / columns

    accuracy: Any = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    q = poses(least_squares(residual, pose[1:].ravel() * columns, slope, method="lm", **accuracy).x)
    return q, constraints(model, s, q, arcs)[0]
