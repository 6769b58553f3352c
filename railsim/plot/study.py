"""Pictures of studies: values over what was varied, optimisations, wear, a track that was judged.

Families of curves, heat maps and rankings of the runs of a study; the Pareto front of an
optimisation and what its values depend on; a wheel that wears; limits over a track.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.arrays import Flags, Floats, largest_first
from railsim.description.values import short
from railsim.plot.style import DISTINCT, LIMIT, Picture, grid_of, note, styled
from railsim.text import unformatted

if TYPE_CHECKING:
    from railsim.profiles import Profile

MOST_RANKED = 25
FEW = 6  # members of a family that have colours of their own; more get those of a scale
WIDE = 46  # letters of labels side by side below axes
LONGEST = 60  # letters of a run's name in a ranking


@dataclass(frozen=True)
class Column:
    """Something that runs have, one value for each."""

    words: str  # for axes, with the unit
    values: list[Any]  # numbers or texts; None where a run has none
    decimals: int | None = None  # of printed tables; None: of any size

    @property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, int | float) for value in self.values if value is not None)

    @property
    def different(self) -> list[Any]:
        """Its values, each once, sorted."""
        present = {value for value in self.values if value is not None}
        return sorted(present, key=lambda value: (isinstance(value, str), value))

    @property
    def least(self) -> float:
        """Last digit of printed tables; 0 where they have no fixed number of digits."""
        return 0.0 if self.decimals is None else 0.1**self.decimals

    @property
    def limits(self) -> tuple[float, float] | None:
        """Limits of an axis where the values differ by less than the digits of tables show."""
        present = [value for value in self.values if value is not None]
        if not present or max(present) - min(present) >= 2.0 * self.least:
            return None
        middle = 0.5 * (min(present) + max(present))
        return middle - self.least, middle + self.least

    def text(self, value: float, digits: int) -> str:
        """Return a number with so many digits, none beyond those of tables: 1570, 38.0, 0.00."""
        if self.decimals is None:
            return f"{float(f'{value:.{digits}g}'):g}"
        rounded = round(value, self.decimals) + 0.0
        size = math.floor(math.log10(max(abs(rounded), 0.1**self.decimals)))
        return f"{rounded:.{max(0, min(self.decimals, digits - 1 - size))}f}"


@styled()
def curves_figure(
    quantities: Sequence[Column], x: Column, family: Column | None, early: Sequence[bool] = ()
) -> Figure:
    """Quantities over a parameter, a curve for each member of a family.

    Where several runs share a point, the curve is their median and a band goes from the smallest to
    the largest.  Over categories there are points and bars, which no line joins.  `early`: Which
    runs ended early; they bear crosses.
    """
    members = [None] if family is None else family.different
    scale, last = matplotlib.colormaps["viridis"], max(1, len(members) - 1)
    shades = [scale(0.92 * k / last) for k in range(len(members))]
    colours = DISTINCT[: len(members)] if len(members) <= FEW else shades
    others = [None] * len(x.values) if family is None else family.values
    points = list(zip(x.values, others, strict=True))
    figure, cells = _panels(len(quantities))
    _name_medians(figure, points, "; bands from the smallest to the largest")
    for axes, quantity in zip(cells, quantities, strict=True):
        for member, colour in zip(members, colours, strict=True):
            mask = [value == member for value in others]
            _curve(axes, quantity, x, mask, colour, member)
        for value, abscissa, crossed in zip(quantity.values, x.values, early, strict=False):
            if crossed and None not in (value, abscissa):
                place = abscissa if x.numeric else x.different.index(abscissa)
                axes.plot(place, value, "x", color=LIMIT, ms=7)
        axes.set(title=quantity.words, xlabel=x.words)
        if quantity.limits:
            axes.set_ylim(quantity.limits)
        if not x.numeric:
            axes.set_xticks(range(len(x.different)), [unformatted(str(v)) for v in x.different])
            _turn_labels(axes)
    if family is not None:
        handles, labels = cells[0].get_legend_handles_labels()
        longest = max(map(len, labels), default=1)
        fitting = max(1, int(figure.get_figwidth() / (0.45 + 0.075 * longest)))
        look: Any = {"loc": "outside lower left", "alignment": "left", "title": family.words}
        figure.legend(handles, labels, ncols=min(fitting, 8, len(labels)), **look)
    return figure


def _name_medians(figure: Figure, points: Sequence[Any], ending: str = "") -> None:
    """Say above a picture that it shows medians, where several runs share a point."""
    if len(set(points)) < len(points):
        say_above(figure, f"Medians of the runs at each point{ending}")


def say_above(figure: Figure, text: str) -> None:
    """Add a line above a picture, over those that are there."""
    lines = "\n".join(filter(None, [text, figure.get_suptitle()]))
    figure.suptitle(lines, x=0.012, ha="left", fontsize=8.5, fontweight="normal")


def _curve(axes: Axes, quantity: Column, x: Column, mask: Any, colour: Any, member: Any) -> None:
    different = x.different
    groups: dict[int, list[float]] = {}
    for i, (value, abscissa) in enumerate(zip(quantity.values, x.values, strict=True)):
        if value is not None and abscissa is not None and mask[i]:
            groups.setdefault(different.index(abscissa), []).append(value)
    if not groups:
        return
    order = sorted(groups)
    at = [different[k] if x.numeric else k for k in order]
    middle = [float(np.median(groups[k])) for k in order]
    label = None if member is None else unformatted(short(member))
    line = "-" if x.numeric else ""  # categories have no order
    axes.plot(at, middle, "o", ls=line, color=colour, ms=3.5, label=label)
    if max(map(len, groups.values())) > 1:
        low, high = [min(groups[k]) for k in order], [max(groups[k]) for k in order]
        if len(at) > 1 and x.numeric:
            axes.fill_between(at, low, high, color=colour, alpha=0.15, lw=0)
        else:
            axes.vlines(at, low, high, color=colour, alpha=0.4, lw=4)


@styled()
def map_figure(quantities: Sequence[Column], x: Column, y: Column) -> Figure:
    """Quantities over two parameters in colours; the median where several runs share a point.

    Points that fill less than half of a grid, as those of a sample, are drawn where they are.
    """
    figure, cells = _panels(len(quantities))
    points = list(zip(x.values, y.values, strict=True))
    _name_medians(figure, points)
    columns, rows = x.different, y.different
    scattered = x.numeric and y.numeric and 2 * len(set(points)) < len(columns) * len(rows)
    for axes, quantity in zip(cells, quantities, strict=True):
        groups: dict[tuple[int, int], list[float]] = {}
        for triple in zip(quantity.values, x.values, y.values, strict=True):
            if None not in triple:
                value, a, b = triple
                groups.setdefault((rows.index(b), columns.index(a)), []).append(value)
        values = np.full((len(rows), len(columns)), np.nan)
        for cell, found in groups.items():
            values[cell] = float(np.median(found))
        axes.set(title=quantity.words, xlabel=x.words, ylabel=y.words)
        if scattered:
            up, along = at = np.nonzero(np.isfinite(values))
            places = np.take(columns, along), np.take(rows, up)
            dots = axes.scatter(*places, c=values[at], cmap="viridis")
            dots.set_clim(quantity.limits)
            figure.colorbar(dots, ax=axes, pad=0.02)
            continue
        _draw_map(figure, axes, values, quantity)
        _ticks(axes.set_xticks, columns)
        _turn_labels(axes)
        _ticks(axes.set_yticks, rows)
    return figure


def _draw_map(figure: Figure, axes: Axes, values: Any, quantity: Column) -> None:
    axes.grid(False)
    image = axes.imshow(values, origin="lower", aspect="auto", cmap="viridis")
    image.set_clim(quantity.limits)
    figure.colorbar(image, ax=axes, pad=0.02)
    if values.size > 60:
        return
    middle = 0.5 * (np.nanmin(values) + np.nanmax(values))
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            colour = "white" if value < middle else "black"
            look: Any = {"ha": "center", "va": "center", "fontsize": 7, "color": colour}
            axes.text(column, row, quantity.text(value, 3), **look)


def _ticks(tell: Any, values: Sequence[Any]) -> None:
    step = -(-len(values) // 8)
    indices = range(0, len(values), step)
    tell(list(indices), [unformatted(short(values[index])) for index in indices])


def _turn_labels(axes: Axes) -> None:
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
        order = largest_first(quantity.values)
        shown = [(quantity.values[k], names[k]) for k in order[:MOST_RANKED]]
        names_shown = [n if len(n) <= LONGEST else f"...{n[3 - LONGEST :]}" for _, n in shown]
        lengths, labels = [v for v, _ in shown], [*map(unformatted, names_shown)]
        bars = axes.barh(labels, lengths, color=DISTINCT[0], height=0.7)
        axes.bar_label(bars, [quantity.text(value, 4) for value, _ in shown], padding=3, fontsize=7)
        axes.invert_yaxis()
        axes.margins(x=0.1, y=0.02)
        if max(map(abs, lengths), default=0.0) < quantity.least:
            axes.set_xlim(-quantity.least, quantity.least)
        axes.tick_params(axis="y", labelsize=7)
        left_out = len(order) - len(shown)
        more = f", the largest {len(shown)} of {len(order)}" if left_out else ""
        axes.set_title(quantity.words + more)
    return figure


def _panels(count: int) -> tuple[Picture, list[Axes]]:
    across, wide = (1, 6.8) if count == 1 else (2, 10.0)
    return grid_of(count, across, wide, 2.9, 1.0)


MOST_PAIRS = 6
NARROW = 0.05  # of the widest bar, below which its ends bear no words
NUMBERED = 12  # designs of a front that are numbered


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
    line = "-" if values.shape[1] == 2 and _is_monotonic(values[front]) else ""
    axes.plot(*values[front].T, "o", ls=line, color=DISTINCT[0], ms=4.5, label="front")
    if chosen is not None:
        axes.plot(*values[chosen], "o", mfc="none", mec=LIMIT, mew=1.6, ms=11, label="chosen")
    if len(front) <= NUMBERED:
        for number in front:
            note(axes, str(number + 1), values[number], (4, 4))


def _is_monotonic(values: Floats) -> bool:
    """Whether points that follow each other go one way in both directions."""
    steps = np.diff(values, axis=0)
    return bool(len(steps)) and all(
        (steps[:, k] >= 0).all() or (steps[:, k] <= 0).all() for k in range(values.shape[1])
    )


@styled()
def sensitivity_figure(records: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> Figure:
    """Tornado about the chosen design, and Sobol indices over the whole range, for each quantity.

    `records`: Records of `railsim.studies.sensitivity.Sensitivity`. `labels`: Quantities with their
    units.
    """
    figure = Picture(10.2, len(records) * (1.3 + 0.32 * len(records[0]["low"])))
    grid = figure.subplots(len(records), 2, squeeze=False)
    for (left, right), record, label in zip(grid, records, labels, strict=True):
        _tornado(left, record, label)
        _indices(right, record)
    handles, names = grid[0][1].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower right", ncols=2)
    return figure


def _tornado(axes: Axes, record: Mapping[str, Any], label: str) -> None:
    names = sorted(record["low"], key=lambda name: abs(record["high"][name] - record["low"][name]))
    axes.use_sticky_edges = False
    widest = max(abs(record["high"][name] - record["low"][name]) for name in names)
    for row, name in enumerate(names):
        low, high = record["low"][name], record["high"][name]
        axes.barh(row, high - low, left=low, height=0.55, color=DISTINCT[4], zorder=2)
        if abs(high - low) < NARROW * widest:
            continue
        for value, end in ((low, "low"), (high, "high")):
            outer = (value >= max(low, high)) if end == "high" else (value > min(low, high))
            shift, ha = ((4, 0), "left") if outer else ((-4, 0), "right")
            note(axes, end, (value, row), shift, ha, "center")
    axes.set_yticks(range(len(names)), [name.removeprefix("vehicle.") for name in names])
    axes.set(xlabel=label, title="From bound to bound, the others as chosen")
    axes.margins(x=0.15)


def _indices(axes: Axes, record: Mapping[str, Any]) -> None:
    names = sorted(record["total"], key=lambda name: record["total"][name])
    rows = np.arange(len(names))
    total = [record["total"][name] for name in names]
    first = [record["first"][name] for name in names]
    axes.barh(rows + 0.17, total, height=0.3, color=DISTINCT[0], label="with interactions")
    axes.barh(rows - 0.17, first, height=0.3, color=DISTINCT[5], label="alone")
    axes.set_yticks(rows, [name.removeprefix("vehicle.") for name in names])
    axes.set(xlim=(0.0, max(1.0, *total, *first)), xlabel="share of the variance")
    axes.set(title=f"Sobol indices (surrogate's error {100.0 * record['error']:.0f} %)")


PROFILE = (-0.045, 0.035)  # m from the nominal rolling circle


@styled()
def wear_figure(
    wheels: Sequence[tuple[float, "Profile"]],
    rows: Sequence[Mapping[str, float | None]],
    title: str,
) -> Figure:
    """New and worn profiles, depth of wear, equivalent conicity at 3 mm.

    `wheels` ([m]): The new wheel, then the wheel after each step. `rows`: Of
    `railsim.studies.wear_loop.wear_rows`. `title`: What was analysed.
    """
    figure = Picture(8.6, 7.6, title)
    outline, depth, conicity = figure.subplots(3, 1, height_ratios=[1.0, 1.2, 0.8])
    _draw_wear(outline, depth, wheels, 1e-3, "km")
    depth.set_xlim(1e3 * PROFILE[0], 1e3 * PROFILE[1])
    depth.set(xlabel="y from the nominal rolling circle, flange negative (mm)")
    values = [row["equivalent_conicity"] for row in rows]
    kilometres = [1e-3 * distance for distance, _ in wheels]
    conicity.plot(kilometres, [np.nan if v is None else v for v in values], "o-", ms=4)
    conicity.set(xlabel="distance (km)", ylabel="conicity at 3 mm")
    conicity.set_ylim(0.0, 1.15 * conicity.get_ylim()[1])
    conicity.set_xlim(left=0.0)
    return figure


@styled()
def rail_wear_figure(rails: Mapping[str, Sequence[tuple[float, "Profile"]]], title: str) -> Figure:
    """New and worn profiles and depth of wear of both rails.

    `rails` ([kg]): The new rail, then the rail after each step, by side. `title`: What was
    analysed.
    """
    figure = Picture(9.8, 5.6, title)
    axes = figure.subplots(2, 2, height_ratios=[1.0, 1.2], sharey="row")
    for (outline, depth), (side, steps) in zip(axes.T, rails.items(), strict=True):
        _draw_wear(outline, depth, steps, 1e-9, "Mt")
        outline.set_title(f"{side} rail")
        depth.set(xlabel="y from the middle of the rail, gauge side negative (mm)")
    return figure


def _draw_wear(
    outline: Axes, depth: Axes, steps: Sequence[tuple[float, "Profile"]], scale: float, unit: str
) -> None:
    """Draw the new and the last profile, and the depth of wear after each step, in a unit."""
    new, last = steps[0][1], steps[-1][1]
    depth.sharex(outline)
    outline.plot(1e3 * new.y, 1e3 * new.z, color="0.2", lw=1.2, label="new")
    words = f"{scale * steps[-1][0]:g} {unit}"
    outline.plot(1e3 * last.y, 1e3 * last.z, color="C3", lw=1.0, label=words)
    if not outline.yaxis_inverted():
        outline.invert_yaxis()
    outline.set_ylabel("z (mm)")
    outline.legend()
    for number, (amount, worn) in enumerate(steps[1:], start=1):
        lost = 1e3 * np.abs(np.asarray(new.z) - np.asarray(worn.z))
        share = 0.25 + 0.75 * number / (len(steps) - 1)
        label = f"{scale * amount:g} {unit}" if number in (1, len(steps) - 1) else None
        depth.plot(1e3 * new.y, lost, color="C3", alpha=share, lw=1.0, label=label)
    depth.set_ylim(bottom=0.0)
    depth.set_ylabel("depth of wear in z (mm)")
    depth.legend()


LABELS = {"Y_over_Q": "Y/Q", "sum_Y": "sum Y", "body_y": "floor y", "body_z": "floor z"}


@styled()
def heat_strip(
    cells: Floats, shares: Mapping[tuple[str, float, str], Floats], length: float
) -> Figure:
    """Draw one row for each vehicle, speed and quantity; a cross where a limit is exceeded.

    `cells`: begin of each along the track [m]; `length`: of each [m].
    """
    figure = Picture(10.0, 1.4 + 0.24 * len(shares))
    axes, rows = figure.subplots(), np.arange(len(shares) + 1)
    if shares:
        edges = np.append(cells, cells[-1] + length) / 1e3
        values = np.array([*shares.values()])
        scale = matplotlib.colormaps["Blues"].with_extremes(over=LIMIT, bad="none")
        mesh = axes.pcolormesh(edges, rows, values, cmap=scale, vmin=0.0, vmax=1.0)
        figure.colorbar(mesh, ax=axes, label="share of the limit", extend="max")
        row, cell = np.nonzero(values > 1.0)  # in black and white, too
        axes.plot((edges[cell] + edges[cell + 1]) / 2.0, row + 0.5, "wx", ms=4.0)
        axes.patch.set(hatch="////", edgecolor="0.6")
        axes.set_title("Red with a cross: above the limit; hatched: no run")
    words = [f"{name}, {3.6 * speed:.0f} km/h, {LABELS.get(q, q)}" for name, speed, q in shares]
    axes.set_yticks(rows[:-1] + 0.5, words)
    axes.set(xlabel="s (km)")
    axes.invert_yaxis()
    return figure
