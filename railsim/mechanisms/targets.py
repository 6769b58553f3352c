"""What an optimisation compares with: ratios of a reference at given heights of the output."""

from dataclasses import dataclass
from fnmatch import fnmatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.loading import load_mechanism
from railsim.definitions.mechanism import Mechanism
from railsim.definitions.mechanism_values import ends, parameter_values
from railsim.errors import Fault, InputError
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.model import Model, build
from railsim.mechanisms.outputs import actuator_of, height_drivers, height_of, zone_drivers

Floats = NDArray[np.float64]
DENSE = 401


@dataclass(frozen=True)
class Positions:
    """Positions of a mechanism at which it is judged, all (position,).

    Attributes
    ----------
    s : ndarray
        Driver [rad or m].
    height : ndarray
        Height of the output over the start [m].
    ratio : ndarray
        Height over actuator length, derivative.
    """

    s: Floats
    height: Floats
    ratio: Floats

    @property
    def share(self) -> Floats:
        """Share of the whole range at which they are; of positions over the whole range."""
        found: Floats = (self.s - self.s[0]) / (self.s[-1] - self.s[0])
        return found


def reference_of(definition: Mechanism) -> Mechanism | None:
    """The reference of a mechanism's optimisation, with the parameters that it shares.

    Raises
    ------
    InputError : there is no such file, or it is wrong.
    """
    optimise = definition.optimise
    if optimise is None or optimise.reference is None:
        return None
    try:
        reference = load_mechanism(optimise.reference)
    except InputError as error:
        faults = [
            fault
            if fault.file != optimise.reference or fault.key
            else Fault(definition.name, "optimise.reference", fault.found, fault.allowed)
            for fault in error.faults
        ]
        raise InputError(faults) from None
    values = parameter_values(definition)
    shared = {
        name: float(values[name])
        for name in reference.parameters
        if name in definition.parameters
        and any(fnmatch(name, pattern) for pattern in optimise.share)
    }
    return reference.with_parameters(shared)


def positions(definition: Mechanism) -> Positions:
    """Positions that `[optimise]` judges: equal steps of length or travel over zone or travel.

    They are those of the reference where there is one, else of the mechanism itself.
    """
    optimise = definition.optimise
    assert optimise is not None
    source = reference_of(definition) or definition
    model = build(source)
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    name = actuator_of(source)
    pair = ends(source.actuators[name]) if name is not None else None
    if source.output is None or (pair is None and optimise.range == "travel"):
        # without a length or an output: equal steps of the whole travel
        s = np.linspace(model.start, model.end, optimise.points)
        height = np.zeros(len(s))
        if source.output is not None:
            height = height_of(solve(model, s))[0]
        return Positions(s, height, np.full(len(s), np.nan))
    if pair is None:
        found = f"{source.name} has no length of an actuator, or no output"
        raise InputError([Fault(definition.name, "optimise", found, "both are needed")])
    edges = np.array([model.start, model.end])
    if optimise.range == "zone":
        zoned = source.model_copy(update={"zone": definition.zone})
        values = parameter_values(definition)
        heights = np.array([_number(zoned, key, values) for key in ("low", "high")])
        edges = height_drivers(dense, heights)
        if not np.all(np.isfinite(edges)):
            zone_drivers(dense)
            found = f"{source.name} never reaches it"
            raise InputError([Fault(definition.name, "zone", found, "another zone")])
    if optimise.sample == "travel":
        s = np.linspace(edges[0], edges[1], optimise.points)
    else:
        length = solve(model, edges).length(pair)[0]
        wanted = np.linspace(length[0], length[1], optimise.points)
        s = driver_at(dense, lambda motion: motion.length(pair)[:2], wanted)
    motion = solve(model, s)
    height, ratio = heights_and_ratios(motion, pair, source.output.point)
    return Positions(s, height, ratio)


def _number(definition: Mechanism, key: str, values: Any) -> float:
    from railsim.definitions.mechanism_values import number

    return float(number(getattr(definition.zone, key), values))


def heights_and_ratios(motion: Motion, pair: Any, point: str) -> tuple[Any, Any]:
    """Height of the output over the start of the range, and its ratio to the actuator's length."""
    r, r1, _ = motion.point(point)
    k = motion.model.axis
    first = solve(motion.model, [motion.model.start]).point(point)[0][0, k]
    return r[..., k] - first, r1[..., k] / motion.length(pair)[1]


def drivers_at_heights(model: Model, heights: Floats, guess: Floats) -> Floats:
    """Values of the driver at heights of the output; from a guess where it is right already."""
    output = model.definition.output
    assert output is not None
    motion = solve(model, guess)
    k = model.axis
    first = solve(model, [model.start]).point(output.point)[0][0, k]
    error = motion.point(output.point)[0][:, k] - first - heights
    if np.max(np.abs(error)) < 1e-11:  # what is optimised does not move the output
        return guess
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    found = height_drivers(dense, heights)
    if not np.all(np.isfinite(found)):
        fault = Fault(model.definition.name, "zone", "is never reached", "other parameters")
        raise InputError([fault])
    return found


def follow_error(definition: Mechanism, reference: Positions) -> float:
    """Sum of squared differences of the ratio from a reference at equal heights."""
    name = actuator_of(definition)
    pair = ends(definition.actuators[name]) if name is not None else None
    if pair is None or definition.output is None:
        return float("nan")
    model = build(definition)
    s = drivers_at_heights(model, reference.height, reference.s)
    _, ratio = heights_and_ratios(solve(model, s), pair, definition.output.point)
    return float(np.sum((ratio - reference.ratio) ** 2))
