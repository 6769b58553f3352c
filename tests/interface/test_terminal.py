"""What a terminal, a shell and a program see of the command line."""

import json
import re
import sys

import click
import pytest

from railsim.cli import main, railsim
from railsim.cli.terminal import in_width, show
from railsim.table import Table

TABLE = Table(["quantity", "verdict"], [["a\x1b[31mname", "fail"], ["of " * 40, "pass"]])


@pytest.mark.parametrize("columns", [80, 200])
@pytest.mark.parametrize("colours", [True, False])
def test_a_terminal_gets_tables_of_its_width(columns, colours, capsys, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.delenv("NO_COLOR", raising=False)
    if not colours:
        monkeypatch.setenv("NO_COLOR", "1")
    show("title\x1b[31m", TABLE)
    title, *lines = capsys.readouterr().out.splitlines()
    assert title == "title\\x1b[31m"
    assert any("\x1b[31mfail" in line for line in lines) == colours
    assert any("\x1b" in line for line in lines) == colours
    assert max(len(re.sub(r"\x1b\[\d+m", "", line)) for line in lines) <= columns


def test_long_lines_are_folded_between_words_under_their_beginning():
    assert in_width("  source: of the number", 16) == "  source: of the\n    number"
    assert in_width("  source: of the number", None) == "  source: of the number"


def commands(group, context):
    for name in group.list_commands(context):
        inner = group.get_command(context, name)
        below = click.Context(inner, info_name=name, parent=context)
        yield from commands(inner, below) if isinstance(inner, click.Group) else [below]


def test_every_command_has_an_example_and_answers_quietly_and_in_json():
    for context in commands(railsim, click.Context(railsim, info_name="railsim")):
        text = context.get_help()
        assert "Example" in text, context.command_path
        assert {"--json", "--quiet"} <= set(text.split()), context.command_path


def test_a_file_gets_whole_lines(capsys):
    show(TABLE)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert "a\\x1b[31mname" in lines[1]


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
