"""Is the spring strong enough: solid height, stress of the solid spring, fatigue.

Pure functions of one spring, floats or arrays, SI.  Buckling is in `helical`, since it follows
from the same beam as the lateral stiffness.  What is compared with which limit is decided in
`verification`.

Letters of EN 13906-1: wire `d`, mean coil diameter `D`, active coils `n`, total coils `n_t`,
solid height `L_c`, smallest working height `L_n`, index `w = D/d`.
"""

from collections.abc import Sequence

import numpy as np

from railsim.springs.helical import Values

Table = Sequence[tuple[float, float]]


def total_coils(n: Values, dead_coils: float = 0.2, end_coils: float = 1.5) -> Values:
    """Total number of coils of a spring with closed and ground ends, `n_t = n + n_m + n_e`.

    Source: Grossi (2025), ch. 3; EN 13906-1:2013 has `n_m = 0`.
    """
    return n + dead_coils + end_coils


def solid_height(n_t: Values, d: Values) -> Values:
    """Height of the solid spring, hot coiled, closed and ground ends, `L_c = (n_t - 0.3) d` [m].

    Source: EN 13906-1:2013, solid length.

    >>> round(solid_height(total_coils(3.6), 0.041), 6)
    0.205
    """
    return (n_t - 0.3) * d


def coil_clearance(n: Values, D: Values, d: Values, factor: float) -> Values:
    """Reserve required between the coils above the solid height, `factor n (D + d)` [m].

    Grossi (2025), ch. 3, prints the factor 0.002.  EN 13906-1:2013 asks for 0.02 with hot coiled
    springs under static load and twice that under dynamic load.
    """
    return factor * n * (D + d)


def shear_stress(F: Values, d: Values, D: Values) -> Values:
    """Shear stress of the wire without correction, `tau = 8 D F / (pi d^3)` [Pa]."""
    return 8.0 * D * F / (np.pi * d**3)


def solid_stress(K_V: Values, d: Values, D: Values, travel: Values) -> Values:
    """Shear stress of the spring compressed by `travel` = H0 - L_c to its solid height [Pa].

    Without the curvature factor: EN 13906-1 compares this stress as it is.
    """
    return shear_stress(K_V * travel, d, D)


def curvature_factor(w: Values) -> Values:
    """Stress correction for the curvature of the wire, `k = (w + 0.5)/(w - 0.75)`, `w = D/d`.

    Source: Bergstraesser, as given by EN 13906-1:2013.
    """
    return (w + 0.5) / (w - 0.75)


def corrected_stress(
    d: Values, D: Values, F_Z: Values, F_L: Values, height: Values, lateral: Values
) -> Values:
    """Largest corrected shear stress of a spring under vertical and lateral force [Pa].

    `tau = k 8/(pi d^3) [F_Z (D + dx) + F_L (L - d)]` with the height under load L and the lateral
    displacement of the seats dx.  Lateral force and displacement count with their amounts,
    whichever way the spring is sheared.
    Source: EN 13906-1:2013, stress with lateral load; Grossi (2025), ch. 3.
    """
    moment = F_Z * (D + np.abs(lateral)) + np.abs(F_L) * (height - d)
    return curvature_factor(D / d) * 8.0 * moment / (np.pi * d**3)


def goodman_limit(goodman: Table, tau_min: Values) -> Values:
    """Allowable upper stress at a lower stress [Pa], on a line of corners (tau_min, tau_max).

    Straight in between; beyond the corners the first and last upper stress.

    >>> line = [(0.0, 430e6), (390e6, 690e6), (690e6, 690e6)]
    >>> float(goodman_limit(line, 195e6)) / 1e6
    560.0
    """
    return np.interp(tau_min, *np.transpose(goodman))


def allowable_stress(table: Table, d: Values) -> Values:
    """Allowable stress for a wire diameter: straight between rows (d, tau), held beyond [Pa]."""
    return np.interp(d, *np.transpose(table))


def mass(d: Values, D: Values, n_t: Values, density: float) -> Values:
    """Mass of a spring, `rho pi d^2/4 * pi D n_t` [kg], but for its helix and its ground ends."""
    return density * 0.25 * np.pi * d**2 * (np.pi * D * n_t)


def surge_frequency(d: Values, D: Values, n: Values, G: Values, density: Values) -> Values:
    """Lowest natural frequency of the coils between two held seats [Hz].

    `f_e = d/(2 pi n D^2) sqrt(G/(2 rho))`, that of a rod of the spring's stiffness and the mass of
    its active coils; EN 13906-1:2013 prints it as `3560 d/(n D^2) sqrt(G/rho)` in mm, N/mm^2 and
    kg/dm^3.

    >>> round(float(surge_frequency(0.041, 0.230, 3.6, 78.5e9, 7850.0)), 1)
    76.6
    """
    return d / (2.0 * np.pi * n * D**2) * np.sqrt(G / (2.0 * density))
