"""Laws of one's own: what they compute, when they are executed, how they fail."""

import ctypes
import os

import numpy as np
import pytest

import railsim
from railsim import laws
from railsim.definitions.elements.actuator import Actuator
from railsim.definitions.vehicle.laws import Controller, Law, Signal
from railsim.description.rest import describe_statics
from railsim.errors import InputError
from railsim.laws import binding

SOURCE = """
from math import nan


def half(x):
    return 0.5 * x


def damper(deflection, rate, c=30e3):
    return 2.0 * half(c * rate)


def maxwell(deflection, rate, state_f, c, k):
    return state_f, k * (rate - state_f / c)


def late(deflection, rate, time):
    return nan if time > 0.1 else 0.0


def raises(deflection, rate):
    if rate > 1.0:
        raise ValueError("too fast")
    return 0.0


def two(deflection, rate):
    return 0.0, 1.0


def words(deflection, rate):
    return str(rate)


def sky(time, v, c, memory):
    memory[0] += 1.0
    return -c * v


print("executed")
"""
PUSHED = {"carbody": {"vy": 0.3, "vroll": 0.1}, "front.inner.wheelset": {"y": 2e-3}}
SETTINGS = railsim.Settings(initial=PUSHED, outputs={"elements": ["push"]})
ENDS = {"bodies": ["carbody", "front.frame"], "points": [[9.5, 0.0, -0.9], [9.5, 0.9, -0.9]]}
WAY = {"speed": 20.0, "until": 10.0, "settings": SETTINGS}
SWAY = {"quantity": "velocity", "body": "carbody", "axis": "y"}
NAMES = ("damper", "maxwell", "late", "raises", "two", "words", "sky")


@pytest.fixture(autouse=True)
def nothing_permitted(monkeypatch):
    monkeypatch.delenv(laws.PERMITTED, raising=False)


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle("coach_manchester")


@pytest.fixture(scope="module")
def track():
    return railsim.load_track("curve_r250").with_values({"friction": 0.3})


def with_element(coach, element, **tables):
    known = {name: {"source": SOURCE, "file": "mine.py"} for name in NAMES}
    elements = {**dict(coach.elements), "push": {**ENDS, **element}}
    return coach.replace(elements=elements, laws=known, **tables)


def law(name, **parameters):
    return {"kind": "law", "law": name, "parameters": parameters}


def test_a_law_is_the_built_in_element(coach, track):
    """F = c v, as a spring_damper: to round-off."""
    laws.allow()
    own = railsim.simulate(with_element(coach, law("damper")), track, **WAY)
    damper = {"kind": "spring_damper", "damping": 30e3}
    built_in = railsim.simulate(with_element(coach, damper), track, **WAY)
    scale = np.max(np.abs(built_in["element_force"]))
    assert scale > 1e3
    assert np.allclose(own["element_force"], built_in["element_force"], atol=1e-9 * scale)


def test_states_of_a_law_are_integrated(coach, track):
    """A Maxwell damper by its differential equation; the reference scheme, order 4."""
    laws.allow()
    way = WAY | {"settings": SETTINGS.with_values({"scheme": "rk4"}), "until": 2.0}
    own = railsim.simulate(with_element(coach, law("maxwell", c=30e3, k=3e6)), track, **way)
    element = {"kind": "spring_damper", "damping": 30e3, "series_stiffness": 3e6}
    built_in = railsim.simulate(with_element(coach, element), track, **way)
    scale = np.max(np.abs(built_in["element_force"]))
    assert np.allclose(own["element_force"], built_in["element_force"], atol=1e-6 * scale)


def skyhook(coach, **signal):
    signals = {"sway": {**SWAY, **signal}}
    controllers = {
        "sky": {
            "law": "sky",
            "period": 0.005,
            "inputs": {"v": "sway"},
            "outputs": ["push"],
            "parameters": {"c": 20e3},
            "memory": 1,
        }
    }
    actuator = {"kind": "actuator"}
    return with_element(coach, actuator, signals=signals, controllers=controllers)


def test_a_controller_holds_what_it_read(coach, track):
    """Each command is the law of what the signal was, from the next step on."""
    laws.allow()
    settings = SETTINGS.with_values({"output_rate": 200.0})
    result = railsim.simulate(skyhook(coach), track, **WAY | {"settings": settings})
    body = result["body_velocity"][:, 0, 1]
    force = result["element_force"][:, 0, 0]
    assert result.attributes["step"] == 2.5e-3
    # an output stands at the begin of its step, before the command that follows from it
    assert np.allclose(force[1:], -20e3 * body[:-1], rtol=1e-12)


def test_all_commands_under_way_arrive(coach, track):
    """100 of them, one every 0.1 ms, each 10 ms after it was sent."""
    laws.allow()
    ramp = {"law": "ramp", "period": 1e-4, "outputs": ["push"]}
    vehicle = with_element(coach, {"kind": "actuator", "delay": 0.01}).replace(
        laws={"ramp": {"source": "def ramp(time):\n    return 1e3 * time\n", "file": "mine.py"}},
        controllers={"ramp": ramp},
    )
    sim = railsim.Simulation(vehicle, track, **WAY, record=False)
    for _ in range(5):
        sim.step(0.005)
        # a command is sent at the begin of the step before
        assert sim.read("element_command") == pytest.approx([max(0.0, 1e3 * (sim.time - 0.0101))],
                                                            abs=0.11)  # fmt: skip
    with pytest.raises(InputError, match=r"'push', which controllers\.ramp commands"):
        sim.set("push", 1.0)


@pytest.mark.parametrize(
    ("acts", "element", "axis", "allowed"),
    [
        ("line", "push", "y", "none or x"),
        ("line", "front.secondary_lateral_damper.left", "y", "none or x"),
        ("y", "push", None, "y"),
        ("roll", "push", None, "roll"),
        ("roll", "push", "x", "roll"),
    ],
)
def test_signals_of_an_element_are_those_of_its_axis(coach, track, acts, element, axis, allowed):
    """All others would be 0 for good."""
    signal = {"quantity": "rate", "element": element, "axis": axis}
    vehicle = with_element(coach, {"kind": "actuator", "acts": acts}, signals={"s": signal})
    words = rf"signals\.s\.axis: found {axis or 'none'}; {element} .*; {allowed}$"
    with pytest.raises(InputError, match=words):
        railsim.Simulation(vehicle, track, **WAY, record=False)


@pytest.mark.parametrize(
    ("values", "quantity", "axis", "allowed"),
    [
        ({"stiffness": [0.0, 1e6, 0.0]}, "force", "roll", "y"),
        (
            {"stiffness": [0.0, 1e6, 0.0], "rotational_stiffness": [0.0, 0.0, 1e4]},
            "force",
            None,
            "y or yaw",
        ),
        (
            {"stiffness": [1e6, 0.0, 0.0], "damping": [0.0, 0.0, 1e3]},
            "force",
            "y",
            "none or x or z",
        ),
        ({"stiffness": [0.0, 1e6, 0.0]}, "rate", "roll", None),
    ],
)
def test_forces_of_a_bushing_are_those_of_its_stiffness_and_damping(
    coach, track, values, quantity, axis, allowed
):
    signal = {"quantity": quantity, "element": "push", "axis": axis}
    vehicle = with_element(coach, {"kind": "bushing", **values}, signals={"s": signal})
    if allowed is None:
        assert railsim.Simulation(vehicle, track, **WAY, record=False).read("time") == 0.0
        return
    with pytest.raises(InputError, match=rf"axis: found {axis or 'none'}; push .*; {allowed}$"):
        railsim.Simulation(vehicle, track, **WAY, record=False)


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        (Signal, {"quantity": "time", "rate": 1e9}, "less than or equal to 1000000"),
        (Signal, {"quantity": "time", "rate": 1e3, "delay": 1e9}, "at most 1e6 samples"),
        (Signal, {"quantity": "time", "resolution": 1e-320}, "0 or at least 1e-15"),
        (Controller, {"inputs": {"time": "s"}}, "'time' of the function comes from the loop"),
        (Controller, {"inputs": {"memory": "s"}, "memory": 2}, "'memory' of the function comes"),
        (Controller, {"memory": 10**12}, "less than or equal to 1000000"),
        (Actuator, {"delay": 1e9}, "less than or equal to 100"),
    ],
)
def test_what_no_run_can_hold_or_end_is_refused(kind, values, words):
    """Each was a MemoryError or no end, or an input that was given and not taken."""
    given = {"law": "sky", "period": 0.01, "outputs": ["push"]} if kind is Controller else {}
    given |= {"kind": "actuator", **ENDS} if kind is Actuator else {}
    with pytest.raises(ValueError, match=words):
        kind.model_validate({**given, **values})


def test_a_controller_steps_as_it_runs(coach, track):
    laws.allow()
    vehicle = skyhook(coach, rate=100.0, delay=0.015, noise=0.01, resolution=1e-4)
    whole = railsim.simulate(vehicle, track, **WAY)
    with railsim.Simulation(vehicle, track, **WAY) as sim:
        sim.step(0.1)
        saved = sim.state
        while sim.step(0.05):
            pass
        stepped = sim.result()
    assert np.array_equal(whole["element_force"], stepped["element_force"])
    again = railsim.Simulation(vehicle, track, **WAY | {"until": 9.0}, record=False)
    again.state = saved
    again.step(0.1)
    at = int(np.argmin(np.abs(whole["time"] - again.time)))
    assert np.array_equal(again.read("element_force"), whole["element_force"][at])


def test_a_continued_run_has_the_bits_of_an_unbroken_one(coach, track):
    """Memory of a controller, commands under way, lag of the actuator, samples with noise."""
    laws.allow()
    sensor = {"rate": 150.0, "delay": 0.02, "noise": 0.01, "resolution": 1e-4}
    vehicle = skyhook(coach, **sensor).with_values(
        {"elements.push.lag": 0.05, "elements.push.delay": 0.013}
    )
    way = WAY | {"until": None}
    whole = railsim.simulate(vehicle, track, **way, duration=0.6)
    first = railsim.simulate(vehicle, track, **way, duration=0.3)
    second = railsim.simulate(vehicle, track, settings=SETTINGS, resume=first, duration=0.3)
    again = railsim.simulate(**second.inputs())
    assert np.max(np.abs(second["element_force"])) > 100.0
    for name in ("element_force", "Q", "body_position"):
        assert np.array_equal(second[name], whole[name][-len(second[name]) :])
        assert np.array_equal(second[name], again[name])


def test_signals_are_sampled_late_and_in_steps(coach, track):
    """Sample k is the value at k T, known after the delay; noise has its deviation.

    That of two signals is independent, also where both have one seed.
    """
    plain = skyhook(coach)
    signals = {
        "now": SWAY,
        "late": {**SWAY, "rate": 100.0, "delay": 0.03},
        "coarse": {**SWAY, "resolution": 0.01},
        "loud": {"quantity": "time", "rate": 500.0, "noise": 2.0, "seed": 3},
        "other": {"quantity": "time", "rate": 500.0, "noise": 2.0, "seed": 3},
    }
    vehicle = plain.replace(signals=signals, controllers=None)
    sim = railsim.Simulation(vehicle, track, **WAY | {"until": 60.0}, record=False)
    seen = []
    while sim.time < 2.4:
        sim.step(0.005)
        seen.append([sim.time, *(sim.read(name) for name in signals)])
    time, now, late, coarse, loud, other = np.array(seen).T
    assert np.allclose(coarse, 0.01 * np.round(now / 0.01), atol=1e-9)
    whole = np.isclose(time * 100.0, np.round(time * 100.0), atol=1e-6)
    assert np.allclose(late[whole][3:], now[whole][:-3], atol=1e-12)
    noise = loud - time
    assert abs(np.std(noise) - 2.0) < 0.25
    assert abs(np.mean(noise)) < 0.3
    assert abs(np.corrcoef(noise, other - time)[0, 1]) < 4.0 / np.sqrt(len(time))


def test_values_that_are_not_finite_end_the_run(coach, track):
    laws.allow()
    result = railsim.simulate(with_element(coach, law("late")), track, **WAY)
    assert result.status == "stopped"
    reason = result.attributes["status_reason"]
    assert reason.startswith("the law of element push gave a value that is not finite at 0.1")
    assert len(result["time"]) > 10


@pytest.mark.parametrize(
    ("element", "words"),
    [
        (law("raises"), r"mine.py: line 23: the law 'raises' cannot 'raise' an error"),
        (law("two"), "the law 'two' returns 2 values; 1 as a force element"),
        (law("words"), "the law 'words' (returns|cannot be compiled)"),
        (law("maxwell", c=1.0), "no value for 'k', an argument of the law 'maxwell'"),
        (law("damper", d=1.0), "the law 'damper' has no argument 'd'; allowed: c"),
        (law("demper"), "no law 'demper'"),
    ],
)
def test_faults_are_one_line(coach, track, element, words):
    laws.allow()
    with pytest.raises(InputError, match=words) as raised:
        railsim.simulate(with_element(coach, element), track, **WAY)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("key", "value", "of"),
    [
        ("position", [0.0, 0.0, -1.0], "displacement, velocity, acceleration"),
        ("axis", "y", "displacement, velocity, acceleration, angle, .*power"),
        ("ahead", 20.0, "curvature, cant_angle"),
    ],
)
def test_keys_of_a_signal_that_its_quantity_does_not_use_are_refused(key, value, of):
    wheel = {"quantity": "Q", "wheelset": "axle", "side": "left", key: value}
    with pytest.raises(ValueError, match=f"'{key}' belongs to {of} and only to them"):
        Signal.model_validate(wheel)


def test_the_file_of_a_law_named_in_python_is_not_read(coach, track):
    vehicle = with_element(coach, law("damper")).replace(laws={"damper": {"file": "mine.py"}})
    with pytest.raises(InputError, match=r"mine\.py: damper: .* in a file that has not been read"):
        railsim.simulate(vehicle, track, **WAY, allow_code=True)


@pytest.mark.parametrize(
    ("name", "signal"),
    [
        ("Q", {"quantity": "Q", "wheelset": "front.outer.wheelset", "side": "left"}),
        ("element_force", {"quantity": "speed"}),
        ("half_way", {"quantity": "speed"}),
        ("distance", {"quantity": "time"}),
    ],
)
def test_a_signal_hides_no_quantity_of_its_name(coach, track, name, signal):
    own = {"half_way": {"law": "half", "inputs": {"x": "distance"}}}
    half = {"half": {"source": SOURCE, "file": "mine.py"}}
    settings = railsim.Settings(outputs={"own": own}, laws=half)
    vehicle = coach.replace(signals={name: signal})
    with pytest.raises(InputError, match=f"signals.{name}: the name of a quantity of results"):
        railsim.Simulation(vehicle, track, speed=20.0, settings=settings)


def test_a_signal_may_have_the_name_of_what_it_measures(coach, track):
    vehicle = coach.replace(signals={"distance": {"quantity": "distance"}})
    with railsim.Simulation(vehicle, track, speed=20.0, until=1.0) as sim:
        sim.step(0.01)
        assert sim.read("distance") == sim.distance


def test_a_step_that_is_given_is_kept_or_refused(coach, track):
    """1 ms does not divide 2.5 ms between samples, and is longer than 0.5 ms."""
    settings = railsim.Settings(step=1e-3)
    signal = {"quantity": "speed", "rate": 400.0}
    vehicle = coach.replace(signals={"v": signal})
    sim = railsim.Simulation(vehicle, track, speed=20.0, settings=settings)
    assert sim.step_length == 1e-3
    vehicle = coach.replace(signals={"v": {**signal, "rate": 2000.0}})
    words = r"v.rate: found 2000 1/s, faster than the step.*; 1000 1/s at most"
    with pytest.raises(InputError, match=words):
        railsim.Simulation(vehicle, track, speed=20.0, settings=settings)


def test_a_late_signal_stands_for_the_quantity_of_its_name(coach, track):
    """Of 20 samples a second 0.1 s late: after 0.32 s that of 0.2 s is known, 4 m at 20 m/s."""
    late = {"quantity": "distance", "rate": 20.0, "delay": 0.1}
    vehicle = coach.replace(signals={"distance": late})
    with railsim.Simulation(vehicle, track, speed=20.0, until=10.0) as sim:
        sim.step(0.32)
        assert sim.read("distance") == pytest.approx(4.0, abs=20.0 * sim.step_length)
        assert sim.distance == pytest.approx(6.4, abs=0.1)


CONTROLLER = binding.Takes("a controller", ("time",), ("v",))


@pytest.mark.parametrize(
    ("returned", "given"),
    [
        ("10.0 * v + w", [32.0, 32.0, 32.0]),  # one value is for all
        ("(v, w, time)", [3.0, 2.0, 0.5]),
        ("(v, w)", [np.nan] * 3),
    ],
)
def test_a_controller_of_three_actuators_gives_one_value_or_three(returned, given):
    """Called as Python: a block of what it gives, the time, and its inputs in their order."""
    source = f"def x(w, time, v):\n    return {returned}"
    laws.allow(source)
    takes = binding.Takes("a controller", ("time",), ("v", "w"))
    bound = binding.bind("x", Law(source=source, file="mine.py", compiled=False), takes, 3)
    block = np.array([9.0, 9.0, 9.0, 0.5, 3.0, 2.0])
    ctypes.CFUNCTYPE(None, ctypes.c_void_p)(bound.address)(block.ctypes.data)
    np.testing.assert_array_equal(block, [*given, 0.5, 3.0, 2.0])


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("def x(time):\n    return 0.0", "has no argument 'v'; arguments: time"),
        ("def x(v):\n    pass", "returns none; a number"),
        ("def x(v):\n    assert v\n    return v", "line 2: .* cannot 'assert' an error"),
        ("def x(v):\n    return q", "line 2: .* cannot be compiled: NameError: name 'q' is not"),
        ("def x(v, c='a'):\n    return v", "has 'c' = 'a'; a finite number"),
        ("def x(v, memory):\n    return v", "has an argument 'memory' but no key of this name"),
        ("def y(v):\n    return v", "is no function 'x' of this file; allowed: y"),
        ("raise SystemExit(7)", "line 1: .* fails when it is read: SystemExit: 7"),
        ("def half(n):\n    return n / 0\nk = half(1)", "line 2: .* is read: ZeroDivisionError"),
        ("n = 0\ndef x(v):\n    global n\n    n += 1\n    return v", "cannot be compiled"),
    ],
)
def test_wrong_laws_are_one_line(source, words):
    laws.allow(source)
    with pytest.raises(InputError, match=words) as raised:
        binding.bind("x", Law(source=source, file="mine.py"), CONTROLLER)
    assert str(raised.value).startswith("mine.py: ")
    assert len(str(raised.value).splitlines()) == 1
    assert "\x1b" not in str(raised.value)


def test_an_index_beyond_the_memory_ends_the_run(coach, track):
    """And does not write where it must not."""
    source = "def sky(time, v, c, memory):\n    memory[int(time > 0.1)] = v\n    return -c * v\n"
    laws.allow(source)
    vehicle = skyhook(coach).with_values({"laws.sky.source": source})
    result = railsim.simulate(vehicle, track, **WAY)
    reason = result.attributes["status_reason"]
    assert reason.startswith("controller sky gave a value that is not finite at 0.1")


def test_nothing_is_executed_without_permission(coach, track, capsys, monkeypatch):
    vehicle = with_element(coach, law("damper"))
    assert vehicle.to_toml().count("executed") == len(NAMES)
    railsim.describe(vehicle)
    describe_statics(vehicle)
    with pytest.raises(InputError, match=r"'damper' is code of mine.py.*--allow-code"):
        railsim.simulate(vehicle, track, **WAY)
    assert "executed" not in capsys.readouterr().out
    binding._bound.cache_clear()
    laws.allow(SOURCE)
    railsim.Simulation(vehicle, track, **WAY)
    assert "executed" in capsys.readouterr().out
    monkeypatch.delenv(laws.PERMITTED)
    railsim.Simulation(vehicle, track, **WAY, allow_code=True)
    assert laws.PERMITTED not in os.environ
    laws.allow(SOURCE)
    laws.allow("other")
    assert os.environ[laws.PERMITTED].count(",") == 1


def test_a_controller_faster_than_the_step_of_the_settings(coach, track):
    laws.allow()
    settings = SETTINGS.with_values({"step": 0.00125, "output_rate": 100.0})
    vehicle = skyhook(coach).with_values({"controllers.sky.period": 0.001})
    with pytest.raises(InputError, match=r"controllers.sky.period: found 0.001 s, shorter"):
        railsim.simulate(vehicle, track, **WAY | {"settings": settings})
    free = railsim.Simulation(vehicle, track, **WAY)
    assert free.step_length == pytest.approx(0.001)
    with pytest.raises(InputError, match=r"controllers.sky.period: 1e-09; must be greater"):
        vehicle.with_values({"controllers.sky.period": 1e-9})  # its run would not end


def shen_hedrick_elkins(xi_x, xi_y, phi, a, b, mu_N, c11, c22, c23, c33, G):
    size = sqrt(a * b)  # noqa: F821 - of math
    x = G * a * b * c11 * xi_x
    y = G * a * b * (c22 * xi_y + size * c23 * phi)
    m = G * a * b * size * (size * c33 * phi - c23 * xi_y)
    arm = 0.5 * 0.6**2 * (a * a + b * b)
    u = sqrt(x * x + y * y + (G * a * b * phi) ** 2 * c11 * c22 * arm) / mu_N  # noqa: F821
    factor = 1.0 / u if u >= 3.0 else 1.0 - u / 3.0 + u * u / 27.0
    return factor * x, factor * y, factor * m


def falling(slip, speed, rest, decay=0.6):
    return (1.0 - rest) * math.exp(-decay * slip) + rest  # noqa: F821


def test_creep_and_friction_laws_are_the_built_in_ones(coach, track):
    """Linear theory bent after Shen, Hedrick, Elkins; friction after Polach: to round-off."""
    plain = railsim.Settings(initial=PUSHED, creep_law="linear")
    own = plain.replace(
        laws={"bent": laws.law(shen_hedrick_elkins), "falling": laws.law(falling)},
        own_creep_law={"law": "bent"},
        own_friction={"law": "falling", "parameters": {"rest": 0.4}},
    )
    slippery = track.with_values({"friction_falling.rest": 0.4, "friction_falling.decay": 0.6})
    expected = railsim.simulate(coach, slippery, **WAY | {"settings": plain})
    found = railsim.simulate(coach, track, **WAY | {"settings": own})
    assert np.max(np.abs(expected["Y"])) > 1e3
    assert np.allclose(found["Y"], expected["Y"], atol=1e-5)


def test_python_without_compiling(coach, track):
    """The same forces; an error within ends the run."""
    compiled = railsim.simulate(with_element(coach, law("damper")), track, **WAY, allow_code=True)
    slow = with_element(coach, law("damper")).with_values({"laws.damper.compiled": False})
    plain = railsim.simulate(slow, track, **WAY, allow_code=True)
    scale = np.max(np.abs(compiled["element_force"]))
    assert np.allclose(plain["element_force"], compiled["element_force"], atol=1e-9 * scale)
