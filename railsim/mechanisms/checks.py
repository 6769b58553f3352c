"""Checks of a mechanism: every value that a file limits, against its limit."""

from collections.abc import Iterator

import numpy as np

from railsim.definitions.mechanism.parts import Actuator, AirSpring, Cylinder, GasSpring, Piston
from railsim.definitions.mechanism.values import points_of
from railsim.design_checks import ROUNDING, Check
from railsim.mechanisms.analysis import Analysis, either_way
from railsim.mechanisms.components import lid_force, next_size
from railsim.mechanisms.forces import chamber_area, unit_work
from railsim.mechanisms.inversion import largest
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.outputs import actuator_of
from railsim.mechanisms.quantities import quantity


def checks(result: Analysis) -> list[Check]:
    """Everything that a mechanism must keep, as far as its file says so."""
    return [*_checks(result)]


def _checks(result: Analysis) -> Iterator[Check]:
    definition, n = result.definition, result.model.number
    if definition.solve is not None:
        yield from _forces(result, definition.held_by)
    limits = definition.optimise
    if limits is not None and limits.min_transmission_angle is not None:
        limit = n(limits.min_transmission_angle)
        note = "smallest over the whole travel, folded to 90 deg"
        for angle, value in result.min_angles.items():
            if definition.angles[angle].limited:
                yield Check(angle, value, limit, "above", "rad", note)
    if "length" in result.output:
        yield from _lengths(result)
    yield from _boxes(result)
    for element, part in definition.elements.items():
        if isinstance(part, GasSpring):
            yield from _gas_spring(result, element, part)
    if (lid := definition.lid) is not None:
        part = definition.elements[lid.element]
        assert isinstance(part, GasSpring)
        rule = lid_force(n(lid.mass), n(lid.centre), n(lid.lever), n(lid.springs), n(lid.factor))
        note = "F1 and the makers' rule of thumb G D/(b n) 9.8 alpha, which is approximate"
        yield Check(f"lid_{lid.element}", n(part.F1), rule, "about", "N", note)
    if result.contact is not None:
        note = "static contact force in the zone: the head must not come down"
        yield Check("contact_force", result.contact.least, 0.0, "above", "N", note)
        supply = getattr(definition.held_by, "supply_pressure", None)
        if supply is not None:
            note = "pressure held for the contact force against the supply pressure"
            yield Check("held_pressure", result.contact.pressure, n(supply), "below", "Pa", note)


def _forces(result: Analysis, unknown: Actuator) -> Iterator[Check]:
    """The unknown force in either sense, on the way from start to end and back."""
    n, limits = result.model.number, result.definition.optimise
    least, most = either_way(result, "force")
    acts = unknown.acts if isinstance(unknown, Cylinder) else "push"
    stated = limits.available_force if limits is not None else None
    most_available = np.inf if stated is None else n(stated)
    if isinstance(unknown, Cylinder):
        pressure = n(unknown.supply_pressure)
        note = "largest force of the chamber under pressure against bore and supply pressure"
        note = note if stated is None else f"{note}, and [optimise]"
        acting = "pull" if acts == "pull" else "push"
        available = min(pressure * chamber_area(result.model, unknown, acting), most_available)
        yield Check("available_force", max(most, 0.0), available, "below", "N", note)
        if acts == "both":
            note = "largest pull against bore less rod and supply pressure"
            available = min(pressure * chamber_area(result.model, unknown, "pull"), most_available)
            yield Check("available_pull", max(-least, 0.0), available, "below", "N", note)
    elif stated is not None:
        note = "largest amount of the force"
        unit = quantity("force", result.definition).unit
        yield Check("available_force", result.peak_force, most_available, "below", unit, note)
    if isinstance(unknown, AirSpring) and unknown.supply_pressure is not None:
        needed, note = either_way(result, "pressure")[1], "largest pressure that is needed"
        yield Check("available_pressure", needed, n(unknown.supply_pressure), "below", "Pa", note)
    if isinstance(unknown, Cylinder | AirSpring) and acts != "both":
        name, words = ("pulls", "push") if acts == "push" else ("pushes", "pull")
        note = f"least force: it can only {words}"
        yield Check(name, _sign(least, result), 0.0, "above", "N", note)
    if isinstance(unknown, Cylinder | AirSpring | Piston):
        note = "least force along its motion: below 0 the load runs ahead and must be held back"
        yield Check("runs_ahead", runs_ahead(result), 0.0, "above", "N", note)


def runs_ahead(result: Analysis) -> float:
    """Least force in the sense in which its point moves; negative where the load drives."""
    work = unit_work(result.motion, result.definition.held_by)
    along = np.sign(work[0]) * result.model.sense
    force = result.extremes("force")
    return _sign(force.least if along > 0.0 else -force.most, result)


def _sign(force: float, result: Analysis) -> float:
    """A force that is to be compared with 0, without its rounding."""
    return 0.0 if abs(force) <= ROUNDING * result.peak_force else force


def _lengths(result: Analysis) -> Iterator[Check]:
    definition, n = result.definition, result.model.number
    limits = definition.optimise
    actuator = definition.actuators[actuator_of(definition) or ""]
    shortest = result.extremes("length").least
    if limits is not None and limits.min_length is not None:
        limit, note = n(limits.min_length), "shortest length wanted"
        yield Check("min_length", shortest, limit, "above", "m", note)
    if limits is not None and limits.max_stroke is not None:
        limit, note = n(limits.max_stroke), "stroke wanted at most"
        yield Check("max_stroke", result.stroke, limit, "below", "m", note)
    if isinstance(actuator, Cylinder) and actuator.pin_to_pin is not None:
        stroke = next_size([n(s) for s in actuator.strokes], result.stroke)
        if stroke is not None:
            least = n(actuator.pin_to_pin) + stroke
            note = f"shortest length against pin to pin and the stroke of {stroke * 1e3:g} mm"
            yield Check("pin_to_pin", shortest, least, "above", "m", note)


def _boxes(result: Analysis) -> Iterator[Check]:
    """Points against the boxes that they may not leave."""
    limits = result.definition.optimise
    for i, box in enumerate(limits.envelope if limits is not None else ()):
        for axis, edges in ((0, box.x), (1, box.y)):
            for edge, sense, k in zip(edges or (), ("above", "below"), (-1.0, 1.0), strict=False):
                value = k * max(_furthest(result, point, axis, k) for point in box.points)
                note = f"{'xy'[axis]} of {', '.join(box.points)}"
                yield Check(f"envelope.{i}", value, result.model.number(edge), sense, "m", note)


def _furthest(result: Analysis, point: str, axis: int, sense: float) -> float:
    def along(motion: Motion) -> object:
        return sense * motion.point(point)[0][:, axis]

    return largest(result.motion, along, along(result.motion))[1]


def _gas_spring(result: Analysis, name: str, spring: GasSpring) -> Iterator[Check]:
    """Temperature against the nearer end of the service range; the rod's end when compressed."""
    n = result.model.number
    value, (low, high) = n(spring.temperature), (n(x) for x in spring.service)
    limit, sense = (low, "above") if value < 0.5 * (low + high) else (high, "below")
    note = "temperature against the range in service"
    yield Check(f"{name}_temperature", value, limit, sense, "°C", note)
    if spring.rod_end is not None:
        note = "height of the body's end over the rod's, compressed: the rod must point down"
        drop = rod_drop(result, name)
        drop = drop if spring.rod_end == spring.gas_spring[0] else -drop
        yield Check(f"{name}_rod_down", drop, 0.0, "above", "m", note)


def rod_drop(result: Analysis, name: str) -> float:
    """Height of a gas spring's second end over its first where it is most compressed [m]."""
    pair = points_of(result.definition.elements[name])
    motion = solve(result.model, [result.extremes(f"{name}_length").least_at])
    first, second = (motion.point(point)[0][0, 1] for point in pair)
    return float(second - first)
