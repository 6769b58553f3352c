"""Tables of `docs/validation/robustness.md`.

Part `rigid` writes that of rigid rails into the page, in a minute.  Without a part the differences
of twenty curves on elastic rails are printed, in five minutes, with `grid` those of all 280, in
half an hour.
"""

import sys
from pathlib import Path

import numpy as np

from generators.filling import fill_page, table

DOCS = Path(__file__).parents[1]
sys.path[:0] = [str(DOCS.parent / "tests" / folder) for folder in ("", "verification")]
from robustness import CASES, FRICTIONS, RADII, RIGID_CASES, peaks, rigid_row, ways  # noqa: E402
from test_robustness import CHOSEN, REFERRED  # noqa: E402

SUPPORT = {"preset": "ballasted"}


def grid():
    """Largest peaks and differences over coaches and cant deficiencies."""
    found = {case: ways(case, SUPPORT) for case in CASES}
    rows = []
    for radius in RADII:
        for friction in FRICTIONS:
            cell = [found[case] for case in CASES if case[1:3] == (radius, friction)]
            largest = np.max([peaks(result) for _, result in cell], axis=0)
            moved = np.max([differences for differences, _ in cell], axis=0)
            ended = sum(result.status != "complete" for _, result in cell)
            rows.append(
                (
                    f"{radius:g}",
                    f"{friction:g}",
                    f"{100.0 * (largest[0] - 1.0):.1f}",
                    f"{largest[3]:.3f}",
                    *(f"{value:.2f}" for value in moved),
                    str(ended),
                )
            )
    head = (
        "R (m)",
        "friction",
        "dQ/Q0 (%)",
        "Y/Q",
        "half step",
        "half damping",
        "twice",
        "not complete",
    )
    return table(head, rows)


def chosen():
    """Twenty cases; some of them by `rk4` at 0.125 ms too."""
    rows = []
    for case in CHOSEN:
        differences, result = ways(case, SUPPORT, reference=case in REFERRED)
        largest = peaks(result)
        coach, radius, friction, deficiency = case
        moved = [f"{value:.2f}" for value in differences]
        rows.append(
            (
                coach,
                f"{radius:g}",
                f"{friction:g}",
                f"{1e3 * deficiency:g}",
                f"{100.0 * (largest[0] - 1.0):.1f}",
                f"{largest[3]:.3f}",
                *moved,
                *[""] * (4 - len(moved)),
            )
        )
    head = (
        "coach",
        "R (m)",
        "friction",
        "cant deficiency (mm)",
        "dQ/Q0 (%)",
        "Y/Q",
        "half step",
        "half damping",
        "twice",
        "rk4",
    )
    return table(head, rows)


def rigid():
    """Cases on rigid rails: largest dQ/Q0 of both schemes, and what the runs remark."""
    head = (
        "R (m), friction",
        "step chosen (ms)",
        "`fast`, dQ/Q0 (%)",
        "`rk4` 0.125 ms, dQ/Q0 (%)",
        "vibration of wheel loads, `fast`; `rk4`",
    )
    return table(head, map(rigid_row, RIGID_CASES))


PARTS = ("rigid", "grid")


def make(parts):
    """Fill the table, or print the differences."""
    if "rigid" in parts:
        fill_page(DOCS / "validation" / "robustness.md", {"rigid": rigid})
    elif "grid" in parts:
        print(grid())
    else:
        print(chosen())
