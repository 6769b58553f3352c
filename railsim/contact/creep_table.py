"""The tabulated full theory of rolling contact: generator and data of the law `table`.

The creep force of an elliptic Hertz contact, over mu N, depends on four numbers: the ratio a/b and
three creepages.  They are brought into coordinates in which the force is smooth and the interesting
part is spread evenly:

- log(a/b);
- scaled creepages ``q = G a b/(mu N) (c11 xi_x, c22 xi_y, sqrt(c11 c22) rho phi)`` with Kalker's
  coefficients and rho = 0.8 sqrt((a^2 + b^2)/2), so that each is the force of linear theory and
  spin counts by the slip near the ellipse's far edge (the point where the slip turns round moves
  over the patch uniformly);
- direction of q by the angles theta from the axis of xi_x, psi from xi_y to phi;
- magnitude as ``t = |q|/(|q| + 2)``: linear theory at 0, full sliding at 1.

Stored is force over t, which at t = 0 is linear theory.  Two symmetries (mirror image, reversal of
all creepages) leave a quarter of the sphere.  Values at the nodes come from
:mod:`railsim.contact.exact_creep` on two grids, extrapolated; at t = 1 from the direction of the
rigid slip.  `creep_table` turns the nodes into cubic B-spline coefficients with the parities of the
symmetries, so that the force is twice continuously differentiable everywhere but at |q| = 0, where
it is once.  The look-up is :func:`railsim.kernels.creep_table.table_forces`.

Begin with `creep_table` (use) or `build_nodes` (generator: half an hour, restartable).
"""

import math
from collections.abc import Iterator
from concurrent.futures import as_completed
from functools import lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railsim.arrays import Floats
from railsim.contact.kalker import kalker_coefficients
from railsim.kernels.creep_table import N_PSI, N_RATIO, N_T, N_THETA, RATIO_MAX, T_HALF
from railsim.processes import WorkerPool

# the generator's solver; a run reads the finished table only
if TYPE_CHECKING:
    from railsim.contact.exact_creep import RollingGrid

POISSON = 0.28
"""Poisson's ratio of the tabulated solutions; others scale Kalker's coefficients."""
SPIN_ARM = 0.8
# the solver's error falls with about the power 1.5 of the cell: from two grids, one twice as fine
_EXTRAPOLATION = 1.0 / (math.sqrt(8.0) - 1.0)
_NO_SLIP = 1e9  # bound for linear theory


class CreepNodes(NamedTuple):
    """What the generator makes and the package ships."""

    # T_x/(mu N), T_y/(mu N), M_z/(mu N sqrt(a b)), all over t, shape (N_RATIO + 1, N_THETA + 1,
    # N_PSI, N_T + 1, 3)
    force: NDArray[np.float32]
    kalker: Floats  # c11, c22, c23, c33 of the same solver without slip, shape (N_RATIO + 1, 4)


class CreepTable(NamedTuple):
    """What the time loop looks up."""

    # B-spline coefficients of the force over t, from shape (N_RATIO + 3, N_THETA + 3, N_PSI + 3,
    # N_T + 3, 4); last axis T_x, T_y, M_z and 0.  Half the size of float64: the look-up waits for
    # the memory, and 1e-7 of mu N is far below what the table is good for
    coefficients: NDArray[np.float32]
    # B-spline coefficients over log(a/b) of the factors of q: c11, c22, and that of
    # ``phi sqrt(a b)``; last column zero; shape (N_RATIO + 3, 4)
    scale: Floats


NO_TABLE = CreepTable(np.zeros(0, dtype=np.float32), np.zeros((0, 4)))
"""Stands for the table where another law is used."""


def node_ratios() -> Floats:
    """Ratios a/b of the table's nodes."""
    return np.exp(np.linspace(-np.log(RATIO_MAX), np.log(RATIO_MAX), N_RATIO + 1))


def spin_scale(ratio: Floats, c11: Floats, c22: Floats) -> Floats:
    """Factor of ``phi sqrt(a b)`` in q: sqrt(c11 c22) rho/sqrt(a b)."""
    return np.asarray(np.sqrt(c11 * c22) * SPIN_ARM * np.sqrt(0.5 * (ratio + 1.0 / ratio)))


def direction(theta: ArrayLike, psi: ArrayLike) -> Floats:
    """Unit vector of (q_x, q_y, q_spin), last axis."""
    sin = np.sin(theta)
    parts = np.broadcast_arrays(np.cos(theta), sin * np.cos(psi), sin * np.sin(psi))
    return np.asarray(np.stack(parts, axis=-1), dtype=float)


def grid_size(ratio: float) -> tuple[int, int]:
    """Cells along and strips across for the finer of the two grids, both even.

    Where the ellipse is wide the slip turns round across the strips, where it is long along them.
    """
    return 2 * round(12.0 * float(ratio**0.12)), 2 * round(12.0 * float(ratio**-0.15))


@lru_cache(maxsize=2)
def _grids(ratio: float) -> tuple["RollingGrid", "RollingGrid"]:
    from railsim.contact.exact_creep import rolling_grid

    nx, ny = grid_size(ratio)
    return rolling_grid(ratio, POISSON, nx, ny), rolling_grid(ratio, POISSON, nx // 2, ny // 2)


def _extrapolated(fine: Floats, coarse: Floats) -> Floats:
    return fine + (fine - coarse) * _EXTRAPOLATION


@lru_cache(maxsize=2)
def linear_coefficients(ratio: float) -> tuple[float, float, float, float]:
    """Kalker's c11, c22, c23, c33 by our own solver without slip."""
    from railsim.contact.exact_creep import Rolling

    results = []
    for grid in _grids(ratio):
        unit_forces = []
        for creepages in np.eye(3):
            rolling = Rolling(grid, np.full(grid.x.size, _NO_SLIP))
            rolling.solve(*creepages)
            unit_forces.append(rolling.force())
        along, across, spin = unit_forces
        results.append(np.array([along[0], across[1], 0.5 * (spin[1] - across[2]), spin[2]]))
    c11, c22, c23, c33 = _extrapolated(*results)
    return float(c11), float(c22), float(c23), float(c33)


def full_sliding(ratio: float, xi: Floats) -> Floats:
    """Force where everything slides along the rigid slip, shape (..., 3) for xi of that shape.

    Hertz pressure summed over 200 strips of 200 cells at Gauss-like points (cosine along the
    strip).
    """
    n, a, b = 200, np.sqrt(ratio), 1.0 / np.sqrt(ratio)
    angle = (np.arange(n) + 0.5) * np.pi / n
    y = np.cos(angle)  # both directions: weights of Gauss-Chebyshev type
    length = np.sin(angle)
    x = length[:, None] * np.cos(angle)[None, :]
    weight = length[:, None] ** 3 * np.sin(angle)[None, :] ** 2
    weight = weight / weight.sum()
    x, y = (a * x).ravel(), np.repeat(b * y, n)
    weight = weight.ravel()
    force = np.empty(xi.shape)
    for index in np.ndindex(xi.shape[:-1]):
        s_x = xi[index][0] - xi[index][2] * y
        s_y = xi[index][1] + xi[index][2] * x
        size = np.maximum(np.hypot(s_x, s_y), 1e-300)
        t_x, t_y = weight * s_x / size, weight * s_y / size
        force[index] = t_x.sum(), t_y.sum(), (x * t_y - y * t_x).sum()
    return force


def node_row(ratio: float, i_theta: int) -> tuple[Floats, int]:
    """Force over t at the nodes of one ratio and theta, shape (N_PSI, N_T + 1, 3).

    Also counts the solutions that did not converge.
    """
    from railsim.contact.exact_creep import Rolling

    c11, c22, c23, c33 = linear_coefficients(ratio)
    per_q = np.array([c11, c22, float(spin_scale(np.asarray(ratio), *map(np.asarray, (c11, c22))))])
    theta = np.asarray(0.5 * np.pi * i_theta / N_THETA)
    row = np.empty((N_PSI, N_T + 1, 3))
    failures = 0
    for i_psi in range(N_PSI if i_theta > 0 else 1):
        xi = direction(theta, np.asarray(np.pi * i_psi / N_PSI)) / per_q
        row[i_psi, 0] = T_HALF * np.array(
            [c11 * xi[0], c22 * xi[1] + c23 * xi[2], c33 * xi[2] - c23 * xi[1]]
        )
        rollings = [Rolling(grid) for grid in _grids(ratio)]
        for k in range(1, N_T):
            t = k / N_T
            q = T_HALF * t / (1.0 - t)
            failures += sum(not rolling.solve(*(q * xi)) for rolling in rollings)
            row[i_psi, k] = _extrapolated(*(rolling.force() for rolling in rollings)) / t
        row[i_psi, N_T] = full_sliding(ratio, xi)
    if i_theta == 0:
        row[1:] = row[0]
    return row, failures


def _stored_row(folder: Path, i_ratio: int, i_theta: int) -> None:
    path = folder / f"row_{i_ratio:02d}_{i_theta:02d}.npz"
    ratio = float(node_ratios()[i_ratio])
    row, failures = node_row(ratio, i_theta)
    part = path.with_suffix(".part")
    with open(part, "wb") as stream:
        np.savez(stream, row=row, kalker=linear_coefficients(ratio), failures=failures)
    part.rename(path)


def build_nodes(folder: Path, workers: int = 2) -> Iterator[tuple[int, int]]:
    """Compute all missing rows of nodes into `folder`; yields (rows done, rows in all).

    Each row (one ratio, one theta) is a file that appears when it is whole: a build that was
    interrupted is continued.  Rows do not depend on each other nor on the workers.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = [(i, j) for i in range(N_RATIO + 1) for j in range(N_THETA + 1)]
    missing = [(i, j) for i, j in rows if not (folder / f"row_{i:02d}_{j:02d}.npz").exists()]
    done = len(rows) - len(missing)
    yield done, len(rows)
    if not missing:
        return
    if workers == 1:
        for i, j in missing:
            _stored_row(folder, i, j)
            done += 1
            yield done, len(rows)
        return
    with WorkerPool(workers) as pool:
        for future in as_completed(pool.submit(_stored_row, folder, i, j) for i, j in missing):
            future.result()
            done += 1
            yield done, len(rows)


def gather_nodes(folder: Path) -> CreepNodes:
    """Put the rows in `folder` together; all must be there (`build_nodes`)."""
    force = np.empty((N_RATIO + 1, N_THETA + 1, N_PSI, N_T + 1, 3), dtype=np.float32)
    kalker = np.empty((N_RATIO + 1, 4))
    for i in range(N_RATIO + 1):
        for j in range(N_THETA + 1):
            with np.load(folder / f"row_{i:02d}_{j:02d}.npz") as row:
                force[i, j] = row["row"]
                kalker[i] = row["kalker"]
    return CreepNodes(force, kalker)


def write_nodes(nodes: CreepNodes, path: Path) -> None:
    """Write the nodes as a compressed file, rounded to what the solver is good for (1e-5)."""
    force = np.round(nodes.force.astype(float), 5).astype(np.float32)
    np.savez_compressed(path, force=force, kalker=nodes.kalker, poisson=POISSON)


def shipped_nodes() -> CreepNodes:
    """Nodes that come with the package."""
    with (
        as_file(files("railsim.contact").joinpath("data/creep_table.npz")) as path,
        np.load(path) as stored,
    ):
        return CreepNodes(stored["force"], stored["kalker"])


@lru_cache(maxsize=4)
def creep_table(nu: float = POISSON) -> CreepTable:
    """Table of the full theory for the look-up in the time loop.

    `nu`: Poisson's ratio.  The table was computed for 0.28; for others the creepages are scaled by
    the ratios of Kalker's printed coefficients, which is exact for small creepage. Returns B-spline
    coefficients; not to be changed.
    """
    return table_of_nodes(shipped_nodes(), nu)


def table_of_nodes(nodes: CreepNodes, nu: float = POISSON) -> CreepTable:
    """B-spline coefficients that interpolate the nodes."""
    ratio = node_ratios()
    c11, c22, _, _ = nodes.kalker.T
    scale = np.zeros((N_RATIO + 1, 4))
    scale[:, 0], scale[:, 1] = c11, c22
    scale[:, 2] = spin_scale(ratio, c11, c22)
    if nu != POISSON:
        here, there = kalker_coefficients(ratio, nu), kalker_coefficients(ratio, POISSON)
        for column in range(3):
            scale[:, column] *= here[column] / there[column]
    along_ratio = _free_spline(N_RATIO)
    force = nodes.force.astype(float)
    coefficients = np.zeros((N_RATIO + 3, N_THETA + 3, N_PSI + 3, N_T + 3, 4))
    for component in range(3):
        longitudinal = component == 0
        coefficients[..., component] = np.einsum(
            "ai,bj,ck,dl,ijkl->abcd",
            along_ratio,
            _parity_spline(N_THETA, *((1, -1) if longitudinal else (-1, 1))),
            _periodic_spline(N_PSI, 1 if longitudinal else -1),
            _free_spline(N_T),
            force[..., component],
            optimize=True,
        )
    return CreepTable(coefficients.astype(np.float32).ravel(), along_ratio @ scale)


def _free_spline(n: int) -> Floats:
    """Coefficients -1..n+1 from values at 0..n; third derivative continuous at 1 and n - 1."""
    matrix = np.zeros((n + 3, n + 3))
    for i in range(n + 1):
        matrix[i, i : i + 3] = 1 / 6, 4 / 6, 1 / 6
    matrix[n + 1, :5] = matrix[n + 2, n - 2 :] = 1.0, -4.0, 6.0, -4.0, 1.0
    return np.asarray(np.linalg.solve(matrix, np.eye(n + 3, n + 1)))


def _parity_spline(n: int, first: int, last: int) -> Floats:
    """Coefficients -1..n+1 from values at 0..n, even (1) or odd (-1) about the ends."""
    spread: Floats = np.eye(n + 3, n + 1, -1)
    spread[0, 1], spread[-1, -2] = first, last
    matrix = (spread[:-2] + 4.0 * spread[1:-1] + spread[2:]) / 6.0
    odd = [end for end, parity in ((0, first), (n, last)) if parity < 0]
    matrix[odd] = np.eye(n + 1)[odd]
    inverse = np.linalg.inv(matrix)
    # value and coefficient there are zero, to the last bit: else zero creepage had a small force
    inverse[odd] = 0.0
    inverse[:, odd] = 0.0
    return np.asarray(spread @ inverse)


def _periodic_spline(n: int, sign: int) -> Floats:
    """Coefficients -1..n+1 from values at 0..n-1 where f(k + n) = sign f(k)."""
    spread: Floats = np.eye(n + 3, n, -1)
    spread[0, -1] = spread[-2, 0] = spread[-1, 1] = sign
    matrix = (spread[:-3] + 4.0 * spread[1:-2] + spread[2:-1]) / 6.0
    return np.asarray(spread @ np.linalg.inv(matrix))
