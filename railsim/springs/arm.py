"""An axlebox arm on concentric helical springs: equilibrium, stored energy, all loads at once.

The arm of length `L` turns about a hinge on the bogie frame and carries the axle at its end.  The
springs stand on the arm, their seats a height above the axle's centre, and press against the frame.
A bush resists the rotation.  The arm is horizontal and the bush unloaded at the mounting load.

The rotation `phi` is positive when the axle has moved up towards the frame (load above the
mounting load).  Then a seat at height `h` above the axle has moved

    up         dz - dz_horizontal = L sin(phi) + h (cos(phi) - 1)
    sideways   dx = L (1 - cos(phi)) + h sin(phi)        towards the hinge

SPRINGS counts theta = |phi| and turns the signs below the mounting load; with a signed rotation
the two branches are one formula.  Since `P` enters the moment linearly, the load is an explicit
function of the rotation (`load`), and `rotation` inverts it.

Two forms of the moment that the nest exerts on the arm:

`grossi`
    Grossi (2025), ch. 2: the vertical force at the lever `L`, the lateral one at the lever `h`,
    the seats' tilting and shearing moments.  Gives the reference's numbers.
`energy`
    The derivative of the nest's stored energy (`stored_energy`): levers of the turned arm, the
    lateral force that the seat's rotation causes (reciprocal to the moment of its displacement),
    and the change of the lateral stiffness with deflection.  Conserves energy by construction.

A spring that joins later (tare-and-laden nests) carries nothing until it touches.  Its ends are not
flush at once: lateral and tilting stiffness set in over the first `SETTLING` of its deflection, so
that the load has no step.  Settling is not elastic: the form `energy` differentiates the stored
energy of the share that has settled, and conserves energy outside that short stretch.

Everything broadcasts: a thousand nests under five loads are one call with arrays of shape
(nest, 1) in the springs and (load,) in the load.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from railsim.errors import ModelError
from railsim.springs import helical
from railsim.springs.helical import Values

Form = Literal["grossi", "energy"]

SETTLING = 0.025
"""Deflection over the mean diameter after which a spring stands flush on its seats (assumed: of the
order of the parallelism of ground ends)."""

_COMPLEX_STEP = 1e-30
_ROTATION_TOLERANCE = 1e-14


@dataclass(frozen=True)
class Coil:
    """One spring as it stands on the arm; all fields broadcast.

    Attributes
    ----------
    K_V : float or ndarray
        Vertical stiffness [N/m].
    D, H0 : float or ndarray
        Mean coil diameter, free height [m].
    seat : float or ndarray
        Height of the lower seat above the axle's centre [m].
    start : float or ndarray
        Deflection with the arm horizontal; negative while the spring does not touch yet [m].
    """

    K_V: Values
    D: Values
    H0: Values
    seat: Values
    start: Values


@dataclass(frozen=True)
class Arm:
    """The arm, its bush and its springs, outer spring first.

    Attributes
    ----------
    length : float
        Hinge to axle [m].
    bush : float or ndarray
        Torsional stiffness of the hinge's bush [N m/rad].
    nu : float
        Poisson's ratio of the springs.
    coils : tuple of Coil
        The springs; the first one's deflection is the nest's.
    form : {"grossi", "energy"}
        Form of the nest's moment.
    """

    length: float
    bush: Values
    nu: float
    coils: tuple[Coil, ...]
    form: Form = "grossi"


@dataclass(frozen=True)
class CoilState:
    """One spring under load; arrays of the shape of the load cases.

    Attributes
    ----------
    deflection : ndarray
        Vertical deflection, 0 while the spring does not touch [m].
    lateral : ndarray
        Sideways displacement of the lower seat, positive towards the hinge [m].
    height : ndarray
        Height under load [m].
    K_L, K_C : ndarray
        Lateral [N/m] and tilting [N m/rad] stiffness at this deflection, 0 without contact.
    force : ndarray
        Vertical force [N].
    """

    deflection: Values
    lateral: Values
    height: Values
    K_L: Values
    K_C: Values
    force: Values


def displacement(length: ArrayLike, seat: ArrayLike, phi: ArrayLike) -> tuple[Values, Values]:
    """Rise and sideways displacement of a seat when the arm turns by `phi` [m]."""
    length, seat, phi = np.asarray(length), np.asarray(seat), np.asarray(phi)
    sine, versine = np.sin(phi), 2.0 * np.sin(phi / 2.0) ** 2
    return length * sine - seat * versine, length * versine + seat * sine


def rotation_of_rise(length: ArrayLike, seat: ArrayLike, rise: ArrayLike) -> Values:
    """Rotation at which a seat has risen by `rise`; nan beyond the arm's reach.

    `L sin(phi) + h cos(phi) = R sin(phi + delta)` with `R^2 = L^2 + h^2`, `tan(delta) = h/L`.
    """
    length, seat = np.asarray(length), np.asarray(seat)
    sine = (np.asarray(rise) + seat) / np.hypot(length, seat)
    reachable = np.abs(sine) <= 1.0
    turned = np.arcsin(np.where(reachable, sine, 0.0)) - np.arctan2(seat, length)
    return np.where(reachable, turned, np.nan)


def coil_state(arm: Arm, coil: Coil, phi: ArrayLike) -> CoilState:
    """One spring of the arm at rotation `phi` [rad]."""
    rise, lateral = displacement(arm.length, coil.seat, phi)
    travel = coil.start + rise
    touching = travel > 0.0
    deflection = np.where(touching, travel, 0.0)
    flush = _flush(deflection, coil.D)
    K_L = helical.lateral_stiffness(coil.K_V, coil.D, coil.H0, deflection, arm.nu)
    K_C = helical.tilting_stiffness(coil.K_V, coil.D, coil.H0, deflection, arm.nu)
    return CoilState(
        deflection=deflection,
        lateral=lateral,
        height=coil.H0 - deflection,
        K_L=flush * K_L,
        K_C=flush * K_C,
        force=coil.K_V * deflection,
    )


def unit_moment(arm: Arm, coil: Coil, phi: ArrayLike) -> Values:
    """Moment of one spring about the hinge over its vertical stiffness [m^2/rad].

    All stiffnesses of a helical spring are proportional to `K_V`, hence so is its moment: the
    design equations are linear in the stiffnesses sought.
    """
    if arm.form == "energy":
        turned = np.asarray(phi) + 1j * _COMPLEX_STEP
        return _unit_energy(arm, coil, turned).imag / _COMPLEX_STEP
    unit = Coil(1.0, coil.D, coil.H0, coil.seat, coil.start)
    state = coil_state(arm, unit, phi)
    shearing = helical.seat_moment(state.deflection, state.K_L, state.height)
    return (
        state.deflection * arm.length
        + state.K_L * state.lateral * coil.seat
        + state.K_C * np.asarray(phi)
        + shearing * state.lateral
    )


def moment(arm: Arm, phi: ArrayLike) -> Values:
    """Moment about the hinge with which nest and bush resist at rotation `phi` [N m].

    Grossi's equation, with a signed rotation:
    `sum(K_V dz L + K_L dx h + K_C phi + 0.5 dx (K_V dz + K_L H_s)) + K_s phi`.
    """
    total = arm.bush * np.asarray(phi)
    for coil in arm.coils:
        total = total + coil.K_V * unit_moment(arm, coil, phi)
    return total


def load(arm: Arm, phi: ArrayLike) -> Values:
    """Load at the axle that holds the arm at rotation `phi`, `moment / (L cos(phi))` [N]."""
    return moment(arm, phi) / (arm.length * np.cos(phi))


def stored_energy(arm: Arm, phi: ArrayLike) -> Values:
    """Energy of nest and bush at rotation `phi` [J].

    `U = sum(K_V dz^2/2 + K_L dx^2/2 + (K_V dz + K_L H_s)/2 dx phi + K_C phi^2/2) + K_s phi^2/2`:
    the energy of a sheared and tilted beam under axial load, to second order in dx and phi.  Its
    derivative is the moment of the form `energy`.
    """
    total = 0.5 * arm.bush * np.asarray(phi) ** 2
    for coil in arm.coils:
        total = total + coil.K_V * _unit_energy(arm, coil, np.asarray(phi))
    return total


def rotation(arm: Arm, P: ArrayLike) -> Values:
    """Rotation of the arm under the load `P`, converged to round-off [rad].

    Parameters
    ----------
    arm : Arm
        The arm with its springs.
    P : float or ndarray
        Load at the axle, positive [N].

    Returns
    -------
    phi : ndarray
        Rotation; nan where no rotation between lift-off and a spring pressed to a tenth of its
        free height carries the load; one of them where near lift-off on high seats several do.
    """
    P = np.asarray(P, dtype=float)
    low, high = rotation_range(arm)
    return _bracketed_root(lambda phi: load(arm, phi) - P, low, high, P.shape)


def rotation_range(arm: Arm) -> tuple[Values, Values]:
    """Rotations between which the model holds: lift-off, and a tenth of the free height [rad].

    The springs are solid long before that; where, depends on the wire (`checks`).
    """
    first = arm.coils[0]
    low = rotation_of_rise(arm.length, first.seat, -np.asarray(first.start))
    low = np.where(np.isnan(low), -0.5 * np.pi + 1e-3, low)
    high = np.asarray(np.inf)
    for coil in arm.coils:
        reach = rotation_of_rise(arm.length, coil.seat, 0.9 * coil.H0 - coil.start)
        top = 0.5 * np.pi - np.arctan2(coil.seat, arm.length) - 1e-3
        high = np.minimum(high, np.where(np.isnan(reach), top, reach))
    return low, high


def mounting_deflection(
    P: ArrayLike, stiffnesses: Sequence[Values], gaps: Sequence[Values]
) -> Values:
    """Deflection of the first of some springs in parallel under `P`, arm horizontal [m].

    Parameters
    ----------
    P : float or ndarray
        Load [N].
    stiffnesses : sequence of float or ndarray
        Vertical stiffnesses, first spring first [N/m].
    gaps : sequence of float or ndarray
        Deflection of the first spring at which each one starts to work; 0 for the first [m].
    """
    alone = np.asarray(P) / stiffnesses[0]
    if len(stiffnesses) == 1:
        return alone
    together = (np.asarray(P) + stiffnesses[1] * np.asarray(gaps[1])) / (
        stiffnesses[0] + np.asarray(stiffnesses[1])
    )
    return np.where(alone <= gaps[1], alone, together)


def _unit_energy(arm: Arm, coil: Coil, phi: Values) -> Values:
    rise, lateral = displacement(arm.length, coil.seat, phi)
    travel = coil.start + rise
    touching = travel.real > 0.0
    dz = np.where(touching, travel, 0.0)
    K_L = helical.lateral_stiffness(1.0, coil.D, coil.H0, dz, arm.nu)
    K_C = helical.tilting_stiffness(1.0, coil.D, coil.H0, dz, arm.nu)
    coupling = helical.seat_moment(dz, K_L, coil.H0 - dz)
    sheared = 0.5 * (K_L * lateral**2 + K_C * phi**2) + coupling * lateral * phi
    energy = 0.5 * dz**2 + _flush(dz, coil.D) * sheared
    return np.where(touching, energy, 0.0)


def _flush(deflection: Values, D: Values) -> Values:
    """Share of the lateral and tilting stiffness that a spring has at a deflection: 0 to 1."""
    share = np.minimum(np.real(deflection) / (SETTLING * np.asarray(D)), 1.0)
    return share**2 * (3.0 - 2.0 * share)


def _bracketed_root(
    function: Callable[[Values], Values], low: Values, high: Values, shape: tuple[int, ...]
) -> Values:
    """Root of an array function between `low` and `high`, nan where there is no change of sign.

    Regula falsi with the Illinois step, bisecting where that is slow.
    """
    shape = np.broadcast_shapes(np.shape(low), np.shape(high), shape)
    a, b = np.broadcast_to(low, shape).copy(), np.broadcast_to(high, shape).copy()
    fa, fb = function(a), function(b)
    shape = np.broadcast_shapes(shape, np.shape(fa))
    a, b, fa, fb = (np.broadcast_to(value, shape).copy() for value in (a, b, fa, fb))
    bracketed = fa * fb <= 0.0
    kept = np.zeros(shape)  # +1: the end b was kept last time, -1: the end a
    root = 0.5 * (a + b)
    for iteration in range(200):
        width = b - a
        with np.errstate(invalid="ignore", divide="ignore"):
            guess = b - fb * width / (fb - fa)
        outside = ~((guess > a) & (guess < b))
        root = np.where(outside | (iteration % 10 == 9), a + 0.5 * width, guess)
        root = np.where(fa == 0.0, a, np.where(fb == 0.0, b, root))
        value = function(root)
        left = np.sign(value) == np.sign(fa)
        step = np.minimum(np.abs(root - a), np.abs(root - b))
        fb_next = np.where(left, np.where(kept == 1, 0.5 * fb, fb), value)
        fa_next = np.where(left, value, np.where(kept == -1, 0.5 * fa, fa))
        a, b = np.where(left, root, a), np.where(left, b, root)
        fa, fb, kept = fa_next, fb_next, np.where(left, 1.0, -1.0)
        done = (value == 0.0) | (step < _ROTATION_TOLERANCE) | ~bracketed
        if np.all(done):
            break
    else:
        raise ModelError("the arm's equilibrium did not converge")
    return np.where(bracketed, root, np.nan)
