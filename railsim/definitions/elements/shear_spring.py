"""A coil spring or rubber block."""

from typing import ClassVar, Literal

from railsim.definitions.base import AutoOrVector, Flag, NonNegative, NonNegativeVector, Vector
from railsim.definitions.elements.base import SidedElement, VerticalSpring
from railsim.definitions.elements.rows import Mount


class ShearSpring(VerticalSpring, SidedElement):
    """Coil spring or rubber block between two seats: shear, axial force, bending and torsion."""

    SUPPORTS: ClassVar = "always"
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

    def rows(self) -> list[Mount]:
        """One mount in the middle between the seats, in the axes of both bodies."""
        return [
            self.mount(rotation=(*self.bending_stiffness, self.torsional_stiffness), both_ends=True)
        ]
