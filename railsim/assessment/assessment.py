"""What an assessment of all runs of a vehicle has found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from railsim.assessment.comfort_report import PointComfort
from railsim.assessment.conditions import Condition, SectionRow
from railsim.assessment.en14363 import SectionValues
from railsim.assessment.influences import Influence
from railsim.assessment.safety import SafetyReport
from railsim.assessment.verdict import DERAILED, FAIL, Verdict
from railsim.assessment.wear_report import WheelWear
from railsim.assessment.zones import Assessed, ZoneReport
from railsim.definitions.limits import ComfortLimits, RunningLimits
from railsim.plottable import draw_figure
from railsim.table import Table, html_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    transitions : dict
        Values of the transitions, which are in no statistics, by run.
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
    transitions: Mapping[str, Sequence[SectionValues]] = field(default_factory=dict)

    @property
    def exceeded(self) -> bool:
        """Whether a limit is exceeded or a run derailed."""
        in_runs = any(report.exceeded for report in self.safety.values())
        return self.verdict in (FAIL, DERAILED) or in_runs

    @property
    def reasons(self) -> tuple[str, ...]:
        """Reasons why it is not a pass, of all verdicts."""
        reasons = [reason for verdict in self.verdicts.values() for reason in verdict.reasons]
        return tuple(dict.fromkeys(reasons))

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
        worst: dict[str, tuple[ZoneReport, Assessed]] = {}
        for report in self.zones:
            for row in report.rows if report.zone == zone else ():
                before = worst.get(row.criterion.name)
                if before is None or row.rank > before[1].rank:
                    worst[row.criterion.name] = report, row
        return worst

    def __repr__(self) -> str:
        words = (self.vehicle, self.standard, self.verdict)
        return f"<Assessment: {', '.join(filter(None, words))}>"

    def __str__(self) -> str:
        return "\n".join(map(str, self._lines()))

    def _repr_html_(self) -> str:
        return html_of(self._lines())

    def _lines(self) -> list[str | Table]:
        from railsim.assessment.tables import assessment_lines

        return assessment_lines(self, quiet=False)

    def plot(self, path: str | Path | None = None, *, overwrite: bool = False) -> "Figure":
        """Draw estimates against limits, comfort or wear; also into the file of `path`."""
        return draw_figure(self, path, overwrite)

    def record(self) -> dict[str, object]:
        """Return the assessment as plain numbers and strings, SI."""
        limits = self.limits
        comfort = {}
        if isinstance(limits, ComfortLimits):
            comfort = {run: [p.record(limits) for p in x] for run, x in self.comfort.items()}
        return {
            "vehicle": self.vehicle, "standard": self.standard,
            "edition": limits.edition if limits else None, "runs": list(self.runs),
            "verdict": self.verdict or None, "reasons": list(self.reasons),
            "verdicts": {name: verdict.record() for name, verdict in self.verdicts.items()},
            "deciding": list(getattr(limits, "deciding", ())),
            "conditions": [condition.record() for condition in self.conditions],
            "zones": [zone.record() for zone in self.zones],
            "hunting_frequency": self.hunting_frequency,
            "regression": [row.record() for row in self.influences],
            "sections": [row.record() for row in self.sections],
            "transitions": {run: [v.record() for v in x] for run, x in self.transitions.items()},
            "comfort": comfort,
            "wear": {run: [w.record() for w in wheels] for run, wheels in self.wear.items()},
            "safety": {run: report.record() for run, report in self.safety.items()},
            "remarks": list(self.remarks),
        }  # fmt: skip
