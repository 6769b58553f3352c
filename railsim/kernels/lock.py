"""One process compiles a function, builds a table or judges a step: the others wait, and load what
it stored.
"""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

POLL = 0.02  # s between two tries, between which Ctrl-C is heard
_lock_paths: set[Path] = set()


@contextmanager
def exclusive(path: Path) -> Iterator[None]:
    """Hold a file of the cache as a lock within the block; a process may take it again in it.

    Without a word where there are no locks, or nothing can be stored: each process compiles then.
    The lock ends with its process.
    """
    handle = None if path in _lock_paths else _acquire(path)
    if handle is None:
        yield
        return
    _lock_paths.add(path)
    try:
        yield
    finally:
        _lock_paths.discard(path)
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _acquire(path: Path) -> int | None:
    """Open and lock a file; None where that cannot be done."""
    from filelock import lock_descriptor  # takes 20 ms, and is for those that compile

    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o600)
        except OSError:
            return None
        try:
            while not lock_descriptor(handle, blocking=False):
                time.sleep(POLL)
            # the process that was waited for has removed the file, and others may hold the next one
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), path.stat()):
                    return handle
        except BaseException as error:
            with suppress(OSError):
                os.close(handle)
            if not isinstance(error, OSError | NotImplementedError):  # a system without locks
                raise
            return None
        os.close(handle)
