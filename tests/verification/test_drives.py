"""Torques on wheelsets: reaction, traction, load transfer, slip control, nose-suspended motor.

A bogie alone: a frame on four springs, two driven wheelsets.  The frame's x is held, which takes
the traction at the height of its centre of gravity.  And a coach under brakes and in a side wind.
"""

from functools import cache

import numpy as np
import pytest

import railsim
from railsim.definitions.loading import load_track
from railsim.definitions.mirror import mirrored_track, mirrored_vehicle
from railsim.definitions.track.elements import ConstantGradient
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.rhs import STANDSTILL_SPEED

RADIUS, HEIGHT, HALF_BASE, HALF_WIDTH, KZ = 0.46, 0.9, 1.25, 1.0, 8e5
MASS, TORQUE = 20e3, 3e3
SIDES = "left", "right"
WHEELSET = {
    "mass": 1500.0,
    "inertia": [800.0, 100.0, 800.0],
    "position": [0.0, 0.0, -RADIUS],
    "radius": RADIUS,
    "profile": "S1002",
}
SPRING = {
    "kind": "bushing",
    "bodies": ["frame", "wheelset"],
    "point": [0.0, HALF_WIDTH, -RADIUS],
    "sides": "both",
    "stiffness": [1e7, 5e6, KZ],
    "damping": [2e4, 2e4, 3e4],
}


def traction(**changes):
    return {
        "kind": "traction",
        "bodies": ["frame", "wheelset"],
        "torque_table": [[0.0, TORQUE]],
        **changes,
    }


def bogie(drive, bodies=None, elements=None):
    """The axle behind is the mirror image of the one in front."""
    both = [
        {"name": "front", "position": [HALF_BASE, 0.0, 0.0]},
        {"name": "rear", "position": [-HALF_BASE, 0.0, 0.0], "mirror": True},
    ]
    frame = {"mass": MASS, "inertia": [2e4, 3e4, 3e4], "position": [0.0, 0.0, -HEIGHT]}
    axle = {
        "placements": both,
        "bodies": bodies or {},
        "wheelsets": {"wheelset": WHEELSET},
        "elements": {"primary": SPRING, **({"drive": drive} if drive else {}), **(elements or {})},
    }
    data = {
        "format": "railsim-vehicle/1",
        "name": "driven bogie",
        "bodies": {"frame": frame},
        "assemblies": {"axle": axle},
    }
    return Vehicle.model_validate(data)


def run(vehicle, track="straight", speed=10.0, duration=4.0, friction=None, **settings):
    settings = railsim.Settings.model_validate(
        {"outputs": {"contact_patches": True, "elements": ["*"], "drives": True}, **settings}
    )
    if isinstance(track, str):
        track = load_track(track)
    if friction is not None:
        track = track.replace(friction=(friction, friction))
    return railsim.simulate(vehicle, track, speed=speed, duration=duration, settings=settings)


@cache
def driven():
    return run(bogie(traction()))


def on_wheels(result):
    """Longitudinal forces on the wheelsets [time, wheelset]."""
    return -np.nansum(result["patch_T_x"], axis=(2, 3))


def test_steady_traction_is_the_torque_over_the_rolling_radius():
    """Both wheelsets push forwards, the one in the mirrored placement too; within 0.1 %."""
    forces = on_wheels(driven())[-1]
    assert forces == pytest.approx(TORQUE / RADIUS, rel=1e-3)


def test_reaction_turns_the_frame():
    """By hand: the couple 2 T of the reactions and 2 T/r at axle height, on springs 4 kz a^2.

    2 T + 2 T/r (h - r) = 2 T h/r; with the axles T/(2 r kx) + (h - r) pitch further ahead the
    frame's weight adds 3 %.  Within 2 %: the turn of the springs' preloads is left out.
    """
    pitch = driven()["body_position"][:, 0, 4]
    weight = MASS * 9.81
    moment = 2.0 * TORQUE * HEIGHT / RADIUS + weight * TORQUE / RADIUS / 2.0 / 1e7
    by_hand = moment / (4.0 * KZ * HALF_BASE**2 - weight * (HEIGHT - RADIUS))
    assert pitch[-1] - pitch[0] == pytest.approx(by_hand, rel=0.02)


def test_wheel_loads_balance_the_traction():
    """Of all external forces: the change of the loads' moment is the traction times its lever.

    Without the reactions the sum would lack 2 T, more than half of it.
    """
    result = driven()
    load = np.sum(result["Q"], axis=2)[-1]
    x = np.array([HALF_BASE, -HALF_BASE]) + result["body_position"][-1, 1:, 0]
    weight = x[0] + x[1]  # of the wheelsets, 1.5 t each, which move with their axles
    moment = -np.sum(load * x) + 1500.0 * 9.81 * weight
    traction_force = np.sum(on_wheels(result)[-1])
    assert moment == pytest.approx(traction_force * HEIGHT, rel=1e-3)
    assert np.sum(load) == pytest.approx(np.sum(result["Q0"]), rel=1e-4)


def test_free_running_accelerates_the_mass_and_the_rotating_wheels():
    """V' (M + sum I/r^2) = sum T/r; braking slows down by the same."""
    mass = MASS + 2 * WHEELSET["mass"] + 2 * WHEELSET["inertia"][1] / RADIUS**2
    expected = 2.0 * TORQUE / RADIUS / mass
    for kind, sign in (("traction", 1.0), ("brake", -1.0)):
        result = run(bogie(traction(kind=kind)), duration=3.0, drive={"mode": "free"})
        time, way = result["time"], result["distance"]
        speed = np.gradient(way, time)
        travelled = np.trapezoid(result["running_speed"], time)
        assert travelled == pytest.approx(way[-1] - way[0], rel=1e-6)
        rate = np.polyfit(time[200:-2], speed[200:-2], 1)[0]
        assert rate == pytest.approx(sign * expected, rel=2e-3)


def test_the_torque_follows_speed_and_demand():
    """Half of the demand over time, half of the torque between two rows of speed."""
    half = traction(
        torque_table=[[5.0, TORQUE], [15.0, 0.0]], demand_table=[[0.0, 0.0], [1.0, 0.5]]
    )
    result = run(bogie(half))
    # less the rolling resistance of the spin creepage, 4 N
    assert on_wheels(result)[-1] == pytest.approx(0.25 * TORQUE / RADIUS, rel=3e-3)
    assert on_wheels(result)[0] == pytest.approx(0.0, abs=20.0)
    assert result["axle_torque"][[0, -1]] == pytest.approx(
        np.array([[0.0] * 2, [0.25 * TORQUE] * 2])
    )
    beyond = traction(demand_table=[[20.0, 1.0], [20.001, 0.0]], over="distance")
    forces = on_wheels(run(bogie(beyond)))
    # wheelsets pass 20 m one after the other, 2.5 m apart
    assert forces[-1] == pytest.approx(0.0, abs=30.0)
    assert forces[np.searchsorted(driven()["time"], 2.0), 1] > 0.8 * TORQUE / RADIUS


@cache
def slipping(control):
    law = traction(torque_table=[[0.0, 20e3]])
    if control:
        law["slip_control"] = [0.01, 0.03]
    return run(bogie(law), friction=0.1, duration=3.0)


def test_slip_control_holds_the_creepage_near_the_optimum_on_low_friction():
    """Between the two slips, where the force is within 2 % of mu N; without it the wheels spin.

    Ten by ten cells of FASTSIM have 0.7 % more than mu N.
    """
    held, spinning = slipping(True), slipping(False)
    late = held["time"] > 1.0
    creepage = np.abs(held["xi_x"][late])
    assert np.all((creepage > 0.01) & (creepage < 0.03))
    force = on_wheels(held)[late]
    available = 0.1 * np.nansum(held["patch_N"][late], axis=(2, 3))
    assert np.all(force > 0.98 * available)
    assert np.all(force < 1.01 * available)
    assert held["axle_torque"][-1] == pytest.approx(force[-1] * RADIUS, rel=0.01)
    assert spinning["axle_torque"] == pytest.approx(20e3)
    assert np.min(np.abs(spinning["xi_x"][-1])) > 0.3


def test_slip_control_holds_the_creepage_at_walking_speed():
    """The torque falls over 0.02 V: the step follows, and the bogie slows down by mu g.

    With steps too long for that its wheels alternated, and it slowed down by 1.4 mu g.
    """
    law = traction(kind="brake", torque_table=[[0.0, 20e3]], slip_control=[0.01, 0.03])
    result = run(bogie(law), friction=0.1, speed=2.0, duration=1.0, drive={"mode": "free"})
    late = result["time"] > 0.5
    creepage = result["xi_x"][late]
    assert np.all((creepage > 0.01) & (creepage < 0.03))
    rate = np.polyfit(result["time"][late], np.gradient(result["distance"], 0.005)[late], 1)[0]
    assert rate == pytest.approx(-0.1 * 9.81, rel=0.01)


@pytest.mark.parametrize(
    "braking",
    [
        {"kind": "brake", "torque_table": [[0.0, 20e3]]},
        {"kind": "traction", "torque_table": [[0.0, -20e3]]},
    ],
)
def test_a_brake_holds_a_locked_wheelset_and_does_not_turn_it_back(braking):
    """On low friction the wheels stop turning; the torque fades to what the rails give."""
    result = run(bogie(traction(**braking)), friction=0.1)
    spin = result["body_velocity"][-1, 1:, 4]  # less than that of rolling, -V/r
    rim = (10.0 / RADIUS - spin) * RADIUS
    assert np.all((rim > -1e-3) & (rim < 0.1))
    assert on_wheels(result)[-1] == pytest.approx(-0.1 * np.sum(result["Q"][-1], axis=1), rel=0.02)
    assert result["axle_torque"][-1] == pytest.approx(on_wheels(result)[-1] * RADIUS, rel=0.01)


@pytest.mark.parametrize("drive", [{"kind": "brake"}, {"kind": "actuator", "command": "brake"}])
def test_brakes_stop_on_a_falling_gradient(drive):
    """Of 1.5 times the weight's force down the gradient, half a one slows the mass down to the end.

    A brake that faded before the standstill would let it roll on: t = (M + sum I/r^2) dV/(F/2).
    """
    mass = MASS + 2.0 * WHEELSET["mass"]
    down = mass * 9.81 * 0.1 / np.hypot(1.0, 0.1)
    torque = 1.5 * down * RADIUS / 2.0
    commanded = drive["kind"] == "actuator"
    law = {"acts": "axle"} if commanded else {"torque_table": [[0.0, torque]]}
    vehicle = bogie({"bodies": ["frame", "wheelset"], **drive, **law})
    fall = ConstantGradient(type="CST", length=500.0, gradient=-0.1)
    settings = railsim.Settings(drive={"mode": "free"}, step=2e-4)
    track = load_track("straight").replace(vertical=(fall,))
    with railsim.Simulation(vehicle, track, speed=0.5, duration=3.0, settings=settings) as sim:
        for name in sim.actuators:
            sim.set(name, torque)
        sim.run()
        result = sim.result()
    assert "came to a standstill" in result.attributes["status_reason"]
    rotating = mass + 2.0 * WHEELSET["inertia"][1] / RADIUS**2
    expected = (0.5 - STANDSTILL_SPEED) * rotating / (0.5 * down)
    assert result.time[-1] == pytest.approx(expected, rel=0.01)


# of the coach's bodies in the order of the results: mass, height, place from the middle [kg, m]
COACH = np.array(
    [[43628.0, 1.8, 0.0], [2615.0, 0.6, 9.5], [2615.0, 0.6, -9.5]]
    + [[1813.0, RADIUS, x] for x in (10.78, 8.22, -8.22, -10.78)]
)
SPIN = 112.0  # kg m2, of a wheelset


@pytest.mark.usefixtures("small_contact_tables")
def test_wheel_loads_of_a_braked_coach():
    """By hand: V' = -4 T/r over all inertia; the loads' moment is V' (sum m h + 4 I/r).

    Braking adds to the front bogie's loads.  Within 0.5 %, 0.1 % of it a resistance of 20 N.
    """
    coach = railsim.load_vehicle("coach_manchester").model_dump(exclude_none=True)
    drive = traction(kind="brake", demand_table=[[0.0, 0.0], [2.2, 1.0]])
    coach["assemblies"]["bogie"]["assemblies"]["axle"]["elements"]["drive"] = drive
    result = run(Vehicle.model_validate(coach), speed=20.0, duration=8.0, drive={"mode": "free"})
    mass, height, place = COACH.T
    rate = -4.0 * TORQUE / RADIUS / (mass.sum() + 4.0 * SPIN / RADIUS**2)
    late = result.time > 5.0
    x = place + result.body_position[late, :, 0].mean(axis=0)
    loads = result.Q[late].sum(axis=2).mean(axis=0)
    moment = 9.81 * np.sum(mass * x) - np.sum(loads * x[3:])
    assert moment == pytest.approx(rate * (np.sum(mass * height) + 4.0 * SPIN / RADIUS), rel=5e-3)


@pytest.mark.usefixtures("small_contact_tables")
def test_wheel_loads_of_a_coach_in_a_side_wind():
    """Moment about the track's middle of wind, weights and loads = sum(I roll'' + m h y'')."""
    force, above = 20e3, 2.3
    coach = railsim.load_vehicle("coach_manchester").model_dump(exclude_none=True)
    wind = {"kind": "applied_force", "bodies": ["carbody"], "point": [0.0, 0.0, -above]}
    table = [[0.0] * 4, [2.0, 0.0, force, 0.0]]
    coach["elements"] = {"wind": {**wind, "axes": "track", "force_table": table}}
    result = run(Vehicle.model_validate(coach), speed=20.0, duration=6.0)
    blown = result.time > 2.0
    mass, height, _ = COACH.T
    roll_inertia = np.array([56800.0, 1722.0, 1722.0] + [1120.0] * 4)
    y = result.body_position[blown, :, 1]
    touch = result.contact_y[blown] + y[:, 3:, None]
    loads = np.sum(result.Q[blown] * touch, axis=(1, 2))
    moment = force * above + 9.81 * y @ mass - loads
    turning = result.body_acceleration[blown, :, 3] @ roll_inertia
    turning += result.body_acceleration[blown, :, 1] @ (mass * height)
    np.testing.assert_allclose(moment, turning, atol=2e-4 * np.max(loads))
    assert y[-1, 0] > 0.05  # the car leans: its weight has a third of the moment
    across = result.body_acceleration[blown, :, 1] @ mass
    np.testing.assert_allclose(result.sum_Y[blown].sum(axis=1), force - across, atol=1e-3 * force)


def test_locked_wheelsets_of_a_coach_stand_still():
    """The torque that the rails give does not alternate, whatever step straight track allows."""
    coach = railsim.load_vehicle("coach_manchester").model_dump(exclude_none=True)
    brake = traction(kind="brake", torque_table=[[0.0, 25e3]])
    coach["assemblies"]["bogie"]["assemblies"]["axle"]["elements"]["brake"] = brake
    result = run(Vehicle.model_validate(coach), friction=0.1, duration=2.5)
    late = result["time"] > 2.0
    torque = result["axle_torque"][late]
    assert torque[-1] == pytest.approx(on_wheels(result)[-1] * RADIUS, rel=0.01)
    assert np.ptp(torque, axis=0).max() < 0.01 * np.abs(torque).max()


def test_nose_suspended_motor_carries_its_reaction():
    """A motor on the axle and a nose on the frame: the nose's force changes by T over its lever.

    In front the nose lies behind the axle and is pressed down, at the mirrored axle it is lifted.
    """
    lever = 0.8
    motor = {"mass": 1000.0, "inertia": [80.0, 80.0, 80.0], "position": [-0.4, 0.0, -RADIUS]}
    bearing = {
        "kind": "bushing",
        "bodies": ["motor", "wheelset"],
        "point": [0.0, 0.4, -RADIUS],
        "sides": "both",
        "stiffness": [2e7, 2e7, 2e7],
        "damping": [2e4, 2e4, 2e4],
    }
    nose = {
        "kind": "bushing",
        "bodies": ["frame", "motor"],
        "point": [-lever, 0.0, -RADIUS],
        "stiffness": [0.0, 0.0, 3e6],
        "damping": [0.0, 0.0, 2e4],
    }
    result = run(
        bogie(
            traction(bodies=["motor", "wheelset"]),
            {"motor": motor},
            {"bearing": bearing, "nose": nose},
        )
    )
    names = list(result.coordinates["element"])
    force = result["element_force"][:, [names.index(f"{p}.nose") for p in ("front", "rear")], 2]
    change = force[-1] - force[0]
    # on the frame: T about y on a motor behind its axle presses its nose down on the frame's end
    assert change == pytest.approx(np.array([1.0, -1.0]) * TORQUE / lever, rel=0.01)
    assert on_wheels(result)[-1] == pytest.approx(TORQUE / RADIUS, rel=2e-3)


def test_axleboxes_with_arms_carry_the_reaction():
    """Callipers on the arms: the torque of each is a force of the bush of its arm over the lever.

    Spring above the axle, bush at its height: no other force has a moment about the axle.
    """
    lever = 0.5
    arm = {"wheelset": "wheelset", "position": [0.0, HALF_WIDTH, -RADIUS], "sides": "both"}
    between = {"kind": "bushing", "bodies": ["frame", "arm"], "sides": "both"}
    spring = {"stiffness": [0.0, 0.0, KZ], "damping": [0.0, 0.0, 3e4]}
    bush = {"stiffness": [1e7, 5e6, 1e7], "damping": [2e4, 2e4, 2e4]}
    vehicle = bogie(None).model_dump(exclude_none=True)
    vehicle["assemblies"]["axle"] |= {
        "axleboxes": {"arm": {**arm, "pitch_inertia": 10.0}},
        "elements": {
            "primary": {**between, **spring, "point": [0.0, HALF_WIDTH, -RADIUS]},
            "bush": {**between, **bush, "point": [-lever, HALF_WIDTH, -RADIUS]},
            "brake_left": traction(kind="brake", bodies=["arm.left", "wheelset"]),
            "brake_right": traction(kind="brake", bodies=["arm.right", "wheelset"]),
        },
    }
    result = run(Vehicle.model_validate(vehicle))
    names = list(result.coordinates["element"])
    at = [[names.index(f"{p}.bush.{side}") for side in SIDES] for p in ("front", "rear")]
    change = np.diff(result["element_force"][[0, -1]][:, at, 2], axis=0)[0]
    # the wheel turns its calliper forwards: in front the bush, behind its axle, is lifted
    np.testing.assert_allclose(change, np.outer([-1.0, 1.0], [TORQUE / lever] * 2), rtol=0.01)
    assert on_wheels(result)[-1] == pytest.approx(-2.0 * TORQUE / RADIUS, rel=1e-3)


def test_mirror_image():
    """The left-hand curve with the mirrored vehicle: the mirrored forces to round-off."""
    vehicle, track = bogie(traction()), load_track("curve_r500")
    right = run(vehicle, track, duration=1.0)
    left = run(mirrored_vehicle(vehicle), mirrored_track(track), duration=1.0)
    assert left["Y"] == pytest.approx(-right["Y"][:, :, ::-1], abs=1e-5)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"bodies": ["wheelset", "frame"]}, "the body or axlebox that takes the reaction"),
        ({"slip_control": [0.03, 0.01]}, "two rising slips"),
        ({"slip_control": [1.0, 3.0]}, "up to 1, such as"),  # per cent
        ({"over": "distance", "demand_table": None}, "'over' needs 'demand_table'"),
        ({"torque_table": [[5.0, 1.0], [0.0, 1.0]]}, "must increase"),
        ({"kind": "brake", "torque_table": [[0.0, -1.0]]}, "greater than or equal to 0"),
        ({"kind": "brake", "demand_table": [[0.0, 1.0], [2.0, -0.5]]}, "must not be negative"),
    ],
)
def test_faults_are_named(change, found):
    from railsim.definitions.vehicle.flatten import flatten

    with pytest.raises((ValueError, railsim.InputError), match=found) as caught:
        flatten(bogie(traction(**change)))
    assert "drive" in str(caught.value)
