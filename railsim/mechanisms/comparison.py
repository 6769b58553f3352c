"""Several mechanisms side by side at equal output; the first is the reference."""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from railsim.errors import InputError
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.outputs import equal_lengths, length_points, outputs
from railsim.mechanisms.targets import Positions, follow_error

POINTS = 215
"""Positions in the zone: ratios in equal steps of the reference's length, forces of the travel."""


def compare(results: Sequence[Analysis]) -> list[dict[str, Any]]:
    """Compare mechanisms with the first one.

    Returns
    -------
    list of dict
        Results of each by name, where it has them; `error` is the sum of squared differences of the
        ratio from the reference's at equal heights, NaN where there is none.
    """
    reference = _reference(results[0])
    rows = []
    for result in results:
        limited = [v for n, v in result.min_angles.items() if result.definition.angles[n].limited]
        row: dict[str, Any] = {
            "name": result.definition.name + (f", {result.case}" if result.case else ""),
            "stroke": result.stroke, "max_force": result.max_force, "peak_force": result.peak_force,
            "length_start": float(result.output.get("length", [np.nan])[0]),
            "min_angle": min(limited, default=np.nan),
        }  # fmt: skip
        if result.zone and "force" in result.zone["work"]:
            forces = outputs(_dense(result, POINTS))["force"]
            row["work_force"] = result.zone["work"]["force"]
            row["zone_spread"] = float(np.ptp(forces) / np.mean(forces))
        row["error"] = float("nan")
        with suppress(InputError):  # where its output does not reach the reference's heights
            if reference is not None:
                row["error"] = follow_error(result.definition, reference)
        rows.append(row)
    return rows


def _reference(result: Analysis) -> Positions | None:
    """Heights and ratios of a mechanism in its zone, else over its whole travel."""
    pair = length_points(result.definition)
    if pair is None or result.definition.output is None:
        return None
    dense = _dense(result, 101)
    s = equal_lengths(dense, pair, dense.length(pair)[0][[0, -1]], POINTS)
    return Positions.of(solve(result.model, s), pair)


def _dense(result: Analysis, count: int) -> Motion:
    """Positions at equal steps of the driver over the zone, else over the whole travel."""
    model, zone = result.model, result.zone
    ends = [zone[k]["travel"] for k in ("low", "high")] if zone else [model.start, model.end]
    return solve(model, np.linspace(ends[0], ends[1], count))
