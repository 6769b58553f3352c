"""From a mechanism file to the flat arrays of `kernels.linkage`.

A `Model` holds one mechanism with real numbers, or the same with several parameters moved by a tiny
imaginary step each (`lanes`): whatever is computed from its numbers then carries exact derivatives.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Complexes, Floats
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.parts import AUTO, Cam, Link, Prismatic, Revolute
from railsim.definitions.mechanism.values import (
    body_name,
    coordinates,
    number,
    parameter_values,
    point_names,
    points_of,
)
from railsim.errors import InputError, input_error
from railsim.kernels import linkage as kernel
from railsim.kernels.linkage import Linkage

Values = Any  # float or complex ndarray, shape (lane, 1)
OPEN_ARC = 0.99 * np.pi
STEP = 1e-30  # imaginary step: its square vanishes beside any real number


@dataclass(frozen=True)
class Model:
    """A mechanism ready to be computed."""

    definition: Mechanism
    values: dict[str, Any]  # of the parameters: floats, or complex arrays of shape (lane, 1)
    linkage: Linkage  # arrays of the kernel
    points: dict[str, int]  # number of every point by name
    bodies: dict[str, int]  # and of every body; the ground is body 0
    pose: Floats  # where the assembly at the start is looked for, (body, 3)
    start: float  # range of the driver [rad or m]
    end: float
    known: dict[str, Values] = field(default_factory=dict, repr=False, compare=False)

    def number(self, quantity: float | str) -> Values:
        """Value of a number of the file; an expression is evaluated once."""
        if not isinstance(quantity, str):
            return quantity
        if quantity not in self.known:
            self.known[quantity] = number(quantity, self.values)
        return self.known[quantity]

    def position(self, where: Any) -> tuple[Values, Values]:
        """Coordinates of a point of the file in its body's axes [m]."""
        return coordinates(where, self.values)

    def lanes(self, names: Sequence[str]) -> "Model":
        """The same model with a lane for each parameter, moved by `1j * STEP`."""
        # expressions of the moved parameters follow; everything else keeps its value
        given = [n for n, text in self.definition.parameters.items() if not isinstance(text, str)]
        fixed = {name: self.values[name] for name in given}
        moved = {name: self.values[name] for name in names}
        return build(self.definition, {**fixed, **with_lanes(moved)})

    def real(self) -> "Model":
        """The real model of one with lanes."""
        lanes = {n: v for n, v in self.linkage._asdict().items() if np.iscomplexobj(v)}
        arrays: dict[str, Any] = {n: np.ascontiguousarray(v[:1].real) for n, v in lanes.items()}
        values = {name: real(value) for name, value in self.values.items()}
        return replace(self, values=values, linkage=self.linkage._replace(**arrays), known={})

    def refusal(self, key: str, found: str, allowed: str) -> InputError:
        """The error that refuses the mechanism at a key of its file."""
        return input_error(self.definition.name, found, allowed, key)

    def drift(self, s: Floats) -> Floats:
        """Derivatives of values of the driver that stay at their share of the range, by lanes."""
        driver, share = self.definition.driver, (s - self.start) / (self.end - self.start)
        start, end = (np.imag(self.number(x)) / STEP for x in (driver.start, driver.end))
        found: Floats = (1.0 - share) * start + share * end
        return found

    @property
    def axis(self) -> int:
        """Coordinate along which the output is to move: 0 for x, 1 for y."""
        output = self.definition.output
        return 0 if output is not None and output.axis == "x" else 1

    @property
    def sense(self) -> int:
        """Sense of the driver's motion from start to end."""
        return 1 if self.end > self.start else -1

    @property
    def joint_rows(self) -> dict[str, tuple[int, int]]:
        """First and last row (exclusive) of each joint in the constraints."""
        rows, at = {}, 0
        for name, joint in self.definition.joints.items():
            count = 2 if isinstance(joint, Revolute | Prismatic) else 1
            rows[name] = (at, at + count)
            at += count
        return rows


def build(definition: Mechanism, changes: Mapping[str, Any] | None = None) -> Model:
    """Return the model with values `changes`; raises InputError: an expression has no value."""
    values = parameter_values(definition, changes)
    lanes = max((np.size(v) for v in values.values()), default=1)
    complex_values = any(np.iscomplexobj(v) for v in values.values())
    arrays = _Arrays(definition, values, lanes, complex if complex_values else float)
    driver = definition.driver
    start, end = (real(number(end, values)) for end in (driver.start, driver.end))
    pose = _pose(definition, values, arrays)
    numbers = arrays.linkage(), arrays.points, arrays.bodies, pose, start, end
    return Model(definition, values, *numbers)


def with_lanes(values: Mapping[str, float]) -> dict[str, Complexes]:
    """Values of parameters with a lane for each, in which it is moved by `1j * STEP`."""
    steps = 1j * STEP * np.eye(len(values))[..., np.newaxis]
    return {name: values[name] + step for name, step in zip(values, steps, strict=True)}


def real(value: Any) -> float:
    """First real value of a number or of lanes."""
    return float(np.ravel(np.real(value))[0])


class _Arrays:
    """The kernel's arrays while they are filled."""

    def __init__(
        self, definition: Mechanism, values: Mapping[str, Any], lanes: int, dtype: type
    ) -> None:
        self.definition, self.values, self.lanes, self.dtype = definition, values, lanes, dtype
        self.bodies = {"ground": 0, **{name: i + 1 for i, name in enumerate(definition.bodies)}}
        self.points = {name: i for i, name in enumerate(point_names(definition))}
        self.body_of = [self.bodies[body_name(name)] for name in self.points]
        positions = list(definition.ground.points.values())
        positions += [w for body in definition.bodies.values() for w in body.points.values()]
        self.position = [self._by_lane(coordinates(where, values)) for where in positions]
        self.joint: list[list[int]] = []
        self.value: list[Any] = []
        self.arc_point: list[int] = []
        self.arc_radius: list[Any] = []
        self.arc_ends: list[list[float]] = []
        self.row = 0
        for joint in definition.joints.values():
            self._add(joint)

    def _by_lane(self, numbers: Sequence[Any]) -> NDArray[Any]:
        """Numbers as an array, shape (lane, number)."""
        filled: NDArray[Any] = np.zeros((self.lanes, len(numbers)), dtype=self.dtype)
        for i, value in enumerate(numbers):
            filled[:, i] = np.ravel(value)
        return filled

    def _number(self, quantity: float | str) -> Any:
        return number(quantity, self.values)

    def _add(self, joint: Any) -> None:
        def rows(kind: int, pair: Sequence[int], values: Sequence[Any], arcs: Any = (0, 0)) -> None:
            self.joint.append([kind, *pair, self.row, *arcs])
            self.value.append(self._by_lane(values))
            self.row += 2 if kind == kernel.REVOLUTE else 1

        if isinstance(joint, Cam):
            first = len(self.arc_point)
            body = self._add_arcs(joint)
            arcs = (first, len(joint.arcs))
            rows(kernel.CAM, (self.points[joint.cam], self.arc_point[first]), (1.0, body), arcs)
            return
        pair = [self.points[p] for p in points_of(joint)]
        if isinstance(joint, Revolute):
            rows(kernel.REVOLUTE, pair, (0.0, 0.0))
        elif isinstance(joint, Link):
            rows(kernel.LINK, pair, (self._number(joint.length), 0.0))
        else:
            rows(kernel.SLOT, pair, (self._number(joint.angle), self._number(joint.offset)))
        if isinstance(joint, Prismatic):
            bodies = [self.body_of[k] for k in pair]
            rows(kernel.PARALLEL, bodies, (self._number(joint.turned), 0.0))

    def _add_arcs(self, cam: Cam) -> int:
        """Add the arcs' centres as points of the cam's body, whose number is returned."""
        if cam.path is None:
            assert cam.body is not None
            body, arcs = self.bodies[cam.body], centred_arcs(cam, self.values)
        else:
            body = self.body_of[self.points[cam.path]]
            start = self.position[self.points[cam.path]]
            arcs = tangent_arcs(cam, start[:, :1], start[:, 1:], self.values)
        for x, y, radius, ends in arcs:
            self.arc_point.append(len(self.position))
            self.position.append(self._by_lane((x, y)))
            self.body_of.append(body)
            self.arc_radius.append(self._by_lane((radius,))[:, 0])
            self.arc_ends.append(ends)
        return body

    def linkage(self) -> Linkage:
        driver = self.definition.driver
        if driver.angle is not None:
            drive = [kernel.ANGLE, self.bodies[driver.angle], 0]
        elif driver.length is not None:
            drive = [kernel.LENGTH, *(self.points[p] for p in driver.length)]
        else:
            assert driver.coordinate is not None
            axis = kernel.X if driver.axis == "x" else kernel.Y
            drive = [axis, self.points[driver.coordinate], 0]
        radii: NDArray[Any] = np.array(self.arc_radius, dtype=self.dtype).reshape(-1, self.lanes)
        positions = np.array(self.position)
        return Linkage(
            len(self.bodies) - 1, float(np.max(np.abs(positions[:, 0].real))),
            np.array(self.body_of, dtype=np.int64),
            np.ascontiguousarray(positions.transpose(1, 0, 2)),
            np.array(self.joint, dtype=np.int64),
            np.ascontiguousarray(np.array(self.value).transpose(1, 0, 2)),
            np.array(self.arc_point, dtype=np.int64), np.ascontiguousarray(radii.T),
            np.array(self.arc_ends, dtype=float).reshape(-1, 5), np.array(drive, dtype=np.int64),
            self._by_lane((self._number(driver.zero),))[:, 0],
        )  # fmt: skip


def tangent_arcs(cam: Cam, x: Any, y: Any, values: Mapping[str, Any]) -> Iterator[Any]:
    """Arcs that go on tangentially from a point: centre x, y, radius, ends of the kernel.

    The centre of an arc that turns left is the radius to the left of the path.
    """
    direction = number(cam.tangent, values)
    for arc in cam.arcs:
        assert arc.length is not None
        radius, turn = number(arc.radius, values), 1.0 if arc.turns == "left" else -1.0
        u, v = -turn * np.sin(direction), turn * np.cos(direction)  # to the centre
        cx, cy = x + radius * u, y + radius * v
        direction = direction + turn * number(arc.length, values) / radius
        u2, v2 = -turn * np.sin(direction), turn * np.cos(direction)
        yield cx, cy, radius, [*map(real, (-u, -v, -u2, -v2)), turn]
        x, y = cx - radius * u2, cy - radius * v2


def centred_arcs(cam: Cam, values: Mapping[str, Any]) -> Iterator[Any]:
    """Arcs with given centres: centre x, y, radius, ends of the kernel.

    Where no angle is given an arc ends on the line through its centre and the next: there the
    normals agree, and with them the rates of the motion.
    """
    centres = [coordinates(arc.centre, values) for arc in cam.arcs]
    radii = [number(arc.radius, values) for arc in cam.arcs]
    shared: list[tuple[float, float]] = []
    for i in range(len(cam.arcs) - 1):
        dx, dy = (real(b) - real(a) for a, b in zip(centres[i], centres[i + 1], strict=True))
        angle = float(np.arctan2(dy, dx))
        same = cam.arcs[i].turns == cam.arcs[i + 1].turns
        here = angle + (np.pi if same and real(radii[i]) < real(radii[i + 1]) else 0.0)
        shared.append((here, here if same else here + np.pi))
    for i, arc in enumerate(cam.arcs):
        turn = 1.0 if arc.turns == "left" else -1.0
        begin = shared[i - 1][1] if i > 0 else None
        end = shared[i][0] if i < len(shared) else None
        begin = begin if arc.begin is None else real(number(arc.begin, values))
        end = end if arc.end is None else real(number(arc.end, values))
        # the open end of the first and of the last arc: nearly half a turn on
        if begin is None and end is not None:
            begin = end - turn * OPEN_ARC
        if end is None and begin is not None:
            end = begin + turn * OPEN_ARC
        yield *centres[i], radii[i], [*_unit(begin), *_unit(end), turn]


def _unit(angle: float | None) -> tuple[float, float]:
    """Unit vector of an arc's end; (0, 0), which the kernel passes nowhere, where there is none."""
    return (0.0, 0.0) if angle is None else (float(np.cos(angle)), float(np.sin(angle)))


def _pose(definition: Mechanism, values: Mapping[str, Any], arrays: _Arrays) -> Floats:
    """Pose to start from: given coordinates, else carried on through revolute joints."""
    pose = np.zeros((len(arrays.bodies), 3))
    placed = {"ground"}
    for name in definition.bodies:
        start = definition.start.get(name)
        if start is None:
            continue
        k = arrays.bodies[name]
        pose[k, 2] = real(number(start.angle, values))
        if AUTO not in (start.x, start.y):
            pose[k, :2] = real(number(start.x, values)), real(number(start.y, values))
            placed.add(name)
    if definition.driver.angle is not None:
        driver = definition.driver
        k = arrays.bodies[driver.angle or ""]
        pose[k, 2] = real(number(driver.zero, values)) + real(number(driver.start, values))
    moved = True
    while moved:
        moved = False
        for joint in definition.joints.values():
            if not isinstance(joint, Revolute):
                continue
            for known, new in (joint.revolute, joint.revolute[::-1]):
                body, other = body_name(known), body_name(new)
                if body in placed and other not in placed:
                    k = arrays.bodies[other]
                    at = _world(pose[arrays.bodies[body]], arrays.position[arrays.points[known]])
                    pose[k, :2] = 0.0
                    pose[k, :2] = at - _world(pose[k], arrays.position[arrays.points[new]])
                    placed.add(other)
                    moved = True
    return pose


def _world(pose: Floats, local: NDArray[Any]) -> Floats:
    u, v = local[0].real
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.array([pose[0] + c * u - s * v, pose[1] + s * u + c * v])
