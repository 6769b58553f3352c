"""Starting within a curve: the vehicle settles on an auxiliary track that leads into it.

The equilibrium on straight track is no state for a curve: put there, the wheelsets would climb.
An auxiliary track begins straight, takes up curvature and cant of the starting place over a
transition, and keeps them until the vehicle has settled; the state at its end, relative to the
track frames, is the state at the start.
"""

import math

import numpy as np
from numpy.typing import NDArray

from railsim.assembly import CONSTANT_SPEED, Model, work_arrays
from railsim.definitions.track import Track
from railsim.equilibrium import Equilibrium
from railsim.errors import Fault, InputError
from railsim.kernels.status import RUNNING
from railsim.kernels.time_loop import FAST, time_loop
from railsim.time_step import empty_recorder
from railsim.track.alignment import Alignment
from railsim.track.tables import track_tables

Floats = NDArray[np.float64]

STRAIGHT = 20.0  # m
TRANSITION_TIME, SETTLING_TIME = 4.0, 6.0  # s; several periods of the car body
NEGLIGIBLE = 1e-6  # curvature (1/m) and cant (m) that need no run-in


def settled(
    model: Model, balance: Equilibrium, track: Track, start: float, step: float
) -> Floats | None:
    """State of a vehicle that has settled into the curve at `start`, None on straight track.

    Parameters
    ----------
    start : float
        Arc length of the reference body [m].
    step : float
        Time step of the fast scheme [s].

    Returns
    -------
    float64[n_state] or None
        Relative to the track frames; time, place and speed are those of `balance`.

    Raises
    ------
    InputError
        The vehicle does not stay on the track there.
    """
    alignment = Alignment(track)
    curvature = float(alignment.curvature(start))
    cant = float(alignment.cant(start))
    if abs(curvature) < NEGLIGIBLE and abs(cant) < NEGLIGIBLE:
        return None
    speed = float(balance.state[-1])
    transition = speed * TRANSITION_TIME
    rest = speed * SETTLING_TIME
    radius = 1.0 / curvature if abs(curvature) >= NEGLIGIBLE else math.inf
    auxiliary = track.replace(
        plan=[
            {"type": "STR", "length": STRAIGHT},
            {"type": "CLO", "length": transition, "radius_end": radius},
            {"type": "CIR", "length": rest, "radius": radius},
        ],
        cant=[
            {"type": "CST", "length": STRAIGHT, "cant": 0.0},
            {"type": "LIR", "length": transition},
            {"type": "CST", "length": rest, "cant": cant},
        ],
        vertical=[], irregularities=[],
    )
    system = model.system._replace(
        track=track_tables(auxiliary), drive=CONSTANT_SPEED, loads=model.system.loads._replace(
            body=model.system.loads.body[:0]),
    )
    state = balance.state.copy()
    steps = math.ceil(auxiliary.length / speed / step)
    status, *_ = time_loop(
        system, work_arrays(system), state, np.zeros_like(state), np.zeros((3, len(state))),
        empty_recorder(model, 1), FAST, step, 1, steps - 1, steps + 1,
    )
    if status != RUNNING:
        raise InputError([Fault(
            "--start", "", f"the vehicle does not stay on the track at s = {start:g} m, "
            f"R {radius:.0f} m, at {speed:g} m/s", "a start on straight track or a lower speed",
        )])
    state[-3:] = balance.state[-3:]
    return state
