"""The mirror images of vehicles and tracks: left and right exchanged.

A right-hand curve becomes the left-hand one, a lopsided load changes sides.  Mirrored vehicle on
mirrored track gives the mirrored result, which checks all signs.
"""

from collections.abc import Set
from typing import Any, TypeVar

from railsim.definitions.base import OTHER_SIDE, Definition, Vector
from railsim.definitions.elements.base import Element
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import groups

SIGNS = (1.0, -1.0, 1.0)
TABLES = ("bodies", "wheelsets", "axleboxes", "elements", "assemblies", "loads", "sensors")

Part = TypeVar("Part", bound=Definition)
Row = tuple[float, float, float]


def mirrored_track(track: Track) -> Track:
    """Return the mirror image of a track.

    >>> from railsim.definitions.loading import load_track
    >>> mirrored_track(load_track("curve_r250")).plan[2].radius
    -250.0
    """
    return track.model_copy(
        update={
            "plan": tuple(element.mirrored() for element in track.plan),
            "cant": tuple(element.mirrored() for element in track.cant),
            "rail": track.rail[::-1],
            "friction": track.friction[::-1],
            "friction_table": _sides_exchanged(track.friction_table),
            "gauge_widening": _sides_exchanged(track.gauge_widening),
            "irregularities": tuple(part.mirrored() for part in track.irregularities),
            "sections": tuple(part.mirrored() for part in track.sections),
            "check_rail": tuple(rail.mirrored() for rail in track.check_rail),
        }
    )


def _sides_exchanged(rows: tuple[Row, ...] | None) -> tuple[Row, ...] | None:
    return None if rows is None else tuple((s, right, left) for s, left, right in rows)


def mirrored_vehicle(vehicle: Vehicle) -> Vehicle:
    """Return the mirror image of a vehicle; parts on both sides keep their names.

    Its load cases and sensors are mirrored too; signals and what controllers do with them are not.
    """
    boxes = {
        name
        for group in groups(vehicle)
        for name, box in group.axleboxes.items()
        if box.sides == "both"
    }
    return _mirrored(vehicle, boxes)


def _mirrored(part: Part, boxes: Set[str]) -> Part:
    """Return a part of a vehicle, with all parts in it, on the other side."""
    if getattr(part, "sides", None) == "both":
        return part
    update: dict[str, Any] = {}
    for name, value in part:
        match name, value:
            case ("position" | "point", tuple()):
                update[name] = _across(value)
            case ("points", tuple()):
                update[name] = tuple(map(_across, value))
            case ("radius" | "profile", tuple()):
                update[name] = value[::-1]
            case ("wheel", _):
                update[name] = OTHER_SIDE[value]
            case ("bodies", tuple()):
                update[name] = tuple(_opposite(body, boxes) for body in value)
            case ("placements", _):
                update[name] = tuple(_mirrored(inner, boxes) for inner in value)
            case (_, dict()) if name in (*TABLES, "out_of_round"):
                update[name] = {key: _mirrored(inner, boxes) for key, inner in value.items()}
    turned = part.mirrored(SIGNS) if isinstance(part, Element) else part
    return turned.model_copy(update=update)


def _opposite(body: str, boxes: Set[str]) -> str:
    """Return the name of the body on the other side of an axlebox on both sides."""
    box, _, side = body.rpartition(".")
    return f"{box}.{OTHER_SIDE[side]}" if box.rpartition(".")[2] in boxes else body


def _across(point: Vector) -> Vector:
    return (point[0], -point[1], point[2])
