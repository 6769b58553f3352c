"""A vehicle brought into a curve on an auxiliary track: straight, transition, curve."""

import logging
import math
from collections.abc import Callable

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.kernels.state import SPEED
from railsim.kernels.status import RUNNING
from railsim.kernels.system import System
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.model.assembly import Model
from railsim.model.time_step import NEVER, divide_strikes, empty_recorder
from railsim.model.work import work_arrays

# called with the time that has been simulated, and all of it [s]; it may raise, as on Ctrl-C
Progress = Callable[[float, float], None]

STRAIGHT = 20.0  # m
# m, least lengths, at low speed: several wavelengths of a wheelset, no steep ramp of cant; the
# settling length begins when the last wheelset is in the curve
TRANSITION, SETTLING = 40.0, 30.0
NEGLIGIBLE = 1e-6  # curvature (1/m) and cant (m) that are none
# in a call, of all wheelsets: Ctrl-C and progress are handled between calls; a call takes a few
# tenths of a second with the fast scheme, a second with the other
WHEELSET_STEPS = 40_000

DOING = logging.getLogger("railsim.doing")  # what takes long, in words


def curve_to_settle_in(
    model: Model,
    track: Track,
    speed: float,
    curvature: float,
    cant: float,
    friction: tuple[float, float],
    times: tuple[float, float],
    lengths: tuple[float, float] = (TRANSITION, SETTLING),
) -> Track:
    """Straight, transition and curve on smooth rails, long enough for a vehicle to settle.

    `speed`: [m/s]; `curvature`, `cant`: of the curve [1/m], [m]; `friction`: of left and right
    rail [1]; `times`: time in the transition and in the curve [s], at low speed their lengths
    decide; `lengths`: of the transition, and of the curve behind the last wheelset, at least [m].
    """
    transition = max(speed * times[0], lengths[0])
    behind = -float(np.min(model.system.frame_offset))
    rest = max(speed * times[1], behind + lengths[1])
    radius = 1.0 / curvature if abs(curvature) >= NEGLIGIBLE else math.inf
    return track.replace(
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
        vertical=[],
        irregularities=[],
        gauge_widening=None,
        friction_table=None,
        friction=friction,
    )


def advance(
    model: Model,
    system: System,
    state: Floats,
    step: float,
    steps: int,
    scheme: int,
    progress: Progress | None = None,
) -> int:
    """Advance a state in calls short enough for signals to be heard; its status is returned."""
    work, recorder = work_arrays(system), empty_recorder(model, 1)
    divide_strikes(system, work, scheme, step, state[SPEED])
    derivative, stages = np.zeros_like(state), np.zeros((3, len(state)))
    status, done = RUNNING, 0
    most = max(1, WHEELSET_STEPS // len(system.contact.body))
    while status == RUNNING and done < steps:
        status, _, more, _ = time_loop(
            system,
            work,
            state,
            derivative,
            stages,
            recorder,
            scheme,
            step,
            Chunk(1 + done, min(most, steps - done), NEVER, fresh=int(done == 0)),
        )
        done += more
        if progress is not None:
            progress(done * step, steps * step)
    return int(status)
