"""Vehicles, tracks and settings of runs, from their results or from the files of their study."""

from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import NamedTuple

from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.units_of_keys import unit_of_input
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import RailsimError
from railsim.result import Results
from railsim.studies.columns import Record
from railsim.studies.plan import Plan
from railsim.studies.study import stored_spec


class Inputs(NamedTuple):
    """Inputs of a run, with the labels of the study: two files may hold vehicles of one name."""

    vehicle_label: str
    track_label: str
    vehicle: Vehicle
    track: Track
    settings: Settings
    speed: float


def inputs_of(records: Sequence[Record], results: Results) -> list[Inputs]:
    """Return the inputs of results."""
    labels = {record["name"]: record["labels"] for record in records}
    run_inputs = []
    for name, result in results.items():
        texts, vehicle, track = labels.get(name, {}), result.vehicle(), result.track()
        names = (str(texts.get("vehicle", vehicle.name)), str(texts.get("track", track.name)))
        run_inputs.append(Inputs(*names, vehicle, track, result.settings(), result.speed))
    return run_inputs


def units_of(records: Sequence[Record], runs: Sequence[Inputs]) -> dict[str, str]:
    """Return the units of what was varied, by the labels of the runs."""
    keys = dict.fromkeys(label for record in records for label in record["labels"] if "." in label)
    return {key: next(filter(None, (unit_of_input(one, key) for one in runs)), "") for key in keys}


def used_inputs(folder: Path) -> list[Inputs]:
    """Inputs of a study without results: the first run of each vehicle on each track.

    From the files as they are now; nothing where they are gone or no longer what they were.
    """
    try:
        spec, base = stored_spec(folder)
        with chdir(base):
            plan = Plan(spec)
            first = {(point.run.vehicle, point.run.track): point for point in reversed(plan.points)}
            cases = plan.cases(list(first.values())[::-1])
    except (RailsimError, OSError):
        return []
    found = []
    for case in cases:
        names = str(case.labels["vehicle"]), str(case.labels["track"])
        found.append(Inputs(*names, case.vehicle, case.track, case.settings, case.speed))
    return found
