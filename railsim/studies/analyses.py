"""The analyses of a case: computed in addition to, or instead of, a run in the time domain.

Each returns numbers by name, which become columns of ``summary.csv``, and remarks; the names of an
analysis called ``curve`` in the study begin with ``curve.``.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from railsim.cant import cant_deficiency
from railsim.definitions.study.analyses import (
    Analysis,
    AssessAnalysis,
    CriticalSpeedAnalysis,
    CurvingAnalysis,
    ModesAnalysis,
    RunAnalysis,
)
from railsim.errors import Fault, Faults, ModelError
from railsim.result import Result

if TYPE_CHECKING:
    from railsim.studies.case import Case

Numbers = dict[str, float]
Outcome = tuple[Numbers, Sequence[str]]

LARGEST = ("Q", "Y", "Y_over_Q", "dQ_over_Q0", "sum_Y", "attack", "lateral", "car_roll")
"""Of steady curving: magnitudes over the wheels or wheelsets."""
LOCATIONS = ("x", "blocks", "wheelset")  # of comfort points and wheels


def numbers_and_remarks(case: "Case", result: Result | None) -> tuple[Numbers, list[str]]:
    """Return the numbers of all analyses of a case, and remarks; raises InputError, ModelError."""
    all_numbers: Numbers = {}
    all_remarks: list[str] = []
    for name, analysis in case.analyses.items():
        numbers, remarks = _ACTIONS[type(analysis)](case, analysis, result)
        all_numbers |= {f"{name}.{key}": value for key, value in numbers.items()}
        all_remarks += [f"{name}: {remark}" for remark in remarks]
    return all_numbers, all_remarks


def numbers_of(analysis: Analysis) -> tuple[str, ...]:
    """Return the names of the numbers of an analysis; empty where a standard says them."""
    if isinstance(analysis, CurvingAnalysis):
        return (*LARGEST, "sum_abs_Y", "T_gamma", "T_gamma_largest")
    if isinstance(analysis, CriticalSpeedAnalysis):
        return ("linear", "frequency", *analysis.methods)
    return ("damping", "frequency") if isinstance(analysis, ModesAnalysis) else ()


def check_analyses(analyses: Mapping[str, Analysis]) -> None:
    """Raise InputError: what is out of range in analyses, as it would be at every point."""
    faults = Faults()
    for name, analysis in analyses.items():
        caught = Faults()
        with caught.caught():
            _check(analysis)
        faults += [
            Fault("study", f"analyses.{name}.{one.file}", one.found, one.allowed, "--analyses")
            for one in caught
            if getattr(analysis, one.file) is not None  # else that of the point
        ]
    faults.check()


def _check(analysis: Analysis) -> None:
    if isinstance(analysis, CurvingAnalysis):
        from railsim.stability.curving import check_grid

        check_grid([analysis.radius], analysis.cant, [analysis.cant_deficiency or 0.0], ())
    elif isinstance(analysis, ModesAnalysis | CriticalSpeedAnalysis):
        from railsim.linear.vehicle import Contact

        contact = Contact(**_contact(analysis))
        if isinstance(analysis, ModesAnalysis):
            contact.faults().check()
        else:
            from railsim.stability.critical_speed import checked

            checked(contact, analysis.methods, analysis.low, analysis.high)


def _assessment_numbers(case: "Case", analysis: AssessAnalysis, result: Result | None) -> Outcome:
    """Largest share of each limit and value of a section; values of comfort, wear and safety.

    None, and a remark, where a run ended too early for them: what it is, its status says.
    """
    from railsim.assessment import assess
    from railsim.assessment.outputs import coarse_remarks
    from railsim.assessment.record import LEFT_OUT, TooShort

    assert result is not None  # a case with this analysis has a run
    try:
        (assessment,) = assess(result, analysis.standard, limits=analysis.limits, coarse=True)
    except TooShort as error:
        if result.status == "complete":
            raise
        return {}, (f"{LEFT_OUT}{error}",)
    shares: dict[str, float] = {}
    for row in assessment.worst:
        if not math.isnan(row.share):
            name = row.criterion.name
            shares[name] = max(row.share, shares.get(name, 0.0))
    numbers = {f"{name}_share": share for name, share in shares.items()}
    if shares:
        numbers["largest_share"] = max(shares.values())
    if assessment.verdict:
        numbers["exceeded"] = float(assessment.exceeded)
    judged = {row.criterion.name for row in assessment.worst}
    for section in (one for report in assessment.zones for one in report.values):
        for (quantity, _), values in section.values.items():
            if quantity in judged:
                name = f"{quantity}_largest"
                numbers[name] = max(*values, numbers.get(name, -math.inf))
    remarks = coarse_remarks(case.settings, case.speed)
    return {**numbers, **_largest(assessment.record(), analysis.standard)}, remarks


def _largest(record: Mapping[str, Any], standard: str) -> Numbers:
    """Largest magnitudes over points or wheels of comfort, wear and safety."""
    if standard not in ("comfort", "wear", "safety"):
        return {}
    ((_, report),) = record[standard].items()
    largest: Numbers = {}
    if standard == "safety":
        report = [*report["wheels"], {"overturning": report["overturning"]}]
    for row in report:
        for key, value in _numbers(row):
            largest[key] = max(largest.get(key, 0.0), abs(value))
    return largest


def _numbers(row: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of a table by name; names in nested tables are prefixed."""
    for key, value in row.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{before}{key}_")
        elif isinstance(value, int | float) and math.isfinite(value) and key not in LOCATIONS:
            yield f"{before}{key}", float(value)


def _modes(case: "Case", analysis: ModesAnalysis, result: Result | None) -> Outcome:
    """Damping ratio and frequency of the least damped oscillation from 0.3 to 40 Hz."""
    from railsim.linear.modes import modes

    eigenmodes = modes(
        case.vehicle, case.track, speed=case.speed, settings=case.settings, **_contact(analysis)
    )
    least = eigenmodes.least_damped
    if least is None:
        raise ModelError("no oscillation from 0.3 to 40 Hz")
    return {"damping": least.damping_ratio, "frequency": least.frequency}, eigenmodes.remarks


def _critical_speed(
    case: "Case", analysis: CriticalSpeedAnalysis, result: Result | None
) -> Outcome:
    """Critical speeds by method; an end of the search where it hunts at no speed, or at all."""
    from railsim.stability.critical_speed import critical_speed

    speeds = critical_speed(
        case.vehicle,
        case.track,
        methods=analysis.methods,
        low=analysis.low,
        high=analysis.high,
        over_amplitude=False,
        settings=case.settings,
        **_contact(analysis),
    )
    if speeds.linear is not None:
        numbers = {"linear": speeds.linear.speed, "frequency": speeds.linear.frequency}
    else:
        numbers = {"linear": analysis.low if speeds.unstable_at_low else analysis.high}
    for method, point in speeds.nonlinear.items():
        numbers[method] = analysis.high if point is None else point.speed
    return numbers, speeds.remarks


def _contact(analysis: ModesAnalysis | CriticalSpeedAnalysis) -> dict[str, Any]:
    return {name: getattr(analysis, name) for name in ("linearisation", "amplitude", "conicity")}


def _curving(case: "Case", analysis: CurvingAnalysis, result: Result | None) -> Outcome:
    """Largest magnitudes over the wheels or wheelsets, and the sum of the wear numbers."""
    import numpy as np

    from railsim.stability.curving import FAILED, curving

    deficiency = analysis.cant_deficiency
    if deficiency is None:
        deficiency = cant_deficiency(case.speed, 1.0 / abs(analysis.radius), analysis.cant)
    states = curving(
        case.vehicle,
        radius=[analysis.radius],
        cant=analysis.cant,
        cant_deficiency=[deficiency],
        track=case.track,
        settings=case.settings,
    )
    if states.converged.item() == FAILED:
        raise ModelError(
            f"R {analysis.radius:g} m: the vehicle leaves the track, or no step is stable"
        )
    numbers = {name: float(np.max(np.abs(getattr(states, name)))) for name in LARGEST}
    numbers["Y_over_Q"] = float(np.max(states.Y_over_Q))  # inwards: no derailment
    numbers["sum_abs_Y"] = float(np.max(np.abs(states.Y).sum(axis=-1)))
    numbers["T_gamma"] = float(np.sum(states.T_gamma))
    numbers["T_gamma_largest"] = float(np.max(states.T_gamma))
    return numbers, states.remarks


_ACTIONS: dict[type[Any], Callable[..., Outcome]] = {
    RunAnalysis: lambda *_: ({}, ()),  # peaks and mid-curve values, as in every study
    AssessAnalysis: _assessment_numbers,
    ModesAnalysis: _modes,
    CriticalSpeedAnalysis: _critical_speed,
    CurvingAnalysis: _curving,
}
