"""Results as plain numbers by name, in SI: what ``--json`` prints and what the tables show.

The keys are part of the interface and documented in docs/user/springs.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from railsim.definitions.spring import TrailingArmSuspension
from railsim.springs.datasheet import data_sheets
from railsim.springs.design import Design
from railsim.springs.helical import active_coils
from railsim.springs.nests import EN_10060
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Case, Fatigue, Verification

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

Data = dict[str, Any]


def design_data(suspension: TrailingArmSuspension, result: Design) -> Data:
    """The design as plain numbers; see `Design`."""
    return {
        "name": suspension.name, "equilibrium": suspension.arm.equilibrium,
        "theta": abs(result.rotation), "rotation": result.rotation, "K_tot": result.K_tot,
        "K_L": result.K_L, "K_C": result.K_C, "target_load_range": list(result.load_range),
        **{f"K_V_{name}": K_V for name, K_V in zip(result.names, result.K_V, strict=True)},
        **{f"n_{name}": n for name, n in zip(result.names, result.n, strict=True)},
        "coils": coils_by_wire(suspension, result),
    }  # fmt: skip


def coils_by_wire(suspension: TrailingArmSuspension, result: Design) -> dict[str, list[Data]]:
    """Active coils for every wire of the file's list (else EN 10060) with a sensible index D/d."""
    search = suspension.search
    wires = (search.wire_diameters if search is not None else None) or EN_10060
    low, high = search.spring_index if search is not None else (3.0, 12.0)
    found: dict[str, list[Data]] = {}
    for (name, spring), K_V in zip(suspension.springs.items(), result.K_V, strict=True):
        D, found[name] = spring.mean_diameter, []
        for d in wires:
            if low <= D / d <= high:
                n = active_coils(suspension.material.G, d, D, K_V)
                found[name].append({"wire_diameter": d, "active_coils": n, "spring_index": D / d})
    return found


def verification_data(suspension: TrailingArmSuspension, result: Verification) -> Data:
    """Load cases, data sheets of the springs and checks as plain numbers."""
    sheets = data_sheets(suspension, result)
    return {
        "name": suspension.name,
        "equilibrium": suspension.arm.equilibrium,
        "K_V": {name: sheet.values["K_V"] for name, sheet in sheets.items()},
        "mounting_deflection": float(result.arm.coils[0].start),
        "cases": [case_data(case) for case in result.cases],
        "springs": {
            n: {**sheet.values, "loads": asdict(sheet)["loads"]} for n, sheet in sheets.items()
        },
        "checks": [check.data for check in result.checks],
        "ok": all(check.ok for check in result.checks),
    }


def case_data(case: Case) -> Data:
    """One load case as plain numbers."""
    names = ("name", "load", "theta", "rotation", "deflection", "K_sys", "rate", "K_L", "K_C")
    data = {name: getattr(case, name) for name in names}
    for name, state in case.springs.items():
        data[f"lateral_{name}"] = case.lateral(name)
        for key in ("height", "force", "K_L", "K_C"):
            data[f"{key}_{name}"] = float(getattr(state, key))
    return data


def fatigue_data(
    suspension: TrailingArmSuspension, result: Mapping[str, Fatigue], loads: Mapping[str, float]
) -> Data:
    """Stresses and margins by spring, with the dynamic loads."""
    springs = {name: asdict(spring) for name, spring in result.items()}
    return {"name": suspension.name, **loads, **springs}


def search_data(result: "SearchResult") -> Data:
    """The ranked nests and how the candidates fared."""
    return {key: value for key, value in asdict(result).items() if key != "cloud"}


def ride_height_data(results: Sequence[RideHeight]) -> list[Data]:
    """Scatter of the ride height by load."""
    return [asdict(result) for result in results]
