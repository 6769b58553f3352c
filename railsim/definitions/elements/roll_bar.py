"""An anti-roll bar."""

from typing import Literal

from railsim.definitions.base import NonNegative, Positive
from railsim.definitions.elements.base import PairElement
from railsim.definitions.elements.rows import Mount


class RollBar(PairElement):
    """Anti-roll bar: a moment about x against the relative roll of two bodies."""

    kind: Literal["roll_bar"]
    stiffness: Positive
    """Roll stiffness [N m/rad]"""
    damping: NonNegative = 0.0
    """Roll damping [N m s/rad]"""

    def rows(self) -> list[Mount]:
        """One mount that turns only."""
        return [
            Mount(
                rotation=(self.stiffness, 0.0, 0.0),
                rotation_damping=(self.damping, 0.0, 0.0),
                translates=False,
            )
        ]
