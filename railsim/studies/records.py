"""Records of finished work as JSON; in files of their own with a CRC-32, so that damage is seen."""

import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import orjson

from railsim.errors import InputError
from railsim.files.access import TABLE_BYTES, make_folder, read_text, write_text
from railsim.text import plain

Record = dict[str, Any]


def write_record(path: Path, record: Record) -> None:
    """Write a record; its folder is created if it does not exist."""
    make_folder(path.parent)
    write_text(path, json.dumps({"crc32": _crc(record), "record": record}))


def stored_record(path: Path | None, remark: Callable[[str], None]) -> Record | None:
    """Return a record stored before, if any; one that is damaged is removed, with a remark."""
    if path is None or not path.exists():
        return None
    reason = f"{path}: the record is damaged"
    try:
        content = json.loads(read_text(path, TABLE_BYTES))
        record: Record = content["record"]
        if content["crc32"] == _crc(record):
            return record
    except InputError as error:
        reason = str(error)
    except (ValueError, TypeError, KeyError, RecursionError):
        pass
    remark(f"{reason}: it is computed again")
    path.unlink()
    return None


def _crc(record: Any) -> str:
    # writing reproduces what was read: order and all digits of numbers are kept
    return f"{zlib.crc32(json.dumps(record).encode()):08x}"


def parse_json(text: bytes) -> Any:
    """Return what JSON holds; raises ValueError: it is broken, or nested too deeply."""
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        try:
            return json.loads(text)  # names of files that are no UTF-8
        except RecursionError as error:
            raise ValueError(str(error)) from None


def json_bytes(data: Any) -> bytes:
    """Return data as one line of JSON; infinite and undefined numbers become null."""
    try:
        return orjson.dumps(data)
    except TypeError:  # names of files that are no UTF-8
        return json.dumps(plain(data), separators=(",", ":")).encode()
