"""A batch of runs on one core and on two, and whether the machine is quiet enough for that."""

import multiprocessing
import os
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from timed_runs import STUDY

from railsim.bench.runs import Scenario
from railsim.processes import workers_begin

SPIN = 2_000_000  # additions: about a tenth of a second
QUIET = 1.9  # cores' worth of CPU time that two processes must get in the wall time of the slower


def spin(count: int = SPIN) -> tuple[float, float]:
    """Count in plain Python: wall and CPU time of something that needs no memory [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    total = 0
    for k in range(count):
        total += k
    return time.perf_counter() - wall, time.process_time() - cpu


def quietness(pool: ProcessPoolExecutor, count: int = SPIN) -> dict[str, Any]:
    """Spin on one and on two processes of a pool that are already running.

    Returns
    -------
    dict
        `one_core`: share of its wall time that one process computed (1 on a quiet machine);
        `two_cores`: the same for both together (2 on a quiet machine);
        `slowdown`: CPU time of the loop on two processes over that on one (shared caches and
        clock); `quiet`: whether figures of two cores mean anything now; `load`: mean number of
        running processes over the last minute.
    """
    alone = pool.submit(spin, count).result()
    both = [future.result() for future in [pool.submit(spin, count) for _ in range(2)]]
    two = sum(cpu for _, cpu in both) / max(wall for wall, _ in both)
    return {
        "one_core": alone[1] / alone[0],
        "two_cores": two,
        "slowdown": 0.5 * sum(cpu for _, cpu in both) / alone[1],
        "quiet": two >= QUIET,
        "load": os.getloadavg()[0],
    }


def two_cores(
    repetitions: int, runs: Sequence[Scenario] = STUDY, spins: int = SPIN
) -> dict[str, Any]:
    """Do a batch of runs in one and in two processes that have already started.

    Returns
    -------
    dict
        Wall times of the batch, their ratio, and the ratio that CPU times allow: twice the CPU
        time of a run alone over that of a run beside another, which other programs do not spoil.
    """
    context = multiprocessing.get_context("spawn")
    batch = [scenario for _ in range(repetitions) for scenario in runs]
    with workers_begin(), ProcessPoolExecutor(2, context) as pool:
        _start(pool, runs, 2)
        before = quietness(pool, spins)
        wall_two, cpu_two, loop_two = _batch(pool, batch)
        after = quietness(pool, spins)
    with workers_begin(), ProcessPoolExecutor(1, context) as pool:
        _start(pool, runs, 1)
        wall_one, cpu_one, loop_one = _batch(pool, batch)
    return {
        "runs": len(batch),
        "wall_one": wall_one,
        "wall_two": wall_two,
        "ratio": wall_one / wall_two,
        "ratio_of_cpu_times": 2.0 * cpu_one / cpu_two,
        "ratio_of_loops": 2.0 * loop_one / loop_two,
        "quiet": before["quiet"] and after["quiet"],
        "before": before,
        "after": after,
    }


def _start(pool: ProcessPoolExecutor, runs: Sequence[Scenario], workers: int) -> None:
    """Make all processes of a pool import, load and run everything once."""
    for future in [pool.submit(_warm, runs) for _ in range(workers)]:
        future.result()


def _warm(runs: Sequence[Scenario]) -> None:
    for scenario in runs:
        scenario.run()
    time.sleep(0.1)  # the other process takes the other one of these tasks


def _once(scenario: Scenario) -> tuple[float, float]:
    begin = time.process_time()
    result = scenario.run()
    return time.process_time() - begin, float(result.attributes["cpu_time"])


def _batch(pool: ProcessPoolExecutor, batch: Sequence[Scenario]) -> tuple[float, float, float]:
    """Wall time of a batch, CPU times of its runs and of their time loops [s]."""
    begin = time.perf_counter()
    times = list(pool.map(_once, batch))
    wall = time.perf_counter() - begin
    return wall, sum(cpu for cpu, _ in times), sum(loop for _, loop in times)
