"""The motion of a linkage along its driver: Newton's method, continuation, derivatives."""

import numpy as np

from railsim.kernels import compiled
from railsim.kernels.linkage import (
    ARC_GAP,
    BEYOND_CAM,
    BRANCH_JUMP,
    DEAD_POINT,
    FAILURE_OFFSET,
    ITERATIONS,
    LOST_ASSEMBLY,
    NO_ASSEMBLY,
    OK,
    SMALLEST_STEP,
    TOLERANCE,
    move_along_cams,
    set_constraints,
    worst_joint,
    write_acceleration_side,
)


@compiled(python=False)
def factorise(J, pivots, n):
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


@compiled(python=False)
def substitute(J, pivots, x, n):
    """Solve with the factors of `factorise`; x is overwritten."""
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


@compiled(python=False)
def derivatives(linkage, arc, q, J, pivots, x, v, a, r_1, r_2):
    """Write q' and q'' to v and a (as q), J holding the factors."""
    n = 3 * linkage.n_bodies
    for i in range(n):
        x[i] = 0.0
    x[n - 1] = 1.0
    substitute(J, pivots, x, n)
    for i in range(n):
        v[1 + i // 3, i % 3] = x[i]
    write_acceleration_side(linkage, 0, arc, q, v, x, r_1, r_2)
    substitute(J, pivots, x, n)
    for i in range(n):
        a[1 + i // 3, i % 3] = x[i]


@compiled(python=False)
def assemble(linkage, arc, q, s, Phi, J, pivots, r_1, r_2):
    """Assemble at s from the pose q, which is overwritten: determinant's sign, 0 on failure."""
    n = 3 * linkage.n_bodies
    done = False
    for _ in range(ITERATIONS):
        set_constraints(linkage, 0, arc, q, s, Phi, J, r_1, r_2)
        sign = factorise(J, pivots, n)
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
        done = largest < TOLERANCE
    return 0.0


@compiled(python=False)
def assemble_on_cams(linkage, arc, q, s, Phi, J, pivots, r_1, r_2):
    """`assemble` with every roller on its arc: determinant's sign, 0 or -2-k on failure."""
    sign = assemble(linkage, arc, q, s, Phi, J, pivots, r_1, r_2)
    for _ in range(4 * linkage.arc_point.shape[0]):
        if sign == 0.0:
            return 0.0
        changed = move_along_cams(linkage, q, arc, r_1, r_2)
        if changed < 0:
            return changed - 1.0
        if changed == 0:
            return sign
        sign = assemble(linkage, arc, q, s, Phi, J, pivots, r_1, r_2)
    return sign


@compiled(python=False)
def predict(linkage, h, now, v, a, new):
    """Write the pose a driver's step `h` ahead, of second order, to `new`; its largest change."""
    largest = 0.0
    for k in range(1, linkage.n_bodies + 1):
        for m in range(3):
            change = h * (v[k, m] + 0.5 * h * a[k, m])
            new[k, m] = now[k, m] + change
            if m < 2:
                change /= linkage.size
            largest = max(largest, abs(change))
    return largest


@compiled(python=False)
def prediction_error(linkage, h, now, v, a, new):
    """Largest difference of `new` from the pose, or from its derivatives, as predicted."""
    largest = 0.0
    for k in range(1, linkage.n_bodies + 1):
        for m in range(3):
            predicted = now[k, m] + h * (v[k, m] + 0.5 * h * a[k, m])
            change = abs(new[k, m] - predicted)
            if m < 2:
                change /= linkage.size
            largest = max(largest, change)
    return largest


@compiled(in_loop=False)
def trace(linkage, s, start, arc_start, q, v, a, arcs, failure):
    """Positions and derivatives for all values of the driver, on one branch.

    Newton's method from the second-order prediction; a step is halved while the correction is
    large against the step, the determinant changes its sign, or the derivatives differ from those
    predicted by more than three times that: of branches that have just met, positions are alike.

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
    r_1, r_2 = np.zeros(4), np.zeros(4)
    now, v_now, a_now = start.copy(), np.zeros((nb + 1, 3)), np.zeros((nb + 1, 3))
    new, v_new, a_new = start.copy(), np.zeros((nb + 1, 3)), np.zeros((nb + 1, 3))
    zero, arc, arc_new = np.zeros((nb + 1, 3)), arc_start.copy(), arc_start.copy()
    sign = assemble_on_cams(linkage, arc, now, s[0], Phi, J, pivots, r_1, r_2)
    failure[0] = s[0]
    if sign < -1.5:
        failure[1] = -2.0 - sign
        return BEYOND_CAM, 0
    if sign == 0.0:
        failure[1] = worst_joint(linkage, arc, start, s[0], Phi, J, r_1, r_2)
        return NO_ASSEMBLY, 0
    driver_range = max(abs(s[-1] - s[0]), 1e-3 * linkage.size)
    for i in range(1, s.shape[0]):
        driver_range = max(driver_range, abs(s[i] - s[0]))
    s_now = s[0]
    derivatives(linkage, arc, now, J, pivots, x, v_now, a_now, r_1, r_2)
    for i in range(s.shape[0]):
        step = s[i] - s_now
        while s_now != s[i]:
            rest = s[i] - s_now
            h = rest if abs(step) >= abs(rest) else step
            speed = predict(linkage, h, now, v_now, a_now, new)
            for k in range(arc.shape[0]):
                arc_new[k] = arc[k]
            target = s[i] if h == rest else s_now + h
            sign_new = assemble_on_cams(linkage, arc_new, new, target, Phi, J, pivots, r_1, r_2)
            correction = prediction_error(linkage, h, now, v_now, a_now, new)
            limit = 0.2 * speed
            for k in range(arc.shape[0]):
                if arc_new[k] != arc[k]:
                    limit += ARC_GAP
            smooth = sign_new == sign and correction <= limit + 1e-9 and speed < 0.5
            if smooth:
                derivatives(linkage, arc_new, new, J, pivots, x, v_new, a_new, r_1, r_2)
                change = abs(h) * prediction_error(linkage, h, v_now, a_now, zero, v_new)
                smooth = change <= 3.0 * limit
            if smooth:
                s_now = target
                step = 2.0 * h
                for k in range(nb + 1):
                    for m in range(3):
                        now[k, m], v_now[k, m], a_now[k, m] = new[k, m], v_new[k, m], a_new[k, m]
                for k in range(arc.shape[0]):
                    arc[k] = arc_new[k]
                continue
            step = 0.5 * h
            if abs(step) < SMALLEST_STEP * driver_range:
                beyond = s_now + FAILURE_OFFSET * driver_range * np.sign(h)
                failure[0] = s_now
                failure[1] = worst_joint(linkage, arc, now, beyond, Phi, J, r_1, r_2)
                if sign_new < -1.5:
                    failure[1] = -2.0 - sign_new
                    return BEYOND_CAM, i
                # close to a limit position the two branches are mixed up: look from behind it
                for k in range(nb + 1):
                    for m in range(3):
                        new[k, m] = now[k, m]
                if assemble(linkage, arc, new, beyond, Phi, J, pivots, r_1, r_2) == 0.0:
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


@compiled(in_loop=False)
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
    r_1r, r_2r, q_r = np.zeros(4), np.zeros(4), np.zeros((linkage.n_bodies + 1, 3))
    r_1, r_2 = np.zeros(4, dtype=np.complex128), np.zeros(4, dtype=np.complex128)
    for i in range(q.shape[1]):
        for k in range(n):
            q_r[1 + k // 3, k % 3] = q[0, i, 1 + k // 3, k % 3].real
        set_constraints(real, 0, arcs[i], q_r, s[0, i].real, Phi_r, J_r, r_1r, r_2r)
        factorise(J_r, pivots, n)
        for lane in range(q.shape[0]):
            q_i, v_i, a_i = q[lane, i], v[lane, i], a[lane, i]
            set_constraints(linkage, lane, arcs[i], q_i, s[lane, i], Phi, J, r_1, r_2)
            for k in range(n):
                x[k] = -Phi[k].imag
            substitute(J_r, pivots, x, n)
            for k in range(n):
                q_i[1 + k // 3, k % 3] += 1j * x[k]
            set_constraints(linkage, lane, arcs[i], q_i, s[lane, i], Phi, J, r_1, r_2)
            for k in range(n):
                x[k] = 0.0
                for m in range(n):
                    x[k] -= J[k, m].imag * v_i[1 + m // 3, m % 3].real
            substitute(J_r, pivots, x, n)
            for k in range(n):
                v_i[1 + k // 3, k % 3] += 1j * x[k]
            if second:
                write_acceleration_side(linkage, lane, arcs[i], q_i, v_i, Phi, r_1, r_2)
                for k in range(n):
                    x[k] = Phi[k].imag
                    for m in range(n):
                        x[k] -= J[k, m].imag * a_i[1 + m // 3, m % 3].real
                substitute(J_r, pivots, x, n)
                for k in range(n):
                    a_i[1 + k // 3, k % 3] += 1j * x[k]


@compiled(in_loop=False)
def jacobians(linkage, s, q, arcs, residual, J):
    """Residuals, shape (position, n), and Jacobians, shape (position, n, n), at given poses."""
    r_1, r_2 = np.zeros(4), np.zeros(4)
    for i in range(q.shape[0]):
        set_constraints(linkage, 0, arcs[i], q[i], s[i], residual[i], J[i], r_1, r_2)
