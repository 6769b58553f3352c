"""Published values and those of a run with the same vehicle, track and speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose

import numpy as np

from railsim.definitions.loading import load, load_track, load_vehicle
from railsim.definitions.published import Published, PublishedValue
from railsim.files.sources import library_files
from railsim.notation import SIDES
from railsim.result import Result, Results


@dataclass(frozen=True)
class Comparison:
    """A published value and the value of a run.

    `published`, `computed`: The two values [SI].
    """

    study: Published  # publication
    value: PublishedValue  # published value with its conditions
    run: str  # name of the run
    rails: str  # rails of the run: ``elastic`` or ``rigid``
    published: float
    computed: float

    @property
    def difference(self) -> float:
        """Relative difference of the magnitudes."""
        return (abs(self.computed) - abs(self.published)) / abs(self.published)


def published_comparisons(results: Results) -> list[Comparison]:
    """Return every published value that the runs can be compared with.

    A run is compared if vehicle and speed are those of the publication and its track differs at
    most in the support of the rails, which publications rarely specify.
    """
    studies = [load(Published, name) for name in library_files("published")]
    return [row for study in studies for row in _study_comparisons(study, results)]


def _study_comparisons(study: Published, results: Results) -> Sequence[Comparison]:
    track = load_track(study.track)
    names = dict.fromkeys(name for value in study.values for name in value.values)
    vehicles = {name: load_vehicle(name) for name in names}
    rows = []
    for run, result in results.items():
        if not isclose(result.speed, study.speed, rel_tol=1e-9):
            continue
        run_track = result.track()
        if run_track.replace(support=track.support) != track:
            continue
        vehicle = result.vehicle()
        name = next((name for name, published in vehicles.items() if published == vehicle), None)
        rails = "rigid" if run_track.support.preset == "rigid" else "elastic"
        for value in study.values:
            if name in value.values and (computed := reading(result, value)) is not None:
                rows.append(Comparison(study, value, run, rails, value.values[name], computed))
    return rows


def reading(result: Result, value: PublishedValue) -> float | None:
    """Return a published quantity from a result [SI]; None if the run ends before it."""
    if value.quantity not in result or value.wheelset > len(result.wheelsets):
        return None
    array = result[value.quantity][:, value.wheelset - 1]
    if value.side is not None:
        array = array[:, SIDES.index(value.side)]
    if value.read == "largest":
        return float(np.nanmax(array))
    if value.read == "smallest":
        return float(np.nanmin(array))
    # from the start of the track: the run may have begun at a later position
    time = result["time"] + result["distance"][0] / result.speed
    if not time[0] <= value.read <= time[-1]:
        return None
    return float(array[int(np.argmin(np.abs(time - value.read)))])
