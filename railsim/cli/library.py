"""``railsim list``: what vehicles, tracks, profiles and design files there are."""

import ast
import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import click

from railsim.cli.common import json_option, overwrite_option, print_json, show

PROFILES, LAWS = "profiles", "laws"
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


def _kinds() -> dict[str, str]:
    """Words of the command line and the kinds of files they stand for."""
    from railsim.files.sources import FOLDERS

    return {Path(folder).name: kind for kind, folder in FOLDERS.items()}


@click.command()
@click.argument("kinds", nargs=-1, metavar="[KIND]...")
@click.option("--draw", metavar="DIR", help="Draw every listed vehicle and track into this folder.")
@overwrite_option
@json_option
def command(kinds: tuple[str, ...], draw: str | None, overwrite: bool, as_json: bool) -> None:
    """List everything that can be given by its bare name: vehicles, tracks, profiles, laws ...

    Besides railsim's own files, the list contains those of the folders in the environment variable
    RAILSIM_PATH and of installed packages with an entry point `railsim.library`.

    \b
    Example:
      railsim list vehicles
    """  # noqa: D301 - click reads the escape
    from railsim.errors import Fault, InputError, nearest
    from railsim.table import Column, Table

    known = [*_kinds(), PROFILES, LAWS]
    wrong = [kind for kind in kinds if kind not in known]
    if wrong:
        raise InputError(Fault("list", "", f"no kind '{k}'", nearest(k, known)) for k in wrong)
    entries = [entry for kind in kinds or known for entry in _entries(kind)]
    if draw is not None:
        _draw(entries, Path(draw), overwrite)
    if as_json:
        print_json(entries)
        return
    for kind in kinds or known:
        rows = [entry for entry in entries if entry["kind"] == kind]
        graded = any(entry["trust"] for entry in rows)
        quality = [Column("trust", "source quality")] * graded
        show(kind, Table([Column("name"), *quality, Column("title", " ")], rows), "")
    if any(entry["trust"] for entry in entries):
        meanings = ", ".join(f"{letter} {meaning}" for letter, meaning in MEANING.items())
        show(f"source quality, the most frequent first: {meanings}")


def _entries(kind: str) -> list[dict[str, Any]]:
    if kind == PROFILES:
        from railsim.profiles.builtin import DEFINITIONS, builtin_profile

        profiles = {name: builtin_profile(name) for name in DEFINITIONS}
        return [
            {
                "kind": kind,
                "name": name,
                "title": f"{p.kind}: {p.source}",
                "trust": "",
                "file": None,
            }
            for name, p in profiles.items()
        ]
    from railsim.files.sources import library_files

    if kind == LAWS:
        return [
            {"kind": kind, "name": name, "title": _first_line(path), "trust": "", "file": str(path)}
            for name, path in library_files("law").items()
        ]
    word = _kinds()[kind]
    return [
        {
            "kind": kind,
            "name": name,
            "title": _title(_text_and_data(path)[1]),
            "trust": trust(text_with_bases(path, word)),
            "file": str(path),
        }
        for name, path in library_files(word).items()
    ]


def _first_line(path: Path) -> str:
    """Return the first line of the text that a Python file begins with; nothing is executed."""
    from railsim.files.access import DEFINITION_BYTES, read_text

    try:
        words = ast.get_docstring(ast.parse(read_text(path, DEFINITION_BYTES)))
    except (SyntaxError, ValueError) as error:
        return f"no Python: {error}"
    return (words or "").partition("\n")[0]


def _title(data: dict[str, Any]) -> str:
    """Name of a definition, or the edition of the standard that it follows."""
    return str(data.get("name", data.get("edition", "")))


@cache
def _text_and_data(path: Path) -> tuple[str, dict[str, Any]]:
    """Text of a file and what it says; many files extend the same one."""
    from railsim.files.access import DEFINITION_BYTES, read_text
    from railsim.files.sources import parse_toml

    text = read_text(path, DEFINITION_BYTES)
    return text, parse_toml(text, str(path))


def trust(text: str) -> str:
    r"""Return the letters of source quality of a file's numbers, the most frequent first.

    Examples
    --------
    >>> trust("mass = 3.0  # [R]\nx = 1.0  # [A]\ny = 2.0  # [R]; z [A]\n radius = 4  # [R]")
    'RA'
    """
    lines = (line.partition("#") for line in text.splitlines())
    comments = [comment for value, _, comment in lines if value.strip()]
    letters = Counter(mark[0].upper() for line in comments for mark in MARK.findall(line))
    return "".join(letter for letter, _ in letters.most_common())


def text_with_bases(path: Path, kind: str) -> str:
    """Return the text of a file with those of all files that it extends."""
    from railsim.files.sources import find_file

    texts: dict[Path, str] = {}
    while path.resolve() not in texts:  # a circle is reported where the file is loaded
        texts[path.resolve()], data = _text_and_data(path)
        base = data.get("extends")
        if not isinstance(base, str):
            break
        path = find_file(base, kind, path)
    return "\n".join(texts.values())


def _draw(entries: list[dict[str, Any]], folder: Path, overwrite: bool) -> None:
    from railsim.definitions.loading import load_any
    from railsim.definitions.track.definition import Track
    from railsim.definitions.vehicle.definition import Vehicle
    from railsim.files.access import check_folder
    from railsim.plot.style import save
    from railsim.plot.track import track_figure
    from railsim.plot.vehicle import vehicle_figure

    drawn = [entry for entry in entries if entry["kind"] in ("vehicles", "tracks")]
    pictures = [f"{entry['name']}.png" for entry in drawn]
    check_folder(folder, pictures, overwrite=overwrite)
    folder.mkdir(parents=True, exist_ok=True)
    for entry, picture in zip(drawn, pictures, strict=True):
        definition = load_any(entry["file"])
        if isinstance(definition, Vehicle):
            save(vehicle_figure(definition), folder / picture, overwrite=overwrite)
        elif isinstance(definition, Track):
            save(track_figure(definition), folder / picture, overwrite=overwrite)
        entry["picture"] = str(folder / picture)
