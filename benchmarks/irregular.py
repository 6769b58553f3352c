"""Irregular rails, elastic and rigid: speed, error against RK4, and how often the loop evaluates.

    python benchmarks/irregular.py [--repeats 3] [--until 300] [--out irregular.json] [--counts]
        [--runs 1]

Counts do not depend on the machine: `--counts` leaves out times and errors.  Those of the first
150 m are kept in `benchmarks/results/irregular.json` (`--counts --until 150 --out ...`) and
compared in the tests.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from timed_runs import IRREGULAR

from railsim.bench.runs import Scenario
from railsim.result import Result

COUNTS = ("steps", "steps_divided", "evaluations", "contacts_evaluated_again")
SUPPORTS = ("ballasted", "rigid")


def cases(until: float | None = None) -> dict[str, Scenario]:
    """Every run on every support, by its name."""
    return {
        f"{scenario.name}, {support}": replace(
            scenario, support=support, until=until or scenario.until
        )
        for scenario in IRREGULAR
        for support in SUPPORTS
    }


def counts(result: Result) -> dict[str, int]:
    """What the scheme did in a run."""
    return {name: int(result.attributes[name]) for name in COUNTS}


def errors(result: Result, reference: Result) -> dict[str, list[float]]:
    """Differences of the peaks of Q, Y and sum_Y over the largest, rms differences of Q, Y and yaw
    over the standard deviation [%]."""
    peaks, rms = [], []
    for name in ("Q", "Y", "sum_Y"):
        found, expected = (
            np.max(np.abs(run.groups["peaks"][name]), axis=0) for run in (result, reference)
        )
        peaks.append(100.0 * float(np.max(np.abs(found - expected)) / np.max(expected)))
    rows = min(len(result.time), len(reference.time))  # a run may end with one more output
    for name in ("Q", "Y", "wheelset_yaw"):
        found, expected = np.asarray(result[name])[:rows], np.asarray(reference[name])[:rows]
        rms.append(100.0 * float(np.sqrt(np.mean((found - expected) ** 2)) / np.std(expected)))
    return {"peaks": peaks, "rms": rms}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--until", type=float)
    parser.add_argument("--counts", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--runs", type=int, help="number of runs, the first of them")
    asked = parser.parse_args()
    repeats = 1 if asked.counts else asked.repeats
    chosen = dict([*cases(asked.until).items()][: asked.runs])
    runs: dict[str, list[Result]] = {name: [] for name in chosen}
    for _ in range(repeats):  # in turn: what disturbs the machine disturbs all
        for name, scenario in chosen.items():
            runs[name].append(scenario.run())
    found: dict[str, Any] = {}
    for name, scenario in chosen.items():
        first = runs[name][0]
        fact: dict[str, Any] = {"step": first.attributes["step"], **counts(first)}
        if not asked.counts:
            factors = sorted(float(run.attributes["real_time_factor"]) for run in runs[name])
            fact |= {"real_time": factors, **errors(first, scenario.reference())}
        found[name] = fact
        print(f"{name}: {line(fact)}", flush=True)
    if asked.out:
        asked.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def line(fact: dict[str, Any]) -> str:
    """One line of the report."""
    steps = fact["steps"]
    text = (
        f"step {1e3 * fact['step']:.3g} ms, {fact['steps_divided'] / steps:.1%} divided, "
        f"{fact['evaluations'] / steps:.2f} evaluations a step, "
        f"{fact['contacts_evaluated_again'] / steps:.2f} contacts of a wheelset again"
    )
    if "real_time" in fact:
        factors = fact["real_time"]
        peaks, rms = (" ".join(f"{x:.2f}" for x in fact[name]) for name in ("peaks", "rms"))
        text += (
            f"; {np.median(factors):.0f} x real time ({factors[0]:.0f} to {factors[-1]:.0f}), "
            f"peaks {peaks} %, rms {rms} %"
        )
    return text


if __name__ == "__main__":
    main()
