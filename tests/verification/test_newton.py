"""Newton's method of steady rolling on functions whose roots are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from railsim.linear.steady import NotConverged, SteadyRolling, follow

TURNED, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))


def solver(forces, inertias=1.0):
    """The method for forces over the state's first three members, the last one not sought."""
    made = SteadyRolling.__new__(SteadyRolling)
    made._unknowns, made._inertias = np.arange(3), np.full(3, inertias)
    made._forces = lambda states: np.apply_along_axis(lambda x: forces(x[:3]), -1, states)
    made.rolling_guess = lambda guess, speed: guess.copy()
    made._equations = ("a", "b", "c")
    index = SimpleNamespace(largest_left=lambda names, left, count: f"{names[np.argmax(left)]}")
    made.model = SimpleNamespace(index=index)
    return made


def linear(sizes):
    """A (x - x0) with the singular values `sizes`, and x0."""
    root = np.array([0.3, -0.2, 0.5])
    matrix = TURNED @ np.diag(sizes) @ TURNED.T[::-1]
    return (lambda x: matrix @ (x - root)), root


@pytest.mark.parametrize("sizes", [(3.0, 1.0, 0.2), (1.0, -1.0, 40.0)])
def test_one_step_solves_what_is_linear(sizes):
    forces, root = linear(sizes)
    state = np.array([1.0, 2.0, -1.0, 7.0])
    after, left = solver(forces)._better(state, forces(state[:3]))
    assert after == pytest.approx([*root, 7.0], abs=1e-6)
    assert np.abs(left).max() < 1e-5
    assert state == pytest.approx([1.0, 2.0, -1.0, 7.0])


@pytest.mark.parametrize("still", [0, 1, 2])
def test_what_nothing_turns_is_left_where_it_is(still):
    """As the spin of wheels without friction: a column of zeros, and a row of them."""
    root, sizes = np.array([0.3, -0.2, 0.5]), np.array([3.0, -1.0, 20.0])
    sizes[still] = 0.0
    state = np.array([1.0, 2.0, -1.0, 7.0])
    after, left = solver(lambda x: sizes * (x - root))._better(state, sizes * (state[:3] - root))
    root[still] = state[still]
    assert after == pytest.approx([*root, 7.0], abs=1e-6)
    assert np.abs(left).max() < 1e-5


@pytest.mark.parametrize("other", [1.0, -2.0])
def test_of_two_that_act_together_each_goes_its_share(other):
    """x + b y = c: the shortest step is along (1, b)."""
    state, residual = np.array([1.0, 2.0, 5.0, 7.0]), 3.0

    def forces(x):
        size = (x[0] - 1.0) + other * (x[1] - 2.0) + residual
        return np.array([size, 0.0, x[2]])

    after, _ = solver(forces)._better(state, forces(state[:3]))
    change = -residual / (1.0 + other**2) * np.array([1.0, other])
    assert after == pytest.approx([*(state[:2] + change), 0.0, 7.0], abs=1e-6)


@pytest.mark.parametrize(("start", "factor"), [(1.0, 1.0), (2.0, 0.5), (6.0, 0.125)])
def test_a_step_that_leaves_larger_forces_is_halved_until_it_does_not(start, factor):
    """arctan x: a whole step goes from 2 to -3.54, half of it to -0.77."""
    state = np.array([start, start, start, 7.0])
    whole = -np.arctan(start) * (1.0 + start**2)
    after, _ = solver(np.arctan)._better(state, np.arctan(state[:3]))
    assert after[:3] == pytest.approx(np.full(3, start + factor * whole), rel=1e-5)


def test_forces_that_nothing_makes_smaller_end_the_search_with_the_largest_named():
    def forces(x):
        return np.array([1.0, 2.0 + x[1] ** 2, 0.5 + x[2] ** 2])

    made = solver(forces)
    assert made._better(np.array([0.0, 0.0, 0.0, 7.0]), forces(np.zeros(3))) is None
    with pytest.raises(NotConverged, match="no steady state; b"):
        made.solve(np.array([0.0, 0.3, 0.1, 7.0]), 20.0)


@pytest.mark.parametrize(("left", "fine"), [(0.99e-5, True), (1.01e-5, False)])
@pytest.mark.parametrize("inertias", [1.0, 500.0])
def test_accelerations_of_a_hundred_thousandth_are_as_good_as_none(left, fine, inertias):
    """What is left is judged as an acceleration: force over inertia."""
    made = solver(lambda x: np.array([inertias * left, 0.0, 0.0]), inertias)
    guess = np.array([0.1, 0.2, 0.3, 7.0])
    if fine:
        assert made.solve(guess, 20.0) == pytest.approx(guess)
    else:
        with pytest.raises(NotConverged):
            made.solve(guess, 20.0)


class Steps:
    """Solvers that converge where a step is not longer than `longest`; what was guessed there."""

    def __init__(self, monkeypatch, longest):
        self.longest, self.tried = longest, []
        monkeypatch.setattr("railsim.linear.steady.SteadyRolling", self)

    def __call__(self, model, share):
        def settled(guess, speed):
            raise NotConverged("no steady state")  # accelerations lead nowhere

        return SimpleNamespace(
            solve=lambda guess, speed: self.solve(share, guess, speed),
            settled=settled,
            evaluate=lambda state: None,
        )

    def solve(self, share, guess, speed):
        known = max((s for s, *_, fine in self.tried if fine), default=0.0)
        fine = share - known <= self.longest
        self.tried.append((share, float(guess[0]), speed, fine))
        if not fine:
            raise NotConverged("made to fail")
        return np.array([3.0 * share])


@pytest.mark.parametrize(("longest", "shares"), [
    (1.0, [1.0]), (0.5, [1.0, 0.5, 1.0]), (0.3, [1.0, 0.5, 0.25]), (0.02, [1.0, 0.5, 0.25, 0.125]),
])  # fmt: skip
def test_a_way_that_is_too_far_is_gone_in_halves(monkeypatch, longest, shares):
    """From the second step on along the line through the last two states."""
    steps = Steps(monkeypatch, longest)
    found, _ = follow(None, lambda share: (share, 40.0 * share), np.zeros(1), smallest=1e-4)
    assert found == pytest.approx([3.0])
    taken = [row[0] for row in steps.tried]
    assert list(dict.fromkeys(taken))[: len(shares)] == pytest.approx(list(dict.fromkeys(shares)))
    good = [row for row in steps.tried if row[3]]
    assert all(speed == pytest.approx(40.0 * share) for share, _, speed, _ in good)
    for share, guess, _, _ in good[1:]:
        assert guess == pytest.approx(3.0 * share)
    assert good[-1][0] == 1.0


@pytest.mark.parametrize("smallest", [1.0 / 64.0, 0.2])
def test_a_way_ends_where_steps_become_too_small(monkeypatch, smallest):
    steps = Steps(monkeypatch, 0.0)
    with pytest.raises(NotConverged, match="made to fail"):
        follow(None, lambda share: (share, 40.0), np.zeros(1), smallest=smallest)
    assert min(row[0] for row in steps.tried) >= smallest > 0.5 * min(r[0] for r in steps.tried)
