"""Creep forces that take the length of the patch to follow the creepages.

The creep laws hold for steady rolling.  Material enters a patch free of traction and has to pass it
before a changed creepage acts all along: the delayed creepages c, which the laws take instead of
those of the rigid bodies, xi, obey

    a c' + c = xi

with ' for the way of the patch along its rail and a its semi-axis in that direction, integrated
exactly for a xi that is linear in time over a step: with z = V h/a and e = exp(-z)

    c = xi - (xi - xi_0) (1 - e)/z + (c_0 - xi_0) e.

The normal force acts at once.  Friction work and outputs are those of the creepages xi.

In the state: c_0 and xi_0 of every patch at the last evaluation and whether it carried then; a
patch that did not begins with c_0 = 0, without traction.  Where nothing is known, as in
equilibrium and in linear analyses, rolling is steady: c = xi.  For the reference scheme c_0 is part
of the state like any other, LAST_STEP being 0, with the rate V (xi - c)/a.

Source: Knothe and Gross-Thebing (1986), Vehicle System Dynamics 15, 133-153: creep coefficients
fall with the ratio of a to the wavelength; one order of delay as in Shen and Li (1996), Wear 191,
242-244.
"""

from math import exp, expm1

from railsim.kernels import compiled
from railsim.kernels.contact_columns import (
    PATCH_SPEED,
    SECANT_ALONG,
    SLOPE_ACROSS,
    SLOPE_ALONG,
    XI_X,
    A,
)
from railsim.kernels.state import LAST_STEP
from railsim.kernels.support import PATCH_STATE, SKIP, TRACED, TRANSIENT_SIZE, transient_begin

# columns of Work.transient[w, side, patch], and of each patch in the state but for the last: c and
# xi along, across and in spin; whether it carries; V/a [1/s]
DELAYED, STEADY, LOADED, RATE = 0, 3, 6, 7
TRANSIENT = PATCH_STATE + 1
CARRYING, UNLOADED = 1.0, 2.0  # values of LOADED; 0 before anything is known
KNOWN, NEW = 0.5, 1.5  # beyond them there is a history, which is that of a patch that did not carry


@compiled(python=False)
def delay_creepages(system, work, n, state):
    """Replace the creepages of the active patches by the delayed ones."""
    patch, values, h = work.patch, work.transient, state[LAST_STEP]
    for w in range(values.shape[0]):
        if system.support.elastic and work.support_step[w, SKIP] > 0.0:
            continue
        for side in range(2):
            for p in range(TRACED):
                for c in range(TRANSIENT):
                    values[w, side, p, c] = 0.0
                values[w, side, p, LOADED] = UNLOADED
    for k in range(n):
        w, side, p = work.patch_index[k, 0], work.patch_index[k, 1], work.patch_index[k, 2]
        i = transient_begin(system) + TRANSIENT_SIZE * w + PATCH_STATE * (TRACED * side + p)
        rate = patch[PATCH_SPEED, k] / patch[A, k]
        z = rate * h
        mean, decay = 1.0, 1.0
        if z > 0.0:
            mean, decay = -expm1(-z) / z, exp(-z)
        for c in range(3):
            xi, xi_0 = patch[XI_X + c, k], state[i + STEADY + c]
            delayed = xi
            if state[i + LOADED] > NEW:
                delayed -= xi * decay
            elif state[i + LOADED] > KNOWN:
                delayed += (xi_0 - xi) * mean + (state[i + DELAYED + c] - xi_0) * decay
            values[w, side, p, DELAYED + c] = delayed
            values[w, side, p, STEADY + c] = xi
            patch[XI_X + c, k] = delayed
        values[w, side, p, LOADED] = CARRYING
        values[w, side, p, RATE] = rate


@compiled(python=False)
def restore_creepages(system, work, n, state):
    """Restore the creepages; reduce the slopes to the response within a step."""
    patch, values, h = work.patch, work.transient, state[LAST_STEP]
    for k in range(n):
        w, side, p = work.patch_index[k, 0], work.patch_index[k, 1], work.patch_index[k, 2]
        for c in range(3):
            patch[XI_X + c, k] = values[w, side, p, STEADY + c]
        i = transient_begin(system) + TRANSIENT_SIZE * w + PATCH_STATE * (TRACED * side + p)
        if state[i + LOADED] > KNOWN:
            z = values[w, side, p, RATE] * h
            response = 1.0 + expm1(-z) / z if z > 0.0 else 0.0
            patch[SLOPE_ALONG, k] *= response
            patch[SLOPE_ACROSS, k] *= response
            patch[SECANT_ALONG, k] *= response


@compiled(python=False)
def store_creepages(system, work, state):
    """Store what the last evaluation found in the state, from which a step begins."""
    values, i = work.transient, transient_begin(system)
    for w in range(values.shape[0]):
        for side in range(2):
            for p in range(TRACED):
                for c in range(PATCH_STATE):
                    state[i] = values[w, side, p, c]
                    i += 1


@compiled(python=False)
def set_creepage_rates(system, work, state, derivative):
    """Rates of the delayed creepages for the reference scheme."""
    values, i = work.transient, transient_begin(system)
    for w in range(values.shape[0]):
        for side in range(2):
            for p in range(TRACED):
                rate = values[w, side, p, RATE]
                for c in range(PATCH_STATE):
                    derivative[i + c] = 0.0
                for c in range(3):
                    change = values[w, side, p, STEADY + c] - values[w, side, p, DELAYED + c]
                    derivative[i + DELAYED + c] = rate * change
                i += PATCH_STATE
