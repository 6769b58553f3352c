"""Points of a study: the inputs of each run, before its definitions are loaded.

When a study of a hundred thousand runs is continued, its finished runs must be found at once.  The
key of a point is a hash of the texts that define the run: contents of the vehicle, track and
settings files and of all files that they name, assignments, speed, start and end.  Definitions are
loaded and checked by `railsim.studies.plan`, for the runs that are to be computed.
"""

import hashlib
import json
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from railsim.errors import InputError, input_error
from railsim.files import sources
from railsim.files.access import TABLE_BYTES, is_file, read_bytes
from railsim.studies.case import Overrides
from railsim.studies.spec import RunSpec
from railsim.units import duration_in_words
from railsim.version import __version__

MOST_RUNS = 200_000
ROUGH_DURATION = 60.0  # s; simulated time of a run that has not been looked at
# what a run takes at a rough guess: simulated seconds per second of one core, and seconds besides
REAL_TIME_FACTOR, SECONDS_BESIDES = 60.0, 0.5


@dataclass(frozen=True, eq=False)
class Point:
    """Inputs of one run.

    `name`: name of the run; `run`: the run, with its speed at the start; `labels`: labels of the
    run; `key`: hash of all inputs; empty if a file cannot be read; `has_run`: whether a run in the
    time domain belongs to it, with a result file.
    """

    name: str
    run: RunSpec
    labels: Mapping[str, str | float] = field(default_factory=dict)
    key: str = ""
    has_run: bool = True


class Fingerprints:
    """Hashes of files with assignments; each file is read once."""

    def __init__(self) -> None:
        self._base = cache(self._of_file)
        self._of = cache(self._with_overrides)
        self._content = cache(_content_hash)

    def __call__(self, kind: str, path: str | Path | None, overrides: Overrides) -> str:
        """Return the hash of a file with assignments; empty if it cannot be read."""
        return self._of(kind, path, overrides)

    def _of_file(self, kind: str, path: str | Path | None) -> str:
        if path is None:
            return "defaults"
        try:
            data = sources.read_source(sources.find_file(path, kind), kind).data
        except InputError:
            return ""
        text = json.dumps(data, sort_keys=True, default=str)
        files = [self._content(name) for name in _file_names(data)]
        return _hashed([text, *files])

    def _with_overrides(self, kind: str, path: str | Path | None, overrides: Overrides) -> str:
        base = self._base(kind, path)
        if not base:
            return ""
        named = [self._content(name) for text in overrides for name in _named_files(text)]
        return _hashed([base, *overrides, *named])


def _hashed(parts: Sequence[str]) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "surrogateescape")).hexdigest()


def _content_hash(name: str) -> str:
    try:
        return hashlib.sha256(read_bytes(name, TABLE_BYTES)).hexdigest()
    except InputError:
        return "unreadable"


def _file_names(node: Any, of_file: bool = False) -> Iterator[str]:
    """Yield what stands under keys that name files, where it is a file."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _file_names(value, key in sources.FILE_KEYS)
    elif isinstance(node, list):
        for value in node:
            yield from _file_names(value, of_file)
    elif of_file and isinstance(node, str) and is_file(node):
        yield node


def _named_files(assignment: str) -> Iterator[str]:
    """Yield the files that an assignment names."""
    key, _, written = assignment.partition("=")
    if not sources.FILE_KEYS & set(key.strip().split(".")):
        return
    try:
        value: Any = tomllib.loads(f"v = {written}")["v"]
    except (ValueError, RecursionError):
        value = written.strip()
    yield from _file_names({"file": value})


def point_key(*parts: Any) -> str:
    """Return the key of a point; empty if one of the hashes among `parts` is."""
    return "" if "" in parts else _hashed([__version__, *map(repr, parts)])


def check_number(
    lists: Sequence[Sequence[object]], cores: int, seconds: Callable[[], float]
) -> None:
    """Refuse a study whose number of runs must be a mistake.

    `lists`: lists that are combined; `cores`: number of processes; `seconds`: returns an estimate
    of the simulated time of a run [s]; called if there are too many runs. Raises InputError: the
    number of combinations is above `MOST_RUNS`; the message gives the time needed.
    """
    number = math.prod(len(values) for values in lists)
    if number <= MOST_RUNS:
        return
    each = seconds() / REAL_TIME_FACTOR + SECONDS_BESIDES
    found = f"{number:,} runs, some {duration_in_words(number * each / cores)} on {cores} cores"
    raise input_error("study", found, f"at most {MOST_RUNS:,}; give fewer values")
