"""Values of a mechanism's parameters, points and sizes."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.expressions import Expression, OutsideDomain, evaluate
from railsim.definitions.mechanism.parts import Link, Polar, Prismatic, Slot
from railsim.errors import input_error

PARTS = ("length", "free_length", "stroke", "extended", "bore", "rod", "pin_to_pin", "end_length")
"""Lengths of actuators and elements."""


T = TypeVar("T")


def members(kind: type[T], node: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, T]]:
    """Yield all of a kind, such as expressions, but plain numbers, with its dotted key."""
    if isinstance(node, kind):
        yield ".".join(path), node
    inner: Any = ()
    if isinstance(node, BaseModel):
        inner = ((name, getattr(node, name)) for name in type(node).model_fields)
    elif isinstance(node, Mapping):
        inner = node.items()
    elif isinstance(node, list | tuple):
        inner = enumerate(node)
    for key, value in inner:
        if value is not None and type(value) is not float:  # as most are
            yield from members(kind, value, (*path, str(key)))


def parameter_values(
    mechanism: Mechanism, changed: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Values of all parameters and intermediate results.

    `mechanism`: whose parameters; `changed`: values instead of the file's, also for parameters that
    are expressions there. Raises InputError: an expression without a value, or parameters that go
    round in a circle.
    """
    values: dict[str, Any] = dict(changed or {})
    home = {n: f"derived.{n}" for n in mechanism.derived}
    home |= {n: f"parameters.{n}" for n in mechanism.parameters}
    written = {**mechanism.derived, **mechanism.parameters}
    waiting = {n: v for n, v in written.items() if n not in values}
    for name in mechanism.automatic & waiting.keys():
        del waiting[name]
        values[name] = np.nan
    while waiting:
        ready = [
            name
            for name, value in waiting.items()
            if not (isinstance(value, Expression) and value.names & waiting.keys())
        ]
        if not ready:
            names = ", ".join(sorted(waiting))
            raise input_error("", f"{names} refer to each other", key="parameters")
        for name in ready:
            values[name] = number(waiting.pop(name), values, home[name])
    return values


def number(quantity: float | str, values: Mapping[str, Any], key: str = "") -> Any:
    """Value of a number or an expression; raises InputError: it has none."""
    if not isinstance(quantity, Expression):
        return quantity
    try:
        return evaluate(quantity, values)
    except ValueError as error:
        hint = ""
        if isinstance(error, OutsideDomain):
            hint = "the links cannot be assembled at the start with these parameters"
        raise input_error("", str(error), hint, key=key) from None


def coordinates(point: Any, values: Mapping[str, Any]) -> tuple[Any, Any]:
    """Coordinates of a point in its body's axes."""
    if isinstance(point, Polar):
        radius, angle = number(point.radius, values), number(point.angle, values)
        return radius * np.cos(angle), radius * np.sin(angle)
    return number(point[0], values), number(point[1], values)


def point_names(mechanism: Mechanism) -> list[str]:
    """Names of all points, those of the ground first."""
    names = [f"ground.{name}" for name in mechanism.ground.points]
    return [*names, *(f"{b}.{p}" for b, part in mechanism.bodies.items() for p in part.points)]


def ends(part: Any) -> tuple[str, str] | None:
    """The two points of a joint, actuator or element between points; None of others."""
    first = getattr(part, next(iter(type(part).model_fields)))  # the key that says what it is
    return first if isinstance(first, tuple) and first[0].kind == "point" else None


def points_of(part: Any) -> tuple[str, str]:
    """The two points of a part that is between points."""
    pair = ends(part)
    assert pair is not None
    return pair


def body_name(point: str) -> str:
    """Name of the body of a point."""
    return point.partition(".")[0]


def sizes(mechanism: Mechanism, values: Mapping[str, Any]) -> dict[str, float]:
    """Lengths of the mechanism by the key that says them [m]; arcs of cams are left out."""
    lengths = {}
    parts: list[tuple[str, Any]] = [("ground", mechanism.ground)]
    parts += [(f"bodies.{name}", body) for name, body in mechanism.bodies.items()]
    for key, part in parts:
        for name, point in part.points.items():
            x, y = coordinates(point, values)
            lengths[f"{key}.points.{name}"] = float(np.hypot(x, y))
    for name, joint in mechanism.joints.items():
        if isinstance(joint, Link):
            lengths[f"joints.{name}.length"] = float(number(joint.length, values))
        if isinstance(joint, Slot | Prismatic):
            lengths[f"joints.{name}.offset"] = abs(float(number(joint.offset, values)))
    return {key: size for key, size in lengths.items() if size > 1e-9}


def part_sizes(mechanism: Mechanism, values: Mapping[str, Any]) -> dict[str, float]:
    """Lengths of actuators, elements and the zone by the key that says them [m]."""
    lengths = {}
    for table in ("actuators", "elements"):
        for name, part in getattr(mechanism, table).items():
            for field in PARTS:
                if (quantity := getattr(part, field, None)) is not None:
                    lengths[f"{table}.{name}.{field}"] = abs(float(number(quantity, values)))
            for i, height in enumerate(getattr(part, "heights", ())):
                lengths[f"{table}.{name}.heights.{i}"] = abs(float(number(height, values)))
    if mechanism.zone is not None:
        for field in ("low", "work", "high"):
            lengths[f"zone.{field}"] = abs(float(number(getattr(mechanism.zone, field), values)))
    return lengths
