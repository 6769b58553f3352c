"""Contact patches side by side, and what the creep laws need beside them.

Arguments are grouped by how long they live: `Patches` change with every evaluation, a `CreepLaw` is
that of a model, `CreepScratch` is allocated once with the work arrays.
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.contact_columns import (
    BEYOND,
    C11,
    C22,
    C23,
    C33,
    M_Z,
    MU_N,
    PHI,
    T_X,
    T_Y,
    XI_X,
    XI_Y,
    A,
    B,
)
from railsim.kernels.record import record


class Patches(NamedTuple):
    """Arrays of length n, one number for each patch; frame and signs as in the manual.

    The contact frame is x forward, t to the right, n into the rail; creepages are wheel minus rail,
    forces are those on the rail and have the sign of the creepage.

    Attributes
    ----------
    a, b : semi-axes along and across the rolling direction [m]
    mu_N : friction coefficient times normal force; where it or a semi-axis is not positive the
           force is zero [N]
    c11, c22, c23, c33 : Kalker's coefficients [1]
    xi_x, xi_y, phi : creepages and spin [1, 1, 1/m]
    T_x, T_y, M_z : written: force on the rail, moment about n at the patch's centre [N, N, N m]
    outside : written by the laws with a table: 1 where a loaded patch is beyond it, else 0
    """

    a: np.ndarray
    b: np.ndarray
    mu_N: np.ndarray
    c11: np.ndarray
    c22: np.ndarray
    c23: np.ndarray
    c33: np.ndarray
    xi_x: np.ndarray
    xi_y: np.ndarray
    phi: np.ndarray
    T_x: np.ndarray
    T_y: np.ndarray
    M_z: np.ndarray
    outside: np.ndarray


@record
class CreepLaw(NamedTuple):
    """Which creep law, with its grid, its material and its data.

    Attributes
    ----------
    number : int         FASTSIM, TABLE, ... of `creep`
    n_x, n_y : int       cells of a patch along and across, of the laws that have them
    G : float            shear modulus [Pa]
    k_adhesion : float   third-body reduction of Kalker's coefficients, 0 < k <= 1; as the laws
                         contain them only in the product with G, it reduces G [1]
    k_slip : float       the further factor of Polach's law for the area of slip, <= k_adhesion [1]
    table : float32[], scale : float64[k, 4]   table of the full theory
                         (`railsim.contact.creep_table`); else empty
    curve : float64[k, 2]   measured adhesion curve: creepage, T/(mu N) [1]; else empty
    user_law : int       address of a law of one's own, else 0
    block : float64[...]    its block, see `user_laws`
    """

    number: int
    n_x: int
    n_y: int
    G: float
    k_adhesion: float
    k_slip: float
    table: np.ndarray
    scale: np.ndarray
    curve: np.ndarray
    user_law: int
    block: np.ndarray


@record
class CreepScratch(NamedTuple):
    """Work arrays of the creep laws.

    Attributes
    ----------
    strips : float64[WORK_ROWS, ...]   from `fastsim.fastsim_workspace`, for the law's cells
    offsets : int64[16]                of the table's look-up
    """

    strips: np.ndarray
    offsets: np.ndarray


@compiled(python=False)
def patch_arrays(patch):
    """Return the arrays of `Work.patch` that the creep laws take."""
    return Patches(
        patch[A], patch[B], patch[MU_N], patch[C11], patch[C22], patch[C23], patch[C33],
        patch[XI_X], patch[XI_Y], patch[PHI], patch[T_X], patch[T_Y], patch[M_Z], patch[BEYOND],
    )  # fmt: skip
