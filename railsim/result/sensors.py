"""Sensors on bodies: how their points move, and what accelerometers read there.

An accelerometer reads the acceleration of its point minus gravity, in the axes of the body it is
fixed to; the rest value of its z axis, -g, is taken out.  On canted track, or when the body rolls,
its y axis so reads a_y - g sin(cant angle + roll): the uncompensated lateral acceleration.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.constants import GRAVITY
from railsim.definitions.vehicle.bogies import carrying, frame_above
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import FlatBody, flatten
from railsim.track.alignment import Alignment

BOX = 1.0  # distance of a sensor on an axlebox from the middle of the wheelset [m]
MOTIONS = ("position", "velocity", "acceleration")
READINGS = ("sensor_acceleration", "sensor_roll_rate")  # what `readings` returns


@dataclass(frozen=True)
class Sensor:
    """A point of a body."""

    body: str  # full name of the body
    offset: float  # arc length of the body's frame beyond that of the reference body [m]
    arm: tuple[float, float, float]  # point from the centre of gravity, body axes [m]
    axlebox: bool = False  # on a wheelset: the sensor does not spin with it

    @property
    def along(self) -> float:
        """Arc length of the point beyond that of the reference body [m]."""
        return self.offset + self.arm[0]


Sensors = Mapping[str, Sensor]
Motion = Mapping[str, Floats]
Names = tuple[str, ...]
Angle = Floats | float


def sensors(vehicle: Vehicle) -> dict[str, Sensor]:
    """Sensors of a running test: on the floor and on the bogie frames, and the vehicle's own.

    ``floor_front``, ``floor_middle`` and ``floor_rear`` on the reference body above the bogies
    (means of its wheelsets in the front and rear half) and in the middle between them, at the
    service table's height of the floor; ``frame_1``, ... above each wheelset, on the body between
    the wheelset and the reference body; and the points of the service table.
    """
    flat = flatten(vehicle)
    bodies = {body.name: body for body in flat.bodies}
    wheelsets = flat.of_kind("wheelset")
    reference = bodies[flat.reference]
    points: dict[str, tuple[str, tuple[float, float, float]]] = {}
    if reference.kind != "wheelset":
        places = [w.position[0] for w in carrying(flat)]
        middle = float(np.mean(places))
        front, rear = [x for x in places if x >= middle], [x for x in places if x <= middle]
        height = -(vehicle.service.floor_height if vehicle.service else 1.2)
        for name, x in (("front", np.mean(front)), ("middle", middle), ("rear", np.mean(rear))):
            points[f"floor_{name}"] = (reference.name, (float(x), 0.0, height))
    for number, wheelset in enumerate(wheelsets, start=1):
        if (frame := frame_above(flat, wheelset)) is not None:
            points[f"frame_{number}"] = (frame.name, (wheelset.position[0], 0.0, frame.position[2]))
    for name, point in (vehicle.service.points if vehicle.service else {}).items():
        points[name] = (point.body, point.position)
    origin = reference.position[0]
    return {name: _sensor_at(bodies[body], point, origin) for name, (body, point) in points.items()}


def _sensor_at(body: FlatBody, point: tuple[float, float, float], origin: float) -> Sensor:
    """Return the sensor at a point in vehicle axes; `origin` is that of the distance [m]."""
    x, y, z = body.position
    arm = (point[0] - x, point[1] - y, point[2] - z)
    return Sensor(body.name, x - origin, arm, axlebox=body.kind == "wheelset")


def all_sensors(vehicle: Vehicle) -> dict[str, Sensor]:
    """Sensors of `sensors`, on the axleboxes, and those of the vehicle's table ``sensors``.

    ``axlebox_1_left``, ... on each wheelset at the height of its axle, as far from the middle as
    bodies that it carries, such as axle arms, or 1 m.
    """
    flat = flatten(vehicle)
    bodies = {body.name: body for body in flat.bodies}
    origin = bodies[flat.reference].position[0]
    found = sensors(vehicle)
    for number, wheelset in enumerate(flat.of_kind("wheelset"), start=1):
        x, y, _ = wheelset.position
        boxes = [box for box in flat.bodies if box.parent == wheelset.name]
        across = max((abs(box.position[1] - y) for box in boxes), default=BOX)
        for side, sign in (("left", -1.0), ("right", 1.0)):
            arm = (0.0, sign * across, 0.0)
            found[f"axlebox_{number}_{side}"] = Sensor(wheelset.name, x - origin, arm, axlebox=True)
    for name, point in vehicle.sensors.items():
        found[name] = _sensor_at(bodies[point.body], point.position, origin)
    return found


def motions(
    sensors: Sensors, motion: Motion, bodies: Names, alignment: Alignment, speed: Floats
) -> dict[str, Floats]:
    """Displacements, velocities and absolute accelerations of sensors, float64[time, sensor, 3].

    Displacements and velocities are those against the moving track frame of the body, in its axes;
    accelerations in the axes of the body.  Arguments as of `readings`.
    """
    b = [bodies.index(sensor.body) for sensor in sensors.values()]
    position, rates, absolute = (motion[f"body_{name}"][:, b] for name in MOTIONS)
    ordered = [*sensors.values()]
    attitude, spin, _ = _axis_motions(ordered, position, rates, absolute)
    _, omega, angular = _body_readings(ordered, motion, bodies, alignment, speed)
    arm = np.array([sensor.arm for sensor in sensors.values()]).reshape(-1, 3)
    turned = out_of_body(np.broadcast_to(arm, (*position.shape[:2], 3)), *attitude)
    velocity = out_of_body(_cross(spin, arm), *attitude)
    acceleration = absolute[..., :3] + _cross(angular, arm) + _cross(omega, _cross(omega, arm))
    return {
        "sensor_displacement": position[..., :3] + turned - arm,
        "sensor_velocity": rates[..., :3] + velocity,
        "sensor_absolute_acceleration": acceleration,
    }


def readings(
    sensors: Sensors, motion: Motion, bodies: Names, alignment: Alignment, speed: Floats
) -> tuple[Floats, Floats]:
    """Readings of sensors over time.

    `sensors` by name. `motion` (float64[time, ...]): ``distance``, ``body_position``,
    ``body_velocity``, ``body_acceleration`` of a result. `bodies`: Names along the dimension
    ``body``. `alignment`: Of the track. `speed` (float64[time]): Speed of the reference body along
    the track [m/s]. Returns `acceleration` (float64[time, sensor, 3]): Reading along x, y, z of
    the body [m/s2]. Returns `roll_rate` (float64[time, sensor]): Absolute roll velocity of the
    body [rad/s].
    """
    axes = tuple(dict.fromkeys((sensor.body, sensor.axlebox) for sensor in sensors.values()))
    first = {key: next(s for s in sensors.values() if (s.body, s.axlebox) == key) for key in axes}
    linear, omega, angular = _body_readings([*first.values()], motion, bodies, alignment, speed)
    index = [axes.index((sensor.body, sensor.axlebox)) for sensor in sensors.values()]
    arm = np.array([sensor.arm for sensor in sensors.values()]).reshape(-1, 3)
    turning = omega[:, index]
    swing = _cross(angular[:, index], arm) + _cross(turning, _cross(turning, arm))
    return linear[:, index] + swing, turning[..., 0]


def _body_readings(
    sensors: Sequence[Sensor], motion: Motion, bodies: Names, alignment: Alignment, speed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Reading at the centre of gravity, angular velocity and acceleration, all in body axes.

    Each float64[time, body, 3], of the bodies of some sensors.
    """
    b = [bodies.index(sensor.body) for sensor in sensors]
    position, rates, absolute = (motion[f"body_{name}"][:, b] for name in MOTIONS)
    s = motion["distance"][:, None] + np.array([sensor.offset for sensor in sensors])
    cant, grade = alignment.cant_angle(s), alignment.grade_angle(s)
    cant_rate, grade_rate = alignment.cant_angle_rate(s), alignment.grade_angle_rate(s)
    kappa, climb, level = alignment.curvature(s), np.sin(grade), np.cos(grade)
    c, sine = np.cos(cant), np.sin(cant)
    down = np.stack([-climb, sine * level, c * level], axis=-1)
    roll_rate = cant_rate - kappa * climb
    pitch_rate = grade_rate * c + kappa * level * sine
    yaw_rate = kappa * level * c - grade_rate * sine
    turning = speed[:, None, None] * np.stack([roll_rate, pitch_rate, yaw_rate], axis=-1)
    attitude, spin, angular = _axis_motions(sensors, position, rates, absolute)
    linear = absolute[..., :3] - GRAVITY * _into_body(down, *attitude)
    linear[..., 2] += GRAVITY
    return linear, spin + _into_body(turning, *attitude), angular


def _axis_motions(
    sensors: Sequence[Sensor], position: Floats, rates: Floats, absolute: Floats
) -> tuple[tuple[Floats, Floats, Floats], Floats, Floats]:
    """Roll, pitch and yaw, angular velocity and angular acceleration of the axes of sensors.

    Those of their bodies, but for an axlebox, which does not spin with its wheelset.
    """
    spins = np.array([not sensor.axlebox for sensor in sensors])
    turns = np.stack([position[..., 3:], rates[..., 3:], absolute[..., 3:]])
    turns[..., 1] = np.where(spins, turns[..., 1], 0.0)
    attitude, spin, angular = turns
    return (attitude[..., 0], attitude[..., 1], attitude[..., 2]), spin, angular


def _cross(a: Floats, b: Floats) -> Floats:
    """Vector product along the last axis; `numpy.cross` takes three times as long."""
    x, y, z = (a[..., k] for k in range(3))
    u, v, w = (b[..., k] for k in range(3))
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def out_of_body(vector: Floats, roll: Angle, pitch: Angle, yaw: Angle) -> Floats:
    """Components in track axes of a vector in body axes: C v, C = Rz(yaw) Rx(roll) Ry(pitch)."""
    x, y, z = (vector[..., k] for k in range(3))
    z, x = turned(z, x, pitch)
    y, z = turned(y, z, roll)
    x, y = turned(x, y, yaw)
    return np.stack([x, y, z], axis=-1)


def _into_body(vector: Floats, roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Components in body axes of a vector in track axes: C^T v, C = Rz(yaw) Rx(roll) Ry(pitch)."""
    x, y, z = (vector[..., k] for k in range(3))
    x, y = turned(x, y, -yaw)
    y, z = turned(y, z, -roll)
    z, x = turned(z, x, -pitch)
    return np.stack([x, y, z], axis=-1)


def turned(first: Floats, second: Floats, angle: Angle) -> tuple[Floats, Floats]:
    """Components of a vector turned by an angle from the first axis towards the second."""
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * first - sin * second, cos * second + sin * first
