"""Make what the manual holds of tables, pages and pictures.

``python docs/generate.py [NAME[:PART] ...]``, for instance ``creep:fastsim`` or ``examples:pages``;
``--help`` lists the names.  Without a name those that a change of railsim's quantities needs.
"""

import sys
from collections.abc import Sequence
from importlib import import_module

from generators import GENERATORS

from railsim.errors import nearest


def main(words: Sequence[str]) -> int:
    """Run the generators that are named."""
    wanted: dict[str, list[str]] = {}
    for word in words or ["tables"]:
        name, _, part = word.partition(":")
        wanted.setdefault(name, []).extend([part] if part else [])
    if unknown := wanted.keys() - GENERATORS.keys():
        lines = [f"  {name:11} {what}" for name, what in GENERATORS.items()]
        print("python docs/generate.py [NAME[:PART] ...]", *lines, sep="\n")
        return 0 if unknown <= {"-h", "--help"} else 2
    modules = {name: import_module(f"generators.{name}") for name in wanted}
    for name, parts in wanted.items():
        known = getattr(modules[name], "PARTS", parts)  # any, where they are folders
        if wrong := [part for part in parts if part not in known]:
            allowed = nearest(wrong[0], known) if known else "it has none"
            print(f"{name}: no part '{wrong[0]}'; {allowed}")
            return 2
    for name, parts in wanted.items():
        modules[name].make(parts)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
