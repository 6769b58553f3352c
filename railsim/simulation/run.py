"""`simulate`: the story of a run on one page; `simulate_together`: of several in one call.

Definitions are assembled to arrays, the vehicle finds its equilibrium on straight level track, the
step is chosen, and the time loop runs in chunks (`railsim.simulation.advance`).  The outcome goes
chunk by chunk to a sink.
"""

import json
import logging
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, nearest
from railsim.kernels.status import NOT_FINITE, STATUS
from railsim.model.assembly import Model, SharedTables, assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.time_step import SCHEMES
from railsim.profiles import Profile
from railsim.result import MemorySink, Result, Sink
from railsim.result.stored import StoredPeaks, lost_peak
from railsim.simulation.advance import Preparation, Run, advance
from railsim.simulation.outputs import OutputPlan, run_extremes
from railsim.simulation.pace import Pace
from railsim.simulation.remarks import run_remarks
from railsim.simulation.right_samples import filtering, low_pass_remark, output_words, sampled
from railsim.simulation.run_in import start_state
from railsim.simulation.settling import DOING
from railsim.simulation.settling import Progress as SettlingProgress

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

_LOG = logging.getLogger(__name__)
SPEED_RANGE = (0.5, 150.0)  # m/s
# settings that a continued run may have of its own; it has no start and no initial disturbance
OUTPUT_SETTINGS = ("output_rate", "output_spacing", "outputs", "initial", "start_state")


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
    _check_types([vehicle], track)
    settings = settings or Settings()
    before = None if resume is None else state_before(vehicle, track, settings, resume)
    if before is not None:
        speed, start = float(before[-1]), float(before[-2])
    (outcome,) = outcomes(
        [vehicle],
        track,
        speed=speed,
        start=start,
        duration=duration,
        until=until,
        settings=settings,
        sinks=None if sink is None else [sink],
        progress=progress,
        profiles=profiles,
        before=before,
    )
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def simulate_together(
    vehicles: Sequence[Vehicle],
    track: Track,
    *,
    speed: float | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    settings: Settings | None = None,
    sinks: Sequence[Sink] | None = None,
    progress: Progress | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> list[Result]:
    """Run several vehicles over one track, many in one call of the time loop.

    Each result is that of `simulate`; the runs share what a call costs and the vector registers.
    Vehicles that need another step, and all in free running, run apart.

    Parameters
    ----------
    vehicles : sequence of Vehicle
        Such as one vehicle with different parameters; they do not feel each other.
    sinks : sequence of Sink, optional
        One for each vehicle.

    Others as in `simulate`.

    Returns
    -------
    list of Result
        In the order of the vehicles.  `cpu_time` and `wall_time` are the shares of each; the
        attribute `runs_together` says how many were in one call.

    Raises
    ------
    InputError, ModelError
        As `simulate`; of several vehicles with errors the first one's, when all others are done.

    Examples
    --------
    >>> import railsim
    >>> soft = railsim.load_vehicle("coach_manchester")
    >>> hard = railsim.load_vehicle("coach_flexicoil")
    >>> track = railsim.load_track("curve_r250")
    >>> results = railsim.simulate_together([soft, hard], track, speed=20.0, until=10.0)
    >>> [result.attributes["runs_together"] for result in results]
    [2, 2]
    """
    results = []
    for number, outcome in enumerate(
        outcomes(
            vehicles,
            track,
            speed=speed,
            start=start,
            duration=duration,
            until=until,
            settings=settings,
            sinks=sinks,
            progress=progress,
            profiles=profiles,
        )
    ):
        if isinstance(outcome, Exception):
            outcome.add_note(f"this was vehicle {number + 1} of {len(vehicles)}")
            raise outcome
        results.append(outcome)
    return results


@dataclass(frozen=True)
class _Inputs:
    """What the runs of one call have in common."""

    track: Track
    settings: Settings
    speed: float
    start: float
    duration: float | None
    until: float | None


def outcomes(
    vehicles: Sequence[Vehicle],
    track: Track,
    *,
    speed: float | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    settings: Settings | None = None,
    sinks: Sequence[Sink] | None = None,
    progress: Progress | None = None,
    profiles: Mapping[str, Profile] | None = None,
    before: Floats | None = None,
) -> list[Result | Exception]:
    """As `simulate_together`, but what goes wrong with a vehicle stands in its result's place.

    Parameters
    ----------
    before : float64[n_state], optional
        State in which the run of a single vehicle begins.
    """
    _check_types(vehicles, track)
    settings = settings or Settings()
    speed = initial_speed(settings, speed, start)
    check_range(track, speed, start, duration, until)
    inputs = _Inputs(track, settings, speed, start, duration, until)
    shared = SharedTables()
    found: list[Result | Exception | None] = [None] * len(vehicles)
    runs: dict[Run, int] = {}
    sinks = [MemorySink() for _ in vehicles] if sinks is None else sinks
    told = _Told(progress, len(vehicles), inputs)
    for number, (vehicle, sink) in enumerate(zip(vehicles, sinks, strict=True)):
        told.next_run()
        try:
            run = _begun(vehicle, inputs, sink, profiles, before, shared, told)
        except Exception as error:
            found[number] = error
        else:
            runs[run] = number
    DOING.info("")
    for run in advance(list(runs), settings, told.of_runs):
        number = runs[run]
        try:
            found[number] = run.error or _ended(run, vehicles[number], inputs, before)
        except Exception as error:
            found[number] = error
    return [outcome for outcome in found if outcome is not None]


class _Told:
    """The finished fraction of runs and of what comes before them, by simulated time.

    Before a run its step is judged in flange contact, and it may have a run-in.

    Parameters
    ----------
    progress : callable or None
        Called with the finished fraction of all runs.
    number : int
        How many they are.
    inputs : _Inputs
        What they have in common.
    """

    def __init__(self, progress: Progress | None, number: int, inputs: _Inputs) -> None:
        self._progress, self._number = progress, number
        end = inputs.track.length if inputs.until is None else inputs.until
        by_distance = (end - inputs.start) / inputs.speed
        self._length = min(inputs.duration or math.inf, by_distance)  # of one run [s]
        self._before = 0.0  # simulated while other runs were prepared [s]
        self._judged = self._run_in = 0.0  # and this one
        self._on_their_way = False
        self._fraction = 0.0

    def next_run(self) -> None:
        """Take note that another run is prepared."""
        self._before += self._judged + self._run_in
        self._judged = self._run_in = 0.0
        self._tell(self._fraction)

    def of_judgement(self, done: float, whole: float) -> None:
        """Take the time that has been simulated to judge a step, and all of it [s]."""
        if self._on_their_way:  # at another speed: the runs wait for it
            self._tell(self._fraction)
            return
        self._judged = done
        self._tell((self._before + done) / (self._number * (whole + self._length)))

    def of_run_in(self, done: float, whole: float) -> None:
        """Take the time of a run-in that has been simulated, and all of it [s]."""
        self._run_in = done
        each = self._judged + whole + self._length
        self._tell((self._before + self._judged + done) / (self._number * each))

    def of_runs(self, fraction: float) -> None:
        """Take the finished fraction of what follows the preparation."""
        self._on_their_way = True
        before = self._before + self._judged + self._run_in
        runs = self._number * self._length
        self._tell(1.0 - (1.0 - fraction) * runs / (before + runs))

    def _tell(self, fraction: float) -> None:
        # a preparation that has to be longer than expected takes nothing back
        self._fraction = max(self._fraction, fraction)
        if self._progress is not None:
            self._progress(self._fraction)


def _begun(
    vehicle: Vehicle,
    inputs: _Inputs,
    sink: Sink,
    profiles: Mapping[str, Profile] | None,
    before: Floats | None,
    shared: SharedTables,
    told: _Told,
) -> Run:
    """Prepare a run and tell its sink what will come."""
    began = time.perf_counter()
    settings = inputs.settings
    prepared = prepare(
        vehicle,
        inputs.track,
        settings,
        inputs.speed,
        inputs.start,
        inputs.duration,
        inputs.until,
        profiles,
        shared,
        before,
        on_judgement=told.of_judgement,
        on_run_in=told.of_run_in,
    )
    plan = OutputPlan(prepared.model, settings, inputs.track, vehicle)
    stored = StoredPeaks(sink)
    sink = filtering(stored, settings)
    sink.begin(plan.coordinates, plan.quantities)
    run = Run(
        prepared,
        plan,
        sink,
        prepared.state.copy(),
        prepared.fresh,
        wall_time=time.perf_counter() - began,
    )
    # which holds neither the sink nor the run: a circle would keep the tables in memory
    largest, extremes, Q0 = stored.largest, run.extremes, prepared.balance.Q0
    stored.remark = lambda: lost_peak(
        largest, run_extremes(extremes, Q0), output_words(settings),
        filtered=settings.outputs.low_pass is not None,
    )  # fmt: skip
    run.remarks.extend(filter(None, [low_pass_remark(settings)]))
    return run


def _ended(run: Run, vehicle: Vehicle, inputs: _Inputs, before: Floats | None) -> Result:
    """Close a run: its result, with all facts about it."""
    began = time.perf_counter()
    prepared, settings = run.prepared, inputs.settings
    simulated = float(run.state[-3] - prepared.state[-3])
    attributes: dict[str, str | float | int] = {
        "status": STATUS[run.status][0],
        "status_reason": _sentence(prepared.model, run.status, run.where),
        "remarks": "\n".join(run_remarks(run)),
        "vehicle_toml": vehicle.to_toml(),
        "track_toml": inputs.track.to_toml(),
        "settings_json": json.dumps(settings.model_dump(mode="json")),
        "speed": float(inputs.speed),
        "start": float(inputs.start),
        "duration": simulated,
        **{
            f"asked_{name}": float(value)
            for name, value in (("duration", inputs.duration), ("until", inputs.until))
            if value is not None
        },
        "step": prepared.pace.smallest,
        "scheme": settings.scheme,
        "wall_time": run.wall_time + time.perf_counter() - began,
        "cpu_time": run.cpu_time,
        "runs_together": run.together,
        "patches_evaluated": int(run.events[0]),
        "patches_out_of_range": int(run.events[1]),
        "steps_divided": run.divided,
        "real_time_factor": simulated / run.cpu_time if run.cpu_time > 0.0 else math.inf,
    }
    result = run.sink.close(
        attributes,
        {"Q0": prepared.balance.Q0},
        prepared.model.profiles,
        {
            "state": {"end": run.state} | ({} if before is None else {"start": before}),
            # of quantities that are stored filtered the peaks are those of what is stored
            **(
                {}
                if settings.outputs.low_pass is not None
                else {"peaks": run_extremes(run.extremes, prepared.balance.Q0)}
            ),
        },
    )
    for remark in result.remarks:
        if remark != low_pass_remark(settings):  # what was asked for is no warning
            _LOG.warning(remark)
    return result


def _check_types(vehicles: Sequence[object], track: object) -> None:
    """Raise TypeError where a name or a file is given in place of what it stands for."""
    for kind, wanted, given in [
        *(("vehicle", Vehicle, vehicle) for vehicle in vehicles),
        ("track", Track, track),
    ]:
        if not isinstance(given, wanted):
            found = repr(given) if isinstance(given, str) else f"a {type(given).__name__}"
            raise TypeError(f"the {kind} is {found}; give what railsim.load_{kind} returns")


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
        faults.append(
            Fault(
                "--until",
                "",
                f"found {until:g} m",
                f"more than the start, {start:g} m, and at most {track.length:g} m, "
                "the track's plan",
            )
        )
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
    shared: SharedTables | None = None,
    before: Floats | None = None,
    *,
    on_judgement: SettlingProgress | None = None,
    on_run_in: SettlingProgress | None = None,
) -> Preparation:
    """Assemble, balance, choose the step and set the initial state: `before`, where it is given."""
    balance = equilibrium(assemble(vehicle, track, settings, profiles, shared), speed)
    model = balance.model
    pace = Pace(model, sampled(settings), track, {speed: balance.state}, on_judgement)
    step, _ = pace.at(speed)
    remarks: list[str] = [*balance.remarks]
    if before is None:
        state = start_state(
            model,
            balance,
            track,
            start,
            step,
            SCHEMES[settings.scheme],
            on_run_in,
            remarks.append if settings.start_state == "steady" else None,
        )
        _disturb(model, settings, state)
    else:
        state = _taken_up(model, before)
    return Preparation(
        model,
        balance,
        state,
        end_time=math.inf if duration is None else float(state[-3]) + duration,
        end_distance=track.length if until is None else until,
        pace=pace,
        fresh=before is None,
        remarks=tuple(remarks),
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
        faults.append(
            Fault(
                "--continue",
                "",
                "the result holds no state at its end",
                "a result of `railsim run`",
            )
        )
    for kind, text in (("vehicle", vehicle.to_toml()), ("track", track.to_toml())):
        if text != resume.attributes[f"{kind}_toml"]:
            faults.append(
                Fault(
                    "--continue",
                    "",
                    f"the result is of another {kind}",
                    f"the {kind} and the --set {kind}... of the result",
                )
            )
    here, there = settings.model_dump(mode="json"), resume.settings().model_dump(mode="json")
    faults += [
        Fault(
            "--continue",
            f"settings.{key}",
            f"found {here[key]}",
            f"{there[key]}, as in the result (--settings, --set)",
        )
        for key in here
        if key not in OUTPUT_SETTINGS and here[key] != there[key]
    ]
    if faults:
        raise InputError(faults)
    return np.array(resume.groups["state"]["end"])


def _taken_up(model: Model, before: Floats) -> Floats:
    """State `before` in which a run goes on."""
    if before.shape != (model.n_state,):
        raise InputError(
            [
                Fault(
                    "--continue",
                    "",
                    f"a state of {before.size} values",
                    f"{model.n_state} values, those of this vehicle",
                )
            ]
        )
    return before.copy()


def _disturb(model: Model, settings: Settings, state: Floats) -> None:
    """Add the initial disturbance of the settings to a state."""
    n = model.index.n_bodies
    for name, change in settings.initial.items():
        if name not in model.index.bodies:
            raise InputError(
                [
                    Fault(
                        "settings",
                        f"initial.{name}",
                        "no such body",
                        nearest(name, model.index.bodies),
                    )
                ]
            )
        place = model.index.coordinate(name, 0)
        state[place : place + 6] += (
            change.x,
            change.y,
            change.z,
            change.roll,
            change.pitch,
            change.yaw,
        )
        state[6 * n + place : 6 * n + place + 6] += (
            change.vx,
            change.vy,
            change.vz,
            change.vroll,
            change.vpitch,
            change.vyaw,
        )


def _sentence(model: Model, status: int, where: int) -> str:
    names = model.index.wheelsets
    if status == NOT_FINITE:
        body = where % (6 * model.index.n_bodies) // 6
        names, where = model.index.bodies, min(body, model.index.n_bodies - 1)
    return STATUS[status][1].format(where=names[where])
