"""Named results of a mechanism at positions of its driver, and positions where they are needed."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism.definition import Mechanism
from railsim.definitions.mechanism.parts import AirSpring, Cylinder, GasSpring
from railsim.definitions.mechanism.values import ends
from railsim.errors import Fault, Faults
from railsim.mechanisms import forces
from railsim.mechanisms.cams import cam_rows
from railsim.mechanisms.dynamics import driven_motion
from railsim.mechanisms.inversion import driver_at
from railsim.mechanisms.kinematics import Motion, driver_words, solve

ZONE = ("low", "work", "high")


def actuator_of(definition: Mechanism) -> str | None:
    """Name of the actuator whose length the ratios are taken over; None where there is none."""
    if definition.solve is None:
        return None
    name = definition.solve.actuator or definition.solve.unknown
    return name if ends(definition.actuators[name]) is not None else None


def length_points(definition: Mechanism) -> tuple[str, str] | None:
    """Points between which the ratios' actuator is; None where there is none."""
    name = actuator_of(definition)
    return None if name is None else ends(definition.actuators[name])


def equal_lengths(dense: Motion, pair: tuple[str, str], edges: Any, count: int) -> Floats:
    """Values of the driver at equal steps of a length between two lengths."""
    lengths = np.linspace(edges[0], edges[1], count)
    return driver_at(dense, lambda motion: motion.length(pair)[:2], lengths)


def sampling_positions(dense: Motion) -> Floats:
    """Values of the driver at the positions that `[sampling]` asks for."""
    model, sampling = dense.model, dense.model.definition.sampling
    name, pair = actuator_of(model.definition), length_points(model.definition)
    by, count = sampling.by, sampling.points
    if by == "travel" or (by == "length" and pair is None):
        return np.linspace(model.start, model.end, count)
    if by == "time" and model.definition.motion is not None:
        law = model.definition.motion.model_copy(update={"points": count})
        timed = model.definition.model_copy(update={"motion": law})
        return driven_motion(replace(dense, model=replace(model, definition=timed))).motion.s
    if name is None or pair is None or by == "time":
        raise model.refusal("sampling.by", f"'{by}'", "'time' needs a [motion]")
    forces.check_dead_point(dense, name)
    s = equal_lengths(dense, pair, dense.length(pair)[0][[0, -1]], count)
    s[0], s[-1] = model.start, model.end
    return s


def outputs(motion: Motion) -> dict[str, Any]:
    """Named results at all positions of a motion, SI; names and units in `quantities`."""
    model = motion.model
    definition = model.definition
    results: dict[str, Any] = {"travel": motion.s}
    pair = length_points(definition)
    if pair is not None:
        results["length"], results["rate"], _ = motion.length(pair)
    if definition.output is not None:
        r, r1, _ = motion.point(definition.output.point)
        closed = solve(model, [model.start]).point(definition.output.point)[0][0]
        results["height"], results["x"] = r[:, 1] - closed[1], r[:, 0] - closed[0]
        if pair is not None:
            with np.errstate(divide="ignore", invalid="ignore"):  # where the length stands still
                ratios = (r1[:, k] / results["rate"] for k in (model.axis, 0))
                results["ratio"], results["ratio_x"] = ratios
    if definition.solve is not None:
        results |= _forces(motion, definition.unknown)
    for name, element in definition.elements.items():
        pair = ends(element)
        if pair is not None:
            results[f"{name}_length"] = motion.length(pair)[0]
            results[f"{name}_force"] = forces.element_push(motion, name)
            if isinstance(element, GasSpring) and element.rod is not None:
                area = 0.25 * np.pi * model.number(element.rod) ** 2
                results[f"{name}_pressure"] = np.abs(results[f"{name}_force"]) / area
    results |= {name: motion.angle(name) for name in definition.angles}
    for name, row in cam_rows(motion).items():
        results[f"{name}_pressure_angle"] = _pressure_angle(motion, name, row)
    return results


def _forces(motion: Motion, unknown: str) -> dict[str, Any]:
    """Force of the unknown actuator, its pressure, what it means at the output."""
    model = motion.model
    definition = model.definition
    results: dict[str, Any] = {}
    for way, sense in (("", 1), ("_back", -1))[: 2 if forces.frictional(model) else 1]:
        rates = forces.Rates(friction=sense * model.sense)
        results[f"force{way}"] = forces.actuator_force(motion, unknown, rates)
    if isinstance(definition.actuators[unknown], Cylinder | AirSpring):
        for name, force in list(results.items()):
            results[name.replace("force", "pressure")] = forces.pressure_for(motion, unknown, force)
    if definition.output is not None:
        along = motion.point(definition.output.point)[1][:, model.axis]
        with np.errstate(divide="ignore", invalid="ignore"):
            results["effective_weight"] = -forces.generalised_force(motion) / along
            results["effective_mass"] = forces.inertia(motion)[0] / along**2
    return results


def _pressure_angle(motion: Motion, name: str, row: int) -> Any:
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
    missing = np.flatnonzero(~np.isfinite(output.get("pressure", 0.0)))
    if len(missing):
        definition, k = motion.model.definition, missing[0]
        spring = definition.held_by
        assert isinstance(spring, AirSpring)
        height = float(motion.length(spring.air_spring)[0][k])
        reason = forces.table_of(motion, spring).reason(height, float(output["force"][k]))
        where = f"driver at {driver_words(motion.model, float(motion.s[k]))}: {reason}"
        key = f"actuators.{definition.unknown}"
        raise motion.model.refusal(key, where, "another range or table")


def zone_drivers(dense: Motion) -> dict[str, float]:
    """Values of the driver at the zone's heights; raises InputError: one is never reached."""
    model = dense.model
    zone, output = model.definition.zone, model.definition.output
    if zone is None or output is None:
        return {}
    heights = np.array([model.number(getattr(zone, name)) for name in ZONE])
    found = dict(zip(ZONE, driver_at(dense, height_of, heights).tolist(), strict=True))
    y = height_of(dense)[0]
    allowed, faults = f"{y.min() * 1e3:.1f} to {y.max() * 1e3:.1f} mm", Faults()
    for name, height in zip(ZONE, heights, strict=True):
        if np.isnan(found[name]):
            words = f"a height of {height * 1e3:.1f} mm is never reached"
            faults.append(Fault(model.definition.name, f"zone.{name}", words, allowed))
    faults.check()
    return found


def height_of(motion: Motion) -> tuple[Any, Any]:
    """Way of the output along its axis since the start, with its derivative by the driver [m]."""
    model = motion.model
    assert model.definition.output is not None
    point = model.definition.output.point
    r, r1, _ = motion.point(point)
    start = solve(model, [model.start]).point(point)[0][0, model.axis]
    return r[..., model.axis] - start, r1[..., model.axis]
