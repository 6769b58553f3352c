"""Is the spring strong enough: solid height, stress of the solid spring, fatigue.

Pure functions of one spring, floats or arrays, SI.  Buckling is in `helical`, since it follows
from the same beam as the lateral stiffness.  What is compared with which limit is decided in
`verification`.

Letters of EN 13906-1: wire `d`, mean coil diameter `D`, active coils `n`, total coils `n_t`,
solid height `L_c`, smallest working height `L_n`, index `w = D/d`.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from railsim.springs.helical import Values


def total_coils(n: ArrayLike, dead_coils: float = 0.2, end_coils: float = 1.5) -> Values:
    """Total number of coils of a spring with closed and ground ends, `n_t = n + n_m + n_e`.

    Source: Grossi (2025), ch. 3; EN 13906-1:2013 has `n_m = 0`.
    """
    return np.asarray(n) + dead_coils + end_coils


def solid_height(n_t: ArrayLike, d: ArrayLike) -> Values:
    """Height of the solid spring, hot coiled, closed and ground ends, `L_c = (n_t - 0.3) d` [m].

    Source: EN 13906-1:2013, solid length.

    Examples
    --------
    >>> round(float(solid_height(total_coils(3.6), 0.041)), 6)
    0.205
    """
    return (np.asarray(n_t) - 0.3) * np.asarray(d)


def coil_clearance(n: ArrayLike, D: ArrayLike, d: ArrayLike, factor: float) -> Values:
    """Reserve wanted between the coils above the solid height, `factor n (D + d)` [m].

    Notes
    -----
    Grossi (2025), ch. 3, prints the factor 0.002.  EN 13906-1:2013 asks for 0.02 with hot coiled
    springs under static load and twice that under dynamic load.
    """
    return factor * np.asarray(n) * (np.asarray(D) + np.asarray(d))


def solid_stress(K_V: ArrayLike, d: ArrayLike, D: ArrayLike, travel: ArrayLike) -> Values:
    """Shear stress of the solid spring, `tau_c = 8 D F_c / (pi d^3)`, `F_c = K_V travel` [Pa].

    Parameters
    ----------
    K_V : float or ndarray
        Vertical stiffness [N/m].
    d, D : float or ndarray
        Wire diameter, mean coil diameter [m].
    travel : float or ndarray
        Deflection from the free to the solid height, `H0 - L_c` [m].

    Notes
    -----
    Without the curvature factor: EN 13906-1 compares this stress as it is.
    """
    force = np.asarray(K_V) * np.asarray(travel)
    return 8.0 * np.asarray(D) * force / (np.pi * np.asarray(d) ** 3)


def curvature_factor(w: ArrayLike) -> Values:
    """Stress correction for the curvature of the wire, `k = (w + 0.5)/(w - 0.75)`, `w = D/d`.

    Source: Bergstraesser, as given by EN 13906-1:2013.
    """
    w = np.asarray(w)
    return (w + 0.5) / (w - 0.75)


def corrected_stress(
    d: ArrayLike,
    D: ArrayLike,
    F_Z: ArrayLike,
    F_L: ArrayLike,
    height: ArrayLike,
    lateral: ArrayLike,
) -> Values:
    """Largest corrected shear stress of a spring under vertical and lateral force [Pa].

    `tau = k 8/(pi d^3) [F_Z (D + dx) + F_L (L - d)]`.

    Parameters
    ----------
    d, D : float or ndarray
        Wire diameter, mean coil diameter [m].
    F_Z, F_L : float or ndarray
        Vertical and lateral force [N].
    height : float or ndarray
        Height under load L [m].
    lateral : float or ndarray
        Lateral displacement of the seats against each other dx [m].

    Notes
    -----
    Lateral force and displacement count with their amounts, whichever way the spring is sheared.
    Source: EN 13906-1:2013, stress with lateral load; Grossi (2025), ch. 3.
    """
    d, D = np.asarray(d), np.asarray(D)
    moment = np.asarray(F_Z) * (D + np.abs(lateral)) + np.abs(F_L) * (np.asarray(height) - d)
    return curvature_factor(D / d) * 8.0 * moment / (np.pi * d**3)


def goodman_limit(goodman: Sequence[tuple[float, float]], tau_min: ArrayLike) -> Values:
    """Allowable upper stress at a lower stress, on a Goodman-Smith line [Pa].

    Parameters
    ----------
    goodman : sequence of (tau_min, tau_max)
        Corners of the line, straight in between; beyond them the first and last upper stress [Pa].
    tau_min : float or ndarray
        Lower stress [Pa].

    Examples
    --------
    >>> line = [(0.0, 430e6), (390e6, 690e6), (690e6, 690e6)]
    >>> float(goodman_limit(line, 195e6)) / 1e6
    560.0
    """
    lower, upper = np.transpose(np.asarray(goodman, dtype=float))
    return np.interp(np.asarray(tau_min, dtype=float), lower, upper)


def allowable_stress(table: Sequence[tuple[float, float]], d: ArrayLike) -> Values:
    """Allowable stress for a wire diameter: straight between rows (d, tau), held beyond [Pa]."""
    diameter, stress = np.transpose(np.asarray(table, dtype=float))
    return np.interp(np.asarray(d, dtype=float), diameter, stress)


def mass(d: ArrayLike, D: ArrayLike, n_t: ArrayLike, density: float) -> Values:
    """Mass of a spring, `rho pi d^2/4 * pi D n_t` [kg].

    The helix angle (about 1 % more) and the ground-off ends (less) are left out.
    """
    length = np.pi * np.asarray(D) * np.asarray(n_t)
    return density * 0.25 * np.pi * np.asarray(d) ** 2 * length


def surge_frequency(
    d: ArrayLike, D: ArrayLike, n: ArrayLike, G: ArrayLike, density: ArrayLike
) -> Values:
    """Lowest natural frequency of the coils between two held seats [Hz].

    `f_e = d/(2 pi n D^2) sqrt(G/(2 rho))`, that of a rod of the spring's stiffness and the mass of
    its active coils; EN 13906-1:2013 prints it as `3560 d/(n D^2) sqrt(G/rho)` in mm, N/mm^2 and
    kg/dm^3.

    Examples
    --------
    >>> round(float(surge_frequency(0.041, 0.230, 3.6, 78.5e9, 7850.0)), 1)
    76.6
    """
    slenderness = np.asarray(d) / (2.0 * np.pi * np.asarray(n) * np.asarray(D) ** 2)
    return slenderness * np.sqrt(np.asarray(G) / (2.0 * np.asarray(density)))
