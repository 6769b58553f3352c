"""Estimates of largest values from samples of sections (EN 14363, annex on statistics).

One-dimensional: mean + k s.  Two-dimensional: linear regression over an influencing quantity such
as the cant deficiency, with the upper prediction bound at the target condition.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from railsim.arrays import Floats


@dataclass(frozen=True)
class Line:
    """Regression line a + b x and its upper bound."""

    level: float  # a
    slope: float  # b
    error: float  # standard error of the regression
    target: float  # x0, at which the bound is the estimate
    quantile: float  # one-sided quantile of Student's distribution
    N: int  # number of values
    middle: float  # mean of x
    squares: float  # sum (x - mean)^2

    def at(self, x: float | Floats) -> Floats:
        """Value of the line."""
        return np.asarray(self.level + self.slope * np.asarray(x))

    def bound(self, x: float | Floats) -> Floats:
        """Upper bound of a further value."""
        spread = 1.0 + 1.0 / self.N + (np.asarray(x) - self.middle) ** 2 / self.squares
        return np.asarray(self.at(x) + self.quantile * self.error * np.sqrt(spread))


@dataclass(frozen=True)
class Estimate:
    """Estimate of a quantity's largest value from its values in sections."""

    N: int  # number of values
    mean: float  # of the values
    deviation: float  # their standard deviation (N - 1)
    value: float  # estimate; nan where there are too few values
    method: str  # dimensions: 'one', 'two'; 'largest', 'smallest': no estimate but a value
    line: Line | None = None  # of the two-dimensional method


def one_dimensional(x: Floats, k: float) -> Estimate:
    """Mean + k s of the values.

    `x` (float64[section]): Values. `k`: Factor of the standard deviation: 3 for safety, 2.2 for
    track loading and ride characteristics, 0 for quasi-static quantities.

    >>> values = np.array([31.2, 29.8, 33.5, 30.4, 32.1, 34.0, 28.9, 31.7, 30.9, 32.6])
    >>> round(one_dimensional(values, 3.0).value, 3), round(one_dimensional(values, 2.2).value, 3)
    (36.323, 35.04)
    """
    n = len(x)
    mean = float(np.mean(x)) if n else math.nan
    deviation = float(np.std(x, ddof=1)) if n > 1 else math.nan
    value = mean if k == 0.0 else mean + k * deviation
    return Estimate(n, mean, deviation, value, "one")


def two_dimensional(x: Floats, y: Floats, x0: float, probability: float) -> Estimate:
    """Upper bound of y at x0 by linear regression.

    a + b x0 + t(N - 2, P) s_e sqrt(1 + 1/N + (x0 - mean)^2/sum (x - mean)^2) with the one-sided
    quantile t of Student's distribution.

    `x`, `y` (float64[section]): Influencing quantity, such as the cant deficiency, and values.
    `x0`: Target value of the influencing quantity. `probability`: P: 0.99 for safety, otherwise
    0.95; 0.5 gives the regression line itself.

    >>> x = np.array([70, 85, 95, 100, 110, 120, 125, 135, 145, 150.0])
    >>> y = np.array([24.1, 26.0, 28.2, 27.5, 30.1, 31.0, 32.9, 33.1, 36.0, 35.4])
    >>> [round(two_dimensional(x, y, 150.0, P).value, 3) for P in (0.95, 0.99)]
    [37.254, 38.007]
    """
    n, plain = len(x), one_dimensional(y, 0.0)
    if n < 3 or float(np.ptp(x)) == 0.0:
        return replace(plain, value=math.nan, method="two")
    slope, level = np.polynomial.polynomial.polyfit(x, y, 1)[::-1]
    error = float(np.sqrt(np.sum((y - level - slope * x) ** 2) / (n - 2)))
    middle = float(np.mean(x))
    squares = float(np.sum((x - middle) ** 2))
    from scipy.special import stdtrit  # long to import

    t = float(stdtrit(n - 2, probability))  # quantile of Student's t
    line = Line(float(level), float(slope), error, x0, t, n, middle, squares)
    return replace(plain, value=float(line.bound(x0)), method="two", line=line)


@dataclass(frozen=True)
class Regression:
    """Linear regression over several influences."""

    N: int  # number of values
    coefficients: tuple[float, ...]  # constant, then one for each influence
    error: float  # standard error of the regression
    determination: float  # share of the variance that the influences explain, R^2 [1]
    value: float  # value at the target conditions


def multiple_regression(x: Floats, y: Floats, target: Floats) -> Regression | None:
    """Least squares of y = a + b1 x1 + b2 x2 + ...; None where x does not determine it.

    `x` (float64[section, influence]). `y` (float64[section]). `target` (float64[influence]):
    Conditions at which the value is sought.

    >>> x = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]])
    >>> found = multiple_regression(x, 1.0 + 2.0 * x[:, 0] - x[:, 1], np.array([3.0, 2.0]))
    >>> round(found.value, 9), round(found.determination, 9)
    (5.0, 1.0)
    """
    n, k = x.shape
    scale = np.maximum(np.abs(x).max(axis=0, initial=0.0), 1e-300)
    design = np.column_stack([np.ones(n), x / scale])
    if n <= k + 1 or np.linalg.matrix_rank(design, tol=1e-6 * np.sqrt(n)) <= k:
        return None
    coefficients = np.linalg.lstsq(design, y, rcond=None)[0]
    residual = float(np.sum((y - design @ coefficients) ** 2))
    total = float(np.sum((y - np.mean(y)) ** 2))
    return Regression(
        n, (float(coefficients[0]), *(float(c) for c in coefficients[1:] / scale)),
        math.sqrt(residual / (n - k - 1)), 1.0 - residual / total if total else 1.0,
        float(coefficients[0] + np.sum(coefficients[1:] * target / scale)),
    )  # fmt: skip


def extreme(x: Floats, method: str) -> Estimate:
    """Largest or smallest value, with mean and deviation beside it; no estimate."""
    value = float(np.max(x) if method == "largest" else np.min(x))
    return replace(one_dimensional(x, 0.0), value=value, method=method)
