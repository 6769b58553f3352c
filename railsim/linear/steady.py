"""Quasi-static states: steady rolling on straight or circular track of constant cant, by Newton.

On a circle nothing changes with time when seen from the track frames: r' = 0, the angular velocity
of a body is u = C^T w_F, of a wheelset too but for its spin rate, which is unknown, and all
accelerations and internal rates vanish.  The unknowns are the coordinates, of wheelsets the spin
rate instead of the pitch; the reference body's x stays, held by the traction.

Newton's method on forces and moments, with differences, a line search, and a least-squares step
where the matrix is nearly singular.  The normal force has a potential and creep forces are
continuous, hence contact patches come and go without any logic of switching.  Where the way is too
far, it is gone in parts: the curvature, cant, friction and square of the speed are led from a known
state to the one sought, and steps that fail are halved; beyond the smallest the accelerations lead.
"""

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from railsim.arrays import Floats
from railsim.errors import ModelError
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import SPEED, internal_begin, velocity_begin
from railsim.kernels.status import RUNNING
from railsim.kernels.system import AXLEBOX, WHEELSET, System
from railsim.kernels.track_frame import OMEGA
from railsim.model.assembly import Model
from railsim.model.equilibrium import conditions, difference_quotients, settled
from railsim.model.work import CONSTANT_SPEED, work_arrays

RESIDUAL = 1e-7  # largest acceleration left (m/s2, rad/s2)
GOOD_ENOUGH = 1e-5  # the same where rounding and the cells of the creep law let it be no smaller
MOST_ITERATIONS = 40
FACTORS = 2.0 ** -np.arange(11.0)  # of the line search
STEP = 1e-8  # of the difference quotients (m, rad; of spin rates times the speed over 1 m)


class NotConverged(ModelError):
    """Newton's method found no steady state."""


class SteadyRolling:
    """Newton's method for one vehicle on one track of constant curvature and cant.

    Given forces and torques of the system have to be constant.

    `held`: whether the wheelsets stay where the guess has them; `accelerated`: whether the speed V
    changes by the system's drive, with all that rolls: spin rates are then proportional to V.
    """

    def __init__(
        self, model: Model, system: System, *, held: bool = False, accelerated: bool = False
    ) -> None:
        self.model = model
        self.system = system if accelerated else system._replace(drive=CONSTANT_SPEED)
        self.work = work_arrays(system)
        self.patches = 0  # loaded ones, of the last evaluation
        self._unknowns, self._equations, self._inertias = conditions(model, system, held=held)
        bodies = system.bodies
        self._rigid = np.flatnonzero(bodies.kind != AXLEBOX)
        self._wheelsets = np.flatnonzero(bodies.kind == WHEELSET)
        self._no_pitch = bodies.kind[self._rigid] == WHEELSET
        self._frames = bodies.frame[self._rigid]
        self._spins = velocity_begin(model.index.n_bodies) + 6 * self._wheelsets + 4

    def solve(self, guess: Floats, speed: float) -> Floats:
        """Return the steady state nearest to a guess.

        `guess`: positions and spin rates count; position and time are kept; `speed`: [m/s]. Raises
        NotConverged: names the largest remaining accelerations.
        """
        state = self.rolling_guess(guess, speed)
        forces = self._forces(state)
        for _ in range(MOST_ITERATIONS):
            better = self._better(state, forces) if self._largest(forces) >= RESIDUAL else None
            if better is None:
                break
            state, forces = better
        if not self._largest(forces) < GOOD_ENOUGH:
            left = forces / self._inertias
            words = self.model.index.largest_left(self._equations, left, 3)
            raise NotConverged(f"no steady state; {words}")
        return state

    def settled(self, guess: Floats, speed: float) -> Floats:
        """As `solve`, at first where the accelerations lead from a guess: past a kink of a force.

        Raises NotConverged: they lead nowhere.
        """

        def accelerations(states: Floats) -> Floats:
            return self._forces(states) / self._inertias

        near = self._unknowns < 6 * self.model.index.n_bodies
        found = settled(accelerations, self.rolling_guess(guess, speed), self._unknowns, near)
        if found is None:
            raise NotConverged("no steady state")
        return self.solve(found, speed)

    def evaluate(self, state: Floats) -> Floats:
        """Derivative of a state, forces into `work`; NotConverged: the state is out of range."""
        return np.asarray(self._derivatives(state[None])[0])

    def _derivatives(self, states: Floats) -> Floats:
        """Derivatives of several states, one a row."""
        derivatives = np.empty_like(states)
        status, where, self.patches = right_hand_sides(self.system, self.work, states, derivatives)
        if status != RUNNING:
            raise NotConverged(f"no steady state: {self.model.index.sentence(status, where)}")
        return derivatives

    def rolling_guess(self, guess: Floats, speed: float) -> Floats:
        """Return a guess with the velocities of steady rolling at a speed [m/s]."""
        state = guess.copy()
        n, spins = self.model.index.n_bodies, self._spins
        before = float(guess[-1])
        state[velocity_begin(n) : internal_begin(n)] = 0.0
        state[SPEED] = speed
        rolling = -speed / self.system.bodies.radius[self._wheelsets]
        state[spins] = guess[spins] * speed / before if np.all(guess[spins]) else rolling
        self.evaluate(state)  # the frames
        self._turn_with_frames(state[None])
        return state

    def _turn_with_frames(self, states: Floats) -> None:
        """Set u = C^T w_F of all bodies in several states, of wheelsets but for the spin."""
        n = self.model.index.n_bodies
        omega = states[0, -1] * self.work.frames[self._frames, OMEGA : OMEGA + 3]
        if not omega.any():
            return
        angles = states[:, : 6 * n].reshape(-1, n, 6)[:, self._rigid, 3:]
        roll, pitch, yaw = np.moveaxis(angles, 2, 0)
        pitch = np.where(self._no_pitch, 0.0, pitch)
        x, y, z = omega.T
        x, y = np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x
        y, z = np.cos(roll) * y + np.sin(roll) * z, np.cos(roll) * z - np.sin(roll) * y
        x, z = np.cos(pitch) * x - np.sin(pitch) * z, np.cos(pitch) * z + np.sin(pitch) * x
        first = velocity_begin(n) + 6 * self._rigid
        states[:, first + 3] = x
        states[:, first + 4] = np.where(self._no_pitch, states[:, first + 4], y)
        states[:, first + 5] = z

    def _forces(self, states: Floats) -> Floats:
        """What is not balanced, of one state or of several, one a row."""
        rows = np.atleast_2d(states)
        self._turn_with_frames(rows)
        rates = self._derivatives(rows)
        rates[:, self._spins] -= rows[:, self._spins] * rates[:, [SPEED]] / rows[:, [SPEED]]
        found = rates[:, self._equations] * self._inertias
        return np.asarray(found.reshape(*states.shape[:-1], -1))

    def _largest(self, forces: Floats) -> float:
        return float(np.max(np.abs(forces / self._inertias)))

    def _better(self, state: Floats, forces: Floats) -> tuple[Floats, Floats] | None:
        """State and forces after one step of Newton's method, None if none is better."""
        matrix = difference_quotients(self._forces, state, forces, self._unknowns, STEP)
        try:
            change = np.asarray(np.linalg.solve(matrix, -forces), dtype=float)
            better = self._line_search(state, forces, change)
        except np.linalg.LinAlgError:
            better = None
        if better is None:  # nearly singular, such as without friction
            least, *_ = np.linalg.lstsq(matrix, -forces, rcond=1e-12)
            better = self._line_search(state, forces, np.asarray(least, dtype=float))
        return better

    def _line_search(
        self, state: Floats, forces: Floats, change: Floats
    ) -> tuple[Floats, Floats] | None:
        size = float(np.linalg.norm(forces))
        for factor in FACTORS:
            trial = state.copy()
            trial[self._unknowns] += factor * change
            with suppress(NotConverged), np.errstate(over="ignore"):  # a trial may be far off
                found = self._forces(trial)
                if np.linalg.norm(found) < (1.0 - 0.1 * factor) * size:
                    return trial, found
        return None


Systems = Callable[[float], tuple[System, float]]


def follow(
    model: Model, systems: Systems, start: Floats, *, smallest: float = 1.0 / 64.0
) -> tuple[Floats, SteadyRolling]:
    """Lead a steady state from where it is known to where it is sought.

    `model`: with preloads; `along`: share of the way, above 0 to 1, to the system and the speed
    there; `start`: state at share 0; `smallest`: step at which the path ends for lack of
    convergence. Returns: at share 1, and the solver with the forces there in `work`. Raises
    NotConverged: says how far it came.
    """
    done, step = 0.0, 1.0
    before, now = start, start
    length = 1.0
    while True:
        share = min(1.0, done + step)
        system, speed = systems(share)
        solver = SteadyRolling(model, system)
        for guess in [now + (now - before) * (share - done) / length, now] if done > 0.0 else [now]:
            try:
                found = solver.solve(guess, speed)
                break
            except NotConverged as error:
                reason = error
        else:
            step *= 0.5
            if step < smallest:
                try:
                    now = before = solver.settled(now, speed)
                except NotConverged:
                    raise NotConverged(f"{reason} ({100.0 * done:.0f} % of the way)") from None
                done, step = share, smallest
            continue
        before, length = now, share - done
        now, done = found, share
        if done >= 1.0:
            solver.evaluate(now)
            return now, solver
        step = min(2.0 * step, 1.0 - done)
