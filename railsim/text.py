"""Texts from files of other sources, shown literally: in a terminal, a picture, a spreadsheet.

A vehicle may be called ``$x^$``, ``=1+1`` or hold escape sequences; wherever it is shown, it is
these characters and does nothing.  For pages see `railsim.page`.
"""

import re
from collections.abc import Iterable
from typing import Any

LONGEST_VALUE, LONGEST_FILE = 60, 300  # characters of a value, of a file's name, in a message


def shortened(text: str, longest: int = LONGEST_VALUE) -> str:
    """Return a text for a message; of a longer one the beginning.

    >>> shortened("0123456789", 8)
    '01234...'
    """
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def in_words(value: Any) -> str:
    """A value of a file in words: no brackets of Python.

    >>> in_words((10, 10)), in_words(True), in_words(None), in_words({"mu": 0.1 + 0.2})
    ('10, 10', 'yes', 'none', 'mu 0.3')
    """
    if isinstance(value, dict):
        return ", ".join(f"{key} {in_words(part)}" for key, part in value.items())
    if isinstance(value, tuple | list):
        return ", ".join(map(in_words, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    # 16000000, not 1.6e+07
    return f"{float(f'{value:.6g}'):.12g}" if isinstance(value, float) else str(value)


def printable(text: str) -> str:
    r"""Return text without characters that steer a terminal; ends of lines stay.

    >>> printable("coach \x1b[31m\u202e é")
    'coach \\x1b[31m\\u202e é'
    """
    if text.isprintable():
        return text
    return "".join(
        letter if letter.isprintable() or letter in "\n\t " else ascii(letter)[1:-1]
        for letter in text
    )


def unformatted(text: str) -> str:
    r"""Return text for matplotlib, which takes what stands between dollars as a formula.

    >>> print(unformatted("$x^$"))
    \$x^\$
    """
    text = printable(" ".join(text.split())).replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text  # a legend leaves out such names


def spreadsheet_cell(value: object) -> object:
    """Return a cell of a table that no spreadsheet takes as a formula: with an apostrophe before.

    >>> spreadsheet_cell("=1+1"), spreadsheet_cell("-0.3"), spreadsheet_cell(-0.3)
    ("'=1+1", '-0.3', -0.3)
    """
    if not isinstance(value, str) or not value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


_VARYING = re.compile(r"\w+(?:\.\w+)+|\d+(?:\.\d+)?(?:e[+-]?\d+)?|\b(?:left|right)\b")


def merge_remarks(remarks: Iterable[tuple[str, str]]) -> list[str]:
    """Return remarks on runs, those that differ in numbers and names alone as one with a count.

    `remarks`: Name of the run, or nothing; remark.

    >>> merge_remarks([("a", "hunts at 5 Hz"), ("b", "hunts at 6 Hz"), ("c", "is too long")])
    ['a: hunts at 5 Hz (and 1 similar, in 2 runs altogether)', 'c: is too long']
    >>> merge_remarks([("a", "is too long"), ("b", "is too long")])
    ['2 runs: is too long']
    """
    groups: dict[str, dict[tuple[str, str], None]] = {}
    for run, text in remarks:
        groups.setdefault(_VARYING.sub("#", text), {})[run, text] = None
    lines = []
    for group in groups.values():
        run, text = next(iter(group))
        runs = len({name for name, _ in group if name})
        if runs > 1 and len({text for _, text in group}) == 1:
            lines.append(f"{runs} runs: {text}")
            continue
        runs_text = f", in {runs} runs altogether" if runs > 1 else ""
        more = f" (and {len(group) - 1} similar{runs_text})" if len(group) > 1 else ""
        lines.append(
            (f"{run}: " if run else "") + (text.removesuffix(".") if more else text) + more
        )
    return lines


def plain(data: Any) -> Any:
    """Return data as JSON can hold it: names as text, numbers that it lacks as null."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, float):
        return data if abs(data) < float("inf") else None
    return data
