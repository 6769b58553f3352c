"""Study files, `railsim-study/1`: what is combined, linked and sampled, under version control."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from railsim.definitions import base
from railsim.definitions.file_definition import FileDefinition
from railsim.definitions.study.analyses import Analysis, needs_speed
from railsim.definitions.study.design import Optimise
from railsim.units import range_values

Value = (
    base.Flag
    | Annotated[int, Field(strict=True)]
    | base.Finite
    | base.Text
    | tuple[base.Finite | base.Text, ...]
)
Values = base.Text | Annotated[tuple[Value, ...], Field(min_length=1)]


def value_texts(values: Values) -> list[str]:
    """Return values as `key=value` takes them: those of ranges, and one for each other of a list.

    Raises ValueError: a range that is none.

    >>> value_texts("0.2:0.4:3"), value_texts((True, "1:2:2", "72 km/h", (10, 20)))
    (['0.2', '0.3', '0.4'], ['true', '1', '2', '72 km/h', '[10, 20]'])
    """
    if isinstance(values, str):
        numbers = range_values(values)
        return [values] if numbers is None else [f"{value:.12g}" for value in numbers]
    return [text for v in values
            for text in (value_texts(v) if isinstance(v, str) else [_text(v)])]  # fmt: skip


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return f"[{', '.join(_text(member) for member in value)}]"
    return f"{value:.12g}" if isinstance(value, float) else str(value)


class Spread(base.Definition):
    """How a sampled parameter is spread: between two ends, by a tolerance, or normally."""

    low: base.Finite | None = None
    """Smallest value [SI]"""
    high: base.Finite | None = None
    """Largest value [SI]"""
    scale: Literal["linear", "log"] = "linear"
    """Equal probability of equal differences, or of equal ratios, between `low` and `high`"""
    nominal: base.Finite | None = None
    """Value that has the `tolerance` [SI]"""
    tolerance: base.Positive | None = None
    """Half the range over the nominal value: all values within it are equally probable [1]"""
    mean: base.Finite | None = None
    """Mean of a normal distribution [SI]"""
    deviation: base.Positive | None = None
    """Its standard deviation [SI]"""

    @base.check
    def _one_way(self) -> None:
        pairs = ((self.low, self.high), (self.nominal, self.tolerance), (self.mean, self.deviation))
        whole = [None not in pair for pair in pairs]
        begun = [pair != (None, None) for pair in pairs]
        if sum(whole) != 1 or begun != whole:
            raise ValueError(
                "one of 'low' and 'high', 'nominal' and 'tolerance', 'mean' and 'deviation' is "
                "needed"
            )
        if self.low is not None and self.high is not None:
            if not self.low < self.high:
                raise ValueError("'low' must be below 'high'")
            if self.scale == "log" and not self.low * self.high > 0.0:
                raise ValueError('scale = "log" needs two ends of the same sign, neither zero')


class Sample(base.Definition):
    """Random values of several parameters at once."""

    method: Literal["latin_hypercube", "sobol"] = "latin_hypercube"
    """Latin hypercube, or the scrambled sequence of Sobol"""
    number: base.Count
    """How many values of each parameter; a power of two for `sobol`"""
    seed: base.Whole = 0
    """Where the random numbers begin: the same seed gives the same sample"""
    parameters: Annotated[dict[base.Text, Spread], Field(min_length=1)]
    """Parameters by their paths, or `speed`"""

    @base.check
    def _balanced(self) -> None:
        if self.method == "sobol" and self.number & (self.number - 1):
            raise ValueError("'number' must be a power of two for method = \"sobol\"")


class Study(FileDefinition):
    """A study: everything that its file says."""

    KIND: ClassVar = "study"
    OPEN_TABLES: ClassVar = ("grid",)

    format: Literal["railsim-study/1"]
    name: base.Text
    """What the study is called"""
    purpose: base.Text | None = None
    """What it is for"""
    vehicles: Annotated[tuple[base.Text, ...], Field(min_length=1)]
    """Vehicles: files or names of shipped ones"""
    tracks: Annotated[tuple[base.Text, ...], Field(min_length=1)]
    """Tracks: files or names of shipped ones"""
    speeds: Values | None = None
    """Speeds: a list or a range [m/s, or with a unit]; not where `speed` is linked or sampled"""
    settings: base.Text | None = None
    """Settings file for all runs"""
    start: base.Finite = 0.0
    """Start of all runs along the track [m]"""
    duration: base.Positive | None = None
    """End of all runs: time [s]"""
    until: base.NonNegative | None = None
    """End of all runs: distance [m]"""
    assignments: tuple[base.Text, ...] = ()
    """`key.path=value` for all runs, the paths beginning with `vehicle.`, `track.`, `settings.`"""
    grid: dict[base.Text, Values] = base.EMPTY_TABLE
    """Values of further keys: all combinations"""
    linked: tuple[dict[base.Text, Values], ...] = ()
    """Keys whose values go together: the first of one with the first of the others"""
    sample: Sample | None = None
    """Random values of further keys"""
    analyses: dict[base.Name, Analysis] = base.EMPTY_TABLE
    """What is done at each point, by any name; by default a run"""
    optimise: Optimise | None = None
    """Variables, objectives and constraints of `railsim optimise`"""

    @property
    def runs(self) -> int:
        """Number of its runs."""
        lists = [len(value_texts(values)) for values in self.grid.values()]
        lists += [len(value_texts(next(iter(table.values())))) for table in self.linked if table]
        lists += [len(value_texts(self.speeds))] if self.speeds is not None else []
        lists += [self.sample.number] if self.sample else []
        return math.prod([len(self.vehicles), len(self.tracks), *lists])

    @base.check
    def _consistent(self) -> None:
        for name, values in [*self.grid.items(), *(p for t in self.linked for p in t.items())]:
            try:
                value_texts(values)
            except ValueError as error:
                raise ValueError(f"'{name}': {error}") from None
        for table in self.linked:
            if not table:
                raise ValueError("a table of linked keys is empty")
            lengths = {name: len(value_texts(values)) for name, values in table.items()}
            if len(set(lengths.values())) != 1:
                text = ", ".join(f"'{name}' {length}" for name, length in lengths.items())
                raise ValueError(f"linked keys need equally many values: {text}")
        names = [*self.grid, *(name for table in self.linked for name in table)]
        names += list(self.sample.parameters) if self.sample else []
        names += self.optimise.keys if self.optimise else []
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"'{twice[0]}' is varied twice")
        sources = (self.speeds is not None) + ("speed" in names)
        if sources > 1 or (not sources and needs_speed(self.analyses)):
            raise ValueError("'speeds' is needed, or 'speed' linked or sampled; not both")
