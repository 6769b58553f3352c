"""Torsion springs, springs by table, horizontal outputs, cranks at constant speed, every link."""

import numpy as np
import pytest
from selection import points

from railsim.definitions.loading import load_mechanism
from railsim.errors import InputError
from railsim.mechanisms.analysis import analyse
from railsim.mechanisms.forces import Rates, generalised_force, reactions
from railsim.mechanisms.kinematics import solve
from railsim.mechanisms.links import actuators, links
from railsim.mechanisms.optimisation import optimise
from railsim.mechanisms.selection import selection

G = 9.81
ARM = """
format = "railsim-mechanism/1"
name = "arm"
[parameters]
k = 400.0
[ground.points]
hinge = [0.0, 0.0]
post = [0.0, 0.5]
[bodies.arm]
points = { hinge = [0.0, 0.0], pin = [0.4, 0.0], tip = [1.0, 0.0] }
mass = 10.0
centre = [0.6, 0.0]
[joints.hinge]
revolute = ["ground.hinge", "arm.hinge"]
[driver]
angle = "arm"
start = -0.5
end = 1.0
[actuators.hand]
turn = "arm"
[solve]
unknown = "hand"
"""
LINEAR = """
[elements.balance]
spring = ["ground.post", "arm.pin"]
stiffness = "k"
free_length = 0.0
"""
CRANK = """
format = "railsim-mechanism/1"
name = "press"
[parameters]
crank = 0.1
rod = 0.3
[ground.points]
o = [0.0, 0.0]
[bodies.crank]
points = { pin = [0.0, 0.0], end = ["crank", 0.0] }
[bodies.slide]
points = { pin = [0.0, 0.0] }
mass = 2.0
[start]
slide = { x = 0.4, y = 0.0 }
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
end = 6.0
[output]
point = "slide.pin"
axis = "x"
[actuators.motor]
turn = "crank"
[solve]
unknown = "motor"
[motion]
angle = "crank"
speed = 20.0
"""
SLIDE = """
format = "railsim-mechanism/1"
name = "slide"
[parameters]
friction = 20.0
[ground.points]
o = [0.0, 0.0]
wall = [1.0, 0.0]
[bodies.slide]
points = { pin = [0.0, 0.0] }
mass = 2.0
[start]
slide = { x = 0.4, y = 0.0 }
[joints.guide]
prismatic = ["slide.pin", "ground.o"]
[driver]
coordinate = "slide.pin"
axis = "x"
start = 0.4
end = 0.6
[output]
point = "slide.pin"
axis = "x"
[actuators.push]
cylinder = ["ground.o", "slide.pin"]
bore = 0.05
supply_pressure = 0.6e6
[solve]
unknown = "push"
[elements.gas]
gas_spring = ["slide.pin", "ground.wall"]
F1 = 100.0
progression = 1.0
stroke = 0.3
extended = 0.65
friction = "friction"
"""


@pytest.fixture
def load(tmp_path):
    def made(text, *changes):
        path = tmp_path / "mine.toml"
        path.write_text(text)
        return load_mechanism(path, changes)

    return made


def test_search_over_a_torque_by_hand_balances_an_arm(load):
    """A spring without free length balances an arm at every angle: k a r = m g l."""
    search = '\n[optimise]\nobjective = "peak_force"\nrange = "travel"\nstarts = 1\n'
    best = optimise(load(ARM + LINEAR + search + "[optimise.bounds]\nk = [200.0, 600.0]\n"))
    assert best.parameters["k"] == pytest.approx(10.0 * G * 0.6 / (0.5 * 0.4), rel=1e-4)
    assert best.after.peak_force < 1e-2 < analyse(load(ARM + LINEAR)).peak_force


def test_search_that_needs_a_length_says_so(load):
    search = '\n[optimise]\nobjective = "constant"\ntarget = 1.0\nrange = "travel"\n'
    with pytest.raises(InputError, match=r"'constant': no actuator between two points") as error:
        optimise(load(ARM + LINEAR + search + "[optimise.bounds]\nk = [200.0, 600.0]\n"))
    assert error.value.faults[0].key == "optimise.objective"


def test_a_torsion_spring_is_its_law_and_acts_on_both_bodies(load):
    torsion = '\n[elements.bar]\ntorsion_spring = ["arm", "ground"]\nstiffness = 50.0\n'
    result = analyse(
        load(ARM + torsion + "free_angle = 0.2\n[elements.none]\ntorque='arm'\nsize='k*0'\n")
    )
    s = result.motion.s
    weight = 10.0 * G * 0.6 * np.cos(s)
    assert result.output["force"] == pytest.approx(weight + 50.0 * (s - 0.2))
    # virtual work and multipliers agree
    _, driver = reactions(result.motion, {"hand": result.output["force"]})
    assert np.abs(driver).max() < 1e-9 * weight.max()


def test_springs_by_table_are_straight_between_their_rows(load):
    table = "\n[elements.bar]\ntorsion_spring = ['arm', 'ground']\n"
    table += "table = [[-1, 30], [0, 0], [2, -80]]\n"
    table += "[elements.none]\ntorque='arm'\nsize='k*0'\n"
    model = analyse(load(ARM + table)).model
    s = np.array([-0.5, 0.3, 1.0])
    found = generalised_force(solve(model, s))
    assert found == pytest.approx([15.0, -12.0, -40.0] - 10.0 * G * 0.6 * np.cos(s))
    # a linear spring as a table gives the same as the linear spring
    rows = LINEAR.replace(
        'stiffness = "k"\nfree_length = 0.0\n', "table = [[0.0, 0.0], [2.0, '-2*k']]\n"
    )
    assert analyse(load(ARM + rows)).output["force"] == pytest.approx(
        analyse(load(ARM + LINEAR)).output["force"]
    )


def test_a_spring_outside_its_table_is_refused(load):
    short = LINEAR.replace(
        'stiffness = "k"\nfree_length = 0.0\n', "table = [[0.4, 0], [0.6, '-k']]\n"
    )
    with pytest.raises(InputError, match=r"mm is outside the table; 400 to 600 mm"):
        analyse(load(ARM + short))
    both = LINEAR.replace("free_length", "table = [[0, 0], [1, 1]]\nfree_length")
    with pytest.raises(InputError, match=r"either 'stiffness' and 'free_length', or 'table'"):
        load(ARM + both)


def test_a_crank_at_constant_speed_moves_its_slider_as_the_closed_form(load):
    result = analyse(load(CRANK))
    timed = result.timed
    omega, r, length = 20.0, 0.1, 0.3
    a = 0.3 + omega * timed.time
    assert timed.motion.s == pytest.approx(a, abs=1e-9)
    root = np.sqrt(length**2 - (r * np.sin(a)) ** 2)
    speed = -r * np.sin(a) * omega * (1.0 + r * np.cos(a) / root)
    v, acceleration = timed.point("slide.pin")
    assert v[:, 0] == pytest.approx(speed, abs=1e-9)
    # power of the motor is the change of the slider's energy
    assert timed.force * omega == pytest.approx(2.0 * acceleration[:, 0] * v[:, 0], abs=1e-8)


def test_a_horizontal_output_has_a_ratio_a_zone_and_weights(load):
    piston = """
[actuators.ram]
piston = ["ground.o", "slide.pin"]
"""
    text = CRANK.replace("end = 6.0", "end = 2.5").replace("[solve]", piston + "[solve]")
    text = text.replace('unknown = "motor"', 'unknown = "motor"\nactuator = "ram"')
    result = analyse(load(text + "\n[zone]\nlow = -0.10\nwork = -0.05\nhigh = -0.02\n"))
    s = result.zone["work"]["travel"]
    assert result.zone["work"]["x"] == pytest.approx(-0.05, abs=1e-9)
    r, length = 0.1, 0.3
    x = r * np.cos(s) + np.sqrt(length**2 - (r * np.sin(s)) ** 2)
    assert x - (r * np.cos(0.3) + np.sqrt(length**2 - (r * np.sin(0.3)) ** 2)) == pytest.approx(
        -0.05
    )
    assert np.all(np.isfinite(result.output["effective_mass"]))
    assert result.output["effective_mass"] == pytest.approx(2.0)  # the slider itself
    assert result.output["ratio"] == pytest.approx(1.0)  # was 0: along y


@points("name", ["atr95_lift_5", "tilting_one_spring"], always=(0,))
def test_speeds_of_links_and_actuators_are_the_slopes_of_their_angles_and_lengths(name):
    timed = analyse(load_mechanism(name, ["motion.points=2001", "sampling.points=51"])).timed
    for courses in (links(timed.motion), actuators(timed.motion)):
        assert courses
        for course in courses.values():
            moving = course.in_time(timed.speed, timed.acceleration)
            inside = slice(20, -20)  # one-sided differences at the ends
            for value, slope in ((moving.value, moving.first), (moving.first, moving.second)):
                found = np.gradient(value, timed.time)[inside]
                scale = max(np.abs(slope).max(), 1e-9)
                assert found == pytest.approx(slope[inside], abs=1e-4 * scale)


def test_rows_of_catalogues_are_computed_with_their_own_numbers():
    result = analyse(load_mechanism("tilting_one_spring", ["parameters.front_F1=200"]))
    rows = {row.name: row for row in selection(result) if row.fits}
    ak, am = rows["front: AK"].values, rows["front: AM"].values
    assert (ak["progression"], am["progression"]) == (1.3, 1.38)
    assert (ak["rod"], am["body"]) == (0.006, 0.0185)
    # the file's spring has the progression 1.3 but a stroke of 120 mm: AK takes what is needed
    changes = ["parameters.front_F1=200", f"parameters.front_stroke={ak['stroke']}"]
    same = analyse(load_mechanism("tilting_one_spring", changes))
    assert ak["force_most"] == pytest.approx(same.max_force, rel=1e-5)
    hot = [*changes, "parameters.temperature=80"]
    cold = [*changes, "parameters.temperature=-30"]
    forces = [analyse(load_mechanism("tilting_one_spring", c)).output["force"] for c in (hot, cold)]
    assert ak["force_lowest"] == pytest.approx(np.min(forces))
    assert ak["force_highest"] == pytest.approx(np.max(forces))


@pytest.mark.parametrize("start", [0.1, 0.2, 0.3])
def test_a_gas_spring_fits_that_is_used_over_all_its_stroke(load, start):
    """The slide moves by 0.3 m towards a wall at 1 m: extended 1 - start, pressed 0.7 m - start."""
    least = round(0.7 - start, 3)
    rows = {
        "of its length": f"strokes = [0.3], extended = [1.0, {least}]",
        "of a range": f"stroke = [0.1, 0.3], extended = [1.0, {least}]",
        # from 310 mm, extended as long as the slide goes, to 320 mm, pressed as short
        "of a wide range": f"stroke = [0.1, 3.0], extended = [2.0, {0.38 - start}]",
        "made to length": "strokes = [0.3]",
        "1 mm less": f"strokes = [0.299], extended = [1.0, {least}]",
        "1 mm longer": f"strokes = [0.3], extended = [1.0, {least + 0.001}]",
        "1 mm shorter": f"strokes = [0.3], extended = [1.0, {least - 0.001}]",
    }
    each = (f'{{ name = "{name}", {row}, F1 = [50, 200] }}' for name, row in rows.items())
    catalogue = f"[catalogues]\nc = [{', '.join(each)}]\n"
    text = f'{SLIDE}{catalogue}[[selection]]\nelement = "gas"\ncatalogue = "c"\n'
    changes = [f"{key}={start}" for key in ("start.slide.x", "driver.start")]
    changes += [f"driver.end={start + 0.3}", f"elements.gas.extended={1.0 - start}"]
    chosen = selection(analyse(load(text, *changes)))
    found = {c.name.partition(": ")[2]: c for c in chosen if c.catalogue == "c"}
    assert {n: c.fits for n, c in found.items()} == {n: not n.startswith("1 mm") for n in rows}
    assert found["of a wide range"].values["stroke"] == pytest.approx(0.31)


def test_tolerance_of_F1_and_locks_of_the_source():
    changes = ["parameters.front_F1=300", "parameters.r_A=0.4"]
    changes += ["parameters.front_extended=0.48", "parameters.front_stroke=0.18"]
    result = analyse(load_mechanism("tilting_one_spring", changes))
    rows = {row.name: row for row in selection(result)}
    airax = rows["front: 8/20"].values
    assert (airax["F1_low"], airax["F1_high"]) == (270.0, 330.0)  # Airax: +-30 N up to 750 N
    locked = rows["front: 3ML p 30 %"]
    catalogue = result.definition.catalogues
    assert len(catalogue["rigid_lock"]) == 30
    assert [row.unlock for row in catalogue["lock"]] == [0.004, 0.007, 0.007] * 2
    row = next(r for r in catalogue["rigid_lock"] if r.name == "4SL p 100 %")
    assert row.extended == (2.16, 0.075)
    assert (row.lock_extension, row.lock_compression) == (10000.0, 5.25)
    if locked.fits:
        assert locked.values["lock_compression"] == pytest.approx(3.0 * 300.0)


def test_all_bottles_of_the_source_are_cases():
    cases = load_mechanism("tilting_two_springs").cases
    masses = {name: case["m_bottle"] for name, case in cases.items()}
    assert masses == {
        "bordolese_1500": 0.9, "bordolese_3000": 1.75, "bordolese_5000": 2.95,
        "bourgogne_750": 0.55, "bourgogne_1500": 1.25, "bourgogne_3000": 1.5,
        "bourgogne_5000": 2.7,
    }  # fmt: skip


def test_friction_does_not_hide_in_the_sense_of_a_rate():
    """Friction of a gas spring opposes the motion whichever way it is driven."""
    model = analyse(load_mechanism("tilting_one_spring", ["parameters.front_friction=50"])).model
    motion = solve(model, np.linspace(model.start, model.end, 11))
    forward, back = (generalised_force(motion, Rates(friction=k)) for k in (1, -1))
    assert np.all(forward < back)


def test_a_force_that_is_zero_everywhere_has_no_zeros(load):
    assert analyse(load(CRANK)).force_zeros == ()  # was one at every position


def test_friction_of_a_motion_by_table_turns_with_the_motion(load):
    """Out and back: m a + F1 + R where the spring is compressed, m a + F1 - R where it extends."""
    table = [[round(0.1 * k, 1), float(0.05 * (1.0 - np.cos(0.2 * np.pi * k)))] for k in range(11)]
    motion = f"[motion]\nactuator = 'push'\nlaw = 'table'\ntable = {table}\npoints = 101\n"
    timed = analyse(load(SLIDE + motion)).timed
    turned = np.sign(timed.speed)
    moving = np.abs(timed.speed) > 1e-3
    expected = 2.0 * timed.acceleration + 100.0 + 20.0 * turned
    assert timed.force[moving] == pytest.approx(expected[moving], abs=1e-6)
    assert {-1.0, 1.0} == set(turned[moving])


def test_pressure_for_a_contact_force_along_x(load):
    """The cylinder pushes with p A; the gas spring takes 100 N, the contact 150 N of it."""
    zone = "[zone]\nlow = 0.05\nwork = 0.1\nhigh = 0.15\n[contact]\nforce = 150.0\n"
    contact = analyse(load(SLIDE + zone)).contact
    assert contact.pressure == pytest.approx(250.0 / (0.25 * np.pi * 0.05**2), rel=1e-9)
    assert contact.force["work"] == pytest.approx(150.0, rel=1e-9)
