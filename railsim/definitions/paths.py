"""Dotted paths into nested tables: ``bodies.carbody.mass``, ``placements.front.position.0``.

Members of lists are named by their key `name`, else by their index from 0.  What a path does not
find is a `KeyError` with a sentence for the user.
"""

import tomllib
from collections.abc import Iterable, Sequence
from copy import deepcopy
from typing import Any

from railsim.errors import nearest


def key_path(key: str) -> list[str]:
    """Return the parts of a dotted key; parts may be quoted as in TOML.

    Examples
    --------
    >>> key_path('initial."front.frame".y')
    ['initial', 'front.frame', 'y']

    Raises
    ------
    KeyError : it is no key.
    """
    try:
        node = tomllib.loads(f"{key} = 0")
    except (ValueError, RecursionError):
        raise KeyError("a dotted path of keys such as bodies.carbody.mass") from None
    parts = []
    while isinstance(node, dict):
        ((part, node),) = node.items()
        parts.append(part)
    return parts


def descend(
    data: Any, path: Sequence[str], create: bool = False, defaults: Any = None
) -> tuple[Any, Any]:
    """Return the table or list that holds the last part of the path, and its key or index.

    Parameters
    ----------
    data : dict or list
        Tables as read.
    path : sequence of str
        Keys, names of members, indices.
    create : bool
        Make tables that are missing.
    defaults : dict, optional
        What holds where `data` says nothing: its tables and lists come into `data` when the path
        leads through them.

    Raises
    ------
    KeyError : the path leads nowhere.
    """
    node = data
    for depth, part in enumerate(path):
        key = _member(node, part)
        last = depth == len(path) - 1
        if last and (isinstance(node, dict) or key is not None):
            return node, part if isinstance(node, dict) else key
        others = defaults if isinstance(node, dict) and isinstance(defaults, dict) else {}
        known = part in others
        defaults = others.get(part)
        if key is None and isinstance(node, dict) and (known or create):
            node[part] = {} if create and not defaults else deepcopy(defaults)
            key = part
        if key is None:
            raise KeyError(_no_member(node, part, path[:depth], others))
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
    return None


def _no_member(node: Any, part: str, before: Sequence[str], others: Iterable[str]) -> str:
    place = ".".join(before) or "the file"
    if isinstance(node, dict):
        return f"no '{part}' in {place}; {nearest(part, {*node, *others})}"
    if isinstance(node, list):
        names = [m["name"] for m in node if isinstance(m, dict) and "name" in m]
        if names:
            return f"no member '{part}' in {place}; {nearest(part, map(str, names))}"
        indices = f"allowed: 0 to {len(node) - 1}" if node else "it is empty"
        return f"no member '{part}' in {place}; {indices}"
    return f"'{place}' is a value and has no members"
