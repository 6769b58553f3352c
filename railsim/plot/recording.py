"""A track recording as a picture: as read and as it acts, with its spectra beside ERRI's.

The four irregularities of EN 13848-1 from the displacements of the rails: alignment and
longitudinal level are the means of both rails, cross level and gauge their differences.
"""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import welch

from railsim.arrays import Floats
from railsim.definitions.excitations.recording import BANDS, band_passed
from railsim.definitions.excitations.spectra import SPECTRA
from railsim.plot.style import DISTINCT, Picture, styled
from railsim.text import unformatted

CHANNELS: dict[str, tuple[str, str, Callable[[Floats], Floats]]] = {
    "lateral": ("y", "Alignment, positive to the right", lambda v: 0.5 * (v[0] + v[2])),
    "vertical": ("z", "Longitudinal level, positive downwards", lambda v: 0.5 * (v[1] + v[3])),
    "cross_level": ("h", "Cross level, positive with the left rail higher", lambda v: v[3] - v[1]),
    "gauge": ("g", "Gauge, positive when wider", lambda v: v[2] - v[0]),
}
LOOKS = {"as read": {"color": "0.6", "lw": 0.8}, "as it acts": {"color": DISTINCT[0], "lw": 1.0}}
ERRI = {"erri_b176_low": (DISTINCT[2], "--"), "erri_b176_high": (DISTINCT[1], "-.")}
WAVELENGTHS = (1.0, 200.0)  # m, that are shown
SEGMENTS = 8  # of a recording at least, for its spectrum; half overlapping
LONGEST = 400.0  # m, of a segment


@styled()
def recording_figure(before: Floats, after: Floats, title: str) -> Figure:
    """Draw a recording as its file holds it and as its rows act, over the distance and as spectra.

    `before`, `after` (float64[n, 5]): Rows s, y_left, z_left, y_right, z_right [m]. `title`: What
    it is called. Returns: A row for each irregularity: over the arc length, and its one-sided
    power spectral density (Welch 1967, Hann windows of at most 400 m) over the wavelength beside
    ERRI B176, formerly ORE; in the titles the standard deviations in the bands D1 and D2 of EN
    13848-1.
    """
    figure = Picture(10.6, 9.6, unformatted(title))
    grid = figure.subplots(4, 2, width_ratios=[1.7, 1.0], sharex="col")
    for (channel, (symbol, words, of)), (over, density) in zip(CHANNELS.items(), grid, strict=True):
        for (name, look), rows in zip(LOOKS.items(), (before, after), strict=True):
            over.plot(rows[:, 0], 1e3 * of(rows[:, 1:].T), label=name, **look)
            _spectrum(density, rows, of, look)
        over.set(title=f"{words}{_deviations(after, of)}", ylabel=f"${symbol}$ (mm)")
        over.margins(x=0.0)
        _draw_erri(density, channel)
    grid[-1, 0].set_xlabel("$s$ (m)")
    grid[-1, 1].set(xlabel="wavelength (m)", xlim=WAVELENGTHS[::-1])
    handles, labels = grid[0, 0].get_legend_handles_labels()
    more, named = grid[0, 1].get_legend_handles_labels()
    figure.legend(handles + more, labels + named, loc="outside lower left", ncols=4)
    return figure


def _even_values(rows: Floats, channel: Callable[[Floats], Floats]) -> tuple[Floats, float]:
    """Values at equal steps, and the step [m]."""
    step = float(np.mean(np.diff(rows[:, 0])))
    s = rows[0, 0] + step * np.arange(len(rows))
    return np.interp(s, rows[:, 0], channel(rows[:, 1:].T)), step


def _deviations(rows: Floats, channel: Callable[[Floats], Floats]) -> str:
    values, step = _even_values(rows, channel)
    parts = []
    for name in ("D1", "D2"):
        if step * len(values) > 3.0 * BANDS[name][1] and 2.0 * step < BANDS[name][0]:
            deviation = 1e3 * float(np.std(band_passed(values[None], step, BANDS[name])))
            parts.append(f"{name} {deviation:.2f}")
    return f"; standard deviation {', '.join(parts)} mm" if parts else ""


def _spectrum(
    axes: Axes, rows: Floats, channel: Callable[[Floats], Floats], look: dict[str, object]
) -> None:
    values, step = _even_values(rows, channel)
    size = max(8, min(round(LONGEST / step), 2 * len(values) // (SEGMENTS + 1)))
    if len(values) < size:
        return
    f, S = welch(values, 1.0 / step, nperseg=size)
    shown = (f > 1.0 / WAVELENGTHS[1]) & (f < 1.0 / WAVELENGTHS[0]) & (1e-6 * np.max(S) < S)
    axes.plot(1.0 / f[shown], 1e6 * S[shown], **look)  # type: ignore[arg-type]


def _draw_erri(axes: Axes, channel: str) -> None:
    """The spectra of ERRI B176 between their wavelengths of 3 and 70 m."""
    wavelength = np.geomspace(3.0, 70.0, 80)
    for name, (colour, line) in ERRI.items():
        spectrum = SPECTRA[name]
        S = 2.0 * np.pi * spectrum.density(channel, 2.0 * np.pi / wavelength)
        if channel == "cross_level":  # of the angle; a height over the cant base
            S = S * (2.0 * spectrum.half_base) ** 2
        label = f"{spectrum.label} (formerly ORE)"
        axes.plot(wavelength, 1e6 * S, color=colour, ls=line, lw=1.0, label=label)
    axes.set(xscale="log", yscale="log", ylabel="$S$ (mm²/(1/m))")
    axes.set(title="Power spectral density" if channel == "lateral" else "")
