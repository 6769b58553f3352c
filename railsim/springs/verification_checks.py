"""Checks of a trailing-arm suspension: heights, yield, buckling, space."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from railsim.definitions.spring import HelicalSpring, TrailingArmSuspension, radial_clearance
from railsim.errors import Fault
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState


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


@dataclass(frozen=True)
class Obstacle:
    """What keeps the nest from carrying a load; equal ones are reported once."""

    cause: str
    found: str
    mend: str


def grouped(
    suspension: TrailingArmSuspension, key: str, met: Sequence[tuple[str, Obstacle]]
) -> list[Fault]:
    """One fault for each cause, at the first load that meets it."""
    loads: dict[str, list[str]] = {}
    first: dict[str, Obstacle] = {}
    for name, obstacle in met:
        loads.setdefault(obstacle.cause, []).append(name)
        first.setdefault(obstacle.cause, obstacle)
    faults = []
    for cause, obstacle in first.items():
        name, *others = loads[cause]
        also = f" (also {', '.join(others)})" if others else ""
        faults.append(Fault(suspension.name, f"{key}.{name}", obstacle.found + also, obstacle.mend))
    return faults


def obstacle_of(
    suspension: TrailingArmSuspension, frame: Arm, load: float, phi: float
) -> Obstacle | None:
    """What makes a load impossible, if anything does."""
    given = f"{load * 1e-3:.3f} kN"
    lowest_phi, highest_phi = (float(value) for value in trailing_arm.rotation_range(frame))
    lowest = float(trailing_arm.load(frame, lowest_phi))
    if load <= lowest:
        return Obstacle(
            "lifted",
            f"{given} lifts the arm off its springs (below {lowest * 1e-3:.3f} kN)",
            "raise this load, or reduce mounting.load against it",
        )
    solid = solid_heights(suspension)
    met: list[tuple[float, Obstacle]] = []
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
        return Obstacle(
            "no equilibrium",
            f"{given}: no equilibrium of the arm up to {np.degrees(highest_phi):.1f} degrees",
            "reduce this load or stiffen the springs",
        )
    return None


def _buckled(name: str, given: str, limit: float, reached: float) -> Obstacle:
    return Obstacle(
        f"{name} buckled",
        f"{given} buckles the {name} spring: it buckles at {limit * 1e3:.1f} mm, under "
        f"{reached * 1e-3:.1f} kN",
        f"reduce {name}.free_height, raise {name}.mean_diameter, or hold the seats against "
        "sideways movement (checks.seating = 0.5)",
    )


def _solid(name: str, given: str, solid: float, reached: float) -> Obstacle:
    return Obstacle(
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


def height_checks(suspension: TrailingArmSuspension, cases: tuple[Case, ...]) -> list[Check]:
    """Return the checks of height under load: no spring solid, no coil on the next."""
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


def yield_checks(suspension: TrailingArmSuspension) -> list[Check]:
    """Return the checks of the stress under the largest load."""
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


def buckling_checks(suspension: TrailingArmSuspension, cases: tuple[Case, ...]) -> list[Check]:
    """Return the checks against buckling."""
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


def space_checks(suspension: TrailingArmSuspension) -> list[Check]:
    """Return the check of the space between the springs of a nest."""
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
