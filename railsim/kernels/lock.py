"""One process at a time compiles: the others wait, and load what it has stored."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from railsim.kernels.cache import MARK

POLL = 0.1  # s between two tries, between which Ctrl-C is heard
_held: set[Path] = set()


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder of the cache within the block; a process may take it again in it.

    Without a word where there are no locks, or nothing can be stored: each process compiles then.
    The lock ends with its process.
    """
    handle = None if folder in _held else _locked(folder)
    if handle is None:
        yield
        return
    _held.add(folder)
    try:
        yield
    finally:
        _held.discard(folder)
        os.close(handle)


def _locked(folder: Path) -> int | None:
    """Open and lock the mark of a folder; None where that cannot be done."""
    if os.name == "nt":  # where a locked file cannot be read: the mark would be none
        return None
    from filelock import lock_descriptor  # takes 20 ms, and is for those that compile

    try:
        handle = os.open(folder / MARK, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return None
    try:
        while not lock_descriptor(handle, blocking=False):
            time.sleep(POLL)
    except BaseException as error:
        with suppress(OSError):
            os.close(handle)
        if not isinstance(error, OSError | NotImplementedError):  # a system without locks
            raise
        return None
    return handle
