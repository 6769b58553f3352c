"""Kalker's creepage coefficients of elliptic contacts.

In the limit of small creepage the tangential force of an elliptic Hertz contact (semi-axis `a`
along the rolling direction, `b` across) is linear in the creepages::

    T_x = G a b c11 xi_x
    T_y = G a b c22 xi_y + G (a b)^1.5 c23 phi
    M_z = -G (a b)^1.5 c23 xi_y + G (a b)^2 c33 phi

with signs of force on the rail (see :mod:`railsim.contact.creep`).  The coefficients depend on
a/b and Poisson's ratio only.  Kalker computed and printed them for 19 ratios and three Poisson
numbers; outside 0.1 <= a/b <= 10 his asymptotic expressions lead on, scaled to join the table.

Read `kalker_coefficients` first; `creep_tables` prepares the small table that the time loop looks
up (kernel :func:`railsim.kernels.fastsim.look_up_kalker`).

Source: Kalker, J.J. (1990), Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer,
appendix E, table E.3 (C11, C22, C23 also stored in the public program CONTACT).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.errors import ModelError
from railsim.kernels.fastsim import KALKER_U_MAX

TABLE_POISSON = np.array([0.0, 0.25, 0.5])

# Table E.3: per row min(a/b, b/a); then C11, C22, C23, C33, each for nu = 0, 1/4, 1/2.
_TABLE_NARROW = np.array(  # a/b = 0.1 ... 1
    [
        [0.1, 2.51, 3.31, 4.85, 2.51, 2.52, 2.53, 0.334, 0.473, 0.731, 6.42, 8.28, 11.7],
        [0.2, 2.59, 3.37, 4.81, 2.59, 2.63, 2.66, 0.483, 0.603, 0.809, 3.46, 4.27, 5.66],
        [0.3, 2.68, 3.44, 4.80, 2.68, 2.75, 2.81, 0.607, 0.715, 0.889, 2.49, 2.96, 3.72],
        [0.4, 2.78, 3.53, 4.82, 2.78, 2.88, 2.98, 0.720, 0.823, 0.977, 2.02, 2.32, 2.77],
        [0.5, 2.88, 3.62, 4.83, 2.88, 3.01, 3.14, 0.827, 0.929, 1.07, 1.74, 1.93, 2.22],
        [0.6, 2.98, 3.72, 4.91, 2.98, 3.14, 3.31, 0.930, 1.03, 1.18, 1.56, 1.68, 1.86],
        [0.7, 3.09, 3.81, 4.97, 3.09, 3.28, 3.48, 1.03, 1.14, 1.29, 1.43, 1.50, 1.60],
        [0.8, 3.19, 3.91, 5.05, 3.19, 3.41, 3.65, 1.13, 1.25, 1.40, 1.34, 1.37, 1.42],
        [0.9, 3.29, 4.01, 5.12, 3.29, 3.54, 3.82, 1.23, 1.36, 1.51, 1.27, 1.27, 1.27],
        [1.0, 3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63, 1.21, 1.19, 1.16],
    ]
)
_TABLE_LONG = np.array(  # b/a = 0.1 ... 1
    [
        [0.1, 10.7, 11.7, 12.9, 10.7, 12.8, 16.0, 12.2, 14.6, 18.0, 0.795, 0.526, 0.228],
        [0.2, 6.96, 7.78, 8.82, 6.96, 8.14, 9.79, 5.72, 6.63, 7.89, 0.828, 0.601, 0.341],
        [0.3, 5.57, 6.34, 7.34, 5.57, 6.40, 7.51, 3.79, 4.32, 5.01, 0.868, 0.674, 0.446],
        [0.4, 4.84, 5.57, 6.57, 4.84, 5.48, 6.31, 2.88, 3.24, 3.70, 0.912, 0.747, 0.549],
        [0.5, 4.37, 5.10, 6.11, 4.37, 4.90, 5.56, 2.35, 2.62, 2.96, 0.958, 0.819, 0.650],
        [0.6, 4.06, 4.78, 5.80, 4.06, 4.50, 5.04, 2.01, 2.23, 2.50, 1.01, 0.892, 0.751],
        [0.7, 3.82, 4.54, 5.58, 3.82, 4.21, 4.67, 1.76, 1.95, 2.18, 1.05, 0.965, 0.852],
        [0.8, 3.65, 4.36, 5.42, 3.65, 3.99, 4.39, 1.58, 1.75, 1.94, 1.10, 1.04, 0.954],
        [0.9, 3.51, 4.22, 5.30, 3.51, 3.81, 4.16, 1.44, 1.59, 1.77, 1.16, 1.11, 1.06],
        [1.0, 3.40, 4.12, 5.20, 3.40, 3.67, 3.98, 1.33, 1.47, 1.63, 1.21, 1.19, 1.16],
    ]
)
_G_MIN = 0.1  # least axis ratio of the printed table


def kalker_coefficients(
    a_over_b: ArrayLike, nu: float = 0.28
) -> tuple[Floats, Floats, Floats, Floats]:
    """Kalker's creepage coefficients c11, c22, c23, c33 of an elliptic contact.

    Linear in g = min(a/b, b/a) between the printed rows; 1/C quadratic in nu through the printed
    values at 0, 1/4 and 1/2 (Kalker's own rule, also that of CONTACT).  For g < 0.1 Kalker's
    asymptotic expressions times the factor that makes them meet the table at g = 0.1.

    `a_over_b`: ratio of the semi-axes, along over across, > 0 [1]; `nu`: Poisson's ratio (of both
    bodies), 0 <= nu <= 0.5 [1]. Returns `c11, c22, c23, c33`: coefficients [1]. Raises ModelError:
    if a_over_b is not positive and finite or nu lies outside 0..0.5.

    Notes
    -----
    Printed to three digits (0.2 %); at the printed rows within 1 % of a recomputation with the full
    half-space theory for a/b <= 5 (C22 1.6 % at 10).  c33 is the least accurate (1.3 % up to
    a/b = 2.5).  Between the rows straight lines are too high, the more the slenderer the patch: C23
    by 5 % at a/b = 4 and 14 % at 7, C33 by 12 % at 0.14.  Powers of g would be within 1.5 %, but
    FASTSIM would then differ from that of other programs, which take straight lines, and be no
    closer to the full theory.
    Source: Kalker (1990), table E.3 and its asymptotes.

    >>> [round(float(c), 2) for c in kalker_coefficients(1.0, nu=0.25)]
    [4.12, 3.67, 1.47, 1.19]
    """
    ratio = np.asarray(a_over_b, dtype=float)
    if not np.all(np.isfinite(ratio) & (ratio > 0.0)):
        raise ModelError("Kalker's coefficients need a ratio of semi-axes a/b > 0")
    if not 0.0 <= nu <= 0.5:
        raise ModelError(f"Kalker's coefficients need Poisson's ratio in 0..0.5, not {nu}")
    g = np.minimum(ratio, 1.0 / ratio)
    narrow = ratio <= 1.0
    inside, beyond = np.maximum(g, _G_MIN), np.minimum(g, _G_MIN)

    def coefficient(number: int) -> Floats:
        found = [
            _interpolate(table, number, inside, nu)
            * (asymptote(number, beyond, nu) / asymptote(number, _G_MIN, nu))
            for table, asymptote in _HALVES
        ]
        return np.where(narrow, *found)

    return coefficient(0), coefficient(1), coefficient(2), coefficient(3)


@lru_cache(10)  # a study asks for it once for every run
def creep_tables(nu: float = 0.28) -> Floats:
    """Kalker's coefficients on a grid for the look-up inside the time loop.

    `nu`: Poisson's ratio [1]. Returns `table`, shape (257, 4): c11, c22, c23, c33 at uniform nodes
    of u = (a - b)/(a + b) over -KALKER_U_MAX..KALKER_U_MAX (1/24 <= a/b <= 24) [1]. Linear
    interpolation on 257 nodes follows `kalker_coefficients` within 0.02 % but for the corners that
    it rounds (0.9 % at a/b = 0.2, 5 and 10); the look-up keeps the end values outside.
    """
    u = np.linspace(-KALKER_U_MAX, KALKER_U_MAX, 257)
    return np.ascontiguousarray(np.stack(kalker_coefficients((1.0 + u) / (1.0 - u), nu), axis=1))


def _interpolate(table: Floats, number: int, g: Floats, nu: float) -> Floats:
    """Coefficient `number` of one half of the table at axis ratio g and Poisson's ratio nu."""
    at_nu = [np.interp(g, table[:, 0], table[:, 1 + 3 * number + k]) for k in range(3)]
    n0, n1, n2 = TABLE_POISSON
    weights = (
        (nu - n1) * (nu - n2) / ((n0 - n1) * (n0 - n2)),
        (nu - n0) * (nu - n2) / ((n1 - n0) * (n1 - n2)),
        (nu - n0) * (nu - n1) / ((n2 - n0) * (n2 - n1)),
    )
    inverse = sum(w / c for w, c in zip(weights, at_nu, strict=True))
    return np.asarray(1.0 / inverse)


def _asymptote_narrow(number: int, g: ArrayLike, nu: float) -> Floats:
    """Kalker's limit for a/b = g -> 0 (Kalker 1990, table E.3, upper asymptote)."""
    g = np.asarray(g, dtype=float)
    log_term = np.log(16.0 / g**2)
    if number == 0:
        return np.full_like(g, np.pi**2 / (4.0 * (1.0 - nu)))
    if number == 1:
        return np.full_like(g, np.pi**2 / 4.0)
    if number == 2:
        correction = nu * (0.5 * log_term + np.log(4.0) - 5.0) / ((1.0 - nu) * log_term + 2.0 * nu)
        return np.asarray(np.pi * np.sqrt(g) / (3.0 * (1.0 - nu)) * (1.0 + correction))
    return np.asarray(np.pi**2 / (16.0 * (1.0 - nu) * g))


def _asymptote_long(number: int, g: ArrayLike, nu: float) -> Floats:
    """Kalker's limit for b/a = g -> 0 (Kalker 1990, table E.3, lower asymptote)."""
    g = np.asarray(g, dtype=float)
    log_term = np.log(16.0 / g**2)
    if number == 0:
        d = log_term - 2.0 * nu
        return np.asarray(2.0 * np.pi / (d * g) * (1.0 + (3.0 - np.log(4.0)) / d))
    if number == 1:
        d = (1.0 - nu) * log_term + 2.0 * nu
        return np.asarray(2.0 * np.pi / (d * g) * (1.0 + (1.0 - nu) * (3.0 - np.log(4.0)) / d))
    d = (1.0 - nu) * log_term - 2.0 + 4.0 * nu
    if number == 2:
        return np.asarray(2.0 * np.pi / (3.0 * g * np.sqrt(g) * d))
    return np.asarray(np.pi / 4.0 * (1.0 - nu * (log_term - 2.0) / d))


# of the table and its limits: a/b up to 1, and beyond
_HALVES = ((_TABLE_NARROW, _asymptote_narrow), (_TABLE_LONG, _asymptote_long))
