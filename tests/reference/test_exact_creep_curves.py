"""Own half-space solver against CONTACT: creep curves and creepage coefficients."""

import csv

import numpy as np
import pytest
from creep_curves import DATA, creep_curves
from selection import points

from railsim.contact.creep_table import linear_coefficients
from railsim.contact.exact_creep import exact_creep_force

# One point of each kind, the worst ones of each ratio among them.
POINTS = (
    "lat_spin_opp_ab0.3_10", "mixed_ab1_08", "spin_ab3_12", "lat_sweep_spin1_ab1_04",
    "long_spin_ab0.3_12", "long_lat_ab1_06", "lat_ab3_06", "lat_spin_opp_ab3_12",
)  # fmt: skip


@pytest.fixture(scope="module")
def curves():
    return creep_curves()


def worst_errors(curves, chosen, **grid):
    forces, moments = [], []
    for i in chosen:
        case = [float(values[i]) for values in curves.inputs()]
        found = exact_creep_force(*case, G=curves.G, nu=curves.nu, **grid)
        bound = curves.mu[i] * curves.N[i]
        fx, fy, mz = curves.result("contact_ext")[:, i]
        forces.append(np.hypot(found.T_x / bound - fx, found.T_y / bound - fy))
        moments.append(abs(found.M_z / (bound * np.sqrt(curves.a[i] * curves.b[i])) - mz))
    return max(forces), max(moments)


@points("name", POINTS, always=(0, 1, 2))
def test_chosen_points_within_a_hundredth(curves, name):
    force, moment = worst_errors(curves, np.flatnonzero(curves.case == name))
    # the demand; grid error at 28 x 28 is up to 0.007, that of the reference 0.003
    assert force < 0.01
    assert moment < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("n", [20, 30, 36])
@pytest.mark.further
def test_hardest_point_on_other_grids(curves, n):
    # most cells change sides several times before they settle: the iteration must wait for them
    chosen = np.flatnonzero(curves.case == "lat_spin_opp_ab3_12")
    force, moment = worst_errors(curves, chosen, nx=n, ny=n)
    assert force < 0.01
    assert moment < 0.01


@pytest.mark.slow
@pytest.mark.further
def test_every_point_within_a_hundredth(curves):
    force, moment = worst_errors(curves, range(curves.case.size))
    assert force < 0.01
    assert moment < 0.01


@points("ratio", [0.1, 1.0, 5.0, 0.3, 2.0], always=(0, 1, 2))
def test_small_creepage_gives_the_recomputed_coefficients(ratio):
    with open(DATA / "kalker_coefficients_computed.csv", newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["nu"] == "0.28"]
    (row,) = (row for row in rows if float(row["a_over_b"]) == ratio)
    c11, c22, c23, c33 = linear_coefficients(ratio)
    # CONTACT's own C23 and -C32, which should be one number, differ by 0.3 %
    assert c11 == pytest.approx(float(row["C11"]), rel=0.005)
    assert c22 == pytest.approx(float(row["C22"]), rel=0.007)
    assert c23 == pytest.approx(float(row["C23"]), rel=0.008)
    if row["C33_reliable"] == "yes":
        assert c33 == pytest.approx(float(row["C33"]), rel=0.005)
