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
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from railsim.assessment.wear_depth import parts_of_step, worn_depth, worn_profile
from railsim.contact import contact_geometry
from railsim.definitions.flatten import flatten
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, ModelError
from railsim.profiles import Profile, load_profile
from railsim.result import Result
from railsim.result.filters import Floats
from railsim.simulation import simulate
from railsim.studies.kept import keep, read_kept
from railsim.version import __version__

AMPLITUDE = 3e-3  # m, at which EN 15302 compares equivalent conicities
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


def wear_loop(
    vehicle: Vehicle,
    routes: Sequence[tuple[Track, float, float]],
    *,
    step: float,
    steps: int,
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
    settings : Settings, optional
        `outputs.contact_patches` is switched on.
    folder : Path, optional
        Folder for finished steps: the same call, or one with more steps, continues after them.
    on_step : callable, optional
        Called after each step.
    on_remark : callable, optional
        Called with a sentence on every stored step that is damaged and computed again; by default
        these sentences are logged.
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
    given = settings or Settings()
    outputs = given.outputs.model_copy(update={"contact_patches": True})
    given = given.model_copy(update={"outputs": outputs})
    tell, remark = progress or (lambda _: None), on_remark or _LOG.warning
    profile, found, whole = load_profile(name), [], steps * step
    for number in range(steps):
        worn, at, lost = profile, number * step, np.zeros(1)
        left = step
        while left > 0.0:
            path = None if folder is None else folder / _file_name(vehicle, ways, given, step, worn)
            depth = _kept(path, remark)
            if depth is None:
                try:
                    part = partial(_tell_part, tell, at / whole, left / whole)
                    depth = _depth(vehicle, ways, given, {name: worn}, part)
                except ModelError as error:
                    words = f"wheel {worn.name} after {1e-3 * at:.4g} km {error}"
                    raise ModelError(words) from None
                if path is not None:
                    keep(path, {"distance": at, "depth": depth.tolist()})
            length = left / parts_of_step(worn, depth, left)
            worn = worn_profile(worn, depth, length)
            lost = lost + depth * length
            at, left = at + length, left - length
        done = WearStep(number * step, step, profile, worn, lost / step)
        found.append(done)
        tell((number + 1) / steps)
        if on_step is not None:
            on_step(done)
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
    vehicle: Vehicle, routes: Sequence[Route], settings: Settings, step: float, profile: Profile
) -> str:
    """Name of the file of a step: a hash of all its inputs."""
    rails = {rail for route in routes for rail in route.track.rail}
    inputs: list[Any] = [
        __version__, step, vehicle.to_toml(), settings.to_toml(), profile.key().hex(),
        [(route.track.to_toml(), route.speed, route.share) for route in routes],
        [load_profile(rail).key().hex() for rail in sorted(rails)],
    ]  # fmt: skip
    return f"{hashlib.sha256(json.dumps(inputs).encode()).hexdigest()[:24]}.json"


def _kept(path: Path | None, remark: Callable[[str], None]) -> Floats | None:
    """Wear of a step that has been computed before."""
    if path is None or not path.exists():
        return None
    try:
        return np.asarray(read_kept(path)["depth"], dtype=np.float64)
    except InputError as error:
        remark(f"{error.faults[0]}: it is computed again")
        return None


def _depth(
    vehicle: Vehicle,
    routes: Sequence[Route],
    settings: Settings,
    worn: dict[str, Profile],
    progress: Callable[[float], None],
) -> Floats:
    """Depth of wear per distance, mean of all wheels and of the routes weighted by their shares."""
    total = sum(route.share for route in routes)
    depths = []
    for number, (track, speed, share) in enumerate(routes):

        def part(done: float, before: int = number) -> None:
            progress((before + done) / len(routes))

        rails = {rail: load_profile(rail) for rail in track.rail}
        try:
            result = simulate(
                vehicle, track, speed=speed, settings=settings, profiles=rails | worn, progress=part
            )
            depths.append(share / total * _mean_depth(result))
        except ModelError as error:
            raise ModelError(f"on {track.name}: {error}") from None
    return np.asarray(np.sum(depths, axis=0))


def _mean_depth(result: Result) -> Floats:
    if result.status != "complete":
        raise ModelError(f"{result.status}, {result.attributes['status_reason']}")
    depths = [worn_depth(result, w, side) for w in range(len(result.wheelsets)) for side in (0, 1)]
    return np.asarray(np.mean(depths, axis=0))
