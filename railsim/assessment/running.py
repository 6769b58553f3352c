"""Running tests after EN 14363 and UIC 518: all runs of a vehicle to zones and verdicts."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from railsim.assessment.assessment import Assessment
from railsim.assessment.conditions import (
    Condition,
    SectionRow,
    missing_zones,
    vehicle_conditions,
    zone_conditions,
)
from railsim.assessment.criteria import CRITERIA, DYNAMIC, INFORMATION
from railsim.assessment.en14363 import (
    SectionValues,
    hunting_frequency,
    hunting_spectrum,
    section_values,
)
from railsim.assessment.influences import influences
from railsim.assessment.record import LEFT_OUT, Record
from railsim.assessment.sections import TestSection, own_sections, track_sections, transitions
from railsim.assessment.track_quality import D1, D2, D3, TrackQuality, quality_class
from railsim.assessment.verdict import all_verdicts, overall
from railsim.assessment.zones import Population, ZoneReport, zone_reports
from railsim.definitions.limits import ByAxleLoad, RunningLimits
from railsim.definitions.loading import load_own_sections, load_running_limits
from railsim.definitions.own_sections import OwnSections
from railsim.definitions.vehicle.loads import DESIGN
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, Faults, InputError, input_error, listed, nearest
from railsim.result import Result

OF_LIMITS = ("admissible_speed", "cant_deficiency", "category")
"""Keys of the service table that limits depend on."""


@dataclass
class _Run:
    """A run that reached its end: its sections, those that count, and the values of these."""

    record: Record
    population: str
    sections: list[TestSection]
    counting: list[TestSection]
    values: list[SectionValues] = field(default_factory=list)


def by_vehicle(results: Mapping[str, Result], *, loads: bool) -> list[dict[str, Result]]:
    """Return the runs that belong to one assessment together.

    Those of the same vehicle, in all its `loads` or in one; or of vehicles of the same name, each
    in a condition that its service table states.
    """
    groups: dict[str, dict[str, Result]] = {}
    for name, result in results.items():
        vehicle = result.vehicle()
        key = f"file {(vehicle.replace(load=None) if loads else vehicle).to_toml()}"
        if vehicle.service is not None and vehicle.service.condition is not None:
            key = f"name {vehicle.name}"
        groups.setdefault(key, {})[name] = result
    return list(groups.values())


def _kind(result: Result) -> tuple[str, ...]:
    """What may not be pooled with others, in words."""
    vehicle, track = result.vehicle(), result.track()
    condition = (vehicle.service.condition if vehicle.service else None) or ""
    spectra = [str(getattr(part, "spectrum", part.type)) for part in track.irregularities]
    rails = " / ".join(dict.fromkeys(track.rail))
    return (
        condition, vehicle.load or ("" if condition else DESIGN),
        ", ".join(dict.fromkeys(spectra)) or "smooth", f"friction {track.friction_words}",
        f"{rails}, inclination {track.inclination:g}, gauge {track.gauge:g} m",
    )  # fmt: skip


def _populations(runs: Mapping[str, Result]) -> dict[str, str]:
    """Name of each run's population: what differs between the runs, and the condition."""
    kinds = {name: _kind(result) for name, result in runs.items()}
    differing = {k for k in range(5) if len({kind[k] for kind in kinds.values()}) > 1}
    if len({kind[0] for kind in kinds.values()}) == len({kind[:2] for kind in kinds.values()}):
        differing -= {1}  # the condition says which load it is
    keys = sorted({0, *differing})
    return {name: ", ".join(filter(None, (kind[k] for k in keys))) for name, kind in kinds.items()}


def assess_running(
    runs: Mapping[str, Result],
    standard: str,
    file: str | Path | None,
    service: Service | None,
    *,
    method: str,
    causal: bool,
    coarse: bool,
    all_sections: bool,
    sections: str | Path | None = None,
) -> Assessment:
    """Assess all runs of a vehicle; arguments as of `railsim.assessment.assess`.

    Raises InputError: no service table; a run lacks a quantity, is sampled too coarsely or too
    short; limits of another standard, or not those of the assessed quantities; sections outside a
    run.
    """
    limits = running_limits(standard, file)
    section_file = _load_section_file(sections, runs) if sections else None
    service = service or _service(runs)
    fault = f"no '{service.category}'", "the vehicle's category"
    Faults(
        Fault(str(file or standard), f"limits.{name}.k1", *fault)
        for name, law in limits.limits.items()
        if isinstance(law, ByAxleLoad) and service.category not in law.k1
    ).check()
    done = []
    populations = _populations(runs)
    for name, result in runs.items():
        if result.status == "complete":
            record = Record(result, name, coarse=coarse)
            cut = _sections(record, limits, service, section_file)
            counting = [s for s in cut if s.zone and (all_sections or not s.reason)]
            done.append(_Run(record, populations[name], cut, counting))
    if done and not any(run.sections for run in done):
        allowed = "a longer run, or other sections in the limits file (--limits)"
        raise input_error(done[0].record.name, "too short for one section", allowed, "distance")
    f0 = hunting_frequency([hunting_spectrum(run.record, run.counting) for run in done])
    for run in done:
        run.values = section_values(run.record, run.counting, f0=f0, causal=causal)
    rows = [row for run in done for row in _section_rows(run, service)]
    counted = [row for row in rows if row.counts]
    zones: list[ZoneReport] = []
    conditions: list[Condition] = []
    for name in dict.fromkeys(run.population for run in done):
        members = [run for run in done if run.population == name]
        result = members[0].record.result
        population = Population(name, result.vehicle(), result["Q0"])
        values = [v for run in members for v in run.values]
        every_section = [s for run in members for s in run.sections]
        reports = zone_reports(population, values, every_section, service, limits, method)
        zones += reports
        outside = [s for s in every_section if not s.zone]
        conditions += missing_zones(population, reports, limits, outside)
        for report in reports if not population.fault else ():
            in_zone = [r for r in counted if r.section.zone == report.zone and r.population == name]
            conditions += zone_conditions(report, in_zone, limits, service)
    results = [run.record.result for run in done]
    if done:
        conditions += vehicle_conditions(zones, counted, results, limits, service)
    verdicts = all_verdicts(runs, zones, conditions)
    return Assessment(
        next(iter(runs.values())).vehicle().name, standard, tuple(runs),
        overall(verdicts, limits.deciding), verdicts, tuple(zones), tuple(conditions), tuple(rows),
        f0, tuple(influences(zones, service)), remarks=_remarks(done, zones, limits), limits=limits,
        transitions={run.record.name: _transitions(run, method, causal=causal) for run in done},
    )  # fmt: skip


def running_limits(standard: str, file: str | Path | None) -> RunningLimits:
    """Return the limits of a standard, each of a known quantity, from a file or those shipped.

    Raises InputError: the limit of a quantity that decides is missing; the limit of an unknown
    one; limits of another standard.
    """
    file = file or standard
    limits = load_running_limits(file)
    needed = [name for name, criterion in CRITERIA.items() if criterion.group != INFORMATION]
    problems = {
        n: ("unknown quantity", nearest(n, CRITERIA)) for n in limits.limits if n not in CRITERIA
    }
    problems |= {n: ("missing", "needed for its verdict") for n in needed if n not in limits.limits}
    if problems:
        faults = (Fault(str(file), f"limits.{name}", *found) for name, found in problems.items())
        raise InputError(faults)
    if limits.standard != standard:
        raise input_error(file, repr(limits.standard), f"wanted: '{standard}'", "standard")
    return limits


def common_service(runs: Mapping[str, Result], overridden: Collection[str] = ()) -> Service | None:
    """Service table of a vehicle; its conditions may differ in what is `overridden`.

    Raises InputError: they differ in something else that limits depend on.
    """
    services = {name: result.vehicle().service for name, result in runs.items()}
    name, service = next(iter(services.items()))
    differing = {
        key: values
        for key in OF_LIMITS
        if key not in overridden
        and len(values := {getattr(s, key, None) for s in services.values()}) > 1
    }
    if differing:
        allowed = "the same in all conditions, or give one as an option"
        raise InputError(
            Fault(name, f"vehicle.service.{key}", listed([*map(str, values)]), allowed, name)
            for key, values in differing.items()
        )
    return service


def _service(runs: Mapping[str, Result]) -> Service:
    service, name = common_service(runs), next(iter(runs))
    if service is None:
        allowed = (
            "add [service] with admissible_speed and cant_deficiency to its file, or give "
            "`admissible_speed` and `cant_deficiency`"
        )
        found = "the vehicle has no service table"
        raise InputError([Fault(name, "vehicle.service", found, allowed, name)])
    return service


def _load_section_file(file: str | Path, runs: Mapping[str, Result]) -> tuple[str, OwnSections]:
    """Return a file of sections, each on the track of a run."""
    by_user, tracks = load_own_sections(file), {result.track().name for result in runs.values()}
    Faults(
        Fault(str(file), f"sections.{k}.track", f"'{s.track}'", nearest(s.track, tracks))
        for k, s in enumerate(by_user.sections)
        if s.track and s.track not in tracks
    ).check()
    return str(file), by_user


def _sections(
    record: Record, limits: RunningLimits, service: Service, by_user: tuple[str, OwnSections] | None
) -> list[TestSection]:
    """Return the sections of a run; raises InputError where it lacks a quantity, or one of these.

    `by_user`: Those of a file of the user's own, in place of those cut from the track.
    """
    record.need_quantities(limits.standard)
    if "Q0" not in record.result:
        raise record.fault("Q0", "is not in the result", "static wheel loads, as every run has")
    covered, track = record.covered_range(), record.result.track()
    if by_user is None:
        return track_sections(track, limits, service, covered, record.speed_at)
    file, sections = by_user[0], by_user[1].sections
    on_track = [(k, s) for k, s in enumerate(sections) if s.track in (None, track.name)]
    most = f"{math.ceil(covered[0])} to {math.floor(covered[1])} m"
    allowed = f"within {most}, where all of the vehicle was in the run {record.name}"
    Faults(
        Fault(file, f"sections.{k}", f"{s.begin:g} to {s.end:g} m", allowed)
        for k, s in on_track
        if s.begin < covered[0] or s.end > covered[1]
    ).check()
    return own_sections(track, limits, service, [s for _, s in on_track], record.speed_at)


def _transitions(run: _Run, method: str, *, causal: bool) -> list[SectionValues]:
    record = run.record
    parts = transitions(record.result.track(), record.covered_range(), record.speed_at)
    criteria = [c for c in CRITERIA.values() if method in c.methods and c.kind in DYNAMIC]
    criteria = [c for c in criteria if c.group in DYNAMIC]
    return section_values(record, parts, causal=causal, criteria=criteria)


def _section_rows(run: _Run, service: Service) -> Iterator[SectionRow]:
    """Yield the sections of a run with what the standard asks about them."""
    track = run.record.result.track()
    quality = None
    if run.sections and track.irregularities:
        ends = run.sections[0].begin, run.sections[-1].end
        quality = TrackQuality(track, *ends, (D1, D2, D3))
    conicity = run.record.conicity if run.counting else math.nan
    realisation = repr(track.irregularities)
    for s in run.sections:
        alignment, level = quality.deviations(s.begin, s.end) if quality else (0.0, 0.0)
        speed = min(s.speed, service.admissible_speed)
        name = quality_class(speed, alignment, level)
        further = quality.further(s.begin, s.end, speed) if quality else {}
        values = alignment, level, name, conicity, realisation, s in run.counting, further
        yield SectionRow(run.record.name, run.population, s, *values)


def _remarks(
    done: Sequence[_Run], zones: Sequence[ZoneReport], limits: RunningLimits
) -> tuple[str, ...]:
    remarks = [f"{LEFT_OUT}{run.record.name}: has no section" for run in done if not run.sections]
    remarks += [remark for run in done for remark in run.record.remarks()]
    remarks += [
        f"{run.record.name}: section {s.begin:.0f} to {s.end:.0f} m outside all zones: {s.reason}"
        for run in done
        for s in run.sections
        if not s.zone
    ]
    remarks += [remark for zone in zones for remark in zone.undecided]
    if not all(row.checked for zone in zones for row in zone.rows):
        remarks.append(f"limits of {limits.edition} not checked against the printed standard")
    return tuple(dict.fromkeys(remarks))
