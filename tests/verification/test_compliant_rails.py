"""Linear critical speed on rails that yield laterally: plane equations of a bogie, written anew.

Why the coach with flexicoil primary loses 8 m/s on elastic rails and the one with Manchester
primary almost nothing: pads (30 MN/m a rail) and ballast (70 MN/m) stand in series with the creep
forces.
"""

import numpy as np
import pytest
from dynamics import load_track, load_vehicle
from scipy.optimize import brentq

from railsim.stability.critical_speed import critical_speed

ELASTIC, RIGID = (
    load_track("straight").replace(support={"preset": preset}) for preset in ("ballasted", "rigid")
)

# data of both coaches, as their files state them
MASS, INERTIA, FRAME_MASS, FRAME_INERTIA = 1813.0, 1120.0, 2615.0, 3067.0
HALF_BASE, R0, B0 = 1.28, 0.46, 0.75
# stiffness and damping of one axle's guidance along (at 1 m to both sides) and across the track,
# the latter with its distance from the axle towards the middle of the bogie
GUIDANCE = {
    "coach_flexicoil": (47.48e6, 45.8e3, ((5.898e6, 5.9e3, 0.4), (1.701e6, 0.0, 0.0))),
    "coach_manchester": (62.78e6, 30.0e3, ((1.769e6, 4.0e3, 0.0),)),
}
SECONDARY, DAMPER, SECONDARY_YAW = 320e3, 63e3, 341e3  # to a car body that does not move
PAD, BALLAST = (60e6, 300e3), (70e6, 350e3)  # both rails of a wheelset, whole sleeper
CREEP, CONICITY = (1.1e7, 1.0e7), 0.193  # f11, f22 after Kalker, 69 kN; gives 73.5 m/s when rigid


def bogie(coach, speed, compliance):
    """E x' = A x of y and yaw of two wheelsets and a frame, their rates, rails and sleepers."""
    along, damping, across = GUIDANCE[coach]
    stiff, damp = np.zeros((6, 6)), np.zeros((6, 6))

    def element(vector, stiffness, damping):
        for matrix, value in ((stiff, stiffness), (damp, damping)):
            matrix += value * np.outer(vector, vector)

    for first, sign in ((0, 1.0), (2, -1.0)):
        turned = np.zeros(6)
        turned[[first + 1, 5]] = 1.0, -1.0
        element(turned, along, damping)
        for stiffness, c, inwards in across:
            moved = np.zeros(6)
            moved[[first, first + 1, 4, 5]] = (
                1.0,
                -sign * inwards,
                -1.0,
                sign * (inwards - HALF_BASE),
            )
            element(moved, stiffness, c)
    element(np.eye(6)[4], SECONDARY, DAMPER)
    element(np.eye(6)[5], SECONDARY_YAW, 0.0)
    e, a = np.eye(16), np.zeros((16, 16))
    e[6:12, 6:12] = np.diag([MASS, INERTIA, MASS, INERTIA, FRAME_MASS, FRAME_INERTIA])
    a[:6, 6:12], a[6:12, :6], a[6:12, 6:12] = np.eye(6), -stiff, -damp
    (kp, cp), (kb, cb) = ((k / compliance, c) for k, c in (PAD, BALLAST))
    f11, f22 = CREEP
    for y, rail in ((0, 12), (2, 14)):
        yaw, rate, spin, sleeper = y + 1, y + 6, y + 7, rail + 1
        slip, steer = 2.0 * f22 / speed, 2.0 * f11 * B0 * CONICITY / R0
        # lateral creep force on the wheelset: -slip (y' - rail') + 2 f22 yaw
        a[rate, rate] -= slip
        a[rate, yaw] += 2.0 * f22
        e[rate, rail] -= slip
        a[spin, spin] -= 2.0 * f11 * B0**2 / speed
        a[spin, y] -= steer
        a[spin, rail] += steer
        e[rail, [rail, sleeper]] = cp + slip, -cp
        a[rail, [rail, sleeper, rate, yaw]] = -kp, kp, slip, -2.0 * f22
        e[sleeper, [sleeper, rail]] = cb + cp, -cp
        a[sleeper, [sleeper, rail]] = -kb - kp, kp
    return np.linalg.eigvals(np.linalg.solve(e, a))


def closed(coach, compliance):
    """Its critical speed."""

    def growth(speed):
        values = bogie(coach, speed, compliance)
        return np.max(values[(values.imag > 1.0) & (values.imag < 200.0)].real)

    speeds = np.arange(20.0, 100.0)
    k = next(k for k, v in enumerate(speeds) if growth(v) > 0.0)
    return brentq(growth, speeds[k - 1], speeds[k])


def linear(coach, track, low, high):
    """Linear critical speed of a shipped coach, searched between two speeds."""
    how = {"methods": ("linear",), "over_amplitude": False}
    return critical_speed(load_vehicle(coach), track, low=low, high=high, **how).linear.speed


@pytest.mark.parametrize(
    ("coach", "loss", "within"), [("coach_flexicoil", 7.1, 1.5), ("coach_manchester", 1.0, 0.9)]
)
def test_what_lateral_compliance_of_the_rails_costs(coach, loss, within):
    """With one conicity for both coaches; the car body, roll and spin are left out of the closed
    equations, and with them some tenths of the loss."""
    expected = closed(coach, 1e-6) - closed(coach, 1.0)
    assert expected == pytest.approx(loss, abs=0.1)
    near = (RIGID, closed(coach, 1e-6)), (ELASTIC, closed(coach, 1.0))
    speeds = [linear(coach, track, 0.9 * v, 1.1 * v) for track, v in near]
    assert speeds[0] == pytest.approx(closed(coach, 1e-6), rel=0.04)
    assert speeds[0] - speeds[1] == pytest.approx(expected, abs=within)


def test_stiff_pads_and_ballast_across_the_track_are_rigid_rails():
    """Nearly: what remains, 0.8 m/s, is the vertical deflection of the rails."""
    stiff = {"preset": "ballasted", "pad_lateral": [4e10, 1e7], "ballast_lateral": [4e10, 1e7]}
    tracks = RIGID, ELASTIC.replace(support=stiff)
    speeds = [linear("coach_flexicoil", track, 65.0, 80.0) for track in tracks]
    assert speeds[1] == pytest.approx(speeds[0], abs=1.0)
