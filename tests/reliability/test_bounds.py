"""What is too much, no file, or asked for twice is told at once, before any work."""

import os
import re
from pathlib import Path

import pytest
from cases import bounded

from railsim.cli import main
from railsim.files import PartialFile

ROOT = Path(__file__).parents[2]
DESIGN = ROOT / "examples/primary_and_yaw_damper.toml"
WEAR = ["wear", "coach_manchester", "--route", "curve_r250", "20", "1"]
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


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (
            ["optimise", DESIGN, "--evaluations", "1000000000"],
            ("runs, some ", " years on ", "200,000"),
        ),
        (
            ["mechanism", "atr95_lift_4", "--optimise", "--starts", "1000000000"],
            ("1,000,000,000, some 1", " years", "10,000 at most"),
        ),
        (
            [*WEAR, "--distance", "1000", "--step", "5e-324"],
            ("--step: found 4.94066e-324 km", "1 to 1000"),
        ),
    ],
)  # fmt: skip
def test_work_without_end_is_told_with_its_time(command, words, refused, tmp_path):
    refused([*command, "--out", tmp_path / "out"], *words)
    assert not (tmp_path / "out").exists()


def test_five_hundred_wheelsets_are_told_with_the_time_of_their_equilibrium(refused, tmp_path):
    spots = ", ".join(f'{{name = "p{k}", position = [{-2.8 * k}, 0.0, 0.0]}}' for k in range(250))
    (tmp_path / "long.toml").write_text(f"{VEHICLE}[assemblies.bogie]\nplacements = [{spots}]\n")
    refused(["validate", tmp_path / "long.toml"], "500 wheelsets", "minutes", "200 at most")


@pytest.mark.parametrize(
    "line", ['remove = ["#"]', 'remove = ["a\\nb"]', f"mass = 0x{'f' * 5000}", f"m = {'9' * 400}"]
)
def test_keys_and_numbers_that_mean_nothing_are_one_fault_each(line, refused, tmp_path, capsys):
    (tmp_path / "odd.toml").write_text(f"{VEHICLE}{line}\n")
    refused(["validate", tmp_path / "odd.toml"], "odd.toml: ")


@pytest.mark.parametrize("option", ["--set", "--grid"])
def test_a_key_that_is_a_comment_is_a_fault(option, refused, tmp_path):
    study = ["study", "--vehicles", "coach_manchester", "--tracks", "straight", "--speeds", "20"]
    refused([*study, option, "track.#=1,2", "--out", tmp_path / "out"], "a dotted path of keys")


def test_a_bore_of_400_digits_is_a_fault(refused, tmp_path):
    text = (ROOT / "vehicles/mechanisms/atr95_lift_1.toml").read_text()
    bore = re.search(r"^.*\bbore = .*$", text, re.MULTILINE)
    assert bore is not None
    (tmp_path / "wide.toml").write_text(text.replace(bore[0], f"bore = 1{'0' * 400}"))
    refused(["mechanism", tmp_path / "wide.toml"], "wide.toml: ")


def test_names_of_profile_files_are_whole_in_faults_and_long_values_are_cut(refused, tmp_path):
    file = tmp_path / "/".join(["folder_with_a_long_name"] * 6) / "wheel.csv"
    run = ["run", "coach_manchester", "straight", "--speed", "20", "--set"]
    refused([*run, f"track.rail={file}"], str(file))
    refused([*run, f"track.gauge=[{'1.5, ' * 99}1.5]"], "1.5, 1.5, 1...; ")
