"""Tangential contact of two equal elastic half-spaces in steady rolling (Kalker's theory).

The contact ellipse is cut into rectangular cells of constant traction.  `cell_influence` gives the
difference of the surface displacements of wheel and rail at a point from the traction of one cell
(integrals of the solution of Boussinesq and Cerruti over the rectangle, closed form).
`rolling_matrices` differences them along the rolling direction, `rolling_traction` finds the
traction that obeys Coulomb's law everywhere.  :mod:`railsim.contact.exact_creep` prepares the grid
and describes the discretisation; all quantities here are dimensionless (G = mu N = sqrt(a b) = 1).

Sources: Kalker, J.J. (1990), Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer, ch. 4
(the discrete problem); Johnson, K.L. (1985), Contact Mechanics, Cambridge, sec. 3.6 (point force
along the surface).
"""

import math

import numpy as np

from . import compiled

CONVERGED = 0
NOT_CONVERGED = 1
_MAX_TURN = 0.7  # largest turn of a traction's direction in one iteration [rad]
# Most cases need 5 to 11 iterations.  After _SETTLED of them, where only a share _FEW of the cells
# still changes sides, those that go to and fro are kept in stick at their _MAX_RETURNS-th return.
_SETTLED, _FEW, _MAX_RETURNS = 15, 0.05, 2


@compiled(in_loop=False)
def _log_sum(u, v):
    """log(u + sqrt(u^2 + v^2)) without cancellation for u < 0; 0 where the sum vanishes."""
    r = math.sqrt(u * u + v * v)
    if u >= 0.0:
        return math.log(u + r) if r > 0.0 else 0.0
    return math.log(v * v / (r - u)) if v != 0.0 else 0.0


@compiled(in_loop=False)
def cell_influence(x, y, half_x, half_y, nu):
    """Displacement differences at (x, y) by unit tractions on a cell about the origin.

    Parameters
    ----------
    x, y : float
        Point relative to the cell's centre.
    half_x, half_y : float
        Half sides of the cell.
    nu : float
        Poisson's ratio of both bodies.

    Returns
    -------
    K_xx, K_xy, K_yy : float
        Displacement wheel minus rail against the traction on the wheel, over length/G.

    Notes
    -----
    One body: u_x = 1/(2 pi G) [(1 - nu)/R + nu x^2/R^3] p_x + nu/(2 pi G) x y/R^3 p_y (Johnson
    1985, eq. 3.75 at z = 0); two equal bodies: twice that.
    """
    xx = 0.0
    yy = 0.0
    xy = 0.0
    for i in range(2):
        u = x + half_x if i == 0 else x - half_x
        for j in range(2):
            v = y + half_y if j == 0 else y - half_y
            sign = 1.0 if i == j else -1.0
            xx += sign * v * _log_sum(u, v)  # integral of x^2/R^3
            yy += sign * u * _log_sum(v, u)  # integral of y^2/R^3
            xy -= sign * math.sqrt(u * u + v * v)  # integral of x y/R^3
    even = (1.0 - nu) * (xx + yy)  # integral of 1/R
    return (even + nu * xx) / math.pi, nu * xy / math.pi, (even + nu * yy) / math.pi


@compiled(in_loop=False)
def rolling_matrices(x, y, half_x, half_y, edge, nu, middle, centre, x_middle):
    """Matrices that give the elastic part of the slip from the cells' tractions.

    Steady rolling in +x: elastic slip is dU/dx with U the displacement difference by the traction
    on the rail.  It is differenced between neighbouring cell centres of a strip (the first time
    from the leading edge), thus central about the point halfway: `middle`.  At the cells' own
    centres it is extrapolated from the two points upstream: `centre`.

    Parameters
    ----------
    x, y, half_x, half_y : ndarray, shape (n_strip, n_cell)
        Cells; index 0 of the second axis is at the leading edge (largest x).
    edge : ndarray, shape (n_strip,)
        x of the leading edge.
    nu : float
        Poisson's ratio.
    middle, centre : ndarray, shape (3, n, n), written
        For K_xx, K_xy, K_yy; n = n_strip n_cell, strips contiguous.
    x_middle : ndarray, shape (n_strip, n_cell), written
        Position of the rows of `middle`.
    """
    n_strip, n_cell = x.shape
    here = np.empty(3)
    for j in range(n_strip):
        for source_strip in range(n_strip):
            for source in range(n_cell):
                column = source_strip * n_cell + source
                before = np.zeros(3)
                x_before = edge[j]
                for k in range(-1, n_cell):
                    x_here = edge[j] if k < 0 else x[j, k]
                    here[0], here[1], here[2] = cell_influence(
                        x_here - x[source_strip, source],
                        y[j, 0] - y[source_strip, source],
                        half_x[source_strip, source],
                        half_y[source_strip, source],
                        nu,
                    )
                    if k >= 0:
                        step = x_before - x_here
                        for q in range(3):
                            middle[q, j * n_cell + k, column] = (before[q] - here[q]) / step
                        x_middle[j, k] = 0.5 * (x_before + x_here)
                    x_before = x_here
                    for q in range(3):
                        before[q] = here[q]
        for k in range(n_cell):
            row = j * n_cell + k
            ahead = 0.0
            if k > 0:
                ahead = (x[j, k] - x_middle[j, k]) / (x_middle[j, k - 1] - x_middle[j, k])
            for q in range(3):
                for column in range(n_strip * n_cell):
                    value = middle[q, row, column]
                    if k > 0:
                        value += ahead * (middle[q, row - 1, column] - value)
                    centre[q, row, column] = value


@compiled(in_loop=False)
def _slips(matrix, p, rigid, slip):
    """Slip of every cell: rigid part plus elastic part of the traction."""
    n = p.shape[1]
    for i in range(n):
        sx = rigid[0, i]
        sy = rigid[1, i]
        for j in range(n):
            sx += matrix[0, i, j] * p[0, j] + matrix[1, i, j] * p[1, j]
            sy += matrix[1, i, j] * p[0, j] + matrix[2, i, j] * p[1, j]
        slip[0, i] = sx
        slip[1, i] = sy


@compiled(in_loop=False)
def _newton_system(middle, centre, stick, slide, p, bound, slip_middle, slip_centre, A, r):
    """Linear system of one Newton step; see `rolling_traction`.

    Unknowns: change of both tractions of the cells in `stick`, change of the angle of the
    traction of those in `slide`.  Equations: no slip there, slip parallel to traction here.
    """
    ns, nl = stick.size, slide.size
    for i in range(ns + nl):
        gripping = i < ns
        cell = stick[i] if gripping else slide[i - ns]
        matrix = middle if gripping else centre
        cos_i = sin_i = 0.0
        if gripping:
            r[i] = -slip_middle[0, cell]
            r[ns + i] = -slip_middle[1, cell]
        else:
            cos_i = p[0, cell] / bound[cell]
            sin_i = p[1, cell] / bound[cell]
            r[ns + i] = sin_i * slip_centre[0, cell] - cos_i * slip_centre[1, cell]
        for j in range(ns):
            source = stick[j]
            xx, xy = matrix[0, cell, source], matrix[1, cell, source]
            yy = matrix[2, cell, source]
            if gripping:
                A[i, j] = xx
                A[i, ns + j] = xy
                A[ns + i, j] = xy
                A[ns + i, ns + j] = yy
            else:
                A[ns + i, j] = cos_i * xy - sin_i * xx
                A[ns + i, ns + j] = cos_i * yy - sin_i * xy
        for j in range(nl):
            source = slide[j]
            xx, xy = matrix[0, cell, source], matrix[1, cell, source]
            yy = matrix[2, cell, source]
            x = xy * p[0, source] - xx * p[1, source]
            y = yy * p[0, source] - xy * p[1, source]
            if gripping:
                A[i, 2 * ns + j] = x
                A[ns + i, 2 * ns + j] = y
            else:
                A[ns + i, 2 * ns + j] = cos_i * y - sin_i * x
        if not gripping:
            A[ns + i, ns + i] -= cos_i * slip_centre[0, cell] + sin_i * slip_centre[1, cell]


@compiled(in_loop=False)
def rolling_traction(
    middle, centre, rigid_middle, rigid_centre, bound, p, sticks, slip, tolerance, iterations
):
    """Find the traction in steady rolling with Coulomb friction: Newton's method on active sets.

    A cell either sticks (no slip at its point in `middle`) or slides (traction at the bound,
    along the slip at its centre).  Each iteration solves the linearised equations of both sets,
    then moves cells whose traction exceeds the bound to the sliding ones and those whose slip
    opposes the traction to the sticking ones.  A few cells at the border may satisfy neither (the
    two conditions are asked for at points half a cell apart) and would go to and fro: in the
    end they are kept in stick, and their traction is cut back to the bound.

    Parameters
    ----------
    middle, centre : ndarray, shape (3, n, n)
        From `rolling_matrices`.
    rigid_middle, rigid_centre : ndarray, shape (2, n)
        Rigid slip over speed at the two kinds of points.
    bound : ndarray, shape (n,)
        Traction bound > 0.
    p : ndarray, shape (2, n), read as the start and written
        Traction on the rail.
    sticks : ndarray of int64, shape (n,), read as the start and written
        1 where the cell sticks.
    slip : ndarray, shape (2, n), written
        Slip at the cells' centres (sticking cells: about zero).
    tolerance : float
        Turn of the tractions below which the iteration ends [rad].
    iterations : int
        Most iterations.

    Returns
    -------
    status, count : int
        CONVERGED or NOT_CONVERGED, number of iterations.
    """
    n = bound.size
    moved = n
    returns = np.zeros(n, np.int64)
    slip_middle = np.empty((2, n))
    _slips(middle, p, rigid_middle, slip_middle)
    _slips(centre, p, rigid_centre, slip)
    for count in range(1, iterations + 1):
        stick = np.nonzero(sticks == 1)[0]
        slide = np.nonzero(sticks == 0)[0]
        ns, nl = stick.size, slide.size
        # single precision is enough for a step of Newton's method, and half as dear
        A = np.empty((2 * ns + nl, 2 * ns + nl), np.float32)
        r = np.empty(2 * ns + nl, np.float32)
        _newton_system(middle, centre, stick, slide, p, bound, slip_middle, slip, A, r)
        change = np.linalg.solve(A, r)
        largest = 0.0
        for i in range(ns):
            p[0, stick[i]] += change[i]
            p[1, stick[i]] += change[ns + i]
        for i in range(nl):
            turn = max(-_MAX_TURN, min(_MAX_TURN, change[2 * ns + i]))
            largest = max(largest, abs(turn))
            cell = slide[i]
            cos_t, sin_t = math.cos(turn), math.sin(turn)
            px = cos_t * p[0, cell] - sin_t * p[1, cell]
            py = sin_t * p[0, cell] + cos_t * p[1, cell]
            shrink = bound[cell] / math.sqrt(px * px + py * py)
            p[0, cell] = shrink * px
            p[1, cell] = shrink * py
        _slips(middle, p, rigid_middle, slip_middle)
        _slips(centre, p, rigid_centre, slip)
        settled = 1 if count > _SETTLED and moved <= _FEW * n else 0
        moved = 0
        for i in range(n):
            if sticks[i] == 1:
                size = math.sqrt(p[0, i] * p[0, i] + p[1, i] * p[1, i])
                if size > bound[i] * (1.0 + 1e-9) and returns[i] < _MAX_RETURNS:
                    sticks[i] = 0
                    p[0, i] *= bound[i] / size
                    p[1, i] *= bound[i] / size
                    moved += 1
            elif p[0, i] * slip[0, i] + p[1, i] * slip[1, i] < 0.0:
                sticks[i] = 1
                returns[i] += settled
                moved += 1
        if moved == 0 and largest < tolerance:
            _cut_back(p, bound)
            return CONVERGED, count
        if moved > 0:
            _slips(middle, p, rigid_middle, slip_middle)
            _slips(centre, p, rigid_centre, slip)
    _cut_back(p, bound)
    return NOT_CONVERGED, iterations


@compiled(in_loop=False)
def _cut_back(p, bound):
    """Shorten tractions that exceed the bound."""
    for i in range(bound.size):
        size = math.sqrt(p[0, i] * p[0, i] + p[1, i] * p[1, i])
        if size > bound[i]:
            p[0, i] *= bound[i] / size
            p[1, i] *= bound[i] / size
