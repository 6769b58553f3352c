"""`State`: which runs of a study are done, from journal and files, and which to compute."""

import os
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Protocol

from railsim.errors import Fault, InputError, argument_fault
from railsim.laws.permission import check_laws
from railsim.result import open_result
from railsim.studies.case import Case
from railsim.studies.journal import JOURNAL, Journal, Records
from railsim.studies.points import Point
from railsim.studies.records import Record
from railsim.studies.retention import SUMMARY
from railsim.studies.spec import Execution, StudySpec
from railsim.studies.summary import finished_record, waiting_record

DAMAGED = "`resume` computes it again and keeps this file beside it; or another `out`"
CHANGED = "`resume` computes what has changed, `overwrite` everything; or another `out`"


class Runs(Protocol):
    """Points of a study, such as `Plan`.

    `points`: inputs of each run.
    """

    points: list[Point]

    def cases(self, points: Sequence[Point]) -> list[Case]:
        """Load the inputs of the runs of some points."""


class State:
    """Which runs of a study are done, and which are to be computed.

    `cases`: cases to compute; `keys`: keys of all points by their names; `found`: existing results
    that are not in the journal; `to_be_analysed`: names of the cases whose run exists, but not
    their analyses. Raises InputError: all faults of the cases to compute; without `resume` also
    results that would have to be replaced.
    """

    def __init__(
        self, folder: Path, plan: Runs, spec: StudySpec, known: Journal | None, execution: Execution
    ) -> None:
        self._folder, self._points = folder, plan.points
        self._function, self._without_files = spec.quantities, spec.keep == SUMMARY
        anew = execution.overwrite
        self._entries = dict(known.entries) if known and not anew else {}
        self._files = {} if anew else _files(folder)
        self._damaged: dict[Path, str] = {}
        self._changed: list[str] = []
        self._damaged_lines = known.damaged if known else 0
        self.keys = {point.name: point.key for point in plan.points}
        self.found: list[tuple[Point, Record]] = []
        self.to_be_analysed: set[str] = set()
        points = [point for point in plan.points if not self._is_done(point)]
        self._waiting = dict(zip(points, plan.cases(points), strict=True))
        faults = [
            fault for point, case in self._waiting.items() for fault in self._faults_of(point, case)
        ]
        if faults and not execution.resume:
            raise InputError(faults)
        found = {point for point, _ in self.found}
        self.cases = [case for point, case in self._waiting.items() if point not in found]
        check_laws(
            law
            for case in self.cases
            for definition in (case.vehicle, case.track, case.settings)
            for law in (definition.laws or {}).items()
        )

    def _is_done(self, point: Point) -> bool:
        """Whether the journal has the result of these inputs, and its file has not changed."""
        entry = self._entries.get(point.name)
        if entry is None or not entry.is_done or not point.key:
            return False
        if not entry.size and not self._without_files and point.has_run:
            return False  # only the summary was kept, the file is required
        return entry.key == point.key and entry.is_of(self._files.get(f"{point.name}.h5"))

    def _faults_of(self, point: Point, case: Case) -> list[Fault]:
        """Examine the existing data of a case: a file, or a summary without a file."""
        if case.file_name in self._files:
            return self._look_at(point, case)
        entry = self._entries.get(case.name)
        if entry is None or not entry.is_done or entry.size or entry.key == point.key:
            return []
        self._changed.append(case.name)
        return [argument_fault("out", case.name, "a summary of other inputs", CHANGED)]

    def _look_at(self, point: Point, case: Case) -> list[Fault]:
        """Accept an existing result, or record why it cannot be used."""
        path = self._folder / case.file_name
        try:
            result = open_result(path)
            if result.attributes.get("inputs_hash") == case.key:
                if case.analyses:  # takes time: done as a job like others
                    self.to_be_analysed.add(case.name)
                else:
                    self.found.append((point, finished_record(case, result, self._function)))
                return []
        except InputError as error:
            self._damaged[path] = str(error.faults[0])
            return [replace(f, allowed=DAMAGED, option=f.file) for f in error.faults]
        self._changed.append(case.name)
        return [argument_fault("out", str(path), "a result of other inputs", CHANGED)]

    def settle(self, journal: Journal) -> list[str]:
        """Record existing results, rename damaged files; return remarks for the user."""
        remarks = []
        if self._damaged_lines:
            remarks.append(f"{self._damaged_lines} damaged lines of {JOURNAL} are ignored")
        for point, record in self.found:
            journal.add(record, point.key, self._files[record["file"]])
        for path, words in self._damaged.items():
            old = _moved_aside(path)
            remarks.append(f"{words}: it is computed again; the old file is kept as {old.name}")
        lost = [
            case.name
            for case in self.cases
            if self._entries.get(case.name)
            and case.file_name not in self._files
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
                for point in self._points
            ],
        )


def _moved_aside(path: Path) -> Path:
    """Give a damaged file another name that is free, and return it."""
    endings = chain([""], (f"-{number}" for number in count(2)))
    names = (path.with_name(f"{path.name}.damaged{ending}") for ending in endings)
    free = next(name for name in names if not os.path.lexists(name))
    return path.rename(free)


def _files(folder: Path) -> dict[str, os.stat_result]:
    """Return the result files of a folder; fast enough for a hundred thousand."""
    try:
        with os.scandir(folder) as entries:
            return {entry.name: entry.stat() for entry in entries if entry.name.endswith(".h5")}
    except OSError:  # missing, or not a folder
        return {}


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more
