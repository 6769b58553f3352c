"""The track that a vehicle has read, with its uncertainty, and what it did not see."""

import numpy as np
from matplotlib.figure import Figure

from railsim.linear.track_response import QUANTITIES
from railsim.observation import Irregularity
from railsim.plot.style import Picture, styled

SHOWN = 3  # alignment, level, cross level
POINTS = 8000


@styled()
def irregularity_figure(irregularity: Irregularity) -> Figure:
    """Draw alignment, level and cross level in D1 with their 95 % intervals, and what is seen.

    The bottom shows over the wavelength which share of the assumed variance the channels explain.
    """
    figure = Picture(9.0, 9.0)
    axes = figure.subplots(SHOWN + 1, 1)
    every = max(1, len(irregularity.s) // POINTS)
    s = irregularity.s[::every]
    for q in range(SHOWN):
        panel, name = axes[q], QUANTITIES[q].replace("_", " ")
        for band, colour in (("D2", "0.6"), ("D1", "C0")):
            values = 1e3 * irregularity.bands[band][q, ::every]
            wide = 1.96e3 * irregularity.band_deviations[band][q, ::every]
            panel.fill_between(s, values - wide, values + wide, color=colour, alpha=0.3, lw=0)
            panel.plot(s, values, color=colour, lw=0.7, label=band)
        panel.set_ylabel(f"{name} (mm)")
        panel.sharex(axes[0])
    axes[0].legend(loc="upper right", ncols=2)
    axes[0].set_title(f"{irregularity.name}: track of {irregularity.vehicle}, with 95 % intervals")
    axes[SHOWN - 1].set_xlabel("s (m)")
    for piece in irregularity.pieces:
        for q, ls in enumerate(("-", "--", ":")):
            positive = piece.power[q] > 0.0
            wavelength, seen = 2.0 * np.pi / piece.wave_numbers[positive], piece.seen[q, positive]
            words = QUANTITIES[q].replace("_", " ") if piece is irregularity.pieces[0] else None
            axes[SHOWN].plot(wavelength, seen, color=f"C{q}", ls=ls, lw=0.9, label=words)
    axes[SHOWN].axhline(0.5, color="0.5", lw=0.8, ls="--")
    axes[SHOWN].set(xscale="log", xlabel="wavelength (m)", ylabel="share of the variance explained")
    if len(irregularity.pieces) > 1:
        axes[SHOWN].set_title(f"a line for each of {len(irregularity.pieces)} pieces of the run")
    axes[SHOWN].legend(loc="lower right")
    return figure
