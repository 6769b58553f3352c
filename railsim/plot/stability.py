"""Pictures of stability: amplitude over speed with its branches, maps of critical speeds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.plot.style import DISTINCT, LIMIT, Picture, say, styled
from railsim.stability.critical_speed import CriticalSpeed
from railsim.stability.ramp import THRESHOLD, Diagram

COLOURS = {
    "up": DISTINCT[0],
    "down": DISTINCT[1],
    "further": DISTINCT[3],
    "threshold": "0.3",
    "ramp": "0.6",
    "continuation": DISTINCT[2],
}
MARKERS = {"up": "^", "down": "v", "further": "d", "threshold": "x"}
SMALL_AMPLITUDES = 6.0  # mm, drawn where no branch was computed
WORDS = {
    "up": "steps upwards",
    "down": "steps downwards",
    "further": "from other disturbances",
    "threshold": "disturbance that decides",
    "ramp": "falling ramp",
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
    if not found.branches:
        return _linear_figure(found, title)
    with styled():
        figure = Picture(figsize=(10.2, 6.0), layout="constrained")
        figure.suptitle(title, x=0.01, ha="left")
        grid = figure.add_gridspec(2, 2, height_ratios=[2.2, 1.0], width_ratios=[3.0, 1.0])
        upper = figure.add_subplot(grid[0, 0])
        lower = figure.add_subplot(grid[1, 0], sharex=upper)
        for branch in found.branches:
            _draw(upper, branch, 1e3 * np.array(branch.amplitude), label=True)
            shown = np.where(np.array(branch.amplitude) > THRESHOLD, branch.frequency, np.nan)
            _draw(lower, branch, shown, label=False)
        _critical(upper, found)
        _over_amplitude(upper, found)
        upper.set(
            ylabel="amplitude of the wheelsets (mm)",
            title=f"Hunting{f', {found.type}' if found.type else ''}",
        )
        upper.set_ylim(0.0, None)
        upper.set_xlim(*_shown(found))
        lower.set(xlabel="speed (m/s)", ylabel="frequency (Hz)")
        if found.conicity_over_amplitude is not None:
            _conicity(figure.add_subplot(grid[0, 1], sharey=upper), found.conicity_over_amplitude)
        handles, labels = upper.get_legend_handles_labels()
        named = dict(zip(labels, handles, strict=True))  # of several branches of a kind once
        if named:
            figure.add_subplot(grid[1, 1], frame_on=False, xticks=[], yticks=[]).legend(
                named.values(), named.keys(), loc="upper left", fontsize=7.5, borderpad=0.0
            )
    return figure


def _shown(found: CriticalSpeed) -> tuple[float | None, float | None]:
    """Range of speeds: from somewhat below the slowest hunting to somewhat above the last jump."""
    alive = [branch.speed[k] for branch in found.branches for k in branch.alive]
    if not alive:
        return None, None
    marks = [jump["speed"] for jump in found.jumps] + [min(alive)]
    if found.linear is not None:
        marks.append(found.linear["speed"])
    return 0.9 * min(marks), min(found.high, 1.25 * max(marks))


def _linear_figure(found: CriticalSpeed, title: str) -> Figure:
    """What there is without a branch: the linear critical speed in words, the conicity."""
    words = "no linear critical speed in the range"
    if found.linear is not None:
        words = (
            f"linear critical speed {found.linear['speed']:.2f} m/s, {found.linear['mode']}, "
            f"{found.linear['frequency']:.2f} Hz"
        )
    with styled():
        figure = Picture(figsize=(7.2, 4.4), layout="constrained")
        figure.suptitle(f"{title}\n{words}", x=0.01, ha="left")
        axes = figure.subplots()
        if found.conicity_over_amplitude is None:
            say(axes, "the wheelset does not fit between the rails")
        else:
            _conicity(axes, found.conicity_over_amplitude)
            axes.set(ylabel="amplitude of the wheelset (mm)", ylim=(0.0, SMALL_AMPLITUDES))
            axes.tick_params(labelleft=True)
    return figure


def _critical(axes: Axes, found: CriticalSpeed) -> None:
    """The linear critical speed as a line, the lowest speeds of sustained hunting as circles."""
    if found.linear is not None:
        axes.axvline(
            found.linear["speed"],
            color=LIMIT,
            lw=0.9,
            label=f"linear: {found.linear['speed']:.2f} m/s",
        )
    for method, lowest in found.nonlinear.items():
        if lowest.speed is not None:
            axes.plot(
                [lowest.speed],
                [1e3 * lowest.amplitude],
                "o",
                ms=6,
                mfc="none",
                ls="none",
                color=COLOURS["down" if method == "bifurcation" else method],
                label=f"lowest by {method}: {lowest.speed:.2f} m/s",
            )


def _over_amplitude(axes: Axes, found: CriticalSpeed) -> None:
    """Linear critical speed over the amplitude for which the contact is linearised."""
    line = found.linear_over_amplitude
    if line is not None and any(speed is not None for speed in line["speed"]):
        speeds = [np.nan if speed is None else speed for speed in line["speed"]]
        sizes = 1e3 * np.array(line["amplitude"])
        axes.plot(
            speeds, sizes, color=LIMIT, lw=0.9, ls=":", label="linear, harmonic, over amplitude"
        )


def _conicity(axes: Axes, conicity: Mapping[str, Any]) -> None:
    """Equivalent conicity, on the amplitudes of the diagram beside it."""
    values, amplitudes = np.array(conicity["conicity"]), 1e3 * np.array(conicity["amplitude"])
    axes.plot(values, amplitudes, color="0.25")
    axes.set(xlabel="equivalent conicity (1)", title="Conicity (EN 15302)")
    shown = values[amplitudes <= max(axes.get_ylim()[1], SMALL_AMPLITUDES)]
    axes.set_xlim(0.0, 1.1 * np.max(shown) if len(shown) else None)
    axes.tick_params(labelleft=False)


def _draw(axes: Axes, branch: Diagram, values: np.ndarray, *, label: bool) -> None:
    """A branch, dashed where its motions are unstable."""
    speed, stable = np.array(branch.speed), np.array(branch.stable, dtype=bool)
    words = WORDS[branch.direction] if label else None
    colour = COLOURS[branch.direction]
    marker = MARKERS.get(branch.direction)
    if marker is not None:
        line = "-" if all(branch.stable) else (0, (4, 2))
        axes.plot(speed, values, marker=marker, ms=3.5, ls=line, color=colour, label=words)
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
        figure = Picture(figsize=(8.4, 4.6), layout="constrained")
        figure.suptitle(title, x=0.01, ha="left")
        axes = figure.subplots()
        lines = axes_values[names[1]] if len(names) > 1 else [None]
        for number, second in enumerate(lines):
            for method, values in speeds.items():
                column = values[:, number] if len(names) > 1 else values
                words = method if second is None else f"{method}, {names[1]} {second:g}"
                axes.plot(
                    axes_values[names[0]],
                    column,
                    marker="o",
                    ms=3.5,
                    color=DISTINCT[number % len(DISTINCT)],
                    ls="-" if method == "linear" else (0, (4, 2)),
                    label=words,
                )
        axes.set(xlabel=names[0], ylabel="critical speed (m/s)")
        if not any(np.isfinite(values).any() for values in speeds.values()):
            say(axes, "no critical speed in the range at any point")
            return figure
        axes.set_ylim(0.0, None)
        axes.legend()
    return figure
