"""`assess`: results against limits; the function that the command line and studies call."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from railsim.assessment.comfort_report import (
    PointComfort,
    caused_by_hunting,
    comfort_report,
    short_of_blocks,
)
from railsim.assessment.conditions import Condition, SectionRow
from railsim.assessment.influences import Influence
from railsim.assessment.record import Record
from railsim.assessment.running import Options, Running, assessed_runs, by_vehicle, limits_checked
from railsim.assessment.safety_report import SafetyReport, safety_report
from railsim.assessment.verdict import DERAILED, FAIL, Verdict, overall
from railsim.assessment.wear_report import WheelWear, wear_report
from railsim.assessment.zones import Assessed, ZoneReport
from railsim.definitions.limits import ComfortLimits, RunningLimits
from railsim.definitions.loading import load_comfort_limits, load_running_limits
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, InputError, argument_error
from railsim.result import Result

RUNNING = ("en14363", "uic518")
STANDARDS = (*RUNNING, "comfort", "wear", "safety")


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
        ``pass``, ``fail``, ``incomplete``, ``not assessed`` or ``derailed``: the worst of the
        verdicts that decide; empty where the standard has none.
    verdicts : dict
        Verdicts on ``safety``, ``loading`` and ``ride``.
    zones : tuple of ZoneReport
        For each population its zones.
    conditions : tuple of Condition
        Conditions of the test.
    sections : tuple of SectionRow
        Sections of all runs.
    hunting_frequency : float or None
        Frequency at which the instability is judged [Hz].
    influences : tuple of Influence
        Regressions over several influences, for information.
    comfort : dict
        Comfort at the measuring points, by run.
    driven : dict
        Speed [m/s], track and what displaces its rails in words, by run, for comfort.
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
    verdicts: Mapping[str, Verdict] = field(default_factory=dict)
    zones: tuple[ZoneReport, ...] = ()
    conditions: tuple[Condition, ...] = ()
    sections: tuple[SectionRow, ...] = ()
    hunting_frequency: float | None = None
    influences: tuple[Influence, ...] = ()
    comfort: Mapping[str, Sequence[PointComfort]] = field(default_factory=dict)
    driven: Mapping[str, tuple[float, str, str]] = field(default_factory=dict)
    wear: Mapping[str, Sequence[WheelWear]] = field(default_factory=dict)
    safety: Mapping[str, SafetyReport] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    limits: RunningLimits | ComfortLimits | None = None

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded or a run derailed."""
        return self.verdict in (FAIL, DERAILED)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reasons why it is not a pass, of all verdicts."""
        found = [why for verdict in self.verdicts.values() for why in verdict.reasons]
        return tuple(dict.fromkeys(found))

    @property
    def quality(self) -> tuple[SectionRow, ...]:
        """Sections that count."""
        return tuple(row for row in self.sections if row.counts)

    @property
    def worst(self) -> tuple[Assessed, ...]:
        """For each zone and quantity, the value with the largest share of its limit."""
        names = sorted({zone.zone for zone in self.zones})
        return tuple(row for name in names for _, row in self.worst_in(name).values())

    def worst_in(self, zone: str) -> dict[str, tuple[ZoneReport, Assessed]]:
        """By quantity, the value with the largest share of its limit in a zone, and where it is."""
        found: dict[str, tuple[ZoneReport, Assessed]] = {}
        for report in self.zones:
            for row in report.rows if report.zone == zone else ():
                before = found.get(row.criterion.name)
                if before is None or not row.rank <= before[1].rank:
                    found[row.criterion.name] = report, row
        return found

    def record(self) -> dict[str, object]:
        """Return the assessment as plain numbers and strings, SI."""
        limits = self.limits
        comfort = {}
        if isinstance(limits, ComfortLimits):
            comfort = {run: [p.record(limits) for p in own] for run, own in self.comfort.items()}
        return {
            "vehicle": self.vehicle, "standard": self.standard,
            "edition": limits.edition if limits else None, "runs": list(self.runs),
            "verdict": self.verdict or None, "reasons": list(self.reasons),
            "verdicts": {name: verdict.record() for name, verdict in self.verdicts.items()},
            "deciding": list(getattr(limits, "deciding", ())),
            "conditions": [condition.record() for condition in self.conditions],
            "zones": [zone.record() for zone in self.zones],
            "hunting_frequency": self.hunting_frequency,
            "regression": [one.record() for one in self.influences],
            "sections": [row.record() for row in self.sections], "comfort": comfort,
            "wear": {run: [w.record() for w in wheels] for run, wheels in self.wear.items()},
            "safety": {run: report.record() for run, report in self.safety.items()},
            "remarks": list(self.remarks),
        }  # fmt: skip


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
    law: str | None = None,
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
    law : str, optional
        Of ``wear``: one of `railsim.assessment.wear.LAWS`, or a file of one; by default all.

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
    ...     railsim.load_track("straight"), speed=36.67, until=500.0, settings=settings)
    >>> (verdict,) = assess(run)
    >>> verdict.verdict, len(verdict.zones[0].values)
    ('incomplete', 1)
    """
    if isinstance(results, Result):
        results = {str(results.attributes.get("run", "run")): results}
    if standard not in STANDARDS:
        raise argument_error("standard", standard, "one of " + ", ".join(STANDARDS))
    found = []
    for runs in by_vehicle(results):
        if standard in RUNNING:
            name = str(limits or standard)
            known = limits_checked(load_running_limits(limits or standard), name)
            if known.standard != standard:
                fault = Fault(name, "standard", repr(known.standard), f"wanted: '{standard}'")
                raise InputError([fault])
            options = Options(method, causal, coarse, all_sections)
            found.append(_running(runs, known, assessed_runs(runs, known, service, options)))
        else:
            found.append(_other(runs, standard, limits, law, coarse))
    return found


def _running(runs: Mapping[str, Result], limits: RunningLimits, done: Running) -> Assessment:
    vehicle, verdict = (
        next(iter(runs.values())).vehicle().name,
        overall(done.verdicts, limits.deciding),
    )
    found = {"verdict": verdict, "limits": limits, **vars(done)}
    return Assessment(vehicle, limits.standard, tuple(runs), **found)


def _other(
    runs: Mapping[str, Result],
    standard: str,
    limits: str | Path | None,
    law: str | None,
    coarse: bool,
) -> Assessment:
    """Comfort, wear or safety, run by run."""
    vehicle = next(iter(runs.values())).vehicle().name
    records = {name: Record(result, name, coarse=coarse) for name, result in runs.items()}
    remarks = [remark for record in records.values() for remark in record.remarks()]
    ended = {name: r.status for name, r in runs.items() if r.status != "complete"}
    remarks += [f"{n}: {end}, only the part before that is assessed" for n, end in ended.items()]
    about = vehicle, standard, tuple(runs)
    if standard == "wear":
        wear = {name: wear_report(record, law=law) for name, record in records.items()}
        return Assessment(*about, wear=wear, remarks=tuple(remarks))
    if standard == "safety":
        safety = {name: safety_report(record) for name, record in records.items()}
        return Assessment(*about, safety=safety, remarks=tuple(remarks))
    classes = load_comfort_limits(limits or "comfort")
    comfort = {name: comfort_report(record) for name, record in records.items()}
    for name, points in comfort.items():
        said = short_of_blocks(points), caused_by_hunting(records[name], points)
        remarks += [f"{name}: {sentence}" for sentence in said if sentence]
    if not classes.mean_comfort.checked:
        remarks.append(f"classes of {classes.edition} not checked against the printed standard")
    said_once, driven = (
        tuple(dict.fromkeys(remarks)),
        {n: (r.speed, *_rails(r)) for n, r in runs.items()},
    )
    return Assessment(*about, comfort=comfort, remarks=said_once, limits=classes, driven=driven)


def _rails(result: Result) -> tuple[str, str]:
    """Track and what displaces its rails, in words."""
    track = result.track()
    words = "; ".join(part.summary() for part in track.irregularities[:2])
    return track.name, words or "smooth rails"
