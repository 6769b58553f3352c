"""Wear of wheels over distance and of rails over tonnage, with an update of the profiles.

All wheels have the same profile: their wear is averaged, as on a train that runs in both directions
and is turned.
"""

import gc
import hashlib
import json
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.wear import DEFAULT_LAW, WearLaw, wear_law
from railsim.assessment.wear_depth import parts_of_step, wheel_dimensions, worn_depth, worn_profile
from railsim.contact import contact_geometry
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.limits import WheelLimits
from railsim.definitions.settings import InitialState
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import Faults, ModelError, RailsimError, input_error
from railsim.linear.circle import circle
from railsim.profiles import Profile, load_profile
from railsim.profiles.used import used_profiles
from railsim.result import Result
from railsim.result.hunting import HUNTS
from railsim.simulation import simulate
from railsim.simulation.conditions import SPEED_RANGE
from railsim.studies.records import stored_record, write_record
from railsim.studies.spec import Progress
from railsim.version import __version__

AMPLITUDE = 3e-3  # m, at which EN 15302 compares equivalent conicities
DISTURBED = 6e-3  # m, of the leading wheelset, about the play in the track
TESTED = 20.0  # s, of a disturbed run
ROOM = 100.0  # m of its track, for the vehicle
KEPT = 3  # layout of stored steps
WHEEL = "wheel"
_LOG = logging.getLogger(__name__)


class Run(NamedTuple):
    """One of the runs that are averaged, with its share, in any unit."""

    vehicle: Vehicle
    track: Track
    speed: float
    share: float


@dataclass(frozen=True)
class WearStep:
    """One step of the wear loop; of rails distances are tonnages [kg].

    `depths`: of wear per distance or tonnage, mean of all wheels, tracks or vehicles and over the
    step, on `wear_depth.grid` [m/m] or [m/kg].
    """

    distance: float  # before the step [m]
    length: float  # in the step [m]
    profiles: Mapping[str, Profile]  # by side of the rail, or ``wheel``
    worn_profiles: Mapping[str, Profile]  # after the step
    depths: Mapping[str, Floats]

    @property
    def profile(self) -> Profile:
        """Of the wheels, in this step."""
        return self.profiles[WHEEL]

    @property
    def worn(self) -> Profile:
        """Of the wheels, after it."""
        return self.worn_profiles[WHEEL]

    @property
    def depth(self) -> Floats:
        """Of the wheels."""
        return self.depths[WHEEL]


@dataclass(frozen=True)
class Loop:
    """How a loop is carried out.

    - `step`: distance [m] or tonnage [kg] between two reported profiles.  Within a step the
      profiles are updated as often as one has worn by 0.1 mm
    - `steps`: number of steps
    - `law`: name of a law of `railsim.assessment.wear.LAWS`, or the path of a file of one
    - `settings`: the outputs that the loop needs are switched on
    - `folder`: folder for finished steps: the same call, or one with more steps, continues after
      them
    - `on_step`: called after each step; before an error also with the part of the step that was
      finished
    - `on_remark`: called with a sentence on every stored step that is damaged and computed again,
      on every route on which the vehicle hunts (it wears as no service does), and on the limit at
      which the loop ends.  By default these sentences are logged
    - `progress`: called repeatedly with the finished fraction
    """

    step: float
    steps: int
    law: str = DEFAULT_LAW
    settings: Settings | None = None
    folder: Path | None = None
    on_step: Callable[[WearStep], None] | None = None
    on_remark: Callable[[str], None] | None = None
    progress: Progress | None = None


def wear_loop(
    vehicle: Vehicle,
    routes: Sequence[tuple[Track, float, float]],
    *,
    limits: WheelLimits | None = None,
    **how: Any,
) -> list[WearStep]:
    """Wear of the wheels of a vehicle over distance, with an update of the profile at each step.

    `vehicle`: vehicle whose wheels all have the same profile; `routes`: tracks with their speeds
    [m/s] and shares of the distance; `limits`: dimensions of the wheel at which the loop ends;
    `how`: `Loop`: ``step`` and ``steps`` are required. Raises InputError: different wheel profiles;
    no route, or a route without a share; no step; too much wear in a step. ModelError: a run ended
    early; names profile, distance and track.
    """
    names = {name for _, name, _ in used_profiles(vehicle)}
    if len(names) != 1:
        found = f"{len(names)} wheel profiles"
        raise input_error("vehicle", found, "the same for all wheels", key="profile")
    (name,) = names
    runs = [Run(vehicle, *route) for route in routes]

    def depths(result: Result, law: WearLaw) -> dict[str, Floats]:
        wheels = product(range(len(result.wheelsets)), (0, 1))
        of_wheels = [worn_depth(result, wheelset, side, law) for wheelset, side in wheels]
        return {WHEEL: np.asarray(np.mean(of_wheels, axis=0))}

    def end_reason(worn: Mapping[str, Profile]) -> str:
        return limits.reached(asdict(wheel_dimensions(worn[WHEEL]))) if limits else ""

    wearing = Wearing(runs, {WHEEL: load_profile(name)}, {WHEEL: name}, depths, end_reason)
    return carry_out(wearing, Loop(**how))


@dataclass(frozen=True)
class Wearing:
    """What wears."""

    runs: Sequence[Run]
    new: Mapping[str, Profile]  # profiles at the beginning
    names: Mapping[str, str]  # by which vehicle or track call them
    # a result and a law to the depth of each profile per distance or tonnage
    depths: Callable[[Result, WearLaw], dict[str, Floats]]
    # worn profiles to the sentence why the loop ends; empty while it goes on
    end_reason: Callable[[Mapping[str, Profile]], str] = lambda _: ""
    outputs: Sequence[str] = ("contact_patches",)  # of the runs
    parameter: str = "routes"  # parameter of its runs
    unit: str = "km"  # of distance or tonnage in messages
    scale: float = 1e-3  # its factor from SI

    def amount(self, distance: float) -> str:
        """Return a distance or tonnage as messages give it."""
        return f"{self.scale * distance:.4g} {self.unit}"


def carry_out(wearing: Wearing, how: Loop) -> list[WearStep]:
    """Run, subtract what has worn, and run again."""
    _check(wearing, how)
    law, settings = wear_law(how.law), how.settings or Settings()
    needed = {**dict.fromkeys(wearing.outputs, True), "quantities": ()}  # all of the usual ones
    settings = settings.model_copy(update={"outputs": settings.outputs.model_copy(update=needed)})
    tell, remark = how.progress or (lambda _: None), how.on_remark or _LOG.warning
    profiles, whole = dict(wearing.new), how.steps * how.step
    steps: list[WearStep] = []
    hunting: set[str] = set()

    def finish(at: float, length: float, worn: dict[str, Profile], lost: dict[str, Floats]) -> None:
        mean = {name: depth / length for name, depth in lost.items()}
        steps.append(WearStep(at, length, profiles, worn, mean))
        if how.on_step is not None:
            how.on_step(steps[-1])

    for number in range(how.steps):
        start = distance = number * how.step
        worn, left = profiles, how.step
        lost = {name: np.zeros(1) for name in profiles}
        try:
            while left > 0.0:
                gc.collect()  # what a run leaves holds the contact table of its profile, 0.1 GB

                def part(done: float, before: float = distance, remaining: float = left) -> None:
                    tell((before + remaining * done) / whole)

                path = how.folder and how.folder / _file_name(
                    wearing, settings, how.step, law, worn
                )
                if stored := stored_record(path, remark):
                    depths = {name: np.asarray(depth) for name, depth in stored["depths"].items()}
                    hunts = stored["hunts"]
                else:
                    depths, hunts = _wear(wearing, settings, law, worn, distance, part)
                    if path is not None:
                        lists = {name: depth.tolist() for name, depth in depths.items()}
                        write_record(path, {"distance": distance, "depths": lists, "hunts": hunts})
                for route, words in hunts.items():
                    if route not in hunting:
                        remark(f"after {wearing.amount(distance)} on {route}: {words}")
                hunting |= hunts.keys()
                length = left / max(parts_of_step(worn[k], depths[k], left) for k in worn)
                worn = {k: worn_profile(worn[k], depths[k], length) for k in worn}
                lost = {k: lost[k] + depths[k] * length for k in worn}
                distance, left = distance + length, left - length
                if why := wearing.end_reason(worn):
                    remark(f"after {wearing.amount(distance)}: {why}: the loop ends")
                    finish(start, distance - start, worn, lost)
                    return steps
        except RailsimError:
            if distance > start:
                finish(start, distance - start, worn, lost)
            raise
        finish(start, how.step, worn, lost)
        tell((number + 1) / how.steps)
        profiles = worn
    return steps


def wear_rows(
    steps: Sequence[WearStep], vehicle: Vehicle, track: Track
) -> list[dict[str, float | None]]:
    """Wear after each step.

    `steps`: result of `wear_loop`, from its beginning; `vehicle`, `track`: wheelset and rails for
    the equivalent conicity. Returns: the new wheel, then the wheel after each step: `distance` [m],
    `area` [m2], `deepest` [m] and its position `deepest_y` from the nominal rolling circle [m], all
    since the beginning, `equivalent_conicity` at 3 mm (EN 15302), None if it does not exist, and
    the dimensions of `wear_depth.WheelDimensions` [m].
    """
    (wheelset, *_) = (body.wheelset for body in flatten(vehicle).bodies if body.wheelset)
    rails = load_profile(track.rail[0]), load_profile(track.rail[1])
    rows = []
    for distance, worn, lost in since_new(steps, WHEEL):
        (conicity,) = contact_geometry(
            worn, rails, wheelset.radius, track.gauge, track.inclination, wheelset.back_to_back
        ).equivalent_conicity([AMPLITUDE])
        rows.append({
            **row(distance, worn, lost),
            "equivalent_conicity": float(conicity) if math.isfinite(conicity) else None,
            **asdict(wheel_dimensions(worn)),
        })  # fmt: skip
    return rows


def since_new(steps: Sequence[WearStep], name: str) -> list[tuple[float, Profile, Floats]]:
    """Return distance, profile and its loss in z since it was new: at first, after each step."""
    if not steps:
        return []
    new = steps[0].profiles[name]
    wheels = [(0.0, new), *((s.distance + s.length, s.worn_profiles[name]) for s in steps)]
    return [(at, worn, np.abs(np.asarray(new.z) - np.asarray(worn.z))) for at, worn in wheels]


def row(distance: float, worn: Profile, lost: Floats) -> dict[str, float | None]:
    """Worn area, largest depth and where it is, None where nothing is worn."""
    deepest = int(np.argmax(lost))
    return {
        "distance": distance,
        "area": float(np.trapezoid(lost, worn.y)),
        "deepest": float(lost[deepest]),
        "deepest_y": float(worn.y[deepest]) if lost[deepest] else None,
    }


def _check(wearing: Wearing, how: Loop) -> None:
    faults, parameter = Faults(), wearing.parameter
    option = f"--{parameter.removesuffix('s')}"
    faults.require(wearing.runs, parameter, "none", "at least one", option)
    low, high = SPEED_RANGE
    for run in wearing.runs:
        where = f"for {run.vehicle.name} on {run.track.name}"
        found, allowed = f"found {run.speed:.12g} m/s {where}", f"{low:g} to {high:g} m/s"
        faults.require(low <= run.speed <= high, parameter, found, allowed, option)
        valid = run.share > 0.0 and math.isfinite(run.share)
        found = f"found a share of {run.share:.12g} {where}"
        faults.require(valid, parameter, found, "above 0", option)
    valid = how.step > 0.0 and math.isfinite(how.step)
    faults.require(valid, "step", f"found {wearing.amount(how.step)}", "above 0")
    with faults.caught():
        wear_law(how.law)
    faults.require(how.steps >= 1, "steps", f"found {how.steps}", "1 or more")
    faults.check()


def _file_name(
    wearing: Wearing, settings: Settings, step: float, law: WearLaw, worn: Mapping[str, Profile]
) -> str:
    """Name of the file of a step: a hash of all its inputs."""
    inputs: list[Any] = [
        __version__, KEPT, law.name, law.constants, step, settings.to_toml(),
        [profile.key().hex() for profile in worn.values()],
        [(r.vehicle.to_toml(), r.track.to_toml(), r.speed, r.share) for r in wearing.runs],
        sorted(profile.key().hex() for r in wearing.runs for profile in _unworn(wearing, r)),
    ]  # fmt: skip
    return f"{hashlib.sha256(json.dumps(inputs).encode()).hexdigest()[:24]}.json"


def _unworn(wearing: Wearing, run: Run) -> list[Profile]:
    """Profiles of a run that do not wear."""
    names = {name for _, name, _ in (*used_profiles(run.vehicle), *used_profiles(run.track))}
    return [load_profile(name) for name in names - {*wearing.names.values()}]


def _wear(
    wearing: Wearing,
    settings: Settings,
    law: WearLaw,
    worn: Mapping[str, Profile],
    distance: float,
    progress: Progress,
) -> tuple[dict[str, Floats], dict[str, str]]:
    """Depth of wear per distance or tonnage, mean of the runs weighted by their shares.

    And sentences on hunting by track and speed.
    """
    total = sum(run.share for run in wearing.runs)
    several = len({run.vehicle.name for run in wearing.runs}) > 1  # of them it is said which
    depths, hunts = [], dict[str, str]()
    worn_profiles = {wearing.names[name]: profile for name, profile in worn.items()}
    for number, run in enumerate(wearing.runs):

        def part(done: float, before: int = number) -> None:
            progress((before + done) / len(wearing.runs))

        of_vehicle = f", {run.vehicle.name}" if several else ""
        known = {rail: load_profile(rail) for rail in run.track.rail if rail not in worn_profiles}
        known |= worn_profiles
        try:
            result = simulate(
                run.vehicle, run.track, speed=run.speed, settings=settings, profiles=known,
                progress=part,
            )  # fmt: skip
            if result.status != "complete":
                raise ModelError(f"{result.status}, {result.attributes['status_reason']}")
            of_run = wearing.depths(result, law)
            depths.append({k: run.share / total * depth for k, depth in of_run.items()})
            hunting = _hunting(result) or _hunting_when_disturbed(run, settings, known)
        except ModelError as error:
            names = ", ".join(profile.name for profile in worn.values())
            place = f"{names} after {wearing.amount(distance)} on {run.track.name}{of_vehicle}"
            raise ModelError(f"{place}: {error}") from None
        if hunting:
            hunts[f"{run.track.name} at {run.speed:g} m/s{of_vehicle}"] = hunting
    return ({k: np.asarray(np.sum([d[k] for d in depths], axis=0)) for k in worn}, hunts)


def _hunting(result: Result) -> str | None:
    return next((words for words in result.remarks if words.startswith(HUNTS)), None)


def _hunting_when_disturbed(
    run: Run, settings: Settings, profiles: Mapping[str, Profile]
) -> str | None:
    """Say whether the vehicle hunts on the straights of a route: nothing disturbs it there."""
    straights = [part for part in curvature_sections(run.track) if part.type == "STR"]
    if not straights:
        return None
    longest = max(straights, key=lambda part: part.end - part.begin)
    middle = 0.5 * (longest.begin + longest.end)
    # with friction and support of its place: without curves, crossings and what lies elsewhere
    plain = circle(run.track, at=middle).replace(
        plan=[{"type": "STR", "length": run.speed * TESTED + ROOM}], cant=[]
    )
    leading = flatten(run.vehicle).of_kind("wheelset")[0].name
    disturbed = settings.model_copy(update={"initial": {leading: InitialState(y=DISTURBED)}})
    result = simulate(
        run.vehicle, plain, speed=run.speed, duration=TESTED, settings=disturbed, profiles=profiles
    )
    how = f"disturbed by {1e3 * DISTURBED:g} mm"
    if result.status != "complete":
        return f"A run {how} is {result.status}, {result.attributes['status_reason']}"
    words = _hunting(result)
    return words and f"{words.split(', from s')[0]}, {how}."
