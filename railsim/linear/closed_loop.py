"""A vehicle with its controllers, linearised about steady rolling.

With the vehicle's x' = A x + B u, what the controllers give for the state is measured on the run's
own code: w = K x + D u, by differences of one call of the loop at the states about steady rolling.
It acts as u(t) = w(t - T), T being the actuator's delay, that of the slowest signal, a step of the
loop, and half the controller's period for which a command is held (Franklin, Powell, Workman 1998,
Digital control of dynamic systems, 4.4); the delay is that of Pade of order 1,
(1 - T s/2)/(1 + T s/2).  Noise, resolution and limits are left out, laws start with their memory
at 0.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.definitions import Settings, Track, Vehicle
from railsim.errors import ModelError
from railsim.kernels import actuators as acts
from railsim.kernels import controllers as kernel
from railsim.kernels.status import RUNNING
from railsim.kernels.system import TIME, System
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.system import Linearisation, without_forceless
from railsim.linear.vehicle import LinearVehicle
from railsim.model.control import with_control
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays

COMMAND_STEP = 1.0  # unit of the command


@dataclass(frozen=True)
class _Loop:
    """What controllers give for a state: w = K x + D u, and its delays [s]."""

    K: Floats
    D: Floats
    delay: Floats


def closed_loop(
    vehicle: Vehicle,
    track: Track,
    speed: float,
    *,
    step: float = 0.0,
    settings: Settings | None = None,
    **how: Any,
) -> Linearisation:
    """Linearise a vehicle with its controllers about steady rolling.

    `speed`: [m/s]; `step`: step of the loop, after which a command acts [s]; `settings`, `how`: as
    for `railsim.linear.vehicle.LinearVehicle`. Returns: the last coordinates are those of the
    delays, named after the actuators. Raises ModelError: the vehicle or a controller has no finite
    value there.
    """
    prepared = LinearVehicle(vehicle, track, settings=settings, **how)
    free = prepared.free(speed)
    delays = free.system.actuators.row[:, acts.DELAY].copy()
    which = free.system.actuators.which.copy()
    which[:, acts.SLOTS] = 0  # commands arrive at once, their delay is that of the loop
    free.system = free.system._replace(actuators=free.system.actuators._replace(which=which))
    n = len(free.coordinates.names)
    A, B = free.tangent(), _commanded(free)
    loop = _loop(prepared, free, vehicle, settings or Settings(), delays + step)
    m = B.shape[1]
    matrix = np.zeros((n + m, n + m))
    # u = z - w with z' = -2/T z + 4/T w
    inverse = np.linalg.inv(np.eye(m) + loop.D)
    u_x, u_z = -inverse @ loop.K, inverse
    matrix[:n, :n], matrix[:n, n:] = A + B @ u_x, B @ u_z
    rate = 1.0 / loop.delay[:, None]
    matrix[n:, :n] = 4.0 * rate * (loop.K + loop.D @ u_x)
    matrix[n:, n:] = 4.0 * rate * (loop.D @ u_z) - 2.0 * rate * np.eye(m)
    names = (*free.coordinates.names, *(f"{a}.delay" for a in prepared.model.index.actuators))
    state = np.concatenate([free.x, np.zeros(m)])
    w = free.coordinates.forceless
    kept = np.setdiff1d(np.arange(n + m), w)
    names, state = tuple(names[k] for k in kept), state[kept]
    return Linearisation(names, without_forceless(matrix, w), state, speed)


def _commanded(free: FreeVehicle) -> Floats:
    """How the rates follow the commands: B, float64[n, m]."""
    which, memory = free.system.actuators.which, free.work.memory
    columns = []
    for command in which[:, acts.COMMAND]:
        rates = []
        for value in (COMMAND_STEP, -COMMAND_STEP):
            memory[command] = value
            rates.append(free.rate(free.x))
        memory[command] = 0.0
        columns.append((rates[0] - rates[1]) / (2.0 * COMMAND_STEP))
    return np.array(columns).T.reshape(len(free.x), -1)


def _loop(
    prepared: LinearVehicle, free: FreeVehicle, vehicle: Vehicle, settings: Settings, delay: Floats
) -> _Loop:
    model = with_control(prepared.model, vehicle, settings)
    signals, controllers = model.system.signals, model.system.controllers
    plain, row = signals.which.copy(), signals.row.copy()
    plain[:, kernel.SLOTS] = 0
    row[:, [kernel.PERIOD, kernel.DELAY, kernel.NOISE, kernel.RESOLUTION]] = 0.0
    system = prepared.system._replace(
        actuators=free.system.actuators,
        signals=signals._replace(which=plain, row=row),
        controllers=controllers,
        own=model.system.own,
    )
    where = system.actuators.which[:, acts.COMMAND]
    given = _Commands(system, free, empty_recorder(prepared.model, 1), where)
    x, m = free.x, len(where)
    K = np.empty((m, len(x)))
    for k, h in enumerate(free.coordinates.steps):
        ahead, behind = (given(x + s * h * np.eye(len(x))[k], np.zeros(m)) for s in (1.0, -1.0))
        K[:, k] = (ahead - behind) / (2.0 * h)
    D = np.empty((m, m))
    for k in range(m):
        u = COMMAND_STEP * np.eye(m)[k]
        D[:, k] = (given(x, u) - given(x, -u)) / (2.0 * COMMAND_STEP)
    for c, one in enumerate(controllers.which):
        begin, gives = one[kernel.WIRES], one[kernel.GIVES]
        wires = controllers.wires[begin : begin + gives + one[kernel.TAKES]]
        late = signals.row[wires[gives:], kernel.DELAY].max(initial=0.0)
        delay[wires[:gives]] += 0.5 * controllers.period[c] + late
    return _Loop(K, D, np.maximum(delay, 1e-6))


class _Commands:
    """Commands that the controllers give for a state, by one call of the time loop."""

    def __init__(self, system: System, free: FreeVehicle, recorder: Any, where: Integers) -> None:
        self._system, self._work = system, work_arrays(system)
        self._free, self._where = free, where
        self._recorder = recorder

    def __call__(self, x: Floats, u: Floats) -> Floats:
        state = self._free.state.copy()
        state[self._free.coordinates.indices] = x
        memory = self._work.memory
        memory[:] = self._system.own.memory
        memory[kernel.START], memory[self._where] = state[TIME], u
        status, *_ = time_loop(
            self._system,
            self._work,
            state,
            np.zeros_like(state),
            np.zeros((3, len(state))),
            self._recorder,
            FAST,
            1e-3,
            Chunk(0, 0, 1, 0, 1),
        )
        if status != RUNNING:
            raise ModelError("a controller gives no finite command in steady rolling")
        return np.array(memory[self._where])
