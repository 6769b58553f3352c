"""Pictures of contact, creep forces and modes: plain numbers in the units of their axes."""

from dataclasses import replace
from types import SimpleNamespace as Made

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.colors import to_hex
from matplotlib.patches import Ellipse
from matplotlib.quiver import Quiver

from railsim.contact.creep import creep_force
from railsim.contact.creep_curves import CASES, Patch
from railsim.plot import contact, creep, modes, recording
from railsim.profiles.profile import Profile


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def named_axes(figure):
    """Axes of a figure by their label over y, or their title."""
    return {axes.get_ylabel() or axes.get_title("left"): axes for axes in figure.axes}


def curves(axes):
    """Points of the curves that have more than two, float64[curve][point, 2]."""
    return [line.get_xydata() for line in axes.lines if len(line.get_xydata()) > 2]


def made_geometry():
    lateral = 1e-3 * np.arange(-3.0, 4.0)
    both = np.stack((lateral, 10e-3 + 3.0 * lateral), axis=1)
    angle = np.radians(np.array([50.0, 40.0, 2.0, 3.0, 2.0, 40.0, 50.0]))
    return Made(
        lateral=lateral,
        delta_r=5.0 * lateral**3 / 1e-6,
        roll=7.0 * lateral,
        rolling_radius=0.46 + both,
        contact_angle=np.stack((angle, angle / 2.0), axis=1),
        wheel_y=2.0 * both,
        contact_y=np.array([-1.0, 1.0]) * (0.75 + both),
        jumps=lambda: [(-1.5e-3, 2e-3), (2.5e-3, 1e-3)],
    )


def test_functions_of_contact_are_drawn_in_their_units():
    """Radii, angles, positions of both sides; axes for angles below 45 degrees, a quarter more."""
    made = made_geometry()
    figure = contact.functions_figure(made, "title")
    axes = named_axes(figure)
    y = np.arange(-3.0, 4.0)
    (delta,) = curves(axes["rolling radius difference $\\Delta r$ (mm)"])
    assert delta == pytest.approx(np.stack((y, 5.0 * y**3), axis=1))
    (roll,) = curves(axes["roll (mrad)"])
    assert roll == pytest.approx(np.stack((y, 7.0 * y), axis=1))
    own = np.stack((y, 10.0 + 3.0 * y))  # of both sides [mm]
    angles = np.array([50.0, 40.0, 2.0, 3.0, 2.0, 40.0, 50.0])
    for label, values in {
        "rolling radius (mm)": 460.0 + own,
        "contact angle (deg)": (angles, angles / 2.0),
        "outwards on the wheel (mm)": 2.0 * own,
        "distance from track centre (mm)": 750.0 + own,
    }.items():
        for found, expected in zip(curves(axes[label]), values, strict=True):
            assert found == pytest.approx(np.stack((y, expected), axis=1))
    limits = {  # over -2 to 2 mm, where the larger angle of both is below 45 degrees
        "rolling radius difference $\\Delta r$ (mm)": (-40.0, 40.0),
        "roll (mrad)": (-14.0, 14.0),
        "rolling radius (mm)": (458.0, 476.0),
    }
    for label, (low, high) in limits.items():
        margin = 0.25 * (high - low)
        assert axes[label].get_ylim() == pytest.approx((low - margin, high + margin), abs=1e-4)
    for one in axes.values():
        upright = [line.get_xdata()[0] for line in one.lines if len(line.get_xdata()) == 2]
        assert upright == pytest.approx([-1.5, 2.5])


def test_without_angles_below_45_degrees_all_is_shown():
    made = made_geometry()
    made.contact_angle = made.contact_angle + 1.0
    axes = named_axes(contact.functions_figure(made))["roll (mrad)"]
    low, high = axes.get_ylim()
    assert low < -21.0 < 21.0 < high


def test_conicity_is_drawn_over_millimetres():
    values = np.array([0.1, 0.2, 0.4])
    figure = contact.conicity_figure({"one": (1e-3 * np.array([1.0, 3.0, 5.0]), values)})
    (axes,) = figure.axes
    (found,) = curves(axes)
    assert found == pytest.approx(np.array([[1.0, 0.1], [3.0, 0.2], [5.0, 0.4]]))
    assert (axes.get_xlim()[0], axes.get_ylim()[0]) == (0.0, 0.0)


def test_a_map_of_conicity_has_its_borders_where_the_values_are():
    """Values that grow evenly over the gauge from 0 to 0.8: a level of 0.05 each 1.25 mm."""
    gauges, amplitudes = 1e-3 * np.linspace(1425.0, 1445.0, 5), 1e-3 * np.array([1.0, 2.0, 4.0])
    values = np.repeat(np.linspace(0.0, 0.8, 5)[:, None], 3, axis=1)
    axes = contact.conicity_map_figure(gauges, amplitudes, values).axes
    (filled,) = axes[0].collections
    places = np.unique(np.round(np.concatenate([p.vertices[:, 0] for p in filled.get_paths()]), 6))
    assert places == pytest.approx(np.unique([*np.arange(1425.0, 1446.0, 1.25), *1e3 * gauges]))
    assert axes[0].get_ylim() == pytest.approx((1.0, 4.0))
    assert "white" not in axes[1].get_ylabel()
    values[0, 0] = np.nan
    assert (
        "white: none"
        in contact.conicity_map_figure(gauges, amplitudes, values).axes[1].get_ylabel()
    )


def test_profiles_lie_on_each_other_with_their_difference_above_the_first():
    """A contour half a millimetre higher than a parabola; not told where it is nearly upright."""
    y = 1e-3 * np.arange(-30.0, 31.0)
    z = 50.0 * y**2  # 1 in 0.1 at 10 mm; z points down
    steep = np.where(y > 25e-3, z + 5.0 * (y - 25e-3), z - 0.5e-3)
    profiles = Profile("first", "rail", y, z), Profile("other", "rail", y, steep)
    above, below = contact.overlay_figure(profiles).axes
    first, _ = curves(above)
    assert first == pytest.approx(np.stack((1e3 * y, -1e3 * z), axis=1))
    (found,) = curves(below)
    assert found[:50, 1] == pytest.approx(0.5)
    assert np.isnan(found[57:, 1]).all()  # 5 + 2.5 mm in a millimetre
    assert found[:, 0] == pytest.approx(1e3 * y)


def loaded(*patches):
    return Made(
        patches=[Made(y=y, a=a, b=b, angle=angle, zone=zone) for y, a, b, angle, zone in patches]
    )


def test_patches_are_ellipses_seen_from_above():
    """An angle of 60 degrees halves the width; exact pressures lie beneath in MPa."""
    one = loaded((0.75, 6e-3, 5e-3, 0.0, "tread"), (0.72, 8e-3, 2e-3, np.pi / 3.0, "flange"))
    two, second = (loaded((y, 6e-3, 4e-3, 0.0, "tread")) for y in (0.76, 0.761))
    pressure = np.array([[1e9, 0.0], [2e9, 3e8]])
    exact = {0.0: Made(pressure=pressure, Y=np.array([0.74, 0.75]), x=np.array([-1e-3, 1e-3]))}
    figure = contact.patches_figure(
        {0.0: one, -2e-3: two}, 50e3, exact, {0.0: two, -2e-3: second}, ("a", "b"), " here"
    )
    assert figure.get_suptitle() == "Contact patches of the right wheel under 50 kN here"
    first, other, *_ = figure.axes
    titles = [axes.get_title("left") for axes in (first, other)]
    assert titles == ["$y$ = 0 mm", "$y$ = −2 mm"]
    found = [(p.center, p.width, p.height, p.get_linestyle()) for p in first.patches]
    places, widths, heights, lines = zip(*found, strict=True)
    assert np.ravel(places) == pytest.approx([750.0, 0.0, 720.0, 0.0, 760.0, 0.0])
    assert widths == pytest.approx((10.0, 2.0, 8.0))
    assert heights == pytest.approx((12.0, 16.0, 12.0))
    assert lines == ("-", "-", "--")
    tread, flange = contact.ZONE_COLOURS["tread"], contact.ZONE_COLOURS["flange"]
    assert [to_hex(p.get_edgecolor()) for p in first.patches] == [
        to_hex(colour) for colour in (tread, flange, tread)
    ]
    assert all(isinstance(p, Ellipse) and not p.fill for p in first.patches)
    assert [p.center[0] for p in other.patches] == pytest.approx([760.0, 761.0])
    assert first.get_xlim() == pytest.approx((706.0, 774.0))
    mesh = next(c for c in first.collections if isinstance(c, QuadMesh))
    assert mesh.get_array().filled(-1.0).ravel() == pytest.approx([1000.0, -1.0, 2000.0, 300.0])
    assert np.asarray(mesh.get_coordinates()).mean(axis=(0, 1)) == pytest.approx([745.0, 0.0])
    assert not [c for c in other.collections if isinstance(c, QuadMesh)]
    only = contact.patches_figure({-2e-3: two}, 50e3)
    assert [p.center[0] for p in only.axes[0].patches] == pytest.approx([760.0])
    assert len(only.axes) == len(figure.axes) - 1  # the pressure's colours


def test_creep_curves_are_shares_of_the_friction_over_creepage(monkeypatch):
    """Each direction in its panel; circles where the full theory was asked, T_x and T_y."""
    patch = Patch(6e-3, 4e-3, 80e3, 0.3)
    asked = []

    def exact(given, creepages):
        asked.append((given, creepages))
        return 0.25 * 24e3, -0.5 * 24e3, 0.0

    monkeypatch.setattr(creep, "exact_force", exact)
    figure = creep.creep_curves_figure(patch, ["polach"], exact_points=3)
    assert figure.get_suptitle() == "Creep forces, a/b = 1.5, N = 80 kN, μ = 0.3"
    scale = np.linspace(0.0, 5.0 ** (1 / 1.5), 121) ** 1.5
    sizes = np.linspace(0.0, 5.0 ** (1 / 1.5), 4)[1:] ** 1.5
    for panel, (name, direction) in zip(figure.axes, CASES.items(), strict=True):
        assert panel.get_title("left") == name
        assert panel.get_xlim() == (0.0, 5.0)
        x, y, spin = patch.unit_creepages(direction)[:, None] * scale
        force = creep_force(6e-3, 4e-3, 80e3, 0.3, x, y, spin, patch.G, patch.nu, "polach")
        shares = force.T_x / 24e3, force.T_y / 24e3
        drawn = [k for k in (0, 1) if np.abs(shares[k]).max() > 1e-9]
        lines = [line for line in panel.lines if len(line.get_xdata()) > 2]
        drawn_lines, circles = lines[: len(drawn)], lines[len(drawn) :]
        assert len(circles) == len(drawn)
        for k, line, circle in zip(drawn, drawn_lines, circles, strict=True):
            assert line.get_xydata() == pytest.approx(np.stack((scale, shares[k]), axis=1))
            expected = np.stack((sizes, np.full(3, (0.25, -0.5)[k])), axis=1)
            assert circle.get_xydata() == pytest.approx(expected)
    given = np.array([creepages for _, creepages in asked]).reshape(len(CASES), 3, 3)
    for found, direction in zip(given, CASES.values(), strict=True):
        assert found == pytest.approx(sizes[:, None] * patch.unit_creepages(direction))
    assert not [
        line
        for line in creep.creep_curves_figure(patch, ["polach"], exact_points=0).axes[0].lines
        if len(line.get_xdata()) == 3
    ]


def test_the_traction_is_drawn_forward_up_and_to_the_right():
    """An ellipse of 6 by 4 mm in three strips: MPa in colour, arrows, the cells that stick."""
    cells, strips = 8, 3
    across = 1e-3 * np.array([-8.0, 0.0, 8.0]) / 3.0  # strips of 8/3 mm fill 4 mm to both sides
    x = 6e-3 * np.cos((np.arange(cells) + 0.5) * np.pi / cells)[::-1]
    x = np.stack([0.8 * x, x, 0.8 * x])
    t_x, t_y = (1e6 * np.arange(24.0).reshape(strips, cells) * factor for factor in (3.0, -4.0))
    sticks = np.zeros((strips, cells), dtype=bool)
    sticks[1, 4:] = True
    made = Made(
        x=x,
        y=np.repeat(across[:, None], cells, axis=1),
        t_x=t_x,
        t_y=t_y,
        sticks=sticks,
        bound=np.full((strips, cells), 200e6),
        T_x=6e3,
        T_y=-12e3,
    )
    figure = creep.traction_figure({"half": made}, 24e3)
    panel = figure.axes[0]
    assert panel.get_title("left") == "half\n$T_x$ +0.25, $T_y$ −0.50 $\\mu N$"
    meshes = [c for c in panel.collections if isinstance(c, QuadMesh)]
    for j, mesh in enumerate(meshes):
        assert np.asarray(mesh.get_array()).ravel() == pytest.approx(
            5.0 * np.arange(8 * j, 8 * j + 8)
        )
        assert mesh.get_clim() == (0.0, 200.0)
        places = np.asarray(mesh.get_coordinates())
        middle = 1e3 * across[j]
        assert places[0, :, 0] == pytest.approx([middle - 4.0 / 3.0, middle + 4.0 / 3.0])
        between = 500.0 * (x[j, 1:] + x[j, :-1])
        assert places[1:-1, 0, 1] == pytest.approx(between)
        # the borders at the ends lie around the first and the last cell
        assert places[[0, -1], 0, 1] + between[[0, -1]] == pytest.approx(2e3 * x[j, [0, -1]])
    (held,) = [
        c
        for c in panel.collections
        if type(c).__name__ == "FillBetweenPolyCollection"
        or (isinstance(c, PolyCollection) and not isinstance(c, Quiver))
    ]
    low, high = held.get_paths()[0].vertices.min(axis=0), held.get_paths()[0].vertices.max(axis=0)
    borders = np.asarray(meshes[1].get_coordinates())[:, 0, 1]
    assert [*low, *high] == pytest.approx([-4.0 / 3.0, borders[4], 4.0 / 3.0, borders[8]])
    (arrows,) = [c for c in panel.collections if isinstance(c, Quiver)]
    for u, v, (right, forward) in zip(arrows.U, arrows.V, arrows.get_offsets(), strict=True):
        at = np.argmin(np.hypot(1e3 * made.y - right, 1e3 * x - forward))
        found = np.ravel(made.y)[at], np.ravel(x)[at]
        assert (1e-3 * right, 1e-3 * forward) == pytest.approx(found)
        assert (u, v) == pytest.approx((np.ravel(t_y)[at], np.ravel(t_x)[at]))
    assert len(arrows.U) == 24
    (edge,) = [p for p in panel.patches if isinstance(p, Ellipse)]
    assert (edge.width, edge.height) == pytest.approx((8.0, 12.0))
    low, high = panel.get_ylim()
    assert low == pytest.approx(-high)
    assert high > 6.0
    assert panel.get_xlim()[1] == pytest.approx(1.08e3 * across[-1])


def made_locus(**given):
    at = 2.0 * np.pi * np.array([[1.0, 3.0, 30.0, 2.0], [2.0, 4.0, 40.0, np.nan]])  # rad/s
    zeta = np.array([[0.1, -0.05, 0.1, 0.2], [0.2, 0.05, 0.1, np.nan]])
    made = {
        "names": ["hunting", "carbody bounce", "wheelset 1", "bogie pitch"],
        "eigenvalues": at * (-zeta + 1j * np.sqrt(1.0 - zeta**2)),
        "values": [10.0, 20.0],
        "key": "speed",
        "unit": "m/s",
        "title": "coach: straight",
    }
    return Made(**{**made, **given})


def test_a_root_locus_is_drawn_in_hertz_and_per_cent():
    """Modes beyond 25 Hz, and those at one of several values only, are left out."""
    figure = modes.locus_figure(made_locus())
    damping, frequency, plane = figure.axes
    ends = [line.get_xydata() for line in damping.lines[:2]]
    assert ends[0] == pytest.approx(np.array([[10.0, 10.0], [20.0, 20.0]]))
    assert ends[1] == pytest.approx(np.array([[10.0, -5.0], [20.0, 5.0]]))
    drawn = [line.get_xydata() for line in frequency.lines]
    assert np.array(drawn) == pytest.approx(
        np.array([[[10.0, 1.0], [20.0, 2.0]], [[10.0, 3.0], [20.0, 4.0]]])
    )
    roots, arrow, *_ = (line.get_xydata() for line in plane.lines)
    real = -2.0 * np.pi * np.array([0.1, 0.4])
    imaginary = np.array([1.0, 2.0]) * np.sqrt([0.99, 0.96])
    assert roots == pytest.approx(np.stack((real, imaginary), axis=1))
    assert arrow == pytest.approx(roots[-1:])
    assert damping.get_xlabel() == "speed (m/s)"
    # hunting and what the car body does stand out
    assert [line.get_linewidth() for line in frequency.lines] == [2.0, 1.3]
    labels = [text.get_text() for text in damping.get_legend().get_texts()]
    assert labels == ["hunting", "carbody bounce", "bogies, wheelsets"]


def test_one_value_of_a_locus_is_points():
    one = made_locus(values=[10.0])
    one.eigenvalues = one.eigenvalues[:1]
    lines = modes.locus_figure(one).axes[1].lines
    assert [line.get_marker() for line in lines] == ["o"] * 3
    assert [line.get_linewidth() for line in lines] == [2.0, 1.3, 0.9]


def test_the_first_three_hunting_motions_have_a_colour_each():
    names = ["hunting 1", "hunting 2", "hunting 3", "hunting 4", "lower sway", "upper sway", "x"]
    found = modes._colours(names, range(7))
    colours = [found[k][0] for k in range(7)]
    assert len(set(colours[:3])) == 3
    assert colours[3] == colours[2]
    assert len({*colours[:3], *colours[4:]}) == 6
    assert [found[k][1] for k in range(7)] == [2.0] * 4 + [1.3, 1.3, 0.9]


def test_no_oscillation_is_said():
    far = made_locus()
    far.eigenvalues = 100.0 * far.eigenvalues
    texts = [text.get_text() for axes in modes.locus_figure(far).axes for text in axes.texts]
    assert "no oscillation below 25 Hz" in texts


@pytest.mark.parametrize("slope", [0.0, 1.0, -2.0])
def test_smoothing_is_drawn_along_the_normal_in_micrometres(slope):
    """Points on a straight contour that were measured 5 um deeper, and moved along it besides."""
    y = 1e-3 * np.arange(-20.0, 21.0)
    normal = np.array([-slope, 1.0]) / np.hypot(1.0, slope)  # z points down
    along = np.array([1.0, slope]) / np.hypot(1.0, slope)
    points = np.stack((y, slope * y))
    moved = points + 5e-6 * normal[:, None] + 3e-6 * along[:, None]
    profile = replace(Profile("p", "rail", *points), measured=moved)
    axes = plt.figure().subplots()
    contact._draw_smoothing(axes, [profile, profile])
    found = curves(axes)
    assert len(found) == 2
    assert found[0] == pytest.approx(np.stack((1e3 * y, np.full(41, 5.0)), axis=1))


@pytest.mark.parametrize(
    ("step", "length", "named"),
    [
        (0.25, 76.0, ["D1"]),
        (0.25, 209.0, ["D1"]),
        (0.25, 211.0, ["D1", "D2"]),
        (1.45, 300.0, ["D1", "D2"]),
        (1.55, 300.0, ["D2"]),
        (12.4, 900.0, ["D2"]),
        (12.6, 900.0, []),
        (0.25, 74.0, []),
    ],
)
def test_a_recording_shows_the_bands_that_its_points_resolve(step, length, named):
    """Two points in the shortest wave, three of the longest ones in it."""
    s = np.arange(0.0, length, step)
    rows = np.column_stack([s, np.sin(s / 3.0)])
    words = recording._deviations(rows, lambda columns: columns[0])
    assert [name for name in ("D1", "D2", "D3") if f"{name} " in words] == named
