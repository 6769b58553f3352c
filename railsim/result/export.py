"""A result in the files of other programs: CSV, MATLAB, Parquet.

CSV and Parquet hold what is a function of time, a column for each set of labels, named
``Q:front.outer.wheelset:left``; in CSV the unit follows.  A MATLAB file holds the arrays under
their names with their dimensions, and ``units``, names and facts of the run as structures.
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import to_json

from railsim.arrays import Floats
from railsim.errors import (
    Faults,
    argument_error,
    argument_fault,
    input_error,
    nearest,
    optional_package,
)
from railsim.files.access import check_file, whole_file
from railsim.result.data import Result
from railsim.result.filters import even_step, low_passed, outward_quotient
from railsim.result.labels import all_labels

ENDINGS = (".csv", ".mat", ".parquet")
ROWS_AT_ONCE = 4096
MATLAB_NAME = re.compile(r"(?!(names|run|units)$)[A-Za-z][A-Za-z0-9_]{0,62}")
MOST_INSTANTS = 10_000_000  # of an export at equal times
POSITIONS = ("time", "distance", "mileage", "wheelset_distance")  # quantities that are not filtered


def export(
    result: Result, path: str | Path, quantities: Sequence[str] = (), *, overwrite: bool = False
) -> Path:
    """Write a result to a file whose ending says the format.

    `quantities`: Columns of CSV and Parquet, such as ``Y:1:left``; by default all. Raises
    InputError: the file exists and may not be overwritten, its ending is none of `ENDINGS`, what
    writes it is not installed, it is a MATLAB file and a part of a quantity is asked for or one
    whose name it cannot hold, or none and a quantity is asked for that is no function of time.
    """
    path = Path(path)
    check_file(path, overwrite=overwrite, endings=ENDINGS)
    with whole_file(path) as partial:
        if path.suffix.lower() == ".mat":
            if labelled := [name for name in quantities if ":" in name]:
                allowed = "a MATLAB file holds whole quantities; CSV and Parquet hold columns"
                found = "a part of a quantity"
                raise argument_error("quantities", found, allowed, labelled[0], "QUANTITY")
            if strange := [name for name in result if not MATLAB_NAME.fullmatch(name)]:
                found = "no name of a MATLAB file"
                allowed = "63 letters, digits and _ at most, a letter first, not names, run, units"
                raise argument_error("quantities", found, allowed, strange[0], "QUANTITY")
            _matlab(result, partial)
        else:
            dims = {q: result.quantities[q.partition(":")[0]].dims for q in quantities}
            if fixed := [q for q in quantities if dims[q][0] != "time"]:
                found, allowed = "no function of time", "a MATLAB file (.mat) holds it"
                raise argument_error("quantities", found, allowed, fixed[0], "QUANTITY")
            write = _csv if path.suffix.lower() == ".csv" else _parquet
            write(_columns(result, quantities), partial)
    return path


def selected(
    result: Result,
    quantities: Sequence[str] = (),
    *,
    between: tuple[float, float] | None = None,
    rate: float | None = None,
    shown_units: bool = False,
) -> Result:
    """Return a part of a result: some quantities over a section, in other units.

    `quantities`: Names, by default all; labels behind them, as in ``Y:1:left``, are for `export`.
    Time and distance are kept always. `between`: Section of the track, by the distance of the
    reference body [m]. `rate`: Values at equal times, as many per second, interpolated linearly;
    values that change faster than half of it are filtered before (`low_passed`) [1/s].
    `shown_units`: In the units of tables and plots (kN, mm) instead of SI. Raises InputError: a
    quantity or label that the result does not have; a section that was not run; a rate that is no
    number above 0.
    """
    faults = Faults()
    for selection in quantities:
        name, *labels = selection.split(":")
        exists = name in result
        dims = result.quantities[name].dims[1:] if exists else ()
        choices = list(all_labels(dims, result.coordinates) if exists else result)
        for label in (label for label in (labels if exists else [name]) if label not in choices):
            found = f"no label '{label}'" if exists else "no such quantity"
            allowed = nearest(label, choices)
            faults.append(argument_fault("quantities", selection, found, allowed, "QUANTITY"))
    time, distance = result["time"], result["distance"]
    if not len(time) and (between or rate is not None):
        found = f"holds no instants: {result.status}"
        raise input_error("result", found, "a run of some length", "time")
    low, high = between or (-np.inf, np.inf)
    rows = np.flatnonzero((distance >= low) & (distance <= high))
    if between and len(rows) < 2:
        allowed = (
            f"A below B, two instants at least, within {distance[0]:.1f} to {distance[-1]:.1f} m"
        )
        faults.require(False, "between", f"{low:.12g} to {high:.12g} m", allowed)
    if rate is not None:
        faults.require(0.0 < rate < np.inf, "rate", f"found {rate:.12g}", "above 0 per s")
    faults.check()
    names = [selection.partition(":")[0] for selection in quantities]
    requested = dict.fromkeys(["time", "distance", *(names or result)])
    chosen = {name: quantity for name, quantity in result.quantities.items() if name in requested}
    instants = time[rows]
    if rate is not None and len(rows):
        if (number := rate * (instants[-1] - instants[0])) > MOST_INSTANTS:
            found = f"{rate:g} per s: {number:.3g} instants"
            raise argument_error("rate", found, f"{MOST_INSTANTS:.0e} at most", option="--rate")
        instants = np.arange(instants[0], instants[-1] + 1e-9, 1.0 / rate)
    arrays = {}
    for name, quantity in chosen.items():
        array = result[name]
        if quantity.dims[:1] == ("time",):
            smooth = array if rate is None or name in POSITIONS else _smooth(result, name, rate)
            array = array[rows] if rate is None else _interpolate(instants, time, smooth)
        arrays[name] = array * (quantity.scale if shown_units else 1.0)
    if shown_units:
        chosen = {name: replace(q, unit=q.shown_unit) for name, q in chosen.items()}
    return Result(arrays, chosen, result.coordinates, result.attributes, result.profiles)


def _smooth(result: Result, name: str, rate: float) -> Floats:
    """Return a quantity without what changes faster than half the rate.

    At uneven times it is filtered at even ones as close as they are.  Y/Q is the quotient of both
    after the filter.  Others are bridged where they do not exist, as at a wheel that does not
    touch, and do not exist there afterwards.
    """
    time, values = result["time"], result[name]
    if len(time) < 4:
        return values
    steps = np.diff(time)
    steady_step = even_step(time)
    step = steady_step or float(max(steps.min(), 0.1 * steps.mean()))
    if rate * step >= 1.0:
        return values
    even = np.arange(time[0], time[-1] + 0.5 * step, step)

    def low_pass(x: Floats) -> Floats:
        slow = low_passed(x if steady_step else _interpolate(even, time, x), 1.0 / step, 0.4 * rate)
        return slow if steady_step else _interpolate(time, even, slow)

    if name == "Y_over_Q" and {"Y", "Q"} <= set(result):
        return outward_quotient(low_pass(result["Y"]), low_pass(result["Q"]))
    columns = values.reshape(len(time), -1).copy()
    for column in columns.T:
        finite = np.isfinite(column)
        if finite.any() and not finite.all():
            column[:] = np.interp(time, time[finite], column[finite])
    return np.where(np.isnan(values), np.nan, low_pass(columns).reshape(values.shape))


def _interpolate(instants: Floats, time: Floats, values: Floats) -> Floats:
    columns = np.array([np.interp(instants, time, x) for x in values.reshape(len(time), -1).T])
    return columns.T.reshape(len(instants), *values.shape[1:])


Columns = list[tuple[str, str, Floats]]


def _columns(result: Result, quantities: Sequence[str] = ()) -> Columns:
    """Return name, unit and values of every column, time first."""
    names = ["distance", *(q for q in quantities if q != "time")] if quantities else []
    columns = {column[0]: column for column in result.columns(*names)}  # each once
    return [("time", "s", result["time"]), *columns.values()]


def _csv(columns: Columns, path: Path) -> None:
    table = np.stack([values for _, _, values in columns], axis=1)
    head = [name if unit == "1" else f"{name} ({unit})" for name, unit, _ in columns]
    with open(path, "w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(head)
        for begin in range(0, len(table), ROWS_AT_ONCE):
            # the shortest digits that give the number back, as `repr`, in a tenth of its time
            rows = to_json(table[begin : begin + ROWS_AT_ONCE].tolist(), inf_nan_mode="constants")
            lines = rows.decode()[2:-2].replace("],[", "\n").replace("NaN", "nan")
            file.write(lines.replace("Infinity", "inf") + "\n")


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


def _parquet(columns: Columns, path: Path) -> None:
    pandas = optional_package("pandas", "Parquet", "pandas pyarrow")
    optional_package("pyarrow", "Parquet", "pandas pyarrow")  # what writes it
    frame = pandas.DataFrame({name: values for name, _, values in columns})
    frame.attrs = {"units": {name: unit for name, unit, _ in columns}}
    with open(path, "wb") as file:
        frame.to_parquet(file)
