"""Kernels called by code that others compile with numba: no reference is lost on the way.

railsim's kernels are compiled without reference counting.  Put into a caller that counts, they free
arrays that they do not own; as functions of their own they take and return plain views.
"""

import sys
from pathlib import Path

import numba
import numpy as np

import railsim
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.status import RUNNING
from railsim.model.work import work_arrays
from railsim.simulation import prepare

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from exudyn_contact import contact  # the wheel-rail contact for other programs

CALLS = 10_000


@numba.njit
def many_calls(system, work, states, derivatives):
    """Right-hand side and contact, many times; the worst status."""
    worst = 0
    for _ in range(CALLS):
        status, _, _ = right_hand_sides(system, work, states, derivatives)
        worst = max(worst, abs(status - RUNNING))
        status, _, _ = contact(system, work, states[0, -1], states[0])
        worst = max(worst, abs(status - RUNNING))
    return worst


def test_ten_thousand_calls_leave_all_arrays_alive_and_the_result_the_same(monkeypatch):
    vehicle = railsim.load_vehicle("coach_manchester")
    track = railsim.load_track("curve_r250").with_values({"support.preset": "rigid"})
    prepared = prepare(vehicle, track, railsim.Settings(), 20.0, until=350.0)
    system = prepared.model.system
    work = work_arrays(system)
    arrays = [part for part in work if isinstance(part, np.ndarray)]
    arrays += [part for part in work.patch if isinstance(part, np.ndarray)]
    before = [sys.getrefcount(array) for array in arrays]
    states = prepared.state[None].copy()
    first, last = np.zeros_like(states), np.zeros_like(states)
    right_hand_sides(system, work, states, first)
    contact(system, work, states[0, -1], states[0])  # compiled as usual: parts are on the disk
    # references are counted as the caller is translated; to optimise it takes 20 s
    monkeypatch.setattr(numba.config, "OPT", type(numba.config.OPT)(0))
    assert many_calls(system, work, states, last) == 0
    np.testing.assert_array_equal(first, last)
    assert [sys.getrefcount(array) for array in arrays] == before
