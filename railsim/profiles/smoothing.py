"""Smoothing of measured profiles against their own noise."""

import numpy as np
from scipy.interpolate import make_smoothing_spline

from railsim.arrays import Flags, Floats
from railsim.profiles.profile import Kind
from railsim.profiles.readers import Points

CURVATURE_NOISE = 3.0
"""Curvature that noise may leave after smoothing [1/m], some 4 % of a gauge corner's."""

SMOOTHING_WAVES = (1.0e-3, 10.0e-3)
"""Shortest and longest wave that smoothing halves [m]."""

LARGEST_NOISE = 0.1e-3
"""Noise beyond which nothing is left of the curvatures after smoothing [m]."""

NOISE_FLOOR = 0.15e-6
"""Noise below this is the rounding of printed numbers and is left alone [m]."""


def used_part(y: Floats, z: Floats, kind: Kind) -> Flags:
    """Intervals between points on which wheel and rail may touch."""
    middle_y, middle_z = 0.5 * (y[1:] + y[:-1]), 0.5 * (z[1:] + z[:-1])
    if kind == "rail":
        return np.asarray(middle_z < 0.012)
    tip = int(np.argmax(z))
    beside_tip = (np.arange(middle_y.size) > tip) & (middle_y > y[tip] + 3e-3)
    return np.asarray(beside_tip & (middle_y < 0.040))


def smoothed_points(work: Points) -> tuple[Floats, Floats]:
    """Points smoothed as much as their noise demands, no more.

    The noise is estimated from how much each point departs from the cubic through its four
    neighbours; the smoothing spline over the contour's length halves waves of the length L at
    which the curvature's noise, noise (2 pi/L)^2 sqrt(spacing/L), falls to `CURVATURE_NOISE`.
    """
    y, z = work.y, work.z
    s = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))))
    # noise along the contour hardly shows: it moves a point and its position s alike
    across = np.hypot(departures(s, y), departures(s, z))
    noise = float(np.median(across) / 0.6745) if across.size > 3 else 0.0
    if noise < NOISE_FLOOR:
        return y, z
    if noise > LARGEST_NOISE:
        raise work.fail(
            f"noise of {1e3 * noise:.2f} mm from point to point",
            f"up to {1e3 * LARGEST_NOISE:.1f} mm can be smoothed; measure again",
        )
    spacing = float(s[-1] / (s.size - 1))
    wave = float((noise * (2 * np.pi) ** 2 * np.sqrt(spacing) / CURVATURE_NOISE) ** 0.4)
    wave = float(np.clip(wave, *SMOOTHING_WAVES))
    if wave <= 2.5 * spacing:
        return y, z
    # a smoothing spline with penalty lam on the second derivative halves the wave 2 pi (lam ds)^1/4
    lam = (wave / (2 * np.pi)) ** 4 / spacing
    smooth_y = make_smoothing_spline(s, y, lam=lam)(s)
    smooth_z = make_smoothing_spline(s, z, lam=lam)(s)
    change = np.hypot(smooth_y - y, smooth_z - z)
    work.notes.append(
        f"noise of {1e6 * noise:.1f} um: smoothed over {1e3 * wave:.1f} mm, points moved by "
        f"{1e6 * np.sqrt(np.mean(change**2)):.1f} um rms, {1e6 * change.max():.0f} um at most"
    )
    return smooth_y, smooth_z


def departures(s: Floats, values: Floats) -> Floats:
    """How far samples over s stand from the cubic through their four neighbours, shape (n - 4,).

    Each over the factor by which noise of the five points widens it [unit of values].
    """
    centre = np.arange(2, s.size - 2)
    neighbours = centre[:, None] + np.array([-2, -1, 1, 2])
    weights = np.ones((centre.size, 4))
    near = s[neighbours]
    for a in range(4):
        for b in range(4):
            if a != b:
                weights[:, a] *= (s[centre] - near[:, b]) / (near[:, a] - near[:, b])
    predicted = np.sum(weights * values[neighbours], axis=1)
    spread = np.sqrt(1.0 + np.sum(weights**2, axis=1))
    return np.asarray((values[centre] - predicted) / spread)
