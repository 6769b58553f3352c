"""The result file: HDF5 that xarray, h5py, MATLAB and HDFView read.

Layout: one dataset a quantity at the root, with dimension scales attached and the attributes
``units``, ``long_name`` and ``comment`` (the sign convention); names of wheelsets, sides, bodies
and components are dimension scales themselves; facts about the run are root attributes; the
group ``profiles`` holds the points of every profile that was used, further groups hold arrays
without dimensions of their own, such as the state at the end.

Names are stored as fixed-length ASCII, those that are not ASCII as UTF-8, with the attribute
``_Encoding``: h5py, MATLAB's h5read, GNU Octave (ASCII only) and HDFView read them as they are, and
xarray decodes them.  Attributes are variable-length UTF-8
strings, which h5py returns as `str` and which may be longer than 64 kB, as an input text can be.

A file is written under a hidden name beside its target and gets its own name only when it is whole
and on the disk.  Every dataset has checksums, the file a digest and a seal (`integrity.py`).
"""

import errno
import logging
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import h5py
import numpy as np

from railsim.arrays import Floats
from railsim.errors import Fault, InputError
from railsim.files.access import PartialFile, check_file
from railsim.notation import EXTREMES, QUANTITIES, Quantity
from railsim.profiles.profile import Profile
from railsim.result import sinks
from railsim.result.attributes import Values, check_attributes
from railsim.result.contents import Contents, Dataset
from railsim.result.data import Attributes, Result, frozen
from railsim.result.integrity import seal
from railsim.result.reading import open_checked

# what is wrong with the disk rather than with the name
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG)
_LOG = logging.getLogger(__name__)
Named = Mapping[str, Any]
Shape = tuple[int, ...]
PEAKS = "peaks"  # group of largest and smallest values over all steps
CHUNK_BYTES = 2**18
ROWS_AT_ONCE = 2048  # of the coach 4 MB
DOUBLE = ("time", "distance", "mileage")


@dataclass(frozen=True)
class Storage:
    """How arrays over time are stored."""

    compress: bool = False  # compress without loss (deflate, bytes of numbers side by side)
    single: bool = False  # numbers of 4 bytes, 7 digits, but for time and distance

    def kind(self, name: str) -> type[np.floating[Any]]:
        """Return the type of the numbers of a quantity."""
        return np.float32 if self.single and name not in DOUBLE else np.float64


PLAIN = Storage()


class Hdf5Sink(sinks.Sink):
    """Streams chunks to a result file.

    The file is created at once beside its target under a hidden name, so that an output that
    cannot be written, or is being written by another process, is known before anything is computed.

    `path`: Result file. `overwrite`: Replace an existing file. `attributes`: Root attributes to
    add to those of the run. `option`: What the user knows the path by, for messages. `storage`:
    Compression and precision. Raises InputError: the file exists and may not be overwritten, is
    being written by another process, or cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        overwrite: bool = False,
        attributes: Attributes = sinks.NOTHING,
        option: str = "--out",
        storage: Storage = PLAIN,
    ) -> None:
        self.path = Path(path)
        self._storage = storage
        check_file(self.path, overwrite=overwrite, option=option)
        check_attributes(attributes)
        self._attributes = dict(attributes)
        self._overwrite = overwrite
        self._quantities: dict[str, Quantity] = {}
        self._datasets: dict[str, Dataset] = {}
        self._blocks: dict[str, Floats] = {}  # what waits to be written, by quantity
        self._waiting = 0
        try:
            with ExitStack() as undo:  # also of an interrupt, before a `with` can see to it
                self._partial = PartialFile(self.path, alone=True, option=option)
                undo.callback(self._partial.remove)
                self._contents = Contents(self._partial.path)
                undo.pop_all()
        except OSError as error:
            if error.errno in FULL:
                raise OSError(error.errno, os.strerror(error.errno), str(self.path)) from None
            fault = Fault(option, "", f"cannot write {self.path} ({error})", "choose another path")
            raise InputError([fault]) from None

    def begin(
        self, coordinates: sinks.Coordinates, quantities: Iterable[Quantity] = sinks.ALWAYS
    ) -> None:
        """See `Sink.begin`."""
        self._quantities = {quantity.name: quantity for quantity in quantities}
        names = sinks.full_coordinates(coordinates)
        for dim, labels in names.items():
            _write_names(self._contents, dim, labels)
        for name in sinks.time_quantities(self._quantities):
            inner = tuple(len(names[dim]) for dim in self._quantities[name].dims[1:])
            self._blocks[name] = np.empty((ROWS_AT_ONCE, *inner))

    def _create_datasets(self, length: int | None = None) -> None:
        """Create what is a function of time; with chunks that fit, where the length is known."""
        for name in sorted(self._blocks, key=lambda name: name != "time"):
            # a chunk is never written in part, and a short run is a small file
            quantity, inner = self._quantities[name], self._blocks[name].shape[1:]
            rows = _chunk_rows(inner, length)
            self._datasets[name] = self._contents.create(
                name, (0, *inner), np.dtype(self._storage.kind(name)), _attributes(quantity),
                quantity.dims, chunks=(rows, *(max(1, size) for size in inner)), growing=True,
                compress=self._storage.compress,
            )  # fmt: skip

    def append(self, chunk: Mapping[str, Floats]) -> None:
        """See `Sink.append`; rows wait until they are worth writing."""
        rows, done = len(chunk["time"]), 0
        while done < rows:
            count = min(rows - done, ROWS_AT_ONCE - self._waiting)
            for name, block in self._blocks.items():
                block[self._waiting : self._waiting + count] = chunk[name][done : done + count]
            done += count
            self._waiting += count
            if self._waiting == ROWS_AT_ONCE:
                with _disk_errors(self.path):
                    self._write_rows()

    def _write_rows(self) -> None:
        if not self._datasets:
            self._create_datasets()
        for name, dataset in self._datasets.items():
            dataset.append(self._blocks[name][: self._waiting])
        self._waiting = 0

    def close(
        self,
        attributes: Attributes,
        statics: Mapping[str, Any] = sinks.NOTHING,
        profiles: Mapping[str, Profile] = sinks.NOTHING,
        groups: Mapping[str, Mapping[str, Any]] = sinks.NOTHING,
    ) -> Result:
        """See `Sink.close`; the file now has its name."""
        with _disk_errors(self.path):
            self._write_rest(statics, profiles, groups)
            self._contents.finish(sinks.root_attributes(self._attributes, attributes))
            seal(self._partial.path)
            requested, self.path = self.path, self._partial.finish(overwrite=self._overwrite)
        if self.path != requested:
            _LOG.warning(f"{requested} has appeared in the meantime; the result is {self.path}")
        return open_checked(self.path, just_sealed=True)

    def _write_rest(self, statics: Named, profiles: Named, groups: Named) -> None:
        if not self._datasets:
            self._create_datasets(self._waiting)
        if self._waiting:
            self._write_rows()
        for name, quantity in self._quantities.items():
            if "time" not in quantity.dims:
                array = frozen(statics[name])
                self._contents.store(name, array, _attributes(quantity), quantity.dims)
        for name, profile in profiles.items():
            _write_profile(self._contents, name, profile)
        for group, arrays in groups.items():
            if group == PEAKS:  # of the quantities that are kept only
                stored = self._quantities
                arrays = {n: a for n, a in arrays.items() if sinks.peak_quantity(n) in stored}
                if arrays:
                    _write_names(self._contents, f"{PEAKS}/extreme", EXTREMES)
            for name, array in arrays.items():
                attributes, dims = _peak_attributes(name) if group == PEAKS else ({}, ())
                self._contents.store(f"{group}/{name}", frozen(array), attributes, dims)

    def abort(self) -> None:
        """Remove what was written so far; harmless after `close`."""
        with suppress(OSError, RuntimeError):  # what could not be written cannot be closed either
            self._contents.close()
        self._partial.remove()


@contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    """Report what the system refused in one line, with the name of the file.

    HDF5 says it in the midst of many lines, and while it flushes or closes a file not even by the
    right kind of exception.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        match = re.search(r"errno = (\d+)", str(error))
        number = getattr(error, "errno", None) or (int(match[1]) if match else 0)
        if not number and not isinstance(error, OSError):
            raise
        number = number or errno.EIO
        raise OSError(number, os.strerror(number), str(path)) from None


def write(
    result: Result,
    path: str | Path,
    *,
    overwrite: bool = False,
    names: Iterable[str] | None = None,
    storage: Storage = PLAIN,
) -> Path:
    """Write a result to a file, or some of its quantities; see `Result.to_hdf5`."""
    check_attributes(result.attributes)
    for name, quantity in result.quantities.items():
        if name in QUANTITIES and quantity.unit != QUANTITIES[name].unit:  # as it would be read
            found, allowed = f"{name} in {quantity.unit}", "SI; `export` writes other units"
            raise InputError([Fault(str(path), name, found, allowed)])
    chosen = set(result if names is None else names)
    selected = {name: q for name, q in result.quantities.items() if name in chosen}
    with Hdf5Sink(path, overwrite=overwrite, option=str(path), storage=storage) as sink:
        sink.begin(result.coordinates, selected.values())
        sink.append({name: result[name] for name in sinks.time_quantities(selected)})
        statics = {name: result[name] for name in selected if "time" not in selected[name].dims}
        sink.close(result.attributes, statics, result.profiles, result.groups)
    return sink.path


def _write_names(contents: Contents, dim: str, labels: Sequence[str]) -> None:
    encoded = [label.encode() for label in labels]
    # GNU Octave reads no fixed-length UTF-8, and what is ASCII is the same in both
    encoding = "ascii" if all(label.isascii() for label in labels) else "utf-8"
    kind = h5py.string_dtype(encoding, max((len(label) for label in encoded), default=1))
    attributes = {"_Encoding": "utf-8", "long_name": f"name of the {dim.removeprefix(f'{PEAKS}/')}"}
    contents.store(dim, np.array(encoded, dtype=kind), attributes, (dim,))


def _chunk_rows(inner: Shape, length: int | None) -> int:
    """Return the instants of a chunk of a quantity.

    `inner`: Its shape at an instant. `length`: Number of instants, where it is known.
    """
    fitting = CHUNK_BYTES // (8 * max(1, math.prod(inner)))
    rows = 1 << max(1, min(1024, fitting)).bit_length() - 1  # a power of two: written whole
    if length is not None:
        rows = math.ceil(length / math.ceil(length / rows)) if length else 1
    return rows


def _attributes(quantity: Quantity) -> Values:
    attributes: dict[str, str | float] = {"units": quantity.unit, "long_name": quantity.long_name}
    if quantity.sign:
        attributes["comment"] = quantity.sign
    if quantity.name not in QUANTITIES:
        attributes["symbol"] = quantity.symbol
        attributes["shown_units"] = quantity.shown_unit
        attributes["shown_scale"] = quantity.scale
    return attributes


def _peak_attributes(name: str) -> tuple[Values, Sequence[str]]:
    """Units, names and dimensions of largest and smallest values, their times or distances."""
    base = sinks.peak_quantity(name)
    quantity, stored = QUANTITIES[base], QUANTITIES[name.removeprefix(f"{base}_")]
    what = "" if stored is quantity else f": {stored.long_name}"
    long_name = f"largest and smallest {quantity.long_name}{what}"
    dims = f"{PEAKS}/extreme", *quantity.dims[1:]
    return {"units": stored.unit, "long_name": long_name}, dims


def _write_profile(contents: Contents, name: str, profile: Profile) -> None:
    long_name = f"{profile.kind} profile {profile.name}: y, z"
    facts: dict[str, str | float] = {"units": "m", "long_name": long_name}
    facts |= {fact: getattr(profile, fact) for fact in ("name", "kind", "source", "inclination")}
    facts["notes"] = "\n".join(profile.notes)
    points = np.column_stack([profile.y, profile.z])
    contents.store(f"profiles/{quote(name, safe=' ')}", points, facts)
