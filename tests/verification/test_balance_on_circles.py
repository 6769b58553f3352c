"""Steady curving: every body in balance in one frame of axes, with a suspension written anew.

railsim gives each body a frame of its own on the track; here the whole vehicle stands in the axes
of the track plane under its reference body and turns about the circle's upright axis.
"""

import numpy as np
import pytest
from dynamics import load_vehicle
from suspension import GRAVITY, STEP, Suspension, turn
from test_steady_curving import curving

from railsim.kernels.contact_columns import W_Q, W_Y


def standing(s, radius, cant):
    """Origin and axes of the track at arc length `s`, as seen from those at 0."""
    lean = turn(0, np.arcsin(cant / 1.5)).real
    heading = turn(2, s / radius).real
    centre = radius * np.array([np.sin(s / radius), 1.0 - np.cos(s / radius), 0.0])
    return lean.T @ centre, lean.T @ heading @ lean


def placed_together(table, at, radius, cant):
    """Displacements and angles in the common axes, of those in a body's own frame."""
    nominal = table["at"][0]
    origin, axes = standing(nominal[0], radius, cant)
    r = origin + axes @ (at[:3] + nominal * [0.0, 1.0, 1.0])
    pitch = 0.0 if "radius" in table else at[4]  # a wheelset's axes do not spin
    R = axes @ (turn(2, at[5]) @ turn(0, at[3]) @ turn(1, pitch)).real
    angles = np.arcsin(R[2, 1]), np.arctan2(-R[2, 0], R[2, 2]), np.arctan2(-R[0, 1], R[1, 1])
    return np.array([*(r - nominal), *angles])


def of_weight_and_turning(table, q, radius, cant, speed):
    """Forces on the coordinates of a body: slopes of the potential of gravity and turning."""
    upright = turn(0, np.arcsin(cant / 1.5)).real.T @ [0.0, 0.0, 1.0]
    lever = turn(0, np.arcsin(cant / 1.5)).real.T @ [0.0, radius, 0.0]
    x = q + 1j * STEP * np.eye(6)
    r = table["at"][0] + x[:, :3]
    turning = (
        speed
        / radius
        * (turn(2, x[:, 5]) @ turn(0, x[:, 3]) @ turn(1, x[:, 4])).swapaxes(-1, -2)
        @ upright
    )
    moving = speed / radius * np.cross(upright, r - lever)
    energy = 0.5 * table["mass"] * np.sum(moving**2, axis=-1)
    energy += 0.5 * np.sum(turning**2 * table["inertia"], axis=-1)
    return (energy + table["mass"] * GRAVITY * r @ upright).imag / STEP


@pytest.mark.parametrize(
    ("name", "radius", "cant", "speed"),
    [
        ("coach_manchester", 800.0, 0.15, 40.0),  # on the lateral stops
        ("coach_manchester", -800.0, -0.15, 40.0),
        ("benchmark_vehicle1", 400.0, 0.15, 10.0),  # on them, too much cant
    ],
)
def test_every_body_is_in_balance_on_a_circle(name, radius, cant, speed):
    """Of the bodies forces and moments, of the wheelsets forces; 1e-6 of the car body's weight."""
    coach = load_vehicle(name)
    found, solver, balance = curving(coach, radius, cant, speed)
    model = Suspension(coach.model_dump(exclude_none=True))
    names = balance.model.index.bodies
    q = {
        body: placed_together(model.bodies[body], found[6 * b : 6 * b + 6], radius, cant)
        for b, body in enumerate(names)
    }
    force = {
        body: of_weight_and_turning(model.bodies[body], q[body], radius, cant, speed)
        for body in names
    }
    pulls = [element.pull(np.append(*(q[n] for n, _ in element.ends)))
             for element in model.elements + model.stops]  # fmt: skip
    for element, pull in zip(model.elements + model.stops, pulls, strict=True):
        for k, (body, _) in enumerate(element.ends):
            force[body] = force[body] + pull[6 * k : 6 * k + 6]
    assert max(np.abs(p).max() for p in pulls[len(model.elements) :]) > 500.0  # N, of the stops
    allowed = 1e-6 * GRAVITY * model.bodies["carbody"]["mass"]
    for w, wheelset in enumerate(balance.model.index.wheelsets):
        axes = standing(model.bodies[wheelset]["at"][0][0], radius, cant)[1]
        carried = axes.T @ force.pop(wheelset)[:3]
        Y, Q = solver.work.wheel[w, :, W_Y].sum(), solver.work.wheel[w, :, W_Q].sum()
        assert carried[1:] == pytest.approx([Y, Q], abs=allowed)
    for body, left in force.items():
        held = left[1:] if body == "carbody" else left  # its place along the track is given
        assert held == pytest.approx(0.0 * held, abs=allowed), body
