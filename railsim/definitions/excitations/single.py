"""Single disturbances: dips, kinks, twists."""

from typing import Literal, Self

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.base import OTHER_SIDE, Finite, Positive
from railsim.definitions.excitations.base import Amplitude, Displacement, Irregular
from railsim.definitions.track.elements import Section
from railsim.definitions.track.rounded_profile import RoundedProfile

Rails = Literal["left", "right", "both"]
MOVED = {"left": (1.0, 0.0), "right": (0.0, 1.0), "both": (1.0, 1.0)}


class Single(Irregular):
    """A single disturbance, `length` long about `s`."""

    s: Finite
    """Arc length of its middle [m]"""
    length: Positive
    """Length from beginning to end [m]"""
    shape: Literal["cosine", "triangle"] = "triangle"
    """`cosine`: one wave of 1 - cos; `triangle`: two straights, kinks rounded over length / 10, of
    which the middle keeps 95 %"""

    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends [m]."""
        return self.s - 0.5 * self.length, self.s + 0.5 * self.length

    def resolution(self) -> float:
        """Return a part of its length; a triangle has rounded kinks [m]."""
        return self.length / (40.0 if self.shape == "triangle" else 16.0)

    def summary(self) -> str:
        """Return its type and arc length."""
        return f"{self.type} at {self.s:g} m"

    def with_middle(self, *middle: float) -> Displacement:
        """Return the displacement that is `middle` at `s` (y, z left, y, z right) [m]."""
        shares = np.array(middle)[:, None]
        shape = self._cosine if self.shape == "cosine" else self._triangle

        def value_and_rate(s: Floats) -> tuple[Floats, Floats]:
            value, rate = shape(s - self.s)
            return shares * value, shares * rate

        return value_and_rate

    def _cosine(self, u: Floats) -> tuple[Floats, Floats]:
        wave = 2.0 * np.pi / self.length
        inside = np.abs(u) < 0.5 * self.length
        value = np.where(inside, 0.5 + 0.5 * np.cos(wave * u), 0.0)
        return value, np.where(inside, -0.5 * wave * np.sin(wave * u), 0.0)

    def _triangle(self, u: Floats) -> tuple[Floats, Floats]:
        half = 0.5 * self.length
        up = Section("", "", 0.0, half, 0.0, 1.0)
        down = Section("", "", half, self.length, 1.0, 0.0)
        profile = RoundedProfile([up, down], self.length / 10.0)
        return profile(u + half), profile.rate(u + half)


class Dip(Single):
    """A single vertical disturbance: a dipped joint, a hump."""

    type: Literal["dip"]
    depth: Amplitude
    """Displacement in the middle, positive downwards [m]"""
    rail: Rails = "both"
    """Which rail"""
    shape: Literal["cosine", "triangle"] = "cosine"

    def mirrored(self) -> Self:
        """Return the same on the other rail."""
        return self.model_copy(update={"rail": OTHER_SIDE[self.rail]})

    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails."""
        left, right = MOVED[self.rail]
        return self.with_middle(0.0, self.depth * left, 0.0, self.depth * right)


class Kink(Single):
    """A single lateral disturbance: a kink of the alignment."""

    type: Literal["kink"]
    offset: Amplitude
    """Displacement in the middle, positive to the right [m]"""
    rail: Rails = "both"
    """Which rail"""

    def mirrored(self) -> Self:
        """Return the opposite on the other rail."""
        return self.model_copy(update={"rail": OTHER_SIDE[self.rail], "offset": -self.offset})

    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails."""
        left, right = MOVED[self.rail]
        return self.with_middle(self.offset * left, 0.0, self.offset * right, 0.0)


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
        return self.with_middle(0.0, -half, 0.0, half)
