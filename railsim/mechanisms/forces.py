"""Forces along a motion: virtual work, inertia, the unknown force, reactions of the joints.

With the driver `s` as the only coordinate (primes by s)

    Q(s) = sum F r' + sum T theta',     M(s) = sum m r'^2 + sum I theta'^2,
    M s'' + M' s'^2/2 = Q

(virtual work and Lagrange's equation of one coordinate; A. Sommerfeld, Mechanik, 1943, ch. VI).
A force F at a point r has the generalised force F r'; one between two points at the distance L,
positive when it pushes, F L'.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.mechanism import Actuator
from railsim.definitions.mechanism_parts import (
    AirSpring,
    Cylinder,
    Damper,
    Force,
    GasSpring,
    HandForce,
    HandTorque,
    JointFriction,
    PointMass,
    Spring,
    Stop,
    Torque,
    TorsionSpring,
)
from railsim.definitions.mechanism_values import ends
from railsim.errors import Fault, InputError
from railsim.kernels import linkage_motion as motion_kernel
from railsim.mechanisms.components import (
    AirSpringTable,
    cylinder_area,
    gas_spring_force,
    table_value,
)
from railsim.mechanisms.kinematics import Motion, driver_words
from railsim.mechanisms.model import Model

STROKE_EDGE = 1e-4
"""Share of a gas spring's stroke by which rounding may take it beyond its ends."""


@dataclass(frozen=True)
class Rates:
    """How the mechanism moves: driver's rate and acceleration, and the sense of friction.

    Attributes
    ----------
    speed, acceleration : float or ndarray, shape (position,)
        ds/dt, d2s/dt2.
    friction : {-1, 0, 1}
        Sense of the driver's (slow) motion for friction; 0 leaves friction out.
    trial : bool
        Whether a step is only tried: a gas spring may then go beyond its stroke.
    """

    speed: Any = 0.0
    acceleration: Any = 0.0
    friction: int = 0
    trial: bool = False


AT_REST = Rates()


def masses(motion: Motion) -> list[tuple[Any, Any, Any, Any]]:
    """Every mass with the motion of its centre and its inertia's body: (m, triple, I, body)."""
    model = motion.model
    found: list[tuple[Any, Any, Any, Any]] = []
    for name, body in model.definition.bodies.items():
        m, inertia = model.number(body.mass), model.number(body.inertia)
        if np.any(np.real(m) != 0.0) or np.any(np.real(inertia) != 0.0):
            k = model.bodies[name]
            found.append((m, motion.at(k, *model.position(body.centre)), inertia, k))
    for element in model.definition.elements.values():
        if isinstance(element, PointMass):
            found.append((model.number(element.mass), motion.point(element.point_mass), 0.0, 0))
    return found


def inertia(motion: Motion) -> tuple[Any, Any]:
    """Generalised mass M(s) and its derivative M'(s), shape (..., position)."""
    mass, slope = 0.0 * motion.s, 0.0 * motion.s
    for m, (_, r1, r2), rotary, k in masses(motion):
        w, w1 = motion.q1[..., k, 2], motion.q2[..., k, 2]
        mass = mass + m * (r1[..., 0] ** 2 + r1[..., 1] ** 2) + rotary * w * w
        slope = slope + 2.0 * (
            m * (r1[..., 0] * r2[..., 0] + r1[..., 1] * r2[..., 1]) + rotary * w * w1
        )
    return mass, slope


def gravity_force(motion: Motion) -> Any:
    """Generalised force of the weights, shape (..., position)."""
    g = motion.model.number(motion.model.definition.ground.gravity)
    total = 0.0 * motion.s
    for m, (_, r1, _), _, _ in masses(motion):
        total = total - m * g * r1[..., 1]
    return total


def element_push(motion: Motion, name: str, rates: Rates = AT_REST) -> Any:
    """Push of an element between two points at every position [N].

    Raises
    ------
    InputError : a gas spring beyond its stroke.
    """
    model = motion.model
    element = model.definition.elements[name]
    pair = ends(element)
    assert pair is not None
    length, slope, _ = motion.length(pair)
    speed = slope * rates.speed
    n = model.number
    match element:
        case Spring():
            return _spring_law(motion, name, element, length, element.free_length, rates)
        case Damper():
            return -n(element.damping) * speed
        case Stop():
            return _stop_push(motion, element, length, speed)
        case GasSpring():
            return _gas_push(motion, name, element, (length, slope, speed), rates)
    raise AssertionError(name)


def _spring_law(
    motion: Motion,
    name: str,
    spring: Spring | TorsionSpring,
    x: Any,
    free: float | str | None,
    rates: Rates,
) -> Any:
    """Push or torque of a spring at a length or angle, linear or by its table.

    Raises
    ------
    InputError : outside the table.
    """
    model = motion.model
    n = model.number
    if spring.table is None:
        assert spring.stiffness is not None
        assert free is not None
        return n(spring.stiffness) * (n(free) - x)
    rows = np.array([[float(np.ravel(np.real(n(q)))[0]) for q in row] for row in spring.table])
    found = table_value(rows, x)
    outside = np.flatnonzero(np.isnan(np.real(found)).reshape(-1, motion.s.shape[-1])[0])
    if len(outside) and not rates.trial:
        k = outside[0]
        at = driver_words(model, float(np.ravel(np.real(motion.s))[k]))
        value, scale, unit = np.ravel(np.real(x))[k], 1e3, "mm"
        if isinstance(spring, TorsionSpring):
            scale, unit = float(np.degrees(1.0)), "deg"
        low, high = rows[[0, -1], 0] * scale
        words = f"driver at {at}: {value * scale:.2f} {unit} is outside the table"
        allowed = f"{low:g} to {high:g} {unit}: a longer table"
        raise InputError([Fault(model.definition.name, f"elements.{name}", words, allowed)])
    return found


def _twist(motion: Motion, spring: TorsionSpring) -> tuple[Any, Any]:
    """Angle of a torsion spring's first body less that of its second, and its rate."""
    first, second = (motion.model.bodies[name] for name in spring.torsion_spring)
    return tuple(a[..., first, 2] - a[..., second, 2] for a in (motion.q, motion.q1))


def _stop_push(motion: Motion, stop: Stop, length: Any, speed: Any) -> Any:
    n = motion.model.number
    sense = 1.0 if stop.side == "shortest" else -1.0
    depth = sense * (n(stop.length) - length)
    push = n(stop.stiffness) * depth - sense * n(stop.damping) * speed
    met = (np.real(depth) > 0.0) & (np.real(push) > 0.0)  # a stop does not pull
    return sense * np.where(met, push, 0.0)


def _gas_push(motion: Motion, name: str, gas: GasSpring, moved: Any, rates: Rates) -> Any:
    n = motion.model.number
    length, slope, speed = moved
    stroke, extended = n(gas.stroke), n(gas.extended)
    compressed = extended - length
    if not rates.trial:
        _check_stroke(motion, name, compressed, stroke)
    pulls = gas.acts == "traction"
    used = stroke - compressed if pulls else compressed
    F1, temperature = n(gas.F1), n(gas.temperature)
    push = gas_spring_force(used, F1, n(gas.progression), stroke, gas.law, temperature)
    if pulls:
        push = -push
    if rates.friction:
        # against the motion: more push while it is compressed
        push = push - n(gas.friction) * rates.friction * np.sign(np.real(slope))
    damping = n(gas.damping)
    if gas.end_damping is not None:
        near = (np.real(compressed) < np.real(n(gas.end_length))) & (np.real(speed) > 0.0)
        damping = np.where(near, n(gas.end_damping), damping)
    return push - damping * speed


def _check_stroke(motion: Motion, name: str, compressed: Any, stroke: Any) -> None:
    beyond = np.real(np.maximum(-compressed, compressed - stroke))
    beyond = beyond.reshape(-1, motion.s.shape[-1])[0]
    worst = int(np.argmax(beyond))
    limit = float(np.ravel(np.real(stroke))[0])
    if beyond[worst] <= STROKE_EDGE * limit:
        return
    model = motion.model
    side = "extension" if np.ravel(np.real(compressed))[worst] < 0.0 else "compression"
    at = driver_words(model, float(np.ravel(np.real(motion.s))[worst]))
    found = f"driver at {at}: {beyond[worst] * 1e3:.2f} mm beyond its stroke in {side}"
    allowed = f"a stroke of {limit * 1e3:g} mm: other 'extended', 'stroke' or points"
    raise InputError([Fault(model.definition.name, f"elements.{name}", found, allowed)])


def generalised_force(motion: Motion, rates: Rates = AT_REST) -> Any:
    """Generalised force Q of weights and elements, without the actuators, shape (..., position)."""
    model = motion.model
    total = gravity_force(motion)
    for name, element in model.definition.elements.items():
        if isinstance(element, PointMass):
            continue
        if isinstance(element, Force):
            work = _direction_work(motion, element.force, element.angle, element.turns)
            total = total + model.number(element.size) * work
        elif isinstance(element, Torque):
            turning = motion.q1[..., model.bodies[element.torque], 2]
            total = total + model.number(element.size) * turning
        elif isinstance(element, TorsionSpring):
            angle, turning = _twist(motion, element)
            torque = _spring_law(motion, name, element, angle, element.free_angle, rates)
            total = total + torque * turning
        elif isinstance(element, JointFriction):
            turning = motion.q1[..., model.bodies[element.joint_friction], 2]
            total = total + friction_torque(motion, element, rates) * turning
        else:
            pair = ends(element)
            assert pair is not None
            total = total + element_push(motion, name, rates) * motion.length(pair)[1]
    return total


def friction_torque(motion: Motion, element: JointFriction, rates: Rates) -> Any:
    """Torque on a body that rubs, against its turning, shape (..., position) [N m]."""
    turning = motion.q1[..., motion.model.bodies[element.joint_friction], 2]
    return -motion.model.number(element.moment) * rates.friction * np.sign(np.real(turning))


def rubs(model: Model) -> bool:
    """Whether any element has friction, so that the way back needs another force."""
    parts = model.definition.elements.values()
    moments = [e.moment for e in parts if isinstance(e, JointFriction)]
    return any(
        np.any(np.real(model.number(quantity)))
        for quantity in (*moments, *(e.friction for e in parts if isinstance(e, GasSpring)))
    )


def _direction(motion: Motion, point: str, angle: Any, turns: bool) -> tuple[Any, Any]:
    turned = motion.model.number(angle)
    if turns:
        body = motion.model.bodies[point.partition(".")[0]]
        turned = turned + motion.q[..., body, 2]
    return np.cos(turned), np.sin(turned)


def _direction_work(motion: Motion, point: str, angle: Any, turns: bool) -> Any:
    c, s = _direction(motion, point, angle, turns)
    _, r1, _ = motion.point(point)
    return c * r1[..., 0] + s * r1[..., 1]


def unit_work(motion: Motion, actuator: Actuator) -> Any:
    """Generalised force of an actuator's unit force (or torque), shape (..., position)."""
    match actuator:
        case HandForce():
            return _direction_work(motion, actuator.push, actuator.angle, actuator.turns)
        case HandTorque():
            return motion.q1[..., motion.model.bodies[actuator.turn], 2]
    pair = ends(actuator)
    assert pair is not None
    return sense(actuator) * motion.length(pair)[1]


def sense(actuator: Actuator) -> float:
    """1 for what pushes its ends apart when its force is positive, -1 for what pulls."""
    return -1.0 if isinstance(actuator, Cylinder) and actuator.acts == "pull" else 1.0


def actuator_force(motion: Motion, name: str, rates: Rates = AT_REST) -> Any:
    """Force (or torque) of an actuator that makes the motion, shape (..., position) [N or N m].

    `F = (M s'' + M' s'^2/2 - Q)/w`, w the generalised force of its unit force.

    Raises
    ------
    InputError : the actuator has a dead point within the motion: no finite force holds there.
    """
    work = unit_work(motion, motion.model.definition.actuators[name])
    check_dead_point(motion, name, work)
    needed = -generalised_force(motion, rates)
    if np.any(rates.speed) or np.any(rates.acceleration):
        mass, slope = inertia(motion)
        needed = needed + mass * rates.acceleration + 0.5 * slope * rates.speed**2
    return needed / work


def check_dead_point(motion: Motion, name: str, work: Any) -> None:
    """Refuse a motion in which an actuator's rate goes through zero."""
    first = np.real(work).reshape(-1, motion.s.shape[-1])[0]
    size = np.max(np.abs(first))
    turned = np.flatnonzero((first * first[0] <= 0.0) | (np.abs(first) < 1e-9 * size))
    if not len(turned):
        return
    model = motion.model
    at = driver_words(model, float(np.ravel(np.real(motion.s))[turned[0]]))
    found = f"driver at {at}: dead point, no force of this actuator moves the mechanism"
    fault = Fault(model.definition.name, f"actuators.{name}", found, "another range or geometry")
    raise InputError([fault])


def table_of(motion: Motion, spring: AirSpring) -> AirSpringTable:
    """The table of an air spring."""

    def real(quantity: float | str) -> float:
        return float(np.ravel(np.real(motion.model.number(quantity)))[0])

    return AirSpringTable(
        np.array([real(x) for x in spring.heights]),
        np.array([real(x) for x in spring.pressures]),
        np.array([[real(x) for x in row] for row in spring.forces]),
    )


def pressure_for(motion: Motion, name: str, force: Any) -> Any:
    """Pressure at which an actuator has a force [Pa]; NaN where it has none."""
    actuator = motion.model.definition.actuators[name]
    if isinstance(actuator, Cylinder):
        if actuator.acts == "both":
            pushes = force / _area(motion, actuator, "push")
            return np.where(np.real(force) < 0.0, -force / _area(motion, actuator, "pull"), pushes)
        return force / _area(motion, actuator, actuator.acts)
    assert isinstance(actuator, AirSpring)
    return table_of(motion, actuator).pressure(motion.length(actuator.air_spring)[0], force)


def force_at_pressure(motion: Motion, name: str, pressure: Any) -> Any:
    """Force of an actuator at a pressure [N]; NaN where it has none."""
    actuator = motion.model.definition.actuators[name]
    if isinstance(actuator, Cylinder):
        return pressure * _area(motion, actuator, actuator.acts) + 0.0 * motion.s
    assert isinstance(actuator, AirSpring)
    return table_of(motion, actuator).force(motion.length(actuator.air_spring)[0], pressure)


def _area(motion: Motion, cylinder: Cylinder, acts: str) -> Any:
    n = motion.model.number
    return cylinder_area(n(cylinder.bore), n(cylinder.rod), n(cylinder.count), acts)


def contact_force(motion: Motion, name: str, force: Any, rates: Rates = AT_REST) -> Any:
    """Static force of the output along its axis at a given actuator force, `(F w + Q)/y'` [N]."""
    model = motion.model
    assert model.definition.output is not None
    _, r1, _ = motion.point(model.definition.output.point)
    work = unit_work(motion, model.definition.actuators[name])
    return (force * work + generalised_force(motion, rates)) / r1[..., model.axis]


def applied(motion: Motion, forces: dict[str, Any], rates: Rates = AT_REST) -> Any:
    """Applied forces less inertia on every body, shape (position, 3 n_bodies).

    Parameters
    ----------
    forces : dict of str to ndarray
        Forces of actuators by name.
    """
    model = motion.model
    n = motion.s.shape[-1]
    total = np.zeros((n, model.linkage.n_bodies + 1, 3))

    def add(name: str, x: Any, y: Any) -> None:
        k = model.bodies[name.partition(".")[0]]
        r, _, _ = motion.point(name)
        _add_force(total, motion, k, r, x, y)

    def between(pair: Any, push: Any) -> None:
        d = motion.point(pair[1])[0] - motion.point(pair[0])[0]
        unit = d / np.hypot(d[:, 0], d[:, 1])[:, None]
        add(pair[1], push * unit[:, 0], push * unit[:, 1])
        add(pair[0], -push * unit[:, 0], -push * unit[:, 1])

    definition = model.definition
    for name, element in definition.elements.items():
        if isinstance(element, PointMass):
            continue
        if isinstance(element, Force):
            c, s = _direction(motion, element.force, element.angle, element.turns)
            size = model.number(element.size)
            add(element.force, size * c, size * s)
        elif isinstance(element, Torque):
            total[:, model.bodies[element.torque], 2] += model.number(element.size)
        elif isinstance(element, TorsionSpring):
            angle, _ = _twist(motion, element)
            torque = _spring_law(motion, name, element, angle, element.free_angle, rates)
            for body, sign in zip(element.torsion_spring, (1.0, -1.0), strict=True):
                total[:, model.bodies[body], 2] += sign * torque
        elif isinstance(element, JointFriction):
            k = model.bodies[element.joint_friction]
            total[:, k, 2] += friction_torque(motion, element, rates)
        else:
            between(ends(element), element_push(motion, name, rates))
    for name, force in forces.items():
        actuator = definition.actuators[name]
        if isinstance(actuator, HandForce):
            c, s = _direction(motion, actuator.push, actuator.angle, actuator.turns)
            add(actuator.push, force * c, force * s)
        elif isinstance(actuator, HandTorque):
            total[:, model.bodies[actuator.turn], 2] += force
        else:
            between(ends(actuator), sense(actuator) * force)
    _add_inertia(total, motion, rates)
    return total[:, 1:].reshape(n, -1)


def _add_force(total: Any, motion: Motion, k: int, r: Any, x: Any, y: Any) -> None:
    total[:, k, 0] += x
    total[:, k, 1] += y
    ax, ay = r[:, 0] - motion.q[:, k, 0], r[:, 1] - motion.q[:, k, 1]
    total[:, k, 2] += ax * y - ay * x


def _add_inertia(total: Any, motion: Motion, rates: Rates) -> None:
    """Add weights and inertia forces -m a."""
    model = motion.model
    definition = model.definition
    g = model.number(definition.ground.gravity)
    carriers = [
        model.bodies[name]
        for name, body in definition.bodies.items()
        if model.number(body.mass) or model.number(body.inertia)
    ]
    carriers += [
        model.bodies[element.point_mass.partition(".")[0]]
        for element in definition.elements.values()
        if isinstance(element, PointMass)
    ]
    speed2, acceleration = np.asarray(rates.speed) ** 2, np.asarray(rates.acceleration)
    for k, (m, (r, r1, r2), rotary, body) in zip(carriers, masses(motion), strict=True):
        a = r2 * speed2[..., None] + r1 * acceleration[..., None]
        _add_force(total, motion, k, r, -m * a[:, 0], -m * (a[:, 1] + g))
        if body:
            turning = motion.q2[:, k, 2] * speed2 + motion.q1[:, k, 2] * acceleration
            total[:, k, 2] -= rotary * turning


def reactions(
    motion: Motion, forces: dict[str, Any], rates: Rates = AT_REST
) -> tuple[dict[str, Any], Any]:
    """Reactions of the joints by Lagrange's multipliers, `Phi_q^T lambda = M q'' - Q`.

    Parameters
    ----------
    motion : Motion
        Positions of a real model.
    forces : dict of str to ndarray, shape (position,)
        Forces of the actuators by name.
    rates : Rates
        Motion, for the inertia forces.

    Returns
    -------
    joints : dict of str to ndarray, shape (position, rows)
        Multipliers by joint: components x, y on the first point of a revolute joint [N], push of a
        link or a cam [N], side force of a slot [N], and its torque on a prismatic joint [N m].
    driver : ndarray, shape (position,)
        What the driver must add: zero where the actuators alone make the motion.
    """
    model = motion.model
    rows = 3 * model.linkage.n_bodies
    residual = np.zeros((len(motion.s), rows))
    jacobian = np.zeros((len(motion.s), rows, rows))
    motion_kernel.jacobians(model.linkage, motion.s, motion.q, motion.arcs, residual, jacobian)
    right = -applied(motion, forces, rates)
    found = np.linalg.solve(jacobian.transpose(0, 2, 1), right[..., None])[..., 0]
    joints = {name: found[:, a:b] for name, (a, b) in model.joint_rows.items()}
    return joints, found[:, -1]
