"""Lists of profile sections along a rail or around a wheel: `.slcs`, `.slcw`, CSV.

The first two are those of the program CONTACT (user guide, "variable profiles"): offset and scale
of the positions, number of sections, numbers of features, kinks and accelerations, kind of
interpolation, then position and file of each section; where the features lie, which follows, is not
read.  The project's own list is a CSV with the columns `s` (m) or `angle` (rad), and
`file`, or `y` and `z` (m) with a row for every point.  A section's file has two columns y, z;
values beyond 1 are taken for millimetres.
"""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.embedding import embed, tables_of
from railsim.errors import Fault, input_error
from railsim.files.access import TABLE_BYTES, is_file, read_text
from railsim.text import LONGEST_FILE, shortened

MOST_SECTIONS = 2000
FEWEST_POINTS = 8
WIDEST = 0.4  # m, of a section
NARROWEST = 0.01  # m


@dataclass(frozen=True, eq=False)
class SectionList:
    """Sections in the order of their positions."""

    positions: Floats  # shape (n,): arc length [m] or angle [rad]
    points: tuple[Floats, ...]  # shape (2, k): y, z along the contour of each section [m]


def read_sections(path: str | Path, kind: str) -> SectionList:
    """Read a list of sections and its files.

    `path`: `.slcs`, `.slcw` or `.csv`; names of sections count from its folder; `kind`: what the
    sections are of. Raises InputError: a file is missing or no such list; positions do not
    increase; a section is no contour.
    """
    path = Path(path)
    suffix, ending = path.suffix.lower(), ".slcs" if kind == "rail" else ".slcw"
    if suffix not in (ending, ".csv"):
        raise input_error(path, f"unknown kind of file '{path.suffix}'", f"{ending} or .csv")
    text = read_text(path, TABLE_BYTES)
    if suffix == ".csv":
        positions, points = _own_list(path, text, kind)
    else:
        positions, names = _slc(path, text, 1.0 if kind == "wheel" else 1e-3)
        sections = {name: _section(path, name) for name in dict.fromkeys(names)}
        points = [sections[name] for name in names]
    if len(positions) < 2 or len(positions) > MOST_SECTIONS:
        raise input_error(path, f"{len(positions)} sections", f"2 to {MOST_SECTIONS}")
    for before, after in pairwise(positions):
        if after <= before:
            raise input_error(path, f"position {after:g} after {before:g}", "rising positions")
    return SectionList(np.array(positions), tuple(points))


def _slc(path: Path, text: str, unit: float) -> tuple[list[float], list[str]]:
    """Positions [m or rad] and files of a list of the program CONTACT."""
    lines = [
        (number, stripped)
        for number, line in enumerate(text.splitlines(), start=1)
        if (stripped := line.split("%")[0].strip())
    ]
    rows = iter(lines)

    def numbers(expected: str, least: int, row: tuple[int, str] | None = None) -> list[float]:
        number, line = row or next(rows, (0, ""))
        values: list[float] = []
        for word in re.split(r"[\s,]+", line):
            try:
                values.append(float(word))
            except ValueError:
                break
        if len(values) < least or not np.isfinite(values).all():
            shown = shortened(line) if line else "the end of the file"
            raise input_error(path, f"'{shown}'", expected, f"line {number}" if number else "")
        return values

    offset, scale = numbers("offset and scale of the positions", 2)[:2]
    if scale == 0.0:
        raise input_error(path, "scale 0", "the scale of the positions, not zero")
    n = int(numbers("the number of sections", 1)[0])
    numbers("the numbers of features, kinks and accelerations", 3)
    numbers("the kind of interpolation", 1)
    positions, names = [], []
    for _ in range(n):
        row = next(rows, (0, ""))
        quoted = re.search(r"'([^']*)'", row[1])
        if quoted is None:
            shown = shortened(row[1]) or "the end of the file"
            allowed = f"position and 'file', {n} times"
            raise input_error(path, f"'{shown}'", allowed, f"line {row[0]}")
        positions.append(unit * scale * (offset + numbers("a position", 1, row)[0]))
        names.append(quoted.group(1))
    return positions, names


def _own_list(path: Path, text: str, kind: str) -> tuple[list[float], list[Floats]]:
    """Positions and points of the project's own list."""
    key = "s" if kind == "rail" else "angle"
    rows = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    columns, *table = [*csv.reader(rows, skipinitialspace=True)] or [[]]
    listed = {key, "file"} <= {*columns}
    if not listed and not {key, "y", "z"} <= {*columns}:
        allowed = f"{key}, file, or {key}, y, z"
        raise input_error(path, f"columns {', '.join(columns)}", allowed)
    place, *rest = map(columns.index, (key, "file") if listed else (key, "y", "z"))
    sections: dict[float, list[list[float]]] = {}
    files: list[tuple[float, str]] = []
    for row in table:
        try:
            position, *point = (float(row[k]) for k in ([place] if listed else [place, *rest]))
            files.append((position, row[rest[0]].strip()))
        except (IndexError, ValueError):
            position, point = np.nan, []
        if not np.isfinite([position, *point]).all():
            shown = ", ".join(row)
            allowed = f"{key}, file" if listed else f"numbers {key}, y, z"
            raise input_error(path, f"row '{shortened(shown)}'", allowed)
        sections.setdefault(position, []).append(point)
    if listed:
        return [position for position, _ in files], [_section(path, name) for _, name in files]
    return list(sections), [_checked(path, np.array(points).T) for points in sections.values()]


def _section(path: Path, name: str) -> Floats:
    """Points y, z of a section [m]."""
    file = path.parent / name
    if not name or not is_file(file):
        shown = shortened(name, LONGEST_FILE)
        raise input_error(path, f"no file '{shown}'", f"a section beside {path.name}")
    rows = []
    for number, line in enumerate(read_text(file, TABLE_BYTES).splitlines(), start=1):
        words = re.split(r"[\s,;]+", line.split("%")[0].split("#")[0].strip())
        if words == [""]:
            continue
        try:
            rows.append([float(word) for word in words[:2]])
        except ValueError:
            raise input_error(file, f"'{shortened(line)}'", "y, z", f"line {number}") from None
        if len(rows[-1]) < 2 or not np.isfinite(rows[-1]).all():
            raise input_error(file, f"'{shortened(line)}'", "two numbers y, z", f"line {number}")
    points = np.array(rows).T
    if points.size and np.abs(points).max() > 1.0:
        points = 1e-3 * points
    return _checked(file, points)


def _checked(file: Path, points: Floats) -> Floats:
    """Points of a section that can be one [m]."""
    if points.shape[-1] < FEWEST_POINTS:
        raise input_error(file, f"{points.shape[-1]} points", f"{FEWEST_POINTS} at least")
    width = float(np.ptp(points[0]))
    if not NARROWEST <= width <= WIDEST:
        found = f"a section {1e3 * width:.3g} mm wide"
        allowed = f"{1e3 * NARROWEST:g} to {1e3 * WIDEST:g} mm; y, z in m or mm"
        raise input_error(file, found, allowed)
    return points


def embed_wheel_sections(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by what it holds for every wheel with sections in the tables of a vehicle."""
    return embed(_section_wheels(data), "", "a list of sections, .slcw", _embed)


def _section_wheels(group: Any) -> Iterator[tuple[str, Any]]:
    for path, wheelset in tables_of(group, "wheelsets"):
        for key, table in tables_of(wheelset, "out_of_round"):
            if table.get("type") == "sections":
                yield f"{path}.{key}", table
    for path, assembly in tables_of(group, "assemblies"):
        yield from ((f"{path}.{key}", table) for key, table in _section_wheels(assembly))


def _embed(_: str, table: dict[str, Any]) -> None:
    heights = wheel_heights(read_sections(table["file"], "wheel"))
    del table["file"]
    table |= dict(zip(("angles", "positions", "heights"), heights, strict=True))


SMOOTHING_ACROSS = 5e-9  # m3
SPACING = 1e-3  # m, of the positions that are kept
OUTER, INNER = 0.045, -0.025  # m, tread and flange root


def wheel_heights(sections: SectionList) -> tuple[list[float], list[float], list[list[float]]]:
    """Radius over angle and lateral position from the sections of a wheel, smoothed across.

    Smoothing splines (Reinsch 1967) minimise sum (z - f)^2 + lambda integral f''^2 dy with a
    lambda of 5 mm3.

    Returns: `angles [rad], positions [m], heights [m]`.
    """
    from scipy.interpolate import make_smoothing_spline

    low = max(INNER, max(float(points[0].min()) for points in sections.points))
    high = min(OUTER, min(float(points[0].max()) for points in sections.points))
    places = SPACING * np.arange(np.ceil(low / SPACING), np.floor(high / SPACING) + 1)
    rows = []
    for points in sections.points:
        y, z = points[:, np.argsort(points[0], kind="stable")]
        keep = (y > low - 0.01) & np.append(True, np.diff(y) > 1e-5)
        spline = make_smoothing_spline(1e3 * y[keep], 1e3 * z[keep], lam=1e9 * SMOOTHING_ACROSS)
        rows.append([round(1e-3 * value, 8) for value in spline(1e3 * places).tolist()])
    angles = [round(angle, 9) for angle in sections.positions.tolist()]
    return angles, [round(place, 6) for place in places.tolist()], rows
