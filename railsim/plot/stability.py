"""Pictures of stability: amplitude over speed with its branches, maps of critical speeds."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.plot.style import DISTINCT, LIMIT, styled
from railsim.stability.critical_speed import CriticalSpeed
from railsim.stability.ramp import THRESHOLD, Diagram

COLOURS = {"up": DISTINCT[0], "down": DISTINCT[1], "ramp": "0.6", "continuation": DISTINCT[2]}
WORDS = {
    "up": "steps upwards", "down": "steps downwards", "ramp": "falling ramp",
    "continuation": "continuation, dashed where unstable",
}


def bifurcation_figure(found: CriticalSpeed, title: str) -> Figure:
    """Amplitude and frequency of the hunting motion over speed.

    Parameters
    ----------
    found : CriticalSpeed
    title : str
        What was analysed.
    """
    with styled():
        figure = Figure(figsize=(9.2, 6.0), layout="constrained")
        figure.suptitle(title, x=0.01, ha="left")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1.0])
        for branch in found.branches:
            _draw(upper, branch, 1e3 * np.array(branch.amplitude), label=True)
            shown = np.where(np.array(branch.amplitude) > THRESHOLD, branch.frequency, np.nan)
            _draw(lower, branch, shown, label=False)
        if found.linear is not None:
            upper.axvline(found.linear["speed"], color=LIMIT, lw=0.9)
            upper.annotate(
                f"linear {found.linear['speed']:.1f}", (found.linear["speed"], 1.0),
                xycoords=("data", "axes fraction"), xytext=(3, -9), textcoords="offset points",
                fontsize=8, color=LIMIT,
            )
        for method, lowest in found.nonlinear.items():
            if lowest.speed is not None:
                upper.plot([lowest.speed], [1e3 * lowest.amplitude], "o", ms=5, mfc="none",
                           color=COLOURS["down" if method == "bifurcation" else method],
                           label=f"lowest by {method}: {lowest.speed:.2f} m/s")
        upper.set(ylabel="amplitude of the wheelsets (mm)",
                  title=f"Hunting{f', {found.type}' if found.type else ''}")
        upper.set_ylim(0.0, None)
        lower.set(xlabel="speed (m/s)", ylabel="frequency (Hz)")
        if upper.get_legend_handles_labels()[0]:
            upper.legend()
        else:
            upper.text(0.5, 0.5, "no branch was computed", ha="center", transform=upper.transAxes)
    return figure


def _draw(axes: Axes, branch: Diagram, values: np.ndarray, *, label: bool) -> None:
    """A branch, dashed where its motions are unstable."""
    speed, stable = np.array(branch.speed), np.array(branch.stable, dtype=bool)
    words = WORDS[branch.direction] if label else None
    colour = COLOURS[branch.direction]
    if branch.direction in ("up", "down"):
        marker = "^" if branch.direction == "up" else "v"
        axes.plot(speed, values, marker=marker, ms=3.5, color=colour, label=words)
        return
    for is_stable, line in ((True, "-"), (False, (0, (4, 2)))):
        # a piece reaches to its neighbour of the other kind
        inside = stable == is_stable
        reach = inside | np.roll(inside, 1) & (np.arange(len(inside)) > 0)
        axes.plot(speed, np.where(reach, values, np.nan), ls=line, color=colour, label=words)
        words = None


def map_figure(
    axes_values: Mapping[str, Sequence[float]], speeds: Mapping[str, np.ndarray], title: str
) -> Figure:
    """Critical speeds over one parameter, or over the first with one line for each of the second.

    Parameters
    ----------
    axes_values : mapping of str to values
        One or two parameters.
    speeds : mapping of str to ndarray
        Critical speeds by method over the parameters, NaN where there is none [m/s].
    title : str
    """
    names = list(axes_values)
    with styled():
        figure = Figure(figsize=(8.4, 4.6), layout="constrained")
        figure.suptitle(title, x=0.01, ha="left")
        axes = figure.subplots()
        lines = axes_values[names[1]] if len(names) > 1 else [None]
        for number, second in enumerate(lines):
            for method, values in speeds.items():
                column = values[:, number] if len(names) > 1 else values
                words = method if second is None else f"{method}, {names[1]} {second:g}"
                axes.plot(axes_values[names[0]], column, marker="o", ms=3.5,
                          color=DISTINCT[number % len(DISTINCT)],
                          ls="-" if method == "linear" else (0, (4, 2)), label=words)
        axes.set(xlabel=names[0], ylabel="critical speed (m/s)")
        axes.set_ylim(0.0, None)
        axes.legend()
    return figure
