"""What all force elements of a vehicle file have in common: bodies, points, sides, preloads."""

from abc import abstractmethod
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field

from railsim.definitions import base
from railsim.definitions.elements.rows import NOTHING, Mount, Row, Rows, Triple

Signs = Triple
Compression = Annotated[
    Literal["auto"] | Annotated[base.Finite, Field(ge=0)], Field(union_mode="left_to_right")
]


def _characteristic(rows: Rows) -> Rows:
    if len(rows) < 2:
        raise ValueError("a table needs two rows at least")
    if any(after[1] < before[1] for before, after in pairwise(rows)):
        raise ValueError("the force must not fall from row to row (negative stiffness or damping)")
    first, last = rows[0][0], rows[-1][0]
    if first > 0.0 or last <= 0.0:
        raise ValueError("the first column must begin at 0 (same in both directions) or below 0")
    if first == 0.0 and rows[0][1] != 0.0:
        raise ValueError(
            "a table that begins at 0 must begin with force 0 (same in both directions)"
        )
    return rows


Characteristic = Annotated[
    tuple[tuple[base.Finite, base.Finite], ...],
    base.rises("first column"),
    AfterValidator(_characteristic),
]


def two_sided(rows: Rows) -> Rows:
    """Return the table with its mirror image when it begins at zero.

    >>> two_sided(((0.0, 0.0), (0.1, 5.0)))
    ((-0.1, -5.0), (0.0, 0.0), (0.1, 5.0))
    """
    if rows[0][0] < 0.0:
        return rows
    return tuple((-x, -force) for x, force in reversed(rows[1:])) + tuple(rows)


def times(vector: Triple, signs: Signs) -> Triple:
    """Return a vector with the signs of a mirrored placement."""
    return (vector[0] * signs[0], vector[1] * signs[1], vector[2] * signs[2])


class Element(base.Definition):
    """What all force elements have in common; those that carry weight say how."""

    SUPPORTS: ClassVar[str] = "no"
    """Whether body 2 stands on it: `always`, `on axles` where one body is one, `no`."""
    MUST_PRESS: ClassVar[bool] = False
    """Whether it stands the wrong way round where it would have to pull at rest."""

    if TYPE_CHECKING:  # the field of every kind
        kind: str

    bodies: tuple[base.Text, ...]
    """Names of the bodies, found from the innermost assembly outwards"""

    @abstractmethod
    def rows(self) -> Iterable[Row]:
        """Return what it becomes in the arrays of the model."""

    def end_points(self) -> tuple[base.Vector, base.Vector] | None:
        """Points on body 1 and body 2 as written [m]; None where the element has none."""
        point, points = getattr(self, "point", None), getattr(self, "points", None)
        return points if point is None else (point, point)

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored placement; `signs` holds -1 for each reversed axis."""
        return self

    def parts(self) -> list[tuple[str, base.Vector, "Element"]]:
        """Elements of which this one consists: suffix of the name, offset from its point [m]."""
        return []

    def with_known_preload(self, point1: base.Vector, point2: base.Vector) -> Self:
        """Return the element with the preload that follows from its free length, if it has one.

        `point1` and `point2`: its ends in the nominal position, vehicle axes [m].
        """
        return self

    @property
    def vertical_stiffness(self) -> float:
        """Static stiffness with which it carries weight [N/m]; a link's along its line."""
        return 0.0

    @property
    def vertical_damping(self) -> float:
        """Damping at small velocities in parallel with it [N s/m], 0 behind a spring in series."""
        return 0.0

    @property
    def given_preload(self) -> Any:
        """Its preload as written; 0 where it has none."""
        return getattr(self, "preload", 0.0)

    @property
    def preload_is_free(self) -> bool:
        """Whether the static equilibrium finds its preload."""
        return bool(self.given_preload == "auto")

    @property
    def has_free_length(self) -> bool:
        """Whether the preload follows from a length."""
        return False

    @property
    def has_levelling(self) -> bool:
        """Whether a levelling valve keeps its height."""
        return bool(getattr(self, "levelling", False))


class PairElement(Element):
    """An element between two bodies."""

    bodies: tuple[base.Text, base.Text]
    """Names of body 1 and body 2, found from the innermost assembly outwards"""


class SidedElement(PairElement):
    """An element that may stand on both sides."""

    sides: Literal["both"] | None = None
    """`both`: given on the right (y > 0), copied to the left; the names get `.right` and `.left`"""


class PointElement(SidedElement):
    """An element between two points, or at one point that belongs to both bodies."""

    point: base.Vector | None = None
    """The common point of both bodies [m]; either this or `points`"""
    points: tuple[base.Vector, base.Vector] | None = None
    """Point on body 1 and point on body 2 [m]"""

    @base.check
    def _one_way_of_giving_points(self) -> None:
        if (self.point is None) == (self.points is None) and self.has_points:
            raise ValueError("either 'point' or 'points' is needed")
        if not self.has_points and (self.point or self.points):
            raise ValueError("it acts at no point: 'point' and 'points' mean nothing")

    @property
    def has_points(self) -> bool:
        """Whether it acts at points."""
        return True


class FreeLength(PairElement):
    """A spring whose preload follows from its length."""

    free_length: base.Positive | None = None
    """Length without load [m]; the preload follows from it and from the nominal length"""
    load_at_length: tuple[base.Positive, base.Positive] | None = None
    """Load and length at which it was measured [N, m], instead of `free_length`; compression"""

    @property
    def has_free_length(self) -> bool:
        """Whether the preload follows from a length."""
        return self.free_length is not None or self.load_at_length is not None

    def compression(self, stiffness: float, length: float) -> float:
        """Force of compression at a length [N], spring of this `stiffness` [N/m]."""
        if self.free_length is not None:
            return stiffness * (self.free_length - length)
        assert self.load_at_length is not None  # by `has_free_length`
        load, reference = self.load_at_length
        return load + stiffness * (reference - length)

    @base.check
    def _one_origin_of_the_preload(self) -> None:
        if self.free_length is not None and self.load_at_length is not None:
            raise ValueError("either 'free_length' or 'load_at_length', not both")
        given = vars(self).get("preload", 0.0) not in ("auto", 0.0)
        if self.has_free_length and given:  # defaults stand in the files that results carry
            raise ValueError("either 'preload' or a length, not both")


class PreloadAlongAxes(PairElement):
    """An element with a preload along the axes of body 1."""

    if TYPE_CHECKING:  # the field of its kinds
        preload: Literal["auto"] | base.Vector

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored placement: the preload turns with the axes."""
        if self.preload == "auto":
            return self
        return self.model_copy(update={"preload": times(self.preload, signs)})

    @property
    def known_preload(self) -> Triple:
        """The preload as given, 0 where the equilibrium finds it [N]."""
        return NOTHING if self.preload == "auto" else self.preload


class VerticalSpring(PreloadAlongAxes, FreeLength):
    """A spring along z between two seats."""

    if TYPE_CHECKING:  # the fields of its kinds
        stiffness: base.NonNegativeVector
        damping: base.NonNegativeVector
        points: tuple[base.Vector, base.Vector] | None

    @property
    def vertical_stiffness(self) -> float:
        """Stiffness along z [N/m]."""
        return self.stiffness[2]

    @property
    def vertical_damping(self) -> float:
        """Damping along z [N s/m]."""
        return self.damping[2]

    @base.check
    def _length_needs_seats(self) -> None:
        if self.has_free_length and (self.points is None or self.stiffness[2] == 0.0):
            raise ValueError(
                "'free_length' and 'load_at_length' need two 'points' and a stiffness along z"
            )

    def with_known_preload(self, point1: base.Vector, point2: base.Vector) -> Self:
        """Return the spring with the preload of its length: compression pushes the seats apart."""
        if not self.has_free_length:
            return self
        force = self.compression(self.stiffness[2], abs(point2[2] - point1[2]))
        up = -1.0 if point1[2] < point2[2] else 1.0
        return self.model_copy(update={"preload": (0.0, 0.0, up * force)})

    def mount(self, **more: Any) -> Mount:
        """The row of its spring with what a kind adds."""
        row = {"stiffness": self.stiffness, "damping": self.damping, "preload": self.known_preload}
        return Mount(**row | more)
