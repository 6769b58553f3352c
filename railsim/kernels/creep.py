"""All creep laws behind one call, chosen by number, and friction that falls with slip.

The time loop calls `creep_forces` with the arrays of all patches; the branch on the law is outside
every loop.
"""

import math

from . import jit
from .creep_laws import fastrip, linear_saturated, polach
from .creep_table import table_forces
from .fastsim import fastsim

FASTSIM, TABLE, FASTRIP, POLACH, LINEAR = 0, 1, 2, 3, 4
LAW_NUMBERS = {
    "fastsim": FASTSIM,
    "table": TABLE,
    "fastrip": FASTRIP,
    "polach": POLACH,
    "linear": LINEAR,
}


@jit
def falling_friction(n, mu_N, xi_x, xi_y, speed, rest, decay):
    """Reduce the friction of n patches with the slip velocity (Polach 2005).

    mu(w) = mu_0 ((1 - A) exp(-B w) + A), w = speed sqrt(xi_x^2 + xi_y^2).

    Parameters
    ----------
    n : int
        Number of patches.
    mu_N : ndarray, shape (>= n,), changed
        Friction coefficient times normal force, on return at the patch's slip [N].
    xi_x, xi_y : ndarray, shape (>= n,)
        Creepages of the patch's centre [1].
    speed : ndarray, shape (>= n,)
        Speed along the rail that the creepages refer to [m/s].
    rest : float
        A: friction at very large slip over that at rest, 0..1 [1].
    decay : float
        B >= 0 [s/m].

    Notes
    -----
    Source: Polach, O. (2005), Wear 258, 992-1000, eq. 10; dry rail A = 0.4, B = 0.6 s/m.
    """
    for i in range(n):
        slip = speed[i] * math.sqrt(xi_x[i] * xi_x[i] + xi_y[i] * xi_y[i])
        mu_N[i] *= (1.0 - rest) * math.exp(-decay * slip) + rest


@jit
def creep_forces(
    law, n, nx, ny, a, b, mu_N, c11, c22, c23, c33, G, k_adhesion, k_slip, xi_x, xi_y, phi,
    table, scale, offsets, work, T_x, T_y, M_z, outside,
):  # fmt: skip
    """Tangential forces on the rail of n patches by the law of that number.

    Parameters
    ----------
    law : int
        One of `LAW_NUMBERS`.
    k_adhesion : float
        Third-body reduction of Kalker's coefficients, 0 < k <= 1; as every law contains them only
        in the product with G, it reduces G [1].
    k_slip : float
        The further factor of Polach's law for the slip area, <= k_adhesion [1].
    table, scale : ndarray
        The table (`railsim.contact.creep_table`); for other laws arrays of no size will do.
    offsets : ndarray of int64, shape (16,)
        Scratch of the table's look-up.

    outside : ndarray, shape (>= n,)
        Written by `table` only: 1 where a loaded patch is outside the law's range (a/b beyond
        1/20..20), else 0.

    Others as in `railsim.kernels.fastsim.fastsim`.
    """
    if law == FASTSIM:
        fastsim(n, nx, ny, a, b, mu_N, c11, c22, c23, k_adhesion * G, xi_x, xi_y, phi, work,
                T_x, T_y, M_z)  # fmt: skip
    elif law == TABLE:
        table_forces(n, a, b, mu_N, k_adhesion * G, xi_x, xi_y, phi, table, scale, offsets, work,
                     T_x, T_y, M_z, outside)  # fmt: skip
    elif law == FASTRIP:
        fastrip(n, nx, ny, a, b, mu_N, c11, c22, c23, k_adhesion * G, xi_x, xi_y, phi, work,
                T_x, T_y, M_z)  # fmt: skip
    elif law == POLACH:
        polach(n, a, b, mu_N, c11, c22, c23, G, k_adhesion, k_slip, xi_x, xi_y, phi,
               T_x, T_y, M_z)  # fmt: skip
    else:
        linear_saturated(n, a, b, mu_N, c11, c22, c23, c33, k_adhesion * G, xi_x, xi_y, phi,
                         T_x, T_y, M_z)  # fmt: skip
