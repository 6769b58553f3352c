"""Results as plain numbers by name, in SI: what ``--json`` prints and the report page reads.

The keys are part of the interface and documented in docs/user/springs.md.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from railsim.definitions.spring import TrailingArmSuspension
from railsim.springs.datasheet import Sheet, data_sheets
from railsim.springs.design import Design
from railsim.springs.helical import active_coils
from railsim.springs.nests import EN_10060
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Case, Check, Fatigue, Verification

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

Data = dict[str, Any]


def design_data(suspension: TrailingArmSuspension, result: Design) -> Data:
    """The design as plain numbers; see `Design`."""
    data: Data = {
        "name": suspension.name,
        "equilibrium": suspension.arm.equilibrium,
        "theta": abs(result.rotation),
        "rotation": result.rotation,
        "K_tot": result.K_tot,
        "K_L": result.K_L,
        "K_C": result.K_C,
        "target_load_range": list(result.load_range),
    }
    for name, K_V, n in zip(result.names, result.K_V, result.n, strict=True):
        data[f"K_V_{name}"] = K_V
        data[f"n_{name}"] = n
    data["coils"] = coils_by_wire(suspension, result)
    return data


def coils_by_wire(suspension: TrailingArmSuspension, result: Design) -> dict[str, list[Data]]:
    """Active coils for every wire of the file's list (else EN 10060) with a sensible index D/d."""
    listed = suspension.search.wire_diameters if suspension.search is not None else None
    low, high = suspension.search.spring_index if suspension.search is not None else (3.0, 12.0)
    rows: dict[str, list[Data]] = {}
    for (name, spring), K_V in zip(suspension.springs.items(), result.K_V, strict=True):
        D = spring.mean_diameter
        rows[name] = [
            {
                "wire_diameter": d,
                "active_coils": float(active_coils(suspension.material.G, d, D, K_V)),
                "spring_index": D / d,
            }
            for d in listed or EN_10060
            if low <= D / d <= high
        ]
    return rows


def verification_data(suspension: TrailingArmSuspension, result: Verification) -> Data:
    """Load cases and checks as plain numbers."""
    return {
        "name": suspension.name,
        "equilibrium": suspension.arm.equilibrium,
        "K_V": {
            name: float(coil.K_V)
            for name, coil in zip(suspension.springs, result.arm.coils, strict=True)
        },
        "mounting_deflection": float(result.arm.coils[0].start),
        "cases": [case_data(case) for case in result.cases],
        "springs": sheet_data(data_sheets(suspension, result)),
        "checks": [check_data(check) for check in result.checks],
        "ok": all(check.ok for check in result.checks),
    }


def sheet_data(sheets: Mapping[str, Sheet]) -> Data:
    """Data sheets of the springs as plain numbers."""
    return {
        name: {
            **sheet.values,
            "loads": {
                load: {**vars(state), "lateral": dict(state.lateral)}
                for load, state in sheet.loads.items()
            },
        }
        for name, sheet in sheets.items()
    }


def case_data(case: Case) -> Data:
    """One load case as plain numbers."""
    data: Data = {
        "name": case.name,
        "load": case.load,
        "theta": case.theta,
        "rotation": case.rotation,
        "deflection": case.deflection,
        "K_sys": case.K_sys,
        "rate": case.rate,
        "K_L": case.K_L,
        "K_C": case.K_C,
    }
    for name, state in case.springs.items():
        data[f"lateral_{name}"] = case.lateral(name)
        data[f"height_{name}"] = float(state.height)
        data[f"force_{name}"] = float(state.force)
        data[f"K_L_{name}"] = float(state.K_L)
        data[f"K_C_{name}"] = float(state.K_C)
    return data


def check_data(check: Check) -> Data:
    """One check as plain values."""
    return {
        "name": check.name,
        "value": check.value,
        "limit": check.limit,
        "ok": check.ok,
        "unit": check.unit,
        "must_be": check.sense,
        "note": check.note,
    }


def fatigue_data(
    suspension: TrailingArmSuspension, result: Mapping[str, Fatigue], loads: Mapping[str, float]
) -> Data:
    """Stresses and margins by spring, with the dynamic loads."""
    springs = {name: dict(vars(spring)) for name, spring in result.items()}
    return {"name": suspension.name, **loads, **springs}


def search_data(result: "SearchResult") -> Data:
    """The ranked nests and how the candidates fared."""
    return {
        "objective": result.objective,
        "tried": result.tried,
        "feasible": result.feasible,
        "broken": dict(result.broken),
        "nests": [
            {
                "outer": dict(vars(nest.outer)),
                "inner": dict(vars(nest.inner)),
                "mass": nest.mass,
                "fatigue_margin": nest.fatigue_margin,
                "mounting_error": nest.mounting_error,
                "target_error": nest.target_error,
                "active": list(nest.active),
                "slack": dict(nest.slack),
            }
            for nest in result.nests
        ],
    }


def ride_height_data(results: Sequence[RideHeight]) -> list[Data]:
    """Scatter of the ride height by load."""
    return [
        {
            "name": result.name,
            "load": result.load,
            "lowest": result.lowest,
            "highest": result.highest,
            "random": result.random,
            "single": {name: list(ends) for name, ends in result.single.items()},
        }
        for result in results
    ]
