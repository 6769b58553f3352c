"""Limit files: what a standard asks for, each value with its source.

`railsim-limits/1` holds the limits of running tests, `railsim-comfort-limits/1` those of comfort,
`railsim-stationary-limits/1` those of stationary tests.

A value is `checked` when somebody has compared it with the printed standard; until then every page
that uses it says so.
"""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from railsim.definitions.base import (
    Count,
    Definition,
    Finite,
    Flag,
    NonNegative,
    Positive,
    Text,
    rising,
)
from railsim.definitions.file_definition import FileDefinition

COMFORT_LIMITS_FORMAT = "railsim-comfort-limits/1"


def _rising_rows(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    if not rising(rows):
        raise ValueError("the first column must increase from row to row")
    return rows


Rows = Annotated[
    tuple[tuple[Positive, Positive], ...], Field(min_length=1), AfterValidator(_rising_rows)
]
Probability = Annotated[float, Field(strict=True, ge=0.5, lt=1.0)]
ZoneName = Annotated[str, Field(pattern="^[1-4]$")]


class Sourced(Definition):
    """A value of a standard with where it comes from."""

    source: Text
    """Where the value was found"""
    edition: Text | None = None
    """Edition of the standard, where it is not that of the file"""
    checked: Flag = False
    """Whether somebody has compared it with the printed standard"""


class Constant(Sourced):
    """A limit that is one number."""

    value: Positive
    """Limit [SI]"""


class ByZone(Sourced):
    """A limit for each test zone."""

    values: tuple[Positive, Positive, Positive, Positive]
    """Limits in the zones 1 to 4 [SI]"""


class ByAxleLoad(Sourced):
    """Track shift force: k1 (constant + factor Q0)."""

    constant: NonNegative
    """[N]"""
    factor: Positive
    """Of the static wheel load Q0 [1]"""
    k1: dict[Text, Positive] = Field(min_length=1)
    """Factor by category of the vehicle [1]"""


class WheelLoad(Sourced):
    """Wheel load: constant + Q0, at most a value that falls with the speed."""

    constant: NonNegative
    """[N]"""
    by_speed: Rows
    """Rows [admissible speed up to m/s, N]"""
    above: Positive
    """Beyond the last row [N]"""


class ByRadius(Sourced):
    """Quasi-static guiding force: constant + numerator / mean radius."""

    constant: NonNegative
    """[N]"""
    numerator: NonNegative
    """[N m]"""


class HighFriction(Sourced):
    """Correction of the quasi-static guiding force for high friction, slope (Y/Q - threshold)."""

    threshold: Positive
    """Y/Q of the inner wheel [1]"""
    slope: Positive
    """[N]"""


class ByBogieMass(Sourced):
    """Acceleration of the bogie frame: constant - slope m."""

    constant: Positive
    """[m/s2]"""
    slope: NonNegative
    """Per mass of the bogie [m/s2/kg]"""


class Share(Sourced):
    """A share of another limit."""

    value: Positive
    """[1]"""


class Zone(Sourced):
    """A test zone."""

    radius: tuple[Positive, Annotated[float, Field(strict=True, gt=0)]] | None = None
    """Smallest and largest radius [m]; without it straight track"""
    mean_radius: tuple[Positive, Positive] | None = None
    """Range of the mean radius of all sections [m]"""
    cant_deficiency: tuple[NonNegative, Positive]
    """Range, of the admissible one [1]; on straight track [m]"""
    speed: tuple[Positive, Positive] | None = None
    """Range, of the admissible speed [1]"""
    section: Rows
    """Rows [speed up to m/s, length of a section m]"""
    section_above: Positive
    """Length of a section beyond the last row [m]"""
    sections: Count
    """Least number of sections"""

    @model_validator(mode="after")
    def _ordered(self) -> "Zone":
        for name in ("radius", "mean_radius", "cant_deficiency", "speed"):
            ends = getattr(self, name)
            if ends is not None and ends[1] <= ends[0]:
                raise ValueError(f"'{name}' is [smallest, largest]")
        return self


class Factors(Definition):
    """A factor of the statistics for each class of quantities."""

    safety: NonNegative
    """Running safety"""
    loading: NonNegative
    """Track loading"""
    ride: NonNegative
    """Ride characteristics"""
    quasi_static: NonNegative
    """Quasi-static values"""


class Probabilities(Definition):
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

    low: Positive
    """Some sections of zone 1 have this one at most [1]"""
    high: Rows
    """Rows [admissible speed up to m/s, some sections have this one at least]"""
    high_above: Positive
    """Beyond the last row [1]"""


class TrackTarget(Sourced):
    """Target of the track's quality: 90 % values of the standard deviations in D1."""

    rows: Annotated[
        tuple[tuple[Positive, Positive, Positive, Positive, Positive], ...],
        Field(min_length=1),
        AfterValidator(_rising_rows),
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
    """Kind and version of the file"""
    standard: Literal["en14363", "uic518"]
    """Which evaluation it belongs to"""
    edition: Text
    """Edition of the standard"""
    deciding: tuple[Criteria, ...] = ("safety", "loading")
    """Verdicts that decide; the others are for information"""
    zones: dict[ZoneName, Zone] = Field(min_length=1)
    """Test zones 1 to 4"""
    conicity: ConicityClasses | None = None
    """Low and high conicity in zone 1"""
    track_quality: TrackTarget | None = None
    """Quality of the track in each zone"""
    friction: Constant | None = None
    """Least coefficient of friction of the rails"""
    statistics: Statistics
    """Factors of the statistics"""
    sum_Y: ByAxleLoad
    """Track shift force, 2 m mean"""
    Y_over_Q: Constant
    """Derailment quotient, 2 m mean"""
    Q: WheelLoad
    """Wheel load"""
    Q_qst: Constant
    """Quasi-static wheel load"""
    Y_qst: ByRadius
    """Quasi-static guiding force"""
    high_friction: HighFriction | None = None
    """Correction of the quasi-static guiding force"""
    body_y_safety: ByZone
    """Lateral acceleration of the body, simplified method"""
    body_z_safety: ByZone
    """Vertical acceleration of the body, simplified method"""
    frame_y: ByBogieMass
    """Lateral acceleration of the bogie frame, simplified method"""
    body_y: Constant
    """Lateral acceleration of the body, ride"""
    body_z: Constant
    """Vertical acceleration of the body, ride"""
    body_y_rms: Constant
    """Lateral acceleration of the body, root mean square"""
    body_z_rms: Constant
    """Vertical acceleration of the body, root mean square"""
    body_y_qst: Constant
    """Quasi-static lateral acceleration of the body"""
    instability: Share
    """Root mean square over the limit of the track shift force or frame acceleration"""


class Classes(Sourced):
    """Upper ends of classes."""

    values: tuple[tuple[Finite, Text], ...] = Field(min_length=1)
    """Rows [below, what it is called]; beyond the last: `above`"""
    above: Text
    """Name of the last class"""


class ComfortLimits(FileDefinition):
    """Classes of ride comfort."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-comfort-limits/1"]
    """Kind and version of the file"""
    edition: Text
    """Edition of the standard"""
    mean_comfort: Classes
    """N_MV, N_VA, N_VD"""
    continuous: Classes
    """Continuous comfort along y and z [m/s2]"""


class Twist(Sourced):
    """Twist of the track over a length: constant + numerator / length, at most `greatest`."""

    constant: NonNegative
    """[1]"""
    numerator: Finite
    """[m]"""
    greatest: Positive
    """[1]"""

    def over(self, length: float) -> float:
        """Return the twist over a length [1]."""
        return max(0.0, min(self.constant + self.numerator / length, self.greatest))


class Guiding(Sourced):
    """Guiding force in a tight level curve over the smallest wheel load on twisted track."""

    value: Positive
    """Y/Q [1]"""
    radius: Positive
    """Radius of the curve [m]"""


class StationaryLimits(FileDefinition):
    """Stationary tests: twisted track, cant; and a tight curve at walking pace."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-stationary-limits/1"]
    """Kind and version of the file"""
    edition: Text
    """Edition of the standards"""
    unloading: Constant
    """(Q0 - Q)/Q0 of the least loaded wheel on twisted track"""
    bogie_twist: Twist
    """Twist of the track over the wheelbase of a bogie"""
    body_twist: Twist
    """Twist of the track over the spacing of bogies, or of the axles of a vehicle without"""
    guiding: Guiding
    """Y/Q of the leading outer wheel: force in the level curve over the least load on the twists,
    and both in the twisted curve"""
    lean_unloading: Constant
    """(Q0 - Q)/Q0 of the least loaded wheel on a cant equal to the admissible cant deficiency"""
    lean_angle: Constant
    """Angle of the floor from horizontal on it [rad]"""
