"""Records of one chunk of steps: states, rates, accelerations, wheels, patches, elements."""

from typing import NamedTuple

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.controllers import ACTUATOR, write_actuator_output
from railsim.kernels.element_outputs import write_element_outputs
from railsim.kernels.rails import MOTION_Y, MOTION_Z
from railsim.kernels.record import record
from railsim.kernels.state import internal_begin


@record
class Recorder(NamedTuple):
    """Arrays that receive the output of one chunk.

    Attributes
    ----------
    state : float64[r, n_state]
    rates : float64[r, 6 n]           rates of the coordinates
    acceleration : float64[r, n, 6]   absolute, in body axes
    wheel : float64[r, w, 2, WHEEL_COLUMNS]  see `contact_columns`
    rail : float64[r, w, 2, 2]        what a rail yields, y and z, see `rails`
    patch : float64[r, w, 2, 3, PATCH_ROWS]  contact patches, or of length 0
    selection : int64[e, 2]           elements to record, see `write_element_outputs`
    element : float64[r, e, ELEMENT_COLUMNS]
    """

    state: np.ndarray
    rates: np.ndarray
    acceleration: np.ndarray
    wheel: np.ndarray
    rail: np.ndarray
    patch: np.ndarray
    selection: np.ndarray
    element: np.ndarray


@compiled(python=False)
def record_row(recorder, row, system, state, derivative, work, n_patches):
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
            recorder.rail[row, w, side, 0] = work.rail_motion[w, side, MOTION_Y]
            recorder.rail[row, w, side, 1] = work.rail_motion[w, side, MOTION_Z]
    if recorder.patch.shape[0] > 0:
        record_patches(recorder.patch, row, work, n_patches)
    if recorder.selection.shape[0] > 0:
        first = internal_begin(system.bodies.kind.shape[0])
        write_element_outputs(
            system,
            work,
            state[first : first + system.internal.kind.shape[0]],
            recorder.selection,
            recorder.element[row],
        )
        for e in range(recorder.selection.shape[0]):
            if recorder.selection[e, 0] == ACTUATOR:
                write_actuator_output(
                    system, work, state, recorder.selection[e, 1], e, recorder.element[row]
                )


@compiled(python=False)
def record_patches(out, row, work, n_patches):
    """Copy the active contact patches to their entries; the others are zero."""
    for w in range(out.shape[1]):
        for side in range(2):
            for k in range(out.shape[3]):
                for c in range(out.shape[4]):
                    out[row, w, side, k, c] = 0.0
    for i in range(n_patches):
        w, side, k = work.patch_index[i, 0], work.patch_index[i, 1], work.patch_index[i, 2]
        for c in range(out.shape[4]):
            out[row, w, side, k, c] = work.patch[c, i]
