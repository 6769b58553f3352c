"""What summaries and reports say of a result, without its arrays."""

from typing import Any

from railsim.definitions.track.definition import Track
from railsim.result.data import Result
from railsim.result.extremes import PEAK_QUANTITIES, mid_curves, peaks

FACTS = (
    "status", "status_reason", "step", "wall_time", "cpu_time", "real_time_factor",
    "patches_out_of_range",
)  # fmt: skip


OF_FACTS = frozenset({*PEAK_QUANTITIES, "Q0", "time", "distance", "wheelset_distance"})
"""Quantities that facts are taken from."""


def run_facts(result: Result, track: Track | None = None) -> dict[str, Any]:
    """Return how a run ended, its remarks, peaks and mid-curve values as plain data [SI].

    `track` is that of the result, where it is at hand.
    """
    return {
        **{name: result.attributes[name] for name in FACTS if name in result.attributes},
        "remarks": list(result.remarks),
        "peaks": [peak.record() for peak in peaks(result)],
        "mid_curves": [curve.record() for curve in mid_curves(result, track=track)],
    }
