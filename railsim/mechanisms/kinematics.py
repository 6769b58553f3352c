"""Positions of a mechanism along its driver, and what follows: points, lengths, angles.

A prime is a derivative by the driver; `Motion` holds all bodies' coordinates with two of them.
Complex models give complex results, whose imaginary parts are derivatives by parameters.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railsim.arrays import Floats, Integers
from railsim.definitions.mechanism.expressions import atan2
from railsim.errors import Fault, InputError, input_error
from railsim.kernels import linkage as kernel
from railsim.kernels import linkage_motion as motion_kernel
from railsim.mechanisms.assembly import assemble, constraints, dead_loop, open_loop
from railsim.mechanisms.model import STEP, Model

T = TypeVar("T")
Triple = tuple[Any, Any, Any]
ASTRAY = 1.0
"""Turn from the given pose beyond which the nearest assembly is looked for instead [rad]."""
BEYOND = 1e-3
"""Share of the rest of the range, behind a limit position, at which the open loop is sought."""


@dataclass(frozen=True)
class Motion:
    """Positions of all bodies; shapes (..., position), with a first axis for lanes."""

    model: Model
    s: NDArray[Any]  # driver [rad or m]
    q: NDArray[Any]  # x, y, theta, (..., position, body, 3); body 0 is the ground
    q1: NDArray[Any]  # its derivatives by the driver
    q2: NDArray[Any]
    arcs: Integers  # arc on which each cam's roller is, (position, joint)
    known: dict[Hashable, Any] = field(default_factory=dict, repr=False, compare=False)

    def once(self, name: Hashable, found: Callable[[], T]) -> T:
        """What is called so of these positions: `found` where it is not known yet."""
        if name not in self.known:
            self.known[name] = found()
        known: T = self.known[name]
        return known

    def point(self, name: str) -> Triple:
        """Position of a named point with two derivatives, shapes (..., position, 2)."""
        k = self.model.points[name]
        body = self.model.linkage.point_body[k]
        return self.once(name, lambda: self.at(body, *self._local(k)))

    def arc_centre(self, joint: int) -> Any:
        """Position of the centre of the arc that a cam's roller is on, shape (position, 2)."""
        linkage = self.model.linkage
        found = np.zeros((self.s.shape[-1], 2))
        for arc in np.unique(self.arcs[:, joint]):
            k = linkage.arc_point[arc]
            r, _, _ = self.at(linkage.point_body[k], *self._local(k))
            found = np.where((self.arcs[:, joint] == arc)[:, None], r, found)
        return found

    def _local(self, k: int) -> tuple[Any, Any]:
        u = self.model.linkage.point[:, k]
        return (u[:, :1], u[:, 1:]) if np.iscomplexobj(u) else (u[0, 0], u[0, 1])

    def at(self, body: int, u: Any, v: Any) -> Triple:
        """As `point`, for a point (u, v) in the axes of a body."""
        x, y, theta = (self.q[..., body, i] for i in range(3))
        c, s = np.cos(theta), np.sin(theta)
        ax, ay = c * u - s * v, s * u + c * v
        w, w1 = self.q1[..., body, 2], self.q2[..., body, 2]
        x1, y1 = self.q1[..., body, 0], self.q1[..., body, 1]
        x2, y2 = self.q2[..., body, 0], self.q2[..., body, 1]
        r, r1 = _pairs(x + ax, y + ay), _pairs(x1 - ay * w, y1 + ax * w)
        return r, r1, _pairs(x2 - ay * w1 - ax * w * w, y2 + ax * w1 - ay * w * w)

    def length(self, pair: Sequence[str]) -> Triple:
        """Distance of two points with two derivatives, shape (..., position) [m]."""
        return self.once(tuple(pair), lambda: self._length(pair))

    def _length(self, pair: Sequence[str]) -> Triple:
        first, second = self.point(pair[0]), self.point(pair[1])
        d, d1, d2 = (b - a for a, b in zip(first, second, strict=True))
        length = np.sqrt(dot(d, d))
        if len(met := np.argwhere(length == 0.0)):
            at = driver_words(self.model, float(np.real(self.s[tuple(met[0])])))
            found = f"driver at {at}: meets {pair[1]}, and what is between them has no direction"
            raise self.model.refusal(pair[0], found, "points apart")
        rate = dot(d, d1) / length
        return length, rate, (dot(d1, d1) + dot(d, d2) - rate * rate) / length

    def angle(self, name: str) -> Any:
        """Angle of the first line less that of the second, plus offset, -pi to pi [rad]."""
        angle = self.model.definition.angles[name]
        lines = (self.point(second)[0] - self.point(first)[0] for first, second in angle.between)
        (a, b), (c, d) = (np.moveaxis(line, -1, 0) for line in lines)
        turned = atan2(b * c - a * d, a * c + b * d) + self.model.number(angle.offset)
        return turned - 2.0 * np.pi * np.round(np.real(turned) / (2.0 * np.pi))


def _pairs(x: Any, y: Any) -> Any:
    """Vectors in the last axis, as `np.stack` makes them in three times the time."""
    found = np.empty((*x.shape, 2), x.dtype)
    found[..., 0], found[..., 1] = x, y
    return found


def dot(a: Any, b: Any) -> Any:
    """Scalar product of vectors in the last axis."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def folded(angle: Any) -> Any:
    """Angle between lines without direction, from 0 to pi/2 [rad].

    >>> [round(float(np.degrees(folded(np.radians(x)))), 9) for x in (30.0, 140.0, -100.0, 200.0)]
    [30.0, 40.0, 80.0, 20.0]
    """
    turned = angle - np.pi * np.round(np.real(angle) / np.pi)
    return np.where(np.real(turned) < 0.0, -turned, turned)


def solve(model: Model, s: ArrayLike, near: Motion | None = None) -> Motion:
    """Positions for given values of the driver, continued from the start of the range.

    `model`: A real model. `s` (shape (position,)): Values of the driver [rad or m]. `near`: Known
    positions of the same model, from the last of which to go on. Raises InputError: lost assembly,
    dead point, jump of branch, roller off its cam: where, which joint.
    """
    wanted = np.atleast_1d(np.asarray(s, dtype=float))
    start, pose, arc_start = model.start, model.pose, model.linkage.joint[:, 4].copy()
    if near is not None:
        start, pose, arc_start = near.s[-1], near.q[-1], near.arcs[-1].copy()
    values = np.concatenate(([start], wanted))
    tracked = _track(model, values, pose, arc_start)
    astray = np.max(np.abs(tracked.q[0, :, 2] - pose[:, 2])) > ASTRAY
    if near is None and (tracked.status == kernel.NO_ASSEMBLY or astray):
        found = assemble(model, start, pose, arc_start)
        if found is not None:
            tracked = _track(model, values, found, arc_start)
    if tracked.status != kernel.OK:
        raise InputError([_fault(model, tracked, values, pose)])
    return Motion(model, wanted, tracked.q[1:], tracked.q1[1:], tracked.q2[1:], tracked.arcs[1:])


class _Tracked(NamedTuple):
    """What the kernel gives: status, valid positions, where and in which joint it failed."""

    status: int
    valid: int
    q: Floats
    q1: Floats
    q2: Floats
    arcs: Integers
    failure: Floats


def _track(model: Model, s: Floats, pose: Floats, arc_start: Integers) -> _Tracked:
    linkage = model.linkage
    shape = (len(s), linkage.n_bodies + 1, 3)
    q, q1, q2 = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    arcs = np.zeros((len(s), len(linkage.joint)), dtype=np.int64)
    failure = np.zeros(2)
    status, valid = motion_kernel.trace(linkage, s, pose, arc_start, q, q1, q2, arcs, failure)
    return _Tracked(status, valid, q, q1, q2, arcs, failure)


def _fault(model: Model, tracked: _Tracked, s: Floats, pose: Floats) -> Fault:
    """Why a motion cannot be continued: the loop that cannot close, or is at a dead point."""
    place = float(tracked.failure[0])
    row = model.linkage.joint[int(tracked.failure[1]), 3]
    name = next(name for name, (a, b) in model.joint_rows.items() if a <= row < b)
    q, arcs = pose, model.linkage.joint[:, 4].copy()
    if tracked.valid:
        q, arcs = tracked.q[tracked.valid - 1], tracked.arcs[tracked.valid - 1]
    status = tracked.status
    if status == kernel.NO_ASSEMBLY and (closed := assemble(model, place, q, arcs)) is not None:
        status, q = kernel.DEAD_POINT, closed
    sentence = kernel.STATUS[status].format(joint=f"'{name}'")
    loop = None
    if status in (kernel.NO_ASSEMBLY, kernel.LOST_ASSEMBLY):
        far = place if status == kernel.NO_ASSEMBLY else float(s[-1])
        loop = open_loop(model, place + BEYOND * (far - place), q, arcs)
        if loop is None and status == kernel.LOST_ASSEMBLY:  # nothing stays open behind it
            status = kernel.DEAD_POINT
            sentence = kernel.STATUS[status]
    if loop is not None:
        # behind the limit the gap is still small: the end of the range says more
        end = ""
        if far != place and (last := open_loop(model, far, q, arcs, loop)) is not None:
            loop, end = last, f" at {driver_words(model, far)}"
        name = loop.blamed
        sentence = f"{sentence.partition(' (joint')[0]}; {loop}{end}"
    elif status in (kernel.DEAD_POINT, kernel.BRANCH_JUMP):
        loop_names = dead_loop(model, place, q, arcs)
        name = loop_names[-1] if name not in loop_names else name
        sentence = f"{sentence.partition(' (joint')[0]} (joints {', '.join(loop_names)})"
    where = f"driver at {driver_words(model, place)}"
    remedy = {
        kernel.NO_ASSEMBLY: "other lengths, or a pose in [start] nearer to the assembly",
        kernel.BEYOND_CAM: "a longer arc, or another driver.end",
    }.get(status, "another driver.end or other lengths")
    return Fault(model.definition.name, f"joints.{name}", f"{where}: {sentence}", remedy)


def driver_words(model: Model, value: float) -> str:
    """A value of the driver with its unit."""
    if model.definition.driver.angle is not None:
        return f"{np.degrees(value):z.4f} deg"
    return f"{value * 1e3:z.3f} mm"


def check_freedom(model: Model) -> None:
    """Refuse, by InputError, joints that hold the same freedom twice at the start."""
    arcs = model.linkage.joint[:, 4].copy()
    lost: InputError | None = None
    try:
        motion = solve(model, [model.start])
        pose, arcs = motion.q[0], motion.arcs[0]
    except InputError as error:
        lost = error
        found = assemble(model, model.start, model.pose, arcs)
        pose = model.pose if found is None else found
    left, rank = _joint_rank(model, model.start, pose, arcs)
    rows = 3 * model.linkage.n_bodies
    if rank < rows - 1 and lost is not None:
        # a dead point at the start alone is no joint too many
        beyond = model.start + 0.01 * (model.end - model.start)
        other = assemble(model, beyond, pose, arcs)
        if other is not None and _joint_rank(model, beyond, other, arcs)[1] == rows - 1:
            raise lost
    if rank == rows - 1:
        if lost is not None:
            raise lost
        return
    weight = np.abs(left[:, rank:]).max(axis=1)
    names = [n for n, (a, b) in model.joint_rows.items() if weight[a:b].max() > 1e-6]
    words = f"hold the same freedom twice: {rows - rank} degrees of freedom left"
    where = f"joints {', '.join(names)} {words}"
    raise input_error(model.definition.name, where, "1 is needed", "joints")


def _joint_rank(model: Model, s: float, pose: Floats, arcs: Integers) -> tuple[Any, int]:
    """Left singular vectors and rank of the joints' Jacobian."""
    left, singular, _ = np.linalg.svd(constraints(model, s, pose, arcs)[1][:-1])
    return left, int(np.sum(singular > 1e-9 * singular[0]))


def tangents(
    motion: Motion, lanes: Model, *, drift: Floats | float = 0.0, second: bool = True
) -> Motion:
    """The same positions with derivatives by parameters in the imaginary parts.

    `motion`: Positions of a real model. `lanes`: The model with a lane for each parameter
    (`Model.lanes`); an imaginary part of a result is `STEP` times the derivative. `drift` (shape
    (lane, position)): Derivatives of the driver's values themselves. `second`: Whether the second
    derivatives by the driver are wanted too.
    """
    count = lanes.linkage.point.shape[0]
    real = motion.s, motion.q, motion.q1, motion.q2
    s, q, q1, q2 = (np.repeat(array[None].astype(complex), count, axis=0) for array in real)
    s += 1j * STEP * drift
    motion_kernel.tangents(motion.model.linkage, lanes.linkage, s, q, q1, q2, motion.arcs, second)
    return Motion(lanes, s, q, q1, q2, motion.arcs)


def derivative(values: Any) -> Floats:
    """Derivatives by the parameters from a complex result, shape (lane, ...)."""
    found: Floats = np.imag(values) / STEP
    return found
