"""Where on the track a run was measured: shift and stretch of its arc length.

Two signals over the arc length are held against each other in windows: the shift of each window is
the largest cross-correlation, between its grid points by a parabola, and a line through the
shifts of all windows gives the whole shift and the drift of the mileage.
"""

import fnmatch
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.loading import load_vehicle
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import argument_error
from railsim.measurement.data import Measurement
from railsim.result.filters import band_passed
from railsim.result.sensors import all_sensors
from railsim.track.alignment import Alignment
from railsim.track.irregularity import displacement

STEP = 0.1  # m, grid of the comparison
WINDOW = 250.0  # m
CLEAR = 0.6  # correlation from which a window counts
AGREEING = 0.5  # share of the windows of a signal that must show one shift
TOGETHER = 1.0 / 3.0  # share of the signals that must show it
NEAR = 3.0  # m, of the line through all shifts
MOST_SHIFT = 30.0  # m, largest shift that is looked for
AS_ALIKE = 0.05  # below the largest correlation
WAVES = (3.0, 40.0)  # m, that an axlebox and the track's level share
CURVATURES = ("curvature", "yaw_rate")


@dataclass(frozen=True)
class Shift:
    """How the arc length of a run has to be changed."""

    shift: float  # at its first value [m]
    stretch: float  # change per metre [1]
    correlation: float  # median over the windows that count [1]
    windows: int  # that count
    near: int  # of those, that lie near the line
    share: float  # of all windows that count and lie near the line


def common_shift(signals: Iterable[tuple[Floats, Floats, Floats, Floats]]) -> Shift | None:
    """Return the shift of a run with several signals: the median of those that are most alike.

    `signals`: arguments of `shift_of` of each. One signal that lags, however clear it is, so does
    not move the others. Returns: None where no signal has one shift in half of its windows, or the
    others do not share it.
    """
    every = [shift_of(*signal) for signal in signals]
    found = [one for one in every if one is not None and one.share >= AGREEING]
    best = max((one.correlation for one in found), default=0.0)
    alike = sorted((s for s in found if s.correlation >= best - AS_ALIKE), key=lambda s: s.shift)
    middle = alike[len(alike) // 2] if alike else None
    near = [one for one in found if middle is not None and abs(one.shift - middle.shift) < NEAR]
    return middle if len(near) >= TOGETHER * len(every) else None


def shift_of(
    s: Floats, x: Floats, s_reference: Floats, reference: Floats, *, most: float = MOST_SHIFT
) -> Shift | None:
    """Return by how much the arc lengths of one signal must be changed to match another.

    `s`, `x` (float64[n]): signal over its own arc length [m]; NaN in gaps; `s_reference`,
    `reference` (float64[m]): signal at the right place; `most`: largest shift that is looked for
    [m]. Returns: None where no window of the signals is alike.
    """
    known = np.isfinite(x)
    if known.sum() < 10:
        return None
    low, high = max(s[0], s_reference[0]), min(s[-1], s_reference[-1])
    length = min(WINDOW, (high - low) / 2.0)
    if length < 4.0 * STEP:
        return None
    most = min(most, 0.4 * length)
    grid = np.arange(low, high, STEP)
    a, b = np.interp(grid, s[known], x[known]), np.interp(grid, s_reference, reference)
    size, reach = int(length / STEP), int(most / STEP)
    clear = []  # middle, shift and correlation of windows
    begins = range(reach, len(grid) - size - reach + 1, max(1, size // 2))
    for begin in begins:
        rows = slice(begin, begin + size)
        place, correlation = _lag(a[rows], b[begin - reach : begin + size + reach])
        if correlation > CLEAR:
            clear.append([grid[rows].mean() - s[0], (place - reach) * STEP, correlation])
    if not clear:
        return None
    middles, shifts, correlations = np.transpose(clear)
    stretch, at_zero = 0.0, np.median(shifts)
    near = np.abs(shifts - at_zero) < 0.01 * np.ptp(middles)
    if np.count_nonzero(near) > 2:
        stretch, at_zero = np.polyfit(middles[near], shifts[near], 1)
    near = int(np.sum(np.abs(shifts - at_zero - stretch * middles) < NEAR))
    line, alike = (float(at_zero), float(stretch)), float(np.median(correlations))
    return Shift(*line, alike, len(shifts), near, near / len(begins))


def _lag(a: Floats, b: Floats) -> tuple[float, float]:
    """Place of a within the longer b in grid points, and the correlation there."""
    own, b, ones = a - a.mean(), b - b.mean(), np.ones(len(a))
    energy = np.correlate(b**2, ones) - np.correlate(b, ones) ** 2 / len(a)
    scale = np.sqrt(np.maximum(energy, 0.0) * np.sum(own**2))
    # where b is constant, rounding is no likeness
    values = np.correlate(b, own) / np.where(scale > 1e-6 * scale.max(), scale, np.inf)
    k = int(np.argmax(values))
    offset = 0.0
    if 0 < k < len(values) - 1:
        left, middle, right = values[k - 1 : k + 2]
        bend = left - 2.0 * middle + right
        offset = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return k + float(offset), float(values[k])


def aligned(
    measurement: Measurement, track: Track, vehicle: Vehicle | None = None, *, most: float = 50.0
) -> Measurement:
    """Return a run with its arc length put right by the track.

    By a channel of `curvature` or `yaw_rate` (over the speed) against the plan; otherwise by the
    vertical acceleration of an axlebox against v^2 d2z/ds2 of the rails' mean level, waves of 3 to
    40 m, where the vehicle (given, or named by the file) says how far ahead the axlebox is.

    Raises InputError: no such channel, a track without curves and irregularities, nothing alike,
    no line near half of the windows.
    """
    s = measurement.distance
    grid = np.arange(s[0] - most, s[-1] + most, STEP)
    by = next((name for name in CURVATURES if name in measurement), None)
    if by is not None:
        x = measurement[by]
        x = x / np.maximum(measurement.speed, 1.0) if by == "yaw_rate" else x
        reference, at = Alignment(track).curvature(grid), s
        words = "curvature"
    else:
        boxes = fnmatch.filter(measurement.quantities.values(), "sensor_acceleration:axlebox_1*:z")
        box, moved = next(iter(boxes), None), displacement(track)
        if box is None or moved is None:
            allowed = (
                "a channel of curvature, yaw_rate or axlebox_1's vertical acceleration with "
                "irregularities"
            )
            raise argument_error("track", "nothing to align by", allowed)
        level = moved(grid)[0][[1, 3]].mean(axis=0)
        reference = np.gradient(np.gradient(level, STEP), STEP)
        named = vehicle or measurement.definition.vehicle
        if named is None:
            allowed = "give it, or the key 'vehicle' of the measurement"
            raise argument_error("vehicle", "none", allowed)
        carrying = named if isinstance(named, Vehicle) else load_vehicle(named)
        at = s + all_sensors(carrying)[box.split(":")[1]].along
        x = measurement[box] / np.maximum(measurement.speed, 1.0) ** 2
        step = float(np.mean(np.diff(s)))
        known = np.isfinite(x)
        x = np.interp(s, s[known], x[known])
        x = band_passed(x, 1.0 / step, 1.0 / WAVES[1], 1.0 / WAVES[0])
        reference = band_passed(reference, 1.0 / STEP, 1.0 / WAVES[1], 1.0 / WAVES[0])
        words = "level of the rails"
    found = shift_of(at, x, grid, reference, most=most)
    if found is None:
        allowed = f"a place known within {most:g} m; the right track; signs and units"
        raise argument_error("track", f"the {words} matches nowhere", allowed)
    apart = found.windows - found.near
    if found.near < AGREEING * found.windows:
        words = f"{apart} of {found.windows} windows of the {words} are not at one shift and drift"
        raise argument_error("measurement", words, "a counter that does not jump; the right track")
    jumps = f" {apart} of them lie elsewhere: does the counter jump?" if apart else ""
    return measurement.moved(found.shift, found.stretch).with_remarks(
        f"Aligned by the {words}: {found.shift:+.2f} m at the beginning, "
        f"{1e3 * found.stretch:+.2f} m/km (correlation {found.correlation:.2f} in "
        f"{found.windows} windows).{jumps}"
    )
