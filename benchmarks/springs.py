"""How long the spring tools take: ``python benchmarks/springs.py``.

Cold start (a new process, imports included) and warm calls apart; one core, best of five.
"""

import argparse
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from railsim.definitions.loading import load_spring
from railsim.report.springs import files
from railsim.springs.design import design
from railsim.springs.nests import evaluate, task_of
from railsim.springs.search import candidates, search
from railsim.springs.verification import verify


def best(function: Callable[[], object], times: int) -> float:
    """Shortest time of some calls [s]."""
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        function()
        spent.append(time.perf_counter() - start)
    return min(spent)


def whole_page() -> None:
    """Everything that ``railsim spring verify --out`` computes and draws."""
    files(suspension)


def command() -> None:
    """The same as a new process."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["spring", "verify", "turasas_axlebox", "--quiet", "--out", str(Path(folder))]
        subprocess.run(
            [sys.executable, "-m", "railsim", *arguments], check=True, stdout=subprocess.DEVNULL
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--without-search", action="store_true")
    given = parser.parse_args()
    times = given.repeats
    suspension = load_spring("turasas_axlebox")
    task = task_of(suspension)
    sample = candidates(task.limits, task.wires)
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}")
    rows = [
        ("design", best(lambda: design(suspension), times)),
        ("verify, five loads", best(lambda: verify(suspension), times)),
        ("verify with pictures and page", best(whole_page, times)),
        ("the same as a command", best(command, times)),
        (f"evaluate {len(sample.H0)} nests", best(lambda: evaluate(task, sample), times)),
    ]
    if not given.without_search:
        rows.append((f"search, {len(sample.H0)} candidates", best(lambda: search(suspension), 1)))
    for name, seconds in rows:
        print(f"{name:32} {seconds:8.4f} s")
