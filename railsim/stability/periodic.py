"""Periodic motions by shooting, followed over the speed by arc length, with their multipliers.

A periodic motion is a state x, a period T and a speed V with Phi_T(x; V) = x, where Phi is the flow
of the system.  A system that is its own mirror image, S, has motions with Phi_T/2(x; V) = S x: only
half of the period is computed.  Newton's method solves for u = (x, T, V) with two more conditions:

    f(x_0) . (x - x_0) = 0        phase: no shift along the motion from the last one, x_0
    t . (u - u_0) = ds            pseudo arc length along the tangent t (Keller 1977)

The eigenvalues of dPhi_T/dx are the Floquet multipliers: one is 1, and the motion is stable while
all others lie within the unit circle.  A branch that turns back in V has a fold there; of the two
motions at one speed beside it, one is unstable.

Sources: Keller (1977), Numerical solution of bifurcation and nonlinear eigenvalue problems; for
rail vehicles True and Kaas-Petersen (1983), Schupp (2004).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from railsim.arrays import Complexes, Floats
from railsim.errors import ModelError

SETTLED = 1e-6  # last change of Newton's method, in scaled units
MOST_ITERATIONS = 20
MOST_MATRICES = 4  # formed until then; each costs as much as the flow of all components
SLOW = 0.3  # ratio of two changes from which on the matrix is formed again
QUICK = 8  # iterations after which the next step may be longer
DIFFERENCE = 1e-5  # of the difference quotients, in scaled units
MULTIPLIER = 1e-3  # by which a multiplier may exceed 1: error of difference quotients
SMALLEST_SHARE = 1.0 / 256.0  # of the given step
FOLD = 3e-3  # share of the arc length to which a fold is sought; its speed is of second order
LEAD = 0.05  # least cosine between a tangent and the direction it is to lead in


class Flow(Protocol):
    """What the search for periodic motions asks of a system."""

    @property
    def mirror(self) -> Floats | None:
        """S of a system that is its own mirror image, float64[n, n]; else None."""

    def after(self, states: Floats, durations: Floats, speeds: Floats) -> Floats:
        """States after a while, one motion a row, float64[k, n]."""

    def amplitude(self, state: Floats, duration: float, speed: float) -> float:
        """Half the largest lateral travel of a wheelset within `duration` [m]."""


@dataclass(frozen=True)
class PeriodicMotion:
    """One periodic motion.

    - `state`: a state that it passes through
    - `period`, `speed`: [s], [m/s]
    - `amplitude`: half the largest lateral travel of a wheelset [m]
    - `multipliers`: Floquet multipliers without the trivial one
    - `tangent`: direction of the branch in the scaled u
    - `along`: direction of the motion itself at `state`, scaled
    - `matrix`: Jacobian of the residual there, with which the search for the next one begins
    """

    state: Floats
    period: float
    speed: float
    amplitude: float
    multipliers: Complexes
    tangent: Floats
    along: Floats
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
        self._share = 1.0 if flow.mirror is None else 0.5
        self._back = None if flow.mirror is None else np.linalg.inv(flow.mirror)

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

    def followed(
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
        """Return the motion one arc length further, and the number of iterations.

        Raises ModelError: Newton's method does not converge.
        """
        return self._solved(now, now.tangent, length)

    def nearest(self, state: Floats, period: float, speed: float) -> PeriodicMotion:
        """Return the motion at a speed nearest to a state of a run, with a branch that slows down.

        Raises ModelError: Newton's method does not converge.
        """
        n = len(state)
        begin = np.array([state, state])
        ends = self._flow.after(begin, np.array([1e-2, 2e-2]) * period, np.full(2, speed))
        along = (ends[1] - ends[0]) / self._scale[:n]
        slower = np.zeros(n + 2)
        slower[-1] = -1.0
        guess = PeriodicMotion(
            state, period, speed, 0.0, np.zeros(0, complex), slower, along / np.linalg.norm(along)
        )
        return self.at_speed(guess, speed)

    def at_speed(self, near: PeriodicMotion, speed: float) -> PeriodicMotion:
        """Return the motion at a given speed [m/s] near to a known one.

        Raises ModelError: Newton's method does not converge: there is none, or the known one is too
        far.
        """
        change = (speed - near.speed) / self._scale[-1]
        direction = np.zeros(len(near.tangent))
        direction[-1] = 1.0
        return self._solved(near, direction, change)[0]

    def _solved(
        self, now: PeriodicMotion, direction: Floats, length: float
    ) -> tuple[PeriodicMotion, int]:
        """Solve for the motion at `length` from a known one, measured in `direction`."""
        base = np.concatenate([now.state, [now.period, now.speed]]) / self._scale
        conditions = np.vstack([np.concatenate([now.along, [0.0, 0.0]]), direction])
        # the tangent leads on also where only the speed is given
        lead = float(now.tangent @ direction)
        u = base + now.tangent * length / lead if abs(lead) > LEAD else base + length * direction
        matrix = now.matrix
        before, formed = np.inf, 0
        for iteration in range(1, MOST_ITERATIONS + 1):
            if matrix is not None:
                residual = self._residual(u)
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
            u = u + change
            if size < SETTLED:
                _, matrix = self._periodicity(u)
                return self._motion(u, matrix, conditions[0], now.tangent), iteration
            if size > SLOW * before:
                matrix = None
            before = size
        raise ModelError("the search for a periodic motion does not converge")

    def fold(self, before: PeriodicMotion, after: PeriodicMotion, length: float) -> PeriodicMotion:
        """Return the motion where the branch turns back in speed between two of its motions.

        `length`: arc length from `before` to `after`, or somewhat more.
        """
        found = {}

        def forward(share: float) -> float:
            if share not in found:
                found[share] = self.ahead(before, share)[0]
            return float(found[share].tangent[-1])

        first = 1e-6 * length
        if forward(first) * forward(length) > 0.0:  # of a fold with a kink: the nearer motion
            return after
        root = float(brentq(forward, first, length, xtol=FOLD * length))
        forward(root)
        return found[root]

    def _residual(self, u: Floats) -> Floats:
        """x(T) - x, scaled."""
        n = len(u) - 2
        trial = u * self._scale
        end = self._flow.after(trial[None, :n], self._share * trial[n : n + 1], trial[n + 1 :])[0]
        if self._back is not None:
            end = self._back @ end
        return np.asarray(end / self._scale[:n] - u[:n])

    def _periodicity(self, u: Floats) -> tuple[Floats, Floats]:
        """Residual x(T) - x and its Jacobian over the scaled u, all scaled."""
        n = len(u) - 2
        trials = np.vstack([u, u + DIFFERENCE * np.eye(n + 2)]) * self._scale
        ends = self._flow.after(
            np.ascontiguousarray(trials[:, :n]), self._share * trials[:, n], trials[:, n + 1]
        )
        if self._back is not None:
            ends = ends @ self._back.T
        ends = ends / self._scale[:n]
        matrix = (ends[1:] - ends[0]).T / DIFFERENCE
        matrix[:, :n] -= np.eye(n)
        return ends[0] - u[:n], matrix

    def _motion(self, u: Floats, matrix: Floats, along: Floats, before: Floats) -> PeriodicMotion:
        """Return what was found at u; the tangent goes on in the sense of the one before."""
        n = len(u) - 2
        right = np.zeros(n + 2)
        right[-1] = 1.0
        tangent = np.linalg.solve(np.vstack([matrix, along, before]), right)
        state, period, speed = u[:n] * self._scale[:n], u[n] * self._scale[n], u[-1]
        speed = float(speed * self._scale[-1])
        multipliers = np.linalg.eigvals(matrix[:, :n] + np.eye(n)).astype(complex)
        # in half a period of a symmetric motion the trivial one is 1 as well, not -1
        multipliers = np.delete(multipliers, np.argmin(np.abs(multipliers - 1.0)))
        return PeriodicMotion(
            state,
            float(period),
            speed,
            self._flow.amplitude(state, float(period), speed),
            multipliers ** round(1.0 / self._share),
            tangent / np.linalg.norm(tangent),
            # end of the motion, mirrored back: the direction in which it begins
            matrix[:, n] / np.linalg.norm(matrix[:, n]),
            matrix,
        )
