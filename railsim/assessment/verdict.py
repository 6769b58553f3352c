"""Estimates from section values, compared with limits zone by zone, and the verdict.

A verdict is never a pass by default: too few sections or missing zones make it ``incomplete``, a
derailed run makes it ``derailed``.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.assessment.en14363 import SectionValues
from railsim.assessment.sections import TestSection, reasons
from railsim.assessment.statistics import Estimate, one_dimensional, two_dimensional
from railsim.definitions.flatten import flatten
from railsim.definitions.limits import RunningLimits, Sourced
from railsim.definitions.vehicle import Service, Vehicle
from railsim.result.filters import Floats

WELL_SPREAD = 0.1
"""Range of the cant deficiency, as a share of the admissible one, from which the two-dimensional
method is used."""
PASS, FAIL, INCOMPLETE, DERAILED = "pass", "fail", "incomplete", "derailed"


@dataclass(frozen=True)
class Rule:
    """How a quantity is assessed.

    Attributes
    ----------
    name : str
        Key in the limits and in the section values.
    kind : str
        Type of the statistics; ``largest``: no estimate, the largest value is assessed.
    methods : tuple of str
        ``normal``, with wheel forces, and ``simplified``, with accelerations.
    words, unit : str
        Name and unit in tables.
    scale : float
        Factor from SI to the unit in tables.
    """

    name: str
    kind: str
    methods: tuple[str, ...]
    words: str
    unit: str
    scale: float = 1.0


RULES = (
    Rule("sum_Y", "safety", ("normal",), "track shifting force, 2 m", "kN", 1e-3),
    Rule("Y_over_Q", "safety", ("normal",), "derailment quotient, 2 m", "-"),
    Rule("instability", "largest", ("normal",), "rms of track shifting force, 100 m", "kN", 1e-3),
    Rule("Q", "loading", ("normal",), "wheel load", "kN", 1e-3),
    Rule("Q_qst", "quasi_static", ("normal",), "quasi-static wheel load", "kN", 1e-3),
    Rule("Y_qst", "quasi_static", ("normal",), "quasi-static guiding force", "kN", 1e-3),
    Rule("body_y_safety", "safety", ("simplified",), "body lateral, 6 Hz", "m/s2"),
    Rule("body_z_safety", "safety", ("simplified",), "body vertical, 0.4 to 4 Hz", "m/s2"),
    Rule("frame_y", "safety", ("simplified",), "bogie frame lateral, 10 Hz", "m/s2"),
    Rule("body_y", "ride", ("normal", "simplified"), "body lateral, ride", "m/s2"),
    Rule("body_z", "ride", ("normal", "simplified"), "body vertical, ride", "m/s2"),
    Rule("body_y_rms", "ride", ("normal", "simplified"), "body lateral, rms", "m/s2"),
    Rule("body_z_rms", "ride", ("normal", "simplified"), "body vertical, rms", "m/s2"),
    Rule("body_y_qst", "quasi_static", ("normal", "simplified"), "body lateral, quasi-static",
         "m/s2"),
)  # fmt: skip


@dataclass(frozen=True)
class Assessed:
    """Estimate of one quantity at one wheelset, wheel or sensor, and its limit.

    Attributes
    ----------
    rule : Rule
    place : str
        Wheelset, wheel or sensor; wheelsets count from 1.
    estimate : Estimate
    limit : float
        [SI]
    source : str
        Source of the limit.
    checked : bool
        Whether the limit has been compared with the printed standard.
    """

    rule: Rule
    place: str
    estimate: Estimate
    limit: float
    source: str
    checked: bool

    @property
    def share(self) -> float:
        """Estimate over limit [1]."""
        return self.estimate.value / self.limit

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        return {
            "name": self.rule.name,
            "place": self.place,
            "N": self.estimate.N,
            "mean": self.estimate.mean,
            "deviation": self.estimate.deviation,
            "estimate": self.estimate.value,
            "method": f"{self.estimate.method}-dimensional",
            "limit": self.limit,
            "share": self.share,
            "source": self.source,
            "checked": self.checked,
        }


@dataclass(frozen=True)
class ZoneReport:
    """A zone: sections, quantities, missing conditions.

    Attributes
    ----------
    zone : str
    values : tuple of SectionValues
        Sections that count.
    sections : tuple of TestSection
        All sections of the zone, including those that do not count.
    rows : tuple of Assessed
    needed : int
        Number of sections that the standard requires.
    notes : tuple of str
        Notes for the reader.
    complete : bool
        Whether the conditions of the standard are met.
    """

    zone: str
    values: tuple[SectionValues, ...]
    sections: tuple[TestSection, ...]
    rows: tuple[Assessed, ...]
    needed: int
    notes: tuple[str, ...]
    complete: bool

    @property
    def exceeded(self) -> tuple[Assessed, ...]:
        """Rows above their limits, and those that have no value."""
        return tuple(row for row in self.rows if not row.share <= 1.0)

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        return {
            "zone": self.zone,
            "sections": len(self.values),
            "sections_needed": self.needed,
            "complete": self.complete,
            "notes": list(self.notes),
            "quantities": [row.record() for row in self.rows],
        }


def zone_reports(
    values: Sequence[SectionValues],
    sections: Sequence[TestSection],
    vehicle: Vehicle,
    service: Service,
    limits: RunningLimits,
    Q0: Floats,
    method: str,
) -> list[ZoneReport]:
    """Assess all zones that have sections.

    Parameters
    ----------
    values : sequence of SectionValues
        Of the sections that count, of all runs.
    sections : sequence of TestSection
        All sections of all runs.
    Q0 : float64[wheelset, side]
        Static wheel loads [N].
    method : {'normal', 'simplified'}
    """
    reports = []
    for zone in sorted(limits.zones):
        own = tuple(v for v in values if v.section.zone == zone)
        all_own = tuple(s for s in sections if s.zone == zone)
        if not all_own:
            continue
        radius = _mean_radius(own)
        limit_of = _limits(vehicle, service, limits, Q0, zone, radius)
        rows = _rows(own, limit_of, limits, service, zone, method)
        notes, complete = _notes(zone, own, all_own, limits, radius)
        needed = limits.zones[zone].sections
        reports.append(ZoneReport(zone, own, all_own, rows, needed, notes, complete))
    return reports


def _mean_radius(values: Sequence[SectionValues]) -> float:
    radii = [abs(v.section.radius) for v in values]
    return float(np.mean(radii)) if radii else math.nan


def _notes(
    zone: str,
    values: Sequence[SectionValues],
    sections: Sequence[TestSection],
    limits: RunningLimits,
    radius: float,
) -> tuple[tuple[str, ...], bool]:
    wanted = limits.zones[zone]
    notes = reasons(sections)
    complete = len(values) >= wanted.sections
    if not complete:
        notes.append(f"{len(values)} sections, the standard requires {wanted.sections}")
    ends = wanted.mean_radius
    if values and ends is not None and not ends[0] <= radius <= ends[1]:
        complete = False
        notes.append(f"mean radius {radius:.0f} m, required {ends[0]:.0f} to {ends[1]:.0f} m")
    lifted: dict[str, float] = defaultdict(float)
    for value in values:
        for wheel, metres in value.lifted.items():
            lifted[wheel] += metres
    notes += [f"{wheel} without load over {metres:.1f} m" for wheel, metres in lifted.items()]
    return tuple(notes), complete


def _rows(
    values: Sequence[SectionValues],
    limit_of: Mapping[str, Callable[[str], tuple[float, Sourced]]],
    limits: RunningLimits,
    service: Service,
    zone: str,
    method: str,
) -> tuple[Assessed, ...]:
    rows = []
    for rule in RULES:
        if method not in rule.methods:
            continue
        gathered: dict[str, list[tuple[float, float]]] = {}
        for value in values:
            for (name, label), numbers in value.values.items():
                if name == rule.name:
                    pairs = [(value.section.cant_deficiency, number) for number in numbers]
                    gathered.setdefault(label, []).extend(pairs)
        for label, pairs in gathered.items():
            influence, found = np.array(pairs).T
            limit, sourced = limit_of[rule.name](label)
            if rule.name == "Y_qst":
                found = _high_friction(values, label, found, limits)
            estimate = _estimate(rule, influence, found, limits, service, straight=zone == "1")
            rows.append(Assessed(rule, label, estimate, limit, sourced.source, sourced.checked))
    return tuple(rows)


def _estimate(
    rule: Rule,
    influence: Floats,
    values: Floats,
    limits: RunningLimits,
    service: Service,
    *,
    straight: bool,
) -> Estimate:
    if rule.kind == "largest":
        plain = one_dimensional(values, 0.0)
        return Estimate(plain.N, plain.mean, plain.deviation, float(np.max(values)), "one")
    statistics = limits.statistics
    wide = float(np.ptp(influence)) >= WELL_SPREAD * service.cant_deficiency
    if not straight and wide and len(values) > 4:
        probability = getattr(statistics.probability, rule.kind)
        return two_dimensional(influence, values, service.cant_deficiency, probability)
    return one_dimensional(values, getattr(statistics.k, rule.kind))


def _high_friction(
    values: Sequence[SectionValues], label: str, guiding: Floats, limits: RunningLimits
) -> Floats:
    """Guiding forces, corrected where Y/Q of the inner wheel indicates high friction."""
    law = limits.high_friction
    if law is None:
        return guiding
    inner = label.replace("outer", "inner")
    quotient = np.array(
        [v.values["Y_over_Q_inner", inner][0] for v in values if ("Y_qst", label) in v.values]
    )
    excess = np.where(quotient > law.threshold, quotient - law.threshold, 0.0)
    return np.asarray(guiding - law.slope * excess)


def _limits(
    vehicle: Vehicle, service: Service, limits: RunningLimits, Q0: Floats, zone: str, radius: float
) -> dict[str, Callable[[str], tuple[float, Sourced]]]:
    """Limit of each quantity by wheelset, wheel or sensor [SI], with its source."""

    def axle(label: str) -> float:
        static = float(np.mean(Q0[int(label.split()[1]) - 1]))
        law = limits.sum_Y
        return law.k1[service.category] * (law.constant + law.factor * static)

    def wheel(label: str) -> float:
        static = float(np.mean(Q0[int(label.split()[1]) - 1]))
        speed, law = service.admissible_speed, limits.Q
        most = next((m for v, m in law.by_speed if speed <= v * (1.0 + 1e-4)), law.above)
        return min(law.constant + static, most)

    def frame(label: str) -> float:
        law = limits.frame_y
        return law.constant - law.slope * _bogie_mass(vehicle, int(label.split("_")[1]))

    index = int(zone) - 1
    steady = limits.Y_qst
    fixed: dict[str, tuple[float, Sourced]] = {
        "Y_over_Q": (limits.Y_over_Q.value, limits.Y_over_Q),
        "Q_qst": (limits.Q_qst.value, limits.Q_qst),
        "Y_qst": (steady.constant + steady.numerator / radius, steady),
        "body_y_safety": (limits.body_y_safety.values[index], limits.body_y_safety),
        "body_z_safety": (limits.body_z_safety.values[index], limits.body_z_safety),
    }
    for name in ("body_y", "body_z", "body_y_rms", "body_z_rms", "body_y_qst"):
        constant = getattr(limits, name)
        fixed[name] = (constant.value, constant)

    def always(pair: tuple[float, Sourced]) -> Callable[[str], tuple[float, Sourced]]:
        return lambda _: pair

    found = {name: always(pair) for name, pair in fixed.items()}
    found["sum_Y"] = lambda label: (axle(label), limits.sum_Y)
    found["Q"] = lambda label: (wheel(label), limits.Q)
    found["frame_y"] = lambda label: (frame(label), limits.frame_y)
    share = limits.instability
    found["instability"] = lambda label: (share.value * axle(label), share)
    return found


def _bogie_mass(vehicle: Vehicle, wheelset: int) -> float:
    """Mass of the frame above a wheelset (from 1) and of the wheelsets nearest to it [kg]."""
    flat = flatten(vehicle)
    wheelsets = flat.of_kind("wheelset")
    frames = [b for b in flat.of_kind("body") if b.name != flat.reference]

    def frame_of(x: float) -> str:
        return min(frames, key=lambda frame: abs(frame.position[0] - x)).name

    own = frame_of(wheelsets[wheelset - 1].position[0])
    carried = [w.mass for w in wheelsets if frame_of(w.position[0]) == own]
    return sum(b.mass for b in frames if b.name == own) + sum(carried)
