"""What `lanes` does, with arrays of eight in plain Python: for kernels that are not compiled."""

import numpy as np

LANES = 8
square_root, sine, cosine = np.sqrt, np.sin, np.cos
minimum, maximum = np.fmin, np.fmax


def swap_pairs(x):
    """Lanes with the two of each pair swapped."""
    return x[[1, 0, 3, 2, 5, 4, 7, 6]]


def splat(x):
    """One number in all lanes."""
    return np.full(LANES, x)


def any_beyond(x, limit):
    """Whether |x| is more than `limit`, or not a number, in any lane."""
    return not np.all(np.abs(x) <= limit)


def where_beyond(x, limit, beyond, within):
    """Lane by lane: `beyond` where |x| is more than `limit`, or not a number; else `within`."""
    return np.where(np.abs(x) <= limit, within, beyond)


def load_rows(array, rows, column, count):
    """Columns of eight rows."""
    flat = array.reshape(-1)
    return tuple(flat[np.array(rows) + column + k] for k in range(count))


def store_rows(array, rows, column, values):
    """Store into columns of eight rows."""
    for k, value in enumerate(values):
        array.reshape(-1)[np.array(rows) + column + k] = value


def add_rows(array, rows, column, values, n):
    """Add to columns of the first `n` of eight rows."""
    for k, value in enumerate(values):
        np.add.at(array.reshape(-1), np.array(rows)[:n] + column + k, value[:n])


def add_to_pairs(array, rows_1, rows_2, column, values_1, values_2, n):
    """Add to columns of the first `n` of eight pairs of rows."""
    add_rows(array, rows_1, column, values_1, n)
    add_rows(array, rows_2, column, values_2, n)


def load_lanes(array, offset):
    """Eight numbers that follow each other."""
    return array.reshape(-1)[offset : offset + LANES].copy()


def load_part(array, offset, n):
    """The first `n` of eight numbers that follow each other; the others are 0."""
    lanes = array.reshape(-1)[offset : offset + min(n, LANES)]
    return np.pad(lanes, (0, LANES - len(lanes)))


def store_lanes(array, offset, x):
    """Store eight numbers one after the other."""
    array.reshape(-1)[offset : offset + LANES] = x
