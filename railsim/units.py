"""Numbers and ranges as people write them: ``72 km/h``, ``5 mm``, ``10:60:26``, ``log:1:100:3``."""

import math
import re
from typing import Any

UNITS = {
    "km/h": 1.0 / 3.6, "m/s": 1.0, "mm": 1e-3, "m": 1.0, "kN": 1e3, "N": 1.0,
    "mrad": 1e-3, "deg": math.pi / 180.0,
}  # fmt: skip
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = rf"({'|'.join(map(re.escape, UNITS))})"
_WITH_UNIT = re.compile(rf"({NUMBER})\s*{_UNIT}")
_SPEED = re.compile(rf"({NUMBER})\s*(km/h|m/s)?")
_RANGE = re.compile(rf"(log:)?({NUMBER})\s*{_UNIT}?:({NUMBER})\s*{_UNIT}?:(\d+)\s*{_UNIT}?")
MOST_VALUES = 100_000  # of a range
ALLOWED = "first:last:number, with log: before it for equal ratios, such as 10:60:26 or 15:30:4 m/s"


def number_with_unit(text: str) -> float | None:
    """Return a number with a unit in SI; None where it is nothing of the kind.

    >>> number_with_unit("72km/h"), number_with_unit("-2.5 mm"), number_with_unit("60E1")
    (20.0, -0.0025, None)
    """
    match = _WITH_UNIT.fullmatch(text.strip())
    return rounded(float(match[1]) * UNITS[match[2]]) if match else None


def speed_in_si(value: Any) -> Any:
    """Return the speed of a text such as ``72 km/h`` or ``20`` [m/s]; anything else as it is.

    >>> speed_in_si("72 km/h"), speed_in_si("20"), speed_in_si(20.0), speed_in_si("20 kN")
    (20.0, 20.0, 20.0, '20 kN')
    """
    match = _SPEED.fullmatch(value.strip()) if isinstance(value, str) else None
    return rounded(float(match[1]) * UNITS[match[2] or "m/s"]) if match else value


def range_values(text: str) -> list[float] | None:
    """Return the values of a range in SI; None where it is nothing of the kind.

    The unit stands behind both ends, or once for all of it.  Raises ValueError: fewer than one
    value or too many of them, or no ratio leads from end to end.

    >>> range_values("10:20:3"), range_values("log:1e4:1e6:3"), range_values("36:72:2 km/h")
    ([10.0, 15.0, 20.0], [10000.0, 100000.0, 1000000.0], [10.0, 20.0])
    >>> range_values("36km/h:72km/h:2"), range_values("36:72km/h:2")
    ([10.0, 20.0], None)
    """
    match = _RANGE.fullmatch(text.strip())
    if not match or (match[3] or match[7]) != (match[5] or match[7]) or (match[3] and match[7]):
        return None
    first, last, number = float(match[2]), float(match[4]), int(match[6])
    least = 1 if first == last else 2  # of two ends one would be left out
    if not least <= number <= MOST_VALUES:
        raise ValueError(f"a range of {number}; {least} to {MOST_VALUES} values are allowed")
    scale = UNITS[match[3] or match[7] or "m"]
    shares = [k / (number - 1) if number > 1 else 0.0 for k in range(number)]
    if match[1]:
        if not first * last > 0.0:
            raise ValueError("equal ratios need two ends of the same sign, neither zero")
        return [rounded(scale * first * (last / first) ** share) for share in shares]
    return [rounded(scale * (first + (last - first) * share)) for share in shares]


def rounded(value: float) -> float:
    """Return a number without the round-off of its making, to 12 digits."""
    return float(f"{value:.12g}")


def duration_in_words(seconds: float) -> str:
    """Return an estimated duration in words.

    >>> duration_in_words(300.0), duration_in_words(3e5), duration_in_words(1e9)
    ('5 minutes', '3 days', '32 years')
    """
    for unit, length in (("years", 3.16e7), ("days", 86400.0), ("hours", 3600.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:,.0f} {unit}"
    return f"{seconds / 60.0:.0f} minutes"
