"""Quasi-static states with dry friction that follows the displacement.

`SteadyRolling` holds the forces of friction pads.  Here they follow the deflection d of their
elements from the last known state on, T = T_0 + k (d - d_0), brought back to their limits as in the
time loop (`railsim.kernels.internal`; Masing 1926): a step of an elastic-plastic structure with the
return to the yield surface at its end (Simo, Hughes 1998, 3).  Friction that falls with the sliding
speed is that at rest.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats
from railsim.kernels.internal import PAD
from railsim.kernels.state import internal_begin
from railsim.kernels.step_rk4 import restore_limits
from railsim.kernels.system import System
from railsim.linear.steady import NotConverged, SteadyRolling
from railsim.model.assembly import Model

SMALLEST = 1.0 / 256.0  # part of the way between two states at which a path ends


class Grip(NamedTuple):
    """Deflections of all pads in a state [m], and the forces that they have there [N]."""

    deflection: Floats
    force: Floats


class Sliding(SteadyRolling):
    """Newton's method for steady states whose friction forces follow the displacement.

    `model`, `system`, `held`: as of `SteadyRolling`; `since`: of the last known state; without it
    friction elements hold the forces that a state has.
    """

    def __init__(
        self, model: Model, system: System, since: Grip | None = None, *, held: bool = False
    ) -> None:
        super().__init__(model, system, held=held)
        mounts, internal = system.mounts, system.internal
        kinds = np.append(internal.kind, -1)  # of an axis without internal state
        self._mounts, self._axes = np.nonzero(kinds[mounts.internal] == PAD)
        self._pads = mounts.internal[self._mounts, self._axes]
        self._first = internal_begin(model.index.n_bodies)
        self._since = since

    def _derivatives(self, states: Floats) -> Floats:
        """Derivatives of several states, one a row; friction forces are put into the states."""
        derivatives = np.empty_like(states)
        for state, derivative in zip(states, derivatives, strict=True):
            derivative[:] = super()._derivatives(state[None])
            if self._since is not None and len(self._pads):
                stiffness = self.system.internal.parameter[self._pads, 0]
                deflection, force = self._since
                moved = self.deflection() - deflection
                state[self._first + self._pads] = force + stiffness * moved
                restore_limits(
                    self.system.internal, self.system.curves, self._first, self.work.drive, state
                )
                derivative[:] = super()._derivatives(state[None])
        return derivatives

    def deflection(self) -> Floats:
        """Deflections of the pads in the state evaluated last, float64[pad] [m]."""
        mounts, pose = self.system.mounts, self.work.pose
        bodies, points = mounts.body[self._mounts], mounts.point[self._mounts]
        attitude, centre = pose[bodies, :9].reshape(-1, 2, 3, 3), pose[bodies, 9:12]
        ends = centre + np.einsum("peij,pej->pei", attitude, points)
        along = attitude[np.arange(len(bodies)), 0, :, self._axes]
        return np.asarray(np.einsum("pi,pi->p", along, ends[:, 1] - ends[:, 0]))

    def grip(self, state: Floats) -> Grip:
        """Deflections and forces of the pads in a state."""
        self.evaluate(state)
        return Grip(self.deflection(), state[self._first + self._pads].copy())


Placed = Callable[[float, Floats], tuple[System, Floats]]


class SlidingPath:
    """A way through quasi-static states, friction following it.

    `model`: with preloads; `placed`: share of the load and a state to the system under it and that
    state, with held wheelsets where the load has them; `start`: at the share 0, friction forces
    included; `speed`: [m/s]; `held`: whether the wheelsets are held.
    """

    def __init__(
        self, model: Model, placed: Placed, start: Floats, speed: float, *, held: bool = False
    ) -> None:
        self._model, self._placed, self._speed, self._held = model, placed, speed, held
        system, guess = placed(0.0, start)
        self.solver = Sliding(model, system, held=held)
        self.state = self.solver.rolling_guess(guess, speed)
        self.share = 0.0
        self._grip = self.solver.grip(self.state)

    def to(self, goal: float) -> None:
        """Go to another share of the load, in halves if need be; NotConverged: which is reached."""
        step = goal - self.share
        while self.share != goal:
            ahead = self.share + step
            if abs(goal - ahead) < SMALLEST:
                ahead = goal
            system, guess = self._placed(ahead, self.state)
            solver = Sliding(self._model, system, self._grip, held=self._held)
            try:
                state = solver.solve(guess, self._speed)
            except NotConverged as error:
                step *= 0.5
                if abs(step) < SMALLEST:
                    raise NotConverged(
                        f"{error} ({100.0 * self.share:.0f} % of the load)"
                    ) from None
                continue
            self.state, self.share, self.solver = state, ahead, solver
            self._grip = solver.grip(state)


def has_pads(model: Model) -> bool:
    """Whether a vehicle has dry friction."""
    return bool(np.any(model.system.internal.kind == PAD))
