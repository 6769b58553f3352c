"""From lists and grids to cases; all faults are reported together."""

import math
import os
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from railsim.definitions.analyses import Analysis, needs_run, needs_speed
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.overrides import OVERRIDE, split_overrides
from railsim.definitions.study import Sample, value_texts
from railsim.definitions.track import Track
from railsim.errors import Fault, InputError
from railsim.profiles.used import profile_faults
from railsim.simulation.conditions import check_range, initial_speed
from railsim.studies.case import Case, run_name, short_name
from railsim.studies.points import Fingerprints, Grid, Overrides, Point, check_number, point_key
from railsim.studies.rows import PERMITTED, made_rows
from railsim.units import ALLOWED

T = TypeVar("T", bound=FileDefinition)
LONGEST_NAME = 250  # bytes of a file name with its ending; file systems allow 255
KINDS: dict[Any, str] = {load_vehicle: "vehicle", load_track: "track", load_settings: "settings"}


def load_case(
    vehicle: str | Path,
    track: str | Path,
    speed: float | None,
    *,
    settings: str | Path | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    assignments: Sequence[str] = (),
) -> Case:
    """Load the inputs of one run.

    Parameters
    ----------
    vehicle, track : str or Path
        File, or name of a shipped one.
    speed : float or None
        Speed [m/s]; not needed where the settings have a speed table.
    settings : str or Path, optional
        Settings file.
    start : float
        Distance at which the reference body starts [m].
    duration, until : float, optional
        End of the run: time [s] or distance [m].
    assignments : sequence of str
        ``key.path=value``, the paths beginning with ``vehicle.``, ``track.`` or ``settings.``.

    Raises
    ------
    InputError : everything that is wrong in any of them.
    """
    (case,) = combinations(
        [vehicle],
        [track],
        [speed],
        settings=settings,
        start=start,
        duration=duration,
        until=until,
        assignments=assignments,
    )
    return case


def combinations(
    vehicles: Sequence[str | Path],
    tracks: Sequence[str | Path],
    speeds: Sequence[float | None],
    grid: Grid | None = None,
    **how: Any,
) -> list[Case]:
    """Return a case for every combination, vehicles outermost; see `Plan`.

    Raises
    ------
    InputError : everything that is wrong in any of them.
    """
    plan = Plan(vehicles, tracks, speeds, grid, **how)
    return plan.cases(plan.points)


class Plan:
    """All points of a study; loads the case of a point.

    Parameters
    ----------
    vehicles, tracks, speeds : sequences
        Inputs to combine, vehicles outermost.  The speed `PERMITTED` is the lower of the admissible
        speed of the vehicle and the speed of the track.
    grid : mapping of str to sequence of str, optional
        Values of further keys, written as in a file.
    settings, start, duration, until, assignments
        As in `load_case`, for all runs.
    linked : sequence of mappings
        Keys whose values vary together, as `grid`; ``speed`` is the speed of the run.
    sample : Sample, optional
        Random values of further keys.
    told : str
        Further inputs that the record of a run depends on.
    analyses : mapping of str to Analysis, optional
        Analyses at each point; without analyses, a run is computed.
    workers : int
        Processes for the runs, to estimate the time that a refused study would take.

    Attributes
    ----------
    points : list of Point
        In the order of the combinations.

    Raises
    ------
    InputError : there is no combination, or there are too many combinations.
    """

    def __init__(
        self,
        vehicles: Sequence[str | Path],
        tracks: Sequence[str | Path],
        speeds: Sequence[float | str | None],
        grid: Grid | None = None,
        *,
        settings: str | Path | None = None,
        start: float = 0.0,
        duration: float | None = None,
        until: float | None = None,
        assignments: Sequence[str] = (),
        linked: Sequence[Grid] = (),
        sample: Sample | None = None,
        told: str = "",
        analyses: Mapping[str, Analysis] | None = None,
        workers: int = 1,
    ) -> None:
        grid = grid or {}
        self._analyses = dict(analyses or {})
        if not (vehicles and tracks and speeds and all(grid.values())):
            raise InputError(
                [Fault("study", "", "no combination", "give a vehicle, a track, a speed")]
            )
        self._grid, self._settings = (
            {**grid, **{k: v for t in linked for k, v in t.items()}},
            settings,
        )
        self._start, self._duration, self._until = start, duration, until
        self._faults: dict[Fault, None] = {}
        self._loaded = cache(self._load)
        check_number(
            [
                vehicles,
                tracks,
                speeds,
                *grid.values(),
                *(next(iter(table.values())) for table in linked),
                range(sample.number if sample else 1),
            ],
            workers,
            lambda: self._simulated_time(tracks[0], speeds[0]),
        )
        common = self._split(assignments)
        rows = made_rows(grid, linked, sample)
        # the same for all vehicles, tracks and speeds
        own = [self._own(common, row.values) for row in rows]
        fingerprint = Fingerprints()
        with_run = needs_run(self._analyses)
        self.points = []
        for vehicle, track, speed in product(vehicles, tracks, speeds):
            short = {"vehicle": short_name(vehicle), "track": short_name(track)}
            for row, overrides in zip(rows, own, strict=True):
                asked = speed if row.speed is None else row.speed
                if isinstance(asked, str):
                    first = self._permitted(vehicle, track, overrides)
                else:
                    first = self._first_speed(overrides["settings"], asked)
                key = point_key(
                    fingerprint("vehicle", vehicle, overrides["vehicle"]),
                    fingerprint("track", track, overrides["track"]),
                    fingerprint("settings", settings, overrides["settings"]),
                    first,
                    start,
                    duration,
                    until,
                    *([f"told {told}"] if told else []),
                    *([f"analyses {self._analyses}"] if self._analyses else []),
                )
                name = run_name(vehicle, track, 0.0 if first is None else first) + row.suffix
                known = math.nan if first is None else first
                labels: dict[str, str | float] = {**short, "speed": known, **row.values}
                self.points.append(
                    Point(name, vehicle, track, first, overrides, labels, key, with_run)
                )

    def cases(self, points: Sequence[Point]) -> list[Case]:
        """Load the inputs of the runs of some points.

        Raises
        ------
        InputError : everything that is wrong in any of them.
        """
        found = []
        for point in points:
            vehicle = self._loaded(load_vehicle, point.vehicle, point.overrides["vehicle"])
            track = self._loaded(load_track, point.track, point.overrides["track"])
            settings = self._loaded(load_settings, self._settings, point.overrides["settings"])
            speed = point.speed
            if speed is None and not needs_speed(self._analyses):
                speed = math.nan
            elif track and speed is not None and needs_run(self._analyses):
                how = speed, self._start, self._duration, self._until
                self._tell(_range_faults(track, *how))
            if vehicle and track and settings and speed is not None:
                found.append(
                    Case(
                        point.name,
                        vehicle,
                        track,
                        settings,
                        speed,
                        self._start,
                        self._duration,
                        self._until,
                        point.labels,
                        self._analyses,
                    )
                )
        if not self._faults:
            self._tell(name_faults(self.points))
        if self._faults:
            raise InputError(self._faults)
        return found

    def _tell(self, faults: Iterable[Fault]) -> None:
        self._faults |= dict.fromkeys(faults)

    def _load(
        self, load: Callable[..., T], path: str | Path | None, overrides: Overrides
    ) -> T | None:
        try:
            definition = load(path, overrides)
            self._tell(profile_faults(definition, str(path)))
            return definition
        except InputError as error:
            self._tell(_as_written(fault, KINDS[load], self._grid) for fault in error.faults)
            return None

    def _split(self, texts: Sequence[str]) -> dict[str, Overrides]:
        own: dict[str, Overrides] = {"vehicle": (), "track": (), "settings": ()}
        for text in texts:
            try:
                for kind, some in split_overrides([text]).items():
                    own[kind] += tuple(some)
            except InputError as error:
                self._tell(error.faults)
        return own

    def _own(self, common: Mapping[str, Overrides], row: Mapping[str, str]) -> dict[str, Overrides]:
        own = self._split([f"{key}={value}" for key, value in row.items()])
        return {kind: common[kind] + own[kind] for kind in own}

    def _permitted(
        self, vehicle: str | Path, track: str | Path, overrides: Mapping[str, Overrides]
    ) -> float | None:
        """Return the lower of the admissible speed of a vehicle and the speed of a track [m/s]."""
        service = self._loaded(load_vehicle, vehicle, overrides["vehicle"])
        line = self._loaded(load_track, track, overrides["track"])
        if service is None or line is None:
            return None  # already reported
        allowed = f"needed for the speed '{PERMITTED}'"
        if service.service is None:
            self._tell([Fault(str(vehicle), "service.admissible_speed", "missing", allowed)])
        if line.speed is None:
            self._tell([Fault(str(track), "speed", "missing", allowed)])
        if service.service is None or line.speed is None:
            return None
        return float(min(service.service.admissible_speed, line.speed))

    def _first_speed(self, overrides: Overrides, speed: float | None) -> float | None:
        settings = self._loaded(load_settings, self._settings, overrides)
        if settings is None or (speed is None and not needs_speed(self._analyses)):
            return speed
        try:
            return initial_speed(settings, speed, self._start)
        except InputError as error:
            self._tell(error.faults)
            return None

    def _simulated_time(self, track: str | Path, speed: float | str | None) -> float:
        """Estimate the duration of a run [s] from the first track and speed."""
        if self._duration is not None:
            return self._duration
        try:
            length = self._until or load_track(track).length
        except InputError:
            return 0.0
        first = speed if isinstance(speed, float | int) else 1.0
        return max(0.0, length - self._start) / max(first, 0.5)


def _as_written(fault: Fault, kind: str, grid: Grid) -> Fault:
    """Return the fault of an assignment with its key and option as given."""
    if fault.file != OVERRIDE:
        return fault
    key = f"{kind}.{fault.key}"
    of_grid = any(key == name or key.startswith(f"{name}.") for name in grid)
    return replace(fault, file="--grid" if of_grid else OVERRIDE, key=key)


def _range_faults(
    track: Track, speed: float, start: float, duration: float | None, until: float | None
) -> list[Fault]:
    try:
        check_range(track, speed, start, duration, until)
    except InputError as error:
        return list(error.faults)
    return []


def name_faults(points: Sequence[Point]) -> list[Fault]:
    """Return the faults of the names of runs: equal names, or names too long for a file."""
    counts = Counter(point.name for point in points)
    faults = [
        Fault("study", name, f"{count} runs of this name", "give files with different names")
        for name, count in counts.items()
        if count > 1
    ]
    longest = max(counts, key=lambda name: len(os.fsencode(name)))
    if len(os.fsencode(longest)) + len(".h5") > LONGEST_NAME:
        found = f"the name of a run has {len(os.fsencode(longest))} bytes"
        faults.append(Fault("study", f"{longest[:60]}...", found, "shorter names of files"))
    return faults


def parse_grid(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of ``key.path=a,b,c`` or ``key.path=first:last:number``.

    Commas within brackets do not separate values.

    Examples
    --------
    >>> parse_grid("settings.fastsim_grid=[10,10],[20,20]")
    ('settings.fastsim_grid', ('[10,10]', '[20,20]'))
    >>> parse_grid("track.friction=0.1,0.2:0.4:3")
    ('track.friction', ('0.1', '0.2', '0.3', '0.4'))

    Raises
    ------
    InputError : the text has neither form.
    """
    key, equals, written = text.partition("=")
    values = [value.strip() for value in re.split(r",(?![^\[{]*[\]}])", written)]
    if not (equals and key.strip() and all(values)):
        fault = Fault("--grid", text, "not understood", "allowed: key.path=a,b,c")
        raise InputError([fault])
    try:
        found = tuple(one for value in values for one in value_texts(value))
    except ValueError as error:
        raise InputError([Fault("--grid", text, str(error), f"allowed: {ALLOWED}")]) from None
    return key.strip(), found
