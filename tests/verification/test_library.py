"""Shipped vehicles and tracks: their data against figures computed independently of railsim.

Masses, wheel loads and undamped vertical modes (vertical springs alone, wheels held) of the
vehicles were computed outside railsim from the sources' numbers; a mistyped number shows.
"""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from rig import Rig
from scipy.integrate import quad
from scipy.linalg import eigh
from selection import points

import railsim
from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.flatten import flatten
from railsim.files.sources import library_files, shipped_folder
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.studies.plan import Plan
from railsim.studies.spec import StudySpec
from railsim.track.alignment import Alignment

GRAVITY = 9.81
DOCS = Path(__file__).parents[2] / "docs"
# mass t, Q0 kN, bounce, bogie bounce, pitch, frame pitch Hz
FIGURES = {
    "coach_25t": (49.32, 60.48, 0.903, 7.44, 0.951, 7.98),
    "coach_crh380a": (53.01, 65.00, 0.762, 7.62, 1.043, 12.21),
    "coach_zhai_ordinary": (54.51, 66.84, 0.803, 5.54, 0.845, 6.86),
    "coach_zhai_high_speed": (45.60, 55.92, 0.929, 5.07, 1.020, 5.44),
    "power_car_china_star": (78.00, 95.65, 1.127, 7.17, 1.198, 7.59),
    "benchmark_vehicle1": (44.48, 54.55, 1.074, 7.47, 1.299, 11.71),
}
MASSES = {  # t, sums of the sources' tables
    "locomotive_coco_a": 138.0,
    "locomotive_coco_b": 124.0,
    "wagon_three_piece_25t": 90.0 + 2 * 0.596 + 4 * 0.46 + 4 * 1.145,
    "wagon_c62a_empty": 14.6 + 2 * 0.47 + 4 * 0.33 + 4 * 1.2,
    "wagon_y25": 22.0,
    "wagon_uic_link": 45.0,
    "wagon_uic_link_empty": 12.0,
    "metro_b_trailer": 22.0 + 2 * 2.56 + 4 * 1.42,
}
# km/h at which the sources say that a vehicle runs stably, or 110 % of its admissible speed
STABLE = {"coach_25t": 176.0, "coach_zhai_high_speed": 250.0}
# Friction holds wagons: linear analysis, in which it sticks, says little about their stability.
# Cooperrider's bogie hunts from 39 m/s on, with the source's friction of 0.15 from 44 m/s: below
# the admissible speed, which is assumed.
LEFT_OUT = ("wagon_", "cooperrider_")


def mass(flat):
    return sum(body.mass for body in flat.bodies)


def vertical_modes(flat):
    """Frequencies of z and pitch of sprung bodies on their vertical springs [Hz], and shapes."""
    index = {body.name: 2 * k for k, body in enumerate(flat.of_kind("body"))}
    M = np.diag([v for b in flat.of_kind("body") for v in (b.mass, b.inertia[1])])
    K = np.zeros_like(M)
    for element in flat.elements:
        # the bush of a trailing arm turns and carries nothing; links along a line are not vertical
        if "bush" in element.name or element.definition.kind == "spring_damper":
            continue
        k = element.definition.vertical_stiffness
        row = np.zeros(len(M))
        for name, sign, point in (
            (element.body1, 1.0, element.point1),
            (element.body2, -1.0, element.point2),
        ):
            if name in index:
                i = index[name]
                row[i] += sign
                row[i + 1] -= sign * (point[0] - flat.body(name).position[0])
        K += k * np.outer(row, row)
    squares, shapes = eigh(K, M)
    return np.sqrt(np.abs(squares)) / (2.0 * np.pi), shapes, index


def mode(flat, body, component):
    """Frequency of the mode in which one component of a body has most of its energy."""
    frequencies, shapes, index = vertical_modes(flat)
    M = np.array([v for b in flat.of_kind("body") for v in (b.mass, b.inertia[1])])
    energy = M[:, None] * shapes**2
    i = index[body] + component
    return frequencies[np.argmax(energy[i])]


@pytest.mark.parametrize("name", FIGURES)
def test_masses_loads_and_vertical_modes_are_those_computed_from_the_source(name):
    flat = flatten(load_vehicle(name))
    tonnes, load, bounce, bogie_bounce, pitch, frame_pitch = FIGURES[name]
    assert 1e-3 * mass(flat) == pytest.approx(tonnes, abs=0.006)  # half a unit of the last digit
    wheels = 2 * len(flat.of_kind("wheelset"))
    assert 1e-3 * mass(flat) * GRAVITY / wheels == pytest.approx(load, abs=0.006)
    # the figures' own digits
    assert mode(flat, "carbody", 0) == pytest.approx(bounce, abs=6e-4)
    assert mode(flat, "carbody", 1) == pytest.approx(pitch, rel=0.02)
    assert mode(flat, "front.frame", 0) == pytest.approx(bogie_bounce, rel=2e-3)
    assert mode(flat, "front.frame", 1) == pytest.approx(frame_pitch, rel=0.02)


@pytest.mark.parametrize("name", MASSES)
def test_mass_is_the_sum_of_the_source(name):
    assert 1e-3 * mass(flatten(load_vehicle(name))) == pytest.approx(MASSES[name], abs=0.05)


@points("name", [n for n in library_files("vehicle") if not n.startswith(LEFT_OUT)], always=(4, 13))
@pytest.mark.usefixtures("small_contact_tables")
def test_stable_at_110_per_cent_of_the_admissible_speed(name):
    """S1002 on 60E1 1:40, friction 0.4, lateral amplitudes of 3 mm: every oscillation decays."""
    vehicle = load_vehicle(name)
    speed = STABLE.get(name, 1.1 * 3.6 * vehicle.service.admissible_speed) / 3.6
    found = railsim.modes(vehicle, speed=speed, linearisation="harmonic", amplitude=3e-3)
    for mode in found.record()["modes"]:
        # rolling along the track and the wheels' spin are no oscillations
        if mode["natural_frequency"] > 0.05 and not mode["name"].startswith("rolling"):
            assert mode["damping_ratio"] > 0.0, mode["name"]


@pytest.mark.parametrize(("name", "side"), [("wagon_three_piece_25t", 5.9), ("wagon_c62a", 5.32)])
def test_springs_of_a_side_and_those_of_its_wedges_are_the_sources(name, side):
    """Zhai's appendix: Ksz [MN/m] of a side, of which Ksz1 = 0.769 MN/m under the wedges."""
    stiffness = {
        element.name.removeprefix("front."): 1e-6 * element.definition.vertical_stiffness
        for element in flatten(load_vehicle(name)).elements
        if element.name.startswith(("front.bolster_spring", "front.wedges"))
    }
    for hand in ("right", "left"):
        springs, wedges = stiffness[f"bolster_spring_{hand}"], stiffness[f"wedges_{hand}"]
        assert wedges == pytest.approx(0.769)
        assert springs + wedges == pytest.approx(side)


# load cases ---------------------------------------------------------------------------------------


def standing(name, **changes):
    """Depth of the car body [m], static wheel loads [N], moment of all weights to the right."""
    vehicle = load_vehicle(name)
    vehicle = vehicle.replace(**changes) if changes else vehicle
    track = load_track("straight").with_values({"support.preset": "rigid"})
    model = assemble(vehicle, track, Settings())
    balance = equilibrium(model, 10.0)
    moved = balance.state[: 6 * len(model.index.bodies)].reshape(-1, 6)
    moves = {name: (moved[k, 1], moved[k, 2]) for k, name in enumerate(model.index.bodies)}
    moment = sum(
        body.mass * GRAVITY * (body.position[1] + moves[body.name][0])
        for body in flatten(vehicle).bodies
        if body.name in moves
    )
    return float(moves[vehicle.reference][1]), balance.Q0, moment


def test_y25_wagon_sinks_by_its_two_stage_springs_under_load():
    tare, _, _ = standing("wagon_y25")
    laden, Q0, _ = standing("wagon_y25", load="laden")
    sprung = 1e3 * (22.0 - 4 * 1.4) * GRAVITY / 8.0, 1e3 * (90.0 - 4 * 1.4) * GRAVITY / 8.0
    np.testing.assert_allclose(Q0, 90e3 * GRAVITY / 8.0, rtol=1e-4)
    # outer springs 1.0 MN/m of free length 260 mm, inner ones 1.6 MN/m that are 26 mm shorter
    compressed = [
        force / 1e6 if force < 26e3 else 0.026 + (force - 26e3) / 2.6e6 for force in sprung
    ]
    # two pads of 50 MN/m and two side bearers of 0.55 MN/m on each bogie
    pads = (80.2e3 - 12.2e3) * GRAVITY / 2.0 / 101.1e6
    # Hertz: 27 and 110 kN of wheel load, some 0.05 mm
    assert laden - tare == pytest.approx(compressed[1] - compressed[0] + pads, abs=0.15e-3)


def test_uneven_load_gives_the_wheel_loads_of_its_moment():
    _, Q0, moment = standing("wagon_y25", load="uneven")
    # the contacts stand some millimetres beside 0.75 m
    assert 0.75 * (Q0[:, 1] - Q0[:, 0]).sum() == pytest.approx(moment, rel=0.02)
    # 75 mm to the right, and the body leans on the stops of its side bearers: 12 mm at 0.85 m
    lever = moment / (80.2e3 * GRAVITY)
    assert 0.075 + (1.90 - 0.85) * 0.012 / 0.85 < lever < 0.11


def into_a_curve(wagon, lengths, radius, elements, **how):
    """Run from a straight over a transition into a curve, with the forces of elements."""
    plan = [
        {"type": "STR", "length": lengths[0]},
        {"type": "CLO", "length": lengths[1]},
        {"type": "CIR", "length": 30.0, "radius": radius},
    ]
    settings = Settings().with_values({"outputs": {"elements": elements}})
    track = load_track("straight").replace(plan=plan)
    return railsim.simulate(wagon, track, settings=settings, **how)


@pytest.mark.usefixtures("small_contact_tables")
@pytest.mark.parametrize(("load", "radius"), [(None, 250.0), ("uneven", 500.0)])
def test_y25_bogie_turns_in_a_curve_against_the_friction_of_bowl_and_side_bearers(load, radius):
    """On its way into a curve: mu N 2/3 R of the bowl and mu N 0.85 m of two side bearers.

    Under the uneven load the body leans on the solid stop of one of them, which slides too.
    """
    wagon = load_vehicle("wagon_y25").replace(load=load)
    names = ["front.centre_bowl*", "front.side_bearer*"]
    result = into_a_curve(wagon, (6.0, 15.0), radius, names, speed=8.0, until=22.0)

    moment, friction, weight = 0.0, 0.0, 0.0
    for element in flatten(wagon).elements:
        if element.name.startswith(("front.centre_bowl", "front.side_bearer")):
            x, y, _ = np.subtract(element.point1, [7.1, 0.0, 0.0])
            force = result.series("element_force", element=element.name)[-1]
            moment += x * force[1] - y * force[0]
            friction += 0.3 * np.hypot(x, y) * force[2]
            weight += force[2]
    assert weight == pytest.approx((12.2e3 if load is None else 80.2e3) * GRAVITY / 2.0, rel=0.02)
    assert -moment == pytest.approx(friction, rel=0.02)


@pytest.mark.usefixtures("small_contact_tables")
def test_three_piece_bogie_turns_in_a_curve_against_the_friction_of_plate_and_side_bearers():
    """On its way into R 200 m: 2/3 mu N R of the plate and mu N 0.75 m of two side bearers."""
    wagon = load_vehicle("wagon_three_piece_25t")
    result = into_a_curve(wagon, (6.0, 10.0), 200.0, ["front.*"], speed=4.0, until=16.0)
    moment = 0.0
    for element in flatten(wagon).elements:
        if element.name.startswith(("front.centre_plate", "front.side_bearer")):
            x, y, _ = np.subtract(element.point1, [4.6, 0.0, 0.0])
            force = result.series("element_force", element=element.name)[-1]
            moment += x * force[1] - y * force[0]
    bearers = 2.0 * 16.7e3
    plate = 90e3 * GRAVITY / 2.0 - bearers
    assert abs(moment) == pytest.approx(
        0.3 * (2.0 / 3.0 * 0.178 * plate + 0.75 * bearers), rel=0.01
    )


def test_sliding_leaves_do_not_release_the_links():
    """Links pushed aside keep their friction, 0.06 N, while the leaf spring moves up by 5 mm."""
    definition = load_vehicle("wagon_uic_link").assemblies["axle"].elements["spring_and_links"]
    law = definition.model_dump(exclude={"bodies", "point", "points", "sides", "damping"})
    rig = Rig(**law | {"preload": [0.0, 0.0, -104e3]})

    aside = np.array([0.0, 15e-3, 0.0, 0.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, -5e-3, 0.0, 0.0, 0.0])
    time = np.linspace(0.0, 2.0, 801)
    force = rig.path(
        time,
        lambda t: min(t, 1.0) * aside + max(t - 1.0, 0.0) * up,
        lambda t: aside if t < 1.0 else up,
    )
    friction = force[400:, 1] - 297e3 * 15e-3
    assert friction == pytest.approx(0.06 * 104e3, rel=5e-3)  # a step more or less of stuck pads


def test_c62a_stands_higher_when_empty_by_its_bolster_springs():
    empty, _, _ = standing("wagon_c62a_empty")
    laden, _, _ = standing("wagon_c62a")
    change = (77.0e3 - 14.6e3) * GRAVITY
    pads, bearers = 4 * 50e6, 2 * 0.3e6  # centre plate and side bearers of one bogie
    k = [2 * (pads + bearers), 4 * 5.32e6, 8 * 100e6]  # body on bolsters, springs, adapters
    # Hertz: 26 and 103 kN of wheel load, some 0.05 mm
    expected = change * sum(1.0 / part for part in k)
    assert laden - empty == pytest.approx(expected, abs=0.1e-3)


def test_deflated_coach_stands_and_sways_on_its_emergency_springs():
    """2.4 MN/m instead of 0.37: bounce rises with the stiffness of both stages in series."""

    def bounce(secondary):
        primary = 2 * 0.991e6  # of one bogie side
        return np.sqrt(4.0 / (1.0 / secondary + 1.0 / primary) / 38.6e3) / (2.0 * np.pi)

    inflated, deflated = (flatten(load_vehicle(n)) for n in ("coach_25t", "coach_25t_deflated"))
    ratio = mode(deflated, "carbody", 0) / mode(inflated, "carbody", 0)
    # the frames' masses, of 11 % of the body's, count in the stiffer vehicle
    assert ratio == pytest.approx(bounce(2.4e6) / bounce(0.37e6), rel=0.05)


@pytest.mark.usefixtures("small_contact_tables")
def test_a_z_link_steers_in_neither_curve():
    """Its lever turns: forces of a left curve are those of the right one, mirrored; by the rods
    fixed to the car instead they differed by 5 kN."""
    coach, curve = load_vehicle("coach_25t"), {"cant": 0.1, "cant_deficiency": [0.08]}
    right, left = (railsim.curving(coach, radius=[R], **curve).Y[0, 0, 0] for R in (300.0, -300.0))
    np.testing.assert_allclose(left, -right[:, ::-1], atol=10.0)


# runs ---------------------------------------------------------------------------------------------


@points(
    ("vehicle", "track", "until"),
    # of all combinations (docs/validation/vehicles_and_tracks.md) those that ask most: three axles
    # in the tightest curve, play and stops, friction at its limit, a high body on its side bearers
    # (it toppled without their stops), walls of the table, high speed
    [
        ("locomotive_coco_a", "depot_r150", 150.0),
        ("wagon_y25", "turnout_190_1in9", 120.0),
        ("wagon_uic_link", "crossover_300_1in9", 140.0),
        ("wagon_three_piece_25t", "curve_r250", 480.0),
        ("metro_b_motor", "s_curve_r150", 140.0),
        ("coach_crh380a", "straight", 200.0),
    ],
    always=(0, 3),
)
@pytest.mark.usefixtures("small_contact_tables")
def test_vehicle_runs_its_track_at_the_permitted_speed(vehicle, track, until):
    spec = StudySpec(vehicles=vehicle, tracks=track, speeds="permitted", until=until)
    (case,) = Plan(spec).cases()
    result = railsim.simulate(case.vehicle, case.track, speed=case.speed, until=until)
    assert result.status == "complete"
    assert not any("beyond all experience" in remark for remark in result.remarks)


# tracks -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [n for n in library_files("track") if n.startswith("turnout")])
def test_arc_of_a_turnout_turns_by_its_angle(name):
    track = load_track(name)
    arc = next(element for element in track.plan if element.type == "CIR")
    ratio = float(name.rsplit("1in", 1)[1])
    # arc lengths are given to the millimetre
    assert arc.length == pytest.approx(arc.radius * np.arctan(1.0 / ratio), abs=5e-4)


def test_crossover_leads_to_the_other_track():
    alignment = Alignment(load_track("crossover_300_1in9"))
    length = load_track("crossover_300_1in9").length
    across, _ = quad(lambda s: np.sin(float(alignment.heading(s))), 0.0, length, limit=200)
    assert float(alignment.heading(length)) == pytest.approx(0.0, abs=1e-12)
    assert across == pytest.approx(4.5, abs=2e-3)  # distance of the tracks; lengths in millimetres


def test_twisted_track_has_the_twists_of_the_standard():
    h = Alignment(load_track("twist")).cant
    # 15/(2a*) + 2 = 2.857 per mille over 17.5 m, 7 per mille over 2.5 m, kinks rounded over 0.5 m
    assert float(h(68.0) - h(49.5)) == pytest.approx(17.5 * (15.0 / 17.5 + 2.0) * 1e-3, rel=1e-6)
    assert float(h(67.2) - h(65.3)) / 1.9 == pytest.approx(7e-3, rel=1e-3)


# files and pages ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pages():
    return import_module("generators.vehicles")


def test_pages_of_the_library_are_up_to_date(pages):
    mended_by = "python docs/generate.py vehicles:data, or without :data where vehicles changed"
    for name in pages.VEHICLES:
        written = (pages.PAGES / f"{name}.md").read_text("utf-8")
        assert written.startswith(pages.data(name)), mended_by
    overview = pages.OVERVIEW.read_text("utf-8")
    assert overview == pages.overview(overview), mended_by


def test_dry_friction_limits_the_motion_of_vehicles_that_have_some_alone(pages):
    pads = ("friction", "wedge", "centre_plate", "side_bearer")
    for name in pages.VEHICLES:
        if "Dry friction, which" in (pages.PAGES / f"{name}.md").read_text("utf-8"):
            elements = flatten(load_vehicle(name)).elements
            assert any(element.definition.kind in pads for element in elements), name


def test_a_letter_stands_beside_every_number_of_a_vehicle(pages):
    # what follows from the other numbers of its table, or tells nothing of the vehicle
    free = ("kind", "bodies", "sides", "axis", "wheelset", "category", "description", "reference",
            "levelling", "format", "name", "source", "extends", "remove", "load")  # fmt: skip
    silent = [
        f"{name}: {line.table}.{line.key}"
        for name in pages.VEHICLES
        for line in pages.lines_of((shipped_folder("vehicle") / f"{name}.toml").read_text("utf-8"))
        if line.key not in free and not pages.MARKS.search(line.comment)
    ]
    assert silent == []


@pytest.mark.parametrize("name", library_files("vehicle"))
def test_every_vehicle_says_where_its_numbers_come_from(name):
    assert load_vehicle(name).source


@pytest.mark.parametrize("name", library_files("track"))
def test_every_track_says_where_its_numbers_come_from(name):
    assert load_track(name).source
