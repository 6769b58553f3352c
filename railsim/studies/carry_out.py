"""`carry_out`: computes the missing runs of a study or a campaign, with the journal of its folder.

`State` knows from journal and files which runs are done, and which are to be computed.
"""

import errno
import logging
import os
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from railsim.errors import (
    Fault,
    Faults,
    InputError,
    ModelError,
    argument_error,
    argument_fault,
    listed,
)
from railsim.files.access import check_folder, is_file, make_folder, sweep
from railsim.laws.permission import check_laws
from railsim.notation import QUANTITIES
from railsim.processes import available_cores
from railsim.result import Result, open_result
from railsim.result.extremes import OF_FACTS
from railsim.result.hdf5 import Storage
from railsim.result.sinks import matches
from railsim.simulation.outputs import extra_quantities
from railsim.simulation.preparation import check_own_outputs, check_step
from railsim.studies import execute
from railsim.studies.case import Case, settings_fault
from railsim.studies.journal import JOURNAL, Journal, Records
from railsim.studies.outcome import Outcome
from railsim.studies.plan import Point, check_names
from railsim.studies.records import Record
from railsim.studies.spec import Execution, RunSpec, StudySpec, kept_quantities
from railsim.studies.summary import finished_record, read_index, waiting_record, write_index

_LOG = logging.getLogger(__name__)
FILES = (JOURNAL, "study.json", "summary.csv")
MANY = 10_000  # number of runs from which an index that is up to date is not written again
# errors after which no other run could be written either
NOTHING_MORE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ENOENT, errno.EFBIG)
DAMAGED = "`resume` computes it again and keeps this file beside it; or another `out`"
CHANGED = "`resume` computes what has changed, `overwrite` everything; or another `out`"

Load = Callable[[Sequence[Point]], list[Case]]


def carry_out_cases(cases: Sequence[Case], spec: StudySpec, folder: Path, **how: Any) -> Outcome:
    """Compute the missing runs of loaded cases, the longest first; `how`: fields of `Execution`."""
    runs = [RunSpec(case.vehicle.name, case.track.name, case.speed) for case in cases]
    points = [Point(c.name, run, c.labels, c.key) for c, run in zip(cases, runs, strict=True)]
    check_names(points)
    by_point = dict(zip(points, cases, strict=True))
    execution = Execution(longest_first=True, **how)
    return carry_out(points, lambda some: [by_point[p] for p in some], spec, folder, execution)


def carry_out(
    points: Sequence[Point], load: Load, spec: StudySpec, folder: Path, execution: Execution
) -> Outcome:
    """Compute the missing runs of a study.

    `load`: loads the inputs of some of the points. Raises InputError: an unknown quantity to keep;
    a folder of another study; as `State`.
    """
    inputs, keep = spec.as_data(), kept_quantities(spec.keep)
    further_files = list(execution.further_files)
    for point in points if execution.plots else ():
        further_files += f"{point.name}.png", comparison_picture(point.name, point.labels)
    check_folder(folder, (*FILES, *dict.fromkeys(further_files)), overwrite=True)
    remark = execution.on_remark or _LOG.warning
    with ExitStack() as stack:
        previous = None
        if is_file(folder / JOURNAL):
            previous = stack.enter_context(Journal(folder))
        if not (execution.resume or execution.overwrite):
            _refuse_another_study(folder, previous, inputs)
        if previous is None and not execution.overwrite:
            _refuse_files_of_others(folder, further_files)
        state = State(folder, points, load, spec, previous, execution)
        client = None if execution.scheduler is None else execute.cluster(execution.scheduler)
        make_folder(folder)
        sweep(folder)
        journal = previous or stack.enter_context(Journal(folder))
        if execution.overwrite:
            journal.clear()
        elif previous is None and journal.entries:
            raise argument_error("out", f"another study has begun in {folder}")
        journal.begin(inputs)
        unused = (f"{text} has no effect: the study varies its key" for text in spec.overruled)
        for text in (*unused, *state.settle(journal)):
            remark(text)
        jobs = _jobs(state, spec, keep, folder, execution)
        try:
            if jobs:
                with suppress(FileNotFoundError):  # it would be out of date
                    (folder / "study.json").unlink()
            for record in _compute(jobs, client, execution, remark):
                has_file = record["status"] != "failed" and record["file"]
                file = (folder / record["file"]).stat() if has_file else None
                journal.add(record, state.keys[record["name"]], file)
                if execution.on_record is not None:
                    execution.on_record(record)
                if record.get("errno") in NOTHING_MORE:
                    raise OSError(record["errno"], os.strerror(record["errno"]), str(folder))
        except BaseException:
            with suppress(OSError):  # the disk may be full
                write_index(folder, inputs, "interrupted", state.records(journal))
            raise
        whole = len(points) > MANY and _is_newer(folder / "study.json", journal.path)
        if jobs or state.existing or not whole:
            write_index(folder, inputs, "complete", state.records(journal))
        return Outcome(folder, state.records(journal), len(jobs))


def _jobs(
    state: "State", spec: StudySpec, keep: tuple[str, ...], folder: Path, execution: Execution
) -> list[execute.Job]:
    storage = Storage(compress=spec.compress, single=spec.single)
    jobs = []
    for case in state.cases:
        path = (folder / f"{case.name}.h5").resolve()
        picture = path.with_suffix(".png") if execution.plots and case.file_name else None
        record = state.to_be_analysed.get(case.name)
        jobs.append(execute.Job(case, path, picture, spec.quantities, keep, storage, record))
    if execution.longest_first:
        jobs.sort(key=lambda job: -job.case.track.length / job.case.speed)
    return jobs


def _compute(
    jobs: Sequence[execute.Job], client: Any, execution: Execution, remark: Callable[[str], None]
) -> Iterable[Record]:
    progress = execution.progress or (lambda _: None)
    if client is not None:
        execute.compile_on_cluster(client, remark)
        return execute.on_cluster(jobs, client, progress)
    workers = min(execution.workers or available_cores(), len(jobs))
    return (
        execute.in_processes(jobs, workers, progress)
        if workers > 1
        else execute.in_this_process(jobs, progress)
    )


def comparison_picture(name: str, labels: Mapping[str, str | float]) -> str:
    """Return the picture of a run beside those that differ in the vehicle only."""
    return f"compare_{name.removeprefix(str(labels['vehicle']) + '_')}.png"


def _refuse_another_study(
    folder: Path, previous: Journal | None, inputs: Mapping[str, object]
) -> None:
    stored = previous.inputs if previous else None
    if stored is None:
        try:
            stored = read_index(folder / "study.json").inputs.as_data()
        except InputError:
            return
    unread = ("folder", "name", "purpose")  # no number depends on them
    requested = {name: value for name, value in inputs.items() if name not in unread}
    differing = [name for name, value in requested.items() if stored.get(name, value) != value]
    if differing:
        found = f"{folder} holds a study with other " + ", ".join(differing)
        allowed = "`resume` continues with these inputs, `overwrite` computes everything; "
        raise argument_error("out", found, f"{allowed}or another `out`")


def _refuse_files_of_others(folder: Path, further_files: Sequence[str]) -> None:
    """Refuse files that a study, with `further_files`, would replace and that are of none."""
    index, names = folder / "study.json", ("summary.csv", *further_files)
    if is_file(index):
        try:
            read_index(index)
            return
        except InputError as error:
            name, found = index.name, f"is not the index of a study ({error.faults[0].found})"
    else:
        found = "is not of a study"
        name = next((file for file in names if os.path.lexists(folder / file)), "")
        if not name:
            return
    allowed = "choose another `out`, or give `overwrite`"
    raise argument_error("out", found, allowed, key=str(folder / name))


def _is_single(path: Path) -> bool:
    """Whether the numbers of a result file have 4 bytes (`Storage.single`)."""
    with h5py.File(path) as file:
        return any(getattr(dataset, "dtype", None) == np.float32 for dataset in file.values())


def _is_newer(path: Path, other: Path) -> bool:
    try:
        return path.stat().st_mtime_ns >= other.stat().st_mtime_ns
    except OSError:
        return False


class State:
    """Which runs of a study are done, and which are to be computed.

    `cases`: cases to compute; `keys`: keys of all points by their names; `existing`: results that
    exist but are not in the journal; `to_be_analysed`: of cases whose run exists, but not their
    analyses, what the journal knows of it, perhaps nothing. Raises InputError: all faults of the
    cases to compute; without `resume` also results that would have to be replaced.
    """

    def __init__(
        self,
        folder: Path,
        points: Sequence[Point],
        load: Load,
        spec: StudySpec,
        previous: Journal | None,
        execution: Execution,
    ) -> None:
        self._folder, self._points, self._spec = folder, points, spec
        anew = execution.overwrite
        self._entries = dict(previous.entries) if previous and not anew else {}
        self._files = {} if anew else _files(folder)
        self._damaged: dict[Path, str] = {}
        self._changed: list[str] = []
        self._reduced: list[str] = []
        self._damaged_lines = previous.damaged if previous else 0
        self.keys = {point.name: point.key for point in points}
        self.existing: list[tuple[Point, Record]] = []
        self.to_be_analysed: dict[str, Record] = {}
        waiting = [point for point in points if not self._is_done(point)]
        self._waiting = dict(zip(waiting, load(waiting), strict=True))
        faults = [fault for one in self._waiting.items() for fault in self._faults_of(*one)]
        if faults and not execution.resume:
            raise InputError(faults)
        found = {point for point, _ in self.existing}
        self.cases = [case for point, case in self._waiting.items() if point not in found]
        inputs = ((case.vehicle, case.track, case.settings) for case in self.cases)
        check_laws(law for each in inputs for one in each for law in (one.laws or {}).items())
        if not (execution.resume or execution.trying):
            runs = {point.name: point.run for point in waiting}
            _check_settings([c for c in self.cases if c.file_name], runs, spec.varied_keys)

    def _is_done(self, point: Point) -> bool:
        """Whether the journal has the result of these inputs, and its file has not changed."""
        entry = self._entries.get(point.name)
        if entry is None or not entry.is_done or not point.key:
            return False
        if not entry.size and self._spec.keep != "summary" and point.has_run:
            return False  # only the summary was kept, the file is required
        return entry.key == point.key and entry.is_of(self._files.get(f"{point.name}.h5"))

    def _faults_of(self, point: Point, case: Case) -> list[Fault]:
        """Accept an existing result of a case, or say why it cannot be used; also a summary."""
        path = self._folder / case.file_name
        if case.file_name not in self._files:
            entry = self._entries.get(case.name)
            if entry is None or not entry.is_done or entry.size or entry.key == point.key:
                return []
            self._changed.append(case.name)
            return [argument_fault("out", case.name, "a summary of other inputs", CHANGED)]
        try:
            result = open_result(path)
            if result.attributes.get("inputs_hash") == case.key:
                record = self._journal_record(case)
                if self._lacks(case, result, record):
                    self._reduced.append(case.name)
                    found = "a result without all quantities or digits of this study"
                    return [argument_fault("out", str(path), found, CHANGED)]
                if case.analyses or self._spec.quantities:  # takes time: done as a job like others
                    self.to_be_analysed[case.name] = record
                else:
                    self.existing.append((point, finished_record(case, result, None, record)))
                return []
        except InputError as error:
            self._damaged[path] = str(error.faults[0])
            return [replace(f, allowed=DAMAGED, option=f.file) for f in error.faults]
        self._changed.append(case.name)
        return [argument_fault("out", str(path), "a result of other inputs", CHANGED)]

    def _journal_record(self, case: Case) -> Record:
        """Return what the journal knows of a run whose file is there; empty: nothing."""
        entry = self._entries.get(case.name)
        if entry is None or not (entry.is_done and entry.is_of(self._files[case.file_name])):
            return {}
        record = Records(self._folder / JOURNAL, [entry])[0]
        return record if record["inputs_hash"] == case.key else {}

    def _lacks(self, case: Case, result: Result, record: Record) -> bool:
        """Whether a file lacks what is to be kept, or what a summary needs that is not known.

        That is quantities, or digits.
        """
        if not (self._spec.single and record) and _is_single(self._folder / case.file_name):
            return True
        outputs = case.settings.outputs
        recorded = {n for n in QUANTITIES if matches(n, outputs.quantities or ("*",))}
        recorded |= {q.name for q in extra_quantities(outputs, case.track)} - {"element_command"}
        required = [*kept_quantities(self._spec.keep), *(() if record else OF_FACTS)]
        return any(name not in result for name in recorded if matches(name, required))

    def settle(self, journal: Journal) -> list[str]:
        """Record existing results, rename damaged files; return remarks for the user."""
        remarks = []
        if self._damaged_lines:
            remarks.append(f"{self._damaged_lines} damaged lines of {JOURNAL} are ignored")
        for point, record in self.existing:
            journal.add(record, point.key, self._files[record["file"]])
        for path, words in self._damaged.items():
            old = _move_aside(path)
            remarks.append(f"{words}: it is computed again; the old file is kept as {old.name}")
        gone = [case.name for case in self.cases if case.file_name not in self._files]
        lost = [name for name in gone if name in self._entries and self._entries[name].size]
        endings = "of other inputs", "without all quantities or digits", "no longer there"
        for names, words in zip((self._changed, self._reduced, lost), endings, strict=True):
            if names:
                number = "1 result is" if len(names) == 1 else f"{len(names)} results are"
                remarks.append(f"{number} {words} and computed again: {listed(names)}")
        return remarks

    def records(self, journal: Journal) -> Records:
        """Return the records of all runs, done or waiting, in the order of the combinations."""
        waiting = {point.name: case for point, case in self._waiting.items()}
        names = [point.name for point in self._points]
        entries = [journal.entries.get(name) or waiting_record(waiting[name]) for name in names]
        return Records(journal.path, entries)


def _check_settings(
    cases: Sequence[Case], runs: Mapping[str, RunSpec], grid: Collection[str]
) -> None:
    """Raise InputError: a given step that is too long for a vehicle at its highest speed.

    Or quantities of one's own of what it does not output. Other runs with that step may fail, but
    few do: whether it is stable takes a second to find out.
    """
    longest: dict[tuple[object, ...], Case] = {}
    for case in cases:
        own = str(case.settings.outputs.own or "")
        if own or case.settings.step is not None:
            key = (case.labels.get("vehicle"), case.settings.scheme, own, case.settings.step or 0.0)
            if key not in longest or case.speed > longest[key].speed:
                longest[key] = case
    faults, stable = Faults(), set[tuple[object, ...]]()
    for (*kind, _), case in sorted(longest.items(), key=lambda it: -(it[1].settings.step or 0.0)):
        if tuple(kind) in stable:
            continue  # with a longer step

        def add_run_name(fault: Fault, name: str = case.name) -> Fault:
            return replace(settings_fault(fault, runs[name], grid), found=f"{fault.found}, {name}")

        inputs = case.vehicle, case.track, case.settings
        with faults.caught(add_run_name), suppress(ModelError):  # the outcome of the run
            if case.settings.outputs.own:
                check_own_outputs(*inputs)
            if case.settings.step is not None:
                check_step(*inputs, case.speed)
            stable.add(tuple(kind))
    faults.check()


def _move_aside(path: Path) -> Path:
    """Give a damaged file another name that is free, and return it."""
    endings = chain([""], (f"-{number}" for number in count(2)))
    names = (path.with_name(f"{path.name}.damaged{ending}") for ending in endings)
    return path.rename(next(name for name in names if not os.path.lexists(name)))


def _files(folder: Path) -> dict[str, os.stat_result]:
    """Return the result files of a folder; fast enough for a hundred thousand."""
    try:
        with os.scandir(folder) as entries:
            return {entry.name: entry.stat() for entry in entries if entry.name.endswith(".h5")}
    except OSError:  # missing, or not a folder
        return {}
