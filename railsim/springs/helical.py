"""Stiffness of a cylindrical helical compression spring of round wire.

One truth for the design tool and for the vehicle: vertical stiffness after EN 13906-1, lateral
and tilting stiffness after Krettek and Sobczak, buckling after EN 13906-1.  All functions are
pure, in SI, and accept floats or arrays that broadcast against each other.

Assumptions: the coil column is a homogeneous elastic beam that shears and bends (Haringx), both
seats stay flat against the spring, the material is linear.  Start reading at `lateral_stiffness`.

The textbook form of the Krettek-Sobczak stiffnesses divides 0 by 0 as the load vanishes.  Here
they are written with functions that are smooth there (`_tangent_quotient` and its kin), so that
the unloaded spring is not a special case:

    F/B (1 + F/S) = k_h^2,   y = (k_h H_s / 2)^2
    C_q = 1 / [ t(y) H_s / S + (1 + F/S) H_s^3 q(y) / (4 B) ],  t = tan(x)/x, q = (t - 1)/x^2
    C_r = C_q [ B/S + (1 + F/S) H_s^2 r(4 y) ],                 r = (1 - u cot u)/u^2

Letters as in EN 13906-1 and SPRINGS: wire `d`, mean coil diameter `D`, active coils `n`, free
height `H0`, deflection `dz`, vertical stiffness `K_V`.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railsim.errors import ModelError

Values = Any
"""A float or an array: the result has the broadcast shape of the arguments."""

# Below this value of x^2 the quotients are summed as series: the closed forms would lose half of
# the digits to cancellation, the series are cut where they are exact to 1e-13.
_SERIES_BELOW = 5e-3


def vertical_stiffness(G: ArrayLike, d: ArrayLike, D: ArrayLike, n: ArrayLike) -> Values:
    """Vertical stiffness of a helical spring, `K_V = G d^4 / (8 n D^3)`.

    Parameters
    ----------
    G : float or ndarray
        Shear modulus [Pa].
    d, D : float or ndarray
        Wire diameter and mean coil diameter [m].
    n : float or ndarray
        Number of active coils.

    Returns
    -------
    K_V : float or ndarray
        Force over deflection along the spring's axis [N/m].

    Notes
    -----
    Source: EN 13906-1:2013, spring rate R.

    Examples
    --------
    >>> round(float(vertical_stiffness(78.48e9, 0.041, 0.230, 3.6)))
    632876
    """
    return np.asarray(G) * np.asarray(d) ** 4 / (8.0 * np.asarray(n) * np.asarray(D) ** 3)


def active_coils(G: ArrayLike, d: ArrayLike, D: ArrayLike, K_V: ArrayLike) -> Values:
    """Number of active coils that gives the vertical stiffness `K_V`, `n = G d^4 / (8 K_V D^3)`.

    Parameters as in `vertical_stiffness`; it is the same equation solved for `n`.

    Examples
    --------
    >>> round(float(active_coils(78.48e9, 0.041, 0.230, 632875.4)), 3)
    3.6
    """
    return np.asarray(G) * np.asarray(d) ** 4 / (8.0 * np.asarray(K_V) * np.asarray(D) ** 3)


def poisson_number(E: ArrayLike, G: ArrayLike) -> Values:
    """Poisson's ratio of an isotropic material, `nu = E / (2 G) - 1`."""
    return np.asarray(E) / (2.0 * np.asarray(G)) - 1.0


def beam_rigidities(K_V: ArrayLike, D: ArrayLike, height: ArrayLike, nu: ArrayLike) -> Values:
    """Bending and shear rigidity of the beam that replaces the coil column.

    `B = (1 + nu) D^2 K_V H_s / (4 + 2 nu)`, `S = 2 (1 + nu) K_V H_s`.

    Parameters
    ----------
    K_V : float or ndarray
        Vertical stiffness [N/m].
    D, height : float or ndarray
        Mean coil diameter, height under load `H_s` [m].
    nu : float or ndarray
        Poisson's ratio.

    Returns
    -------
    B, S : float or ndarray
        Bending rigidity [N m^2] and shear rigidity [N].

    Notes
    -----
    Source: Krettek and Sobczak, as quoted by Grossi (2025), ch. 2.
    """
    nu = np.asarray(nu)
    column = np.asarray(K_V) * np.asarray(height)
    return (1.0 + nu) / (4.0 + 2.0 * nu) * np.asarray(D) ** 2 * column, 2.0 * (1.0 + nu) * column


def beam_lateral_stiffness(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Lateral stiffness `C_q` of the loaded beam, seats parallel.

    `C_q = F / (2/k_h (1 + F/S) tan(k_h H_s / 2) - H_s)` with `F = K_V dz`, `H_s = H0 - dz`,
    `k_h = sqrt(F/B (1 + F/S))`.  It vanishes where the spring buckles with one seat free to move
    sideways (`k_h H_s = pi`) and is negative beyond.

    Parameters
    ----------
    K_V : float or ndarray
        Vertical stiffness [N/m].
    D, H0 : float or ndarray
        Mean coil diameter and free height [m].
    dz : float or ndarray
        Vertical deflection, 0 <= dz < H0 [m].
    nu : float or ndarray
        Poisson's ratio.

    Returns
    -------
    C_q : float or ndarray
        Lateral force over lateral displacement of one seat against the other [N/m].

    Raises
    ------
    ModelError
        `dz` outside [0, H0): a compression spring does not pull, and has a height.

    Notes
    -----
    Tends to the shear beam `1 / (H0/S + H0^3/(12 B))` as dz -> 0.
    Source: Krettek and Sobczak, as quoted by Grossi (2025), ch. 2; the same as EN 13906-1's
    transverse spring rate R_Q.

    Examples
    --------
    >>> round(float(beam_lateral_stiffness(632875.4, 0.230, 0.338, 0.0734697, 0.3125)))
    676538
    """
    B, S, load_ratio, y, Hs = _beam(K_V, D, H0, dz, nu)
    shear = _tangent_quotient(y) * Hs / S
    bending = (1.0 + load_ratio) * Hs**3 * _tangent_remainder(y) / (4.0 * B)
    return 1.0 / (shear + bending)


def beam_tilting_stiffness(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Tilting stiffness `C_r` of the loaded beam, seats not displaced sideways.

    `C_r = C_q B/F (1 + F/S - k_h H_s / tan(k_h H_s))`, see `beam_lateral_stiffness` for the
    letters and the parameters.

    Returns
    -------
    C_r : float or ndarray
        Moment over rotation of one seat against the other [N m/rad].

    Raises
    ------
    ModelError
        `dz` outside [0, H0).

    Notes
    -----
    Tends to the beam clamped at both ends, `E I/L (4 + p)/(1 + p)` with `p = 12 B/(S H0^2)`, as
    dz -> 0.  Source: Krettek and Sobczak, as quoted by Grossi (2025), ch. 2.
    """
    B, S, load_ratio, y, Hs = _beam(K_V, D, H0, dz, nu)
    lever = B / S + (1.0 + load_ratio) * Hs**2 * _cotangent_remainder(4.0 * y)
    return beam_lateral_stiffness(K_V, D, H0, dz, nu) * lever


def lateral_factor(H0: ArrayLike, dz: ArrayLike) -> Values:
    """Empirical factor `a1 = 1.9619 dz/H0 + 0.674` on the beam's lateral stiffness.

    Source: Grossi (2025), ch. 2, in the form his program uses (his text prints 0.669).
    """
    return 1.9619 * np.asarray(dz) / np.asarray(H0) + 0.674


def tilting_factor(H0: ArrayLike, dz: ArrayLike) -> Values:
    """Empirical factor `a3 = 0.8945 dz/H0 + 0.669` on the beam's tilting stiffness.

    Source: Grossi (2025), ch. 2.
    """
    return 0.8945 * np.asarray(dz) / np.asarray(H0) + 0.669


def lateral_stiffness(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Lateral stiffness of a helical spring under load, `K_L = a1 C_q` [N/m].

    Parameters and errors as in `beam_lateral_stiffness`.

    Examples
    --------
    The outer and the inner spring of the reference nest at the mounting load:

    >>> outer = lateral_stiffness(632875.4, 0.230, 0.338, 0.0734697, 0.3125)
    >>> inner = lateral_stiffness(303464.5, 0.142, 0.338, 0.0734697, 0.3125)
    >>> round(float(outer + inner), -2)
    884700.0
    """
    return lateral_factor(H0, dz) * beam_lateral_stiffness(K_V, D, H0, dz, nu)


def lateral_stiffness_wahl(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Lateral stiffness after Wahl without his load factor, `1/(H_s/S + H_s^3/(12 B))` [N/m].

    That of the column of the height under load as if it bore no load: an upper bound.  Wahl's
    chart of the load factor `C_l >= 1`, which divides it, is not free.
    Parameters and errors as in `beam_lateral_stiffness`.

    Notes
    -----
    For steel this is Wahl's `d^4 / (n D (0.204 H_s^2 + 0.265 D^2))` 10^6 psi.
    Source: A. M. Wahl, Mechanical springs (1944, 1963), lateral loading.
    """
    height = np.asarray(H0) - np.asarray(dz)
    B, S = beam_rigidities(K_V, D, height, nu)
    return 1.0 / (height / S + height**3 / (12.0 * B))


def tilting_stiffness(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Tilting ("conical") stiffness of a helical spring under load, `K_C = a3 C_r` [N m/rad].

    Parameters and errors as in `beam_lateral_stiffness`.  A shear-spring element whose lateral
    force acts half-way between its ends already carries `K_L H_s^2 / 4` of it: its own bending
    stiffness is `shear_spring_bending`.
    """
    return tilting_factor(H0, dz) * beam_tilting_stiffness(K_V, D, H0, dz, nu)


def shear_spring_bending(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> Values:
    """Bending stiffness left for a shear-spring element, `K_C - K_L H_s^2 / 4` [N m/rad].

    The element's lateral force `K_L` acts at the middle of the spring, which resists a rotation
    of one seat by `K_L H_s^2 / 4`; this is the rest of the tilting stiffness `K_C`.
    Parameters and errors as in `beam_lateral_stiffness`.
    """
    Hs = np.asarray(H0) - np.asarray(dz)
    tilting = tilting_stiffness(K_V, D, H0, dz, nu)
    return tilting - lateral_stiffness(K_V, D, H0, dz, nu) * Hs**2 / 4.0


def seat_moment(F: ArrayLike, K_L: ArrayLike, height: ArrayLike) -> Values:
    """Moment of a seat over the lateral displacement, `(F + K_L H_s) / 2` [N].

    A spring sheared with parallel seats balances the couple of its vertical and lateral forces by
    equal moments at both ends.  By reciprocity it is also the lateral force over the rotation of
    one seat.

    Parameters
    ----------
    F : float or ndarray
        Vertical force [N].
    K_L : float or ndarray
        Lateral stiffness [N/m].
    height : float or ndarray
        Height under load `H_s` [m].
    """
    return 0.5 * (np.asarray(F) + np.asarray(K_L) * np.asarray(height))


def buckling_deflection(
    H0: ArrayLike, D: ArrayLike, nu: ArrayLike, seating: ArrayLike = 1.0
) -> Values:
    """Deflection at which a helical spring buckles, `inf` where it never does.

    `s_k = H0 0.5/(1 - G/E) (1 - sqrt(1 - (1 - G/E)/(0.5 + G/E) (pi D/(seating H0))^2))`.

    Parameters
    ----------
    H0, D : float or ndarray
        Free height and mean coil diameter [m].
    nu : float or ndarray
        Poisson's ratio; `G/E = 1/(2 (1 + nu))`.
    seating : float or ndarray
        Seating coefficient of EN 13906-1: 0.5 both seats held; 0.7 one held, one hinged; 1 both
        hinged, or parallel with one free to move sideways; 2 one held, one free.

    Returns
    -------
    s_k : float or ndarray
        Deflection at buckling, `inf` for a spring that does not buckle [m].

    Notes
    -----
    For `seating = 1` this is exactly where `beam_lateral_stiffness` vanishes.
    Source: EN 13906-1:2013, buckling.

    Examples
    --------
    >>> float(buckling_deflection(0.338, 0.142, 0.3125))
    inf
    >>> round(float(buckling_deflection(0.600, 0.142, 0.3125)), 4)
    0.1056
    """
    H0, D, seating = np.asarray(H0), np.asarray(D), np.asarray(seating)
    modular_ratio = 0.5 / (1.0 + np.asarray(nu))
    slenderness = (np.pi * D / (seating * H0)) ** 2
    root = 1.0 - (1.0 - modular_ratio) / (0.5 + modular_ratio) * slenderness
    deflection = H0 * 0.5 / (1.0 - modular_ratio) * (1.0 - np.sqrt(np.maximum(root, 0.0)))
    return np.where(root >= 0.0, deflection, np.inf)


def _beam(
    K_V: ArrayLike, D: ArrayLike, H0: ArrayLike, dz: ArrayLike, nu: ArrayLike
) -> tuple[Values, Values, Values, Values, Values]:
    """Rigidities B and S, load ratio F/S, y = (k_h H_s/2)^2 and the height under load H_s."""
    K_V, D, H0, dz, nu = (np.asarray(value) for value in (K_V, D, H0, dz, nu))
    if np.any(dz.real < 0.0) or np.any(dz.real >= H0.real):
        raise ModelError(
            "the deflection of a compression spring is outside 0 to its free height: "
            f"deflection {np.min(dz.real):.6g} to {np.max(dz.real):.6g} m, "
            f"free height {np.min(H0.real):.6g} to {np.max(H0.real):.6g} m"
        )
    Hs = H0 - dz
    B, S = beam_rigidities(K_V, D, Hs, nu)
    load_ratio = dz / (2.0 * (1.0 + nu) * Hs)
    # F/B with the stiffness cancelled: the shape of the beam does not depend on K_V
    y = dz * (1.0 + load_ratio) * Hs * (4.0 + 2.0 * nu) / (4.0 * (1.0 + nu) * D**2)
    return B, S, load_ratio, y, Hs


def _by_series_or_closed(y: Values, closed: Any, coefficients: tuple[float, ...]) -> Values:
    """`closed(y)` where y is large enough, else the power series with `coefficients`."""
    small = np.abs(y) < _SERIES_BELOW
    series = np.zeros_like(y)
    for coefficient in reversed(coefficients):
        series = series * y + coefficient
    return np.where(small, series, closed(np.where(small, 1.0, y)))


def _tangent_quotient(y: Values) -> Values:
    """tan(x)/x of y = x^2."""
    return 1.0 + y * _tangent_remainder(y)


def _tangent_remainder(y: Values) -> Values:
    """(tan(x)/x - 1)/x^2 of y = x^2; 1/3 at 0."""

    def closed(y: Values) -> Values:
        x = np.sqrt(y)
        return (np.tan(x) / x - 1.0) / y

    return _by_series_or_closed(y, closed, (1 / 3, 2 / 15, 17 / 315, 62 / 2835, 1382 / 155925))


def _cotangent_remainder(y: Values) -> Values:
    """(1 - u cot(u))/u^2 of y = u^2; 1/3 at 0."""

    def closed(y: Values) -> Values:
        u = np.sqrt(y)
        return (1.0 - u / np.tan(u)) / y

    return _by_series_or_closed(y, closed, (1 / 3, 1 / 45, 2 / 945, 1 / 4725, 2 / 93555))
