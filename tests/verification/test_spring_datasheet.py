"""Data sheets of springs: natural frequency, mass, stresses, lateral stiffness by methods."""

import numpy as np
import pytest

from railsim.definitions.loading import load_spring
from railsim.springs import checks, helical
from railsim.springs.datasheet import LATERAL, data_sheets
from railsim.springs.summary import verification_data
from railsim.springs.verification import fatigue, verify


@pytest.fixture(scope="module")
def suspension():
    return load_spring("turasas_axlebox")


@pytest.fixture(scope="module")
def sheets(suspension):
    return data_sheets(suspension, verify(suspension))


def en_13906_lateral(K_V, D, H0, dz, ratio):
    """R_Q = R eta as EN 13906-1:2013 prints it, xi = s/L0, lambda = L0/D, ratio = G/E."""
    xi, slender = dz / H0, H0 / D
    inner = (0.5 + ratio) * (ratio + (1.0 - xi) / xi)
    tangent = np.tan(slender * xi * np.sqrt(inner))
    return K_V * xi / (xi - 1.0 + np.sqrt(inner) / (slender * (0.5 + ratio)) * tangent)


def test_lateral_stiffness_of_the_beam_is_that_of_en_13906(suspension):
    ratio = suspension.material.G / suspension.material.E
    nu = 0.5 / ratio - 1.0
    for D, dz in ((0.230, 0.0735), (0.142, 0.0735), (0.230, 0.0200), (0.180, 0.0900)):
        found = helical.beam_stiffnesses(6e5, D, 0.338, dz, nu)[0]
        assert found == pytest.approx(en_13906_lateral(6e5, D, 0.338, dz, ratio), rel=1e-9)


def test_wahl_s_printed_constants_are_those_of_the_unloaded_beam():
    # K = d^4/(n D (0.204 h^2 + 0.265 D^2)) 10^6 psi for steel of E = 30e6, G = 11.5e6 psi: the
    # constants have three digits
    E, G, d, D, n, h = 30e6, 11.5e6, 0.5, 3.0, 6.0, 8.0
    K_V, nu = G * d**4 / (8.0 * n * D**3), E / (2.0 * G) - 1.0
    printed = 1e6 * d**4 / (n * D * (0.204 * h**2 + 0.265 * D**2))
    found = helical.lateral_stiffness_wahl(K_V, D, h, 0.0, nu)
    assert found == pytest.approx(printed, rel=5e-3)


def test_without_load_wahl_and_the_beam_agree_and_load_only_lowers_the_stiffness():
    nu, D, H0 = 0.3, 0.2, 0.8
    unloaded = float(helical.lateral_stiffness_wahl(1e5, D, H0, 0.0, nu))
    assert unloaded == pytest.approx(
        float(helical.beam_stiffnesses(1e5, D, H0, 1e-9, nu)[0]), rel=1e-6
    )
    for dz in (0.01, 0.05, 0.1):
        left = helical.beam_stiffnesses(1e5, D, H0, dz, nu)[0]
        assert left < helical.lateral_stiffness_wahl(1e5, D, H0, dz, nu)


def test_surge_frequency_is_that_of_a_rod_of_the_same_stiffness_and_mass(suspension, sheets):
    for name, spring in suspension.springs.items():
        d, D, n = spring.wire_diameter, spring.mean_diameter, spring.active_coils
        sheet = sheets[name].values
        active = sheet["mass"] * n / sheet["n_total"]
        assert sheet["surge_frequency"] == pytest.approx(0.5 * np.sqrt(sheet["K_V"] / active))
        # the standard's rounded constant, in mm, N/mm2 and kg/dm3
        G, density = suspension.material.G * 1e-6, suspension.material.density * 1e-3
        printed = 3560.0 * d * 1e3 / (n * (D * 1e3) ** 2) * np.sqrt(G / density)
        assert sheet["surge_frequency"] == pytest.approx(printed, rel=1e-3)


def test_stresses_of_the_load_cases_are_those_of_the_fatigue_check(suspension):
    loads = {"max_load": 1.2 * 59865.525, "min_load": 0.65 * 59865.525}
    changed = [f"loads.{name}={load}" for name, load in loads.items()]
    more = load_spring("turasas_axlebox", changed)
    sheets = data_sheets(more, verify(more))
    for name, found in fatigue(suspension).items():
        assert sheets[name].loads["max_load"].tau_k == pytest.approx(found.tau_max)
        assert sheets[name].loads["min_load"].tau_k == pytest.approx(found.tau_min)
        state = sheets[name].loads["max_load"]
        d, D = more.springs[name].wire_diameter, more.springs[name].mean_diameter
        assert state.tau == pytest.approx(8.0 * D * state.force / (np.pi * d**3))
        # the correction of the curvature alone, without lateral load
        factor = checks.curvature_factor(D / d)
        assert state.tau_k > factor * state.tau


def test_json_has_the_data_sheets(suspension):
    data = verification_data(suspension, verify(suspension))["springs"]["outer"]
    assert data["mass"] == pytest.approx(7850 * 0.25 * np.pi**2 * 0.041**2 * 0.230 * 5.3)
    assert set(data["loads"]["T.I."]["lateral"]) == set(LATERAL)
