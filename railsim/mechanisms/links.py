"""Angles, speeds and accelerations of every link, lengths of every actuator, along a motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.mechanism.parts import Link
from railsim.definitions.mechanism.values import ends
from railsim.mechanisms.kinematics import Motion, dot


@dataclass(frozen=True)
class Course:
    """Angle [rad] or length [m] at all positions with two derivatives by the driver or by time."""

    value: Any
    first: Any
    second: Any

    def in_time(self, speed: Any, acceleration: Any) -> "Course":
        """The same with derivatives by time, for given rates of the driver."""
        second = self.second * speed**2 + self.first * acceleration
        return Course(self.value, self.first * speed, second)


def links(motion: Motion) -> dict[str, Course]:
    """Angles of all bodies and rods by their names [rad], going on over full turns."""
    model = motion.model
    poses = (motion.q, motion.q1, motion.q2)
    numbers = {name: model.bodies[name] for name in model.definition.bodies}
    found = {n: Course(*(array[:, k, 2] for array in poses)) for n, k in numbers.items()}
    for name, joint in model.definition.joints.items():
        if isinstance(joint, Link):
            first, second = (motion.point(point) for point in joint.link)
            d, d1, d2 = (b - a for a, b in zip(first, second, strict=True))
            across = np.stack((-d[:, 1], d[:, 0]), axis=-1) / dot(d, d)[:, None]
            angle, rate = np.unwrap(np.arctan2(d[:, 1], d[:, 0])), dot(across, d1)
            found[name] = Course(angle, rate, dot(across, d2) - 2.0 * rate * dot(d, d1) / dot(d, d))
    return found


def actuators(motion: Motion) -> dict[str, Course]:
    """Lengths of all actuators between two points by their names [m]."""
    pairs = {name: ends(one) for name, one in motion.model.definition.actuators.items()}
    return {name: Course(*motion.length(pair)) for name, pair in pairs.items() if pair is not None}
