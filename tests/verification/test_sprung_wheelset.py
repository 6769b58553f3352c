"""A sprung wheelset on random rails and on a bridge: closed forms and equations of two masses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import railsim
from railsim.definitions.track.support import PRESETS
from railsim.definitions.vehicle.definition import Vehicle

WHEEL, SPRUNG = 906.5, 4000.0  # kg, masses per wheel
SPRING, DAMPER = 4e5, 1.2e4  # N/m, N s/m
HERTZ = 1.25e9  # N/m, contact of a wheel of 0.46 m under 48 kN
SPEED = 25.0
A, OMEGA_C, OMEGA_R = 4.032e-7, 0.8246, 0.0206  # vertical, "low"
WHEELSET = {
    "mass": 2.0 * WHEEL,
    "inertia": [1120.0, 112.0, 1120.0],
    "position": [0.0, 0.0, -0.46],
    "radius": 0.46,
    "profile": "S1002",
    "back_to_back": 1.36,
    "tape_circle_distance": 1.5,
}
LOAD = {"mass": 2.0 * SPRUNG, "inertia": [5e5, 5e5, 9e5], "position": [0.0, 0.0, -0.46]}
SUSPENSION = {
    "kind": "bushing",
    "bodies": ["load", "wheelset"],
    "point": [0.0, 1.0, -0.46],
    "sides": "both",
    "stiffness": [1e7, 1e7, SPRING],
    "damping": [1e4, 1e4, DAMPER],
    "rotational_stiffness": [1e6, 1e6, 1e7],
}


def sprung_wheelset():
    return Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "sprung wheelset",
            "wheelsets": {"wheelset": WHEELSET},
            "bodies": {"load": LOAD},
            "elements": {"suspension": SUSPENSION},
        }
    )


def response(omega, preset):
    """Wheel load [N] and acceleration of the load [m/s2] over the height of the rails [m], down.

    The dynamic stiffness of the vehicle against the wheel stands in series with contact and rail.
    """
    strut = SPRING + 1j * omega * DAMPER
    load = -SPRUNG * omega**2
    vehicle = strut * load / (strut + load) - WHEEL * omega**2
    compliance = 1.0 / vehicle + 1.0 / HERTZ
    support = PRESETS[preset]
    if support is not None:
        stiffness, damping = support.pad_vertical
        compliance += 1.0 / (stiffness + 1j * omega * damping - support.rail_mass * omega**2)
    wheel = 1.0 / compliance / vehicle  # its motion
    return -1.0 / compliance, -(omega**2) * wheel * strut / (strut + load)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize("preset", ["rigid", "p2"])
def test_wheel_loads_and_accelerations_on_random_rails(preset):
    """In waves of 3 to 10 m: as of the rails' own waves, in the rms as of their spectrum."""
    waves = {"spectrum": "erri_b176_low", "wavelengths": (3.0, 10.0), "channels": ["vertical"]}
    track = railsim.load_track("straight").replace(
        support={"preset": preset}, irregularities=[{"type": "random", "end": 300.0, **waves}]
    )
    settings = railsim.Settings(output_rate=500.0, outputs={"track": True})
    result = railsim.simulate(
        sprung_wheelset(), track, speed=SPEED, duration=12.0, settings=settings
    )
    body = result.coordinates["body"].index("load")
    height = result["rail_vertical"][:, 0, 0]
    omega = 2.0 * np.pi * np.fft.rfftfreq(height.size, 1.0 / 500.0)[1:]
    wavenumber = np.linspace(2.0 * np.pi / 10.0, 2.0 * np.pi / 3.0, 2001)
    density = A * OMEGA_C**2 / ((wavenumber**2 + OMEGA_R**2) * (wavenumber**2 + OMEGA_C**2))
    within = (result.distance > 50.0) & (result.distance < 280.0)
    found = result.Q[:, 0].mean(axis=1), result.body_acceleration[:, body, 2]
    for values, own, gain in zip(
        found, response(omega, preset), response(wavenumber * SPEED, preset), strict=True
    ):
        lines = np.append(0.0, own * np.fft.rfft(height)[1:])
        expected = np.fft.irfft(lines, height.size)[within]
        rms = np.sqrt(np.trapezoid(density * np.abs(gain) ** 2, wavenumber))
        error = values[within] - values[within].mean() - (expected - expected.mean())
        assert np.std(error) < 0.01 * rms
        # some 60 waves pass: their amplitudes are given, what they add up to over a part is not
        assert np.std(expected) == pytest.approx(rms, rel=0.1)


@pytest.mark.usefixtures("small_contact_tables")
def test_a_sprung_wheelset_on_a_beam_is_biggs_s_moving_oscillator():
    """Equations of both bodies and the beam's first mode, of half its mass (Biggs 1964)."""
    speed, begin, span, mass, omega = 40.0, 28.0, 12.0, 20e3, 2.0 * np.pi * 8.0
    wheel, sprung = 2.0 * WHEEL, 2.0 * SPRUNG

    def shape(x):
        return np.sin(np.pi * x / span) * (0.0 < x < span)

    def slope(x):
        return np.pi / span * np.cos(np.pi * x / span) * (0.0 < x < span)

    def rates(t, y, start):
        q, q_rate, z, z_rate, load, load_rate = y
        x = start + speed * t
        under = shape(x) * q_rate + speed * slope(x) * q
        contact = 2.0 * HERTZ * (z - shape(x) * q) + 4e5 * (z_rate - under)
        strut = 2.0 * SPRING * (load - z) + 2.0 * DAMPER * (load_rate - z_rate)
        beam = shape(x) * (9.81 * (wheel + sprung) + contact) / mass - omega**2 * q
        return [q_rate, beam, z_rate, (strut - contact) / wheel, load_rate, -strut / sprung]

    track = railsim.load_track("straight").replace(support={"preset": "rigid"})
    run = railsim.Simulation(
        sprung_wheelset(), track, speed=speed, start=begin - 1.0, until=begin + span + 2.0,
        settings=railsim.Settings(step=5e-4), record=False,
    )  # fmt: skip
    q, rate, motion, seen = 0.0, 0.0, np.zeros((2, 1, 2, 2)), []
    with run:
        start = run.read("wheelset_distance")[0] - begin
        before = shape(start) * run.read("Q").sum()
        while run.step():
            x, dt = run.read("wheelset_distance")[0] - begin, run.step_length
            x_before = x - speed * dt
            motion[1] = [0.0, shape(x_before) * rate + speed * slope(x_before) * q]
            motion[0] = [0.0, shape(x_before) * q] + dt * motion[1]
            run.set_rails(*motion)  # foreseen, for the forces at the end of the step
            force = shape(x) * run.read("Q").sum()
            rest = 0.5 * (before + force) / mass / omega**2
            c, s = np.cos(omega * dt), np.sin(omega * dt)
            q, rate = (rest + c * (q - rest) + s * rate / omega, c * rate - s * (q - rest) * omega)
            motion[0] = [0.0, shape(x) * q]
            motion[1] = [0.0, shape(x) * rate + speed * slope(x) * q]
            run.set_rails(*motion)
            before = force
            seen.append((run.time, q, run.read("body_acceleration")[0, 2]))
    time, found, acceleration = np.transpose(seen)
    own = solve_ivp(
        rates, (0.0, time[-1]), np.zeros(6), "Radau", time, args=(start,), max_step=2e-3, rtol=1e-6
    )  # fmt: skip
    strut = SPRING * (own.y[4] - own.y[2]) + DAMPER * (own.y[5] - own.y[3])
    largest = np.max(own.y[0])
    assert np.max(found) == pytest.approx(largest, rel=5e-3)
    # rails and beam take turns: the shift in time is of first order in the step
    np.testing.assert_allclose(found, own.y[0], atol=0.025 * largest)
    felt = -strut / SPRUNG
    np.testing.assert_allclose(acceleration, felt, atol=0.025 * np.max(np.abs(felt)))
