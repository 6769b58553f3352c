"""Named results of a mechanism at positions of its driver, and positions where they are wanted."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.mechanism import Mechanism
from railsim.definitions.mechanism_parts import AirSpring, Cylinder, GasSpring
from railsim.definitions.mechanism_values import ends
from railsim.errors import Fault, InputError
from railsim.mechanisms.cams import cam_rows
from railsim.mechanisms.dynamics import driven_motion
from railsim.mechanisms.forces import (
    Rates,
    actuator_force,
    check_dead_point,
    element_push,
    generalised_force,
    inertia,
    pressure_for,
    rubs,
    table_of,
    unit_work,
)
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.kinematics import Motion, driver_words, solve

Floats = NDArray[np.float64]


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
            found["ratio"], found["ratio_x"] = (r1[:, k] / found["rate"] for k in (model.axis, 0))
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
    sense = model.sense
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
            along = r1[:, model.axis]
            found["effective_weight"] = -generalised_force(motion) / along
            found["effective_mass"] = inertia(motion)[0] / along**2
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


def check_pressure(motion: Motion, output: Mapping[str, Any]) -> None:
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
            y = height_of(dense)[0]
            found = f"a height of {height * 1e3:.1f} mm is never reached"
            allowed = f"{y.min() * 1e3:.1f} to {y.max() * 1e3:.1f} mm"
            faults.append(Fault(model.definition.name, f"zone.{name}", found, allowed))
    if faults:
        raise InputError(faults)
    return names, s


def height_of(motion: Motion) -> tuple[Any, Any]:
    """Way of the output along its axis since the start, with its derivative by the driver [m]."""
    assert motion.model.definition.output is not None
    point = motion.model.definition.output.point
    r, r1, _ = motion.point(point)
    k = motion.model.axis
    start = solve(motion.model, [motion.model.start]).point(point)[0][0, k]
    return r[..., k] - start, r1[..., k]


def height_drivers(dense: Motion, heights: Any) -> Floats:
    """Values of the driver at heights of the output over the start; NaN where never reached."""
    return driver_at(dense, height_of, heights)
