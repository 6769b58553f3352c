"""Time histories of several runs, thinned for the plots of a page.

Runs over the same alignment share their horizontal axis, the distance, divided into equal cells: as
many as the outputs of a run fill, if the page stays small; the page draws what its width shows.
The smallest and the largest value of each cell are kept, in the order in which they occur, so that
no peak is lost.  Values are stored as 16-bit integers between the smallest and the largest value of
a quantity.
"""

from base64 import b64encode
from collections.abc import Sequence
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.layout import curvature_sections
from railsim.notation import plain_symbol
from railsim.plot.selection import STUDY, limit_of
from railsim.result import Result, Results
from railsim.text import printable

CELLS = 6400  # of the horizontal axis; the page draws fewer, and more where it is zoomed
MOST_VALUES = 1_600_000  # of all curves of a page, 2 bytes each
MISSING = 65535  # code for no value
STANDS_STILL = 1.0  # m; below it the time is the horizontal axis


def groups(results: Results) -> list[dict[str, Result]]:
    """Group results, by the names of their runs, by alignment; omit runs without instants."""
    by_alignment: dict[tuple[Any, ...], dict[str, Result]] = {}
    for name, result in results.items():
        if len(result["time"]) < 2:
            continue
        track = result.track()
        plan = ((s.type, s.begin, s.end, s.start_value) for s in curvature_sections(track))
        by_alignment.setdefault((track.name, *plan), {})[name] = result
    return list(by_alignment.values())


def curve_data(results: Results, cells: int = CELLS) -> dict[str, Any]:
    """Return the curves of runs over the same alignment as plain data for the page.

    `cells`: Number of cells of the horizontal axis.
    """
    moved = (np.ptp(result["distance"][[0, -1]]) > STANDS_STILL for result in results.values())
    over = "distance" if all(moved) else "time"
    low = min(float(result[over][0]) for result in results.values())
    high = max(float(result[over][-1]) for result in results.values())
    shortest = min(len(result[over]) for result in results.values())
    cells = max(1, min(cells, shortest // 2))
    edges = np.linspace(low, high, cells + 1)
    wheelsets = max((result.wheelsets for result in results.values()), key=len)
    quantities = [_quantity(results, name, over, edges, len(wheelsets)) for name in STUDY]
    first = next(iter(results.values()))
    return {
        "track": printable(first.track().name),
        "axis": "Distance along the track s (m)" if over == "distance" else "Time t (s)",
        "runs": [printable(f"{name}{result.end_words}") for name, result in results.items()],
        "wheelsets": [printable(name) for name in wheelsets], "low": low, "high": high,
        "cells": cells, "sections": _sections(first) if over == "distance" else [],
        "quantities": [quantity for quantity in quantities if quantity],
    }  # fmt: skip


def _sections(result: Result) -> list[dict[str, Any]]:
    return [
        {
            "begin": section.begin, "end": section.end, "curve": section.type == "CIR",
            "words": f"R {1.0 / section.start_value:.6g}" if section.type == "CIR" else "",
        }
        for section in curvature_sections(result.track())
        if section.type != "STR"
    ]  # fmt: skip


def _quantity(
    results: Results, name: str, over: str, edges: Floats, wheelsets: int
) -> dict[str, Any] | None:
    """Return one quantity of all runs in the units of plots; None where no run has it."""
    having = [result for result in results.values() if name in result]
    if not having:
        return None
    quantity = having[0].quantities[name]
    sides = 2 if "side" in quantity.dims else 1
    values = np.full((len(results), wheelsets, sides, 2 * (len(edges) - 1)), np.nan)
    for row, result in enumerate(results.values()):
        if name in result:
            array = result[name].reshape(len(result["time"]), -1, sides)
            thin = thinned(result[over], array.reshape(len(array), -1), edges)
            count = array.shape[1]
            values[row, :count] = thin.T.reshape(count, sides, -1)
    values *= quantity.scale
    low, high, codes = encode(values)
    limit = limit_of(name, results.values())
    return {
        "name": name, "words": quantity.title,
        "symbol": plain_symbol(quantity.symbol), "unit": quantity.shown_unit.replace("-", ""),
        "sign": quantity.sign, "sides": sides, "low": low, "high": high,
        "least": quantity.least, "limit": limit[0] * quantity.scale if limit else None,
        "limit_words": limit[1] if limit else "", "codes": codes,
    }  # fmt: skip


def thinned(axis: Floats, values: Floats, edges: Floats) -> Floats:
    """Return the smallest and the largest value of every cell, in the order of their occurrence.

    `axis` (float64[n]): Positions of the values, not decreasing. `values` (float64[n, m]): nan
    where there is none. `edges` (float64[cells + 1]): Ends of the cells. Returns float64[2 cells,
    m]: In a cell without instants, interpolated values; nan outside the run.
    """
    cells = len(edges) - 1
    starts = np.searchsorted(axis, edges)
    starts[-1] = len(axis) if edges[-1] >= axis[-1] else starts[-1]
    found = np.full((2 * cells, values.shape[1]), np.nan)
    filled = np.flatnonzero(starts[1:] > starts[:-1])
    if len(filled):
        first, last = starts[filled[0]], starts[filled[-1] + 1]
        own = values[first:last]
        begins = starts[filled] - first
        of = np.repeat(np.arange(len(filled)), np.diff(np.append(begins, len(own))))
        place = np.arange(len(own))[:, None]
        low, high = (extreme.reduceat(own, begins) for extreme in (np.fmin, np.fmax))
        # where each occurs first
        low_at, high_at = (
            np.minimum.reduceat(np.where(own == best[of], place, len(own)), begins)
            for best in (low, high)
        )
        found[2 * filled] = np.where(low_at < high_at, low, high)
        found[2 * filled + 1] = np.where(low_at < high_at, high, low)
    empty = np.flatnonzero(starts[1:] == starts[:-1])
    for rows, share in ((2 * empty, 0.25), (2 * empty + 1, 0.75)):
        at = edges[empty] + share * (edges[empty + 1] - edges[empty])
        found[rows] = np.transpose([np.interp(at, axis, x, np.nan, np.nan) for x in values.T])
    return found


def encode(values: Floats) -> tuple[float, float, str]:
    """Return smallest and largest value, and all values as 16-bit integers between, in base64."""
    finite = np.isfinite(values)
    low = float(values[finite].min()) if finite.any() else 0.0
    high = float(values[finite].max()) if finite.any() else 0.0
    step = (high - low) / (MISSING - 1) or 1.0
    codes = np.full(values.shape, MISSING, dtype="<u2")
    codes[finite] = np.rint((values[finite] - low) / step).astype("<u2")
    return low, high, b64encode(codes.tobytes()).decode()


def cells_of(grouped: Sequence[Results]) -> int:
    """Return the number of cells of all curves for which the page stays small."""
    each = ([len(result.wheelsets) for result in results.values()] for results in grouped)
    lines = 9 * sum(len(numbers) * max(numbers) for numbers in each)
    return max(50, min(CELLS, MOST_VALUES // max(1, 2 * lines)))
