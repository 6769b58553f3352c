"""Tables: columns are quantities, rows are values.

An analysis returns a `Table` of numbers in SI units; it is rendered where it is shown: for a
terminal (`lines`, ``str``), a notebook or a page (`html`), a program (`records`) or a spreadsheet
(`csv`).  Texts, which may come from files of other sources, are shown literally everywhere.

>>> wheels = Table(
...     [Column("wheelset"), Column("Q0", "static wheel load", "kN", ".2f")],
...     [["leading", 61234.5], ["trailing", None]],
... )
>>> wheels
wheelset  static wheel load (kN)
leading                    61.23
trailing
>>> wheels.records()
[{'wheelset': 'leading', 'Q0': 61234.5}, {'wheelset': 'trailing', 'Q0': None}]
>>> wheels["Q0"]
[61234.5, None]
"""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from math import isfinite, isnan
from numbers import Real
from typing import Any, NamedTuple

from railsim.errors import nearest
from railsim.notation import DECIMALS, SHOWN_UNITS, Quantity
from railsim.text import printable, spreadsheet_cell

GOOD, BAD = ("pass", "complete"), ("fail", "failed", "derailed", "exceeded", "waiting")
"""Cells that a terminal shows in green, in red; the rows of the latter have a class in pages."""

NARROWEST = 6  # width to which columns of texts shrink on a terminal [characters]


@dataclass(frozen=True)
class Column:
    """A quantity in a table.

    `format`: Format of shown numbers (``.2f``), ``>`` for texts aligned to the right, or empty for
    texts.
    """

    name: str  # key in `Table.records`, and heading in CSV
    words: str = ""  # heading where people read; `name` by default
    unit: str = ""  # unit in which values are shown; those of `SHOWN_UNITS` are converted from SI
    format: str = ""
    symbol: str = ""  # symbol of the quantity, in mathtext

    @classmethod
    def of(cls, quantity: Quantity, words: str = "") -> "Column":
        """Return the column of a quantity of `railsim.notation`.

        >>> from railsim.notation import QUANTITIES
        >>> Column.of(QUANTITIES["sum_Y"], "sum Y").heading
        'sum Y (kN)'
        """
        unit = quantity.shown_unit
        decimals = DECIMALS.get(unit)
        format = ".4g" if decimals is None else f".{decimals}f"
        unit = "" if unit == "-" else unit
        return cls(quantity.name, words or quantity.long_name, unit, format, quantity.symbol)

    @property
    def si_unit(self) -> str:
        """Unit of the values."""
        return SHOWN_UNITS.get(self.unit, (self.unit, 1.0))[0]

    @property
    def scale(self) -> float:
        """Shown value over value."""
        return SHOWN_UNITS.get(self.unit, ("", 1))[1]

    @property
    def heading(self) -> str:
        """Words with the shown unit."""
        words = self.words or self.name
        return f"{words} ({self.unit})" if self.unit else words

    def text(self, value: Any) -> str:
        """Return a value as shown; nothing for None, ``-`` for a number that is undefined.

        >>> Column("speed", unit="km/h", format=".0f").text(20.0)
        '72'
        """
        if isinstance(value, Amount):
            unit = f" {value.column.unit}" if value.with_unit and value.column.unit else ""
            return value.column._text_beside(value.value, value.limit) + unit
        if value is None:
            return ""
        if isinstance(value, bool) or not isinstance(value, Real):
            return str(value)
        if isnan(value):
            return "-"
        without_minus_zero = self.format.replace(".", "z.", 1 if self.format.endswith("f") else 0)
        return format(value * self.scale, without_minus_zero)

    def _text_beside(self, value: Any, limit: float | None) -> str:
        text = self.text(value)
        if limit is None or text != self.text(limit):
            return text
        return beside(self.scale * value, self.scale * limit, int(self.format[1:-1]))


class Amount(NamedTuple):
    """A cell whose quantity is not its column's, as where rows are quantities, or with a limit.

    >>> Q = Column("Q", unit="kN", format=".1f")
    >>> Column("value").text(Amount(95040.0, Q, with_unit=True))
    '95.0 kN'
    >>> Q.text(Amount(95040.0, Q, limit=95e3))
    '95.04'
    """

    value: Any
    column: Column
    with_unit: bool = False  # whether its unit stands behind it
    limit: float | None = None  # with more digits where it would read like this, but is not


class Table:
    """Values in rows under quantities.

    Parameters
    ----------
    columns : iterable of Column or str
        Quantities; a text alone is a column of texts.
    rows : iterable of sequences or mappings
        Values in SI units: numbers, texts, None where there is none, or `Amount`.  Mappings by
        the columns' names.
    caption : str
    """

    def __init__(
        self,
        columns: Iterable[Column | str],
        rows: Iterable[Sequence[Any] | Mapping[str, Any]],
        caption: str = "",
    ) -> None:
        self.columns = [Column(column) if isinstance(column, str) else column for column in columns]
        self.caption = caption
        names = [column.name for column in self.columns]
        self.rows = [
            [row.get(name) for name in names] if isinstance(row, Mapping) else list(row)
            for row in rows
        ]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> list[Any]:
        if name not in (names := [column.name for column in self.columns]):
            raise KeyError(f"no column '{name}'; {nearest(str(name), names)}")
        return [record[name] for record in self.records()]

    def __repr__(self) -> str:
        return "\n".join(self.lines())

    def texts(self) -> list[list[str]]:
        """Return the cells as shown, without the headings."""
        return [
            [printable(column.text(cell)) for column, cell in zip(self.columns, row, strict=True)]
            for row in self.rows
        ]

    def transposed(self, heading: Column | str = "") -> "Table":
        """Return the table with a row for every quantity; the first column becomes the heading."""
        first, *others = self.columns
        names = [Column(first.text(row[0]), format=">") for row in self.rows]
        rows = [
            [column.heading, *(Amount(row[number], column) for row in self.rows)]
            for number, column in enumerate(others, start=1)
        ]
        return Table([heading, *names], rows, self.caption)

    def lines(self, width: int | None = None, *, colour: bool = False) -> list[str]:
        """Return the lines for a terminal: long cells take several where `width` is less.

        Colours are escape sequences, for verdicts and headings.
        """
        cells = [[printable(column.heading) for column in self.columns], *self.texts()]
        if colour or width is not None:
            lines = self._draw(cells, width or 100_000, colour)
        else:  # rich takes 0.2 ms a cell
            widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
            signs = [">" if column.format else "<" for column in self.columns]
            shapes = [f"{sign}{width}" for sign, width in zip(signs, widths, strict=True)]
            lines = ["  ".join(map(format, row, shapes)) for row in cells]
        lines = [re.sub(r" +((?:\x1b\[0m)?)$", r"\1", line).rstrip() for line in lines]
        return [printable(self.caption), *lines] if self.caption else lines

    def _draw(self, cells: list[list[str]], width: int, colour: bool) -> list[str]:
        from rich.console import Console
        from rich.table import Table as Drawn
        from rich.text import Text

        gap, widths = _column_widths(cells, [bool(column.format) for column in self.columns], width)
        grid = Drawn(box=None, pad_edge=False, padding=(0, gap, 0, 0), header_style="bold")
        for column, heading, least in zip(self.columns, cells[0], widths, strict=True):
            justify: Any = "right" if column.format else "left"
            folded = Text(_fold(heading, least))
            grid.add_column(folded, justify=justify, overflow="fold", width=least)
        colours = dict.fromkeys(GOOD, "green") | dict.fromkeys(BAD, "red")
        for row in cells[1:]:
            parts = zip(row, widths, strict=True)
            grid.add_row(
                *(Text(_fold(cell, least), colours.get(cell, "")) for cell, least in parts)
            )
        stream = io.StringIO()
        console = Console(
            file=stream, width=max(width, sum(widths) + gap * len(widths)), force_terminal=colour,
            color_system="standard" if colour else None, legacy_windows=False, _environ={},
        )  # fmt: skip
        console.print(grid)
        return stream.getvalue().splitlines()

    def html(self) -> str:
        """Return the table for pages; columns of texts, rows that fail have classes for styles."""
        classes = ["" if column.format else ' class="words"' for column in self.columns]

        def line(cells: Iterable[str], tag: str, kind: str = "") -> str:
            tagged = (
                f"<{tag}{attribute}>{escape(printable(cell))}</{tag}>"
                for attribute, cell in zip(classes, cells, strict=True)
            )
            return f"<tr{kind}>{''.join(tagged)}</tr>"

        title = f"<caption>{escape(printable(self.caption))}</caption>" if self.caption else ""
        head = line((column.heading for column in self.columns), "th")
        body = "".join(
            line(row, "td", ' class="failed"' if set(BAD).intersection(row) else "")
            for row in self.texts()
        )
        return f"<table>{title}<thead>{head}</thead><tbody>{body}</tbody></table>"

    _repr_html_ = __html__ = html

    def records(self) -> list[dict[str, Any]]:
        """Return the rows by the columns' names, in SI units; undefined numbers are None."""
        names = [column.name for column in self.columns]
        return [dict(zip(names, map(_plain, row), strict=True)) for row in self.rows]

    def csv(self) -> str:
        """Return comma-separated values in SI units, under the columns' names with these."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        units = {"": "", "1": ""}
        writer.writerow(
            column.name + units.get(unit := column.si_unit, f" ({unit})") for column in self.columns
        )
        for record in self.records():
            writer.writerow(map(spreadsheet_cell, record.values()))
        return text.getvalue()


def beside(value: float, limit: float, digits: int = 0, kind: str = "f") -> str:
    """A value beside its limit: with more digits where it would read like the limit, but is not.

    >>> beside(98.7, 100.0), beside(100.2, 100.0), beside(2.005, 2.0, 3, "g")
    ('99', '100.2', '2.005')
    """
    for more in range(digits, digits + 4):
        text = f"{value:.{more}{kind}}"
        if text != f"{limit:.{more}{kind}}" or value == limit:
            break
    return text


def beside_ends(value: float, ends: Sequence[float], digits: int = 0) -> str:
    """A value beside the nearer end of what is allowed.

    >>> beside_ends(299.6, (300.0, 400.0)), beside_ends(400.0, (300.0, 400.0))
    ('299.6', '400')
    """
    return beside(value, min(ends, key=lambda end: abs(end - value)), digits)


def _column_widths(
    cells: Sequence[Sequence[str]], numbers: Sequence[bool], width: int
) -> tuple[int, list[int]]:
    """Return the gap between columns and their widths, in characters.

    Headings and texts are broken between words and within dotted names, numbers nowhere.  Columns
    share what is left; where even that is too little, texts are broken anywhere.
    """
    columns = list(zip(*cells, strict=True))
    longest = [max(1, *map(len, column)) for column in columns]
    least = []
    for number, (heading, *texts) in zip(numbers, columns, strict=True):
        parts = texts if number else [part for text in texts for part in _parts(text)]
        least.append(max(1, *(len(part.strip()) for part in [*_parts(heading), *parts])))
    gap = 2 if sum(least) + 2 * len(least) <= width else 1
    room = width - gap * len(least)
    if sum(longest) <= room:
        return gap, longest
    texts = [k for k, number in enumerate(numbers) if not number]
    while sum(least) > room and any(least[k] > NARROWEST for k in texts):
        least[max(texts, key=least.__getitem__)] -= 1
    widths = list(least)
    by_need = sorted(range(len(widths)), key=lambda k: longest[k] - widths[k])
    for rank, k in enumerate(by_need):
        share = max(room - sum(widths), 0) // (len(by_need) - rank)
        widths[k] += min(longest[k] - widths[k], share)
    return gap, widths


def _parts(text: str) -> list[str]:
    """Return the parts between which a text may be broken, with the spaces before them."""
    return re.split(r"(?=\s)(?<=\S)|(?<=[._/])(?=[A-Za-z])", text)


def _fold(text: str, width: int) -> str:
    """Return a text in lines of a width, broken where words and dotted names allow."""
    lines = [""]
    for part in _parts(text) if len(text) > width else [text]:
        if lines[-1] and len(lines[-1]) + len(part) > width:
            lines.append(part.lstrip())
        else:
            lines[-1] += part
    return "\n".join(lines)


def _plain(cell: Any) -> Any:
    """Return a cell as a value of Python."""
    value = cell.value if isinstance(cell, Amount) else cell
    value = value.item() if hasattr(value, "item") else value  # numbers of numpy
    return None if isinstance(value, float) and not isfinite(value) else value


def html_of(parts: Iterable[str | Table]) -> str:
    """Return texts and tables, from top to bottom, for pages and notebooks."""
    return "\n".join(
        f"<p>{escape(printable(part))}</p>" if isinstance(part, str) else part.html()
        for part in parts
        if part
    )
