"""Tables of a page."""

from collections.abc import Sequence
from dataclasses import dataclass

from railsim import table as values
from railsim.text import printable

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
    words: frozenset[int] = frozenset({0})
    failed: frozenset[int] = frozenset()
    note: str = ""


def of_values(table: values.Table, subject: str) -> Table:
    """Return a table of values for the page; its caption begins with its subject."""
    return Table(
        [column.heading for column in table.columns],
        table.texts(),
        printable(f"{subject}: {table.caption}"),
        words=frozenset(k for k, column in enumerate(table.columns) if not column.format),
    )
