"""Several runs in one call of the time loop; each gives the result of `simulate`.

What it gains end to end stands in docs/performance.md.
"""

from collections.abc import Mapping, Sequence

from railsim.definitions.loading import check_types
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import argument_error
from railsim.model.assembly import SharedTables
from railsim.profiles import Profile
from railsim.result import MemorySink, Result, Sink
from railsim.simulation.advance import Run, advance
from railsim.simulation.auxiliary_track import DOING
from railsim.simulation.conditions import Inputs
from railsim.simulation.ending import end
from railsim.simulation.preparation import begin
from railsim.simulation.run_progress import Progress, RunProgress


def simulate_together(
    vehicles: Sequence[Vehicle],
    track: Track,
    *,
    speed: float | str | None = None,
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
        Such as one vehicle with different parameters; they do not interact.
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
    >>> hard = soft.with_values({"primary.stiffness.y": 1e6})
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


def outcomes(
    vehicles: Sequence[Vehicle],
    track: Track,
    *,
    speed: float | str | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    settings: Settings | None = None,
    sinks: Sequence[Sink] | None = None,
    progress: Progress | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> list[Result | Exception]:
    """As `simulate_together`, but with the error instead of the result of a vehicle that fails."""
    check_types(vehicles, track, settings=settings)
    if not vehicles or (sinks is not None and len(sinks) != len(vehicles)):
        count = "no vehicle" if not vehicles else f"{len(sinks or ())} for {len(vehicles)} vehicles"
        name = "sinks" if vehicles else "vehicles"
        raise argument_error(name, count, "one vehicle at least, a sink for each")
    settings = settings or Settings()
    inputs = Inputs.checked(track, settings, speed, start, duration, until)
    shared = SharedTables()
    found: list[Result | Exception | None] = [None] * len(vehicles)
    runs: dict[Run, int] = {}
    sinks = [MemorySink() for _ in vehicles] if sinks is None else sinks
    fraction = RunProgress(progress, len(vehicles), inputs)
    for number, (vehicle, sink) in enumerate(zip(vehicles, sinks, strict=True)):
        fraction.next_run()
        try:
            run = begin(vehicle, inputs, sink, profiles, None, shared, fraction)
        except Exception as error:
            found[number] = error
        else:
            runs[run] = number
    DOING.info("")
    for run in advance(list(runs), settings, fraction.of_runs):
        number = runs[run]
        try:
            found[number] = run.error or end(run, vehicles[number], inputs, None)
        except Exception as error:
            found[number] = error
    return [outcome for outcome in found if outcome is not None]
