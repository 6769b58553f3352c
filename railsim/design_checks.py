"""A value against its limit, in design tools of springs and mechanisms; all of them in a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from railsim.notation import SHOWN_UNITS
from railsim.table import Amount, Column, Table

ROUNDING = 1e-5
"""Share of a limit by which rounding may miss it: dimensions have six or seven digits."""

NEAR_BOUND = 0.02
"""Share of a range, or of a limit, within which an optimum counts as at it: evolving designs end up
to 1.9 % from a bound that holds them, after 80 evaluations."""

SHOWN = {"m": "mm", "rad": "deg", "Pa": "MPa"}
"""Unit in which a design tool shows values of an SI unit."""


@dataclass(frozen=True)
class Check:
    """A value against its limit, in SI units; on the limit counts as met."""

    name: str
    value: float
    limit: float
    sense: str  # side on which it must be, "above" or "below"; "about": a rule of thumb
    unit: str
    note: str  # what is compared, where the limit comes from

    @property
    def ok(self) -> bool:
        """Whether it is met; a rule of thumb always is."""
        excess = (self.value - self.limit) * {"above": 1.0, "below": -1.0, "about": 0.0}[self.sense]
        return bool(excess >= -ROUNDING * abs(self.limit))

    @property
    def data(self) -> dict[str, Any]:
        """The check as plain values."""
        return {"name": self.name, "value": self.value, "limit": self.limit, "ok": self.ok,
            "unit": self.unit, "must_be": self.sense, "note": self.note}  # fmt: skip


def shown_unit(unit: str) -> str:
    """Return the unit in which values of an SI unit are shown."""
    return SHOWN.get(unit, "" if unit == "1" else unit)


def with_unit(value: float, unit: str, digits: int = 6) -> str:
    """Return an SI value in the unit in which it is shown, with that unit."""
    name = shown_unit(unit)
    return f"{value * SHOWN_UNITS.get(name, ('', 1.0))[1]:.{digits}g} {name}".rstrip()


def check_table(checks: Sequence[Check], *, notes: bool = False) -> Table:
    """Return one row for each check, with `notes` also what is compared."""
    signs = {"above": ">=", "below": "<=", "about": "about"}
    rows = []
    for check in checks:
        unit = shown_unit(check.unit)
        column = Column("", unit=unit, format=".2f" if unit else ".3f")
        met = "-" if check.sense == "about" else "pass" if check.ok else "fail"
        limit = f"{signs[check.sense]} {column.text(check.limit)}"
        value = Amount(check.value, column, limit=check.limit)
        rows.append([check.name, value, limit, unit, met, check.note])
    numbers = Column("value", format=".2f"), Column("must be", format=">")
    columns: list[Column | str] = ["check", *numbers, "unit", "met", "comparison"]
    count = len(columns) if notes else len(columns) - 1
    return Table(columns[:count], [row[:count] for row in rows])


def verdict(checks: Sequence[Check]) -> dict[str, Any]:
    """Return whether all checks are met, and the sentence that says so."""
    failed = [check.name for check in checks if not check.ok]
    text = f"All {len(checks)} checks are met." if len(checks) > 1 else "The check is met."
    if failed:
        text = f"Not met: {', '.join(failed)}."
    elif not checks:
        text = "The file states no limits to check."
    return {"ok": not failed, "text": text}
