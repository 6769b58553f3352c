"""Track geometry quality along a run: standard deviations of alignment and longitudinal level.

Zero-phase Butterworth band-pass filter of order 4 over the wavelengths D1 = 3 to 25 m (EN 13848-1;
EN 14363 annex M); per section, the worse of the two rails.
"""

import math

import numpy as np

from railsim.definitions.track.definition import Track
from railsim.result.filters import butterworth, filtered
from railsim.track.irregularity import displacement

D1 = (3.0, 25.0)  # m, shortest and longest wavelength
SPACING = 0.25  # m
AT_ONCE = 20_000  # positions that are evaluated at once, to limit the memory for long tracks

# UIC 518 (2009): speed up to [km/h], QN1 and QN2 of alignment and level, standard deviations [mm],
# from secondary sources
QN = (
    (80.0, (1.5, 1.8), (2.3, 2.6)), (120.0, (1.2, 1.5), (1.8, 2.1)),
    (160.0, (1.0, 1.3), (1.4, 1.7)), (200.0, (0.8, 1.1), (1.2, 1.5)),
    (300.0, (0.7, 1.0), (1.0, 1.3)),
)  # fmt: skip


class TrackQuality:
    """Standard deviations over any part of a track between `begin` and `end` [m]."""

    def __init__(self, track: Track, begin: float, end: float) -> None:
        short, long = D1
        margin = 6.0 * long
        self._s = np.arange(begin - margin, end + margin, SPACING)
        self._rails = np.zeros((len(self._s), 4))
        if (function := displacement(track)) is not None:
            parts = np.array_split(self._s, math.ceil(len(self._s) / AT_ONCE))
            at = [np.asarray(function(part)[0]).reshape(4, -1).T for part in parts]
            response = butterworth(1.0 / long, 1.0 / short)
            self._rails = filtered(np.concatenate(at), 1.0 / SPACING, response, margin)

    def deviations(self, begin: float, end: float) -> tuple[float, float]:
        """Standard deviations of alignment and level between two arc lengths, worse rail [m]."""
        there = self._rails[(self._s >= begin) & (self._s <= end)]
        left_y, left_z, right_y, right_z = np.std(there, axis=0)
        return float(max(left_y, right_y)), float(max(left_z, right_z))


def quality_class(speed: float, alignment: float, level: float) -> str:
    """Class of a section after UIC 518: better than QN1, between QN1 and QN2, worse than QN2.

    `speed`: Admissible speed of the line [m/s]. `alignment`, `level`: Standard deviations in D1
    [m].

    >>> quality_class(40.0, 0.71e-3, 0.98e-3), quality_class(40.0, 1.21e-3, 1.61e-3)
    ('better than QN1', 'between QN1 and QN2')
    """
    row = next((row for row in QN if 3.6 * speed <= row[0] + 1e-3), QN[-1])
    over = [(1e3 * alignment > row[1][k]) or (1e3 * level > row[2][k]) for k in (0, 1)]
    return ("better than QN1", "between QN1 and QN2", "worse than QN2")[sum(over)]
