"""Fill the tables of docs/performance.md with the figures in results/.

    python benchmarks/tables.py

`bench.json` is the output of `whole.py`, `peers.json` and `growth.json` those of the scripts of the
same names.
"""

import json
import sys
from pathlib import Path
from typing import Any

from whole import tables

RESULTS = Path(__file__).parent / "results"
DOCS = Path(__file__).parents[1] / "docs"
sys.path.insert(0, str(DOCS))
from generate import filled, table  # noqa: E402

BENCH = ("loop", "parts", "fastsim_grids", "ensembles", "cores", "commands")
GROWTH = ("wheelsets", "cells", "output", "length")


def peer_row(name: str, setting: str, record: dict[str, Any], ours: dict[str, Any]) -> list[str]:
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
    header = [
        "",
        "setting",
        "x real time",
        "railsim ahead by",
        "dQ/Q0 (points)",
        "Y (kN)",
        "yaw (%)",
        "as right",
    ]
    rows = []
    for key, words in (("scipy", "curve"), ("scipy, irregular track", "irregular straight")):
        part = found[key]
        ours = part["railsim"]
        rows.append(peer_row(f"railsim, {words}", f"{1e3 * ours['step']:g} ms", ours, ours))
        rows += [
            peer_row(
                f"scipy {record['method']}",
                f"rtol {record['options']['tolerance']:g}",
                record,
                ours,
            )
            for record in part["candidates"]
        ]
    part = found["exudyn"]
    ours = part["railsim"]
    rows.append(peer_row("railsim, simplified coach", f"{1e3 * ours['step']:g} ms", ours, ours))
    rows += [
        peer_row(f"Exudyn {record['method']}", f"{1e3 * record['step']:g} ms", record, ours)
        for record in part["candidates"]
    ]
    return table(header, rows)


def fastsim(found: dict[str, Any]) -> str:
    times = found["per_patch"]
    rows = [
        [name, f"{1e6 * time:.3f}", f"{time / times['railsim']:.0f}"]
        for name, time in times.items()
        if not name.startswith("march")
    ]
    return table(["FASTSIM 10 x 10", "us per patch", "ratio"], rows)


def growth(found: dict[str, Any]) -> list[str]:
    return [
        table(
            ["wheelsets", "patches", "states", "us per evaluation", "us per wheelset"],
            [
                [
                    str(r["wheelsets"]),
                    str(r["patches"]),
                    str(r["states"]),
                    f"{1e6 * r['time']:.2f}",
                    f"{1e6 * r['time'] / r['wheelsets']:.2f}",
                ]
                for r in found["wheelsets"]
            ],
        ),
        table(
            ["FASTSIM's grid", "us per evaluation"],
            [[f"{r['grid']} x {r['grid']}", f"{1e6 * r['time']:.2f}"] for r in found["cells"]],
        ),
        table(
            ["outputs per s", "step (ms)", "x real time"],
            [
                [f"{r['rate']:g}", f"{1e3 * r['step']:.3f}", f"{r['real_time']:.0f}"]
                for r in found["output"]
            ],
        ),
        table(
            ["track (km)", "CPU (s)", "peak memory (MB)", "file (MB)"],
            [
                [
                    f"{r['kilometres']:g}",
                    f"{r['cpu']:.1f}",
                    f"{r['memory'] / 1e6:.0f}",
                    f"{r['file'] / 1e6:.1f}",
                ]
                for r in found["length"]
            ],
        ),
    ]


def main() -> None:
    def load(name: str) -> dict[str, Any]:
        return dict(json.loads((RESULTS / f"{name}.json").read_text()))

    bench, found = load("bench"), load("peers")
    known = dict(zip(BENCH, (table(*made) for made in tables(bench)), strict=True))
    known |= {"peers": peers(found), "fastsim": fastsim(found["fastsim"])}
    known |= dict(zip(GROWTH, growth(load("growth")), strict=True))
    page = DOCS / "performance.md"
    page.write_text(filled(page.read_text(), known))


if __name__ == "__main__":
    main()
