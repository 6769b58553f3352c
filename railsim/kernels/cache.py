"""What is kept on disk between runs: compiled code and contact tables.

Compiled code is loaded and executed.  So nothing is taken from a folder or a file that another
user could have written, and nothing that is not, byte for byte, what was stored: every file begins
with the length and CRC-32 of the rest.  A folder that is refused, cannot be written to or is full
costs time, never the run; `notices` reports it once.

A folder that can only be read is used as it is, when it belongs to this user or to root.
"""

import logging
import os
import re
import stat
import tempfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

notices: dict[str, None] = {}
"""What the user should know of the cache, each sentence once."""

_LOG = logging.getLogger("railsim")
_HEAD = re.compile(rb"railsim-cache ([0-9a-f]{8}) ([0-9]{15})\n")
_HEAD_BYTES = 39
_unwritable: set[Path] = set()


def notice(sentence: str) -> None:
    """Say something about the cache, once."""
    if sentence not in notices:
        notices[sentence] = None
        _LOG.warning(sentence)


def cache_base() -> Path | None:
    """Return $RAILSIM_CACHE_DIR or the user's cache folder; None where a user has no home."""
    given = os.environ.get("RAILSIM_CACHE_DIR")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return None if base.startswith("~") else Path(base) / "railsim"


def safe_folder(folder: Path | None) -> Path | None:
    """Return a folder of the cache, made if it is not there; None where it must not be used.

    Parameters
    ----------
    folder : Path or None
        The folder; it and what it is made in are for this user only (0700).
    """
    if folder is None:
        return None
    try:
        if not folder.exists():
            os.makedirs(folder.parent, mode=0o700, exist_ok=True)
            os.makedirs(folder, mode=0o700, exist_ok=True)
        folder = folder.resolve()
        for path in (folder, *folder.parents):
            if reason := _distrust(path, below=path != folder):
                notice(
                    f"the cache {folder} is not used: {reason}; remove it, or choose another by "
                    "RAILSIM_CACHE_DIR"
                )
                return None
    except (OSError, RuntimeError) as error:
        words = getattr(error, "strerror", None) or error
        notice(f"the cache {folder} cannot be used ({words}); compiled code is not kept")
        return None
    with suppress(OSError):
        if folder.stat().st_uid == os.geteuid() and stat.S_IMODE(folder.stat().st_mode) != 0o700:
            folder.chmod(0o700)
    if not os.access(folder, os.W_OK):
        _unwritable.add(folder)
    return folder


def _distrust(path: Path, *, below: bool = False) -> str:
    """Say why another user could have written into a folder, or to what lies below it."""
    facts = os.lstat(path)
    if facts.st_uid not in (os.geteuid(), 0):
        return f"{path} belongs to another user"
    others = facts.st_mode & stat.S_IWOTH
    # a group of the same number as its user is that user's own
    group = facts.st_mode & stat.S_IWGRP and facts.st_gid not in (0, facts.st_uid)
    if (others or group) and not (below and facts.st_mode & stat.S_ISVTX):
        return f"other users may write to {path}"
    return ""


def stored(path: Path) -> bytes | None:
    """Return what was stored under a name; None where there is nothing, or it is damaged."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        with open(handle, "rb") as file:
            facts = os.fstat(file.fileno())
            if not stat.S_ISREG(facts.st_mode) or facts.st_uid not in (os.geteuid(), 0):
                return None
            head, data = _HEAD.fullmatch(file.read(_HEAD_BYTES)), file.read()
    except OSError:
        return None
    if head and (int(head[1], 16), int(head[2])) == (zlib.crc32(data), len(data)):
        return data
    discard(path)
    return None


def discard(path: Path) -> None:
    """Remove a damaged file of the cache, and say so."""
    notice(f"the cache {path.parent} was damaged; what was lost is made again")
    with suppress(OSError):
        path.unlink()


def store(path: Path, data: bytes) -> None:
    """Store data under a name, unless the folder cannot be written to."""

    def write(handle: int) -> None:
        with open(handle, "wb", closefd=False) as file:
            file.write(b"railsim-cache %08x %015d\n" % (zlib.crc32(data), len(data)))
            file.write(data)

    store_file(path, write)


def store_file(path: Path, write: Callable[[int], None]) -> bool:
    """Store what `write` puts into an open file; return whether it is there."""
    if path.parent in _unwritable:
        return False
    name = None
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name[:100], suffix=".part")
        try:
            write(handle)
        finally:
            os.close(handle)
        os.replace(name, path)
    except OSError as error:
        _unwritable.add(path.parent)
        notice(
            f"the cache {path.parent} cannot be written ({error.strerror or error}); the next "
            "run prepares itself again"
        )
        return False
    except BaseException:
        if name is not None:
            Path(name).unlink(missing_ok=True)
        raise
    finally:
        if name is not None:
            with suppress(OSError):
                Path(name).unlink(missing_ok=True)
    return True
