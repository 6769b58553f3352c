"""Records: compiled code sees the numbers and arrays of a named tuple through its address."""

import pickle
from typing import NamedTuple

import numpy as np
import pytest

from railsim.kernels import compiled
from railsim.kernels.record import Record, record


@record
class Inner(NamedTuple):
    table: np.ndarray
    factor: float


@record
class Outer(NamedTuple):
    count: int
    inner: Inner
    out: np.ndarray


@compiled(python=False)
def row(inner, i):
    return inner.factor * inner.table[i, 1]


@compiled
def fill(outer):
    for i in range(outer.count):
        outer.out[i] += row(outer.inner, i)
    return outer.inner.table.shape[0], outer.inner.table[1:, 0].sum()


def made(factor=2.0):
    return Outer(3, Inner(np.arange(6.0).reshape(3, 2), factor), np.zeros(3))


def test_compiled_code_reads_and_writes_the_arrays_of_a_record():
    outer = made()
    assert fill(outer) == (3, 6.0)
    np.testing.assert_array_equal(outer.out, [2.0, 6.0, 10.0])


def test_replaced_field_is_seen_and_an_integer_serves_as_a_number():
    outer = made()
    fill(outer)
    other = outer._replace(inner=outer.inner._replace(factor=-1), out=np.zeros(3))
    fill(other)
    np.testing.assert_array_equal(other.out, [-1.0, -3.0, -5.0])
    assert len(fill.signatures) == 1


def test_addresses_do_not_travel_to_another_process():
    outer = made()
    fill(outer)
    copy = pickle.loads(pickle.dumps(outer))
    assert isinstance(copy, Outer)
    assert "address" not in vars(copy)
    fill(copy)
    np.testing.assert_array_equal(copy.out, [4.0, 12.0, 20.0])


def test_array_of_another_order_is_refused():
    with pytest.raises(TypeError, match=r"Inner\.table: an array in C order"):
        fill(Outer(1, Inner(np.zeros((3, 2)).T, 1.0), np.zeros(3)))


def test_signal_heard_while_an_address_is_made_is_raised_and_ends_nothing_else(monkeypatch):
    """Ctrl-C is raised between any two instructions of Python, also in those that make it."""

    def interrupted(record):
        raise KeyboardInterrupt

    fill(made())
    with monkeypatch.context() as patch:
        patch.setattr(Record, "address", property(interrupted))
        with pytest.raises(KeyboardInterrupt):
            fill(made())
    assert fill(made()) == (3, 6.0)
