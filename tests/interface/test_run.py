"""``railsim run``: what it prints and writes, and how it ends."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from started import started

import railsim
import railsim.files.access
from railsim.cli import main
from railsim.errors import InputError, ModelError
from railsim.simulation.assumptions import assumptions
from railsim.simulation.conditions import state_before
from railsim.simulation.step_choice import StepChoice

COACH = ["run", "coach_manchester", "curve_r250"]
# Ten metres of straight track: the shortest run that goes through everything.
SHORT = [*COACH, "--speed", "20", "--until", "10"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.h5"
    assert main([*SHORT, "--out", str(path), "--set", "settings.output_rate=100"]) == 0
    return path


def test_run_writes_a_whole_result(written):
    result = railsim.open_result(written)
    assert result.status == "complete"
    assert result.settings().output_rate == 100.0
    np.testing.assert_allclose(np.diff(result.time), 0.01)
    assert result.distance[-1] == pytest.approx(10.0)
    assert set(result.profiles) == {"S1002", "60E1"}
    assert os.listdir(written.parent) == ["run.h5"]


def test_result_runs_again_from_itself_to_the_same_arrays(written):
    result = railsim.open_result(written)
    again = railsim.simulate(**result.inputs())
    for name in result:
        np.testing.assert_array_equal(again[name], result[name])


def continued(folder, ends, options=()):
    """Files of a run in parts, each the continuation of the one before."""
    rate = ["--set", "settings.output_rate=100", "--quiet"]
    paths = [folder / f"{end}.h5" for end in ends]
    assert main([*COACH, "--speed", "20", "--until", ends[0], "--out", str(paths[0]), *rate]) == 0
    for before, path, end in zip(paths, paths[1:], ends[1:], strict=False):
        begin = ["--continue", str(before), "--until", end]
        assert main([*COACH, *begin, "--out", str(path), *rate, *options]) == 0
    return paths


def test_run_that_is_continued_twice_equals_an_undisturbed_one(written, tmp_path):
    whole = railsim.open_result(written)
    parts = [railsim.open_result(path) for path in continued(tmp_path, ["4", "6", "10"])]
    rows = 0
    for part in parts:
        for name in ("time", "distance", "Q", "Y", "body_position", "body_acceleration"):
            there = whole[name][rows : rows + len(part.time)]
            np.testing.assert_array_equal(part[name], there)
        rows += len(part.time) - 1  # the instant where two parts meet is in both
    assert rows == len(whole.time) - 1
    np.testing.assert_array_equal(parts[-1].groups["state"]["end"], whole.groups["state"]["end"])


def test_continued_run_runs_again_from_itself(tmp_path):
    """The file holds the state that it went on from: the first part is not needed."""
    first, second = continued(tmp_path, ["4", "6"])
    first.unlink()
    result = railsim.open_result(second)
    again = railsim.simulate(**result.inputs())
    for name in result:
        np.testing.assert_array_equal(again[name], result[name])
    assert result.attributes["continues"] == "coach_manchester_curve_r250_20"


def test_step_of_a_continued_run_is_checked(tmp_path, capsys):
    continued(tmp_path, ["4", "6"], ["--check-step"])
    assert "Check of the step" in capsys.readouterr().out


def test_continued_run_ends_after_its_own_duration(written, tmp_path):
    path = tmp_path / "run.h5"
    given = ["--continue", str(written), "--duration", "0.25", "--out", str(path)]
    assert main([*COACH, *given, "--set", "settings.output_rate=100", "--quiet"]) == 0
    result = railsim.open_result(path)
    assert result.time[[0, -1]] == pytest.approx([0.5, 0.75])
    assert result.distance[-1] == pytest.approx(15.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (["--speed", "20"], "--speed: given together with --continue"),
        (["--start", "5"], "--start: given together with --continue"),
        (["--set", "vehicle.bodies.carbody.mass=4e4"], "of another vehicle"),
        (["--set", "track.friction=0.3"], "of another track"),
        (["--set", "settings.scheme=rk4"], "settings.scheme: found rk4"),
        (["--until", "5"], "more than the start, 10 m"),
    ],
)
def test_continuation_of_something_else_is_refused(written, tmp_path, capsys, change, words):
    path = tmp_path / "run.h5"
    given = [*COACH, "--continue", str(written), "--out", str(path), *change]
    assert main([*given, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error
    assert not path.exists()


def test_a_result_without_its_state_is_not_continued(written):
    run = railsim.open_result(written)
    arrays = {name: run[name] for name in run}
    parted = railsim.Result(arrays, run.quantities, run.coordinates, run.attributes)
    with pytest.raises(InputError) as caught:
        state_before(run.vehicle(), run.track(), run.settings(), parted)
    assert len(caught.value.faults) == 1
    assert "the result holds no state at its end" in str(caught.value)


def test_continuation_of_no_result_is_refused(tmp_path, capsys):
    assert main([*COACH, "--continue", str(tmp_path / "none.h5"), "--quiet"]) == 2
    assert "there is no such file" in capsys.readouterr().err


def test_irregular_rails_are_told(tmp_path, capsys):
    dips = ", ".join(f'{{type="dip", s={s}.0, length=2.0, depth=0.001}}' for s in (2, 5, 8))
    more = 'scale=1.5, channels=["lateral", "gauge"], mirror=true'
    rails = f'[{{type="random", spectrum="erri_b176_low", seed=7, {more}}}, {dips}]'
    rails = f"track.irregularities={rails}"
    given = [*SHORT, "--set", rails, "--out", str(tmp_path / "run.h5")]
    assert main(given) == 0
    random = "erri_b176_low of lateral and gauge, seed 7, 3 to 70 m, times 1.5, mirrored"
    expected = f"rails     {random}; dip at 2 m; 2 more"
    assert expected in capsys.readouterr().out


def test_support_is_told_and_whether_its_values_are_the_presets():
    coach = railsim.load_vehicle("coach_manchester")
    for changes, words in (
        ({"preset": "rigid"}, "rails rigid"),
        ({"preset": "p2"}, "rails elastic, p2"),
        ({"preset": "p2", "rail_mass": 80.0}, "rails elastic, p2 with own values"),
    ):
        track = railsim.load_track("straight").replace(support=changes)
        lines = assumptions(coach, track, railsim.Settings(), 20.0)
        assert f"  support   {words}" in lines


@pytest.mark.parametrize(
    ("settings", "rate", "words"),
    [
        ({}, None, "step chosen, 5 ms at most (output), output 200 per s"),
        ({"output_rate": 4000.0}, 500.0, "step chosen, 0.25 ms at most (output)"),
        ({"output_spacing": 0.1}, 2000.0, "0.5 ms at most (controllers and sampled signals)"),
        ({"step": 1e-3}, None, "step 1 ms, output"),
    ],
)
def test_what_bounds_the_step_is_told(settings, rate, words):
    """0.1 m at 20 m/s are 5 ms; a signal of 2000 values per second has one every 0.5 ms."""
    signal = {"quantity": "time"} | ({"rate": rate} if rate else {})
    coach = railsim.load_vehicle("coach_manchester").replace(signals={"clock": signal})
    given = railsim.Settings.model_validate(settings)
    assert words in assumptions(coach, railsim.load_track("straight"), given, 20.0)[-1]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({}, "(with slip down to 0.4 of it, 0.6 s/m), third body 0.5 (not 0.2 in the slip area"),
        ({"creep_law": "polach"}, "0.6 s/m), third body 0.5 / 0.2"),
        ({"own_friction": {"law": "mine"}}, "(times law mine of the slip), third body 0.5 (not"),
        ({"own_creep_law": {"law": "mine"}}, "  forces    creep law mine, G"),
    ],
)
def test_laws_that_are_told_are_those_in_force(settings, words):
    """One's own replace others, and the second factor of a layer is of Polach's law alone."""
    coach = railsim.load_vehicle("coach_manchester")
    layer = {"third_body": [0.5, 0.2], "friction_falling": {"rest": 0.4, "decay": 0.6}}
    track = railsim.load_track("straight").replace(**layer)
    given = railsim.Settings.model_validate(settings)
    assert words in "\n".join(assumptions(coach, track, given, 20.0))


def test_inputs_name_the_load_case():
    """What was printed of a laden run was that of the vehicle as its file has it."""
    laden = railsim.load_vehicle("coach_manchester", ["load=laden"])
    first = assumptions(laden, railsim.load_track("straight"), railsim.Settings(), 20.0)[0]
    assert first.startswith(f"{laden.name}, load case laden on ")


def test_run_may_start_anywhere(tmp_path):
    path = tmp_path / "run.h5"
    given = [*COACH, "--speed", "20", "--start", "100", "--until", "110", "--out", str(path)]
    assert main(given) == 0
    result = railsim.open_result(path)
    assert result.distance[0] == pytest.approx(100.0)
    assert result.distance[-1] == pytest.approx(110.0)


def test_speed_of_the_computation_is_kept(written):
    with h5py.File(written) as file:
        facts = file.attrs
        assert facts["duration"] == pytest.approx(0.5)
        assert facts["real_time_factor"] == pytest.approx(0.5 / facts["cpu_time"])
        assert facts["wall_time"] > facts["cpu_time"] > 0.0


def test_default_name_and_printed_tables(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(SHORT) == 0
    assert os.listdir() == ["coach_manchester_curve_r250_20.h5"]
    printed = capsys.readouterr()
    # the first run after an installation says that it compiles
    lines = [line for line in printed.err.splitlines() if not line.startswith("preparing:")]
    assert [line for line in lines if "a cant of 150 mm" not in line] == []
    for words in (
        "S1002 on 60E1 inclined 1:40, gauge 1435 mm, friction 0.4",
        "FASTSIM 10 x 10",
        "x real time",
        "wheel load change (%), largest",
        "complete: ",
    ):
        assert words in printed.out


def test_json_is_all_that_stdout_holds(tmp_path, capsys):
    path = tmp_path / "run.h5"
    assert main([*SHORT, "--out", str(path), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    result = railsim.open_result(path)
    assert data["file"] == str(path)
    largest = next(peak for peak in data["peaks"] if peak["quantity"] == "Q")
    # of peaks that are equal but for rounding the first wheel's is printed
    assert abs(largest["value"]) == pytest.approx(np.max(result.groups["peaks"]["Q"]), rel=1e-12)
    assert largest["unit"] == "N"
    assert data["mid_curves"] == []


def test_existing_result_is_kept_without_overwrite(written, capsys):
    before = written.read_bytes()
    assert main([*SHORT, "--out", str(written)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert written.read_bytes() == before


def test_overwrite_replaces_the_result(tmp_path):
    path = tmp_path / "run.h5"
    path.write_text("something else")
    assert main([*SHORT, "--out", str(path), "--overwrite", "--quiet"]) == 0
    assert railsim.open_result(path).status == "complete"


@pytest.mark.parametrize("speed", ["0", "-20", "nan", "inf", "1e9"])
def test_impossible_speed_is_refused(tmp_path, speed, capsys):
    assert main([*COACH, "--speed", speed, "--out", str(tmp_path / "run.h5")]) == 2
    assert "--speed" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_all_faults_are_listed_at_once(tmp_path, capsys):
    arguments = ["run", "coach_manchestr", "curve_r25", "--speed", "20"]
    arguments += ["--set", "trak.friction=0.3", "--set", "settings.schema=rk4"]
    arguments += ["--out", str(tmp_path / "missing" / "run.h5")]
    assert main(arguments) == 2
    lines = capsys.readouterr().err.splitlines()
    for words in ("coach_manchester", "curve_r250", "trak.friction", "scheme", "--out"):
        assert any(words in line for line in lines), words
    assert list(tmp_path.iterdir()) == []


def test_what_is_unusual_in_the_track_is_remarked(tmp_path, capsys):
    steep = ["--set", "track.cant.1.length=10", "--set", "track.plan.1.length=5"]
    arguments = [*SHORT, *steep, "--out", str(tmp_path / "run.h5")]
    assert main(arguments) == 0
    assert "remark: curve_r250: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("option", "value"), [("--duration", "0"), ("--until", "-1"), ("--until", "1e6")]
)
def test_impossible_end_is_refused(tmp_path, option, value, capsys):
    arguments = [*COACH, "--speed", "20", option, value, "--out", str(tmp_path / "run.h5")]
    assert main(arguments) == 2
    assert option in capsys.readouterr().err


def test_run_that_ends_early_keeps_its_file(tmp_path, capsys):
    # 160 km/h in a curve for 70 km/h
    path = tmp_path / "run.h5"
    assert main([*COACH, "--speed", "45", "--out", str(path)]) == 3
    result = railsim.open_result(path)
    assert result.status in ("derailed", "stopped")
    again = railsim.simulate(**result.inputs())
    assert again.attributes["status_reason"] == result.attributes["status_reason"]
    np.testing.assert_array_equal(again.Q, result.Q)
    assert result.attributes["status_reason"] in capsys.readouterr().out
    assert 300.0 < result.distance[-1] < 980.0
    assert np.isfinite(result.Q).all()


def test_pictures_are_drawn_beside_the_result(tmp_path, capsys):
    path = tmp_path / "run.h5"
    assert main([*SHORT, "--out", str(path), "--plots"]) == 0
    assert sorted(os.listdir(tmp_path)) == ["run.h5", "run.png"]
    assert capsys.readouterr().out.splitlines()[-2:] == [str(path), str(tmp_path / "run.png")]


def test_names_in_place_of_what_they_stand_for_are_told():
    coach, curve = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    with pytest.raises(TypeError, match=r"'coach_manchester'; give what railsim.load_vehicle"):
        railsim.simulate("coach_manchester", curve, speed=20.0)
    with pytest.raises(TypeError, match=r"the track is a Vehicle; give what railsim.load_track"):
        railsim.simulate(coach, coach, speed=20.0)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [1.0, 4.0])
def test_interrupt_leaves_nothing(tmp_path, delay):
    # RK4 at small steps runs for a minute: the interrupt comes early, while loading, or within it
    arguments = [*COACH, "--speed", "20", "--set", "settings.scheme=rk4"]
    arguments += ["--set", "settings.step=2e-5", "--out", str(tmp_path / "run.h5")]
    process = started(arguments)
    time.sleep(delay)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.endswith("railsim: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_interrupt_just_after_a_hidden_file_was_created_leaves_nothing(tmp_path, monkeypatch):
    """Before any block of code takes care of the file."""

    def interrupted(folder, *_):
        assert len(list(folder.iterdir())) == 1
        raise KeyboardInterrupt

    monkeypatch.setattr(railsim.files.access, "sweep", interrupted)
    assert main([*COACH, "--speed", "20", "--until", "5", "--out", str(tmp_path / "x.h5")]) == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--load", "ful"], "--load: no load"),
        (["--set", "vehicle.load=ful"], "--set: vehicle.load: no"),
    ],
)
@pytest.mark.parametrize("command", [["run", "--speed", "20"], ["modes"], ["info"]])
def test_an_unknown_load_case_names_the_option_that_was_given(command, option, words, capsys):
    name, *more = command
    if name == "info":  # of one file: its own keys
        option = [option[0], option[1].removeprefix("vehicle.")]
    else:
        more = ["straight", *more]
    assert main([name, "coach_manchester", *more, *option]) == 2
    shown = capsys.readouterr().err
    assert words in shown.replace("--set: load", "--set: vehicle.load")
    assert "allowed: design, laden" in shown


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--until", "5km"], "'--until': '5km' is not a number in m, such as 350 or 350m"),
        (["--start", "0,5"], "'--start': '0,5' is not a number in m, such as 350 or 350m"),
        (["--duration", "5min"], "'--duration': '5min' is not a number in s"),
        (["--until", "5000 m"], "--until: found 5000 m; more than the start, 0 m, and at most 980"),
        (["--until", "nan"], "--until: found nan m; more than the start"),
    ],
)
def test_a_distance_or_time_that_is_none_is_told_with_its_unit(option, words, capsys):
    assert main(["run", "coach_manchester", "curve_r250", "--speed", "20", *option]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("command", ["run", "study", "compare", "plot"])
def test_help_loads_neither_numba_nor_matplotlib(command):
    check = (
        "import sys; from railsim.cli import main; status = main([sys.argv[1], '--help']);"
        "assert status == 0; assert not {'numba', 'matplotlib', 'h5py'} & set(sys.modules)"
    )
    shown = subprocess.run(
        [sys.executable, "-c", check, command], capture_output=True, text=True, check=True
    )
    assert f"railsim {command}" in shown.stdout  # the example


BRAKING = """
format = "railsim-settings/1"
[drive]
mode = "free"
traction_table = [[0.0, -150e3], [5.0, -150e3]]
"""


@pytest.mark.slow
@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize("stable", [True, False])
def test_braking_to_a_standstill_keeps_the_run(tmp_path, capsys, monkeypatch, stable):
    """Also where no steady rolling or no stable step is found at a lower speed than at the start.

    Constant force: t = m V / F, with the wheelsets' inertia some 60 t and 1.2 s.
    """
    (tmp_path / "braking.toml").write_text(BRAKING)
    at = StepChoice.at

    def until_walking_speed(self, speed, rate=0.0):
        if not stable and speed < 2.0:
            raise ModelError("no equilibrium")
        return at(self, speed, rate)

    monkeypatch.setattr(StepChoice, "at", until_walking_speed)
    given = ["run", "coach_manchester", "straight", "--speed", "3", "--duration", "9", "--quiet"]
    given += ["--settings", str(tmp_path / "braking.toml"), "--out", str(tmp_path / "run.h5")]
    assert main(given) == 3
    result = railsim.open_result(tmp_path / "run.h5")
    assert result.status == "stopped"
    reason = result.attributes["status_reason"]
    if stable:
        assert "came to a standstill" in reason
        assert 0.9 < result.time[-1] < 1.5
    else:
        assert re.fullmatch(r"the run cannot go on at (1\.99|2) m/s: no equilibrium", reason)
        assert 0.3 < result.time[-1] < 0.5
    assert reason in capsys.readouterr().out
