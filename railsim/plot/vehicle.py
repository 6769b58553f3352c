"""A vehicle as a picture: side, top and front view with every element, to see wrong coordinates."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle

from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatBody, FlatElement, FlatVehicle, flatten
from railsim.definitions.vehicle.outlines import body_boxes
from railsim.plot.style import HALO, Picture, distinct, key, note, styled
from railsim.text import unformatted

View = tuple[int, int]  # axes of the vehicle along the width and the height of the page
Range = tuple[float, float]
SIDE, TOP, BEHIND = (0, 2), (0, 1), (1, 2)
TITLES = {SIDE: "Side view from the right", TOP: "Top view", BEHIND: "View from behind"}
LABELS = ("$x$ (m), forward", "$y$ (m), to the right", "$z$ (m), down")
BODY, WHEEL, LEVER = "0.25", "0.55", "0.78"
FILL, OUTLINE = (0.34, 0.66, 0.88, 0.10), "#8fb4cf"
BOX: Any = {"ls": "", "marker": "s", "ms": 7, "mfc": "none", "mec": "0.35", "mew": 1.0}
# The leading wheelset and those as near to it as this are shown once more in detail [m].
BOGIE = 4.8
# Names of bodies as near as this are written above each other [m].
NEAR = (3.0, 0.4)


@styled()
def vehicle_figure(vehicle: Vehicle, title: str = "") -> Figure:
    """Draw a vehicle in three views with its elements; `title`: by default its name.

    Bodies are crosses at their centres of gravity with the boxes of
    `railsim.definitions.vehicle.outlines`, axleboxes squares, wheels circles or lines; every
    element is drawn between its points, with a thin line from each point to the body that it is
    attached to.  Side and top view of the whole, then of the leading end, and the view from behind;
    equal scales within each.
    """
    flat = flatten(vehicle)
    kinds = dict.fromkeys(element.definition.kind for element in flat.elements)
    colours = {kind: distinct(i) for i, kind in enumerate(kinds)}
    figure = Picture(11.0, 9.0, unformatted(title or vehicle.name))
    panels = figure.subplot_mosaic("sss;ttt;abc", height_ratios=[1.0, 1.0, 1.7]).values()
    leader, *others = (w.position[0] for w in flat.of_kind("wheelset"))
    last = min([leader, *(x for x in others if leader - x < BOGIE)])
    end, boxes = (last - 0.8, leader + 0.8), body_boxes(flat)
    ends = (None, None, end, end, None)
    for axes, view, limits in zip(panels, (SIDE, TOP, SIDE, TOP, BEHIND), ends, strict=True):
        for box in boxes.values():
            (x, y), (far_x, far_y) = np.array(box)[:, list(view)]
            look: Any = {"fc": FILL, "ec": OUTLINE, "lw": 0.7, "zorder": 0.5}
            axes.add_patch(Rectangle((x, y), far_x - x, far_y - y, **look))
        _draw_view(axes, view, flat, colours, limits)
    figure.legend(handles=list(_handles(flat, colours)), loc="outside lower left", ncols=6)
    return figure


def _draw_view(
    axes: Axes, view: View, flat: FlatVehicle, colours: dict[str, str], limits: Range | None
) -> None:
    across, upright = view
    if upright == 2:
        axes.axhline(0.0, color="0.6", lw=0.8)
    for body in flat.of_kind("wheelset"):
        _draw_wheelset(axes, body, view)
    for element in flat.elements:
        for name, point in ((element.body1, element.point1), (element.body2, element.point2)):
            if name:
                _line(axes, (flat.body(name).position, point), view, color=LEVER, lw=0.5)
        # a ring is an element whose points coincide, a dotted line one without points
        look = {"color": colours[element.definition.kind], **_look(element)}
        _line(axes, (element.point1, element.point2), view, zorder=3, **look)
    for body in flat.of_kind("axlebox"):
        axes.plot(body.position[across], body.position[upright], **BOX)
    together: dict[tuple[float, float], list[str]] = {}
    for body in flat.of_kind("body"):
        x, y = body.position[across], body.position[upright]
        axes.plot(x, y, marker="+", ms=10, mew=1.8, color=BODY, zorder=4)
        if across == 0 and (limits is None or limits[0] < x < limits[1]):
            together.setdefault((round(x, 2), round(y, 2)), []).append(body.name)
    _name_bodies(axes, together, above=18 if upright == 2 else 10)
    axes.set(title=TITLES[view] + (", leading end" if limits else ""), xlabel=LABELS[across])
    axes.set(ylabel=LABELS[upright])
    axes.margins(0.06)
    if limits:
        axes.set(xlim=limits, ylim=(-2.5, 0.5) if upright == 2 else (-1.7, 1.7))
    axes.set_aspect("equal", adjustable="box" if limits else "datalim")
    axes.invert_yaxis()


def _name_bodies(axes: Axes, together: dict[tuple[float, float], list[str]], above: float) -> None:
    """Write names over centres of gravity, out of the way of springs and of each other."""
    written: list[tuple[float, float]] = []  # where
    for (x, y), names in sorted(together.items(), key=lambda item: -item[0][1]):
        if len(names) > 1:  # one behind the other: left and right
            names = [name.removesuffix("_left").removesuffix("_right") for name in names]
        words = ", ".join(dict.fromkeys(names))
        near = sum(abs(x - a) < NEAR[0] and abs(y - b) < NEAR[1] for a, b in written)
        written.append((x, y))
        shift = (0, above + 9 * near)
        look: Any = {"color": BODY, "zorder": 6, "path_effects": HALO}
        note(axes, unformatted(words), (x, y), shift, "center", **look)


def _look(element: FlatElement) -> dict[str, Any]:
    if element.definition.end_points() is None:
        return {"ls": ":", "lw": 1.2}
    if element.point1 == element.point2:
        return {"ls": "", "marker": "o", "ms": 8, "mfc": "none", "mew": 1.4}
    return {"lw": 1.6, "marker": "o", "ms": 2.5}


def _draw_wheelset(axes: Axes, body: FlatBody, view: View) -> None:
    assert body.wheelset is not None  # of its kind
    x, y, z = body.position
    half = 0.5 * body.wheelset.tape_circle_distance
    if view == SIDE:
        radius = body.wheelset.radius[1]
        axes.add_patch(Circle((x, z), radius, fill=False, color=WHEEL, lw=0.9))
        axes.plot(x, z, marker=".", color=WHEEL)
        return
    ends = ((x, y - half, z), (x, y + half, z))
    _line(axes, ends, view, color=WHEEL, lw=2.0)
    for end, radius in zip(ends, body.wheelset.radius, strict=True):
        tread = np.array([[-radius, 0.0, -radius], [radius, 0.0, radius]]) + end
        _line(axes, tread, view, color=WHEEL, lw=2.0)


def _line(axes: Axes, points: Any, view: View, **style: Any) -> None:
    """Draw a line through points in vehicle axes."""
    axes.plot(*np.transpose(points)[list(view)], **style)


def _handles(flat: FlatVehicle, colours: dict[str, str]) -> Iterator[Line2D | Rectangle]:
    yield key("centre of gravity", ls="", marker="+", ms=9, mew=1.8, color=BODY)
    yield key("wheelset", color=WHEEL, lw=2.0)
    yield key("attached to", color=LEVER, lw=0.8)
    yield Rectangle((0, 0), 1, 1, fc=FILL, ec=OUTLINE, label="body, as a box")
    if flat.of_kind("axlebox"):
        yield key("axlebox", **BOX)
    for kind, colour in colours.items():
        of_kind = [element for element in flat.elements if element.definition.kind == kind]
        yield key(f"{kind.replace('_', ' ')} ({len(of_kind)})", color=colour, **_look(of_kind[0]))
