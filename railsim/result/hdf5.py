"""The result file: HDF5 that xarray, h5py, MATLAB and HDFView read.

Layout: one dataset a quantity at the root, with dimension scales attached and the attributes
``units``, ``long_name`` and ``comment`` (the sign convention); names of wheelsets, sides, bodies
and components are dimension scales themselves; facts about the run are root attributes; the
group ``profiles`` holds the points of every profile that was used, further groups hold arrays
without dimensions of their own, such as the state at the end.

Names are stored as fixed-length UTF-8 with the attribute ``_Encoding``: h5py, MATLAB's h5read and
HDFView read them as they are, and xarray decodes them.  Attributes are variable-length UTF-8
strings, which h5py returns as `str` and which may be longer than 64 kB, as an input text can be.

A file is written under a hidden name beside its target and gets its own name only when it is
whole.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import h5py
import numpy as np

from railsim.errors import Fault, InputError
from railsim.files import check_file, partial_path
from railsim.notation import EXTREMES, QUANTITIES, Quantity
from railsim.profiles.profile import Profile
from railsim.result.data import Array, Attributes, FrozenArrays, Result, frozen
from railsim.result.sinks import (
    ALWAYS,
    FORMAT,
    NOTHING,
    SinkContext,
    full_coordinates,
    root_attributes,
    timed,
)

PEAKS = "peaks"  # group of largest and smallest values over all steps
CHUNK_BYTES = 2**18
# what the result of every run holds
ATTRIBUTES = ("status", "vehicle_toml", "track_toml", "settings_json")
ARRAYS = ("time", "distance")
DIMENSIONS = ("wheelset", "side", "body")
ROWS_AT_ONCE = 2048  # of the coach 4 MB


class Hdf5Sink(SinkContext):
    """Streams chunks to a result file.

    The file is created at once beside its target under a hidden name, so that an output that
    cannot be written is known before anything is computed.

    Parameters
    ----------
    path : str or Path
        Result file.
    overwrite : bool
        Replace an existing file.
    attributes : mapping
        Root attributes to add to those of the run.
    option : str
        What the user knows the path by, for messages.

    Raises
    ------
    InputError : the file exists and may not be overwritten, or cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        overwrite: bool = False,
        attributes: Attributes = NOTHING,
        option: str = "--out",
    ) -> None:
        self.path = Path(path)
        check_file(self.path, overwrite=overwrite, option=option)
        self._attributes = dict(attributes)
        self._partial = partial_path(self.path, os.getpid())
        self._quantities: dict[str, Quantity] = {}
        self._datasets: dict[str, h5py.Dataset] = {}
        self._blocks: dict[str, Array] = {}  # what waits to be written, by quantity
        self._waiting = 0
        self._length = 0
        try:
            # what is written is not read again: HDF5 need not keep chunks, by itself 8 MB of each
            # quantity
            self._file = h5py.File(self._partial, "w", track_order=True, rdcc_nbytes=0)
        except OSError as error:
            fault = Fault(option, "", f"cannot write {self.path} ({error})", "choose another place")
            raise InputError([fault]) from None
        except BaseException:  # an interrupt, before a `with` can see to it
            self._partial.unlink(missing_ok=True)
            raise

    def begin(
        self, coordinates: Mapping[str, Sequence[str]], quantities: Iterable[Quantity] = ALWAYS
    ) -> None:
        """See `Sink.begin`."""
        self._quantities = {quantity.name: quantity for quantity in quantities}
        names = full_coordinates(coordinates)
        for dim, labels in names.items():
            _write_names(self._file, dim, labels)
        for quantity in sorted(self._quantities.values(), key=lambda q: q.name != "time"):
            if "time" in quantity.dims:
                inner = tuple(len(names[dim]) for dim in quantity.dims[1:])
                self._datasets[quantity.name] = _create(self._file, quantity, inner)
                self._blocks[quantity.name] = np.empty((ROWS_AT_ONCE, *inner))

    def append(self, chunk: Mapping[str, Array]) -> None:
        """See `Sink.append`; rows wait until they are worth writing."""
        rows, done = len(chunk["time"]), 0
        while done < rows:
            count = min(rows - done, ROWS_AT_ONCE - self._waiting)
            for name, block in self._blocks.items():
                block[self._waiting : self._waiting + count] = chunk[name][done : done + count]
            done += count
            self._waiting += count
            if self._waiting == ROWS_AT_ONCE:
                self._write_waiting()

    def _write_waiting(self) -> None:
        length = self._length + self._waiting
        for name, dataset in self._datasets.items():
            dataset.resize(length, axis=0)
            dataset[self._length : length] = self._blocks[name][: self._waiting]
        self._length, self._waiting = length, 0

    def close(
        self,
        attributes: Attributes,
        statics: Mapping[str, Any] = NOTHING,
        profiles: Mapping[str, Profile] = NOTHING,
        groups: Mapping[str, Mapping[str, Any]] = NOTHING,
    ) -> Result:
        """See `Sink.close`; the file now has its name."""
        self._write_waiting()
        for name, quantity in self._quantities.items():
            if "time" not in quantity.dims:
                dataset = self._file.create_dataset(name, data=frozen(statics[name]))
                _describe(dataset, quantity)
        for name, profile in profiles.items():
            _write_profile(self._file, name, profile)
        for group, arrays in groups.items():
            for name, array in arrays.items():
                self._file.create_dataset(f"{group}/{name}", data=frozen(array))
            if group == PEAKS:
                _describe_peaks(self._file[group], self._file)
        self._file.attrs.update(root_attributes(self._attributes, attributes))
        self._file.close()
        os.replace(self._partial, self.path)
        return open_result(self.path)

    def abort(self) -> None:
        """Remove what was written so far; harmless after `close`."""
        try:
            self._file.close()
        finally:
            self._partial.unlink(missing_ok=True)


def write(result: Result, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write a result to a file; see `Result.to_hdf5`."""
    with Hdf5Sink(path, overwrite=overwrite, option=str(path)) as sink:
        sink.begin(result.coordinates, result.quantities.values())
        sink.append({name: result[name] for name in timed(result.quantities)})
        statics = {
            name: result[name] for name in result if "time" not in result.quantities[name].dims
        }
        sink.close(result.attributes, statics, result.profiles, result.groups)
    return sink.path


def open_result(path: str | Path) -> Result:
    """Open a result file; its arrays are read when they are first asked for.

    Parameters
    ----------
    path : str or Path
        File that `railsim run`, `railsim study` or `Result.to_hdf5` wrote.

    Raises
    ------
    InputError : there is no such file, or it is not a result of railsim.
    """
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "there is no such file"
        raise InputError([Fault(str(path), "", found, "give a result file (.h5)")])
    try:
        with h5py.File(path, "r") as file:
            return _read(file, path)
    except OSError as error:
        fault = Fault(str(path), "", f"not an HDF5 file ({error})", "give a result of railsim")
        raise InputError([fault]) from None


def open_run(path: str | Path) -> Result:
    """Open the result of a run, as `open_result`, and see that nothing is missing.

    Raises
    ------
    InputError : as `open_result`; the file lacks what the result of every run holds.
    """
    result = open_result(path)
    missing = [name for name in ATTRIBUTES if name not in result.attributes]
    missing += [name for name in ARRAYS if name not in result.quantities]
    missing += [name for name in DIMENSIONS if name not in result.coordinates]
    if missing:
        allowed = "a result as railsim wrote it"
        raise InputError([Fault(str(path), name, "missing", allowed) for name in missing])
    return result


def _read(file: h5py.File, path: Path) -> Result:
    found = file.attrs.get("format", "nothing")
    if not (isinstance(found, str) and found == FORMAT):
        fault = Fault(str(path), "format", f"found {found}", f"a result says '{FORMAT}'")
        raise InputError([fault])
    quantities: dict[str, Quantity] = {}
    coordinates: dict[str, tuple[str, ...]] = {}
    profiles: dict[str, Profile] = {}
    groups: dict[str, Mapping[str, Array]] = {}
    for name, member in file.items():
        if isinstance(member, h5py.Group) and name != "profiles":
            groups[name] = {
                key: array[()] for key, array in member.items()
                if not h5py.check_string_dtype(array.dtype)
            }
        elif isinstance(member, h5py.Group):
            profiles |= {unquote(key): _profile(dataset) for key, dataset in member.items()}
        elif h5py.check_string_dtype(member.dtype):
            coordinates[name] = tuple(member.asstr()[()])
        else:
            quantities[name] = _quantity(name, member)
    # whole numbers come as numpy's: JSON knows Python's only
    facts = {name: v.item() if isinstance(v, np.generic) else v for name, v in file.attrs.items()}
    return Result(
        StoredArrays(path, quantities), quantities, coordinates, facts, profiles, groups
    )


class StoredArrays(FrozenArrays):
    """Arrays of a result file, each read when it is first asked for.

    Parameters
    ----------
    path : Path
        The file; it is not kept open.
    names : iterable of str
        Names of the arrays.
    """

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        super().__init__({})
        self._path = path.resolve()
        self._names = tuple(names)

    def __getitem__(self, name: str) -> Array:
        if name not in self._loaded:
            if name not in self._names:
                raise KeyError(name)
            with h5py.File(self._path, "r") as file:
                self._loaded[name] = frozen(file[name][()])
        return self._loaded[name]

    def part(self, name: str, rows: slice) -> Array:
        """Return some rows of an array; only these are read."""
        if name in self._loaded:
            return self._loaded[name][rows]
        with h5py.File(self._path, "r") as file:
            return frozen(file[name][rows])

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _write_names(file: h5py.Group, dim: str, labels: Sequence[str]) -> None:
    encoded = [label.encode() for label in labels]
    kind = h5py.string_dtype("utf-8", max((len(label) for label in encoded), default=1))
    dataset = file.create_dataset(dim, data=np.array(encoded, dtype=kind))
    dataset.attrs["_Encoding"] = "utf-8"
    dataset.attrs["long_name"] = f"name of the {dim}"
    dataset.make_scale(dim)


def _create(file: h5py.File, quantity: Quantity, inner: tuple[int, ...]) -> h5py.Dataset:
    rows = max(1, CHUNK_BYTES // (8 * max(1, int(np.prod(inner)))))
    dataset = file.create_dataset(
        quantity.name,
        shape=(0, *inner),
        maxshape=(None, *inner),
        chunks=(min(rows, 1024), *(max(1, size) for size in inner)),
        dtype=np.float64,
    )
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
    """Units, names and dimensions of largest and smallest values, their times and places."""
    _write_names(group, "extreme", EXTREMES)
    for name, dataset in group.items():
        if name == "extreme":
            continue
        base = name.removesuffix("_time").removesuffix("_distance")
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


def _quantity(name: str, dataset: h5py.Dataset) -> Quantity:
    """Return the quantity of a dataset: from the notation, else from what the file says."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    dims = tuple(scale.keys()[0] if len(scale) else "" for scale in dataset.dims)
    facts = dataset.attrs
    unit = str(facts.get("units", "1"))
    return Quantity(
        name=name,
        long_name=str(facts.get("long_name", name)),
        symbol=str(facts.get("symbol", "")),
        unit=unit,
        dims=dims,
        shown_unit=str(facts.get("shown_units", unit)),
        scale=float(facts.get("shown_scale", 1.0)),
        sign=str(facts.get("comment", "")),
    )


def _write_profile(file: h5py.File, name: str, profile: Profile) -> None:
    points = np.column_stack([profile.y, profile.z])
    dataset = file.create_dataset(f"profiles/{quote(name, safe=' ')}", data=points)
    dataset.attrs["units"] = "m"
    dataset.attrs["long_name"] = f"{profile.kind} profile {profile.name}: y, z"
    for fact in ("name", "kind", "source", "inclination"):
        dataset.attrs[fact] = getattr(profile, fact)
    dataset.attrs["notes"] = "\n".join(profile.notes)


def _profile(dataset: h5py.Dataset) -> Profile:
    points, facts = dataset[()], dataset.attrs
    return Profile(
        name=facts["name"],
        kind=facts["kind"],
        y=points[:, 0],
        z=points[:, 1],
        source=facts["source"],
        inclination=float(facts["inclination"]),
        notes=tuple(facts["notes"].splitlines()),
    )
