"""Data sheet of each spring of a suspension: what EN 13298 has the purchaser and maker agree on.

Dimensions, stiffness, mass, natural frequency; under each load height, force, stresses and the
lateral stiffness by several methods.  Tolerances, material and tests are left to the order.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from railsim.definitions.spring import HelicalSpring, TrailingArmSuspension
from railsim.springs import checks, helical
from railsim.springs.verification import Verification, stress
from railsim.springs.verification_checks import built, solid_heights

LATERAL = ("Grossi", "EN 13906-1", "Wahl, C_l = 1")
"""Methods of the lateral stiffness; no free source gives those of Gross and Sparing."""


@dataclass(frozen=True)
class Loaded:
    """One spring under one load.

    Attributes
    ----------
    force, height : float
        Vertical force [N], height under load [m].
    tau, tau_k : float
        Shear stress without correction, and with the factor for the curvature of the wire and the
        lateral load [Pa].
    lateral : dict of str to float
        Lateral stiffness by method, `LATERAL` [N/m].
    """

    force: float
    height: float
    tau: float
    tau_k: float
    lateral: Mapping[str, float]


@dataclass(frozen=True)
class Sheet:
    """Data of one spring.

    Attributes
    ----------
    values : dict of str to float
        By name, SI: `d`, `D`, `D_outer`, `D_inner`, `index` (D/d), `n`, `n_total`, `H0`, `L_solid`,
        `K_V`, `mass`, `surge_frequency`, `tau_solid`.
    loads : dict of str to Loaded
        By the name of the load.
    """

    values: Mapping[str, float]
    loads: Mapping[str, Loaded]


def data_sheets(suspension: TrailingArmSuspension, result: Verification) -> dict[str, Sheet]:
    """Data sheets of all springs of a verified suspension, by the springs' names."""
    solid = solid_heights(suspension)
    sheets = {}
    for name, coil in zip(suspension.springs, result.arm.coils, strict=True):
        spring = suspension.springs[name]
        loads = {}
        for case in result.cases:
            state = case.springs[name]
            d, _ = built(spring)
            force = float(state.force)
            at = (coil.K_V, spring.mean_diameter, spring.free_height, state.deflection)
            nu = result.arm.nu
            methods = (
                float(state.K_L),
                float(helical.beam_lateral_stiffness(*at, nu)),
                float(helical.lateral_stiffness_wahl(*at, nu)),
            )
            lateral = dict(zip(LATERAL, methods, strict=True)) if force > 0.0 else {}
            loads[case.name] = Loaded(
                force,
                float(state.height),
                8.0 * spring.mean_diameter * force / (np.pi * d**3),
                stress(spring, state),
                lateral,
            )
        sheets[name] = Sheet(_values(suspension, spring, float(coil.K_V), solid[name]), loads)
    return sheets


def _values(
    suspension: TrailingArmSuspension, spring: HelicalSpring, K_V: float, solid: float
) -> dict[str, float]:
    d, n = built(spring)
    D, material = spring.mean_diameter, suspension.material
    n_t = float(checks.total_coils(n, suspension.checks.dead_coils, suspension.checks.end_coils))
    return {
        "d": d,
        "D": D,
        "D_outer": D + d,
        "D_inner": D - d,
        "index": D / d,
        "n": n,
        "n_total": n_t,
        "H0": spring.free_height,
        "L_solid": solid,
        "K_V": K_V,
        "mass": float(checks.mass(d, D, n_t, material.density)),
        "surge_frequency": float(checks.surge_frequency(d, D, n, material.G, material.density)),
        "tau_solid": float(checks.solid_stress(K_V, d, D, spring.free_height - solid)),
    }
