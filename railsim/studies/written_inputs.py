"""Inputs of a study in Python: files, names of shipped ones, or definitions.

A definition is written to ``inputs/`` in the folder of the study, so that the study can be
continued, sent to other machines and read without the script.
"""

import re
from itertools import chain, count
from pathlib import Path
from typing import Any

from railsim.definitions.file_definition import FileDefinition
from railsim.files.access import make_folder, write_text

INPUTS = "inputs"


def as_files(inputs: Any, folder: Path) -> list[str]:
    """Return one or several inputs as files; definitions are written if they do not exist."""
    single = isinstance(inputs, str | Path | FileDefinition)
    texts: dict[str, str] = {}  # of the definitions, by name
    found = []
    for one in [inputs] if single else inputs:
        if not isinstance(one, FileDefinition):
            found.append(str(one))
            continue
        text = one.to_toml()
        base = _slug(str(getattr(one, "name", "settings")))
        names = chain([base], (f"{base}-{number}" for number in count(2)))
        name = next(name for name in names if texts.get(name, text) == text)
        texts[name] = text
        path = (folder / INPUTS / f"{name}.toml").absolute()
        if not _holds(path, text.encode()):
            make_folder(path.parent)
            write_text(path, text)
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
