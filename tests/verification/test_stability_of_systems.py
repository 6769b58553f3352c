"""Linearisation, loss of stability and periodic motions of systems with published speeds."""

import cooperrider
import numpy as np
import pytest
from scipy.linalg import block_diag

from railsim.linear.eigenmodes import divergent, eigenmodes, follow_modes, oscillations
from railsim.linear.stability_loss import loss_of_stability
from railsim.linear.system import Linearisation, jacobian
from railsim.stability.periodic import Shooting


def linearised(names, rate, step, speed):
    """Linearisation of x' = rate(x, speed) about rest."""

    def rates(rows):
        return np.array([rate(row, speed) for row in rows])

    rest = np.zeros(len(names))
    return Linearisation(names, jacobian(rates, rest, np.full(len(names), step)), rest, speed)


def bogie(speed):
    return linearised(cooperrider.NAMES, cooperrider.rate, 1e-9, speed)


@pytest.fixture(scope="module")
def birth():
    """The beginning of the bogie's branch of periodic motions, and the branch."""
    lost = loss_of_stability(bogie, 30.0, 120.0)
    shape = lost.modes[0].shapes[0]
    scale = np.abs(shape / shape[0]) * 1e-3  # of a motion of 1 mm of the leading wheelset
    branch = Shooting(cooperrider.Periods(), scale, period_scale=0.01, speed_scale=1.0)
    start = branch.beginning(np.zeros(14), shape, lost.modes[0].frequencies[0], lost.parameter)
    return branch, start


@pytest.fixture(scope="module")
def motions(birth):
    """Motions along the branch, and the one where it turns back in speed."""
    branch, start = birth
    found = list(branch.motions(start, 2.0, lambda motion: motion.speed < 75.5))
    turns = [k for k in range(1, len(found)) if found[k - 1].tangent[-1] < 0 < found[k].tangent[-1]]
    (k,) = turns
    return found, branch.fold(found[k - 1], found[k])


def test_a_matrix_is_formed_once_a_motion_and_updated_between(birth, monkeypatch):
    """It takes 17 flows; the search ends at a motion whose residual is none, 1e-6 of a millimetre.

    Formed again wherever a change is more than 0.3 of the one before it is 30 flows a motion.
    """
    branch, start = birth
    ends, flows = branch._ends, []
    monkeypatch.setattr(branch, "_ends", lambda rows: (flows.append(len(rows)), ends(rows))[1])
    found = list(branch.motions(start, 2.0, lambda motion: motion.speed > 67.2))
    assert len(found) == 11
    assert sum(flows) < 28 * len(found)
    for motion in found:
        u = np.concatenate([motion.state, [motion.period, motion.speed]]) / branch._scale
        assert np.max(np.abs(ends(u[None])[0] - u[:-2])) < 1e-6


@pytest.mark.parametrize("conicity", [0.04, -0.04])
def test_a_wheelset_of_negative_conicity_leaves_the_middle(conicity):
    """Klingel: y'' = -conicity V^2 y/(r b): a wave, or a growth of V sqrt(-conicity/(r b))."""
    rate = conicity * 40.0**2 / (0.46 * 0.75)
    free = Linearisation(("y", "y'"), np.array([[0.0, 1.0], [-rate, 0.0]]), np.zeros(2), 40.0)
    leaving = divergent(eigenmodes(free))
    growth = None if leaving is None else leaving.eigenvalues.real.tolist()
    assert growth == (None if conicity > 0.0 else pytest.approx([np.sqrt(-rate)]))


@pytest.mark.parametrize(("conicity", "critical"), [(0.05, 40.671), (0.20, 20.329)])
def test_suspended_wheelset_loses_stability_at_the_speed_of_the_closed_form(conicity, critical):
    """L1: Wickens (2003), chapter 3, two equations of motion and V in closed form."""
    m, inertia, f, ky, kpsi, r0, b0 = 1813.0, 1120.0, 1e7, 2e5, 4e5, 0.46, 0.75

    def rate(x, speed):
        y, yaw, y_rate, yaw_rate = x
        lateral = 2.0 * f * (y_rate / speed - yaw) + ky * y
        moment = 2.0 * f * (b0**2 * yaw_rate / speed + b0 * conicity * y / r0) + kpsi * yaw
        return np.array([y_rate, yaw_rate, -lateral / m, -moment / inertia])

    names = ("y", "yaw", "y'", "yaw'")
    lost = loss_of_stability(lambda speed: linearised(names, rate, 1e-6, speed), 5.0, 90.0)
    square = (2 * f * kpsi + 2 * f * b0**2 * ky) / (2 * f * inertia + 2 * f * b0**2 * m)
    stiff = (ky - m * square) * (kpsi - inertia * square) / (4 * f * f)
    closed = np.sqrt(square * b0**2 / (b0 * conicity / r0 + stiff))
    assert lost.parameter == pytest.approx(closed, rel=1e-6)
    assert lost.parameter == pytest.approx(critical, rel=1e-4)
    assert lost.modes[0].frequencies[0] == pytest.approx(2.4631, rel=1e-4)


@pytest.mark.parametrize(("damping", "critical"), [(0.0, None), (2e-3, 40.0)])
def test_an_oscillation_that_only_rounding_undamps_is_stable(damping, critical):
    """A spring-held mass of growth d (V/40 - 1): without d nothing but 3e-14 1/s is left of it."""

    def at(speed):
        growth = damping * (speed / 40.0 - 1.0) + 3e-14
        return Linearisation(("x", "v"), np.array([[0, 1], [-1e4, 2 * growth]]), np.zeros(2), speed)

    lost = loss_of_stability(at, 5.0, 90.0)
    assert not lost.already
    assert lost.parameter == (critical and pytest.approx(critical, rel=1e-4))


def test_cooperriders_bogie_loses_stability_at_its_published_speed():
    """L3: "about 68.66" (bifurcation.de); 68.667 m/s and 3.998 Hz computed independently."""
    lost = loss_of_stability(bogie, 30.0, 120.0)
    assert lost.parameter == pytest.approx(68.667, rel=1e-3)
    assert lost.parameter == pytest.approx(68.66, abs=0.01)
    assert lost.modes[0].frequencies[0] == pytest.approx(3.998, rel=1e-3)


@pytest.mark.parametrize(
    ("low", "high", "parameter", "already"), [(30.0, 60.0, None, False), (75.0, 90.0, None, True)]
)
def test_a_range_without_loss_of_stability_says_so(low, high, parameter, already):
    lost = loss_of_stability(bogie, low, high)
    assert (lost.parameter, lost.already) == (parameter, already)
    growth = [modes.eigenvalues[0].real for modes in lost.modes]
    assert all(value > 0.0 for value in growth) if already else all(v < 0.0 for v in growth)
    assert len(growth) == (1 if already else 2)


@pytest.mark.parametrize(
    ("peak", "half"), [(18.6, 2.1), (18.0, 0.3), (67.3, 0.5), (111.0, 0.4), (114.2, 0.5)]
)
@pytest.mark.parametrize(("low", "high"), [(5.0, 120.0), (10.0, 115.0), (2.0, 120.0)])
def test_a_narrow_range_of_instability_is_found_wherever_the_search_begins(peak, half, low, high):
    """An oscillator of 1 Hz whose growth is a parabola: positive over a few m/s about its peak."""

    def oscillator(growth):
        matrix = np.array([[growth, 2.0 * np.pi], [-2.0 * np.pi, growth]])
        return lambda speed: Linearisation(("x", "y"), matrix, np.zeros(2), speed)

    def unstable(speed):
        return oscillator(0.015 * (1.0 - ((speed - peak) / half) ** 2))(speed)

    lost = loss_of_stability(unstable, low, high)
    assert lost.parameter == pytest.approx(peak - half, abs=1e-4)
    assert not lost.already

    def stable(speed):
        return oscillator(-1e-5 - 0.015 * ((speed - peak) / half) ** 2)(speed)

    assert loss_of_stability(stable, low, high).parameter is None
    for at in (low + 0.15, high - 0.15):  # beside the ends, where one interval is not known
        peak, half = at, 0.1
        lost = loss_of_stability(unstable, low, high)
        assert lost.parameter == pytest.approx(at - 0.1, abs=1e-4)


@pytest.mark.parametrize("high", [120.0, 31.5])  # m/s; beyond and below the second loss
@pytest.mark.parametrize("peak", [22.4, 23.5, 24.6, 28.0, 29.0])
def test_a_narrow_range_just_below_another_loss_of_stability_is_found(peak, high):
    """Growth 0.003 (1 - ((V - peak)/1.3)^2) of one oscillator, 0.001 (V - 32) of another.

    Searched from 5 m/s on in steps of a fifth, at 17.9, 21.5, 25.8, 31.0 and 37.2 m/s.
    """

    def both(speed):
        growth = 0.003 * (1.0 - ((speed - peak) / 1.3) ** 2), 0.001 * (speed - 32.0)
        blocks = [[[g, w], [-w, g]] for g, w in zip(growth, (6.0, 9.0), strict=True)]
        return Linearisation(tuple("xyzw"), block_diag(*blocks), np.zeros(4), speed)

    found = loss_of_stability(both, 5.0, high)
    assert found.parameter == pytest.approx(peak - 1.3, abs=1e-4)


@pytest.mark.parametrize("slope", [0.0125, 0.05])
def test_slow_hunting_is_lost_where_its_growth_is_zero(slope):
    """Growth 0.05 (V/22 - 1) at a frequency in proportion to the speed: 0.275 or 1.1 Hz at 22 m/s.

    At speeds that are searched the slower one passes 0.3 Hz, where no growth is zero.
    """

    def growing(speed):
        growth, rate = 0.05 * (speed / 22.0 - 1.0), 2.0 * np.pi * slope * speed
        matrix = np.array([[growth, rate], [-rate, growth]])
        return Linearisation(("x", "y"), matrix, np.zeros(2), speed)

    steady = np.array([[-0.02, 20.0], [-20.0, -0.02]])  # another mode, of 3 Hz

    def both(speed):
        matrix = np.kron([[1, 0], [0, 0]], growing(speed).matrix)
        matrix[2:, 2:] = steady
        return Linearisation(tuple("xyzw"), matrix, np.zeros(4), speed)

    lost = loss_of_stability(both, 5.0, 120.0)
    assert lost.parameter == pytest.approx(22.0, rel=1e-6)
    assert lost.modes[0].frequencies[0] == pytest.approx(22.0 * slope, rel=1e-6)


@pytest.mark.parametrize(("speed", "millimetres"), [(75.0, 11.155), (70.0, 10.185), (68.0, 9.735)])
def test_limit_cycle_of_cooperriders_bogie(birth, motions, speed, millimetres):
    """N1: amplitude of the leading wheelset, computed independently; 0.5 %."""
    branch, _ = birth
    found, _ = motions
    upper = [motion for motion in found if motion.is_stable]
    near = min(upper, key=lambda motion: abs(motion.speed - speed))
    motion = branch.at_speed(near, speed)
    assert motion.is_stable
    assert 1e3 * motion.amplitude == pytest.approx(millimetres, rel=5e-3)


def test_fold_of_cooperriders_bogie(motions):
    """N2: 66.69 m/s at 9.36 mm, 3.800 Hz, subcritical; computed independently."""
    found, fold = motions
    assert fold.speed == pytest.approx(66.69, abs=0.05)
    assert 1e3 * fold.amplitude == pytest.approx(9.36, rel=5e-3)
    assert fold.frequency == pytest.approx(3.800, rel=1e-3)
    lower = [motion for motion in found if motion.amplitude < 0.99 * fold.amplitude]
    upper = [motion for motion in found if motion.amplitude > 1.01 * fold.amplitude]
    assert len(lower) > 3
    assert len(upper) > 3
    # the branch begins towards lower speeds: the motions there are unstable
    assert all(motion.tangent[-1] < 0.0 and not motion.is_stable for motion in lower)
    assert all(motion.tangent[-1] > 0.0 and motion.is_stable for motion in upper)


def test_a_motion_at_the_bifurcation_has_the_critical_modes_period(birth, motions):
    _, start = birth
    found, _ = motions
    assert found[0].amplitude < 1e-3
    assert found[0].frequency == pytest.approx(1.0 / start.period, rel=5e-3)
    assert found[0].speed == pytest.approx(start.speed, abs=0.1)


def test_modes_keep_their_rows_where_frequencies_cross():
    """Two oscillators, one of which overtakes the other: sorted by size they would change rows.

    Their coupling is weak: on a coarse grid the eigenvectors alone would not tell them apart.
    """

    def at(p):
        k = np.array([[4.0, 1e-3], [1e-3, p**2]])
        matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-k, -0.02 * np.eye(2)]])
        return Linearisation(("a", "b", "a'", "b'"), matrix, np.zeros(4), p)

    grid = np.linspace(1.0, 3.1, 8)
    sets = follow_modes(at, grid)
    first, second = (np.array([modes.eigenvalues[i].imag for modes in sets]) for i in (0, 1))
    assert first == pytest.approx(grid, rel=1e-3)
    assert second == pytest.approx(np.full(8, 2.0), rel=1e-3)


def test_an_oscillation_that_becomes_overdamped_leaves_its_row_empty():
    def at(c):
        return Linearisation(("x", "v"), np.array([[0.0, 1.0], [-1.0, -c]]), np.zeros(2), c)

    sets = follow_modes(at, [1.0, 1.5, 2.5, 1.8])
    values = np.array([modes.eigenvalues for modes in sets])
    assert not any(map(divergent, sets))  # it grows by nan 1/s
    assert values.shape == (4, 2)
    assert values[0, 0] == pytest.approx(complex(-0.5, np.sqrt(0.75)))
    assert np.isnan(values[2:, 0]).all()
    assert np.isnan(values[:3, 1]).all()
    assert values[3, 1] == pytest.approx(complex(-0.9, np.sqrt(0.19)))


def test_the_largest_frequency_asked_for_belongs_to_the_range():
    """Two oscillators with damping; undamped frequencies 1 and 2 Hz to the last bit."""
    damped = np.array([[-0.6, 0.8], [-0.8, -0.6]]) * 2.0 * np.pi
    matrix = np.kron(np.diag([1.0, 2.0]), damped)
    modes = eigenmodes(Linearisation(("a", "b", "c", "d"), matrix, np.zeros(4), 0.0))
    for most in modes.natural_frequencies:
        count = 1 if most < 1.5 else 2
        assert len(oscillations(modes, most).eigenvalues) == count
        assert len(oscillations(modes, np.nextafter(most, 0.0)).eigenvalues) == count - 1
