"""Columns of data files, read in pieces: CSV, Parquet, MATLAB arrays, HDF5.

Only the columns that are asked for are kept, as float64 with NaN where there is no value.  MATLAB
files are read for numeric arrays alone: structures and objects are refused, not opened.
"""

import io
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.measurement import MeasurementFile
from railsim.errors import Fault, Faults, InputError, input_error, nearest, optional_package
from railsim.files.access import open_regular

Columns = Mapping[str, tuple[str, tuple[int, ...]]]
"""Name of the column in the file, and index beyond time, by our names."""
Piece = dict[str, Floats]
ROWS = 50_000
NUMERIC = {"double", "single", "logical"} | {
    f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}


def pieces(path: Path, columns: Columns, setup: MeasurementFile) -> Iterator[Piece]:
    """Yield pieces of the columns of a file, one behind the other.

    Raises InputError: no such file or column; not what its ending says; something else than
    numbers.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        found = f"the name ends in '{path.suffix}'"
        raise input_error(path, found, "one of " + ", ".join(_READERS))
    open_regular(path).close()
    if path.suffix.lower() in (".csv", ".txt") and any(index for _, index in columns.values()):
        raise input_error(path, "a table with 'index'", "leave 'index' out")
    yield from reader(path, columns, setup)


def _unreadable(path: Path, kind: str, error: Exception, allowed: str = "") -> InputError:
    message = str(error).partition("\n")[0][:100]
    return input_error(path, f"cannot be read as {kind} ({message})", allowed)


def _check_columns(path: Path, columns: Columns, names: Sequence[str]) -> None:
    """Refuse columns that the file does not have, all at once."""
    Faults(
        Fault(str(path), "columns", f"no column '{name}'", nearest(name, names))
        for name in dict.fromkeys(column for column, _ in columns.values())
        if name not in names
    ).check()


def _csv(path: Path, columns: Columns, setup: MeasurementFile) -> Iterator[Piece]:
    try:
        with io.TextIOWrapper(open_regular(path), encoding=setup.encoding) as text:
            lines = _lines(text, setup.skip)
            _, head = next(lines, (0, ""))
            if not head:
                raise input_error(path, "empty", "names of columns and rows of numbers")
            delimiter = next((d for d in (";", "\t") if d in head), ",")
            names = [cell.strip().strip('"') for cell in head.split(delimiter)]
            _check_columns(path, columns, names)
            for column, _ in columns.values():
                if names.count(column) > 1:
                    found = f"{names.count(column)} columns '{column}'"
                    raise input_error(path, found, "a name of its own for each", "columns")
            indices = {name: names.index(column) for name, (column, _) in columns.items()}
            if setup.units_row:
                next(lines, None)
            while rows := list(islice(lines, ROWS)):
                yield _rows(path, rows, indices, delimiter, len(names))
    except LookupError:
        known = "a name such as utf-8, latin-1 or utf-16"
        raise input_error(path, f"unknown encoding '{setup.encoding}'", known, "encoding") from None
    except UnicodeDecodeError as error:
        found = f"byte {error.start} is not {error.encoding}"
        raise input_error(path, found, 'its encoding, such as encoding = "latin-1"') from None


def _lines(text: io.TextIOWrapper, skip: int) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text, start=1):
        if number > skip and line.strip() and not line.startswith("#"):
            yield number, line.rstrip("\r\n")


def _rows(
    path: Path, rows: list[tuple[int, str]], indices: Mapping[str, int], delimiter: str, width: int
) -> Piece:
    """Return the columns of some lines; `indices` their places, `width` the number of columns."""
    if delimiter != ",":
        rows = [(number, line.replace(",", ".")) for number, line in rows]  # a decimal comma
    places = sorted(set(indices.values()))
    texts = [line for _, line in rows]
    try:
        if any(line.count(delimiter) != width - 1 for line in texts):
            raise ValueError("another number of columns")
        table = np.loadtxt(texts, delimiter=delimiter, usecols=places, ndmin=2, comments=None)
        rows = []
    except ValueError:  # an empty cell, or what is named below
        table = np.empty((len(rows), len(places)))
    for k, (number, line) in enumerate(rows):
        cells = line.split(delimiter)
        if len(cells) != width:
            found, allowed = f"{len(cells)} values", f"{width} values as in the header"
            raise input_error(path, found, allowed, f"line {number}")
        try:
            table[k] = [float(cells[p].strip() or "nan") for p in places]
        except ValueError as error:
            found = f"not a number ({error})".replace("could not convert string to float: ", "")
            allowed = "numbers, or nothing in a gap"
            raise input_error(path, found, allowed, f"line {number}") from None
    return {name: table[:, places.index(place)] for name, place in indices.items()}


def _parquet(path: Path, columns: Columns, _: MeasurementFile) -> Iterator[Piece]:
    parquet = optional_package("pyarrow.parquet", "reading Parquet", "'railsim[parquet]'")
    try:
        file = parquet.ParquetFile(path)
        _check_columns(path, columns, file.schema_arrow.names)
        names = list(dict.fromkeys(column for column, _ in columns.values()))
        for batch in file.iter_batches(ROWS, columns=names):
            arrays = {n: batch.column(column).cast("float64") for n, (column, _) in columns.items()}
            yield {name: np.array(column, dtype=np.float64) for name, column in arrays.items()}
    except InputError:
        raise
    except Exception as error:  # pyarrow's own errors have no common base
        raise _unreadable(path, "Parquet", error, "columns of numbers") from None


def _hdf5(
    path: Path, columns: Columns, _: MeasurementFile, *, matlab: bool = False
) -> Iterator[Piece]:
    """Yield pieces; MATLAB stores its arrays with their dimensions in the opposite order."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            names: list[str] = []
            file.visititems(
                lambda name, node: names.append(name) if isinstance(node, h5py.Dataset) else None
            )
            _check_columns(path, columns, names)
            arrays = {column: file[column] for column, _ in columns.values()}
            if matlab:
                arrays = {column: np.transpose(array[()]) for column, array in arrays.items()}
            yield from _slices(path, {n: arrays[c] for n, (c, _) in columns.items()}, columns)
    except OSError as error:
        message = str(error).partition("(")[2].rstrip(")") or str(error)
        raise input_error(path, f"cannot be read as HDF5 ({message})") from None


def _matlab(path: Path, columns: Columns, setup: MeasurementFile) -> Iterator[Piece]:
    from scipy import io as matlab
    from scipy.io.matlab import MatReadError

    with open_regular(path) as file:
        newer = file.read(10) == b"MATLAB 7.3"
    if newer:  # HDF5 under another name
        yield from _hdf5(path, columns, setup, matlab=True)
        return
    names = list(dict.fromkeys(column for column, _ in columns.values()))
    try:
        kinds = {name: kind for name, _, kind in matlab.whosmat(path)}
        _check_columns(path, columns, list(kinds))
        for name in names:
            if kinds[name] not in NUMERIC:
                raise input_error(path, f"a {kinds[name]}", "an array of numbers", name)
        arrays = matlab.loadmat(path, variable_names=names, squeeze_me=False)
    except InputError:
        raise
    except (ValueError, TypeError, OSError, NotImplementedError, zlib.error, MatReadError) as error:
        raise _unreadable(path, "MATLAB", error) from None
    yield from _slices(path, {n: arrays[column] for n, (column, _) in columns.items()}, columns)


def _slices(path: Path, arrays: Mapping[str, Any], columns: Columns) -> Iterator[Piece]:
    """Yield pieces of arrays with time first; a single row or column is a series."""
    lengths = {name: _length(path, array, *columns[name]) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        first = next(iter(lengths))
        name = next(name for name in lengths if lengths[name] != lengths[first])
        found = f"{lengths[name]} values, '{columns[first][0]}' has {lengths[first]}"
        raise input_error(path, found, "arrays of one length", columns[name][0])
    count = next(iter(lengths.values()))
    for begin in range(0, count, ROWS):
        rows = slice(begin, min(begin + ROWS, count))
        piece = {}
        for name, array in arrays.items():
            index: tuple[Any, ...] = (rows, *columns[name][1])
            if len(index) == 1 and array.ndim == 2:  # a single row or column
                index = (0, rows) if array.shape[0] == 1 else (rows, 0)
            piece[name] = np.asarray(array[index], dtype=np.float64)
        yield piece


def _length(path: Path, array: Any, column: str, index: tuple[int, ...]) -> int:
    """Return the number of values of a series in an array; refuse what holds none."""
    shape = tuple(array.shape)
    if array.dtype.kind not in "fiub":
        raise input_error(path, "holds no real numbers", "an array of numbers", column)
    if not index and (len(shape) == 1 or (len(shape) == 2 and 1 in shape)):
        return int(max(shape))
    if len(index) != len(shape) - 1 or any(k >= n for k, n in zip(index, shape[1:], strict=True)):
        sizes = " x ".join(map(str, shape)) or "one number"
        example = ", ".join("0" for _ in shape[1:])
        raise input_error(path, f"an array of {sizes}", f"index = [{example}] or others", column)
    return int(shape[0])


_READERS: dict[str, Callable[[Path, Columns, MeasurementFile], Iterator[Piece]]] = {
    ".csv": _csv,
    ".txt": _csv,
    ".parquet": _parquet,
    ".mat": _matlab,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
}
