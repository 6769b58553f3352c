"""Zones: section values of one population to estimates and limits.

A population is what may be pooled: runs of a vehicle in one condition (load, wheel profiles, fault)
on track of one kind (spectra of the irregularities, friction, rails), whatever their seeds.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from railsim.assessment.en14363 import SectionValues
from railsim.assessment.rules import INFORMATION, RULES, SAFETY, Assessed, Limit, Rule, limits_of
from railsim.assessment.sections import TestSection, reasons
from railsim.assessment.statistics import Estimate, extreme, one_dimensional, two_dimensional
from railsim.definitions.limits import RunningLimits
from railsim.definitions.vehicle import Vehicle
from railsim.definitions.vehicle_tables import Service
from railsim.result.filters import Floats

WELL_SPREAD = 0.1
"""Range of the cant deficiency, as a share of the admissible one, from which the two-dimensional
method is used."""


@dataclass(frozen=True)
class Population:
    """Runs whose section values may be pooled.

    Attributes
    ----------
    name : str
        Empty where there is only one.
    vehicle : Vehicle
        In its condition.
    Q0 : float64[wheelset, side]
        Static wheel loads [N].
    """

    name: str
    vehicle: Vehicle
    Q0: Floats

    @property
    def fault(self) -> bool:
        """Whether it is a fault mode, which is assessed for running safety only."""
        return bool(self.vehicle.service and self.vehicle.service.fault)


@dataclass(frozen=True)
class ZoneReport:
    """A zone of a population: sections and quantities.

    Attributes
    ----------
    zone : str
    population : Population
    values : tuple of SectionValues
        Sections that count.
    sections : tuple of TestSection
        All sections of the zone, including those that do not count.
    rows : tuple of Assessed
        Quantities with limits.
    information : tuple of Assessed
        Quantities without.
    needed : int
        Number of sections that the standard requires.
    """

    zone: str
    population: Population
    values: tuple[SectionValues, ...]
    sections: tuple[TestSection, ...]
    rows: tuple[Assessed, ...]
    information: tuple[Assessed, ...]
    needed: int

    @property
    def title(self) -> str:
        """Zone and population in words."""
        return ", ".join(filter(None, [f"zone {self.zone}", self.population.name]))

    @property
    def nearest(self) -> list[Assessed]:
        """Of each quantity the row that is nearest to its limit, or has the extreme value."""
        found: dict[str, Assessed] = {}
        for row in (*self.rows, *self.information):
            before = found.get(row.rule.name)
            if before is None or not row.rank <= before.rank:
                found[row.rule.name] = row
        return list(found.values())

    @property
    def exceeded(self) -> tuple[Assessed, ...]:
        """Rows above their limits."""
        return tuple(row for row in self.rows if row.share > 1.0)

    @property
    def radius(self) -> float:
        """Mean radius of the sections that count [m]."""
        return _mean_radius(self.values)

    @property
    def lifted(self) -> dict[str, float]:
        """Length without load by wheel [m]."""
        found: dict[str, float] = defaultdict(float)
        for value in self.values:
            for wheel, metres in value.lifted.items():
                found[wheel] += metres
        return dict(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sections that do not count, and wheels without load."""
        lifted = [f"{wheel} without load over {metres:.1f} m" for wheel, metres in
                  self.lifted.items()]  # fmt: skip
        return (*reasons(self.sections), *lifted)

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        return {
            "zone": self.zone,
            "population": self.population.name,
            "sections": len(self.values),
            "sections_needed": self.needed,
            "notes": list(self.notes),
            "lifted": self.lifted,
            "quantities": [row.record() for row in self.rows],
            "information": [row.record() for row in self.information],
        }


@dataclass(frozen=True)
class _Pooled:
    """What a zone's estimates need."""

    values: Sequence[SectionValues]
    limits: RunningLimits
    service: Service
    straight: bool


def zone_reports(
    population: Population,
    values: Sequence[SectionValues],
    sections: Sequence[TestSection],
    service: Service,
    limits: RunningLimits,
    method: str,
) -> list[ZoneReport]:
    """Assess all zones in which a population has sections.

    Parameters
    ----------
    population : Population
    values : sequence of SectionValues
        Of the sections that count, of all its runs.
    sections : sequence of TestSection
        All sections of all its runs.
    method : {'normal', 'simplified'}
    """
    reports = []
    for zone in sorted(limits.zones):
        own = tuple(v for v in values if v.section.zone == zone)
        all_own = tuple(s for s in sections if s.zone == zone)
        if not all_own:
            continue
        vehicle, Q0 = population.vehicle, population.Q0
        limit_of = limits_of(vehicle, service, limits, Q0, zone, _mean_radius(own))
        pooled = _Pooled(own, limits, service, straight=zone == "1")
        rules = [r for r in RULES if method in r.methods and
                 (r.group in (SAFETY, INFORMATION) or not population.fault)]  # fmt: skip
        rows = [row for rule in rules for row in _rows(rule, pooled, limit_of)]
        reports.append(ZoneReport(
            zone, population, own, all_own,
            tuple(row for row in rows if row.rule.group != INFORMATION),
            tuple(row for row in rows if row.rule.group == INFORMATION),
            limits.zones[zone].sections,
        ))  # fmt: skip
    return reports


def _mean_radius(values: Sequence[SectionValues]) -> float:
    radii = [abs(v.section.radius) for v in values]
    return float(np.mean(radii)) if radii else math.nan


def _rows(rule: Rule, pooled: _Pooled, limit_of: Mapping[str, Limit]) -> list[Assessed]:
    gathered: dict[str, list[tuple[float, list[float]]]] = {}
    for value in pooled.values:
        for (name, label), numbers in value.values.items():
            if name == rule.name:
                gathered.setdefault(label, []).append((value.section.cant_deficiency, numbers))
    rows = []
    for label, pairs in gathered.items():
        influence = np.array([deficiency for deficiency, _ in pairs])
        # the two signs of a section are not independent: each sign is a sample of its own
        signs = np.array([numbers for _, numbers in pairs]).T
        estimate = _larger([_estimate(rule, influence, x, pooled) for x in signs])
        if rule.name not in limit_of:
            rows.append(Assessed(rule, label, estimate))
            continue
        limit, sourced = limit_of[rule.name](label)
        row = Assessed(rule, label, estimate, limit, sourced.source, sourced.checked)
        if rule.name == "Y_qst" and row.share > 1.0:
            corrected = _high_friction(label, signs[0], pooled)
            if corrected is not None:
                after = _estimate(rule, influence, corrected, pooled)
                row = replace(row, estimate=after, uncorrected=estimate)
        rows.append(row)
    return rows


def _larger(estimates: Sequence[Estimate]) -> Estimate:
    """The largest estimate, which decides; nan where none has a value."""
    known = [one for one in estimates if not math.isnan(one.value)]
    return max(known, key=lambda one: one.value) if known else estimates[0]


def _estimate(rule: Rule, influence: Floats, values: Floats, pooled: _Pooled) -> Estimate:
    if rule.kind in ("largest", "smallest"):
        return extreme(values, rule.kind)
    statistics, service = pooled.limits.statistics, pooled.service
    wide = float(np.ptp(influence)) >= WELL_SPREAD * service.cant_deficiency
    if not pooled.straight and wide and len(values) > 4:
        probability = getattr(statistics.probability, rule.kind)
        return two_dimensional(influence, values, service.cant_deficiency, probability)
    return one_dimensional(values, getattr(statistics.k, rule.kind))


def _high_friction(label: str, guiding: Floats, pooled: _Pooled) -> Floats | None:
    """Guiding forces corrected where Y/Q of the inner wheel indicates high friction, if any."""
    law = pooled.limits.high_friction
    if law is None:
        return None
    inner = label.replace("outer", "inner")
    quotient = np.array([
        v.values["Y_over_Q_inner", inner][0] for v in pooled.values if ("Y_qst", label) in v.values
    ])  # fmt: skip
    high = quotient > law.threshold
    if not high.any():
        return None
    return np.asarray(guiding - law.slope * np.where(high, quotient - law.threshold, 0.0))
