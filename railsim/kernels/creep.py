"""All creep laws behind one call, chosen by number, and friction that falls with slip.

The time loop calls `creep_forces` with the arrays of all patches; the branch on the law is outside
every loop.
"""

import math

from . import compiled
from .creep_laws import adhesion_curve, fastrip, linear_saturated, polach
from .creep_table import table_forces
from .fastsim import fastsim
from .user_laws import user_creep_law

# numbers of the laws, as in `railsim.definitions.creep_law.CREEP_LAWS`
FASTSIM, TABLE, FASTRIP, POLACH, LINEAR, ADHESION_CURVE = range(6)
USER = -1


@compiled
def reduce_friction(n, patches, speed, A, B):
    """Reduce the friction of n patches with the slip velocity (Polach 2005).

    mu(w) = mu_0 ((1 - A) exp(-B w) + A), w = speed sqrt(xi_x^2 + xi_y^2).

    Parameters
    ----------
    n : int
        Number of patches.
    patches : Patches
        Read: creepages; changed: mu_N, on return that at the patch's slip.
    speed : ndarray, shape (>= n,)
        Speed along the rail that the creepages refer to [m/s].
    A : float
        Friction at very large slip over that at rest, 0..1 [1].
    B : float
        At least 0 [s/m].

    Notes
    -----
    Source: Polach, O. (2005), Wear 258, 992-1000, eq. 10; dry rail A = 0.4, B = 0.6 s/m.
    """
    mu_N, xi_x, xi_y = patches.mu_N, patches.xi_x, patches.xi_y
    for i in range(n):
        slip = speed[i] * math.sqrt(xi_x[i] * xi_x[i] + xi_y[i] * xi_y[i])
        mu_N[i] *= (1.0 - A) * math.exp(-B * slip) + A


@compiled
def creep_forces(n, law, patches, scratch):
    """Tangential forces on the rail of n patches.

    Parameters
    ----------
    n : int
        Number of patches; may be 0.
    law : CreepLaw
        Which law, and its data.
    patches : Patches
        Forces and moments are written.
    scratch : CreepScratch
        Work arrays for the law's cells and at least n patches.
    """
    G = law.k_adhesion * law.G
    if law.number == FASTSIM:
        fastsim(n, law.n_x, law.n_y, patches, G, scratch.strips)
    elif law.number == TABLE:
        table_forces(n, patches, G, law.table, law.scale, scratch)
    elif law.number == FASTRIP:
        fastrip(n, law.n_x, law.n_y, patches, G, scratch.strips)
    elif law.number == POLACH:
        polach(n, patches, law.G, law.k_adhesion, law.k_slip)
    elif law.number == LINEAR:
        linear_saturated(n, patches, G)
    elif law.number == ADHESION_CURVE:
        adhesion_curve(n, patches, law.curve)
    else:
        user_creep_law(n, patches, law, G)
