"""Search methods: surrogate models, a genetic algorithm, differential evolution; their fronts.

A search works on variables in the unit cube, objectives to minimise and constraints that are met
where they are not positive; both are NaN for designs without values.  It requests the values of
several designs at a time through one function, and is deterministic: the same seed and values lead
to the same designs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.definitions.study.design import FEWEST_EVOLVED
from railsim.errors import optional_package

CANDIDATES = 512  # candidates for a batch, from Sobol's sequence
NEAR = 256  # further candidates about members of the front, at each distance
CELLS = 1024  # points for the estimate of the gain of a candidate
SHARES = 8192  # points for the shares of the cube that are nearest to designs
SMALLEST_DISTANCE = 2e-3  # of the cube's side, between designs
NO_ANSWER = 1e9  # excess of designs without values
ROUND_OFF = 1e-9  # range of values over the largest, below which they count as equal
MARGIN = 0.1  # distance of the reference point beyond the front, as a share of its range


@dataclass(frozen=True)
class Values:
    """Values of designs."""

    objectives: Floats
    constraints: Floats

    @property
    def feasible(self) -> Flags:
        """Whether each design has values and meets all constraints."""
        known = np.isfinite(self.objectives).all(axis=1)
        return np.logical_and(known, (self.constraints <= 0.0).all(axis=1))


Evaluate = Callable[[Floats], Values]


@dataclass(frozen=True)
class Task:
    """Task of a search."""

    # designs, float64[design, variable] from 0 to 1, to the values of all designs so far
    evaluate: Evaluate
    variables: int
    objectives: int
    constraints: int
    number: int  # of designs in total
    batch: int  # designs at a time
    seed: int


def _surrogate(task: Task) -> None:
    """Fit radial basis functions to the known designs, and evaluate the most promising ones.

    The first two batches are the centre of the cube and Sobol's sequence.  Then each batch
    maximises the gain of dominated volume according to the surrogate, one design after the other,
    assuming the predicted values for the previous ones.  The last design of a batch is the
    candidate farthest from all known designs, so that no region depends on a wrong surrogate.
    Compare Knowles (2006), Mueller (2017).
    """
    from scipy.stats import qmc

    count = task.variables
    begin = min(task.number, max(2 * count + 2, 2 * task.batch))
    sequence = qmc.Sobol(count, seed=task.seed).random(1 << (begin - 1).bit_length())
    designs = np.vstack([np.full((1, count), 0.5), sequence[: begin - 1]])
    values = task.evaluate(designs)
    while len(designs) < task.number:
        size = min(task.batch, task.number - len(designs))
        new = _promising(designs, values, size, np.random.default_rng([task.seed, len(designs)]))
        if not len(new):
            return
        designs = np.vstack([designs, new])
        values = task.evaluate(new)


def _promising(designs: Floats, values: Values, size: int, rng: np.random.Generator) -> Floats:
    from scipy.stats import qmc

    count = designs.shape[1]
    feasible = values.feasible
    candidates = [qmc.Sobol(count, seed=rng).random(CANDIDATES)]
    if feasible.any():
        rows = np.flatnonzero(feasible)
        best = designs[rows[non_dominated(values.objectives[rows])]]
        for width in (0.1, 0.02):
            moved = best[rng.integers(len(best), size=NEAR)]
            candidates.append(np.clip(moved + rng.normal(0.0, width, moved.shape), 0.0, 1.0))
        candidates.append(_at_bounds(candidates[-1], rng))
    points = np.vstack(candidates)
    predicted = Surrogate(designs, np.hstack([values.objectives, values.constraints]))(points)
    m = values.objectives.shape[1]
    objectives, constraints = predicted[:, :m], predicted[:, m:]
    # if no design is feasible, the smallest violation comes first
    excess = np.maximum(constraints, 0.0).sum(axis=1)
    allowed = excess <= 0.0
    if not allowed.any():
        allowed = excess <= np.quantile(excess, 0.02)
    front = values.objectives[feasible]
    chosen: list[int] = []
    gain = _Gain(front, objectives[allowed], rng)
    distance = np.sqrt(((points[:, None] - designs[None]) ** 2).sum(axis=2)).min(axis=1)
    for number in range(size):
        free = distance > SMALLEST_DISTANCE
        if not free.any():
            break
        worth = np.where(allowed & free, gain.volume_share(objectives), 0.0)
        explore = number == size - 1 and size > 1
        pick = int(np.argmax(np.where(free, distance, 0.0) if explore or worth.max() <= 0.0
                             else worth + 1e-9 * distance))  # fmt: skip
        chosen.append(pick)
        distance = np.minimum(distance, np.sqrt(((points - points[pick]) ** 2).sum(axis=1)))
        gain.take(objectives[pick])
    return points[chosen]


def _at_bounds(points: Floats, rng: np.random.Generator) -> Floats:
    """Return the points with one variable at a bound, where optima often lie."""
    moved = points.copy()
    column = rng.integers(points.shape[1], size=len(points))
    moved[np.arange(len(points)), column] = rng.integers(2, size=len(points))
    return moved


class _Gain:
    """Dominated volume that candidates would add to a front, estimated with random points."""

    def __init__(self, front: Floats, predicted: Floats, rng: np.random.Generator) -> None:
        from scipy.stats import qmc

        both = np.vstack([front, predicted])
        best = both[non_dominated(both)]
        low, high = best.min(axis=0), best.max(axis=0)
        span = np.where(high > low, high - low, np.maximum(np.abs(high), 1e-12))
        unit = qmc.Sobol(both.shape[1], seed=rng).random(CELLS)
        self._points = low + unit * (1.0 + MARGIN) * span
        self._open = np.ones(CELLS, bool)
        for row in front:
            self.take(row)

    def volume_share(self, objectives: Floats) -> Floats:
        """Return the share of the volume that each candidate would add."""
        left = self._points[self._open]
        dominated = np.ones((len(objectives), len(left)), bool)
        for k in range(objectives.shape[1]):
            dominated &= objectives[:, k, None] <= left[None, :, k]
        return np.asarray(dominated.sum(axis=1) / CELLS)

    def take(self, row: Floats) -> None:
        """Treat a design as known."""
        self._open &= ~(row <= self._points).all(axis=1)


class Surrogate:
    """Radial basis functions through the values of designs, thin-plate splines with a linear part.

    Designs without values get the worst known value, so that a search avoids them.
    """

    def __init__(self, designs: Floats, values: Floats) -> None:
        from scipy.interpolate import RBFInterpolator

        worst = np.max(values, axis=0, where=~np.isnan(values), initial=-np.inf)
        filled = np.where(np.isnan(values), np.where(np.isfinite(worst), worst, 0.0), values)
        self._middle, spread = filled.mean(axis=0), filled.std(axis=0)
        self._spread = np.where(spread > 0.0, spread, 1.0)
        self._designs, self._values = designs, (filled - self._middle) / self._spread
        self._fit = RBFInterpolator(designs, self._values, kernel="thin_plate_spline", degree=1)

    def __call__(self, points: Floats) -> Floats:
        """Return the predicted values at some points."""
        return np.asarray(self._fit(points) * self._spread + self._middle)

    def errors(self) -> Floats:
        """Return the leave-one-out error (RMS) of each column, over the standard deviation.

        Both over the cube: a design counts with the share of the cube that is nearest to it, as the
        many that a search puts about an optimum say little of the rest.  Of one inverse for all
        designs (Rippa 1999, eq. 4), as time for thousands of fits lacks.
        """
        from scipy.spatial import KDTree
        from scipy.spatial.distance import cdist
        from scipy.special import xlogy
        from scipy.stats import qmc

        distance, count = cdist(self._designs, self._designs), len(self._designs)
        linear = np.hstack([np.ones((count, 1)), self._designs])
        rest = np.zeros((linear.shape[1], linear.shape[1]))
        system = np.block([[xlogy(distance**2, distance), linear], [linear.T, rest]])
        inverse = np.linalg.inv(system)[:count, :count]
        missed = inverse @ self._values / np.diag(inverse)[:, None]
        points = qmc.Sobol(self._designs.shape[1], seed=0).random(SHARES)
        shares = np.bincount(KDTree(self._designs).query(points)[1], minlength=count) / SHARES
        deviation = np.sqrt(shares @ np.square(self._values - shares @ self._values))
        error = np.sqrt(shares @ np.square(missed))
        return np.asarray(error / np.where(deviation > 0.0, deviation, 1.0))


def _nsga2(task: Task) -> None:
    """Genetic algorithm of Deb et al. (2002), by pymoo; the batch is its population."""
    install = "'railsim[optimise]'; or method = \"surrogate\""
    optional_package("pymoo", "optimise.method: nsga2", install)
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem
    from pymoo.core.termination import NoTermination

    problem = Problem(
        n_var=task.variables, n_obj=task.objectives, n_ieq_constr=task.constraints, xl=0.0, xu=1.0
    )
    algorithm = NSGA2(pop_size=task.batch)
    algorithm.setup(problem, termination=NoTermination(), seed=task.seed)
    for _ in range(max(1, task.number // task.batch)):
        population = algorithm.ask()
        if population is None or not len(population):
            return
        values = task.evaluate(population.get("X"))
        population.set("F", _without_nan(values.objectives)[-len(population) :])
        if task.constraints:
            population.set("G", _without_nan(values.constraints)[-len(population) :])
        algorithm.tell(infills=population)


def _without_nan(values: Floats) -> Floats:
    """Return values in which designs without values are worse than all others."""
    comparable = np.where(np.isnan(values), -np.inf, values)
    worst = np.where(np.isfinite(comparable).any(axis=0), comparable.max(axis=0), 0.0)
    return np.where(np.isnan(values), worst + np.abs(worst) + 1.0, values)


def _differential_evolution(task: Task) -> None:
    """Differential evolution of Storn and Price (1997) for one objective, by scipy."""
    from scipy.optimize import Bounds, differential_evolution

    size = max(FEWEST_EVOLVED, task.batch)
    scale: list[float] = []  # of the objective, as large as in the first generation

    def worth(designs: Any) -> Any:
        values = task.evaluate(designs.T)
        number = designs.shape[1]
        value, broken = values.objectives[-number:, 0], values.constraints[-number:]
        if not scale:
            scale.append(float(np.max(np.abs(value), where=~np.isnan(value), initial=0.0)) or 1.0)
        # infeasible designs are worse than all feasible ones of any generation (Deb 2000)
        excess = np.maximum(broken, 0.0).sum(axis=1)
        below_one = value / (scale[0] + np.abs(value))
        penalised = np.where(excess > 0.0, 1.0 + excess, below_one)
        return np.where(np.isnan(value) | np.isnan(excess), NO_ANSWER, penalised)

    differential_evolution(
        worth,
        Bounds(np.zeros(task.variables), np.ones(task.variables)),
        maxiter=max(0, task.number // size - 1),
        init=np.random.default_rng(task.seed).random((size, task.variables)),
        seed=task.seed,
        tol=0.0,
        atol=-1.0,  # no end before: equal values of all members, or none, are no optimum
        polish=False,
        updating="deferred",
        vectorized=True,
    )


METHODS = {
    "surrogate": _surrogate,
    "nsga2": _nsga2,
    "differential_evolution": _differential_evolution,
}


def varies(values: Floats) -> Flags:
    """Return which columns vary by more than round-off, as of eigenvalues."""
    high, low = values.max(axis=0, initial=-np.inf), values.min(axis=0, initial=np.inf)
    return np.asarray(high - low > ROUND_OFF * np.minimum(np.abs(high), np.abs(low)))


def non_dominated(values: Floats) -> Flags:
    """Return which rows are not dominated: no other is as small in all columns, smaller in one.

    Of equal rows only the first is non-dominated; rows with NaN are dominated.  A column that
    varies by round-off only counts as equal in all rows.

    >>> non_dominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [np.nan, 0.0]])).tolist()
    [True, True, False, False]
    >>> non_dominated(np.array([[1.0, 3.0 + 1e-12], [2.0, 3.0]])).tolist()
    [True, False]
    """
    valued = np.logical_not(np.isnan(values).any(axis=1))
    values = np.where(varies(values[valued]), values, 0.0)
    found = np.zeros(len(values), dtype=np.bool_)
    front = np.empty((0, values.shape[1]))
    for i in np.lexsort(values.T[::-1]):  # a row can only be dominated by rows before it
        row = values[i]
        if valued[i] and not (front <= row).all(axis=1).any():
            found[i] = True
            front = np.vstack([front, row])
    return found


def knee(front: Floats) -> int:
    """Return the row nearest to the best value of each objective, scaled by its range.

    >>> knee(np.array([[0.0, 1.0], [0.2, 0.2], [1.0, 0.0]]))
    1
    """
    best, worst = front.min(axis=0), front.max(axis=0)
    span = np.where(worst > best, worst - best, 1.0)
    return int(np.argmin((((front - best) / span) ** 2).sum(axis=1)))
