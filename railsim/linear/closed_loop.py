"""A vehicle with its controllers, linearised about steady rolling.

With the vehicle's x' = A x + B u, what the controllers give for the state is measured on the run's
own code, by differences of one call of the loop at the states about steady rolling: commands
w = K x + D u + H m, and what they remember, m(t + T_c) = F m + G (x, u), from m = 0 on.  In
continuous time a memory follows by the bilinear transformation z = (1 + s T_c/2)/(1 - s T_c/2) with
the controller's period T_c (Franklin, Powell, Workman 1998, Digital control of dynamic systems,
6.3).  A command acts as u(t) = w(t - T), T being the actuator's delay, that of the slowest signal,
a step of the loop, and half the time for which a command is held, the longest of the controller's
period and the time between two samples of its signals (ibid., 4.4); the delay is that of Pade of
order 1, (1 - T s/2)/(1 + T s/2), good for w T up to 1.  A damper has the constant that is
commanded in steady rolling; where the contact is linearised for an amplitude, wheelsets hunt as
with commands that stay.  What else a command does to the steady state, noise, resolution, limits,
and what a memory does that is not linear near 0, such as a counter, are left out.
"""

from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.errors import ModelError
from railsim.kernels import actuators as acts
from railsim.kernels import controllers as kernel
from railsim.kernels.state import ARC_LENGTH, SPEED, TIME, internal_begin, velocity_begin
from railsim.kernels.status import RUNNING
from railsim.kernels.system import Bodies
from railsim.kernels.time_loop import FAST, Chunk, time_loop
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.system import Linearisation, jacobian, without_forceless
from railsim.linear.vehicle import LinearVehicle
from railsim.model.control import with_control
from railsim.model.time_step import empty_recorder
from railsim.model.work import work_arrays

COMMAND_STEP = 1.0  # unit of the command
MEMORY_STEP = 1e-6  # of a memory, whatever it holds


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
    delays, named after the actuators, and of the memories, after the controllers. Raises
    ModelError: the vehicle or a controller has no finite value there.
    """
    prepared = LinearVehicle(vehicle, track, settings=settings, **how)
    free = prepared.free(speed)
    delays = free.system.actuators.row[:, acts.DELAY].copy()
    which = free.system.actuators.codes.copy()
    which[:, acts.SLOTS] = 0  # commands arrive at once, their delay is that of the loop
    free.system = free.system._replace(actuators=free.system.actuators._replace(codes=which))
    n = len(free.coordinates.names)
    loop, names, periods, delay = _loop(prepared, free, vehicle, settings or Settings(), delays)
    A, B = prepared.for_amplitude(free, free.tangent()), _rates_by_command(free)
    m, k = B.shape[1], len(periods)
    z, total = slice(n, n + m), n + m + k
    commands, memory, G = loop[:m, n + m :], loop[m:, n + m :], loop[m:, : n + m]
    try:
        W = np.linalg.inv(memory + np.eye(k))
    except np.linalg.LinAlgError:
        raise ModelError("the memory of a controller changes its sign from call to call") from None
    direct = loop[:m, : n + m] - commands @ W @ G  # K and D
    # u = z - w with z' = -2/T z + 4/T w
    U, unit = np.zeros((m, total)), np.eye(total)
    U[:, :n], U[:, z] = -direct[:, :n], np.eye(m)
    U[:, n + m :] = -2.0 * (commands / periods) @ W
    U = np.linalg.inv(np.eye(m) + direct[:, n:]) @ U
    matrix = np.zeros((total, total))
    matrix[:n] = B @ U
    matrix[:n, :n] += A
    matrix[z] = (2.0 * unit[z] - 4.0 * U) / (delay + step)[:, None]
    matrix[n + m :] = 2.0 * W @ G @ np.concatenate([unit[:n], U])
    matrix[n + m :, n + m :] += (2.0 / periods)[:, None] * (W @ (memory - np.eye(k)))
    names = (*free.coordinates.names, *names)
    state = np.concatenate([free.x, np.zeros(m + k)])
    w = free.coordinates.forceless
    kept = np.setdiff1d(np.arange(total), w)
    names, state = tuple(names[k] for k in kept), state[kept]
    return Linearisation(names, without_forceless(matrix, w), state, speed)


def _rates_by_command(free: FreeVehicle) -> Floats:
    """How the rates follow the commands: B, float64[n, m]."""
    where, memory = free.system.actuators.codes[:, acts.COMMAND], free.work.memory

    def rate(commands: Floats) -> Floats:
        memory[where] = commands
        return free.rate(free.x)

    steady = memory[where]
    steps = np.full(len(where), COMMAND_STEP)
    found = jacobian(lambda rows: np.array([rate(row) for row in rows]), steady, steps)
    memory[where] = steady
    return found.reshape(len(free.x), -1)


def _carry(state: Floats, bodies: Bodies) -> None:
    """Let the track frames move along as the reference body does, as in a run, not it in them."""
    for begin, place in ((0, ARC_LENGTH), (velocity_begin(len(bodies.kind)), SPEED)):
        along = state[begin + 6 * bodies.reference]
        state[place] += along
        state[begin + 6 * bodies.whole] -= along


def _loop(
    linear: LinearVehicle, free: FreeVehicle, vehicle: Vehicle, settings: Settings, delay: Floats
) -> tuple[Floats, tuple[str, ...], Floats, Floats]:
    """What controllers give, and remember, for a state, commands and memory before.

    Its Jacobian, names of the delays and memories, periods of the memories and delays [s]; the
    vehicle has the commands of steady rolling from then on.
    """
    model = with_control(linear.model, vehicle, settings)
    signals, controllers = model.system.signals, model.system.controllers
    plain, row = signals.codes.copy(), signals.row.copy()
    plain[:, kernel.SLOTS] = 0
    row[:, [kernel.PERIOD, kernel.DELAY, kernel.NOISE, kernel.RESOLUTION]] = 0.0
    system = free.system._replace(
        signals=signals._replace(codes=plain, row=row),
        controllers=controllers,
        user_laws=model.system.user_laws,
    )
    where = system.actuators.codes[:, acts.COMMAND]
    names = [f"{actuator}.delay" for actuator in model.index.actuators]
    places, periods = list(where), []
    for codes, (name, one) in zip(
        controllers.codes, (vehicle.controllers or {}).items(), strict=True
    ):
        size, end = one.memory or 0, codes[kernel.CALLS]
        places += range(end - size, end)  # a law's memory stands last in its block
        names += [f"{name}.memory.{number}" for number in range(size)]
        periods += [one.period] * size
        begin, gives = codes[kernel.FIRST_PORT], codes[kernel.N_OUT]
        wires = controllers.ports[begin : begin + gives + codes[kernel.N_IN]]
        late = signals.row[wires[gives:], kernel.DELAY].max(initial=0.0)
        held = signals.row[wires[gives:], kernel.PERIOD].max(initial=one.period)
        delay[wires[:gives]] += 0.5 * held + late
    work, recorder, n = work_arrays(system), empty_recorder(linear.model, 1), len(free.x)

    def given(before: Floats) -> Floats:
        """Commands and memory after one call of the time loop."""
        state = free.state.copy()
        state[free.coordinates.indices] = before[:n]
        _carry(state, system.bodies)
        work.memory[:] = system.user_laws.memory
        work.memory[kernel.RUN_START], work.memory[places] = state[TIME], before[n:]
        rates, stages = np.zeros_like(state), np.zeros((3, len(state)))
        how = recorder, FAST, 1e-3, Chunk(0, 0, 1, 0, 1)
        status, *_ = time_loop(system, work, state, rates, stages, *how)
        if status != RUNNING:
            raise ModelError("a controller gives no finite command in steady rolling")
        return np.array(work.memory[places])

    before = np.concatenate([free.x, np.zeros(len(places))])
    steady, lags = given(before)[: len(where)], system.actuators.codes[:, acts.LAG_STATE]
    free.work.memory[where] = steady
    free.state[internal_begin(len(system.bodies.kind)) + lags[lags >= 0]] = steady[lags >= 0]
    before = np.concatenate([free.x, steady, np.zeros(len(periods))])
    of_memory = [COMMAND_STEP] * len(where) + [MEMORY_STEP] * len(periods)
    steps = np.concatenate([free.coordinates.steps, of_memory])
    loop = jacobian(lambda rows: np.array([given(row) for row in rows]), before, steps)
    return loop, tuple(names), np.array(periods), np.maximum(delay, 1e-6)
