"""Gauge values of wheels and of a wheelset, with their limits in service.

On a wheel, from its nominal rolling circle and flange back (EN 15313):

- flange height ``Sh``: flange tip over the nominal rolling circle;
- flange thickness ``Sd``: from the flange back to the flank, 10 mm beyond the rolling circle;
- ``qR``: along the axle from that point of the flank to the one 2 mm below the tip.

Of a wheelset: distance of the flange backs ``AR``, of the active faces ``SR = AR + 2 Sd``, and the
play in the gauge, ``gauge - SR``.  Limits are those of the TSI Rolling stock (EU 1302/2014, tables
of 4.2.3.5.2), of ``qR`` that of EN 15313; quoted from memory.  ``AR`` and ``SR`` have limits on
1435 mm only, widened or narrowed by 30 mm at most.
"""

from math import inf, nan
from typing import Any

import numpy as np

from railsim.constants import NORMAL_GAUGE, WIDENED
from railsim.notation import SIDES
from railsim.profiles.profile import FLANGE_BACK, Profile
from railsim.table import Amount, Column, Table

FLANK, BELOW_TIP = 0.010, 0.002
"""Where the flank is measured: beyond the nominal rolling circle, below the flange tip [m]."""

# diameters up to: least Sd, least SR, least AR; least Sh [m]
_LEAST = {
    0.760: (0.0275, 1.415, 1.359), 0.840: (0.0250, 1.412, 1.358), inf: (0.0220, 1.410, 1.357)
}  # fmt: skip
_LEAST_HEIGHT = {0.630: 0.0315, 0.760: 0.0295, inf: 0.0275}
_MOST = (0.033, 0.036, 1.426, 1.363)
LEAST_QR = 0.0065


def wheel_gauge(wheel: Profile) -> tuple[float, float, float]:
    """Return Sh, Sd and qR of a wheel profile [m], NaN where its flange does not reach so far.

    >>> from railsim.profiles import load_profile
    >>> [round(1e3 * value, 1) for value in wheel_gauge(load_profile("S1002"))]
    [28.0, 32.5, 10.8]
    """
    order = np.argsort(wheel.y, kind="stable")
    tread = float(np.interp(0.0, wheel.y[order], wheel.z[order]))
    tip = int(np.argmax(wheel.z))
    height = float(wheel.z[tip]) - tread
    flank = _flank(wheel, tip, tread + FLANK)
    below_tip = _flank(wheel, tip, float(wheel.z[tip]) - BELOW_TIP)
    return height, flank - FLANGE_BACK, flank - below_tip


def _flank(wheel: Profile, tip: int, height: float) -> float:
    """Position on the profile where it first falls to a height on the way from tip to tread."""
    below = np.flatnonzero(wheel.z[tip:] <= height)
    if not len(below) or below[0] == 0:
        return nan
    k = tip + int(below[0])
    share = (wheel.z[k - 1] - height) / (wheel.z[k - 1] - wheel.z[k])
    return float(wheel.y[k - 1] + share * (wheel.y[k] - wheel.y[k - 1]))


def gauge_table(
    wheels: tuple[Profile, Profile],
    *,
    diameter: float = 0.92,
    back_to_back: float = 1.360,
    gauge: float = 1.435,
) -> Table:
    """Return the gauge values of a wheelset against their limits.

    `wheels`: left and right; `diameter`: of the wheels, on which limits depend [m]; `back_to_back`,
    `gauge`: distance of the flange backs, track gauge [m].
    """
    heights, thicknesses, flanks = zip(*map(wheel_gauge, wheels), strict=True)
    thickness, *least = next(v for most, v in _LEAST.items() if diameter <= most)
    height = next(v for most, v in _LEAST_HEIGHT.items() if diameter <= most)
    most_thickness, most_height, *most = _MOST
    normal = abs(gauge - NORMAL_GAUGE) <= WIDENED
    faces, backs = zip(least, most, strict=True) if normal else ((None, None), (None, None))
    active = back_to_back + thicknesses[0] + thicknesses[1]
    rows: list[list[Any]] = []
    for name, words, values, *limits in (
        ("Sh", "flange height", heights, height, most_height),
        ("Sd", "flange thickness", thicknesses, thickness, most_thickness),
        ("qR", "flank", flanks, LEAST_QR, None),
    ):
        for side, value in zip(SIDES, values, strict=True):
            rows.append([name, f"{words}, {side}", value, *limits])
    rows += [
        ["AR", "flange backs", back_to_back, *backs],
        ["SR", "active faces", active, *faces],
        ["play", "gauge less active faces", gauge - active, None, None],
    ]
    lengths = [
        Column(name, words, "mm", ".1f")
        for name, words in (("value", "value"), ("least", "at least"), ("most", "at most"))
    ]
    return Table(
        [Column("name", "gauge value"), Column("words", " "), *lengths, Column("verdict", " ")],
        [[*row[:2], _amount(lengths[0], *row[2:]), *row[3:], _verdict(*row[2:])] for row in rows],
    )


def _amount(column: Column, value: float, *limits: float | None) -> Amount:
    """Return a value that does not read like the nearer limit where it is beyond it."""
    known = [limit for limit in limits if limit is not None]
    nearer = min(known, key=lambda limit: abs(limit - value), default=None)
    return Amount(value, column, limit=nearer)


def _verdict(value: float, least: float | None, most: float | None) -> str:
    if least is None and most is None:
        return ""
    inside = (least is None or value >= least - 1e-9) and (most is None or value <= most + 1e-9)
    return "pass" if inside else "fail"
