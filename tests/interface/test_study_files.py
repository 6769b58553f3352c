"""Study files, ranges, linked and sampled values, short paths, units, own quantities, objects."""

import csv
import json
import shutil

import numpy as np
import pytest
from example_result import ROOT
from planned import combinations
from test_study import CURVE, arguments, index, rows
from test_study import simulated as simulated

import railsim
from railsim.assessment.outputs import check_outputs, coarse_remarks
from railsim.cli import main
from railsim.definitions import Settings
from railsim.definitions.loading import load_study, load_track, load_vehicle
from railsim.definitions.study.definition import Sample, Spread
from railsim.errors import InputError, input_error
from railsim.studies import execute, user_function
from railsim.studies.plan import Plan
from railsim.studies.rows import combined_rows, draw_sample, quantile
from railsim.studies.spec import Execution, StudySpec
from railsim.studies.study import run_study
from railsim.units import range_values

COACH = "coach_manchester"
HEAD = f'format = "railsim-study/1"\nname = "n"\nvehicles = ["{COACH}"]\ntracks = ["{CURVE}"]\n'


def written(folder, text):
    path = folder / "mine.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return str(path)


def test_study_file_makes_grid_links_and_sample(tmp_path, simulated):
    file = written(tmp_path, """
[grid]
"track.friction" = "0.3:0.4:2"
[[linked]]
speed = ["36km/h", 12.0]
"vehicle.bodies.carbody.mass" = [40e3, 44e3]
[sample]
number = 2
seed = 7
[sample.parameters]
"vehicle.primary.stiffness.x" = { nominal = 30e6, tolerance = 0.1 }
""")  # fmt: skip
    assert main(["study", file, "--out", str(tmp_path / "s"), "--workers", "1", "--quiet"]) == 0
    assert simulated == [10.0, 10.0, 12.0, 12.0] * 2
    found = rows(tmp_path / "s")
    assert len({row["name"] for row in found}) == 8
    assert found[0]["name"].endswith("_friction=0.3_mass=40000_sample=1")
    masses = {row["speed"]: row["vehicle.bodies.carbody.mass"] for row in found}
    assert masses == {"10.0": "40000", "12.0": "44000"}
    stiffness = {float(row["vehicle.primary.stiffness.x"]) for row in found}
    assert len(stiffness) == 2  # one for each member of the sample
    assert all(27e6 <= k <= 33e6 for k in stiffness)
    inputs = index(tmp_path / "s")["inputs"]
    assert inputs["sample"]["seed"] == 7


def test_a_range_in_a_list_is_as_many_values_as_are_run(tmp_path, capsys):
    file = written(tmp_path, 'speeds = [10.0, "36:72:3 km/h"]\nanalyses = {m = {kind="modes"}}\n')
    study = load_study(file)
    assert study.runs == 4
    assert [point.run.speed for point in Plan(StudySpec.of_file(study)).points] == [
        10.0, 10.0, 15.0, 20.0
    ]  # fmt: skip


def test_linked_keys_of_python_need_equally_many_values_too(tmp_path):
    linked = [{"speed": ["10:20:3", 5.0], "vehicle.bodies.carbody.mass": [40e3, 44e3]}]
    with pytest.raises(InputError, match=r"'speed' 4, .*mass' 2; equally many"):
        railsim.study([COACH], [CURVE], None, linked=linked, out=tmp_path / "s")


def test_limits_beside_a_study_are_found_from_anywhere(tmp_path, monkeypatch):
    """As vehicles, tracks and settings beside it."""
    folder, elsewhere = tmp_path / "mine", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    (folder / "own.toml").touch()
    file = written(folder, 'speeds = [20.0]\n[analyses.a]\nkind = "assess"\nlimits = "own.toml"\n')
    monkeypatch.chdir(elsewhere)
    assert load_study(file).analyses["a"].limits == str((folder / "own.toml").resolve())


def test_function_that_changes_leaves_the_peaks_of_what_was_not_kept(tmp_path, simulated):
    """They are those of the whole run, in full precision, not of the reduced file."""
    own = tmp_path / "own.py"
    how = {"out": tmp_path / "s", "workers": 1, "keep": "Y", "single": True}
    own.write_text("def most(r):\n    return {'most': abs(r['Y']).max()}\n")
    railsim.study([COACH], [CURVE], [20.0], quantities=f"{own}:most", **how)
    before = rows(tmp_path / "s")[0]
    own.write_text("def most(r):\n    return {'first': abs(r['Y'][0]).max()}\n")
    railsim.study([COACH], [CURVE], [20.0], quantities=f"{own}:most", resume=True, **how)
    after = rows(tmp_path / "s")[0]
    assert simulated == [20.0]
    assert float(after.pop("first")) < float(before.pop("most"))
    assert after == before


def test_function_of_a_quantity_that_was_not_kept_has_the_run_computed_again(tmp_path, simulated):
    own = tmp_path / "own.py"
    how = {"out": tmp_path / "s", "workers": 1, "keep": "Y"}
    own.write_text("def most(r):\n    return {}\n")
    railsim.study([COACH], [CURVE], [20.0], quantities=f"{own}:most", **how)
    own.write_text("def most(r):\n    return {'most': r['Q'].max()}\n")
    railsim.study([COACH], [CURVE], [20.0], quantities=f"{own}:most", resume=True, **how)
    assert simulated == [20.0, 20.0]
    assert float(rows(tmp_path / "s")[0]["most"]) > 0.0


def test_reduced_results_do_not_count_as_whole_ones(tmp_path, simulated):
    remarks = []
    how = {"out": tmp_path, "workers": 1, "on_remark": remarks.append}
    railsim.study([COACH], [CURVE], [20.0], keep="Q,Y", **how)
    railsim.study([COACH], [CURVE], [20.0], keep="Y", resume=True, **how)
    assert (simulated, remarks) == ([20.0], [])
    railsim.study([COACH], [CURVE], [20.0], resume=True, **how)
    assert simulated == [20.0, 20.0]
    words = "1 result is without all quantities or digits and computed again"
    assert remarks == [f"{words}: {COACH}_{CURVE}_20"]


def test_a_single_precision_file_makes_no_summary_and_is_no_whole_result(tmp_path, simulated):
    """The process is killed between the file of a run and its line in the journal."""
    how = {"out": tmp_path, "workers": 1, "resume": True}
    railsim.study([COACH], [CURVE], [20.0], single=True, **how)
    before = rows(tmp_path)
    journal = tmp_path / "study.journal"
    journal.write_bytes(journal.read_bytes().splitlines(keepends=True)[0])
    railsim.study([COACH], [CURVE], [20.0], single=True, **how)
    assert simulated == [20.0, 20.0]
    assert rows(tmp_path) == before
    railsim.study([COACH], [CURVE], [20.0], single=True, **how)
    assert simulated == [20.0, 20.0]
    outcome = railsim.study([COACH], [CURVE], [20.0], **how)
    assert simulated == [20.0, 20.0, 20.0]
    (result,) = outcome.results().values()
    assert np.any(result["Q"] != result["Q"].astype(np.float32))


def test_requested_quantities_that_were_not_kept_have_the_run_computed_again(tmp_path):
    asked = ["settings.outputs.contact_patches=true", 'settings.outputs.sensors="readings"']
    how = {"out": tmp_path, "workers": 1, "duration": 0.05, "assignments": asked, "resume": True}
    sensors = {"sensor_acceleration", "sensor_roll_rate"}
    for keep, computed, more in (
        ("Q", 1, {"Q"}), ("Q,patch_N", 1, {"Q", "patch_N"}), ("Q", 0, {"Q", "patch_N"}),
        ("patch_N,sensor_*", 1, {"patch_N", *sensors}), ("sensor_*", 0, {"patch_N", *sensors}),
    ):  # fmt: skip
        outcome = railsim.study([COACH], [CURVE], [20.0], keep=keep, **how)
        assert outcome.computed == computed
        (result,) = outcome.results().values()
        assert set(result) == {"time", "distance", "Q0", *more}


def test_kept_quantities_are_those_of_the_whole_result(tmp_path):
    """With the name and key of the run, its state and what it started from."""
    for folder, keep in (("whole", "all"), ("part", "Q,body_*")):
        railsim.study([COACH], [CURVE], [20.0], keep=keep, out=tmp_path / folder, workers=1)
    whole, part = (
        railsim.open_result(tmp_path / folder / f"{COACH}_{CURVE}_20.h5")
        for folder in ("whole", "part")
    )
    motion = ["body_position", "body_velocity", "body_acceleration"]
    assert sorted(part) == sorted(["time", "distance", "Q0", "Q", *motion])
    for name in part:
        np.testing.assert_array_equal(part[name], whole[name])
    measured = {"created", "wall_time", "cpu_time", "real_time_factor"}
    assert whole.attributes.keys() == part.attributes.keys()
    for name in whole.attributes.keys() - measured:
        assert whole.attributes[name] == part.attributes[name]
    assert list(part.groups["peaks"]) == ["Q", "Q_distance", "Q_time"]
    np.testing.assert_array_equal(part.groups["state"]["end"], whole.groups["state"]["end"])


@pytest.mark.parametrize(
    ("standard", "change", "words"),
    [
        ("en14363", ("", ""), "limits.toml"),
        ("en14363", ('standard = "en14363"', 'standard = "uic518"'), "wanted: 'en14363'"),
        ("wear", (" ", " "), "not used by the standard 'wear'"),
    ],
)
def test_limits_of_an_analysis_are_looked_at_first(tmp_path, simulated, standard, change, words):
    """Not after the runs."""
    text = (ROOT / "limits/en14363.toml").read_text(encoding="utf-8")
    own = tmp_path / "limits.toml"
    own.write_text(text.replace(*change) if change[0] else "format = 3", encoding="utf-8")
    analysis = {"kind": "assess", "standard": standard, "limits": str(own)}
    with pytest.raises(InputError, match=words):
        railsim.study([COACH], [CURVE], [20.0], analyses={"a": analysis}, out=tmp_path / "s")
    assert simulated == []


def test_limits_that_have_changed_have_the_assessment_made_again(tmp_path):
    text = (ROOT / "limits/en14363.toml").read_text(encoding="utf-8")
    own = tmp_path / "limits.toml"
    analysis = {"a": {"kind": "assess", "limits": str(own)}}
    keys = []
    for now in (text, text + "# a comment\n", text.replace("A2:2022", "A2:2023")):
        own.write_text(now, encoding="utf-8")
        spec = StudySpec.model_validate(
            {"vehicles": [COACH], "tracks": [CURVE], "speeds": [20.0], "analyses": analysis}
        )
        keys += [Plan(spec).points[0].key]
    assert keys[0] == keys[1] != keys[2]


def test_study_goes_on_alone_from_what_its_journal_says(tmp_path, simulated):
    file = written(tmp_path, 'speeds = "10:12:2"\n[sample]\nnumber = 2\n[sample.parameters]\n'
                   '"track.friction" = { low = 0.2, high = 0.4 }\n')  # fmt: skip
    out = str(tmp_path / "s")
    assert main(["study", file, "--out", out, "--workers", "1"]) == 0
    before = (tmp_path / "s" / "summary.csv").read_bytes()
    assert main(["study", "--resume", "--out", out, "--workers", "1"]) == 0
    assert len(simulated) == 4
    assert (tmp_path / "s" / "summary.csv").read_bytes() == before


def test_short_path_changes_what_the_long_one_does(tmp_path):
    long = "assemblies.bogie.assemblies.axle.elements.primary.stiffness"
    short = load_vehicle(COACH, ["primary.stiffness.y=5kN"])
    assert short == load_vehicle(COACH, [f"{long}.1=5000.0"])
    assert load_vehicle(COACH, ["carbody.mass=40e3"]).bodies["carbody"].mass == 40e3
    with pytest.raises(InputError, match=r"'bogie\.damping' is \d+ keys: assemblies\.bogie"):
        load_vehicle(COACH, ["bogie.damping=[1.0, 1.0, 1.0]"])
    with pytest.raises(InputError, match="no 'primry'"):
        load_vehicle(COACH, ["primry.stiffness.x=1.0"])


def test_value_with_a_unit_is_in_si_and_text_stays_text():
    assert load_track(CURVE, ["gauge=1440mm"]).gauge == pytest.approx(1.44, rel=1e-12)
    assert load_track(CURVE, ["name=12mm"]).name == "12mm"


def test_a_range_of_one_value_has_equal_ends():
    """0.3:0.5:1 was 0.3 alone: the other end was left out in silence."""
    assert range_values("0.3:0.3:1") == [0.3]
    with pytest.raises(ValueError, match="a range of 1; 2 to 100000 values"):
        range_values("0.3:0.5:1")


def test_speeds_and_grid_take_units_and_ranges(tmp_path, simulated):
    more = ["--grid", "track.friction=0.3,0.4:0.5:2"]
    assert main(arguments(tmp_path, "36km/h", "12:16:3", more=more)) == 1  # 15 m/s: see `simulated`
    assert simulated[:3] == [10.0] * 3


def test_latin_hypercube_has_one_value_in_each_part_of_each_parameter():
    spreads = {"a": Spread(low=0.0, high=8.0), "b": Spread(low=1.0, high=256.0, scale="log")}
    sample = Sample(number=8, seed=3, parameters=spreads)
    drawn = draw_sample(sample)
    assert sorted(int(float(row["a"])) for row in drawn) == list(range(8))
    assert sorted(int(np.log2(float(row["b"]))) for row in drawn) == list(range(8))
    assert draw_sample(sample) == drawn
    assert draw_sample(Sample(number=8, seed=4, parameters=spreads)) != drawn


def test_sobol_sample_is_balanced_and_normal_spread_is_normal():
    sample = Sample(method="sobol", number=64, parameters={"a": Spread(mean=5.0, deviation=2.0)})
    values = np.array([float(row["a"]) for row in draw_sample(sample)])
    # half of a balanced sequence lies on each side, 68 % within a standard deviation
    assert (values < 5.0).sum() == 32
    assert abs((np.abs(values - 5.0) < 2.0).mean() - 0.6827) < 1.0 / 32.0
    assert quantile(Spread(mean=5.0, deviation=2.0), 0.975) == pytest.approx(8.92, abs=5e-3)


def test_grid_is_outermost_then_links_then_the_sample():
    sample = Sample(number=2, parameters={"c": Spread(low=0.0, high=1.0)})
    made = combined_rows({"a": ["1", "2"]}, [{"b": ["3", "4"], "speed": ["5", "6"]}], sample)
    assert [(row.values["a"], row.values["b"], row.speed) for row in made] == [
        (a, b, v) for a in "12" for b, v in (("3", 5.0), ("4", 6.0)) for _ in range(2)
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "'speeds' is needed"),
        ('speeds = [10.0]\n[grid]\n"track.friction" = "0.1:0.2:0"\n', "0 values"),
        ('speeds = [10.0]\n[[linked]]\na = [1, 2]\nb = [1]\n', "equally many"),
        ('[[linked]]\nspeed = ["10:20:3", 5]\nb = [1, 2]\n', "'speed' 4, 'b' 2"),
        ('speeds = [10.0]\n[grid]\na = [1]\n[[linked]]\na = [1]\n', "'a' is varied twice"),
        ('speeds = [10.0]\n[sample]\nmethod = "sobol"\nnumber = 6\nparameters.a = {low = 0.0, '
         "high = 1.0}\n", "power of two"),
        ("speeds = [10.0]\n[sample]\nnumber = 6\nparameters.a = {low = 1.0}\n", "is needed"),
        ("speeds = [10.0]\nspeed = [1.0]\n", "speed"),
        ('speeds = [10.0]\n[grid]\n"track.frictoin" = [1]\n', "mine.toml: track.frictoin: unknown"),
        ('speeds = [10.0]\nassignments = ["track.a=1"]\n', "mine.toml: track.a: unknown"),
    ],
)  # fmt: skip
def test_fault_of_a_study_file_is_told_by_validate_and_study(tmp_path, capsys, text, words):
    file = written(tmp_path, text)
    assert main(["validate", file]) == 2
    assert words in capsys.readouterr().err
    assert main(["study", file, "--out", str(tmp_path / "s")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "s").exists()


def test_info_says_how_many_runs_a_study_file_has(capsys):
    assert main(["info", "primary_tolerance"]) == 0
    assert "32 runs" in capsys.readouterr().out
    assert main(["info", "primary_tolerance", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["runs"] == 32


def test_options_beside_a_study_file_are_refused(tmp_path, capsys):
    out = str(tmp_path / "s")
    assert main(["study", "curving_reference", "--speeds", "10", "--out", out]) == 2
    assert "given together with a study file" in capsys.readouterr().err


def test_shipped_studies_have_cases_without_a_fault():
    for name in ("curving_reference", "primary_tolerance"):
        plan = load_study(name)
        speeds = [20.0] * len(plan.speeds)
        assert combinations(plan.vehicles, plan.tracks, speeds[:1])


def function(result):
    return {"own largest Q": float(result.Q.max()), "own end": float(result.time[-1])}


def test_own_quantities_stand_in_record_and_summary_and_follow_their_file(tmp_path, simulated):
    file = tmp_path / "own.py"
    file.write_text("def mine(result):\n    return {'twice': 2.0 * result.Q.max()}\n")
    out = tmp_path / "s"
    more = ["--quantities", f"{file}:mine"]
    assert main(arguments(out, 10, more=more)) == 0
    result = railsim.open_result(out / f"{COACH}_{CURVE}_10.h5")
    assert float(rows(out)[0]["twice"]) == 2.0 * result.Q.max()
    file.write_text("def mine(result):\n    return {'thrice': 3.0 * result.Q.max()}\n")
    user_function._load.cache_clear()  # another process would load it anew
    assert main(arguments(out, 10, more=more)) == 0
    assert float(rows(out)[0]["thrice"]) == 3.0 * result.Q.max()
    assert simulated == [10.0]  # the run itself is kept


@pytest.mark.parametrize("computed", [True, False])
def test_function_that_a_received_study_names_is_not_loaded(
    tmp_path, simulated, capsys, monkeypatch, computed
):
    """Whether or not there is a run left to compute; a function that the user gives is."""
    received, mine = tmp_path / "received", tmp_path / "mine"
    mine.mkdir()
    (tmp_path / "q.py").write_text("def f(result):\n    return {'x': 1.0}\n")
    arguments_ = arguments(received, 10, more=["--quantities", f"{tmp_path / 'q.py'}:f"])
    assert main(arguments_) == 0
    (tmp_path / "q.py").write_text(f"open({str(tmp_path / 'loaded')!r}, 'w')\nf = dict\n")
    shutil.copy(tmp_path / "q.py", received)
    if not computed:
        (received / f"{COACH}_{CURVE}_10.h5").unlink()
    user_function._load.cache_clear()
    monkeypatch.chdir(mine)
    before = sorted(path.stat().st_mtime_ns for path in received.iterdir())
    resume = ["study", "--resume", "--out", str(received), "--workers", "1"]
    assert main(resume) == 2
    assert f"calls the function {tmp_path / 'q.py'}:f" in capsys.readouterr().err
    assert not (tmp_path / "loaded").exists()
    assert sorted(path.stat().st_mtime_ns for path in received.iterdir()) == before
    # the user's own of this name, not the one in the folder of the study
    (mine / "q.py").write_text("def f(result):\n    return {'y': 2.0}\n")
    assert main([*resume, "--quantities", "q.py:f"]) == 0
    assert float(rows(received)[0]["y"]) == 2.0
    assert not (tmp_path / "loaded").exists()


def test_own_quantities_that_go_wrong_fail_their_run_only(tmp_path, simulated, capsys):
    file = tmp_path / "own.py"
    file.write_text("def mine(result):\n    return {'x': 1.0 / (result.speed - 10.0)}\n")
    assert main(arguments(tmp_path / "s", 10, 12, more=["--quantities", f"{file}:mine"])) == 1
    by_speed = {row["speed"]: row for row in rows(tmp_path / "s")}
    assert "ZeroDivisionError" in by_speed["10.0"]["status_reason"]
    assert by_speed["12.0"]["x"] == "0.5"
    assert main(arguments(tmp_path / "t", 10, more=["--quantities", f"{file}:other"])) == 2
    assert "no function 'other'" in capsys.readouterr().err


def test_function_of_something_else_is_refused_before_any_run(tmp_path, simulated, capsys):
    file = tmp_path / "own.py"
    file.write_text("def mine(result, limit):\n    return {'x': limit}\n")
    assert main(arguments(tmp_path / "s", 10, more=["--quantities", f"{file}:mine"])) == 2
    assert "'mine' cannot be called with one argument (missing" in capsys.readouterr().err
    assert simulated == []
    assert not (tmp_path / "s").exists()


def test_definitions_in_python_are_written_and_run(tmp_path, simulated):
    vehicle = load_vehicle(COACH)
    soft = vehicle.replace(name="Soft coach")
    track = load_track(CURVE)
    settings = railsim.load_settings(None, ["output_rate=100.0"])
    how = {"out": tmp_path, "settings": settings, "workers": 1, "quantities": function}
    outcome = railsim.study([soft, vehicle], track, 10.0, **how)
    names = [record["labels"]["vehicle"] for record in outcome.records]
    assert names[0] == "soft_coach"
    assert len(set(names)) == 2
    assert load_vehicle(tmp_path / "inputs" / "soft_coach.toml") == soft
    assert outcome.records[0]["quantities"]["own largest Q"] > 0.0
    again = railsim.study([soft, vehicle], track, 10.0, **how)
    assert again.computed == 0
    with (tmp_path / "summary.csv").open() as file:
        assert "own end" in next(csv.reader(file))


def test_permitted_speed_is_the_lower_one_of_vehicle_and_track():
    cases = combinations(["wagon_c62a", COACH], ["straight", "twist"], ["permitted"])
    assert [case.speed for case in cases] == pytest.approx([22.22, 3.0, 33.33333, 3.0])
    assert cases[0].name == "wagon_c62a_straight_22.22"


def test_permitted_speed_needs_both_speeds(tmp_path):
    (tmp_path / "line.toml").write_text(
        'format = "railsim-track/1"\nname = "t"\nplan = [{ type = "STR", length = 9.0 }]\n'
    )
    with pytest.raises(InputError) as caught:
        combinations([COACH], [tmp_path / "line.toml"], ["permitted"])
    (fault,) = caught.value.faults
    assert (fault.key, fault.found) == ("speed", "missing")


@pytest.mark.parametrize(
    ("given", "workers", "words"),
    [
        ({"duration": 120.0}, 1, "some 7 days on 1 cores"),
        ({"start": 100.0, "until": 1300.0}, 1, "some 4 days on 1 cores"),
        ({"start": 100.0, "until": 1300.0}, 3, "some 35 hours on 3 cores"),
        ({"start": 1300.0, "until": 1300.0}, 1, "some 35 hours on 1 cores"),
        # not looked at, or at a speed that is not known yet: a minute
        ({"tracks": ["nowhere"]}, 1, "some 4 days on 1 cores"),
        ({"speeds": ["permitted"], "until": 1300.0}, 1, "some 4 days on 1 cores"),
    ],
)
def test_too_many_runs_are_refused_with_the_time_that_they_would_take(given, workers, words):
    """A second of a core for a minute at 20 m/s, and half a second besides: 250 000 times."""
    values = tuple(f"{k / 1000}" for k in range(1, 501))
    spec = StudySpec(
        **{"vehicles": ["coach_manchester"], "tracks": ["straight"], "speeds": [20.0], **given},
        grid={"track.friction": values, "track.gauge": values},
    )
    with pytest.raises(InputError, match=f"250,000 runs, {words}"):
        Plan(spec, workers)


NO_QUANTITY = """[grid]\n"settings.outputs.quantities" = ["['Q']", "['QQ']"]\n"""


def judged(standard, assignment):
    analysis = f'[analyses.a]\nkind = "assess"\nstandard = "{standard}"\n'
    return f'assignments = ["settings.{assignment}"]\n{analysis}'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('assignments = ["settings.step=0.0007"]', "step: found 0.0007 s; an integer fraction of"),
        ('assignments = ["settings.initial.carbdy.y=0.1"]',
         f"initial.carbdy: no such body in vehicle '{COACH}'; did you mean 'carbody'?"),
        (NO_QUANTITY, "outputs.quantities: no quantity is called 'QQ'; did you mean 'Q'?"),
        (judged("en14363", "outputs.quantities=['Y']"),
         "outputs.quantities: without Q, wheelset_distance, for analyses.a; with Q, Y,"),
        (judged("en14363", "output_rate=99"),
         "output_rate: 99 samples per second, for analyses.a; at least 100"),
        (judged("en14363", "outputs.low_pass={frequency=30}"),
         "outputs.low_pass.frequency: low-pass filtered at 30 Hz by the run, for analyses.a; 40"),
        (judged("comfort", "outputs.quantities=['wheelset_distance', 'body_position']"),
         "outputs.quantities: without body_velocity, body_acceleration, for analyses.a; with"),
        (judged("wear", "outputs.quantities=['xi_x']"), "outputs.quantities: without T_gamma, for"),
        (judged("safety", "outputs.quantities=['Q*']"), "quantities: without Y_over_Q, wheelset_"),
    ],
)  # fmt: skip
def test_what_every_run_would_refuse_is_refused_before_the_first(tmp_path, capsys, text, words):
    file = written(tmp_path, f"speeds = [20.0]\nuntil = 20.0\n{text}")
    assert main(["study", file, "--out", str(tmp_path / "s"), "--quiet"]) == 2
    err = capsys.readouterr().err
    assert "mine.toml: settings." in err
    assert words in err
    assert not (tmp_path / "s").exists()


def test_the_vehicle_without_an_element_is_named_and_the_file_that_asks_for_it(tmp_path, capsys):
    settings = tmp_path / "bars.toml"
    settings.write_text(
        'format = "railsim-settings/1"\n[outputs]\nelements = ["front.anti_roll_bar"]\n'
    )
    vehicles = ["--vehicles", COACH, "wagon_y25", "--tracks", CURVE, "--speeds", "20"]
    given = ["study", *vehicles, "--settings", str(settings), "--out", str(tmp_path / "s")]
    assert main(given) == 2
    (line,) = capsys.readouterr().err.splitlines()
    words = "no element is called 'front.anti_roll_bar' in vehicle 'wagon_y25'"
    assert line.startswith(f"{settings}: outputs.elements: {words}")
    assert not (tmp_path / "s").exists()


def test_a_gauge_on_which_no_wheelset_stands_is_told_before_any_run(tmp_path, capsys):
    """Between backs 1.36 m apart, wheels of 135 mm reach 1.63 m at most, less the flange's play."""
    file = written(tmp_path, 'speeds = [20.0]\n[grid]\n"track.gauge" = [1.44, 1.64]\n')
    assert main(["study", file, "--out", str(tmp_path / "s")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{COACH} on curve_r250: S1002 on 60E1, gauge 1640.0 mm: the wheelset")
    assert not (tmp_path / "s").exists()


def test_coarse_samples_of_an_assessment_in_a_study_are_told():
    """40 Hz, twice the corner of EN 14363, with room for the filter: 100 samples per second."""
    settings = Settings(output_rate=100.0)
    check_outputs(load_vehicle(COACH), settings, 20.0, "en14363", coarse=True)
    assert coarse_remarks(settings, 20.0)[0].startswith("100 samples per second: too few")
    assert coarse_remarks(Settings(output_spacing=0.02), 20.0) == ()  # 1000 per second


def test_only_the_longest_steps_are_tried_before_a_study_and_at_the_highest_speed(
    tmp_path, simulated, monkeypatch, capsys
):
    tried = []

    def check_step(vehicle, track, settings, speed):
        tried.append((settings.step, speed))
        if settings.step > 2e-3:
            raise input_error("settings", f"found {settings.step} s", "at most 0.002 s", "step")

    monkeypatch.setattr("railsim.studies.carry_out.check_step", check_step)
    steps = '[grid]\n"settings.step" = [0.0005, 0.005, 0.00125, 0.0025]\n'
    file = written(tmp_path, f"speeds = [20.0, 30.0]\nuntil = 20.0\n{steps}")
    assert main(["study", file, "--out", str(tmp_path / "s"), "--workers", "1"]) == 2
    assert tried == [(0.005, 30.0), (0.0025, 30.0), (0.00125, 30.0)]
    first, second = capsys.readouterr().err.splitlines()
    assert f"{COACH}_" in first
    assert "settings.step: found 0.005 s" in first
    assert "at most 0.002 s" in first
    assert "settings.step: found 0.0025 s" in second
    assert simulated == []
    assert not (tmp_path / "s").exists()
    # a design of an optimisation that cannot be computed is no fault of its input
    trying = Execution(workers=1, trying=True)
    run_study(StudySpec.of_file(load_study(file)), tmp_path / "tried", trying)
    assert len(simulated) == 8
    assert len(tried) == 3


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('step = 0.005\n[laws.a]\nfile = "a.py"', "some.toml: step: found 0.005 s, unstable at"),
        (
            '[laws.a]\nfile = "a.py"\n[outputs.own.b]\nlaw = "a"\ninputs = { Q = "Q:9:left" }',
            "some.toml: outputs.own.b.inputs.Q: no label '9', ",
        ),
    ],
)
def test_settings_that_do_not_fit_a_vehicle_are_named_with_their_file_before_the_first_run(
    tmp_path, simulated, monkeypatch, capsys, lines, words
):
    def check_step(vehicle, track, settings, speed):
        raise input_error("settings", "found 0.005 s, unstable at 20 m/s", "less", "step")

    monkeypatch.setattr("railsim.studies.carry_out.check_step", check_step)
    (tmp_path / "a.py").write_text("def a(Q):\n    return 2.0 * Q\n")
    (tmp_path / "some.toml").write_text(f'format = "railsim-settings/1"\n{lines}\n')
    file = written(tmp_path, 'speeds = [20.0]\nsettings = "some.toml"\n')
    given = ["study", file, "--allow-code", "--out", str(tmp_path / "s"), "--workers", "1"]
    assert main(given) == 2
    assert words in capsys.readouterr().err
    assert simulated == []
    assert not (tmp_path / "s").exists()


def test_a_run_holds_no_more_in_memory_than_what_is_kept_and_summed_up(tmp_path, monkeypatch):
    held, finished = [], execute.finished_record

    def noted(case, result, *more):
        held.append(set(result))
        return finished(case, result, *more)

    monkeypatch.setattr(execute, "finished_record", noted)
    more = {"keep": "Q,xi_x", "workers": 1, "until": 10.0}
    outcome = railsim.study(COACH, "straight", 20.0, out=tmp_path, **more)
    assert {"xi_x", "T_gamma"} <= held[0]
    assert not {"body_position", "phi"} & held[0]
    (result,) = outcome.results().values()
    assert set(result) == {"time", "distance", "Q0", "Q", "xi_x"}


def test_a_run_without_equilibrium_fails_by_itself(tmp_path):
    """Without preload nothing carries the body; the other run is as usual."""
    key = "vehicle.assemblies.bogie.elements.secondary_spring.preload"
    grid = {key: ["auto", [0.0, 0.0, 0.0]]}
    outcome = railsim.study(COACH, "straight", 20.0, grid=grid, until=2.0, out=tmp_path, workers=1)
    fine, failed = outcome.records
    assert (fine["status"], failed["status"]) == ("complete", "failed")
    assert failed["status_reason"].startswith("no static equilibrium")
    assert [path.name for path in tmp_path.glob("*.h5")] == [fine["file"]]
