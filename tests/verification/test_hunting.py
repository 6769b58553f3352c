"""Limit cycle of hunting against an independent model, rigid rails.

The model is in global coordinates, with quaternions, spinning wheelsets and its own contact by a
Winkler foundation; nothing in it comes from railsim.  Source: see tests/data/SOURCES.md.
"""

import numpy as np
import pytest
from dynamics import Settings, load_track, load_vehicle

from railsim.simulation import simulate

AMPLITUDE, FREQUENCY = 6.24e-3, 5.23  # m, Hz: benchmark_vehicle1 at 80 m/s


def limit_cycle(vehicle, speed, y):
    """Amplitude [m] and frequency [Hz] of the leading wheelset, 9 to 14 s after a start at `y`."""
    track = load_track("straight").replace(
        plan=[{"type": "STR", "length": 2000.0}], support={"preset": "rigid"}
    )
    settings = Settings(initial={"front.outer.wheelset": {"y": y}}, output_rate=500.0)
    result = simulate(load_vehicle(vehicle), track, speed=speed, duration=14.0, settings=settings)
    assert result.status == "complete"
    late = result.time > 9.0
    time, lateral = result.time[late], result.wheelset_lateral[late, 0]
    up = np.flatnonzero((lateral[:-1] < 0.0) & (lateral[1:] >= 0.0))
    crossing = time[up] - lateral[up] * np.diff(time)[up] / np.diff(lateral)[up]
    return 0.5 * np.ptp(lateral), 1.0 / np.mean(np.diff(crossing))


@pytest.mark.slow
@pytest.mark.parametrize("y", [2e-3, 4e-3])
def test_hunting_of_the_benchmark_vehicle(y):
    """2 %: the foundation's modulus alone moves the independent model by that much."""
    amplitude, frequency = limit_cycle("benchmark_vehicle1", 80.0, y)
    assert amplitude == pytest.approx(AMPLITUDE, rel=0.02)
    assert frequency == pytest.approx(FREQUENCY, rel=0.02)
