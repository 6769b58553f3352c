"""Pages: their sections, tables and drawings, values in words, and the page of a design tool.

The page about runs has a template of its own, see `railsim.report.runs`.
"""

from base64 import b64encode
from calendar import month_name
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from railsim import table as values
from railsim.design_checks import Check, verdict
from railsim.page import render_page
from railsim.plot.style import styled, to_bytes
from railsim.version import __version__

Cell = str | tuple[str, str]  # a value, or a value with small print below it
PASSED, OPEN, FAILED = "", "open", "failed"  # kinds of verdicts: green, without colour, red


@dataclass(frozen=True)
class Table:
    """A table of a page."""

    header: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    words: Collection[int] = (0,)  # columns with text
    failed: Collection[int] = ()  # rows in red
    note: str = ""  # a sentence below it


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

    `tables`: `Table` of the page about runs, `railsim.table.Table` of a design tool.  `plots`:
    Plots that the script of the page draws: the number of a group of curves, or ``spread``.
    """

    title: str
    texts: list[str] = field(default_factory=list)
    tables: list[Any] = field(default_factory=list)
    drawings: list[Drawing] = field(default_factory=list)
    id: str = ""  # of a section of the page about runs
    plots: list[str] = field(default_factory=list)
    details: list[Table] = field(default_factory=list)  # tables that are folded at first


def page_table(table: values.Table, subject: str) -> Table:
    """Return a table of values for the page; its caption begins with its subject."""
    return Table(
        [column.heading for column in table.columns],
        table.texts(),
        f"{subject}: {table.caption}" if table.caption else subject,
        words=[k for k, column in enumerate(table.columns) if not column.format],
    )


def day(time: str) -> str:
    """A time of ISO 8601 in words.

    >>> day("2026-11-03T15:04:20+00:00"), day("earlier")
    ('3 November 2026, 15:04', 'earlier')
    """
    try:
        when = datetime.fromisoformat(time)
    except ValueError:
        return time
    return f"{when.day} {month_name[when.month]} {when.year}, {when:%H:%M}"


DPI = 130
IMAGE = Markup('<img alt="{}" width="{}" src="data:image/png;base64,{}">')


def as_png(figure: Figure) -> bytes:
    """Draw a figure as the bytes of a PNG file."""
    with styled():
        return to_bytes(figure, dpi=DPI, metadata={"Software": None})


def pictures(
    images: Mapping[str, bytes], captions: Mapping[str, str], names: Iterable[str] | None = None
) -> list[Drawing]:
    """Return those of some pictures that were drawn, by default all, with their captions."""
    drawings = []
    for name in images if names is None else names:
        if name in images:
            width = int.from_bytes(images[name][16:20], "big")  # the header of a PNG file
            caption = captions[name.rstrip("_0123456789")]
            image = IMAGE.format(caption, round(width * 96 / DPI), b64encode(images[name]).decode())
            drawings.append(Drawing("", caption, image))
    return drawings


def document(
    title: str,
    sections: Iterable[Section],
    method: Sequence[str],
    verdict: Mapping[str, Any],
    source: str = "",
    **values: Any,
) -> str:
    """Return the page as HTML; `values` go to the template."""
    return render_page(
        "railsim.report", "templates/document.html", title=title, styles=["templates/document.css"],
        schemes="light dark", sections=[s for s in sections if s.texts or s.tables or s.drawings],
        method=method, verdict=verdict, lead=f"{source}Written by railsim {__version__}.", **values,
    )  # fmt: skip


def design_page(
    title: str,
    source: str | None,
    checks: Sequence[Check],
    sections: Iterable[Section],
    method: Sequence[str],
    **values: Any,
) -> str:
    """Return the page of a design tool: its verdict is that of its checks."""
    lead = f"{source or 'no source given'}. "
    return document(title, sections, method, verdict(checks), lead, **values)
