"""Signals over arc length at equal steps."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import firwin, oaconvolve

from railsim.arrays import Floats

HALF = 32  # of the filter's length, in steps of the grid
SHAPE = 8.0  # of Kaiser's window: 80 dB


def on_grid(s: Floats, values: Floats, grid: Floats) -> Floats:
    """Values at equal steps, without waves shorter than two of them.

    A symmetric low pass with its corner at half the rate of the grid, then a cubic spline; at both
    ends signals are continued antisymmetrically.

    `s`, `values` (float64[n]): Rising arc lengths at nearly equal steps [m], and values there.
    `grid` (float64[m]): Equal steps [m].
    """
    step, own = grid[1] - grid[0], float(np.median(np.diff(s)))
    if own < step:
        n = min(2 * int(HALF * step / own) + 1, 2 * (len(s) // 2) - 1)
        taps, pad = firwin(n, own / step, window=("kaiser", SHAPE)), n // 2
        ends = 2.0 * values[0] - values[pad:0:-1], 2.0 * values[-1] - values[-2 : -pad - 2 : -1]
        values = oaconvolve(np.concatenate([ends[0], values, ends[1]]), taps, mode="valid")
    return np.asarray(CubicSpline(s, values)(grid))
