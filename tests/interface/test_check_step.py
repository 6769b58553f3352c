"""``railsim run --check-step``: the run again at half the step."""

import json

import pytest
from example_result import example_result

import railsim
from railsim.cli import main
from railsim.result.extremes import peak
from railsim.simulation.check_step import FULL, HALF, difference_record, half_step, step_differences

SHORT = ["run", "coach_manchester", "curve_r250", "--speed", "20", "--until", "10"]


def test_check_prints_what_half_the_step_changes(tmp_path, capsys):
    assert main([*SHORT, "--out", str(tmp_path / "run.h5"), "--check-step"]) == 0
    printed = capsys.readouterr().out
    assert "Check of the step, 2.5 ms" in printed
    assert "less that at half" in printed


def test_quiet_prints_no_remarks(tmp_path, capsys):
    given = ["--set", "track.speed=60", "--overwrite", "--out", str(tmp_path / "run.h5")]
    assert main([*SHORT, *given]) == 0
    assert "  remark: curve_r250: " in capsys.readouterr().out
    assert main([*SHORT, *given, "--quiet"]) == 0
    printed = capsys.readouterr()
    assert "complete: the run reached its end" in printed.out
    assert "remark: " not in printed.out + printed.err


def test_check_in_json_is_the_difference_of_two_runs(tmp_path, capsys):
    path = tmp_path / "run.h5"
    assert main([*SHORT, "--out", str(path), "--check-step", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["half_step"]
    result = railsim.open_result(path)
    step = float(result.attributes["step"])
    other = railsim.simulate(
        **(result.inputs() | {"settings": result.settings().replace(step=0.5 * step)})
    )
    largest = next(row for row in rows if (row["quantity"], row["where"]) == ("Q", "peak"))
    # peaks are those of the loop's own steps, a little above the largest sample
    assert largest["value"] == pytest.approx(result.Q.max(), rel=1e-4)
    assert largest["half_step_value"] == pytest.approx(peak(other, "Q").value, rel=1e-15)
    assert largest["difference"] == largest["value"] - largest["half_step_value"]


def test_half_a_step_that_is_converged_changes_nothing():
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    settings = railsim.load_settings(overrides=["scheme=rk4", "step=0.00025"])
    result = railsim.simulate(vehicle, track, speed=20.0, until=10.0, settings=settings)
    half = half_step(result)
    assert half.attributes["step"] == 0.5 * result.attributes["step"]
    for row in step_differences(result, half):
        if row.quantity.name == "Q":
            # order four at 0.25 ms: far below the printed digits
            assert row.differences[FULL] == pytest.approx(0.0, abs=1e-6)
            assert row.differences[HALF] == 0.0


def test_a_curve_that_one_of_both_runs_does_not_reach_is_left_out():
    """The shorter run ends before the middle of the curve: no median there, in either order."""
    whole, short = example_result(), example_result(duration=19.0)
    for pair in ((whole, short), (short, whole)):
        records = [difference_record(row) for row in step_differences(*pair)]
        assert {record["where"] for record in records} == {"peak", "largest", "smallest"}
