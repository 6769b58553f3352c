"""Units of the numbers in files, from what the text below each field of a definition says."""

import re
from collections.abc import Mapping
from typing import Any

from railsim.definitions.base import Definition, meanings
from railsim.files.key_paths import AXES, full_path, key_path

UNIT = re.compile(r"(?!1$|SI$|.* or )(1|[A-Za-z]{1,3}2?)([ /][A-Za-z]{1,3}2?)*")
"""No `m or rad`, `unit of the quantity`"""


def unit_of_key(definition: Definition, key: str) -> str:
    """Return the unit of the number under a dotted key; empty where it has none, or one of several.

    `key`: Whole or short, as `--set` takes it behind ``vehicle.``, ``track.`` or ``settings.``.

    >>> from railsim.definitions.loading import load_vehicle
    >>> coach = load_vehicle("coach_manchester")
    >>> [unit_of_key(coach, key) for key in ("primary.stiffness.x", "bodies.carbody.mass", "name")]
    ['N/m', 'kg', '']
    """
    node: Any = definition
    meaning = ""
    try:
        for part in full_path(definition.model_dump(mode="json"), key_path(key)):
            if isinstance(node, Definition):
                meaning, node = meanings(type(node)).get(part, ""), getattr(node, part)
            elif isinstance(node, Mapping):
                node = node[part]
            else:
                names = [getattr(member, "name", None) for member in node]
                indices = names if part in names else [str(i) for i in range(len(node))]
                node = node[AXES.index(part) if part in AXES else indices.index(part)]
    except (KeyError, ValueError, TypeError, AttributeError, IndexError):
        return ""
    units = re.findall(r"\[([^\]]*)\]", meaning)
    return units[0] if len(units) == 1 and UNIT.fullmatch(units[0]) else ""


def unit_of_input(inputs: Any, key: str) -> str:
    """Return the unit of a key of the inputs of a run, ``vehicle.``, ``track.`` or ``settings.``.

    `inputs`: With these three as attributes.
    """
    kind, _, inner = key.partition(".")
    is_input = inner and kind in ("vehicle", "track", "settings")
    return unit_of_key(getattr(inputs, kind), inner) if is_input else ""
