"""Rows of values for the keys of the files of a study: grids, linked keys, samples."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from railsim.definitions.study.definition import Sample, Spread
from railsim.errors import argument_error
from railsim.files.key_paths import telling_end
from railsim.units import speed_in_si

Grid = Mapping[str, Sequence[str]]
SPEED = "speed"  # not a key of a file: the speed of the run
PERMITTED = "permitted"  # as a speed: the lower of the speeds of vehicle and track


@dataclass(frozen=True)
class Row:
    """Values of the varied keys of one run."""

    values: Mapping[str, str]  # texts as in `key=value`, by the paths of the keys
    suffix: str  # to the name of the run
    speed: float | None = None  # of the run if the row varies it [m/s]


def combined_rows(grid: Grid, linked: Sequence[Grid], sample: Sample | None) -> list[Row]:
    """Return all combinations: the grid outermost, then linked keys, then the sample."""
    combined = [dict(zip(grid, values, strict=True)) for values in product(*grid.values())]
    for table in linked:
        each = zip(*table.values(), strict=True)
        together = [dict(zip(table, values, strict=True)) for values in each]
        combined = [{**row, **linked_values} for row in combined for linked_values in together]
    members = [("", dict[str, str]())]
    if sample is not None:
        draws = draw_sample(sample)
        width = len(str(len(draws)))
        members = [(f"_sample={n:0{width}d}", values) for n, values in enumerate(draws, start=1)]
    rows = []
    for row in combined:
        name = suffix({key: value for key, value in row.items() if key != SPEED})
        for ending, sample_values in members:
            values = {**row, **sample_values}
            speed = values.pop(SPEED, None)
            rows.append(Row(values, name + ending, None if speed is None else speed_of(speed)))
    return rows


SPEEDS = "such as 20 or 72km/h; blanks between several"


def speed_of(text: str) -> float:
    """Return the speed of a text, perhaps with a unit [m/s]; raises InputError: it is no number."""
    speed = speed_in_si(text)
    if isinstance(speed, str):
        raise argument_error("speeds", f"'{text}' is not a speed", SPEEDS)
    return float(speed)


def draw_sample(sample: Sample) -> list[dict[str, str]]:
    """Return the values of a sample, one mapping for each of its members.

    Latin hypercube and Sobol's sequence by scipy: the values of each parameter are stratified over
    its probability, for any number of parameters (McKay, Beckman and Conover 1979; Sobol 1967,
    scrambled after Owen).
    """
    from scipy.stats import qmc

    count = len(sample.parameters)
    engine = qmc.Sobol if sample.method == "sobol" else qmc.LatinHypercube
    spreads = sample.parameters.values()
    rows = engine(d=count, seed=sample.seed).random(sample.number).tolist()
    values = ([f"{number:.10g}" for number in map(quantile, spreads, row)] for row in rows)
    return [dict(zip(sample.parameters, row, strict=True)) for row in values]


def quantile(spread: Spread, share: float) -> float:
    """Return the value of a parameter below which `share` of its values lie.

    >>> quantile(Spread(low=1.0, high=100.0, scale="log"), 0.5)
    10.0
    >>> quantile(Spread(nominal=200.0, tolerance=0.1), 0.75)
    210.0
    """
    if spread.low is not None and spread.high is not None:
        if spread.scale == "log":
            return float(f"{spread.low * (spread.high / spread.low) ** share:.12g}")
        return spread.low + (spread.high - spread.low) * share
    if spread.nominal is not None and spread.tolerance is not None:
        return spread.nominal * (1.0 + spread.tolerance * (2.0 * share - 1.0))
    assert spread.mean is not None  # one of the three is given
    assert spread.deviation is not None
    from scipy.special import ndtri

    # a sample may contain the end of the range, whose value is infinite
    inside = min(max(share, math.ulp(0.5)), 1.0 - math.ulp(0.5))
    return spread.mean + spread.deviation * float(ndtri(inside))


def suffix(point: Mapping[str, str]) -> str:
    """Return the suffix of a point of the grid to the name of its run.

    >>> suffix({"track.friction": "0.3", "settings.drive.speed_table.0.1": "12"})
    '_friction=0.3_speed_table.0.1=12'
    >>> suffix({"vehicle.a.stiffness.x": "2e6", "vehicle.b.stiffness.x": "3e6"})
    '_a.stiffness.x=2e6_b.stiffness.x=3e6'
    """
    # parts of the key from the last that is no index
    least = {key: len(re.split(r"\.(?=[^.]*[^.\d])", key)[-1].split(".")) for key in point}
    ends = {key: telling_end(key, point, least[key]) for key in point}
    return "".join("_" + in_a_name(f"{ends[key]}={value}") for key, value in point.items())


def in_a_name(text: str) -> str:
    """Return a text in a form for file names, which cannot point to another folder.

    >>> in_a_name("[10, 20]"), in_a_name("../other")
    ('10-20', '..-other')
    """
    return re.sub(r"[^\w.+=-]+", "-", re.sub(r"[\[\]{}\"' ]", "", text))
