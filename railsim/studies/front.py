"""Pareto fronts: which designs no other one betters, and how good a front is.

All objectives are to be small; a caller turns the sign of those that are to be large.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def non_dominated(values: Floats) -> NDArray[np.bool_]:
    """Return which rows no other row betters: none is as small in all columns and smaller in one.

    Of equal rows the first counts; rows with NaN are dominated.

    Examples
    --------
    >>> non_dominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [np.nan, 0.0]])).tolist()
    [True, True, False, False]
    """
    found = np.zeros(len(values), dtype=np.bool_)
    front = np.empty((0, values.shape[1]))
    for i in np.lexsort(values.T[::-1]):  # only rows before it can better a row
        row = values[i]
        if not np.isnan(row).any() and not (front <= row).all(axis=1).any():
            found[i] = True
            front = np.vstack([front, row])
    return found


def hypervolume(values: Floats, reference: Floats) -> float:
    """Return the volume between a front and a reference point (Zitzler and Thiele 1999).

    The part of the space of objectives that at least one row dominates and that dominates the
    reference.  Sliced along the last objective; the time grows with the number of rows to the
    number of objectives.

    Examples
    --------
    >>> hypervolume(np.array([[1.0, 2.0], [2.0, 1.0]]), np.array([3.0, 3.0]))
    3.0
    """
    inside = values[(values < reference).all(axis=1)]
    if not len(inside):
        return 0.0
    if inside.shape[1] == 1:
        return float(reference[0] - inside.min())
    rows = inside[np.argsort(inside[:, -1], kind="stable")]
    ends = np.append(rows[1:, -1], reference[-1])
    return sum(
        float(end - row[-1]) * hypervolume(rows[: number + 1, :-1], reference[:-1])
        for number, (row, end) in enumerate(zip(rows, ends, strict=True))
        if end > row[-1]
    )


def knee(front: Floats) -> int:
    """Return the row nearest to the best of each objective, each measured by its range.

    Examples
    --------
    >>> knee(np.array([[0.0, 1.0], [0.2, 0.2], [1.0, 0.0]]))
    1
    """
    best, worst = front.min(axis=0), front.max(axis=0)
    span = np.where(worst > best, worst - best, 1.0)
    return int(np.argmin((((front - best) / span) ** 2).sum(axis=1)))
