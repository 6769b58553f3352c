"""``railsim study`` and `railsim.study`: combinations, what is kept, and what goes wrong.

Most tests replace the simulation by a made-up one that takes no time; the ones that need processes
run the real thing over ten metres.
"""

import csv
import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import h5py
import numba
import numpy as np
import pytest
from deadly import deadly_work
from example_result import ROOT, feed
from planned import combinations
from selection import points
from started import started

import railsim
import railsim.studies.case
from railsim.cli import main
from railsim.errors import InputError, ModelError
from railsim.kernels import FASTMATH
from railsim.kernels.compiler import compile_kernel
from railsim.simulation import first_start
from railsim.studies import execute
from railsim.studies.case import load_case
from railsim.studies.journal import Journal
from railsim.studies.plan import parse_grid
from railsim.studies.spec import RunSpec
from railsim.studies.study import _draw

COACH, CURVE, STRAIGHT = "coach_manchester", "curve_r250", "straight"
LEFT = {"study.journal", "study.json", "summary.csv"}  # beside the results


@pytest.fixture
def simulated(monkeypatch):
    """Replace the simulation; the list holds the speed of every run that is made."""
    speeds = []

    def simulate(vehicle, track, *, speed, sink, progress, **how):
        speeds.append(speed)
        if speed == 13.0:
            raise ModelError("there is no equilibrium at 13 m/s")
        if speed == 14.0:
            raise ZeroDivisionError("trouble")
        if speed == 15.0:
            raise KeyboardInterrupt
        progress(0.5)
        status = "derailed" if speed == 99.0 else "complete"
        return feed(sink, speed=speed, duration=20.0, status=status)

    monkeypatch.setattr(railsim.studies.case, "simulate", simulate)
    return speeds


def arguments(out, *speeds, tracks=(CURVE,), more=()):
    given = ["study", "--vehicles", COACH, "--tracks", *tracks, "--speeds", *map(str, speeds)]
    return [*given, "--out", str(out), "--workers", "1", *more]


def rows(folder):
    with open(folder / "summary.csv", encoding="utf-8", newline="") as file:
        return [{key.partition(" (")[0]: v for key, v in r.items()} for r in csv.DictReader(file)]


def index(folder):
    return json.loads((folder / "study.json").read_text(encoding="utf-8"))


def test_every_combination_has_its_file_row_and_record(tmp_path, simulated):
    folder = tmp_path / "curves"
    grid = ["--grid", "track.friction=0.3,0.4"]
    assert main(arguments(folder, 10, 20, tracks=[CURVE, STRAIGHT], more=grid)) == 0
    names = [
        f"{COACH}_{track}_{speed}_friction={mu}"
        for track in (CURVE, STRAIGHT)
        for speed in (10, 20)
        for mu in (0.3, 0.4)
    ]
    assert [row["name"] for row in rows(folder)] == names
    assert [record["name"] for record in index(folder)["runs"]] == names
    files = {f"{name}.h5" for name in names}
    assert set(os.listdir(folder)) == files | LEFT
    row = rows(folder)[1]
    assert (row["vehicle"], row["track"], row["speed"], row["track.friction"]) == (
        COACH,
        CURVE,
        "10.0",
        "0.4",
    )


def test_summary_repeats_the_peaks_of_the_files(tmp_path, simulated):
    assert main(arguments(tmp_path, 20)) == 0
    (row,) = rows(tmp_path)
    result = railsim.open_result(tmp_path / row["file"])
    assert float(row["Q_peak"]) == np.abs(result.Q).max()
    assert float(row["dQ_over_Q0_min"]) == result.dQ_over_Q0.min()
    assert row["Q_peak_wheelset"] in result.wheelsets
    assert float(row["wheelset_yaw_mid"]) == pytest.approx(-9.6e-3)


def test_finished_runs_are_not_computed_again(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, 20)) == 0
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")}
    table = (tmp_path / "summary.csv").read_bytes()
    capsys.readouterr()
    assert main(arguments(tmp_path, 10, 20)) == 0
    assert simulated == [10.0, 20.0]
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.glob("*.h5")} == before
    assert (tmp_path / "summary.csv").read_bytes() == table
    assert "0 of 2 runs computed, 2 were there" in capsys.readouterr().out


def test_overwrite_computes_everything_again(tmp_path, simulated):
    assert main(arguments(tmp_path, 10)) == 0
    assert main(arguments(tmp_path, 10, more=["--overwrite"])) == 0
    assert simulated == [10.0, 10.0]


def test_changed_inputs_are_refused_without_resume(tmp_path, simulated, capsys):
    changed = ["--set", "track.friction=0.3"]
    assert main(arguments(tmp_path, 10)) == 0
    assert main(arguments(tmp_path, 10, more=changed)) == 2
    assert "--resume" in capsys.readouterr().err
    assert main(arguments(tmp_path, 10, more=[*changed, "--resume"])) == 0
    assert main(arguments(tmp_path, 10, more=changed)) == 0
    assert simulated == [10.0, 10.0]


def test_resume_computes_only_what_has_changed(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, 20)) == 0
    assert main(arguments(tmp_path, 10, 20, 30, more=["--resume"])) == 0
    assert "1 of 3 runs computed, 2 were there already" in capsys.readouterr().out
    assert simulated == [10.0, 20.0, 30.0]


@pytest.mark.parametrize("keep", ["all", "summary"])
def test_vehicle_file_edited_between_two_resumes_is_computed_again_and_named(
    tmp_path, simulated, keep
):
    vehicle = tmp_path / "coach.toml"
    text = (ROOT / "vehicles" / "coach_manchester.toml").read_text(encoding="utf-8")
    vehicle.write_text(text, encoding="utf-8")
    remarks = []
    how = {"out": tmp_path / "study", "workers": 1, "keep": keep, "on_remark": remarks.append}
    railsim.study([vehicle], [CURVE], [20.0], **how)
    vehicle.write_text(text.replace("mass = 43628.0", "mass = 43629.0"), encoding="utf-8")
    with pytest.raises(InputError, match="of other inputs"):
        railsim.study([vehicle], [CURVE], [20.0], **how)
    assert remarks == []
    railsim.study([vehicle], [CURVE], [20.0], resume=True, **how)
    assert remarks == [f"1 result is of other inputs and computed again: coach_{CURVE}_20"]
    railsim.study([vehicle], [CURVE], [20.0], **how)
    assert simulated == [20.0, 20.0]
    assert len(remarks) == 1


def test_interrupted_study_goes_on_from_what_it_has(tmp_path, simulated, monkeypatch):
    assert main(arguments(tmp_path, 10, 15, 20)) == 130
    assert index(tmp_path)["status"] == "interrupted"
    assert [row["status"] for row in rows(tmp_path)] == ["complete", "waiting", "waiting"]
    assert set(os.listdir(tmp_path)) == {f"{COACH}_{CURVE}_10.h5", *LEFT}
    whole = lambda *a, sink, speed, **how: simulated.append(speed) or feed(sink)  # noqa: E731
    monkeypatch.setattr(railsim.studies.case, "simulate", whole)
    assert main(["study", "--resume", "--out", str(tmp_path), "--workers", "1"]) == 0
    assert simulated == [10.0, 15.0, 15.0, 20.0]
    assert index(tmp_path)["status"] == "complete"


def test_failed_run_is_recorded_and_the_others_go_on(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 13, 14, 20)) == 1
    no_equilibrium, trouble, fine = index(tmp_path)["runs"]
    assert no_equilibrium["status_reason"] == "there is no equilibrium at 13 m/s"
    assert trouble["status_reason"] == "ZeroDivisionError: trouble"
    assert "trouble" in trouble["traceback"]
    assert fine["status"] == "complete"
    assert [path.name for path in tmp_path.glob("*.h5")] == [f"{COACH}_{CURVE}_20.h5"]
    printed = capsys.readouterr()
    assert "2 failed" in printed.err
    assert "1 of 3 runs computed" in printed.out


@pytest.mark.skipif(sys.platform != "linux", reason="names of files are UTF-8 there")
def test_name_of_a_file_need_not_be_utf_8(tmp_path, simulated):
    vehicle = os.fsdecode(os.fsencode(tmp_path) + b"/coach\xff.toml")
    Path(vehicle).write_text('format = "railsim-vehicle/1"\nextends = "coach_manchester"\n')
    how = {"out": tmp_path / "s", "workers": 1, "keep": "summary", "resume": True}
    assert [railsim.study(vehicle, STRAIGHT, 20.0, **how).computed for _ in range(2)] == [1, 0]
    assert b"\ncoach\xff_straight_20,coach\xff," in (tmp_path / "s" / "summary.csv").read_bytes()


def test_failed_runs_are_tried_again(tmp_path, simulated):
    assert main(arguments(tmp_path, 13)) == 1
    assert main(arguments(tmp_path, 13)) == 1
    assert simulated == [13.0, 13.0]


def test_early_end_is_the_exit_status_of_the_study(tmp_path, simulated):
    assert main(arguments(tmp_path, 20, 99)) == 3
    assert [row["status"] for row in rows(tmp_path)] == ["complete", "derailed"]


def test_pictures_of_runs_and_of_vehicles_against_each_other(tmp_path, simulated):
    given = ["study", "--vehicles", COACH, "benchmark_vehicle1", "--tracks", CURVE]
    given += ["--speeds", "20", "--out", str(tmp_path), "--workers", "1", "--plots"]
    assert main(given) == 0
    assert sorted(path.name for path in tmp_path.glob("*.png")) == [
        f"benchmark_vehicle1_{CURVE}_20.png",
        f"{COACH}_{CURVE}_20.png",
        f"compare_{CURVE}_20.png",
    ]
    (tmp_path / f"{COACH}_{CURVE}_20.h5").unlink()  # computed, and drawn, again
    assert main(given) == 0
    assert simulated == [20.0] * 3


def test_a_picture_is_of_a_run_without_a_newer_one_or_of_vehicles_alike_in_all_else(
    tmp_path, monkeypatch
):
    drawn, results, records = {}, {}, []
    for name in ("a_t_10", "b_t_10", "a_t_20", "b_t_20", "a_t_30", "b_t_30"):
        labels = {"vehicle": name[0], "track": "t", "speed": float(name[-2:])}
        records.append({"name": name, "file": f"{name}.h5", "labels": labels})
        results[name] = {"name": name, "time": [] if name == "b_t_20" else [0.0, 0.1]}
        (tmp_path / f"{name}.h5").touch()
        os.utime(tmp_path / f"{name}.h5", (100.0, 100.0))
    del results["b_t_30"]
    for name, when in (("a_t_10", 99.0), ("b_t_10", 101.0)):
        (tmp_path / f"{name}.png").touch()
        os.utime(tmp_path / f"{name}.png", (when, when))
    stand_ins = {  # matplotlib takes seconds to import
        "style": {"save": lambda what, to, **_: drawn.update({to: what})},
        "histories": {"histories": lambda result: result["name"]},
        "overlay": {"overlay": lambda some: {v: one["name"] for v, one in some.items()}},
    }
    for module, functions in stand_ins.items():
        monkeypatch.setitem(sys.modules, f"railsim.plot.{module}", SimpleNamespace(**functions))
    _draw(SimpleNamespace(results=lambda: results, records=records, folder=tmp_path))
    assert drawn == {
        tmp_path / "a_t_10.png": "a_t_10",
        tmp_path / "a_t_20.png": "a_t_20",
        tmp_path / "a_t_30.png": "a_t_30",
        tmp_path / "compare_t_10.png": {"a": "a_t_10", "b": "b_t_10"},
    }


def test_json_holds_every_record(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, 20, more=["--json"])) == 0
    data = json.loads(capsys.readouterr().out)
    assert [run["status"] for run in data["runs"]] == ["complete", "complete"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--tracks", CURVE, "--speeds", "20"], "--vehicles: not given"),
        (["--vehicles", COACH, "--tracks", CURVE], "--speeds: not given"),
        (["--resume"], "no study"),
        (
            ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "--set", "track.rail=worn"],
            "curve_r250: rail: profile 'worn': no such profile",
        ),
        (
            ["--vehicles", "coach", COACH, "--tracks", "curve", "--speeds", "20", "-5"],
            "no file 'curve'",
        ),
        (["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "-5"], "-5 m/s"),
        (["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "20"], "name; each value once"),
        (
            ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "--grid", "friction=0.3"],
            "vehicle., track. or settings.",
        ),
        (
            ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "--grid", "track.frction=1"],
            "--grid: track.frction: unknown key; did you mean 'friction'?",
        ),
        (
            ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "--set", "settings.step=-1"],
            "--set: settings.step: -1",
        ),
        (
            ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", "--grid", "track.friction"],
            "key.path=a,b,c",
        ),
    ],
)
def test_bad_study_is_refused_and_nothing_is_written(tmp_path, simulated, given, words, capsys):
    folder = tmp_path / "study"
    assert main(["study", *given, "--out", str(folder)]) == 2
    assert words in capsys.readouterr().err
    assert simulated == []
    assert not folder.exists()


@pytest.mark.parametrize("path", ["file/study", "file"])
def test_folder_that_cannot_be_written_is_refused(tmp_path, simulated, path, capsys):
    (tmp_path / "file").write_text("")
    assert main(arguments(tmp_path / path, 20)) == 2
    assert "--out" in capsys.readouterr().err
    assert simulated == []


@pytest.mark.parametrize("content", ["a letter", "", "half a result"])
def test_damaged_or_foreign_result_is_computed_again_and_kept(tmp_path, simulated, capsys, content):
    assert main(arguments(tmp_path, 10, 20)) == 0
    result = tmp_path / f"{COACH}_{CURVE}_20.h5"
    whole = result.read_bytes()
    damaged = whole[: len(whole) // 2] if content == "half a result" else content.encode()
    result.write_bytes(damaged)
    assert main(arguments(tmp_path, 10, 20)) == 2  # nothing is replaced unasked
    assert result.read_bytes() == damaged
    assert "--resume computes it again and keeps this file beside it" in capsys.readouterr().err
    assert main(arguments(tmp_path, 10, 20, more=["--resume", "--quiet"])) == 0
    assert simulated == [10.0, 20.0, 20.0]
    remark = capsys.readouterr().err
    assert f"{result}: " in remark
    assert f"computed again; the old file is kept as {result.name}.damaged" in remark
    assert (tmp_path / f"{result.name}.damaged").read_bytes() == damaged
    assert [row["status"] for row in rows(tmp_path)] == ["complete", "complete"]


def test_files_that_were_damaged_before_are_kept_too(tmp_path, simulated):
    result = tmp_path / f"{COACH}_{CURVE}_20.h5"
    for content in ("a", "b", "c"):
        result.write_text(content)
        assert main(arguments(tmp_path, 20, more=["--resume"])) == 0
    kept = sorted(path.read_text() for path in tmp_path.glob("*.damaged*"))
    assert kept == ["a", "b", "c"]


@pytest.mark.parametrize(
    ("name", "words"),
    [("study.json", "is not the index of a study"), ("summary.csv", "is not of a study")],
)
def test_files_of_the_user_are_not_replaced(tmp_path, simulated, capsys, name, words):
    (tmp_path / name).write_text("mine")
    for more in ([], ["--resume"]):
        assert main(arguments(tmp_path, 20, more=more)) == 2
        assert f"{name}: {words}" in capsys.readouterr().err
    assert (tmp_path / name).read_text() == "mine"
    assert simulated == []
    assert main(arguments(tmp_path, 20, more=["--overwrite"])) == 0


@pytest.mark.parametrize("name", [f"{COACH}_{CURVE}_20", f"compare_{CURVE}_20"])
def test_a_folder_called_like_a_picture_is_met_before_the_first_run(
    tmp_path, simulated, capsys, name
):
    (tmp_path / f"{name}.png").mkdir()
    assert main(arguments(tmp_path, 20, more=["--plots"])) == 2
    assert f"{name}.png is a folder; rename it" in capsys.readouterr().err
    assert simulated == []
    assert [path.name for path in tmp_path.iterdir()] == [f"{name}.png"]


def test_results_that_exist_are_kept_where_only_the_summary_would_be(tmp_path, simulated):
    assert main(arguments(tmp_path, 20)) == 0
    result = tmp_path / f"{COACH}_{CURVE}_20.h5"
    before = result.read_bytes()
    (tmp_path / "study.journal").unlink()
    (tmp_path / "study.json").unlink()
    (tmp_path / "summary.csv").unlink()
    for _ in range(2):
        assert main(arguments(tmp_path, 20, more=["--keep", "summary", "--resume"])) == 0
        assert result.read_bytes() == before
    assert simulated == [20.0]
    assert len(rows(tmp_path)) == 1


def test_result_that_was_changed_in_its_file_is_computed_again(tmp_path, simulated):
    assert main(arguments(tmp_path, 20)) == 0
    with h5py.File(tmp_path / f"{COACH}_{CURVE}_20.h5", "r+") as file:
        file["Q"][0] = 1e24
    assert main(["study", "--resume", "--out", str(tmp_path), "--workers", "1"]) == 0
    assert simulated == [20.0, 20.0]
    (row,) = rows(tmp_path)
    assert abs(float(row["Q_peak"])) < 1e6


def test_resume_goes_on_from_any_folder(tmp_path, simulated, monkeypatch):
    (tmp_path / "begun").mkdir()
    (tmp_path / "elsewhere").mkdir()
    coach = tmp_path / "begun" / "coach.toml"
    coach.write_text((ROOT / "vehicles" / f"{COACH}.toml").read_text(encoding="utf-8"))
    monkeypatch.chdir(tmp_path / "begun")
    given = ["--vehicles", "coach.toml", "--tracks", CURVE, "--speeds", "10", "15", "20"]
    assert main(["study", *given, "--out", "out", "--workers", "1"]) == 130
    monkeypatch.setattr(railsim.studies.case, "simulate", lambda *a, sink, **how: feed(sink))
    monkeypatch.chdir(tmp_path / "elsewhere")
    out = tmp_path / "begun" / "out"
    assert main(["study", "--resume", "--out", "../begun/out", "--workers", "1"]) == 0
    assert [row["status"] for row in rows(out)] == ["complete"] * 3


def test_torn_and_damaged_lines_of_the_journal_are_left_out(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, 20, 30)) == 0
    journal = tmp_path / "study.journal"
    lines = journal.read_bytes().splitlines(keepends=True)
    lines[2] = lines[2].replace(b"complete", b"Complete", 1)
    journal.write_bytes(b"".join(lines)[:-40])
    capsys.readouterr()
    assert main(["study", "--resume", "--out", str(tmp_path), "--workers", "1"]) == 0
    assert "2 damaged lines" in capsys.readouterr().err
    assert simulated == [10.0, 20.0, 30.0]  # the results themselves are whole
    assert [row["status"] for row in rows(tmp_path)] == ["complete"] * 3


def test_second_study_into_a_folder_is_refused(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10)) == 0
    with Journal(tmp_path):
        assert main(arguments(tmp_path, 10, 20, more=["--resume"])) == 2
    assert "another study is writing into" in capsys.readouterr().err
    assert simulated == [10.0]


def test_a_million_runs_are_told_at_once(tmp_path, simulated, capsys):
    values = ",".join(f"{0.1 + 1e-4 * i:.4f}" for i in range(1000))
    grid = ["--grid", f"track.friction={values}", f"vehicle.bodies.carbody.mass={values}"]
    assert main(arguments(tmp_path / "study", 20, more=grid)) == 2
    assert "1,000,000 runs, some" in capsys.readouterr().err
    assert not (tmp_path / "study").exists()


def test_full_disk_ends_a_study_in_a_line_and_keeps_what_is_done(
    tmp_path, simulated, monkeypatch, capsys
):
    simulate = railsim.studies.case.simulate

    def full(*inputs, speed, **how):
        if speed == 20.0:
            raise OSError(errno.ENOSPC, "no space left", "run.h5")
        return simulate(*inputs, speed=speed, **how)

    monkeypatch.setattr(railsim.studies.case, "simulate", full)
    assert main(arguments(tmp_path, 10, 20, 30)) == 1
    assert capsys.readouterr().err.startswith("railsim: No space left on device: ")
    assert simulated == [10.0]
    assert [row["status"] for row in rows(tmp_path)] == ["complete", "failed", "waiting"]


def test_validate_knows_the_index_of_a_study_and_misses_its_results(tmp_path, simulated, capsys):
    assert main(arguments(tmp_path, 10, 20)) == 0
    capsys.readouterr()
    path = str(tmp_path / "study.json")
    assert main(["validate", path]) == 0
    assert "study of 2 runs, complete, no faults" in capsys.readouterr().out
    (tmp_path / f"{COACH}_{CURVE}_20.h5").unlink()
    assert main(["validate", path]) == 2
    assert f"{COACH}_{CURVE}_20.h5: the result is missing" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "words"),
    [('{"format":', "line 1: broken JSON"), ("[]", "format"), ('{"format": "x/1"}', "'x/1'")],
)
def test_validate_refuses_what_is_no_index(tmp_path, text, words, capsys):
    (tmp_path / "study.json").write_text(text)
    assert main(["validate", str(tmp_path / "study.json")]) == 2
    assert words in capsys.readouterr().err


def test_missing_dask_is_answered_with_the_install_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "distributed", None)
    command = [word for word in arguments(tmp_path, 20) if word not in ("--workers", "1")]
    assert main([*command, "--scheduler", "tcp://localhost:1"]) == 2
    assert "pip install 'railsim[distributed]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_processes_beside_those_of_a_scheduler_are_refused(tmp_path, capsys):
    assert main(arguments(tmp_path, 20, more=["--scheduler", "tcp://localhost:1"])) == 2
    assert "--workers: 1 beside --scheduler; " in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_grid_may_vary_values_in_tables(tmp_path):
    settings = tmp_path / "s.toml"
    table = "drive = {mode = 'table', speed_table = [[0.0, 20.0], [300.0, 15.0]]}"
    settings.write_text(f'format = "railsim-settings/1"\n{table}\n')
    grid = {"settings.drive.speed_table.1.1": ["10", "12"]}
    cases = combinations([COACH], [CURVE], [20.0], grid, settings=settings)
    assert [case.settings.drive.speed_table[1] for case in cases] == [(300.0, 10.0), (300.0, 12.0)]
    assert cases[0].name == f"{COACH}_{CURVE}_20_speed_table.1.1=10"
    with pytest.raises(InputError) as caught:
        combinations(
            [COACH], [CURVE], [20.0], {"settings.drive.speed_table.2.1": ["9"]}, settings=settings
        )
    assert str(caught.value).startswith(
        "grid: settings.drive.speed_table.2.1: no member '2' in drive.speed_table; allowed"
    )


def test_a_run_without_a_speed_begins_with_that_of_its_speed_table(tmp_path):
    settings = tmp_path / "s.toml"
    table = "drive = {mode = 'table', speed_table = [[0.0, 20.0], [300.0, 15.0]]}"
    settings.write_text(f'format = "railsim-settings/1"\n{table}\n')
    case = load_case(RunSpec(COACH, CURVE, None, settings=settings, start=150.0))
    assert case.speed == 17.5
    with pytest.raises(InputError, match="speed: no speed is given"):
        load_case(RunSpec(COACH, CURVE, None))


def test_the_settings_of_a_slow_run_are_held_against_its_vehicle_before_it_starts(tmp_path):
    """At 0.5 m/s too, so that no other run of a study starts in vain."""
    settings = tmp_path / "s.toml"
    settings.write_text('format = "railsim-settings/1"\noutputs = {elements = ["nothing"]}\n')
    with pytest.raises(InputError, match=r"outputs\.elements: no element is called 'nothing'"):
        load_case(RunSpec(COACH, CURVE, 0.5, settings=settings))


def test_grid_values_may_be_lists():
    assert parse_grid("settings.fastsim_grid=[5,5],[10,10]")[1] == ("[5,5]", "[10,10]")
    grid = {"settings.fastsim_grid": ["[5,5]", "[10,10]"]}
    cases = combinations([COACH], [CURVE], [20.0], grid)
    assert [case.settings.fastsim_grid for case in cases] == [(5, 5), (10, 10)]
    assert cases[0].name == f"{COACH}_{CURVE}_20_fastsim_grid=5-5"


def test_keys_tell_inputs_apart_and_nothing_else():
    def key(*assignments, speed=20.0, **how):
        (case,) = combinations([COACH], [CURVE], [speed], assignments=assignments, **how)
        return case.key

    base = key()
    assert key("track.friction=0.4") == base  # what the file says already
    others = [
        key("track.friction=0.3"),
        key("settings.step=0.0005"),
        key("vehicle.bodies.carbody.mass=43e3"),
        key(speed=21.0),
        key(until=100.0),
        key(duration=5.0),
    ]
    assert len({base, *others}) == 1 + len(others)


@pytest.mark.slow
def test_processes_give_the_same_arrays_as_one_run(tmp_path):
    outcome = railsim.study([COACH], [CURVE, STRAIGHT], [20.0], until=10.0, out=tmp_path, workers=2)
    assert [record["status"] for record in outcome.records] == ["complete", "complete"]
    vehicle, track = railsim.load_vehicle(COACH), railsim.load_track(CURVE)
    alone = railsim.simulate(vehicle, track, speed=20.0, until=10.0)
    shared = outcome.results()[f"{COACH}_{CURVE}_20"]
    for name in alone:
        np.testing.assert_array_equal(shared[name], alone[name])


@pytest.mark.slow
def test_script_without_a_guard_runs_once_and_nothing_of_the_folder_it_is_started_in(tmp_path):
    """Workers run railsim's code only, neither the script again nor modules that lie there."""
    here = tmp_path / "received"
    here.mkdir()
    for name in ("socket", "pickle", "signal", "numpy", "multiprocessing"):
        (here / f"{name}.py").write_text(f"open('{name}.loaded', 'w')")
    script = tmp_path / "script.py"
    script.write_text(
        "import railsim; print('begin');"
        f"outcome = railsim.study('{COACH}', '{STRAIGHT}', [20.0, 21.0], until=1.0,"
        "    workers=2, out='s');"
        "print(*(record['status'] for record in outcome.records))"
    )
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=here, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["begin", "complete complete"]
    assert done.stderr == ""
    assert not list(here.glob("*.loaded"))


@pytest.mark.parametrize(("batches", "workers", "begun"), [(5, 2, 2), (2, 5, 2), (1, 4, 1)])
def test_no_more_processes_begin_than_are_asked_for_or_have_work(
    monkeypatch, batches, workers, begun
):
    counts = []
    monkeypatch.setattr(execute, "WorkerPool", lambda count, *_: counts.append(count))
    execute._Pool([()] * batches, range(batches), workers)
    assert counts == [begun]


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False], ids=["compiled before", "first run"])
def test_first_run_compiles_alone(tmp_path, monkeypatch, compiled):
    events = []

    class Pool(execute.WorkerPool):
        def submit(self, work, *task):
            events.append(f"begin {task[0]}" if task else "compile")
            return super().submit(work, *task)

    monkeypatch.setattr(execute, "WorkerPool", Pool)
    monkeypatch.setattr(execute, "is_compiled", lambda: compiled)
    show = lambda fraction: events.append("progress" if fraction > 0.0 else "nothing yet")  # noqa: E731
    how = {"until": 300.0, "workers": 2, "progress": show}
    outcome = railsim.study([COACH], [STRAIGHT], [15.0, 20.0, 25.0], out=tmp_path, **how)
    assert [record["status"] for record in outcome.records] == ["complete"] * 3
    begins = [index for index, event in enumerate(events) if event.startswith("begin")]
    assert [events[index] for index in begins] == ["begin 0", "begin 1", "begin 2"]
    between = events[begins[0] + 1 : begins[1]]
    assert between[:1] == ([] if compiled else ["compile"])
    assert between[-1:] == ([] if compiled else ["progress"])


@pytest.mark.slow
def test_cost_of_a_run_does_not_grow_with_their_number(tmp_path, monkeypatch):
    """All that wait in the pool are looked at when one ends: a hundred thousand are too many."""
    waiting = []

    def wait(futures, **how):
        waiting.append(len(futures))
        return futures_wait(futures, **how)

    futures_wait = execute.wait
    monkeypatch.setattr(execute, "wait", wait)
    speeds = [float(v) for v in range(10, 10 + 3 * execute.AHEAD)]
    shown = []
    outcome = railsim.study(
        COACH, STRAIGHT, speeds, duration=0.01, out=tmp_path, workers=2, progress=shown.append
    )
    assert [record["status"] for record in outcome.records] == ["complete"] * len(speeds)
    assert max(waiting) == 2 * execute.AHEAD
    assert np.diff([0.0, *shown, 1.0]).min() > -1e-9


def test_compiled_code_is_seen(tmp_path, monkeypatch):
    """A full cache folder and an empty one, none at all, and no compiler."""

    def time_loop():
        pass

    def seen(folder):
        monkeypatch.setattr(first_start, "time_loop", compile_kernel(time_loop, folder, FASTMATH))
        return first_start.is_compiled()

    railsim.simulate(railsim.load_vehicle(COACH), railsim.load_track(STRAIGHT), speed=20.0, until=1)
    assert first_start.is_compiled()
    assert not seen(tmp_path)
    assert seen(None)  # every process compiles for itself
    monkeypatch.setattr(numba.config, "DISABLE_JIT", True)
    assert seen(tmp_path)


def begun(folder):
    """A study of four runs of a minute each on two workers, each of which has begun a run."""
    given = arguments(folder, 2, 3, 4, 5)[:-2]
    given += ["--set", "settings.scheme=rk4", "--set", "settings.step=1e-4", "--workers", "2"]
    process = started(given)
    while len(list(folder.glob(".*.partial"))) < 2:
        time.sleep(0.05)
    time.sleep(0.2)
    return process


@pytest.mark.slow
@points(
    ("send", "name", "status"),
    [
        (os.kill, "SIGINT", 130),
        (os.killpg, "SIGTERM", 143),  # to the processes of the study as well
        (os.kill, "SIGTERM", 143),
        (os.killpg, "SIGINT", 130),  # Ctrl-C in a terminal; to the study alone: the next test
    ],
    always=(3,),
)
def test_interrupt_leaves_only_whole_files(tmp_path, send, name, status):
    process = begun(tmp_path)
    send(process.pid, getattr(signal, name))
    _, errors = process.communicate(timeout=300)
    assert process.returncode == status
    assert "Traceback" not in errors
    assert set(os.listdir(tmp_path)) == LEFT
    assert index(tmp_path)["status"] == "interrupted"


@pytest.mark.slow
def test_request_to_end_while_workers_begin_leaves_no_traceback(tmp_path):
    """The server that they are copies of is still importing, for a second or two."""
    process = started([*arguments(tmp_path, *range(5, 25))[:-2], "--workers", "2"])
    while not (tmp_path / "study.journal").exists():
        time.sleep(0.01)
    time.sleep(0.2)
    process.terminate()
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 143
    assert errors.strip() == "railsim: ended by SIGTERM"


@pytest.mark.slow
def test_processes_end_after_a_study_that_was_killed(tmp_path):
    process = begun(tmp_path)
    process.kill()
    process.communicate(timeout=300)  # the standard error stays open as long as one of them lives
    assert {path for path in os.listdir(tmp_path) if not path.endswith(".partial")} == {
        "study.journal"
    }
    # what the killed processes have left goes when the study goes on
    assert main([*arguments(tmp_path, 20), "--resume", "--until", "10"]) == 0
    assert set(os.listdir(tmp_path)) == {f"{COACH}_{CURVE}_20.h5", *LEFT}


@pytest.mark.slow
def test_killed_group_that_is_resumed_has_the_summary_of_an_undisturbed_study(tmp_path):
    """SIGKILL of the study and its workers: what the journal holds is kept, the rest computed."""
    speeds = [15.0, 17.0, 20.0]
    short = ["--until", "10", "--keep", "summary"]
    given = [*arguments(tmp_path / "killed", *speeds)[:-2], *short]
    journal = tmp_path / "killed" / "study.journal"
    process = started([*given, "--workers", "2"])
    while not journal.exists() or journal.read_bytes().count(b"\n") < 2:  # the first: the inputs
        assert process.poll() is None
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=300)
    before = journal.read_bytes()
    assert main([*given, "--workers", "1"]) == 0
    assert journal.read_bytes().startswith(before)
    assert main([*arguments(tmp_path / "whole", *speeds), *short]) == 0
    measured = ("wall_time", "cpu_time", "real_time_factor")

    def computed(folder):
        return [{k: v for k, v in row.items() if k not in measured} for row in rows(folder)]

    assert computed(tmp_path / "killed") == computed(tmp_path / "whole")
    assert set(os.listdir(tmp_path / "killed")) == LEFT


def test_python_takes_single_values_too(tmp_path, simulated):
    outcome = railsim.study(
        COACH,
        CURVE,
        20.0,
        grid={"track.rail": "54E1", "track.friction": 0.3},
        out=tmp_path,
        workers=1,
    )
    (record,) = outcome.records
    assert record["name"] == f"{COACH}_{CURVE}_20_rail=54E1_friction=0.3"


def test_python_raises_what_the_command_prints(tmp_path):
    with pytest.raises(InputError) as caught:
        railsim.study(["no_such_coach"], [CURVE], [20.0], out=tmp_path)
    assert "no_such_coach" in caught.value.faults[0].file
    assert list(tmp_path.iterdir()) == []


def workers_of(process):
    """Worker processes of a study: copies of its server, see `railsim.processes`."""
    parents, servers = {}, set()
    for number in map(int, filter(str.isdecimal, os.listdir("/proc"))):
        try:
            status = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
            line = Path(f"/proc/{number}/cmdline").read_bytes()
        except OSError:
            continue
        parents[number] = int(status[1])
        if parents[number] == process.pid and b"forkserver" in line:
            servers.add(number)
    return [number for number, parent in parents.items() if parent in servers]


@pytest.mark.slow
@pytest.mark.further  # processes that die in the next test
def test_killed_worker_costs_nothing_but_time(tmp_path):
    """Its runs begin again, those of the others too where the pool goes down."""
    given = arguments(tmp_path, 20, 21, 22)[:-2]
    process = started(
        [
            *given,
            "--set",
            "settings.scheme=rk4",
            "--set",
            "settings.step=1e-4",
            "--until",
            "60",
            "--workers",
            "2",
        ]
    )
    while not list(tmp_path.glob(".*.partial")):
        time.sleep(0.05)
    os.kill(workers_of(process)[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=300)
    assert process.returncode == 0, errors
    assert set(os.listdir(tmp_path)) == {*LEFT, *(f"{COACH}_{CURVE}_{v}.h5" for v in (20, 21, 22))}
    assert [row["status"] for row in rows(tmp_path)] == ["complete"] * 3


@pytest.mark.slow
def test_run_whose_process_dies_twice_is_given_up_and_the_others_go_on(tmp_path, monkeypatch):
    """A vehicle's file may want more memory than there is; the others' runs are not lost.

    Nor that of 22 m/s, whose process dies once.
    """
    monkeypatch.setattr(execute, "_work", deadly_work)
    out = tmp_path / "study"
    outcome = railsim.study(COACH, CURVE, [20.0, 21.0, 22.0], until=10.0, out=out, workers=2)
    assert [record["status"] for record in outcome.records] == ["complete", "failed", "complete"]
    assert "its process died twice" in outcome.failed[0]["status_reason"]
    assert os.listdir(tmp_path / "study.died") == ["22"]


@pytest.mark.parametrize("workers", [0, -1, 2.5, "2"])
def test_workers_that_are_no_number_of_processes_are_refused(tmp_path, workers):
    with pytest.raises(InputError, match=r"workers: found .*; a whole number above 0"):
        railsim.study(COACH, CURVE, 20.0, out=tmp_path / "s", workers=workers)
    assert not (tmp_path / "s").exists()


@pytest.mark.usefixtures("simulated")
def test_an_assignment_of_a_key_that_varies_is_told(tmp_path):
    """`--set` beside `--grid` had no effect, in silence."""
    remarks = []
    how = {"out": tmp_path, "workers": 1, "on_remark": remarks.append}
    values = ["track.friction=0.2", "track.inclination=0.05"]
    varied = {"track.friction": [0.3]}
    railsim.study([COACH], [CURVE], [20.0], grid=varied, assignments=values, **how)
    assert remarks == ["track.friction=0.2 has no effect: the study varies its key"]


def test_a_key_that_changes_nothing_is_told(tmp_path, capsys):
    """Friction beside a table of it; cells of FASTSIM do change something."""
    table = "track.friction_table=[[0.0, 0.4], [50.0, 0.1]]"
    grid = ["--grid", "track.friction=0.2,0.3", "settings.fastsim_grid=[5,5],[10,10]"]
    runs = ["--vehicles", COACH, "--tracks", CURVE, "--speeds", "20", *grid, "--set", table]
    how = ["--duration", "0.2", "--workers", "1", "--out", str(tmp_path / "study")]
    assert main(["study", *runs, *how]) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if "changes no peak" in line]
    assert said == ["remark: track.friction changes no peak of any run"]
