"""Where the straights, transitions and curves of a result's track begin and end."""

from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from railsim.definitions.track import Track
    from railsim.result.data import Result

WORDS = {"STR": "straight", "CLO": "transition", "CIR": "curve"}


@dataclass(frozen=True)
class Section:
    """One element of the plan, placed along the track.

    Attributes
    ----------
    kind : str
        ``STR``, ``CLO`` or ``CIR``.
    start, end : float
        Distance along the track; transitions are rounded about these places [m].
    radius : float
        Signed radius of a circular element, positive to the right; ``inf`` for the others [m].
    """

    kind: str
    start: float
    end: float
    radius: float = inf

    @property
    def middle(self) -> float:
        """Distance of the middle [m]."""
        return 0.5 * (self.start + self.end)

    @property
    def words(self) -> str:
        """What the section is, for tables and plots."""
        name = WORDS[self.kind]
        return f"{name} R {abs(self.radius):g} m" if self.kind == "CIR" else name


def sections(track: "Track") -> tuple[Section, ...]:
    """Return the elements of the plan with their places along the track."""
    ends = [0.0]
    for element in track.plan:
        ends.append(ends[-1] + element.length)
    return tuple(
        Section(element.type, start, end, getattr(element, "radius", inf))
        for element, (start, end) in zip(track.plan, pairwise(ends), strict=True)
    )


def curves_reached(result: "Result") -> tuple[Section, ...]:
    """Return the circular elements whose middle the reference body of a result passed."""
    distance = result["distance"]
    return tuple(
        section
        for section in sections(result.track())
        if section.kind == "CIR" and distance[0] <= section.middle <= distance[-1]
    )
