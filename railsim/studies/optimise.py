"""`optimise`: optimisation of vehicle parameters with objectives and constraints.

Every design is a row of linked values of a study, so that its runs are carried out and recorded by
the study: an optimisation that is started again proposes the same designs and finds their runs in
the journal.  Begin reading in `optimise`; `search.py` proposes designs.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from railsim.definitions import Vehicle
from railsim.definitions.loading import load_study, load_vehicle
from railsim.definitions.study.definition import Study
from railsim.definitions.study.design import Optimise
from railsim.definitions.units_of_keys import unit_of_key
from railsim.design_checks import NEAR_BOUND
from railsim.errors import argument_error, input_error
from railsim.files import sources
from railsim.files.access import check_folder, is_file, make_folder, read_text, relative, write_text
from railsim.files.overrides import apply_overrides, split_overrides
from railsim.processes import available_cores
from railsim.studies.carry_out import FILES
from railsim.studies.designs import (
    INPUTS,
    Design,
    Evaluation,
    name_of,
    share_of,
    signs_of,
    statistic_over_runs,
    values_by_name,
    with_unit,
)
from railsim.studies.plan import ROUGH_DURATION, check_number, check_study, faults_of_file
from railsim.studies.search import METHODS, Task, knee, non_dominated
from railsim.studies.sensitivity import Sensitivity, sensitivities
from railsim.studies.spec import Execution, Progress, validated
from railsim.studies.summary import unit_of
from railsim.table import Column, Table
from railsim.text import plain

INPUT_BYTES = 1_000_000
MOST_ROWS = 15  # of the front, in words
BESIDE = ("optimise.json", "designs.csv", "front.png")


@dataclass(frozen=True)
class Optimisation:
    """Result of an optimisation.

    - `folder`: holds ``designs.csv``, ``optimise.json``, pictures, the chosen vehicles, and the
      study of all runs
    - `definition`: variables, objectives and constraints
    - `designs`: all computed designs
    - `front`: feasible non-dominated designs, in the order of the first objective
    - `chosen`: a design of the front; None if no design is feasible
    - `active`: limits and bounds that the chosen design reaches, one phrase each
    - `sensitivities`: sensitivities of all objectives and constraints
    - `vehicles`: files of the chosen design
    - `computed`: number of runs that were computed by this call
    - `units`: units of the variables by their paths, empty where the file format says none
    """

    folder: Path
    definition: Optimise
    designs: tuple[Design, ...]
    front: tuple[Design, ...]
    chosen: Design | None
    active: tuple[str, ...]
    sensitivities: tuple[Sensitivity, ...]
    vehicles: tuple[Path, ...]
    computed: int
    units: Mapping[str, str]

    def table(self) -> Table:
        """Return all designs with variables, objectives and constraints [SI]."""
        values = values_by_name(self.definition, self.designs)
        on_front = {design.number for design in self.front}
        units = self.units.items()
        variables = (
            Column(path, path.removeprefix("vehicle."), unit, ".5g") for path, unit in units
        )
        columns = [Column("design", format="d"), *variables]
        columns += [Column(name, format=".5g") for name in values]
        numbers = zip(*values.values(), strict=True)
        rows = []
        for design, of_design in zip(self.designs, numbers, strict=True):
            known = [design.number, *design.variables.values(), *of_design, int(design.feasible)]
            rows.append([*known, int(design.number in on_front), design.reason])
        return Table([*columns, "feasible", "front", "reason"], rows)

    def parts(self) -> list[str | Table]:
        """Return sentences and tables: the front, the chosen design, what depends on what."""
        if self.failure:
            return [self.failure]
        if self.chosen is None:
            known = [design for design in self.designs if math.isfinite(design.excess)]
            nearest = min(known, key=lambda design: design.excess)
            words = self._no_design("keeps all constraints")
            return [words, "", self._excerpt([nearest], nearest, "nearest")]
        shown = [*self.front[:: max(1, math.ceil(len(self.front) / MOST_ROWS))]]
        if self.chosen not in shown:
            shown.append(self.chosen)
        number = f"front of {len(self.front)} in {len(self.designs)} designs"
        parts: list[str | Table] = [number, "", self._excerpt(shown, self.chosen, "chosen"), ""]
        parts += [f"remark: {self.chosen.remark}"] * bool(self.chosen.remark)
        parts += [f"active (within {NEAR_BOUND:.0%}): {words}" for words in self.active]
        unknown = sum(map(math.isnan, (sum(design.values) for design in self.designs)))
        if unknown and self.sensitivities:
            parts.append(f"without the {unknown} designs that have no values:")
        parts += [one.sentence() for one in self.sensitivities]
        return [*parts, *map(str, self.vehicles), str(self.folder / "front.png")]

    @property
    def failure(self) -> str:
        """Return the sentence that no design has values, with a reason; empty if one has."""
        if any(not math.isnan(sum(design.values)) for design in self.designs):
            return ""
        return self._no_design("has values")

    def _no_design(self, predicate: str) -> str:
        reasons = sorted({design.reason for design in self.designs if design.reason})
        return ": ".join([f"none of {len(self.designs)} designs {predicate}", *reasons[:1]])

    def _excerpt(self, designs: Sequence[Design], marked: Design, mark: str) -> Table:
        """Some rows of the table, `mark` beside one of them."""
        table, ends = self.table(), 3  # feasible, front and reason are for spreadsheets
        rows = [["", *table.rows[design.number - 1][:-ends]] for design in designs]
        rows[designs.index(marked)][0] = mark
        return Table(["", *table.columns[:-ends]], rows)

    def record(self) -> dict[str, Any]:
        """Return everything as plain data [SI]."""
        definition = self.definition
        return {
            "objectives": [name_of(one) for one in definition.objectives],
            "goals": [one.goal for one in definition.objectives],
            "constraints": [name_of(one) for one in definition.constraints],
            "designs": len(self.designs),
            "front": [design.record() for design in self.front],
            "chosen": self.chosen and self.chosen.record(),
            "active": list(self.active),
            "sensitivities": [one.record() for one in self.sensitivities],
            "vehicles": [path.name for path in self.vehicles],
        }


def optimise(
    file: str | Path | Study,
    *,
    out: str | Path,
    method: str | None = None,
    evaluations: int | None = None,
    seed: int | None = None,
    choose: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: Progress | None = None,
    on_remark: Callable[[str], None] | None = None,
) -> Optimisation:
    """Find the best compromises for the parameters of a vehicle.

    Parameters
    ----------
    file : str, Path or Study
        Study file with a table ``optimise``, or name of a shipped one.
    out : str or Path
        Folder; existing designs in it are not computed again.
    method, evaluations, seed : optional
        Replace those of the file.
    choose : int, optional
        Number of the design that is written as a vehicle; by default the design of the front that
        is nearest to the best value of each objective, scaled by the ranges of the front.
    workers, scheduler : int, str
        As in `railsim.study`.
    resume : bool
        Continue although the file has changed.
    overwrite : bool
        Compute everything again.
    progress, on_remark : callable
        As in `railsim.study`.

    Raises
    ------
    InputError
        All faults of the inputs; a quantity that the runs do not have.
    """
    definition = file if isinstance(file, Study) else load_study(file)
    if definition.optimise is None:
        raise input_error(str(file), "missing", "needed: variables and objectives", key="optimise")
    changes = {"method": method, "evaluations": evaluations, "seed": seed}
    replaced = {name: value for name, value in changes.items() if value is not None}
    problem = validated(Optimise, definition.optimise.model_dump() | replaced, "optimise")
    if choose is not None and not 1 <= choose <= problem.evaluations:
        raise argument_error("choose", f"design {choose}", f"1 to {problem.evaluations}")
    runs = problem.evaluations * definition.runs
    check_number(runs, workers or available_cores(), lambda: ROUGH_DURATION)
    with nullcontext() if isinstance(file, Study) else faults_of_file(str(file)):
        check_study(definition)
    execution = Execution(
        workers=workers,
        scheduler=scheduler,
        overwrite=overwrite,
        progress=progress,
        on_remark=on_remark,
        further_files=BESIDE,
        trying=True,
    )
    folder = Path(out)
    check_folder(folder, (*FILES, *BESIDE, INPUTS), overwrite=True)
    _check_folder(folder, definition, resume=resume, overwrite=overwrite)
    evaluation = Evaluation(definition, problem, folder, execution)
    sizes = len(problem.variables), len(problem.objectives), len(problem.constraints)
    number = problem.evaluations
    task = Task(evaluation, *sizes, number, min(problem.batch, number), problem.seed)
    METHODS[problem.method](task)
    return _conclude(evaluation, choose)


def _check_folder(folder: Path, definition: Study, *, resume: bool, overwrite: bool) -> None:
    """Refuse a folder with another optimisation; record this one."""
    assert definition.optimise is not None
    free = ("method", "evaluations", "seed", "batch")  # these may change: known designs stay valid
    data = definition.model_dump(mode="json", exclude_none=True)
    data["optimise"] = {k: v for k, v in data["optimise"].items() if k not in free}
    text = tomli_w.dumps(data)
    path = folder / INPUTS
    if is_file(path) and read_text(path, INPUT_BYTES) != text and not (resume or overwrite):
        allowed = (
            "`resume` uses what is still valid, `overwrite` computes everything; or another `out`"
        )
        raise argument_error("out", "holds another optimisation", allowed, key=str(folder))
    make_folder(folder)
    write_text(path, text)


def _conclude(evaluation: Evaluation, choose: int | None) -> Optimisation:
    """Determine front, chosen design and sensitivities, and write the files."""
    problem, designs = evaluation.problem, evaluation.designs
    signs = signs_of(problem)
    feasible = [design for design in designs if design.feasible]
    front: list[Design] = []
    chosen = None
    if feasible:
        values = signs * np.array([design.objectives for design in feasible])
        rows = np.flatnonzero(non_dominated(values))
        order = rows[np.argsort(values[rows, 0], kind="stable")]
        front = [feasible[number] for number in order]
        chosen = front[knee(values[order])]
    if choose is not None:
        if not 1 <= choose <= len(designs):
            raise argument_error("choose", f"design {choose}", f"1 to {len(designs)}")
        chosen = designs[choose - 1]
    about = evaluation.folder, problem, designs, tuple(front), chosen
    definition = evaluation.definition
    overrides = split_overrides(definition.assignments)["vehicle"]
    vehicle = load_vehicle(definition.vehicles[0], overrides)
    units = {key: unit_of_key(vehicle, key.removeprefix("vehicle.")) for key in problem.variables}
    optimisation = Optimisation(
        *about,
        _active(problem, chosen, designs, units) if chosen else (),
        tuple(_sensitivities(evaluation, chosen)) if chosen else (),
        tuple(export_vehicles(evaluation, chosen)) if chosen else (),
        evaluation.computed,
        units,
    )
    _write(optimisation, definition.name)
    return optimisation


def _sensitivities(evaluation: Evaluation, chosen: Design) -> Sequence[Sensitivity]:
    problem = evaluation.problem
    variables = problem.variables.items()
    shares = np.array(
        [[share_of(v, d.variables[path]) for path, v in variables] for d in evaluation.designs]
    )  # designs as points of the unit cube
    values = values_by_name(problem, evaluation.designs, name_of)
    columns, middle = np.transpose(list(values.values())), shares[chosen.number - 1]
    return sensitivities(shares, columns, middle, list(problem.variables), list(values))


def _active(
    problem: Optimise, chosen: Design, designs: Sequence[Design], units: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the bounds and limits that a design reaches, limits of 0 by the range of `designs`."""
    reached = []
    for path, variable in problem.variables.items():
        share = share_of(variable, chosen.variables[path])
        ends = ("lower", share, variable.low), ("upper", 1.0 - share, variable.high)
        for side, distance, bound in ends:
            if distance <= NEAR_BOUND:
                reached.append(f"{path} at its {side} bound, {bound:.12g} {units[path]}".rstrip())
    number = len(problem.constraints)
    known = np.array([one.constraints for one in designs if not math.isnan(sum(one.constraints))])
    ranges = np.ptp(known, axis=0) if len(known) else np.zeros(number)
    for one, value, span in zip(problem.constraints, chosen.constraints, ranges, strict=True):
        for side, limit in (("lower", one.low), ("upper", one.high)):
            if limit is not None and abs(value - limit) <= NEAR_BOUND * (abs(limit) or span):
                unit = unit_of(one.quantity)
                reached.append(f"{name_of(one)} at its {side} limit, {limit:.12g} {unit}".rstrip())
    return tuple(reached)


def _write(result: Optimisation, name: str) -> None:
    from railsim.plot.study import front_figure, say_above, sensitivity_figure
    from railsim.plot.style import save

    text = json.dumps(plain(result.record()), indent=1, allow_nan=False)
    write_text(result.folder / "optimise.json", text + "\n")
    write_text(result.folder / "designs.csv", result.table().csv())
    objectives = result.definition.objectives
    labels = [with_unit(one) for one in objectives]
    if len({*labels}) < len(labels):
        labels = [f"{with_unit(one)}, {statistic_over_runs(one)}" for one in objectives]
    values = np.array([design.objectives for design in result.designs])
    feasible = np.array([design.feasible for design in result.designs])
    front = [design.number - 1 for design in result.front]
    chosen = None if result.chosen is None else result.chosen.number - 1
    figure = front_figure(values, labels, feasible, front, chosen)
    say_above(figure, f"{name}: {len(result.designs)} designs")
    save(figure, result.folder / "front.png", overwrite=True)
    if result.sensitivities and result.chosen is not None:
        names = list(values_by_name(result.definition, result.designs))
        figure = sensitivity_figure([one.record() for one in result.sensitivities], names)
        say_above(figure, f"{name}: about design {result.chosen.number}")
        save(figure, result.folder / "sensitivities.png", overwrite=True)


def export_vehicles(evaluation: Evaluation, chosen: Design) -> list[Path]:
    """Write a file for each vehicle that extends it with the chosen values."""
    row = evaluation.rows[chosen.number - 1]
    texts = list(evaluation.definition.assignments)
    for (path, variable), text in zip(evaluation.variables, row, strict=True):
        texts += [f"{key}={text}" for key in (path, *variable.also)]
    overrides = split_overrides(texts)["vehicle"]
    of_design = zip(evaluation.problem.values.values(), chosen.values, strict=True)
    values = [f"# {name_of(v)}: {x:.6g} {unit_of(v.quantity)}".rstrip() for v, x in of_design]
    found = []
    for vehicle in evaluation.definition.vehicles:
        file = evaluation.folder / f"{Path(vehicle).stem}_chosen.toml"
        lead = f"# Design {chosen.number} of {len(evaluation.designs)}, by `railsim optimise`."
        remarks = [f"# {chosen.remark}"] * bool(chosen.remark)
        text = "\n".join([lead, *remarks, *values, vehicle_text(vehicle, overrides, file.parent)])
        write_text(file, text)
        found.append(file)
    return found


def vehicle_text(vehicle: str | Path, overrides: Sequence[str], folder: Path) -> str:
    """Return the text of a vehicle file that extends another one with some values changed.

    `overrides`: ``key.path=value`` with the file's own keys; `folder`: of the new file, from which
    the path to the original counts.
    """
    base = sources.read_source(sources.find_file(vehicle, "vehicle"), "vehicle")
    defaults = Vehicle.model_construct().model_dump(mode="json")
    changed = apply_overrides(base, overrides, Vehicle.OPEN_TABLES, defaults).data
    head = {
        "format": base.data["format"],
        "name": f"{base.data.get('name', vehicle)}, optimised",
        "extends": relative(vehicle, folder) if is_file(vehicle) else str(vehicle),
    }
    return str(tomli_w.dumps({**head, **_difference(base.data, changed)}))


def _difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that turn one table into another by `extends`.

    >>> _difference({"a": {"b": 1, "c": [1, 2]}}, {"a": {"b": 1, "c": [1, 3]}, "d": {"e": 4}})
    {'a': {'c': [1, 3]}, 'd': {'e': 4}}
    """
    found: dict[str, Any] = {}
    for key, new in after.items():
        old = before.get(key)
        if new == old:
            continue
        if isinstance(new, dict) and isinstance(old, dict) and new.get("kind") == old.get("kind"):
            new = _difference(old, new)
        found[key] = new
    return found
