"""Wear of rails over the tonnage of a mix of traffic, updated at each step."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.assessment.wear import WearLaw
from railsim.assessment.wear_depth import rail_depth
from railsim.constants import GRAVITY
from railsim.definitions import Track, Vehicle
from railsim.notation import SIDES
from railsim.profiles import load_profile
from railsim.result import Result
from railsim.studies.wear_loop import Loop, Run, Wearing, WearStep, carry_out, row, since_new


def rail_wear(
    track: Track, traffic: Sequence[tuple[Vehicle, float, float]], **how: Any
) -> list[WearStep]:
    """Wear of both rails of a track under mixed traffic, with updated profiles at each step.

    The mean over the track is worn off: let it be of one curvature.  The wheels remain as they are.

    `traffic`: vehicles with their speeds [m/s] and shares of the tonnage, in any unit; `how`:
    `Loop`: ``step`` [kg] and ``steps`` are required. Raises InputError, ModelError: as of
    `wear_loop`.
    """
    rails = dict(zip(SIDES, track.rail, strict=True))
    sides = {side: f"{rail}, {side}" for side, rail in rails.items()}
    new = {side: replace(load_profile(rails[side]), name=name) for side, name in sides.items()}
    # the two rails wear apart, so they have names of their own
    apart = track.replace(rail=list(sides.values()))
    runs = [Run(vehicle, apart, speed, share) for vehicle, speed, share in traffic]

    def depths(result: Result, law: WearLaw) -> dict[str, Floats]:
        load = float(np.sum(result["Q0"])) / GRAVITY
        passes = range(len(result.wheelsets))
        both = (sum(rail_depth(result, w, side, law) for w in passes) for side in (0, 1))
        return {side: np.asarray(depth / load) for side, depth in zip(SIDES, both, strict=True)}

    needed: dict[str, Any] = {"outputs": ("contact_patches", "track"), "unit": "Mt", "scale": 1e-9}
    return carry_out(Wearing(runs, new, sides, depths, parameter="traffic", **needed), Loop(**how))


def rail_rows(steps: Sequence[WearStep]) -> dict[str, list[dict[str, float | None]]]:
    """Wear of both rails after each step of `rail_wear`, by side.

    `distance` is the tonnage [kg]; `area`, `deepest` and `deepest_y` (from the rail's middle, field
    side positive) as of `wear_rows`.
    """
    return {side: [row(*state) for state in since_new(steps, side)] for side in SIDES}
