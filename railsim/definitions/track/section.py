"""One element of a track with the value at both of its ends: curvature, cant or gradient."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """One element of a list with the values at its ends.

    `key`: its key in the file, e.g. ``plan.2``; `type`: its type as written; `begin`, `end`: arc
    lengths of its ends [m]; `start_value`, `end_value`: curvature [1/m], cant [m] or gradient [1]
    at its ends.
    """

    key: str
    type: str
    begin: float
    end: float
    start_value: float
    end_value: float

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.end - self.begin

    @property
    def slope(self) -> float:
        """Change of the value per metre."""
        return (self.end_value - self.start_value) / self.length

    def value(self, s: float) -> float:
        """Value at the arc length `s` within the section."""
        return self.start_value + self.slope * (s - self.begin)
