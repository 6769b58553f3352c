"""The published curving study: its numbers, and the same read from a result of railsim.

Source: Grossi (2025), section 6.1.1, see tests/data/SOURCES.md: SIMPACK Rail, R 250 m, 20 m/s.
"""

import csv
from pathlib import Path

import numpy as np

NUMBERS = Path(__file__).parents[1] / "data" / "curving_study_r250.csv"
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
SIGN = {"wheelset_yaw": -1.0, "wheelset_lateral": -1.0}  # right-hand curve: outwards is left
UNIT = {"kN": 1e3, "mrad": 1e-3, "mm": 1e-3, "1": 1.0}


def published(coach):
    """Published values by quantity, with the signs of railsim [SI]."""
    with NUMBERS.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {
        row["quantity"]: SIGN.get(row["quantity"], 1.0) * float(row[coach]) * UNIT[row["unit"]]
        for row in rows
    }


def measured(result, quantity):
    """Value of the leading wheelset in a result, read as the study reads it [SI]."""
    middle = int(np.argmin(np.abs(result.time - MID_CURVE)))
    if quantity == "dQ_over_Q0":
        return result.dQ_over_Q0[:, 0, 0].max()
    if quantity == "Y_over_Q":
        return result.Y_over_Q[middle, 0, 0]
    return result[quantity][middle, 0]
