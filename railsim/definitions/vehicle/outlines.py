"""Boxes that stand for bodies in pictures; no force depends on them.

A vehicle file gives no shapes.  A box contains the centre of gravity of its body and all points at
which elements are attached to it; the reference body, the car body as a rule, spans the wheelsets
with an overhang, from floor to roof.
"""

from typing import NamedTuple

import numpy as np

from railsim.definitions.base import Vector
from railsim.definitions.vehicle.flatten import FlatBody, FlatVehicle

OVERHANG, WIDTH, FLOOR, ROOF = 3.2, 2.8, 1.1, 3.9
"""Of a car body: beyond its wheelsets, across, above the rail [m]."""

PADDING = (0.12, 0.08, 0.06)
"""Between the outermost points of a body and its box [m]."""


class Box(NamedTuple):
    """Two opposite corners of a box in vehicle axes [m]."""

    low: Vector
    high: Vector


def body_boxes(flat: FlatVehicle) -> dict[str, Box]:
    """Return the boxes of the rigid bodies, by their names; wheelsets and axleboxes have none.

    >>> from railsim.definitions.loading import load_vehicle
    >>> from railsim.definitions.vehicle.flatten import flatten
    >>> boxes = body_boxes(flatten(load_vehicle("coach_manchester")))
    >>> list(boxes), boxes["carbody"].low, boxes["carbody"].high
    (['carbody', 'front.frame', 'rear.frame'], (-13.98, -1.4, -3.9), (13.98, 1.4, -1.1))
    """
    points: dict[str, list[Vector]] = {body.name: [body.position] for body in flat.bodies}
    for element in flat.elements:
        if element.definition.end_points() is not None:
            for name, point in ((element.body1, element.point1), (element.body2, element.point2)):
                if name:
                    points[name].append(point)
    return {
        body.name: _car(flat) if body.name == flat.reference else _box(body, points[body.name])
        for body in flat.of_kind("body")
    }


def _car(flat: FlatVehicle) -> Box:
    ends = [body.position[0] for body in flat.of_kind("wheelset")]
    high = max(ends) + OVERHANG, 0.5 * WIDTH, -FLOOR
    return Box((min(ends) - OVERHANG, -0.5 * WIDTH, -ROOF), high)


def _box(body: FlatBody, points: list[Vector]) -> Box:
    array = np.array(points)
    low, high = array.min(axis=0) - PADDING, array.max(axis=0) + PADDING
    high[2] = max(min(high[2], -0.1), body.position[2] + PADDING[2])  # not into the rails
    x, y, z = map(float, low)
    return Box((x, y, z), (float(high[0]), float(high[1]), float(high[2])))
