"""How a result file shows that it is as it was written.

Three nets, from coarse to fine:

- the **seal**, the last line of the file, behind what HDF5 itself uses: length and CRC-32 of all
  bytes before it.  A file is checked against it before HDF5 looks at anything;
- the **digest**, the root attribute ``digest``: SHA-256 over name, type, shape, CRC-32 of the
  values and attributes of every dataset, and over the root attributes.  It outlives a copy by other
  programs (``h5repack``), which drop the seal;
- the checksum of every chunk (HDF5's filter ``fletcher32``), which every HDF5 reader looks at.

They find accidents, not forgery: whoever changes a file on purpose can compute them again.
"""

import hashlib
import json
import re
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from railsim.errors import input_error
from railsim.result.attributes import read_attribute

DIGEST = "digest"
REMEDY = "it is damaged or was changed since it was written; run it again"
# attributes that HDF5 and netCDF keep for themselves; and the digest is not part of itself
_INTERNAL = ("_", "CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", DIGEST)
_SEAL = re.compile(rb"railsim-seal crc32 ([0-9a-f]{8}) of ([0-9]{20}) bytes\n")
_SEAL_BYTES = 58
_BLOCK = 2**20


def seal(path: Path) -> None:
    """Write the seal behind the last byte of a file."""
    crc, length = _file_crc(path, path.stat().st_size)
    with open(path, "ab") as file:
        file.write(b"railsim-seal crc32 %08x of %020d bytes\n" % (crc, length))


def has_seal(path: Path) -> bool:
    """Whether a file has a seal; then it is as it was written.

    Raises InputError: what it holds is not what its seal says. Raises OSError: it cannot be read.
    """
    size = path.stat().st_size
    with open(path, "rb") as file:
        file.seek(max(0, size - _SEAL_BYTES))
        match = _SEAL.fullmatch(file.read())
    if not match:
        return False
    if (int(match[1], 16), int(match[2])) != _file_crc(path, size - _SEAL_BYTES):
        raise input_error(path, "its bytes are not those of its seal", REMEDY)
    return True


def _file_crc(path: Path, length: int) -> tuple[int, int]:
    crc, done = 0, 0
    with open(path, "rb") as file:
        while done < length and (block := file.read(min(_BLOCK, length - done))):
            crc = zlib.crc32(block, crc)
            done += len(block)
    return crc, done


@dataclass(frozen=True)
class Facts:
    """What the digest covers of a dataset."""

    kind: str  # of its values, as numpy writes it
    shape: Sequence[int]
    crc: int  # CRC-32 of its values
    attributes: Mapping[str, Any]


def digest(attributes: Mapping[str, Any], datasets: Mapping[str, Facts]) -> str:
    """Return the digest of the root attributes and all datasets of a file."""
    sha = hashlib.sha256(_text(attributes).encode())
    for name, dataset in sorted(datasets.items()):
        facts = json.dumps([name, dataset.kind, list(dataset.shape), f"{dataset.crc:08x}"])
        sha.update(f"{facts} {_text(dataset.attributes)}\n".encode())
    return f"sha256:{sha.hexdigest()}"


def content_digest(file: h5py.File) -> str:
    """Return the digest of what an open result file holds, all of whose links are its own."""
    return digest(_attributes(file), dict(_datasets(file)))


def _datasets(group: h5py.Group, above: str = "") -> Iterator[tuple[str, Facts]]:
    for name, member in group.items():
        if isinstance(member, h5py.Dataset):
            crc = zlib.crc32(member[()].tobytes())
            yield above + name, Facts(member.dtype.str, member.shape, crc, _attributes(member))
        else:
            yield from _datasets(member, f"{above}{name}/")


def _attributes(holder: h5py.File | h5py.Dataset) -> dict[str, Any]:
    names = [name for name in holder.attrs if not name.startswith(_INTERNAL)]
    return {name: read_attribute(holder, name) for name in names}


def _text(attributes: Mapping[str, Any]) -> str:
    """Return attributes as text, the same before and after they were stored."""
    public = {name: value for name, value in attributes.items() if not name.startswith(_INTERNAL)}
    plain = {n: v if isinstance(v, str) else np.asarray(v).tolist() for n, v in public.items()}
    return json.dumps(plain, sort_keys=True)
