"""Creep forces of elliptic contact patches: one function in front of all laws.

The tangential force between wheel and rail follows from the creepages (the relative velocity of
the two surfaces over the speed of travel), the contact ellipse and friction.  Signs: creepages
are wheel minus rail in the contact frame (x forward, t to the right, n into the rail), the force
is that on the *rail* and has the sign of the creepage.

`creep_force` is for scripts, plots and tests; the time loop calls the kernels
(:mod:`railsim.kernels.fastsim` and its neighbours) on its own arrays.  The laws are described in
docs/theory/creep.md.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railsim.contact.kalker import kalker_coefficients
from railsim.errors import Fault, InputError, ModelError, nearest
from railsim.kernels.fastsim import fastsim, fastsim_workspace

Array = NDArray[np.float64]

LAWS: dict[str, Callable[..., None]] = {"fastsim": fastsim}


class CreepForce(NamedTuple):
    """Tangential contact force on the rail.

    Attributes
    ----------
    T_x, T_y : ndarray
        Force along x and t on the rail [N].
    M_z : ndarray
        Moment about the contact normal at the patch's centre, on the rail [N m].
    """

    T_x: Array
    T_y: Array
    M_z: Array


def creep_force(
    a: ArrayLike,
    b: ArrayLike,
    N: ArrayLike,
    mu: ArrayLike,
    xi_x: ArrayLike,
    xi_y: ArrayLike,
    phi: ArrayLike,
    G: float = 82e9,
    nu: float = 0.28,
    law: str = "fastsim",
    nx: int = 10,
    ny: int = 10,
) -> CreepForce:
    """Creep force of elliptic contact patches by one of the laws.

    Parameters
    ----------
    a, b : array_like
        Semi-axes along and across the rolling direction [m].
    N : array_like
        Normal force, >= 0 [N]; 0 gives zero force for any semi-axes.
    mu : array_like
        Friction coefficient, >= 0 [1].
    xi_x, xi_y : array_like
        Longitudinal and lateral creepage, wheel minus rail [1].
    phi : array_like
        Spin creepage [1/m].
    G : float
        Shear modulus of wheel and rail [Pa].
    nu : float
        Poisson's number of wheel and rail [1].
    law : str
        One of `LAWS`.
    nx, ny : int
        Cells along and strips across the patch, where the law has them.

    Returns
    -------
    CreepForce
        T_x, T_y [N] and M_z [N m] on the rail; shape: that of the inputs broadcast.

    Raises
    ------
    InputError
        If the law is unknown or nx or ny is not at least 1.
    ModelError
        If N or mu is negative, a semi-axis of a loaded patch is not positive, or an input is not
        finite.

    Examples
    --------
    >>> T = creep_force(a=6e-3, b=6e-3, N=80e3, mu=0.3, xi_x=0.001, xi_y=0.0, phi=0.0)
    >>> bool(0.0 < T.T_x < 0.3 * 80e3) and bool(T.T_y == 0.0)
    True
    """
    if law not in LAWS:
        raise InputError([Fault("creep_force", "law", f"'{law}'", nearest(law, LAWS))])
    if nx < 1 or ny < 1:
        raise InputError([Fault("creep_force", "nx, ny", f"{nx}, {ny}", "at least 1 cell")])
    inputs = np.broadcast_arrays(a, b, N, mu, xi_x, xi_y, phi)
    shape = inputs[0].shape
    flat = [np.array(value, dtype=float).ravel() for value in inputs]
    if not all(np.isfinite(value).all() for value in flat):
        raise ModelError("creep force: every input must be finite")
    semi_a, semi_b, normal, friction, *creepages = flat
    if (normal < 0.0).any() or (friction < 0.0).any():
        raise ModelError("creep force: normal force and friction coefficient must not be negative")
    loaded = normal > 0.0
    if (semi_a[loaded] <= 0.0).any() or (semi_b[loaded] <= 0.0).any():
        raise ModelError("creep force: the semi-axes of a loaded patch must be positive")
    semi_a[~loaded] = 1.0
    semi_b[~loaded] = 1.0
    c11, c22, c23, _ = kalker_coefficients(semi_a / semi_b, nu)
    n = semi_a.size
    T_x, T_y, M_z = np.zeros(n), np.zeros(n), np.zeros(n)
    work = fastsim_workspace(n, ny, nx)
    LAWS[law](
        n, nx, ny, semi_a, semi_b, friction * normal, c11, c22, c23, G, *creepages, work,
        T_x, T_y, M_z,
    )  # fmt: skip
    return CreepForce(T_x.reshape(shape), T_y.reshape(shape), M_z.reshape(shape))
