"""A model against a test: the statistics by hand, the synthetic run of examples/measured_run."""

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import railsim
from railsim.assessment.model_comparison import (
    QUANTITIES,
    Comparison,
    ModelValidation,
    Overlay,
    Pair,
)
from railsim.assessment.model_validation import matched_results
from railsim.cli import railsim as command_line
from railsim.plot import validation as plots

FOLDER = Path(__file__).parents[2] / "examples" / "measured_run"
sys.path.insert(0, str(FOLDER))
import make  # noqa: E402

# the test's forces are those of a fine table
pytestmark = pytest.mark.usefixtures("smooth_contact_tables_in_module")

# a table of twelve sections: measured and simulated, kN
MEASURED = [31.0, 28.5, -30.2, 33.1, 29.9, -27.4, 35.0, 30.5, 32.2, -29.1, 28.8, 31.7]
SIMULATED = [33.0, 27.5, -33.2, 33.6, 31.9, -26.4, 36.5, 30.0, 35.2, -30.6, 29.8, 32.2]


def comparison(measured, simulated, limit=5e3):
    pairs = tuple(
        Pair("Y_qst", "run", "wheelset 1 outer", 100.0 * k, 100.0 * k + 100.0, 500.0, m, s)
        for k, (m, s) in enumerate(zip(measured, simulated, strict=True))
    )
    return Comparison(QUANTITIES["Y_qst"], pairs, limit, 2.0 * limit / 3.0, 12)


def test_mean_and_deviation_of_twelve_sections_by_hand():
    """Differences 2, -1, 3, .5, 2, -1, 1.5, -.5, 3, 1.5, 1, .5 kN: sum 12.5, squares 34.25."""
    found = comparison(1e3 * np.array(MEASURED), 1e3 * np.array(SIMULATED))
    assert found.mean == pytest.approx(12.5e3 / 12.0, rel=1e-12)
    by_hand = 1e3 * ((34.25 - 12.5**2 / 12.0) / 11.0) ** 0.5
    assert found.deviation == pytest.approx(by_hand, rel=1e-12)
    assert (found.sections, found.verdict) == (12, "pass")


def test_pictures_name_quantities_in_words_and_densities_with_their_units():
    """Titles were keys such as Y_qst, the spectra had no vertical axis."""
    one = comparison(1e3 * np.array(MEASURED), 1e3 * np.array(SIMULATED))
    s = np.arange(3000.0)
    overlay = Overlay("run", "Q1L", "Q:1:left", s, 100.0, 1e3 * np.sin(s), 1e3 * np.sin(s))
    found = ModelValidation("coach", ("run",), (one,), (overlay,), "")
    figure = plots.scatter(found)
    title = figure.axes[0].get_title(loc="left").replace("\n", " ")
    assert title == "guiding force, quasi-static: pass"
    assert figure.get_suptitle().startswith("coach against run\n")
    drawn = plots.spectra(found)
    assert [drawn.get_suptitle(), plots.overlays(found).get_suptitle()] == ["run", "run"]
    axes = drawn.axes[0]
    assert axes.get_ylabel() == "PSD ((kN)²/Hz)"
    # a sine of 1 kN of 1/(2 pi) samples: its mean square is 0.5 kN²
    f, power = axes.lines[0].get_data()
    assert np.trapezoid(power, f) == pytest.approx(0.5, rel=0.02)


def test_mean_and_deviation_decide_each_and_eleven_sections_do_not():
    measured = 1e3 * np.array(MEASURED)
    outwards = np.sign(measured)
    assert comparison(measured, measured + 3.3e3 * outwards).verdict == "pass"
    assert comparison(measured, measured + 3.4e3 * outwards).verdict == "fail"
    scatter = 4e3 * np.tile([1.0, -1.0], 6)
    assert comparison(measured, measured + scatter).verdict == "pass"
    assert comparison(measured, measured + 1.3 * scatter).verdict == "fail"
    # both changes of sign mirror the track: nothing changes
    assert comparison(-measured, -measured - scatter).deviation == pytest.approx(
        comparison(measured, measured + scatter).deviation
    )
    assert comparison(measured[:11], measured[:11]).verdict == "incomplete"
    one = replace(comparison(measured[:1], measured[:1]), least=1)  # no standard deviation
    assert one.verdict == "incomplete"


@pytest.mark.parametrize("seed", range(6))
def test_a_difference_exactly_at_its_limit_is_not_above_it(seed):
    """As in `railsim assess`: the sum of twelve differences rounds to either side."""
    measured = np.random.default_rng(seed).normal(30e3, 3e3, 12)
    for limit in (5e3, 6e3, 9e3):
        assert comparison(measured, measured + 2.0 * limit / 3.0, limit).verdict == "pass"
        assert comparison(measured, measured + 0.667 * limit, limit).verdict == "fail"


def simulated(vehicle, until=None, **outputs):
    track = railsim.load_track(FOLDER / "line" / "track.toml")
    settings = {"output_rate": 100.0, "outputs": {**make.OUTPUTS, **outputs}}
    return railsim.simulate(
        vehicle, track, speed=make.SPEED, until=until,
        settings=railsim.Settings.model_validate(settings),
    )  # fmt: skip


@pytest.fixture(scope="module")
def measured():
    return railsim.load_measurement("coach_25t_run")


@pytest.fixture(scope="module")
def right():
    return simulated(make.true_vehicle())


def scaled(vehicle, group, element, key, factor):
    """A vehicle with one value of an element times a factor."""
    home = vehicle.assemblies["bogie"]
    home = home.assemblies["axle"] if group == "axle" else home
    value = getattr(home.elements[element], key)
    rows = np.array(value)
    if rows.ndim == 2:
        rows[:, 1] *= factor
    else:
        rows = factor * rows
    return vehicle.with_values({f"{element}.{key}": rows})


def undamped(vehicle):
    for group, element in (("axle", "primary"), ("bogie", "secondary")):
        vehicle = scaled(vehicle, group, f"{element}_vertical_damper", "damper_table", 1e-3)
    return vehicle


def test_the_right_model_passes_and_its_place_is_found(measured, right):
    found = railsim.validate_model(measured, right)
    assert found.verdict == "pass"
    assert min(one.sections for one in found.comparisons) >= 12
    assert {one.quantity.name for one in found.comparisons} == set(QUANTITIES)
    for one in found.comparisons:
        assert abs(one.mean) < 0.05 * one.limit
        assert one.deviation < 0.1 * one.limit
    (moved,) = [remark for remark in found.remarks if "arc length" in remark]
    shift = float(moved.split("by ")[1].split(" m")[0])
    assert shift == pytest.approx(-make.SHIFT, abs=0.3)


def test_missing_vertical_dampers_fail_in_the_vertical(measured):
    found = railsim.validate_model(measured, simulated(undamped(make.true_vehicle())))
    assert found["body_z_rms"].verdict == "fail"
    lateral = ("Y_qst", "sum_Y_qst", "Q_qst", "body_y_qst")
    assert {found[name].verdict for name in lateral} == {"pass"}


def test_one_late_channel_does_not_move_the_others(measured, right):
    """Its shift is as clear as theirs; the run stays where most channels are."""
    channels = {n: x for n, x in measured.channels.items() if n != "frame1z"}
    late = np.roll(channels["floor1y"], 20)  # 0.2 s, 5.2 m
    found = railsim.validate_model(replace(measured, channels={**channels, "floor1y": late}), right)
    (moved,) = [remark for remark in found.remarks if "arc length" in remark]
    assert float(moved.split("by ")[1].split(" m")[0]) == pytest.approx(-make.SHIFT, abs=0.3)
    assert "floor1y comes 200 ms later" in "\n".join(found.remarks)
    early = replace(measured, channels={**channels, "floor1y": np.roll(channels["floor1y"], -20)})
    assert "floor1y comes 200 ms earlier" in "\n".join(railsim.validate_model(early, right).remarks)


def test_a_place_beyond_what_is_looked_for_is_not_taken_for_another(measured, right):
    """45 m off: windows that happen to be alike give no shift of their own."""
    found = railsim.validate_model(measured.moved(45.0), right)
    assert "no channel is like the simulated one at places within 30 m" in "".join(found.remarks)
    assert "arc length moved" not in "".join(found.remarks)


def test_a_section_with_a_wheel_without_load_is_left_out_and_named(measured, right):
    """Y/Q has no value there: it must not spoil mean and deviation of the other sections."""
    whole = railsim.validate_model(measured, right)["Y_over_Q_qst"]
    load = measured["Q1L"].copy()
    load[(measured.distance > 640.0) & (measured.distance < 700.0)] = -500.0
    channels = {name: x for name, x in measured.channels.items() if name != "frame1z"}
    found = railsim.validate_model(replace(measured, channels={**channels, "Q1L": load}), right)
    own = found["Y_over_Q_qst"]
    assert 0 < len(whole.pairs) - len(own.pairs) <= 2
    assert own.verdict == "pass"
    assert own.deviation == pytest.approx(whole.deviation, rel=0.5)
    assert any("no Y_over_Q_qst of wheelset 1 outer from" in words for words in found.remarks)
    assert ModelValidation.of(found.record())["Y_over_Q_qst"].mean == own.mean


def test_swapped_signs_wrong_units_and_late_channels_are_said(measured, right):
    measured = measured.part(0.0, 1300.0)
    definition = measured.definition
    channels = dict(measured.channels)
    channels["frame1y"] = -channels["frame1y"]
    channels["floor1z"] = 1e3 * channels["floor1z"]
    channels["frame1z"] = np.roll(channels["frame1z"], 30)
    spoilt = railsim.Measurement(
        definition, measured.time, measured.distance, measured.speed, channels
    )
    said = "\n".join(railsim.validate_model(spoilt, right).remarks)
    assert "frame1y has the opposite sign" in said
    assert "floor1z is 1000 times the simulated one" in said
    assert "frame1z comes 300 ms later" in said
    assert "Q1L" not in said


def test_exchanged_sides_and_axes_are_said(measured, right):
    """Loads of the wrong sides were called reversed, accelerations along the wrong axes nothing."""
    channels = dict(measured.channels)
    for a, b in (("Q1L", "Q1R"), ("frame1y", "frame1z")):
        channels[a], channels[b] = channels[b], channels[a]
    said = railsim.validate_model(replace(measured, channels=channels), right).remarks
    found = {words.split(": ", 1)[1] for words in said if "exchanged?" in words}
    pairs = ("Q1L", "Q1R"), ("Q1R", "Q1L"), ("frame1y", "frame1z"), ("frame1z", "frame1y")
    assert found == {f"{a} is like the simulated {b}, not its own: exchanged?" for a, b in pairs}
    assert "opposite sign" not in "\n".join(said)


def spoilt(measured, **changed):
    """A run with other values of some channels, None without them; without the one with gaps."""
    channels = {**measured.channels, "frame1z": None, **changed}
    return replace(measured, channels={n: x for n, x in channels.items() if x is not None})


def test_sections_in_which_a_channel_rests_are_left_out_and_named(measured, right):
    """A dead sensor formed statistics: 55 kN throughout failed, from 1500 m on it passed."""
    load = measured["Q1L"]
    dead, dying = np.full_like(load, 55e3), np.where(measured.distance < 1500.0, load, 55e3)
    wanted = railsim.validate_model(spoilt(measured, Q1L=None), right)
    found = railsim.validate_model(spoilt(measured, Q1L=dead), right)
    assert len(found["Q_qst"].pairs) == 14
    assert found["Q_qst"].deviation == pytest.approx(wanted["Q_qst"].deviation, rel=0.2)
    assert found["Y_over_Q_qst"].sections == wanted["Y_over_Q_qst"].sections == 7
    (said,) = [words for words in found.remarks if "dead" in words]
    assert "Q1L does not change in 17 of 17 sections: a dead sensor?" in said
    found = railsim.validate_model(spoilt(measured, Q1L=dying), right)
    assert 14 < len(found["Q_qst"].pairs) < 28  # of Q1R in all, of Q1L in the first ones
    assert abs(found["Q_qst"].mean) < 100.0
    assert any("Q1L does not change in" in words for words in found.remarks)


def test_quantity_whose_only_channels_rest_is_incomplete(measured, right):
    """Both loads of a wheelset were dead: the table was without them, and the model passed."""
    dead = np.full_like(measured["Q1L"], 55e3)
    found = railsim.validate_model(spoilt(measured, Q1L=dead, Q1R=dead), right)
    assert (found["Q_qst"].sections, found["Q_qst"].verdict) == (0, "incomplete")
    assert found.verdict == "incomplete"
    assert len(plots.scatter(found).axes) == len(found.comparisons) - 4  # Q, Y over Q


def test_an_offset_that_cancels_over_curves_of_both_hands_is_said(measured, right):
    """Of 0.5 m/s2, at one of two places: the mean lacks it, and 0.36 m/s2 of scatter pass.

    In 7 curves of either hand the differences are -0.5 and +0.5 at one place, 0 at the other: the
    standard deviation of the 28 is 0.5 (14/27)^0.5.
    """
    found = railsim.validate_model(spoilt(measured, floor1y=measured["floor1y"] + 0.5), right)
    one = found["body_y_qst"]
    assert one.mean == pytest.approx(0.0, abs=0.005)
    assert one.deviation == pytest.approx(0.5 * (14.0 / 27.0) ** 0.5, abs=0.005)
    assert one.verdict == "pass"
    (said,) = [words for words in found.remarks if "'offset'" in words]
    numbers = [float(word) for word in re.findall(r"-?\d\.\d+", said)]
    assert numbers == pytest.approx([0.5, -0.5], abs=0.01)
    assert re.sub(r"-?\d\.\d+", "#", said) == (
        "body_y_qst of floor_front: mean difference # in left-hand curves, # m/s2 in right-hand "
        "ones: an 'offset' of a channel?"
    )
    assert not any("'offset'" in words for words in railsim.validate_model(measured, right).remarks)


def test_the_load_of_the_other_side_is_no_more_called_reversed_only(measured, right):
    """Of two exchanged channels one was not measured: loads of both sides are opposite."""
    run = spoilt(measured, Q1L=measured["Q1R"], Q1R=None)
    said = "\n".join(railsim.validate_model(run, right).remarks)
    assert "Q1L has the opposite sign" in said
    assert "'reverse', or that of the other side?" in said


def test_the_command_writes_its_files_and_fails_on_request(tmp_path, right):
    run = tmp_path / "run.h5"
    right.to_hdf5(run)
    arguments = ["validate-model", str(FOLDER / "coach_25t_run.toml"), str(run)]
    done = CliRunner().invoke(command_line, [*arguments, "--json"], standalone_mode=False)
    found = json.loads(done.output)
    assert found["verdict"] == "pass"
    assert len(found["quantities"]) == len(QUANTITIES)
    tight = tmp_path / "tight.toml"
    tight.write_text(
        'format = "railsim-validation-limits/1"\nedition = "own"\nsections = 12\nmean = 0.5\n'
        '[limits]\nY_qst = { constant = 1.0, source = "own" }\n'
    )
    more = ["--limits", str(tight), "--fail", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(command_line, [*arguments, *more], standalone_mode=False)
    assert done.return_value == 4
    page = (tmp_path / "out" / "report.html").read_text()
    assert "does not match the test" in page
    assert len(list((tmp_path / "out").iterdir())) == 5
    # the report of both together: a section with the same table
    more = ["report", str(run), str(tmp_path / "out"), "--out", str(tmp_path / "both.html")]
    CliRunner().invoke(command_line, more, standalone_mode=False, catch_exceptions=False)
    both = (tmp_path / "both.html").read_text()
    for words in ("does not match the test", "Differences and limits", "Along the track"):
        assert words in both
    (tmp_path / "out" / "model_validation.json").write_text('{"vehicle": "none"}')
    again = CliRunner().invoke(command_line, [*more, "--overwrite"], standalone_mode=False)
    assert "as its command has written it" in str(again.exception)


def test_a_study_gives_the_result_on_the_same_track_in_the_same_load(measured, right, tmp_path):
    other = simulated(railsim.load_vehicle("coach_25t", ["load=laden"]), 100.0)
    assert matched_results([measured], {"laden": other, "right": right}) == [right]
    cases = (({"laden": other}, "0 results"), ({"a": right, "b": right}, "2 results: a, b"))
    for results, words in cases:
        with pytest.raises(railsim.InputError, match=words):
            matched_results([measured], results)
    for name, result in (("run_001", other), ("run_002", right)):
        result.to_hdf5(tmp_path / f"{name}.h5")
    arguments = ["validate-model", str(FOLDER / "coach_25t_run.toml"), str(tmp_path), "--json"]
    done = CliRunner().invoke(command_line, arguments, standalone_mode=False)
    assert json.loads(done.output)["verdict"] == "pass"


def test_a_run_that_is_compared_in_part_only_is_said(measured):
    """A simulated run up to 500 m of 2900 m, such as on a track file that ends there."""
    found = railsim.validate_model(measured, simulated(make.true_vehicle(), until=500.0))
    (said,) = [words for words in found.remarks if "compared from" in words]
    assert said.endswith(("m, compared from 78 to 500 m", "m, compared from 79 to 500 m"))


@pytest.mark.parametrize("status", ["derailed", "stopped"])
def test_a_simulated_run_that_ended_early_does_not_pass_in_silence(
    measured, right, status, monkeypatch
):
    measured = measured.part(0.0, 1300.0)
    attributes = {**right.attributes, "status": status, "status_reason": "a wheel climbs"}
    monkeypatch.setattr(right, "_attributes", attributes)
    if status == "derailed":
        with pytest.raises(railsim.InputError, match="simulated run: derailed, a wheel climbs"):
            railsim.validate_model(measured, right)
    else:
        said = "\n".join(railsim.validate_model(measured, right).remarks)
        assert f"simulated up to {right.distance[-1]:.0f} m only (stopped, a wheel climbs)" in said


def test_a_result_of_another_speed_load_or_track_is_said(measured, right):
    measured = measured.part(0.0, 1300.0)
    definition = measured.definition.replace(load="laden", track="curve_r500")
    run = railsim.Measurement(
        definition, measured.time, measured.distance, 1.1 * measured.speed, measured.channels
    )
    said = "\n".join(railsim.validate_model(run, right).remarks)
    assert "measured in load 'laden', simulated in 'design'" in said
    assert "measured at 28.6 m/s, simulated at 26.0 m/s" in said
    assert "simulated on another track, 'Line of the measured run'" in said


def test_bad_input_is_one_line(measured, right, tmp_path):
    manchester = simulated(railsim.load_vehicle("coach_manchester"), 60.0, quantities=["Q"])
    cases = [
        (lambda: railsim.validate_model([measured, measured], right), "1 results for 2 measured"),
        (
            lambda: railsim.validate_model([measured, measured], [right, right]),
            f"two runs named '{measured.name}'",
        ),
        (lambda: railsim.validate_model(measured, manchester), "no quantity 'Y'"),
        (lambda: railsim.validate_model(measured.part(0.0, 100.0), right), "no section"),
        (lambda: railsim.validate_model(measured, right, limits="en14363"), "railsim-validation"),
    ]
    for call, words in cases:
        with pytest.raises(railsim.InputError) as caught:
            call()
        assert words in str(caught.value)
