"""Closed forms of Gritti's lift mechanisms, as oracles for the general kernel.

Angles in rad, lengths in m; arrays over the boom's travel.  A is the angle of the boom's arm.
"""

import numpy as np


def closure(A, B, C, k):
    """Angle x of A sin x + B cos x + C = 0 in assembly k = +1 or -1."""
    R = np.sqrt(A**2 + B**2 - C**2)
    return np.arctan2(-(A * C + k * B * R), -B * C + k * A * R)


def upper(travel, p):
    """Angles delta, phi, gamma and the head's point of the upper four-bar, from the rod's pivot."""
    alpha = p["upper_alpha_in"] + travel
    a, b, c, d, e, h = (p[f"upper_{x}"] for x in "abcdeh")
    A = -2 * e * (h + b * np.sin(alpha))
    B = 2 * e * (a - b * np.cos(alpha))
    C = h**2 + a**2 + b**2 + e**2 - c**2 + 2 * h * b * np.sin(alpha) - 2 * a * b * np.cos(alpha)
    phi = closure(A, B, C, 1)
    gamma = phi - p["upper_beta2"]
    tip = 1j * h + b * np.exp(1j * alpha)
    delta = np.angle(tip - a - e * np.exp(1j * phi))
    head = tip + d * np.exp(1j * gamma)
    slope = b * np.sin(alpha - delta) / (e * np.sin(phi - delta))
    y_b, y_d = 0.5 * b * np.cos(alpha), b * np.cos(alpha) + 0.5 * d * slope * np.cos(gamma)
    y_q = b * np.cos(alpha) + d * slope * np.cos(gamma)
    torque = 9.81 * (p["m_boom"] * y_b + p["m_trapezoid"] * y_d + p["m_head"] * y_q)
    return delta, phi, gamma, head, slope, torque


def length_1(A, p):
    """Lift 1: length between foot and rocker's arm."""
    d1, a1, a2, a3, d2 = (p[x] for x in ("d1", "a1", "a2", "a3", "d2"))

    def rocker(A):
        c = d1 * np.sin(A) - np.sqrt(
            d1**2 * np.sin(A) ** 2 - (a1**2 + d1**2 - a2**2 - 2 * a1 * d1 * np.cos(A))
        )
        return np.arctan2(a1 * np.sin(A) - c * np.cos(A), a1 * np.cos(A) + c * np.sin(A) - d1)

    al3 = p["alpha3_in"] + rocker(A) - rocker(p["alpha1_in"])
    return np.sqrt(a3**2 + d2**2 + 2 * a3 * d2 * np.cos(al3))


def length_2(A, p):
    """Lift 2."""
    return p["x_foot"] - p["c"] / np.tan(A)


def length_3(A, p):
    """Lift 3."""
    s = (p["c"] - p["a1"] * np.sin(A)) / np.cos(A)
    return p["x_foot"] - (p["a1"] * np.cos(A) - s * np.sin(A))


def length_4(A, p):
    """Lift 4; the cosine of the rod's angle is negative."""
    sine = (p["a1"] * np.sin(A) + p["c"]) / p["a2"]
    return p["x_foot"] - (p["a1"] * np.cos(A) + p["a2"] * np.sqrt(1 - sine**2))


def length_5(A, p):
    """Lift 5, k = +1."""
    a1, a2, a3, a4, d = (p[x] for x in ("a1", "a2", "a3", "a4", "d"))
    al2 = closure(
        2 * a1 * a2 * np.sin(A),
        2 * a2 * (a1 * np.cos(A) - d),
        a1**2 + a2**2 + d**2 - 2 * a1 * d * np.cos(A) - a3**2,
        1,
    )
    x = a1 * np.cos(A) + a4 * np.cos(al2 - p["gamma"]) - p["d_x"]
    y = a1 * np.sin(A) + a4 * np.sin(al2 - p["gamma"]) + p["d_y"]
    return np.hypot(x, y)


LENGTHS = {1: length_1, 2: length_2, 3: length_3, 4: length_4, 5: length_5}
