"""Files that railsim reads and writes.

Reading: only regular files of a known kind and of bounded size (`read_bytes`, `read_text`).

Writing: a name is refused before anything is computed (`check_file`, `check_folder`); a file is
written under a hidden name beside its own and gets its name when it is whole and on the disk
(`PartialFile`, `whole_file`).  The hidden name cannot be foreseen, the file is created exclusively
and is itself locked for as long as its writer lives: no lock file is needed, and what a process
that was killed has left is known by the lock that nobody holds, and is removed (`sweep`).
"""

import errno
import os
import re
import stat
import tempfile
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO

from railsim.errors import InputError, argument_error, input_error
from railsim.text import LONGEST_FILE, shortened

RESULTS = (".h5", ".hdf5")
PICTURES = (".png", ".svg", ".pdf", ".eps", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
TABLES = (".toml",)
STUDY_FILES = ("study.json", "summary.csv")  # in the folder of a study
DEFINITION_BYTES = 4_000_000  # largest vehicle, track, settings or study file
TABLE_BYTES = 20_000_000  # largest file of points: profiles, recordings
_SYSTEM = (Path("/proc"), Path("/sys"), Path("/dev"))
_SHARED_MEMORY = Path("/dev/shm")  # files there are users' own
_SUFFIX = ".railsim.partial"
_RANDOM = rf"\.[a-z0-9_]{{8}}{re.escape(_SUFFIX)}"  # as `tempfile` names files
_FILE_ENDINGS = (*RESULTS, *PICTURES, *TABLES, ".csv", ".json", ".html", ".txt")
_NO_WAITING = getattr(os, "O_NONBLOCK", 0)
_BINARY = getattr(os, "O_BINARY", 0)
_CLOSED_FIRST = os.name == "nt"  # Windows neither renames nor removes an open file
_own_partial_files: set[Path] = set()


def check_file(
    path: Path, *, overwrite: bool, option: str = "--out", endings: Sequence[str] = ()
) -> None:
    """Refuse a file for output that may not or cannot be written.

    `path`: the file; `overwrite`: whether it may exist; `option`: what the user knows the path by,
    for messages; `endings`: allowed endings of its name, in small letters; by default any. Raises
    InputError: one of these is not fulfilled.
    """
    ending = path.suffix
    found, allowed = _invalid_name(path), "choose another name"
    if found:
        pass
    elif path.is_dir():
        found, allowed = f"{path} is a folder", "give the name of a file"
    elif endings and ending.lower() not in endings:
        found = f"{path.name} ends in '{ending}'" if ending else f"{path.name} has no ending"
        allowed = f"the name must end in {' or '.join(endings)}"
    elif not path.parent.is_dir():
        found, allowed = f"there is no folder {path.parent}", "create it first"
    elif not os.access(path.parent, os.W_OK):
        found, allowed = f"the folder {path.parent} cannot be written to", "choose another"
    elif path.exists() and not overwrite:
        found, allowed = f"{path} exists", "give `overwrite` or another name"
    _refuse(found, allowed, option)


def check_folder(folder: Path, names: Iterable[str] = (), *, overwrite: bool = False) -> None:
    """Refuse a folder for output, which need not exist, and in which `names` will be written.

    Of `names` those that end in a slash are folders, whose content stays. Raises InputError: it is
    a file or called like one, cannot be written to, holds a folder where a file is to be written or
    the reverse, or one of `names` and not `overwrite`.
    """
    found, allowed = _invalid_name(folder), "choose another name"
    if found:
        pass
    elif folder.exists() and not folder.is_dir():
        found, allowed = f"{folder} is a file", "give the name of a folder"
    elif not folder.exists() and folder.suffix.lower() in _FILE_ENDINGS:
        found, allowed = f"{folder.name} is the name of a file", "give the name of a folder"
    elif found := _unwritable(folder):
        allowed = "choose another folder"
    else:
        existing = [name for name in names if (folder / name).exists()]
        unlike = [name for name in existing if (folder / name).is_dir() != name.endswith("/")]
        files = ", ".join(name for name in existing if not name.endswith("/"))
        if unlike:
            found = f"{folder / unlike[0]} is a {'file' if unlike[0].endswith('/') else 'folder'}"
            allowed = "rename it, or choose another folder"
        elif files and not overwrite:
            found, allowed = f"{folder} holds {files}", "give `overwrite` or another folder"
    _refuse(found, allowed, parameter="out")


def write_folder(
    folder: Path, content: Mapping[str, bytes], *, overwrite: bool = False
) -> list[Path]:
    """Write files by their names into a folder, created if it does not exist; their paths.

    None gets its name before all are written: on a full disk there is none of them.  Raises
    InputError: one of them exists and may not be overwritten; nothing is written then.
    """
    check_folder(folder, content, overwrite=overwrite)
    make_folder(folder)
    with ExitStack() as all_whole:
        for name, data in content.items():
            all_whole.enter_context(whole_file(folder / name)).write_bytes(data)
    return [folder / name for name in content]


def make_folder(folder: Path, parameter: str = "path") -> None:
    """Make a folder for output, with those above it; `parameter` of a function that names it.

    Raises InputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot make {folder} ({error.strerror})"
        _refuse(found, "choose another folder", parameter=parameter)


def _refuse(found: str, allowed: str, option: str = "--out", *, parameter: str = "path") -> None:
    if found:
        raise argument_error(parameter, found, allowed, option=option) from None


def _unwritable(folder: Path) -> str:
    """Return why nothing can be written into a folder, which may still have to be made."""
    if folder.is_symlink() and not folder.exists():
        return f"{folder} is a link that leads nowhere"
    existing = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    if not existing.is_dir():
        return f"{existing} is a file"
    return "" if os.access(existing, os.W_OK | os.X_OK) else f"{existing} cannot be written to"


def _invalid_name(path: Path) -> str:
    """Return why the system cannot even look for a path: its name is too long, or is no name."""
    try:
        os.lstat(path)
    except ValueError:
        return "the name holds a zero byte"
    except OSError as error:
        if error.errno in (errno.ENAMETOOLONG, errno.ELOOP):
            return f"{shortened(str(path), LONGEST_FILE)}: {os.strerror(error.errno)}"
    return ""


# reading ------------------------------------------------------------------------------------------


def is_file(path: str | Path) -> bool:
    """Whether there is such a file; a name that the system refuses is none."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):
        return False


def folder_of(file: str) -> Path:
    """Return the folder of a study, given as such or by a file with its table; or the file."""
    path = Path(file)
    return path.parent if path.name in STUDY_FILES and path.is_file() else path


def relative(path: str | Path, folder: str | Path) -> str:
    """Return a path as seen from a folder, with forward slashes, which every system reads."""
    return Path(os.path.relpath(path, folder)).as_posix()


def read_bytes(path: str | Path, limit: int) -> bytes:
    """Read a regular file of at most `limit` bytes; a link may lead to it.

    Raises InputError: as `open_regular`; or it is larger.
    """
    path = Path(path)
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > limit:
            found, allowed = f"{size / 1e6:.1f} MB", f"{limit / 1e6:g} MB at most"
            raise input_error(path, found, allowed)
        try:
            return file.read(limit)
        except OSError as error:
            raise _unreadable(path, error) from None


def open_regular(path: str | Path) -> BinaryIO:
    """Open a regular file for reading, to be closed by the caller; a link may lead to it.

    Raises InputError: it cannot be read, or is a folder, a device, a pipe or a file of the system's
    (/proc, /sys, /dev).
    """
    path = Path(path)
    try:
        resolved = path.resolve()
        system = any(resolved.is_relative_to(folder) for folder in _SYSTEM)
        if system and not resolved.is_relative_to(_SHARED_MEMORY):
            raise input_error(path, "a file of the system", "give one of your own")
        # a pipe would wait for its writer
        file = open(os.open(path, os.O_RDONLY | _NO_WAITING | _BINARY), "rb")  # noqa: SIM115
    except (OSError, ValueError, RuntimeError) as error:
        raise _unreadable(path, error) from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise input_error(path, "not a regular file", "give a file")
    return file


def _unreadable(path: Path, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    return input_error(path, f"cannot be read ({reason})")


def read_text(path: str | Path, limit: int) -> str:
    """Read a regular file of UTF-8 text, as `read_bytes`; a mark at its beginning is left out."""
    try:
        return read_bytes(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError:
        allowed = "convert it, as by `iconv -t utf-8`"
        raise input_error(path, "not UTF-8 text", allowed) from None


# writing ------------------------------------------------------------------------------------------


class PartialFile(AbstractContextManager["PartialFile"]):
    """A file under a hidden name, to be written and then to get its own.

    Left without `finish` it disappears.  As long as it exists, this process holds a lock on it.

    `target`: the name that it is to get; `alone`: refuse where another process is writing the same
    file; `option`: what the user knows the path by, for messages; `path`: the hidden name, to be
    written to. Raises InputError: another process is writing the same file. OSError: it cannot be
    created.
    """

    def __init__(self, target: Path, *, alone: bool = False, option: str = "--out") -> None:
        self.target = target
        self._create()
        if sweep(target.parent, _prefix(target.name), self.path) and alone:
            self.remove()
            found = f"{target} is being written by another process"
            _refuse(found, "wait for it, or choose another name", option)

    def _create(self) -> None:
        folder, prefix = self.target.parent, _prefix(self.target.name)
        self._handle, name = tempfile.mkstemp(_SUFFIX, prefix, folder)
        self.path = Path(name)
        _own_partial_files.add(self.path)
        with suppress(OSError):  # a file system without locks
            locked(self._handle)
        if not os.fstat(self._handle).st_nlink:  # swept by another process before it was locked
            self.remove()
            self._create()

    def finish(self, *, overwrite: bool = True) -> Path:
        """Give the file its name, once it is on the disk, and return the name.

        Without `overwrite`, where a file of that name has appeared in the meantime, the new one
        gets the next free name: ``run-2.h5``.
        """
        os.fsync(self._handle)
        os.chmod(self.path, _usual_mode(self.target))
        if _CLOSED_FIRST:
            self._close()
        path = self.target
        if overwrite:
            os.replace(self.path, path)
        else:
            names = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
            path = next(name for name in chain([path], names) if _link(self.path, name))
        with suppress(OSError):  # not every file system lets folders be opened
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        self.remove()
        return path

    def remove(self) -> None:
        """Remove the hidden file, if it is still there, and release its lock; may be repeated."""
        if _CLOSED_FIRST:
            self._close()
        self.path.unlink(missing_ok=True)
        _own_partial_files.discard(self.path)
        self._close()

    def _close(self) -> None:
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def __exit__(self, *_: object) -> None:
        self.remove()


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the hidden name to write to; the file has its own name when the block has ended.

    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_file(Path(folder) / "a.txt") as partial:
    ...         _ = partial.write_text("whole")
    ...     print([path.name for path in Path(folder).iterdir()])
    ['a.txt']
    """
    try:
        with PartialFile(path) as partial:
            yield partial.path
            partial.finish()
    except OSError as error:  # a full disk is reported with the name that the user knows
        if error.errno is None or not str(error.filename or _SUFFIX).endswith(_SUFFIX):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8, see `whole_file`."""
    with whole_file(path) as partial:
        partial.write_text(text, encoding="utf-8")


def locked(handle: int) -> bool:
    """Lock an open file for as long as it stays open; return False where another process has.

    Raises OSError: a file system without locks.
    """
    from filelock import lock_descriptor  # a tenth of the time of `railsim --help`

    return lock_descriptor(handle, blocking=False)


def remove_partial_files() -> None:
    """Remove all hidden files of this process, which is about to end without further ado."""
    for path in list(_own_partial_files):
        with suppress(OSError):
            path.unlink()


def sweep(folder: Path, prefix: str = "", spared: Path | None = None) -> int:
    """Remove the hidden files that dead processes have left in a folder; count those in use.

    Of all targets, or of the one whose hidden files begin with `prefix`; `spared` is not looked at.
    """
    partial = re.compile((re.escape(prefix[:-1]) if prefix else r"\..+") + _RANDOM, re.DOTALL)
    alive = 0
    try:
        paths = [folder / name for name in os.listdir(folder) if partial.fullmatch(name)]
    except OSError:  # may be written to, but not be listed
        return 0
    for path in paths:
        with suppress(OSError):  # a link, gone by now, or on a file system without locks
            if spared is not None and path.name == spared.name:  # absolute, where the folder is not
                continue
            handle = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | _NO_WAITING)
            try:
                if not stat.S_ISREG(os.fstat(handle).st_mode):
                    continue
                if locked(handle):
                    path.unlink()
                else:
                    alive += 1
            finally:
                os.close(handle)
    return alive


def _prefix(name: str) -> str:
    """Return what the hidden names of a target begin with; the system allows 255 bytes."""
    if len(os.fsencode(name)) > 200:
        name = f"{name[:40]}~{zlib.crc32(os.fsencode(name)):08x}"
    return f".{name}."


def _usual_mode(target: Path) -> int:
    """Return the permissions of a file that is replaced, else those that the user gives files."""
    try:
        return stat.S_IMODE(os.stat(target).st_mode)
    except OSError:
        mask = os.umask(0o077)
        os.umask(mask)
        return 0o666 & ~mask


def _link(partial: Path, path: Path) -> bool:
    """Give a file its name unless another file has it; return whether it has got it."""
    try:
        os.link(partial, path)
    except FileExistsError:
        return False
    except OSError:  # a file system without hard links
        if path.exists():
            return False
        os.replace(partial, path)
    return True
