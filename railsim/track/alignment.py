"""Plan, cant and vertical profile as exact functions of the arc length.

Curvature, cant and gradient are piecewise linear as written in the track file.  Rounding replaces
each by its mean over a window of the length `rounding` (a box filter): kinks become parabolas, the
integral over a transition stays the same.  All means are differences of antiderivatives, so nothing
is sampled.

The centre line obeys dX/ds = cos(psi) cos(theta), dY/ds = sin(psi) cos(theta), dZ/ds = -sin(theta)
with the heading psi (to the right), dpsi/ds = kappa, and the grade angle theta (nose up).  At s = 0
all of X, Y, Z, psi are 0.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.constants import CANT_BASE
from railsim.definitions import Track
from railsim.definitions.base import once
from railsim.definitions.track import layout
from railsim.definitions.track.elements import Section
from railsim.definitions.track.rounded_profile import RoundedProfile
from railsim.errors import Fault, InputError


class Alignment:
    """Geometry of a track's centre line and track plane over arc length.

    Everything takes arc lengths of any shape [m] and returns an array of that shape; see
    `RoundedProfile` for rates and integrals.

    - `curvature`: kappa, positive to the right [1/m]; `heading`: psi, its integral [rad]
    - `cant`: height of the left rail over the right one [m]
    - `gradient`: of the vertical profile, rise over horizontal distance [1]

    `track`: the track; beyond its ends the end elements continue. Raises InputError: elements that
    do not fit together.

    >>> from railsim.definitions.loading import load_track
    >>> alignment = Alignment(load_track("curve_r250"))
    >>> round(float(1.0 / alignment.curvature(390.0)), 6)
    250.0
    """

    def __init__(self, track: Track) -> None:
        if faults := layout.track_faults(track):
            file = f"track '{track.name}'"
            raise InputError(Fault(file, f.key, f.found, f.allowed) for f in faults)
        self.length = track.length
        self.curvature = RoundedProfile(layout.curvature_sections(track), track.rounding)
        self.heading = self.curvature.integral
        cant = layout.cant_sections(track)
        self.cant = RoundedProfile(cant, track.rounding)
        self.gradient = RoundedProfile(layout.gradient_sections(track), track.rounding)
        rising = _magnitudes(cant) if track.cant_rotation == "inner_rail" else []
        self._lifting_cant = RoundedProfile(rising, track.rounding)

    def cant_angle(self, s: ArrayLike) -> Floats:
        """Cant angle phi = asin(cant / 1.5 m), positive = left rail higher [rad]."""
        return np.arcsin(self.cant(s) / CANT_BASE)

    def cant_angle_rate(self, s: ArrayLike) -> Floats:
        """Derivative of the cant angle along the track [rad/m]."""
        return self.cant.rate(s) / (CANT_BASE * np.sqrt(1.0 - (self.cant(s) / CANT_BASE) ** 2))

    def grade_angle(self, s: ArrayLike) -> Floats:
        """Grade angle theta of the centre line, positive = nose up [rad].

        With the cant about the inner rail the centre line also rises by half the cant.
        """
        return np.arcsin(self._climb(s))

    def grade_angle_rate(self, s: ArrayLike) -> Floats:
        """Derivative of the grade angle along the track [rad/m]."""
        climb_rate = self.gradient.rate(s) / (1.0 + self.gradient(s) ** 2) ** 1.5
        climb_rate += 0.5 * self._lifting_cant.second_rate(s)
        return climb_rate / np.sqrt(1.0 - self._climb(s) ** 2)

    def _climb(self, s: ArrayLike) -> Floats:
        gradient = self.gradient(s)
        return gradient / np.sqrt(1.0 + gradient**2) + 0.5 * self._lifting_cant.rate(s)


def alignment_of(track: Track) -> Alignment:
    """Return the alignment of a track, worked out once for each track.

    Raises InputError: elements that do not fit together.
    """
    return once(track, "_alignment", lambda: Alignment(track))


def _magnitudes(sections: Sequence[Section]) -> list[Section]:
    """Return the sections of the absolute value; a ramp through zero becomes two."""
    parts = []
    for section in sections:
        start, end = section.start_value, section.end_value
        zero = section.begin - start / section.slope if start * end < 0.0 else section.begin
        if section.begin < zero < section.end:
            parts.append(replace(section, end=zero, start_value=abs(start), end_value=0.0))
            parts.append(replace(section, begin=zero, start_value=0.0, end_value=abs(end)))
        else:
            parts.append(replace(section, start_value=abs(start), end_value=abs(end)))
    return parts
