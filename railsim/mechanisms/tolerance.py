"""What tolerances of the parameters do: scatter of length, stroke, ratio and force.

First order: deviations are derivatives times tolerances; random scatter is the root of the sum of
squares (independent deviations), the worst case the sum of amounts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.mechanism import Mechanism
from railsim.definitions.mechanism_values import ends, number, parameter_values
from railsim.mechanisms.forces import Rates, generalised_force, unit_work
from railsim.mechanisms.kinematics import Motion, derivative, solve, tangents
from railsim.mechanisms.model import build
from railsim.mechanisms.outputs import actuator_of, zone_drivers


@dataclass(frozen=True)
class Scatter:
    """Scatter of one result.

    Attributes
    ----------
    name, unit : str
    value : float
        Nominal.
    random, worst : float
        Root of the sum of squares, sum of amounts.
    single : dict of str to float
        Change by each parameter's tolerance, with its sign.
    """

    name: str
    unit: str
    value: float
    random: float
    worst: float
    single: Mapping[str, float]


def sensitivities(
    definition: Mechanism, names: Sequence[str]
) -> dict[str, tuple[str, float, dict[str, float]]]:
    """Results with their exact derivatives by parameters: unit, value, derivatives by name.

    Length at the start, stroke; ratio and force at start, work height (same driver) and end.
    """
    model = build(definition)
    s = [model.start, model.end]
    labels = ["start", "end"]
    if definition.zone is not None:
        dense = solve(model, np.linspace(model.start, model.end, 401))
        zone, drivers = zone_drivers(dense)
        s = [model.start, float(drivers[zone.index("work")]), model.end]
        labels = ["start", "work", "end"]
    motion = tangents(solve(model, s), model.lanes(list(names)))
    found: dict[str, tuple[str, float, dict[str, float]]] = {}

    def add(name: str, unit: str, value: Any) -> None:
        slopes = dict(zip(names, derivative(value).tolist(), strict=True))
        found[name] = (unit, float(np.real(value)[0]), slopes)

    actuator = actuator_of(definition)
    pair = ends(definition.actuators[actuator]) if actuator is not None else None
    if pair is not None:
        length, rate, _ = motion.length(pair)
        add("length_start", "m", length[:, 0])
        add("stroke", "m", length[:, -1] - length[:, 0])
        if definition.output is not None:
            ratio = motion.point(definition.output.point)[1][..., model.axis] / rate
            for i, label in enumerate(labels):
                add(f"ratio_{label}", "1", ratio[:, i])
    if definition.solve is not None:
        force = _force(motion, definition.solve.unknown)
        for i, label in enumerate(labels):
            add(f"force_{label}", "N", force[:, i])
    return found


def _force(motion: Motion, unknown: str) -> Any:
    work = unit_work(motion, motion.model.definition.actuators[unknown])
    return -generalised_force(motion, Rates(friction=motion.model.sense)) / work


def scatter(definition: Mechanism) -> list[Scatter]:
    """Scatter of a mechanism's results by the file's tolerances."""
    values = parameter_values(definition)
    tolerances = {name: float(number(t, values)) for name, t in definition.tolerances.items()}
    found = []
    for name, (unit, value, slopes) in sensitivities(definition, list(tolerances)).items():
        single = {p: slope * tolerances[p] for p, slope in slopes.items()}
        amounts = np.array(list(single.values()))
        random = float(np.sqrt(np.sum(amounts**2)))
        worst = float(np.sum(np.abs(amounts)))
        found.append(Scatter(name, unit, value, random, worst, single))
    return found
