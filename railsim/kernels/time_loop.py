"""The time loop: integrators and recording, one compiled call per chunk of steps.

`fast`: semi-implicit (symplectic) Euler; velocities first, positions with the new velocities.
Internal states of elements are advanced exactly for a constant drive (see `internal`), so that
their short time constants do not limit the step; the spin of each wheelset is taken linearly
implicit (its creep force is the stiffest mode of the vehicle), which changes no other mode.

`heun`: two evaluations a step, of order two: positions as in velocity Verlet, velocities by the
mean of the accelerations at both ends (Heun), the spin by a two-stage Rosenbrock method that stays
of order two with any estimate of its stiffness (ROS2: Verwer, Spee, Blom, Hundsdorfer 1999),
internal states exactly for the mean drive.

`rk4`: the classical Runge-Kutta method of order four on the whole state; the reference.
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels import jit
from railsim.kernels.element_outputs import element_outputs
from railsim.kernels.internal import (
    MAXWELL_CURVE,
    PAD,
    advanced,
    constant_decays,
    within_table,
)
from railsim.kernels.rhs import euler_rates, mechanics, right_hand_side, table_value_slope
from railsim.kernels.status import NOT_FINITE, RUNNING
from railsim.kernels.system import AXLEBOX, TABLE, WHEELSET

FAST, RK4, HEUN = range(3)
GAMMA = 1.0 - 0.5 * 2.0**0.5  # of ROS2: L-stable


class Recorder(NamedTuple):
    """Arrays that receive the output of one chunk.

    Attributes
    ----------
    state : float64[r, n_state]
    rates : float64[r, 6 n]           rates of the coordinates
    acceleration : float64[r, n, 6]   absolute, in body axes
    wheel : float64[r, w, 2, 8]       see `wheel_rail`
    patch : float64[r, w, 2, 3, PATCH_ROWS]  contact patches, or of length 0
    chosen : int64[e, 2]              elements to record, see `element_outputs`
    element : float64[r, e, ELEMENT_COLUMNS]
    """

    state: np.ndarray
    rates: np.ndarray
    acceleration: np.ndarray
    wheel: np.ndarray
    patch: np.ndarray
    chosen: np.ndarray
    element: np.ndarray


@jit
def record(recorder, row, system, state, derivative, work, n_patches):
    """Copy the state and the by-products of its evaluation into row `row`."""
    for k in range(recorder.state.shape[1]):
        recorder.state[row, k] = state[k]
    for k in range(recorder.rates.shape[1]):
        recorder.rates[row, k] = derivative[k]
    for b in range(recorder.acceleration.shape[1]):
        for k in range(6):
            recorder.acceleration[row, b, k] = work.acceleration[b, k]
    for w in range(recorder.wheel.shape[1]):
        for side in range(2):
            for k in range(recorder.wheel.shape[3]):
                recorder.wheel[row, w, side, k] = work.wheel[w, side, k]
    if recorder.patch.shape[0] > 0:
        record_patches(recorder.patch, row, work, n_patches)
    if recorder.chosen.shape[0] > 0:
        first = 12 * system.bodies.kind.shape[0]
        element_outputs(system, work, state[first:first + system.internal.kind.shape[0]],
                        recorder.chosen, recorder.element[row])


@jit
def record_patches(out, row, work, n_patches):
    """Copy the active contact patches to their places; the others are zero."""
    for w in range(out.shape[1]):
        for side in range(2):
            for k in range(out.shape[3]):
                for c in range(out.shape[4]):
                    out[row, w, side, k, c] = 0.0
    for i in range(n_patches):
        w, side, k = work.patch_index[i, 0], work.patch_index[i, 1], work.patch_index[i, 2]
        for c in range(out.shape[4]):
            out[row, w, side, k, c] = work.patch[c, i]


@jit
def step_fast(system, work, state, derivative, decay, h):
    """Advance `state` by `h` with the derivative already evaluated there."""
    bodies, S = system.bodies, work.S
    n = bodies.kind.shape[0]
    for b in range(n):
        q = 6 * b
        v = 6 * n + q
        kind = bodies.kind[b]
        if kind == AXLEBOX:
            state[v + 4] += h * derivative[v + 4]
            state[q + 4] += h * state[v + 4]
            continue
        d1, d2, d3 = h * derivative[v + 3], h * derivative[v + 4], h * derivative[v + 5]
        if kind == WHEELSET:
            d2 /= 1.0 + h * work.spin_damping[b]
        for k in range(3):
            state[v + k] += h * derivative[v + k]
            state[q + k] += h * state[v + k]
        state[v + 3] += d1
        state[v + 4] += d2
        state[v + 5] += d3
        r1, r2, r3 = euler_rates(kind, S[b, 0], S[b, 1], S[b, 2], S[b, 3], d1, d2, d3)
        state[q + 3] += h * (derivative[q + 3] + r1)
        state[q + 4] += h * (derivative[q + 4] + r2)
        state[q + 5] += h * (derivative[q + 5] + r3)
    for i in range(system.internal.kind.shape[0]):
        k = 12 * n + i
        state[k] = advanced(system.internal, system.curves, i, state[k], work.drive[i, 0],
                            work.drive[i, 1], h, decay[i])
    advance_place(system.drive, state, derivative, h)


@jit
def advance_place(drive, state, derivative, h):
    """Time, place and speed after a step; a speed table is met exactly."""
    state[-1] += h * derivative[-1]
    state[-2] += h * state[-1]
    state[-3] += h
    if drive.mode == TABLE:
        state[-1], _ = table_value_slope(drive.table, state[-2])


@jit
def predict(bodies, S, state, derivative, trial, spin, h):
    """First stage of `step_heun`: coordinates to second, velocities to first order into `trial`.

    `spin` holds what damps the wheelsets' spin; their spin's derivative is replaced by its stage.
    """
    n = bodies.kind.shape[0]
    for b in range(n):
        q = 6 * b
        v = 6 * n + q
        kind = bodies.kind[b]
        if kind == WHEELSET:
            derivative[v + 4] /= 1.0 + GAMMA * h * spin[b]
        a1, a2, a3 = derivative[v + 3], derivative[v + 4], derivative[v + 5]
        if kind != AXLEBOX:
            a1, a2, a3 = euler_rates(kind, S[b, 0], S[b, 1], S[b, 2], S[b, 3], a1, a2, a3)
        for k in range(6):
            trial[v + k] = state[v + k] + h * derivative[v + k]
            trial[q + k] = state[q + k] + h * derivative[q + k]
        half = 0.5 * h * h
        for k in range(3):
            trial[q + k] += half * derivative[v + k]
        trial[q + 3] += half * a1
        trial[q + 4] += half * a2
        trial[q + 5] += half * a3


@jit
def step_heun(system, work, state, derivative, stages, decay, h):
    """Advance `state` by `h`; `derivative` holds the first stage."""
    bodies, internal, curves, drive = system.bodies, system.internal, system.curves, system.drive
    n, m, end = bodies.kind.shape[0], internal.kind.shape[0], state.shape[0]
    trial, rate = stages[0], stages[1]
    spin, before = stages[2, :n], stages[2, n:n + m]
    for b in range(n):
        spin[b] = work.spin_damping[b]
    predict(bodies, work.S, state, derivative, trial, spin, h)
    for i in range(m):
        k = 12 * n + i
        before[i] = work.drive[i, 0]
        trial[k] = advanced(internal, curves, i, state[k], before[i], work.drive[i, 1], h, decay[i])
    trial[end - 1] = state[end - 1] + h * derivative[end - 1]
    trial[end - 2] = state[end - 2] + h * (state[end - 1] + 0.5 * h * derivative[end - 1])
    trial[end - 3] = state[end - 3] + h
    if drive.mode == TABLE:
        trial[end - 1], _ = table_value_slope(drive.table, trial[end - 2])
    status, where, _ = mechanics(system, work, trial, rate)
    if status != RUNNING:
        return status, where
    for b in range(n):
        if bodies.kind[b] == WHEELSET:
            # u + h (3/2 k_1 + 1/2 k_2) with (1 + gamma h lambda) k_2 = f_2 - 2 k_1
            k = 6 * n + 6 * b + 4
            second = (rate[k] - 2.0 * derivative[k]) / (1.0 + GAMMA * h * spin[b])
            rate[k] = 2.0 * derivative[k] + second
    for k in range(12 * n):
        state[k] += 0.5 * h * (derivative[k] + rate[k])
    for i in range(m):
        k = 12 * n + i
        state[k] = advanced(internal, curves, i, state[k], 0.5 * (before[i] + work.drive[i, 0]),
                            work.drive[i, 1], h, decay[i])
    state[-2] += 0.5 * h * (state[-1] + trial[end - 1])
    state[-1] += 0.5 * h * (derivative[end - 1] + rate[end - 1])
    state[-3] += h
    if drive.mode == TABLE:
        state[-1], _ = table_value_slope(drive.table, state[-2])
    return RUNNING, 0


@jit
def settle_limits(internal, curves, first, drive, state):
    """Bring the forces of friction pads and of tables that end flat back within their limits."""
    for i in range(internal.kind.shape[0]):
        k = first + i
        if internal.kind[i] == PAD:
            state[k] = min(drive[i, 1], max(-drive[i, 1], state[k]))
        elif internal.kind[i] == MAXWELL_CURVE:
            state[k] = within_table(curves, internal.curve[i], state[k])


@jit
def step_rk4(system, work, state, derivative, stages, h):
    """Advance `state` by `h`; `derivative` holds the first stage."""
    total, trial, rate = stages[0], stages[1], stages[2]
    for k in range(state.shape[0]):
        total[k] = derivative[k]
        rate[k] = derivative[k]
    for stage in range(1, 4):
        fraction = 0.5 * h if stage < 3 else h
        for k in range(state.shape[0]):
            trial[k] = state[k] + fraction * rate[k]
        status, where, _ = right_hand_side(system, work, trial, rate)
        if status != RUNNING:
            return status, where
        weight = 2.0 if stage < 3 else 1.0
        for k in range(state.shape[0]):
            total[k] += weight * rate[k]
    for k in range(state.shape[0]):
        state[k] += h / 6.0 * total[k]
    settle_limits(system.internal, system.curves, 12 * system.bodies.kind.shape[0], work.drive,
                  state)
    return RUNNING, 0


@jit
def all_finite(state):
    """Index of the first entry that is not finite, -1 if there is none."""
    for k in range(state.shape[0]):
        if not np.isfinite(state[k]):
            return k
    return -1


@jit
def time_loop(system, work, state, derivative, stages, recorder, scheme, h, first_step, n_steps,
              every):
    """Advance by `n_steps` steps of length `h` [s], recording every `every`-th state.

    Parameters
    ----------
    state : float64[n_state]
        Changed in place.
    derivative : float64[n_state];  stages : float64[3, n_state]
        Work arrays.
    first_step : int
        Number of steps already taken; states are recorded where the count is a multiple of
        `every`, before the step.

    Returns
    -------
    status, where, steps, rows : int
        Status code, the wheelset or state entry it concerns, steps taken, rows recorded.
    """
    decay = work.decay
    constant_decays(system.internal, h, decay)
    rows = 0
    for step in range(first_step, first_step + n_steps):
        if scheme != RK4:
            status, where, patches = mechanics(system, work, state, derivative)
        else:
            status, where, patches = right_hand_side(system, work, state, derivative)
        if status == RUNNING:
            if step % every == 0:
                record(recorder, rows, system, state, derivative, work, patches)
                rows += 1
            if scheme == FAST:
                step_fast(system, work, state, derivative, decay, h)
            elif scheme == HEUN:
                status, where = step_heun(system, work, state, derivative, stages, decay, h)
            else:
                status, where = step_rk4(system, work, state, derivative, stages, h)
        if status != RUNNING or step % every == 0:
            bad = all_finite(state)
            if bad >= 0:
                return NOT_FINITE, bad, step - first_step, rows
        if status != RUNNING:
            return status, where, step - first_step, rows
    return RUNNING, 0, n_steps, rows


@jit
def record_state(system, work, state, derivative, recorder):
    """Evaluate and record a state without a step: the end of a run.  Status and wheelset."""
    status, where, patches = right_hand_side(system, work, state, derivative)
    if status == RUNNING:
        record(recorder, 0, system, state, derivative, work, patches)
    return status, where
