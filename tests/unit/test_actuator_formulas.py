"""Actuators by themselves, not compiled: what they measure, and forces that do the work of it."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from railsim.kernels import actuators
from railsim.kernels.actuators import ABOUT, ACTION, ALONG, AXLE, LENGTH, LINE, SENSE
from railsim.kernels.system import ANGULAR, FORCE, MOMENT, POSE_SIZE, POSITION, VELOCITY

SPIN = 0.7  # rad/s of the wheelset against its own axes
EVERY = [LINE, *range(ALONG, ALONG + 3), *range(ABOUT, ABOUT + 3), AXLE]


def bodies_and_actuator(action, sense):
    """Two bodies that move against each other, and an actuator between points of them."""
    random = np.random.default_rng(17)
    row, codes, pose = np.zeros((1, 40)), np.zeros((1, 40), int), np.zeros((2, POSE_SIZE))
    row[0, :6], row[0, [LENGTH, SENSE]], codes[0, ACTION] = (
        random.normal(size=6),
        (0.4, sense),
        action,
    )
    system = Record(
        actuators=Record(body=np.array([[0, 1]]), row=row, codes=codes),
        bodies=Record(kind=np.zeros(2)),
    )
    turns = Rotation.random(2, rng=4)
    if action >= ABOUT and action != AXLE:
        turns = Rotation.concatenate([turns[0], turns[0]])  # angles between them are small
    pose[:, :9] = turns.as_matrix().reshape(2, 9)
    pose[:, POSITION : ANGULAR + 3] = random.normal(size=(2, 9))
    state = np.zeros(40)
    state[12 + 6 + 4] = pose[1, ANGULAR : ANGULAR + 3] @ pose[1, [1, 4, 7]] + SPIN
    return system, pose, state


def later(pose, dt):
    """Poses after a time, bodies going on as they do."""
    after = pose.copy()
    after[:, POSITION : POSITION + 3] += dt * pose[:, VELOCITY : VELOCITY + 3]
    turns = Rotation.from_rotvec(dt * pose[:, ANGULAR : ANGULAR + 3])
    after[:, :9] = (
        (turns * Rotation.from_matrix(pose[:, :9].reshape(2, 3, 3))).as_matrix().reshape(2, 9)
    )
    return after


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("action", EVERY)
def test_an_actuator_does_the_work_of_its_force_over_what_it_measures(
    action, sense, monkeypatch, plain
):
    """Its rate is that of its deflection; force times rate is the power taken from both bodies.

    About an axle the wheelset's spin against its own axes counts: they do not turn with it.
    """
    plain(actuators)
    system, pose, state = bodies_and_actuator(action, sense)
    force, dt = 3.0, 1e-6

    def motion(of):
        return actuators.actuator_motion(system, Record(pose=of), state, 0)

    x, rate, *_ = motion(pose)
    if action == LINE:
        assert x == pytest.approx(distance(system, pose) - 0.4)
    if action != AXLE:
        change = (motion(later(pose, dt))[0] - motion(later(pose, -dt))[0]) / (2.0 * dt)
        assert rate == pytest.approx(change, rel=1e-6)
    seen = []
    monkeypatch.setattr(actuators, "actuator_force", lambda *a: seen.append(a[3:]) or force)
    before = pose.copy()
    work = Record(pose=pose)
    assert actuators.add_actuator_forces(system, work, state, action != AXLE) == -1
    assert (pose == before).all()  # those of the other kind alone
    assert actuators.add_actuator_forces(system, work, state, action == AXLE) == -1
    assert seen == [(0, x, rate)]
    power = np.sum(pose[:, FORCE : FORCE + 3] * pose[:, VELOCITY : VELOCITY + 3])
    power += np.sum(pose[:, MOMENT : MOMENT + 3] * pose[:, ANGULAR : ANGULAR + 3])
    if action == AXLE:  # the moment on the wheelset works on its whole spin
        power += SPIN * pose[1, MOMENT : MOMENT + 3] @ pose[1, [1, 4, 7]]
    assert power == pytest.approx(-force * rate)
    assert pose[:, FORCE : FORCE + 3].sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    arms = np.cross(pose[:, POSITION : POSITION + 3], pose[:, FORCE : FORCE + 3])
    moments = (arms + pose[:, MOMENT : MOMENT + 3]).sum(axis=0)
    assert moments == pytest.approx(np.zeros(3), abs=1e-12)


def distance(system, pose):
    """Between the points of the actuator on both bodies."""
    points = system.actuators.row[0, :6].reshape(2, 3, 1)
    ends = (pose[:, :9].reshape(2, 3, 3) @ points)[..., 0] + pose[:, POSITION : POSITION + 3]
    return np.linalg.norm(ends[1] - ends[0])


@pytest.mark.parametrize("angle", [0.0, 0.4, -1.1])
@pytest.mark.parametrize("axis", range(3))
def test_the_angle_of_an_actuator_is_the_sine_of_a_turn_about_its_axis(axis, angle, plain):
    plain(actuators)
    system, pose, state = bodies_and_actuator(ABOUT + axis, 1.0)
    first = Rotation.from_matrix(pose[0, :9].reshape(3, 3))
    pose[1, :9] = (first * Rotation.from_rotvec(angle * np.eye(3)[axis])).as_matrix().ravel()
    x = actuators.actuator_motion(system, Record(pose=pose), state, 0)[0]
    assert x == pytest.approx(np.sin(angle), abs=1e-12)
