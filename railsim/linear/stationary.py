"""Stationary cases: a vehicle standing on cant and on twisted track.

They are solved as steady rolling at walking pace.  With `held` wheelsets stay across the track
where straight level track has them: what the lateral forces of the wheelsets add is left out, as in
the closed formulas of EN 14363 and EN 15273.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railsim.constants import CANT_BASE
from railsim.definitions.track import Track
from railsim.kernels.aligned import aligned
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.system import ARC_LENGTH, FORCE, MOMENT, System
from railsim.kernels.track_frame import PHI
from railsim.linear.circle import POSITION, circle
from railsim.linear.steady import SteadyRolling, led
from railsim.model.assembly import Model
from railsim.model.equilibrium import Equilibrium
from railsim.model.work import level_track
from railsim.track.tables import track_tables

Floats = NDArray[np.float64]

WALKING_PACE = 1.0  # m/s


@dataclass(frozen=True)
class Standing:
    """A vehicle that stands.

    Attributes
    ----------
    state : float64[n_state]
        Its state.
    Q, Q0 : float64[wheelset, side]
        Wheel loads, and those on straight level track [N].
    Y : float64[wheelset, side] or None
        Guiding forces of rolling wheelsets [N].
    """

    state: Floats
    Q: Floats
    Q0: Floats
    Y: Floats | None = None

    @property
    def unloading(self) -> float:
        """Largest dQ/Q0 of an unloaded wheel [1]."""
        return float(np.max((self.Q0 - self.Q) / self.Q0))


def on_cant(balance: Equilibrium, track: Track, cant: float, *, held: bool = False) -> Standing:
    """Return the vehicle standing on canted straight track.

    Parameters
    ----------
    balance : Equilibrium
        Of the vehicle at `WALKING_PACE`.
    track : Track
        Whose rails and friction count.
    cant : float
        [m].
    held : bool
        Hold the wheelsets across the track.
    """
    model, start = balance.model, _placed(balance)
    system = model.system._replace(track=track_tables(circle(track, cant=cant)))
    solver = SteadyRolling(model, system, held=held)
    state = solver.solve(start, WALKING_PACE).state
    solver.evaluate(state)
    return Standing(state, _loads(solver, held), balance.Q0)


def roll_coefficient(model: Model, standing: Standing, cant: float, body: str) -> float:
    """Roll of a body against the track over the angle of cant (EN 15273, UIC 505).

    Parameters
    ----------
    body : str
        Full name of the body, such as ``carbody``.
    """
    roll = standing.state[model.index.coordinate(body, 3)]
    return float(roll / np.arcsin(cant / CANT_BASE))


def on_twist(
    balance: Equilibrium,
    track: Track,
    heights: Sequence[float] | Floats,
    *,
    curvature: float = 0.0,
    held: bool = False,
) -> Standing:
    """Return the vehicle standing on twisted track (EN 14363, 6.1), or rolling in a twisted curve.

    Parameters
    ----------
    balance, track, held
        As in `on_cant`.
    heights : float64[wheelset]
        Left rail over the right one under each wheelset, on 1.5 m [m].
    curvature : float
        1/radius, positive to the right, of a curve that wheelsets roll through [1/m].
    """
    model, start = balance.model, _placed(balance)
    raised = np.asarray(heights, dtype=float)

    def flat(share: float) -> System:
        curve = circle(track, curvature=share * curvature)
        return model.system._replace(track=track_tables(curve))

    if held:
        level = flat(0.0)
        solver = SteadyRolling(model, level_track(level), held=True)
        for body, height in zip(level.contact.body, raised, strict=True):
            start[6 * body + 3] += height / CANT_BASE
        start[-2] = 0.0
        state = solver.solve(start, WALKING_PACE).state
        solver.evaluate(state)
    else:
        found, solver = led(
            model, lambda share: (_twisted(flat(share), share * raised), WALKING_PACE), start
        )
        state = found.state
    Y = None if held else np.asarray(solver.work.wheel[:, :, W_Y].copy())
    return Standing(state, _loads(solver, held), balance.Q0, Y)


def _placed(balance: Equilibrium) -> Floats:
    state = balance.state.copy()
    state[ARC_LENGTH] = POSITION
    return state


def _twisted(system: System, heights: Floats) -> System:
    """The frame of each wheelset canted for itself; all other frames stay level."""
    coefficients = system.track.coefficients.copy()
    for body, height in zip(system.contact.body, heights, strict=True):
        s = POSITION + system.frame_offset[system.bodies.frame[body]]
        cell = int((s - system.track.s_start) / system.track.ds)
        coefficients[cell, PHI, 0] = np.arcsin(height / CANT_BASE)
    return system._replace(track=system.track._replace(coefficients=aligned(coefficients)))


def _loads(solver: SteadyRolling, held: bool) -> Floats:
    """Wheel loads: of the contacts, or of held wheelsets from weight, forces and roll moments."""
    system, work = solver.system, solver.work
    if not held:
        return np.asarray(work.wheel[:, :, W_Q].copy())
    bodies = system.contact.body
    frames = work.frames[system.bodies.frame[bodies], 3:12].reshape(-1, 3, 3)
    force = np.einsum("wij,wi->wj", frames, work.pose[bodies, FORCE : FORCE + 3])
    moment = np.einsum("wij,wi->wj", frames, work.pose[bodies, MOMENT : MOMENT + 3])
    weight = system.bodies.mass[bodies] * system.gravity * frames[:, 2, 2]
    half = 0.5 * (force[:, 2] + weight)
    change = moment[:, 0] / CANT_BASE
    return np.stack([half - change, half + change], axis=1)
