"""Overrides: ``key.path=value`` as ``--set`` gives them, or keys and values of Python.

Values of `--set` are TOML; what is not TOML is a number with a unit (``5mm``) or text, so that
``rail=60E1`` needs no quotes.  A path may be short where it is unique: ``primary.stiffness.x``.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import partial
from pathlib import PurePath
from typing import Any

from railsim.errors import Faults
from railsim.files.key_paths import descend, full_path, key_path
from railsim.files.sources import OVERRIDE, Source, located_fault, replace_origin
from railsim.text import shortened
from railsim.units import number_with_unit

Read = Callable[[Any], Any]
"""What becomes of a present value."""
_TABLES = {"damping": "damper_table", "stiffness": "spring_table"}  # in whose place they stand


def apply_overrides(
    source: Source, overrides: Iterable[str], free: Sequence[str], defaults: dict[str, Any]
) -> Source:
    """Return the source with `key.path=value` texts applied in their order.

    `source`: what to change; it stays as it is; `overrides`: assignments with TOML values; members
    of lists are named by their `name`, else by index; `free`: tables by dotted names:
    `initial.front.frame.y` is key `y` of body `front.frame`; `defaults`: what holds where the
    source gives no value, so that `fastsim_grid.0=20` changes one of two. Raises InputError: an
    assignment that means nothing; all of them at once.
    """
    return _assign(source, map(_split, overrides), free, defaults, OVERRIDE)


def with_values(
    source: Source, values: Mapping[str, Any], free: Sequence[str], defaults: dict[str, Any]
) -> Source:
    """Return the source with values of Python at `key.path`s; as `apply_overrides`.

    Raises InputError: keys that lead nowhere; all of them at once.
    """
    if not isinstance(values, Mapping):
        raise TypeError(f"the values are {values!r}; give keys with their values: {{'key': 1.0}}")
    assignments = ((key, lambda _, value=value: plain(value)) for key, value in values.items())
    return _assign(source, assignments, free, defaults, source.file)


def _split(text: str) -> tuple[str, Read | None]:
    """Return the key of an assignment, and what makes its value of the present one."""
    key, equals, text_value = text.partition("=")
    return key.strip(), partial(_value, text_value.strip()) if equals else None


def plain(value: Any) -> Any:
    """Return what TOML would hold: lists for tuples and arrays, numbers for those of numpy."""
    if type(value) is float:  # the most frequent, in long tables
        return value
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {key: plain(member) for key, member in value.items()}
    if isinstance(value, list | tuple):
        return [plain(member) for member in value]
    return value


def _assign(
    source: Source,
    assignments: Iterable[tuple[str, Read | None]],
    free: Sequence[str],
    defaults: dict[str, Any],
    origin: str,
) -> Source:
    data = deepcopy(source.data)
    changed = replace(source, data=data, origin=dict(source.origin))
    faults = Faults()
    for key, read in assignments:
        try:
            if read is None:
                raise KeyError("an assignment key.path=value is needed")
            path = key_path(key)
            if path[0] in free and len(path) > 2:
                path = [path[0], ".".join(path[1:-1]), path[-1]]
            else:
                path = full_path(data, path, defaults)
            parent, last = descend(data, path, path[0] in free, defaults)
            present = parent[last] if not isinstance(parent, dict) or last in parent else None
            names = tuple(str(descend(data, path[:end])[1]) for end in range(1, len(path) + 1))
            parent[last] = read(present)
            if not parent[last] and (table := _TABLES.get(last)) in parent:
                raise KeyError(f"has no effect beside '{table}'; no force: {table}=[[0,0],[1,0]]")
            replace_origin(changed.origin, names, present, parent[last], origin)
        except KeyError as problem:
            faults.append(located_fault(origin, key, str(problem.args[0]), ""))
    faults.check()
    return changed


def _value(text: str, present: Any) -> Any:
    """Return a written value: TOML, and what is not TOML is text without its quotes."""
    text_expected = isinstance(present, str)
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        if not text or text[0] in "[{\"'":
            raise KeyError(f"the value '{shortened(text)}' is not TOML") from None
        return text if text_expected or (found := number_with_unit(text)) is None else found
    except (ValueError, RecursionError):  # an integer of 5000 digits, a thousand brackets
        raise KeyError(f"the value '{shortened(text)}' is out of range") from None
    return text if text_expected and not isinstance(value, str | list | dict) else value


def split_overrides(overrides: Iterable[str]) -> dict[str, list[str]]:
    """Sort `vehicle.`, `track.` and `settings.` assignments; the prefixes are taken off.

    Raises InputError: an assignment with another beginning.

    >>> split_overrides(["track.friction=0.3", "settings.scheme=rk4"])
    {'vehicle': [], 'track': ['friction=0.3'], 'settings': ['scheme=rk4']}
    """
    by_kind: dict[str, list[str]] = {"vehicle": [], "track": [], "settings": []}
    faults = Faults()
    for text in overrides:
        prefix, _, rest = text.partition(".")
        if prefix in by_kind:
            by_kind[prefix].append(rest)
        else:
            key = text.partition("=")[0]
            allowed = "the path must begin with vehicle., track. or settings."
            faults.append(located_fault(OVERRIDE, key, "unknown prefix", allowed))
    faults.check()
    return by_kind
