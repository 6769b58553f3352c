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

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from railsim.definitions.spring import TrailingArmSuspension
from railsim.springs import helical
from railsim.springs.helical import Values

Form = Literal["grossi", "energy"]

SETTLING = 0.025
"""Deflection over the mean diameter after which a spring stands flush on its seats (assumed: of the
order of the parallelism of ground ends)."""

_COMPLEX_STEP = 1e-30


@dataclass(frozen=True)
class Coil:
    """One spring as it stands on the arm; all fields broadcast."""

    K_V: Values  # vertical stiffness [N/m]
    D: Values  # mean coil diameter [m]
    H0: Values  # free height [m]
    seat: Values  # height of the lower seat above the axle's centre [m]
    start: Values  # deflection, arm horizontal; negative: the spring does not touch yet [m]


@dataclass(frozen=True)
class Arm:
    """The arm, its bush and its springs; the first spring's deflection is the nest's."""

    length: float  # hinge to axle [m]
    bush: Values  # torsional stiffness of the hinge's bush [N m/rad]
    nu: float  # Poisson's ratio of the springs
    coils: tuple[Coil, ...]  # outer spring first
    form: Form = "grossi"  # form of the nest's moment


@dataclass(frozen=True)
class CoilState:
    """One spring under load; arrays of the shape of the load cases."""

    deflection: Values  # 0 while the spring does not touch [m]
    lateral: Values  # sideways displacement of the lower seat, positive towards the hinge [m]
    height: Values  # height under load [m]
    K_L: Values  # lateral stiffness at this deflection, 0 without contact [N/m]
    K_C: Values  # tilting stiffness, likewise [N m/rad]
    force: Values  # vertical force [N]


def nest(
    suspension: TrailingArmSuspension,
    springs: Sequence[tuple[Values, Values, Values]],
    start: Values,
) -> Arm:
    """Return the arm of a file with springs (K_V, D, H0), the first one deflected by `start`.

    The second begins to work at the file's engagement.
    """
    arm, nu = suspension.arm, poisson_ratio(suspension)
    starts = (start, start - suspension.engagement)[: len(springs)]
    each = zip(springs, suspension.seat_heights, starts, strict=True)
    coils = tuple(Coil(*spring, seat, begin) for spring, seat, begin in each)
    return Arm(arm.length, arm.bush_torsional_stiffness, nu, coils, arm.equilibrium)


def poisson_ratio(suspension: TrailingArmSuspension) -> float:
    """Poisson's ratio of a file's material, isotropic: `nu = E / (2 G) - 1`."""
    return suspension.material.E / (2.0 * suspension.material.G) - 1.0


def displacement(length: Values, seat: Values, phi: Values) -> tuple[Values, Values]:
    """Rise and sideways displacement of a seat when the arm turns by `phi` [m]."""
    sine, versine = np.sin(phi), 2.0 * np.sin(phi / 2.0) ** 2
    return length * sine - seat * versine, length * versine + seat * sine


def rotation_of_rise(length: Values, seat: Values, rise: Values) -> Values:
    """Rotation at which a seat has risen by `rise`; nan beyond the arm's reach.

    `L sin(phi) + h cos(phi) = R sin(phi + delta)` with `R^2 = L^2 + h^2`, `tan(delta) = h/L`.
    """
    sine = (rise + seat) / np.hypot(length, seat)
    with np.errstate(invalid="ignore"):
        return np.arcsin(sine) - np.arctan2(seat, length)


def coil_state(arm: Arm, coil: Coil, phi: Values) -> CoilState:
    """One spring of the arm at rotation `phi` [rad]."""
    deflection, lateral, *beam = _deformation(arm, coil, phi)
    K_L, K_C = (_flush(deflection, coil.D) * K for K in beam)
    height, force = coil.H0 - deflection, coil.K_V * deflection
    return CoilState(deflection, lateral, height, K_L, K_C, force)


def unit_moment(arm: Arm, coil: Coil, phi: Values) -> Values:
    """Moment of one spring about the hinge over its vertical stiffness [m^2/rad].

    All stiffnesses of a helical spring are proportional to `K_V`, hence so is its moment: the
    design equations are linear in the stiffnesses sought.
    """
    if arm.form == "energy":
        with np.errstate(invalid="ignore"):  # nan where the arm does not reach
            return _unit_energy(arm, coil, phi + 1j * _COMPLEX_STEP).imag / _COMPLEX_STEP
    state = coil_state(arm, replace(coil, K_V=1.0), phi)
    shearing = helical.seat_moment(state.deflection, state.K_L, state.height)
    lifting = state.deflection * arm.length + state.K_L * state.lateral * coil.seat
    return lifting + state.K_C * phi + shearing * state.lateral


def moment(arm: Arm, phi: Values) -> Values:
    """Moment about the hinge with which nest and bush resist at rotation `phi` [N m].

    Grossi's equation, with a signed rotation:
    `sum(K_V dz L + K_L dx h + K_C phi + 0.5 dx (K_V dz + K_L H_s)) + K_s phi`.
    """
    return arm.bush * phi + sum(coil.K_V * unit_moment(arm, coil, phi) for coil in arm.coils)


def load(arm: Arm, phi: Values) -> Values:
    """Load at the axle that holds the arm at rotation `phi`, `moment / (L cos(phi))` [N]."""
    return moment(arm, phi) / (arm.length * np.cos(phi))


def stored_energy(arm: Arm, phi: Values) -> Values:
    """Energy of nest and bush at rotation `phi` [J].

    `U = sum(K_V dz^2/2 + K_L dx^2/2 + (K_V dz + K_L H_s)/2 dx phi + K_C phi^2/2) + K_s phi^2/2`:
    the energy of a sheared and tilted beam under axial load, to second order in dx and phi.  Its
    derivative is the moment of the form `energy`.
    """
    springs = sum(coil.K_V * _unit_energy(arm, coil, phi) for coil in arm.coils)
    return 0.5 * arm.bush * phi**2 + springs


def rotation(arm: Arm, P: Values) -> Values:
    """Rotation of the arm under the load `P` [N], converged to round-off [rad].

    nan where no rotation between lift-off and a spring pressed to a tenth of its free height
    carries the load; one of them where near lift-off on high seats several do.
    """
    # imported where it is needed: it takes a while
    from scipy.optimize.elementwise import find_root

    def excess(phi: Values, P: Values, bush: Values, *fields: Values) -> Values:
        coils = tuple(Coil(*fields[i : i + 5]) for i in range(0, len(fields), 5))
        return load(replace(arm, bush=bush, coils=coils), phi) - P

    fields = [value for coil in arm.coils for value in vars(coil).values()]
    found = find_root(excess, rotation_range(arm), args=(P, arm.bush, *fields))
    return np.where(found.success, found.x, np.nan)


def rotation_range(arm: Arm) -> tuple[Values, Values]:
    """Rotations between which the model holds: lift-off, and a tenth of the free height [rad].

    The springs are solid long before that; where, depends on the wire (`checks`).
    """
    first = arm.coils[0]
    low = rotation_of_rise(arm.length, first.seat, -first.start)
    low = np.where(np.isnan(low), -0.5 * np.pi + 1e-3, low)
    high = np.inf
    for coil in arm.coils:
        reach = rotation_of_rise(arm.length, coil.seat, 0.9 * coil.H0 - coil.start)
        top = 0.5 * np.pi - np.arctan2(coil.seat, arm.length) - 1e-3
        high = np.minimum(high, np.where(np.isnan(reach), top, reach))
    return low, high


def mounting_deflection(P: float, stiffnesses: Sequence[Values], engagement: float) -> Values:
    """Deflection of the first of the springs under `P` [N], arm horizontal [m].

    `P`: Load [N]. `stiffnesses`: Vertical stiffnesses of one spring or two, first spring first
    [N/m]. `engagement`: Deflection of the first spring at which the second starts to work [m].
    """
    alone = P / stiffnesses[0]
    if len(stiffnesses) == 1:
        return alone
    together = (P + stiffnesses[1] * engagement) / (stiffnesses[0] + stiffnesses[1])
    return np.where(alone <= engagement, alone, together)


def _unit_energy(arm: Arm, coil: Coil, phi: Values) -> Values:
    """Stored energy of one spring over its vertical stiffness, at a real or complex rotation."""
    dz, dx, K_L, K_C = _deformation(arm, replace(coil, K_V=1.0), phi)
    coupling = helical.seat_moment(dz, K_L, coil.H0 - dz)
    sheared = 0.5 * (K_L * dx**2 + K_C * phi**2) + coupling * dx * phi
    return 0.5 * dz**2 + _flush(dz, coil.D) * sheared


def _deformation(arm: Arm, coil: Coil, phi: Values) -> tuple[Values, Values, Values, Values]:
    """Deflection, sideways displacement, lateral and tilting stiffness of a flush spring."""
    rise, dx = displacement(arm.length, coil.seat, phi)
    travel = coil.start + rise
    dz = np.where(travel.real > 0.0, travel, 0.0)
    return dz, dx, *helical.lateral_and_tilting(coil.K_V, coil.D, coil.H0, dz, arm.nu)


def _flush(deflection: Values, D: Values) -> Values:
    """Share of the lateral and tilting stiffness that a spring has at a deflection: 0 to 1."""
    share = np.minimum(deflection.real / (SETTLING * D), 1.0)
    return share**2 * (3.0 - 2.0 * share)
