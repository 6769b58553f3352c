"""The published curving study: its numbers, and the same read from a result of railsim.

Source: Grossi (2025), section 6.1.1, see published/curving_study_r250.toml.
"""

import numpy as np

from railsim.definitions.loading import load
from railsim.definitions.published import Published

STUDY = "curving_study_r250"
RIGID = {"preset": "rigid"}  # the study's rails, as far as known
COACHES = ("manchester", "flexicoil")
MID_CURVE = 19.8  # s from the start of the track, where the study reads its values

# What one parameter set reaches without tuning: friction, rail inclination and the rounding of the
# transitions are not stated in the source.
TOLERANCE = {
    "dQ_over_Q0": 0.05,
    "sum_abs_Y": 0.04,
    "Y_over_Q": 0.03,
    "wheelset_roll": 0.08,
    "wheelset_yaw": 0.03,
    "wheelset_lateral": 0.01,
}


def published(coach):
    """Published values by quantity, with the signs of railsim [SI]."""
    found = load(Published, STUDY).values
    return {value.quantity: value.values[f"coach_{coach}"] for value in found}


def measured(result, quantity):
    """Value of the leading wheelset in a result, read as the study reads it [SI]."""
    middle = int(np.argmin(np.abs(result.time - MID_CURVE)))
    if quantity == "dQ_over_Q0":
        return result.dQ_over_Q0[:, 0, 0].max()
    if quantity == "Y_over_Q":
        return result.Y_over_Q[middle, 0, 0]
    return result[quantity][middle, 0]
