"""On irregular track a run at the chosen step is converged: half of it changes next to nothing.

1 km at 60 m/s reaches the flanges (8 mm) near the critical speed, where a scheme of first order
would need a tenth of the step.
"""

import numpy as np
import pytest
from step_halving import changes, half_as_long, irregular_run

from railsim.definitions.loading import load_settings, load_track, load_vehicle
from railsim.simulation import simulate

CASES = [(60.0, 1000.0), (3.0, 150.0)]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]:g} m/s")
def runs(request):
    full = irregular_run(*request.param)
    assert full.status == "complete"
    return full, half_as_long(full)


@pytest.mark.slow
def test_half_the_step_changes_peaks_by_one_and_rms_by_a_fifth_of_a_per_cent(runs):
    for name, (peak, rms) in changes(*runs).items():
        assert abs(peak) < 0.01, name
        assert abs(rms) < 0.002, name


@pytest.mark.slow
def test_run_is_lively(runs):
    """It is no easy case: the wheels move by millimetres and their loads by several per cent."""
    full, _ = runs
    assert np.max(np.abs(full.wheelset_lateral)) > 2.5e-3
    assert np.max(np.abs(full.dQ_over_Q0)) > 0.05


@pytest.mark.further
def test_walking_pace_in_a_tight_curve_needs_no_shorter_steps():
    """R 150 m at 0.5 m/s: the creep forces of all directions are implicit at once, see `step_fast`.

    By blocks, no step was stable: spin turns the force of a flange that slides.
    """
    wagon, track = load_vehicle("wagon_c62a"), load_track("s_curve_r150")
    runs = [
        simulate(wagon, track, speed=0.5, start=60.0, duration=1.0, settings=settings)
        for settings in (load_settings(), load_settings().replace(step=1e-4))
    ]
    assert runs[0].attributes["step"] > 5e-4
    for name in ("Q", "Y"):
        chosen, short = (run[name] for run in runs)
        assert chosen == pytest.approx(short, abs=2e-3 * runs[0]["Q0"].max()), name
