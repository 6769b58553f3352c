"""The classical Runge-Kutta method of order four on the whole state; the reference."""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.internal import MAXWELL_CURVE, PAD, ends_pad, limit_to_curve, return_to_limit
from railsim.kernels.rhs import set_body_rates, set_internal_rates
from railsim.kernels.state import LAST_STEP, internal_begin
from railsim.kernels.status import NOT_FINITE, RUNNING
from railsim.kernels.support import BALANCE_RATES, set_support_rates
from railsim.kernels.transient import set_creepage_rates, store_creepages


@compiled(python=False)
def set_balanced_rates(system, work, state, derivative):
    """Derivative of the whole state, of massless rails with the rates that balance the forces.

    Returns
    -------
    status, wheelset, n_patches : int
    """
    status, where, n_patches = set_body_rates(system, work, state, derivative, BALANCE_RATES)
    if status == RUNNING:
        set_internal_rates(system, work, state, derivative)
        set_support_rates(system, work, state, derivative)
        if system.contact.transient != 0:
            set_creepage_rates(system, work, state, derivative)
    return status, where, n_patches


@compiled
def restore_limits(internal, curves, first, drive, state):
    """Bring the forces of friction pads and of tables that end flat back within their limits."""
    for i in range(internal.kind.shape[0]):
        k = first + i
        if ends_pad(internal, i):
            return_to_limit(internal, i, first, drive, state)
        elif internal.kind[i] == PAD and internal.parameter[i, 1] == 0.0:
            state[k] = min(drive[i, 1], max(-drive[i, 1], state[k]))
        elif internal.kind[i] == MAXWELL_CURVE:
            state[k] = limit_to_curve(curves, internal.curve[i], state[k])


@compiled(python=False)
def first_not_finite(state):
    """Index of the first entry that is not finite, -1 if there is none."""
    total = 0.0
    for k in range(state.shape[0]):
        total += 0.0 * state[k]
    if not unlikely(total != 0.0):
        return -1
    for k in range(state.shape[0]):
        if not np.isfinite(state[k]):
            return k
    return -1


@compiled(python=False)
def step_rk4(system, work, state, derivative, stages, h):
    """Advance `state` by `h`; `derivative` holds the first stage."""
    total, trial, rate = stages[0], stages[1], stages[2]
    if system.contact.transient != 0:
        store_creepages(system, work, state)
        state[LAST_STEP] = 0.0
    for k in range(state.shape[0]):
        total[k] = derivative[k]
        rate[k] = derivative[k]
    for stage in range(1, 4):
        fraction = 0.5 * h if stage < 3 else h
        for k in range(state.shape[0]):
            trial[k] = state[k] + fraction * rate[k]
        status, where, _ = set_balanced_rates(system, work, trial, rate)
        if status != RUNNING:
            # look-ups take what is not finite for a wheel beyond its table
            entry = first_not_finite(trial)
            if entry >= 0:
                return NOT_FINITE, entry
            return status, where
        weight = 2.0 if stage < 3 else 1.0
        for k in range(state.shape[0]):
            total[k] += weight * rate[k]
    for k in range(state.shape[0]):
        state[k] += h / 6.0 * total[k]
    first = internal_begin(system.bodies.kind.shape[0])
    restore_limits(system.internal, system.curves, first, work.drive, state)
    return RUNNING, 0
