"""What a study leaves beside its result files: ``summary.csv`` and ``study.json``.

``study.json`` holds the inputs of the study and a record of every run with its peaks and mid-curve
values; ``summary.csv`` holds one line a run for spreadsheets.  All numbers are SI.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railsim.errors import Fault, InputError
from railsim.files import whole_file
from railsim.result import Result, mid_curves, peaks
from railsim.studies.case import Case

FORMAT = "railsim-study-result/1"
FACTS = (
    "status", "status_reason", "step", "wall_time", "cpu_time", "real_time_factor",
    "patches_out_of_range",
)  # fmt: skip

Record = dict[str, Any]


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


def finished_record(case: Case, result: Result) -> Record:
    """Return the record of a run that has its result."""
    return {
        **waiting_record(case),
        **{name: result.attributes[name] for name in FACTS if name in result.attributes},
        "remarks": list(result.remarks),
        "peaks": [peak.record() for peak in peaks(result)],
        "mid_curves": [curve.record() for curve in mid_curves(result)],
    }


def failed_record(case: Case, reason: str, traceback: str = "") -> Record:
    """Return the record of a run that has no result."""
    return {
        **waiting_record(case),
        "status": "failed",
        "status_reason": reason,
        "traceback": traceback,
    }


def write_index(
    folder: Path, inputs: Mapping[str, Any], status: str, records: Sequence[Record]
) -> None:
    """Write ``study.json`` and ``summary.csv``, each appearing under its name when it is whole."""
    index = {"format": FORMAT, "status": status, "inputs": dict(inputs), "runs": list(records)}
    _replace(folder / "study.json", json.dumps(index, indent=1) + "\n")
    _replace(folder / "summary.csv", summary_csv(records))


def read_index(path: Path) -> dict[str, Any]:
    """Return what a ``study.json`` holds.

    Raises
    ------
    InputError : it cannot be read, or is not the index of a study.
    """
    try:
        index: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        fault = Fault(str(path), "", f"cannot be read ({error})", "give the study.json of a study")
        raise InputError([fault]) from None
    except json.JSONDecodeError as error:
        fault = Fault(str(path), f"line {error.lineno}", f"broken JSON: {error.msg}", "")
        raise InputError([fault]) from None
    found = index.get("format") if isinstance(index, dict) else None
    if found != FORMAT:
        raise InputError([Fault(str(path), "format", repr(found), f"allowed: {FORMAT}")])
    checked: dict[str, Any] = index
    return checked


def check_index(path: Path) -> dict[str, Any]:
    """Return what a ``study.json`` holds; every run that it calls done must have its result.

    Raises
    ------
    InputError : as `read_index`, or results are not there.
    """
    index = read_index(path)
    allowed = "the same study with --resume computes it again"
    faults = [
        Fault(str(path), run["file"], "the result is not there", allowed)
        for run in index["runs"]
        if run["status"] not in ("waiting", "failed") and not (path.parent / run["file"]).exists()
    ]
    if faults:
        raise InputError(faults)
    return index


def summary_csv(records: Sequence[Record]) -> str:
    """Return one line a run: what tells it apart, how it ended, its peaks and mid-curve values.

    The columns of a quantity are ``Q_peak`` (or ``dQ_over_Q0_max`` and ``_min``), the same with
    ``_wheelset``, ``_side``, ``_time`` and ``_distance``, and ``Q_mid``, the largest magnitude at
    the middle of the first curve (``Q_mid2`` of the second).  The column ``remarks`` holds all
    remarks on the run.
    """
    rows = [_row(record) for record in records]
    columns = list(dict.fromkeys(column for row in rows for column in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _row(record: Record) -> dict[str, Any]:
    row = {"name": record["name"], **record["labels"], "file": record["file"]}
    row |= {name: record.get(name, "") for name in FACTS}
    row["remarks"] = " ".join(record.get("remarks", ()))
    endings = {"abs": "peak", "max": "max", "min": "min"}
    for peak in record.get("peaks", ()):
        column = f"{peak['quantity']}_{endings[peak['kind']]}"
        row[column] = peak["value"]
        for fact in ("wheelset", "side", "time", "distance"):
            if fact in peak:
                row[f"{column}_{fact}"] = peak[fact]
    for number, curve in enumerate(record.get("mid_curves", ()), start=1):
        ending = "mid" if number == 1 else f"mid{number}"
        for name, value in curve["largest"].items():
            row[f"{name}_{ending}"] = value
    return row


def _replace(path: Path, text: str) -> None:
    with whole_file(path) as partial:
        partial.write_text(text, encoding="utf-8")
