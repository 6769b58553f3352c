"""FASTSIM against converged FASTSIM and against the full theory on 27 creep curves."""

import csv

import numpy as np
import pytest
from creep_curves import DATA, creep_curves

from railsim.contact.creep import creep_force


@pytest.fixture(scope="module")
def curves():
    return creep_curves()


def fastsim(curves, n):
    return creep_force(*curves.inputs(), G=curves.G, nu=curves.nu, nx=n, ny=n)


# Discretisation error with the slip at the middle of each step, as the reference states it
# (0.006 at 100; the issue allows 0.01).
@pytest.mark.parametrize(("n", "limit"), [(10, 0.072), (20, 0.036), (50, 0.0145), (100, 0.0065)])
def test_distance_to_converged_fastsim(curves, n, limit):
    error, error_m = curves.errors(fastsim(curves, n), "fastsim3_continuum")
    assert error.max() < limit
    assert error_m.max() < limit


def test_errors_against_the_full_theory_are_those_listed(curves):
    error, error_m = curves.errors(fastsim(curves, 100), "contact_ext")
    with open(DATA / "creep_curve_errors_dev.csv", newline="") as stream:
        listed = list(csv.DictReader(stream))
    for row in listed:
        chosen = (curves.curve == row["curve"]) & (curves.ratio == float(row["a_over_b"]))
        # 0.0065: our grid error at 100 x 100 against the continuum that the list was made with
        assert error[chosen].max() == pytest.approx(
            float(row["fastsim3_continuum_maxerr_f"]), abs=0.0065
        )
        assert error_m[chosen].max() == pytest.approx(
            float(row["fastsim3_continuum_maxerr_mz"]), abs=0.0065
        )


def test_grid_error_falls_in_proportion_to_the_cell(curves):
    errors = [
        np.sqrt((curves.errors(fastsim(curves, n), "fastsim3_continuum")[0] ** 2).mean())
        for n in (10, 20, 40, 80)
    ]
    order = -np.polyfit(np.log([10, 20, 40, 80]), np.log(errors), 1)[0]
    assert 0.9 < order < 1.5  # first order at the stick-slip border, better in full slip
