"""Track geometry quality along a run: alignment and longitudinal level.

Zero-phase Butterworth band-pass filter of order 4 over the wavelengths D1 = 3 to 25 m (EN 13848-1;
EN 14363 annex M), D2 = 25 to 70 m, D3 = 70 to 150 m; per section, the worse of the two rails:
standard deviations, and single defects, the largest deviation in D1.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.result.filters import butterworth, filtered
from railsim.track.irregularity import displacement

D1, D2, D3 = (3.0, 25.0), (25.0, 70.0), (70.0, 150.0)  # m, shortest and longest wavelength
SPACING = 0.25  # m
AT_ONCE = 20_000  # positions that are evaluated at once, to limit the memory for long tracks

# UIC 518 (2009): speed up to [km/h], QN1 and QN2 of alignment and level, standard deviations [mm],
# from secondary sources
QN = (
    (80.0, (1.5, 1.8), (2.3, 2.6)), (120.0, (1.2, 1.5), (1.8, 2.1)),
    (160.0, (1.0, 1.3), (1.4, 1.7)), (200.0, (0.8, 1.1), (1.2, 1.5)),
    (300.0, (0.7, 1.0), (1.0, 1.3)),
)  # fmt: skip
# likewise of single defects: QN1 of both, QN2 of alignment and of level [mm]; QN3 is 1.3 QN2
DEFECTS = (
    (80.0, 12.0, (14.0, 16.0)), (120.0, 8.0, (10.0, 12.0)), (160.0, 6.0, (8.0, 10.0)),
    (200.0, 5.0, (7.0, 9.0)), (300.0, 4.0, (6.0, 8.0)),
)  # fmt: skip


class TrackQuality:
    """Values of any part of a track between `begin` and `end` [m]; `bands`: wavelengths [m]."""

    def __init__(
        self, track: Track, begin: float, end: float, bands: Sequence[tuple[float, float]] = (D1,)
    ) -> None:
        margins = [6.0 * long for _, long in bands]
        s = np.arange(begin - max(margins), end + max(margins), SPACING)
        rails = np.zeros((len(s), 4))
        if (function := displacement(track)) is not None:
            parts = np.array_split(s, math.ceil(len(s) / AT_ONCE))
            values = [np.asarray(function(part)[0]).reshape(4, -1).T for part in parts]
            rails = np.concatenate(values)
        self._bands = {}
        for (short, long), margin in zip(bands, margins, strict=True):
            # the same places whatever the other bands are
            places = np.arange(begin - margin, end + margin, SPACING)
            cut = round((max(margins) - margin) / SPACING)
            response = butterworth(1.0 / long, 1.0 / short)
            band_values = filtered(rails[cut:][: len(places)], 1.0 / SPACING, response, margin)
            self._bands[short, long] = places[: len(band_values)], band_values

    def deviations(
        self, begin: float, end: float, band: tuple[float, float] = D1
    ) -> tuple[float, float]:
        """Standard deviations of alignment and level between two arc lengths, worse rail [m]."""
        return self._worse(np.std, begin, end, band)

    def _worse(
        self, value: Callable[..., Floats], begin: float, end: float, band: tuple[float, float]
    ) -> tuple[float, float]:
        s, rails = self._bands[band]
        left_y, left_z, right_y, right_z = value(rails[(s >= begin) & (s <= end)], axis=0)
        return float(max(left_y, right_y)), float(max(left_z, right_z))

    def further(self, begin: float, end: float, speed: float) -> dict[str, float | str]:
        """Values beside those of D1 by name [m], and the class of the single defects."""
        d2, d3 = (self.deviations(begin, end, band) for band in (D2, D3))
        most = self._worse(lambda x, axis: np.max(np.abs(x), axis), begin, end, D1)
        return {
            "alignment_D2": d2[0], "level_D2": d2[1], "alignment_D3": d3[0], "level_D3": d3[1],
            "alignment_largest": most[0], "level_largest": most[1],
            "defects": defect_class(speed, *most),
        }  # fmt: skip


def _row_at_speed(table: Sequence[tuple[Any, ...]], speed: float) -> tuple[Any, ...]:
    """Row of `QN` or `DEFECTS` for a speed [m/s]."""
    return next((row for row in table if 3.6 * speed <= row[0] + 1e-3), table[-1])


def defect_class(speed: float, alignment: float, level: float) -> str:
    """Class of the single defects of a section after UIC 518; arguments as of `quality_class` [m].

    >>> defect_class(40.0, 7e-3, 9e-3), defect_class(40.0, 10.5e-3, 9e-3)
    ('between QN1 and QN2', 'worse than QN3')
    """
    _, qn1, qn2 = _row_at_speed(DEFECTS, speed)
    limits = (qn1, qn1), qn2, tuple(1.3 * value for value in qn2)
    over = [1e3 * alignment > limit_y or 1e3 * level > limit_z for limit_y, limit_z in limits]
    names = "better than QN1", "between QN1 and QN2", "between QN2 and QN3", "worse than QN3"
    return names[sum(over)]


def quality_class(speed: float, alignment: float, level: float) -> str:
    """Class of a section after UIC 518: better than QN1, between QN1 and QN2, worse than QN2.

    `speed`: Admissible speed of the line [m/s]. `alignment`, `level`: Standard deviations in D1
    [m].

    >>> quality_class(40.0, 0.71e-3, 0.98e-3), quality_class(40.0, 1.21e-3, 1.61e-3)
    ('better than QN1', 'between QN1 and QN2')
    """
    row = _row_at_speed(QN, speed)
    over = [(1e3 * alignment > row[1][k]) or (1e3 * level > row[2][k]) for k in (0, 1)]
    return ("better than QN1", "between QN1 and QN2", "worse than QN2")[sum(over)]
