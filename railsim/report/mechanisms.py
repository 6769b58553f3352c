"""A self-contained page about a mechanism: player, inputs with sources, results, pictures.

`figures` draws all pictures of the results, `page` returns the page, `animation` a GIF and
`positions` a table of all positions.
"""

import csv
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from railsim.definitions.mechanism_parts import AirSpring
from railsim.mechanisms import drawing, tables
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks
from railsim.mechanisms.comparison import Comparison
from railsim.mechanisms.dynamics import driving
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.links import Course, actuators, links
from railsim.mechanisms.quantities import force_unit, quantity
from railsim.mechanisms.remarks import remarks
from railsim.mechanisms.selection import selection
from railsim.mechanisms.tables import Texts
from railsim.mechanisms.tolerance import Scatter, scatter
from railsim.page import rendered
from railsim.plot import mechanisms as pictures
from railsim.plot.style import styled
from railsim.version import __version__

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

DPI = 130
FRAMES = 121
GIF_FRAMES = 40
DASHES = {"guide": [2, 3], "spring": [7, 4], "damper": [4, 3]}
COLOURS = {"actuator": "#004a80", "spring": "#b8450a", "cam": "#00664b"}

METHOD = (
    "Body coordinates and constraints of the joints, Newton's method with continuation along the "
    "driver; derivatives from the constraints' Jacobian. Forces by virtual work, reactions by "
    "Lagrange's multipliers. Angles of the tables are folded to 0 to 90 degrees.",
    "The table of parameters states the origin of every number: printed in the source, derived "
    "from printed numbers alone, reconstructed (agrees with what is printed, but is not unique), "
    "new (our choice), optimised, or set by the caller. A result is only as certain as the least "
    "certain of its parameters.",
)


@dataclass(frozen=True)
class Collected:
    """Results on the page.

    Attributes
    ----------
    results : sequence of Analysis
        One for each file; the first is the one that the page describes.
    cases : mapping of str to Analysis
        Its base and cases, where it has cases.
    comparison : Comparison or None
    optimum : Optimum or None
    """

    results: Sequence[Analysis]
    cases: Mapping[str, Analysis]
    comparison: Comparison | None = None
    optimum: "Optimum | None" = None

    @property
    def result(self) -> Analysis:
        """The analysis that the page describes: the optimum, else the first file's."""
        return self.optimum.after if self.optimum is not None else self.results[0]


@dataclass(frozen=True)
class Table:
    """A table of the page; `words` are the columns with text, `failed` the rows in red."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str = ""
    words: frozenset[int] = frozenset({0})
    failed: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Picture:
    """A picture of the page: PNG in base64, its width on the screen, its caption."""

    png: str
    width: int
    caption: str


@dataclass
class Section:
    """A section of the page."""

    title: str
    texts: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    figures: list[Picture] = field(default_factory=list)


CAPTIONS = {
    "drawing": "Four positions, and the working parts with the names of their points; crossed "
    "circles: centres of gravity at the start, zigzags: springs, tubes: gas springs.",
    "path": "Path of the output.",
    "kinematics": "Angles of bodies and rods, their rates and accelerations.",
    "actuators": "Lengths of the actuators, their speeds and accelerations.",
    "angles": "Transmission angles folded to 90 degrees, pressure angles of cams; zone shaded.",
    "cam": "Rate on the arcs of the cam with the transitions; thin: each arc beyond its part.",
    "ratio_force": "Ratio and force over length and height; zone shaded, work height dashed.",
    "pressure": "Pressure for equilibrium of the mechanism.",
    "contact": "Static contact force at constant pressure; a full circle is a stable equilibrium.",
    "carpet": "Carpet plot of the air spring with the load of the mechanism.",
    "gas_springs": "Length and force of the gas springs.",
    "cases": "Unknown force in all cases.",
    "time": "The motion in time.",
    "comparison": "The mechanisms side by side over the height.",
    "comparison_held": "Pressures needed, and contact forces at the held pressures.",
    "comparison_zone": "The same within the zone; below, the differences from the first.",
    "search": "Objective at the end of the search from each starting point.",
}


def figures(collected: Collected) -> dict[str, Figure]:
    """Draw all pictures; returned by the names of their files."""
    result = collected.result
    definition, output = result.definition, result.output
    others: dict[str, Figure] = {}
    with styled():
        drawn = {
            "drawing": pictures.drawing_figure(result),
            "kinematics": pictures.kinematics_figure(result),
        }
        if "height" in output:
            drawn["path"] = pictures.path_figure(result)
        if actuators(result.motion):
            drawn["actuators"] = pictures.actuators_figure(result)
        if definition.angles:
            drawn["angles"] = pictures.angles_figure(result)
        if any(hasattr(joint, "cam") for joint in definition.joints.values()):
            drawn["cam"] = pictures.cam_figure(result)
        if "force" in output or "ratio" in output:
            drawn["ratio_force"] = pictures.force_figure(result)
        if "pressure" in output:
            drawn["pressure"] = pictures.pressure_figure(result)
            assert definition.solve is not None
            if isinstance(definition.actuators[definition.solve.unknown], AirSpring):
                drawn["carpet"] = pictures.carpet_figure(result)
        if result.contact is not None:
            drawn["contact"] = pictures.contact_figure(result)
        if any(name.endswith("_length") for name in output):
            drawn["gas_springs"] = pictures.gas_spring_figure(result)
        if len(collected.cases) > 1 and "force" in output:
            drawn["cases"] = pictures.cases_figure(collected.cases)
        if result.timed is not None:
            drawn["time"] = pictures.time_figure(result)
        if (compared := _compared(collected)) and "ratio" in output:
            drawn["comparison"] = pictures.comparison_figure(compared)
            if any("pressure" in one.output for one in compared.values()):
                drawn["comparison_held"] = pictures.held_figure(compared)
            if result.zone:
                drawn["comparison_zone"] = pictures.comparison_figure(compared, zoom=True)
        if collected.optimum is not None:
            drawn["search"] = pictures.search_figure(collected.optimum)
        else:
            others = {
                f"drawing_{i}": pictures.drawing_figure(other)
                for i, other in enumerate(collected.results[1:], start=2)
            }
    return {name: drawn[name] for name in CAPTIONS if name in drawn} | others


def _compared(collected: Collected) -> dict[str, Analysis]:
    """Mechanisms side by side by their labels: several files, or before and after a search."""
    optimum = collected.optimum
    if optimum is not None and optimum.before is not None:
        return {"as in the file": optimum.before, "optimised": optimum.after}
    if len(collected.results) < 2:
        return {}
    found: dict[str, Analysis] = {}
    for result in collected.results:
        label = result.definition.name + (f", {result.case}" if result.case else "")
        found[label if label not in found else f"{label} ({len(found) + 1})"] = result
    return found


def as_png(figure: Figure) -> bytes:
    """Draw a figure as the bytes of a PNG file."""
    buffer = BytesIO()
    with styled():
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()


def positions(result: Analysis) -> bytes:
    """All results at all positions as CSV; the header names quantity and unit."""
    names = list(result.output)
    columns = {f"{n} [{quantity(n, result.definition).unit}]": result.output[n] for n in names}
    unit = quantity("travel", result.definition).unit
    columns |= _courses(links(result.motion), "angle", "rad", (f"rad/{unit}", f"rad/{unit}2"))
    columns |= _courses(actuators(result.motion), "length", "m", (f"m/{unit}", f"m/{unit}2"))
    return _csv(columns)


def motion_table(result: Analysis) -> bytes:
    """The motion in time as CSV: driver, force, every link and actuator, the output."""
    timed = result.timed
    assert timed is not None
    unit = quantity("travel", result.definition).unit
    force = f"force [{force_unit(driving(result.definition), result.definition)}]"
    columns = {"time [s]": timed.time, f"travel [{unit}]": timed.motion.s, force: timed.force}
    for courses, value, of in (
        (links(timed.motion), "angle", "rad"), (actuators(timed.motion), "length", "m"),
    ):  # fmt: skip
        moving = {n: c.in_time(timed.speed, timed.acceleration) for n, c in courses.items()}
        columns |= _courses(moving, value, of, (f"{of}/s", f"{of}/s2"), "speed", "acceleration")
    if result.definition.output is not None:
        v, a = timed.point(result.definition.output.point)
        for k, axis in enumerate("xy"):
            columns[f"output speed {axis} [m/s]"] = v[:, k]
            columns[f"output acceleration {axis} [m/s2]"] = a[:, k]
    return _csv(columns)


def _csv(columns: Mapping[str, Any]) -> bytes:
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow([repr(float(value)) for value in row])
    return text.getvalue().encode()


def _courses(
    courses: Mapping[str, Course],
    value: str,
    unit: str,
    units: tuple[str, str],
    first: str = "first",
    second: str = "second",
) -> dict[str, Any]:
    """Columns of angles or lengths with two derivatives, by their headers."""
    found = {}
    for name, course in courses.items():
        found[f"{name} {value} [{unit}]"] = course.value
        found[f"{name} {value} {first} [{units[0]}]"] = course.first
        found[f"{name} {value} {second} [{units[1]}]"] = course.second
    return found


def animation(result: Analysis) -> bytes:
    """The motion of the mechanism to its end and back, as the bytes of a GIF file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    model = result.model
    motion = solve(model, np.linspace(model.start, model.end, GIF_FRAMES))
    drawn = drawing.lines(motion)
    every = np.concatenate([line.xy.reshape(-1, 2) for line in drawn]) * 1e3
    (x0, y0), (x1, y1) = every.min(axis=0), every.max(axis=0)
    margin = 0.06 * max(x1 - x0, y1 - y0)
    frames = []
    with styled():
        figure = Figure(figsize=(5.2, 4.6), dpi=80, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes = figure.subplots()
        made = pictures.draw(axes, drawn, 0, "#1d2429", "")
        axes.set_xlim(x0 - margin, x1 + margin)
        axes.set_ylim(y0 - margin, y1 + margin)
        axes.set_aspect("equal")
        axes.set_xlabel("x / mm")
        axes.set_ylabel("y / mm")
        title = axes.set_title(_told(result, motion.s[0]))
        moving: list[Any] = [*made, title]
        for artist in moving:
            artist.set_animated(True)  # excluded from the background
        canvas.draw()  # type: ignore[no-untyped-call]
        still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[no-untyped-call]
        for k in range(GIF_FRAMES):
            canvas.restore_region(still)  # type: ignore[no-untyped-call]
            for line, artist in zip(drawn, made, strict=True):
                artist.set_data(*(line.xy[k] * 1e3).T)
            title.set_text(_told(result, motion.s[k]))
            for artist in moving:
                artist.draw(canvas.get_renderer())  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            frames.append(Image.fromarray(pixels).convert("L"))
    buffer = BytesIO()
    both = frames + frames[-2:0:-1]
    both[0].save(buffer, "GIF", save_all=True, append_images=both[1:], duration=60, loop=0)
    return buffer.getvalue()


def _told(result: Analysis, s: float) -> str:
    what = quantity("travel", result.definition)
    return f"driver at {s * what.scale:.1f} {what.shown.replace('deg', '°')}"


def player(result: Analysis) -> tuple[str, dict[str, Any]]:
    """The view box of the player and its data: lines as SVG coordinates in mm, y downwards."""
    model = result.model
    motion = solve(model, np.linspace(model.start, model.end, FRAMES))
    drawn = drawing.lines(motion)
    every = np.concatenate([line.xy.reshape(-1, 2) for line in drawn]) * [1e3, -1e3]
    (x0, y0), (x1, y1) = every.min(axis=0), every.max(axis=0)
    margin = 0.06 * max(x1 - x0, y1 - y0)
    whole = [x0 - margin, y0 - margin, x1 - x0 + 2 * margin, y1 - y0 + 2 * margin]
    a, b, c, d = (1e3 * edge for edge in drawing.working_box(motion))
    fixed = [
        [round(x * 1e3, 1), round(-y * 1e3, 1)]
        for name, xy in drawing.points(motion).items()
        if name.startswith("ground.")
        for x, y in xy[:1]
    ]
    data = {
        "lines": [
            {
                "width": 1.4 * pictures.WIDTHS[line.kind],
                "dash": DASHES.get(line.kind),
                "colour": COLOURS.get(line.kind, "#1d2429"),
                "points": [
                    " ".join(f"{x * 1e3:.1f},{-y * 1e3:.1f}" for x, y in points)
                    for points in line.xy
                ],
            }
            for line in drawn
        ],
        "fixed": fixed,
        "told": _sentences(result, motion.s),
        "whole": [round(float(v), 1) for v in whole],
        "near": [round(float(v), 1) for v in (a, -d, b - a, d - c)],
    }
    return " ".join(f"{v:.1f}" for v in whole), data


def _sentences(result: Analysis, s: Any) -> list[str]:
    """Text of the player at each position."""
    names = [n for n in ("height", "force") if n in result.output]
    order = np.argsort(result.output["travel"])
    known = {n: np.interp(s, result.output["travel"][order], result.output[n][order])
             for n in names}  # fmt: skip
    told = []
    for k, value in enumerate(s):
        parts = [_told(result, value)]
        for name in names:
            what = quantity(name, result.definition)
            parts.append(f"{name} {known[name][k] * what.scale:.0f} {what.shown}")
        told.append(", ".join(parts))
    return told


def page(collected: Collected, drawn: Mapping[str, bytes]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    collected : Collected
        Results.
    drawn : mapping of str to bytes
        PNG pictures by the names of `figures`.
    """
    result = collected.result
    definition = result.definition
    sections = [_results(result, drawn)]
    if collected.optimum is not None:
        sections.append(_search(collected.optimum, drawn))
    if collected.comparison is not None:
        sections.append(_comparison(collected.comparison, drawn))
    elif "comparison" in drawn:
        shown = _shown(drawn, "comparison", "comparison_held", "comparison_zone")
        sections.append(Section("Before and after the search", [], [], shown))
    sections += [_kinematics(drawn), _forces(result, drawn)]
    if choices := selection(result):
        rows = tables.selection_table(choices)
        failed = frozenset(i for i, row in enumerate(rows[1]) if row[2] == "no")
        words = frozenset({0, 1, 2, 3})
        sections.append(Section("Selection", [], [_table(rows, words=words, failed=failed)]))
    if definition.tolerances:
        sections.append(_tolerances(scatter(definition)))
    made = tables.parameter_table(result)
    sections.append(Section("Parameters", [], [_table(made, words=frozenset({0, 2}))]))
    source = definition.source or "no source given"
    box, data = player(result)
    return rendered(
        "railsim.report",
        "templates/document.html",
        title=f"Mechanism: {definition.name}" + (f", {result.case}" if result.case else ""),
        styles=["templates/document.css"],
        scripts=["templates/player.js"],
        data=data,
        box=box,
        last=FRAMES - 1,
        lead=f"{source}. Written by railsim {__version__}.",
        verdict=_verdict(result),
        remarks=remarks(result),
        sections=[s for s in sections if s.texts or s.tables or s.figures],
        method=METHOD,
    )


def _verdict(result: Analysis) -> dict[str, Any]:
    made = checks(result)
    failed = [check.name for check in made if not check.ok]
    if not made:
        return {"ok": True, "text": "The file states no limits to check."}
    met = "The check is met." if len(made) == 1 else f"All {len(made)} checks are met."
    text = f"Not met: {', '.join(failed)}." if failed else met
    return {"ok": not failed, "text": text}


def _shown(drawn: Mapping[str, bytes], *names: str) -> list[Picture]:
    found = []
    for name in names:
        if name in drawn:
            png = drawn[name]
            width = int.from_bytes(png[16:20], "big")  # the header of a PNG file
            code = b64encode(png).decode()
            caption = CAPTIONS[name.rstrip("_0123456789")]
            found.append(Picture(code, round(width * 96 / DPI), caption))
    return found


def _table(
    texts: Texts,
    caption: str = "",
    words: frozenset[int] = frozenset({0}),
    failed: frozenset[int] = frozenset(),
) -> Table:
    header, rows = texts
    return Table(header, rows, caption, words, failed)


def _results(result: Analysis, drawn: Mapping[str, bytes]) -> Section:
    shown = [_table(tables.upright(tables.position_table(result)))]
    if (published := tables.published_table(result))[1]:
        shown.append(_table(published, "Printed in the source, and computed"))
    if made := checks(result):
        failed = frozenset(i for i, check in enumerate(made) if not check.ok)
        header, rows = tables.check_table(made)
        noted = [[*row, check.note] for row, check in zip(rows, made, strict=True)]
        words = frozenset({0, 5})
        shown.append(_table(([*header, "comparison"], noted), words=words, failed=failed))
    return Section("Results", tables.sentences(result), shown, _shown(drawn, "drawing", "path"))


def _kinematics(drawn: Mapping[str, bytes]) -> Section:
    return Section("Kinematics", [], [], _shown(drawn, "kinematics", "actuators", "angles", "cam"))


def _forces(result: Analysis, drawn: Mapping[str, bytes]) -> Section:
    names = ("ratio_force", "pressure", "carpet", "contact", "gas_springs", "cases", "time")
    shown = [_table(tables.reaction_table(result), "Reactions")]
    return Section("Forces and motion", [], shown, _shown(drawn, *names))


def _search(optimum: "Optimum", drawn: Mapping[str, bytes]) -> Section:
    texts = tables.optimum_sentences(optimum)
    shown = [_table(tables.optimum_table(optimum), "Parameters")]
    if optimum.active:
        shown.append(_table(tables.active_table(optimum), "Active limits", frozenset({0, 1})))
    shown.append(_table(tables.start_table(optimum), "Starts"))
    return Section("Search", texts, shown, _shown(drawn, "search"))


def _comparison(comparison: Comparison, drawn: Mapping[str, bytes]) -> Section:
    shown = [_table(tables.comparison_table(comparison))]
    names = ("comparison", "comparison_held", "comparison_zone")
    drawings = [name for name in drawn if name.startswith("drawing_")]
    return Section("Comparison", [], shown, _shown(drawn, *names, *drawings))


def _tolerances(found: Sequence[Scatter]) -> Section:
    text = (
        "First order. Random: root of the sum of squares of the single deviations; worst case: "
        "sum of their magnitudes."
    )
    return Section("Tolerances", [text], [_table(tables.scatter_table(found))])
