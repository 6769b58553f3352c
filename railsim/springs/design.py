"""The inverse task: the springs' stiffnesses from two wanted deflections.

With the arm horizontal, the nest must carry the mounting load at its wanted deflection; turned by
the angle that the geometry gives for the target's deflection, it must balance the target load.
All stiffnesses of a helical spring, lateral and tilting ones included, are proportional to its
vertical one (`arm.unit_moment`), so these are two *linear* equations:

    K_1 dz_m + K_2 max(dz_m - gap, 0) = P_m
    K_1 m_1 + K_2 m_2                 = P L cos(phi) - K_s phi

with `m_i` the moment of spring i over its vertical stiffness.  The same moment is used in the
verification: a nest built to the design's stiffnesses has exactly the wanted deflections.  (The
reference's design form differs from its verification below the mounting load and for springs of
unequal height; for its own example the two agree.)

Both stiffnesses are positive only for target loads between those that either spring alone would
carry there: `target_load_range` gives them, and with it the advice what to change.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from railsim.definitions.spring import Point, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import helical
from railsim.springs.arm import Arm, Coil
from railsim.springs.helical import Values


@dataclass(frozen=True)
class Wanted:
    """What a nest shall do; all fields broadcast.

    Attributes
    ----------
    mounting_load, target_load : float or ndarray
        Loads [N].
    mounting_deflection, target_deflection : float or ndarray
        Deflections of the outer spring under them [m].
    """

    mounting_load: Values
    mounting_deflection: Values
    target_load: Values
    target_deflection: Values


@dataclass(frozen=True)
class Design:
    """Stiffnesses that meet two wanted deflections.

    Attributes
    ----------
    names : tuple of str
        Names of the springs, outer first.
    rotation : float
        Rotation of the arm at the target, positive above the mounting load [rad].
    K_tot : float
        Mounting load over mounting deflection [N/m].
    K_V : tuple of float
        Vertical stiffnesses, outer spring first [N/m].
    K_L, K_C : float
        Lateral [N/m] and tilting [N m/rad] stiffness at the target, summed over the springs.
    n : tuple of (float or None)
        Active coils for the file's wire diameters; None where it gives none.
    load_range : tuple of float
        Target loads between which both stiffnesses are positive [N].
    """

    names: tuple[str, ...]
    rotation: float
    K_tot: float
    K_V: tuple[float, ...]
    K_L: float
    K_C: float
    n: tuple[float | None, ...]
    load_range: tuple[float, float]


def stiffnesses(frame: Arm, gap: ArrayLike, wanted: Wanted) -> tuple[Values, Values, Values]:
    """Vertical stiffnesses of both springs and the arm's rotation at the target.

    Parameters
    ----------
    frame : Arm
        Arm with two springs at their deflections under the mounting load (`Coil.start`); their
        `K_V` are not used.
    gap : float or ndarray
        Deflection of the outer spring at which the inner one starts to work [m].
    wanted : Wanted
        The two wanted deflections.

    Returns
    -------
    K_outer, K_inner : float or ndarray
        Vertical stiffnesses; negative where there is no physical solution [N/m].
    phi : float or ndarray
        Rotation at the target, nan where the arm does not reach so far [rad].
    """
    phi = target_rotation(frame, wanted)
    m1, m2 = (trailing_arm.unit_moment(frame, coil, phi) for coil in frame.coils)
    alone = np.asarray(wanted.mounting_load) / wanted.mounting_deflection
    shared = np.maximum(1.0 - np.asarray(gap) / wanted.mounting_deflection, 0.0)
    balance = wanted.target_load * frame.length * np.cos(phi) - frame.bush * phi
    with np.errstate(divide="ignore", invalid="ignore"):
        K_inner = (balance - alone * m1) / (m2 - shared * m1)
    return alone - shared * K_inner, K_inner, phi


def target_rotation(frame: Arm, wanted: Wanted) -> Values:
    """Rotation of the arm between mounting and target deflection [rad]."""
    rise = np.asarray(wanted.target_deflection) - wanted.mounting_deflection
    return trailing_arm.rotation_of_rise(frame.length, frame.coils[0].seat, rise)


def target_load_range(frame: Arm, gap: float, wanted: Wanted) -> tuple[Values, Values]:
    """Target loads between which both stiffnesses are positive, ascending [N].

    One end is carried by the outer spring alone, the other by the inner one alone (where the inner
    spring works at the mounting load; else by an inner spring of any stiffness: no upper end).
    """
    phi = target_rotation(frame, wanted)
    m1, m2 = (trailing_arm.unit_moment(frame, coil, phi) for coil in frame.coils)
    lever = frame.length * np.cos(phi)
    alone = np.asarray(wanted.mounting_load) / wanted.mounting_deflection
    shared = np.maximum(1.0 - gap / np.asarray(wanted.mounting_deflection), 0.0)
    outer_only = (alone * m1 + frame.bush * phi) / lever
    with np.errstate(divide="ignore", invalid="ignore"):
        inner_only = np.where(
            shared > 0.0, (alone / shared * m2 + frame.bush * phi) / lever, np.inf * np.sign(m2)
        )
    return np.minimum(outer_only, inner_only), np.maximum(outer_only, inner_only)


def design(suspension: TrailingArmSuspension) -> Design:
    """Design the nest of a suspension file to its mounting and target deflections.

    Raises
    ------
    InputError
        No target, no inner spring, or inputs without a physical solution: which input to change,
        and in which direction.

    Examples
    --------
    >>> from railsim.definitions.loading import load_spring
    >>> result = design(load_spring("turasas_axlebox"))
    >>> [round(K_V / 9810, 3) for K_V in result.K_V]
    [64.699, 30.748]
    """
    wanted, frame = design_task(suspension)
    gap = suspension.engagement
    K_outer, K_inner, phi = (float(value) for value in stiffnesses(frame, gap, wanted))
    if not (K_outer > 0.0 and K_inner > 0.0):
        raise InputError(_unphysical(suspension, frame, wanted, (K_outer, K_inner)))
    K_V = (K_outer, K_inner)
    coils = tuple(replace(coil, K_V=k) for coil, k in zip(frame.coils, K_V, strict=True))
    states = [trailing_arm.coil_state(frame, coil, phi) for coil in coils]
    G = suspension.material.G
    springs = suspension.springs
    low, high = target_load_range(frame, gap, wanted)
    return Design(
        names=tuple(springs),
        rotation=phi,
        K_tot=wanted.mounting_load / wanted.mounting_deflection,
        K_V=K_V,
        K_L=float(sum(state.K_L for state in states)),
        K_C=float(sum(state.K_C for state in states)),
        n=tuple(
            None
            if spring.wire_diameter is None
            else float(helical.active_coils(G, spring.wire_diameter, spring.mean_diameter, k))
            for spring, k in zip(springs.values(), K_V, strict=True)
        ),
        load_range=(float(low), float(high)),
    )


def design_task(suspension: TrailingArmSuspension) -> tuple[Wanted, Arm]:
    """Return the wanted deflections, and the arm with springs at their mounting deflection.

    Raises
    ------
    InputError
        No target, no inner spring, or deflections that springs or arm cannot reach.
    """
    target, mounting, inner = suspension.target, suspension.mounting, suspension.inner
    faults = []
    if target is None:
        faults.append(_fault(suspension, "target", "missing", "needed: load and deflection"))
    if inner is None:
        faults.append(
            _fault(suspension, "inner", "missing", "a design needs both springs' diameters")
        )
    if target is None or inner is None:
        raise InputError(faults)
    faults = _reach_faults(suspension, {"mounting": mounting, "target": target})
    if abs(target.deflection - mounting.deflection) < 1e-6:
        faults.append(
            _fault(
                suspension,
                "target.deflection",
                f"{target.deflection * 1e3:.2f} mm, the same as mounting.deflection",
                "choose a target that turns the arm, above or below the mounting load",
            )
        )
    elif target.deflection <= suspension.engagement:
        faults.append(
            _fault(
                suspension,
                "target.deflection",
                f"{target.deflection * 1e3:.1f} mm: the inner spring starts to work at "
                f"{suspension.engagement * 1e3:.1f} mm",
                "raise target.deflection, or let the inner spring start earlier",
            )
        )
    if faults:
        raise InputError(faults)
    starts = (mounting.deflection, mounting.deflection - suspension.engagement)
    frame = Arm(
        length=suspension.arm.length,
        bush=suspension.arm.bush_torsional_stiffness,
        nu=float(helical.poisson_number(suspension.material.E, suspension.material.G)),
        coils=tuple(
            Coil(1.0, spring.mean_diameter, spring.free_height, seat, start)
            for spring, seat, start in zip(
                suspension.springs.values(), suspension.seat_heights, starts, strict=True
            )
        ),
        form=suspension.arm.equilibrium,
    )
    wanted = Wanted(mounting.load, mounting.deflection, target.load, target.deflection)
    if np.isnan(target_rotation(frame, wanted)):
        raise InputError(
            [
                _fault(
                    suspension,
                    "target.deflection",
                    f"{(target.deflection - mounting.deflection) * 1e3:.1f} mm from the mounting "
                    "deflection: the arm does not reach so far",
                    "bring target.deflection nearer to mounting.deflection, or raise arm.length",
                )
            ]
        )
    return wanted, frame


def _reach_faults(suspension: TrailingArmSuspension, points: Mapping[str, Point]) -> list[Fault]:
    """Deflections that press a spring flat or buckle it."""
    nu = helical.poisson_number(suspension.material.E, suspension.material.G)
    faults = []
    for name, spring in suspension.springs.items():
        buckling = float(
            helical.buckling_deflection(
                spring.free_height, spring.mean_diameter, nu, suspension.checks.seating
            )
        )
        for key, point in points.items():
            where = f"{key}.deflection"
            deflection = f"{point.deflection * 1e3:.1f} mm"
            if point.deflection >= 0.9 * spring.free_height:
                found = f"{deflection}, of {name}.free_height {spring.free_height * 1e3:.1f} mm"
                faults.append(
                    _fault(suspension, where, found, f"reduce it, or raise {name}.free_height")
                )
            elif point.deflection >= buckling:
                found = f"{deflection}: the {name} spring buckles at {buckling * 1e3:.1f} mm"
                mend = f"reduce {name}.free_height or raise {name}.mean_diameter"
                faults.append(_fault(suspension, where, found, mend))
    return faults


def _unphysical(
    suspension: TrailingArmSuspension, frame: Arm, wanted: Wanted, K_V: tuple[float, float]
) -> list[Fault]:
    """Why a stiffness comes out negative, and what would mend it."""
    low, high = target_load_range(frame, suspension.engagement, wanted)
    name, value = ("inner", K_V[1]) if not K_V[1] > 0.0 else ("outer", K_V[0])
    too_low = wanted.target_load < low
    deflection = f"{wanted.target_deflection * 1e3:.2f} mm"
    if np.isinf(high):
        window = f"above {low * 1e-3:.3f} kN"
    else:
        window = f"between {low * 1e-3:.3f} and {high * 1e-3:.3f} kN"
    found = (
        f"{wanted.target_load * 1e-3:.3f} kN at {deflection} has no physical solution "
        f"(K_V of the {name} spring would be {value * 1e-3:.1f} N/mm)"
    )
    load_advice = (
        f"{'raise' if too_low else 'reduce'} target.load: a nest that carries mounting.load at "
        f"mounting.deflection can reach {deflection} under loads {window} only"
    )
    faults = [_fault(suspension, "target.load", found, load_advice)]
    window_of_deflections = _deflection_range(suspension, frame, wanted)
    if window_of_deflections is not None:
        lowest, highest = window_of_deflections
        verb = "raise" if wanted.target_deflection < lowest else "reduce"
        faults.append(
            _fault(
                suspension,
                "target.deflection",
                f"{deflection} does not go with this load",
                f"or {verb} target.deflection: for {wanted.target_load * 1e-3:.3f} kN between "
                f"{lowest * 1e3:.2f} and {highest * 1e3:.2f} mm",
            )
        )
    return faults


def _deflection_range(
    suspension: TrailingArmSuspension, frame: Arm, wanted: Wanted
) -> tuple[float, float] | None:
    """Target deflections that go with the target load; None if there are none in reach [m]."""
    shortest = min(float(coil.H0) for coil in frame.coils)
    deflections = np.linspace(suspension.engagement + 1e-6, 0.6 * shortest, 4001)
    candidates = replace(wanted, target_deflection=deflections)
    low, high = target_load_range(frame, suspension.engagement, candidates)
    turned = np.abs(deflections - wanted.mounting_deflection) > 1e-5
    fitting = deflections[(low < wanted.target_load) & (wanted.target_load < high) & turned]
    return (float(fitting[0]), float(fitting[-1])) if fitting.size else None


def _fault(suspension: TrailingArmSuspension, key: str, found: str, allowed: str) -> Fault:
    return Fault(suspension.name, key, found, allowed)
