"""Parts of a run whose speed is nearly constant, and their signals over arc length."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, oaconvolve

from railsim.arrays import Flags, Floats
from railsim.errors import Fault, Faults, input_error, nearest
from railsim.measurement import Measurement
from railsim.result.sensors import READINGS

STEP = 0.25  # m
LONGEST, OVERLAP, SHORTEST = 2000.0, 200.0, 300.0  # of pieces [m]
SPEEDS = 0.06  # largest over smallest speed of a piece, less 1
MARGIN = 20.0  # at both ends of a record [m]
SLOWEST = 5.0  # m/s
AROUND_GAP = 8  # steps beside a gap that are left out
HALF = 32  # of the filter of `on_grid`, in steps of the grid
SHAPE = 8.0  # of its window, Kaiser's: 80 dB


@dataclass(frozen=True)
class Piece:
    """Part of a run at a nearly constant speed.

    `signals`, `valid` (float64[channel, n]): What the channels read, and where they do.
    """

    grid: Floats  # arc length of the reference body, equal steps [m], float64[n]
    signals: Floats
    valid: Flags
    speeds: Floats  # [m/s], float64[n]
    rate: float  # values of the record per second [1/s]

    @property
    def speed(self) -> float:
        """Mean speed, three digits [m/s]."""
        return float(f"{np.mean(self.speeds):.3g}")


def used_channels(measurement: Measurement, sensors: dict[str, Any]) -> dict[str, str]:
    """Outputs of the linear vehicle by channel: ``axlebox_1_left.z``."""
    used, faults = {}, Faults()
    for name, quantity in measurement.quantities.items():
        kind, *labels = quantity.split(":")
        if kind not in READINGS:
            continue
        if labels[0] not in sensors:
            found = f"the vehicle has no sensor '{labels[0]}'"
            key = f"channels.{name}.quantity"
            faults.append(Fault(measurement.name, key, found, nearest(labels[0], sensors)))
            continue
        used[name] = f"{labels[0]}.{labels[1] if len(labels) > 1 else 'roll_rate'}"
    if not used and not faults:
        allowed = "sensor_acceleration:axlebox_1_left:z and others of axleboxes, frames and floor"
        faults.append(Fault(measurement.name, "channels", "no accelerations", allowed))
    faults.check()
    return used


def pieces_of(measurement: Measurement, names: list[str]) -> list[Piece]:
    """Divide a run where its speed changes."""
    s, v = measurement.distance, measurement.speed
    length, name = s[-1] - s[0], measurement.name
    if length < SHORTEST + 2.0 * MARGIN:
        raise input_error(name, f"{length:.0f} m", f"{SHORTEST:g} m at least", "distance")
    if v.min() < SLOWEST:
        raise input_error(name, f"{v.min():.3g} m/s", f"{SLOWEST:g} m/s at least", "speed")
    pieces, begin, last = [], float(s[0]) + MARGIN, float(s[-1]) - MARGIN
    while True:
        inside = (s >= begin) & (s <= min(begin + LONGEST, last))
        speeds = v[inside]
        spread = np.maximum.accumulate(speeds) / np.minimum.accumulate(speeds) - 1.0
        count = int(np.searchsorted(spread, SPEEDS))
        end = min(max(float(s[inside][min(count, len(speeds)) - 1]), begin + SHORTEST), last)
        if last - end < SHORTEST - OVERLAP:
            end = last
        pieces.append(_piece(measurement, names, begin, end))
        if end >= last:
            return pieces
        begin = end - OVERLAP


def on_grid(s: Floats, values: Floats, grid: Floats) -> Floats:
    """Values at equal steps, without waves shorter than two of them.

    A symmetric low pass with its corner at half the rate of the grid, then a cubic spline; at both
    ends signals are continued antisymmetrically.

    `s`, `values` (float64[n]): Rising arc lengths at nearly equal steps [m], and values there.
    `grid` (float64[m]): Equal steps [m].
    """
    step, spacing = grid[1] - grid[0], float(np.median(np.diff(s)))
    if spacing < step:
        n = 2 * int(HALF * step / spacing) + 1
        taps, pad = firwin(n, spacing / step, window=("kaiser", SHAPE)), n // 2
        ends = 2.0 * values[0] - values[pad:0:-1], 2.0 * values[-1] - values[-2 : -pad - 2 : -1]
        values = oaconvolve(np.concatenate([ends[0], values, ends[1]]), taps, mode="valid")
    return np.asarray(CubicSpline(s, values)(grid))


def _piece(measurement: Measurement, names: list[str], begin: float, end: float) -> Piece:
    reach = HALF * STEP + 1.0
    part = measurement.part(begin - reach, end + reach)
    grid: Floats = begin + STEP * np.arange(int((end - begin) / STEP) + 1, dtype=np.float64)
    signals, valid = [], []
    for name in names:
        x = part[name]
        missing = np.isnan(x)
        lost = np.zeros(len(grid), dtype=bool)
        if missing.all():
            signals.append(np.zeros(len(grid)))
            valid.append(lost)
            continue
        if missing.any():
            x = np.interp(part.distance, part.distance[~missing], x[~missing])
            near = np.searchsorted(grid, part.distance[missing])
            lost[np.clip(near, 0, len(grid) - 1)] = True
            lost = np.convolve(lost, np.ones(2 * AROUND_GAP + 1), mode="same") > 0
        signals.append(on_grid(part.distance, x, grid))
        valid.append(~lost)
    speeds = np.interp(grid, part.distance, part.speed)
    return Piece(grid, np.array(signals), np.array(valid), speeds, measurement.rate)
