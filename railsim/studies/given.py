"""Inputs of a study in Python: files, names of shipped ones, or definitions.

A definition is written to ``inputs/`` in the folder of the study, so that the study can be
continued, sent to other machines and read without the script.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from railsim.definitions.file_definition import FileDefinition
from railsim.files import make_folder, whole_file

INPUTS = "inputs"


def as_files(given: Sequence[Any], folder: Path) -> list[str | Path]:
    """Return files instead of definitions, written if they do not exist."""
    found: list[str | Path] = []
    taken: dict[str, str] = {}
    for one in given:
        if not isinstance(one, FileDefinition):
            found.append(one)
            continue
        text = one.to_toml()
        name = base = _slug(str(getattr(one, "name", "settings")))
        number = 1
        while taken.get(name, text) != text:
            number += 1
            name = f"{base}-{number}"
        taken[name] = text
        path = (folder / INPUTS / f"{name}.toml").absolute()
        if not _holds(path, text.encode()):
            make_folder(path.parent)
            with whole_file(path) as partial:
                partial.write_text(text, encoding="utf-8")
        found.append(str(path))
    return found


def _holds(path: Path, data: bytes) -> bool:
    if not path.is_file() or path.stat().st_size != len(data):
        return False
    return path.read_bytes() == data


def _slug(name: str) -> str:
    """Return a name in a form suitable for a file.

    Examples
    --------
    >>> _slug("Passenger coach, soft primary")
    'passenger_coach_soft_primary'
    """
    return re.sub(r"\W+", "_", name.lower()).strip("_")[:60] or "definition"
