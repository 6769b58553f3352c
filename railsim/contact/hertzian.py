"""Elliptic Hertz contact for arrays of contacts.

Assumptions: smooth frictionless bodies of one material, patch small against the radii, relative
curvatures constant over the patch and positive.  Wheel and rail in `railsim` leave that range in
the flange root; the contact table says what it does there (`railsim.contact.table`).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.errors import ModelError
from railsim.kernels.hertz import fill_ellipses


class HertzContact(NamedTuple):
    """Solution of one or many Hertz contacts.

    Attributes
    ----------
    a, b : float or ndarray
        Semi-axes along (direction of A) and across (direction of B) [m].
    approach : float or ndarray
        Approach of two distant points of the bodies [m].
    p_max : float or ndarray
        Greatest pressure, 3 N/(2 pi a b) [Pa].
    """

    a: Floats
    b: Floats
    approach: Floats
    p_max: Floats


def hertz(A: ArrayLike, B: ArrayLike, N: ArrayLike, E: float, nu: float) -> HertzContact:
    """Hertz contact of two bodies of the same material.

    The undeformed bodies are A x^2 + B y^2 apart.

    Parameters
    ----------
    A, B : float or ndarray
        Half the relative curvatures along and across, A, B > 0 [1/m]: for a wheel of effective
        rolling radius R on a straight rail A = 1/(2 R).
    N : float or ndarray
        Normal force, N >= 0 [N]; broadcast against `A` and `B`.
    E : float
        Young's modulus of both bodies [Pa].
    nu : float
        Poisson's ratio of both bodies [1].

    Returns
    -------
    HertzContact
        `a`, `b`, `approach`, `p_max`; floats where everything that came in was a float.

    Raises
    ------
    ModelError
        If a curvature is not positive and finite (conformal contact: no ellipse exists), a force
        is negative, or the material is not elastic.

    Notes
    -----
    Exact to round-off (about 1e-13).  Source: Johnson, Contact Mechanics (1985), eq. 4.26.

    Examples
    --------
    >>> contact = hertz(1 / (2 * 0.46), 1 / (2 * 0.3), 60e3, 2 * 82e9 * 1.28, 0.28)
    >>> round(1e3 * contact.a, 4), round(1e3 * contact.b, 4)
    (6.0667, 4.5635)
    """
    shaped_A, shaped_B, shaped_N = np.broadcast_arrays(
        *(np.asarray(value, dtype=np.float64) for value in (A, B, N))
    )
    if not (np.all(shaped_A > 0) and np.all(shaped_B > 0)):
        raise ModelError("Hertz contact needs A > 0 and B > 0; conformal contact has no ellipse")
    if not (np.all(np.isfinite(shaped_A)) and np.all(np.isfinite(shaped_B))):
        raise ModelError("Hertz contact needs finite curvatures")
    if not (np.all(shaped_N >= 0) and np.all(np.isfinite(shaped_N))):
        raise ModelError("Hertz contact needs finite forces N >= 0")
    if not (E > 0 and -1.0 < nu <= 0.5):
        raise ModelError(f"no elastic material: E = {E} Pa, nu = {nu}")
    E_star = E / (2.0 * (1.0 - nu * nu))
    root = np.cbrt(shaped_N)
    a1, b1, d1 = (np.empty(root.shape) for _ in range(3))
    flat = (one.ravel() for one in (a1, b1, d1))
    fill_ellipses(shaped_A.flatten(), shaped_B.flatten(), E_star, *flat)
    a, b, approach = a1 * root, b1 * root, d1 * root**2
    p_max = 1.5 * root / (np.pi * (a1 * b1))
    if root.ndim == 0:
        return HertzContact(*(float(x) for x in (a, b, approach, p_max)))  # type: ignore[arg-type]
    return HertzContact(a, b, approach, p_max)
