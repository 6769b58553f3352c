"""Angles, speeds and accelerations of every link, lengths of every actuator, along a motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.mechanism_parts import Link
from railsim.definitions.mechanism_values import ends
from railsim.mechanisms.kinematics import Motion


@dataclass(frozen=True)
class Course:
    """Angle of a link or length of an actuator at all positions, with two derivatives.

    Attributes
    ----------
    value, first, second : ndarray, shape (position,)
        Angle [rad] or length [m], and its derivatives by the driver or, `in_time`, by time.
    """

    value: Any
    first: Any
    second: Any

    def in_time(self, speed: Any, acceleration: Any) -> "Course":
        """The same with derivatives by time, for given rates of the driver."""
        return Course(
            self.value, self.first * speed, self.second * speed**2 + self.first * acceleration
        )


def links(motion: Motion) -> dict[str, Course]:
    """Angles of all bodies and rods by their names [rad], going on over full turns."""
    found = {}
    for name in motion.model.definition.bodies:
        k = motion.model.bodies[name]
        found[name] = Course(*(array[:, k, 2] for array in (motion.q, motion.q1, motion.q2)))
    for name, joint in motion.model.definition.joints.items():
        if isinstance(joint, Link):
            found[name] = _direction(motion, joint.link)
    return found


def actuators(motion: Motion) -> dict[str, Course]:
    """Lengths of all actuators between two points by their names [m]."""
    found = {}
    for name, actuator in motion.model.definition.actuators.items():
        if (pair := ends(actuator)) is not None:
            found[name] = Course(*motion.length(pair))
    return found


def _direction(motion: Motion, pair: tuple[str, str]) -> Course:
    """Direction from one point to another with its derivatives by the driver."""
    d, d1, d2 = (b - a for a, b in zip(motion.point(pair[0]), motion.point(pair[1]), strict=True))
    squared = d[:, 0] ** 2 + d[:, 1] ** 2
    angle = np.unwrap(np.arctan2(d[:, 1], d[:, 0]))
    first = (d[:, 0] * d1[:, 1] - d[:, 1] * d1[:, 0]) / squared
    stretch = (d[:, 0] * d1[:, 0] + d[:, 1] * d1[:, 1]) / squared
    second = (d[:, 0] * d2[:, 1] - d[:, 1] * d2[:, 0]) / squared - 2.0 * first * stretch
    return Course(angle, first, second)
