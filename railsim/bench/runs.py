"""Speed of the time loop, each with its error; one core and two."""

import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from statistics import median
from typing import Any

import numpy as np

from railsim.bench.machine import SPIN, quietness
from railsim.bench.scenarios import STUDY, Scenario
from railsim.processes import workers_begin
from railsim.result import Result, mid_curves
from railsim.result.extremes import peak

RELATIVE = ("Q", "Y", "sum_Y", "wheelset_lateral", "wheelset_yaw", "Y_over_Q")


def speed_and_error(
    scenario: Scenario, repetitions: int, reference: Result | None = None
) -> dict[str, Any]:
    """Run a scenario several times and compare it with a reference.

    Returns
    -------
    dict
        Step, multiples of real time (simulated seconds per CPU second of the time loop) of all
        repetitions, their median and the best; `error` if there is a reference.
    """
    results = [scenario.run() for _ in range(repetitions)]
    first = results[0]
    factors = [float(result.attributes["real_time_factor"]) for result in results]
    record: dict[str, Any] = {
        "name": scenario.name,
        "speed": scenario.speed,
        "scheme": first.attributes["scheme"],
        "step": first.attributes["step"],
        "duration": first.attributes["duration"],
        "status": first.status,
        "real_time": median(factors),
        "real_time_best": max(factors),
        "real_time_all": factors,
        "cpu_per_step": float(first.attributes["step"]) / max(factors),
        "target": scenario.target,
    }
    if reference is not None:
        record["error"] = errors(first, reference)
    return record


def errors(result: Result, reference: Result) -> dict[str, float]:
    """Return what a result is off from a reference of the same output instants.

    Returns
    -------
    dict
        `dQ_over_Q0` of the peak, the worse of both signs [1]; `Y` of the peak and `Y_mid_curve`
        of any wheel [N]; `yaw` of the peak [1, relative]; `peaks`: the largest relative error of
        all peaks of `RELATIVE` and of both signs of dQ/Q0.
    """

    def values(name: str, kind: str = "abs") -> tuple[float, float]:
        found = peak(result, name, kind).value, peak(reference, name, kind).value
        # magnitudes: of two equal peaks of opposite sign either may be the larger by round-off
        return (abs(found[0]), abs(found[1])) if kind == "abs" else found

    unloading = [values("dQ_over_Q0", kind) for kind in ("max", "min")]
    pairs = [*unloading, *(values(name) for name in RELATIVE)]
    lateral, yaw = values("Y"), values("wheelset_yaw")
    curves = zip(mid_curves(result, ["Y"]), mid_curves(reference, ["Y"]), strict=True)
    middle = [np.max(np.abs(a.values["Y"] - b.values["Y"])) for a, b in curves]
    return {
        "dQ_over_Q0": max(abs(a - b) for a, b in unloading),
        "Y": abs(lateral[0] - lateral[1]),
        "Y_mid_curve": float(max(middle, default=0.0)),
        "yaw": abs(yaw[0] / yaw[1] - 1.0),
        "peaks": max(abs(a - b) / max(abs(b), 1e-12) for a, b in pairs),
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
