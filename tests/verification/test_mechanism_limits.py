"""Limits of a mechanism: both senses of a force, friction, loops that cannot close, dead points."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.errors import InputError
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.assembly import dead_loop
from railsim.mechanisms.checks import checks
from railsim.mechanisms.dynamics import free_motion
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.model import build
from railsim.mechanisms.remarks import remarks
from railsim.mechanisms.selection import selection
from railsim.mechanisms.summary import published_data
from railsim.mechanisms.tables import comparison_table, published_table, sentences
from railsim.mechanisms.targets import positions
from railsim.mechanisms.tolerance import scatter

G = 9.81
# an arm with its weight at the end, turned over the top: m g l cos(theta) changes its sign
ARM = """
format = "railsim-mechanism/1"
name = "arm"
[parameters]
mass = 100.0
begin = {begin}
end = {end}
friction = {friction}
[ground.points]
hinge = [0.0, 0.0]
foot = [0.5, -0.2]
[bodies.arm]
points = {{ hinge = [0.0, 0.0], pin = [0.3, 0.0], tip = [1.0, 0.0] }}
mass = "mass"
centre = [1.0, 0.0]
[joints.hinge]
revolute = ["ground.hinge", "arm.hinge"]
[driver]
angle = "arm"
start = "begin"
end = "end"
[output]
point = "arm.tip"
[elements.rub]
joint_friction = "arm"
moment = "friction"
[actuators.lift]
{lift}
[solve]
unknown = "lift"
[tolerances]
mass = 1.0
"""
CYLINDER = """cylinder = ["ground.foot", "arm.pin"]
bore = 0.08
rod = 0.03
supply_pressure = 1.0e6
acts = "{acts}"
"""
TORQUE = 'turn = "arm"'


@pytest.fixture
def arm(tmp_path):
    def made(lift, begin=1.3, end=2.6, friction=0.0, more=""):
        path = tmp_path / "arm.toml"
        text = ARM.format(lift=lift, begin=begin, end=end, friction=friction)
        path.write_text(text + more)
        return load_mechanism(path)

    return made


def by_name(result):
    return {check.name: check for check in checks(result)}


def test_a_cylinder_that_must_pull_does_not_pass(arm):
    result = analyse(arm(CYLINDER.format(acts="push")))
    found = by_name(result)
    assert result.max_force > 0.0 > -2.0 * result.max_force > result.min_force
    assert result.peak_force == -result.min_force
    assert found["available_force"].ok  # the push alone would do
    assert not found["pulls"].ok
    assert found["pulls"].value == result.min_force
    assert not found["runs_ahead"].ok
    rows = [row for row in selection(result) if row.catalogue == "cylinder"]
    assert not any(row.fits for row in rows)
    assert all("must pull" in row.reasons[0] for row in rows)


def test_a_double_acting_cylinder_is_held_against_both_chambers(arm):
    result = analyse(arm(CYLINDER.format(acts="both")))
    found = by_name(result)
    ring = 0.25 * np.pi * (0.08**2 - 0.03**2)
    assert found["available_pull"].value == -result.min_force
    assert found["available_pull"].limit == pytest.approx(1e6 * ring)
    assert "pulls" not in found
    pressure = result.output["pressure"]
    pull = result.output["force"] < 0.0
    assert pressure[pull] * ring == pytest.approx(-result.output["force"][pull])
    assert np.all(pressure >= 0.0)
    bore = 0.0
    for row in selection(result):
        if row.fits:
            bore = float(row.name.split()[1]) * 1e-3
            break
    assert 1e6 * 0.25 * np.pi * (bore**2 - 0.03**2) >= -result.min_force


def test_peak_force_of_a_search_is_an_amount(arm):
    from railsim.mechanisms.judgement import Judge

    search = """
[optimise]
objective = "peak_force"
range = "travel"
sample = "travel"
available_force = 500.0
[optimise.bounds]
mass = [50.0, 150.0]
"""
    definition = arm(CYLINDER.format(acts="push"), begin=1.8, end=2.6, more=search)
    judge = Judge(definition)
    judged = judge(np.array([100.0]), {})
    peak = analyse(definition).peak_force
    assert judged.peak == pytest.approx(peak, rel=1e-3)  # at 17 + 215 positions
    slopes = judged.rivals[:, 0]  # of positions with equal forces
    assert slopes == pytest.approx(np.full(3, judged.peak / 100.0))  # proportional to the mass
    assert judged.violation == pytest.approx(peak / 500.0, rel=1e-3)  # it cannot pull at all


def test_friction_counts_in_every_force_of_a_page(arm):
    definition = arm(TORQUE, begin=0.2, end=1.0, friction=40.0)
    result = analyse(definition)
    start = 100.0 * G * np.cos(0.2) + 40.0
    assert result.output["force"][0] == pytest.approx(start)
    found = {one.name: one for one in scatter(definition)}
    assert found["force_start"].value == pytest.approx(start)  # was the value without friction
    assert found["force_start"].random == pytest.approx(G * np.cos(0.2))
    assert any("largest amount 1001.45 N m" in text for text in sentences(result))


def test_with_friction_an_arm_rests_in_a_range_of_angles(arm):
    moment = 300.0
    text = arm(TORQUE, begin=-2.5, end=2.5, friction=moment)
    result = analyse(text.model_copy(update={"solve": None}))
    half = np.arcsin(moment / (100.0 * G))
    (hanging, standing) = result.rests
    assert (hanging.stable, standing.stable) == (True, False)
    assert (hanging.low, hanging.high) == pytest.approx((-np.pi / 2 - half, -np.pi / 2 + half))
    assert (standing.low, standing.high) == pytest.approx((np.pi / 2 - half, np.pi / 2 + half))


def test_a_pendulum_with_dry_friction_turns_where_its_energy_says_and_rests(arm):
    """From a to b, m g l (cos b - cos a) = T (a + b); it rests where m g l |sin b| < T."""
    moment, down = 300.0, -0.5 * np.pi
    text = arm(TORQUE, begin=-2.9, end=-0.1, friction=moment)
    found = free_motion(build(text), down + 1.2, -2.9, 30.0)
    weight, swing, expected = 100.0 * G, 1.2, []
    while weight * np.sin(swing) > moment:
        swing = brentq(
            lambda b, a=swing: weight * (np.cos(b) - np.cos(a)) - moment * (a + b),
            -0.999 * swing,
            swing,
        )
        expected.append(swing)
    sides = down + np.array(expected) * (-1.0) ** np.arange(1, len(expected) + 1)
    assert len(expected) == 2
    assert np.min(found.s) == pytest.approx(sides[0], abs=1e-6)
    assert found.s[-1] == pytest.approx(sides[-1], abs=1e-6)
    assert found.time[-1] == 30.0
    assert not found.reached


def test_no_position_of_rest_is_said(arm):
    text = arm(TORQUE, begin=-1.0, end=1.0)
    result = analyse(text.model_copy(update={"solve": None}))
    assert not result.rests
    assert any(
        "no position of rest from -57.2958 deg to 57.2958 deg" in t for t in sentences(result)
    )


def test_contact_force_with_friction_is_that_of_a_rising_and_a_falling_head():
    moment = 60.0
    rub = f"elements.rub={{joint_friction='boom',moment={moment}}}"
    plain, rubbed = (
        analyse(load_mechanism("atr95_lift_5", ["sampling.points=51", *more])).contact
        for more in ([], [rub])
    )
    assert rubbed.force == pytest.approx(plain.force)  # the mean
    result = analyse(load_mechanism("atr95_lift_5", ["sampling.points=51"]))
    slope = result.zone["work"]["ratio"] * result.zone["work"]["rate"]
    assert plain.force["work"] - rubbed.rising["work"] == pytest.approx(moment / slope, rel=1e-6)
    assert rubbed.falling["work"] - plain.force["work"] == pytest.approx(moment / slope, rel=1e-6)
    # where it rested at one height it now rests between two
    assert all(rest.low < rest.high for rest in rubbed.rests)


# --- loops that cannot close ----------------------------------------------------------------------

SLIDER_CRANK = """
format = "railsim-mechanism/1"
[parameters]
crank = 0.1
rod = {rod}
end = {end}
[ground.points]
o = [0.0, 0.0]
[bodies.crank]
points = {{ pin = [0.0, 0.0], end = ["crank", 0.0] }}
[bodies.slide]
points = {{ pin = [0.0, 0.0] }}
[start]
slide = {{ x = 0.2, y = 0.0 }}
[joints.crank]
revolute = ["ground.o", "crank.pin"]
[joints.guide]
prismatic = ["slide.pin", "ground.o"]
[joints.rod]
link = ["crank.end", "slide.pin"]
length = "rod"
[driver]
angle = "crank"
start = 0.3
end = "end"
"""


def refused(mechanism):
    with pytest.raises(InputError) as error:
        analyse(mechanism)
    (fault,) = error.value.faults
    return fault


@pytest.mark.parametrize(
    ("name", "change", "joint", "loop"),
    [
        ("atr95_lift_5", "a3=0.40", "rocker", "'boom_hinge', 'boom_pin', 'rocker'"),
        ("atr95_lift_4", "a2=0.03", "push_rod", "'boom_hinge', 'slide', 'push_rod'"),
    ],
)
def test_the_loop_that_cannot_close_is_named(name, change, joint, loop):
    fault = refused(load_mechanism(name, [f"parameters.{change}"]))
    assert fault.key == f"joints.{joint}"
    assert f"loop {loop}: '{joint}' is" in fault.found


def test_the_gap_of_a_short_rod_is_that_of_its_triangle(tmp_path):
    path = tmp_path / "short.toml"
    path.write_text(SLIDER_CRANK.format(rod=0.08, end=1.5))
    fault = refused(load_mechanism(path))
    assert fault.key == "joints.rod"
    # the slider stands below the crank's end: the rod would have to be as long as its height
    missing = (0.1 * np.sin(1.5) - 0.08) * 1e3
    assert f"'rod' is {missing:.3f} mm too short at 85.9437 deg" in fault.found


def test_a_rod_hardly_longer_than_its_crank_is_remarked(tmp_path):
    path = tmp_path / "hardly.toml"
    for rod, said in ((0.1001, True), (0.25, False)):
        path.write_text(SLIDER_CRANK.format(rod=rod, end=1.2))
        told = [r for r in remarks(analyse(load_mechanism(path))) if "close to a dead point" in r]
        assert bool(told) is said
        assert not said or "only 0.100 mm longer than its crank of 100.000 mm" in told[0]


def test_bounds_that_exclude_the_files_own_values_are_remarked():
    own = ["optimise.bounds.a1=[0.2,0.25]", "sampling.points=51"]
    told = [r for r in remarks(analyse(load_mechanism("atr95_lift_4", own))) if "bounds" in r]
    (remark,) = told
    assert remark.startswith("optimise.bounds.a1: 0.2 to 0.25 exclude the file's own 0.129297")


FOUR_BAR = """
format = "railsim-mechanism/1"
[parameters]
base = 1.0
arm = 0.4
rocker = {rocker}
[ground.points]
left = [0.0, 0.0]
right = ["base", 0.0]
[bodies.crank]
points = {{ pin = [0.0, 0.0], end = ["arm", 0.0] }}
[bodies.coupler]
points = {{ begin = [0.0, 0.0], end = ["base", 0.0] }}
[bodies.rocker]
points = {{ pin = [0.0, 0.0], end = ["rocker", 0.0] }}
[joints.left]
revolute = ["ground.left", "crank.pin"]
[joints.right]
revolute = ["ground.right", "rocker.pin"]
[joints.begin]
revolute = ["crank.end", "coupler.begin"]
[joints.end]
revolute = ["coupler.end", "rocker.end"]
[driver]
angle = "crank"
end = {end}
"""


@pytest.mark.parametrize("rocker", [0.401, 0.402, 0.405, 0.42])
def test_a_near_parallelogram_is_assembled_from_a_pose_at_its_dead_point(tmp_path, rocker):
    """All angles are 0 by default: a dead point, some degrees away from the assembly."""
    path = tmp_path / "near.toml"
    path.write_text(FOUR_BAR.format(rocker=rocker, end=0.2))
    motion = analyse(load_mechanism(path)).motion
    # cosine rule at the rocker's pivot: crank's end 0.6 away, coupler 1.0
    turn = np.pi - np.arccos((0.6**2 + rocker**2 - 1.0) / (2.0 * 0.6 * rocker))
    assert abs(motion.q[0, 3, 2]) == pytest.approx(turn, rel=1e-9)


def test_an_exact_parallelogram_stretched_out_is_a_dead_point(tmp_path):
    path = tmp_path / "flat.toml"
    path.write_text(FOUR_BAR.format(rocker=0.4, end=0.2))
    fault = refused(load_mechanism(path))
    assert "a dead point" in fault.found  # was: joints hold the same freedom twice
    # on the way, between positions: it can be assembled behind it, on two branches
    start = "[start]\ncrank = { angle = -0.5 }\nrocker = { angle = -0.5 }\n[driver]\nstart = -0.5\n"
    path.write_text(FOUR_BAR.format(rocker=0.4, end=0.5).replace("[driver]\n", start))
    fault = refused(load_mechanism(path))
    assert "driver at 0.0000 deg: a dead point" in fault.found  # was: cannot be assembled
    assert "(joints left, right, begin, end)" in fault.found


def test_no_exact_parallelogram_leaves_its_dead_point_on_the_other_branch(tmp_path):
    """Behind it the rocker would turn at -(1 + a)/(1 - a) times the crank's rate, a kink.

    27 of these 100 did so: within 1e-9 of the point the branches are alike.
    """
    path = tmp_path / "exact.toml"
    start = "start = -0.5\n[start]\ncrank = { angle = -0.5 }\nrocker = { angle = -0.5 }\n"
    path.write_text(FOUR_BAR.format(rocker=0.4, end=0.5) + start)
    definition = load_mechanism(path)
    for arm in np.linspace(0.2, 0.9, 100):
        model = build(definition, {"arm": arm, "rocker": arm})
        with pytest.raises(InputError, match=r"a dead point|another branch"):
            solve(model, np.linspace(-0.5, arm, 50))


SECOND_LOOP = """
[bodies.rod]
points = { begin = [0.0, 0.0], end = ["base", 0.0] }
[bodies.lever]
points = { pin = [0.0, 0.0], end = ["0.9 * base", 0.0] }
[joints.far]
revolute = ["ground.far", "lever.pin"]
[joints.third]
revolute = ["rocker.end", "rod.begin"]
[joints.fourth]
revolute = ["rod.end", "lever.end"]
[start]
crank = { angle = -0.5 }
rocker = { angle = -0.5 }
lever = { angle = -0.4 }
"""


def dead_at_the_end(path, text, size):
    """Joints that are named of two loops of a size, at the end of their motion."""
    text = text.replace("base = 1.0", f"base = {size}").replace("arm = 0.4", f"arm = {0.4 * size}")
    far = 'far = ["1.9 * base", "-0.3 * base"]\n[bodies.crank]'
    path.write_text(text.replace("[bodies.crank]", far))
    model = build(load_mechanism(path))
    motion = solve(model, np.linspace(model.start, model.end, 30))
    return dead_loop(model, model.end, motion.q[-1], motion.arcs[-1])


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_joints_at_a_dead_point_are_those_of_its_loop_whatever_the_size(tmp_path, size):
    """A second loop, driven by a parallelogram that is 1.5 mrad from the line, is not at one.

    There it bears some 0.7 permille of the forces of the first loop.
    """
    text = FOUR_BAR.format(rocker=0.4 * size, end=-1.5e-3) + "start = -0.5\n" + SECOND_LOOP
    named = dead_at_the_end(tmp_path / "two.toml", text, size)
    assert named == ("left", "right", "begin", "end")


@pytest.mark.parametrize("size", [0.1, 1.0, 10.0])
def test_a_loop_that_drives_the_one_at_a_dead_point_is_not_named(tmp_path, size):
    """Rod and lever of a second loop in line; through the first one the driver only holds it."""
    far, arm, rod = np.array([1.9, -0.3]), 0.4, 0.3

    def short_of(angle):
        end = np.array([1.0 + arm * np.cos(angle), arm * np.sin(angle)])
        return np.linalg.norm(far - end) - 2.0 * rod

    dead = brentq(short_of, -0.9, -0.5)
    text = FOUR_BAR.format(rocker=arm * size, end=dead + 1e-7) + "start = -0.5\n" + SECOND_LOOP
    second = text.index("[bodies.rod]")
    text = text[:second] + text[second:].replace('"base"', '"0.3 * base"').replace("0.9", "0.3")
    named = dead_at_the_end(tmp_path / "two.toml", text, size)
    assert named == ("right", "far", "third", "fourth")


TINY = 5e-324  # the smallest number above 0
LOW = "parameters.zone_low=0.6"
WORK, HIGH = "parameters.zone_work", "parameters.zone_high"


@pytest.mark.parametrize(
    ("name", "change", "taken", "refused"),
    [
        ("tilting_two_springs", "tolerances.front_F1={}", 0.0, -TINY),
        ("atr95_lift_2", "optimise.min_transmission_angle={}", TINY, 0.0),
        ("atr95_lift_2", "optimise.min_transmission_angle={}", 1.57, 0.5 * math.pi),
        ("atr95_lift_2", "actuators.lift.rod={}", math.nextafter(0.16, 0.0), 0.16),
        ("atr95_lift_5", "parameters.m_head={}", 0.0, -TINY),
        ("atr95_lift_5", "parameters.lift_speed={}", TINY, 0.0),
        ("tilting_one_spring", "parameters.temperature={}", -257.0, -257.1),
        ("tilting_one_spring", "elements.front.service=[{},80]", -257.0, -257.1),
        ("tilting_one_spring", "parameters.front_progression={}", 1.0, math.nextafter(1.0, 0.0)),
        ("tilting_one_spring", "elements.front.rod={}", TINY, 0.0),  # was divided by
        ("tilting_one_spring", "catalogues.vapsint.AG.rod={}", TINY, 0.0),
        ("tilting_one_spring", "catalogues.vapsint.AG.progression={}", 1.0, 0.99),
        ("tilting_one_spring", "catalogues.airax.0.extended=[{},0.085]", 1.0, 0.99),
        ("tilting_one_spring", "catalogues.vapsint.AG.F1=[800.0,{}]", 800.0, 100.0),
        ("tilting_one_spring", "catalogues.vapsint.AG.F1=[{},800.0]", TINY, 0.0),
        ("tilting_one_spring", "catalogues.vapsint.AG.stroke=[0.1,{}]", 0.1, 0.09),
        ("tilting_one_spring", "catalogues.airax.0.strokes={}", "[0.1]", "[]"),
        ("tilting_one_spring", "catalogues.airax.0.strokes=[{},0.1]", TINY, 0.0),
        ("tilting_one_spring", "catalogues.vapsint.AG.F1_tolerance=[[500,{},0]]", 0.0, -TINY),
        ("tilting_one_spring", "catalogues.vapsint.AG.F1_tolerance=[[{},0,0]]", TINY, 0.0),
        ("atr95_lift_5", f"{LOW} {WORK}={{}} {HIGH}=0.9", 0.6, 0.59),
        ("atr95_lift_5", f"{LOW} {WORK}={{}} {HIGH}=0.9", 0.9, 0.91),
        ("atr95_lift_5", f"{LOW} {WORK}=0.6 {HIGH}={{}}", 0.61, 0.6),
        ("atr95_lift_5", "optimise.bounds.a1=[0.1,{}]", math.nextafter(0.1, 1.0), 0.1),
    ],
)
def test_the_last_value_is_taken_and_the_next_refused(name, change, taken, refused):
    load_mechanism(name, change.format(taken).split())
    with pytest.raises(InputError):
        load_mechanism(name, change.format(refused).split())


@points(
    ("temperature", "end"),
    [(-40.0, -30.0), (24.9, -30.0), (25.1, 80.0), (90.0, 80.0)],
    always=(1, 2),
)
def test_temperature_of_a_gas_spring_is_held_against_the_nearer_end(temperature, end):
    """In service from -30 to 80 C."""
    changed = [f"parameters.temperature={temperature}"]
    check = by_name(analyse(load_mechanism("tilting_one_spring", changed)))["front_temperature"]
    assert check.limit == end
    assert check.ok == (-30.0 <= temperature <= 80.0)


def test_few_positions_hide_neither_a_height_nor_a_reaction(arm):
    """Pushed square at its tip, where its weight is, the arm bears m g sin(angle) at its hinge."""
    result = analyse(
        arm('push = "arm.tip"\nangle = "pi / 2"', 0.0, 2.2, more="\n[sampling]\npoints = 3\n")
    )
    found = [row["travel"] for row in result.everywhere("height", 0.99)]
    assert found == pytest.approx([np.arcsin(0.99), np.pi - np.arcsin(0.99)])
    assert result.reactions["hinge"].max == pytest.approx(100.0 * G, rel=1e-5)
    assert result.reactions["hinge"].at == pytest.approx(0.5 * np.pi, abs=3e-3)
    assert len(result.reactions["hinge"].components) == 3


def test_few_positions_do_not_hide_where_a_gas_spring_is_compressed_most(arm):
    """Its ends and the hinge are in line there."""
    more = """
[sampling]
points = 3
[elements.gas]
gas_spring = ["ground.foot", "arm.pin"]
F1 = 100.0
progression = 1.3
stroke = 0.7
extended = 0.9
rod_end = "arm.pin"
"""
    found = by_name(analyse(arm(TORQUE, -1.0, 2.2, more=more)))["gas_rod_down"]
    assert found.value == pytest.approx(-0.2 * (1.0 - 0.3 / np.hypot(0.5, 0.2)), rel=1e-5)


def test_a_height_of_the_end_that_is_met_before_counts_there(arm):
    high = "\n[zone]\nlow = 0.2\nwork = 0.5\nhigh = 'sin(end)'\n"
    result = analyse(arm(TORQUE, 0.0, 2.2, more=high))
    assert result.zone["high"]["travel"] == pytest.approx(np.pi - 2.2, abs=1e-9)


def test_a_torque_by_hand_is_shown_in_newton_metres(arm):
    more = """
[published]
max_force = 981.0
[optimise]
objective = "peak_force"
range = "travel"
available_force = 900.0
[optimise.bounds]
mass = [50.0, 150.0]
"""
    result = analyse(arm(TORQUE, 0.0, more=more))
    assert by_name(result)["available_force"].unit == "N m"
    assert {one.unit for one in scatter(result.definition)} == {"N m"}
    assert "981 N m" in str(published_table(result))
    none = analyse(arm(TORQUE, 0.0, more="[published]\nmin_force = 0.0"))  # was divided by
    assert str(published_table(none)).splitlines()[-1].split()[:4] == ["min_force", "0", "N", "m"]
    assert published_data(result)["max_force"]["published"] == 981.0
    assert "largest force (N m)" in str(comparison_table([result, result]))
    by_force = analyse(load_mechanism("tilting_one_spring"))
    assert "largest force (N or N m)" in str(comparison_table([result, by_force]))


def test_published_values_stand_beside_the_published_parameters_only(arm, tmp_path):
    more = "\n[published]\nmax_force = 981.0\n[cases.light]\nmass = 50.0\n"
    definition = arm(TORQUE, 0.0, more=more)
    assert published_data(analyse(definition))
    assert not published_data(analyse(definition, case="light"))
    changed = load_mechanism(tmp_path / "arm.toml", ["parameters.mass=90.0"])
    assert not published_data(analyse(changed))


def test_the_contact_force_counts_everywhere_in_the_zone(arm):
    """A spring pulls the arm down between work height and the zone's upper end only."""
    more = """
[zone]
low = 0.5
work = 0.6
high = 0.9
[contact]
force = 100.0
[elements.catch]
torsion_spring = ["arm", "ground"]
table = [[0.0, 0.0], [0.7, 0.0], [0.8, -400.0], [0.9, 0.0], [2.0, 0.0]]
"""
    result = analyse(arm(CYLINDER.format(acts="push"), 0.0, 1.2, friction=5.0, more=more))
    angle = np.linspace(np.arcsin(0.5), np.arcsin(0.9), 20001)

    def held(angle):
        """Torque of the cylinder for each newton."""
        x, y = 0.3 * np.cos(angle) - 0.5, 0.3 * np.sin(angle) + 0.2
        return (-0.3 * np.sin(angle) * x + 0.3 * np.cos(angle) * y) / np.hypot(x, y)

    weight, work = 100.0 * G * np.cos(angle), np.arcsin(0.6)
    push = (100.0 * G + 100.0) * np.cos(work) / held(work)
    catch = np.interp(angle, [0.7, 0.8, 0.9], [0.0, 400.0, 0.0])
    contact = (push * held(angle) - weight - catch - 5.0) / np.cos(angle)
    assert contact[[0, -1]].min() > 0.0 > contact.min()
    found = by_name(result)["contact_force"]
    assert (found.value, found.ok) == (pytest.approx(contact.min(), abs=0.2), False)


def test_positions_in_the_zone_are_there_although_a_length_is_met_before_it(arm):
    """The piston is shortest at -0.38 rad, hinge and ends in line; the zone lies behind."""
    more = """
[zone]
low = 1.0
work = 1.2
high = 1.6
[optimise]
objective = "constant"
target = 3.0
points = 5
[optimise.bounds]
mass = [50.0, 150.0]
"""
    both = TORQUE + '\n[actuators.piston]\npiston = ["ground.foot", "arm.pin"]'
    definition = arm(both, -1.2, 1.2, more=more)
    solve_for = definition.solve.model_copy(update={"actuator": "piston"})
    found = positions(definition.model_copy(update={"solve": solve_for}))
    x, y = 0.3 * np.cos(found.s) - 0.5, 0.3 * np.sin(found.s) + 0.2
    assert found.height[[0, -1]] == pytest.approx([1.0, 1.6])
    assert found.height == pytest.approx(np.sin(found.s) + np.sin(1.2))
    assert np.ptp(np.diff(np.hypot(x, y))) < 1e-12


@pytest.mark.parametrize("pressure", ["'auto'", "5e5"])
def test_a_double_acting_cylinder_that_must_pull_holds_the_contact_by_pulling(arm, pressure):
    more = f"""
[zone]
low = 0.1
work = 0.2
high = 0.4
[contact]
force = 100.0
pressure = {pressure}
"""
    pull, both = (
        analyse(arm(CYLINDER.format(acts=acts), 2.6, 1.6, more=more)).contact
        for acts in ("pull", "both")
    )
    assert both.force == pytest.approx(pull.force)
    assert both.pressure == pytest.approx(pull.pressure)
    assert (both.force["work"] == pytest.approx(100.0)) == (pressure == "'auto'")
