"""Creepages and the spin of a wheelset, from positions and velocities in global axes alone."""

import numpy as np
import pytest
from dynamics import (
    Settings,
    absolute_frame,
    advance,
    changed,
    evaluate,
    load_track,
    load_vehicle,
    rotation,
    steady,
)

from railsim.definitions.track.definition import Track
from railsim.kernels.contact_columns import (
    ANGLE_COS,
    ANGLE_SIN,
    C_X,
    C_Y,
    C_Z,
    PATCH_SPEED,
    PHI,
    XI_X,
    XI_Y,
)
from railsim.simulation.run_in import start_state

SPEED = 15.0


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def rail_line(system, point, s):
    """Line that the rail's section draws through a point: its speed over that of s, direction.

    Lateral and vertical distance of the point from the centre line stay the same along it.
    """
    for _ in range(5):  # the cross-section in which the point lies
        frame = absolute_frame(system, s)
        attitude = frame[3:12].reshape(3, 3)
        x, y, z = attitude.T @ (point - frame[:3])
        s += x
    ends = []
    for at in (s - 1e-3, s + 1e-3):
        frame = absolute_frame(system, at)
        ends.append(frame[:3] + frame[3:12].reshape(3, 3) @ [0.0, y, z])
    along = (ends[1] - ends[0]) / 2e-3
    return np.linalg.norm(along), along / np.linalg.norm(along), attitude


@pytest.mark.parametrize("start", [40.0, 150.0])
def test_creepage_is_the_velocity_of_the_material_against_the_rail_at_the_patch(coach, start):
    """R 150 m, on the transition and in the circle: kappa (x + c_x) and V (1 - kappa y) count."""
    track = Track.model_validate(
        {
            "format": "railsim-track/1",
            "name": "R 150 m",
            "support": {"preset": "rigid"},
            "plan": [
                {"type": "STR", "length": 10.0},
                {"type": "CLO", "length": 60.0},
                {"type": "CIR", "length": 200.0, "radius": 150.0},
            ],
            "cant": [
                {"type": "CST", "length": 10.0, "cant": 0.0},
                {"type": "LIR", "length": 60.0},
                {"type": "CST", "length": 200.0, "cant": 0.12},
            ],
        }
    )
    balance = steady(coach, track, Settings(), SPEED)
    system, n = balance.model.system, balance.model.index.n_bodies
    state, _ = start_state(balance.model, balance, track, start, 1e-3, 0)
    work, _ = evaluate(system, state)
    for k in range(np.count_nonzero(work.patch[ANGLE_COS])):
        w, _side, _ = work.patch_index[k]
        b = system.contact.body[w]
        frame = absolute_frame(system, state[-2] + system.frame_offset[system.bodies.frame[b]])
        A, omega = frame[3:12].reshape(3, 3), SPEED * frame[12:15]
        q, v = state[6 * b : 6 * b + 6], state[6 * (n + b) : 6 * (n + b) + 6]
        r = q[:3] + np.array([0.0, *system.bodies.nominal[b]])
        C = rotation(q[5], 2) @ rotation(q[3], 0)
        c = work.patch[[C_X, C_Y, C_Z], k]
        spin = A @ C @ v[3:]
        centre = A @ (np.array([SPEED, 0.0, 0.0]) + np.cross(omega, r) + v[:3])
        material = centre + np.cross(spin, A @ c)
        stretch, along, section = rail_line(
            system, frame[:3] + A @ (r + c), state[-2] + system.frame_offset[system.bodies.frame[b]]
        )
        tangent = section @ [0.0, work.patch[ANGLE_COS, k], -work.patch[ANGLE_SIN, k]]
        tangent -= along * (along @ tangent)
        normal = np.cross(along, tangent)
        rolling = stretch * SPEED + v[0]
        found = work.patch[[XI_X, XI_Y], k]
        expected = np.array([along @ material, tangent @ material]) / rolling
        # the curve within 15 mm of the frame as its tangent, slopes of 2 mrad squared
        np.testing.assert_allclose(found, expected, atol=2e-6)
        # on the transition the section twists by 1e-5 rad from the frame to the patch
        assert work.patch[PHI, k] == pytest.approx(normal @ spin / rolling, abs=5e-5)
        assert work.patch[PATCH_SPEED, k] == pytest.approx(rolling, rel=1e-5)


def raised(coach, height):
    """The coach with its primary springs' seats above the axle."""

    def change(kind, name, table):
        if kind == "elements" and name == "primary":
            x, y, z = table["point"]
            table["point"] = [x, y, z - height]

    return changed(coach, change)


def spin_moment(system, state):
    """Moment that turns each wheelset about its axle, and that of its contacts [N m]."""
    work, derivative = evaluate(system, state)
    n = len(system.bodies.kind)
    total, contact = [], []
    for b in system.contact.body:
        q = state[6 * b : 6 * b + 6]
        C = rotation(q[5], 2) @ rotation(q[3], 0)
        total.append(system.bodies.inertia[b, 1] * derivative[6 * (n + b) + 4])
        contact.append((C.T @ work.rail_force[b, 3:6])[1])
    return np.array(total), np.array(contact)


def test_springs_beside_the_axle_do_not_turn_it(coach):
    """A seat 0.3 m above the axle, wheelsets 1 mm ahead: 60 kN of spring force, no moment."""
    balance = steady(raised(coach, 0.3), load_track("straight"), Settings(), SPEED)
    system, state = balance.model.system, balance.state.copy()
    for b in system.contact.body:
        state[6 * b] += 1e-3
    total, contact = spin_moment(system, state)
    # gyroscopic terms vanish on the straight; 9 kN m would be that of the springs
    np.testing.assert_allclose(total, contact, atol=1e-6)


def test_given_torque_on_a_wheelset_turns_it(coach):
    """A drive of 2 kN m on every axle is in balance with 2 kN m / r of creep force."""
    data = coach.model_dump(exclude_none=True)
    data["assemblies"]["bogie"]["assemblies"]["axle"]["elements"]["drive"] = {
        "kind": "applied_force",
        "bodies": ["wheelset"],
        "torque_table": [[0.0, 0.0, -2e3, 0.0]],
    }
    driven = type(coach).model_validate(data)
    balance = steady(driven, load_track("straight"), Settings(), SPEED)
    state = advance(balance.model.system, balance.state, 0.5e-3, 400, model=balance.model)
    total, contact = spin_moment(balance.model.system, state)
    # the inner axles are placed turned about, and their torques with them
    np.testing.assert_allclose(total - contact, [-2e3, 2e3, -2e3, 2e3], rtol=1e-6)
