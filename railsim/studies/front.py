"""Pareto fronts: non-dominated designs, and the volume that a front dominates.

All objectives are minimised; callers change the sign of objectives to maximise.
"""

import numpy as np
from numpy.typing import NDArray

from railsim.arrays import Floats


def non_dominated(values: Floats) -> NDArray[np.bool_]:
    """Return which rows are not dominated: no other is as small in all columns, smaller in one.

    Of equal rows only the first is non-dominated; rows with NaN are dominated.

    Examples
    --------
    >>> non_dominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [np.nan, 0.0]])).tolist()
    [True, True, False, False]
    """
    found = np.zeros(len(values), dtype=np.bool_)
    front = np.empty((0, values.shape[1]))
    for i in np.lexsort(values.T[::-1]):  # a row can only be dominated by rows before it
        row = values[i]
        if not np.isnan(row).any() and not (front <= row).all(axis=1).any():
            found[i] = True
            front = np.vstack([front, row])
    return found


def hypervolume(values: Floats, reference: Floats) -> float:
    """Return the volume between a front and a reference point (Zitzler and Thiele 1999).

    The part of the objective space that at least one row dominates and that dominates the
    reference point.  Computed in slices along the last objective; the time grows with the number of
    rows to the power of the number of objectives.

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
    """Return the row nearest to the best value of each objective, scaled by its range.

    Examples
    --------
    >>> knee(np.array([[0.0, 1.0], [0.2, 0.2], [1.0, 0.0]]))
    1
    """
    best, worst = front.min(axis=0), front.max(axis=0)
    span = np.where(worst > best, worst - best, 1.0)
    return int(np.argmin((((front - best) / span) ** 2).sum(axis=1)))
