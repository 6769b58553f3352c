"""The mechanism file that a search writes: it extends the searched one and runs again."""

import tomllib
from collections.abc import Sequence
from typing import Any

import tomli_w

from railsim.definitions.mechanism.definition import MECHANISM_FORMAT
from railsim.files.key_paths import key_path
from railsim.mechanisms.optimum import Optimum


def optimised_text(
    base: str, optimum: Optimum, assignments: Sequence[str], case: str | None
) -> str:
    """Return the text of the file.

    `base` is the searched file as the new one must name it; the overrides ``key.path=value`` and
    the parameters of the case that were in force are written down.
    """
    definition = optimum.definition
    data: dict[str, Any] = {}
    changed: list[str] = []
    for text in assignments:
        key, _, written = text.partition("=")
        path = key_path(key.strip())
        if any(part.isdecimal() for part in path):
            # a member of a list cannot be changed by a file that extends another: all of it
            return definition.to_toml()
        node = data
        for part in path[:-1]:
            node = node.setdefault(part, {})
        node[path[-1]] = _value(written.strip())
        changed += [path[1]] if path[0] == "parameters" and len(path) == 2 else []
    parameters = data.setdefault("parameters", {})
    if case is not None:
        parameters |= definition.cases[case]
        changed += definition.cases[case]
    parameters |= optimum.parameters
    best = list(optimum.parameters)
    provenance = data.setdefault("provenance", {})
    provenance["set"] = [name for name in dict.fromkeys(changed) if name not in best]
    provenance["optimised"] = best
    head = {"format": MECHANISM_FORMAT, "extends": base, "name": f"{definition.name}, optimised"}
    count = len(optimum.starts)
    lead = (
        f"# Found by {count} starts with seed {optimum.seed}: objective {optimum.objective:.6g}"
        + ("" if optimum.feasible else ", a compromise that breaks constraints")
    )
    return f"{lead}\n{tomli_w.dumps({**head, **data})}"


def _value(written: str) -> Any:
    try:
        return tomllib.loads(f"value = {written}")["value"]
    except (ValueError, RecursionError):  # no TOML is text
        return written
