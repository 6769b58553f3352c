"""Sections and tables of a page, and values in words."""

from calendar import month_name
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from railsim import table as values

Cell = str | tuple[str, str]  # a value, or a value with small print below it


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Attributes
    ----------
    header : sequence of str
    rows : sequence of sequences of Cell
    caption : str
    words : frozenset of int
        Columns with text.
    failed : frozenset of int
        Rows in red.
    note : str
        A sentence below it.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    words: Collection[int] = (0,)
    failed: Collection[int] = ()
    note: str = ""


@dataclass(frozen=True)
class Drawing:
    """A drawing or a picture of the page; `kinds` are the labels of its colours."""

    title: str
    words: str
    svg: str
    kinds: Sequence[str] = ()


@dataclass
class Section:
    """A section of the page.

    `plots`: Plots that the script of the page draws: the number of a group of curves, or
    ``spread``.
    """

    id: str
    title: str
    texts: list[str] = field(default_factory=list)
    drawings: list[Drawing] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plots: list[str] = field(default_factory=list)
    details: list[Table] = field(default_factory=list)  # tables that are folded at first


def of_values(table: values.Table, subject: str) -> Table:
    """Return a table of values for the page; its caption begins with its subject."""
    return Table(
        [column.heading for column in table.columns],
        table.texts(),
        f"{subject}: {table.caption}" if table.caption else subject,
        words=[k for k, column in enumerate(table.columns) if not column.format],
    )


def day(created: str) -> str:
    """A time of ISO 8601 in words.

    Examples
    --------
    >>> day("2026-11-03T15:04:20+00:00"), day("earlier")
    ('3 November 2026, 15:04', 'earlier')
    """
    try:
        when = datetime.fromisoformat(created)
    except ValueError:
        return created
    return f"{when.day} {month_name[when.month]} {when.year}, {when:%H:%M}"


def in_words(value: Any) -> str:
    """A value of a file in words: no brackets of Python.

    Examples
    --------
    >>> in_words((10, 10)), in_words(True), in_words(None), in_words(0.1 + 0.2)
    ('10, 10', 'yes', 'none', '0.3')
    """
    if isinstance(value, tuple | list):
        return ", ".join(map(in_words, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def listed(names: Sequence[str]) -> str:
    """The first names of a list, and how many more there are."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more
