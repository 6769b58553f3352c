"""Hardware, versions, and how quiet the machine is."""

import os
import platform
import time
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from railsim.version import __version__

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "h5py")
SPIN = 2_000_000  # additions: about a tenth of a second
QUIET = 1.9  # cores' worth of CPU time that two processes must get in the wall time of the slower


def hardware() -> dict[str, Any]:
    """Return processor, number of cores and memory."""
    return {
        "processor": _from_file("/proc/cpuinfo", "model name") or platform.processor(),
        "cores": len(os.sched_getaffinity(0)),
        "memory": _from_file("/proc/meminfo", "MemTotal"),
        "system": f"{platform.system()} {platform.machine()}",
    }


def vector_instructions() -> str:
    """Return the widest vector instructions that the kernels use here."""
    from railsim.kernels.fastsim_simd import available

    return "AVX-512, written out" if available() else "as the compiler chooses"


def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions of Python, railsim and what the time loop rests on."""
    found = {"python": platform.python_version(), "railsim": __version__}
    for package in PACKAGES + more:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _from_file(path: str, key: str) -> str:
    """Return the first value of a key in a file of lines ``key : value``."""
    if not Path(path).exists():
        return ""
    for line in Path(path).read_text().splitlines():
        name, _, value = line.partition(":")
        if name.strip() == key:
            return value.strip()
    return ""


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
