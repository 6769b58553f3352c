"""Springs, dampers, stops and air springs."""

from collections.abc import Iterator
from itertools import pairwise
from math import dist
from typing import ClassVar, Literal, Self

from railsim.definitions.base import (
    AutoOrNumber,
    AutoOrVector,
    Flag,
    NonNegative,
    NonNegativeVector,
    Positive,
    Vector,
    check,
)
from railsim.definitions.elements import base
from railsim.definitions.elements.rows import NOTHING, Link, Mount, State


class SpringDamper(base.FreeLength, base.SidedElement):
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
    spring_table: base.Characteristic | None = None
    """Rows [elongation m, force N] instead of `stiffness`; from 0 on it serves both directions"""
    damper_table: base.Characteristic | None = None
    """Rows [velocity m/s, force N] instead of `damping`; from 0 on it serves both directions"""

    @check
    def _one_law_each(self) -> None:
        if self.points[0] == self.points[1]:
            raise ValueError("the two points are the same: the element has no direction")
        if self.stiffness > 0.0 and self.spring_table is not None:
            raise ValueError("either 'stiffness' or 'spring_table', not both")
        if self.damping > 0.0 and self.damper_table is not None:
            raise ValueError("either 'damping' or 'damper_table', not both")
        given = self.damper_table is not None or "damping" in self.model_fields_set  # 0: it failed
        if self.series_stiffness > 0.0 and not given:
            raise ValueError("'series_stiffness' needs 'damping' or 'damper_table'")
        if self.has_free_length and self.stiffness == 0.0:
            raise ValueError("'free_length' and 'load_at_length' need 'stiffness'")

    def with_known_preload(self, point1: Vector, point2: Vector) -> Self:
        """Return the spring with the preload of its length, tension positive."""
        if not self.has_free_length:
            return self
        return self.model_copy(
            update={"preload": -self.compression(self.stiffness, dist(point1, point2))}
        )

    @property
    def vertical_stiffness(self) -> float:
        """Largest stiffness along its line [N/m]."""
        if self.spring_table is None:
            return self.stiffness
        steps = pairwise(base.two_sided(self.spring_table))
        return max((end[1] - begin[1]) / (end[0] - begin[0]) for begin, end in steps)

    @property
    def vertical_damping(self) -> float:
        """Damping along its line [N s/m]."""
        return self.damping if self.series_stiffness == 0.0 else 0.0

    def rows(self) -> Iterator[Link]:
        """One link; behind a spring in series the damper's force is an internal state."""
        state = None
        damps = self.damping > 0.0 or self.damper_table is not None
        if self.series_stiffness > 0.0 and damps:
            parameter = (self.damping, self.series_stiffness, 0.0)
            table = self.damper_table
            state = State("maxwell_curve" if table else "maxwell", parameter, table)
        yield Link(
            stiffness=self.stiffness,
            damping=0.0 if state else self.damping,
            preload=0.0 if self.preload == "auto" else self.preload,
            state=state,
            spring_table=self.spring_table,
            damper_table=None if state else self.damper_table,
        )


class Bushing(base.VerticalSpring, base.PointElement):
    """Three springs and dampers along the axes of body 1; the force acts at the point on body 2."""

    SUPPORTS: ClassVar = "on axles"
    kind: Literal["bushing"]
    stiffness: NonNegativeVector = NOTHING
    """Stiffness along x, y, z [N/m]"""
    damping: NonNegativeVector = NOTHING
    """Damping along x, y, z [N s/m]"""
    series_stiffness: NonNegativeVector = NOTHING
    """Stiffness in series with the damping of each axis [N/m]; 0 means rigid"""
    rotational_stiffness: NonNegativeVector = NOTHING
    """Stiffness about x, y, z [N m/rad]"""
    rotational_damping: NonNegativeVector = NOTHING
    """Damping about x, y, z [N m s/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`: from the equilibrium"""

    @check
    def _series_needs_damping(self) -> None:
        for axis, series in zip("xyz", self.series_stiffness, strict=True):
            if series > 0.0 and "damping" not in self.model_fields_set:
                raise ValueError(f"'series_stiffness' along {axis} needs 'damping' along {axis}")

    @property
    def vertical_damping(self) -> float:
        """Damping along z [N s/m]."""
        return self.damping[2] if self.series_stiffness[2] == 0.0 else 0.0

    def rows(self) -> Iterator[Mount]:
        """One mount with a Maxwell state for each damper behind a spring."""
        pairs = list(zip(self.damping, self.series_stiffness, strict=True))
        x, y, z = (State("maxwell", (c, k, 0.0)) if min(c, k) > 0.0 else None for c, k in pairs)
        cx, cy, cz = (c if k == 0.0 else 0.0 for c, k in pairs)
        yield self.mount(
            damping=(cx, cy, cz),
            states=(x, y, z),
            rotation=self.rotational_stiffness,
            rotation_damping=self.rotational_damping,
        )


class ShearSpring(base.VerticalSpring, base.SidedElement):
    """Coil spring or rubber block between two seats: shear, axial force, bending and torsion."""

    SUPPORTS: ClassVar = "always"
    kind: Literal["shear_spring"]
    points: tuple[Vector, Vector]
    """Seat on body 1 and seat on body 2 [m]"""
    stiffness: NonNegativeVector
    """Stiffness along x, y, z [N/m]"""
    damping: NonNegativeVector = NOTHING
    """Damping along x, y, z [N s/m]"""
    bending_stiffness: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    """Bending stiffness about x and y [N m/rad]"""
    torsional_stiffness: NonNegative = 0.0
    """Stiffness about z [N m/rad]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`: from the equilibrium"""
    levelling: Flag = False
    """Air spring with levelling valve: a body carried only by such springs keeps its height in
    every load case"""

    def rows(self) -> Iterator[Mount]:
        """One mount in the middle between the seats, in the axes of both bodies."""
        rotation = (*self.bending_stiffness, self.torsional_stiffness)
        yield self.mount(rotation=rotation, both_ends=True)


class Airspring(base.PreloadAlongAxes, base.PointElement):
    """Air spring with reservoir after Nishimura: three springs and the orifice's damping.

    Vertical force: area_stiffness z + bellows_stiffness (z - w), where the orifice closes the
    balance bellows_stiffness (z - w) = reservoir_stiffness w + orifice_damping w'.
    """

    SUPPORTS: ClassVar = "always"
    kind: Literal["airspring"]
    bellows_stiffness: Positive
    """Stiffness of the air in the bellows alone [N/m]"""
    reservoir_stiffness: NonNegative
    """Stiffness of the air in the reservoir alone, in series with that of the bellows [N/m]"""
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
    """With levelling valve: a body carried only by such springs keeps its height in every load
    case"""

    @property
    def vertical_stiffness(self) -> float:
        """Stiffness at rest: bellows and reservoir in series, beside the area's [N/m].

        Without damping in parallel: the orifice acts through the air.
        """
        in_series = self.bellows_stiffness * self.reservoir_stiffness
        return self.area_stiffness + in_series / (self.bellows_stiffness + self.reservoir_stiffness)

    def rows(self) -> Iterator[Mount]:
        """One mount in the middle, its vertical force with the state of the reservoir."""
        air = (self.bellows_stiffness, self.reservoir_stiffness, self.orifice_damping)
        yield Mount(
            stiffness=(*self.horizontal_stiffness, self.area_stiffness),
            damping=(*self.horizontal_damping, 0.0),
            states=(None, None, State("air", air)),
            rotation=(0.0, 0.0, self.torsional_stiffness),
            preload=self.known_preload,
            both_ends=True,
        )


class BumpStop(base.PointElement):
    """Stop with free travel along one axis of body 1; a spring with clearance."""

    kind: Literal["bump_stop"]
    axis: Literal["x", "y", "z"]
    """Axis of body 1 along which the stop acts"""
    table: base.Characteristic
    """Rows [travel of body 2 m, force N]; from [0, 0] on it serves both directions"""

    def mirrored(self, signs: base.Signs) -> Self:
        """Return the stop in a mirrored placement: the two directions of its axis are exchanged."""
        if signs["xyz".index(self.axis)] > 0.0 or self.table[0][0] == 0.0:
            return self
        turned = tuple((-x, -force) for x, force in reversed(self.table))
        return self.model_copy(update={"table": turned})

    def rows(self) -> Iterator[Mount]:
        """One mount with a table along its axis."""
        x, y, z = (self.table if axis == self.axis else None for axis in "xyz")
        yield Mount(tables=(x, y, z))


class RollBar(base.PairElement):
    """Anti-roll bar: a moment about x against the relative roll of two bodies."""

    kind: Literal["roll_bar"]
    stiffness: Positive
    """Roll stiffness [N m/rad]"""
    damping: NonNegative = 0.0
    """Roll damping [N m s/rad]"""

    def rows(self) -> Iterator[Mount]:
        """One mount that turns only."""
        yield Mount(
            rotation=(self.stiffness, 0.0, 0.0),
            rotation_damping=(self.damping, 0.0, 0.0),
            translates=False,
        )
