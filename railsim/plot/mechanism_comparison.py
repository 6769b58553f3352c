"""Pictures of several mechanisms side by side: cases, files, the starts of a search."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from railsim.arrays import Floats
from railsim.mechanisms.analysis import Analysis
from railsim.plot.mechanism_axes import (
    DASHES,
    MAIN,
    SECOND,
    label_of,
    line_style,
    mark_zone,
    single,
    values_of,
    way,
)
from railsim.plot.style import Picture

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum


def cases_figure(results: Mapping[str, Analysis]) -> Figure:
    """Unknown force over the driver, for all cases of a mechanism."""
    figure, axes = single(6.6, 3.6)
    first = next(iter(results.values()))
    assert first.definition.solve is not None
    for i, (name, result) in enumerate(results.items()):
        travel, force = values_of("travel", result), values_of("force", result)
        axes.plot(travel, force, label=name, **line_style(i))
    axes.axhline(0.0, color="0.4", lw=0.8)
    axes.set(xlabel=label_of("travel", first, "driver"))
    axes.set(ylabel=label_of("force", first, f"force of '{first.definition.solve.unknown}'"))
    axes.legend()
    return figure


def comparison_figure(results: Mapping[str, Analysis], *, zoom: bool = False) -> Figure:
    """Ratio and force of several mechanisms over the height.

    With `zoom`, in the zone only, and below it what they are above the first one.
    """
    first = next(iter(results.values()))
    figure = Picture(7.6, 6.4 if zoom else 3.8)
    panels = figure.subplots(2 if zoom else 1, 2, sharex=True, squeeze=False)
    for column, name in enumerate(("ratio", "force")):
        base = _over_height(first, name, zoom)
        for i, (label, result) in enumerate(results.items()):
            if (curve := _over_height(result, name, zoom)) is None:
                continue
            panels[0, column].plot(*curve, label=label, **line_style(i))
            if zoom and base is not None:
                above = curve[1] - np.interp(curve[0], *base)
                panels[1, column].plot(curve[0], above, **line_style(i))
        if not zoom:
            mark_zone(panels[0, column], first, way(first))
        panels[-1, column].set_xlabel(label_of(way(first), first))
    panels[0, 0].set_ylabel("ratio dy/dL")
    panels[0, 1].set_ylabel("force (N)")
    if zoom:
        panels[1, 0].set_ylabel("ratio over the first's")
        panels[1, 1].set_ylabel("force over the first's (N)")
    panels[0, 0].legend(fontsize=7.5)
    return figure


def held_figure(results: Mapping[str, Analysis]) -> Figure:
    """Pressures that several mechanisms need, and their contact forces at the held pressures."""
    figure = Picture(7.6, 3.8)
    left, right = figure.subplots(1, 2)
    for i, (label, result) in enumerate(results.items()):
        if "pressure" not in result.output or "height" not in result.output:
            continue
        height = values_of(way(result), result)
        left.plot(height, values_of("pressure", result), label=label, **line_style(i))
        if result.contact is not None:
            held = f"{label}, {result.contact.pressure / 1e6:.4f} MPa"
            right.plot(height, result.contact.curve, label=held, **line_style(i))
    right.axhline(0.0, color="0.4", lw=0.8)
    first = next(iter(results.values()))
    for axes, text in ((left, "pressure needed (MPa)"), (right, "static contact force (N)")):
        mark_zone(axes, first, way(first))
        axes.set(xlabel=label_of(way(first), first), ylabel=text)
        axes.legend(fontsize=7.5)
    left.set_ylim(bottom=0.0)
    return figure


def _over_height(result: Analysis, name: str, zoom: bool) -> tuple[Floats, Floats] | None:
    """A result over the height, with `zoom` in the zone only; None where there is none."""
    if name not in result.output or "height" not in result.output:
        return None
    x, y = values_of(way(result), result), values_of(name, result)
    if zoom and result.zone:
        low, high = (result.zone[k][way(result)] * 1e3 for k in ("low", "high"))
        inside = (x >= low) & (x <= high)
        x, y = x[inside], y[inside]
    return x, y


def search_figure(optimum: "Optimum") -> Figure:
    """Objective at the end of every start, feasible or not, and the best."""
    figure, axes = single(6.4, 3.6)
    starts = [s for s in optimum.starts if np.isfinite(s.objective) and s.objective > 0.0]
    top = max((s.objective for s in starts), default=1.0)
    lost = [replace(s, objective=top) for s in optimum.starts if not np.isfinite(s.objective)]
    for shown, marker, fill, label in (
        ([s for s in starts if s.feasible], "o", "k", "all constraints kept"),
        ([s for s in starts if not s.feasible], "x", "k", "a constraint broken"),
        (lost, "s", "w", "not assembled"),
    ):
        if shown:
            ends = zip(*((s.number, s.objective) for s in shown), strict=True)
            axes.plot(*ends, marker, mfc=fill, color="0.3", ms=5, label=label)
    if optimum.objective > 0.0:
        axes.axhline(optimum.objective, color=MAIN, label=f"best {optimum.objective:.4g}")
    if optimum.objective_before > 0.0:
        before = f"file {optimum.objective_before:.4g}"
        axes.axhline(optimum.objective_before, color=SECOND, ls=DASHES[1], label=before)
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="start", ylabel="objective")
    axes.legend()
    return figure
