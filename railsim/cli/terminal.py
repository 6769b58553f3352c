"""What a terminal or a program gets: lines, tables, JSON."""

import json
import os
import shutil
import sys
import textwrap
from typing import TYPE_CHECKING, Any

import click

from railsim.text import plain, printable

if TYPE_CHECKING:
    from railsim.table import Table


def echo(text: object = "", *, err: bool = False) -> None:
    """Print a line, on stderr with `err`; what would steer the terminal is shown as its code."""
    click.echo(printable(str(text)), err=err)


def show(*parts: "str | Table") -> None:
    """Print lines and tables; a terminal gets both in its width, coloured unless ``NO_COLOR``."""
    terminal = sys.stdout.isatty()
    width = shutil.get_terminal_size().columns if terminal else None
    for part in parts:
        if isinstance(part, str):
            for line in part.split("\n"):
                echo(in_width(line, width))
        else:  # texts of tables are literal already
            lines = part.lines(width, colour=terminal and not os.environ.get("NO_COLOR"))
            click.echo("\n".join(lines))


def in_width(line: str, width: int | None) -> str:
    """Return a line, in several ones where a terminal is narrower, under its first word."""
    if width is None or len(line) <= width or not line.strip():
        return line
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return textwrap.fill(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def print_json(data: Any) -> None:
    """Print data as JSON; numbers that JSON lacks become null."""
    click.echo(json.dumps(plain(data), indent=2, allow_nan=False))
