"""Bifurcation diagrams of an amplitude equation whose branches are known in closed form.

a' = r a (l + x - x^2), x = (a/a0)^2, l = (v - 50)/20: rest loses its stability at 50 m/s, an
unstable motion goes back to the fold at l = -1/4, 45 m/s, where x = 1/2, and stable hunting from
there on has x = (1 + sqrt(1 + 4 l))/2 (Guckenheimer and Holmes 1983, Nonlinear oscillations,
dynamical systems, and bifurcations of vector fields, section 3.4).
"""

import math

import numpy as np
import pytest

from railsim.stability.branches import THRESHOLD, Branch, Point, far_apart, jumps, lowest_of
from railsim.stability.diagram import _below, diagram, settle, speeds_about
from railsim.stability.motion import LeftRange, Stretch
from railsim.stability.ramp import at_speed, excite, looked_at, ramp, tops_above
from railsim.stability.ramp import hunting as largest_hunting

A0, RATE, OMEGA, STEP = 4e-3, 4.0, 12.0, 0.01
FOLD, LOST = 45.0, 50.0


class NormalForm:
    """The amplitude equation as a motion: amplitude and phase."""

    def rest(self, speed, amplitude):
        return np.array([amplitude, 0.0])

    def stretch(self, state, begin, end, duration):
        n = round(duration / STEP)
        a, phase = state
        time, lateral = STEP * np.arange(1, n + 1), np.empty((n, 1))
        for k in range(n):
            excess = (begin + (end - begin) * (k + 0.5) / n - LOST) / 20.0
            x = (a / A0) ** 2
            a *= math.exp(RATE * STEP * (excess + x - x * x))
            phase += OMEGA * STEP
            lateral[k, 0] = a * math.cos(phase)
        return Stretch(np.array([a, phase]), time, lateral, 1e6 * lateral)


def hunting(speed):
    """Amplitudes of the stable and of the unstable motion."""
    root = math.sqrt(1.0 + 4.0 * (speed - LOST) / 20.0)
    return A0 * math.sqrt(0.5 * (1.0 + root)), A0 * math.sqrt(max(0.0, 0.5 * (1.0 - root)))


SHARES = []


@pytest.fixture(scope="module")
def branches():
    SHARES.clear()
    return diagram(NormalForm(), [43.0, 44.0, 46.0, 48.0, 49.0, 51.0, 53.0], SHARES.append)


def test_progress_rises_to_the_whole(branches):
    assert np.all(np.diff(SHARES) > -1e-9)
    assert SHARES[:7] == pytest.approx(0.25 * np.arange(1, 8) / 7.0)
    assert SHARES[7:14] == pytest.approx(0.25 + 0.25 * np.arange(1, 8) / 7.0)
    assert SHARES[-1] == 1.0


def test_branches_are_those_of_the_closed_form(branches):
    up, down = branches[:2]
    for point in down.points:
        if point.speed > FOLD + 0.5:
            assert point.amplitude == pytest.approx(hunting(point.speed)[0], rel=0.01)
        if point.speed < FOLD - 0.5:
            assert point.amplitude < 1e-4
    for point in up.points:
        expected = 0.0 if point.speed < LOST else hunting(point.speed)[0]
        assert point.amplitude == pytest.approx(expected, rel=0.01, abs=5e-5)
    assert lowest_of(branches).speed == pytest.approx(FOLD, abs=0.15)


def test_the_way_down_begins_with_the_largest_disturbance_at_the_highest_speed(monkeypatch):
    disturbed, rest = [], NormalForm.rest
    monkeypatch.setattr(NormalForm, "rest", lambda *a: (disturbed.append(a[1:]), rest(*a))[1])
    diagram(NormalForm(), [46.0, 51.0, 53.0])
    # upwards only what rests is disturbed, by 10 um
    assert next(row for row in disturbed if row[1] > 1e-5) == (53.0, 11e-3)
    assert {speed for speed, size in disturbed if size <= 1e-5} == {46.0, 51.0}


def test_unstable_motions_lie_on_the_branch_between(branches):
    (between,) = [branch for branch in branches if branch.direction == "threshold"]
    assert between.points
    for point in between.points:
        assert point.amplitude == pytest.approx(hunting(point.speed)[1], rel=0.15)
        assert not point.stable


def test_the_jump_down_is_at_the_fold(branches):
    (down,) = [jump for jump in jumps(branches) if jump.direction == "down"]
    assert down.speed == pytest.approx(FOLD, abs=0.15)
    assert down.amplitude == pytest.approx(hunting(FOLD)[0], rel=0.15)
    assert down.to == 0.0


def test_what_dies_beside_the_fold_is_not_waited_for_to_the_last(branches):
    """It lingers there: below 50 um it is at rest, as it is at the next speed."""
    died = [point.amplitude for point in branches[1].points if 44.0 < point.speed < FOLD]
    assert died
    assert all(5e-6 < amplitude < THRESHOLD for amplitude in died)


def test_only_changes_within_the_resolution_are_jumps():
    """Two motions of one branch that lie far apart in speed need not be a jump."""

    def branch(gap):
        return Branch("up", [Point(50.0, 1e-3, 2.0), Point(50.0 + gap, 5e-3, 2.0)])

    assert [jump.speed for jump in jumps([branch(0.0625)])] == [50.0]
    assert jumps([branch(1.0)]) == []


def test_a_motion_that_grows_is_followed_to_its_end():
    """Decaying below the threshold it counts as dead, growing from below it does not."""
    start = NormalForm().rest(51.0, 2e-6)
    assert settle(NormalForm(), start, 51.0, 51.0).amplitude == pytest.approx(
        hunting(51.0)[0], rel=0.01
    )
    start = NormalForm().rest(45.5, 4e-3)
    assert settle(NormalForm(), start, 45.5, 45.5).amplitude == pytest.approx(
        hunting(45.5)[0], rel=0.01
    )


@pytest.mark.parametrize("above", [0.1, 0.2])
def test_slow_growth_just_above_the_loss_of_stability_is_followed_to_its_end(above):
    """Within two minutes 10 um become 0.1 mm and 1.2 mm, which are no motions of their own.

    It passes 20 um by 4 % or 8 % between two looks, a known motion there is not where it ends.
    """
    start = NormalForm().rest(LOST + above, 1e-5)
    seen = settle(NormalForm(), start, LOST + above, LOST + above, [2e-5])
    assert seen.amplitude == pytest.approx(hunting(LOST + above)[0], rel=0.01)


class Between(NormalForm):
    """Two stable motions from 46.2 to 49.7 m/s, 4 mm and 1 mm, others 4 mm alone.

    a' = 2 a (a1 - a)(a - a2)(a - a3)/a1^3 with a3 = 1 mm; a2 = 2 mm where both are there.
    """

    def stretch(self, state, begin, end, duration):
        n = round(duration / STEP)
        a, phase = state
        time, lateral = STEP * np.arange(1, n + 1), np.empty((n, 1))
        for k in range(n):
            speed = begin + (end - begin) * (k + 0.5) / n
            upper, middle, lower = (x * 1e-3 for x in ((4.0, 2.0, 1.0)))
            if 46.2 <= speed <= 49.7:
                rate = (upper - a) * (a - middle) * (a - lower) / lower**3
            else:
                rate = (upper - a) / lower
            a *= math.exp(STEP * rate)
            phase += OMEGA * STEP
            lateral[k, 0] = a * math.cos(phase)
        return Stretch(np.array([a, phase]), time, lateral, 1e6 * lateral)


def test_a_motion_found_at_one_speed_is_followed_to_both_its_ends():
    """Where it jumps to a larger one it is the smaller one that is followed between the speeds."""
    (found,) = [
        branch
        for branch in diagram(Between(), [44.0, 48.0, 52.0], excitations=[1e-3, 4e-3])
        if branch.direction == "further"
    ]
    small = [point.speed for point in found.points if point.amplitude < 1.5e-3]
    assert min(small) == pytest.approx(46.2, abs=0.1)
    assert max(small) == pytest.approx(49.7, abs=0.1)
    assert np.all(np.diff(found.column("speed")) > 0.0)


class Derails(NormalForm):
    """What derails while it brakes from above 52 m/s."""

    def stretch(self, state, begin, end, duration):
        if end < begin and begin > 52.0:
            raise LeftRange("it derailed")
        return super().stretch(state, begin, end, duration)


def test_ramp_and_diagram_go_on_below_speeds_at_which_braking_derails():
    found = lowest_of(diagram(Derails(), [44.0, 46.0, 51.0, 53.0]))
    assert found.speed == pytest.approx(FOLD, abs=0.15)
    lowest, branch = ramp(Derails(), 43.0, 58.0)
    assert lowest.speed == pytest.approx(FOLD, abs=0.15)
    assert branch.points[0].speed <= 52.0


@pytest.mark.parametrize(("low", "slowest", "died"), [(43.0, FOLD, 1), (46.0, 46.0, 0)])
def test_a_ramp_ends_one_step_after_hunting_dies_or_at_the_lowest_speed(low, slowest, died):
    """Steps of 1 s at 0.05 m/s2, from 6 m/s above where hard braking kills it, or the first."""
    shares = []
    lowest, branch = ramp(NormalForm(), low, 48.0, shares.append)
    assert lowest.speed == pytest.approx(slowest, abs=0.15)
    assert lowest.amplitude == pytest.approx(hunting(lowest.speed)[0], rel=0.05)
    assert branch.end == lowest.speed
    alive = [point.hunts for point in branch.points]
    assert alive == [True] * (len(alive) - died) + [False] * died
    speeds = branch.column("speed")
    assert speeds[0] == 48.0
    steps = np.diff(speeds)
    gentle = np.flatnonzero(steps > -0.1)
    assert steps[: gentle[0]] == pytest.approx(-0.5)
    assert steps[gentle[:-1]] == pytest.approx(-0.05)
    assert np.all(np.diff(shares) > -1e-9)
    assert 0.5 < shares[-1] <= 0.7


class Recorded:
    """Motions of an amplitude that the disturbance and the speed give; what was asked of it.

    `lasts`: amplitude [m] of a state at a speed; None derails.
    """

    def __init__(self, lasts, period=0.25):
        self.asked, self.lasts, self.period = [], lasts, period

    def rest(self, speed, amplitude):
        return np.array([amplitude])

    def stretch(self, state, begin, end, duration):
        self.asked.append((float(state[0]), begin, end, duration))
        found = self.lasts(float(state[0]), end)
        if found is None:
            raise LeftRange("it derailed")
        time = 0.001 * np.arange(round(1000 * duration))
        lateral = found * np.cos(2.0 * np.pi * time / self.period)[:, None]
        return Stretch(np.array([found]), time, lateral, 1e6 * lateral)


def test_a_disturbance_that_derails_is_halved_until_it_does_not():
    """It settles for 10 s and is looked at for 2 s; below 10 um it is given up."""
    motion = Recorded(lambda state, _: None if state > 2e-3 else state)
    seen = excite(motion, 40.0, 11e-3)
    assert [row[0] for row in motion.asked] == pytest.approx(
        [11e-3, 5.5e-3, 2.75e-3] + [1.375e-3] * 2
    )
    assert [row[3] for row in motion.asked] == [10.0, 10.0, 10.0, 10.0, 2.0]
    assert all(row[1] == row[2] == 40.0 for row in motion.asked)
    assert seen.amplitude == pytest.approx(1.375e-3, rel=1e-3)
    assert seen.frequency == pytest.approx(4.0, rel=1e-3)
    assert seen.sum_Y_rms == pytest.approx(1.375e3 / math.sqrt(2.0), rel=1e-2)
    motion = Recorded(lambda state, _: None)
    with pytest.raises(LeftRange):
        excite(motion, 40.0, 8e-5)
    assert [row[0] for row in motion.asked] == pytest.approx([8e-5, 4e-5, 2e-5, 1e-5])


@pytest.mark.parametrize(("dies_above", "tried"), [(1.0, [8e-3]), (5e-3, [8e-3, 3e-3]),
                                                   (1e-9, [8e-3, 3e-3, 1e-3])])  # fmt: skip
def test_the_largest_disturbance_counts_or_a_smaller_one_where_it_dies(dies_above, tried):
    motion = Recorded(lambda state, _: 0.0 if state > dies_above else state)
    seen = largest_hunting(motion, 40.0, [3e-3, 1e-3, 8e-3])
    assert [row[0] for row in motion.asked if row[3] == 10.0] == tried
    assert seen.amplitude == pytest.approx(0.0 if dies_above < 1e-3 else tried[-1], rel=1e-2)


@pytest.mark.parametrize(
    ("period", "duration", "looks"),
    [(0.25, 1.0, [1.0]), (1.5, 1.0, [1.0, 4.0]), (9.0, 5.0, [5.0]), (9.0, 4.0, [4.0])],
)
def test_a_motion_too_slow_for_a_look_is_looked_at_for_four_seconds(period, duration, looks):
    """But one of less than 10 um is rest."""
    motion = Recorded(lambda state, _: state, period)
    looked_at(motion, np.array([1e-3]), 40.0, duration)
    assert [row[3] for row in motion.asked] == looks
    motion = Recorded(lambda state, _: state, period)
    looked_at(motion, np.array([4e-6]), 40.0, duration)
    assert [row[3] for row in motion.asked] == [duration]


@pytest.mark.parametrize(("begin", "end", "asked"), [
    (40.0, 37.0, [(1e-3, 40.0, 37.0, 6.0)]), (40.0, 41.0, [(1e-3, 40.0, 41.0, 2.0)]),
    (40.0, 40.0, []),
])  # fmt: skip
def test_a_state_is_brought_to_another_speed_at_half_a_metre_per_second_squared(begin, end, asked):
    motion = Recorded(lambda state, _: state)
    assert at_speed(motion, np.array([1e-3]), begin, end) == pytest.approx([1e-3])
    assert motion.asked == asked


@pytest.mark.parametrize(("speed", "end", "tops"), [
    (40.0, 60.0, [42.0, 40.4]), (40.0, 44.0, [42.0, 40.4]), (40.0, 42.0, [41.0, 40.2]),
])  # fmt: skip
def test_further_ramps_begin_in_the_tenth_above_the_loss_of_stability(speed, end, tops):
    assert tops_above(speed, end) == pytest.approx(tops)


@pytest.mark.parametrize(("unstable", "points", "speeds"), [
    ([], 3, [20.0, 60.0, 100.0]), ([50.0], 8, [40.0, 44.5, 49.0, 53.5, 58.0, 62.5, 81.25, 100.0]),
    ([50.0], 3, [40.0, 70.0, 100.0]), ([90.0], 3, [72.0, 86.0, 100.0]),
    ([22.0, 50.0], 4, [20.0, 41.25, 62.5, 100.0]),
])  # fmt: skip
def test_three_quarters_of_the_speeds_stand_about_the_loss_of_stability(unstable, points, speeds):
    """From 0.8 to 1.25 times these speeds, within the range of 20 to 100 m/s."""
    assert speeds_about(unstable, 20.0, 100.0, points) == pytest.approx(speeds)


@pytest.mark.parametrize(("speeds", "low", "below"), [
    ([40.0, 42.0, 45.0], 33.0, [38.0, 36.0, 33.0]), ([40.0, 42.0], 34.0, [38.0, 36.0, 34.0]),
    ([40.0], 37.5, [39.0, 37.5]), ([40.0, 40.01], 39.77, [39.9, 39.77]),
    ([40.0, 42.0], 40.0, []), ([40.0, 42.0], 39.5, [39.5]),
])  # fmt: skip
def test_a_diagram_goes_on_below_its_speeds_in_steps_as_its_first(speeds, low, below):
    """A metre per second where there is one; the last step is up to half a step longer."""
    assert _below(speeds, low) == pytest.approx(below)


@pytest.mark.parametrize(
    ("one", "other", "apart"),
    [
        (4.0e-3, 3.01e-3, False), (4.0e-3, 2.99e-3, True), (1.0e-3, 0.51e-3, False),
        (1.0e-3, 0.49e-3, True), (0.6e-3, 0.29e-3, True), (0.6e-3, 0.31e-3, False),
        (2.0e-3, 1.501e-3, False), (2.0e-3, 1.49e-3, True),
    ],
)  # fmt: skip
def test_amplitudes_lie_apart_by_a_quarter_and_half_a_millimetre_or_by_a_half(one, other, apart):
    assert far_apart(one, other) == far_apart(other, one) == apart
