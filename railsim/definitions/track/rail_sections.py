"""Rails whose section changes along the track: crossings, and rails that are worn in places."""

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from railsim.definitions.base import Definition, Finite, Text
from railsim.definitions.section_files import MOST_SECTIONS, read_sections
from railsim.definitions.track.check_rail import OTHER
from railsim.errors import Fault, InputError
from railsim.files.access import is_file
from railsim.text import LONGEST_FILE, shortened

Coordinates = Annotated[tuple[Finite, ...], Field(min_length=8, max_length=2000)]
MOST_RANGES = 50


class Contour(Definition):
    """A section of a rail."""

    s: Finite
    """Where it is, in the list's own arc length [m]"""
    y: Coordinates
    """Lateral positions of its points, from the gauge side on, positive to the field side [m]"""
    z: Coordinates
    """How far they are below the rail tops [m]"""

    @model_validator(mode="after")
    def _matching(self) -> Self:
        if len(self.y) != len(self.z):
            raise ValueError(f"{len(self.y)} values of y and {len(self.z)} of z")
        return self


class RailSections(Definition):
    """Sections of one rail over a range of the track."""

    rail: Literal["left", "right"]
    """Which rail; sections are those of a right rail and mirrored for the left one"""
    file: Text | None = None
    """List of sections, `.slcs` or CSV with the columns `s` and `file`, or `s`, `y`, `z`; read when
    the track is loaded"""
    contours: (
        Annotated[tuple[Contour, ...], Field(min_length=2, max_length=MOST_SECTIONS)] | None
    ) = None
    """What was read, by rising arc length"""
    shift: Finite = 0.0
    """Added to the arc lengths of the list [m]"""
    gauge_face: Annotated[Finite, Field(ge=-0.1, le=0.1)] | None = None
    """Lateral position of the gauge face of the plain rail in the coordinates of the list, 14 mm
    below the top [m]; by default that of the first section that is kept"""
    begin: Finite
    """Where the range begins [m]; before it, and behind its end, the rail is that of `rail`"""
    end: Finite
    """Where it ends [m]; at both ends the contact is that of the plain rail"""

    @model_validator(mode="after")
    def _range(self) -> Self:
        if (self.file is None) == (self.contours is None):
            raise ValueError("either 'file' or 'contours' is needed")
        if self.end < self.begin + 0.1:
            raise ValueError("'end' must lie 0.1 m behind 'begin' at least")
        for before, after in pairwise(self.contours or ()):
            if after.s <= before.s:
                raise ValueError(f"sections out of order: {after.s:g} after {before.s:g} m")
        if self.contours is not None:
            first, last = (self.contours[k].s + self.shift for k in (0, -1))
            if first > self.begin or last < self.end:
                found = f"sections from {first:g} to {last:g} m"
                raise ValueError(f"{found} do not reach over the range")
        return self

    def mirrored(self) -> Self:
        """Return the same as the other rail."""
        return self.model_copy(update={"rail": OTHER[self.rail]})


def embed_rail_sections(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by the `contours` that it holds in the sections of a track's tables."""
    faults: list[Fault] = []
    listed = data.get("sections")
    for index, table in enumerate(listed if isinstance(listed, list) else []):
        if not isinstance(table, dict) or not isinstance(table.get("file"), str):
            continue
        if "contours" in table:
            continue  # refused by the definition
        if not is_file(table["file"]):
            shown = shortened(table["file"], LONGEST_FILE)
            key = f"sections.{index}.file"
            faults.append(Fault("", key, f"no file '{shown}'", "a list of sections, .slcs or .csv"))
            continue
        try:
            found = read_sections(table["file"], "rail")
        except InputError as error:
            faults += error.faults
            continue
        del table["file"]
        table["contours"] = [
            {"s": round(s, 6), "y": _written(points[0]), "z": _written(points[1])}
            for s, points in zip(found.positions.tolist(), found.points, strict=True)
            if _needed(s, found.positions.tolist(), table)
        ]
    return faults


def _written(values: Any) -> list[float]:
    return [round(value, 7) for value in values.tolist()]


def _needed(s: float, positions: list[float], table: dict[str, Any]) -> bool:
    """Whether a section is in the range, or one of two beside it."""
    begin, end, shift = (table.get(key, 0.0) for key in ("begin", "end", "shift"))
    if not all(isinstance(value, int | float) for value in (begin, end, shift)):
        return True
    inside = [k for k, at in enumerate(positions) if begin <= at + shift <= end]
    if not inside:
        return True
    k = positions.index(s)
    return inside[0] - 2 <= k <= inside[-1] + 2
