"""Pages of the design tools: sections of texts, tables and pictures under a verdict."""

from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

from markupsafe import Markup
from matplotlib.figure import Figure

from railsim.design_checks import Check, verdict
from railsim.page import rendered
from railsim.plot.style import styled
from railsim.report.tables import Drawing
from railsim.table import Table
from railsim.version import __version__

DPI = 130
IMAGE = Markup('<img alt="{}" width="{}" src="data:image/png;base64,{}">')


@dataclass
class Section:
    """A section of the page; one without content is left out."""

    title: str
    texts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: list[Drawing] = field(default_factory=list)


def as_png(figure: Figure) -> bytes:
    """Draw a figure as the bytes of a PNG file."""
    buffer = BytesIO()
    with styled():
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()


def pictures(
    drawn: Mapping[str, bytes], captions: Mapping[str, str], names: Iterable[str] | None = None
) -> list[Drawing]:
    """Return those of some pictures that were drawn, by default all, with their captions."""
    found = []
    for name in drawn if names is None else names:
        if name in drawn:
            width = int.from_bytes(drawn[name][16:20], "big")  # the header of a PNG file
            caption = captions[name.rstrip("_0123456789")]
            code = b64encode(drawn[name]).decode()
            image = IMAGE.format(caption, round(width * 96 / DPI), code)
            found.append(Drawing("", caption, image))
    return found


def document(
    title: str,
    sections: Iterable[Section],
    method: Sequence[str],
    verdict: Mapping[str, Any],
    source: str = "",
    **values: Any,
) -> str:
    """Return the page as HTML; `values` go to the template."""
    return rendered(
        "railsim.report", "templates/document.html", title=title, styles=["templates/document.css"],
        schemes="light dark", sections=[s for s in sections if s.texts or s.tables or s.figures],
        method=method, verdict=verdict, lead=f"{source}Written by railsim {__version__}.", **values,
    )  # fmt: skip


def of_design(
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
