"""Force elements against their own laws: motion prescribed, force read."""

import numpy as np
import pytest
from rig import Rig
from scipy.optimize import brentq
from selection import points

X, Y, Z = range(3)


def triangle(amplitude, frequency):
    """Zigzag from 0 upwards, and its rate."""

    def position(t):
        phase = (t * frequency + 0.25) % 1.0
        return amplitude * (1.0 - 4.0 * abs(phase - 0.5))

    def rate(t):
        phase = (t * frequency + 0.25) % 1.0
        return 4.0 * amplitude * frequency * (1.0 if phase < 0.5 else -1.0)

    return position, rate


def harmonic(amplitude, frequency):
    """Sine, and its rate."""
    omega = 2.0 * np.pi * frequency
    return lambda t: amplitude * np.sin(omega * t), lambda t: amplitude * omega * np.cos(omega * t)


def last_period(rig, axis, motion, frequency, periods=2, steps=1000):
    """Deflections and forces over the last of several periods."""
    time = np.arange(periods * steps) / (frequency * steps)
    force = rig.history(axis, time, *motion)
    deflection = np.array([motion[0](t) for t in time])
    return deflection[-steps:], force[-steps:]


def loop_area(deflection, force):
    """Integral of F dd around one period."""
    after = np.roll(force, -1)
    return np.sum(0.5 * (force + after) * (np.roll(deflection, -1) - deflection))


def component(deflection, force):
    """Complex stiffness of a harmonic motion's last period."""
    return np.fft.fft(force)[1] / np.fft.fft(deflection)[1]


# friction -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", [triangle, harmonic])
def test_loop_of_constant_friction_has_masings_area(motion):
    """4 F (A - F/k_t): sliding both ways less the elastic travel at each turn (Masing 1926).

    Within 0.1 %: the corners are met to one step of 1/1000 of a period.
    """
    rig = Rig(kind="friction", friction_force=[0.0, 0.0, 4e3], stick_stiffness=[0.0, 0.0, 4e6])
    d, f = last_period(rig, Z, motion(0.01, 1.0), 1.0)
    assert loop_area(d, f) == pytest.approx(4 * 4e3 * (0.01 - 4e3 / 4e6), rel=1e-3)
    assert np.max(np.abs(f)) <= 4e3 * (1.0 + 1e-12)


def test_loop_of_leaf_spring_friction_grows_with_the_load():
    """A figure between F = +-mu |N(z)| with elastic flanks; its area by the shoelace formula."""
    mu, k, k_t, N, A = 0.1, 1e6, 4e6, -5e4, 0.02
    rig = Rig(
        kind="friction",
        friction_coefficient=[0.0, 0.0, mu],
        stiffness=[0.0, 0.0, k],
        stick_stiffness=[0.0, 0.0, k_t],
        preload=[0.0, 0.0, N],
    )
    d, f = last_period(rig, Z, triangle(A, 1.0), 1.0)

    def limit(z):
        return mu * abs(N + k * z)

    turned = brentq(lambda z: limit(A) + k_t * (z - A) + limit(z), -A, A)
    returned = brentq(lambda z: -limit(-A) + k_t * (z + A) - limit(z), -A, A)
    x = np.array([A, turned, -A, returned])
    y = np.array([limit(A), -limit(turned), -limit(-A), limit(returned)])
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert loop_area(d, f - N - k * d) == pytest.approx(area, rel=1e-3)


def test_a_sticking_pad_is_a_spring_without_loss_and_does_not_creep():
    """Below the limit the loop is closed, and a held pad keeps its force for ever."""
    rig = Rig(kind="friction", friction_force=[0.0, 4e3, 0.0], stick_stiffness=[0.0, 4e6, 0.0])
    d, f = last_period(rig, Y, harmonic(0.9e-3, 1.0), 1.0)
    assert abs(loop_area(d, f)) < 1e-6 * 4e3 * 0.9e-3
    assert f == pytest.approx(4e6 * d, abs=1e-5 * 4e3)
    held = rig.history(Y, np.linspace(0.0, 100.0, 200), lambda t: 0.5e-3, lambda t: 0.0)
    assert np.ptp(held) == 0.0


@pytest.mark.parametrize("speed", [1e-5, 0.02, 1.0])
@pytest.mark.parametrize("kind", ["friction", "side_bearer", "centre_plate"])
def test_steady_sliding_takes_the_friction_of_its_speed(kind, speed):
    """L (r + (1 - r) exp(-v/v_s)), in an oblique direction too (Bo, Pavelescu 1982)."""
    mu, N, r, v_s = 0.3, 5e4, 0.4, 0.05
    falls = {"sliding_ratio": r, "stribeck_speed": v_s}
    law = {
        "side_bearer": pressed(N, mu, **falls),
        "friction": {
            "kind": kind,
            "friction_force": [mu * N, mu * N, 0.0],
            "stick_stiffness": [2e7, 2e7, 0.0],
            **falls,
        },
        "centre_plate": {**pressed(N, mu, **falls), "kind": kind, "radius": 0.2},
    }[kind]
    direction = np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    time = np.linspace(0.0, 0.01 / speed, 40)
    path = Rig(**law).path(time, lambda t: speed * t * direction, lambda t: speed * direction)
    steady = mu * N * (r + (1.0 - r) * np.exp(-speed / v_s))
    assert path[-1, :2] == pytest.approx(steady * direction[:2], rel=1e-9)


# sliding in any direction -------------------------------------------------------------------------


def pressed(load, friction=0.3, **other):
    """A pad between both bodies of the rig; `load` presses it in the nominal position [N]."""
    return {
        "kind": "side_bearer",
        "stiffness": 1e6,
        "preload": load,
        "friction_coefficient": friction,
        "stick_stiffness": 2e7,
        **other,
    }


def pulled(rig, direction, way=0.02, steps=400, held=(0.0,) * 6):
    """Forces along a straight way into one direction, from the position `held`."""
    time = np.linspace(0.0, 1.0, steps)
    return rig.path(time, lambda t: held + way * t * direction, lambda t: way * direction)


@points("angle", np.radians([0.0, 30.0, 45.0, 120.0, 250.0]), always=(1, 4))
@pytest.mark.parametrize("kind", ["friction", "side_bearer", "centre_plate"])
def test_static_capacity_is_mu_N_in_every_direction(kind, angle):
    """A limit for each axis gives up to sqrt(2) mu N; Coulomb's law does not know the axes."""
    mu, N = 0.3, 5e4
    both = [mu, mu, 0.0]
    law = {
        "side_bearer": pressed(N, mu),
        "friction": {
            "kind": kind,
            "friction_coefficient": both,
            "stick_stiffness": [2e7, 2e7, 0.0],
            "stiffness": [0.0, 0.0, 1e6],
            "preload": [0.0, 0.0, N],
        },
        "centre_plate": {**pressed(N, mu), "kind": kind, "radius": 0.178},
    }[kind]
    direction = np.array([np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0, 0.0])
    force = pulled(Rig(**law), direction)[-1, :2]
    assert force == pytest.approx(mu * N * direction[:2], abs=1e-9 * N)


def test_limits_for_each_axis_can_be_kept():
    law = {
        "kind": "friction",
        "friction_force": [3e3, 4e3, 0.0],
        "stick_stiffness": [2e7, 2e7, 0.0],
    }
    diagonal = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    apart = pulled(Rig(**law, friction_limit="axes"), diagonal)[-1, :2]
    assert apart == pytest.approx([3e3, 4e3])
    together = pulled(Rig(**law), diagonal)[-1, :2]
    assert np.hypot(*(together / [3e3, 4e3])) == pytest.approx(1.0)


@pytest.mark.parametrize("angle", np.radians([10.0, 40.0, 75.0, 130.0, 200.0]))
@pytest.mark.parametrize("sticking", [(8e6, 2e6), (2e6, 8e6)])
def test_sliding_force_has_the_direction_of_sliding_whatever_the_stick_stiffness(sticking, angle):
    """Coulomb's law: the force of a steadily sliding pad is against its slip, to 1 degree at most.

    Forces taken back along themselves kept the direction of the sticking force, 37 degrees off.
    """
    law = {
        "kind": "friction",
        "friction_force": [4e3, 4e3, 0.0],
        "stick_stiffness": [*sticking, 0.0],
    }
    direction = np.array([np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0, 0.0])
    force = pulled(Rig(**law), direction, way=0.04)[-1, :2]
    assert force == pytest.approx(4e3 * direction[:2], abs=4e3 * np.radians(0.1))


def test_pad_with_unequal_limits_takes_the_greatest_power():
    """Sliding v: of all forces within the ellipse of the limits L that of L_i^2 v_i takes most."""
    limits, direction = np.array([3e3, 4e3]), np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    law = {"kind": "friction", "friction_force": [*limits, 0.0], "stick_stiffness": [8e6, 2e6, 0.0]}
    force = pulled(Rig(**law), direction, way=0.04)[-1, :2]
    assert force @ direction[:2] == pytest.approx(np.hypot(*(limits * direction[:2])), rel=1e-6)


def test_sliding_around_a_circle_turns_the_force_with_it():
    """Once around at constant |v| the force follows the way; its work is mu N times the way.

    It lags by the elastic way mu N/k_t over the radius; energy within 1 %.
    """
    mu, N, radius = 0.3, 5e4, 0.05
    rig = Rig(**pressed(N, mu))
    time = np.linspace(0.0, 2.0, 4001)
    turn = 2.0 * np.pi

    def position(t):
        return radius * np.array([np.cos(turn * t) - 1.0, np.sin(turn * t), 0.0, 0.0, 0.0, 0.0])

    def rate(t):
        return radius * turn * np.array([-np.sin(turn * t), np.cos(turn * t), 0.0, 0.0, 0.0, 0.0])

    force = rig.path(time, position, rate)[2000:-1, :2]
    assert np.hypot(*force.T) == pytest.approx(mu * N, rel=1e-3)
    v = np.array([rate(t)[:2] for t in time[2000:-1]])
    work = np.sum(force * v) * (time[1] - time[0])
    assert work == pytest.approx(mu * N * 2.0 * np.pi * radius, rel=0.01)


def test_no_pressure_no_grip_and_no_tension():
    """A pad that is lifted holds nothing in any direction, and grips again when it comes down."""
    N, k = 5e4, 1e6
    rig = Rig(**pressed(N, damping=2e4))
    x = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert pulled(rig, x)[-1, 0] == pytest.approx(0.3 * N)
    above = np.array([0.02, 0.0, -0.06, 0.0, 0.0, 0.0])  # N/k = 50 mm: lifted by 10 mm
    lifted = pulled(rig, x, held=above)
    assert np.all(lifted[1:, :3] == 0.0)
    assert pulled(rig, x, held=np.array([0.04, 0.0, -0.03, 0.0, 0.0, 0.0]))[-1, 0] == (
        pytest.approx(0.3 * (N - 0.03 * k))
    )
    # going up fast the damper does not hold it down
    assert rig.forces(np.zeros(6), np.array([0.0, 0.0, -10.0, 0.0, 0.0, 0.0]))[2] == 0.0


@pytest.mark.parametrize("preload", [5e4, -5e4])
def test_a_leaf_spring_grips_only_in_the_direction_of_its_preload(preload):
    rig = Rig(
        kind="friction",
        friction_coefficient=[0.3, 0.3, 0.0],
        stick_stiffness=[2e7, 2e7, 0.0],
        stiffness=[0.0, 0.0, 1e6],
        preload=[0.0, 0.0, preload],
    )
    gone = np.array([0.0, 0.0, -0.06 * np.sign(preload), 0.0, 0.0, 0.0])
    assert np.all(pulled(rig, np.eye(6)[0], held=gone)[:, :2] == 0.0)


@pytest.mark.parametrize(("z", "N"), [(0.0, 3e4), (-0.006, 3.6e4), (-0.04, 7e4 + 5.44e4)])
def test_both_stages_of_a_spring_press_on_its_friction(z, N):
    """N by hand: preload, first stage 1 MN/m, second stage 1.6 MN/m after 6 mm of compression."""
    rig = Rig(
        kind="friction",
        friction_coefficient=[0.3, 0.2, 0.0],
        stick_stiffness=[2e7, 2e7, 0.0],
        stiffness=[0.0, 0.0, 1e6],
        stage_table=[[-0.106, -160e3], [-0.006, 0.0], [0.5, 0.0]],
        preload=[0.0, 0.0, -3e4],
    )
    held = np.array([0.0, 0.0, z, 0.0, 0.0, 0.0])
    along_x, along_y = (pulled(rig, np.eye(6)[k], held=held)[-1] for k in (0, 1))
    assert (along_x[0], along_y[1]) == pytest.approx((0.3 * N, 0.2 * N))
    assert along_x[2] == pytest.approx(-N)


def test_side_bearer_with_clearance_and_stop():
    """Nothing in the clearance, then its spring, then the stop beside it."""
    rig = Rig(**pressed(0.0, clearance=0.004, stop_travel=0.01, stop_stiffness=5e7))
    for z, force in ((0.0, 0.0), (-0.1, 0.0), (0.004, 0.0), (0.009, 5e3), (0.015, 11e3 + 5e4)):
        assert rig.force(Z, z) == pytest.approx(force, abs=1e-6)


@pytest.mark.parametrize("inner", [0.0, 0.05, 0.15])
def test_yaw_moment_of_a_centre_plate(inner):
    """2/3 mu N (R^3 - r^3)/(R^2 - r^2) under even pressure, exactly; no side force."""
    mu, N, R = 0.3, 4e5, 0.178
    plate = {**pressed(N, mu, stick_stiffness=1e9), "kind": "centre_plate", "radius": R}
    rig = Rig(**plate, inner_radius=inner)
    yaw = pulled(rig, np.eye(6)[5], way=0.05)[-1]
    assert yaw[5] == pytest.approx(2 / 3 * mu * N * (R**3 - inner**3) / (R**2 - inner**2))
    assert yaw[:2] == pytest.approx(0.0, abs=1e-3 * mu * N)


def test_tilting_stiffness_and_edge_of_a_centre_plate():
    """k (R^2 + r^2)/4 while all of it carries; tilted far, only pads at the edge do."""
    N, R, r, k = 4e5, 0.178, 0.05, 1e9
    plate = {**pressed(N, stiffness=k), "kind": "centre_plate", "radius": R, "inner_radius": r}
    rig = Rig(**plate)
    for axis in (3, 4):
        small = rig.forces(1e-5 * np.eye(6)[axis], np.zeros(6))
        assert small[axis] == pytest.approx(1e-5 * k * (R**2 + r**2) / 4.0, rel=1e-3)
    # at the angle where one outer pad alone carries N: edge of the plate, within the pads' circle
    far = rig.forces([0.0, 0.0, 0.0, 0.02, 0.0, 0.0], np.zeros(6))
    assert 0.0 < far[3] / far[2] < R


def test_sticking_stiffness_of_a_centre_plate():
    """Across k; about its axis k (R^2 + r^2)/2, the polar radius of gyration of a ring."""
    R, r, k = 0.178, 0.05, 3e7
    plate = {**pressed(4e5, stick_stiffness=k), "kind": "centre_plate"}
    for axis, way, stiffness in ((X, 1e-4, k), (Y, 1e-4, k), (5, 1e-3, 0.5 * k * (R**2 + r**2))):
        rig = Rig(**plate, radius=R, inner_radius=r)
        force = pulled(rig, np.eye(6)[axis], way=way)[-1, axis]
        assert force == pytest.approx(stiffness * way, rel=3e-3)  # of the last step


def test_turning_plate_loses_its_side_capacity():
    """Each point's friction is against its own way: little is left across a plate that turns."""
    plate = {**pressed(4e5, stick_stiffness=1e9), "kind": "centre_plate", "radius": 0.178}
    rig = Rig(**plate)
    turning = np.array([0.0, 0.01, 0.0, 0.0, 0.0, 1.0])
    both = pulled(rig, turning, way=0.05)[-1]
    assert 0.0 < both[1] < 0.2 * 0.3 * 4e5
    assert both[5] == pytest.approx(2 / 3 * 0.3 * 4e5 * 0.178, rel=0.03)


# wedges -------------------------------------------------------------------------------------------

WEDGE = {
    "kind": "wedge",
    "stiffness": [0.0, 0.0, 4e5],
    "preload": [0.0, 0.0, 3e4],
    "angle": 0.634,
    "friction_coefficient": 0.25,
    "stick_stiffness": [2e7, 2e7],
}


def wedge_limits(force):
    """Friction on the way down and up by the balance of a wedge without mass (see Wu, Robeda 2004).

    Down: F = N tan(a) - mu N, up: F = N tan(a) + mu N; the friction is mu N.
    """
    a, mu = np.tan(WEDGE["angle"]), WEDGE["friction_coefficient"]
    return mu * force / (a - mu), mu * force / (a + mu)


def test_wedges_lose_the_work_of_both_ways():
    """Energy of a cycle: a figure between the two limits over the spring force, elastic flanks."""
    A, k_t, k, F = 0.03, WEDGE["stick_stiffness"][1], WEDGE["stiffness"][2], 3e4
    d, f = last_period(Rig(**WEDGE), Z, triangle(A, 1.0), 1.0)

    def down(z):
        return wedge_limits(F + k * z)[0]

    def up(z):
        return -wedge_limits(F + k * z)[1]

    top = brentq(lambda z: down(A) + k_t * (z - A) - up(z), -A, A)
    bottom = brentq(lambda z: up(-A) + k_t * (z + A) - down(z), -A, A)
    x = np.array([A, top, -A, bottom])
    y = np.array([down(A), up(top), up(-A), down(bottom)])
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert loop_area(d, f - F - k * d) == pytest.approx(area, rel=1e-3)


@pytest.mark.parametrize("angle", np.radians([-60.0, -20.0, 30.0, 60.0]))
def test_wedges_slide_in_any_direction_along_their_friction(angle):
    """T has the direction of the slip on the column and the amount mu N, N = (F + T_z)/tan(a)."""
    F, mu = WEDGE["preload"][2], WEDGE["friction_coefficient"]
    law = {**WEDGE, "stiffness": [0.0, 0.0, 1.0], "stick_stiffness": [2e7, 1e7]}
    direction = np.array([0.0, np.cos(angle), np.sin(angle), 0.0, 0.0, 0.0])
    _, t_y, t_z = pulled(Rig(**law), direction, way=0.04)[-1, :3] - [0.0, 0.0, F]
    assert np.hypot(t_y, t_z) == pytest.approx(mu * (F + t_z) / np.tan(WEDGE["angle"]), rel=1e-3)
    assert np.arctan2(t_z, t_y) == pytest.approx(angle, abs=np.radians(1.0))


def test_wedges_slide_sideways_at_their_level_limit():
    """mu F/tan(a) where no part of the friction holds the wedge up or down."""
    force = pulled(Rig(**WEDGE), np.eye(6)[1])[-1]
    assert force[1] == pytest.approx(0.25 * 3e4 / np.tan(WEDGE["angle"]), rel=1e-3)
    unloaded = pulled(Rig(**WEDGE), np.eye(6)[1], held=np.array([0, 0, -0.08, 0, 0, 0.0]))
    assert np.all(unloaded[:, 1:3] == 0.0)


# dampers ------------------------------------------------------------------------------------------

BLOW_OFF = [[0.0, 0.0], [0.1, 10e3], [0.5, 12e3]]
LINK = {"kind": "spring_damper", "points": [[0.0, 0.0, -1.0], [0.0, 0.0, -41.0]]}
# the probe hangs above the frame: a motion upwards (z negative) lengthens the link; Rig gives the
# force against the motion


def test_damper_table_without_series_stiffness_is_followed_exactly():
    rig = Rig(**LINK, damper_table=BLOW_OFF)
    for rate in (-0.7, -0.3, -0.05, 0.0, 0.02, 0.1, 0.4, 1.0):
        expected = np.sign(rate) * np.interp(abs(rate), [0.0, 0.1, 1.0], [0.0, 10e3, 14.5e3])
        assert -rig.force(Z, 0.0, -rate) == pytest.approx(expected, abs=1e-6)


def test_blow_off_damper_with_series_stiffness_follows_its_table_when_slow():
    """At 0.02 Hz the series spring's own rate is below 1 % of the velocity at the bend."""
    rig = Rig(**LINK, damper_table=BLOW_OFF, series_stiffness=5e6)
    position, rate = harmonic(2.0, 0.02)
    time = np.arange(0.0, 60.0, 0.04)
    force = rig.history(Z, time, position, rate)[125:]
    v = np.array([rate(t) for t in time])[125:]
    expected = np.sign(v) * np.interp(np.abs(v), [0.0, 0.1, 0.5], [0.0, 10e3, 12e3])
    assert np.max(np.abs(force - expected)) < 0.06 * 10e3
    assert np.sqrt(np.mean((force - expected) ** 2)) < 0.02 * 10e3


@pytest.mark.parametrize("velocity", [0.05, 0.3, 2.0])
@pytest.mark.parametrize("h", [2.5e-4, 1e-3])
def test_series_damper_relaxes_branch_by_branch(velocity, h):
    """After a step of velocity F' = k_s (v - u), F = F_d(u): closed form for every step h."""
    k_s, c_low, c_high = 5e6, 1e5, 5e3
    rig = Rig(**LINK, damper_table=BLOW_OFF, series_stiffness=k_s)
    time = np.arange(0.0, 0.1, h)
    force = rig.history(Z, time, lambda t: velocity * t, lambda t: velocity)
    low_end, high_end = c_low * velocity, 10e3 + c_high * (velocity - 0.1)
    kink = np.inf if low_end <= 10e3 else -c_low / k_s * np.log(1.0 - 10e3 / low_end)
    low = low_end * (1.0 - np.exp(-time * k_s / c_low))
    high = high_end - (high_end - 10e3) * np.exp(-np.maximum(time - kink, 0.0) * k_s / c_high)
    assert force == pytest.approx(np.where(time < kink, low, high), abs=1e-6 * 10e3)
    assert force[round(1e-3 / h)] <= k_s * velocity * 1e-3  # never stiffer than the series spring
    back = rig.history(Z, np.arange(0.0, 0.4, h), lambda t: 0.0, lambda t: 0.0)
    # the way down is on the same branches
    assert np.all(np.diff(back) <= 0.0)
    assert 0.0 <= back[-1] < 1e-6 * 10e3


def test_flat_blow_off_table_holds_its_force():
    """A table that ends flat limits the force; no division by its zero slope."""
    rig = Rig(**LINK, damper_table=[[0.0, 0.0], [0.1, 10e3], [0.5, 10e3]], series_stiffness=5e6)
    time = np.arange(0.0, 0.2, 1e-4)
    force = rig.history(Z, time, lambda t: 0.4 * t, lambda t: 0.4)
    assert force[-1] == pytest.approx(10e3, rel=1e-4)  # e^(-0.2 s / 20 ms) is left
    assert np.max(force) <= 10e3
    rig.state[12 * rig.n] = 11e3  # beyond the table, as a stage of RK4 may be
    rig.force(Z, 0.0, -0.4)
    assert np.isfinite(rig.derivative).all()
    assert rig.derivative[12 * rig.n] == 0.0
    rig.force(Z, 0.0, 0.4)
    assert rig.derivative[12 * rig.n] == pytest.approx(-5e6 * 0.5)


# springs ------------------------------------------------------------------------------------------


def test_air_spring_has_its_static_and_its_fast_stiffness():
    """Slowly area + k1 k2/(k1 + k2), fast area + k1, and Nishimura's formula in between."""
    k1, k2, c, area = 700e3, 350e3, 60e3, 60e3
    law = {
        "kind": "airspring",
        "bellows_stiffness": k1,
        "reservoir_stiffness": k2,
        "orifice_damping": c,
        "area_stiffness": area,
        "horizontal_stiffness": [1e5, 1e5],
        "preload": [0.0, 0.0, 0.0],
    }
    held = Rig(**law).history(Z, np.arange(0.0, 5.0, 0.01), lambda t: 0.01, lambda t: 0.0)
    assert held[0] == pytest.approx(0.01 * (area + k1), rel=1e-9)
    assert held[-1] == pytest.approx(0.01 * (area + k1 * k2 / (k1 + k2)), rel=1e-9)
    for frequency, steps in ((0.1, 400), (1.0, 200), (3.0, 100), (10.0, 100), (40.0, 100)):
        d, f = last_period(
            Rig(**law),
            Z,
            harmonic(0.01, frequency),
            frequency,
            periods=2 + int(0.5 * frequency),  # 0.5 s: the transient decays with 57 ms
            steps=steps,
        )
        s = 2j * np.pi * frequency
        expected = area + k1 * (k2 + c * s) / (k1 + k2 + c * s)
        # the drive is held over a step: an error of second order in omega h
        assert abs(component(d, f) - expected) < 1e-3 * abs(expected)


@pytest.mark.parametrize(("axis", "name"), [(X, "x"), (Y, "y"), (Z, "z")])
def test_bump_stop_is_free_within_its_clearance_and_follows_its_table_beyond(axis, name):
    rig = Rig(kind="bump_stop", axis=name, table=[[0.0, 0.0], [0.02, 0.0], [0.03, 5e3]])
    for d, force in (
        (0.0, 0.0),
        (0.0199, 0.0),
        (-0.0199, 0.0),
        (0.025, 2.5e3),
        (-0.03, -5e3),
        (0.05, 15e3),
    ):
        assert rig.force(axis, d) == pytest.approx(force, abs=1e-6)


def test_one_sided_stop_acts_one_way():
    rig = Rig(kind="bump_stop", axis="x", table=[[-0.01, -5e3], [0.0, 0.0], [1.0, 0.0]])
    assert rig.force(X, 0.5) == 0.0
    assert rig.force(X, -0.02) == pytest.approx(-10e3)


def test_spring_table_and_damper_table_add_up():
    rig = Rig(**LINK, spring_table=[[0.0, 0.0], [0.1, 1e3], [0.2, 5e3]], damper_table=BLOW_OFF)
    assert -rig.force(Z, -0.15, -0.05) == pytest.approx(3e3 + 5e3, abs=1e-6)
    assert -rig.force(Z, 0.15, 0.05) == pytest.approx(-8e3, abs=1e-6)
