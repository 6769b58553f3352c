"""The mirror images of vehicles and tracks: left and right exchanged.

A right-hand curve becomes the left-hand one, a lopsided load changes sides.  Mirrored vehicle on
mirrored track gives the mirrored result, which checks all signs.
"""

from typing import TypeVar

from railsim.definitions.base import OTHER_SIDE, Vector
from railsim.definitions.elements.base import Element
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.loads import LoadCase, LoadGroup
from railsim.definitions.vehicle.tables import Assembly, Axlebox, Body, Placement, Point, Wheelset

SIGNS = (1.0, -1.0, 1.0)

Group = TypeVar("Group", Vehicle, Assembly)
Load = TypeVar("Load", LoadCase, LoadGroup)
Part = TypeVar("Part", Body, Wheelset, Axlebox, Placement, Point)
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
    return _mirrored_group(vehicle).model_copy(
        update={
            "loads": {name: _mirrored_load(load) for name, load in vehicle.loads.items()},
            "sensors": {name: _moved(point) for name, point in vehicle.sensors.items()},
        }
    )


def _mirrored_load(load: Load) -> Load:
    bodies = {
        name: body.model_copy(
            update={"position": None if body.position is None else _across(body.position)}
        )
        for name, body in load.bodies.items()
    }
    groups = {name: _mirrored_load(group) for name, group in load.assemblies.items()}
    return load.model_copy(update={"bodies": bodies, "assemblies": groups})


def _mirrored_group(group: Group) -> Group:
    update: dict[str, object] = {
        "bodies": {name: _moved(body) for name, body in group.bodies.items()},
        "wheelsets": {
            name: _moved(w).model_copy(
                update={
                    "radius": w.radius[::-1],
                    "profile": w.profile[::-1],
                    "out_of_round": {
                        key: part.model_copy(update={"wheel": OTHER_SIDE[part.wheel]})
                        for key, part in w.out_of_round.items()
                    },
                }
            )
            for name, w in group.wheelsets.items()
        },
        "axleboxes": {
            name: box if box.sides == "both" else _moved(box)
            for name, box in group.axleboxes.items()
        },
        "elements": {name: _mirrored_element(e) for name, e in group.elements.items()},
        "assemblies": {name: _mirrored_group(a) for name, a in group.assemblies.items()},
    }
    if isinstance(group, Assembly):
        update["placements"] = tuple(_moved(placement) for placement in group.placements)
    return group.model_copy(update=update)


def _across(point: Vector) -> Vector:
    return (point[0], -point[1], point[2])


def _moved(part: Part) -> Part:
    return part.model_copy(update={"position": _across(part.position)})


def _mirrored_element(element: Element) -> Element:
    if getattr(element, "sides", None) == "both":
        return element
    point, points = getattr(element, "point", None), getattr(element, "points", None)
    update: dict[str, object] = {}
    if point is not None:
        update["point"] = _across(point)
    if points is not None:
        update["points"] = tuple(_across(end) for end in points)
    return element.mirrored(SIGNS).model_copy(update=update)
