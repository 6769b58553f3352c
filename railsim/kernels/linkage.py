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

A prismatic joint is a SLOT and a PARALLEL.  Drivers: ANGLE theta_1 - theta_2 - c, LENGTH
|r_1 - r_2| - c, COORDINATE x or y of r_1 less c.
"""

from typing import Any, NamedTuple

import numpy as np

from railsim.kernels import jit_internal, jit_outside

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
CLOSE = 1e-9  # a Newton step below this share of the size leaves an error of its square
SMALLEST_STEP = 1e-9  # share of the driver's range
TRANSITION = 1e-3  # share of the size by which arcs with given centres may miss each other
BEYOND = 1e-3  # share of the driver's range at which a failure is looked at from behind it


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


@jit_internal
def place(linkage, lane, q, b, p, at):
    """Write A u of point p on body b to at[0:2] and its place to at[2:4] [m]."""
    u, v = linkage.point[lane, p, 0], linkage.point[lane, p, 1]
    c, s = np.cos(q[b, 2]), np.sin(q[b, 2])
    at[0] = c * u - s * v
    at[1] = s * u + c * v
    at[2] = q[b, 0] + at[0]
    at[3] = q[b, 1] + at[1]


@jit_internal
def add_row(J, row, b, nx, ny, lever):
    """Add a point's contribution n . r to the row of the Jacobian."""
    if b > 0:
        k = 3 * (b - 1)
        J[row, k] += nx
        J[row, k + 1] += ny
        J[row, k + 2] += lever


@jit_internal
def constraints(linkage, lane, arc, q, s, Phi, J, one, two):
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
    one, two : shape (4,)
        Work arrays.
    """
    n = 3 * linkage.n_bodies
    for i in range(n):
        Phi[i] = 0.0
        for j in range(n):
            J[i, j] = 0.0
    for k in range(linkage.joint.shape[0]):
        kind, p1, p2, row = (
            linkage.joint[k, 0],
            linkage.joint[k, 1],
            linkage.joint[k, 2],
            linkage.joint[k, 3],
        )
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
        place(linkage, lane, q, b1, p1, one)
        place(linkage, lane, q, b2, p2, two)
        dx, dy = one[2] - two[2], one[3] - two[3]
        if kind == REVOLUTE:
            Phi[row], Phi[row + 1] = dx, dy
            add_row(J, row, b1, 1.0, 0.0, -one[1])
            add_row(J, row + 1, b1, 0.0, 1.0, one[0])
            add_row(J, row, b2, -1.0, 0.0, two[1])
            add_row(J, row + 1, b2, 0.0, -1.0, -two[0])
        elif kind == SLOT:
            angle = q[b2, 2] + linkage.value[lane, k, 0]
            nx, ny = -np.sin(angle), np.cos(angle)
            Phi[row] = nx * dx + ny * dy - linkage.value[lane, k, 1]
            add_row(J, row, b1, nx, ny, ny * one[0] - nx * one[1])
            turning = nx * dy - ny * dx  # n turns with body 2: dn = (-ny, nx)
            add_row(J, row, b2, -nx, -ny, -(ny * two[0] - nx * two[1]) + turning)
        else:
            Phi[row] = (dx * dx + dy * dy - radius * radius) / (2.0 * radius)
            nx, ny = dx / radius, dy / radius
            add_row(J, row, b1, nx, ny, ny * one[0] - nx * one[1])
            add_row(J, row, b2, -nx, -ny, -(ny * two[0] - nx * two[1]))
    drive(linkage, lane, q, s, Phi, J, n - 1, one, two)


@jit_internal
def drive(linkage, lane, q, s, Phi, J, row, one, two):
    """Write the driver's residual and row of the Jacobian."""
    kind, p1, p2 = linkage.driver[0], linkage.driver[1], linkage.driver[2]
    c = linkage.driver_value[lane]
    if kind == ANGLE:
        Phi[row] = q[p1, 2] - q[p2, 2] - c - s
        add_row(J, row, p1, 0.0, 0.0, 1.0)
        add_row(J, row, p2, 0.0, 0.0, -1.0)
        return
    b1 = linkage.point_body[p1]
    place(linkage, lane, q, b1, p1, one)
    if kind == LENGTH:
        b2 = linkage.point_body[p2]
        place(linkage, lane, q, b2, p2, two)
        dx, dy = one[2] - two[2], one[3] - two[3]
        length = np.sqrt(dx * dx + dy * dy)
        Phi[row] = length - c - s
        nx, ny = dx / length, dy / length
        add_row(J, row, b1, nx, ny, ny * one[0] - nx * one[1])
        add_row(J, row, b2, -nx, -ny, -(ny * two[0] - nx * two[1]))
    elif kind == X:
        Phi[row] = one[2] - c - s
        add_row(J, row, b1, 1.0, 0.0, -one[1])
    else:
        Phi[row] = one[3] - c - s
        add_row(J, row, b1, 0.0, 1.0, one[0])


@jit_internal
def curvature(linkage, lane, arc, q, v, right, one, two):
    """Write `-(Phi_qq v) v`, the right-hand side for the second derivative; v as q."""
    n = 3 * linkage.n_bodies
    for i in range(n):
        right[i] = 0.0
    for k in range(linkage.joint.shape[0] + 1):
        if k < linkage.joint.shape[0]:
            kind, p1, p2, row = (
                linkage.joint[k, 0],
                linkage.joint[k, 1],
                linkage.joint[k, 2],
                linkage.joint[k, 3],
            )
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
        place(linkage, lane, q, b1, p1, one)
        w1 = v[b1, 2]
        gx, gy = -one[0] * w1 * w1, -one[1] * w1 * w1
        if kind == -X:
            right[row] = -gx
            continue
        if kind == -Y:
            right[row] = -gy
            continue
        b2 = linkage.point_body[p2]
        place(linkage, lane, q, b2, p2, two)
        w2 = v[b2, 2]
        gx += two[0] * w2 * w2
        gy += two[1] * w2 * w2
        dx, dy = one[2] - two[2], one[3] - two[3]
        vx = v[b1, 0] - one[1] * w1 - v[b2, 0] + two[1] * w2
        vy = v[b1, 1] + one[0] * w1 - v[b2, 1] - two[0] * w2
        if kind == REVOLUTE:
            right[row], right[row + 1] = -gx, -gy
        elif kind == SLOT:
            angle = q[b2, 2] + linkage.value[lane, k, 0]
            nx, ny = -np.sin(angle), np.cos(angle)
            twice = 2.0 * w2 * (nx * vy - ny * vx)
            right[row] = -(nx * gx + ny * gy + twice - w2 * w2 * (nx * dx + ny * dy))
        elif kind == -LENGTH:
            length = np.sqrt(dx * dx + dy * dy)
            rate = (dx * vx + dy * vy) / length
            right[row] = -((vx * vx + vy * vy + dx * gx + dy * gy - rate * rate) / length)
        else:
            right[row] = -(vx * vx + vy * vy + dx * gx + dy * gy) / radius


@jit_internal
def factor(J, pivots, n):
    """LU factors in place with row pivoting; returns the sign of the determinant, 0 if singular."""
    sign = 1.0
    for k in range(n):
        best, largest = k, abs(J[k, k])
        for i in range(k + 1, n):
            size = abs(J[i, k])
            if size > largest:
                best, largest = i, size
        pivots[k] = best
        if not largest > 1e-14:
            return 0.0
        if best != k:
            sign = -sign
            for j in range(n):
                J[k, j], J[best, j] = J[best, j], J[k, j]
        if J[k, k].real < 0.0:
            sign = -sign
        for i in range(k + 1, n):
            if J[i, k] != 0.0:
                J[i, k] /= J[k, k]
                for j in range(k + 1, n):
                    J[i, j] -= J[i, k] * J[k, j]
    return sign


@jit_internal
def substitute(J, pivots, x, n):
    """Solve with the factors of `factor`; x is overwritten."""
    for k in range(n):
        best = pivots[k]
        if best != k:
            x[k], x[best] = x[best], x[k]
    for i in range(1, n):
        for j in range(i):
            x[i] -= J[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= J[i, j] * x[j]
        x[i] /= J[i, i]


@jit_internal
def derivatives(linkage, lane, arc, q, J, pivots, x, v, a, one, two):
    """Write q' and q'' to v and a (as q), J holding the factors."""
    n = 3 * linkage.n_bodies
    for i in range(n):
        x[i] = 0.0
    x[n - 1] = 1.0
    substitute(J, pivots, x, n)
    for i in range(n):
        v[1 + i // 3, i % 3] = x[i]
    curvature(linkage, lane, arc, q, v, x, one, two)
    substitute(J, pivots, x, n)
    for i in range(n):
        a[1 + i // 3, i % 3] = x[i]


@jit_internal
def newton(linkage, arc, q, s, Phi, J, pivots, one, two):
    """Assemble at s from the pose q, which is overwritten: determinant's sign, 0 on failure."""
    n = 3 * linkage.n_bodies
    done = False
    for _ in range(ITERATIONS):
        constraints(linkage, 0, arc, q, s, Phi, J, one, two)
        sign = factor(J, pivots, n)
        if sign == 0.0:
            return 0.0
        if done:
            return sign
        substitute(J, pivots, Phi, n)
        largest = 0.0
        for i in range(n):
            step = Phi[i]
            q[1 + i // 3, i % 3] -= step
            size = abs(step) if i % 3 == 2 else abs(step) / linkage.size
            if not size < 1e6:
                return 0.0
            largest = max(largest, size)
        done = largest < CLOSE
    return 0.0


@jit_internal
def worst_joint(linkage, arc, q, s, Phi, J, one, two):
    """Joint with the largest residual; the number of joints stands for the driver."""
    constraints(linkage, 0, arc, q, s, Phi, J, one, two)
    joint, largest = 0, -1.0
    for k in range(linkage.joint.shape[0]):
        row = linkage.joint[k, 3]
        size = abs(Phi[row])
        if linkage.joint[k, 0] == REVOLUTE:
            size = max(size, abs(Phi[row + 1]))
        if not size <= largest:
            joint, largest = k, size
    return joint


@jit_internal
def move_along_cams(linkage, q, arc, one, two):
    """Put every roller on the arc that it has reached: 1 if moved, 0 if not, -1-k off cam k."""
    moved = 0
    for k in range(linkage.joint.shape[0]):
        if linkage.joint[k, 0] != CAM:
            continue
        p1, a = linkage.joint[k, 1], arc[k]
        first = linkage.joint[k, 4]
        last = first + linkage.joint[k, 5] - 1
        place(linkage, 0, q, linkage.point_body[p1], p1, one)
        p2 = linkage.arc_point[a]
        b2 = linkage.point_body[p2]
        place(linkage, 0, q, b2, p2, two)
        dx, dy = one[2] - two[2], one[3] - two[3]
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
            moved = 1
        elif past_begin < edge:
            if a == first:
                return -1 - k
            arc[k] = a - 1
            moved = 1
    return moved


@jit_internal
def settle(linkage, arc, q, s, Phi, J, pivots, one, two):
    """`newton` with every roller on its arc: determinant's sign, 0 or -2-k on failure."""
    sign = newton(linkage, arc, q, s, Phi, J, pivots, one, two)
    for _ in range(4 * linkage.arc_point.shape[0]):
        if sign == 0.0:
            return 0.0
        moved = move_along_cams(linkage, q, arc, one, two)
        if moved < 0:
            return moved - 1.0
        if moved == 0:
            return sign
        sign = newton(linkage, arc, q, s, Phi, J, pivots, one, two)
    return sign


@jit_outside
def track(linkage, s, start, arc_start, q, v, a, arcs, failure):
    """Positions and derivatives for all values of the driver, on one branch.

    Newton's method from the second-order prediction; a step is halved while the correction is
    large against the step or the determinant changes its sign.

    Parameters
    ----------
    linkage : Linkage
        Real arrays, one lane.
    s : float64, shape (position,)
        Values of the driver, continued from each to the next [m or rad].
    start : float64, shape (n_bodies + 1, 3)
        Pose from which the first position is found.
    arc_start : int64, shape (joint,)
        Arc on which each cam's roller starts.
    q, v, a : float64, shape (position, n_bodies + 1, 3)
        Written: positions, first and second derivatives by s.
    arcs : int64, shape (position, joint)
        Written: arc of each cam.
    failure : float64, shape (2,)
        Written on failure: value of the driver, joint.

    Returns
    -------
    status, count : int
        One of STATUS; number of valid positions.
    """
    nb = linkage.n_bodies
    n = 3 * nb
    Phi, J = np.zeros(n), np.zeros((n, n))
    pivots, x = np.zeros(n, dtype=np.int64), np.zeros(n)
    one, two = np.zeros(4), np.zeros(4)
    now, v_now, a_now = start.copy(), np.zeros((nb + 1, 3)), np.zeros((nb + 1, 3))
    new, arc, arc_new = start.copy(), arc_start.copy(), arc_start.copy()
    sign = settle(linkage, arc, now, s[0], Phi, J, pivots, one, two)
    failure[0] = s[0]
    if sign < -1.5:
        failure[1] = -2.0 - sign
        return BEYOND_CAM, 0
    if sign == 0.0:
        failure[1] = worst_joint(linkage, arc, start, s[0], Phi, J, one, two)
        return NO_ASSEMBLY, 0
    reach = max(abs(s[-1] - s[0]), 1e-3 * linkage.size)
    for i in range(1, s.shape[0]):
        reach = max(reach, abs(s[i] - s[0]))
    at = s[0]
    for i in range(s.shape[0]):
        step = s[i] - at
        while True:
            derivatives(linkage, 0, arc, now, J, pivots, x, v_now, a_now, one, two)
            if at == s[i]:
                break
            rest = s[i] - at
            h = rest if abs(step) >= abs(rest) else step
            speed = 0.0
            for k in range(1, nb + 1):
                for m in range(3):
                    change = h * (v_now[k, m] + 0.5 * h * a_now[k, m])
                    new[k, m] = now[k, m] + change
                    if m < 2:
                        change /= linkage.size
                    speed = max(speed, abs(change))
            for k in range(arc.shape[0]):
                arc_new[k] = arc[k]
            target = s[i] if h == rest else at + h
            sign_new = settle(linkage, arc_new, new, target, Phi, J, pivots, one, two)
            correction = 0.0
            for k in range(1, nb + 1):
                for m in range(3):
                    predicted = now[k, m] + h * (v_now[k, m] + 0.5 * h * a_now[k, m])
                    change = abs(new[k, m] - predicted)
                    if m < 2:
                        change /= linkage.size
                    correction = max(correction, change)
            allowed = 0.2 * speed + 1e-9
            for k in range(arc.shape[0]):
                if arc_new[k] != arc[k]:
                    allowed += TRANSITION
            smooth = correction <= allowed and speed < 0.5
            if sign_new == sign and smooth:
                at = target
                step = 2.0 * h
                for k in range(nb + 1):
                    for m in range(3):
                        now[k, m] = new[k, m]
                for k in range(arc.shape[0]):
                    arc[k] = arc_new[k]
                continue
            step = 0.5 * h
            constraints(linkage, 0, arc, now, at, Phi, J, one, two)
            factor(J, pivots, n)
            if abs(step) < SMALLEST_STEP * reach:
                beyond = at + BEYOND * reach * np.sign(h)
                failure[0] = at
                failure[1] = worst_joint(linkage, arc, now, beyond, Phi, J, one, two)
                if sign_new < -1.5:
                    failure[1] = -2.0 - sign_new
                    return BEYOND_CAM, i
                # close to a limit position the two branches are mixed up: look from behind it
                for k in range(nb + 1):
                    for m in range(3):
                        new[k, m] = now[k, m]
                if newton(linkage, arc, new, beyond, Phi, J, pivots, one, two) == 0.0:
                    return LOST_ASSEMBLY, i
                if sign_new != sign:
                    return DEAD_POINT, i
                return BRANCH_JUMP, i
        for k in range(nb + 1):
            for m in range(3):
                q[i, k, m] = now[k, m]
                v[i, k, m] = v_now[k, m]
                a[i, k, m] = a_now[k, m]
        for k in range(arc.shape[0]):
            arcs[i, k] = arc[k]
    return OK, s.shape[0]


@jit_outside
def tangents(real, linkage, s, q, v, a, arcs, second):
    """Positions and derivatives with their derivatives by a parameter in the imaginary parts.

    Every derivative solves the same real equations, `Phi_q dq = -dPhi`, and so on for q' and q'':
    the right-hand sides are imaginary parts of the constraints of the moved mechanism.

    Parameters
    ----------
    real : Linkage
        The mechanism itself.
    linkage : Linkage
        Complex arrays, one lane for each parameter.
    s : complex128, shape (lane, position)
    q, v, a : complex128, shape (lane, position, n_bodies + 1, 3)
        Hold the real solution; their imaginary parts are written.
    arcs : int64, shape (position, joint)
    second : bool
        Whether the second derivatives are wanted too.
    """
    n = 3 * linkage.n_bodies
    Phi_r, J_r, x = np.zeros(n), np.zeros((n, n)), np.zeros(n)
    Phi, J = np.zeros(n, dtype=np.complex128), np.zeros((n, n), dtype=np.complex128)
    pivots = np.zeros(n, dtype=np.int64)
    one_r, two_r, here = np.zeros(4), np.zeros(4), np.zeros((linkage.n_bodies + 1, 3))
    one, two = np.zeros(4, dtype=np.complex128), np.zeros(4, dtype=np.complex128)
    for i in range(q.shape[1]):
        for k in range(n):
            here[1 + k // 3, k % 3] = q[0, i, 1 + k // 3, k % 3].real
        constraints(real, 0, arcs[i], here, s[0, i].real, Phi_r, J_r, one_r, two_r)
        factor(J_r, pivots, n)
        for lane in range(q.shape[0]):
            at, rate, bend = q[lane, i], v[lane, i], a[lane, i]
            constraints(linkage, lane, arcs[i], at, s[lane, i], Phi, J, one, two)
            for k in range(n):
                x[k] = -Phi[k].imag
            substitute(J_r, pivots, x, n)
            for k in range(n):
                at[1 + k // 3, k % 3] += 1j * x[k]
            constraints(linkage, lane, arcs[i], at, s[lane, i], Phi, J, one, two)
            for k in range(n):
                x[k] = 0.0
                for m in range(n):
                    x[k] -= J[k, m].imag * rate[1 + m // 3, m % 3].real
            substitute(J_r, pivots, x, n)
            for k in range(n):
                rate[1 + k // 3, k % 3] += 1j * x[k]
            if second:
                curvature(linkage, lane, arcs[i], at, rate, Phi, one, two)
                for k in range(n):
                    x[k] = Phi[k].imag
                    for m in range(n):
                        x[k] -= J[k, m].imag * bend[1 + m // 3, m % 3].real
                substitute(J_r, pivots, x, n)
                for k in range(n):
                    bend[1 + k // 3, k % 3] += 1j * x[k]


@jit_outside
def jacobians(linkage, s, q, arcs, residual, J):
    """Residuals, shape (position, n), and Jacobians, shape (position, n, n), at given poses."""
    one, two = np.zeros(4), np.zeros(4)
    for i in range(q.shape[0]):
        constraints(linkage, 0, arcs[i], q[i], s[i], residual[i], J[i], one, two)
