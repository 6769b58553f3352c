"""Actuators: limits of power and stroke by hand, torques about axles, slip, speed and steering."""

import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from dynamics import rotation
from rig import Rig
from test_drives import MASS, RADIUS, TORQUE, WHEELSET, bogie, on_wheels, run, traction

import railsim
from railsim import laws
from railsim.constants import GRAVITY
from railsim.definitions.loading import load_track
from railsim.definitions.mirror import mirrored_vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.kernels.actuators import COMMAND, SENSE
from railsim.model.assembly import assemble
from railsim.simulation.step_choice import braked_step, slip_control_step

EXAMPLES = Path(__file__).parents[2] / "examples"
G = 9.80665
LOADED = MASS + 2.0 * WHEELSET["mass"]  # kg, the whole bogie
ROTATING = LOADED + 2.0 * WHEELSET["inertia"][1] / RADIUS**2


def limited(value, deflection, rate, **limits):
    """Force of an actuator along x that is given a command."""
    rig = Rig(kind="actuator", acts="x", **limits)
    rig.work.memory[rig.system.actuators.codes[0, COMMAND]] = value
    return rig.force(0, deflection, rate)


@pytest.mark.parametrize(
    ("command", "rate", "force"),
    [
        (4e3, 0.0, 4e3),
        (4e3, 0.2, 4e3),  # 800 W
        (4e3, 0.5, 2e3),  # 1 kW over 0.5 m/s
        (-4e3, 0.5, -2e3),
        (4e3, -1.0, 1e3),
        (9e3, 0.1, 5e3),  # by its largest force, 500 W
    ],
)
def test_power_limits_the_force(command, rate, force):
    """|F| <= P/|v|, taken or given."""
    found = limited(command, 0.0, rate, power_limit=1e3, force_limit=5e3)
    assert found == pytest.approx(force, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("command", "deflection", "force"),
    [
        (-4e3, 0.097, -4e3),
        (-4e3, 0.099, -2e3),  # half of the last 2 % of the stroke is left
        (-4e3, 0.1, 0.0),
        (-4e3, 0.12, 0.0),
        (4e3, 0.12, 4e3),  # back
        (4e3, -0.099, 2e3),
        (-4e3, -0.12, -4e3),
    ],
)
def test_the_force_outwards_ends_with_the_stroke(command, deflection, force):
    found = limited(command, deflection, 0.0, stroke=0.1)
    assert found == pytest.approx(force, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("rate", [-0.2, 0.3])
@pytest.mark.parametrize(("command", "constant"), [(5e3, 5e3), (0.0, 0.0), (-5e3, 0.0)])
def test_a_commanded_damper_takes_energy_and_never_gives_it(command, constant, rate):
    """F = c v, nothing at all without a constant above zero."""
    force = limited(command, 0.01, rate, command="damper")
    assert force == pytest.approx(constant * rate, rel=1e-9, abs=0.0)


def test_an_actuator_along_a_line_pulls_along_it_where_it_is_now():
    """Its points are 3, 4 and 12 parts of 13 apart, and 0, 5 and 12 once one has moved."""
    points = [[0.0, 0.0, -1.0], [0.3, 0.4, -2.2]]
    rig = Rig(kind="actuator", point=None, points=points, power_limit=1e3)
    rig.work.memory[rig.system.actuators.codes[0, COMMAND]] = 1300.0
    for moved, line in (([0.0, 0.0], [3.0, 4.0, -12.0]), ([-0.3, 0.1], [0.0, 5.0, -12.0])):
        found = rig.forces([*moved, 0.0, 0.0, 0.0, 0.0], np.zeros(6))
        assert found[:3] == pytest.approx(100.0 * np.array(line), abs=1e-6)
        assert found[3:] == pytest.approx(0.0, abs=1e-6)  # through the centre of the frame
    # 12/13 of 2 m/s along the line: 1 kW over that
    found = rig.forces(np.zeros(6), [0.0, 0.0, -2.0, 0.0, 0.0, 0.0])
    assert np.linalg.norm(found[:3]) == pytest.approx(1e3 * 13.0 / 24.0, rel=1e-9)


@pytest.mark.parametrize("acts", ["x", "y", "z", "roll", "pitch", "yaw"])
def test_an_actuator_along_or_about_an_axis_of_its_body_turns_with_it(acts):
    """It acts along a column of C = Rz(yaw) Rx(roll) Ry(pitch), in a mirrored vehicle against it.

    Its power is F v along it.
    """
    roll, pitch, yaw = 0.3, -0.2, 0.5
    about, k = divmod(["x", "y", "z", "roll", "pitch", "yaw"].index(acts), 3)
    axis = (rotation(yaw, 2) @ rotation(roll, 0) @ rotation(pitch, 1))[:, k]
    own = slice(3 * about, 3 * about + 3)
    rig = Rig(kind="actuator", acts=acts, power_limit=1e3)
    rig.work.memory[rig.system.actuators.codes[0, COMMAND]] = 1300.0
    rig.state[6 * rig.frame + 3 : 6 * rig.frame + 6] = roll, pitch, yaw
    for sense, speed, force in ((1, 0.0, 1300.0), (1, 2.0, 500.0), (-1, -2.0, -500.0)):
        rig.system.actuators.row[0, SENSE] = sense
        rate = np.zeros(6)
        rate[own] = speed * axis
        assert rig.forces(np.zeros(6), rate)[own] == pytest.approx(force * axis, abs=1e-6)


def test_an_actuator_along_a_line_needs_two_points():
    point = [0.0, 0.0, -1.0]
    for given in ({"point": point}, {"point": None, "points": [point, point]}):
        with pytest.raises(ValueError, match="two different 'points'"):
            Rig(kind="actuator", **given)


def on_axle(**changes):
    return bogie({"kind": "actuator", "bodies": ["frame", "wheelset"], "acts": "axle", **changes})


def commanded(vehicle, value, friction=0.4, speed=10.0, duration=3.0, **settings):
    """Run with one command to all actuators from the begin on."""
    outputs = {"elements": ["*.drive"], "drives": True, "contact_patches": True}
    settings = railsim.Settings.model_validate({"outputs": outputs, **settings})
    track = load_track("straight").replace(friction=(friction, friction))
    how = {"speed": speed, "duration": duration, "settings": settings}
    with railsim.Simulation(vehicle, track, **how) as sim:
        for name in sim.actuators:
            sim.set(name, value)
        sim.run()
        return sim.result()


def test_a_torque_about_an_axle_is_that_of_a_drive():
    """The same bits as the element of a given torque."""
    expected = run(bogie(traction()), friction=0.4, duration=1.5)
    found = commanded(on_axle(), TORQUE, duration=1.5)
    for name in ("body_position", "Q", "xi_x", "axle_torque"):
        assert np.array_equal(expected[name], found[name]), name
    assert np.array_equal(found["element_force"][:, :2, 4], found["axle_torque"])
    assert np.all(found["element_command"] == TORQUE)


def test_a_commanded_brake_is_a_brake():
    """It locks both wheelsets and holds them as the element of a given torque does.

    On the way there torques differ by some percent: it counts the turn against the pitching frame.
    """
    drive = traction(kind="brake", torque_table=[[0.0, 20e3]])
    expected = run(bogie(drive), friction=0.1, duration=1.5)
    found = commanded(on_axle(command="brake"), 20e3, 0.1, duration=1.5)
    spin = 10.0 / RADIUS - found["body_velocity"][-1, 1:, 4]
    assert np.all(np.abs(spin) * RADIUS < 0.1)
    assert found["axle_torque"][-1] == pytest.approx(expected["axle_torque"][-1], rel=2e-3)
    assert found["axle_torque"][-1] == pytest.approx(on_wheels(found)[-1] * RADIUS, rel=0.01)


def test_mirrored_vehicle_drives_forwards():
    vehicle = on_axle()
    found = [commanded(v, TORQUE, duration=1.0) for v in (vehicle, mirrored_vehicle(vehicle))]
    assert np.allclose(on_wheels(found[0])[-1], on_wheels(found[1])[-1], rtol=1e-9)
    assert np.all(on_wheels(found[0])[-1] > 0.99 * TORQUE / RADIUS)


def test_limited_power_accelerates_by_the_root_of_time():
    """v^2 = v_0^2 + 2 P t/m, m with the turning wheels; within 0.5 %: what creepage takes."""
    power = 20e3
    found = commanded(on_axle(power_limit=power), 50e3, drive={"mode": "free"})
    assert np.all(found["element_command"] == 50e3)
    assert found["element_power"][-1] == pytest.approx([-power] * 2)
    time, speed = found["time"], np.gradient(found["distance"], found["time"])
    gained = np.polyfit(time[100:-2], speed[100:-2] ** 2, 1)[0]
    assert gained == pytest.approx(4.0 * power / ROTATING, rel=5e-3)


@pytest.mark.parametrize(("share", "said"), [(1.02, True), (0.5, False)])
def test_a_damper_commanded_beyond_the_step_is_remarked_upon(share, said):
    """A pair on the frame's yaw alternates from h 2 c y^2/I = 1 on, by Adams and Bashforth."""
    coach, y = railsim.load_vehicle("coach_manchester"), 1.3
    usual = {"kind": "actuator", "bodies": ["carbody", "front.frame"], "command": "damper"}
    pair = {f"of_yaw_{k}": {**usual, "point": [9.5, k * y, -0.6], "acts": "x"} for k in (-1, 1)}
    coach = coach.replace(elements={**coach.elements, **pair})
    inertia = coach.assemblies["bogie"].bodies["frame"].inertia[2]
    with railsim.Simulation(coach, load_track("straight"), speed=20.0, duration=0.05) as sim:
        for name in pair:
            sim.set(name, share * inertia / (2.0 * sim.step_length * y**2))
        sim.step(0.02)
        for name in pair:
            sim.set(name, 0.0)  # the largest command counts, not the last one
        sim.step(0.03)
        found = [remark for remark in sim.result().remarks if "commanded" in remark]
    assert bool(found) == said


@pytest.mark.parametrize(
    ("brakes", "actuator", "torque"),
    [
        ({"front": [{}], "rear": [{"torque_table": [[0.0, 5e3]]}]}, {}, 20e3),
        ({"front": [{}], "rear": [{"torque_table": [[0.0, 50e3]]}]}, {}, 50e3),
        ({"front": [{}, {"torque_table": [[0.0, 6e3]]}], "rear": [{}]}, {}, 26e3),
        ({"rear": [{"torque_table": [[0.0, 20e3], [9.0, 30e3], [20.0, 8e3]]}]}, {}, 30e3),
        ({"rear": [{}, {"demand_table": [[0.0, 0.2], [1.0, 0.7], [2.0, 0.0]]}]}, {}, 34e3),
        ({"front": [{"kind": "traction"}]}, {}, None),  # no brake
        ({"front": [{"kind": "traction", "torque_table": [[0.0, 40e3], [9.0, -30e3]]}]}, {}, 30e3),
        ({}, {"force_limit": 8e3}, 8e3),
        ({"front": [{}]}, {"force_limit": 8e3}, 28e3),
        ({}, {}, 0.5 * LOADED / 2.0 * GRAVITY * RADIUS),  # slides on dry rails
    ],
)
def test_longest_step_holds_the_axle_that_is_braked_most(brakes, actuator, torque):
    """z = h c/I = 1.6 with the damping c = M r/v of a tread that turns with less than 0.1 m/s."""
    usual = {"kind": "brake", "torque_table": [[0.0, 20e3]]}
    elements = {
        f"{end}_{k}": {**usual, **one, "bodies": ["frame", f"{end}.wheelset"]}
        for end, found in brakes.items()
        for k, one in enumerate(found)
    }
    if actuator or not brakes:
        elements["commanded"] = {
            "kind": "actuator", "acts": "axle", "command": "brake",
            "bodies": ["frame", "front.wheelset"], **actuator,
        }  # fmt: skip
    vehicle = bogie(None).replace(elements=elements)
    system = assemble(vehicle, load_track("straight"), railsim.Settings()).system
    wheelset = WHEELSET["inertia"][1]
    step = np.inf if torque is None else 1.6 * wheelset * 0.1 / (torque * RADIUS)
    assert braked_step(system) == pytest.approx(step, rel=1e-9)


@pytest.mark.parametrize("kind", ["brake", "traction"])
def test_longest_step_holds_the_slip_of_a_controlled_axle(kind):
    """z = h c/I = 1.6 with c = M r/((b - a) V) of a torque that is gone over the slips a to b."""
    law = {"demand_table": [[0.0, 0.0], [1.0, 0.8]], "slip_control": [0.01, 0.03]}
    system = assemble(
        bogie(traction(kind=kind, torque_table=[[0.0, 25e3], [9.0, 5e3]], **law)),
        load_track("straight"),
        railsim.Settings(),
    ).system
    step = 1.6 * WHEELSET["inertia"][1] * 0.02 / (20e3 * RADIUS)
    assert slip_control_step(system) == pytest.approx(step, rel=1e-9)


def test_a_brake_by_a_damper_decays():
    """Two eddy current brakes T = -c omega: v = v_0 exp(-2 c t/(m r^2))."""
    c = 500.0
    found = commanded(on_axle(command="damper"), c, drive={"mode": "free"})
    time, speed = found["time"], np.gradient(found["distance"], found["time"])
    decay = np.polyfit(time[100:-2], np.log(speed[100:-2]), 1)[0]
    assert decay == pytest.approx(-2.0 * c / RADIUS**2 / ROTATING, rel=5e-3)


@laws.force_element
def eddy(rate, c):
    return c * rate


def test_a_law_about_an_axle_is_an_element():
    """The torque of a damper; a law acts before the begin already, a command does not."""
    own = on_axle(kind="law", law="eddy", parameters={"c": 500.0})
    own = own.replace(laws={"eddy": laws.law(eddy)})
    how = {"friction": 0.4, "duration": 0.5, "drive": {"mode": "free"}}
    expected, found = commanded(on_axle(command="damper"), 500.0, **how), commanded(own, 0.0, **how)
    assert np.all(found["axle_torque"] < -0.9 * 500.0 * 10.0 / RADIUS)
    assert found["axle_torque"][-1] == pytest.approx(expected["axle_torque"][-1], rel=2e-3)


@laws.controller
def protection(time, axle, vehicle, target, fill, ahead, gain, memory):
    sliding = vehicle - axle
    coming = sliding + ahead * (sliding - memory[1]) / 0.01
    left = target * vehicle - coming
    change = fill if left > 0.5 * target * vehicle else min(fill, gain * left)
    memory[0], memory[1] = max(0.0, memory[0] + 0.01 * change), sliding
    return memory[0]


def protected():
    """Return the bogie with a brake and a controller for each axle."""
    ends = ("front", "rear")
    speeds = {
        end: {"quantity": "wheel_speed", "wheelset": f"{end}.wheelset", "rate": 100.0}
        for end in ends
    }
    values = {"target": 0.025, "fill": 10e3, "ahead": 0.1, "gain": 20e3}
    return on_axle(command="brake", lag=0.04, rate_limit=60e3).replace(
        laws={"protection": laws.law(protection)},
        signals={**speeds, "vehicle": {"quantity": "speed", "rate": 100.0}},
        controllers={
            end: {
                "law": "protection",
                "period": 0.01,
                "inputs": {"axle": end, "vehicle": "vehicle"},
                "outputs": [f"{end}.drive"],
                "parameters": values,
                "memory": 2,
            }
            for end in ends
        },
    )


def test_slide_protection_on_falling_friction():
    """Slip between 1 and 3 % for 95 % of the braking time; shorter than by the static law.

    No brake stops it in less than v^2/(2 mu g), this one within 25 % more: creep forces are less
    than the friction, which falls by 5 % at a slip of 2.5 % of 16 m/s, and the brake is filled.
    """
    mu, begin, end = 0.1, 16.0, 4.0
    law = traction(kind="brake", torque_table=[[0.0, 12e3]], demand_table=[[0.0, 0.0], [1.2, 1.0]])
    track = load_track("straight").replace(
        plan=[{"type": "STR", "length": 400.0}],
        cant=[{"type": "CST", "length": 400.0, "cant": 0.0}],
        friction=(mu, mu),
        friction_falling={"rest": 0.4, "decay": 0.2},
        third_body=(0.3, 0.1),
        support={"preset": "rigid"},
    )
    distance, share = [], []
    for vehicle in (protected(), bogie({**law, "slip_control": [0.01, 0.03]})):
        settings = {"drive": {"mode": "free"}, "creep_law": "polach", "output_rate": 50.0}
        result = run(vehicle, track, begin, 15.0, **settings, outputs={})
        speed = np.gradient(result["distance"], result["time"])
        braking = speed > end
        slip = result["xi_x"][braking, :, 0]
        share.append(np.mean((slip > 0.01) & (slip < 0.03)))
        distance.append(np.max(result["distance"][braking]))
    assert share[0] > 0.95
    assert distance[0] < distance[1]
    least = (begin**2 - end**2) / (2.0 * mu * G)
    assert least < distance[0] < 1.25 * least


@pytest.fixture
def example(tmp_path, monkeypatch):
    """Names of an example after its run."""
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("Agg")
    yield lambda name: runpy.run_path(str(EXAMPLES / f"{name}.py"))
    plt.close("all")


@pytest.mark.usefixtures("small_contact_tables")
def test_speed_over_a_gradient_and_after_a_profile(example):
    """The fall of speed by the closed response, within 2 %: motors and samples are 75 ms late.

    The driver is never above a limit, and no more than 5 % longer than the shortest time.
    """
    found = example("20_speed_control")
    assert found["fallen"] == pytest.approx(found["foreseen"], rel=0.02)
    assert np.max(np.abs(found["speed"] - found["closed"])) < 0.04 * found["foreseen"]
    assert found["over"] <= 0.0
    assert found["least"] < found["driven"][0][-1] < 1.05 * found["least"]


def test_steered_wheelsets_are_radial_at_a_gain_of_one(example):
    """Angle of attack below 0.2 mrad of a/R = 4.3 mrad; rolling where Redtenbacher's formula says.

    The displacement within 0.3 mm of that of rigid wheels; wear numbers and Y are least there.
    """
    found = example("21_active_steering")
    one = list(found["GAINS"]).index(1.0)
    assert np.all(np.abs(found["attack"][one]) < 0.2)
    assert abs(found["attack"][0, 0]) > 4.3
    assert found["lateral"] == pytest.approx([found["rolling"]] * 4, abs=0.3)
    total, outer = np.sum(found["wear"], axis=1), np.max(-found["Y"][:, :, 0], axis=1)
    assert np.argmin(total) == one
    assert np.argmin(outer) == one
    assert total[one] < 0.1 * total[0]


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"bodies": ["wheelset", "frame"]}, "first the body or axlebox that takes the reaction"),
        ({"point": [0.0, 0.0, 0.0]}, "acts at no point"),
        ({"sides": "both"}, "no 'sides' and no 'stroke'"),
        ({"stroke": 0.1}, "no 'sides' and no 'stroke'"),
        ({"command": "position", "stiffness": 1e6}, 'has no acts = "axle"'),
        ({"acts": "yaw", "point": [0.0, 0.0, -0.5], "command": "brake"}, 'has only acts = "axle"'),
    ],
)
def test_faults_are_named(change, found):
    with pytest.raises((ValueError, railsim.InputError), match=found) as caught:
        flatten(on_axle(**change))
    assert "drive" in str(caught.value)
