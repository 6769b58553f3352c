"""Pictures of a trailing-arm suspension: stiffness, deflection, coils, Goodman-Smith, the arm.

Every function takes results of `railsim.springs` and returns a figure in the field's habits: kN,
mm, N/mm, MPa, degrees.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from railsim.arrays import Floats
from railsim.definitions.spring import TrailingArmSuspension
from railsim.plot.style import ABOVE, DISTINCT, LIMIT, Picture, note, single, styled
from railsim.springs import arm as trailing_arm
from railsim.springs import checks
from railsim.springs.arm import Arm
from railsim.springs.design import Design
from railsim.springs.summary import coils_by_wire
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Case, Fatigue, Verification, solid_heights, wire_and_coils
from railsim.text import unformatted

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult


MAIN, SECOND, FAINT = DISTINCT[0], DISTINCT[1], "0.75"
NAMES: Any = {"fontsize": 7.5, "color": "0.25"}
SCALES = {"load": 1e-3, "K_sys": 1e-3, "deflection": 1e3, "rotation": float(np.degrees(1.0))}
SPRING_COLOURS = {"outer": DISTINCT[0], "inner": DISTINCT[1]}


@styled()
def stiffness_figure(result: Verification) -> Figure:
    """System stiffness, and the rate that small movements feel, over load and deflection."""
    figure = Picture(7.6, 3.2, edges=(0.085, 0.15, 0.985, 0.97, 0.06))
    over_load, over_deflection = figure.subplots(1, 2, sharey=True)
    curve = _curve(result)
    for axes, name, label in (
        (over_load, "load", "load $P$ (kN)"),
        (over_deflection, "deflection", "deflection $\\Delta z$ (mm)"),
    ):
        x = curve[name] * SCALES[name]
        axes.plot(x, curve["K_sys"] * 1e-3, color=MAIN, label="system stiffness $P/\\Delta z$")
        axes.plot(x, curve["rate"] * 1e-3, color=SECOND, ls="--", label="tangent stiffness")
        _mark(axes, result, name, "K_sys")
        axes.set_xlabel(label)
    over_load.set_ylabel("stiffness (N/mm)")
    over_load.set_ylim(bottom=0.0)
    over_load.legend(loc="lower right")
    return figure


@styled()
def deflection_figure(suspension: TrailingArmSuspension, result: Verification) -> Figure:
    """Deflection, rotation of the arm and heights of the springs over the load."""
    figure = Picture(7.6, 5.4, edges=(0.085, 0.09, 0.985, 0.98, 0.2, 0.38))
    deflection, rotation, heights = figure.subplot_mosaic("dr;hh").values()
    curve = _curve(result)
    load = curve["load"] * 1e-3
    for axes, name in ((deflection, "deflection"), (rotation, "rotation")):
        axes.plot(load, curve[name] * SCALES[name], color=MAIN)
        _mark(axes, result, "load", name)
    deflection.set_ylabel("deflection $\\Delta z$ (mm)")
    rotation.axhline(0.0, color=FAINT, lw=0.8, zorder=1)
    rotation.set_ylabel("rotation of the arm (°)")
    solid = solid_heights(suspension)
    for i, name in enumerate(suspension.springs):
        colour = SPRING_COLOURS[name]
        dashes = (0, (5, 3)) if i else "-"
        heights.plot(load, curve[f"height_{name}"] * 1e3, color=colour, ls=dashes, label=name)
        heights.axhline(solid[name] * 1e3, color=colour, lw=0.9, ls=":")
    heights.plot([], [], color="0.4", lw=0.9, ls=":", label="solid height")
    for case in result.cases:
        heights.axvline(case.load * 1e-3, color=FAINT, lw=0.7, zorder=0)
        at = (case.load * 1e-3, 1.0)
        note(heights, unformatted(case.name), at, (0, 2), "center", frame=ABOVE, **NAMES)
    heights.set_ylabel("height under load (mm)")
    heights.legend(ncols=3, loc="upper right")
    for axes in (deflection, rotation, heights):
        axes.set_xlabel("load $P$ (kN)")
    return figure


@styled()
def coils_figure(suspension: TrailingArmSuspension, result: Design) -> Figure:
    """Active coils that give the designed stiffness, over the wire diameter."""
    figure, axes = single(5.6, 3.7, edges=(0.1, 0.13, 0.98, 0.85))
    listed = coils_by_wire(suspension, result)
    for (name, spring), K_V in zip(suspension.springs.items(), result.K_V, strict=True):
        colour = SPRING_COLOURS[name]
        rows = [row for row in listed[name] if row["active_coils"] < 12.0]
        if rows:
            wires = np.array([row["wire_diameter"] for row in rows])
            d = np.linspace(0.95 * wires[0], 1.05 * wires[-1], 200)
            n = suspension.material.G * d**4 / (8.0 * K_V * spring.mean_diameter**3)
            label = f"{name}, $D$ {spring.mean_diameter * 1e3:.6g} mm, {K_V * 1e-3:.1f} N/mm"
            axes.plot(d * 1e3, n, color=colour, label=label)
            axes.plot(1e3 * wires, [row["active_coils"] for row in rows], ".", color=colour, ms=5)
        if spring.wire_diameter is not None and spring.active_coils is not None:
            wire = spring.wire_diameter * 1e3
            axes.plot(wire, spring.active_coils, "o", mfc="w", mec=colour, ms=8)
    axes.plot([], [], "o", mfc="w", mec="0.3", ms=8, label="built")
    axes.axhline(3.0, color=LIMIT, lw=0.9, ls=":", label="3 coils (EN 13906-1, hot coiled)")
    axes.set(xlabel="wire diameter $d$ (mm)", ylabel="active coils $n$", ylim=(0.0, 12.5))
    figure.legend(loc="upper left", ncols=2, fontsize=8, borderaxespad=0.2)
    return figure


@styled()
def goodman_figure(suspension: TrailingArmSuspension, result: Mapping[str, Fatigue]) -> Figure:
    """Goodman-Smith diagram with the stress range of each spring."""
    if suspension.fatigue is None:
        raise ValueError("the suspension has no fatigue table")
    line = np.array(suspension.fatigue.goodman) * 1e-6
    figure, axes = single(4.8, 4.9, edges=(0.13, 0.1, 0.97, 0.98))
    end = float(line[-1, 1])
    axes.plot([0.0, end], [0.0, end], color="0.35", lw=1.0)
    axes.plot(*line.T, color=LIMIT, lw=1.6, label="Goodman-Smith line")
    for name, spring in result.items():
        low, high = spring.tau_min * 1e-6, spring.tau_max * 1e-6
        colour = SPRING_COLOURS[name]
        axes.plot([low, low], [low, high], color=colour, lw=2.2, solid_capstyle="butt")
        axes.plot([low, low], [high, spring.limit * 1e-6], color=colour, lw=1.0, ls=":")
        axes.plot(low, high, "o", color=colour, ms=6, label=f"{name}, margin {spring.margin:.2f}")
        axes.plot(low, low, "o", mfc="w", mec=colour, ms=5)
    axes.set(xlabel="lower stress $\\tau_{min}$ (MPa)", ylabel="stress $\\tau$ (MPa)")
    axes.set(xlim=(0.0, 1.05 * end), ylim=(0.0, 1.12 * end), aspect="equal")
    axes.legend(loc="lower right")
    return figure


@styled()
def arm_figure(suspension: TrailingArmSuspension, result: Verification) -> Figure:
    """The arm and its springs in every load case, to scale, from the lightest load on."""
    cases = sorted(result.cases, key=lambda case: case.load)
    columns = min(len(cases), 3)
    rows = -(-len(cases) // columns)
    arm = result.arm
    tops = [1e3 * float(coil.seat + coil.H0 - coil.start) for coil in arm.coils]
    half_spring = 0.62e3 * suspension.outer.mean_diameter
    # one pair of axes for all cases, each at its own origin: far quicker than many axes
    wide = 1e3 * arm.length + half_spring + 170.0
    high = max(tops) + 420.0
    figure = Picture(2.55 * columns, 2.55 * rows * high / wide, layout=None)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    for i, case in enumerate(cases):
        origin = np.array([(i % columns) * wide, -(i // columns) * high])
        _draw_arm(axes, suspension, arm, case, origin, max(tops))
    axes.set(xlim=(-90.0, columns * wide - 90.0))
    axes.set(ylim=(max(tops) + 150.0 - rows * high, max(tops) + 150.0), aspect="equal")
    axes.set_axis_off()
    return figure


@styled()
def search_figure(result: "SearchResult") -> Figure:
    """Mass and fatigue margin of the feasible candidates and of the ranked nests."""
    figure, axes = single(5.6, 3.6, edges=(0.11, 0.13, 0.98, 0.97))
    cloud = result.cloud[np.all(np.isfinite(result.cloud), axis=1)]
    axes.plot(*cloud.T, ".", color=FAINT, ms=4, label="feasible candidates", zorder=1)
    mass = [nest.mass for nest in result.nests]
    margin = [nest.fatigue_margin for nest in result.nests]
    axes.plot(mass, margin, "o", color=MAIN, ms=5, label="ranked nests, as built", zorder=2)
    for rank, point in enumerate(zip(mass, margin, strict=True), start=1):
        where = ((0, 4), "center", "bottom") if rank % 2 else ((0, -4), "center", "top")
        note(axes, str(rank), point, *where, fontsize=8, color=MAIN)
    axes.set(xlabel="mass of the nest (kg)", ylabel="fatigue margin")
    axes.legend(loc="best")
    return figure


@styled()
def ride_height_figure(results: Sequence[RideHeight], tare: str | None = None) -> Figure:
    """Ride height by single deviation under one load, and its range under every load."""
    figure = Picture(7.6, 3.5, edges=(0.235, 0.19, 0.985, 0.97, 0.22))
    single, every = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
    shown = next((result for result in results if result.name == tare), results[0])
    ends = sorted(shown.single.items(), key=lambda item: abs(item[1][1] - item[1][0]))
    names = [name.replace("_", " ").replace(".", ": ") for name, _ in ends]
    lows, highs = 1e3 * np.array([end for _, end in ends]).reshape(-1, 2).T
    rows = np.arange(len(ends))
    single.barh(rows, lows, color=DISTINCT[4], height=0.6, label="lower limit")
    single.barh(rows, highs, color=DISTINCT[0], height=0.6, label="upper limit")
    single.set_yticks(rows, names)
    single.set_ylim(-0.6, max(len(rows), 4) - 0.4)
    single.grid(axis="y", visible=False)
    single.axvline(0.0, color="0.35", lw=0.8)
    single.set_xlabel(f"change of the ride height at {unformatted(shown.name)} (mm)")
    single.legend(loc="lower right", fontsize=7.5)
    ordered = sorted(results, key=lambda result: result.load)
    columns = np.arange(len(ordered))
    for column, result in zip(columns, ordered, strict=True):
        worst, likely = (result.lowest, result.highest), (-result.random, result.random)
        for pair, colour in ((worst, FAINT), (likely, MAIN)):
            every.plot(
                [column] * 2, 1e3 * np.array(pair), color=colour, lw=7, solid_capstyle="butt"
            )
    every.plot([], [], color=FAINT, lw=5, label="worst case")
    every.plot([], [], color=MAIN, lw=5, label="statistical (RSS)")
    names = [unformatted(result.name) for result in ordered]
    every.set_xticks(columns, names, rotation=30, ha="right")
    every.set_xlim(-0.6, len(ordered) - 0.4)
    every.axhline(0.0, color="0.35", lw=0.8)
    every.set_ylabel("ride height (mm)")
    top = max(result.highest for result in ordered) * 1e3
    every.set_ylim(top=1.45 * top)
    every.legend(loc="upper right", fontsize=7.5)
    return figure


def _curve(result: Verification) -> dict[str, Floats]:
    """All quantities over a range of rotations somewhat wider than that of the cases."""
    turned = [case.rotation for case in result.cases]
    wider = max(0.08 * (max(turned) - min(turned)), np.radians(0.5))
    highest, first = float(trailing_arm.rotation_range(result.arm)[1]), result.arm.coils[0]
    # no nearer to lift-off, where a load over its deflection has no meaning, than half way
    rise = 0.5 * min(case.deflection for case in result.cases) - first.start
    lowest = float(trailing_arm.rotation_of_rise(result.arm.length, first.seat, rise))
    phi = np.linspace(max(min(turned) - wider, lowest), min(max(turned) + wider, highest), 201)
    load = trailing_arm.load(result.arm, phi)
    states = [trailing_arm.coil_state(result.arm, coil, phi) for coil in result.arm.coils]
    rise = result.arm.length * np.sin(phi)
    return {
        "rotation": phi, "load": load, "deflection": states[0].deflection,
        "K_sys": load / states[0].deflection, "rate": np.gradient(load, rise, edge_order=2),
        **{f"height_{n}": s.height for n, s in zip(("outer", "inner"), states, strict=False)},
    }  # fmt: skip


def _mark(axes: Axes, result: Verification, over: str, quantity: str) -> None:
    """Mark the load cases on a rising curve, names below and above in turn, both ends inwards."""
    cases = sorted(result.cases, key=lambda case: getattr(case, over))
    for i, case in enumerate(cases, start=1):
        point = getattr(case, over) * SCALES[over], getattr(case, quantity) * SCALES[quantity]
        axes.plot(*point, "o", color=MAIN, ms=4)
        right = i % 2 and i < len(cases)
        where = ((4, -3), "left", "top") if right else ((-4, 3), "right", "bottom")
        note(axes, unformatted(case.name), point, *where, **NAMES)


def _draw_arm(
    axes: Axes, suspension: TrailingArmSuspension, arm: Arm, case: Case, hinge: Floats, edge: float
) -> None:
    """Side view in millimetres, the axle to the right of the hinge."""
    phi, length = case.rotation, 1e3 * arm.length
    right, up = np.eye(2)
    along = np.array([np.cos(phi), np.sin(phi)])
    across = np.array([-np.sin(phi), np.cos(phi)])
    axle = hinge + length * along
    frame = hinge + edge * up
    half = 0.62e3 * suspension.outer.mean_diameter
    seats = [axle + 1e3 * float(coil.seat) * across for coil in arm.coils]
    steel = {"color": "0.25", "solid_capstyle": "butt"}
    _line(axes, hinge, hinge + length * right, color=FAINT, lw=0.9, ls=(0, (6, 3)))
    _line(axes, hinge, frame, lw=2.2, **steel)
    _line(axes, frame - 60.0 * right, frame + (length + half) * right, lw=2.2, **steel)
    _line(axes, axle, seats[0], lw=3.0, **steel)
    for seat in seats:
        _line(axes, seat - half * along, seat + half * along, lw=1.8, **steel)
    _line(axes, hinge, axle, lw=4.5, **steel)
    for spring, coil, seat in zip(suspension.springs.values(), arm.coils, seats, strict=True):
        top = hinge + length * right + 1e3 * float(coil.seat + coil.H0 - coil.start) * up
        d, n = wire_and_coils(spring)
        turns = checks.total_coils(n, suspension.checks.dead_coils, suspension.checks.end_coils)
        # a spring that does not work yet stands on its seat with its free height
        share = min(1.0, 1e3 * spring.free_height / float(np.hypot(*(top - seat))))
        colour = SPRING_COLOURS["inner" if spring is suspension.inner else "outer"]
        wire = Circle((0.0, 0.0), 0.5e3 * d, fc=colour)
        head = seat + share * (top - seat)
        _draw_spring(axes, seat, head, along, 1e3 * spring.mean_diameter, wire, float(turns))
    for centre, radius, face in ((hinge, 26.0, "0.82"), (hinge, 9.0, "w"), (axle, 60.0, "0.92")):
        axes.add_patch(Circle(tuple(centre), radius, fc=face, ec="0.25", lw=1.0, zorder=3))
    arrow = {"arrowstyle": "-|>", "color": LIMIT, "lw": 1.4}
    tail = axle - (62.0 + 110.0 * case.load / 8e4) * up
    axes.annotate("", tuple(axle - 62.0 * up), tuple(tail), arrowprops=arrow)
    degrees = f"{np.degrees(phi):+.2f}°".replace("-", "−") if case.theta > 1e-5 else "0°"
    words = f"{unformatted(case.name)}  {case.load * 1e-3:.1f} kN"
    words += f"\n{case.deflection * 1e3:.1f} mm, {degrees}"
    note(axes, words, frame - 60.0 * right + 30.0 * up, (0, 0), va="bottom", fontsize=9, color="k")


def _line(axes: Axes, start: Floats, end: Floats, **style: Any) -> None:
    axes.add_line(Line2D(*np.transpose([start, end]), zorder=2, **style))


def _draw_spring(
    axes: Axes, foot: Floats, head: Floats, along: Floats, D: float, wire: Circle, turns: float
) -> None:
    """A coil spring cut along its axis: the wire's sections on both sides, seat to frame."""
    d = 2.0 * wire.radius
    height = float(np.hypot(*(head - foot)))
    pitch = (height - d) / max(turns - 1.0, 1.0)
    for half in range(int(2.0 * (turns - 1.0)) + 1):
        share = (0.5 * d + 0.5 * half * pitch) / height
        # the coils turn from the seat's direction into the frame's
        side = (1.0 - share) * along + share * np.array([1.0, 0.0])
        edge = -0.5 if half % 2 == 0 else 0.5
        centre = foot + share * (head - foot) + edge * D * side
        axes.add_patch(
            Circle(tuple(centre), 0.5 * d, fc=wire.get_facecolor(), ec="w", lw=0.5, zorder=4)
        )
