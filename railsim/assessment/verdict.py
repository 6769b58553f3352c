"""The verdicts: running safety, track loading and ride, each with its reasons.

A verdict is never a pass by default: a condition that is not met or not checked makes it
``incomplete``.  What decides it, in this order:

================  ==================================================================================
``derailed``      a run derailed (running safety only; the others lack its sections)
``fail``          a limit is exceeded, or, for running safety, a wheel lifts off its rail
``not assessed``  no run reached its end
``incomplete``    sections, runs or conditions of the test are missing
``pass``          none of these
================  ==================================================================================

The overall verdict is the first of this list among those that decide (`RunningLimits.deciding`).
That lifting fails is ours: the standard has no limit for it, and Y/Q has no value there.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from railsim.assessment.conditions import MET, Condition, sentences
from railsim.assessment.criteria import SAFETY, VERDICTS, WORDS
from railsim.assessment.zones import ZoneReport
from railsim.result import Result
from railsim.table import beside

PASS, FAIL, INCOMPLETE = "pass", "fail", "incomplete"
NOT_ASSESSED, DERAILED = "not assessed", "derailed"
ORDER = (DERAILED, FAIL, NOT_ASSESSED, INCOMPLETE, PASS)


@dataclass(frozen=True)
class Verdict:
    """A verdict."""

    value: str  # ``pass``, ``fail``, ``incomplete``, ``not assessed`` or ``derailed``
    reasons: tuple[str, ...]  # why it is not a pass

    def record(self) -> dict[str, object]:
        """Return it as plain strings."""
        return {"verdict": self.value, "reasons": list(self.reasons)}


def overall(verdicts: Mapping[str, Verdict], deciding: Sequence[str]) -> str:
    """Return the worst of the verdicts that decide."""
    values = {verdicts[name].value for name in deciding}
    return next(value for value in ORDER if value in values)


def all_verdicts(
    runs: Mapping[str, Result], reports: Sequence[ZoneReport], conditions: Sequence[Condition]
) -> dict[str, Verdict]:
    """Return the verdicts by criterion, on all runs, also those that did not reach their end."""
    derailed = [status_words(n, r) for n, r in runs.items() if r.status == "derailed"]
    unfinished = {n: r for n, r in runs.items() if r.status not in ("complete", "derailed")}
    stopped = [f"{status_words(n, r)}: not assessed" for n, r in unfinished.items()]
    missing = sentences([condition for condition in conditions if condition.state != MET])
    verdicts = {}
    for name in VERDICTS:
        exceeded = [reason for report in reports for reason in _exceedances(report, name)]
        rows = [(r.title, row) for r in reports for row in r.rows if row.criterion.group == name]
        few: dict[str, dict[str, None]] = {}  # quantities by zone, whatever the wheels
        for title, row in rows:
            if math.isnan(row.share):
                few.setdefault(title, {})[row.criterion.words] = None
        unknown = [f"{t}: too few values for an estimate: {'; '.join(q)}" for t, q in few.items()]
        # such as ride without accelerations, track loading of the simplified method
        nothing = (
            [] if rows or not reports else [f"{WORDS[name]}: none of its quantities has values"]
        )
        incomplete = [*stopped, *unknown, *nothing, *missing]
        if derailed and name == SAFETY:
            value = DERAILED
        elif exceeded:
            value = FAIL
        elif len(derailed) + len(stopped) == len(runs):
            value = NOT_ASSESSED
        else:
            value = INCOMPLETE if incomplete or derailed else PASS
        verdicts[name] = Verdict(value, tuple(dict.fromkeys([*derailed, *exceeded, *incomplete])))
    return verdicts


def status_words(name: str, result: Result) -> str:
    """Say how a run ended, and why."""
    reason = str(result.attributes.get("status_reason", ""))
    return f"{name}: {result.status}" + (f", {reason}" if reason else "")


def _exceedances(report: ZoneReport, criterion: str) -> list[str]:
    """Return limits exceeded and wheels lifted, a sentence each."""
    lines = [
        f"{report.title}: {row.criterion.words}, {row.place}: {beside(100.0 * row.share, 100.0)} % "
        "of the limit"
        for row in report.exceeded
        if row.criterion.group == criterion
    ]
    if criterion == SAFETY:
        lifted = [f"{wheel} without load over {m:.1f} m" for wheel, m in report.lifted.items()]
        lines += [f"{report.title}: {text}: Y/Q has no value" for text in lifted]
    return lines
