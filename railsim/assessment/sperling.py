"""Sperling's ride index Wz (Sperling 1941; Garg and Dukkipati 1984, chapter 3).

Wz = (100 sqrt(2) a_w)^0.3 with the root mean square a_w [m/s2] of the acceleration after

    B(f) = k sqrt((1.911 f^2 + (0.25 f^2)^2) / ((1 - 0.277 f^2)^2 + (1.563 f - 0.0368 f^3)^2)),

k = 0.588 vertical, 0.735 lateral.  The index is defined with the amplitude of a harmonic vibration
in cm/s2, which is 100 sqrt(2) a_w.  For several frequencies the powers 20/3 of the indices are
added, which is equivalent to adding the squares of a_w.

Classes, such as 2 for good, are from memory and not used for a verdict; see the handbook.
"""

from typing import Literal

import numpy as np

from railsim.arrays import Floats
from railsim.result.filters import filtered

FACTOR = {"vertical": 0.588, "lateral": 0.735}
BAND = (0.5, 30.0)  # frequency range of the index [Hz]
MARGIN = 16.0  # s, which the lower end of the range looks around itself
Direction = Literal["vertical", "lateral"]


def sperling_gain(f: Floats, direction: Direction) -> Floats:
    """Weighting B at the frequencies `f` [Hz]."""
    square = np.asarray(f, dtype=np.float64) ** 2
    above = 1.911 * square + (0.25 * square) ** 2
    below = (1.0 - 0.277 * square) ** 2 + square * (1.563 - 0.0368 * square) ** 2
    return np.asarray(FACTOR[direction] * np.sqrt(above / below))


def sperling_weighted(a: Floats, rate: float, direction: Direction) -> Floats:
    """Weighted accelerations from 0.5 to 30 Hz, as if a curve at an end went on [m/s2].

    `a`: accelerations at a `rate` [1/s].
    """

    def response(f: Floats) -> Floats:
        f = np.asarray(f, dtype=np.float64)
        return np.where((f >= BAND[0]) & (f <= BAND[1]), sperling_gain(f, direction), 0.0)

    return filtered(a, rate, response, MARGIN)


def index_of_rms(a_w: float) -> float:
    """Wz of a weighted root mean square [m/s2].

    >>> B = float(sperling_gain(np.array(5.0), "vertical"))
    >>> round(index_of_rms(0.5 / np.sqrt(2.0) * B), 3)
    3.039
    """
    return float((100.0 * np.sqrt(2.0) * a_w) ** 0.3)
