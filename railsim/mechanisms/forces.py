"""Forces along a motion: virtual work, inertia, the unknown force, reactions of the joints.

With the driver `s` as the only coordinate (primes by s)

    Q(s) = sum F r' + sum T theta',     M(s) = sum m r'^2 + sum I theta'^2,
    M s'' + M' s'^2/2 = Q

(virtual work and Lagrange's equation of one coordinate; A. Sommerfeld, Mechanik, 1943, ch. VI).
A force F at a point r has the generalised force F r'; one between two points at the distance L,
positive when it pushes, F L'.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from railsim.definitions.mechanism import parts
from railsim.definitions.mechanism.values import body_name, points_of
from railsim.kernels import linkage_motion as motion_kernel
from railsim.mechanisms import components
from railsim.mechanisms.kinematics import Motion, dot, driver_words
from railsim.mechanisms.model import Model, real

STROKE_EDGE = 1e-4  # share of a gas spring's stroke by which rounding may take it beyond its ends


@dataclass(frozen=True)
class Rates:
    """How the mechanism moves: driver's rate and acceleration, and the sense of friction."""

    speed: Any = 0.0  # ds/dt, a number or one for each position
    acceleration: Any = 0.0  # d2s/dt2, likewise
    friction: Any = 0  # sense of the driver's motion for friction, likewise; 0 leaves it out
    trial: bool = False  # a step is only tried: a gas spring may then go beyond its stroke


AT_REST = Rates()


class Between(NamedTuple):
    """A push between two points [N]."""

    pair: tuple[str, str]
    push: Any


class AtPoint(NamedTuple):
    """A force at a point [N]."""

    point: str
    x: Any
    y: Any


class OnBody(NamedTuple):
    """A torque on a body [N m]."""

    body: str
    torque: Any


Load = Between | AtPoint | OnBody  # what a part exerts on the bodies


class Mass(NamedTuple):
    """A mass [kg], the motion of its centre, its moment of inertia [kg m2], number of its body."""

    mass: Any
    centre: tuple[Any, Any, Any]
    inertia: Any
    body: int


def masses(motion: Motion) -> list[Mass]:
    """Every mass of bodies and elements."""
    return motion.once("masses", lambda: [*_masses(motion)])


def _masses(motion: Motion) -> Iterator[Mass]:
    model = motion.model
    for name, body in model.definition.bodies.items():
        m, inertia = model.number(body.mass), model.number(body.inertia)
        if np.any(np.real(m) != 0.0) or np.any(np.real(inertia) != 0.0):
            k = model.bodies[name]
            yield Mass(m, motion.at(k, *model.position(body.centre)), inertia, k)
    for part in model.definition.elements.values():
        if isinstance(part, parts.PointMass):
            k = model.bodies[body_name(part.point_mass)]
            yield Mass(model.number(part.mass), motion.point(part.point_mass), 0.0, k)


def inertia(motion: Motion) -> tuple[Any, Any]:
    """Generalised mass M(s) and its derivative M'(s), shape (..., position)."""
    mass, slope = 0.0 * motion.s, 0.0 * motion.s
    for m, (_, r1, r2), rotary, k in masses(motion):
        w, w1 = motion.q1[..., k, 2], motion.q2[..., k, 2]
        mass = mass + m * dot(r1, r1) + rotary * w * w
        slope = slope + 2.0 * (m * dot(r1, r2) + rotary * w * w1)
    return mass, slope


def element_push(motion: Motion, name: str, rates: Rates = AT_REST) -> Any:
    """Push of an element between two points [N]; raises InputError: beyond its stroke or table."""
    model = motion.model
    element, n = model.definition.elements[name], model.number
    length, slope, _ = motion.length(points_of(element))
    speed = slope * rates.speed
    match element:
        case parts.Spring():
            return _spring_law(motion, name, element, length, element.free_length, rates)
        case parts.Damper():
            return -n(element.damping) * speed
        case parts.Stop():
            sense = 1.0 if element.side == "shortest" else -1.0
            depth = sense * (n(element.length) - length)
            push = n(element.stiffness) * depth - sense * n(element.damping) * speed
            met = (np.real(depth) > 0.0) & (np.real(push) > 0.0)  # a stop does not pull
            return sense * np.where(met, push, 0.0)
        case parts.GasSpring():
            return _gas_push(motion, name, element, (length, slope, speed), rates)
    raise AssertionError(name)


def _spring_law(
    motion: Motion,
    name: str,
    spring: parts.Spring | parts.TorsionSpring,
    x: Any,
    free: Any,
    rates: Rates,
) -> Any:
    """Push or torque of a spring at a length or angle; raises InputError: outside its table."""
    model, n = motion.model, motion.model.number
    if spring.table is None:
        assert spring.stiffness is not None
        return n(spring.stiffness) * (n(free) - x)
    rows = np.array([[real(n(q)) for q in row] for row in spring.table])
    found = components.table_value(rows, x)
    outside = np.flatnonzero(np.isnan(_first_lane(motion, found)))
    if len(outside) and not rates.trial:
        turns = isinstance(spring, parts.TorsionSpring)
        scale, unit = (float(np.degrees(1.0)), "deg") if turns else (1e3, "mm")
        at = driver_words(model, float(_first_lane(motion, motion.s)[outside[0]]))
        value = float(_first_lane(motion, x)[outside[0]]) * scale
        low, high = rows[[0, -1], 0] * scale
        words = f"driver at {at}: {value:.2f} {unit} is outside the table"
        allowed = f"{low:g} to {high:g} {unit}: a longer table"
        raise model.refusal(f"elements.{name}", words, allowed)
    return found


def _first_lane(motion: Motion, values: Any) -> Any:
    """Real values at all positions, of the first lane of a model that has several."""
    return np.real(values).reshape(-1, motion.s.shape[-1])[0]


def _gas_push(motion: Motion, name: str, gas: parts.GasSpring, course: Any, rates: Rates) -> Any:
    n = motion.model.number
    length, slope, speed = course
    stroke, extended = n(gas.stroke), n(gas.extended)
    compressed = extended - length
    if not rates.trial:
        _check_stroke(motion, name, compressed, stroke)
    pulls = gas.acts == "traction"
    used = stroke - compressed if pulls else compressed
    F1, temperature = n(gas.F1), n(gas.temperature)
    push = components.gas_spring_force(used, F1, n(gas.progression), stroke, gas.law, temperature)
    if pulls:
        push = -push
    if np.any(rates.friction):
        # against the motion: more push while it is compressed
        push = push - n(gas.friction) * rates.friction * np.sign(np.real(slope))
    damping = n(gas.damping)
    if gas.end_damping is not None:
        near = (np.real(compressed) < np.real(n(gas.end_length))) & (np.real(speed) > 0.0)
        damping = np.where(near, n(gas.end_damping), damping)
    return push - damping * speed


def _check_stroke(motion: Motion, name: str, compressed: Any, stroke: Any) -> None:
    inner = _first_lane(motion, compressed)
    limit = real(stroke)
    beyond = np.maximum(-inner, inner - limit)
    worst = int(np.argmax(beyond))
    if beyond[worst] > STROKE_EDGE * limit:
        side = "extension" if inner[worst] < 0.0 else "compression"
        at = driver_words(motion.model, float(_first_lane(motion, motion.s)[worst]))
        found = f"driver at {at}: {beyond[worst] * 1e3:.2f} mm beyond its stroke in {side}"
        allowed = f"a stroke of {limit * 1e3:g} mm: other 'extended', 'stroke' or points"
        raise motion.model.refusal(f"elements.{name}", found, allowed)


def element_loads(motion: Motion, name: str, element: parts.Element, rates: Rates) -> list[Load]:
    """What an element exerts on the bodies; nothing of a mass, whose weight is counted apart."""
    n, bodies = motion.model.number, motion.model.bodies
    match element:
        case parts.PointMass():
            return []
        case parts.Force():
            c, s = _direction(motion, element.force, element)
            return [AtPoint(element.force, n(element.size) * c, n(element.size) * s)]
        case parts.Torque():
            return [OnBody(element.torque, n(element.size))]
        case parts.TorsionSpring():
            first, second = element.torsion_spring
            twist = motion.q[..., bodies[first], 2] - motion.q[..., bodies[second], 2]
            torque = _spring_law(motion, name, element, twist, element.free_angle, rates)
            return [OnBody(first, torque), OnBody(second, -torque)]
        case parts.JointFriction():
            turning = motion.q1[..., bodies[element.joint_friction], 2]
            torque = -n(element.moment) * rates.friction * np.sign(np.real(turning))
            return [OnBody(element.joint_friction, torque)]
    return [Between(points_of(element), element_push(motion, name, rates))]


def actuator_load(motion: Motion, actuator: parts.Actuator, force: Any = 1.0) -> Load:
    """What an actuator of a force, or torque, exerts on the bodies."""
    match actuator:
        case parts.HandForce():
            c, s = _direction(motion, actuator.push, actuator)
            return AtPoint(actuator.push, force * c, force * s)
        case parts.HandTorque():
            return OnBody(actuator.turn, force)
    pulls = isinstance(actuator, parts.Cylinder) and actuator.acts == "pull"
    return Between(points_of(actuator), -force if pulls else force)


def _direction(motion: Motion, point: str, part: parts.Force | parts.HandForce) -> tuple[Any, Any]:
    turned = motion.model.number(part.angle)
    if part.turns:
        turned = turned + motion.q[..., motion.model.bodies[body_name(point)], 2]
    return np.cos(turned), np.sin(turned)


def work(motion: Motion, load: Load) -> Any:
    """Generalised force of a load, shape (..., position)."""
    match load:
        case Between(pair, push):
            return push * motion.length(pair)[1]
        case AtPoint(point, x, y):
            _, r1, _ = motion.point(point)
            return x * r1[..., 0] + y * r1[..., 1]
        case OnBody(body, torque):
            return torque * motion.q1[..., motion.model.bodies[body], 2]


def unit_work(motion: Motion, actuator: parts.Actuator) -> Any:
    """Generalised force of an actuator's unit force (or torque), shape (..., position)."""
    return work(motion, actuator_load(motion, actuator))


def generalised_force(motion: Motion, rates: Rates = AT_REST) -> Any:
    """Generalised force Q of weights and elements, without the actuators, shape (..., position)."""
    g = motion.model.number(motion.model.definition.ground.gravity)
    total = 0.0 * motion.s
    for m, (_, r1, _), _, _ in masses(motion):
        total = total - m * g * r1[..., 1]
    return total + sum(work(motion, load) for load in _loads(motion, rates))


def _loads(motion: Motion, rates: Rates) -> Iterator[Load]:
    for name, element in motion.model.definition.elements.items():
        yield from element_loads(motion, name, element, rates)


def frictional(model: Model) -> bool:
    """Whether any element has friction, so that the way back needs another force."""
    elements = model.definition.elements.values()
    sizes = [part.moment for part in elements if isinstance(part, parts.JointFriction)]
    sizes += [part.friction for part in elements if isinstance(part, parts.GasSpring)]
    return any(np.any(np.real(model.number(size))) for size in sizes)


def actuator_force(motion: Motion, name: str, rates: Rates = AT_REST) -> Any:
    """Force (or torque) of an actuator that makes the motion, shape (..., position) [N or N m].

    `F = (M s'' + M' s'^2/2 - Q)/w`, w the generalised force of its unit force.

    Raises InputError: the actuator has a dead point within the motion: no finite force holds
    there.
    """
    effect = check_dead_point(motion, name)
    needed = -generalised_force(motion, rates)
    if np.any(rates.speed) or np.any(rates.acceleration):
        mass, slope = inertia(motion)
        needed = needed + mass * rates.acceleration + 0.5 * slope * rates.speed**2
    return needed / effect


def check_dead_point(motion: Motion, name: str) -> Any:
    """Return the work of an actuator's unit force; refuse a motion in which it changes its sign."""
    effect = unit_work(motion, motion.model.definition.actuators[name])
    first = _first_lane(motion, effect)
    size = np.max(np.abs(first))
    turned = np.flatnonzero((first * first[0] <= 0.0) | (np.abs(first) < 1e-9 * size))
    if len(turned):
        at = driver_words(motion.model, float(_first_lane(motion, motion.s)[turned[0]]))
        found = f"driver at {at}: dead point, no force of this actuator moves the mechanism"
        raise motion.model.refusal(f"actuators.{name}", found, "another range or geometry")
    return effect


def table_of(motion: Motion, spring: parts.AirSpring) -> components.AirSpringTable:
    """The table of an air spring."""
    n = motion.model.number
    heights, pressures = ([real(n(x)) for x in row] for row in (spring.heights, spring.pressures))
    forces = [[real(n(x)) for x in row] for row in spring.forces]
    return components.AirSpringTable(np.array(heights), np.array(pressures), np.array(forces))


def pressure_for(motion: Motion, name: str, force: Any) -> Any:
    """Pressure at which an actuator has a force [Pa]; NaN where it has none."""
    actuator = motion.model.definition.actuators[name]
    if isinstance(actuator, parts.AirSpring):
        return table_of(motion, actuator).pressure(motion.length(actuator.air_spring)[0], force)
    assert isinstance(actuator, parts.Cylinder)
    if actuator.acts != "both":
        return force / chamber_area(motion.model, actuator, actuator.acts)
    pulls = -force / chamber_area(motion.model, actuator, "pull")
    return np.where(
        np.real(force) < 0.0, pulls, force / chamber_area(motion.model, actuator, "push")
    )


def force_at_pressure(motion: Motion, name: str, pressure: Any, needed: float = 0.0) -> Any:
    """Force of an actuator at a pressure [N]; NaN where it has none.

    Of a double-acting cylinder that of the chamber for a force `needed` [N].
    """
    actuator = motion.model.definition.actuators[name]
    if isinstance(actuator, parts.AirSpring):
        return table_of(motion, actuator).force(motion.length(actuator.air_spring)[0], pressure)
    assert isinstance(actuator, parts.Cylinder)
    if actuator.acts == "both" and needed < 0.0:
        return -pressure * chamber_area(motion.model, actuator, "pull") + 0.0 * motion.s
    return pressure * chamber_area(motion.model, actuator, actuator.acts) + 0.0 * motion.s


def chamber_area(model: Model, cylinder: parts.Cylinder, acts: str) -> Any:
    """Area of the chamber that pushes or pulls, of all cylinders side by side [m2]."""
    bore, rod, count = map(model.number, (cylinder.bore, cylinder.rod, cylinder.count))
    free = bore * bore - (rod * rod if acts == "pull" else 0.0)
    return count * 0.25 * np.pi * free


def applied_forces(motion: Motion, forces: Mapping[str, Any], rates: Rates = AT_REST) -> Any:
    """Applied forces, those of the actuators by name, less inertia, (position, 3 n_bodies)."""
    model = motion.model
    actuators = model.definition.actuators
    loads: list[Load] = [*_loads(motion, rates)]
    loads += [actuator_load(motion, actuators[name], force) for name, force in forces.items()]
    n = motion.s.shape[-1]
    total = np.zeros((n, model.linkage.n_bodies + 1, 3))

    def add(k: int, r: Any, x: Any, y: Any) -> None:
        total[:, k, 0] += x
        total[:, k, 1] += y
        ax, ay = r[:, 0] - motion.q[:, k, 0], r[:, 1] - motion.q[:, k, 1]
        total[:, k, 2] += ax * y - ay * x

    for load in loads:
        match load:
            case Between(pair, push):
                ends = [(model.bodies[body_name(p)], motion.point(p)[0]) for p in pair]
                d = ends[1][1] - ends[0][1]
                unit = d / np.hypot(d[:, 0], d[:, 1])[:, None]
                for (k, r), sign in zip(ends, (-1.0, 1.0), strict=True):
                    add(k, r, sign * push * unit[:, 0], sign * push * unit[:, 1])
            case AtPoint(point, x, y):
                add(model.bodies[body_name(point)], motion.point(point)[0], x, y)
            case OnBody(body, torque):
                total[:, model.bodies[body], 2] += torque
    g = model.number(model.definition.ground.gravity)
    speed2, acceleration = np.asarray(rates.speed) ** 2, np.asarray(rates.acceleration)
    for m, (r, r1, r2), rotary, k in masses(motion):
        a = r2 * speed2[..., None] + r1 * acceleration[..., None]
        add(k, r, -m * a[:, 0], -m * (a[:, 1] + g))
        total[:, k, 2] -= rotary * (motion.q2[:, k, 2] * speed2 + motion.q1[:, k, 2] * acceleration)
    return total[:, 1:].reshape(n, -1)


def reactions(
    motion: Motion, forces: Mapping[str, Any], rates: Rates = AT_REST
) -> tuple[dict[str, Any], Any]:
    """Reactions of the joints by Lagrange's multipliers, `Phi_q^T lambda = M q'' - Q`.

    `motion`: Positions of a real model. `forces`: Forces of the actuators by name. `rates`:
    Motion, for the inertia forces. Returns `joints` (shape (position, rows)): Multipliers by
    joint: components x, y on the first point of a revolute joint [N], push of a link or a cam [N],
    side force of a slot [N], and its torque on a prismatic joint [N m]. Returns `driver` (shape
    (position,)): What the driver must add: zero where the actuators alone make the motion.
    """
    model = motion.model
    rows = 3 * model.linkage.n_bodies
    residual = np.zeros((len(motion.s), rows))
    jacobian = np.zeros((len(motion.s), rows, rows))
    motion_kernel.jacobians(model.linkage, motion.s, motion.q, motion.arcs, residual, jacobian)
    right = -applied_forces(motion, forces, rates)
    found = np.linalg.solve(jacobian.transpose(0, 2, 1), right[..., None])[..., 0]
    return {name: found[:, a:b] for name, (a, b) in model.joint_rows.items()}, found[:, -1]
