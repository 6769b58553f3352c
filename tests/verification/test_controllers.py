"""Controllers in the loop against the linearised loop and against what tilting has to give."""

import numpy as np
import pytest
from dynamics import Settings, load_track
from test_actuators import on_axle

import railsim
from railsim import laws
from railsim.assessment.weighting import WF
from railsim.errors import InputError
from railsim.kernels import actuators, controllers, element_outputs
from railsim.kernels.state import velocity_begin
from railsim.linear.closed_loop import closed_loop
from railsim.linear.eigenmodes import eigenmodes
from railsim.linear.vehicle import Contact, LinearVehicle
from railsim.model.assembly import assemble
from railsim.model.work import work_arrays

G = 9.80665
ENDS = {"front": 9.5, "rear": -9.5}


@laws.controller
def skyhook(time, v, c):
    return c * v


@laws.controller
def remembering(time, v, c, memory):
    """Skyhook behind a filter of 0.1 s, at 5 ms."""
    memory[0] += 0.05 * (v - memory[0])
    return c * memory[0]


@laws.controller
def constant(time, c):
    return c


@laws.controller
def keeper(time, speed, wanted, k):
    return k * (wanted - speed)


@laws.controller
def tilt(time, curvature, arm):
    return arm * curvature


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle("coach_manchester")


def bogie_with(coach, actuator, *without):
    bogie = coach.assemblies["bogie"].model_dump(exclude_none=True)
    elements = {name: e for name, e in bogie["elements"].items() if name not in without}
    ends = {"kind": "actuator", "bodies": ["frame", "carbody"]}
    return {"bogie": {**bogie, "elements": {**elements, "act": {**ends, **actuator}}}}


@pytest.mark.parametrize(
    ("law", "delay", "sampled"),
    [(skyhook, 0.0, {}), (skyhook, 0.02, {"rate": 10.0}), (remembering, 0.0, {})],
)
def test_skyhook_decays_as_its_linearised_loop(coach, law, delay, sampled):
    """The swaying mode alone, by its left eigenvector: decay within 1 %, frequency within 0.2 %.

    The controller is 500 times faster than the mode; its delay is in the linearisation, and so is
    the time for which a sample of a slow signal is held, at the rear end alone, and so is what a
    controller remembers.
    """
    across = {"point": [0.0, 0.0, -0.7], "acts": "y", "delay": delay}
    vehicle = coach.replace(
        assemblies=bogie_with(coach, across, "secondary_lateral_damper"),
        laws={law.__name__: laws.law(law)},
        signals={
            end: {
                "quantity": "velocity",
                "body": "carbody",
                "axis": "y",
                "position": [x, 0, -0.7],
                **(sampled if end == "rear" else {}),
            }
            for end, x in ENDS.items()
        },
        controllers={
            end: {
                "law": law.__name__,
                "memory": 1 if law is remembering else None,
                "period": 0.005,
                "inputs": {"v": end},
                "outputs": [f"{end}.act"],
                "parameters": {"c": 40e3},
            }
            for end in ENDS
        },
    )
    track = railsim.load_track("straight").replace(support={"preset": "rigid"})
    pushed = railsim.Settings(initial={"carbody": {"vy": 1e-3, "vroll": 3e-4}})
    sim = railsim.Simulation(vehicle, track, speed=20.0, settings=pushed, record=False)
    loop = closed_loop(vehicle, track, 20.0, step=sim.step_length)
    modes = eigenmodes(loop)
    chosen = [k for k, e in enumerate(modes.eigenvalues) if 1.0 < e.imag < 4.0]
    k = min(chosen, key=lambda k: modes.eigenvalues[k].imag)
    indices = LinearVehicle(vehicle, track).coordinates.indices
    left, rest = modes.left[k][: len(indices)], loop.state[: len(indices)]
    times, parts = [], []
    while sim.time < 4.0:
        sim.step(0.01)
        times.append(sim.time)
        parts.append((sim.state.motion[indices] - rest) @ left)
    t, q = np.array(times)[30:], np.array(parts)[30:]
    decay = np.polyfit(t, np.log(np.abs(q)), 1)[0]
    frequency = np.polyfit(t, np.unwrap(np.angle(q)), 1)[0]
    assert decay == pytest.approx(modes.eigenvalues[k].real, rel=0.01)
    assert frequency == pytest.approx(modes.eigenvalues[k].imag, rel=0.002)
    passive = eigenmodes(LinearVehicle(vehicle, track).linearised(20.0)).eigenvalues
    slow = min((e for e in passive if 1.0 < e.imag < 4.0), key=lambda e: e.imag)
    assert decay < 4.0 * slow.real  # the passive mode is hardly damped


@pytest.mark.parametrize(
    ("lag", "contact"), [(0.0, Contact()), (0.05, Contact("harmonic", amplitude=3e-3))]
)
def test_a_damper_commanded_to_be_constant_is_that_damper(coach, lag, contact):
    across = {"point": [0.0, 0.0, -0.7], "acts": "y", "command": "damper", "lag": lag}
    one = {"law": "constant", "period": 0.005, "parameters": {"c": 30e3}}
    commanded = coach.replace(
        assemblies=bogie_with(coach, across, "secondary_lateral_damper"),
        laws={"constant": laws.law(constant)},
        controllers={"c": {**one, "outputs": ["front.act", "rear.act"]}},
    )
    damper = {"kind": "bushing", "point": across["point"], "damping": [0.0, 30e3, 0.0]}
    passive = coach.replace(assemblies=bogie_with(coach, damper, "secondary_lateral_damper"))
    track = railsim.load_track("straight").replace(support={"preset": "rigid"})
    loop = closed_loop(commanded, track, 40.0, step=1e-3, contact=contact)
    assert len(set(loop.names)) == len(loop.names)
    found, expected = (
        np.sort_complex([e for e in eigenmodes(one).eigenvalues if 1.0 < e.imag < 40.0])
        for one in (loop, LinearVehicle(passive, track, contact=contact).linearised(40.0))
    )
    assert len(expected) > 2
    assert found == pytest.approx(expected, rel=1e-6)


def test_speed_is_kept_as_that_of_a_mass():
    """m v' = -m w v(t - T), T half the period and a step: s (1 + s T/2) + w (1 - s T/2) = 0."""
    car, w, delay = railsim.load_vehicle("metro_b_motor"), 0.5, 0.026
    bogie = car.assemblies["bogie"].model_dump(exclude_none=True)
    motor = {"kind": "actuator", "bodies": ["frame", "wheelset"], "acts": "axle"}
    bogie["assemblies"]["axle"]["elements"]["motor"] = motor
    mass, radius = 35396.0 + 4.0 * 104.0 / 0.42**2, 0.42  # with the turning wheels
    motors = [f"{b}.{a}.motor" for b in ("front", "rear") for a in ("outer", "inner")]
    one = {"law": "keeper", "period": 0.05, "inputs": {"speed": "v"}, "outputs": motors}
    vehicle = car.replace(
        assemblies={"bogie": bogie},
        laws={"keeper": laws.law(keeper)},
        signals={"v": {"quantity": "speed"}},
        controllers={"c": {**one, "parameters": {"wanted": 18.0, "k": mass * w * radius / 4.0}}},
    )
    track = railsim.load_track("straight").replace(support={"preset": "rigid"})
    found = np.linalg.eigvals(closed_loop(vehicle, track, 18.0, step=1e-3).matrix)
    place, speed = sorted(found, key=abs)[:2]
    assert abs(place) < 1e-6  # where it is along the track, nothing depends on
    assert speed == pytest.approx(max(np.roots([delay / 2, 1.0 - delay / 2 * w, w])), rel=0.005)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tilted_car_body_feels_less(coach, sign):
    """a_q cos(tilt) - g_n sin(tilt) in the steady curve, within 0.5 % of a_q; both directions.

    Tilt is the total roll of the car body against the track plane, g_n the part of gravity and
    centrifugal acceleration normal to that plane.
    """
    held = {"point": [0.0, 0.0, -0.9], "acts": "roll", "command": "position"}
    actuator = {**held, "stiffness": 50e6, "damping": 2e6, "lag": 0.2, "rate_limit": 0.09}
    vehicle = coach.replace(
        assemblies=bogie_with(coach, actuator),
        laws={"tilt": laws.law(tilt)},
        controllers={
            "tilt": {
                "law": "tilt",
                "period": 0.01,
                "inputs": {"curvature": "curvature"},
                "parameters": {"arm": 40.0},
                "outputs": ["front.act", "rear.act"],
            }
        },
        signals={
            "curvature": {"quantity": "curvature"},
            "felt": {"quantity": "acceleration", "body": "carbody", "axis": "y"},
            "roll": {"quantity": "angle", "body": "carbody", "axis": "roll"},
        },
    )
    radius, cant, speed = sign * 400.0, 0.10, 30.0
    track = railsim.load_track("straight").replace(
        plan=[
            {"type": "STR", "length": 60.0},
            {"type": "CLO", "length": 80.0, "radius_end": radius},
            {"type": "CIR", "length": 400.0, "radius": radius},
        ],
        cant=[
            {"type": "CST", "length": 60.0, "cant": 0.0},
            {"type": "LIR", "length": 80.0},
            {"type": "CST", "length": 400.0, "cant": sign * cant},
        ],
    )
    sim = railsim.Simulation(vehicle, track, speed=speed, record=False)
    while sim.distance < 300.0:
        sim.step(0.05)
    felt, roll = [], []
    while sim.distance < 420.0:
        sim.step(0.02)
        felt.append(sim.read("felt"))
        roll.append(sim.read("roll"))
    angle = np.arcsin(cant / 1.5)
    centrifugal = speed**2 / 400.0
    a_q = centrifugal * np.cos(angle) - G * np.sin(angle)
    g_n = G * np.cos(angle) + centrifugal * np.sin(angle)
    tilted = sign * np.mean(roll)
    assert tilted > 0.07  # 0.1 rad less what springs and wheels yield
    expected = a_q * np.cos(tilted) - g_n * np.sin(tilted)
    assert abs(sign * np.mean(felt) - expected) < 0.005 * a_q


def test_an_actuator_has_one_controller(coach):
    """The last command alone would count; named twice in one controller as in two."""
    held = {"point": [0.0, 0.0, -0.9], "acts": "roll", "command": "position", "stiffness": 50e6}
    one = {"law": "tilt", "period": 0.01, "inputs": {"curvature": "c"}, "parameters": {"arm": 1.0}}
    vehicle = coach.replace(
        assemblies=bogie_with(coach, {**held, "damping": 2e6}),
        laws={"tilt": laws.law(tilt)},
        signals={"c": {"quantity": "curvature"}},
        controllers={
            "first": {**one, "outputs": ["front.act", "front.act"]},
            "second": {**one, "outputs": ["rear.act", "front.act"]},
        },
    )
    words = r"first.outputs: found 'front.act', which controllers.first commands(.|\n)*second.outp"
    with pytest.raises(InputError, match=words):
        railsim.simulate(vehicle, railsim.load_track("straight"), speed=20.0, duration=0.1)


def test_weighting_of_motion_sickness():
    """ISO 2631-1, table 3: Wf in thousandths, rounded there to three digits."""
    table = {0.1: 695, 0.16: 1006, 0.2: 992, 0.25: 854, 0.4: 384, 0.5: 224}
    gains = WF.gain(np.array(list(table)))
    assert np.allclose(1e3 * gains, list(table.values()), rtol=0.01)


def test_signals_of_two_actuators_are_each_its_own(plain):
    """Torques about two axles, given by two commands, and speeds that they turn with."""
    system = assemble(on_axle(), load_track("straight"), Settings()).system
    work, state = work_arrays(system), np.zeros(200)
    work.memory[system.actuators.codes[:, actuators.COMMAND]] = torques = [3e3, -1e3]
    work.pose[:, [0, 4, 8]] = 1.0
    axles = velocity_begin(system.bodies.kind.size) + 6 * system.actuators.body[:, 1] + 4
    state[axles] = speeds = [0.5, -2.0]
    which = np.zeros((4, controllers.SIGNAL_CODES), dtype=np.int64)
    which[:, controllers.GROUP], which[:, controllers.OBJECT] = controllers.ACTUATOR, [0, 1, 0, 1]
    torque, rate = element_outputs.MOMENT + 1, element_outputs.RATE + 4
    which[:, controllers.COMPONENT] = torque, torque, rate, rate
    system = system._replace(signals=system.signals._replace(codes=which))
    for module in (actuators, controllers):
        plain(module)
    found = [controllers.element_signal(system, work, state, i) for i in range(4)]
    assert found == pytest.approx([*torques, *speeds])


def test_noise_is_drawn_from_generators_of_full_period():
    """Each of the three goes through all numbers below its prime (Wichmann, Hill 1982)."""
    memory, found = np.ones(3), []
    for _ in range(30322):
        controllers.next_uniform.py_func(memory, 0)
        found.append(memory.copy())
    for k, prime in enumerate((30269, 30307, 30323)):
        assert np.flatnonzero(np.array(found)[:, k] == 1.0)[0] == prime - 2
