"""A vehicle turned end for end: `turned = true` against the same vehicle written out by hand."""

import numpy as np
import pytest
from test_vehicles import lopsided_everything

from railsim import InputError, load_track, load_vehicle, simulate
from railsim.contact.out_of_round import _height, _wrapped
from railsim.definitions.mirror import turned_vehicle
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.files.sources import library_files

ABOUT_Z = (-1.0, -1.0, 1.0)  # signs of a turn by half a circle


def at(point):
    return [sign * value for sign, value in zip(ABOUT_Z, point, strict=True)]


def by_hand(vehicle):
    """The flat vehicle with every point turned about z, wheels exchanged, forces turned."""
    flat = flatten(vehicle)
    data = {"format": "railsim-vehicle/1", "name": "by hand"}
    data |= {kind: {} for kind in ("bodies", "wheelsets", "axleboxes", "elements")}

    def named(name):
        return name.replace(".", "_")

    for body in flat.bodies:
        if body.kind == "body":
            new = {"mass": body.mass, "inertia": body.inertia}
        elif body.kind == "wheelset":
            new = body.wheelset.model_dump(exclude_unset=True)
            new |= {key: new[key][::-1] for key in ("radius", "profile")}
        else:
            new = {"wheelset": named(body.parent), "pitch_inertia": body.pitch_inertia}
        kind = {"body": "bodies", "wheelset": "wheelsets", "axlebox": "axleboxes"}[body.kind]
        data[kind][named(body.name)] = {**new, "position": at(body.position)}
    data["reference"] = named(flat.reference)
    for element in flat.elements:
        new = element.definition.mirrored(ABOUT_Z).model_dump(exclude_none=True)
        for key in ("sides", "free_length", "load_at_length", "point", "points"):
            new.pop(key, None)
        new["bodies"] = [named(end) for end in (element.body1, element.body2) if end]
        ends = [at(element.point1), at(element.point2)]
        if element.definition.end_points() is not None:
            new |= {"point": ends[0]} if ends[0] == ends[1] else {"points": ends}
        data["elements"][named(element.name)] = new
    return Vehicle.model_validate(data)


def written(tmp_path, vehicle, *more):
    """The vehicle in a file that is turned."""
    path = tmp_path / "vehicle.toml"
    path.write_text(vehicle.to_toml(), encoding="utf-8")
    return load_vehicle(path, ["turned=true", *more])


def test_lopsided_vehicle_runs_as_the_one_written_out_by_hand(tmp_path):
    """All kinds of elements, wind and a torque, from a right-hand transition into the curve."""
    vehicle = lopsided_everything()
    turned = written(tmp_path, vehicle)
    how = {"speed": 15.0, "start": 110.0, "duration": 0.5}
    found, expected, ahead = (
        simulate(one, load_track("curve_r500"), **how)
        for one in (turned, by_hand(vehicle), vehicle)
    )
    assert pytest.approx(expected.Q, abs=1e-4) == found.Q
    assert pytest.approx(expected.Y, abs=1e-4) == found.Y
    assert found["wheelset_yaw"] == pytest.approx(expected["wheelset_yaw"], abs=1e-9)
    assert np.abs(found.Q - ahead.Q).max() > 1e3
    assert pytest.approx(ahead.Q0[::-1, ::-1]) == found.Q0


def test_uneven_load_stands_at_the_other_end_and_on_the_other_side():
    """The load case is that of the vehicle as its file has it."""
    ahead, turned = (
        load_vehicle("wagon_y25", ["load=uneven", *more]) for more in ([], ["turned=true"])
    )
    centre, other = (flatten(one).bodies[0].position for one in (ahead, turned))
    assert centre[:2] != (0.0, 0.0)
    assert other == pytest.approx(at(centre))
    assert turned.name == f"{ahead.name}, turned"


@pytest.mark.parametrize("name", sorted(library_files("vehicle")))
def test_turned_twice_a_vehicle_is_itself(name):
    vehicle = load_vehicle(name)
    turned = turned_vehicle(vehicle)
    assert flatten(turned_vehicle(turned)) == flatten(vehicle)
    ends = [body.position[0] for body in flatten(vehicle).of_kind("wheelset")]
    assert [b.position[0] for b in flatten(turned).of_kind("wheelset")] == pytest.approx(
        [-x for x in ends[::-1]]
    )


@pytest.mark.parametrize(
    "uneven",
    [
        {"type": "harmonics", "angle": 0.4, "waves": [[1, 2e-4, 0.3], [3, 1e-4, -1.1]]},
        {"type": "table", "angle": 0.4, "rows": [[0.0, 0.0], [0.5, 3e-4], [2.0, -1e-4]]},
        {"type": "flat", "angle": 0.4, "length": 0.05, "shape": "worn"},
    ],
)
def test_a_wheel_that_rolls_the_other_way_has_its_radius_of_the_opposite_angle(uneven):
    uneven = uneven | {"wheel": "left"}
    coach = load_vehicle("coach_manchester")
    axle = coach.model_dump(exclude_none=True)
    axle["assemblies"]["bogie"]["assemblies"]["axle"]["wheelsets"]["wheelset"]["out_of_round"] = {
        "it": uneven
    }
    turned = turned_vehicle(Vehicle.model_validate(axle))
    (part,) = flatten(turned).of_kind("wheelset")[0].wheelset.out_of_round.values()
    assert part.wheel == "right"
    before = type(part).model_validate(uneven)
    phi = np.linspace(0.0, 2.0 * np.pi, 50)
    found, expected = (
        _height(one, 0.45, _wrapped(at - one.angle))[0] for one, at in ((part, phi), (before, -phi))
    )
    assert np.ptp(expected) > 1e-5
    assert found == pytest.approx(expected, abs=1e-12)


def test_sensors_and_points_of_service_stay_where_they_are_on_the_vehicle(tmp_path):
    coach = load_vehicle("coach_manchester")
    seat = {"body": "carbody", "position": [8.0, 0.7, -1.2]}
    service = {"admissible_speed": 40.0, "cant_deficiency": 0.1, "points": {"seat": seat}}
    turned = written(tmp_path, coach.replace(service=service, sensors={"seat_too": seat}))
    for point in (turned.service.points["seat"], turned.sensors["seat_too"]):
        assert point.position == pytest.approx(at(seat["position"]))


def test_a_vehicle_with_signals_is_not_turned(tmp_path):
    coach = load_vehicle("coach_manchester")
    rolling = {"quantity": "angle", "body": "carbody", "axis": "roll"}
    with pytest.raises(InputError, match=r"turned.*signals or controllers.*signs"):
        written(tmp_path, coach.replace(signals={"rolling": rolling}))
    with pytest.raises(InputError, match=r"turned.*signals or controllers.*signs"):
        coach.replace(signals={"rolling": rolling}).replace(turned=True)


def test_a_vehicle_is_turned_by_replace_as_by_its_file(tmp_path):
    coach = load_vehicle("coach_manchester")
    bodies = coach.model_dump(exclude_none=True)["bodies"]
    bodies["carbody"]["position"] = [0.3, 0.05, -1.8]
    lopsided = coach.replace(bodies=bodies)
    assert lopsided.replace(turned=True) == written(tmp_path, lopsided)
