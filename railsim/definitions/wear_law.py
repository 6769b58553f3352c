"""Files of a law of wear, `railsim-wear-law/1`: constants of the user's own, with their source."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import Definition, NonNegative, Positive, Text, check
from railsim.definitions.file_definition import FileDefinition


class ArchardMap(Definition):
    """Archard's law with coefficients by sliding speed and pressure, as in KTH's map."""

    hardness: Positive
    """Hardness of the softer material [Pa]"""
    pressure: Positive
    """Largest pressure over the hardness above which `seizure` holds at every speed [1]"""
    speeds: tuple[Positive, Positive]
    """Sliding speeds between `slow`, `medium` and `fast` [m/s]"""
    slow: NonNegative
    """Coefficient of wear below the first speed [1]"""
    medium: NonNegative
    """Between the speeds [1]"""
    fast: NonNegative
    """Above the second speed [1]"""
    seizure: NonNegative
    """Above the pressure [1]"""


class FrictionWork(Definition):
    """Wear in proportion to the work of friction, mild or severe (Krause and Poll 1986)."""

    mild: NonNegative
    """Mass worn per work [kg/J]"""
    severe: NonNegative
    """The same above `transition` [kg/J]"""
    transition: Positive
    """Power of friction over the area of the patch [W/m2]"""


class RailFatigue(Definition):
    """Parameters of the Whole Life Rail Model."""

    threshold: Annotated[Positive, Field(lt=65)] = 15.0
    """Wear number below which there is no damage; 15 or 20 in use [N]"""
    counted: Literal["against", "along", "all"] = "against"
    """Which patches count: by the direction of their force on the rail, against or along travel"""


class WearLawFile(FileDefinition):
    """A law of wear, with constants of the user's own, and parameters of the damage of the rail."""

    KIND: ClassVar = "limits"

    format: Literal["railsim-wear-law/1"]
    name: Text
    """How tables call it"""
    source: Text
    """Where the constants are from"""
    archard: ArchardMap | None = None
    """Archard with a map of coefficients"""
    krause_poll: FrictionWork | None = None
    """Work of friction, mild and severe"""
    whole_life_rail_model: RailFatigue | None = None
    """Damage of the rail; alone, the laws of wear stay as without a file"""

    @check
    def _one_law(self) -> None:
        given = (self.archard is not None) + (self.krause_poll is not None)
        if given > 1 or not (given or self.whole_life_rail_model):
            raise ValueError("give one of the tables archard and krause_poll")
        if self.archard is not None and self.archard.speeds[0] >= self.archard.speeds[1]:
            raise ValueError("archard.speeds must increase")
