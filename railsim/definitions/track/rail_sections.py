"""Rails whose section changes along the track: crossings, and rails that are worn in places."""

from itertools import accumulate, pairwise
from typing import Annotated, Any, Self

from pydantic import Field

from railsim.definitions.base import OTHER_SIDE, Definition, Finite, Side, Text, check
from railsim.definitions.embedding import embed, tables_of
from railsim.definitions.section_files import MOST_SECTIONS, read_sections
from railsim.errors import Fault

Coordinates = Annotated[tuple[Finite, ...], Field(min_length=8, max_length=2000)]
MOST_RANGES = 50
# m, by which a section may go back, and by which its top may lie over or under the rail tops
MOST_BACK, MOST_HEIGHT = 5e-3, 10e-3
# m, and slope, by which a section may be shifted against the one before: wings go aside at 1:9
MOST_JUMP, STEEPEST = 5e-3, 0.25
FAR_APART = 5.0  # times the mean distance of sections


class Contour(Definition):
    """A section of a rail."""

    s: Finite
    """Where it is, in the list's own arc length [m]"""
    y: Coordinates
    """Lateral positions of its points, from the gauge side on, positive to the field side [m]"""
    z: Coordinates
    """How far they are below the rail tops [m]"""

    @check
    def _matching(self) -> None:
        if len(self.y) != len(self.z):
            raise ValueError(f"{len(self.y)} values of y and {len(self.z)} of z")
        back = 1e3 * max(high - y for high, y in zip(accumulate(self.y, max), self.y, strict=True))
        if back > 1e3 * MOST_BACK:
            raise ValueError(
                f"the section at {self.s:g} m goes back by {back:.3g} mm; from the gauge side "
                "to the field side, y positive to the field side, without crossing itself"
            )
        top = 1e3 * min(self.z)
        if abs(top) > 1e3 * MOST_HEIGHT:
            raise ValueError(
                f"the section at {self.s:g} m has its top at z = {top:.3g} mm; within "
                f"{1e3 * MOST_HEIGHT:g} mm of the rail tops, z positive down"
            )

    def jump(self, after: Self) -> float:
        """Shift of the whole section to the next one, sideways or in height [m]."""
        sides = [after.y[k] - self.y[k] for k in (0, -1)]
        aside = min(map(abs, sides)) if sides[0] * sides[1] > 0.0 else 0.0
        return max(aside, abs(min(after.z) - min(self.z)))


class RailSections(Definition):
    """Sections of one rail over a range of the track."""

    rail: Side
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
    trailing: Annotated[bool, Field(strict=True)] = False
    """Whether the list of a `file` is passed from its end to its beginning: its arc lengths change
    their sign before `shift` is added"""
    gauge_face: Annotated[Finite, Field(ge=-0.1, le=0.1)] | None = None
    """Lateral position of the gauge face of the plain rail in the coordinates of the list, 14 mm
    below the top [m]; by default that of the first section that is kept, if that
    of the last one is within 20 mm of it"""
    begin: Finite
    """Where the range begins [m]; before it, and behind its end, the rail is that of `rail`"""
    end: Finite
    """Where it ends [m]; at both ends the contact is that of the plain rail"""

    @check
    def _range(self) -> None:
        if (self.file is None) == (self.contours is None):
            raise ValueError("either 'file' or 'contours' is needed")
        if self.trailing and self.file is None:
            raise ValueError("'trailing' turns the list of a 'file' round, 'contours' are in order")
        if self.end < self.begin + 0.1:
            raise ValueError("'end' must lie 0.1 m behind 'begin' at least")
        for before, after in pairwise(self.contours or ()):
            if after.s <= before.s:
                raise ValueError(f"sections out of order: {after.s:.12g} after {before.s:.12g} m")
            jump = before.jump(after)
            if jump > max(MOST_JUMP, STEEPEST * (after.s - before.s)):
                raise ValueError(
                    f"a jump of {1e3 * jump:.3g} mm from {before.s:g} to {after.s:g} m, which no "
                    f"blend can follow; {1e3 * MOST_JUMP:g} mm at most, or 1:{1.0 / STEEPEST:g}"
                )
        if self.contours is not None:
            first, last = (self.contours[k].s + self.shift for k in (0, -1))
            if first > self.begin or last < self.end:
                found = f"sections from {first:g} to {last:g} m"
                raise ValueError(f"{found} do not reach over the range")
            a, b = self._gap()
            if b - a > 0.5 * (self.end - self.begin):
                raise ValueError(
                    f"no section from {a:g} to {b:g} m, more than half the range; are the "
                    "positions in m?"
                )

    def _gap(self) -> tuple[float, float]:
        """Ends of the longest part of the range without a section, along the track [m]."""
        inside = [contour.s + self.shift for contour in self.contours or ()]
        ends = sorted({self.begin, self.end, *(s for s in inside if self.begin < s < self.end)})
        return max(pairwise(ends), key=lambda pair: pair[1] - pair[0])

    def unusual(self) -> str:
        """Say where sections are far apart for their number; nothing where they are not."""
        a, b = self._gap()
        places = [contour.s + self.shift for contour in self.contours or ()]
        inside = sum(self.begin <= s <= self.end for s in places)
        if b - a < FAR_APART * (self.end - self.begin) / (inside + 1):
            return ""
        return f"no section from {a:g} to {b:g} m: the rail between is blended over {b - a:.3g} m"

    def mirrored(self) -> Self:
        """Return the same as the other rail."""
        return self.model_copy(update={"rail": OTHER_SIDE[self.rail]})


def embed_rail_sections(data: dict[str, Any]) -> list[Fault]:
    """Replace `file` by the `contours` that it holds in the sections of a track's tables."""
    allowed = "a list of sections, .slcs or .csv"
    return embed(tables_of(data, "sections"), "contours", allowed, _embed)


def _embed(_: str, table: dict[str, Any]) -> None:
    sections = read_sections(table["file"], "rail")
    del table["file"]
    if turn := table.get("trailing") is True:
        del table["trailing"]
    positions = (-sections.positions[::-1] if turn else sections.positions).tolist()
    pairs = list(zip(positions, sections.points[:: -1 if turn else 1], strict=True))
    begin, end, shift = (table.get(key, 0.0) for key in ("begin", "end", "shift"))
    if all(isinstance(value, int | float) for value in (begin, end, shift)):
        inside = [k for k, place in enumerate(positions) if begin <= place + shift <= end]
        # those in the range, and two beside it at either end
        pairs = pairs[max(0, inside[0] - 2) : inside[-1] + 3] if inside else pairs
    table["contours"] = [
        {"s": round(s, 6), "y": _rounded(y), "z": _rounded(z)} for s, (y, z) in pairs
    ]


def _rounded(values: Any) -> list[float]:
    return [round(value, 7) for value in values.tolist()]
