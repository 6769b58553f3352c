"""The table `optimise` of a study file: variables, objectives and constraints of a design."""

from typing import Annotated, Literal

from pydantic import Field

from railsim.definitions import base

FEWEST_EVOLVED = 5  # designs of a generation of differential evolution


class Variable(base.Definition):
    """A parameter that is varied between bounds."""

    low: base.Finite
    """Lower bound [SI]"""
    high: base.Finite
    """Upper bound [SI]"""
    scale: Literal["linear", "log"] = "linear"
    """Whether equal differences or equal ratios count alike"""
    also: tuple[base.Text, ...] = ()
    """Paths of further keys that get the same value"""

    @base.check
    def _rising(self) -> None:
        if not self.low < self.high:
            raise ValueError("'low' must be below 'high'")
        if self.scale == "log" and not self.low > 0.0:
            raise ValueError('scale = "log" needs bounds above zero')


class Value(base.Definition):
    """A number of a design: a quantity of the summary of its runs."""

    quantity: base.Text
    """Column of `summary.csv`, without its unit"""
    magnitude: base.Flag = False
    """Take the value without its sign"""
    where: dict[base.Text, base.Text | base.Finite] = base.EMPTY_TABLE
    """Only the runs with these labels, such as `track` or a key of the grid; by default all"""


class Objective(Value):
    """A quantity that is to be as small or as large as possible."""

    goal: Literal["minimise", "maximise"] = "minimise"
    """Whether it is to be small or large"""
    over: Literal["worst", "mean"] = "worst"
    """Worst or mean value over the runs of a design"""


class Constraint(Value):
    """A quantity that must stay within limits in all runs."""

    low: base.Finite | None = None
    """Lower limit [SI]"""
    high: base.Finite | None = None
    """Upper limit [SI]"""

    @base.check
    def _some_limit(self) -> None:
        if self.low is None and self.high is None:
            raise ValueError("'low' or 'high' is needed")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError("'low' must not be above 'high'")


class Optimise(base.Definition):
    """What `railsim optimise` seeks."""

    variables: Annotated[dict[base.Text, Variable], Field(min_length=1)]
    """Parameters by their paths, as in a grid"""
    objectives: Annotated[tuple[Objective, ...], Field(min_length=1)]
    """What is to be small or large; several give a Pareto front"""
    constraints: tuple[Constraint, ...] = ()
    """What must hold"""
    method: Literal["surrogate", "nsga2", "differential_evolution"] = "surrogate"
    """Surrogate models (few designs), genetic algorithm (pymoo), or scipy's, for one objective"""
    evaluations: base.Count = 80
    """How many designs are computed at most"""
    batch: base.Count = 8
    """How many designs are computed at a time; of a genetic algorithm, its population"""
    seed: base.Whole = 0
    """Where the random numbers begin: the same seed gives the same designs"""

    @property
    def keys(self) -> list[str]:
        """Paths of all keys that are varied."""
        return [*self.variables, *(key for v in self.variables.values() for key in v.also)]

    @property
    def values(self) -> dict[str, Value]:
        """Objectives, then constraints, by their keys in the file."""
        tables = {"objectives": self.objectives, "constraints": self.constraints}
        return {
            f"optimise.{t}.{k}": value for t, rows in tables.items() for k, value in enumerate(rows)
        }

    @base.check
    def _consistent(self) -> None:
        names = self.keys
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"'{twice[0]}' is varied twice")
        wrong = [name for name in names if not name.startswith("vehicle.")]
        if wrong:
            raise ValueError(f"'{wrong[0]}' is no key of a vehicle; paths begin with vehicle.")
        if self.method == "differential_evolution" and len(self.objectives) > 1:
            raise ValueError('method = "differential_evolution" takes one objective')
        if self.method == "differential_evolution" and self.evaluations < FEWEST_EVOLVED:
            raise ValueError(f"'evaluations' must be {FEWEST_EVOLVED} at least for this method")
