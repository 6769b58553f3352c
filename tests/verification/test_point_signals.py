"""Signals of points of bodies and of mounts, rates of fixed bodies; kernels as plain Python."""

import os
import subprocess
import sys

PROGRAM = """
from types import SimpleNamespace as Record
import numpy as np
from railsim.kernels import controllers as kernel
from railsim.kernels import element_outputs as outputs
from railsim.kernels.driving import turn_fixed
from railsim.kernels.element_columns import MOUNT_SIZE
from railsim.kernels.elements import LAWS_SIZE
from railsim.kernels.state import SPEED
from railsim.kernels.system import FORCE, POSE_SIZE, POSITION
from railsim.kernels.track_frame import FRAME_SIZE, OMEGA

x, y, z, roll, rate = 1.0, -0.02, 0.015, 0.3, 0.7
arm = np.array([5.0, 1.0, -1.6])
turned = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
state = np.array([9.0] * 6 + [x, y, z, roll, 0.0, 0.0])  # the second of two bodies
derivative = np.array([9.0] * 6 + [0.1, 0.2, 0.3, rate, 0.0, 0.0])
work = Record(relative=np.vstack([np.eye(3).ravel(), turned.ravel()]))
row = np.array([[*arm, *[0.0] * 5]])

def read(quantity, component):
    which = np.zeros((1, 16), dtype=int)
    which[0, [kernel.KIND, kernel.OBJECT, kernel.COMPONENT]] = quantity, 1, component
    system = Record(signals=Record(codes=which, row=row), bodies=Record(kind=np.zeros(2, int)))
    return kernel.point_signal(system, work, state, derivative, 0)

moved = turned @ arm - arm
swept = rate * np.array([0.0, -(turned @ arm)[2], (turned @ arm)[1]])
for k in range(3):
    np.testing.assert_allclose(read(kernel.POINT_POSITION, k), state[6 + k] + moved[k], atol=1e-14)
    found = read(kernel.POINT_VELOCITY, k)
    np.testing.assert_allclose(found, derivative[6 + k] + swept[k], atol=1e-14)

# a mount between two turned bodies that move: deflection and rate in the axes of the first

def turn(w):  # Rodrigues' formula
    angle = np.linalg.norm(w)
    K = np.cross(np.eye(3), w / angle)
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K

about = np.array([[0.4, -0.3, 0.5], [-0.6, 0.2, 0.1]])  # also their angular velocities
at, speed = np.array([[0.1, 0.2, -0.3], [0.5, -0.1, 0.4]]), np.array([[0.3, -2, 1], [-1, 0.5, 0.7]])
points = np.array([[1.0, 0.5, -0.7], [-0.4, 0.8, 0.2]])

def attitudes(t):
    return [turn((1.0 + t) * w) for w in about]

def deflection(t):
    R, X = attitudes(t), at + t * speed
    return R[0].T @ (X[1] + R[1] @ points[1] - X[0] - R[0] @ points[0])

pose, row, out = np.zeros((2, POSE_SIZE)), np.zeros((1, MOUNT_SIZE)), np.zeros((1, 20))
pose[:, :9] = np.reshape(attitudes(0.0), (2, 9))
pose[:, POSITION:FORCE] = np.hstack([at, speed, about])
row[0, :7] = *points.ravel(), 1.0
mounts = Record(row=row, body=np.array([[0, 1]]), flags=np.eye(4, dtype=int)[:1],
                law=np.zeros((0, 3), dtype=int))
work = Record(pose=pose, laws=np.zeros(LAWS_SIZE))
outputs.write_mount_output(Record(mounts=mounts, internal=None), work, np.zeros(0), 0, 0, out)
np.testing.assert_allclose(out[0, :3], deflection(0.0), atol=1e-14)
rate = (deflection(1e-5) - deflection(-1e-5)) / 2e-5
np.testing.assert_allclose(out[0, outputs.RATE : outputs.RATE + 3], rate, atol=1e-8)

# a fixed body leans in a frame that turns by w_F per metre: its own rates are V C^T w_F

C = turn([0.0, 0.0, 0.5]) @ turn([0.3, 0.0, 0.0]) @ turn([0.0, -0.2, 0.0])
state, frames = np.zeros(24 + 4), np.zeros((1, FRAME_SIZE))
state[[9, 10, 11, SPEED]] = 0.3, -0.2, 0.5, 20.0
frames[0, OMEGA : OMEGA + 3] = 4e-3, -2e-3, 7e-3
bodies = Record(kind=np.zeros(2, int), fixed=np.array([1]), frame=[0, 0])
turn_fixed(bodies, frames, state)
expected = 20.0 * C.T @ frames[0, OMEGA : OMEGA + 3]
np.testing.assert_allclose(state[21:24], expected, atol=1e-14)
"""


def test_points_mounts_and_fixed_bodies_move_with_their_bodies():
    """u + (C - 1) r, and u' + omega x C r, in the axes of the track; R_1^T g and its derivative."""
    plain = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=plain, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
