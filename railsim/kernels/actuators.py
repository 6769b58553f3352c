"""Forces that follow a command or a law of one's own, between two bodies.

An element acts along the line between its points (tension positive), along an axis of body 1 or
about one, or about the axle of a wheelset; its deflection x is the elongation, the displacement or
the angle of body 2 against body 1, as of links and mounts (see `elements`).  A wheelset's turn
about its axle has a rate alone, negative in forward rolling: what is positive drives forwards.
With the command u and the rate x':

FORCE      F = u
DAMPER     F = max(0, u) x'
POSITION   F = k (x - u) + c x'
BRAKE      F = max(0, u) x' r/v_0, at most max(0, u) to either side, r the wheel's radius
LAW        F and the rates of its states by a law of one's own

The force is held within its limit and within the power over |x'|, and fades out over the last part
of the stroke where it pushes on outwards.  A command acts after its delay; the first-order lag and
the limit of its rate are an internal state (see `internal`).
"""

from math import isfinite, sqrt

from railsim.kernels import compiled
from railsim.kernels.driving import braking_share
from railsim.kernels.state import SPEED, TIME, internal_begin
from railsim.kernels.system import ANGULAR, FORCE, MOMENT, POSITION, RADIUS, VELOCITY
from railsim.kernels.user_laws import call_law
from railsim.kernels.vectors import (
    add_at,
    cross,
    dot,
    matrix_at,
    minus,
    negative,
    plus,
    rotate,
    times,
    vector_at,
)

# columns of Actuators.codes: along the line, along an axis or about one; what the command is;
# internal state of the lag, else -1; where in `Work.memory` the last command stands, where those on
# their way and how many of them; law and its block, first of its states and their number
ACTION, MODE, LAG_STATE, COMMAND, QUEUE, SLOTS, LAW, BLOCK, USER_STATE, USER_STATES = range(10)
CODES_SIZE = 10
LARGEST = 1  # the largest command, behind the last one in `Work.memory`
# values of ACTION: the line, three axes along which it acts, three about which, axle of body 2
LINE, ALONG, ABOUT, AXLE = 0, 1, 4, 7
# values of MODE
BY_FORCE, BY_DAMPER, BY_POSITION, BY_LAW, BY_BRAKE = range(5)
# columns of Actuators.row: points (6), length of the line [m], 1 or -1 where it is mirrored, limits
# of force, power and stroke, stiffness, damping, delay
LENGTH, SENSE, LIMIT, POWER, STROKE, STIFFNESS, DAMPING, DELAY = range(6, 14)
ROW_SIZE = 14
# block of a law: force, rates of its states; deflection, rate, time, command, states, parameters
LAW_INPUTS = 4
FADE = 0.02  # part of the stroke over which the force fades out
TIME_EPS = 1e-9  # s; what is due is due by so much before


@compiled
def effective_command(actuators, memory, i, time):
    """Command of actuator `i` that has arrived at `time`."""
    slots = actuators.codes[i, SLOTS]
    if slots == 0:
        return memory[actuators.codes[i, COMMAND]]
    queue = actuators.codes[i, QUEUE]
    count = int(memory[queue])
    last = count
    while last > 0 and last > count - slots:
        last -= 1
        k = queue + 1 + 2 * (last % slots)
        if memory[k] + actuators.row[i, DELAY] <= time + TIME_EPS:
            return memory[k + 1]
    return 0.0


@compiled
def send_command(actuators, memory, i, value, time):
    """Send a command to actuator `i`; False where too many are on their way."""
    last, slots = actuators.codes[i, COMMAND], actuators.codes[i, SLOTS]
    if value == memory[last]:
        return True
    if slots > 0:
        queue = actuators.codes[i, QUEUE]
        count = int(memory[queue])
        if count >= slots:  # the second oldest takes over from the one that is overwritten
            following = memory[queue + 1 + 2 * ((count + 1) % slots)]
            if following + actuators.row[i, DELAY] > time + TIME_EPS:
                return False
        k = queue + 1 + 2 * (count % slots)
        memory[k], memory[k + 1] = time, value
        memory[queue] = count + 1
    memory[last] = value
    memory[last + LARGEST] = max(memory[last + LARGEST], value)
    return True


@compiled(python=False)
def actuator_motion(system, work, state, i):
    """Deflection and rate of element `i`, axis in which it acts, arms on both bodies, distance."""
    acts, pose = system.actuators, work.pose
    b1, b2, action = acts.body[i, 0], acts.body[i, 1], acts.codes[i, ACTION]
    R1, R2 = matrix_at(pose, b1, 0), matrix_at(pose, b2, 0)
    omega_1, omega_2 = vector_at(pose, b1, ANGULAR), vector_at(pose, b2, ANGULAR)
    a, b = rotate(R1, vector_at(acts.row, i, 0)), rotate(R2, vector_at(acts.row, i, 3))
    g = minus(plus(minus(vector_at(pose, b2, POSITION), vector_at(pose, b1, POSITION)), b), a)
    w = minus(
        plus(vector_at(pose, b2, VELOCITY), cross(omega_2, b)),
        plus(vector_at(pose, b1, VELOCITY), cross(omega_1, a)),
    )
    sense = acts.row[i, SENSE]
    if action == LINE:
        length = sqrt(dot(g, g))
        axis = times(1.0 / length, g)
        return length - acts.row[i, LENGTH], dot(axis, w), axis, a, b, g
    if action < ABOUT:
        k = action - ALONG
        axis = sense * pose[b1, k], sense * pose[b1, 3 + k], sense * pose[b1, 6 + k]
        return dot(axis, g), dot(axis, minus(w, cross(omega_1, g))), axis, a, b, g
    if action == AXLE:
        axis = pose[b2, 1], pose[b2, 4], pose[b2, 7]
        spin = state[6 * system.bodies.kind.shape[0] + 6 * b2 + 4]
        return 0.0, spin - dot(axis, omega_1), axis, a, b, g
    k = action - ABOUT
    axis = sense * pose[b1, k], sense * pose[b1, 3 + k], sense * pose[b1, 6 + k]
    # the antisymmetric part of R_1^T R_2, as of mounts
    m, n = (k + 1) % 3, (k + 2) % 3
    r_nm, r_mn = 0.0, 0.0
    for j in range(3):
        r_nm += pose[b1, 3 * j + n] * pose[b2, 3 * j + m]
        r_mn += pose[b1, 3 * j + m] * pose[b2, 3 * j + n]
    return 0.5 * sense * (r_nm - r_mn), dot(axis, minus(omega_2, omega_1)), axis, a, b, g


@compiled(python=False)
def user_force(system, work, state, i, x, rate, command):
    """Force by a law of one's own; drives its states."""
    acts, block = system.actuators, work.memory
    first, states = acts.codes[i, BLOCK], acts.codes[i, USER_STATES]
    first_state = acts.codes[i, USER_STATE]
    begin = internal_begin(system.bodies.kind.shape[0]) + first_state
    inputs = first + 1 + states
    block[inputs], block[inputs + 1] = x, rate
    block[inputs + 2], block[inputs + 3] = state[TIME], command
    for k in range(states):
        block[inputs + LAW_INPUTS + k] = state[begin + k]
    call_law(system.user_laws.addresses[acts.codes[i, LAW]], block, first)
    for k in range(states):
        work.drive[first_state + k, 0] = block[first + 1 + k]
    return block[first]


@compiled(python=False)
def limited_force(acts, i, force, x, rate):
    """Force within the limits of force, power and stroke."""
    limit, stroke = acts.row[i, LIMIT], acts.row[i, STROKE]
    if abs(force * rate) > acts.row[i, POWER]:
        limit = min(limit, acts.row[i, POWER] / abs(rate))
    force = min(limit, max(-limit, force))
    if force * x < 0.0 and abs(x) > (1.0 - FADE) * stroke:  # a positive force shortens it
        force *= min(1.0, max(0.0, (stroke - abs(x)) / (FADE * stroke)))
    return force


@compiled(python=False)
def actuator_force(system, work, state, i, x, rate):
    """Force of element `i` at its deflection and rate; leaves the drive of its lag."""
    acts = system.actuators
    command = effective_command(acts, work.memory, i, state[TIME])
    lag, mode = acts.codes[i, LAG_STATE], acts.codes[i, MODE]
    limit = acts.row[i, LIMIT]
    if mode in (BY_FORCE, BY_BRAKE):
        command = min(limit, max(-limit, command))
    if lag >= 0:
        work.drive[lag, 1] = command
        command = state[internal_begin(system.bodies.kind.shape[0]) + lag]
    if mode == BY_FORCE:
        force = command
    elif mode == BY_DAMPER:
        force = max(0.0, command) * rate
    elif mode == BY_POSITION:
        force = acts.row[i, STIFFNESS] * (x - command) + acts.row[i, DAMPING] * rate
    elif mode == BY_BRAKE:
        rim = rate * system.bodies.row[acts.body[i, 1], RADIUS]
        force = max(0.0, command) * braking_share(rim, state[SPEED])
    else:
        force = user_force(system, work, state, i, x, rate, command)
    return limited_force(acts, i, force, x, rate)


@compiled(python=False)
def add_actuator_forces(system, work, state, about_axles):
    """Add the forces of these elements to `pose`; the first without a finite force, else -1.

    `about_axles`: those about axles alone, or all others.
    """
    acts, pose = system.actuators, work.pose
    for i in range(acts.body.shape[0]):
        if (acts.codes[i, ACTION] == AXLE) != about_axles:
            continue
        x, rate, axis, a, b, g = actuator_motion(system, work, state, i)
        force = actuator_force(system, work, state, i, x, rate)
        if not isfinite(force):
            return i
        f = times(force, axis)
        b1, b2, action = acts.body[i, 0], acts.body[i, 1], acts.codes[i, ACTION]
        if action >= ABOUT:
            add_at(pose, b1, MOMENT, f)
            add_at(pose, b2, MOMENT, negative(f))
            continue
        # along an axis the force acts at the point of body 2 on both
        arm = a if action == LINE else plus(a, g)
        add_at(pose, b1, FORCE, f)
        add_at(pose, b1, MOMENT, cross(arm, f))
        add_at(pose, b2, FORCE, negative(f))
        add_at(pose, b2, MOMENT, negative(cross(b, f)))
    return -1
