"""Where sensors are and what they are fixed to."""

import railsim
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
