"""Types of arrays, and where in them something is."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]
Indices = NDArray[np.intp]

EQUAL = 1e-6  # share by which values of equal wheels may differ: by rounding, in single precision


def first_largest(values: Floats) -> tuple[int, ...]:
    """Index of the largest value: of those that are less by `EQUAL` of it at most the first.

    What is equal but for rounding so bears the same name always.  NaN is left out.

    >>> first_largest(np.array([[np.nan, 1.0], [2.0, 2.0 + 1e-9]]))
    (1, 0)
    """
    near = np.isclose(values, np.fmax.reduce(values, axis=None), rtol=EQUAL, atol=0.0)
    return tuple(int(k) for k in np.unravel_index(np.argmax(near), np.shape(values)))


def largest_first(values: Sequence[float | None]) -> list[int]:
    """Indices of the values that are there, the largest first; of equal ones the first.

    Where none is positive the smallest come first: of unloaded wheels the most unloaded one.

    >>> largest_first([1.0, None, -2.0, 3.0]), largest_first([-0.1, -0.4, None, 0.0])
    ([3, 0, 2], [1, 0, 3])
    """
    pairs = [(value, k) for k, value in enumerate(values) if value is not None]
    sign = -1.0 if any(value > 0.0 for value, _ in pairs) else 1.0
    return [k for _, k in sorted((sign * value, k) for value, k in pairs)]


def stretches(flags: Flags) -> list[tuple[int, int]]:
    """First index of each stretch of True, and the index behind its last one.

    >>> stretches(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
