"""The fast scheme against an integrator that nobody here wrote: LSODA (Petzold 1983) of scipy."""

import numpy as np
from scipy.integrate import solve_ivp
from selection import points

import railsim
from railsim.definitions.settings import Settings
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import ARC_LENGTH, N_SCALARS, internal_begin
from railsim.kernels.support import DOF, SUPPORT_SIZE
from railsim.model.time_step import empty_recorder, record_state
from railsim.model.work import work_arrays
from railsim.simulation.preparation import prepare


def moving(model):
    """Entries of the state with an equation of their own: not what the fast scheme remembers."""
    system, last = model.system, model.n_state - N_SCALARS
    entries = list(range(internal_begin(model.index.n_bodies) + len(system.internal.kind)))
    if system.support.elastic:
        wheelsets = len(system.contact.body)
        for first in range(last - SUPPORT_SIZE * wheelsets, last, SUPPORT_SIZE):
            entries += range(first, first + 2 * DOF)
    return [*entries, model.n_state + ARC_LENGTH]


def wheel_forces(model, start, times):
    """Q and Y of a run by LSODA, float64[2, time, wheelset, side] [N]."""
    system, entries = model.system, moving(model)
    work, rate = work_arrays(system), np.zeros((1, len(start)))

    def rates(_, values):
        state = start.copy()
        state[entries] = values
        right_hand_sides(system, work, state[None], rate)
        return rate[0, entries].copy()

    how = {"method": "LSODA", "t_eval": times, "rtol": 1e-5, "atol": 1e-8, "max_step": 2e-3}
    found = solve_ivp(rates, (0.0, times[-1]), start[entries], **how)
    forces, recorder = [], empty_recorder(model, 1)
    for values in found.y.T:
        state = start.copy()
        state[entries] = values
        record_state(system, state, recorder)
        forces.append(recorder.wheel[0][:, :, [W_Q, W_Y]])
    return np.moveaxis(np.array(forces), 3, 0)


@points("support", ["rigid", "co-running"], always=(0,))
def test_wheel_forces_on_irregular_rails_are_those_of_lsoda(support):
    """Within 3e-4 of the wheel load at 25 m/s, with the chosen step of 1.67 or 2.5 ms.

    From the first step on: smoothed accelerations go on as they were at the end of the run-in.  On
    rigid rails it was 1.1e-3 where they began anew.
    """
    coach = railsim.load_vehicle("coach_manchester")
    rough = {"type": "random", "spectrum": "erri_b176_low", "seed": 4}
    track = railsim.load_track("straight").replace(
        support={"preset": support}, irregularities=[rough]
    )
    result = railsim.simulate(coach, track, speed=25.0, start=200.0, duration=0.02)
    prepared = prepare(coach, track, Settings(), 25.0, 200.0, duration=0.02)
    Q, Y = wheel_forces(prepared.model, prepared.state, result.time)
    load = result.Q0.mean()
    assert np.ptp(Q, axis=0).max() > 0.01 * load
    for forces, expected in ((result.Q, Q), (result.Y, Y)):
        np.testing.assert_allclose(forces, expected, rtol=0.0, atol=3e-4 * load)
