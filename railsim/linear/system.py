"""Linearisation of a system x' = f(x, p) whose coordinates have names.

Eigenmodes, root loci and the search for a Hopf bifurcation know nothing of vehicles.  The parameter
p is the speed in most uses.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats, Integers


@dataclass(frozen=True)
class Linearisation:
    """x' = A x about an equilibrium."""

    names: tuple[str, ...]  # of the coordinates
    matrix: Floats  # A = df/dx [1/s and mixed units]
    state: Floats  # where it was formed
    parameter: float  # mostly the speed [m/s]


def jacobian(function: Callable[[Floats], Floats], state: Floats, steps: Floats) -> Floats:
    """Jacobian float64[m, n] by central differences.

    `function`: of many states at once, float64[k, n] to float64[k, m]; `state`, `steps`: where, and
    with which steps.

    >>> product = lambda rows: rows[:, :1] * rows[:, 1:]
    >>> jacobian(product, np.array([2.0, 3.0]), np.full(2, 1e-3))
    array([[3., 2.]])
    """
    ahead, behind = (function(state + sign * np.diag(steps)) for sign in (1.0, -1.0))
    return np.asarray(((ahead - behind) / (2.0 * steps[:, None])).T)


def without_forceless(matrix: Floats, w: Integers) -> Floats:
    """Eliminate the rates `w` of rails without mass, which follow from the balance of forces.

    A rate stands in the equation of its displacement as well as in all others; further rows are
    outputs, further columns inputs.
    """
    if not len(w):
        return matrix
    y, columns = (np.setdiff1d(np.arange(size), w) for size in matrix.shape)
    solved = np.linalg.solve(matrix[np.ix_(w, w)], matrix[np.ix_(w, columns)])
    return np.asarray(matrix[np.ix_(y, columns)] - matrix[np.ix_(y, w)] @ solved)
