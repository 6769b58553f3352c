"""Files that railsim reads and writes.

Reading: only regular files of a known kind and of bounded size (`read_bytes`, `read_text`).

Writing: a name is refused before anything is computed (`check_file`, `check_folder`); a file is
written under a hidden name beside its own and gets its name when it is whole and on the disk
(`PartialFile`, `whole_file`).  The hidden name cannot be foreseen, the file is created exclusively
and locked for as long as its writer lives: what a process that was killed has left is known by the
lock that nobody holds, and is removed (`sweep`).
"""

import errno
import fcntl
import os
import re
import stat
import tempfile
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import chain, count
from pathlib import Path
from types import TracebackType
from typing import Self

from railsim.errors import Fault, InputError, argument_fault
from railsim.text import LONGEST_FILE, shortened

RESULTS = (".h5", ".hdf5")
PICTURES = (".png", ".svg", ".pdf", ".eps", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
TABLES = (".toml",)
DEFINITION_BYTES = 4_000_000  # largest vehicle, track, settings or study file
TABLE_BYTES = 20_000_000  # largest file of points: profiles, recordings
_SYSTEM = (Path("/proc"), Path("/sys"), Path("/dev"))
_SHARED_MEMORY = Path("/dev/shm")  # files there are users' own
_SUFFIX = ".railsim.partial"
# as `tempfile` makes them; other programs have hidden files of such names, without `railsim`
_PARTIAL = re.compile(rf"\..+\.[a-z0-9_]{{8}}{re.escape(_SUFFIX)}", re.DOTALL)
_OF_FILES = (*RESULTS, *PICTURES, *TABLES, ".csv", ".json", ".html", ".txt")
_open_ones: dict[Path, None] = {}  # hidden files of this process


def check_file(
    path: Path, *, overwrite: bool, option: str = "--out", endings: Sequence[str] = ()
) -> None:
    """Refuse a file for output that may not or cannot be written.

    Parameters
    ----------
    path : Path
        The file.
    overwrite : bool
        Whether it may exist.
    option : str
        What the user knows the path by, for messages.
    endings : sequence of str
        How its name may end, in small or capital letters; by default any.

    Raises
    ------
    InputError : its name ends in something else, it exists and may not be overwritten, is a
        folder, or its folder cannot be written to.
    """
    ending = path.suffix
    if problem := _impossible(path):
        found, allowed = problem, "choose another name"
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
        found, allowed = f"{path} exists", "give --overwrite or another name"
    else:
        return
    raise InputError([argument_fault("path", "", found, allowed, option)])


def check_folder(folder: Path, names: Iterable[str] = (), *, overwrite: bool = False) -> None:
    """Refuse a folder for output.

    Parameters
    ----------
    folder : Path
        The folder; it need not exist.
    names : iterable of str
        Files that will be written there.
    overwrite : bool
        Whether they may exist.

    Raises
    ------
    InputError : it is a file or called like one, cannot be written to, or holds one of `names`.
    """
    if problem := _impossible(folder):
        raise InputError([argument_fault("path", "", problem, "choose another name", "--out")])
    there = [name for name in names if (folder / name).exists()]
    if folder.exists() and not folder.is_dir():
        found, allowed = f"{folder} is a file", "give the name of a folder"
    elif not folder.exists() and folder.suffix.lower() in _OF_FILES:
        found, allowed = f"{folder.name} is the name of a file", "give the name of a folder"
    elif problem := _unwritable(folder):
        found, allowed = problem, "choose another folder"
    elif there and not overwrite:
        found, allowed = f"{folder} holds {', '.join(there)}", "give --overwrite or another folder"
    else:
        return
    raise InputError([argument_fault("path", "", found, allowed, "--out")])


def _unwritable(folder: Path) -> str:
    """Say why nothing can be written into a folder, which may still have to be made."""
    if folder.is_symlink() and not folder.exists():
        return f"{folder} is a link that leads nowhere"
    existing = folder.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        return f"{existing} is a file"
    return "" if os.access(existing, os.W_OK | os.X_OK) else f"{existing} cannot be written to"


def make_folder(folder: Path) -> None:
    """Make a folder for output, with those above it.

    Raises
    ------
    InputError : it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot make {folder} ({error.strerror})"
        raise InputError(
            [argument_fault("path", "", found, "choose another folder", "--out")]
        ) from None


def _impossible(path: Path) -> str:
    """Say why the system cannot even look for a path: its name is too long, or is no name."""
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


def read_bytes(path: str | Path, limit: int) -> bytes:
    """Read a regular file.

    Parameters
    ----------
    path : str or Path
        The file; a link may lead to it, but not to the files of the system.
    limit : int
        Largest size [bytes].

    Raises
    ------
    InputError : it cannot be read, is larger, or is a folder, a device, a pipe or a file of the
        system's (/proc, /sys, /dev).
    """
    path = Path(path)
    try:
        resolved = path.resolve()
        system = any(resolved.is_relative_to(folder) for folder in _SYSTEM)
        if system and not resolved.is_relative_to(_SHARED_MEMORY):
            raise InputError([Fault(str(path), "", "a file of the system", "give one of your own")])
        # a pipe would wait for its writer
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            facts = os.fstat(file.fileno())
            if not stat.S_ISREG(facts.st_mode):
                raise InputError([Fault(str(path), "", "not a regular file", "give a file")])
            if facts.st_size > limit:
                found, allowed = f"{facts.st_size / 1e6:.1f} MB", f"{limit / 1e6:g} MB at most"
                raise InputError([Fault(str(path), "", found, allowed)])
            return file.read(limit)
    except (OSError, ValueError, RuntimeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        raise InputError([Fault(str(path), "", f"cannot be read ({words})", "")]) from None


def read_text(path: str | Path, limit: int) -> str:
    """Read a regular file of UTF-8 text, as `read_bytes`; a mark at its beginning is left out."""
    try:
        return read_bytes(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            [
                Fault(
                    str(path),
                    "",
                    "is not UTF-8",
                    "UTF-8 text (convert it: iconv -f latin1 -t utf-8)",
                )
            ]
        ) from None


# writing ------------------------------------------------------------------------------------------


class PartialFile:
    """A file under a hidden name, to be written and then to get its own.

    Left without `finish` it disappears.  As long as it exists, this process holds a lock on it.

    Parameters
    ----------
    target : Path
        The name that it is to get.
    alone : bool
        Refuse where another process is writing the same file.
    option : str
        What the user knows the path by, for messages.

    Attributes
    ----------
    path : Path
        The hidden name, to be written to.

    Raises
    ------
    InputError : another process is writing the same file.
    OSError : it cannot be created.
    """

    def __init__(self, target: Path, *, alone: bool = False, option: str = "--out") -> None:
        self.target = target
        with _one_at_a_time(target.parent):
            writers = _swept(target.parent, target.name)
            if alone and writers:
                found = f"{target} is being written by another process"
                fault = argument_fault(
                    "path", "", found, "wait for it, or choose another name", option
                )
                raise InputError([fault])
            self._handle, name = tempfile.mkstemp(
                prefix=_prefix(target.name), suffix=_SUFFIX, dir=target.parent
            )
            self.path = Path(name)
            _open_ones[self.path] = None
            with suppress(OSError):  # a file system without locks
                fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def finish(self, *, overwrite: bool = True) -> Path:
        """Give the file its name, once it is on the disk.

        Parameters
        ----------
        overwrite : bool
            Replace a file of that name.  Otherwise, where one has appeared in the meantime, the new
            one gets the next free name: ``run-2.h5``.

        Returns
        -------
        Path
            The name that it has got.
        """
        os.fsync(self._handle)
        os.fchmod(self._handle, _usual_mode(self.target))
        path = self.target
        if overwrite:
            os.replace(self.path, path)
        else:
            names = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
            path = next(name for name in chain([path], names) if _linked(self.path, name))
        with suppress(OSError):  # not every file system lets folders be opened
            folder = os.open(path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        self.remove()
        return path

    def remove(self) -> None:
        """Remove the hidden file, if it is still there, and let go of its lock; may be repeated."""
        with suppress(FileNotFoundError):
            self.path.unlink()
        _open_ones.pop(self.path, None)
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.remove()


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the hidden name to write to; the file has its own name when the block has ended.

    Examples
    --------
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
        hidden = error.filename is None or _PARTIAL.fullmatch(Path(str(error.filename)).name)
        if error.errno is None or not hidden:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def remove_partial_files() -> None:
    """Remove all hidden files of this process, which is about to end without further ado."""
    for path in list(_open_ones):
        with suppress(OSError):
            path.unlink()


def sweep(folder: Path) -> None:
    """Remove the hidden files that dead processes have left in a folder."""
    with _one_at_a_time(folder):
        _swept(folder)


def _swept(folder: Path, name: str | None = None) -> int:
    """Remove what dead processes have left, of one target or all; count what is being written."""
    prefix = "." if name is None else _prefix(name)
    alive = 0
    try:
        names = [entry for entry in os.listdir(folder) if entry.startswith(prefix)]
    except OSError:  # may be written to, but not be listed
        return 0
    for entry in names:
        if not _PARTIAL.fullmatch(entry) or (name and len(entry) != len(prefix) + 8 + len(_SUFFIX)):
            continue
        path = folder / entry
        try:
            handle = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            if stat.S_ISREG(os.fstat(handle).st_mode):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink(missing_ok=True)
        except BlockingIOError:
            alive += 1
        except OSError:  # no locks here: nobody can tell
            pass
        finally:
            os.close(handle)
    return alive


def _prefix(name: str) -> str:
    """Return what the hidden names of a target begin with; the system allows 255 bytes."""
    if len(os.fsencode(name)) > 200:
        name = f"{name[:40]}~{zlib.crc32(os.fsencode(name)):08x}"
    return f".{name}."


@contextmanager
def _one_at_a_time(folder: Path) -> Iterator[None]:
    """Let no other process create hidden files in a folder within the block."""
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        yield
        return
    try:
        for _ in range(100):  # others hold it for a moment only
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            time.sleep(0.01)
        yield
    finally:
        os.close(handle)


def _usual_mode(target: Path) -> int:
    """Return the permissions of a file that is replaced, else those that the user gives files."""
    try:
        return stat.S_IMODE(os.stat(target).st_mode)
    except OSError:
        mask = os.umask(0o077)
        os.umask(mask)
        return 0o666 & ~mask


def _linked(partial: Path, path: Path) -> bool:
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
