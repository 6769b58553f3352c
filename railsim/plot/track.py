"""A track as a picture: the plan seen from above, below it over distance what the rails do.

Curvature and cant are always shown; gradient, irregularities, gauge, friction and support where
they are not constant.  Constants stand in the line under the title.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.integrate import cumulative_simpson

from railsim.arrays import Floats
from railsim.definitions.track import layout
from railsim.definitions.track.definition import Track
from railsim.definitions.track.elements import Section
from railsim.laws.permission import refused_laws
from railsim.plot import style
from railsim.plot.style import DISTINCT, LIMIT, SIDE_LINES, Picture, key, note, shade, spans, styled
from railsim.text import unformatted
from railsim.track.alignment import Alignment
from railsim.track.irregularity import shown_displacement

KINDS = {"STR": ("straight", "0.35"), "CLO": ("transition", "#d99000"), "CIR": ("curve", "#004a80")}
RESOLUTION = 16000
MOST_REMARKS = 8

_Row = tuple[str, str, dict[str, Floats]]
"""One pair of axes over the distance: title, label, curves by name; a single one needs none."""


@styled()
def track_figure(track: Track, title: str = "") -> Figure:
    """Draw a track: plan, curvature, cant, and what else is not constant along it.

    The plan with equal scales, right of the track downwards; below it the functions of the distance
    as they act, with their kinks rounded; at the end what is unusual in the alignment, with the
    positions marked.  `title`: By default the name of the track.
    """
    alignment = Alignment(track)
    s = np.linspace(0.0, track.length, RESOLUTION + 1)
    rows = [*_alignment_rows(track, alignment, s), *_rail_rows(track, s), *_table_rows(track, s)]
    sections = layout.curvature_sections(track)
    remarks = _remark_positions(track)
    height = 3.9 + 1.4 * len(rows) + 0.17 * len(remarks)
    constants = style.wrap(_constants(track), 7.6)
    room = "\n " * len(constants.splitlines())
    figure = Picture(8.0, height, f"{unformatted(title or track.name)}{room}")
    axes = figure.subplots(1 + len(rows), 1, height_ratios=[1.9] + [1.0] * len(rows))
    below = 0.11 + 0.19 * len(figure.get_suptitle().strip().splitlines())
    figure.text(0.012, 1.0 - below / height, constants, fontsize=8.5, va="top")
    _plan(axes[0], alignment, sections, s)
    shown = spans(sections, s, s)
    for k, row in enumerate(rows):
        _draw(axes[1 + k], row, s)
        if k:
            axes[1 + k].sharex(axes[1])
        shade(axes[1 + k], shown, with_names=k == 0)
        if k + 1 < len(rows):
            axes[1 + k].tick_params(labelbottom=False)
    for position in (at for positions, _ in remarks for at in positions):
        look: Any = {"marker": "^", "ms": 5, "color": LIMIT, "clip_on": False}
        axes[1].plot(position, 0.0, transform=axes[1].get_xaxis_transform(), **look)
    axes[-1].set_xlabel("Distance along the track $s$ (m)")
    if remarks:
        words = "\n".join(f"s = {at[0]:.0f} m: {text}" for at, text in remarks)
        figure.supxlabel(f"Remarks\n{words}", x=0.012, ha="left", fontsize=8, color=LIMIT)
    return figure


def _draw(axes: Axes, row: _Row, s: Floats) -> None:
    title, label, curves = row
    for k, (name, values) in enumerate(curves.items()):
        line = SIDE_LINES["right" if k else "left"]  # the second shows where both agree
        axes.plot(s, values, color=DISTINCT[k], ls=line, label=name)
    if any(values.min() < 0.0 for values in curves.values()):
        axes.axhline(0.0, color="0.35", lw=0.6, zorder=1)
    if len(curves) > 1:
        corner = (1.0, 0.93)  # beside the title
        axes.legend(loc="lower right", bbox_to_anchor=corner, ncols=len(curves))
    axes.set(title=title, ylabel=label)
    axes.margins(x=0.0)
    if all(np.ptp(values) == 0.0 for values in curves.values()):
        axes.set_ylim(min(axes.get_ylim()[0], -1.0), max(axes.get_ylim()[1], 1.0))


def _alignment_rows(track: Track, alignment: Alignment, s: Floats) -> Iterator[_Row]:
    curvature = {"curvature": 1e3 * alignment.curvature(s)}
    cant = {"cant": 1e3 * alignment.cant(s)}
    yield "Curvature, positive to the right", r"$\kappa$ (1/km)", curvature
    yield "Cant, positive with the left rail higher", "$h$ (mm)", cant
    if track.vertical:
        gradient = {"gradient": 1e3 * alignment.gradient(s)}
        yield "Gradient, positive uphill", "$i$ (‰)", gradient


def _rail_rows(track: Track, s: Floats) -> Iterator[_Row]:
    """Displacements of the rails by irregularities, and the gauge where it changes."""
    moved, without = shown_displacement(track), ""
    if names := refused_laws(track):
        without = f", without the law {', '.join(names)}"
    if moved is None:
        return
    y_left, z_left, y_right, z_right = 1e3 * moved(s)[0]
    gauge = 1e3 * track.gauge + y_right - y_left
    if track.irregularities:
        across, down = {"left": y_left, "right": y_right}, {"left": z_left, "right": z_right}
        words = "displacement of the rails, positive"
        if without or np.ptp([y_left, y_right]) > 0.0:
            yield f"Lateral {words} to the right{without}", "$y$ (mm)", across
        if without or np.ptp([z_left, z_right]) > 0.0:
            yield f"Vertical {words} downwards{without}", "$z$ (mm)", down
    if np.ptp(gauge) > 1e-6:
        yield "Gauge", "(mm)", {"gauge": gauge}


def _table_rows(track: Track, s: Floats) -> Iterator[_Row]:
    """Friction and support where they vary along the track."""
    words = "Stiffness and damping of the support, times those of the preset"
    support = None if track.support.preset == "rigid" else track.support.variation
    for table, title, label, names in (
        (track.friction_table, "Friction", r"$\mu$", ("left", "right")),
        (support, words, "", ("pads", "ballast")),
    ):
        if table is not None:
            at, *columns = np.array(table).T
            curves = {n: np.interp(s, at, v) for n, v in zip(names, columns, strict=True)}
            yield title, label, curves


def _constants(track: Track) -> str:
    """Return a line of what is the same along the track."""
    rail = " / ".join(dict.fromkeys(Path(name).name for name in track.rail))
    tilt = f"1:{1.0 / track.inclination:.3g}" if track.inclination else "upright"
    words = [f"gauge {1e3 * track.gauge:g} mm", f"rail {rail} {tilt}"]
    if track.friction_table is None:
        words.append(f"friction {track.friction_words}")
    words.append(f"support {track.support.preset}")
    if track.speed is not None:
        words.append(f"permitted {3.6 * track.speed:.0f} km/h")
    parts = [(f"{r.rail} check rail", r.rows[0][0], r.rows[-1][0]) for r in track.check_rail]
    parts += [(f"sections of the {r.rail} rail", r.begin, r.end) for r in track.sections]
    for name, begin, end in parts:
        words.append(f"{name} {max(begin, 0.0):g} to {min(end, track.length):g} m")
    return ", ".join(words)


def _remark_positions(track: Track) -> list[tuple[list[float], str]]:
    """Return positions and text of what is unusual in the alignment; equal texts once."""
    plans = layout.curvature_sections, layout.cant_sections, layout.gradient_sections
    begins = {section.key: section.begin for plan in plans for section in plan(track)}
    by_text: dict[str, list[float]] = {}
    for remark in layout.track_remarks(track):
        if remark.key in begins:
            by_text.setdefault(remark.text, []).append(begins[remark.key])
    times = {text: f"; {len(s)} times" if len(s) > 1 else "" for text, s in by_text.items()}
    remarks = sorted((sorted(s), text + times[text]) for text, s in by_text.items())
    if len(remarks) <= MOST_REMARKS:
        return remarks
    *shown, (s, text) = remarks[:MOST_REMARKS]
    more = remarks[MOST_REMARKS:]
    s += [position for others, _ in more for position in others]
    return [*shown, (s, f"{text}; and {len(more)} more")]


def _plan(axes: Axes, alignment: Alignment, sections: Sequence[Section], s: Floats) -> None:
    heading = alignment.heading(s)
    x = cumulative_simpson(np.cos(heading), x=s, initial=0.0)
    y = cumulative_simpson(np.sin(heading), x=s, initial=0.0)
    for section in sections:
        part = (s >= section.begin) & (s <= section.end)
        axes.plot(x[part], y[part], color=KINDS[section.type][1], lw=2.2)
        if section.type == "CIR":
            _name_curve(axes, section, s, x, y, heading)
    axes.plot(x[0], y[0], marker="o", color=KINDS["STR"][1], ms=4)
    axes.set(title="Plan, from the dot on, seen from above", xlabel="$X$ (m)")
    axes.set(ylabel="$Y$ (m), to the right")
    # room for the radii: what is no data is cut off for equal scales
    inch = max(float(np.ptp(x)) / 6.5, float(np.ptp(y)) / 1.4)
    axes.update_datalim([(x[0], y.min() - 0.3 * inch), (x[0], y.max() + 0.3 * inch)])
    axes.margins(0.1)
    axes.set_aspect("equal", adjustable="datalim")
    axes.invert_yaxis()
    used = {section.type for section in sections}
    known = [look for kind, look in KINDS.items() if kind in used]
    axes.legend(handles=[key(words, color=colour, lw=2.2) for words, colour in known], loc="best")


def _name_curve(
    axes: Axes, section: Section, s: Floats, x: Floats, y: Floats, heading: Floats
) -> None:
    """Write the radius on the outer side of a curve."""
    at = int(np.searchsorted(s, 0.5 * (section.begin + section.end)))
    outwards = -np.sign(section.start_value) * np.array([-np.sin(heading[at]), np.cos(heading[at])])
    words = f"R {style.signed(1.0 / section.start_value)} m"
    shift = 12.0 * outwards * (1.0, -1.0)  # Y points down on the page
    ha = "left" if outwards[0] > 0.3 else "right" if outwards[0] < -0.3 else "center"
    va = "bottom" if outwards[1] < -0.3 else "top" if outwards[1] > 0.3 else "center"
    note(axes, words, (x[at], y[at]), shift, ha, va, fontsize=8, color=KINDS["CIR"][1])
