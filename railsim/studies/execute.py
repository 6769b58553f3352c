"""Jobs over the cores of this machine, or over a dask cluster.

Jobs come in batches, whose runs share a call; most batches hold one job.  A failed job becomes a
record with the reason; the others continue.  On Ctrl-C running jobs are requested to stop and leave
no files behind; a process that does not respond, because it is compiling, is killed after a
moment.  Processes whose study has ended terminate by themselves.
"""

import logging
import math
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
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from railsim.definitions.loading import load_track, load_vehicle
from railsim.errors import ModelError, RailsimError, argument_error
from railsim.files.access import remove_partial_files, sweep, whole_file
from railsim.processes import WorkerPool, begin_worker, worker_context
from railsim.result import Result, open_result
from railsim.result.extremes import OF_FACTS
from railsim.result.hdf5 import PLAIN, Storage, write
from railsim.result.sinks import EVERYTHING, matches
from railsim.simulation import simulate
from railsim.simulation.first_start import compile_time_loop, is_compiled
from railsim.studies.analyses import analysed
from railsim.studies.case import Case
from railsim.studies.records import Record
from railsim.studies.run import can_share_a_call, run_case, run_cases
from railsim.studies.summary import failed_record, finished_record, waiting_record

GRACE = 3.0  # seconds that running jobs have to stop
POLL = 0.2  # seconds between updates of the progress
AHEAD = 8  # batches for each process that wait in its pool: each end takes a look at all of them
ALWAYS_KEPT = ("time", "distance", "Q0")

Progress = Callable[[float], None]


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
    known: Record | None = None

    @property
    def whole(self) -> bool:
        """Whether its file holds everything, as the run itself writes it."""
        return self.keep == EVERYTHING and self.storage == PLAIN


Batch = tuple[Job, ...]


class Stopped(Exception):
    """The study was interrupted."""


def batches(jobs: Sequence[Job], together: int, workers: int) -> list[Batch]:
    """Group jobs that can share a call into batches of at most `together` jobs.

    No batch is larger than the share of one worker in all jobs, so that no worker is idle.
    """
    size = min(together, math.ceil(len(jobs) / workers))
    found: list[Batch] = []
    alike: list[list[Job]] = []  # jobs that differ only in the vehicle
    for job in jobs:
        if size <= 1 or job.known is not None or not job.case.file_name:
            found.append((job,))
            continue
        group = next((some for some in alike if can_share_a_call(some[0].case, job.case)), None)
        if group is None:
            group = []
            alike.append(group)
        group.append(job)
    for group in alike:
        parts = math.ceil(len(group) / size)
        ends = [len(group) * part // parts for part in range(parts + 1)]
        found += [tuple(group[begin:end]) for begin, end in pairwise(ends)]
    return found


def perform(batch: Batch, progress: Progress | None = None) -> list[Record]:
    """Carry out the jobs of a batch and return their records, whether they succeed or fail."""
    first = batch[0]
    if not first.case.file_name:
        return [_analysed(job) for job in batch]
    if first.known is not None:
        with suppress(RailsimError):  # its file lacks required quantities: it is run again
            result = open_result(first.path)
            return [finished_record(first.case, result, first.function, first.known)]
    files = [job.path if job.whole else None for job in batch]
    found: list[Result | Exception]
    try:
        # the quantities that records and files need
        wants_all = any(job.function or job.case.analyses or job.picture for job in batch)
        only = EVERYTHING if wants_all else {*OF_FACTS, *ALWAYS_KEPT, *first.keep}
        if len(batch) == 1:
            found = [run_case(first.case, files[0], overwrite=True, progress=progress, only=only)]
        else:
            cases = [job.case for job in batch]
            found = run_cases(cases, files, overwrite=True, progress=progress, only=only)
    except Stopped:
        raise
    except Exception as error:
        found = [error] * len(batch)
    found.reverse()  # each result is released after its record: it holds data read from its file
    return [_record(job, found.pop()) for job in batch]


def _analysed(job: Job) -> Record:
    """Return the record of a job without a run in the time domain."""
    begin = time.process_time()
    try:
        quantities, said = analysed(job.case, None)
    except ModelError as error:  # no solution: a result too, not computed again
        facts: Record = {"status": "stopped", "status_reason": str(error)}
    except Exception as error:
        return failed_record(job.case, error)
    else:
        cpu_time = time.process_time() - begin
        facts = {"status": "complete", "cpu_time": cpu_time, "quantities": quantities}
        facts["remarks"] = said
    return waiting_record(job.case) | facts


def _record(job: Job, outcome: Result | Exception) -> Record:
    """Draw the result of a job, and return its record, or the record of a failure."""
    try:
        if isinstance(outcome, Exception):
            raise outcome
        if job.picture is not None and len(outcome["time"]):
            from railsim.plot.histories import histories
            from railsim.plot.style import save

            save(histories(outcome), job.picture, overwrite=True)
        return {**finished_record(job.case, outcome, job.function), "file": _reduced(job, outcome)}
    except Exception as error:
        return failed_record(job.case, error)


def _reduced(job: Job, result: Result) -> str:
    """Reduce a result file to what is kept; return its name, empty without a file."""
    if not job.keep:
        job.path.unlink(missing_ok=True)  # kept by an earlier run
        return ""
    if not job.whole:
        wanted = (*job.keep, *ALWAYS_KEPT)
        names = [name for name in result if matches(name, wanted)]
        write(result, job.path, overwrite=True, names=names, storage=job.storage)
    return job.path.name


def in_this_process(batches: Sequence[Batch], progress: Progress) -> Iterator[Record]:
    """Carry out batches one after the other."""
    done = 0.0
    for batch, share in zip(batches, _shares(batches), strict=True):

        def tell(fraction: float, before: float = done, of: float = share) -> None:
            progress(before + fraction * of)

        yield from perform(batch, tell)
        done += share


def in_processes(batches: Sequence[Batch], workers: int, progress: Progress) -> Iterator[Record]:
    """Carry out batches on several cores; records are returned as the batches end.

    If the time loop has to be compiled, the first batch starts alone, so that it is compiled only
    once.

    When a process dies (for instance killed for lack of memory), its pool ends with it; unfinished
    batches start again in a new pool.  A batch whose process has died twice is abandoned.
    """
    shares = _shares(batches)
    todo = dict.fromkeys(range(len(batches)))
    deaths = Counter[int]()
    while todo:
        done = sum(share for index, share in enumerate(shares) if index not in todo)

        def tell(more: float, done: float = done) -> None:
            progress(done + more)

        pool = _Pool(batches, list(todo), workers)
        for index, records in pool.outcomes(tell):
            del todo[index]
            yield from records
        deaths.update(pool.lost)
        for index in [index for index in todo if deaths[index] > 1]:
            del todo[index]
            reason = "its process died twice, perhaps for lack of memory"
            yield from [failed_record(job.case, reason) for job in batches[index]]


class _Pool:
    """One pool of processes, until all batches are done or one dies, whose batches are `lost`."""

    def __init__(self, batches: Sequence[Batch], indices: Sequence[int], workers: int) -> None:
        context: Any = worker_context()
        self._batches, self._indices = batches, indices
        self._fractions = context.Array("d", len(batches), lock=False)
        self._holders = context.Array("l", len(batches), lock=False)  # process of each batch
        # not an event, whose lock would be held for ever by a process that is killed as it looks
        self._stop = context.Value("b", 0, lock=False)
        self._running: dict[Future[list[Record]], int] = {}
        shared = self._fractions, self._holders, self._stop
        begun = (*shared, bool(logging.getLogger("railsim").handlers))
        self._most = AHEAD * workers
        self._pool = WorkerPool(min(workers, len(indices)), _begin, begun)
        self.lost: set[int] = set()

    def _submit(self, index: int) -> None:
        self._running[self._pool.submit(_work, index, self._batches[index])] = index

    def outcomes(self, progress: Progress) -> Iterator[tuple[int, list[Record]]]:
        """Yield index and records of every batch that ends."""
        first, rest = self._indices[0], deque(self._indices[1:])
        shares, done = _shares(self._batches), 0.0
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
                progress(done + sum(self._fractions[i] * shares[i] for i in self._running.values()))
                compiled = compiled or bool(ended) or self._fractions[first] > 0.0
                for future in ended:
                    index = self._running[future]
                    try:
                        records = _outcome(future, self._batches[index])
                    except BrokenProcessPool:
                        broken = True
                        continue
                    del self._running[future]
                    done += shares[index]
                    yield index, records
        except BrokenProcessPool:  # nothing more can be submitted
            broken = True
        except BaseException:
            self._stop.value = 1
            self._pool.end(GRACE)
            raise
        finally:
            self._pool.shutdown(wait=True, cancel_futures=True)
            for folder in {job.path.parent for batch in self._batches for job in batch}:
                sweep(folder)  # left by a process that was killed
        if broken:
            self.lost = self._lost()

    def _lost(self) -> set[int]:
        """Return the batches of the process that died; the pool has terminated the others."""
        for process in self._pool.begun:
            process.join(GRACE)
        ended = (None, 0, -signal.SIGTERM)
        dead = {process.pid for process in self._pool.begun if process.exitcode not in ended}
        begun = {i for i in self._running.values() if self._holders[i]}
        return {i for i in begun if self._holders[i] in dead} or begun or {self._indices[0]}


def _shares(batches: Sequence[Batch]) -> list[float]:
    """Share of each batch in all jobs."""
    total = sum(len(batch) for batch in batches)
    return [len(batch) / total for batch in batches]


def cluster(address: str) -> Any:
    """Return a client of a dask scheduler; raises InputError: no dask, or none that answers."""
    try:
        from distributed import Client
    except ImportError:
        found = "the package 'distributed' is not installed"
        allowed = "install it with: pip install 'railsim[distributed]'"
        raise argument_error("scheduler", found, allowed) from None
    try:
        return Client(address)
    except (OSError, ValueError) as error:
        found = f"no scheduler answers at {address} ({error})"
        raise argument_error("scheduler", found, "such as tcp://host:8786") from None


def run_briefly() -> None:
    """Load the compiled kernels, or compile them, by a run of two steps without remarks."""
    logging.disable()
    try:
        coach, track = load_vehicle("coach_manchester"), load_track("straight")
        simulate(coach, track, speed=20.0, duration=0.01)
    finally:
        logging.disable(logging.NOTSET)


def compile_on_cluster(client: Any, remark: Callable[[str], None]) -> None:
    """Have one worker of each machine of a dask cluster compile, before the others need it."""
    ready = client.run(is_compiled, on_error="ignore")  # by the addresses of the workers
    first = {urlsplit(address).hostname: address for address, known in ready.items() if not known}
    if first:
        remark(f"machines of the cluster that compile first, once, about a minute: {len(first)}")
        options = {"allow_other_workers": True, "pure": False}  # where one dies
        runs = [client.submit(run_briefly, workers=[one], **options) for one in first.values()]
        client.gather(runs, errors="skip")


def on_cluster(batches: Sequence[Batch], client: Any, progress: Progress) -> Iterator[Record]:
    """Carry out batches on the workers of a dask cluster.

    A worker with access to the folder of the study writes into it; other workers return the files
    with the records.  A batch of a worker that died starts again on another one; a batch whose
    workers have died several times (``allowed-failures`` of dask) is abandoned.
    """
    from distributed import as_completed

    folders = {job.path.parent for batch in batches for job in batch}
    with client, _marks(folders) as mark:
        futures = client.map(perform_there, list(batches), mark=mark, pure=False)
        batch_of = {future.key: batch for future, batch in zip(futures, batches, strict=True)}
        share_of = dict(zip(batch_of, _shares(batches), strict=True))
        waiting = as_completed(futures)
        del futures
        fraction = 0.0
        for future in waiting:
            yield from _taken(future, batch_of[future.key])
            future.release()  # its files are no longer needed
            fraction += share_of[future.key]
            progress(min(1.0, fraction))


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


def perform_there(batch: Batch, mark: str) -> tuple[list[Record], dict[str, bytes]]:
    """Carry out a batch, perhaps without access to the folder; then the files it wrote come too."""
    if all((job.path.parent / mark).is_file() for job in batch):
        return perform(batch), {}
    with tempfile.TemporaryDirectory(prefix="railsim-") as folder:
        there = Path(folder)
        here = []
        for job in batch:
            picture = job.picture and there / job.picture.name
            here.append(replace(job, path=there / job.path.name, picture=picture))
        return perform(tuple(here)), {path.name: path.read_bytes() for path in there.iterdir()}


def _taken(future: Any, batch: Batch) -> list[Record]:
    """Return the records of a batch of the cluster after writing its files."""
    folder = batch[0].path.parent
    try:
        records, files = future.result()
        for name, data in files.items():
            with whole_file(folder / name) as partial:
                partial.write_bytes(data)
    except Exception as error:
        return [failed_record(job.case, error) for job in batch]
    found: list[Record] = records
    return found


def _outcome(future: Future[list[Record]], batch: Batch) -> list[Record]:
    try:
        return future.result()
    except BrokenProcessPool:
        raise
    except Exception as error:
        return [failed_record(job.case, error) for job in batch]


# shared with worker processes: progress and process of all jobs, and whether to stop
_shared: Any = None


def _begin(fractions: Any, holders: Any, stop: Any, handled: bool) -> None:
    global _shared
    _shared = fractions, holders, stop
    if handled:  # remarks on runs are in their records; here nobody else would hold them back
        logging.getLogger("railsim").addHandler(logging.NullHandler())
    begin_worker(partial(_stop, stop))


def _stop(stop: Any) -> None:
    """Stop as on Ctrl-C, once the process of the study has ended for any reason."""
    stop.value = 1
    time.sleep(GRACE)
    remove_partial_files()


def _work(index: int, batch: Batch) -> list[Record]:
    fractions, holders, stop = _shared
    holders[index] = os.getpid()

    def progress(fraction: float) -> None:
        fractions[index] = fraction
        if stop.value:
            raise Stopped

    progress(0.0)  # it may have waited in the queue
    return perform(batch, progress)
