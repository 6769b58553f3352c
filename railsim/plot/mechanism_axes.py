"""Axes of the pictures of mechanisms: curves, labels, values in shown units, the shaded zone."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from railsim.arrays import Floats
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.links import Course
from railsim.mechanisms.quantities import quantity
from railsim.plot.style import DISTINCT, Picture, distinct

DASHES: tuple[Any, ...] = (
    "-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)), (0, (3, 1, 1, 1, 1, 1)), (0, (11, 3)),
    (0, (1, 3)), (0, (9, 2, 3, 2)),
)  # fmt: skip
MAIN, SECOND, FAINT = DISTINCT[0], DISTINCT[1], "0.75"


def line_style(i: int) -> dict[str, Any]:
    """Colour and dashes of the line of a number."""
    return {"color": distinct(i), "ls": DASHES[i % len(DASHES)]}


def label_of(name: str, result: Analysis, words: str = "") -> str:
    """Label of an axis for a named result."""
    unit = quantity(name, result.definition).unit
    text = words or name.replace("_", " ")
    return f"{text} ({unit.replace('deg', '°')})" if unit else text


def values_of(name: str, result: Analysis) -> Floats:
    """Values of a named result in the unit shown."""
    found: Floats = np.asarray(result.output[name]) * quantity(name, result.definition).scale
    return found


def mark_zone(axes: Axes, result: Analysis, over: str) -> None:
    """Shade the zone and mark the work height over a quantity."""
    if not result.zone or over not in result.zone["low"]:
        return
    scale = quantity(over, result.definition).scale
    low, work, high = (result.zone[k][over] * scale for k in ("low", "work", "high"))
    axes.axvspan(min(low, high), max(low, high), color="0.93", lw=0, zorder=0)
    axes.axvline(work, color="0.5", lw=0.8, ls=(0, (4, 2)), zorder=1)


def way(result: Analysis) -> str:
    """Name of the result that says how far the output has moved along its axis."""
    return "x" if result.model.axis == 0 else "height"


def single(width: float, height: float) -> tuple[Picture, Axes]:
    """A figure with one pair of axes."""
    figure = Picture(width, height)
    return figure, figure.subplots()


def curves(
    axes: Axes, result: Analysis, over: str, lines: Iterable[tuple[Any, str]], label: str
) -> None:
    """Draw lines (values, name) over a result, with labels, legend and the zone."""
    for i, (values, name) in enumerate(lines):
        axes.plot(values_of(over, result), values, label=name, **line_style(i))
    mark_zone(axes, result, over)
    axes.set(xlabel=label_of(over, result, "driver" if over == "travel" else ""), ylabel=label)
    axes.legend(ncols=3)


def three_rows(
    over: Any, courses: Mapping[str, Course], scale: float, labels: Iterable[str]
) -> tuple[Picture, Any]:
    """A figure of courses, their first and their second derivatives."""
    figure = Picture(7.6, 5.6)
    rows = figure.subplots(3, 1, sharex=True)
    for i, (name, course) in enumerate(courses.items()):
        for axes, values in zip(rows, vars(course).values(), strict=True):
            axes.plot(over, np.round(values * scale, 9), label=name, **line_style(i))  # no noise
    for axes, label in zip(rows, labels, strict=True):
        axes.set_ylabel(label)
    rows[0].legend(ncols=3)
    return figure, rows
