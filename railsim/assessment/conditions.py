"""Test conditions of the standard: each is met, not met or not checked, and belongs to the verdict.

What is compared: sections (number, mean radius, both hands, independence, quality of the track) in
each zone of each population; conicity, load states, friction and gauge over all runs of the
vehicle.
A fault mode needs only one judged section, in any zone.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from railsim.assessment.sections import TestSection, reasons, section_length
from railsim.assessment.zones import Population, ZoneReport
from railsim.constants import WIDENED
from railsim.definitions.limits import (
    ConicityClasses,
    RunningLimits,
    Sourced,
    TrackTarget,
    Zone,
    up_to,
)
from railsim.definitions.vehicle.tables import Service
from railsim.result import Result
from railsim.table import beside, beside_ends

MET, NOT_MET, NOT_CHECKED = "met", "not met", "not checked"
SHARE = 90.0  # per cent of the sections, of the track's quality
MOST_NAMED = 4  # populations that lack the same in a zone, in a sentence each


@dataclass(frozen=True)
class Condition:
    """A condition of the test."""

    name: str
    place: str  # zone and population, empty for the whole test
    state: str  # ``met``, ``not met`` or ``not checked``
    found: str  # in words
    required: str  # in words
    source: str = ""  # source of the requirement
    checked: bool = False  # whether it has been compared with the printed standard

    @property
    def sentence(self) -> str:
        """The condition in one line."""
        place = f"{self.place}: " if self.place else ""
        return f"{place}{self.name} {self.state}: {self.found}; required {self.required}"

    def record(self) -> dict[str, object]:
        """Return it as plain strings."""
        return dict(self.__dict__)


def sentences(conditions: Iterable[Condition]) -> list[str]:
    """Conditions in one line each; what many populations lack alike in a zone is one line."""
    groups: dict[Condition, list[str]] = {}
    for condition in conditions:
        zone, _, population = condition.place.partition(", ")
        group = groups.setdefault(replace(condition, place=zone if population else ""), [])
        group.append(condition.place)
    lines = list[str]()
    for condition, places in groups.items():
        if (number := len(places)) > MOST_NAMED:
            places = [f"{condition.place}, {number} populations"]
        lines += [replace(condition, place=place).sentence for place in places]
    return lines


@dataclass(frozen=True)
class SectionRow:
    """A section of a run, for the list of sections."""

    run: str
    population: str
    section: TestSection
    alignment: float  # standard deviation in D1 [m]
    level: float  # likewise [m]
    quality: str  # class after UIC 518
    conicity: float  # equivalent, of the leading wheelset for 3 mm; nan where it is not known [1]
    realisation: str  # what the track's irregularities are, seed included
    counts: bool
    # of the track where it has irregularities, see `TrackQuality.further` [m]
    further: Mapping[str, float | str] = field(default_factory=dict)

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        nested = "section", "realisation", "further"
        plain = {k: v for k, v in self.__dict__.items() if k not in nested}
        return {**plain, **self.section.__dict__, **self.further}


def _state(met: bool) -> str:
    return MET if met else NOT_MET


def _condition(
    name: str, place: str, found: str, rule: Sourced | None, required: str, *, met: bool
) -> Condition:
    """Condition of a rule of the limits file; not checked where that has none."""
    if rule is None:
        return Condition(name, place, NOT_CHECKED, found, "a value in the limits file")
    return Condition(name, place, _state(met), found, required, rule.source, rule.checked)


def _section_count(place: str, found: str, zone: Zone, *, met: bool) -> Condition:
    least = f"{zone.sections} at least"
    return _condition("number of sections", place, found, zone, least, met=met)


def missing_zones(
    population: Population,
    reports: Sequence[ZoneReport],
    limits: RunningLimits,
    outside: Sequence[TestSection] = (),
) -> list[Condition]:
    """Zones in which a population has no sections; a fault mode needs one in any zone.

    `outside`: sections in no zone, told with the zone whose radii are nearest.
    """
    own_reports = [report for report in reports if report.population is population]
    if population.fault:
        if any(report.values for report in own_reports):
            return []
        every = [*(s for report in own_reports for s in report.sections), *outside]
        found = "; ".join(["none", *reasons(every)])
        head = "sections of the fault mode", population.name, NOT_MET
        return [Condition(*head, found, "one at least", "ours")]
    covered = {report.zone for report in own_reports}
    zones = [pair for pair in sorted(limits.zones.items()) if pair[0] not in covered]
    behind = f", {population.name}" if population.name else ""
    near: dict[str, list[TestSection]] = {}
    radii = {name: zone.radius for name, zone in limits.zones.items() if zone.radius}
    for s in outside if radii else ():
        name = min(radii, key=lambda n: min(abs(abs(s.radius) - end) for end in radii[n]))
        near.setdefault(name, []).append(s)
    texts = {name: "; ".join(["none", *reasons(near.get(name, ()))]) for name, _ in zones}
    return [_section_count(f"zone {n}{behind}", texts[n], zone, met=False) for n, zone in zones]


def zone_conditions(
    report: ZoneReport, rows: Sequence[SectionRow], limits: RunningLimits, service: Service
) -> Iterator[Condition]:
    """Conditions of a zone; `rows` are its sections that count."""
    zone, place, n = limits.zones[report.zone], report.title, len(report.values)
    outside = sum(bool(value.section.reason) for value in report.values)  # taken all the same
    enough = n >= zone.sections and not outside
    found = f"{n}, {outside} of them outside the conditions of the zone" if outside else str(n)
    found = found if enough else "; ".join([found, *reasons(report.sections)])
    yield _section_count(place, found, zone, met=enough)
    if not n:
        return
    lengths = [(v.section.end - v.section.begin, v.section.speed) for v in report.values]
    odd = [length for length, speed in lengths if abs(length - section_length(zone, speed)) > 0.5]
    if odd:
        span = dict.fromkeys(f"{length:.4g}" for length in (min(odd), max(odd)))
        found = f"{len(odd)} of {n} have {' to '.join(span)} m"
        standard = sorted({section_length(zone, speed) for _, speed in lengths})
        required = " or ".join(f"{length:g} m" for length in standard)
        yield _condition("lengths of the sections", place, found, zone, required, met=False)
    if (ends := zone.mean_radius) is not None:
        met, wide = ends[0] <= report.radius <= ends[1], f"{ends[0]:.0f} to {ends[1]:.0f} m"
        radius = f"{beside_ends(report.radius, ends)} m"
        yield _condition("mean radius", place, radius, zone, wide, met=met)
    if zone.radius is not None:
        right = sum(value.section.turn > 0 for value in report.values)
        found = f"{right} section{'s' * (right != 1)} to the right, {n - right} to the left"
        state = _state(0 < right < n)
        yield Condition("curves to both hands", place, state, found, "both", "ours")
    repeated = n - _independent_count(rows)
    found = f"{repeated} of {n} on irregularities that another section has as well"
    state = _state(not repeated)
    yield Condition("independent sections", place, state, found, "none", "ours")
    yield _quality_condition(place, rows, limits.track_quality, service)


def _independent_count(rows: Sequence[SectionRow]) -> int:
    """Largest number of sections of which no two share a part of the same irregularities.

    Runs at different speeds begin to count at different places, so that their sections need not
    coincide.  Taken in the order of their ends, each that overlaps none before it: the largest
    number of intervals that are disjoint.
    """
    count, ends = 0, dict[str, float]()
    for row in sorted(rows, key=lambda row: row.section.end):
        if row.section.begin > ends.get(row.realisation, -math.inf) - 0.1:
            ends[row.realisation] = row.section.end
            count += 1
    return count


def _quality_condition(
    place: str, rows: Sequence[SectionRow], target: TrackTarget | None, service: Service
) -> Condition:
    worse = sum(row.quality == "worse than QN2" for row in rows)
    percentiles = np.percentile([(row.alignment, row.level) for row in rows], SHARE, axis=0)
    alignment, level = percentiles.tolist()
    speed = min(max(row.section.speed for row in rows), service.admissible_speed)
    ends = target.ends(speed) if target else [math.nan] * 4
    low_a, high_a, low_l, high_l = (1e3 * end for end in ends)
    found = (
        f"{SHARE:.0f} % of the sections below "
        f"{beside_ends(1e3 * alignment, (low_a, high_a), 2)} mm alignment and "
        f"{beside_ends(1e3 * level, (low_l, high_l), 2)} mm level; "
        f"{100.0 * worse / len(rows):.0f} % worse than QN2"
    )
    if target is None:
        return Condition("track quality", place, NOT_CHECKED, found, "a target in the limits file")
    met = ends[0] <= alignment <= ends[1] and ends[2] <= level <= ends[3]
    required = f"{low_a:.2f} to {high_a:.2f} mm and {low_l:.2f} to {high_l:.2f} mm"
    return _condition("track quality", place, found, target, required, met=met)


def vehicle_conditions(
    reports: Sequence[ZoneReport],
    rows: Sequence[SectionRow],
    runs: Sequence[Result],
    limits: RunningLimits,
    service: Service,
) -> list[Condition]:
    """Conditions on all runs together; `rows` are the sections that count."""
    conditions = []
    values = [row.conicity for row in rows if row.section.zone == "1"]
    if values:
        conditions += _conicity_conditions(np.array(values), limits.conicity, service)
    conditions.append(_load_condition(reports))
    frictions = [run.track().friction_at(run["distance"]) for run in runs]
    lowest, highest = min(map(np.min, frictions)), max(map(np.max, frictions))
    least = limits.friction
    bounds = (beside(mu, least.value if least else math.nan, 3, "g") for mu in (lowest, highest))
    found = " to ".join(dict.fromkeys(bounds))
    required = f"{least.value:g} at least" if least else ""
    met = bool(least and lowest >= least.value)
    conditions.append(_condition("friction", "", found, least, required, met=met))
    gauges, nominal = [run.track().gauge for run in runs], limits.gauge
    ends = min(gauges), max(gauges)
    found = " to ".join(dict.fromkeys(f"{1e3 * gauge:.4g} mm" for gauge in ends))
    # limits of forces hold for the gauge for which they were found
    required = f"{1e3 * nominal.value:.4g} mm, for which the limits hold" if nominal else ""
    met = bool(nominal and all(abs(end - nominal.value) <= WIDENED for end in ends))
    return [*conditions, _condition("gauge", "", found, nominal, required, met=met)]


def _conicity_conditions(
    values: np.ndarray, classes: ConicityClasses | None, service: Service
) -> list[Condition]:
    names = ("low conicity in zone 1", "high conicity in zone 1")
    finite = values[np.isfinite(values)]
    if classes is None or not len(finite):
        missing = "classes in the limits file" if classes is None else "a wheelset that fits"
        return [Condition(name, "", NOT_CHECKED, "not known", missing) for name in names]
    speed = service.admissible_speed
    high = up_to(classes.high, speed, classes.high_above)
    found = f"{beside(finite.min(), classes.low, 2)} to {beside(finite.max(), high, 2)}"
    required = (
        f"{classes.low:.2f} at most in some sections",
        f"{high:.2f} at least in some sections",
    )
    met = bool(finite.min() <= classes.low), bool(finite.max() >= high)
    cases = zip(names, required, met, strict=True)
    return [_condition(name, "", found, classes, text, met=ok) for name, text, ok in cases]


def _load_condition(reports: Sequence[ZoneReport]) -> Condition:
    without_fault = [r for r in reports if not r.population.fault]
    loads = sorted({r.population.vehicle.load or "design" for r in without_fault if r.values})
    has_cases = any(r.population.vehicle.loads for r in without_fault)
    state = _state(len(loads) > 1) if has_cases or len(loads) > 1 else NOT_CHECKED
    found = ", ".join(loads) or "none, as no section counts"
    found = found if has_cases else "the vehicle's file has no load cases"
    return Condition("load states", "", state, found, "empty and laden", "[R]")
