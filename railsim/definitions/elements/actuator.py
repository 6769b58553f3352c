"""Forces that follow a command or a user-defined law."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field

from railsim.definitions.base import EMPTY_TABLE, Finite, Flag, Name, NonNegative, Positive, check
from railsim.definitions.elements.base import PointElement, Signs
from railsim.definitions.elements.rows import AXES, Act

Action = Literal["line", "x", "y", "z", "roll", "pitch", "yaw", "axle"]


class CommandedElement(PointElement):
    """An element that acts along a line, along an axis of body 1 or about one, or about an axle."""

    acts: Action = "line"
    """Along the `line` between the points, along `x`, `y`, `z` of body 1, or as a moment about them
    (`roll`, `pitch`, `yaw`); positive: tension, body 1 pushed along the axis, body 2 against it;
    `axle`: a torque on the wheelset, body 2, forwards positive, without points"""
    lag: NonNegative = 0.0
    """Time constant of the first-order lag between command and effect [s]"""
    delay: Annotated[NonNegative, Field(le=100.0)] = 0.0
    """Time after which a command arrives [s]"""
    rate_limit: Positive | None = None
    """Largest rate of the command behind the lag [unit of the command per s]; needs `lag`"""
    force_limit: Positive | None = None
    """Largest force or moment [N or N m]"""
    power_limit: Positive | None = None
    """Largest power, that of force and rate of the deflection [W]"""
    stroke: Positive | None = None
    """Deflection to either side at which the force that pushes on outwards is gone [m or rad]"""
    against_axis: Flag = False
    """Acts against its axis, as the mirror image of an actuator does"""

    @property
    def has_points(self) -> bool:
        """Whether it acts at points."""
        return self.acts != "axle"

    @check
    def _what_belongs_together(self) -> None:
        if self.rate_limit is not None and self.lag == 0.0:
            raise ValueError("'rate_limit' needs 'lag'")
        if self.acts == "axle" and (self.sides or self.stroke):
            raise ValueError("acts = \"axle\" has no 'sides' and no 'stroke'")
        if self.acts == "line" and (self.points is None or self.points[0] == self.points[1]):
            raise ValueError("acts = \"line\" needs two different 'points'")
        if self.against_axis and self.acts in ("line", "axle"):
            raise ValueError(f"acts = \"{self.acts}\" has no 'against_axis'")

    def mirrored(self, signs: Signs) -> Self:
        """Return the element in a mirrored placement, where one command has the mirrored effect."""
        if self.acts in ("line", "axle"):
            return self
        k = AXES.index(self.acts)
        handed = signs[0] * signs[1] * signs[2] if k >= 3 else 1.0
        turned = handed * signs[k % 3] < 0.0
        return self.model_copy(update={"against_axis": self.against_axis != turned})

    def act(self, **values: object) -> Act:
        """Return what it becomes, with the values of its kind."""
        same = "lag", "delay", "rate_limit", "force_limit", "power_limit", "stroke"
        fields: Any = {name: getattr(self, name) for name in same} | values
        return Act(action=self.acts, sense=-1.0 if self.against_axis else 1.0, **fields)


class Actuator(CommandedElement):
    """A force, a damper, a brake or a position that follows a command during the run."""

    kind: Literal["actuator"]
    command: Literal["force", "damper", "position", "brake"] = "force"
    """What is commanded: the `force` [N or N m]; the constant of a `damper` [N s/m or N m s]; the
    deflection that spring and damper hold, `position` [m or rad]; the torque of a `brake` about an
    axle, which acts against the rotation and vanishes with it [N m]"""
    stiffness: NonNegative = 0.0
    """Stiffness with which a position is held [N/m or N m/rad]"""
    damping: NonNegative = 0.0
    """Damping beside it [N s/m or N m s]"""

    @check
    def _a_position_is_held(self) -> None:
        if (self.command == "position") != (self.stiffness > 0.0):
            raise ValueError("'stiffness' belongs to command = \"position\" and only to it")
        if self.damping > 0.0 and self.command != "position":
            raise ValueError("'damping' belongs to command = \"position\"")
        wrong = "position" if self.acts == "axle" else "brake"
        if self.command == wrong:
            other = "no" if wrong == "position" else "only"
            raise ValueError(f'command = "{wrong}" has {other} acts = "axle"')

    @property
    def command_unit(self) -> str:
        """SI unit of its command."""
        turning = {"damper": "N m s/rad", "position": "rad"}.get(self.command, "N m")
        linear = {"damper": "N s/m", "position": "m"}.get(self.command, "N")
        return turning if self.acts in ("roll", "pitch", "yaw", "axle") else linear

    def rows(self) -> Iterator[Act]:
        """One actuator."""
        yield self.act(mode=self.command, stiffness=self.stiffness, damping=self.damping)


class LawElement(CommandedElement):
    """A force by a user-defined law, a compiled Python function."""

    kind: Literal["law"]
    law: Name
    """Name of the law in the table `laws`"""
    parameters: dict[Name, Finite] = EMPTY_TABLE
    """Values of the function's further arguments, by name"""

    def rows(self) -> Iterator[Act]:
        """One element with a law."""
        yield self.act(mode="law", law=self.law, parameters=dict(self.parameters))
