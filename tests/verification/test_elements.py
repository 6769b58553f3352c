"""Force elements against their own laws: motion prescribed, force read."""

import numpy as np
import pytest
from rig import Rig
from scipy.optimize import brentq

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


def last_period(rig, axis, motion, frequency, periods=2, steps=2000):
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

    Within 0.1 %: the corners are met to one step of 1/2000 of a period.
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
    time = np.arange(0.0, 60.0, 0.01)
    force = rig.history(Z, time, position, rate)[500:]
    v = np.array([rate(t) for t in time])[500:]
    expected = np.sign(v) * np.interp(np.abs(v), [0.0, 0.1, 0.5], [0.0, 10e3, 12e3])
    assert np.max(np.abs(force - expected)) < 0.06 * 10e3
    assert np.sqrt(np.mean((force - expected) ** 2)) < 0.02 * 10e3


@pytest.mark.parametrize("velocity", [0.05, 0.3, 2.0])
@pytest.mark.parametrize("h", [1e-4, 1e-3])
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
    back = rig.history(Z, np.arange(0.0, 0.5, h), lambda t: 0.0, lambda t: 0.0)
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
    for frequency in (0.1, 1.0, 3.0, 10.0, 40.0):
        steps = 400
        d, f = last_period(
            Rig(**law),
            Z,
            harmonic(0.01, frequency),
            frequency,
            periods=2 + int(frequency),  # 1 s: the transient decays with 57 ms
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
