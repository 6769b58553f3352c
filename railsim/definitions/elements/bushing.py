"""Springs and dampers along and about three axes."""

from typing import ClassVar, Literal

from railsim.definitions.base import AutoOrVector, NonNegativeVector, check
from railsim.definitions.elements.base import PointElement, VerticalSpring
from railsim.definitions.elements.rows import Mount, State


class Bushing(VerticalSpring, PointElement):
    """Three springs and dampers along the axes of body 1; the force acts at the point on body 2."""

    SUPPORTS: ClassVar = "on axles"
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

    @check
    def _series_needs_damping(self) -> None:
        for axis, series, damping in zip("xyz", self.series_stiffness, self.damping, strict=True):
            if series > 0.0 and damping == 0.0:
                raise ValueError(f"'series_stiffness' along {axis} needs 'damping' along {axis}")

    @property
    def vertical_damping(self) -> float:
        """Damping along z [N s/m]."""
        return self.damping[2] if self.series_stiffness[2] == 0.0 else 0.0

    def rows(self) -> list[Mount]:
        """One mount with a Maxwell state for each damper behind a spring."""
        pairs = list(zip(self.damping, self.series_stiffness, strict=True))
        x, y, z = (State("maxwell", (c, k, 0.0)) if k > 0.0 else None for c, k in pairs)
        cx, cy, cz = (c if k == 0.0 else 0.0 for c, k in pairs)
        return [
            self.mount(
                damping=(cx, cy, cz),
                states=(x, y, z),
                rotation=self.rotational_stiffness,
                rotation_damping=self.rotational_damping,
            )
        ]
