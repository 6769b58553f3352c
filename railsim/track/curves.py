"""The circular curves of a track: the speeds that suit their cant."""

from dataclasses import dataclass

from railsim.cant import cant_deficiency, curve_speed
from railsim.definitions import Track
from railsim.definitions.track.alignment_rules import cant_at
from railsim.definitions.track.elements import Section
from railsim.definitions.track.layout import cant_sections, curvature_sections

# Cant deficiency up to which EN 14363 tests vehicles for conventional operation [m].
USUAL_CANT_DEFICIENCY = 0.150


@dataclass(frozen=True)
class Curve:
    """One circular element."""

    section: Section  # of the plan
    curvature: float  # positive to the right [1/m]
    cant: float  # at its middle, positive where the outer rail is higher [m]

    @property
    def balanced_speed(self) -> float:
        """Speed without cant deficiency: V^2 kappa = g cant/(2 b0) [m/s]."""
        return self.speed(0.0)

    @property
    def usual_speed(self) -> float:
        """Speed with the largest cant deficiency of conventional operation [m/s]."""
        return self.speed(USUAL_CANT_DEFICIENCY)

    def speed(self, cant_deficiency: float) -> float:
        """Speed with some cant deficiency, 0 where there is none [m/s]."""
        return curve_speed(1.0 / self.curvature, max(self.cant + cant_deficiency, 0.0))

    def cant_deficiency(self, speed: float) -> float:
        """Cant deficiency at a speed, 2 b0 V^2 kappa/g - cant, negative: cant excess [m]."""
        return cant_deficiency(speed, abs(self.curvature), self.cant)


def curves(track: Track) -> tuple[Curve, ...]:
    """Return the circular curves of a track in their order.

    >>> from railsim.definitions.loading import load_track
    >>> (curve,) = curves(load_track("curve_r250"))
    >>> round(1.0 / curve.curvature), round(curve.cant_deficiency(20.0), 3)
    (250, 0.095)
    """
    cant = cant_sections(track)
    found = []
    for section in curvature_sections(track):
        curvature = max(section.start_value, section.end_value, key=abs)
        if section.type == "CIR":
            height = cant_at(cant, 0.5 * (section.begin + section.end))
            found.append(Curve(section, curvature, height if curvature > 0.0 else -height))
    return tuple(found)
