"""Which nests of two springs fit the space, hold the stresses and meet the wanted deflections?

Free are both wires (from a list), both mean diameters and the free height; the stiffnesses follow
from the design equations, the numbers of coils from the stiffnesses.  In four steps:

1. `candidates`: thousands of nests from a Sobol sequence, all evaluated in one call;
2. the best nest of each pair of wires is bettered by samples around it; the best pairs go to their
   optimum (linear programs of scipy, slopes by differences evaluated in the same call);
3. diameters, height and coils are rounded to what is made, and the nest is verified again *as
   built*, with the deflections that rounding leaves;
4. ranked by mass or by fatigue margin; `active` names the limits that hold each optimum in place.

Every limit is a slack, relative and positive when it is kept (`LIMITS` says what each one means).
"""

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeVar

import numpy as np
from scipy.optimize import linprog
from scipy.stats import qmc

from railsim.arrays import Floats
from railsim.definitions.spring import Search, TrailingArmSuspension
from railsim.errors import Fault, InputError
from railsim.springs import nests as many
from railsim.springs.nests import Dimensions, Evaluation, Task, evaluate

R = TypeVar("R")
Query = tuple[Dimensions, Floats | None]  # nests to be evaluated, and their coils as built, if any
Steps = Generator[Query, Evaluation, R]  # a search that asks for evaluations

# limit: key of the file that loosens it, and how
LIMITS = {
    "outer_diameter": ("search.outer_diameter_max", "raise it"),
    "inner_diameter": ("search.inner_diameter_min", "reduce it"),
    "radial_clearance": ("search.clearance_min", "reduce it and checks.radial_clearance"),
    "free_height_min": ("search.free_height", "reduce the smallest free height"),
    "free_height_max": ("search.free_height", "raise the largest free height"),
    "stiffness": ("target", "bring load and deflection to what two springs can do; see design"),
    "equilibrium": ("loads", "reduce the highest load"),
}
OF_EACH = {
    "index": ("search.spring_index", "widen it"),
    "coils": ("search.active_coils_min", "reduce it, or allow thicker wire"),
    "height": ("search.free_height", "raise it, or allow thinner wire"),
    "yield": ("search.stress_ratio_max", "raise it or material.tau_allowable"),
    "fatigue": ("search.fatigue_margin_min", "reduce it and checks.fatigue_margin"),
    "buckling": ("search.buckling_ratio_max", "raise it, or reduce search.free_height"),
}
LIMITS |= {f"{limit}_{s}": how for limit, how in OF_EACH.items() for s in ("outer", "inner")}
ACTIVE = 2e-3  # relative slack below which a limit counts as active at an optimum
_SEED = 20260
_ROUNDS, _AROUND, _CLOSER = 8, 32, 0.65  # samples around the best nest of each pair of wires
_DIFFERENCE = 1e-7  # of the scaled dimensions: error of the slopes 1e-7 by cut and by round-off
_MASS = 50.0  # kg: makes the masses of nests numbers of order one
_PRICE = 10.0  # of a violation, against aims of order one
# linear programs, over the scaled dimensions: many are needed along a curved edge of two limits
_PROGRAMS, _FIRST_BOX, _CONVERGED = 200, 0.03, 1e-6
_NEARLY = -2e-3  # slack at which an optimum is good enough to be rounded: rounding decides
_FAR = -0.5  # slack below which a nest is no compromise
_SPARE = 10  # pairs refined beyond those asked for: some do not survive rounding


@dataclass(frozen=True)
class BuiltSpring:
    """One spring as it would be ordered: mean and wire diameter, coils, free height [m]."""

    mean_diameter: float
    wire_diameter: float
    active_coils: float
    free_height: float


@dataclass(frozen=True)
class Nest:
    """A feasible nest with rounded dimensions."""

    outer: BuiltSpring
    inner: BuiltSpring
    mass: float  # of both [kg]
    fatigue_margin: float  # the smaller one of the springs' margins, inf without a table [fatigue]
    mounting_error: float  # deviation from the wanted deflections that rounding leaves [m]
    target_error: float
    active: tuple[str, ...]  # limits that hold the optimum in place, before rounding
    slack: Mapping[str, float]  # relative distance to each limit, as built


@dataclass(frozen=True)
class SearchResult:
    """Feasible nests, the best first."""

    nests: tuple[Nest, ...]  # one for each pair of wires, ranked
    objective: str  # what they are ranked by
    tried: int  # candidates
    feasible: int  # and how many of them kept every limit
    broken: Mapping[str, int]  # number of candidates that broke a limit, by limit
    cloud: Floats  # mass [kg] and fatigue margin of the feasible candidates, (feasible, 2)


def search(suspension: TrailingArmSuspension) -> SearchResult:
    """Search the feasible nests of a suspension file.

    Raises InputError: a table that the search needs is missing, or no nest keeps all limits: which
    limits stand in the way, and how to loosen them.
    """
    task = many.task_of(suspension)
    sample = candidates(task.limits, task.wires)
    found = evaluate(task, sample)
    feasible = found.feasible
    leaders, merit = _leaders(task, sample, _merit(task, found))
    best = np.argsort(merit, kind="stable")[: task.limits.results + _SPARE]
    optima = _run_together(task, [_optimum(task, leaders, int(i)) for i in best])
    built = _run_together(task, [_build(task, optimum) for optimum in optima])
    nests = [nest for nest in built if nest is not None]
    by_mass = task.limits.objective == "mass"
    nests.sort(key=lambda nest: nest.mass if by_mass else -nest.fatigue_margin)
    result = SearchResult(
        nests=tuple(nests[: task.limits.results]), objective=task.limits.objective,
        tried=len(sample.H0), feasible=int(np.sum(feasible)),
        broken={name: int(np.sum(slack < -1e-9)) for name, slack in found.slack.items()},
        cloud=np.column_stack([found.mass, np.minimum(*found.margin)])[feasible],
    )  # fmt: skip
    if not nests:
        raise InputError(_no_nest_faults(suspension, result, optima))
    return result


def candidates(limits: Search, wires: Floats) -> Dimensions:
    """Nests from a scrambled Sobol sequence that use the space as far as it goes.

    Wires are taken from the list; the mean diameters lie between the spring index and the space
    that is left, so that most candidates fit geometrically.
    """
    power = int(np.ceil(np.log2(limits.candidates)))
    unit = qmc.Sobol(d=5, seed=np.random.default_rng(_SEED)).random_base2(power)
    unit = unit[: limits.candidates]
    index = np.minimum((unit[:, :2] * len(wires)).astype(int), len(wires) - 1)
    d = d_outer, d_inner = wires[index.T]
    w_min, w_max = limits.spring_index
    gap = d_outer + d_inner + 2.0 * limits.clearance_min
    low_inner = np.maximum(w_min * d_inner, limits.inner_diameter_min + d_inner)
    low = np.maximum(w_min * d_outer, low_inner + gap)
    high = np.minimum(w_max * d_outer, limits.outer_diameter_max - d_outer)
    D_outer = low + unit[:, 2] * (high - low)
    high = np.minimum(w_max * d_inner, D_outer - gap)
    D_inner = low_inner + unit[:, 3] * (high - low_inner)
    shortest, longest = limits.free_height
    H0 = shortest + unit[:, 4] * (longest - shortest)
    return Dimensions(d, np.stack([D_outer, D_inner]), H0)


@dataclass(frozen=True)
class _Optimum:
    """Where the local optimisation ended: dimensions of one nest, slacks by limit."""

    dimensions: Dimensions
    slack: Mapping[str, float]

    @property
    def worst(self) -> float:
        """The smallest slack."""
        return min(self.slack.values())

    @property
    def active(self) -> tuple[str, ...]:
        """Limits that hold it in place."""
        return tuple(name for name, value in self.slack.items() if value < ACTIVE)


def _merit(task: Task, evaluation: Evaluation) -> Floats:
    """The aim, to be made small, and the worst violation, which no small mass may outweigh."""
    slack = np.array(list(evaluation.slack.values()))
    violation = np.maximum(0.0, -np.min(np.nan_to_num(slack, nan=-1.0), axis=0))
    merit: Floats = np.max(_aims(task, evaluation), axis=0) + 3.0 * violation
    return np.nan_to_num(merit, nan=np.inf)


def _leaders(task: Task, sample: Dimensions, merit: Floats) -> tuple[Dimensions, Floats]:
    """The best nest of each pair of wires, bettered by samples drawn closer and closer around."""
    random = np.random.default_rng(_SEED)
    pairs = sample.d.T
    order = np.argsort(merit, kind="stable")
    _, first = np.unique(pairs[order], axis=0, return_index=True)
    chosen = order[first]
    x = np.stack([*sample.D, sample.H0], axis=-1)[chosen]
    d, merit = pairs[chosen], merit[chosen]
    shortest, longest = task.limits.free_height
    widest = task.limits.outer_diameter_max
    reach = np.array([0.1, 0.1, 0.5]) * np.array([widest, widest, longest - shortest])
    for turn in range(_ROUNDS):
        if turn % 2 == 0:  # leave the worse half of the pairs, as long as enough are left
            best_rows = np.argsort(merit, kind="stable")[: max(len(merit) // 2, 4 * _SPARE)]
            x, d, merit = x[best_rows], d[best_rows], merit[best_rows]
        tried = x[:, None, :] + reach * random.uniform(-1.0, 1.0, (len(x), _AROUND, 3))
        tried[..., 2] = np.clip(tried[..., 2], shortest, longest)
        *D, H0 = tried.reshape(-1, 3).T
        found = evaluate(task, Dimensions(np.repeat(d, _AROUND, axis=0).T, np.stack(D), H0))
        merits = _merit(task, found).reshape(len(x), _AROUND)
        best = np.argmin(merits, axis=1)
        rows = np.arange(len(x))
        better = merits[rows, best] < merit
        x = np.where(better[:, None], tried[rows, best], x)
        merit = np.where(better, merits[rows, best], merit)
        reach = _CLOSER * reach
    return Dimensions(d.T, x[:, :2].T, x[:, 2]), merit


def _run_together(task: Task, searches: Sequence[Steps[R]]) -> list[R]:
    """Ends of searches that go on in step: nests that they ask for are evaluated in one call."""
    queries: dict[int, Query] = {}
    ends: dict[int, R] = {}

    def go_on(number: int, reply: Any = None) -> None:
        try:
            queries[number] = searches[number].send(reply)
        except StopIteration as end:
            queries.pop(number, None)
            ends[number] = end.value

    for number in range(len(searches)):
        go_on(number)
    while queries:
        nests = Dimensions.concatenated([nests for nests, _ in queries.values()])
        coils = [n for _, n in queries.values() if n is not None]  # of all, or of none
        evaluation = evaluate(task, nests, np.concatenate(coils, axis=-1) if coils else None)
        begin = 0
        for number, (of_one, _) in list(queries.items()):
            end = begin + len(of_one.H0)
            go_on(number, evaluation.part(slice(begin, end)))
            begin = end
    return [ends[number] for number in range(len(searches))]


def _optimum(task: Task, sample: Dimensions, start: int) -> Steps[_Optimum]:
    """Best mean diameters and free height for one pair of wires; the least broken where none fit.

    Variables are (D_outer, D_inner, H0) over the size of the space.  Sequential linear programming:
    aims and slacks are linearised, the program is solved within a box that shrinks when the step
    disappoints (Fletcher and Maza 1989).  As a rule as many limits are active as there are
    variables, and at such a corner the method converges quadratically.
    """
    d = sample.d[:, start, None]
    largest, longest = task.limits.outer_diameter_max, task.limits.free_height[1]
    scale = np.array([largest, largest, longest])
    neighbours = np.vstack([np.zeros(3), _DIFFERENCE * np.eye(3)])

    def dimensions_at(points: Floats) -> Dimensions:
        *D, H0 = (points * scale).T
        return Dimensions(np.repeat(d, len(points), axis=1), np.stack(D), H0)

    def linearise(x: Floats) -> Steps[_Linearised]:
        evaluation = yield dimensions_at(x + neighbours), None
        aims = np.stack(_aims(task, evaluation), axis=-1)
        slack = np.stack(list(evaluation.slack.values()), axis=-1)
        # far outside the model's range: finite, and clearly wrong
        aims = np.nan_to_num(aims, nan=1e3, posinf=1e3)
        slack = np.clip(np.nan_to_num(slack, nan=-1.0), -10.0, 10.0)
        slopes = [(block[1:] - block[0]).T / _DIFFERENCE for block in (aims, slack)]
        return _Linearised(aims[0], slack[0], slopes[0], slopes[1], tuple(evaluation.slack))

    w_min, w_max = task.limits.spring_index
    low = np.append(w_min * d, task.limits.free_height[0]) / scale
    high = np.append(w_max * d, longest) / scale
    x = np.append(sample.D[:, start], sample.H0[start]) / scale
    here, reach = (yield from linearise(x)), _FIRST_BOX
    for _ in range(_PROGRAMS):
        box = np.maximum(low - x, -reach), np.minimum(high - x, reach)
        step, promised = _linear_step(here, *box)
        gain = here.merit - promised
        if gain < _CONVERGED or reach < _CONVERGED:
            break
        there = yield from linearise(x + step)
        ratio = (here.merit - there.merit) / gain
        if ratio > 0.1:
            x, here = x + step, there
        reach = 1.5 * reach if ratio > 0.7 else 0.35 * float(np.max(np.abs(step)))
    slack = dict(zip(here.names, here.slack.tolist(), strict=True))
    return _Optimum(dimensions_at(x[None, :]), slack)


@dataclass(frozen=True)
class _Linearised:
    """Aims and slacks of a nest, their slopes by variable, and the names of the limits."""

    aims: Floats
    slack: Floats
    aim_slopes: Floats
    slack_slopes: Floats
    names: tuple[str, ...]

    @property
    def merit(self) -> float:
        """The worst aim, and the worst violation at a price."""
        return float(np.max(self.aims) + _PRICE * max(0.0, -np.min(self.slack)))


def _linear_step(here: _Linearised, low: Floats, high: Floats) -> tuple[Floats, float]:
    """Solve the linearised task in a box: the step, and the merit that it promises.

    Unknowns are the step, the bound t of the aims and the violation v; `min t + price v`.
    """
    aims, slacks = len(here.aims), len(here.slack)
    first = [here.aim_slopes, -np.ones((aims, 1)), np.zeros((aims, 1))]
    rows = np.block([first, [-here.slack_slopes, np.zeros((slacks, 1)), -np.ones((slacks, 1))]])
    ends = np.concatenate([-here.aims, here.slack])
    bounds = [*zip(low, np.maximum(low, high), strict=True), (None, None), (0.0, None)]
    solution = linprog([0.0, 0.0, 0.0, 1.0, _PRICE], A_ub=rows, b_ub=ends, bounds=bounds)
    if solution.x is None:
        return np.zeros(3), here.merit
    return solution.x[:3], float(solution.fun or 0.0)


def _aims(task: Task, evaluation: Evaluation) -> list[Floats]:
    """What is to be made small, of order one: the mass, or both springs' inverse margins."""
    if task.limits.objective == "mass":
        return [evaluation.mass / _MASS]
    return [*(1.0 / evaluation.margin)]


def _build(task: Task, optimum: _Optimum) -> Steps[Nest | None]:
    """The best rounding near an optimum that keeps every limit, None where none does."""
    if optimum.worst < _NEARLY:
        return None
    nest, best, x0 = None, np.inf, np.array([*optimum.dimensions.D[:, 0], *optimum.dimensions.H0])
    while (near := (yield from _round_nest(task, optimum, x0))) is not None and near[0] < best:
        best, nest = near
        x0 = np.array([nest.outer.mean_diameter, nest.inner.mean_diameter, nest.outer.free_height])
    return nest


def _round_nest(task: Task, optimum: _Optimum, around: Floats) -> Steps[tuple[float, Nest] | None]:
    """The best nest of whole steps around (D_outer, D_inner, H0), with its merit."""
    step, coil_step = task.limits.diameter_step, task.limits.coil_step
    near = np.array(list(product((-1, 0, 1, 2), repeat=3))).T
    *D, H0 = (np.floor(around / step + 1e-6)[:, None] + near) * step
    rounded = Dimensions(np.repeat(optimum.dimensions.d, len(H0), axis=1), np.stack(D), H0)
    exact = (yield rounded, None).n
    x = Dimensions(*(np.repeat(value, 4, axis=-1) for value in vars(rounded).values()))
    up = np.tile([[0, 0, 1, 1], [0, 1, 0, 1]], len(H0))
    n = (np.floor(np.repeat(exact, 4, axis=1) / coil_step) + up) * coil_step
    result = yield x, n
    error = np.max(np.abs(result.deflection_error), axis=0)
    fits = result.feasible & (error <= task.limits.height_error_max)
    # a third of a percent of the aim is worth less than a millimetre of ride height
    merit = np.where(fits, np.max(_aims(task, result), axis=0) + 3.0 * error, np.inf)
    best = int(np.argmin(merit))
    if not fits[best]:
        return None
    margin = np.minimum(*result.margin)

    def spring(i: int, free_height: Floats) -> BuiltSpring:
        sizes = x.D[i], x.d[i], n[i], free_height
        return BuiltSpring(*(round(float(value[best]), 9) for value in sizes))

    return float(merit[best]), Nest(
        outer=spring(0, x.H0), inner=spring(1, x.H0 - task.height_difference),
        mass=float(result.mass[best]), fatigue_margin=float(margin[best]),
        mounting_error=float(result.deflection_error[0][best]),
        target_error=float(result.deflection_error[1][best]), active=optimum.active,
        slack={name: float(values[best]) for name, values in result.slack.items()},
    )  # fmt: skip


def _no_nest_faults(
    suspension: TrailingArmSuspension, result: SearchResult, optima: Sequence[_Optimum]
) -> Iterator[Fault]:
    """The limits that the least broken nest breaks; without one, those that most candidates do."""
    nearest = max(optima, key=lambda optimum: optimum.worst)
    x = nearest.dimensions
    wires = f"wires {x.d[0, 0] * 1e3:.6g} and {x.d[1, 0] * 1e3:.6g} mm"
    if nearest.worst >= _NEARLY:
        found = "no nest fits once its dimensions and coils are rounded"
        mend = "reduce search.diameter_step or search.coil_step, or raise search.height_error_max"
        yield Fault(suspension.name, "search.diameter_step", found, mend)
        return
    if nearest.worst > _FAR:
        missed = {name: -slack for name, slack in nearest.slack.items() if slack < 0.0}
        words = "is missed by {:.1%} at the best compromise (" + wires + ")"
    else:
        missed = {name: count / result.tried for name, count in result.broken.items() if count}
        words = "keeps out {:.0%} of the candidates"
    names = sorted(missed, key=lambda name: -missed[name])[:3]
    for name in names:
        if missed[name] > 0.5 * missed[names[0]]:
            sentence = f"no nest fits: the limit '{name}' {words.format(missed[name])}"
            yield Fault(suspension.name, LIMITS[name][0], sentence, LIMITS[name][1])
