"""From lists of track elements to values over arc length, and what an engineer objects to.

A `Section` is one element with the value at both of its ends: curvature, cant or gradient.  Ramps
that leave an end open take it from their neighbour.  What contradicts itself is a fault; what is
allowed but unusual is a remark.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from railsim.constants import CANT_BASE, FASTEST, NORMAL_GAUGE, WIDENED
from railsim.definitions.base import Remark
from railsim.definitions.excitations.measured import Measured
from railsim.definitions.excitations.single import Single
from railsim.definitions.track.alignment_rules import alignment_remarks, cant_at, corners
from railsim.definitions.track.elements import Section, TrackElement, joined
from railsim.definitions.track.support import Support
from railsim.errors import Fault

if TYPE_CHECKING:
    from railsim.definitions.track.definition import Track

# Ramps steeper than this are remarked on: exceptional limit of EN 13803 (2017) for the cant ramp.
STEEPEST_CANT_RAMP = 2.5e-3
HIGHEST_CANT = 0.20
# Cant that is remarked on where there should be none [m].
ASTRAY_CANT = 1e-3
# Coefficient of friction that is remarked on; dry steel on steel reaches 0.7.
MOST_FRICTION = 1.0
# Stiffness of a support that is remarked on [N/m]: under 50 kN it would yield by 50 mm.
SOFTEST = 1e6
# Factors of a support: a hanging sleeper is a hundred times as soft, a bridge ten times as stiff.
FACTORS = 1e-2, 1e2
# Slope of a single disturbance that is remarked on [1]: dipped joints have 0.02.
STEEPEST = 0.2
# Difference of mileage that is remarked on [m].
SAME_MILEAGE = 0.5
# Smallest cant that counts as cant, smallest difference of length that counts [m].
SMALL = 1e-6


def curvature_sections(track: "Track") -> list[Section]:
    """Return the plan as curvature over arc length [1/m]."""
    return _sections("plan", track.plan)[0]


def cant_sections(track: "Track") -> list[Section]:
    """Return the cant over arc length [m]; empty where there is none."""
    return _sections("cant", track.cant)[0]


def gradient_sections(track: "Track") -> list[Section]:
    """Return the gradient over arc length [1]; empty for a level track."""
    return _sections("vertical", track.vertical)[0]


def is_straight_and_level(track: "Track") -> bool:
    """Whether a track has neither curves nor cant nor gradients."""
    sections = (*curvature_sections(track), *cant_sections(track), *gradient_sections(track))
    return not any(section.start_value or section.end_value for section in sections)


def is_uniform(track: "Track") -> bool:
    """Whether a track is the same everywhere but for its irregularities: also the rails on it."""
    tables = (
        track.gauge_widening, track.friction_table, track.sections, track.check_rail,
        track.support.variation,
    )  # fmt: skip
    return is_straight_and_level(track) and not any(tables)


def even_line(length: float, curvature: float = 0.0, cant: float = 0.0) -> dict[str, Any]:
    """Return plan and cant of a line that is the same everywhere [m, 1/m, m]."""
    curve = {"type": "CIR", "radius": 1.0 / curvature} if curvature else {"type": "STR"}
    level = {"type": "CST", "length": length, "cant": cant}
    return {"plan": [{**curve, "length": length}], "cant": [level]}


def track_faults(track: "Track") -> list[Fault]:
    """Return what contradicts itself in a track; the faults' file is left empty."""
    _, faults = _sections("plan", track.plan)
    cant, cant_faults = _sections("cant", track.cant)
    _, vertical_faults = _sections("vertical", track.vertical)
    faults += cant_faults + vertical_faults
    if not cant_faults:
        for before, behind in _steps(cant):
            found = f"the cant steps from {before.end_value:g} to {behind.start_value:g} m"
            faults.append(Fault("", behind.key, found, "a ramp (LIR) between the two elements"))
    for k, part in enumerate(track.sections):
        for i, other in enumerate(track.sections[:k]):
            if part.rail == other.rail and part.begin < other.end and other.begin < part.end:
                found = f"{part.begin:g} to {part.end:g} m, within the range of sections.{i}"
                faults.append(Fault("", f"sections.{k}", found, "ranges of a rail side by side"))
    return faults


def track_remarks(track: "Track") -> Iterator[Remark]:
    """Yield what is allowed in a track but unusual."""
    plan, cant, vertical = curvature_sections(track), cant_sections(track), gradient_sections(track)
    for before, behind in _steps(plan):
        radii = [_value_text("radius", kappa) for kappa in (before.end_value, behind.start_value)]
        text = f"the radius steps from {radii[0]} to {radii[1]} without a transition (CLO)"
        yield Remark(behind.key, text)
    for _, behind in _steps(vertical):
        yield Remark(behind.key, "the gradient steps without a vertical curve (LIR)")
    yield from (*_too_long("cant", cant, plan), *_too_long("vertical", vertical, plan))
    yield from (*_cant_sizes(cant), *_cant_sides(cant, plan), *_cant_base(cant, track.rail_base))
    if max(track.frictions) > MOST_FRICTION:
        key = "friction_table" if track.friction_table else "friction"
        text = f"a coefficient of {max(track.frictions):g} is beyond that of steel on steel, below"
        yield Remark(key, f"{text} {MOST_FRICTION:g}")
    if track.friction_table and track.friction != type(track).model_fields["friction"].default:
        yield Remark("friction", "has no effect: friction_table takes its place")
    yield from (*_supports(track.support), *_check_rails_at_once(track), *_slopes(track))
    if track.speed is not None and track.speed > FASTEST:
        text = f"{track.speed:g} m/s are {3.6 * track.speed:.0f} km/h: is the speed in m/s?"
        yield Remark("speed", text)
    if track.speed is not None and abs(track.gauge - NORMAL_GAUGE) <= WIDENED:
        yield from alignment_remarks(plan, cant, vertical, track.speed)
    for section in (*joined(plan), *joined(cant), *joined(vertical)):
        if section.slope != 0.0 and section.length < track.rounding - SMALL:
            text = f"the transition is shorter ({section.length:g} m) than the rounding"
            yield Remark(section.key, f"{text} ({track.rounding:g} m), which flattens it")
    for sections in (plan, cant, vertical):
        yield from _not_reached(sections, track.rounding)
    for k, part in enumerate(track.sections):
        if text := part.unusual():
            yield Remark(f"sections.{k}", text)
    for k, shape in enumerate(track.irregularities):
        begin, end = shape.extent(track.length)
        fade = getattr(shape, "fade", 0.0)
        if 2.0 * fade > end - begin > 0.0:
            text = f"{fade:g} m at either end of {end - begin:g} m: half of them is taken"
            yield Remark(f"irregularities.{k}.fade", text)
    for key, begin, end, shift in _spans(track):
        if end <= 0.0 or begin >= track.length:  # the track sees nothing of it
            span = f"from {begin:g} to {end:g} m" if begin <= end else f"from {begin:g} m on"
            text = f"{span}, beyond the track's {track.length:g} m"
            if shift is not None:
                needed = shift - begin if track.falling_mileage else -track.mileage or shift - begin
                place = begin - shift + needed
                text += f"; is it a mileage? shift = {needed:.9g} puts its start at s = {place:g}"
            yield Remark(key, text)
        elif key.startswith("sections.") and (begin < 0.0 or end > track.length):
            text = f"from {begin:g} to {end:g} m, partly beyond the track's {track.length:g} m"
            yield Remark(key, text)
    yield from _mileages(track)


def _supports(support: Support) -> Iterator[Remark]:
    """Remark on stiffnesses and factors in other units, and on a ballast that is not there."""
    for name in ("pad_vertical", "pad_lateral", "ballast_vertical", "ballast_lateral"):
        spring = getattr(support, name)
        if spring is not None and spring[0] < SOFTEST:
            text = f"a stiffness of {spring[0]:g} N/m; railways have 1e7 to 1e9 N/m"
            yield Remark(f"support.{name}", text)
    rows = support.variation or ()
    odd = [factor for row in rows for factor in row[1:] if not FACTORS[0] <= factor <= FACTORS[1]]
    if odd:
        text = f"a factor of {odd[0]:g}; rows hold factors of the support's own stiffness, about 1"
        yield Remark("support.variation", text)
    values = support.values
    if values and not values.has_sleeper and any(ballast != pads for _, pads, ballast in rows):
        text = f"the factors of ballast have no effect: preset '{support.preset}' has none"
        yield Remark("support.variation", text)


def _check_rails_at_once(track: "Track") -> Iterator[Remark]:
    """Remark on check rails beside the same rail at the same place."""
    for k, part in enumerate(track.check_rail):
        for i, other in enumerate(track.check_rail[:k]):
            begin = max(part.rows[0][0], other.rows[0][0])
            end = min(part.rows[-1][0], other.rows[-1][0])
            if part.rail == other.rail and begin < end:
                text = f"from {begin:g} to {end:g} m beside check_rail.{i}: their forces add up"
                yield Remark(f"check_rail.{k}", text)


def _slopes(track: "Track") -> Iterator[Remark]:
    """Remark on single disturbances that no wheel can follow."""
    for k, shape in enumerate(track.irregularities):
        if isinstance(shape, Single):
            s = np.linspace(*shape.extent(track.length), 101)
            steepest = float(np.abs(shape.displacement(track.length)(s)[1]).max())
            if steepest > STEEPEST:
                text = f"{1e3 * steepest:.0f} mm/m steep: are its length and height in m?"
                yield Remark(f"irregularities.{k}", text)


def _not_reached(sections: Sequence[Section], rounding: float) -> Iterator[Remark]:
    """Remark on constant values between two larger or smaller ones that the rounding averages."""
    for before, part, after in zip(sections, sections[1:], sections[2:], strict=False):
        # what it steps from, or where the ramp to it begins, and so behind it
        value = part.start_value
        first = before.start_value if before.end_value == value else before.end_value
        last = after.end_value if after.start_value == value else after.start_value
        alone = part.slope == 0.0 and (value - first) * (value - last) > 0.0
        if alone and part.length < rounding - SMALL:
            text = f"{part.length:g} m are shorter than the rounding ({rounding:g} m), over which"
            yield Remark(part.key, f"{text} it is averaged: its full value is not reached")


def _mileages(track: "Track") -> Iterator[Remark]:
    """Remark on recordings that are put where the mileage of the track is another one."""
    has_mileage = track.mileage or track.falling_mileage
    for k, part in enumerate(track.irregularities if has_mileage else ()):
        if not isinstance(part, Measured):
            continue
        begin, own = part.extent(track.length)[0], part.mileage
        alike, s = (own is None) != track.falling_mileage, begin - part.shift
        if own is None and alike and part.shift and s >= 0.5 * track.mileage:
            own = s if abs(s - track.mileage) <= track.length else None  # the file's s is a mileage
        of_track = float(track.mileage_at(begin))
        if own is None or (alike and abs(of_track - own) < SAME_MILEAGE):
            continue
        shift = part.shift + (of_track - own if track.falling_mileage else own - of_track)
        agree = f"shift = {shift:.9g} makes them agree"
        text = f"begins at km {1e-3 * own:.4f}, which is put at s = {begin:g} m, km "
        text += f"{1e-3 * of_track:.4f} of the track; "
        turned = "the file's mileage falls, that of the track rises"
        yield Remark(f"irregularities.{k}", text + (agree if alike else turned))


def _spans(track: "Track") -> Iterator[tuple[str, float, float, float | None]]:
    """What belongs to a part of the track: key, begin, end, and `shift` of a recording [m]."""
    for k, shape in enumerate(track.irregularities):
        shift = shape.shift if isinstance(shape, Measured) else None
        yield f"irregularities.{k}", *shape.extent(track.length), shift
    for k, part in enumerate(track.sections):
        yield f"sections.{k}", part.begin, part.end, None
    tables: dict[str, Any] = {f"check_rail.{k}": c.rows for k, c in enumerate(track.check_rail)}
    tables |= {key: getattr(track, key) for key in ("gauge_widening", "friction_table")}
    for key, rows in (tables | {"support.variation": track.support.variation}).items():
        if rows and len(rows) > 1:
            yield key, rows[0][0], rows[-1][0], None


# elements ---------------------------------------------------------------------------------------


def _sections(name: str, elements: Sequence[TrackElement]) -> tuple[list[Section], list[Fault]]:
    """Return the sections of a list, with a fault for each end that is open or does not match."""
    sections, faults, begin = list[Section](), list[Fault](), 0.0
    ends = [element.ends for element in elements]
    for index, element in enumerate(elements):
        before = ends[index - 1][1] if index > 0 else None
        behind = ends[index + 1][0] if index + 1 < len(elements) else None
        start, end = ends[index]
        key = f"{name}.{index}"
        if len(element.KEYS) == 2:  # a ramp
            faults += _end_faults(key, element.type, "start", start, before)
            faults += _end_faults(key, element.type, "end", end, behind)
        start, end = before if start is None else start, behind if end is None else end
        end_of_section = begin + element.length
        kind = "STR" if element.type == "CIR" and not start else element.type  # of infinite radius
        sections.append(Section(key, kind, begin, end_of_section, start or 0.0, end or 0.0))
        begin = end_of_section
    return sections, faults


_END_KEYS = {"plan": "radius", "cant": "cant", "vertical": "gradient"}


def _end_faults(
    key: str, kind: str, end: str, value: float | None, other: float | None
) -> Iterator[Fault]:
    """Faults of one end of a ramp with its value and that of the neighbour there."""
    word = _END_KEYS[key.split(".")[0]]
    neighbour = "before" if end == "start" else "behind"
    if value is None and other is None:
        allowed = f"'{word}_{end}' here, as no element {neighbour} gives it"
        yield Fault("", key, f"the {end} of the {kind} is open", allowed)
    if value is not None and other is not None and not _same(value, other):
        found = f"its {word} does not match the element {neighbour}"
        text = f"{_value_text(word, value)}, the element {neighbour} has {_value_text(word, other)}"
        yield Fault("", f"{key}.{word}_{end}", text, found)


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= 1e-9 + 1e-6 * max(abs(a), abs(b))


def _value_text(word: str, value: float) -> str:
    if word != "radius":
        return f"{value:g}"
    return "inf" if value == 0.0 else f"{1.0 / value:g} m"


# faults and remarks -------------------------------------------------------------------------------


def _steps(sections: Sequence[Section]) -> list[tuple[Section, Section]]:
    return [(a, b) for a, b in pairwise(sections) if not _same(a.end_value, b.start_value)]


def _too_long(name: str, sections: Sequence[Section], plan: Sequence[Section]) -> Iterator[Remark]:
    if sections and sections[-1].end > plan[-1].end + SMALL:
        text = f"the list is longer ({sections[-1].end:g} m) than the plan ({plan[-1].end:g} m)"
        yield Remark(name, text)


def _cant_sizes(cant: Sequence[Section]) -> Iterator[Remark]:
    for section in cant:
        highest = max(abs(section.start_value), abs(section.end_value))
        if highest > HIGHEST_CANT:
            yield Remark(section.key, f"a cant of {1e3 * highest:.0f} mm")
        if abs(section.slope) > STEEPEST_CANT_RAMP * (1.0 + 1e-9):
            text = f"a ramp of {1e3 * abs(section.slope):.2f} mm/m is steeper than the usual limit"
            yield Remark(section.key, text)


def _cant_base(cant: Sequence[Section], base: float) -> Iterator[Remark]:
    """Remark on cant at another gauge, which railways of that gauge state over its own rails."""
    highest = max((abs(v) for s in cant for v in (s.start_value, s.end_value)), default=0.0)
    if highest >= SMALL and abs(base - CANT_BASE) > WIDENED:
        text = (
            f"is taken over {CANT_BASE:g} m at every gauge: {1e3 * highest:.0f} mm here are "
            f"{1e3 * highest * base / CANT_BASE:.0f} mm between rails {base:.4g} m apart"
        )
        yield Remark("cant", text)


def _cant_sides(cant: Sequence[Section], plan: Sequence[Section]) -> Iterator[Remark]:
    """Remark on cant on a straight and on cant whose outer rail is the lower one."""
    for element in plan if cant else ():
        ends = corners(element, cant)
        # ends and middles of the stretches with one element of the cant
        places = [*ends, *(0.5 * (begin + end) for begin, end in pairwise(ends))]
        pairs = [(element.value(s), cant_at(cant, s)) for s in places]
        if element.type == "STR":
            found, astray = "cant without curve", [abs(height) for _, height in pairs]
        else:
            found = "cant on the wrong side, the outer rail is the lower one"
            astray = [abs(height) for kappa, height in pairs if kappa * height < 0.0]
        if max(astray, default=0.0) > ASTRAY_CANT:
            yield Remark(element.key, f"{found}: {1e3 * max(astray):.0f} mm")
