"""Wheels that are not round: waves, tables of the radius, flats, measured sections.

The wheel's angle phi is the distance it has rolled from s = 0 over its radius; material at phi is
at the bottom then.  `body_position` counts the pitch the other way round (nose up): a section of a
file at the angle phi touches the rail at the pitch -phi.
"""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field

from railsim.definitions.base import Definition, Finite, Positive, Text, check, rises

Change = Annotated[Finite, Field(ge=-0.05, le=0.05)]
Angle = Annotated[Finite, Field(ge=-7.0, le=7.0)]
MOST_WAVES, MOST_ROWS = 200, 20_000


class Uneven(Definition):
    """What every deviation from the circle says."""

    type: str
    wheel: Literal["left", "right", "both"] = "both"
    """Which wheel; on both at the same angle"""
    angle: Angle = 0.0
    """Angle of the wheel from which its own angles count [rad]"""

    def backwards(self, **values: object) -> Self:
        """Return it on a wheel that rolls the other way: every angle has the other sign."""
        return self.model_copy(update={"angle": -self.angle, **values})


class Harmonics(Uneven):
    """Waves around the wheel: r(phi) = r0 + sum of amplitude cos(order phi + phase)."""

    type: Literal["harmonics"]
    waves: Annotated[
        tuple[tuple[Annotated[Finite, Field(ge=1, le=500)], Change, Finite], ...],
        Field(min_length=1, max_length=MOST_WAVES),
    ]
    """Rows of order n, amplitude a [m] and phase p [rad]: the radius has a cos(n angle + p) more"""

    def backwards(self, **values: object) -> Self:
        """Return the waves with their phases on a wheel that rolls the other way."""
        waves = tuple((order, amplitude, -phase) for order, amplitude, phase in self.waves)
        return super().backwards(waves=waves, **values)

    @check
    def _whole_orders(self) -> None:
        for order, _, _ in self.waves:
            if order != round(order):
                raise ValueError(f"the order {order:.12g} is no whole number")


class RadiusTable(Uneven):
    """Radius over the angle, a periodic cubic spline through the rows."""

    type: Literal["table"]
    rows: Annotated[
        tuple[tuple[Angle, Change], ...], Field(min_length=3, max_length=MOST_ROWS), rises("angle")
    ]
    """Rows [angle, change of the radius], over less than one turn [rad, m]"""

    def backwards(self, **values: object) -> Self:
        """Return the table in the order in which a wheel that rolls the other way comes to it."""
        rows = tuple((-angle, change) for angle, change in self.rows[::-1])
        return super().backwards(rows=rows, **values)

    @check
    def _one_turn(self) -> None:
        if self.rows[-1][0] - self.rows[0][0] >= 6.283:
            raise ValueError("the angles span a turn or more; the first row closes it")


class Flat(Uneven):
    """A flat on the tread."""

    type: Literal["flat"]
    length: Annotated[Positive, Field(le=0.3)]
    """Length along the tread [m]"""
    shape: Literal["fresh", "worn"] = "fresh"
    """`fresh`: a chord with sharp ends, over which the wheel tips; `worn`: ends rounded, the centre
    follows one wave of 1 - cos of half the depth of a fresh one, length^2 / (16 radius)"""


class Sections(Uneven):
    """Sections measured around the wheel."""

    type: Literal["sections"]
    file: Text | None = None
    """List of sections over the angle, `.slcw` or CSV with the columns `angle` (rad) and `file`;
    read when the vehicle is loaded"""
    angles: Annotated[tuple[Angle, ...], Field(min_length=3, max_length=2000)] | None = None
    """What was read: angles of the sections [rad]"""
    positions: Annotated[tuple[Finite, ...], Field(min_length=2, max_length=1000)] | None = None
    """Lateral positions from the nominal rolling circle, positive to the field side [m]"""
    heights: tuple[tuple[Finite, ...], ...] | None = None
    """Of every section the radius at the positions, less the nominal one [m]"""

    def backwards(self, **values: object) -> Self:
        """Return the sections in the order in which a wheel that rolls the other way has them."""
        if self.angles is not None and self.heights is not None:
            values |= {
                "angles": tuple(-a for a in self.angles[::-1]),
                "heights": self.heights[::-1],
            }
        return super().backwards(**values)

    @check
    def _one_source(self) -> None:
        parts = (self.angles, self.positions, self.heights)
        if (self.file is None) == (None in parts) or (self.file and parts != (None,) * 3):
            raise ValueError("either 'file', or 'angles', 'positions' and 'heights' are needed")
        if self.angles is not None and self.positions is not None and self.heights is not None:
            for name, values in (("angles", self.angles), ("positions", self.positions)):
                if any(b <= a for a, b in pairwise(values)):
                    raise ValueError(f"the {name} must increase")
            if self.angles[-1] - self.angles[0] >= 6.284:
                raise ValueError("the angles span more than a turn")
            if len(self.heights) != len(self.angles) or any(
                len(row) != len(self.positions) for row in self.heights
            ):
                raise ValueError("'heights' needs a row for every angle, a number for every place")


OutOfRound = Annotated[Harmonics | RadiusTable | Flat | Sections, Field(discriminator="type")]
