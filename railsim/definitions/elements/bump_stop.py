"""A stop with free travel."""

from typing import Literal, Self

from railsim.definitions.elements.base import Characteristic, PointElement, Signs
from railsim.definitions.elements.rows import Mount


class BumpStop(PointElement):
    """Stop with free travel along one axis of body 1; a spring with clearance."""

    kind: Literal["bump_stop"]
    axis: Literal["x", "y", "z"]
    """Axis of body 1 along which the stop acts"""
    table: Characteristic
    """Rows [travel of body 2 m, force N]; from [0, 0] on it serves both directions"""

    def mirrored(self, signs: Signs) -> Self:
        """Return the stop in a mirrored placement: the two directions of its axis are exchanged."""
        if signs["xyz".index(self.axis)] > 0.0 or self.table[0][0] == 0.0:
            return self
        turned = tuple((-x, -force) for x, force in reversed(self.table))
        return self.model_copy(update={"table": turned})

    def rows(self) -> list[Mount]:
        """One mount with a table along its axis."""
        x, y, z = (self.table if axis == self.axis else None for axis in "xyz")
        return [Mount(tables=(x, y, z))]
