"""The time loop, one compiled call per chunk of steps.

Each turn evaluates the forces, notes extremes, records, decides whether the step is divided
(`division`) and steps: by the fast scheme (`step_fast`) or by the reference (`step_rk4`).
"""

from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.branches import rarely
from railsim.kernels.controllers import control
from railsim.kernels.division import begin_division, prepare_steps, striking
from railsim.kernels.extremes import note_extremes, note_unloaded
from railsim.kernels.recording import record_row
from railsim.kernels.rhs import mechanics
from railsim.kernels.state import ARC_LENGTH
from railsim.kernels.status import NOT_FINITE, RUNNING
from railsim.kernels.step_fast import remember, step_fast
from railsim.kernels.step_rk4 import all_rates, first_not_finite, step_rk4
from railsim.kernels.support import AFTER_STEP
from railsim.kernels.system import STEPS, WHOLE
from railsim.kernels.vibration import high_pass, watch

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
    work.parts[WHOLE] = np.int64(recorder.patch.shape[0] > 0)
    prepare_steps(system, work, h)
    filter_40_hz = high_pass(h)
    rows = np.int64(chunk.rows)
    step, end = chunk.first, chunk.first + chunk.steps
    left = np.int64(0)  # parts of the step that are still to be taken
    decay, length = work.decay, h
    while step < end + chunk.closing:
        if scheme == FAST:
            status, where, patches = mechanics(system, work, state, derivative, AFTER_STEP)
        else:
            status, where, patches = all_rates(system, work, state, derivative)
        if status == RUNNING:
            note_extremes(system, work, state)
            if left == 0:
                if step % chunk.every == 0:
                    record_row(recorder, rows, system, state, derivative, work, patches)
                    rows += 1
                if rarely(system.signals.which.shape[0] + system.controllers.which.shape[0] > 0):
                    status, where = control(system, work, state, derivative)
                    if status != RUNNING:
                        return status, where, step - chunk.first, rows
                if step == end:
                    return RUNNING, 0, chunk.steps, rows
                watch(work, filter_40_hz, h, state[ARC_LENGTH])
                if scheme == FAST and chunk.fresh and step == chunk.first:
                    remember(system, work, state, derivative, h)
                decay, length, left = work.decay, h, np.int64(1)
                w, parts = striking(system, work, state, h)
                if w >= 0:
                    decay, length, left = work.decay_part, h / parts, parts
                    begin_division(system, work, length)
            note_unloaded(work.wheel, length, work.unloaded)
            if scheme == FAST:
                step_fast(system, work, state, derivative, decay, length)
            else:
                status, where = step_rk4(system, work, state, derivative, stages, length)
            left -= 1
        if status != RUNNING or (left == 0 and step % chunk.every == 0):
            bad = first_not_finite(state)
            if bad >= 0:
                return NOT_FINITE, bad, step - chunk.first, rows
        if status != RUNNING:
            return status, where, step - chunk.first, rows
        if left == 0:
            step += 1
            work.parts[STEPS] += 1
    return RUNNING, 0, chunk.steps, rows
