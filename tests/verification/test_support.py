"""Elastic rails against closed forms: statics, transfer functions, blows at a dipped joint."""

import numpy as np
import pytest
from dynamics import Settings, evaluate, load_track, load_vehicle, steady

from railsim.definitions.support import PRESETS
from railsim.kernels.wheel_rail import W_Q
from railsim.outputs import rail_deflection

ELASTIC = ["ballasted", "co-running", "p2", "slab"]


def on(support, track="straight", **more):
    """A shipped track on another support."""
    return load_track(track).replace(support={"preset": support}, **more)


@pytest.mark.parametrize("preset", ELASTIC)
def test_static_deflection_is_the_load_over_the_stiffness_of_the_chain(preset):
    values = PRESETS[preset]
    balance = steady(load_vehicle("coach_manchester"), on(preset), Settings(), 1.0)
    compliance = 1.0 / values.pad_vertical[0]
    if values.has_sleeper:
        compliance += 1.0 / values.ballast_vertical[0]
    found = rail_deflection(balance.model, balance.state[None])[0]
    work, _ = evaluate(balance.model.system, balance.state)
    np.testing.assert_allclose(found[..., 1], compliance * work.wheel[:, :, W_Q], rtol=1e-6)
    rigid = steady(load_vehicle("coach_manchester"), on("rigid"), Settings(), 1.0)
    np.testing.assert_allclose(balance.Q0, rigid.Q0, rtol=2e-5)
