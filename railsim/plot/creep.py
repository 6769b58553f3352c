"""Pictures of creep forces: curves of all laws over creepage, and the traction within a patch.

Seen as the wheel looks at the rail from above: forward is up, right is right.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Rectangle

from railsim.arrays import Floats
from railsim.contact.creep import creep_force
from railsim.contact.creep_curves import CASES, Patch, exact_force
from railsim.contact.exact_creep import ExactCreepForce
from railsim.definitions.creep_law import CREEP_LAWS, CreepLawName
from railsim.plot.style import DISTINCT, Picture, label_grid, note, styled

LAW_COLOURS = {name: DISTINCT[law.colour] for name, law in CREEP_LAWS.items()}
STICK, HELD = "#2a6f97", "stick; elsewhere slip"
DIRECTION = "direction of the traction on the rail"
KEY = 0.3  # inch, for the key of the traction
Laws = Sequence[CreepLawName]
Cells = tuple[int, int]
LARGEST = 5.0  # end of the axis of normalised creepage


@styled()
def creep_curves_figure(
    patch: Patch, laws: Sequence[CreepLawName], nx: int = 10, ny: int = 10, exact_points: int = 7
) -> Figure:
    """Creep forces over normalised creepage, for six directions of creepage.

    `laws`: Of `railsim.contact.creep_force`. `nx`, `ny`: Cells and strips of the laws that have
    them. `exact_points`: Points of the full theory in each picture (half a second each); 0: none.
    """
    scale = np.linspace(0.0, 1.0, 121) ** 1.5 * LARGEST
    figure = Picture(9.6, 6.2, edges=(0.06, 0.13, 0.99, 0.90, 0.18, 0.36))
    ratio = patch.a / patch.b
    words = f"Creep forces, a/b = {ratio:.3g}, N = {1e-3 * patch.N:.3g} kN, μ = {patch.mu:.3g}"
    figure.suptitle(words)
    panels: list[Axes] = list(figure.subplots(2, 3, sharex=True).flat)
    for panel, (name, direction) in zip(panels, CASES.items(), strict=True):
        _draw_curves(panel, patch, direction, scale, laws, (nx, ny))
        if exact_points:
            _draw_exact(panel, patch, direction, exact_points)
        if len(_components(direction)) > 1:
            words, look = "solid $T_x$, dashed $T_y$", {"fontsize": 8, "frame": "axes fraction"}
            note(panel, words, (0.985, 0.03), (0, 0), "right", "bottom", **look)
        panel.set_title(name)
        panel.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        panel.set_xlim(0.0, LARGEST)
    words_of_axes = "magnitude of the normalised creepage", "force over $\\mu N$"
    label_grid(panels, len(panels), 3, words_of_axes)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=len(labels), loc="lower center", bbox_to_anchor=(0.5, 0.0))
    return figure


def _components(direction: Sequence[float]) -> list[tuple[int, str]]:
    """Components of the force to draw for a direction of creepage, and their lines."""
    lateral = direction[1] != 0.0 or direction[2] != 0.0
    if direction[0] == 0.0:
        return [(1, "-")]
    return [(0, "-"), (1, "--")] if lateral else [(0, "-")]


def _draw_curves(
    panel: Axes, patch: Patch, direction: Sequence[float], scale: Floats, laws: Laws, grid: Cells
) -> None:
    x, y, spin = patch.unit_creepages(direction)[:, None] * scale
    for law in laws:
        force = creep_force(
            patch.a, patch.b, patch.N, patch.mu, x, y, spin, patch.G, patch.nu, law, *grid
        )
        label = str(law)
        for column, line in _components(direction):
            values = (force.T_x, force.T_y)[column] / (patch.mu * patch.N)
            panel.plot(scale, values, color=LAW_COLOURS[law], ls=line, label=label)
            label = "_"


def _draw_exact(panel: Axes, patch: Patch, direction: Sequence[float], count: int) -> None:
    unit = patch.unit_creepages(direction)
    sizes = np.linspace(0.0, 1.0, count + 1)[1:] ** 1.5 * LARGEST
    forces = np.array([exact_force(patch, s * unit)[:2] for s in sizes])
    label = "full theory"
    for column, _ in _components(direction):
        shares = forces[:, column] / (patch.mu * patch.N)
        panel.plot(
            sizes, shares, "o", label=label, ms=3.6, mfc="none", mec="0.1", mew=0.9, clip_on=False
        )
        label = "_"


@styled()
def traction_figure(solutions: Mapping[str, ExactCreepForce], friction_force: float) -> Figure:
    """Traction on the rail within the contact ellipse, stick zone shaded.

    `solutions`: Fields by their title, one picture each, of the same ellipse. `friction_force`:
    mu N, for the resultants [N].
    """
    columns = min(len(solutions), 3)
    rows = -(-len(solutions) // columns)
    first = next(iter(solutions.values()))
    reach_x = 1e3 * float(np.abs(first.x).max() + np.abs(np.diff(first.x, axis=1)).max())
    reach_y = 1e3 * float(np.abs(first.y).max() * 1.08)
    width = float(np.clip(3.2 * (reach_y / reach_x) ** 0.5, 1.6, 3.4))
    panel_height = width * reach_x / reach_y
    height = rows * (panel_height + 0.75) + 0.25 + KEY
    wide = columns * (width + 0.3) + 1.5
    edges = (0.55 / wide, (0.45 + KEY) / height, 1.0 - 0.95 / wide, 1.0 - 0.45 / height,
                      0.3 / width, 0.75 / panel_height)  # fmt: skip
    figure = Picture(wide, height, edges=edges)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    top = 1e-6 * max(float(s.bound.max()) for s in solutions.values())
    for panel, (title, solution) in zip(axes, solutions.items(), strict=False):
        image = _draw_traction(panel, solution, top)
        panel.set(xlim=(-reach_y, reach_y), ylim=(-reach_x, reach_x), aspect="equal")
        panel.grid(False)
        T_x, T_y = (f"{T / friction_force:+z.2f}" for T in (solution.T_x, solution.T_y))
        panel.set_title(f"{title}\n$T_x$ {T_x}, $T_y$ {T_y} $\\mu N$".replace("-", "−"))
    label_grid(axes, len(solutions), columns, ("to the right (mm)", "forward (mm)"))
    bar = figure.add_axes((1.0 - 0.8 / wide, 0.2, 0.12 / width * 0.3, 0.6))
    figure.colorbar(image, cax=bar, label="traction on the rail (MPa)")
    handles = [
        Rectangle((0, 0), 1, 1, fc="none", ec=STICK, hatch="////", lw=0.0, label=HELD),
        Line2D([], [], color="0.1", marker=r"$\rightarrow$", ms=14, ls="", label=DIRECTION),
        Line2D([], [], color="0.2", lw=1.0, label="edge of the contact; leading edge above"),
    ]
    figure.legend(handles=handles, loc="lower left", ncols=3 if columns > 2 else 1, fontsize=8)
    return figure


def _draw_traction(panel: Axes, solution: ExactCreepForce, top: float) -> QuadMesh:
    """Size in colour, direction as arrows, border of the stick zone, the ellipse."""
    # cells do not line up across strips: draw each strip as a row of its own
    size = 1e-6 * np.hypot(solution.t_x, solution.t_y)
    strips = solution.y[:, 0]
    half = 0.5 * float(strips[1] - strips[0]) if strips.size > 1 else float(solution.y.max())
    for j in range(strips.size):
        x = solution.x[j]
        middle = 0.5 * (x[:-1] + x[1:])
        border = np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])
        across, border = 1e3 * np.array([strips[j] - half, strips[j] + half]), 1e3 * border
        image = panel.pcolormesh(
            across, border, size[j][:, None], cmap="YlOrBr", vmin=0.0, vmax=top, rasterized=True
        )
        held = np.flatnonzero(solution.sticks[j])
        if held.size:
            ends = border[held[-1] + 1], border[held[0]]
            panel.fill_between(
                across, *ends, alpha=0.6, facecolor="none", edgecolor=STICK, hatch="////", lw=0.0
            )
    every = [max(count // 9, 1) for count in solution.x.shape]
    shown = tuple(slice(step // 2, None, step) for step in every)
    y, x, t_y, t_x = (v[shown] for v in (solution.y, solution.x, solution.t_y, solution.t_x))
    at, scale = (1e3 * y, 1e3 * x), 12e6 * top
    panel.quiver(*at, t_y, t_x, scale=scale, color="0.1", width=0.006, pivot="mid")
    a = float(solution.x.max()) / float(np.cos(np.pi / (2 * solution.x.shape[1])))
    b = float(strips[-1]) + half
    panel.add_patch(Ellipse((0.0, 0.0), 2e3 * b, 2e3 * a, fill=False, color="0.2", lw=1.0))
    return image
