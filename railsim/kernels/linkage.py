"""Planar linkages of any number of bodies: positions and their derivatives along a driver.

Body coordinates `q = (x, y, theta)` of every body, body 0 is the ground.  The joints and the driver
`s` give `Phi(q, s) = 0`, one row for each coordinate; with `e` the driver's unit vector

    Phi_q q' = e,    Phi_q q'' = -(Phi_qq q') q',    ' = d/ds

(E. J. Haug, Computer aided kinematics and dynamics of mechanical systems, 1989, ch. 3).  Rows have
the unit of a length, or are angles; the row of a link, of a cam and of a slot is a distance, so
that its multiplier is a force.

Every array of geometry has a leading axis `lane`: lane 0 of real arrays is the mechanism; lanes of
complex arrays are the mechanism with one parameter moved by i h (`tangents`), whose imaginary parts
are exact derivatives.

=========  ======================================================================
joint      rows
=========  ======================================================================
REVOLUTE   r_1 - r_2 = 0 (2 rows)
LINK       (|r_1 - r_2|^2 - l^2)/(2 l) = 0; value 0 is l
CAM        the same from the roller's centre to the centre of the arc it is on, l negative
           where the path turns right, so that the row's normal goes on from arc to arc
SLOT       n (r_1 - r_2) - c = 0, n turning with the body of point 2;
           values: angle of the slot in that body, offset c
PARALLEL   theta_1 - theta_2 - angle = 0; value 0 is the angle
=========  ======================================================================

A prismatic joint is a SLOT and a PARALLEL.  Drivers: ANGLE theta_1 - c, LENGTH
|r_1 - r_2| - c, COORDINATE x or y of r_1 less c.
"""

from typing import Any, NamedTuple

import numpy as np

from railsim.kernels import compiled

REVOLUTE, LINK, CAM, SLOT, PARALLEL = 0, 1, 2, 3, 4
ANGLE, LENGTH, X, Y = 0, 1, 2, 3

OK = 0
NO_ASSEMBLY = 1
LOST_ASSEMBLY = 2
DEAD_POINT = 3
BRANCH_JUMP = 4
BEYOND_CAM = 5

# sentences of the statuses; {joint} is the joint with the largest error
STATUS = {
    OK: "assembled",
    NO_ASSEMBLY: "the links cannot be assembled at the start (joint {joint})",
    LOST_ASSEMBLY: "the links cannot be assembled from here on (joint {joint})",
    DEAD_POINT: "a dead point: the driver does not determine the positions (joint {joint})",
    BRANCH_JUMP: "the links jump to another branch of the motion (joint {joint})",
    BEYOND_CAM: "the roller leaves the cam (joint {joint})",
}

ITERATIONS = 40
TOLERANCE = 1e-9  # a Newton step below this share of the size leaves an error of its square
SMALLEST_STEP = 1e-7  # share of the driver's range: in `TOLERANCE` branches that meet are alike
ARC_GAP = 1e-3  # share of the size by which arcs with given centres may miss each other
FAILURE_OFFSET = 1e-3  # share of the driver's range at which a failure is looked at from behind it


class Linkage(NamedTuple):
    """A mechanism as flat arrays.

    Attributes
    ----------
    n_bodies : int
        Bodies without the ground.
    size : float
        A length of the mechanism, to judge errors by [m].
    point_body : int64, shape (point,)
    point : float64 or complex128, shape (lane, point, 2)
        Points in their bodies' axes [m].
    joint : int64, shape (joint, 6)
        Kind, point 1 (body for PARALLEL), point 2, first row, first arc, number of arcs.
    value : as `point`, shape (lane, joint, 2)
    arc_point : int64, shape (arc,)
        Centre of each arc.
    arc_radius : as `point`, shape (lane, arc)
        Radius of the path of the roller's centre [m].
    arc_ends : float64, shape (arc, 5)
        Unit vectors from the centre to begin and end in the cam's axes, sense of turning.
    driver : int64, shape (3,)
        Kind, point 1 (body for ANGLE), point 2.
    driver_value : as `point`, shape (lane,)
        The constant c.
    """

    n_bodies: int
    size: float
    point_body: Any
    point: Any
    joint: Any
    value: Any
    arc_point: Any
    arc_radius: Any
    arc_ends: Any
    driver: Any
    driver_value: Any


@compiled(python=False)
def write_point(linkage, lane, q, b, p, out):
    """Write A u of point p on body b to at[0:2] and its position to at[2:4] [m]."""
    u, v = linkage.point[lane, p, 0], linkage.point[lane, p, 1]
    c, s = np.cos(q[b, 2]), np.sin(q[b, 2])
    out[0] = c * u - s * v
    out[1] = s * u + c * v
    out[2] = q[b, 0] + out[0]
    out[3] = q[b, 1] + out[1]


@compiled(python=False)
def add_row(J, row, b, nx, ny, lever):
    """Add a point's contribution n . r to the row of the Jacobian."""
    if b > 0:
        k = 3 * (b - 1)
        J[row, k] += nx
        J[row, k + 1] += ny
        J[row, k + 2] += lever


@compiled(python=False)
def set_constraints(linkage, lane, arc, q, s, Phi, J, r_1, r_2):
    """Residual and Jacobian of joints and driver.

    Parameters
    ----------
    lane : int
    arc : int64 array, shape (joint,)
        Arc on which each cam's roller is.
    q : shape (n_bodies + 1, 3)
    s : float
        Driver [m or rad].
    Phi, J : shapes (n,), (n, n)
        Written.
    r_1, r_2 : shape (4,)
        Work arrays.
    """
    n, joint = 3 * linkage.n_bodies, linkage.joint
    for i in range(n):
        Phi[i] = 0.0
        for j in range(n):
            J[i, j] = 0.0
    for k in range(joint.shape[0]):
        kind, p1, p2, row = joint[k, 0], joint[k, 1], joint[k, 2], joint[k, 3]
        if kind == PARALLEL:
            Phi[row] = q[p1, 2] - q[p2, 2] - linkage.value[lane, k, 0]
            add_row(J, row, p1, 0.0, 0.0, 1.0)
            add_row(J, row, p2, 0.0, 0.0, -1.0)
            continue
        radius = linkage.value[lane, k, 0]
        if kind == CAM:
            p2 = linkage.arc_point[arc[k]]
            radius = linkage.arc_ends[arc[k], 4] * linkage.arc_radius[lane, arc[k]]
        b1, b2 = linkage.point_body[p1], linkage.point_body[p2]
        write_point(linkage, lane, q, b1, p1, r_1)
        write_point(linkage, lane, q, b2, p2, r_2)
        dx, dy = r_1[2] - r_2[2], r_1[3] - r_2[3]
        if kind == REVOLUTE:
            Phi[row], Phi[row + 1] = dx, dy
            add_row(J, row, b1, 1.0, 0.0, -r_1[1])
            add_row(J, row + 1, b1, 0.0, 1.0, r_1[0])
            add_row(J, row, b2, -1.0, 0.0, r_2[1])
            add_row(J, row + 1, b2, 0.0, -1.0, -r_2[0])
        elif kind == SLOT:
            angle = q[b2, 2] + linkage.value[lane, k, 0]
            nx, ny = -np.sin(angle), np.cos(angle)
            Phi[row] = nx * dx + ny * dy - linkage.value[lane, k, 1]
            add_row(J, row, b1, nx, ny, ny * r_1[0] - nx * r_1[1])
            turning = nx * dy - ny * dx  # n turns with body 2: dn = (-ny, nx)
            add_row(J, row, b2, -nx, -ny, -(ny * r_2[0] - nx * r_2[1]) + turning)
        else:
            Phi[row] = (dx * dx + dy * dy - radius * radius) / (2.0 * radius)
            nx, ny = dx / radius, dy / radius
            add_row(J, row, b1, nx, ny, ny * r_1[0] - nx * r_1[1])
            add_row(J, row, b2, -nx, -ny, -(ny * r_2[0] - nx * r_2[1]))
    write_driver_row(linkage, lane, q, s, Phi, J, n - 1, r_1, r_2)


@compiled(python=False)
def write_driver_row(linkage, lane, q, s, Phi, J, row, r_1, r_2):
    """Write the driver's residual and row of the Jacobian."""
    kind, p1, p2 = linkage.driver[0], linkage.driver[1], linkage.driver[2]
    c = linkage.driver_value[lane]
    if kind == ANGLE:
        Phi[row] = q[p1, 2] - c - s
        add_row(J, row, p1, 0.0, 0.0, 1.0)
        return
    b1 = linkage.point_body[p1]
    write_point(linkage, lane, q, b1, p1, r_1)
    if kind == LENGTH:
        b2 = linkage.point_body[p2]
        write_point(linkage, lane, q, b2, p2, r_2)
        dx, dy = r_1[2] - r_2[2], r_1[3] - r_2[3]
        length = np.sqrt(dx * dx + dy * dy)
        Phi[row] = length - c - s
        nx, ny = dx / length, dy / length
        add_row(J, row, b1, nx, ny, ny * r_1[0] - nx * r_1[1])
        add_row(J, row, b2, -nx, -ny, -(ny * r_2[0] - nx * r_2[1]))
    elif kind == X:
        Phi[row] = r_1[2] - c - s
        add_row(J, row, b1, 1.0, 0.0, -r_1[1])
    else:
        Phi[row] = r_1[3] - c - s
        add_row(J, row, b1, 0.0, 1.0, r_1[0])


@compiled(python=False)
def write_acceleration_side(linkage, lane, arc, q, v, right, r_1, r_2):
    """Write `-(Phi_qq v) v`, the right-hand side for the second derivative; v as q."""
    n, joint = 3 * linkage.n_bodies, linkage.joint
    for i in range(n):
        right[i] = 0.0
    for k in range(joint.shape[0] + 1):
        if k < joint.shape[0]:
            kind, p1, p2, row = joint[k, 0], joint[k, 1], joint[k, 2], joint[k, 3]
            radius = linkage.value[lane, k, 0]
            if kind == CAM:
                p2 = linkage.arc_point[arc[k]]
                radius = linkage.arc_ends[arc[k], 4] * linkage.arc_radius[lane, arc[k]]
        else:
            kind, p1, p2, row = linkage.driver[0], linkage.driver[1], linkage.driver[2], n - 1
            if kind == ANGLE:
                continue
            kind = -kind
            radius = linkage.driver_value[lane]
        if kind == PARALLEL:
            continue
        b1 = linkage.point_body[p1]
        write_point(linkage, lane, q, b1, p1, r_1)
        w1 = v[b1, 2]
        gx, gy = -r_1[0] * w1 * w1, -r_1[1] * w1 * w1
        if kind == -X:
            right[row] = -gx
            continue
        if kind == -Y:
            right[row] = -gy
            continue
        b2 = linkage.point_body[p2]
        write_point(linkage, lane, q, b2, p2, r_2)
        w2 = v[b2, 2]
        gx += r_2[0] * w2 * w2
        gy += r_2[1] * w2 * w2
        dx, dy = r_1[2] - r_2[2], r_1[3] - r_2[3]
        vx = v[b1, 0] - r_1[1] * w1 - v[b2, 0] + r_2[1] * w2
        vy = v[b1, 1] + r_1[0] * w1 - v[b2, 1] - r_2[0] * w2
        if kind == REVOLUTE:
            right[row], right[row + 1] = -gx, -gy
        elif kind == SLOT:
            angle = q[b2, 2] + linkage.value[lane, k, 0]
            nx, ny = -np.sin(angle), np.cos(angle)
            coriolis = 2.0 * w2 * (nx * vy - ny * vx)
            right[row] = -(nx * gx + ny * gy + coriolis - w2 * w2 * (nx * dx + ny * dy))
        elif kind == -LENGTH:
            length = np.sqrt(dx * dx + dy * dy)
            rate = (dx * vx + dy * vy) / length
            right[row] = -((vx * vx + vy * vy + dx * gx + dy * gy - rate * rate) / length)
        else:
            right[row] = -(vx * vx + vy * vy + dx * gx + dy * gy) / radius


@compiled(python=False)
def worst_joint(linkage, arc, q, s, Phi, J, r_1, r_2):
    """Joint with the largest residual; the number of joints stands for the driver."""
    set_constraints(linkage, 0, arc, q, s, Phi, J, r_1, r_2)
    joint, largest = 0, -1.0
    for k in range(linkage.joint.shape[0]):
        row = linkage.joint[k, 3]
        size = abs(Phi[row])
        if linkage.joint[k, 0] == REVOLUTE:
            size = max(size, abs(Phi[row + 1]))
        if not size <= largest:
            joint, largest = k, size
    return joint


@compiled(python=False)
def move_along_cams(linkage, q, arc, r_1, r_2):
    """Put every roller on the arc that it has reached: 1 if moved, 0 if not, -1-k off cam k."""
    changed = 0
    for k in range(linkage.joint.shape[0]):
        if linkage.joint[k, 0] != CAM:
            continue
        p1, a = linkage.joint[k, 1], arc[k]
        first = linkage.joint[k, 4]
        last = first + linkage.joint[k, 5] - 1
        write_point(linkage, 0, q, linkage.point_body[p1], p1, r_1)
        p2 = linkage.arc_point[a]
        b2 = linkage.point_body[p2]
        write_point(linkage, 0, q, b2, p2, r_2)
        dx, dy = r_1[2] - r_2[2], r_1[3] - r_2[3]
        c, s = np.cos(q[b2, 2]), np.sin(q[b2, 2])
        u, v = c * dx + s * dy, -s * dx + c * dy
        turn = linkage.arc_ends[a, 4]
        past_begin = turn * (linkage.arc_ends[a, 0] * v - linkage.arc_ends[a, 1] * u)
        before_end = turn * (u * linkage.arc_ends[a, 3] - v * linkage.arc_ends[a, 2])
        edge = -1e-9 * linkage.size
        if before_end < edge:
            if a == last:
                return -1 - k
            arc[k] = a + 1
            changed = 1
        elif past_begin < edge:
            if a == first:
                return -1 - k
            arc[k] = a - 1
            changed = 1
    return changed
