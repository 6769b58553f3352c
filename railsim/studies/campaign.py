"""A scenario for vehicles: all its runs as one job, and the assessment at the end.

A run whose file is there with the same inputs is not computed again.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from railsim.assessment import Assessment, assess
from railsim.definitions.loading import load_scenario, load_vehicle
from railsim.definitions.scenario import Scenario, Speed
from railsim.definitions.vehicle import Service
from railsim.errors import Fault, InputError, RailsimError
from railsim.files import check_folder, make_folder
from railsim.result import Result, open_result
from railsim.studies.case import Case, short_name
from railsim.studies.combine import load_case
from railsim.studies.execute import (
    Job,
    batches,
    cluster,
    in_processes,
    in_this_process,
    on_cluster,
)
from railsim.studies.journal import Record
from railsim.studies.study import cores

GRAVITY, CANT_BASE = 9.81, 1.5


@dataclass(frozen=True)
class Campaign:
    """What a campaign left in its folder.

    Attributes
    ----------
    folder : Path
    assessments : tuple of Assessment
        One for each vehicle.
    results : dict
        Results by the names of their runs.
    failed : tuple of dict
        Records of runs without a result.
    computed : int
        Number of runs that were computed now; the others were there.
    """

    folder: Path
    assessments: tuple[Assessment, ...]
    results: dict[str, Result]
    failed: tuple[Record, ...]
    computed: int


def campaign(
    scenario: str | Path,
    vehicles: Sequence[str | Path] | str | Path,
    *,
    out: str | Path,
    assignments: Sequence[str] = (),
    workers: int | None = None,
    scheduler: str | None = None,
    overwrite: bool = False,
    progress: Callable[[float], None] | None = None,
    on_record: Callable[[Record], None] | None = None,
) -> Campaign:
    """Run a scenario for vehicles and assess it.

    Parameters
    ----------
    scenario : str or Path
        File, or name of a shipped one.
    vehicles : sequence of str or Path, or a single one
        Files, or names of shipped ones; each needs a service table.
    out : str or Path
        Folder; made if need be.  Results with the same inputs are not computed again.
    assignments : sequence of str
        ``key.path=value`` for all runs, after those of the scenario.
    workers : int, optional
        Processes; by default one for each core.
    scheduler : str, optional
        Address of a dask scheduler whose workers do the runs instead.
    overwrite : bool
        Compute everything again.
    progress : callable, optional
        Called with the finished fraction now and then.
    on_record : callable, optional
        Called with the record of every run that is done.

    Raises
    ------
    InputError : everything that is wrong in the inputs; files in the folder of other inputs.
    RailsimError : a run failed; the others are kept.
    """
    names = [vehicles] if isinstance(vehicles, str | Path) else list(vehicles)
    folder = Path(out)
    check_folder(folder)
    plan = load_scenario(scenario)
    cases = scenario_cases(plan, names, assignments)
    there, faults = _there(cases, folder, overwrite=overwrite)
    if faults:
        raise InputError(faults)
    make_folder(folder)
    jobs = [Job(case, (folder / case.file_name).resolve()) for case in cases
            if case.name not in there]  # fmt: skip
    failed = []
    for record in _executed(jobs, workers, scheduler, progress or (lambda _: None)):
        if on_record is not None:
            on_record(record)
        if record["status"] == "failed":
            failed.append(record)
    if failed:
        words = "; ".join(f"{r['name']}: {r['status_reason']}" for r in failed)
        raise RailsimError(f"{len(failed)} of {len(cases)} runs failed: {words}")
    results = {case.name: open_result(folder / case.file_name) for case in cases}
    assessments = assess(results, plan.standard, method=plan.method)
    return Campaign(folder, tuple(assessments), results, tuple(failed), len(jobs))


def scenario_cases(
    scenario: Scenario, vehicles: Sequence[str | Path], assignments: Sequence[str] = ()
) -> list[Case]:
    """Return all runs of a scenario: vehicles, then parts, then the grid.

    Raises
    ------
    InputError : everything that is wrong in any of them.
    """
    faults: list[Fault] = []
    cases: list[Case] = []
    points = [dict(zip(scenario.grid, v, strict=True)) for v in product(*scenario.grid.values())]
    for vehicle in vehicles:
        own = [a.removeprefix("vehicle.") for a in assignments if a.startswith("vehicle.")]
        try:
            service = load_vehicle(vehicle, own).service
        except InputError as error:
            faults += error.faults
            continue
        if service is None:
            allowed = "add [service] with admissible_speed and cant_deficiency"
            faults.append(Fault(str(vehicle), "service", "missing", allowed))
            continue
        for (name, part), point in product(scenario.parts.items(), points):
            texts = [*scenario.assignments, *(f"{key}={v}" for key, v in point.items())]
            speed = part_speed(part.speed, service)
            label = "_".join([short_name(vehicle), name, *point.values()])
            try:
                case = load_case(
                    vehicle, part.track, speed, until=part.until,
                    assignments=[*texts, *assignments],
                )  # fmt: skip
            except InputError as error:
                faults += error.faults
                continue
            cases.append(replace(case, name=label, labels={**case.labels, "part": name, **point}))
    if faults:
        raise InputError(dict.fromkeys(faults))
    return cases


def part_speed(speed: Speed, service: Service) -> float:
    """Speed of a part for a vehicle [m/s]; V^2 = g R (h + I)/2b0 from the cant deficiency."""
    if speed.fixed is not None:
        return speed.fixed
    if speed.admissible is not None:
        return speed.admissible * service.admissible_speed
    deficiency = (speed.cant_deficiency or 0.0) * service.cant_deficiency
    return math.sqrt(GRAVITY * (speed.radius or 0.0) * (speed.cant + deficiency) / CANT_BASE)


def _there(
    cases: Sequence[Case], folder: Path, *, overwrite: bool
) -> tuple[set[str], list[Fault]]:
    """Names of the runs that are there already, and files that would have to be replaced."""
    found: set[str] = set()
    faults: list[Fault] = []
    for case in cases:
        path = folder / case.file_name
        if overwrite or not path.exists():
            continue
        try:
            same = open_result(path).attributes.get("inputs_hash") == case.key
        except InputError as error:
            faults += error.faults
            continue
        if same:
            found.add(case.name)
        else:
            allowed = "--overwrite computes everything; or another --out"
            faults.append(Fault("--out", str(path), "a result of other inputs", allowed))
    return found, faults


def _executed(
    jobs: Sequence[Job],
    workers: int | None,
    scheduler: str | None,
    progress: Callable[[float], None],
) -> Iterable[Record]:
    if scheduler is not None:
        client = cluster(scheduler)
        threads = max(1, sum(client.nthreads().values()))
        return on_cluster(batches(jobs, 1, threads), client, progress)
    # the longest runs first, so that no core is left with one of them at the end
    jobs = sorted(jobs, key=lambda job: -job.case.track.length / job.case.speed)
    count = min(workers or cores(), len(jobs))
    work = batches(jobs, 1, max(1, count))
    return in_processes(work, count, progress) if count > 1 else in_this_process(work, progress)
