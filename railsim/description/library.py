"""What can be given by its bare name: vehicles, tracks, profiles, design files, their quality."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

from railsim.files.access import DEFINITION_BYTES, read_text
from railsim.files.sources import FOLDERS, find_file, library_files, parse_toml
from railsim.profiles.builtin import DEFINITIONS, builtin_profile

PROFILES, LAWS = "profiles", "laws"
"""Built-in profiles and Python files, beside the kinds of definitions."""
# Letters of source quality beside a number, as the shipped files explain them: read, re-entered,
# computed, from memory, assumed; a short name of the source may follow, [D G].
MARK = re.compile(r"\[(D|R|C|I|M|A|assumed)(?: \w+)?\]")
MEANING = {
    "D": "data sheet or printed table",
    "R": "taken from public code that names its source",
    "C": "computed",
    "I": "identified from measured runs",
    "M": "from memory, unverified",
    "A": "assumed",
}

KINDS = {Path(folder).name: kind for kind, folder in FOLDERS.items()}
"""Kinds of files by the words of the command line."""


def library_entries(kind: str) -> list[dict[str, Any]]:
    """Return name, title, letters of source quality and file of everything of a kind."""
    rows: list[tuple[str, str, str, str | None]] = []
    if kind == PROFILES:
        profiles = {name: builtin_profile(name) for name in DEFINITIONS}
        rows = [(name, f"{p.kind}: {p.source}", "", None) for name, p in profiles.items()]
    elif kind == LAWS:
        files = library_files("law")
        rows = [(name, _first_line(path), "", str(path)) for name, path in files.items()]
    else:
        word = KINDS[kind]
        for name, path in library_files(word).items():
            # limits explain letters of their own, beside the source of each value
            letters = "" if word == "limits" else trust(text_with_bases(path, word))
            data = _text_and_data(path)[1]
            # of limits the edition of the standard that they follow
            title = str(data.get("name", data.get("edition", "")))
            rows.append((name, title, letters, str(path)))
    names = ("name", "title", "trust", "file")
    return [{"kind": kind, **dict(zip(names, row, strict=True))} for row in rows]


def _first_line(path: Path) -> str:
    """Return the first line of the text that a Python file begins with; nothing is executed."""
    try:
        docstring = ast.get_docstring(ast.parse(read_text(path, DEFINITION_BYTES)))
    except (SyntaxError, ValueError) as error:
        return f"no Python: {error}"
    return (docstring or "").partition("\n")[0]


@cache
def _text_and_data(path: Path) -> tuple[str, dict[str, Any]]:
    """Text of a file and what it says; many files extend the same one."""
    text = read_text(path, DEFINITION_BYTES)
    return text, parse_toml(text, str(path))


def trust(text: str) -> str:
    r"""Return the letters of source quality of a file's numbers, the most frequent first.

    >>> trust("mass = 3.0  # [R]\nx = 1.0  # [A]\ny = 2.0  # [R]; z [A]\n radius = 4  # [R]")
    'RA'
    """
    lines = (line.partition("#") for line in text.splitlines())
    comments = [comment for value, _, comment in lines if value.strip()]
    letters = Counter(mark[0].upper() for line in comments for mark in MARK.findall(line))
    return "".join(letter for letter, _ in letters.most_common())


def text_with_bases(path: Path, kind: str) -> str:
    """Return the text of a file with those of all files that it extends."""
    texts: dict[Path, str] = {}
    while path.resolve() not in texts:  # a circle is reported where the file is loaded
        texts[path.resolve()], data = _text_and_data(path)
        base = data.get("extends")
        if not isinstance(base, str):
            break
        path = find_file(base, kind, path)
    return "\n".join(texts.values())
