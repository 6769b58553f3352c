"""Frictionless normal contact of two elastic half-spaces by boundary elements, for checks offline.

Rectangular elements of constant pressure in rows along the rolling direction; the solution is
symmetric fore and aft, so that only the front half is solved for.

Sources: A. E. H. Love (1929), influence of a uniformly loaded rectangle (K. L. Johnson, Contact
Mechanics (1985), eq. 3.25); I. A. Polonsky and L. M. Keer (1999), conjugate gradients with contact
and complementarity conditions, here for a prescribed approach.
"""

import math

import numpy as np

from railsim.kernels import compiled

CONVERGED, NOT_CONVERGED = range(2)


@compiled(in_loop=False)
def _corner(x, y):
    """Integral of 1/r over a rectangle, at one corner."""
    r = math.sqrt(x * x + y * y)
    total = 0.0
    if x != 0.0:
        total += x * math.log((y + r) / abs(x))
    if y != 0.0:
        total += y * math.log((x + r) / abs(y))
    return total


@compiled(in_loop=False)
def influence(n_x, n_s, dx, ds, E_star):
    """Displacement at the distance (i, j) of an element under unit pressure [m/Pa].

    Parameters
    ----------
    n_x, n_s : int
        Largest distances in elements.
    dx, ds : float
        Size of the elements [m].
    E_star : float
        Equivalent modulus, of both bodies together [Pa].

    Returns
    -------
    ndarray, shape (n_x + 1, n_s + 1)
    """
    table = np.empty((n_x + 1, n_s + 1))
    for i in range(n_x + 1):
        for j in range(n_s + 1):
            x0, x1 = (i - 0.5) * dx, (i + 0.5) * dx
            y0, y1 = (j - 0.5) * ds, (j + 0.5) * ds
            # in the quadrant of positive coordinates, with the parts of an element beyond an axis
            table[i, j] = (
                _signed(x1, y1) - _signed(x0, y1) - _signed(x1, y0) + _signed(x0, y0)
            ) / (math.pi * E_star)
    return table


@compiled(in_loop=False)
def _signed(x, y):
    """Integral of 1/r from 0 to x and 0 to y, odd in both."""
    return math.copysign(1.0, x) * math.copysign(1.0, y) * _corner(abs(x), abs(y))


@compiled(in_loop=False)
def pressure(gap, column, row, table, tolerance, p):
    """Pressure that lifts the overlap of two half-spaces.

    Parameters
    ----------
    gap : ndarray, shape (n,)
        Undeformed normal gap at the elements' centres, negative where the bodies overlap [m].
    column, row : ndarray of int, shape (n,)
        Indices of each element: rows run along the rolling direction; row 0 is the first one ahead
        of the middle, and each row has a mirror image behind it.
    table : ndarray, shape (n_x, n_s)
        Influence over the distances in x (at least 2 n_row) and s.
    tolerance : float
        Largest remaining gap in contact [m].
    p : ndarray, shape (n,)
        Pressure: start on entry, solution on return [Pa].

    Returns
    -------
    int
        CONVERGED or NOT_CONVERGED after 500 iterations.
    """
    n = gap.size
    g = np.empty(n)
    t = np.zeros(n)
    r = np.empty(n)
    last = 1.0
    keep = 0.0
    for _ in range(500):
        _displace(p, column, row, table, g)
        worst = 0.0
        size = 0.0
        for k in range(n):
            g[k] += gap[k]
            if p[k] > 0.0:
                worst = max(worst, abs(g[k]))
                size += g[k] * g[k]
            else:
                worst = max(worst, -g[k])
        if worst < tolerance:
            return CONVERGED
        for k in range(n):
            t[k] = g[k] + keep * size / last * t[k] if p[k] > 0.0 else 0.0
        last = max(size, 1e-300)
        _displace(t, column, row, table, r)
        above = below = 0.0
        for k in range(n):
            if p[k] > 0.0:
                above += g[k] * t[k]
                below += r[k] * t[k]
        step = above / below if below > 0.0 else 1.0 / table[0, 0]
        keep = 1.0
        for k in range(n):
            if p[k] > 0.0:
                p[k] = max(p[k] - step * t[k], 0.0)
            elif g[k] < 0.0:
                p[k] = -step * g[k]
                keep = 0.0  # the set of contacting elements grew: a new start
    return NOT_CONVERGED


@compiled(in_loop=False)
def _displace(p, column, row, table, u):
    """Displacements under pressures, mirror images included."""
    n = p.size
    for k in range(n):
        u[k] = 0.0
    for k in range(n):
        if p[k] == 0.0:
            continue
        for m in range(n):
            j = abs(column[m] - column[k])
            u[m] += p[k] * (table[abs(row[m] - row[k]), j] + table[row[m] + row[k] + 1, j])
