"""Assessments of made-up runs with known answers, and of wrong input."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from example_result import BODIES, example_result
from made_record import FINE, Q0, curve, made, track

import railsim
from railsim.assessment import Assessment, assess, running
from railsim.assessment.comfort import MeanComfort, event_comfort
from railsim.assessment.comfort_report import PointComfort, shock_remark
from railsim.assessment.safety import flange_angle
from railsim.assessment.tables import tables
from railsim.assessment.wear import wear_law
from railsim.cli import main
from railsim.cli.assess import FILES
from railsim.definitions.loading import (
    load_comfort_limits,
    load_own_sections,
    load_stationary_limits,
)
from railsim.definitions.study.analyses import AssessAnalysis, unit_of_number
from railsim.definitions.vehicle.tables import Service
from railsim.errors import InputError
from railsim.notation import PATCHES, REQUESTED
from railsim.plot.assessment import assessment_figure, regression_figure, sections_figure
from railsim.profiles import load_profile
from railsim.result import Result
from railsim.studies.analyses import numbers_and_remarks
from railsim.studies.journal import Journal

STRAIGHT = {"type": "STR", "length": 1700.0}
FAST = 1.1 * 33.33333


def both_sides(force):
    return np.stack([0.5 * force, 0.5 * force], axis=-1)


def rows_of(assessment, zone, name):
    report = next(z for z in assessment.zones if z.zone == zone)
    return {row.place: row for row in report.rows if row.criterion.name == name}


def hunts(rate):
    """30 kN at 5 Hz on straight track, 0.2 m/s2 of the body at 1 Hz."""
    return made(
        track(STRAIGHT), FAST,
        Y=lambda t, s: both_sides(30e3 * np.sin(2 * np.pi * 5.0 * t)[:, None] + 0.0 * s),
        lateral=lambda t: 0.2 * np.sin(2 * np.pi * t), rate=rate,
    )  # fmt: skip


@pytest.fixture(scope="module")
def hunting():
    return hunts(200.0)


@pytest.fixture(scope="module")
def hunting_file(hunting, tmp_path_factory):
    return str(hunting.to_hdf5(tmp_path_factory.mktemp("hunting") / "run.h5"))


@pytest.fixture(scope="module")
def of_hunting():
    (found,) = assess(hunts(400.0))
    return found


def test_instability_of_a_sine_against_half_the_limit_of_the_sum_of_y(of_hunting):
    """E5: 21.21 against 23.18 kN for the benchmark's wheel load."""
    row = rows_of(of_hunting, "1", "instability")["wheelset 1"]
    # 100 m are 13.6 periods: the rms of a window differs by up to 1/(4 pi 13.6)
    assert row.estimate.value == pytest.approx(21.21e3, rel=8e-3)
    assert row.limit == pytest.approx(23.18e3, abs=10.0)
    assert of_hunting.hunting_frequency == pytest.approx(5.0, abs=0.02)


def test_frequency_of_the_instability_is_that_of_the_sum_of_both_wheels():
    """40 kN apart at 3 Hz, 5 kN aside at 6 Hz."""

    def Y(t, s):
        apart, aside = (np.sin(2.0 * np.pi * f * t)[:, None] + 0.0 * s for f in (3.0, 6.0))
        return np.stack([40e3 * apart + 5e3 * aside, -40e3 * apart + 5e3 * aside], axis=-1)

    (found,) = assess(made(track(STRAIGHT), FAST, Y=Y))
    assert found.hunting_frequency == pytest.approx(6.0, abs=0.02)
    row = rows_of(found, "1", "instability")["wheelset 2"]
    assert row.estimate.value == pytest.approx(10e3 / np.sqrt(2.0), rel=0.01)


def test_straight_track_gives_both_percentiles_of_signed_quantities(of_hunting):
    found = of_hunting
    report = found.zones[0]
    assert [len(report.values), report.needed] == [6, 25]
    row = rows_of(found, "1", "sum_Y")["wheelset 2"]
    # 2 m means of a wave of 9.78 m
    wave = FAST / 5.0
    gain = math.sin(math.pi * 2.0 / wave) / (math.pi * 2.0 / wave)
    # two signs of six sections are six values each, not twelve
    assert row.estimate.N == 6
    assert row.estimate.mean == pytest.approx(30e3 * gain, rel=3e-3)
    body = rows_of(found, "1", "body_y_rms")["floor_middle"]
    assert body.estimate.mean == pytest.approx(0.2 / math.sqrt(2.0), rel=0.01)
    assert found.verdict == "incomplete"
    assert "zone 4: number of sections not met: none; required 25 at least" in found.reasons


def test_runs_without_a_section_have_no_empty_picture_and_no_empty_table():
    run = made(track({"type": "STR", "length": 200.0}), 20.0)
    (found,) = assess({"short": run})
    assert found.zones
    assert assessment_figure([found]) is None
    with pytest.raises(InputError, match="nothing to draw"):
        found.plot()
    assert tables(found) == []


def steady(turn):
    """Outer wheel 40 kN outwards, inner one 25 kN, in a curve to the side `turn`."""

    def Y(t, s):
        outer = 40e3 if turn > 0 else 25e3
        inner = 25e3 if turn > 0 else 40e3
        return np.stack([np.full(s.shape, -outer), np.full(s.shape, inner)], axis=-1)

    on = track(*curve(300.0 * turn, 400.0), cant=0.12 * turn)
    return made(on, 23.0, Y=Y, lateral=lambda t: turn * (1.0 + 9.81 * 0.08) + 0.0 * t)


@pytest.fixture(scope="module")
def of_right():
    (found,) = assess(steady(1))
    return found


@pytest.mark.parametrize("turn", [1, -1])
def test_left_and_right_curves_give_the_same_values(turn, of_right):
    (found,) = [of_right] if turn == 1 else assess(steady(-1))
    assert rows_of(found, "4", "Y_qst")["wheelset 1 outer"].estimate.mean == pytest.approx(
        40e3, rel=1e-6
    )
    assert rows_of(found, "4", "sum_Y")["wheelset 1"].estimate.mean == pytest.approx(15e3, 1e-6)
    quotient = rows_of(found, "4", "Y_over_Q")["wheelset 1 outer"].estimate.mean
    assert quotient == pytest.approx(40e3 / Q0, rel=1e-6)
    # absolute acceleration less gravity on the cant
    reading = rows_of(found, "4", "body_y_qst")["floor_middle"].estimate.mean
    assert reading == pytest.approx(1.0, abs=5e-3)


def test_limits_of_the_curve_follow_its_radius_and_the_vehicle(of_right):
    assert rows_of(of_right, "4", "Y_qst")["wheelset 1 outer"].limit == pytest.approx(65e3)
    assert rows_of(of_right, "4", "sum_Y")["wheelset 1"].limit == pytest.approx(46.36e3, abs=5.0)
    assert rows_of(of_right, "4", "Q")["wheelset 1 outer"].limit == pytest.approx(90e3 + Q0)
    (found,) = assess(steady(1), "uic518")
    row = rows_of(found, "4", "Y_qst")["wheelset 1 outer"]
    assert (row.limit, row.estimate.mean) == (pytest.approx(60e3), pytest.approx(40e3))
    freight = Service(admissible_speed=30.0, cant_deficiency=0.15, category="freight")
    (found,) = assess(steady(1), service=freight)
    limit = rows_of(found, "4", "sum_Y")["wheelset 1"].limit
    assert limit == pytest.approx(0.85 * 46.36e3, abs=5.0)


def test_simplified_method_needs_no_limit_of_forces():
    (found,) = assess(steady(1), method="simplified")
    names = {row.criterion.name for row in found.zones[-1].rows}
    assert {"body_y_safety", "frame_y"} <= names
    assert not {"sum_Y", "Q"} & names
    frame = rows_of(found, "4", "frame_y")["frame_1"]
    assert frame.limit == pytest.approx(12.0 - (2615.0 + 2 * 1813.0) / 1000.0 / 5.0)


def test_an_inner_wheel_without_load_in_one_section_hides_no_guiding_force():
    """70 kN against 65 kN, Y/Q of 0.5 at the inner wheel: less 5 kN, but for that one section."""

    def Q(t, s):
        loads = np.full((*s.shape, 2), Q0)
        loads[(s > 400.0) & (s < 520.0), 1] = -1e3
        return loads

    def Y(t, s):
        return np.stack([np.full(s.shape, -70e3), 0.5 * Q(t, s)[..., 1]], axis=-1)

    (found,) = assess(made(track(*curve(300.0, 800.0), cant=0.12), 23.0, Q=Q, Y=Y))
    row, n = rows_of(found, "4", "Y_qst")["wheelset 1 outer"], len(found.zones[-1].values)
    assert n > 5
    assert row.uncorrected.mean == pytest.approx(70e3)
    assert row.estimate.mean == pytest.approx(65e3 + 5e3 / n, rel=1e-3)
    inner = [one.estimate for one in found.zones[-1].information if one.place == "wheelset 1 inner"]
    assert [(one.N, one.mean) for one in inner[1:]] == [(n - 1, pytest.approx(0.5, rel=1e-3))]


def test_lifted_wheel_is_reported_in_metres_and_is_no_number():
    def Q(t, s):
        loads = np.full((*s.shape, 2), Q0)
        loads[(s > 400.0) & (s < 406.0), 0] = -1e3
        return loads

    run = made(track(*curve(300.0, 800.0), cant=0.12), 23.0, Q=Q, **FINE)
    (found,) = assess(run)
    report = next(z for z in found.zones if z.zone == "4")
    metres = sum(v.lifted.get("wheelset 1 outer", 0.0) for v in report.values)
    # the filter of 20 Hz spreads the edges by less than half a metre
    assert metres == pytest.approx(6.0, abs=0.6)
    assert all(math.isfinite(row.share) for row in report.rows)
    assert any("without load" in note for note in report.notes)


def test_sections_outside_the_conditions_do_not_count_unless_asked():
    run = made(track(*curve(300.0, 800.0), cant=0.12), 15.0)
    (found,) = assess(run)
    report = next(z for z in found.zones if z.zone == "4")
    assert not report.values
    assert any("cant deficiency" in note for note in report.notes)
    (found,) = assess(run, all_sections=True)
    assert len(next(z for z in found.zones if z.zone == "4").values) == 11


def test_sections_shorter_than_a_mean_have_none():
    """1 m of a curve, asked for with all sections, ended in an IndexError: means are over 2 m."""
    short = made(track(*curve(300.0, 200.0), cant=0.12), 20.0, until=217.0)
    (found,) = assess(short, all_sections=True)
    (values,) = next(z for z in found.zones if z.zone == "4").values
    assert values.section.end - values.section.begin < 2.0
    assert not {"sum_Y", "Y_over_Q"} & {name for name, _ in values.values}


def test_a_long_name_of_a_vehicle_is_within_its_pictures():
    """It was cut off at the edge, and the axes under it had a gap between them."""
    coach = railsim.load_vehicle("coach_manchester")
    text = coach.replace(name=f"{coach.name}, $1 to $2, " * 4).to_toml()
    run = made(track(*curve(300.0, 200.0), cant=0.12), 20.0, vehicle=text)
    found = assess(run, all_sections=True)
    for draw in (assessment_figure, sections_figure):
        figure = draw(found)
        figure.draw_without_rendering()
        texts = [t for each in figure.legends for t in each.texts]
        texts += [
            axes.title if not axes.get_title("left") else axes._left_title for axes in figure.axes
        ]
        assert max(t.get_window_extent().x1 for t in texts) <= figure.bbox.x1
        assert min(axes.get_window_extent().width for axes in figure.axes) > 150


def linear(speed=23.0, length=800.0):
    """Guiding force of the outer wheel 10 kN and 50 N/m, in a right-hand curve of R 300 m."""

    def Y(t, s):
        return np.stack([-10e3 - 50.0 * s, np.zeros(s.shape)], axis=-1)

    return made(track(*curve(300.0, length), cant=0.12), speed, Y=Y)


@pytest.fixture(scope="module")
def short_run(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "r.h5"
    linear(length=150.0).save(path)
    return str(path)


def own_sections(folder, *rows):
    file = folder / "sections.toml"
    file.write_text(f'format = "railsim-sections/1"\nsections = [{", ".join(rows)}]\n')
    return file


def test_own_sections_take_the_place_of_those_of_the_program(tmp_path):
    """Medians of a force that is linear along the track are those of the middles: 345 and 445 m."""
    rows = "{begin = 410, end = 480}", "{begin = 310, end = 380, zone = 4}"
    (found,) = assess(linear(), sections=own_sections(tmp_path, *rows))
    row = rows_of(found, "4", "Y_qst")["wheelset 1 outer"]
    assert (row.estimate.N, [s.section.begin for s in found.sections]) == (2, [310.0, 410.0])
    # the instants nearest to the ends are up to 115 mm off
    assert row.estimate.mean == pytest.approx(10e3 + 50.0 * 395.0, abs=5.0)
    assert not any("lengths" in one.name for one in found.conditions)


@pytest.mark.parametrize("separator", [",", "; "])
def test_own_sections_in_csv_are_those_in_toml(tmp_path, separator):
    rows = "{begin = 410, end = 480, track = 'a'}", "{begin = 310.5, end = 380, zone = 4}"
    lines = ["begin", "end", "zone", "track"], ["410", "480", "", "a"], ["310.5", "380", "4"]
    table = tmp_path / "s.csv"
    table.write_text("\n".join(separator.join(line) for line in lines))
    assert load_own_sections(table) == load_own_sections(own_sections(tmp_path, *rows))


def test_what_is_wrong_in_sections_of_csv_is_told_with_its_key(tmp_path):
    table = tmp_path / "s.csv"
    table.write_text("begin,end\n390,4x\n500,570,1\n")
    with pytest.raises(InputError) as told:
        load_own_sections(table)
    assert "sections.0.end: '4x'" in str(told.value)
    assert "sections.1.: unknown key; allowed: begin, end, track, zone" in str(told.value)


def test_a_straight_given_as_of_a_curves_zone_has_no_outer_wheel_and_never_counts(tmp_path):
    """The straight ends at 120 m: beside one value outwards it would have two."""
    rows = "{begin = 95, end = 110, zone = '4'}", "{begin = 310, end = 380}"
    (found,) = assess(linear(), sections=own_sections(tmp_path, *rows), all_sections=True)
    assert [(s.section.begin, s.counts) for s in found.sections] == [(95.0, False), (310.0, True)]
    assert found.sections[0].section.reason == "given as of zone 4, but straight"
    assert rows_of(found, "4", "sum_Y")["wheelset 1"].estimate.N == 1


def test_own_sections_of_other_lengths_and_places_are_told(tmp_path):
    """Zone 4 has 70 m; the curve is from 200 to 1000 m, its kinks are rounded over 10 m."""
    rows = ("{begin = 310, end = 410}", "{begin = 959, end = 1029}", "{begin = 600, end = 670, "
            "zone = '3'}", "{begin = 1030, end = 1040}", "{begin = 700, end = 770}")  # fmt: skip
    (found,) = assess(linear(), sections=own_sections(tmp_path, *rows))
    said = {row.section.begin: (row.section.zone, row.section.reason) for row in found.sections}
    constant = "not within 205 to 995 m of constant curvature and cant"
    assert [said[310.0], said[700.0]] == [("4", ""), ("4", "")]
    assert said[959.0] == ("4", constant)
    assert said[1030.0] == ("", constant)
    assert said[600.0] == ("3", "given as of zone 3, the radius of 300 m is not")
    (lengths,) = (one for one in found.conditions if one.name == "lengths of the sections")
    assert lengths.sentence == (
        "zone 4: lengths of the sections not met: 1 of 2 have 100 m; required 70 m"
    )


@pytest.mark.parametrize(("rows", "words"), [
    (["{begin = 310, end = 380}", "{begin = 379, end = 449}"],
     "sections.1: 379 to 449 m; outside sections.0"),
    (["{begin = 310, end = 300}"], "sections.0.end: 300 m; 315 m at least"),
    (["{begin = 310, end = 'x'}"], "sections.0.end: "),
    (["{begin = 310, end = 380, track = 'made'}"], "sections.0.track: 'made'"),
    (["{begin = 310, end = 380, zone = '5'}"], "zone: '5'; must be '1', '2', '3' or '4'"),
    (["{begin = 310, end = 380, zone = 0}"], "zone: 0; must be '1', '2', '3' or '4'"),
    (["{begin = 310, end = 380, zone = true}"], "zone: 'True'; must be '1', '2', '3' or '4'"),
    (["{begin = 10, end = 80}"], "sections.0: 10 to 80 m; within 8"),
    ([], "sections: "),
])  # fmt: skip
def test_own_sections_that_cannot_be_are_refused(short_run, tmp_path, capsys, rows, words):
    """3 s of 23 m/s are 69 m, to which what is ahead of the coach's middle adds."""
    file = own_sections(tmp_path, *rows)
    assert main(["assess", short_run, "--sections", str(file)]) == 2
    said = capsys.readouterr().err
    assert f"{file}: " in said
    assert words in said
    assert "Traceback" not in said


def test_transitions_stand_apart_and_are_in_no_statistics(tmp_path):
    """Clothoids from 120 to 200 and 1000 to 1080 m, rounded over 10 m; the force is 10 kN + 50 N/m.

    The second is passed up to 1085 m: means over 2 m end at 1084 m, of which 99.85 % lie within
    0.15 % of their range.
    """
    (found,) = assess({"r": linear()})
    first, second = found.record()["transitions"]["r"]
    assert (first["begin"], first["end"], first["radius"]) == (115.0, 205.0, 300.0)
    assert (second["begin"], second["end"]) == (995.0, 1085.0)
    values = {(row["name"], row["place"]): row["value"] for row in second["quantities"]}
    assert {name for name, _ in values} == {"sum_Y", "Y_over_Q", "Q"}
    force = 10e3 + 50.0 * (996.0 + 0.9985 * 88.0)
    assert values["sum_Y", "wheelset 2"] == pytest.approx(force, abs=5.0)
    assert values["Y_over_Q", "wheelset 2 outer"] == pytest.approx(force / Q0, rel=2e-4)
    (zone,) = (z for z in found.zones if z.zone == "4")
    assert max(v.section.end for v in zone.values) <= 995.0
    table = next(one for one in tables(found) if "transitions" in one.columns[0].heading)
    assert [row[5] for row in table.rows] == ["995 to 1085", "995 to 1085", "115 to 205"]


def test_between_curves_of_opposite_hands_no_wheel_is_the_outer_one():
    plan = [
        {"type": "CIR", "length": 300.0, "radius": 400.0}, {"type": "CLO", "length": 60.0},
        {"type": "CIR", "length": 300.0, "radius": -400.0}, {"type": "STR", "length": 200.0},
    ]  # fmt: skip
    (found,) = assess({"r": made(track(*plan, cant=0.0), 20.0, Y=lambda t, s: both_sides(s))})
    (one,) = found.transitions["r"]  # the end of the curve is a kink and none
    assert (one.section.begin, one.section.end, one.section.radius) == (295.0, 365.0, math.inf)
    assert {place for name, place in one.values if name == "Q"} >= {"wheelset 1 left"}


def test_more_cant_deficiency_takes_the_two_dimensional_method():
    plan = [e for r in (290.0, 310.0, 330.0) for e in curve(r, 500.0)]
    run = made(track(*plan, cant=0.12), 23.0, Y=lambda t, s: both_sides(-1e3 + 0.0 * s))
    (found,) = assess(run)
    row = rows_of(found, "4", "sum_Y")["wheelset 1"]
    assert row.estimate.method == "two"
    assert row.estimate.value == pytest.approx(1e3, rel=1e-6)
    # the straights between them are too short for a section: told, and no zone
    assert any("a section needs" in note for z in found.zones for note in z.notes)


def test_regression_shows_the_limit_of_each_population():
    """90 kN + Q0 of two static loads; one of them alone stood over the values of both."""
    plan = [e for r in (290.0, 330.0) for e in curve(r, 250.0, run=50.0)]

    def run(friction, load):
        on = track(*plan, cant=0.12).replace(friction=friction)
        whole = made(on, 23.0, Y=lambda t, s: both_sides(-1e3 + 0.0 * s))
        arrays = {n: whole[n] for n in whole} | {"Q0": np.full((4, 2), load)}
        return Result(arrays, whole.quantities, whole.coordinates, whole.attributes, whole.profiles)

    figure = regression_figure(assess({"light": run(0.4, 30e3), "heavy": run(0.5, 60e3)}))
    flat = [line for line in figure.axes[0].lines if list(line.get_xdata()) == [0, 1]]
    assert sorted(line.get_ydata()[0] for line in flat) == pytest.approx([120.0, 150.0])


def test_derailed_run_is_no_pass():
    (found,) = assess(made(track(STRAIGHT), FAST, status="derailed"))
    assert found.verdict == "derailed"
    assert found.exceeded
    # what climbed is said with comfort, wear and safety too: their values end before it
    (found,) = assess(made(track(STRAIGHT), FAST, status="derailed"), "comfort")
    said = "run: derailed, made up; only the part before that is assessed"
    assert any(remark.endswith(said) for remark in found.remarks), found.remarks
    # the criterion of derailment itself
    (found,) = assess(made(track(STRAIGHT), FAST, status="derailed"), "safety")
    assert found.exceeded


@pytest.mark.parametrize(("quotient", "exceeded"), [(1.11, False), (1.13, True)])
def test_nadals_limit_counts_for_the_exit_status(quotient, exceeded):
    """S1002 has 70 degrees: 1.12 with friction 0.4."""
    profiles = {"S1002": load_profile("S1002"), "60E1": load_profile("60E1")}
    pushed = 2.0 * quotient * Q0
    how = {"Y": lambda t, s: both_sides(pushed + 0.0 * s), "profiles": profiles}
    run = made(track(STRAIGHT), FAST, **how)
    assert assess(run, "safety")[0].exceeded == exceeded


def test_remarks_of_several_runs_name_theirs():
    run = made(track(STRAIGHT), FAST)
    facts = {**run.attributes, "remarks": "A wheel lifts off."}
    lifts = Result({n: run[n] for n in run}, run.quantities, run.coordinates, facts, run.profiles)
    for standard in ("safety", "en14363"):
        (found,) = assess({"calm": run, "lifts": lifts}, standard)
        lines = str(found).splitlines()
        assert repr(found).startswith(f"<Assessment: {found.vehicle}, {standard}")
        assert "<p>remark: lifts: A wheel lifts off.</p>" in found._repr_html_()
        assert "remark: lifts: A wheel lifts off." in lines
        (found,) = assess({"first": lifts, "second": lifts}, standard)
        lines = str(found).splitlines()
        assert "remark: 2 runs: A wheel lifts off." in lines


def test_excess_is_a_failure_even_with_few_sections():
    (found,) = assess(made(track(STRAIGHT), FAST, Y=lambda t, s: both_sides(60e3 + 0.0 * s)))
    assert found.verdict == "fail"
    assert any("track shift force" in reason for reason in found.reasons)


def test_track_quality_stands_beside_the_sections():
    random = {"type": "random", "spectrum": "erri_b176_low", "seed": 3}
    (found,) = assess(made(track(STRAIGHT, irregularities=[random]), FAST))
    assert len(found.quality) == 6
    alignment = np.mean([q.alignment for q in found.quality])
    # 0.71 mm of the whole spectrum in 3 to 25 m; the worse rail, six sections of 250 m
    assert alignment == pytest.approx(0.71e-3, rel=0.2)
    rows = found.record()["sections"]
    assert all(row["alignment_largest"] > 2.0 * row["alignment"] for row in rows)
    assert {"alignment_D2", "level_D3", "level_largest"} <= rows[0].keys()
    assert {row["defects"] for row in rows} == {"better than QN1"}


def test_track_quality_is_judged_at_the_admissible_speed(monkeypatch):
    """Level of 1.3 mm: QN1 is 1.4 mm up to 160 km/h and 1.2 mm up to 200 km/h; run at 1.1 V."""
    found = {"deviations": (0.5e-3, 1.3e-3), "further": {"defects": "better than QN1"}}
    quality = Mock(**{f"return_value.{name}.return_value": value for name, value in found.items()})
    monkeypatch.setattr(running, "TrackQuality", quality)
    random = {"type": "random", "spectrum": "erri_b176_low", "seed": 3}
    on = track(STRAIGHT, irregularities=[random])
    for admissible, better in ((44.0, True), (48.0, False)):
        service = Service(admissible_speed=admissible, cant_deficiency=0.15)
        (found,) = assess(made(on, 1.1 * admissible), service=service)
        classes = {row.quality for row in found.quality}
        assert classes == {"better than QN1" if better else "between QN1 and QN2"}


@pytest.mark.parametrize(("change", "message"), [
    ({"without": ("Q",)}, r"Q: is not in the result; run it with settings.outputs.quantities"),
    ({"without": ("Y",)}, r"Y: is not in the result; run it with settings.outputs.quantities"),
    ({"rate": 200.0, "settings": "{}"}, r"200 samples per second; at least 1000"),
    ({"settings": '{"outputs": {"low_pass": {"frequency": 5.0}}, "output_rate": 200.0}'},
     r"low-pass filtered at 5 Hz by the run; at least 1000 .* at 40 Hz or more"),
    ({"until": 100.0}, r"too short for one section"),
])  # fmt: skip
def test_what_cannot_be_assessed_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        assess(made(track(STRAIGHT), FAST, **change))


def test_run_without_a_whole_section_says_how_long_one_is():
    (found,) = assess(made(track(STRAIGHT), FAST, until=300.0))
    assert found.verdict == "incomplete"
    assert any("m of a straight, a section needs 250 m" in reason for reason in found.reasons)


def test_coarse_samples_are_taken_when_asked_and_told():
    (found,) = assess(made(track(STRAIGHT), FAST, rate=200.0, settings="{}"), coarse=True)
    assert any("too few for instantaneous" in remark for remark in found.remarks)


def test_run_without_what_the_filters_pass_is_taken_when_asked_and_told():
    settings = '{"outputs": {"low_pass": {"frequency": 5.0}}, "output_rate": 200.0}'
    (found,) = assess(made(track(STRAIGHT), FAST, settings=settings), coarse=True)
    assert any("filtered at 5 Hz by the run: what" in remark for remark in found.remarks)


def test_low_passed_samples_are_fine():
    settings = '{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}'
    (found,) = assess(made(track(STRAIGHT), FAST, rate=200.0, settings=settings))
    assert found.verdict == "incomplete"


def test_vehicle_without_a_service_table_is_refused():
    bare = railsim.load_vehicle("coach_manchester", []).model_dump(exclude_none=True)
    bare.pop("service")
    vehicle = railsim.load_vehicle("coach_manchester").__class__.model_validate(bare).to_toml()
    with pytest.raises(InputError, match=r"no service table"):
        assess(made(track(STRAIGHT), FAST, vehicle=vehicle))


@pytest.mark.parametrize(("standard", "option", "value"), [
    ("wear", "limits", "en14363"),
    ("safety", "limits", "en14363"),
    ("comfort", "law", "usfd"),
    ("comfort", "admissible_speed", 30.0),
    ("wear", "causal", True),
    ("comfort", "sections", "sections.toml"),
    ("safety", "method", "simplified"),
    ("comfort", "all_sections", True),
])  # fmt: skip
def test_options_that_a_standard_does_not_use_are_refused(
    short_run, capsys, standard, option, value
):
    name = "--" + option.replace("_", "-")
    given = [name] if value is True else [name, str(value)]
    assert main(["assess", short_run, "--standard", standard, *given]) == 2
    assert f"{name}: not used by the standard '{standard}'; only with" in capsys.readouterr().err


def test_conditions_of_a_vehicle_with_different_limits_are_not_assessed_together():
    coach = railsim.load_vehicle("coach_manchester")
    runs = {}
    for condition, deficiency in (("new", 0.15), ("worn", 0.13)):
        service = {"service.condition": condition, "service.cant_deficiency": deficiency}
        vehicle = coach.with_values(service).to_toml()
        runs[condition] = made(track(STRAIGHT), FAST, vehicle=vehicle)
    with pytest.raises(InputError, match=r"service\.cant_deficiency: 0\.1[35], 0\.1[35]; the same"):
        assess(runs)
    (found,) = assess(runs, service=coach.service)
    assert found.verdict == "incomplete"


def test_limits_file_with_an_unknown_key_is_refused(tmp_path):
    limits = tmp_path / "own.toml"
    limits.write_text('format = "railsim-limits/1"\nextends = "en14363"\nsum_Z = 3\n')
    with pytest.raises(InputError, match=r"sum_Z"):
        assess(made(track(STRAIGHT), FAST), limits=limits)


def test_own_limits_replace_single_values(tmp_path):
    limits = tmp_path / "own.toml"
    limits.write_text(
        'format = "railsim-limits/1"\nextends = "en14363"\n'
        '[limits.Y_over_Q]\nvalue = 0.7\nsource = "our own"\nchecked = true\n'
    )
    (found,) = assess(steady(1), limits=limits)
    row = rows_of(found, "4", "Y_over_Q")["wheelset 1 outer"]
    assert (row.limit, row.source, row.checked) == (0.7, "our own", True)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("deciding = []", "deciding: 0 values; a list of 1 at least"),
        ('limits.Q_qst = {vlaue = 1.0, source = "own"}', "unknown key; did you mean 'value'"),
        ("limits.Q_qst.value = 1.0", "limits.Q_qst.source: missing"),
        ("statistics.k.safety = 2.0", "statistics.source: missing"),
        ('zones.4 = {section_above = 1e-9, source = "own"}', "greater than or equal to 5"),
        (
            'remove = ["limits.sum_Y.k1.passenger"]',
            "limits.sum_Y.k1: no 'passenger'; the vehicle's category",
        ),
    ],
)
def test_limits_at_the_borders_of_what_they_say_are_told_by_file_and_key(text, words, tmp_path):
    """Some ended without words of their own, in 10^10 sections, or with the source of another."""
    file = tmp_path / "own.toml"
    file.write_text(f'format = "railsim-limits/1"\nextends = "en14363"\n{text}\n')
    with pytest.raises(InputError, match=words) as caught:
        assess(made(track(STRAIGHT), FAST, until=400.0), limits=file)
    assert str(caught.value).startswith(str(file))


def test_an_own_value_does_not_take_over_that_another_was_checked(tmp_path):
    checked = tmp_path / "checked.toml"
    checked.write_text('extends = "stationary"\nunloading = {checked = true}\n')
    assert load_stationary_limits(checked).unloading.checked
    own = tmp_path / "own.toml"
    own.write_text('extends = "checked.toml"\nunloading = {value = 0.5, source = "own"}\n')
    with pytest.raises(InputError, match=r"own\.toml: unloading\.checked: missing"):
        load_stationary_limits(own)


def test_comfort_of_known_vibration():
    run = made(track(STRAIGHT), FAST, lateral=lambda t: 0.2 * np.sin(2 * np.pi * 1.25 * t))
    (found,) = assess(run, "comfort")
    points = next(iter(found.comfort.values()))
    middle = next(p for p in points if p.sensor == "floor_middle")
    assert pytest.approx(6.0 * 0.14250, rel=0.01) == middle.mean.N_MV
    assert any("60" in remark for remark in found.remarks)
    # of a sine MTVV is a_w, and VDV 1.11 a_w T^(1/4); shocks of round-off are none
    assert not any("underestimate" in remark for remark in found.remarks)
    quiet = replace(middle, MTVV=np.full(3, 9e-3), iso_rms=np.full(3, 1e-3))
    assert not shock_remark([quiet])
    assert shock_remark([replace(quiet, MTVV=np.full(3, 1.1e-2))])


def test_shock_in_two_parts_of_a_run_is_in_the_values_of_iso_2631():
    """5 Hz of 0.1 m/s2 upwards, 1 m/s2 for 1 s: half before, half after 63 s, where parts meet.

    Wk is 1.039 at 5 Hz; a sine has 1/2 of the square and 3/8 of the fourth power of its amplitude.
    """

    def vertical(t):
        a = np.zeros((len(t), len(BODIES), 3))
        size = np.where((t >= 62.5) & (t < 63.5), 1.0, 0.1)
        a[:, 0, 2] = size * np.sin(2.0 * np.pi * 5.0 * (t - 62.5))
        return a

    run = made(track({"type": "STR", "length": 2500.0}), 20.0, accelerations=vertical)
    (found,) = assess(run, "comfort")
    middle = next(p for p in next(iter(found.comfort.values())) if p.sensor == "floor_middle")
    assert middle.MTVV[2] == pytest.approx(1.039 / math.sqrt(2.0), rel=0.03)
    dose = 1.039 * (0.375 * (1.0 + 121.0 * 1e-4)) ** 0.25
    assert middle.VDV[2] == pytest.approx(dose, rel=0.03)
    assert middle.record(load_comfort_limits("comfort"))["iso2631_VDV"][2] == middle.VDV[2]
    (table,) = tables(found)
    assert {"MTVV", "VDV"} <= {column.name for column in table.columns}
    # a_w^2 = 1.039^2 (1 + 0.01 (T - 1))/(2 T)
    (said,) = (remark for remark in found.remarks if "may underestimate shocks" in remark)
    T = middle.duration
    a_w = 1.039 * math.sqrt((1.0 + 0.01 * (T - 1.0)) / (2.0 * T))
    ratios = middle.MTVV[2] / middle.iso_rms[2], middle.VDV[2] / middle.iso_rms[2] / T**0.25
    assert ratios == pytest.approx((1.039 / math.sqrt(2.0) / a_w, dose / a_w / T**0.25), rel=0.03)
    assert f"MTVV/a_w {ratios[0]:.2f} > 1.5 along z" in said
    assert f"VDV/(a_w T^1/4) {ratios[1]:.2f} > 1.75 along z" in said


def test_wear_of_a_known_wear_number():
    def T_gamma(t, s):
        return np.stack([np.full(s.shape, 65.0), np.full(s.shape, 250.0)], axis=-1)

    (found,) = assess(made(track(STRAIGHT), FAST, T_gamma=T_gamma), "wear")
    left, right = next(iter(found.wear.values()))[:2]
    assert 1e6 * left.rail_damage == pytest.approx(10.0)
    assert 1e9 * right.worn_area["pearce_sherratt"] == pytest.approx(0.1560, rel=5e-4)
    assert left.percentiles["95"] == pytest.approx(65.0, abs=left.bound)
    # a wagon of two wheelsets first: those of the coach that it has not had no names
    ((run, wheels),) = found.wear.items()
    wagon = replace(found, vehicle="wagon", wear={run: wheels[:4]})
    figure = assessment_figure([wagon, found])
    places = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert places == [wheel.place for wheel in wheels]
    assert figure.get_suptitle().split("\n")[0] == "wagon"
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == [f"{run}, {3.6 * FAST:.0f} km/h"] * 2
    # bars of one wheel lie side by side about its tick, those of the next one clear of them
    bars = [
        [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in one]
        for one in figure.axes[0].containers
    ]
    for k in range(4):
        (low, middle), (after, high) = bars[0][k], bars[1][k]
        assert k - 0.5 < low < middle < after < high < k + 0.5
        assert low + high == pytest.approx(2.0 * k)


def test_rails_without_damage_have_an_axis_from_zero_on():
    """It went from -0.05 to 0.05, and the panel was empty."""
    run = made(track(STRAIGHT), FAST, T_gamma=lambda t, s: both_sides(5.0 + 0.0 * s))
    damage = assessment_figure(list(assess(run, "wear"))).axes[1]
    assert damage.get_xlim()[0] == 0.0
    assert damage.texts[0].get_text() == "0 of every wheel"


def with_patches(whole, patches):
    """A run with quantities of its contact patches."""
    return Result(
        {name: whole[name] for name in whole} | patches,
        dict(whole.quantities) | {name: REQUESTED[name] for name in patches},
        dict(whole.coordinates) | {"patch": PATCHES}, whole.attributes, whole.profiles,
    )  # fmt: skip


def wheel_with_patches(*T_gamma, along=(-1.0, -1.0, -1.0), law=None):
    """Wear of a wheel whose patches have these wear numbers [N], each of 4 mm by 4 mm if any.

    `along`: Sign of their forces on the rail along travel.
    """
    run = made(track(STRAIGHT), FAST, T_gamma=lambda t, s: both_sides(sum(T_gamma) + 0.0 * s))
    each = np.broadcast_to(T_gamma, (*run.T_gamma.shape, 3))
    loaded = np.sign(each)
    patches = {
        "patch_T_gamma": each, "patch_N": 40e3 * loaded, "patch_a": 2e-3 * loaded,
        "patch_b": 2e-3 * loaded, "patch_T_x": 5e3 * loaded * along, "patch_T_y": 0.0 * each,
    }  # fmt: skip
    (found,) = assess(with_patches(run, patches), "wear", law=law)
    # another threshold than the printed 15 N, or other forces than those against travel, is said
    said = [words for words in found.remarks if "Whole Life Rail Model" in words]
    wheel = next(iter(found.wear.values()))[0]
    assert bool(said) == ((wheel.model.threshold, wheel.model.counted) != (15.0, "against"))
    return wheel


def test_laws_of_wear_hold_for_each_patch():
    """150 N and 50 N on 12.57 mm2 each, D 920 mm, by hand.

    Pearce and Sherratt (25 + 12.5)/D; USFD 55 ug/(m mm2) A and 5.3 ug/(m N) 50 N; WLRM 2.27e-6 and
    7e-6, of which one part of the rail has the larger.
    """
    wheel = wheel_with_patches(150.0, 0.0, 50.0)
    assert wheel.worn_area["pearce_sherratt"] == pytest.approx(37.5 / 920.0 * 1e-9)
    mass = (55.0 * np.pi * 2.0**2 + 5.3 * 50.0) * 1e-9  # kg/m
    assert wheel.worn_area["usfd"] == pytest.approx(mass / (7850.0 * np.pi * 0.92))
    assert wheel.rail_damage == pytest.approx(7e-6)


@pytest.mark.parametrize(("strong", "damage"), [(285.0, -10e-6), (197.0, 5e-6)])
def test_rail_damage_is_that_of_the_part_with_the_largest_magnitude(strong, damage):
    """One part at 40 N, +5e-6; the other wears: (175 - T)/110 of 1e-5."""
    assert wheel_with_patches(40.0, strong, 0.0).rail_damage == pytest.approx(damage)


@pytest.mark.parametrize(("counted", "T_gamma", "damage"), [
    ("against", 65.0, 5e-6), ("along", 65.0, 10e-6), ("all", 65.0, 10e-6), ("all", 197.0, 5e-6),
])  # fmt: skip
def test_threshold_and_direction_of_the_rail_damage_are_in_a_file(
    tmp_path, counted, T_gamma, damage
):
    """From 20 N: (42.5 - 20)/(65 - 20) of 1e-5 against travel; 197 N along it are -2e-6."""
    (file := tmp_path / "rail.toml").write_text(
        'format = "railsim-wear-law/1"\nname = "own"\nsource = "made up"\n'
        f'[whole_life_rail_model]\nthreshold = 20.0\ncounted = "{counted}"\n'
    )
    wheel = wheel_with_patches(42.5, 0.0, T_gamma, along=(-1.0, 1.0, 1.0), law=str(file))
    assert wheel.rail_damage == pytest.approx(damage)
    assert list(wheel.worn_area) == ["pearce_sherratt", "usfd"]
    assert 1e6 * wheel.model(np.array([20.0, 42.5])) == pytest.approx([0.0, 5.0])
    with pytest.raises(InputError, match="no law of wear; archard or krause_poll"):
        wear_law(str(file))


def by_hand(T, area, against, D):
    """Pearce and Sherratt [mm2/km], USFD [ug/m] and WLRM [1e-6] of wear numbers, as printed."""
    pearce = np.where(T < 100.0, 0.25 * T, np.where(T < 200.0, 25.0, 1.19 * T - 154.0)) / D
    x = np.divide(T, area, out=np.zeros_like(T), where=area > 0.0)  # N/mm2
    usfd = np.where(x < 10.4, 5.3 * x, np.where(x < 77.2, 55.0, 55.0 + 61.9 * (x - 77.2))) * area
    damage = np.interp(T, [15.0, 65.0, 175.0, 11175.0], [0.0, 10.0, 0.0, -1000.0])
    return pearce, usfd, np.where(against, damage, 0.0)


@pytest.mark.parametrize("patched", [False, True])
def test_wear_of_any_run_is_the_mean_over_the_distance_of_the_printed_laws(patched):
    """Random wear numbers on a run whose speed changes; the first three seconds do not count."""
    random = np.random.default_rng(8)
    whole = made(track(STRAIGHT), FAST, until=160.0, **FINE)
    shape = whole.T_gamma.shape
    way = FAST / 1000.0 * (1.0 + np.linspace(0.0, 0.5, shape[0]))
    T = random.lognormal(4.0, 1.0, (*shape, 3)) * random.integers(0, 2, (*shape, 3))
    T_x = random.normal(size=T.shape)
    changed = {"distance": np.cumsum(way), "T_gamma": T.sum(axis=-1), "xi_x": T_x.sum(axis=-1)}
    arrays = {name: whole[name] for name in whole} | changed
    whole = Result(arrays, whole.quantities, whole.coordinates, whole.attributes, whole.profiles)
    area = np.where(random.uniform(size=T.shape) < 0.7, 12.0 * np.pi, 0.0)  # mm2
    if patched:
        T = np.where(area > 0.0, T, 0.0)
        whole = with_patches(whole, {
            "patch_T_gamma": T, "patch_N": 1e4 * np.sign(area), "patch_a": 4e-3 + 0.0 * T,
            "patch_b": 3e-3 + 0.0 * T, "patch_T_x": T_x, "patch_T_y": 0.0 * T,
        })  # fmt: skip
    else:
        T, T_x, area = whole.T_gamma[..., None], whole.xi_x[..., None], 0.0
    (found,) = assess(whole, "wear")
    missing = "run: USFD and FI_surf have no values without contact patches; run with"
    assert any(remark.startswith(missing) for remark in found.remarks) is not patched
    counted = slice(3000, len(way) - 1)  # the last step of a run may be shorter
    ways = np.gradient(whole.distance)[counted, None, None, None]
    pearce, usfd, damage = by_hand(T, area + 0.0 * T, T_x < 0.0, 920.0)
    for k, wheel in enumerate(next(iter(found.wear.values()))):
        own = counted, k // 2, k % 2

        def mean(x, own=own, ways=ways[:, 0, 0]):
            return np.sum(x[own] * ways, axis=0) / np.sum(ways)

        number = whole.T_gamma[own]
        assert wheel.place == f"wheelset {k // 2 + 1} {('left', 'right')[k % 2]}"
        assert wheel.T_gamma == pytest.approx(np.sum(number * ways[:, 0, 0, 0]) / np.sum(ways))
        assert list(wheel.percentiles) == ["50", "95", "99.85"]
        for share, value in wheel.percentiles.items():
            exact = np.percentile(number, float(share), method="higher")
            assert value == pytest.approx(exact, abs=wheel.bound)
        assert wheel.worn_area["pearce_sherratt"] == pytest.approx(1e-9 * mean(pearce).sum())
        parts = mean(damage)
        assert wheel.rail_damage == pytest.approx(1e-6 * parts[np.argmax(np.abs(parts))])
        if patched:
            expected = 1e-9 * mean(usfd).sum() / (7850.0 * np.pi * 0.92)
            assert wheel.worn_area["usfd"] == pytest.approx(expected)


def test_surface_fatigue_is_that_of_the_worst_patch():
    """FI = T/N - 2 pi a b k/(3 N) (Ekberg 2002), and where it lies in the shakedown map."""
    whole = made(track(STRAIGHT), FAST)
    zero = np.zeros((*whole.T_gamma.shape, 3))
    T = zero.copy()
    T[:, :, 0, 0], T[:, :, 1, 2] = 4e3, 12e3
    patches = {
        "patch_T_gamma": zero, "patch_N": zero + 40e3, "patch_a": zero + 4e-3,
        "patch_b": zero + 3e-3, "patch_T_x": -T, "patch_T_y": zero,
    }  # fmt: skip
    run = with_patches(whole, patches)
    (found,) = assess(run, "wear")
    p0 = 1.5 * 40e3 / (np.pi * 4e-3 * 3e-3)
    left, right = next(iter(found.wear.values()))[:2]
    for wheel, T_over_N in ((left, 0.1), (right, 0.3)):
        assert wheel.utilised_friction == pytest.approx(T_over_N)
        assert wheel.pressure_ratio * (T_over_N - wheel.fatigue_index) == pytest.approx(1.0)
        assert wheel.fatigue_index == pytest.approx(T_over_N - 300e6 / p0)


def test_command_prints_writes_and_fails_only_when_asked(hunting_file, tmp_path, capsys, undrawn):
    path = hunting_file
    assert main(["assess", path]) == 0
    shown = capsys.readouterr().out
    assert "verdict: incomplete" in shown
    assert "not checked against the printed standard" in shown
    with undrawn():
        assert main(["assess", path, "--json", "--out", str(tmp_path / "out")]) == 0
    data = json.loads(capsys.readouterr().out)[0]
    assert data["standard"] == "en14363"
    keys = {"name", "place", "mean", "deviation", "estimate", "limit", "share", "source", "checked"}
    assert keys <= set(data["zones"][0]["quantities"][0])
    names = {p.name for p in (tmp_path / "out").iterdir()}
    # no values over the cant deficiency on straight track
    assert names == set(FILES) - {"assessment_regression.png"}
    assert main(["assess", path, "--out", str(tmp_path / "out")]) == 2
    assert main(["assess", path, "--fail"]) == 0
    bad = made(track(STRAIGHT), FAST, Y=lambda t, s: both_sides(60e3 + 0.0 * s))
    assert main(["assess", str(bad.to_hdf5(tmp_path / "bad.h5")), "--fail"]) == 4


def test_runs_of_a_study_without_a_result_are_named(hunting, tmp_path, capsys):
    """One failed, one is waiting, three were not kept: the verdict is that of the others."""
    hunting.to_hdf5(tmp_path / "there.h5")
    ends = ["failed", "waiting", "complete", "complete", "complete"]
    lacking = [(f"run_{number}", end) for number, end in enumerate(ends, start=1)]
    runs = [
        {"name": n, "file": f"{n}.h5", "status": s} for n, s in [("there", "complete"), *lacking]
    ]
    inputs = {"vehicles": ["coach_25t"], "tracks": ["straight"], "speeds": [20.0]}
    index = {"format": "railsim-study-result/1", "status": "incomplete", "inputs": inputs}
    (tmp_path / "study.json").write_text(json.dumps({**index, "runs": runs}))
    given = ["assess", str(tmp_path), "--coarse", "--quiet"]
    assert main(given) == 0
    words = "of 5 runs: run_1 (failed), run_2 (waiting), run_3 (complete) and 2 more"
    assert f"no result file in {tmp_path} {words}" in capsys.readouterr().err
    (tmp_path / "study.json").write_text("{")
    assert main(given) == 0  # the results are there all the same
    assert "runs without a result file are not named: " in capsys.readouterr().err
    (tmp_path / "study.json").unlink()
    assert main(given) == 0
    assert "result file" not in capsys.readouterr().err


def test_runs_of_a_killed_study_without_a_result_are_named(hunting, tmp_path, capsys):
    """It has a journal alone: `study.json` is written where a study ends."""
    file = hunting.to_hdf5(tmp_path / "there.h5").stat()
    runs = ("there", "complete", file), ("cut", "failed", None), ("bare", "complete", None)
    with Journal(tmp_path) as journal:
        for name, status, found in runs:
            record = {"name": name, "file": f"{name}.h5", "labels": {}, "status": status}
            journal.add(record, "key", found)
    given = ["assess", str(tmp_path), "--coarse", "--quiet"]
    assert main(given) == 0
    words = "no result file in {} of 2 runs: cut (failed), bare (complete)"
    assert words.format(tmp_path) in capsys.readouterr().err
    with Journal(tmp_path):  # held by a study that goes on
        assert main(given) == 0
    assert "are not named: out: another study is writing" in capsys.readouterr().err


def test_option_of_the_command_leaves_each_vehicle_the_rest_of_its_service_table(
    hunting, hunting_file, tmp_path, capsys
):
    """k1 of a wagon is 0.85, whichever vehicle comes first; benchmark's Q0: 46.36 kN for k1 = 1."""
    coach = hunting.vehicle()
    wagon = coach.with_values({"name": "A wagon", "service.category": "freight"})
    one = made(track(STRAIGHT), FAST, vehicle=wagon.to_toml())
    paths = [hunting_file, str(one.to_hdf5(tmp_path / "wagon.h5"))]
    for order in (paths, paths[::-1]):
        assert main(["assess", *order, "--admissible-speed", "33.4", "--coarse", "--json"]) == 0
        limits = {
            found["vehicle"]: row["limit"] for found in json.loads(capsys.readouterr().out)
            for row in found["zones"][0]["quantities"] if row["name"] == "sum_Y"
        }  # fmt: skip
        assert limits[coach.name] == pytest.approx(46.36e3, rel=1e-3)
        assert limits["A wagon"] == pytest.approx(0.85 * 46.36e3, rel=1e-3)


def test_an_option_chooses_no_condition_for_the_rest_of_the_service_table(
    hunting, tmp_path, capsys
):
    """Two conditions of a vehicle for 120 and 90 km/h; the cant deficiency alone is given."""
    coach = hunting.vehicle().with_values({"service.condition": "new"})
    slow = coach.with_values({"service.condition": "worn", "service.admissible_speed": 25.0})
    made_of = {"new": coach, "worn": slow}
    paths = [str(made(track(STRAIGHT), FAST, vehicle=v.to_toml()).to_hdf5(tmp_path / f"{n}.h5"))
             for n, v in made_of.items()]  # fmt: skip
    given = ["assess", *paths, "--cant-deficiency", "0.14", "--coarse"]
    assert main(given) == 2
    assert "vehicle.service.admissible_speed" in capsys.readouterr().err
    assert main([*given, "--admissible-speed", "33.4"]) == 0
    assert main([*given, "--admissible-speed", "0"]) == 2
    assert "--admissible-speed: found 0.0; " in capsys.readouterr().err


@pytest.mark.parametrize("standard", ["comfort", "wear"])
def test_command_of_other_standards(hunting_file, tmp_path, capsys, standard):
    out = str(tmp_path / standard)
    assert main(["assess", hunting_file, "--standard", standard, "--out", out]) == 0
    assert "wheelset 1 left" in (shown := capsys.readouterr().out) or "floor_middle" in shown
    assert (tmp_path / standard / "assessment.png").stat().st_size > 5000


def test_wrong_command_lines_end_with_status_2(hunting_file, tmp_path, capsys):
    path = hunting_file
    (tmp_path / "empty").mkdir()
    for wrong in (
        [str(tmp_path / "no.h5")], [path, path], [str(tmp_path / "empty")],
        [path, "--limits", "nothing"], [path, "--limits", "comfort"],
        [path, "--cant-deficiency", "-1"],
        [path, "--cant-deficiency", "100"],
    ):  # fmt: skip
        assert main(["assess", *wrong]) == 2, wrong
        assert "Traceback" not in capsys.readouterr().err


def test_simulated_coach_feels_the_uncompensated_acceleration():
    """R 250 m, cant 150 mm, 20 m/s: 0.814 m/s2 at the floor, not 1.593; 1 %."""
    settings = railsim.load_settings(None, ["output_rate=1000"])
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250"),
        speed=20.0, start=388.0, duration=1.0, settings=settings,
    )  # fmt: skip
    from railsim.assessment.record import Record

    record = Record(run, "run")
    acceleration = record.readings(slice(0, record.rows))[0]
    middle = list(record.sensors).index("floor_middle")
    there = np.abs(record.distance[: record.rows] - 390.0) < 5.0
    assert np.mean(acceleration[there, middle, 1]) == pytest.approx(0.814, rel=0.01)


@pytest.mark.parametrize(("duration", "counted", "status"), [(3.0, 1, 2), (3.1, 2, 0)])
def test_wear_of_a_run_that_ended_soon(duration, counted, status, tmp_path, capsys):
    """The first 3 s do not count, and the last instant neither; one between them is enough."""
    result = example_result(duration=duration, rate=10.0)
    assert np.count_nonzero(result.time >= 3.0) == counted
    path = result.to_hdf5(tmp_path / "run.h5")
    assert main(["assess", str(path), "--standard", "wear", "--coarse", "--json"]) == status
    said = capsys.readouterr()
    assert "NaN" not in said.out
    words = "run: time: 3 s; more than the first 3 s, which do not count\n"
    assert said.err == (words if status == 2 else "")


@pytest.mark.parametrize("standard", ["comfort", "wear"])
def test_a_run_that_is_too_short_is_named_and_the_others_are_assessed(standard, tmp_path, capsys):
    """As those of EN 14363, a run without a section; also with --quiet."""
    lasting = {"first": 3.0, "long": 20.0, "last": 1.0}
    ended = {"last": {"status": "derailed"}}
    made_up = {
        n: example_result(duration=t, rate=10.0, **ended.get(n, {})) for n, t in lasting.items()
    }
    paths = [str(result.to_hdf5(tmp_path / f"{name}.h5")) for name, result in made_up.items()]
    given = ["--standard", standard, "--coarse", "--quiet"]
    assert main(["assess", *paths, *given]) == 0
    shown = capsys.readouterr().out.splitlines()
    left = [line for line in shown if line.startswith("remark: not assessed: ")]
    assert [line.split(": ")[2] for line in left] == ["first", "last"]
    assert any(line.startswith("long") for line in shown)
    assert not any(line.startswith(("first", "last")) for line in shown)
    assert main(["assess", *paths, *given[:-1]]) == 0  # without --quiet
    assert "remark: last: derailed\n" in capsys.readouterr().out
    assert main(["assess", paths[0], paths[2], *given]) == 2
    faults = capsys.readouterr().err.splitlines()
    assert [line.split(":")[0] for line in faults] == ["first", "last"]


def test_in_a_study_the_largest_value_of_a_section_is_a_number():
    """The guiding force rises along the track: its median in the last section, with its unit."""
    run = linear()
    (found,) = assess(run)
    asked = {"own": AssessAnalysis(kind="assess")}
    case = SimpleNamespace(analyses=asked, settings=run.settings(), speed=20.0)
    numbers, _ = numbers_and_remarks(case, run)
    last = max(s.section.end for s in found.sections if s.counts) - 35.0
    assert numbers["own.Y_qst_largest"] == pytest.approx(10e3 + 50.0 * last, abs=5.0)
    assert unit_of_number("own.Y_qst_largest") == "N"


@pytest.mark.parametrize("standard", ["comfort", "wear"])
def test_in_a_study_a_run_that_ended_before_its_assessment_is_no_failure(standard):
    """It derailed, as its status says, and has no values; a whole run is too short by its input."""
    asked = {"own": AssessAnalysis(kind="assess", standard=standard)}
    case = SimpleNamespace(analyses=asked)
    short = example_result(duration=2.0, rate=100.0, status="derailed")
    numbers, (remark,) = numbers_and_remarks(case, short)
    assert not numbers
    assert remark.startswith("own: not assessed: run: time: ")
    with pytest.raises(InputError, match="time: "):
        numbers_and_remarks(case, example_result(duration=2.0, rate=100.0))


@pytest.mark.parametrize("instant", [40.0, 63.0])
def test_an_event_counts_wherever_it_is(instant):
    """Also where a run is read in pieces of 60 s after the first 3 s: a bump of the car body."""

    def bump(time):
        return 1.5 * np.exp(-(((time - instant) / 0.5) ** 2))

    run = made(track({"type": "STR", "length": 2000.0}), 20.0, rate=200.0, lateral=bump,
               settings='{"outputs": {"low_pass": {"frequency": 50.0}}}')  # fmt: skip
    (found,) = assess(run, "comfort")
    points = next(iter(found.comfort.values()))
    events = next(p.events for p in points if p.sensor == "floor_middle")
    assert events == pytest.approx(event_comfort(bump(run["time"]), 200.0), rel=1e-3)
    assert events["standing"] > 5.0


def test_hunting_is_named_as_the_cause_of_discomfort():
    """A tone of 5 Hz beside one of 1.25 Hz: Wd is 0.409 and 1.008 there (ISO 2631-1, table 3)."""

    def lateral(t):
        return 0.5 * np.sin(2 * np.pi * 5.0 * t) + 0.2 * np.sin(2 * np.pi * 1.25 * t)

    run = made(track(STRAIGHT), FAST, lateral=lateral)
    (calm,) = assess(run, "comfort")
    assert not any("hunting" in remark for remark in calm.remarks)
    sentence = "The vehicle hunts at 5.0 Hz, 7.0 mm, wheelsets 1 to 4, from s = 0 m."
    facts = {**run.attributes, "hunting_frequency": 5.0, "remarks": sentence}
    arrays = {name: run[name] for name in run}
    hunting = Result(arrays, run.quantities, run.coordinates, facts, run.profiles)
    (found,) = assess({"fast": hunting}, "comfort")
    assert f"fast: {sentence}" in found.remarks
    five, one = 0.5 * 0.409, 0.2 * 1.008
    share = next(p.hunting for p in found.comfort["fast"] if p.sensor == "floor_middle")
    assert share == pytest.approx(five**2 / (five**2 + one**2), abs=0.03)
    assert any("hunting at 5.0 Hz makes up" in remark for remark in found.remarks)


ARCHARD = """format = "railsim-wear-law/1"
name = "our rig"
source = "made up"
[archard]
hardness = 2e9
pressure = 0.8
speeds = [0.2, 0.7]
slow = 1e-4
medium = 1e-4
fast = 1e-4
seizure = 1e-4
"""


def test_law_of_a_file_in_the_assessment(tmp_path, capsys):
    """Archard with one coefficient: k T_gamma/(mu H) over the circumference, patch by patch."""
    law = tmp_path / "rig.toml"
    law.write_text(ARCHARD)
    run = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("straight"), speed=20.0,
        duration=4.0, settings=railsim.load_settings(
            None, ["output_rate=1000", "outputs.contact_patches=true"]),
    )  # fmt: skip
    (found,) = assess(run, "wear", law=str(law))
    wheel = next(iter(found.wear.values()))[0]
    (area,) = wheel.worn_area.values()
    mu = run.track().friction[0]
    expected = 1e-4 * wheel.T_gamma / mu / 2e9 / (np.pi * 0.92)
    assert area == pytest.approx(expected, rel=2e-2)  # patches with spin against creepage wear none
    path = str(run.to_hdf5(tmp_path / "run.h5"))
    assert main(["assess", path, "--standard", "wear", "--law", str(law)]) == 0
    assert "rig.toml (mm2/1000 km)" in capsys.readouterr().out
    assert main(["assess", path, "--standard", "wear", "--law", "nothing"]) == 2
    with pytest.raises(InputError, match="contact_patches"):
        assess(made(track(STRAIGHT), FAST), "wear", law=str(law))


def test_comfort_is_drawn_over_the_speed_with_classes_and_a_legend_beside():
    """Points made up to rise with the speed: curves hold them in the order of the speed."""
    comfort, driven = {}, {}
    for rails, factor in (("low", 1.0), ("high", 2.0)):
        for speed in (40.0, 20.0, 30.0):
            name = f"{rails} {speed}"
            comfort[name] = [
                PointComfort(place, x, MeanComfort(n, n, n, np.zeros((60, 3)), 60),
                             *np.zeros((3, 3)), {"lateral": n, "vertical": n}, (), {})
                for place, x, n in (("middle", 0.0, factor * speed / 20), ("end", 9.0, speed / 5))
            ]  # fmt: skip
            driven[name] = (speed, "Straight", rails)
    made = Assessment("A coach", "comfort", tuple(comfort), comfort=comfort, driven=driven,
                      limits=load_comfort_limits("comfort"))  # fmt: skip
    figure = made.plot()
    mean = figure.axes[0]
    low, high = mean.lines[:2]
    np.testing.assert_allclose(low.get_xdata(), [72.0, 108.0, 144.0])
    np.testing.assert_allclose(high.get_ydata(), [2.0, 3.0, 4.0])
    classes = [text.get_text() for text in mean.texts]
    assert classes[:2] == ["very comfortable", "comfortable"]
    assert figure.get_suptitle() == "A coach\nStraight"
    assert [line.get_label() for line in mean.lines] == ["low", "high"]
    figure.draw_without_rendering()
    legend = figure.legends[0].get_window_extent()
    assert all(legend.x0 >= axes.get_window_extent().x1 for axes in figure.axes)  # hides nothing


def test_transitions_count_while_a_place_is_on_them():
    """At 20 m/s, clothoids of 80 m from 120 m and 300 m on: each place has its own times."""
    on = track(*curve(500.0, 100.0))
    run = made(on, 20.0, lateral=lambda t: 0.0 * t)
    (assessment,) = assess(run, "comfort")
    (points,) = assessment.comfort.values()
    assert len({point.place for point in points}) == 3
    for point in points:
        times = [(one.begin, one.end) for one in point.transitions]
        ends = np.array([(120.0, 200.0), (300.0, 380.0)])
        np.testing.assert_allclose(times, (ends - point.place) / 20.0, atol=1e-9)


@pytest.mark.parametrize("side", [0, 1])
def test_climb_of_a_wheel_is_that_above_its_rail_with_its_friction(side):
    """The wheelset rises by 1 mm and rolls by 2 mrad, its rail sinks by 0.5 mm."""
    friction = 0.3, 0.5
    on = track({"type": "STR", "length": 300.0}).replace(friction=friction)
    out = (-1.0, 1.0)[side]

    def climbing(time, at):
        force = np.zeros((*at.shape, 2))
        there = (at[:, 0] > 150.0) & (at[:, 0] < 160.0)
        force[there, 0, side] = out * 1.5 * Q0
        return force

    profiles = {name: load_profile(name) for name in ("S1002", "60E1")}
    run = made(on, 20.0, Y=climbing, profiles=profiles)
    share = np.clip((run["wheelset_distance"][:, 0] - 150.0) / 10.0, 0.0, 1.0)
    arrays = {name: np.array(run[name]) for name in run}
    body = run.bodies.index(run.wheelsets[0])
    arrays["body_position"][:, body, 2] = -1e-3 * share
    arrays["body_position"][:, body, 3] = -out * 2e-3 * share
    arrays["rail_vertical"] = np.zeros(run["Q"].shape)
    arrays["rail_vertical"][:, 0, side] = 0.5e-3 * share
    quantities = {**run.quantities, "rail_vertical": REQUESTED["rail_vertical"]}
    found = Result(arrays, quantities, run.coordinates, run.attributes, run.profiles)
    (report,) = assess(found, "safety")[0].safety.values()
    wheel = report.wheels[side]
    assert wheel.climb_distance == pytest.approx(10.0, abs=0.2)
    slope = math.tan(flange_angle(profiles["S1002"]))
    nadal = (slope - friction[side]) / (1.0 + friction[side] * slope)
    assert wheel.limit == pytest.approx(nadal)
    assert wheel.rise == pytest.approx((1.0 + 2.0 * on.rail_base / 2.0 + 0.5) * 1e-3, rel=0.03)
    # as peaks, without what was before the evaluation
    late = {**run.attributes, "evaluation_start": float(run.time[run.distance > 180.0][0])}
    after = Result(arrays, quantities, run.coordinates, late, run.profiles)
    (report,) = assess(after, "safety")[0].safety.values()
    assert report.wheels[side].climb_distance == 0.0


def test_limit_of_each_wheel_is_that_of_its_own_flange():
    """The right wheels with heights of 0.8, and so a flange of 0.8 the slope, of the left ones."""
    usual = load_profile("S1002")
    profiles = {"S1002": usual, "worn.csv": replace(usual, name="worn.csv", z=0.8 * usual.z)}
    profiles["60E1"] = load_profile("60E1")
    wheels = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"
    coach = railsim.load_vehicle("coach_manchester").with_values({wheels: ["S1002", "worn.csv"]})
    on = track({"type": "STR", "length": 100.0}).replace(friction=(0.3, 0.3))
    run = made(on, 20.0, profiles=profiles, vehicle=coach.to_toml())
    (report,) = assess(run, "safety")[0].safety.values()
    slope = math.tan(flange_angle(usual))
    expected = [(t - 0.3) / (1.0 + 0.3 * t) for t in (slope, 0.8 * slope)]
    assert [wheel.limit for wheel in report.wheels] == pytest.approx(4 * expected, rel=1e-3)
