"""Tables and pictures of critical speeds: plain numbers in their columns, units and words."""

import json
from dataclasses import dataclass, replace
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from railsim.linear.vehicle import Contact
from railsim.plot import stability as plots
from railsim.stability import continuation, result
from railsim.stability.branches import Branch, Jump, Limit, Point
from railsim.stability.result import OF_CONICITY, Conicity, CriticalSpeed, LinearLoss, OverAmplitude

WHERE = {"rails": "60E1", "friction": "0.4", "law": "polach", "linear_law": "linear"}
CONTACT = Contact("tangent", 3e-3, None)


def found(**given):
    plain = {"low": 5.0, "high": 90.0, "vehicle": "coach"}
    return CriticalSpeed(CONTACT, conditions=WHERE, **{**plain, **given})


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def rows(critical):
    return {row[0]: [*row[1:]] for row in critical.table().rows}


def test_linear_speeds_have_a_row_for_each_linearisation():
    lost = LinearLoss(61.0, 1.4, "hunting", 55.0, 58.0)
    first, *others = rows(found(linear=lost)).items()
    assert first[0].startswith("linear, ")
    assert first[1] == [61.0, 1.4, None, "hunting"]
    assert dict(others) == {
        "the same on rigid rails": [58.0, None, None, ""],
        "the same with the cells of the runs": [55.0, None, None, ""],
    }
    assert len(rows(found(linear=replace(lost, speed_of_runs=None)))) == 2
    (stable,) = rows(found()).values()
    assert stable == [None, None, None, "none in this range"]
    (unstable,) = rows(found(unstable_at_low=True)).values()
    assert unstable[-1] == "unstable at its lower end"


@pytest.mark.parametrize("lowest", [40.0, 5.0])
def test_the_least_speed_over_amplitude_is_that_of_its_amplitude(lowest):
    """That of the range's lower end is not one."""
    line = OverAmplitude([1e-3, 2e-3, 4e-3], [None, 60.0, lowest], [None, 1.0, 1.2])
    own = rows(found(linear_over_amplitude=line))
    expected = [40.0, None, 4e-3, ""]
    if lowest == 5.0:
        expected = [None, None, 4e-3, "unstable at its lower end"]
    assert own["linear, harmonic, smallest over amplitude"] == expected
    assert line.record()["smallest"] == {"speed": lowest, "amplitude": 4e-3}
    nowhere = OverAmplitude([1e-3], [None], [None])
    assert len(rows(found(linear_over_amplitude=nowhere))) == 1
    assert nowhere.record()["smallest"] is None


def test_methods_jumps_and_limits_have_their_rows():
    slow, odd = Point(50.0, 5e-3, 1.1), Point(44.0, 2e-3, np.nan, stable=False)
    branch = Branch("up", [Point(80.0, 6e-3, 1.5), Point(70.0, 6e-3, 1.5)])
    critical = found(
        nonlinear={"bifurcation": slow, "threshold": odd, "ramp": None},
        branches=[branch],
        jumps=[Jump("up", 63.0, 1e-3, 7e-3), Jump("down", 50.0, 6e-3, 0.5e-3)],
        amplitude_limit=Limit(66.0, 3e-3, True, 90.0),
        instability_limit=Limit(None, 8e3, False, 80.0),
    )
    own = rows(critical)
    assert own["non-linear, bifurcation"] == [50.0, 1.1, 5e-3, ""]
    assert own["non-linear, threshold"] == [44.0, None, 2e-3, "unstable"]
    assert own["non-linear, ramp"] == [None, None, None, "none up to 80 m/s"]
    assert own["jump, speed rising"][0] == 63.0
    assert own["jump, speed rising"][-1] == "to 7.00 mm"
    assert own["jump, speed falling"][-1] == "to 0.50 mm"
    assert own["amplitude above 3 mm"] == [66.0, None, None, ""]
    words = "not reached up to 80 m/s"
    assert own["rms of sum_Y above 8 kN"] == [None, None, None, words]
    assert critical.lowest is odd
    assert critical.title == "coach, no linear one, unstable motion at 44 m/s"
    critical.nonlinear = {"bifurcation": slow}
    assert critical.title == "coach, no linear one, slowest sustained hunting 50 m/s"
    critical.nonlinear, critical.linear = {"ramp": None}, LinearLoss(61.0, 1.0, "x")
    assert critical.title == "coach, linear 61 m/s, none that lasts"
    critical.nonlinear = {}
    assert critical.title == "coach, linear 61 m/s"


def test_the_way_hunting_begins_is_told_once():
    assert found().verdict() == found(type="none").verdict() == ""
    assert found(type="subcritical").verdict() == "the bifurcation is subcritical"
    same = found(type="subcritical", onset="subcritical")
    assert same.verdict() == "the bifurcation is subcritical"
    other = found(type="subcritical", onset="supercritical").verdict()
    assert other.endswith("subcritical; small motions begin as in a supercritical one")


def marks(critical):
    axes = plt.figure().subplots()
    plots._mark(axes, critical)
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def test_critical_speeds_are_marked_in_metres_per_second_and_millimetres():
    line = OverAmplitude([1e-3, 2e-3, 4e-3], [None, 60.0, 5.0], [None, 1.0, 1.2])
    drawn = marks(
        found(
            linear=LinearLoss(61.0, 1.4, "hunting", None, 58.0),
            linear_over_amplitude=line,
            nonlinear={
                "bifurcation": Point(50.0, 5e-3, 1.1),
                "ramp": None,
                "threshold": Point(44.0, 2e-3, 1.0, stable=False),
            },
        )
    )
    upright = {name: xy[0, 0] for name, xy in drawn.items() if len(xy) == 2}
    assert sorted(upright.values()) == [58.0, 61.0]
    assert upright["the same on rigid rails: 58.00 m/s"] == 58.0
    # not where it is unstable at the lower end of the range already
    expected = np.array([[np.nan, 1.0], [60.0, 2.0], [np.nan, 4.0]])
    over = drawn["linear, harmonic, over amplitude"]
    assert over == pytest.approx(expected, nan_ok=True)
    assert drawn["lowest by bifurcation: 50.00 m/s"] == pytest.approx(np.array([[50.0, 5.0]]))
    assert drawn["lowest by threshold: 44.00 m/s, unstable"].tolist() == [[44.0, 2.0]]
    assert len(drawn) == 5
    assert marks(found(linear_over_amplitude=OverAmplitude([1e-3], [None], [None]))) == {}


def test_the_range_of_speeds_reaches_beyond_hunting_and_its_jumps():
    """From 0.9 of the slowest one to 1.25 of the fastest, within the search."""
    branch = Branch(
        "up", [Point(45.0, 6e-3, 1.5), Point(40.0, 6e-3, 1.5), Point(30.0, 6e-3, 1.5, stable=False)]
    )
    one = found(branches=[branch], jumps=[Jump("up", 50.0, 1e-3, 7e-3)])
    assert plots._speed_range(one) == pytest.approx((36.0, 62.5))
    one.linear = LinearLoss(60.0, 1.0, "x")
    assert plots._speed_range(one) == pytest.approx((36.0, 75.0))
    one.linear = LinearLoss(30.0, 1.0, "x")
    assert plots._speed_range(one) == pytest.approx((27.0, 62.5))
    one.jumps = [Jump("up", 80.0, 1e-3, 7e-3)]
    assert plots._speed_range(one) == pytest.approx((27.0, 90.0))
    assert plots._speed_range(found(branches=[Branch("up", branch.points[2:])])) == (None, None)


def test_a_conicity_stands_beside_on_the_amplitudes_shown():
    """Up to 6 mm the largest is 0.3: the axis ends a tenth beyond it."""
    axes = plt.figure().subplots()
    plots._conicity(axes, Conicity("w", [1e-3, 5e-3, 7e-3], [0.1, 0.3, 0.9]))
    (line,) = axes.lines
    assert line.get_xydata() == pytest.approx(np.array([[0.1, 1.0], [0.3, 5.0], [0.9, 7.0]]))
    assert axes.get_xlim()[0] == 0.0
    fixed = plt.figure().subplots()
    fixed.set_ylim(0.0, 4.0)
    plots._conicity(fixed, Conicity("w", [1e-3, 5e-3, 7e-3], [0.1, 0.3, 0.9]))
    assert fixed.get_xlim() == pytest.approx((0.0, 0.33))


def test_without_branches_the_title_says_the_linear_critical_speed():
    def title(**given):
        return plots.bifurcation_figure(found(**given)).get_suptitle().splitlines()

    assert title()[0] == "coach"
    assert title()[1] == "straight track, rails 60E1, friction 0.4, linear"
    assert title()[-1] == "no linear critical speed from 5 to 90 m/s"
    assert title(unstable_at_low=True)[-1] == "unstable at 5 m/s, the lower end of the range"
    lost = title(linear=LinearLoss(61.0, 1.0, "hunting"))
    assert lost[-1] == "linear critical speed 61.00 m/s (hunting)"


def test_a_record_holds_what_is_known_as_plain_data():
    keys = "linear", "amplitude_limit", "instability_limit", "conicity_over_amplitude"
    empty = found().record()
    assert [empty[key] for key in (*keys, "nonlinear")] == [None] * 5
    point = Point(50.0, 5e-3, 1.1)
    whole = found(
        linear=LinearLoss(61.0, 1.4, "hunting"),
        nonlinear={"bifurcation": point, "ramp": None},
        amplitude_limit=Limit(66.0, 3e-3, True, 90.0),
        instability_limit=Limit(None, 8e3, False, 80.0),
        conicity_over_amplitude=Conicity("w", [1e-3], [0.1]),
    ).record()
    assert [
        whole[key][name]
        for key, name in zip(keys, ("speed", "speed", "searched_to", "conicity"), strict=True)
    ] == [61.0, 66.0, 80.0, [0.1]]
    assert whole["nonlinear_by_method"] == {"bifurcation": point.record(), "ramp": None}
    slowest = {"speed": 50.0, "amplitude": 5e-3, "frequency": 1.1, "stable": True}
    assert whole["nonlinear"] == {**slowest, "reached": True, "searched_to": 90.0}
    assert found(nonlinear={"ramp": None}).record()["nonlinear"]["reached"] is False
    assert json.loads(json.dumps(whole)) == whole


def test_branches_of_unequal_length_are_filled_up(monkeypatch):
    """As the package xarray takes them, which needs seconds to be imported."""
    package = SimpleNamespace(Dataset=lambda data, coordinates: (data, coordinates))
    monkeypatch.setattr(result, "optional_package", lambda *_: package)
    one, two = Point(50.0, 5e-3, 1.1), Point(60.0, 6e-3, 1.2)
    data, places = found(branches=[Branch("up", [one, two]), Branch("down", [two])]).to_xarray()
    dimensions, speeds = data["speed"]
    assert dimensions == ("branch", "point")
    assert speeds == pytest.approx(np.array([[50.0, 60.0], [60.0, np.nan]]), nan_ok=True)
    assert places == {"branch": ["up", "down"]}
    assert found().to_xarray()[0]["speed"][1].shape == (0, 0)


def test_conicity_is_looked_at_by_tenths_and_quarters_of_a_millimetre():
    """Tenths below 1 mm, where small limit cycles show, quarters up to 8 mm."""
    millimetres = 1e3 * OF_CONICITY
    assert millimetres[[0, 8, 9, -1]] == pytest.approx([0.1, 0.9, 1.0, 8.0])
    steps = np.diff(millimetres)
    assert steps[:9] == pytest.approx(0.1)
    assert steps[9:] == pytest.approx(0.25)


@pytest.mark.parametrize("first", [True, False])
def test_pieces_of_a_branch_are_dashed_where_unstable_and_reach_their_neighbours(first):
    """A point without a frequency is left out; one of single runs is marked and not divided."""
    kinds = [first, first, not first, not first, first]
    speeds = 10.0 * np.arange(1.0, 6.0)
    values = np.array([1.0, 2.0, 3.0, np.nan, 5.0])
    points = [Point(s, 1e-3, 1.0, stable=k) for s, k in zip(speeds, kinds, strict=True)]
    axes = plt.figure().subplots()
    plots._draw(axes, Branch("continuation", points), values)
    stable, unstable = axes.lines
    lines = {first: [1.0, 2.0, 3.0, np.nan], not first: [np.nan, np.nan, 3.0, 5.0]}
    lines[first][3] = 5.0  # the last piece is of one point
    for line, kind in ((stable, True), (unstable, False)):
        assert line.get_xdata().tolist() == [10.0, 20.0, 30.0, 50.0]
        assert line.get_ydata() == pytest.approx(lines[kind], nan_ok=True)
    assert stable.get_linestyle() == "-" != unstable.get_linestyle()
    assert stable.get_label() == "continuation, dashed: unstable" != unstable.get_label()
    marked = plt.figure().subplots()
    plots._draw(marked, Branch("up", points), values)
    (line,) = marked.lines
    assert line.get_ydata() == pytest.approx(values, nan_ok=True)
    assert line.get_linestyle() != "-"
    plots._draw(marked, Branch("up", [Point(s, 1e-3, 1.0) for s in speeds]), values)
    assert marked.lines[1].get_linestyle() == "-"


@dataclass(frozen=True)
class Seen:
    """Lateral motions in their last row, above them twice the frequencies."""

    lateral: np.ndarray

    @property
    def frequency(self):
        return float(self.lateral[0, 0]) / 2.0


@pytest.mark.parametrize(
    ("frequencies", "words"),
    [
        ([1.0, 1.2, 9.0], "the wheelsets hunt with 1.00, 1.20 Hz"),
        ([1.0, 1.0, 9.0], "shooting"),
        ([1.0, 1.0 - 0.9 * continuation.APART, 9.0], "shooting"),
        ([1.0, 1.0 - 1.1 * continuation.APART, 9.0], "the wheelsets hunt with 1.00"),
    ],
)
def test_wheelsets_that_hunt_apart_are_told(frequencies, words):
    """Of the third the motion is too small to tell its frequency."""
    lateral = 2.0 * np.array([frequencies, frequencies])
    lateral[1] += 2.0 * continuation.FIRST * np.array([1.1, -1.1, 0.9])
    motion = SimpleNamespace(stretch=lambda state, low, high, time: Seen(lateral))
    found = continuation._why(motion, Point(50.0, 5e-3, 1.1))
    assert words in found
    assert "9.00" not in found
