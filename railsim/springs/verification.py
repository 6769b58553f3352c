"""Does a built suspension do what it should: all loads, all checks, fatigue.

`mounted` turns the file's springs into an `Arm` that stands horizontal under the mounting load,
`verify` answers for every load of the file and compares with the limits, `fatigue` for the dynamic
loads.  A load that the nest cannot carry (solid, buckled, lifted off) is an input fault that names
what to change; a check that is not met is a result.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from railsim.definitions.spring import HelicalSpring, TrailingArmSuspension, radial_clearance
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState

TARE_MAX, TARE_MIN = 1.20, 0.65  # dynamic loads over the tare load: + 20 %, - 35 %


@dataclass(frozen=True)
class Case:
    """The suspension under one load.

    Attributes
    ----------
    name : str
        Name of the load.
    load : float
        Load at the axle [N].
    rotation : float
        Rotation of the arm, positive above the mounting load [rad].
    deflection : float
        Deflection of the outer spring [m].
    K_sys : float
        System stiffness, load over deflection [N/m].
    rate : float
        Change of the load over the rise of the axle towards the frame: what small movements
        about this load feel [N/m].
    springs : dict of str to CoilState
        State of each spring.
    """

    name: str
    load: float
    rotation: float
    deflection: float
    K_sys: float
    rate: float
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
class Check:
    """A value against its limit.

    Attributes
    ----------
    name : str
        What is checked, with the spring's name.
    value, limit : float
        In SI units.
    unit : str
        Their unit.
    sense : {"above", "below"}
        On which side of the limit the value must lie.
    note : str
        What the limit comes from.
    """

    name: str
    value: float
    limit: float
    unit: str
    sense: Literal["above", "below"]
    note: str

    @property
    def ok(self) -> bool:
        """Whether the check is met."""
        if self.sense == "above":
            return bool(self.value > self.limit)
        return bool(self.value < self.limit)


@dataclass(frozen=True)
class Fatigue:
    """Fatigue of one spring between the lowest and the highest dynamic load.

    Attributes
    ----------
    tau_max, tau_min : float
        Corrected stress under the highest and the lowest load [Pa].
    limit : float
        Allowable upper stress at `tau_min` [Pa].
    margin : float
        `limit / tau_max`.
    """

    tau_max: float
    tau_min: float
    limit: float
    margin: float


@dataclass(frozen=True)
class Verification:
    """All loads and checks of a suspension.

    Attributes
    ----------
    arm : Arm
        The suspension as computed.
    cases : tuple of Case
        In the order of the file's loads.
    checks : tuple of Check
        All checks; see `Check.ok`.
    """

    arm: Arm
    cases: tuple[Case, ...]
    checks: tuple[Check, ...]


def mounted(suspension: TrailingArmSuspension) -> Arm:
    """Return the arm with the file's springs, horizontal under the mounting load.

    Raises
    ------
    InputError
        A wire diameter or a number of coils is missing, or a spring is solid unloaded.
    """
    faults = [
        Fault(suspension.name, f"{name}.{key}", "missing", f"needed: {meaning}")
        for name, spring in suspension.springs.items()
        for key, value, meaning in (
            ("wire_diameter", spring.wire_diameter, "the wire diameter [m]"),
            ("active_coils", spring.active_coils, "the number of active coils; see design"),
        )
        if value is None
    ]
    if not faults:
        faults = [
            Fault(
                suspension.name,
                f"{name}.free_height",
                f"{suspension.springs[name].free_height * 1e3:.1f} mm, but the spring is solid at "
                f"{solid * 1e3:.1f} mm",
                f"raise it, or reduce {name}.active_coils or {name}.wire_diameter",
            )
            for name, solid in solid_heights(suspension).items()
            if solid >= suspension.springs[name].free_height
        ]
    if faults:
        raise InputError(faults)
    springs = list(suspension.springs.values())
    K_V = [vertical_stiffness(suspension, spring) for spring in springs]
    gaps = (0.0, suspension.engagement)[: len(springs)]
    start = float(trailing_arm.mounting_deflection(suspension.mounting.load, K_V, gaps))
    return Arm(
        length=suspension.arm.length,
        bush=suspension.arm.bush_torsional_stiffness,
        nu=float(helical.poisson_number(suspension.material.E, suspension.material.G)),
        coils=tuple(
            Coil(k, spring.mean_diameter, spring.free_height, seat, start - gap)
            for k, spring, seat, gap in zip(
                K_V, springs, suspension.seat_heights, gaps, strict=True
            )
        ),
        form=suspension.arm.equilibrium,
    )


def vertical_stiffness(suspension: TrailingArmSuspension, spring: HelicalSpring) -> float:
    """Vertical stiffness of one of the file's springs [N/m]."""
    d, n = built(spring)
    return float(helical.vertical_stiffness(suspension.material.G, d, spring.mean_diameter, n))


def built(spring: HelicalSpring) -> tuple[float, float]:
    """Wire diameter and active coils of a spring that has both (`mounted` checks that)."""
    if spring.wire_diameter is None or spring.active_coils is None:
        raise ValueError("the spring has no wire diameter or no number of coils")
    return spring.wire_diameter, spring.active_coils


def solid_heights(suspension: TrailingArmSuspension) -> dict[str, float]:
    """Solid height of each spring [m]."""
    heights = {}
    for name, spring in suspension.springs.items():
        d, n = built(spring)
        limits = suspension.checks
        n_t = checks.total_coils(n, limits.dead_coils, limits.end_coils)
        heights[name] = float(checks.solid_height(n_t, d))
    return heights


def load_cases(
    suspension: TrailingArmSuspension, loads: Mapping[str, float], key: str = "loads"
) -> tuple[Arm, tuple[Case, ...]]:
    """Equilibrium under each load.

    Parameters
    ----------
    suspension : TrailingArmSuspension
        The file's content.
    loads : mapping of str to float
        Loads by name [N].
    key : str
        Table or dotted key of the file that holds them, for messages.

    Raises
    ------
    InputError
        A spring lifts off, goes solid or buckles under a load.
    """
    frame = mounted(suspension)
    phi = np.atleast_1d(trailing_arm.rotation(frame, np.array(list(loads.values()))))
    met: list[tuple[str, _Obstacle]] = []
    cases = []
    for (name, load), turned in zip(loads.items(), phi.tolist(), strict=True):
        obstacle = _obstacle(suspension, frame, load, turned)
        if obstacle is not None:
            met.append((name, obstacle))
            continue
        states = {
            spring: trailing_arm.coil_state(frame, coil, turned)
            for spring, coil in zip(suspension.springs, frame.coils, strict=True)
        }
        deflection = float(states["outer"].deflection)
        cases.append(
            Case(
                name=name,
                load=load,
                rotation=turned,
                deflection=deflection,
                K_sys=load / deflection,
                rate=_rate(frame, turned),
                springs=states,
            )
        )
    if met:
        raise InputError(_grouped(suspension, key, met))
    return frame, tuple(cases)


def verify(suspension: TrailingArmSuspension) -> Verification:
    """Verify a suspension under all its loads.

    Parameters
    ----------
    suspension : TrailingArmSuspension
        The file's content; every spring with its wire diameter and number of coils.

    Raises
    ------
    InputError
        A wire diameter or number of coils is missing, or a load cannot be carried.

    Examples
    --------
    >>> from railsim.definitions.loading import load_spring
    >>> result = verify(load_spring("turasas_axlebox"))
    >>> {case.name: round(case.K_sys / 9810, 3) for case in result.cases}["T.I."]
    101.888
    """
    frame, cases = load_cases(suspension, suspension.loads)
    results = [
        *_height_checks(suspension, cases),
        *_yield_checks(suspension),
        *_buckling_checks(suspension, cases),
        *_space_checks(suspension),
    ]
    if suspension.fatigue is not None:
        results += [
            Check(
                f"fatigue_{name}",
                result.margin,
                suspension.checks.fatigue_margin,
                "1",
                "above",
                "allowable over actual upper stress on the Goodman-Smith line",
            )
            for name, result in fatigue(suspension).items()
        ]
    return Verification(frame, cases, tuple(results))


def fatigue(suspension: TrailingArmSuspension) -> dict[str, Fatigue]:
    """Fatigue of each spring between the lowest and the highest dynamic load.

    Raises
    ------
    InputError
        No table `[fatigue]`, or a dynamic load that cannot be carried.

    Examples
    --------
    >>> from railsim.definitions.loading import load_spring
    >>> margins = fatigue(load_spring("turasas_axlebox"))
    >>> round(margins["outer"].margin, 3)
    1.327
    """
    if suspension.fatigue is None:
        raise InputError(
            [Fault(suspension.name, "fatigue", "missing", "needed: goodman = [[0, ...], ...]")]
        )
    goodman = suspension.fatigue.goodman
    loads = dynamic_loads(suspension)
    _, (highest, lowest) = load_cases(suspension, loads, "fatigue")
    results = {}
    for name, spring in suspension.springs.items():
        at_highest, at_lowest = (_stress(spring, case.springs[name]) for case in (highest, lowest))
        tau_min, tau_max = sorted((at_highest, at_lowest))
        limit = float(checks.goodman_limit(goodman, tau_min))
        results[name] = Fatigue(tau_max, tau_min, limit, limit / tau_max)
    return results


def dynamic_loads(suspension: TrailingArmSuspension) -> dict[str, float]:
    """The highest and the lowest dynamic load, given or from the tare load [N]."""
    table = suspension.fatigue
    if table is None:
        raise ValueError("the suspension has no fatigue table")
    given = {"max_load": table.max_load, "min_load": table.min_load}
    factors = {"max_load": TARE_MAX, "min_load": TARE_MIN}
    return {
        key: factors[key] * suspension.loads[table.tare] if load is None else load
        for key, load in given.items()
    }


def _stress(spring: HelicalSpring, state: CoilState) -> float:
    d, _ = built(spring)
    shear = state.K_L * state.lateral
    return float(
        checks.corrected_stress(
            d, spring.mean_diameter, state.force, shear, state.height, state.lateral
        )
    )


def _rate(frame: Arm, phi: float) -> float:
    """Slope of the load over the rise of the axle, by a central difference [N/m]."""
    step = 1e-5  # rad: error of the difference about 1e-9, round-off about 1e-10 of the rate
    low, high = trailing_arm.load(frame, np.array([phi - step, phi + step])).tolist()
    return float(high - low) / (2.0 * step * frame.length * float(np.cos(phi)))


@dataclass(frozen=True)
class _Obstacle:
    """What keeps the nest from carrying a load; equal ones are reported once."""

    cause: str
    found: str
    mend: str


def _grouped(
    suspension: TrailingArmSuspension, key: str, met: Sequence[tuple[str, _Obstacle]]
) -> list[Fault]:
    """One fault for each cause, at the first load that meets it."""
    loads: dict[str, list[str]] = {}
    first: dict[str, _Obstacle] = {}
    for name, obstacle in met:
        loads.setdefault(obstacle.cause, []).append(name)
        first.setdefault(obstacle.cause, obstacle)
    faults = []
    for cause, obstacle in first.items():
        name, *others = loads[cause]
        also = f" (also {', '.join(others)})" if others else ""
        faults.append(Fault(suspension.name, f"{key}.{name}", obstacle.found + also, obstacle.mend))
    return faults


def _obstacle(
    suspension: TrailingArmSuspension, frame: Arm, load: float, phi: float
) -> _Obstacle | None:
    """What makes a load impossible, if anything does."""
    given = f"{load * 1e-3:.3f} kN"
    lowest_phi, highest_phi = (float(value) for value in trailing_arm.rotation_range(frame))
    lowest = float(trailing_arm.load(frame, lowest_phi))
    if load <= lowest:
        return _Obstacle(
            "lifted",
            f"{given} lifts the arm off its springs (below {lowest * 1e-3:.3f} kN)",
            "raise this load, or reduce mounting.load against it",
        )
    solid = solid_heights(suspension)
    met: list[tuple[float, _Obstacle]] = []
    for name, coil in zip(suspension.springs, frame.coils, strict=True):
        turned = highest_phi if np.isnan(phi) else phi
        rise, _ = trailing_arm.displacement(frame.length, coil.seat, turned)
        deflection = float(coil.start + rise)
        seating = suspension.checks.seating
        buckling = float(helical.buckling_deflection(coil.H0, coil.D, frame.nu, seating))
        if deflection >= buckling:
            obstacle = _buckled(name, given, buckling, _load_at(frame, coil, buckling))
            met.append((buckling / float(coil.H0), obstacle))
        travel = float(coil.H0) - solid[name]
        if deflection >= travel:
            obstacle = _solid(name, given, solid[name], _load_at(frame, coil, travel))
            met.append((travel / float(coil.H0), obstacle))
    if met:
        return min(met, key=lambda item: item[0])[1]
    if np.isnan(phi):
        return _Obstacle(
            "no equilibrium",
            f"{given}: no equilibrium of the arm up to {np.degrees(highest_phi):.1f} degrees",
            "reduce this load or stiffen the springs",
        )
    return None


def _buckled(name: str, given: str, limit: float, reached: float) -> _Obstacle:
    return _Obstacle(
        f"{name} buckled",
        f"{given} buckles the {name} spring: it buckles at {limit * 1e3:.1f} mm, under "
        f"{reached * 1e-3:.1f} kN",
        f"reduce {name}.free_height, raise {name}.mean_diameter, or hold the seats against "
        "sideways movement (checks.seating = 0.5)",
    )


def _solid(name: str, given: str, solid: float, reached: float) -> _Obstacle:
    return _Obstacle(
        f"{name} solid",
        f"{given} is beyond the solid height of the {name} spring: {solid * 1e3:.1f} mm is "
        f"reached under {reached * 1e-3:.1f} kN",
        f"reduce this load, {name}.active_coils or {name}.wire_diameter, or raise "
        f"{name}.free_height",
    )


def _load_at(frame: Arm, coil: Coil, deflection: float) -> float:
    """Load at which a spring reaches a deflection, nan beyond the arm's reach [N]."""
    phi = trailing_arm.rotation_of_rise(frame.length, coil.seat, deflection - coil.start)
    return float(trailing_arm.load(frame, phi))


def _height_checks(suspension: TrailingArmSuspension, cases: tuple[Case, ...]) -> list[Check]:
    limits = suspension.checks
    case = max(cases, key=lambda case: case.load)
    if limits.solid_load is not None:
        case = next(case for case in cases if case.name == limits.solid_load)
    solid = solid_heights(suspension)
    results = []
    for kind, factor, origin in (
        ("solid_height", limits.clearance_factor, "solid height + {} n (D + d), Grossi (2025)"),
        ("coil_clearance", limits.standard_clearance_factor, "the same with {}, EN 13906-1 static"),
    ):
        for name, spring in suspension.springs.items():
            d, n = built(spring)
            reserve = checks.coil_clearance(n, spring.mean_diameter, d, factor)
            results.append(
                Check(
                    f"{kind}_{name}",
                    float(case.springs[name].height),
                    solid[name] + float(reserve),
                    "m",
                    "above",
                    f"height at {case.name} against " + origin.format(factor),
                )
            )
    return results


def _yield_checks(suspension: TrailingArmSuspension) -> list[Check]:
    table = suspension.material.tau_allowable
    if table is None:
        return []
    results = []
    for (name, spring), solid in zip(
        suspension.springs.items(), solid_heights(suspension).values(), strict=True
    ):
        d, _ = built(spring)
        K_V = vertical_stiffness(suspension, spring)
        stress = checks.solid_stress(K_V, d, spring.mean_diameter, spring.free_height - solid)
        results.append(
            Check(
                f"yield_{name}",
                float(stress),
                float(checks.allowable_stress(table, d)),
                "Pa",
                "below",
                "stress of the solid spring against material.tau_allowable",
            )
        )
    return results


def _buckling_checks(suspension: TrailingArmSuspension, cases: tuple[Case, ...]) -> list[Check]:
    nu = float(helical.poisson_number(suspension.material.E, suspension.material.G))
    seating = suspension.checks.seating
    results = []
    for name, spring in suspension.springs.items():
        limit = float(
            helical.buckling_deflection(spring.free_height, spring.mean_diameter, nu, seating)
        )
        note = f"largest deflection against buckling, EN 13906-1, seating {seating:g}"
        if np.isinf(limit):
            limit = spring.free_height
            note += ": does not buckle, limit is the free height"
        deflection = max(float(case.springs[name].deflection) for case in cases)
        results.append(Check(f"buckling_{name}", deflection, limit, "m", "below", note))
    return results


def _space_checks(suspension: TrailingArmSuspension) -> list[Check]:
    if suspension.inner is None:
        return []
    return [
        Check(
            "radial_clearance",
            radial_clearance(suspension.outer, suspension.inner),
            suspension.checks.radial_clearance,
            "m",
            "above",
            "gap between inner and outer spring",
        )
    ]
