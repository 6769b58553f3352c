"""FASTSIM kernel: limits that follow from theory, and its two marches against each other."""

import numpy as np
import pytest

from railsim.contact.creep import creep_force
from railsim.contact.kalker import kalker_coefficients
from railsim.errors import InputError, ModelError
from railsim.kernels import fastsim as kernel
from railsim.kernels import fastsim_simd

A, B, N, MU, G = 5e-3, 3e-3, 70e3, 0.35, 82e9
SMALL = 1e-9  # creepage: traction is 1e-6 of the bound, all cells but the outermost stick


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0, 3.0, 10.0])
def test_small_creepage_gives_linear_theory(ratio):
    a, b = 4e-3 * np.sqrt(ratio), 4e-3 / np.sqrt(ratio)
    c11, c22, c23, _ = kalker_coefficients(ratio, 0.28)
    n = 200
    x = creep_force(a, b, N, MU, SMALL, 0.0, 0.0, nx=n, ny=n)
    y = creep_force(a, b, N, MU, 0.0, SMALL, 0.0, nx=n, ny=n)
    s = creep_force(a, b, N, MU, 0.0, 0.0, SMALL / np.sqrt(a * b), nx=n, ny=n)
    # midpoint sums over the strips: error about 0.3/n^1.5 in the area of the ellipse
    assert x.T_x == pytest.approx(G * a * b * c11 * SMALL, rel=2e-4)
    assert y.T_y == pytest.approx(G * a * b * c22 * SMALL, rel=2e-4)
    assert s.T_y == pytest.approx(G * a * b * c23 * SMALL, rel=2e-4)
    assert x.T_y == 0.0
    # simplified theory: traction linear in x gives M_z = -(3 pi/32) a T_y ... for lateral creepage
    assert y.M_z == pytest.approx(-y.T_y * a * 3.0 * np.pi / 32.0, rel=2e-3)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, -1.0)])
def test_force_saturates_at_mu_n_along_the_creepage(direction):
    force = creep_force(A, B, N, MU, 0.5 * direction[0], 0.5 * direction[1], 0.0, nx=50, ny=50)
    # quadrature of the bound over the cells: below 0.1 % at 50 x 50
    assert force.T_x == pytest.approx(direction[0] * MU * N, rel=2e-3)
    assert force.T_y == pytest.approx(direction[1] * MU * N, rel=2e-3)


@pytest.mark.parametrize("creepage", [1e3, 1e150, 1e300])
def test_huge_creepage_is_full_sliding(creepage):
    force = creep_force(A, B, N, MU, creepage, 0.0, 0.0, nx=50, ny=50)
    assert force.T_x == pytest.approx(MU * N, rel=2e-3)
    spin = creep_force(A, B, N, MU, 0.0, 0.0, creepage, nx=50, ny=50)
    assert np.isfinite(spin).all()
    # slip turns about the centre: no net force but from the half cell between slip and traction
    assert abs(spin.T_y) < 2.0 / 50 * MU * N


@pytest.mark.parametrize(
    "case", [{"mu": 0.0}, {"N": 0.0}, {"N": 0.0, "a": 0.0, "b": 0.0}, {"xi_x": 0.0, "phi": 0.0}]
)
def test_no_friction_no_load_or_no_creepage_gives_zero(case):
    values = {"a": A, "b": B, "N": N, "mu": MU, "xi_x": 0.01, "xi_y": 0.0, "phi": 1.0} | case
    force = creep_force(**values)
    assert force == (0.0, 0.0, 0.0)


def test_one_patch_does_not_feel_the_others():
    rng = np.random.default_rng(1)
    n = 7
    xi = rng.normal(scale=2e-3, size=(2, n))
    phi = rng.normal(scale=0.4, size=n)
    normal = np.array([0.0, 60e3, 1.0, 90e3, 0.0, 1e3, 30e3])
    together = creep_force(A, B, normal, MU, *xi, phi)
    for i in range(n):
        alone = creep_force(A, B, normal[i], MU, *xi[:, i], phi[i])
        np.testing.assert_allclose([t[i] for t in together], alone, rtol=1e-12, atol=1e-9)


@pytest.mark.skipif(not fastsim_simd.available(), reason="no AVX-512 here")
def test_both_marches_agree():
    rng = np.random.default_rng(2)
    for columns, nx in ((24, 10), (104, 7), (200, 1), (48, 60)):
        plain = kernel.fastsim_workspace(columns, 1, nx)
        plain[:3, :columns] = rng.normal(scale=0.3, size=(3, columns))
        fast = plain.copy()
        bounds = 1.0 - (1.0 - (2.0 * np.arange(nx) + 1.0) / nx) ** 2
        kernel._march_plain(plain, columns, nx, bounds)
        kernel._march_simd(fast, columns, nx, bounds)
        # the estimate of the root is good to 1e-12
        np.testing.assert_allclose(
            fast[3:6, :columns], plain[3:6, :columns], rtol=1e-10, atol=1e-11
        )


def test_unknown_law_and_impossible_inputs_are_refused():
    with pytest.raises(InputError, match="fastsim"):
        creep_force(A, B, N, MU, 0.0, 0.0, 0.0, law="fastsin")
    with pytest.raises(InputError):
        creep_force(A, B, N, MU, 0.0, 0.0, 0.0, nx=0)
    with pytest.raises(ModelError):
        creep_force(A, B, -N, MU, 0.0, 0.0, 0.0)
    with pytest.raises(ModelError):
        creep_force(0.0, B, N, MU, 0.0, 0.0, 0.0)
    with pytest.raises(ModelError):
        creep_force(A, B, N, MU, np.nan, 0.0, 0.0)
