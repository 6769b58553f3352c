"""Designs of an optimisation: values of the variables, evaluated by a study."""

import logging
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.study.definition import Study
from railsim.definitions.study.design import Constraint, Objective, Optimise, Value, Variable
from railsim.errors import Fault, Faults, nearest
from railsim.studies.plan import selects
from railsim.studies.records import Record
from railsim.studies.search import Values
from railsim.studies.spec import Execution, Progress, StudySpec
from railsim.studies.study import run_study
from railsim.studies.summary import summary_row, unit_of

_LOG = logging.getLogger(__name__)
_MAGNITUDE = re.compile(r"\w+_(?:peak|mid\d*|median\d*)(?:_20hz)?")
DIGITS = 6  # of the values of variables, more where the range is narrow
INPUTS = "optimise.toml"


@dataclass(frozen=True)
class Design:
    """Values of the variables, objectives and constraints."""

    number: int  # in the order of computation, from 1
    variables: dict[str, float]  # by their paths [SI]
    # in the order of the definition [SI]; NaN if a run has no such value
    objectives: tuple[float, ...]
    constraints: tuple[float, ...]  # worst value of the quantity of each [SI]
    feasible: bool  # all values exist and all constraints are met
    reason: str = ""  # why there are no values
    excess: float = math.nan  # the largest over a limit, as a search counts it; NaN without values

    @property
    def values(self) -> tuple[float, ...]:
        """Of objectives, then constraints."""
        return (*self.objectives, *self.constraints)

    def record(self) -> dict[str, Any]:
        """Return the design as plain data [SI]."""
        names = ("number", "feasible", "variables", "objectives", "constraints")
        return {name: getattr(self, name) for name in names}

    @property
    def remark(self) -> str:
        """Why it is not feasible; empty if it is."""
        if self.feasible:
            return ""
        why = f"has no values: {self.reason}" if self.reason else "does not keep all constraints"
        return f"design {self.number} {why}"


class Evaluation:
    """Evaluation of designs by a study, as called by a search.

    `rows`: values of the variables of all designs, as written; `requested`: for each point that the
    search has requested, the number of its row.
    """

    def __init__(
        self, definition: Study, problem: Optimise, folder: Path, execution: Execution
    ) -> None:
        self.definition, self.problem, self.folder = definition, problem, folder
        self.variables = list(problem.variables.items())  # paths and bounds
        self.rows: list[tuple[str, ...]] = []
        self.requested: list[int] = []
        self.computed = 0
        self.designs: tuple[Design, ...] = ()
        self._margins = np.zeros((0, len(problem.constraints)))
        self._scales = np.ones(len(problem.constraints))
        self._spec = StudySpec.of_file(definition, keep="summary")
        self._progress = execution.progress or (lambda _: None)
        self._execution = replace(execution, resume=not execution.overwrite)

    def __call__(self, points: Floats) -> Values:
        """Compute designs, and return the values of all designs requested so far."""
        row_numbers = {row: number for number, row in enumerate(self.rows)}
        for point in points:
            shares = zip(point.tolist(), self.variables, strict=True)
            row = tuple(_written_value(variable, share) for share, (_, variable) in shares)
            if row not in row_numbers:
                row_numbers[row] = len(self.rows)
                self.rows.append(row)
            self.requested.append(row_numbers[row])
        before, number = len(self.designs), self.problem.evaluations
        self._study(lambda share: self._progress(min(1.0, (before + share * len(points)) / number)))
        values = signs_of(self.problem) * np.array([design.objectives for design in self.designs])
        return Values(values[self.requested], self._margins[self.requested])

    def _study(self, progress: Progress) -> None:
        """Carry out the study of all designs, and gather the runs of each."""
        linked: dict[str, list[str]] = {}
        for column, (path, variable) in enumerate(self.variables):
            for key in (path, *variable.also):
                linked[key] = [row[column] for row in self.rows]
        spec = self._spec.changed(linked=[*self._spec.linked, linked])
        outcome = run_study(spec, self.folder, replace(self._execution, progress=progress))
        self._execution = replace(self._execution, resume=True, overwrite=False)
        self.computed += outcome.computed
        complete = (record for record in outcome.records if record["status"] == "complete")
        rows = [(record["labels"], summary_row(record)) for record in complete]
        _check_quantities(self.problem, rows)
        for text in () if self.designs else _sign_remarks(self.problem, rows):
            (self._execution.on_remark or _LOG.warning)(text)
        runs: dict[tuple[str, ...], list[Record]] = {row: [] for row in self.rows}
        for record in outcome.records:
            runs[tuple(str(record["labels"][path]) for path, _ in self.variables)].append(record)
        designs, margins = [], []
        for number, row in enumerate(self.rows, start=1):
            rows = [(record["labels"], summary_row(record)) for record in runs[row]]
            incomplete = [record for record in runs[row] if record["status"] != "complete"]
            objectives = tuple(_objective_value(one, rows) for one in self.problem.objectives)
            worst = [_constraint_value(one, rows) for one in self.problem.constraints]
            excess = tuple(margin for _, margin in worst)
            if incomplete:
                objectives, excess = (math.nan,) * len(objectives), (math.nan,) * len(excess)
            feasible = not any(map(math.isnan, objectives)) and all(one <= 0.0 for one in excess)
            values = dict(zip(self.problem.variables, map(float, row), strict=True))
            reason = str(incomplete[0]["status_reason"]) if incomplete else ""
            limits = (math.nan,) * len(worst) if incomplete else tuple(value for value, _ in worst)
            designs.append(Design(number, values, objectives, limits, feasible, reason))
            margins.append(excess)
        if not self.designs:
            columns = zip(self.problem.constraints, zip(*margins, strict=True), strict=True)
            self._scales = np.array([_scale(one, column) for one, column in columns])
        self._margins = np.array(margins, dtype=float).reshape(len(designs), -1) / self._scales
        largest = self._margins.max(axis=1, initial=-math.inf).tolist()
        pairs = zip(designs, largest, strict=True)
        self.designs = tuple(replace(design, excess=excess) for design, excess in pairs)


def _written_value(variable: Variable, share: float) -> str:
    """Return the value at a share of a variable's range as text, within the range.

    >>> _written_value(Variable(low=1e3, high=1e5, scale="log"), 0.5)
    '10000'
    >>> [_written_value(Variable(low=1234567.8, high=1234569.0), share) for share in (0.0, 0.5)]
    ['1234567.8', '1234568.4']
    """
    if variable.scale == "log":
        value = variable.low * (variable.high / variable.low) ** share
    else:
        value = variable.low + (variable.high - variable.low) * share
    span = (variable.high - variable.low) / max(abs(variable.low), abs(variable.high))
    rounded = float(f"{value:.{DIGITS + max(0, math.floor(-math.log10(span)))}g}")
    return repr(min(max(rounded, variable.low), variable.high)).removesuffix(".0")


def share_of(variable: Variable, value: float) -> float:
    """Return the share of a variable's range below a value."""
    if variable.scale == "log":
        return math.log(value / variable.low) / math.log(variable.high / variable.low)
    return (value - variable.low) / (variable.high - variable.low)


def signs_of(problem: Optimise) -> Floats:
    """Return 1 for each objective to minimise, -1 for each to maximise."""
    return np.array([1.0 if goal.goal == "minimise" else -1.0 for goal in problem.objectives])


Rows = Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]


def _run_values(value: Value, rows: Rows) -> list[float]:
    """Return a quantity of the selected runs, NaN where a run lacks it."""
    numbers = []
    for cells in (cells for labels, cells in rows if selects(value, labels)):
        cell = cells.get(value.quantity)
        number = float(cell) if isinstance(cell, int | float) else math.nan
        numbers.append(abs(number) if value.magnitude else number)
    return numbers


def _objective_value(objective: Objective, rows: Rows) -> float:
    values = _run_values(objective, rows)
    if not values or any(map(math.isnan, values)):
        return math.nan
    if objective.over == "mean":
        return math.fsum(values) / len(values)
    return max(values) if objective.goal == "minimise" else min(values)


def _constraint_value(constraint: Constraint, rows: Rows) -> tuple[float, float]:
    """Return the worst value, and its relative excess over the limit, negative within it.

    Over a limit of 0 that over the other limit; if there is none the excess itself, see `_scale`.
    """
    worst = (math.nan, math.nan)
    other = abs(constraint.low or 0.0) + abs(constraint.high or 0.0) or 1.0
    for value in _run_values(constraint, rows):
        if math.isnan(value):
            return math.nan, math.nan
        for limit, sign in ((constraint.high, 1.0), (constraint.low, -1.0)):
            if limit is None:
                continue
            beyond = sign * (value - limit) / (abs(limit) or other)
            if not beyond <= worst[1]:
                worst = value, beyond
    return worst


def _scale(constraint: Constraint, excess: Sequence[float]) -> float:
    """Return what the excess over a limit of 0 counts by: the largest of the first designs.

    A search adds up the excess of all constraints, whatever their units.
    """
    if constraint.low or constraint.high:
        return 1.0
    return max((abs(x) for x in excess if not math.isnan(x)), default=0.0) or 1.0


def _sign_remarks(problem: Optimise, rows: Rows) -> Iterator[str]:
    """Yield what counts with its sign although its column is one of largest magnitudes.

    The sign is a direction, which turns with the curve: a large negative value is not a small one.
    """
    for value in problem.values.values():
        both = isinstance(value, Constraint) and None not in (value.low, value.high)
        if both or value.magnitude or not _MAGNITUDE.fullmatch(value.quantity):
            continue
        if any(number < 0.0 for number in _run_values(value, rows)):
            yield (
                f"{name_of(value)} has negative values: the sign of the largest magnitude is its "
                "direction; with `magnitude = true` its size counts"
            )


def _check_quantities(problem: Optimise, rows: Rows) -> None:
    """Refuse a quantity that no complete run has."""
    if not rows:
        return
    names = {name for _, cells in rows for name, v in cells.items() if isinstance(v, int | float)}
    Faults(
        Fault(INPUTS, f"{key}.quantity", f"no run has '{quantity}'", nearest(quantity, names))
        for key, quantity in ((key, value.quantity) for key, value in problem.values.items())
        if quantity not in names
    ).check()


def name_of(value: Value) -> str:
    """Return the name of a value: its quantity, with the selected runs."""
    where = ", ".join(f"{key}={label}" for key, label in value.where.items())
    name = f"|{value.quantity}|" if value.magnitude else value.quantity
    return f"{name} at {where}" if where else name


def with_unit(value: Value) -> str:
    """Return the name of a value with its unit."""
    unit = unit_of(value.quantity)
    return f"{name_of(value)} ({unit})" if unit else name_of(value)


def values_by_name(
    problem: Optimise, designs: Sequence[Design], label: Callable[[Value], str] = with_unit
) -> dict[str, list[float]]:
    """Return objectives and constraints of designs by name, with unit unless `label` otherwise.

    A quantity that is several of them stands once, and again where its values differ, as the mean
    over the runs, the smallest and the largest of them do.
    """
    columns: dict[str, list[float]] = {}
    for number, value in enumerate(problem.values.values()):
        name, values = label(value), [design.values[number] for design in designs]
        if not np.array_equal(columns.get(name, values), values, equal_nan=True):
            name = f"{name}, {statistic_over_runs(value)}"
        columns[name] = values
    return columns


def statistic_over_runs(value: Value) -> str:
    """Return which value over the runs of a design an objective or a constraint takes."""
    if isinstance(value, Objective):
        worst = "largest" if value.goal == "minimise" else "smallest"
        return "mean" if value.over == "mean" else worst
    assert isinstance(value, Constraint)
    if value.low is not None and value.high is not None:
        return "worst of its limits"
    return "largest" if value.low is None else "smallest"
