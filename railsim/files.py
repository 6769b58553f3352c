"""Files that railsim writes: what they may be called, and that they appear whole or not at all.

A name is refused before anything is computed (`check_file`, `check_folder`); a file is written
under a hidden name beside its own and renamed when it is whole (`whole_file`).
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from railsim.errors import Fault, InputError

RESULTS = (".h5", ".hdf5")
PICTURES = (".png", ".svg", ".pdf", ".eps", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
TABLES = (".toml",)
_OF_FILES = (*RESULTS, *PICTURES, *TABLES, ".csv", ".json", ".html", ".txt")


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
        How its name may end, in small or capital letters; by default as it likes.

    Raises
    ------
    InputError : its name ends in something else, it exists and may not be overwritten, is a
        folder, or its folder cannot be written to.
    """
    ending = path.suffix
    if path.is_dir():
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
    raise InputError([Fault(option, "", found, allowed)])


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
    there = [name for name in names if (folder / name).exists()]
    if folder.exists() and not folder.is_dir():
        found, allowed = f"{folder} is a file", "give the name of a folder"
    elif not folder.exists() and folder.suffix.lower() in _OF_FILES:
        found, allowed = f"{folder.name} is the name of a file", "give the name of a folder"
    elif folder.exists() and not os.access(folder, os.W_OK):
        found, allowed = f"{folder} cannot be written to", "choose another folder"
    elif there and not overwrite:
        found, allowed = f"{folder} holds {', '.join(there)}", "give --overwrite or another folder"
    else:
        return
    raise InputError([Fault("--out", "", found, allowed)])


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
        raise InputError([Fault("--out", "", found, "choose another folder")]) from None


def partial_path(path: Path, process: int) -> Path:
    """Return the hidden name of a file that a process is writing."""
    return path.with_name(f".{path.name}.{process}.partial")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the hidden name to write to; the file has its own name when the block has ended.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with whole_file(Path(folder) / "a.txt") as partial:
    ...         _ = partial.write_text("whole")
    ...     print([path.name for path in Path(folder).iterdir()])
    ['a.txt']
    """
    partial = partial_path(path, os.getpid())
    try:
        yield partial
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
