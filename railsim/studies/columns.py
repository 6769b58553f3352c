"""What the runs of a study have, by column: parameters that differ, values of the summary."""

from collections.abc import Mapping, Sequence
from typing import Any

from railsim.definitions.study.analyses import unit_of_number
from railsim.files.key_paths import AXES, telling_end
from railsim.notation import DECIMALS, QUANTITIES, Quantity
from railsim.profiles.builtin import RAIL_HEADS
from railsim.text import printable
from railsim.units import number_with_unit

Record = Mapping[str, Any]
WORDS = {"abs": "peak", "max": "largest", "min": "smallest"}
RANKED = ("dQ_over_Q0_max", "dQ_over_Q0_min", "Y_over_Q_abs", "sum_Y_abs", "T_gamma_abs")
"""Quantities of the worst runs, and of pictures by default."""


def parameters(
    records: Sequence[Record], units: Mapping[str, str] | None = None
) -> dict[str, dict[str, Any]]:
    """Return the parameters that differ between runs, by name: ``words``, ``unit``, ``values``.

    Numbers are numbers, those with a unit in SI; the words are the end of the name that tells it
    from all others. `units`: By name, as of `railsim.report.inputs.units_of`.

    >>> runs = [{"labels": {"vehicle": "a", "speed": 20.0, "track.friction": f}} for f in "12"]
    >>> parameters(runs)
    {'track.friction': {'words': 'friction', 'unit': '', 'values': [1.0, 2.0]}}
    """
    names = list(dict.fromkeys(name for record in records for name in record["labels"]))
    found = {}
    for name in names:
        values = [record["labels"].get(name, "") for record in records]
        if len(set(map(str, values))) > 1:
            unit = "m/s" if name == "speed" else (units or {}).get(name, "")
            parts = name.split(".")
            # of a vehicle also the part that has the value: `guide.stiffness.x`, `carbody.mass`
            least = 1 + (parts[0] == "vehicle") + (parts[-1] in AXES or parts[-1].isdecimal())
            words = telling_end(name, names, least)
            found[name] = {"words": words, "unit": unit, "values": _numbers(values)}
    return found


def _numbers(values: Sequence[Any]) -> list[Any]:
    try:
        return [number(value) for value in values]
    except (TypeError, ValueError):
        return [printable(str(value)) for value in values]


def number(value: Any) -> float:
    """Return a label as a number in SI; raises TypeError, ValueError: it is none.

    >>> number("16e6"), number("10 kN")
    (16000000.0, 10000.0)
    """
    if value in RAIL_HEADS:  # 60E1 is no 600
        raise ValueError(value)
    in_si = number_with_unit(str(value))  # None without a unit
    return float(value) if in_si is None else in_si


def columns(records: Sequence[Record]) -> dict[str, dict[str, Any]]:
    """Return the values of all runs in the units of printed tables, by the keys of quantities.

    Returns: each with ``words``, ``unit``, ``decimals`` (None: four digits), and one of ``values``
    for each run, or None.
    """
    by_key: dict[str, dict[str, Any]] = {}

    def add(run: int, key: str, words: str, unit: str, value: float) -> None:
        column = by_key.setdefault(key, {
            "words": words, "unit": unit, "decimals": DECIMALS.get(unit or "-"),
            "values": [None] * len(records),
        })  # fmt: skip
        if value == value:
            column["values"][run] = float(f"{value:.6g}")

    for number, record in enumerate(records):
        for key, words, quantity, value in _values(record):
            add(number, key, words, quantity.shown_unit.replace("-", ""), value * quantity.scale)
        for key, value in record.get("quantities", {}).items():
            if value is not None:  # of an analysis or of a user function, in SI
                add(number, key, printable(key), unit_of_number(key), value)
                by_key[key]["decimals"] = None  # of any size
    return by_key


def _values(record: Record) -> list[tuple[str, str, Quantity, float]]:
    rows = []
    for peak in record.get("peaks", ()):
        if peak["quantity"] in QUANTITIES and peak["value"] is not None:
            quantity = QUANTITIES[peak["quantity"]]
            # peaks by magnitude, so that mirrored curves give equal values
            value = abs(peak["value"]) if peak["kind"] == "abs" else peak["value"]
            magnitude = " magnitude" * (peak["kind"] == "abs")
            words = f"{quantity.long_name}, {WORDS[peak['kind']]}{magnitude}"
            rows.append((f"{quantity.name}_{peak['kind']}", words, quantity, value))
    for number, curve in enumerate(record.get("mid_curves", ()), start=1):
        # records of earlier versions have only the value at the middle of the curve
        steady, where = curve.get("largest_medians"), "full curve"
        if steady is None:
            steady, where = curve["largest"], "middle of curve"
        for name, value in steady.items():
            if name in QUANTITIES and value is not None:
                quantity = QUANTITIES[name]
                words = f"{quantity.long_name}, {where} {number}"
                rows.append((f"{name}_mid{number}", words, quantity, abs(value)))
    return rows
