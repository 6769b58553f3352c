"""Creep force by the full half-space theory: Kalker's "exact" theory of rolling contact.

Both bodies are elastic half-spaces of the same material, so that tangential tractions do not
change the normal problem: contact ellipse and pressure are those of Hertz.  Traction and slip
obey Coulomb's law at every point, in steady rolling.

Discretisation.  The ellipse is cut into `ny` strips of equal width, each as long as gives it its
share of the ellipse's area; each strip into `nx` rectangular cells, shorter towards its ends
(cosine spacing) where the traction has square-root fronts.  Traction is constant in a cell; the
bound is the mean Hertz pressure along the cell times mu, scaled so that it sums up to mu N.  The
elastic slip is a difference of displacements between neighbouring cell centres, hence exact to
second order halfway between them: there the sticking cells must not slip.  Sliding cells compare
directions at their own centres, where the slip is extrapolated from upstream.  (Compared at the
halfway points too, the error in spin falls with the first power of the cell only.)

Accuracy: docs/validation/creep.md.  Cost: some tenths of a second for 28 x 28 cells after the
matrices of an ellipse ratio are made (as long, kept).  For the time loop use `law="table"`, which
was made with this solver.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from railsim.arrays import Flags, Floats, Indices
from railsim.errors import ModelError
from railsim.kernels.halfspace import rolling_matrices

_TOLERANCE = 1e-6  # turn of the tractions at which Newton's method ends [rad]
_ITERATIONS = 60
_MAX_TURN = 0.7  # largest turn of a traction's direction in one iteration [rad]
# Most cases need 5 to 11 iterations.  After _SETTLED of them, where only a share _FEW of the cells
# still changes sides, those that go to and fro are kept in stick at their _MAX_RETURNS-th return.
_SETTLED, _FEW, _MAX_RETURNS = 15, 0.05, 2
# At once, or where that does not converge (fine grids, spin against lateral creepage) step by step.
_WAYS = ((1.0,), (0.1, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0))


class RollingGrid(NamedTuple):
    """Cells and matrices of one ellipse ratio, lengths over sqrt(a b)."""

    # of the cells, shape (n_strip, n_cell); cell 0 of a strip at the leading edge
    x: Floats  # centre
    y: Floats
    half_x: Floats  # half side
    half_y: Floats
    bound: Floats  # of the traction over mu N/(a b), Hertz; sums up to 1 with the cells' areas
    x_middle: Floats  # where sticking is to be evaluated
    # elastic slip per traction, shape (3, n, n), see `railsim.kernels.halfspace.rolling_matrices`
    middle: Floats
    centre: Floats

    @property
    def area(self) -> Floats:
        """Area of the cells over a b."""
        return 4.0 * self.half_x * self.half_y


class ExactCreepForce(NamedTuple):
    """Creep force on the rail with the distribution over the patch.

    Attributes
    ----------
    T_x, T_y, M_z : float
        Force on the rail [N], moment about the normal at the patch's centre [N m].
    x, y, area : ndarray, shape (n_strip, n_cell)
        Cell centres [m], cell areas [m^2].
    t_x, t_y : ndarray, shape (n_strip, n_cell)
        Traction on the rail [Pa].
    s_x, s_y : ndarray, shape (n_strip, n_cell)
        Slip velocity, wheel minus rail, over the speed of travel; zero where it sticks [1].
    bound : ndarray, shape (n_strip, n_cell)
        Friction coefficient times pressure [Pa].
    sticks : ndarray of bool, shape (n_strip, n_cell)
        Where the surfaces stick.
    """

    T_x: float
    T_y: float
    M_z: float
    x: Floats
    y: Floats
    area: Floats
    t_x: Floats
    t_y: Floats
    s_x: Floats
    s_y: Floats
    bound: Floats
    sticks: Flags


class Rolling:
    """Traction and slip on a grid, each solution started from the one before.

    `bound`: of the traction, by default that of the grid. Over mu N/(a b) are `traction`,
    float64[2, n], and over mu N/(G a b) `slip`; `sticks`, bool[n]: stick or slip.
    """

    def __init__(self, grid: RollingGrid, bound: Floats | None = None) -> None:
        self.grid = grid
        self._bound = grid.bound.ravel() if bound is None else bound
        self.traction, self.slip = np.zeros((2, 2, grid.x.size))
        self.sticks = np.ones(grid.x.size, dtype=bool)

    def solve(self, xi_x: float, xi_y: float, phi: float, share: float = 1.0) -> bool:
        """Solve for a share of creepages over mu N/(G a b) (spin: times sqrt(a b) before).

        Newton's method on active sets. A cell either sticks (no slip at its point in `middle`) or
        slides (traction at the bound, along the slip at its centre). Each iteration solves the
        linearised equations of both sets, then moves cells whose traction exceeds the bound to the
        sliding ones and those whose slip opposes the traction to the sticking ones. A few cells at
        the border may satisfy neither (the two conditions are asked for at points half a cell
        apart) and would go to and fro: in the end they are kept in stick, and their traction is
        cut back to the bound. Returns whether the iteration ended by itself.
        """
        grid, p, bound = self.grid, self.traction, self._bound
        across = (xi_x - phi * grid.y).ravel()
        rigid_middle = share * np.stack([across, (xi_y + phi * grid.x_middle).ravel()])
        rigid_centre = share * np.stack([across, (xi_y + phi * grid.x).ravel()])
        returns, moved = np.zeros(bound.size, dtype=np.int64), bound.size
        for count in range(1, _ITERATIONS + 1):
            self.slip = _slips(grid.centre, p, rigid_centre)
            turn = self._step(_slips(grid.middle, p, rigid_middle))
            self.slip = _slips(grid.centre, p, rigid_centre)
            beyond = self.sticks & (np.hypot(*p) > bound * (1.0 + 1e-9)) & (returns < _MAX_RETURNS)
            back = ~self.sticks & (np.sum(p * self.slip, axis=0) < 0.0)
            returns[back] += count > _SETTLED and moved <= _FEW * bound.size
            self._cut_back(beyond)
            self.sticks ^= beyond | back
            moved = int(np.count_nonzero(beyond | back))
            if moved == 0 and turn < _TOLERANCE:
                self._cut_back(np.hypot(*p) > bound)
                return True
        self.slip = _slips(grid.centre, p, rigid_centre)
        self._cut_back(np.hypot(*p) > bound)
        return False

    def _step(self, slip_middle: Floats) -> float:
        """Take a step of Newton's method and return the largest turn of a traction.

        Unknowns: change of both tractions of the cells that stick, change of the angle of the
        traction of those that slide. Equations: no slip there, slip parallel to traction here.
        """
        p, slip = self.traction, self.slip
        (stick,), (slide,) = np.nonzero(self.sticks), np.nonzero(~self.sticks)
        ns, n = len(stick), 2 * len(stick) + len(slide)
        cos, sin = p[:, slide] / self._bound[slide]
        # single precision is enough for a step of Newton's method, and half as dear
        A, r = np.empty((n, n), np.float32), np.empty(n, np.float32)
        A[:ns], A[ns : 2 * ns] = self._changes(self.grid.middle[:, stick], stick, slide)
        of_x, of_y = self._changes(self.grid.centre[:, slide], stick, slide)
        A[2 * ns :] = cos[:, None] * of_y - sin[:, None] * of_x
        sliding = np.arange(2 * ns, n)
        A[sliding, sliding] -= cos * slip[0, slide] + sin * slip[1, slide]
        r[: 2 * ns] = -slip_middle[:, stick].ravel()
        r[2 * ns :] = sin * slip[0, slide] - cos * slip[1, slide]
        # A lies by rows, where the factorisation wants columns: that of the transpose needs no copy
        factors = lu_factor(A.T, overwrite_a=True, check_finite=False)
        change = lu_solve(factors, r, trans=1, check_finite=False).astype(np.float64)
        p[:, stick] += change[: 2 * ns].reshape(2, ns)
        turn = np.clip(change[2 * ns :], -_MAX_TURN, _MAX_TURN)
        p[:, slide] = self._bound[slide] * np.stack(
            [np.cos(turn) * cos - np.sin(turn) * sin, np.sin(turn) * cos + np.cos(turn) * sin]
        )
        return float(np.max(np.abs(turn), initial=0.0))

    def _changes(self, rows: Floats, stick: Indices, slide: Indices) -> tuple[Floats, Floats]:
        """Changes of both slips, in rows of a matrix, with the unknowns of a step."""
        p_x, p_y = self.traction[:, slide]
        (xx, xy, yy), (xx_t, xy_t, yy_t) = rows[:, :, stick], rows[:, :, slide]
        return (
            np.hstack([xx, xy, xy_t * p_x - xx_t * p_y]),
            np.hstack([xy, yy, yy_t * p_x - xy_t * p_y]),
        )

    def _cut_back(self, cells: Flags) -> None:
        """Shorten the tractions of some cells to the bound."""
        p = self.traction
        p[:, cells] *= self._bound[cells] / np.hypot(*p[:, cells])

    def force(self) -> Floats:
        """T_x and T_y over mu N, M_z over mu N sqrt(a b)."""
        area, x, y = self.grid.area.ravel(), self.grid.x.ravel(), self.grid.y.ravel()
        t_x, t_y = self.traction
        return np.array([area @ t_x, area @ t_y, area @ (x * t_y - y * t_x)])


def _slips(matrix: Floats, p: Floats, rigid: Floats) -> Floats:
    """Slip of every cell: rigid part plus elastic part of the traction."""
    xx, xy, yy = matrix
    elastic: Floats = np.stack([xx @ p[0] + xy @ p[1], xy @ p[0] + yy @ p[1]])
    return rigid + elastic


@lru_cache(maxsize=4)
def rolling_grid(a_over_b: float, nu: float, nx: int, ny: int) -> RollingGrid:
    """Cells and influence matrices of an ellipse ratio; memory 48 (nx ny)^2 bytes."""
    a, b = np.sqrt(a_over_b), 1.0 / np.sqrt(a_over_b)
    border = np.linspace(-1.0, 1.0, ny + 1)
    segment = 0.5 * (border * np.sqrt(np.maximum(1.0 - border**2, 0.0)) + np.arcsin(border))
    half_length = np.diff(segment) / np.diff(border)  # over a; mean of sqrt(1 - y^2)
    fraction = np.cos(np.linspace(0.0, np.pi, nx + 1))  # cell borders from leading to trailing
    edge = a * half_length
    shape = (ny, nx)
    x = edge[:, None] * 0.5 * (fraction[:-1] + fraction[1:])
    y = np.broadcast_to(0.5 * b * (border[:-1] + border[1:])[:, None], shape).copy()
    half_x = edge[:, None] * 0.5 * (fraction[:-1] - fraction[1:])
    half_y = np.full(shape, b / ny)
    # mean over each cell of sqrt(l^2 - x^2)
    primitive = 0.5 * (fraction * np.sqrt(np.maximum(1.0 - fraction**2, 0.0)) + np.arcsin(fraction))
    bound = half_length[:, None] * (primitive[:-1] - primitive[1:]) / (fraction[:-1] - fraction[1:])
    bound /= np.sum(4.0 * half_x * half_y * bound)
    n = nx * ny
    middle, centre = np.empty((3, n, n)), np.empty((3, n, n))
    x_middle = np.empty(shape)
    rolling_matrices(x, y, half_x, half_y, edge, nu, middle, centre, x_middle)
    return RollingGrid(x, y, half_x, half_y, bound, x_middle, middle, centre)


def exact_creep_force(
    a: float,
    b: float,
    N: float,
    mu: float,
    xi_x: float,
    xi_y: float,
    phi: float,
    G: float = 82e9,
    nu: float = 0.28,
    nx: int = 28,
    ny: int = 28,
) -> ExactCreepForce:
    """Creep force and distribution of traction and slip by the full half-space theory.

    Parameters
    ----------
    a, b : float
        Semi-axes along and across the rolling direction, > 0 [m].
    N : float
        Normal force, > 0 [N].
    mu : float
        Friction coefficient, > 0 [1].
    xi_x, xi_y, phi : float
        Creepages, wheel minus rail [1, 1, 1/m].
    G : float
        Shear modulus of wheel and rail [Pa].
    nu : float
        Poisson's ratio [1].
    nx, ny : int
        Cells along, strips across the patch.

    Returns
    -------
    ExactCreepForce
        Force, moment and distributions, on the rail.

    Raises
    ------
    ModelError
        If an input is not positive and finite, or the iteration does not converge.

    Notes
    -----
    Source: Kalker (1990), Three-Dimensional Elastic Bodies in Rolling Contact; the discretisation
    is our own.
    """
    for name, value in {"a": a, "b": b, "N": N, "mu": mu, "G": G}.items():
        if not (np.isfinite(value) and value > 0.0):
            raise ModelError(f"exact creep force: {name} must be positive, not {value}")
    if not np.isfinite([xi_x, xi_y, phi]).all():
        raise ModelError("exact creep force: the creepages must be finite")
    size = np.sqrt(a * b)
    unit = mu * N / (a * b)  # of traction
    grid = rolling_grid(float(a / b), float(nu), nx, ny)
    creepages = xi_x * G / unit, xi_y * G / unit, phi * size * G / unit
    for shares in _WAYS:
        rolling = Rolling(grid)
        converged = [rolling.solve(*creepages, share) for share in shares]
        if converged[-1]:
            break
    else:
        raise ModelError("exact creep force: the iteration for stick and slip did not converge")
    shape = (2, *grid.x.shape)
    t_x, t_y = unit * rolling.traction.reshape(shape)
    slip, sticks = rolling.slip.reshape(shape), rolling.sticks.reshape(shape[1:])
    x, y, area = size * grid.x, size * grid.y, a * b * grid.area
    free = np.where(sticks, 0.0, unit / G)
    return ExactCreepForce(
        T_x=float(np.sum(area * t_x)),
        T_y=float(np.sum(area * t_y)),
        M_z=float(np.sum(area * (x * t_y - y * t_x))),
        x=x,
        y=y,
        area=area,
        t_x=t_x,
        t_y=t_y,
        s_x=free * slip[0],
        s_y=free * slip[1],
        bound=unit * grid.bound,
        sticks=sticks,
    )
