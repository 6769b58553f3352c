"""A scenario for vehicles: all its runs as one job, and the assessment at the end.

It is carried out as a study: with journal, index and summary, and a run whose file exists with the
same inputs is not computed again.  A test campaign has conditions of the vehicle, and runs on
independent seeds of its track, scaled to the target quality.
"""

import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from railsim.assessment import Assessment, assess
from railsim.assessment.conditions import SHARE
from railsim.assessment.outputs import check_outputs
from railsim.assessment.record import START
from railsim.assessment.sections import TestSection, track_sections
from railsim.assessment.track_quality import TrackQuality
from railsim.cant import cant_deficiency, curve_speed
from railsim.definitions import Track, Vehicle
from railsim.definitions.excitations.random import Random
from railsim.definitions.limits import RunningLimits
from railsim.definitions.loading import load_running_limits, load_scenario
from railsim.definitions.study.scenario import Part, Scenario, Speed, TestCondition
from railsim.definitions.track.elements import CantElement, Circle
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, Faults, InputError, RailsimError, input_error
from railsim.files.access import check_folder, relative
from railsim.files.key_paths import descend, key_path
from railsim.processes import available_cores
from railsim.profiles import load_profile
from railsim.profiles.used import exchanged_wheels
from railsim.result import Result, open_result
from railsim.result.sensors import sensors
from railsim.studies.carry_out import carry_out_cases
from railsim.studies.case import Case, Loader, load_case, short_name
from railsim.studies.plan import ROUGH_DURATION, check_number, faults_of_file
from railsim.studies.rows import in_a_name
from railsim.studies.spec import RunSpec, StudySpec, validated
from railsim.track.curves import curves

_LOG = logging.getLogger(__name__)
MOST = 20  # seeds of a part
FASTEST = 1.1  # speed of a test over the admissible one: that of zone 1
STEP = 10  # between two of them: seeds of the zones' own tracks lie in between
LATERAL, VERTICAL = ("lateral", "gauge"), ("vertical", "cross_level")


@dataclass(frozen=True)
class Campaign:
    """Results of a campaign in its folder."""

    folder: Path
    assessments: tuple[Assessment, ...]  # one for each vehicle
    results: dict[str, Result]  # by the names of their runs
    computed: int  # number of runs that were computed by this call; the others existed


def campaign(
    scenario: str | Path,
    vehicles: Sequence[str | Path] | str | Path,
    *,
    out: str | Path,
    assignments: Sequence[str] = (),
    **how: Any,
) -> Campaign:
    """Run a scenario for vehicles and assess it.

    - `scenario`: file, or name of a shipped one
    - `vehicles`: files, or names of shipped ones; each needs a service table
    - `out`: folder, created if it does not exist.  Results with the same inputs are not computed
      again
    - `assignments`: ``key.path=value`` for all runs, after those of the scenario
    - `how`: fields of `railsim.studies.spec.Execution`

    Raises InputError: all faults of the inputs; files in the folder that belong to other inputs.
    RailsimError: a run failed; the others are kept.
    """
    names = [vehicles] if isinstance(vehicles, str | Path) else list(vehicles)
    folder = Path(out)
    check_folder(folder)
    plan = load_scenario(scenario)
    cases, faults = list[Case](), Faults()
    with faults_of_file(str(scenario), assignments=not assignments):
        with faults.caught():
            check_parts(plan, str(scenario), assignments)
        with faults.caught():
            cases = scenario_cases(plan, names, assignments)
        for case in cases:
            with faults.caught(_as_assigned):
                check_outputs(case.vehicle, case.settings, case.speed, plan.standard)
        Faults(dict.fromkeys(faults)).check()
    remark = how.get("on_remark") or _LOG.warning
    for words in omissions(plan, names, cases):
        remark(words)
    spec = StudySpec(
        folder=relative(Path.cwd(), folder),
        name=plan.name,
        purpose=plan.purpose,
        scenario=str(scenario),
        vehicles=[str(name) for name in names],
        tracks=[],
        speeds=[],
        single=plan.single,
        assignments=list(assignments),
    )
    outcome = carry_out_cases(cases, spec, folder, **how)
    if outcome.failed:
        words = "; ".join(f"{r['name']}: {r['status_reason']}" for r in outcome.failed)
        raise RailsimError(f"{len(outcome.failed)} of {len(cases)} runs failed: {words}")
    results = {case.name: open_result(folder / case.file_name) for case in cases}
    assessments = assess(results, plan.standard, method=plan.method)
    return Campaign(folder, tuple(assessments), results, outcome.computed)


def omissions(
    plan: Scenario, vehicles: Sequence[str | Path], cases: Sequence[Case]
) -> Iterator[str]:
    """Yield what a vehicle would need for each condition in which it is not tested.

    And the runs without a section that counts, as of a vehicle too slow for a cant deficiency.
    """
    loads = {case.labels["vehicle"]: case.vehicle.loads for case in cases}
    tested = {(case.labels["vehicle"], case.labels.get("condition")) for case in cases}
    for vehicle, (state, needed) in product(map(short_name, vehicles), plan.conditions.items()):
        if (vehicle, state) not in tested:
            has = f" (it has {', '.join(known)})" if (known := loads.get(vehicle)) else ""
            load = [f"a load case '{needed.load}'{has}"] if needed.load else []
            wheels = [f"wheels {' or '.join(needed.wheels)}"] if needed.wheels else []
            words = " and ".join((*load, *wheels))
            yield f"{vehicle}: not tested in the condition '{state}', which needs {words}"
    limits = load_running_limits(plan.standard) if plan.to_standard else None
    for case in cases:
        service = case.vehicle.service
        if limits and service and not counting_sections(case.track, case, limits, service):
            yield (
                f"{case.name}: at {3.6 * case.speed:.0f} km/h none of its sections is within the "
                "conditions of its zone: the assessment says why, and cannot judge this zone"
            )


def _as_assigned(fault: Fault) -> Fault:
    """A fault of settings, which a scenario has by assignments alone."""
    if fault.file != "settings":
        return fault
    return replace(fault, file="assignments", key=f"settings.{fault.key}", option="--set")


def scenario_cases(
    scenario: Scenario, vehicles: Sequence[str | Path], assignments: Sequence[str] = ()
) -> list[Case]:
    """Return all runs: vehicles, then parts, then the grid; raises InputError: all their faults."""
    faults = Faults()
    cases: list[Case] = []
    named: Iterable[tuple[str, TestCondition | None]] = scenario.conditions.items() or [("", None)]
    conditions = [(k, name, one) for k, (name, one) in enumerate(named)]
    axes = (vehicles, conditions, scenario.parts, *scenario.grid.values())
    check_number(math.prod(map(len, axes)), available_cores(), lambda: ROUGH_DURATION)
    limits = load_running_limits(scenario.standard) if scenario.to_standard else None
    points = [dict(zip(scenario.grid, v, strict=True)) for v in product(*scenario.grid.values())]
    for vehicle in vehicles:
        always = (*scenario.assignments, *assignments)
        try:
            loaded = _vehicle(RunSpec(vehicle, "", None, assignments=always))
        except InputError as error:
            faults += error.faults
            continue
        several = product(conditions, scenario.parts.items(), points)
        for (number, state, condition), (name, part), point in several:
            texts = [*scenario.assignments, *(f"{key}={v}" for key, v in point.items())]
            label = [short_name(vehicle), state, name, *map(in_a_name, point.values())]
            made = None
            with faults.caught():
                if condition:
                    if condition.load not in (None, "design", *loaded.loads):
                        continue
                    texts += condition.assignments
                    texts += [f"vehicle.load={condition.load}"] if condition.load else []
                texts += assignments
                run = RunSpec(vehicle, part.track, None, until=part.until, assignments=(*texts,))
                service = _service(run)
                case = load_case(replace(run, speed=part_speed(part.speed, service)))
                made = in_condition(case.vehicle, state, condition) if condition else case.vehicle
            if made is None:
                continue
            labels = {**case.labels, "part": name, **point}
            if state:
                labels["condition"] = state
            case = replace(
                case, name="_".join(filter(None, label)), vehicle=made, labels=labels,
                track=with_fitted_curves(case.track, part.speed, service, limits),
            )  # fmt: skip
            cases += repetitions(case, limits, service, number) if limits else [case]
    Faults(dict.fromkeys(faults)).check()
    return cases


def _vehicle(run: RunSpec) -> Vehicle:
    loader = Loader()
    vehicle = loader.definition("vehicle", run)
    loader.check()
    assert isinstance(vehicle, Vehicle)  # without a fault
    return vehicle


def _service(run: RunSpec) -> Service:
    service = _vehicle(run).service
    if service is None:
        allowed = "add [service] with admissible_speed and cant_deficiency"
        raise input_error(run.vehicle, "missing", allowed, "service")
    return service


def check_parts(scenario: Scenario, file: str, assignments: Sequence[str] = ()) -> None:
    """Check what a scenario says without a vehicle: tracks, their curves, settings, wheels.

    `file`: name of the scenario's file. Curves to the left and to the right are alike. Raises
    InputError: wrong tracks, settings, profiles; `radius` or `cant` beyond those of the curves.
    """
    loader = Loader()
    number = math.prod(map(len, (scenario.parts, *scenario.grid.values())))
    check_number(number, available_cores(), lambda: ROUGH_DURATION)
    for (name, part), values in product(scenario.parts.items(), product(*scenario.grid.values())):
        point = (f"{key}={v}" for key, v in zip(scenario.grid, values, strict=True))
        texts = (*scenario.assignments, *point, *assignments)
        run = RunSpec("", part.track, None, assignments=texts)
        loader.definition("settings", run)
        track = loader.definition("track", run)
        if track is not None and part.speed.radius is not None:
            loader.faults += _curve_faults(track, part, file, f"parts.{name}.speed")
    for name, condition in scenario.conditions.items():
        for old, new in condition.wheels.items():
            try:
                load_profile(new, "wheel")
            except InputError as error:
                key, (one, *_) = f"conditions.{name}.wheels.{old}", error.faults
                loader.faults.append(Fault(file, key, f"profile '{new}': {one.found}", one.allowed))
    loader.check()


def _curve_faults(track: Track, part: Part, file: str, key: str) -> Iterator[Fault]:
    """Yield in what the curve of a part's speed, at `key`, is beyond those of its track."""
    sizes = [(1.0 / abs(curve.curvature), 1e3 * abs(curve.cant)) for curve in curves(track)]
    speed, of_track = part.speed, f"'{short_name(part.track)}'"
    requested = (("radius", "m", speed.radius or 0.0), ("cant", "mm", 1e3 * abs(speed.cant)))
    if not sizes:
        yield Fault(file, f"{key}.radius", f"{speed.radius:g} m", f"{of_track} has no curve")
    for (name, unit, value), values in zip(requested, zip(*sizes, strict=True), strict=False):
        low, high = min(values), max(values)
        if not 0.999 * low - 1e-6 <= value <= 1.001 * high + 1e-6:
            ends = " to ".join(dict.fromkeys(f"{end:.6g}" for end in (low, high)))
            allowed = f"{ends} {unit} in the curves of {of_track}"
            yield Fault(file, f"{key}.{name}", f"{value:.12g} {unit}", allowed)


def part_speed(speed: Speed, service: Service) -> float:
    """Speed of a vehicle in a part [m/s]; V^2 = g R (h + I)/2b0 from the cant deficiency.

    No more than `FASTEST` times the admissible speed, however large the radius is.
    """
    if speed.fixed is not None:
        return speed.fixed
    if speed.admissible is not None:
        return speed.admissible * service.admissible_speed
    return min(_speed_in_curve(speed, service), FASTEST * service.admissible_speed)


def _speed_in_curve(speed: Speed, service: Service) -> float:
    deficiency = (speed.cant_deficiency or 0.0) * service.cant_deficiency
    return curve_speed(speed.radius or 0.0, speed.cant + deficiency)


def in_condition(vehicle: Vehicle, name: str, condition: TestCondition) -> Vehicle | None:
    """Return the vehicle in a condition; None where its file has nothing of the kind.

    Load and assignments have been made when it was loaded.

    Raises InputError: what is removed does not exist; a wrong vehicle without it.
    """
    if condition.wheels:
        wheels = exchanged_wheels(vehicle, condition.wheels)
        if not wheels:
            return None
        vehicle = vehicle.with_values(wheels)
    data = vehicle.model_dump(mode="json", exclude_none=True)
    for key in condition.remove:
        try:
            table, last = descend(data, key_path(key))
            del table[last]
        except KeyError:
            allowed = "a key of the vehicle's file"
            raise input_error(f"conditions.{name}", key, allowed, key="remove") from None
    data.setdefault("service", {}).update(condition=name.replace("_", " "), fault=condition.fault)
    return validated(Vehicle, data, f"conditions.{name}")


def with_fitted_curves(
    track: Track, speed: Speed, service: Service, limits: RunningLimits | None = None
) -> Track:
    """Track whose curves give the cant deficiency asked for at the speed of the part.

    Where the speed is asked for too, one factor multiplies the radii, by `limits` not below the
    zone of `radius`.  Where that, or the highest speed of a part, leaves the deficiency too small,
    another one lowers the cants, to none at most.  The permitted speed of the track goes with that
    of the part.
    """
    if speed.cant_deficiency is None or speed.radius is None:
        return track
    at_part, as_drawn = part_speed(speed, service), _speed_in_curve(speed, service)
    factor, plan = 1.0, list(track.plan)
    if speed.admissible is not None:
        radii = [abs(element.radius) for element in plan if isinstance(element, Circle)]
        ranges = [zone.radius for zone in limits.zones.values() if zone.radius] if limits else []
        ends = [low / min(radii) for low, high in ranges if low <= speed.radius <= high]
        factor = max((at_part / as_drawn) ** 2, min(1.0, 1.001 * max(ends, default=0.0)))
    for k, element in enumerate(plan):
        if isinstance(element, Circle):
            plan[k] = element.model_copy(update={"radius": factor * element.radius})
    permitted = track.speed and track.speed * at_part / as_drawn
    changed: dict[str, Any] = {"plan": (*plan,), "speed": permitted}
    deficiency = speed.cant_deficiency * service.cant_deficiency
    cant = max(0.0, cant_deficiency(at_part, 1.0 / (factor * speed.radius), deficiency))
    if cant < speed.cant - 1e-6:  # m
        changed["cant"] = tuple(_lowered(each, cant / speed.cant) for each in track.cant or ())
    return track.model_copy(update=changed)


def _lowered(element: CantElement, factor: float) -> CantElement:
    cants = {key: getattr(element, key) for key in element.KEYS}
    return element.model_copy(update={k: factor * v for k, v in cants.items() if v is not None})


def repetitions(case: Case, limits: RunningLimits, service: Service, condition: int) -> list[Case]:
    """Return a run with as many seeds as its zone needs sections, each to the target quality.

    `case`: run on track with one random irregularity; others are returned as they are; `condition`:
    number of the condition, which has its own seeds.
    """
    parts = case.track.irregularities
    if len(parts) != 1 or not isinstance(parts[0], Random):
        return [case]
    found: list[Case] = []
    counted = 0
    for number in range(MOST):
        seed = parts[0].seed + STEP * (MOST * condition + number)
        part = parts[0].model_copy(update={"seed": seed})
        track = case.track.model_copy(update={"irregularities": (part,)})
        sections = counting_sections(track, case, limits, service)
        label = f"{case.name}_seed{seed}"
        scaled = to_target(track, part, sections, limits, service)
        found.append(replace(case, name=label, track=scaled, labels={**case.labels, "seed": seed}))
        counted += len(sections)
        if not sections or counted >= limits.zones[sections[0].zone].sections:
            break
    return found


def counting_sections(
    track: Track, case: Case, limits: RunningLimits, service: Service
) -> list[TestSection]:
    """Sections that count, of the zone with most of them, at constant speed."""
    vehicle = case.vehicle
    flat = flatten(vehicle)
    x = flat.along(flat.of_kind("wheelset")) + [one.along for one in sensors(vehicle).values()]
    ahead, behind = max(0.0, *x), min(0.0, *x)
    begin = case.start + max(START * case.speed, ahead - behind) + ahead
    end = (case.until or track.length) + behind - 1.0
    sections = track_sections(track, limits, service, (begin, end), lambda _: case.speed)
    counting = [section for section in sections if section.zone and not section.reason]
    return max([[s for s in counting if s.zone == zone] for zone in limits.zones], key=len)


def to_target(
    track: Track,
    part: Random,
    sections: Sequence[TestSection],
    limits: RunningLimits,
    service: Service,
) -> Track:
    """Track whose 90 % values of alignment and level are in the middle of the target."""
    target = limits.track_quality
    if not sections or target is None:
        return track
    quality = TrackQuality(track, sections[0].begin, sections[-1].end)
    values = np.percentile([quality.deviations(s.begin, s.end) for s in sections], SHARE, axis=0)
    goal = np.array(target.middle(min(sections[0].speed, service.admissible_speed)))
    parts = tuple(
        part.model_copy(update={"channels": channels, "scale": round(float(scale), 4)})
        for channels, scale in zip((LATERAL, VERTICAL), part.scale * goal / values, strict=True)
    )
    return track.model_copy(update={"irregularities": parts})
