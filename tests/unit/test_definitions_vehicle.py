"""Vehicle definitions: what is refused, how assemblies are placed, mirrored and named."""

import numpy as np
import pytest
import tomli_w

from railsim.definitions.elements.base import two_sided
from railsim.definitions.loading import load_vehicle, load_vehicle_text
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.names import resolve
from railsim.errors import InputError

BODY = {"mass": 10.0, "inertia": [1.0, 1.0, 1.0], "position": [0.0, 0.0, -0.6]}
WHEELSET = {
    "mass": 1000.0,
    "inertia": [600.0, 80.0, 600.0],
    "position": [0.0, 0.0, -0.46],
    "radius": 0.46,
    "profile": "S1002",
}


def vehicle(**parts):
    return Vehicle.model_validate({"format": "railsim-vehicle/1", "name": "test", **parts})


def faults_of(definition):
    with pytest.raises(InputError) as caught:
        flatten(definition)
    return [str(fault) for fault in caught.value.faults]


def wagon(element=None, **more):
    """Frame on two wheelsets, with one element between the frame and the leading wheelset."""
    rear = {**WHEELSET, "position": [-2.0, 0.0, -0.46]}
    front = {**WHEELSET, "position": [2.0, 0.0, -0.46]}
    elements = {"link": element} if element else {}
    parts = {
        "bodies": {"frame": BODY},
        "wheelsets": {"rear": rear, "front": front},
        "elements": elements,
    }
    return vehicle(**{**parts, **more})


def bushing(**more):
    return {"kind": "bushing", "bodies": ["frame", "front"], "point": [2.0, 1.0, -0.5], **more}


def test_wheelsets_are_ordered_from_the_leading_end():
    flat = flatten(wagon())
    assert [body.name for body in flat.bodies] == ["frame", "front", "rear"]
    assert flat.reference == "frame"


def test_a_single_wheelset_is_a_vehicle():
    flat = flatten(vehicle(wheelsets={"axle": WHEELSET}))
    assert flat.reference == "axle"


def test_number_given_once_holds_for_both_sides():
    flat = flatten(vehicle(wheelsets={"axle": {**WHEELSET, "profile": ["S1002", "worn.csv"]}}))
    definition = flat.bodies[0].wheelset
    assert definition.radius == (0.46, 0.46)
    assert definition.profile == ("S1002", "worn.csv")


def test_left_copy_is_the_mirror_image():
    element = bushing(sides="both", preload=[1.0, 2.0, -3.0])
    left, right = flatten(wagon(element)).elements
    assert (left.name, right.name) == ("link.left", "link.right")
    assert left.point1 == (2.0, -1.0, -0.5)
    assert right.point1 == (2.0, 1.0, -0.5)
    assert right.definition.preload == (1.0, 2.0, -3.0)
    assert left.definition.preload == (1.0, -2.0, -3.0)


def assembly_of_assemblies():
    """Two bogies of two axles each; every inner assembly is mirrored in its second placement."""
    axle = {
        "placements": [
            {"name": "outer", "position": [1.0, 0.0, 0.0]},
            {"name": "inner", "position": [-1.0, 0.0, 0.0], "mirror": True},
        ],
        "wheelsets": {"wheelset": WHEELSET},
        "elements": {
            "rod": bushing(
                bodies=["frame", "wheelset"],
                point=[0.2, 1.0, -0.46],
                sides="both",
                preload=[5.0, 1.0, 0.0],
            )
        },
    }
    bogie = {
        "placements": [
            {"name": "front", "position": [9.0, 0.0, 0.0]},
            {"name": "rear", "position": [-9.0, 0.0, 0.0], "mirror": True},
        ],
        "bodies": {"frame": BODY},
        "assemblies": {"axle": axle},
    }
    return vehicle(bodies={"car": BODY}, assemblies={"bogie": bogie})


def test_nested_mirrors_compose():
    flat = flatten(assembly_of_assemblies())
    x = {body.name: body.position[0] for body in flat.of_kind("wheelset")}
    assert x == {
        "front.outer.wheelset": 10.0,
        "front.inner.wheelset": 8.0,
        "rear.inner.wheelset": -8.0,
        "rear.outer.wheelset": -10.0,
    }
    right = {e.name: e for e in flat.elements if e.name.endswith("right")}
    signs = {
        "front.outer": 1.0,
        "front.inner": -1.0,
        "rear.inner": 1.0,  # mirrored twice
        "rear.outer": -1.0,
    }
    for scope, sign in signs.items():
        element = right[f"{scope}.rod.right"]
        assert element.definition.preload == (5.0 * sign, 1.0, 0.0)
        assert element.point1[0] == pytest.approx(x[f"{scope}.wheelset"] + sign * 0.2, abs=1e-15)
        assert element.body1 == f"{scope.split('.')[0]}.frame"


def test_names_resolve_from_the_innermost_assembly_outwards():
    known = dict.fromkeys(["frame", "front.frame", "front.outer.box.left", "car"])
    assert resolve("frame", ("front", "outer"), None, known) == "front.frame"
    assert resolve("frame", (), None, known) == "frame"
    assert resolve("car", ("front", "outer"), None, known) == "car"
    assert resolve("front.frame", ("rear",), None, known) == "front.frame"
    assert resolve("box", ("front", "outer"), "left", known) == "front.outer.box.left"
    assert resolve("box", ("front", "outer"), None, known) is None


def with_axleboxes(**element):
    box = {
        "wheelset": "front",
        "position": [2.0, 1.0, -0.46],
        "pitch_inertia": 10.0,
        "sides": "both",
    }
    return wagon({**bushing(bodies=["frame", "box"]), **element}, axleboxes={"box": box})


def test_sided_element_takes_the_axlebox_of_its_side():
    flat = flatten(with_axleboxes(sides="both"))
    assert [e.body2 for e in flat.elements] == ["box.left", "box.right"]
    boxes = flat.of_kind("axlebox")
    assert [box.name for box in boxes] == ["box.left", "box.right"]
    assert [box.position[1] for box in boxes] == [-1.0, 1.0]
    assert {box.parent for box in boxes} == {"front"}


def test_axlebox_stands_on_the_wheelset_even_beside_a_body_of_its_name():
    box = {"wheelset": "axle", "position": [0.0, 1.0, -0.46], "pitch_inertia": 10.0}
    arm = {"placements": [{"name": "front"}], "bodies": {"axle": BODY}, "axleboxes": {"box": box}}
    flat = flatten(vehicle(wheelsets={"axle": WHEELSET}, assemblies={"arm": arm}))
    assert flat.body("front.box").parent == "axle"


def test_element_without_side_must_say_which_axlebox():
    (fault,) = faults_of(with_axleboxes())
    assert "elements.link.bodies.1: no body 'box'" in fault
    assert "box.left" in fault


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"wheelset": "fromt"}, "axleboxes.box.wheelset: no wheelset 'fromt'"),
        ({"wheelset": "frame"}, "axleboxes.box.wheelset: no wheelset 'frame'"),
        ({"position": [2.1, 1.0, -0.46]}, "off its axle by more than 1 mm"),
        ({"position": [2.0, -1.0, -0.46]}, "not on the right"),
    ],
)
def test_axlebox_that_does_not_fit_is_refused(change, expected):
    box = {
        "wheelset": "front",
        "position": [2.0, 1.0, -0.46],
        "pitch_inertia": 10.0,
        "sides": "both",
        **change,
    }
    assert any(expected in fault for fault in faults_of(wagon(axleboxes={"box": box})))


def test_same_name_of_two_elements_is_refused():
    group = {
        "placements": [{"name": "end"}],
        "elements": {"link": {**bushing(), "bodies": ["frame", "front"]}},
    }
    parts = wagon(assemblies={"one": group, "two": group})
    assert any("'end.link' is used twice" in fault for fault in faults_of(parts))


def test_element_without_points_stands_at_its_bodies():
    bar = {"kind": "roll_bar", "bodies": ["frame", "front"], "stiffness": 1.0}
    (element,) = flatten(wagon(bar)).elements
    assert element.point1 == (0.0, 0.0, -0.6)
    assert element.point2 == (2.0, 0.0, -0.46)


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ({"bodies": {"frame": BODY}}, "a vehicle needs one at least"),
        ({"wheelsets": {"a": WHEELSET}, "reference": "b"}, "no body 'b'"),
        ({"wheelsets": {"a": WHEELSET, "b": WHEELSET}}, "stand at the same position"),
        ({"wheelsets": {"a": {**WHEELSET, "radius": 0.5}}}, "z = -0.5 m"),
        ({"wheelsets": {"a": WHEELSET}, "bodies": {"a": BODY}}, "the name 'a' is used twice"),
    ],
)
def test_vehicle_that_does_not_hang_together_is_refused(parts, expected):
    assert any(expected in fault for fault in faults_of(vehicle(**parts)))


@pytest.mark.parametrize(
    ("element", "expected"),
    [
        (bushing(bodies=["frame", "fromt"]), "did you mean 'front'?"),
        (bushing(bodies=["frame", "frame"]), "both ends are on 'frame'"),
        (bushing(point=[2.0, -1.0, -0.5], sides="both"), "not on the right"),
    ],
)
def test_element_that_does_not_fit_is_refused(element, expected):
    (fault,) = faults_of(wagon(element))
    assert expected in fault
    assert "elements.link" in fault


def test_same_placement_name_in_two_assemblies_is_refused():
    group = {"placements": [{"name": "front"}], "bodies": {"frame": BODY}}
    parts = {"wheelsets": {"a": WHEELSET}, "assemblies": {"one": group, "two": group}}
    assert any("'front.frame' is used twice" in fault for fault in faults_of(vehicle(**parts)))


STOP = {
    "kind": "bump_stop",
    "bodies": ["frame", "front"],
    "point": [0, 0, 0],
    "axis": "x",
    "table": [[-0.01, -5.0], [0.0, 0.0], [0.02, 8.0]],
}
PAD = {
    "kind": "friction",
    "bodies": ["frame", "front"],
    "point": [0, 1, -0.5],
    "friction_force": [0.0, 0.0, 3000.0],
    "stick_stiffness": [0.0, 0.0, 1e7],
}
AIR = {
    "kind": "airspring",
    "bodies": ["frame", "front"],
    "points": [[0, 1, -0.5], [0, 1, -0.9]],
    "bellows_stiffness": 4e5,
    "reservoir_stiffness": 2e5,
    "orifice_damping": 1e4,
    "horizontal_stiffness": [1.5e5, 1.5e5],
}
WIND = {"kind": "applied_force", "bodies": ["frame"], "force_table": [[0.0, 1.0, 2.0, 3.0]]}
DAMPER = {"kind": "spring_damper", "bodies": ["frame", "front"], "points": [[0, 0, 0], [0, 0, -1]]}
BAR = {"kind": "roll_bar", "bodies": ["frame", "front"], "stiffness": 1.0}


EQUAL = "must begin with force 0 (same in both directions)"
BEGIN = "the first column must begin at 0 (same in both directions) or below 0"
WRONG = [  # element, key that is at fault, what is said of it
    ({**DAMPER, "stiffness": -1.0}, "stiffness", "-1.0; must be greater than or equal to 0"),
    ({**DAMPER, "stiffness": True}, "stiffness", "True; must be a valid number"),
    ({**DAMPER, "stiffness": "1"}, "stiffness", "'1'; must be a valid number"),
    ({**DAMPER, "stiffness": float("nan")}, "stiffness", "nan; must be a finite number"),
    ({**DAMPER, "stiffness": float("inf")}, "stiffness", "inf; must be a finite number"),
    ({**DAMPER, "points": [[0, 0, 0], [0, 0, 0]]}, "", "the two points are the same"),
    ({**DAMPER, "points": [[0, 0, 0]]}, "points", "1 value; a list of 2"),
    ({**DAMPER, "preload": "later"}, "preload", "'later'; must be 'auto'"),
    ({**DAMPER, "series_stiffness": 1.0}, "", "needs 'damping' or 'damper_table'"),
    (
        {**DAMPER, "damping": 1.0, "damper_table": [[0, 0], [1, 2]]},
        "",
        "either 'damping' or 'damper_table', not both",
    ),
    (
        {**DAMPER, "stiffness": 1.0, "spring_table": [[0, 0], [1, 2]]},
        "",
        "either 'stiffness' or 'spring_table', not both",
    ),
    ({**DAMPER, "damper_table": [[0, 0]]}, "damper_table", "a table needs two rows at least"),
    ({**DAMPER, "damper_table": [[0, 1], [1, 2]]}, "damper_table", EQUAL),
    ({**DAMPER, "damper_table": [[0.5, 0], [1, 2]]}, "damper_table", BEGIN),
    (
        {**DAMPER, "damper_table": [[0, 0], [1, 2], [1, 3]]},
        "damper_table",
        "the first column must increase from row to row",
    ),
    (
        {**DAMPER, "damper_table": [[0, 0], [1, 2], [2, 1]]},
        "damper_table",
        "the force must not fall from row to row",
    ),
    (bushing(stifness=[1, 1, 1]), "stifness", "unknown key; did you mean 'stiffness'?"),
    (bushing(points=DAMPER["points"]), "", "either 'point' or 'points' is needed"),
    (bushing(point=None), "", "either 'point' or 'points' is needed"),
    (bushing(point=[0, 0]), "point", "2 values; a list"),
    (bushing(bodies=["frame"]), "bodies", "1 value; a list of 2"),
    (bushing(stiffness=[1, -1, 1]), "stiffness.1", "-1; must be greater than or equal to 0"),
    (bushing(series_stiffness=[1, 0, 0]), "", "along x needs 'damping' along x"),
    ({**BAR, "stiffness": 0.0}, "stiffness", "0.0; must be greater than 0"),
    ({**BAR, "sides": "both"}, "sides", "unknown key; allowed: bodies, damping, kind, stiffness"),
    ({**STOP, "axis": "w"}, "axis", "'w'; must be 'x', 'y' or 'z'"),
    ({**STOP, "table": [[0.0, 1.0], [1.0, 2.0]]}, "table", EQUAL),
    ({**STOP, "table": [[0.1, 0.0], [1.0, 2.0]]}, "table", BEGIN),
    (
        {**PAD, "friction_force": None},
        "",
        "no friction: 'friction_force' or 'friction_coefficient' is needed",
    ),
    # without a vertical spring force nothing presses the surfaces together
    (
        {**PAD, "friction_coefficient": [0.0, 0.0, 0.3]},
        "",
        "'friction_coefficient' needs 'stiffness' or 'preload' along z",
    ),
    ({**PAD, "stick_stiffness": [0.0, 0.0, 0.0]}, "", "along z needs 'stick_stiffness' along z"),
    (
        {**PAD, "friction_coefficient": [0.0, -0.1, 0.0]},
        "friction_coefficient.1",
        "-0.1; must be greater than or equal to 0",
    ),
    ({**AIR, "bellows_stiffness": 0.0}, "bellows_stiffness", "0.0; must be greater than 0"),
    ({**AIR, "orifice_damping": -1.0}, "orifice_damping", "-1.0; must be greater than 0"),
    ({**AIR, "horizontal_stiffness": [1.0, 1.0, 1.0]}, "horizontal_stiffness", "a list of 2"),
    ({**WIND, "force_table": None}, "", "'force_table' or 'torque_table' is needed"),
    ({**WIND, "bodies": ["frame", "front"]}, "bodies", "2 values; a list of 1"),
    ({**WIND, "axes": "rail"}, "axes", "'rail'; must be 'body' or 'track'"),
    ({**WIND, "force_table": [[0.0, 1.0]]}, "force_table.0", "2 values; a list of 4"),
    ({**WIND, "force_table": []}, "force_table", "0 values; a list of 1 at least"),
    (
        {**WIND, "force_table": [[1.0, 0, 0, 0], [0.0, 0, 0, 0]]},
        "force_table",
        "the time or distance must increase from row to row",
    ),
]


@pytest.mark.parametrize(("element", "key", "words"), WRONG)
def test_element_with_a_wrong_value_is_refused_for_it_alone(element, key, words):
    file = wagon().model_dump(exclude_none=True)
    file["elements"] = {"e": {name: value for name, value in element.items() if value is not None}}
    with pytest.raises(InputError) as caught:
        load_vehicle_text(tomli_w.dumps(file))
    (fault,) = caught.value.faults
    assert fault.key == ".".join(filter(None, ["elements.e", key]))
    assert words in "; ".join(filter(None, [fault.found, fault.allowed]))


@pytest.mark.parametrize("element", [
    {**DAMPER, "stiffness": 5.0, "damping": 0.0, "series_stiffness": 4.0},
    bushing(stiffness=[5, 0, 0], damping=[0, 2, 0], series_stiffness=[4, 4, 0]),
])  # fmt: skip
def test_damper_that_failed_has_no_force_though_a_spring_is_in_series(element):
    (row,) = flatten(wagon(element)).elements[0].definition.rows()
    along = row.states[0] if hasattr(row, "states") else row.state
    assert along is None
    assert np.max(row.stiffness) == 5.0
    assert np.all(np.asarray(row.damping) == 0.0)


def test_no_damping_beside_a_table_is_refused_as_it_would_change_nothing():
    key = "assemblies.bogie.elements.yaw_damper.damping"
    coach = load_vehicle("coach_25t")
    for change in (lambda: load_vehicle("coach_25t", [f"{key}=0"]),
                   lambda: coach.with_values({key: 0.0})):  # fmt: skip
        with pytest.raises(InputError, match=r"damping: has no effect beside 'damper_table'"):
            change()
    table = "yaw_damper.damper_table=[[0,0],[1,0]]"
    assert "yaw_damper" in load_vehicle("coach_25t", [table]).assemblies["bogie"].elements


@pytest.mark.parametrize("element", [STOP, PAD, AIR, WIND])
def test_further_elements_are_placed(element):
    (flat,) = flatten(wagon(element)).elements
    assert flat.body1 == "frame"
    assert flat.body2 == ("" if element is WIND else "front")


def test_stop_with_two_different_sides_turns_round_in_a_mirrored_placement():
    definition = flatten(wagon(STOP)).elements[0].definition
    turned = definition.mirrored((-1.0, 1.0, 1.0))
    assert turned.table == ((-0.02, -8.0), (-0.0, -0.0), (0.01, 5.0))
    assert definition.mirrored((1.0, -1.0, 1.0)) == definition
    symmetric = definition.model_copy(update={"table": ((0.0, 0.0), (1.0, 1.0))})
    assert symmetric.mirrored((-1.0, 1.0, 1.0)) == symmetric


@pytest.mark.parametrize("signs", [(-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, 1.0)])
def test_mirrored_load_has_the_mirrored_moment(signs):
    """A torque r x F of a mirrored force at a mirrored point is the mirrored torque."""
    lever, force = np.array([1.0, 2.0, 3.0]), np.array([5.0, -7.0, 11.0])
    tables = {"force_table": [[0.0, *force]], "torque_table": [[0.0, *np.cross(lever, force)]]}
    definition = flatten(wagon({**WIND, **tables})).elements[0].definition.mirrored(signs)
    np.testing.assert_array_equal(definition.force_table[0][1:], signs * force)
    moment = np.cross(signs * lever, signs * force)
    np.testing.assert_array_equal(definition.torque_table[0][1:], moment)


def test_two_sided_table_keeps_what_is_given_for_both_directions():
    rows = ((-0.1, -2.0), (0.2, 8.0))
    assert two_sided(rows) == rows
    assert two_sided(((0.0, 0.0), (0.2, 8.0))) == ((-0.2, -8.0), (0.0, 0.0), (0.2, 8.0))


@pytest.mark.parametrize("name", ["coach_manchester", "benchmark_vehicle1"])
def test_shipped_vehicle_reads_back_from_its_own_text(name):
    original = load_vehicle(name)
    assert load_vehicle_text(original.to_toml()) == original


def test_benchmark_vehicle_differs_from_the_study_coach_where_the_sources_differ():
    coach, benchmark = flatten(load_vehicle("coach_manchester")), load_vehicle("benchmark_vehicle1")
    other = flatten(benchmark)
    changed = [a.name for a, b in zip(coach.bodies, other.bodies, strict=True) if a != b]
    assert changed == ["carbody"]
    changed = [a.name for a, b in zip(coach.elements, other.elements, strict=True) if a != b]
    assert len(changed) == 8
    assert all(".primary." in name for name in changed)


def test_coach_weighs_what_the_study_says():
    flat = flatten(load_vehicle("coach_manchester"))
    # 43628 + 2 x 2615 + 4 x 1813 kg
    assert sum(body.mass for body in flat.bodies) == pytest.approx(56110.0, abs=1e-9)
    assert len(flat.elements) == 2 * (2 + 2 + 2 + 1 + 1 + 1 + 2 * (2 + 2))
