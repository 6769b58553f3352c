"""Whole commands: start-up cold and warm, wall time, peak memory.

Every command runs in a process of its own.  Cold means an empty cache folder: kernels are compiled
and contact tables built.  Peak memory is the largest resident set of the command's processes.
"""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

STUDY = (
    "study",
    "--vehicles",
    "coach_manchester",
    "coach_flexicoil",
    "--tracks",
    "curve_r250",
    "curve_r500",
    "--speeds",
    "20",
    "--workers",
    "2",
    "--quiet",
)
COACH = ("coach_manchester", "curve_r250", "--speed", "20")
# VmHWM, since the ru_maxrss of a process itself begins with that of the process that started it
_CHILD = """
import resource, runpy, sys
sys.argv[0] = "railsim"
try:
    runpy.run_module("railsim", run_name="__main__", alter_sys=True)
finally:
    with open("/proc/self/status") as facts:
        own = next(line.split()[1] for line in facts if line.startswith("VmHWM"))
    print("peak", own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)
"""


def run_command(
    *arguments: str,
    folder: Path,
    cache: Path | None = None,
    environment: dict[str, str] | None = None,
) -> dict[str, Any]:
    """Run a railsim command in a folder, with further variables in its environment if given.

    Returns
    -------
    dict
        `wall` and `cpu` [s], `memory` of the largest process [B], exit `status`.
    """
    environment = os.environ | (environment or {})
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # a user's Python keeps what it has compiled
    if cache is not None:
        environment |= {"RAILSIM_CACHE_DIR": str(cache)}
        environment.pop("NUMBA_CACHE_DIR", None)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _CHILD, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    peaks = [line.split()[1:] for line in done.stderr.splitlines() if line.startswith("peak ")]
    memory = max((1024 * int(value) for peak in peaks for value in peak), default=0)
    return {"wall": wall, "cpu": cpu, "memory": memory, "status": done.returncode}


def commands(repetitions: int, *, cold: bool) -> dict[str, Any]:
    """Measure starts and whole commands; of several repetitions the one of least wall time.

    Parameters
    ----------
    repetitions : int
        How often each warm command runs.
    cold : bool
        Also with an empty cache folder (about a minute).
    """
    found: dict[str, Any] = {}
    with TemporaryDirectory() as name:
        folder = Path(name)

        def best(*arguments: str) -> dict[str, Any]:
            runs = [run_command(*arguments, folder=folder) for _ in range(repetitions)]
            return min(runs, key=lambda run: float(run["wall"]))

        short = ("run", *COACH, "--until", "0.1", "--quiet", "--overwrite")
        run_command(*short, folder=folder)  # warms every cache
        found["help"] = best("--help")
        found["start"] = best(*short)
        found["run"] = best("run", *COACH, "--quiet", "--overwrite")
        studies = [
            run_command(*STUDY, "--out", f"study_{number}", folder=folder)
            for number in range(repetitions)
        ]
        found["study"] = min(studies, key=lambda run: float(run["wall"]))
        if cold:
            found["cold_start"] = run_command(*short, folder=folder, cache=folder / "cache")
            found["start_after"] = run_command(*short, folder=folder, cache=folder / "cache")
    return found
