"""Periodic motions by shooting, followed over the speed by arc length, with their multipliers.

A periodic motion is a state x, a period T and a speed V with Phi_T(x; V) = x, where Phi is the flow
of the system.  Newton's method solves for u = (x, T, V) with two more conditions:

    f(x_0) . (x - x_0) = 0        phase: no shift along the motion from the last one, x_0
    t . (u - u_0) = ds            pseudo arc length along the tangent t (Keller 1977)

Most of a disturbance dies within a period: M = dPhi_T/dx has a far lower rank than columns.  Its
range Z is that of M times random directions (Halko et al. 2011), and M Z Z^T differs from M only in
what it does to disturbances outside Z.  Of these a period before each change leaves nothing, as in
the method of Newton and Picard (Lust et al. 1998).  Between two changes the matrix is updated, with
the residuals r' and r at both ends of the way s: J + (r - r' - J s) s^T/(s . s).

The eigenvalues of M are the Floquet multipliers: one is 1, and the motion is stable while all
others lie within the unit circle.  A branch that turns back in V has a fold there; of the two
motions at one speed beside it, one is unstable.

Sources: Broyden (1965), Mathematics of Computation 19; Keller (1977), Numerical solution of
bifurcation and nonlinear eigenvalue problems; True and Kaas-Petersen (1983), Schupp (2004); Lust,
Roose, Spence and Champneys (1998), SIAM J. Sci. Comput. 19; Halko, Martinsson and Tropp (2011),
SIAM Review 53.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq

from railsim.arrays import Complexes, Floats
from railsim.errors import ModelError

SETTLED = 1e-6  # last change of Newton's method, in scaled units
MOST_ITERATIONS = 40
MOST_MATRICES = 8  # formed until then; each costs as much as some hundred iterations
SLOW = 1.0  # ratio of two changes from which on the matrix, else updated, is formed again
QUICK = 8  # iterations after which the next step may be longer
RANK = 48  # random directions, twice as many where all of them are left after a period
GONE = 1e-3  # share of a disturbance that counts as nothing after a period
DIFFERENCE = 1e-5  # of the difference quotients, in scaled units
MULTIPLIER = 1e-3  # by which a multiplier may exceed 1: error of difference quotients
SMALLEST_SHARE = 1.0 / 256.0  # of the given step
FOLD = 5e-3  # m/s, rise of the speed with which a motion counts as a fold; the speed is closer
BENT = 1.4  # ratio of the way to the next motion to its arc length: 45 degrees off the tangent
NEAR = 1e-2  # scaled units, within which the tangent tells nothing
LEAD = 0.05  # least cosine between a tangent and the direction it is to lead in


class Flow(Protocol):
    """What the search for periodic motions asks of a system."""

    def after(self, states: Floats, durations: Floats, speeds: Floats) -> Floats:
        """States after a while, one motion a row, float64[k, n]."""

    def amplitude(self, state: Floats, duration: float, speed: float) -> float:
        """Half the largest lateral travel of a wheelset within `duration` [m]."""


@dataclass(frozen=True)
class PeriodicMotion:
    """One periodic motion."""

    state: Floats  # one that it passes through
    period: float  # [s]
    speed: float  # [m/s]
    amplitude: float  # half the largest lateral travel of a wheelset [m]
    multipliers: Complexes  # of Floquet, without the trivial one
    tangent: Floats  # direction of the branch in the scaled u
    along: Floats  # direction of the motion itself at `state`, scaled
    # Jacobian of the residual there, with which the search for the next one begins
    matrix: Floats | None = None

    @property
    def frequency(self) -> float:
        """1 over the period [Hz]."""
        return 1.0 / self.period

    @property
    def is_stable(self) -> bool:
        """Whether a small disturbance of the motion dies out."""
        return bool(np.all(np.abs(self.multipliers) < 1.0 + MULTIPLIER))


class Shooting:
    """Newton's method for the periodic motions of a system.

    `scale`: size of each component of the state in a motion of about a millimetre; `period_scale`,
    `speed_scale`: changes of period [s] and speed [m/s] that count as much in the arc length.
    """

    def __init__(self, flow: Flow, scale: Floats, period_scale: float, speed_scale: float) -> None:
        self._flow = flow
        self._scale = np.concatenate([scale, [period_scale, speed_scale]])

    def beginning(
        self, state: Floats, shape: Complexes, frequency: float, speed: float
    ) -> PeriodicMotion:
        """Return the motion of no amplitude at the bifurcation.

        `state`: equilibrium at the critical speed; `shape`: critical mode, of any size;
        `frequency`, `speed`: of the critical mode [Hz], [m/s].
        """
        scaled = shape / self._scale[:-2]
        tangent = np.concatenate([scaled.real, [0.0, 0.0]])
        return PeriodicMotion(
            state,
            1.0 / frequency,
            speed,
            0.0,
            np.zeros(0, complex),
            tangent / np.linalg.norm(tangent),
            -scaled.imag / np.linalg.norm(scaled.imag),
        )

    def motions(
        self, start: PeriodicMotion, step: float, within: Callable[[PeriodicMotion], bool]
    ) -> Iterator[PeriodicMotion]:
        """Yield the motions of the branch while they are `within`, the first beyond it too.

        `start`: not yielded; `step`: arc length in scaled units; steps that fail are halved and
        grow again; `within`: whether to go on from a motion. Raises ModelError: the branch cannot
        be followed any further.
        """
        now, length = start, step
        while True:
            try:
                ahead, iterations = self.ahead(now, length)
            except ModelError:
                length *= 0.5
                if length < SMALLEST_SHARE * step:
                    raise
                continue
            yield ahead
            if not within(ahead):
                return
            now = ahead
            if iterations <= QUICK:
                length = min(step, 1.5 * length)

    def ahead(self, now: PeriodicMotion, length: float) -> tuple[PeriodicMotion, int]:
        """Return the motion one arc length further, and iterations; ModelError: none is found."""
        ahead, iterations = self._solve(now, now.tangent, length)
        if np.linalg.norm(self._way(now, ahead)) > BENT * abs(length) + NEAR:
            raise ModelError("the motions found are not on one branch")
        return ahead, iterations

    def _way(self, one: PeriodicMotion, other: PeriodicMotion) -> Floats:
        """From one motion to another, scaled."""
        begin, end = ([*each.state, each.period, each.speed] for each in (one, other))
        return np.asarray(np.subtract(end, begin) / self._scale)

    def nearest(self, state: Floats, period: float, speed: float) -> PeriodicMotion:
        """Return the motion at a speed nearest to a state of a run, with a branch that slows down.

        Raises ModelError: Newton's method does not converge.
        """
        n = len(state)
        begin = np.array([state, state])
        ends = self._flow.after(begin, np.array([1e-2, 2e-2]) * period, np.full(2, speed))
        along = (ends[1] - ends[0]) / self._scale[:n]
        none, slower = np.zeros(0, complex), -np.eye(n + 2)[-1]
        unit = along / np.linalg.norm(along)
        return self.at_speed(PeriodicMotion(state, period, speed, 0.0, none, slower, unit), speed)

    def at_speed(self, near: PeriodicMotion, speed: float) -> PeriodicMotion:
        """Return the motion at a given speed [m/s] near to a known one.

        Raises ModelError: Newton's method does not converge: there is none, or the known one is too
        far.
        """
        change = (speed - near.speed) / self._scale[-1]
        return self._solve(near, np.eye(len(near.tangent))[-1], change)[0]

    def _solve(
        self, now: PeriodicMotion, direction: Floats, length: float
    ) -> tuple[PeriodicMotion, int]:
        """Solve for the motion at `length` from a known one, measured in `direction`."""
        base = np.concatenate([now.state, [now.period, now.speed]]) / self._scale
        conditions = np.vstack([np.concatenate([now.along, [0.0, 0.0]]), direction])
        # the tangent leads on also where only the speed is given
        lead = float(now.tangent @ direction)
        u = base + now.tangent * length / lead if abs(lead) > LEAD else base + length * direction
        matrix, n, last = now.matrix, len(now.state), None
        before, formed = np.inf, 0
        for iteration in range(1, MOST_ITERATIONS + 1):
            # what a period leaves is all that the matrix knows of
            u = np.concatenate([self._ends(u[None])[0], u[n:]])
            if matrix is not None:
                residual = self._ends(u[None])[0] - u[:n]
                if last is not None:
                    moved = u - last[0]
                    wrong = residual - last[1] - matrix @ moved
                    matrix = matrix + np.outer(wrong, moved) / max(moved @ moved, 1e-30)
            elif formed < MOST_MATRICES:
                residual, matrix = self._periodicity(u)
                formed += 1
            else:
                break
            rest = conditions @ (u - base) - np.array([0.0, length])
            full = np.vstack([matrix, conditions])
            if not np.isfinite(full).all():
                raise ModelError("the motion leaves the range of the model")
            change = np.linalg.solve(full, -np.concatenate([residual, rest]))
            size = float(np.linalg.norm(change))
            if not size < 10.0 * abs(length) + 1.0:
                break
            last = u, residual
            u = u + change
            if size < SETTLED:
                _, matrix = self._periodicity(u)
                return self._motion(u, matrix, conditions[0], now.tangent), iteration
            if size > SLOW * before:
                matrix = None
            before = size
        raise ModelError("the search for a periodic motion does not converge")

    def fold(self, before: PeriodicMotion, after: PeriodicMotion) -> PeriodicMotion:
        """Return the motion where the branch turns back between two."""
        length = float(self._way(before, after) @ before.tangent)
        found = {0.0: before, length: after}

        def rise(share: float) -> float:
            """Of the speed over the whole length, with the slope at a motion [m/s]."""
            if share not in found:
                found[share] = self.ahead(before, share)[0]
            value = float(found[share].tangent[-1] * length * self._scale[-1])
            return value if abs(value) > FOLD else 0.0

        if rise(0.0) * rise(length) > 0.0:
            return after
        try:
            return found[brentq(rise, 0.0, length, xtol=NEAR)]
        except ModelError:  # which is no reason not to go on from it
            return after

    def _ends(self, rows: Floats) -> Floats:
        """x(T) of several scaled u, one a row, scaled."""
        n = rows.shape[1] - 2
        trials = rows * self._scale
        ends = self._flow.after(np.ascontiguousarray(trials[:, :n]), trials[:, n], trials[:, n + 1])
        return np.asarray(ends / self._scale[:n])

    def _periodicity(self, u: Floats) -> tuple[Floats, Floats]:
        """Residual x(T) - x and its Jacobian over the scaled u, all scaled.

        The range is sought anew each time: where contacts change it turns within one step.
        """
        n, chosen = len(u) - 2, np.random.default_rng(0)
        tried = chosen.standard_normal((n, RANK))
        while 2 * tried.shape[1] < n:
            tried = np.linalg.qr(tried)[0]
            directions, sizes, _ = np.linalg.svd(self._slopes(u, tried)[1], full_matrices=False)
            if sizes[-1] < GONE:
                tried = directions[:, sizes > GONE]
                break
            tried = chosen.standard_normal((n, 2 * tried.shape[1]))
        else:
            tried = np.eye(n)
        end, slopes = self._slopes(u, tried)
        matrix = np.hstack([slopes[:, :-2] @ tried.T - np.eye(n), slopes[:, -2:]])
        return end - u[:n], matrix

    def _slopes(self, u: Floats, directions: Floats) -> tuple[Floats, Floats]:
        """x(T) and its slopes in some directions of x, one a column, and over T and V, scaled."""
        rows = block_diag(directions.T, np.eye(2))
        ends = self._ends(np.vstack([u, u + DIFFERENCE * rows]))
        if not np.isfinite(ends).all():
            raise ModelError("the motion leaves the range of the model")
        return ends[0], (ends[1:] - ends[0]).T / DIFFERENCE

    def _motion(self, u: Floats, matrix: Floats, along: Floats, before: Floats) -> PeriodicMotion:
        """Return what was found at u; the tangent goes on in the sense of the one before."""
        n = len(u) - 2
        tangent = np.linalg.solve(np.vstack([matrix, along, before]), np.eye(n + 2)[-1])
        state, period, speed = u[:n] * self._scale[:n], u[n] * self._scale[n], u[-1]
        speed = float(speed * self._scale[-1])
        multipliers = np.linalg.eigvals(matrix[:, :n] + np.eye(n)).astype(complex)
        multipliers = np.delete(multipliers, np.argmin(np.abs(multipliers - 1.0)))
        return PeriodicMotion(
            state,
            float(period),
            speed,
            self._flow.amplitude(state, float(period), speed),
            multipliers,
            tangent / np.linalg.norm(tangent),
            # of the end over the period: the direction in which the motion begins
            matrix[:, n] / np.linalg.norm(matrix[:, n]),
            matrix,
        )
