"""A mechanism as lines and named points at every position: for pictures, animation and page."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism import parts
from railsim.definitions.mechanism.values import ends
from railsim.mechanisms.cams import cam_rows
from railsim.mechanisms.kinematics import Motion

ARC_POINTS = 24
COILS = 8


@dataclass(frozen=True)
class Line:
    """A line of the drawing."""

    kind: str  # body, link, guide, cam, actuator, spring or damper
    name: str  # part that it shows
    xy: Floats  # shape (position, point, 2) [m]


def lines(motion: Motion) -> list[Line]:
    """All lines of a mechanism at the positions of a motion."""
    definition = motion.model.definition
    found = []
    for name, body in definition.bodies.items():
        names = list(body.outline or body.points)
        if len(names) > 1:
            closed = names + names[:1] if len(names) > 2 and not body.outline else names
            xy = np.stack([motion.point(f"{name}.{p}")[0] for p in closed], axis=1)
            found.append(Line("body", name, xy))
    for name, joint in definition.joints.items():
        if isinstance(joint, parts.Link):
            found.append(_between(motion, "link", name, joint.link))
        elif isinstance(joint, parts.Slot | parts.Prismatic):
            found.append(_guide(motion, name, joint))
        elif not isinstance(joint, parts.Revolute):
            found.append(_cam(motion, name))
    for name, actuator in definition.actuators.items():
        if (pair := ends(actuator)) is not None:
            found.append(_between(motion, "actuator", name, pair))
    for name, element in definition.elements.items():
        if (pair := ends(element)) is not None:
            kind = "spring" if isinstance(element, parts.Spring | parts.GasSpring) else "damper"
            line = _between(motion, kind, name, pair)
            if isinstance(element, parts.Spring):
                line = _zigzag(line)
            elif isinstance(element, parts.GasSpring):
                line = _telescope(line, element, motion)
            found.append(line)
    return found


def _axes(line: Line) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Ends of a line, its length, and unit vectors along and across it (0 where both ends meet)."""
    first, last = line.xy[:, 0], line.xy[:, 1]
    along = last - first
    length = np.hypot(along[:, 0], along[:, 1])[:, None]
    along = along / np.where(length > 0.0, length, 1.0)
    return first, last, length, along, np.stack((-along[:, 1], along[:, 0]), axis=-1)


def _zigzag(line: Line) -> Line:
    """A spring as a zigzag between its ends, as wide as a twelfth of its length at first."""
    first, last, length, _, across = _axes(line)
    along, across = last - first, across * length[0] / 24.0
    turns = np.linspace(0.15, 0.85, 2 * COILS + 1)[1::2]
    shares = np.concatenate(([0.0, 0.15], turns, [0.85, 1.0]))
    sides = [0.0, 0.0, *(1.0 if k % 2 == 0 else -1.0 for k in range(COILS)), 0.0, 0.0]
    xy = [first + share * along + side * across for share, side in zip(shares, sides, strict=True)]
    return Line(line.kind, line.name, np.stack(xy, axis=1))


def _telescope(line: Line, spring: parts.GasSpring, motion: Motion) -> Line:
    """A gas spring as a tube, as long as the spring fully compressed, with its rod."""
    n = motion.model.number
    if spring.rod_end == spring.gas_spring[0]:
        line = Line(line.kind, line.name, line.xy[:, ::-1])
    first, last, _, along, across = _axes(line)
    half = 0.03 * n(spring.extended) * across
    end = first + 0.9 * (n(spring.extended) - n(spring.stroke)) * along
    xy = [first, first + half, end + half, end, last, end, end - half, first - half, first]
    return Line(line.kind, line.name, np.stack(xy, axis=1))


def centres(motion: Motion) -> dict[str, Floats]:
    """Centres of gravity of the bodies and points with a mass, shape (position, 2) [m]."""
    model, found = motion.model, {}
    for name, body in model.definition.bodies.items():
        if model.number(body.mass):
            found[name] = motion.at(model.bodies[name], *model.position(body.centre))[0]
    for name, element in model.definition.elements.items():
        if isinstance(element, parts.PointMass):
            found[name] = motion.point(element.point_mass)[0]
    return found


def _between(motion: Motion, kind: str, name: str, pair: Any) -> Line:
    return Line(kind, name, np.stack([motion.point(p)[0] for p in pair], axis=1))


def _guide(motion: Motion, name: str, joint: parts.Slot | parts.Prismatic) -> Line:
    """The line of a slot, over the part that its pin uses."""
    n = motion.model.number
    pin, origin = joint.slot if isinstance(joint, parts.Slot) else joint.prismatic
    body = motion.model.bodies[origin.partition(".")[0]]
    angle = n(joint.angle) + motion.q[:, body, 2]
    along = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    across = np.stack((-along[:, 1], along[:, 0]), axis=-1)
    base = motion.point(origin)[0] + n(joint.offset) * across
    used = np.sum((motion.point(pin)[0] - base) * along, axis=-1)
    margin = 0.15 * max(float(np.ptp(used)), 0.2 * float(np.max(np.abs(used)))) + 1e-3
    low, high = float(np.min(used)) - margin, float(np.max(used)) + margin
    return Line("guide", name, np.stack((base + low * along, base + high * along), axis=1))


def _cam(motion: Motion, name: str) -> Line:
    """The path of a roller's centre on its cam."""
    linkage = motion.model.linkage
    _, _, _, _, first, count = linkage.joint[cam_rows(motion)[name]]
    outline = []
    for arc in range(first, first + count):
        u0, v0, u1, v1, turn = linkage.arc_ends[arc]
        begin = np.arctan2(v0, u0)
        swept = (turn * (np.arctan2(v1, u1) - begin)) % (2.0 * np.pi)
        if u0 == v0 == 0.0:  # an arc without ends: all of its circle
            swept = 2.0 * np.pi
        angles = begin + turn * np.linspace(0.0, swept, ARC_POINTS)
        radius, k = linkage.arc_radius[0, arc], linkage.arc_point[arc]
        cx, cy = linkage.point[0, k]
        x, y = cx + radius * np.cos(angles), cy + radius * np.sin(angles)
        at = [motion.at(linkage.point_body[k], *xy)[0] for xy in zip(x, y, strict=True)]
        outline.append(np.stack(at, axis=1))
    return Line("cam", name, np.concatenate(outline, axis=1))


def points(motion: Motion) -> dict[str, Floats]:
    """All named points, shape (position, 2) [m]."""
    return {name: motion.point(name)[0] for name in motion.model.points}


def joint_points(motion: Motion) -> dict[str, str]:
    """The name under which each point is shown: points held together have one, by first point."""
    labels: dict[str, str] = {}
    by_name, near = points(motion), 1e-9 * float(motion.model.linkage.size)
    for name, xy in by_name.items():
        firsts = dict.fromkeys(labels.values())
        same = (first for first in firsts if np.max(np.abs(by_name[first] - xy)) < near)
        labels[name] = next(same, name)
    return labels


def working_box(motion: Motion) -> tuple[float, float, float, float]:
    """Box around the ground's points, the actuators and their bodies' pins: x0, x1, y0, y1 [m]."""
    definition = motion.model.definition
    names = [f"ground.{p}" for p in definition.ground.points]
    for part in (*definition.actuators.values(), *definition.elements.values()):
        names += ends(part) or ()
    for joint in definition.joints.values():
        if isinstance(joint, parts.Link | parts.Slot | parts.Prismatic):
            names += ends(joint) or ()
        elif hasattr(joint, "cam"):
            names.append(joint.cam)
    heavy = definition.output.point.partition(".")[0] if definition.output else ""
    names = [n for n in names if n.partition(".")[0] != heavy]
    if len({tuple(motion.point(name)[0][0]) for name in names}) < 2:
        names = list(motion.model.points)
    return box(np.concatenate([motion.point(name)[0][:1] for name in names]), 0.12)


def box(xy: Floats, share: float) -> tuple[float, float, float, float]:
    """Ends in x and y of what holds points, with a margin of a share of its size."""
    (x0, y0), (x1, y1) = xy.min(axis=0), xy.max(axis=0)
    margin = share * max(x1 - x0, y1 - y0)
    return float(x0 - margin), float(x1 + margin), float(y0 - margin), float(y1 + margin)
