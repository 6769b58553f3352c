"""The time loop as the flow whose periodic motions are sought.

Its state are all entries that move of the time loop's own state, memory of the fast scheme
included, so that the periodic motions are those of the scheme and the step that runs use, on rigid
rails of half the step.  Spin rates are counted from steady rolling at the speed at hand.
"""

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cached_property

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.kernels.state import SPEED, drive_begin, internal_begin, smoothed_begin
from railsim.kernels.support import DOF, LMS
from railsim.kernels.time_loop import Chunk
from railsim.linear.circle import POSITION
from railsim.model.equilibrium import tracks_under
from railsim.model.time_step import NEVER
from railsim.model.work import CONSTANT_SPEED
from railsim.processes import available_cores
from railsim.stability.motion import LeftRange, VehicleMotion

# least sizes by which components are scaled, a difference quotient takes 1e-5 of them
LENGTH, RATE, FORCE, ACCELERATION, DRIVE = 1e-4, 1e-3, 100.0, 0.1, 1e-3
OF_TRACK = (LENGTH, RATE, RATE, ACCELERATION, ACCELERATION)
OBSERVED = 40  # records within a period


class VehicleFlow:
    """Flow of a vehicle near a speed for `railsim.stability.periodic`."""

    def __init__(self, motion: VehicleMotion, speed: float) -> None:
        self._motion = motion
        self._system = motion.system._replace(drive=CONSTANT_SPEED)
        self._step = motion.step_at(speed)
        self._rest = motion.prepared.steady(speed).copy()
        self._indices, self._floors = self._moving()
        spins = 6 * motion.model.index.n_bodies + 6 * self._system.contact.body + 4
        self._spins, self._per_speed = spins, self._rest[spins] / speed

    def _moving(self) -> tuple[Integers, Floats]:
        """Indices of all entries that move, and the least size of each."""
        model, system = self._motion.model, self._system
        n, m = model.index.n_bodies, len(system.internal.kind)
        c = self._motion.prepared.coordinates
        reference = system.bodies.reference
        found: list[tuple[int, float]] = []
        for k in range(c.n_positions + c.n_velocities):
            body, component = int(c.bodies[k]), int(c.components[k])
            if body == reference and component == 0:
                continue
            is_velocity = k >= c.n_positions
            found.append((int(c.indices[k]), RATE if is_velocity else LENGTH))
            if is_velocity:
                found.append((smoothed_begin(n, m) + 6 * body + component, ACCELERATION))
        found += [(internal_begin(n) + i, FORCE) for i in range(m)]
        found += [(drive_begin(n, m) + i, DRIVE) for i in range(m)]
        if system.support.elastic:
            # what slopes have learnt is no motion: a period begins without
            tracks = tracks_under(system, np.arange(float(model.n_state)))[:, :LMS]
            found += [(int(k), OF_TRACK[i // DOF]) for row in tracks for i, k in enumerate(row)]
        indices, floors = zip(*found, strict=True)
        return np.array(indices, dtype=np.int64), np.array(floors)

    def reduce(self, state: Floats) -> Floats:
        """Moving entries of a state of the time loop."""
        full = state.copy()
        full[self._spins] -= self._per_speed * state[SPEED]
        return np.asarray(full[self._indices])

    def full(self, reduced: Floats, speed: float) -> Floats:
        """State of the time loop."""
        state = self._rest.copy()
        state[self._indices] = reduced
        state[self._spins] += self._per_speed * speed
        state[-3:] = 0.0, POSITION, speed
        return state

    @cached_property
    def _threads(self) -> list[VehicleMotion]:
        """The motion, and the same for each further core."""
        return [self._motion, *(self._motion.own_copy() for _ in range(available_cores() - 1))]

    def _steps(self, duration: float) -> int:
        """Number of steps in a period of the length of the runs' steps, as nearly as it fits."""
        return max(8, round(duration / self._step))

    def after(self, states: Floats, durations: Floats, speeds: Floats) -> Floats:
        """States after a while, one motion a row; all with the number of steps of the first."""
        steps = self._steps(float(durations[0]))
        ends = np.full_like(states, np.nan)

        def move(motion: VehicleMotion, rows: range) -> None:
            for k in rows:
                full = self.full(states[k], float(speeds[k]))
                with suppress(LeftRange):
                    step = float(durations[k]) / steps
                    motion.advance(self._system, full, step, Chunk(1, steps, NEVER))
                    ends[k] = self.reduce(full)

        threads = self._threads[: len(states)]
        every = [range(i, len(states), len(threads)) for i in range(len(threads))]
        with ThreadPoolExecutor(len(threads)) as pool:
            list(pool.map(move, threads, every))
        return ends

    def amplitude(self, state: Floats, duration: float, speed: float) -> float:
        """Half the largest lateral travel of a wheelset within `duration` [m]."""
        y = self._motion.lateral(self._observe(state, duration, speed))
        return float(0.5 * np.max(np.ptp(y, axis=0)))

    def scale(self, state: Floats, duration: float, speed: float, amplitude: float) -> Floats:
        """Size of each component in a motion of 1 mm, from a motion of a known amplitude."""
        rows = self._motion.records(self._observe(state, duration, speed))
        size = 0.5 * np.ptp([self.reduce(row) for row in rows], axis=0) * 1e-3 / amplitude
        return np.asarray(np.maximum(size, self._floors))

    def _observe(self, state: Floats, duration: float, speed: float) -> int:
        """Record about one period; number of records."""
        steps = self._steps(duration)
        every = max(1, steps // OBSERVED)
        full = self.full(state, speed)
        chunk = Chunk(0, OBSERVED * every, every)
        return self._motion.advance(self._system, full, duration / steps, chunk)
