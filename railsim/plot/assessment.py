"""Assessments as pictures: estimates in per cent of their limits, comfort along the car, wear."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from railsim.assessment import Assessment
from railsim.assessment.comfort_report import PointComfort
from railsim.assessment.criteria import WORDS
from railsim.assessment.wear import shakedown_limit
from railsim.assessment.wear_report import WheelWear
from railsim.assessment.zones import Assessed, ZoneReport
from railsim.definitions.limits import ComfortLimits
from railsim.errors import input_error
from railsim.plot.style import BESIDE, DISTINCT, LIMIT, Picture, distinct, key, note, styled, wrap
from railsim.text import unformatted

LEAST_SPEEDS = 3  # for curves over the speed
LONGEST_BAR = 250.0  # per cent; longer ones are cut and say how long they are


@styled()
def assessment_figure(assessments: Sequence[Assessment]) -> Figure | None:
    """Draw assessments of one standard, vehicles side by side; None where nothing is to draw."""
    if any(zone.rows for a in assessments for zone in a.zones):
        return _limits_figure(assessments)
    if any(a.comfort for a in assessments):
        speeds = {speed for a in assessments for speed, _, _ in a.driven.values()}
        over = _comfort_over_speed if len(speeds) >= LEAST_SPEEDS else _comfort_figure
        return over(assessments)
    if any(a.wear for a in assessments):
        return _wear_figure(assessments)
    return None


def single_figure(assessment: Assessment) -> Figure:
    """Draw one assessment; raises InputError where nothing is to draw."""
    figure = assessment_figure([assessment])
    if figure is None:
        raise input_error("assessment", "nothing to draw", "one with values", assessment.standard)
    return figure


def _limits_figure(assessments: Sequence[Assessment]) -> Figure:
    """Bars of each quantity's worst row, zone by zone, in per cent of the limit."""
    reports = [zone for a in assessments for zone in a.zones]
    zones = sorted({zone.zone for zone in reports if zone.rows})
    rules = {row.criterion.name: row.criterion for a in assessments for row in a.worst}
    height = 1.6 + (0.17 * len(assessments) + 0.10) * len(rules)
    figure = Picture(max(6.8, 2.4 + 2.6 * len(zones)), height)
    axes = figure.subplots(1, len(zones), sharey=True, squeeze=False)[0]
    width = 0.8 / len(assessments)
    most = 110.0
    for zone, ax in zip(zones, axes, strict=True):
        for k, assessment in enumerate(assessments):
            worst = assessment.worst_in(zone)
            shares = [100.0 * worst[name][1].share if name in worst else np.nan for name in rules]
            rows = np.arange(len(rules)) + (k - 0.5 * (len(assessments) - 1)) * width
            label = _verdicts(assessment, figure) if ax is axes[0] else None
            ax.barh(rows, shares, 0.9 * width, color=distinct(k), label=label)
            most = max(most, 1.1 * float(np.nanmax([0.0, *shares])))
            for row, share in zip(rows, shares, strict=True):
                if share > LONGEST_BAR:
                    at = (0.98 * LONGEST_BAR, row)
                    note(ax, f"{share:.0f} %", at, (0, 0), "right", "center", color="w")
        ax.axvline(100.0, color=LIMIT, lw=1.0)
        ax.set(title=f"Zone {zone}", xlabel="estimate / limit (%)")
        ax.grid(axis="y", visible=False)
    axes[0].set_yticks(range(len(rules)), [rule.words for rule in rules.values()])
    axes[0].invert_yaxis()
    for ax in axes:
        ax.set_xlim(0.0, min(most, LONGEST_BAR))
        ax.xaxis.set_major_locator(MaxNLocator(5, prune="upper"))  # apart from the next axes' 0
    edition = next((a.limits.edition for a in assessments if a.limits), "")
    figure.suptitle(edition, x=0.012, ha="left", fontsize=10)
    figure.legend(loc="outside lower left")
    return figure


def _verdicts(assessment: Assessment, figure: Figure) -> str:
    parts = [f"{WORDS[name]} {verdict.value}" for name, verdict in assessment.verdicts.items()]
    lines = f"{assessment.vehicle}: {assessment.verdict}", ", ".join(parts)
    return "\n".join(wrap(line, figure.get_figwidth() - 0.5) for line in lines)


@styled()
def sections_figure(assessments: Sequence[Assessment]) -> Figure | None:
    """Draw the values of the sections over the distance; None where there are no zones.

    A row of axes for each vehicle, one for each zone; of each quantity the values where their
    share of the limit is largest.
    """
    reports = [zone for a in assessments for zone in a.zones if zone.values and zone.rows]
    if not reports:
        return None
    zones = sorted({zone.zone for zone in reports})
    names = list(dict.fromkeys(row.criterion.name for zone in reports for row in zone.rows))
    looks: dict[str, dict[str, Any]] = {
        name: {"color": distinct(k), "marker": "o^"[k // len(DISTINCT) % 2], "ls": "", "ms": 4}
        for k, name in enumerate(names)
    }
    x, height = "middle of the section (km)", 1.8 + 2.4 * len(assessments)
    figure, grid = _by_zone(assessments, zones, x, height, sharex="col")
    for axes, assessment in zip(grid, assessments, strict=True):
        for ax, zone in zip(axes, zones, strict=True):
            for report in assessment.zones:
                if report.zone == zone:
                    _sections(ax, report, looks)
            ax.axhline(100.0, color=LIMIT, lw=1.0)
            ax.set_ylim(bottom=0.0)
        axes[0].set_ylabel("section value / limit (%)")
    words = {row.criterion.name: row.criterion.words for zone in reports for row in zone.rows}
    handles = [key(words[name], **look) for name, look in looks.items()]
    figure.legend(handles=handles, loc="outside lower left", ncols=2)
    return figure


def _by_zone(
    assessments: Sequence[Assessment], zones: Sequence[str], x: str, height: float, **how: Any
) -> tuple[Picture, Any]:
    """A row of axes for each vehicle, under its name, one for each zone."""
    figure = Picture(max(6.8, 1.2 + 2.8 * len(zones)), height)
    grid = figure.subplots(len(assessments), len(zones), squeeze=False, **how)
    for axes, assessment in zip(grid, assessments, strict=True):
        # above the zones, and as wide as all of them: those of the zones make room for it
        name = wrap(assessment.vehicle, figure.get_figwidth() - 0.6)
        axes[0].set_title(f"{name}\n", loc="left", fontsize=9).set_in_layout(False)
        for ax, zone in zip(axes, zones, strict=True):
            ax.set_title("\n" * (name.count("\n") + 1) + f"zone {zone}", loc="right", fontsize=9)
    for ax in grid[-1]:
        ax.set_xlabel(x)
    return figure, grid


def _sections(ax: Axes, report: ZoneReport, looks: Mapping[str, Mapping[str, Any]]) -> None:
    """Largest share of its limit of every quantity in every section of a zone."""
    for name, look in looks.items():
        limits = {row.place: row.limit for row in report.rows if row.criterion.name == name}
        points = []
        for part in report.values:
            shares = [
                max(part.values[name, p]) / limits[p] for p in limits if (name, p) in part.values
            ]
            if shares:
                middle = 5e-4 * (part.section.begin + part.section.end)
                points.append((middle, 100.0 * max(shares)))
        if points:
            ax.plot(*zip(*points, strict=True), **look)


@styled()
def regression_figure(assessments: Sequence[Assessment]) -> Figure | None:
    """Draw section values over the cant deficiency with regression line and upper bound.

    A row of axes for each vehicle, one for each zone of curves: the quantity of the two-dimensional
    method that is nearest to its limit, of all populations.  None where there is none.
    """
    chosen = [{zone: row for zone in "234" if (row := _widest(a, zone))} for a in assessments]
    zones = sorted({zone for rows in chosen for zone in rows})
    if not zones:
        return None
    names = list(dict.fromkeys(z.population.name for a in assessments for z in a.zones))
    height = 1.4 + 2.6 * len(assessments)
    figure, grid = _by_zone(assessments, zones, "cant deficiency (mm)", height)
    for axes, assessment, rows in zip(grid, assessments, chosen, strict=True):
        for ax, zone in zip(axes, zones, strict=True):
            if zone not in rows:
                ax.set_axis_off()
                ax.set_title("", loc="right")
                continue
            for report in assessment.zones:
                if report.zone == zone:
                    colour = distinct(names.index(report.population.name))
                    _regression(ax, report, rows[zone], colour)
            row = rows[zone]
            unit = row.criterion.unit.replace("-", "1")
            ax.set_ylabel(f"{row.criterion.words},\n{row.place} ({unit})", fontsize=8)
    looks: dict[str, Any] = {"regression": {}, "upper bound": {"ls": "--"}}
    looks |= {"estimate": {"marker": "D", "ls": ""}, "limit": {"color": LIMIT, "marker": "<"}}
    handles = [key(words, **{"color": "0.25"} | look) for words, look in looks.items()]
    if any(names):
        handles += [key(name, marker="o", ls="", color=distinct(k)) for k, name in enumerate(names)]
    figure.legend(handles=handles, loc="outside lower left", ncols=4)  # where it hides no value
    return figure


def _widest(assessment: Assessment, zone: str) -> Assessed | None:
    """Row with an upper bound, of the verdicts that decide, with the largest share in a zone."""
    deciding = getattr(assessment.limits, "deciding", ())
    rows = [row for report in assessment.zones if report.zone == zone for row in report.rows]
    bounded = [r for r in rows if r.estimate.line is not None and r.estimate.line.quantile > 0.0]
    decides = (row for row in bounded if row.criterion.group in deciding)
    return max(decides, key=lambda row: row.share, default=None)


def _regression(ax: Axes, report: ZoneReport, like: Assessed, colour: str) -> None:
    """Draw the values of one quantity at one place in one population, and its limit."""
    own, scale = (like.criterion.name, like.place), like.criterion.scale
    sections = [v for v in report.values if own in v.values]
    points = [(1e3 * v.section.cant_deficiency, scale * max(v.values[own])) for v in sections]
    if points:
        ax.plot(*zip(*points, strict=True), "o", color=colour, ms=3.5)
    row = next((r for r in report.rows if (r.criterion.name, r.place) == own), None)
    if row is None:
        return
    ax.axhline(scale * row.limit, color=LIMIT, lw=1.0)  # of its own static loads
    edge: Any = {"transform": ax.get_yaxis_transform(), "clip_on": False}
    ax.plot(1.0, scale * row.limit, "<", color=colour, ms=5, **edge)
    line = row.estimate.line
    if line is None:
        return
    places = [1e3 * line.target, *(deficiency for deficiency, _ in points)]
    x = np.linspace(min(places), max(places), 60)
    ax.plot(x, scale * line.at(1e-3 * x), color=colour, lw=1.2)
    ax.plot(x, scale * line.bound(1e-3 * x), color=colour, lw=1.0, ls="--")
    ax.plot(1e3 * line.target, scale * row.estimate.value, "D", color=colour, ms=5)


def _comfort_over_speed(assessments: Sequence[Assessment]) -> Figure:
    """Mean comfort and Sperling's index over the speed, a curve for each vehicle and rails.

    The line is the middle of the car, the band all its measuring points; behind the mean comfort
    the classes of the standard.
    """
    figure, mean, index = _comfort_axes(assessments, 10.2, 4.4, "speed (km/h)")
    kinds: dict[tuple[str, str, str], list[tuple[float, Sequence[PointComfort]]]] = {}
    for a in assessments:
        for run, points in a.comfort.items():
            speed, track, rails = a.driven[run]
            kinds.setdefault((a.vehicle, track, rails), []).append((3.6 * speed, points))
    several = [len({kind[k] for kind in kinds}) > 1 for k in range(3)]  # vehicles, tracks, rails
    for number, (kind, runs) in enumerate(kinds.items()):
        words = [word for word, differs in zip(kind, several, strict=True) if differs]
        colour = distinct(number)
        runs.sort(key=lambda run: run[0])
        label = unformatted(", ".join(words)) or "middle of the car"
        _draw_over_speed(mean, runs, lambda p: p.mean.N_MV, "-", color=colour, label=label)
        for way, line in (("lateral", "-"), ("vertical", "--")):
            _draw_over_speed(index, runs, lambda p, way=way: p.sperling[way], line, color=colour)  # type: ignore[misc]
    for ax in (mean, index):
        ax.set_ylim(bottom=0.0)
    _classes(mean, assessments)
    band = Patch(color="0.3", alpha=0.2, label="all measuring points")
    ways = key("$W_z$ lateral", color="0.3"), key("$W_z$ vertical", color="0.3", ls="--")
    handles = [*mean.get_legend_handles_labels()[0], band, *ways]
    figure.legend(handles=handles, loc="outside right upper")
    return figure


def _comfort_axes(
    assessments: Sequence[Assessment], width: float, height: float, over: str
) -> tuple[Picture, Axes, Axes]:
    """Axes of mean comfort and of Sperling's index under the names of vehicles and tracks."""
    figure = Picture(width, height, _names(assessments))
    mean, index = figure.subplots(1, 2)
    mean.set(xlabel=over, ylabel="$N_{MV}$", title="Mean comfort, EN 12299")
    index.set(xlabel=over, ylabel="$W_z$", title="Sperling")
    return figure, mean, index


def _names(assessments: Sequence[Assessment]) -> str:
    """Vehicles and tracks, four of them at most, for the title."""
    names = [a.vehicle for a in assessments]
    names += [track for a in assessments for _, track, _ in a.driven.values()]
    return "\n".join(map(unformatted, [*dict.fromkeys(names)][:4]))


def _at_speed(assessment: Assessment, run: str) -> str:
    return f"{run}, {3.6 * assessment.driven[run][0]:.0f} km/h"


Runs = Sequence[tuple[float, Sequence[PointComfort]]]
"""Speeds with the comfort at every measuring point."""


def _draw_over_speed(
    axes: Axes, runs: Runs, value: Callable[[PointComfort], float], line: str, **look: Any
) -> None:
    speeds = [speed for speed, _ in runs]
    middle = [value(min(points, key=lambda p: abs(p.place))) for _, points in runs]
    axes.plot(speeds, middle, "o", ls=line, ms=4, **look)
    low, high = ([end(map(value, points)) for _, points in runs] for end in (min, max))
    axes.fill_between(speeds, low, high, color=look["color"], alpha=0.15, lw=0)


def _classes(axes: Axes, assessments: Sequence[Assessment]) -> None:
    """Bands of the classes of mean comfort, named at the right edge."""
    limits = assessments[0].limits
    if not isinstance(limits, ComfortLimits):
        return
    bottom, top = 0.0, axes.get_ylim()[1]
    ends = [*limits.mean_comfort.values, (np.inf, limits.mean_comfort.above)]
    for number, (end, name) in enumerate(ends):
        if bottom < top:
            axes.axhspan(bottom, min(end, top), color="0.5", alpha=0.05 + 0.06 * number, lw=0)
            at, look = (0.99, bottom + 0.02 * top), {"fontsize": 7.5, "color": "0.35"}
            note(axes, name, at, (0, 0), "right", frame=BESIDE, **look)
        bottom = end
    axes.set_ylim(0.0, top)


def _comfort_figure(assessments: Sequence[Assessment]) -> Figure:
    """Mean comfort and Sperling's index along the car, a line for each run."""
    figure, mean, index = _comfort_axes(assessments, 9.6, 3.8, "along the car, forwards (m)")
    runs = [(_at_speed(a, run), points) for a in assessments for run, points in a.comfort.items()]
    for number, (run, points) in enumerate(runs):
        ordered = sorted(points, key=lambda point: point.place)
        x = [point.place for point in ordered]
        colour = distinct(number)
        mean.plot(x, [p.mean.N_MV for p in ordered], "o-", color=colour, label=run)
        for way, line in (("lateral", "-"), ("vertical", "--")):
            index.plot(x, [p.sperling[way] for p in ordered], "o", ls=line, color=colour)
    index.plot([], [], "-", color="0.3", label="lateral")
    index.plot([], [], "--", color="0.3", label="vertical")
    for ax in (mean, index):
        ax.margins(y=0.15)
        ax.set_ylim(bottom=0.0)
    handles = [handle for ax in (mean, index) for handle in ax.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside right upper")
    return figure


def _wear_figure(assessments: Sequence[Assessment]) -> Figure:
    """Mean wear number and rail damage of every wheel; damage over wear number, shakedown map."""
    runs = [(_at_speed(a, run), wheels) for a in assessments for run, wheels in a.wear.items()]
    figure = Picture(7.6, 7.0, _names(assessments))
    (energy, damage), (life, map_) = figure.subplots(2, 2)
    damage.sharey(energy)
    width = 0.8 / len(runs)
    for k, (run, wheels) in enumerate(runs):
        rows = np.arange(len(wheels)) + (k - 0.5 * (len(runs) - 1)) * width
        colour = distinct(k)
        energy.barh(rows, [w.T_gamma for w in wheels], 0.9 * width, color=colour, label=run)
        damage.barh(rows, [1e6 * w.rail_damage for w in wheels], 0.9 * width, color=colour)
    most = max((wheels for _, wheels in runs), key=len)  # vehicles may have more or fewer
    energy.set_yticks(range(len(most)), [wheel.place for wheel in most])
    energy.invert_yaxis()
    damage.tick_params(labelleft=False)
    if not any(wheel.rail_damage for _, wheels in runs for wheel in wheels):  # else axes about 0
        damage.set_xlim(0.0, 1.0)
        note(damage, "0 of every wheel", (0.5, 0.5), (0, 0), "center", frame="axes fraction")
    _life_model(life, runs)
    _shakedown_map(map_, runs)
    energy.set_xlabel(r"mean wear number $T\gamma$ (N)")
    damage.set_xlabel("rail damage a pass, WLRM ($10^{-6}$)")
    for ax in (energy, damage):
        ax.grid(axis="y", visible=False)
    figure.legend(*energy.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    return figure


def _life_model(axes: Axes, runs: Sequence[tuple[str, Sequence[WheelWear]]]) -> None:
    """Whole Life Rail Model with the wear numbers' 50 and 95 % values of every wheel."""
    model = runs[0][1][0].model
    values = [w.percentiles[p] for _, wheels in runs for w in wheels for p in ("50", "95")]
    T = np.linspace(0.0, max(200.0, 1.05 * max(values)), 400)
    axes.plot(T, 1e6 * model(T), color="0.3", lw=1.0)
    axes.axhline(0.0, color="0.7", lw=0.7)
    for k, (_, wheels) in enumerate(runs):
        for percentile, marker in (("50", "o"), ("95", "^")):
            T = np.array([w.percentiles[percentile] for w in wheels])
            axes.plot(T, 1e6 * model(T), marker, color=distinct(k), ms=4)
    axes.plot([], [], "o", color="0.3", ms=4, label="50 % of the time below")
    axes.plot([], [], "^", color="0.3", ms=4, label="95 %")
    axes.set(xlabel=r"wear number $T\gamma$ (N)", ylabel="damage a pass, WLRM ($10^{-6}$)")
    axes.legend(loc="best")


def _shakedown_map(axes: Axes, runs: Sequence[tuple[str, Sequence[WheelWear]]]) -> None:
    """Worst patch of every wheel against the elastic shakedown limit."""
    mu = np.linspace(0.0, 0.6, 200)
    axes.plot(mu, shakedown_limit(mu), color=LIMIT, lw=1.2, label="elastic shakedown limit")
    known = False
    for k, (_, wheels) in enumerate(runs):
        found = [
            (w.utilised_friction, w.pressure_ratio) for w in wheels if w.pressure_ratio is not None
        ]
        if found:
            axes.plot(*zip(*found, strict=True), "o", color=distinct(k), ms=4)
            known = True
    if not known:
        axes.set_title("values need outputs.contact_patches", fontsize=9)
    axes.set(xlabel="utilised friction $T/N$", ylabel="$p_0/k$", xlim=(0.0, None), ylim=(0.0, None))
    axes.legend(loc="best")
