"""A named system of ordinary differential equations, and its linearisation.

Eigenmodes, root loci and the search for a Hopf bifurcation know nothing of vehicles: they take any
x' = f(x, p) whose coordinates have names.  The parameter p is the speed in most uses.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railsim.errors import ModelError

Floats = NDArray[np.float64]
Rate = Callable[[Floats, float], Floats]


@dataclass(frozen=True)
class NamedSystem:
    """Ordinary differential equations x' = f(x, p).

    Attributes
    ----------
    names : tuple of str
        Names of the coordinates.
    rate : callable
        f(x, p), float64[n] and a number to float64[n].
    equilibrium : callable
        p to the state x0 with f(x0, p) = 0.
    steps : float64[n]
        Steps of the difference quotients, small against what the coordinate does.
    """

    names: tuple[str, ...]
    rate: Rate
    equilibrium: Callable[[float], Floats]
    steps: Floats


@dataclass(frozen=True)
class Linearisation:
    """x' = A x about an equilibrium.

    Attributes
    ----------
    names : tuple of str
        Names of the coordinates.
    matrix : float64[n, n]
        A = df/dx [1/s and mixed units].
    state : float64[n]
        Where it was formed.
    parameter : float
        Value of the parameter, mostly the speed [m/s].
    """

    names: tuple[str, ...]
    matrix: Floats
    state: Floats
    parameter: float


def linearise(system: NamedSystem, parameter: float) -> Linearisation:
    """Linearise a system about its equilibrium.

    Parameters
    ----------
    system : NamedSystem
    parameter : float
        Value of the parameter, mostly the speed [m/s].

    Raises
    ------
    ModelError
        The derivative is not finite.
    """
    state = system.equilibrium(parameter)
    matrix = jacobian(lambda x: system.rate(x, parameter), state, system.steps)
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise ModelError(
            f"no linearisation: d({system.names[row]})'/d({system.names[column]}) is not finite"
        )
    return Linearisation(system.names, matrix, state, parameter)


def jacobian(function: Callable[[Floats], Floats], state: Floats, steps: Floats) -> Floats:
    """Jacobian by central differences.

    Parameters
    ----------
    function : callable
        float64[n] to float64[m].
    state, steps : float64[n]
        Where, and with which steps.

    Returns
    -------
    float64[m, n]

    Examples
    --------
    >>> jacobian(lambda x: np.array([x[0] * x[1]]), np.array([2.0, 3.0]), np.full(2, 1e-3))
    array([[3., 2.]])
    """
    return jacobian_of_rows(
        lambda rows: np.array([function(row) for row in rows]), state, np.asarray(steps)
    )


def jacobian_of_rows(function: Callable[[Floats], Floats], state: Floats, steps: Floats) -> Floats:
    """As `jacobian`, of a function that takes many states at once.

    Parameters
    ----------
    function : callable
        float64[k, n] to float64[k, m].
    """
    ahead, behind = (function(state + sign * np.diag(steps)) for sign in (1.0, -1.0))
    return np.asarray(((ahead - behind) / (2.0 * steps[:, None])).T)
