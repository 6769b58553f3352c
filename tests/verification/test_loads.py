"""Load cases and free lengths against statics by hand."""

from itertools import pairwise

import numpy as np
import pytest

from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import InputError
from railsim.kernels.elements import load_component
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium

GRAVITY = 9.81
K = 4e5  # N/m, each of two springs
MASS = 8000.0


def wagon(spring=None, **more):
    """Two axles, a body on four vertical springs at x = +-3 m and y = +-1 m."""
    axle = {
        "mass": 1300.0,
        "inertia": [800.0, 90.0, 800.0],
        "position": [0.0, 0.0, -0.46],
        "radius": 0.46,
        "profile": "S1002",
    }
    nest = {
        "kind": "shear_spring",
        "bodies": ["body", "axle"],
        "sides": "both",
        "points": [[0.0, 1.0, -0.9], [0.0, 1.0, -0.6]],
        "stiffness": [2e6, 2e6, K],
        "bending_stiffness": [1e4, 1e4],
        **(spring or {}),
    }
    placements = [
        {"name": "front", "position": [3.0, 0.0, 0.0]},
        {"name": "rear", "position": [-3.0, 0.0, 0.0], "mirror": True},
    ]
    body = {"mass": MASS, "inertia": [8e3, 9e4, 9e4], "position": [0.0, 0.0, -1.2]}
    return Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "wagon",
            "bodies": {"body": body},
            "assemblies": {
                "end": {
                    "placements": placements,
                    "wheelsets": {"axle": axle},
                    "elements": {"nest": nest},
                }
            },
            **more,
        }
    )


@pytest.fixture(scope="module")
def straight():
    return load_track("straight")


def at_rest(vehicle, track):
    """Position of the body against its nominal one, Q0, sinking of the wheelsets."""
    balance = equilibrium(assemble(vehicle, track, load_settings()), 1.0)
    names = balance.model.index.bodies
    q = balance.state[: 6 * len(names)].reshape(-1, 6)
    axles = [names.index(name) for name in balance.model.index.wheelsets]
    return q[names.index("body")], balance.Q0, q[axles, 2].mean()


def test_a_laden_wagon_sinks_by_its_load_over_its_springs(straight):
    load = {"laden": {"bodies": {"body": {"mass": 3.0 * MASS}}}}
    _, light, z_light = at_rest(wagon(loads=load), straight)
    body, laden, z_laden = at_rest(wagon(loads=load, load="laden"), straight)
    assert body[2] - z_laden == pytest.approx(2.0 * MASS * GRAVITY / (4.0 * K), rel=1e-6)
    assert np.sum(laden) - np.sum(light) == pytest.approx(2.0 * MASS * GRAVITY, rel=1e-9)
    assert z_laden > z_light  # the contacts give way too


def test_a_load_off_the_middle_pitches_and_shifts_the_wheel_loads(straight):
    load = {"ahead": {"bodies": {"body": {"position": [0.6, 0.0, -1.2]}}}}
    body, Q0, _ = at_rest(wagon(loads=load, load="ahead"), straight)
    # moment about the middle m g 0.6 is carried by the springs at +-3 m
    shift = MASS * GRAVITY * 0.6 / 6.0
    assert np.sum(Q0[0]) - np.sum(Q0[1]) == pytest.approx(2.0 * shift, rel=2e-3)
    # nose down is negative pitch; the longitudinal springs add some stiffness, 5 % at most
    assert body[4] == pytest.approx(-shift / (2.0 * K) / 3.0, rel=0.05)


@pytest.mark.parametrize("sided", ["free_length", "load_at_length"])
def test_a_wagon_stands_where_springs_of_known_length_carry_it(straight, sided):
    # nominal length 0.3 m, free 0.34 m: each spring carries k (0.34 - L)
    length = (
        {"free_length": 0.34} if sided == "free_length" else {"load_at_length": [K * 0.04, 0.3]}
    )
    body, _, z_axle = at_rest(wagon(length), straight)
    sinking = MASS * GRAVITY / (4.0 * K) - 0.04
    assert body[2] - z_axle == pytest.approx(sinking, rel=1e-6)


@pytest.mark.parametrize(
    "spring",
    [
        {"kind": "bushing", "point": [0.0, 1.0, -0.5], "stiffness": [1e6, 1e6, 1e6]},
        {"kind": "spring_damper", "points": [[0.0, 1.0, -0.8], [0.0, 1.0, -0.5]]},
    ],
)
def test_a_measured_length_without_seats_or_stiffness_is_refused_by_its_key(spring):
    spring = {**spring, "bodies": ["body", "axle"], "load_at_length": [12e3, 0.3]}
    vehicle = wagon().model_dump(exclude_none=True) | {"elements": {"spring": spring}}
    with pytest.raises(ValueError, match="'load_at_length' need"):
        Vehicle.model_validate(vehicle)


def test_two_stage_spring_stands_on_its_second_stage_when_laden(straight):
    stage = {
        "kind": "bump_stop",
        "bodies": ["body", "axle"],
        "sides": "both",
        "axis": "z",
        "points": [[0.0, 1.0, -0.9], [0.0, 1.0, -0.6]],
        # the axle comes up towards the body by 20 mm before the second coil is touched
        "table": [[-1.0, -0.98 * 1e6], [-0.02, 0.0], [1.0, 0.0]],
    }
    load = {"laden": {"bodies": {"body": {"mass": 3.0 * MASS}}}}
    vehicle = wagon(loads=load, load="laden").model_dump(exclude_none=True)
    vehicle["assemblies"]["end"]["elements"]["second"] = stage
    body, _, z_axle = at_rest(Vehicle.model_validate(vehicle), straight)
    # K x + 1e6 (x - 0.02) = added load per spring
    x = (2.0 * MASS * GRAVITY / 4.0 + 1e6 * 0.02) / (K + 1e6)
    assert body[2] - z_axle == pytest.approx(x, rel=1e-5)


@pytest.mark.further
def test_levelled_air_springs_keep_the_height_of_the_car(straight):
    names = ("carbody", "front.frame", "front.outer.wheelset")
    z = {}
    for load in ([], ["load=laden"]):
        vehicle = load_vehicle("coach_25t", load)
        balance = equilibrium(assemble(vehicle, straight, load_settings()), 1.0)
        q = balance.state[: 6 * balance.model.index.n_bodies].reshape(-1, 6)
        z[bool(load)] = [q[balance.model.index.bodies.index(name), 2] for name in names]
        assert np.ptp(balance.Q0) < 1e-3 * balance.Q0.mean()
    car, frame, axle = np.subtract(z[True], z[False])
    assert car == pytest.approx(frame, abs=1e-6)
    # eight coils; each is sheared too, because its lower seat turns with the arm of 0.425 m: middle
    # of the coil 0.3155 m above the axle, and its load there works against the shear stiffness
    load, extra = 52.6e3, 13500.0 * GRAVITY / 8.0
    stiffness = 0.991e6 + 0.8e6 * (0.3155 / 0.425) ** 2 - (load + extra / 2) * 0.3155 / 0.425**2
    assert frame - axle == pytest.approx(extra / stiffness, rel=0.03)  # of second order left out


def test_design_load_equals_a_load_case_of_the_same_numbers(straight):
    same = {"same": {"bodies": {"body": {"mass": MASS}}}}
    for one, other in zip(
        at_rest(wagon(), straight), at_rest(wagon(loads=same, load="same"), straight), strict=True
    ):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('load = "ladden"\n[loads.laden.bodies.carbody]\nmass = 1.0\n', "no load case 'ladden'"),
        ("[loads.laden.bodies.carbdy]\nmass = 1.0\n", "no body 'carbdy'"),
        ("[loads.laden.assemblies.bogey.bodies.frame]\nmass = 1.0\n", "no assembly 'bogey'"),
        ("[loads.own.bodies.carbody]\n", "is needed"),
        ("[loads.laden.bodies.carbody]\nmass = -1.0\n", "mass"),
    ],
)
def test_a_wrong_load_case_is_refused_with_its_key(tmp_path, text, message):
    file = tmp_path / "v.toml"
    file.write_text(
        'format = "railsim-vehicle/1"\nname = "v"\nextends = "coach_manchester"\n' + text
    )
    with pytest.raises(InputError, match=message):
        load_vehicle(file)


def test_length_and_preload_together_are_refused():
    with pytest.raises(ValueError, match="not both"):
        wagon({"free_length": 0.34, "preload": [0.0, 0.0, 1.0]})


def test_wagon_on_y25_bogies_stands_tare_and_laden_where_its_springs_carry_it(straight):
    """From the springs alone: per axlebox 1.0 MN/m (free 260 mm) and 1.6 MN/m (free 234 mm)."""

    def heights(load):
        vehicle = load_vehicle("wagon_y25").replace(load=load)
        balance = equilibrium(assemble(vehicle, straight, load_settings()), 1.0)
        names = balance.model.index.bodies
        z = dict(zip(names, balance.state[2 : 6 * len(names) : 6], strict=True))
        return z["front.frame"] - z["front.outer.wheelset"], z["carbody"] - z["front.frame"]

    frame, carbody = heights(None)
    assert heights("design") == (
        frame,
        carbody,
    )  # its own numbers, as a study over loads names them
    tare, laden = ((mass + 2 * 2100.0) / 8 * GRAVITY for mass in (12200.0, 80200.0))
    nominal = 0.260 - 0.2399
    assert tare < 1.0e6 * 0.026  # the inner springs are free
    assert frame == pytest.approx(tare / 1.0e6 - nominal, abs=1e-7)
    sunk, lower = heights("laden")
    compression = (laden + 1.6e6 * 0.026) / (1.0e6 + 1.6e6)
    assert sunk == pytest.approx(compression - nominal, rel=1e-5)  # 35.7 mm
    # centre bowl and side bearers of a bogie
    carried = 2 * 50e6 + 2 * 0.55e6
    assert lower - carbody == pytest.approx(34000.0 * GRAVITY / carried, rel=1e-4)  # 3.3 mm


def test_a_load_is_linear_between_its_rows_and_constant_beyond():
    """Each component of three loads, one after the other in one table, as numpy interpolates it."""
    table, starts = np.random.default_rng(5).normal(size=(8, 4)), [0, 4, 5, 8]
    for first, last in pairwise(starts):
        rows = table[first:last]
        rows[:, 0] = np.sort(rows[:, 0])
        for at in np.concatenate([rows[:, 0], np.linspace(-4.0, 4.0, 33)]):
            found = [load_component.py_func(table, first, last, at, k) for k in (1, 2, 3)]
            expected = [np.interp(at, rows[:, 0], rows[:, k]) for k in (1, 2, 3)]
            assert found == pytest.approx(expected, abs=1e-12)
