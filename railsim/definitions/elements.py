"""Force elements of a vehicle file, told apart by their key `kind`.

A force element acts between two bodies, named in the order [body 1, body 2].  Its parameters are
those of the element as written (on the right for `sides = "both"`); `mirrored` gives the copy on
the other side or in a mirrored assembly.  Tables hold rows [displacement or velocity, force].
"""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from railsim.definitions.base import (
    AutoOrNumber,
    AutoOrVector,
    Definition,
    Finite,
    NonNegative,
    NonNegativeVector,
    Positive,
    Text,
    Vector,
    rising,
)

Signs = tuple[float, float, float]
Rows = tuple[tuple[float, float], ...]


def _characteristic(rows: Rows) -> Rows:
    if len(rows) < 2:
        raise ValueError("a table needs two rows at least")
    if not rising(rows):
        raise ValueError("the first column must increase from row to row")
    if any(after[1] < before[1] for before, after in pairwise(rows)):
        raise ValueError("the force must not fall from row to row (negative stiffness or damping)")
    return rows


def _through_zero(rows: Rows) -> Rows:
    first, last = rows[0][0], rows[-1][0]
    if first > 0.0 or last <= 0.0:
        raise ValueError("the first column must begin at 0 (same both ways) or below 0")
    if first == 0.0 and rows[0][1] != 0.0:
        raise ValueError("a table that begins at 0 must begin with force 0 (same both ways)")
    return rows


def _one_sided(rows: Rows) -> Rows:
    if rows[0] != (0.0, 0.0):
        raise ValueError("the first row must be [0, 0]; the table serves both directions")
    return rows


Characteristic = Annotated[
    tuple[tuple[Finite, Finite], ...],
    AfterValidator(_characteristic),
    AfterValidator(_through_zero),
]
StopCharacteristic = Annotated[
    tuple[tuple[Finite, Finite], ...], AfterValidator(_characteristic), AfterValidator(_one_sided)
]


def two_sided(rows: Rows) -> Rows:
    """Return the table with its mirror image when it begins at zero.

    Examples
    --------
    >>> two_sided(((0.0, 0.0), (0.1, 5.0)))
    ((-0.1, -5.0), (0.0, 0.0), (0.1, 5.0))
    """
    if rows[0][0] < 0.0:
        return rows
    return tuple((-x, -force) for x, force in reversed(rows[1:])) + tuple(rows)


def _times(vector: tuple[float, float, float], signs: Signs) -> tuple[float, float, float]:
    return (vector[0] * signs[0], vector[1] * signs[1], vector[2] * signs[2])


def _mirrored_preload(preload: Literal["auto"] | Vector, signs: Signs) -> dict[str, Vector]:
    return {} if preload == "auto" else {"preload": _times(preload, signs)}


class Element(Definition):
    """What all force elements have in common."""

    bodies: tuple[Text, Text]
    """Names of body 1 and body 2, found from the innermost assembly outwards"""

    def end_points(self) -> tuple[Vector, Vector] | None:
        """Points on body 1 and body 2 as written [m]; None where the element has none."""
        return None

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored place; `signs` holds -1 for each reversed axis."""
        return self


class SidedElement(Element):
    """An element that may stand on both sides."""

    sides: Literal["both"] | None = None
    """`both`: given on the right (y > 0), copied to the left; the names get `.right` and `.left`"""


class PointElement(SidedElement):
    """An element between two points, or at one point that belongs to both bodies."""

    point: Vector | None = None
    """The common point of both bodies [m]; either this or `points`"""
    points: tuple[Vector, Vector] | None = None
    """Point on body 1 and point on body 2 [m]"""

    @model_validator(mode="after")
    def _one_way_of_giving_points(self) -> Self:
        if (self.point is None) == (self.points is None):
            raise ValueError("either 'point' or 'points' is needed")
        return self

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        if self.points is not None:
            return self.points
        assert self.point is not None  # by the validator above
        return self.point, self.point


class SpringDamper(SidedElement):
    """Spring and damper along the line between two points."""

    kind: Literal["spring_damper"]
    points: tuple[Vector, Vector]
    """Point on body 1 and point on body 2 [m]"""
    stiffness: NonNegative = 0.0
    """Spring stiffness [N/m]"""
    damping: NonNegative = 0.0
    """Damping [N s/m]"""
    series_stiffness: NonNegative = 0.0
    """Stiffness in series with the damper [N/m]; 0 means rigid"""
    preload: AutoOrNumber = 0.0
    """Force at the nominal length, tension positive [N], or `auto`: found from the equilibrium"""
    spring_table: Characteristic | None = None
    """Rows [elongation m, force N] instead of `stiffness`; from 0 on it serves both directions"""
    damper_table: Characteristic | None = None
    """Rows [velocity m/s, force N] instead of `damping`; from 0 on it serves both directions"""

    @model_validator(mode="after")
    def _one_law_each(self) -> Self:
        if self.points[0] == self.points[1]:
            raise ValueError("the two points are the same: the element has no direction")
        if self.stiffness > 0.0 and self.spring_table is not None:
            raise ValueError("either 'stiffness' or 'spring_table', not both")
        if self.damping > 0.0 and self.damper_table is not None:
            raise ValueError("either 'damping' or 'damper_table', not both")
        if self.series_stiffness > 0.0 and self.damping == 0.0 and self.damper_table is None:
            raise ValueError("'series_stiffness' needs 'damping' or 'damper_table'")
        return self

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        return self.points


class Bushing(PointElement):
    """Three springs and dampers along the axes of body 1; the force acts at the point on body 2."""

    kind: Literal["bushing"]
    stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    series_stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness in series with the damping of each axis [N/m]; 0 means rigid"""
    rotational_stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness about x, y, z [N m/rad]"""
    rotational_damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping about x, y, z [N m s/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`: from the equilibrium"""

    @model_validator(mode="after")
    def _series_needs_damping(self) -> Self:
        for axis, series, damping in zip("xyz", self.series_stiffness, self.damping, strict=True):
            if series > 0.0 and damping == 0.0:
                raise ValueError(f"'series_stiffness' along {axis} needs 'damping' along {axis}")
        return self

    def mirrored(self, signs: Signs) -> Self:
        """Return the bushing in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


class ShearSpring(SidedElement):
    """Coil spring or rubber block between two seats: shear, axial force, bending and torsion."""

    kind: Literal["shear_spring"]
    points: tuple[Vector, Vector]
    """Seat on body 1 and seat on body 2 [m]"""
    stiffness: NonNegativeVector
    """Stiffness along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    bending_stiffness: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    """Bending stiffness about x and y [N m/rad]"""
    torsional_stiffness: NonNegative = 0.0
    """Stiffness about z [N m/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`: from the equilibrium"""

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        return self.points

    def mirrored(self, signs: Signs) -> Self:
        """Return the spring in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


class RollBar(Element):
    """Anti-roll bar: a moment about x against the relative roll of two bodies."""

    kind: Literal["roll_bar"]
    stiffness: Positive
    """Roll stiffness [N m/rad]"""
    damping: NonNegative = 0.0
    """Roll damping [N m s/rad]"""


class BumpStop(PointElement):
    """Stop with free travel along one axis of body 1, the same in both directions."""

    kind: Literal["bump_stop"]
    axis: Literal["x", "y", "z"]
    """Axis of body 1 along which the stop acts"""
    table: StopCharacteristic
    """Rows [travel m, force N], beginning with [0, 0]; serves both directions"""


AnyElement = Annotated[
    SpringDamper | Bushing | ShearSpring | RollBar | BumpStop, Field(discriminator="kind")
]
