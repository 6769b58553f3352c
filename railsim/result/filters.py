"""Filters over time and means over distance for records with equal time steps.

Filters act along the first axis.  Two forms of each:

- without phase: the spectrum times a real or complex response, in overlapping blocks, so that the
  memory needed does not grow with the record.  A Butterworth response of order n has the magnitude
  1/sqrt(1 + (f/f_c)^(2n)) (Butterworth 1930, Experimental Wireless 7), -3 dB at the corner.  The
  filter run forwards and backwards is another one, with the square of it.
- causal: the digital filter of the same order (bilinear transformation), as a measuring amplifier
  has it, started in the steady state of the first value.

Means over distance integrate the record, taken as linear between its samples, exactly.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy import fft  # scipy's takes a tenth of the whole command `run` to import
from numpy.typing import NDArray

from railsim.arrays import Complexes, Floats

Response = Callable[[Floats], Complexes | Floats]

BLOCK = 2**16  # samples of a block at least
CELLS = 2**14  # of percentiles, an even number
REACH = 6.0
"""Periods of the lowest corner after which a Butterworth filter of order 4 has forgotten
(its slowest part has fallen to exp(-2 pi 0.383 6) = 5e-7)."""


@lru_cache(50)
def butterworth(low: float = 0.0, high: float = math.inf) -> Response:
    """Magnitude of a Butterworth low pass, high pass or band pass of order 4.

    `low`, `high`: Lower and upper corner [Hz]; 0 and infinity: none. A band pass has the order on
    either side, as the transformation of the low pass gives it. Returns: Frequencies [Hz] to
    1/sqrt(1 + x^8), x = f/high, low/f or, of a band pass, (f^2 - low high)/(f (high - low)).

    >>> [round(float(g), 3) for g in butterworth(high=20.0)(np.array([10.0, 20.0, 30.0]))]
    [0.998, 0.707, 0.194]
    """

    def gain(f: Floats) -> Floats:
        f = np.asarray(f, dtype=np.float64)
        above, below = f / high, np.ones_like(f)
        if low > 0.0 and high < math.inf:
            above, below = f**2 - low * high, f * (high - low)
        elif low > 0.0:
            above, below = np.full_like(f, low), f
        # 1/sqrt(1 + (above/below)^8) written for f = 0 too
        top = np.maximum(np.abs(above), np.abs(below))
        above, below = (above / top) ** 4, (below / top) ** 4
        return np.abs(below) / np.hypot(above, below)

    return gain


def reach(low: float = 0.0, high: float = math.inf) -> float:
    """Time that a Butterworth filter with these corners looks around itself [s]."""
    lowest = low if low > 0.0 else high
    return REACH / lowest if lowest < math.inf else 0.0


def filtered(x: Floats, rate: float, response: Response, margin: float) -> Floats:
    """Filter a record in the frequency domain, in overlapping blocks.

    `x` (float64[time, ...]): Record. `rate`: Samples per second [1/s]. `response`: Frequencies
    [Hz] to the factor of the spectrum. `margin`: Time that the filter looks around itself [s]; the
    record is continued at both ends by its odd mirror image over this time. Returns float64[time,
    ...]: Filtered record; within `margin` of its ends it depends on the continuation.
    """
    n = len(x)
    if n < 2:
        return np.array(x, dtype=np.float64)
    edge = max(1, math.ceil(margin * rate))
    size = fast_length(min(max(BLOCK, 4 * edge), n + 2 * edge))
    factor = _factor(response, size, rate).reshape(-1, *(1 for _ in x.shape[1:]))
    out = np.empty_like(x, dtype=np.float64)
    inner = size - 2 * edge
    for begin in range(0, n, inner):
        end = min(begin + inner, n)
        spectrum = fft.rfft(_continued(x, begin - edge, begin - edge + size), axis=0)
        spectrum *= factor
        out[begin:end] = fft.irfft(spectrum, size, axis=0)[edge : edge + end - begin]
    return out


@lru_cache(8)
def _factor(response: Response, size: int, rate: float) -> NDArray[Any]:
    return np.asarray(response(np.asarray(fft.rfftfreq(size, 1.0 / rate), dtype=np.float64)))


@lru_cache(100)
def fast_length(least: int) -> int:
    """Smallest length, `least` or more, that the transform takes apart into 2, 3 and 5.

    >>> [fast_length(n) for n in (1, 7, 17, 1025, 65537)]
    [1, 8, 18, 1080, 65610]
    """
    exponents = range(least.bit_length())
    odd: set[int] = {3**j * 5**k for j in exponents for k in exponents if 3**j * 5**k < 2 * least}
    return min(factor << max(0, -(-least // factor) - 1).bit_length() for factor in odd)


def _continued(x: Floats, begin: int, end: int) -> Floats:
    """Rows of a record that goes on beyond its ends as its odd mirror image, then constant."""
    last = len(x) - 1
    inner = x[max(begin, 0) : min(end, last + 1)]
    if len(inner) == end - begin:
        return inner
    before, after = np.arange(begin, 0), np.arange(last + 1, end)
    first, end_value = (2.0 * part.astype(np.float64) for part in (x[:1], x[last:]))
    rest = end_value - x[np.maximum(2 * last - after, 0)]
    return np.concatenate([first - x[np.minimum(-before, last)], inner, rest])


def even_step(time: Floats) -> float | None:
    """Step of a record [s], None where steps are not equal; the last one may be shorter."""
    steps = np.diff(time[:-1])
    if not len(steps) or np.ptp(steps) > 1e-6 * np.mean(steps):
        return None
    return float(np.mean(steps))


def low_passed(x: Floats, rate: float, corner: float) -> Floats:
    """Butterworth low pass of order 4 without phase."""
    return band_passed(x, rate, 0.0, corner)


def band_passed(x: Floats, rate: float, low: float, high: float, *, causal: bool = False) -> Floats:
    """Butterworth band pass of order 4.

    `x` (float64[time, ...]): Record. `rate`: Samples per second [1/s]. `low`, `high`: Corners
    [Hz]; `low` 0: a low pass. `causal`: As an amplifier does it, instead of without phase.
    """
    if not causal:
        return filtered(x, rate, butterworth(low, high), reach(low, high))
    from scipy import signal  # with scipy.stats, a second to import

    if low > 0.0:
        sections = signal.butter(4, [low, high], "bandpass", fs=rate, output="sos")
    else:
        sections = signal.butter(4, high, "lowpass", fs=rate, output="sos")
    x = np.asarray(x, dtype=np.float64)
    return np.asarray(signal.sosfilt(sections, x, axis=0, zi=steady_start(sections, x[0]))[0])


def steady_start(sections: Floats, first: Floats) -> Floats:
    """State of a causal filter, given as second-order sections, that has always seen `first`."""
    from scipy import signal

    start = signal.sosfilt_zi(sections)
    return np.asarray(start.reshape(*start.shape, *(1 for _ in first.shape)) * first)


def outward_quotient(Y: Floats, Q: Floats) -> Floats:
    """Derailment quotient Y/Q of left and right wheels, outwards positive; NaN without load."""
    return np.array([-1.0, 1.0]) * Y / np.where(Q > 0.0, Q, np.nan)


def integral(s: Floats, x: Floats) -> Floats:
    """Integral of a record over s, linear between its samples, from its first sample on."""
    steps = np.diff(s).reshape(-1, *(1 for _ in x.shape[1:]))
    parts = 0.5 * steps * (x[1:] + x[:-1])
    return np.concatenate([np.zeros((1, *x.shape[1:])), np.cumsum(parts, axis=0)])


def _integral_at(s: Floats, x: Floats, cumulative: Floats, places: Floats) -> Floats:
    i = np.clip(np.searchsorted(s, places, side="right") - 1, 0, len(s) - 2)
    shape = (-1, *(1 for _ in x.shape[1:]))
    d = (places - s[i]).reshape(shape)
    slope = (x[i + 1] - x[i]) / (s[i + 1] - s[i]).reshape(shape)
    return np.asarray(cumulative[i] + x[i] * d + 0.5 * slope * d**2)


def distance_means(s: Floats, x: Floats, centres: Floats, length: float) -> Floats:
    """Means of a record over windows of a given length of the distance.

    `s` (float64[time]): Distance, increasing [m]. `x` (float64[time, ...]): Record. `centres`
    (float64[window]): Middles of the windows [m]; the windows lie within `s`. `length`: Length of
    a window [m]. Returns float64[window, ...].

    >>> s = np.array([0.0, 3.0, 4.0])
    >>> distance_means(s, 2.0 * s, np.array([1.0, 2.5]), 2.0).tolist()
    [2.0, 5.0]
    """
    cumulative = integral(s, x)
    high = _integral_at(s, x, cumulative, centres + 0.5 * length)
    return (high - _integral_at(s, x, cumulative, centres - 0.5 * length)) / length


def window_centres(begin: float, end: float, length: float, step: float) -> Floats:
    """Middles of windows that lie within begin and end, a step apart [m].

    >>> window_centres(10.0, 13.0, 2.0, 0.5).tolist()
    [11.0, 11.5, 12.0]
    """
    room = end - begin - length
    if room < -1e-9:
        return np.zeros(0)
    count = math.floor(room / step + 1e-9) + 1
    return np.asarray(begin + 0.5 * length + step * np.arange(count), dtype=np.float64)


class StreamingPercentiles:
    """Percentiles of a stream of any length within a stated bound.

    Counts values in cells of equal width; where a value falls outside, the cells are made twice as
    wide, so that there are never more than `CELLS` of them.

    `width`: Width of the cells at the start, later their present one: no percentile is further than
    this from one of the whole record.

    >>> stream = StreamingPercentiles(0.01)
    >>> for part in np.array_split(np.arange(1001.0), 7):
    ...     stream.add(part)
    >>> abs(stream.percentile(95.0) - 950.0) <= stream.width
    True
    """

    def __init__(self, width: float) -> None:
        self.width = width
        self._counts = np.zeros(CELLS, dtype=np.int64)
        self.count = 0

    def add(self, values: Floats) -> None:
        """Take further values; those that are not a number are left out."""
        values = np.ravel(values)
        values = values[np.isfinite(values)]
        if not len(values):
            return
        half = len(self._counts) // 2
        while float(np.max(np.abs(values))) >= half * self.width:
            self._widen()
        indices = np.floor(values / self.width).astype(np.int64) + half
        self._counts += np.bincount(indices, minlength=2 * half)
        self.count += len(values)

    def _widen(self) -> None:
        """Join neighbours: cells 2k and 2k + 1 counted from the middle."""
        half = len(self._counts) // 2
        pairs = self._counts.reshape(-1, 2).sum(axis=1)
        self._counts = np.zeros_like(self._counts)
        self._counts[half // 2 : half // 2 + half] = pairs
        self.width *= 2.0

    def percentile(self, per_cent: float) -> float:
        """Value below which `per_cent` of all values lie; nan without values."""
        if not self.count:
            return math.nan
        below = np.cumsum(self._counts)
        rank = per_cent / 100.0 * (self.count - 1) + 1.0
        cell = int(np.searchsorted(below, rank - 1e-9))
        return (cell - len(self._counts) // 2 + 0.5) * self.width
