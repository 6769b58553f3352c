"""Sensors of a vehicle: standard ones and those of its table, against the motion of the bodies."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import railsim
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.vehicle.definition import Vehicle
from railsim.result.sensors import MOTIONS, Sensor, all_sensors, readings
from railsim.track.alignment import Alignment


@cache
def run():
    """A coach with a sensor under a seat, swaying on straight canted track."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    data["sensors"] = {
        "seat": {"body": "carbody", "position": [5.0, 0.8, -1.6]},
        "centre": {"body": "carbody", "position": data["bodies"]["carbody"]["position"]},
    }
    return railsim.simulate(
        Vehicle.model_validate(data),
        load_track("straight", ["cant.0.cant=0.05"]),
        speed=20.0,
        duration=0.5,
        settings=railsim.Settings.model_validate(
            {
                "output_rate": 1000.0,
                "outputs": {"sensors": True, "track": True},
                "initial": {"carbody": {"roll": 0.01, "pitch": 3e-4, "vy": 0.1}},
            }
        ),
    )


def of(name, quantity):
    result = run()
    return result[f"sensor_{quantity}"][:, result.coordinates["sensor"].index(name)]


def test_standard_sensors_and_own_ones():
    names = run().coordinates["sensor"]
    assert {"floor_front", "floor_middle", "frame_1", "axlebox_1_left", "axlebox_4_right"} <= (
        set(names)
    )
    assert names[-2:] == ("seat", "centre")


def test_a_sensor_in_the_centre_of_gravity_moves_as_its_body():
    result = run()
    body = result.bodies.index("carbody")
    for quantity, array in (
        ("displacement", "body_position"),
        ("velocity", "body_velocity"),
        ("absolute_acceleration", "body_acceleration"),
    ):
        assert of("centre", quantity) == pytest.approx(result[array][:, body, :3], abs=1e-12)


def test_velocity_is_the_rate_of_the_displacement_and_acceleration_that_of_the_velocity():
    """Central differences over 2 ms; on straight track the frame moves evenly.

    From 50 ms on, when the start has decayed.

    The absolute acceleration is in the axes of the body, 10 mrad off.
    """
    time = run()["time"]
    for name in ("seat", "axlebox_1_left"):
        u, v, a = (of(name, q) for q in ("displacement", "velocity", "absolute_acceleration"))
        for rate, of_what in ((v, u), (a, v)):
            found = np.gradient(of_what, time, axis=0)[50:-3, 1:]
            error = np.max(np.abs(found - rate[50:-3, 1:]))
            assert error < 0.06 * np.max(np.abs(rate)) + 1e-3


def test_roll_rate_is_the_rate_of_the_roll():
    """On straight track, by central differences over 2 ms, from 50 ms on; it does not pitch so."""
    body, time = run().bodies.index("carbody"), run()["time"]
    rates = np.gradient(run()["body_position"][:, body, 3:5], time, axis=0)[50:-3]
    largest = np.max(np.abs(rates), axis=0)
    assert largest[0] > 10.0 * largest[1]
    assert of("seat", "roll_rate")[50:-3] == pytest.approx(rates[:, 0], abs=1e-3 * largest[0])


def test_roll_rate_in_a_curve_on_a_gradient_is_that_about_the_inclined_axis():
    """It turns with V/R about the vertical, about its own x axis with -V/R sin(grade).

    Cant and roll do not matter for it; the pitch of the body adds to the grade.
    """
    speed, radius, gradient = 15.0, -250.0, 0.03
    track = load_track(
        "straight",
        [
            f"plan=[{{type='CIR', length=500.0, radius={radius}}}]",
            "cant=[{type='CST', length=500.0, cant=-0.1}]",
            f"vertical=[{{type='CST', length=500.0, gradient={gradient}}}]",
        ],
    )
    settings = railsim.Settings.model_validate(
        {"start_state": "steady", "outputs": {"sensors": True}}
    )
    coach = load_vehicle("coach_manchester")
    result = railsim.simulate(coach, track, speed=speed, duration=20.0, settings=settings)
    at = result.coordinates["sensor"].index("floor_middle")
    pitch = result["body_position"][-1, result.bodies.index("carbody"), 4]
    expected = -speed / radius * np.sin(np.arctan(gradient) + pitch)
    assert result["sensor_roll_rate"][-1, at] == pytest.approx(expected, rel=0.01)


def test_absolute_acceleration_away_from_the_middle_of_a_car_in_a_curve():
    """The floor 9.5 m ahead has V^2/R^2 times 9.5 m towards the car's middle, 9.5 m behind also.

    A reading differs from it by gravity alone, the same all along the floor.
    """
    speed, radius = 20.0, 250.0
    track = load_track("straight", [f"plan=[{{type='CIR', length=500.0, radius={radius}}}]"])
    settings = railsim.Settings(start_state="steady", outputs={"sensors": True})
    coach = load_vehicle("coach_manchester")
    result = railsim.simulate(coach, track, speed=speed, duration=3.0, settings=settings)
    at = [result.coordinates["sensor"].index(f"floor_{name}") for name in ("front", "rear")]
    absolute, reading = (
        result[f"sensor_{name}"][-1, at] for name in ("absolute_acceleration", "acceleration")
    )
    assert absolute[1, 0] - absolute[0, 0] == pytest.approx(19.0 * (speed / radius) ** 2, rel=0.01)
    np.testing.assert_allclose((reading - absolute)[0], (reading - absolute)[1], atol=1e-12)


def test_an_accelerometer_feels_gravity_and_the_absolute_acceleration_does_not():
    """At rest on 50 mm of cant it reads g sin(cant angle) to the left, towards the lower side.

    Nose up it reads g sin(pitch) ahead, and downwards what is missing of g.
    """
    difference = of("seat", "acceleration") - of("seat", "absolute_acceleration")
    body = run().bodies.index("carbody")
    lean = run()["body_position"][:, body, 3] + np.arcsin(0.05 / 1.5)
    pitch = run()["body_position"][:, body, 4]
    assert 9.81 * np.max(np.abs(pitch)) > 2e-3
    assert difference[:, 0] == pytest.approx(9.81 * np.sin(pitch), abs=2e-4)
    assert difference[:, 1] == pytest.approx(-9.81 * np.sin(lean), abs=2e-3)
    assert difference[:, 2] == pytest.approx(9.81 * (1.0 - np.cos(lean)), abs=2e-3)


def test_attitude_counts_from_the_track_frame_of_a_body_wherever_it_stands_in_it():
    """Frames go with the reference body: a metre ahead in its own, a cant ramp leans it no more."""
    alignment = Alignment(railsim.load_track("curve_r250"))
    s = np.linspace(0.0, 480.0, 97)
    ramp = np.argmax(np.abs(alignment.cant_angle_rate(s)))
    motion = {"distance": s[ramp : ramp + 1]}
    motion |= {f"body_{name}": np.zeros((1, 1, 6)) for name in MOTIONS}
    motion["body_position"][0, 0, 0] = 1.0
    seat = {"seat": Sensor("carbody", 3.0, (0.0, 0.0, 0.0))}
    found, _ = readings(seat, motion, ("carbody",), alignment, np.zeros(1))
    lean = alignment.cant_angle(s[ramp : ramp + 1] + 3.0)
    assert abs(lean) > 1e-3
    assert found[0, 0, 1] == pytest.approx(-9.81 * np.sin(lean).item(), rel=1e-9)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_readings_are_those_of_a_point_of_a_turning_body(hand):
    """In a curve, on a cant ramp and a vertical curve, the body leans and turns in its frame.

    a - g + alpha x r + w x (w x r), with w of the frame from the change of its axes along the way.
    """

    def frame(s):
        def turn(axis, angle):
            c, d = np.cos(angle), np.sin(angle)
            return np.array(
                {
                    0: [[1, 0, 0], [0, c, -d], [0, d, c]],
                    1: [[c, 0, d], [0, 1, 0], [-d, 0, c]],
                    2: [[c, -d, 0], [d, c, 0], [0, 0, 1]],
                }[axis]
            )

        return (
            turn(2, hand * s / 250.0) @ turn(1, 0.03 - 5e-4 * s) @ turn(0, hand * (0.1 + 2e-3 * s))
        )

    laws = {
        "curvature": hand / 250.0, "cant_angle": hand * 0.1, "cant_angle_rate": hand * 2e-3,
        "grade_angle": 0.03, "grade_angle_rate": -5e-4,
    }  # fmt: skip
    alignment = SimpleNamespace(**{n: lambda s, x=x: np.full_like(s, x) for n, x in laws.items()})
    roll, pitch, yaw = angles = 0.02, 0.3, -0.1
    own, turning = np.array([0.1, -0.2, 0.05]), np.array([0.3, 0.5, -0.7])
    absolute, arm, speed = np.array([0.4, -0.6, 0.8]), np.array([2.0, 0.7, -1.1]), 40.0
    values = {
        "body_position": [0.0, 0.0, 0.0, *angles], "body_velocity": [0.0, 0.0, 0.0, *own],
        "body_acceleration": [*absolute, *turning],
    }  # fmt: skip
    motion = {name: np.array(some).reshape(1, 1, 6) for name, some in values.items()}
    motion["distance"] = np.zeros(1)
    placed = {
        "box": Sensor("b", 0.0, tuple(arm), axlebox=True),
        "seat": Sensor("b", 0.0, tuple(arm)),
    }
    found, rates = readings(placed, motion, ("b",), alignment, np.array([speed]))
    change = frame(0.0).T @ (frame(1e-3) - frame(-1e-3)) / 2e-3 * speed
    of_frame = np.array([change[2, 1], change[0, 2], change[1, 0]])
    for k, spins in enumerate((0.0, 1.0)):
        body = Rotation.from_euler("ZXY", [yaw, roll, spins * pitch]).as_matrix()
        pitches = np.array([1.0, spins, 1.0])
        w, alpha = pitches * own + body.T @ of_frame, pitches * turning
        g = body.T @ frame(0.0).T @ np.array([0.0, 0.0, 9.81])
        expected = absolute - g + [0.0, 0.0, 9.81] + np.cross(alpha, arm)
        expected += np.cross(w, np.cross(w, arm))
        np.testing.assert_allclose(found[0, k], expected, atol=1e-5)
        assert rates[0, k] == pytest.approx(w[0], abs=1e-7)


def test_frames_are_felt_above_the_axles_and_axleboxes_a_metre_aside():
    """The Manchester benchmark: bogies 9.5 m from the middle, axles 1.28 m from theirs."""
    found = all_sensors(load_vehicle("coach_manchester"))
    for number, x in enumerate((10.78, 8.22, -8.22, -10.78), start=1):
        assert found[f"frame_{number}"].along == pytest.approx(x)
        for side, y in (("left", -1.0), ("right", 1.0)):
            box = found[f"axlebox_{number}_{side}"]
            assert (box.along, *box.arm) == pytest.approx((x, 0.0, y, 0.0))
    with_arms = all_sensors(load_vehicle("coach_25t"))
    assert with_arms["axlebox_1_right"].arm == pytest.approx((0.0, 1.0, 0.0))


def test_an_axlebox_does_not_spin():
    """Its displacement along the track stays below a millimetre while the wheel turns around."""
    assert np.max(np.abs(of("axlebox_1_left", "displacement"))) < 2e-3


def test_wheelset_on_a_track_moved_aside_stays_where_it_was_on_its_rails():
    """The track as a whole moves by 4 mm: `wheelset_lateral` does not, `..._on_track` does."""
    row = "{type='kink', s=40.0, length=60.0, offset=0.004, shape='cosine'}"
    track = load_track("straight", [f"irregularities=[{row}]", "support.preset='rigid'"])
    settings = railsim.Settings.model_validate({"outputs": {"track": True}})
    vehicle = load_vehicle("coach_manchester")
    result = railsim.simulate(
        vehicle, track, speed=20.0, start=40.0, duration=0.1, settings=settings
    )
    rails = result["rail_lateral"].mean(axis=-1)
    assert np.min(rails) > 0.002
    assert np.max(np.abs(result["wheelset_lateral"])) < 5e-4
    assert result["wheelset_lateral_on_track"] == pytest.approx(
        result["wheelset_lateral"] + rails, abs=2e-6
    )
    # of the irregular rails over all steps, too
    assert np.max(np.abs(result.groups["peaks"]["wheelset_lateral"])) < 5e-4


def test_a_sensor_on_no_body_is_a_fault():
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    data["sensors"] = {"seat": {"body": "carbodi", "position": [5.0, 0.8, -1.6]}}
    with pytest.raises(railsim.InputError, match=r"sensors.seat.body: no body 'carbodi'"):
        railsim.static_loads(Vehicle.model_validate(data))


def test_a_sensor_in_the_place_of_another_one_is_a_fault():
    """An assessment would take the accelerations at the wrong point."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    point = {"body": "carbody", "position": [5.0, 0.8, -1.6]}
    data["sensors"] = {"seat": point, "frame_1": point}
    data["service"]["points"] = {"seat": point, "floor_front": point, "floor_cab": point}
    with pytest.raises(railsim.InputError) as caught:
        railsim.static_loads(Vehicle.model_validate(data))
    keys = [fault.key for fault in caught.value.faults]
    assert keys == ["service.points.floor_front", "sensors.seat", "sensors.frame_1"]
