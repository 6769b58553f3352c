"""The inputs of a run beside its vehicle, checked: speed, start, end, the state to go on from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from numbers import Real
from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.elements.rows import Act, Link, Mount
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatVehicle, flatten, groups
from railsim.errors import Fault, Faults, argument_error, argument_fault, nearest
from railsim.model.assembly import check_fixed
from railsim.notation import QUANTITIES
from railsim.result import Result
from railsim.simulation.sampling import with_loop_rate
from railsim.simulation.step_choice import WRITTEN
from railsim.text import shortened
from railsim.units import speed_in_si

SPEED_RANGE = (0.5, 150.0)  # m/s
AS_IN_TABLE = 1e-3  # share by which a speed at the start may differ from that of a speed table
STATES = ("end", "memory")
"""Of a result's group `state`, what a run goes on from."""
# settings that a continued run may have of its own; it has no start and no initial disturbance
OUTPUT_SETTINGS = ("output_rate", "output_spacing", "outputs", "initial", "start_state")


class TakenUp(NamedTuple):
    """What a run goes on from."""

    motion: Floats  # float64[n_state], see `railsim.kernels.state`
    # commands, samples and memory of laws; None where nothing of it is known
    memory: Floats | None = None


@dataclass(frozen=True)
class Inputs:
    """The inputs of a run beside its vehicle."""

    track: Track
    settings: Settings
    speed: float
    start: float
    duration: float | None
    until: float | None

    @classmethod
    def checked(
        cls,
        track: Track,
        settings: Settings,
        speed: float | str | None,
        start: float,
        duration: float | None,
        until: float | None,
    ) -> "Inputs":
        """Return the inputs; raise InputError with all faults of speed, start and end."""
        number = speed_in_si(speed)
        check_numbers(speed=number, start=start, duration=duration, until=until)
        # of another type of number the time loop would be compiled again
        first, start = float(initial_speed(settings, number, start)), float(start)
        check_range(track, first, start, duration, until)
        return cls(track, settings, first, start, duration, until)


def check_numbers(**values: object) -> None:
    """Raise InputError with everything among the arguments that is neither None nor a number."""
    faults = Faults()
    for name, value in values.items():
        right = value is None or (isinstance(value, Real) and not isinstance(value, bool))
        allowed = "a number" + " of m/s, or a text such as '72 km/h'" * (name == "speed")
        faults.require(right, name, f"found {shortened(repr(value))}", allowed)
    faults.check()


def initial_speed(settings: Settings, speed: float | None, start: float) -> float:
    """Speed at the start: as given, or from the settings' speed table [m/s]."""
    if settings.drive.speed_table is not None:
        distance, value = np.array(settings.drive.speed_table).T
        first = float(np.interp(start, distance, value))
        if speed is not None and not math.isclose(speed, first, rel_tol=AS_IN_TABLE):
            allowed = f"none, or {first:.12g} m/s, that of settings.drive.speed_table at the start"
            raise argument_error("speed", f"found {speed:.12g} m/s", allowed)
        return first
    if speed is None:
        raise argument_error("speed", "no speed is given", "a speed in m/s, e.g. 20")
    return speed


def check_range(
    track: Track, speed: float, start: float, duration: float | None, until: float | None
) -> None:
    """Raise InputError with all faults of speed, start and end of a run."""
    faults, end = Faults(), f"{track.length:.12g} m"
    low, high = SPEED_RANGE
    right = low <= speed <= high
    faults.require(right, "speed", f"found {speed:.12g} m/s", f"{low:g} to {high:g} m/s")
    right = 0.0 <= start < track.length
    faults.require(right, "start", f"found {start:.12g} m", f"0 to less than {end}")
    if duration is not None:
        right = 0.0 < duration < math.inf
        faults.require(right, "duration", f"found {float(duration):.12g} s", "a positive number")
        faults.require(until is None, "duration", "given together with `until`", "one of the two")
    if until is not None:
        allowed = f"more than the start, {start:.12g} m, and at most {end}, the track's plan"
        right = start < until <= track.length
        faults.require(right, "until", f"found {float(until):.12g} m", allowed)
    faults.check()


def check_agreement(
    vehicle: Vehicle, track: Track, settings: Settings, speed: float, vehicle_name: str = ""
) -> None:
    """Check what can be known of a vehicle, its track and its settings before a model is made.

    `called`: the vehicle in messages; by default by its name. Raises InputError: the settings name
    bodies, elements or quantities that are not there, or give a step between two outputs; bodies
    that cannot be fixed on this track.
    """
    faults, outputs = Faults(), settings.outputs
    there = f" in vehicle '{vehicle_name or vehicle.name}'"
    fixed = any(body.fixed for group in groups(vehicle) for body in group.bodies.values())
    needed = fixed or settings.initial or outputs.elements
    # of a copy: a study would keep all its vehicles in this form
    flat = flatten(vehicle.model_copy()) if needed else FlatVehicle("", (), (), "")
    with faults.caught():
        check_fixed(flat, track, settings.drive.mode)
    bodies = [body.name for body in flat.bodies]
    for name in settings.initial:
        if name not in bodies:
            key, found = f"initial.{name}", f"no such body{there}"
            faults.append(Fault("settings", key, found, nearest(name, bodies)))
    recorded = [
        element.name
        for element in flat.elements
        if any(isinstance(row, Link | Mount | Act) for row in element.definition.rows())
    ]
    for word, patterns, names, where in (
        ("element", outputs.elements, recorded, there),
        ("quantity", outputs.quantities, [*QUANTITIES], ""),
    ):
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in names):
                key = "outputs.elements" if where else "outputs.quantities"
                found = f"no {word} is called '{pattern}'{where}"
                if where and any(fnmatchcase(e.name, pattern) for e in flat.elements):
                    found = f"'{pattern}'{where} has no deflection; torques: outputs.drives"
                faults.append(Fault("settings", key, found, nearest(pattern, names)))
    interval = with_loop_rate(settings).output_interval(speed)
    if settings.step is not None and settings.drive.mode == "constant":
        count = max(1, round(interval / settings.step))
        if abs(count * settings.step - interval) > WRITTEN * interval:
            allowed = f"an integer fraction of the output interval {interval:.12g} s"
            if outputs.low_pass is not None:
                allowed += ", at which outputs.low_pass takes values"
            faults.append(Fault("settings", "step", f"found {settings.step:.12g} s", allowed))
    faults.check()


def state_before(
    vehicle: Vehicle,
    track: Track,
    settings: Settings,
    resume: Result | Mapping[str, Floats] | Floats,
) -> TakenUp:
    """State with which a run goes on from another one.

    Raises InputError: the result holds no state, or is of another vehicle, track or other settings:
    going on would not give what an undisturbed run gives.
    """
    if not isinstance(resume, Result):
        states = resume if isinstance(resume, Mapping) else {"end": resume}
        values = [np.asarray(states[key]) for key in STATES if states.get(key) is not None]
        if not values or any(
            one.dtype.kind != "f" or one.ndim != 1 or not np.isfinite(one).all() for one in values
        ):
            found = "not finite numbers in a row"
            allowed = 'a result, or its states: result.groups["state"]'
            raise argument_error("resume", found, allowed, option="--continue")
        return TakenUp(*(one.astype(float) for one in values))
    faults = Faults()

    def require(right: bool, key: str, found: str, allowed: str) -> None:
        if not right:
            faults.append(argument_fault("resume", key, found, allowed, "--continue"))

    ended = "end" in resume.groups.get("state", {})
    require(ended, "", "the result holds no state at its end", "a result of `railsim run`")
    for kind, text in (("vehicle", vehicle.to_toml()), ("track", track.to_toml())):
        same = text == resume.attributes[f"{kind}_toml"]
        allowed = f"the {kind} with the assignments of the result"
        require(same, "", f"the result is of another {kind}", allowed)
    here, there = settings.model_dump(mode="json"), resume.settings().model_dump(mode="json")
    for key in here:
        same = key in OUTPUT_SETTINGS or here[key] == there[key]
        require(same, f"settings.{key}", f"found {here[key]}", f"{there[key]}, as in the result")
    if settings.initial:
        found, allowed = "given, and the run has no start", "none, or that of the result"
        require(here["initial"] == there["initial"], "settings.initial", found, allowed)
    faults.check()
    return state_before(vehicle, track, settings, resume.groups["state"])


def own_speed(before: Floats, speed: float | str | None, start: float) -> tuple[float, float]:
    """Speed and position of a state in which a run goes on, which gives them alone."""
    own = {"speed": float(before[-1]), "start": float(before[-2])}
    for name, given in (("speed", speed_in_si(speed)), ("start", start or None)):
        if given is not None and given != own[name]:
            raise argument_error(name, "given together with `resume`", "the state's own is used")
    return own["speed"], own["start"]
