"""Summary of a study: ``summary.csv`` and ``study.json``.

``study.json`` holds the inputs of the study and a record of every run with its peaks and mid-curve
values; ``summary.csv`` holds one line per run for spreadsheets.  All numbers are SI.  Both are
written from the journal (`railsim.studies.journal`) when the study ends or is interrupted.
"""

import csv
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from railsim.definitions.analyses import unit_of_number
from railsim.errors import Fault, InputError
from railsim.files import is_file, read_text, whole_file
from railsim.notation import QUANTITIES
from railsim.result import Result
from railsim.result.facts import FACTS, run_facts
from railsim.studies.analyses import analysed
from railsim.studies.case import Case
from railsim.studies.journal import JOURNAL, Record, Records
from railsim.studies.own import own_quantities
from railsim.studies.points import MOST_RUNS
from railsim.text import spreadsheet_cell

M = TypeVar("M", bound=BaseModel)
INDEX_BYTES = 500_000_000
MOST_VALUES = 30_000_000  # of an index: 150 for each run of the largest study
MOST_INPUTS = 10 * MOST_RUNS
MOST_FAULTS = 20
UNITS = {"speed": "m/s", "step": "s", "wall_time": "s", "cpu_time": "s"}
_COLUMN = re.compile(r"(\w+?)_(?:peak|max|min|mid\d*|median\d*)(?:_(time|distance|20hz))?")
FORMAT = "railsim-study-result/1"


def waiting_record(case: Case) -> Record:
    """Return the record of a run that has not been done yet."""
    return {
        "name": case.name,
        "file": case.file_name,
        "labels": dict(case.labels),
        "inputs_hash": case.key,
        "status": "waiting",
        "status_reason": "",
    }


def finished_record(case: Case, result: Result, own: str | None = None) -> Record:
    """Return the record of a run with a result, with user-defined quantities and analyses.

    Raises
    ------
    RailsimError : one of these fails.
    """
    found = own_quantities(own, result) | analysed(case, result)
    facts = {**waiting_record(case), **run_facts(result, case.track)}
    return {**facts, "quantities": found} if own or case.analyses else facts


def analysed_record(case: Case, quantities: Mapping[str, float], cpu_time: float) -> Record:
    """Return the record of a point without a run in the time domain."""
    facts = {"status": "complete", "cpu_time": cpu_time, "quantities": dict(quantities)}
    return {**waiting_record(case), **facts}


def stopped_record(case: Case, reason: str) -> Record:
    """Return the record of a point without a solution; it is not computed again."""
    return {**waiting_record(case), "status": "stopped", "status_reason": reason}


def failed_record(case: Case, reason: str, traceback: str = "", *, errno: int = 0) -> Record:
    """Return the record of a run without a result; `errno` is that of the system, if any."""
    return {
        **waiting_record(case),
        "status": "failed",
        "status_reason": reason,
        "traceback": traceback,
        **({"errno": errno} if errno else {}),
    }


def write_index(folder: Path, inputs: Mapping[str, Any], status: str, records: Records) -> None:
    """Write ``study.json`` and ``summary.csv``, each under its name when it is complete."""
    head = json.dumps({"format": FORMAT, "status": status, "inputs": dict(inputs)}, indent=1)
    with whole_file(folder / "study.json") as partial, open(partial, "wb") as file:
        file.write(head[:-2].encode() + b',\n "runs": [\n')
        for number, text in enumerate(records.texts()):
            file.write((b",\n" if number else b"") + text)
        file.write(b"\n]}\n")
    with (
        whole_file(folder / "summary.csv") as partial,
        open(partial, "w", encoding="utf-8", newline="") as stream,
    ):
        write_summary(records, stream)


class Inputs(BaseModel):
    """Inputs of a study, as stored in its journal and its index."""

    model_config = ConfigDict(extra="ignore")

    railsim_version: str = ""
    folder: str = "."
    scenario: str | None = None
    vehicles: list[str]
    tracks: list[str]
    speeds: list[float | str | None]
    grid: dict[str, list[str]] = {}
    linked: list[dict[str, list[str]]] = []
    sample: dict[str, Any] | None = None
    quantities: str | None = None
    analyses: dict[str, dict[str, Any]] = {}
    keep: str = "all"
    compress: bool = False
    single: bool = False
    settings: str | None = None
    start: float = 0.0
    duration: float | None = None
    until: float | None = None
    assignments: list[str] = []


class Run(BaseModel):
    """Required entries of every run in the index of a study."""

    model_config = ConfigDict(extra="allow")

    name: str
    file: str
    status: str


class Index(BaseModel):
    """Required content of a ``study.json``."""

    model_config = ConfigDict(extra="ignore")

    status: str
    inputs: Inputs
    runs: list[Run]


def read_index(path: Path) -> Index:
    """Return the content of a ``study.json``.

    Raises
    ------
    InputError : the file cannot be read, or is not the index of a study.
    """
    text = read_text(path, INDEX_BYTES)
    # each takes some hundred bytes of memory when it is read
    if max(text.count(","), 5 * text.count("{"), 5 * text.count("[")) > MOST_VALUES:
        raise InputError([Fault(str(path), "", "too many values", f"{MOST_VALUES} at most")])
    try:
        index: Any = json.loads(text)
    except json.JSONDecodeError as error:
        fault = Fault(str(path), f"line {error.lineno}", f"broken JSON: {error.msg}", "")
        raise InputError([fault]) from None
    except (ValueError, RecursionError) as error:
        raise InputError([Fault(str(path), "", f"broken JSON: {error}", "")]) from None
    found = index.get("format") if isinstance(index, dict) else None
    if found != FORMAT:
        shown = repr(found)[:60]
        raise InputError([Fault(str(path), "format", shown, f"allowed: {FORMAT}")])
    if isinstance(index.get("runs"), list) and len(index["runs"]) > MOST_RUNS:
        raise InputError([Fault(str(path), "runs", "too many", f"{MOST_RUNS} at most")])
    refuse_too_many(index.get("inputs"), str(path))
    return checked(Index, index, str(path))


def refuse_too_many(inputs: Any, file: str) -> None:
    """Refuse stored inputs with more values than a study can have: each may become a fault.

    Raises
    ------
    InputError : there are more.
    """
    nodes, number = [inputs], 0
    while nodes and number <= MOST_INPUTS:
        node = nodes.pop()
        if isinstance(node, dict | list):
            number += len(node)
            nodes += node.values() if isinstance(node, dict) else node
    if number > MOST_INPUTS:
        raise InputError([Fault(file, "inputs", "too many values", f"{MOST_INPUTS} at most")])


def checked(model: type[M], data: Any, file: str) -> M:
    """Return data as a model.

    Raises
    ------
    InputError : all faults of the data.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        details = error.errors(include_url=False)[:MOST_FAULTS]
        raise InputError(
            Fault(
                file,
                ".".join(map(str, detail["loc"])),
                repr(detail["input"])[:60],
                detail["msg"].lower(),
            )
            for detail in details
        ) from None


def check_index(path: Path) -> Index:
    """Return the content of a ``study.json``; every finished run must have its result.

    Raises
    ------
    InputError : as `read_index`, or results are missing.
    """
    index = read_index(path)
    allowed = "the same study with --resume computes it again"
    faults = []
    for run in index.runs:
        if run.status in ("waiting", "failed") or not run.file:
            continue
        if Path(run.file).name != run.file:
            faults.append(Fault(str(path), run.file[:60], "is not in the folder of the study", ""))
        elif not is_file(path.parent / run.file):
            faults.append(Fault(str(path), run.file, "the result is missing", allowed))
    if faults:
        raise InputError(faults)
    return index


def write_summary(records: Sequence[Record], stream: TextIO) -> None:
    """Write one line per run: labels, status, peaks and mid-curve values.

    The header includes units: ``Q_peak (N)``.  The columns of a quantity are
    ``Q_peak`` (or ``dQ_over_Q0_max`` and ``_min``), the same with ``_wheelset``, ``_side``,
    ``_time`` and ``_distance``, and ``Q_mid``, the largest magnitude at the middle of the first
    curve (``Q_mid2`` of the second).  The column ``remarks`` holds all remarks on the run.
    """
    # reads the records twice, to save memory
    columns = list(dict.fromkeys(name for record in records for name in _checked_row(record)))
    writer = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
    units = {name: unit_of(name) for name in columns}
    writer.writerow({name: f"{name} ({unit})" if unit else name for name, unit in units.items()})
    for record in records:
        cells = _checked_row(record)
        writer.writerow({name: spreadsheet_cell(cell) for name, cell in cells.items()})


def _checked_row(record: Record) -> dict[str, Any]:
    try:
        return summary_row(record)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        found = f"the record of '{record['name']}' cannot be used ({error!r})"
        allowed = "remove the journal: existing results are kept"
        raise InputError([Fault(JOURNAL, "", found, allowed)]) from None


def unit_of(column: str) -> str:
    """Return the unit of a column of the summary, empty if it has none.

    Examples
    --------
    >>> [unit_of(name) for name in ("Q_peak", "Q_peak_time", "wheelset_yaw_mid2", "Q_peak_side")]
    ['N', 's', 'rad', '']
    """
    if column in UNITS:
        return UNITS[column]
    if unit := unit_of_number(column):
        return unit
    found = _COLUMN.fullmatch(column)
    if not found or found[1] not in QUANTITIES:
        return ""
    unit = {"time": "s", "distance": "m"}.get(found[2] or "", QUANTITIES[found[1]].unit)
    return "" if unit == "1" else unit


def summary_row(record: Record) -> dict[str, Any]:
    """Return the cells of the line of a run by the names of their columns, without units."""
    row = {"name": record["name"], **record["labels"], "file": record["file"]}
    row |= {name: record.get(name, "") for name in FACTS}
    row["remarks"] = " ".join(record.get("remarks", ()))
    endings = {"abs": "peak", "max": "max", "min": "min"}
    for peak in record.get("peaks", ()):
        column = f"{peak['quantity']}_{endings[peak['kind']]}"
        row[column] = peak["value"]
        if "low_pass_20_hz" in peak:
            row[f"{column}_20hz"] = peak["low_pass_20_hz"]
        for fact in ("wheelset", "side", "time", "distance"):
            if fact in peak:
                row[f"{column}_{fact}"] = peak[fact]
    for number, curve in enumerate(record.get("mid_curves", ()), start=1):
        ending = "mid" if number == 1 else f"mid{number}"
        for name, value in curve["largest"].items():
            row[f"{name}_{ending}"] = value
        for name, value in curve.get("largest_medians", {}).items():
            row[f"{name}_{ending.replace('mid', 'median')}"] = value
    return {**row, **record.get("quantities", {})}
