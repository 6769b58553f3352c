"""Worker processes for runs: copies of a server that has imported what they need.

A process of its own imports railsim and loads its compiled code for longer than a short run takes.
The server does so once, while the process that wants workers prepares their work.  A copy of this
process itself would not do: one that has run compiled code with threads may hang.  The server has
none, and has the environment in which it began: where that has changed since, workers begin by
themselves.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import forkserver, resource_tracker
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any

from railsim.threads import one_thread_each, restored_environment

PRELOADED = "railsim.studies.worker"
REQUESTS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
FORKSERVER = "forkserver" in multiprocessing.get_all_start_methods()  # not on Windows
# variables by which a process does something else
NAMES = ("HOME", "PATH", "TMPDIR")
BEGINNINGS = ("RAILSIM_", "NUMBA_", "XDG_", "PYTHON", "OPENBLAS_", "MKL_", "OMP_")
_environment: dict[str, str] = {}  # of the server; empty before it begins


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def begin_server() -> None:
    """Let the server begin, to be there when workers are wanted; once is enough."""
    if _environment or not FORKSERVER:
        return
    _environment.update(_that_matter())
    with workers_begin():
        resource_tracker.ensure_running()  # its beginning unblocks signals
        # it outlives what ends its copies, to say how they ended
        with signals_later(REQUESTS):
            multiprocessing.set_forkserver_preload([PRELOADED])
            forkserver.ensure_running()


@contextmanager
def workers_begin() -> Iterator[None]:
    """Let processes that begin within the block use one thread each, and run railsim's code only.

    The folder in which a command is given may hold modules of anybody, such as a received study,
    which Python would import first.  And the script that calls railsim would be run again in each
    process, where it calls railsim again unless it has Python's guard: workers do not need it.
    """
    script = sys.modules["__main__"]
    with restored_environment("PYTHONSAFEPATH"), one_thread_each():
        os.environ["PYTHONSAFEPATH"] = "1"
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = script


def worker_context() -> BaseContext:
    """Return how worker processes begin: as copies of the server, where it suits."""
    begin_server()
    same = FORKSERVER and _environment == _that_matter()
    return multiprocessing.get_context("forkserver" if same else "spawn")


def _that_matter() -> dict[str, str]:
    """Return the variables of the environment that matter to a worker."""
    return {
        name: value
        for name, value in os.environ.items()
        if name in NAMES or name.startswith(BEGINNINGS)
    }


class WorkerPool(ProcessPoolExecutor):
    """Worker processes, killed where an exception leaves the block of the pool.

    `count`: How many; `begin`, `arguments`: What each calls first; it calls `begin_worker`.
    """

    def __init__(
        self, count: int, begin: Callable[..., None] | None = None, arguments: tuple[Any, ...] = ()
    ) -> None:
        self._count, self._others = count, set(multiprocessing.active_children())
        self.begun: set[BaseProcess] = set()
        context: Any = worker_context()
        super().__init__(count, context, begin or begin_worker, arguments)

    def submit(self, *task: Any, **options: Any) -> Future[Any]:
        """Submit a task, for which a process may begin."""
        with signals_later(), workers_begin():  # inherited by the process
            future = super().submit(*task, **options)
            if len(self.begun) < self._count:
                self.begun |= set(multiprocessing.active_children()) - self._others
        return future

    def end(self, grace: float = 0.0) -> None:
        """Begin no further task, and kill processes that have not ended after some seconds."""
        self.shutdown(wait=False, cancel_futures=True)
        until = time.monotonic() + grace
        with signals_later():
            for process in self.begun:
                process.join(max(0.0, until - time.monotonic()))
            for process in self.begun:
                if process.is_alive():
                    process.kill()
                process.join()

    def __exit__(self, *error: Any) -> None:
        """End the processes."""
        if error[0] is not None:
            self.end()
        super().__exit__(*error)


def begin_worker(ending: Callable[[], None] | None = None) -> None:
    """Let this process, a worker, end on what ends processes, except for Ctrl-C.

    And with the process that wanted it, which may end without a word: it would wait for its tasks
    for ever. `ending`: What it does before that.
    """
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, REQUESTS[1:])
    threading.Thread(target=_end_with_parent, args=(ending,), daemon=True).start()


def _end_with_parent(ending: Callable[[], None] | None) -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        if ending is not None:
            ending()
        os._exit(1)


@contextmanager
def signals_later(signals: Sequence[signal.Signals] = REQUESTS[:1]) -> Iterator[None]:
    """Let signals wait for the end of the block; processes that begin in it never hear them."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
