"""`carry_out`: computes the missing runs of a study or a campaign, with the journal."""

import errno
import logging
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from railsim.errors import InputError, argument_error
from railsim.files.access import is_file, make_folder, sweep
from railsim.processes import available_cores
from railsim.studies.execute import (
    Batch,
    Job,
    batches,
    cluster,
    compile_on_cluster,
    in_processes,
    in_this_process,
    on_cluster,
)
from railsim.studies.journal import JOURNAL, Journal
from railsim.studies.outcome import Outcome
from railsim.studies.records import Record
from railsim.studies.retention import retention
from railsim.studies.spec import Execution, StudySpec
from railsim.studies.state import Runs, State
from railsim.studies.summary import read_index, write_index

_LOG = logging.getLogger(__name__)
MANY = 10_000  # number of runs from which an index that is up to date is not written again
# errors after which no other run could be written either
NOTHING_MORE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.ENOENT, errno.EFBIG)


def carry_out(plan: Runs, spec: StudySpec, folder: Path, execution: Execution) -> Outcome:
    """Compute the missing runs of a study or a campaign, with the journal of its folder."""
    inputs = spec.stored()
    with ExitStack() as stack:
        known = None
        if is_file(folder / JOURNAL):
            known = stack.enter_context(Journal(folder))
        if not (execution.resume or execution.overwrite):
            _refuse_another_study(folder, known, inputs)
        if known is None and not execution.overwrite:
            _refuse_files_of_others(folder)
        state = State(folder, plan, spec, known, execution)
        client = None if execution.scheduler is None else cluster(execution.scheduler)
        make_folder(folder)
        sweep(folder)
        journal = known or stack.enter_context(Journal(folder))
        if execution.overwrite:
            journal.clear()
        elif known is None and journal.entries:
            found = f"another study has begun in {folder}"
            raise argument_error("out", found)
        journal.begin(inputs)
        for text in state.settle(journal):
            (execution.on_remark or _LOG.warning)(text)
        jobs = _jobs(state, spec, folder, execution)
        status = "interrupted"
        try:
            if jobs:
                with suppress(FileNotFoundError):  # it would be out of date
                    (folder / "study.json").unlink()
            for record in _computed(jobs, client, execution):
                _add(journal, state.keys[record["name"]], record)
                if execution.on_record is not None:
                    execution.on_record(record)
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


def _jobs(state: State, spec: StudySpec, folder: Path, execution: Execution) -> list[Job]:
    jobs = []
    for case in state.cases:
        path = (folder / f"{case.name}.h5").resolve()
        picture = path.with_suffix(".png") if execution.plots and case.file_name else None
        exists = case.name in state.to_be_analysed
        jobs.append(Job(case, path, picture, spec.quantities, retention(spec), exists))
    if execution.longest_first:
        jobs.sort(key=lambda job: -job.case.track.length / job.case.speed)
    return jobs


def _add(journal: Journal, key: str, record: Record) -> None:
    has_file = record["status"] != "failed" and record["file"]
    file = (journal.path.parent / record["file"]).stat() if has_file else None
    journal.add(record, key, file)


def _computed(jobs: Sequence[Job], client: Any, execution: Execution) -> Iterable[Record]:
    progress = execution.progress or (lambda _: None)
    if client is not None:
        threads = sum(client.nthreads().values())
        compile_on_cluster(client, execution.on_remark or _LOG.warning)
        return on_cluster(batches(jobs, execution.together, max(1, threads)), client, progress)
    count = execution.workers or available_cores()
    work: Sequence[Batch] = batches(jobs, execution.together, count)
    count = min(count, len(work))
    return in_processes(work, count, progress) if count > 1 else in_this_process(work, progress)


def _refuse_another_study(
    folder: Path, known: Journal | None, inputs: Mapping[str, object]
) -> None:
    there = known.inputs if known else None
    if there is None:
        try:
            there = read_index(folder / "study.json").inputs.stored()
        except InputError:
            return
    unread = ("folder", "name", "purpose")  # no number depends on them
    asked = {name: value for name, value in inputs.items() if name not in unread}
    differing = [name for name, value in asked.items() if there.get(name, value) != value]
    if differing:
        found = f"{folder} holds a study with other " + ", ".join(differing)
        allowed = "`resume` continues with these inputs, `overwrite` computes everything; "
        raise argument_error("out", found, f"{allowed}or another `out`")


def _refuse_files_of_others(folder: Path) -> None:
    """Refuse files that a study would replace and that are of none."""
    index, table = folder / "study.json", folder / "summary.csv"
    if is_file(index):
        try:
            read_index(index)
            return
        except InputError as error:
            name, found = index.name, f"is not the index of a study ({error.faults[0].found})"
    elif is_file(table):
        name, found = table.name, "is not of a study"
    else:
        return
    allowed = "choose another `out`, or give `overwrite`"
    raise argument_error("out", found, allowed, key=str(folder / name))


def _is_newer(one: Path, other: Path) -> bool:
    try:
        return one.stat().st_mtime_ns >= other.stat().st_mtime_ns
    except OSError:
        return False
