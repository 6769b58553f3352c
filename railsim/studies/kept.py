"""Records of finished work as JSON with a CRC-32, so that damaged records are recognised."""

import json
import zlib
from pathlib import Path
from typing import Any

from railsim.errors import Fault, InputError
from railsim.files import TABLE_BYTES, make_folder, read_text, whole_file

Record = dict[str, Any]


def keep(path: Path, record: Record) -> None:
    """Write a record; its folder is created if it does not exist."""
    make_folder(path.parent)
    with whole_file(path) as partial:
        text = json.dumps({"crc32": _crc(record), "record": record})
        partial.write_text(text, encoding="utf-8")


def read_kept(path: Path) -> Record:
    """Return a stored record.

    Raises
    ------
    InputError : the record cannot be read, or is damaged.
    """
    text = read_text(path, TABLE_BYTES)
    try:
        kept = json.loads(text)
        whole = kept["crc32"] == _crc(kept["record"])
    except (ValueError, TypeError, KeyError, RecursionError):
        whole = False
    if not whole:
        raise InputError([Fault(str(path), "", "the record is damaged", "")])
    record: Record = kept["record"]
    return record


def _crc(record: Any) -> str:
    # writing reproduces what was read: order and all digits of numbers are kept
    return f"{zlib.crc32(json.dumps(record).encode()):08x}"
