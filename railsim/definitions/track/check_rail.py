"""Check rails: third rails beside running rails, which guide the backs of flanges."""

from typing import Annotated, Self

from pydantic import BeforeValidator, Field

from railsim.definitions import base

MOST_CHECK_RAILS = 100
Width = Annotated[base.Finite, Field(ge=0.02, le=0.2)]
Rows = Annotated[
    tuple[tuple[base.Finite, Width], ...],
    Field(min_length=2, max_length=10_000),
    base.rises("arc length"),
]
FAR = 1e7  # m


def _rows(value: object) -> object:
    """One width for all of the track."""
    return ((-FAR, value), (FAR, value)) if isinstance(value, int | float) else value


class CheckRail(base.Definition):
    """A check rail, or a guard rail of a sharp curve."""

    rail: base.Side
    """Running rail beside which it stands; it holds the wheelset by the wheel on that rail"""
    flangeway: Annotated[Rows, BeforeValidator(_rows, json_schema_input_type=Width | Rows)]
    """Rows [s, width] from its beginning to its end, linear in between, or one number for a check
    rail all along, as of grooved rails: from the gauge face of the running rail to its own face,
    both 14 mm below the rail tops [m]"""
    shift: base.Finite = 0.0
    """Added to the arc lengths of `flangeway` [m]"""
    trailing: base.Flag = False
    """Whether the rows are passed from their end to their beginning: their arc lengths change their
    sign before `shift` is added"""
    height: Annotated[base.Finite, Field(ge=-0.02, le=0.08)] = 0.0
    """Height of its top above the tops of the running rails [m]"""
    profile: (
        Annotated[tuple[tuple[base.Finite, base.Finite], ...], Field(min_length=2, max_length=1000)]
        | None
    ) = None
    """Points [y, z] of its contour from the top down the face: y towards the running rail, z down
    from its top [m]; by default a plane face"""
    friction: base.NonNegative = 0.3
    """Coefficient of friction [1]"""
    stiffness: Annotated[base.Positive, Field(ge=1e5, le=5e8)] = 5e7
    """Lateral stiffness with its fastening [N/m]"""
    damping: base.NonNegative = 5e4
    """Its damping [N s/m]"""

    @property
    def rows(self) -> tuple[tuple[float, float], ...]:
        """Rows [s, width] along the track [m]."""
        sign = -1 if self.trailing else 1
        return tuple((sign * s + self.shift, width) for s, width in self.flangeway[::sign])

    def mirrored(self) -> Self:
        """Return the same beside the other rail."""
        return self.model_copy(update={"rail": base.OTHER_SIDE[self.rail]})
