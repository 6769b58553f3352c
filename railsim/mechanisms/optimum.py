"""What an optimisation found: starts, active constraints, the best point."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomli_w
from scipy.optimize import nnls

from railsim.arrays import Floats
from railsim.definitions.mechanism.definition import Mechanism
from railsim.design_checks import ROUNDING
from railsim.errors import InputError
from railsim.files.key_paths import key_path
from railsim.mechanisms.analysis import Analysis, analyse
from railsim.mechanisms.judgement import FEASIBLE, Judge, Judgement
from railsim.mechanisms.kinematics import check_freedom
from railsim.mechanisms.model import build

ALIKE = 1e-5  # share by which breaches may differ that count as equal
ACTIVE = 1e-5  # margin, in its scale, below which a constraint is active


@dataclass(frozen=True)
class Active:
    """A limit that holds the optimum in place."""

    name: str  # constraint, or parameter
    side: str  # "lower" or "upper" of a parameter's bound, else empty
    slack: float  # what is left to the limit, SI
    multiplier: float  # decrease of the objective for each unit (SI) that the limit gives way


@dataclass(frozen=True)
class Start:
    """One start of the search."""

    number: int  # 0 is the file's own
    begin: dict[str, float]  # parameters
    end: dict[str, float]
    objective: float  # at the end; NaN where it never could be assembled
    violation: float
    evaluations: int

    @property
    def feasible(self) -> bool:
        """Whether all constraints are kept."""
        return bool(self.violation <= FEASIBLE)


@dataclass(frozen=True)
class Optimum:
    """Result of a search."""

    definition: Mechanism  # the mechanism with the best parameters
    before: Analysis | None  # results with the file's own parameters, if they can be assembled
    after: Analysis  # and with the best
    objective: float
    own: dict[str, float]  # the file's own parameters
    objective_before: float  # theirs; NaN for parameters that cannot be assembled
    feasible_before: bool  # whether they keep all constraints, to their rounding
    feasible: bool  # all constraints kept; else the compromise with the smallest breach
    breaches: dict[str, float]  # broken constraints and by how much, SI
    active: tuple[Active, ...]
    starts: tuple[Start, ...]
    seed: int

    @property
    def parameters(self) -> dict[str, float]:
        """The best parameters among those that may change."""
        return best_of(self.starts).end


def best_of(starts: Sequence[Start]) -> Start:
    """The start with the smallest objective of those that are feasible, or least broken."""
    usable = [start for start in starts if np.isfinite(start.objective)]
    least = (1.0 + ALIKE) * min(start.violation for start in usable)
    known = [start for start in usable if start.feasible or start.violation <= least]
    return min(known, key=lambda start: (not start.feasible, start.objective))


def optimum_of(
    definition: Mechanism, judge: Judge, best: Start, starts: tuple[Start, ...], seed: int
) -> Optimum:
    """Return the best of all starts with what is active there."""
    x, choice = judge.point_of(best.end)
    least = judge.least(x, choice)
    judgement = judge(x, choice, [share for margin, share in least.values() if margin < ACTIVE])
    listed = {
        name: tuple(names) for name, names in definition.provenance.items() if name != "optimised"
    }
    listed["optimised"] = tuple(best.end)
    better = definition.with_parameters(best.end).model_copy(update={"provenance": listed})
    check_freedom(build(better))
    after = analyse(better)
    try:
        before: Analysis | None = analyse(definition)
        written = Judge(definition)(*judge.point_of(judge.values))
        objective_before, kept_before = written.objective, written.violation <= ROUNDING
    except InputError:
        before, objective_before, kept_before = None, float("nan"), False
    own = {name: float(judge.values[name]) for name in best.end}
    scales = dict(judge.labels)
    breaches = {
        name: -margin * scales[name] for name, (margin, _) in least.items() if margin < -FEASIBLE
    }
    for (name, scale), margin in zip(judge.labels, judgement.margins, strict=True):
        if margin < -FEASIBLE:
            breaches[name] = max(breaches.get(name, 0.0), -float(margin) * scale)
    if (angle := judge.problem.min_transmission_angle) is not None:
        limit, angles = after.model.number(angle), after.min_angles
        for name in breaches.keys() & angles.keys():  # margins are of the squares of their sines
            breaches[name] = max(limit - angles[name], 0.0)
    feasible, active = best.feasible and not breaches, _active(judge, judgement, x)
    values = judgement.objective, own, objective_before, kept_before
    return Optimum(better, before, after, *values, feasible, breaches, active, starts, seed)


def _active(judge: Judge, judgement: Judgement, x: Floats) -> tuple[Active, ...]:
    """Limits that hold the optimum: their slack, and multipliers by least squares."""
    rows: list[tuple[str, str, float, Floats]] = []
    span = judge.upper - judge.lower
    seen: dict[str, int] = {}
    for i, (name, _) in enumerate(judge.labels):
        if judgement.margins[i] < ACTIVE and (
            name not in seen or judgement.margins[i] < judgement.margins[seen[name]]
        ):
            seen[name] = i
    for name, i in seen.items():
        scale = judge.labels[i][1]
        rows.append((name, "", float(judgement.margins[i]) * scale, judgement.slopes[i] * scale))
    for k, name in enumerate(judge.names):
        unit = np.eye(len(x))[k]
        if x[k] - judge.lower[k] < ACTIVE * span[k]:
            rows.append((name, "lower", float(x[k] - judge.lower[k]), unit))
        if judge.upper[k] - x[k] < ACTIVE * span[k]:
            rows.append((name, "upper", float(judge.upper[k] - x[k]), -unit))
    if not rows:
        return ()
    matrix = np.array([row[3] for row in rows]).T * span[:, None]
    norms = np.linalg.norm(matrix, axis=0)
    norms[norms == 0.0] = 1.0
    # where several positions have the largest force, a mean of their gradients is in balance
    peaks = ((judgement.square_gradient + judgement.rivals) * span).T
    large = 1e3 * float(np.linalg.norm(peaks)) or 1.0
    sums = np.repeat((0.0, large), (len(rows), peaks.shape[1]))
    both = np.vstack((np.hstack((matrix / norms, -peaks)), sums))
    weights, _ = nnls(both, np.append(np.zeros(len(x)), large))
    each = zip(rows, (weights[: len(rows)] / norms).tolist(), strict=True)
    return tuple(Active(*row[:3], weight) for row, weight in each)


def optimised_text(base: str, optimum: Optimum, changes: Sequence[str], case: str | None) -> str:
    """Return the text of the file.

    `base` is the searched file as the new one must name it; the overrides ``key.path=value`` and
    the parameters of the case that were in force are written down.
    """
    definition = optimum.definition
    data: dict[str, Any] = {}
    changed: list[str] = []
    for text in changes:
        key, _, written = text.partition("=")
        path = key_path(key.strip())
        if any(part.isdecimal() for part in path):
            # a member of a list cannot be changed by a file that extends another: all of it
            return definition.to_toml()
        node = data
        for part in path[:-1]:
            node = node.setdefault(part, {})
        node[path[-1]] = _value(written.strip())
        changed += [path[1]] if path[0] == "parameters" and len(path) == 2 else []
    parameters = data.setdefault("parameters", {})
    if case is not None:
        parameters |= definition.cases[case]
        changed += definition.cases[case]
    parameters |= optimum.parameters
    best = list(optimum.parameters)
    provenance = data.setdefault("provenance", {})
    provenance["set"] = [name for name in dict.fromkeys(changed) if name not in best]
    provenance["optimised"] = best
    head = {"format": definition.format, "extends": base, "name": f"{definition.name}, optimised"}
    count = len(optimum.starts)
    lead = (
        f"# Found by {count} starts with seed {optimum.seed}: objective {optimum.objective:.6g}"
        + ("" if optimum.feasible else ", a compromise that breaks constraints")
    )
    return f"{lead}\n{tomli_w.dumps({**head, **data})}"


def _value(written: str) -> Any:
    try:
        return tomllib.loads(f"value = {written}")["value"]
    except (ValueError, RecursionError):  # no TOML is text
        return written
