"""Rail joints at equal distances."""

from typing import Literal, Self

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.base import Finite, Positive
from railsim.definitions.excitations.base import Amplitude, Displacement, Irregular, faded


class Joints(Irregular):
    """Dipped joints of both rails: z = h (1 + cos(2 pi u/l))/2 for |u| < l/2 about each joint."""

    type: Literal["joints"]
    spacing: Positive
    """Distance of the joints [m]"""
    length: Positive = 1.0
    """Length of each dip, l [m]"""
    depth: Amplitude
    """Depth h at a joint, positive downwards [m]"""
    begin: Finite = 0.0
    """Arc length of the first joint [m]"""
    end: Finite
    """Arc length where they end [m]"""

    def mirrored(self) -> Self:
        """Return the same: both rails are alike."""
        return self

    def extent(self, length: float) -> tuple[float, float]:
        """Return where they begin and end [m]."""
        return self.begin - 0.5 * self.length, self.end

    def resolution(self) -> float:
        """Return a sixteenth of a dip [m]."""
        return self.length / 16.0

    def summary(self) -> str:
        """Return depth and distance."""
        return f"joints every {self.spacing:g} m, {1e3 * self.depth:g} mm"

    def displacement(self, length: float) -> Displacement:
        """Return how they move the rails."""
        wave = 2.0 * np.pi / self.length
        shares = self.depth * np.array([0.0, 1.0, 0.0, 1.0])[:, None]

        def moved(s: Floats) -> tuple[Floats, Floats]:
            u = s - self.begin
            u = u - self.spacing * np.round(u / self.spacing)
            inside = np.abs(u) < 0.5 * self.length
            value = np.where(inside, 0.5 + 0.5 * np.cos(wave * u), 0.0)
            return shares * value, shares * np.where(inside, -0.5 * wave * np.sin(wave * u), 0.0)

        return faded(moved, *self.extent(length), 0.0)
