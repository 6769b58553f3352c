"""Pictures of the contact geometry of a wheelset: pairs of points, functions, conicity, patches.

Every function takes what `railsim.contact` computes and returns a figure in the field's habits:
mm, degrees, MPa.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from railsim.arrays import Floats
from railsim.contact.curves import inclined_to_track, rail_curve, tape_circle_position
from railsim.contact.elastic import LoadedContact
from railsim.contact.exact_normal import ExactContact
from railsim.contact.geometry import ContactGeometry
from railsim.contact.summary import Pair
from railsim.plot import style
from railsim.plot.style import DISTINCT, Picture, note, styled
from railsim.profiles.profile import Profile
from railsim.text import unformatted

SIDES = ("left", "right")
WHEEL, RAIL = DISTINCT[0], "0.35"
SIDE_COLOURS = {"left": DISTINCT[0], "right": DISTINCT[1]}
ZONE_COLOURS = {"tread": DISTINCT[0], "flange root": DISTINCT[2], "flange": DISTINCT[1]}
TABLE_LINES = ("-", "--")
LIFT = 14.0  # height at which the wheel is drawn above its rail [mm]
EXPLAINED = (
    "lines join points that touch,\nnumbers are the wheelset's\ndisplacement to the right (mm);"
    f"\nthe wheel is raised by {LIFT:.0f} mm"
)


@styled()
def profiles_figure(geometry: ContactGeometry, pairs: Sequence[Pair]) -> Figure:
    """Wheels of a left and a right pair above their rails, with lines between points that touch."""
    measured = [p for pair in pairs for p in (pair.wheel, pair.rail) if p.measured is not None]
    unique = list(dict.fromkeys(measured))
    rows, height = (2, 5.4) if unique else (1, 3.0)
    figure = Picture(9.6, height, edges=(0.06, 0.45 / height, 0.99, 1.0 - 0.3 / height, 0.14, 0.28))
    grid = figure.add_gridspec(rows, 2, height_ratios=[1.1, 1.0][:rows])
    for side, (name, pair) in enumerate(zip(SIDES, pairs, strict=True)):
        axes = figure.add_subplot(grid[0, side])
        _draw_pair(axes, geometry, pair, side)
        axes.set_title(unformatted(f"{name}: {pair.words}"))
        if side == 0:  # within the rail's head
            look = {"fontsize": 6.5, "frame": "axes fraction"}
            note(axes, EXPLAINED, (0.43, 0.16), (0, 0), "center", "center", **look)
    if unique:
        _draw_smoothing(figure.add_subplot(grid[1, :]), unique)
    return figure


def _draw_pair(axes: Axes, geometry: ContactGeometry, pair: Pair, side: int) -> None:
    sign = 2.0 * side - 1.0
    rail_y, rail_z = inclined_to_track(pair.rail, pair.gauge, pair.inclination)
    head = rail_curve(pair.rail, pair.gauge, pair.inclination)
    tape = tape_circle_position(pair.back_to_back)
    axes.plot(sign * 1e3 * rail_y, -1e3 * rail_z, color=RAIL)
    wheel_y, wheel_z = 1e3 * (pair.wheel.y + tape), -1e3 * pair.wheel.z
    axes.plot(sign * wheel_y, wheel_z + LIFT, color=WHEEL)
    on_wheel = geometry.wheel_y[:, side]
    order = np.argsort(pair.wheel.y, kind="stable")
    heights = np.interp(on_wheel, pair.wheel.y[order], pair.wheel.z[order])
    known = np.isfinite(on_wheel)
    lines = np.arange(np.ceil(1e3 * geometry.lateral[0]), 1e3 * geometry.lateral[-1] + 1e-6)
    last_label = np.inf
    for millimetres in lines:
        i = int(np.argmin(np.abs(1e3 * geometry.lateral - millimetres)))
        if not known[i]:
            continue
        x_wheel = sign * 1e3 * (on_wheel[i] + tape)
        x_rail = 1e3 * geometry.contact_y[i, side]
        height = -1e3 * np.interp(1e-3 * abs(x_rail), head.Y, head.z)
        axes.plot([x_wheel, x_rail], [-1e3 * heights[i] + LIFT, height], color="0.6", lw=0.6)
        number = f"{millimetres:.0f}".replace("-", "−")
        if abs(x_wheel - last_label) < 2.0 + 1.8 * len(number):
            continue  # the number would lie on its neighbour
        last_label = x_wheel
        note(axes, number, (x_wheel, -1e3 * heights[i] + LIFT), (0, 3), "center", fontsize=6)
    low, high = 1e3 * tape - 72.0, 1e3 * rail_y.max() + 12.0
    axes.set(xlim=sorted((sign * low, sign * high)), ylim=(-30.0, LIFT + 10.0), aspect="equal")
    axes.set(xlabel="lateral position $y$ (mm)", ylabel="height (mm)")


def _draw_smoothing(axes: Axes, profiles: Sequence[Profile]) -> None:
    """How far smoothing moved the points of measured profiles, along the contour's normal."""
    for colour, profile in zip(DISTINCT, profiles, strict=False):
        assert profile.measured is not None
        moved = profile.measured - np.stack((profile.y, profile.z))
        tangent = np.stack((np.gradient(profile.y), np.gradient(profile.z)))
        tangent /= np.hypot(*tangent)
        normal = moved[1] * tangent[0] - moved[0] * tangent[1]
        name = unformatted(profile.name)
        axes.plot(1e3 * profile.y, 1e6 * normal, ".", ms=2, color=colour, label=name)
    axes.axhline(0.0, color="0.35", lw=0.7)
    axes.set(xlabel="position on the profile $y$ (mm)", ylabel="measured − smoothed (µm)")
    axes.legend(loc="upper right")


@styled()
def functions_figure(geometry: ContactGeometry, title: str = "") -> Figure:
    """Rolling radius difference, radii, contact angles, positions and roll over displacement."""
    y = 1e3 * geometry.lateral
    figure = Picture(9.6, 5.4, title, (0.06, 0.085, 0.99, 0.925 if title else 0.985, 0.24, 0.08))
    axes = figure.subplots(2, 3, sharex=True)
    axes[0, 0].plot(y, 1e3 * geometry.delta_r, color=DISTINCT[0])
    for panel, values, label in (
        (axes[0, 1], 1e3 * geometry.rolling_radius, "rolling radius (mm)"),
        (axes[0, 2], np.degrees(geometry.contact_angle), "contact angle (deg)"),
        (axes[1, 0], 1e3 * geometry.wheel_y, "outwards on the wheel (mm)"),
        (axes[1, 1], 1e3 * np.abs(geometry.contact_y), "distance from track centre (mm)"),
    ):
        for own, name in zip(values.T, SIDES, strict=True):
            panel.plot(y, own, color=SIDE_COLOURS[name], ls=style.SIDE_LINES[name], label=name)
        panel.set_ylabel(label)
    axes[0, 1].legend(loc="upper center")
    axes[0, 0].set_ylabel("rolling radius difference $\\Delta r$ (mm)")
    axes[1, 2].plot(y, 1e3 * geometry.roll, color=DISTINCT[0])
    axes[1, 2].set_ylabel("roll (mrad)")
    # with a flange on its rail everything else would be a flat line
    shown = geometry.delta_r, geometry.rolling_radius, geometry.roll
    for panel, values in zip((axes[0, 0], axes[0, 1], axes[1, 2]), shown, strict=True):
        _limit(panel, 1e3 * values, geometry)
    for panel in axes[1]:
        panel.set_xlabel("lateral displacement $y$ (mm)")
    for panel in axes.flat:
        for lateral, _ in geometry.jumps():
            panel.axvline(1e3 * lateral, color="0.8", lw=0.5, zorder=0)
    return figure


def _limit(axes: Axes, values: Floats, geometry: ContactGeometry) -> None:
    """Show the range that belongs to tread and flange root, contact angles below 45 degrees."""
    angle = np.max(np.abs(geometry.contact_angle), axis=1)
    usual = np.isfinite(angle) & (angle < np.radians(45.0))
    if not usual.any():
        return
    low, high = float(np.min(values[usual])), float(np.max(values[usual]))
    margin = 0.25 * (high - low) + 1e-6
    axes.set_ylim(low - margin, high + margin)


@styled()
def conicity_figure(conicity: Mapping[str, tuple[Floats, Floats]]) -> Figure:
    """Equivalent conicity over the amplitude: amplitudes [m] and values [1] by their name."""
    figure, axes = style.single(5.6, 3.6, edges=(0.11, 0.13, 0.985, 0.975))
    for colour, (name, (amplitudes, values)) in zip(DISTINCT, conicity.items(), strict=False):
        axes.plot(1e3 * amplitudes, values, color=colour, marker=".", ms=4, label=unformatted(name))
    axes.axvline(3.0, color="0.75", lw=0.6, zorder=0)
    note(axes, "3 mm", (3.0, 1.0), (3, -2), "left", "top", frame=style.ABOVE)
    axes.set(xlabel="amplitude $\\hat y$ (mm)", ylabel="equivalent conicity $\\tan\\gamma_e$")
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="best")
    return figure


@styled()
def conicity_map_figure(
    gauges: Sequence[float], amplitudes: Floats, values: Floats, title: str = ""
) -> Figure:
    """Equivalent conicity, float64[gauge, amplitude], over gauge and amplitude [m]."""
    figure, axes = style.single(5.6, 3.6, title, (0.11, 0.13, 0.985, 0.9 if title else 0.975))
    # the flange's slopes beyond would hide the tread's
    levels = np.linspace(0.0, 0.8, 17)
    x, y = 1e3 * np.asarray(gauges), 1e3 * amplitudes
    filled = axes.contourf(x, y, values.T, levels, extend="max")
    none = "; white: none" if np.isnan(values).any() else ""
    figure.colorbar(filled, ax=axes, label=f"equivalent conicity $\\tan\\gamma_e${none}")
    axes.set(xlabel="gauge (mm)", ylabel="amplitude $\\hat y$ (mm)")
    return figure


@styled()
def overlay_figure(profiles: Sequence[Profile]) -> Figure:
    """Profiles of one kind on each other, and how far the others are off the first."""
    first, *others = profiles
    figure = Picture(9.6, 5.0, edges=(0.07, 0.09, 0.99, 0.98, None, 0.12))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
    order = np.argsort(first.y, kind="stable")
    for colour, profile in zip(DISTINCT, profiles, strict=False):
        above.plot(1e3 * profile.y, -1e3 * profile.z, color=colour, label=unformatted(profile.name))
    for colour, profile in zip(DISTINCT[1:], others, strict=False):
        # not where a contour is nearly upright
        flat = np.abs(np.gradient(profile.z)) < 4.0 * np.abs(np.gradient(profile.y))
        off = np.interp(profile.y, first.y[order], first.z[order]) - profile.z
        below.plot(1e3 * profile.y, np.where(flat, 1e3 * off, np.nan), color=colour)
    above.set_aspect("equal", adjustable="datalim")
    above.set_ylabel("height (mm)")
    above.legend(loc="best")
    below.set(ylabel=f"above {unformatted(first.name)} (mm)")
    below.set(xlabel="position on the profile $y$ (mm)")
    return figure


@styled()
def patches_figure(
    contacts: Mapping[float, LoadedContact],
    load: float,
    exact: Mapping[float, ExactContact] | None = None,
    other: Mapping[float, LoadedContact] | None = None,
    labels: tuple[str, str] = ("contact table", "second table"),
    where: str = "",
) -> Figure:
    """Contact patches of the right wheel, seen from above, one picture for each displacement.

    `contacts` ([m]): From the contact table. `load`: Wheel load, for the title [N]. `exact` ([m]):
    Pressure by boundary elements, drawn beneath. `other` ([m]): From a second table, drawn dashed.
    `labels`: What both tables are called. `where`: End of the title.
    """
    columns = 4
    rows = -(-len(contacts) // columns)
    height = 1.75 * rows + 1.1
    right = 0.90 if exact else 0.99
    edges = 0.06, 0.45 / height, right, 1.0 - 0.85 / height, 0.08, 0.32
    figure = Picture(9.6, height, edges=edges)
    title = f"Contact patches of the right wheel under {1e-3 * load:.0f} kN{where}"
    figure.suptitle(title, x=0.06, y=1.0 - 0.1 / height, ha="left", va="top")
    handles = [style.key(zone, color=colour) for zone, colour in ZONE_COLOURS.items()]
    tables = zip(labels[: 2 if other else 1], TABLE_LINES, strict=False)
    handles += [style.key(label, color="0.3", ls=line) for label, line in tables]
    at = (0.05, 1.0 - 0.3 / height)
    figure.legend(handles=handles, loc="upper left", bbox_to_anchor=at, ncols=len(handles))
    axes = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    positions = [patch.y for contact in contacts.values() for patch in contact.patches]
    low, high = 1e3 * min(positions) - 14.0, 1e3 * max(positions) + 14.0
    image = None
    for panel, (y, contact) in zip(axes, contacts.items(), strict=False):
        if exact is not None and y in exact and exact[y].pressure.size:
            solution = exact[y]
            shown = np.where(solution.pressure > 0.0, 1e-6 * solution.pressure, np.nan)
            image = panel.pcolormesh(
                1e3 * solution.Y, 1e3 * solution.x, shown, cmap="YlOrBr", vmin=0.0, vmax=2500.0
            )
        _draw_ellipses(panel, contact, TABLE_LINES[0])
        if other is not None:
            _draw_ellipses(panel, other[y], TABLE_LINES[1])
        panel.set(title=f"$y$ = {1e3 * y:g} mm".replace("-", "−"), xlim=(low, high))
        panel.set(ylim=(-22.0, 22.0), aspect="equal")
    style.label_grid(axes, len(contacts), columns, ("lateral position (mm)", "along the rail (mm)"))
    if image is not None:
        bar = figure.add_axes((0.92, 0.2, 0.012, 0.6))
        figure.colorbar(image, cax=bar, label="pressure by boundary elements (MPa)")
    return figure


def _draw_ellipses(axes: Axes, contact: LoadedContact, line: str) -> None:
    for patch in contact.patches:
        # seen from above, the patch's width is foreshortened by its angle
        width = 2e3 * patch.b * np.cos(patch.angle)
        at, colour = (1e3 * patch.y, 0.0), ZONE_COLOURS[patch.zone]
        axes.add_patch(Ellipse(at, width, 2e3 * patch.a, fill=False, ls=line, lw=1.2, color=colour))
