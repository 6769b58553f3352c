"""The same inputs give the same bytes, whatever was computed or stored before."""

import numpy as np
import pytest

import railsim
import railsim.simulation.advance
import railsim.simulation.auxiliary_track


def run():
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    return railsim.simulate(vehicle, track, speed=20.0, until=5.0)


def test_calls_within_an_output_interval_change_nothing(monkeypatch):
    """Long intervals are cut, so that Ctrl-C is heard."""
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    settings = railsim.load_settings(None, ["output_rate=10"])
    runs = []
    for most in (railsim.simulation.advance.STEPS, 7):  # of 80 steps from one output to the next
        monkeypatch.setattr(railsim.simulation.advance, "STEPS", most)
        runs.append(railsim.simulate(vehicle, track, speed=20.0, until=20.0, settings=settings))
    whole, cut = runs
    assert len(whole.time) == 11
    for name in whole:
        assert cut[name].tobytes() == whole[name].tobytes(), name


@pytest.mark.slow
@pytest.mark.usefixtures("small_contact_tables")
def test_run_with_a_new_contact_table_equals_the_run_with_the_stored_one(tmp_path, monkeypatch):
    monkeypatch.setenv("RAILSIM_CACHE_DIR", str(tmp_path))  # kernels stay where they are
    new, stored = run(), run()
    assert len(list((tmp_path / "railsim" / "tables").glob("*.npy"))) == 1
    for name in new:
        assert new[name].tobytes() == stored[name].tobytes(), name


@pytest.mark.slow
def test_run_in_may_be_interrupted_and_is_the_same_in_pieces(monkeypatch):
    """A start in a curve: the run-in before it is many calls of the time loop, or one."""
    track = railsim.load_track("curve_r250")
    vehicle = railsim.load_vehicle("coach_manchester")
    how = {"speed": 20.0, "start": 390.0, "duration": 0.1}
    whole = railsim.simulate(vehicle, track, **how)
    monkeypatch.setattr(railsim.simulation.auxiliary_track, "WHEELSET_STEPS", 4 * 137)
    pieces = railsim.simulate(vehicle, track, **how)
    for name in whole:
        np.testing.assert_array_equal(pieces[name], whole[name])
