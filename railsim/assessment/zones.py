"""Zones: section values of one population to estimates and limits.

A population is what may be pooled: runs of a vehicle in one condition (load, wheel profiles, fault)
on track of one kind (spectra of the irregularities, friction, rails), whatever their seeds.
"""

import math
import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.criteria import CRITERIA, INFORMATION, SAFETY, WORDS, Criterion
from railsim.assessment.en14363 import SectionValues
from railsim.assessment.sections import TestSection, reasons
from railsim.assessment.statistics import Estimate, extreme, one_dimensional, two_dimensional
from railsim.definitions.limits import RunningLimits, Situation
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.tables import Service

WELL_SPREAD = 0.1
"""Range of the cant deficiency, as a share of the admissible one, from which the two-dimensional
method is used."""

BESIDE = 0.8 * WELL_SPREAD, 1.25 * WELL_SPREAD
"""Ranges between which it is said where the other method would lead to another verdict."""

ROUNDING = 1e-9
"""Share of a limit by which the rounding of a regression may miss it: on the limit is met."""

METHODS = {"one": "one-dimensional", "two": "two-dimensional", "largest": "largest value",
           "smallest": "smallest value"}  # fmt: skip


@dataclass(frozen=True)
class Assessed:
    """Estimate of one quantity at one wheelset, wheel or sensor, and its limit."""

    criterion: Criterion
    place: str  # wheelset, wheel or sensor; wheelsets count from 1
    estimate: Estimate
    limit: float = math.nan  # nan for quantities without [SI]
    source: str = ""  # source of the limit
    checked: bool = False  # whether the limit has been compared with the printed standard
    # before the correction for high friction, where that was made
    uncorrected: Estimate | None = None
    # by the other method, where the choice of it is close and decides whether the limit is exceeded
    other: Estimate | None = None

    @property
    def share(self) -> float:
        """Estimate over limit [1]."""
        return self.estimate.value / self.limit

    @property
    def exceeded(self) -> bool:
        """Whether it is above its limit."""
        return self.estimate.value > self.limit + ROUNDING * abs(self.limit)

    @property
    def rank(self) -> tuple[bool, float]:
        """What the rows of a quantity are ordered by: share of the limit, else the value.

        Rows with too few values for an estimate come last, by their means.
        """
        value = self.estimate.value
        if math.isnan(value):
            return False, self.estimate.mean
        if not math.isnan(self.limit):
            return True, self.share
        return True, -value if self.criterion.kind == "smallest" else value

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        estimate, line = self.estimate, self.estimate.line
        return {
            "name": self.criterion.name, "criterion": self.criterion.group, "place": self.place,
            "N": estimate.N, "mean": estimate.mean, "deviation": estimate.deviation,
            "estimate": estimate.value,
            "uncorrected": self.uncorrected.value if self.uncorrected else None,
            "method": METHODS[estimate.method],
            "line": float(line.at(line.target)) if line else None,
            "line_error": line.error if line else None, "target": line.target if line else None,
            "limit": self.limit, "share": self.share, "source": self.source,
            "checked": self.checked,
        }  # fmt: skip


@dataclass(frozen=True)
class Population:
    """Runs whose section values may be pooled."""

    name: str  # empty where there is only one
    vehicle: Vehicle  # in its condition
    Q0: Floats  # static wheel loads [N], float64[wheelset, side]

    @property
    def fault(self) -> bool:
        """Whether it is a fault mode, which is assessed for running safety only."""
        return bool(self.vehicle.service and self.vehicle.service.fault)


@dataclass(frozen=True)
class ZoneReport:
    """A zone of a population: sections and quantities."""

    zone: str
    population: Population
    values: tuple[SectionValues, ...]  # sections that count
    sections: tuple[TestSection, ...]  # all sections of the zone, including those that do not count
    rows: tuple[Assessed, ...]  # quantities with limits
    information: tuple[Assessed, ...]  # quantities without
    needed: int  # number of sections that the standard requires

    @property
    def title(self) -> str:
        """Zone and population in words."""
        return ", ".join(filter(None, [f"zone {self.zone}", self.population.name]))

    @property
    def nearest(self) -> list[Assessed]:
        """Of each quantity the row that is nearest to its limit, or has the extreme value."""
        rows: dict[str, Assessed] = {}
        for row in (*self.rows, *self.information):
            before = rows.get(row.criterion.name)
            if before is None or row.rank > before.rank:
                rows[row.criterion.name] = row
        return list(rows.values())

    @property
    def exceeded(self) -> tuple[Assessed, ...]:
        """Rows above their limits."""
        return tuple(row for row in self.rows if row.exceeded)

    @property
    def undecided(self) -> tuple[str, ...]:
        """Remarks on the limits that are exceeded by one of the two methods only."""
        return tuple(
            f"{self.title}: {row.criterion.words}, {row.place}: {_by_method(row, row.estimate)}, "
            f"{_by_method(row, row.other)}, limit {row.criterion.text(row.limit)}: the verdict "
            f"depends on the method, which changes where cant deficiencies span {WELL_SPREAD:.0%} "
            "of the admissible one"
            for row in self.rows
            if row.other
        )

    @property
    def radius(self) -> float:
        """Mean radius of the sections that count [m]."""
        return _mean_radius(self.values)

    @property
    def lifted(self) -> dict[str, float]:
        """Length without load by wheel [m]."""
        lengths: dict[str, float] = defaultdict(float)
        for value in self.values:
            for wheel, metres in value.lifted.items():
                lengths[wheel] += metres
        return dict(lengths)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sections that do not count, and wheels without load."""
        lifted = (f"{wheel} without load over {m:.1f} m" for wheel, m in self.lifted.items())
        return (*reasons(self.sections), *lifted)

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        return {
            "zone": self.zone, "population": self.population.name, "sections": len(self.values),
            "sections_needed": self.needed, "notes": list(self.notes), "lifted": self.lifted,
            "quantities": [row.record() for row in self.rows],
            "information": [row.record() for row in self.information],
        }  # fmt: skip


def _by_method(row: Assessed, estimate: Estimate) -> str:
    value, unit = row.criterion.text(estimate.value), row.criterion.unit
    return f"{METHODS[estimate.method]} {value} {unit}"


def zone_reports(
    population: Population,
    values: Sequence[SectionValues],
    sections: Sequence[TestSection],
    service: Service,
    limits: RunningLimits,
    method: str,
) -> list[ZoneReport]:
    """Assess all zones in which a population has sections.

    `values`: Of the sections that count, of all its runs. `sections`: All sections of all its
    runs. `method` ({'normal', 'simplified'}).
    """
    groups = (SAFETY, INFORMATION) if population.fault else tuple(WORDS)
    criteria = [c for c in CRITERIA.values() if method in c.methods and c.group in groups]
    reports = []
    for zone in sorted(limits.zones):
        zone_sections = tuple(s for s in sections if s.zone == zone)
        if not zone_sections:
            continue
        counted = tuple(v for v in values if v.section.zone == zone)
        pooled = _Pooled(population, zone, counted, limits, service)
        rows = [row for criterion in criteria for row in pooled.rows(criterion)]
        limited = tuple(row for row in rows if row.criterion.group != INFORMATION)
        rest = tuple(row for row in rows if row.criterion.group == INFORMATION)
        needed = limits.zones[zone].sections
        reports.append(ZoneReport(zone, population, counted, zone_sections, limited, rest, needed))
    return reports


def _mean_radius(values: Sequence[SectionValues]) -> float:
    radii = [abs(v.section.radius) for v in values]
    return float(np.mean(radii)) if radii else math.nan


Pairs = Sequence[tuple[float, list[float]]]  # cant deficiency and values of each section


@dataclass(frozen=True)
class _Pooled:
    """Values of the sections of one zone of a population, and what their estimates need."""

    population: Population
    zone: str
    values: Sequence[SectionValues]
    limits: RunningLimits
    service: Service

    def rows(self, criterion: Criterion) -> Iterator[Assessed]:
        """Estimates of a quantity, place by place, with their limits."""
        pairs: dict[str, list[tuple[float, list[float]]]] = defaultdict(list)
        for value in self.values:
            for (name, place), numbers in value.values.items():
                if name == criterion.name:
                    pairs[place].append((value.section.cant_deficiency, numbers))
        for place, samples in pairs.items():
            row = self._assess(criterion, place, samples, WELL_SPREAD)
            others = [self._assess(criterion, place, samples, border) for border in BESIDE]
            differing = [other.estimate for other in others if other.exceeded != row.exceeded]
            yield replace(row, other=next(iter(differing), None))

    def _assess(self, criterion: Criterion, place: str, pairs: Pairs, border: float) -> Assessed:
        """Estimate and limit, two-dimensional where cant deficiencies span `border` or more."""
        influence = np.array([deficiency for deficiency, _ in pairs])
        # the two signs of a section are not independent: each sign is a sample of its own
        signs = np.array([numbers for _, numbers in pairs]).T
        estimate = _largest([self._estimate(criterion, influence, x, border) for x in signs])
        law = self.limits.limits.get(criterion.name)
        if law is None:
            return Assessed(criterion, place, estimate)
        limit = law.at(self._situation(place))
        row = Assessed(criterion, place, estimate, limit, law.source, law.checked)
        corrected = None
        if criterion.name == "Y_qst" and row.exceeded:
            corrected = self._friction_corrected(place, signs[0])
        if corrected is None:
            return row
        after = self._estimate(criterion, influence, corrected, border)
        return replace(row, estimate=after, uncorrected=estimate)

    def _situation(self, place: str) -> Situation:
        """What limits depend on, at a wheelset, wheel or sensor."""
        number = re.match(r"(?:wheelset |frame_)(\d+)", place)
        wheelset = int(number[1]) - 1 if number else None
        static = math.nan if wheelset is None else float(np.mean(self.population.Q0[wheelset]))
        conditions = self.service, self.zone, _mean_radius(self.values), wheelset, static
        return Situation(self.population.vehicle, *conditions, self.limits.limits)

    def _estimate(
        self, criterion: Criterion, influence: Floats, values: Floats, border: float
    ) -> Estimate:
        kind = criterion.kind
        if kind in ("largest", "smallest"):
            return extreme(values, kind)
        statistics, most = self.limits.statistics, self.service.cant_deficiency
        wide = float(np.ptp(influence)) >= border * most
        if self.zone != "1" and wide and len(values) > 4:
            return two_dimensional(influence, values, most, getattr(statistics.probability, kind))
        return one_dimensional(values, getattr(statistics.k, kind))

    def _friction_corrected(self, place: str, guiding: Floats) -> Floats | None:
        """Guiding forces corrected where Y/Q of the inner wheel indicates high friction, if any.

        A section whose inner wheel carries nothing has no Y/Q and is not corrected.
        """
        law, inner = self.limits.high_friction, ("Y_over_Q_inner", place.replace("outer", "inner"))
        rows = [v.values for v in self.values if ("Y_qst", place) in v.values]
        quotient = np.array([values.get(inner, [0.0])[0] for values in rows])
        if law is None or not (quotient > law.threshold).any():
            return None
        return np.asarray(guiding - law.slope * np.maximum(quotient - law.threshold, 0.0))


def _largest(estimates: Sequence[Estimate]) -> Estimate:
    """The largest estimate, which decides; where none has a value that of the largest mean."""
    finite = [e for e in estimates if not math.isnan(e.value)]
    return max(finite or estimates, key=lambda e: e.value if finite else e.mean)
