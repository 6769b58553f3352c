"""A vehicle with its controllers, linearised about steady rolling.

With the vehicle's x' = A x + B u, what the controllers give for the state is measured on the run's
own code: w = K x + D u, by differences of one call of the loop at the states about steady rolling.
It acts as u(t) = w(t - T), T being the actuator's delay, that of the slowest signal, a step of the
loop, and half the time for which a command is held, the longest of the controller's period and the
time between two samples of its signals (Franklin, Powell, Workman 1998,
Digital control of dynamic systems, 4.4); the delay is that of Pade of order 1,
(1 - T s/2)/(1 + T s/2).  Noise, resolution and limits are left out, laws start with their memory
at 0.
"""

from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.errors import ModelError
from railsim.kernels import actuators as acts
from railsim.kernels import controllers as kernel
from railsim.kernels.state import TIME
from railsim.kernels.status import RUNNING
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.system import Linearisation, jacobian, without_forceless
from railsim.linear.vehicle import LinearVehicle
from railsim.model.control import with_control
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays

COMMAND_STEP = 1.0  # unit of the command


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
    which = free.system.actuators.codes.copy()
    which[:, acts.SLOTS] = 0  # commands arrive at once, their delay is that of the loop
    free.system = free.system._replace(actuators=free.system.actuators._replace(codes=which))
    n = len(free.coordinates.names)
    A, B = free.tangent(), _rates_by_command(free)
    K, D, delay = _loop(prepared, free, vehicle, settings or Settings(), delays + step)
    m = B.shape[1]
    matrix = np.zeros((n + m, n + m))
    # u = z - w with z' = -2/T z + 4/T w
    inverse = np.linalg.inv(np.eye(m) + D)
    u_x, u_z = -inverse @ K, inverse
    matrix[:n, :n], matrix[:n, n:] = A + B @ u_x, B @ u_z
    rate = 1.0 / delay[:, None]
    matrix[n:, :n] = 4.0 * rate * (K + D @ u_x)
    matrix[n:, n:] = 4.0 * rate * (D @ u_z) - 2.0 * rate * np.eye(m)
    names = (*free.coordinates.names, *(f"{a}.delay" for a in prepared.model.index.actuators))
    state = np.concatenate([free.x, np.zeros(m)])
    w = free.coordinates.forceless
    kept = np.setdiff1d(np.arange(n + m), w)
    names, state = tuple(names[k] for k in kept), state[kept]
    return Linearisation(names, without_forceless(matrix, w), state, speed)


def _rates_by_command(free: FreeVehicle) -> Floats:
    """How the rates follow the commands: B, float64[n, m]."""
    where, memory = free.system.actuators.codes[:, acts.COMMAND], free.work.memory

    def rate(commands: Floats) -> Floats:
        memory[where] = commands
        return free.rate(free.x)

    none = np.zeros(len(where))
    found = jacobian(lambda rows: np.array([rate(row) for row in rows]), none, none + COMMAND_STEP)
    memory[where] = none
    return found.reshape(len(free.x), -1)


def _loop(
    linear: LinearVehicle, free: FreeVehicle, vehicle: Vehicle, settings: Settings, delay: Floats
) -> tuple[Floats, Floats, Floats]:
    """What controllers give for a state: w = K x + D u, and its delays [s]."""
    model = with_control(linear.model, vehicle, settings)
    signals, controllers = model.system.signals, model.system.controllers
    plain, row = signals.codes.copy(), signals.row.copy()
    plain[:, kernel.SLOTS] = 0
    row[:, [kernel.PERIOD, kernel.DELAY, kernel.NOISE, kernel.RESOLUTION]] = 0.0
    system = linear.system._replace(
        actuators=free.system.actuators,
        signals=signals._replace(codes=plain, row=row),
        controllers=controllers,
        user_laws=model.system.user_laws,
    )
    where = system.actuators.codes[:, acts.COMMAND]
    work, recorder = work_arrays(system), empty_recorder(linear.model, 1)

    def given(x: Floats, u: Floats) -> Floats:
        """Commands for a state and commands before, by one call of the time loop."""
        state = free.state.copy()
        state[free.coordinates.indices] = x
        work.memory[:] = system.user_laws.memory
        work.memory[kernel.RUN_START], work.memory[where] = state[TIME], u
        rates, stages = np.zeros_like(state), np.zeros((3, len(state)))
        how = recorder, FAST, 1e-3, Chunk(0, 0, 1, 0, 1)
        status, *_ = time_loop(system, work, state, rates, stages, *how)
        if status != RUNNING:
            raise ModelError("a controller gives no finite command in steady rolling")
        return np.array(work.memory[where])

    x, u = free.x, np.zeros(len(where))
    steps = np.full(len(where), COMMAND_STEP)
    K = jacobian(lambda rows: np.array([given(row, u) for row in rows]), x, free.coordinates.steps)
    D = jacobian(lambda rows: np.array([given(x, row) for row in rows]), u, steps)
    for c, one in enumerate(controllers.codes):
        begin, gives = one[kernel.FIRST_PORT], one[kernel.N_OUT]
        wires = controllers.ports[begin : begin + gives + one[kernel.N_IN]]
        late = signals.row[wires[gives:], kernel.DELAY].max(initial=0.0)
        held = signals.row[wires[gives:], kernel.PERIOD].max(initial=controllers.period[c])
        delay[wires[:gives]] += 0.5 * held + late
    return K, D, np.maximum(delay, 1e-6)
