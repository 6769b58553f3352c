"""Remarks on a run that ended, from what it counted."""

import logging
from types import SimpleNamespace as Record

import numpy as np
import pytest

import railsim
from railsim.kernels import vibration as kernel
from railsim.kernels.contact_columns import W_Q, WHEEL_COLUMNS
from railsim.kernels.support import MOST_CORRECTIONS
from railsim.kernels.vibration import AMPLITUDE, FREQUENCY, VIBRATION
from railsim.result.stored import lost_peak
from railsim.simulation.preparation import begins_on_sections
from railsim.simulation.remarks import (
    beyond_experience,
    creep_range,
    ended_by_the_track,
    stability,
    unsettled_rails,
    vibration,
    vibration_cause,
)


def test_nothing_counted_is_nothing_said():
    assert unsettled_rails(0) == creep_range(0, 1000) == ""


def test_all_corrections_used_are_told_with_their_number_and_a_way_to_check():
    remark = unsettled_rails(17)
    assert "17 evaluations" in remark
    assert f"all {MOST_CORRECTIONS} iterations" in remark
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
        ({"varying": True}, "excited by the support of the rails, which varies"),
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
    remark = vibration(
        measured, np.full((2, 2), 70e3), ("a", "b"), vibration_cause(**of), elastic=True
    )
    assert remark.startswith("The wheel loads vibrate at 35 Hz: 10 % of Q0")
    assert "above" not in remark
    assert cause in remark


@pytest.mark.parametrize("frequency", [30.0, 60.0, 150.0])
def test_a_wave_of_the_wheel_load_is_found_as_it_is(frequency, monkeypatch):
    """Behind a Butterworth filter: f^2/sqrt(f^4 + 40^4) of it, tan(pi f h) for f."""
    monkeypatch.setattr(kernel, "note_alternation", kernel.note_alternation.py_func)
    h, amplitude = 1e-3, 5e3
    work = Record(wheel=np.zeros((1, 2, WHEEL_COLUMNS)), vibration=np.zeros((1, 2, VIBRATION)))
    for k in range(2000):
        work.wheel[0, 1, W_Q] = 5e4 + amplitude * np.sin(2.0 * np.pi * frequency * k * h)
        kernel.watch.py_func(work, kernel.high_pass.py_func(h), h, 0.0)
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
