"""The mirror images of vehicles and tracks, left and right exchanged, and the vehicle turned round.

A right-hand curve becomes the left-hand one, a lopsided load changes sides.  Mirrored vehicle on
mirrored track gives the mirrored result, which checks all signs.  A vehicle turned end for end is
reflected across and fore and aft.
"""

from collections.abc import Set
from typing import Any, TypeVar

from railsim.definitions.base import OTHER_SIDE, Definition, Vector
from railsim.definitions.elements.base import Element, times
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import groups
from railsim.definitions.vehicle.loads import LoadGroup

ACROSS, ALONG = (1.0, -1.0, 1.0), (-1.0, 1.0, 1.0)  # signs of a reflection
TABLES = ("bodies", "wheelsets", "axleboxes", "elements", "assemblies", "loads", "sensors")
TURNED = ", turned"  # behind the name of a vehicle that has been turned

Part = TypeVar("Part", bound=Definition)
V = TypeVar("V", bound=Vehicle)
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


def mirrored_vehicle(vehicle: V) -> V:
    """Return the mirror image of a vehicle; parts on both sides keep their names.

    Its load cases, sensors and points of service are mirrored too; signals and what controllers do
    with them are not.
    """
    boxes = {
        name
        for group in groups(vehicle)
        for name, box in group.axleboxes.items()
        if box.sides == "both"
    }
    return _across(vehicle, boxes)


def turned_vehicle(vehicle: V) -> V:
    """Return a vehicle turned end for end, with ``, turned`` behind its name.

    Parts on both sides keep their names; its wheels roll the other way.
    """
    whole = _along(_rolling_back(mirrored_vehicle(vehicle)))
    before = vehicle.name.removesuffix(TURNED)
    name = before if before != vehicle.name else f"{before}{TURNED}"
    return whole.model_copy(update={"name": name, "turned": False})


def _across(part: Part, boxes: Set[str]) -> Part:
    """Return a part of a vehicle, with all parts in it, on the other side."""
    if getattr(part, "sides", None) == "both":
        return part
    update: dict[str, Any] = {}
    for name, value in part:
        match name, value:
            case ("radius" | "profile", tuple()):
                update[name] = value[::-1]
            case ("wheel", _):
                update[name] = OTHER_SIDE[value]
            case ("bodies", tuple()):
                update[name] = tuple(_opposite(body, boxes) for body in value)
            case ("placements", _):
                update[name] = tuple(_across(inner, boxes) for inner in value)
            case ("service", Definition()):
                update[name] = _across(value, boxes)
            case (_, dict()) if name in (*TABLES, "out_of_round", "points"):
                update[name] = {key: _across(inner, boxes) for key, inner in value.items()}
    return _reflected(part, ACROSS).model_copy(update=update)


def _rolling_back(group: Part) -> Part:
    """Return a vehicle or an assembly whose wheels roll the other way."""
    vehicle: Any = group
    wheelsets = {
        name: wheelset.model_copy(
            update={"out_of_round": {k: v.backwards() for k, v in wheelset.out_of_round.items()}}
        )
        for name, wheelset in vehicle.wheelsets.items()
    }
    assemblies = {name: _rolling_back(inner) for name, inner in vehicle.assemblies.items()}
    return group.model_copy(update={"wheelsets": wheelsets, "assemblies": assemblies})


def _along(part: Part) -> Part:
    """Return a part of a vehicle reflected fore and aft, assemblies as a whole."""
    update: dict[str, Any] = {}
    for name, value in part:
        match name, value:
            case ("placements", _):
                reflected = (_reflected(p, ALONG) for p in value)
                mirrored = [p.model_copy(update={"mirror": not p.mirror}) for p in reflected]
                return part.model_copy(update={name: tuple(mirrored)})
            case ("service", Definition()):
                update[name] = _along(value)
            case (_, dict()) if name in (*TABLES, "points") and not isinstance(part, LoadGroup):
                update[name] = {key: _along(inner) for key, inner in value.items()}
            case ("bodies", dict()):  # of a load case; those of its assemblies turn with these
                update[name] = {key: _reflected(inner, ALONG) for key, inner in value.items()}
    return _reflected(part, ALONG).model_copy(update=update)


def _reflected(part: Part, signs: Vector) -> Part:
    """Return a part with its points and directions reflected, what is in it left alone."""
    update: dict[str, Any] = {}
    for name, value in part:
        match name, value:
            case ("position" | "point", tuple()):
                update[name] = times(value, signs)
            case ("points", tuple()):
                update[name] = tuple(times(point, signs) for point in value)
    directed = part.mirrored(signs) if isinstance(part, Element) else part
    return directed.model_copy(update=update)


def _opposite(body: str, boxes: Set[str]) -> str:
    """Return the name of the body on the other side of an axlebox on both sides."""
    box, _, side = body.rpartition(".")
    return f"{box}.{OTHER_SIDE[side]}" if box.rpartition(".")[2] in boxes else body
