"""A model against a test whose values lie between those of the simulation."""

import numpy as np
import pytest
from made_record import Q0, curve, made, track

import railsim
from railsim.definitions.measurement import MeasurementFile
from railsim.measurement import Measurement

SPEED, RATE = 23.0, 200.0


def load(t):
    """A wheel load with a tone of 18 Hz, below the filter of 20 Hz [N]."""
    return Q0 + 10e3 * np.sin(2.0 * np.pi * 18.0 * t) * (1.0 + 0.3 * np.sin(2.0 * np.pi * 0.17 * t))


def test_no_difference_where_only_the_instants_of_the_samples_differ():
    """Straight lines between 200 values a second would take cos(pi 18/200), 4 %, of the tone."""
    on = track(*curve(300.0, 900.0), cant=0.12)
    result = made(
        on, SPEED, rate=RATE, Q=lambda t, s: np.tile(load(t)[:, None, None], (1, 4, 2)),
        settings='{"outputs": {"low_pass": {"frequency": 80.0}}, "output_rate": 200.0}',
    )  # fmt: skip
    t = (0.5 + np.arange(round(on.length / SPEED * RATE) - 1)) / RATE
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": {"load": {"quantity": "Q:1:left"}},
    })  # fmt: skip
    run = Measurement(how, t, SPEED * t, np.full(len(t), SPEED), {"load": load(t)})
    found = railsim.validate_model(run, result)["Q_max"]
    assert len(found.pairs) > 5
    for pair in found.pairs:
        assert pair.measured - Q0 > 8e3
        assert pair.simulated - Q0 == pytest.approx(pair.measured - Q0, rel=3e-3)


def test_a_quotient_that_was_measured_is_not_formed_of_its_forces_again():
    on = track(*curve(300.0, 400.0), cant=0.12)
    result = made(on, SPEED, rate=RATE, Y=lambda t, s: np.full((*s.shape, 2), -20e3),
                  settings='{"outputs": {"low_pass": {"frequency": 80.0}}}')  # fmt: skip
    t = np.arange(round(on.length / SPEED * RATE)) / RATE
    measured = {"Y:1:left": -22e3, "Q:1:left": Q0, "Y_over_Q:1:left": 22e3 / Q0}
    how = MeasurementFile.model_validate({
        "format": "railsim-measurement/1", "name": "m", "file": ["a.csv"], "rate": RATE,
        "speed": SPEED, "channels": {f"c{k}": {"quantity": q} for k, q in enumerate(measured)},
    })  # fmt: skip
    channels = {f"c{k}": np.full(len(t), value) for k, value in enumerate(measured.values())}
    run = Measurement(how, t, SPEED * t, np.full(len(t), SPEED), channels)
    found = railsim.validate_model(run, result)
    assert len(found["Y_over_Q_qst"].pairs) == len(found["Y_qst"].pairs) > 3
    assert found["Y_over_Q_qst"].mean == pytest.approx(-2e3 / Q0)
    assert found["Y_qst"].mean == pytest.approx(-2e3)
