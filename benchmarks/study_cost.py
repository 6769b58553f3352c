"""Where the CPU time of a study of many short runs goes, and what it needs of memory and disk.

    python benchmarks/study_cost.py OUT [--vehicles V...] [--tracks T...] [--speeds 10]
        [--frictions 25] [--duration 40] [--workers 2]
        [--keep summary] [--json study.json]

By default two coaches on two curves at so many speeds and coefficients of friction, with
`keep = "summary"`, that is without result files.  Printed: the share of the own time loops of the
runs in the CPU time of all processes (loops that settle vehicles and judge time steps are not
counted), and private memory.
"""

import argparse
import json
import os
import threading
import time
from pathlib import Path

from railsim.threads import use_one_thread

use_one_thread()  # before numpy is imported, as the command does: idle threads spin

import numpy as np  # noqa: E402

from railsim.studies.study import study  # noqa: E402


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--vehicles", nargs="*", default=["coach_manchester", "coach_flexicoil"])
    parser.add_argument("--tracks", nargs="*", default=["curve_r250", "curve_r500"])
    parser.add_argument("--speeds", type=int, default=10)
    parser.add_argument("--frictions", type=int, default=25)
    parser.add_argument("--duration", type=float, default=40.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--keep", default="summary")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    memory = Memory()
    begin = time.perf_counter()
    outcome = study(
        asked.vehicles,
        asked.tracks,
        [f"{speed:.4g}" for speed in np.linspace(12.0, 22.0, asked.speeds)],
        grid={"track.friction": [f"{mu:.4g}" for mu in np.linspace(0.2, 0.5, asked.frictions)]},
        duration=asked.duration,
        keep=asked.keep,
        workers=asked.workers,
        overwrite=True,
        out=asked.out,
    )
    wall = time.perf_counter() - begin
    memory.stop()
    cpu = sum(map(_cpu_time, _family(os.getpid())))
    own = sum(record["cpu_time"] for record in outcome.records)
    runs = len(outcome.records)
    size = sum(path.stat().st_size for path in asked.out.rglob("*") if path.is_file())
    statuses = {record["status"] for record in outcome.records}
    print(f"{runs} runs of {asked.duration:g} s, {', '.join(sorted(statuses))}; {wall:.0f} s wall")
    print(f"CPU {cpu:.1f} s, {1e3 * cpu / runs:.0f} ms a run; own time loops {own / cpu:.1%}")
    print(f"folder {size / 1e6:.2f} MB, {size / runs:.0f} bytes a run")
    print("memory (MB) at tenths of the time:", *(f"{mb:.0f}" for mb in memory.tenths()))
    if asked.json:
        measured = {"cpu": cpu, "own": own, "wall": wall, "bytes": size}
        found = {"keep": asked.keep, "runs": runs, **measured}
        asked.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


class Memory:
    """Resident memory of this process and its children, once a second."""

    def __init__(self) -> None:
        self._found: list[float] = []
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the measurement."""
        self._end.set()
        self._thread.join()

    def tenths(self) -> list[float]:
        """Return the memory at eleven times [MB]."""
        return [self._found[int(k)] for k in np.linspace(0, len(self._found) - 1, 11)]

    def _watch(self) -> None:
        while True:
            self._found.append(sum(_resident(pid) for pid in _family(os.getpid())) / 1e6)
            if self._end.wait(1.0):
                return


def _family(root: int) -> set[int]:
    """Return a process and all that descend from it."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = path.read_text()
        except OSError:  # it has ended
            continue
        parents[int(path.parent.name)] = int(text.rpartition(")")[2].split()[1])
    found = {root}
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def _cpu_time(pid: int) -> float:
    """Return the CPU time of a process and of its children that have ended [s]."""
    text = Path(f"/proc/{pid}/stat").read_text()
    ticks = map(int, text.rpartition(")")[2].split()[11:15])
    return sum(ticks) / os.sysconf("SC_CLK_TCK")


def _resident(pid: int) -> int:
    """Return the private memory of a process in bytes; 0 where it has ended."""
    try:
        resident, shared = map(int, Path(f"/proc/{pid}/statm").read_text().split()[1:3])
    except OSError:
        return 0
    return (resident - shared) * os.sysconf("SC_PAGE_SIZE")


if __name__ == "__main__":
    main()
