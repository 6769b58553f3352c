"""Bifurcation diagrams of an amplitude equation whose branches are known in closed form.

a' = r a (l + x - x^2), x = (a/a0)^2, l = (v - 50)/20: rest loses its stability at 50 m/s, an
unstable motion goes back to the fold at l = -1/4, 45 m/s, where x = 1/2, and stable hunting from
there on has x = (1 + sqrt(1 + 4 l))/2 (Guckenheimer and Holmes 1983, Nonlinear oscillations,
dynamical systems, and bifurcations of vector fields, section 3.4).
"""

import math

import numpy as np
import pytest

from railsim.stability.branches import Branch, Point, jumps, lowest_of
from railsim.stability.diagram import diagram, settled
from railsim.stability.motion import LeftRange, Stretch
from railsim.stability.ramp import ramp

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


@pytest.fixture(scope="module")
def branches():
    return diagram(NormalForm(), [43.0, 44.0, 46.0, 48.0, 49.0, 51.0, 53.0])


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
    assert down.to < 1e-4


def test_only_changes_within_the_resolution_are_jumps():
    """Two motions of one branch that lie far apart in speed need not be a jump."""

    def branch(gap):
        return Branch("up", [Point(50.0, 1e-3, 2.0), Point(50.0 + gap, 5e-3, 2.0)])

    assert [jump.speed for jump in jumps([branch(0.0625)])] == [50.0]
    assert jumps([branch(1.0)]) == []


def test_a_motion_that_grows_is_followed_to_its_end():
    """Decaying below the threshold it counts as dead, growing from below it does not."""
    start = NormalForm().rest(51.0, 2e-6)
    assert settled(NormalForm(), start, 51.0, 51.0).amplitude == pytest.approx(
        hunting(51.0)[0], rel=0.01
    )
    start = NormalForm().rest(45.5, 4e-3)
    assert settled(NormalForm(), start, 45.5, 45.5).amplitude == pytest.approx(
        hunting(45.5)[0], rel=0.01
    )


@pytest.mark.parametrize("above", [0.1, 0.2])
def test_slow_growth_just_above_the_loss_of_stability_is_followed_to_its_end(above):
    """Within two minutes 10 um become 0.1 mm and 1.2 mm, which are no motions of their own.

    It passes 20 um by 4 % or 8 % between two looks, a known motion there is not where it ends.
    """
    start = NormalForm().rest(LOST + above, 1e-5)
    seen = settled(NormalForm(), start, LOST + above, LOST + above, [2e-5])
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
