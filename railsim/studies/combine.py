"""From lists and grids to cases, with every fault of all of them at once."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.overrides import OVERRIDE, split_overrides
from railsim.definitions.track import Track
from railsim.errors import Fault, InputError
from railsim.simulation import check_range, initial_speed
from railsim.studies.case import Case, run_name, short_name

T = TypeVar("T")
Grid = Mapping[str, Sequence[str]]
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
    """Load what one run needs.

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
    *,
    settings: str | Path | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    assignments: Sequence[str] = (),
) -> list[Case]:
    """Return a case for every combination, vehicles outermost; see `load_case`.

    Parameters
    ----------
    grid : mapping of str to sequence of str, optional
        Values, written as in a file, of further keys.

    Raises
    ------
    InputError : everything that is wrong in any of them.
    """
    faults: list[Fault] = []
    grid = grid or {}
    if not (vehicles and tracks and speeds and all(grid.values())):
        raise InputError([Fault("study", "", "no combination", "give a vehicle, a track, a speed")])

    @cache
    def loaded(load: Callable[..., T], path: str | Path | None, own: tuple[str, ...]) -> T | None:
        try:
            return load(path, own)
        except InputError as error:
            faults.extend(_as_written(fault, KINDS[load], grid) for fault in error.faults)
            return None

    cases: list[Case] = []
    points = [dict(zip(grid, values, strict=True)) for values in product(*grid.values())]
    for vehicle, track, speed, point in product(vehicles, tracks, speeds, points):
        own: dict[str, list[str]] = {"vehicle": [], "track": [], "settings": []}
        for text in (*assignments, *(f"{key}={value}" for key, value in point.items())):
            try:
                for kind, texts in split_overrides([text]).items():
                    own[kind].extend(texts)
            except InputError as error:
                faults.extend(error.faults)
        a_vehicle = loaded(load_vehicle, vehicle, tuple(own["vehicle"]))
        a_track = loaded(load_track, track, tuple(own["track"]))
        a_settings = loaded(load_settings, settings, tuple(own["settings"]))
        first_speed = speed
        if a_settings:
            try:
                first_speed = initial_speed(a_settings, speed, start)
            except InputError as error:
                faults.extend(error.faults)
        if a_track and first_speed is not None:
            faults.extend(_range_faults(a_track, first_speed, start, duration, until))
        if a_vehicle and a_track and a_settings and first_speed is not None:
            labels: dict[str, str | float] = {
                "vehicle": short_name(vehicle),
                "track": short_name(track),
                "speed": first_speed,
                **point,
            }
            case = Case(
                run_name(vehicle, track, first_speed) + _suffix(point),
                a_vehicle,
                a_track,
                a_settings,
                first_speed,
                start,
                duration,
                until,
                labels,
            )
            cases.append(case)
    if not faults:
        faults += _profile_faults(cases) + _double_names(cases)
    if faults:
        raise InputError(dict.fromkeys(faults))
    return cases


def _as_written(fault: Fault, kind: str, grid: Grid) -> Fault:
    """Return the fault of an assignment with its key and option as they were given."""
    if fault.file != OVERRIDE:
        return fault
    key = f"{kind}.{fault.key}"
    of_grid = any(key == name or key.startswith(f"{name}.") for name in grid)
    return replace(fault, file="--grid" if of_grid else OVERRIDE, key=key)


def _profile_faults(cases: Sequence[Case]) -> list[Fault]:
    faults: list[Fault] = []
    for case in cases:
        try:
            _ = case.key  # reads every profile
        except InputError as error:
            faults.extend(error.faults)
    return faults


def _range_faults(
    track: Track, speed: float, start: float, duration: float | None, until: float | None
) -> list[Fault]:
    try:
        check_range(track, speed, start, duration, until)
    except InputError as error:
        return list(error.faults)
    return []


def _suffix(point: Mapping[str, str]) -> str:
    """Return what a point of the grid adds to the name of its run.

    Examples
    --------
    >>> _suffix({"track.friction": "0.3", "settings.drive.speed_table.0.1": "12"})
    '_friction=0.3_speed_table.0.1=12'
    """
    last = {key: re.sub(r"^.*\.(?=[^.]*[^.\d])", "", key) for key in point}
    unique = len(set(last.values())) == len(last)
    parts = [f"{last[key] if unique else key}={value}" for key, value in point.items()]
    return "".join("_" + re.sub(r"[^\w.+=-]+", "-", re.sub(r"[\[\]{}\"' ]", "", p)) for p in parts)


def _double_names(cases: Sequence[Case]) -> list[Fault]:
    counts = Counter(case.name for case in cases)
    return [
        Fault("study", name, f"{count} runs of this name", "give files with different names")
        for name, count in counts.items()
        if count > 1
    ]


def parse_grid(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the key and the values of ``key.path=a,b,c``; commas within brackets do not part.

    Examples
    --------
    >>> parse_grid("settings.fastsim_grid=[10,10],[20,20]")
    ('settings.fastsim_grid', ('[10,10]', '[20,20]'))

    Raises
    ------
    InputError : it is nothing of the kind.
    """
    key, equals, written = text.partition("=")
    values = tuple(value.strip() for value in re.split(r",(?![^\[{]*[\]}])", written))
    if not (equals and key.strip() and all(values)):
        fault = Fault("--grid", text, "not understood", "allowed: key.path=a,b,c")
        raise InputError([fault])
    return key.strip(), values
