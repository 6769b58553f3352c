"""From lists of track elements to values over arc length, and what an engineer objects to.

A `Section` is one element with the value at both of its ends: curvature, cant or gradient.  Ramps
that leave an end open take it from their neighbour.  What contradicts itself is a fault; what is
allowed but unusual is a remark.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from railsim.definitions.alignment_rules import alignment_remarks
from railsim.definitions.base import Remark
from railsim.definitions.section import Section
from railsim.definitions.track_tables import (
    CantElement,
    Circle,
    Clothoid,
    ConstantCant,
    ConstantGradient,
    PlanElement,
    TrackTables,
    VerticalElement,
)
from railsim.errors import Fault

# Ramps steeper than this are remarked on: exceptional limit of EN 13803 (2017) for the cant ramp.
STEEPEST_CANT_RAMP = 2.5e-3
HIGHEST_CANT = 0.20
# Cant that is remarked on where there should be none [m].
ASTRAY_CANT = 1e-3
# Smallest cant that counts as cant, smallest difference of length that counts [m].
SMALL = 1e-6


@dataclass(frozen=True)
class _Draft:
    """A section whose ends may still be open; a ramp's given ends must match its neighbours."""

    type: str
    length: float
    start: float | None
    end: float | None
    ramp: bool


def curvature_sections(track: TrackTables) -> list[Section]:
    """Return the plan as curvature over arc length [1/m]."""
    return _sections("plan", [_plan_draft(element) for element in track.plan])[0]


def cant_sections(track: TrackTables) -> list[Section]:
    """Return the cant over arc length [m]; empty where there is none."""
    return _sections("cant", [_cant_draft(element) for element in track.cant])[0]


def gradient_sections(track: TrackTables) -> list[Section]:
    """Return the gradient over arc length [1]; empty for a level track."""
    return _sections("vertical", [_vertical_draft(element) for element in track.vertical])[0]


def is_straight_and_level(track: TrackTables) -> bool:
    """Whether a track has neither curves nor cant nor gradients."""
    sections = (*curvature_sections(track), *cant_sections(track), *gradient_sections(track))
    return not any(section.start_value or section.end_value for section in sections)


def track_faults(track: TrackTables) -> list[Fault]:
    """Return what contradicts itself in a track; the faults' file is left empty."""
    _, faults = _sections("plan", [_plan_draft(element) for element in track.plan])
    cant, cant_faults = _sections("cant", [_cant_draft(element) for element in track.cant])
    _, vertical_faults = _sections("vertical", [_vertical_draft(e) for e in track.vertical])
    faults += cant_faults + vertical_faults
    if not cant_faults:
        faults += _cant_steps(cant)
    return faults


def track_remarks(track: TrackTables) -> list[Remark]:
    """Return what is allowed in a track but unusual."""
    plan, cant, vertical = curvature_sections(track), cant_sections(track), gradient_sections(track)
    remarks = _curvature_steps(plan) + _gradient_steps(vertical)
    remarks += _too_long("cant", cant, plan) + _too_long("vertical", vertical, plan)
    remarks += _cant_sizes(cant) + _cant_sides(cant, plan)
    if track.speed is not None:
        remarks += alignment_remarks(plan, cant, track.speed)
    for section in (*plan, *cant, *vertical):
        if section.slope != 0.0 and section.length < track.rounding - SMALL:
            text = (
                f"the transition is shorter ({section.length:g} m) than the rounding "
                f"({track.rounding:g} m), which flattens it"
            )
            remarks.append(Remark(section.key, text))
    return remarks + _beyond_the_track(track)


# elements ---------------------------------------------------------------------------------------


def _curvature(radius: float | None) -> float | None:
    return None if radius is None else 1.0 / radius


def _plan_draft(element: PlanElement) -> _Draft:
    if isinstance(element, Clothoid):
        start, end = _curvature(element.radius_start), _curvature(element.radius_end)
        return _Draft(element.type, element.length, start, end, ramp=True)
    kappa = 1.0 / element.radius if isinstance(element, Circle) else 0.0
    return _Draft(element.type, element.length, kappa, kappa, ramp=False)


def _cant_draft(element: CantElement) -> _Draft:
    if isinstance(element, ConstantCant):
        return _Draft(element.type, element.length, element.cant, element.cant, ramp=False)
    return _Draft(element.type, element.length, element.cant_start, element.cant_end, ramp=True)


def _vertical_draft(element: VerticalElement) -> _Draft:
    if isinstance(element, ConstantGradient):
        return _Draft(element.type, element.length, element.gradient, element.gradient, ramp=False)
    start, end = element.gradient_start, element.gradient_end
    return _Draft(element.type, element.length, start, end, ramp=True)


def _sections(name: str, drafts: Sequence[_Draft]) -> tuple[list[Section], list[Fault]]:
    """Return the sections of a list, with a fault for each end that is open or does not match."""
    sections, faults = [], []
    begin = 0.0
    for index, draft in enumerate(drafts):
        before = drafts[index - 1] if index > 0 else None
        behind = drafts[index + 1] if index + 1 < len(drafts) else None
        key = f"{name}.{index}"
        start = draft.start if draft.start is not None else (before.end if before else None)
        end = draft.end if draft.end is not None else (behind.start if behind else None)
        faults += _end_faults(key, draft, before, behind)
        end_of_section = begin + draft.length
        section = Section(key, draft.type, begin, end_of_section, start or 0.0, end or 0.0)
        sections.append(section)
        begin = end_of_section
    return sections, faults


_END_KEYS = {"plan": "radius", "cant": "cant", "vertical": "gradient"}


def _end_faults(
    key: str, draft: _Draft, before: _Draft | None, behind: _Draft | None
) -> list[Fault]:
    if not draft.ramp:
        return []
    word = _END_KEYS[key.split(".")[0]]
    faults = []
    for end, own, other in (
        ("start", draft.start, before.end if before else None),
        ("end", draft.end, behind.start if behind else None),
    ):
        neighbour = "before" if end == "start" else "behind"
        if own is None and other is None:
            allowed = f"'{word}_{end}' here, as no element {neighbour} gives it"
            faults.append(Fault("", key, f"the {end} of the {draft.type} is open", allowed))
        elif own is not None and other is not None and not _same(own, other):
            found = f"its {word} does not match the element {neighbour}"
            text = f"{_written(word, own)}, the element {neighbour} has {_written(word, other)}"
            faults.append(Fault("", f"{key}.{word}_{end}", text, found))
    return faults


def _same(a: float, b: float) -> bool:
    return abs(a - b) <= 1e-9 + 1e-6 * max(abs(a), abs(b))


def _written(word: str, value: float) -> str:
    if word != "radius":
        return f"{value:g}"
    return "inf" if value == 0.0 else f"{1.0 / value:g} m"


# faults and remarks -------------------------------------------------------------------------------


def _cant_steps(cant: Sequence[Section]) -> list[Fault]:
    faults = []
    for before, behind in pairwise(cant):
        if not _same(before.end_value, behind.start_value):
            found = f"the cant steps from {before.end_value:g} to {behind.start_value:g} m"
            faults.append(Fault("", behind.key, found, "a ramp (LIR) between the two elements"))
    return faults


def _curvature_steps(plan: Sequence[Section]) -> list[Remark]:
    remarks = []
    for before, behind in pairwise(plan):
        if not _same(before.end_value, behind.start_value):
            text = (
                f"the radius steps from {_written('radius', before.end_value)} to "
                f"{_written('radius', behind.start_value)} without a transition (CLO)"
            )
            remarks.append(Remark(behind.key, text))
    return remarks


def _gradient_steps(vertical: Sequence[Section]) -> list[Remark]:
    return [
        Remark(behind.key, "the gradient steps without a vertical curve (LIR)")
        for before, behind in pairwise(vertical)
        if not _same(before.end_value, behind.start_value)
    ]


def _too_long(name: str, sections: Sequence[Section], plan: Sequence[Section]) -> list[Remark]:
    if not sections or sections[-1].end <= plan[-1].end + SMALL:
        return []
    text = f"the list is longer ({sections[-1].end:g} m) than the plan ({plan[-1].end:g} m)"
    return [Remark(name, text)]


def _beyond_the_track(track: TrackTables) -> list[Remark]:
    """Remark on irregularities of which the track sees nothing."""
    remarks = []
    for index, part in enumerate(track.irregularities):
        begin, end = part.extent(track.length)
        if end <= 0.0 or begin >= track.length:
            text = f"from {begin:g} to {end:g} m, beyond the track's {track.length:g} m"
            remarks.append(Remark(f"irregularities.{index}", text))
    return remarks


def _cant_sizes(cant: Sequence[Section]) -> list[Remark]:
    remarks = []
    for section in cant:
        highest = max(abs(section.start_value), abs(section.end_value))
        if highest > HIGHEST_CANT:
            remarks.append(Remark(section.key, f"a cant of {1e3 * highest:.0f} mm"))
        if abs(section.slope) > STEEPEST_CANT_RAMP * (1.0 + 1e-9):
            text = f"a ramp of {1e3 * abs(section.slope):.2f} mm/m is steeper than the usual limit"
            remarks.append(Remark(section.key, text))
    return remarks


def _cant_sides(cant: Sequence[Section], plan: Sequence[Section]) -> list[Remark]:
    """Remark on cant on a straight and on cant whose outer rail is the lower one."""
    if not cant:
        return []
    last = cant[-1]
    rest = replace(last, begin=last.end, end=last.end + plan[-1].end, start_value=last.end_value)
    remarks = []
    for element in plan:
        pairs = _curvature_and_cant(element, (*cant, rest))
        if element.type == "STR":
            found, astray = "cant without curve", [abs(height) for _, height in pairs]
        else:
            found = "cant on the wrong side, the outer rail is the lower one"
            astray = [abs(height) for kappa, height in pairs if kappa * height < 0.0]
        if max(astray, default=0.0) > ASTRAY_CANT:
            remarks.append(Remark(element.key, f"{found}: {1e3 * max(astray):.0f} mm"))
    return remarks


def _curvature_and_cant(element: Section, cant: Sequence[Section]) -> list[tuple[float, float]]:
    """Return pairs of curvature and cant at the ends and middles of their common stretches."""
    pairs = []
    for section in cant:
        begin, end = max(element.begin, section.begin), min(element.end, section.end)
        if end - begin > SMALL:
            stretch = (begin, 0.5 * (begin + end), end)
            pairs += [(element.value(s), section.value(s)) for s in stretch]
    return pairs
