"""Signals and controllers: what is measured in a run, and what follows from it.

At the begin of each step signals are sampled and the controllers that are due are called; their
commands act from the next step on.  A signal is sampled at its rate, with noise and in steps of its
resolution, and is known after its delay.  Everything that changes is in `Work.memory`.
"""

from math import cos, floor, isfinite, log, pi, sqrt

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.actuators import (
    ABOUT,
    ACTION,
    ALONG,
    AXLE,
    TIME_EPS,
    actuator_force,
    actuator_motion,
    effective_command,
    send_command,
)
from railsim.kernels.element_outputs import (
    ANGLE,
    COMMAND,
    DEFLECTION,
    LINK,
    MOMENT,
    MOUNT,
    POWER,
    RATE,
    write_link_output,
    write_mount_output,
)
from railsim.kernels.element_outputs import FORCE as ELEMENT_FORCE
from railsim.kernels.state import (
    ARC_LENGTH,
    SPEED,
    TIME,
    internal_begin,
    smoothed_begin,
    velocity_begin,
)
from railsim.kernels.status import LAW_NOT_FINITE, RUNNING
from railsim.kernels.system import ANGULAR, RADIUS, WHEELSET
from railsim.kernels.track_frame import PHI, PSI, polynomial, track_cell
from railsim.kernels.user_laws import call_law
from railsim.kernels.vectors import (
    cross,
    matrix_at,
    minus,
    plus,
    rotate,
    rotate_back,
    times,
    vector_at,
)

# columns of Signals.codes: what it is; body, element or wheelset; group of the element, or side;
# component; where it stands in `Work.memory` and how many samples are kept there
KIND, OBJECT, GROUP, COMPONENT, BASE, SLOTS = range(6)
SIGNAL_CODES = 6
# values of KIND
(
    POINT_POSITION, POINT_VELOCITY, POINT_ACCELERATION, BODY_ANGLE, BODY_RATE, ELEMENT,
    TRAVEL, WHEEL_SPEED, WHEEL, CURVATURE, CANT,
) = range(11)  # fmt: skip
# of TRAVEL: speed, distance, time, acceleration
TRAVEL_SPEED, TRAVEL_DISTANCE, TRAVEL_TIME, TRAVEL_ACCELERATION = range(4)
ACTUATOR = 2  # a group of elements, after LINK and MOUNT
# columns of Signals.row: point from the centre of gravity (3) [m], period and delay [s], standard
# deviation of the noise, resolution, distance ahead of the body's frame [m]
PERIOD, DELAY, NOISE, RESOLUTION, LOOKAHEAD = range(3, 8)
SIGNAL_ROW = 8
# in Work.memory from BASE on: number of samples so far, value, state of the noise (3), samples
N_SAMPLES, VALUE, NOISE_STATE, SAMPLES = 0, 1, 2, 5

# columns of Controllers.codes: law, its block, numbers of commands and of signals, where they begin
# in `ports`, where the count of calls stands in `Work.memory`
LAW, BLOCK, N_OUT, N_IN, FIRST_PORT, CALLS = range(6)
CONTROLLER_CODES = 6
# Work.memory[START]: time at which the run began, to which all sampling refers
RUN_START = 0


@compiled(python=False)
def point_signal(system, work, state, derivative, i):
    """Displacement or velocity of a point in track axes, or what an accelerometer reads there."""
    signals, bodies = system.signals, system.bodies
    kind, b, k = signals.codes[i, KIND], signals.codes[i, OBJECT], signals.codes[i, COMPONENT]
    arm = vector_at(signals.row, i, 0)
    C = matrix_at(work.relative, b, 0)
    if kind == POINT_POSITION:
        displacement = minus(rotate(C, arm), arm)
        return state[6 * b + k] + displacement[k]
    if kind == POINT_VELOCITY:
        q = 6 * b + 3
        pitch_rate = 0.0 if bodies.kind[b] == WHEELSET else derivative[q + 1]
        rotation = rotate(C, cross((derivative[q], pitch_rate, derivative[q + 2]), arm))
        return derivative[6 * b + k] + rotation[k]
    R = matrix_at(work.pose, b, 0)
    omega = rotate_back(R, vector_at(work.pose, b, ANGULAR))
    angular = vector_at(work.acceleration, b, 3)
    if bodies.kind[b] == WHEELSET:
        angular = angular[0], 0.0, angular[2]
    a = plus(
        vector_at(work.acceleration, b, 0),
        plus(cross(angular, arm), cross(omega, cross(omega, arm))),
    )
    g = system.gravity
    a = minus(a, times(g, (R[6], R[7], R[8])))
    return a[k] + (g if k == 2 else 0.0)


@compiled(python=False)
def element_signal(system, work, state, i):
    """Deflection, rate, force or power of an element."""
    codes, out = system.signals.codes, work.element
    group, e, column = codes[i, GROUP], codes[i, OBJECT], codes[i, COMPONENT]
    n, m = system.bodies.kind.shape[0], system.internal.kind.shape[0]
    internals = state[internal_begin(n) : smoothed_begin(n, m)]
    row = np.int64(0)  # not the literal, for which the outputs would be compiled once more
    for k in range(out.shape[1]):
        out[row, k] = 0.0
    if group == LINK:
        write_link_output(system, work, internals, e, row, out)
    elif group == MOUNT:
        write_mount_output(system, work, internals, e, row, out)
    else:
        write_actuator_output(system, work, state, e, row, out)
    return out[row, column]


@compiled(python=False)
def write_actuator_output(system, work, state, index, e, out):
    """Deflection, force, power, rate and command of an actuator or of a law of one's own."""
    x, rate, _, _, _, _ = actuator_motion(system, work, state, index)
    force = actuator_force(system, work, state, index, x, rate)
    action = system.actuators.codes[index, ACTION]
    about = 1 if action == AXLE else action - ABOUT
    along = max(0, action - ALONG)
    if about >= 0:
        out[e, ANGLE + about], out[e, MOMENT + about] = x, force
        out[e, RATE + 3 + about] = rate
    else:
        out[e, DEFLECTION + along], out[e, ELEMENT_FORCE + along] = x, force
        out[e, RATE + along] = rate
    out[e, POWER] = force * rate
    out[e, COMMAND] = effective_command(system.actuators, work.memory, index, state[TIME])


@compiled(python=False)
def track_signal(system, state, i):
    """Curvature [1/m] or cant angle [rad] of the track ahead; beyond its table that at the end."""
    codes, track = system.signals.codes, system.track
    c = track.coefficients
    s = state[ARC_LENGTH] + system.signals.row[i, LOOKAHEAD]
    last = track.s_start + (1.0 - 1e-9) * c.shape[0] * track.ds  # within the last cell
    cell, u = track_cell(track, max(track.s_start, min(last, s)))
    row = PSI if codes[i, KIND] == CURVATURE else PHI
    value, slope, _ = polynomial(
        c[cell, row, 0], c[cell, row, 1], c[cell, row, 2], c[cell, row, 3], u
    )
    return slope if row == PSI else value


@compiled(python=False)
def signal_value(system, work, state, derivative, i):
    """Present value of signal `i`, without sampling."""
    codes = system.signals.codes
    kind, b, k = codes[i, KIND], codes[i, OBJECT], codes[i, COMPONENT]
    n = system.bodies.kind.shape[0]
    if kind <= POINT_ACCELERATION:
        return point_signal(system, work, state, derivative, i)
    if kind == BODY_ANGLE:
        return state[6 * b + 3 + k]
    if kind == BODY_RATE:
        return rotate_back(matrix_at(work.pose, b, 0), vector_at(work.pose, b, ANGULAR))[k]
    if kind == ELEMENT:
        return element_signal(system, work, state, i)
    if kind == WHEEL_SPEED:
        return -state[velocity_begin(n) + 6 * b + 4] * system.bodies.row[b, RADIUS]
    if kind == WHEEL:
        return work.wheel[b, codes[i, GROUP], k]
    if kind in (CURVATURE, CANT):
        return track_signal(system, state, i)
    if k == TRAVEL_SPEED:
        return state[SPEED]
    if k == TRAVEL_DISTANCE:
        return state[ARC_LENGTH]
    return state[TIME] if k == TRAVEL_TIME else derivative[SPEED]


@compiled(python=False)
def next_uniform(memory, i):
    """Random number between 0 and 1 (Wichmann, Hill 1982, Applied Statistics 31, AS 183)."""
    memory[i] = (171.0 * memory[i]) % 30269.0
    memory[i + 1] = (172.0 * memory[i + 1]) % 30307.0
    memory[i + 2] = (170.0 * memory[i + 2]) % 30323.0
    total = memory[i] / 30269.0 + memory[i + 1] / 30307.0 + memory[i + 2] / 30323.0
    return total - floor(total)


@compiled(python=False)
def sample_signal(system, work, state, derivative, i):
    """Take the samples of signal `i` that are due, and its value that is known now."""
    signals, memory = system.signals, work.memory
    base, slots, row = signals.codes[i, BASE], signals.codes[i, SLOTS], signals.row
    period, time = row[i, PERIOD], state[TIME] - memory[RUN_START]
    if slots > 0 and time < memory[base + N_SAMPLES] * period - TIME_EPS:
        value = 0.0
    else:
        value = signal_value(system, work, state, derivative, i)
        if row[i, NOISE] > 0.0:
            # Box and Muller (1958)
            size = sqrt(-2.0 * log(max(1e-300, next_uniform(memory, base + NOISE_STATE))))
            value += row[i, NOISE] * size * cos(2.0 * pi * next_uniform(memory, base + NOISE_STATE))
        if row[i, RESOLUTION] > 0.0:
            value = row[i, RESOLUTION] * floor(value / row[i, RESOLUTION] + 0.5)
    if slots == 0:
        memory[base + VALUE] = value
        return
    while time >= memory[base + N_SAMPLES] * period - TIME_EPS:
        count = int(memory[base + N_SAMPLES])
        memory[base + SAMPLES + count % slots] = value
        memory[base + N_SAMPLES] = count + 1
    newest = max(0, int((time - row[i, DELAY] + TIME_EPS) / period))
    memory[base + VALUE] = memory[base + SAMPLES + newest % slots]


@compiled(python=False)
def run_controllers(system, work, state, derivative):
    """Sample all signals and call the controllers that are due: status and controller."""
    controllers, signals, memory = system.controllers, system.signals, work.memory
    for i in range(signals.codes.shape[0]):
        sample_signal(system, work, state, derivative, i)
    time = state[TIME]
    for c in range(controllers.codes.shape[0]):
        codes = controllers.codes[c]
        calls = codes[CALLS]
        if time - memory[RUN_START] < memory[calls] * controllers.period[c] - TIME_EPS:
            continue
        while time - memory[RUN_START] >= memory[calls] * controllers.period[c] - TIME_EPS:
            memory[calls] += 1.0
        first, n_out, n_in, port = codes[BLOCK], codes[N_OUT], codes[N_IN], codes[FIRST_PORT]
        memory[first + n_out] = time
        for k in range(n_in):
            signal = controllers.ports[port + n_out + k]
            memory[first + n_out + 1 + k] = memory[signals.codes[signal, BASE] + VALUE]
        call_law(system.user_laws.addresses[codes[LAW]], memory, first)
        for k in range(n_out):
            value = memory[first + k]
            if not isfinite(value):
                return LAW_NOT_FINITE, system.actuators.body.shape[0] + c
            send_command(system.actuators, memory, controllers.ports[port + k], value, time)
    return RUNNING, 0
