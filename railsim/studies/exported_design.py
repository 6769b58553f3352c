"""The chosen design of an optimisation as a vehicle file that extends the original."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from railsim.files import sources
from railsim.files.access import is_file, write_text
from railsim.files.overrides import apply_overrides, split_overrides
from railsim.studies.designs import Design, Evaluation, name_of
from railsim.studies.summary import unit_of


def export_vehicles(evaluation: Evaluation, chosen: Design) -> list[Path]:
    """Write a file for each vehicle that extends it with the chosen values."""
    row = evaluation.rows[chosen.number - 1]
    texts = list(evaluation.definition.assignments)
    for (path, variable), text in zip(evaluation.variables, row, strict=True):
        texts += [f"{key}={text}" for key in (path, *variable.also)]
    overrides = split_overrides(texts)["vehicle"]
    wanted = evaluation.wanted
    values = [
        f"# {name_of(one)}: {value:.6g} {unit_of(one.quantity)}".rstrip()
        for one, value in zip(
            (*wanted.objectives, *wanted.constraints),
            (*chosen.objectives, *chosen.constraints),
            strict=True,
        )
    ]
    found = []
    for vehicle in evaluation.definition.vehicles:
        file = evaluation.folder / f"{Path(vehicle).stem}_chosen.toml"
        lead = f"# Design {chosen.number} of {len(evaluation.designs)}, by `railsim optimise`."
        text = "\n".join([lead, *values, vehicle_text(vehicle, overrides, file.parent)])
        write_text(file, text)
        found.append(file)
    return found


def vehicle_text(vehicle: str | Path, overrides: Sequence[str], folder: Path) -> str:
    """Return the text of a vehicle file that extends another one with some values changed.

    Parameters
    ----------
    vehicle : str or Path
        File, or name of a shipped one.
    overrides : sequence of str
        ``key.path=value`` with the file's own keys.
    folder : Path
        Folder of the new file; the path to the original is relative to it.
    """
    from railsim.definitions import Vehicle

    base = sources.read_source(sources.find_file(vehicle, "vehicle"), "vehicle")
    defaults = Vehicle.model_construct().model_dump(mode="json")
    changed = apply_overrides(base, overrides, Vehicle.OPEN_TABLES, defaults).data
    named = os.path.relpath(vehicle, folder) if is_file(vehicle) else str(vehicle)
    head = {
        "format": base.data["format"],
        "name": f"{base.data.get('name', vehicle)}, optimised",
        "extends": named,
    }
    text: str = tomli_w.dumps({**head, **_difference(base.data, changed)})
    return text


def _difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that turn one table into another by `extends`.

    Examples
    --------
    >>> _difference({"a": {"b": 1, "c": [1, 2]}}, {"a": {"b": 1, "c": [1, 3]}, "d": {"e": 4}})
    {'a': {'c': [1, 3]}, 'd': {'e': 4}}
    """
    found: dict[str, Any] = {}
    for key, value in after.items():
        old = before.get(key)
        if value == old:
            continue
        found[key] = value
        if isinstance(value, dict) and isinstance(old, dict):
            alike = value.get("kind") == old.get("kind")
            found[key] = _difference(old, value) if alike else value
    return found
