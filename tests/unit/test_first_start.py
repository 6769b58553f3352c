"""The first start: what one process compiles while another builds contact tables."""

import pytest

import railsim
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.time_loop import time_loop
from railsim.simulation.first_start import compile_time_loop


@pytest.mark.skipif(not hasattr(time_loop, "signatures"), reason="without the compiler")
def test_what_is_compiled_beforehand_is_what_a_run_calls():
    coach, track = railsim.load_vehicle("coach_flexicoil"), railsim.load_track("curve_r250")
    railsim.simulate(coach, track, speed=20.0, until=1.0)
    called = time_loop.signatures, right_hand_sides.signatures
    compile_time_loop()
    assert (time_loop.signatures, right_hand_sides.signatures) == called
