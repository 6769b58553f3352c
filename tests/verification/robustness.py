"""Curves on elastic rails computed in other ways: half the step, reference scheme, other damping.

A case is a coach, a radius, a friction and a cant deficiency at 100 mm of cant; speed and cant
deficiency belong together.  The ways must agree in status and in the peaks of Q, Y, sum of Y and
Y/Q: `excess` is the largest difference over what is allowed.
"""

import itertools
import math
import re

import numpy as np

from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.simulation import simulate

COACHES = ("coach_manchester", "coach_flexicoil")
RADII = (100.0, 150.0, 190.0, 250.0, 300.0, 500.0, 1000.0)
FRICTIONS = (0.1, 0.3, 0.4, 0.5, 0.6)
DEFICIENCIES = (-0.05, 0.0, 0.10, 0.15)
CANT = 0.10
CASES = tuple(itertools.product(COACHES, RADII, FRICTIONS, DEFICIENCIES))
REFERENCE = {"scheme": "rk4", "step": 0.125e-3}
DAMPING = (1e5, 4e5)  # half and twice the default
RIGID_CASES = ((500.0, 0.30), (250.0, 0.45), (100.0, 0.36), (150.0, 0.40))  # radius, friction
ALLOWED = 0.02, 0.005, 0.01  # of a peak, of Q0; of Y/Q


def curve(radius, friction, support=None):
    """Straight, ramp, 60 m of curve with 100 mm of cant, ramp, straight."""
    ramp = {"type": "CLO", "length": 40.0}
    rise = {"type": "LIR", "length": 40.0}
    straight = {"type": "STR", "length": 50.0}
    level = {"type": "CST", "length": 50.0, "cant": 0.0}
    track = load_track("curve_r250").replace(
        plan=[straight, ramp, {"type": "CIR", "length": 60.0, "radius": radius}, ramp, straight],
        cant=[level, rise, {"type": "CST", "length": 60.0, "cant": CANT}, rise, level],
        friction=friction,
    )
    return track if support is None else track.replace(support=support)


def speed(radius, deficiency):
    """Speed at which the cant lacks `deficiency` [m/s]."""
    return math.sqrt(radius * 9.81 * (CANT + deficiency) / 1.5)


def run(case, support=None, **settings):
    """Result of a case."""
    coach, radius, friction, deficiency = case
    return simulate(
        load_vehicle(coach),
        curve(radius, friction, support),
        speed=speed(radius, deficiency),
        settings=Settings(**settings),
    )


def peaks(result):
    """Largest Q, |Y|, |sum of Y| over Q0, and Y/Q."""
    Q0 = float(result.Q0.mean())
    return np.array(
        [
            result.Q.max() / Q0,
            np.abs(result.Y).max() / Q0,
            np.abs(result.sum_Y).max() / Q0,
            np.nanmax(result.Y_over_Q),
        ]
    )


def excess(result, other):
    """Largest difference of the peaks of two runs over what is allowed; inf for another status."""
    if result.status != other.status:
        return math.inf
    share, of_load, quotient = ALLOWED
    now, then = peaks(result), peaks(other)
    allowed = np.append(np.maximum(share * then[:3], of_load), quotient)
    return float(np.max(np.abs(now - then) / allowed))


def ways(case, support=None, reference=False):
    """Excess of the run at half the step, at half and at twice the contact damping; of `rk4`."""
    result = run(case, support)
    settings = [
        {"step": 0.5 * result.attributes["step"]},
        *({"contact_damping": damping} for damping in DAMPING),
    ]
    if reference:
        settings.append(REFERENCE)
    return [excess(result, run(case, support, **way)) for way in settings], result


def rigid_row(case):
    """Row of the table of rigid rails in `docs/validation/robustness.md`, as text."""
    radius, friction = case
    where = ("coach_manchester", radius, friction, 0.10), {"preset": "rigid"}
    fast = run(*where)
    cells = [f"{100.0 * (peaks(fast)[0] - 1.0):.2f}"]
    said = " ".join(fast.remarks)
    reference = run(*where, **REFERENCE)
    cells.append(f"{100.0 * (peaks(reference)[0] - 1.0):.2f}")
    said += " ".join(reference.remarks)
    vibration = re.findall(r"vibrate at (\d+ Hz: \d+ % of Q0)", said)
    step = f"{1e3 * fast.attributes['step']:.2f}"
    return (f"{radius:g}, {friction:.2f}", step, *cells, "; ".join(vibration))
