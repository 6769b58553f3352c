"""What an optimisation compares with: ratios of a reference at given heights of the output."""

from dataclasses import dataclass, replace
from fnmatch import fnmatch

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.values import number, parameter_values
from railsim.errors import InputError, input_error
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.model import Model, build
from railsim.mechanisms.outputs import equal_lengths, height_of, length_points, zone_drivers

DENSE = 401


@dataclass(frozen=True)
class Positions:
    """Positions of a mechanism at which it is judged, all (position,)."""

    s: Floats  # driver [rad or m]
    height: Floats  # of the output over the start [m]
    ratio: Floats  # height over actuator length, derivative

    @classmethod
    def of(cls, motion: Motion, pair: tuple[str, str]) -> "Positions":
        """Heights, and ratios to the length between two points, at positions of a mechanism."""
        height, rate = height_of(motion)
        return cls(motion.s, height, rate / motion.length(pair)[1])

    @property
    def share(self) -> Floats:
        """Share of the whole range at which they are; of positions over the whole range."""
        found: Floats = (self.s - self.s[0]) / (self.s[-1] - self.s[0])
        return found


def reference_of(definition: Mechanism) -> Mechanism | None:
    """The reference of an optimisation with the parameters that it shares; raises InputError."""
    optimise = definition.optimise
    if optimise is None or optimise.reference is None:
        return None
    try:
        reference = load_mechanism(optimise.reference)
    except InputError as error:
        own = [f.file == optimise.reference and not f.key for f in error.faults]
        here = {"file": definition.name, "key": "optimise.reference"}
        each = zip(error.faults, own, strict=True)
        raise InputError(replace(f, **here) if ours else f for f, ours in each) from None
    values = parameter_values(definition)
    both = [name for name in reference.parameters if name in definition.parameters]
    shared = [n for n in both if any(fnmatch(n, pattern) for pattern in optimise.share)]
    return reference.with_parameters({name: float(values[name]) for name in shared})


def positions(definition: Mechanism) -> Positions:
    """Positions that `[optimise]` judges: equal steps of length or travel over zone or travel.

    They are those of the reference where there is one, else of the mechanism itself.
    """
    optimise = definition.optimise
    assert optimise is not None
    source = reference_of(definition) or definition
    model = build(source)
    pair = length_points(source)
    if source.output is None or (pair is None and optimise.range == "travel"):
        # without a length or an output: equal steps of the whole travel
        s = np.linspace(model.start, model.end, optimise.points)
        height = np.zeros(len(s)) if source.output is None else height_of(solve(model, s))[0]
        return Positions(s, height, np.full(len(s), np.nan))
    if pair is None:
        found = f"{source.name} has no length of an actuator, or no output"
        raise input_error(definition.name, found, "both are needed", "optimise")
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    edges = np.array([model.start, model.end])
    if optimise.range == "zone":
        assert definition.zone is not None
        values = parameter_values(definition)
        heights = [number(h, values) for h in (definition.zone.low, definition.zone.high)]
        edges = driver_at(dense, height_of, heights)
        if not np.all(np.isfinite(edges)):
            zone_drivers(dense)
            found = f"{source.name} never reaches it"
            raise input_error(definition.name, found, "another zone", "zone")
    if optimise.sample == "travel":
        s = np.linspace(edges[0], edges[1], optimise.points)
    else:
        dense = solve(model, np.linspace(edges[0], edges[1], DENSE))  # no other way to a length
        s = equal_lengths(dense, pair, dense.length(pair)[0][[0, -1]], optimise.points)
    return Positions.of(solve(model, s), pair)


def drivers_at_heights(model: Model, heights: Floats, guess: Floats) -> Floats:
    """Values of the driver at heights of the output; from a guess where it is right already."""
    error = height_of(solve(model, guess))[0] - heights
    if np.max(np.abs(error)) < 1e-11:  # what is optimised does not move the output
        return guess
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    found = driver_at(dense, height_of, heights)
    if not np.all(np.isfinite(found)):
        raise model.refusal("zone", "is never reached", "other parameters")
    return found


def follow_error(definition: Mechanism, reference: Positions) -> float:
    """Sum of squared differences of the ratio from a reference at equal heights."""
    pair = length_points(definition)
    if pair is None or definition.output is None:
        return float("nan")
    model = build(definition)
    s = drivers_at_heights(model, reference.height, reference.s)
    ratio = Positions.of(solve(model, s), pair).ratio
    return float(np.sum((ratio - reference.ratio) ** 2))
