"""What is written to a new result file, by HDF5's own calls.

Most of the time that a small result takes to write was h5py's, which looks up names, types and
places anew at each access, and the digest's, which read everything again.
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5ds, h5p, h5s, h5t

from railsim.arrays import Floats
from railsim.result.attributes import Values, write_attributes
from railsim.result.integrity import DIGEST, Facts, digest

NOTHING: Values = MappingProxyType({})
Shape = tuple[int, ...]


@dataclass
class Dataset:
    """A dataset that is being written."""

    place: h5d.DatasetID  # HDF5's identifier
    dtype: np.dtype[Any]
    attributes: Values
    crc: int = 0  # CRC-32 of what is written

    def write(self, array: np.ndarray[Any, Any]) -> None:
        """Write all values."""
        self.place.write(h5s.ALL, h5s.ALL, array)
        self.crc = zlib.crc32(array.tobytes())

    def append(self, rows: Floats) -> None:
        """Write further rows of a dataset that may grow."""
        rows = np.ascontiguousarray(rows, dtype=self.dtype)
        begin, *inner = self.place.shape
        self.place.set_extent((begin + len(rows), *inner))
        space = self.place.get_space()
        space.select_hyperslab((begin, *(0 for _ in inner)), rows.shape)
        self.place.write(h5s.create_simple(rows.shape), space, rows)
        self.crc = zlib.crc32(rows.data, self.crc)

    def facts(self) -> Facts:
        """Return what the digest covers."""
        return Facts(self.dtype.str, self.place.shape, self.crc, self.attributes)


class Contents:
    """The content of a new file.

    `path`: The file. HDF5 does not keep chunks, by itself 8 MB of each quantity, as what is written
    is not read again, and does not lock the file.
    """

    def __init__(self, path: Path) -> None:
        options = {"track_order": True, "rdcc_nbytes": 0, "locking": False}
        self._file = h5py.File(path, "w", **options)
        self._datasets: dict[str, Dataset] = {}
        self._groups: set[str] = set()

    def create(
        self, name: str, shape: Shape, dtype: np.dtype[Any], attributes: Values = NOTHING,
        dims: Sequence[str] = (), *, chunks: Shape = (), growing: bool = False,
        compress: bool = False,
    ) -> Dataset:  # fmt: skip
        """Create a dataset, with checksums where it has chunks.

        `dims`: Names of the scales of its dimensions; a dataset is the scale of its own name.
        `growing`: Whether its first dimension has no limit. `compress`: Without loss.
        """
        creation = h5p.create(h5p.DATASET_CREATE)
        creation.set_obj_track_times(False)
        if chunks:
            creation.set_chunk(chunks)
            if compress:
                creation.set_shuffle()
                creation.set_deflate(4)
            creation.set_fletcher32()
        if (group := name.rpartition("/")[0]) and group not in self._groups:
            self._file.create_group(group)
            self._groups.add(group)
        links = h5p.create(h5p.LINK_CREATE)
        links.set_char_encoding(h5t.CSET_ASCII if name.isascii() else h5t.CSET_UTF8)
        space = h5s.create_simple(shape, (h5s.UNLIMITED, *shape[1:]) if growing else shape)
        kind = h5t.py_create(dtype, logical=True)
        place = h5d.create(self._file.id, name.encode(), kind, space, creation, links)
        write_attributes(place, attributes)
        for axis, dim in enumerate(dims):
            if dim == name:
                h5ds.set_scale(place, dim.rpartition("/")[2].encode())
            else:
                h5ds.attach_scale(place, self._datasets[dim].place, axis)
        self._datasets[name] = Dataset(place, dtype, attributes)
        return self._datasets[name]

    def store(
        self, name: str, array: Any, attributes: Values = NOTHING, dims: Sequence[str] = ()
    ) -> None:
        """Store a whole array."""
        array = np.asarray(array, order="C")
        chunks = array.shape if array.size else ()
        self.create(name, array.shape, array.dtype, attributes, dims, chunks=chunks).write(array)

    def finish(self, attributes: Values) -> None:
        """Write the root attributes and the digest of everything, and close the file."""
        facts = {name: dataset.facts() for name, dataset in self._datasets.items()}
        write_attributes(self._file.id, {**attributes, DIGEST: digest(attributes, facts)})
        self._file.flush()  # where the disk is full, before the file is closed
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()
