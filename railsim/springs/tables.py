"""Results as tables in the field's units, for the terminal, for notebooks and for the page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from railsim.definitions.spring import TrailingArmSuspension
from railsim.springs.datasheet import LATERAL, Sheet
from railsim.springs.design import Design
from railsim.springs.summary import case_data
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Fatigue, Verification
from railsim.table import Column, Table

if TYPE_CHECKING:
    from railsim.springs.search import SearchResult

NO_FATIGUE = "Fatigue is not assessed: the file has no table [fatigue]."
SHEET = [
    Column("spring"),
    Column("d", "wire diameter d", "mm", ".2f"),
    Column("D", "mean coil diameter D", "mm", ".2f"),
    Column("D_outer", "outside diameter", "mm", ".2f"),
    Column("D_inner", "inside diameter", "mm", ".2f"),
    Column("index", "spring index D/d", "", ".3f"),
    Column("n", "active coils n", "", ".3f"),
    Column("n_total", "total coils", "", ".3f"),
    Column("H0", "free height H0", "mm", ".2f"),
    Column("L_solid", "solid height", "mm", ".2f"),
    Column("K_V", "vertical stiffness K_V", "N/mm", ".3f"),
    Column("mass", "mass", "kg", ".2f"),
    Column("surge_frequency", "surge frequency", "Hz", ".1f"),
    Column("tau_solid", "stress at solid height", "MPa", ".1f"),
]
FATIGUE = [
    Column("spring"),
    Column("tau_min", "lower stress", "MPa", ".1f"),
    Column("tau_max", "upper stress", "MPa", ".1f"),
    Column("limit", "allowable upper stress", "MPa", ".1f"),
    Column("margin", "", "", ".3f"),
]
RIDE_HEIGHT = [
    Column("name", "ride height at"),
    Column("load", "P", "kN", ".3f"),
    Column("random", "statistical (RSS), ±", "mm", ".2f"),
    Column("lowest", "worst case, low", "mm", "+.2f"),
    Column("highest", "worst case, high", "mm", "+.2f"),
]
SEARCH = [
    Column("rank", format="d"),
    Column("outer", "outer d x D (mm), n", format=">"),
    Column("inner", "inner d x D (mm), n", format=">"),
    Column("heights", "H0 outer/inner (mm)", format=">"),
    Column("mass", "mass", "kg", ".2f"),
    Column("fatigue_margin", "fatigue margin", "", ".3f"),
    Column("mounting_error", "error at mounting", "mm", "+.2f"),
    Column("target_error", "error at target", "mm", "+.2f"),
    Column("active", "active limits"),
]


def input_tables(suspension: TrailingArmSuspension) -> list[Table]:
    """Return the springs, and the arm with its loads, as the file gives them."""
    arm, material, seats = suspension.arm, suspension.material, suspension.seat_heights
    columns = [
        Column("spring"),
        Column("D", "mean coil diameter D", "mm", ".6g"),
        Column("d", "wire diameter d", "mm", ".6g"),
        Column("n", "active coils n", "", ".6g"),
        Column("H0", "free height H0", "mm", ".6g"),
        Column("seat", "seat above the axle", "mm", ".6g"),
        Column("start", "works from a deflection of", "mm", ".6g"),
    ]
    starts = (0.0, suspension.engagement)[: len(seats)]
    rows = []
    for (name, s), *where in zip(suspension.springs.items(), seats, starts, strict=True):
        sizes = s.mean_diameter, s.wire_diameter, s.active_coils, s.free_height
        rows.append([name, *sizes, *where])
    general = [
        (Column("arm length", unit="mm", format=".6g"), arm.length),
        (Column("bush", unit="N m/rad", format=".6g"), arm.bush_torsional_stiffness),
        (Column("shear modulus", unit="MPa", format=".6g"), material.G),
        (Column("Young's modulus", unit="MPa", format=".6g"), material.E),
    ]
    for name, point in (("mounting", suspension.mounting), ("target", suspension.target)):
        if point is not None:
            general.append((Column(f"{name} load", unit="kN", format=".6g"), point.load))
            deflection = Column(f"deflection under {name} load", unit="mm", format=".6g")
            general.append((deflection, point.deflection))
    heads, values = zip(*general, strict=True)
    arm_table = Table(["arm", *heads], [["", *values]])
    return [Table(columns, rows).transposed("spring"), arm_table.transposed("arm and loads")]


def design_table(suspension: TrailingArmSuspension, result: Design) -> Table:
    """Return one row for each spring: designed stiffness, and coils for the file's wire."""
    D, d = (Column(name, "", "mm", ".6g") for name in "Dd")
    columns = [Column("spring"), D, Column("K_V", "", "N/mm", ".3f"), d, Column("n", "", "", ".4f")]
    each = zip(suspension.springs.items(), result.K_V, result.n, strict=True)
    rows = [[name, s.mean_diameter, K_V, s.wire_diameter, n] for (name, s), K_V, n in each]
    return Table(columns, rows)


def load_table(suspension: TrailingArmSuspension) -> Table:
    """Return the loads with what they are."""
    columns = [Column("name", "load case"), Column("load", "P", "kN", ".3f"), Column("meaning")]
    notes = suspension.load_notes
    return Table(columns, [[name, P, notes.get(name)] for name, P in suspension.loads.items()])


def case_table(result: Verification) -> Table:
    """Return one row for each load: position, stiffnesses, heights."""
    columns = [
        Column("name", "load case"),
        Column("load", "P", "kN", ".3f"),
        Column("rotation", "", "deg", "+.4f"),
        Column("deflection", "dz", "mm", ".3f"),
        Column("K_sys", "", "N/mm", ".3f"),
        Column("rate", "tangent", "N/mm", ".1f"),
        *(Column(f"height_{name}", f"H {name}", "mm", ".2f") for name in result.cases[0].springs),
        Column("dx", "", "mm", "+.3f"),
        Column("K_L", "", "N/mm", ".2f"),
        Column("K_C", "", "kN m/rad", ".3f"),
    ]
    rows = [{**case_data(c), "dx": float(c.springs["outer"].lateral)} for c in result.cases]
    return Table(columns, rows)


def sheet_table(sheets: Mapping[str, Sheet]) -> Table:
    """Return one row for each quantity of the springs' data sheets, a column a spring."""
    rows = [{"spring": name, **sheet.values} for name, sheet in sheets.items()]
    return Table(SHEET, rows).transposed("spring")


def loaded_table(sheets: Mapping[str, Sheet]) -> Table:
    """Return one row for each spring and load: force, height, stresses, lateral stiffnesses."""
    columns = [
        Column("load case"),
        Column("spring"),
        Column("force", "F", "kN", ".3f"),
        Column("height", "H", "mm", ".2f"),
        Column("tau", "", "MPa", ".1f"),
        Column("tau_k", "", "MPa", ".1f"),
        *(Column(method, f"K_L {method}", "N/mm", ".2f") for method in LATERAL),
    ]
    rows = []
    for load in next(iter(sheets.values())).loads:
        for name, sheet in sheets.items():
            state = sheet.loads[load]
            rows.append({"load case": load, "spring": name, **vars(state), **state.lateral})
    return Table(columns, rows)


def fatigue_table(result: Mapping[str, Fatigue]) -> Table:
    """Return one row for each spring: its stress range against the Goodman-Smith line."""
    return Table(FATIGUE, [{"spring": name, **asdict(one)} for name, one in result.items()])


def ride_height_table(results: Sequence[RideHeight]) -> Table:
    """Return one row for each load: scatter of the ride height."""
    return Table(RIDE_HEIGHT, [vars(result) for result in results])


def search_table(result: "SearchResult") -> Table:
    """Return one row for each nest, the best first; the last column are the active limits."""
    rows = []
    for rank, nest in enumerate(result.nests, start=1):
        springs = {
            name: f"{spring.wire_diameter * 1e3:.6g} x {spring.mean_diameter * 1e3:.6g}, "
            f"{spring.active_coils:.6g}"
            for name, spring in (("outer", nest.outer), ("inner", nest.inner))
        }
        heights = "/".join(f"{s.free_height * 1e3:.6g}" for s in (nest.outer, nest.inner))
        active = ", ".join(nest.active) or "none"
        rows.append({**vars(nest), **springs, "rank": rank, "heights": heights, "active": active})
        if not np.isfinite(nest.fatigue_margin):  # no table [fatigue]
            rows[-1]["fatigue_margin"] = None
    return Table(SEARCH, rows)
