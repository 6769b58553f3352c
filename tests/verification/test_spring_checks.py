"""Strength of the springs: EN 13906-1 relations by hand, Goodman-Smith, limits that must hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railsim.definitions.loading import load_spring
from railsim.springs import checks
from railsim.springs.verification import dynamic_loads, fatigue, verify

GOODMAN = [(0.0, 430e6), (390e6, 690e6), (690e6, 690e6)]


@pytest.fixture(scope="module")
def suspension():
    return load_spring("turasas_axlebox")


def test_solid_height_of_the_reference_nest():
    # (3.6 + 0.2 + 1.5 - 0.3) * 41 mm and (6 + 0.2 + 1.5 - 0.3) * 27 mm
    assert checks.solid_height(checks.total_coils(3.6), 0.041) == pytest.approx(0.205, rel=1e-14)
    assert checks.solid_height(checks.total_coils(6.0), 0.027) == pytest.approx(0.1998, rel=1e-14)


def test_smallest_working_height_of_the_reference_nest(suspension):
    # L_c + 0.002 n (D + d): 205 + 0.002 * 3.6 * 271 and 199.8 + 0.002 * 6 * 169 mm
    found = {check.name: check for check in verify(suspension).checks}
    assert found["solid_height_outer"].limit == pytest.approx(0.2069512, rel=1e-12)
    assert found["solid_height_inner"].limit == pytest.approx(0.201828, rel=1e-12)
    assert found["solid_height_outer"].ok
    assert found["solid_height_inner"].ok


def test_stress_of_the_solid_spring_by_hand():
    # 8 * 0.1 m * (1e5 N/m * 0.05 m) / (pi * 0.01^3 m^3) = 4000 / (pi 1e-6)
    tau = checks.solid_stress(1e5, 0.01, 0.1, 0.05)
    assert tau == pytest.approx(4000.0 / (np.pi * 1e-6), rel=1e-14)


def test_curvature_factor_of_index_six():
    assert checks.curvature_factor(6.0) == pytest.approx(6.5 / 5.25, rel=1e-15)


def test_stress_without_lateral_load_is_the_corrected_axial_one():
    tau = checks.corrected_stress(0.02, 0.12, 1e4, 0.0, 0.3, 0.0)
    assert tau == pytest.approx(6.5 / 5.25 * 8 * 0.12 * 1e4 / (np.pi * 0.02**3), rel=1e-14)


@given(F_L=st.floats(-1e4, 1e4), lateral=st.floats(-0.02, 0.02))
def test_lateral_load_never_relieves_the_spring(F_L, lateral):
    axial = checks.corrected_stress(0.041, 0.23, 4e4, 0.0, 0.26, 0.0)
    assert checks.corrected_stress(0.041, 0.23, 4e4, F_L, 0.26, lateral) >= axial


@given(tau_min=st.floats(0.0, 690e6))
def test_goodman_limit_lies_between_its_corners(tau_min):
    limit = checks.goodman_limit(GOODMAN, tau_min)
    assert 430e6 <= limit <= 690e6
    assert limit >= tau_min


def test_goodman_limit_at_its_corners():
    assert checks.goodman_limit(GOODMAN, [0.0, 390e6, 690e6]) == pytest.approx(
        [430e6, 690e6, 690e6]
    )


def test_margin_is_allowable_over_actual_stress(suspension):
    for spring in fatigue(suspension).values():
        assert spring.limit == pytest.approx(
            float(checks.goodman_limit(GOODMAN, spring.tau_min)), rel=1e-14
        )
        assert spring.margin == pytest.approx(spring.limit / spring.tau_max, rel=1e-14)
        assert spring.tau_min < spring.tau_max


def test_dynamic_loads_default_to_the_reference_s_shares_of_tare(suspension):
    given = dynamic_loads(suspension)
    table = suspension.fatigue.model_dump(exclude={"max_load", "min_load"})
    by_tare = dynamic_loads(suspension.replace(fatigue=table))
    # the file's numbers are ODM + 20 % and - 35 %, written with all digits
    assert by_tare == pytest.approx(given, rel=1e-12)


def test_allowable_stress_is_straight_between_rows_and_held_beyond():
    rows = [(0.02, 800e6), (0.04, 700e6)]
    found = checks.allowable_stress(rows, [0.01, 0.02, 0.03, 0.04, 0.05])
    assert found == pytest.approx([800e6, 800e6, 750e6, 700e6, 700e6])


def test_one_allowable_stress_serves_every_wire(suspension):
    one = load_spring("turasas_axlebox", ["material.tau_allowable=740e6"])
    found = {check.name: check for check in verify(one).checks}
    assert found["yield_outer"].limit == found["yield_inner"].limit == 740e6
    assert found["yield_outer"].ok
    assert not found["yield_inner"].ok  # 770 MPa: a check not met is a result


def test_mass_of_a_spring_is_that_of_its_bar():
    # bar of 2 pi * 0.2 m * 5 coils, section pi/4 * 0.02^2
    assert checks.mass(0.02, 0.2, 5.0, 7850.0) == pytest.approx(
        7850.0 * np.pi / 4 * 0.02**2 * np.pi * 0.2 * 5.0, rel=1e-14
    )
