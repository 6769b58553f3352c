"""Pictures of an optimisation: the Pareto front, and what its values depend on."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.arrays import Flags, Floats
from railsim.plot.style import DISTINCT, LIMIT, Picture, grid_of, note, styled

MOST_PAIRS = 6
NARROW = 0.05  # of the widest bar, below which its ends bear no words
FEW = 12  # designs of a front that are numbered


@styled()
def front_figure(
    values: Floats, labels: Sequence[str], feasible: Flags, front: Sequence[int], chosen: int | None
) -> Figure:
    """All designs, the front and the chosen one, for each pair of objectives.

    `values` (float64[design, objective]). `labels`: Objectives with their units. `feasible`
    (bool[design]). `front`: Designs of the front.
    """
    single = values.shape[1] == 1
    if single:
        values = np.column_stack([np.arange(1.0, len(values) + 1.0), values])
        labels = ["design", *labels]
    pairs = list(combinations(range(values.shape[1]), 2))[:MOST_PAIRS]
    columns = min(3, len(pairs))
    figure, cells = grid_of(len(pairs), columns, 6.4 if columns == 1 else 4.4 * columns, 4.4, 0.0)
    for axes, (i, j) in zip(cells, pairs, strict=True):
        _pair(axes, values[:, [i, j]], feasible, list(front), chosen)
        axes.set(xlabel=labels[i], ylabel=labels[j])
    if single:
        cells[0].set_title("Designs in the order of computation")
    cells[0].legend(loc="best")
    return figure


def _pair(
    axes: Axes, values: Floats, feasible: Flags, front: list[int], chosen: int | None
) -> None:
    others = np.ones(len(values), bool)
    others[front] = False
    axes.plot(*values[others & feasible].T, "o", color="0.72", ms=3.5, label="designs")
    if (~feasible).any():
        axes.plot(*values[~feasible].T, "x", color="0.6", ms=4, label="infeasible")
    # a line joins the front only where it orders it
    line = "-" if values.shape[1] == 2 and _ordered(values[front]) else ""
    axes.plot(*values[front].T, "o", ls=line, color=DISTINCT[0], ms=4.5, label="front")
    if chosen is not None:
        axes.plot(*values[chosen], "o", mfc="none", mec=LIMIT, mew=1.6, ms=11, label="chosen")
    if len(front) <= FEW:
        for number in front:
            note(axes, str(number + 1), values[number], (4, 4))


def _ordered(values: Floats) -> bool:
    """Whether points that follow each other go one way in both directions."""
    steps = np.diff(values, axis=0)
    return bool(len(steps)) and all(
        (steps[:, k] >= 0).all() or (steps[:, k] <= 0).all() for k in range(values.shape[1])
    )


@styled()
def sensitivity_figure(found: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> Figure:
    """Tornado about the chosen design, and Sobol indices over the whole range, for each quantity.

    `found`: Records of `railsim.studies.sensitivity.Sensitivity`. `labels`: Quantities with their
    units.
    """
    count = len(found[0]["low"])
    figure = Picture(10.2, len(found) * (1.3 + 0.32 * count))
    grid = figure.subplots(len(found), 2, squeeze=False)
    for (left, right), one, label in zip(grid, found, labels, strict=True):
        _tornado(left, one, label)
        _indices(right, one)
    handles, names = grid[0][1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower right", ncols=2)
    return figure


def _tornado(axes: Axes, one: Mapping[str, Any], label: str) -> None:
    names = sorted(one["low"], key=lambda name: abs(one["high"][name] - one["low"][name]))
    axes.use_sticky_edges = False
    widest = max(abs(one["high"][name] - one["low"][name]) for name in names)
    for row, name in enumerate(names):
        low, high = one["low"][name], one["high"][name]
        axes.barh(row, high - low, left=low, height=0.55, color=DISTINCT[4], zorder=2)
        if abs(high - low) < NARROW * widest:
            continue
        for value, words in ((low, "low"), (high, "high")):
            outer = (value >= max(low, high)) if words == "high" else (value > min(low, high))
            shift, ha = ((4, 0), "left") if outer else ((-4, 0), "right")
            note(axes, words, (value, row), shift, ha, "center")
    axes.set_yticks(range(len(names)), [name.removeprefix("vehicle.") for name in names])
    axes.set(xlabel=label, title="From bound to bound, the others as chosen")
    axes.margins(x=0.15)


def _indices(axes: Axes, one: Mapping[str, Any]) -> None:
    names = sorted(one["total"], key=lambda name: one["total"][name])
    rows = np.arange(len(names))
    total = [one["total"][name] for name in names]
    first = [one["first"][name] for name in names]
    axes.barh(rows + 0.17, total, height=0.3, color=DISTINCT[0], label="with interactions")
    axes.barh(rows - 0.17, first, height=0.3, color=DISTINCT[5], label="alone")
    axes.set_yticks(rows, [name.removeprefix("vehicle.") for name in names])
    axes.set(xlim=(0.0, max(1.0, *total, *first)), xlabel="share of the variance")
    axes.set(title=f"Sobol indices (surrogate's error {100.0 * one['error']:.0f} %)")
