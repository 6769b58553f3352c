"""The same inputs give the same bytes, whatever was computed or stored before."""

import pytest

import railsim


def run():
    vehicle, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250")
    return railsim.simulate(vehicle, track, speed=20.0, until=5.0)


@pytest.mark.slow
def test_run_with_a_new_contact_table_equals_the_run_with_the_stored_one(tmp_path, monkeypatch):
    monkeypatch.setenv("RAILSIM_CACHE_DIR", str(tmp_path))  # kernels stay where they are
    new, stored = run(), run()
    assert len(list((tmp_path / "tables").glob("*.npy"))) == 1
    for name in new:
        assert new[name].tobytes() == stored[name].tobytes(), name
