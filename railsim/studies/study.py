"""`study`: vehicles x tracks x speeds x further values, one result file a run.

A run whose file is there with the same inputs is not computed again, so an interrupted study goes
on where it was when it is started again.  What is done stands in the journal.
"""

import errno
import logging
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from railsim.errors import Fault, InputError
from railsim.files import check_folder, is_file, make_folder, sweep
from railsim.result import Result, open_result
from railsim.studies.case import Case
from railsim.studies.combine import Plan
from railsim.studies.execute import (
    Batch,
    Job,
    batches,
    cluster,
    in_processes,
    in_this_process,
    on_cluster,
)
from railsim.studies.journal import JOURNAL, Journal, Record, Records
from railsim.studies.points import Point
from railsim.studies.summary import (
    Inputs,
    checked,
    finished_record,
    read_index,
    waiting_record,
    write_index,
)
from railsim.version import __version__

_LOG = logging.getLogger(__name__)
MANY = 10_000  # runs from which on an index that is up to date is not made once more
# after one of these no other run could be written either
NOTHING_MORE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ENOENT, errno.EFBIG)


@dataclass(frozen=True)
class Outcome:
    """What a study left in its folder.

    Attributes
    ----------
    folder : Path
        Holds the result files, ``summary.csv`` and ``study.json``.
    records : sequence of dict
        One for every run, in the order of the combinations; read when asked for.
    computed : int
        Number of runs that were computed now; the others were there.
    """

    folder: Path
    records: Records
    computed: int

    @property
    def failed(self) -> tuple[Record, ...]:
        """Runs without a result."""
        return self.records.with_status("failed")

    @property
    def ended_early(self) -> tuple[Record, ...]:
        """Runs that ended early for a physical reason."""
        return self.records.with_status(but=("complete", "failed"))

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
    on_remark: Callable[[str], None] | None = None,
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
        Called with the record of every run that is done.
    on_remark : callable, optional
        Called with every sentence on what was found in the folder, such as damaged results that
        are computed again; by default they go to the log.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        Everything that is wrong in the inputs; files in the folder belong to other inputs and
        neither `resume` nor `overwrite` is given.

    Examples
    --------
    >>> import railsim, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = railsim.study(
    ...         ["coach_manchester"], ["curve_r250"], [20.0], until=10.0, out=folder, workers=1
    ...     )
    ...     print([record["status"] for record in outcome.records])
    ['complete']
    """
    folder = Path(out)
    check_folder(folder)
    vehicles, tracks, speeds = _several(vehicles), _several(tracks), _several(speeds)
    written = {key: [str(v) for v in _several(values)] for key, values in (grid or {}).items()}
    plan = Plan(
        vehicles,
        tracks,
        speeds,
        written,
        settings=settings,
        start=start,
        duration=duration,
        until=until,
        assignments=assignments,
        workers=workers or cores(),
    )
    inputs = {
        "railsim_version": __version__,
        "folder": os.path.relpath(Path.cwd(), folder),  # where names of files begin
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
    outcome = carry_out(
        plan, inputs, folder, workers=workers, together=together, scheduler=scheduler,
        resume=resume, overwrite=overwrite, plots=plots, progress=progress, on_record=on_record,
        on_remark=on_remark,
    )  # fmt: skip
    if plots:
        from railsim.studies.pictures import draw

        draw(outcome)
    return outcome


class Runs(Protocol):
    """What is to be done, such as `Plan`.

    Attributes
    ----------
    points : list of Point
        What each run is asked for.
    """

    points: list[Point]

    def cases(self, points: Sequence[Point]) -> list[Case]:
        """Load what the runs of some points need."""


def carry_out(
    plan: Runs,
    inputs: Mapping[str, Any],
    folder: Path,
    *,
    workers: int | None = None,
    together: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    plots: bool = False,
    longest_first: bool = False,
    progress: Callable[[float], None] | None = None,
    on_record: Callable[[Record], None] | None = None,
    on_remark: Callable[[str], None] | None = None,
) -> Outcome:
    """Do the runs of a study or a campaign that are not done, with the journal of its folder.

    Parameters
    ----------
    plan : Runs
        What is to be done.
    inputs : mapping
        What was asked for, as the journal and the index keep it, see `Inputs`.
    longest_first : bool
        Begin with the longest runs, so that no core is left with one of them at the end.

    Others as in `study`.
    """
    with ExitStack() as stack:
        known = None
        if is_file(folder / JOURNAL):
            known = stack.enter_context(Journal(folder))
        if not (resume or overwrite):
            _refuse_another_study(folder, known, inputs)
        state = _State(folder, plan, known, resume=resume, overwrite=overwrite)
        client = None if scheduler is None else cluster(scheduler)
        make_folder(folder)
        sweep(folder)
        journal = known or stack.enter_context(Journal(folder))
        if overwrite:
            journal.clear()
        elif known is None and journal.entries:
            raise InputError([Fault("--out", "", f"another study has begun in {folder}", "")])
        journal.begin(inputs)
        remark = on_remark or _LOG.warning
        for text in state.settle(journal):
            remark(text)
        jobs = [_job(case, folder, plots) for case in state.cases]
        if longest_first:
            jobs.sort(key=lambda job: -job.case.track.length / job.case.speed)
        keys = {point.name: point.key for point in plan.points}
        status = "interrupted"
        try:
            if jobs:
                with suppress(FileNotFoundError):  # it would be out of date
                    (folder / "study.json").unlink()
            for record in _executed(jobs, together, workers, client, progress or (lambda _: None)):
                file = folder / record["file"] if record["status"] != "failed" else None
                journal.add(record, keys[record["name"]], None if file is None else file.stat())
                if on_record is not None:
                    on_record(record)
                if record.get("errno") in NOTHING_MORE:
                    raise OSError(record["errno"], os.strerror(record["errno"]), str(folder))
            status = "complete"
        except BaseException:
            with suppress(OSError):  # the disk may be full
                write_index(folder, inputs, status, state.records(journal))
            raise
        whole = len(plan.points) > MANY and _is_newer(folder / "study.json", journal.path)
        if jobs or state.found or not whole:
            write_index(folder, inputs, status, state.records(journal))
        return Outcome(folder, state.records(journal), len(jobs))


class _State:
    """What of a study is done and what is to be computed.

    Attributes
    ----------
    cases : list of Case
        What is to be computed.
    found : list of (Point, Record)
        Results that are there and that the journal does not know.

    Raises
    ------
    InputError
        Everything that is wrong in what is to be computed; without `resume` also results that would
        have to be replaced.
    """

    def __init__(
        self, folder: Path, plan: Runs, known: Journal | None, *, resume: bool, overwrite: bool
    ) -> None:
        self._folder, self._plan = folder, plan
        self._entries = dict(known.entries) if known and not overwrite else {}
        self._there = {} if overwrite else _files(folder)
        self._damaged: dict[Path, str] = {}
        self._changed: list[str] = []
        self._lines = known.damaged if known else 0
        self.found: list[tuple[Point, Record]] = []
        points = [point for point in plan.points if not self._is_done(point)]
        self._waiting = dict(zip(points, plan.cases(points), strict=True))
        faults = [
            fault
            for point, case in self._waiting.items()
            if case.file_name in self._there
            for fault in self._look_at(point, case)
        ]
        if faults and not resume:
            raise InputError(faults)
        known_ones = {point for point, _ in self.found}
        self.cases = [case for point, case in self._waiting.items() if point not in known_ones]

    def _is_done(self, point: Point) -> bool:
        """Whether the journal knows the result, of these inputs, and its file has not changed."""
        entry = self._entries.get(point.name)
        if entry is None or entry.status in ("failed", "waiting") or not point.key:
            return False
        return entry.key == point.key and entry.is_of(self._there.get(f"{point.name}.h5"))

    def _look_at(self, point: Point, case: Case) -> list[Fault]:
        """Take a result that is there, or say why it cannot be taken."""
        path = self._folder / case.file_name
        try:
            result = open_result(path)
            if result.attributes.get("inputs_hash") == case.key:
                self.found.append((point, finished_record(case, result)))
                return []
        except InputError as error:
            self._damaged[path] = str(error.faults[0])
            return list(error.faults)
        self._changed.append(case.name)
        allowed = "--resume computes what has changed, --overwrite everything; or another --out"
        return [Fault("--out", str(path), "a result of other inputs", allowed)]

    def settle(self, journal: Journal) -> list[str]:
        """Record what was found, move away what is damaged; return what the user should know."""
        remarks = []
        if self._lines:
            remarks.append(f"{self._lines} damaged lines of {JOURNAL} are left out")
        for point, record in self.found:
            journal.add(record, point.key, self._there[record["file"]])
        for path, words in self._damaged.items():
            kept = path.with_name(f"{path.name}.damaged")
            os.replace(path, kept)
            remarks.append(f"{words}: it is computed again; the old file is kept as {kept.name}")
        lost = [
            case.name
            for case in self.cases
            if self._entries.get(case.name)
            and case.file_name not in self._there
            and self._entries[case.name].size
        ]
        for names, words in ((self._changed, "of other inputs"), (lost, "no longer there")):
            if names:
                number = "1 result is" if len(names) == 1 else f"{len(names)} results are"
                remarks.append(f"{number} {words} and computed again: {_listed(names)}")
        return remarks

    def records(self, journal: Journal) -> Records:
        """Return the records of all runs, done or waiting, in the order of the combinations."""
        waiting = {point.name: case for point, case in self._waiting.items()}
        return Records(
            journal.path,
            [
                journal.entries.get(point.name) or waiting_record(waiting[point.name])
                for point in self._plan.points
            ],
        )


def _files(folder: Path) -> dict[str, os.stat_result]:
    """Return the result files of a folder; a hundred thousand take less than a second."""
    try:
        with os.scandir(folder) as entries:
            return {entry.name: entry.stat() for entry in entries if entry.name.endswith(".h5")}
    except OSError:  # not there, or no folder
        return {}


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more


def _is_newer(one: Path, other: Path) -> bool:
    try:
        return one.stat().st_mtime_ns >= other.stat().st_mtime_ns
    except OSError:
        return False


def stored_inputs(folder: Path) -> tuple[Inputs, Path]:
    """Return the inputs of the study in a folder, and the folder where its names of files begin.

    Raises
    ------
    InputError
        There is no study, or it cannot be read.
    """
    data: Any = None
    if is_file(folder / JOURNAL):
        with Journal(folder) as journal:
            data = journal.inputs
    if data is None:
        index = folder / "study.json"
        if not is_file(index):
            found = f"no study in {folder} to resume"
            fault = Fault("--resume", "", found, "give --vehicles, --tracks and --speeds")
            raise InputError([fault])
        inputs = read_index(index).inputs
    else:
        inputs = checked(Inputs, data, str(folder / JOURNAL))
    base = (folder / inputs.folder).resolve()
    return inputs, base if os.path.isdir(base) else Path.cwd()


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


def _refuse_another_study(
    folder: Path, known: Journal | None, inputs: Mapping[str, object]
) -> None:
    there = known.inputs if known else None
    if there is None:
        try:
            there = read_index(folder / "study.json").inputs.model_dump()
        except InputError:
            return
    asked = {name: value for name, value in inputs.items() if name != "folder"}
    differing = [name for name, value in asked.items() if there.get(name, value) != value]
    if differing:
        found = f"{folder} holds a study with other " + ", ".join(differing)
        allowed = "--resume goes on with these inputs, --overwrite computes everything; or another"
        raise InputError([Fault("--out", "", found, f"{allowed} --out")])
