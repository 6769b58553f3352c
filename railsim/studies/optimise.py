"""`optimise`: parameters of vehicles against objectives and constraints.

Every design is a row of linked values of a study, so that its runs go through the study's executor
and stand in its journal: an optimisation that is started again proposes the same designs, and finds
them done.  Begin reading in `optimise`; `search.py` proposes designs.
"""

import csv
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from railsim.definitions import sources
from railsim.definitions.design import Constraint, Objective, Optimise, Value, Variable
from railsim.definitions.loading import load_study
from railsim.definitions.overrides import apply_overrides, split_overrides
from railsim.definitions.study import Study, value_texts
from railsim.errors import Fault, InputError, nearest
from railsim.files import check_folder, is_file, make_folder, read_text, whole_file
from railsim.studies.front import hypervolume, knee, non_dominated
from railsim.studies.journal import Record
from railsim.studies.search import Floats, Task, Values, search
from railsim.studies.sensitivity import Sensitivity, sensitivities
from railsim.studies.study import Outcome, study
from railsim.studies.summary import summary_row, unit_of

DIGITS = 6  # of the values of variables
NEAR_BOUND = 0.01  # share of a range or a limit within which it counts as reached
INPUTS = "optimise.toml"
INPUT_BYTES = 1_000_000

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Design:
    """Values of the variables, and what came of them.

    Attributes
    ----------
    number : int
        In the order of computation, from 1.
    variables : dict of str to float
        By their paths [SI].
    objectives : tuple of float
        In the order of the definition [SI]; NaN where a run has no such value.
    constraints : tuple of float
        Worst value of each constraint's quantity [SI].
    feasible : bool
        Whether all values are there and all constraints kept.
    reason : str
        Why there are no values.
    """

    number: int
    variables: dict[str, float]
    objectives: tuple[float, ...]
    constraints: tuple[float, ...]
    feasible: bool
    reason: str = ""


@dataclass(frozen=True)
class Optimisation:
    """What an optimisation found.

    Attributes
    ----------
    folder : Path
        Holds ``designs.csv``, ``optimise.json``, pictures, the chosen vehicles, and the study of
        all runs.
    definition : Optimise
        What was sought.
    designs : tuple of Design
        All that were computed.
    front : tuple of Design
        Feasible designs that no other betters, by the first objective.
    chosen : Design or None
        One of the front; None where no design is feasible.
    active : tuple of str
        Limits and bounds that the chosen design reaches, a phrase each.
    sensitivities : tuple of Sensitivity
        Of all objectives and constraints.
    vehicles : tuple of Path
        Files of the chosen design.
    computed : int
        Runs that were computed now.
    """

    folder: Path
    definition: Optimise
    designs: tuple[Design, ...]
    front: tuple[Design, ...]
    chosen: Design | None
    active: tuple[str, ...]
    sensitivities: tuple[Sensitivity, ...]
    vehicles: tuple[Path, ...] = ()
    computed: int = 0

    def hypervolume(self, reference: Sequence[float]) -> float:
        """Return the volume between the front and a reference point, in SI of all objectives."""
        signs = _signs(self.definition)
        front = np.array([design.objectives for design in self.front]).reshape(-1, len(signs))
        return hypervolume(signs * front, signs * np.array(reference))

    def record(self) -> dict[str, Any]:
        """Return everything as plain data [SI]."""
        definition = self.definition
        return {
            "objectives": [_name(one) for one in definition.objectives],
            "goals": [one.goal for one in definition.objectives],
            "constraints": [_name(one) for one in definition.constraints],
            "designs": len(self.designs),
            "front": [_design_record(design) for design in self.front],
            "chosen": None if self.chosen is None else _design_record(self.chosen),
            "active": list(self.active),
            "sensitivities": [one.record() for one in self.sensitivities],
            "vehicles": [path.name for path in self.vehicles],
        }


def _design_record(design: Design) -> dict[str, Any]:
    return {
        "number": design.number,
        "variables": design.variables,
        "objectives": list(design.objectives),
        "constraints": list(design.constraints),
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
    """Seek the best compromises of a vehicle's parameters.

    Parameters
    ----------
    file : str, Path or Study
        Study file with a table ``optimise``, or name of a shipped one.
    out : str or Path
        Folder; what is done there is not computed again.
    method, evaluations, seed : optional
        In place of the file's.
    choose : int, optional
        Number of the design that is written as a vehicle; by default that of the front which is
        nearest to the best of each objective, measured by the front's ranges.
    workers, scheduler
        As in `railsim.study`.
    resume : bool
        Continue although the file has changed.
    overwrite : bool
        Compute everything again.
    progress, on_remark
        As in `railsim.study`.

    Returns
    -------
    Optimisation

    Raises
    ------
    InputError
        Everything that is wrong in the inputs; a quantity that the runs do not have.
    """
    definition = file if isinstance(file, Study) else load_study(file)
    if definition.optimise is None:
        fault = Fault(str(file), "optimise", "missing", "needed: variables and objectives")
        raise InputError([fault])
    changes = {"method": method, "evaluations": evaluations, "seed": seed}
    given = {name: value for name, value in changes.items() if value is not None}
    wanted = _changed(definition.optimise, given)
    folder = Path(out)
    check_folder(folder)
    _check_folder(folder, definition, resume=resume, overwrite=overwrite)
    evaluation = _Evaluation(
        definition,
        wanted,
        folder,
        {"workers": workers, "scheduler": scheduler, "on_remark": on_remark},
        overwrite=overwrite,
        progress=progress or (lambda _: None),
    )
    search(
        wanted.method,
        Task(
            evaluation,
            len(wanted.variables),
            len(wanted.objectives),
            len(wanted.constraints),
            wanted.evaluations,
            wanted.batch,
            wanted.seed,
        ),
    )
    return _concluded(evaluation, choose)


def _changed(wanted: Optimise, changes: Mapping[str, Any]) -> Optimise:
    from railsim.studies.summary import checked

    return checked(Optimise, {**wanted.model_dump(), **changes}, "optimise")


def _check_folder(folder: Path, definition: Study, *, resume: bool, overwrite: bool) -> None:
    """Refuse a folder with another optimisation; note this one."""
    assert definition.optimise is not None
    free = ("method", "evaluations", "seed", "batch")  # these may change: known designs stay known
    data = definition.model_dump(mode="json", exclude_none=True)
    data["optimise"] = {k: v for k, v in data["optimise"].items() if k not in free}
    text = tomli_w.dumps(data)
    path = folder / INPUTS
    if is_file(path) and read_text(path, INPUT_BYTES) != text and not (resume or overwrite):
        allowed = (
            "--resume uses what still holds, --overwrite computes everything; or another --out"
        )
        raise InputError([Fault("--out", str(folder), "holds another optimisation", allowed)])
    make_folder(folder)
    with whole_file(path) as partial:
        partial.write_text(text, encoding="utf-8")


class _Evaluation:
    """Designs through a study; what a search calls.

    Attributes
    ----------
    rows : list of tuple of str
        Values of the variables of all designs, as written.
    asked : list of int
        For each point that the search has asked for, the number of its row.
    """

    def __init__(
        self,
        definition: Study,
        wanted: Optimise,
        folder: Path,
        how: Mapping[str, Any],
        *,
        overwrite: bool,
        progress: Progress,
    ) -> None:
        self.definition, self.wanted, self.folder = definition, wanted, folder
        self.rows: list[tuple[str, ...]] = []
        self.asked: list[int] = []
        self.computed = 0
        self.designs: tuple[Design, ...] = ()
        self._margins = np.zeros((0, len(wanted.constraints)))
        self._how, self._overwrite, self._progress = how, overwrite, progress
        self._inputs = _study_inputs(definition)

    @cached_property
    def variables(self) -> list[tuple[str, Variable]]:
        """Paths and bounds."""
        return list(self.wanted.variables.items())

    def __call__(self, points: Floats) -> Values:
        """Compute designs, and return the values of all that were asked for."""
        known = {row: number for number, row in enumerate(self.rows)}
        for point in points:
            row = tuple(
                _written(variable, float(share))
                for share, (_, variable) in zip(point, self.variables, strict=True)
            )
            if row not in known:
                known[row] = len(self.rows)
                self.rows.append(row)
            self.asked.append(known[row])
        before, number = self._done, self.wanted.evaluations
        self._study(lambda share: self._progress(min(1.0, (before + share * len(points)) / number)))
        objectives = _signs(self.wanted) * np.array([design.objectives for design in self.designs])
        return Values(objectives[self.asked], self._margins[self.asked])

    @property
    def _done(self) -> int:
        return len(self.designs)

    def _study(self, progress: Progress) -> None:
        linked: dict[str, list[str]] = {}
        for place, (path, variable) in enumerate(self.variables):
            for key in (path, *variable.also):
                linked[key] = [row[place] for row in self.rows]
        outcome = study(
            out=self.folder,
            linked=[*self._inputs["linked"], linked],
            keep="summary",
            resume=not self._overwrite,
            overwrite=self._overwrite,
            progress=progress,
            **{name: value for name, value in self._inputs.items() if name != "linked"},
            **self._how,
        )
        self._overwrite = False
        self.computed += outcome.computed
        self._take(outcome)

    def _take(self, outcome: Outcome) -> None:
        """Gather the runs of each design."""
        runs: dict[tuple[str, ...], list[Record]] = {row: [] for row in self.rows}
        for record in outcome.records:
            runs[tuple(str(record["labels"][path]) for path, _ in self.variables)].append(record)
        _check_quantities(self.wanted, outcome)
        designs, margins = [], []
        for number, row in enumerate(self.rows, start=1):
            rows = [(record["labels"], summary_row(record)) for record in runs[row]]
            bad = [record for record in runs[row] if record["status"] != "complete"]
            objectives = tuple(_objective(one, rows) for one in self.wanted.objectives)
            worst = [_constraint(one, rows) for one in self.wanted.constraints]
            excess = tuple(margin for _, margin in worst)
            if bad:
                objectives = tuple(math.nan for _ in objectives)
                excess = tuple(math.nan for _ in excess)
            fine = not any(map(math.isnan, objectives)) and all(one <= 0.0 for one in excess)
            values = {
                path: float(text) for (path, _), text in zip(self.variables, row, strict=True)
            }
            reason = str(bad[0]["status_reason"]) if bad else ""
            limits = tuple(value for value, _ in worst)
            designs.append(Design(number, values, objectives, limits, fine, reason))
            margins.append(excess)
        self.designs = tuple(designs)
        self._margins = np.array(margins, dtype=float).reshape(len(designs), -1)

    def shares(self) -> Floats:
        """Return all designs as points of the unit cube."""
        return np.array(
            [
                [_share(v, design.variables[path]) for path, v in self.variables]
                for design in self.designs
            ]
        )


def _study_inputs(definition: Study) -> dict[str, Any]:
    """Return the arguments of `study` that a study file stands for."""
    return {
        "vehicles": list(definition.vehicles),
        "tracks": list(definition.tracks),
        "speeds": None if definition.speeds is None else value_texts(definition.speeds),
        "grid": {key: value_texts(values) for key, values in definition.grid.items()},
        "linked": [{k: value_texts(v) for k, v in table.items()} for table in definition.linked],
        "sample": definition.sample,
        "analyses": definition.analyses,
        "settings": definition.settings,
        "start": definition.start,
        "duration": definition.duration,
        "until": definition.until,
        "assignments": list(definition.assignments),
    }


def _written(variable: Variable, share: float) -> str:
    """Return the value at a share of a variable's range as text.

    Examples
    --------
    >>> _written(Variable(low=1e3, high=1e5, scale="log"), 0.5)
    '10000'
    """
    if variable.scale == "log":
        value = variable.low * (variable.high / variable.low) ** share
    else:
        value = variable.low + (variable.high - variable.low) * share
    return f"{value:.{DIGITS}g}"


def _share(variable: Variable, value: float) -> float:
    if variable.scale == "log":
        return math.log(value / variable.low) / math.log(variable.high / variable.low)
    return (value - variable.low) / (variable.high - variable.low)


def _signs(wanted: Optimise) -> NDArray[np.float64]:
    return np.array([1.0 if one.goal == "minimise" else -1.0 for one in wanted.objectives])


def _name(one: Value) -> str:
    """Return what a value is called: its quantity, with the runs that count."""
    where = ", ".join(f"{key}={value}" for key, value in one.where.items())
    name = f"|{one.quantity}|" if one.magnitude else one.quantity
    return f"{name} at {where}" if where else name


Rows = Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]


def _values(one: Value, rows: Rows) -> list[float]:
    """Return a quantity in the runs that count, NaN where a run lacks it."""
    found = []
    for labels, cells in rows:
        if not all(_alike(labels.get(key), value) for key, value in one.where.items()):
            continue
        cell = cells.get(one.quantity)
        value = float(cell) if isinstance(cell, int | float) else math.nan
        found.append(abs(value) if one.magnitude else value)
    return found


def _alike(label: object, wanted: object) -> bool:
    """Whether a label, a text in a grid, is a value."""
    try:
        return label == wanted or float(str(label)) == float(str(wanted))
    except ValueError:
        return False


def _objective(one: Objective, rows: Rows) -> float:
    values = _values(one, rows)
    if not values or any(map(math.isnan, values)):
        return math.nan
    if one.over == "mean":
        return math.fsum(values) / len(values)
    return max(values) if one.goal == "minimise" else min(values)


def _constraint(one: Constraint, rows: Rows) -> tuple[float, float]:
    """Return the worst value, and by how much of the limit it is beyond it, negative within."""
    found = (math.nan, math.nan)
    for value in _values(one, rows):
        if math.isnan(value):
            return math.nan, math.nan
        for limit, sign in ((one.high, 1.0), (one.low, -1.0)):
            if limit is None:
                continue
            beyond = sign * (value - limit) / (abs(limit) or 1.0)
            if not beyond <= found[1]:
                found = value, beyond
    return found


def _check_quantities(wanted: Optimise, outcome: Outcome) -> None:
    """Refuse a quantity that no complete run has, or labels that no run has."""
    rows = [
        (record["labels"], summary_row(record))
        for record in outcome.records
        if record["status"] == "complete"
    ]
    if not rows:
        return
    known = {name for _, cells in rows for name, v in cells.items() if isinstance(v, int | float)}
    faults = []
    for table, ones in (("objectives", wanted.objectives), ("constraints", wanted.constraints)):
        for number, one in enumerate(ones):
            key = f"optimise.{table}.{number}"
            if one.quantity not in known:
                found = f"no run has '{one.quantity}'"
                faults.append(Fault(INPUTS, f"{key}.quantity", found, nearest(one.quantity, known)))
            elif not _values(one, rows):
                faults.append(Fault(INPUTS, f"{key}.where", "no run is like this", ""))
    if faults:
        raise InputError(faults)


def _concluded(evaluation: _Evaluation, choose: int | None) -> Optimisation:
    """Find front, choice and sensitivities, and write the files."""
    wanted, designs = evaluation.wanted, evaluation.designs
    signs = _signs(wanted)
    feasible = [design for design in designs if design.feasible]
    front: list[Design] = []
    chosen = None
    if feasible:
        values = signs * np.array([design.objectives for design in feasible])
        kept = np.flatnonzero(non_dominated(values))
        order = kept[np.argsort(values[kept, 0], kind="stable")]
        front = [feasible[number] for number in order]
        chosen = front[knee(values[order])]
    if choose is not None:
        if not 1 <= choose <= len(designs):
            fault = Fault("--choose", "", f"design {choose}", f"1 to {len(designs)}")
            raise InputError([fault])
        chosen = designs[choose - 1]
    names = [_name(one) for one in (*wanted.objectives, *wanted.constraints)]
    found = Optimisation(
        evaluation.folder,
        wanted,
        designs,
        tuple(front),
        chosen,
        _active(wanted, chosen) if chosen else (),
        tuple(_sensitivities(evaluation, chosen, names)) if chosen else (),
        tuple(_chosen_vehicles(evaluation, chosen)) if chosen else (),
        evaluation.computed,
    )
    _write(found)
    return found


def _sensitivities(
    evaluation: _Evaluation, chosen: Design, names: list[str]
) -> Sequence[Sensitivity]:
    shares = evaluation.shares()
    values = np.array([(*design.objectives, *design.constraints) for design in evaluation.designs])
    paths = [path for path, _ in evaluation.variables]
    unique = list(dict.fromkeys(names))
    columns = [names.index(name) for name in unique]
    return sensitivities(shares, values[:, columns], shares[chosen.number - 1], paths, unique)


def _active(wanted: Optimise, chosen: Design) -> tuple[str, ...]:
    """Return the bounds and limits that a design reaches."""
    found = []
    for path, variable in wanted.variables.items():
        share = _share(variable, chosen.variables[path])
        for words, distance, bound in (
            ("lower", share, variable.low),
            ("upper", 1.0 - share, variable.high),
        ):
            if distance < NEAR_BOUND:
                found.append(f"{path} at its {words} bound, {bound:g}")
    for one, value in zip(wanted.constraints, chosen.constraints, strict=True):
        for words, limit in (("lower", one.low), ("upper", one.high)):
            if limit is not None and abs(value - limit) <= NEAR_BOUND * (abs(limit) or 1.0):
                unit = unit_of(one.quantity)
                found.append(f"{_name(one)} at its {words} limit, {limit:g} {unit}".rstrip())
    return tuple(found)


def _chosen_vehicles(evaluation: _Evaluation, chosen: Design) -> list[Path]:
    """Write a file for each vehicle that extends it with the chosen values."""
    row = evaluation.rows[chosen.number - 1]
    texts = list(evaluation.definition.assignments)
    for (path, variable), text in zip(evaluation.variables, row, strict=True):
        texts += [f"{key}={text}" for key in (path, *variable.also)]
    overrides = split_overrides(texts)["vehicle"]
    wanted = evaluation.wanted
    values = [
        f"# {_name(one)}: {value:.6g} {unit_of(one.quantity)}".rstrip()
        for one, value in zip(
            (*wanted.objectives, *wanted.constraints),
            (*chosen.objectives, *chosen.constraints),
            strict=True,
        )
    ]
    found = []
    for vehicle in evaluation.definition.vehicles:
        file = evaluation.folder / f"{Path(vehicle).stem}_chosen.toml"
        lead = f"# Design {chosen.number} of {len(evaluation.designs)}, by `railsim optimise`."
        text = "\n".join([lead, *values, vehicle_text(vehicle, overrides, file.parent)])
        with whole_file(file) as partial:
            partial.write_text(text, encoding="utf-8")
        found.append(file)
    return found


def vehicle_text(vehicle: str | Path, overrides: Sequence[str], folder: Path) -> str:
    """Return the text of a vehicle file that extends another one with some values changed.

    Parameters
    ----------
    vehicle : str or Path
        File, or name of a shipped one.
    overrides : sequence of str
        ``key.path=value`` with the file's own keys.
    folder : Path
        Where the new file is to lie: the other one's path counts from there.
    """
    from railsim.definitions.loading import FORMATS
    from railsim.definitions.vehicle import Vehicle

    base = sources.read_source(sources.find_file(vehicle, "vehicle"), "vehicle")
    defaults = Vehicle.model_construct().model_dump(mode="json")
    free = FORMATS[base.data["format"]].free
    changed = apply_overrides(base, overrides, free, defaults).data
    named = os.path.relpath(vehicle, folder) if is_file(vehicle) else str(vehicle)
    head = {
        "format": base.data["format"],
        "name": f"{base.data.get('name', vehicle)}, optimised",
        "extends": named,
    }
    text: str = tomli_w.dumps({**head, **_difference(base.data, changed)})
    return text


def _difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a table has to say to become another one by `extends`.

    Examples
    --------
    >>> _difference({"a": {"b": 1, "c": [1, 2]}}, {"a": {"b": 1, "c": [1, 3]}, "d": {"e": 4}})
    {'a': {'c': [1, 3]}, 'd': {'e': 4}}
    """
    found: dict[str, Any] = {}
    for key, value in after.items():
        old = before.get(key)
        if value == old:
            continue
        if isinstance(value, dict) and isinstance(old, dict) and _same_kind(value, old):
            found[key] = _difference(old, value)
        else:
            found[key] = value
    return found


def _same_kind(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return bool(one.get("kind") == other.get("kind"))


def _write(found: Optimisation) -> None:
    from railsim.plot.design import front_figure, sensitivity_figure
    from railsim.plot.style import save

    with whole_file(found.folder / "optimise.json") as partial:
        text = json.dumps(_finite(found.record()), indent=1, allow_nan=False)
        partial.write_text(text + "\n", encoding="utf-8")
    _write_designs(found)
    labels = [with_unit(one) for one in found.definition.objectives]
    values = np.array([design.objectives for design in found.designs])
    feasible = np.array([design.feasible for design in found.designs])
    front = [design.number - 1 for design in found.front]
    chosen = None if found.chosen is None else found.chosen.number - 1
    figure = front_figure(values, labels, feasible, front, chosen)
    save(figure, found.folder / "front.png", overwrite=True)
    if found.sensitivities and found.chosen is not None:
        ones = (*found.definition.objectives, *found.definition.constraints)
        units = {_name(one): with_unit(one) for one in ones}
        names = [units[one.quantity] for one in found.sensitivities]
        figure = sensitivity_figure([one.record() for one in found.sensitivities], names)
        save(figure, found.folder / "sensitivities.png", overwrite=True)


def with_unit(one: Value) -> str:
    """Return what a value is called, with its unit."""
    unit = unit_of(one.quantity)
    return f"{_name(one)} ({unit})" if unit else _name(one)


def _write_designs(found: Optimisation) -> None:
    definition = found.definition
    names = ["design", *definition.variables]
    names += [with_unit(one) for one in (*definition.objectives, *definition.constraints)]
    on_front = {design.number for design in found.front}
    with (
        whole_file(found.folder / "designs.csv") as partial,
        open(partial, "w", encoding="utf-8", newline="") as stream,
    ):
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*names, "feasible", "front", "reason"])
        for design in found.designs:
            numbers = (*design.variables.values(), *design.objectives, *design.constraints)
            cells = ["" if math.isnan(number) else number for number in numbers]
            on = design.number in on_front
            writer.writerow([design.number, *cells, int(design.feasible), int(on), design.reason])


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data
