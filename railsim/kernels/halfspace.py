"""Tangential contact of two equal elastic half-spaces in steady rolling (Kalker's theory).

The contact ellipse is cut into rectangular cells of constant traction.  `cell_influence` gives the
difference of the surface displacements of wheel and rail at a point from the traction of one cell
(integrals of the solution of Boussinesq and Cerruti over the rectangle, closed form).
`rolling_matrices` differences them along the rolling direction.  :mod:`railsim.contact.exact_creep`
prepares the grid, describes the discretisation and finds the traction; all quantities here are
dimensionless (G = mu N = sqrt(a b) = 1).

Sources: Kalker, J.J. (1990), Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer, ch. 4
(the discrete problem); Johnson, K.L. (1985), Contact Mechanics, Cambridge, sec. 3.6 (point force
along the surface).
"""

import math

import numpy as np

from . import compiled


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
