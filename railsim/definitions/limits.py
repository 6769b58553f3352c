"""Limit files: what a standard asks for, each value with its source.

`railsim-limits/1` holds the limits of running tests, `railsim-comfort-limits/1` those of comfort,
`railsim-stationary-limits/1` those of stationary tests.

A value is `checked` when somebody has compared it with the printed standard; until then every page
that uses it says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.own_sections import SHORTEST
from railsim.definitions.vehicle.bogies import bogie_mass
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Service

Rows = base.RisingRows[base.Positive, base.Positive]
SectionLength = Annotated[float, Field(strict=True, ge=SHORTEST)]
Probability = Annotated[float, Field(strict=True, ge=0.5, lt=1.0)]
ZoneName = Annotated[str, Field(pattern="^[1-4]$")]


def up_to(rows: Sequence[tuple[float, float]], speed: float, above: float) -> float:
    """Value of the first row [speed up to m/s, value] that holds at a speed; `above` beyond.

    Files round the speeds of standards: 220 km/h is 61.1111 m/s there, which is less.

    >>> up_to([(61.1111, 250.0)], 220.0 / 3.6, 500.0), up_to([(61.1111, 250.0)], 61.2, 500.0)
    (250.0, 500.0)
    """
    return next((value for most, value in rows if speed <= most * (1.0 + 1e-3)), above)


class Sourced(base.Definition):
    """A value of a standard with where it comes from."""

    source: base.Text
    """Where the value was found"""
    edition: base.Text | None = None
    """Edition of the standard, where it is not that of the file"""
    checked: base.Flag = False
    """Whether somebody has compared it with the printed standard"""


class Value(Sourced):
    """One number."""

    value: base.Positive
    """Limit [SI]"""


@dataclass(frozen=True)
class Situation:
    """What a limit may depend on: one wheelset, wheel or sensor in one zone."""

    vehicle: Vehicle
    service: Service
    zone: str  # 1 to 4
    radius: float  # mean radius of the sections [m]
    wheelset: int | None  # from 0; None for what belongs to none
    Q0: float  # mean static load of its two wheels [N]
    limits: "Mapping[str, LimitLaw]"  # all limits of the file


class Constant(Value):
    """A limit that is one number."""

    law: Literal["constant"]
    """The same everywhere"""

    def at(self, _: Situation) -> float:
        """Return the limit [SI]."""
        return self.value


class ByZone(Sourced):
    """A limit for each test zone."""

    law: Literal["by_zone"]
    """One number for each zone"""
    values: tuple[base.Positive, base.Positive, base.Positive, base.Positive]
    """Limits in the zones 1 to 4 [SI]"""

    def at(self, situation: Situation) -> float:
        """Return the limit [SI]."""
        return self.values[int(situation.zone) - 1]


class ByAxleLoad(Sourced):
    """k1 (constant + factor Q0), as of the track shift force."""

    law: Literal["by_axle_load"]
    """k1 (constant + factor Q0)"""
    constant: base.NonNegative
    """[N]"""
    factor: base.Positive
    """Of the static wheel load Q0 [1]"""
    k1: dict[base.Text, base.Positive] = Field(min_length=1)
    """Factor by category of the vehicle [1]"""

    def at(self, situation: Situation) -> float:
        """Return the limit [N]."""
        return self.k1[situation.service.category] * (self.constant + self.factor * situation.Q0)


class ByWheelLoad(Sourced):
    """Constant + Q0, at most a value that falls with the speed."""

    law: Literal["by_wheel_load"]
    """Constant + Q0, at most a value by speed"""
    constant: base.NonNegative
    """[N]"""
    by_speed: Rows
    """Rows [admissible speed up to m/s, N]"""
    above: base.Positive
    """Beyond the last row [N]"""

    def at(self, situation: Situation) -> float:
        """Return the limit [N]."""
        speed = situation.service.admissible_speed
        return min(self.constant + situation.Q0, up_to(self.by_speed, speed, self.above))


class ByRadius(Sourced):
    """Constant + numerator / mean radius, as of the quasi-static guiding force."""

    law: Literal["by_radius"]
    """Constant + numerator / mean radius"""
    constant: base.NonNegative
    """[N]"""
    numerator: base.NonNegative
    """[N m]"""

    def at(self, situation: Situation) -> float:
        """Return the limit [N]."""
        return self.constant + self.numerator / situation.radius


class ByBogieMass(Sourced):
    """Constant - slope m, as of the acceleration of the bogie frame."""

    law: Literal["by_bogie_mass"]
    """Constant - slope m"""
    constant: base.Positive
    """[m/s2]"""
    slope: base.NonNegative
    """Per mass of the bogie [m/s2/kg]"""

    def at(self, situation: Situation) -> float:
        """Return the limit [m/s2]."""
        flat = flatten(situation.vehicle)
        wheelset = flat.of_kind("wheelset")[situation.wheelset or 0]
        return self.constant - self.slope * bogie_mass(flat, wheelset)


class Share(Sourced):
    """A share of another limit."""

    law: Literal["share"]
    """A share of another limit"""
    value: base.Positive
    """[1]"""
    of: base.Text
    """Name of the other limit"""

    def at(self, situation: Situation) -> float:
        """Return the limit [SI]."""
        return self.value * situation.limits[self.of].at(situation)


LimitLaw = Annotated[
    Constant | ByZone | ByAxleLoad | ByWheelLoad | ByRadius | ByBogieMass | Share,
    Field(discriminator="law"),
]


class HighFriction(Sourced):
    """Correction of the quasi-static guiding force for high friction, slope (Y/Q - threshold)."""

    threshold: base.Positive
    """Y/Q of the inner wheel [1]"""
    slope: base.Positive
    """[N]"""


class Zone(Sourced):
    """A test zone."""

    radius: tuple[base.Positive, Annotated[float, Field(strict=True, gt=0)]] | None = None
    """Smallest and largest radius [m]; without it straight track"""
    mean_radius: tuple[base.Positive, base.Positive] | None = None
    """Range of the mean radius of all sections [m]"""
    cant_deficiency: tuple[base.NonNegative, base.Positive]
    """Range, of the admissible one [1]; on straight track [m]"""
    speed: tuple[base.Positive, base.Positive] | None = None
    """Range, of the admissible speed [1]"""
    section: base.RisingRows[base.Positive, SectionLength]
    """Rows [speed up to m/s, length of a section m]"""
    section_above: SectionLength
    """Length of a section beyond the last row [m]"""
    sections: base.Count
    """Least number of sections"""

    @base.check
    def _ordered(self) -> None:
        for name in ("radius", "mean_radius", "cant_deficiency", "speed"):
            ends = getattr(self, name)
            if ends is not None and ends[1] <= ends[0]:
                raise ValueError(f"'{name}' is [smallest, largest]")


class Factors(base.Definition):
    """A factor of the statistics for each class of quantities."""

    safety: base.NonNegative
    """Running safety"""
    loading: base.NonNegative
    """Track loading"""
    ride: base.NonNegative
    """Ride characteristics"""
    quasi_static: base.NonNegative
    """Quasi-static values"""


class Probabilities(base.Definition):
    """A probability for each class of quantities."""

    safety: Probability
    """Running safety"""
    loading: Probability
    """Track loading"""
    ride: Probability
    """Ride characteristics"""
    quasi_static: Probability
    """Quasi-static values"""


class Statistics(Sourced):
    """Factors of the statistics."""

    k: Factors
    """Factors of the standard deviation, one-dimensional [1]"""
    probability: Probabilities
    """Probabilities of the upper bound, two-dimensional [1]"""


class ConicityClasses(Sourced):
    """Equivalent conicity of the wheelsets on the test track, amplitude 3 mm."""

    low: base.Positive
    """Some sections of zone 1 have this one at most [1]"""
    high: Rows
    """Rows [admissible speed up to m/s, some sections have this one at least]"""
    high_above: base.Positive
    """Beyond the last row [1]"""


class TrackTarget(Sourced):
    """Target of the track's quality: 90 % values of the standard deviations in D1."""

    rows: Annotated[
        tuple[
            tuple[base.Positive, base.Positive, base.Positive, base.Positive, base.Positive], ...
        ],
        Field(min_length=1),
        base.rises("first column"),
    ]
    """Rows [speed up to m/s, smallest and largest of alignment m, smallest and largest of level
    m]"""

    def ends(self, speed: float) -> tuple[float, float, float, float]:
        """Return smallest and largest alignment and level for a speed [m]."""
        row = next((row for row in self.rows if speed <= row[0] * (1.0 + 1e-3)), self.rows[-1])
        return row[1:]

    def middle(self, speed: float) -> tuple[float, float]:
        """Return the middle of alignment and of level for a speed [m]."""
        low_y, high_y, low_z, high_z = self.ends(speed)
        return 0.5 * (low_y + high_y), 0.5 * (low_z + high_z)


Criteria = Literal["safety", "loading", "ride"]


class RunningLimits(FileDefinition):
    """Limits of running tests: EN 14363 or UIC 518."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-limits/1"]
    standard: Literal["en14363", "uic518"]
    """Which evaluation it belongs to"""
    edition: base.Text
    """Edition of the standard"""
    deciding: tuple[Criteria, ...] = Field(("safety", "loading"), min_length=1)
    """Verdicts that decide; the others are for information"""
    zones: dict[ZoneName, Zone] = Field(min_length=1)
    """Test zones 1 to 4"""
    conicity: ConicityClasses | None = None
    """Low and high conicity in zone 1"""
    track_quality: TrackTarget | None = None
    """Quality of the track in each zone"""
    friction: Value | None = None
    """Least coefficient of friction of the rails"""
    gauge: Value | None = None
    """Nominal gauge of the tracks for which the limits hold [m]"""
    statistics: Statistics
    """Factors of the statistics"""
    high_friction: HighFriction | None = None
    """Correction of the quasi-static guiding force"""
    limits: dict[base.Text, LimitLaw] = Field(min_length=1)
    """Limits by the names of the assessed quantities"""

    @base.check
    def _shares_of_others(self) -> None:
        for name, limit in self.limits.items():
            other = self.limits.get(limit.of) if isinstance(limit, Share) else None
            if isinstance(limit, Share) and (other is None or isinstance(other, Share)):
                raise ValueError(f"limit '{name}' is a share of '{limit.of}', which is none itself")


class Classes(Sourced):
    """Upper ends of classes."""

    values: tuple[tuple[base.Finite, base.Text], ...] = Field(min_length=1)
    """Rows [below, what it is called]; beyond the last: `above`"""
    above: base.Text
    """Name of the last class"""


class ComfortLimits(FileDefinition):
    """Classes of ride comfort."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-comfort-limits/1"]
    edition: base.Text
    """Edition of the standard"""
    mean_comfort: Classes
    """N_MV, N_VA, N_VD"""
    continuous: Classes
    """Continuous comfort along y and z [m/s2]"""


class Twist(Sourced):
    """Twist of the track over a length: constant + numerator / length, at most `greatest`."""

    constant: base.NonNegative
    """[1]"""
    numerator: base.Finite
    """[m]"""
    greatest: base.Positive
    """[1]"""

    def over(self, length: float) -> float:
        """Return the twist over a length [1]."""
        return max(0.0, min(self.constant + self.numerator / length, self.greatest))


class Guiding(Value):
    """Guiding force in a tight level curve over the smallest wheel load on twisted track."""

    radius: base.Positive
    """Radius of the curve [m]"""


class StationaryLimits(FileDefinition):
    """Stationary tests: twisted track, cant; and a tight curve at walking pace."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-stationary-limits/1"]
    edition: base.Text
    """Edition of the standards"""
    unloading: Value
    """(Q0 - Q)/Q0 of the least loaded wheel on twisted track"""
    bogie_twist: Twist
    """Twist of the track over the wheelbase of a bogie"""
    body_twist: Twist
    """Twist of the track over the spacing of bogies, or of the axles of a vehicle without"""
    guiding: Guiding
    """Y/Q of the leading outer wheel: force in the level curve over the least load on the twists,
    and both in the twisted curve"""
    lean_unloading: Value
    """(Q0 - Q)/Q0 of the least loaded wheel on a cant equal to the admissible cant deficiency"""
    lean_angle: Value
    """Angle of the floor from horizontal on it [rad]"""
    gauge: Value | None = None
    """Nominal gauge of the tracks for which the limits hold [m]"""


class Difference(Sourced):
    """Limit of the standard deviation of simulated less measured values: constant + factor Q0."""

    constant: base.Positive
    """[SI]"""
    factor: base.NonNegative = 0.0
    """Of the static wheel load [1]"""

    def at(self, Q0: float) -> float:
        """Return the limit for a static wheel load [N]."""
        return self.constant + self.factor * Q0


class ValidationLimits(FileDefinition):
    """How well a model must match a test."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-validation-limits/1"]
    edition: base.Text
    """Edition of the standard"""
    sections: base.Count
    """Least number of sections"""
    mean: Annotated[base.Finite, Field(gt=0, le=1)]
    """Limit of the mean difference over that of the standard deviation"""
    limits: dict[base.Text, Difference] = Field(min_length=1)
    """Limits of the standard deviation by the names of the compared quantities"""


class WheelLimits(FileDefinition):
    """Dimensions at which a worn wheel goes out of service."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-wheel-limits/1"]
    edition: base.Text
    """Edition of the standard"""
    flange_thickness: Value
    """Sd, smallest [m]"""
    flange_height: Value
    """Sh, largest [m]"""
    flange_slope: Value
    """qR, smallest [m]"""
    hollow: Value
    """Of the tread, largest [m]"""

    def reached(self, dimensions: Mapping[str, float]) -> str:
        """Return which limits are reached, in words; empty for none."""
        texts = []
        for name, value in dimensions.items():
            limit = getattr(self, name).value
            largest = name in ("flange_height", "hollow")
            if (value >= limit) if largest else (value <= limit):
                texts.append(
                    f"{name.replace('_', ' ')} {1e3 * value:.1f} mm, limit {1e3 * limit:g}"
                )
        return "; ".join(texts)
