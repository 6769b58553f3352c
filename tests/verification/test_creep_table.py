"""Table of the full theory: interpolation, limits, smoothness, the solver behind it."""

from concurrent.futures import ThreadPoolExecutor
from importlib import import_module

import numpy as np
import pytest

from railsim.contact.creep import creep_force
from railsim.contact.creep_table import (
    POISSON,
    CreepNodes,
    build_nodes,
    creep_table,
    direction,
    full_sliding,
    gather_nodes,
    linear_coefficients,
    node_ratios,
    node_row,
    shipped_nodes,
    spin_scale,
    table_of_nodes,
    write_nodes,
)
from railsim.contact.exact_creep import exact_creep_force, rolling_grid
from railsim.contact.kalker import kalker_coefficients
from railsim.kernels import creep_table as kernel
from railsim.kernels.creep_table import N_PSI, N_RATIO, N_T, N_THETA, T_HALF
from railsim.kernels.fastsim import fastsim_workspace
from railsim.kernels.patches import CreepScratch, Patches

SIZE, N, MU, G = 5e-3, 70e3, 0.35, 82e9
MODULE = "railsim.contact.creep_table"
SCRATCH = CreepScratch(fastsim_workspace(1, 1, 1), np.zeros(16, dtype=np.int64))


def q_per_creepage(ratio):
    """Factors of (xi_x, xi_y, phi sqrt(ab)) in q for mu N = G = ab = 1."""
    c11, c22, _, _ = linear_coefficients(ratio)
    return np.array([c11, c22, float(spin_scale(np.array(ratio), np.array(c11), np.array(c22)))])


def table_force(ratio, q):
    """Forces over mu N of scaled creepages, shape (n, 3), for one node ratio."""
    xi = np.atleast_2d(q) / q_per_creepage(ratio)
    unit = MU * N / (G * SIZE**2)
    force = creep_force(
        SIZE * np.sqrt(ratio), SIZE / np.sqrt(ratio), N, MU, unit * xi[:, 0], unit * xi[:, 1],
        unit * xi[:, 2] / SIZE, G=G, nu=POISSON, law="table",
    )  # fmt: skip
    bound = MU * N
    return np.stack([force.T_x / bound, force.T_y / bound, force.M_z / bound / SIZE], axis=1)


def smooth(log_ratio, e, t):
    """A smooth force over t with the symmetries of the problem; e: unit vectors, last axis."""
    x, y, s = np.moveaxis(e, -1, 0)
    return np.stack(
        [
            x / (1 + t) * (1 + 0.3 * log_ratio) * (1 + y * s),
            (y + 0.3 * s * t) / (1 + t * x * x) * (1 + 0.2 * log_ratio**2),
            (s - 0.5 * y) * np.exp(-t * log_ratio),
        ],
        axis=-1,
    )


def test_splines_reproduce_a_smooth_force():
    theta = np.linspace(0.0, np.pi / 2, N_THETA + 1)[:, None, None]
    psi = (np.arange(N_PSI) * np.pi / N_PSI)[None, :, None]
    t = np.linspace(0.0, 1.0, N_T + 1)[None, None, :]
    log_ratio = np.linspace(-1.0, 1.0, N_RATIO + 1)[:, None, None, None]
    nodes = smooth(log_ratio, direction(theta, psi)[None], t[None])
    table = table_of_nodes(CreepNodes(nodes, np.ones((N_RATIO + 1, 4))))
    rng = np.random.default_rng(0)
    n = 300
    log_ratio = rng.uniform(-1.0, 1.0, n)
    ratio = np.exp(log_ratio * np.log(20.0))
    e = rng.normal(size=(n, 3))
    e /= np.linalg.norm(e, axis=1)[:, None]
    t = rng.uniform(0.0, 1.0, n)
    q = e * (T_HALF * t / (1.0 - t))[:, None]
    q[:, 2] /= spin_scale(ratio, np.ones(n), np.ones(n))
    patches = Patches(
        np.sqrt(ratio), 1.0 / np.sqrt(ratio), np.ones(n), *np.zeros((4, n)),
        *(np.ascontiguousarray(q[:, k]) for k in range(3)), *np.ones((4, n)),
    )  # fmt: skip
    kernel.table_forces(n, patches, 1.0, *table, SCRATCH)
    assert not patches.outside.any()
    out = np.stack((patches.T_x, patches.T_y, patches.M_z))
    # fourth order of the nodes' distance, 9 degrees and 1/20
    np.testing.assert_allclose(out.T, smooth(log_ratio, e, t) * t[:, None], atol=2e-4)


def test_both_sums_of_rows_agree():
    rng = np.random.default_rng(1)
    table = rng.normal(size=5000).astype(np.float32)
    weights = rng.normal(size=20)
    strides = (1100, 320, 92)
    sums = np.zeros((2, 16))
    kernel._sum_rows_plain(table, 37, strides, weights, 5, sums[0])

    from railsim.kernels import compiled

    @compiled
    def compiled(table, start, strides, weights, first, sums):
        kernel._sum_rows(table, start, strides, weights, first, sums)

    compiled(table, 37, strides, weights, 5, sums[1])
    np.testing.assert_allclose(sums[1], sums[0], rtol=1e-12, atol=1e-12)


def test_many_patches_at_once_are_each_one_by_itself():
    rng = np.random.default_rng(4)
    n = 37  # more than two blocks
    a, b = rng.uniform(2e-3, 9e-3, (2, n))
    xi = rng.normal(size=(3, n)) * np.array([[2e-3], [2e-3], [0.5]])
    together = creep_force(a, b, N, MU, *xi, law="table")
    for i in range(n):
        alone = creep_force(a[i], b[i], N, MU, *xi[:, i], law="table")
        assert [t[i] for t in together] == [float(t) for t in alone]


@pytest.mark.parametrize(("i_ratio", "i_theta"), [(7, 0)])
def test_shipped_nodes_are_what_the_generator_makes(monkeypatch, i_ratio, i_theta):
    monkeypatch.setattr(f"{MODULE}.N_T", 2)  # nothing, half of the way and full sliding
    row, failures = node_row(float(node_ratios()[i_ratio]), i_theta)
    assert failures == 0
    # stored with five digits
    shipped = shipped_nodes().force[i_ratio, i_theta, :, :: N_T // 2]
    np.testing.assert_allclose(shipped, row, atol=6e-6)


@pytest.mark.parametrize(("i_theta", "component"), [(0, 0), (2, 1)])
@pytest.mark.parametrize("ratio", [0.9, 1.1])
def test_nodes_on_coarse_grids_are_near_a_cubic(monkeypatch, i_theta, component, ratio):
    """Pure longitudinal or lateral creepage: 1 - (1 - q/3)^3 to 5 % (Vermeulen and Johnson, 1964).

    Over t = q/(q + 2), 2 times the linear force at its begin; full sliding at its end.
    """
    grids = [rolling_grid(ratio, POISSON, n, n) for n in (8, 4)]
    module = import_module(MODULE)
    monkeypatch.setattr(module, "_grids", lambda _: grids)
    monkeypatch.setattr(module, "linear_coefficients", linear_coefficients.__wrapped__)
    for name, count in (("N_T", 4), ("N_PSI", 2), ("N_THETA", 2)):
        monkeypatch.setattr(module, name, count)
    row, failures = node_row(ratio, i_theta)
    assert failures == 0
    assert row.shape == (2, 5, 3)
    t = np.arange(1, 5) / 4.0
    q = np.minimum(2.0 * t / np.maximum(1.0 - t, 1e-9), 3.0)
    expected = np.append(2.0, (1.0 - (1.0 - q / 3.0) ** 3) / t)
    assert row[0, :, component] == pytest.approx(expected, rel=0.05)
    assert row[0, [0, -1], component] == pytest.approx([2.0, 1.0], rel=1e-3)
    # lateral force by spin and moment by lateral creepage begin with the sign that they go on with
    begins = np.abs(row[:, 0]) > 1e-6
    assert (np.sign(row[:, 0]) == np.sign(row[:, 1]))[begins].all()
    if i_theta == 0:
        assert (row[1] == row[0]).all()
    else:  # pure spin: no force along the rail, a moment
        assert abs(row[1, :, 0]).max() < 1e-9
        assert (row[1, :, 2] > 0.05).all()


@pytest.mark.parametrize("workers", [1, 2])
def test_build_makes_the_missing_rows_and_counts_them(tmp_path, monkeypatch, workers):
    made = []
    monkeypatch.setattr(f"{MODULE}._stored_row", lambda _, i, j: made.append((i, j)))
    monkeypatch.setattr(f"{MODULE}.WorkerPool", ThreadPoolExecutor)
    missing = [(0, 0), (1, N_THETA), (N_RATIO, 2)]
    rows = [(i, j) for i in range(N_RATIO + 1) for j in range(N_THETA + 1)]
    for i, j in set(rows) - set(missing):
        (tmp_path / f"row_{i:02d}_{j:02d}.npz").touch()
    counted = list(build_nodes(tmp_path, workers))
    assert counted == [(len(rows) - k, len(rows)) for k in (3, 2, 1, 0)]
    assert sorted(made) == missing


def test_build_goes_on_from_finished_rows(tmp_path):
    nodes = shipped_nodes()
    for i in range(N_RATIO + 1):
        for j in range(N_THETA + 1):
            with open(tmp_path / f"row_{i:02d}_{j:02d}.npz", "wb") as stream:
                np.savez(stream, row=nodes.force[i, j], kalker=nodes.kalker[i], failures=0)
    count = (N_RATIO + 1) * (N_THETA + 1)
    assert list(build_nodes(tmp_path)) == [(count, count)]
    gathered = gather_nodes(tmp_path)
    np.testing.assert_array_equal(gathered.force, nodes.force)
    write_nodes(gathered, tmp_path / "table.npz")
    with np.load(tmp_path / "table.npz") as stored:
        np.testing.assert_allclose(stored["force"], nodes.force, atol=5e-6)
    assert (tmp_path / "table.npz").stat().st_size < 4e6


@pytest.mark.parametrize("i_ratio", [3, 7, 11])
def test_small_creepage_has_the_slopes_of_linear_theory(i_ratio):
    ratio = float(node_ratios()[i_ratio])
    c11, c22, c23, c33 = linear_coefficients(ratio)
    small = 1e-6
    per_q = q_per_creepage(ratio)
    along, across, spin = table_force(ratio, small * np.eye(3)) / small * per_q[:, None]
    # five digits of the nodes
    assert along[0] == pytest.approx(c11, rel=1e-4)
    np.testing.assert_allclose(across[1:], [c22, -c23], rtol=1e-4)
    np.testing.assert_allclose(spin[1:], [c23, c33], rtol=1e-4)


@pytest.mark.parametrize("q", [(3.0, 4.0, 0.0), (1.0, -2.0, 2.0), (0.0, 0.0, 5.0)])
def test_huge_creepage_is_full_sliding(q):
    ratio = float(node_ratios()[9])
    expected = full_sliding(ratio, np.array(q) / q_per_creepage(ratio))
    for factor in (1e7, 1e200):
        found = table_force(ratio, factor * np.array(q))[0]
        # interpolation between the directions of the nodes
        np.testing.assert_allclose(found, expected, atol=6e-3)


def test_force_and_slope_are_continuous_over_the_seams():
    # the folds of the symmetries (q_x = 0, spin = 0, both) and the ends of the intervals of t
    ratio = float(node_ratios()[8])
    step = 1e-5
    for at, along in (
        ((0.0, 0.7, 0.9), (1.0, 0.0, 0.0)),
        ((0.8, 0.7, 0.0), (0.0, 0.0, 1.0)),
        ((0.8, -0.7, 0.0), (0.0, 0.0, 1.0)),
        ((1.1, 0.0, 0.0), (0.0, 1.0, 0.3)),
        ((T_HALF / 3.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ):
        coordinates = np.array(at) + step * np.arange(-3, 4)[:, None] * np.array(along)
        slopes = np.diff(table_force(ratio, coordinates), axis=0) / step
        # slopes over 1e-5 of numbers rounded to 1e-7 (single precision): steady to 0.02;
        # a kink of the force would show as a jump of its own size
        assert np.abs(np.diff(slopes, axis=0)).max() < 0.04


def test_no_creepage_along_or_across_no_force_there():
    ratio = np.array([0.06, 0.3, 1.0, 2.0, 7.0])
    a, b = SIZE * np.sqrt(ratio), SIZE / np.sqrt(ratio)
    spinning = creep_force(a, b, N, MU, 0.0, 1e-3, 3.0, law="table")
    along = creep_force(a, b, N, MU, 2e-3, 0.0, 0.0, law="table")
    # round-off of the angle, that of one part in 1e15 of a right angle
    assert np.abs(spinning.T_x).max() < 1e-10 * MU * N
    assert np.abs(along.T_y).max() < 1e-10 * MU * N
    assert np.abs(along.M_z).max() < 1e-10 * MU * N * SIZE


def test_ratio_beyond_the_table_warns_and_takes_the_nearest():
    def force(ratio):
        a, b = SIZE * np.sqrt(ratio), SIZE / np.sqrt(ratio)
        return creep_force(a, b, N, MU, 1e-3, 5e-4, 0.0, G=G, law="table")

    with pytest.warns(UserWarning, match="outside"):
        beyond = force(30.0)
    np.testing.assert_allclose(beyond, force(20.0), rtol=1e-6)


def test_nan_stays_visible():
    one = np.ones(1)
    for k in range(3):
        creepages = [np.zeros(1) for _ in range(3)]
        creepages[k][0] = np.nan
        patches = Patches(one, one, one, *np.zeros((4, 1)), *creepages, *np.zeros((4, 1)))
        kernel.table_forces(1, patches, 1.0, *creep_table(), SCRATCH)
        assert np.isnan(patches.T_x[0])


def test_other_poisson_numbers_have_their_linear_slopes():
    c11, c22, _, _ = (float(c) for c in kalker_coefficients(2.0, 0.25))
    small = 1e-9
    a, b = SIZE * np.sqrt(2.0), SIZE / np.sqrt(2.0)
    along = creep_force(a, b, N, MU, small, 0.0, 0.0, nu=0.25, law="table").T_x
    across = creep_force(a, b, N, MU, 0.0, small, 0.0, nu=0.25, law="table").T_y
    # own coefficients are within 1 % of the printed ones (three digits)
    assert along == pytest.approx(G * a * b * c11 * small, rel=0.01)
    assert across == pytest.approx(G * a * b * c22 * small, rel=0.01)


@pytest.mark.slow
def test_table_follows_the_solver_between_its_nodes():
    rng = np.random.default_rng(3)
    errors, moments = [], []
    for _ in range(24):
        ratio = float(np.exp(rng.uniform(np.log(0.1), np.log(10.0))))
        a, b = SIZE * np.sqrt(ratio), SIZE / np.sqrt(ratio)
        unit = MU * N / (G * SIZE**2)
        c = [float(value) for value in kalker_coefficients(ratio)]
        n = rng.normal(size=3)
        n *= np.exp(rng.uniform(np.log(0.2), np.log(6.0))) / np.linalg.norm(n)
        case = (unit * n[0] / c[0], unit * n[1] / c[1], unit * n[2] / (c[2] * SIZE))
        found = creep_force(a, b, N, MU, *case, G=G, law="table")
        exact = exact_creep_force(a, b, N, MU, *case, G=G)
        errors.append(np.hypot(found.T_x - exact.T_x, found.T_y - exact.T_y) / (MU * N))
        moments.append(abs(found.M_z - exact.M_z) / (MU * N * SIZE))
    # grid error of the single solution 0.007, interpolation 0.01
    assert max(errors) < 0.017
    assert max(moments) < 0.02
