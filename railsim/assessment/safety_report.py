"""Derailment and overturning over a whole run, wheel by wheel and bogie by bogie, unfiltered."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from railsim.assessment.record import Record
from railsim.assessment.safety import climb_distance, flange_angle, nadal, overturning
from railsim.definitions.vehicle.flatten import flatten
from railsim.notation import SIDES

HALF_BASE = 0.75  # m, from the middle of the axle to the nominal rolling circle


@dataclass(frozen=True)
class WheelSafety:
    """Nadal's limit and climb distance of one wheel.

    `limit`: Nadal's limit of Y/Q for the flange angle of the profile and the friction of the track
    [1]. `Y_over_Q`: Largest derailment quotient, unfiltered [1]; nan where the wheel was without
    load. `climb_distance`, `climb_begin`, `rise`: Longest distance above the limit, position of
    its beginning, rise of the wheel on it [m].
    """

    place: str  # wheelset, from 1, and side
    limit: float
    Y_over_Q: float
    climb_distance: float
    climb_begin: float
    rise: float


@dataclass(frozen=True)
class SafetyReport:
    """Derailment and overturning of a run.

    `overturning`: Largest magnitude of (sum Q_left - sum Q_right)/(sum Q) by bogie [1].
    """

    wheels: tuple[WheelSafety, ...]
    overturning: dict[str, float]

    def record(self) -> dict[str, Any]:
        """Return it as plain numbers and strings, SI."""
        return {"wheels": [*map(asdict, self.wheels)], "overturning": self.overturning}


def safety_report(record: Record) -> SafetyReport:
    """Nadal, climb distance and overturning over a run.

    `record`: Run with Q, Y_over_Q, wheelset_distance and body_position.
    """
    needed = ["Q", "Y_over_Q", "wheelset_distance"]
    record.need(needed, f"settings.outputs.quantities with {', '.join(needed)}")
    result = record.result
    track, wheels = result.track(), []
    flat = flatten(result.vehicle())
    wheelsets = [w.wheelset for w in flat.of_kind("wheelset") if w.wheelset]
    quotient, s = result["Y_over_Q"], result["wheelset_distance"]
    for w, wheelset in enumerate(wheelsets):
        for k, side in enumerate(SIDES):
            angle = flange_angle(result.profiles[wheelset.profile[k]])
            limit = nadal(angle, track.friction[k])
            climb = climb_distance(s[:, w], quotient[:, w, k], limit, _height(record, w, k))
            # nan where the wheel was lifted
            own = f"wheelset {w + 1} {side}", limit, float(np.max(quotient[:, w, k]))
            wheels.append(WheelSafety(*own, climb.length, climb.begin, climb.rise))
    Q = result["Q"]
    tilt = {name: np.abs(overturning(Q[:, own])) for name, own in record.bogies.items()}
    return SafetyReport(tuple(wheels), {name: float(np.max(x)) for name, x in tilt.items()})


def _height(record: Record, w: int, side: int) -> np.ndarray:
    """Height of a wheel above its rail, from position and roll of the wheelset [m].

    Relative to the irregularities of the rails where the result has them.
    """
    result = record.result
    if "body_position" not in result:
        return np.zeros(len(record.time))
    position = result["body_position"][:, result.bodies.index(result.wheelsets[w])]
    outwards = (-1.0, 1.0)[side]
    height = -(position[:, 2] + outwards * HALF_BASE * position[:, 3])
    if "rail_vertical" in result:
        height = height + result["rail_vertical"][:, w, side]
    return np.asarray(height)
