"""`study`: vehicles x tracks x speeds x further values, one result file a run.

A run whose file is there with the same inputs is not computed again, so an interrupted study goes
on where it was when it is started again.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railsim.errors import Fault, InputError
from railsim.files import check_folder, make_folder
from railsim.result import Result, open_result
from railsim.studies.case import Case
from railsim.studies.combine import combinations
from railsim.studies.execute import (
    Batch,
    Job,
    batches,
    cluster,
    in_processes,
    in_this_process,
    on_cluster,
)
from railsim.studies.summary import (
    Record,
    finished_record,
    read_index,
    waiting_record,
    write_index,
)
from railsim.version import __version__


@dataclass(frozen=True)
class Outcome:
    """What a study left in its folder.

    Attributes
    ----------
    folder : Path
        Holds the result files, ``summary.csv`` and ``study.json``.
    records : tuple of dict
        One for every run, in the order of the combinations.
    computed : int
        Number of runs that were computed now; the others were there.
    """

    folder: Path
    records: tuple[Record, ...]
    computed: int

    @property
    def failed(self) -> tuple[Record, ...]:
        """Runs without a result."""
        return tuple(record for record in self.records if record["status"] == "failed")

    @property
    def ended_early(self) -> tuple[Record, ...]:
        """Runs that ended early for a physical reason."""
        whole = ("complete", "failed")
        return tuple(record for record in self.records if record["status"] not in whole)

    def results(self) -> dict[str, Result]:
        """Return the results by the names of their runs; arrays are read when asked for."""
        return {
            record["name"]: open_result(self.folder / record["file"])
            for record in self.records
            if record["status"] != "failed"
        }


def study(
    vehicles: Sequence[str | Path] | str | Path,
    tracks: Sequence[str | Path] | str | Path,
    speeds: Sequence[float] | float,
    *,
    out: str | Path,
    grid: Mapping[str, Iterable[object] | float] | None = None,
    settings: str | Path | None = None,
    start: float = 0.0,
    duration: float | None = None,
    until: float | None = None,
    assignments: Sequence[str] = (),
    workers: int | None = None,
    together: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    plots: bool = False,
    progress: Callable[[float], None] | None = None,
    on_record: Callable[[Record], None] | None = None,
) -> Outcome:
    """Run every combination of vehicles, tracks, speeds and the values of a grid.

    Parameters
    ----------
    vehicles, tracks : sequence of str or Path, or a single one
        Files, or names of shipped ones.
    speeds : sequence of float, or a single one
        Speeds [m/s].
    out : str or Path
        Folder of the study; made if need be.
    grid : mapping of str to values, optional
        Values of further keys, ``{"track.friction": [0.3, 0.4]}``.
    settings : str or Path, optional
        Settings file for all runs.
    start : float
        Distance at which all runs start [m].
    duration, until : float, optional
        End of all runs: time [s] or distance [m].
    assignments : sequence of str
        ``key.path=value`` for all runs.
    workers : int, optional
        Processes; by default one for each core.
    together : int
        How many runs that differ in the vehicle only share a call at most; results are the same.
    scheduler : str, optional
        Address of a dask scheduler whose workers do the runs instead.
    resume : bool
        Go on with the study that is in the folder: runs whose inputs have changed are computed
        again.
    overwrite : bool
        Compute everything again.
    plots : bool
        Draw every run, and the vehicles against each other.
    progress : callable, optional
        Called with the finished fraction now and then.
    on_record : callable, optional
        Called with the record of every run that is done or found done.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError : everything that is wrong in the inputs; files in the folder belong to other
        inputs and neither `resume` nor `overwrite` is given.

    Examples
    --------
    >>> import railsim, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = railsim.study(
    ...         ["coach_manchester"], ["curve_r250"], [20.0], until=10.0, out=folder, workers=1
    ...     )
    >>> [record["status"] for record in outcome.records]
    ['complete']
    """
    folder = Path(out)
    check_folder(folder)
    vehicles, tracks, speeds = _several(vehicles), _several(tracks), _several(speeds)
    written = {key: [str(v) for v in _several(values)] for key, values in (grid or {}).items()}
    cases = combinations(
        vehicles,
        tracks,
        speeds,
        written,
        settings=settings,
        start=start,
        duration=duration,
        until=until,
        assignments=assignments,
    )
    inputs = {
        "railsim_version": __version__,
        "vehicles": [str(vehicle) for vehicle in vehicles],
        "tracks": [str(track) for track in tracks],
        "speeds": list(speeds),
        "grid": written,
        "settings": None if settings is None else str(settings),
        "start": start,
        "duration": duration,
        "until": until,
        "assignments": list(assignments),
    }
    if not (resume or overwrite):
        _refuse_another_study(folder, inputs)
    finished = {} if overwrite else _finished(cases, folder, resume=resume)
    client = None if scheduler is None else cluster(scheduler)
    make_folder(folder)
    tell = on_record or (lambda _: None)
    records = {case.name: waiting_record(case) for case in cases}
    for case in cases:
        if case.name in finished:
            records[case.name] = finished_record(case, finished[case.name])
            tell(records[case.name])
    jobs = [_job(case, folder, plots) for case in cases if case.name not in finished]
    write_index(folder, inputs, "running", list(records.values()))
    status = "interrupted"
    try:
        for record in _executed(jobs, together, workers, client, progress or (lambda _: None)):
            records[record["name"]] = record
            write_index(folder, inputs, "running", list(records.values()))
            tell(record)
        status = "complete"
    finally:
        write_index(folder, inputs, status, list(records.values()))
    outcome = Outcome(folder, tuple(records.values()), len(jobs))
    if plots:
        from railsim.studies.pictures import draw

        draw(outcome)
    return outcome


def _several(values: Any) -> list[Any]:
    """Return values as a list, also where a single one is given."""
    return [values] if isinstance(values, str | Path | float | int) else list(values)


def _job(case: Case, folder: Path, plots: bool) -> Job:
    path = (folder / case.file_name).resolve()
    return Job(case, path, path.with_suffix(".png") if plots else None)


def _executed(
    jobs: Sequence[Job],
    together: int,
    workers: int | None,
    client: Any,
    progress: Callable[[float], None],
) -> Iterable[Record]:
    if client is not None:
        threads = sum(client.nthreads().values())
        return on_cluster(batches(jobs, together, max(1, threads)), client, progress)
    count = workers or cores()
    work: Sequence[Batch] = batches(jobs, together, count)
    count = min(count, len(work))
    return in_processes(work, count, progress) if count > 1 else in_this_process(work, progress)


def cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _finished(cases: Sequence[Case], folder: Path, *, resume: bool) -> dict[str, Result]:
    """Return the results that are there already; refuse files that would have to be replaced."""
    finished: dict[str, Result] = {}
    faults: list[Fault] = []
    for case in cases:
        path = folder / case.file_name
        if not path.exists():
            continue
        try:
            result = open_result(path)
        except InputError as error:
            faults.extend(error.faults)
            continue
        if result.attributes.get("inputs_hash") == case.key:
            finished[case.name] = result
        elif not resume:
            allowed = "--resume computes what has changed, --overwrite everything; or another --out"
            faults.append(Fault("--out", str(path), "a result of other inputs", allowed))
    if faults:
        raise InputError(faults)
    return finished


def _refuse_another_study(folder: Path, inputs: Mapping[str, object]) -> None:
    try:
        there = read_index(folder / "study.json")["inputs"]
    except InputError:
        return
    differing = [name for name, value in inputs.items() if there.get(name) != value]
    if differing:
        found = f"{folder} holds a study with other " + ", ".join(differing)
        allowed = "--resume goes on with these inputs, --overwrite computes everything; or another"
        raise InputError([Fault("--out", "", found, f"{allowed} --out")])
