"""Dotted paths into nested tables: ``bodies.carbody.mass``, ``placements.front.position.0``.

Members of lists are named by their key `name`, else by their index from 0; those of three numbers
also by the axes ``x``, ``y``, ``z``.  What a path does not
find is a `KeyError` with a sentence for the user.
"""

import tomllib
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from typing import Any

from railsim.errors import nearest

AXES = ("x", "y", "z")
LONGEST_KEY = 1000  # characters; the deepest key of a vehicle has some hundred
NEW_MEMBERS: dict[str, str] = {}
"""How a new member of a table begins, by the table's name; definitions add theirs."""


def key_path(key: str) -> list[str]:
    """Return the parts of a dotted key; parts may be quoted as in TOML.

    Raises KeyError: it is no key.

    >>> key_path('initial."front.frame".y')
    ['initial', 'front.frame', 'y']
    """
    parts = []
    try:
        node = tomllib.loads(f"{key} = 0") if len(key) <= LONGEST_KEY else {}
        while isinstance(node, dict):
            ((part, node),) = node.items()
            parts.append(part)
    except (ValueError, RecursionError):  # no TOML; a comment; several lines
        raise KeyError("a dotted path of keys such as bodies.carbody.mass") from None
    return parts


def telling_end(key: str, keys: Iterable[str], least: int = 1) -> str:
    """Return the shortest end of a key, of `least` parts or more, that no other of `keys` has.

    >>> telling_end("bodies.frame.mass", ["bodies.frame.mass", "bodies.carbody.mass"])
    'frame.mass'
    """
    parts = key.split(".")
    for number in range(least, len(parts)):
        end = ".".join(parts[-number:])
        if sum(f".{other}".endswith(f".{end}") for other in keys) == 1:
            return end
    return key


def descend(
    data: Any, path: Sequence[str], create: bool = False, defaults: Any = None
) -> tuple[Any, Any]:
    """Return the table or list that holds the last part of the path, and its key or index.

    `data`: tables as read; `path`: keys, names of members, indices; `create`: make tables that are
    missing; `defaults`: what holds where `data` gives no value: its tables and lists come into
    `data` when the path leads through them. Raises KeyError: the path leads nowhere.
    """
    node = data
    for depth, part in enumerate(path):
        key = _member(node, part)
        last = depth == len(path) - 1
        if last and (isinstance(node, dict) or key is not None):
            return node, part if isinstance(node, dict) else key
        defaults_here = defaults if isinstance(node, dict) and isinstance(defaults, dict) else {}
        is_default = part in defaults_here
        defaults = defaults_here.get(part)
        if key is None and isinstance(node, dict) and (is_default or create):
            node[part] = {} if create and not defaults else deepcopy(defaults)
            key = part
        if key is None:
            raise KeyError(_no_member(node, part, path[:depth], defaults_here))
        node = node[key]
        if node is None:
            raise KeyError(f"'{'.'.join(path[: depth + 1])}' is not given; give it as a whole")
    raise KeyError("a dotted path of keys")


def _member(node: Any, part: str) -> str | int | None:
    """Return the key or index of a member: by key, in a list by its `name`, else by its index."""
    if isinstance(node, dict):
        return part if part in node else None
    if isinstance(node, list):
        for index, member in enumerate(node):
            if isinstance(member, dict) and member.get("name") == part:
                return index
        if part.isdecimal() and int(part) < len(node):
            return int(part)
        if part in AXES and len(node) == len(AXES) and all(_is_number(value) for value in node):
            return AXES.index(part)
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


LOADS = "loads"


def full_path(data: Any, path: Sequence[str], defaults: Any = None) -> list[str]:
    """Return the whole path of a short one: its parts in their order, others between them.

    `data`: tables as read; `path`: keys, the last of them the one that is meant; `defaults`: as for
    `descend`. Returns: the path itself where it leads somewhere; where nothing has all its parts,
    the whole path of as many of the first as there are, so that the fault says what is allowed.
    Raises KeyError: several keys have these parts.

    >>> axle = {"elements": {"primary": {"stiffness": [1.0, 2.0, 3.0]}}}
    >>> full_path({"assemblies": {"axle": axle}}, ["primary", "stiffness", "x"])
    ['assemblies', 'axle', 'elements', 'primary', 'stiffness', 'x']
    >>> full_path({"elements": {"primary": {"stiffness": 1.0}}}, ["primary", "stifness"])
    ['elements', 'primary', 'stifness']
    >>> bodies = {"bodies": {"car": {"mass": 1.0}}}
    >>> full_path({**bodies, "loads": {"laden": bodies}}, ["car", "mass"])
    ['bodies', 'car', 'mass']
    """
    whole = list(path)
    if len(whole) < 2 or whole[0] in data or whole[0] in (defaults or {}):
        return whole
    for end in range(len(whole), 0, -1):
        matches = [keys for keys in _paths(data) if _holds(keys, whole[:end])]
        # a load case repeats keys of bodies: a short path means the body
        matches = [keys for keys in matches if keys[0] != LOADS] or matches
        if len(matches) > 1 and end == len(whole):
            examples = ", ".join(".".join(keys) for keys in matches[:4])
            raise KeyError(f"'{'.'.join(whole)}' is {len(matches)} keys: {examples}")
        if len(matches) == 1:
            return [*matches[0], *whole[end:]]
    return whole


def _paths(node: Any, before: tuple[str, ...] = ()) -> Iterator[list[str]]:
    if isinstance(node, dict):
        members = [(str(key), value) for key, value in node.items()]
    elif isinstance(node, list):
        vector = len(node) == len(AXES) and all(_is_number(value) for value in node)
        has_name = [isinstance(m, dict) and "name" in m for m in node]
        names = [str(m["name"] if has_name[i] else i) for i, m in enumerate(node)]
        members = list(zip(AXES if vector else names, node, strict=True))
    else:
        return
    for key, value in members:
        yield [*before, key]
        yield from _paths(value, (*before, key))


def _holds(keys: Sequence[str], path: Sequence[str]) -> bool:
    """Whether keys end as a short path does and hold its other parts, in their order."""
    if keys[-1] != path[-1]:
        return False
    rest = iter(keys)
    return all(part in rest for part in path)


def _no_member(node: Any, part: str, before: Sequence[str], others: Iterable[str]) -> str:
    table = ".".join(before) or "the file"
    if isinstance(node, dict):
        choices = {*node, *others}
        allowed = nearest(part, choices) if choices else "it is empty"
        is_table_of_tables = all(isinstance(member, dict) for member in node.values())
        new = is_table_of_tables and not allowed.startswith("did you mean")
        kinds = NEW_MEMBERS.get(before[-1], "") if before else ""
        adds = f"{table}.{part}={{{kinds}...}} adds it" if new else ""
        return "; ".join(filter(None, [f"no '{part}' in {table}", allowed, adds]))
    if isinstance(node, list):
        names = [m["name"] for m in node if isinstance(m, dict) and "name" in m]
        if names:
            return f"no member '{part}' in {table}; {nearest(part, map(str, names))}"
        axes = "x, y, z or " if len(node) == len(AXES) and all(map(_is_number, node)) else ""
        indices = f"allowed: {axes}0 to {len(node) - 1}" if node else "it is empty"
        return f"no member '{part}' in {table}; {indices}"
    return f"'{table}' is a value and has no members"
