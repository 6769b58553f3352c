"""The driver's value at which something has a given value: a height, a length, no force."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railsim.arrays import Floats
from railsim.mechanisms.kinematics import Motion, solve
from railsim.mechanisms.model import Model

Quantity = Callable[[Motion], tuple[Any, Any]]
"""A quantity and its derivative by the driver, of a motion."""

ITERATIONS = 30
ZOOMS, ZOOMED = 7, 9
"""Times that the neighbourhood of a largest value is searched, with so many positions each."""


def driver_at(motion: Motion, quantity: Quantity, values: ArrayLike) -> Floats:
    """Values of the driver at which a quantity has given values; NaN where it never has them.

    The first crossing along the motion counts, whose positions must be dense enough to bracket the
    values; Newton's method within its bracket.
    """
    targets = np.atleast_1d(np.asarray(values, dtype=float))
    known, _ = quantity(motion)
    size = float(np.ptp(known)) or 1.0
    low, high = np.full(len(targets), np.nan), np.full(len(targets), np.nan)
    guess = np.full(len(targets), np.nan)
    for i, value in enumerate(targets):
        gap = known - value
        crossed = np.flatnonzero(gap[:-1] * gap[1:] <= 0.0)
        begins, ends = np.abs(gap[[0, -1]]) <= 1e-12 * size
        if begins or (ends and not np.any(crossed < len(gap) - 2)):
            low[i] = high[i] = guess[i] = motion.s[0 if begins else -1]
        elif len(crossed):
            k = crossed[0]
            low[i], high[i] = motion.s[k], motion.s[k + 1]
            share = gap[k] / (gap[k] - gap[k + 1]) if gap[k] != gap[k + 1] else 0.5
            guess[i] = low[i] + share * (high[i] - low[i])
    has = np.isfinite(guess)
    bracket = (low[has], high[has])
    guess[has] = _refine(motion.model, quantity, targets[has], guess[has], bracket, size)
    return guess


def _refine(
    model: Model, quantity: Quantity, targets: Floats, s: Floats, bracket: Any, size: float
) -> Floats:
    left, right = np.sort(bracket, axis=0)
    span = max(abs(model.end - model.start), 1e-300)
    for _ in range(ITERATIONS):
        if not len(s):
            break
        value, slope = quantity(solve(model, s))
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (value - targets) / slope
        new = np.where(np.isfinite(step), np.clip(s - step, left, right), s)
        done = np.all(np.abs(new - s) <= 1e-15 * span) or np.all(
            np.abs(value - targets) <= 1e-15 * size
        )
        s = new
        if done:
            break
    return s


def zeros(motion: Motion, function: Callable[[Motion], Any]) -> list[float]:
    """All values of the driver at which a function of the motion, not always smooth, is zero.

    Of a stretch on which it is zero, the first position.
    """
    known = np.asarray(function(motion))
    # the known ones again, or rounding may give a zero at a position the sign of the other end
    values: dict[float, float] = dict(zip(motion.s.tolist(), known.tolist(), strict=True))
    none = known == 0.0
    roots: list[float] = motion.s[none & ~np.append(False, none[:-1])].tolist()

    def value_at(s: float) -> float:
        if s not in values:
            values[s] = float(np.ravel(function(solve(motion.model, [s])))[0])
        return values[s]

    for k in np.flatnonzero(known[:-1] * known[1:] < 0.0):
        from scipy.optimize import brentq  # imported where it is needed: it takes a while

        span = abs(motion.model.end - motion.model.start)
        roots.append(float(brentq(value_at, motion.s[k], motion.s[k + 1], xtol=1e-12 * span)))
    return sorted(roots, reverse=bool(motion.s[-1] < motion.s[0]))


def largest(motion: Motion, function: Callable[[Motion], Any], known: Any) -> tuple[float, float]:
    """Largest value of a function of the motion between its positions: driver's value, value.

    The neighbourhood of the largest of the known values, one at each position of the motion, is
    searched in ever smaller steps; the function need not be smooth.
    """
    s, values = motion.s, np.asarray(known)
    if not np.any(np.isfinite(values)):
        return float(s[0]), float("nan")
    k = int(np.nanargmax(values))
    best = float(s[k]), float(values[k])
    for _ in range(ZOOMS):
        s = np.linspace(s[max(k - 1, 0)], s[min(k + 1, len(s) - 1)], ZOOMED)
        values = np.asarray(function(solve(motion.model, s)))
        if not np.any(np.isfinite(values)):
            break
        k = int(np.nanargmax(values))
        if values[k] > best[1]:
            best = float(s[k]), float(values[k])
    return best
