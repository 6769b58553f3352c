"""Piecewise linear functions of the arc length, rounded by a box filter.

All means are differences of antiderivatives, so nothing is sampled.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.definitions.track.elements import Section


def _running(parts: Floats) -> Floats:
    """Sum of all parts before each."""
    return np.concatenate([[0.0], np.cumsum(parts)[:-1]])


class RoundedProfile:
    """A piecewise linear function, constant beyond its ends, averaged over a window.

    `sections`: values over arc length; none at all means zero everywhere; `rounding`: length of the
    window [m]; 0 leaves the kinks; `origin`: arc length from which the sections' ends count [m].
    """

    def __init__(self, sections: Sequence[Section], rounding: float, origin: float = 0.0) -> None:
        knots = [-1.0, 0.0, *(section.end for section in sections)]
        slopes = [0.0, *(section.slope for section in sections), 0.0]
        first = sections[0].start_value if sections else 0.0
        last = sections[-1].end_value if sections else 0.0
        values = [first, *(section.start_value for section in sections), last]
        slope, value, width = np.array(slopes), np.array(values), np.diff([*knots, knots[-1] + 1.0])
        once = _running(value * width + slope * width**2 / 2.0)
        twice = _running(once * width + value * width**2 / 2.0 + slope * width**3 / 6.0)
        self._knots = origin + np.array(knots)
        # coefficients of each piece, highest power first: of two derivatives, value, two integrals
        self._pieces = (
            (np.zeros_like(slope),),
            (slope,),
            (slope, value),
            (slope / 2.0, value, once),
            (slope / 6.0, value / 2.0, once, twice),
        )
        self._half_window = 0.5 * rounding
        self._is_zero = not sections

    def _plain(self, times: int, s: Floats) -> Floats:
        """Derivatives (-2, -1), value (0) or integrals (1, 2) before rounding."""
        # scipy's PPoly does this too, but its package takes a quarter of a second to import
        piece = np.clip(np.searchsorted(self._knots, s, side="right") - 1, 0, None)
        u = s - self._knots[piece]
        highest, *others = self._pieces[times + 2]
        total: Floats = highest[piece]
        for coefficient in others:
            total = total * u + coefficient[piece]
        return total

    def _rounded(self, times: int, s: ArrayLike) -> Floats:
        """As `_plain`, the mean over the window."""
        x, h = np.asarray(s, dtype=np.float64), self._half_window
        if self._is_zero:
            return np.zeros_like(x)
        if h == 0.0:
            return self._plain(times, x)
        mean: Floats = (self._plain(times + 1, x + h) - self._plain(times + 1, x - h)) / (2.0 * h)
        return mean

    def __call__(self, s: ArrayLike) -> Floats:
        """Value at the arc length `s` [m]."""
        return self._rounded(0, s)

    def rate(self, s: ArrayLike) -> Floats:
        """Derivative along the track at `s`."""
        return self._rounded(-1, s)

    def second_rate(self, s: ArrayLike) -> Floats:
        """Second derivative along the track."""
        return self._rounded(-2, s)

    def integral(self, s: ArrayLike) -> Floats:
        """Integral from 0 to `s`."""
        return self._rounded(1, s) - self._rounded(1, 0.0)
