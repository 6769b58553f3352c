"""Signals of a point of a body that rolls, in closed form; the kernel as plain Python."""

import os
import subprocess
import sys

PROGRAM = """
from types import SimpleNamespace as Record
import numpy as np
from railsim.kernels import controllers as kernel

x, y, z, roll, rate = 1.0, -0.02, 0.015, 0.3, 0.7
arm = np.array([5.0, 1.0, -1.6])
turned = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
state = np.array([9.0] * 6 + [x, y, z, roll, 0.0, 0.0])  # the second of two bodies
derivative = np.array([9.0] * 6 + [0.1, 0.2, 0.3, rate, 0.0, 0.0])
work = Record(relative=np.vstack([np.eye(3).ravel(), turned.ravel()]))
row = np.array([[*arm, *[0.0] * 5]])

def read(quantity, component):
    which = np.zeros((1, 16), dtype=int)
    which[0, [kernel.KIND, kernel.OF, kernel.COMPONENT]] = quantity, 1, component
    system = Record(signals=Record(which=which, row=row), bodies=Record(kind=np.zeros(2, int)))
    return kernel.point_signal(system, work, state, derivative, 0)

moved = turned @ arm - arm
swept = rate * np.array([0.0, -(turned @ arm)[2], (turned @ arm)[1]])
for k in range(3):
    np.testing.assert_allclose(read(kernel.POINT_POSITION, k), state[6 + k] + moved[k], atol=1e-14)
    found = read(kernel.POINT_VELOCITY, k)
    np.testing.assert_allclose(found, derivative[6 + k] + swept[k], atol=1e-14)
"""


def test_point_moves_with_its_body_and_about_it():
    """u + (C - 1) r, and u' + omega x C r, in the axes of the track."""
    plain = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=plain, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
