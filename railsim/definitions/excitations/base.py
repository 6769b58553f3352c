"""What all irregularities have in common: channels, mirror image, displacement of the rails.

A `Displacement` gives, for any arc lengths, the four displacements (y_left, z_left, y_right,
z_right; y to the right, z down) [m] and their derivatives along the track [1].
"""

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal, Self, get_args

import numpy as np
from pydantic import Field

from railsim.arrays import Floats
from railsim.definitions.base import Definition, Finite, check, holds

Displacement = Callable[[Floats], tuple[Floats, Floats]]

# Names of the columns of a measured irregularity, beside the arc length.
COLUMNS = ("y_left", "z_left", "y_right", "z_right")
# The four irregularities of a track.
Channel = Literal["lateral", "vertical", "cross_level", "gauge"]
CHANNELS: tuple[Channel, ...] = get_args(Channel)
# Sign of each in the mirror image of the track.
MIRROR = {"lateral": -1.0, "vertical": 1.0, "cross_level": -1.0, "gauge": 1.0}
# Rails moved by one unit of each: y_left, z_left, y_right, z_right; the cross level is an angle
# here, positive = left rail higher, and its unit moves the rails by b.
SHARES = {
    "lateral": (1.0, 0.0, 1.0, 0.0),
    "vertical": (0.0, 1.0, 0.0, 1.0),
    "cross_level": (0.0, -1.0, 0.0, 1.0),
    "gauge": (-0.5, 0.0, 0.5, 0.0),
}
Amplitude = Annotated[Finite, Field(ge=-0.5, le=0.5)]


Wavelengths = Annotated[
    tuple[Annotated[Finite, Field(ge=0.2)], Annotated[Finite, Field(le=1000.0)]],
    holds(lambda w: w[0] < w[1], "[shortest, longest]: the second must be larger than the first"),
]


class Irregular(Definition):
    """What every irregularity answers; none can be defined without."""

    type: str

    @abstractmethod
    def mirrored(self) -> Self:
        """Return the mirror image: left and right exchanged."""

    @abstractmethod
    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends on a track whose plan has some length [m]."""

    @abstractmethod
    def resolution(self) -> float:
        """Return the length that tables must resolve, a sixteenth of its shortest wave [m]."""

    def sets_wheels_ringing(self) -> bool:
        """Return whether it may set wheels ringing on rigid rails: by ends, or waves below 3 m."""
        return True

    @abstractmethod
    def summary(self) -> str:
        """Return what it is in a few words."""

    @abstractmethod
    def displacement(self, length: float) -> Displacement:
        """Return how it moves the rails of a track whose plan has some length [m]."""


class Stretch(Irregular):
    """An irregularity from `begin` to `end`, by default the end of the plan."""

    if TYPE_CHECKING:  # the fields of its types
        begin: float
        end: float | None

    @check
    def _has_a_length(self) -> None:
        if self.end is not None and self.end <= self.begin:
            raise ValueError("'end' must lie behind 'begin'")

    def extent(self, length: float) -> tuple[float, float]:
        """Return where it begins and ends [m]."""
        return self.begin, length if self.end is None else self.end


def rails_moved(channel: Channel) -> Floats:
    """Rails moved by one metre of a channel, the cross level a difference of heights; a column."""
    # each rail has half of the difference
    return np.array(SHARES[channel])[:, None] * (0.5 if channel == "cross_level" else 1.0)


def faded(displacement: Displacement, begin: float, end: float, fade: float) -> Displacement:
    """Return a displacement that rises behind `begin` and falls before `end` over `fade` [m]."""
    length = min(fade, 0.5 * (end - begin))

    def window(s: Floats) -> tuple[Floats, Floats]:
        inside = ((s >= begin) & (s < end)).astype(float)
        if length == 0.0:
            return inside, np.zeros_like(s)
        angle = np.pi * np.clip(np.minimum(s - begin, end - s) / length, 0.0, 1.0)
        side = np.where(s - begin < end - s, 1.0, -1.0)
        rate = side * 0.5 * np.pi / length * np.sin(angle)
        return inside * 0.5 * (1.0 - np.cos(angle)), inside * rate

    def within(s: Floats) -> tuple[Floats, Floats]:
        (value, rate), (share, slope) = displacement(s), window(s)
        return share * value, share * rate + slope * value

    return within
