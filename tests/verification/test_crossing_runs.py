"""Runs over the shipped crossing: impact against an independent wheel, resolution, leaving it."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from selection import points

from railsim.contact import section_tables
from railsim.contact.curves import wheel_curve
from railsim.contact.rail_sections import rail_parts, rigid_gaps
from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.definitions.section_files import SectionList
from railsim.kernels import table_ends
from railsim.kernels.status import FALLEN, RUNNING, WHEEL_LIFT
from railsim.model import rail_ranges
from railsim.profiles import load_profile
from railsim.result.filters import low_passed
from railsim.simulation import simulate

pytestmark = pytest.mark.usefixtures("coarse_contact_tables_in_module")
FURTHER = pytest.mark.further
NOSE = 50.0  # m, the theoretical nose on the track
DIP = 18.15e-3  # rad, both slopes of the path together
LOAD = 54.546e3  # N
FORMULA = {10.0: 86.5e3, 20.0: 118.5e3, 27.8: 143.4e3}  # N, P2 at a dipped joint of 18.15 mrad
# of GM/TT0088 for a wheel of benchmark_vehicle1: kg, kg, N/m, N s/m
WHEEL, TRACK, PAD, PAD_DAMPING = 906.5, 245.0, 62e6, 55.4e3


def crossing(**changes):
    """The transfer from wing to nose alone, whose tables take some seconds."""
    track = load_track("crossing_56e1_r245_1in9.25")
    part = track.sections[0].model_dump(exclude_none=True) | {"begin": 49.6, "end": 50.5}
    return track.replace(**{"sections": [part], "check_rail": [], **changes})


@cache
def path_of_the_wheel():
    """Arc length from the nose, and height of a wheel S1002 that follows wing and nose [m]."""
    contours = load_track("crossing_56e1_r245_1in9.25").sections[0].contours
    points = tuple(np.array([one.y, one.z]) for one in contours)
    places = np.array([one.s for one in contours])
    parts = rail_parts(SectionList(places, points))
    wheel = wheel_curve(load_profile("S1002", "wheel"), 0.46, 0.75)
    s = np.arange(-0.56, 1.7, 2e-3)
    gaps = [rigid_gaps(part, s, 0.46, [(wheel.y, wheel.r)], np.zeros(1)) for part in parts]
    return s, np.min(gaps, axis=0)[:, 0, 0]


def blow(s, z, speed, h=8e-6, every=25):
    """Largest contact force below 90 Hz of two masses, written anew [N].

    A wheel under its load on a mass on spring and damper, between them a sphere's contact, over the
    height `z(s)` of the rail: no table, no vehicle, no other wheel.
    """
    at = np.arange(s[0], s[-1], speed * h)
    bump = np.interp(at, s, z)
    rate = np.gradient(bump, h)
    hertz = 1e11  # N/m^1.5
    e, sunk = (LOAD / hertz) ** (2.0 / 3.0), LOAD / PAD
    wheel, track, v_wheel, v_track = e + sunk + bump[0], sunk, 0.0, 0.0
    forces = np.empty(at.size)
    for i, (height, change) in enumerate(zip(bump.tolist(), rate.tolist(), strict=True)):
        e = max(wheel - track - height, 0.0)
        damping = 2e5 * min(1.0, e / 30e-6)
        N = max(0.0, hertz * e**1.5 + damping * (v_wheel - v_track - change))
        v_wheel += h * (LOAD - N) / WHEEL
        v_track += h * (N - PAD * track - PAD_DAMPING * v_track) / TRACK
        wheel += h * v_wheel
        track += h * v_track
        forces[i] = N
    near = np.abs(at[::every] - 0.3) < 0.4
    return low_passed(forces[::every], 1.0 / (h * every), 90.0)[near].max()


def ramps(s):
    """Height of two straight ramps that meet at 0.3 m, together of the same angle [m]."""
    way = np.clip(1.75 - np.abs(s - 0.3), 0.0, None)
    return 0.5 * DIP * np.where(way < 0.5, way**2, way - 0.25)


def passing(track, speed):
    """Largest force of the leading right wheel below 90 Hz within 0.4 m of 50.3 m [N]."""
    settings = load_settings().with_values({"output_rate": 4000.0})
    coach = load_vehicle("benchmark_vehicle1")
    run = simulate(coach, track, speed=speed, settings=settings, start=35.0, until=42.0)
    Q = low_passed(run["Q"][:, 0, 1], 4000.0, 90.0)
    return Q[np.abs(run["wheelset_distance"][:, 0] - NOSE - 0.3) < 0.4].max()


@pytest.mark.parametrize("speed", FORMULA)
def test_short_ramps_are_what_the_formula_leaves_out(speed):
    """On ramps without end 0.8 to 1 of P2, on the path over the crossing 0.95, 0.65, 0.5 of it.

    By the independent wheel alone: whatever railsim makes of the crossing.
    """
    s, z = path_of_the_wheel()
    slopes = np.diff(z) / np.diff(s)
    assert slopes.max() - slopes.min() == pytest.approx(DIP, abs=1e-3)
    long = np.arange(-1.9, 1.5, 2e-3)
    assert 0.8 < blow(long, ramps(long), speed) / FORMULA[speed] < 1.0
    share = {10.0: 0.96, 20.0: 0.65, 27.8: 0.48}[speed]
    assert blow(s, z, speed) / FORMULA[speed] == pytest.approx(share, abs=0.01)


@FURTHER
@pytest.mark.parametrize("speed", FORMULA)
def test_impact_is_that_of_a_wheel_on_the_same_path(speed):
    """Within 5 % of the independent wheel, on the crossing and on ramps."""
    s, z = path_of_the_wheel()
    whole = load_track("crossing_56e1_r245_1in9.25").replace(
        support={"preset": "p2"}, check_rail=[], gauge=1.43
    )
    assert passing(whole, speed) == pytest.approx(blow(s, z, speed), rel=0.05)
    long = np.arange(-2.5, 2.5, 5e-3)
    rows = np.stack([NOSE + long, 0 * long, ramps(long), 0 * long, ramps(long)], axis=1)
    dip = {"type": "measured", "rows": rows.tolist(), "fade": 0.0}
    smooth = whole.replace(sections=[], irregularities=[dip])
    found = passing(smooth, speed)
    assert found == pytest.approx(blow(long, ramps(long), speed), rel=0.06)
    assert 0.7 < found / FORMULA[speed] < 1.1


HOW = {"start": 38.6, "until": 40.2, "speed": 20.0}


def largest_over(track, **settings):
    """Largest Q and Y of the leading right wheel over the nose, and largest Q below 90 Hz [N]."""
    chosen = load_settings().with_values({"output_rate": 4000.0, **settings})
    run = simulate(load_vehicle("coach_manchester"), track, settings=chosen, **HOW)
    Q, Y = run["Q"][:, 0, 1], run["Y"][:, 0, 1]
    assert Q.max() > 100e3
    return np.array([Q.max(), Y.max(), low_passed(Q, 4000.0, 90.0).max()])


def test_contacts_evaluated_again_are_counted_once():
    """The last axle over the nose: as many patches as outputs at every step show; a/b to 24."""
    how = {"step": 1e-5, "output_rate": 1e5, "outputs": {"contact_patches": True}}
    settings = load_settings().with_values(how)
    coach = load_vehicle("coach_manchester")
    result = simulate(coach, crossing(), speed=20.0, start=60.98, until=61.18, settings=settings)
    assert result.attributes["contacts_evaluated_again"] > 100
    loaded = result["patch_N"] > 0.0
    assert result.attributes["patches_evaluated"] == np.count_nonzero(loaded)
    beyond = np.count_nonzero(result["patch_a"][loaded] > 24.0 * result["patch_b"][loaded])
    assert result.attributes["patches_out_of_range"] == beyond > 0


@points(
    ("vehicle", "lead", "support", "speed"),
    [
        ("coach_manchester", 10.8, "co-running", 25.0),
        ("coach_manchester", 10.84, "co-running", 60.0),  # a step of 0.1 m foresees nothing
        ("wagon_y25", 8.0, "p2", 10.0),
    ],
    always=(1,),
)
def test_the_chosen_step_follows_the_blow_on_the_nose(vehicle, lead, support, speed):
    """The reference scheme at 0.01 ms: within 3 %; in parts of 0.42 ms 0.95, 0.66, 0.88.

    That at 0.025 ms differs by 5 % at 60 m/s, by how its steps lie on the nose.
    """
    track = crossing(support={"preset": support})
    way = {"start": 49.95 - lead, "until": 50.5 - lead, "speed": speed}
    chosen, reference = (
        simulate(load_vehicle(vehicle), track, settings=load_settings().with_values(how), **way)
        for how in ({}, {"scheme": "rk4", "step": 1e-5})
    )
    assert chosen.attributes["step"] > 30 * reference.attributes["step"]
    largest, expected = (run.groups["peaks"]["Q"][0, 0, 1] for run in (chosen, reference))
    assert largest == pytest.approx(expected, rel=0.03)


def from_the_heel(track):
    """The same sections passed from their end, mirrored about the theoretical nose."""
    part = track.sections[0].model_dump(exclude_none=True)
    turned = [one | {"s": -one["s"]} for one in reversed(part["contours"])]
    ends = {"begin": 2.0 * NOSE - part["end"], "end": 2.0 * NOSE - part["begin"]}
    return track.replace(sections=[part | ends | {"contours": turned}])


@points(
    ("vehicle", "lead", "speed", "way", "start"),
    [
        ("coach_manchester", 10.78, 30.0, crossing, 48.7859),
        ("coach_manchester", 10.78, 20.0, lambda **at: from_the_heel(crossing(**at)), 48.78125),
        ("wagon_y25", 8.0, 20.0, crossing, 48.8),
    ],
    always=(0, 2),
)
def test_a_wheel_in_the_air_over_rigid_rails_is_seen_to_strike(vehicle, lead, speed, way, start):
    """The reference scheme at 0.01 ms: within 3 %; undivided 0.91, 0.86 and 0.88 of it."""
    track = way(support={"preset": "rigid"})
    at = {"start": start - lead, "until": 51.2 - lead, "speed": speed}
    chosen, reference = (
        simulate(load_vehicle(vehicle), track, settings=load_settings().with_values(how), **at)
        for how in ({}, {"scheme": "rk4", "step": 1e-5})
    )
    largest, expected = (run.groups["peaks"]["Q"][0, 0, 1] for run in (chosen, reference))
    assert largest == pytest.approx(expected, rel=0.03)


def test_forces_do_not_depend_on_the_step():
    """Half the step: within 2 %."""
    np.testing.assert_allclose(
        largest_over(crossing()), largest_over(crossing(), step=1.25e-4), rtol=0.02
    )


@FURTHER
def test_forces_do_not_depend_on_the_number_of_blended_sections(monkeypatch):
    """Within 2 %, with tables at twice as many places."""
    few = largest_over(crossing())
    built = []

    def finer(given):
        built.append(section_tables.section_table(given))
        return built[-1]

    monkeypatch.setattr(rail_ranges, "cached_section_table", finer)
    largest_over(crossing())
    for name, part in {"TOLERANCE": 0.1, "SHARED": 0.1, "CLOSEST": 0.5, "FARTHEST": 0.25}.items():
        monkeypatch.setattr(section_tables, name, part * getattr(section_tables, name))
    many = largest_over(crossing())
    first, second = (sum(map(len, table.description["parts"])) for table in built)
    assert second > 1.8 * first
    print(first, second, many / few)
    np.testing.assert_allclose(many, few, rtol=0.02)


@pytest.mark.parametrize("start", [39.3, 39.69, 42.2])
def test_a_run_that_begins_on_the_crossing_is_that_of_one_from_before_it(start):
    """A wheel on the wing, one that strikes the nose, and the next one there: Q within 100 N."""
    coach, track = load_vehicle("coach_manchester"), crossing()
    settings = load_settings().with_values({"output_rate": 2000.0})
    how = {"until": start + 1.0, "speed": 20.0, "settings": settings}
    before, within = (simulate(coach, track, start=s, **how) for s in (37.0, start))
    wheels = [(w, side) for w in range(4) for side in (0, 1)]
    for w, side in wheels:
        Q = np.interp(within["distance"], before["distance"], before["Q"][:, w, side])
        np.testing.assert_allclose(within["Q"][:, w, side], Q, atol=100.0)
    assert not any("within a range" in remark for remark in within.remarks)


def thrown(y, vy, track, **more):
    """Run in which the leading wheelset is thrown aside ahead of the nose."""
    initial = {"front.outer.wheelset": {"y": y, "vy": vy, **more}}
    settings = load_settings().with_values({"initial": initial, "output_rate": 2000.0})
    coach = load_vehicle("coach_manchester")
    return simulate(coach, track, speed=20.0, start=38.9, until=39.6, settings=settings)


def test_wheel_passes_the_nose_on_its_wrong_side():
    """Where the wing has gone aside nothing but the check rail keeps the flange from the nose."""
    lost = thrown(0.006, 2.5, crossing())
    assert lost.status == "derailed"
    assert "front.outer.wheelset" in lost.attributes["status_reason"]
    assert "wrong side" in lost.attributes["status_reason"]
    plain = thrown(0.006, 2.5, crossing(sections=[]))
    assert plain.status == "complete"  # the plain rail's face is there
    check_rail = load_track("crossing_56e1_r245_1in9.25").check_rail
    held = thrown(0.006, 1.5, crossing(check_rail=check_rail)), thrown(0.006, 1.5, crossing())
    aside = [np.abs(run["wheelset_lateral"][:, 0]).max() for run in held]
    assert aside[0] < 0.011 < 0.02 < aside[1]


def test_yaw_beyond_the_tables_of_the_sections_is_remarked_with_their_own_end():
    """At the third node of yaw: of 17 at 14 mrad, of the 3 of these coarse tables at 60."""
    (remark,) = (r for r in thrown(0.0, 0.0, crossing(), yaw=0.065).remarks if "yawed" in r)
    assert "by more than 60 mrad (60 mrad within track.sections), where" in remark


def test_flange_that_climbs_goes_on():
    """Beyond what the tables of the sections cover, 12 mm aside and 2.4 mrad of roll."""
    run = thrown(0.006, 0.9, crossing())
    assert run.status == "complete"
    assert np.abs(run["wheelset_lateral"][:, 0]).max() > 0.0125


@pytest.mark.parametrize(
    ("nearest", "below", "status"),
    [
        (-1.0, 0.03, FALLEN),
        (-1.0, 0.0, RUNNING),  # in a gap, as between wing and nose
        (-1.0, -0.06, WHEEL_LIFT),
        (-0.01, -0.06, RUNNING),  # near a rail that is higher than the plain one
    ],
)
def test_wheel_beside_all_rails_is_lifted_where_it_is_above_them_all(
    nearest, below, status, monkeypatch
):
    """`nearest`: from the highest rail down to the wheel; `below` the plain rail [m]."""
    monkeypatch.setattr(table_ends, "plain_height", lambda *_: 0.3)
    wheel, rails = (
        SimpleNamespace(z=0.3 + below - 0.7 * 0.01, roll=0.01),
        SimpleNamespace(lever=[0.7]),
    )
    assert table_ends.fall_status.py_func(rails, 0, wheel, nearest) == status


@FURTHER
def test_wheel_falls_where_the_nose_is_missing():
    """Behind the wing, which has gone aside, at walking pace."""
    part = load_track("crossing_56e1_r245_1in9.25").sections[0].model_dump(exclude_none=True)
    contours = []
    for one in part["contours"]:
        y, z = np.array(one["y"]), np.array(one["z"])
        wing = (y > 15e-3 + 0.09 * (one["s"] - 0.11)) | (one["s"] < 0.11)
        if -0.3 < one["s"] < 1.0:
            contours.append({"s": one["s"], "y": y[wing].tolist(), "z": z[wing].tolist()})
    wing_alone = part | {"begin": 49.9, "end": 50.8, "contours": contours}
    track = load_track("crossing_56e1_r245_1in9.25").replace(sections=[wing_alone], check_rail=[])
    run = simulate(load_vehicle("coach_manchester"), track, speed=1.2, start=39.2, until=40.1)
    assert run.status == "derailed"
    # it slides down the wing's end, below the roll that the table holds
    assert (
        "let a wheel down deeper below its rail than its flange" in run.attributes["status_reason"]
    )
    assert 0.4 < run["wheelset_distance"][-1, 0] - NOSE < 0.6
