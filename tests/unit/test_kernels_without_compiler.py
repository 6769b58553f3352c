"""Kernels are ordinary Python too: with compilation switched off they give the same numbers."""

import os
import subprocess
import sys

import numpy as np
import pytest

from railsim import load_track, load_vehicle, simulate
from railsim.contact import creep as contact_creep
from railsim.contact.creep import LAWS, creep_force
from railsim.definitions.settings import Settings
from railsim.kernels import contact_table, creep, creep_laws, creep_table, fastsim
from railsim.kernels.contact_table import LOOK_UP_SIZE, N_WEIGHT
from railsim.kernels.rhs import right_hand_side
from railsim.kernels.time_loop import FAST, RK4, Chunk, time_loop
from railsim.model.assembly import assemble
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays

HERE = os.path.dirname(__file__)
CURVE = [[0.0, 0.0], [0.003, 0.7], [0.02, 1.0]]
PROGRAM = """
import sys
import numpy as np
from test_kernels_without_compiler import evaluated
np.savez(sys.argv[2], **evaluated(np.load(sys.argv[1])))
"""


def evaluated(state):
    """What all kernels of a run give: derivative, steps of both schemes, creep laws."""
    vehicle = load_vehicle("coach_manchester")
    track = load_track("curve_r250", ['support.preset="ballasted"'])
    model = assemble(vehicle, track, Settings(outputs={"elements": ["*"]}))
    found = {}
    derivative = np.zeros_like(state)
    status, _, _ = right_hand_side(model.system, work_arrays(model.system), state, derivative)
    assert status == 0
    found["derivative"] = derivative
    for name, scheme in (("fast", FAST), ("rk4", RK4)):
        after, stages = state.copy(), np.zeros((3, len(state)))
        recorder = empty_recorder(model, 3)
        status, *_ = time_loop(
            model.system, work_arrays(model.system), after, np.zeros_like(state), stages, recorder,
            scheme, 1e-4, Chunk(0, 2, 1, fresh=1, closing=1),
        )  # fmt: skip
        assert status == 0
        found[name], found[f"{name}_wheel"] = after, recorder.wheel
    patches = {"a": [6e-3, 3e-3], "b": [4e-3, 5e-3], "N": [70e3, 30e3], "mu": 0.35}
    creepages = {"xi_x": [1e-3, -2e-3], "xi_y": [-5e-4, 4e-3], "phi": [0.4, -0.9]}
    for law in LAWS:
        found[law] = np.array(creep_force(**patches, **creepages, law=law))
    found["adhesion_curve"] = np.array(
        creep_force(**patches, **creepages, law="adhesion_curve", adhesion_curve=CURVE)
    )
    return found


@pytest.mark.slow
def test_a_run_is_the_same_without_compilation(tmp_path):
    track = load_track("curve_r250", ['support.preset="ballasted"'])
    result = simulate(load_vehicle("coach_manchester"), track, speed=20.0, until=5.0)
    state = result.groups["state"]["end"].copy()
    state[-2] = 396.0  # mid-curve
    np.save(tmp_path / "state.npy", state)
    subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "state.npy"), str(tmp_path / "plain.npz")],
        env=os.environ
        | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join([HERE, *sys.path])},
        check=True,
    )  # fmt: skip
    compiled, plain = evaluated(state), np.load(tmp_path / "plain.npz")
    assert set(plain.files) == set(compiled)
    for name, values in compiled.items():
        # forces of 1e5 N on bodies of 1e2 kgm2: round-off of 1e3/s2 times some hundred operations
        # slopes learn from small differences of forces, round-off over micrometres
        rtol = 1e-7 if name == "fast" else 1e-9
        np.testing.assert_allclose(plain[name], values, rtol=rtol, atol=1e-7, err_msg=name)


@pytest.mark.parametrize("tw", [0.3, 1.0, 1.8])
def test_fields_of_a_patch_are_the_same_without_compilation(tw, plain):
    """In every patch of a table, beyond its last node of yaw too."""
    model = assemble(load_vehicle("coach_manchester"), load_track("straight"), Settings())
    contact = model.system.contact
    weights, out = np.empty(N_WEIGHT), np.zeros((2, 3, LOOK_UP_SIZE))
    contact_table.set_cell_weights(contact, 0.3, 0.8, 1.1, weights)
    w, roll, y = (size // 2 for size in contact.values.shape[2:5])
    for found in out:
        for patch in range(3):
            contact_table.look_up(contact, 0, patch, y, roll, w, tw, weights, found[patch])
        plain(contact_table)
    np.testing.assert_allclose(out[1], out[0], rtol=1e-11, atol=1e-12)
    assert np.ptp(out[0]) > 0.0


def test_creep_forces_are_the_same_without_compilation(plain):
    """Of random patches, from stick to sliding."""
    random = np.random.default_rng(2)
    a, b = random.uniform(2e-3, 6e-3, (2, 12))
    N = random.uniform(0.0, 9e4, 12)
    xi_x, xi_y, phi = random.normal(size=(3, 12)) * 10.0 ** random.uniform(-5.0, -2.0, 12)

    def forces():
        laws = [(law, None) for law in LAWS] + [("adhesion_curve", CURVE)]
        given = a, b, N, 0.3, xi_x, xi_y, 100.0 * phi
        return np.array([creep_force(*given, law=law, adhesion_curve=c) for law, c in laws])

    compiled = forces()
    for module in (contact_creep, creep, creep_laws, creep_table, fastsim):
        plain(module)
    scale = np.abs(compiled).max(axis=-1, keepdims=True)
    assert np.all(np.abs(forces() - compiled) <= 1e-11 * scale)
