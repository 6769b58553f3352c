"""What is kept on disk between runs: compiled code and contact tables.

The cache has a folder of its own, `railsim`; each folder that railsim makes there carries a mark.
Nothing without the mark is ever changed or removed, and in folders with it only what railsim has
written.

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
_OWNERS = hasattr(os, "geteuid")  # Windows has lists of access instead, which are not read here
_BINARY = getattr(os, "O_BINARY", 0)
_NO_SYMLINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)

MARK = "CACHEDIR.TAG"  # the name and its first line are known to programs for backups
_MARK_TEXT = b"""Signature: 8a477f597d28d172789f06886806bc55
# This folder was made by railsim, which may change and remove it.
"""
_HASH_NAME = re.compile("[0-9a-f]{16}")
_CACHE_SUFFIXES = (".nbc", ".nbi", ".part", ".lock")
HOUR, MONTH = 3600.0, 30 * 24 * 3600.0


def warn_once(sentence: str) -> None:
    """Warn about the cache, once."""
    if sentence not in notices:
        notices[sentence] = None
        _LOG.warning(sentence)


def cache_subfolder(*names: str, base: Path | None = None) -> Path | None:
    """Return a folder of the cache, made if it is not there; None where none can be used.

    The cache is the folder `railsim` below `base`, else below $RAILSIM_CACHE_DIR, else in the
    user's folder for caches.

    Parameters
    ----------
    *names : str
        Folder in the cache and those below it.
    base : Path, optional
        Where the user wants this part of the cache.
    """
    user_folder = base or os.environ.get("RAILSIM_CACHE_DIR")
    top = Path(user_folder or _user_cache(), "railsim")
    folder = top.joinpath(*names)
    try:
        reason = _prepare(top, names, reserved=not user_folder)
        if not reason:
            folder = folder.resolve()
            reason = _security_fault(folder, top.resolve())
    except (OSError, RuntimeError) as error:
        folder, reason = top, str(getattr(error, "strerror", None) or error)
    if reason:
        warn_once(
            f"the cache {folder} is not used, each start compiles again: {reason}; choose another "
            "folder by RAILSIM_CACHE_DIR"
        )
        return None
    if not os.access(folder, os.W_OK):
        _unwritable.add(folder)
    return folder


def _user_cache() -> Path:
    folder = os.environ.get("XDG_CACHE_HOME", "")
    return Path(folder if os.path.isabs(folder) else os.path.expanduser("~/.cache"))


def _prepare(top: Path, names: tuple[str, ...], *, reserved: bool) -> str:
    """Make the folders of the cache, each for this user only; say why they must not be used.

    In the user's folder for caches the name `railsim` is reserved for railsim (XDG base directory
    specification).  Elsewhere a folder of this name may be anything.
    """
    if reserved and not top.is_absolute():
        return "this user has no home"
    path = top = top.absolute()
    for parent in reversed(top.parents):
        if not parent.is_dir():
            _make(parent)
    _make_marked(top, reserved=reserved)
    if not (reserved or _is_marked(top)):
        return f"{top} is not a cache of railsim's"
    for name in names:
        path /= name
        _make_marked(path)
    return ""


def _make(folder: Path) -> None:
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)


def _make_marked(folder: Path, *, reserved: bool = False) -> None:
    """Make and mark a folder; put right the permissions of one that is marked."""
    _make(folder)
    if reserved or not os.listdir(folder):
        with suppress(OSError):
            handle = os.open(folder / MARK, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, 0o600)
            with open(handle, "wb") as file:
                file.write(_MARK_TEXT)
    facts = folder.stat()
    if not _OWNERS or facts.st_uid != os.geteuid() or facts.st_mode & 0o777 == 0o700:
        return
    if _is_marked(folder):
        with suppress(OSError):
            folder.chmod(0o700)
            if facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
                for index in folder.rglob("*.nbi"):  # numba's own would be loaded as they are
                    index.unlink()


def _is_marked(folder: Path) -> bool:
    return _content(folder / MARK) == _MARK_TEXT


def _security_fault(folder: Path, top: Path) -> str:
    """Say why another user could have written into a folder of the cache."""
    if not _OWNERS:
        in_home = folder.is_relative_to(Path.home().resolve())
        return "" if in_home else f"who may write to {folder} is known of folders of your own only"
    for path in (folder, *folder.parents):
        facts = os.lstat(path)
        if facts.st_uid not in (os.geteuid(), 0):
            return f"{path} belongs to another user"
        by_others = bool(facts.st_mode & stat.S_IWOTH)
        if path == folder or path.is_relative_to(top):
            # a group of the same number as its user is that user's own
            shared = facts.st_gid not in (0, facts.st_uid)
            by_others |= shared and bool(facts.st_mode & stat.S_IWGRP)
        elif facts.st_mode & stat.S_ISVTX:
            by_others = False
        # who shares a group may exchange the folder, but not make one that belongs to this user
        if by_others:
            return f"other users may write to {path}"
    return ""


def remove_old_code(folder: Path) -> None:
    """Remove code of other sources that nobody has used for a month, and files never finished.

    Parameters
    ----------
    folder : Path
        Folder of the sources in use; the others lie beside it.  Another version of railsim may be
        in use there.
    """
    if not _is_marked(folder):
        return
    os.utime(folder / MARK)  # the time of the last use, by the clock of the disk
    now = (folder / MARK).stat().st_mtime
    for part in folder.glob("*.part"):
        if part.stat().st_mtime < now - HOUR:
            part.unlink(missing_ok=True)
    for old in folder.parent.iterdir():
        if not _HASH_NAME.fullmatch(old.name) or old.is_symlink() or not _is_marked(old):
            continue
        if (old / MARK).stat().st_mtime < now - MONTH:
            _remove(old)


def _remove(folder: Path) -> None:
    """Remove from a marked folder what railsim has put there, and the folder if that was all."""
    for where, _, names in os.walk(folder, topdown=False):
        for name in names:
            if name.endswith(_CACHE_SUFFIXES):
                os.unlink(os.path.join(where, name))
        if Path(where) != folder:
            with suppress(OSError):  # not empty
                os.rmdir(where)
    if os.listdir(folder) == [MARK]:
        (folder / MARK).unlink()
        folder.rmdir()


def _content(path: Path) -> bytes | None:
    """Return the content of a regular file that only this user or root can have written."""
    try:
        handle = os.open(path, os.O_RDONLY | _NO_SYMLINK | _BINARY)
        with open(handle, "rb") as file:
            facts = os.fstat(file.fileno())
            by_others = facts.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
            if _OWNERS and (by_others or facts.st_uid not in (os.geteuid(), 0)):
                return None
            return file.read() if stat.S_ISREG(facts.st_mode) else None
    except OSError:
        return None


def load(path: Path) -> bytes | None:
    """Return what was stored under a name; None where there is nothing, or it is damaged."""
    text = _content(path)
    if text is None:
        return None
    head, data = _HEAD.fullmatch(text[:_HEAD_BYTES]), text[_HEAD_BYTES:]
    if head and (int(head[1], 16), int(head[2])) == (zlib.crc32(data), len(data)):
        return data
    discard(path)
    return None


def discard(path: Path) -> None:
    """Remove a damaged file of the cache, and say so."""
    warn_once(f"the cache {path.parent} was damaged; what was lost is made again")
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
        warn_once(
            f"the cache {path.parent} cannot be written ({error.strerror or error}); the next "
            "run prepares itself again"
        )
        return False
    finally:
        if name is not None:
            with suppress(OSError):
                Path(name).unlink(missing_ok=True)
    return True
