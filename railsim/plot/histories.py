"""Quantities of one result over time or distance.

The figures of the curving study: wheel load change, lateral force, derailment quotient, roll,
lateral displacement and yaw, with the curve shaded and the limits of EN 14363 where they exist.
"""

from collections.abc import Iterable, Sequence
from itertools import zip_longest
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from railsim.arrays import Floats
from railsim.definitions.track.layout import curvature_sections
from railsim.errors import argument_error, input_error
from railsim.notation import QUANTITIES, REQUESTED, Quantity
from railsim.plot import style
from railsim.plot.selection import STUDY, Line, Panel, limit_of, panels
from railsim.result import Result
from railsim.text import unformatted

MARKED = 16  # places of a curve with markers


@style.styled()
def histories(
    result: Result,
    selections: Sequence[str] = (),
    *,
    over: str = "distance",
    by: str = "wheel",
    between: tuple[float, float] | None = None,
) -> Figure:
    """Draw quantities of a result: a pair of axes for each, or for each and each wheelset.

    `selections`: Quantities and labels, see `railsim.plot.selection`; by default those of the
    curving study, of a result without them all that it holds. `over` ({"distance",
    "time"}): Horizontal axis; the distance is that of the reference body. `by` ({"wheel",
    "wheelset"}): One pair of axes for all wheels, or one for each wheelset. `between`: Part of the
    horizontal axis to show, in its unit. Raises InputError: a quantity or label that the result
    does not have, an empty part.
    """
    check_not_empty(result)
    for name, value, choices in (("over", over, "distance time"), ("by", by, "wheel wheelset")):
        if value not in choices.split():
            raise argument_error(name, f"found {value!r}", choices.replace(" ", " or "))
    window = slice(None) if between is None else _window(result[over], between)
    rows = panels(result, tuple(selections or _default(result)))
    if by == "wheelset":
        cells = [_by_wheelset(result, panel) for panel in rows]
        drawn = [column for column in zip_longest(*cells) if any(column)]
        grid = [list(row) for row in zip(*drawn, strict=True)]
    else:
        columns = 1 if len(rows) < 3 else 2
        grid = [list(rows[i : i + columns]) for i in range(0, len(rows), columns)]
        grid[-1] += [None] * (columns - len(grid[-1]))
    return _figure(result, grid, over, by, window)


def _default(result: Result) -> Sequence[str]:
    held = [name for name in result if result.quantities[name].dims[0] == "time" != name]
    study = [name for name in STUDY if name in held]
    return study or [name for name in held if name != "distance"] or held


def check_not_empty(result: Result, name: str = "") -> None:
    """Raise InputError where a run ended before its first instant: there is nothing to draw."""
    if not len(result["time"]):
        found = f"holds no instants: {result.status}, {result.attributes.get('status_reason', '')}"
        raise input_error(name or "result", found, "give a run of some length", "time")


def _window(horizontal: Floats, between: tuple[float, float]) -> slice:
    if np.shape(between) != (2,):
        raise argument_error("between", f"found {between!r}", "two numbers: begin and end")
    start, stop = np.searchsorted(horizontal, between)
    if stop - start < 2:
        found = f"nothing between {between[0]:g} and {between[1]:g}"
        allowed = f"the run goes from {horizontal[0]:.6g} to {horizontal[-1]:.6g}"
        raise argument_error("between", found, allowed)
    return slice(int(start), int(stop))


def _by_wheelset(result: Result, panel: Panel) -> list[Panel | None]:
    if not any("wheelset" in line.labels for line in panel.lines):
        return [panel]
    lists: dict[str, list[Line]] = {name: [] for name in result.wheelsets}
    for line in panel.lines:
        lists[line.labels["wheelset"]].append(line)
    return [Panel(panel.quantity, tuple(lines)) if lines else None for lines in lists.values()]


def _figure(
    result: Result, grid: list[list[Panel | None]], over: str, by: str, window: slice
) -> Figure:
    rows, columns = len(grid), len(grid[0])
    width = 7.0 if columns == 1 else 3.0 + 3.4 * min(columns, 4)
    figure = style.Picture(width, 1.3 + 2.1 * rows, title(result))
    axes = figure.subplots(
        rows, columns, sharex=True, sharey="row" if by == "wheelset" else False, squeeze=False
    )
    horizontal = result[over][window]
    shown = style.spans(curvature_sections(result.track()), result["distance"][window], horizontal)
    for i, row in enumerate(grid):
        for j, panel in enumerate(row):
            if panel is None:
                axes[i, j].remove()
                continue
            _draw(axes[i, j], result, panel, horizontal, by, window)
            style.shade(axes[i, j], shown, with_names=i == 0)
            axes[i, j].tick_params(labelleft=by == "wheel" or not any(row[:j]))
            if not (i + 1 < rows and grid[i + 1][j] is not None):
                axes[i, j].set_xlabel(result.quantities[over].label)
                axes[i, j].tick_params(labelbottom=True)
    handles = _legend(result, [panel for row in grid for panel in row if panel is not None], by)
    if handles:
        figure.legend(handles=handles, loc="outside lower left", ncols=4 if columns == 1 else 6)
    return figure


def title(result: Result) -> str:
    """Return what a figure of a result is called: vehicle, track, friction, speed, an early end."""
    vehicle, track = unformatted(result.vehicle().name_with_load), result.track()
    where = f"{unformatted(track.name)} · friction {track.friction_words}"
    return f"{vehicle}\n{where} · {result.speed_words}{result.end_words}"


def _draw(
    axes: Axes, result: Result, panel: Panel, horizontal: Floats, by: str, window: slice
) -> None:
    quantity = panel.quantity
    wheelsets = style.wheelset_looks(result.wheelsets)
    every = max(len(horizontal) // MARKED, 1)
    others = [line for line in panel.lines if "wheelset" not in line.labels]
    for index, line in enumerate(panel.lines):
        side = line.labels.get("side", "left")
        look: dict[str, Any] = {"color": style.distinct(index)}
        if by == "wheelset" and "side" in line.labels:
            look = {"color": style.DISTINCT[0] if side == "left" else style.DISTINCT[1]}
        elif "wheelset" in line.labels:
            look = wheelsets[line.labels["wheelset"]] if by == "wheel" else {"color": "0.25"}
        values, above = line.values[window] * quantity.scale, 3.0 - 0.01 * index
        marked = every * (index + 1) // (len(panel.lines) + 1), every  # not all at one place
        # the leading wheelset stays visible
        look = {"ls": style.SIDE_LINES[side], "zorder": above, "markevery": marked, **look}
        axes.plot(horizontal, values, ms=3.5, **look)
    heading = quantity.title
    drawn = {line.labels["wheelset"] for line in panel.lines if "wheelset" in line.labels}
    if by == "wheelset" and len(drawn) == 1:
        wheelset = drawn.pop()
        number = result.wheelsets.index(wheelset) + 1
        heading = f"{heading}: {number} {unformatted(short_names(result.wheelsets)[wheelset])}"
    names = [
        unformatted(" ".join(v for k, v in line.labels.items() if k != "component"))
        for line in others
    ]
    if len(names) > 1:
        axes.legend(axes.lines[: len(others)], names, loc="best", ncols=2)
    elif names and names[0]:
        heading = f"{heading}: {names[0]}"
    draw_limit(axes, quantity, [result])
    frame(axes, quantity, heading)


def frame(axes: Axes, quantity: Quantity, heading: str) -> None:
    """Give axes over time or distance their title, the unit and a line at zero.

    They show two of the last digits of printed values at least, not noise.
    """
    axes.set(title=heading, ylabel=unit_label(quantity))
    if quantity.name != "mileage":  # whose zero is far away
        axes.axhline(0.0, color="0.35", lw=0.6, zorder=1)
    axes.margins(x=0.0)
    low, high = axes.get_ylim()
    if high - low < 2.0 * quantity.least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - quantity.least, middle + quantity.least)


def unit_label(quantity: Quantity) -> str:
    """Return symbol and shown unit, for a vertical axis."""
    if quantity.name not in {*QUANTITIES, *REQUESTED}:  # from a file of others, perhaps
        return unformatted(f"{quantity.symbol} ({quantity.shown_unit})")
    symbol = f"${quantity.symbol}$ " if quantity.symbol else ""
    unit = quantity.shown_unit.replace("s2", "s²").replace("1e-3", "10⁻³")
    return f"{symbol}({unit})" if unit != "-" else symbol.strip()


def draw_limit(axes: Axes, quantity: Quantity, results: Iterable[Result]) -> None:
    """Draw the limit of a quantity that has one for these results."""
    limit = limit_of(quantity.name, results)
    if limit is None:
        return
    value, words = limit
    shown = value * quantity.scale
    axes.axhline(shown, color=style.LIMIT, lw=0.9, ls=(0, (6, 2)), zorder=1.5)
    axes.update_datalim([(0.0, shown)], updatex=False)  # `axhline` on the edge leaves no margin
    axes.autoscale_view(scalex=False)
    shift, va = ((-3, 2.5), "bottom") if value < 0 else ((-3, -2.5), "top")
    look = {"fontsize": 7.5, "color": style.LIMIT, "path_effects": style.HALO}
    style.note(axes, words, (1.0, shown), shift, "right", va, frame=style.BESIDE, **look)


def _legend(result: Result, panels: Sequence[Panel], by: str) -> list[Line2D]:
    """Return the keys of all axes together: colours of the wheelsets, lines of the sides."""
    lines = [line for panel in panels for line in panel.lines]
    handles = []
    if by == "wheel":
        looks = style.wheelset_looks(result.wheelsets)
        names = short_names(result.wheelsets)
        for number, name in enumerate(result.wheelsets, start=1):
            if any(line.labels.get("wheelset") == name for line in lines):
                words = f"{number} {unformatted(names[name])}"
                handles.append(style.key(words, lw=2.0, ms=4.5, **looks[name]))
    for side, colour in zip(style.SIDE_LINES, style.DISTINCT, strict=False):
        if any(line.labels.get("side") == side for line in lines):
            handles += style.side_keys([side], color="0.25" if by == "wheel" else colour)
    return handles


def short_names(names: Sequence[str]) -> dict[str, str]:
    """Return names without the last part where it is the same for all of several dotted names."""
    last = {name.split(".")[-1] for name in names}
    if len(names) > 1 and len(last) == 1 and all("." in name for name in names):
        return {name: name.rpartition(".")[0] for name in names}
    return {name: name for name in names}
