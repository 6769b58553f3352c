"""``railsim bench``: three runs, one table; no pass or fail on seconds."""

import json
from dataclasses import replace

import pytest

from railsim.bench import runs
from railsim.bench.runs import RUNS
from railsim.cli import main


@pytest.fixture(scope="module")
def found():
    return runs.benchmark([replace(RUNS[0], until=10.0)], 2)


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
    reference = replace(RUNS[0], until=2.0).reference()
    assert set(runs.error(reference, reference).values()) == {0.0}


@pytest.mark.further
def test_json_and_table_hold_what_was_found(found, monkeypatch, capsys):
    monkeypatch.setattr(runs, "benchmark", lambda **_: found)
    assert main(["bench", "--quick", "--json", "--quiet"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert set(data) == {"hardware", "versions", "runs"}
    assert data["versions"]["numba"] != "not installed"
    assert main(["bench", "--quiet"]) == 0
    shown = capsys.readouterr().out
    assert RUNS[0].name in shown
    assert "x real time" in shown
