"""The first loss of stability of an equilibrium over a parameter: a Hopf bifurcation."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import brentq, minimize_scalar

from railsim.arrays import Complexes, Indices
from railsim.linear.eigenmodes import SEARCHED, At, Eigenmodes, eigenmodes

LOWEST = 0.1  # Hz, of an oscillation that loses its stability: sways on cones of 0.005 have 0.28
ROUNDING = 1e-9  # 1/s, growth that counts as none: without friction some modes are not damped
STEP = 0.2  # of the parameter, in which a loss of stability is looked for
CLOSER = 5  # parameters of the last two steps before a loss, between which a lower one is sought


@dataclass(frozen=True)
class LossOfStability:
    """Where an equilibrium loses its stability to an oscillation, or that it does not."""

    # lowest value with Re(lambda) = 0 (a Hopf bifurcation); None: none in the range
    parameter: float | None
    already: bool  # whether the equilibrium is unstable at the range's lower end
    # the critical one at `parameter`; without it the least damped ones at both ends of the range
    modes: tuple[Eigenmodes, ...]


def loss_of_stability(
    at: At,
    low: float,
    high: float,
    counts: Callable[[Eigenmodes], bool] | None = None,
    points: int = 12,
) -> LossOfStability:
    """Find the lowest parameter at which an oscillation is no longer damped.

    The range is looked through in steps of a share `STEP` of the parameter, and where the growth
    has a peak near zero between them: a vehicle may be unstable over 4 m/s only, when the frequency
    of hunting passes that of its body's sway.  The last two steps are looked through more closely.

    `at`: parameter to linearisation; `low`, `high`: range of the search; `counts`: whether a mode
    that is undamped counts; by default all do; `points`: least number of values of the parameter at
    which the range is looked through.
    """
    known: dict[float, float] = {}

    def modes(parameter: float) -> Eigenmodes:
        """The least damped oscillation searched, without undamped ones that do not count."""
        found = eigenmodes(at(parameter))
        inside = _in_range(found.eigenvalues)
        order = inside[np.argsort(-found.eigenvalues[inside].real)]
        ordered = [found.taken([int(k)]) for k in order]
        if counts is not None:
            ordered = [m for m in ordered if m.eigenvalues[0].real < 0.0 or counts(m)] or ordered
        return ordered[0]

    def growth(parameter: float) -> float:
        if parameter not in known:
            # half of the time without vectors, by which modes are told apart where one is undamped
            values = np.asarray(eigvals(at(parameter).matrix), dtype=complex)
            known[parameter] = float(np.max(values[_in_range(values)].real)) - ROUNDING
            if counts is not None and known[parameter] >= 0.0:
                known[parameter] = float(modes(parameter).eigenvalues[0].real) - ROUNDING
        return known[parameter]

    def zero(stable: float, unstable: float) -> float:
        return float(brentq(growth, stable, unstable, xtol=1e-7 * high, rtol=1e-12))

    if growth(low) >= 0.0:
        return LossOfStability(None, True, (modes(low),))
    before = passed = low
    while passed < high:
        after = min(high, passed + min((high - low) / (points - 1), STEP * passed))
        after = high if high - after < 1e-9 * high else after
        half, first = 0.5 * (passed + after), before == passed
        span = (before, half if first else passed, after, low if first else None)
        unstable = after if growth(after) >= 0.0 else _beyond_zero(growth, *span)
        if unstable is None and after == high:  # a peak in the last interval
            unstable = _beyond_zero(growth, passed, half, after, high)
        if unstable is not None or after == high:
            end = high
            if unstable is not None:
                end = zero(passed if unstable > passed else before, unstable)
            near = np.linspace(before, end, CLOSER).tolist()
            peaks = (_beyond_zero(growth, *near[k : k + 3]) for k in range(CLOSER - 2))
            lower = next((peak for peak in peaks if peak is not None), None)
            if lower is not None or unstable is not None:
                root = end if lower is None else zero(before, lower)
                return LossOfStability(root, False, (modes(root),))
        before, passed = passed, after
    return LossOfStability(None, False, (modes(low), modes(high)))


def _beyond_zero(
    growth: Callable[[float], float],
    before: float,
    middle: float,
    after: float,
    end: float | None = None,
) -> float | None:
    """Where a peak about the middle one of three parameters is not negative, if it may be.

    A parabola rises over the largest of three values at equal distances by an eighth of what this
    is above the least one, at most; more is looked into where peaks are sharper.  `end` of the
    range: beyond it nothing is known, the slope there says whether the growth rises inwards.
    """
    low, peak, high = map(growth, (before, middle, after))
    looked = peak >= max(low, high) and 2.0 * peak - min(low, high) >= 0.0
    if end is not None:  # whose tangent leads to zero on the way to the middle
        inside = end + 0.01 * (middle - end)
        looked |= growth(end) + 100.0 * (growth(inside) - growth(end)) >= 0.0
    if not looked:
        return None
    found = minimize_scalar(
        lambda x: -growth(x), bounds=(before, after), method="bounded", options={"maxiter": 12}
    )
    return float(found.x) if found.fun <= 0.0 else None


def _in_range(eigenvalues: Complexes) -> Indices:
    """Indices of the oscillations from `LOWEST` to 40 Hz; of all where there is none."""
    frequency = eigenvalues.imag / (2.0 * np.pi)
    inside = np.flatnonzero((frequency >= LOWEST) & (frequency <= SEARCHED[1]))
    return inside if len(inside) else np.arange(len(eigenvalues))
