"""Reading measured irregularities: CSV over distance into the rows of a track definition.

The rows become part of the track, so that a result carries its irregularities with its track.
"""

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from railsim.arrays import Floats
from railsim.definitions.embedding import embed, tables_of
from railsim.definitions.excitations.base import CHANNELS, COLUMNS, rails_moved
from railsim.definitions.excitations.measured import READING, Measured
from railsim.definitions.excitations.recording import BANDS, band_passed, from_chord
from railsim.errors import Fault, Faults, changed_faults, input_error, merge_similar, nearest
from railsim.files.access import TABLE_BYTES, read_bytes

UNITS = {"": 1.0, "_m": 1.0, "_mm": 1e-3, "_km": 1e3, "_in": 0.0254, "_ft": 0.3048}
# what a column adds to s, y_left, z_left, y_right, z_right
SHARES: dict[str, Floats] = dict(zip(("s", *COLUMNS), np.eye(5), strict=True)) | {
    name: np.append(0.0, rails_moved(channel))
    for name, channel in zip(("y", "z", "cross_level", "gauge"), CHANNELS, strict=True)
}
# columns of single rails and of the track, of which a file has the ones or the others: they add up
EITHER = ({"y_left", "y_right"}, {"y", "gauge"}), ({"z_left", "z_right"}, {"z", "cross_level"})
LARGEST = 0.5  # m
WIDEST = 0.1  # m, deviation of the gauge, as far as a track may be widened
# Change of a displacement over distance between two rows beyond which no wheel could follow: a step
# in the record, or a wrong unit.
STEEPEST = 0.2


def embed_measured(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by `rows` in the measured irregularities of plain tables; return faults."""
    return embed(tables_of(data, "irregularities"), "rows", "a CSV beside the track file", _embed)


def _embed(key: str, table: dict[str, Any]) -> None:
    path = Path(table["file"])
    if path.suffix.lower() != ".csv":
        found = f"'{path.name}' is no CSV"
        raise input_error("", found, "the name must end in .csv", key=f"{key}.file")
    part = _definition(table)
    if part is None:
        return  # refused by the definition
    with changed_faults(lambda f: f if f.file else replace(f, key=f"{key}.{f.key}")):
        rows, mileage = read_measured(path, part)
    for name in ("file", *READING):
        table.pop(name, None)
    table["rows"] = rows.tolist()
    if mileage is not None:
        table["mileage"] = mileage


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
    recordings = []
    for table in tables:
        part = _definition(table) if "file" in table else None
        if part is None:
            continue
        plain = part.model_copy(update={"chord": None, "band": None})
        path = Path(table["file"])
        before, after = (read_measured(path, definition)[0] for definition in (plain, part))
        before[:, 0] += part.shift
        after[:, 0] += part.shift
        after[:, 1:] *= part.scale
        recordings.append((path.name, before, after))
    return recordings


def read_measured(path: Path, part: Measured) -> tuple[Floats, float | None]:
    """Read rows [s, y_left, z_left, y_right, z_right] and a falling mileage of the first, in m.

    Raises InputError.
    """
    try:
        text = read_bytes(path, TABLE_BYTES).decode(part.encoding or "utf-8-sig")
        return _rows_of(path, text, part)
    except LookupError:
        allowed = "a name such as utf-8, latin-1 or utf-16"
        found, key = f"unknown encoding '{part.encoding}'", "encoding"
        raise input_error("", found, allowed, key) from None
    except UnicodeDecodeError as error:
        found = f"byte {error.start} is not {error.encoding}"
        raise input_error(path, found, 'its encoding, such as encoding = "latin-1"') from None
    except csv.Error as error:
        raise input_error(path, f"no CSV ({error})", "a header and rows of numbers") from None


class Column(NamedTuple):
    """A column of a file."""

    name: str  # ours
    unit: float = 1.0  # m
    offset: float = 0.0  # value of the undisplaced rails


def _rows_of(path: Path, text: str, part: Measured) -> tuple[Floats, float | None]:
    numbered = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise input_error(path, "empty", "a header and rows of numbers")
    delimiter = next((d for d in (";", "\t") if d in numbered[0][1]), ",")
    head = [cell.strip() for cell in next(csv.reader([numbered[0][1]], delimiter=delimiter))]
    columns = _named_columns(path, head, part.columns) if part.columns else _header(path, head)
    columns = [column and _calibrated(column, part) for column in columns]
    used = [column for column in columns if column]
    _check_names(path, [column.name for column in used], part)
    faults: list[tuple[int, str, str]] = []  # number of the line, found, allowed
    numbers, table = [], []
    for number, line in numbered[1:]:
        if delimiter != ",":
            line = line.replace(",", ".")  # a decimal comma
        cells = next(csv.reader([line], delimiter=delimiter))
        try:
            table.append(_numbers(cells, columns))
            numbers.append(number)
        except ValueError as problem:
            faults.append((number, *problem.args))
    values = np.array(table).reshape(len(table), len(used))
    rows, mileage = _rows(used, values, part)
    faults += [(numbers[k], what, allowed) for k, what, allowed in _row_faults(rows, used, values)]
    faults.sort(key=lambda fault: fault[0])
    Faults(merge_similar(Fault(str(path), f"line {n}", *words) for n, *words in faults)).check()
    if len(rows) < 4:
        raise input_error(path, f"{len(rows)} rows", "four rows at least")
    return _filtered(path, rows, part), mileage


def _check_names(path: Path, read: Sequence[str], part: Measured) -> None:
    """Raise InputError where a file gives single rails and what is worked out from them.

    Or where a unit, an offset or a sign is given of a column that is not read.
    """
    keys = {"units": part.units or (), "offset": part.offset or (), "reverse": part.reverse}
    faults = Faults(
        Fault("", key, f"'{name}' is no column that is read", nearest(name, read))
        for key, names in keys.items()
        for name in names
        if name not in read
    )
    for rails, track in EITHER:
        if rails & {*read} and track & {*read}:
            found = " and ".join(sorted({*read} & (rails | track)))
            allowed = (
                f"{' and '.join(sorted(rails))}, or {' and '.join(sorted(track))}: they add up"
            )
            faults.append(
                Fault(str(path), "header", found, f"{allowed}; name the ones in 'columns'")
            )
    faults.check()


def _numbers(cells: Sequence[str], columns: Sequence[Column | None]) -> list[float]:
    """Numbers of a row that are read; raises ValueError of what was found and what is allowed."""
    if len(cells) != len(columns):
        raise ValueError(f"{len(cells)} values", f"{len(columns)} values as in the header")
    try:
        values = [float(cell) for cell, column in zip(cells, columns, strict=True) if column]
    except ValueError as error:
        found = f"not a number ({error})".replace("could not convert string to float: ", "")
        raise ValueError(found, "numbers only") from None
    if not np.isfinite(values).all():
        raise ValueError("not a finite number", "finite numbers only; leave gaps out")
    return values


def _rows(columns: Sequence[Column], values: Floats, part: Measured) -> tuple[Floats, float | None]:
    rows = np.zeros((len(values), 5))
    for (name, unit, offset), written in zip(columns, values.T, strict=True):
        rows += np.outer(written - offset, np.multiply(SHARES[name], unit))
    if not part.falling_mileage or not len(rows):
        return rows, None
    mileage = float(rows[0, 0])
    rows[:, 0] = mileage - rows[:, 0]
    return rows, mileage


def _row_faults(
    rows: Floats, columns: Sequence[Column], values: Floats
) -> Iterator[tuple[int, str, str]]:
    """Rows that cannot be: index, what was found, and what is allowed."""
    s, rails = rows[:, 0], np.abs(rows[:, 1:])
    step, change = np.diff(s), np.abs(np.diff(rows[:, 1:], axis=0)).max(axis=1)
    for k in np.flatnonzero(step <= 0.0).tolist():
        allowed = "arc lengths that increase from row to row; or falling_mileage = true"
        yield k + 1, f"s = {s[k + 1]:g} m does not increase", allowed
    for k in np.flatnonzero((step > 0.0) & (change > STEEPEST * step)).tolist():
        allowed = f"{STEEPEST * 1e3:g} mm/m at most: no table can hold a step of the rail"
        yield k + 1, f"{change[k] * 1e3:.3g} mm within {step[k]:.3g} m", allowed
    absolute = np.zeros(len(rows), dtype=bool)  # the distance of the rails, or of another gauge
    for (name, unit, offset), written in zip(columns, values.T, strict=True):
        if name == "gauge":
            absolute = np.abs(unit * (written - offset)) > WIDEST
            allowed = f"{WIDEST} m off the nominal one at most: its unit, or"
            allowed += " offset = { gauge = 1435.0 } or the like, in this unit"
            for k in np.flatnonzero(absolute).tolist():
                yield k, f"a gauge of {abs(unit) * (written[k] - offset):.4g} m", allowed
    largest = rails.max(axis=1)
    for k in np.flatnonzero(~absolute & (largest > LARGEST)).tolist():
        allowed = f"{LARGEST:g} m at most; is the column in mm? then name it so (_mm, or units)"
        yield k, f"a displacement of {largest[k]:g} m", allowed


def _filtered(path: Path, rows: Floats, part: Measured) -> Floats:
    """Rows with the chord's response inverted and within the band, as the definition asks."""
    if not part.chord and not part.band:
        return rows
    steps = np.diff(rows[:, 0])
    step = float(np.mean(steps))
    if np.max(np.abs(steps - step)) > 0.01 * step:
        allowed = f"equal steps within 1 % (needed for '{'chord' if part.chord else 'band'}')"
        raise input_error(path, "rows at unequal steps", allowed, "s")
    values = rows[:, 1:].T
    if part.chord:
        values = from_chord(values, step, part.chord)
    if part.band:
        band = BANDS[part.band] if isinstance(part.band, str) else part.band
        values = band_passed(values, step, band)
    return np.column_stack([rows[:, 0], values.T])


def _calibrated(column: Column, part: Measured) -> Column:
    """Return a column with the unit, sign and offset that the definition gives it."""
    name, unit, _ = column
    if part.units and name in part.units:
        unit = UNITS[f"_{part.units[name]}"]
    return Column(name, -unit if name in part.reverse else unit, (part.offset or {}).get(name, 0.0))


def _named_columns(path: Path, head: list[str], names: dict[str, str]) -> list[Column | None]:
    """Columns that the definition names; None for the others."""
    columns: list[Column | None] = [None] * len(head)
    faults = Faults()
    for name, label in names.items():
        if name not in SHARES:
            faults.append(Fault("", f"columns.{name}", "unknown quantity", nearest(name, SHARES)))
        elif label not in head:
            found = f"no column '{label}'"
            faults.append(Fault(str(path), "header", found, nearest(label, head)))
        elif columns[index := head.index(label)] is not None:
            found = f"'{label}' is named twice"
            faults.append(Fault("", f"columns.{name}", found, "once; y and z are of both rails"))
        else:
            columns[index] = Column(name)
    if "s" not in names:
        faults.append(Fault("", "columns", "no column for s", "the arc length or mileage s"))
    faults.check()
    return columns


def _header(path: Path, cells: list[str]) -> list[Column | None]:
    """Columns by a header with our names, with the unit behind."""
    columns: list[Column | None] = []
    faults = Faults()
    for cell in cells:
        read = [(cell.removesuffix(end), unit) for end, unit in UNITS.items() if cell.endswith(end)]
        matches = [Column(name, unit) for name, unit in read if name in SHARES]
        if not matches:
            allowed = nearest(cell, SHARES) + "; or name it in 'columns'"
            faults.append(Fault(str(path), "header", f"unknown column '{cell}'", allowed))
        columns += matches[:1]
    names = [column.name for column in columns if column]
    if "s" not in names:
        faults.append(Fault(str(path), "header", "no column s", "the arc length s in m"))
    if len(set(names)) < len(names):
        faults.append(Fault(str(path), "header", "a column occurs twice", "each column once"))
    faults.check()
    return columns
