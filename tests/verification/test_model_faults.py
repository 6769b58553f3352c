"""A model with small faults against the run of examples/measured_run, with its contact tables.

Small tables move the quasi-static guiding force by 0.16 kN; a spring 30 % too stiff by 0.45 kN.
"""

import pytest
from test_model_validation import make, scaled, simulated

import railsim


@pytest.mark.further
def test_load_stiffness_and_small_faults():
    """Laden for empty: wheel loads; secondary springs x 3: the ride; primary + 30 %: seen."""
    measured, true = railsim.load_measurement("coach_25t_run"), make.true_vehicle()
    laden = railsim.validate_model(measured, simulated(true.with_values({"load": "laden"})))
    assert laden["Q_qst"].verdict == laden["Q_max"].verdict == "fail"
    hard = scaled(true, "bogie", "secondary_spring", "stiffness", 3.0)
    hard = railsim.validate_model(measured, simulated(hard))
    assert {hard[name].verdict for name in ("body_z_max", "body_z_rms")} == {"fail"}
    own = railsim.validate_model(measured, simulated(true))
    primary = scaled(true, "axle", "coil_spring", "stiffness", 1.3)
    primary = railsim.validate_model(measured, simulated(primary))
    assert primary.verdict == "pass"
    assert primary["Q_max"].deviation > 2.0 * own["Q_max"].deviation
    assert abs(primary["Y_qst"].mean) > 5.0 * abs(own["Y_qst"].mean)
