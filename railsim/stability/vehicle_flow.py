"""The time loop as the flow whose periodic motions are sought.

Its state are all entries that move of the time loop's own state, memory of the fast scheme
included, so that the periodic motions are those of the scheme and the step that runs use.  Spin
rates are counted from steady rolling at the speed at hand.
"""

import numpy as np
from numpy.typing import NDArray

from railsim.kernels.status import RUNNING
from railsim.kernels.support import DOF, LEARNT, SUPPORT_SIZE
from railsim.kernels.system import N_SCALARS
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.linear.circle import POSITION
from railsim.model.time_step import empty_recorder
from railsim.model.work import CONSTANT_SPEED, work_arrays
from railsim.simulation.outputs import against_rails
from railsim.stability.motion import VehicleMotion

Floats = NDArray[np.float64]

# least sizes by which components are scaled, of positions, velocities, internal states, memory of
# accelerations and of drives: a difference quotient takes 1e-5 of them
FLOORS = (1e-4, 1e-3, 100.0, 0.1, 1e-3)
OBSERVED = 40  # records within a period


class VehicleFlow:
    """Flow of a vehicle for `railsim.stability.periodic`.

    Parameters
    ----------
    motion : VehicleMotion
        Vehicle, scheme and step.
    speed : float
        Speed of the bifurcation [m/s].
    """

    mirror = None

    def __init__(self, motion: VehicleMotion, speed: float) -> None:
        self._motion = motion
        self._system = motion.system._replace(drive=CONSTANT_SPEED)
        self._work = work_arrays(self._system)
        self._step = motion.step_at(speed)
        self._rest = motion.prepared.steady(speed).state.copy()
        self._indices, self._floors = self._moving()
        n = motion.model.index.n_bodies
        spins = 6 * n + 6 * self._system.contact.body + 4
        self._spins = spins
        self._per_speed = self._rest[spins] / speed
        size = motion.model.n_state
        self._derivative, self._stages = np.zeros(size), np.zeros((3, size))
        self._recorder = empty_recorder(motion.model, OBSERVED + 2)

    def _moving(self) -> tuple[NDArray[np.int64], Floats]:
        """Indices of all entries that move, and the least size of each."""
        model, system = self._motion.model, self._system
        n, m = model.index.n_bodies, len(system.internal.kind)
        c = self._motion.prepared.coordinates
        reference = int(system.bodies.references[0])
        indices: list[int] = []
        floors: list[float] = []
        for k in range(c.n_positions + c.n_velocities):
            body, component = int(c.bodies[k]), int(c.components[k])
            if body == reference and component == 0:
                continue
            is_velocity = k >= c.n_positions
            indices.append(int(c.indices[k]))
            floors.append(FLOORS[1] if is_velocity else FLOORS[0])
            if is_velocity:
                indices.append(12 * n + m + 6 * body + component)
                floors.append(FLOORS[3])
        indices += [12 * n + i for i in range(m)] + [18 * n + m + i for i in range(m)]
        floors += [FLOORS[2]] * m + [FLOORS[4]] * m
        if system.support.elastic:
            end = model.n_state - N_SCALARS
            first = end - SUPPORT_SIZE * len(system.contact.body)
            # what slopes have learnt is no motion: each period begins without it
            track = [k for k in range(first, end) if (k - first) % SUPPORT_SIZE < LEARNT]
            indices += track
            kinds = (FLOORS[0], FLOORS[1], FLOORS[1], FLOORS[3], FLOORS[3])
            floors += [kinds[(k - first) % SUPPORT_SIZE // DOF] for k in track]
        return np.array(indices, dtype=np.int64), np.array(floors)

    def reduced(self, state: Floats) -> Floats:
        """Moving entries of a state of the time loop."""
        full = state.copy()
        full[self._spins] -= self._per_speed * state[-1]
        return np.asarray(full[self._indices])

    def full(self, reduced: Floats, speed: float) -> Floats:
        """State of the time loop."""
        state = self._rest.copy()
        state[self._indices] = reduced
        state[self._spins] += self._per_speed * speed
        state[-3:] = 0.0, POSITION, speed
        return state

    def steps(self, duration: float) -> int:
        """Number of steps in a period of the length of the runs' steps, as nearly as it fits."""
        steps: int = round(duration / self._step)
        return max(8, steps)

    def after(self, states: Floats, durations: Floats, speeds: Floats) -> Floats:
        """States after a while, one motion a row; all with the number of steps of the first."""
        steps = self.steps(float(durations[0]))
        ends = []
        for state, duration, speed in zip(states, durations, speeds, strict=True):
            full = self.full(state, float(speed))
            status, *_ = time_loop(
                self._system,
                self._work,
                full,
                self._derivative,
                self._stages,
                self._recorder,
                self._motion.scheme,
                float(duration) / steps,
                Chunk(1, steps, 1 << 40),
            )
            if status != RUNNING:
                full[:-N_SCALARS] = np.nan
            ends.append(self.reduced(full))
        return np.array(ends)

    def amplitude(self, state: Floats, duration: float, speed: float) -> float:
        """Half the largest lateral travel of a wheelset within `duration` [m]."""
        y = against_rails(self._motion.model, self._seen(state, duration, speed))[..., 0]
        return float(0.5 * np.max(np.ptp(y, axis=0)))

    def scale(self, state: Floats, duration: float, speed: float, amplitude: float) -> Floats:
        """Size of each component in a motion of 1 mm, from a motion of a known amplitude."""
        seen = np.array([self.reduced(row) for row in self._seen(state, duration, speed)])
        size = 0.5 * np.ptp(seen, axis=0) * 1e-3 / amplitude
        return np.asarray(np.maximum(size, self._floors))

    def _seen(self, state: Floats, duration: float, speed: float) -> Floats:
        """Records of about one period."""
        steps = self.steps(duration)
        every = max(1, steps // OBSERVED)
        full = self.full(state, speed)
        _, _, _, rows = time_loop(
            self._system,
            self._work,
            full,
            self._derivative,
            self._stages,
            self._recorder,
            self._motion.scheme,
            duration / steps,
            Chunk(0, OBSERVED * every, every),
        )
        return np.asarray(self._recorder.state[:rows].copy())
