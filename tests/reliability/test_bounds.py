"""What is too much, no file, or asked for twice is told at once, before any work."""

import os

import pytest
from cases import bounded

from railsim.cli import main
from railsim.files import PartialFile

VEHICLE = 'format = "railsim-vehicle/1"\nextends = "coach_manchester"\nname = "nested"\n'


@pytest.fixture
def refused(capsys):
    def check(arguments, *words):
        with bounded(str(arguments)[:200]):
            assert main([str(word) for word in arguments]) == 2
        error = capsys.readouterr().err
        for word in words:
            assert word in error
        assert "should not happen" not in error

    return check


def test_million_runs_are_told_with_their_number_and_time(refused, tmp_path):
    given = ["study", "--vehicles", "coach_manchester", "--tracks", "curve_r250", "--speeds", "20"]
    for key in ("track.friction", "vehicle.bodies.carbody.mass"):
        given += ["--grid", f"{key}={','.join(f'{k + 1}.0' for k in range(1000))}"]
    refused([*given, "--out", tmp_path / "out"], "1,000,000 runs, some ", " days on ", "200,000")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("count", [1, 3])
def test_assemblies_nested_without_end_are_refused(count, refused, tmp_path):
    """A chain of forty, and one of which each link has three of the next: 1e19 bodies."""
    text, path = VEHICLE, "assemblies.deep"
    for _ in range(40):
        spots = ", ".join(f'{{name = "p{k}", position = [{k}.0, 0.0, 0.0]}}' for k in range(count))
        text += f"[{path}]\nplacements = [{spots}]\n"
        path += ".assemblies.deep"
    (tmp_path / "nested.toml").write_text(text)
    refused(["validate", tmp_path / "nested.toml"], "deep")


def test_second_run_into_a_new_file_is_refused_at_its_start(refused, tmp_path):
    run = ["run", "coach_manchester", "straight", "--speed", "20", "--quiet", "--out"]
    with PartialFile(tmp_path / "run.h5", alone=True):
        refused([*run, tmp_path / "run.h5"], "run.h5 is being written by another process")


READERS = (
    ["run", "F", "straight", "--speed", "20"],
    ["run", "coach_manchester", "F", "--speed", "20"],
    ["run", "coach_manchester", "straight", "--continue", "F", "--duration", "1"],
    ["study", "--vehicles", "F", "--tracks", "straight", "--speeds", "20"],
    ["study", "--scenario", "F", "--vehicles", "coach_manchester"],
    ["compare", "F", "F"],
    ["plot", "F"],
    ["animate", "F"],
    ["assess", "F"],
    ["modes", "F"],
    ["critical-speed", "coach_manchester", "F", "--method", "linear"],
    ["curving", "coach_manchester", "--settings", "F", "--radius", "500"],
    ["contact", "--wheel", "F"],
    ["spring", "verify", "F"],
    ["mechanism", "F"],
    ["validate", "F"],
    ["info", "F"],
)


@pytest.mark.parametrize("name", ["pipe", "folder", "loop", "large", "x" * 300, "zero\0byte", ""])
@pytest.mark.parametrize("ending", [".toml", ".h5"])
def test_what_is_no_file_is_refused_by_every_command(name, ending, refused, tmp_path, monkeypatch):
    """No command waits for a pipe, fills the memory or takes a name that the system refuses."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo(f"pipe{ending}")
    os.mkdir(f"folder{ending}")
    os.symlink(f"loop{ending}", f"loop{ending}")
    with open(f"large{ending}", "wb") as file:
        file.truncate(1 << 40)
    for command in READERS:
        refused([name and f"{name}{ending}" if word == "F" else word for word in command], ": ")
    for name in ("/dev/zero", "/proc/self/environ"):
        refused(["info", name], ": ")
    assert len(list(tmp_path.iterdir())) == 4
