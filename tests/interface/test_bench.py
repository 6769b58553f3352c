"""``railsim bench``: everything is measured; no pass or fail on seconds."""

import json
from dataclasses import replace

import pytest

from railsim.bench import report
from railsim.bench.commands import run_command
from railsim.bench.machine import spin
from railsim.bench.report import QUICK, benchmark, shortened, tables
from railsim.bench.runs import errors
from railsim.bench.scenarios import STUDY
from railsim.cli import main

TINY = replace(
    shortened(QUICK, 10.0),
    runs=shortened(QUICK, 10.0).runs[:1],
    batch=(),
    repetitions=2,
    part_repetitions=3,
    grids=(5, 10),
    ensembles=(1, 3),
    command_repetitions=0,
    spins=1000,
)


@pytest.fixture(scope="module")
def found():
    return benchmark(TINY)


@pytest.mark.further
def test_a_run_is_timed_and_compared_with_the_reference(found):
    (run,) = found["runs"]
    assert run["status"] == "complete"
    assert run["duration"] == pytest.approx(0.5)
    assert len(run["real_time_all"]) == 2
    assert run["real_time_best"] >= run["real_time"] > 0.0
    # steady rolling: both schemes stay in the equilibrium
    assert 0.0 <= run["error"]["dQ_over_Q0"] < 1e-5
    assert 0.0 <= run["error"]["Y"] < 10.0


def test_the_reference_has_no_error_against_itself():
    reference = replace(STUDY[0], until=2.0).reference()
    assert set(errors(reference, reference).values()) == {0.0}


@pytest.mark.further
def test_parts_of_the_right_hand_side_are_positive_and_below_the_whole(found):
    parts = found["parts"]
    assert parts["patches"] == 8  # one tread contact a wheel on straight track
    assert all(time > 0.0 for time in parts["parts"].values())
    assert max(parts["parts"].values()) < parts["right_hand_side"]
    assert [row["grid"] for row in found["fastsim"]] == [5, 10]


@pytest.mark.further
def test_several_runs_in_one_call_are_timed_together(found):
    one, three = found["ensembles"]
    assert (one["members"], three["members"]) == (1, 3)
    for record in (one, three):
        assert len(record["real_time_all"]) == 2
        assert record["real_time_best"] >= record["real_time"] > 0.0


@pytest.mark.further
def test_json_and_tables_hold_what_was_found(found, monkeypatch, capsys):
    monkeypatch.setattr(report, "benchmark", lambda _plan, _progress: found)
    assert main(["bench", "--quick", "--json", "--quiet"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {"hardware", "versions", "runs", "parts", "fastsim", "ensembles"} <= set(data)
    assert data["versions"]["numba"] != "not installed"
    headers = [header[0] for header, _ in tables(data)]
    assert headers == ["time loop", "right-hand side, 8 patches", "FASTSIM", "runs in one call"]
    for header, rows in tables(data):
        assert all(len(row) == len(header) for row in rows)


def test_a_command_is_timed_with_its_memory(tmp_path):
    run = run_command("--help", folder=tmp_path)
    assert run["status"] == 0
    assert run["wall"] > 0.0
    assert 5e6 < run["memory"] < 400e6


def test_the_quietness_loop_takes_time():
    wall, cpu = spin(10_000)
    assert wall > 0.0
    assert cpu > 0.0
