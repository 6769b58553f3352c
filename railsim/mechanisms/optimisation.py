"""Search for the parameters of a mechanism: many seeded starts, exact gradients, active limits.

Each start runs sequential least-squares programming (D. Kraft, A software package for sequential
quadratic programming, DFVLR-FB 88-28, 1988; scipy's SLSQP) in coordinates in which the Gauss-Newton
matrix of the sum of squares is the unit matrix, set again until nothing improves: the quasi-Newton
updates then begin with the right curvature.  A largest amount is a further variable that no
position may exceed: where two positions are equal it has no gradient.
"""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import Bounds, minimize

from railsim.arrays import Floats
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.values import number
from railsim.errors import Fault, InputError, argument_error, argument_fault
from railsim.mechanisms.forces import unit_work
from railsim.mechanisms.judgement import FEASIBLE, Judge, Judgement, breach, is_firm
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.optimum import Optimum, Start, best_of, optimum_of
from railsim.processes import WorkerPool
from railsim.units import duration_in_words


@dataclass(frozen=True)
class Effort:
    """How far a start is followed."""

    rounds: int
    steps: int  # in each round
    gain: float  # relative, of a round: a smaller one ends it
    checks: int  # between the positions at most; where a constraint is broken, one is added


SEARCH = Effort(2, 20, 1e-2, 0)
FINISH = Effort(8, 60, 1e-3, 7)
EVERY = 5  # share of the positions that every start is first judged at
FINALISTS = 3  # starts that are followed to the end, at all positions
MOST_STARTS = 10_000
SECONDS_PER_START = 1.0  # at a rough guess, of one core
DRAWS = 60  # draws for each start until the links can be assembled
REFUSED = 1e6  # objective, against that at the start, of parameters that cannot be assembled


def optimise(
    definition: Mechanism, *, starts: int | None = None, seed: int | None = None, workers: int = 1
) -> Optimum:
    """Search for the best parameters within their bounds.

    Parameters
    ----------
    definition : Mechanism
        With a table [optimise].
    starts, seed : int, optional
        Instead of the file's.
    workers : int
        Processes. The result does not depend on their number, unless the linear algebra library
        uses several threads here: last digits differ then, and a start may end elsewhere.

    Raises
    ------
    InputError
        There is no [optimise]; too few or too many starts; no start within the bounds can be
        assembled.
    """
    if definition.optimise is None:
        fault = Fault(definition.name, "optimise", "missing", "the table [optimise] is needed")
        raise InputError([fault])
    problem = definition.optimise
    count = problem.starts if starts is None else starts
    if count > MOST_STARTS:
        time = duration_in_words(SECONDS_PER_START * count / workers)
        fault = argument_fault("starts", "", f"{count:,}, some {time}", f"{MOST_STARTS:,} at most")
        raise InputError([fault])
    chosen_seed = problem.seed if seed is None else seed
    for name, value, least in (("starts", count, 1), ("seed", chosen_seed, 0)):
        if value < least:
            raise argument_error(name, f"found {value}", f"{least} at least")
    judge = Judge(definition)
    found = _search(judge, first_points(judge, count, chosen_seed), workers)
    usable = [start for start in found if np.isfinite(start.objective)]
    if not usable:
        bounds = "bounds within which the links can be assembled over the whole travel"
        fault = Fault(definition.name, "optimise.bounds", "exclude every assembly", bounds)
        raise InputError([fault])
    return optimum_of(definition, judge, best_of(found), tuple(found), chosen_seed)


def first_points(judge: Judge, count: int, seed: int) -> list[tuple[Floats, dict[str, float]]]:
    """Parameters from which the starts begin: the file's own, then drawn evenly from the bounds.

    Draws that cannot be assembled are drawn again, `DRAWS` times; the values of `assemblies` take
    turns.
    """
    generator = np.random.default_rng(seed)
    assemblies = judge.problem.assemblies
    values = ([float(number(v, judge.values)) for v in each] for each in assemblies.values())
    choices = [dict(zip(assemblies, members, strict=True)) for members in product(*values)]
    written, choice = judge.point_of(judge.values)
    points = [(np.clip(written, judge.lower, judge.upper), choice)]
    for i in range(1, count):
        choice = choices[i % len(choices)]
        for _ in range(DRAWS):
            x = generator.uniform(judge.lower, judge.upper)
            if _assembles(judge, x, choice):
                break
        points.append((x, choice))
    return points


def _assembles(judge: Judge, x: Floats, choice: dict[str, float]) -> bool:
    try:
        model = judge.real_model(x, choice)
        motion = solve(model, judge.grid(model))
    except InputError:
        return False
    rate = unit_work(motion, judge.unknown)
    return bool(np.all(rate * rate[0] > 0.0))


def _search(judge: Judge, begins: Sequence[Any], workers: int) -> list[Start]:
    """All starts, the most promising ones and the file's own to the end; over processes if many."""
    rough = Judge(judge.definition, EVERY)
    jobs = [(index, *begin) for index, begin in enumerate(begins)]
    each: Any = map
    with ExitStack() as stack:
        if workers > 1 and len(jobs) >= 4:
            each = stack.enter_context(WorkerPool(workers)).map
        rough_ends = list(each(partial(_run, rough, SEARCH), jobs))
        usable = [start for start in rough_ends if np.isfinite(start.objective)]
        ranked = sorted(usable, key=lambda start: (max(start.violation, FEASIBLE), start.objective))
        written = [start for start in ranked[FINALISTS:] if start.number == 0]
        finalists = [*ranked[:FINALISTS], *written]
        jobs = [(start.number, *judge.point_of(start.end)) for start in finalists]
        ends = {start.number: start for start in each(partial(_run, judge, FINISH), jobs)}
    found = []
    for start in rough_ends:  # judged at all positions
        if (end := ends.get(start.number)) is not None:
            count = start.evaluations + end.evaluations
            start = replace(end, begin=start.begin, evaluations=count)
        elif np.isfinite(start.objective):
            x, choice = judge.point_of(start.end)
            judged = judge(x, choice)
            violation = max(judged.violation, _between(judge, x, choice)[0])
            start = replace(start, objective=judged.objective, violation=violation)
        found.append(start)
    return found


class _Problem:
    """Objective and constraints in scaled coordinates, each evaluated once."""

    def __init__(self, judge: Judge, choice: dict[str, float]) -> None:
        self.judge, self.choice = judge, choice
        self.extra: list[float] = []
        self.span = judge.upper - judge.lower
        self.evaluations = 0
        self.known: tuple[bytes, Judgement | None] = (b"", None)

    def __call__(self, u: Floats) -> Judgement | None:
        """Judgement at u in [0, 1], with gradients by u; None where nothing can be assembled."""
        key = u.tobytes()
        if self.known[0] != key:
            self.evaluations += 1
            try:
                found = self.judge(self.judge.lower + u * self.span, self.choice, self.extra)
                names = "jacobian", "amount_slopes", "slopes"
                by_u = {name: getattr(found, name) * self.span for name in names}
                self.known = key, replace(found, **by_u)
            except InputError:
                self.known = key, None
        return self.known[1]

    def add(self, shares: Sequence[float]) -> None:
        """Hold constraints at further positions."""
        self.extra += shares
        self.known = b"", None


def _between(
    judge: Judge, x: Floats, choice: dict[str, float], known_breach: float = 0.0
) -> tuple[float, list[float]]:
    """Largest breach of a constraint at any position, and where it is larger than a known one."""
    breaches = [(is_firm(name), *least) for name, least in judge.least(x, choice).items()]
    most = max((float(breach(margin, fixed)) for fixed, margin, _ in breaches), default=0.0)
    allowed = [0.1 * FEASIBLE + (not fixed) * known_breach for fixed, _, _ in breaches]
    return most, [s for (_, m, s), limit in zip(breaches, allowed, strict=True) if -m > limit]


def _run(judge: Judge, effort: Effort, job: tuple[int, Floats, dict[str, float]]) -> Start:
    """One start, of a number, from begin to end."""
    index, begin, choice = job
    problem = _Problem(judge, choice)
    u = np.clip((begin - judge.lower) / problem.span, 0.0, 1.0)
    values = judge.by_name(begin) | choice
    here = problem(u)
    if here is None:
        return Start(index, values, values, np.nan, np.nan, problem.evaluations)
    u, here = _rounds(problem, u, here, effort)
    violation = here.violation
    for left in reversed(range(effort.checks)):
        x, known = judge.lower + u * problem.span, here.violation * (here.violation > FEASIBLE)
        most, shares = _between(judge, x, choice, known)
        violation = max(here.violation, most)
        if not left or not shares:
            break
        problem.add(shares)
        judged = problem(u)
        if judged is None:
            break
        u, here = _rounds(problem, u, judged, effort)
    end = judge.by_name(judge.lower + u * problem.span) | choice
    return Start(index, values, end, here.objective, violation, problem.evaluations)


def _rounds(
    problem: _Problem, u: Floats, here: Judgement, effort: Effort
) -> tuple[Floats, Judgement]:
    """Rounds of the search until nothing improves."""
    steps = effort.steps
    for _ in range(effort.rounds):
        new = _round(problem, u, here, steps)
        after = problem(new)
        if after is None:
            break
        if after.violation > max(here.violation, FEASIBLE):  # SLSQP ends a trifle outside
            new, after = _least_breach(problem, new, after)
        worse = after.violation > max(here.violation, FEASIBLE)
        gain = here.objective - after.objective
        if worse or (here.violation <= FEASIBLE and gain <= 0.0):
            if (steps := steps // 4) == 0:
                break
            continue  # not as far: a curved way may have led off the limits
        small = gain <= effort.gain * abs(here.objective) + 1e-14
        settled = small and here.violation - after.violation <= FEASIBLE
        u, here, steps = new, after, effort.steps
        if settled:
            break
    if here.violation > FEASIBLE:
        u, here = _least_breach(problem, u, here)
    return u, here


def _round(problem: _Problem, u0: Floats, here: Judgement, steps: int) -> Floats:
    """A round of SLSQP in coordinates z with u = u0 + S z, S from the Gauss-Newton matrix."""
    scale = max(here.objective, 1e-12)
    m = len(u0)
    J = here.jacobian / np.sqrt(0.5 * scale)
    # directions that the residuals do not feel keep the scale of the bounds
    damping = 1e-3 * max(float(np.linalg.norm(J, 2)), 1e-3) if np.any(J) else 1.0
    R = np.linalg.qr(np.vstack((J, damping * np.eye(m))), mode="r")
    S = np.linalg.inv(R)

    bounded = here.amounts.size * (here.peak > 0.0)  # by a variable y[m], in units of `scale`
    further = np.zeros(min(bounded, 1))

    def judgement_at(y: Floats) -> Judgement | None:
        return problem(np.clip(u0 + S @ y[:m], 0.0, 1.0))

    def objective(y: Floats) -> float:
        found = judgement_at(y)
        if found is None:
            return REFUSED
        return float(found.residuals @ found.residuals / scale + np.sum(y[m:]))

    def gradient(y: Floats) -> Floats:
        slope = S.T @ (judgement_at(y) or here).square_gradient / scale
        return np.append(slope, further + 1.0)

    def margins(y: Floats) -> Floats:
        found = judgement_at(y)
        u = u0 + S @ y[:m]
        inner = -np.ones_like(here.margins) if found is None else found.margins
        below = np.sum(y[m:]) - (found or here).amounts[:bounded] / scale
        return np.concatenate((inner, u, 1.0 - u, below))

    def slopes(y: Floats) -> Floats:
        known = judgement_at(y) or here
        rows = np.vstack((known.slopes @ S, S, -S, -known.amount_slopes[:bounded] @ S / scale))
        column = np.repeat((0.0, 1.0), (len(rows) - bounded, bounded))
        return np.column_stack((rows, column))[:, : m + len(further)]

    inequality: Any = {"type": "ineq", "fun": margins, "jac": slopes}
    how: Any = {"method": "SLSQP", "options": {"maxiter": steps, "ftol": 1e-10}}
    begin = np.append(np.zeros(m), further + here.peak / scale)
    found: Any = minimize(objective, begin, jac=gradient, constraints=inequality, **how)
    end: Floats = np.clip(u0 + S @ found.x[:m], 0.0, 1.0)
    return end


def _least_breach(problem: _Problem, u0: Floats, here: Judgement) -> tuple[Floats, Judgement]:
    """Parameters with the smallest breach t: least t with every margin above -t, firm ones 0."""
    m, yields = len(u0), 1.0 - np.broadcast_to(here.firm, here.margins.shape)

    def margins(y: Floats) -> Floats:
        found = problem(y[:m])
        inner = -10.0 * np.ones_like(here.margins) if found is None else found.margins
        moved: Floats = inner + y[m] * yields
        return moved

    def slopes(y: Floats) -> Floats:
        found = problem(y[:m]) or here
        return np.hstack((found.slopes, yields[:, None]))

    inequality: Any = {"type": "ineq", "fun": margins, "jac": slopes}

    def size(y: Floats) -> tuple[float, Floats]:
        return float(y[m]), np.eye(m + 1)[m]

    bounds = Bounds(np.zeros(m + 1), np.append(np.ones(m), np.inf))
    how: Any = {"method": "SLSQP", "bounds": bounds, "options": {"maxiter": 100, "ftol": 1e-9}}
    start = np.append(u0, max(0.0, -np.min(here.margins)))
    found: Any = minimize(size, start, jac=True, constraints=inequality, **how)
    u: Floats = np.clip(found.x[:m], 0.0, 1.0)
    after = problem(u)
    if after is None or after.violation >= here.violation:
        return u0, here
    return u, after
