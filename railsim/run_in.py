"""The state in which a run starts: anywhere along a track, in curves and on irregular rails.

The equilibrium on straight smooth track is no state for a curve or for rails that lean: put there,
the wheelsets would climb or fall.  So the vehicle comes from elsewhere:

- into a curve over an auxiliary track, which begins straight, takes up curvature and cant of the
  place over a transition, and keeps them until the vehicle has settled; the state at its end,
  relative to the track frames, is the state at the place;
- onto irregular rails over the last seconds of the real track before the start.
"""

import math

import numpy as np
from numpy.typing import NDArray

from railsim.assembly import CONSTANT_SPEED, Model, work_arrays
from railsim.definitions.track import Track
from railsim.equilibrium import Equilibrium, initial_state
from railsim.errors import Fault, InputError, ModelError
from railsim.kernels.rails import (
    ASIDE,
    ASIDE_SLOPE,
    MIDDLE_Y,
    MIDDLE_Z,
    ROLL,
    ROLL_SLOPE,
    SINE,
    SLOPE_Y,
    SLOPE_Z,
    locate_rails,
)
from railsim.kernels.rhs import locate_frames
from railsim.kernels.status import RUNNING
from railsim.kernels.system import System, Work
from railsim.kernels.time_loop import FAST, time_loop
from railsim.time_step import divide_strikes, empty_recorder
from railsim.track.alignment import Alignment
from railsim.track.tables import track_tables

Floats = NDArray[np.float64]

STRAIGHT = 20.0  # m
TRANSITION_TIME, SETTLING_TIME = 4.0, 6.0  # s; several periods of the car body
NEGLIGIBLE = 1e-6  # curvature (1/m) and cant (m) that need no run-in
APPROACH_TIME, APPROACH = 4.0, 30.0  # s and m at least of irregular rails before the start
SMOOTH = 10.0  # m before the track's beginning where the approach may begin, beside the vehicle


def start_state(
    model: Model, balance: Equilibrium, track: Track, start: float, step: float, scheme: int
) -> Floats:
    """State of the undisturbed vehicle at `start`.

    Parameters
    ----------
    start : float
        Arc length of the reference body [m].
    step, scheme : float, int
        Time step [s] and scheme of the run.

    Returns
    -------
    float64[n_state]
        At time 0 and exactly at `start`.

    Raises
    ------
    InputError
        The vehicle does not stay on the track there.
    ModelError
        The vehicle is longer than the track's table.
    """
    speed = float(balance.state[-1])
    steps = _approach(model, start, speed, step)
    place = start - steps * speed * step
    state = settled(model, balance, track, place, step)
    if state is None:
        work = _located(model, place)
        state = initial_state(model, balance, place, work.frames)
    state[-2] = place
    if steps:
        follow_rails(model, state)
        system = model.system._replace(
            drive=CONSTANT_SPEED, loads=model.system.loads._replace(
                body=model.system.loads.body[:0]),
        )
        _run(model, system, state, step, steps, scheme, start, "irregular rails")
    state[-3:] = 0.0, start, speed
    return state


def _friction(track: Track, place: float) -> tuple[float, float]:
    """Coefficients of friction of the left and right rail at a place."""
    if track.friction_table is None:
        return track.friction
    table = np.array(track.friction_table)
    left, right = (float(np.interp(place, table[:, 0], table[:, k])) for k in (1, -1))
    return left, right


def _approach(model: Model, start: float, speed: float, step: float) -> int:
    """Steps to drive on irregular rails before the start, 0 on smooth ones."""
    system = model.system
    if not system.track.has_irregularity:
        return 0
    work = _located(model, start)
    resting = np.abs(work.plane[:, [MIDDLE_Y, MIDDLE_Z, SLOPE_Y, SLOPE_Z, SINE, ROLL_SLOPE]])
    if not resting.any() and not work.rail[:, :, ASIDE : ASIDE_SLOPE + 1].any():
        return 0
    behind = -float(np.min(system.frame_offset))
    room = start - system.track.s_start - behind - SMOOTH
    return max(0, math.floor(min(max(APPROACH_TIME * speed, APPROACH), room) / (speed * step)))


def _located(model: Model, place: float) -> Work:
    """Work arrays with the track frames and rails of a vehicle at `place`."""
    system = model.system
    work = work_arrays(system)
    reference = system.bodies.frame[system.bodies.references[0]]
    if locate_frames(system.track, system.frame_offset, reference, place, work.frames, work.cell,
                     work.cell_u) != RUNNING:
        raise ModelError("the vehicle is longer than the track's table allows")
    locate_rails(system.track, system.contact.body, system.bodies.frame, work.cell, work.cell_u,
                 work.plane, work.rail)
    return work


def follow_rails(model: Model, state: Floats) -> None:
    """Put the wheelsets on irregular rails, moving as the rails lead them."""
    speed, n = state[-1], model.index.n_bodies
    plane = _located(model, float(state[-2])).plane
    for w, body in enumerate(model.system.contact.body):
        place, rate = 6 * body, 6 * n + 6 * body
        height = model.system.bodies.nominal[body, 1]
        # the centre of the wheelset leans over with the rails
        state[place + 1] += plane[w, MIDDLE_Y] - height * plane[w, SINE]
        state[place + 2] += plane[w, MIDDLE_Z]
        state[place + 3] += plane[w, ROLL]
        state[place + 5] += plane[w, SLOPE_Y]
        state[rate + 1] += speed * (plane[w, SLOPE_Y] - height * plane[w, ROLL_SLOPE])
        state[rate + 2] += speed * plane[w, SLOPE_Z]
        state[rate + 3] += speed * plane[w, ROLL_SLOPE]


def _run(
    model: Model, system: System, state: Floats, step: float, steps: int, scheme: int,
    start: float, where: str,
) -> None:
    """Advance a state; InputError if the vehicle leaves the track."""
    work = work_arrays(system)
    divide_strikes(work, scheme, step)
    status, *_ = time_loop(
        system, work, state, np.zeros_like(state), np.zeros((3, len(state))),
        empty_recorder(model, 1), scheme, step, 1, steps, steps + 2, 1, 0,
    )
    if status != RUNNING:
        raise InputError([Fault(
            "--start", "", f"the vehicle does not stay on the track at s = {start:g} m, "
            f"{where}, at {state[-1]:g} m/s", "a start on straight track or a lower speed",
        )])


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
        vertical=[], irregularities=[], gauge_widening=None, friction_table=None,
        friction=_friction(track, start),
    )
    system = model.system._replace(
        track=track_tables(auxiliary), drive=CONSTANT_SPEED, loads=model.system.loads._replace(
            body=model.system.loads.body[:0]),
    )
    state = balance.state.copy()
    steps = math.ceil(auxiliary.length / speed / step)
    _run(model, system, state, step, steps - 1, FAST, start, f"R {radius:.0f} m")
    state[-3:] = balance.state[-3:]
    return state
