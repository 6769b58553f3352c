"""Stationary cases: a vehicle standing on cant and on twisted track.

They are solved as steady rolling at walking pace.  With `held` wheelsets stay across the track
where straight level track has them: what the lateral forces of the wheelsets add is left out, as in
the closed formulas of EN 14363 and EN 15273.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats, first_largest
from railsim.constants import CANT_BASE
from railsim.definitions import Track
from railsim.kernels.alignment import aligned_copy
from railsim.kernels.contact_columns import W_Q, W_Y
from railsim.kernels.state import ARC_LENGTH
from railsim.kernels.system import FORCE, MOMENT, System
from railsim.kernels.track_frame import PHI
from railsim.linear.circle import POSITION, at_middle, circle
from railsim.linear.sliding import Placed, SlidingPath, has_pads
from railsim.linear.steady import NotConverged, SteadyRolling, follow
from railsim.model.assembly import Model
from railsim.model.equilibrium import Equilibrium
from railsim.model.work import level_track, without_loads
from railsim.track.tables import track_tables

WALKING_PACE = 1.0  # m/s
PARTS = 8  # steps to a twist where friction follows
MOST_CYCLES = 6  # of loading and unloading until the loop closes ...
CLOSED = 1e-3  # ... to this part of the load


@dataclass(frozen=True)
class Standing:
    """A vehicle that stands."""

    state: Floats
    Q: Floats  # wheel loads [N]
    Q0: Floats  # on straight level track [N]
    Y: Floats | None = None  # guiding forces of rolling wheelsets [N]

    @property
    def unloading(self) -> float:
        """Largest dQ/Q0 of an unloaded wheel [1]."""
        return float(np.max((self.Q0 - self.Q) / self.Q0))


def on_cant(balance: Equilibrium, track: Track, cant: float, *, held: bool = False) -> Standing:
    """Return the vehicle standing on canted straight track [m]; `held`: its wheelsets."""
    model, start = balance.model, at_middle(balance.state)
    system = without_loads(model.system)._replace(track=track_tables(circle(track, cant=cant)))
    solver = SteadyRolling(model, system, held=held)
    state = solver.solve(start, WALKING_PACE)
    solver.evaluate(state)
    return Standing(state, _loads(solver, held, on_cant=True), balance.Q0)


def roll_coefficient(model: Model, standing: Standing, cant: float, body: str) -> float:
    """Roll of a body against the track over the angle of cant (EN 15273, UIC 505)."""
    return float(standing.state[model.index.coordinate(body, 3)] / np.arcsin(cant / CANT_BASE))


@dataclass(frozen=True)
class TwistLoop:
    """Wheel loads while a twist grows from level track, and goes to and fro until it closes."""

    share: Floats  # of the twist, from 1/n over 1 to -1 and back, as often as it takes [1]
    Q: Floats  # wheel loads [N]
    Q0: Floats  # on straight level track [N]

    @property
    def unloading(self) -> Floats:
        """dQ/Q0 of all wheels, float64[k, wheelset, side] [1]."""
        return np.asarray((self.Q0 - self.Q) / self.Q0)

    @property
    def smallest(self) -> Floats:
        """Smallest loads in the closed loop, without the way to it, float64[wheelset, side] [N]."""
        return np.asarray(self.Q[-4 * PARTS :].min(axis=0))

    @property
    def worst(self) -> tuple[int, int]:
        """Wheelset and side of the wheel that the closed loop unloads most."""
        wheelset, side = first_largest(1.0 - self.smallest / self.Q0)
        return wheelset, side

    @property
    def on_level(self) -> tuple[float, float]:
        """dQ/Q0 of that wheel on level track, on the way to its unloading and back [1]."""
        level = np.flatnonzero(self.share == 0.0)[-2:]
        if not len(level):
            return 0.0, 0.0
        left = self.unloading[level][(slice(None), *self.worst)]
        return float(np.max(left)), float(np.min(left))


def twist_loop(
    balance: Equilibrium, track: Track, heights: Sequence[float] | Floats, *, held: bool = False
) -> TwistLoop:
    """Return the loads on twisted track from both directions: up to it, to the opposite and back.

    Without dry friction both directions give the same, and only the two twists are computed.

    `balance`, `track`, `heights`, `held`: as in `on_twist`. Raises NotConverged: there is no steady
    state on the way, or the loop does not close.
    """
    raised = np.asarray(heights, dtype=float)
    if not has_pads(balance.model):
        both = [on_twist(balance, track, sign * raised, held=held) for sign in (1.0, -1.0)]
        return TwistLoop(np.array([1.0, -1.0]), np.array([s.Q for s in both]), balance.Q0)
    path = _path(balance, track, raised, 0.0, held)
    shares, loads = [], []

    def go(*goals: float) -> None:
        for goal in goals:
            for share in np.linspace(path.share, goal, PARTS + 1)[1:]:
                path.to(float(share))
                path.solver.evaluate(path.state)
                shares.append(float(share))
                loads.append(_loads(path.solver, held))

    go(1.0)
    for _ in range(MOST_CYCLES):
        before = loads[-1]
        go(0.0, -1.0, 0.0, 1.0)
        if np.max(np.abs(loads[-1] - before) / balance.Q0) < CLOSED:
            return TwistLoop(np.array(shares), np.array(loads), balance.Q0)
    raise NotConverged(f"loading and unloading form no closed loop within {MOST_CYCLES} cycles")


def on_twist(
    balance: Equilibrium,
    track: Track,
    heights: Sequence[float] | Floats,
    *,
    curvature: float = 0.0,
    held: bool = False,
) -> Standing:
    """Return the vehicle standing on twisted track (EN 14363, 6.1), or rolling in a twisted curve.

    Dry friction follows the way from straight level track.

    `balance`, `track`, `held`: as in `on_cant`; `heights`: left rail over the right one under each
    wheelset [m]; `curvature`: 1/radius, positive to the right, of a curve that wheelsets
    roll through [1/m].
    """
    raised = np.asarray(heights, dtype=float)
    solver: SteadyRolling
    if held or has_pads(balance.model):
        path = _under_full_load(lambda: _path(balance, track, raised, curvature, held))
        state, solver = path.state, path.solver
    else:
        under = _placing(balance, track, raised, curvature, held)
        start = at_middle(balance.state)
        state, solver = follow(
            balance.model, lambda share: (under(share, start)[0], WALKING_PACE), start
        )
    solver.evaluate(state)
    Y = None if held else np.asarray(solver.work.wheel[:, :, W_Y].copy())
    return Standing(state, _loads(solver, held), balance.Q0, Y)


def _under_full_load(begin: Callable[[], SlidingPath]) -> SlidingPath:
    """A path at its full load, in as many steps as lead there: a long one may pass a gap."""
    for parts in (PARTS, 3, 2):
        with suppress(NotConverged):
            path = begin()
            for share in np.linspace(0.0, 1.0, parts + 1)[1:]:
                path.to(float(share))
            return path
    path = begin()
    path.to(1.0)
    return path


def _path(
    balance: Equilibrium, track: Track, heights: Floats, curvature: float, held: bool
) -> SlidingPath:
    """The way from straight level track to a twist, and to a curve."""
    under = _placing(balance, track, heights, curvature, held)
    return SlidingPath(balance.model, under, at_middle(balance.state), WALKING_PACE, held=held)


def _placing(
    balance: Equilibrium, track: Track, heights: Floats, curvature: float, held: bool
) -> Placed:
    """System and held wheelsets at a share of twist and curvature."""
    model = balance.model
    if not held:

        def rolling(share: float, state: Floats) -> tuple[System, Floats]:
            curve = circle(track, curvature=share * curvature)
            system = without_loads(model.system)._replace(track=track_tables(curve))
            return _on_twisted_frames(system, share * heights), state

        return rolling
    level = level_track(model.system._replace(track=track_tables(circle(track))))
    rolls = 6 * np.asarray(level.contact.body) + 3
    upright = balance.state[rolls]

    def standing(share: float, state: Floats) -> tuple[System, Floats]:
        held_at = state.copy()
        held_at[rolls] = upright + share * heights / level.track.rail_base
        held_at[ARC_LENGTH] = 0.0
        return level, held_at

    return standing


def _on_twisted_frames(system: System, heights: Floats) -> System:
    """The frame of each wheelset canted for itself; all other frames stay level."""
    coefficients = system.track.coefficients.copy()
    for body, height in zip(system.contact.body, heights, strict=True):
        s = POSITION + system.frame_offset[system.bodies.frame[body]]
        cell = int((s - system.track.s_start) / system.track.ds)
        coefficients[cell, PHI, 0] = np.arcsin(height / system.track.rail_base)
    return system._replace(track=system.track._replace(coefficients=aligned_copy(coefficients)))


def _loads(solver: SteadyRolling, held: bool, *, on_cant: bool = False) -> Floats:
    """Wheel loads: of the contacts, or of held wheelsets from weight, forces and roll moments.

    On cant the rails hold a wheelset across, at their tops: a lateral force has the wheel radius as
    lever.  On twist the closed formulas neglect the lateral forces.
    """
    system, work = solver.system, solver.work
    if not held:
        return np.asarray(work.wheel[:, :, W_Q].copy())
    bodies = system.contact.body
    frames = work.frames[system.bodies.frame[bodies], 3:12].reshape(-1, 3, 3)
    force = np.einsum("wij,wi->wj", frames, work.pose[bodies, FORCE : FORCE + 3])
    moment = np.einsum("wij,wi->wj", frames, work.pose[bodies, MOMENT : MOMENT + 3])
    force += (system.bodies.mass[bodies] * system.gravity)[:, None] * frames[:, 2]
    half = 0.5 * force[:, 2]
    base = system.track.rail_base
    change = moment[:, 0] / base
    if on_cant:
        change += system.bodies.radius[bodies] * force[:, 1] / base
    return np.stack([half - change, half + change], axis=1)
