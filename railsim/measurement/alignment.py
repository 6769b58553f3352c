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
    shifts = [shift_of(*signal) for signal in signals]
    agreeing = [a for a in shifts if a is not None and a.share >= AGREEING]
    best = max((a.correlation for a in agreeing), default=0.0)
    alike = sorted((s for s in agreeing if s.correlation >= best - AS_ALIKE), key=lambda s: s.shift)
    middle = alike[len(alike) // 2] if alike else None
    near = [a for a in agreeing if middle is not None and abs(a.shift - middle.shift) < NEAR]
    return middle if len(near) >= TOGETHER * len(shifts) else None


def shift_of(
    s: Floats, x: Floats, s_reference: Floats, reference: Floats, *, most: float = MOST_SHIFT
) -> Shift | None:
    """Return by how much the arc lengths of one signal must be changed to match another.

    `s`, `x` (float64[n]): signal over its own arc length [m]; NaN in gaps; `s_reference`,
    `reference` (float64[m]): signal at the right place; `most`: largest shift that is looked for
    [m]. Returns: None where no window of the signals is alike.
    """
    valid = np.isfinite(x)
    if valid.sum() < 10:
        return None
    low, high = max(s[0], s_reference[0]), min(s[-1], s_reference[-1])
    length = min(WINDOW, (high - low) / 2.0)
    if length < 4.0 * STEP:
        return None
    most = min(most, 0.4 * length)
    grid = np.arange(low, high, STEP)
    a, b = np.interp(grid, s[valid], x[valid]), np.interp(grid, s_reference, reference)
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
    centred, b, ones = a - a.mean(), b - b.mean(), np.ones(len(a))
    energy = np.correlate(b**2, ones) - np.correlate(b, ones) ** 2 / len(a)
    scale = np.sqrt(np.maximum(energy, 0.0) * np.sum(centred**2))
    # where b is constant, rounding is no likeness
    values = np.correlate(b, centred) / np.where(scale > 1e-6 * scale.max(), scale, np.inf)
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
    channel = next((name for name in CURVATURES if name in measurement), None)
    if channel is not None:
        x = measurement[channel]
        x = x / np.maximum(measurement.speed, 1.0) if channel == "yaw_rate" else x
        reference, places = Alignment(track).curvature(grid), s
        basis = "curvature"
    else:
        boxes = fnmatch.filter(measurement.quantities.values(), "sensor_acceleration:axlebox_1*:z")
        box, displacement_of = next(iter(boxes), None), displacement(track)
        if box is None or displacement_of is None:
            allowed = (
                "a channel of curvature, yaw_rate or axlebox_1's vertical acceleration with "
                "irregularities"
            )
            raise argument_error("track", "nothing to align by", allowed)
        level = displacement_of(grid)[0][[1, 3]].mean(axis=0)
        reference = np.gradient(np.gradient(level, STEP), STEP)
        source = vehicle or measurement.definition.vehicle
        if source is None:
            allowed = "give it, or the key 'vehicle' of the measurement"
            raise argument_error("vehicle", "none", allowed)
        carrier = source if isinstance(source, Vehicle) else load_vehicle(source)
        places = s + all_sensors(carrier)[box.split(":")[1]].along
        x = measurement[box] / np.maximum(measurement.speed, 1.0) ** 2
        step = float(np.mean(np.diff(s)))
        valid = np.isfinite(x)
        x = np.interp(s, s[valid], x[valid])
        x = band_passed(x, 1.0 / step, 1.0 / WAVES[1], 1.0 / WAVES[0])
        reference = band_passed(reference, 1.0 / STEP, 1.0 / WAVES[1], 1.0 / WAVES[0])
        basis = "level of the rails"
    shift = shift_of(places, x, grid, reference, most=most)
    if shift is None:
        allowed = f"a place known within {most:g} m; the right track; signs and units"
        raise argument_error("track", f"the {basis} matches nowhere", allowed)
    astray = shift.windows - shift.near
    if shift.near < AGREEING * shift.windows:
        found = f"{astray} of {shift.windows} windows of the {basis} are not at one shift and drift"
        raise argument_error("measurement", found, "a counter that does not jump; the right track")
    jumps = f" {astray} of them lie elsewhere: does the counter jump?" if astray else ""
    return measurement.moved(shift.shift, shift.stretch).with_remarks(
        f"Aligned by the {basis}: {shift.shift:+.2f} m at the beginning, "
        f"{1e3 * shift.stretch:+.2f} m/km (correlation {shift.correlation:.2f} in "
        f"{shift.windows} windows).{jumps}"
    )
