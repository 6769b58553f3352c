"""Equal time steps: the clock of a record, its gaps, channels that lag behind it.

A clock that is written with few digits is a straight line over the number of the value, as long as
it leaves this line by less than a quarter of a step, or by less than half a step where all steps
are multiples of the shortest and one in 25 or more is twice as long (a seldom one is a value that
was lost); where values are missing, the line begins anew on the same grid.
Other records are interpolated linearly onto the median step.
"""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats, Integers, stretches
from railsim.errors import input_error

JUMP = 1.5  # steps, from which on a time step is a gap
INTERPOLATED = 2.0  # as many times as long where values are interpolated
ROUNDED = 0.25  # steps
MOST_LOST = 50.0  # times the values that there are
FEWEST_LONG = 0.04  # share of double steps in a clock of few digits; seldom ones are lost values


@dataclass(frozen=True)
class Clock:
    """Equal time steps, and where the values of a record lie on them."""

    time: Floats  # equal steps [s]
    rate: float  # values per second [1/s]
    places: Integers | None  # instant of each value; None where values are interpolated
    written: Floats  # times of the values as the file has them [s]
    remarks: tuple[str, ...] = ()

    def on_grid(self, x: Floats) -> Floats:
        """Return values of the file at the equal steps, NaN where there are none."""
        if self.places is not None:
            if len(self.places) == len(self.time):
                return x
            values = np.full(len(self.time), np.nan)
            values[self.places] = x
            return values
        valid = np.isfinite(x)
        if valid.sum() < 2:
            return np.full(len(self.time), np.nan)
        t = self.written[valid]
        values = np.interp(self.time, t, x[valid], np.nan, np.nan)
        after = np.clip(np.searchsorted(t, self.time), 1, len(t) - 1)
        values[t[after] - t[after - 1] > INTERPOLATED * JUMP / self.rate] = np.nan
        return values


def clock_of(file: str, times: Floats) -> Clock:
    """Return the clock of a record from the times that it holds [s].

    Raises InputError: a time that is missing or does not rise; gaps much longer than the record.
    """
    steps = np.diff(times)
    wrong = np.flatnonzero(~(steps > 0.0))
    if not np.isfinite(times).all() or len(wrong):
        row = int(wrong[0]) + 2 if len(wrong) else 1
        found = f"time {times[row - 1]:.10g} s of value {row} does not rise"
        allowed = "times that rise from value to value; of too few digits: 'rate' in place of them"
        raise input_error(file, found, allowed, key="time")
    count = np.arange(len(times))
    slope, first = np.polyfit(count - count.mean(), times - times.mean(), 1)
    line = times.mean() + first + slope * (count - count.mean())
    digits = steps / steps.min()
    if (
        digits.max() < 2.5
        and (digits > JUMP).sum() > max(2.0, FEWEST_LONG * len(steps))
        and np.abs(digits - np.round(digits)).max() < 0.01
        and np.abs(times - line).max() < 0.5 * slope  # a value that is lost leaves it by more
    ):
        return Clock(line, 1.0 / float(slope), count, times)
    median = float(np.median(steps))
    ends = np.flatnonzero(steps > JUMP * median)
    step = float(steps[steps <= JUMP * median].mean())
    span = float(times[-1] - times[0])
    if span / step > MOST_LOST * len(times):
        found = f"a gap of {steps.max():g} s"
        raise input_error(file, found, "a record in one piece, or two files", key="time")
    places, begin = np.zeros(len(times), dtype=np.int64), 0
    deviation = 0.0
    for end in [*ends.tolist(), len(times) - 1]:
        piece = times[begin : end + 1]
        count = np.arange(len(piece))
        offset = float(np.mean(piece - count * step))
        first = round((offset - times[0]) / step)
        places[begin : end + 1] = first + count
        deviation = max(deviation, float(np.abs(piece - times[0] - (first + count) * step).max()))
        begin = end + 1
    rising = bool((np.diff(places) > 0).all())
    on_line = rising and deviation < (ROUNDED + 0.5 * bool(len(ends))) * step
    gaps = steps[steps > (1.0 if on_line else INTERPOLATED) * JUMP * median]
    remarks = [f"The record has gaps: {len(gaps)}, together {gaps.sum():.3g} s."] * bool(len(gaps))
    if on_line:
        time = times[0] + step * np.arange(places[-1] - places[0] + 1)
        return Clock(time, 1.0 / step, places - places[0], times, tuple(remarks))
    remarks.append(
        f"The time steps are unequal ({steps.min():.3g} to {steps.max():.3g} s); the channels "
        f"are interpolated to {1.0 / median:.6g} values per second."
    )
    time = times[0] + median * np.arange(int(span / median + 1e-6) + 1)
    return Clock(time, 1.0 / median, None, times, tuple(remarks))


def joined_times(parts: list[Floats]) -> tuple[Floats, int]:
    """Return the times of several files as one record, and how many files begin their clock anew.

    A file whose clock does not continue that of the one before follows it after one step.
    """
    times, restarts = parts[0], 0
    for part in parts[1:]:
        if len(part) and len(times) and part[0] <= times[-1]:
            step = float(np.median(np.diff(part))) if len(part) > 1 else 0.0
            part = part - part[0] + times[-1] + step
            restarts += 1
        times = np.concatenate([times, part])
    return times, restarts


def delayed(x: Floats, steps: float) -> Floats:
    """Return values taken from later steps: those of a channel that lags by `steps`.

    Cubic polynomials through four neighbours (Lagrange); NaN where one of them is missing.

    >>> delayed(np.arange(6.0), 1.5).tolist()
    [1.5, 2.5, 3.5, nan, nan, nan]
    """
    whole = int(np.floor(steps))
    f = steps - whole
    weights = {
        -1: -f * (f - 1.0) * (f - 2.0) / 6.0,
        0: (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0,
        1: -(f + 1.0) * f * (f - 2.0) / 2.0,
        2: (f + 1.0) * f * (f - 1.0) / 6.0,
    }
    if f == 0.0:
        weights = {0: 1.0}
    values = np.zeros(len(x))
    for k, weight in weights.items():
        row = np.arange(len(x)) + whole + k
        values += weight * np.where((row >= 0) & (row < len(x)), x.take(row, mode="clip"), np.nan)
    return values


def bridged(x: Floats, longest: int) -> Floats:
    """Return values with gaps of up to `longest` values filled by straight lines."""
    missing = np.isnan(x)
    if not longest or not missing.any() or missing.all():
        return x
    filled = x.copy()
    for begin, end in stretches(missing):
        if begin > 0 and end < len(x) and end - begin <= longest:
            t = np.arange(1, end - begin + 1) / (end - begin + 1)
            filled[begin:end] = x[begin - 1] + t * (x[end] - x[begin - 1])
    return filled
