"""Given forces and torques of a vehicle file: applied forces, traction, brakes."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from railsim.definitions.base import Finite, NonNegative, Positive, Text, Vector, rising
from railsim.definitions.element_base import CarriesNoWeight, Element, PairElement, Signs, times


def _in_time(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    if not rising(rows):
        raise ValueError("the time or distance must increase from row to row")
    return rows


TimeRows = Annotated[
    tuple[tuple[Finite, Finite, Finite, Finite], ...], Field(min_length=1), AfterValidator(_in_time)
]


class AppliedForce(CarriesNoWeight, Element):
    """A force and a torque on one body over time or distance: wind, traction, a test load."""

    kind: Literal["applied_force"]
    bodies: tuple[Text]
    """Name of the body, found from the innermost assembly outwards"""
    point: Vector | None = None
    """Where the force acts [m]; by default at the centre of gravity"""
    axes: Literal["body", "track"] = "body"
    """Axes of force and torque: those of the body, or those of the track at its position"""
    over: Literal["time", "distance"] = "time"
    """First column of the tables: time, or the arc length of the body's nominal position"""
    force_table: TimeRows | None = None
    """Rows [time s or distance m, Fx, Fy, Fz N], linear in between, constant beyond"""
    torque_table: TimeRows | None = None
    """Rows [time s or distance m, Mx, My, Mz N m], linear in between, constant beyond"""

    @model_validator(mode="after")
    def _something_acts(self) -> Self:
        if self.force_table is None and self.torque_table is None:
            raise ValueError("'force_table' or 'torque_table' is needed")
        return self

    def end_points(self) -> tuple[Vector, Vector] | None:
        """Point of action as written, twice [m]; None for the centre of gravity."""
        return None if self.point is None else (self.point, self.point)

    def mirrored(self, signs: Signs) -> Self:
        """Return the load in a mirrored placement; a torque turns opposite to a force."""
        handed = signs[0] * signs[1] * signs[2]
        turns = (handed * signs[0], handed * signs[1], handed * signs[2])
        tables = {
            "force_table": (self.force_table, signs),
            "torque_table": (self.torque_table, turns),
        }
        update = {
            key: tuple((row[0], *times(row[1:], factors)) for row in rows)
            for key, (rows, factors) in tables.items()
            if rows is not None
        }
        return self.model_copy(update=update)


class AxleTorque(CarriesNoWeight, PairElement):
    """A torque between a wheelset and the body that takes its reaction."""

    demand_table: (
        Annotated[tuple[tuple[Finite, Finite], ...], Field(min_length=1), AfterValidator(_in_time)]
        | None
    ) = None
    """Rows [time s or distance m, factor of the torque], linear in between, constant beyond"""
    over: Literal["time", "distance"] = "time"
    """First column of `demand_table`: time, or the arc length of the wheelset's nominal position"""
    slip_control: tuple[NonNegative, Positive] | None = None
    """Slip (omega r - V)/V at which the torque begins to fall, and slip at which it is gone [1]"""

    @model_validator(mode="after")
    def _slip_rises(self) -> Self:
        if self.slip_control is not None and self.slip_control[0] >= self.slip_control[1]:
            raise ValueError("'slip_control' needs two rising slips, such as [0.01, 0.02]")
        return self


def _over_speed(rows: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if not rising(rows):
        raise ValueError("the speed must increase from row to row")
    return rows


class Traction(AxleTorque):
    """Driving torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It drives forwards wherever the element stands, in mirrored placements too.
    """

    kind: Literal["traction"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, Finite], ...], Field(min_length=1), AfterValidator(_over_speed)
    ]
    """Rows [speed m/s, torque on the wheelset N m], forwards positive, linear, constant beyond"""


class Brake(AxleTorque):
    """Braking torque on a wheelset over the vehicle's speed; body 1 takes the reaction.

    It acts against the wheelset's rotation and vanishes with it.
    """

    kind: Literal["brake"]
    torque_table: Annotated[
        tuple[tuple[NonNegative, NonNegative], ...],
        Field(min_length=1),
        AfterValidator(_over_speed),
    ]
    """Rows [speed m/s, torque on the wheelset N m], linear in between, constant beyond"""
