"""A state that is not finite is said to be that, whatever look-up meets it first."""

import numpy as np
import pytest
from dynamics import NEVER, load_track, steady

from railsim.definitions.loading import load_vehicle
from railsim.definitions.settings import Settings
from railsim.kernels.status import NOT_FINITE
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.model.time_step import SCHEMES, empty_recorder
from railsim.model.work import work_arrays


@pytest.mark.parametrize("scheme", ["fast", "rk4"])
def test_acceleration_without_a_value_is_no_wheel_beyond_its_table(scheme):
    """RK4 meets it between two steps, in a stage; the state is still finite there."""
    coach, track = load_vehicle("coach_manchester"), load_track("straight")
    found = steady(coach, track, Settings(), 20.0)
    model, state = found.model, found.state.copy()
    row = model.system.bodies.row.copy()
    row[model.index.bodies.index("front.inner.wheelset"), 0] = np.nan  # its mass
    system = model.system._replace(bodies=model.system.bodies._replace(row=row))
    status, where, *_ = time_loop(
        system, work_arrays(system), state, np.zeros_like(state), np.zeros((3, len(state))),
        empty_recorder(model, 1), SCHEMES[scheme], 5e-4, Chunk(1, 20, NEVER, fresh=1),
    )  # fmt: skip
    assert status == NOT_FINITE
    assert "front.inner.wheelset is not finite" in model.index.sentence(status, where)
