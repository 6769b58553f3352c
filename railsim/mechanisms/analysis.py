"""Everything that a mechanism file asks for, computed: `analyse` is where to begin reading."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.expressions import Expression
from railsim.definitions.mechanism import Mechanism
from railsim.definitions.mechanism_parts import AUTO, AirSpring, Cylinder, GasSpring
from railsim.definitions.mechanism_values import ends
from railsim.errors import Fault, InputError, argument_fault, nearest
from railsim.mechanisms.cams import Transition, cam_rows, transitions
from railsim.mechanisms.dynamics import FreeMotion, TimedMotion, driven_motion, free_motion
from railsim.mechanisms.forces import (
    Rates,
    actuator_force,
    contact_force,
    element_push,
    force_at_pressure,
    generalised_force,
    inertia,
    pressure_for,
    reactions,
    rubs,
    table_of,
    unit_work,
)
from railsim.mechanisms.inversion import driver_at, zeros
from railsim.mechanisms.kinematics import Motion, check_freedom, driver_words, folded, solve
from railsim.mechanisms.model import Model, build

Floats = NDArray[np.float64]
DENSE = 401
"""Positions from which heights and lengths are looked up."""


@dataclass(frozen=True)
class Reaction:
    """Largest reaction of a joint [N], the driver's value there, and all its components."""

    max: float
    at: float
    components: Floats


@dataclass(frozen=True)
class Contact:
    """Static contact force of the output.

    Attributes
    ----------
    pressure : float
        Pressure held [Pa].
    force : dict of str to float
        At low, work and high height; NaN where the actuator has no value [N].
    curve : ndarray, shape (position,)
        At all positions [N].
    equilibria : tuple of (height, stable)
        Heights at which the mechanism rests without a contact force [m].
    reason : str
        Why values are missing.
    """

    pressure: float
    force: Mapping[str, float]
    curve: Floats
    equilibria: tuple[tuple[float, bool], ...]
    reason: str = ""


@dataclass(frozen=True)
class Analysis:
    """Results of a mechanism; arrays over its positions have the shape (position,).

    Attributes
    ----------
    definition : Mechanism
        The mechanism, with the parameters of its case.
    model : Model
        The same as arrays.
    motion : Motion
        Positions.
    output : dict of str to ndarray
        Named results over the positions, SI; names and units in `quantities`.
    zone : dict of str to dict of str to float
        The same at low, work and high height.
    force_zeros, equilibria : tuple
        Values of the driver at which the unknown force changes its sign; positions of rest of a
        mechanism without an unknown, each with its stability.
    reactions : dict of str to Reaction
    transitions : tuple of Transition
        Changes of rollers from arc to arc.
    contact, timed, release : results of the tables [contact], [motion], [release], or None
    case : str or None
        Name of the case.
    """

    definition: Mechanism
    model: Model
    motion: Motion
    output: dict[str, Floats]
    zone: dict[str, dict[str, float]]
    force_zeros: tuple[float, ...]
    equilibria: tuple[tuple[float, bool], ...]
    reactions: dict[str, Reaction]
    transitions: tuple[Transition, ...]
    contact: Contact | None
    timed: TimedMotion | None
    release: FreeMotion | None
    case: str | None = None

    @property
    def travel(self) -> float:
        """Range of the driver [rad or m]."""
        return self.model.end - self.model.start

    @property
    def stroke(self) -> float:
        """Range of the actuator's length; of the driver where there is no such actuator [m]."""
        return float(np.ptp(self.output["length"])) if "length" in self.output else np.nan

    @property
    def max_force(self) -> float:
        """Largest force of the unknown actuator [N]."""
        return float(np.max(self.output["force"])) if "force" in self.output else np.nan

    @property
    def min_angles(self) -> dict[str, float]:
        """Smallest of every named angle, folded [rad]."""
        names = self.definition.angles
        return {name: float(np.min(folded(self.output[name]))) for name in names}

    def at(self, quantity: str, value: float) -> dict[str, float]:
        """All results where one of them has a value.

        Raises
        ------
        InputError
            There is no such result, or it never has this value.
        """
        if quantity not in self.output:
            found = f"no result '{quantity}'"
            raise InputError(
                [argument_fault("at", quantity, found, nearest(quantity, self.output))]
            )
        known = self.output[quantity]
        gap = known - value
        crossed = np.flatnonzero(gap[:-1] * gap[1:] <= 0.0)
        if not len(crossed):
            low, high = np.nanmin(known), np.nanmax(known)
            found, allowed = f"{value:g} is never reached", f"{low:.6g} to {high:.6g}"
            raise InputError([argument_fault("at", quantity, found, allowed)])
        k = crossed[0]
        s = zeros(
            solve(self.model, self.motion.s[k : k + 2]),
            lambda motion: outputs(motion)[quantity] - value,
        )
        motion = solve(self.model, s[:1])
        return {name: float(array[0]) for name, array in outputs(motion).items()}


def analyse(definition: Mechanism, case: str | None = None) -> Analysis:
    """Compute a mechanism: kinematics, forces, reactions, contact force, motion in time.

    Parameters
    ----------
    definition : Mechanism
        What the file says.
    case : str, optional
        Name of one of its cases; by default the base.

    Raises
    ------
    InputError
        What the mechanism cannot do, with joint or key and the driver's value.

    Examples
    --------
    >>> from railsim.definitions.loading import load_mechanism
    >>> result = analyse(load_mechanism("atr95_lift_5"))
    >>> print(f"{result.stroke * 1e3:.3f} mm, {result.max_force:.0f} N")
    113.668 mm, 9803 N
    """
    if case is not None and case not in definition.cases:
        raise InputError([no_case(definition, case)])
    definition = definition.in_case(case)
    model = build(definition)
    check_freedom(model)
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    motion = solve(model, sampled(dense))
    output = outputs(motion)
    _check_pressure(motion, output)
    at_zone = zone_drivers(dense)
    zone = {
        name: {key: float(array[i]) for key, array in outputs(solve(model, at_zone[1])).items()}
        for i, name in enumerate(at_zone[0])
    }
    return Analysis(
        definition,
        model,
        motion,
        output,
        zone,
        _force_zeros(dense),
        _equilibria(dense),
        _reactions(motion, output),
        transitions(dense),
        _contact(dense, motion, at_zone),
        driven_motion(dense) if definition.motion is not None else None,
        _release(model),
        case,
    )


def no_case(definition: Mechanism, case: str) -> Fault:
    """The fault of a case that a mechanism does not have."""
    cases = definition.cases
    allowed = nearest(case, cases) if cases else "the file has no cases"
    return argument_fault("case", "", f"no case '{case}'", allowed)


def actuator_of(definition: Mechanism) -> str | None:
    """Name of the actuator whose length the ratios are taken over; None where there is none."""
    if definition.solve is None:
        return None
    name = definition.solve.actuator or definition.solve.unknown
    return name if ends(definition.actuators[name]) is not None else None


def sampled(dense: Motion) -> Floats:
    """Values of the driver at the positions that `[sampling]` asks for."""
    model, sampling = dense.model, dense.model.definition.sampling
    name = actuator_of(model.definition)
    by, count = sampling.by, sampling.points
    if by == "travel" or (by == "length" and name is None):
        return np.linspace(model.start, model.end, count)
    if by == "time" and model.definition.motion is not None:
        law = model.definition.motion.model_copy(update={"points": count})
        timed = model.definition.model_copy(update={"motion": law})
        return driven_motion(replace(dense, model=replace(model, definition=timed))).motion.s
    if name is None or by == "time":
        fault = Fault(model.definition.name, "sampling.by", f"'{by}'", "'time' needs a [motion]")
        raise InputError([fault])
    pair = ends(model.definition.actuators[name])
    assert pair is not None
    length = dense.length(pair)[0]
    check_monotonic(dense, name)
    wanted = np.linspace(length[0], length[-1], count)
    s = driver_at(dense, lambda motion: motion.length(pair)[:2], wanted)
    s[0], s[-1] = model.start, model.end
    return s


def check_monotonic(dense: Motion, name: str) -> None:
    """Refuse a range in which an actuator's length turns back: a dead point."""
    from railsim.mechanisms.forces import check_dead_point

    check_dead_point(dense, name, unit_work(dense, dense.model.definition.actuators[name]))


def outputs(motion: Motion) -> dict[str, Any]:
    """Named results at all positions of a motion, SI; the table is `quantities.QUANTITIES`."""
    model = motion.model
    definition = model.definition
    found: dict[str, Any] = {"travel": motion.s}
    actuator = actuator_of(definition)
    if actuator is not None:
        pair = ends(definition.actuators[actuator])
        assert pair is not None
        found["length"], found["rate"], _ = motion.length(pair)
    if definition.output is not None:
        r, r1, _ = motion.point(definition.output.point)
        closed = solve(model, [model.start]).point(definition.output.point)[0][0]
        found["height"], found["x"] = r[:, 1] - closed[1], r[:, 0] - closed[0]
        if actuator is not None:
            found["ratio"], found["ratio_x"] = r1[:, 1] / found["rate"], r1[:, 0] / found["rate"]
    if definition.solve is not None:
        found |= _forces(motion, definition.solve.unknown)
    for name, element in definition.elements.items():
        pair = ends(element)
        if pair is not None:
            found[f"{name}_length"] = motion.length(pair)[0]
            found[f"{name}_force"] = element_push(motion, name)
            if isinstance(element, GasSpring) and element.rod is not None:
                area = 0.25 * np.pi * model.number(element.rod) ** 2
                found[f"{name}_pressure"] = np.abs(found[f"{name}_force"]) / area
    for name in definition.angles:
        found[name] = motion.angle(name)
    for name, row in cam_rows(motion).items():
        found[f"{name}_pressure_angle"] = pressure_angle(motion, name, row)
    return found


def _forces(motion: Motion, unknown: str) -> dict[str, Any]:
    """Force of the unknown actuator, its pressure, what it means at the output."""
    model = motion.model
    definition = model.definition
    sense = int(np.sign(model.end - model.start))
    found: dict[str, Any] = {"force": actuator_force(motion, unknown, Rates(friction=sense))}
    if rubs(model):
        found["force_back"] = actuator_force(motion, unknown, Rates(friction=-sense))
    if isinstance(definition.actuators[unknown], Cylinder | AirSpring):
        found["pressure"] = pressure_for(motion, unknown, found["force"])
        if "force_back" in found:
            found["pressure_back"] = pressure_for(motion, unknown, found["force_back"])
    if definition.output is not None:
        _, r1, _ = motion.point(definition.output.point)
        with np.errstate(divide="ignore", invalid="ignore"):
            found["effective_weight"] = -generalised_force(motion) / r1[:, 1]
            found["effective_mass"] = inertia(motion)[0] / r1[:, 1] ** 2
    return found


def pressure_angle(motion: Motion, name: str, row: int) -> Any:
    """Pressure angle of a roller on its cam [rad]: from its path over the ground to its force.

    The normal is taken on the side to which the roller moves, so that the angle goes on from arc
    to arc.
    """
    joint = motion.model.definition.joints[name]
    r, r1, _ = motion.point(joint.cam)  # type: ignore[union-attr]
    d = r - motion.arc_centre(row)
    along = r1[:, 0] * d[:, 0] + r1[:, 1] * d[:, 1]
    across = r1[:, 0] * d[:, 1] - r1[:, 1] * d[:, 0]
    angle = np.arctan2(across, along)
    return angle - np.pi * np.round(angle / np.pi)


def _check_pressure(motion: Motion, output: Mapping[str, Any]) -> None:
    """Refuse an air spring as the actuator that has no value somewhere."""
    if "pressure" not in output or np.all(np.isfinite(output["pressure"])):
        return
    definition = motion.model.definition
    assert definition.solve is not None
    name = definition.solve.unknown
    spring = definition.actuators[name]
    assert isinstance(spring, AirSpring)
    k = np.flatnonzero(~np.isfinite(output["pressure"]))[0]
    height = float(motion.length(spring.air_spring)[0][k])
    reason = table_of(motion, spring).reason(height, float(output["force"][k]))
    where = f"driver at {driver_words(motion.model, float(motion.s[k]))}: {reason}"
    fault = Fault(definition.name, f"actuators.{name}", where, "another range or table")
    raise InputError([fault])


def zone_drivers(dense: Motion) -> tuple[list[str], Floats]:
    """Names of the zone's heights and the driver's values there.

    Raises
    ------
    InputError
        A height is never reached.
    """
    model = dense.model
    zone, output = model.definition.zone, model.definition.output
    if zone is None or output is None:
        return [], np.zeros(0)
    names = ["low", "work", "high"]
    heights = np.array([model.number(getattr(zone, name)) for name in names])
    s = height_drivers(dense, heights)
    faults = []
    for name, height, value in zip(names, heights, s, strict=True):
        if not np.isfinite(value):
            y = _height(dense)[0]
            found = f"a height of {height * 1e3:.1f} mm is never reached"
            allowed = f"{y.min() * 1e3:.1f} to {y.max() * 1e3:.1f} mm"
            faults.append(Fault(model.definition.name, f"zone.{name}", found, allowed))
    if faults:
        raise InputError(faults)
    return names, s


def _height(motion: Motion) -> tuple[Any, Any]:
    assert motion.model.definition.output is not None
    point = motion.model.definition.output.point
    r, r1, _ = motion.point(point)
    start = solve(motion.model, [motion.model.start]).point(point)[0][0, 1]
    return r[..., 1] - start, r1[..., 1]


def height_drivers(dense: Motion, heights: Any) -> Floats:
    """Values of the driver at heights of the output over the start; NaN where never reached."""
    return driver_at(dense, _height, heights)


def _force_zeros(dense: Motion) -> tuple[float, ...]:
    solve_for = dense.model.definition.solve
    if solve_for is None:
        return ()
    unknown = solve_for.unknown
    sense = int(np.sign(dense.model.end - dense.model.start))
    found = zeros(dense, lambda m: -_needed(m, unknown, Rates(friction=sense)))
    return tuple(found)


def _needed(motion: Motion, unknown: str, rates: Rates) -> Any:
    """Unknown force up to a factor that does not change its sign along the motion."""
    return generalised_force(motion, rates)


def _equilibria(dense: Motion) -> tuple[tuple[float, bool], ...]:
    definition = dense.model.definition
    if definition.solve is not None or not np.any(generalised_force(dense)):
        return ()
    return _rests(dense, generalised_force)


def _rests(dense: Motion, force: Any) -> tuple[tuple[float, bool], ...]:
    """Zeros of a generalised force, stable where it falls along the driver."""
    model = dense.model
    span = model.end - model.start
    found = []
    for s in zeros(dense, force):
        h = 1e-6 * span
        low, high = sorted((model.start, model.end))
        before, after = force(solve(model, [max(s - h, low), min(s + h, high)]))
        found.append((s, bool(after < before)))
    return tuple(found)


def _reactions(motion: Motion, output: Mapping[str, Any]) -> dict[str, Reaction]:
    definition = motion.model.definition
    forces = {} if definition.solve is None else {definition.solve.unknown: output["force"]}
    sense = int(np.sign(motion.model.end - motion.model.start))
    joints, _ = reactions(motion, forces, Rates(friction=sense))
    found = {}
    for name, rows in joints.items():
        # the second row of a prismatic joint is a torque
        sized = rows[:, :1] if hasattr(definition.joints[name], "prismatic") else rows
        size = np.sqrt(np.sum(sized**2, axis=1))
        k = int(np.argmax(size))
        found[name] = Reaction(float(size[k]), float(motion.s[k]), rows)
    return found


def held_pressure(dense: Motion, work: float) -> float:
    """Pressure of `[contact]`: given, or what gives the wanted force at work height [Pa]."""
    definition = dense.model.definition
    contact, solve_for = definition.contact, definition.solve
    assert contact is not None
    assert solve_for is not None
    assert definition.output is not None
    given = contact.pressure
    automatic = isinstance(given, Expression) and bool(given.names & definition.automatic)
    if given != AUTO and not automatic:
        return float(dense.model.number(given))
    at = solve(dense.model, [work])
    _, r1, _ = at.point(definition.output.point)
    wanted = dense.model.number(contact.force) * r1[:, 1] - generalised_force(at)
    force = wanted / unit_work(at, definition.actuators[solve_for.unknown])
    return float(pressure_for(at, solve_for.unknown, force)[0])


def _contact(dense: Motion, motion: Motion, at_zone: tuple[list[str], Floats]) -> Contact | None:
    definition = dense.model.definition
    if definition.contact is None or definition.solve is None:
        return None
    names, drivers = at_zone
    unknown = definition.solve.unknown
    pressure = held_pressure(dense, drivers[names.index("work")])

    def force(positions: Motion) -> Any:
        return contact_force(positions, unknown, force_at_pressure(positions, unknown, pressure))

    def generalised(positions: Motion) -> Any:
        push = force_at_pressure(positions, unknown, pressure)
        work = unit_work(positions, definition.actuators[unknown])
        return push * work + generalised_force(positions)

    rests = _rests(dense, generalised)
    heights = [float(_height(solve(dense.model, [s]))[0][0]) for s, _ in rests]
    curve = np.asarray(force(motion))
    values = force(solve(dense.model, drivers))
    missing = not (np.all(np.isfinite(curve)) and np.all(np.isfinite(values)))
    reason = f"{pressure / 1e6:.5f} MPa leaves the air spring's table" if missing else ""
    return Contact(
        pressure,
        {name: float(value) for name, value in zip(names, values, strict=True)},
        curve,
        tuple((y, stable) for y, (_, stable) in zip(heights, rests, strict=True)),
        reason,
    )


def _release(model: Model) -> FreeMotion | None:
    release = model.definition.release
    if release is None:
        return None
    start, until = model.number(release.start), model.number(release.until)
    low, high = sorted((model.start, model.end))
    for key, value in (("start", start), ("until", until)):
        if not low - 1e-12 <= value <= high + 1e-12:
            allowed = f"{driver_words(model, low)} to {driver_words(model, high)}"
            found = driver_words(model, value)
            raise InputError([Fault(model.definition.name, f"release.{key}", found, allowed)])
    return free_motion(model, start, until, model.number(release.duration))
