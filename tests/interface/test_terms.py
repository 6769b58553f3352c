"""Words that docs/terms.md rules out occur in no page, help text, message, docstring or comment."""

import re
from pathlib import Path

import click

from railsim.cli import railsim as command_line

ROOT = Path(__file__).parents[2]
TERMS = ROOT / "docs" / "terms.md"
# entries of decisions are not rewritten
OTHERS = {TERMS, ROOT / "docs" / "decisions.md"}


def unwanted():
    """Phrases in quotation marks of the last column."""
    rows = [row for row in TERMS.read_text("utf-8").splitlines() if row.startswith("|")]
    return [phrase for row in rows for phrase in re.findall('"(.+?)"', row.rsplit("|", 2)[1])]


def help_texts(command, context):
    yield f"{context.command_path} --help", command.get_help(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            yield from help_texts(inner, click.Context(inner, info_name=name, parent=context))


def texts():
    pages = [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"]
    pages += sorted({*(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").glob("*.py")} - OTHERS)
    pages += sorted((ROOT / "railsim").rglob("*.py"))
    for page in pages:
        yield str(page.relative_to(ROOT)), page.read_text("utf-8")
    yield from help_texts(command_line, click.Context(command_line, info_name="railsim"))


def test_ruled_out_words_are_used_nowhere():
    phrases = unwanted()
    assert len(phrases) > 25
    # over the ends of lines too
    patterns = (r"\s+".join(map(re.escape, phrase.split())) for phrase in phrases)
    pattern = re.compile(rf"\b(?:{'|'.join(patterns)})\b", re.IGNORECASE)
    found = [
        f"{name}: {' '.join(text[max(0, m.start() - 30) : m.end() + 30].split())}"
        for name, text in texts()
        for m in pattern.finditer(text)
    ]
    assert found == [], "\n".join(found)
