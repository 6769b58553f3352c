"""Pads, centre plates and wedges press and never pull: preloads, statics, modes, runs."""

from types import SimpleNamespace

import numpy as np
import pytest
from dynamics import load_track, load_vehicle
from test_loads import GRAVITY, MASS, K, at_rest, wagon

import railsim
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import ModelError
from railsim.model.assembly import without_rails
from railsim.model.plausibility import vehicle_remarks
from railsim.model.preloads import static_shares
from railsim.model.statics import _gaps

PAD = {
    "kind": "side_bearer",
    "bodies": ["axle", "body"],
    "point": [0.0, 0.5, -0.8],
    "sides": "both",
    "stiffness": 5e6,
    "damping": 2e4,
    "friction_coefficient": 0.2,
    "stick_stiffness": 1e7,
}
WEDGE = {
    "kind": "wedge",
    "bodies": ["axle", "body"],
    "point": [0.0, 0.5, -0.8],
    "sides": "both",
    "stiffness": [0.0, 0.0, 2e5],
    "angle": 0.7,
    "friction_coefficient": 0.3,
    "stick_stiffness": [1e7, 1e7],
}


def with_elements(vehicle, assembly, **elements):
    """Vehicle with further elements in one of its assemblies."""
    data = vehicle.model_dump(exclude_none=True)
    data["assemblies"][assembly]["elements"].update(elements)
    return Vehicle.model_validate(data)


@pytest.mark.parametrize(("stiffness", "clearance"), [(5e6, 0.010), (1e6, 0.2)])
def test_side_bearers_that_do_not_touch_change_nothing_at_rest(stiffness, clearance):
    """As preloads of -k c they lifted this coach by 115 and by 446 mm."""
    bearer = {
        **PAD,
        "bodies": ["frame", "carbody"],
        "point": [0.0, 1.0, -1.0],
        "stiffness": stiffness,
        "clearance": clearance,
    }
    coach = load_vehicle("coach_manchester")
    others = with_elements(coach, "bogie", bearer=bearer)
    alone, beside = railsim.static_loads(coach), railsim.static_loads(others)
    np.testing.assert_array_equal(beside.Q0, alone.Q0)
    assert beside.preload.keys() == alone.preload.keys()  # none for the bearers
    for name, force in alone.preload.items():
        np.testing.assert_array_equal(beside.preload[name], force)
    assert vehicle_remarks(others) == vehicle_remarks(coach)


@pytest.mark.parametrize("mass", [MASS, 3.0 * MASS])
def test_pad_with_clearance_carries_from_where_it_touches(mass):
    """4 K x + 4 k max(0, x - c) = added weight; x = 0 at the tare mass."""
    k, clearance = PAD["stiffness"], 0.006
    load = {"laden": {"bodies": {"body": {"mass": mass}}}}
    vehicle = with_elements(
        wagon(loads=load, load="laden"), "end", pad={**PAD, "clearance": clearance}
    )
    body, _, z_axle = at_rest(vehicle, load_track("straight"))
    weight = (mass - MASS) * GRAVITY / 4.0
    sunk = (weight + k * clearance) / (K + k) if weight > 0.0 else 0.0
    assert body[2] - z_axle == pytest.approx(sunk, abs=1e-8)


def test_what_only_presses_is_not_preloaded_in_tension():
    """Three equal supports under a body at 0, 0.5 and 1 m, its weight at 0.1 m.

    Springs share it linearly, -1/15 of it at the end; pads leave it to the first two: 0.8 and 0.2.
    """
    body = {"mass": MASS, "inertia": [8e3, 9e4, 9e4], "position": [0.1, 0.0, -1.2]}
    data = wagon().model_dump(exclude_none=True)
    axle = data["assemblies"]["end"]["wheelsets"]["axle"]
    pads = {f"pad_{k}": {**PAD, "point": [0.5 * k, 0.5, -0.8], "preload": "auto"} for k in range(3)}
    vehicle = Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "on pads",
            "bodies": {"body": body},
            "wheelsets": {"axle": axle},
            "elements": pads,
        }
    )
    shares = static_shares(without_rails(vehicle))
    weight = MASS * GRAVITY
    for k, share in enumerate((0.8, 0.2, 0.0)):
        for side in ("left", "right"):
            assert shares[f"pad_{k}.{side}"] == pytest.approx(0.5 * share * weight, abs=1e-6)
    assert any(
        "pad_2.left, pad_2.right" in remark.key and "would have to pull" in remark.text
        for remark in vehicle_remarks(vehicle)
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"preload": [0.0, 0.0, -2e3]}, "must not be negative; found -2000"),
        ({"point": None, "points": [[0.0, 0.5, -0.9], [0.0, 0.5, -0.7]]}, "must not lie above"),
    ],
)
def test_wedge_with_the_wrong_sign_is_refused(change, words):
    with pytest.raises(ValueError, match=words):
        with_elements(wagon(), "end", wedge={**WEDGE, **change})


def test_wedge_the_wrong_way_round_is_refused_by_name():
    """Its bodies exchanged, it would hang from what it should carry."""
    right = with_elements(wagon(), "end", wedge=WEDGE)
    assert railsim.static_loads(right).preload["front.wedge.left"][2] > 0.0
    wrong = with_elements(wagon(), "end", wedge={**WEDGE, "bodies": ["body", "axle"]})
    with pytest.raises(
        ModelError, match=rf"'{wrong.name}'.* would have to pull.*front\.wedge\.right"
    ):
        railsim.static_loads(wrong)
    # `validate` says it too, with the remarks on the file
    assert any("wedges press and never pull" in note.text for note in vehicle_remarks(wrong))
    assert not vehicle_remarks(right)


def test_pad_that_does_not_touch_takes_no_part_in_the_modes():
    coach = load_vehicle("coach_manchester")
    bearer = {**PAD, "bodies": ["frame", "carbody"], "point": [0.0, 1.0, -1.0], "clearance": 0.01}
    others = with_elements(coach, "bogie", bearer=bearer)
    one, other = (
        [mode.eigenvalue for mode in railsim.modes(each, speed=20.0).oscillations]
        for each in (coach, others)
    )
    np.testing.assert_allclose(other, one, rtol=1e-5)


def test_pads_press_and_never_pull_in_a_run():
    """Over a dip the clearance of 1 mm closes and opens; the damper pulls no more than the pad."""
    dip = {"type": "dip", "s": 12.0, "length": 3.0, "depth": 8e-3}
    result = railsim.simulate(
        with_elements(wagon(), "end", pad={**PAD, "clearance": 1e-3}),
        load_track("straight").replace(irregularities=[dip]),
        speed=15.0,
        duration=1.5,
        settings=Settings(outputs={"elements": ["*.pad.*"]}, output_rate=1000.0),
    )
    force = result.element_force[:, :, 2]
    assert force.min() > -1e-6  # N, round-off
    assert (np.abs(force) < 1e-6).any()
    assert force.max() > 1e3


@pytest.mark.parametrize(
    ("law", "free"),
    [
        # 20 mm to either side, of which y = 5 mm is used up
        ({"axis": "y", "table": [[0.0, 0.0], [0.02, 0.0], [0.03, 1e5]]}, ("y", 0.015, 0.025)),
        ({"axis": "x", "table": [[0.0, 0.0], [0.02, 0.0], [0.03, 1.0]]}, ("x", 0.019, 0.021)),
        # rows that end free of force: no stop to this side
        ({"axis": "y", "table": [[-0.1, 0.0], [0.02, 0.0], [0.03, 1e5]]}, ("y", 0.015, np.inf)),
        ({"axis": "y", "table": [[-0.1, -1.0], [-0.09, 0.0], [0.2, 0.0]]}, ("y", np.inf, 0.095)),
        ({"stop_table": [[-0.02, -1.0], [-0.01, 0.0], [0.0, 0.0], [0.03, 1.0]]},
         ("z", -0.002, 0.012)),
        ({"axis": "z", "table": [[0.0, 0.0], [0.02, 1e3]]}, ("z", -0.002, 0.002)),
        ({"clearance": 0.003}, ("z", 0.001, np.inf)),
        # pressed from the beginning, or no stop at all
        ({"axis": "z", "table": [[-0.1, -2.0], [-0.09, 0.0], [-0.01, 0.0], [0.1, 1.0]]}, None),
        ({"axis": "z", "table": [[-0.1, -2.0], [0.01, 0.0], [0.02, 0.0], [0.1, 1.0]]}, None),
        ({"clearance": 0.0}, None),
    ],
)  # fmt: skip
def test_free_travel_to_both_stops_is_what_their_table_leaves(law, free):
    """Of an element whose body 2 has moved by (1, 5, 2) mm."""
    element = SimpleNamespace(definition=SimpleNamespace(**law))
    found = _gaps(element, np.array([0.001, 0.005, 0.002]))
    if free is None:
        assert found is None
    else:
        assert found[0] == free[0]
        assert found[1:] == pytest.approx(free[1:])
