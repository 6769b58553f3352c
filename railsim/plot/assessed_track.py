"""Heat strip of a track judged by vehicles: largest share of each limit over the arc length."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from railsim.plot.style import styled

LABELS = {"Y_over_Q": "Y/Q", "sum_Y": "sum Y", "body_y": "floor y", "body_z": "floor z"}


class Assessed(Protocol):
    """What is drawn, such as `railsim.studies.assess_track.TrackAssessment`."""

    @property
    def cells(self) -> np.ndarray: ...  # noqa: D102 - as there
    @property
    def share(self) -> float: ...  # noqa: D102
    @property
    def shares(self) -> Mapping[tuple[str, float, str], np.ndarray]: ...  # noqa: D102


@styled()
def heat_strip(found: Assessed) -> Figure:
    """Draw one row for each vehicle, speed and quantity; the colour is the share of the limit."""
    names = list(found.shares)
    figure = Figure(figsize=(10.0, 1.2 + 0.24 * len(names)), layout="constrained")
    axes = figure.subplots()
    if names:
        cell = float(found.cells[1] - found.cells[0])
        edges = np.append(found.cells, found.cells[-1] + cell) / 1e3
        shares, rows = np.array([found.shares[name] for name in names]), np.arange(len(names) + 1)
        mesh = axes.pcolormesh(edges, rows, shares, cmap="inferno_r", vmin=0.0, vmax=1.2)
        figure.colorbar(mesh, ax=axes, label="share of the limit (1)")
    words = [
        f"{vehicle}, {3.6 * speed:.0f} km/h, {LABELS.get(q, q)}" for vehicle, speed, q in names
    ]
    axes.set_yticks(np.arange(len(names)) + 0.5, words)
    axes.set(xlabel="s (km)")
    axes.invert_yaxis()
    return figure
