"""The same quantities of several results side by side.

The first result is what the others are compared with.  Differences are those of the magnitudes,
(|b| - |a|) / |a|, so that a mirrored run differs by nothing.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Any

from railsim.errors import Fault, InputError
from railsim.notation import Quantity
from railsim.result import Peak, Result, mid_curves, peaks
from railsim.text import spreadsheet_cell

WORDS = {"abs": "peak", "max": "largest", "min": "smallest"}


@dataclass(frozen=True)
class Comparison:
    """One value of all results.

    Attributes
    ----------
    quantity : Quantity
        What is compared.
    where : str
        ``peak``, ``largest`` or ``smallest`` of the run, or ``full curve 1, median``.
    peaks : mapping of str to Peak
        The value of every result that has it, by the result's label.
    """

    quantity: Quantity
    where: str
    peaks: Mapping[str, Peak]

    @property
    def differences(self) -> dict[str, float]:
        """Relative difference of every magnitude from the first one's; nan if that is zero."""
        first = abs(next(iter(self.peaks.values())).value)
        return {
            label: (abs(peak.value) - first) / first if first > 0.0 else nan
            for label, peak in self.peaks.items()
        }

    def record(self) -> dict[str, Any]:
        """Return the comparison as plain numbers and strings, SI."""
        differences = self.differences
        return {
            "quantity": self.quantity.name,
            "where": self.where,
            "values": {
                label: {
                    **peak.record(),
                    "difference": None if isnan(differences[label]) else differences[label],
                }
                for label, peak in self.peaks.items()
            },
        }


def compare(results: Mapping[str, Result]) -> tuple[Comparison, ...]:
    """Compare the peaks and the full-curve values of results.

    Parameters
    ----------
    results : mapping of str to Result
        Results by what they are called; the first is what the others are compared with.

    Returns
    -------
    tuple of Comparison
        Peaks first, then the medians over every full curve that the first result passed.
    """
    rows: dict[tuple[str, str], dict[str, Peak]] = {}
    for label, result in results.items():
        for peak in peaks(result):
            rows.setdefault((WORDS[peak.kind], peak.quantity.name), {})[label] = peak
        for number, curve in enumerate(mid_curves(result), start=1):
            where = f"full curve {number}, median"
            for peak in curve.median_peaks:
                rows.setdefault((where, peak.quantity.name), {})[label] = peak
    first = next(iter(results))
    empty = [label for label, result in results.items() if not len(result["time"])]
    if empty:
        raise InputError(
            Fault(label, "time", f"holds no instants ({results[label].status})", "leave it out")
            for label in empty
        )
    return tuple(
        Comparison(found[first].quantity, where, found)
        for (where, _), found in rows.items()
        if first in found
    )


def comparison_csv(rows: Sequence[Comparison]) -> str:
    """Return comparisons as comma-separated values, one line for each value, SI."""
    columns = ["quantity", "unit", "where", "result", "value", "wheelset", "side"]
    columns += ["time", "distance", "difference"]
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n", extrasaction="ignore")
    writer.writeheader()
    for row in rows:
        for label, value in row.record()["values"].items():
            facts = {"quantity": row.quantity.name, "where": row.where, "result": label}
            row_cells = {**value, **facts}
            writer.writerow({name: spreadsheet_cell(cell) for name, cell in row_cells.items()})
    return text.getvalue()
