"""A sprung wheelset on random rails and on a bridge: closed forms and equations of two masses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import railsim
from railsim.contact.hertzian import hertz
from railsim.contact.kalker import kalker_coefficients
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


def sprung_wheelset(wheelset=WHEELSET, load=LOAD, suspension=SUSPENSION):
    return Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "sprung wheelset",
            "wheelsets": {"wheelset": wheelset},
            "bodies": {"load": load},
            "elements": {"suspension": suspension},
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


CONE = 0.05  # slope of the wheels
HALF_TRACK, CROWN = 0.75, 0.3  # m, half the distance of the contacts, radius of the rails' tops
LATERAL, LONGITUDINAL = 2e6, 5e6  # N/m, springs on either side, 1 m from the middle


def lateral_response(omega, speed, load):
    """Displacement [m] and yaw [rad] of a coned wheelset on springs over the alignment.

    Wickens (2003), ch. 2 and 3: roll and conicity of cones on round rails, linear creep, spin.
    """
    radius, inertia = 0.46, 1120.0
    G, nu = 8.2e10, 0.28
    ellipse = hertz(0.5 / radius, 0.5 / CROWN, load, 2.0 * G * (1.0 + nu), nu)
    area = ellipse.a * ellipse.b
    C11, C22, C23 = kalker_coefficients(ellipse.a / ellipse.b, nu)[:3]
    f11, f22, f23 = G * area * C11, G * area * C22, G * area**1.5 * C23
    rolls = -CONE / (HALF_TRACK - radius * CONE)  # per displacement against the rails
    conicity = -rolls * (HALF_TRACK + CROWN * CONE)
    s, arm = 1j * omega, 1.0 - radius * rolls
    # creepages of y, of the rails' y and of yaw: the contact is below the axle, which rolls
    across = [s * arm / speed, s * radius * rolls / speed, -1.0]
    spin = [0.0, 0.0, s / speed]  # a cone's angle to its axle is the same everywhere
    creep = [2.0 * (f22 * a + f23 * b) for a, b in zip(across, spin, strict=True)]
    weight = 4.0 * load * CONE / HALF_TRACK  # gravitational stiffness
    steer = 2.0 * HALF_TRACK * f11 * conicity / radius
    turn = 2.0 * f23
    y = -2.0 * WHEEL * omega**2 - inertia * rolls**2 * omega**2 + 2.0 * LATERAL
    matrix = np.array([
        [y + arm * creep[0] + weight, arm * creep[2]],
        [steer - turn * across[0], -inertia * omega**2 + 2.0 * LONGITUDINAL
         + 2.0 * HALF_TRACK**2 * f11 * s / speed - turn * across[2]],
    ])  # fmt: skip
    rails = np.array([weight - arm * creep[1] - inertia * rolls**2 * omega**2,
                      steer + turn * across[1]])  # fmt: skip
    return np.linalg.solve(matrix, rails)


@pytest.mark.usefixtures("small_contact_tables")
def test_a_coned_wheelset_on_springs_follows_random_alignment():
    """Almost without friction limit: linear theory; the car is held, the springs carry it."""
    suspension = SUSPENSION | {
        "stiffness": [LONGITUDINAL, LATERAL, SPRING],
        "damping": [0.0, 0.0, DAMPER],
        "rotational_stiffness": [0.0, 0.0, 0.0],
        "preload": [0.0, 0.0, -SPRUNG * 9.81],
    }
    vehicle = sprung_wheelset(
        wheelset=WHEELSET | {"profile": "cone_1in20"},
        load=LOAD | {"fixed": "track"},
        suspension=suspension,
    )
    waves = {"spectrum": "erri_b176_low", "wavelengths": (3.0, 30.0), "channels": ["lateral"]}
    track = railsim.load_track("straight").replace(
        support={"preset": "rigid"},
        inclination=CONE,
        friction=(20.0, 20.0),
        irregularities=[{"type": "random", "end": 400.0, "scale": 0.1, **waves}],
    )
    settings = railsim.Settings(creep_law="linear", output_rate=500.0, outputs={"track": True})
    result = railsim.simulate(vehicle, track, speed=SPEED, duration=12.0, settings=settings)
    rails = result["rail_lateral"][:, 0].mean(axis=1)
    omega = 2.0 * np.pi * np.fft.rfftfreq(rails.size, 1.0 / 500.0)
    lines = np.fft.rfft(rails)
    gains = np.array([lateral_response(w, SPEED, (WHEEL + SPRUNG) * 9.81) for w in omega])
    within = (result.distance > 50.0) & (result.distance < 280.0)
    found = result.wheelset_lateral[:, 0] + rails, result.wheelset_yaw[:, 0]
    for values, gain in zip(found, gains.T, strict=True):
        expected = np.fft.irfft(gain * lines, rails.size)[within]
        assert np.std(values[within] - expected) < 0.02 * np.std(expected)


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
