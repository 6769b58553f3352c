"""Results as tables of texts in the field's units, for the terminal and for the page.

Every function returns the header and the rows, in ASCII; the page sets signs in true typography.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from railsim.springs.datasheet import LATERAL, Sheet
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Check, Fatigue, Verification

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

Texts = tuple[list[str], list[list[str]]]

UNITS = {"m": ("mm", 1e3), "Pa": ("MPa", 1e-6), "1": ("", 1.0)}


def signed(value: float, digits: int) -> str:
    """Return a number with its sign, and without one where it rounds to zero."""
    if abs(value) < 0.5 * 10.0**-digits:
        return f"{0.0:.{digits}f}"
    return f"{value:+.{digits}f}"


def case_table(result: Verification) -> Texts:
    """Return one row for each load: position, stiffnesses, heights."""
    header = [
        "load case",
        "P / kN",
        "rotation / deg",
        "dz / mm",
        "K_sys / (N/mm)",
        "rate / (N/mm)",
        *(f"H {name} / mm" for name in result.cases[0].springs),
        "dx / mm",
        "K_L / (N/mm)",
        "K_C / (kNm/rad)",
    ]
    rows = [
        [
            case.name,
            f"{case.load * 1e-3:.3f}",
            signed(math.degrees(case.rotation), 4),
            f"{case.deflection * 1e3:.3f}",
            f"{case.K_sys * 1e-3:.3f}",
            f"{case.rate * 1e-3:.1f}",
            *(f"{float(state.height) * 1e3:.2f}" for state in case.springs.values()),
            signed(float(case.springs["outer"].lateral) * 1e3, 3),
            f"{case.K_L * 1e-3:.2f}",
            f"{case.K_C * 1e-3:.3f}",
        ]
        for case in result.cases
    ]
    return header, rows


def sheet_table(sheets: Mapping[str, Sheet]) -> Texts:
    """Return one row for each quantity of the springs' data sheets, a column a spring."""
    shown = {
        "d": ("wire diameter d / mm", 1e3, 2),
        "D": ("mean coil diameter D / mm", 1e3, 2),
        "D_outer": ("outside diameter / mm", 1e3, 2),
        "D_inner": ("inside diameter / mm", 1e3, 2),
        "index": ("spring index D/d", 1.0, 3),
        "n": ("active coils n", 1.0, 3),
        "n_total": ("total coils", 1.0, 3),
        "H0": ("free height / mm", 1e3, 2),
        "L_solid": ("solid height / mm", 1e3, 2),
        "K_V": ("vertical stiffness / (N/mm)", 1e-3, 3),
        "mass": ("mass / kg", 1.0, 2),
        "surge_frequency": ("surge frequency / Hz", 1.0, 1),
        "tau_solid": ("stress at solid height / MPa", 1e-6, 1),
    }
    rows = [
        [label, *(f"{sheet.values[name] * scale:.{digits}f}" for sheet in sheets.values())]
        for name, (label, scale, digits) in shown.items()
    ]
    return ["spring", *sheets], rows


def loaded_table(sheets: Mapping[str, Sheet]) -> Texts:
    """Return one row for each spring and load: force, height, stresses, lateral stiffnesses."""
    rows = [
        [
            f"{load}, {name}",
            f"{state.force * 1e-3:.3f}",
            f"{state.height * 1e3:.2f}",
            f"{state.tau * 1e-6:.1f}",
            f"{state.tau_k * 1e-6:.1f}",
            *(f"{state.lateral[m] * 1e-3:.2f}" if m in state.lateral else "-" for m in LATERAL),
        ]
        for load in next(iter(sheets.values())).loads
        for name, sheet in sheets.items()
        for state in (sheet.loads[load],)
    ]
    lateral = [f"K_L {method} / (N/mm)" for method in LATERAL]
    return ["load, spring", "F / kN", "H / mm", "tau / MPa", "tau_k / MPa", *lateral], rows


def check_table(checks: Sequence[Check]) -> Texts:
    """Return one row for each check."""
    rows = []
    for check in checks:
        unit, scale = UNITS[check.unit]
        digits = 3 if check.unit == "1" else 1
        sign = ">" if check.sense == "above" else "<"
        rows.append(
            [
                check.name,
                f"{check.value * scale:.{digits}f}",
                f"{sign} {check.limit * scale:.{digits}f}",
                unit,
                "yes" if check.ok else "NO",
            ]
        )
    return ["check", "value", "must be", "unit", "met"], rows


def fatigue_table(result: Mapping[str, Fatigue]) -> Texts:
    """Return one row for each spring: its stress range against the Goodman-Smith line."""
    rows = [
        [
            name,
            f"{spring.tau_min * 1e-6:.1f}",
            f"{spring.tau_max * 1e-6:.1f}",
            f"{spring.limit * 1e-6:.1f}",
            f"{spring.margin:.3f}",
        ]
        for name, spring in result.items()
    ]
    return ["spring", "tau_min / MPa", "tau_max / MPa", "allowable / MPa", "margin"], rows


def ride_height_table(results: Sequence[RideHeight]) -> Texts:
    """Return one row for each load: scatter of the ride height."""
    rows = [
        [
            result.name,
            f"{result.load * 1e-3:.3f}",
            f"+-{result.random * 1e3:.2f}",
            f"{signed(result.lowest * 1e3, 2)} to {signed(result.highest * 1e3, 2)}",
        ]
        for result in results
    ]
    return ["ride height", "P (kN)", "statistical, RSS (mm)", "worst case (mm)"], rows


def search_table(result: "SearchResult") -> Texts:
    """Return one row for each nest, the best first; the last column are the active limits."""
    header = [
        "rank",
        "outer d x D, n",
        "inner d x D, n",
        "H0 / mm",
        "kg",
        "fatigue",
        "error / mm",
        "active limits",
    ]
    rows = [
        [
            str(rank),
            *(
                f"{spring.wire_diameter * 1e3:.6g} x {spring.mean_diameter * 1e3:.6g}, "
                f"{spring.active_coils:.6g}"
                for spring in (nest.outer, nest.inner)
            ),
            f"{nest.outer.free_height * 1e3:.6g}/{nest.inner.free_height * 1e3:.6g}",
            f"{nest.mass:.2f}",
            f"{nest.fatigue_margin:.3f}",
            f"{signed(nest.mounting_error * 1e3, 2)}/{signed(nest.target_error * 1e3, 2)}",
            ", ".join(nest.active) or "none",
        ]
        for rank, nest in enumerate(result.nests, start=1)
    ]
    return header, rows
