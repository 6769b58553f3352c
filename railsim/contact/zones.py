"""Zones of a wheel, each of which has a patch of its own in the contact table."""

import math

import numpy as np

from railsim.arrays import Floats
from railsim.contact.curves import RailCurve, WheelCurve

LONG_JUMP = 0.025
"""Jump of the rigid contact over the wheel from which on its ends are patches of their own [m]."""

JUMP_SEARCH = 1e-4
"""Spacing of the lateral displacements at which jumps are sought [m]."""

MOST_WIDENING = 0.040
"""Widening of the gauge from which on a wheel has fallen before the other one has climbed [m]."""

WIDENING_STEP = 5
"""Tables cover widenings of the gauge up to multiples of this, so that tracks share them [mm]."""

CROWN_SLOPE = 0.3
"""Slope of a rail up to which its surface counts as its top, the tangent of 17 degrees [1]."""

MORE_INWARDS = 0.010
"""Room of a table beyond where the other wheel has climbed its rail, for rails that give way and
irregularities of the gauge [m]."""


def table_range(wheel: WheelCurve, rail: RailCurve, widening: float = 0.0) -> tuple[float, float]:
    """Range of the lateral position that a table covers, in whole millimetres [m].

    `widening`: largest of the gauge [m].

    Outwards to where the tip of the flange stands over the top of the rail: beyond, the wheelset is
    derailed.  Inwards as far as the other wheel's climbing lets this one go, on rails that stand
    `widening` further apart, and `MORE_INWARDS`.
    """
    tip = float(wheel.u[int(np.argmax(wheel.r))])
    top = float(rail.Y[int(np.argmax(rail.slope > -CROWN_SLOPE))])
    climbed = np.ceil(1e3 * (top - tip)) / 1e3
    return -float(climbed + table_widening(widening)) - MORE_INWARDS, float(climbed)


def table_widening(widening: float) -> float:
    """Widening of the gauge that a table for the given one covers [m].

    >>> [table_widening(widening) for widening in (0.0, 0.003, 0.005, 0.0051, 0.1)]
    [0.0, 0.005, 0.005, 0.01, 0.04]
    """
    asked = min(max(widening, 0.0), MOST_WIDENING)
    return WIDENING_STEP * math.ceil(1e3 * asked / WIDENING_STEP - 1e-6) / 1e3


def zone_windows(wheel: WheelCurve, rail: RailCurve) -> Floats:
    """Partition of a wheel's candidates into tread, flange root and flange.

    The borders lie where the profile's angle, followed from the nominal rolling circle towards the
    flange, passes 10 to 15 degrees (tread to root), and 70 to 90 % of the flank's greatest angle
    (root to flange); between these positions the windows change by the smoothest cubic.

    Ends of a long jump of the contact are patches of their own.  On a hollow wheel it jumps from
    the rim on the field side to the side of the flange; where these borders would leave both ends
    with parts of the tread, the border of tread and root lies in between (`border_of_branches`).

    Returns shape (3, n), windows adding up to 1 [1].
    """
    angle = np.degrees(np.arctan(-wheel.t))
    start = int(np.argmin(np.abs(wheel.y)))
    toward_flange = slice(start, None, -1)
    ahead, positions = angle[toward_flange], wheel.y[toward_flange]
    steepest = float(ahead.max())

    def passes(limit: float) -> float:
        beyond = np.flatnonzero(ahead > limit)
        return float(positions[beyond[0]]) if beyond.size else float(positions[-1])

    def beyond(begin: float, end: float) -> Floats:
        """0 on the tread side of `begin`, 1 on the flange side of `end`."""
        width = max(begin - end, 1e-4)
        x = np.clip((begin - wheel.y) / width, 0.0, 1.0)
        share: Floats = x * x * (3.0 - 2.0 * x)
        return share

    def windows(begin: float, end: float) -> Floats:
        root = beyond(begin, end)
        flange = np.minimum(beyond(passes(0.7 * steepest), passes(0.9 * steepest)), root)
        return np.stack((1.0 - root, root - flange, flange))

    by_angle = windows(passes(10.0), passes(15.0))
    hollow = border_of_branches(wheel, rail, by_angle)
    return windows(*hollow) if hollow else by_angle


def border_of_branches(
    wheel: WheelCurve, rail: RailCurve, window: Floats
) -> tuple[float, float] | None:
    """Where on the wheel two branches of the contact that share a zone lie apart.

    Between the ends of the longest jump of the rigid contact, the middle third, which nothing
    touches.  Jumps of up to 22 mm are those of unworn profiles: their ends nearly meet under load
    and are one patch of the zone.

    `wheel`, `rail`: profiles; `window`, shape (3, n): windows that are to separate the branches.
    Returns positions on the wheel, that on the field side first [m]; None where there is no such
    jump.
    """
    reach = table_range(wheel, rail)[1]
    lateral = np.arange(-reach, reach, JUMP_SEARCH)
    height = np.interp(wheel.u + lateral[:, None], rail.Y, rail.z, left=1.0, right=1.0) - wheel.r
    at = np.argmin(height, axis=1)
    field, inner = at[:-1], at[1:]
    shared = np.minimum(window[:, field], window[:, inner]).sum(axis=0) > 0.0
    jump = np.where(shared, wheel.y[field] - wheel.y[inner], 0.0)
    longest = int(np.argmax(jump))
    if jump[longest] < LONG_JUMP:
        return None
    third = float(jump[longest]) / 3.0
    return float(wheel.y[field[longest]]) - third, float(wheel.y[inner[longest]]) + third
