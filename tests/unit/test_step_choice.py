"""The step of a run: judged for a class of runs, whatever was judged before."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from railsim.definitions.loading import load_track, load_vehicle
from railsim.definitions.settings import Settings
from railsim.errors import InputError
from railsim.kernels.track_frame import MU_LEFT, MU_RIGHT
from railsim.model.assembly import assemble
from railsim.model.work import level_track_with_friction
from railsim.simulation import step_choice
from railsim.simulation.preparation import prepare


@pytest.mark.parametrize(
    ("name", "step"),
    [
        ("coach_manchester", 2.5e-3),
        ("coach_flexicoil", 5e-3 / 3.0),  # 2.5 ms: unstable on straight track at any speed
    ],
)
def test_runs_of_a_class_share_a_judgement_in_any_order(name, step, monkeypatch):
    vehicle, track = load_vehicle(name), load_track("curve_r250")
    judged = []

    def settled(model, track, state, step, progress):
        judged.append((float(state[-1]), float(model.system.track.rail[0, 4, 0])))
        return []

    def steps(frictions):
        monkeypatch.setattr(step_choice, "_JUDGED", {})
        judged.clear()
        runs = {mu: track.replace(friction=(mu, mu)) for mu in frictions}
        return {
            mu: prepare(vehicle, run, Settings(), 20.0, duration=1.0).steps.at(20.0)
            for mu, run in runs.items()
        }

    monkeypatch.setattr(step_choice, "in_flange_contact", settled)
    forwards = steps([0.21, 0.28, 0.35])
    assert [found for found, _ in forwards.values()] == pytest.approx(3 * [step])
    # one judgement for two runs, at the lowest speed and highest friction of their class
    assert judged == [pytest.approx((1.2**16, 0.3)), pytest.approx((1.2**16, 0.4))]
    assert steps([0.35, 0.28, 0.21]) == forwards
    assert len(judged) == 2


ROUGH = [{"type": "random", "spectrum": "erri_b176_low"}]
DIP = [{"type": "dip", "rail": "left", "s": 20.0, "length": 1.0, "depth": 0.002}]


@pytest.mark.parametrize(
    ("speed", "changes", "step"),
    [
        (20.0, {}, 5e-3 / 3.0),  # the stiffness of the contact is implicit
        (40.0, {"irregularities": ROUGH}, 5e-3 / 3.0),  # which the smoothed accelerations follow
        (20.0, {"irregularities": DIP}, 1.25e-3),  # a wheel rings on its contact
        (20.0, {"irregularities": [{**ROUGH[0], "wavelengths": [1.0, 25.0]}]}, 1.25e-3),
        (43.0, {"irregularities": ROUGH}, 1.25e-3),  # above the critical speed
    ],
)
def test_longer_steps_on_rigid_rails_below_the_critical_speed(speed, changes, step):
    track = load_track("straight").replace(support={"preset": "rigid"}, **changes)
    vehicle = load_vehicle("coach_manchester")
    steps = prepare(vehicle, track, Settings(), speed, duration=1.0).steps
    assert steps.at(speed)[0] == pytest.approx(step)


def test_a_run_that_brakes_has_a_step_until_the_loop_finds_it_at_a_standstill():
    """There is no steady rolling at 0.05 m/s; outputs need not fall on the moment before."""
    settings = Settings.model_validate({"drive": {"mode": "free"}})
    track = load_track("straight")
    steps = prepare(load_vehicle("coach_manchester"), track, settings, 1.0, duration=1.0).steps
    assert steps.at(0.0497) == steps.at(0.051)


def test_step_of_a_class_is_the_same_wherever_a_run_of_changing_speed_enters_it(monkeypatch):
    """Outputs every 0.25 m are 13.9 to 15.6 ms apart; a run that is continued begins anywhere."""

    def longest(self, speed, interval):
        return interval / math.ceil(interval / 2.1e-3)

    monkeypatch.setattr(step_choice.StepChoice, "_choose", longest)
    settings = Settings(
        drive={"mode": "table", "speed_table": [[0.0, 18.0], [300.0, 16.0]]}, output_spacing=0.25
    )
    found = []
    for first in (18.0, 17.5, 17.01, 16.0):
        vehicle, track = load_vehicle("coach_manchester"), load_track("straight")
        steps = prepare(vehicle, track, settings, first, duration=1.0).steps
        found.append(steps.at(17.4)[1])
    assert found == 4 * [8]


def test_dry_friction_is_followed_in_short_steps():
    """Stable at 2.5 ms, where sum_Y in R 250 m is off by 3.8 % from RK4; here 1 %."""
    vehicle, track = load_vehicle("wagon_uic_link_empty"), load_track("straight")
    steps = prepare(vehicle, track, Settings(), 15.0, duration=1.0).steps
    assert steps.at(15.0)[0] == pytest.approx(1.25e-3)


def test_step_follows_dampers_that_are_steeper_away_from_rest():
    """Two of c on a frame of the mass m: Adams and Bashforth's method is stable to h 2 c/m = 1."""
    coach, c = load_vehicle("coach_manchester"), 0.8e6
    bogie = coach.assemblies["bogie"].model_dump(exclude_none=True)
    damper = bogie["elements"]["secondary_lateral_damper"]
    for key in ("damping", "series_stiffness"):
        del damper[key]
    damper["damper_table"] = [[0.0, 0.0], [0.02, 400.0], [0.03, 400.0 + 0.01 * c]]
    vehicle = coach.replace(assemblies={"bogie": bogie})
    steps = prepare(vehicle, load_track("straight"), Settings(), 20.0, duration=1.0).steps
    assert steps.at(20.0)[0] < bogie["bodies"]["frame"]["mass"] / (2.0 * c)


def test_outputs_as_dense_as_the_steps_take_one_step_each():
    vehicle, track = load_vehicle("coach_manchester"), load_track("straight")
    settings = Settings(output_rate=2000.0)
    assert prepare(vehicle, track, settings, 20.0, duration=1.0).steps.at(20.0) == (5e-4, 1)


def test_a_given_step_is_too_long_for_slip_control_below_the_speed_that_chooses_it():
    """Without a given step the one at 2 m/s is the longest that divides the output interval."""
    drive = {"kind": "traction", "torque_table": [[0.0, 20e3]], "slip_control": [0.01, 0.03]}
    wheels = {"bodies": ["front.frame", "front.outer.wheelset"]}
    vehicle = load_vehicle("coach_manchester")
    vehicle = vehicle.replace(elements={**vehicle.elements, "drive": drive | wheels})
    track = load_track("straight")

    def steps(speed, **given):
        chosen = prepare(vehicle, track, Settings(**given), speed, duration=1.0).steps
        return *chosen.at(speed), chosen.too_long_below

    step, every, none = steps(2.0)
    assert none == 0.0
    assert every > 5
    below = steps(20.0, step=step)[2]
    assert 2.0 * (every - 1) / every < below <= 2.0


def test_given_step_is_refused_where_it_is_unstable_and_longer_than_a_stable_one(monkeypatch):
    """Differences across a kink of the forces make a short step look unstable, too."""

    class OnlyOne(step_choice.Stability):
        def holds(self, h, margin=1.0):
            return h == 1.0 / 600.0

    monkeypatch.setattr(step_choice, "Stability", OnlyOne)
    vehicle, track = load_vehicle("coach_manchester"), load_track("straight")

    def step(given):
        settings = Settings(step=given)
        return prepare(vehicle, track, settings, 20.0, duration=1.0).steps.at(20.0)[0]

    assert step(1e-3) == 1e-3
    assert step(1.66667e-3) == 5e-3 / 3  # as it is printed
    with pytest.raises(InputError, match=r"0\.0025 s, unstable at 20 m/s; at most 0\.00166667 s"):
        step(2.5e-3)


def test_given_step_that_is_no_longer_than_the_one_taken_without_it_is_not_refused(monkeypatch):
    """The default is judged for a class of runs, whose state in the flange has no kink nearby."""
    monkeypatch.setattr(step_choice.StepChoice, "_in_class", lambda *_: True)
    monkeypatch.setattr(step_choice.Stability, "holds", lambda *_: False)
    vehicle, track = load_vehicle("coach_manchester"), load_track("straight")

    def step(given):
        settings = Settings(step=given)
        return prepare(vehicle, track, settings, 20.0, duration=1.0).steps.at(20.0)[0]

    usual = step(None)
    assert step(usual) == usual
    assert step(0.5 * usual) == 0.5 * usual
    with pytest.raises(InputError, match=f"at most {usual:g} s"):
        step(2.0 * usual)


@pytest.mark.parametrize(
    ("periods", "braked", "given", "count"),
    [
        ((), math.inf, None, 3),
        ((4e-3,), math.inf, None, 5),  # of 5 and 4 ms: steps of 1 ms
        ((10e-3, 2.5e-3), math.inf, None, 4),
        ((4e-3, 2.5e-3), math.inf, None, 3),  # no step of 5/6 ms and more divides both
        ((1.875e-3,), math.inf, None, 3),  # nor one of 5/6 ms and more this one: 5/8 ms would
        ((1e-3,), math.inf, None, 5),
        ((), 0.8e-3, None, 7),
        ((), 0.8e-3, 1.25e-3, 4),  # what is given is taken
        ((2.5e-3, 0.2e-3), math.inf, 1e-3, 5),
    ],
)
def test_steps_divide_the_output_interval_and_the_periods_of_controllers(
    periods, braked, given, count
):
    """Outputs every 5 ms; 2 ms would be stable, or the step that is given."""
    steps = step_choice.StepChoice.__new__(step_choice.StepChoice)
    wheels = SimpleNamespace(longest_step=lambda speed, of_rails, elastic: math.inf)
    system = SimpleNamespace(support=SimpleNamespace(elastic=True))
    steps._settings = Settings(output_rate=200.0, step=given)
    steps._model = SimpleNamespace(wheels=wheels, system=system)
    steps._longest, steps._periods = {20.0: given or 2e-3}, periods
    steps._guided, steps._braked, steps._slipping = math.inf, braked, math.inf
    steps.varies, steps.smallest = False, math.inf
    steps._wave = math.inf
    step, every = steps.at(20.0)
    assert (step, every) == (pytest.approx(5e-3 / count), count)
    assert steps.smallest == step
    if given is None and count != 3:
        assert [period / step for period in periods] == pytest.approx(
            [round(period / step) for period in periods]
        )


def test_other_end_of_a_class_has_its_highest_speed_and_lowest_friction(monkeypatch):
    """From 1.2^16 to 1.2^17 m/s, from 0.2 to 0.3 and from 0.3 to 0.4; none is not below 0."""
    asked = []

    def judged(self, kind, model, speed, step, judge):
        asked.append((kind, speed, *model.system.track.rail[0, MU_LEFT : MU_RIGHT + 1, 0]))
        return False

    monkeypatch.setattr(step_choice.StepChoice, "_judge_once", judged)
    track = load_track("straight").replace(friction=(0.24, 0.3001))
    prepare(load_vehicle("coach_manchester"), track, Settings(), 20.0, duration=1.0).steps.at(20.0)
    assert asked[0] == ("class", *(pytest.approx(x) for x in (1.2**16, 0.3, 0.4)))
    assert asked[1] == ("end of class", *(pytest.approx(x) for x in (1.2**17, 0.2, 0.3)))
    track = track.replace(friction=(0.0, 0.3001))
    prepare(load_vehicle("coach_manchester"), track, Settings(), 20.0, duration=1.0).steps.at(20.0)
    assert asked[-1] == ("end of class", *(pytest.approx(x) for x in (1.2**17, 0.0, 0.3)))


def test_steps_are_judged_on_a_line_with_the_largest_friction_of_each_rail():
    """The line is s along the track, long enough for all bodies; loads are left out."""
    system = assemble(load_vehicle("coach_manchester"), load_track("curve_r250"), Settings()).system
    rail = system.track.rail.copy()
    rail[:, MU_LEFT, 0] = np.linspace(0.2, 0.5, len(rail))
    rail[:, MU_RIGHT, 0] = np.linspace(0.7, 0.1, len(rail))
    level = level_track_with_friction(system._replace(track=system.track._replace(rail=rail)))
    friction = level.track.rail[:, [MU_LEFT, MU_RIGHT]]
    assert np.all(friction == np.array([[0.5, 0, 0, 0], [0.7, 0, 0, 0]]))
    line, ds = level.track.coefficients, level.track.ds
    assert line[:, 0, 0] == pytest.approx(level.track.s_start + ds * np.arange(len(line)))
    assert np.all(line[:, 0, 1] == 1.0)
    assert np.count_nonzero(line) == np.count_nonzero(line[:, 0, :2])
    ends = level.track.s_start, level.track.s_start + ds * len(line)
    assert ends[0] < np.min(system.frame_offset) - 50.0
    assert ends[1] > np.max(system.frame_offset) + 50.0
    assert not level.track.has_irregularity
    assert len(level.loads.body) == len(level.drives.body) == 0


def test_less_friction_along_the_track_is_judged_in_steps_of_a_class():
    """The largest is that of each rail: 0.45 and 0.4, which are of the classes 0.5 and 0.4."""
    track = load_track("curve_r250")
    assert step_choice.less_friction(track).tolist() == [[0.0, 0.0]]
    rows = [[0.0, 0.45, 0.25], [10.0, 0.42, 0.22], [20.0, 0.15, 0.4], [30.0, 0.15, 0.4]]
    found = step_choice.less_friction(track.replace(friction_table=rows))
    assert found == pytest.approx(np.array([[0.0, 0.0], [0.0, 0.1], [0.3, 0.0]]))


@pytest.mark.parametrize("number", range(-3, 28))
def test_lowest_speed_of_a_class_is_in_this_class(number):
    lowest = step_choice.class_speed(1.1 * 1.2**number)
    assert step_choice.class_speed(lowest) == lowest
