"""Test sections of the track that a run covers.

A section is a full section length within an alignment element of constant curvature and constant
cant, clear of the rounded kinks; transitions are not included.  Its zone follows from its radius;
sections outside the conditions of their zones are listed with the reason why they do not count.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

from railsim.cant import cant_deficiency
from railsim.definitions.limits import RunningLimits, Zone, up_to
from railsim.definitions.own_sections import SHORTEST, OwnSection
from railsim.definitions.track.definition import Track
from railsim.definitions.track.elements import Section
from railsim.definitions.track.layout import cant_sections, curvature_sections
from railsim.definitions.vehicle.tables import Service
from railsim.notation import SIDES
from railsim.table import beside, beside_ends

ROUNDING = 1e-6
"""Of speeds [m/s], cant deficiencies and places [m]: what was asked for is met."""


@dataclass(frozen=True)
class TestSection:
    """A section of the track that a run covers."""

    __test__ = False  # pytest: not a test

    zone: str  # 1 to 4; empty where no zone has this radius
    begin: float  # arc length [m]
    end: float  # arc length [m]
    radius: float  # signed radius, infinite on straight track [m]
    cant_deficiency: float  # positive where the cant is too small for the speed [m]
    speed: float  # speed in the middle of the section [m/s]
    reason: str = ""  # reason why the section does not count; empty if it counts

    @property
    def turn(self) -> int:
        """1 in a right-hand curve, -1 in a left-hand one; 0 on straight track and in zone 1.

        Very large radii are pooled there with straight track: values of either side.
        """
        straight = self.zone == "1" or math.isinf(self.radius)
        return 0 if straight else int(math.copysign(1.0, self.radius))

    def wheel(self, side: int | None) -> str:
        """Name of the wheels on a side: ``outer`` and ``inner`` in curves; empty for no side."""
        if side is None:
            return ""
        if not self.turn:
            return SIDES[side]
        return "outer" if (side == 0) == (self.turn > 0) else "inner"


def outer_deficiency(speed: float, radius: float, cant: float) -> float:
    """Return the cant deficiency towards the outer rail, the cant on straight track [m].

    `speed`: [m/s]. `radius`, `cant`: Signed: positive to the right, positive = left rail higher
    [m].

    >>> round(outer_deficiency(20.0, -250.0, -0.15), 4)
    0.0946
    """
    if math.isinf(radius):
        return abs(cant)
    return math.copysign(1.0, radius) * cant_deficiency(speed, 1.0 / radius, cant)


def track_sections(
    track: Track,
    limits: RunningLimits,
    service: Service,
    covered: tuple[float, float],
    speed_at: Callable[[float], float],
) -> list[TestSection]:
    """All full sections of the part of a track that a run covers.

    `limits`: Zones and lengths of sections. `service`: Admissible speed and cant deficiency.
    `covered`: Range of arc length that the whole vehicle covered [m]. `speed_at`: Speed at an arc
    length [m/s].
    """
    cut: list[TestSection] = []
    for begin, end, radius, cant in _constant_parts(track):
        begin, end = max(begin, covered[0]), min(end, covered[1])
        if begin >= end:
            continue
        speed = speed_at(0.5 * (begin + end))
        deficiency = outer_deficiency(speed, radius, cant)
        zone = zone_of(radius, deficiency, limits)
        length = section_length(limits.zones[zone], speed) if zone else end - begin
        reason = "" if zone else f"no zone has the radius {abs(radius):.6g} m"
        whole = math.floor((end - begin) / length + 1e-9)
        if not whole:
            shape = "straight" if math.isinf(radius) else f"curve of {abs(radius):.6g} m"
            found_length = beside(end - begin, length)
            reason = f"{found_length} m of a {shape}, a section needs {length:.0f} m"
            cut.append(TestSection(zone, begin, end, radius, deficiency, speed, reason))
        for number in range(whole):
            first = begin + number * length
            speed = speed_at(first + 0.5 * length)
            deficiency = outer_deficiency(speed, radius, cant)
            why = reason or _outside(limits.zones[zone], radius, deficiency, speed, service)
            cut.append(TestSection(zone, first, first + length, radius, deficiency, speed, why))
    return cut


def transitions(
    track: Track, covered: tuple[float, float], speed_at: Callable[[float], float]
) -> list[TestSection]:
    """All whole transitions that a run covers: from one constant curvature and cant to the next.

    They belong to no zone.  The radius is that of the tighter end, infinite between curves of
    opposite hands, where neither wheel is the outer one; kinks that are rounded only are left out.
    Arguments as of `track_sections`.
    """
    sections = []
    for (_, begin, before, _), (end, _, after, _) in pairwise(_constant_parts(track)):
        least = max(track.rounding + 1e-6, SHORTEST)
        if covered[0] <= begin < end - least and end <= covered[1]:
            opposite = 1.0 / before / after < 0.0
            radius = math.inf if opposite else min(before, after, key=abs)
            speed = speed_at(0.5 * (begin + end))
            sections.append(TestSection("", begin, end, radius, math.nan, speed, "transition"))
    return sections


def own_sections(
    track: Track,
    limits: RunningLimits,
    service: Service,
    listed: Sequence[OwnSection],
    speed_at: Callable[[float], float],
) -> list[TestSection]:
    """Sections that the user gives, with their reasons; arguments as of `track_sections`.

    Radius and cant are those of the part of constant curvature and cant that holds most of one.
    """
    parts, sections = _constant_parts(track) or [(0.0, 0.0, math.inf, 0.0)], []
    for section in sorted(listed, key=lambda section: section.begin):
        begin, end, radius, cant = max(
            parts, key=lambda part: min(section.end, part[1]) - max(section.begin, part[0])
        )
        speed, why = speed_at(0.5 * (section.begin + section.end)), []
        deficiency = outer_deficiency(speed, radius, cant)
        fitting = zone_of(radius, deficiency, limits)
        name = (section.zone or fitting) if begin < section.end and section.begin < end else ""
        zone = limits.zones.get(name)
        if zone and zone.radius and math.isinf(radius):  # neither wheel is the outer one
            zone, why = None, [f"given as of zone {name}, but straight"]
        elif not begin - ROUNDING <= section.begin < section.end <= end + ROUNDING:
            why = [f"not within {begin:.0f} to {end:.0f} m of constant curvature and cant"]
        elif zone is None:
            why = [f"no zone has the radius {abs(radius):.6g} m"]
        low, high = (zone.radius if zone else None) or (math.inf, math.inf)
        if zone and name != fitting and not low <= abs(radius) <= high:
            why.append(f"given as of zone {name}, the radius of {abs(radius):.6g} m is not")
        why += [_outside(zone, radius, deficiency, speed, service)] if zone else []
        values = radius, deficiency, speed, "; ".join(filter(None, why))
        sections.append(TestSection(name if zone else "", section.begin, section.end, *values))
    return sections


def _constant_parts(track: Track) -> list[tuple[float, float, float, float]]:
    """Parts with constant curvature and cant: begin, end, radius, cant."""
    plan, cants = curvature_sections(track), cant_sections(track)
    last = plan[-1].end
    if not cants:
        cants = [Section("", "CST", 0.0, last, 0.0, 0.0)]
    elif cants[-1].end < last:
        value = cants[-1].end_value
        cants = [*cants, Section("", "CST", cants[-1].end, last, value, value)]
    parts, half = [], 0.5 * track.rounding
    for element, cant in product(_constant_sections(plan), _constant_sections(cants)):
        begin = max(element.begin, cant.begin) + half
        end = min(element.end - half, cant.end - half, last)
        if begin < end:
            radius = 1.0 / element.start_value if element.start_value else math.inf
            parts.append((max(begin, 0.0), end, radius, cant.start_value))
    return sorted(parts)


def _constant_sections(sections: Sequence[Section]) -> list[Section]:
    """Sections of constant value; neighbours of equal value are joined."""
    constant: list[Section] = []
    for section in sections:
        if section.slope != 0.0:
            continue
        before = constant[-1] if constant else None
        if before and before.end == section.begin and before.end_value == section.start_value:
            constant[-1] = replace(before, end=section.end, end_value=section.end_value)
        else:
            constant.append(section)
    return constant


def zone_of(radius: float, deficiency: float, limits: RunningLimits) -> str:
    """Zone of a radius; empty where there is none.

    Very large radii with small cant deficiency belong to zone 1.  The ends of zone 3, 400 and
    600 m, belong to it and not to the zones beside it (from memory of UIC 518 and EN 14363: zone 4
    is 250 m <= R < 400 m).
    """
    straight = next((n for n, z in limits.zones.items() if z.radius is None), "")
    if math.isinf(radius):
        return straight
    for name in sorted(limits.zones, key=lambda name: (name != "3", name)):
        zone = limits.zones[name]
        if zone.radius is not None and zone.radius[0] <= abs(radius) <= zone.radius[1]:
            most = limits.zones[straight].cant_deficiency[1] if straight else -math.inf
            small = abs(deficiency) <= most + ROUNDING
            return straight if zone.speed is not None and small else name
    return ""


def section_length(zone: Zone, speed: float) -> float:
    """Length of a section at a speed [m]."""
    return up_to(zone.section, speed, zone.section_above)


def _outside(zone: Zone, radius: float, deficiency: float, speed: float, service: Service) -> str:
    """Reason why a section is outside the conditions of its zone; empty if it is not."""
    unit = 1.0 if zone.radius is None else service.cant_deficiency
    low, high = ends = [1e3 * share * unit for share in zone.cant_deficiency]  # mm
    reasons = []
    if not low - 1e3 * ROUNDING <= 1e3 * deficiency <= high + 1e3 * ROUNDING:
        text = f"{beside_ends(1e3 * deficiency, ends)} mm, required {low:.4g} to {high:.4g} mm"
        reasons.append(f"cant deficiency {text}")
    if zone.speed is not None:
        slow, fast = ends = [share * service.admissible_speed for share in zone.speed]
        if not slow - ROUNDING <= speed <= fast + ROUNDING:
            text = f"{beside_ends(speed, ends, 1)} m/s, required {slow:.4g} to {fast:.4g} m/s"
            reasons.append(f"speed {text}")
    return "; ".join(reasons)


def reasons(sections: Sequence[TestSection]) -> list[str]:
    """Sentences on sections outside the conditions of their zones, grouped by reason."""
    counts = Counter(section.reason for section in sections if section.reason)
    suffix = "outside the conditions"
    return [f"{n} section{'s' * (n > 1)} {suffix}: {reason}" for reason, n in counts.items()]
