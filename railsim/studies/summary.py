"""Summary of a study: ``summary.csv`` and ``study.json``.

``study.json`` holds the inputs of the study and a record of every run with its peaks and mid-curve
values; ``summary.csv`` holds one line per run for spreadsheets.  All numbers are SI.  Both are
written from the journal (`railsim.studies.journal`) when the study ends or is interrupted.
"""

import json
import re
import tempfile
import traceback
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO, Literal

from pydantic import BaseModel, ConfigDict, Field

from railsim.definitions.study.analyses import unit_of_number
from railsim.errors import Fault, Faults, RailsimError, input_error, message_of
from railsim.files.access import is_file, read_text, whole_file
from railsim.notation import QUANTITIES
from railsim.result import Result
from railsim.result.extremes import FACTS, run_facts
from railsim.studies.analyses import numbers_and_remarks
from railsim.studies.journal import JOURNAL, NOT_DONE, Records
from railsim.studies.records import Record, json_bytes, parse_json
from railsim.studies.spec import MOST_RUNS, StudySpec, validated
from railsim.studies.user_function import user_quantities
from railsim.text import spreadsheet_cell
from railsim.units import number_with_unit

if TYPE_CHECKING:  # whose module brings the compiler along, which readers of a summary do without
    from railsim.studies.case import Case

Row = dict[str, Any]  # cells by the names of their columns, without units
INDEX_BYTES = 500_000_000
BUFFER = 1 << 20  # bytes
MOST_VALUES = 30_000_000  # of an index: 150 for each run of the largest study
MOST_INPUTS = 10 * MOST_RUNS
UNITS = {"speed": "m/s", "step": "s", "wall_time": "s", "cpu_time": "s"}
_NO_NUMBER = re.compile(rb'("[^"\\]*(?:\\.[^"\\]*)*"|null)')  # in a list of JSON
_COLUMN = re.compile(r"(\w+?)_(?:peak|max|min|mid\d*|median\d*)(?:_(time|distance|20hz))?")
FORMAT = "railsim-study-result/1"


def waiting_record(case: "Case") -> Record:
    """Return the record of a run that has not been done yet."""
    about = {"name": case.name, "file": case.file_name, "labels": dict(case.labels)}
    return {**about, "inputs_hash": case.key, "status": "waiting", "status_reason": ""}


def finished_record(
    case: "Case", result: Result, function: str | None = None, prior: Record | None = None
) -> Record:
    """Return the record of a run with its own quantities and analyses; RailsimError: one fails.

    `prior`: an earlier record of the run, from all its quantities; the result may be reduced.
    """
    numbers, remarks = numbers_and_remarks(case, result)
    facts = {**waiting_record(case), **run_facts(result, case.track)}
    facts |= {name: prior[name] for name in ("peaks", "mid_curves") if prior and name in prior}
    facts["remarks"] = [*facts["remarks"], *remarks]
    quantities = user_quantities(function, result) | numbers
    return {**facts, "quantities": quantities} if function or case.analyses else facts


def failed_record(case: "Case", error: Exception | str) -> Record:
    """Return the record of a run without a result, with what the system refused, if anything."""
    facts: Record = {"status": "failed", "status_reason": str(error), "traceback": ""}
    if isinstance(error, OSError | MemoryError):
        facts["status_reason"] = message_of(error)
        if errno := getattr(error, "errno", None):
            facts["errno"] = errno
    elif isinstance(error, Exception) and not isinstance(error, RailsimError):
        facts["status_reason"] = f"{type(error).__name__}: {error}"
        facts["traceback"] = "".join(traceback.format_exception(error))
    return waiting_record(case) | facts


def write_index(folder: Path, inputs: Mapping[str, Any], status: str, records: Records) -> None:
    """Write ``study.json`` and ``summary.csv``, each under its name when it is complete."""
    head = json.dumps({"format": FORMAT, "status": status, "inputs": dict(inputs)}, indent=1)
    with (
        whole_file(folder / "summary.csv") as partial_summary,
        whole_file(folder / "study.json") as partial_index,
        open(partial_index, "wb", BUFFER) as index,
        open(partial_summary, "wb", BUFFER) as summary,
    ):

        def rows() -> Iterator[Row]:  # each record is read once
            for number, (record, text) in enumerate(records.with_texts()):
                index.write((b",\n" if number else b"") + text)
                yield _checked_row(record)

        index.write(head[:-2].encode() + b',\n "runs": [\n')
        _write_rows(rows(), summary)
        index.write(b"\n]}\n")


class Run(BaseModel):
    """Required entries of every run in the index of a study."""

    model_config = ConfigDict(extra="allow")

    name: str
    file: str
    status: str


class Index(BaseModel):
    """Required content of a ``study.json``."""

    model_config = ConfigDict(extra="ignore")

    format: Literal["railsim-study-result/1"]
    status: str
    inputs: StudySpec
    runs: Annotated[list[Run], Field(max_length=MOST_RUNS)]


def read_index(path: Path) -> Index:
    """Return the content of a ``study.json``; raises InputError: it cannot be read, or is none."""
    text = read_text(path, INDEX_BYTES)
    # each takes some hundred bytes of memory when it is read
    if max(text.count(","), 5 * text.count("{"), 5 * text.count("[")) > MOST_VALUES:
        raise input_error(path, "too many values", f"{MOST_VALUES} at most")
    try:
        index: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        line = f"line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        words = f"broken JSON: {getattr(error, 'msg', error)}"
        raise input_error(path, words, key=line) from None
    index = index if isinstance(index, dict) else {"format": None}
    if index.get("format") == FORMAT:
        refuse_too_many(index.get("inputs"), str(path))
    return validated(Index, index, str(path))


def refuse_too_many(inputs: Any, file: str) -> None:
    """Refuse, by InputError, stored inputs with more values than a study can have: each a fault."""
    nodes, number = [inputs], 0
    while nodes and number <= MOST_INPUTS:
        node = nodes.pop()
        if isinstance(node, dict | list):
            number += len(node)
            nodes += node.values() if isinstance(node, dict) else node
    if number > MOST_INPUTS:
        raise input_error(file, "too many values", f"{MOST_INPUTS} at most", key="inputs")


def check_index(path: Path) -> Index:
    """Return the index of a study; raises InputError, also where the result of a run is missing."""
    index = read_index(path)
    allowed = "the same study with `resume` computes it again"
    faults = Faults()
    for run in index.runs:
        if run.status in NOT_DONE or not run.file:
            continue
        if Path(run.file).name != run.file:
            faults.append(Fault(str(path), run.file[:60], "is not in the folder of the study", ""))
        elif not is_file(path.parent / run.file):
            found = "the result is missing"
            faults.append(Fault(str(path), run.file, found, allowed, option=str(path)))
    faults.check()
    return index


def _write_rows(rows: Iterable[Row], stream: BinaryIO) -> None:
    """Write one line per run: labels, status, peaks and mid-curve values.

    The header includes units: ``Q_peak (N)``.  The columns of a quantity are
    ``Q_peak`` (or ``dQ_over_Q0_max`` and ``_min``), the same with ``_wheelset``, ``_side``,
    ``_time`` and ``_distance``, and ``Q_mid``, the largest magnitude at the middle of the first
    curve (``Q_mid2`` of the second).  The column ``remarks`` holds all remarks on the run.
    """
    columns: list[str] = []
    sizes: list[tuple[int, int]] = []  # bytes and cells of each line
    with tempfile.TemporaryFile(buffering=BUFFER) as lines:  # all columns are known at the end only
        for row in rows:
            if [*row] != columns:
                columns = list(dict.fromkeys((*columns, *row)))
                row = {name: row.get(name, "") for name in columns}
            line = _csv_line([*row.values()])
            lines.write(line)
            sizes.append((len(line), len(columns)))
        units = {name: unit_of(name) for name in columns}
        stream.write(_csv_line([f"{name} ({u})" if u else name for name, u in units.items()]))
        lines.seek(0)
        for length, width in sizes:
            line, missing = lines.read(length), len(columns) - width
            stream.write(line[:-1] + b"," * missing + b"\n" if missing else line)


def _csv_line(cells: list[Any]) -> bytes:
    """A line of CSV from JSON, which has numbers as texts in a tenth of the time of Python's."""
    parts = _NO_NUMBER.split(json_bytes(cells)[1:-1])
    parts[1::2] = map(_csv_cell, parts[1::2])
    return b"".join(parts) + b"\n"


@lru_cache(10_000)  # names of wheelsets and the like
def _csv_cell(text: bytes) -> bytes:
    """A cell of CSV from a text of JSON, or from null."""
    value = str(spreadsheet_cell(parse_json(text) or ""))
    if re.search('[,"\r\n]', value):
        value = '"' + value.replace('"', '""') + '"'
    return value.encode("utf-8", "surrogateescape")


def _checked_row(record: Record) -> dict[str, Any]:
    try:
        return summary_row(record)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        found = f"the record of '{record['name']}' cannot be used ({error!r})"
        raise input_error(JOURNAL, found, "remove the journal: existing results are kept") from None


def unit_of(column: str) -> str:
    """Return the unit of a column of the summary, empty if it has none.

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


@cache
def _columns_of_peak(quantity: str, kind: str) -> tuple[str, dict[str, str]]:
    """Column of the value of a peak, and columns of further keys of its record."""
    column = quantity + {"abs": "_peak", "max": "_max", "min": "_min"}[kind]
    facts = ("wheelset", "side", "time", "distance")
    return column, {"low_pass_20_hz": f"{column}_20hz"} | {f: f"{column}_{f}" for f in facts}


def summary_row(record: Record) -> dict[str, Any]:
    """Return the cells of the line of a run by the names of their columns, without units, in SI."""
    cells = ((n, value, number_with_unit(str(value))) for n, value in record["labels"].items())
    labels = {n: value if si is None or "." not in n else si for n, value, si in cells}
    row = {"name": record["name"], **labels, "file": record["file"]}
    row |= {name: record.get(name, "") for name in FACTS}
    row["remarks"] = " ".join(record.get("remarks", ()))
    for peak in record.get("peaks", ()):
        column, further = _columns_of_peak(peak["quantity"], peak["kind"])
        row[column] = peak["value"]
        row |= {name: peak[fact] for fact, name in further.items() if fact in peak}
    for number, curve in enumerate(record.get("mid_curves", ()), start=1):
        which = "" if number == 1 else number
        row |= {f"{name}_mid{which}": value for name, value in curve["largest"].items()}
        medians = curve.get("largest_medians", {})
        row |= {f"{name}_median{which}": value for name, value in medians.items()}
    return {**row, **record.get("quantities", {})}
