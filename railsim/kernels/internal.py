"""Internal states of elements: Maxwell dampers, friction pads, the reservoir of an air spring.

Each state x has a drive, left by the element that owns it, and a law:

MAXWELL        force of a damper c with a series stiffness k_s, F' = k_s (v - F/c); exact over a
               step at constant v: F <- F e^(-h/tau) + c (1 - e^(-h/tau)) v, tau = c/k_s
               (Maxwell 1867)
MAXWELL_CURVE  the same with a force-velocity table F_d(u): F' = k_s (v - u), F = F_d(u); exact over
               a step at constant v, branch of the table by branch
PAD            force of a friction pad that sticks elastically and slides at a limit,
               F' = k_t v, |F| <= F_max (Masing 1926): no creep at rest, loss = work of sliding.
               States of a pad that slides in any direction follow each other; their forces over
               their limits, q, stay within |q| - e q_z = 1: a circle, of a wedge (e > 0) a conic
               with its focus at no force, see `elements`.  What slides, slides along the gradient
               of |q| over the forces: with equal limits along the force, else by the principle of
               greatest dissipation (Michalowski, Mroz 1978, Archives of Mechanics 30)
LAG            command u behind a first-order lag, x' = (u - x)/tau within +-r; exact over a step at
               constant u
USER           state of a law of one's own, whose rate is its drive; the trapezoidal rule
AIR            deflection w of the reservoir, c w' = k_1 (z - w) - k_2 w (Nishimura 1984); exact
               over a step at constant z
"""

from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.record import record

MAXWELL, MAXWELL_CURVE, PAD, AIR, LAG, USER = range(6)
MAX_RETURNS = 8  # iterations of `return_to_limit`
RETURN_TOLERANCE = 1e-12  # what is left beyond the limit, over it
MIN_LIMIT = 1e-6  # N; below it there is no friction


@record
class Internal(NamedTuple):
    """Laws of the internal states.

    Attributes
    ----------
    kind : int64[m]
    parameter : float64[m, 3]  MAXWELL: c, k_s; MAXWELL_CURVE: -, k_s; AIR: k_1, k_2, c;
                               PAD: k_t, 0 for a state alone, of several that slide together their
                               number in the last and 1 in the others, e in the last; LAG: tau
                               [s], r [1/s]
    curve : int64[m]           force-velocity table of MAXWELL_CURVE, else -1
    """

    kind: np.ndarray
    parameter: np.ndarray
    curve: np.ndarray


@compiled
def curve_value(curves, index, x):
    """Piecewise linear table, continued linearly beyond its ends."""
    first = curves.start[index]
    last = curves.start[index + 1] - 2
    i = first
    while i < last and x > curves.x[i + 1]:
        i += 1
    slope = (curves.f[i + 1] - curves.f[i]) / (curves.x[i + 1] - curves.x[i])
    return curves.f[i] + slope * (x - curves.x[i])


@compiled
def curve_speed(curves, index, f, v):
    """Speed at which a rising table has the value `f`; on a flat part the one nearest to `v`."""
    first = curves.start[index]
    last = curves.start[index + 1] - 2
    i = first
    while i < last and f > curves.f[i + 1]:
        i += 1
    j = i
    while j < last and f >= curves.f[j + 1]:
        j += 1
    # below branch i and above branch j the table goes on, or is flat and takes any speed
    slow = speed_on_branch(curves, i, f, -np.inf if i == first else curves.x[i])
    fast = speed_on_branch(curves, j, f, np.inf if j == last else curves.x[j + 1])
    return min(max(v, slow), fast)


@compiled(python=False)
def speed_on_branch(curves, i, f, flat):
    """Speed at which branch `i`, continued, has the value `f`; `flat` where it has no slope."""
    rise = curves.f[i + 1] - curves.f[i]
    if rise == 0.0:
        return flat
    return curves.x[i] + (f - curves.f[i]) * (curves.x[i + 1] - curves.x[i]) / rise


@compiled(python=False)
def curve_force_after(curves, index, k_s, f, v, h):
    """Force of a damper with the table `index` behind a spring `k_s` after a step at constant `v`.

    On each branch of slope c the force relaxes to that of the branch at `v` with tau = c/k_s; where
    it meets the branch's border, the rest of the step goes on from there.
    """
    first = curves.start[index]
    last = curves.start[index + 1] - 2
    target = curve_value(curves, index, v)
    rising = f < target
    i = first if rising else last
    while h > 0.0 and f != target:
        if rising:
            while i < last and f >= curves.f[i + 1]:
                i += 1
            border = np.inf if i == last else curves.f[i + 1]
        else:
            while i > first and f <= curves.f[i]:
                i -= 1
            border = -np.inf if i == first else curves.f[i]
        slope = (curves.f[i + 1] - curves.f[i]) / (curves.x[i + 1] - curves.x[i])
        end = curves.f[i] + slope * (v - curves.x[i])
        if slope == 0.0:
            f = border  # it lay beyond a table that ends flat
            continue
        tau = slope / k_s
        beyond = end > border if rising else end < border
        if not beyond:
            return end + (f - end) * exp(-h / tau)
        time = tau * log((end - f) / (end - border))
        if time >= h:
            return end + (f - end) * exp(-h / tau)
        h -= time
        f = border
    return f


@compiled(python=False)
def limit_to_curve(curves, index, f):
    """`f`, but not beyond the end of a table that is flat there."""
    first = curves.start[index]
    last = curves.start[index + 1] - 1
    if curves.f[last] == curves.f[last - 1]:
        f = min(f, curves.f[last])
    if curves.f[first] == curves.f[first + 1]:
        f = max(f, curves.f[first])
    return f


@compiled(python=False)
def relaxation_time(internal, i):
    """Time constant of state `i`, a linear one [s]."""
    p = internal.parameter
    if internal.kind[i] == MAXWELL:
        return p[i, 0] / p[i, 1]
    return p[i, 2] / (p[i, 0] + p[i, 1])


@compiled(python=False)
def steady_value(internal, i, drive):
    """Value to which state `i`, a linear one, relaxes at a constant drive."""
    p = internal.parameter
    if internal.kind[i] == MAXWELL:
        return p[i, 0] * drive
    return p[i, 0] * drive / (p[i, 0] + p[i, 1])


@compiled(python=False)
def internal_rate(internal, curves, i, x, drive, limit):
    """Time derivative of state `i`."""
    if internal.kind[i] == PAD:
        rate = internal.parameter[i, 0] * drive
        if internal.parameter[i, 1] > 0.0:  # `return_to_limit` brings it back
            return rate
        sliding = (x >= limit and rate > 0.0) or (x <= -limit and rate < 0.0)
        return 0.0 if sliding else rate
    if internal.kind[i] == MAXWELL_CURVE:
        speed = curve_speed(curves, internal.curve[i], x, drive)
        return internal.parameter[i, 1] * (drive - speed)
    p = internal.parameter
    if internal.kind[i] == MAXWELL:
        return p[i, 1] * (drive - x / p[i, 0])
    if internal.kind[i] == LAG:
        return min(p[i, 1], max(-p[i, 1], (limit - x) / p[i, 0]))
    if internal.kind[i] == USER:
        return drive
    return (p[i, 0] * (drive - x) - p[i, 1] * x) / p[i, 2]


@compiled(inline=True)
def ends_pad(internal, i):
    """Whether state `i` is the last of a pad that slides in any direction."""
    return internal.kind[i] == PAD and internal.parameter[i, 1] > 1.0


@compiled(inline=True)
def return_rate(internal, i, drive):
    """k/L^2 of a friction pad's state `i`: how fast sliding takes its force back."""
    return internal.parameter[i, 0] / (drive[i, 1] * drive[i, 1])


@compiled(python=False)
def return_to_limit(internal, last, first, drive, state):
    """Bring the forces of a pad that slides in any direction back to their limit.

    They stand in `state` from `first` on; the limits in `drive`; `last` is the pad's last state.

    Closest-point return (Simo, Hughes, Computational Inelasticity, 1998, 3): the pad slides along
    the gradient of |q| until the sticking stiffnesses k have brought the forces to their limits L,

        q_i = q_i,trial / (1 + lambda k_i/L_i^2),   |q| - e q_z = 1,

    in steady sliding with equal limits the force has the direction of the sliding, whatever the
    stiffnesses.  Newton's method on 1/(|q| - e q_z), which for equal k_i/L_i^2 is linear in lambda.
    """
    begin, skew = last + 1 - int(internal.parameter[last, 1]), internal.parameter[last, 2]
    size, slip = 0.0, 0.0
    for _ in range(MAX_RETURNS):
        square, change, z, z_change = 0.0, 0.0, 0.0, 0.0
        for i in range(begin, last + 1):
            z, z_change = 0.0, 0.0
            if drive[i, 1] > MIN_LIMIT:
                rate = return_rate(internal, i, drive)
                z = state[first + i] / (drive[i, 1] * (1.0 + slip * rate))
                z_change = -z * rate / (1.0 + slip * rate)
            else:
                state[first + i] = 0.0
            square += z * z
            change += z * z_change
        size = sqrt(square) - skew * z
        if size <= 1.0 + RETURN_TOLERANCE:
            break
        slope = change / sqrt(square) - skew * z_change
        if slope >= 0.0:  # a wedge that slides along its column alone does not come back
            break
        slip += size * (1.0 - size) / slope
    if slip > 0.0 or size > 1.0:
        for i in range(begin, last + 1):
            if drive[i, 1] > MIN_LIMIT:
                state[first + i] /= (1.0 + slip * return_rate(internal, i, drive)) * size


@compiled(python=False)
def lag_after(tau, rate, x, command, h):
    """Command behind a first-order lag with a limited rate, after a step `h`."""
    excess = abs(command - x) - rate * tau
    direction = 1.0 if command > x else -1.0
    if excess > 0.0:
        limited_time = min(h, excess / rate)
        x += direction * rate * limited_time
        h -= limited_time
    return command + (x - command) * exp(-h / tau)


@compiled
def set_decays(internal, h, decay):
    """e^(-h/tau) of the linear states, 0 for the others."""
    for i in range(internal.kind.shape[0]):
        if internal.kind[i] == MAXWELL or internal.kind[i] == AIR:
            decay[i] = exp(-h / relaxation_time(internal, i))
        else:
            decay[i] = 0.0


@compiled(inline=True)
def state_after(internal, curves, i, x, drive, limit, h, decay):
    """State `i` after a step `h` at constant drive."""
    if internal.kind[i] == PAD:
        x += h * internal.parameter[i, 0] * drive
        return x if internal.parameter[i, 1] > 0.0 else min(limit, max(-limit, x))
    if internal.kind[i] == MAXWELL_CURVE:
        return curve_force_after(curves, internal.curve[i], internal.parameter[i, 1], x, drive, h)
    if internal.kind[i] == LAG:
        return lag_after(internal.parameter[i, 0], internal.parameter[i, 1], x, limit, h)
    if internal.kind[i] == USER:
        return x + h * drive
    end = steady_value(internal, i, drive)
    return end + (x - end) * decay
