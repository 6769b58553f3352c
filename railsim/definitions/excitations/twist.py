"""A single disturbance of the cross level."""

from typing import Literal, Self

from railsim.definitions.excitations.base import Amplitude, Displacement
from railsim.definitions.excitations.single import Single


class Twist(Single):
    """A single disturbance of the cross level: one rail rises, the other sinks by half of it."""

    type: Literal["twist"]
    height: Amplitude
    """Change of cross level in the middle, positive = left rail higher [m]"""

    def mirrored(self) -> Self:
        """Return the opposite change."""
        return self.model_copy(update={"height": -self.height})

    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails."""
        half = 0.5 * self.height
        return self.moved(0.0, -half, 0.0, half)
