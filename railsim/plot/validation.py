"""Pictures of a model against a test, and of an identification: overlays, scatter, spectra."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from railsim.arrays import Floats
from railsim.assessment.model_comparison import ModelValidation, Overlay
from railsim.definitions.measurement import quantity_of
from railsim.identification.identified import Channel, Identified
from railsim.identification.residuals import spectrum_of
from railsim.plot.style import DISTINCT, LIMIT, grid_of, styled, wrap
from railsim.text import unformatted

MOST = 12  # channels of a picture
LONGEST = 20_000  # values of a line
BOTH = {"measured": ("k", "-"), "simulated": (DISTINCT[1], "-")}
LIMITS = "dashed: limit of the mean; dotted: twice that of the standard deviation"
SMALL = {"axes.labelsize": "small", "axes.titlesize": "small"}  # of pictures with many axes
NEAR = 200.0  # m to both sides of the middle of a run, of which channels are drawn


def _scale_and_unit(quantity: str) -> tuple[float, str]:
    entry = quantity_of(quantity)
    return (entry.scale, _unit_text(entry.shown_unit)) if entry is not None else (1.0, "SI")


def _unit_text(unit: str) -> str:
    return unit.replace("s2", "s²")


@styled(SMALL)
def scatter(validation: ModelValidation) -> Figure:
    """Draw simulated over measured section values with the bands of the mean and the deviation."""
    shown = [one for one in validation.comparisons if one.pairs]
    title = f"{unformatted(validation.title)}\n{LIMITS}"
    figure, grid = grid_of(len(shown), 3, 8.0, 2.5, 1.0, title)
    for axes, one in zip(grid, shown, strict=True):
        scale = one.quantity.column.scale
        both = scale * np.array([(pair.measured, pair.simulated) for pair in one.pairs]).T
        ends = np.array([both.min(), both.max()])
        ends += np.array([-0.05, 0.05]) * max(np.ptp(ends), 1e-9)
        axes.plot(ends, ends, color="0.4", linewidth=0.8)
        for limit, style in ((one.mean_limit, "--"), (2.0 * one.limit, ":")):
            for sign in (-1.0, 1.0):
                axes.plot(ends, ends + sign * scale * limit, style, color="0.6", linewidth=0.8)
        axes.plot(*both, ".", color=LIMIT if one.verdict == "fail" else DISTINCT[0])
        title = wrap(f"{one.quantity.words}: {one.verdict}", 2.3)
        unit = f" ({_unit_text(one.quantity.column.unit)})" if one.quantity.column.unit else ""
        axes.set(title=title, xlabel=f"measured{unit}", ylabel=f"simulated{unit}")
        axes.set(xlim=ends, ylim=ends)
    return figure


@styled(SMALL)
def differences(validation: ModelValidation) -> Figure:
    """Draw the distribution of the differences over the limit of their standard deviation."""
    shown = [one for one in validation.comparisons if one.pairs]
    figure, grid = grid_of(len(shown), 4, 8.0, 1.8, 0.6)
    for axes, one in zip(grid, shown, strict=True):
        x = np.array([pair.difference for pair in one.pairs]) / one.limit
        reach = max(1.2, 1.05 * float(np.abs(x).max()))
        colour = LIMIT if one.verdict == "fail" else DISTINCT[0]
        axes.hist(x, np.linspace(-reach, reach, 25).tolist(), color=colour)
        for limit in (-2 / 3, 2 / 3):
            axes.axvline(limit, color="0.5", linewidth=0.8, linestyle="--")
        axes.axvline(one.mean / one.limit, color="k", linewidth=1.0)
        words = wrap(one.quantity.words, 1.7)
        axes.set(title=words, xlabel="difference / limit", ylabel="number")
    return figure


@styled()
def overlays(validation: ModelValidation) -> Figure:
    """Draw measured and simulated channels of the first run over the arc length."""
    shown = _first(validation.overlays)

    def part(channel: Overlay) -> tuple[Floats, slice]:
        middle = 0.5 * (channel.s[0] + channel.s[-1])
        first, last = np.searchsorted(channel.s, (middle - NEAR, middle + NEAR))
        return channel.s, slice(first, last, max(1, (last - first) // LONGEST))

    return _over_arc(shown, part, BOTH, 0.7)


def _over_arc(
    channels: Sequence[Any], part: Callable[..., Any], lines: Mapping[str, Any], lw: float
) -> Figure:
    """Draw channels by the names of their attributes, in looks, over a part of the arc length."""
    figure, grid = grid_of(len(channels), 1, 8.0, 1.3, 0.8, unformatted(channels[0].run))
    for axes, channel in zip(grid, channels, strict=True):
        (scale, unit), (s, rows) = _scale_and_unit(channel.quantity), part(channel)
        for name, (colour, ls) in lines.items():
            values = scale * getattr(channel, name)[rows]
            axes.plot(s[rows], values, color=colour, ls=ls, lw=lw, label=name)
        axes.set_ylabel(f"{channel.name}\n({unit})", fontsize="small")
    grid[0].legend(
        fontsize="small", ncols=len(lines), loc="lower right", bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
    )  # fmt: skip
    grid[-1].set_xlabel("arc length (m)")
    return figure


@styled(SMALL)
def spectra(validation: ModelValidation) -> Figure:
    """Draw power spectral densities of measured and simulated channels of the first run."""
    channels = _first(validation.overlays)
    figure, grid = grid_of(len(channels), 3, 8.0, 1.9, 0.8, unformatted(channels[0].run))
    for axes, channel in zip(grid, channels, strict=True):
        scale, unit = _scale_and_unit(channel.quantity)
        for name, (colour, _) in BOTH.items():
            density = _density(channel, scale * getattr(channel, name))
            axes.loglog(*density, color=colour, lw=0.9, label=name)
        axes.set(title=channel.name, xlabel="frequency (Hz)", ylabel=f"PSD (({unit})²/Hz)")
    grid[0].legend(fontsize="small")
    return figure


def _density(channel: Overlay, values: Floats) -> tuple[Floats, Floats]:
    from scipy.signal import welch

    x = np.where(np.isfinite(values), values, 0.0)
    f, power = welch(x, channel.rate, nperseg=min(len(x), max(256, int(8 * channel.rate))))
    inside = (f > 0.2) & (f < 20.0)
    return f[inside], np.maximum(power[inside], 1e-12 * power[inside].max())


@styled()
def fits(identified: Identified) -> Figure:
    """Draw the channels of the first run, measured, before and after, over a part of the line."""

    def part(channel: Channel) -> tuple[Floats, slice]:
        middle = len(channel.at) // 2
        return channel.at, slice(middle, middle + int(4.0 / channel.step))

    lines = {"measured": ("k", "-"), "before": (DISTINCT[4], "--"), "after": (DISTINCT[1], "-")}
    return _over_arc(_first(identified.channels), part, lines, 0.8)


@styled(SMALL)
def residual_spectra(identified: Identified) -> Figure:
    """Draw the cumulative periodograms of the residuals: a straight line where they are white."""
    channels = _first(identified.channels)
    figure, grid = grid_of(len(channels), 3, 8.0, 1.9, 0.8, unformatted(channels[0].run))
    low, high = identified.band
    for axes, channel in zip(grid, channels, strict=True):
        f, coefficients = spectrum_of(channel.measured - channel.after, channel.step)
        power = np.abs(coefficients) ** 2
        inside = (f >= low) & (f <= high)
        summed = np.cumsum(power[inside]) / max(float(power[inside].sum()), 1e-300)
        axes.plot([low, high], [0.0, 1.0], color="0.6", linewidth=0.8)
        axes.plot(f[inside], summed, color=DISTINCT[0] if channel.is_white else LIMIT)
        judged = "white" if channel.is_white else "not white"
        axes.set(title=f"{channel.name}: {judged if channel.probability >= 0.0 else 'not judged'}")
        axes.set(xlabel="frequency (Hz)", ylabel="share of the power")
    return figure


def _first(channels: Sequence[Any]) -> list[Any]:
    return [one for one in channels if one.run == channels[0].run][:MOST]
