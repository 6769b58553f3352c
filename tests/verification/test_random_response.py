"""A sprung wheelset on random rails: frequency response times spectrum of ERRI B176."""

import numpy as np
import pytest

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
    vehicle = Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "sprung wheelset",
            "wheelsets": {"wheelset": WHEELSET},
            "bodies": {"load": LOAD},
            "elements": {"suspension": SUSPENSION},
        }
    )
    waves = {"spectrum": "erri_b176_low", "wavelengths": (3.0, 10.0), "channels": ["vertical"]}
    track = railsim.load_track("straight").replace(
        support={"preset": preset}, irregularities=[{"type": "random", "end": 300.0, **waves}]
    )
    settings = railsim.Settings(output_rate=500.0, outputs={"track": True})
    result = railsim.simulate(vehicle, track, speed=SPEED, duration=12.0, settings=settings)
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
