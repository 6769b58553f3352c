"""`railsim.Simulation`: the run of `simulate`, step by step; actuators, states, faults."""

import pickle

import numpy as np
import pytest

import railsim
from railsim.errors import InputError
from railsim.simulation import advance, stepping
from railsim.simulation.conditions import own_speed

STEP = 1.0 / 600.0
ACTUATOR = {
    "kind": "actuator",
    "bodies": ["carbody", "front.frame"],
    "points": [[9.5, 0.0, -0.9], [9.5, 0.9, -0.9]],
    "lag": 0.05,
}


@pytest.fixture(scope="module")
def coach():
    return railsim.load_vehicle("coach_manchester")


@pytest.fixture(scope="module")
def track():
    return railsim.load_track("curve_r250").with_values({"friction": 0.3})


def commanded(coach, **more):
    """The coach with a lateral actuator between car body and front frame."""
    elements = {**dict(coach.elements), "push": {**ACTUATOR, **more}}
    return coach.replace(elements=elements)


PUSHED = {"carbody": {"vy": 0.3, "vroll": 0.1}, "front.inner.wheelset": {"y": 2e-3}}
"""Initial motion: the vehicle sways, and its wheelsets run from side to side."""
DISTURBED = railsim.Settings(initial=PUSHED)
SETTINGS = railsim.Settings(initial=PUSHED, outputs={"elements": ["push"]})


def equal(one, other):
    return [q for q in one if not np.array_equal(one[q], other[q], equal_nan=True)]


@pytest.mark.parametrize("dt", [None, 7 * STEP, 0.05, 1.7, 0.00213, 0.05003])
def test_the_bits_of_simulate(coach, track, dt):
    """Also where a call ends within a step."""
    way = {"speed": 20.0, "until": 40.0, "settings": DISTURBED}
    whole = railsim.simulate(coach, track, **way)
    with railsim.Simulation(coach, track, **way) as sim:
        while sim.step(dt):
            pass
        stepped = sim.result()
    assert equal(whole, stepped) == []
    peaks, others = whole.groups["peaks"], stepped.groups["peaks"]
    assert [n for n in peaks if not np.array_equal(peaks[n], others[n], equal_nan=True)] == []
    assert stepped.status == "complete"
    assert stepped.attributes["steps"] == whole.attributes["steps"]


def test_calls_that_end_within_a_step_change_nothing_of_what_steps_remember(coach, track):
    """Such as the vibrations of wheel loads from step to step, which end in a remark."""
    remembered = []
    for dt in (5 * STEP, 0.3 * STEP):
        with railsim.Simulation(coach, track, speed=20.0, until=2.0, settings=DISTURBED) as sim:
            while sim.time < 20.0 * STEP - 1e-9:
                sim.step(min(dt, 20.0 * STEP - sim.time))
            remembered.append(sim.state.counted)
    for whole, parts in zip(*remembered, strict=True):
        np.testing.assert_array_equal(parts, whole)


@pytest.mark.parametrize("dt", [3 * STEP, 5 * STEP, 11 * STEP])
def test_the_bits_of_simulate_where_the_recorder_is_full_between_two_outputs(
    coach, track, dt, monkeypatch
):
    way = {"speed": 20.0, "until": 4.0, "settings": DISTURBED}
    whole = railsim.simulate(coach, track, **way)
    for module in (advance, stepping):
        monkeypatch.setattr(module, "ROWS", 4)
    with railsim.Simulation(coach, track, **way) as sim:
        while sim.step(dt):
            pass
        assert equal(whole, sim.result()) == []


@pytest.mark.parametrize(
    "drive",
    [
        {"mode": "table", "speed_table": [[0.0, 15.0], [100.0, 20.0]]},
        {"mode": "free", "resistance": [20e3, 0.0, 0.0]},
    ],
)
@pytest.mark.parametrize("spacing", [None, 0.25])
def test_changing_speed_has_the_same_bits(coach, track, drive, spacing):
    settings = railsim.Settings(drive=drive, output_spacing=spacing, initial=PUSHED)
    way = {"speed": 15.0, "until": 6.0, "settings": settings}
    whole = railsim.simulate(coach, track, **way)
    with railsim.Simulation(coach, track, **way) as sim:
        while sim.step(0.0123):
            pass
        stepped = sim.result()
    assert equal(whole, stepped) == []


@pytest.mark.parametrize("dt", [0.1048, 0.0349])
@pytest.mark.parametrize("end", [{"until": 1.57}, {"duration": 0.1047}])
@pytest.mark.parametrize("record", [True, False])
def test_the_bits_of_simulate_where_the_run_ends_within_a_step(coach, track, dt, end, record):
    """The end lies ahead of an output, at 0.105 s: that and the peaks hold the whole last step."""
    way = {"speed": 15.0, "settings": DISTURBED, **end}
    whole = railsim.simulate(coach, track, **way)
    with railsim.Simulation(coach, track, record=record, **way) as sim:
        while sim.step(dt):
            pass
        stepped = sim.result()
    assert whole["time"][-1] == pytest.approx(0.105)
    assert not record or equal(whole, stepped) == []
    peaks, others = whole.groups["peaks"], stepped.groups["peaks"]
    assert [n for n in peaks if not np.array_equal(peaks[n], others[n], equal_nan=True)] == []


def test_what_is_read_is_what_is_recorded(coach, track):
    with railsim.Simulation(coach, track, speed=20.0, settings=DISTURBED) as sim:
        sim.step(0.5)
        seen = {name: sim.read(name) for name in ("time", "Q", "Y", "body_acceleration")}
        sim.step(0.5)
        result = sim.result()
    at = int(np.argmin(np.abs(result["time"] - seen["time"])))
    for name, value in seen.items():
        assert np.array_equal(result[name][at], value)


def test_all_that_is_readable_can_be_read_before_the_first_step(coach, track):
    with railsim.Simulation(coach, track, speed=20.0, duration=0.1) as sim:
        seen = {name: sim.read(name) for name in sim.readable}
        while sim.step():
            pass
        result = sim.result()
    assert {"Q", "Q0", "time"} <= seen.keys()
    for name, value in seen.items():
        recorded = result[name]
        assert np.array_equal(recorded if name == "Q0" else recorded[0], value), name


def test_a_state_restored_has_the_same_bits(coach, track):
    vehicle = commanded(coach, delay=0.03)
    sim = railsim.Simulation(vehicle, track, speed=20.0, settings=DISTURBED, record=False)
    sim.step(0.1)
    sim.set("push", 5e3)
    sim.step(0.0107)
    with pytest.raises(TypeError, match="its `state` can"):
        pickle.dumps(sim)
    saved = pickle.loads(pickle.dumps(sim.state))

    def onwards():
        for k in range(20):
            sim.set("push", 1e3 * k)
            sim.step(0.0113)
        return sim.state

    first = onwards()
    sim.state = saved
    second = onwards()
    assert pickle.dumps(first) == pickle.dumps(second)
    other = railsim.Simulation(vehicle, track, speed=20.0, settings=DISTURBED, record=False)
    other.state = saved
    sim = other
    assert np.array_equal(onwards().motion, first.motion)


def test_peaks_of_what_was_given_up_are_not_those_of_the_run(coach, track):
    """Before the evaluation begins at 0.1 s, and after: a strong push, taken back."""
    vehicle, way = commanded(coach, lag=0.0), {"speed": 20.0, "duration": 1.0, "record": False}
    plain, other = (railsim.Simulation(vehicle, track, **way) for _ in range(2))
    plain.step(0.05)
    other.step(0.05)
    saved = other.state
    other.set("push", 50e3)
    other.step(0.2)
    other.state = saved
    assert plain.result().groups["peaks"]["Q"] == pytest.approx(other.result().groups["peaks"]["Q"])


def test_a_state_of_another_vehicle_changes_nothing(coach, track):
    """Vehicles of as many coordinates: commands on their way belong to the state as well."""
    way = {"speed": 20.0, "record": False}
    late = railsim.Simulation(commanded(coach, delay=0.03), track, **way)
    sim = railsim.Simulation(commanded(coach), track, **way)
    late.step(0.01)
    before = sim.state.motion
    with pytest.raises(InputError, match="those of this vehicle and track"):
        sim.state = late.state
    assert np.array_equal(sim.state.motion, before)


def test_a_longer_run_goes_on_from_the_end_of_a_shorter_one(coach, track):
    way = {"speed": 20.0, "settings": DISTURBED, "record": False}
    short = railsim.Simulation(coach, track, duration=0.05, **way)
    while short.step(0.04):
        pass
    assert short.time == pytest.approx(0.05, abs=STEP)
    longer = railsim.Simulation(coach, track, duration=1.0, **way)
    longer.state = short.state
    assert longer.step(0.05)
    assert longer.time == pytest.approx(short.time + 0.05, abs=1e-9)


def test_lag_and_delay_of_an_actuator(coach, track):
    """F = F_0 (1 - exp(-(t - t_0 - delay)/lag)), exactly: the command is constant."""
    vehicle = commanded(coach, delay=0.035)
    with railsim.Simulation(vehicle, track, speed=20.0, duration=0.5, settings=SETTINGS) as sim:
        sim.step(0.1)
        sim.set("push", 4e3)
        while sim.step(0.05):
            pass
        result = sim.result()
    late = np.maximum(0.0, result["time"] - 0.1 - 0.035)
    force = result["element_force"][:, 0, 0]
    assert np.allclose(force, 4e3 * (1.0 - np.exp(-late / 0.05)), atol=1e-6)


@pytest.mark.parametrize("given", [3e3, 0.0])
def test_a_result_with_commands_says_that_its_inputs_do_not_give_it(coach, track, given):
    """A command of 0 is that of the begin; it changes nothing."""
    way = {"speed": 20.0, "duration": 0.3, "settings": SETTINGS}
    with railsim.Simulation(commanded(coach), track, **way) as sim:
        for _ in range(2):
            sim.set("push", given)
            sim.step(0.1)
        found = sim.result()
    again = railsim.simulate(**found.inputs())
    n = len(found.time)
    same = np.array_equal(again["element_force"][:n], found["element_force"])
    assert same == (given == 0.0)
    said = [words for words in found.remarks if "stored inputs alone" in words]
    assert len(said) == (not same)


@pytest.mark.parametrize(
    ("limit", "expected"), [({"rate_limit": 20e3}, 20e3 * 0.1), ({"force_limit": 1.5e3}, 1.5e3)]
)
def test_limits_of_an_actuator(coach, track, limit, expected):
    vehicle = commanded(coach, **({"lag": 1e-3} | limit))
    with railsim.Simulation(vehicle, track, speed=20.0, duration=0.2, settings=SETTINGS) as sim:
        sim.step(0.1)
        sim.set("push", 4e3)
        sim.run()
        force = sim.result()["element_force"][-1, 0, 0]
    assert force == pytest.approx(expected, rel=1e-3)


def test_a_commanded_damper_is_a_damper(coach, track):
    """One command, one damper of the same constant: within what the lag's absence leaves."""
    damper = {**ACTUATOR, "kind": "spring_damper", "damping": 30e3}
    del damper["lag"]
    passive = coach.replace(elements={**dict(coach.elements), "push": damper})
    way = {"speed": 20.0, "until": 30.0, "settings": SETTINGS}
    expected = railsim.simulate(passive, track, **way)
    with railsim.Simulation(commanded(coach, lag=0.0, command="damper"), track, **way) as sim:
        sim.set("push", 30e3)
        sim.run()
        found = sim.result()
    scale = np.max(np.abs(expected["element_force"]))
    assert scale > 100.0
    assert np.allclose(expected["element_force"], found["element_force"], atol=1e-6 * scale)


def test_mirrored_commands_have_the_mirrored_effect(coach, track):
    """An actuator along y on both sides: one command each, opposite motions of the car body."""
    across = {**ACTUATOR, "acts": "y", "sides": "both", "lag": 0.0}
    vehicle = coach.replace(elements={**dict(coach.elements), "push": across})
    found = []
    for side in ("left", "right"):
        sim = railsim.Simulation(vehicle, track, speed=20.0, record=False)
        sim.set(f"push.{side}", 10e3)
        sim.step(0.3)
        found.append(sim.read("body_position")[0])
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    assert abs(found[0][1]) > 1e-5
    assert np.allclose(found[0], signs * found[1], atol=1e-9)


def test_faults_are_one_line_each(coach, track):
    vehicle = commanded(coach)
    sim = railsim.Simulation(vehicle, track, speed=20.0, duration=0.1)
    for wrong, words in (
        (lambda: sim.set("pusch", 1.0), "no actuator 'pusch'.*push"),
        (lambda: sim.set("push", float("nan")), "value: found nan"),
        (lambda: sim.set("push", "3"), "value: found '3' for 'push'; a finite number"),
        (lambda: sim.set("push", None), "value: found None for 'push'; a finite number"),
        (lambda: sim.set(None, 1.0), "no actuator 'None'"),
        (lambda: sim.read(None), "nothing is called 'None'"),
        (lambda: sim.step(-1.0), "dt: found -1.0 s"),
        (lambda: sim.read("R"), "nothing is called 'R'"),
        (lambda: sim.run(until=5.0, duration=1.0), "duration: given together with `until`"),
        (lambda: sim.read("element_force"), "settings.outputs"),
    ):
        with pytest.raises(InputError, match=words):
            wrong()
    sim.run()
    with pytest.raises(InputError, match=r"the run has ended at 0\.1"):
        sim.step()
    for record in (True, False):
        sim = railsim.Simulation(vehicle, track, speed=20.0, duration=0.1, record=record)
        with pytest.raises(InputError, match="until: found nan"):
            sim.run(until=float("nan"))
        sim.step(0.0107)
        assert sim.result().status == "complete"
        for late, given in ((sim.step, [0.01]), (sim.set, ["push", 1.0]), (sim.set_rails, [0, 0])):
            with pytest.raises(InputError, match="its result has been taken"):
                late(*given)
    passive = railsim.Simulation(coach, track, speed=20.0, duration=0.1)
    with pytest.raises(InputError, match="the vehicle has none"):
        passive.set("push", 1.0)


@pytest.mark.parametrize(
    ("displacement", "velocity", "words"),
    [
        (1e-3, np.zeros((3, 2, 2)), r"velocity: \(3, 2, 2\) values"),
        (np.full((4, 2, 2), np.nan), 0.0, "displacement: .* not finite"),
    ],
)
def test_rails_that_are_not_wheels_or_numbers_do_not_move(
    coach, track, displacement, velocity, words
):
    rigid = track.replace(support={"preset": "rigid"})
    sim = railsim.Simulation(coach, rigid, speed=20.0, duration=0.1, record=False)
    with pytest.raises(InputError, match=words):
        sim.set_rails(displacement, velocity)
    assert not np.any(sim.state.counted[-2])


def test_wheelsets_are_seen_against_rails_that_were_moved(coach, track):
    """By 3 and 1 mm to the right, 1 mm up on the left and 2 mm down on the right."""
    rigid = track.replace(support={"preset": "rigid"})
    asked = railsim.Settings(outputs={"track": True})
    rails = np.tile([[3e-3, -1e-3], [1e-3, 2e-3]], (4, 1, 1))
    sim = railsim.Simulation(coach, rigid, speed=20.0, duration=0.05, settings=asked)
    with sim:
        sim.set_rails(rails, 0.0)
        seen = sim.read("wheelset_roll")
        sim.run()
        run = sim.result()
    lean = (2e-3 + 1e-3) / 1.5
    np.testing.assert_allclose(run.wheelset_roll, run.wheelset_roll_on_track - lean, atol=1e-12)
    np.testing.assert_array_equal(run.wheelset_roll[0], seen)
    radius = 0.46
    across = run.wheelset_lateral_on_track - 2e-3 - lean * radius
    np.testing.assert_allclose(run.wheelset_lateral, across, atol=lean * 3e-3)
    for i, name in enumerate(("lateral", "vertical")):
        moved = np.broadcast_to(rails[:, :, i], run.Q.shape)
        np.testing.assert_array_equal(run[f"rail_deflection_{name}"], moved)
    most = run.groups["peaks"]["wheelset_roll"]
    assert np.all(most[0] >= run.wheelset_roll.max(axis=0) - 1e-12)
    assert np.all(most[1] <= run.wheelset_roll.min(axis=0) + 1e-12)


def test_a_file_is_there_when_whole(coach, track, tmp_path):
    path = tmp_path / "run.h5"
    way = {"speed": 20.0, "duration": 0.1, "record": path}
    with pytest.raises(KeyboardInterrupt), railsim.Simulation(coach, track, **way):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with railsim.Simulation(coach, track, **way) as sim:
        sim.run()
    assert railsim.open_result(path).status == "complete"


def test_a_wheelset_is_ahead_by_its_own_way_in_the_vehicle(coach, track):
    """Put 5 mm forwards; the axles are 10.78 and 8.22 m from the middle of the car."""
    settings = railsim.Settings(initial={"front.inner.wheelset": {"x": 5e-3}})
    run = railsim.simulate(coach, track, speed=20.0, duration=0.02, settings=settings)
    places, rest = run["wheelset_distance"] - run["distance"][:, None], [10.78, 8.22, -8.22, -10.78]
    assert places[0] == pytest.approx([10.78, 8.225, -8.22, -10.78], abs=1e-4)
    wheelsets = [run.coordinates["body"].index(name) for name in run.coordinates["wheelset"]]
    assert places == pytest.approx(rest + run["body_position"][:, wheelsets, 0], abs=1e-6)


def test_counts_of_a_run_are_those_of_its_time(coach, track):
    """0.3 s in equal steps of a constant speed, and 0.3 s further on."""
    way = {"speed": 20.0, "duration": 0.3}
    first = railsim.simulate(coach, track, **way)
    second = railsim.simulate(coach, track, duration=0.3, resume=first)
    assert second["time"][0] == pytest.approx(0.3)
    assert_counted(first.attributes)
    assert_counted(second.attributes)


def assert_counted(facts):
    assert facts["duration"] == pytest.approx(0.3, rel=1e-9)
    assert facts["real_time_factor"] * facts["cpu_time"] == pytest.approx(0.3, rel=1e-9)
    assert 0.0 < facts["cpu_time"] <= facts["wall_time"]
    assert facts["steps"] * facts["step"] == pytest.approx(0.3, rel=1e-9)


def test_a_run_that_goes_on_takes_speed_and_place_of_its_state():
    """They may be given too, if they are the same."""
    state = np.array([0.1, 0.2, 340.0, 20.0])  # ..., place, speed
    for given in ((None, 0.0), (20.0, 340.0), ("72 km/h", 0.0), (None, 340.0)):
        assert own_speed(state, *given) == (20.0, 340.0)
    for given, word in (((20.1, 0.0), "speed"), ((None, 340.1), "start"), ((0.0, 340.0), "speed")):
        with pytest.raises(InputError, match=f"{word}: given together with `resume`"):
            own_speed(state, *given)
