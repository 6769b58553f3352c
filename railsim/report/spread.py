"""Spread of the values of a study over the varied parameters: tables of the page."""

import shlex
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from statistics import median
from typing import Any

from railsim.arrays import largest_first
from railsim.studies.columns import RANKED, WORDS, Record, columns, parameters

LEAST = 3  # runs, for a spread
WORST = 5  # runs of each quantity


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
