"""``railsim validate`` and the exit status of the command line as a whole."""

import json
import os
import subprocess
import sys

import click
import pytest
from example_result import example_result

from railsim import cli
from railsim.errors import ModelError
from railsim.version import __version__

COACH = 'format = "railsim-vehicle/1"\nname = "mine"\nextends = "coach_manchester"\n'


@pytest.fixture
def write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def test_good_files_pass(capsys):
    assert cli.main(["validate", "coach_manchester", "benchmark_vehicle1", "curve_r500"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [
        "coach_manchester: vehicle, no faults",
        "benchmark_vehicle1: vehicle, no faults",
        "curve_r500: track, no faults",
    ]
    assert err == ""


def test_every_fault_is_one_line_on_stderr(write, capsys):
    path = write("mine.toml", COACH + "[bodies.carbody]\nmass = -1\nmas = 2\n")
    assert cli.main(["validate", path, "curve_r500"]) == 2
    out, err = capsys.readouterr()
    assert len(err.splitlines()) == 2
    assert all(line.startswith(path) for line in err.splitlines())
    assert out == "curve_r500: track, no faults\n"


def test_study_is_checked_with_the_vehicles_and_values_that_it_names(write, capsys):
    head = 'format = "railsim-study/1"\nname = "s"\ntracks = ["straight"]\nspeeds = [20.0]\n'
    grid = '[grid]\n"vehicle.carbody.mass" = ["heavy"]\n'
    mass = write("mass.toml", head + 'vehicles = ["coach_manchester"]\n' + grid)
    name = write("name.toml", head + 'vehicles = ["nowhere"]\n')
    assert cli.main(["validate", mass, name]) == 2
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith(f"{mass}: vehicle.bodies.carbody.mass: 'heavy'")
    assert second.startswith("nowhere: no file 'nowhere'")


def test_json_lists_faults_and_remarks(write, capsys):
    bad = write("bad.toml", COACH + "[bodies.carbody]\nmass = -1\n")
    track = 'format = "railsim-track/1"\nname = "t"\n'
    plan = 'plan = [{type="STR", length=50.0}, {type="CIR", length=50.0, radius=300.0}]\n'
    odd = write("odd.toml", track + plan)
    assert cli.main(["validate", "--json", bad, odd]) == 2
    out, err = capsys.readouterr()
    reports = json.loads(out)
    assert err == ""
    assert reports[0]["faults"][0]["key"] == "bodies.carbody.mass"
    assert reports[1]["faults"] == []
    assert "without a transition" in reports[1]["remarks"][0]["text"]


def test_unknown_profile_is_a_fault_of_the_key_that_names_it(write, capsys):
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset"
    path = write("mine.toml", COACH + f'[{key}]\nprofile = "S1003"\n')
    assert cli.main(["validate", path]) == 2
    err = capsys.readouterr().err
    assert f"{path}: {key}.profile: profile 'S1003'" in err


def test_wheel_profile_on_the_rail_is_a_fault(write, capsys):
    text = 'format = "railsim-track/1"\nname = "t"\nrail = "S1002"\n'
    path = write("t.toml", text + 'plan = [{type="STR", length=50.0}]\n')
    assert cli.main(["validate", path]) == 2
    assert f"{path}: rail: profile 'S1002'" in capsys.readouterr().err


def test_result_file_is_recognised(capsys, tmp_path):
    path = str(example_result().to_hdf5(tmp_path / "example.h5"))
    assert cli.main(["validate", path]) == 0
    assert capsys.readouterr().out == f"{path}: result, complete, no faults\n"
    broken = write_bytes(tmp_path / "broken.h5", b"nothing")
    assert cli.main(["validate", broken]) == 2
    assert broken in capsys.readouterr().err


def write_bytes(path, content):
    path.write_bytes(content)
    return str(path)


def test_missing_file_is_a_fault(capsys):
    assert cli.main(["validate", "nowhere.toml", "curve_r25"]) == 2
    err = capsys.readouterr().err
    assert "nowhere.toml: no file" in err
    assert "curve_r250" in err


# the command line as a whole ----------------------------------------------------------------------


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from railsim.cli import main; main(['--help']);"
        "heavy = {'numba', 'matplotlib', 'pydantic', 'numpy', 'h5py'} & set(sys.modules);"
        "sys.exit(f'{heavy} loaded' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "validate" in done.stdout


@pytest.mark.parametrize("command", cli.railsim.list_commands(click.Context(cli.railsim)))
def test_every_command_has_help_with_an_example(command, capsys):
    assert cli.main([command, "--help"]) == 0
    _, _, example = capsys.readouterr().out.partition("\n  Example:\n")
    assert example.startswith(f"    railsim {command}")


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert __version__ in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments", [["validat"], ["validate"], ["validate", "--nothing"], ["info"], []]
)
def test_wrong_usage_is_status_2(arguments, capsys):
    assert cli.main(arguments) == 2
    assert "Usage" in capsys.readouterr().err


def test_wrong_command_gets_the_nearest_one(capsys):
    assert cli.main(["validat", "x"]) == 2
    assert "did you mean 'validate'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (KeyboardInterrupt(), 130),
        (click.Abort(), 130),
        (ModelError("too much"), 2),
        (OSError(28, "No space left on device"), 1),
        (MemoryError(), 1),
    ],
)
def test_exception_becomes_an_exit_status(error, status, monkeypatch, capsys):
    def failing(*_):
        raise error

    monkeypatch.setattr("railsim.cli.validate.check_one", failing)
    assert cli.main(["validate", "x"]) == status
    assert "Traceback" not in capsys.readouterr().err


def test_unforeseen_exception_is_one_line_with_a_report(monkeypatch, capsys):
    def failing(*_):
        raise ZeroDivisionError

    monkeypatch.setattr("railsim.cli.validate.check_one", failing)
    assert cli.main(["validate", "x"]) == 1
    assert "unexpected ZeroDivisionError" in capsys.readouterr().err


def test_reader_that_closes_the_pipe_is_no_error():
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "railsim", "info", "coach_manchester"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE)
    os.close(write)
    assert done.returncode == 0
    assert done.stderr == b""
