"""Tables of a file that name another one get what that one holds, as results carry it."""

from collections.abc import Callable, Iterable
from typing import Any

from railsim.errors import Fault, Faults
from railsim.files.access import is_file
from railsim.text import LONGEST_FILE, shortened


def tables_of(group: Any, name: str) -> list[tuple[str, Any]]:
    """Members of a list or table of tables, with the keys that faults name."""
    inner = group.get(name) if isinstance(group, dict) else None
    pairs: Iterable[tuple[Any, Any]] = enumerate(inner) if isinstance(inner, list) else ()
    pairs = inner.items() if isinstance(inner, dict) else pairs
    return [(f"{name}.{key}", table) for key, table in pairs if isinstance(table, dict)]


def embed(
    tables: Iterable[tuple[str, Any]], content: str, allowed: str, read: Callable[[str, Any], None]
) -> list[Fault]:
    """Replace `file` in tables by what the file holds; return what is wrong.

    `tables`: each with its key; `content`: key of what was read, with which `file` is left to the
    definition, which refuses one of them; `allowed`: what the file should be; `read`: changes a
    table, given its key too, or raises InputError.
    """
    faults = Faults()
    for key, table in tables:
        if not isinstance(table.get("file"), str) or content in table:
            continue
        if is_file(table["file"]):
            with faults.caught():
                read(key, table)
        else:
            file = shortened(table["file"], LONGEST_FILE)
            faults.append(Fault("", f"{key}.file", f"no file '{file}'", allowed))
    return faults
