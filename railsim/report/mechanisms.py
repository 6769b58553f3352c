"""A self-contained page about a mechanism: player, inputs with sources, results, pictures.

`figures` draws all pictures of the results, `page` returns the page, `animation` a GIF and
`positions` a table of all positions.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from railsim.definitions.mechanism.parts import AirSpring
from railsim.design_checks import check_table
from railsim.mechanisms import drawing, tables
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks
from railsim.mechanisms.dynamics import driving_actuator
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.links import Course, actuators, links
from railsim.mechanisms.quantities import force_unit, quantity
from railsim.mechanisms.remarks import remarks
from railsim.mechanisms.selection import selection
from railsim.mechanisms.tolerance import scatter
from railsim.plot import mechanisms as plots
from railsim.plot.style import styled
from railsim.report.document import Section, as_png, design_page, pictures
from railsim.table import Table

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

REPORT = "report.html"
FRAMES = 121
GIF_FRAMES = 40
DASHES = {"guide": [2, 3], "spring": [7, 4], "damper": [4, 3]}

METHOD = (
    "Body coordinates and constraints of the joints, Newton's method with continuation along the "
    "driver; derivatives from the constraints' Jacobian. Forces by virtual work, reactions by "
    "Lagrange's multipliers. Angles of the tables are folded to 0 to 90 degrees.",
    "The table of parameters states the origin of every number: printed in the source, derived "
    "from printed numbers alone, reconstructed (agrees with what is printed, but is not unique), "
    "new (our choice), optimised, or set by the caller. A result is only as certain as the least "
    "certain of its parameters.",
)

TOLERANCES = (
    "First order. RSS: root of the sum of squares of the single deviations; worst case: sum of "
    "their magnitudes."
)


@dataclass(frozen=True)
class PageResults:
    """Results on the page."""

    results: Sequence[Analysis]  # one for each file; the first is the one that the page describes
    cases: Mapping[str, Analysis]  # its base and cases, where it has cases
    optimum: "Optimum | None" = None

    @property
    def result(self) -> Analysis:
        """The analysis that the page describes: the optimum, else the first file's."""
        return self.optimum.after if self.optimum is not None else self.results[0]


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
    "gas_springs": "Length and force of the gas springs.", "cases": "Unknown force in all cases.",
    "time": "The motion in time.", "comparison": "The mechanisms side by side over the height.",
    "comparison_held": "Pressures needed, and contact forces at the held pressures.",
    "comparison_zone": "The same within the zone; below, the differences from the first.",
    "search": "Objective at the end of the search from each starting point.",
}  # fmt: skip
NAMES = (REPORT, "animation.gif", "positions.csv", "motion.csv", *(f"{n}.png" for n in CAPTIONS))
"""Of all files that there can be of one mechanism."""


def files(contents: PageResults) -> dict[str, bytes]:
    """Page, pictures, animation and tables by the names of their files."""
    images = {name: as_png(figure) for name, figure in figures(contents).items()}
    content = {f"{name}.png": png for name, png in images.items()}
    content["animation.gif"] = animation(contents.result)
    content["positions.csv"] = positions(contents.result)
    if contents.result.timed is not None:
        content["motion.csv"] = motion_table(contents.result)
    return content | {REPORT: page(contents, images).encode()}


def figures(contents: PageResults) -> dict[str, Figure]:
    """Draw all pictures; returned by the names of their files."""
    result, optimum = contents.result, contents.optimum
    definition, output = result.definition, result.output
    compared = _side_by_side(contents) if "ratio" in output or result.zone else {}
    solved = definition.held_by if definition.solve else None
    compares = bool(compared) and "ratio" in output
    held = any("pressure" in one.output for one in compared.values())
    cams = any(hasattr(joint, "cam") for joint in definition.joints.values())
    gas, cases = any(name.endswith("_length") for name in output), list(contents.cases)
    zoomed, air = partial(plots.comparison_figure, zoom=True), isinstance(solved, AirSpring)
    # whether there is something to draw, and what draws it
    candidates: dict[str, tuple[object, Callable[..., Figure], Any]] = {
        "drawing": (True, plots.drawing_figure, result),
        "path": ("height" in output, plots.path_figure, result),
        "kinematics": (True, plots.kinematics_figure, result),
        "actuators": (actuators(result.motion), plots.actuators_figure, result),
        "angles": (definition.angles, plots.angles_figure, result),
        "cam": (cams, plots.cam_figure, result),
        "ratio_force": ("force" in output or "ratio" in output, plots.force_figure, result),
        "pressure": ("pressure" in output, plots.pressure_figure, result),
        "contact": (result.contact, plots.contact_figure, result),
        "carpet": ("pressure" in output and air, plots.carpet_figure, result),
        "gas_springs": (gas, plots.gas_spring_figure, result),
        "cases": ("force" in output and cases[1:], plots.cases_figure, contents.cases),
        "time": (result.timed, plots.time_figure, result),
        "comparison": (compares, plots.comparison_figure, compared),
        "comparison_held": (compares and held, plots.held_figure, compared),
        "comparison_zone": (compares and result.zone, zoomed, compared),
        "search": (optimum, plots.search_figure, optimum),
    }
    drawn = {name: draw(data) for name, (use, draw, data) in candidates.items() if use}
    others = contents.results[1:] if optimum is None else ()
    return drawn | {
        f"drawing_{i}": plots.drawing_figure(other) for i, other in enumerate(others, start=2)
    }


def _side_by_side(contents: PageResults) -> dict[str, Analysis]:
    """Mechanisms side by side by their labels: several files, or before and after a search."""
    optimum = contents.optimum
    if optimum is not None and optimum.before is not None:
        return {"as in the file": optimum.before, "optimised": optimum.after}
    if len(contents.results) < 2:
        return {}
    by_label: dict[str, Analysis] = {}
    for result in contents.results:
        label = result.definition.name + (f", {result.case}" if result.case else "")
        by_label[label if label not in by_label else f"{label} ({len(by_label) + 1})"] = result
    return by_label


def positions(result: Analysis) -> bytes:
    """All results at all positions as CSV; the header names quantity and unit."""
    definition = result.definition
    units = {name: quantity(name, definition).si_unit or 1 for name in result.output}
    columns = {f"{name} [{units[name]}]": values for name, values in result.output.items()}
    unit = quantity("travel", definition).si_unit
    for courses, value, of in _courses(result.motion):
        rates = f"{value} first [{of}/{unit}]", f"{value} second [{of}/{unit}2]"
        columns |= _columns(courses, f"{value} [{of}]", *rates)
    return _csv(columns)


def motion_table(result: Analysis) -> bytes:
    """The motion in time as CSV: driver, force, every link and actuator, the output."""
    timed = result.timed
    assert timed is not None
    unit = quantity("travel", result.definition).si_unit
    force = f"force [{force_unit(driving_actuator(result.definition), result.definition)}]"
    columns = {"time [s]": timed.time, f"travel [{unit}]": timed.motion.s, force: timed.force}
    for courses, value, of in _courses(timed.motion):
        rates = f"{value} speed [{of}/s]", f"{value} acceleration [{of}/s2]"
        columns |= _columns(timed.in_time(courses), f"{value} [{of}]", *rates)
    if result.definition.output is not None:
        v, a = timed.point(result.definition.output.point)
        for k, axis in enumerate("xy"):
            columns[f"output speed {axis} [m/s]"] = v[:, k]
            columns[f"output acceleration {axis} [m/s2]"] = a[:, k]
    return _csv(columns)


def _courses(motion: Any) -> tuple[tuple[dict[str, Course], str, str], ...]:
    return (links(motion), "angle", "rad"), (actuators(motion), "length", "m")


def _columns(courses: Mapping[str, Course], *headers: str) -> dict[str, Any]:
    """Columns of angles or lengths with two derivatives, by their headers."""
    each = ((name, zip(headers, vars(one).values(), strict=True)) for name, one in courses.items())
    return {f"{name} {header}": values for name, own in each for header, values in own}


def _csv(columns: Mapping[str, Any]) -> bytes:
    lists = (np.asarray(values, dtype=float).tolist() for values in columns.values())
    return Table(columns, zip(*lists, strict=True)).csv().encode()


def animation(result: Analysis) -> bytes:
    """The motion of the mechanism to its end and back, as the bytes of a GIF file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    model = result.model
    motion = solve(model, np.linspace(model.start, model.end, GIF_FRAMES))
    drawn = drawing.lines(motion)
    every = np.concatenate([line.xy.reshape(-1, 2) for line in drawn]) * 1e3
    x0, x1, y0, y1 = drawing.box(every, 0.06)
    frames = []
    with styled():
        figure = Figure(figsize=(5.2, 4.6), dpi=80, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes = figure.subplots()
        made = plots.draw(axes, drawn, 0, "#1d2429", "")
        axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
        title = axes.set_title(_position(result, motion.s[0]))
        moving: list[Any] = [*made, title]
        for artist in moving:
            artist.set_animated(True)  # excluded from the background
        canvas.draw()  # type: ignore[no-untyped-call]
        still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[no-untyped-call]
        for k in range(GIF_FRAMES):
            canvas.restore_region(still)  # type: ignore[no-untyped-call]
            for line, artist in zip(drawn, made, strict=True):
                artist.set_data(*(line.xy[k] * 1e3).T)
            title.set_text(_position(result, motion.s[k]))
            for artist in moving:
                artist.draw(canvas.get_renderer())  # type: ignore[no-untyped-call]
            pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
            frames.append(Image.fromarray(pixels).convert("L"))
    buffer = BytesIO()
    both = frames + frames[-2:0:-1]
    both[0].save(buffer, "GIF", save_all=True, append_images=both[1:], duration=60, loop=0)
    return buffer.getvalue()


def _position(result: Analysis, s: float) -> str:
    """The driver's value as the animations show it."""
    driver = quantity("travel", result.definition)
    return f"driver at {s * driver.scale:.1f} {driver.unit}".replace(" deg", "°")


def player(result: Analysis) -> tuple[str, dict[str, Any]]:
    """The view box of the player and its data: lines as SVG coordinates in mm, y downwards."""
    model = result.model
    motion = solve(model, np.linspace(model.start, model.end, FRAMES))
    drawn = drawing.lines(motion)
    every = np.concatenate([line.xy.reshape(-1, 2) for line in drawn]) * [1e3, -1e3]
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.06 * np.max(high - low)
    whole = [*(low - margin), *(high - low + 2 * margin)]
    a, b, c, d = (1e3 * edge for edge in drawing.working_box(motion))
    ground = [xy[0] for name, xy in drawing.points(motion).items() if name.startswith("ground.")]
    moving = []
    for line in drawn:
        at = [" ".join(f"{x * 1e3:.1f},{-y * 1e3:.1f}" for x, y in points) for points in line.xy]
        look = {"width": 1.4 * plots.WIDTHS[line.kind], "dash": DASHES.get(line.kind)}
        moving.append({**look, "kind": line.kind, "points": at})
    data = {
        "lines": moving, "fixed": [[round(x * 1e3, 1), round(-y * 1e3, 1)] for x, y in ground],
        "texts": _sentences(result, motion.s), "whole": [round(float(v), 1) for v in whole],
        "near": [round(float(v), 1) for v in (a, -d, b - a, d - c)],
    }  # fmt: skip
    return " ".join(f"{v:.1f}" for v in whole), data


def _sentences(result: Analysis, s: Any) -> list[str]:
    order = np.argsort(result.output["travel"])
    columns = [quantity(n, result.definition) for n in ("height", "force") if n in result.output]
    travel, *known = (result.output[name][order] for name in ("travel", *(c.name for c in columns)))
    known = [np.interp(s, travel, x) * c.scale for c, x in zip(columns, known, strict=True)]
    found = []
    for k, value in enumerate(s):
        words = [f"{c.name} {x[k]:.0f} {c.unit}" for c, x in zip(columns, known, strict=True)]
        found.append(", ".join([_position(result, value), *words]))
    return found


def page(contents: PageResults, images: Mapping[str, bytes]) -> str:
    """Return the page as HTML, with PNG pictures by the names of `figures`."""
    result = contents.result
    definition, made = result.definition, checks(result)
    drawings = partial(pictures, images, CAPTIONS)
    rows = [tables.position_table(result), tables.published_table(result)]
    rows = [table for table in (*rows, check_table(made, notes=True)) if len(table)]
    sections = [Section("Results", tables.sentences(result), rows, drawings(["drawing", "path"]))]
    compared = drawings(["comparison", "comparison_held", "comparison_zone"])
    if (optimum := contents.optimum) is not None:
        found = tables.optimum_sentences(optimum), tables.optimum_tables(optimum)
        sections.append(Section("Search", *found, drawings(["search"])))
        sections.append(Section("Before and after the search", drawings=compared))
    if len(contents.results) > 1:
        compared += drawings(name for name in images if name.startswith("drawing_"))
        rows = [tables.comparison_table(contents.results)]
        sections.append(Section("Comparison", [], rows, compared))
    kinematics = drawings(["kinematics", "actuators", "angles", "cam"])
    forces = ("ratio_force", "pressure", "carpet", "contact", "gas_springs", "cases", "time")
    rows = [tables.reaction_table(result)]
    sections.append(Section("Kinematics", drawings=kinematics))
    sections.append(Section("Forces and motion", [], rows, drawings(forces)))
    if choices := selection(result):
        sections.append(Section("Selection", [], [tables.selection_table(choices)]))
    if definition.tolerances:
        rows = [tables.scatter_table(scatter(definition))]
        sections.append(Section("Tolerances", [TOLERANCES], rows))
    sections.append(Section("Parameters", [], [tables.parameter_table(result)]))
    box, data = player(result)
    title = f"Mechanism: {definition.name}" + (f", {result.case}" if result.case else "")
    play = {"scripts": ["templates/player.js"], "data": data, "box": box, "last": FRAMES - 1}
    words = remarks(result)
    return design_page(title, definition.source, made, sections, METHOD, remarks=words, **play)
