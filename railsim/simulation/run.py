"""`simulate`: the course of a run on one page.

It is a `railsim.simulation.stepping.Simulation` that is taken to its end at once: definitions are
assembled to arrays, the vehicle finds its equilibrium on straight level track, the step is chosen
(`railsim.simulation.preparation`), and the time loop runs in chunks (`railsim.simulation.advance`).
The outcome goes chunk by chunk to a sink; the facts about the run follow
(`railsim.simulation.ending`).
"""

from collections.abc import Mapping

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.profiles import Profile
from railsim.result import Result, Sink
from railsim.simulation.run_progress import Progress
from railsim.simulation.stepping import Simulation


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
    resume: Result | Mapping[str, Floats] | Floats | None = None,
    allow_code: bool = False,
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
    resume : Result, mapping or float64[n_state], optional
        A result of the same vehicle, track and settings (outputs apart) whose end is the beginning
        of this run, or its states ``result.groups["state"]``, or of these ``end`` alone: then
        controllers and delays begin anew.  Either gives speed and start.
    allow_code : bool
        Execute the user-defined laws that the files name, see `railsim.laws`.

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
    run = Simulation(
        vehicle,
        track,
        speed=speed,
        start=start,
        duration=duration,
        until=until,
        settings=settings,
        sink=sink,
        progress=progress,
        profiles=profiles,
        resume=resume,
        allow_code=allow_code,
    )
    run.run()
    return run.result()
