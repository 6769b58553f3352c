"""One wheelset held in a pose: the forces of its wheels on the rails."""

from dataclasses import dataclass

import numpy as np
from dynamics import Settings, absolute_frame, changed, load_track, rotation
from rig import test_vehicle
from scipy.optimize import brentq

from railsim.kernels.rhs import right_hand_side
from railsim.kernels.wheel_rail import ANGLE_SIN, T_X, W_Q, W_Y
from railsim.model.assembly import assemble, work_arrays

GRAVITY = 9.81
RADIUS = 0.46


@dataclass(frozen=True)
class Forces:
    """Of the wheels on the rails, left and right: X, Y, Q [N], steepest contact angle [rad]."""

    X: np.ndarray
    Y: np.ndarray
    Q: np.ndarray
    angle: np.ndarray


class HeldWheelset:
    """The tests' single wheelset with other profiles, load per wheel [N] and friction."""

    def __init__(self, load, speed, profile=None, track=None, law="fastsim", **changes):
        def change(kind, _name, table):
            if kind == "wheelsets":
                table["mass"] = 2.0 * load / GRAVITY
                table["profile"] = profile or table["profile"]

        vehicle = changed(test_vehicle("single_wheelset"), change)
        track = (track or load_track("straight")).replace(**changes)
        self.model = assemble(vehicle, track, Settings(creep_law=law))
        self.load, self.speed = load, speed
        self.work = work_arrays(self.model.system)
        self.derivative = np.zeros(self.model.n_state)

    def state(self, y, z, roll, yaw, spin):
        """In the pose, turning at `spin` [rad/s], negative forwards, and with the track's frame."""
        state = np.zeros(self.model.n_state)
        state[1:6] = y, z, roll, 0.0, yaw
        turning = self.speed * absolute_frame(self.model.system, 25.0)[12:15]
        attitude = rotation(yaw, 2) @ rotation(roll, 0)
        state[9:12] = attitude.T @ turning + np.array([0.0, spin, 0.0])
        state[-2:] = 25.0, self.speed
        return state

    def forces(self, y, z, roll, yaw, spin):
        """Forces in the pose."""
        patches = self._evaluate(y, z, roll, yaw, spin)
        work = self.work
        along, angle = np.zeros(2), np.zeros(2)
        for k in range(patches):
            side = work.patch_index[k, 1]
            along[side] += work.patch[T_X, k]
            angle[side] = max(angle[side], abs(np.arcsin(work.patch[ANGLE_SIN, k])))
        wheel = work.wheel[0]
        return Forces(along, wheel[:, W_Y].copy(), wheel[:, W_Q].copy(), angle)

    def height(self, spin):
        """Where the centred wheelset carries its load [m]."""
        return brentq(
            lambda z: self.forces(0.0, z, 0.0, 0.0, spin).Q.sum() - 2 * self.load, -1e-4, 3e-4
        )

    def rates(self, y, z, roll, yaw, spin):
        """Second derivatives of y, z, roll, pitch, yaw in the pose [m/s2, rad/s2]."""
        self._evaluate(y, z, roll, yaw, spin)
        return self.derivative[7:12].copy()

    def _evaluate(self, *pose):
        state = self.state(*pose)
        status, _, patches = right_hand_side(self.model.system, self.work, state, self.derivative)
        assert status == 0
        return patches
