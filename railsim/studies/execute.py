"""Jobs over the cores of this machine, or over a dask cluster.

A job that goes wrong becomes a record that says so; the others go on.  On Ctrl-C running jobs are
told to stop and leave nothing behind; a process that does not answer, because it is compiling, is
ended after a moment.  Processes whose study is no more end by themselves.
"""

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from railsim.errors import Fault, InputError, RailsimError
from railsim.files import partial_path
from railsim.studies.case import Case
from railsim.studies.run import run_case
from railsim.studies.summary import Record, failed_record, finished_record

GRACE = 3.0  # seconds that running jobs have to stop by themselves
POLL = 0.2  # seconds between looks at the progress

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Job:
    """A case and where its files go.

    Attributes
    ----------
    case : Case
        What to run.
    path : Path
        Result file; an existing one is replaced.
    picture : Path or None
        Figure of the result.
    """

    case: Case
    path: Path
    picture: Path | None = None


class Stopped(Exception):
    """The study was interrupted."""


def perform(job: Job, progress: Progress | None = None) -> Record:
    """Do a job and return its record, whether it went well or not."""
    try:
        result = run_case(job.case, job.path, overwrite=True, progress=progress)
        if job.picture is not None:
            from railsim.plot.histories import histories
            from railsim.plot.style import save

            save(histories(result), job.picture, overwrite=True)
        return finished_record(job.case, result)
    except Stopped:
        raise
    except RailsimError as error:
        return failed_record(job.case, str(error))
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        return failed_record(job.case, reason, traceback.format_exc())


def in_this_process(jobs: Sequence[Job], progress: Progress) -> Iterator[Record]:
    """Do jobs one after the other."""
    for index, job in enumerate(jobs):

        def share(fraction: float, index: int = index) -> None:
            progress((index + fraction) / len(jobs))

        yield perform(job, share)


def in_processes(jobs: Sequence[Job], workers: int, progress: Progress) -> Iterator[Record]:
    """Do jobs on several cores; records come as the jobs end."""
    # "spawn" everywhere: a fork of a process that has run compiled code with threads may hang
    context = multiprocessing.get_context("spawn")
    fractions = context.Array("d", len(jobs), lock=False)
    stop = context.Event()
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, context, _begin, (fractions, stop))
    processes: set[BaseProcess] = set()
    try:
        with _interrupts_later():  # the processes inherit it
            jobs_of = {pool.submit(_work, index, job): job for index, job in enumerate(jobs)}
            processes = set(multiprocessing.active_children()) - others
        waiting: set[Future[Record]] = set(jobs_of)
        while waiting:
            done, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
            progress(sum(fractions) / len(jobs))
            for future in done:
                yield _outcome(future, jobs_of[future])
    except BaseException:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)
        _end(processes)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        for process in processes:  # one that was killed has left what it was writing
            for job in jobs:
                partial_path(job.path, process.pid or 0).unlink(missing_ok=True)


def cluster(address: str) -> Any:
    """Return a client of the dask scheduler at an address.

    Raises
    ------
    InputError : dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client
    except ImportError:
        found = "the package 'distributed' is not installed"
        allowed = "install it with: pip install 'railsim[distributed]'"
        raise InputError([Fault("--scheduler", "", found, allowed)]) from None
    try:
        return Client(address)
    except (OSError, ValueError) as error:
        found = f"no scheduler answers at {address} ({error})"
        raise InputError([Fault("--scheduler", "", found, "such as tcp://host:8786")]) from None


def on_cluster(jobs: Sequence[Job], client: Any, progress: Progress) -> Iterator[Record]:
    """Do jobs on the workers of a dask cluster, which must see the folder under the same path."""
    from distributed import as_completed

    with client:
        futures = client.map(perform, list(jobs), pure=False)
        jobs_of = dict(zip((future.key for future in futures), jobs, strict=True))
        for count, future in enumerate(as_completed(futures), start=1):
            yield _outcome(future, jobs_of[future.key])
            progress(count / len(jobs))


def _outcome(future: Any, job: Job) -> Record:
    try:
        record: Record = future.result()
    except BrokenProcessPool:
        return failed_record(job.case, "its process died, perhaps for want of memory")
    except Exception as error:
        return failed_record(job.case, f"{type(error).__name__}: {error}")
    return record


# what a worker process knows: the progress of all jobs, and whether to stop
_shared: Any = None


def _begin(fractions: Any, stop: Any) -> None:
    global _shared
    _shared = fractions, stop
    threading.Thread(target=_end_with_parent, args=(stop,), daemon=True).start()


def _end_with_parent(stop: Any) -> None:
    """Wait until the study's process is gone, however that came; then stop as on Ctrl-C."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        stop.set()
        time.sleep(GRACE)
        os._exit(1)


def _work(index: int, job: Job) -> Record:
    fractions, stop = _shared

    def progress(fraction: float) -> None:
        fractions[index] = fraction
        if stop.is_set():
            raise Stopped

    return perform(job, progress)


def _end(processes: set[BaseProcess]) -> None:
    """Wait a moment for processes to end and end the rest."""
    with _interrupts_later():
        for process in processes:
            process.join(GRACE / max(1, len(processes)))
        for process in processes:
            if process.is_alive():
                process.terminate()
                process.join()


@contextmanager
def _interrupts_later() -> Iterator[None]:
    """Let Ctrl-C wait for the end of the block; processes that begin in it never hear it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
