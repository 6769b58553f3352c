"""Half-space solver of rolling contact: laws that its solution must obey."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from railsim.contact.creep_table import full_sliding
from railsim.contact.exact_creep import exact_creep_force, rolling_grid
from railsim.errors import ModelError
from railsim.kernels.halfspace import cell_influence

A, B, N, MU, G, NU = 5e-3, 3e-3, 70e3, 0.35, 82e9, 0.28
GRID = {"nx": 16, "ny": 16}
MIXED = (0.0012, -0.0008, 0.35)


@pytest.fixture(scope="module")
def mixed():
    return exact_creep_force(A, B, N, MU, *MIXED, **GRID)


def test_influence_is_the_integral_of_the_point_force():
    x, y, half_x, half_y = 1.3, -0.4, 0.5, 0.8

    def integral(kernel):
        value, _ = dblquad(
            lambda v, u: kernel(x - u, y - v), -half_x, half_x, -half_y, half_y, epsrel=1e-10
        )
        return value / np.pi

    def r(u, v):
        return np.hypot(u, v)

    found = cell_influence(x, y, half_x, half_y, NU)
    expected = (
        integral(lambda u, v: (1 - NU) / r(u, v) + NU * u * u / r(u, v) ** 3),
        integral(lambda u, v: NU * u * v / r(u, v) ** 3),
        integral(lambda u, v: (1 - NU) / r(u, v) + NU * v * v / r(u, v) ** 3),
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_coulombs_law_holds_everywhere(mixed):
    size = np.hypot(mixed.t_x, mixed.t_y)
    assert (size <= mixed.bound * (1 + 1e-12)).all()
    slides = ~mixed.sticks
    assert slides.any()
    assert mixed.sticks.any()
    np.testing.assert_allclose(size[slides], mixed.bound[slides], rtol=1e-12)
    # traction along the slip: Newton ends when no traction turns by more than 1e-6
    speed = np.hypot(mixed.s_x, mixed.s_y)[slides]
    cross = (mixed.t_x * mixed.s_y - mixed.t_y * mixed.s_x)[slides] / size[slides]
    along = (mixed.t_x * mixed.s_x + mixed.t_y * mixed.s_y)[slides]
    assert (along > 0.0).all()
    assert np.abs(cross).max() < 1e-5 * speed.max()
    assert (mixed.s_x[mixed.sticks] == 0.0).all()


def test_stick_zone_touches_the_leading_edge(mixed):
    # cell 0 of a strip is at the leading edge: where a strip sticks at all, it does so there
    # or next to it
    strips = mixed.sticks[mixed.sticks.any(axis=1)]
    assert (strips.argmax(axis=1) <= 1).all()


def test_bound_sums_up_to_friction_times_load(mixed):
    assert np.sum(mixed.bound * mixed.area) == pytest.approx(MU * N, rel=1e-12)
    assert np.sum(mixed.area) == pytest.approx(np.pi * A * B, rel=1e-12)


def test_dissipation_tends_to_the_power_of_the_creepages():
    # the elastic slip of a steady state does no work over the patch: local power sums up to force
    # times creepage, in the limit of small cells
    missing = []
    for n in (8, 16):
        found = exact_creep_force(A, B, N, MU, *MIXED, nx=n, ny=n)
        local = np.sum(found.area * (found.t_x * found.s_x + found.t_y * found.s_y))
        total = found.T_x * MIXED[0] + found.T_y * MIXED[1] + found.M_z * MIXED[2]
        missing.append(abs(1.0 - local / total))
    assert missing[1] < 0.16
    assert missing[1] < 0.45 * missing[0]  # order above 1.15


def test_mirror_image_and_reversal(mixed):
    image = exact_creep_force(A, B, N, MU, MIXED[0], -MIXED[1], -MIXED[2], **GRID)
    back = exact_creep_force(A, B, N, MU, *(-xi for xi in MIXED), **GRID)
    expected = np.array([mixed.T_x, mixed.T_y, mixed.M_z])
    # Newton's tolerance of 1e-6 rad
    found = [image.T_x, -image.T_y, -image.M_z]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    np.testing.assert_allclose([-back.T_x, -back.T_y, -back.M_z], expected, rtol=1e-6)


def test_large_creepage_is_full_sliding():
    found = exact_creep_force(A, B, N, MU, 0.3, 0.4, 120.0, **GRID)
    size = np.sqrt(A * B)
    expected = full_sliding(A / B, np.array([0.3, 0.4, 120.0 * size]))
    unit = np.array([MU * N, MU * N, MU * N * size])
    # what is left of elasticity, 1 % of the rigid slip, and the grid
    np.testing.assert_allclose(
        np.array([found.T_x, found.T_y, found.M_z]) / unit, expected, atol=0.01
    )


def test_error_falls_at_least_with_the_cell():
    results = [
        np.array(exact_creep_force(A, B, N, MU, *MIXED, nx=n, ny=n)[:3]) for n in (6, 12, 24)
    ]
    coarse = np.linalg.norm(results[1][:2] - results[0][:2])
    fine = np.linalg.norm(results[2][:2] - results[1][:2])
    assert fine < 0.55 * coarse


def test_grid_fits_the_ellipse():
    grid = rolling_grid(2.0, NU, 6, 10)
    edge = grid.x[:, 0] + grid.half_x[:, 0]
    reach = np.sqrt(2.0) * np.sqrt(1.0 - 2.0 * grid.y[:, 0] ** 2)
    # strips carry the mean length: longer than at their middle by at most 1/ny there
    assert np.abs(edge - reach).max() < 0.12


@pytest.mark.parametrize(
    "case", [{"a": 0.0}, {"N": -1.0}, {"mu": 0.0}, {"xi_x": np.inf}, {"G": np.nan}]
)
def test_impossible_inputs_are_refused(case):
    values = {"a": A, "b": B, "N": N, "mu": MU, "xi_x": 0.0, "xi_y": 0.0, "phi": 0.0} | case
    with pytest.raises(ModelError):
        exact_creep_force(**values)
