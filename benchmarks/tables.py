"""Fill the tables of docs/performance.md with the figures in results/.

    python benchmarks/tables.py

`bench.json` is the output of `whole.py`, `speeds.json` that of `irregular.py`, `study.json` and
`study_files.json` those of `study_cost.py`, `versions.json`, `peers.json` and `growth.json` those
of the scripts of the same names.
"""

import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

from versions import THIS, ratio
from whole import tables

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
sys.path.insert(0, str(ROOT / "docs"))
from generators.filling import fill_page, table  # noqa: E402

BENCH = ("loop", "parts", "fastsim_grids", "cores", "commands")
Row = list[str]


def peer_row(name: str, setting: str, record: dict[str, Any], ours: dict[str, Any]) -> Row:
    error = record.get("error")
    return [
        name,
        setting,
        f"{record['real_time']:.1f}",
        f"{ours['real_time'] / record['real_time']:.1f}",
        f"{100.0 * error['dQ_over_Q0']:.4f}" if error else "failed",
        f"{1e-3 * max(error['Y'], error['Y_mid_curve']):.4f}" if error else "",
        f"{100.0 * error['yaw']:.3f}" if error else "",
        "yes" if record["allowed"] else "no",
    ]


def peers(found: dict[str, Any]) -> str:
    head = "|setting|x real time|railsim ahead by|dQ/Q0 (points)|Y (kN)|yaw (%)|as right"
    rows = []
    for key, words, other in (
        ("scipy", "curve", "scipy"),
        ("scipy, irregular track", "irregular straight", "scipy"),
        ("exudyn", "simplified coach", "Exudyn"),
    ):
        ours = found[key]["railsim"]
        rows.append(peer_row(f"railsim, {words}", f"{1e3 * ours['step']:g} ms", ours, ours))
        for record in found[key]["candidates"]:
            step = f"{1e3 * record['step']:g} ms" if "step" in record else ""
            setting = step or f"rtol {record['options']['tolerance']:g}"
            rows.append(peer_row(f"{other} {record['method']}", setting, record, ours))
    return table(head.split("|"), rows)


def fastsim(found: dict[str, Any]) -> str:
    times = found["per_patch"]
    rows = [
        [name, f"{1e6 * time:.3f}", f"{time / times['railsim']:.0f}"]
        for name, time in times.items()
        if not name.startswith("march")
    ]
    return table(["FASTSIM 10 x 10", "us per patch", "ratio"], rows)


def irregular(found: dict[str, Any]) -> str:
    """Irregular rails: what the scheme did, speed, errors."""
    head = "run|step (ms)|divided (%)|evaluations a step|x real time|peaks (%)|rms (%)"
    rows = []
    for name, run in found.items():
        again = run["contacts_evaluated_again"] / run["steps"]
        rows.append(
            [
                name.replace("ballasted", "elastic"),
                f"{1e3 * run['step']:.3g}",
                f"{100.0 * run['steps_divided'] / run['steps']:.1f}",
                f"{run['evaluations'] / run['steps']:.2f}" + (f" + {again:.1f}" if again else ""),
                f"{median(run['real_time']):.0f}",
                *(" ".join(f"{x:.2f}" for x in run[errors]) for errors in ("peaks", "rms")),
            ]
        )
    return table(head.split("|"), rows)


def study(*found: dict[str, Any]) -> str:
    head = "kept|runs|CPU (s)|own time loops (s)|CPU outside them, a run (ms)|bytes a run"
    rows = [
        "{keep}|{runs}|{cpu:.1f}|{own:.1f}|{outside:.0f}|{each:.0f}".format(
            **one, outside=1e3 * (one["cpu"] - one["own"]) / one["runs"],
            each=one["bytes"] / one["runs"],
        ).split("|")
        for one in found
    ]  # fmt: skip
    return table(head.split("|"), rows)


def growth(found: dict[str, Any]) -> dict[str, str]:
    """Tables by name: the cost over what makes a run larger."""
    columns = {
        "wheelsets": (
            "wheelsets|patches|states|us per evaluation|us per wheelset",
            "{wheelsets}|{patches}|{states}|{us:.2f}|{us_each:.2f}",
        ),
        "cells": ("FASTSIM's grid|us per evaluation", "{grid} x {grid}|{us:.2f}"),
        "output": ("outputs per s|step (ms)|x real time", "{rate:g}|{ms:.3f}|{real_time:.0f}"),
        "length": (
            "track (km)|CPU (s)|peak memory (MB)|file (MB)",
            "{kilometres:g}|{cpu:.1f}|{memory_MB:.0f}|{file_MB:.1f}",
        ),
    }
    made = {}
    for name, (head, row) in columns.items():
        rows = []
        for record in found[name]:
            us = 1e6 * record.get("time", 0.0)
            more = {
                "us": us,
                "us_each": us / record.get("wheelsets", 1),
                "ms": 1e3 * record.get("step", 0.0),
                "memory_MB": record.get("memory", 0) / 1e6,
                "file_MB": record.get("file", 0) / 1e6,
            }
            rows.append(row.format(**record, **more).split("|"))
        made[name] = table(head.split("|"), rows)
    return made


def speed(bench: dict[str, Any], speeds: dict[str, Any], peers: dict[str, Any]) -> str:
    """What people run, and the fastest others at equal error."""
    loops = {run["name"]: run["real_time"] for run in bench["runs"]}
    real = {name: median(run["real_time"]) for name, run in speeds.items()}
    curve = "Manchester coach, R 250 m"
    straight = "Manchester coach, straight, ERRI B176 low, 40 m/s, {}"
    best, exudyn = peers["scipy"]["best"], peers["exudyn"]["best"]
    rows = [
        ["elastic rails", f"{loops[curve]:.0f}", f"{real[straight.format('ballasted')]:.0f}"],
        ["rigid rails", f"{loops[curve + ', rigid']:.0f}", f"{real[straight.format('rigid')]:.0f}"],
        [f"scipy, {best['method']}, the same equations", f"{best['real_time']:.0f}", ""],
        [f"Exudyn, {exudyn['method']}, the same contact", f"{exudyn['real_time']:.0f}", ""],
    ]
    return table(["", "smooth curve R 250 m, 20 m/s", "ERRI low, 40 m/s"], rows)


def versions(found: dict[str, Any]) -> str:
    """Loops and whole commands of earlier states beside this one."""
    names = [*found["run"]["cpu"]]
    lines = {f"{case}, x real time": times for case, times in found["loops"].items()}
    lines |= {
        "`railsim run`, one coach and curve, CPU time (s)": found["run"]["cpu"],
        "README's main job, empty caches, wall time (s)": found["job"]["wall"],
    }
    rows = []
    for line, times in lines.items():
        values = [f"{median(times[name]):.3g}" if name in times else "" for name in names]
        first = next(iter(times))
        rows.append([line, *values, f"{ratio(times[first], times[THIS.name])} of {first}"])
    return table(["run", *names, "ratio"], rows)


def main() -> None:
    def load(name: str) -> Any:
        return json.loads((RESULTS / f"{name}.json").read_text("utf-8"))

    bench, found, speeds = load("bench"), load("peers"), load("speeds")
    known = dict(zip(BENCH, (table(*made) for made in tables(bench)), strict=True))
    known |= {"peers": peers(found), "fastsim": fastsim(found["fastsim"])}
    known |= {"irregular": irregular(speeds), "study": study(load("study"), load("study_files"))}
    known |= growth(load("growth")) | {"speed": speed(bench, speeds, found)}
    known["versions"] = versions(load("versions"))
    makers = {name: lambda made=made: made for name, made in known.items()}
    fill_page(ROOT / "docs" / "performance.md", makers)


if __name__ == "__main__":
    main()
