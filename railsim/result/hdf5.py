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
import zlib
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
from railsim.result.data import Attributes, Result, frozen
from railsim.result.integrity import DIGEST, content_digest, seal
from railsim.result.reading import open_result

# what is wrong with the disk rather than with the name
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG)
_LOG = logging.getLogger(__name__)
Named = Mapping[str, Any]
Shape = tuple[int, ...]
PEAKS = "peaks"  # group of largest and smallest values over all steps
CHUNK_BYTES = 2**18
ROWS_AT_ONCE = 2048  # of the coach 4 MB
DOUBLE = ("time", "distance", "mileage")
GZIP = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


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
        self._attributes = dict(attributes)
        self._overwrite = overwrite
        self._quantities: dict[str, Quantity] = {}
        self._datasets: dict[str, h5py.Dataset] = {}
        self._blocks: dict[str, Floats] = {}  # what waits to be written, by quantity
        self._crc: dict[str, int] = {}
        self._waiting = 0
        self._length = 0
        # what is written is not read again: HDF5 need not keep chunks, by itself 8 MB of each
        # quantity; the partial file is locked already
        how = {"track_order": True, "rdcc_nbytes": 0, "locking": False}
        try:
            with ExitStack() as undo:  # also of an interrupt, before a `with` can see to it
                self._partial = PartialFile(self.path, alone=True, option=option)
                undo.callback(self._partial.remove)
                self._file = h5py.File(self._partial.path, "w", **how)
                undo.pop_all()
        except OSError as error:
            if error.errno in FULL:
                raise OSError(error.errno, os.strerror(error.errno), str(self.path)) from None
            fault = Fault(option, "", f"cannot write {self.path} ({error})", "choose another path")
            raise InputError([fault]) from None

    def begin(
        self,
        coordinates: Mapping[str, Sequence[str]],
        quantities: Iterable[Quantity] = sinks.ALWAYS,
    ) -> None:
        """See `Sink.begin`."""
        self._quantities = {quantity.name: quantity for quantity in quantities}
        names = sinks.full_coordinates(coordinates)
        for dim, labels in names.items():
            _write_names(self._file, dim, labels)
        for name in sinks.timed(self._quantities):
            inner = tuple(len(names[dim]) for dim in self._quantities[name].dims[1:])
            self._blocks[name] = np.empty((ROWS_AT_ONCE, *inner))
            self._crc[name] = 0

    def _create_datasets(self, length: int | None = None) -> None:
        """Create what is a function of time; with chunks that fit, where the length is known."""
        for name in sorted(self._blocks, key=lambda name: name != "time"):
            how = self._blocks[name].shape[1:], length, self._storage
            self._datasets[name] = _create(self._file, self._quantities[name], *how)

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
        length = self._length + self._waiting
        for name, dataset in self._datasets.items():
            rows = self._blocks[name][: self._waiting]
            rows = np.ascontiguousarray(rows, dtype=dataset.dtype)
            dataset.resize(length, axis=0)
            dataset[self._length : length] = rows
            self._crc[name] = zlib.crc32(rows.data, self._crc[name])
        self._length, self._waiting = length, 0

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
            self._file.attrs.update(sinks.root_attributes(self._attributes, attributes))
            self._file.attrs[DIGEST] = content_digest(self._file, self._crc)
            self._file.flush()  # where the disk is full, before the file is closed
            self._file.close()
            seal(self._partial.path)
            wanted, self.path = self.path, self._partial.finish(overwrite=self._overwrite)
        if self.path != wanted:
            _LOG.warning(f"{wanted} has appeared in the meantime; the result is {self.path}")
        return open_result(self.path)

    def _write_rest(self, statics: Named, profiles: Named, groups: Named) -> None:
        if not self._datasets:
            self._create_datasets(self._waiting)
        if self._waiting:
            self._write_rows()
        for name, quantity in self._quantities.items():
            if "time" not in quantity.dims:
                _describe(_stored(self._file, name, frozen(statics[name])), quantity)
        for name, profile in profiles.items():
            _write_profile(self._file, name, profile)
        for group, arrays in _of_quantities(groups, self._quantities).items():
            for name, array in arrays.items():
                _stored(self._file, f"{group}/{name}", frozen(array))
            if group == PEAKS:
                _describe_peaks(self._file[group], self._file)

    def abort(self) -> None:
        """Remove what was written so far; harmless after `close`."""
        with suppress(OSError, RuntimeError):  # what could not be written cannot be closed either
            self._file.close()
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
        said = re.search(r"errno = (\d+)", str(error))
        number = getattr(error, "errno", None) or (int(said[1]) if said else 0)
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
    wanted = set(result if names is None else names)
    selected = {name: q for name, q in result.quantities.items() if name in wanted}
    with Hdf5Sink(path, overwrite=overwrite, option=str(path), storage=storage) as sink:
        sink.begin(result.coordinates, selected.values())
        sink.append({name: result[name] for name in sinks.timed(selected)})
        statics = {name: result[name] for name in selected if "time" not in selected[name].dims}
        sink.close(result.attributes, statics, result.profiles, result.groups)
    return sink.path


def _of_quantities(
    groups: Mapping[str, Mapping[str, Any]], quantities: Mapping[str, Quantity]
) -> dict[str, Mapping[str, Any]]:
    """Groups of a result, with the peaks of the quantities that it keeps only."""
    kept: dict[str, Mapping[str, Any]] = dict(groups)
    if PEAKS in kept:
        of_run = kept[PEAKS].items()
        kept[PEAKS] = {n: array for n, array in of_run if sinks.peak_quantity(n) in quantities}
    return {group: arrays for group, arrays in kept.items() if arrays}


def _stored(file: h5py.File, name: str, array: Any) -> h5py.Dataset:
    """Store a whole array with its checksum."""
    array = np.asarray(array)
    checked = {"chunks": array.shape, "fletcher32": True} if array.size and array.ndim else {}
    return file.create_dataset(name, data=array, **checked)


def _write_names(file: h5py.Group, dim: str, labels: Sequence[str]) -> None:
    encoded = [label.encode() for label in labels]
    # GNU Octave reads no fixed-length UTF-8, and what is ASCII is the same in both
    encoding = "ascii" if all(label.isascii() for label in labels) else "utf-8"
    kind = h5py.string_dtype(encoding, max((len(label) for label in encoded), default=1))
    dataset = _stored(file, dim, np.array(encoded, dtype=kind))
    dataset.attrs["_Encoding"] = "utf-8"
    dataset.attrs["long_name"] = f"name of the {dim}"
    dataset.make_scale(dim)


def _create(
    file: h5py.File, quantity: Quantity, inner: Shape, length: int | None, storage: Storage
) -> h5py.Dataset:
    """Create an empty dataset for a quantity that is a function of time.

    `inner`: Its shape at an instant. `length`: Number of instants: a chunk is never written in
    part, and a short run is a small file.
    """
    # a power of two: whole chunks are written at once
    rows = 2 ** int(np.log2(max(1, min(1024, CHUNK_BYTES // (8 * max(1, int(np.prod(inner))))))))
    if length is not None:
        rows = math.ceil(length / math.ceil(length / rows)) if length else 1
    dataset = file.create_dataset(
        quantity.name, shape=(0, *inner), maxshape=(None, *inner),
        chunks=(rows, *(max(1, size) for size in inner)), dtype=storage.kind(quantity.name),
        fletcher32=True, **(GZIP if storage.compress else {}),
    )  # fmt: skip
    if quantity.name == "time":
        dataset.make_scale("time")
    _describe(dataset, quantity)
    return dataset


def _describe(dataset: h5py.Dataset, quantity: Quantity) -> None:
    dataset.attrs["units"] = quantity.unit
    dataset.attrs["long_name"] = quantity.long_name
    if quantity.sign:
        dataset.attrs["comment"] = quantity.sign
    if quantity.name not in QUANTITIES:
        dataset.attrs["symbol"] = quantity.symbol
        dataset.attrs["shown_units"] = quantity.shown_unit
        dataset.attrs["shown_scale"] = quantity.scale
    if quantity.name != "time":
        for axis, dim in enumerate(quantity.dims):
            dataset.dims[axis].attach_scale(dataset.file[dim])


def _describe_peaks(group: h5py.Group, file: h5py.File) -> None:
    """Units, names and dimensions of largest and smallest values, their times and distances."""
    _write_names(group, "extreme", EXTREMES)
    for name, dataset in group.items():
        if name == "extreme":
            continue
        base = sinks.peak_quantity(name)
        quantity = QUANTITIES[base]
        words = f"largest and smallest {quantity.long_name}"
        if name == base:
            dataset.attrs["units"], dataset.attrs["long_name"] = quantity.unit, words
        else:
            other = QUANTITIES[name.removeprefix(f"{base}_")]
            dataset.attrs["units"] = other.unit
            dataset.attrs["long_name"] = f"{words}: {other.long_name}"
        dataset.dims[0].attach_scale(group["extreme"])
        for axis, dim in enumerate(quantity.dims[1:], start=1):
            dataset.dims[axis].attach_scale(file[dim])


def _write_profile(file: h5py.File, name: str, profile: Profile) -> None:
    points = np.column_stack([profile.y, profile.z])
    dataset = _stored(file, f"profiles/{quote(name, safe=' ')}", points)
    dataset.attrs["units"] = "m"
    dataset.attrs["long_name"] = f"{profile.kind} profile {profile.name}: y, z"
    for fact in ("name", "kind", "source", "inclination"):
        dataset.attrs[fact] = getattr(profile, fact)
    dataset.attrs["notes"] = "\n".join(profile.notes)
