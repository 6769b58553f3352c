"""`simulate`: the course of a run on one page.

Definitions are assembled to arrays, the vehicle finds its equilibrium on straight level track, the
step is chosen (`railsim.simulation.preparation`), and the time loop runs in chunks
(`railsim.simulation.advance`).  The outcome goes chunk by chunk to a sink; the facts about the run
follow (`railsim.simulation.ending`).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.loading import check_types
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import InputError, argument_fault
from railsim.model.assembly import SharedTables
from railsim.profiles import Profile
from railsim.result import MemorySink, Result, Sink
from railsim.simulation.advance import advance
from railsim.simulation.auxiliary_track import DOING
from railsim.simulation.conditions import Inputs, state_before
from railsim.simulation.ending import end
from railsim.simulation.preparation import begin
from railsim.simulation.run_progress import Progress, RunProgress
from railsim.units import speed_in_si

Floats = NDArray[np.float64]


def simulate(
    vehicle: Vehicle,
    track: Track,
    *,
    speed: float | str | None = None,
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
    speed : float or str
        Speed of the reference body [m/s], or a text such as ``"72 km/h"``: constant, or at the
        start of a free run; not needed where the settings have a speed table or with `resume`.
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
        Called repeatedly with the finished fraction.
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
    check_types([vehicle], track)
    settings = settings or Settings()
    before = None if resume is None else state_before(vehicle, track, settings, resume)
    if before is not None:
        own = {"speed": float(before[-1]), "start": float(before[-2])}
        for name, value in (("speed", speed_in_si(speed)), ("start", start or None)):
            if value is not None and value != own[name]:
                found, allowed = "given together with `resume`", "the state's own is used"
                raise InputError([argument_fault(name, "", found, allowed)])
        speed, start = own["speed"], own["start"]
    inputs = Inputs.checked(track, settings, speed, start, duration, until)
    fraction = RunProgress(progress, 1, inputs)
    fraction.next_run()
    sink = MemorySink() if sink is None else sink
    run = begin(vehicle, inputs, sink, profiles, before, SharedTables(), fraction)
    DOING.info("")
    for _ in advance([run], settings, fraction.of_runs):
        pass
    if run.error is not None:
        raise run.error
    return end(run, vehicle, inputs, before)
