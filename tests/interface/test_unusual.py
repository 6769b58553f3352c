"""Remarks on vehicles and starts that are allowed but unlike experience; where they are shown."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import railsim
from railsim import cli
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import InitialState as Initial
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.model.assembly import without_rails
from railsim.model.plausibility import (
    flangeway_remarks,
    gauge_remarks,
    narrow_remarks,
    vehicle_remarks,
)
from railsim.model.preloads import static_shares
from railsim.profiles import load_profile
from railsim.result import peak
from railsim.simulation import disturbance

BODY = {"mass": 8e3, "inertia": [5e3, 9e3, 9e3], "position": [0.0, 0.0, -1.2]}
AXLE = {
    "mass": 1300.0,
    "inertia": [800.0, 90.0, 800.0],
    "position": [0.0, 0.0, -0.46],
    "radius": 0.46,
    "profile": "S1002",
}
SPRING = {
    "kind": "shear_spring",
    "bodies": ["frame", "axle"],
    "points": [[0.0, 1.0, -0.9], [0.0, 1.0, -0.6]],
    "sides": "both",
    "stiffness": [2e6, 2e6, 4e5],
    "damping": [0.0, 0.0, 5e3],
}

STOP = {
    "kind": "bump_stop",
    "bodies": ["frame", "axle"],
    "point": [0.0, 1.0, -0.6],
    "sides": "both",
    "axis": "z",
}

INCLINED = {  # 3 parts across, 4 down of 5
    "kind": "spring_damper",
    "points": [[0.0, 0.7, -1.0], [0.0, 1.0, -0.6]],
    "stiffness": 4e8,
    "damping": 0.0,
}

PLATE = {
    "kind": "centre_plate",
    "bodies": ["axle", "frame"],
    "point": [0.0, 0.0, -0.75],
    "stiffness": 2e8,
    "friction_coefficient": 0.3,
    "stick_stiffness": 1e8,
}

DAMPER = {
    "kind": "spring_damper",
    "bodies": ["frame", "axle"],
    "points": [[0.0, 0.0, -0.9], [0.0, 0.0, -0.5]],
    "damping": 15e3,
}


def vehicle(body=(), spring=(), axle=(), **others):
    return Vehicle.model_validate(
        {
            "format": "railsim-vehicle/1",
            "name": "half a wagon",
            "bodies": {"frame": {**BODY, **dict(body)}},
            "wheelsets": {"axle": {**AXLE, **dict(axle)}},
            "elements": {"spring": {**SPRING, **dict(spring)}, **others},
        }
    )


def test_admissible_speed_in_kilometres_per_hour_is_remarked():
    service = {"admissible_speed": 160.0, "cant_deficiency": 0.13}
    wrong = vehicle().replace(service=service)
    assert "service.admissible_speed: 160 m/s are 576 km/h" in "\n".join(
        str(remark) for remark in vehicle_remarks(wrong)
    )
    right = vehicle().replace(service=service | {"admissible_speed": 160.0 / 3.6})
    assert not any("m/s" in str(remark) for remark in vehicle_remarks(right))


@pytest.mark.parametrize(
    ("unusual", "names", "words"),
    [
        (vehicle(body={"position": [0.0, 0.0, 1.2]}), "frame", "below the rails, z up to 1.2 m"),
        (vehicle(spring={"stiffness": [2e3, 2e3, 4e2]}), "frame", "bounces at 0.0503 Hz"),
        (vehicle(spring={"stiffness": [2e9, 2e9, 4e8]}), "frame", "bounces at 50.3 Hz"),
        (vehicle(spring=INCLINED), "frame", "bounces at 40.3 Hz"),  # sqrt(2 0.8^2 k/m)/(2 pi)
        (vehicle(spring={"damping": [0.0, 0.0, 5e6]}), "frame", "damping ratio 62.5 of its bounce"),
        (
            vehicle(spring={"points": [[0.0, 1.0, 0.9], [0.0, 1.0, 0.6]]}),
            "spring.left, spring.right",
            "below the rails, z up to 0.9 m",
        ),
        (
            vehicle(spring={"points": [[0.0, 1000.0, -900.0], [0.0, 1000.0, -600.0]]}),
            "spring.left, spring.right",
            "up to 1000 m from the origin: are lengths in m?",
        ),
        (
            vehicle(plate={**PLATE, "radius": 178.0}),
            "plate.pad_2",
            "up to 106.35 m beside the middle of the track",
        ),
        (
            vehicle(axle={"radius": 460.0, "position": [0.0, 0.0, -460.0]}),
            "axle",
            "wheel radius 460 m",
        ),
        (vehicle(axle={"back_to_back": 1360.0}), "axle", "back_to_back 1360 m"),
        (
            vehicle(spring={"points": [[-6.0, 1.0, -0.9], [-6.0, 1.0, -0.6]]}),
            "spring.left, spring.right",
            "acts on axle from 6 m along the vehicle",
        ),
        (
            vehicle(stop={**STOP, "table": [[0.0, 0.0], [20.0, 0.0], [30.0, 5e3]]}),
            "stop.left, stop.right",
            "no force before 20 m of travel: is it in m?",
        ),
        (vehicle(body={"position": [0.0, 0.0, -12.0]}), "frame", "up to 12 m above the rails"),
        (
            vehicle(axle={"inertia": [90.0, 800.0, 800.0]}),
            "axle",
            "about the axle is not the smallest",
        ),
        # sqrt(800/1.3) m, sqrt(5/8000) m
        (vehicle(axle={"mass": 1.3}), "axle", "radius of gyration 24.8 m"),
        (vehicle(body={"inertia": [5.0, 9.0, 9.0]}), "frame", "radius of gyration 0.025 m"),
        (vehicle(damper={**DAMPER, "damping": 15.0}), "damper", "damping 15 N s/m"),
        (vehicle(damper={**DAMPER, "damping": 15e6}), "damper", "damping 1.5e+07 N s/m"),
        (vehicle(damper={**DAMPER, "series_stiffness": 4e3}), "damper", "gives way at 4000 N/m"),
        (
            vehicle(
                spring={
                    "kind": "friction",
                    "points": None,
                    "point": [0.0, 1.0, -0.46],
                    "friction_coefficient": [10.0, 6.0, 6.0],
                    "stick_stiffness": [4e6] * 3,
                }
            ),
            "spring.left, spring.right",
            "coefficient of friction 10,",
        ),
        # a plate, the limit, has Izz = Ixx + Iyy = 14000 kg m2
        (vehicle(body={"inertia": [5e3, 9e3, 20e3]}), "frame", "above the sum of the other"),
        (vehicle(body={"mass": 8.0}), "mass", "mean static wheel load 6.42 kN"),
        (
            # it stands on a bracket in front of the axle, which would have to pull at the back
            vehicle(
                rod={**SPRING, "points": [[0.5, 0.9, -0.9], [0.5, 0.9, -0.6]]},
                back={**SPRING, "points": [[1.0, 0.9, -0.9], [1.0, 0.9, -0.6]]},
            ),
            "back.left, back.right",
            "in tension at rest",
        ),
        (
            vehicle(
                spring={"load_at_length": [12e3, 0.32]},
                back={**SPRING, "points": [[0.2, 0.9, -0.9], [0.2, 0.9, -0.6]]},
            ),
            "spring.left, spring.right",
            "its length was measured under 12 kN",
        ),
        (
            vehicle(spring={"free_length": 0.29}),
            "spring.left, spring.right",
            "pulls with 4 kN: 290 mm long without load, and 300 mm between its seats",
        ),
    ],
)
def test_slips_of_sign_and_unit_are_remarked(unusual, names, words):
    found = vehicle_remarks(unusual)
    assert any(names in remark.key and words in remark.text for remark in found), found


def springs(frequency, ratio=0.2):
    """Two springs on which the frame has a frequency [Hz] and a damping ratio."""
    omega, mass = 2.0 * np.pi * frequency, BODY["mass"]
    each = {"stiffness": 0.5 * mass * omega**2, "damping": ratio * mass * omega}
    return vehicle(spring={key: [0.0, 0.0, value] for key, value in each.items()})


def wheels(load):
    """With a mean wheel load [N] on two wheels."""
    return vehicle(body={"mass": 2.0 * load / 9.81 - AXLE["mass"]})


def radii_of_gyration(x):
    return vehicle(body={"inertia": [BODY["mass"] * x**2] * 3})


def third_inertia(ratio):
    """Izz over the sum of Ixx and Iyy."""
    return vehicle(body={"inertia": [5e3, 9e3, ratio * 14e3]})


def at(**points):
    """A point of a spring elsewhere: `x` along the vehicle, `y` to the right [m]."""
    x, y = points.get("x", 0.0), points.get("y", 1.0)
    return vehicle(spring={"points": [[x, y, -0.9], [x, y, -0.6]]})


def stop_after(travel):
    """To one side; to the other a tenth later."""
    rows = [[-2.0 * travel, -5e3], [-1.1 * travel, 0.0], [travel, 0.0], [2.0 * travel, 5e3]]
    return vehicle(stop={**STOP, "table": rows})


def slide(coefficient):
    along = [0.5 * coefficient, coefficient, 0.1]  # the largest counts
    stick = {"friction_coefficient": along, "stick_stiffness": [4e6] * 3}
    where = {"points": None, "point": [0.0, 1.0, -0.46]}
    return vehicle(spring={"kind": "friction", **where, **stick})


def sticking(way):
    """Pads in place of the springs that slide after this way at their load at rest."""
    pad = {"kind": "side_bearer", "bodies": ["axle", "frame"], "points": None, "damping": 0.0}
    law = {"preload": "auto", "stiffness": 4e5, "friction_coefficient": 0.3}
    stick = {"point": [0.0, 1.0, -0.46], "stick_stiffness": 0.3 * WEIGHT / way}
    return vehicle(spring={**pad, **law, **stick})


def wheel(radius):
    return vehicle(axle={"radius": radius, "position": [0.0, 0.0, -radius]})


def damper(damping):
    return vehicle(damper={**DAMPER, "damping": damping})


def service(speed):
    return vehicle().replace(service={"admissible_speed": speed, "cant_deficiency": 0.1})


WEIGHT = 4e3 * 9.81  # of the frame on each of the two springs [N]
LIMITS = {  # how a vehicle has some value, what it is called, the last usual value, one beyond it
    "slow": (springs, "bounces at", 0.301, 0.299),
    "quick": (springs, "bounces at", 9.99, 10.01),
    "steel": (springs, "vibrates at", 499.0, 501.0),
    "damped": (lambda x: springs(1.0, x), "of its bounce", 1.499, 1.501),
    "light": (wheels, "mean static wheel load", 8.01e3, 7.99e3),
    "heavy": (wheels, "mean static wheel load", 249e3, 251e3),
    "far": (lambda x: at(y=x), "from the origin", 499.0, 501.0),
    "beside": (lambda x: at(y=x), "beside the middle of the track", 4.99, 5.01),
    "sticking": (sticking, "is stick_stiffness in N/m?", 0.0499, 0.0501),
    "high": (lambda x: vehicle(body={"position": [0.0, 0.0, -x]}), "above the rails", 7.99, 8.01),
    "not at the axle": (lambda x: at(x=x), "acts on axle from", 1.499, 1.501),
    "loose": (stop_after, "no force before", 0.999, 1.001),
    "small wheel": (wheel, "wheel radius", 0.101, 0.099),
    "large wheel": (wheel, "wheel radius", 1.199, 1.201),
    "wide": (lambda x: vehicle(axle={"back_to_back": x}), "back_to_back", 2.499, 2.501),
    "flat": (third_inertia, "of the other two", 1.299, 1.301),
    "compact": (radii_of_gyration, "radius of gyration", 0.0501, 0.0499),
    "long": (radii_of_gyration, "radius of gyration", 14.99, 15.01),
    "weak": (damper, "railways have 4e3", 201.0, 199.0),
    "stiff": (damper, "railways have 4e3", 9.99e6, 1.001e7),
    "lagging": (  # 15 kN s/m give way within 1 s
        lambda x: vehicle(damper={**DAMPER, "series_stiffness": x}), "in series", 15.1e3, 14.9e3,
    ),
    "rough": (slide, "coefficient of friction", 0.999, 1.001),
    "fast": (service, "is the speed in m/s?", 124.0, 126.0),
    "little load": (
        lambda x: vehicle(spring={"load_at_length": [WEIGHT / x, 0.3]}),
        "its length was measured under", 0.601, 0.599,
    ),
    "much load": (
        lambda x: vehicle(spring={"load_at_length": [WEIGHT / x, 0.3]}),
        "its length was measured under", 1.499, 1.501,
    ),
    "coil-bound": (  # of a free length of 0.4 m
        lambda x: vehicle(spring={"free_length": 0.4, "stiffness": [2e6, 2e6, WEIGHT / x / 0.4]}),
        "coil-bound", 0.699, 0.701,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("made", "words", "usual", "unusual"), LIMITS.values(), ids=LIMITS)
def test_a_remark_begins_at_its_limit(made, words, usual, unusual):
    """Each on the value and no other: the last usual one is not said, one nearby is."""
    assert not [r.text for r in vehicle_remarks(made(usual)) if words in r.text]
    assert [r.text for r in vehicle_remarks(made(unusual)) if words in r.text]


def test_a_load_off_the_middle_leans_on_side_bearers_of_given_preload():
    """It does not stand in the nominal position, which it need not: the carbody finds its roll."""
    assert not vehicle_remarks(load_vehicle("wagon_y25", ["load=uneven"]))


def test_springs_below_a_held_body_carry_it():
    """A frame of 1 t on soft springs from a held car of 8 t: they press with 39.2 kN each."""
    found = vehicle(
        body={"position": [0.0, 0.0, -0.6], "mass": 1e3, "inertia": [600.0, 900.0, 900.0]},
        spring={"points": [[0.0, 1.0, -0.6], [0.0, 1.0, -0.5]]},
    ).model_dump(exclude_none=True)
    found["bodies"]["car"] = {**BODY, "position": [0.0, 0.0, -1.5], "fixed": "track"}
    above = {"bodies": ["car", "frame"], "points": [[0.0, 1.0, -1.0], [0.0, 1.0, -0.7]]}
    found["elements"]["above"] = {**SPRING, **above}
    held = Vehicle.model_validate(found)
    assert static_shares(without_rails(held))["above.left"] == pytest.approx(4e3 * 9.81)
    assert not vehicle_remarks(held)


@pytest.mark.parametrize("kind", ["spring_damper", "bushing"])
@pytest.mark.parametrize("series", [0.0, 5e5])
def test_a_damper_counts_for_the_bounce_unless_a_spring_is_in_series(kind, series):
    """Two of c, k: c/sqrt(2 k m) = 5e6/sqrt(2 4e5 8e3) = 62.5; behind a spring it gives way."""
    along = {"stiffness": 0.0, "damping": 5e6, "series_stiffness": series}
    damper = {key: SPRING[key] for key in ("bodies", "points", "sides")} | along
    if kind == "bushing":
        damper = {key: [0.0, 0.0, value] for key, value in along.items()} | STOP
        del damper["axis"]
    unusual = vehicle(spring={"damping": [0.0, 0.0, 0.0]}, damper={**damper, "kind": kind})
    texts = [remark.text for remark in vehicle_remarks(unusual, supports=False)]
    found = [text.partition(",")[0] for text in texts if "bounce" in text]
    assert found == (["damping ratio 62.5 of its bounce"] if series == 0.0 else [])


@pytest.mark.parametrize(
    ("tables", "key", "words"),
    [
        (
            {"sensors": {"seat": {"body": "frame", "position": [0.0, 0.0, 1.2]}}},
            "sensors.seat",
            "below the rails, z up to 1.2 m",
        ),
        (
            {"loads": {"full": {"bodies": {"frame": {"position": [0.0, 0.0, -1200.0]}}}}},
            "loads.full: frame",
            "up to 1200 m from the origin",
        ),
        (
            {"service": {"admissible_speed": 20.0, "cant_deficiency": 0.1, "floor_height": 950.0}},
            "service.floor_height",
            "up to 950 m from the origin",
        ),
    ],
)
def test_slips_of_sensors_loads_and_service_are_remarked_too(tables, key, words):
    data = vehicle().model_dump(exclude_none=True)
    (found,) = vehicle_remarks(Vehicle.model_validate({**data, **tables}))
    assert found.key == key
    assert found.text.startswith(words)


def test_bodies_joined_in_a_ring_bounce_as_one():
    """Three bodies, each on both others: f = sqrt(k/(3 m))/(2 pi) on the springs of the axle."""
    data = vehicle(spring={"stiffness": [2e3, 2e3, 4e2]}).model_dump(exclude_none=True)
    ring = ("frame", "bolster", "carbody")
    data["bodies"] |= {name: BODY for name in ring}
    for lower, upper in zip(ring, (*ring[1:], ring[0]), strict=True):
        stiff = {"bodies": [upper, lower], "stiffness": [2e6, 2e6, 4e6]}
        data["elements"][f"{lower}_{upper}"] = {**SPRING, **stiff}
    (found,) = [r for r in vehicle_remarks(Vehicle.model_validate(data)) if "bounces" in r.text]
    frequency = np.sqrt(2 * 4e2 / (3 * BODY["mass"])) / (2.0 * np.pi)
    assert f"bounces at {frequency:.3g} Hz" in found.text


def test_an_ordinary_vehicle_has_no_remark():
    assert vehicle_remarks(vehicle(damper={**DAMPER, "series_stiffness": 4e6})) == []


def test_equal_findings_are_one_line_with_a_count():
    many = {f"box_{k}": {**BODY, "position": [0.0, 0.0, 1.0]} for k in range(20)}
    hung = {f"on_{k}": {**SPRING, "bodies": [f"box_{k}", "frame"]} for k in range(20)}
    data = vehicle().model_dump(exclude_none=True)
    data["bodies"] |= many
    data["elements"] |= hung
    below = [r for r in vehicle_remarks(Vehicle.model_validate(data)) if "below" in r.text]
    assert [r.key for r in below] == ["box_0, box_1, box_2 and 17 more"]


def test_they_are_shown_by_validate_info_and_once_by_a_run(tmp_path, capsys):
    path = tmp_path / "upside_down.toml"
    path.write_text(vehicle(body={"position": [0.0, 0.0, 1.2]}).to_toml())
    for command in ("validate", "info"):
        assert cli.main([command, str(path)]) == 0
        assert "frame: below the rails" in capsys.readouterr().out.replace("remark: ", "")
    assert cli.main(["info", str(path), "--quiet"]) == 0
    assert "below the rails" not in capsys.readouterr().out
    out = tmp_path / "run.h5"
    cli.main(
        ["run", str(path), "straight", "--speed", "10", "--duration", "0.1", "--out", str(out)]
    )
    assert capsys.readouterr().out.count("frame: below the rails") == 1
    assert any("below the rails" in remark for remark in railsim.open_result(out).remarks)


@pytest.mark.parametrize(("narrower", "wedged"), [(0.0095, False), (0.0105, True)])
def test_rails_closer_than_the_flanges_are_remarked_on(narrower, wedged):
    """S1002: Sd 32.5 mm, so that 1360 mm between the backs are 1425 mm over the flanges."""
    rail = np.zeros((40, 6, 4))
    rail[12, 0, 0], rail[12, 2, 0] = 0.4 * narrower, -0.6 * narrower
    system = SimpleNamespace(track=SimpleNamespace(rail=rail, s_start=-5.0, ds=0.5))
    coach = flatten(load_vehicle("coach_manchester"))
    model = SimpleNamespace(system=system, flat=coach, profiles={"S1002": load_profile("S1002")})
    remarks = narrow_remarks(model, 1.435)
    assert bool(remarks) == wedged
    said = "1425.0 mm over its flanges, the rails are 1424.5 mm apart at s = 1.0 m"
    assert all(said in str(remark) and "and 1 more" in str(remark) for remark in remarks)


@pytest.mark.parametrize(
    ("widths", "said"),
    [
        ((0.041, 0.041), []),
        ((0.032, 0.0), ["a flange of 32.5 mm in the flangeway of check_rail.0, 32.0 mm"]),
        # 1435 - 2 x 37.4 mm
        (
            (0.0374, 0.0374),
            ["1360.0 mm between its backs, the faces of check_rail.0 and 1 are 1360.2 mm apart"],
        ),
        ((0.0374, 0.0377), []),
    ],
)
def test_flangeways_without_room_are_remarked_on(widths, said):
    """The flares, 60 mm wide, are no narrow places, nor are two that do not stand together."""
    rails = [
        {
            "rail": rail,
            "flangeway": [[s, 0.06], [s + 3.0, width], [s + 8.0, width], [s + 9.0, 0.06]],
        }
        for rail, width, s in zip(("left", "right"), widths, (10.0, 12.0), strict=True)
        if width
    ]
    rails.append({"rail": "left", "flangeway": [[40.0, 0.035], [50.0, 0.035]]})
    model = SimpleNamespace(
        flat=flatten(load_vehicle("coach_manchester")), profiles={"S1002": load_profile("S1002")}
    )
    track = load_track("straight").replace(check_rail=rails)
    found = [*map(str, flangeway_remarks(model, track))]
    assert len(found) == len(said)
    assert all(words in remark for words, remark in zip(said, found, strict=True))


@cache
def disturbed(duration=0.02, after=None, **change):
    """The first instants of a coach with its leading wheelset moved."""
    settings = {
        "initial": {"front.outer.wheelset": change},
        "outputs": {} if after is None else {"evaluate_after": after},
    }
    return railsim.simulate(
        railsim.load_vehicle("coach_manchester"),
        railsim.load_track("straight"),
        speed=20.0,
        duration=duration,
        settings=railsim.Settings.model_validate(settings),
    )


@pytest.mark.parametrize("change", [{"y": 0.003}, {"y": -0.006}, {"yaw": 0.01}, {"y": 0.0075}])
def test_a_moved_wheelset_follows_its_contacts(change):
    """Its wheels carry what they carried at rest; pressed sideways into the rails they would not.

    Without irregularities the static load of a wheel is that of the rest, to the 1e-5 that creep
    forces in steady rolling take from it.
    """
    result = disturbed(**change)
    assert result["Q"][0] == pytest.approx(result["Q0"], rel=1e-4)
    key, value = next(iter(change.items()))
    moved = result["wheelset_lateral" if key == "y" else "wheelset_yaw"][0]
    assert moved == pytest.approx([value, 0.0, 0.0, 0.0], abs=1e-9)
    assert not [remark for remark in result.remarks if "impact" in remark]


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ((60e3, 60e3), (60e3, 91e3), "axle, right, is 91 kN at t = 0, at rest 60 kN"),
        ((60e3, 60e3), (29e3, 60e3), "axle, left, is 29 kN at t = 0, at rest 60 kN"),
        ((60e3, 60e3), (89e3, 31e3), None),
        ((90e3, 60e3), (115e3, 60e3), None),  # the outer wheel in a curve
        ((90e3, 60e3), (121e3, 60e3), "axle, left, is 121 kN at t = 0, at rest 60 kN"),
    ],
)
def test_an_impact_changes_a_load_by_more_than_half_of_the_static_one(before, after, words):
    model = SimpleNamespace(index=SimpleNamespace(wheelsets=("axle",)))
    said = disturbance._impact(model, np.array([after]), np.array([before]), np.full((1, 2), 60e3))
    assert [words in one for one in said] == ([True] if words else [])


def test_a_wheelset_that_follows_its_contacts_takes_work_arrays_once(monkeypatch):
    made, work_arrays = [], disturbance.work_arrays
    monkeypatch.setattr(
        disturbance, "work_arrays", lambda system: made.append(1) or work_arrays(system)
    )
    result = disturbed(y=0.0025)
    assert np.allclose(result["Q"][0], result["Q0"], rtol=1e-3)
    assert len(made) == 1


@pytest.mark.parametrize("given", ["z", "roll"])
def test_an_impact_at_the_start_is_remarked(given):
    """Who gives `z` or `roll` gets them."""
    result = disturbed(y=0.003, **{given: 1e-9})
    assert np.max(result["Q"][0]) > 5.0 * np.max(result["Q0"])
    found = [remark for remark in result.remarks if "impact" in remark]
    assert found[0].startswith("The initial disturbance is an impact: Q of front.outer.wheelset")
    assert "392.2 kN at t = 0" in found[0]


def test_peaks_of_a_run_leave_out_its_start():
    """By a tenth of a short run, by what the settings say; the histories are the same."""
    whole, late, usual = (disturbed(0.4, after, y=0.003, z=1e-9) for after in (0.0, 0.2, None))
    assert np.array_equal(whole["Q"], late["Q"])
    assert peak(whole, "Q").value == np.max(whole["Q"])  # the impact at t = 0
    assert usual.attributes["evaluation_start"] == pytest.approx(0.04)
    assert peak(usual, "Q").time >= 0.04
    largest = peak(late, "Q")
    assert largest.time >= 0.2
    assert np.max(late["Q"][late["time"] >= 0.2]) <= largest.value < peak(usual, "Q").value
    # what runs were told of is not forgotten
    assert any("times the static wheel load" in remark for remark in late.remarks)


@pytest.mark.parametrize("command", ["validate", "info"])
def test_twenty_equal_faults_are_one_line_with_a_count(command, tmp_path, capsys):
    path = tmp_path / "many.toml"
    data = vehicle().model_dump(exclude_none=True)
    data["bodies"] |= {f"box_{k}": BODY for k in range(20)}
    text = Vehicle.model_validate(data).to_toml()
    assert text.count("mass = 8000.0") == 21
    path.write_text(text.replace("mass = 8000.0", "mass = -8.0"))
    assert cli.main([command, str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "mass" in line
    assert "(and 20 more: " in line


@pytest.mark.parametrize(
    ("gauge", "backs", "usual"),
    [
        (1.435, 1.360, True),
        (1.435, 1.353, True),
        (1.0, 0.925, True),
        (1.520, 1.440, True),
        (1.668, 1.590, True),
        (1.5, 1.360, False),  # a wheelset for 1435 mm still stands on these rails
        (1.435, 1.400, False),
        (1.435, 1.389, True),  # 46 mm; railways have 45 to 115 mm
        (1.435, 1.391, False),
        (1.435, 1.321, True),
        (1.435, 1.319, False),
    ],
)
def test_wheelset_of_another_gauge_is_remarked_on(gauge, backs, usual):
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.back_to_back"
    coach = flatten(load_vehicle("coach_manchester", [f"{key}={backs}"]))
    remarks = gauge_remarks(coach, load_track("straight", [f"gauge={gauge}"]))
    assert bool(remarks) != usual
    said = f"{1e3 * (gauge - backs):.4g} mm less than the gauge"
    assert all(said in str(remark) and "and 1 more" in str(remark) for remark in remarks)


def springs_of(slope=0.0):
    """Loads of two wheels that stand 0.75 m to either side on springs of 1e12 N/m^1.5."""

    def loads_of(state):
        y, z, roll = state[3:6]
        deep = np.array([z - 0.75 * roll - slope * y, z + 0.75 * roll + slope * y])
        return None if deep.max() > 1e-3 else np.array([1e12 * np.maximum(deep, 0.0) ** 1.5])

    return loads_of


TARGET = np.array([50e3, 70e3])
DEEP = (TARGET / 1e12) ** (2.0 / 3.0)  # m


@pytest.mark.parametrize(("z", "roll"), [(1e-5, 0.0), (-2e-4, 0.0), (0.0, 3e-4), (0.0, -3e-4)])
def test_height_and_roll_are_found_also_from_the_air(z, roll):
    trial = np.array([9.0, 9.0, 9.0, 0.0, z, roll])
    assert disturbance._make_carry(springs_of(), 0, 2, TARGET, trial)
    assert trial[4] == pytest.approx(DEEP.mean(), rel=1e-3)
    assert trial[5] == pytest.approx((DEEP[1] - DEEP[0]) / 1.5, rel=1e-2)
    assert trial[:4].tolist() == [9.0, 9.0, 9.0, 0.0]


def test_contacts_that_cannot_be_computed_move_nothing():
    for z in (2e-3, 1e-3 - 1e-8):  # beyond the springs, and beyond them a tenth of a micrometre on
        trial = np.array([0.0, 0.0, 0.0, 0.0, z, 0.0])
        assert not disturbance._make_carry(springs_of(), 0, 2, TARGET, trial)
        assert trial.tolist() == [0.0, 0.0, 0.0, 0.0, z, 0.0]


@pytest.mark.parametrize("y", [0.006, -0.006])
def test_a_wheelset_follows_slopes_to_where_it_is_moved(y):
    """Treads of 1 in 20: it rolls by 6 mm/20/0.75 m the other way, from where it stood before."""
    slope = 0.05
    model = SimpleNamespace(index=SimpleNamespace(wheelsets=["axle"], coordinate=lambda *_: 2))
    state = np.zeros(8)
    state[3] = y
    state[4], state[5] = DEEP.mean(), (DEEP[1] - DEEP[0]) / 1.5
    loads_of = springs_of(slope=slope)
    state_before = state.copy()
    disturbance._follow_contacts(model, loads_of, 0, Initial(y=y), TARGET, state)
    assert loads_of(state)[0] == pytest.approx(TARGET, rel=1e-3)
    assert state[5] - state_before[5] == pytest.approx(-slope * y / 0.75, rel=1e-2)
    assert state[3] == y
    away = np.zeros(8)
    away[4] = 5e-3
    disturbance._follow_contacts(model, loads_of, 0, Initial(y=0.0), TARGET, away)
    assert away[4] == 5e-3
