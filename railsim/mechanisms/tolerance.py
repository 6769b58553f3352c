"""What tolerances of the parameters do: scatter of length, stroke, ratio and force.

First order: deviations are derivatives times tolerances; random scatter is the root of the sum of
squares (independent deviations), the worst case the sum of amounts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.values import number, parameter_values
from railsim.mechanisms.forces import Rates, generalised_force, unit_work
from railsim.mechanisms.kinematics import derivative, solve, tangents
from railsim.mechanisms.model import build
from railsim.mechanisms.outputs import length_points, zone_drivers
from railsim.mechanisms.quantities import force_unit


@dataclass(frozen=True)
class Scatter:
    """Scatter of one result."""

    name: str
    unit: str
    value: float  # nominal
    random: float  # root of the sum of squares
    worst: float  # sum of amounts
    single: Mapping[str, float]  # change by each parameter's tolerance, with its sign


def sensitivities(
    definition: Mechanism, names: Sequence[str]
) -> dict[str, tuple[str, float, dict[str, float]]]:
    """Results with their exact derivatives by parameters: unit, value, derivatives by name.

    Length at the start, stroke; ratio and force at start, work height (same driver) and end.
    """
    model = build(definition)
    at = {"start": model.start, "end": model.end}
    if definition.zone is not None:
        dense = solve(model, np.linspace(model.start, model.end, 401))
        at = {"start": model.start, "work": zone_drivers(dense)["work"], "end": model.end}
    s, moved = np.array(list(at.values())), model.lanes(list(names))
    # the ends go with their parameters, the position of work stays
    drift = np.isin(list(at), ("start", "end")) * moved.drift(s)
    motion = tangents(solve(model, s), moved, drift=drift)
    found: dict[str, tuple[str, float, dict[str, float]]] = {}

    def add(name: str, unit: str, value: Any) -> None:
        slopes = dict(zip(names, derivative(value).tolist(), strict=True))
        found[name] = (unit, float(np.real(value)[0]), slopes)

    if (pair := length_points(definition)) is not None:
        length, rate, _ = motion.length(pair)
        add("length_start", "m", length[:, 0])
        add("stroke", "m", length[:, -1] - length[:, 0])
        if definition.output is not None:
            ratio = motion.point(definition.output.point)[1][..., model.axis] / rate
            for i, label in enumerate(at):
                add(f"ratio_{label}", "1", ratio[:, i])
    if definition.solve is not None:
        work = unit_work(motion, definition.held_by)
        force = -generalised_force(motion, Rates(friction=model.sense)) / work
        for i, label in enumerate(at):
            unit = force_unit(definition.unknown, definition)
            add(f"force_{label}", unit, force[:, i])
    return found


def scatter(definition: Mechanism) -> list[Scatter]:
    """Scatter of a mechanism's results by the file's tolerances."""
    values = parameter_values(definition)
    tolerances = {name: float(number(t, values)) for name, t in definition.tolerances.items()}
    found = []
    for name, (unit, value, slopes) in sensitivities(definition, list(tolerances)).items():
        single = {p: slope * tolerances[p] for p, slope in slopes.items()}
        amounts = np.array(list(single.values()))
        random, worst = np.linalg.norm(amounts), np.sum(np.abs(amounts))
        found.append(Scatter(name, unit, value, float(random), float(worst), single))
    return found
