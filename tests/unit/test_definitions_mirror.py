"""Mirror images of tracks and vehicles: twice is the original, everything changes sides."""

import numpy as np
import pytest

from railsim.contact.geometry import geometry_of
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.errors import InputError
from railsim.model.assembly import assemble
from railsim.model.statics import static_loads
from railsim.profiles import load_profile
from railsim.track.tables import track_tables

RICH = {
    "rail": ("60E1", "54E1"),
    "friction_table": [[0.0, 0.3, 0.4], [200.0, 0.1, 0.2]],
    "friction_falling": {"rest": 0.4, "decay": 0.6},
    "third_body": (0.3, 0.1),
    "gauge_widening": [[290.0, 0.0, 0.0], [310.0, 0.0, 0.01]],
    "cant_rotation": "inner_rail",
    "irregularities": [
        {"type": "random", "spectrum": "erri_b176_high", "seed": 3},
        {"type": "dip", "s": 100.0, "length": 3.0, "depth": 0.01, "rail": "left"},
        {"type": "kink", "s": 100.0, "length": 9.0, "offset": 0.01, "rail": "right"},
        {"type": "twist", "s": 200.0, "length": 9.0, "height": 0.01},
        {
            "type": "sweep",
            "channel": "lateral",
            "amplitude": 2e-3,
            "wavelengths": (20.0, 5.0),
            "begin": 50.0,
            "end": 150.0,
        },
        {
            "type": "measured",
            "rows": [[s, 0.001 * s, 0.002, 0.0, 0.0] for s in (0.0, 1.0, 2.0, 3.0, 4.0)],
        },
    ],
}


def test_mirrored_track_has_mirrored_tables_to_the_last_bit():
    track = load_track("curve_r250").replace(**RICH)
    plain, mirrored = track_tables(track), track_tables(mirrored_track(track))
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # X, Y, Z, psi, theta, phi
    np.testing.assert_array_equal(mirrored.coefficients, signs[:, None] * plain.coefficients)
    # y_left, z_left, y_right, z_right, mu_left, mu_right
    signs = np.array([-1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
    exchanged = plain.rail[:, [2, 3, 0, 1, 5, 4]]
    np.testing.assert_array_equal(mirrored.rail, signs[:, None] * exchanged)


@pytest.mark.parametrize("name", ["straight", "curve_r250"])
def test_track_mirrored_twice_is_the_original(name):
    track = load_track(name).replace(**RICH)
    assert mirrored_track(mirrored_track(track)) == track
    assert mirrored_track(track) != track


def test_mirror_image_says_what_it_is_and_not_what_its_original_said():
    track, vehicle = load_track("curve_r250"), load_vehicle("coach_manchester")
    assert track.to_toml() != mirrored_track(track).to_toml()
    assert "radius = -250.0" in mirrored_track(track).to_toml()
    assert flatten(vehicle) is flatten(vehicle)
    moved = vehicle.model_copy(update={"name": "another"})
    assert flatten(moved).name == "another"
    assert 'name = "another"' in moved.to_toml()


def test_symmetric_vehicle_is_its_own_mirror_image():
    coach = load_vehicle("coach_manchester")
    assert flatten(mirrored_vehicle(coach)) == flatten(coach)


def test_an_element_on_one_of_two_axleboxes_changes_sides():
    coach = load_vehicle("coach_flexicoil").model_dump(exclude_none=True)
    brake = {"kind": "brake", "bodies": ["arm.left", "wheelset"], "torque_table": [[0.0, 5e3]]}
    coach["assemblies"]["bogie"]["assemblies"]["axle"]["elements"]["brake"] = brake
    vehicle = Vehicle.model_validate(coach)
    image = mirrored_vehicle(vehicle)
    assert mirrored_vehicle(image) == vehicle
    here, there = (
        [e.body1 for e in flatten(v).elements if e.name.endswith(".brake")]
        for v in (vehicle, image)
    )
    assert [name.replace(".left", ".right") for name in here] == there
    assert len(here) == 4


def test_lopsided_vehicle_changes_sides():
    wheelset = {
        "mass": 1000.0,
        "inertia": [600.0, 80.0, 600.0],
        "position": [0.0, 0.0, -0.46],
        "radius": [0.4601, 0.4599],
        "profile": ["S1002", "worn.csv"],
    }
    body = {"mass": 5000.0, "inertia": [1.0, 1.0, 1.0], "position": [0.0, 0.1, -1.5]}
    link = {
        "kind": "bushing",
        "bodies": ["car", "axle"],
        "point": [0.0, 0.7, -0.46],
        "preload": [0.0, 5.0, -100.0],
    }
    rod = {**link, "kind": "spring_damper", "points": [[0.0, 0.2, -1.0], [0.0, 0.8, -1.0]]}
    del rod["point"], rod["preload"]
    box = {"wheelset": "axle", "position": [0.0, 1.0, -0.46], "pitch_inertia": 10.0}
    vehicle = Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "lopsided",
            "bodies": {"car": body},
            "wheelsets": {"axle": wheelset},
            "axleboxes": {"box": box},
            "elements": {"link": link, "rod": rod},
        }
    )
    mirrored = mirrored_vehicle(vehicle)
    assert mirrored_vehicle(mirrored) == vehicle
    flat = flatten(mirrored)
    assert flat.body("car").position[1] == -0.1
    assert flat.body("box").position[1] == -1.0
    assert flat.body("axle").wheelset.radius == (0.4599, 0.4601)
    assert flat.body("axle").wheelset.profile == ("worn.csv", "S1002")
    assert flat.elements[0].point1[1] == -0.7
    assert flat.elements[0].definition.preload == (0.0, -5.0, -100.0)
    assert flat.elements[1].point2[1] == -0.8


def test_lopsided_load_changes_sides():
    """Of a wagon whose load lies to one side: the static wheel loads of the other."""
    wagon = load_vehicle("wagon_y25", ["load=uneven"])
    here, there = static_loads(wagon), static_loads(mirrored_vehicle(wagon))
    left, right = np.array(here.Q0).T
    assert right.sum() != pytest.approx(left.sum(), rel=0.01)
    np.testing.assert_allclose(np.array(there.Q0)[:, ::-1], here.Q0, rtol=1e-6)


PROFILE = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"


@pytest.mark.usefixtures("small_contact_tables")
def test_left_and_right_wheel_of_a_wheelset_have_profiles_of_their_own():
    """The first one is that of the left wheel: moved to the right, it rolls on a smaller radius."""
    cones = ["cone_1in20", "cone_1in40"]
    coach, track = load_vehicle("coach_manchester"), load_track("straight")

    def tables(profile):
        model = assemble(coach.with_values({PROFILE: profile}), track, Settings())
        return [[model.tables[k].values for k in pair] for pair in model.system.contact.table]

    alone = [tables(cone)[0][0] for cone in cones]
    assert not np.array_equal(*alone)
    for wheels in tables(cones):
        for wheel, same in zip(wheels, alone, strict=True):
            np.testing.assert_array_equal(wheel, same)
    axle = flatten(coach.with_values({PROFILE: cones})).of_kind("wheelset")[0].wheelset
    profiles = {name: load_profile(name) for name in (*cones, *track.rail)}
    found = geometry_of(axle, track, profiles)
    middle = np.abs(found.lateral) < 2e-3
    slopes = np.polyfit(found.lateral[middle], found.rolling_radius[middle], 1)[0]
    assert slopes == pytest.approx([-0.05, 0.025], rel=0.05)  # and as the wheelset rolls


@pytest.mark.parametrize(
    ("acts", "turned"),
    [("x", False), ("y", True), ("z", False), ("roll", True), ("pitch", False), ("yaw", True)],
)
def test_mirrored_actuators_answer_a_command_with_the_mirrored_force(acts, turned):
    """Forces are vectors, moments axial vectors; in the file of the mirror image as well."""
    coach = load_vehicle("coach_manchester")
    act = {"kind": "actuator", "bodies": ["carbody", "front.frame"], "point": [9.5, 0.3, -0.9]}
    vehicle = coach.replace(elements={**dict(coach.elements), "act": {**act, "acts": acts}})
    image = mirrored_vehicle(vehicle)
    for one in (
        image,
        image.with_values({"name": "image"}),
        Vehicle.model_validate(image.model_dump()),
    ):
        (flat,) = (element for element in flatten(one).elements if element.name == "act")
        assert next(flat.definition.rows()).sense == (-1.0 if turned else 1.0)
    assert flatten(mirrored_vehicle(image)) == flatten(vehicle)
    line = {**act, "point": None, "points": [[9.5, 0.0, -0.9], [9.5, 0.3, -0.9]]}
    with pytest.raises(InputError, match="has no 'against_axis'"):
        vehicle.replace(elements={**dict(coach.elements), "act": {**line, "against_axis": True}})
