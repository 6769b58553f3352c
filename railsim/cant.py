"""Cant, cant deficiency and the speed in a curve: V^2 kappa = g (cant + deficiency)/(2 b_0)."""

import math

from railsim.constants import CANT_BASE, GRAVITY


def cant_deficiency(speed: float, curvature: float, cant: float) -> float:
    """Return the cant deficiency, 2 b_0 V^2 kappa/g - cant [m].

    `speed`: [m/s]. `curvature`, `cant`: Signed [1/m], [m]: with a curvature positive to the right
    and a cant positive where the left rail is higher the deficiency is positive towards the left
    rail; with the magnitude of the curvature and the cant of its outer rail it is positive towards
    the outer rail.

    >>> round(cant_deficiency(20.0, 1.0 / 250.0, 0.15), 4)
    0.0946
    """
    return CANT_BASE * speed**2 * curvature / GRAVITY - cant


def curve_speed(radius: float, height: float) -> float:
    """Return the speed at which cant and cant deficiency together are `height`.

    `radius`: Of either sign [m]. `height`: Cant of the outer rail plus cant deficiency, 2 b_0
    V^2/(g R) [m]. Returns: [m/s]; nan for a negative height.

    >>> round(curve_speed(250.0, 0.15), 2)
    15.66
    """
    return math.sqrt(GRAVITY * abs(radius) * height / CANT_BASE) if height >= 0.0 else math.nan
