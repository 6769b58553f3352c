"""One element of a track with the value at both of its ends: curvature, cant or gradient."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """One element of a list with its values at both ends: curvature, cant or gradient."""

    key: str  # in the file, e.g. ``plan.2``
    type: str  # as written; a circle of infinite radius is STR
    begin: float  # arc length [m]
    end: float  # arc length [m]
    start_value: float  # [1/m], [m] or [1]
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
