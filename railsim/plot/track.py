"""A track as a picture: the plan seen from above, curvature, cant and gradient over distance."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.integrate import cumulative_simpson

from railsim.definitions.layout import Section, curvature_sections
from railsim.definitions.track import Track
from railsim.plot.style import DISTINCT, Picture, shade, spans, styled
from railsim.result.data import Array
from railsim.text import unformatted
from railsim.track.alignment import Alignment

KINDS = {"STR": ("straight", "0.35"), "CLO": ("transition", "#d99000"), "CIR": ("curve", "#004a80")}
RESOLUTION = 4000


def track_figure(track: Track, title: str = "") -> Figure:
    """Draw a track in plan, with its curvature and cant, and its gradient where it has one.

    Parameters
    ----------
    track : Track
        What to draw.
    title : str
        By default the name of the track.

    Returns
    -------
    Figure
        The plan with equal scales, right of the track downwards; below it the functions of the
        distance as they act, with their kinks rounded.
    """
    alignment = Alignment(track)
    s = np.linspace(0.0, track.length, RESOLUTION + 1)
    functions = [
        ("Curvature, positive to the right", r"$\kappa$ (1/km)", 1e3 * alignment.curvature(s)),
        ("Cant, positive with the left rail higher", "$h$ (mm)", 1e3 * alignment.cant(s)),
    ]
    if track.vertical:
        functions.append(("Gradient, positive uphill", "$i$ (‰)", 1e3 * alignment.gradient(s)))
    sections = curvature_sections(track)
    with styled():
        figure = Picture(figsize=(8.0, 3.6 + 1.5 * len(functions)), layout="constrained")
        rows = figure.subplots(1 + len(functions), 1, height_ratios=[1.9] + [1.0] * len(functions))
        figure.suptitle(unformatted(title or track.name), x=0.012, ha="left")
        _plan(rows[0], alignment, sections, s)
        shown = spans(sections, s, s)
        for axes, (words, label, values) in zip(rows[1:], functions, strict=True):
            axes.plot(s, values, color=DISTINCT[0])
            axes.axhline(0.0, color="0.35", lw=0.6, zorder=1)
            axes.set_title(words)
            axes.set_ylabel(label)
            axes.margins(x=0.0)
            axes.sharex(rows[1])
            shade(axes, shown, named=axes is rows[1])
        for axes in rows[1:-1]:
            axes.tick_params(labelbottom=False)
        rows[-1].set_xlabel("Distance along the track $s$ (m)")
        return figure


def _plan(axes: Axes, alignment: Alignment, sections: Sequence[Section], s: Array) -> None:
    heading = alignment.heading(s)
    x = cumulative_simpson(np.cos(heading), x=s, initial=0.0)
    y = cumulative_simpson(np.sin(heading), x=s, initial=0.0)
    for section in sections:
        part = (s >= section.begin) & (s <= section.end)
        axes.plot(x[part], y[part], color=KINDS[section.type][1], lw=2.2)
        if section.type == "CIR":
            _name_curve(axes, section, s, x, y, heading)
    axes.plot(x[0], y[0], marker="o", color=KINDS["STR"][1], ms=4)
    axes.set_title("Plan, from the dot on, seen from above")
    axes.set_xlabel("$X$ (m)")
    axes.set_ylabel("$Y$ (m), to the right")
    axes.margins(0.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.invert_yaxis()
    used = {section.type for section in sections}
    handles = [
        Line2D([], [], color=colour, lw=2.2, label=words)
        for kind, (words, colour) in KINDS.items()
        if kind in used
    ]
    axes.legend(handles=handles, loc="best")


def _name_curve(axes: Axes, section: Section, s: Array, x: Array, y: Array, heading: Array) -> None:
    """Write the radius on the outer side of a curve."""
    at = int(np.searchsorted(s, 0.5 * (section.begin + section.end)))
    outwards = -np.sign(section.start_value) * np.array([-np.sin(heading[at]), np.cos(heading[at])])
    axes.annotate(
        f"R {abs(1.0 / section.start_value):.6g} m",
        (x[at], y[at]),
        xytext=(12.0 * outwards[0], -12.0 * outwards[1]),  # Y points down on the page
        textcoords="offset points",
        ha="left" if outwards[0] > 0.3 else "right" if outwards[0] < -0.3 else "center",
        va="bottom" if outwards[1] < -0.3 else "top" if outwards[1] > 0.3 else "center",
        fontsize=8,
        color=KINDS["CIR"][1],
    )
