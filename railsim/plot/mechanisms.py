"""Pictures of a mechanism: drawing, kinematics, ratios, forces, pressures, motion.

Every function takes results of `railsim.mechanisms` and returns a figure in the field's habits: mm,
degrees, N, MPa.  Lines can be distinguished without colour too.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from railsim.definitions.mechanism.parts import AirSpring, Cam
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.cams import cam_rows, on_one_arc, roller_body
from railsim.mechanisms.drawing import Line, centres, joint_points, lines, points, working_box
from railsim.mechanisms.dynamics import driving
from railsim.mechanisms.forces import table_of
from railsim.mechanisms.kinematics import Motion, folded, solve
from railsim.mechanisms.links import actuators, links
from railsim.mechanisms.quantities import force_unit, quantity
from railsim.plot.mechanism_axes import (
    DASHES,
    MAIN,
    curves,
    label_of,
    line_style,
    mark_zone,
    single,
    three_rows,
    values_of,
    way,
)
from railsim.plot.mechanism_comparison import (
    cases_figure,
    comparison_figure,
    held_figure,
    search_figure,
)
from railsim.plot.point_names import name_points
from railsim.plot.style import ABOVE, LIMIT, Picture, note

# drawn beside this module, offered here
__all__ = ["cases_figure", "comparison_figure", "held_figure", "search_figure"]

SHADES = ("0.72", "0.55", "0.35", "#004a80")
WIDTHS = {"body": 2.2, "link": 1.3, "guide": 0.8, "cam": 1.8}
WIDTHS |= {"actuator": 3.2, "spring": 1.0, "damper": 1.6}
CENTRE: dict[str, Any] = {"marker": "$\\oplus$", "color": "k", "ms": 8, "ls": "", "zorder": 5}
"""Centre of gravity."""
STYLES = {"guide": (0, (1, 1.5)), "damper": (0, (3, 1.5))}


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
        figure = Picture(6.6, 7.4)
        axes = figure.subplots(2, 1, height_ratios=[1.5, 1.0])
    elif small:
        figure = Picture(9.0, 4.6)
        axes = figure.subplots(1, 2, width_ratios=[1.0, 1.25])
    else:
        figure = Picture(6.6, 5.2)
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
        axes[0].plot(*(xy[0] * 1e3), **CENTRE)
        if named is not axes[0]:
            named.plot(*(xy[0] * 1e3), **CENTRE)
    axes[0].legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), title="driver at")
    if small:
        mark_points(named, motion, box)
    else:
        named.margins(0.12)
        mark_points(named, motion, None)
    return figure


def draw(axes: Axes, drawn: Sequence[Line], k: int, colour: str, label: str) -> list[Line2D]:
    """Draw the lines of a mechanism at one of its positions [mm]."""
    made = []
    for i, line in enumerate(drawn):
        look: Any = {"color": colour, "lw": WIDTHS[line.kind], "ls": STYLES.get(line.kind, "-")}
        look |= {"marker": "o" if line.kind in ("body", "link") else "", "ms": 2.5}
        named = label if i == 0 else None
        made += axes.plot(*(line.xy[k] * 1e3).T, solid_capstyle="round", label=named, **look)
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


def path_figure(result: Analysis) -> Figure:
    """Path of the output, with the zone."""
    figure, axes = single(4.6, 5.2)
    axes.plot(values_of("x", result), values_of("height", result), color=MAIN)
    for name, values in result.zone.items():
        point = (values["x"] * 1e3, values["height"] * 1e3)
        axes.plot(*point, "o", color="k", ms=4)
        axes.annotate(name, point, (6, -3), "data", "offset points", fontsize=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x since start (mm)", ylabel="height over start (mm)")
    return figure


def angles_figure(result: Analysis) -> Figure:
    """Transmission angles, folded, with their limit, and pressure angles of cams."""
    figure, axes = single(7.0, 3.6)
    lines = [(np.degrees(folded(result.output[n])), n) for n in result.definition.angles]
    cams = (n for n in result.output if n.endswith("_pressure_angle"))
    lines += [(values_of(name, result), name.replace("_", " ")) for name in cams]
    curves(axes, result, "travel", lines, "angle (°)")
    limits = result.definition.optimise
    if limits is not None and limits.min_transmission_angle is not None:
        limit = np.degrees(result.model.number(limits.min_transmission_angle))
        axes.axhline(limit, color=LIMIT, lw=0.9)
        look: Any = {"fontsize": 8, "color": LIMIT, "frame": ("axes fraction", "data")}
        note(axes, "limit", (1.0, limit), (0, 0), "right", "bottom", **look)
    return figure


def cam_figure(result: Analysis) -> Figure:
    """Rate of the rocker on every arc of the cam, with the transitions."""
    motion = result.motion
    name, row = next(iter(cam_rows(motion).items()))
    cam = result.definition.joints[name]
    assert isinstance(cam, Cam)
    body = roller_body(motion, name)
    first = int(result.model.linkage.joint[row, 4])
    scale = quantity("travel", result.definition).scale
    beyond = 0.12 * abs(result.travel)
    figure, axes = single(7.0, 3.6)
    travel = values_of("travel", result)
    rate = motion.q1[:, body, 2]
    roller = cam.cam.partition(".")[0]
    unit = "" if result.definition.driver.angle is not None else " (m/rad)"
    words = f"rate of the driver over that of '{roller}'{unit}"
    for i, arc in enumerate(np.unique(motion.arcs[:, row])):
        on = motion.arcs[:, row] == arc
        label = f"arc {arc - first + 1}, turns {cam.arcs[arc - first].turns}"
        axes.plot(travel[on], np.abs(1.0 / rate[on]), label=label, lw=2.2, **line_style(i))
        if (alone := on_one_arc(motion, row, int(arc), beyond)) is not None:
            more = np.abs(1.0 / alone.q1[:, body, 2])
            axes.plot(alone.s * scale, more, color="0.45", lw=0.8, ls=DASHES[i], zorder=1)
    for change in result.transitions:
        at = change.travel * scale
        axes.axvline(at, color="0.4", lw=0.8)
        value = f"{at:.2f}°" if scale > 1e2 or not unit else f"{at:.2f} mm"
        note(axes, value, (at, 1.0), (3, -10), frame=ABOVE, fontsize=8, color="k")
    mark_zone(axes, result, "travel")
    axes.set(xlabel=label_of("travel", result, "driver"), ylabel=words)
    axes.legend()
    return figure


def force_figure(result: Analysis) -> Figure:
    """Ratios and force of the actuator over its length and over the height."""
    over = [name for name in ("length", way(result)) if name in result.output]
    rows = {
        "ratio": [("ratio", "along y"), ("ratio_x", "along x")],
        "force": [("force", "on the way"), ("force_back", "on the way back")],
    }
    words = {"ratio": "ratio dy/dL, dx/dL", "force": "force of the unknown"}
    shown = [name for name in rows if name in result.output]
    figure = Picture(7.8, 5.4)
    grid = figure.subplots(len(shown), len(over), sharex="col", sharey="row", squeeze=False)
    for name, row in zip(shown, grid, strict=True):
        lines = [(values_of(n, result), label) for n, label in rows[name] if n in result.output]
        for axes, x in zip(row, over, strict=True):
            curves(axes, result, x, lines, label_of(name, result, words[name]))
            axes.label_outer()
            if axes is not row[0] or len(lines) == 1:
                axes.get_legend().remove()
    return figure


def pressure_figure(result: Analysis) -> Figure:
    """Pressure that the mechanism needs, over the height."""
    figure, axes = single(6.4, 3.4)
    names = (("pressure", "needed"), ("pressure_back", "needed on the way back"))
    lines = [(values_of(n, result), label) for n, label in names if n in result.output]
    if result.contact is not None:
        lines.append((np.full(len(lines[0][0]), result.contact.pressure / 1e6), "held"))
    curves(axes, result, way(result), lines, "pressure (MPa)")
    axes.set_ylim(bottom=0.0)
    return figure


def contact_figure(result: Analysis) -> Figure:
    """Static contact force at constant pressure, over the height."""
    contact = result.contact
    assert contact is not None
    figure, axes = single(6.4, 3.4)
    lines = [(contact.curve, f"at {contact.pressure / 1e6:.4f} MPa")]
    if contact.rising != contact.falling:
        lines += zip(contact.bounds, ("rising", "falling"), strict=True)
    curves(axes, result, way(result), lines, "static contact force (N)")
    axes.axhline(0.0, color="0.4", lw=0.8)
    for y, stable in contact.equilibria:
        axes.plot(y * 1e3, 0.0, "o", mfc="k" if stable else "w", color="k", ms=6, clip_on=False)
    return figure


def carpet_figure(result: Analysis) -> Figure:
    """Carpet of the air spring: force over height and pressure, with the mechanism's load."""
    assert result.definition.solve is not None
    spring = result.definition.actuators[result.definition.solve.unknown]
    assert isinstance(spring, AirSpring)
    table = table_of(result.motion, spring)
    figure, axes = single(6.6, 4.2)
    heights = table.heights * 1e3
    for i, pressure in enumerate(table.pressures):
        axes.plot(heights, table.forces[:, i] / 1e3, color="0.55", lw=0.9, marker=".", ms=3)
        point, value = (heights[0], table.forces[0, i] / 1e3), f"{pressure / 1e6:g} MPa"
        note(axes, value, point, (-4, 0), "right", "center", fontsize=8, color="k")
    length = values_of("length", result)
    axes.plot(length, result.output["force"] / 1e3, color=MAIN, lw=2.2, label="load")
    if result.zone:
        mark_zone(axes, result, "length")
    axes.set_xlim(left=heights[0] - 0.14 * (heights[-1] - heights[0]))
    axes.set(xlabel="height of the air spring (mm)", ylabel="force (kN)")
    axes.legend()
    return figure


def gas_spring_figure(result: Analysis) -> Figure:
    """Length and force of the gas springs over the driver."""
    names = [n.removesuffix("_length") for n in result.output if n.endswith("_length")]
    figure = Picture(7.2, 3.4)
    for axes, kind, words in zip(
        figure.subplots(1, 2), ("length", "force"), ("length (mm)", "push (N)"), strict=True
    ):
        lines = [(values_of(f"{name}_{kind}", result), name) for name in names]
        curves(axes, result, "travel", lines, words)
    return figure


def time_figure(result: Analysis) -> Figure:
    """Motion in time: driver, output's speed and acceleration, driving force."""
    timed = result.timed
    assert timed is not None
    figure = Picture(7.6, 5.6)
    (a, b), (c, d) = figure.subplots(2, 2, sharex=True)
    a.plot(timed.time, timed.motion.s * quantity("travel", result.definition).scale, color=MAIN)
    a.set_ylabel(label_of("travel", result, "driver"))
    name = driving(result.definition)
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
