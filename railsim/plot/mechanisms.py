"""Pictures of mechanisms: drawing, kinematics, forces, motion, cases and files side by side.

Every function takes results of `railsim.mechanisms` and returns a figure in the field's habits: mm,
degrees, N, MPa.  Lines can be distinguished without colour too.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from railsim.arrays import Floats
from railsim.definitions.mechanism.parts import AirSpring, Cam
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.cams import cam_rows, on_one_arc
from railsim.mechanisms.drawing import Line, centres, joint_points, lines, points, working_box
from railsim.mechanisms.dynamics import driving_actuator
from railsim.mechanisms.forces import table_of
from railsim.mechanisms.kinematics import Motion, folded, solve
from railsim.mechanisms.links import Course, actuators, links
from railsim.mechanisms.quantities import force_unit, force_units, quantity
from railsim.plot import style
from railsim.plot.point_names import name_points
from railsim.text import unformatted

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

DASHES: tuple[Any, ...] = (
    "-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)), (0, (3, 1, 1, 1, 1, 1)), (0, (11, 3)),
    (0, (1, 3)), (0, (9, 2, 3, 2)),
)  # fmt: skip
MAIN, SECOND = style.DISTINCT[:2]
SHADES = ("0.72", "0.55", "0.35", "#004a80")
WIDTHS = {"body": 2.2, "link": 1.3, "guide": 0.8, "cam": 1.8}
WIDTHS |= {"actuator": 3.2, "spring": 1.0, "damper": 1.6}
CENTRE: dict[str, Any] = {"marker": "$\\oplus$", "color": "k", "ms": 8, "ls": "", "zorder": 5}
STYLES = {"guide": (0, (1, 1.5)), "damper": (0, (3, 1.5))}


def line_style(i: int) -> dict[str, Any]:
    """Colour and dashes of the line of a number."""
    return {"color": style.distinct(i), "ls": DASHES[i % len(DASHES)]}


def label_of(name: str, result: Analysis, words: str = "") -> str:
    """Label of an axis for a named result."""
    unit = quantity(name, result.definition).unit
    text = words or name.replace("_", " ")
    return f"{text} ({unit.replace('deg', '°')})" if unit else text


def values_of(name: str, result: Analysis) -> Floats:
    """Values of a named result in the unit shown."""
    found: Floats = np.asarray(result.output[name]) * quantity(name, result.definition).scale
    return found


def mark_zone(axes: Axes, result: Analysis, over: str) -> None:
    """Shade the zone and mark the work height over a quantity."""
    if not result.zone or over not in result.zone["low"]:
        return
    scale = quantity(over, result.definition).scale
    low, work, high = (result.zone[k][over] * scale for k in ("low", "work", "high"))
    axes.axvspan(min(low, high), max(low, high), color="0.93", lw=0, zorder=0)
    axes.axvline(work, color="0.5", lw=0.8, ls=(0, (4, 2)), zorder=1)


def travel_name(result: Analysis) -> str:
    """Name of the result that says how far the output has moved along its axis."""
    return "x" if result.model.axis == 0 else "height"


def curves(
    axes: Axes, result: Analysis, over: str, lines: Iterable[tuple[Any, str]], label: str
) -> None:
    """Draw lines (values, name) over a result, with labels, legend and the zone."""
    for i, (values, name) in enumerate(lines):
        axes.plot(values_of(over, result), values, label=name, **line_style(i))
    mark_zone(axes, result, over)
    axes.set(xlabel=label_of(over, result, "driver" if over == "travel" else ""), ylabel=label)
    axes.legend(ncols=3)


def three_rows(
    over: Any, courses: Mapping[str, Course], scale: float, labels: Iterable[str]
) -> tuple[style.Picture, Any]:
    """A figure of courses, their first and their second derivatives."""
    figure = style.Picture(7.6, 5.6)
    rows = figure.subplots(3, 1, sharex=True)
    for i, (name, course) in enumerate(courses.items()):
        for axes, values in zip(rows, vars(course).values(), strict=True):
            axes.plot(over, np.round(values * scale, 9), label=name, **line_style(i))  # no noise
    for axes, label in zip(rows, labels, strict=True):
        axes.set_ylabel(label)
    rows[0].legend(ncols=3)
    return figure, rows


@style.styled()
def drawing_figure(result: Analysis) -> Figure:
    """The mechanism in four positions, and its working parts with the names of their points."""
    model = result.model
    s = np.linspace(model.start, model.end, 4)
    if result.zone:
        s[1] = result.zone["work"]["travel"]
        s[2] = 0.5 * (s[1] + s[3])
    motion = solve(model, s)
    box = working_box(motion)
    every = np.concatenate([xy for xy in points(motion).values()])
    size = float(np.max(np.ptp(every, axis=0)))
    small = max(box[1] - box[0], box[3] - box[2]) < 0.6 * size
    flat = box[1] - box[0] > 1.6 * (box[3] - box[2])
    if small and flat:
        figure = style.Picture(6.6, 7.4)
        axes = figure.subplots(2, 1, height_ratios=[1.5, 1.0])
    elif small:
        figure = style.Picture(9.0, 4.6)
        axes = figure.subplots(1, 2, width_ratios=[1.0, 1.25])
    else:
        figure = style.Picture(6.6, 5.2)
        axes = [figure.subplots()]
    scale = quantity("travel", result.definition)
    for k in range(4):
        label = f"{s[k] * scale.scale:.1f} {scale.unit}".replace(" deg", "°")
        draw(axes[0], lines(motion), k, SHADES[k], label)
    named = axes[-1]
    if small:
        draw(named, lines(motion), 3, "0.8", "")
        draw(named, lines(motion), 0, "#004a80", "")
        named.set(xlim=(box[0] * 1e3, box[1] * 1e3), ylim=(box[2] * 1e3, box[3] * 1e3))
        named.set(title="working parts at the start (grey: at the end)")
    for one in axes:
        one.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
    for xy in centres(motion).values():
        for one in axes:
            one.plot(*(xy[0] * 1e3), **CENTRE)
    axes[0].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="driver at")
    if not small:
        named.margins(0.12)
    mark_points(named, motion, box if small else None)
    return figure


def draw(axes: Axes, lines: Sequence[Line], k: int, colour: str, label: str) -> list[Line2D]:
    """Draw the lines of a mechanism at one of its positions [mm]."""
    made = []
    for i, line in enumerate(lines):
        look: Any = {"lw": WIDTHS[line.kind], "ms": 2.5, "ls": STYLES.get(line.kind, "-")}
        look |= {"marker": "o" if line.kind in ("body", "link") else "", "color": colour}
        look |= {"solid_capstyle": "round", "label": label if i == 0 else None}
        made += axes.plot(*(line.xy[k] * 1e3).T, **look)
    return made


def mark_points(axes: Axes, motion: Motion, box: Any) -> None:
    """Mark and name the points at the first position, those within a box [m] where there is one."""
    known = points(motion)
    named = {}
    for name in dict.fromkeys(joint_points(motion).values()):
        x, y = known[name][0]
        if box is not None and not (box[0] < x < box[1] and box[2] < y < box[3]):
            continue
        ground = name.startswith("ground.")
        axes.plot(x * 1e3, y * 1e3, "^" if ground else "o", color="k", ms=5 if ground else 3)
        named[name.partition(".")[2] if ground else name] = np.array([x, y]) * 1e3
    name_points(axes, named, [line.xy[0] * 1e3 for line in lines(motion)])


@style.styled()
def kinematics_figure(result: Analysis) -> Figure:
    """Angles of bodies and rods over the driver, their rates and accelerations."""
    motion, travel = result.motion, quantity("travel", result.definition)
    courses = links(motion)
    labels = ["rate (°/driver)", "second derivative"]
    if (timed := result.timed) is not None:
        motion, courses = timed.motion, timed.in_time(links(timed.motion))
        labels = ["rate (°/s)", "acceleration (°/s²)"]
    turned = {n: replace(c, value=c.value - c.value[0]) for n, c in courses.items()}
    words = ["angle since start (°)", *labels]
    figure, rows = three_rows(motion.s * travel.scale, turned, float(np.degrees(1.0)), words)
    rows[2].set_xlabel(label_of("travel", result, "driver"))
    for axes in rows:
        mark_zone(axes, result, "travel")
    return figure


@style.styled()
def actuators_figure(result: Analysis) -> Figure:
    """Lengths of the actuators, their speeds and accelerations; in time where there is a law."""
    courses, over = actuators(result.motion), values_of("travel", result)
    labels = ["length (mm)", "rate (mm/driver)", "second derivative"]
    if (timed := result.timed) is not None:
        courses, over = timed.in_time(actuators(timed.motion)), timed.time
        labels = ["length (mm)", "speed (mm/s)", "acceleration (mm/s²)"]
    figure, rows = three_rows(over, courses, 1e3, labels)
    rows[2].set_xlabel("time (s)" if timed is not None else label_of("travel", result, "driver"))
    return figure


@style.styled()
def path_figure(result: Analysis) -> Figure:
    """Path of the output, with the zone."""
    figure, axes = style.single(4.6, 5.2)
    axes.plot(values_of("x", result), values_of("height", result), color=MAIN)
    for name, values in result.zone.items():
        point = (values["x"] * 1e3, values["height"] * 1e3)
        axes.plot(*point, "o", color="k", ms=4)
        axes.annotate(name, point, (6, -3), "data", "offset points", fontsize=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x since start (mm)", ylabel="height over start (mm)")
    return figure


@style.styled()
def angles_figure(result: Analysis) -> Figure:
    """Transmission angles, folded, with their limit, and pressure angles of cams."""
    figure, axes = style.single(7.0, 3.6)
    lines = [(np.degrees(folded(result.output[n])), n) for n in result.definition.angles]
    cams = (n for n in result.output if n.endswith("_pressure_angle"))
    lines += [(values_of(name, result), name.replace("_", " ")) for name in cams]
    curves(axes, result, "travel", lines, "angle (°)")
    limits = result.definition.optimise
    if limits is not None and limits.min_transmission_angle is not None:
        limit = np.degrees(result.model.number(limits.min_transmission_angle))
        axes.axhline(limit, color=style.LIMIT, lw=0.9)
        look: Any = {"frame": style.BESIDE, "fontsize": 8, "color": style.LIMIT}
        limited = [name for name, angle in result.definition.angles.items() if angle.limited]
        words = unformatted(f"limit of {', '.join(limited)}")
        style.note(axes, words, (1.0, limit), (0, 0), "right", "bottom", **look)
    return figure


@style.styled()
def cam_figure(result: Analysis) -> Figure:
    """Rates on every arc of the cam: of a rocker, or of a roller that slides or rests."""
    motion = result.motion
    name, row = next(iter(cam_rows(motion).items()))
    cam = result.definition.joints[name]
    assert isinstance(cam, Cam)
    body = result.model.linkage.point_body[result.model.points[cam.cam]]
    first = int(result.model.linkage.joint[row, 4])
    scale = quantity("travel", result.definition).scale
    beyond = 0.12 * abs(result.travel)
    figure, axes = style.single(7.0, 3.6)
    travel = values_of("travel", result)
    turning = np.abs(motion.q1[:, body, 2])
    rocks = bool(np.min(turning) > 1e-6 * np.max(turning))
    angular = result.definition.driver.angle is not None
    words = f"rate of '{cam.cam}' over the driver's (mm/{'rad' if angular else 'm'})"
    if rocks:
        roller = cam.cam.partition(".")[0]
        words = f"rate of the driver over that of '{roller}'{'' if angular else ' (m/rad)'}"

    def rate(at: Motion) -> Any:
        speed = np.linalg.norm(at.point(cam.cam)[1], axis=-1)
        return np.abs(1.0 / at.q1[:, body, 2]) if rocks else 1e3 * speed

    for i, arc in enumerate(np.unique(motion.arcs[:, row])):
        on = motion.arcs[:, row] == arc
        label = f"arc {arc - first + 1}, turns {cam.arcs[arc - first].turns}"
        axes.plot(travel[on], rate(motion)[on], label=label, lw=2.2, **line_style(i))
        if (alone := on_one_arc(motion, row, int(arc), beyond)) is not None:
            axes.plot(alone.s * scale, rate(alone), color="0.45", lw=0.8, ls=DASHES[i], zorder=1)
    for change in result.transitions:
        at = change.travel * scale
        axes.axvline(at, color="0.4", lw=0.8)
        value = f"{at:.2f}°" if angular else f"{at:.2f} mm"
        style.note(axes, value, (at, 1.0), (3, -10), frame=style.ABOVE, fontsize=8, color="k")
    mark_zone(axes, result, "travel")
    axes.set(xlabel=label_of("travel", result, "driver"), ylabel=words)
    axes.legend()
    return figure


@style.styled()
def force_figure(result: Analysis) -> Figure:
    """Ratios and force of the actuator over its length and over the height, or over the driver."""
    over = [name for name in ("length", travel_name(result)) if name in result.output] or ["travel"]
    rows = {
        "ratio": [("ratio", "along y"), ("ratio_x", "along x")],
        "force": [("force", "on the way"), ("force_back", "on the way back")],
    }
    words = {"ratio": "ratio dy/dL, dx/dL", "force": "force of the unknown"}
    shown = [name for name in rows if name in result.output]
    figure = style.Picture(7.8, 5.4)
    grid = figure.subplots(len(shown), len(over), sharex="col", sharey="row", squeeze=False)
    for name, row in zip(shown, grid, strict=True):
        lines = [(values_of(n, result), label) for n, label in rows[name] if n in result.output]
        for axes, x in zip(row, over, strict=True):
            curves(axes, result, x, lines, label_of(name, result, words[name]))
            axes.label_outer()
            if axes is not row[0] or len(lines) == 1:
                axes.get_legend().remove()
    return figure


@style.styled()
def pressure_figure(result: Analysis) -> Figure:
    """Pressure that the mechanism needs, over the height, without an output over the length."""
    figure, axes = style.single(6.4, 3.4)
    names = (("pressure", "needed"), ("pressure_back", "needed on the way back"))
    lines = [(values_of(n, result), label) for n, label in names if n in result.output]
    if result.contact is not None:
        lines.append((np.full(len(lines[0][0]), result.contact.pressure / 1e6), "held"))
    over = "length" if result.definition.output is None else travel_name(result)
    curves(axes, result, over, lines, "pressure (MPa)")
    axes.set_ylim(bottom=0.0)
    return figure


@style.styled()
def contact_figure(result: Analysis) -> Figure:
    """Static contact force at constant pressure, over the height."""
    contact = result.contact
    assert contact is not None
    figure, axes = style.single(6.4, 3.4)
    lines = [(contact.curve, f"at {contact.pressure / 1e6:.4f} MPa")]
    if contact.rising != contact.falling:
        lines += zip(contact.bounds, ("rising", "falling"), strict=True)
    curves(axes, result, travel_name(result), lines, "static contact force (N)")
    axes.axhline(0.0, color="0.4", lw=0.8)
    for y, stable in contact.equilibria:
        axes.plot(y * 1e3, 0.0, "o", mfc="k" if stable else "w", color="k", ms=6, clip_on=False)
    return figure


@style.styled()
def carpet_figure(result: Analysis) -> Figure:
    """Carpet of the air spring: force over height and pressure, with the mechanism's load."""
    spring = result.definition.held_by
    assert isinstance(spring, AirSpring)
    table = table_of(result.motion, spring)
    figure, axes = style.single(6.6, 4.2)
    heights = table.heights * 1e3
    for i, pressure in enumerate(table.pressures):
        axes.plot(heights, table.forces[:, i] / 1e3, color="0.55", lw=0.9, marker=".", ms=3)
        point, value = (heights[0], table.forces[0, i] / 1e3), f"{pressure / 1e6:g} MPa"
        style.note(axes, value, point, (-4, 0), "right", "center", fontsize=8, color="k")
    length = values_of("length", result)
    axes.plot(length, result.output["force"] / 1e3, color=MAIN, lw=2.2, label="load")
    if result.zone:
        mark_zone(axes, result, "length")
    axes.set_xlim(left=heights[0] - 0.14 * (heights[-1] - heights[0]))
    axes.set(xlabel="height of the air spring (mm)", ylabel="force (kN)")
    axes.legend()
    return figure


@style.styled()
def gas_spring_figure(result: Analysis) -> Figure:
    """Length and force of the gas springs over the driver."""
    names = [n.removesuffix("_length") for n in result.output if n.endswith("_length")]
    figure = style.Picture(7.2, 3.4)
    kinds = (("length", "length (mm)"), ("force", "push (N)"))
    for axes, (kind, words) in zip(figure.subplots(1, 2), kinds, strict=True):
        lines = [(values_of(f"{name}_{kind}", result), name) for name in names]
        curves(axes, result, "travel", lines, words)
    return figure


@style.styled()
def time_figure(result: Analysis) -> Figure:
    """Motion in time: driver, output's speed and acceleration, driving force."""
    timed = result.timed
    assert timed is not None
    figure = style.Picture(7.6, 5.6)
    (a, b), (c, d) = figure.subplots(2, 2, sharex=True)
    a.plot(timed.time, timed.motion.s * quantity("travel", result.definition).scale, color=MAIN)
    a.set_ylabel(label_of("travel", result, "driver"))
    name = driving_actuator(result.definition)
    unit = force_unit(name, result.definition)
    b.plot(timed.time, timed.force, color=MAIN)
    b.set_ylabel(f"{'torque' if unit == 'N m' else 'force'} of '{name}' ({unit})")
    if result.definition.output is not None:
        for axes, values in zip((c, d), timed.point(result.definition.output.point), strict=True):
            absolute = np.hypot(values[:, 0], values[:, 1])
            lines = zip((*values.T, absolute), ("x", "y", "absolute"), strict=True)
            for i, (line, label) in enumerate(lines):
                axes.plot(timed.time, line * 1e3, label=label, **line_style(i))
        c.legend()
    c.set(xlabel="time (s)", ylabel="speed of the output (mm/s)")
    d.set(xlabel="time (s)", ylabel="acceleration (mm/s²)")
    return figure


@style.styled()
def cases_figure(results: Mapping[str, Analysis]) -> Figure:
    """Unknown force over the driver, for all cases of a mechanism."""
    figure, axes = style.single(6.6, 3.6)
    first = next(iter(results.values()))
    for i, (name, result) in enumerate(results.items()):
        travel, force = values_of("travel", result), values_of("force", result)
        axes.plot(travel, force, label=name, **line_style(i))
    axes.axhline(0.0, color="0.4", lw=0.8)
    axes.set(xlabel=label_of("travel", first, "driver"))
    axes.set(ylabel=label_of("force", first, f"force of '{first.definition.unknown}'"))
    axes.legend()
    return figure


@style.styled()
def comparison_figure(results: Mapping[str, Analysis], *, zoom: bool = False) -> Figure:
    """Ratio and force of several mechanisms over the height.

    With `zoom`, in the zone only, and below it what they are above the first one.
    """
    first = next(iter(results.values()))
    figure = style.Picture(7.6, 6.4 if zoom else 3.8)
    panels = figure.subplots(2 if zoom else 1, 2, sharex=True, squeeze=False)
    for column, name in enumerate(("ratio", "force")):
        base = _over_height(first, name, zoom)
        for i, (label, result) in enumerate(results.items()):
            if (curve := _over_height(result, name, zoom)) is None:
                continue
            panels[0, column].plot(*curve, label=label, **line_style(i))
            if zoom and base is not None:
                above = curve[1] - np.interp(curve[0], *base)
                panels[1, column].plot(curve[0], above, **line_style(i))
        if not zoom:
            mark_zone(panels[0, column], first, travel_name(first))
        panels[-1, column].set_xlabel(label_of(travel_name(first), first))
    panels[0, 0].set_ylabel("ratio dy/dL")
    unit = force_units(one.definition for one in results.values())
    panels[0, 1].set_ylabel(f"force ({unit})")
    if zoom:
        panels[1, 0].set_ylabel("ratio minus the first's")
        panels[1, 1].set_ylabel(f"force minus the first's ({unit})")
    panels[0, 0].legend(fontsize=7.5)
    return figure


@style.styled()
def held_figure(results: Mapping[str, Analysis]) -> Figure:
    """Pressures that several mechanisms need, and their contact forces at the held pressures."""
    figure = style.Picture(7.6, 3.8)
    left, right = figure.subplots(1, 2)
    for i, (label, result) in enumerate(results.items()):
        if "pressure" not in result.output or "height" not in result.output:
            continue
        height = values_of(travel_name(result), result)
        left.plot(height, values_of("pressure", result), label=label, **line_style(i))
        if result.contact is not None:
            held = f"{label}, {result.contact.pressure / 1e6:.4f} MPa"
            right.plot(height, result.contact.curve, label=held, **line_style(i))
    right.axhline(0.0, color="0.4", lw=0.8)
    first = next(iter(results.values()))
    for axes, text in ((left, "pressure needed (MPa)"), (right, "static contact force (N)")):
        mark_zone(axes, first, travel_name(first))
        axes.set(xlabel=label_of(travel_name(first), first), ylabel=text)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=7.5)
    left.set_ylim(bottom=0.0)
    return figure


def _over_height(result: Analysis, name: str, zoom: bool) -> tuple[Floats, Floats] | None:
    """A result over the height, with `zoom` in the zone only; None where there is none."""
    if name not in result.output or "height" not in result.output:
        return None
    x, y = values_of(travel_name(result), result), values_of(name, result)
    if zoom and result.zone:
        low, high = (result.zone[k][travel_name(result)] * 1e3 for k in ("low", "high"))
        inside = (x >= low) & (x <= high)
        x, y = x[inside], y[inside]
    return x, y


@style.styled()
def search_figure(optimum: "Optimum") -> Figure:
    """Objective at the end of every start, feasible or not, and the best."""
    figure, axes = style.single(6.4, 3.6)
    starts = [s for s in optimum.starts if np.isfinite(s.objective) and s.objective > 0.0]
    top = max((s.objective for s in starts), default=1.0)
    lost = [replace(s, objective=top) for s in optimum.starts if not np.isfinite(s.objective)]
    for shown, marker, fill, label in (
        ([s for s in starts if s.feasible], "o", "k", "all constraints kept"),
        ([s for s in starts if not s.feasible], "x", "k", "a constraint broken"),
        (lost, "s", "w", "not assembled"),
    ):
        if shown:
            ends = zip(*((s.number, s.objective) for s in shown), strict=True)
            axes.plot(*ends, marker, mfc=fill, color="0.3", ms=5, label=label)
    if optimum.objective > 0.0:
        axes.axhline(optimum.objective, color=MAIN, label=f"best {optimum.objective:.4g}")
    if optimum.objective_before > 0.0:
        before = f"file {optimum.objective_before:.4g}"
        axes.axhline(optimum.objective_before, color=SECOND, ls=DASHES[1], label=before)
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="start", ylabel="objective")
    axes.legend()
    return figure
