"""Kernels are ordinary Python too: with compilation switched off they give the same numbers."""

import os
import subprocess
import sys

import numpy as np
import pytest

from railsim import load_track, load_vehicle, simulate

PROGRAM = """
import sys
import numpy as np
import railsim
from railsim.model.assembly import assemble, work_arrays
from railsim.definitions.settings import Settings
from railsim.kernels.rhs import right_hand_side
model = assemble(railsim.load_vehicle("coach_manchester"), railsim.load_track("curve_r250"),
                 Settings())
state = np.load(sys.argv[1])
derivative = np.zeros_like(state)
status, _, _ = right_hand_side(model.system, work_arrays(model.system), state, derivative)
assert status == 0
np.save(sys.argv[2], derivative)
"""


@pytest.mark.slow
def test_right_hand_side_is_the_same_without_compilation(tmp_path):
    vehicle, track = load_vehicle("coach_manchester"), load_track("curve_r250")
    result = simulate(vehicle, track, speed=20.0, until=5.0)
    state = result.groups["state"]["end"].copy()
    state[-2] = 396.0  # mid-curve
    np.save(tmp_path / "state.npy", state)
    derivatives = []
    for name, disabled in (("compiled", "0"), ("plain", "1")):
        out = tmp_path / f"{name}.npy"
        subprocess.run(
            [sys.executable, "-c", PROGRAM, str(tmp_path / "state.npy"), str(out)],
            env=os.environ | {"NUMBA_DISABLE_JIT": disabled},
            check=True,
        )
        derivatives.append(np.load(out))
    compiled, plain = derivatives
    # forces of 1e5 N on bodies of 1e2 kgm2: round-off of 1e3/s2 times some hundred operations
    assert plain == pytest.approx(compiled, rel=1e-9, abs=1e-8)
