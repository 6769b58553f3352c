"""A spring and damper along a line."""

from itertools import pairwise
from math import dist
from typing import Literal, Self

from railsim.definitions.base import AutoOrNumber, NonNegative, Vector, check
from railsim.definitions.elements.base import Characteristic, FreeLength, SidedElement, two_sided
from railsim.definitions.elements.rows import Link, State


class SpringDamper(FreeLength, SidedElement):
    """Spring and damper along the line between two points."""

    kind: Literal["spring_damper"]
    points: tuple[Vector, Vector]
    """Point on body 1 and point on body 2 [m]"""
    stiffness: NonNegative = 0.0
    """Spring stiffness [N/m]"""
    damping: NonNegative = 0.0
    """Damping [N s/m]"""
    series_stiffness: NonNegative = 0.0
    """Stiffness in series with the damper [N/m]; 0 means rigid"""
    preload: AutoOrNumber = 0.0
    """Force at the nominal length, tension positive [N], or `auto`: found from the equilibrium"""
    spring_table: Characteristic | None = None
    """Rows [elongation m, force N] instead of `stiffness`; from 0 on it serves both directions"""
    damper_table: Characteristic | None = None
    """Rows [velocity m/s, force N] instead of `damping`; from 0 on it serves both directions"""

    @check
    def _one_law_each(self) -> None:
        if self.points[0] == self.points[1]:
            raise ValueError("the two points are the same: the element has no direction")
        if self.stiffness > 0.0 and self.spring_table is not None:
            raise ValueError("either 'stiffness' or 'spring_table', not both")
        if self.damping > 0.0 and self.damper_table is not None:
            raise ValueError("either 'damping' or 'damper_table', not both")
        if self.series_stiffness > 0.0 and self.damping == 0.0 and self.damper_table is None:
            raise ValueError("'series_stiffness' needs 'damping' or 'damper_table'")
        if self.has_free_length and self.stiffness == 0.0:
            raise ValueError("a free length needs 'stiffness'")

    def with_known_preload(self, point1: Vector, point2: Vector) -> Self:
        """Return the spring with the preload of its length, tension positive."""
        if not self.has_free_length:
            return self
        return self.model_copy(
            update={"preload": -self.compression(self.stiffness, dist(point1, point2))}
        )

    @property
    def vertical_stiffness(self) -> float:
        """Largest stiffness along its line [N/m]."""
        if self.spring_table is None:
            return self.stiffness
        steps = pairwise(two_sided(self.spring_table))
        return max((end[1] - begin[1]) / (end[0] - begin[0]) for begin, end in steps)

    @property
    def vertical_damping(self) -> float:
        """Damping along its line [N s/m]."""
        return self.damping if self.series_stiffness == 0.0 else 0.0

    def end_points(self) -> tuple[Vector, Vector]:
        """Points on body 1 and body 2 as written [m]."""
        return self.points

    def rows(self) -> list[Link]:
        """One link; behind a spring in series the damper's force is an internal state."""
        state = None
        if self.series_stiffness > 0.0:
            parameter = (self.damping, self.series_stiffness, 0.0)
            state = (
                State("maxwell", parameter)
                if self.damper_table is None
                else State("maxwell_curve", parameter, self.damper_table)
            )
        return [
            Link(
                stiffness=self.stiffness,
                damping=0.0 if state else self.damping,
                preload=0.0 if self.preload == "auto" else self.preload,
                state=state,
                spring_table=self.spring_table,
                damper_table=None if state else self.damper_table,
            )
        ]
