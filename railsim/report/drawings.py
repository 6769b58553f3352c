"""Vehicles and tracks as small drawings within a page (SVG), in the colours of the page.

The figures of `railsim.plot` show more and take a second each; a page has one drawing per vehicle.
"""

from collections.abc import Iterator, Sequence
from html import escape

import numpy as np

from railsim.definitions.base import Vector
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatBody, FlatVehicle, flatten
from railsim.definitions.vehicle.outlines import body_boxes
from railsim.track.alignment import Alignment

MARGIN = 0.9  # m, margin around a vehicle
POINTS = 400  # of a line over the track
COLOURS = 8  # classes k0 to k7 of the page

View = tuple[int, int]
SIDE, TOP = (0, 2), (0, 1)


def vehicle_svg(vehicle: Vehicle) -> str:
    """Draw a vehicle to scale from the right and from above, the leading end to the right.

    Bodies are boxes, wheels circles or lines, centres of gravity are crosses, elements are lines
    between their points; `element_kinds` returns the kinds of elements in the order of their
    colours.
    """
    flat = flatten(vehicle)
    kinds = element_kinds(vehicle)
    return "".join(_view(flat, kinds, view) for view in (SIDE, TOP))


def element_kinds(vehicle: Vehicle) -> list[str]:
    """Return the kinds of elements of a vehicle, in the order of their colours."""
    return list(dict.fromkeys(element.definition.kind for element in flatten(vehicle).elements))


def _view(flat: FlatVehicle, kinds: Sequence[str], view: View) -> str:
    shapes = list(_shapes(flat, kinds, view))
    points = [body.position for body in flat.bodies]
    points += [point for e in flat.elements for point in (e.point1, e.point2)]
    points += [corner for box in body_boxes(flat).values() for corner in box]
    for body in flat.of_kind("wheelset"):
        assert body.wheelset is not None  # of its kind
        points.append((*body.position[:2], body.position[2] - max(body.wheelset.radius)))
    across, upright = (np.array([p[axis] for p in points]) for axis in view)
    x, y = across.min() - MARGIN, min(upright.min() - 0.4, -MARGIN)
    width, height = across.max() + MARGIN - x, max(upright.max(), 0.0) + 0.4 - y
    if view == TOP:
        y, height = -1.7, 3.4
    words = "from the right side" if view == SIDE else "from above"
    return (
        f'<svg class="drawing" viewBox="{x:.2f} {y:.2f} {width:.2f} {height:.2f}" role="img" '
        f'aria-label="{escape(flat.reference)}, {words}">{"".join(shapes)}</svg>'
    )


def _shapes(flat: FlatVehicle, kinds: Sequence[str], view: View) -> Iterator[str]:
    if view == SIDE:
        ends = [body.position[0] for body in flat.bodies]
        yield _line([(min(ends) - 9.0, 0.0, 0.0), (max(ends) + 9.0, 0.0, 0.0)], view, "rail")
    for name, box in body_boxes(flat).items():
        (x, y), (far_x, far_y) = (_projected(corner, view) for corner in box)
        yield (
            f'<rect class="box" x="{x:.3f}" y="{y:.3f}" width="{far_x - x:.3f}" '
            f'height="{far_y - y:.3f}"><title>{escape(name)}</title></rect>'
        )
    for element in flat.elements:
        for name, point in ((element.body1, element.point1), (element.body2, element.point2)):
            if name:
                yield _line([flat.body(name).position, point], view, "lever")
    for body in flat.of_kind("wheelset"):
        yield from _wheelset(body, view)
    for element in flat.elements:
        number = kinds.index(element.definition.kind) % COLOURS
        ends_of = (element.point1, element.point2)
        title = f"<title>{escape(element.name)}</title>"
        if np.allclose(*ends_of):
            x, y = _projected(element.point1, view)
            yield f'<circle class="k{number}" cx="{x:.3f}" cy="{y:.3f}" r=".07">{title}</circle>'
        else:
            yield _line(ends_of, view, f"k{number}", title)
    for body in (*flat.of_kind("body"), *flat.of_kind("axlebox")):
        x, y = _projected(body.position, view)
        size = 0.14 if body.kind == "body" else 0.06
        yield (
            f'<path class="body" d="M{x - size:.3f},{y:.3f}h{2 * size:.3f}M{x:.3f},{y - size:.3f}'
            f'v{2 * size:.3f}"><title>{escape(body.name)}</title></path>'
        )


def _wheelset(body: FlatBody, view: View) -> Iterator[str]:
    assert body.wheelset is not None  # of its kind
    x, y, z = body.position
    if view == SIDE:
        radius = body.wheelset.radius[1]
        title = f"<title>{escape(body.name)}</title>"
        yield f'<circle class="wheel" cx="{x:.3f}" cy="{z:.3f}" r="{radius:.3f}">{title}</circle>'
        return
    half = 0.5 * body.wheelset.tape_circle_distance
    yield _line([(x, y - half, z), (x, y + half, z)], view, "wheel")
    for side, radius in zip((-half, half), body.wheelset.radius, strict=True):
        yield _line([(x - radius, y + side, z), (x + radius, y + side, z)], view, "wheel")


def _projected(point: Vector, view: View) -> tuple[float, float]:
    return point[view[0]], point[view[1]]


def _line(points: Sequence[Vector], view: View, name: str, title: str = "") -> str:
    text = " ".join(f"{x:.3f},{y:.3f}" for x, y in (_projected(point, view) for point in points))
    return f'<polyline class="{name}" points="{text}">{title}</polyline>'


def track_svg(track: Track) -> str:
    """Draw curvature and cant of a track over its length, curves shaded and labelled."""
    alignment = Alignment(track)
    s = np.linspace(0.0, track.length, POINTS + 1)
    curvature, cant = 1e3 * alignment.curvature(s), 1e3 * alignment.cant(s)
    lines = ("curvature", curvature, "1/km"), ("cant", cant, "mm")
    drawn = [line for line in lines if line[1].any()]
    width, height = 1000.0, 78.0
    below = height + 16.0  # where the second begins, below the line with the radii
    whole = below + height if len(drawn) > 1 else below if drawn else 20.0
    across = s / track.length * width
    shapes, names = [], []
    for section in curvature_sections(track):
        if section.type == "STR":
            continue
        begin, end = (edge / track.length * width for edge in (section.begin, section.end))
        shade = "curve" if section.type == "CIR" else "transition"
        shapes.append(
            f'<rect class="{shade}" x="{begin:.1f}" y="0" width="{end - begin:.1f}" '
            f'height="{whole:.0f}"/>'
        )
        if section.type == "CIR" and end - begin > 60.0:
            radius = f"R {1.0 / section.start_value:.6g} m".replace("-", "\N{MINUS SIGN}")
            names.append(  # over the shade of the next section
                f'<text x="{0.5 * (begin + end):.1f}" y="{height + 8:.0f}" '
                f'text-anchor="middle">{radius}</text>'
            )
    shapes += names
    if not drawn:
        shapes.append('<text x="4" y="14">straight, without cant</text>')
    for top, (words, values, unit) in zip((0.0, below), drawn, strict=False):
        low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
        span = high - low
        y = top + height - 8.0 - (values - low) / span * (height - 30.0)
        zero = top + height - 8.0 + low / span * (height - 30.0)
        text = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, y, strict=True))
        shapes.append(f'<polyline class="rail" points="0,{zero:.1f} {width:.0f},{zero:.1f}"/>')
        shapes.append(f'<polyline class="k0" points="{text}"/>')
        shown = f"{words}: {values.min():.4g} to {values.max():.4g} {unit}"
        shapes.append(f'<text x="4" y="{top + 14:.0f}">{shown}</text>')
    words = f"s = 0 to {track.length:.6g} m"
    shapes.append(f'<text x="{width - 4:.0f}" y="14" text-anchor="end">{words}</text>')
    return (
        f'<svg class="strip" viewBox="0 0 {width:.0f} {whole:.0f}" role="img" '
        f'aria-label="curvature and cant over 0 to {track.length:.6g} m">{"".join(shapes)}</svg>'
    )
