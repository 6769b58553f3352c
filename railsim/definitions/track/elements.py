"""Elements of the plan, the cant and the vertical profile: of a track file, and over arc length."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from railsim.definitions.base import Definition, Finite, holds

CURVED = "a radius is 5 m at least, negative in a left-hand curve, inf if straight"
Radius = Annotated[float, Field(strict=True), holds(lambda radius: abs(radius) >= 5.0, CURVED)]
Length = Annotated[Finite, Field(gt=0, le=1e7)]
Cant = Annotated[Finite, Field(ge=-0.5, le=0.5)]
Gradient = Annotated[Finite, Field(ge=-0.3, le=0.3)]


class TrackElement(Definition):
    """An element of plan, cant or vertical profile, constant or linear in the arc length."""

    KEYS: ClassVar[tuple[str, ...]] = ()
    """Keys of its value at the beginning and at the end, one key of a constant."""
    TURNS: ClassVar[bool] = True
    """Whether the mirror image of the track has the opposite values."""

    type: str
    length: Length
    """Length along the centre line [m]"""

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Curvature [1/m], cant [m] or gradient [1] at its ends; None is that of the neighbour."""
        if not self.KEYS:
            return 0.0, 0.0
        values = [getattr(self, key) for key in self.KEYS]
        if "radius" in self.KEYS[0]:
            values = [None if radius is None else 1.0 / radius for radius in values]
        return values[0], values[-1]

    def mirrored(self) -> Self:
        """Return the element with left and right exchanged."""
        values = {key: getattr(self, key) for key in self.KEYS if self.TURNS}
        update = {key: -value for key, value in values.items() if value is not None}
        return self.model_copy(update=update)


class Straight(TrackElement):
    """A straight."""

    type: Literal["STR"]


class Circle(TrackElement):
    """A circular curve."""

    KEYS: ClassVar = ("radius",)
    type: Literal["CIR"]
    radius: Radius
    """Radius, positive to the right [m]"""


class Clothoid(TrackElement):
    """A transition with curvature linear in the arc length."""

    KEYS: ClassVar = ("radius_start", "radius_end")
    type: Literal["CLO"]
    radius_start: Radius | None = None
    """Radius at its beginning, `inf` if straight [m]; by default that of the element before"""
    radius_end: Radius | None = None
    """Radius at its end [m]; by default that of the following element"""


class ConstantCant(TrackElement):
    """Constant cant."""

    KEYS: ClassVar = ("cant",)
    type: Literal["CST"]
    cant: Cant
    """Height of the left rail over the right one, on the cant base of 1.5 m [m]"""


class CantRamp(TrackElement):
    """A ramp with cant linear in the arc length."""

    KEYS: ClassVar = ("cant_start", "cant_end")
    type: Literal["LIR"]
    cant_start: Cant | None = None
    """Cant at its beginning [m]; by default that of the element before"""
    cant_end: Cant | None = None
    """Cant at its end [m]; by default that of the following element"""


class ConstantGradient(TrackElement):
    """Constant gradient."""

    KEYS: ClassVar = ("gradient",)
    TURNS: ClassVar = False
    type: Literal["CST"]
    gradient: Gradient
    """Rise over horizontal distance, positive uphill [1]"""


class GradientRamp(TrackElement):
    """A vertical curve: gradient linear in the arc length, radius = length / change of gradient."""

    KEYS: ClassVar = ("gradient_start", "gradient_end")
    TURNS: ClassVar = False
    type: Literal["LIR"]
    gradient_start: Gradient | None = None
    """Gradient at its beginning [1]; by default that of the element before"""
    gradient_end: Gradient | None = None
    """Gradient at its end [1]; by default that of the following element"""


PlanElement = Annotated[Straight | Clothoid | Circle, Field(discriminator="type")]
CantElement = Annotated[ConstantCant | CantRamp, Field(discriminator="type")]
VerticalElement = Annotated[ConstantGradient | GradientRamp, Field(discriminator="type")]


@dataclass(frozen=True)
class Section:
    """One element of a list with its values at both ends: curvature, cant or gradient."""

    key: str  # in the file, e.g. ``plan.2``
    type: str  # as written; a circle of infinite radius is STR
    begin: float  # arc length [m]
    end: float  # arc length [m]
    start_value: float  # [1/m], [m] or [1]
    end_value: float

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.end - self.begin

    @property
    def slope(self) -> float:
        """Change of the value per metre."""
        return (self.end_value - self.start_value) / self.length

    def value(self, s: float) -> float:
        """Value at the arc length `s` within the section."""
        return self.start_value + self.slope * (s - self.begin)


def joined(sections: Sequence[Section]) -> list[Section]:
    """Return the sections with ramps that go on, but not from zero on, as one with its first key.

    So one writes curvature or cant that is no straight line, such as a half-wave.
    """
    merged: list[Section] = []
    for section in sections:
        before = merged[-1] if merged else section
        goes_on = before.slope * section.slope > 0.0 and abs(section.start_value) > 1e-9
        if merged and goes_on and math.isclose(before.end_value, section.start_value, rel_tol=1e-6):
            merged[-1] = replace(before, end=section.end, end_value=section.end_value)
        else:
            merged.append(section)
    return merged
