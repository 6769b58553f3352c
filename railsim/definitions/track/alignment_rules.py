"""Rules of a railway for its plan and cant at the permitted speed: remarks where they are broken.

The rules are those of a French network for lines up to 230 km/h, as printed in its instructions,
with V in km/h and cant d, deficiency I in mm over the cant base of 1.5 m:

- cant at most 160 mm (180 mm on high-speed lines), and at most (R - 100)/2 with R in m;
- cant deficiency at most 160 mm, cant excess at most 110 mm;
- cant ramps of 180/V mm/m at most, exceptionally 216/V;
- change of the deficiency of 75 mm/s at most, exceptionally 90;
- transitions of d V/180, I V/270 and 60 m at least.

Vertical curves of 0.35 V^2 m at least, exceptionally 0.25 V^2, where v^2/R is 0.22 and 0.31 m/s2
(EN 13803, from memory).  A track without `speed`, or of another gauge than 1435 mm, is not judged.
"""

import math
from collections.abc import Iterator, Sequence

from railsim.cant import cant_deficiency
from railsim.definitions.base import Remark
from railsim.definitions.track.elements import Section, joined

HIGH_SPEED = 230.0  # km/h: the cant of high-speed lines from here on
MOST_CANT, MOST_CANT_HIGH_SPEED = 160.0, 180.0  # mm
MOST_DEFICIENCY, MOST_EXCESS = 160.0, 110.0  # mm
RAMP, RAMP_EXCEPTIONAL = 180.0, 216.0  # mm/m times km/h
CHANGE, CHANGE_EXCEPTIONAL = 75.0, 90.0  # mm/s
SHORTEST = 60.0  # m
VERTICAL, VERTICAL_EXCEPTIONAL = 0.35, 0.25  # m over (km/h)^2
ROUND_OFF = 1.0 + 1e-6


def alignment_remarks(
    plan: Sequence[Section], cant: Sequence[Section], vertical: Sequence[Section], speed: float
) -> list[Remark]:
    """Return where plan [1/m], cant [m] and gradient break the rules at a speed [m/s]."""
    return [
        *_curves(plan, cant, speed),
        *_ramps(cant, speed),
        *_transitions(plan, cant, speed),
        *_vertical_curves(vertical, speed),
    ]


def cant_at(cant: Sequence[Section], s: float) -> float:
    """Cant at an arc length [m]; the last value continues."""
    for section in cant:
        if s <= section.end:
            return section.value(s)
    return cant[-1].end_value if cant else 0.0


def corners(element: Section, cant: Sequence[Section]) -> list[float]:
    """Arc lengths of an element of the plan between which its cant is linear, from end to end."""
    inside = [section.end for section in cant if element.begin < section.end < element.end]
    return [element.begin, *inside, element.end]


def _curves(plan: Sequence[Section], cant: Sequence[Section], speed: float) -> Iterator[Remark]:
    most = MOST_CANT_HIGH_SPEED if 3.6 * speed >= HIGH_SPEED else MOST_CANT
    at = f"at {3.6 * speed:.0f} km/h"
    for section in plan:
        if section.type != "CIR":
            continue
        kappa = section.start_value
        heights = [cant_at(cant, s) for s in corners(section, cant)]
        d, small = 1e3 * max(map(abs, heights)), max(0.5 * (1.0 / abs(kappa) - 100.0), 0.0)
        side = 1e3 * math.copysign(1.0, kappa)
        outwards = [side * cant_deficiency(speed, kappa, h) for h in heights]
        lack, excess = max(outwards), -min(outwards)
        for value, limit, text, rule in (
            (d, most, f"a cant of {d:.0f} mm", ""),
            (d, small, f"a cant of {d:.0f} mm", "(R - 100 m)/2 = "),
            (lack, MOST_DEFICIENCY, f"a cant deficiency of {lack:.0f} mm {at}", ""),
            (excess, MOST_EXCESS, f"a cant excess of {excess:.0f} mm {at}", ""),
        ):
            if value > limit * ROUND_OFF:
                yield Remark(section.key, f"{text} is more than {rule}{limit:.0f} mm")


def _ramps(cant: Sequence[Section], speed: float) -> Iterator[Remark]:
    for section in cant:
        slope = 1e3 * abs(section.slope)
        V = 3.6 * speed
        if slope > RAMP / V * ROUND_OFF:
            rule = f"180/V = {RAMP / V:.2f} mm/m at {V:.0f} km/h"
            beyond = ", and more than 216/V" if slope > RAMP_EXCEPTIONAL / V * ROUND_OFF else ""
            yield Remark(section.key, f"a ramp of {slope:.2f} mm/m is steeper than {rule}{beyond}")


def _transitions(
    plan: Sequence[Section], cant: Sequence[Section], speed: float
) -> Iterator[Remark]:
    for section in (part for part in plan if part.type == "CLO"):
        _, lack = _changes(section, cant, speed)
        change = lack / section.length * speed
        if change > CHANGE * ROUND_OFF:
            beyond = ", and than 90" if change > CHANGE_EXCEPTIONAL * ROUND_OFF else ""
            text = f"the cant deficiency changes by {change:.0f} mm/s, more than {CHANGE:g}{beyond}"
            yield Remark(section.key, text)
    V = 3.6 * speed
    for section in (part for part in joined(plan) if part.type == "CLO"):
        d, lack = _changes(section, cant, speed)
        needed = max(d * V / 180.0, lack * V / 270.0, SHORTEST)
        if section.length * ROUND_OFF < needed:
            text = f"a transition of {section.length:g} m is shorter than {needed:.0f} m"
            yield Remark(section.key, f"{text}, the largest of d V/180, I V/270 and 60 m")


def _changes(section: Section, cant: Sequence[Section], speed: float) -> tuple[float, float]:
    """Change of cant and of its deficiency from end to end [mm]."""
    heights = [cant_at(cant, s) for s in (section.begin, section.end)]
    values = (section.start_value, section.end_value)
    ends = [cant_deficiency(speed, k, h) for k, h in zip(values, heights, strict=True)]
    return 1e3 * abs(heights[1] - heights[0]), 1e3 * abs(ends[1] - ends[0])


def _vertical_curves(vertical: Sequence[Section], speed: float) -> Iterator[Remark]:
    V = 3.6 * speed
    for section in (part for part in vertical if part.slope):
        radius, needed = 1.0 / abs(section.slope), VERTICAL * V**2
        if radius * ROUND_OFF < needed:
            rule = f"0.35 V2 = {needed:.0f} m at {V:.0f} km/h"
            beyond = (
                ", and than 0.25 V2" if radius * ROUND_OFF < VERTICAL_EXCEPTIONAL * V**2 else ""
            )
            text = f"a vertical radius of {radius:.0f} m is smaller than {rule}{beyond}"
            yield Remark(section.key, f"{text}: {speed**2 / radius:.2f} m/s2")
