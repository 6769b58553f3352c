"""Heat strip of a track judged by vehicles: largest share of each limit over the arc length."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from railsim.arrays import Floats
from railsim.plot.style import Picture, styled

LABELS = {"Y_over_Q": "Y/Q", "sum_Y": "sum Y", "body_y": "floor y", "body_z": "floor z"}


@styled()
def heat_strip(cells: Floats, shares: Mapping[tuple[str, float, str], Floats]) -> Figure:
    """Draw one row for each vehicle, speed and quantity; the colour is the share of the limit.

    `cells`: begin of each along the track, all of one length [m].
    """
    figure = Picture(10.0, 1.2 + 0.24 * len(shares))
    axes, rows = figure.subplots(), np.arange(len(shares) + 1)
    if shares:
        edges = np.append(cells, 2.0 * cells[-1] - cells[-2]) / 1e3
        values = np.array([*shares.values()])
        mesh = axes.pcolormesh(edges, rows, values, cmap="inferno_r", vmin=0.0, vmax=1.2)
        figure.colorbar(mesh, ax=axes, label="share of the limit (1)")
    words = [
        f"{vehicle}, {3.6 * speed:.0f} km/h, {LABELS.get(q, q)}" for vehicle, speed, q in shares
    ]
    axes.set_yticks(rows[:-1] + 0.5, words)
    axes.set(xlabel="s (km)")
    axes.invert_yaxis()
    return figure
