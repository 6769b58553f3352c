"""Dry friction: pads, leaf springs, side bearers, centre plates, wedges."""

from collections.abc import Iterator
from math import cos, pi, sin, sqrt, tan
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.elements.base import (
    Characteristic,
    Compression,
    Element,
    PairElement,
    PointElement,
    VerticalSpring,
)
from railsim.definitions.elements.rows import NOTHING, FrictionLimit, Mount, Rows, pads


class SlidingFriction(base.Definition):
    """Dry friction that may fall with the speed: r + (1 - r) exp(-|v|/v_s) times that at rest.

    Source: Bo, Pavelescu (1982), The friction-speed relation and its influence on the critical
    velocity of stick-slip motion, Wear 82, 277-289.
    """

    sliding_ratio: base.Share = 1.0
    """Friction at high sliding speed over that at rest [1]; 1: it does not fall"""
    stribeck_speed: base.Positive | None = None
    """Sliding speed at which the difference has fallen to 1/e of itself [m/s]"""

    @base.check
    def _ratio_with_speed(self) -> None:
        if (self.sliding_ratio < 1.0) != (self.stribeck_speed is not None):
            raise ValueError("a 'sliding_ratio' below 1 and 'stribeck_speed' belong together")

    def limit(self, force: float = 0.0, coefficient: float = 0.0) -> FrictionLimit:
        """Return the limit along one axis: `force` [N] + `coefficient` [1] times the load."""
        return FrictionLimit(force, coefficient, self.sliding_ratio, self.stribeck_speed or 1.0)


class Friction(SlidingFriction, VerticalSpring, PointElement):
    """Dry friction along the axes of body 1, with a spring in parallel: leaf spring, friction pad.

    The largest friction force along an axis is friction_force + friction_coefficient N, with N the
    vertical spring force of this element, both stages, in the direction of its preload, 0 where it
    is gone.  The friction forces along all axes are one vector within the ellipse of these limits,
    or each has a limit of its own; below it the pad sticks elastically.
    """

    SUPPORTS: ClassVar = "on axles"
    kind: Literal["friction"]
    friction_force: base.NonNegativeVector = NOTHING
    """Constant part of the largest friction force along x, y, z [N]"""
    friction_coefficient: base.NonNegativeVector = NOTHING
    """Part that grows with the vertical spring force, along x, y, z [1]"""
    stick_stiffness: base.NonNegativeVector = NOTHING
    """Stiffness of the sticking pad along x, y, z, needed where there is friction [N/m]"""
    friction_limit: Literal["circle", "axes"] = "circle"
    """`circle`: one contact slides in any direction, its force within a circle (an ellipse where
    the limits differ); `axes`: contacts of their own along each axis"""
    stiffness: base.NonNegativeVector = NOTHING
    """Stiffness of the parallel spring along x, y, z [N/m]"""
    stage_table: Characteristic | None = None
    """Second stage of the spring along z: rows [travel of body 2 m, further force N]"""
    damping: base.NonNegativeVector = NOTHING
    """Damping along x, y, z [N s/m]"""
    preload: base.AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""

    @base.check
    def _friction_needs_a_sticking_stiffness(self) -> None:
        limits = zip(self.friction_force, self.friction_coefficient, strict=True)
        slides = [force > 0.0 or coefficient > 0.0 for force, coefficient in limits]
        if not any(slides):
            raise ValueError("no friction: 'friction_force' or 'friction_coefficient' is needed")
        for axis, sliding, sticking in zip("xyz", slides, self.stick_stiffness, strict=True):
            if sliding and sticking == 0.0:
                raise ValueError(f"friction along {axis} needs 'stick_stiffness' along {axis}")
        pressed = self.stiffness[2] > 0.0 or (self.preload != "auto" and self.preload[2] != 0.0)
        if any(self.friction_coefficient) and not pressed:
            raise ValueError("'friction_coefficient' needs 'stiffness' or 'preload' along z")

    @property
    def stop_table(self) -> Rows | None:
        """Force of the second stage over the travel of body 2."""
        return self.stage_table

    def rows(self) -> Iterator[Mount]:
        """One mount with pads along the axes that have friction."""
        pairs = zip(self.friction_force, self.friction_coefficient, strict=True)
        x, y, z = (self.limit(force, coefficient) for force, coefficient in pairs)
        together = self.friction_limit == "circle"
        states = pads(self.stick_stiffness, (x, y, z), together=together)
        tables = (None, None, self.stage_table)
        yield self.mount(friction=(x, y, z), states=states, tables=tables)


class SideBearer(SlidingFriction, PointElement):
    """A sliding pad on which body 2 rests on body 1: pressure without tension, friction in x and y.

    The friction force has any direction in the plane and at most mu N; where the pad lifts there is
    none.
    """

    SUPPORTS: ClassVar = "always"
    kind: Literal["side_bearer"]
    stiffness: base.Positive
    """Vertical stiffness [N/m]"""
    damping: base.NonNegative = 0.0
    """Vertical damping while it carries [N s/m]"""
    preload: Compression = 0.0
    """Compression in the nominal position [N], or `auto`: from the equilibrium"""
    clearance: base.NonNegative = 0.0
    """Vertical clearance in the nominal position [m]"""
    friction_coefficient: base.NonNegative
    """Coefficient of friction [1]"""
    stick_stiffness: base.Positive
    """Horizontal stiffness of the sticking pad [N/m]"""
    stop_travel: base.Positive | None = None
    """Further compression after which a solid stop carries [m]"""
    stop_stiffness: base.Positive | None = None
    """Stiffness of the solid stop beside that of the pad [N/m]"""

    @base.check
    def _one_nominal_state(self) -> None:
        if self.clearance > 0.0 and self.preload != 0.0:
            raise ValueError("either 'preload' or 'clearance', not both")
        if (self.stop_travel is None) != (self.stop_stiffness is None):
            raise ValueError("'stop_travel' and 'stop_stiffness' belong together")

    @property
    def vertical_stiffness(self) -> float:
        """Stiffness of what carries in the nominal position [N/m]."""
        return self.stiffness if self.clearance == 0.0 else 0.0

    @property
    def vertical_damping(self) -> float:
        """Damping while it carries there [N s/m]."""
        return self.damping if self.clearance == 0.0 else 0.0

    @property
    def stop_table(self) -> Rows | None:
        """Force of the solid stop over the travel of body 2, zero above it."""
        if self.stop_travel is None or self.stop_stiffness is None:
            return None
        first = self.stop_travel + self.clearance
        return ((-1.0, 0.0), (first, 0.0), (first + 1.0, self.stop_stiffness))

    def rows(self) -> Iterator[Mount]:
        """One mount that presses, with pads in the plane and a table for the solid stop."""
        sliding = self.limit(0.0, self.friction_coefficient)
        friction = (sliding, sliding, self.limit())
        load = -self.stiffness * self.clearance if self.preload == 0.0 else self.preload
        yield Mount(
            stiffness=(0.0, 0.0, self.stiffness),
            damping=(0.0, 0.0, self.damping),
            friction=friction,
            states=pads((self.stick_stiffness, self.stick_stiffness, 0.0), friction),
            tables=(None, None, self.stop_table),
            one_sided=True,
            preload=NOTHING if load == "auto" else (0.0, 0.0, load),
        )


class CentrePlate(SlidingFriction, PairElement):
    """Flat plate (ring) of body 2 that turns and slides on a bowl of body 1.

    The pressure is that of an elastic layer without tension; it follows a tilted body 2 to the
    edge.  Eight pads at the nodes of Gauss's rule carry it: under even pressure the yaw moment of
    friction is exactly 2/3 mu N (R^3 - r^3)/(R^2 - r^2), the tilting stiffness k (R^2 + r^2)/4.
    """

    SUPPORTS: ClassVar = "always"
    kind: Literal["centre_plate"]
    point: base.Vector
    """Centre of the contact surface [m]"""
    radius: base.Positive
    """Outer radius R of the contact surface [m]"""
    inner_radius: base.NonNegative = 0.0
    """Inner radius r of the contact surface, 0 for a disc [m]"""
    stiffness: base.Positive
    """Vertical stiffness of the whole plate [N/m]"""
    damping: base.NonNegative = 0.0
    """Vertical damping of the whole plate while it carries [N s/m]"""
    preload: Compression = "auto"
    """Compression in the nominal position [N], or `auto`: from the equilibrium"""
    friction_coefficient: base.NonNegative
    """Coefficient of friction [1]"""
    stick_stiffness: base.Positive
    """Horizontal stiffness of the whole sticking plate [N/m]"""

    @base.check
    def _a_ring(self) -> None:
        if self.inner_radius >= self.radius:
            raise ValueError("'inner_radius' must be smaller than 'radius'")

    @property
    def vertical_stiffness(self) -> float:
        """Stiffness of what carries [N/m]."""
        return self.stiffness

    @property
    def vertical_damping(self) -> float:
        """Damping while it carries [N s/m]."""
        return self.damping

    def parts(self) -> list[tuple[str, base.Vector, Element]]:
        """Pads that carry the plate: suffix of the name, offset from the centre [m], pad."""
        pads: list[tuple[str, base.Vector, Element]] = []
        shared = "bodies", "friction_coefficient", "sliding_ratio", "stribeck_speed"
        per_pad = "stiffness", "damping", "stick_stiffness", "preload"
        for ring, (radius, share) in enumerate(_gauss_on_ring(self.inner_radius, self.radius)):
            values: dict[str, Any] = {name: getattr(self, name) for name in (*shared, *per_pad)}
            values |= {n: 0.25 * share * values[n] for n in per_pad if values[n] != "auto"}
            pad = SideBearer(kind="side_bearer", point=NOTHING, **values)
            for quarter in range(4):
                angle = 0.5 * pi * quarter + 0.25 * pi * ring
                offset = (radius * cos(angle), radius * sin(angle), 0.0)
                pads.append((f"pad_{4 * ring + quarter + 1}", offset, pad))
        return pads

    def rows(self) -> Iterator[Mount]:
        """None of its own: its pads stand in the arrays."""
        yield from ()


def _gauss_on_ring(inner: float, outer: float) -> list[tuple[float, float]]:
    """Two radii and shares of the area that integrate r^0 to r^3 over a ring exactly.

    The radii are the zeros of r^2 - a r + b, orthogonal to 1 and r with the weight r dr.

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

    SUPPORTS: ClassVar = "always"
    MUST_PRESS: ClassVar = True
    kind: Literal["wedge"]
    stiffness: base.NonNegativeVector
    """Stiffness of the wedge springs of one side along x, y, z [N/m]"""
    damping: base.NonNegativeVector = NOTHING
    """Damping along x, y, z [N s/m]"""
    preload: base.AutoOrVector = "auto"
    """Spring force on body 1 in the nominal position along x, y, z [N], or `auto`"""
    angle: Annotated[base.Finite, Field(gt=0.0, lt=1.5)]
    """Angle between the inclined face and the column's face [rad]"""
    friction_coefficient: base.NonNegative
    """Coefficient of friction on the column [1]"""
    stick_stiffness: tuple[base.Positive, base.Positive]
    """Stiffness of the sticking wedges along y and z [N/m]"""

    @base.check
    def _wedge_slides(self) -> None:
        if self.friction_coefficient >= tan(self.angle):
            raise ValueError(
                "the wedge locks itself: 'friction_coefficient' must be smaller than tan(angle) = "
                f"{tan(self.angle):.3g}"
            )
        if self.stiffness[2] == 0.0:
            raise ValueError("the wedges need springs: 'stiffness' along z")

    @base.check
    def _wedge_presses(self) -> None:
        if self.preload != "auto" and self.preload[2] < 0.0:
            raise ValueError(
                "wedges press and never pull: 'preload' along z, on the side frame and positive "
                f"downwards, must not be negative; found {self.preload[2]:.12g}"
            )
        if self.points is not None and self.points[0][2] < self.points[1][2]:
            raise ValueError(
                "the bolster, body 2, rests on the wedges, which stand on the side frame, body 1: "
                "the point on body 1 must not lie above that on body 2 (z points down)"
            )

    @property
    def share(self) -> float:
        """Friction over spring force while the wedge slides level: mu/tan(angle)."""
        return self.friction_coefficient / tan(self.angle)

    def rows(self) -> Iterator[Mount]:
        """One mount that presses, with skew pads along y and z."""
        sliding = FrictionLimit(coefficient=self.share)
        friction = (FrictionLimit(), sliding, sliding)
        states = pads((0.0, *self.stick_stiffness), friction, skew=self.share)
        yield self.mount(friction=friction, states=states, one_sided=True)
