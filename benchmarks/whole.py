"""Everything that is measured of railsim itself, for the tables of docs/performance.md.

    python benchmarks/whole.py [--out bench.json] [--small]

The runs of `railsim bench` and more; the parts of a step; FASTSIM over its grid; one core and two;
whole commands, cold and warm.  `--small` runs 10 m of every third run.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from commands import commands
from cores import SPIN, two_cores
from parts import GRIDS, REPETITIONS, fastsim_grids, right_hand_side_parts
from timed_runs import OTHERS, STUDY

from railsim.bench.runs import benchmark, table

Rows = tuple[list[str], list[list[str]]]


def measure(*, small: bool) -> dict[str, Any]:
    """Measure everything: plain numbers and strings, SI."""
    until = 10.0 if small else None
    runs = [replace(run, until=until) for run in (*STUDY, *OTHERS)][:: 3 if small else 1]
    repetitions = 1 if small else 5
    of_parts = 3 if small else REPETITIONS
    found = benchmark(runs, repetitions)
    found["parts"] = right_hand_side_parts(distance=until or 396.0, repetitions=of_parts)
    found["fastsim"] = fastsim_grids(GRIDS[:2] if small else GRIDS, repetitions=of_parts)
    if small:
        return found
    found["two_cores"] = two_cores(4, STUDY, SPIN)
    return found | {"commands": commands(3, cold=True)}


def tables(found: dict[str, Any]) -> list[Rows]:
    """Return what was found as tables: titles of the columns, rows."""
    runs = table(found["runs"])
    shown = [k for k, column in enumerate(runs.columns) if column.heading != "target"]
    header = [runs.columns[k].heading for k in shown]
    texts = [[runs.columns[k].text(row[k]) for k in shown] for row in runs.rows]
    made = [(header, texts), _parts(found["parts"]), _fastsim(found["fastsim"])]
    if "two_cores" in found:
        made += [_two_cores(found["two_cores"]), _commands(found["commands"])]
    return made


def _parts(found: dict[str, Any]) -> Rows:
    whole = found["evaluation"]
    times = {
        **found["parts"],
        "rest": found["rest"],
        "evaluation (fast scheme)": whole,
        "of it wheel and rail": found["wheel_rail"],
        "right-hand side (RK4)": found["right_hand_side"],
        "step of the fast scheme": found["step"],
        "one table look-up": found["look_up"],
    }
    rows = [
        [name, f"{1e6 * time:.3f}", f"{100.0 * time / whole:.0f}"] for name, time in times.items()
    ]
    return [f"right-hand side, {found['patches']} patches", "us", "%"], rows


def _fastsim(records: Sequence[dict[str, float]]) -> Rows:
    rows = [
        [
            f"{record['grid']} x {record['grid']}",
            f"{1e6 * record['together']:.3f}",
            f"{1e6 * record['alone']:.3f}",
            f"{1e9 * record['together'] / record['grid'] ** 2:.2f}",
        ]
        for record in records
    ]
    return ["FASTSIM", "us per patch, all at once", "us, one alone", "ns per cell"], rows


def _two_cores(found: dict[str, Any]) -> Rows:
    before = found["before"]
    quiet = "" if found["quiet"] else " (machine NOT quiet: no figure)"
    rows = [
        [
            f"batch of {found['runs']} runs, wall (s)",
            f"{found['wall_one']:.2f}",
            f"{found['wall_two']:.2f}",
            f"{found['ratio']:.2f}{quiet}",
        ],
        ["ratio that CPU times of whole runs allow", "", "", f"{found['ratio_of_cpu_times']:.2f}"],
        ["ratio that CPU times of time loops allow", "", "", f"{found['ratio_of_loops']:.2f}"],
        [
            "cores that an empty loop gets",
            f"{before['one_core']:.2f}",
            f"{before['two_cores']:.2f}",
            f"{2.0 / before['slowdown']:.2f}",
        ],
    ]
    return ["one and two cores", "one", "two", "ratio"], rows


def _commands(found: dict[str, Any]) -> Rows:
    words = {
        "help": "railsim --help",
        "start": "railsim run of 0.1 m: start-up, warm",
        "run": "railsim run, one coach and curve",
        "study": "railsim study, two coaches on two curves, 2 workers",
        "cold_start": "railsim run of 0.1 m, empty caches",
        "start_after": "the same again",
    }
    rows = [
        [words[name], f"{run['wall']:.2f}", f"{run['cpu']:.2f}", f"{run['memory'] / 1e6:.0f}"]
        for name, run in found.items()
    ]
    return ["whole commands", "wall (s)", "CPU (s)", "peak memory (MB)"], rows


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", default="bench.json")
    parser.add_argument("--small", action="store_true")
    asked = parser.parse_args()
    found = measure(small=asked.small)
    Path(asked.out).write_text(json.dumps(found, indent=2, default=float) + "\n")
    for header, rows in tables(found):
        print(*("  ".join(row) for row in [header, *rows]), "", sep="\n")


if __name__ == "__main__":
    main()
