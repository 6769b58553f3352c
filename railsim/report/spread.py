"""Spread of the values of a study over the varied parameters: columns of the page and its table."""

import shlex
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from statistics import median
from typing import Any

from railsim.arrays import largest_first
from railsim.definitions.study.analyses import unit_of_number
from railsim.files.key_paths import AXES, telling_end
from railsim.notation import DECIMALS, QUANTITIES, Quantity
from railsim.profiles.builtin import RAIL_HEADS
from railsim.text import printable
from railsim.units import number_with_unit

Record = Mapping[str, Any]
WORDS = {"abs": "peak", "max": "largest", "min": "smallest"}
LEAST = 3  # runs, for a spread
WORST = 5  # runs of each quantity
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


def command(record: Record, inputs: Mapping[str, Any]) -> str:
    """Return the command that computes a run of a study again; of a scenario, all its runs.

    Empty where the run belongs to no study: its labels are names, not files.

    >>> run = {"labels": {"vehicle": "coach_25t", "track": "straight", "speed": 40.0}}
    >>> command(run, {"duration": 5.0})
    'railsim run coach_25t straight --speed 40 --duration 5'
    """
    if not inputs:
        return ""
    labels = dict(record["labels"])
    files = []
    for kind in ("vehicle", "track"):
        label = str(labels.pop(kind, ""))
        known = [str(file) for file in inputs.get(f"{kind}s", ())]
        files.append(next((file for file in known if Path(file).stem == label), label))
    words = ["railsim", "run", *files]
    if scenario := inputs.get("scenario"):  # its conditions and seeds are no options of a run
        words = ["railsim", "study", "--scenario", str(scenario), "--vehicles", files[0]]
        labels = {}
    if "speed" in labels:
        words += ["--speed", f"{labels.pop('speed'):.12g}"]
    for option in ("settings", "start", "duration", "until"):
        value = inputs.get(option)
        if value:
            words += [f"--{option}", f"{value:.12g}" if isinstance(value, float) else str(value)]
    pairs = [f"{key}={value}" for key, value in labels.items() if "." in key]
    for pair in (*inputs.get("assignments", ()), *pairs):
        words += ["--set", str(pair)]
    return shlex.join(words)


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


def spread_rows(records: Sequence[Record]) -> list[list[str]]:
    """Return smallest, median and largest value of each quantity, with their runs."""
    rows = []
    for column in columns(records).values():
        pairs = [(v, i) for i, v in enumerate(column["values"]) if v is not None]
        if len(pairs) < LEAST:
            continue
        low, high = min(pairs), max(pairs)
        middle = _cell_text(median(value for value, _ in pairs), column)
        low_cells, high_cells = (
            [_cell_text(value, column), str(records[i]["name"])] for value, i in (low, high)
        )
        rows.append([_heading(column), *low_cells, middle, *high_cells])
    return rows


def worst_rows(
    records: Sequence[Record], units: Mapping[str, str] | None = None
) -> list[list[tuple[str, str] | str]]:
    """Return the runs with the largest values of each quantity, with what tells them apart.

    The quantities are those by which the runs with curves are chosen; where no run has any of
    them, those of analyses and functions of the user.
    """
    by_key, varied = columns(records), parameters(records, units)
    rows: list[list[tuple[str, str] | str]] = []
    others = [key for key in by_key if "_mid" not in key and not key.endswith(tuple(WORDS))]
    for key in [name for name in RANKED if name in by_key] or others:
        column = by_key[key]
        row: list[tuple[str, str] | str] = [_heading(column)]
        for number in largest_first(column["values"])[:WORST]:
            differences = (
                f"{each['words']} {_text(each['values'][number])} {each['unit']}".rstrip()
                for each in varied.values()
            )
            where = ", ".join(differences) or str(records[number]["name"])
            row.append((_cell_text(column["values"][number], column), where))
        rows.append(row + [""] * (1 + WORST - len(row)))
    return rows


def _heading(column: Mapping[str, str]) -> str:
    return column["words"] + (f" ({column['unit']})" if column["unit"] else "")


def _cell_text(value: float, column: Mapping[str, Any]) -> str:
    decimals = column["decimals"]
    return f"{value:.4g}" if decimals is None else f"{value:.{decimals}f}"


def _text(value: Any) -> str:
    """Four digits, as the table of the runs has them: 16000, not 1.6e+04."""
    return f"{float(f'{value:.4g}'):.12g}" if isinstance(value, float) else str(value)


def worst_runs(records: Sequence[Record], most: int) -> list[str]:
    """Return the names of at most `most` runs, those with the largest values.

    All runs if there are no more; otherwise the runs with the largest value of each quantity in
    turn, then those with the second largest, and so on; in the order of the runs.
    """
    names = [str(record["name"]) for record in records]
    if len(names) <= most:
        return names
    by_key = columns(records)
    ranked = [largest_first(by_key[name]["values"]) for name in RANKED if name in by_key]
    in_turn = dict.fromkeys(number for rank in zip_longest(*ranked) for number in rank)
    in_turn.pop(None, None)
    return [names[number] for number in sorted([*in_turn][:most] or range(most))]
