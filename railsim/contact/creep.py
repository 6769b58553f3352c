"""Creep forces of elliptic contact patches: one function in front of all laws.

The tangential force between wheel and rail follows from the creepages (the relative velocity of
the two surfaces over the speed of travel), the contact ellipse and friction.  Signs: creepages
are wheel minus rail in the contact frame (x forward, t to the right, n into the rail), the force
is that on the *rail* and has the sign of the creepage.

The laws and what is known of each stand in `railsim.definitions.creep_law.CREEP_LAWS`.

`creep_force` is for scripts, plots and tests; the time loop calls the kernel
:func:`railsim.kernels.creep.creep_forces` on its own arrays.  docs/theory/creep.md describes the
laws, docs/validation/creep.md says how good they are.
"""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.contact.creep_table import NO_TABLE, creep_table
from railsim.contact.kalker import kalker_coefficients
from railsim.definitions.creep_law import CREEP_LAWS, CreepLawName
from railsim.errors import Fault, Faults, ModelError, input_error, nearest
from railsim.kernels.alignment import aligned_zeros
from railsim.kernels.creep import creep_forces, reduce_friction
from railsim.kernels.fastsim import fastsim_workspace
from railsim.kernels.patches import CreepLaw, CreepScratch, Patches

LAWS = tuple(name for name, law in CREEP_LAWS.items() if not law.measured)
"""Names of the creep laws that need no curve of the user's own."""


class CreepForce(NamedTuple):
    """Tangential contact force on the rail.

    Attributes
    ----------
    T_x, T_y : ndarray
        Force along x and t on the rail [N].
    M_z : ndarray
        Moment about the contact normal at the patch's centre, on the rail [N m].
    """

    T_x: Floats
    T_y: Floats
    M_z: Floats


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
    *,
    reduction: float = 1.0,
    slip_reduction: float | None = None,
    friction_rest: float = 1.0,
    friction_decay: float = 0.0,
    speed: float = 0.0,
    adhesion_curve: ArrayLike | None = None,
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
        Poisson's ratio of wheel and rail [1].
    law : str
        One of `LAWS`.
    nx, ny : int
        Cells along and strips across the patch, where the law has them (`fastsim`, `fastrip`).
    reduction : float
        Third-body reduction of Kalker's coefficients, 0 < k <= 1 [1].
    slip_reduction : float, optional
        Polach's factor for the slip area, by default equal to `reduction` [1].
    friction_rest : float
        Friction falling with the slip velocity w = speed |xi|:
        mu(w) = mu ((1 - rest) exp(-decay w) + rest) [1].
    friction_decay : float
        The decay in it [s/m].
    speed : float
        Speed of travel, for falling friction [m/s].

    Returns
    -------
    CreepForce
        T_x, T_y [N] and M_z [N m] on the rail; shape: that of the inputs broadcast.

    Warns
    -----
    UserWarning
        If patches lie outside the range of `table` (a/b beyond 1/20..20): they get the force of
        the nearest ratio.

    Raises
    ------
    InputError
        If the law is unknown, nx or ny is not at least 1, or an option is out of its range.
    ModelError
        If N or mu is negative, a semi-axis of a loaded patch is not positive, or an input is not
        finite.

    Examples
    --------
    >>> T = creep_force(a=6e-3, b=6e-3, N=80e3, mu=0.3, xi_x=0.001, xi_y=0.0, phi=0.0)
    >>> bool(0.0 < T.T_x < 0.3 * 80e3) and bool(T.T_y == 0.0)
    True
    """
    if law not in CREEP_LAWS:
        raise input_error("creep_force", f"'{law}'", nearest(law, CREEP_LAWS), "law")
    name: CreepLawName = law
    k_slip = reduction if slip_reduction is None else slip_reduction
    ranges = {
        "nx, ny": (nx >= 1 and ny >= 1, f"{nx}, {ny}", "at least 1 cell"),
        "reduction": (0.0 < reduction <= 1.0, f"{reduction}", "above 0, at most 1"),
        "slip_reduction": (0.0 < k_slip <= reduction, f"{k_slip}", "above 0, at most reduction"),
        "friction_rest": (0.0 <= friction_rest <= 1.0, f"{friction_rest}", "0 to 1"),
        "friction_decay": (friction_decay >= 0.0, f"{friction_decay}", "at least 0"),
        "adhesion_curve": (
            (adhesion_curve is not None) == CREEP_LAWS[name].measured,
            "none" if adhesion_curve is None else f"together with the law '{law}'",
            "rows [creepage, T/(mu N)] with the law 'adhesion_curve' and only with it",
        ),
    }
    Faults(
        Fault("creep_force", key, found, allowed)
        for key, (fine, found, allowed) in ranges.items()
        if not fine
    ).check()
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
    n = semi_a.size
    patches = Patches(
        semi_a,
        semi_b,
        friction * normal,
        *kalker_coefficients(semi_a / semi_b, nu),
        *creepages,
        *np.zeros((4, n)),
    )
    if friction_rest < 1.0:
        reduce_friction(n, patches, np.full(n, speed), friction_rest, friction_decay)
    chosen = creep_law(name, (nx, ny), G, nu, (reduction, k_slip), adhesion_curve)
    creep_forces(n, chosen, patches, creep_scratch(n, chosen))
    outside = int(patches.outside.sum())
    if outside:
        ratio = CREEP_LAWS[name].ratio
        warnings.warn(
            f"creep law '{law}': {outside} of {n} patches have a/b outside 1/{ratio:g} to "
            f"{ratio:g} and got the force of the nearest ratio",
            stacklevel=2,
        )
    return CreepForce(*(force.reshape(shape) for force in (patches.T_x, patches.T_y, patches.M_z)))


def creep_law(
    name: CreepLawName,
    grid: tuple[int, int],
    G: float,
    nu: float,
    third_body: tuple[float, float] = (1.0, 1.0),
    adhesion_curve: ArrayLike | None = None,
) -> CreepLaw:
    """Creep law as the kernels take it, with its table or curve.

    `name`: one of `railsim.definitions.creep_law.CREEP_LAWS`; `grid`: cells of a patch along and
    across; `G`, `nu`: shear modulus [Pa], Poisson's ratio [1]; `third_body`: reduction of Kalker's
    coefficients, and Polach's further factor for the area of slip [1]; `adhesion_curve`, shape (k,
    2): creepage and T/(mu N) [1].
    """
    table = creep_table(nu) if name == "table" else NO_TABLE
    curve = np.zeros((0, 2)) if adhesion_curve is None else np.array(adhesion_curve, dtype=float)
    number, data = CREEP_LAWS[name].number, (table.coefficients, table.scale, curve)
    return CreepLaw(number, *grid, G, *third_body, *data, user_law=0, block=np.zeros(0))


def creep_scratch(n: int, law: CreepLaw) -> CreepScratch:
    """Work arrays of a creep law for up to n patches."""
    return CreepScratch(fastsim_workspace(n, law.n_y, law.n_x), aligned_zeros(16, np.int64))
