"""Wear of wheel profiles over distance, with an update of the profile at each step.

All wheels have the same profile: their wear is averaged, as on a train that runs in both directions
and is turned.
"""

import hashlib
import json
import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from railsim.assessment.wear import DEFAULT_LAW, WearLaw, wear_law
from railsim.assessment.wear_depth import parts_of_step, worn_depth, worn_profile
from railsim.contact import contact_geometry
from railsim.definitions.flatten import flatten
from railsim.definitions.settings import InitialState, Settings
from railsim.definitions.track import Track
from railsim.definitions.track_tables import Straight
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, ModelError, RailsimError
from railsim.profiles import Profile, load_profile
from railsim.result import Result
from railsim.result.filters import Floats
from railsim.result.hunting import HUNTS
from railsim.simulation import simulate
from railsim.studies.records import read_record, write_record
from railsim.version import __version__

AMPLITUDE = 3e-3  # m, at which EN 15302 compares equivalent conicities
DISTURBED = 6e-3  # m, of the leading wheelset, about the play in the track
TESTED = 20.0  # s, of a disturbed run
ROOM = 100.0  # m of its track, for the vehicle
KEPT = 2  # layout of stored steps
_LOG = logging.getLogger(__name__)


class Route(NamedTuple):
    """A track, the speed on it [m/s] and its share of the distance, in any unit."""

    track: Track
    speed: float
    share: float


@dataclass(frozen=True)
class WearStep:
    """One step of the wear loop.

    Attributes
    ----------
    distance, length : float
        Distance run before the step, and in the step [m].
    profile, worn : Profile
        Wheel profile in this step, and after it.
    depth : float64[position]
        Depth of wear per distance, mean of all wheels and over the step, on `wear_depth.grid`
        [m/m].
    """

    distance: float
    length: float
    profile: Profile
    worn: Profile
    depth: Floats


class _Wear(NamedTuple):
    """Mean depth of wear per distance [m/m]; sentences on hunting by track and speed."""

    depth: Floats
    hunts: dict[str, str]


def wear_loop(
    vehicle: Vehicle,
    routes: Sequence[tuple[Track, float, float]],
    *,
    step: float,
    steps: int,
    law: str = DEFAULT_LAW,
    settings: Settings | None = None,
    folder: Path | None = None,
    on_step: Callable[[WearStep], None] | None = None,
    on_remark: Callable[[str], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[WearStep]:
    """Wear of the wheels of a vehicle over distance, with an update of the profile at each step.

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle whose wheels all have the same profile.
    routes : sequence of Route or (Track, float, float)
        Tracks with their speeds [m/s] and shares of the distance.
    step : float
        Distance between two reported profiles [m].  Within a step the profile is updated as
        often as it has worn by 0.1 mm.
    steps : int
        Number of updates.
    law : str
        Name of a law of `railsim.assessment.wear.LAWS`, or the path of a file of one.
    settings : Settings, optional
        `outputs.contact_patches` is switched on.
    folder : Path, optional
        Folder for finished steps: the same call, or one with more steps, continues after them.
    on_step : callable, optional
        Called after each step; before an error also with the part of the step that was finished.
    on_remark : callable, optional
        Called with a sentence on every stored step that is damaged and computed again, and on
        every route on which the vehicle hunts: it wears as no service does.  By default these
        sentences are logged.
    progress : callable, optional
        Called repeatedly with the finished fraction.

    Raises
    ------
    InputError : different wheel profiles; no route, or a route without a share; no step; too much
        wear in a step.
    ModelError : a run ended early; names profile, distance and track.
    """
    name = _profile_name(vehicle)
    ways = [Route(*route) for route in routes]
    _check(ways, step, steps)
    chosen = wear_law(law)
    given = settings or Settings()
    outputs = given.outputs.model_copy(update={"contact_patches": True})
    given = given.model_copy(update={"outputs": outputs})
    tell, remark = progress or (lambda _: None), on_remark or _LOG.warning
    profile, whole = load_profile(name), steps * step
    found: list[WearStep] = []
    hunting: set[str] = set()

    def finish(start: float, length: float, worn: Profile, lost: Floats) -> None:
        found.append(WearStep(start, length, profile, worn, lost / length))
        if on_step is not None:
            on_step(found[-1])

    for number in range(steps):
        start = at = number * step
        worn, left, lost = profile, step, np.zeros(1)
        try:
            while left > 0.0:
                part = partial(_tell_part, tell, at / whole, left / whole)
                file = _file_name(vehicle, ways, given, step, chosen, worn)
                path = None if folder is None else folder / file
                wear = _kept(path, remark) or _wear(
                    vehicle, ways, given, chosen, {name: worn}, at, part
                )
                if path is not None and not path.exists():
                    facts = {"distance": at, **wear._asdict(), "depth": wear.depth.tolist()}
                    write_record(path, facts)
                for route, words in wear.hunts.items():
                    if route not in hunting:
                        remark(f"after {1e-3 * at:.4g} km on {route}: {words}")
                hunting |= wear.hunts.keys()
                length = left / parts_of_step(worn, wear.depth, left)
                worn = worn_profile(worn, wear.depth, length)
                lost = lost + wear.depth * length
                at, left = at + length, left - length
        except RailsimError:
            if at > start:
                finish(start, at - start, worn, lost)
            raise
        finish(start, step, worn, lost)
        tell((number + 1) / steps)
        profile = worn
    return found


def _tell_part(tell: Callable[[float], None], before: float, portion: float, done: float) -> None:
    tell(before + portion * done)


def wear_rows(
    found: Sequence[WearStep], vehicle: Vehicle, track: Track
) -> list[dict[str, float | None]]:
    """Wear after each step.

    Parameters
    ----------
    found : sequence of WearStep
        Result of `wear_loop`, from its beginning.
    vehicle, track : Vehicle, Track
        Wheelset and rails for the equivalent conicity.

    Returns
    -------
    list of dict
        The new wheel, then the wheel after each step: `distance` [m], `area` [m2], `deepest` [m]
        and its position `deepest_y` from the nominal rolling circle [m], all since the beginning,
        and `equivalent_conicity` at 3 mm (EN 15302), None if it does not exist.
    """
    if not found:
        return []
    new = found[0].profile
    wheels = [(0.0, new), *((done.distance + done.length, done.worn) for done in found)]
    return [_row(distance, new, worn, vehicle, track) for distance, worn in wheels]


def _row(
    distance: float, new: Profile, worn: Profile, vehicle: Vehicle, track: Track
) -> dict[str, float | None]:
    lost = np.asarray(new.z) - np.asarray(worn.z)
    at = int(np.argmax(lost))
    (wheelset, *_) = (body.wheelset for body in flatten(vehicle).bodies if body.wheelset)
    left, right = (load_profile(rail) for rail in track.rail)
    geometry = contact_geometry(
        worn, (left, right), wheelset.radius, track.gauge, track.inclination, wheelset.back_to_back
    )  # fmt: skip
    (conicity,) = geometry.equivalent_conicity([AMPLITUDE])
    return {
        "distance": distance,
        "area": float(np.trapezoid(lost, new.y)),
        "deepest": float(lost[at]),
        "deepest_y": float(new.y[at]),
        "equivalent_conicity": float(conicity) if math.isfinite(conicity) else None,
    }


def _profile_name(vehicle: Vehicle) -> str:
    names = {n for w in flatten(vehicle).bodies if w.wheelset for n in w.wheelset.profile}
    if len(names) != 1:
        found = f"{len(names)} wheel profiles"
        raise InputError([Fault("vehicle", "profile", found, "the same for all wheels")])
    return names.pop()


def _check(routes: Sequence[Route], step: float, steps: int) -> None:
    faults = []
    if not routes:
        faults.append(Fault("wear", "routes", "no route", "at least one"))
    for route in routes:
        if not (route.share > 0.0 and math.isfinite(route.share)):
            name = route.track.name
            faults.append(Fault("wear", "share", f"found {route.share:g} for {name}", "above 0"))
    if not (step > 0.0 and math.isfinite(step)):
        faults.append(Fault("wear", "step", f"found {step:g} m", "above 0"))
    if steps < 1:
        faults.append(Fault("wear", "steps", f"found {steps}", "1 or more"))
    if faults:
        raise InputError(faults)


def _file_name(
    vehicle: Vehicle,
    routes: Sequence[Route],
    settings: Settings,
    step: float,
    law: WearLaw,
    profile: Profile,
) -> str:
    """Name of the file of a step: a hash of all its inputs."""
    rails = {rail for route in routes for rail in route.track.rail}
    inputs: list[Any] = [
        __version__, KEPT, law.name, law.constants, step,
        vehicle.to_toml(), settings.to_toml(), profile.key().hex(),
        [(route.track.to_toml(), route.speed, route.share) for route in routes],
        [load_profile(rail).key().hex() for rail in sorted(rails)],
    ]  # fmt: skip
    return f"{hashlib.sha256(json.dumps(inputs).encode()).hexdigest()[:24]}.json"


def _kept(path: Path | None, remark: Callable[[str], None]) -> _Wear | None:
    """Wear of a step that has been computed before; a damaged record is removed."""
    if path is None or not path.exists():
        return None
    try:
        record = read_record(path)
    except InputError as error:
        remark(f"{error.faults[0]}: it is computed again")
        path.unlink()
        return None
    return _Wear(np.asarray(record["depth"], dtype=np.float64), record["hunts"])


def _wear(
    vehicle: Vehicle,
    routes: Sequence[Route],
    settings: Settings,
    law: WearLaw,
    worn: dict[str, Profile],
    at: float,
    progress: Callable[[float], None],
) -> _Wear:
    """Mean of all wheels and of the routes weighted by their shares."""
    total = sum(route.share for route in routes)
    depths, hunts = [], dict[str, str]()
    for number, (track, speed, share) in enumerate(routes):

        def part(done: float, before: int = number) -> None:
            progress((before + done) / len(routes))

        rails = {rail: load_profile(rail) for rail in track.rail}
        try:
            result = simulate(
                vehicle, track, speed=speed, settings=settings, profiles=rails | worn, progress=part
            )
            depths.append(share / total * _mean_depth(result, law))
            words = _hunting(result) or _hunting_when_disturbed(
                vehicle, routes[number], settings, rails | worn
            )
        except ModelError as error:
            (wheel,) = worn.values()
            place = f"wheel {wheel.name} after {1e-3 * at:.4g} km on {track.name}"
            raise ModelError(f"{place}: {error}") from None
        if words:
            hunts[f"{track.name} at {speed:g} m/s"] = words
    return _Wear(np.asarray(np.sum(depths, axis=0)), hunts)


def _hunting(result: Result) -> str | None:
    return next((words for words in result.remarks if words.startswith(HUNTS)), None)


def _hunting_when_disturbed(
    vehicle: Vehicle, route: Route, settings: Settings, profiles: dict[str, Profile]
) -> str | None:
    """Say whether the vehicle hunts on the straights of a route: nothing disturbs it there."""
    track = route.track
    if not any(isinstance(element, Straight) for element in track.plan):
        return None
    plain = track.replace(
        plan=[{"type": "STR", "length": route.speed * TESTED + ROOM}],
        cant=[], vertical=[], irregularities=[], gauge_widening=None,
    )  # fmt: skip
    leading = flatten(vehicle).of_kind("wheelset")[0].name
    given = settings.model_copy(update={"initial": {leading: InitialState(y=DISTURBED)}})
    result = simulate(
        vehicle, plain, speed=route.speed, duration=TESTED, settings=given, profiles=profiles
    )
    how = f"disturbed by {1e3 * DISTURBED:g} mm"
    if result.status != "complete":
        return f"A run {how} is {result.status}, {result.attributes['status_reason']}"
    words = _hunting(result)
    return words and f"{words.split(', from s')[0]}, {how}."


def _mean_depth(result: Result, law: WearLaw) -> Floats:
    if result.status != "complete":
        raise ModelError(f"{result.status}, {result.attributes['status_reason']}")
    wheels = product(range(len(result.wheelsets)), (0, 1))
    depths = [worn_depth(result, wheelset, side, law) for wheelset, side in wheels]
    return np.asarray(np.mean(depths, axis=0))
