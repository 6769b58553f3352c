"""Pictures of curving, tests, wear and searches: plain numbers in the units of their axes."""

from types import SimpleNamespace as Made

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba

from railsim.assessment.statistics import Line
from railsim.plot import assessment, curving, springs, study, validation
from railsim.plot.style import LIMIT
from railsim.profiles.profile import Profile


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def points(axes):
    return [line.get_xydata() for line in axes.lines]


def test_maps_of_wear_show_the_leading_outer_wheel():
    """Wheels by number: 1000 m, 100 i, 10 wheelset, side; a left-hand curve has its right wheel."""
    radius, deficiency, friction = np.array([300.0, -300.0]), np.array([0.0, 0.05]), [0.2, 0.4]
    r, i, m, w, side = np.meshgrid(*map(np.arange, (2, 2, 2, 4, 2)), indexing="ij")
    wear = 1.0 * r + 10.0 * i + 100.0 * m + 1000.0 * w + 10000.0 * side
    wear[0, 1, 1] = np.nan
    made = Made(radius=radius, cant_deficiency=deficiency, friction=friction, T_gamma=wear)
    figure = plt.figure()
    curving._wear_maps(figure, made, np.argsort(radius))
    for k, (axes, mu) in enumerate(zip(figure.axes, ("0.2", "0.4"), strict=False)):
        (mesh,) = [c for c in axes.collections if isinstance(c, QuadMesh)]
        # rows of deficiency, columns of -300 and 300 m
        expected = 100.0 * k + np.array([[10001.0, 0.0], [10011.0, 10.0]])
        expected[1, 1] = np.nan if k else 10.0
        shown = np.ma.filled(mesh.get_array(), np.nan).reshape(2, 2)
        assert shown == pytest.approx(expected, nan_ok=True)
        assert mesh.get_clim() == (0.0, 10111.0)
        texts = {(t.xy[0], t.xy[1]): (t.get_text(), t.get_color()) for t in axes.texts}
        assert texts[0, 0] == (f"{10001 + 100 * k}", "black")  # on light
        assert texts[1, 0] == (f"{100 * k}", "white")
        assert texts[1, 1] == (("none", "black") if k else ("10", "white"))
        assert [t.get_text() for t in axes.get_xticklabels()] == ["−300", "300"]
        assert [t.get_text() for t in axes.get_yticklabels()] == ["0", "50"]
        assert axes.get_title() == rf"$T\gamma$ (N), leading outer wheel, friction {mu}"
    assert [axes.get_ylabel() for axes in figure.axes[:2]] == ["cant deficiency (mm)", ""]


def test_ticks_are_round_radii_within_those_drawn():
    assert curving._ticks(np.array([250.0, 1200.0])) == [300.0, 500.0, 1000.0]
    assert curving._ticks(np.array([270.0, 2000.0])) == [300.0, 500.0, 1000.0, 2000.0]
    assert curving._ticks(np.array([60.0, 19000.0]))[-1] == 20000.0
    assert curving._ticks(np.array([333.0])) == [300.0]  # within a tenth


def test_differences_are_counted_over_their_limit():
    """Two of three differences at half of the limit, one at -2: bins of 0.175 from -2.1 on."""
    one = Made(
        pairs=[Made(difference=d) for d in (1e3, 1e3, -4e3)],
        quantity=Made(words="wheel load"),
        limit=2e3,
        mean=-2e3 / 3.0,
        verdict="fail",
    )
    empty = Made(pairs=[])
    axes, *_ = validation.differences(Made(comparisons=[one, empty])).axes
    counts = {
        round(bar.get_x() + bar.get_width() / 2.0, 4): bar.get_height()
        for bar in axes.patches
        if bar.get_height()
    }
    # 24 bins over 4.2: those around 0.5 and -2
    assert counts == {0.4375: 2.0, -2.0125: 1.0}
    lines = sorted(line.get_xdata()[0] for line in axes.lines)
    assert lines == pytest.approx([-2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0])
    assert len(axes.patches) == 24
    assert axes.patches[0].get_facecolor() == to_rgba(LIMIT)
    one.pairs, one.verdict = [Made(difference=0.0)], "pass"
    narrow = validation.differences(Made(comparisons=[one])).axes[0].patches
    assert narrow[0].get_x() == pytest.approx(-1.2)
    assert narrow[0].get_facecolor() != to_rgba(LIMIT)
    assert narrow[-1].get_x() + narrow[-1].get_width() == pytest.approx(1.2)


def test_a_regression_is_drawn_over_the_deficiency_in_the_unit_of_its_quantity():
    """Y = 20 kN + 200 kN/m x; the bound is q s sqrt(1 + 1/N + (x - m)^2/S) above it."""
    line = Line(20e3, 200e3, 1e3, 0.15, 2.0, 4, 0.1, 0.01)
    criterion = Made(name="Y", scale=1e-3)
    estimated = {"estimate": Made(line=line, value=53e3), "limit": 60e3}
    like = Made(criterion=criterion, place="axle 1", **estimated)
    other = Made(criterion=Made(name="Q"), place="axle 1", estimate=Made(line=None))
    section = {"section": Made(cant_deficiency=0.05), "values": {("Y", "axle 1"): [25e3, 31e3]}}
    elsewhere = {"section": Made(cant_deficiency=0.3), "values": {("Y", "axle 2"): [1.0]}}
    report = Made(values=[Made(**section), Made(**elsewhere)], rows=[other, like])
    axes = plt.figure().subplots()
    assessment._regression(axes, report, like, "C0")
    values, limit, mark, mean, bound, estimate = points(axes)
    assert (limit[:, 1].tolist(), mark.tolist()) == ([60.0, 60.0], [[1.0, 60.0]])
    assert values == pytest.approx(np.array([[50.0, 31.0]]))
    x = np.linspace(0.05, 0.15, 60)
    assert mean == pytest.approx(np.stack((1e3 * x, 20.0 + 200.0 * x), axis=1))
    above = 2.0 * np.sqrt(1.25 + (x - 0.1) ** 2 / 0.01)
    assert bound == pytest.approx(np.stack((1e3 * x, 20.0 + 200.0 * x + above), axis=1))
    assert estimate == pytest.approx(np.array([[150.0, 53.0]]))
    bare = plt.figure().subplots()
    assessment._regression(bare, Made(values=[], rows=[other]), like, "C0")
    assert not bare.lines


def test_wear_is_drawn_over_kilometres_and_megatonnes():
    """Of three steps the first and the last are named; the later, the darker."""
    y = 1e-3 * np.arange(-30.0, 31.0)
    wheels = [
        (1e3 * distance, Profile("p", "wheel", y, 0.1 * y + 1e-3 * lost))
        for distance, lost in ((0.0, 0.0), (50.0, 0.5), (100.0, 1.0), (150.0, -2.0))
    ]
    rows = [{"equivalent_conicity": v} for v in (0.1, None, 0.2, 0.4)]
    outline, depth, conicity = study.wear_figure(wheels, rows, "title").axes
    new, last = points(outline)
    assert new == pytest.approx(np.stack((1e3 * y, 100.0 * y), axis=1))
    assert last == pytest.approx(np.stack((1e3 * y, 100.0 * y - 2.0), axis=1))
    lost = [line.get_ydata() for line in depth.lines]
    assert lost == [pytest.approx(np.full(61, each)) for each in (0.5, 1.0, 2.0)]
    assert [line.get_alpha() for line in depth.lines] == pytest.approx([0.5, 0.75, 1.0])
    assert [t.get_text() for t in outline.get_legend().get_texts()] == ["new", "150 km"]
    assert [t.get_text() for t in depth.get_legend().get_texts()] == ["50 km", "150 km"]
    assert outline.yaxis_inverted()
    assert depth.get_xlim() == pytest.approx((-45.0, 35.0))
    (found,) = points(conicity)
    expected = np.array([[0.0, 0.1], [50.0, np.nan], [100.0, 0.2], [150.0, 0.4]])
    assert found == pytest.approx(expected, nan_ok=True)
    assert (conicity.get_xlim()[0], conicity.get_ylim()[0], depth.get_ylim()[0]) == (0.0, 0.0, 0.0)
    assert conicity.get_ylim()[1] > 0.44
    steps = [(1e9 * amount, profile) for (_, profile), amount in zip(wheels, range(4), strict=True)]
    left, right, *_ = study.rail_wear_figure({"left": steps, "right": steps[:2]}, "title").axes
    assert [t.get_text() for t in left.get_legend().get_texts()] == ["new", "3 Mt"]
    assert [t.get_text() for t in right.get_legend().get_texts()] == ["new", "1 Mt"]
    assert left.yaxis_inverted()
    assert right.yaxis_inverted()


def test_found_nests_are_drawn_by_their_rank():
    cloud = np.array([[30.0, 0.1], [31.0, np.nan], [32.0, 0.3]])
    nests = [Made(mass=30.5, fatigue_margin=0.15), Made(mass=31.5, fatigue_margin=0.25)]
    (axes,) = springs.search_figure(Made(cloud=cloud, nests=nests)).axes
    feasible, ranked = points(axes)
    assert feasible == pytest.approx(cloud[[0, 2]])
    assert ranked == pytest.approx(np.array([[30.5, 0.15], [31.5, 0.25]]))
    assert {t.get_text(): t.xy for t in axes.texts} == {"1": (30.5, 0.15), "2": (31.5, 0.25)}
