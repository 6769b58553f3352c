"""Slopes by which the forces on elastic rails are foreseen, against differences of the forces."""

import numpy as np
import pytest
from dynamics import Settings, evaluate, load_vehicle, steady

from railsim.definitions.loading import load_track
from railsim.kernels.contact_columns import FOOT_X, FOOT_X_PER_YAW, J_NORMAL, J_SLIP, NORMAL
from railsim.kernels.contact_table import FLANGE, FLANGE_ROOT, TREAD
from railsim.kernels.support import (
    D_Y_SLIP,
    LMS,
    PATCHES,
    RATE,
    STEP_RATIO,
    SUPPORT_SIZE,
    D,
    K,
    support_begin,
)
from railsim.simulation import simulate

SPEED = 20.0
GUIDING = (1 << FLANGE_ROOT) + (1 << FLANGE)  # set of patches of a guiding wheel


@pytest.fixture(scope="module")
def curving():
    """System and state of a coach in the curve of 250 m, and a track's place in the state."""
    coach, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    end = simulate(coach, track, speed=SPEED, until=400.0).groups["state"]["end"]
    system = steady(coach, track, Settings(), SPEED).model.system
    state, first = np.array(end), support_begin(system)
    for w in range(4):  # what slopes have learnt comes on top
        state[first + SUPPORT_SIZE * w :][LMS:STEP_RATIO] = 0.0
    return system, state, first


def derivative(system, state, index, step):
    """Of the forces on all rails over one entry of the state."""
    forces = []
    for change in (step, -step):
        trial = state.copy()
        trial[index] += change
        forces.append(evaluate(system, trial)[0].support[:, :, :2])
    return (forces[0] - forces[1]) / (2.0 * step)


def wheels(system, state):
    """Number, side and slopes of every wheel."""
    slopes = evaluate(system, state)[0].support
    return [(w, side, slopes[w, side]) for w in range(4) for side in range(2)]


def test_wheels_run_on_the_tread_and_guide_at_two_patches(curving):
    system, state, _ = curving
    assert {own[PATCHES] for _, _, own in wheels(system, state)} == {1 << TREAD, GUIDING}


def test_slopes_over_a_rails_motion(curving):
    """Of Y and Q over y and z; at two patches each bends the surface below the other.

    The slope of the lateral creep force over the normal one is the least exact on the tread.
    """
    system, state, first = curving
    for w, side, own in wheels(system, state):
        begin = first + SUPPORT_SIZE * w + 2 * side
        within = (60e6, 60e6, 25e6, 25e6) if own[PATCHES] == GUIDING else (3e6, 1e6, 25e6, 3e6)
        for k, axis in ((K, 0), (K + 1, 1)):
            found = -derivative(system, state, begin + axis, 2e-8)[w, side]
            assert abs(own[k] - found[0]) < within[2 * axis]
            assert abs(own[k + 3] - found[1]) < within[2 * axis + 1]
        found = -derivative(system, state, begin + RATE, 1e-5)[w, side]
        about = 60e3 if own[PATCHES] == GUIDING else 25e3
        assert own[[D, D + 3]] == pytest.approx(found, abs=about)


def test_a_yawed_wheelset_slips_along_the_inclined_patch(curving):
    """By 1/cos of the contact angle more than across the rail."""
    system, state, _ = curving
    for w, side, own in wheels(system, state):
        found = derivative(system, state, 6 * system.contact.body[w] + 5, 1e-6)[w, side] / -SPEED
        about = 80e3 if own[PATCHES] == GUIDING else 25e3
        assert own[D_Y_SLIP : D_Y_SLIP + 2] == pytest.approx(found, abs=about)


def test_damping_by_the_contacts_is_the_slope_of_their_forces():
    """On rigid rails, of y, z and roll over their rates, guiding and not: within 15 % of each."""
    coach, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    track = track.replace(support={"preset": "rigid"})
    state = simulate(coach, track, speed=SPEED, start=390.0, duration=0.1).groups["state"]["end"]
    system, upper = steady(coach, track, Settings(), SPEED).model.system, np.triu_indices(3)
    for b in system.contact.body:
        row, across = evaluate(system, state)[0].contact_jacobian[b].copy(), np.zeros((3, 3))
        across[upper] = across.T[upper] = row[J_SLIP:J_NORMAL]
        found, forces = across + row[J_NORMAL : J_NORMAL + 9].reshape(3, 3), []
        for change in np.vstack([np.eye(3), -np.eye(3)]) * 1e-5:
            trial = state.copy()
            trial[6 * (len(system.bodies.kind) + b) + 1 :][:3] += change
            forces.append(evaluate(system, trial)[0].rail_force[b, 1:4].copy())
        expected = (np.array(forces[3:]) - forces[:3]).T / 2e-5
        assert found == pytest.approx(expected, abs=0.15 * np.abs(expected).max())


@pytest.mark.parametrize(("vehicle", "speed"), [("coach_manchester", 30.0), ("wagon_y25", 25.0)])
def test_a_rails_slope_is_no_slip(vehicle, speed):
    """On irregular rails forces are foreseen so well that next to no contact is evaluated again."""
    rough = {"type": "random", "spectrum": "erri_b176_low", "seed": 3}
    track = load_track("straight").replace(irregularities=[rough])
    did = simulate(load_vehicle(vehicle), track, speed=speed, until=200.0).attributes
    assert did["contacts_evaluated_again"] < 0.02 * 4 * did["steps"]


def test_a_patch_moves_ahead_by_the_yaw_of_its_wheel():
    """On both sides, as differences of two evaluations show."""
    balance = steady(load_vehicle("coach_manchester"), load_track("straight"), Settings(), 20.0)
    found = []
    for yaw in (-1e-4, 1e-4):
        state = balance.state.copy()
        state[6 * balance.model.system.contact.body + 5] = yaw
        found.append(evaluate(balance.model.system, state)[0].patch)
    carries = (found[0][NORMAL] > 0.0) & (found[1][NORMAL] > 0.0)
    per_yaw = (found[1] - found[0])[FOOT_X, carries] / 2e-4
    assert np.ptp(per_yaw) > 0.1
    given = found[0][FOOT_X_PER_YAW, carries]
    np.testing.assert_allclose(given, per_yaw, rtol=1e-4)
