"""Periodic motions by shooting against an amplitude equation whose motions are known.

r' = 4 r (l + X - X^2), angle' = 12 (1 + X/10), X = r^2, l = (v - 50)/20, besides z' = -3 z: motions
with l = X^2 - X turn back at 45 m/s, X = 1/2, last 2 pi over the rate of the angle, and have the
multipliers exp(4 (2 X - 4 X^2) T) and exp(-3 T) (Guckenheimer and Holmes 1983, section 3.4).
"""

from types import SimpleNamespace

import numpy as np
import pytest

from railsim.errors import ModelError
from railsim.stability.motion import LeftRange
from railsim.stability.periodic import PeriodicMotion, Shooting
from railsim.stability.vehicle_flow import VehicleFlow

A0, RATE, OMEGA, DECAY = 4e-3, 4.0, 12.0, 3.0
SCALE = np.full(3, 1e-3)


class AmplitudeEquation:
    """States (x, y, z) [m], moved by Runge's and Kutta's fourth order along the logarithm of r."""

    def after(self, states, durations, speeds):
        x, y, z = states.T
        u, angle = np.log(np.hypot(x, y) / A0), np.arctan2(y, x)
        step, excess = durations / 60, (speeds - 50.0) / 20.0

        def rates(u):
            X = np.exp(2.0 * u)
            return RATE * (excess + X - X * X), OMEGA * (1.0 + 0.1 * X)

        for _ in range(60):
            k1 = rates(u)
            k2 = rates(u + 0.5 * step * k1[0])
            k3 = rates(u + 0.5 * step * k2[0])
            k4 = rates(u + step * k3[0])
            du, turn = (a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
            u, angle = u + step / 6 * du, angle + step / 6 * turn
        r = A0 * np.exp(u)
        return np.stack([r * np.cos(angle), r * np.sin(angle), z * np.exp(-DECAY * durations)], 1)

    def amplitude(self, state, duration, speed):
        return float(np.hypot(state[0], state[1]))


def is_known(motion):
    X = (motion.amplitude / A0) ** 2
    period = 2.0 * np.pi / (OMEGA * (1.0 + 0.1 * X))
    assert motion.speed == pytest.approx(50.0 + 20.0 * (X * X - X), abs=1e-4)
    assert motion.period == pytest.approx(period, rel=1e-5) == 1.0 / motion.frequency
    known = np.exp([RATE * (2.0 * X - 4.0 * X * X) * period, -DECAY * period])
    found = np.sort(np.real(motion.multipliers))[::-1]
    assert found == pytest.approx(np.sort(known)[::-1], abs=1e-3)
    assert motion.is_stable == (found[0] < 1.001)
    assert np.linalg.norm(motion.tangent) == pytest.approx(1.0)
    assert np.linalg.norm(motion.along) == pytest.approx(1.0)
    # perpendicular to the radius
    assert abs(motion.along[:2] @ motion.state[:2]) < 1e-3 * np.linalg.norm(motion.state)
    return X


@pytest.fixture(scope="module")
def branch():
    """Shooting, and the motions from the loss of stability at 50 m/s through the fold."""
    shooting = Shooting(AmplitudeEquation(), SCALE, period_scale=0.02, speed_scale=1.0)
    shape = np.array([1.0, -1.0j, 0.0]) * 5.0
    start = shooting.beginning(1e-12 * np.ones(3), shape, OMEGA / 2.0 / np.pi, 50.0)
    return shooting, start, list(shooting.motions(start, 0.5, lambda motion: motion.speed < 52.0))


def test_a_branch_has_motions_periods_and_multipliers_of_the_closed_form(branch):
    _, start, motions = branch
    assert start.tangent == pytest.approx([1.0, 0.0, 0.0, 0.0, 0.0])
    assert start.along == pytest.approx([0.0, 1.0, 0.0])
    assert start.period == pytest.approx(2.0 * np.pi / OMEGA)
    X = [is_known(motion) for motion in motions]
    assert np.all(np.diff(X) > 0.0)
    assert motions[-1].speed > 52.0 > motions[-2].speed
    for share, motion in zip(X, motions, strict=True):
        assert motion.is_stable == (share > 0.5)
        assert (motion.tangent[-1] > 0.0) == (share > 0.5)
    scale = np.array([*SCALE, 0.02, 1.0])
    u = [np.array([*m.state, m.period, m.speed]) / scale for m in (start, *motions)]
    for before, one, other in zip([start, *motions], u, u[1:], strict=False):
        assert before.tangent @ (other - one) == pytest.approx(0.5, abs=1e-6)
        assert abs(before.along @ (other - one)[:3]) < 1e-6


def test_the_fold_is_where_the_closed_form_turns_back(branch):
    shooting, _, motions = branch
    (k,) = (k for k, m in enumerate(motions[1:]) if motions[k].tangent[-1] < 0.0 < m.tangent[-1])
    fold = shooting.fold(motions[k], motions[k + 1])
    assert fold.speed == pytest.approx(45.0, abs=1e-4)
    assert is_known(fold) == pytest.approx(0.5, abs=2e-3)
    # two motions on one side of it have none between them
    assert shooting.fold(motions[k + 1], motions[k + 2]) is motions[k + 2]


def test_a_fold_takes_few_searches_and_of_motions_that_are_known_none(monkeypatch, branch):
    """Each takes a matrix, 10 s where a period lasts 3 s."""
    shooting, _, motions = branch
    (k,) = (k for k, m in enumerate(motions[1:]) if motions[k].tangent[-1] < 0.0 < m.tangent[-1])
    searches, solved = [], shooting._solve
    monkeypatch.setattr(shooting, "_solve", lambda *at: searches.append(at) or solved(*at))
    fold = shooting.fold(motions[k], motions[k + 1])
    assert fold.speed == pytest.approx(45.0, abs=1e-4)
    assert len(searches) <= 3
    searches.clear()
    assert shooting.fold(fold, motions[k + 1]) is fold
    assert shooting.fold(motions[k], fold) is fold
    assert searches == []


@pytest.mark.parametrize(("speed", "share"), [(46.0, 0.723607), (48.0, 0.887298), (48.0, 0.112702)])
@pytest.mark.parametrize("phase", [0.0, 2.0, 4.0])
def test_the_motion_nearest_to_that_of_a_run_is_found_from_any_phase(branch, speed, share, phase):
    """X = (1 +- sqrt(1 + 4 l))/2; the run is 5 % larger and its period 2 % longer."""
    shooting, *_ = branch
    r = 1.05 * A0 * np.sqrt(share)
    run = np.array([r * np.cos(phase), r * np.sin(phase), 0.0])
    period = 1.02 * 2.0 * np.pi / (OMEGA * (1.0 + 0.1 * share))
    found = shooting.nearest(run, period, speed)
    assert found.speed == pytest.approx(speed)
    assert is_known(found) == pytest.approx(share, abs=1e-5)
    ahead = np.array([-np.sin(phase), np.cos(phase), 0.0])
    assert abs(ahead @ found.state) < 0.02 * found.amplitude
    assert run @ found.state > 0.0
    near = shooting.at_speed(found, speed + 0.5)
    assert near.speed == pytest.approx(speed + 0.5)
    is_known(near)


class Hidden(AmplitudeEquation):
    """The same motions among 200 members that decay at 3/s to 80/s, all mixed by a rotation."""

    def __init__(self):
        self.decay = np.linspace(DECAY, 80.0, 200)
        self.mixed = np.linalg.qr(np.random.default_rng(1).standard_normal((202, 202)))[0]
        self.flows = 0

    def after(self, states, durations, speeds):
        self.flows += len(states)
        own = states @ self.mixed
        own[:, :2] = super().after(own[:, :3], durations, speeds)[:, :2]
        own[:, 2:] *= np.exp(-np.outer(durations, self.decay))
        return own @ self.mixed.T

    def amplitude(self, state, duration, speed):
        return super().amplitude(state @ self.mixed, duration, speed)


def test_what_dies_within_a_period_takes_no_flows():
    """X = 0.887298; a tenth of all members is left after a period with 1 % and more."""
    flow, X = Hidden(), 0.887298
    shooting = Shooting(flow, np.full(202, 1e-3), period_scale=0.02, speed_scale=1.0)
    run = np.concatenate([[1.05 * A0 * np.sqrt(X)], np.zeros(201)]) @ flow.mixed.T
    found = shooting.nearest(run, 0.49, 48.0)
    assert flow.flows < 202  # of one matrix by differences of all members
    assert found.amplitude == pytest.approx(A0 * np.sqrt(X), rel=1e-5)
    assert found.period == pytest.approx(2.0 * np.pi / (OMEGA * (1.0 + 0.1 * X)), rel=1e-5)
    own = np.exp(RATE * (2.0 * X - 4.0 * X * X) * found.period)
    known = np.sort(np.append(np.exp(-flow.decay * found.period), own))[::-1]
    left = np.sort(np.abs(found.multipliers))[::-1]
    assert left[:20] == pytest.approx(known[:20], abs=1e-3)


def test_a_motion_off_the_tangent_is_on_another_branch(monkeypatch, branch):
    """By 45 degrees and more: a shorter step is tried."""
    shooting, start, motions = branch
    monkeypatch.setattr(shooting, "_solve", lambda *_: (motions[0], 5))
    assert shooting.ahead(start, 0.5) == (motions[0], 5)
    with pytest.raises(ModelError, match="not on one branch"):
        shooting.ahead(start, 0.3)


def test_a_fold_beside_which_no_motion_is_found_is_the_motion_after_it(monkeypatch, branch):
    shooting, _, motions = branch

    def ahead(now, length):
        raise ModelError("no motion")

    monkeypatch.setattr(shooting, "ahead", ahead)
    assert shooting.fold(motions[0], motions[1]) is motions[1]


def test_below_the_fold_no_motion_is_found(branch):
    shooting, _, motions = branch
    with pytest.raises(ModelError, match="does not converge"):
        shooting.nearest(np.array([0.7 * A0, 0.0, 0.0]), 0.5, 43.0)
    assert all(motion.speed > 44.99 for motion in motions)


@pytest.mark.parametrize(
    ("fails", "quick", "tried"),
    [
        (lambda k, length: False, 8, [1, 1, 1, 1]),
        (lambda k, length: k == 0, 8, [1, 1 / 2, 3 / 4, 1, 1]),
        (lambda k, length: k == 0, 9, [1, 1 / 2, 1 / 2, 1 / 2, 1 / 2]),
        (lambda k, length: length > 0.2, 9, [1, 1 / 2, 1 / 4, 1 / 8, 1 / 8, 1 / 8, 1 / 8]),
        (lambda k, length: True, 8, [2.0**-n for n in range(9)]),
    ],
)  # fmt: skip
def test_steps_that_fail_are_halved_and_grow_by_a_half_where_few_iterations_were_needed(
    monkeypatch, branch, fails, quick, tried
):
    shooting, *_ = branch
    lengths = []

    def ahead(now, length):
        lengths.append(length / 0.8)
        if fails(len(lengths) - 1, length / 0.8):
            raise ModelError("made to fail")
        return SimpleNamespace(count=now.count + 1), quick

    monkeypatch.setattr(shooting, "ahead", ahead)
    begin = SimpleNamespace(count=0)
    followed = shooting.motions(begin, 0.8, lambda motion: motion.count < 4)
    if fails(99, 1e-3):
        with pytest.raises(ModelError, match="made to fail"):
            list(followed)
    else:
        assert [motion.count for motion in followed] == [1, 2, 3, 4]
    assert lengths == pytest.approx(tried)


@pytest.mark.parametrize(("sizes", "stable"), [
    ([0.5, 1.0009], True), ([0.5, -1.0009], True), ([0.5, 1.0011], False), ([0.8 + 0.7j], False),
])  # fmt: skip
def test_a_motion_is_stable_whose_multipliers_lie_within_the_unit_circle(sizes, stable):
    """To a thousandth, the error of difference quotients."""
    nothing = np.zeros(1)
    motion = PeriodicMotion(nothing, 0.5, 40.0, 1e-3, np.array(sizes), nothing, nothing)
    assert motion.is_stable == stable
    assert motion.frequency == 2.0


class Turning:
    """A time loop in which members 0 and 1 swing by 3 mm and 2 mm at 2 Hz and the wheel spins."""

    def __init__(self):
        self.asked = []

    def advance(self, system, state, step, chunk):
        self.asked.append((step, chunk.first, chunk.steps, chunk.every, state[-3:].tolist()))
        if state[0] > 50e-3:
            raise LeftRange("it derailed")
        self.time = step * np.arange(chunk.first, chunk.steps + 1, min(chunk.every, 10**6))
        state[:2] += self.at(step * chunk.steps)
        return len(self.time)

    def own_copy(self):
        return self

    def at(self, t):
        late = np.array([0.0, 1.0])
        waves = 4.0 * np.pi * np.asarray(t)[..., None]
        return np.array([3e-3, 2e-3]) * (np.cos(waves + late) - np.cos(late))

    def lateral(self, rows):
        aside = np.array([0.0, 0.1])  # the second one stands 100 mm
        return self.at(self.time)[:rows] + aside

    def records(self, rows):
        values = np.zeros((rows, 9))
        values[:, :2], values[:, 5], values[:, -1] = self.lateral(rows), -50.0, 25.0
        return values


@pytest.fixture
def turning():
    flow = VehicleFlow.__new__(VehicleFlow)
    flow._motion, flow._system, flow._step = Turning(), None, 1e-3
    flow._rest = np.arange(9.0)
    flow._indices, flow._floors = np.array([0, 1, 5]), np.array([1e-4, 1e-4, 0.2])
    flow._spins, flow._per_speed = np.array([5]), np.array([-2.0])
    return flow


def test_what_moves_is_taken_from_a_state_and_put_back_with_spins_less_those_of_rolling(turning):
    state = np.array([0.1, 0.2, 7.0, 7.0, 7.0, -50.3, 7.0, 7.0, 25.0])
    reduced = turning.reduce(state)
    assert reduced == pytest.approx([0.1, 0.2, -0.3])
    found = turning.full(reduced, 30.0)
    assert found[:6] == pytest.approx([0.1, 0.2, 2.0, 3.0, 4.0, -60.3])
    assert found[-1] == 30.0
    assert turning.reduce(found) == pytest.approx(reduced)


@pytest.mark.parametrize(("duration", "steps"), [(0.5, 500), (0.4996, 500), (0.003, 8)])
def test_periods_have_whole_steps_about_as_long_as_those_of_runs(turning, duration, steps):
    """All motions those of the first, eight at least; one that derails has no end."""
    states = np.array([[0.0, 0.0, 0.1], [60e-3, 0.0, 0.1], [1e-3, 2e-3, 0.3]])
    durations, speeds = np.array([duration, 0.5, 0.25]), np.array([20.0, 21.0, 22.0])
    ends = turning.after(states, durations, speeds)
    assert np.isnan(ends[1]).all()
    for k in (0, 2):
        moved = np.append(turning._motion.at(durations[k]), 0.0)
        assert ends[k] == pytest.approx(states[k] + moved, abs=1e-12)
    asked = sorted(turning._motion.asked, key=lambda row: row[4][-1])  # threads take turns
    assert [row[2] for row in asked] == [steps] * 3
    assert [row[0] for row in asked] == pytest.approx(durations / steps)
    assert [row[4][-1] for row in asked] == [20.0, 21.0, 22.0]


def test_an_amplitude_is_half_the_largest_travel_of_a_wheelset_within_a_period(turning):
    """A scale is the travel of each component in a motion of a millimetre, or its least size."""
    found = turning.amplitude(np.array([0.0, 0.0, 0.1]), 0.5, 25.0)
    assert found == pytest.approx(3e-3, rel=5e-3)
    ((step, first, steps, every, _),) = turning._motion.asked
    assert (step, first, steps, every) == (1e-3, 0, 480, 12)  # 40 records
    scale = turning.scale(np.array([0.0, 0.0, 0.1]), 0.5, 25.0, 3e-3)
    assert scale == pytest.approx([1e-3, 2e-3 / 3.0, 0.2], rel=1e-2)
