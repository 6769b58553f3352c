"""Laws that a vehicle on a track obeys whatever its suspension: symmetry, weight, curve balance."""

import numpy as np
import pytest
from dynamics import Settings, advance, changed, evaluate, load_track, load_vehicle, steady

from railsim.definitions.track.definition import Track
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.simulation import simulate


def left_hand(track):
    """The same curve to the left."""
    data = track.model_dump(exclude_none=True)
    for element in data["plan"]:
        for key in ("radius", "radius_start", "radius_end"):
            if key in element:
                element[key] *= -1.0
    for element in data["cant"]:
        for key in ("cant", "cant_start", "cant_end"):
            if key in element:
                element[key] *= -1.0
    return Track.model_validate(data)


def lopsided(vehicle, side):
    """Vehicle with its load to one side, so that it is not its own mirror image."""

    def change(_kind, name, table):
        if name == "carbody":
            table["position"] = [0.0, side * 0.05, table["position"][2]]

    return changed(vehicle, change)


@pytest.fixture(scope="module")
def coach():
    return load_vehicle("coach_manchester")


def test_left_hand_curve_with_the_mirrored_vehicle_mirrors_the_result(coach):
    """To round-off: some 1e-6 N of 1e5 N after thousands of steps."""
    track = load_track("curve_r250")
    right = simulate(lopsided(coach, 1.0), track, speed=20.0, until=420.0)
    left = simulate(lopsided(coach, -1.0), left_hand(track), speed=20.0, until=420.0)
    assert np.max(np.abs(right.Q - left.Q[:, :, ::-1])) < 1e-5
    assert np.max(np.abs(right.Y + left.Y[:, :, ::-1])) < 1e-5
    assert np.max(np.abs(right.wheelset_yaw + left.wheelset_yaw)) < 1e-12
    assert np.ptp(right.Q) > 4e4  # something happened


def test_every_wheel_carries_its_static_load_and_nothing_moves_on_straight_track(coach):
    result = simulate(coach, load_track("straight"), speed=20.0, duration=2.0)
    # the rolling resistance of spin creep (tread inclined to the axle) pulls below the coach's
    # centre of gravity: 5 N per wheelset move 0.7 N of wheel load from rear to front
    assert (result.T_gamma + result.T_gamma_spin)[-1].sum() == pytest.approx(20.0, abs=2.0)
    assert np.max(np.abs(result.Q - result.Q0)) < 1.0
    assert np.max(np.abs(result.body_acceleration[..., [0, 1, 3, 4, 5]])) < 1e-6
    assert np.max(np.abs(result.body_acceleration[..., 2])) < 1e-6
    spin_free = result.body_position[..., [0, 1, 2, 3, 5]]
    assert np.max(np.abs(spin_free - spin_free[0])) < 1e-8


def test_sum_of_static_loads_is_the_weight(coach):
    balance = steady(coach, load_track("straight"), Settings(), 20.0)
    weight = balance.model.system.bodies.mass.sum() * 9.81
    assert balance.Q0.sum() == pytest.approx(weight, rel=1e-9)
    assert balance.residual < 1e-6


def test_friction_zero_works(coach):
    track = load_track("straight").replace(friction=(0.0, 0.0))
    result = simulate(coach, track, speed=20.0, duration=0.5)
    assert result.status == "complete"
    assert np.all(result.T_gamma == 0.0)


@pytest.fixture(scope="module", params=[20.0, pytest.param(12.0, marks=pytest.mark.further)])
def steady_curve(request, coach):
    """State in the middle of a long curve, when everything has settled."""
    speed = request.param
    track = load_track("curve_r250")
    plan = [e.model_dump(exclude_none=True) for e in track.plan]
    cant = [e.model_dump(exclude_none=True) for e in track.cant]
    plan[0]["length"] = cant[0]["length"] = 50.0
    plan[2]["length"] = cant[2]["length"] = 600.0
    track = track.replace(plan=plan, cant=cant)
    balance = steady(coach, track, Settings(), speed)
    state = balance.state
    h = 0.5e-3
    state = advance(
        balance.model.system, state, h, round(600.0 / speed / h), "fast", model=balance.model
    )
    return balance.model, state, speed


def test_wheel_forces_balance_the_bodies_in_a_steady_curve(steady_curve):
    """Newton's law for the whole vehicle, each body at its own position: 0.1 % of the force.

    sum F_rail = sum m (a - g), with a = V^2 kappa towards the curve's centre at each body's own
    radius; track axes of each wheelset and body.
    """
    model, state, speed = steady_curve
    system = model.system
    work, _ = evaluate(system, state)
    kappa, cant = 1.0 / 250.0, np.arcsin(0.15 / 1.5)
    Y = Q = 0.0
    for b, mass in enumerate(system.bodies.mass):
        _, y, z = state[6 * b], state[6 * b + 1], state[6 * b + 2]
        y += system.bodies.nominal[b, 0]
        z += system.bodies.nominal[b, 1]
        # horizontal distance to the right of the centre line, where the curve's centre lies
        right = y * np.cos(cant) - z * np.sin(cant)
        inwards = speed**2 * kappa * (1.0 - kappa * right)
        Y -= mass * (inwards * np.cos(cant) - 9.81 * np.sin(cant))
        Q += mass * (9.81 * np.cos(cant) + inwards * np.sin(cant))
    wheel = work.wheel
    # wheels of the end wheelsets stand at an angle to each other: force along the curve's normal
    assert wheel[..., W_Q].sum() == pytest.approx(Q, rel=1e-3)
    offsets = system.frame_offset[system.bodies.frame[system.contact.body]]
    lateral = (wheel[..., W_Y].sum(axis=1) * np.cos(offsets * kappa)).sum()
    creep = (work.rail_force[system.contact.body, 0] * np.sin(-offsets * kappa)).sum()
    assert lateral + creep == pytest.approx(Y, rel=5e-3)


def test_signs_of_a_right_hand_curve(steady_curve):
    """Leading wheelset outwards (left), nose outwards, rolled with the cone; outer wheel pushes."""
    model, state, speed = steady_curve
    lead, second = model.system.contact.body[:2]
    work, _ = evaluate(model.system, state)
    assert state[6 * lead + 1] < -5e-3
    assert state[6 * lead + 5] < -5e-3
    assert state[6 * lead + 3] > 0.0
    assert work.wheel[0, 0, W_Y] < 0.0 < work.wheel[0, 1, W_Y]
    assert abs(state[6 * second + 5]) < 0.2 * abs(state[6 * lead + 5])
    if speed == 20.0:  # cant deficiency: outer wheels loaded
        assert work.wheel[:, 0, W_Q].sum() > work.wheel[:, 1, W_Q].sum()
