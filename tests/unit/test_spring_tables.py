"""Tables of springs: every quantity in its column and unit, from plain numbers in SI."""

from types import SimpleNamespace as Made

import pytest

from railsim.springs.datasheet import LATERAL
from railsim.springs.tables import (
    case_table,
    design_table,
    fatigue_table,
    input_tables,
    load_table,
    loaded_table,
    ride_height_table,
    search_table,
    sheet_table,
)
from railsim.springs.tolerance import RideHeight
from railsim.springs.verification import Fatigue

OUTER = Made(mean_diameter=0.2, wire_diameter=0.03, active_coils=5.5, free_height=0.4)
INNER = Made(mean_diameter=0.12, wire_diameter=0.02, active_coils=7.25, free_height=0.3)
BOTH = {"outer": OUTER, "inner": INNER}


def suspension(springs, seats, **points):
    return Made(
        springs=springs, seat_heights=seats, engagement=0.095,
        arm=Made(length=0.5, bush_torsional_stiffness=900.0),
        material=Made(G=78.5e9, E=206e9),
        mounting=points.get("mounting"), target=points.get("target"),
        loads={"tare": 30e3, "laden": 60e3}, load_notes={"laden": "full"},
    )  # fmt: skip


def rows(table):
    """Cells by heading, for each row."""
    heads = [column.heading for column in table.columns]
    return [dict(zip(heads, texts, strict=True)) for texts in table.texts()]


def upright(table):
    """Cells of a table with a row for every quantity."""
    return {name: cells for name, *cells in table.texts()}


@pytest.mark.parametrize("nested", [True, False])
def test_input_is_shown_as_the_file_has_it(nested):
    """The outer spring carries from the beginning, the inner one from its engagement on."""
    both = {
        "mean coil diameter D (mm)": ["200", "120"], "wire diameter d (mm)": ["30", "20"],
        "active coils n": ["5.5", "7.25"], "free height H0 (mm)": ["400", "300"],
        "seat above the axle (mm)": ["110", "120"], "works from a deflection of (mm)": ["0", "95"],
    }  # fmt: skip
    point = Made(load=60e3, deflection=0.15)
    springs, arm = input_tables(
        suspension(BOTH, (0.11, 0.12), mounting=Made(load=30e3, deflection=0.1), target=point)
        if nested
        else suspension({"outer": OUTER}, (0.11,), target=point)
    )
    count = 2 if nested else 1
    assert upright(springs) == {name: cells[:count] for name, cells in both.items()}
    mounting = {"mounting load (kN)": ["30"], "deflection under mounting load (mm)": ["100"]}
    assert upright(arm) == {
        "arm length (mm)": ["500"], "bush (N m/rad)": ["900"], "shear modulus (MPa)": ["78500"],
        "Young's modulus (MPa)": ["206000"], **(mounting if nested else {}),
        "target load (kN)": ["60"], "deflection under target load (mm)": ["150"],
    }  # fmt: skip


def test_designs_and_loads_have_a_row_each():
    nest = suspension(BOTH, (0.11, 0.12))
    assert rows(design_table(nest, Made(K_V=[350e3, 120.5e3], n=[5.12345, 7.0]))) == [
        {"spring": "outer", "D (mm)": "200", "K_V (N/mm)": "350.000", "d (mm)": "30",
         "n": "5.1235"},
        {"spring": "inner", "D (mm)": "120", "K_V (N/mm)": "120.500", "d (mm)": "20",
         "n": "7.0000"},
    ]  # fmt: skip
    loads = rows(load_table(nest))
    assert [(row["load case"], row["P (kN)"]) for row in loads] == [
        ("tare", "30.000"), ("laden", "60.000"),
    ]  # fmt: skip
    assert loads[1]["meaning"] == "full"


def test_load_cases_are_shown_in_their_units():
    states = {
        name: Made(height=0.25 + share, force=1e3, K_L=1e5, K_C=2e3, lateral=0.002 + share)
        for name, share in (("outer", 0.0), ("inner", 0.05))
    }
    case = Made(
        name="tare", load=30e3, theta=0.1, rotation=0.017453292519943295, deflection=0.1,
        K_sys=300e3, rate=310e3, K_L=150e3, K_C=2e3, springs=states, lateral=lambda name: 0.0,
    )  # fmt: skip
    assert rows(case_table(Made(cases=[case]))) == [{
        "load case": "tare", "P (kN)": "30.000", "rotation (deg)": "+1.0000", "dz (mm)": "100.000",
        "K_sys (N/mm)": "300.000", "tangent (N/mm)": "310.0", "H outer (mm)": "250.00",
        "H inner (mm)": "300.00", "dx (mm)": "+2.000", "K_L (N/mm)": "150.00",
        "K_C (kN m/rad)": "2.000",
    }]  # fmt: skip


def test_data_sheets_are_shown_in_their_units():
    values = {
        "d": 0.03, "D": 0.2, "D_outer": 0.23, "D_inner": 0.17, "index": 6.667, "n": 5.5,
        "n_total": 7.0, "H0": 0.4, "L_solid": 0.21, "K_V": 350e3, "mass": 24.5,
        "surge_frequency": 55.5, "tau_solid": 900e6,
    }  # fmt: skip
    lateral = dict(zip(LATERAL, (100e3, 101e3, 102e3), strict=True))
    loaded = Made(force=30e3, height=0.3, tau=500e6, tau_k=600e6, lateral=lateral)
    sheets = {"outer": Made(values=values, loads={"tare": loaded})}
    assert upright(sheet_table(sheets)) == {
        "wire diameter d (mm)": ["30.00"], "mean coil diameter D (mm)": ["200.00"],
        "outside diameter (mm)": ["230.00"], "inside diameter (mm)": ["170.00"],
        "spring index D/d": ["6.667"], "active coils n": ["5.500"], "total coils": ["7.000"],
        "free height H0 (mm)": ["400.00"], "solid height (mm)": ["210.00"],
        "vertical stiffness K_V (N/mm)": ["350.000"], "mass (kg)": ["24.50"],
        "surge frequency (Hz)": ["55.5"], "stress at solid height (MPa)": ["900.0"],
    }  # fmt: skip
    assert rows(loaded_table(sheets)) == [{
        "load case": "tare", "spring": "outer", "F (kN)": "30.000", "H (mm)": "300.00",
        "tau (MPa)": "500.0", "tau_k (MPa)": "600.0", "K_L Grossi (N/mm)": "100.00",
        "K_L EN 13906-1 (N/mm)": "101.00", "K_L Wahl, C_l = 1 (N/mm)": "102.00",
    }]  # fmt: skip


def test_fatigue_ride_heights_and_nests_are_shown_in_their_units():
    fatigue = Fatigue(tau_max=600e6, tau_min=300e6, limit=720e6, margin=1.2)
    assert rows(fatigue_table({"outer": fatigue})) == [{
        "spring": "outer", "lower stress (MPa)": "300.0", "upper stress (MPa)": "600.0",
        "allowable upper stress (MPa)": "720.0", "margin": "1.200",
    }]  # fmt: skip
    height = RideHeight("tare", 30e3, -0.004, 0.005, 0.002, {})
    assert rows(ride_height_table([height])) == [{
        "ride height at": "tare", "P (kN)": "30.000", "statistical (RSS), ± (mm)": "2.00",
        "worst case, low (mm)": "-4.00", "worst case, high (mm)": "+5.00",
    }]  # fmt: skip
    how = {"mass": 30.5, "mounting_error": -0.001, "target_error": 0.002}
    nests = [
        Made(outer=OUTER, inner=INNER, active=("clearance", "index"), fatigue_margin=1.5, **how),
        Made(outer=OUTER, inner=INNER, active=(), fatigue_margin=float("inf"), **how),
    ]
    first, second = rows(search_table(Made(nests=nests)))
    assert first == {
        "rank": "1", "outer d x D (mm), n": "30 x 200, 5.5", "inner d x D (mm), n":
        "20 x 120, 7.25", "H0 outer/inner (mm)": "400/300", "mass (kg)": "30.50",
        "fatigue margin": "1.500", "error at mounting (mm)": "-1.00",
        "error at target (mm)": "+2.00", "active limits": "clearance, index",
    }  # fmt: skip
    assert second["rank"] == "2"
    assert (second["fatigue margin"], second["active limits"]) == ("", "none")
