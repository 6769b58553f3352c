"""Where sensors are and what they are fixed to."""

import pytest

import railsim
from railsim.definitions.vehicle.definition import Vehicle
from railsim.result.sensors import all_sensors


def test_point_of_the_service_table_on_a_wheelset_does_not_spin_with_it() -> None:
    coach = railsim.load_vehicle("coach_manchester")
    box = all_sensors(coach)["axlebox_1_right"]
    assert box.axlebox
    centre = next(s for s in all_sensors(coach).values() if s.body == "carbody").offset
    point = {"body": box.body, "position": [box.offset - centre, box.arm[1], -0.46]}
    service = coach.service.model_dump() | {"points": {"box": point}}
    found = all_sensors(coach.replace(service=service))["box"]
    assert found.axlebox
    assert (found.body, found.arm[1]) == (box.body, box.arm[1])


def on_axles(*places, **more):
    """A car body 1.8 m above the rails on axles at these places, without a service table."""
    axle = {
        "mass": 1500.0, "inertia": [900.0, 100.0, 900.0], "radius": 0.46, "profile": "S1002",
    }  # fmt: skip
    body = {"mass": 3e4, "inertia": [5e4, 1e6, 1e6], "position": [0.5, 0.0, -1.8]}
    spring = {"kind": "bushing", "sides": "both", "stiffness": [1e7, 1e7, 1e6]}
    return Vehicle.model_validate({
        "format": "railsim-vehicle/1", "name": "a car on axles", "bodies": {"body": body},
        "wheelsets": {f"axle{k}": {**axle, "position": [x, 0.0, -0.46]}
                      for k, x in enumerate(places)},
        "elements": {f"spring{k}": {**spring, "bodies": ["body", f"axle{k}"],
                                    "point": [x, 1.0, -0.6]}
                     for k, x in enumerate(places)},
        **more,
    })  # fmt: skip


@pytest.mark.parametrize("given", [None, 0.95])
def test_floor_is_1_2_m_above_the_rails_where_no_service_table_says_another_height(given):
    service = {"admissible_speed": 30.0, "cant_deficiency": 0.1, "floor_height": given}
    vehicle = on_axles(4.5, -4.5, **({"service": service} if given else {}))
    found = all_sensors(vehicle)
    for name in ("floor_front", "floor_middle", "floor_rear"):
        assert found[name].arm[2] == pytest.approx(1.8 - (given or 1.2))  # z is down


@pytest.mark.parametrize(
    ("places", "ends"),
    [((4.5, -4.5), 4.5), ((4.5, 0.0, -4.5), None), ((6.0, 4.0, 0.0, -4.0, -6.0), None)],
)
def test_floor_in_front_is_as_far_from_the_middle_as_the_floor_behind(places, ends):
    """A car that is its own mirror image; an axle in the middle belongs to both ends."""
    found = all_sensors(on_axles(*places))
    x = {name: found[f"floor_{name}"].arm[0] + 0.5 for name in ("front", "middle", "rear")}
    assert x["middle"] == pytest.approx(0.0, abs=1e-12)
    assert x["front"] == pytest.approx(-x["rear"], abs=1e-12)
    assert x["front"] > 0.0
    if ends:
        assert x["front"] == pytest.approx(ends)
