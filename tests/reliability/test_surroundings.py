"""Streams, homes, users, locales, caches and names as the world has them."""

import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import h5py
import matplotlib
import pytest
from selection import points

from railsim.assessment.tables import assessment_csv
from railsim.cli import main

sys.path.append(str(Path(__file__).parents[1] / "interface"))
from example_result import ROOT, example_result

HOSTILE_NAME = "$x^$ \\u001b[31m <b>=1+1</b> \\u202e %s {0}"


def called(arguments, shell="", **environment):
    """Run railsim in a shell; return status, output and errors."""
    line = f'"{sys.executable}" -m railsim {" ".join(arguments)} {shell}'
    variables = {key: value for key, value in (os.environ | environment).items() if value}
    done = subprocess.run(
        ["sh", "-c", line], env=variables, capture_output=True, text=True, errors="replace"
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert "Exception ignored" not in done.stderr, done.stderr
    return done


@points(
    ("shell", "status"),
    [("| head -1", 0), (">&-", 0), ("2>&-", 0), ("</dev/null >/dev/full", 1), ("<&- >&- 2>&-", 0)],
    always=(0, 3, 4),
)
def test_closed_and_full_streams(shell, status):
    assert called(["info", "coach_manchester"], shell).returncode == status


@points(
    "environment",
    [
        {"HOME": "", "XDG_CACHE_HOME": ""},
        {"HOME": "/nonexistent", "XDG_CACHE_HOME": ""},
        {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "tr_TR.UTF-8", "LANGUAGE": "tr"},
        {"TERM": "", "COLUMNS": "1"},
    ],
    always=(1, 2, 3),
    ids=["no home", "home is not there", "ascii", "Turkish", "no terminal"],
)
def test_odd_surroundings(environment, tmp_path):
    vehicle = tmp_path / "coach.toml"
    head = 'extends = "coach_manchester"\nformat = "railsim-vehicle/1"\n'
    vehicle.write_text(f'{head}name = "Zürich"\n', encoding="utf-8")
    done = called(["info", str(vehicle)], **environment)
    assert done.returncode == 0, done.stderr
    assert "rich" in done.stdout


def test_user_without_a_name_or_home():
    """As a container that is started with any number as its user."""
    program = (
        "import os, pwd, sys; os.environ.pop('HOME', 0); os.environ.pop('XDG_CACHE_HOME', 0);"
        "pwd.getpwuid = pwd.getpwnam = lambda _: {}['no such user'];"
        "from railsim.cli import main;"
        "sys.exit(main(['info', 'coach_manchester', '--draw', os.devnull + '/x.png']))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 2, done.stderr  # for the picture's folder only
    assert "Traceback" not in done.stderr
    assert "unexpected" not in done.stderr


def test_unforeseen_error_is_a_line_with_a_report(monkeypatch, capsys, tmp_path):
    def trouble(*_):
        raise ZeroDivisionError("trouble\x1b[31m")

    monkeypatch.setattr("railsim.description.describe", trouble)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    mine = tmp_path / "mine.toml"
    mine.write_text((ROOT / "vehicles" / "coach_manchester.toml").read_text(encoding="utf-8"))
    assert main(["info", str(mine)]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "unexpected ZeroDivisionError: trouble\\x1b[31m" in error
    (report,) = tmp_path.glob("railsim-report-*.txt")
    assert str(report) in error
    text = report.read_text(encoding="utf-8")
    for part in ("ZeroDivisionError", "Traceback", "numba ", "'info'", "carbody"):
        assert part in text
    assert report.stat().st_mode & 0o077 == 0


def test_names_are_shown_literally(tmp_path, capsys):
    """In terminal, picture, page and table; each as its characters, doing nothing."""
    vehicle, name = tmp_path / "coach.toml", "$x^$ \x1b[31m <b>=1+1</b> \u202e %s {0}"
    wagon = ROOT / "tests" / "data" / "vehicles" / "two_axle_wagon.toml"
    vehicle.write_text(
        f'extends = "{wagon}"\nformat = "railsim-vehicle/1"\nname = "{HOSTILE_NAME}"\n'
    )
    assert main(["info", str(vehicle), "--draw", str(tmp_path / "coach.svg")]) == 0
    printed = capsys.readouterr().out
    assert "$x^$ \\x1b[31m <b>=1+1</b> \\u202e %s {0}" in printed
    assert "\x1b" not in printed
    result = example_result(duration=2.0)
    path = result.to_hdf5(tmp_path / "=1+1$x^$.h5")
    other = result.to_hdf5(tmp_path / "_b.h5")
    with h5py.File(path) as file:
        assert name not in file.attrs["vehicle_toml"]  # TOML writes it by its codes too
    with matplotlib.rc_context({"svg.fonttype": "none"}):
        given = ["compare", str(path), str(other), "--out", str(tmp_path / "out")]
        assert main(given) == 0
    rows = (tmp_path / "out" / "compare.csv").read_text(encoding="utf-8")
    assert ",'=1+1$x^$," in rows


def test_assessments_show_names_literally():
    class Row:
        def record(self):
            return {"run": "=1+1", "value": -0.3}

    class Assessed:
        vehicle, standard = "@coach", "en14363"
        zones = (Mock(zone="1", rows=[Row()], information=[], population=Mock()),)
        zones[0].population.name = "-worn"

        def record(self):
            return {"comfort": {}, "wear": {}, "safety": {}}

    lines = assessment_csv([Assessed()]).splitlines()
    assert lines[1] == "'@coach,en14363,1,'-worn,'=1+1,-0.3"


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 3000 + "]" * 3000, "[" * 3000, "a." * 3000])
def test_values_of_any_length_are_answered(value, capsys):
    for words in (["--set", f"vehicle.bodies.carbody.mass={value}"], ["--set", f"{value}=1"]):
        run = ["run", "coach_manchester", "straight", "--speed", "20", *words]
        assert main(run) == 2
        error = capsys.readouterr().err
        assert "--set: " in error
        assert "unexpected" not in error


def test_ten_thousand_dips_are_told_with_what_is_allowed(tmp_path, capsys):
    dips = ",".join(f"{{type='dip',s={k % 900}.5,length=2.0,depth=1e-3}}" for k in range(10000))
    head = 'format="railsim-track/1"\nname="d"\nplan=[{type="STR",length=1000.0}]\n'
    (tmp_path / "dips.toml").write_text(f"{head}irregularities=[{dips}]\n")
    assert main(["validate", str(tmp_path / "dips.toml")]) == 2
    assert "10000 values; a list of 1000 at most" in capsys.readouterr().err


def test_commands_print_by_the_function_that_escapes():
    folder = ROOT / "railsim" / "cli"
    by_click = [path.name for path in folder.glob("*.py") if "click.echo(" in path.read_text()]
    assert by_click == ["terminal.py"]
