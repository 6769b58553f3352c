"""The worn profile put back into the simulation, step by step.

All wheels have one profile: their wear is averaged, as on a train that runs both ways and is
turned.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.assessment.wear_depth import worn_depth, worn_profile
from railsim.definitions.flatten import flatten
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, ModelError
from railsim.profiles import Profile, load_profile
from railsim.result import Result
from railsim.result.filters import Floats
from railsim.simulation import simulate


@dataclass(frozen=True)
class WearStep:
    """One step of the loop.

    Attributes
    ----------
    distance : float
        Distance run before the step [m].
    profile, worn : Profile
        Wheel profile in this step, and after it.
    depth : float64[place]
        Its depth of wear per distance, mean of all wheels, over `wear_depth.grid` [m/m].
    """

    distance: float
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
    on_step: Callable[[WearStep], None] | None = None,
) -> list[WearStep]:
    """Wear of a vehicle's wheels over distance, with the worn profile back in the simulation.

    Parameters
    ----------
    vehicle : Vehicle
        All its wheels have one profile.
    routes : sequence of (Track, float, float)
        Tracks with their speeds [m/s] and shares of the distance.
    step : float
        Distance between two updates of the profile [m]: so short that no step wears off more
        than some tenths of a millimetre; more than 1 mm is refused.
    steps : int
        Number of updates.
    settings : Settings, optional
        `outputs.contact_patches` is switched on.
    on_step : callable, optional
        Called after each step.

    Raises
    ------
    InputError : different profiles; no route; a step that wears off too much.
    ModelError : a run ended early.
    """
    names = {n for w in flatten(vehicle).bodies if w.wheelset for n in w.wheelset.profile}
    if len(names) != 1 or not routes:
        found = f"{len(names)} wheel profiles" if routes else "no route"
        raise InputError([Fault("vehicle", "profile", found, "one for all wheels, and a route")])
    (name,) = names
    given = settings or Settings()
    outputs = given.outputs.model_copy(update={"contact_patches": True})
    given = given.model_copy(update={"outputs": outputs})
    profile, found_steps = load_profile(name), []
    for number in range(steps):
        depth = np.zeros(0)
        total = sum(share for _, _, share in routes)
        for track, speed, share in routes:
            profiles = _profiles(track, name, profile)
            result = simulate(vehicle, track, speed=speed, settings=given, profiles=profiles)
            own = share / total * _mean_depth(result)
            depth = own if not depth.size else depth + own
        worn = worn_profile(profile, depth, step)
        done = WearStep(number * step, profile, worn, depth)
        found_steps.append(done)
        if on_step is not None:
            on_step(done)
        profile = worn
    return found_steps


def _profiles(track: Track, name: str, profile: Profile) -> dict[str, Profile]:
    return {**{rail: load_profile(rail) for rail in track.rail}, name: profile}


def _mean_depth(result: Result) -> Floats:
    if result.status != "complete":
        raise ModelError(f"a run of the wear loop ended early: {result.status}")
    depths = [worn_depth(result, w, side) for w in range(len(result.wheelsets)) for side in (0, 1)]
    return np.asarray(np.mean(depths, axis=0))
