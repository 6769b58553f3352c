"""Reading measured irregularities: CSV over distance into the rows of a track definition.

The rows become part of the track, so that a result carries its irregularities with its track.
"""

import csv
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from railsim.arrays import Floats
from railsim.definitions.embedding import embed, tables_of
from railsim.definitions.excitations.base import COLUMNS
from railsim.definitions.excitations.measured import READING, Measured
from railsim.definitions.excitations.recording import BANDS, band_passed, equal_step, from_chord
from railsim.errors import Fault, Faults, InputError, counted, input_error, nearest
from railsim.files.access import TABLE_BYTES, read_bytes

UNITS = {"": 1.0, "_m": 1.0, "_mm": 1e-3, "_km": 1e3}
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
LARGEST = 0.5  # m
# Change of a displacement over distance between two rows beyond which no wheel could follow: a step
# in the record, or a wrong unit.
STEEPEST = 0.2

Rows = list[tuple[float, ...]]


def embed_measured(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by the `rows` that it holds in every measured irregularity of a track.

    `data`: a track as plain tables; changed in place. Returns: what is wrong in the files.
    """
    return embed(tables_of(data, "irregularities"), "rows", "a CSV beside the track file", _embed)


def _embed(key: str, table: dict[str, Any]) -> None:
    path = Path(table["file"])
    if path.suffix.lower() != ".csv":
        found = f"'{path.name}' is no CSV"
        raise input_error("", found, "the name must end in .csv", key=f"{key}.file")
    how = _definition(table)
    if how is None:
        return  # refused by the definition
    rows, wrong = read_measured(path, how)
    Faults(wrong).check()
    for name in ("file", *READING):
        table.pop(name, None)
    table["rows"] = [list(row) for row in rows]


def _definition(table: dict[str, Any]) -> Measured | None:
    """Return what a plain table says, with a file that need not be there; None if it is wrong."""
    try:
        return Measured.model_validate({**table, "file": "-"})
    except ValidationError:
        return None


def recordings(tables: Iterable[Any]) -> list[tuple[str, Floats, Floats]]:
    """Recordings of valid irregularities: name of the file, rows as read, and rows as they act.

    `tables`: irregularities of a track as plain tables, with files. Returns: s, y_left, z_left,
    y_right, z_right [m]; `chord`, `band` and `scale` are in the second only.
    """
    found = []
    for table in tables:
        how = _definition(table) if "file" in table else None
        if how is None:
            continue
        plain = how.model_copy(update={"chord": None, "band": None})
        path = Path(table["file"])
        before, after = (np.array(read_measured(path, one)[0]) for one in (plain, how))
        before[:, 0] += how.shift
        after[:, 0] += how.shift
        after[:, 1:] *= how.scale
        found.append((path.name, before, after))
    return found


def read_measured(path: Path, how: Measured) -> tuple[Rows, list[Fault]]:
    """Read rows [s, y_left, z_left, y_right, z_right] in m, and the faults of the file."""
    try:
        return _rows_of(
            path, read_bytes(path, TABLE_BYTES).decode(how.encoding or "utf-8-sig"), how
        )
    except LookupError:
        allowed = "a name such as utf-8, latin-1 or utf-16"
        return [], [Fault("", "encoding", f"unknown encoding '{how.encoding}'", allowed)]
    except UnicodeDecodeError as error:
        found = f"byte {error.start} is not {error.encoding}"
        return [], [Fault(str(path), "", found, 'its encoding, such as encoding = "latin-1"')]
    except InputError as error:
        return [], list(error.faults)
    except csv.Error as error:
        return [], [Fault(str(path), "", f"no CSV ({error})", "a header and rows of numbers")]


def _rows_of(path: Path, text: str, how: Measured) -> tuple[Rows, list[Fault]]:
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        return [], [Fault(str(path), "", "empty", "a header and rows of numbers")]
    delimiter = next((d for d in (";", "\t") if d in numbered[0][1]), ",")
    head = [cell.strip() for cell in next(csv.reader([numbered[0][1]], delimiter=delimiter))]
    header, faults = _mapped(path, head, how) if how.columns else _header(path, head)
    if faults:
        return [], faults
    header = [column and _with_unit(column, how) for column in header]
    rows: Rows = []
    begin = 0.0
    for number, line in numbered[1:]:
        if delimiter != ",":
            line = line.replace(",", ".")  # a decimal comma
        cells = next(csv.reader([line], delimiter=delimiter))
        problem = _problem(cells, header)
        if problem:
            faults.append(Fault(str(path), f"line {number}", *problem))
            continue
        row = _row(header, cells)
        if how.falling_mileage:
            begin = row[0] if not rows else begin
            row = (begin - row[0], *row[1:])
        faults += _row_faults(path, number, row, rows, _absolute_gauge(header, cells))
        rows.append(row)
    if not faults and len(rows) < 4:
        faults.append(Fault(str(path), "", f"{len(rows)} rows", "four rows at least"))
    if not faults and (how.chord or how.band):
        rows, faults = _filtered(path, rows, how)
    return rows, counted(faults)


def _filtered(path: Path, rows: Rows, how: Measured) -> tuple[Rows, list[Fault]]:
    table = np.array(rows)
    step = equal_step(table[:, 0])
    if step is None:
        key = "chord" if how.chord else "band"
        found = "rows at unequal steps"
        return rows, [Fault(str(path), "s", found, f"equal steps within 1 % (needed for '{key}')")]
    values = table[:, 1:].T
    if how.chord:
        values = from_chord(values, step, how.chord)
    if how.band:
        band = BANDS[how.band] if isinstance(how.band, str) else how.band
        values = band_passed(values, step, band)
    return [(s, *row) for s, row in zip(table[:, 0].tolist(), values.T.tolist(), strict=True)], []


Column = tuple[str, float, float]  # our name, unit [m], value of the undisplaced rails


def _with_unit(column: Column, how: Measured) -> Column:
    name, unit, _ = column
    if how.units and name in how.units:
        unit = UNITS[f"_{how.units[name]}"]
    offset = (how.offset or {}).get(name, 0.0)
    return name, -unit if name in how.reverse else unit, offset


def _mapped(path: Path, head: list[str], how: Measured) -> tuple[list[Column | None], list[Fault]]:
    """Name and unit of every column that is named; None for the others."""
    assert how.columns is not None  # by the caller
    columns: list[Column | None] = [None] * len(head)
    faults = []
    for name, theirs in how.columns.items():
        if name not in ("s", *SHARES):
            allowed = nearest(name, ["s", *SHARES])
            faults.append(Fault("", f"columns.{name}", "unknown quantity", allowed))
        elif theirs not in head:
            found = f"no column '{theirs}'"
            faults.append(Fault(str(path), "header", found, nearest(theirs, head)))
        else:
            columns[head.index(theirs)] = (name, 1.0, 0.0)
    if "s" not in how.columns:
        faults.append(Fault("", "columns", "no column for s", "the arc length or mileage s"))
    return columns, faults


def _header(path: Path, cells: list[str]) -> tuple[list[Column | None], list[Fault]]:
    """Return name and unit of every column."""
    columns: list[Column | None] = []
    faults = []
    for cell in cells:
        found = [(name, unit, 0.0) for name, unit in _names(cell) if name in ("s", *SHARES)]
        if not found:
            allowed = nearest(cell, ["s", *SHARES]) + "; or name it in 'columns'"
            faults.append(Fault(str(path), "header", f"unknown column '{cell}'", allowed))
        columns += found[:1]
    names = [column[0] for column in columns if column]
    if "s" not in names:
        faults.append(Fault(str(path), "header", "no column s", "the arc length s in m"))
    if len(set(names)) < len(names):
        faults.append(Fault(str(path), "header", "a column occurs twice", "each column once"))
    return columns, faults


def _names(cell: str) -> Iterator[tuple[str, float]]:
    for ending, unit in UNITS.items():
        if cell.endswith(ending):
            yield cell.removesuffix(ending), unit


def _problem(cells: list[str], header: list[Column | None]) -> tuple[str, str] | None:
    if len(cells) != len(header):
        return f"{len(cells)} values", f"{len(header)} values as in the header"
    try:
        values = [float(cell) for cell, column in zip(cells, header, strict=True) if column]
    except ValueError:
        return "not a number", "numbers only"
    if not all(math.isfinite(value) for value in values):
        return "not a finite number", "finite numbers only; leave gaps out"
    return None


def _absolute_gauge(header: list[Column | None], cells: list[str]) -> bool:
    """Whether a column of gauge holds the distance of the rails instead of its deviation."""
    return any(
        column is not None
        and column[0] == "gauge"
        and 0.6 < abs(column[1]) * (float(cell) - column[2]) < 2.0
        for column, cell in zip(header, cells, strict=True)
    )


def _row_faults(
    path: Path, number: int, row: tuple[float, ...], before: Rows, absolute_gauge: bool
) -> list[Fault]:
    line = f"line {number}"
    faults = []
    if before and row[0] <= before[-1][0]:
        found = f"s = {row[0]:g} m does not increase"
        allowed = "arc lengths that increase from row to row; or falling_mileage = true"
        faults.append(Fault(str(path), line, found, allowed))
    elif before:
        steepest = max(abs(new - old) for new, old in zip(row[1:], before[-1][1:], strict=True))
        if steepest > STEEPEST * (row[0] - before[-1][0]):
            found = f"{steepest * 1e3:.3g} mm within {row[0] - before[-1][0]:.3g} m"
            allowed = f"{STEEPEST * 1e3:g} mm/m at most: no table can hold a step of the rail"
            faults.append(Fault(str(path), line, found, allowed))
    largest = max(abs(value) for value in row[1:])
    if absolute_gauge:
        allowed = "its deviation; give the nominal one by offset = { gauge = 1435.0 }"
        faults.append(Fault(str(path), line, "an absolute gauge", allowed))
    elif largest > LARGEST:
        allowed = f"{LARGEST:g} m at most; is the column in mm? then its name ends in _mm"
        faults.append(Fault(str(path), line, f"a displacement of {largest:g} m", allowed))
    return faults


def _row(header: list[Column | None], cells: list[str]) -> tuple[float, ...]:
    s = 0.0
    rails = [0.0] * len(COLUMNS)
    for column, cell in zip(header, cells, strict=True):
        if column is None:
            continue
        name, unit, offset = column
        value = float(cell) - offset
        if name == "s":
            s = unit * value
            continue
        for index, share in enumerate(SHARES[name]):
            rails[index] += share * unit * value
    return (s, *rails)
