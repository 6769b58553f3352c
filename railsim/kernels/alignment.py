"""Arrays that start on a cache line.

Numpy's own start anywhere on 16 bytes, so that every vector register read from them lies on two
cache lines: the force elements took a third longer, FASTSIM too.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

CACHE_LINE = 64  # bytes


def aligned_zeros(shape: int | tuple[int, ...], dtype: type = np.float64) -> NDArray[Any]:
    """As `numpy.zeros`, in C order and from the start of a cache line on."""
    size = math.prod(shape if isinstance(shape, tuple) else (shape,)) * np.dtype(dtype).itemsize
    room = np.zeros(size + CACHE_LINE, dtype=np.uint8)
    first = -room.ctypes.data % CACHE_LINE
    return room[first : first + size].view(dtype).reshape(shape)


def aligned_copy(array: NDArray[Any]) -> NDArray[Any]:
    """Copy of an array in C order, from the start of a cache line on."""
    copy = aligned_zeros(array.shape, array.dtype.type)
    copy[...] = array
    return copy
