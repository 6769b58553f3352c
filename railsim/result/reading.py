"""Reading result files: everything that is wrong with one is an input error with file and dataset.

A file is checked against its seal before HDF5 sees it (`railsim.result.integrity`), and against its
digest where the seal is missing.  Then every link, type, shape and attribute is looked at before
anything is read: a file from somebody else cannot point to another file, and takes no more memory
than it has bytes on the disk.  Arrays are read when they are asked for.
"""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote
from weakref import WeakValueDictionary

import h5py
import numpy as np
from h5py import h5d, h5g, h5l, h5o, h5s

from railsim.arrays import Floats
from railsim.errors import Fault, Faults, InputError, input_error
from railsim.files.access import is_file
from railsim.notation import EXTREMES, QUANTITIES, Quantity
from railsim.profiles.profile import Profile
from railsim.result.attributes import read_attribute
from railsim.result.data import FrozenArrays, Result, frozen
from railsim.result.integrity import DIGEST, REMEDY, content_digest, has_seal
from railsim.result.sinks import FORMAT, peak_quantity
from railsim.text import shortened

# what the result of every run holds
ATTRIBUTES = ("status", "vehicle_toml", "track_toml", "settings_json")
ARRAYS = ("time", "distance")
DIMENSIONS = ("wheelset", "side", "body")
NUMBERS = (
    "speed", "start", "duration", "evaluation_start", "requested_duration",
    "requested_until", "step", "wall_time", "cpu_time", "real_time_factor",
    "patches_evaluated", "patches_out_of_range", "hunting_frequency", "hunting_amplitude",
)  # fmt: skip
STATES = ("complete", "derailed", "stopped")

OLDER = {
    "railsim-result/1": "The file has the older format railsim-result/1: wheelset_lateral and "
    "wheelset_roll are relative to the design track, on elastic rails less the deflection of the "
    "rails, instead of relative to the irregular rails."
}
"""Older formats that are read, and the remark on what they hold."""

MOST_MEMBERS = 1000
FILTERS = {h5py.h5z.FILTER_FLETCHER32, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE}
DEFLATE_RATIO = 100  # what compression may save at most, over the whole file
SPARE_BYTES = 64_000_000  # and what may be saved beyond, for constant quantities
MOST_HELD = 64_000_000  # of arrays that were read, beside those in use
AS_WRITTEN = "a result as railsim wrote it"


def open_result(path: str | Path) -> Result:
    """Open a result file; its arrays are read when they are first asked for.

    `path`: File that `railsim run`, `railsim study` or `Result.to_hdf5` wrote. Raises InputError:
    there is no such file, it is not a result of railsim, or it is damaged.
    """
    return open_checked(Path(path))


def open_checked(path: Path, *, just_sealed: bool = False) -> Result:
    """Open a result file as `open_result`; `just_sealed`: its seal need not be looked at again."""
    if not is_file(path):
        found = "not a regular file" if os.path.lexists(path) else "there is no such file"
        found = "a folder" if os.path.isdir(path) else found
        raise input_error(path, found, "give a result file (.h5)")
    with _readable(path):
        if path.stat().st_size == 0:
            raise input_error(path, "the file is empty", AS_WRITTEN)
        stamp = _stamp(os.stat(path))
        whole = just_sealed or has_seal(path)
        with h5py.File(path, "r") as file:
            _refuse_another(path, file, stamp)
            return _Reader(file, path, stamp).result(whole=whole)


def open_run(path: str | Path) -> Result:
    """Open the result of a run, as `open_result`, and see that nothing is missing.

    Raises InputError: As `open_result`; the file lacks what the result of every run holds.
    """
    result = open_result(path)
    missing = [name for name in ATTRIBUTES if name not in result.attributes]
    missing += [name for name in ARRAYS if name not in result.quantities]
    missing += [name for name in DIMENSIONS if name not in result.coordinates]
    Faults(Fault(str(path), name, "missing", AS_WRITTEN) for name in missing).check()
    if result.status not in STATES:
        raise input_error(path, f"'{result.status}'", f"allowed: {', '.join(STATES)}", "status")
    for name in ARRAYS:
        if not np.all(np.isfinite(result[name])):
            raise input_error(path, "holds what is not finite", REMEDY, name)
    if np.any(np.diff(result["time"]) <= 0.0):
        raise input_error(path, "does not increase", REMEDY, "time")
    return result


def check_result(path: str | Path) -> Result:
    """Open the result of a run, as `open_run`, and read all of it.

    Raises InputError: As `open_run`; every array and every input that cannot be used.
    """
    result, faults = open_run(path), Faults()
    reads: list[Callable[[], object]] = [result.vehicle, result.track, result.settings]
    reads += [partial(result.__getitem__, name) for name in result]
    for read in reads:
        with faults.caught():
            read()
    faults.check()
    return result


class _Recent:
    """Arrays that were read last, of all results: many results do not fill the memory.

    `most`: How much is held on to [bytes].
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._arrays: deque[Floats] = deque()
        self._bytes = 0

    def add(self, array: Floats) -> None:
        self._arrays.append(array)
        self._bytes += array.nbytes
        while self._bytes > self.most and len(self._arrays) > 1:
            self._bytes -= self._arrays.popleft().nbytes


_recent = _Recent(MOST_HELD)


class StoredArrays(FrozenArrays):
    """Arrays of a result file, each read when it is asked for and not in memory still.

    `path`: The file; it is not kept open. `shapes`: Shapes of the arrays by their names. `stamp`:
    What tells the file from another of its name.
    """

    def __init__(
        self, path: Path, shapes: Mapping[str, tuple[int, ...]], stamp: tuple[int, ...]
    ) -> None:
        self._loaded: MutableMapping[str, Floats] = WeakValueDictionary()
        self._path = path
        self._absolute = path.absolute()
        self._shapes = dict(shapes)
        self._stamp = stamp

    def __getitem__(self, name: str) -> Floats:
        array = self._loaded.get(name)
        if array is None:
            if name not in self._shapes:
                raise KeyError(name)
            array = self._loaded[name] = self._read(name)
            _recent.add(array)
        return array

    def part(self, name: str, rows: slice) -> Floats:
        """Return some rows of an array; only these are read."""
        array = self._loaded.get(name)
        return self._read(name, rows) if array is None else array[rows]

    def _read(self, name: str, rows: slice | tuple[()] = ()) -> Floats:
        with _readable(self._path, name), h5py.File(self._absolute, "r") as file:
            _refuse_another(self._path, file, self._stamp)
            return frozen(file[name][rows])

    def __contains__(self, name: object) -> bool:
        return name in self._shapes  # nothing is read

    def __iter__(self) -> Iterator[str]:
        return iter(self._shapes)

    def __len__(self) -> int:
        return len(self._shapes)


def _stamp(facts: os.stat_result) -> tuple[int, ...]:
    return facts.st_dev, facts.st_ino, facts.st_size, facts.st_mtime_ns


def _refuse_another(path: Path, file: h5py.File, stamp: tuple[int, ...]) -> None:
    """Refuse a file that has taken the place of the one with the stamp, or was changed."""
    if _stamp(os.fstat(file.id.get_vfd_handle())) != stamp:
        raise input_error(path, "was replaced or changed after it was opened", "open it again")


@contextmanager
def _readable(path: Path, name: str = "") -> Iterator[None]:
    """Refuse what cannot be read within the block: HDF5 and h5py raise every kind of exception."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split())
        if isinstance(error, OSError) and error.errno is not None and error.strerror:
            reason = os.strerror(error.errno)
        reason = shortened(reason, 160)
        is_hdf5 = isinstance(error, OSError) and "signature not found" in reason
        found = "not an HDF5 file" if is_hdf5 else f"cannot be read ({reason})"
        allowed = "give a result file of railsim (.h5)"
        allowed += "" if is_hdf5 and path.suffix != ".h5" else f"; {REMEDY}"
        raise input_error(path, found, allowed, name) from None


class _Dataset(NamedTuple):
    """A dataset of plain numbers or names that has been looked at."""

    place: h5d.DatasetID
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    @property
    def is_text(self) -> bool:
        return self.dtype.kind == "S"

    def values(self) -> np.ndarray[Any, Any]:
        array = np.empty(self.shape, dtype=self.dtype)
        self.place.read(h5s.ALL, h5s.ALL, array)
        return array

    def as_h5py(self) -> h5py.Dataset:
        return h5py.Dataset(self.place)


@dataclass
class _Reader:
    """Looks at every member of an open file before it is read."""

    _file: h5py.File
    _path: Path
    _stamp: tuple[int, ...]
    _declared: int = 0  # bytes that arrays say they have

    def fault(self, name: str, found: str, allowed: str = AS_WRITTEN) -> InputError:
        return input_error(self._path, found, allowed, name)

    def result(self, *, whole: bool) -> Result:
        file = self._file
        facts = self._attributes(file, "")
        version = facts.get("format")
        if version not in (FORMAT, *OLDER):
            raise self.fault("format", f"found {version or 'nothing'}", f"a result says '{FORMAT}'")
        members = dict(self._members(file, ""))
        groups = {name: group for name, group in members.items() if isinstance(group, h5py.Group)}
        inner = {name: dict(self._members(group, f"{name}/")) for name, group in groups.items()}
        for name, inner_members in inner.items():
            for key, member in inner_members.items():
                if not isinstance(member, _Dataset):
                    raise self.fault(f"{name}/{key}", "a group within a group")
        size = self._path.stat().st_size
        if self._declared > DEFLATE_RATIO * size + SPARE_BYTES:
            found = f"its arrays say {self._declared / 1e9:.3g} GB, it has {size / 1e6:.3g} MB"
            raise self.fault("", found, REMEDY)
        if not whole and DIGEST not in facts:
            raise self.fault(DIGEST, "missing", REMEDY)
        if not whole and facts[DIGEST] != content_digest(file):
            raise self.fault(DIGEST, "what it holds is not what its digest says", REMEDY)
        facts.pop(DIGEST, None)
        self._check_facts(facts)
        if version in OLDER:
            remarks = [*str(facts.get("remarks", "")).splitlines(), OLDER[version]]
            facts["remarks"] = "\n".join(dict.fromkeys(remarks))
        datasets = {name: d for name, d in members.items() if name not in groups}
        coordinates, quantities = self._inventory(datasets)
        stored_profiles = inner.pop("profiles", {}).items()
        profiles = {unquote(k): self._profile(f"profiles/{k}", p) for k, p in stored_profiles}
        arrays: dict[str, dict[str, Floats]] = {}
        for group, inner_members in inner.items():
            numbers = {key: d for key, d in inner_members.items() if not d.is_text}
            arrays[group] = {k: self._floats(f"{group}/{k}", d) for k, d in numbers.items()}
        self._check_peaks(arrays.get("peaks", {}), quantities, coordinates)
        shapes = {name: datasets[name].shape for name in quantities}
        stored = StoredArrays(self._path, shapes, self._stamp)
        parts = quantities, coordinates, facts, profiles, arrays
        return Result(stored, *parts, source=str(self._path))

    # -- before anything is read ------------------------------------------------------------------

    def _members(self, group: h5py.Group, above: str) -> Iterator[tuple[str, Any]]:
        if len(group) > MOST_MEMBERS:
            raise self.fault(above, f"{len(group)} members", f"{MOST_MEMBERS} at most")
        for name in group:
            with _readable(self._path, above + name):
                hard = group.id.links.get_info(name.encode()).type == h5l.TYPE_HARD
                member = h5o.open(group.id, name.encode()) if hard else None
            if isinstance(member, h5d.DatasetID):
                member = self._dataset(above + name, member)
            elif isinstance(member, h5g.GroupID):
                member = h5py.Group(member)
            else:
                raise self.fault(above + name, "a link or a type instead of a dataset")
            yield name, member

    def _dataset(self, name: str, place: h5d.DatasetID) -> _Dataset:
        """Return a dataset, of plain numbers or names, in this file, as large as it says."""
        creation, dtype, shape = place.get_create_plist(), place.dtype, place.shape
        if creation.get_layout() == h5d.VIRTUAL or creation.get_external_count():
            raise self.fault(name, "its values are in another file")
        filters = {creation.get_filter(index)[0] for index in range(creation.get_nfilters())}
        if not filters <= FILTERS:
            raise self.fault(name, "a filter that railsim does not use")
        text = h5py.check_string_dtype(dtype)
        if dtype.kind not in "fiu" and not (text and text.length):
            raise self.fault(name, f"values of type {dtype}", "numbers or names")
        if not shape:
            raise self.fault(name, "no array")
        declared = math.prod(shape) * dtype.itemsize
        stored = place.get_storage_size()
        if declared > stored and h5py.h5z.FILTER_DEFLATE not in filters:
            raise self.fault(name, f"says {declared} bytes and holds {stored}", REMEDY)
        self._declared += declared
        return _Dataset(place, dtype, shape)

    def _attributes(self, holder: Any, name: str) -> dict[str, Any]:
        """Return attributes as plain values; whole numbers come as numpy's."""
        facts: dict[str, Any] = {}
        for key in holder.attrs:
            if key in ("DIMENSION_LIST", "REFERENCE_LIST"):
                continue
            location = f"{name}.{key}" if name else key
            with _readable(self._path, location):
                value = read_attribute(holder, key)
            value = value.item() if isinstance(value, np.generic) else value
            if isinstance(value, bytes):  # a text of fixed length
                value = value.decode("utf-8", errors="replace")
            if not isinstance(value, str | int | float):
                raise self.fault(location, f"found {str(value)[:60]}", "a text or a number")
            facts[key] = value
        return facts

    def _check_facts(self, facts: Mapping[str, Any]) -> None:
        for name, value in facts.items():
            number = not isinstance(value, str)
            if name in NUMBERS and (not number or math.isnan(value)):
                raise self.fault(name, f"found {str(value)[:60]!r}", "a number")
            if name in (*ATTRIBUTES, "status_reason", "remarks") and number:
                raise self.fault(name, f"found {value}", "a text")

    def _check_peaks(
        self,
        arrays: Mapping[str, Floats],
        quantities: Mapping[str, Quantity],
        coordinates: Mapping[str, tuple[str, ...]],
    ) -> None:
        for name, array in arrays.items():
            base = peak_quantity(name)
            triple = {f"{base}{ending}" for ending in ("", "_time", "_distance")}
            if base not in QUANTITIES or base not in quantities or not triple <= arrays.keys():
                raise self.fault(f"peaks/{name}", "no such quantity, or not all of it is there")
            inner = tuple(len(coordinates.get(dim, ())) for dim in QUANTITIES[base].dims[1:])
            if array.shape != (len(EXTREMES), *inner):
                raise self.fault(f"peaks/{name}", f"its shape is {array.shape}")

    # -- what it holds ----------------------------------------------------------------------------

    def _inventory(
        self, datasets: Mapping[str, _Dataset]
    ) -> tuple[dict[str, tuple[str, ...]], dict[str, Quantity]]:
        texts = {name: dataset for name, dataset in datasets.items() if dataset.is_text}
        coordinates = {name: self._labels(name, dataset) for name, dataset in texts.items()}
        numbers = {name: dataset for name, dataset in datasets.items() if name not in coordinates}
        sizes = {name: len(labels) for name, labels in coordinates.items()}
        if "time" in numbers:
            sizes["time"] = numbers["time"].shape[0]
        quantities = {name: self._quantity(name, dataset) for name, dataset in numbers.items()}
        for name, quantity in quantities.items():
            for dim in quantity.dims:
                if dim not in sizes:
                    raise self.fault(dim or name, "missing" if dim else "a dimension has no name")
            lengths = tuple(sizes[dim] for dim in quantity.dims)
            if numbers[name].shape != lengths:
                found = f"its shape is {numbers[name].shape}"
                raise self.fault(name, found, f"{lengths} along {', '.join(quantity.dims)}")
        return coordinates, quantities

    def _labels(self, name: str, dataset: _Dataset) -> tuple[str, ...]:
        if len(dataset.shape) != 1:
            raise self.fault(name, f"its shape is {dataset.shape}", "a list of names")
        with _readable(self._path, name):
            labels = tuple(text.decode("utf-8") for text in dataset.values().tolist())
        if len(set(labels)) < len(labels):
            raise self.fault(name, "a name occurs twice", REMEDY)
        return labels

    def _quantity(self, name: str, dataset: _Dataset) -> Quantity:
        """Return the quantity of a dataset: from the notation, else from what the file says."""
        if name in QUANTITIES:
            return QUANTITIES[name]
        facts = self._attributes(dataset.as_h5py(), name)
        with _readable(self._path, name):
            dims = tuple(scale.keys()[0] if len(scale) else "" for scale in dataset.as_h5py().dims)
        unit = str(facts.get("units", "1"))
        scale = facts.get("shown_scale", 1.0)
        if isinstance(scale, str) or not math.isfinite(scale):
            raise self.fault(f"{name}.shown_scale", f"found {scale!r}", "a number")
        long_name, symbol = str(facts.get("long_name", name)), str(facts.get("symbol", ""))
        shown_unit, sign = str(facts.get("shown_units", unit)), str(facts.get("comment", ""))
        return Quantity(name, long_name, symbol, unit, dims, shown_unit, float(scale), sign)

    def _floats(self, name: str, dataset: _Dataset) -> Floats:
        if dataset.is_text:
            raise self.fault(name, "names instead of numbers")
        with _readable(self._path, name):
            return frozen(dataset.values())

    def _profile(self, name: str, dataset: _Dataset) -> Profile:
        points, facts = self._floats(name, dataset), self._attributes(dataset.as_h5py(), name)
        if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.isfinite(points)):
            raise self.fault(name, f"its shape is {points.shape}", "finite points y, z")
        kind, inclination = facts.get("kind"), facts.get("inclination")
        if kind not in ("wheel", "rail"):
            raise self.fault(f"{name}.kind", f"found {kind!r}", "wheel or rail")
        if isinstance(inclination, str) or inclination is None or not math.isfinite(inclination):
            raise self.fault(f"{name}.inclination", f"found {inclination!r}", "a number")
        called, source, notes = (str(facts.get(key, "")) for key in ("name", "source", "notes"))
        origin = source, float(inclination), tuple(notes.splitlines())
        return Profile(called, kind, points[:, 0], points[:, 1], *origin)
