"""`study`: vehicles x tracks x speeds x further values, one result file a run.

A run whose file is there with the same inputs is not computed again, so an interrupted study goes
on where it was when it is started again.  What is done stands in the journal.
"""

import errno
import logging
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from railsim.definitions.analyses import Analyses, Analysis, needs_run
from railsim.definitions.base import Definition, FileDefinition
from railsim.definitions.settings import Settings
from railsim.definitions.study import Sample, value_texts
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
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
from railsim.studies.given import as_files
from railsim.studies.journal import JOURNAL, Journal, Record, Records
from railsim.studies.keep import ALL, EVERYTHING, Keep, parse_keep
from railsim.studies.own import Function, fingerprint, named
from railsim.studies.points import Point
from railsim.studies.rows import PERMITTED, speed_of
from railsim.studies.summary import (
    Inputs,
    checked,
    finished_record,
    read_index,
    summary_row,
    unit_of,
    waiting_record,
    write_index,
)
from railsim.units import ALLOWED
from railsim.version import __version__

if TYPE_CHECKING:
    import pandas
    import xarray

_LOG = logging.getLogger(__name__)
MANY = 10_000  # runs from which on an index that is up to date is not made once more
CHANGED = "--resume computes what has changed, --overwrite everything; or another --out"
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
            if record["status"] not in ("failed", "waiting") and record["file"]
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return the summary, one row a run, as a `pandas.DataFrame` [SI].

        Raises
        ------
        ImportError : pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise ImportError(
                "to_dataframe needs pandas; install it with: pip install pandas"
            ) from None
        rows = [summary_row(record) for record in self.records]
        frame = pandas.DataFrame(rows)
        labels = [name for name in dict.fromkeys(n for r in self.records for n in r["labels"])]
        for name in labels:  # values of a grid are texts, as in a file
            with suppress(ValueError, TypeError):
                frame[name] = pandas.to_numeric(frame[name])
        return frame

    def to_xarray(self) -> "xarray.Dataset":
        """Return the numbers of the summary as an `xarray.Dataset` with the grid as dimensions.

        Dimensions are what differs between the runs; where these are no full grid, as with a
        sample, the dimension is ``run``.  Each variable has its ``units``.

        Raises
        ------
        ImportError : pandas or xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise ImportError(
                "to_xarray needs xarray; install it with: pip install 'railsim[xarray]'"
            ) from None
        frame = self.to_dataframe()
        labels = list(dict.fromkeys(name for record in self.records for name in record["labels"]))
        varied = [name for name in labels if frame[name].nunique(dropna=False) > 1]
        numbers = frame.select_dtypes("number").columns.difference(labels, sort=False)
        full = math.prod(frame[name].nunique() for name in varied) == len(frame)
        if varied and full and not frame.duplicated(varied).any():
            data = xarray.Dataset.from_dataframe(frame.set_index(varied)[list(numbers)])
        else:
            indexed = frame.set_index("name").rename_axis("run")
            data = xarray.Dataset.from_dataframe(indexed[[*varied, *numbers]]).set_coords(varied)
        for name in data:
            data[name].attrs["units"] = unit_of(str(name)) or "1"
        return data


def study(
    vehicles: Sequence[str | Path | Vehicle] | str | Path | Vehicle,
    tracks: Sequence[str | Path | Track] | str | Path | Track,
    speeds: Sequence[float | str | None] | float | str | None,
    *,
    out: str | Path,
    grid: Mapping[str, Iterable[object] | float | str] | None = None,
    linked: Sequence[Mapping[str, Iterable[object] | str]] = (),
    sample: Sample | Mapping[str, Any] | None = None,
    quantities: str | Function | None = None,
    analyses: Mapping[str, Analysis | Mapping[str, Any]] | None = None,
    settings: str | Path | Settings | None = None,
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
    keep: str = ALL,
    compress: bool = False,
    single: bool = False,
    progress: Callable[[float], None] | None = None,
    on_record: Callable[[Record], None] | None = None,
    on_remark: Callable[[str], None] | None = None,
) -> Outcome:
    """Run every combination of vehicles, tracks, speeds and the values of a grid.

    Parameters
    ----------
    vehicles, tracks : sequence of str, Path or definition, or a single one
        Files, names of shipped ones, or `Vehicle` and `Track`, which are written into ``inputs/``
        of the folder.
    speeds : sequence of float, a single one, or a range such as ``"15:25:11"``; None
        Speeds [m/s]; None where the settings have a speed table, or `linked` or `sample` vary
        ``speed``; ``"permitted"`` is the lower of the vehicle's and the track's speed.
    out : str or Path
        Folder of the study; made if need be.
    grid : mapping of str to values, optional
        Values of further keys, ``{"track.friction": [0.3, 0.4]}`` or ``"0.2:0.5:4"``.
    linked : sequence of mappings, optional
        Keys whose values go together, the first of one with the first of the others.
    sample : Sample or mapping, optional
        Random values of further keys, as the table ``sample`` of a study file.
    quantities : callable or str, optional
        Function of the result that returns further numbers by their names, or
        ``FILE.py:FUNCTION``.
    analyses : mapping of str to Analysis or mapping, optional
        What is computed at each point, as the tables ``analyses`` of a study file; by default a
        run.
    settings : str, Path or Settings, optional
        Settings for all runs.
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
    keep : str
        ``all``; ``summary``, no result files; or names of quantities with commas between, ``*``
        standing for any letters.  Summaries are made before anything is left out.
    compress, single : bool
        Store arrays compressed, and with 4 bytes a number.
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
    kept = parse_keep(keep, compress=compress, single=single)
    vehicles = as_files(_several(vehicles), folder)
    tracks = as_files(_several(tracks), folder)
    (settings,) = as_files([settings], folder)
    asked = _speeds(speeds)
    written = _written("grid", grid or {})
    tables = [_written("linked", table) for table in linked]
    drawn = None if sample is None else _sample(sample)
    own = named(quantities)
    work = _analyses(analyses or {})
    if own and not needs_run(work):
        fault = Fault("--quantities", "", "no analysis makes a run", 'add one of kind = "run"')
        raise InputError([fault])
    plan = Plan(
        vehicles,
        tracks,
        asked,
        written,
        linked=tables,
        sample=drawn,
        told=fingerprint(own),
        analyses=work,
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
        "speeds": asked,
        "grid": written,
        "linked": tables,
        "sample": None if drawn is None else drawn.model_dump(exclude_none=True),
        "quantities": own,
        "analyses": {
            name: one.model_dump(mode="json", exclude_none=True) for name, one in work.items()
        },
        "keep": keep,
        "compress": compress,
        "single": single,
        "settings": None if settings is None else str(settings),
        "start": start,
        "duration": duration,
        "until": until,
        "assignments": list(assignments),
    }
    outcome = carry_out(
        plan, inputs, folder, own=own, keep=kept, workers=workers, together=together,
        scheduler=scheduler, resume=resume, overwrite=overwrite, plots=plots, progress=progress,
        on_record=on_record, on_remark=on_remark,
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
    own: str | None = None,
    keep: Keep = EVERYTHING,
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
    own : str, optional
        Function of own quantities, see `railsim.studies.own`.
    keep : Keep
        What is kept of each result.

    Others as in `study`.
    """
    with ExitStack() as stack:
        known = None
        if is_file(folder / JOURNAL):
            known = stack.enter_context(Journal(folder))
        if not (resume or overwrite):
            _refuse_another_study(folder, known, inputs)
        state = _State(folder, plan, known, own, keep, resume=resume, overwrite=overwrite)
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
        jobs = [
            _job(case, folder, plots, own, keep, there=case.name in state.there)
            for case in state.cases
        ]
        if longest_first:
            jobs.sort(key=lambda job: -job.case.track.length / job.case.speed)
        keys = {point.name: point.key for point in plan.points}
        status = "interrupted"
        try:
            if jobs:
                with suppress(FileNotFoundError):  # it would be out of date
                    (folder / "study.json").unlink()
            for record in _executed(jobs, together, workers, client, progress or (lambda _: None)):
                there = record["status"] != "failed" and record["file"]
                file = folder / record["file"] if there else None
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
    there : set of str
        Names of the cases whose run is there, but not their analyses.

    Raises
    ------
    InputError
        Everything that is wrong in what is to be computed; without `resume` also results that would
        have to be replaced.
    """

    def __init__(
        self,
        folder: Path,
        plan: Runs,
        known: Journal | None,
        own: str | None,
        keep: Keep,
        *,
        resume: bool,
        overwrite: bool,
    ) -> None:
        self._folder, self._plan, self._own, self._keep = folder, plan, own, keep
        self._entries = dict(known.entries) if known and not overwrite else {}
        self._there = {} if overwrite else _files(folder)
        self._damaged: dict[Path, str] = {}
        self._changed: list[str] = []
        self._lines = known.damaged if known else 0
        self.found: list[tuple[Point, Record]] = []
        self.there: set[str] = set()
        points = [point for point in plan.points if not self._is_done(point)]
        self._waiting = dict(zip(points, plan.cases(points), strict=True))
        faults = [
            fault for point, case in self._waiting.items() for fault in self._faults_of(point, case)
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
        if not entry.size and not self._keep.summary and point.has_run:
            return False  # the summary was kept, the file is wanted
        return entry.key == point.key and entry.is_of(self._there.get(f"{point.name}.h5"))

    def _faults_of(self, point: Point, case: Case) -> list[Fault]:
        """Look at what is there of a case: a file, or a summary without one."""
        if case.file_name in self._there:
            return self._look_at(point, case)
        entry = self._entries.get(case.name)
        done = entry is not None and entry.status not in ("failed", "waiting") and not entry.size
        if entry is None or not done or entry.key == point.key:
            return []
        self._changed.append(case.name)
        return [Fault("--out", case.name, "a summary of other inputs", CHANGED)]

    def _look_at(self, point: Point, case: Case) -> list[Fault]:
        """Take a result that is there, or say why it cannot be taken."""
        path = self._folder / case.file_name
        try:
            result = open_result(path)
            if result.attributes.get("inputs_hash") == case.key:
                if case.analyses:  # these take their time: it is a job like others
                    self.there.add(case.name)
                else:
                    self.found.append((point, finished_record(case, result, self._own)))
                return []
        except InputError as error:
            self._damaged[path] = str(error.faults[0])
            return list(error.faults)
        self._changed.append(case.name)
        return [Fault("--out", str(path), "a result of other inputs", CHANGED)]

    def settle(self, journal: Journal) -> list[str]:
        """Record what was found, move away what is damaged; return what the user should know."""
        remarks = []
        if self._lines:
            remarks.append(f"{self._lines} damaged lines of {JOURNAL} are left out")
        for point, record in self.found:
            if self._keep.summary:
                (self._folder / record["file"]).unlink()
                journal.add({**record, "file": ""}, point.key, None)
            else:
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
    single = isinstance(values, str | Path | float | int | FileDefinition)
    return [values] if single else list(values)


def _speeds(speeds: Any) -> list[float | str | None]:
    """Return speeds as numbers, those of a range, and with units [m/s]; `PERMITTED` as it is."""
    if speeds is None:
        return [None]
    found: list[float | str | None] = []
    for speed in _several(speeds):
        if isinstance(speed, str) and speed != PERMITTED:
            found += [speed_of(text) for text in _texts("speeds", speed)]
        else:
            found.append(speed)
    return found


def _written(what: str, values: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return values of keys as they are written in assignments."""
    found = {}
    for key, given in values.items():
        found[key] = [text for value in _several(given) for text in _texts(f"{what} {key}", value)]
    return found


def _texts(what: str, value: Any) -> list[str]:
    try:
        return value_texts(value if isinstance(value, str) else (_plain(value),))
    except ValueError as error:
        raise InputError([Fault(what, "", str(error), f"allowed: {ALLOWED}")]) from None


def _plain(value: Any) -> Any:
    """Return numbers of numpy as Python's own."""
    return value.item() if hasattr(value, "item") and not isinstance(value, str) else value


def _analyses(given: Mapping[str, Analysis | Mapping[str, Any]]) -> dict[str, Analysis]:
    whole = {name: one if isinstance(one, Definition) else dict(one) for name, one in given.items()}
    return checked(Analyses, {"analyses": whole}, "analyses").analyses


def _sample(given: Sample | Mapping[str, Any]) -> Sample:
    return given if isinstance(given, Sample) else checked(Sample, dict(given), "sample")


def _job(case: Case, folder: Path, plots: bool, own: str | None, keep: Keep, *, there: bool) -> Job:
    path = (folder / f"{case.name}.h5").resolve()
    picture = path.with_suffix(".png") if plots and case.file_name else None
    return Job(case, path, picture, own, keep, there)


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
