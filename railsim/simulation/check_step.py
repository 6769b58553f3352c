"""An estimate of a run's error from its time step: the run again at half the step.

The scheme `fast` is of order two: the difference between both runs is about three quarters of the
error of the first one, and three times that of the second.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from railsim.compare import Comparison, compare
from railsim.result import Result
from railsim.simulation.run import simulate
from railsim.table import Amount, Column, Table

FULL, HALF = "step", "half"


def half_step(result: Result, *, progress: Callable[[float], None] | None = None) -> Result:
    """Run the inputs of a result again at half its step; the new result is kept in memory.

    `progress`: called repeatedly with the finished fraction. Raises InputError, ModelError: as
    `railsim.simulate`.
    """
    inputs = result.inputs()
    inputs["settings"] = inputs["settings"].replace(step=0.5 * float(result.attributes["step"]))
    return simulate(**inputs, progress=progress)


def step_differences(result: Result, half: Result) -> tuple[Comparison, ...]:
    """Compare the peaks of a run, `FULL`, with those at half its step, `HALF`, the reference.

    Not what one of them lacks, as a full curve that it did not reach.
    """
    return tuple(row for row in compare({HALF: half, FULL: result}) if len(row.peaks) == 2)


def difference_record(row: Comparison) -> dict[str, Any]:
    """Return one line of the check as plain numbers and strings, SI."""
    full, half = row.peaks[FULL], row.peaks[HALF]
    return {
        "quantity": row.quantity.name,
        "where": row.where,
        "unit": row.quantity.unit,
        "value": full.value,
        "half_step_value": half.value,
        "difference": full.value - half.value,
    }


def step_table(result: Result, differences: Sequence[Comparison]) -> Table:
    """Return what half the step changes."""
    step = float(result.attributes["step"])
    rows = []
    for row in differences:
        full, half = row.peaks[FULL].value, row.peaks[HALF].value
        column = Column.of(row.quantity)
        changed = Amount(full - half, replace(column, format="+.2g"))
        relative = Amount(row.differences[FULL], Column("", unit="%", format="+.2g"))
        rows.append([row.quantity.words, row.where, Amount(full, column), changed, relative])
    columns = [
        Column("quantity", f"Check of the step, {1e3 * step:.4g} ms"),
        Column("where", " "),
        Column("value", format=">"),
        Column("change", "less that at half", format=">"),
        Column("share", "%", format=">"),
    ]
    return Table(columns, rows)
