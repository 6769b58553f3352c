"""The assessed quantities: how each is estimated, which verdict it belongs to, and its limit."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railsim.assessment.statistics import Estimate
from railsim.definitions.flatten import flatten
from railsim.definitions.limits import RunningLimits, Sourced
from railsim.definitions.vehicle import Vehicle
from railsim.definitions.vehicle_tables import Service
from railsim.result.filters import Floats

SAFETY, LOADING, RIDE, INFORMATION = "safety", "loading", "ride", "information"
CRITERIA = (SAFETY, LOADING, RIDE)
WORDS = {
    SAFETY: "running safety", LOADING: "track loading", RIDE: "ride",
    INFORMATION: "for information",
}  # fmt: skip
BOTH, NORMAL, SIMPLIFIED = ("normal", "simplified"), ("normal",), ("simplified",)
TABLES = (*CRITERIA, INFORMATION)


@dataclass(frozen=True)
class Rule:
    """How a quantity is assessed.

    Attributes
    ----------
    name : str
        Key in the limits and in the section values.
    kind : str
        Type of the statistics; ``largest`` and ``smallest``: no estimate, the extreme value.
    group : str
        ``safety``, ``loading`` or ``ride``: the verdict to which it belongs; ``information``: none.
    methods : tuple of str
        ``normal``, with wheel forces, and ``simplified``, with accelerations.
    words, unit : str
        Name and unit in tables.
    scale : float
        Factor from SI to the unit in tables.
    """

    name: str
    kind: str
    group: str
    methods: tuple[str, ...]
    words: str
    unit: str
    scale: float = 1.0

    def text(self, value: float) -> str:
        """Value in the unit of tables."""
        return f"{self.scale * value:.3f}" if self.scale == 1.0 else f"{self.scale * value:.2f}"


def _kN(name: str, kind: str, group: str, words: str) -> Rule:
    return Rule(name, kind, group, NORMAL, words, "kN", 1e-3)


def _acceleration(
    name: str, kind: str, words: str, group: str = RIDE, methods: tuple[str, ...] = BOTH
) -> Rule:
    return Rule(name, kind, group, methods, words, "m/s2")


RULES = (
    _kN("sum_Y", "safety", SAFETY, "track shift force, 2 m"),
    Rule("Y_over_Q", "safety", SAFETY, NORMAL, "derailment quotient, 2 m", "-"),
    _kN("instability", "largest", SAFETY, "rms of track shift force, 100 m"),
    _kN("Q", "loading", LOADING, "wheel load"),
    _kN("Q_qst", "quasi_static", LOADING, "quasi-static wheel load"),
    _kN("Y_qst", "quasi_static", LOADING, "quasi-static guiding force"),
    _acceleration("body_y_safety", "safety", "body lateral, 6 Hz", SAFETY, SIMPLIFIED),
    _acceleration("body_z_safety", "safety", "body vertical, 0.4 to 4 Hz", SAFETY, SIMPLIFIED),
    _acceleration("frame_y", "safety", "bogie frame lateral, 10 Hz", SAFETY, SIMPLIFIED),
    _acceleration("body_y", "ride", "body lateral, ride"),
    _acceleration("body_z", "ride", "body vertical, ride"),
    _acceleration("body_y_rms", "ride", "body lateral, rms"),
    _acceleration("body_z_rms", "ride", "body vertical, rms"),
    _acceleration("body_y_qst", "quasi_static", "body lateral, quasi-static"),
    _kN("Q_low", "smallest", INFORMATION, "smallest wheel load, 0.15 %"),
    _kN("Y_max", "loading", INFORMATION, "guiding force"),
    _kN("B_max", "loading", INFORMATION, "rail loading |Y| + 0.83 |Q|"),
    _kN("B_qst", "quasi_static", INFORMATION, "quasi-static rail loading"),
    Rule("T_qst", "quasi_static", INFORMATION, NORMAL, "quasi-static wear number", "N"),
    Rule("overturning", "safety", INFORMATION, NORMAL, "overturning coefficient, 1.5 Hz", "-"),
    Rule("steering", "quasi_static", INFORMATION, BOTH, "steering index", "-"),
)


@dataclass(frozen=True)
class Assessed:
    """Estimate of one quantity at one wheelset, wheel or sensor, and its limit.

    Attributes
    ----------
    rule : Rule
    place : str
        Wheelset, wheel or sensor; wheelsets count from 1.
    estimate : Estimate
    limit : float
        nan for quantities without [SI].
    source : str
        Source of the limit.
    checked : bool
        Whether the limit has been compared with the printed standard.
    uncorrected : Estimate or None
        Estimate before the correction for high friction, where that was made.
    """

    rule: Rule
    place: str
    estimate: Estimate
    limit: float = math.nan
    source: str = ""
    checked: bool = False
    uncorrected: Estimate | None = None

    @property
    def share(self) -> float:
        """Estimate over limit [1]."""
        return self.estimate.value / self.limit

    @property
    def rank(self) -> float:
        """What the rows of a quantity are ordered by: share of the limit, else the value."""
        if not math.isnan(self.limit):
            return self.share
        return -self.estimate.value if self.rule.kind == "smallest" else self.estimate.value

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        estimate, line = self.estimate, self.estimate.line
        return {
            "name": self.rule.name,
            "criterion": self.rule.group,
            "place": self.place,
            "N": estimate.N,
            "mean": estimate.mean,
            "deviation": estimate.deviation,
            "estimate": estimate.value,
            "uncorrected": self.uncorrected.value if self.uncorrected else None,
            "method": METHODS[estimate.method],
            "line": float(line.at(line.target)) if line else None,
            "line_error": line.error if line else None,
            "target": line.target if line else None,
            "limit": self.limit,
            "share": self.share,
            "source": self.source,
            "checked": self.checked,
        }


METHODS = {"one": "one-dimensional", "two": "two-dimensional", "largest": "largest value",
           "smallest": "smallest value"}  # fmt: skip
Limit = Callable[[str], tuple[float, Sourced]]


def limits_of(
    vehicle: Vehicle, service: Service, limits: RunningLimits, Q0: Floats, zone: str, radius: float
) -> dict[str, Limit]:
    """Limit of each quantity by wheelset, wheel or sensor [SI], with its source."""

    def axle(label: str) -> float:
        static = float(np.mean(Q0[int(label.split()[1]) - 1]))
        law = limits.sum_Y
        return law.k1[service.category] * (law.constant + law.factor * static)

    def wheel(label: str) -> float:
        static = float(np.mean(Q0[int(label.split()[1]) - 1]))
        speed, law = service.admissible_speed, limits.Q
        most = next((m for v, m in law.by_speed if speed <= v * (1.0 + 1e-4)), law.above)
        return min(law.constant + static, most)

    def frame(label: str) -> float:
        law = limits.frame_y
        return law.constant - law.slope * _bogie_mass(vehicle, int(label.split("_")[1]))

    index = int(zone) - 1
    steady = limits.Y_qst
    fixed: dict[str, tuple[float, Sourced]] = {
        "Y_over_Q": (limits.Y_over_Q.value, limits.Y_over_Q),
        "Q_qst": (limits.Q_qst.value, limits.Q_qst),
        "Y_qst": (steady.constant + steady.numerator / radius, steady),
        "body_y_safety": (limits.body_y_safety.values[index], limits.body_y_safety),
        "body_z_safety": (limits.body_z_safety.values[index], limits.body_z_safety),
    }
    for name in ("body_y", "body_z", "body_y_rms", "body_z_rms", "body_y_qst"):
        constant = getattr(limits, name)
        fixed[name] = (constant.value, constant)

    def always(pair: tuple[float, Sourced]) -> Limit:
        return lambda _: pair

    found = {name: always(pair) for name, pair in fixed.items()}
    found["sum_Y"] = lambda label: (axle(label), limits.sum_Y)
    found["Q"] = lambda label: (wheel(label), limits.Q)
    found["frame_y"] = lambda label: (frame(label), limits.frame_y)
    share = limits.instability
    found["instability"] = lambda label: (share.value * axle(label), share)
    return found


def _bogie_mass(vehicle: Vehicle, wheelset: int) -> float:
    """Mass of the frame above a wheelset (from 1) and of the wheelsets nearest to it [kg]."""
    flat = flatten(vehicle)
    wheelsets = flat.of_kind("wheelset")
    frames = [b for b in flat.of_kind("body") if b.name != flat.reference]

    def frame_of(x: float) -> str:
        return min(frames, key=lambda frame: abs(frame.position[0] - x)).name

    own = frame_of(wheelsets[wheelset - 1].position[0])
    carried = [w.mass for w in wheelsets if frame_of(w.position[0]) == own]
    return sum(b.mass for b in frames if b.name == own) + sum(carried)
