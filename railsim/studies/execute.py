"""Jobs over the cores of this machine, or over a dask cluster.

A failed job becomes a record with the reason; the others continue.  On Ctrl-C running jobs are
requested to stop and leave no files behind; a process that does not respond, because it is
compiling, is killed after a moment.  Processes whose study has ended terminate by themselves.
"""

import logging
import os
import secrets
import signal
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from railsim.definitions.loading import load_track, load_vehicle
from railsim.errors import ModelError, RailsimError, argument_error, optional_package
from railsim.files.access import remove_partial_files, sweep, write_folder
from railsim.processes import WorkerPool, begin_worker, worker_context
from railsim.result import Result, open_result
from railsim.result.extremes import OF_FACTS
from railsim.result.hdf5 import PLAIN, Storage, write
from railsim.result.sinks import EVERYTHING, matches
from railsim.simulation import simulate
from railsim.simulation.first_start import compile_time_loop, is_compiled
from railsim.simulation.remarks import silent
from railsim.studies.analyses import numbers_and_remarks
from railsim.studies.case import Case, run_case
from railsim.studies.records import Record
from railsim.studies.spec import Progress
from railsim.studies.summary import failed_record, finished_record, waiting_record

GRACE = 3.0  # seconds that running jobs have to stop
POLL = 0.2  # seconds between updates of the progress
AHEAD = 8  # jobs for each process that wait in its pool: each end takes a look at all of them
ALWAYS_KEPT = ("time", "distance", "Q0")


@dataclass(frozen=True)
class Job:
    """A case and the paths of its files; existing ones are replaced."""

    case: Case
    path: Path
    picture: Path | None = None
    function: str | None = None  # for user-defined quantities, see `railsim.studies.user_function`
    # quantities of the result, see `railsim.studies.spec.kept_quantities`
    keep: tuple[str, ...] = EVERYTHING
    storage: Storage = PLAIN  # compression and precision of its file
    # of a run that exists, whose analyses alone are to be computed: what is known of it
    record: Record | None = None

    @property
    def whole(self) -> bool:
        """Whether its file holds everything, with all digits: the run itself writes it."""
        return self.keep == EVERYTHING and not self.storage.single


class Stopped(BaseException):
    """The study was interrupted, which is no failure of a run."""


def perform(job: Job, progress: Progress | None = None) -> Record:
    """Carry out a job and return its record, whether it succeeds or fails."""
    case = job.case
    if not case.file_name:
        return _analysis_record(job)
    if job.record is not None:
        with suppress(RailsimError):  # its file lacks required quantities: it is run again
            return finished_record(case, open_result(job.path), job.function, job.record)
    # the quantities that records and files need
    wants_all = job.function or case.analyses or job.picture
    only = EVERYTHING if wants_all else {*OF_FACTS, *ALWAYS_KEPT, *job.keep}
    file = job.path if job.whole else None
    try:
        how: dict[str, Any] = {"progress": progress, "only": only, "storage": job.storage}
        result = run_case(case, file, overwrite=True, **how)
        if job.picture is not None and len(result["time"]):
            from railsim.plot.histories import histories
            from railsim.plot.style import save

            save(histories(result), job.picture, overwrite=True)
        return {**finished_record(case, result, job.function), "file": _reduce_file(job, result)}
    except Exception as error:
        return failed_record(case, error)


def _analysis_record(job: Job) -> Record:
    """Return the record of a job without a run in the time domain."""
    begin = time.process_time()
    try:
        quantities, remarks = numbers_and_remarks(job.case, None)
    except ModelError as error:  # no solution: a result too, not computed again
        facts: Record = {"status": "stopped", "status_reason": str(error)}
    except Exception as error:
        return failed_record(job.case, error)
    else:
        cpu_time = time.process_time() - begin
        facts = {"status": "complete", "cpu_time": cpu_time, "quantities": quantities}
        facts["remarks"] = remarks
    return waiting_record(job.case) | facts


def _reduce_file(job: Job, result: Result) -> str:
    """Reduce a result file to what is kept; return its name, empty without a file."""
    if not job.keep:
        job.path.unlink(missing_ok=True)  # kept by an earlier run
        return ""
    if not job.whole:
        kept = (*job.keep, *ALWAYS_KEPT)
        names = [name for name in result if matches(name, kept)]
        write(result, job.path, overwrite=True, names=names, storage=job.storage)
    return job.path.name


def in_this_process(jobs: Sequence[Job], progress: Progress) -> Iterator[Record]:
    """Carry out jobs one after the other."""
    for done, job in enumerate(jobs):

        def tell(fraction: float, before: int = done) -> None:
            progress((before + fraction) / len(jobs))

        yield perform(job, tell)


def in_processes(jobs: Sequence[Job], workers: int, progress: Progress) -> Iterator[Record]:
    """Carry out jobs on several cores; records are returned as the jobs end.

    If the time loop has to be compiled, the first job starts alone, so that it is compiled only
    once.

    When a process dies (for instance killed for lack of memory), its pool ends with it; unfinished
    jobs start again in a new pool.  A job whose process has died twice is abandoned.
    """
    todo = dict.fromkeys(range(len(jobs)))
    deaths = Counter[int]()
    while todo:
        pool = _Pool(jobs, list(todo), workers)
        for index, record in pool.outcomes(progress):
            del todo[index]
            yield record
        deaths.update(pool.lost)
        for index in [index for index in todo if deaths[index] > 1]:
            del todo[index]
            reason = "its process died twice, perhaps for lack of memory"
            yield failed_record(jobs[index].case, reason)


class _Pool:
    """One pool of processes, until all jobs are done or one dies, whose jobs are `lost`."""

    def __init__(self, jobs: Sequence[Job], indices: Sequence[int], workers: int) -> None:
        context: Any = worker_context()
        self._jobs, self._indices = jobs, indices
        self._fractions = context.Array("d", len(jobs), lock=False)
        self._holders = context.Array("l", len(jobs), lock=False)  # process of each job
        # not an event, whose lock would be held for ever by a process that is killed as it looks
        self._stop = context.Value("b", 0, lock=False)
        self._running: dict[Future[Record], int] = {}
        shared = self._fractions, self._holders, self._stop
        begun = (*shared, bool(logging.getLogger("railsim").handlers))
        self._most = AHEAD * workers
        self._pool = WorkerPool(min(workers, len(indices)), _begin, begun)
        self.lost: set[int] = set()

    def _submit(self, index: int) -> None:
        self._running[self._pool.submit(_work, index, self._jobs[index])] = index

    def outcomes(self, progress: Progress) -> Iterator[tuple[int, Record]]:
        """Yield index and record of every job that ends."""
        first, rest, number = self._indices[0], deque(self._indices[1:]), len(self._jobs)
        done = number - len(self._indices)
        broken = False
        try:
            self._submit(first)
            compiled = is_compiled()
            if not compiled and rest:
                self._pool.submit(compile_time_loop)  # while the first one builds contact tables
            while (rest or self._running) and not broken:
                while rest and compiled and len(self._running) < self._most:
                    self._submit(rest.popleft())
                ended, _ = wait(self._running, timeout=POLL, return_when=FIRST_COMPLETED)
                progress((done + sum(self._fractions[i] for i in self._running.values())) / number)
                compiled = compiled or bool(ended) or self._fractions[first] > 0.0
                for future in ended:
                    index = self._running[future]
                    try:
                        record = future.result()
                    except BrokenProcessPool:
                        broken = True
                        continue
                    except Exception as error:
                        record = failed_record(self._jobs[index].case, error)
                    del self._running[future]
                    done += 1
                    yield index, record
        except BrokenProcessPool:  # nothing more can be submitted
            broken = True
        except BaseException:
            self._stop.value = 1
            self._pool.end(GRACE)
            raise
        finally:
            self._pool.shutdown(wait=True, cancel_futures=True)
            for folder in {job.path.parent for job in self._jobs}:
                sweep(folder)  # left by a process that was killed
        if broken:
            self.lost = self._lost_jobs()

    def _lost_jobs(self) -> set[int]:
        """Return the jobs of the process that died; the pool has terminated the others."""
        for process in self._pool.begun:
            process.join(GRACE)
        ended = (None, 0, -signal.SIGTERM)
        dead = {process.pid for process in self._pool.begun if process.exitcode not in ended}
        begun = {i for i in self._running.values() if self._holders[i]}
        return {i for i in begun if self._holders[i] in dead} or begun or {self._indices[0]}


def cluster(address: str) -> Any:
    """Return a client of a dask scheduler; raises InputError: no dask, or none that answers."""
    distributed = optional_package("distributed", "scheduler", "'railsim[distributed]'")
    try:
        return distributed.Client(address)
    except (OSError, ValueError) as error:
        found = f"no scheduler answers at {address} ({error})"
        raise argument_error("scheduler", found, "such as tcp://host:8786") from None


def run_briefly() -> None:
    """Load the compiled kernels, or compile them, by a run of two steps without remarks."""
    with silent():
        coach, track = load_vehicle("coach_manchester"), load_track("straight")
        simulate(coach, track, speed=20.0, duration=0.01)


def compile_on_cluster(client: Any, remark: Callable[[str], None]) -> None:
    """Have one worker of each machine of a dask cluster compile, before the others need it."""
    ready = client.run(is_compiled, on_error="ignore")  # by the addresses of the workers
    first = {urlsplit(address).hostname: address for address, done in ready.items() if not done}
    if first:
        remark(f"machines of the cluster that compile first, once, about a minute: {len(first)}")
        options = {"allow_other_workers": True, "pure": False}  # where one dies
        runs = [client.submit(run_briefly, workers=[one], **options) for one in first.values()]
        client.gather(runs, errors="skip")


def on_cluster(jobs: Sequence[Job], client: Any, progress: Progress) -> Iterator[Record]:
    """Carry out jobs on the workers of a dask cluster.

    A worker with access to the folder of the study writes into it; other workers return the files
    with the records.  A job of a worker that died starts again on another one; a job whose workers
    have died several times (``allowed-failures`` of dask) is abandoned.
    """
    from distributed import as_completed

    with client, _marks({job.path.parent for job in jobs}) as mark:
        futures = client.map(perform_remotely, list(jobs), mark=mark, pure=False)
        job_of = {future.key: job for future, job in zip(futures, jobs, strict=True)}
        waiting = as_completed(futures)
        del futures
        for number, future in enumerate(waiting):
            yield _receive(future, job_of[future.key])
            future.release()  # its files are no longer needed
            progress((number + 1) / len(jobs))


@contextmanager
def _marks(folders: set[Path]) -> Iterator[str]:
    """Yield the name of a file that exists in each folder within the block, to test access."""
    mark = f".railsim-{secrets.token_hex(8)}"
    try:
        for folder in folders:
            (folder / mark).touch()
        yield mark
    finally:
        for folder in folders:
            (folder / mark).unlink(missing_ok=True)


def perform_remotely(job: Job, mark: str) -> tuple[Record, dict[str, bytes]]:
    """Carry out a job, perhaps without access to the folder; then the files it wrote come too."""
    if (job.path.parent / mark).is_file():
        return perform(job), {}
    with tempfile.TemporaryDirectory(prefix="railsim-") as folder:
        scratch = Path(folder)
        picture = job.picture and scratch / job.picture.name
        local = replace(job, path=scratch / job.path.name, picture=picture)
        return perform(local), {path.name: path.read_bytes() for path in scratch.iterdir()}


def _receive(future: Any, job: Job) -> Record:
    try:
        record: Record
        record, files = future.result()
        write_folder(job.path.parent, files, overwrite=True)
    except Exception as error:
        return failed_record(job.case, error)
    return record


# shared with worker processes: progress and process of all jobs, and whether to stop
_shared: Any = None


def _begin(fractions: Any, holders: Any, stop: Any, without_log: bool) -> None:
    global _shared
    _shared = fractions, holders, stop
    if without_log:  # remarks on runs are in their records; here nobody else would hold them back
        logging.getLogger("railsim").addHandler(logging.NullHandler())
    begin_worker(partial(_stop, stop))


def _stop(stop: Any) -> None:
    """Stop as on Ctrl-C, once the process of the study has ended for any reason."""
    stop.value = 1
    time.sleep(GRACE)
    remove_partial_files()


def _work(index: int, job: Job) -> Record:
    fractions, holders, stop = _shared
    holders[index] = os.getpid()

    def progress(fraction: float) -> None:
        fractions[index] = fraction
        if stop.value:
            raise Stopped

    progress(0.0)  # it may have waited in the queue
    return perform(job, progress)
