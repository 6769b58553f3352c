"""Every script in `benchmarks/` runs, in a small form: what no test runs does not run for long."""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest
from selection import points

import railsim
from railsim.cli import main

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
KEPT = json.loads((BENCHMARKS / "results" / "irregular.json").read_text(encoding="utf-8"))
SMALL = {
    "creep_laws.py": ["--patches", "4", "--rounds", "1"],
    "fastsim_benchmark.py": [],
    "growth.py": ["--coaches", "1", "--grids", "5", "--rates", "--lengths"],
    "irregular.py": ["--runs", "1", "--repeats", "1", "--until", "20"],
    "journal.py": ["40"],
    "mechanisms.py": ["--starts", "1", "--search", "atr95_lift_3", "--repeats", "1"],
    "optimise.py": ["out", "small.toml", "--side", "3", "--seeds", "0"],
    "peers.py": ["--small"],
    "springs.py": ["--repeats", "1", "--without-search"],
    "study_cost.py": ["out", "--vehicles", "coach_manchester", "--tracks", "straight",
                      "--speeds", "1", "--frictions", "1", "--duration", "1", "--workers", "1"],
    "versions.py": ["--small", "--rounds", "1", "--commands", "0", "--jobs", "0"],
    "whole.py": ["--small"],
}  # fmt: skip
# the threads of a process, its memory, another program's solvers
OWN_PROCESS = {"growth.py", "peers.py", "study_cost.py"}
COMPILES = {"whole.py"}
COMMANDS = {"mechanisms.py", "springs.py"}  # their commands run here, without pictures
IMPORTED = {"commands.py", "cores.py", "exudyn_coach.py", "exudyn_contact.py",
            "loops.py", "numpy_fastsim.py", "parts.py", "scipy_peer.py",
            "timed_runs.py"}  # fmt: skip
WRITES_THE_MANUAL = {"tables.py"}  # from the figures in `benchmarks/results`
# all parts of a step and FASTSIM over its grid, evaluated once each without compilation
PLAIN_PARTS = """
import json, sys
from types import SimpleNamespace
import numpy as np
import parts
from railsim import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.model.assembly import assemble
model = assemble(load_vehicle("coach_manchester"), load_track("curve_r250"), Settings())
prepared = SimpleNamespace(model=model, steps=SimpleNamespace(at=lambda speed: (1e-4, None)))
parts.CALLS = 1
parts.state_at = lambda *place: (prepared, np.load(sys.argv[1]))
found = {"parts": parts.right_hand_side_parts(repetitions=1)}
found["fastsim"] = parts.fastsim_grids(parts.GRIDS[:2], repetitions=1)
print(json.dumps(found))
"""
STUDY = """
format = "railsim-study/1"
name = "two designs, one second"
vehicles = ["coach_manchester"]
tracks = ["straight"]
speeds = [20.0]
duration = 1.0

[optimise.variables]
"vehicle.assemblies.bogie.elements.secondary_lateral_damper.damping" = { low = 2e4, high = 4e4 }
"vehicle.assemblies.bogie.elements.secondary_vertical_damper.damping" = { low = 1e4, high = 3e4 }

[[optimise.objectives]]
quantity = "Q_peak"
"""


def test_every_script_is_tried():
    scripts = {path.name for path in BENCHMARKS.glob("*.py")}
    assert scripts == {*SMALL, *IMPORTED, *WRITES_THE_MANUAL}


def test_figures_of_the_manual_are_those_of_the_results(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    tables = import_module("tables")
    page = BENCHMARKS.parent / "docs" / "performance.md"
    (tmp_path / "docs").mkdir()
    shutil.copy(page, tmp_path / "docs")
    monkeypatch.setattr(tables, "ROOT", tmp_path)
    tables.main()
    assert (tmp_path / "docs" / page.name).read_text() == page.read_text()
    ((smooth, rough),) = re.findall(r"\| elastic rails \| (\d+) \| (\d+) \|", page.read_text())
    readme = " ".join((BENCHMARKS.parent / "README.md").read_text().split())
    assert f"{smooth} times faster than real time through that curve, {rough} times on" in readme


def runs_in_its_small_form(script, tmp_path, monkeypatch, capsys):
    (tmp_path / "small.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [script, *SMALL[script]])
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    run_path(str(BENCHMARKS / script), run_name="__main__")
    return capsys.readouterr().out


@pytest.mark.parametrize("script", sorted({*SMALL} - OWN_PROCESS - COMPILES - COMMANDS))
def test_script_runs_in_its_small_form(script, tmp_path, monkeypatch, capsys):
    assert runs_in_its_small_form(script, tmp_path, monkeypatch, capsys)


@pytest.mark.parametrize("script", sorted(COMMANDS))
def test_script_that_gives_commands_runs_in_its_small_form(
    script, tmp_path, monkeypatch, capsys, undrawn
):
    def run(command, **_):
        assert command[:3] == [sys.executable, "-m", "railsim"]
        return done.append(main(command[3:]))

    done = []
    platform.processor()  # asks the system by a command of its own, once
    monkeypatch.setattr(subprocess, "run", run)
    with undrawn():
        assert runs_in_its_small_form(script, tmp_path, monkeypatch, capsys)
    assert done
    assert not any(done)


def test_all_of_railsim_is_measured_in_a_small_form(tmp_path, monkeypatch, capsys):
    """With the parts of a step uncompiled: to compile the loops over them takes a minute."""
    result = railsim.simulate(
        railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250"), speed=20.0,
        until=5.0,
    )  # fmt: skip
    np.save(tmp_path / "state.npy", result.groups["state"]["end"])
    done = subprocess.run(
        [sys.executable, "-c", PLAIN_PARTS, str(tmp_path / "state.npy")],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1",
             "PYTHONPATH": os.pathsep.join([str(BENCHMARKS), str(BENCHMARKS.parent)])},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    plain = json.loads(done.stdout)
    assert plain["parts"]["patches"] == 8
    assert [row["grid"] for row in plain["fastsim"]] == [5, 10]
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    parts = import_module("parts")
    monkeypatch.setattr(parts, "right_hand_side_parts", lambda **_: plain["parts"])
    monkeypatch.setattr(parts, "fastsim_grids", lambda *_, **__: plain["fastsim"])
    shown = runs_in_its_small_form("whole.py", tmp_path, monkeypatch, capsys)
    assert all(name in shown for name in (*parts.PARTS, "step of the fast scheme", "10 x 10"))


@pytest.mark.parametrize("script", sorted(OWN_PROCESS))
def test_script_runs_in_its_small_form_and_a_process_of_its_own(script, tmp_path):
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / script), *SMALL[script]],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(BENCHMARKS.parent)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout
    if script == "peers.py" and not find_spec("exudyn"):
        assert "exudyn is not installed: left out" in done.stdout


@pytest.fixture
def whole(monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("whole")


@pytest.mark.further
def test_parts_of_a_step_and_runs_in_one_call_are_measured(whole):
    found = whole.measure(small=True)
    parts = found["parts"]
    assert parts["patches"] == 8  # one tread contact a wheel on straight track
    assert all(time > 0.0 for time in parts["parts"].values())
    assert max(parts["parts"].values()) < parts["right_hand_side"]
    assert [row["grid"] for row in found["fastsim"]] == [5, 10]
    headers = [header[0] for header, _ in whole.tables(found)]
    assert headers == ["time loop", "right-hand side, 8 patches", "FASTSIM"]
    for header, rows in whole.tables(found):
        assert all(len(row) == len(header) for row in rows)


def test_a_command_is_timed_with_its_memory(whole, tmp_path):
    run = import_module("commands").run_command("--help", folder=tmp_path)
    assert run["status"] == 0
    assert run["wall"] > 0.0
    assert 5e6 < run["memory"] < 400e6


def test_the_quietness_loop_takes_time(whole):
    wall, cpu = import_module("cores").spin(10_000)
    assert wall > 0.0
    assert cpu > 0.0


@points("name", list(KEPT), always=(0, 2))
def test_irregular_runs_evaluate_as_often_as_before(name, monkeypatch):
    """Within 1 % of the counts that are kept: what makes the loop evaluate more often is seen."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    irregular = import_module("irregular")
    result = irregular.cases(until=150.0)[name].run()
    found, kept = irregular.counts(result), KEPT[name]
    assert found["steps"] == kept["steps"]
    for count in irregular.COUNTS:
        # divided steps are single ones among thousands
        assert found[count] == pytest.approx(kept[count], rel=0.01, abs=0.001 * kept["steps"])
