"""The bogie frame above a wheelset, where accelerations are taken, and the mass of its bogie."""

import pytest

from railsim.definitions.loading import load_vehicle
from railsim.definitions.vehicle.bogies import bogie_mass, bogie_name
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.result.sensors import sensors


def with_motors():
    """The coach with a motor on each axle, nearer to it than the frame; driven from the car."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    axle = data["assemblies"]["bogie"]["assemblies"]["axle"]
    motor = {"mass": 2500.0, "inertia": [200.0, 150.0, 300.0], "position": [-0.45, 0.0, -0.5]}
    bearing = {
        "kind": "bushing", "bodies": ["motor", "wheelset"], "point": [0.0, 0.4, -0.46],
        "sides": "both", "stiffness": [1e8, 1e8, 1e8],
    }  # fmt: skip
    nose = {
        "kind": "bushing", "bodies": ["frame", "motor"], "point": [-0.9, 0.0, -0.5],
        "stiffness": [0.0, 0.0, 5e6],
    }  # fmt: skip
    shaft = {"kind": "traction", "bodies": ["carbody", "wheelset"], "torque_table": [[0.0, 1e3]]}
    axle["bodies"] = {"motor": motor}
    axle["elements"] = {**axle["elements"], "bearing": bearing, "nose": nose, "shaft": shaft}
    return Vehicle.model_validate(data)


def masses(vehicle):
    flat = flatten(vehicle)
    return [bogie_mass(flat, wheelset) for wheelset in flat.of_kind("wheelset")]


def frames(vehicle):
    return [sensor.body for name, sensor in sensors(vehicle).items() if name.startswith("frame_")]


def test_a_motor_on_the_axle_is_no_bogie_frame_but_part_of_the_bogie():
    vehicle = with_motors()
    assert frames(vehicle) == 2 * ["front.frame"] + 2 * ["rear.frame"]
    assert masses(vehicle) == pytest.approx(4 * [2615.0 + 2 * 1813.0 + 2 * 2500.0])


def test_a_three_piece_bogie_weighs_bolster_side_frames_and_wheelsets():
    expected = 596.0 + 2 * 460.0 + 2 * 1145.0
    assert masses(load_vehicle("wagon_three_piece_25t")) == pytest.approx(4 * [expected])


def test_a_wagon_without_bogies_has_no_frames():
    assert frames(load_vehicle("wagon_uic_link")) == []
    assert masses(load_vehicle("wagon_uic_link")) == [0.0, 0.0]


def test_floor_sensors_of_a_train_are_in_the_car_whose_distance_counts():
    """Three coupled coaches 26 m apart: the floor above the bogies of the middle one."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    parts = {name: data[name] for name in ("bodies", "elements", "assemblies") if name in data}
    places = [{"name": f"car{n}", "position": [-26.0 * n, 0.0, 0.0]} for n in range(3)]
    couplers = {
        f"coupler{n}": {
            "kind": "spring_damper", "bodies": [f"car{n}.carbody", f"car{n + 1}.carbody"],
            "points": [[-26.0 * n - 12.5, 0.0, -1.0], [-26.0 * n - 13.5, 0.0, -1.0]],
            "stiffness": 2e6,
        }
        for n in range(2)
    }  # fmt: skip
    train = Vehicle.model_validate({
        "format": "railsim-vehicle/1", "name": "train", "reference": "car1.carbody",
        "assemblies": {"car": {"placements": places, **parts}}, "elements": couplers,
    })  # fmt: skip
    found = sensors(train)
    arms = [found[f"floor_{place}"].arm[0] for place in ("front", "middle", "rear")]
    assert arms == pytest.approx([9.5, 0.0, -9.5], abs=1e-9)
    assert found["frame_12"].body == "car2.rear.frame"
    flat = flatten(train)
    bogies = [bogie_name(flat, wheelset) for wheelset in flat.of_kind("wheelset")]
    expected = [f"car{n}.{end}" for n in range(3) for end in ("front", "rear") for _ in range(2)]
    assert bogies == expected
