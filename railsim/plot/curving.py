"""Pictures of quasi-static curving: angle of attack and forces over radius, wear over the grid."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from railsim.arrays import Floats, Indices
from railsim.plot.style import Picture, distinct, note, say, signed, styled, wheelset_looks
from railsim.stability.curving import MEAN, METHODS, TIME, Curving

LEFT, RIGHT = 0, 1
MAPS = 3  # maps of wear side by side at most
NUMBERS = 80  # fields of a map in which numbers can be read
EXAGGERATED = 30.0  # angles of attack and displacements of the drawn wheelsets
HALF, WHEEL = 0.75, 0.46  # m, half the distance of the rolling circles, radius of a wheel, as drawn
WIDE = 4.0  # ratio of radii from which on their axis is logarithmic


@styled()
def curving_figure(found: Curving, title: str = "") -> Figure:
    """Leading wheelset over radius, one line for each friction; wear of all over radius.

    `title`: By default vehicle, cant and rails.
    """
    mapped = len(found.cant_deficiency) > 1 and len(found.radius) > 1
    # the sketch is as high as its width asks for, that of a short vehicle less
    sketch = min(3.4, 0.5 + 36.0 / (np.ptp(found.wheelset_position) + 4.0))
    heights = [7.4, sketch, 3.2] if mapped else [7.4, sketch]
    figure = Picture(10.2, sum(heights), title or found.title.replace(": ", "\n", 1))
    rows = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    _plan(figure.add_subfigure(rows[1]).subplots(), found)
    if mapped:
        _wear_maps(figure.add_subfigure(rows[2]), found, np.argsort(found.radius))
    axes = figure.add_subfigure(rows[0]).subplots(2, 2)
    order = np.argsort(found.radius)
    radius = found.radius[order]
    outwards = -1e-3 * np.sign(found.radius)[:, None, None]
    guiding = outwards * _leading_outer(found, found.Y)
    for one, values, words in (
        (axes[0, 0], 1e3 * found.attack[..., 0], "angle of attack, leading wheelset (mrad)"),
        (axes[0, 1], guiding, "guiding force $Y$ of the leading outer wheel, outwards (kN)"),
        (axes[1, 0], found.T_gamma.sum((-2, -1)), r"wear number $T\gamma$ of all wheels (N)"),
    ):
        _lines(one, found, order, values, words)
    _steering(axes[1, 1], found, order)
    for one in axes.flat:
        if not found.converged.any():
            say(one, "no values at any point")
        one.set_xlabel("radius (m)")
        if np.min(radius) > 0.0 and np.max(radius) > WIDE * np.min(radius):
            one.set_xscale("log")
            one.set_xticks(_ticks(radius), [f"{tick:g}" for tick in _ticks(radius)])
            one.minorticks_off()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))  # how points were computed, of all curves
    axes[0, 0].legend(once.values(), once.keys(), fontsize=7.5)
    return figure


def _leading_outer(curving: Curving, values: Floats) -> Floats:
    """Values of the leading wheelset's outer wheel, float64[radius, deficiency, friction]."""
    outer = np.where(curving.radius > 0.0, LEFT, RIGHT)[:, None, None, None]
    own: Floats = np.take_along_axis(values[:, :, :, 0, :], outer, axis=-1)[..., 0]
    return own


def _wear_maps(figure: SubFigure, curving: Curving, order: Indices) -> None:
    """Wear number of the leading outer wheel over radius and cant deficiency for each friction."""
    number = min(len(curving.friction), MAPS)
    radius, deficiency = curving.radius[order], 1e3 * curving.cant_deficiency
    wear = _leading_outer(curving, curving.T_gamma)[order]
    largest = float(np.nanmax(wear)) if np.isfinite(wear).any() else 1.0
    columns, rows = np.arange(len(radius)), np.arange(len(deficiency))
    for m, axes in enumerate(figure.subplots(1, number, squeeze=False)[0]):
        axes.grid(visible=False)
        shown = wear[:, :, m]
        picture = axes.pcolormesh(columns, rows, shown.T, shading="nearest", vmin=0.0, vmax=largest)
        turned = 45.0 if number * len(columns) > 12 else 0.0
        axes.set_xticks(columns, [signed(r) for r in radius], fontsize=7.5, rotation=turned)
        axes.set_yticks(rows, [f"{value:g}" for value in deficiency])
        for (r, i), value in np.ndenumerate(shown) if shown.size <= NUMBERS else ():
            known = np.isfinite(value)
            colour = "black" if value > 0.6 * largest or not known else "white"  # on light, on dark
            words = signed(round(value)) if known else "none"
            note(axes, words, (r, i), (0, 0), "center", "center", color=colour)
        axes.set(xlabel="radius (m)", ylabel="cant deficiency (mm)" if m == 0 else "")
        axes.set(title=rf"$T\gamma$ (N), leading outer wheel, friction {curving.friction[m]:g}")
    figure.colorbar(picture, ax=figure.axes, label=r"$T\gamma$ (N)", fraction=0.03)


def _ticks(radius: Floats) -> list[float]:
    """Round radii within the range drawn."""
    steps = [k * 10.0**p for p in range(1, 6) for k in (1.0, 2.0, 3.0, 5.0)]
    return [step for step in steps if 0.9 * np.min(radius) <= step <= 1.1 * np.max(radius)]


def _lines(axes: Axes, curving: Curving, order: Indices, values: Floats, words: str) -> None:
    """Values over radius; friction by colour, cant deficiency by line."""
    radius = curving.radius[order]
    styles: list[Any] = ["-", (0, (4, 2)), (0, (1, 1.5)), (0, (4, 1.5, 1, 1.5))]
    for m, mu in enumerate(curving.friction):
        for i, deficiency in enumerate(curving.cant_deficiency):
            shown = np.where(curving.converged[:, i, m] > 0, values[:, i, m], np.nan)[order]
            label = f"friction {mu:g}, cant deficiency {1e3 * deficiency:g} mm"
            colour, line = distinct(m), styles[i % len(styles)]
            both = _split_hands(radius, shown)
            axes.plot(*both, ls=line, color=colour, marker=".", ms=4, label=label)
            for code, marker in ((TIME, "o"), (MEAN, "x")):
                those = curving.converged[:, i, m][order] == code
                how = METHODS[code] if those.any() else None
                marked = radius[those], shown[those], marker
                axes.plot(*marked, color=colour, ms=6, mfc="none", label=how)
    axes.set_title(words)


def _split_hands(radius: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Left-hand curves, then right-hand ones: no line joins them over a radius of zero."""
    between = int(np.searchsorted(radius, 0.0))
    if between in (0, len(radius)):
        return radius, values
    return np.insert(radius, between, np.nan), np.insert(values, between, np.nan)


def _plan(axes: Axes, curving: Curving) -> None:
    """Wheelsets on the unrolled track in the tightest curve, seen from above."""
    converged = curving.converged[:, 0, 0] > 0
    if not converged.any():
        say(axes, "no values at any radius for the first deficiency and friction")
        return
    r = int(np.argmin(np.where(converged, np.abs(curving.radius), np.inf)))
    x = np.array(curving.wheelset_position)
    for y in (-HALF, HALF):
        axes.axhline(y, color="0.75", lw=2.5, zorder=1)
    looks = wheelset_looks(curving.wheelsets)
    for w, name in enumerate(curving.wheelsets):
        yaw = EXAGGERATED * curving.attack[r, 0, 0, w]
        middle = np.array([x[w], EXAGGERATED * curving.lateral[r, 0, 0, w]])
        along, across = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
        ends = [middle - HALF * across, middle + HALF * across]
        axes.plot(*np.transpose(ends), color=looks[name]["color"], lw=1.6, zorder=2)
        for end in ends:
            wheel = [end - WHEEL * along, end + WHEEL * along]
            axes.plot(*np.transpose(wheel), color=looks[name]["color"], lw=4.0, zorder=3)
    # to the right is downwards
    axes.set(xlim=(np.min(x) - 2.0, np.max(x) + 2.0), ylim=(1.9, -1.9), aspect="equal")
    axes.set(xticks=[], yticks=[], anchor="W")  # room for the title of a short vehicle
    axes.set_title(
        f"Wheelsets at R {signed(curving.radius[r])} m, {_case_text(curving)}, from above, "
        f"running to the right; angles and displacements magnified {EXAGGERATED:g} times"
    )


def _case_text(state: Curving) -> str:
    """Friction and cant deficiency of what is shown for one of them alone."""
    return f"friction {state.friction[0]:g}, cant deficiency {1e3 * state.cant_deficiency[0]:g} mm"


def _steering(axes: Axes, curving: Curving, order: Indices) -> None:
    """How all wheelsets stand in the curve at the first cant deficiency and friction."""
    looks = wheelset_looks(curving.wheelsets)
    for w, name in enumerate(curving.wheelsets):
        both = _split_hands(curving.radius[order], 1e3 * curving.lateral[order, 0, 0, w])
        axes.plot(*both, ms=4, label=name, **looks[name])
    axes.set_title(f"lateral displacement (mm), {_case_text(curving)}")
    axes.legend(fontsize=7.5)
