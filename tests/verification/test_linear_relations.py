"""Linear analysis against runs, against springs and dampers, in the mirror and on circles."""

import numpy as np
import pytest
from dynamics import Settings, load_any_track, load_vehicle
from selection import points
from suspension import Suspension

from railsim.linear.eigenmodes import eigenmodes
from railsim.linear.harmonic import ContactPath
from railsim.linear.system import jacobian
from railsim.linear.track_response import QUANTITIES, track_response
from railsim.linear.vehicle import LinearVehicle, smooth_law
from railsim.result.sensors import all_sensors
from railsim.simulation import simulate

SPEED, WAVE = 25.0, 8.0


@pytest.mark.parametrize("channel", ["lateral", "cross_level"])
def test_response_to_waves_is_that_of_a_run_on_them(channel):
    """Amplitude and phase of forces and displacements on elastic rails, by least squares, 3 %."""
    size, k = 2e-5, 2.0 * np.pi / WAVE
    settings = smooth_law(Settings(output_rate=500.0))
    track = load_any_track("straight").replace(
        plan=[{"type": "STR", "length": 330.0}], support={"preset": "co-running"}
    )
    coach = load_vehicle("coach_manchester")
    found = track_response(LinearVehicle(coach, track, settings=settings), {}, SPEED)
    waves = {"amplitude": size, "wavelengths": [WAVE, WAVE * (1.0 - 1e-9)], "begin": 20.0}
    waves |= {"type": "sweep", "channel": channel, "end": 330.0}
    run = simulate(coach, track.replace(irregularities=[waves]), speed=SPEED, settings=settings)
    late = (run.distance > 230.0) & (run.distance < 230.0 + 8.0 * WAVE)
    phase = k * (run.distance[late] - 20.0)
    basis = np.stack([np.sin(phase), np.cos(phase), np.ones_like(phase)], axis=1)
    of_run = {"Q": run.Q, "Y": run.Y, "sum_Y": run.sum_Y, "lateral": run.wheelset_lateral}
    quantity = QUANTITIES.index(channel.replace("lateral", "alignment"))
    response = found.over(np.array([k]))[0, :, quantity] * size
    for name, values in of_run.items():
        sine, cosine, _ = np.linalg.lstsq(basis, values[late].reshape(len(phase), -1))[0]
        expected = [x for o, x in zip(found.outputs, response, strict=True) if o.startswith(name)]
        # the waves are the imaginary part of exp(i phase)
        np.testing.assert_allclose(sine + 1j * cosine, expected, atol=0.03 * np.abs(expected).max())


@points("speed", [15.0, 50.0], always=(1,))
def test_response_to_the_level_is_that_of_springs_and_dampers(speed):
    """Wheel loads and floor of the benchmark coach, 0.3 to 4 Hz, 0.3 %.

    Against its file written anew, with wheelsets that follow rigid rails.
    """
    coach = load_vehicle("benchmark_vehicle1")
    own = Suspension(coach.model_dump(exclude_none=True), rolling=True)
    rails = load_any_track("straight").replace(support={"preset": "rigid"})
    places = {name: s for name, s in all_sensors(coach).items() if name.startswith("floor")}
    found = track_response(LinearVehicle(coach, rails), places, speed)
    waves = 2.0 * np.pi * np.array([0.3, 0.7, 1.0, 1.3, 2.0, 4.0]) / speed
    for k, of_level in zip(waves, found.over(waves)[:, :, QUANTITIES.index("level")], strict=True):
        moved, loads = own.over_level(k, speed)
        expected = {
            f"Q.{n}.{side}": Q for n, Q in enumerate(loads, 1) for side in ("left", "right")
        }
        for name, sensor in places.items():
            lift = moved["carbody", "z"] - sensor.arm[0] * moved["carbody", "pitch"]
            expected[f"{name}.z"] = -((k * speed) ** 2) * lift
        values = dict(zip(found.outputs, of_level, strict=True))
        for name, value in expected.items():
            assert abs(values[name] - value) < 3e-3 * abs(value)


def eigenvalues(**how):
    vehicle = LinearVehicle(load_vehicle("coach_manchester"), load_any_track("straight"), **how)
    values = eigenmodes(vehicle.linearised(SPEED)).eigenvalues
    return vehicle, values[(values.imag > 1.0) & (np.abs(values) < 200.0)]


def test_modes_in_curves_are_alike_to_both_hands_and_on_wide_circles_those_on_straight_track():
    _, straight = eigenvalues()
    _, wide = eigenvalues(radius=1e7)
    np.testing.assert_allclose(wide, straight, rtol=1e-5)
    right, left = (eigenvalues(radius=600.0 * hand, cant=0.1 * hand)[1] for hand in (1, -1))
    np.testing.assert_allclose(left, right, rtol=1e-6)


def test_hunting_of_an_amplitude_in_curves_is_alike_to_both_hands():
    """The outer wheels climb their flanges there: the contact path has to be found closely."""

    def values(hand):
        vehicle, _ = eigenvalues(radius=600.0 * hand, cant=0.1 * hand)
        found = eigenmodes(vehicle.linearised(SPEED, ContactPath(1e-3))).eigenvalues
        return found[(found.imag > 1.0) & (np.abs(found) < 200.0)]

    np.testing.assert_allclose(values(-1), values(1), rtol=1e-6)


def test_harmonic_linearisation_of_a_small_amplitude_is_the_tangent_in_a_curve_too():
    vehicle, _ = eigenvalues(radius=600.0, cant=0.1)
    tangent, small = (vehicle.linearised(SPEED, path).matrix for path in (None, ContactPath(1e-6)))
    columns = np.max(np.abs(tangent), axis=0)
    np.testing.assert_allclose(small / columns, tangent / columns, atol=2e-3)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize("law", ["fastsim", "fastrip"])
def test_tangent_is_the_jacobian_of_the_derivative(law):
    """Creep forces of all wheelsets by one difference, or by one for each coordinate."""
    track = load_any_track("straight").replace(support={"preset": "co-running"})
    coach, settings = load_vehicle("coach_flexicoil"), Settings(creep_law=law)
    free = LinearVehicle(coach, track, radius=400.0, settings=settings).free(18.0)
    plain = jacobian(free.rates, free.x, free.coordinates.steps)
    of_row = np.abs(plain).max(axis=1, keepdims=True)
    np.testing.assert_allclose(free.tangent() / of_row, plain / of_row, rtol=0, atol=1e-11)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize("name", ["coach_manchester", "coach_25t", "wagon_y25"])
def test_every_coordinate_of_a_linearisation_has_a_name_of_its_own(name):
    """Of an element with internal states along several axes each is named by its axis."""
    coach = load_vehicle(name)
    vehicle = LinearVehicle(coach, load_any_track("straight"))
    names = vehicle.coordinates.names
    assert all(names)
    assert len(set(names)) == len(names)
    rows = vehicle.model.system.mounts.internal
    first = vehicle.coordinates.n_positions + vehicle.coordinates.n_velocities
    for mount, row in zip(vehicle.model.index.mounts, rows, strict=True):
        for axis, number in zip("xyz", row, strict=True):
            assert number < 0 or names[first + number] == f"{mount}.{axis}"
