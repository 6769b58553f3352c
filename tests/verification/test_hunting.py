"""Limit cycle of hunting against an independent model, rigid rails; where hunting is said.

The model is in global coordinates, with quaternions, spinning wheelsets and its own contact by a
Winkler foundation; nothing in it comes from railsim.  Source: see tests/data/SOURCES.md.
"""

import numpy as np
import pytest
from dynamics import Settings, load_any_track, load_track, load_vehicle
from selection import points

from railsim.simulation import simulate


def limit_cycle(vehicle, speed, y):
    """Amplitude [m] and frequency [Hz] of the leading wheelset, 6 to 10 s after a start at `y`."""
    track = load_track("straight").replace(
        plan=[{"type": "STR", "length": 2000.0}], support={"preset": "rigid"}
    )
    settings = Settings(initial={"front.outer.wheelset": {"y": y}}, output_rate=500.0)
    result = simulate(load_vehicle(vehicle), track, speed=speed, duration=10.0, settings=settings)
    assert result.status == "complete"
    late = result.time > 6.0
    time, lateral = result.time[late], result.wheelset_lateral[late, 0]
    up = np.flatnonzero((lateral[:-1] < 0.0) & (lateral[1:] >= 0.0))
    crossing = time[up] - lateral[up] * np.diff(time)[up] / np.diff(lateral)[up]
    return 0.5 * np.ptp(lateral), 1.0 / np.mean(np.diff(crossing))


@pytest.mark.slow
@points(
    ("vehicle", "speed", "y", "amplitude", "frequency", "tolerance"),
    [
        ("benchmark_vehicle1", 80.0, 2e-3, 6.24e-3, 5.23, 0.02),
        ("benchmark_vehicle1", 80.0, 4e-3, 6.24e-3, 5.23, 0.02),
        ("coach_manchester", 60.0, 4e-3, 6.43e-3, 6.84, 0.03),
    ],
    always=(0,),
)
def test_hunting_on_rigid_rails(vehicle, speed, y, amplitude, frequency, tolerance):
    """2 %: the foundation's modulus alone moves the independent model by that much."""
    assert limit_cycle(vehicle, speed, y) == pytest.approx((amplitude, frequency), rel=tolerance)


def remarks(speed, until=800.0, spectrum=None, start=3e-3, **irregularity):
    """What is said of a run of the Manchester coach on straight track, on elastic rails."""
    track = load_any_track("straight").replace(plan=[{"type": "STR", "length": until + 50.0}])
    if spectrum:
        irregularity = {"type": "random", "spectrum": spectrum, "seed": 11}
    if irregularity:
        track = track.replace(irregularities=[irregularity])
    settings = Settings(initial={"front.outer.wheelset": {"y": start}})
    coach = load_vehicle("coach_manchester")
    return simulate(coach, track, speed=speed, until=until, settings=settings).remarks


@points(
    ("speed", "spectrum"),
    [(44.4, None), (44.4, "erri_b176_low"), (48.9, None), (48.9, "erri_b176_low")],
    always=(1, 2),
)
def test_hunting_is_said(speed, spectrum):
    """Above the critical speed of 38.5 to 40 m/s, on smooth rails and on those of ERRI B176."""
    first = remarks(speed, spectrum=spectrum)[0]
    assert first.startswith("The vehicle hunts at ")
    assert "wheelsets 1 to 4, from s = " in first


def test_the_response_to_bad_track_below_the_critical_speed_is_no_hunting():
    found = remarks(35.0, until=1300.0, spectrum="erri_b176_high")
    assert not any("hunts" in remark for remark in found)


@pytest.mark.parametrize("channel", ["lateral", "cross_level"])
def test_a_forced_motion_on_waves_of_one_length_is_no_hunting(channel):
    """Waves of 9 m excite the kinematic motion at 3.9 Hz: 30 cycles are as regular as the rails."""
    waves = {"amplitude": 0.002, "wavelengths": [9.0, 8.95], "begin": 50.0, "end": 1150.0}
    found = remarks(35.0, until=1200.0, type="sweep", channel=channel, **waves)
    assert not any("hunts" in remark for remark in found)


def test_a_curve_and_its_entry_are_no_hunting():
    coach, track = load_vehicle("coach_manchester"), load_any_track("curve_r250")
    assert simulate(coach, track, speed=20.0).remarks == ()


def test_a_run_that_nothing_disturbs_proves_no_stability():
    """44.4 m/s is above the critical speed; the unstable equilibrium stays where it is."""
    (remark,) = remarks(44.4, until=300.0, start=0.0)
    assert "proves nothing about its stability" in remark
    assert not any("stability" in remark for remark in remarks(30.0, until=300.0))
