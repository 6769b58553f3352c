"""A single lateral disturbance."""

from typing import Literal, Self

from railsim.definitions.excitations.base import Amplitude, Displacement
from railsim.definitions.excitations.single import MOVED, OTHER_RAIL, Rails, Single


class Kink(Single):
    """A single lateral disturbance: a kink of the alignment."""

    type: Literal["kink"]
    offset: Amplitude
    """Displacement in the middle, positive to the right [m]"""
    rail: Rails = "both"
    """Which rail"""

    def mirrored(self) -> Self:
        """Return the opposite on the other rail."""
        return self.model_copy(update={"rail": OTHER_RAIL[self.rail], "offset": -self.offset})

    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails."""
        left, right = MOVED[self.rail]
        return self.moved(self.offset * left, 0.0, self.offset * right, 0.0)
