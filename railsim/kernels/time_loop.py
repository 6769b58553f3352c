"""The time loop, one compiled call per chunk of steps.

Each turn evaluates the forces, notes extremes, records, decides whether the step is divided
(`step_division`) and steps: by the fast scheme (`step_fast`) or by the reference (`step_rk4`).
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import unlikely
from railsim.kernels.controllers import run_controllers
from railsim.kernels.extremes import add_unloaded_time, update_extremes
from railsim.kernels.recording import record_row
from railsim.kernels.rhs import set_body_rates
from railsim.kernels.state import ARC_LENGTH
from railsim.kernels.status import NOT_FINITE, RUNNING
from railsim.kernels.step_division import begin_division, prepare_steps, required_division
from railsim.kernels.step_fast import start_memory, step_fast
from railsim.kernels.step_rk4 import first_not_finite, set_balanced_rates, step_rk4
from railsim.kernels.support import CORRECT_RAILS
from railsim.kernels.system import ALL_WHEELS, STEPS
from railsim.kernels.vibration import high_pass_coefficients, update_vibration

FAST, RK4 = range(2)


class Chunk(NamedTuple):
    """Which steps one call of the time loop takes.

    Attributes
    ----------
    first : int     number of steps already taken
    steps : int     how many to take
    every : int     states are recorded where the count is a multiple of it, before the step
    fresh : int     1 where nothing was before the state: the scheme's memory begins here
    closing : int   1 to evaluate and record the state after the last step as well
    rows : int      rows of the recorder that are taken already
    """

    first: int
    steps: int
    every: int
    fresh: int = 0
    closing: int = 0
    rows: int = 0


@compiled
def time_loop(system, work, state, derivative, stages, recorder, scheme, h, chunk):
    """Advance by some steps of length `h` [s], recording states.

    Parameters
    ----------
    state : float64[n_state]
        Changed in place.
    derivative : float64[n_state];  stages : float64[3, n_state]
        Work arrays.
    scheme : int
        FAST or RK4.
    chunk : Chunk
        Which steps, and what is recorded.

    Returns
    -------
    status, where, steps, rows : int
        Status code, the wheelset, state entry or law it concerns, steps taken, rows recorded now
        and before.
    """
    work.counts[ALL_WHEELS] = np.int64(recorder.patch.shape[0] > 0)
    prepare_steps(system, work, h)
    filter_40_hz = high_pass_coefficients(h)
    rows = np.int64(chunk.rows)
    step, end = chunk.first, chunk.first + chunk.steps
    remaining = np.int64(0)  # parts of the step that are still to be taken
    decay, length = work.decay, h
    while step < end + chunk.closing:
        if scheme == FAST:
            status, where, patches = set_body_rates(system, work, state, derivative, CORRECT_RAILS)
        else:
            status, where, patches = set_balanced_rates(system, work, state, derivative)
        if status == RUNNING:
            update_extremes(system, work, state)
            if remaining == 0:
                if step % chunk.every == 0:
                    record_row(recorder, rows, system, state, derivative, work, patches)
                    rows += 1
                if unlikely(system.signals.codes.shape[0] + system.controllers.codes.shape[0] > 0):
                    status, where = run_controllers(system, work, state, derivative)
                    if status != RUNNING:
                        return status, where, step - chunk.first, rows
                if step == end:
                    return RUNNING, 0, chunk.steps, rows
                update_vibration(work, filter_40_hz, h, state[ARC_LENGTH])
                if scheme == FAST and chunk.fresh and step == chunk.first:
                    start_memory(system, work, state, derivative, h)
                decay, length, remaining = work.decay, h, np.int64(1)
                w, parts = required_division(system, work, state, h)
                if w >= 0:
                    decay, length, remaining = work.decay_part, h / parts, parts
                    begin_division(system, work, length)
            add_unloaded_time(work.wheel, length, work.unloaded)
            if scheme == FAST:
                step_fast(system, work, state, derivative, decay, length)
            else:
                status, where = step_rk4(system, work, state, derivative, stages, length)
            remaining -= 1
        if status != RUNNING or (remaining == 0 and step % chunk.every == 0):
            entry = first_not_finite(state)
            if entry >= 0:
                return NOT_FINITE, entry, step - chunk.first, rows
        if status != RUNNING:
            return status, where, step - chunk.first, rows
        if remaining == 0:
            step += 1
            work.counts[STEPS] += 1
    return RUNNING, 0, chunk.steps, rows
