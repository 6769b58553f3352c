"""Deflection, force and power of named elements, for the output; not part of the time loop's work.

The laws are those of `elements`, evaluated again at the recorded state, one element at a time: it
stands in all eight lanes, and the first one is read.
"""

from railsim.kernels import compiled
from railsim.kernels.element_columns import TRANSLATES, link_columns, mount_columns
from railsim.kernels.elements import (
    between,
    in_body_axes,
    link_tension,
    nonlinear_force,
    pose_rows,
    relative_motion,
    rotation_moment,
    spring_damper,
)
from railsim.kernels.lanes import LANES, lane_numbers, store_lanes
from railsim.kernels.vectors import dot, plus, rotate, rotate_back, times

LINK, MOUNT = range(2)

# columns: deflection x y z (a link's along its line in x), angles about x y z, forces, moments,
# power taken from the bodies, rates of deflections and angles, command that has arrived
DEFLECTION, ANGLE, FORCE, MOMENT, POWER, RATE, COMMAND = 0, 3, 6, 9, 12, 13, 19
ELEMENT_COLUMNS = 20


@compiled(python=False)
def write_element_outputs(system, work, internals, selection, out):
    """Outputs of the elements ``selection[e] = (group, index)`` into ``out[e, :]``."""
    for e in range(selection.shape[0]):
        for k in range(ELEMENT_COLUMNS):
            out[e, k] = 0.0
        if selection[e, 0] == LINK:
            write_link_output(system, work, internals, selection[e, 1], e, out)
        elif selection[e, 0] == MOUNT:
            write_mount_output(system, work, internals, selection[e, 1], e, out)


@compiled(inline=True)
def first_lane(laws, x):
    """The number in the first lane; `laws` is scratch."""
    store_lanes(laws, 0, x)
    return laws[0]


@compiled(inline=True)
def store_vector(out, e, column, laws, v):
    """Store the first lanes of a vector."""
    for k in range(3):
        out[e, column + k] = first_lane(laws, v[k])


@compiled(python=False)
def write_link_output(system, work, internals, index, e, out):
    """Elongation, force (tension positive) and power of a link."""
    links, laws = system.links, work.laws
    lanes = lane_numbers(index, index + 1)
    b1, b2 = pose_rows(links.body, 0, lanes), pose_rows(links.body, 1, lanes)
    point_1, point_2, law = link_columns(links.row, lanes)
    _, _, _, _, _, _, g, w = relative_motion(work.pose, b1, b2, point_1, point_2)
    _, tension = link_tension(system, work, index, 1, (g, w, law), internals)
    elongation, rate = laws[0], laws[LANES]
    force = first_lane(laws, tension)
    out[e, DEFLECTION] = elongation
    out[e, FORCE] = force
    out[e, POWER] = force * rate
    out[e, RATE] = rate


@compiled(python=False)
def write_mount_output(system, work, internals, index, e, out):
    """Deflections, angles, forces, moments (on body 1, its axes) and power of a mount."""
    mounts, laws = system.mounts, work.laws
    lanes = lane_numbers(index, index + 1)
    b1, b2 = pose_rows(mounts.body, 0, lanes), pose_rows(mounts.body, 1, lanes)
    point_1, point_2, share, spring, rotation = mount_columns(mounts.row, lanes)
    R1, R2, omega_1, omega_2, _, _, g, w = relative_motion(work.pose, b1, b2, point_1, point_2)
    if mounts.flags[index, TRANSLATES]:
        d, rate = in_body_axes(R1, omega_1, g, w)
        law = 0
        while law < mounts.law.shape[0] and mounts.law[law, 0] < index:
            law += 1
        d_2, rate_2 = in_body_axes(R2, omega_2, g, w)
        mean, mean_rate = between(d, d_2, share[1]), between(rate, rate_2, share[1])
        block = index, law, index + 1
        nonlinear, _ = nonlinear_force(system, work, block, mean, mean_rate, internals)
        force = times(share[0], plus(spring_damper(spring, d, rate), nonlinear))
        force_2 = times(share[1], plus(spring_damper(spring, d_2, rate_2), nonlinear))
        store_vector(out, e, DEFLECTION, laws, d)
        store_vector(out, e, FORCE, laws, plus(force, rotate_back(R1, rotate(R2, force_2))))
        store_vector(out, e, RATE, laws, rate)
        out[e, POWER] += first_lane(laws, dot(force, rate) + dot(force_2, rate_2))
    angle, rate, moment = rotation_moment(R1, R2, omega_1, omega_2, rotation)
    store_vector(out, e, ANGLE, laws, angle)
    store_vector(out, e, MOMENT, laws, moment)
    store_vector(out, e, RATE + 3, laws, rate)
    out[e, POWER] += first_lane(laws, dot(moment, rate))
