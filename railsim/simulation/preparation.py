"""From definitions to a run that can begin: model, equilibrium, step, state, output."""

import logging
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import argument_error, listed
from railsim.kernels.controllers import RUN_START
from railsim.kernels.state import TIME
from railsim.model.assembly import Model, assemble
from railsim.model.control import periods, with_control
from railsim.model.equilibrium import Equilibrium, stored_equilibrium
from railsim.model.plausibility import (
    flangeway_remarks,
    gauge_remarks,
    narrow_remarks,
    profile_remarks,
    vehicle_remarks,
)
from railsim.model.time_step import SCHEMES
from railsim.profiles import Profile
from railsim.result import Sink
from railsim.result.stored import StoredPeaks, lost_peak
from railsim.simulation.advance import Preparation, Run
from railsim.simulation.auxiliary_track import Progress as SettlingProgress
from railsim.simulation.conditions import Inputs, TakenUp, check_agreement
from railsim.simulation.disturbance import disturb
from railsim.simulation.first_start import compiled_beside
from railsim.simulation.outputs import OutputPlan, run_extremes
from railsim.simulation.run_in import start_state
from railsim.simulation.run_progress import RunProgress
from railsim.simulation.sampling import filtering, low_pass_remark, output_words, with_loop_rate
from railsim.simulation.step_choice import StepChoice, inputs_hash
from railsim.track.irregularity import measured_remarks

# of the start, before peaks are evaluated: time, and share of the run at most
LEFT_OUT, SHARE_LEFT_OUT = 1.0, 0.1  # s, 1
_START = logging.getLogger("railsim.start")  # remarks on a run that begins


def prepare(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    speed: float,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    profiles: Mapping[str, Profile] | None = None,
    before: TakenUp | None = None,
    *,
    on_judgement: SettlingProgress | None = None,
    on_run_in: SettlingProgress | None = None,
) -> Preparation:
    """Assemble, balance, choose the step and set the initial state: `before`, where it is given."""
    balance, steps = _equilibrium_and_steps(vehicle, track, settings, speed, profiles, on_judgement)
    model = balance.model
    step, _ = steps.at(speed)
    unusual = [*settings.unusual(), *vehicle_remarks(vehicle, model)]
    unusual += [*gauge_remarks(model.flat, track), *narrow_remarks(model, track.gauge)]
    unusual += flangeway_remarks(model, track)
    remarks: list[str] = [*balance.remarks, *map(str, unusual), *measured_remarks(track)]
    remarks += profile_remarks(model, profiles)
    if before is None:
        state, on_the_way = start_state(
            model,
            balance,
            track,
            start,
            step,
            SCHEMES[settings.scheme],
            on_run_in,
            remarks.append if settings.start_state == "steady" else None,
        )
        remarks += begins_on_sections(model, start - step * speed * on_the_way)
        remarks += disturb(model, balance.Q0, settings, state)
    else:
        state = _check_length(before.motion, model.n_state)
    model = with_control(model, vehicle, settings)
    memory = model.system.user_laws.memory.copy()
    memory[RUN_START] = state[TIME]
    if before is not None and before.memory is not None:
        memory = _check_length(before.memory, len(memory))
    prepared = Preparation(
        model,
        balance,
        state,
        end_time=math.inf if duration is None else float(state[TIME]) + duration,
        end_distance=track.length if until is None else until,
        steps=steps,
        fresh=before is None,
        memory=memory,
        remarks=tuple(remarks),
    )
    return replace(prepared, evaluation=_begin_of_evaluation(prepared, settings))


def begins_on_sections(model: Model, start: float) -> Iterator[str]:
    """Remark on wheelsets that are within a range of sections where the run-in starts [m]."""
    system = model.system
    places = start + system.frame_offset[system.bodies.frame[system.contact.body]]
    begin, end = model.rails.ends.T
    inside = ((begin < places[:, None]) & (places[:, None] < end)).any(axis=1)
    names = [name for name, there in zip(model.index.wheelsets, inside, strict=True) if there]
    if names:
        yield (
            f"The run, or its run-in, begins with {listed(names)} within a range of "
            "track.sections, in the state on the plain rail."
        )


def _equilibrium_and_steps(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    speed: float,
    profiles: Mapping[str, Profile] | None = None,
    on_judgement: SettlingProgress | None = None,
) -> tuple[Equilibrium, StepChoice]:
    """Return the model in its equilibrium, and what chooses its steps."""
    with compiled_beside():
        model = assemble(vehicle, track, settings, profiles)
    inputs = inputs_hash(vehicle, track, settings, model)
    balance = stored_equilibrium(model, speed, inputs)
    known = {speed: balance.state}
    straight = inputs_hash(vehicle, track, settings, model, straight=True)
    how = with_loop_rate(settings), track, known, inputs, straight, on_judgement, periods(vehicle)
    return balance, StepChoice(balance.model, *how)


def check_step(vehicle: Vehicle, track: Track, settings: Settings, speed: float) -> None:
    """Raise InputError: the step of the settings is not stable; or ModelError, as `simulate`."""
    _equilibrium_and_steps(vehicle, track, settings, speed)[1].at(speed)


def check_own_outputs(vehicle: Vehicle, track: Track, settings: Settings) -> None:
    """Raise InputError: quantities of one's own of what the run does not output."""
    OutputPlan(assemble(vehicle, track, settings), settings, track, vehicle)


def _begin_of_evaluation(preparation: Preparation, settings: Settings) -> float:
    """Time from which on peaks are evaluated: without the start, but not where a run goes on."""
    begin = float(preparation.state[TIME])
    if not preparation.fresh:
        return begin
    after = settings.outputs.evaluate_after
    if after is None:
        return begin + min(LEFT_OUT, SHARE_LEFT_OUT * preparation.left(preparation.state))
    return begin + after


def _check_length(before: Floats, length: int) -> Floats:
    """Return values with which a run goes on, of which there have to be so many."""
    if len(before) != length:
        found, allowed = f"a state of {before.size} values", f"{length}, those of this vehicle"
        raise argument_error("resume", found, allowed, option="--continue")
    return before.copy()


def begin(
    vehicle: Vehicle,
    inputs: Inputs,
    sink: Sink,
    profiles: Mapping[str, Profile] | None,
    before: TakenUp | None,
    fraction: RunProgress,
) -> Run:
    """Prepare a run and tell its sink what will come."""
    began = time.perf_counter()
    settings = inputs.settings
    check_agreement(vehicle, inputs.track, settings, inputs.speed)
    prepared = prepare(
        vehicle,
        inputs.track,
        settings,
        inputs.speed,
        inputs.start,
        inputs.duration,
        inputs.until,
        profiles,
        before,
        on_judgement=fraction.of_judgement,
        on_run_in=fraction.of_run_in,
    )
    for remark in prepared.remarks:
        _START.warning(remark)
    plan = OutputPlan(prepared.model, settings, inputs.track, vehicle)
    stored = StoredPeaks(sink, prepared.evaluation)
    sink = filtering(stored, settings)
    sink.begin(plan.coordinates, plan.quantities)
    run = Run(prepared, plan, sink, settings, wall_time=time.perf_counter() - began)
    # which holds neither the sink nor the run: a circle would keep the tables in memory
    largest, Q0 = stored.largest, prepared.balance.Q0
    of_part = run.extremes, run.evaluated
    stored.remark = lambda evaluates: lost_peak(
        largest,
        run_extremes(of_part[evaluates], Q0),
        output_words(settings),
        filtered=settings.outputs.low_pass is not None,
    )
    run.remarks.extend(filter(None, [low_pass_remark(settings)]))
    return run
