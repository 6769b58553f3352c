"""What the descriptions share: the value that they are, and short texts of values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from railsim.table import Table, html_of

Parts = list[str | Table]


@dataclass(frozen=True, repr=False)
class Description:
    """What an input or a result holds.

    Attributes
    ----------
    data : dict
        Plain values, in SI units.
    parts : sequence of str or Table
        What people read, from top to bottom.
    """

    data: dict[str, Any]
    parts: list[str | Table]

    def __repr__(self) -> str:
        return "\n".join(str(part) for part in self.parts)

    def _repr_html_(self) -> str:
        return html_of(self.parts)


def either(pair: Sequence[Any]) -> str:
    """Return the value of both sides, once where they are the same."""
    return str(pair[0]) if pair[0] == pair[1] else f"{pair[0]} / {pair[1]}"


def short(value: object) -> str:
    """Write a value shortly: 31.391e6 rather than 3.1391e+07.

    >>> [short(value) for value in (12345.6, 1e5, -31.391e6, 2.5e9, (0.5, 2e8))]
    ['12345.6', '100e3', '-31.391e6', '2.5e9', '[0.5 200e6]']
    """
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return f"{len(value)} rows"
    if isinstance(value, tuple):
        return "[" + " ".join(short(member) for member in value) + "]"
    if not isinstance(value, float):
        return str(value)
    if abs(value) < 1e5:
        return f"{value:.6g}"
    exponent = 3 * int(math.log10(abs(value)) // 3)
    return f"{value / 10**exponent:.6g}e{exponent}"
