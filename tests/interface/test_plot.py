"""``railsim plot``: what the lines, limits and shades of a figure are made from."""

import json
import os
import re
from types import SimpleNamespace

import numpy as np
import pytest
from example_result import WHEELSETS, example_result
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import railsim
from railsim.animation import result_scene
from railsim.cli import main
from railsim.definitions.excitations.measured_file import recordings
from railsim.definitions.loading import load_track
from railsim.definitions.track.layout import curvature_sections
from railsim.errors import InputError
from railsim.files.sources import read_source
from railsim.notation import QUANTITIES
from railsim.plot.curving import _split_hands, curving_figure
from railsim.plot.histories import STUDY, frame, histories
from railsim.plot.overlay import overlay
from railsim.plot.recording import recording_figure
from railsim.plot.style import (
    DISTINCT,
    HUES,
    SHADES,
    distinct,
    label_grid,
    shade,
    spans,
    to_bytes,
    wheelset_looks,
)
from railsim.plot.track import track_figure
from railsim.report.runs import page
from railsim.result import Result
from railsim.result.export import selected
from railsim.result.extremes import mid_curves
from railsim.track.irregularity import displacement


@pytest.fixture(scope="module")
def result():
    return example_result()


@pytest.fixture(scope="module")
def file(tmp_path_factory, result):
    return result.to_hdf5(tmp_path_factory.mktemp("plot") / "run.h5")


def drawn(axes):
    """Lines with data: neither the zero line nor a limit."""
    return [line for line in axes.lines if len(line.get_xdata()) > 2]


def shades(axes):
    return [
        (patch.get_x(), patch.get_x() + patch.get_width(), to_hex(patch.get_facecolor()))
        for patch in axes.patches
    ]


def test_figures_of_the_study_are_the_default(result):
    axes = histories(result).axes
    assert len(axes) == len(STUDY)
    labels = [each.get_ylabel() for each in axes]
    units = ["(%)", "(kN)", "Y/Q", "(mrad)", "(mm)", "(mrad)"]
    assert all(unit in label for unit, label in zip(units, labels, strict=True))


def test_creepages_are_in_thousandths_as_print_has_them(result):
    assert histories(result, ["xi_x"]).axes[0].get_ylabel().endswith("(10⁻³)")


def test_title_says_how_a_run_ended_early():
    for status, words in (("complete", "(72 km/h)"), ("derailed", "(72 km/h) · derailed")):
        assert histories(example_result(status=status)).get_suptitle().endswith(words)


def test_title_says_the_friction_left_and_right():
    """Runs on dry and on wet rails had the same title."""
    for given, words in (("0.12", "0.12"), ("[0.35, 0.15]", "0.35 / 0.15")):
        run = example_result()
        facts = {"track_toml": load_track("straight", [f"friction={given}"]).to_toml()}
        facts = {**run.attributes, **facts}
        run = Result({n: run[n] for n in run}, run.quantities, run.coordinates, facts)
        assert f" · friction {words} · 20 m/s" in histories(run).get_suptitle()
        assert f"friction {words}" in overlay({"a": run, "b": run}).get_suptitle()
    table = load_track("straight", ["friction_table=[[0, 0.4, 0.2], [9, 0.1, 0.3]]"])
    assert table.friction_words == "0.1 to 0.4"


def test_what_a_wheelset_has_once_is_not_drawn_as_its_left_wheel(result):
    """With axes for each wheelset the colours of the legend are those of the wheels."""
    for axes in histories(result, ["sum_Y"], by="wheelset").axes:
        (line,) = drawn(axes)
        assert to_hex(line.get_color()) not in {to_hex(colour) for colour in DISTINCT}


def test_of_a_grid_the_lowest_axes_and_the_first_of_each_row_are_labelled():
    """Five of two rows of three, and two of one row."""
    for count, below, beside in ((5, [2, 3, 4], [0, 3]), (2, [0, 1], [0])):
        axes = Figure().subplots(1 + count // 3, 3).ravel()
        label_grid(axes, count, 3, ("x", "y"))
        used = [one for one in axes if one.get_visible()]
        assert used == list(axes[:count])
        assert [used.index(one) for one in used if one.get_xlabel() == "x"] == below
        assert [used.index(one) for one in used if one.get_ylabel() == "y"] == beside


def test_a_limit_is_within_its_axes_where_the_values_are_rounding_errors():
    """Else its words, far outside, leave no room for the axes."""
    slow = selected(example_result(speed=3.0), ["dQ_over_Q0"])
    still = {name: slow[name] * (1e-12 if name == "dQ_over_Q0" else 1.0) for name in slow}
    result = Result(still, slow.quantities, slow.coordinates, slow.attributes)
    figures = histories(result, ["dQ_over_Q0"]), overlay({"one": result}, ["dQ_over_Q0"])
    for figure in figures:
        low, high = figure.axes[0].get_ylim()
        assert low < -60.0 < 0.0 < high


def test_a_limit_near_the_largest_value_is_not_on_the_edge(result):
    """Values up to 0.76 had an axis up to 0.8017: the line at 0.8 was cut."""
    low, high = result["Y_over_Q"][:, 0].min(), result["Y_over_Q"][:, 0].max()
    scale = 0.8017 / (high + 0.05 * (high - low))  # matplotlib adds 5 %
    arrays = {name: result[name] * (scale if name == "Y_over_Q" else 1.0) for name in result}
    near = Result(arrays, result.quantities, result.coordinates, result.attributes)
    axes = overlay({"one": near}, ["Y_over_Q:1"]).axes[0]
    low, high = axes.get_ylim()
    assert high - 0.8 > 0.03 * (high - low)


def test_wheelsets_that_were_not_chosen_leave_no_gap(result):
    """A picture of one wheelset was as wide as one of four."""
    width = [histories(result, (name,), by="wheelset").get_figwidth() for name in ("Q:1", "Q")]
    assert width[0] < 0.5 * width[1]
    for axes in histories(result, ("Q:1", "Y:2"), by="wheelset").axes:  # each alone in its row
        assert axes.yaxis.get_tick_params()["labelleft"]


def test_titles_name_the_load_case():
    """A laden run, called by the vehicle's name alone, was taken for one as the file has it."""
    run = example_result()
    loaded = run.attributes["vehicle_toml"].replace("\nsource =", '\nload = "laden"\nsource =', 1)
    facts = {**run.attributes, "vehicle_toml": loaded}
    laden = Result({n: run[n] for n in run}, run.quantities, run.coordinates, facts)
    name = f"{run.vehicle().name}, load case laden"
    assert histories(laden).get_suptitle().startswith(name)
    assert laden.title.startswith(name)
    assert overlay({"a": laden, "b": laden}).get_suptitle().startswith(name)
    assert name.partition(", load")[0] not in overlay({"a": laden, "b": run}).get_suptitle()
    text = loaded.replace(f'"{run.vehicle().name}"', '"Another"', 1)
    other = Result(
        {n: run[n] for n in run}, run.quantities, run.coordinates, {**facts, "vehicle_toml": text}
    )
    assert overlay({"a": laden, "b": other}).get_suptitle().startswith("load case laden · ")


@pytest.mark.parametrize("mode", ["constant", "table"])
def test_titles_call_a_speed_that_varies_that_at_the_start(mode):
    """Of pictures, animations and the result itself."""
    rows = {"speed_table": [[0.0, 20.0], [900.0, 30.0]]} if mode == "table" else {}
    settings = railsim.Settings.model_validate({"drive": {"mode": mode, **rows}})
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    run = railsim.simulate(coach, track, speed=20.0, duration=0.1, settings=settings)
    words = "20 m/s (72 km/h)" + " at the start" * (mode == "table")
    for title in (histories(run).get_suptitle(), run.title, result_scene(run).title):
        assert title.endswith(words)


def test_of_a_result_without_the_figures_of_the_study_everything_is_drawn(result):
    axes = histories(selected(result, ["Q"])).axes
    assert [ax.get_title(loc="left") or ax.get_title() for ax in axes] == ["Vertical wheel force"]


def test_lines_are_the_arrays_in_shown_units(result):
    (axes,) = histories(result, ["dQ_over_Q0"]).axes
    lines = drawn(axes)
    assert len(lines) == 8
    np.testing.assert_array_equal(lines[1].get_xdata(), result.distance)
    np.testing.assert_array_equal(lines[1].get_ydata(), 100.0 * result.dQ_over_Q0[:, 0, 1])


def test_sides_and_wheelsets_are_told_apart(result):
    (axes,) = histories(result, ["Y"]).axes
    lines = drawn(axes)
    assert {line.get_linestyle() for line in lines[0::2]} == {"-"}  # left
    assert {line.get_linestyle() for line in lines[1::2]} == {"--"}  # right
    assert len({to_hex(line.get_color()) for line in lines}) == 4


def test_axes_of_rounding_errors_show_the_last_digit_of_tables():
    axes = Figure().subplots()
    axes.plot([0.0, 1.0], [-3e-13, 2e-13])
    frame(axes, QUANTITIES["sum_Y"], "sum Y")
    np.testing.assert_allclose(axes.get_ylim(), (-0.01, 0.01), rtol=1e-9)  # kN
    axes.plot([0.0, 1.0], [0.0, 5.0])
    axes.autoscale()
    before = axes.get_ylim()
    frame(axes, QUANTITIES["sum_Y"], "sum Y")
    assert axes.get_ylim() == before


def test_as_many_results_as_can_be_told_have_colours_of_their_own():
    colours = [distinct(number) for number in range(16)]
    assert colours[:8] == list(DISTINCT)
    assert len(set(colours)) == 16


def test_bogies_have_a_hue_and_their_leading_wheelsets_the_dark_shade():
    looks = wheelset_looks(WHEELSETS).values()
    colours = [to_hex(look["color"]) for look in looks]
    assert colours == [HUES[0][0], HUES[0][1], HUES[1][0], HUES[1][1]]
    assert [look["marker"] for look in looks] == [".", ".", "o", "o"]
    single = wheelset_looks(["front", "rear"]).values()
    assert len({(look["color"], look["marker"]) for look in single}) == 2


def test_bogies_differ_in_black_and_white_in_curves_and_legend(result):
    """Their hues have nearly one grey: #56a8e0 and #f0a13c 151 and 173 of 255."""
    figure = histories(result, ["sum_Y"])
    drawn = figure.axes[0].lines[:4]
    assert [line.get_marker() for line in drawn] == [".", ".", "o", "o"]
    assert all(0 < line.get_markevery()[0] < line.get_markevery()[1] for line in drawn)
    keys = figure.legends[0].get_lines()[:4]
    assert [line.get_marker() for line in keys] == [".", ".", "o", "o"]


def test_curve_and_transitions_are_shaded_where_they_are(result):
    (axes,) = histories(result, ["Y"]).axes
    transition, curve = (to_hex(SHADES[kind]) for kind in ("CLO", "CIR"))
    assert shades(axes) == [
        (300.0, 360.0, transition),
        (360.0, 420.0, curve),
        (420.0, 480.0, transition),
    ]
    assert [text.get_text() for text in axes.texts][:3] == ["CLO", "R 250", "CLO"]


def test_a_circle_of_infinite_radius_is_straight_in_pictures_and_peaks(result):
    plan = '[{type = "CIR", length = 500.0, radius = inf}]'
    text = f'format = "railsim-track/1"\nname = "flat"\nplan = {plan}\n'
    attributes = {**result.attributes, "track_toml": text}
    arrays = {name: result[name] for name in result}
    flat = Result(arrays, result.quantities, result.coordinates, attributes, result.profiles)
    assert shades(histories(flat, ["Y"]).axes[0]) == []
    assert not mid_curves(flat)
    assert not any(t.get_text().startswith("R ") for t in track_figure(flat.track()).axes[0].texts)
    assert page("t", [], {"flat": flat})


def test_where_names_do_not_fit_side_by_side_those_of_curves_stay():
    axes = Figure(figsize=(3.0, 2.0)).subplots()
    axes.set_xlim(0.0, 3000.0)
    sections = curvature_sections(load_track("curve_r250"))
    shade(axes, spans(sections, *[np.array([0.0, 980.0])] * 2), with_names=True)
    assert [text.get_text() for text in axes.texts] == ["R 250"]
    axes = Figure(figsize=(6.0, 2.0)).subplots()
    axes.set_xlim(0.0, 420.1)  # the curve ends 0.1 m before, and nothing of the transition is seen
    shade(axes, spans(sections, *[np.array([0.0, 420.1])] * 2), with_names=True)
    assert [text.get_text() for text in axes.texts] == ["CLO", "R 250"]


def test_a_long_title_is_on_lines_within_the_picture(result):
    words = "A vehicle whose name is so long that no picture holds it on one line of its title. "
    attributes = {**result.attributes, "vehicle_toml": result.attributes["vehicle_toml"].replace(
        "Passenger coach, Manchester primary suspension", 2 * words)}  # fmt: skip
    held = {name: result.quantities[name] for name in ("time", "distance", "Q")}
    arrays = {name: result[name] for name in held}
    figure = histories(Result(arrays, held, result.coordinates, attributes))
    figure.draw_without_rendering()
    assert figure._suptitle.get_window_extent().x1 <= figure.bbox.x1
    assert figure.get_suptitle().replace("\n", " ").startswith((2 * words).strip())


def test_curves_are_named_above_the_first_row_alone_and_where_all_have_them(result):
    def named(axes):
        return [text.get_text() for text in axes.texts if text.get_text() in ("CLO", "R 250")]

    upper, lower = histories(result, ["Y:1:left", "Q:1:left"]).axes
    assert named(upper) == ["CLO", "R 250", "CLO"]
    assert named(lower) == []
    assert shades(upper) == shades(lower) != []
    other = example_result()
    wider = other.attributes["track_toml"].replace("radius = 250.0", "radius = 260.0")
    other = Result(
        {name: other[name] for name in other},
        other.quantities,
        other.coordinates,
        {**other.attributes, "track_toml": wider},
    )
    for results, words in (((result, result), 3), ((result, other), 0)):
        axes = overlay(dict(zip("ab", results, strict=True)), ["Y:1:left"]).axes[0]
        assert len(named(axes)) == words
        assert len(shades(axes)) == 3


def test_over_time_the_shades_are_where_the_reference_body_was(result):
    (axes,) = histories(result, ["Y"], over="time").axes
    ranges = [(low, high) for low, high, _ in shades(axes)]
    np.testing.assert_allclose(ranges, [(15.0, 18.0), (18.0, 21.0), (21.0, 24.0)])
    np.testing.assert_array_equal(drawn(axes)[0].get_xdata(), result.time)


@pytest.mark.parametrize(
    ("name", "speed", "value", "there"),
    [
        ("Y_over_Q", 20.0, 0.8, True),
        ("dQ_over_Q0", 3.0, -60.0, True),
        # wheel unloading of 60 % is the limit of a test on twisted track at walking speed
        ("dQ_over_Q0", 20.0, -60.0, False),
    ],
)
def test_limits_are_drawn_where_they_apply(name, speed, value, there):
    (axes,) = histories(example_result(speed=speed), [name]).axes
    levels = [line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
    assert (value in levels) == there
    assert any("EN 14363" in text.get_text() for text in axes.texts) == there


def test_part_of_the_axis(result):
    (axes,) = histories(result, ["Y:1:left"], between=(300.0, 480.0)).axes
    shown = drawn(axes)[0].get_xdata()
    assert shown[0] >= 300.0
    assert shown[-1] <= 480.0
    with pytest.raises(InputError, match="goes from 0 to 980"):
        histories(result, ["Y"], between=(2000.0, 3000.0))


def test_labels_are_chosen_by_name_or_number(result):
    for selection in ("Y:2:right", "Y:front.inner.wheelset:right", "Y:right:2"):
        (axes,) = histories(result, [selection]).axes
        (line,) = drawn(axes)
        np.testing.assert_array_equal(line.get_ydata(), 1e-3 * result.Y[:, 1, 1])


def test_components_get_axes_with_their_own_units(result):
    axes = histories(result, ["body_position:carbody"]).axes
    assert [each.get_ylabel().split()[-1] for each in axes] == ["(mm)"] * 3 + ["(mrad)"] * 3
    np.testing.assert_array_equal(
        drawn(axes[5])[0].get_ydata(), 1e3 * result.body_position[:, 0, 5]
    )


def test_by_wheelset_every_wheelset_has_its_axes(result):
    axes = histories(result, ["Y", "Q"], by="wheelset").axes
    assert len(axes) == 8
    assert all(len(drawn(each)) == 2 for each in axes)
    assert "3 rear.inner" in axes[2].get_title(loc="left")


@pytest.mark.parametrize(
    ("selection", "words"),
    [
        ("wheelset_jaw", "did you mean 'wheelset_yaw'"),
        ("Q:5", "no label '5'"),
        ("Q:rigth", "did you mean 'right'"),
        ("Q0", "no quantity 'Q0'"),
        ("time", "no quantity 'time'"),
    ],
)
def test_what_a_result_does_not_have_is_refused(file, tmp_path, selection, words, capsys):
    out = tmp_path / "x.png"
    assert main(["plot", str(file), selection, "--out", str(out)]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()


def test_a_list_in_place_of_names_is_refused(result):
    with pytest.raises(InputError, match="no quantity '\\['Q'\\]'"):
        result.plot(["Q"])


@pytest.mark.parametrize("name", [".", "..", "/", ""])
def test_folder_is_not_drawn(name, capsys, tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert main(["plot", name]) == 2
    assert "folder" in capsys.readouterr().err


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_picture_has_the_format_of_its_ending(file, tmp_path, ending, capsys):
    out = tmp_path / f"run.{ending}"
    assert main(["plot", str(file), "Y", "--out", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    head = out.read_bytes()[:300]
    assert {"png": b"PNG", "svg": b"<svg", "pdf": b"%PDF"}[ending] in head


def test_default_picture_is_beside_the_result_and_not_overwritten(file, capsys, undrawn):
    with undrawn():
        assert main(["plot", str(file)]) == 0
    assert main(["plot", str(file)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main(["plot", str(file), "Y", "--overwrite", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(file.with_suffix(".png"))}


def test_a_file_in_a_folder_that_is_not_there_is_missed(capsys):
    assert main(["plot", "nowhere/track.toml"]) == 2
    assert "nowhere/track.toml: no file 'nowhere/track.toml'" in capsys.readouterr().err


def test_unknown_format_is_refused(file, tmp_path, capsys):
    assert main(["plot", str(file), "--out", str(tmp_path / "run.xyz")]) == 2
    assert ".png" in capsys.readouterr().err


def test_track_is_drawn_by_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "curve_r250"]) == 0
    assert os.listdir() == ["curve_r250.png"]
    assert main(["plot", "curve_r250", "--between", "300", "400", "--overwrite"]) == 2
    assert "--between goes with results" in capsys.readouterr().err
    assert main(["plot", "curve_r250", "Y", "--out", "other.png"]) == 2
    assert "quantities belong to results" in capsys.readouterr().err


def test_tracks_whose_names_begin_alike_have_pictures_of_their_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "turnout_245_1in9.25"]) == 0
    assert os.listdir() == ["turnout_245_1in9.25.png"]


def test_track_figure_shows_everything_that_changes_along_the_track():
    track = load_track("curve_r250").replace(
        friction_table=[[0.0, 0.4], [100.0, 0.4, 0.2]],
        gauge_widening=[[50.0, 0.0, 0.0], [60.0, 0.0, 0.015]],
        vertical=[{"type": "CST", "length": 10.0, "gradient": 0.01}],
        support={"variation": [[200.0, 1.0], [205.0, 3.0]]},
        irregularities=[{"type": "dip", "s": 80.0, "length": 3.0, "depth": 0.006, "rail": "left"}],
    )
    figure = track_figure(track)
    titles = [axes.get_title(loc="left").partition(",")[0] for axes in figure.axes]
    assert titles[1:] == [
        "Curvature",
        "Cant",
        "Gradient",
        "Lateral displacement of the rails",
        "Vertical displacement of the rails",
        "Gauge",
        "Friction",
        "Stiffness and damping of the support",
    ]
    gauge = figure.axes[6].lines[0].get_ydata()
    assert (gauge.min(), gauge.max()) == pytest.approx((1435.0, 1450.0))
    kink = {
        "type": "kink",
        "s": 80.0,
        "length": 10.0,
        "offset": 0.008,
    }  # not vertical: no flat axes
    titles = [
        a.get_title(loc="left") for a in track_figure(track.replace(irregularities=[kink])).axes
    ]
    assert not any(title.startswith("Vertical") for title in titles)
    words = figure.get_supxlabel()
    assert "s = 360 m: a cant of 150 mm is more than (R - 100 m)/2 = 75 mm" in words


def test_remarks_mark_all_their_positions():
    """Two curves, each with a step at its begin and end; the first of equal remarks was marked."""
    straight, curve = {"type": "STR", "length": 100.0}, {"type": "CIR", "length": 60.0}
    plan = [straight, curve | {"radius": 250.0}, straight, curve | {"radius": 250.0}, straight]
    track = load_track("straight").replace(
        plan=plan, cant=[{"type": "CST", "length": 420.0, "cant": 0.0}]
    )
    marks = [line for line in track_figure(track).axes[1].lines if line.get_marker() == "^"]
    assert {float(line.get_xdata()[0]) for line in marks} == {100.0, 160.0, 260.0, 320.0}


def test_radii_in_the_plan_have_their_sign():
    plan = track_figure(load_track("s_curve_r150")).axes[0]
    assert [text.get_text() for text in plan.texts] == ["R 150 m", "R \N{MINUS SIGN}150 m"]


@pytest.mark.parametrize("side", [1, -1])
def test_radii_in_the_plan_stand_within_its_axes(side):
    """Over its edge they would lie on its numbers or on the title."""
    turned = load_track("curve_r250").model_dump(exclude_none=True)
    for element in (*turned["plan"], *turned["cant"]):
        element |= {k: side * element[k] for k in ("radius", "cant") if k in element}
    figure = track_figure(railsim.Track.model_validate(turned))
    figure.draw_without_rendering()
    plan = figure.axes[0]
    words, axes = plan.texts[0].get_window_extent(), plan.get_window_extent()
    assert axes.y0 < words.y0 < words.y1 < axes.y1


@pytest.mark.parametrize("base", [9.0, 19.0])
def test_wheelsets_in_a_curve_are_drawn_over_the_whole_width(base):
    """Of a coach they took 60 %."""
    shape, n = (1, 1, 1), 2
    found = SimpleNamespace(
        radius=np.array([250.0]), cant_deficiency=np.array([0.1]), friction=np.array([0.4]),
        converged=np.ones(shape, int), title="coach: steady curving", wheelsets=("a", "b"),
        wheelset_position=(0.5 * base, -0.5 * base), attack=np.zeros((*shape, n)),
        lateral=np.zeros((*shape, n)), Y=np.ones((*shape, n, 2)), T_gamma=np.ones((*shape, n, 2)),
    )  # fmt: skip
    figure = curving_figure(found)
    figure.draw_without_rendering()
    (sketch,) = [axes for axes in figure.axes if "Wheelsets" in axes.get_title(loc="left")]
    assert sketch.get_window_extent().width > 0.9 * figure.bbox.width


def test_no_line_joins_left_hand_curves_to_right_hand_ones():
    """Over a radius of zero; the straight lies at both ends."""
    radius, values = _split_hands(np.array([-500.0, -250.0, 250.0]), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(radius, [-500.0, -250.0, np.nan, 250.0])
    np.testing.assert_array_equal(values, [1.0, 2.0, np.nan, 3.0])
    for one_side in (np.array([250.0, 500.0]), np.array([-500.0, -250.0])):
        np.testing.assert_array_equal(_split_hands(one_side, one_side), [one_side, one_side])


def test_rail_from_a_file_is_called_by_its_name_without_its_folders():
    words = [
        text.get_text() for text in track_figure(load_track("crossing_56e1_r245_1in9.25")).texts
    ]
    assert any("rail rail_56e1_vertical.csv upright" in word for word in words)
    assert not any("/sections/" in word for word in words)


def test_track_figure_shows_curvature_and_cant_as_they_act():
    plan, curvature, cant = track_figure(load_track("curve_r250")).axes
    s, kappa = drawn(curvature)[0].get_data()
    np.testing.assert_allclose(np.interp([100.0, 390.0], s, kappa), [0.0, 4.0], atol=1e-9)
    s, h = drawn(cant)[0].get_data()
    np.testing.assert_allclose(np.interp([100.0, 390.0], s, h), [0.0, 150.0], atol=1e-9)
    # a right-hand curve goes down on the page
    last = plan.lines[-2].get_ydata()[-1]
    assert last > 0.0
    assert plan.yaxis_inverted()


def test_drawn_track_names_its_check_rails_and_a_long_name_is_within_the_picture():
    """Of a crossing nothing was told; a long name was cut off at the edge."""
    track = load_track("depot_r150_check_rail")
    figure = track_figure(track.replace(name="Line of the northern division, " * 5))
    figure.draw_without_rendering()
    (words,) = (text for text in figure.texts if text.get_text().startswith("gauge"))
    begin, *_, end = (row[0] for row in track.check_rail[0].rows)
    assert f"right check rail {begin:g} to {end:g} m" in words.get_text().replace("\n", " ")
    title = figure._suptitle.get_window_extent()
    assert title.x1 < figure.bbox.x1
    assert words.get_window_extent().y0 > max(axes.bbox.y1 for axes in figure.axes)
    assert len(figure.get_suptitle().strip().splitlines()) == 2


def test_overlay_has_a_colour_for_every_result(result):
    other = example_result(gain=0.5)
    axes = overlay({"one": result, "other": other}, ["Y:1:left"]).axes[0]
    first, second = drawn(axes)
    assert first.get_color() != second.get_color()
    np.testing.assert_allclose(second.get_ydata(), 0.5 * first.get_ydata())


def test_overlay_says_what_its_results_share_and_which_ended_early(result):
    figure = overlay({"one": result, "other": example_result(speed=30.0, status="derailed")})
    words = [text.get_text() for text in figure.legends[0].texts]
    assert words[:2] == ["one", "other · derailed"]
    vehicle, track = result.vehicle().name, result.track().name
    assert figure.get_suptitle().split() == f"{vehicle} · {track} · friction 0.4".split()


def test_overlay_shades_what_the_longest_run_passed_and_over_time_of_one_speed_only(result):
    short = example_result(duration=16.0)
    for results in ({"short": short, "long": result}, {"long": result, "short": short}):
        for over in ("distance", "time"):
            assert len(shades(overlay(results, ["Y:1"], over=over).axes[0])) == 3
    part = selected(result, ["Y"])
    moved = {name: part[name] + 50.0 * (name == "distance") for name in part}
    ahead = Result(moved, part.quantities, part.coordinates, part.attributes)
    for other in (example_result(speed=10.0, duration=60.0), ahead):
        assert len(shades(overlay({"one": result, "other": other}, ["Y:1"]).axes[0])) == 3
        both = overlay({"one": result, "other": other}, ["Y:1"], over="time")
        assert shades(both.axes[0]) == []


def test_overlay_names_the_wheelset_of_each_vehicle(result):
    """The leading wheelset of a coach and that of a wagon have other names."""
    coordinates = {"wheelset": ["front", "b", "c", "rear"], "side": ["left", "right"]}
    held = {name: result.quantities[name] for name in ("time", "distance", "Y")}
    wagon = Result({name: result[name] for name in held}, held, coordinates, result.attributes)
    both, one = overlay({"coach": result, "wagon": wagon}, ["Y:1", "Y"]).axes
    assert both.get_title(loc="left") == "Guiding force: 1 front.outer / 1 front"
    assert one.get_title(loc="left") == "Guiding force"


@pytest.mark.parametrize(
    ("words", "count", "columns"), [("a", 3, 3), ("a", 8, 6), ("long " * 30, 3, 1)]
)
def test_legend_of_an_overlay_has_as_many_columns_as_fit(result, words, count, columns):
    figure = overlay({f"{words}{k}": result for k in range(count)}, ["curvature"])
    assert figure.legends[0]._ncols == columns


def test_channels_of_a_recording_are_drawn_in_millimetres_with_their_signs():
    s = np.arange(0.0, 500.0, 0.25)
    y_left, z_left, y_right, z_right = rails = 1e-3 * np.sin(np.outer([0.3, 0.5, 0.7, 1.1], s))
    channels = (
        0.5 * (y_left + y_right),
        0.5 * (z_left + z_right),
        z_right - z_left,
        y_right - y_left,
    )
    figure = recording_figure(np.c_[s, rails.T], np.c_[s, 2.0 * rails.T], "Line")
    for axes, channel in zip(figure.axes[::2], channels, strict=True):
        for line, times in zip(axes.lines, (1.0, 2.0), strict=True):
            assert np.allclose(line.get_xydata(), np.c_[s, 1e3 * times * channel])


def test_a_recording_is_drawn_as_read_and_as_it_acts_with_its_spectrum(
    tmp_path, capsys, monkeypatch
):
    """Offsets at a chord, of rails of ERRI B176: what acts has that spectrum again.

    Means over a third of a decade of 32 averaged spectra: 15 %.
    """
    line = load_track(
        "straight",
        [
            "plan=[{type='STR', length=3000.0}]",
            "irregularities=[{type='random', spectrum='erri_b176_low', wavelengths=[3.0, 120.0]}]",
        ],
    )
    s = np.arange(10.0, 2900.0, 0.25)
    rails = displacement(line)
    offsets = rails(s)[0] - 0.6 * rails(s - 4.0)[0] - 0.4 * rails(s + 6.0)[0]
    head = "s,y_left,z_left,y_right,z_right"
    np.savetxt(tmp_path / "record.csv", np.vstack([s, offsets]).T, delimiter=",", header=head,
               comments="")  # fmt: skip
    (tmp_path / "line.toml").write_text(
        'format = "railsim-track/1"\nextends = "straight"\nname = "Line"\n'
        "plan = [{ type = 'STR', length = 3000.0 }]\n[[irregularities]]\ntype = 'measured'\n"
        "file = 'record.csv'\nchord = [4.0, 6.0]\nscale = 1.0\n"
    )
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "line.toml", "recording"]) == 0
    out = tmp_path / "line_recording.png"  # line.png is that of the track
    assert out.stat().st_size > 50_000
    data = read_source(tmp_path / "line.toml", "track").data
    ((name, before, after),) = recordings(data["irregularities"])
    assert name == "record.csv"
    assert np.allclose(before[:, 1:], offsets.T, atol=1e-12)
    figure = recording_figure(before, after, "Line")
    low, high = figure.axes[1].lines[2:]
    assert low.get_linestyle() != high.get_linestyle()  # in black and white
    assert figure.axes[1].get_ylabel() == "$S$ (mm²/(1/m))"  # not over rad/m: 2 pi
    for axes in figure.axes[1::2]:  # read, acts, low, high
        read, acts, low, _ = (line.get_xydata()[::-1] for line in axes.lines)
        low = low[np.argsort(low[:, 0])]

        def over_low(curve, low=low):
            curve = curve[(curve[:, 0] > 6.0) & (curve[:, 0] < 15.0)]
            return np.mean(curve[:, 1] / np.interp(curve[:, 0], *low.T))

        assert over_low(acts) == pytest.approx(1.0, abs=0.15)
        assert over_low(read) > 1.4  # the chord doubles waves of twice its length over odd numbers
    assert main(["plot", "curve_r250", "recording", "--out", str(tmp_path / "no.png")]) == 2
    assert "no recording" in capsys.readouterr().err


def test_an_svg_of_the_same_picture_is_the_same_but_for_its_date():
    """Names of clip paths are random by default, so that every run would differ."""
    pictures = []
    for _ in range(2):
        figure = Figure()
        figure.subplots().plot([0.0, 1.0])
        text = to_bytes(figure, "svg").decode()
        pictures.append(re.sub("<dc:date>.*</dc:date>", "", text))
    assert pictures[0] == pictures[1]
