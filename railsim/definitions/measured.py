"""Reading measured irregularities: CSV over distance into the rows of a track definition.

The rows become part of the track, so that a result carries its irregularities with its track.
"""

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from railsim.definitions.irregularity import COLUMNS
from railsim.errors import Fault, nearest

UNITS = {"": 1.0, "_m": 1.0, "_mm": 1e-3}
# what a column adds to y_left, z_left, y_right, z_right
SHARES = {
    "y_left": (1.0, 0.0, 0.0, 0.0),
    "z_left": (0.0, 1.0, 0.0, 0.0),
    "y_right": (0.0, 0.0, 1.0, 0.0),
    "z_right": (0.0, 0.0, 0.0, 1.0),
    "y": (1.0, 0.0, 1.0, 0.0),
    "z": (0.0, 1.0, 0.0, 1.0),
    "cross_level": (0.0, -0.5, 0.0, 0.5),
    "gauge": (-0.5, 0.0, 0.5, 0.0),
}
MOST_FAULTS = 20
LARGEST = 0.5  # m

Rows = list[tuple[float, ...]]


def embed_measured(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by the `rows` that it holds in every measured irregularity of a track.

    Parameters
    ----------
    data : dict
        A track as plain tables; changed in place.

    Returns
    -------
    list of Fault
        What is wrong in the files.
    """
    faults = []
    listed = data.get("irregularities")
    for index, table in enumerate(listed if isinstance(listed, list) else []):
        if not isinstance(table, dict) or not isinstance(table.get("file"), str):
            continue
        if "rows" in table:
            continue  # refused by the definition: either one or the other
        path = Path(table["file"])
        if not path.is_file():
            key = f"irregularities.{index}.file"
            faults.append(Fault("", key, f"no file '{path}'", "a CSV beside the track file"))
            continue
        rows, wrong = read_measured(path)
        faults += wrong
        if not wrong:
            del table["file"]
            table["rows"] = [list(row) for row in rows]
    return faults


def read_measured(path: Path) -> tuple[Rows, list[Fault]]:
    """Read rows [s, y_left, z_left, y_right, z_right] in m, and the faults of the file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        return [], [Fault(str(path), "", "cannot be read as text", "a CSV file")]
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        return [], [Fault(str(path), "", "empty", "a header and rows of numbers")]
    delimiter = ";" if ";" in numbered[0][1] else ","
    header, faults = _header(path, next(csv.reader([numbered[0][1]], delimiter=delimiter)))
    if faults:
        return [], faults
    rows: Rows = []
    for number, line in numbered[1:]:
        cells = next(csv.reader([line], delimiter=delimiter))
        problem = _problem(cells, len(header))
        if problem:
            faults.append(Fault(str(path), f"line {number}", *problem))
            continue
        row = _row(header, [float(cell) for cell in cells])
        faults += _misplaced(path, number, row, rows)
        rows.append(row)
    if not faults and len(rows) < 4:
        faults.append(Fault(str(path), "", f"{len(rows)} rows", "four rows at least"))
    return rows, faults[:MOST_FAULTS]


def _header(path: Path, cells: list[str]) -> tuple[list[tuple[str, float]], list[Fault]]:
    """Return name and unit of every column."""
    columns: list[tuple[str, float]] = []
    faults = []
    for cell in cells:
        found = [(name, unit) for name, unit in _names(cell.strip()) if name in ("s", *SHARES)]
        if not found:
            allowed = nearest(cell.strip(), ["s", *SHARES])
            faults.append(Fault(str(path), "header", f"unknown column '{cell.strip()}'", allowed))
        columns += found[:1]
    names = [name for name, _ in columns]
    if "s" not in names:
        faults.append(Fault(str(path), "header", "no column s", "the arc length s in m"))
    if len(set(names)) < len(names):
        faults.append(Fault(str(path), "header", "a column occurs twice", "each column once"))
    return columns, faults


def _names(cell: str) -> Iterator[tuple[str, float]]:
    for ending, unit in UNITS.items():
        if cell.endswith(ending):
            yield cell.removesuffix(ending), unit


def _problem(cells: list[str], columns: int) -> tuple[str, str] | None:
    if len(cells) != columns:
        return f"{len(cells)} values", f"{columns} values as in the header"
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return "not a number", "numbers only"
    if not all(math.isfinite(value) for value in values):
        return "not a finite number", "finite numbers only; leave gaps out"
    return None


def _misplaced(path: Path, number: int, row: tuple[float, ...], before: Rows) -> list[Fault]:
    place = f"line {number}"
    faults = []
    if before and row[0] <= before[-1][0]:
        found = f"s = {row[0]:g} m does not increase"
        faults.append(Fault(str(path), place, found, "arc lengths that increase from row to row"))
    largest = max(abs(value) for value in row[1:])
    if largest > LARGEST:
        allowed = f"{LARGEST:g} m at most; is the column in mm? then its name ends in _mm"
        faults.append(Fault(str(path), place, f"a displacement of {largest:g} m", allowed))
    return faults


def _row(header: list[tuple[str, float]], values: list[float]) -> tuple[float, ...]:
    place = 0.0
    rails = [0.0] * len(COLUMNS)
    for (name, unit), value in zip(header, values, strict=True):
        if name == "s":
            place = unit * value
            continue
        for index, share in enumerate(SHARES[name]):
            rails[index] += share * unit * value
    return (place, *rails)
