"""scipy's `solve_ivp` over the same compiled right-hand side, as a skilled user would call it.

What remains beside the right-hand side are scipy's own steps in Python.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.time_loop import RK4, Chunk, time_loop
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays
from railsim.simulation import prepare
from railsim.simulation.advance import Preparation
from railsim.simulation.outputs import quantities


@dataclass
class Peer:
    """A run ready for `solve_ivp`.

    On rigid rails: massless elastic rails make the motion a differential-algebraic system, which
    none of scipy's methods integrates.
    """

    prepared: Preparation
    duration: float
    output_times: np.ndarray
    calls: int = 0

    @classmethod
    def of(cls, vehicle: Vehicle, track: Track, speed: float, until: float | None = None) -> "Peer":
        prepared = prepare(vehicle, track, Settings(), speed, until=until)
        duration = prepared.end_distance / speed
        times = np.linspace(0.0, duration, round(200.0 * duration) + 1)
        return cls(prepared, duration, times)

    @property
    def kept(self) -> np.ndarray:
        """Indices in the state but for the memory of railsim's own scheme."""
        system = self.prepared.model.system
        n = 12 * len(system.bodies.kind) + len(system.internal.kind)
        size = len(self.prepared.state)
        return np.r_[:n, size - 3 : size]

    def solve(self, method: str, **options: Any) -> dict[str, Any]:
        """Integrate and return CPU time, number of evaluations and the outputs."""
        from scipy.integrate import solve_ivp

        system = self.prepared.model.system
        work = work_arrays(system)
        states = self.prepared.state[None].copy()
        derivatives = np.zeros_like(states)
        kept = self.kept
        right_hand_sides(system, work, states, derivatives)

        def function(t, y):
            states[0, kept] = y
            right_hand_sides(system, work, states, derivatives)
            return derivatives[0, kept]

        begin = time.process_time()
        solution = solve_ivp(
            function,
            (0.0, self.duration),
            self.prepared.state[kept],
            method=method,
            t_eval=self.output_times,
            **options,
        )
        cpu = time.process_time() - begin
        complete = bool(solution.success) and np.all(np.isfinite(solution.y))
        return {
            "method": method,
            "options": options,
            "cpu": cpu,
            "evaluations": int(solution.nfev),
            "real_time": self.duration / cpu,
            "success": complete,
            "outputs": self.outputs(solution.y.T) if complete else None,
        }

    def outputs(self, states: np.ndarray) -> dict[str, np.ndarray]:
        """Quantities at all output instants."""
        model = self.prepared.model
        work = work_arrays(model.system)
        derivative = np.zeros_like(self.prepared.state)
        stages = np.zeros((3, len(derivative)))
        recorder = empty_recorder(model, 1)
        rows = []
        state = self.prepared.state.copy()
        for values in states:
            state[self.kept] = values
            time_loop(
                model.system,
                work,
                state,
                derivative,
                stages,
                recorder,
                RK4,
                1.0,
                Chunk(0, 0, 1, closing=1),
            )
            found = quantities(model, recorder, 1, self.prepared.balance.Q0)
            rows.append({name: np.array(value) for name, value in found.items()})
        return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
