"""Remarks on a run that ended, from what it counted."""

import logging
from types import SimpleNamespace as Record

import numpy as np
import pytest

import railsim
from railsim.kernels import vibration as kernel
from railsim.kernels.actuators import ABOUT, ACTION, BY_DAMPER, BY_FORCE, COMMAND, LARGEST, MODE
from railsim.kernels.contact_columns import W_Q, WHEEL_COLUMNS
from railsim.kernels.support import MAX_CORRECTIONS
from railsim.kernels.vibration import (
    ALTERNATES_AT,
    ALTERNATION,
    AMPLITUDE,
    FREQUENCY,
    POSITION,
    VIBRATION,
)
from railsim.result.stored import lost_peak
from railsim.simulation.preparation import begins_on_sections
from railsim.simulation.remarks import (
    alternation,
    beyond_experience,
    commanded_dampers,
    creep_range,
    ended_by_the_track,
    evaluated_whole,
    lifted_wheels,
    long_for_slip_control,
    sliding,
    stability,
    uneven_wheels_on,
    unsettled_rails,
    vibration,
    vibration_cause,
    yaw_range,
)


def test_nothing_counted_is_nothing_said():
    assert unsettled_rails(0) == creep_range(0, 1000) == ""


def test_all_corrections_used_are_told_with_their_number_and_a_way_to_check():
    remark = unsettled_rails(17)
    assert "17 evaluations" in remark
    assert f"all {MAX_CORRECTIONS} iterations" in remark
    assert "0.02%" in remark
    assert "--check-step" in remark


def test_sums_of_Y_count_against_three_times_their_limit():
    """2 wheels of 60 kN: 10 kN + 120 kN/3 = 50 kN, of the lighter axle 10 + 60/3 = 30 kN."""
    Q0 = np.array([[60e3, 60e3], [30e3, 30e3]])

    def said(sum_Y):
        values = {"Q": np.zeros((2, 2, 2)), "sum_Y": np.array([[0.0, 0.0], sum_Y])}
        places = {name + end: np.ones_like(x) for name, x in values.items()
                  for end in ("_time", "_distance")}  # fmt: skip
        return beyond_experience(values | places, Q0, ("leading", "trailing"))

    assert said([-149e3, -89e3]) == ()
    (words,) = said([-151e3, -89e3])
    assert words.startswith("The largest sum_Y is 151 kN (leading, ")
    assert "3.02 times" in words
    (words,) = said([-149e3, -91e3])
    assert words.startswith("The largest sum_Y is 91 kN (trailing, ")


@pytest.mark.parametrize(
    ("whole", "stored", "said"),
    [
        (100e3, 94.9e3, True),
        (100e3, 95.1e3, False),  # below 5 %
        (10e3, 8.95e3, True),
        (10e3, 9.05e3, False),  # 9.5 %, but below 1 kN
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lost_peak_is_told_above_5_percent_and_1_kN(whole, stored, said, sign):
    of_steps = {"Y": np.sort(np.array([sign * whole, -0.5 * sign * whole]))[::-1]}
    remark = lost_peak({"Y": stored}, of_steps, "20 per s", filtered=False)
    assert bool(remark) is said
    if said:
        percent = 100.0 * (1.0 - stored / whole)
        assert f"{whole / 1e3:.2f} kN over all" in remark
        assert f"{stored / 1e3:.2f} kN in the stored histories, {percent:.0f} % less" in remark


def test_patches_outside_the_creep_law_are_a_share_of_all():
    remark = creep_range(5, 1000)
    assert remark.startswith("5 of 1000 contact patches in the time loop (5.0e-03)")


def test_peaks_of_a_run_that_ends_before_they_are_to_count_are_told():
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    settings = railsim.Settings().with_values({"outputs.evaluate_after": 3.0})
    short, long = (
        railsim.simulate(vehicle, track, speed=20.0, duration=t, settings=settings)
        for t in (0.2, 3.2)
    )
    assert any("within the 3 s" in remark for remark in short.remarks)
    assert not any("evaluate_after" in remark for remark in long.remarks)


@pytest.mark.parametrize(
    ("of", "cause"),
    [
        ({}, "by sliding friction"),
        ({"struck": True}, "by a check rail, or sliding friction"),
        ({"hunts": True}, "hunts"),
        ({"centred": True}, "excited by the gradient, by applied forces or by the start"),
        ({"uneven": True}, "; perhaps excited by wheels that are not round"),
        ({"irregular": True}, "; perhaps excited by the irregularities or sections"),
        ({"varying": True}, "; perhaps excited by the support of the rails, which varies"),
        ({"slides": False}, "excited by blows of the flanges, on smooth rails without friction"),
        ({"slides": False, "struck": True}, "excited by a check rail or blows of the flanges"),
    ],
)
def test_the_remark_on_vibrations_contradicts_neither_itself_nor_another(of, cause):
    """35 Hz pass a high pass at 40 Hz in part; a hunting vehicle strikes its flanges.

    So does a check rail the backs: a blow of 56 kN is no self-excitation by friction.
    """
    measured = np.zeros((2, 2, VIBRATION))
    measured[1, 0, [AMPLITUDE, FREQUENCY]] = 7e3, 35.2
    remark = vibration(measured, np.full((2, 2), 70e3), ("a", "b"), vibration_cause(**of))
    assert remark.startswith("The wheel loads vibrate at 35 Hz: 10 % of Q0")
    assert "above" not in remark
    assert cause in remark
    assert "the rails are rigid" not in remark


@pytest.mark.parametrize(("slides", "elastic"), [(True, False), (False, False), (True, True)])
def test_on_rigid_rails_irregularities_are_not_the_only_possible_cause(slides, elastic):
    """`locomotive_coco_a`, R 250 m, friction 0.4, 20 m/s: a mode at 95 Hz grows by 23 1/s.

    So it does by LSODA.  Wheel loads sway by 350 % of Q0 with irregularities and without; not with
    friction 0.2, nor on elastic rails.
    """
    cause = vibration_cause(irregular=True, slides=slides, elastic=elastic)
    assert ("or self-excited by sliding friction" in cause) == (slides and not elastic)
    assert (
        cause.endswith("the rails are rigid, [support] of the track makes them elastic") != elastic
    )


@pytest.mark.parametrize("frequency", [30.0, 60.0, 150.0])
def test_a_wave_of_the_wheel_load_is_found_as_it_is(frequency, monkeypatch):
    """Behind a Butterworth filter: f^2/sqrt(f^4 + 40^4) of it, tan(pi f h) for f."""
    monkeypatch.setattr(kernel, "update_alternation", kernel.update_alternation.py_func)
    h, amplitude = 1e-3, 5e3
    work = Record(wheel=np.zeros((1, 2, WHEEL_COLUMNS)), vibration=np.zeros((1, 2, VIBRATION)))
    for k in range(2000):
        work.wheel[0, 1, W_Q] = 5e4 + amplitude * np.sin(2.0 * np.pi * frequency * k * h)
        kernel.update_vibration.py_func(work, kernel.high_pass_coefficients.py_func(h), h, 0.0)
    squared, at_cut = (np.tan(np.pi * f * h) ** 2 for f in (frequency, 40.0))
    passed = amplitude * squared / np.hypot(squared, at_cut)
    assert not work.vibration[0, 0, [AMPLITUDE, FREQUENCY]].any()
    assert work.vibration[0, 1, AMPLITUDE] == pytest.approx(passed, rel=0.1)
    assert work.vibration[0, 1, FREQUENCY] == pytest.approx(frequency, rel=0.1)


@pytest.mark.parametrize(
    ("left", "said"),
    [
        ((4.615, 0.0, 65.0), True),  # 20 s at 65 m/s on 1000 m
        ((4.615, 300.0, 65.0), False),  # derailed, or read before its end
        ((0.0, 0.0, 65.0), False),
        ((np.inf, 0.0, 65.0), False),  # no duration was asked for
    ],
)
def test_a_duration_that_the_track_cuts_short_is_told(left, said):
    assert ("4.62 s before the duration" in ended_by_the_track(*left)) == said


@pytest.mark.parametrize("moved", [2e-3, -2e-3])
def test_one_wheelset_that_is_displaced_is_a_disturbance(moved):
    still = {"wheelset_lateral": np.zeros((2, 4))}
    once = {"wheelset_lateral": np.zeros((2, 4))}
    once["wheelset_lateral"][int(moved < 0.0), 2] = moved
    assert "proves nothing about its stability" in stability(None, still, 60.0)
    assert stability(None, once, 60.0) == stability(None, still, 0.1) == ""


def test_each_remark_is_logged_once_and_what_was_asked_for_is_not(caplog):
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    settings = railsim.Settings(outputs={"low_pass": {"frequency": 20.0}})
    with caplog.at_level(logging.WARNING):
        result = railsim.simulate(vehicle, track, speed=20.0, duration=5.0, settings=settings)
    logged = [record.message for record in caplog.records]
    low_passed = [remark for remark in result.remarks if "low-pass" in remark]
    assert len(low_passed) == 1
    assert sorted(logged) == sorted(set(result.remarks) - set(low_passed))
    assert any("Nothing disturbs the vehicle laterally" in remark for remark in logged)


@pytest.mark.parametrize(
    ("creepage", "for_s", "words"),
    [
        (
            1.0,
            2.5,
            "Wheels slide: b turns more than 5 % slower than it rolls for 25 % of the run, "
            "up to 100 %.",
        ),
        (
            -0.3,
            10.0,
            "Wheels spin: b turns more than 5 % faster than it rolls for 100 % of the "
            "run, up to 30 %.",
        ),
        (1.0, 0.2, ""),  # a blow
        (
            1.0,
            0.21,
            "Wheels slide: b turns more than 5 % slower than it rolls for 2.1 % of the run, "
            "up to 100 %.",
        ),
        (0.05, 10.0, ""),
        (
            -0.051,
            10.0,
            "Wheels spin: b turns more than 5 % faster than it rolls for 100 % of the "
            "run, up to 5 %.",
        ),
    ],
)
def test_a_wheelset_that_turns_slower_or_faster_than_it_rolls_is_told(creepage, for_s, words):
    """Of 10 s; on a curve of R 25 m both wheels of the other creep by 3 %, one to either side."""
    time = 0.01 * np.arange(1000)
    values = np.zeros((len(time), 2, 2))
    values[:, 0] = 0.08, -0.08
    values[time < for_s - 1e-9, 1] = creepage
    assert sliding(time, values, ("a", "b")) == words


@pytest.mark.parametrize(("slowest", "told"), [(0.0, True), (3.9, True), (4.1, False)])
def test_a_step_that_slip_control_does_not_hold_is_told(slowest, told):
    said = long_for_slip_control(2e-3, 4.0, slowest)
    assert ("2 ms is too long for slip control below 4 m/s" in said) == told


@pytest.mark.parametrize(("start", "names"), [(39.0, ""), (39.5, "a"), (50.5, "b"), (45.0, "")])
def test_a_run_that_begins_on_changing_rails_says_so(start, names):
    """Wheelsets 10 m ahead of the reference body and 1 m behind it; a range from 49.2 to 51.7 m."""
    under = Record(
        frame_offset=np.array([0.0, 10.0, -1.0]),
        bodies=Record(frame=np.array([0, 1, 2])),
        contact=Record(body=np.array([1, 2])),
    )
    index, rails = Record(wheelsets=("a", "b")), np.array([[49.2, 51.7]])
    model = Record(system=under, index=index, rails=Record(ends=rails))
    found = "".join(begins_on_sections(model, start))
    assert (f"begins with {names} within a range" in found) == bool(names)


# limits, each from both sides --------------------------------------------------------------------


Q0 = np.full((2, 2), 60e3)
NAMES = ("front", "rear")


def placed(name, values):
    """Extremes by name, each at t = 1.5 s and s = 30 m."""
    places = {"_time": 1.5, "_distance": 30.0}
    return {name: values, **{name + end: np.full_like(values, x) for end, x in places.items()}}


@pytest.mark.parametrize(("times", "said"), [(4.99, False), (5.01, True)])
def test_wheel_loads_beyond_five_times_the_static_one_are_told(times, said):
    loads = np.zeros((2, 2, 2))
    loads[0, 1, 0] = times * 60e3
    extremes = placed("Q", loads) | placed("sum_Y", np.zeros((2, 2)))
    words = "".join(beyond_experience(extremes, Q0, NAMES))
    assert ("The largest Q is 5.01 times" in words and "rear, left, t = 1.50 s" in words) == said


@pytest.mark.parametrize(
    ("unloaded", "before", "words"),
    [
        ({}, {}, ""),
        ({(1, 0): 0.004}, {}, "rear, left, for 4 ms altogether (first at t = 1.50 s, s = 30.0 m)."),
        ({(0, 1): 0.003, (1, 1): 0.005}, {}, "rear, right, for 5 ms altogether (first at t = 1.50 s"
         ", s = 30.0 m); 2 wheels in all were off their rails."),
        # all of it before the evaluation of peaks began, and not all
        ({(1, 0): 0.004}, {(1, 0): 0.004}, "s = 30.0 m); all within the start of the run, which "
         "tables of peaks leave out."),
        ({(1, 0): 0.004}, {(1, 0): 0.003}, "s = 30.0 m)."),
    ],
)  # fmt: skip
def test_the_wheel_that_is_off_its_rail_for_longest_is_named(unloaded, before, words):
    times, first = np.zeros((2, 2)), np.zeros((2, 2))
    for known, into in ((unloaded, times), (before, first)):
        for at, seconds in known.items():
            into[at] = seconds
    said = lifted_wheels(placed("Q", np.zeros((2, 2, 2))), times, first, NAMES)
    assert said.endswith(words)
    assert bool(said) == bool(words)


@pytest.mark.parametrize(
    ("moved", "duration", "said"),
    [(9e-6, 1.01, True), (-9e-6, 1.01, True), (11e-6, 1.01, False), (9e-6, 0.99, False)],
)
def test_a_test_of_stability_takes_a_second_and_a_disturbance_of_ten_micrometres(
    moved, duration, said
):
    found = stability(None, {"wheelset_lateral": np.array([[moved, 0.0]])}, duration)
    assert ("proves nothing" in found) == said


@pytest.mark.parametrize(("divided", "share"), [(0, 0.005), (1, 0.02)])
def test_forces_that_alternate_are_told_from_a_share_of_the_wheel_load(divided, share):
    """Forces +A, -A, +A: the square of their second difference, 4 A, is what is measured.

    The wheel that has most of its own load is named, here a light one.
    """
    loads = Q0 * [[1.0, 1.0], [1.0, 0.5]]
    for times, said in ((0.99, False), (1.01, True)):
        measured = np.zeros((2, 2, VIBRATION))
        measured[0, 0, ALTERNATION] = (4.0 * 0.9 * share * 60e3) ** 2
        measured[1, 1, [ALTERNATION, ALTERNATES_AT]] = (4.0 * times * share * 30e3) ** 2, 75.0
        found = alternation(measured, loads, NAMES, divided)
        assert bool(found) == said
        if said:
            assert "guiding force of the right wheel of rear alternates" in found
            assert f"by {1e-3 * times * share * 30e3:.1f} kN, vehicle at s = 75 m" in found
    assert alternation(np.zeros((0, 2, VIBRATION)), Q0, NAMES, divided) == ""


@pytest.mark.parametrize(("share", "said"), [(0.049, False), (0.051, True)])
def test_vibrations_are_told_from_a_twentieth_of_the_wheel_load(share, said):
    measured = np.zeros((2, 2, VIBRATION))
    measured[0, 1, [AMPLITUDE, FREQUENCY, POSITION]] = share * 60e3, 80.0, 12.0
    found = vibration(measured, Q0, NAMES, "x")
    assert (
        "at 80 Hz" in found and "right wheel of front, vehicle at s = 12 m; x." in found
    ) == said


@pytest.mark.parametrize(
    ("about", "body", "most", "unit"),
    [  # body 0 of 2 t and 500, 900, 1000 kg m2 and body 1 of half of all; the lighter one counts
        ("y", (0, 0), 0.3 * 2000.0 / 1e-3, "N s/m"), ("x", (0, 1), 0.3 * 1000.0 / 1e-3, "N s/m"),
        ("about x", (0, 0), 0.3 * 500.0 / 1e-3, "N m s"),
        ("about y", (0, 1), 0.3 * 450.0 / 1e-3, "N m s"),
        ("about z", (0, 0), 0.3 * 1000.0 / 1e-3, "N m s"),
        ("about axle", (1, 1), 0.3 * 450.0 / 1e-3, "N m s"),
    ],
)  # fmt: skip
def test_a_commanded_damper_that_takes_three_tenths_of_a_velocity_in_a_step_is_told(
    about, body, most, unit
):
    """A step h of 1 ms takes h c/m of it."""
    actions = {"x": 0, "y": 1, "about x": ABOUT, "about y": ABOUT + 1, "about z": ABOUT + 2,
               "about axle": ABOUT + 3}  # fmt: skip
    which = np.zeros((2, 10), dtype=np.int64)
    which[0, MODE] = BY_FORCE
    which[1, [ACTION, MODE, COMMAND]] = actions[about], BY_DAMPER, 3
    inertia = np.array([[500.0, 900.0, 1000.0], [250.0, 450.0, 500.0]])
    system = Record(
        actuators=Record(codes=which, body=np.array([(0, 0), body])),
        bodies=Record(mass=np.array([2000.0, 1000.0]), inertia=inertia),
    )
    for times, said in ((0.99, False), (1.01, True)):
        memory = np.full(8, 1e12)
        memory[3 + LARGEST] = times * most
        found = commanded_dampers(system, ("one", "two"), memory, 1e-3)
        assert bool(found) == said
        if said:
            assert f"The damper two was commanded up to {times * most:.3g} {unit}" in found


@pytest.mark.parametrize(
    ("elastic", "massless", "words"),
    [(False, False, "the track is rigid"), (True, True, "the track has no masses"),
     (True, False, "")],
)  # fmt: skip
def test_wheels_that_are_not_round_need_rails_with_mass(elastic, massless, words):
    found = uneven_wheels_on(Record(elastic=elastic, massless=massless))
    assert words in found
    assert bool(found) == bool(words)


def test_counts_are_told_in_the_singular_and_in_parts_of_all():
    assert "In 1 evaluation a wheel was yawed" in yaw_range(1, 0.0)
    assert "In 2 evaluations a wheel was yawed" in yaw_range(2, 0.0)
    assert yaw_range(0, 0.0) == ""
    assert "3 of 200 contact patches in the time loop (1.5e-02)" in creep_range(3, 200)
    assert "within the 3 s after" in evaluated_whole(3.0, 2.9)
    assert evaluated_whole(3.0, 3.1) == evaluated_whole(0.0, 0.0) == ""
    for left, speed, said in ((0.11, 10.0, True), (0.09, 10.0, False), (5.0, 9.0, False)):
        assert bool(ended_by_the_track(left, 0.95, speed)) == said
