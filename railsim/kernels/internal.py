"""Internal states of elements: Maxwell dampers, friction pads, the reservoir of an air spring.

Each state x has a drive, left by the element that owns it, and a law:

MAXWELL        force of a damper c with a series stiffness k_s, F' = k_s (v - F/c); exact over a
               step at constant v: F <- F e^(-h/tau) + c (1 - e^(-h/tau)) v, tau = c/k_s
               (Maxwell 1867)
MAXWELL_CURVE  the same with a force-velocity table F_d(v); relaxes to F_d(v) with the table's
               slope at the present force as c: F' = (F_d(v) - F) k_s/c(F)
PAD            force of a friction pad that sticks elastically and slides at a limit,
               F' = k_t v, |F| <= F_max (Masing 1926): no creep at rest, loss = work of sliding
AIR            deflection w of the reservoir, c w' = k_1 (z - w) - k_2 w (Nishimura 1984); exact
               over a step at constant z
"""

from math import exp
from typing import NamedTuple

import numpy as np

from railsim.kernels import jit

MAXWELL, MAXWELL_CURVE, PAD, AIR = range(4)


class Internal(NamedTuple):
    """Laws of the internal states.

    Attributes
    ----------
    kind : int64[m]
    parameter : float64[m, 3]  MAXWELL: c, k_s; MAXWELL_CURVE: -, k_s; PAD: k_t; AIR: k_1, k_2, c
    curve : int64[m]           force-velocity table of MAXWELL_CURVE, else -1
    """

    kind: np.ndarray
    parameter: np.ndarray
    curve: np.ndarray


@jit
def curve_value(curves, index, x):
    """Piecewise linear table, continued linearly beyond its ends."""
    first = curves.start[index]
    last = curves.start[index + 1] - 2
    i = first
    while i < last and x > curves.x[i + 1]:
        i += 1
    slope = (curves.f[i + 1] - curves.f[i]) / (curves.x[i + 1] - curves.x[i])
    return curves.f[i] + slope * (x - curves.x[i])


@jit
def curve_slope_at_value(curves, index, f):
    """Slope of a rising table where it takes the value `f`."""
    first = curves.start[index]
    last = curves.start[index + 1] - 2
    i = first
    while i < last and f > curves.f[i + 1]:
        i += 1
    return (curves.f[i + 1] - curves.f[i]) / (curves.x[i + 1] - curves.x[i])


@jit
def relaxation_time(internal, curves, i, x):
    """Time constant of state `i` at its value `x`, 0 for a pad [s]."""
    p = internal.parameter
    if internal.kind[i] == MAXWELL:
        return p[i, 0] / p[i, 1]
    if internal.kind[i] == MAXWELL_CURVE:
        return curve_slope_at_value(curves, internal.curve[i], x) / p[i, 1]
    if internal.kind[i] == AIR:
        return p[i, 2] / (p[i, 0] + p[i, 1])
    return 0.0


@jit
def steady_value(internal, curves, i, drive):
    """Value to which state `i` relaxes at a constant drive."""
    p = internal.parameter
    if internal.kind[i] == MAXWELL:
        return p[i, 0] * drive
    if internal.kind[i] == MAXWELL_CURVE:
        return curve_value(curves, internal.curve[i], drive)
    return p[i, 0] * drive / (p[i, 0] + p[i, 1])


@jit
def internal_rate(internal, curves, i, x, drive, limit):
    """Time derivative of state `i`."""
    if internal.kind[i] == PAD:
        rate = internal.parameter[i, 0] * drive
        sliding = (x >= limit and rate > 0.0) or (x <= -limit and rate < 0.0)
        return 0.0 if sliding else rate
    return ((steady_value(internal, curves, i, drive) - x)
            / relaxation_time(internal, curves, i, x))


@jit
def constant_decays(internal, curves, h, decay):
    """e^(-h/tau) of the states whose time constant never changes, -1 for the others."""
    for i in range(internal.kind.shape[0]):
        if internal.kind[i] == MAXWELL or internal.kind[i] == AIR:
            decay[i] = exp(-h / relaxation_time(internal, curves, i, 0.0))
        else:
            decay[i] = -1.0


@jit
def advanced(internal, curves, i, x, drive, limit, h, decay):
    """State `i` after a step `h` at constant drive."""
    if internal.kind[i] == PAD:
        return min(limit, max(-limit, x + h * internal.parameter[i, 0] * drive))
    if decay < 0.0:
        tau = relaxation_time(internal, curves, i, x)
        decay = exp(-h / tau) if tau > 0.0 else 0.0
    end = steady_value(internal, curves, i, drive)
    return end + (x - end) * decay
