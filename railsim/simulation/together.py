"""`simulate_together`: several vehicles over one track, one after the other."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from railsim.definitions.loading import check_types
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import argument_error
from railsim.result import Result, Sink
from railsim.simulation.run import simulate


def simulate_together(
    vehicles: Sequence[Vehicle] | Vehicle,
    track: Track,
    *,
    sinks: Sequence[Sink] | None = None,
    progress: Callable[[float], None] | None = None,
    **conditions: Any,
) -> list[Result]:
    """Run several vehicles over one track, one after the other.

    Parameters
    ----------
    vehicles : sequence of Vehicle, or a single one
        Such as one vehicle with different parameters; they do not interact.
    track : Track
        Of all runs.
    sinks : sequence of Sink, optional
        One for each vehicle.
    progress : callable, optional
        Called repeatedly with the finished fraction of all runs.
    **conditions
        Speed, start, end, settings and profiles of all runs, as in `simulate`.

    Returns
    -------
    list of Result
        In the order of the vehicles.

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
    >>> [result.status for result in results]
    ['complete', 'complete']
    """
    vehicles = [vehicles] if isinstance(vehicles, Vehicle) else vehicles
    check_types(vehicles, track, settings=conditions.get("settings"))
    count = len(vehicles)
    if not vehicles or (sinks is not None and len(sinks) != count):
        found = f"{len(sinks or ())} for {count} vehicles" if vehicles else "no vehicle"
        name = "sinks" if vehicles else "vehicles"
        raise argument_error(name, found, "one vehicle at least, a sink for each")

    def tell(done: int, fraction: float) -> None:
        if progress is not None:
            progress((done + fraction) / count)

    results, errors = list[Result](), list[Exception]()
    for number, vehicle in enumerate(vehicles):
        sink, part = sinks[number] if sinks else None, partial(tell, number)
        try:
            results.append(simulate(vehicle, track, sink=sink, progress=part, **conditions))
        except Exception as error:
            error.add_note(f"this was vehicle {number + 1} of {count}")
            errors.append(error)
    if errors:
        raise errors[0]
    return results
