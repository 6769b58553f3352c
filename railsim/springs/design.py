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

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from railsim.definitions.spring import TrailingArmSuspension
from railsim.errors import Fault, Faults, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import helical
from railsim.springs.arm import Arm
from railsim.springs.helical import Values


@dataclass(frozen=True)
class Demand:
    """Loads [N] and the deflections of the outer spring under them [m]; all fields broadcast."""

    mounting_load: Values
    mounting_deflection: Values
    target_load: Values
    target_deflection: Values


@dataclass(frozen=True)
class Design:
    """Stiffnesses that meet two wanted deflections."""

    names: tuple[str, ...]  # of the springs, outer first
    rotation: float  # of the arm at the target, positive above the mounting load [rad]
    K_tot: float  # mounting load over mounting deflection [N/m]
    K_V: tuple[float, ...]  # vertical stiffnesses, outer spring first [N/m]
    K_L: float  # lateral stiffness at the target, summed over the springs [N/m]
    K_C: float  # tilting stiffness, likewise [N m/rad]
    n: tuple[float | None, ...]  # active coils for the file's wires; None where it gives none
    load_range: tuple[float, float]  # target loads between which both K_V are positive [N]


def stiffnesses(frame: Arm, engagement: float, demand: Demand) -> tuple[Values, Values, Values]:
    """Vertical stiffnesses of both springs and the arm's rotation at the target.

    `frame`: Arm with two springs at their deflections under the mounting load (`Coil.start`);
    their `K_V` are not used. `engagement`: Deflection of the outer spring at which the inner one
    starts to work [m]. `demand`: The two wanted deflections. Returns `K_outer`, `K_inner`:
    Vertical stiffnesses; negative where there is no physical solution [N/m]. Returns `phi`:
    Rotation at the target, nan where the arm does not reach so far [rad].
    """
    phi, m1, m2, alone, shared = _at_target(frame, engagement, demand)
    balance = demand.target_load * frame.length * np.cos(phi) - frame.bush * phi
    with np.errstate(divide="ignore", invalid="ignore"):
        K_inner = (balance - alone * m1) / (m2 - shared * m1)
    return alone - shared * K_inner, K_inner, phi


def target_load_range(frame: Arm, engagement: float, demand: Demand) -> tuple[Values, Values]:
    """Target loads between which both stiffnesses are positive, ascending [N].

    One end is carried by the outer spring alone, the other by the inner one alone (where the inner
    spring works at the mounting load; else by an inner spring of any stiffness: no upper end).
    """
    phi, m1, m2, alone, shared = _at_target(frame, engagement, demand)
    lever = frame.length * np.cos(phi)
    outer_only = (alone * m1 + frame.bush * phi) / lever
    with np.errstate(divide="ignore", invalid="ignore"):
        inner_only = np.where(
            shared > 0.0, (alone / shared * m2 + frame.bush * phi) / lever, np.inf * np.sign(m2)
        )
    return np.minimum(outer_only, inner_only), np.maximum(outer_only, inner_only)


def _at_target(frame: Arm, engagement: float, demand: Demand) -> tuple[Values, ...]:
    """Rotation, unit moments, stiffness of the outer spring alone, share of the inner one."""
    rise = demand.target_deflection - demand.mounting_deflection
    phi = trailing_arm.rotation_of_rise(frame.length, frame.coils[0].seat, rise)
    m1, m2 = (trailing_arm.unit_moment(frame, coil, phi) for coil in frame.coils)
    alone = demand.mounting_load / demand.mounting_deflection
    return phi, m1, m2, alone, np.maximum(1.0 - engagement / demand.mounting_deflection, 0.0)


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
    demand, frame = design_task(suspension)
    *K_V, phi = (float(value) for value in stiffnesses(frame, suspension.engagement, demand))
    if not all(stiffness > 0.0 for stiffness in K_V):
        raise InputError(_negative_faults(suspension, frame, demand, K_V))
    coils = [replace(coil, K_V=k) for coil, k in zip(frame.coils, K_V, strict=True)]
    states = [trailing_arm.coil_state(frame, coil, phi) for coil in coils]
    low, high = target_load_range(frame, suspension.engagement, demand)
    n: list[float | None] = []
    for spring, k in zip(suspension.springs.values(), K_V, strict=True):
        d, D = spring.wire_diameter, spring.mean_diameter
        n.append(helical.active_coils(suspension.material.G, d, D, k) if d else None)
    return Design(
        names=tuple(suspension.springs), rotation=phi,
        K_tot=demand.mounting_load / demand.mounting_deflection, K_V=tuple(K_V),
        K_L=float(sum(state.K_L for state in states)),
        K_C=float(sum(state.K_C for state in states)), n=tuple(n),
        load_range=(float(low), float(high)),
    )  # fmt: skip


def design_task(suspension: TrailingArmSuspension) -> tuple[Demand, Arm]:
    """Return the wanted deflections, and the arm under the mounting load; raises InputError."""
    target, mounting, inner = suspension.target, suspension.mounting, suspension.inner
    if target is None or inner is None:
        needed = {"target": "needed: load and deflection"} if target is None else {}
        needed |= {"inner": "a design needs both springs' diameters"} if inner is None else {}
        raise InputError(Fault(suspension.name, k, "missing", words) for k, words in needed.items())
    demand = Demand(mounting.load, mounting.deflection, target.load, target.deflection)
    springs = [(1.0, s.mean_diameter, s.free_height) for s in suspension.springs.values()]
    frame = trailing_arm.nest(suspension, springs, mounting.deflection)
    faults = Faults(_reach_faults(suspension, "mounting", mounting.deflection))
    faults += _reach_faults(suspension, "target", target.deflection)
    found, remedy = "", ""
    if abs(target.deflection - mounting.deflection) < 1e-6:
        found = f"{target.deflection * 1e3:.2f} mm, the same as mounting.deflection"
        remedy = "choose a target that turns the arm, above or below the mounting load"
    elif target.deflection <= suspension.engagement:
        begin = f"the inner spring starts to work at {suspension.engagement * 1e3:.1f} mm"
        found = f"{target.deflection * 1e3:.1f} mm: {begin}"
        remedy = "raise target.deflection, or let the inner spring start earlier"
    elif not faults and np.isnan(_at_target(frame, suspension.engagement, demand)[0]):
        way = f"{(target.deflection - mounting.deflection) * 1e3:.1f} mm"
        found = f"{way} from the mounting deflection: the arm does not reach so far"
        remedy = "bring target.deflection nearer to mounting.deflection, or raise arm.length"
    if found:
        faults.append(Fault(suspension.name, "target.deflection", found, remedy))
    faults.check()
    return demand, frame


def _reach_faults(
    suspension: TrailingArmSuspension, table: str, deflection: float
) -> Iterator[Fault]:
    """Springs that a deflection presses flat or buckles."""
    nu, key = trailing_arm.poisson_ratio(suspension), f"{table}.deflection"
    for name, spring in suspension.springs.items():
        D, H0 = spring.mean_diameter, spring.free_height
        buckling = helical.buckling_deflection(H0, D, nu, suspension.checks.seating)
        if deflection >= 0.9 * H0:
            found = f"{deflection * 1e3:.1f} mm, of {name}.free_height {H0 * 1e3:.1f} mm"
            yield Fault(suspension.name, key, found, f"reduce it, or raise {name}.free_height")
        elif deflection >= buckling:
            end = f"{buckling * 1e3:.1f} mm"
            found = f"{deflection * 1e3:.1f} mm: the {name} spring buckles at {end}"
            remedy = f"reduce {name}.free_height or raise {name}.mean_diameter"
            yield Fault(suspension.name, key, found, remedy)


def _negative_faults(
    suspension: TrailingArmSuspension, frame: Arm, demand: Demand, K_V: list[float]
) -> Iterator[Fault]:
    """Why a stiffness comes out negative, and what would mend it."""
    low, high = target_load_range(frame, suspension.engagement, demand)
    name, value = ("inner", K_V[1]) if not K_V[1] > 0.0 else ("outer", K_V[0])
    load, deflection = demand.target_load * 1e-3, f"{demand.target_deflection * 1e3:.2f} mm"
    window = f"above {low * 1e-3:.3f} kN"
    if np.isfinite(high):
        window = f"between {low * 1e-3:.3f} and {high * 1e-3:.3f} kN"
    K = f"K_V of the {name} spring would be {value * 1e-3:.1f} N/mm"
    found = f"{load:.3f} kN at {deflection} has no physical solution ({K})"
    allowed = (
        f"{'raise' if demand.target_load < low else 'reduce'} target.load: a nest that carries "
        f"mounting.load at mounting.deflection can reach {deflection} under loads {window} only"
    )
    yield Fault(suspension.name, "target.load", found, allowed)
    shortest = min(coil.H0 for coil in frame.coils)
    deflections = np.linspace(suspension.engagement + 1e-6, 0.6 * shortest, 4001)
    wanted_too = replace(demand, target_deflection=deflections)
    low, high = target_load_range(frame, suspension.engagement, wanted_too)
    turned = np.abs(deflections - demand.mounting_deflection) > 1e-5
    fitting = deflections[(low < demand.target_load) & (demand.target_load < high) & turned]
    if fitting.size:
        verb = "raise" if demand.target_deflection < fitting[0] else "reduce"
        ends = f"{fitting[0] * 1e3:.2f} and {fitting[-1] * 1e3:.2f} mm"
        allowed = f"or {verb} target.deflection: for {load:.3f} kN between {ends}"
        found = f"{deflection} does not go with this load"
        yield Fault(suspension.name, "target.deflection", found, allowed)
