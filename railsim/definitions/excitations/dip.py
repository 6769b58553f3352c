"""A single vertical disturbance."""

from typing import Literal, Self

from railsim.definitions.excitations.base import Amplitude, Displacement
from railsim.definitions.excitations.single import MOVED, OTHER_RAIL, Rails, Single


class Dip(Single):
    """A single vertical disturbance: a dipped joint, a hump."""

    type: Literal["dip"]
    depth: Amplitude
    """Displacement in the middle, positive downwards [m]"""
    rail: Rails = "both"
    """Which rail"""
    shape: Literal["cosine", "triangle"] = "cosine"
    """`cosine`: one wave of 1 - cos; `triangle`: two straights, kinks rounded over length / 10"""

    def mirrored(self) -> Self:
        """Return the same on the other rail."""
        return self.model_copy(update={"rail": OTHER_RAIL[self.rail]})

    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails."""
        left, right = MOVED[self.rail]
        return self.moved(0.0, self.depth * left, 0.0, self.depth * right)
