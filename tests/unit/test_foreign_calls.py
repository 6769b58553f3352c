"""Kernels called by code that others compile with numba: no reference is lost on the way.

railsim's kernels are compiled without reference counting.  Put into a caller that counts, they free
arrays that they do not own; as functions of their own they take and return plain views.
"""

import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from selection import points

import railsim
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.status import RUNNING
from railsim.model.work import work_arrays
from railsim.simulation import prepare

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from exudyn_contact import contact, poses  # functions of their own for other programs

CALLS = 10_000


@numba.njit
def many_derivatives(system, work, states, derivatives):
    """Right-hand side, many times; the worst status."""
    worst = 0
    for _ in range(CALLS):
        status, _, _ = right_hand_sides(system, work, states, derivatives)
        worst = max(worst, abs(status - RUNNING))
    return worst


@numba.njit
def many_poses(system, work, states, derivatives):
    """Poses, as often."""
    for _ in range(CALLS):
        poses(system, work, states[0])
    return 0


@numba.njit
def many_contacts(system, work, states, derivatives):
    """Contact, as often; the worst status."""
    worst = 0
    for _ in range(CALLS):
        status, _, _ = contact(system, work, states[0, -1], states[0])
        worst = max(worst, abs(status - RUNNING))
    return worst


@pytest.fixture(scope="module")
def prepared():
    vehicle = railsim.load_vehicle("coach_manchester")
    track = railsim.load_track("curve_r250").with_values({"support.preset": "rigid"})
    return prepare(vehicle, track, railsim.Settings(), 20.0, until=350.0)


def test_functions_for_other_programs_are_compiled_as_the_right_hand_side_is():
    """Without reference counting, which the next test shows of all three."""
    for function in (contact, poses):
        assert type(function) is type(right_hand_sides)
        assert function.targetoptions == right_hand_sides.targetoptions


# contact and poses take 20 and 5 s to compile, and are parts of the right-hand side
@points("many_calls", [many_derivatives, many_poses, many_contacts], always=(0,))
def test_ten_thousand_calls_leave_all_arrays_alive_and_the_result_the_same(
    many_calls, prepared, monkeypatch
):
    system = prepared.model.system
    work = work_arrays(system)
    arrays = [part for part in work if isinstance(part, np.ndarray)]
    arrays += [part for part in work.patch if isinstance(part, np.ndarray)]
    before = [sys.getrefcount(array) for array in arrays]
    states = prepared.state[None].copy()
    first, last, after = np.zeros((3, *states.shape))
    # compiled as usual: parts are on the disk
    right_hand_sides(system, work, states, first)
    if many_calls is many_poses:
        poses(system, work, states[0])
    if many_calls is many_contacts:
        contact(system, work, states[0, -1], states[0])
    # references are counted as the caller is translated; to optimise it takes 20 s
    monkeypatch.setattr(numba.config, "OPT", type(numba.config.OPT)(0))
    assert many_calls(system, work, states, last) == 0
    right_hand_sides(system, work, states, after)
    np.testing.assert_array_equal(first, after)
    if many_calls is many_derivatives:
        np.testing.assert_array_equal(first, last)
    assert [sys.getrefcount(array) for array in arrays] == before
