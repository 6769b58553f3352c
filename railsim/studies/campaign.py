"""A scenario for vehicles: all its runs as one job, and the assessment at the end.

It is carried out as a study: with journal, index and summary, and a run whose file exists with the
same inputs is not computed again.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from railsim.assessment import Assessment, assess
from railsim.cant import curve_speed
from railsim.definitions.loading import load_running_limits, load_scenario, load_vehicle
from railsim.definitions.study.scenario import Scenario, Speed, TestCondition
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, Faults, InputError, RailsimError
from railsim.files.access import check_folder
from railsim.processes import available_cores
from railsim.result import Result, open_result
from railsim.studies.carry_out import carry_out_cases
from railsim.studies.case import Case, load_case, short_name
from railsim.studies.in_conditions import in_condition, repeated, scaled_radii
from railsim.studies.plan import ROUGH_DURATION, check_number
from railsim.studies.rows import in_a_name
from railsim.studies.spec import RunSpec, StudySpec


@dataclass(frozen=True)
class Campaign:
    """Results of a campaign in its folder.

    `assessments`: one for each vehicle; `results`: results by the names of their runs; `computed`:
    number of runs that were computed by this call; the others existed.
    """

    folder: Path
    assessments: tuple[Assessment, ...]
    results: dict[str, Result]
    computed: int


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
    cases = scenario_cases(plan, names, assignments)
    spec = StudySpec(
        folder=os.path.relpath(Path.cwd(), folder),
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


def scenario_cases(
    scenario: Scenario, vehicles: Sequence[str | Path], assignments: Sequence[str] = ()
) -> list[Case]:
    """Return all runs of a scenario: vehicles, then parts, then the grid.

    Raises InputError: all faults of all runs.
    """
    faults = Faults()
    cases: list[Case] = []
    axes = (vehicles, _conditions(scenario), scenario.parts, *scenario.grid.values())
    check_number(math.prod(map(len, axes)), available_cores(), lambda: ROUGH_DURATION)
    limits = load_running_limits(scenario.standard) if scenario.to_standard else None
    points = [dict(zip(scenario.grid, v, strict=True)) for v in product(*scenario.grid.values())]
    for vehicle in vehicles:
        vehicle_assignments = [
            a.removeprefix("vehicle.") for a in assignments if a.startswith("vehicle.")
        ]
        try:
            service = load_vehicle(vehicle, vehicle_assignments).service
        except InputError as error:
            faults += error.faults
            continue
        if service is None:
            allowed = "add [service] with admissible_speed and cant_deficiency"
            faults.append(Fault(str(vehicle), "service", "missing", allowed))
            continue
        several = list(product(_conditions(scenario), scenario.parts.items(), points))
        for (number, state, condition), (name, part), point in several:
            texts = [*scenario.assignments, *(f"{key}={v}" for key, v in point.items())]
            speed = part_speed(part.speed, service)
            label = [short_name(vehicle), state, name, *map(in_a_name, point.values())]
            try:
                if condition:
                    loads = load_vehicle(vehicle, vehicle_assignments).loads
                    if condition.load not in (None, "design", *loads):
                        continue
                    texts += condition.assignments
                    texts += [f"vehicle.load={condition.load}"] if condition.load else []
                run = RunSpec(
                    vehicle, part.track, speed, until=part.until,
                    assignments=(*texts, *assignments),
                )  # fmt: skip
                case = load_case(run)
                made = in_condition(case.vehicle, state, condition) if condition else case.vehicle
            except InputError as error:
                faults += error.faults
                continue
            if made is None:
                continue
            labels = {**case.labels, "part": name, **point}
            if state:
                labels["condition"] = state
            case = replace(
                case, name="_".join(filter(None, label)), vehicle=made, labels=labels,
                track=scaled_radii(case.track, part.speed, service),
            )  # fmt: skip
            cases += repeated(case, limits, service, number) if limits else [case]
    Faults(dict.fromkeys(faults)).check()
    return cases


def _conditions(scenario: Scenario) -> list[tuple[int, str, TestCondition | None]]:
    """Number, name and contents of each condition; one without name where there are none."""
    if not scenario.conditions:
        return [(0, "", None)]
    return [(k, name, one) for k, (name, one) in enumerate(scenario.conditions.items())]


def part_speed(speed: Speed, service: Service) -> float:
    """Speed of a vehicle in a part [m/s]; V^2 = g R (h + I)/2b0 from the cant deficiency."""
    if speed.fixed is not None:
        return speed.fixed
    if speed.admissible is not None:
        return speed.admissible * service.admissible_speed
    deficiency = (speed.cant_deficiency or 0.0) * service.cant_deficiency
    return curve_speed(speed.radius or 0.0, speed.cant + deficiency)
