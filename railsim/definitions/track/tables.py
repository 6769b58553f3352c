"""Track files, `railsim-track/1`: plan, cant, vertical profile, rails, friction, irregularities.

Plan, cant and vertical profile are lists of elements, one behind the other, each with its length.
A transition (CLO, LIR) takes its ends from its neighbours where it does not name them.  Curvature,
cant and gradient are piecewise linear in the arc length and rounded over `rounding`.
"""

from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field

from railsim.definitions.base import (
    SIDED_ROWS,
    Definition,
    Finite,
    Flag,
    Name,
    NonNegative,
    NonNegativePair,
    Speed,
    Text,
    TextPair,
    both_sides,
    one_or_two,
    pair,
    rises,
)
from railsim.definitions.excitations import Irregularity
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.track.check_rail import MOST_CHECK_RAILS, CheckRail
from railsim.definitions.track.rail_sections import MOST_RANGES, RailSections
from railsim.definitions.track.support import Support
from railsim.definitions.vehicle.laws import Law

ArcLength = TypeVar("ArcLength", float, Any)
MOST_ELEMENTS, MOST_IRREGULARITIES = 5000, 1000


def _curved(radius: float) -> float:
    if not abs(radius) >= 5.0:
        raise ValueError("a radius is 5 m at least, negative in a left-hand curve, inf if straight")
    return radius


def _softer_in_slip(factors: tuple[float, float]) -> tuple[float, float]:
    if factors[1] > factors[0]:
        raise ValueError("the factor of the slip area is at most that of the adhesion area")
    return factors


Widening = Annotated[Finite, Field(ge=-0.05, le=0.1)]
FrictionRows = Annotated[
    tuple[tuple[Finite, NonNegative, NonNegative], ...],
    Field(min_length=1),
    rises("arc length"),
    both_sides(),
    SIDED_ROWS,
]
Share = Annotated[Finite, Field(gt=0, le=1)]
ThirdBody = Annotated[
    tuple[Share, Share],
    AfterValidator(_softer_in_slip),
    BeforeValidator(pair),
    one_or_two({"type": "number", "exclusiveMinimum": 0, "maximum": 1}),
]
WideningRows = Annotated[
    tuple[tuple[Finite, Widening, Widening], ...],
    Field(min_length=1),
    rises("arc length"),
    both_sides(0.5),
    SIDED_ROWS,
]
Radius = Annotated[float, Field(strict=True), AfterValidator(_curved)]
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

    @property
    def is_ramp(self) -> bool:
        """Whether its ends may differ."""
        return len(self.KEYS) == 2

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


class FallingFriction(Definition):
    """Friction that falls with the slip velocity w of a contact patch (Polach 2005).

    mu(w) = mu ((1 - rest) exp(-decay w) + rest)
    """

    rest: Share
    """Friction at very large slip over that without slip [1]"""
    decay: NonNegative
    """How fast it falls with the slip velocity [s/m]"""


class TrackTables(FileDefinition):
    """Everything that the file of a track says."""

    format: Literal["railsim-track/1"]
    name: Text
    """What the track is called in tables and plots"""
    source: Text | None = None
    """Where the numbers come from"""
    speed: Speed | None = None
    """Highest speed permitted on the track [m/s]: remarks on the alignment refer to it, and the
    speed `permitted` of a study"""
    mileage: Finite = 0.0
    """Mileage of s = 0 [m]; results hold the mileage of the reference body"""
    falling_mileage: Flag = False
    """The mileage falls in the direction of travel"""
    gauge: Annotated[Finite, Field(ge=0.3, le=2.5)] = 1.435
    """Distance between the gauge faces, 14 mm below the rail tops [m]"""
    rail: TextPair = ("60E1", "60E1")
    """Rail profile, a built-in name or a file, or [left, right]"""
    inclination: Annotated[Finite, Field(ge=0, le=0.2)] = 0.025
    """Inclination of the rails towards the track's middle, 0.025 = 1:40 [1]"""
    friction: NonNegativePair = (0.4, 0.4)
    """Coefficient of friction, one number, or left and right [1]"""
    friction_table: FrictionRows | None = None
    """Rows [s, mu] or [s, left, right] instead of `friction`, linear in between [m, 1]"""
    friction_falling: FallingFriction | None = None
    """How friction falls with the slip velocity; by default it does not"""
    third_body: ThirdBody = (1.0, 1.0)
    """Factor of Kalker's coefficients by a layer of dirt or water, one number or [adhesion, slip]:
    the second, for the slip area, is for the creep law `polach` only [1]"""
    gauge_widening: WideningRows | None = None
    """Rows [s, widening] or [s, left, right], linear in between and rounded as the plan [m]: by how
    much each rail stands further out than the gauge says, one number being shared by both rails"""
    rounding: Annotated[Finite, Field(ge=0.1, le=200)] = 10.0
    """Length over which kinks of curvature, cant and gradient are rounded (box filter) [m]"""
    cant_rotation: Literal["centre", "inner_rail"] = "centre"
    """Cant turns the track about its centre line, or about the inner (lower) rail"""
    plan: tuple[PlanElement, ...] = Field(min_length=1, max_length=MOST_ELEMENTS)
    """Elements of the plan, from s = 0 on; the first and the last continue beyond the ends"""
    cant: tuple[CantElement, ...] = Field(default=(), max_length=MOST_ELEMENTS)
    """Elements of the cant; where shorter than the plan, the last value continues"""
    vertical: tuple[VerticalElement, ...] = Field(default=(), max_length=MOST_ELEMENTS)
    """Elements of the vertical profile; where shorter than the plan, the last gradient continues"""

    irregularities: tuple[Irregularity, ...] = Field(default=(), max_length=MOST_IRREGULARITIES)
    """Displacements of the rails from their ideal positions; they add up"""
    laws: dict[Name, Law] | None = None
    """Laws of one's own by name: Python functions, executed by permission alone"""
    sections: tuple[RailSections, ...] = Field(default=(), max_length=MOST_RANGES)
    """Ranges in which the section of a rail changes, such as crossings"""
    check_rail: tuple[CheckRail, ...] = Field(default=(), max_length=MOST_CHECK_RAILS)
    """Check rails and guard rails"""
    support: Support = Support()
    """What carries the rails: rigid, or elastic as a moving track model"""

    @property
    def length(self) -> float:
        """Length of the plan [m]."""
        return sum(element.length for element in self.plan)

    def mileage_at(self, s: "ArcLength") -> "ArcLength":
        """Mileage at an arc length, or at an array of them [m]."""
        return self.mileage - s if self.falling_mileage else self.mileage + s
