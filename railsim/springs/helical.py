"""Stiffness of a cylindrical helical compression spring of round wire.

One truth for the design tool and for the vehicle: vertical stiffness after EN 13906-1, lateral
and tilting stiffness after Krettek and Sobczak, buckling after EN 13906-1.  All functions are
pure, in SI, and accept floats or arrays that broadcast against each other.

Assumptions: the coil column is a homogeneous elastic beam that shears and bends (Haringx), both
seats stay flat against the spring, the material is linear.  Start reading at `beam_stiffnesses`.

The textbook form of the Krettek-Sobczak stiffnesses divides 0 by 0 as the load vanishes.  Here
they are written with functions that are smooth there (`_tangent_remainder` and its kin), so that
the unloaded spring is not a special case:

    F/B (1 + F/S) = k_h^2,   y = (k_h H_s / 2)^2
    C_q = 1 / [ t(y) H_s / S + (1 + F/S) H_s^3 q(y) / (4 B) ],  t = tan(x)/x, q = (t - 1)/x^2
    C_r = C_q [ B/S + (1 + F/S) H_s^2 r(4 y) ],                 r = (1 - u cot u)/u^2

Letters as in EN 13906-1 and SPRINGS: wire `d`, mean coil diameter `D`, active coils `n`, free
height `H0`, deflection `dz`, vertical stiffness `K_V`.
"""

from typing import Any

import numpy as np

from railsim.errors import ModelError

Values = Any  # A float or an array: the result has the broadcast shape of the arguments

# Below this value of x^2 the quotients are summed as series: the closed forms would lose half of
# the digits to cancellation, the series are cut where they are exact to 1e-13.
_SERIES_BELOW = 5e-3


def vertical_stiffness(G: Values, d: Values, D: Values, n: Values) -> Values:
    """Vertical stiffness `K_V = G d^4 / (8 n D^3)` of shear modulus G [Pa], wire and coils [N/m].

    Source: EN 13906-1:2013, spring rate R.

    >>> round(vertical_stiffness(78.48e9, 0.041, 0.230, 3.6))
    632876
    """
    return G * d**4 / (8.0 * n * D**3)


def active_coils(G: Values, d: Values, D: Values, K_V: Values) -> Values:
    """Number of active coils that gives the vertical stiffness `K_V`, `n = G d^4 / (8 K_V D^3)`.

    >>> round(active_coils(78.48e9, 0.041, 0.230, 632875.4), 3)
    3.6
    """
    return G * d**4 / (8.0 * K_V * D**3)


def beam_rigidities(K_V: Values, D: Values, height: Values, nu: Values) -> tuple[Values, Values]:
    """Bending [N m^2] and shear rigidity [N] of the beam that replaces the coil column.

    `B = (1 + nu) D^2 K_V H_s / (4 + 2 nu)`, `S = 2 (1 + nu) K_V H_s` at the height under load H_s.
    Source: Krettek and Sobczak, as quoted by Grossi (2025), ch. 2.
    """
    column = K_V * height
    return (1.0 + nu) / (4.0 + 2.0 * nu) * D**2 * column, 2.0 * (1.0 + nu) * column


def beam_stiffnesses(
    K_V: Values, D: Values, H0: Values, dz: Values, nu: Values
) -> tuple[Values, Values]:
    """Lateral [N/m] and tilting stiffness [N m/rad] of the loaded beam, seats parallel.

    `C_q = F / (2/k_h (1 + F/S) tan(k_h H_s / 2) - H_s)` and
    `C_r = C_q B/F (1 + F/S - k_h H_s / tan(k_h H_s))` with `F = K_V dz`, `H_s = H0 - dz`,
    `k_h = sqrt(F/B (1 + F/S))`.  C_q vanishes where the spring buckles with one seat free to move
    sideways (`k_h H_s = pi`), is negative beyond, and tends to the shear beam
    `1 / (H0/S + H0^3/(12 B))` as dz -> 0; C_r, for seats not displaced sideways, then tends to the
    beam clamped at both ends, `E I/L (4 + p)/(1 + p)` with `p = 12 B/(S H0^2)`.

    Raises ModelError: `dz` outside [0, H0): a compression spring does not pull, and has a height.

    Source: Krettek and Sobczak, as quoted by Grossi (2025), ch. 2; C_q is the same as EN 13906-1's
    transverse spring rate R_Q.

    >>> [round(float(C)) for C in beam_stiffnesses(632875.4, 0.230, 0.338, 0.0734697, 0.3125)]
    [676538, 23250]
    """
    if np.any(np.real(dz) < 0.0) or np.any(np.real(dz) >= np.real(H0)):
        raise ModelError(
            "the deflection of a compression spring is outside 0 to its free height: "
            f"deflection {np.min(np.real(dz)):.6g} to {np.max(np.real(dz)):.6g} m, "
            f"free height {np.min(np.real(H0)):.6g} to {np.max(np.real(H0)):.6g} m"
        )
    Hs = H0 - dz
    B, S = beam_rigidities(K_V, D, Hs, nu)
    load_ratio = dz / (2.0 * (1.0 + nu) * Hs)
    # F/B with the stiffness cancelled: the shape of the beam does not depend on K_V
    y = np.asarray(dz * (1.0 + load_ratio) * Hs * (4.0 + 2.0 * nu) / (4.0 * (1.0 + nu) * D**2))
    remainder = _tangent_remainder(y)
    shear = (1.0 + y * remainder) * Hs / S
    bending = (1.0 + load_ratio) * Hs**3 * remainder / (4.0 * B)
    with np.errstate(divide="ignore"):  # a pole, far beyond buckling
        C_q = 1.0 / (shear + bending)
    return C_q, C_q * (B / S + (1.0 + load_ratio) * Hs**2 * _cotangent_remainder(4.0 * y))


def lateral_and_tilting(
    K_V: Values, D: Values, H0: Values, dz: Values, nu: Values
) -> tuple[Values, Values]:
    """Lateral [N/m] and tilting ("conical") stiffness [N m/rad] of a helical spring under load.

    `K_L = a1 C_q`, `K_C = a3 C_r` with the empirical factors `a1 = 1.9619 dz/H0 + 0.674` and
    `a3 = 0.8945 dz/H0 + 0.669` on `beam_stiffnesses`.
    Source: Grossi (2025), ch. 2, in the form his program uses (his text prints 0.669 twice).
    """
    C_q, C_r = beam_stiffnesses(K_V, D, H0, dz, nu)
    return (1.9619 * dz / H0 + 0.674) * C_q, (0.8945 * dz / H0 + 0.669) * C_r


def lateral_stiffness(K_V: Values, D: Values, H0: Values, dz: Values, nu: Values) -> Values:
    """Lateral stiffness of a helical spring under load, `K_L = a1 C_q` [N/m].

    The outer and the inner spring of the reference nest at the mounting load:

    >>> outer = lateral_stiffness(632875.4, 0.230, 0.338, 0.0734697, 0.3125)
    >>> inner = lateral_stiffness(303464.5, 0.142, 0.338, 0.0734697, 0.3125)
    >>> round(float(outer + inner), -2)
    884700.0
    """
    return lateral_and_tilting(K_V, D, H0, dz, nu)[0]


def lateral_stiffness_wahl(K_V: Values, D: Values, H0: Values, dz: Values, nu: Values) -> Values:
    """Lateral stiffness after Wahl without his load factor, `1/(H_s/S + H_s^3/(12 B))` [N/m].

    That of the column of the height under load as if it bore no load: an upper bound.  Wahl's
    chart of the load factor `C_l >= 1`, which divides it, is not free.  For steel this is Wahl's
    `d^4 / (n D (0.204 H_s^2 + 0.265 D^2))` 10^6 psi.
    Source: A. M. Wahl, Mechanical springs (1944, 1963), lateral loading.
    """
    height = H0 - dz
    B, S = beam_rigidities(K_V, D, height, nu)
    return 1.0 / (height / S + height**3 / (12.0 * B))


def seat_moment(F: Values, K_L: Values, height: Values) -> Values:
    """Moment of a seat over the lateral displacement, `(F + K_L H_s) / 2` [N].

    A spring sheared with parallel seats balances the couple of its vertical and lateral forces by
    equal moments at both ends.  By reciprocity it is also the lateral force over the rotation of
    one seat.
    """
    return 0.5 * (F + K_L * height)


def buckling_deflection(H0: Values, D: Values, nu: Values, seating: Values = 1.0) -> Values:
    """Deflection at which a helical spring buckles, `inf` where it never does [m].

    `s_k = H0 0.5/(1 - G/E) (1 - sqrt(1 - (1 - G/E)/(0.5 + G/E) (pi D/(seating H0))^2))` with
    `G/E = 1/(2 (1 + nu))` and the seating coefficient of EN 13906-1: 0.5 both seats held; 0.7 one
    held, one hinged; 1 both hinged, or parallel with one free to move sideways; 2 one held, one
    free.  For 1 this is exactly where `C_q` of `beam_stiffnesses` vanishes.
    Source: EN 13906-1:2013, buckling.

    >>> float(buckling_deflection(0.338, 0.142, 0.3125))
    inf
    >>> round(float(buckling_deflection(0.600, 0.142, 0.3125)), 4)
    0.1056
    """
    modular_ratio = 0.5 / (1.0 + nu)
    slenderness = (np.pi * D / (seating * H0)) ** 2
    root = 1.0 - (1.0 - modular_ratio) / (0.5 + modular_ratio) * slenderness
    deflection = H0 * 0.5 / (1.0 - modular_ratio) * (1.0 - np.sqrt(np.maximum(root, 0.0)))
    return np.where(root >= 0.0, deflection, np.inf)


def _by_series_or_closed(y: Values, closed_form: Any, coefficients: tuple[float, ...]) -> Values:
    """`closed(y)` where y is large enough, else the power series with `coefficients`."""
    small = np.abs(y) < _SERIES_BELOW
    series = np.zeros_like(y)
    for coefficient in reversed(coefficients):
        series = series * y + coefficient
    return np.where(small, series, closed_form(np.where(small, 1.0, y)))


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
