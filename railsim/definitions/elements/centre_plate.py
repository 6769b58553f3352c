"""A flat centre plate, as eight pads."""

from math import cos, pi, sin, sqrt
from typing import ClassVar, Literal

from railsim.definitions.base import NonNegative, Positive, Vector, check
from railsim.definitions.elements.base import Compression, Element, PairElement
from railsim.definitions.elements.friction import SlidingFriction
from railsim.definitions.elements.rows import Mount
from railsim.definitions.elements.side_bearer import SideBearer


class CentrePlate(SlidingFriction, PairElement):
    """Flat plate (ring) of body 2 that turns and slides on a bowl of body 1.

    The pressure is that of an elastic layer without tension; it follows a tilted body 2 to the
    edge.  Eight pads at the nodes of Gauss's rule carry it: under even pressure the yaw moment of
    friction is exactly 2/3 mu N (R^3 - r^3)/(R^2 - r^2), the tilting stiffness k (R^2 + r^2)/4.
    """

    SUPPORTS: ClassVar = "always"
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
    preload: Compression = "auto"
    """Compression in the nominal position [N], or `auto`: from the equilibrium"""
    friction_coefficient: NonNegative
    """Coefficient of friction [1]"""
    stick_stiffness: Positive
    """Horizontal stiffness of the whole sticking plate [N/m]"""

    @check
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

    def end_points(self) -> tuple[Vector, Vector]:
        """Centre of the contact surface on both bodies [m]."""
        return self.point, self.point

    def parts(self) -> list[tuple[str, Vector, Element]]:
        """Pads that carry the plate: suffix of the name, offset from the centre [m], pad."""
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
                    sliding_ratio=self.sliding_ratio,
                    stribeck_speed=self.stribeck_speed,
                )
                offset = (radius * cos(angle), radius * sin(angle), 0.0)
                found.append((f"pad_{4 * ring + quarter + 1}", offset, pad))
        return found

    def rows(self) -> list[Mount]:
        """None of its own: its pads stand in the arrays."""
        return []


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
