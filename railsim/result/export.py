"""A result in the files of other programs: CSV, MATLAB, Parquet.

CSV and Parquet hold what is a function of time, a column for each set of labels, named
``Q:front.outer.wheelset:left``; in CSV the unit follows.  A MATLAB file holds the arrays under
their names with their dimensions, and ``units``, names and facts of the run as structures.
"""

import csv
from pathlib import Path
from typing import Any

import numpy as np

from railsim.errors import InputError, argument_fault
from railsim.files import check_file, whole_file
from railsim.result.data import Array, Result

ENDINGS = (".csv", ".mat", ".parquet")
ROWS_AT_ONCE = 4096


def export(result: Result, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a result to a file whose ending says the format.

    Raises
    ------
    InputError : the file exists and may not be overwritten, its ending is none of `ENDINGS`, or
        what writes it is not installed.
    """
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=ENDINGS)
    write = {".csv": _csv, ".mat": _matlab, ".parquet": _parquet}[path.suffix.lower()]
    with whole_file(path) as partial:
        write(result, partial)
    return path


def _columns(result: Result) -> list[tuple[str, str, Array]]:
    """Return name, unit and values of every column, time first."""
    return [("time", "s", result["time"]), *result.columns()]


def _csv(result: Result, path: Path) -> None:
    found = _columns(result)
    table = np.stack([values for _, _, values in found], axis=1)
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([name if unit == "1" else f"{name} ({unit})" for name, unit, _ in found])
        for begin in range(0, len(table), ROWS_AT_ONCE):
            writer.writerows(table[begin : begin + ROWS_AT_ONCE].tolist())


def _matlab(result: Result, path: Path) -> None:
    from scipy.io import savemat

    data: dict[str, Any] = {name: result[name] for name in result}
    data["units"] = {name: quantity.unit for name, quantity in result.quantities.items()}
    data["names"] = {
        dim: np.array(names, dtype=object) for dim, names in result.coordinates.items()
    }
    data["run"] = dict(result.attributes)
    # by the file: a name would get an ending
    with open(path, "wb") as opened:
        file: Any = opened
        savemat(file, data, long_field_names=True, oned_as="column", do_compression=True)


def _parquet(result: Result, path: Path) -> None:
    try:
        import pandas
        import pyarrow  # noqa: F401 - what writes it
    except ImportError as error:
        found = f"the package '{error.name}' is not installed"
        allowed = "install it with: pip install pandas pyarrow"
        raise InputError([argument_fault("path", "", found, allowed, "--out")]) from None
    frame = pandas.DataFrame({name: values for name, _, values in _columns(result)})
    frame.attrs = {"units": {name: unit for name, unit, _ in _columns(result)}}
    with open(path, "wb") as file:
        frame.to_parquet(file)
