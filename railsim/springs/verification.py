"""Does a built suspension do what it should: all loads, all checks, fatigue.

`mounted` turns the file's springs into an `Arm` that stands horizontal under the mounting load,
`verify` answers for every load of the file and compares with the limits, `fatigue` for the dynamic
loads.  A load that the nest cannot carry (solid, buckled, lifted off) is an input fault that names
what to change; a check that is not met is a result.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railsim.definitions.spring import HelicalSpring, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import arm as trailing_arm
from railsim.springs import checks, helical
from railsim.springs.arm import Arm, Coil, CoilState
from railsim.springs.verification_checks import (
    Case,
    Check,
    Obstacle,
    buckling_checks,
    built,
    grouped,
    height_checks,
    obstacle_of,
    solid_heights,
    space_checks,
    vertical_stiffness,
    yield_checks,
)

TARE_MAX, TARE_MIN = 1.20, 0.65  # dynamic loads over the tare load: + 20 %, - 35 %


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
    met: list[tuple[str, Obstacle]] = []
    cases = []
    for (name, load), turned in zip(loads.items(), phi.tolist(), strict=True):
        obstacle = obstacle_of(suspension, frame, load, turned)
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
        raise InputError(grouped(suspension, key, met))
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
        *height_checks(suspension, cases),
        *yield_checks(suspension),
        *buckling_checks(suspension, cases),
        *space_checks(suspension),
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
        at_highest, at_lowest = (stress(spring, case.springs[name]) for case in (highest, lowest))
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


def stress(spring: HelicalSpring, state: CoilState) -> float:
    """Largest corrected shear stress of a spring under load [Pa]."""
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
