"""An irregularity by a law of one's own."""

from collections.abc import Callable
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from railsim.arrays import Floats
from railsim.definitions.base import EMPTY_TABLE, Finite, Name, NonNegative
from railsim.definitions.excitations import base

PER_WAVE = 200  # differences of the rate over the shortest wave; error 3e-8 of it


class ByLaw(base.Stretch):
    """What a law of one's own gives over the arc length."""

    type: Literal["law"]
    law: Name
    """Name of the law in the table `laws`, or of a library"""
    channel: base.Channel = "vertical"
    """Which of the four irregularities: both rails to the right or down, the left rail higher, or
    the rails apart"""
    parameters: dict[Name, Finite] = EMPTY_TABLE
    """Values of the function's further arguments, by name"""
    factor: Finite = 1.0
    """Factor of what it gives [1]"""
    shortest: Annotated[Finite, Field(ge=0.2, le=1000.0)]
    """Shortest wavelength in it [m]"""
    begin: Finite = 0.0
    """Arc length where it begins [m]"""
    end: Finite | None = None
    """Arc length where it ends [m]; by default that of the plan"""
    fade: NonNegative = 10.0
    """Length over which it fades in and out within its ends [m]"""

    def mirrored(self) -> Self:
        """Return the mirror image: what goes to the right or rises on the left is turned round."""
        return self.model_copy(update={"factor": base.MIRROR[self.channel] * self.factor})

    def resolution(self) -> float:
        """Return a sixteenth of the shortest wavelength [m]."""
        return self.shortest / 16.0

    def summary(self) -> str:
        """Return channel and law."""
        return f"{self.channel} by the law '{self.law}'"

    def displacement(self, length: float) -> base.Displacement:
        """Refuse: a definition executes nothing, see `railsim.track.irregularity`."""
        raise NotImplementedError

    def displacement_by(
        self, function: Callable[[Floats], Floats], length: float
    ) -> base.Displacement:
        """Return how it moves the rails by a function of the arc length, with its rate."""
        h, (begin, end) = self.shortest / PER_WAVE, self.extent(length)
        shares = self.factor * base.rails_moved(self.channel)

        def value_and_rate(s: Floats) -> tuple[Floats, Floats]:
            f = {k: function(np.clip(s + k * h, begin, end)) for k in (-2, -1, 0, 1, 2)}
            return shares * f[0], shares * (8.0 * (f[1] - f[-1]) - f[2] + f[-2]) / (12.0 * h)

        return base.faded(value_and_rate, begin, end, self.fade)
