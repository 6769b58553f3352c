"""Profile files as they are: numbers, unit and what the file says about itself.

Four formats are read: CSV, SIMPACK ``.prw``/``.prr``, MiniProf ``.whl``/``.ban`` with a header of
``Key=Value`` lines, and the older MiniProf text with a title block.  Nothing is judged here; that
is the job of `railsim.profiles.recognition`.  Every refusal names the file and the line.

Sources: the SIMPACK format from the comments that its own example files carry (order of the
processing steps, meaning of the unit factors); the MiniProf format from files published with the
CONTACT program (``examples`` and ``testbank/profiles`` of github.com/eve70a/CONTACT).
"""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.errors import InputError, input_error
from railsim.files.access import read_bytes
from railsim.profiles.profile import Kind

PROFILE_BYTES = 5_000_000
"""Larger files are refused unread; a profile of 10 000 points has some 0.5 MB."""

SUFFIXES = (".csv", ".txt", ".dat", ".prw", ".prr", ".whl", ".ban")
FORMATS = "CSV (header y_mm,z_mm or y,z), SIMPACK .prw/.prr, MiniProf .whl/.ban"
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$")


@dataclass
class Points:
    """Points of a file on their way to a profile."""

    file: str  # its name, for messages
    y: Floats  # as read, in the file's order, axes and unit, shape (n,)
    z: Floats
    line: Integers  # of each point in the file, from 1
    unit: float | None = None  # metres per unit of the file; None if the file does not say
    kind: Kind | None = None  # what the file says that it is
    name: str = ""  # title
    # what was done on the file's own request, then what was recognised
    notes: list[str] = field(default_factory=list)

    def fail(self, found: str, remedy: str, at: int | None = None) -> InputError:
        """Return what to raise about a point."""
        key = "" if at is None else f"line {int(self.line[at])}"
        return input_error(self.file, found, remedy, key=key)

    def keep(self, which: Any) -> None:
        """Keep some of the points, or bring them into another order."""
        self.y, self.z, self.line = self.y[which], self.z[which], self.line[which]


Row = tuple[float, float, int]  # y, z, line of the file


def _points(file: str, rows: list[Row], **facts: Any) -> Points:
    y, z, line = np.ascontiguousarray(np.array(rows, dtype=np.float64).reshape(-1, 3).T)
    return Points(file, y, z, line.astype(np.int64), **facts)


def _row(file: str, texts: list[str], line: int) -> Row:
    if len(texts) < 2:
        raise _fault(file, line, f"one number instead of two: {_excerpt(texts)}")
    y, z = map(_number, texts[:2])
    if y is None or z is None:
        raise _fault(file, line, f"not a pair of numbers: {_excerpt(texts)}")
    return y, z, line


def _excerpt(texts: list[str]) -> str:
    text = " ".join(texts)
    return repr(text if len(text) <= 40 else text[:37] + "...")


def _fault(file: str, line: int, found: str, remedy: str = "") -> InputError:
    return input_error(file, found, remedy or "give y and z on each line", key=f"line {line}")


def _number(text: str) -> float | None:
    """A finite number, or None."""
    if not NUMBER.match(text):
        return None
    value = float(text.lower().replace("d", "e"))
    return value if math.isfinite(value) else None


def read_profile_file(path: Path) -> Points:
    """Read a profile file.

    `path`: file; its suffix decides about the format. Raises InputError: if the file cannot be read
    or a line is not what its format wants.
    """
    file = str(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise input_error(file, f"unknown kind of file '{suffix}'", f"formats: {FORMATS}")
    content = read_bytes(path, PROFILE_BYTES)
    if b"\0" in content:
        raise input_error(file, "not a text file", f"formats: {FORMATS}")
    # titles may hold any character; numbers are ASCII in every one of these encodings
    lines = content.decode("utf-8-sig", errors="replace").splitlines()
    if suffix in (".prw", ".prr"):
        found = _simpack(file, lines)
        found.kind = found.kind or ("wheel" if suffix == ".prw" else "rail")
    elif suffix in (".whl", ".ban"):
        found = _miniprof(file, lines)
        found.kind = "wheel" if suffix == ".whl" else "rail"
    else:
        found = _csv(file, lines)
    found.name = found.name or path.stem
    return found


def _csv(file: str, lines: list[str]) -> Points:
    """Columns y, z with an optional header that gives the unit; further columns are left out."""
    rows: list[Row] = []
    unit: float | None = None
    columns = (0, 1)
    named = 0  # columns of the header
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        cells = _cells(text)
        if not rows and _number(cells[0]) is None:
            names = [cell.strip().strip('"').lower() for cell in cells]
            columns, unit = _header(file, number, names)
            named = len(names)
            continue
        whole = len(cells) == 4 and all(re.fullmatch(r"[+-]?\d+", cell) for cell in cells)
        if "," in text and ";" not in text and (whole or len(cells) == 2 * named > 0):
            words = f"under {named} names" if named else "without decimal points"
            found = f"{len(cells)} values {words}: {_excerpt(cells)}"
            remedy = "a decimal comma needs semicolons between the columns, or give decimal points"
            raise _fault(file, number, found, remedy)
        if len(cells) <= max(columns):
            raise _fault(file, number, f"{len(cells)} columns: {_excerpt(cells)}")
        rows.append(_row(file, [cells[column] for column in columns], number))
    return _points(file, rows, unit=unit)


def _cells(text: str) -> list[str]:
    """Split a line at its separator: semicolon, tab or blanks (then a comma is decimal), comma."""
    for separator in (";", "\t"):
        if separator in text:
            return [cell.strip().replace(",", ".") for cell in text.split(separator)]
    words = text.replace(",", ".").split()
    decimal = len(words) > 1 and " ," not in text and None not in map(_number, words)
    if decimal or "," not in text:
        return words
    return [cell.strip() for cell in text.split(",")]


def _header(file: str, line: int, names: list[str]) -> tuple[tuple[int, int], float | None]:
    """Columns of y and z and metres per unit, from a header line."""
    units = {"y": 1.0, "y_m": 1.0, "y_mm": 1e-3, "y [m]": 1.0, "y [mm]": 1e-3}
    pairs = [(name, f"z{name[1:]}") for name in units]
    found = [(names.index(y), names.index(z)) for y, z in pairs if y in names and z in names]
    if found:
        return min(found), units[names[min(found)[0]]]
    allowed = "the header is y_mm,z_mm for millimetres or y,z for metres"
    raise _fault(file, line, f"unknown columns {_excerpt(names)}", allowed)


def _simpack(file: str, lines: list[str]) -> Points:
    """SIMPACK: keys of a spline section, then points; processing in the file's numbered order."""
    rows: list[Row] = []
    values: dict[str, float] = {}
    title, inside, kind_flag = "", False, None
    for number, line in enumerate(lines, start=1):
        text = line.split("!")[0].strip()
        lower = text.lower()
        if not text:
            continue
        if lower in ("point.begin", "point.end"):
            inside = lower == "point.begin"
            continue
        if inside:
            rows.append(_row(file, text.split(), number))
            continue
        key, _, value = (part.strip() for part in text.partition("="))
        if key.lower() == "comment":
            title = value.strip("'\" ")
        parsed = _number(value)
        if parsed is not None:
            if key.lower() == "type" and kind_flag is None:
                kind_flag = parsed
            values[key.lower()] = parsed
        elif key.lower() in NUMERIC_KEYS:
            raise _fault(file, number, f"{key} is not a number: {value!r}", "give a number")
    if inside or not rows:
        allowed = "SIMPACK files hold them from point.begin to point.end"
        raise input_error(file, "no point.end: cut off" if inside else "no points", allowed)
    for key, allowed in (
        ("units.len.f", "units per metre, 1000 for millimetres"),
        ("units.ang.f", "units per radian, 57.2958 for degrees"),
    ):
        if values.get(key, 1.0) <= 0.0:
            raise input_error(file, f"{values[key]:g}", allowed, key=key)
    found = _points(file, rows, unit=1.0 / values.get("units.len.f", 1.0), name=title)
    if kind_flag is not None:
        found.kind = "wheel" if kind_flag == 1.0 else "rail"
    _process_simpack(found, values)
    return found


NUMERIC_KEYS = (
    "units.len.f",
    "units.ang.f",
    "shift.y",
    "shift.z",
    "rotate",
    "mirror.y",
    "mirror.z",
    "inversion",
)


def _process_simpack(points: Points, values: dict[str, float]) -> None:
    """Shift, rotate, cut and mirror as the file asks, in its order."""
    points.y = points.y + values.get("shift.y", 0.0)
    points.z = points.z + values.get("shift.z", 0.0)
    angle = values.get("rotate", 0.0) / values.get("units.ang.f", 1.0)
    if angle != 0.0:
        cosine, sine = math.cos(angle), math.sin(angle)
        y, z = points.y, points.z
        points.y, points.z = y * cosine - z * sine, y * sine + z * cosine
        points.notes.append(f"rotated by {1e3 * angle:.3f} mrad as the file asks")
    keep = np.ones(points.y.size, dtype=bool)
    for axis, coordinate in (("y", points.y), ("z", points.z)):
        lower, upper = values.get(f"bound.{axis}.min", 1.0), values.get(f"bound.{axis}.max", 0.0)
        if lower < upper:  # the default 1, 0 means no bounds
            keep &= (coordinate >= lower) & (coordinate <= upper)
    if not keep.all():
        points.notes.append(f"{np.sum(~keep)} points beyond the file's own bounds left out")
        points.keep(keep)
    if values.get("mirror.y", 0.0) == 1.0:
        points.y = -points.y
    if values.get("mirror.z", 0.0) == 1.0:
        points.z = -points.z
    if values.get("inversion", 0.0) == 1.0:
        points.keep(np.arange(points.y.size)[::-1])


def _miniprof(file: str, lines: list[str]) -> Points:
    """MiniProf: header of Key=Value lines or a title block, an empty line, columns X Y."""
    rows: list[Row] = []
    columns = [0, 1]
    facts: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith('"'):
            continue  # a quotation mark begins a remark
        words = _cells(text)
        numeric = len(words) > 1 and _number(words[0]) is not None and _number(words[1]) is not None
        if "=" in text or (not rows and not numeric):
            key, _, value = text.partition("=")
            facts[key.strip().lower()] = value.strip()
            if key.strip().lower() == "columndef" and value:
                names = [name.strip().upper() for name in value.split(",")]
                if "X" not in names or "Y" not in names:
                    allowed = "the columns X and Y are needed"
                    raise _fault(file, number, f"ColumnDef={value}", allowed)
                columns = [names.index("X"), names.index("Y")]
            elif "=" not in text and "columndef" in facts:
                raise _fault(file, number, f"not a pair of numbers: {_excerpt(words)}")
            continue
        if len(words) <= max(columns):
            raise _fault(file, number, f"{len(words)} columns: {_excerpt(words)}")
        rows.append(_row(file, [words[column] for column in columns], number))
    found = _points(file, rows, unit=1e-3)
    stated = facts.get("xypoints", "") if facts.get("columndef") else ""
    if stated.isdigit() and int(stated) != len(rows):
        told = f"the header announces {stated} points, the file holds {len(rows)}"
        if len(rows) < int(stated):
            raise input_error(file, told, "a whole file, or as many XYPoints as it holds")
        found.notes.append(told)
    return found
