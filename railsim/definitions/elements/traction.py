"""Torques on wheelsets: drives and brakes."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions.base import Finite, NonNegative, Positive, check, rises
from railsim.definitions.elements.base import Element, PairElement
from railsim.definitions.elements.rows import Drive


def is_about_axle(element: Element) -> bool:
    """Whether it is a torque about an axle, of a drive, brake or actuator, which holds nothing."""
    return isinstance(element, AxleTorque) or getattr(element, "acts", None) == "axle"


class AxleTorque(PairElement):
    """A torque between a wheelset and the body that takes its reaction."""

    BRAKES: ClassVar[bool]
    if TYPE_CHECKING:  # the field of its kinds
        torque_table: tuple[tuple[float, float], ...]

    demand_table: (
        Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), rises("time or distance")]
        | None
    ) = None
    """Rows [time s or distance m, factor of the torque], linear in between, constant beyond"""
    over: Literal["time", "distance"] = "time"
    """First column of `demand_table`: time, or the arc length of the wheelset's nominal position"""
    slip_control: tuple[NonNegative, Positive] | None = None
    """Slip (omega r - V)/V at which the torque begins to fall, and slip at which it is gone [1]"""

    @check
    def _tables_mean_something(self) -> None:
        if self.over == "distance" and self.demand_table is None:
            raise ValueError("'over' needs 'demand_table'")
        if self.BRAKES and any(factor < 0.0 for _, factor in self.demand_table or ()):
            raise ValueError("factors of a brake's 'demand_table' must not be negative")
        if self.slip_control is not None and not self.slip_control[0] < self.slip_control[1] <= 1.0:
            raise ValueError("'slip_control' needs two rising slips up to 1, such as [0.01, 0.02]")

    def rows(self) -> Iterator[Drive]:
        """One drive."""
        yield Drive(
            torque_table=self.torque_table,
            demand_table=self.demand_table,
            slip_control=self.slip_control,
            brakes=self.BRAKES,
            over_distance=self.over == "distance",
        )


class Traction(AxleTorque):
    """Driving torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It drives forwards wherever the element stands, in mirrored placements too.
    """

    BRAKES: ClassVar = False
    kind: Literal["traction"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, Finite], ...], Field(min_length=1), rises("speed")
    ]
    """Rows [speed m/s, torque on the wheelset N m], forwards positive, linear, constant beyond"""


class Brake(AxleTorque):
    """Braking torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It acts against the wheelset's rotation and vanishes with it.
    """

    BRAKES: ClassVar = True
    kind: Literal["brake"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, NonNegative], ...], Field(min_length=1), rises("speed")
    ]
    """Rows [speed m/s, torque on the wheelset N m], linear in between, constant beyond"""
