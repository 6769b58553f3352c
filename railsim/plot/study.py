"""Pictures of a study: values over what was varied, families of curves, heat maps, rankings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.plot.style import DISTINCT, Picture, grid_of, styled
from railsim.text import unformatted

MOST_RANKED = 25
FEW = 6  # members of a family that have colours of their own; more get those of a scale
WIDE = 46  # letters of labels side by side below axes
LONGEST = 60  # letters of a run's name in a ranking


@dataclass(frozen=True)
class Column:
    """Something that runs have, one value for each."""

    words: str  # for axes, with the unit
    values: list[Any]  # numbers or texts; None where a run has none

    @property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, int | float) for value in self.values if value is not None)

    @property
    def different(self) -> list[Any]:
        """Its values, each once, sorted."""
        there = {value for value in self.values if value is not None}
        return sorted(there, key=lambda value: (isinstance(value, str), value))


@styled()
def curves_figure(quantities: Sequence[Column], x: Column, family: Column | None) -> Figure:
    """Quantities over a parameter, a curve for each member of a family.

    Where several runs share a point, the curve is their median and a band goes from the smallest to
    the largest.  Over categories there are points and bars, which no line joins.
    """
    members = [None] if family is None else family.different
    colours = _colours(len(members))
    others = [None] * len(x.values) if family is None else family.values
    points = list(zip(x.values, others, strict=True))
    figure, cells = _panels(len(quantities))
    if len(set(points)) < len(points):
        words = "Medians of the runs at each point; bands from the smallest to the largest"
        figure.suptitle(words, x=0.012, ha="left", fontsize=8.5, fontweight="normal")
    for axes, quantity in zip(cells, quantities, strict=True):
        for member, colour in zip(members, colours, strict=True):
            own = None if family is None else [value == member for value in family.values]
            _curve(axes, quantity, x, own, colour, member)
        axes.set(title=quantity.words, xlabel=x.words)
        if not x.numeric:
            axes.set_xticks(range(len(x.different)), [unformatted(str(v)) for v in x.different])
            _turned(axes)
    if family is not None:
        _legend(figure, cells[0], family.words)
    return figure


def _curve(axes: Axes, quantity: Column, x: Column, mask: Any, colour: Any, member: Any) -> None:
    different = x.different
    there: dict[int, list[float]] = {}
    for i, (value, abscissa) in enumerate(zip(quantity.values, x.values, strict=True)):
        if value is not None and abscissa is not None and (mask is None or mask[i]):
            there.setdefault(different.index(abscissa), []).append(value)
    if not there:
        return
    order = sorted(there)
    at = [different[k] if x.numeric else k for k in order]
    middle = [float(np.median(there[k])) for k in order]
    label = None if member is None else unformatted(_text(member))
    line = "-" if x.numeric else ""  # categories have no order
    axes.plot(at, middle, "o", ls=line, color=colour, ms=3.5, label=label)
    if max(map(len, there.values())) > 1:
        low, high = [min(there[k]) for k in order], [max(there[k]) for k in order]
        if len(at) > 1 and x.numeric:
            axes.fill_between(at, low, high, color=colour, alpha=0.15, lw=0)
        else:
            axes.vlines(at, low, high, color=colour, alpha=0.4, lw=4)


@styled()
def map_figure(quantities: Sequence[Column], x: Column, y: Column) -> Figure:
    """Quantities over two parameters in colours; the median where several runs share a point."""
    figure, cells = _panels(len(quantities))
    columns, rows = x.different, y.different
    for axes, quantity in zip(cells, quantities, strict=True):
        there: dict[tuple[int, int], list[float]] = {}
        for triple in zip(quantity.values, x.values, y.values, strict=True):
            if None not in triple:
                value, a, b = triple
                there.setdefault((rows.index(b), columns.index(a)), []).append(value)
        values = np.full((len(rows), len(columns)), np.nan)
        for cell, found in there.items():
            values[cell] = float(np.median(found))
        _draw_map(figure, axes, values)
        axes.set(title=quantity.words, xlabel=x.words, ylabel=y.words)
        _ticks(axes.set_xticks, columns)
        _turned(axes)
        _ticks(axes.set_yticks, rows)
    return figure


def _draw_map(figure: Figure, axes: Axes, values: Any) -> None:
    axes.grid(False)
    image = axes.imshow(values, origin="lower", aspect="auto", cmap="viridis")
    figure.colorbar(image, ax=axes, pad=0.02)
    if values.size > 60:
        return
    middle = 0.5 * (np.nanmin(values) + np.nanmax(values))
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if value < middle else "black"
            axes.text(
                column, row, f"{value:.3g}", ha="center", va="center", fontsize=7, color=colour
            )


def _ticks(tell: Any, values: Sequence[Any]) -> None:
    step = -(-len(values) // 8)
    indices = range(0, len(values), step)
    tell(list(indices), [unformatted(_text(values[index])) for index in indices])


def _turned(axes: Axes) -> None:
    """Turn the labels below axes where they would run into each other."""
    if sum(len(label.get_text()) + 2 for label in axes.get_xticklabels()) > WIDE:
        axes.tick_params(axis="x", labelrotation=30)
        for label in axes.get_xticklabels():
            label.set(ha="right", rotation_mode="anchor")


@styled()
def ranking_figure(quantities: Sequence[Column], names: Sequence[str]) -> Figure:
    """The runs with the largest values of each quantity."""
    most = max(min(MOST_RANKED, sum(v is not None for v in q.values)) for q in quantities)
    figure = Picture(9.8, len(quantities) * (0.9 + 0.2 * max(most, 2)))
    grid = figure.subplots(len(quantities), 1, squeeze=False)
    for axes, quantity in zip(grid[:, 0], quantities, strict=True):
        pairs = [(v, n) for v, n in zip(quantity.values, names, strict=True) if v is not None]
        shown = sorted(pairs, key=lambda pair: -pair[0])[:MOST_RANKED]
        lengths, labels = [v for v, _ in shown], [unformatted(_shortened(n)) for _, n in shown]
        bars = axes.barh(labels, lengths, color=DISTINCT[0], height=0.7)
        axes.bar_label(bars, [f"{value:.4g}" for value, _ in shown], padding=3, fontsize=7)
        axes.invert_yaxis()
        axes.margins(x=0.1, y=0.02)
        axes.tick_params(axis="y", labelsize=7)
        left_out = len(pairs) - len(shown)
        more = f", the largest {len(shown)} of {len(pairs)}" if left_out else ""
        axes.set_title(quantity.words + more)
    return figure


def _shortened(name: str) -> str:
    return name if len(name) <= LONGEST else f"...{name[3 - LONGEST :]}"


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _panels(count: int) -> tuple[Picture, list[Axes]]:
    across, wide = (1, 6.8) if count == 1 else (2, 10.0)
    return grid_of(count, across, wide, 2.9, 1.0)


def _colours(count: int) -> list[Any]:
    if count <= FEW:
        return list(DISTINCT[:count])
    scale = matplotlib.colormaps["viridis"]
    return [scale(0.92 * k / (count - 1)) for k in range(count)]


def _legend(figure: Figure, axes: Axes, title: str) -> None:
    handles, labels = axes.get_legend_handles_labels()
    longest = max(map(len, labels), default=1)
    fitting = max(1, int(figure.get_figwidth() / (0.45 + 0.075 * longest)))
    figure.legend(
        handles,
        labels,
        loc="outside lower left",
        alignment="left",
        title=title,
        ncols=min(fitting, 8, len(labels)),
    )
