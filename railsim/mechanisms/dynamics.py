"""Motion in time: inverse dynamics along a motion law, free motion under the elements' forces."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism import definition as written
from railsim.definitions.mechanism.values import points_of
from railsim.errors import InputError
from railsim.mechanisms.forces import Rates, actuator_force, frictional, generalised_force, inertia
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.kinematics import Motion, driver_words, solve
from railsim.mechanisms.links import Course
from railsim.mechanisms.model import Model

Law = Callable[[Floats], tuple[Floats, Floats, Floats]]
"""Travel, speed and acceleration at given times."""

ACCURACY = 1e-11  # relative error of a step of the free motion
NEAR = 1e-9  # of the end of a free motion: it is reached [rad or m]


def polynomial_345(duration: float, stroke: float) -> tuple[float, float, float]:
    """Coefficients of t^3, t^4, t^5 of the motion from rest to rest with no jump of acceleration.

    `h (10 u^3 - 15 u^4 + 6 u^5)`, u = t/T.

    >>> [round(c, 6) for c in polynomial_345(2.0, 0.434)]
    [0.5425, -0.406875, 0.081375]
    """
    return 10 * stroke / duration**3, -15 * stroke / duration**4, 6 * stroke / duration**5


@dataclass(frozen=True)
class TimedMotion:
    """A motion in time with the force that makes it; arrays of shape (time,)."""

    time: Floats  # [s]
    motion: Motion  # positions at these times
    speed: Floats  # of the driver [rad/s or m/s]
    acceleration: Floats  # of the driver [rad/s2 or m/s2]
    force: Floats  # of the actuator that drives [N or N m]

    def in_time(self, courses: Mapping[str, Course]) -> dict[str, Course]:
        """Angles or lengths with derivatives by time."""
        return {n: c.in_time(self.speed, self.acceleration) for n, c in courses.items()}

    def point(self, name: str) -> tuple[Floats, Floats]:
        """Velocity and acceleration of a named point, shape (time, 2) [m/s], [m/s2]."""
        _, r1, r2 = self.motion.point(name)
        v = r1 * self.speed[:, None]
        return v, r2 * self.speed[:, None] ** 2 + r1 * self.acceleration[:, None]


def law_of(model: Model, law: written.Motion, stroke: float) -> tuple[Law, float]:
    """Motion law of a length over its whole stroke, and its duration [s]."""
    n = model.number
    if law.law == "polynomial_345":
        assert law.duration is not None
        duration = n(law.duration)
        c3, c4, c5 = polynomial_345(duration, stroke)

        def smooth(t: Floats) -> tuple[Floats, Floats, Floats]:
            speed = 3 * c3 * t**2 + 4 * c4 * t**3 + 5 * c5 * t**4
            acceleration = 6 * c3 * t + 12 * c4 * t**2 + 20 * c5 * t**3
            return c3 * t**3 + c4 * t**4 + c5 * t**5, speed, acceleration

        return smooth, duration
    if law.law == "table":
        assert law.table is not None
        time, travel = np.array([[n(x) for x in row] for row in law.table]).T
        if not np.all(np.diff(time) > 0.0):
            raise model.refusal("motion.table", "times not rising", "rising")
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(time, travel)

        def tabulated(t: Floats) -> tuple[Floats, Floats, Floats]:
            shifted = t + time[0]
            return spline(shifted), spline(shifted, 1), spline(shifted, 2)

        return tabulated, float(time[-1] - time[0])
    speed = n(law.speed) if law.speed is not None else abs(stroke) / n(law.duration or 1.0)
    speed = abs(speed) * np.sign(stroke)

    def constant(t: Floats) -> tuple[Floats, Floats, Floats]:
        return speed * t, np.full_like(t, speed), np.zeros_like(t)

    return constant, stroke / speed


def driving_actuator(definition: written.Mechanism) -> str:
    """Name of the actuator whose force makes the motion of the file's motion law."""
    law, solve_for = definition.motion, definition.solve
    assert law is not None
    name = law.unknown or law.actuator or (solve_for.unknown if solve_for is not None else None)
    assert name is not None
    return name


def driven_motion(whole: Motion) -> TimedMotion:
    """Inverse dynamics along the file's motion law, from dense positions over the whole range.

    Raises InputError: the law leaves the range; a dead point of the driving actuator.
    """
    model = whole.model
    law = model.definition.motion
    assert law is not None

    def course(motion: Motion) -> tuple[Any, Any, Any]:
        """Length or angle that follows the law, with its derivatives by the driver."""
        if law.angle is not None:
            k = model.bodies[law.angle]
            return motion.q[:, k, 2], motion.q1[:, k, 2], motion.q2[:, k, 2]
        return motion.length(points_of(model.definition.actuators[law.actuator or ""]))

    quantity, unit, scale = "length", "mm", 1e3
    if law.angle is not None:
        quantity, unit, scale = "angle", "deg", float(np.degrees(1.0))
    values, rate, _ = course(whole)
    if len(turned := np.flatnonzero(rate * rate[0] <= 0.0)):
        at = driver_words(model, float(whole.s[turned[0]]))
        found = f"driver at {at}: the {quantity} turns back there and cannot follow a law"
        raise model.refusal("motion", found, "a range without a turning point")
    first, last = values[[0, -1]]
    low, high = sorted((first, last))
    function, duration = law_of(model, law, float(last - first))
    time = np.linspace(0.0, duration, law.points)
    travel, speed, acceleration = function(time)
    targets = first + travel
    if law.law != "table":
        targets = np.clip(targets, low, high)  # rounding at the ends
    s = driver_at(whole, lambda motion: course(motion)[:2], targets)
    if len(lost := np.flatnonzero(~np.isfinite(s))):
        value = f"{targets[lost[0]] * scale:.3f} {unit}"
        found = f"at {time[lost[0]]:.4g} s the {quantity} would be {value}"
        raise model.refusal("motion", found, f"{low * scale:.3f} to {high * scale:.3f} {unit}")
    motion = solve(model, s)
    _, slope, bend = course(motion)
    s1 = speed / slope
    s2 = (acceleration - bend * s1**2) / slope
    resting = np.abs(s1) <= 1e-12 * np.max(np.abs(s1))  # but for rounding
    sense = np.where(resting, model.sense, np.sign(s1))  # a table may go back
    force = actuator_force(motion, driving_actuator(model.definition), Rates(s1, s2, sense))
    return TimedMotion(time, motion, s1, s2, force)


@dataclass(frozen=True)
class FreeMotion:
    """A mechanism let go."""

    time: Floats  # [s]
    s: Floats  # driver [rad or m]
    speed: Floats  # its rate
    reached: bool  # whether it came to where it was to end


def free_motion(
    model: Model,
    start: float,
    until: float,
    duration: float,
    *,
    speed: float = 0.0,
    force: Callable[[float, Motion], Any] | None = None,
) -> FreeMotion:
    """Motion from a position and speed under the elements' forces: `M s'' = Q - M' s'^2/2`.

    From and to values of the driver [rad or m], for the duration at most [s]; `force` is a further
    generalised force of time and position.

    Raises
    ------
    InputError : the mechanism leaves the positions that it can take.

    Notes
    -----
    Dormand and Prince's method of order 8 with a relative error of `ACCURACY` a step.  Friction
    acts against the motion; where it turns, it may hold the mechanism, and the motion ends.
    """
    from scipy.integrate import solve_ivp  # imported where it is needed: it takes a while

    last = [solve(model, [start])]

    def pull(t: float, state: Floats, sense: int) -> tuple[float, float]:
        """Generalised force with friction against a sense of motion, and generalised mass."""
        motion = solve(model, [state[0]], last[0])
        last[0] = motion
        mass, slope = inertia(motion)
        if not mass[0] > 0.0:
            raise model.refusal("release", "no mass moves", "masses of bodies")
        total = generalised_force(motion, Rates(np.array([state[1]]), 0.0, sense, trial=True))
        if force is not None:
            total = total + force(t, motion)
        return float(total[0] - 0.5 * slope[0] * state[1] ** 2), float(mass[0])

    def reaches_end(_: float, state: Floats) -> float:
        return float(state[0] - until)

    def turns(_: float, state: Floats) -> float:
        return float(state[1])

    reaches_end.terminal = True  # type: ignore[attr-defined]
    turns.terminal = True  # type: ignore[attr-defined]
    events = [reaches_end, turns] if frictional(model) else [reaches_end]
    accuracy: Any = {"rtol": ACCURACY, "atol": 1e-13}
    t, state, legs, reached = 0.0, np.array([start, speed]), [], False
    while t < duration and not reached:
        sense = int(np.sign(state[1]))
        if not sense:
            sense = next((way for way in (1, -1) if way * pull(t, state, way)[0] > 0.0), 0)
        if not sense and len(events) > 1:
            legs.append((np.array([t, duration]), np.stack([state, state], axis=1)))
            break

        def rate(t: float, state: Floats, sense: int = sense) -> list[float]:
            total, mass = pull(t, state, sense)
            return [state[1], total / mass]

        turns.direction = -sense  # type: ignore[attr-defined]
        solution = solve_ivp(rate, (t, duration), state, "DOP853", events=events, **accuracy)
        if not solution.success:
            raise model.refusal("release", "the motion has no solution", solution.message)
        legs.append((solution.t, solution.y))
        reached = solution.status == 1 and bool(abs(solution.y[0, -1] - until) < NEAR)
        t, state = float(solution.t[-1]), np.array([solution.y[0, -1], 0.0])
    time, (s, rates) = (np.concatenate(parts, axis=-1) for parts in zip(*legs, strict=True))
    _check_strokes(model, s, until)
    return FreeMotion(time, s, rates, reached)


def _check_strokes(model: Model, s: Floats, until: float) -> None:
    """Refuse, by InputError, a free motion that takes a gas spring beyond its stroke."""
    try:
        generalised_force(solve(model, s))
    except InputError:
        low, high = sorted((model.start, model.end))
        outside = s[(s < low - NEAR) | (s > high + NEAR)]
        if not len(outside):
            raise
        end = driver_words(model, low if outside[0] < low else high)
        found = f"it swings past the end of the travel at {end}"
        allowed = f"a release that reaches {driver_words(model, until)}, or a shorter duration"
        raise model.refusal("release", found, allowed) from None
