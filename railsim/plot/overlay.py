"""The same quantities of several results in one picture, to be compared by eye."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from railsim.arrays import Floats
from railsim.compare import Difference
from railsim.definitions.track.layout import curvature_sections
from railsim.plot.histories import check_not_empty, draw_limit, unit_label
from railsim.plot.selection import STUDY, Panel, panels
from railsim.plot.style import SIDE_LINES, Picture, distinct, shade, spans, styled
from railsim.result import Result
from railsim.text import unformatted

LEADING = tuple(f"{name}:1" for name in STUDY)
"""Default quantities of comparisons: those of the leading wheelset."""


@styled()
def overlay(
    results: Mapping[str, Result], selections: Sequence[str] = LEADING, *, over: str = "distance"
) -> Figure:
    """Draw the same quantities of several results into the same axes.

    Parameters
    ----------
    results : mapping of str to Result
        Results by what they are called in the picture.
    selections : sequence of str
        Quantities and labels, see `railsim.plot.selection`; all results must have them.
    over : {"distance", "time"}
        Horizontal axis; the distance is that of the reference body.

    Returns
    -------
    Figure
        One pair of axes for each quantity; a colour for each result.
    """
    for label, result in results.items():
        check_not_empty(result, label)
    drawn = {label: panels(result, tuple(selections)) for label, result in results.items()}
    first = next(iter(results.values()))
    plans = [curvature_sections(result.track()) for result in results.values()]
    ends = [[(section.type, section.begin, section.end) for section in plan] for plan in plans]
    alike = all(other == ends[0] for other in ends)
    shown = spans(plans[0], first["distance"], first[over]) if alike else []
    same_radii = all(plan == plans[0] for plan in plans)
    count = max(len(found) for found in drawn.values())
    columns = 1 if count < 3 else 2
    rows = -(-count // columns)
    figure = Picture(7.0 if columns == 1 else 9.8, 1.3 + 2.1 * rows)
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    cells = list(grid.flat)
    for axes, *same in zip_longest(cells, *drawn.values()):
        if not any(same):
            axes.remove()
            continue
        for index, (result, panel) in enumerate(zip(results.values(), same, strict=True)):
            if panel is not None:
                _draw(axes, result[over], panel, distinct(index))
        _label(axes, next(panel for panel in same if panel is not None), results.values())
        shade(axes, shown, named=same_radii and axes in cells[:columns])
    for axes in cells[max(0, count - columns) : count]:
        axes.set_xlabel(first.quantities[over].label)
        axes.tick_params(labelbottom=True)
    handles = _legend(list(results), drawn)
    figure.legend(handles=handles, loc="outside lower left", ncols=_columns(figure, handles))
    return figure


def _columns(figure: Figure, handles: Sequence[Line2D]) -> int:
    """How many columns of a legend fit below a figure."""
    longest = max(len(str(handle.get_label())) for handle in handles)
    return max(1, min(6, len(handles), int(figure.get_figwidth() / (0.5 + 0.075 * longest))))


@styled()
def difference_figure(found: Sequence[Difference], first: str) -> Figure:
    """Differences of results from the first one along the track, an axis for each quantity.

    Parameters
    ----------
    found : sequence of Difference
    first : str
        What the first result is called.
    """
    labels = list(dict.fromkeys(one.result for one in found))
    names = list(dict.fromkeys(one.quantity.name for one in found))
    columns = 1 if len(names) < 3 else 2
    rows = -(-len(names) // columns)
    figure = Picture(7.0 if columns == 1 else 9.8, 1.5 + 2.1 * rows)
    figure.suptitle(f"Leading wheelset: difference from {unformatted(first)}", x=0.01, ha="left")
    cells = list(figure.subplots(rows, columns, sharex=True, squeeze=False).flat)
    for axes, name in zip_longest(cells, names):
        if name is None:
            axes.remove()
            continue
        own = [one for one in found if one.quantity.name == name]
        for one in own:
            colour = distinct(1 + labels.index(one.result))
            style = SIDE_LINES[one.labels.get("side", "left")]
            axes.plot(one.distance, one.values * one.quantity.scale, color=colour, ls=style)
        quantity = own[0].quantity
        axes.set(title=quantity.long_name[:1].upper() + quantity.long_name[1:])
        axes.set(ylabel=unit_label(quantity))
        axes.axhline(0.0, color="0.35", lw=0.6, zorder=1)
        axes.margins(x=0.0)
    for axes in cells[max(0, len(names) - columns) : len(names)]:
        axes.set_xlabel("distance (m)")
        axes.tick_params(labelbottom=True)
    handles = [
        Line2D([], [], color=distinct(1 + k), lw=2.0, label=unformatted(label))
        for k, label in enumerate(labels)
    ]
    sides = {one.labels.get("side") for one in found} - {None}
    handles += [
        Line2D([], [], color="0.25", ls=style, label=f"{side} wheel")
        for side, style in SIDE_LINES.items()
        if side in sides
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=_columns(figure, handles))
    return figure


def _draw(axes: Axes, horizontal: Floats, panel: Panel, colour: str) -> None:
    for line in panel.lines:
        style = SIDE_LINES[line.labels.get("side", "left")]
        axes.plot(horizontal, line.values * panel.quantity.scale, color=colour, ls=style)


def _label(axes: Axes, panel: Panel, results: Iterable[Result]) -> None:
    quantity = panel.quantity
    labels = {
        label for line in panel.lines for dim, label in line.labels.items() if dim != "side"
    } - {quantity.long_name.rpartition(", ")[2]}
    heading = quantity.long_name[:1].upper() + quantity.long_name[1:]
    if len(labels) == 1:
        heading += f": {unformatted(labels.pop())}"
    axes.set(title=heading, ylabel=unit_label(quantity))
    axes.axhline(0.0, color="0.35", lw=0.6, zorder=1)
    axes.margins(x=0.0)
    draw_limit(axes, quantity, results)


def _legend(labels: Sequence[str], drawn: Mapping[str, Sequence[Panel]]) -> list[Line2D]:
    handles = [
        Line2D([], [], color=distinct(index), lw=2.0, label=unformatted(label))
        for index, label in enumerate(labels)
    ]
    lines = [line for found in drawn.values() for panel in found for line in panel.lines]
    for side, style in SIDE_LINES.items():
        if any(line.labels.get("side") == side for line in lines):
            handles.append(Line2D([], [], color="0.25", ls=style, label=f"{side} wheel"))
    return handles
