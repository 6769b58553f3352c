"""The helical spring against EN 13906-1 relations, beam theory and its own textbook form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from railsim.errors import ModelError
from railsim.springs import helical

NU = 0.3125
SPRINGS = [(632875.4, 0.230, 0.338), (303464.5, 0.142, 0.338), (1e5, 0.090, 0.500)]

diameters = st.floats(0.05, 0.4)
heights = st.floats(0.1, 0.9)
stiffnesses = st.floats(1e4, 1e7)
fractions = st.floats(0.0, 0.7)


def textbook(K_V, D, H0, dz, nu):
    """Krettek-Sobczak as printed: divides 0 by 0 without load."""
    F, Hs = K_V * dz, H0 - dz
    B = (1 + nu) * D**2 * K_V * Hs / (4 + 2 * nu)
    S = 2 * (1 + nu) * K_V * Hs
    k = np.sqrt(F / B * (1 + F / S))
    C_q = F / (2 / k * (1 + F / S) * np.tan(k * Hs / 2) - Hs)
    return C_q, C_q * B / F * (1 + F / S - k * Hs / np.tan(k * Hs))


@pytest.mark.parametrize("spring", SPRINGS)
@pytest.mark.parametrize("fraction", [0.05, 0.2, 0.4])
def test_smooth_form_equals_printed_form_under_load(spring, fraction):
    K_V, D, H0 = spring
    C_q, C_r = textbook(K_V, D, H0, fraction * H0, NU)
    # the printed form cancels about four digits at these loads
    assert helical.beam_stiffnesses(K_V, D, H0, fraction * H0, NU)[0] == pytest.approx(C_q, 1e-11)
    assert helical.beam_stiffnesses(K_V, D, H0, fraction * H0, NU)[1] == pytest.approx(C_r, 1e-11)


@pytest.mark.parametrize("spring", SPRINGS)
@pytest.mark.parametrize("fraction", [0.05, 0.2, 0.4])
def test_stiffnesses_are_those_of_the_differential_equations_of_a_column(spring, fraction):
    """Haringx (1948): y' = psi + (H + F psi)/S, B psi' = M, M' = -H - F y', clamped at one end."""
    K_V, D, H0 = spring
    F, Hs = K_V * fraction * H0, (1.0 - fraction) * H0
    B = (1.0 + NU) * D**2 * K_V * Hs / (4.0 + 2.0 * NU)
    S = 2.0 * (1.0 + NU) * K_V * Hs
    slope = np.array([0.0, 1.0 + F / S, 0.0, 1.0 / S])
    bend = np.array([0.0, 0.0, 1.0 / B, 0.0])
    over = expm(Hs * np.array([slope, bend, -F * slope - [0.0, 0.0, 0.0, 1.0], np.zeros(4)]))
    # M at the clamped end and H that displace the other end, that tilt it
    displaced, tilted = np.linalg.inv(over[:2, 2:]).T
    C_q, C_r = helical.beam_stiffnesses(K_V, D, H0, fraction * H0, NU)
    assert C_q == pytest.approx(displaced[1], rel=1e-9)
    assert C_r == pytest.approx(over[2, 2:] @ tilted, rel=1e-9)
    # the moment that a displaced seat needs, and by reciprocity the force that a tilted one needs
    assert over[2, 2:] @ displaced == pytest.approx(-0.5 * (F + C_q * Hs), rel=1e-9)
    assert tilted[1] == pytest.approx(-0.5 * (F + C_q * Hs), rel=1e-9)


@given(K_V=stiffnesses, D=diameters, H0=heights, load=st.floats(0.0, 1e-9))
def test_without_load_the_spring_is_a_shear_beam(K_V, D, H0, load):
    B, S = helical.beam_rigidities(K_V, D, H0, NU)
    shear_beam = 1.0 / (H0 / S + H0**3 / (12.0 * B))
    p = 12.0 * B / (S * H0**2)
    clamped = B / H0 * (4.0 + p) / (1.0 + p)
    # first-order change with load: relative order dz/H0 * (H0/D)^2 < 1e-9 * 400
    assert helical.beam_stiffnesses(K_V, D, H0, load * H0, NU)[0] == pytest.approx(
        shear_beam, rel=1e-6
    )
    assert helical.beam_stiffnesses(K_V, D, H0, load * H0, NU)[1] == pytest.approx(
        clamped, rel=1e-6
    )


@pytest.mark.parametrize("y", [5e-3, 1.25e-3])
@given(K_V=stiffnesses, D=diameters, H0=heights)
def test_series_and_closed_form_meet_without_a_step(y, K_V, D, H0):
    # deflections just below and above the switches, where y = (k_h Hs / 2)^2 or 4 y is 5e-3
    factor = (4 + 2 * NU) / (4 * (1 + NU)) / D**2
    roots = np.roots([factor * (0.5 / (1 + NU) - 1.0), factor * H0, -y])
    dz = min(root.real for root in roots if root.real > 0)
    below, above = dz * (1 - 1e-9), dz * (1 + 1e-9)
    for a, b in helical.beam_stiffnesses(K_V, D, H0, np.array([below, above]), NU):
        # 2e-9 of travel, and 1e-13 of cut and cancelled digits
        assert abs(b / a - 1.0) < 1e-8


@given(H0=heights, slenderness=st.floats(2.7, 8.0))
def test_lateral_stiffness_vanishes_where_en_13906_buckles(H0, slenderness):
    D = H0 / slenderness
    s_k = float(helical.buckling_deflection(H0, D, NU))
    assert np.isfinite(s_k)
    before, after = helical.beam_stiffnesses(1e5, D, H0, s_k * np.array([1 - 1e-6, 1 + 1e-6]), NU)[
        0
    ]
    assert before > 0.0 > after
    unloaded = helical.beam_stiffnesses(1e5, D, H0, 0.0, NU)[0]
    at_buckling = helical.beam_stiffnesses(1e5, D, H0, s_k, NU)[0]
    assert abs(at_buckling) < 1e-9 * unloaded


@given(H0=heights, slenderness=st.floats(0.5, 2.6))
def test_squat_spring_never_buckles(H0, slenderness):
    D = H0 / slenderness
    assert helical.buckling_deflection(H0, D, NU) == np.inf
    dz = np.linspace(0.0, 0.99, 50) * H0
    assert np.all(helical.beam_stiffnesses(1e5, D, H0, dz, NU)[0] > 0.0)


@given(K_V=stiffnesses, D=diameters, H0=heights, fraction=fractions, scale=st.floats(0.1, 10.0))
def test_stiffnesses_scale_with_size_and_modulus(K_V, D, H0, fraction, scale):
    dz = fraction * H0
    lateral = helical.lateral_stiffness(K_V, D, H0, dz, NU)
    tilting = helical.lateral_and_tilting(K_V, D, H0, dz, NU)[1]
    # stiffer material: both in proportion; larger spring of the same K_V: K_L same, K_C squared.
    # rel: the closed forms amplify round-off near buckling, where K_L crosses zero
    tolerance = 1e-9 * K_V
    assert helical.lateral_stiffness(scale * K_V, D, H0, dz, NU) == pytest.approx(
        scale * lateral, rel=1e-9, abs=tolerance
    )
    assert helical.lateral_stiffness(K_V, scale * D, scale * H0, scale * dz, NU) == pytest.approx(
        lateral, rel=1e-6, abs=1e-6 * K_V
    )
    _, scaled = helical.lateral_and_tilting(K_V, scale * D, scale * H0, scale * dz, NU)
    assert scaled == pytest.approx(scale**2 * tilting, rel=1e-6)


def test_number_of_coils_inverts_vertical_stiffness():
    K_V = helical.vertical_stiffness(78.48e9, 0.041, 0.230, 3.6)
    assert helical.active_coils(78.48e9, 0.041, 0.230, K_V) == pytest.approx(3.6, rel=1e-14)


def test_arrays_give_what_floats_give():
    dz = np.array([0.0, 1e-4, 0.05, 0.1])
    together = helical.lateral_stiffness(632875.4, 0.230, 0.338, dz, NU)
    one_by_one = [helical.lateral_stiffness(632875.4, 0.230, 0.338, value, NU) for value in dz]
    assert np.array_equal(together, one_by_one)


@pytest.mark.parametrize("dz", [-1e-3, 0.338, 0.5])
def test_deflection_outside_the_spring_is_refused(dz):
    with pytest.raises(ModelError, match="free height"):
        helical.lateral_stiffness(632875.4, 0.230, 0.338, dz, NU)
