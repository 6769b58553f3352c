"""Runs from result files and from folders of studies, for commands that take either."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from railsim.description import Description
from railsim.description.values import short
from railsim.errors import Fault, Faults, input_error
from railsim.files.access import folder_of
from railsim.result import Result, open_run
from railsim.result.extremes import run_facts
from railsim.studies.journal import JOURNAL, Journal, Records
from railsim.studies.outcome import Outcome
from railsim.studies.records import Record
from railsim.studies.summary import read_index
from railsim.table import Table

ALLOWED = "the folder of a study, or one with .h5 files"


@dataclass
class Gathered:
    """Runs by their names."""

    records: list[Record] = field(default_factory=list)  # one for each run, as in a journal
    paths: dict[str, Path] = field(default_factory=dict)  # result files of runs that have one
    remarks: list[str] = field(default_factory=list)  # what was not found as the records say
    inputs: dict[str, Any] = field(default_factory=dict)  # of the study, if they are of one

    def results(self, names: Sequence[str]) -> dict[str, Result]:
        """Open the results of some runs; runs without a file are left out."""
        return {name: open_run(self.paths[name]) for name in names if name in self.paths}


def open_results(paths: Sequence[Path]) -> dict[str, Result]:
    """Open results under the shortest names that tell them apart.

    Raises InputError: everything that cannot be read, or is given twice.
    """
    faults, results = Faults(), dict[str, Result]()
    stems, places = [path.stem for path in paths], set[Path]()
    for path in paths:
        label = path.stem if stems.count(path.stem) == 1 else str(path)
        with faults.caught():
            result = open_run(path)
            if (place := path.resolve()) in places:
                faults.append(Fault(str(path), "", "given twice", "give each result once"))
                continue
            places.add(place)
            results[label] = result
    faults.check()
    return results


def runs_without_file(folder: Path) -> list[str]:
    """Return the runs of a study without a result file: failed, waiting, or its file not kept.

    Of a study that was killed, which has a journal only, those that had ended.

    Raises InputError: its ``study.json`` cannot be read, or it is running. OSError: its journal
    cannot be opened.
    """
    if not any((folder / name).is_file() for name in ("study.json", JOURNAL)):
        return []
    runs = ((run, folder / run["file"]) for run in _of_folder(folder)[0])
    return [f"{run['name']} ({run['status']})" for run, file in runs if not file.is_file()]


def gather(files: Sequence[str]) -> Gathered:
    """Return the runs of result files and of folders.

    A folder is that of a study, or all results in it; so is a file with the table of a study.

    Raises InputError: everything that cannot be read.
    """
    gathered, faults = Gathered(), Faults()
    batches: list[tuple[Path, list[Record]]] = []
    for file in files:
        path = folder_of(file)
        with faults.caught():
            records, inputs = _of_folder(path) if os.path.isdir(path) else ([_of_file(path)], {})
            if not records:
                faults.append(Fault(file, "", "no results in this folder", ALLOWED))
            gathered.inputs = inputs if len(files) == 1 else {}
            batches.append((path if os.path.isdir(path) else path.parent, records))
    runs = [(folder, record["name"]) for folder, records in batches for record in records]
    places = Counter((folder / name).resolve() for folder, name in runs)
    twice = (place for place, number in places.items() if number > 1)
    faults += [Fault(str(one), "", "given twice", "give each result once") for one in twice]
    faults.check()
    names = Counter(name for _, name in runs)
    alike = [name for name, number in names.items() if number > 1]
    folders = Counter(folder.name for folder in {folder.resolve() for folder, _ in runs})
    for folder, records in batches:
        before = folder.resolve().name
        before = before if folders[before] == 1 else str(folder)
        _add(gathered, records, folder, {name: f"{before}/{name}" for name in alike})
    return gathered


def open_study(folder: str | Path) -> Outcome:
    """Open the folder of a study that has ended or was interrupted, or any folder of results.

    Raises InputError: it holds no results, or cannot be read.

    >>> import railsim
    >>> railsim.open_study("curves").plot("Y_over_Q_abs")  # doctest: +SKIP
    """
    place = Path(folder)
    records = _of_folder(place)[0]
    if not records:
        raise input_error(str(folder), "no results in this folder", ALLOWED)
    return Outcome(place, Records(place / JOURNAL, records), 0)


def described_runs(file: str) -> Description:
    """Return the runs of a study or of a folder: how they ended, and what tells them apart."""
    found = gather([file])
    statuses = Counter(str(record["status"]) for record in found.records)
    ended = ", ".join(f"{number} {status}" for status, number in statuses.items())
    keys = dict.fromkeys(key for record in found.records for key in record["labels"])
    rows = [{"run": r["name"], **r["labels"], "status": r["status"]} for r in found.records]
    shown = ({key: short(value) for key, value in row.items()} for row in rows)
    table = Table(["run", *keys, "status"], shown)
    title = f"{folder_of(file)}: {len(rows)} run{'s' * (len(rows) != 1)}, {ended}"
    data = {"kind": "runs", "folder": str(folder_of(file)), "status": statuses, "runs": rows}
    return Description(data, [title, "", table, *found.remarks])


def _add(
    gathered: Gathered, records: Sequence[Record], folder: Path, new_names: Mapping[str, str]
) -> None:
    """Add records; `new_names`: names of those that would not be told apart from others."""
    missing = 0
    for record in records:
        name = new_names.get(record["name"], record["name"])
        gathered.records.append({**record, "name": name})
        if record["status"] in ("failed", "waiting"):
            continue
        if record.get("file") and (folder / record["file"]).is_file():
            gathered.paths[name] = folder / record["file"]
        elif "peaks" in record:  # an analysis alone has no file
            missing += 1
    if missing:
        gathered.remarks.append(
            f"{missing} of {len(records)} runs in {folder} have no result file "
            "(`--keep summary`, or removed): only their summary can be shown."
        )


def _of_folder(folder: Path) -> tuple[list[Record], dict[str, Any]]:
    """Records of the runs of a folder, and the inputs of their study."""
    if (folder / "study.json").is_file():
        index = read_index(folder / "study.json")
        return [{"labels": {}, **run.model_dump()} for run in index.runs], index.inputs.model_dump()
    if (folder / JOURNAL).is_file():
        with Journal(folder) as journal:
            return list(Records(journal.path, list(journal.entries.values()))), {}
    return [_of_file(path) for path in sorted(folder.glob("*.h5"))], {}


def _of_file(path: Path) -> Record:
    result = open_run(path)
    labels = {"vehicle": result.vehicle().name, "track": result.track().name, "speed": result.speed}
    return {"name": path.stem, "file": path.name, "labels": labels, **run_facts(result)}
