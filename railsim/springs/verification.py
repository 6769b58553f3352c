"""Does a built suspension do what it should: all loads, all checks, fatigue.

`mounted_arm` turns the file's springs into an `Arm` that stands horizontal under the mounting load,
`verify` answers for every load of the file and compares with the limits, `fatigue` for the dynamic
loads.  A load that the nest cannot carry (solid, buckled, lifted off) is an input fault that names
what to change; a check that is not met is a result.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from railsim.definitions.spring import HelicalSpring, TrailingArmSuspension, radial_clearance
from railsim.design_checks import Check
from railsim.errors import Fault, Faults, input_error
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState

STEP = 1e-5  # rad
TARE_MAX, TARE_MIN = 1.20, 0.65  # dynamic loads over the tare load: + 20 %, - 35 %


@dataclass(frozen=True)
class Case:
    """The suspension under one load."""

    name: str
    load: float  # at the axle [N]
    rotation: float  # of the arm, positive above the mounting load [rad]
    deflection: float  # of the outer spring [m]
    K_sys: float  # system stiffness, load over deflection [N/m]
    rate: float  # slope of the load over the rise of the axle: what small movements feel [N/m]
    springs: Mapping[str, CoilState]

    @property
    def theta(self) -> float:
        """Amount of the rotation, as the reference counts it [rad]."""
        return abs(self.rotation)

    @property
    def K_L(self) -> float:
        """Lateral stiffness summed over the springs [N/m]."""
        return float(sum(state.K_L for state in self.springs.values()))

    @property
    def K_C(self) -> float:
        """Tilting stiffness summed over the springs [N m/rad]."""
        return float(sum(state.K_C for state in self.springs.values()))

    def lateral(self, spring: str) -> float:
        """Sideways displacement of a spring's seat, counted as theta: positive both ways [m]."""
        displacement = float(self.springs[spring].lateral)
        return displacement if self.rotation >= 0.0 else -displacement


@dataclass(frozen=True)
class Fatigue:
    """Fatigue of one spring between the lowest and the highest dynamic load."""

    tau_max: float  # corrected stress under the highest load [Pa]
    tau_min: float  # and under the lowest
    limit: float  # allowable upper stress at `tau_min` [Pa]
    margin: float  # limit over tau_max; inf where the spring does not touch


@dataclass(frozen=True)
class Verification:
    """The suspension as computed, its loads in the order of the file, and all checks."""

    arm: Arm
    cases: tuple[Case, ...]
    checks: tuple[Check, ...]


def wire_and_coils(spring: HelicalSpring) -> tuple[float, float]:
    """Wire diameter and active coils of a spring that has both (`mounted_arm` checks that)."""
    if spring.wire_diameter is None or spring.active_coils is None:
        raise ValueError("the spring has no wire diameter or no number of coils")
    return spring.wire_diameter, spring.active_coils


def solid_heights(suspension: TrailingArmSuspension) -> dict[str, float]:
    """Solid height of each spring [m]."""
    limits = suspension.checks
    found = {}
    for name, spring in suspension.springs.items():
        d, n = wire_and_coils(spring)
        n_t = checks.total_coils(n, limits.dead_coils, limits.end_coils)
        found[name] = checks.solid_height(n_t, d)
    return found


def mounted_arm(suspension: TrailingArmSuspension) -> Arm:
    """Return the arm with the file's springs, horizontal under the mounting load; or InputError."""
    needed = {"wire_diameter": "the wire diameter [m]"}
    needed["active_coils"] = "the number of active coils; see design"
    faults = Faults()
    for name, spring in suspension.springs.items():
        for key in [key for key in needed if getattr(spring, key) is None]:
            words = "missing", f"needed: {needed[key]}"
            faults.append(Fault(suspension.name, f"{name}.{key}", *words))
    faults.check()
    for name, solid in solid_heights(suspension).items():
        free = suspension.springs[name].free_height
        if solid >= free:
            found = f"{free * 1e3:.1f} mm, but the spring is solid at {solid * 1e3:.1f} mm"
            remedy = f"raise it, or reduce {name}.active_coils or {name}.wire_diameter"
            faults.append(Fault(suspension.name, f"{name}.free_height", found, remedy))
    faults.check()
    springs = []
    for spring in suspension.springs.values():
        (d, n), D = wire_and_coils(spring), spring.mean_diameter
        K = helical.vertical_stiffness(suspension.material.G, d, D, n)
        springs.append((K, D, spring.free_height))
    K_V = [stiffness for stiffness, _, _ in springs]
    load = suspension.mounting.load
    start = float(trailing_arm.mounting_deflection(load, K_V, suspension.engagement))
    frame = trailing_arm.nest(suspension, springs, start)
    for (name, solid), coil in zip(solid_heights(suspension).items(), frame.coils, strict=True):
        if coil.start >= coil.H0 - solid:
            found = f"{load * 1e-3:.3f} kN is beyond the solid height of the {name} spring"
            remedy = f"reduce it, or raise {name}.wire_diameter, {name}.free_height or material.G"
            faults.append(Fault(suspension.name, "mounting.load", found, remedy))
    faults.check()
    return frame


def load_cases(
    suspension: TrailingArmSuspension, loads: Mapping[str, float], key: str = "loads"
) -> tuple[Arm, tuple[Case, ...]]:
    """Return the mounted arm and its state under loads [N] of the table `key`; or InputError."""
    frame = mounted_arm(suspension)
    rotations = trailing_arm.rotation(frame, np.array(list(loads.values()))).tolist()
    cases = []
    obstacles: dict[str, list[tuple[str, str, str]]] = {}
    for (name, load), phi in zip(loads.items(), rotations, strict=True):
        if (obstacle := _obstacle(suspension, frame, load, phi)) is not None:
            obstacles.setdefault(obstacle[0], []).append((name, *obstacle[1:]))
            continue
        each = zip(suspension.springs, frame.coils, strict=True)
        states = {s: trailing_arm.coil_state(frame, coil, phi) for s, coil in each}
        deflection = float(states["outer"].deflection)
        # slope by a central difference: its error about 1e-9, round-off about 1e-10 of the rate
        low, high = trailing_arm.load(frame, np.array([phi - STEP, phi + STEP])).tolist()
        rate = (high - low) / (2.0 * STEP * frame.length * float(np.cos(phi)))
        cases.append(Case(name, load, phi, deflection, load / deflection, rate, states))
    faults = Faults()
    for (name, found, remedy), *others in obstacles.values():
        also = f" (also {', '.join(other for other, _, _ in others)})" if others else ""
        faults.append(Fault(suspension.name, f"{key}.{name}", found + also, remedy))
    faults.check()
    return frame, tuple(cases)


def verify(suspension: TrailingArmSuspension) -> Verification:
    """Verify a suspension under all its loads.

    Raises InputError: A wire diameter or number of coils is missing, or a load cannot be carried.

    >>> from railsim.definitions.loading import load_spring
    >>> result = verify(load_spring("turasas_axlebox"))
    >>> {case.name: round(case.K_sys / 9810, 3) for case in result.cases}["T.I."]
    101.888
    """
    frame, cases = load_cases(suspension, suspension.loads)
    return Verification(frame, cases, tuple(_checks(suspension, frame, cases)))


def fatigue(suspension: TrailingArmSuspension) -> dict[str, Fatigue]:
    """Fatigue of each spring between the lowest and the highest dynamic load.

    Raises InputError: no table `[fatigue]`, or a dynamic load that cannot be carried.

    >>> from railsim.definitions.loading import load_spring
    >>> margins = fatigue(load_spring("turasas_axlebox"))
    >>> round(margins["outer"].margin, 3)
    1.327
    """
    if suspension.fatigue is None:
        words = "needed: goodman = [[0, ...], ...]"
        raise input_error(suspension.name, "missing", words, "fatigue")
    _, cases = load_cases(suspension, dynamic_loads(suspension), "fatigue")
    results = {}
    for name, spring in suspension.springs.items():
        tau_min, tau_max = sorted(stress(spring, case.springs[name]) for case in cases)
        limit = float(checks.goodman_limit(suspension.fatigue.goodman, tau_min))
        margin = limit / tau_max if tau_max > 0.0 else np.inf  # it does not touch
        results[name] = Fatigue(tau_max, tau_min, limit, margin)
    return results


def dynamic_loads(suspension: TrailingArmSuspension) -> dict[str, float]:
    """The highest and the lowest dynamic load, stated or from the tare load [N]."""
    table = suspension.fatigue
    if table is None:
        raise ValueError("the suspension has no fatigue table")
    stated = {"max_load": (table.max_load, TARE_MAX), "min_load": (table.min_load, TARE_MIN)}
    found = {
        key: factor * suspension.loads[table.tare] if load is None else load
        for key, (load, factor) in stated.items()
    }
    if found["max_load"] <= found["min_load"]:
        highest, lowest = (f"{load * 1e-3:.3f} kN" for load in found.values())
        words = f"highest dynamic load {highest}, lowest {lowest}; by default from {table.tare}"
        raise input_error(suspension.name, words, "state max_load and min_load", "fatigue")
    return found


def stress(spring: HelicalSpring, state: CoilState) -> float:
    """Largest corrected shear stress of a spring under load [Pa]."""
    under = state.force, state.K_L * state.lateral, state.height, state.lateral
    return float(checks.corrected_stress(wire_and_coils(spring)[0], spring.mean_diameter, *under))


def _obstacle(
    suspension: TrailingArmSuspension, frame: Arm, load: float, phi: float
) -> tuple[str, str, str] | None:
    """What makes a load impossible, if anything does: cause, what was found, remedy."""
    under = f"{load * 1e-3:.3f} kN"
    lowest_phi, highest_phi = (float(value) for value in trailing_arm.rotation_range(frame))
    lowest = float(trailing_arm.load(frame, lowest_phi))
    if load <= lowest:
        found = f"{under} lifts the arm off its springs (below {lowest * 1e-3:.3f} kN)"
        return "lifted", found, "raise this load, or reduce mounting.load against it"

    def reached_at(coil: Coil, deflection: float) -> tuple[float, str]:
        """Rotation and load at which a spring reaches a deflection, nan beyond the arm's reach."""
        rotation = trailing_arm.rotation_of_rise(frame.length, coil.seat, deflection - coil.start)
        load = f"{float(trailing_arm.load(frame, rotation)) * 1e-3:.1f} kN"
        return float(np.nan_to_num(rotation, nan=np.inf)), load

    obstacles: list[tuple[float, tuple[str, str, str]]] = []
    solid = solid_heights(suspension)
    for name, coil in zip(suspension.springs, frame.coils, strict=True):
        turned = highest_phi if np.isnan(phi) else phi
        rise, _ = trailing_arm.displacement(frame.length, coil.seat, turned)
        seating = suspension.checks.seating
        buckling = float(helical.buckling_deflection(coil.H0, coil.D, frame.nu, seating))
        if coil.start + rise >= buckling:
            phi_end, load_end = reached_at(coil, buckling)
            end = f"{buckling * 1e3:.1f} mm, under {load_end}"
            found = f"{under} buckles the {name} spring: it buckles at {end}"
            remedy = (
                f"reduce {name}.free_height, raise {name}.mean_diameter, or hold the seats against "
                "sideways movement (checks.seating = 0.5)"
            )
            obstacles.append((phi_end, (f"{name} buckled", found, remedy)))
        travel = float(coil.H0) - solid[name]
        if coil.start + rise >= travel:
            phi_end, load_end = reached_at(coil, travel)
            end = f"{solid[name] * 1e3:.1f} mm is reached under {load_end}"
            found = f"{under} is beyond the solid height of the {name} spring: {end}"
            less = f"reduce this load, {name}.active_coils or {name}.wire_diameter"
            remedy = f"{less}, or raise {name}.free_height"
            obstacles.append((phi_end, (f"{name} solid", found, remedy)))
    if obstacles:
        return min(obstacles, key=lambda item: item[0])[1]
    if np.isnan(phi):
        found = f"{under}: no equilibrium of the arm up to {np.degrees(highest_phi):.1f} degrees"
        return "no equilibrium", found, "reduce this load or stiffen the springs"
    return None


def _checks(
    suspension: TrailingArmSuspension, frame: Arm, cases: tuple[Case, ...]
) -> Iterator[Check]:
    """All checks of heights, yield, buckling, space and fatigue."""
    limits, solid = suspension.checks, solid_heights(suspension)
    case = max(cases, key=lambda case: case.load)
    if limits.solid_load is not None:
        case = next(case for case in cases if case.name == limits.solid_load)
    each = zip(suspension.springs.items(), frame.coils, strict=True)
    springs = {name: (*wire_and_coils(spring), coil) for (name, spring), coil in each}
    for kind, factor, origin in (
        ("solid_height", limits.clearance_factor, "solid height + {} n (D + d), Grossi (2025)"),
        ("coil_clearance", limits.standard_clearance_factor, "the same with {}, EN 13906-1 static"),
    ):
        note = f"height at {case.name} against " + origin.format(factor)
        for name, (d, n, coil) in springs.items():
            least = solid[name] + checks.coil_clearance(n, coil.D, d, factor)
            height = float(case.springs[name].height)
            yield Check(f"{kind}_{name}", height, least, "above", "m", note)
    if (table := suspension.material.tau_allowable) is not None:
        note = "stress of the solid spring against material.tau_allowable"
        for name, (d, _, coil) in springs.items():
            tau = checks.solid_stress(coil.K_V, d, coil.D, coil.H0 - solid[name])
            allowable = float(checks.allowable_stress(table, d))
            yield Check(f"yield_{name}", tau, allowable, "below", "Pa", note)
    for name, (_, _, coil) in springs.items():
        note = f"largest deflection against buckling, EN 13906-1, seating {limits.seating:g}"
        limit = float(helical.buckling_deflection(coil.H0, coil.D, frame.nu, limits.seating))
        if np.isinf(limit):
            limit = coil.H0
            note += ": does not buckle, limit is the free height"
        deflection = max(float(case.springs[name].deflection) for case in cases)
        yield Check(f"buckling_{name}", deflection, limit, "below", "m", note)
    if suspension.inner is not None:
        gap = radial_clearance(suspension.outer, suspension.inner)
        note = "gap between inner and outer spring"
        yield Check("radial_clearance", gap, limits.radial_clearance, "above", "m", note)
    if suspension.fatigue is not None:
        note = "allowable over actual upper stress on the Goodman-Smith line"
        for name, found in fatigue(suspension).items():
            limit = limits.fatigue_margin
            yield Check(f"fatigue_{name}", found.margin, limit, "above", "1", note)
