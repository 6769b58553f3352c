"""Critical speeds over conicity, friction or any key of the files, point by point over the cores.

Each finished point is stored in the folder under a name with a hash of its inputs, so that the same
command continues an interrupted map.  A damaged point is computed again.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from railsim.definitions import Settings, Track, Vehicle
from railsim.errors import RailsimError
from railsim.linear.vehicle import AMPLITUDE, Contact, laws_in_words
from railsim.processes import WorkerPool, available_cores
from railsim.profiles.used import profile_hashes
from railsim.stability.critical_speed import checked, critical_speed
from railsim.studies.records import Record, stored_record, write_record
from railsim.studies.spec import Progress
from railsim.table import Column, Table
from railsim.version import __version__


@dataclass(frozen=True)
class MapPoint:
    """One point of a map: the inputs that differ between points."""

    values: dict[str, float]  # by name: ``conicity``, ``friction`` or the path of a key
    vehicle: Vehicle  # definitions have the values of the point, except its conicity
    track: Track
    settings: Settings


def stability_map(
    points: Sequence[MapPoint],
    options: dict[str, Any],
    *,
    folder: Path | None,
    workers: int | None,
    overwrite: bool,
    progress: Progress,
    on_remark: Callable[[str], None],
) -> list[Record]:
    """Return the record of `critical_speed` at each point, in their order.

    `options`: further arguments of `critical_speed`; `folder`: folder for finished points, if any;
    `workers`: processes; None: one for each core; `overwrite`: compute everything again;
    `progress`: called repeatedly with the finished fraction; `on_remark`: called with a sentence on
    every stored point that is damaged and computed again. Raises InputError: an option is wrong.
    """
    contact = options["linearisation"], options["amplitude"]
    others = {"linearisation", "amplitude", "over_amplitude"}
    search_options = {name: value for name, value in options.items() if name not in others}
    for conicity in dict.fromkeys(point.values.get("conicity") for point in points):
        checked(Contact(*contact, conicity), **search_options)  # before the first point is computed
    paths = [_stored_path(folder, point, options) for point in points]
    stored = {} if overwrite else {k: stored_record(p, on_remark) for k, p in enumerate(paths)}
    records = {number: record for number, record in stored.items() if record is not None}
    progress(len(records) / len(points))
    waiting = {number: point for number, point in enumerate(points) if number not in records}
    count = min(workers or available_cores(), max(1, len(waiting)))
    for number, record in _compute(waiting, options, count):
        records[number] = record
        path = paths[number]
        if path is not None:
            write_record(path, record)
        progress(len(records) / len(points))
    return [records[number] for number in range(len(points))]


def _compute(
    waiting: Mapping[int, MapPoint], options: dict[str, Any], workers: int
) -> Iterator[tuple[int, Record]]:
    """Yield number and record of each point as it ends."""
    if workers == 1:
        for number, point in waiting.items():
            yield number, point_record(point, options)
        return
    with WorkerPool(workers) as pool:
        futures = {pool.submit(point_record, point, options): n for n, point in waiting.items()}
        for future in as_completed(futures):
            yield futures[future], future.result()


def point_record(point: MapPoint, options: dict[str, Any]) -> Record:
    """Record of one point."""
    conicity = {"conicity": point.values["conicity"]} if "conicity" in point.values else {}
    try:
        speeds = critical_speed(
            point.vehicle, point.track, settings=point.settings, **{**options, **conicity}
        )
    except RailsimError as error:
        where = ", ".join(f"{name} {value}" for name, value in point.values.items())
        why = f"{where}: {error}"
        return {"at": point.values, "linear": None, "nonlinear": None, "remarks": [why]}
    return {"at": point.values, **speeds.record()}


def _stored_path(folder: Path | None, point: MapPoint, options: dict[str, Any]) -> Path | None:
    if folder is None:
        return None
    files: list[Any] = [part.to_toml() for part in (point.vehicle, point.track, point.settings)]
    files.append(profile_hashes(point.vehicle, point.track))
    text = json.dumps([__version__, *files, point.values, options], sort_keys=True)
    return folder / "points" / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"


def map_speeds(records: Sequence[Record]) -> dict[str, np.ndarray]:
    """Return the critical speeds of a map by method in words, NaN where there is none [m/s]."""
    first = next((record for record in records if "linearisation" in record), {})
    # of those that failed too, which say only where they are
    conicities = [r.get("conicity") or r.get("at", {}).get("conicity") for r in records]
    cones = {conicity for conicity in conicities if conicity}
    kind, amplitude = first.get("linearisation", "tangent"), first.get("amplitude") or AMPLITUDE
    contact = Contact(kind, amplitude, cones.pop() if len(cones) == 1 else None)
    kinds = {"linear": f"linear, {contact.words()}"}
    methods = dict.fromkeys(m for one in records for m in one.get("nonlinear_by_method") or ())
    if methods:
        kinds["nonlinear"] = f"non-linear, {', '.join(methods)}"
    return {
        words: np.array([(record[kind] or {}).get("speed") for record in records], dtype=float)
        for kind, words in kinds.items()
    }


def map_table(records: Sequence[Record], parameters: Mapping[str, str]) -> Table:
    """Return the critical speeds of a map over its parameters, and why a linear one is missing.

    `records`: see `stability_map`; `parameters`: keys that have several values,
    with their units.
    """
    speeds = map_speeds(records)
    columns = [Column(name, unit=unit, format="g") for name, unit in parameters.items()]
    columns += [Column(words, unit="m/s", format=".2f") for words in speeds]
    of_point = zip(records, *speeds.values(), strict=True)
    rows = [[*(record["at"][name] for name in parameters), *cells] for record, *cells in of_point]
    missing = [_why_no_linear(record) for record in records]
    if any(missing):
        columns.append(Column("linear", " "))
        rows = [[*row, words] for row, words in zip(rows, missing, strict=True)]
    where: dict[str, str] = next(
        (record["conditions"] for record in records if "conditions" in record), {}
    )
    words = [f"rails {where['rails']}", laws_in_words(where)] if where else []
    if "friction" not in parameters and where:
        words.append(f"friction {where['friction']}")
    return Table(columns, rows, ", ".join(words))


def _why_no_linear(record: Record) -> str:
    """Why a point has no linear critical speed; empty where it has one."""
    if record["linear"]:
        return ""
    low, high = record.get("searched", (None, None))
    if low is None:
        return "not computed"
    return f"unstable at {low:g} m/s" if record.get("unstable_at_low") else f"none to {high:g} m/s"
