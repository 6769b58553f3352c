"""Which time step is taken, of a scheme and a vehicle whose growths are given."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from railsim.errors import ModelError
from railsim.kernels.internal import PAD
from railsim.kernels.state import SPEED
from railsim.model import time_step
from railsim.model.time_step import Stability

H = 1e-3  # s, the step that is judged


@pytest.fixture
def stability(monkeypatch):
    """Make a judge: growth of the scheme in proportion to its step, of the vehicle any [1/s].

    In proportion, as a step that is too long has it, and friction at its limit has not.
    """

    def made(straight, vehicle, *flanges, speed=10.0, elastic=False, friction=False, **how):
        growths = {0.0: straight, **{k: growth for k, growth in enumerate(flanges, 1)}}

        def state(number):
            values = np.zeros(9)
            values[0], values[SPEED] = number, speed
            return values

        system = SimpleNamespace(
            support=SimpleNamespace(elastic=elastic),
            internal=SimpleNamespace(kind=np.array([PAD] if friction else [])),
        )
        monkeypatch.setattr(
            time_step, "_step_growth",
            lambda model, system, state, scheme, h, *more, **__: growths[state[0]] * h / H,
        )  # fmt: skip
        monkeypatch.setattr(time_step, "_vehicle_growth", lambda *_: vehicle)
        model = SimpleNamespace(profiles={"w": SimpleNamespace(name="S1002")})
        curving = [((system, state(k)), 1.0 if k == 1 else 0.5) for k in growths if k]
        scheme = how.pop("scheme", "fast")
        return Stability(model, system, state(0), scheme, lambda _: curving, **how)

    return made


@pytest.mark.parametrize(
    ("vehicle", "growth", "stable"),
    [
        # a vehicle that comes to rest: half per second beyond none
        (-3.0, 0.49, True), (-3.0, 0.51, False), (0.0, -2.0, True),
        # one above its critical speed grows by itself, the step by half per second more at most
        (4.0, 4.49, True), (4.0, 4.51, False),
        # no step doubles what deviates, whatever the vehicle does: ln 2 / 1 ms = 693/s
        (1e4, 690.0, True), (1e4, 696.0, False),
    ],
)  # fmt: skip
def test_a_step_grows_no_faster_than_the_vehicle(stability, vehicle, growth, stable):
    assert stability(growth, vehicle).holds_on_straight(H) == stable
    if growth < 600.0:  # the same of one that is longer by a margin of a tenth
        assert stability(growth / 1.1, vehicle).holds_on_straight(H, 1.1) == stable


def test_growth_that_no_shorter_step_lessens_is_that_of_dry_friction(stability, monkeypatch):
    """Up to a hundredth in a step: 10/s of 1 ms."""
    judge = stability(0.0, 0.0)
    for growth, stable in ((9.9, True), (10.1, False)):
        monkeypatch.setattr(time_step, "_step_growth", lambda *_, growth=growth, **__: growth)
        assert judge.holds_on_straight(H) == stable


@pytest.mark.parametrize(
    ("flanges", "stable"),
    [
        ((0.99 / 1.2,), True), ((1.01 / 1.2,), False),  # the whole margin, 1/s beyond none
        ((0.5, 0.99 / math.sqrt(1.2)), True), ((0.5, 1.01 / math.sqrt(1.2)), False),  # its root
    ],
)  # fmt: skip
def test_flange_contact_may_grow_by_one_per_second(stability, flanges, stable):
    judge = stability(0.4, -1.0, *flanges)
    assert judge.holds(H, 1.2) == stable
    assert judge.holds(H, 1.2) == stable  # flange contact is known now, and judged first
    assert not stability(0.6, -1.0, *flanges).holds(H, 1.2)


@pytest.mark.parametrize(
    ("speed", "growth", "how", "longest"),
    [
        # slow: in time; fast: in travel, 60 mm a step
        (10.0, 1.0, {}, 1.25e-3), (100.0, 1.0, {}, 0.06 / 100.0),
        (10.0, 1.0, {"scheme": "rk4"}, 0.5e-3),
        # steady rolling below the critical speed
        (10.0, 0.0, {"steady": True}, 5e-3 / 3.0), (100.0, 0.0, {"steady": True}, 0.075 / 100.0),
        (10.0, 1.0, {"steady": True}, 1.25e-3), (100.0, 1.0, {"steady": True}, 0.06 / 100.0),
        # elastic rails, above and below the critical speed
        (10.0, 1.0, {"elastic": True}, 2.5e-3), (100.0, 1.0, {"elastic": True}, 0.067 / 100.0),
        (100.0, 0.0, {"elastic": True}, 0.1 / 100.0),
        # dry friction
        (10.0, 0.0, {"elastic": True, "friction": True}, 1.25e-3),
        (10.0, 0.0, {"steady": True, "friction": True}, 1.25e-3),
    ],
)  # fmt: skip
def test_longest_step_is_that_of_rails_speed_and_friction(stability, speed, growth, how, longest):
    assert stability(growth, 0.0, speed=speed, **how).longest == pytest.approx(longest)


def test_a_wheel_load_of_twice_the_static_one_leaves_the_step_stable(stability):
    """The contact's frequency goes with the sixth root of the load; half of that on its rails."""
    assert stability(0.0, 0.0).margin == pytest.approx(2.0 ** (1 / 6))
    assert stability(0.0, 0.0, elastic=True).margin == pytest.approx(2.0 ** (1 / 12))


@given(st.floats(1.3e-6, 2e-3), st.sampled_from([1e-3, 5e-3]))
def test_the_longest_stable_step_that_divides_the_interval_is_chosen(limit, interval):
    """But for a tenth where there are many."""
    judge = SimpleNamespace(longest=1.25e-3, _within=lambda *_: True)
    step = Stability.choose(judge, interval, lambda h: h <= limit)
    n, least = round(interval / step), math.ceil(interval / 1.25e-3)
    assert step == pytest.approx(interval / n)
    assert step <= min(limit, 1.25e-3)
    assert n == least or step * max(1.1, n / (n - 1)) >= limit * (1.0 - 1e-9)


def test_no_step_is_an_error_that_names_its_cause(stability):
    with pytest.raises(ModelError, match="S1002 is too sharp in flange contact"):
        stability(0.0, 0.0, 1e9).choose(5e-3)
    with pytest.raises(ModelError, match="an element is too stiff"):
        stability(1e9, 0.0).choose(5e-3)
