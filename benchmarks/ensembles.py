"""Many runs per call: how much CPU time each takes, by how many there are."""

from collections.abc import Sequence
from dataclasses import replace
from statistics import median
from typing import Any

from railsim.bench.scenarios import STUDY, Scenario
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.vehicle.definition import Vehicle
from railsim.simulation import simulate_together

SIZES = (1, 2, 4, 8, 16)
COACH_IN_CURVE = replace(STUDY[0], name="")
CHANGED = (
    "assemblies.bogie.elements.anti_roll_bar.stiffness=940e3",
    "assemblies.bogie.elements.secondary_lateral_damper.damping=32e3",
    "assemblies.bogie.elements.secondary_vertical_damper.damping=20e3",
)


def variants(vehicle: str, number: int) -> list[Vehicle]:
    """Coaches with anti-roll bars and secondary dampers from 80 % upwards, 2.5 % apart."""
    factors = [0.8 + 0.025 * k for k in range(number)]
    keys = [change.split("=") for change in CHANGED]
    return [
        load_vehicle(vehicle, [f"{key}={factor * float(value)!r}" for key, value in keys])
        for factor in factors
    ]


def ensembles(
    sizes: Sequence[int] = SIZES, repetitions: int = 3, scenario: Scenario = COACH_IN_CURVE
) -> list[dict[str, Any]]:
    """Run ensembles of several sizes.

    Returns
    -------
    list of dict
        For each size: `members`; simulated seconds of all members per CPU second of the time loop,
        `real_time` (median), `real_time_best` and `real_time_all`; `cpu_per_step` of one member.
    """
    track = load_track(scenario.track)
    vehicles = variants(scenario.vehicle, max(sizes))
    factors: dict[int, list[float]] = {size: [] for size in sizes}
    step = 0.0
    for _ in range(repetitions):  # sizes in turn: what disturbs the machine disturbs all of them
        for size in sizes:
            facts = [
                result.attributes
                for result in simulate_together(
                    vehicles[:size], track, speed=scenario.speed, until=scenario.until
                )
            ]
            step = float(facts[0]["step"])
            simulated = sum(float(fact["duration"]) for fact in facts)
            factors[size].append(simulated / sum(float(fact["cpu_time"]) for fact in facts))
    return [
        {
            "members": size,
            "real_time": median(found),
            "real_time_best": max(found),
            "real_time_all": found,
            "cpu_per_step": step / max(found),
        }
        for size, found in factors.items()
    ]
