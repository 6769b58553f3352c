"""Equivalent conicity of EN 15302 by integration of the wheelset's motion.

A wheelset that rolls without slip on a straight track follows

    y'' = -delta_r(y)/(e r0)          (' = d/dx, e the distance of the contact points),

which has the potential S(y), S' = delta_r.  The oscillation between y_min and y_max, with
S(y_min) = S(y_max) and y_max - y_min = 2 amplitude, has the wavelength

    lambda = 2 sqrt(e r0) I,   I = integral dy/sqrt(2 (S(y_max) - S(y))),

and the conical wheelset of the same wavelength has tan(gamma_e) = (2 pi/lambda)^2 e r0/2, so that
tan(gamma_e) = pi^2/(2 I^2), whatever e and r0.  Between two points of a linearly interpolated
delta_r the motion is harmonic, parabolic or hyperbolic, and I is added up from these exact pieces:
no step size enters, and jumps, dead zones and turning points need no special care.

Source: EN 15302:2008+A1, annex B and C; J. Klingel (1883).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.errors import ModelError


def equivalent_conicity(y: ArrayLike, delta_r: ArrayLike, amplitudes: ArrayLike) -> Floats:
    """Equivalent conicity of a rolling radius difference function.

    Parameters
    ----------
    y : ndarray, shape (n,)
        Lateral displacements of the wheelset, increasing [m].
    delta_r : ndarray, shape (n,)
        Rolling radius difference, right minus left, growing with y for a stable wheelset [m].
    amplitudes : ndarray, shape (n_amplitude,)
        Amplitudes of the oscillation, > 0 [m].

    Returns
    -------
    ndarray, shape (n_amplitude,)
        tan(gamma_e) [1]; nan where the oscillation leaves the given range of y or does not exist;
        0 where the wheelset meets no restoring radius difference within the amplitude.

    Raises
    ------
    ModelError
        If the function is not one: fewer than two points, y not increasing, or not finite.

    Examples
    --------
    A wheelset with cones of 1:40:

    >>> y = np.linspace(-0.01, 0.01, 201)
    >>> equivalent_conicity(y, 2 * y / 40, [0.003]).round(6).tolist()
    [0.025]
    """
    y = np.asarray(y, dtype=np.float64)
    delta_r = np.asarray(delta_r, dtype=np.float64)
    wanted = np.atleast_1d(np.asarray(amplitudes, dtype=np.float64))
    if y.ndim != 1 or y.size < 2 or y.shape != delta_r.shape:
        raise ModelError("a rolling radius difference needs two or more points (y, delta_r)")
    if not (np.all(np.isfinite(y)) and np.all(np.isfinite(delta_r)) and np.all(np.diff(y) > 0)):
        raise ModelError("a rolling radius difference needs finite values and increasing y")
    if not np.all(wanted > 0):
        raise ModelError("amplitudes must be positive")
    potential = np.concatenate(([0.0], np.cumsum(0.5 * (delta_r[1:] + delta_r[:-1]) * np.diff(y))))
    return np.array([_conicity(y, delta_r, potential, float(a)) for a in wanted])


def _value(y: Floats, delta_r: Floats, potential: Floats, at: Floats | float) -> Floats:
    """Radius differences and potentials at positions within the range, float64[2, ...]."""
    i = np.clip(np.searchsorted(y, at, side="right") - 1, 0, y.size - 2)
    d = at - y[i]
    slope = (delta_r[i + 1] - delta_r[i]) / (y[i + 1] - y[i])
    return np.array([delta_r[i] + slope * d, potential[i] + d * (delta_r[i] + 0.5 * slope * d)])


def _orbit_centre(y: Floats, delta_r: Floats, potential: Floats, amplitude: float) -> float | None:
    """Middle of the oscillation with the given amplitude: the same potential at both ends."""
    lower, upper = y[0] + amplitude, y[-1] - amplitude
    if lower > upper + 1e-12:
        return None

    def excess(centre: Floats | float) -> Any:
        low, high = (_value(y, delta_r, potential, centre + a)[1] for a in (-amplitude, amplitude))
        return high - low

    # sign changes where the function starts falling to the left of the wheelset's middle
    grid = np.linspace(lower, upper, 401) if upper > lower else np.array([lower])
    values = excess(grid)
    scale = np.max(np.abs(potential)) + 1e-300
    rising = np.flatnonzero((values[:-1] <= 0.0) & (values[1:] > 0.0))
    if rising.size == 0:
        flat = np.flatnonzero(np.abs(values) <= 1e-9 * scale)
        return float(grid[flat[np.argmin(np.abs(grid[flat]))]]) if flat.size else None
    from scipy.optimize import brentq  # long to import, and few commands need it

    i = int(rising[np.argmin(np.abs(grid[rising]))])
    return float(brentq(excess, grid[i], grid[i + 1], xtol=1e-15))


def _conicity(y: Floats, delta_r: Floats, potential: Floats, amplitude: float) -> float:
    """Equivalent conicity for one amplitude [1]."""
    centre = _orbit_centre(y, delta_r, potential, amplitude)
    if centre is None:
        return float("nan")
    ends = (centre - amplitude, centre + amplitude)
    # points nearer to an end than round-off would give pieces without length
    inside = (y > ends[0] + 1e-9 * amplitude) & (y < ends[1] - 1e-9 * amplitude)
    first, last = (_value(y, delta_r, potential, end) for end in ends)
    positions = np.concatenate(([ends[0]], y[inside], [ends[1]]))
    forces = np.concatenate(([first[0]], delta_r[inside], [last[0]]))
    top = 0.5 * (first[1] + last[1])
    room = top - np.concatenate(([top], potential[inside], [top]))
    scale = np.max(np.abs(potential - potential[np.argmin(np.abs(y - centre))])) + 1e-300
    if np.min(room) < -1e-9 * scale:
        return float("nan")  # a hump in between: no oscillation of this amplitude
    if np.max(room) <= 1e-9 * scale:
        return 0.0
    # exact times over the pieces, on which the force is linear in y
    speed = np.sqrt(2.0 * np.maximum(room, 0.0))
    dy = np.diff(positions)
    f0, f1, v0, v1 = forces[:-1], forces[1:], speed[:-1], speed[1:]
    slope = (f1 - f0) / dy
    omega = np.sqrt(np.abs(slope))
    with np.errstate(divide="ignore", invalid="ignore"):
        straight = 2.0 * dy / (v0 + v1)
        harmonic = (np.arctan2(f1, omega * v1) - np.arctan2(f0, omega * v0)) / omega
        hyperbolic = np.log((omega * v1 - f1) / (omega * v0 - f0)) / omega
        exact = np.where(slope > 0.0, harmonic, hyperbolic)
    # the closed forms cancel where the force is nearly constant over the piece
    nearly_constant = omega * straight < 1e-3
    time = float(np.sum(np.where(nearly_constant, straight, exact)))
    return float(0.5 * np.pi**2 / time**2)
