"""`railsim plot` and `railsim compare` on the folders of studies."""

import csv
import json
import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from example_result import example_result, feed
from selection import points
from test_study import COACH, CURVE
from test_study import simulated as simulated

import railsim
import railsim.studies.case
import railsim.studies.gathered
from railsim.cli import main
from railsim.compare import differences
from railsim.plot.study import Column, curves_figure, map_figure, ranking_figure
from railsim.studies.gathered import Gathered
from railsim.studies.picture import _combine, study_figure

SPEEDS = [10.0, 12.0]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "s"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            railsim.studies.case, "simulate", lambda *_, speed, sink, **how: feed(sink, speed=speed)
        )
        railsim.study([COACH, "coach_flexicoil"], CURVE, SPEEDS, out=out, workers=1,
                      grid={"track.friction": [0.3, 0.4]})  # fmt: skip
    return out


@pytest.fixture
def folder(made, tmp_path):
    """A copy of it, to write to."""
    return Path(shutil.copytree(made, tmp_path / "s"))


@points("chosen", [[], ["--kind", "map"], ["Y_over_Q_peak", "--kind", "ranking"]], always=(1, 2))
def test_study_is_drawn(folder, capsys, chosen):
    assert main(["plot", str(folder), *chosen]) == 0
    assert capsys.readouterr().out.strip() == str(folder / "study.png")
    assert (folder / "study.png").stat().st_size > 5000


def test_medians_mix_no_vehicles_and_say_what_else(folder):
    """A curve for each vehicle and track; the friction is in the bands, and that is said."""
    figure = study_figure(folder, ("Y_peak",))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "coach_flexicoil", "coach_manchester"
    ]  # fmt: skip
    assert "Not told apart: track.friction (options" in figure.get_suptitle()
    by_friction = study_figure(folder, ("Y_peak",), family="track.friction")
    assert "Not told apart: vehicle (options" in by_friction.get_suptitle()
    both = _combine([Column("Vehicle", ["a", "b"]), Column("Track", ["t", "u"])])
    assert (both.words, both.values) == ("Vehicle, Track", ["a, t", "b, u"])


def test_the_axis_is_the_parameter_of_most_values_but_words_and_seeds(tmp_path, monkeypatch):
    """Three speeds before two frictions; four vehicles and five seeds have more, but no order."""
    labels = [
        {"vehicle": v, "track.irregularities.0.seed": seed, "track.friction": mu, "speed": speed}
        for v, seed, mu, speed in product("abcd", range(5), (0.3, 0.4), (10.0, 12.0, 14.0))
    ]
    records = [
        {"name": f"run{k}", "status": "complete", "labels": row, "quantities": {"rise": 1.0 * k}}
        for k, row in enumerate(labels)
    ]

    def across(*without):
        for row in labels:
            row.update(dict.fromkeys(without, 0))
        figure = study_figure(tmp_path, kind="curves")
        return {axes.get_xlabel() for axes in figure.axes}

    monkeypatch.setattr(railsim.studies.picture, "gather", lambda _: Gathered(records))
    assert across() == {"speed (m/s)"}
    assert across("speed") == {"friction"}
    assert across("track.friction") == {"vehicle"}
    assert across("vehicle") == {"seed"}


@pytest.mark.parametrize("speeds", [SPEEDS, SPEEDS[:1]])
def test_seeds_are_no_axis(speeds, tmp_path, monkeypatch):
    """They have no order: runs over a seed alone are ranked, others are over what else varies."""
    monkeypatch.setattr(
        railsim.studies.case, "simulate", lambda *_, speed, sink, **how: feed(sink, speed=speed)
    )
    rails = 'track.irregularities=[{type="random", spectrum="erri_b176_low"}]'
    railsim.study(COACH, CURVE, speeds, out=tmp_path / "s", workers=1, assignments=[rails],
                  grid={"track.irregularities.0.seed": [1, 2, 3]})  # fmt: skip
    figure = study_figure(tmp_path / "s")
    labels = {axes.get_xlabel() for axes in figure.axes}
    assert ("speed (m/s)" in labels) == (len(speeds) > 1)
    assert not any("seed" in words for words in labels)


@points(
    ("chosen", "across"), [(["vehicle", None], "vehicle"), ([None, "vehicle"], "seed")], always=(1,)
)
def test_words_and_seeds_are_axes_if_asked_for(chosen, across, tmp_path, monkeypatch):
    """Though they have no order: no ranking of the runs takes the place of what was asked for."""
    monkeypatch.setattr(
        railsim.studies.case, "simulate", lambda *_, speed, sink, **how: feed(sink, speed=speed)
    )
    rails = 'track.irregularities=[{type="random", spectrum="erri_b176_low"}]'
    railsim.study([COACH, "coach_flexicoil"], CURVE, 10.0, out=tmp_path, workers=1,
                  assignments=[rails], grid={"track.irregularities.0.seed": [1, 2]})  # fmt: skip
    figure = study_figure(tmp_path, ("Q_peak",), against=chosen[0], family=chosen[1])
    assert {axes.get_xlabel() for axes in figure.axes} == {across}


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (["Y_over_Q_ab"], "did you mean 'Y_over_Q_abs'"),
        (["Y_over_P_peak"], "QUANTITY: Y_over_P_peak: no such value"),
        (["--against", "fricton"], "'fricton' was not varied; did you mean 'track.friction'"),
        (["--against", "speed", "--family", "speed"], "--family: 'speed' as --against"),
        (["--kind", "ranking", "--family", "speed"], "--kind: 'ranking' with --against"),
    ],
)
def test_what_the_study_lacks_is_refused(folder, capsys, chosen, words):
    assert main(["plot", str(folder), *chosen]) == 2
    assert words in capsys.readouterr().err
    assert not (folder / "study.png").exists()


def test_python_draws_and_reports_what_the_command_does(folder, tmp_path, capsys):
    """A folder that is opened again gives the summary, the picture and the page of the command."""
    outcome = railsim.open_study(folder)
    assert repr(outcome) == f"<Outcome: {folder}, 8 complete>"
    speeds = outcome.to_dataframe()["speed"]
    assert (sorted(set(speeds)), len(outcome.results())) == (SPEEDS, len(speeds))
    chosen = {"against": "track.friction", "family": "speed"}
    path = tmp_path / "s.svg"
    figure = outcome.plot("Y_over_Q_abs", **chosen, path=path)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert (texts, path.exists()) == (["10", "12"], True)
    with pytest.raises(railsim.InputError, match="against: 'friction' was not varied"):
        outcome.plot(against="friction")
    with pytest.raises(railsim.InputError, match="'pie'; allowed: curves, map, ranking"):
        outcome.plot(kind="pie")
    page = railsim.write_report(folder, tmp_path / "python.html")
    assert main(["report", str(folder), "--out", str(tmp_path / "command.html")]) == 0
    assert page.read_text() == (tmp_path / "command.html").read_text()
    with pytest.raises(railsim.InputError, match="exists"):
        railsim.write_report([folder], page)
    with pytest.raises(railsim.InputError, match="files: none; a result file or a folder"):
        railsim.write_report([], tmp_path / "empty.html")
    with pytest.raises(railsim.InputError, match=r"files: found <Outcome: .*>; the path of"):
        railsim.write_report(outcome, tmp_path / "empty.html")
    with pytest.raises(railsim.InputError, match="curves: found -1; 1 to 16"):
        railsim.write_report(folder, tmp_path / "empty.html", curves=-1)
    assert main(["report", str(folder), "--curves", "17", "--out", str(tmp_path / "e.html")]) == 2
    assert "--curves: found 17; 1 to 16" in capsys.readouterr().err
    with pytest.raises(railsim.InputError, match="no results in this folder"):
        railsim.open_study(tmp_path / "none")


def test_medians_over_a_full_curve_are_called_as_in_the_summary(folder):
    """Not the values at its middle, which the summary calls `_mid`."""
    with open(folder / "summary.csv", encoding="utf-8") as stream:
        runs = list(csv.DictReader(stream))
    medians = [1e-3 * float(run["Q_median (N)"]) for run in runs]
    for name in ("Q_median", "Q_mid1"):
        figure = study_figure(folder, (name,), kind="ranking")
        (axes,) = figure.axes
        drawn = sorted(bar.get_width() for bar in axes.patches)
        assert drawn == pytest.approx(sorted(medians), rel=1e-5)


@points("kind", ["curves", "map", "ranking"], always=(0,))
def test_runs_that_ended_early_are_counted_above_the_picture(folder, kind):
    index = json.loads((folder / "study.json").read_text())
    assert study_figure(folder, kind=kind).get_suptitle().count("early") == 0
    index["runs"][0]["status"] = "derailed"
    (folder / "study.json").write_text(json.dumps(index))
    figure = study_figure(folder, kind=kind)
    crosses = " (crosses)" if kind == "curves" else ""
    words = f"1 of 8 runs ended early{crosses}: their values until then"
    assert words in figure.get_suptitle().splitlines()
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert sum(name.endswith("(derailed)") for name in names) == (kind == "ranking")


@pytest.mark.parametrize("kind", ["curves", "map", "ranking"])
def test_picture_of_a_study_says_what_it_is_called_and_what_all_its_runs_have(folder, kind):
    title = study_figure(folder, kind=kind).get_suptitle()
    assert title.splitlines()[0] == f"s: {Path(CURVE).stem}"  # vehicle and speed were varied


@pytest.mark.parametrize("file", ["", "study.json", "summary.csv"])
def test_what_was_varied_has_its_unit_without_results_too(tmp_path, simulated, file):
    masses = {"vehicle.carbody.mass": [3e4, 4e4]}
    railsim.study([COACH], CURVE, [10.0], grid=masses, keep="summary", out=tmp_path, workers=1)
    figure = study_figure(tmp_path / file, kind="curves")
    assert "carbody.mass (kg)" in [axes.get_xlabel() for axes in figure.axes]


def test_parameters_of_a_study_are_refused_of_a_track(tmp_path, capsys):
    out = str(tmp_path / "t.png")
    assert main(["plot", "curve_r250", "--kind", "map", "--out", out]) == 2
    assert "'curve_r250' is no study's folder" in capsys.readouterr().err


VALUES = Column("value", [1.0, 2.0, 3.0, 4.0, None])
SPEED = Column("speed (m/s)", [10.0, 20.0, 10.0, 20.0, 20.0])
VEHICLE = Column("vehicle", ["a", "a", "b", "b", "b"])


def test_curves_and_bands_hold_the_values():
    figure = curves_figure([VALUES], SPEED, VEHICLE)
    first, second = figure.axes[0].get_lines()
    assert first.get_xydata().tolist() == [[10.0, 1.0], [20.0, 2.0]]
    assert second.get_xydata().tolist() == [[10.0, 3.0], [20.0, 4.0]]
    (middle,) = curves_figure([VALUES], SPEED, None).axes[0].get_lines()
    assert middle.get_ydata().tolist() == [2.0, 3.0]  # medians of 1 and 3, 2 and 4
    figure = curves_figure([VALUES], SPEED, VEHICLE, [False, True, False, False, True])
    (cross,) = [line for line in figure.axes[0].get_lines() if line.get_marker() == "x"]
    assert cross.get_xydata().tolist() == [[20.0, 2.0]]  # the last of them has no value
    stiff = Column("k (N/m)", [31.391e6, 31.391e6, 8e6, 8e6, 8e6])
    texts = curves_figure([VALUES], SPEED, stiff).legends[0].get_texts()
    assert [text.get_text() for text in texts] == ["8e6", "31.391e6"]
    figure = curves_figure([VALUES], VEHICLE, None)
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()] == ["a", "b"]


def test_points_of_a_sample_are_drawn_where_they_are():
    """A map of six points without common coordinates would have 36 cells, 30 of them empty."""
    x, y = [0.31, 0.12, 0.55, 0.44, 0.2, 0.05], [7.0, 9.0, 1.0, 4.0, 2.5, 8.0]
    drawn = Column("Q", [1.0, 2.0, 3.0, 4.0, 5.0, None])
    axes = map_figure([drawn], Column("x", x), Column("y", y)).axes[0]
    (dots,) = axes.collections
    found = zip(*np.transpose(dots.get_offsets()), dots.get_array(), strict=True)
    assert (
        sorted(found, key=lambda point: point[2]) == list(zip(x, y, drawn.values, strict=True))[:5]
    )
    assert not axes.get_images()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x", "y")


@pytest.mark.parametrize(("filled", "is_map"), [(9, True), (5, True), (4, False)])
def test_numbers_over_two_parameters_are_a_map_where_half_of_the_grid_is_there(filled, is_map):
    places = [(a, b) for a in (1.0, 2.0, 3.0) for b in (10.0, 20.0, 30.0)]
    chosen = [places[k] for k in (0, 4, 8, 1, 2, 3, 5, 6, 7)[:filled]]  # three of each
    x, y = zip(*chosen, strict=True)
    drawn = Column("Q", [1.0] * filled)
    axes = map_figure([drawn], Column("x", list(x)), Column("y", list(y))).axes[0]
    assert bool(axes.get_images()) is is_map


def test_map_and_ranking_hold_the_values():
    image = map_figure([VALUES], SPEED, VEHICLE).axes[0].get_images()[0]
    assert image.get_array().tolist() == [[1.0, 2.0], [3.0, 4.0]]
    large = Column("value", [1571.3, 0.5643, 3.0, 4.0, None])
    texts = map_figure([large], SPEED, VEHICLE).axes[0].texts
    assert [text.get_text() for text in texts] == ["1570", "0.564", "3", "4"]
    small = Column("force (kN)", [-4e-9, 9.0, 16.4567, 28123.0, None], decimals=2)
    texts = ranking_figure([small], ["p", "q", "r", "s", "t"]).axes[0].texts
    assert [text.get_text() for text in texts] == ["28123", "16.46", "9.00", "0.00"]
    axes = ranking_figure([VALUES], ["p", "q", "r", "s", "t"]).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [4.0, 3.0, 2.0, 1.0]
    assert [t.get_text() for t in axes.get_yticklabels()] == ["s", "r", "q", "p"]


def test_rounding_errors_are_no_colours_and_no_curves():
    """Forces of 4e-12 kN, printed as 0.00, are one colour and a level line."""
    noise = Column("force (kN)", [4e-12, -3e-12, 1e-12, 2e-12, None], decimals=2)
    shown = Column("force (kN)", [0.0, 0.03, 0.01, 0.02, None], decimals=2)
    drawn = [map_figure([one], SPEED, VEHICLE).axes[0].get_images()[0] for one in (noise, shown)]
    assert [image.get_clim() for image in drawn] == [pytest.approx((-0.01, 0.01)), (0.0, 0.03)]
    limits = curves_figure([noise], SPEED, VEHICLE).axes[0].get_ylim()
    bars = ranking_figure([noise], ["p", "q", "r", "s", "t"]).axes[0].get_xlim()
    assert [limits, bars] == [pytest.approx((-0.01, 0.01))] * 2


def test_pictures_name_the_medians_of_runs_that_share_a_point():
    once = Column("value", [1.0, 2.0, 3.0, 4.0])
    speed, vehicle = Column("speed (m/s)", SPEED.values[:4]), Column("vehicle", VEHICLE.values[:4])
    several = [curves_figure([VALUES], SPEED, None), map_figure([VALUES], SPEED, SPEED)]
    assert all(f.get_suptitle().startswith("Medians of the runs") for f in several)
    single = [curves_figure([once], speed, vehicle), map_figure([once], speed, vehicle)]
    assert [f.get_suptitle() for f in single] == ["", ""]


def test_runs_that_differ_in_the_vehicle_are_compared(folder, capsys):
    assert main(["compare", str(folder), "--json"]) == 0
    groups = json.loads(capsys.readouterr().out)["groups"]
    assert [group["group"] for group in groups] == [
        f"{CURVE}_{v:g}_friction={f}" for v in SPEEDS for f in (0.3, 0.4)
    ]
    assert all(group["results"] == [COACH, "coach_flexicoil"] for group in groups)


def test_runs_of_the_same_name_are_compared(tmp_path, simulated, capsys, undrawn):
    for name, speeds in (("before", [10.0, 12.0]), ("after", [12.0])):
        railsim.study(COACH, CURVE, speeds, out=tmp_path / name, workers=1)
    out = tmp_path / "c"
    folders = [str(tmp_path / name) for name in ("before", "after")]
    with undrawn():
        assert main(["compare", *folders, "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "1 runs of" in printed.err
    assert "along the track, leading wheelset" in printed.out
    assert {path.name for path in out.iterdir()} == {
        "compare.csv", "compare.json", "compare.png", "differences.png"
    }  # fmt: skip


def test_what_cannot_be_compared_is_refused_with_the_reason(tmp_path, simulated, capsys):
    railsim.study(COACH, CURVE, SPEEDS, out=tmp_path / "s", workers=1)
    railsim.study(COACH, CURVE, [20.0], out=tmp_path / "o", workers=1, keep="summary")
    s, o = str(tmp_path / "s"), str(tmp_path / "o")
    for given, words in (
        ([s], "no two runs differ in nothing but the vehicle"),
        ([o], "no result files"),
        ([s, o], "no result that all folders have"),
        ([s, str(tmp_path / "s" / f"{COACH}_{CURVE}_10.h5")], "results and folders together"),
    ):
        assert main(["compare", *given]) == 2
        assert words in capsys.readouterr().err


def test_difference_along_the_track_is_that_of_the_values():
    base, other = example_result(), example_result(gain=0.9)
    found = differences({"base": base, "lower": other}, ["Y", "wheelset_yaw"])
    assert [one.labels.get("side") for one in found] == ["left", "right", None]
    for k in (0, 1):
        assert found[k].values == pytest.approx(-0.1 * base.Y[:, 0, k], abs=1e-9)
    value, s = found[2].largest
    yaw = base["wheelset_yaw"][:, 0]
    assert abs(value) == pytest.approx(0.1 * np.max(np.abs(yaw)))
    assert np.interp(s, base["distance"], np.abs(yaw)) == pytest.approx(np.max(np.abs(yaw)))


def test_categories_are_not_joined_and_their_names_do_not_collide():
    names = [f"coach_of_a_long_name_{k}" for k in range(6)]
    x = Column("vehicle", [name for name in names for _ in range(3)])
    value = Column("largest Y/Q", [0.1 * k for k in range(18)])
    figure = curves_figure([value], x, None)
    axes = figure.axes[0]
    assert all(line.get_linestyle() == "None" for line in axes.lines)
    assert len(axes.collections) == 1  # bars from the smallest to the largest
    figure.draw_without_rendering()
    angles = {label.get_rotation() for label in axes.get_xticklabels()}
    assert angles == {30.0}
    ends = [label.get_window_extent().x1 for label in axes.get_xticklabels()]
    height = axes.get_xticklabels()[0].get_fontsize() * figure.dpi / 72.0
    # side by side at 30 degrees: further apart than a letter is high over sin 30
    assert np.diff(ends).min() > 2.0 * height
