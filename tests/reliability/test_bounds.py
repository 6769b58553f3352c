"""What is too much, no file, or asked for twice is told at once, before any work."""

import os
import re
import time
import zlib
from pathlib import Path

import pytest
from cases import bounded

from railsim.cli import main
from railsim.files.access import PartialFile
from railsim.studies.journal import Journal

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
            ("--step: found 4.94065645841e-324 km", "1 to 1000"),
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


TRACK = 'format = "railsim-track/1"\nname = "x"\nplan = [{type = "STR", length = 1.0}]\n'
INDEX = (
    '{"format": "railsim-study-result/1", "status": "complete",'
    ' "inputs": {"vehicles": [%s], "tracks": [], "speeds": []}, "runs": [%s]}'
)
BOMBS = {
    "misspelt.toml": (
        VEHICLE + "[bodies.carbody]\n" + "".join(f"masss_{k} = 1.0\n" for k in range(8000)),
        ["bodies.carbody.masss_0: unknown key; did you mean 'mass'?", "7900 more faults"],
    ),
    "bodies.toml": (
        VEHICLE + "".join(f"[bodies.b{k}]\nmas = 1.0\n" for k in range(4000)),
        ["bodies.b0.mass: missing", "15900 more faults"],
    ),
    "names.toml": (
        VEHICLE + "".join(f'[sensors.s{k}]\nbody = "carbodyy{k}"\n' for k in range(4000)),
        ["sensors.s0.position: missing", "more faults"],
    ),
    "tables.toml": (
        VEHICLE + "".join(f"[t{k}.a.b.c.d]\nx = 1\n" for k in range(101_000)),
        ["too many keys; 100000 at most"],
    ),
    "key.toml": (TRACK + ".".join(["a"] * 100_000) + " = 1\n", ["50 levels at most"]),
    "header.toml": (TRACK + f"[{'.'.join(['a'] * 100_000)}]\n", ["50 levels at most"]),
    "quoted.toml": (
        TRACK + "x = {" + " . ".join(['"a.b"', "'c d'"] * 50_000) + " = 1}\n",
        ["50 levels at most"],
    ),
    "columns.csv": ("y_mm," * 300_000, ["line 1: unknown columns"]),
    "values.json": (INDEX % ("", "{}," * 6_100_000 + "{}"), ["too many values"]),
    "runs.json": (INDEX % ("", "{}," * 210_000 + "{}"), ["runs: too many; 200000 at most"]),
    "inputs.json": (INDEX % ("1," * 2_100_000 + "1", ""), ["inputs: too many values"]),
}


@pytest.mark.parametrize("name", BOMBS)
def test_time_and_memory_grow_with_the_size_of_a_file_only(name, tmp_path, capsys):
    """A hundred faults are kept, the rest is counted; numbers of keys and values are limited."""
    text, words = BOMBS[name]
    (tmp_path / name).write_text(text)
    before = time.process_time()
    assert main(["validate", str(tmp_path / name)]) == 2
    assert time.process_time() - before < 4.0
    error = capsys.readouterr().err
    assert len(error) < 10_000
    for word in words:
        assert word in error


def test_keys_with_fifty_parts_in_texts_and_comments_are_no_keys(tmp_path, capsys):
    dots = "see www." + "a." * 40
    path = tmp_path / "track.toml"
    path.write_text(f'# {"a." * 49}\n{TRACK}source = "{dots}"\n')
    assert main(["validate", str(path)]) == 0
    capsys.readouterr()


def test_journal_with_endless_lines_is_read_in_parts(tmp_path, monkeypatch):
    monkeypatch.setattr("railsim.studies.journal.LONGEST_LINE", 3000)
    with Journal(tmp_path) as journal:
        journal.begin({"vehicles": ["x" * 500]})
    with open(journal.path, "ab") as file:
        file.write(b"x" * 5000 + b"\n")
    deep = b'{"name": ' + b"[" * 2000 + b"\t{}"
    with open(journal.path, "ab") as file:
        file.write(b"%08x\t%s\n" % (zlib.crc32(deep), deep))
    with Journal(tmp_path) as journal:
        assert journal.inputs == {"vehicles": ["x" * 500]}
        assert journal.damaged == 3
