"""What a terminal, a shell and a program see of the command line."""

import json
import re
import sys

import pytest

from railsim.cli import main
from railsim.cli.common import BOLD, STYLES, echo, folded, table

HEADER = ["quantity", "where it is", "value"]
ROWS = [
    ["derailment quotient of the leading wheel", "wheelset 1 right", "0.390"],
    ["a\x1b[31mname", "pass", "12345.678"],
]


def plain(line):
    return re.sub(f"[{''.join(STYLES)}]", "", line)


@pytest.mark.parametrize("width", [30, 50, 200])
def test_tables_fold_to_the_width_and_lose_nothing(width):
    lines = [plain(line) for line in folded(HEADER, ROWS, 2, width)]
    assert max(map(len, lines)) <= width
    # a cell that takes several lines is read down its column
    letters = sorted("".join(lines).replace(" ", ""))
    cells = [*HEADER, *(cell for row in ROWS for cell in row)]
    assert letters == sorted("".join(cells).replace("\x1b", "\\x1b").replace(" ", ""))


def test_a_table_that_fits_is_that_of_a_file():
    lines = [plain(line).split() for line in folded(HEADER, ROWS, 2, 200)]
    assert lines == [line.replace("\x1b", "\\x1b").split() for line in table(HEADER, ROWS, 2)]


def test_colours_are_those_of_a_terminal_only(capsys, monkeypatch):
    echo(f"{BOLD}title\x1b[31m")
    assert capsys.readouterr().out == "title\\x1b[31m\n"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    echo(f"{BOLD}title\x1b[31m")
    assert capsys.readouterr().out == "\x1b[1mtitle\\x1b[31m\n"


def test_faults_are_told_to_programs_too(capsys):
    assert main(["run", "coach_manchestr", "curve_r250", "--speed", "20", "--json"]) == 2
    told = capsys.readouterr()
    data = json.loads(told.out)
    assert data["exit_status"] == 2
    (fault,) = data["faults"]
    assert fault["file"] == "coach_manchestr"
    assert "coach_manchester" in fault["allowed"]
    assert told.err.startswith("coach_manchestr: no file")
    assert main(["run", "--json", "--no-such-option"]) == 2
    assert "no-such-option" in json.loads(capsys.readouterr().out)["error"].lower()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("railsim op", {"optimise"}),
        ("railsim run coach_man", {"coach_manchester"}),
        ("railsim run coach_manchester curve_r2", {"curve_r250"}),
        ("railsim optimise --eval", {"--evaluations"}),
        ("railsim study --vehicles coach_flex", {"coach_flexicoil"}),
        ("railsim study curving_re", {"curving_reference"}),
        ("railsim study --keep", {"--keep"}),
    ],
)
def test_shell_completes(monkeypatch, capsys, words, expected):
    monkeypatch.setenv("_RAILSIM_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert main() == 0
    found = {line.partition(",")[2] for line in capsys.readouterr().out.split()}
    assert expected <= found
    assert all(one.startswith(words.split()[-1]) for one in found)


def test_a_path_that_is_no_name_is_completed_by_the_shell(monkeypatch, capsys):
    monkeypatch.setenv("_RAILSIM_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "railsim run ./my")
    monkeypatch.setenv("COMP_CWORD", "2")
    assert main() == 0
    assert capsys.readouterr().out == "file,./my\n"
