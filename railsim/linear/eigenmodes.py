"""Eigenmodes of a linearisation, followed over a parameter.

With A r = lambda r and l A = lambda l, a mode has the frequency f = Im(lambda)/2pi, the undamped
frequency f0 = |lambda|/2pi and the damping ratio zeta = -Re(lambda)/|lambda|.

Modes of neighbouring parameters a and b are paired by c_ij = |(l_i^a r_j^b)(l_j^b r_i^a)|, which is
1 for the same mode and does not depend on how coordinates and vectors are scaled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import eig

from railsim.arrays import Complexes, Floats, Indices
from railsim.linear.system import Linearisation

At = Callable[[float], Linearisation]

SEARCHED = (0.3, 40.0)  # Hz, where hunting and the yaw and roll of frames are looked for
SLOWEST = 1e-3  # Hz; below it a mode is no oscillation
GROWS = 0.05  # 1/s of motions about an unstable state
SAME = 0.6  # pairing of neighbouring modes that needs no look in between
UNRELATED = 0.1  # pairing below which two modes are not the same
EQUAL = 0.02  # relative distance of eigenvalues that cannot be distinguished
MOST_HALVINGS = 3


@dataclass(frozen=True)
class Eigenmodes:
    """Modes of one linearisation; of a conjugate pair the one with Im(lambda) > 0."""

    linearisation: Linearisation
    eigenvalues: Complexes  # by rising magnitude [1/s]
    shapes: Complexes  # right eigenvectors, largest component 1
    left: Complexes  # left eigenvectors with l r = 1 (where they can be scaled so)

    @property
    def frequencies(self) -> Floats:
        """Damped frequencies [Hz]."""
        return np.asarray(self.eigenvalues.imag / (2.0 * np.pi))

    @property
    def natural_frequencies(self) -> Floats:
        """|lambda|/2pi [Hz]."""
        return np.asarray(np.abs(self.eigenvalues) / (2.0 * np.pi))

    @property
    def damping_ratios(self) -> Floats:
        """-Re(lambda)/|lambda|, 0 where lambda is."""
        size = np.abs(self.eigenvalues)
        return np.asarray(-self.eigenvalues.real / np.where(size > 0.0, size, 1.0))

    def taken(self, order: Sequence[int] | Indices) -> "Eigenmodes":
        """Return some of the modes, in this order."""
        chosen = np.asarray(order, dtype=int)
        return Eigenmodes(
            self.linearisation, self.eigenvalues[chosen], self.shapes[chosen], self.left[chosen]
        )


def eigenmodes(linearisation: Linearisation) -> Eigenmodes:
    """Eigenmodes of a linearisation, by rising |lambda|.

    >>> oscillator = Linearisation(("x", "v"), np.array([[0.0, 1.0], [-4.0, -0.4]]), np.zeros(2), 1)
    >>> modes = eigenmodes(oscillator)
    >>> modes.natural_frequencies.round(4), modes.damping_ratios.round(4)
    (array([0.3183]), array([0.1]))
    """
    solved: Any = eig(linearisation.matrix, left=True, right=True)
    parts: list[Complexes] = [np.asarray(part, dtype=complex) for part in solved]
    values, left, right = parts
    # by which rounding parts a double zero, as of a free vehicle, into a pair or two real values
    apart = np.sqrt(np.finfo(float).eps * np.linalg.norm(linearisation.matrix))
    values[np.abs(values) < apart] = 0.0
    upper = np.flatnonzero(values.imag >= 0.0)
    order = upper[np.argsort(np.abs(values[upper]), kind="stable")]
    shapes = right[:, order].T
    largest = np.argmax(np.abs(shapes), axis=1)
    shapes = shapes / shapes[np.arange(len(order)), largest][:, None]
    dual = left[:, order].conj().T
    product = np.sum(dual * shapes, axis=1)
    # a defective pair, such as two zero eigenvalues of a free vehicle, has no product to divide by
    dual = dual / np.where(np.abs(product) > 1e-30, product, 1.0)[:, None]
    return Eigenmodes(linearisation, values[order], shapes, dual)


def pairing(before: Eigenmodes, after: Eigenmodes) -> Floats:
    """How much mode i of one set is mode j of the other, 1 for the same, float64[m_1, m_2]."""
    forth = before.left @ after.shapes.T
    back = after.left @ before.shapes.T
    return np.asarray(np.abs(forth * back.T))


def oscillations(modes: Eigenmodes, most: float = np.inf) -> Eigenmodes:
    """Return the modes that oscillate with at most `most` Hz of undamped frequency."""
    inside = (modes.frequencies > SLOWEST) & (modes.natural_frequencies <= most)
    return modes.taken(np.flatnonzero(inside))


def follow_modes(at: At, parameters: Sequence[float], most: float = np.inf) -> list[Eigenmodes]:
    """Oscillations over a parameter, each mode at the same index throughout.

    Where the pairing of neighbours is not clear, linearisations between them are looked at.  An
    oscillation that becomes overdamped, or leaves the range of frequencies, leaves its entry empty,
    one that appears gets a new entry: empty entries hold NaN.

    `at`: parameter to linearisation; `parameters`: rising or falling; `most`: largest undamped
    frequency of a mode that is followed [Hz]. Returns: one for each parameter, all with the same
    number of entries.
    """
    sets = [oscillations(eigenmodes(at(parameter)), most) for parameter in parameters]
    chains: list[list[int]] = [[i] for i in range(len(sets[0].eigenvalues))]
    for number, (before, after) in enumerate(pairwise(sets)):
        partner = _partners(at, before, after, most, MOST_HALVINGS)
        for chain in chains:
            chain.append(partner.get(chain[-1], -1))
        known = {chain[-1] for chain in chains}
        chains += [
            [-1] * (number + 1) + [j] for j in range(len(after.eigenvalues)) if j not in known
        ]
    table = np.array(chains, dtype=int).reshape(-1, len(sets))
    return [_in_order(modes, table[:, k]) for k, modes in enumerate(sets)]


def _partners(
    at: At, before: Eigenmodes, after: Eigenmodes, most: float, halvings: int
) -> dict[int, int]:
    """Which mode of `before` is which of `after`."""
    shared = np.minimum(pairing(before, after), 1.0)
    one, other = before.eigenvalues[:, None], after.eigenvalues
    apart = np.abs(one - other) / (np.abs(one) + np.abs(other))
    # of modes with nearly the same eigenvalue any mixture is a mode: the nearer value decides
    scores = shared - apart
    from scipy.optimize import linear_sum_assignment  # 0.7 s, which one speed does not need

    rows, columns = linear_sum_assignment(-scores)
    pairs = {
        int(i): int(j)
        for i, j in zip(rows, columns, strict=True)
        if shared[i, j] > UNRELATED or apart[i, j] < EQUAL
    }
    unclear = any(shared[i, j] < SAME and apart[i, j] > EQUAL for i, j in pairs.items())
    if not unclear or halvings == 0:
        return pairs
    middle = 0.5 * (before.linearisation.parameter + after.linearisation.parameter)
    between = oscillations(eigenmodes(at(middle)), most)
    first = _partners(at, before, between, most, halvings - 1)
    second = _partners(at, between, after, most, halvings - 1)
    return {i: second[j] for i, j in first.items() if j in second}


def _in_order(modes: Eigenmodes, indices: Indices) -> Eigenmodes:
    """Modes of given indices, NaN where there is none (-1)."""
    parts = (modes.eigenvalues, modes.shapes, modes.left)
    nothing = complex(np.nan, np.nan)  # behind the last one, where -1 points to
    found = (np.insert(part, len(part), nothing, axis=0)[indices] for part in parts)
    return Eigenmodes(modes.linearisation, *found)


def divergent(modes: Eigenmodes) -> Eigenmodes | None:
    """The mode that grows most without an oscillation, a real lambda > 0; None if there is none."""
    still = np.flatnonzero(np.abs(modes.frequencies) < SLOWEST)
    growth = modes.eigenvalues[still].real
    if np.max(growth, initial=0.0) < GROWS:
        return None
    return modes.taken([int(still[np.argmax(growth)])])
