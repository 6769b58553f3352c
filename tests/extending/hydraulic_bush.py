"""A hydraulic bush: soft along the track in curves, stiff against hunting."""

from typing import ClassVar, Literal

from railsim.definitions.base import AutoOrVector, NonNegativeVector, Positive
from railsim.definitions.elements.base import PointElement, VerticalSpring
from railsim.definitions.elements.rows import Mount, State


class HydraulicBush(VerticalSpring, PointElement):
    """Axle guide whose stiffness along x rises from k at rest to k + k_s at high frequency.

    Along x F = k d + F_s, F_s' = k_s (d' - F_s/c) (Maxwell 1867); springs along y and z.
    """

    SUPPORTS: ClassVar = "on axles"
    kind: Literal["hydraulic_bush"]
    stiffness: NonNegativeVector
    """Stiffness at rest along x, y, z [N/m]"""
    damping: NonNegativeVector = (0.0, 0.0, 0.0)
    """Damping along x, y, z in parallel [N s/m]"""
    fluid_stiffness: Positive
    """Further stiffness along x at high frequency, k_s [N/m]"""
    fluid_damping: Positive
    """Damping of the fluid channel, c [N s/m]"""
    preload: AutoOrVector = "auto"
    """Force on body 1 in the nominal position along x, y, z [N], or `auto`: from the equilibrium"""

    def rows(self) -> list[Mount]:
        """One mount with a Maxwell state along x."""
        fluid = State("maxwell", (self.fluid_damping, self.fluid_stiffness, 0.0))
        return [
            Mount(
                stiffness=self.stiffness,
                damping=self.damping,
                states=(fluid, None, None),
                preload=self.known_preload,
            )
        ]
