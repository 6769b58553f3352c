"""Internal states of elements by themselves: their rates by hand, steps against scipy."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railsim.kernels import internal as kernel
from railsim.kernels import step_rk4
from railsim.kernels.internal import AIR, LAG, MAXWELL, MAXWELL_CURVE, PAD, Internal

SPEEDS, FORCES = np.array([-0.5, -0.1, 0.1, 0.4]), np.array([-3e3, -2e3, 1e3, 1.5e3])
CURVES = Record(start=np.array([0, 4]), x=SPEEDS, f=FORCES)
FAST = 1.5  # of the lag's command, beyond its limited rate


def curve(force):
    """Speed of a rising table, continued beyond its ends."""
    slope = np.diff(SPEEDS) / np.diff(FORCES)
    i = np.clip(np.searchsorted(FORCES, force) - 1, 0, 2)
    return SPEEDS[i] + (force - FORCES[i]) * slope[i]


LAWS = {
    MAXWELL: ((2e4, 5e6, 0.0), lambda x, v, _: 5e6 * (v - x / 2e4)),
    MAXWELL_CURVE: ((0.0, 4e6, 0.0), lambda x, v, _: 4e6 * (v - curve(x))),
    AIR: ((3e5, 8e5, 2e4), lambda x, z, _: (3e5 * (z - x) - 8e5 * x) / 2e4),
    LAG: ((0.05, 12.0, 0.0), lambda x, _, u: np.clip((u - x) / 0.05, -12.0, 12.0)),
}


@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize(("begin", "drive"), [(-2.5e3, 0.3), (900.0, -0.4), (0.0, 0.05)])
def test_rate_and_step_of_a_state_at_constant_drive(kind, begin, drive, plain):
    parameter, rate = LAWS[kind]
    x = begin if kind in (MAXWELL, MAXWELL_CURVE) else 1e-3 * begin
    given = Internal(np.array([kind]), np.array([parameter]), np.array([0]))
    plain(kernel)
    assert kernel.internal_rate(given, CURVES, 0, x, drive, FAST) == pytest.approx(
        rate(x, drive, FAST)
    )
    decay = np.empty(1)
    for h in (1e-4, 3e-3, 0.1):
        kernel.set_decays(given, h, decay)
        found = kernel.state_after(given, CURVES, 0, x, drive, FAST, h, decay[0])
        exact = solve_ivp(
            lambda _, y: [rate(y[0], drive, FAST)], (0.0, h), [x], rtol=1e-8, atol=1e-9,
            method="LSODA",
        )  # fmt: skip
        assert found == pytest.approx(exact.y[0, -1], rel=1e-5, abs=1e-6 * abs(x))


def test_pads_return_to_their_limits_each_in_its_own_way(plain):
    """One alone to its limit; two that slide together keep the direction of the trial force."""
    parameter = [[1e6, 0.0, 0.0], [1e6, 1.0, 0.0], [1e6, 2.0, 0.0], [0.05, 12.0, 0.0]]
    given = Internal(np.array([PAD, PAD, PAD, LAG]), np.array(parameter), np.full(4, -1))
    state, drive = np.array([9.0, -7e3, 3e3, 4e3, 8e3]), np.full((4, 2), 1e3)
    for module in (kernel, step_rk4):
        plain(module)
    step_rk4.restore_limits(given, CURVES, 1, drive, state)
    assert state == pytest.approx([9.0, -1e3, 0.6e3, 0.8e3, 8e3])


@pytest.mark.parametrize("skew", [0.0, 0.4, -0.3])
def test_a_wedge_slides_back_to_its_limit_along_the_gradient_of_its_stiffness(skew, plain):
    """Forces q over their limits L end on |q| - e q_z = 1, each reduced by 1 + lambda k/L^2."""
    stiffness, limits = np.array([1e6, 3e6, 2e6]), np.array([1e3, 2e3, 1.5e3])
    parameter = np.array([[1e6, 1.0, 0.0], [3e6, 1.0, 0.0], [2e6, 3.0, skew]])
    given = Internal(np.full(3, PAD), parameter, np.full(3, -1))
    trial, drive = np.array([2.5e3, -3e3, 4e3]), np.stack([np.zeros(3), limits], axis=1)
    plain(kernel)
    state = np.array([7.0, *trial])
    kernel.return_to_limit(given, 2, 1, drive, state)
    q = state[1:] / limits
    assert np.linalg.norm(q) - skew * q[2] == pytest.approx(1.0)
    slip = (trial / state[1:] - 1.0) * limits**2 / stiffness
    assert slip == pytest.approx(np.full(3, slip[0]), rel=1e-6)
    held = state.copy()
    kernel.return_to_limit(given, 2, 1, drive, state)  # nothing is left to slide
    assert state == pytest.approx(held)


def test_a_table_of_several_takes_speeds_of_its_own_branches(plain):
    """Both ends of each go on; curves follow each other without a gap."""
    tables = Record(start=np.array([0, 4, 8]), x=np.tile(SPEEDS, 2))
    tables.f = np.concatenate([FORCES, 2.0 * FORCES])
    plain(kernel)
    for force in (-4e3, -2.5e3, 0.0, 1.2e3, 1.6e3, 5e3):
        assert kernel.curve_speed(tables, 0, force, 0.0) == pytest.approx(curve(force))
        assert kernel.curve_speed(tables, 1, 2.0 * force, 0.0) == pytest.approx(curve(force))
        assert kernel.curve_value(tables, 1, curve(force)) == pytest.approx(2.0 * force)
