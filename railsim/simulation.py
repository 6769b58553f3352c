"""`simulate`: the story of a run on one page.

Definitions are assembled to arrays, the vehicle finds its equilibrium on straight level track, the
step is chosen, and the time loop runs in chunks; between two chunks there is time for progress,
Ctrl-C and for writing.  The outcome goes chunk by chunk to a sink.
"""

import json
import logging
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railsim.assembly import Model, assemble, level_track_with_friction, work_arrays
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.equilibrium import Equilibrium, equilibrium
from railsim.errors import Fault, InputError, nearest
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.status import NOT_FINITE, RUNNING, STATUS
from railsim.kernels.time_loop import time_loop
from railsim.outputs import OutputPlan
from railsim.profiles import Profile
from railsim.result import MemorySink, Result, Sink
from railsim.run_in import start_state
from railsim.time_step import SCHEMES, choose_step

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

_LOG = logging.getLogger(__name__)
ROWS = 500  # outputs per chunk: some hundredths of a second of computing
SPEED_RANGE = (0.5, 150.0)  # m/s
# settings that a continued run may have of its own; it has no initial disturbance
OUTPUT_SETTINGS = ("output_rate", "output_spacing", "outputs", "initial")


@dataclass
class Preparation:
    """Everything that is settled before the time loop starts.

    Attributes
    ----------
    model, balance : Model, Equilibrium
        The assembled vehicle on its track; its rest and steady rolling.
    state : float64[n_state]
        Initial state.
    end_time, end_distance : float
        Where the run ends, whichever comes first [s], [m].
    pace : Pace
        Step and output interval at any speed.
    fresh : bool
        Whether nothing was before the initial state.
    """

    model: Model
    balance: Equilibrium
    state: Floats
    end_time: float
    end_distance: float
    pace: "Pace"
    fresh: bool = True


def simulate(
    vehicle: Vehicle,
    track: Track,
    *,
    speed: float | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    settings: Settings | None = None,
    sink: Sink | None = None,
    progress: Progress | None = None,
    profiles: Mapping[str, Profile] | None = None,
    resume: Result | Floats | None = None,
) -> Result:
    """Run one vehicle over one track.

    Parameters
    ----------
    vehicle, track : Vehicle, Track
        Definitions, see `load_vehicle`, `load_track`.
    speed : float
        Speed of the reference body [m/s]: constant, or at the start of a free run; not needed
        where the settings have a speed table or with `resume`.
    start : float
        Arc length at which the reference body starts [m].
    duration, until : float, optional
        End of the run: time from its start [s] or arc length of the reference body [m]; by default
        the end of the track's plan.
    settings : Settings, optional
        How the run is computed.
    sink : Sink, optional
        Receives the output as it comes; by default it is kept in memory.
    progress : callable, optional
        Called with the finished fraction now and then.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.
    resume : Result or float64[n_state], optional
        A result of the same vehicle, track and settings (outputs apart) whose end is the beginning
        of this run, or the state itself (``result.groups["state"]["end"]``); either gives speed and
        start.

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
    before = None if resume is None else state_before(vehicle, track, settings, resume)
    if before is not None:
        speed, start = float(before[-1]), float(before[-2])
    speed = initial_speed(settings, speed, start)
    check_range(track, speed, start, duration, until)
    prepared = prepare(vehicle, track, settings, speed, start, duration, until, profiles)
    if before is not None:
        take_up(prepared, before, duration)
    sink = sink or MemorySink()
    plan = OutputPlan(prepared.model, settings, track)
    sink.begin(plan.coordinates, plan.quantities)
    begin_time = float(prepared.state[-3])
    status, where, state, cpu_time, events = _loop(prepared, settings, plan, sink, progress)
    simulated = float(state[-3]) - begin_time
    attributes: dict[str, str | float | int] = {
        "status": STATUS[status][0],
        "status_reason": _sentence(prepared.model, status, where),
        "vehicle_toml": vehicle.to_toml(),
        "track_toml": track.to_toml(),
        "settings_json": json.dumps(settings.model_dump(mode="json")),
        "speed": float(speed),
        "start": float(start),
        "duration": simulated,
        **{
            f"asked_{name}": float(value)
            for name, value in (("duration", duration), ("until", until))
            if value is not None
        },
        "step": prepared.pace.smallest,
        "scheme": settings.scheme,
        "wall_time": time.perf_counter() - started,
        "cpu_time": cpu_time,
        "patches_evaluated": int(events[:, 0].sum()),
        "patches_out_of_range": int(events[:, 1].sum()),
        "real_time_factor": simulated / cpu_time if cpu_time > 0.0 else math.inf,
    }
    result = sink.close(
        attributes,
        {"Q0": prepared.balance.Q0},
        prepared.model.profiles,
        {"state": {"end": state} | ({} if before is None else {"start": before})},
    )
    for remark in result.remarks:
        _LOG.warning(remark)
    return result


def initial_speed(settings: Settings, speed: float | None, start: float) -> float:
    """Speed at the start: as given, or from the settings' speed table [m/s]."""
    if settings.drive.speed_table is not None:
        place, value = np.array(settings.drive.speed_table).T
        return float(np.interp(start, place, value))
    if speed is None:
        raise InputError([Fault("--speed", "", "no speed is given", "a speed in m/s, e.g. 20")])
    return speed


def check_range(
    track: Track, speed: float, start: float, duration: float | None, until: float | None
) -> None:
    """Raise InputError with all faults of speed, start and end of a run."""
    faults = []
    low, high = SPEED_RANGE
    if not (math.isfinite(speed) and low <= speed <= high):
        faults.append(Fault("--speed", "", f"found {speed:g} m/s", f"{low:g} to {high:g} m/s"))
    if not (math.isfinite(start) and 0.0 <= start < track.length):
        faults.append(Fault("--start", "", f"found {start:g} m", f"0 to {track.length:g} m"))
    if duration is not None and not (math.isfinite(duration) and duration > 0.0):
        faults.append(Fault("--duration", "", f"found {duration:g} s", "a positive number"))
    if duration is not None and until is not None:
        faults.append(Fault("--duration", "", "given together with --until", "one of the two"))
    if until is not None and not start < until <= track.length:
        faults.append(Fault(
            "--until", "", f"found {until:g} m",
            f"more than the start, {start:g} m, and at most {track.length:g} m, the track's plan",
        ))
    if faults:
        raise InputError(faults)


def prepare(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    speed: float,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> Preparation:
    """Assemble, balance, choose the step and set the initial state."""
    balance = equilibrium(assemble(vehicle, track, settings, profiles), speed)
    model = balance.model
    pace = Pace(model, settings, {speed: balance.state})
    step, _ = pace.at(speed)
    state = start_state(model, balance, track, start, step, SCHEMES[settings.scheme])
    _disturb(model, settings, state)
    return Preparation(
        model, balance, state,
        end_time=math.inf if duration is None else duration,
        end_distance=track.length if until is None else until,
        pace=pace,
    )


def state_before(
    vehicle: Vehicle, track: Track, settings: Settings, resume: Result | Floats
) -> Floats:
    """State with which a run goes on from another one.

    Raises
    ------
    InputError
        The result holds no state, or is of another vehicle, track or other settings: going on would
        not give what an undisturbed run gives.
    """
    if not isinstance(resume, Result):
        return np.array(resume, dtype=float)
    faults = []
    if "end" not in resume.groups.get("state", {}):
        faults.append(Fault("--continue", "", "the result holds no state at its end",
                            "a result of `railsim run`"))
    for kind, text in (("vehicle", vehicle.to_toml()), ("track", track.to_toml())):
        if text != resume.attributes[f"{kind}_toml"]:
            faults.append(Fault("--continue", "", f"the result is of another {kind}",
                                f"the {kind} and the --set {kind}... of the result"))
    here, there = settings.model_dump(mode="json"), resume.settings().model_dump(mode="json")
    faults += [
        Fault("--continue", f"settings.{key}", f"found {here[key]}",
              f"{there[key]}, as in the result (--settings, --set)")
        for key in here
        if key not in OUTPUT_SETTINGS and here[key] != there[key]
    ]
    if faults:
        raise InputError(faults)
    return np.array(resume.groups["state"]["end"])


def take_up(prepared: Preparation, before: Floats, duration: float | None) -> None:
    """Let a prepared run begin in the state `before`."""
    if before.shape != prepared.state.shape:
        raise InputError([Fault(
            "--continue", "", f"a state of {before.size} values",
            f"{prepared.state.size} values, those of this vehicle",
        )])
    prepared.state = before.copy()
    prepared.fresh = False
    if duration is not None:
        prepared.end_time = float(before[-3]) + duration


class Pace:
    """Step and output interval of a run, chosen once for each class of speeds.

    Creep forces stiffen as 1/V: the step of a class is that of its lowest speed.
    """

    CLASS = 1.2  # ratio of a class's speeds

    def __init__(self, model: Model, settings: Settings, states: dict[float, Floats]) -> None:
        self._model = model
        self._settings = settings
        self._known: dict[tuple[float, float], float] = {}
        self._states = states
        self.varies = settings.drive.mode != "constant"
        self.smallest = math.inf

    def at(self, speed: float, rate: float = 0.0) -> tuple[float, int]:
        """Step [s] at `speed`, which changes at `rate`, and number of steps to the next output."""
        interval = output_interval(self._settings, speed)
        if self._settings.output_spacing is not None:
            interval = _duration(self._settings.output_spacing, speed, rate)
        key = speed
        if self.varies:
            key = self.CLASS ** math.floor(math.log(speed, self.CLASS))
        longest = self._known.get((key, 0.0)) or self._choose(key, interval)
        self._known[key, 0.0] = longest
        every = max(1, math.ceil(interval / longest * (1.0 - 1e-9)))
        self.smallest = min(self.smallest, interval / every)
        return interval / every, every

    def _choose(self, speed: float, interval: float) -> float:
        given = self._settings.step
        if given is None:
            state = self._states.get(speed)
            if state is None:
                state = equilibrium(self._model, speed).state
            level = level_track_with_friction(self._model.system)
            return choose_step(self._model, level, state, self._settings.scheme, interval)
        if not self.varies and abs(round(interval / given) * given - interval) > 1e-9 * interval:
            raise InputError([Fault(
                "settings", "step", f"found {given:g} s",
                f"a whole part of the output interval {interval:g} s",
            )])
        return given


def _duration(distance: float, speed: float, rate: float) -> float:
    """Time to cover `distance` at a speed that changes at `rate` [s]; without it if that stops."""
    square = speed**2 + 2.0 * rate * distance
    return 2.0 * distance / (speed + math.sqrt(square)) if square > 0.0 else distance / speed


def output_interval(settings: Settings, speed: float) -> float:
    """Time between two outputs [s]."""
    if settings.output_spacing is not None:
        return settings.output_spacing / speed
    return 1.0 / settings.output_rate


def _disturb(model: Model, settings: Settings, state: Floats) -> None:
    """Add the initial disturbance of the settings to a state."""
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


def _loop(
    prepared: Preparation,
    settings: Settings,
    plan: OutputPlan,
    sink: Sink,
    progress: Progress | None,
) -> tuple[int, int, Floats, float, NDArray[np.int64]]:
    """Run the time loop chunk by chunk: status, where, last state, CPU seconds, `Work.events`."""
    model = prepared.model
    work = work_arrays(model.system)
    state = prepared.state.copy()
    derivative = np.zeros_like(state)
    stages = np.zeros((3, len(state)))
    recorder = plan.recorder(ROWS)
    scheme = SCHEMES[settings.scheme]
    status, where, cpu_time, every = RUNNING, 0, 0.0, 1
    whole = _left(prepared, prepared.state)
    fresh = int(prepared.fresh)
    in_distance = prepared.pace.varies and settings.output_spacing is not None
    while status == RUNNING and (left := _left(prepared, state)) > 1e-9:
        begin = time.thread_time()  # a library's idle threads may still be spinning
        if in_distance:
            right_hand_side(model.system, work, state, derivative)
        step, every = prepared.pace.at(state[-1], derivative[-1])
        intervals = 1 if prepared.pace.varies else ROWS
        n_steps = min(intervals * every, math.ceil(left / step * (1.0 - 1e-9)))
        last = int(in_distance and n_steps == every)
        goal = state[-2] + (settings.output_spacing or 0.0)
        status, where, steps, rows = time_loop(
            model.system, work, state, derivative, stages, recorder, scheme, step, 0,
            n_steps - last, every, fresh, 0,
        )
        fresh = int(fresh and steps == 0)
        if last and status == RUNNING:
            # the last step of an interval of distance ends where the interval ends
            rest = _duration(goal - state[-2], state[-1], derivative[-1])
            status, where, more, first = time_loop(
                model.system, work, state, derivative, stages, recorder, scheme, rest, steps, 1,
                every, fresh, 0,
            )
            steps, rows = steps + more, rows + first
        cpu_time += time.thread_time() - begin
        if rows:
            sink.append(plan.chunk(recorder, rows, prepared.balance.Q0))
        if progress is not None:
            progress(min(1.0, 1.0 - _left(prepared, state) / whole))
    if status == RUNNING and steps % every == 0:
        status, where, _, rows = time_loop(
            model.system, work, state, derivative, stages, recorder, scheme, step, 0, 0, every, 0,
            1,
        )
        sink.append(plan.chunk(recorder, rows, prepared.balance.Q0))
    return status, where, state, cpu_time, work.events


def _left(prepared: Preparation, state: Floats) -> float:
    """Time to the end of the run at the present speed [s]."""
    by_distance = (prepared.end_distance - state[-2]) / state[-1]
    return float(min(prepared.end_time - state[-3], by_distance))


def _sentence(model: Model, status: int, where: int) -> str:
    names = model.index.wheelsets
    if status == NOT_FINITE:
        body = where % (6 * model.index.n_bodies) // 6
        names, where = model.index.bodies, min(body, model.index.n_bodies - 1)
    return STATUS[status][1].format(where=names[where])
