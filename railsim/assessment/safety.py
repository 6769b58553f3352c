"""Safety against derailment and overturning: formulas for single values, and over a whole run.

Nadal (1896): a wheel climbs where Y/Q exceeds (tan b - mu)/(1 + mu tan b), b the flange angle.  In
a run wheel by wheel and bogie by bogie, unfiltered.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats, stretches
from railsim.assessment.record import Record
from railsim.definitions.vehicle.flatten import flatten
from railsim.notation import SIDES
from railsim.profiles import Profile
from railsim.result.extremes import evaluation_rows
from railsim.track.irregularity import shown_displacement


def nadal(flange_angle: float, mu: ArrayLike) -> Floats:
    """Limit of Y/Q (Nadal 1896, Annales des Mines).

    `flange_angle`: Largest contact angle of the flange [rad]. `mu`: Coefficient of friction [1].

    >>> round(float(nadal(math.radians(70.0), 0.36)), 3)
    1.2
    """
    slope, friction = math.tan(flange_angle), np.asarray(mu)
    return np.asarray((slope - friction) / (1.0 + friction * slope))


def flange_angle(profile: Profile) -> float:
    """Largest angle of a wheel profile on its flange [rad].

    Slope of the profile over a length of 1 mm, so that rounding of single points of a measured
    profile does not count as an angle.
    """
    y, z = np.asarray(profile.y), np.asarray(profile.z)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    points = np.arange(0.0, along[-1], 0.25e-3)
    py, pz = np.interp(points, along, y), np.interp(points, along, z)
    span = 4  # of 0.25 mm
    angles = np.arctan2(np.abs(pz[span:] - pz[:-span]), np.abs(py[span:] - py[:-span]))
    # the flange back is vertical: search between the tip of the flange and the tread
    tip = int(np.argmax(pz))
    middle = 0.5 * (points[span:] + points[:-span])
    order = np.argsort(y)
    tread = float(np.interp(0.0, y[order], along[order]))
    face = (middle > min(points[tip], tread)) & (middle < max(points[tip], tread))
    return float(np.max(angles[face]))


@dataclass(frozen=True)
class Climb:
    """Longest distance over which Y/Q of one wheel exceeds a limit."""

    length: float  # length [m]; 0 where the limit is exceeded at one stored instant or none
    begin: float  # position of its beginning [m]
    rise: float  # largest rise of the wheel above its rail since this position [m]


def climb_distance(s: Floats, Y_over_Q: Floats, limit: float | Floats, height: Floats) -> Climb:
    """Longest distance with Y/Q of one wheel above a limit, unfiltered.

    A wheel without load (nan) counts as above the limit.

    `s` (float64[time]): Position of the wheel, increasing [m]. `Y_over_Q` (float64[time]):
    Derailment quotient of one wheel [1]. `limit`: For example Nadal's limit, over time where the
    friction varies along the track [1]. `height` (float64[time]): Height of the wheel above its
    rail [m].

    >>> s = np.arange(6.0)
    >>> climb_distance(s, np.array([0.5, 1.3, 1.4, 1.3, 0.9, 0.2]), 1.2, 1e-3 * s)
    Climb(length=2.0, begin=1.0, rise=0.002)
    """
    best = Climb(0.0, math.nan, 0.0)
    for first, behind in stretches(~(Y_over_Q <= limit)):
        length = float(s[behind - 1] - s[first])
        if length > best.length:
            rise = float(np.max(height[first:behind]) - height[first])
            best = Climb(length, float(s[first]), rise)
    return best


def overturning(Q: Floats) -> Floats:
    """Overturning coefficient of a bogie, (sum Q_left - sum Q_right)/(sum Q) [1]."""
    left, right = np.sum(Q[..., 0], axis=-1), np.sum(Q[..., 1], axis=-1)
    with np.errstate(invalid="ignore"):  # without load, 0/0: nan
        return np.asarray((left - right) / (left + right))


def largest_overturning(Q: Floats) -> float:
    """Largest magnitude of the coefficient over all instants at which the bogie is loaded [1]."""
    return float(np.fmax.reduce(np.abs(overturning(Q))))


@dataclass(frozen=True)
class WheelSafety:
    """Nadal's limit and climb distance of one wheel.

    The limit is taken where Y/Q, unfiltered, comes nearest to it: at its largest value where the
    friction does not vary.
    """

    place: str  # wheelset, from 1, and side
    limit: float  # for the flange angle of the profile and the friction of the rail [1]
    Y_over_Q: float  # there [1]; nan where the wheel never carried load
    climb_distance: float  # longest one above the limit [m]
    climb_begin: float  # where it begins [m]
    rise: float  # of the wheel on it [m]
    lifted: bool  # whether it was without load, where Y/Q has no value


@dataclass(frozen=True)
class SafetyReport:
    """Derailment and overturning of a run."""

    wheels: tuple[WheelSafety, ...]
    # largest magnitude of (sum Q_left - sum Q_right)/(sum Q) by bogie [1]
    overturning: dict[str, float]
    derailed: bool  # whether the run ended so

    @property
    def exceeded(self) -> bool:
        """Whether the run derailed, or Y/Q of a wheel exceeds Nadal's limit."""
        return self.derailed or any(wheel.Y_over_Q > wheel.limit for wheel in self.wheels)

    def record(self) -> dict[str, Any]:
        """Return it as plain numbers and strings, SI."""
        return asdict(self)


def safety_report(record: Record) -> SafetyReport:
    """Nadal, climb distance and overturning of a run with Q, Y_over_Q and positions.

    As peaks, they leave out the run's start.
    """
    record.need_quantities("safety")
    result, rows = record.result, evaluation_rows(record.result)
    track, wheels = result.track(), []
    flat = flatten(result.vehicle())
    wheelsets = [w.wheelset for w in flat.of_kind("wheelset") if w.wheelset]
    quotient, s = result["Y_over_Q"][rows], result["wheelset_distance"][rows]
    for w, wheelset in enumerate(wheelsets):
        for k, side in enumerate(SIDES):
            angle = flange_angle(result.profiles[wheelset.profile[k]])
            limit = nadal(angle, track.friction_at(s[:, w])[:, k])
            height = _height(record, w, k)[rows]
            climb = climb_distance(s[:, w], quotient[:, w, k], limit, height)
            unloaded = np.isnan(quotient[:, w, k])
            nearest = int(np.argmax(np.where(unloaded, -np.inf, quotient[:, w, k] / limit)))
            worst = float(limit[nearest]), float(quotient[nearest, w, k])
            values = f"wheelset {w + 1} {side}", *worst, climb.length, climb.begin, climb.rise
            wheels.append(WheelSafety(*values, bool(unloaded.any())))
    Q = result["Q"][rows]
    most = {name: largest_overturning(Q[:, members]) for name, members in record.bogies.items()}
    return SafetyReport(tuple(wheels), most, result.status == "derailed")


def _height(record: Record, w: int, side: int) -> np.ndarray:
    """Height of a wheel above its irregular, not deflected rail [m]; nan without positions."""
    result, track = record.result, record.result.track()
    if "body_position" not in result:
        return np.full(len(record.time), np.nan)
    position = result["body_position"][:, result.bodies.index(result.wheelsets[w])]
    outwards = (-1.0, 1.0)[side]
    height = -(position[:, 2] + 0.5 * outwards * track.rail_base * position[:, 3])
    if "rail_vertical" in result:
        height = height + result["rail_vertical"][:, w, side]
    elif (rails := shown_displacement(track)) is not None:
        height = height + rails(result["wheelset_distance"][:, w])[0][1 + 2 * side]
    return np.asarray(height)
