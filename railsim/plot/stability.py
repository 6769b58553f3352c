"""Pictures of stability: amplitude over speed, maps of critical speeds; a vehicle on a twist."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from railsim.linear.stationary import TwistLoop
from railsim.notation import SIDES
from railsim.plot.style import BESIDE, DISTINCT, LIMIT, Picture, distinct, note, say, single, styled
from railsim.stability.branches import THRESHOLD, Branch
from railsim.stability.result import Conicity, CriticalSpeed

DASHED = (0, (4, 2))
# colour, marker and words of the branches by how they were found
BRANCHES: dict[str, tuple[str, str, str]] = {
    "up": (DISTINCT[0], "^", "steps upwards"),
    "down": (DISTINCT[1], "v", "steps downwards"),
    "further": (DISTINCT[3], "d", "from other disturbances"),
    "threshold": ("0.3", "x", "disturbance that decides (unstable)"),
    "ramp": ("0.6", "", "falling ramp"),
    "continuation": (DISTINCT[2], "", "continuation, dashed: unstable"),
}
SMALL_AMPLITUDES = 6.0  # mm, drawn where no branch was computed


@styled()
def bifurcation_figure(found: CriticalSpeed, title: str = "") -> Figure:
    """Amplitude, frequency and track shift force of the hunting motion over speed.

    `title`: By default vehicle, rails, friction and the creep law of the branches, or without any
    that of the linearisation.
    """
    of_which = "law" if found.branches else "linear_law"
    rails, friction, law = (found.conditions[key] for key in ("rails", "friction", of_which))
    words = f"straight track, rails {rails}, friction {friction}, {law}"
    title = title or f"{found.vehicle}\n{words}"
    if not found.branches:
        return _linear_figure(found, title)
    # shooting knows no forces
    forces = any(np.isfinite(branch.column("sum_Y_rms")).any() for branch in found.branches)
    rows = 3 if forces else 2
    figure = Picture(10.2, 4.2 + rows, title)
    heights, widths = [2.4, 1.0, 1.0][:rows], [3.0, 1.0]
    grid = figure.add_gridspec(rows, 2, height_ratios=heights, width_ratios=widths)
    upper = figure.add_subplot(grid[0, 0])
    lower = [figure.add_subplot(grid[row, 0], sharex=upper) for row in range(1, rows)]
    for branch in found.branches:
        hunts = branch.column("amplitude") > THRESHOLD
        _draw(upper, branch, 1e3 * branch.column("amplitude"))
        _draw(lower[0], branch, np.where(hunts, branch.column("frequency"), np.nan))
        for axes in lower[1:]:
            _draw(axes, branch, 1e-3 * branch.column("sum_Y_rms"))
    _mark(upper, found)
    limits = (upper, found.amplitude_limit, 1e3), (lower[-1], found.instability_limit, 1e-3)
    words = "limits: 3 mm, half the limit of ΣY" if forces else "limit: 3 mm"
    for axes, limit, scale in limits[: rows - 1]:
        if limit is not None:
            axes.axhline(scale * limit.limit, color=LIMIT, lw=0.8, ls=(0, (1, 2)), label=words)
    words = f"Hunting, {found.type}" if found.type else "Hunting"
    upper.set(ylabel="amplitude of the wheelsets (mm)", title=words, xlim=_speed_range(found))
    upper.set(ylim=(0.0, None))
    lower[0].set(ylabel="frequency (Hz)")
    for axes in lower[1:]:
        axes.set(ylabel="ΣY, rms (kN)", ylim=(0.0, None))
    lower[-1].set(xlabel="speed (m/s)")
    if found.conicity_over_amplitude is not None:
        _conicity(figure.add_subplot(grid[0, 1], sharey=upper), found.conicity_over_amplitude)
    handles, labels = upper.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True))  # of several branches of a kind once
    figure.add_subplot(grid[1:, 1], frame_on=False, xticks=[], yticks=[]).legend(
        named.values(), named.keys(), loc="upper left", fontsize=7.5, borderpad=0.0
    )
    return figure


def _speed_range(speeds: CriticalSpeed) -> tuple[float | None, float | None]:
    """Range of speeds: from somewhat below the slowest hunting to somewhat above the last jump."""
    alive = [point.speed for branch in speeds.branches for point in branch.alive]
    if not alive:
        return None, None
    marks = [min(alive), *(jump.speed for jump in speeds.jumps)]
    if speeds.linear is not None:
        marks.append(speeds.linear.speed)
    return 0.9 * min(marks), min(speeds.high, 1.25 * max(marks))


def _linear_figure(speeds: CriticalSpeed, title: str) -> Figure:
    """What there is without a branch: linear critical speeds over amplitude, the conicity."""
    words = f"no linear critical speed from {speeds.low:g} to {speeds.high:g} m/s"
    if speeds.unstable_at_low:
        words = f"unstable at {speeds.low:g} m/s, the lower end of the range"
    if speeds.linear is not None:
        words = f"linear critical speed {speeds.linear.speed:.2f} m/s ({speeds.linear.mode})"
    figure = Picture(8.4, 4.4, f"{title}\n{words}")
    left, right = figure.subplots(1, 2, sharey=True)
    left.set(xlabel="speed (m/s)", ylabel="amplitude of the wheelsets (mm)")
    left.set(title="Linear critical speed", ylim=(0.0, SMALL_AMPLITUDES))
    _mark(left, speeds)
    if left.has_data():
        left.legend(fontsize=7.5)
    if speeds.conicity_over_amplitude is None:
        say(right, "the wheelset does not fit between the rails")
    else:
        _conicity(right, speeds.conicity_over_amplitude)
    return figure


def _mark(axes: Axes, critical: CriticalSpeed) -> None:
    """Linear critical speeds as lines, the lowest speeds of sustained hunting as circles."""
    if (lost := critical.linear) is not None:
        lines: list[tuple[str, float | None, Any]] = [
            (f"linear, {critical.contact.words()}", lost.speed, "-"),
            ("the same on rigid rails", lost.speed_on_rigid_rails, (0, (6, 2, 1, 2))),
            ("the same with the cells of the runs", lost.speed_of_runs, (0, (6, 2))),
        ]
        for words, speed, dashes in lines:
            if speed is not None:
                label = f"{words}: {speed:.2f} m/s"
                axes.axvline(speed, color="0.1", lw=0.9, ls=dashes, label=label)
    line = critical.linear_over_amplitude
    if line is not None and line.smallest is not None:
        # not at amplitudes of which the lower end of the range is unstable already
        speeds = np.array([s if s and s > critical.low else np.nan for s in line.speed])
        sizes = 1e3 * np.array(line.amplitude)
        words = "linear, harmonic, over amplitude"
        axes.plot(speeds, sizes, color="0.1", lw=0.9, ls=":", label=words)
    for method, lowest in critical.nonlinear.items():
        if lowest is not None:
            more = "" if lowest.stable else ", unstable"
            axes.plot(
                [lowest.speed], [1e3 * lowest.amplitude], "o", ms=6, mfc="none",
                color=BRANCHES["down" if method == "bifurcation" else method][0],
                label=f"lowest by {method}: {lowest.speed:.2f} m/s{more}",
            )  # fmt: skip


def _conicity(axes: Axes, conicity: Conicity) -> None:
    """Equivalent conicity, on the amplitudes of the diagram beside it."""
    values, amplitudes = np.array(conicity.conicity), 1e3 * np.array(conicity.amplitude)
    axes.plot(values, amplitudes, color="0.25")
    axes.set(xlabel="equivalent conicity", title="Conicity (EN 15302)")
    shown = values[amplitudes <= max(axes.get_ylim()[1], SMALL_AMPLITUDES)]
    axes.set_xlim(0.0, 1.1 * np.max(shown) if len(shown) else None)
    axes.tick_params(labelleft=False)


def _draw(axes: Axes, branch: Branch, values: np.ndarray) -> None:
    """A branch, dashed where its motions are unstable."""
    speed, stable = branch.column("speed"), branch.column("stable") > 0.0
    colour, marker, words = BRANCHES[branch.direction]
    style: dict[str, Any] = {"color": colour, "marker": marker, "ms": 3.5, "label": words}
    if marker:
        axes.plot(speed, values, ls="-" if stable.all() else DASHED, **style)
        return
    # a piece of a ramp with few periods has no frequency
    speed, values, stable = np.array([speed, values, stable])[:, np.isfinite(values)]
    for is_stable, line in ((True, "-"), (False, DASHED)):
        # a piece reaches to its neighbour of the other kind
        inside = stable == is_stable
        reach = inside | np.roll(inside, 1) & (np.arange(len(inside)) > 0)
        axes.plot(speed, np.where(reach, values, np.nan), ls=line, **style)
        style["label"] = None  # once


@styled()
def map_figure(
    axes_values: Mapping[str, Sequence[float]], speeds: Mapping[str, np.ndarray], title: str
) -> Figure:
    """Critical speeds over one parameter, or over the first with one line for each of the second.

    `axes_values`: Of one or two parameters. `speeds`: Critical speeds by method over them, NaN
    where there is none [m/s].
    """
    first, *others = axes_values
    figure, axes = single(8.4, 4.6, title)
    for method, values in speeds.items():
        for number, column in enumerate(values.reshape(len(axes_values[first]), -1).T):
            more = f", {others[0]} {axes_values[others[0]][number]:g}" if others else ""
            axes.plot(
                axes_values[first], column, marker="o", ms=3.5, color=distinct(number),
                ls="-" if method.startswith("linear") else DASHED, label=f"{method}{more}",
            )  # fmt: skip
    axes.set(xlabel=first, ylabel="critical speed (m/s)")
    if not any(np.isfinite(values).any() for values in speeds.values()):
        say(axes, "no critical speed inside the range at any point; the table says why")
        return figure
    points = np.concatenate([values.ravel() for values in speeds.values()])
    axes.set_ylim(0.0, 1.05 * np.nanmax(points))
    if missing := int(np.isnan(points).sum()):
        axes.set_title(f"{missing} of {len(points)} points: no critical speed, see the table")
    axes.legend()
    return figure


@styled()
def twist_figure(loops: Mapping[str, TwistLoop], limit: float, title: str) -> Figure:
    """DQ/Q0 of the worst wheel of each twist over the twist, from both directions.

    `loops`: By the name of the twist. `limit`: Of dQ/Q0 [1].
    """
    figure = Picture(9.6, 3.8, title)
    panels = figure.subplots(1, max(1, len(loops)), sharey=True, squeeze=False)[0]
    for panel, (name, loop) in zip(panels, loops.items(), strict=False):
        wheelset, side = loop.worst
        way = np.append(0.0, loop.share) if len(loop.share) > 2 else loop.share
        unloading = loop.unloading[:, wheelset, side]
        values = np.append(0.0, unloading) if len(loop.share) > 2 else unloading
        panel.plot(100.0 * way, values, "o-", ms=2.5, color=DISTINCT[0])
        panel.axhline(limit, color=LIMIT, ls=DASHED, lw=0.8)
        look = {"frame": BESIDE, "color": LIMIT}
        note(panel, f"limit {limit:g}", (1.0, limit), (-3, 2.5), "right", "bottom", **look)
        panel.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        panel.set(title=f"{name},\nwheelset {wheelset + 1} {SIDES[side]}")
        panel.set(xlabel="share of the full twist (%)")
    panels[0].set_ylabel("$(Q_0 - Q)/Q_0$")
    return figure
