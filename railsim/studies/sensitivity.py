"""Sensitivities: tornado values and Sobol indices of an optimisation, from its surrogate.

The surrogate uses all computed designs; no others are computed.  Its accuracy is given by the
leave-one-out error over the standard deviation, both over the full range of all variables.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.studies.search import Surrogate, varies

DOUBTFUL = 0.05  # share of the variance that a surrogate misses, from which it is said
SAMPLES = 1024  # a power of two, times the number of variables and two


@dataclass(frozen=True)
class Sensitivity:
    """How one quantity depends on the variables.

    Tornado values are those with one variable at its bound, the others as in the chosen design;
    Sobol indices hold over the full range of all variables.
    """

    quantity: str
    low: dict[str, float]  # at the lower bound of a variable [SI]
    high: dict[str, float]  # at its upper bound [SI]
    first: dict[str, float]  # share of the variance that a variable explains alone [1]
    total: dict[str, float]  # and with its interactions [1]
    error: float  # leave-one-out error (rms) of the surrogate over the standard deviation [1]

    def record(self) -> dict[str, Any]:
        """Return the sensitivity as plain data."""
        return dict(self.__dict__)

    def sentence(self) -> str:
        """Return the variables by their shares of the variance, the largest first."""
        shares = sorted(self.total.items(), key=lambda item: -item[1])
        words = ", ".join(f"{p.removeprefix('vehicle.')} {100.0 * s:.0f} %" for p, s in shares)
        missed = min(1.0, self.error**2)  # share of the variance; one variable explains all of it
        said = missed > DOUBTFUL and len(shares) > 1
        doubt = f"; shares uncertain by {100.0 * missed:.0f} %" * said
        words += f" (surrogate's error {100.0 * self.error:.0f} %{doubt})"
        if not any(self.total.values()):
            words = "none of the variables; it is the same in all designs"
        return f"{self.quantity} depends on: {words}"


def sensitivities(
    designs: Floats, values: Floats, chosen: Floats, variables: list[str], quantities: list[str]
) -> list[Sensitivity]:
    """Return the sensitivities of each quantity, by names.

    `designs`: between 0 and 1; `values`: NaN where a design has no value; `chosen`: design about
    which single variables are varied.
    """
    from scipy.stats import sobol_indices, uniform

    count = len(variables)

    def table(values: Floats) -> dict[str, float]:
        return dict(zip(variables, values.tolist(), strict=True))

    known = ~np.isnan(values).any(axis=1)
    if known.sum() < count + 2:
        return []
    model = Surrogate(designs[known], values[known])
    ends = np.repeat(chosen[None], 2 * count, axis=0)
    ends[np.arange(count), np.arange(count)] = 0.0
    ends[count + np.arange(count), np.arange(count)] = 1.0
    low, high = np.split(model(ends), 2)
    explained = np.flatnonzero(varies(values[known]))  # the rest has no variance
    first, total = np.zeros((2, len(quantities), count))
    if count == 1:
        first[explained] = total[explained] = 1.0
    elif len(explained):
        how: Any = {"dists": [uniform()] * count, "random_state": np.random.default_rng(0)}
        indices = sobol_indices(func=lambda x: model(x.T)[:, explained].T, n=SAMPLES, **how)
        first[explained] = np.reshape(indices.first_order, (len(explained), count))
        total[explained] = np.reshape(indices.total_order, (len(explained), count))
    errors = model.errors()
    found = []
    for k, quantity in enumerate(quantities):
        tornado, sobol = ((table(low[:, k]), table(high[:, k])), (table(first[k]), table(total[k])))
        found.append(Sensitivity(quantity, *tornado, *sobol, float(errors[k])))
    return found
