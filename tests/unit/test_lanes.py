"""Eight numbers side by side: each lane has what the same formula gives for one number."""

import sys
import tracemalloc

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.kernels import compiled, lanes_plain
from railsim.kernels.alignment import CACHE_LINE, aligned_copy, aligned_zeros
from railsim.kernels.lanes import (
    LANES,
    add_rows,
    add_to_pairs,
    gather_from,
    lane_numbers,
    load_part,
    load_rows,
    paired_numbers,
    row_starts,
    square_root,
    store_lanes,
    store_rows,
    where_beyond,
)
from railsim.kernels.rotation import sine_cosine_lanes
from railsim.model.assembly import side_by_side

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="what is compiled is tested")
WIDTH = 11


@compiled
def turn(table, out, n):
    """Store the columns of rows in another order, and a sum of two."""
    for first in range(0, n, LANES):
        rows = row_starts(lane_numbers(first, n), WIDTH)
        a, b, c, d, e = load_rows(table, rows, 1, 5)
        store_rows(out, rows, 2, (e, d, c, b, a, a + 2.0 * b))


@compiled
def some(x, out, n):
    """Copy `n` numbers, by eights; what is beyond them is 0."""
    for first in range(0, n, LANES):
        store_lanes(out, first, load_part(x, first, n - first))


@compiled
def collect(table, one, two, total):
    """Add rows of `table` to the rows `one` of `total`, and what is left of 1 to the rows `two`."""
    n = one.shape[0]
    for first in range(0, n, LANES):
        count = min(n - first, LANES)
        values = load_rows(table, row_starts(lane_numbers(first, n), 8), 0, 8)
        a, b, c, d, e, f, g, h = values
        rest = (1.0 - a, 1.0 - b, 1.0 - c, 1.0 - d, 1.0 - e, 1.0 - f, 1.0 - g, 1.0 - h)
        add_to_pairs(
            total,
            row_starts(gather_from(one, first), 8),
            row_starts(gather_from(two, first), 8),
            0,
            values,
            rest,
            count,
        )


@compiled
def collect_three(table, where, total):
    """Add the first three columns of `table` to the rows `where` of `total`."""
    n = where.shape[0]
    for first in range(0, n, LANES):
        values = load_rows(table, row_starts(lane_numbers(first, n), 8), 0, 3)
        add_rows(total, row_starts(gather_from(where, first), 8), 5, values, min(n - first, LANES))


@compiled
def elementary(x, out):
    """Functions of eight numbers."""
    rows = row_starts(lane_numbers(0, LANES), 1)
    (v,) = load_rows(x, rows, 0, 1)
    s, c = sine_cosine_lanes(v)
    store_rows(
        out,
        row_starts(lane_numbers(0, LANES), 4),
        0,
        (s, c, square_root(v * v), where_beyond(v, 1.0, -v, v / 4.0)),
    )


@pytest.mark.parametrize("n", [1, 7, 8, 9, 23])
def test_columns_of_rows_are_turned_and_turned_back(n):
    table = np.random.default_rng(n).normal(size=(n, WIDTH))
    out = np.zeros((n, WIDTH))
    turn(table, out, n)
    np.testing.assert_array_equal(out[:, 2:7], table[:, 5:0:-1])
    np.testing.assert_array_equal(out[:, 7], table[:, 1] + 2.0 * table[:, 2])
    assert not out[:, :2].any()
    assert not out[:, 8:].any()


@pytest.mark.parametrize("n", [1, 8, 21])
def test_rows_that_meet_in_one_row_are_all_added(n):
    generator = np.random.default_rng(n)
    table = generator.normal(size=(n, 8))
    one, two = generator.integers(0, 4, size=(2, n))
    total = np.ones((4, 8))
    collect(table, one, two, total)
    expected = np.ones((4, 8))
    for row, i, j in zip(table, one, two, strict=True):
        expected[i] += row
        expected[j] += 1.0 - row
    # one after the other, as here: to the last bit
    np.testing.assert_array_equal(total, expected)


@pytest.mark.parametrize("n", [1, 7, 8, 9, 15, 16])
def test_numbers_beyond_the_last_one_are_not_read(n):
    x, out = np.arange(1.0, 25.0), np.full(24, -1.0)
    some(x, out, n)
    end = -(-n // LANES) * LANES
    expected = np.concatenate([x[:n], np.zeros(end - n), np.full(24 - end, -1.0)])
    np.testing.assert_array_equal(out, expected)
    plain = lanes_plain.load_part(x[:n], n - n % LANES, n % LANES)  # as of an array that ends there
    np.testing.assert_array_equal(plain[: n % LANES], x[n - n % LANES : n])
    assert not np.any(plain[n % LANES :])


def test_only_the_given_columns_are_added_to():
    table, where = np.arange(80.0).reshape(10, 8), np.zeros(10, dtype=np.int64)
    total = np.zeros((2, 8))
    collect_three(table, where, total)
    np.testing.assert_array_equal(total, [[0.0] * 5 + list(table[:, :3].sum(axis=0)), [0.0] * 8])


def test_rows_are_added_to_without_the_compiler_too(plain):
    plain(sys.modules[__name__])
    table, one, two = np.random.default_rng(5).normal(size=(21, 8)), *np.eye(3)[:2].astype(int)
    one, two = (np.resize(row, 21) for row in (one, two))
    total, expected = np.ones((2, 8)), np.ones((2, 8))
    collect(table, one, two, total)
    np.add.at(expected, one, table)
    np.add.at(expected, two, 1.0 - table)
    np.testing.assert_allclose(total, expected)
    test_only_the_given_columns_are_added_to()


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(-3.0, 3.0), min_size=LANES, max_size=LANES))
def test_functions_are_those_of_numpy_in_every_lane(numbers):
    x, out = np.array(numbers), np.zeros((LANES, 4))
    elementary(x, out)
    expected = [np.sin(x), np.cos(x), np.abs(x), np.where(np.abs(x) > 1.0, -x, x / 4.0)]
    np.testing.assert_allclose(out.T, expected, rtol=1e-15, atol=1e-15)


def test_not_a_number_is_beyond_every_limit():
    x, out = np.zeros(LANES), np.zeros((LANES, 4))
    x[3] = np.nan
    elementary(x, out)
    assert np.flatnonzero(np.isnan(out[:, 0])) == [3]
    assert np.flatnonzero(np.isnan(out[:, 3])) == [3]


def test_two_of_each_pair_stand_side_by_side_and_the_last_pair_fills_up():
    assert paired_numbers.py_func(0, 4) == (0, 1, 2, 3, 4, 5, 6, 7)
    assert paired_numbers.py_func(4, 6) == (8, 9, 10, 11, 10, 11, 10, 11)


def test_neighbours_of_plain_lanes():
    np.testing.assert_array_equal(lanes_plain.swap_pairs(np.arange(8)), [1, 0, 3, 2, 5, 4, 7, 6])


def test_plain_functions_have_the_names_of_the_compiled_ones():
    from railsim.kernels import lanes

    names = [name for name, thing in vars(lanes_plain).items() if callable(thing)]
    assert [name for name in names if not hasattr(lanes, name)] == []


def test_aligned_arrays_start_on_a_cache_line():
    array = np.random.default_rng(0).normal(size=(5, 3))
    copies = [aligned_copy(array[k:]) for k in range(5)] + [aligned_copy(array.T)]
    for copy, original in zip(copies, [*(array[k:] for k in range(5)), array.T], strict=True):
        np.testing.assert_array_equal(copy, original)
        assert copy.flags.c_contiguous
        assert copy.ctypes.data % CACHE_LINE == 0
    empty = aligned_zeros((0, 3), np.int64)
    assert empty.shape == (0, 3)
    assert empty.dtype == np.int64


def test_tables_of_two_rails_are_put_side_by_side_without_a_second_copy():
    tables = [np.full((3, 100, 1000), float(k)) for k in range(2)]
    tracemalloc.start()
    both = side_by_side(tables)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert np.array_equal(both, np.stack(tables))
    assert both.ctypes.data % CACHE_LINE == 0
    assert peak < 1.1 * both.nbytes
