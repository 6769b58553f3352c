"""`simulate`: the story of a run on one page.

Definitions are assembled to arrays, the vehicle finds its equilibrium on straight level track, the
step is chosen, and the time loop runs in chunks; between two chunks there is time for progress,
Ctrl-C and for writing.  The outcome goes chunk by chunk to a sink.
"""

import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railsim.assembly import Model, assemble, level_track, work_arrays
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.equilibrium import Equilibrium, equilibrium, initial_state
from railsim.errors import Fault, InputError, ModelError, nearest
from railsim.kernels.rhs import locate_frames
from railsim.kernels.status import NOT_FINITE, RUNNING, STATUS
from railsim.kernels.system import PRESCRIBED
from railsim.kernels.time_loop import time_loop
from railsim.outputs import quantities
from railsim.profiles import Profile
from railsim.result import MemorySink, Result, Sink
from railsim.time_step import SCHEMES, choose_step, empty_recorder

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

ROWS = 500  # outputs per chunk: some hundredths of a second of computing
SPEED_RANGE = (0.5, 150.0)  # m/s


@dataclass
class Preparation:
    """Everything that is settled before the time loop starts.

    Attributes
    ----------
    model, balance : Model, Equilibrium
        The assembled vehicle on its track; its rest and steady rolling.
    state : float64[n_state]
        Initial state.
    step, every : float, int
        Time step [s]; steps per output.
    n_steps : int
        Steps of the whole run.
    """

    model: Model
    balance: Equilibrium
    state: Floats
    step: float
    every: int
    n_steps: int


def simulate(
    vehicle: Vehicle,
    track: Track,
    *,
    speed: float,
    duration: float | None = None,
    until: float | None = None,
    settings: Settings | None = None,
    sink: Sink | None = None,
    progress: Progress | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> Result:
    """Run one vehicle over one track.

    Parameters
    ----------
    vehicle, track : Vehicle, Track
        Definitions, see `load_vehicle`, `load_track`.
    speed : float
        Constant speed of the reference body [m/s].
    duration, until : float, optional
        End of the run: time [s] or arc length of the reference body [m]; by default the end of the
        track's plan.
    settings : Settings, optional
        How the run is computed.
    sink : Sink, optional
        Receives the output as it comes; by default it is kept in memory.
    progress : callable, optional
        Called with the finished fraction now and then.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.

    Returns
    -------
    Result
        Its `status` says whether the run was complete; a derailment is a result, not an error.

    Raises
    ------
    InputError
        Speed, end or settings are out of range.
    ModelError
        There is no equilibrium, or no stable step.

    Examples
    --------
    >>> import railsim
    >>> vehicle = railsim.load_vehicle("coach_manchester")
    >>> track = railsim.load_track("curve_r250")
    >>> result = railsim.simulate(vehicle, track, speed=20.0, until=10.0)
    >>> result.status
    'complete'
    """
    started = time.perf_counter()
    settings = settings or Settings()
    length = run_length(track, speed, duration, until)
    prepared = prepare(vehicle, track, settings, speed, length, profiles)
    sink = sink or MemorySink()
    sink.begin({
        "wheelset": prepared.model.index.wheelsets, "body": prepared.model.index.bodies,
    })
    status, where, steps, cpu_time = _loop(prepared, settings, sink, progress)
    simulated = steps * prepared.step
    attributes = {
        "status": STATUS[status][0],
        "status_reason": _sentence(prepared.model, status, where),
        "vehicle_toml": vehicle.to_toml(),
        "track_toml": track.to_toml(),
        "settings_json": json.dumps(settings.model_dump(mode="json")),
        "speed": float(speed),
        "duration": length / speed,
        "step": prepared.step,
        "scheme": settings.scheme,
        "wall_time": time.perf_counter() - started,
        "cpu_time": cpu_time,
        "real_time_factor": simulated / cpu_time if cpu_time > 0.0 else math.inf,
    }
    return sink.close(attributes, {"Q0": prepared.balance.Q0}, prepared.model.profiles)


def run_length(
    track: Track, speed: float, duration: float | None, until: float | None
) -> float:
    """Arc length to run [m] from speed and either end; all faults at once."""
    faults = []
    low, high = SPEED_RANGE
    if not (math.isfinite(speed) and low <= speed <= high):
        faults.append(Fault("--speed", "", f"found {speed:g} m/s", f"{low:g} to {high:g} m/s"))
    for option, value in (("--duration", duration), ("--until", until)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            faults.append(Fault(option, "", f"found {value:g}", "a positive number"))
    if duration is not None and until is not None:
        faults.append(Fault("--duration", "", "given together with --until", "one of the two"))
    if not faults and (length := _end(track, speed, duration, until)) > track.length:
        faults.append(Fault(
            "--duration" if duration else "--until", "",
            f"the run would end at s = {length:g} m",
            f"at most {track.length:g} m, the end of the track's plan",
        ))
    if faults:
        raise InputError(faults)
    return _end(track, speed, duration, until)


def _end(track: Track, speed: float, duration: float | None, until: float | None) -> float:
    if duration is not None:
        return duration * speed
    return track.length if until is None else until


def prepare(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    speed: float,
    length: float,
    profiles: Mapping[str, Profile] | None = None,
) -> Preparation:
    """Assemble, balance, choose the step and set the initial state."""
    balance = equilibrium(assemble(vehicle, track, settings, profiles), speed)
    model = balance.model
    interval = output_interval(settings, speed)
    state = _start(model, balance, settings)
    if settings.step is None:
        level = level_track(model.system)
        step = choose_step(model, level, balance.state, settings.scheme, interval)
        every = round(interval / step)
    else:
        every = max(1, round(interval / settings.step))
        step = settings.step
        if abs(every * step - interval) > 1e-9 * interval:
            raise InputError([Fault(
                "settings", "step", f"found {step:g} s",
                f"a whole part of the output interval {interval:g} s",
            )])
    n_steps = math.ceil(length / speed / step * (1.0 - 1e-12))
    return Preparation(model, balance, state, step, every, n_steps)


def output_interval(settings: Settings, speed: float) -> float:
    """Time between two outputs [s]."""
    if settings.output_spacing is not None:
        return settings.output_spacing / speed
    return 1.0 / settings.output_rate


def _start(model: Model, balance: Equilibrium, settings: Settings) -> Floats:
    """Initial state: steady rolling at s = 0 with the disturbances of the settings."""
    work = work_arrays(model.system)
    bodies = model.system.bodies
    if locate_frames(model.system.track, model.system.frame_offset, bodies.frame[bodies.reference],
                     0.0, work.frames, work.cell, work.cell_u) != RUNNING:
        raise ModelError("the vehicle is longer than the track's table allows")
    state = initial_state(model, balance, 0.0, work.frames)
    n = model.index.n_bodies
    for name, change in settings.initial.items():
        if name not in model.index.bodies:
            raise InputError([Fault(
                "settings", f"initial.{name}", "no such body",
                nearest(name, model.index.bodies),
            )])
        place = model.index.coordinate(name, 0)
        state[place : place + 6] += (
            change.x, change.y, change.z, change.roll, change.pitch, change.yaw,
        )
        state[6 * n + place : 6 * n + place + 6] += (
            change.vx, change.vy, change.vz, change.vroll, change.vpitch, change.vyaw,
        )
    return state


def _loop(
    prepared: Preparation, settings: Settings, sink: Sink, progress: Progress | None
) -> tuple[int, int, int, float]:
    """Run the time loop chunk by chunk: status, where, steps taken, CPU seconds."""
    model = prepared.model
    work = work_arrays(model.system)
    state = prepared.state.copy()
    derivative = np.zeros_like(state)
    stages = np.zeros((3, len(state)))
    recorder = empty_recorder(model, ROWS)
    chunk = ROWS * prepared.every
    done, status, where, cpu_time = 0, RUNNING, 0, 0.0
    # one step more than the run is long, so that its end is recorded
    total = prepared.n_steps + 1
    while done < total and status == RUNNING:
        begin = time.process_time()
        status, where, steps, rows = time_loop(
            model.system, work, state, derivative, stages, recorder, SCHEMES[settings.scheme],
            PRESCRIBED, 0.0, prepared.step, done, min(chunk, total - done), prepared.every,
        )
        cpu_time += time.process_time() - begin
        done += steps
        if rows:
            sink.append(quantities(model, recorder, rows, prepared.balance.Q0))
        if progress is not None:
            progress(min(1.0, done / total))
    return status, where, done, cpu_time


def _sentence(model: Model, status: int, where: int) -> str:
    names = model.index.wheelsets
    if status == NOT_FINITE:
        body = where % (6 * model.index.n_bodies) // 6
        names, where = model.index.bodies, min(body, model.index.n_bodies - 1)
    return STATUS[status][1].format(where=names[where])
