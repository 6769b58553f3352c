"""Guidance on straight track: Klingel's wavelength and the onset of hunting."""

import numpy as np
from dynamics import Settings, load_track, load_vehicle

from railsim.simulation import simulate

WHEELSETS = (
    "front.outer.wheelset",
    "front.inner.wheelset",
    "rear.inner.wheelset",
    "rear.outer.wheelset",
)


def lateral_at_the_end(vehicle, speed, offset=0.003, until=600.0):
    """Largest lateral displacement in the last 100 m after all wheelsets started off centre [m]."""
    initial = {name: {"y": offset} for name in WHEELSETS}
    result = simulate(
        vehicle,
        load_track("straight"),
        speed=speed,
        until=until,
        settings=Settings(initial=initial),
    )
    assert result.status == "complete"
    return np.max(np.abs(result.wheelset_lateral[result.distance > until - 100.0]))


def test_manchester_coach_is_stable_at_30_m_s():
    assert lateral_at_the_end(load_vehicle("coach_manchester"), 30.0) < 0.2e-3


def test_manchester_coach_hunts_at_45_m_s():
    """Above the critical speed of the linearised coach, 40 m/s (`railsim critical-speed`)."""
    assert lateral_at_the_end(load_vehicle("coach_manchester"), 45.0) > 0.5e-3


def test_flexicoil_coach_is_stable_at_50_m_s():
    assert lateral_at_the_end(load_vehicle("coach_flexicoil"), 50.0) < 0.2e-3
