"""Force elements of a vehicle file, told apart by their key `kind`.

A force element acts between two bodies, named in the order [body 1, body 2].  Its parameters are
those of the element as written (on the right for `sides = "both"`); `mirrored` gives the copy on
the other side or in a mirrored assembly.  Tables hold rows [displacement or velocity, force].
"""

from itertools import pairwise
from math import cos, dist, pi, sin, sqrt, tan
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from railsim.definitions.base import (
    AutoOrNumber,
    AutoOrVector,
    Definition,
    Finite,
    Flag,
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


Characteristic = Annotated[
    tuple[tuple[Finite, Finite], ...],
    AfterValidator(_characteristic),
    AfterValidator(_through_zero),
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

    bodies: tuple[Text, ...]
    """Names of the bodies, found from the innermost assembly outwards"""

    def end_points(self) -> tuple[Vector, Vector] | None:
        """Points on body 1 and body 2 as written [m]; None where the element has none."""
        return None

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored place; `signs` holds -1 for each reversed axis."""
        return self

    def parts(self) -> list[tuple[str, Vector, "Element"]]:
        """Elements of which this one consists: suffix of the name, place from its point [m]."""
        return []

    def with_known_preload(self, point1: Vector, point2: Vector) -> Self:
        """Return the element with the preload that follows from its free length, if it has one.

        `point1` and `point2`: its ends in the nominal position, vehicle axes [m].
        """
        return self


class PairElement(Element):
    """An element between two bodies."""

    bodies: tuple[Text, Text]
    """Names of body 1 and body 2, found from the innermost assembly outwards"""


class SidedElement(PairElement):
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


class FreeLength(Definition):
    """A spring whose preload follows from its length."""

    free_length: Positive | None = None
    """Length without load [m]; the preload follows from it and from the nominal length"""
    load_at_length: tuple[Positive, Positive] | None = None
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
        load, at = self.load_at_length
        return load + stiffness * (at - length)

    @model_validator(mode="after")
    def _one_origin_of_the_preload(self) -> Self:
        if self.free_length is not None and self.load_at_length is not None:
            raise ValueError("either 'free_length' or 'load_at_length', not both")
        given = vars(self).get("preload", 0.0) not in ("auto", 0.0)
        if self.has_free_length and given:  # defaults stand in the files that results carry
            raise ValueError("either 'preload' or a length, not both")
        return self


class VerticalSpring(FreeLength):
    """A spring along z between two seats."""

    if TYPE_CHECKING:  # the fields of its kinds
        stiffness: NonNegativeVector
        points: tuple[Vector, Vector] | None

    @model_validator(mode="after")
    def _length_needs_seats(self) -> Self:
        if self.has_free_length and (self.points is None or self.stiffness[2] == 0.0):
            raise ValueError("a free length needs 'points' at two heights and a stiffness along z")
        return self

    def with_known_preload(self, point1: Vector, point2: Vector) -> Self:
        """Return the spring with the preload of its length: compression pushes the seats apart."""
        if not self.has_free_length:
            return self
        force = self.compression(self.stiffness[2], abs(point2[2] - point1[2]))
        up = -1.0 if point1[2] < point2[2] else 1.0
        return self.model_copy(update={"preload": (0.0, 0.0, up * force)})


class SpringDamper(FreeLength, SidedElement):
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
        if self.has_free_length and self.stiffness == 0.0:
            raise ValueError("a free length needs 'stiffness'")
        return self

    def with_known_preload(self, point1: Vector, point2: Vector) -> Self:
        """Return the spring with the preload of its length, tension positive."""
        if not self.has_free_length:
            return self
        return self.model_copy(
            update={"preload": -self.compression(self.stiffness, dist(point1, point2))}
        )

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        return self.points


class Bushing(VerticalSpring, PointElement):
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


class ShearSpring(VerticalSpring, SidedElement):
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
    levelling: Flag = False
    """Air spring with levelling valve: what stands on such springs alone keeps its height in
    every load case"""

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        return self.points

    def mirrored(self, signs: Signs) -> Self:
        """Return the spring in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


class RollBar(PairElement):
    """Anti-roll bar: a moment about x against the relative roll of two bodies."""

    kind: Literal["roll_bar"]
    stiffness: Positive
    """Roll stiffness [N m/rad]"""
    damping: NonNegative = 0.0
    """Roll damping [N m s/rad]"""


class BumpStop(PointElement):
    """Stop with free travel along one axis of body 1; a spring with clearance."""

    kind: Literal["bump_stop"]
    axis: Literal["x", "y", "z"]
    """Axis of body 1 along which the stop acts"""
    table: Characteristic
    """Rows [travel of body 2 m, force N]; from [0, 0] on it serves both directions"""

    def mirrored(self, signs: Signs) -> Self:
        """Return the stop in a mirrored place: the two directions of its axis change places."""
        if signs["xyz".index(self.axis)] > 0.0 or self.table[0][0] == 0.0:
            return self
        turned = tuple((-x, -force) for x, force in reversed(self.table))
        return self.model_copy(update={"table": turned})


class Friction(VerticalSpring, PointElement):
    """Dry friction along the axes of body 1, with a spring in parallel: leaf spring, friction pad.

    The largest friction force along an axis is friction_force + friction_coefficient N, with N the
    vertical spring force of this element in the direction of its preload, 0 where it is gone.  The
    friction forces along all axes are one vector within the ellipse of these limits, or each has a
    limit of its own; below it the pad sticks elastically.
    """

    kind: Literal["friction"]
    friction_force: NonNegativeVector = (0.0, 0.0, 0.0)
    """Constant part of the largest friction force along x, y, z [N]"""
    friction_coefficient: NonNegativeVector = (0.0, 0.0, 0.0)
    """Part that grows with the vertical spring force, along x, y, z [1]"""
    stick_stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness of the sticking pad along x, y, z, needed where there is friction [N/m]"""
    friction_limit: Literal["circle", "axes"] = "circle"
    """`circle`: one contact slides in any direction, its force within a circle (an ellipse where
    the limits differ); `axes`: contacts of their own along each axis"""
    stiffness: NonNegativeVector = (0.0, 0.0, 0.0)
    """Stiffness of the parallel spring along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    preload: AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""

    @model_validator(mode="after")
    def _friction_needs_a_sticking_stiffness(self) -> Self:
        limits = zip(self.friction_force, self.friction_coefficient, strict=True)
        slides = [force > 0.0 or coefficient > 0.0 for force, coefficient in limits]
        if not any(slides):
            raise ValueError("no friction: 'friction_force' or 'friction_coefficient' is needed")
        for axis, sliding, sticking in zip("xyz", slides, self.stick_stiffness, strict=True):
            if sliding and sticking == 0.0:
                raise ValueError(f"friction along {axis} needs 'stick_stiffness' along {axis}")
        return self

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


class SideBearer(PointElement):
    """A sliding pad on which body 2 rests on body 1: pressure without tension, friction in x and y.

    The friction force has any direction in the plane and at most mu N; where the pad lifts there is
    none.
    """

    kind: Literal["side_bearer"]
    stiffness: Positive
    """Vertical stiffness [N/m]"""
    damping: NonNegative = 0.0
    """Vertical damping while it carries [N s/m]"""
    preload: Annotated[Literal["auto"] | NonNegative, Field(union_mode="left_to_right")] = 0.0
    """Compression in the nominal position [N], or `auto`: from the equilibrium"""
    clearance: NonNegative = 0.0
    """Vertical clearance in the nominal position [m]"""
    friction_coefficient: NonNegative
    """Coefficient of friction [1]"""
    stick_stiffness: Positive
    """Horizontal stiffness of the sticking pad [N/m]"""
    stop_travel: Positive | None = None
    """Further compression after which a solid stop carries [m]"""
    stop_stiffness: Positive | None = None
    """Stiffness of the solid stop beside that of the pad [N/m]"""

    @model_validator(mode="after")
    def _one_nominal_state(self) -> Self:
        if self.clearance > 0.0 and self.preload != 0.0:
            raise ValueError("either 'preload' or 'clearance', not both")
        if (self.stop_travel is None) != (self.stop_stiffness is None):
            raise ValueError("'stop_travel' and 'stop_stiffness' belong together")
        return self

    @property
    def stop_table(self) -> Rows | None:
        """Force of the solid stop over the travel of body 2, zero above it."""
        if self.stop_travel is None or self.stop_stiffness is None:
            return None
        first = self.stop_travel + self.clearance
        return ((-1.0, 0.0), (first, 0.0), (first + 1.0, self.stop_stiffness))


class CentrePlate(PairElement):
    """Flat plate (ring) of body 2 that turns and slides on a bowl of body 1.

    The pressure is that of an elastic layer without tension; it follows a tilted body 2 to the
    edge.  Eight pads at the nodes of Gauss's rule carry it: under even pressure the yaw moment of
    friction is exactly 2/3 mu N (R^3 - r^3)/(R^2 - r^2), the tilting stiffness k (R^2 + r^2)/4.
    """

    kind: Literal["centre_plate"]
    point: Vector
    """Centre of the contact surface [m]"""
    radius: Positive
    """Outer radius R of the contact surface [m]"""
    inner_radius: NonNegative = 0.0
    """Inner radius r of the contact surface, 0 for a disc [m]"""
    stiffness: Positive
    """Vertical stiffness of the whole plate [N/m]"""
    damping: NonNegative = 0.0
    """Vertical damping of the whole plate while it carries [N s/m]"""
    preload: Annotated[Literal["auto"] | NonNegative, Field(union_mode="left_to_right")] = "auto"
    """Compression in the nominal position [N], or `auto`: from the equilibrium"""
    friction_coefficient: NonNegative
    """Coefficient of friction [1]"""
    stick_stiffness: Positive
    """Horizontal stiffness of the whole sticking plate [N/m]"""

    @model_validator(mode="after")
    def _a_ring(self) -> Self:
        if self.inner_radius >= self.radius:
            raise ValueError("'inner_radius' must be smaller than 'radius'")
        return self

    def end_points(self) -> tuple[Vector, Vector]:
        """Centre of the contact surface on both bodies [m]."""
        return self.point, self.point

    def parts(self) -> list[tuple[str, Vector, Element]]:
        """Pads that carry the plate: suffix of the name, place from the centre [m], pad."""
        found: list[tuple[str, Vector, Element]] = []
        rule = _gauss_on_ring(self.inner_radius, self.radius)
        for ring, (radius, share) in enumerate(rule):
            for quarter in range(4):
                angle = 0.5 * pi * quarter + 0.25 * pi * ring
                pad = SideBearer(
                    kind="side_bearer",
                    bodies=self.bodies,
                    point=(0.0, 0.0, 0.0),
                    stiffness=0.25 * share * self.stiffness,
                    damping=0.25 * share * self.damping,
                    preload="auto" if self.preload == "auto" else 0.25 * share * self.preload,
                    friction_coefficient=self.friction_coefficient,
                    stick_stiffness=0.25 * share * self.stick_stiffness,
                )
                place = (radius * cos(angle), radius * sin(angle), 0.0)
                found.append((f"pad_{4 * ring + quarter + 1}", place, pad))
        return found


def _gauss_on_ring(inner: float, outer: float) -> list[tuple[float, float]]:
    """Two radii and shares of the area that integrate r^0 to r^3 over a ring exactly.

    The radii are the zeros of r^2 - a r + b, orthogonal to 1 and r with the weight r dr.

    Examples
    --------
    >>> [(round(r, 4), round(share, 4)) for r, share in _gauss_on_ring(0.0, 1.0)]
    [(0.3551, 0.3639), (0.8449, 0.6361)]
    """
    m0, m1, m2, m3 = (
        2.0 / (k + 2) * (outer ** (k + 2) - inner ** (k + 2)) / (outer**2 - inner**2)
        for k in range(4)
    )
    # int (r^2 - a r + b) r^j r dr = 0 for j = 0, 1
    a = (m3 * m0 - m1 * m2) / (m2 * m0 - m1 * m1)
    b = (a * m1 - m2) / m0
    half = sqrt(0.25 * a * a - b)
    near, far = 0.5 * a - half, 0.5 * a + half
    share = (m1 - near) / (far - near)
    return [(near, 1.0 - share), (far, share)]


class Wedge(VerticalSpring, PointElement):
    """Friction wedges of one side of a three-piece bogie, on their springs.

    Body 1 is the side frame, body 2 the bolster, whose inclined faces rest on the wedges; the wedge
    springs stand on the side frame (variable friction).  Without mass and with a smooth inclined
    face the force on the column is N = (F + T_z)/tan(angle), with F the spring force and T_z the
    friction that holds the wedge up: mu N is larger on the way down than on the way up.
    """

    kind: Literal["wedge"]
    stiffness: NonNegativeVector
    """Stiffness of the wedge springs of one side along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z [N s/m]"""
    preload: AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""
    angle: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, lt=1.5)]
    """Angle between the inclined face and the column's face [rad]"""
    friction_coefficient: NonNegative
    """Coefficient of friction on the column [1]"""
    stick_stiffness: tuple[Positive, Positive]
    """Stiffness of the sticking wedges along y and z [N/m]"""

    @model_validator(mode="after")
    def _wedge_slides(self) -> Self:
        if self.friction_coefficient >= tan(self.angle):
            raise ValueError(
                "the wedge locks itself: 'friction_coefficient' must be smaller than tan(angle) = "
                f"{tan(self.angle):.3g}"
            )
        if self.stiffness[2] == 0.0:
            raise ValueError("the wedges need springs: 'stiffness' along z")
        return self

    @property
    def share(self) -> float:
        """Friction over spring force while the wedge slides level: mu/tan(angle)."""
        return self.friction_coefficient / tan(self.angle)

    def mirrored(self, signs: Signs) -> Self:
        """Return the wedges in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


class Airspring(PointElement):
    """Air spring with reservoir after Nishimura: three springs and the orifice's damping.

    Vertical force: area_stiffness z + bellows_stiffness (z - w), where the orifice closes the
    balance bellows_stiffness (z - w) = reservoir_stiffness w + orifice_damping w'.
    """

    kind: Literal["airspring"]
    bellows_stiffness: Positive
    """Stiffness of the air in the bellows alone [N/m]"""
    reservoir_stiffness: NonNegative
    """Further stiffness of the air in the reservoir [N/m]"""
    area_stiffness: NonNegative = 0.0
    """Stiffness from the change of the effective area [N/m]"""
    orifice_damping: Positive
    """Damping of the orifice, referred to the bellows [N s/m]"""
    horizontal_stiffness: tuple[NonNegative, NonNegative]
    """Stiffness along x and y [N/m]"""
    horizontal_damping: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    """Damping along x and y [N s/m]"""
    torsional_stiffness: NonNegative = 0.0
    """Stiffness about z [N m/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`"""
    levelling: Flag = True
    """With levelling valve: what stands on such springs alone keeps its height in every load
    case"""

    def mirrored(self, signs: Signs) -> Self:
        """Return the spring in a mirrored place: the preload turns with the axes."""
        return self.model_copy(update=_mirrored_preload(self.preload, signs))


def _in_time(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    if not rising(rows):
        raise ValueError("the time or distance must increase from row to row")
    return rows


TimeRows = Annotated[
    tuple[tuple[Finite, Finite, Finite, Finite], ...], Field(min_length=1), AfterValidator(_in_time)
]


class AppliedForce(Element):
    """A force and a torque on one body over time or distance: wind, traction, a test load."""

    kind: Literal["applied_force"]
    bodies: tuple[Text]
    """Name of the body, found from the innermost assembly outwards"""
    point: Vector | None = None
    """Where the force acts [m]; by default at the centre of gravity"""
    axes: Literal["body", "track"] = "body"
    """Axes of force and torque: those of the body, or those of the track at its place"""
    over: Literal["time", "distance"] = "time"
    """First column of the tables: time, or the place of the body's nominal position on the track"""
    force_table: TimeRows | None = None
    """Rows [time s or distance m, Fx, Fy, Fz N], linear in between, constant beyond"""
    torque_table: TimeRows | None = None
    """Rows [time s or distance m, Mx, My, Mz N m], linear in between, constant beyond"""

    @model_validator(mode="after")
    def _something_acts(self) -> Self:
        if self.force_table is None and self.torque_table is None:
            raise ValueError("'force_table' or 'torque_table' is needed")
        return self

    def end_points(self) -> tuple[Vector, Vector] | None:
        """Point of action as written, twice [m]; None for the centre of gravity."""
        return None if self.point is None else (self.point, self.point)

    def mirrored(self, signs: Signs) -> Self:
        """Return the load in a mirrored place; a torque turns the other way round than a force."""
        handed = signs[0] * signs[1] * signs[2]
        turns = (handed * signs[0], handed * signs[1], handed * signs[2])
        tables = {
            "force_table": (self.force_table, signs),
            "torque_table": (self.torque_table, turns),
        }
        update = {
            key: tuple((row[0], *_times(row[1:], factors)) for row in rows)
            for key, (rows, factors) in tables.items()
            if rows is not None
        }
        return self.model_copy(update=update)


class AxleTorque(PairElement):
    """A torque between a wheelset and the body that takes its reaction."""

    demand_table: (
        Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), AfterValidator(_in_time)]
        | None
    ) = None
    """Rows [time s or distance m, factor of the torque], linear in between, constant beyond"""
    over: Literal["time", "distance"] = "time"
    """First column of `demand_table`: time, or the place of the wheelset's nominal position"""
    slip_control: tuple[NonNegative, Positive] | None = None
    """Slip (omega r - V)/V at which the torque begins to fall, and slip at which it is gone [1]"""

    @model_validator(mode="after")
    def _slip_rises(self) -> Self:
        if self.slip_control is not None and self.slip_control[0] >= self.slip_control[1]:
            raise ValueError("'slip_control' needs two rising slips, such as [0.01, 0.02]")
        return self


def _over_speed(rows: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if not rising(rows):
        raise ValueError("the speed must increase from row to row")
    return rows


class Traction(AxleTorque):
    """Driving torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It drives forwards wherever the element stands, in mirrored placements too.
    """

    kind: Literal["traction"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, Finite], ...], Field(min_length=1), AfterValidator(_over_speed)
    ]
    """Rows [speed m/s, torque on the wheelset N m], forwards positive, linear, constant beyond"""


class Brake(AxleTorque):
    """Braking torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It acts against the wheelset's rotation and vanishes with it.
    """

    kind: Literal["brake"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, NonNegative], ...],
        Field(min_length=1),
        AfterValidator(_over_speed),
    ]
    """Rows [speed m/s, torque on the wheelset N m], linear in between, constant beyond"""


AnyElement = Annotated[
    SpringDamper
    | Bushing
    | ShearSpring
    | RollBar
    | BumpStop
    | Friction
    | SideBearer
    | CentrePlate
    | Wedge
    | Airspring
    | AppliedForce
    | Traction
    | Brake,
    Field(discriminator="kind"),
]
