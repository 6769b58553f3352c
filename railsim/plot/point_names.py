"""Names beside the points of a drawing, where they cover neither each other nor the lines."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from railsim.arrays import Floats
from railsim.plot.style import note

SIZE = 7.0  # of the letters [points]
REACHES = (5.0, 12.0, 20.0, 30.0)
"""Distances from point to name that are tried, the nearest first [points]."""
DIRECTIONS = np.radians([20.0, 160.0, -20.0, -160.0, 90.0, -90.0, 55.0, 125.0, -55.0, -125.0])
LEADER = 10.0  # distance from which a thin line joins name and point [points]
LINE = {"arrowstyle": "-", "lw": 0.5, "color": "0.4", "shrinkA": 0.0, "shrinkB": 2.0}


def name_points(axes: Axes, points: Mapping[str, Floats], lines: Sequence[Floats]) -> None:
    """Write names beside points.

    `axes`: With its limits as they stay. `points` (shape (2,)): Points by their names, in data.
    `lines` (shape (point, 2)): Lines that are better not covered, in data.
    """
    figure: Any = axes.figure
    figure.draw_without_rendering()  # the layout settles, and with it the scale
    per_point = figure.dpi / 72.0
    frame = np.array(axes.get_window_extent().extents) / per_point
    places = {name: axes.transData.transform(xy) / per_point for name, xy in points.items()}
    ink = np.concatenate([_points_along(axes.transData.transform(xy) / per_point) for xy in lines])
    marks = np.array(list(places.values()))
    boxes: list[Floats] = []
    for name, point in places.items():
        costs = [
            (_cost(box, boxes, frame, ink, marks) + 0.15 * reach, k, offset, box)
            for k, (reach, offset, box) in enumerate(_candidates(name, point))
        ]
        _, _, offset, box = min(costs, key=lambda cost: cost[:2])
        boxes.append(box)
        far = np.hypot(*offset) > LEADER + 0.29 * SIZE * len(name)
        look: Any = {"fontsize": SIZE, "color": "k", "arrowprops": LINE if far else None}
        note(axes, name, points[name], offset, "center", "center", **look).set_in_layout(False)


def _points_along(line: Floats) -> Floats:
    """Points of a line, 3 points of print apart."""
    parts = [line[:1]]
    for a, b in pairwise(line):
        count = max(int(np.hypot(*(b - a)) / 3.0), 1)
        parts.append(a + (b - a) * np.linspace(0.0, 1.0, min(count, 400) + 1)[1:, None])
    return np.concatenate(parts)


def _candidates(name: str, point: Floats) -> Iterator[tuple[float, Floats, Floats]]:
    """Reach, offset of the name's middle, and box x0, y0, x1, y1 of every position tried."""
    half = np.array([0.29 * SIZE * len(name), 0.6 * SIZE])
    for reach in REACHES:
        for direction in DIRECTIONS:
            unit = np.array([np.cos(direction), np.sin(direction)])
            offset = unit * reach + np.array([np.sign(round(unit[0], 6)), unit[1]]) * half
            middle = point + offset
            yield reach, offset, np.concatenate((middle - half, middle + half))


def _cost(box: Floats, boxes: Sequence[Floats], frame: Floats, ink: Floats, marks: Floats) -> float:
    def inside(points: Floats) -> int:
        return int(np.sum(np.all((points > box[:2]) & (points < box[2:]), axis=1)))

    over = sum(bool(np.all((box[:2] < o[2:]) & (box[2:] > o[:2]))) for o in boxes)
    out = bool(np.any(box[:2] < frame[:2]) or np.any(box[2:] > frame[2:]))
    return 1000.0 * over + 1000.0 * out + 60.0 * inside(marks) + 1.5 * inside(ink)
