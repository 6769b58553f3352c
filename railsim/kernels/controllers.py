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
    EARLY,
    actuator_force,
    actuator_motion,
    command_at,
    send,
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
    link_output,
    mount_output,
)
from railsim.kernels.element_outputs import FORCE as ELEMENT_FORCE
from railsim.kernels.own_laws import call_at
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
from railsim.kernels.track_frame import PHI, PSI, cell_of, polynomial
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

# columns of Signals.which: what it is; body, element or wheelset; group of the element, or side;
# component; where it stands in `Work.memory` and how many samples are kept there
KIND, OF, GROUP, COMPONENT, BASE, SLOTS = range(6)
SIGNAL_WHICH = 6
# values of KIND
(
    POINT_POSITION, POINT_VELOCITY, POINT_ACCELERATION, BODY_ANGLE, BODY_RATE, ELEMENT,
    TRAVEL, WHEEL_SPEED, WHEEL, CURVATURE, CANT,
) = range(11)  # fmt: skip
# of TRAVEL: speed, distance, time, acceleration
OF_SPEED, OF_DISTANCE, OF_TIME, OF_CHANGE = range(4)
ACTUATOR = 2  # a group of elements, after LINK and MOUNT
# columns of Signals.row: point from the centre of gravity (3) [m], period and delay [s], standard
# deviation of the noise, resolution, distance ahead of the body's frame [m]
PERIOD, DELAY, NOISE, RESOLUTION, AHEAD_BY = range(3, 8)
SIGNAL_ROW = 8
# in Work.memory from BASE on: number of samples so far, value, state of the noise (3), samples
TAKEN, VALUE, DICE, SAMPLES = 0, 1, 2, 5

# columns of Controllers.which: law, its block, numbers of commands and of signals, where they begin
# in `wires`, where the count of calls stands in `Work.memory`
LAW, BLOCK, GIVES, TAKES, WIRES, CALLS = range(6)
CONTROLLER_WHICH = 6
# Work.memory[START]: time at which the run began, to which all sampling refers
START = 0


@compiled(python=False)
def point_signal(system, work, state, derivative, i):
    """Displacement or velocity of a point in track axes, or what an accelerometer reads there."""
    signals, bodies = system.signals, system.bodies
    which, b, k = signals.which[i, KIND], signals.which[i, OF], signals.which[i, COMPONENT]
    arm = vector_at(signals.row, i, 0)
    C = matrix_at(work.relative, b, 0)
    if which == POINT_POSITION:
        moved = minus(rotate(C, arm), arm)
        return state[6 * b + k] + moved[k]
    if which == POINT_VELOCITY:
        q = 6 * b + 3
        pitching = 0.0 if bodies.kind[b] == WHEELSET else derivative[q + 1]
        turning = rotate(C, cross((derivative[q], pitching, derivative[q + 2]), arm))
        return derivative[6 * b + k] + turning[k]
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
    which, out = system.signals.which, work.element
    group, e, column = which[i, GROUP], which[i, OF], which[i, COMPONENT]
    n, m = system.bodies.kind.shape[0], system.internal.kind.shape[0]
    inner = state[internal_begin(n) : smoothed_begin(n, m)]
    row = np.int64(0)  # not the literal, for which the outputs would be compiled once more
    for k in range(out.shape[1]):
        out[row, k] = 0.0
    if group == LINK:
        link_output(system, work, inner, e, row, out)
    elif group == MOUNT:
        mount_output(system, work, inner, e, row, out)
    else:
        actuator_output(system, work, state, e, row, out)
    return out[row, column]


@compiled(python=False)
def actuator_output(system, work, state, index, e, out):
    """Deflection, force, power, rate and command of an actuator or of a law of one's own."""
    x, rate, _, _, _, _ = actuator_motion(system, work, state, index)
    force = actuator_force(system, work, state, index, x, rate)
    action = system.actuators.which[index, ACTION]
    about = 1 if action == AXLE else action - ABOUT
    along = max(0, action - ALONG)
    if about >= 0:
        out[e, ANGLE + about], out[e, MOMENT + about] = x, force
        out[e, RATE + 3 + about] = rate
    else:
        out[e, DEFLECTION + along], out[e, ELEMENT_FORCE + along] = x, force
        out[e, RATE + along] = rate
    out[e, POWER] = force * rate
    out[e, COMMAND] = command_at(system.actuators, work.memory, index, state[TIME])


@compiled(python=False)
def track_signal(system, state, i):
    """Curvature [1/m] or cant angle [rad] of the track ahead; 0 beyond the end of its table."""
    which = system.signals.which
    ahead = system.signals.row[i, AHEAD_BY]
    cell, u = cell_of(system.track, state[ARC_LENGTH] + ahead)
    if cell < 0:
        return 0.0
    row = PSI if which[i, KIND] == CURVATURE else PHI
    c = system.track.coefficients
    value, slope, _ = polynomial(
        c[cell, row, 0], c[cell, row, 1], c[cell, row, 2], c[cell, row, 3], u
    )
    return slope if row == PSI else value


@compiled(python=False)
def signal_value(system, work, state, derivative, i):
    """Present value of signal `i`, without sampling."""
    which = system.signals.which
    kind, b, k = which[i, KIND], which[i, OF], which[i, COMPONENT]
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
        return work.wheel[b, which[i, GROUP], k]
    if kind in (CURVATURE, CANT):
        return track_signal(system, state, i)
    if k == OF_SPEED:
        return state[SPEED]
    if k == OF_DISTANCE:
        return state[ARC_LENGTH]
    return state[TIME] if k == OF_TIME else derivative[SPEED]


@compiled(python=False)
def uniform(memory, at):
    """Random number between 0 and 1 (Wichmann, Hill 1982, Applied Statistics 31, AS 183)."""
    memory[at] = (171.0 * memory[at]) % 30269.0
    memory[at + 1] = (172.0 * memory[at + 1]) % 30307.0
    memory[at + 2] = (170.0 * memory[at + 2]) % 30323.0
    total = memory[at] / 30269.0 + memory[at + 1] / 30307.0 + memory[at + 2] / 30323.0
    return total - floor(total)


@compiled(python=False)
def sample(system, work, state, derivative, i):
    """Take the samples of signal `i` that are due, and its value that is known now."""
    signals, memory = system.signals, work.memory
    base, slots, row = signals.which[i, BASE], signals.which[i, SLOTS], signals.row
    period, time = row[i, PERIOD], state[TIME] - memory[START]
    if slots > 0 and time < memory[base + TAKEN] * period - EARLY:
        value = 0.0
    else:
        value = signal_value(system, work, state, derivative, i)
        if row[i, NOISE] > 0.0:
            # Box and Muller (1958)
            size = sqrt(-2.0 * log(max(1e-300, uniform(memory, base + DICE))))
            value += row[i, NOISE] * size * cos(2.0 * pi * uniform(memory, base + DICE))
        if row[i, RESOLUTION] > 0.0:
            value = row[i, RESOLUTION] * floor(value / row[i, RESOLUTION] + 0.5)
    if slots == 0:
        memory[base + VALUE] = value
        return
    while time >= memory[base + TAKEN] * period - EARLY:
        taken = int(memory[base + TAKEN])
        memory[base + SAMPLES + taken % slots] = value
        memory[base + TAKEN] = taken + 1
    known = max(0, int((time - row[i, DELAY] + EARLY) / period))
    memory[base + VALUE] = memory[base + SAMPLES + known % slots]


@compiled(python=False)
def control(system, work, state, derivative):
    """Sample all signals and call the controllers that are due: status and controller."""
    controllers, signals, memory = system.controllers, system.signals, work.memory
    for i in range(signals.which.shape[0]):
        sample(system, work, state, derivative, i)
    time = state[TIME]
    for c in range(controllers.which.shape[0]):
        which = controllers.which[c]
        calls = which[CALLS]
        if time - memory[START] < memory[calls] * controllers.period[c] - EARLY:
            continue
        while time - memory[START] >= memory[calls] * controllers.period[c] - EARLY:
            memory[calls] += 1.0
        first, gives, takes, wires = which[BLOCK], which[GIVES], which[TAKES], which[WIRES]
        memory[first + gives] = time
        for k in range(takes):
            signal = controllers.wires[wires + gives + k]
            memory[first + gives + 1 + k] = memory[signals.which[signal, BASE] + VALUE]
        call_at(system.own.places[which[LAW]], memory, first)
        for k in range(gives):
            value = memory[first + k]
            if not isfinite(value):
                return LAW_NOT_FINITE, system.actuators.body.shape[0] + c
            send(system.actuators, memory, controllers.wires[wires + k], value, time)
    return RUNNING, 0
