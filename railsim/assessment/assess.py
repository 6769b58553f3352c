"""`assess`: results against limits; the function that the command line and studies call."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from railsim.assessment.assessment import Assessment
from railsim.assessment.comfort_report import (
    block_remark,
    comfort_report,
    hunting_remark,
    shock_remark,
)
from railsim.assessment.record import LEFT_OUT, RUNNING, Record, TooShort
from railsim.assessment.running import assess_running, by_vehicle, running_limits
from railsim.assessment.safety import safety_report
from railsim.assessment.verdict import status_words
from railsim.assessment.wear import WholeLifeRailModel
from railsim.assessment.wear_report import wear_report
from railsim.definitions.limits import ComfortLimits, RunningLimits
from railsim.definitions.loading import load_comfort_limits
from railsim.definitions.vehicle.tables import Service
from railsim.errors import argument_error, listed
from railsim.result import Result

STANDARDS = (*RUNNING, "comfort", "wear", "safety")
# what uses an option; others are used by those of running behaviour
USED_BY = {"limits": (*RUNNING, "comfort"), "law": ("wear",)}


def check_options(standard: str, **options: object) -> None:
    """Refuse, by InputError, options that a standard does not use; None and False: not given."""
    for name, value in options.items():
        users = USED_BY.get(name, RUNNING)
        if value not in (None, False) and standard not in users:
            found = f"not used by the standard '{standard}'"
            raise argument_error(name, found, "only with " + ", ".join(users))


def limits_of(standard: str, file: str | Path | None = None) -> RunningLimits | ComfortLimits:
    """Return the limits of a standard, from a file or those shipped.

    Raises InputError: what is wrong in the file; limits of another standard, or of one without.
    """
    check_options(standard, limits=file)
    if standard in RUNNING:
        return running_limits(standard, file)
    return load_comfort_limits(file or "comfort")


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
    sections: str | Path | None = None,
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
    sections : str or Path, optional
        File of test sections, in place of those cut from the tracks.

    Returns
    -------
    list of Assessment

    Raises
    ------
    InputError
        A result lacks a quantity or is sampled too coarsely; all are too short (among others,
        one that is too short for comfort or wear is named in the remarks); an option that the
        standard does not use.

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
    if not isinstance(results, Mapping) or not all(
        isinstance(result, Result) for result in results.values()
    ):
        remedy = "give what railsim.open_result returns, or several by their names"
        raise TypeError(f"the results are a {type(results).__name__}; {remedy}")
    if standard not in STANDARDS:
        raise argument_error("standard", standard, "one of " + ", ".join(STANDARDS))
    check_options(
        standard, limits=limits, service=service, method=method != "normal", causal=causal,
        all_sections=all_sections, law=law, sections=sections,
    )  # fmt: skip
    groups = by_vehicle(results, loads=standard in RUNNING)
    if standard in RUNNING:
        return [
            assess_running(
                runs, standard, limits, service,
                method=method, causal=causal, coarse=coarse, all_sections=all_sections,
                sections=sections,
            )
            for runs in groups
        ]  # fmt: skip
    return [_assess_by_run(runs, standard, limits, law, coarse) for runs in groups]


def _assess_by_run(
    runs: Mapping[str, Result],
    standard: str,
    limits: str | Path | None,
    law: str | None,
    coarse: bool,
) -> Assessment:
    """Comfort, wear or safety, run by run."""
    vehicle = next(iter(runs.values())).vehicle().name
    report_of: dict[str, Callable[[Record], Any]]
    report_of = {"comfort": comfort_report, "safety": safety_report}
    report_of["wear"] = partial(wear_report, law=law)
    records, reports, short = dict[str, Record](), dict[str, Any](), list[TooShort]()
    for name, result in runs.items():
        try:
            records[name] = Record(result, name, coarse=coarse)
            reports[name] = report_of[standard](records[name])
        except TooShort as error:
            if standard == "safety":  # it may have derailed
                raise
            short.append(error)
    if not reports:
        raise TooShort(fault for error in short for fault in error.faults)
    remarks = [f"{LEFT_OUT}{error}" for error in short]
    remarks += [remark for name in reports for remark in records[name].remarks()]
    for name, result in runs.items():
        if result.status != "complete":
            part = "; only the part before that is assessed" if name in reports else ""
            remarks.append(f"{status_words(name, result)}{part}")
    subject = vehicle, standard, tuple(runs)
    driven = {}
    for name, result in runs.items():
        track = result.track()
        rails = "; ".join(part.summary() for part in track.irregularities[:2])
        driven[name] = result.speed, track.name, rails or "smooth rails"
    if standard == "safety":
        return Assessment(*subject, safety=reports, remarks=tuple(remarks))
    if standard == "wear":
        if without := [name for name, wheels in reports.items() if wheels[0].fatigue_index is None]:
            remedy = "run with settings.outputs.contact_patches=true"
            lacking = "USFD and FI_surf have no values without contact patches"
            remarks.append(f"{listed(without)}: {lacking}; {remedy}")
        if (model := next(iter(reports.values()))[0].model) != WholeLifeRailModel():
            parameters = f"threshold {model.threshold:g} N, counted: {model.counted}"
            remarks.append(f"Whole Life Rail Model of {law}: {parameters}")
        return Assessment(*subject, wear=reports, remarks=tuple(remarks), driven=driven)
    classes = load_comfort_limits(limits or "comfort")
    for name, points in reports.items():
        texts = block_remark(points), shock_remark(points), hunting_remark(records[name], points)
        remarks += [f"{name}: {text}" for text in texts if text]
    if not classes.mean_comfort.checked:
        remarks.append(f"classes of {classes.edition} not checked against the printed standard")
    distinct = tuple(dict.fromkeys(remarks))
    return Assessment(*subject, comfort=reports, remarks=distinct, limits=classes, driven=driven)
