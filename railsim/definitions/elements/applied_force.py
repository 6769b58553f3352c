"""A given force and torque on one body."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field

from railsim.definitions.base import Finite, Text, Vector, check, rises
from railsim.definitions.elements.base import Element, Signs, times
from railsim.definitions.elements.rows import Load

TimeRows = Annotated[
    tuple[tuple[Finite, Finite, Finite, Finite], ...],
    Field(min_length=1),
    rises("time or distance"),
]


class AppliedForce(Element):
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

    @check
    def _something_acts(self) -> None:
        if self.force_table is None and self.torque_table is None:
            raise ValueError("'force_table' or 'torque_table' is needed")

    def mirrored(self, signs: Signs) -> Self:
        """Return the load in a mirrored placement; a torque turns opposite to a force."""
        handed = signs[0] * signs[1] * signs[2]
        turns = (handed * signs[0], handed * signs[1], handed * signs[2])
        update = {
            key: tuple((row[0], *times(row[1:], factors)) for row in rows)
            for key, factors in (("force_table", signs), ("torque_table", turns))
            if (rows := getattr(self, key)) is not None
        }
        return self.model_copy(update=update)

    def rows(self) -> Iterator[Load]:
        """One load for the forces, one for the torques."""
        for is_torque, table in ((False, self.force_table), (True, self.torque_table)):
            if table is not None:
                yield Load(
                    table=table,
                    is_torque=is_torque,
                    track_axes=self.axes == "track",
                    over_distance=self.over == "distance",
                )
