"""Pictures of modes: shapes of one, frequencies and damping over speed, root locus."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from railsim.linear.modes import Mode, Modes, RootLocus
from railsim.plot.style import DISTINCT, LIMIT, Picture, grid_of, say, styled

SHOWN = 25.0  # Hz, oscillations up to which are drawn
BARS = 14  # components of a shape that are drawn
LEAST_BARS = 5  # rows of a shape, so that bars are of one height
# by quarters of a period, to which a phase is nearest
PHASES = {
    DISTINCT[0]: "in phase with the first component", DISTINCT[2]: "a quarter ahead",
    DISTINCT[1]: "in opposite phase", DISTINCT[5]: "a quarter behind",
    "0.6": "spin, which has no displacement",
}  # fmt: skip


@styled()
def locus_figure(locus: RootLocus, title: str = "") -> Figure:
    """Damping ratio and frequency over the parameter, and the root locus.

    `title`: By default vehicle, track and contact.
    """
    figure = Picture(10.2, 7.4, title or locus.title.replace(": ", "\n", 1))
    panels = figure.subplot_mosaic("dd;fp", height_ratios=[1.15, 1.0])
    damping, frequency, plane = panels.values()
    values = np.array(locus.values)
    eigenvalues = locus.eigenvalues
    with np.errstate(invalid="ignore"):
        shown = np.abs(eigenvalues) < 2.0 * np.pi * SHOWN  # false where there is no mode
    # at two values at least (of several)
    chosen = np.flatnonzero(shown.sum(axis=0) >= min(2, len(shown))).tolist()
    if not chosen:
        say(plane, f"no oscillation below {SHOWN:g} Hz")
        return figure
    colours = _colours(locus.names, chosen)
    for k in chosen:
        size = np.abs(eigenvalues[:, k])
        colour, width = colours[k]
        dashes = (0, (4, 2)) if width > 1.0 and locus.names[k][-1].isdigit() else "-"
        style: dict[str, Any] = {"color": colour, "lw": width, "ls": dashes}
        if len(values) == 1:
            style["marker"] = "o"
        label = locus.names[k] if width > 1.0 else None
        zeta = -eigenvalues[:, k].real / size
        damping.plot(values, 100.0 * zeta, label=label, **style)
        frequency.plot(values, size / (2.0 * np.pi), **style)
        plane.plot(eigenvalues[:, k].real, eigenvalues[:, k].imag / (2.0 * np.pi), **style)
        last = eigenvalues[np.flatnonzero(np.isfinite(size))[-1], k]
        plane.plot(last.real, last.imag / (2 * np.pi), ">", ms=3.5, color=colour)
    _frame(damping, frequency, plane, locus)
    return figure


def _frame(damping: Axes, frequency: Axes, plane: Axes, locus: RootLocus) -> None:
    words = f"{locus.key} ({locus.unit})" if locus.unit else locus.key
    damping.axhline(0.0, color=LIMIT, lw=0.8)
    damping.set(xlabel=words, ylabel="damping ratio (%)")
    damping.set_title(f"Damping of oscillations below {SHOWN:g} Hz; below zero unstable")
    damping.set_ylim(max(-30.0, damping.get_ylim()[0]), min(60.0, damping.get_ylim()[1]))
    damping.plot([], [], color="0.65", lw=0.9, label="bogies, wheelsets")
    damping.legend(ncol=1, loc="upper left", bbox_to_anchor=(1.0, 1.02), fontsize=7.5)
    frequency.set(xlabel=words, ylabel="undamped frequency (Hz)", title="Frequency")
    frequency.set(ylim=(0.0, None))
    plane.axvline(0.0, color=LIMIT, lw=0.8)
    plane.set(xlabel="growth Re λ (1/s)", ylabel="frequency Im λ/2π (Hz)")
    plane.set(title=f"Root locus; arrows point towards higher {locus.key}")
    plane.set(xlim=(max(-40.0, plane.get_xlim()[0]), plane.get_xlim()[1]), ylim=(0.0, None))


def _colours(names: Sequence[str], chosen: Sequence[int]) -> dict[int, tuple[str, float]]:
    """Colour and width: hunting and what the car body does stand out, the rest is grey."""
    found: dict[int, tuple[str, float]] = {}
    bright = iter(DISTINCT[0:1] + DISTINCT[2:6] + DISTINCT[7:])
    for k in chosen:
        name = names[k]
        if "hunting" in name:
            before = sum("hunting" in names[j] for j in found)
            found[k] = ((DISTINCT[1], "#f0a13c", "#8c2d19")[min(2, before)], 2.0)
        elif name.startswith(("car", "lower", "upper")):
            found[k] = (next(bright, "0.4"), 1.3)
        else:
            found[k] = ("0.65", 0.9)
    return found


@styled()
def modes_figure(modes: Modes, title: str = "", most: int = 8) -> Figure:
    """Shapes of the least damped oscillations, at `most` so many, as bars with their phase.

    `title`: By default vehicle, track and contact.
    """
    drawn = [mode for mode in modes.oscillations if mode.natural_frequency < SHOWN][:most]
    title = title or modes.title.replace(": ", "\n", 1)
    figure, cells = grid_of(max(1, len(drawn)), 2 if drawn else 1, 10.2, 2.1, 0.9, title)
    if not drawn:
        say(cells[0], f"no oscillation below {SHOWN:g} Hz")
        return figure
    for axes, mode in zip(cells, drawn, strict=True):
        _shape(axes, mode)
    for axes in cells[-2:]:
        axes.set_xlabel("share of the kinetic energy (%)")
    handles = [Patch(color=colour, label=label) for colour, label in PHASES.items()]
    figure.legend(handles=handles, loc="outside lower center", ncol=len(PHASES), fontsize=8)
    return figure


def _phase_colour(value: complex | None, reference: complex) -> str:
    """Colour of `PHASES`; the spin of a wheelset has a rate and no displacement."""
    *quarters, unknown = PHASES
    if value is None:
        return unknown
    return quarters[round(float(np.angle(value * np.conj(reference))) / (0.5 * np.pi)) % 4]


def _shape(axes: Axes, mode: Mode) -> None:
    """Share of each component in the energy, with its phase against the first as colour."""
    names = list(mode.participation)[:BARS]
    shares = [100.0 * mode.participation[name] for name in names]
    reference = mode.shape.get(names[0], 1.0 + 0j)
    colours = [_phase_colour(mode.shape.get(name), reference) for name in names]
    rows = np.arange(len(names))
    axes.barh(rows, shares, color=colours, height=0.7)
    axes.set_yticks(rows, names, fontsize=6.5)
    axes.set(ylim=(max(len(names), LEAST_BARS) - 0.5, -0.5), xlim=(0.0, None))
    axes.grid(visible=False, axis="y")
    damping = f"damping {100.0 * mode.damping_ratio:.2f} %".replace("-", "\N{MINUS SIGN}")
    axes.set_title(f"{mode.name}: f₀ {mode.natural_frequency:#.3g} Hz, {damping}", fontsize=8.5)
