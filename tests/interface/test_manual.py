"""The manual and the README are up to date: generated tables, command lines, the main job."""

import inspect
import re
import shlex
from importlib import import_module
from pathlib import Path

import click
import pytest
from generators import GENERATORS
from generators.filling import check_markers
from PIL import Image

from railsim.cli import main
from railsim.cli import railsim as command_line

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MENDED_BY = "python docs/generate.py"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def generate():
    return import_module("generators.tables")


def generated(name):
    """Tables of this name, in all pages."""
    block = re.compile(rf"<!-- generated: {name} -->\n\n(.*?)\n<!-- end -->", re.DOTALL)
    return [table for page in PAGES for table in block.findall(page.read_text("utf-8"))]


def test_markers_of_filled_tables_alternate():
    """A second end marker once swallowed a section."""
    for page in PAGES:
        check_markers(page.read_text("utf-8"))
    table = "<!-- generated: a -->\n<!-- end -->\n"
    for wrong in ("<!-- end -->", "<!-- generated: b -->", "<!-- keys: f N --><!-- end -->"):
        with pytest.raises(ValueError, match=r"partner|no end"):
            check_markers(table + wrong)


def test_math_holds_no_escape_that_markdown_takes_for_itself():
    r"""Of `\!` and `\|` in formulas the pages showed a placeholder."""
    code, math = r"```.*?```|`[^`\n]*`", r"\$\$.*?\$\$|\$[^$\n]+\$"
    for page in PAGES:
        text = re.sub(code, "", page.read_text("utf-8"), flags=re.DOTALL)
        for formula in re.findall(math, text, flags=re.DOTALL):
            assert not re.search(r"\\[!|{}_.#>+*()\[\]-]", formula), (page.name, formula)


def test_every_generator_of_the_manual_is_registered():
    folder = ROOT / "docs" / "generators"
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__", "filling"}
    assert modules == set(GENERATORS)
    assert all("\ndef make(" in (folder / f"{name}.py").read_text("utf-8") for name in modules)


@pytest.mark.parametrize(
    "name",
    ["vehicles", "stability", "tracks", "contact", "creep", "robustness", "examples", "tables"],
)
def test_a_part_that_a_generator_does_not_have_is_refused(name, capsys, monkeypatch):
    monkeypatch.setattr(import_module(f"generators.{name}"), "make", None)
    assert import_module("generate").main([f"{name}:typo"]) == 2
    assert f"{name}: no part 'typo'; " in capsys.readouterr().out


def test_every_public_name_is_in_the_reference():
    pages = [ROOT / "docs" / "reference.md", *(ROOT / "docs" / "reference").glob("*.md")]
    text = "\n".join(page.read_text("utf-8") for page in pages)
    for package in ("railsim", "railsim.contact", "railsim.assessment"):
        names = set(import_module(package).__all__) - {"__version__"}
        assert not [name for name in names if f"::: {package}.{name}\n" not in text]


def test_parameters_that_share_a_line_share_their_default():
    """The reference shows the default of the first one for all: a cant of inf, a gain of 20."""
    grouped = re.compile(r"^ +(\w+(?:, \w+)+)(?: :|$)", re.MULTILINE)
    hashed = "build_contact_table"  # its file's bytes are part of the names of stored tables
    for package in map(import_module, ("railsim", "railsim.contact", "railsim.assessment")):
        public = (getattr(package, name) for name in package.__all__ if name != hashed)
        for thing in (one for one in public if inspect.isfunction(one)):
            values = inspect.signature(thing).parameters
            for line in grouped.findall(thing.__doc__):
                shared = [values[name].default for name in line.split(", ") if name in values]
                assert len(set(map(repr, shared))) <= 1, (thing, line)


def test_table_of_quantities_is_up_to_date(generate):
    assert generated("quantities") == [generate.quantity_table()], MENDED_BY


@pytest.mark.slow
@pytest.mark.parametrize("coach", ["manchester", "flexicoil"])
def test_tables_of_the_curving_study_are_up_to_date(generate, coach):
    made = generate.curving_table(coach)
    tables = generated(coach)
    assert len(tables) == 1
    if coach == "manchester":  # README has the published rows
        (table,) = generated("validation")
        assert table == generate.short(tables[0])
    for table in tables:
        assert NUMBER.sub("", table) == NUMBER.sub("", made), MENDED_BY
        # one unit of the last digit: another processor may round the other way
        for written, now in zip(NUMBER.findall(table), NUMBER.findall(made), strict=True):
            unit = 10.0 ** -len(now.partition(".")[2])
            assert float(written) == pytest.approx(float(now), abs=1.01 * unit), MENDED_BY


def test_first_picture_is_up_to_date(generate):
    """Its file says what it shows; a limit at standstill speed is none at 20 m/s."""
    with Image.open(generate.PICTURE) as picture:
        written = picture.info["Description"]
    made = generate.shown(generate.first_run())
    assert NUMBER.sub("", written) == NUMBER.sub("", made), MENDED_BY
    for old, new in zip(NUMBER.findall(written), NUMBER.findall(made), strict=True):
        assert float(old) == pytest.approx(float(new), abs=0.101), MENDED_BY


def command_lines():
    """Every call of railsim in the shell blocks of all pages, as arguments."""
    for page in PAGES:
        for block in re.findall(r"^```sh\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            for line in block.replace("\\\n", " ").splitlines():
                for part in line.split("&&"):
                    words = shlex.split(part, comments=True)
                    if words and Path(words[0]).name == "railsim":
                        yield pytest.param(words[1:], id=f"{page.name}: {' '.join(words[1:4])}")


@pytest.mark.parametrize("arguments", list(command_lines()))
def test_commands_of_the_manual_have_their_options(arguments):
    """Parsed, not run: a renamed option or command is found."""
    command, words = command_line, arguments
    context = click.Context(command_line)
    while isinstance(command, click.Group) and not words[0].startswith("-"):
        _, command, words = command.resolve_command(context, words)
    if {"--help", "--version"}.isdisjoint(words):
        command.make_context(arguments[0], list(words), resilient_parsing=False)


@pytest.mark.slow
def test_main_job_of_the_readme_runs_and_computes_nothing_twice(tmp_path, monkeypatch, capsys):
    (line,) = re.findall(r"railsim (study .*)", (ROOT / "README.md").read_text("utf-8"))
    monkeypatch.chdir(tmp_path)

    def said():
        assert main(shlex.split(line)) == 0
        return capsys.readouterr().out

    first, second = said(), said()
    assert "4 of 4 runs computed" in first
    assert "0 of 4 runs computed" in second
    assert len(list((tmp_path / "results").glob("*.h5"))) == 4
    assert (tmp_path / "results" / "report.html").stat().st_size > 100_000


def test_every_promise_of_the_manual_names_its_tests():
    page = (ROOT / "docs" / "user" / "safety.md").read_text(encoding="utf-8")
    before_limits = page.partition("## Limits")[0]
    promises = [
        line for line in before_limits.splitlines() if re.match(r"\| (?!promise|---)", line)
    ]
    assert len(promises) > 15
    for promise in promises:
        named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", promise.rpartition(" | ")[2])
        assert named, promise
        for file, test in named:
            assert f"def {test}(" in (ROOT / file).read_text(encoding="utf-8"), test


def test_index_of_the_decisions_names_every_entry_in_order():
    page = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    entries = re.findall(r"^### (.*) \(\d{4}-\d\d-\d\d\)$", page, re.MULTILINE)
    assert len(entries) > 80
    assert re.findall(r"^ +- \[(.*)\]\(#", page, re.MULTILINE) == entries
