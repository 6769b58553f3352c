"""Speed of the tool for linkages: kinematics with force, search, the whole command.

    python benchmarks/mechanisms.py [--starts 20] [--search atr95_lift_5] [--repeats 20]

Times are CPU times of this process where one does the work, else wall times; the machine is told.
A loop of Python with the closed form of lift 5 and its force is the peer in the same run.
"""

import argparse
import os
import subprocess
import sys
import time

import numpy as np

from railsim.definitions.loading import load_mechanism
from railsim.mechanisms.forces import actuator_force
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import build
from railsim.mechanisms.optimisation import optimise

POSITIONS = 1000


def best(function, repeats):
    """Least CPU time of several calls [s]."""
    function()
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times)


def kinematics(repeats):
    model = build(load_mechanism("atr95_lift_5"))
    s = np.linspace(model.start, model.end, POSITIONS)
    with_force = best(lambda: actuator_force(solve(model, s), "lift"), repeats)
    return best(lambda: solve(model, s), repeats), with_force


def closed_form_in_python(repeats):
    """Length of lift 5 at every position in a loop of Python, by its closed form."""
    p = build(load_mechanism("atr95_lift_5")).values
    a1, a2, a3, a4, d = (p[name] for name in ("a1", "a2", "a3", "a4", "d"))
    travel = np.linspace(0.0, p["travel"], POSITIONS)

    def loop():
        for s in travel:
            A = p["alpha1_in"] + s
            a, b = 2 * a1 * a2 * np.sin(A), 2 * a2 * (a1 * np.cos(A) - d)
            c = a1**2 + a2**2 + d**2 - 2 * a1 * d * np.cos(A) - a3**2
            root = np.sqrt(a * a + b * b - c * c)
            angle = np.arctan2(-(a * c + b * root), -b * c + a * root) - p["gamma"]
            x = a1 * np.cos(A) + a4 * np.cos(angle) - p["d_x"]
            np.hypot(x, a1 * np.sin(A) + a4 * np.sin(angle) + p["d_y"])

    return best(loop, repeats)


def search(name, starts, workers):
    """Wall time of a search, and CPU time of this process alone [s]."""
    mechanism = load_mechanism(name)
    begin, busy = time.perf_counter(), time.process_time()
    optimise(mechanism, starts=starts, workers=workers)
    return time.perf_counter() - begin, time.process_time() - busy


def command(repeats):
    """CPU time of the whole command, warm, and of one that only tells its version [s]."""
    times = []
    for arguments in (["mechanism", "atr95_lift_5", "--json"], ["--version"]):
        found = []
        for _ in range(repeats):
            before = os.times()
            subprocess.run(
                [sys.executable, "-m", "railsim", *arguments], check=True, stdout=subprocess.DEVNULL
            )
            after = os.times()
            found.append(
                after.children_user + after.children_system
                - before.children_user - before.children_system
            )  # fmt: skip
        times.append(min(found))
    return times


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--search", default="atr95_lift_5")
    parser.add_argument("--repeats", type=int, default=20)
    asked = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    positions, with_force = kinematics(asked.repeats)
    loop = closed_form_in_python(asked.repeats)
    print(f"{POSITIONS} positions: {positions * 1e3:.2f} ms, with force {with_force * 1e3:.2f} ms")
    print(f"closed form of the lift alone in a loop of Python: {loop / positions:.1f} times that")
    whole, version = command(min(3, asked.repeats))
    print(f"whole command {whole:.2f} s of CPU, --version {version:.2f} s")
    one, two = (search(asked.search, asked.starts, workers) for workers in (1, 2))
    print(f"{asked.starts} starts of {asked.search} in one process: {one[1]:.1f} s of CPU")
    print(f"the same on 2 cores: {two[0]:.1f} s of wall time")


if __name__ == "__main__":
    main()
