"""Fill the tables of `docs/validation/robustness.md`.

``python docs/generate_robustness.py [grid] [reference]``: the grid of 280 curves takes ten minutes,
its twenty cases by the reference scheme five.
"""

import sys
from pathlib import Path

import numpy as np
from generate import fill_page, table

DOCS = Path(__file__).parent
PAGE = DOCS / "validation" / "robustness.md"
sys.path.insert(0, str(DOCS.parent / "tests" / "verification"))
from robustness import CASES, FRICTIONS, RADII, peaks, ways  # noqa: E402

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
            rows.append((f"{radius:g}", f"{friction:g}", f"{100.0 * (largest[0] - 1.0):.1f}",
                         f"{largest[3]:.3f}", *(f"{value:.2f}" for value in moved), str(ended)))
    head = ("R (m)", "friction", "dQ/Q0 (%)", "Y/Q", "half step", "half damping", "twice",
            "not complete")
    return table(head, rows)


def reference():
    """Twenty cases by `rk4` at 0.125 ms."""
    rows = []
    for case in CASES[5::14]:
        differences, result = ways(case, SUPPORT, reference=True)
        largest = peaks(result)
        coach, radius, friction, deficiency = case
        rows.append((coach, f"{radius:g}", f"{friction:g}", f"{1e3 * deficiency:g}",
                     f"{100.0 * (largest[0] - 1.0):.1f}", f"{largest[3]:.3f}",
                     f"{differences[-1]:.2f}"))
    head = ("coach", "R (m)", "friction", "cant deficiency (mm)", "dQ/Q0 (%)", "Y/Q",
            "difference from rk4")
    return table(head, rows)


if __name__ == "__main__":
    fill_page(PAGE, {"grid": grid, "reference": reference})
