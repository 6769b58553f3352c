"""A pad that presses and slides."""

from typing import ClassVar, Literal

from railsim.definitions.base import NonNegative, Positive, check
from railsim.definitions.elements.base import Compression, PointElement
from railsim.definitions.elements.friction import SlidingFriction
from railsim.definitions.elements.rows import NOTHING, Mount, Rows, pads


class SideBearer(SlidingFriction, PointElement):
    """A sliding pad on which body 2 rests on body 1: pressure without tension, friction in x and y.

    The friction force has any direction in the plane and at most mu N; where the pad lifts there is
    none.
    """

    SUPPORTS: ClassVar = "always"
    kind: Literal["side_bearer"]
    stiffness: Positive
    """Vertical stiffness [N/m]"""
    damping: NonNegative = 0.0
    """Vertical damping while it carries [N s/m]"""
    preload: Compression = 0.0
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

    @check
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

    def rows(self) -> list[Mount]:
        """One mount that presses, with pads in the plane and a table for the solid stop."""
        sliding = self.limit(0.0, self.friction_coefficient)
        friction = (sliding, sliding, self.limit())
        load = -self.stiffness * self.clearance if self.preload == 0.0 else self.preload
        return [
            Mount(
                stiffness=(0.0, 0.0, self.stiffness),
                damping=(0.0, 0.0, self.damping),
                friction=friction,
                states=pads((self.stick_stiffness, self.stick_stiffness, 0.0), friction),
                tables=(None, None, self.stop_table),
                one_sided=True,
                preload=NOTHING if load == "auto" else (0.0, 0.0, load),
            )
        ]
