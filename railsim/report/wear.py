"""Wear over distance or tonnage in words and tables, for the terminal and for a page."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from railsim.notation import SIDES
from railsim.table import Column, Table

Rows = Mapping[str, list[dict[str, float | None]]]


class Worn(NamedTuple):
    """What wears: by what amount it is told, and how it is shown."""

    amount: str  # distance or tonnage: the option and the column
    unit: str
    scale: float  # of the unit, to SI
    note: str  # what is averaged, and where y begins
    sides: tuple[str, ...]  # names of its profiles


OF_WHEELS = "mean of all wheels; y from the nominal rolling circle, negative towards the flange"
OF_RAILS = "both rails; y from the middle of the rail, negative towards the gauge side"
WHEELS = Worn("distance", "km", 1e3, OF_WHEELS, ("wheel",))
RAILS = Worn("tonnage", "Mt", 1e9, OF_RAILS, SIDES)


def shares_of(runs: Sequence[dict[str, Any]]) -> str:
    """Return in words what runs at what speed, with its share of the amount."""
    total = sum(run["share"] for run in runs)
    return ", ".join(
        f"{share / total:.0%} {name} at {v:g} m/s" for name, v, share in map(dict.values, runs)
    )


def wear_tables(worn: Worn, rows: Rows) -> list[Table]:
    """Return the table of each profile, one row for each step; a depth shown as 0 has no place."""
    columns = [
        Column("distance", worn.amount, worn.unit, "g"),
        Column("area", "worn area", "mm2", ".4f"),
        deepest := Column("deepest", "", "mm", ".4f"),
        Column("deepest_y", "at y", "mm", ".1f"),
        Column("equivalent_conicity", "conicity at 3 mm", "", ".3f"),
        Column("flange_thickness", "flange thickness", "mm", ".2f"),
        Column("flange_height", "flange height", "mm", ".2f"),
        Column("hollow", "hollow", "mm", ".2f"),
    ]
    tables = []
    for side, steps in rows.items():
        present = [column for column in columns if column.name in steps[0]]
        steps = [
            row if float(deepest.text(row["deepest"])) else row | {"deepest_y": None}
            for row in steps
        ]
        tables.append(Table(present, steps, "" if side == "rows" else f"{side} rail"))
    return tables
