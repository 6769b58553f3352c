"""Data sheet of each spring of a suspension: what EN 13298 has the purchaser and maker agree on.

Dimensions, stiffness, mass, natural frequency; under each load height, force, stresses and the
lateral stiffness by several methods.  Tolerances, material and tests are left to the order.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from railsim.definitions.spring import TrailingArmSuspension
from railsim.springs import checks, helical
from railsim.springs.verification import Verification, solid_heights, stress, wire_and_coils

LATERAL = ("Grossi", "EN 13906-1", "Wahl, C_l = 1")
"""Methods of the lateral stiffness; no free source gives those of Gross and Sparing."""


@dataclass(frozen=True)
class Loaded:
    """One spring under one load."""

    force: float  # vertical [N]
    height: float  # under load [m]
    tau: float  # shear stress without correction [Pa]
    tau_k: float  # with the factor for the curvature of the wire and the lateral load [Pa]
    lateral: Mapping[str, float]  # lateral stiffness by method, `LATERAL` [N/m]


@dataclass(frozen=True)
class Sheet:
    """Data of one spring.

    `values`: By name, SI: `d`, `D`, `D_outer`, `D_inner`, `index` (D/d), `n`, `n_total`, `H0`,
    `L_solid`, `K_V`, `mass`, `surge_frequency`, `tau_solid`.
    """

    values: Mapping[str, float]
    loads: Mapping[str, Loaded]  # by the name of the load


def data_sheets(suspension: TrailingArmSuspension, result: Verification) -> dict[str, Sheet]:
    """Data sheets of all springs of a verified suspension, by the springs' names."""
    material, limits = suspension.material, suspension.checks
    sheets = {}
    for (name, spring), coil in zip(suspension.springs.items(), result.arm.coils, strict=True):
        (d, n), D, H0 = wire_and_coils(spring), spring.mean_diameter, spring.free_height
        n_t = checks.total_coils(n, limits.dead_coils, limits.end_coils)
        solid = solid_heights(suspension)[name]
        loads = {}
        for case in result.cases:
            state = case.springs[name]
            force = float(state.force)
            at = (coil.K_V, D, H0, state.deflection, result.arm.nu)
            beam, wahl = helical.beam_stiffnesses(*at)[0], helical.lateral_stiffness_wahl(*at)
            methods = zip(LATERAL, map(float, (state.K_L, beam, wahl)), strict=True)
            stresses = checks.shear_stress(force, d, D), stress(spring, state)
            lateral = dict(methods) if force > 0.0 else {}
            loads[case.name] = Loaded(force, float(state.height), *stresses, lateral)
        values = {
            "d": d, "D": D, "D_outer": D + d, "D_inner": D - d, "index": D / d, "n": n,
            "n_total": n_t, "H0": H0, "L_solid": solid, "K_V": coil.K_V,
            "mass": checks.mass(d, D, n_t, material.density),
            "surge_frequency": float(checks.surge_frequency(d, D, n, material.G, material.density)),
            "tau_solid": checks.solid_stress(coil.K_V, d, D, H0 - solid),
        }  # fmt: skip
        sheets[name] = Sheet(values, loads)
    return sheets
