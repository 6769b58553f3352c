"""Equivalent conicity against the examples of EN 15302, annex E."""

import csv

import numpy as np
from selection import points

from railsim.contact import equivalent_conicity


def columns(path):
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {
        name: np.array([float(row[name]) if row[name] else np.nan for row in rows])
        for name in rows[0]
    }


@points("case", range(1, 10), always=(0, 4, 8))
def test_annex_e_case_is_within_the_standards_tolerance(reference_dir, case):
    folder = reference_dir / "contact" / "en15302_annexE"
    function = columns(folder / f"delta_r_E{case}.csv")
    expected = columns(folder / f"conicity_E{case}.csv")
    found = equivalent_conicity(
        1e-3 * function["y_mm"], 1e-3 * function["delta_r_mm"], 1e-3 * expected["amplitude_mm"]
    )
    covered = np.isfinite(found)
    # all amplitudes that a second, independent integration could reach
    second = expected["recomputed_by_klingel_integration"]
    assert np.all(covered[np.isfinite(second)])
    assert np.all(found[covered] <= expected["tol_upper"][covered])
    assert np.all(found[covered] >= expected["tol_lower"][covered])
    # the standard prints three digits; E5 was made with another reading of its measured profile
    largest = np.abs(found - expected["tan_gamma_e_ref"])[covered].max()
    assert largest < (0.0065 if case == 5 else 0.0008)
    # the integration stored beside the standard's values has steps, ours is exact by pieces
    both = covered & np.isfinite(second)
    assert np.abs(found - second)[both].max() < 5e-6
