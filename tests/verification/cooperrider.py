"""Cooperrider's bogie: equations and numbers of a system that railsim's stability tools run on.

Two wheelsets (lateral q1, q3; yaw q2, q4) and a frame (lateral q5, yaw q6, roll q7) that carries a
car fixed to ground.  Cooperrider (1972), ASME Journal of Engineering for Industry 94; Kaas-Petersen
(1986), Acta Mechanica 61: equations.  Masses after the same; stiffnesses and dampings of the DYTSI
input files (Technical University of Denmark); creep force of Vermeulen and Johnson (1964); C after
Hassard's worksheet.  The published Hopf speed of this set is "about 68.66" (bifurcation.de).
"""

from math import sqrt

import numpy as np
from numba import njit

from railsim.stability.motion import Stretch

M_W, M_F, I_W, I_FY, I_FR = 1022.0, 2918.0, 678.0, 6780.0, 6780.0
K1, K2, K3, K4, K5, K6 = 1.823e6, 3.646e6, 3.646e6, 0.1823e6, 0.3333e6, 2.710e6
D1, D2, D6 = 20.0e3, 29.2e3, 500.0
B, H1, H2, L1, L2 = 1.074, 0.0762, 0.6584, 0.620, 0.680
A, R0, CONICITY = 0.7163, 0.4572, 0.05
C, MU_N, PHI, PSI = 6.563e6, 10.0e3, 0.60252, 0.54219
K0, CLEARANCE = 14.60e6, 9.1e-3

NAMES = (
    "leading.y",
    "leading.yaw",
    "trailing.y",
    "trailing.yaw",
    "frame.y",
    "frame.yaw",
    "frame.roll",
)
NAMES = (*NAMES, *(f"{name}'" for name in NAMES))


@njit(cache=True)
def creep_forces(y, yaw, y_rate, yaw_rate, speed):
    """F_x, F_y of one wheelset: Vermeulen and Johnson's law on the resulting creepage."""
    xi_x = y_rate / speed - yaw
    xi_y = A * yaw_rate / speed + CONICITY * y / R0
    xi = sqrt((xi_x / PSI) ** 2 + (xi_y / PHI) ** 2)
    u = C * xi / MU_N
    force = MU_N * (u - u**2 / 3.0 + u**3 / 27.0) if u < 3.0 else MU_N
    # F_R / xi_R tends to C as the creepage vanishes
    secant = force / xi if xi > 1e-14 else C
    return xi_x * secant / PSI, xi_y * secant / PHI


@njit(cache=True)
def flange(y):
    return K0 * np.sign(y) * max(abs(y) - CLEARANCE, 0.0)


@njit(cache=True)
def write_rate(x, speed, out):
    """Write the state derivative, float64[14]."""
    q, v = x[:7], x[7:]
    A1 = 2.0 * K1 * (q[0] - q[4] - B * q[5] - H1 * q[6])
    A2 = 2.0 * K1 * (q[2] - q[4] + B * q[5] - H1 * q[6])
    A3 = 2.0 * K2 * L1**2 * (q[1] - q[5])
    A4 = 2.0 * K2 * L1**2 * (q[3] - q[5])
    A5 = 2.0 * D2 * (v[4] - H2 * v[6]) + 2.0 * K4 * (q[4] - H2 * q[6])
    A6 = K6 * q[5] + D6 * v[5]
    A7 = 2.0 * D1 * L2**2 * v[6] + (2.0 * K5 * L2**2 + 4.0 * K3 * L1**2) * q[6]
    fx1, fy1 = creep_forces(q[0], q[1], v[0], v[1], speed)
    fx2, fy2 = creep_forces(q[2], q[3], v[2], v[3], speed)
    for i in range(7):
        out[i] = v[i]
    out[7] = (-A1 - 2.0 * fx1 - flange(q[0])) / M_W
    out[8] = (-A3 - 2.0 * A * fy1) / I_W
    out[9] = (-A2 - 2.0 * fx2 - flange(q[2])) / M_W
    out[10] = (-A4 - 2.0 * A * fy2) / I_W
    out[11] = (A1 + A2 - A5) / M_F
    out[12] = (B * (A1 - A2) + A3 + A4 - A6) / I_FY
    out[13] = (H1 * (A1 + A2) + H2 * A5 - A7) / I_FR


def rate(x, speed):
    """State derivative, float64[14]."""
    out = np.empty(14)
    write_rate(x, speed, out)
    return out


@njit(cache=True)
def path(x, begin, end, h, steps):
    """States along a motion whose speed goes evenly from `begin` to `end`, by Runge and Kutta."""
    found, at, slope = np.empty((steps + 1, 14)), np.empty(14), np.empty(14)
    for i in range(14):  # loops: expressions of arrays take seconds to compile
        found[0, i] = x[i]
    change = (end - begin) / steps
    for k in range(steps):
        v, now, after = begin + k * change, found[k], found[k + 1]
        for i in range(14):
            at[i] = after[i] = now[i]
        for stage in range(4):
            write_rate(at, v + 0.5 * ((stage + 1) // 2) * change, slope)
            for i in range(14):
                after[i] += h / 6.0 * (2.0 if stage in (1, 2) else 1.0) * slope[i]
                at[i] = now[i] + (h if stage == 2 else 0.5 * h) * slope[i]
    return found


class Periods:
    """Flow of the bogie for the search of periodic motions."""

    def __init__(self, steps=500):
        self.steps = steps

    def after(self, states, durations, speeds):
        return np.array(
            [
                path(x, v, v, duration / self.steps, self.steps)[-1]
                for x, duration, v in zip(states, durations, speeds, strict=True)
            ]
        )

    def amplitude(self, state, duration, speed):
        y = path(state, speed, speed, duration / self.steps, self.steps)[:, 0]
        return 0.5 * (np.max(y) - np.min(y))


class Rolling:
    """Motion of the bogie for ramps and diagrams."""

    step, every = 1e-3, 5

    def rest(self, speed, amplitude):
        state = np.zeros(14)
        state[[0, 2]] = amplitude
        return state

    def stretch(self, state, begin, end, duration):
        steps = round(duration / self.step)
        seen = path(state, begin, end, self.step, steps)
        rows = seen[: -1 : self.every, [0, 2]]
        time = self.step * self.every * np.arange(len(rows))
        return Stretch(seen[-1], time, rows, np.zeros_like(rows))
