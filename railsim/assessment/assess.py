"""`assess`: results against limits; the function that the command line and studies call."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from railsim.assessment.comfort_report import PointComfort, comfort_report, short_of_blocks
from railsim.assessment.en14363 import SectionValues, section_values
from railsim.assessment.record import Record
from railsim.assessment.safety_report import SafetyReport, safety_report
from railsim.assessment.sections import TestSection, track_sections
from railsim.assessment.track_quality import TrackQuality, quality_class
from railsim.assessment.verdict import (
    DERAILED,
    FAIL,
    INCOMPLETE,
    PASS,
    Assessed,
    ZoneReport,
    zone_reports,
)
from railsim.assessment.wear_report import WheelWear, wear_report
from railsim.definitions.limits import ComfortLimits, RunningLimits
from railsim.definitions.loading import load_comfort_limits, load_running_limits
from railsim.definitions.vehicle import Service, Vehicle
from railsim.errors import Fault, InputError, argument_fault
from railsim.result import Result

RUNNING = ("en14363", "uic518")
STANDARDS = (*RUNNING, "comfort", "wear", "safety")
ZONES = ("1", "2", "3", "4")


@dataclass(frozen=True)
class Quality:
    """Track quality of one section [m] and its class after UIC 518."""

    run: str
    begin: float
    end: float
    alignment: float
    level: float
    quality: str


@dataclass(frozen=True)
class Assessment:
    """Assessment of all runs of one vehicle.

    Attributes
    ----------
    vehicle : str
        Name of the vehicle.
    standard : str
    runs : tuple of str
        Names of the runs.
    verdict : str
        ``pass``, ``fail``, ``incomplete`` or ``derailed``; empty where the standard has none.
    reasons : tuple of str
        Reasons why it is not a pass.
    zones : tuple of ZoneReport
    quality : tuple of Quality
    comfort : dict
        Comfort at the measuring points, by run.
    wear : dict
        Wear of the wheels, by run.
    safety : dict
        `SafetyReport` by run.
    remarks : tuple of str
        Notes for the reader.
    limits : RunningLimits or ComfortLimits or None
    """

    vehicle: str
    standard: str
    runs: tuple[str, ...]
    verdict: str = ""
    reasons: tuple[str, ...] = ()
    zones: tuple[ZoneReport, ...] = ()
    quality: tuple[Quality, ...] = ()
    comfort: Mapping[str, Sequence[PointComfort]] = field(default_factory=dict)
    wear: Mapping[str, Sequence[WheelWear]] = field(default_factory=dict)
    safety: Mapping[str, SafetyReport] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    limits: RunningLimits | ComfortLimits | None = None

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded or a run derailed."""
        return self.verdict in (FAIL, DERAILED)

    @property
    def worst(self) -> tuple[Assessed, ...]:
        """For each zone and quantity, the value with the largest share of its limit."""
        found: list[Assessed] = []
        for zone in self.zones:
            by_name: dict[str, Assessed] = {}
            for row in zone.rows:
                before = by_name.get(row.rule.name)
                if before is None or not row.share <= before.share:
                    by_name[row.rule.name] = row
            found.extend(by_name.values())
        return tuple(found)

    def record(self) -> dict[str, object]:
        """Return the assessment as plain numbers and strings, SI."""
        limits = self.limits
        comfort = {}
        if isinstance(limits, ComfortLimits):
            comfort = {run: [p.record(limits) for p in points]
                       for run, points in self.comfort.items()}  # fmt: skip
        return {
            "vehicle": self.vehicle,
            "standard": self.standard,
            "edition": limits.edition if limits else None,
            "runs": list(self.runs),
            "verdict": self.verdict or None,
            "reasons": list(self.reasons),
            "zones": [zone.record() for zone in self.zones],
            "track_quality": [dict(q.__dict__) for q in self.quality],
            "comfort": comfort,
            "wear": {run: [w.record() for w in wheels] for run, wheels in self.wear.items()},
            "safety": {run: report.record() for run, report in self.safety.items()},
            "remarks": list(self.remarks),
        }


def assess(
    results: Mapping[str, Result] | Result,
    standard: str = "en14363",
    *,
    limits: str | Path | None = None,
    service: Service | None = None,
    method: str = "normal",
    causal: bool = False,
    coarse: bool = False,
    all_sections: bool = False,
) -> list[Assessment]:
    """Assess results: one assessment for each vehicle among them.

    Parameters
    ----------
    results : mapping of str to Result, or Result
        Results by the names of their runs; all runs of a vehicle are assessed together.
    standard : {'en14363', 'uic518', 'comfort', 'wear', 'safety'}
    limits : str or Path, optional
        Limits file, or name of a shipped one; by default that of the standard.
    service : Service, optional
        Used instead of the vehicles' service tables.
    method : {'normal', 'simplified'}
        Measuring method: with wheel forces, or with accelerations only.
    causal : bool
        Use causal filters, as in a measuring amplifier, instead of zero-phase filters.
    coarse : bool
        Accept results with fewer than 1000 samples per second that were not low-pass filtered.
    all_sections : bool
        Include sections outside the conditions of their zones.

    Returns
    -------
    list of Assessment

    Raises
    ------
    InputError
        A result lacks a quantity, is sampled too coarsely or is too short.

    Examples
    --------
    >>> import railsim
    >>> settings = railsim.load_settings(None, ["output_rate=1000"])
    >>> run = railsim.simulate(railsim.load_vehicle("coach_manchester"),
    ...     railsim.load_track("straight"), speed=48.9, until=500.0, settings=settings)
    >>> (verdict,) = assess(run)
    >>> verdict.verdict, len(verdict.zones[0].values)
    ('incomplete', 1)
    """
    if isinstance(results, Result):
        results = {str(results.attributes.get("run", "run")): results}
    if standard not in STANDARDS:
        raise InputError(
            [argument_fault("standard", "", standard, "one of " + ", ".join(STANDARDS))]
        )
    groups: dict[str, dict[str, Result]] = {}
    for name, result in results.items():
        text = str(result.attributes["vehicle_toml"])
        groups.setdefault(hashlib.sha256(text.encode()).hexdigest(), {})[name] = result
    found = []
    for runs in groups.values():
        if standard in RUNNING:
            law = load_running_limits(limits or standard)
            if law.standard != standard:
                fault = Fault(str(limits), "standard", repr(law.standard), f"wanted: '{standard}'")
                raise InputError([fault])
            found.append(_running(runs, law, service, method, causal, coarse, all_sections))
        else:
            found.append(_other(runs, standard, limits, coarse))
    return found


def _running(
    runs: Mapping[str, Result],
    limits: RunningLimits,
    given: Service | None,
    method: str,
    causal: bool,
    coarse: bool,
    all_sections: bool,
) -> Assessment:
    first = next(iter(runs.values()))
    vehicle = first.vehicle()
    service = given or _service(vehicle, next(iter(runs)))
    derailed = {name: r for name, r in runs.items() if r.status not in ("complete",)}
    values: list[SectionValues] = []
    sections: list[TestSection] = []
    quality: list[Quality] = []
    remarks: list[str] = []
    for name, result in runs.items():
        if name in derailed:
            continue
        record = Record(result, name, coarse=coarse)
        remarks += record.remarks()
        own = track_sections(result.track(), limits, service, record.covered(), record.speed_at)
        sections += own
        counting = [s for s in own if s.zone and (all_sections or not s.reason)]
        values += section_values(record, counting, causal=causal)
        quality += _quality(name, result, counting, service)
    reports = zone_reports(values, sections, vehicle, service, limits, first["Q0"], method)
    if not sections and not derailed:
        raise InputError([Fault(
            next(iter(runs)), "distance", "too short for one section",
            "a longer run, or other sections in the limits file (--limits)",
        )])  # fmt: skip
    verdict, why = _verdict(reports, sections, derailed)
    if not all(row.checked for report in reports for row in report.rows):
        remarks.append(f"limits of {limits.edition} not checked against the printed standard")
    return Assessment(
        vehicle.name, limits.standard, tuple(runs), verdict, tuple(why), tuple(reports),
        tuple(quality), remarks=tuple(dict.fromkeys(remarks)), limits=limits,
    )  # fmt: skip


def _service(vehicle: Vehicle, name: str) -> Service:
    if vehicle.service is None:
        raise InputError([Fault(
            name, "vehicle.service", "the vehicle has no service table",
            "add [service] with admissible_speed and cant_deficiency to its file, or give "
            "--admissible-speed and --cant-deficiency",
        )])  # fmt: skip
    return vehicle.service


def _quality(
    name: str, result: Result, sections: Sequence[TestSection], service: Service
) -> list[Quality]:
    track = result.track()
    if not sections or not track.irregularities:
        return []
    there = TrackQuality(track, sections[0].begin, sections[-1].end)
    found = []
    for section in sections:
        alignment, level = there.deviations(section.begin, section.end)
        quality = quality_class(min(section.speed, service.admissible_speed), alignment, level)
        found.append(Quality(name, section.begin, section.end, alignment, level, quality))
    return found


def _verdict(
    reports: Sequence[ZoneReport], sections: Sequence[TestSection], derailed: Mapping[str, Result]
) -> tuple[str, list[str]]:
    """Verdict, and the reasons why it is not a pass."""
    why = [f"{name}: {result.status}, {result.attributes.get('status_reason', '')}"
           for name, result in derailed.items()]  # fmt: skip
    failed = False
    for report in reports:
        rows = [row for row in report.exceeded if not math.isnan(row.share)]
        failed = failed or bool(rows)
        why += [
            f"zone {report.zone}: {row.rule.words}, {row.place}: {100.0 * row.share:.0f} % of the "
            "limit"
            for row in rows
        ]
    incomplete = []
    there = {report.zone: report for report in reports}
    for zone in ZONES:
        if zone not in there:
            incomplete.append(f"zone {zone}: no sections")
        elif not there[zone].complete:
            incomplete += [f"zone {zone}: {note}" for note in there[zone].notes]
        elif any(math.isnan(row.share) for row in there[zone].rows):
            incomplete.append(f"zone {zone}: too few values for an estimate")
    odd = {s.reason for s in sections if not s.zone}
    incomplete += sorted(odd) if incomplete else []
    why += incomplete
    if derailed:
        return DERAILED, why
    if failed:
        return FAIL, why
    return (INCOMPLETE, why) if incomplete else (PASS, why)


def _other(
    runs: Mapping[str, Result], standard: str, limits: str | Path | None, coarse: bool
) -> Assessment:
    """Comfort, wear or safety, run by run."""
    vehicle = next(iter(runs.values())).vehicle().name
    records = {name: Record(result, name, coarse=coarse) for name, result in runs.items()}
    remarks = [remark for record in records.values() for remark in record.remarks()]
    remarks += [f"{name}: {r.status}, only the part before that is assessed"
                for name, r in runs.items() if r.status != "complete"]  # fmt: skip
    names = tuple(runs)
    if standard == "wear":
        wear = {name: wear_report(record) for name, record in records.items()}
        return Assessment(vehicle, standard, names, wear=wear, remarks=tuple(remarks))
    if standard == "safety":
        safety = {name: safety_report(record) for name, record in records.items()}
        return Assessment(vehicle, standard, names, safety=safety, remarks=tuple(remarks))
    law = load_comfort_limits(limits or "comfort")
    comfort = {name: comfort_report(record) for name, record in records.items()}
    remarks += [f"{name}: {short}" for name, points in comfort.items()
                if (short := short_of_blocks(points))]  # fmt: skip
    if not law.mean_comfort.checked:
        remarks.append(f"classes of {law.edition} not checked against the printed standard")
    return Assessment(
        vehicle, standard, names, comfort=comfort, remarks=tuple(dict.fromkeys(remarks)),
        limits=law,
    )  # fmt: skip
