"""Critical speeds over conicity, friction or any key of the files, point by point over the cores.

Each point is kept in the folder as it is done, under a name that hashes its inputs: the same
command goes on where it was interrupted.  A kept point holds the CRC-32 of its record; a damaged
one is computed again.
"""

import hashlib
import json
import logging
import multiprocessing
import os
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError, RailsimError
from railsim.files import TABLE_BYTES, make_folder, read_text, whole_file
from railsim.stability.critical_speed import critical_speed
from railsim.threads import one_thread_each
from railsim.version import __version__

Progress = Callable[[float], None]
Record = dict[str, Any]

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class MapPoint:
    """One point of a map: everything that differs between points.

    Attributes
    ----------
    at : dict of str to float
        The parameters by name, ``conicity``, ``friction`` or the path of a key.
    vehicle, track, settings : Vehicle, Track, Settings
        With the values of the point, but for its conicity.
    """

    at: dict[str, float]
    vehicle: Vehicle
    track: Track
    settings: Settings


def stability_map(
    points: Sequence[MapPoint],
    options: dict[str, Any],
    *,
    folder: Path | None = None,
    workers: int | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
    on_remark: Callable[[str], None] | None = None,
) -> list[Record]:
    """Return the record of `critical_speed` at each point, in their order.

    Parameters
    ----------
    points : sequence of MapPoint
    options : dict
        Further arguments of `critical_speed`.
    folder : Path, optional
        Where finished points are kept.
    workers : int, optional
        Processes; by default one for each core.
    overwrite : bool
        Compute everything again.
    progress : callable, optional
        Called with the finished fraction now and then.
    on_remark : callable, optional
        Called with a sentence on every kept point that is damaged and computed again; by default
        these go to the log.

    A point that fails has its reason among the remarks.
    """
    jobs = [(point, options) for point in points]
    kept = [_kept(folder, job) for job in jobs]
    found: dict[int, Record] = {}
    for number, path in enumerate(kept):
        if path is not None and path.exists() and not overwrite:
            try:
                found[number] = _read(path)
            except InputError as error:
                (on_remark or _LOG.warning)(f"{error.faults[0]}: it is computed again")
    tell = progress or (lambda _: None)
    tell(len(found) / len(jobs))
    waiting = [number for number in range(len(jobs)) if number not in found]
    count = min(workers or os.cpu_count() or 1, max(1, len(waiting)))
    for number, record in _computed(jobs, waiting, count):
        found[number] = record
        path = kept[number]
        if path is not None:
            make_folder(path.parent)
            with whole_file(path) as partial:
                partial.write_text(_text(record), encoding="utf-8")
        tell(len(found) / len(jobs))
    return [found[number] for number in range(len(jobs))]


def _computed(jobs: Sequence[Any], waiting: Sequence[int], workers: int) -> Any:
    """Yield number and record of each waiting job as it is done."""
    if workers == 1:
        for number in waiting:
            yield number, point_record(*jobs[number])
        return
    # "spawn": a fork of a process that has run compiled code with threads may hang
    context = multiprocessing.get_context("spawn")
    with one_thread_each(), ProcessPoolExecutor(workers, context) as pool:
        futures = {pool.submit(point_record, *jobs[number]): number for number in waiting}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def point_record(point: MapPoint, options: dict[str, Any]) -> Record:
    """Record of one point."""
    given = {"conicity": point.at["conicity"]} if "conicity" in point.at else {}
    try:
        found = critical_speed(
            point.vehicle, point.track, settings=point.settings, **{**options, **given}
        )
    except RailsimError as error:
        return {"at": point.at, "linear": None, "nonlinear": None, "remarks": [str(error)]}
    return {"at": point.at, **found.record()}


def _kept(folder: Path | None, job: tuple[MapPoint, dict[str, Any]]) -> Path | None:
    if folder is None:
        return None
    point, options = job
    files = [part.to_toml() for part in (point.vehicle, point.track, point.settings)]
    text = json.dumps([__version__, *files, point.at, options], sort_keys=True)
    return folder / "points" / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"


def _text(record: Record) -> str:
    """Record of a kept point as JSON, with the CRC-32 of the record's own JSON."""
    return json.dumps({"crc32": _crc(record), "record": record})


def _crc(record: Any) -> str:
    # what is read is written again in the same words: order and all digits of numbers are kept
    return f"{zlib.crc32(json.dumps(record).encode()):08x}"


def _read(path: Path) -> Record:
    """Record of a kept point.

    Raises
    ------
    InputError : it cannot be read, or is not as it was written.
    """
    text = read_text(path, TABLE_BYTES)
    try:
        kept = json.loads(text)
        whole = kept["crc32"] == _crc(kept["record"])
    except (ValueError, TypeError, KeyError, RecursionError):
        whole = False
    if not whole:
        raise InputError([Fault(str(path), "", "not as it was written", "")])
    record: Record = kept["record"]
    return record
