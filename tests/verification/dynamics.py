"""What the verification tests of the simulator share: model variants and an independent energy."""

import numpy as np

from railsim.definitions.loading import load_track as load_any_track
from railsim.definitions.loading import load_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.contact_table import (
    LOOK_UP_SIZE,
    N_WEIGHT,
    find_cell,
    look_up,
    set_cell_weights,
    stretched_roll,
)
from railsim.kernels.rhs import locate_frames, right_hand_side
from railsim.kernels.state import N_SCALARS
from railsim.kernels.support import SUPPORT_SIZE
from railsim.kernels.system import AXLEBOX, WHEELSET
from railsim.kernels.time_loop import Chunk, time_loop
from railsim.kernels.track_frame import FRAME_SIZE
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.time_step import SCHEMES, empty_recorder
from railsim.model.work import work_arrays

NEVER = 1 << 40


def load_track(name):
    """A shipped track on rigid rails, for which closed forms hold; `test_support.py` has others."""
    return load_any_track(name).replace(support={"preset": "rigid"})


def changed(vehicle, change):
    """Vehicle with `change(kind_of_table, name, table)` applied to every part of its file."""
    data = vehicle.model_dump(exclude_none=True)

    def walk(group):
        for kind in ("bodies", "wheelsets", "axleboxes", "elements"):
            for name, table in group.get(kind, {}).items():
                change(kind, name, table)
        for assembly in group.get("assemblies", {}).values():
            walk(assembly)

    walk(data)
    return Vehicle.model_validate(data)


def undamped(vehicle):
    """Vehicle without any damping."""

    def change(kind, _name, table):
        for key in ("damping", "series_stiffness", "rotational_damping"):
            if kind == "elements" and key in table:
                table[key] = [0.0] * 3 if isinstance(table[key], list | tuple) else 0.0
        table.pop("damper_table", None)

    return changed(vehicle, change)


def steady(vehicle, track, settings, speed):
    """Equilibrium of a vehicle on a track."""
    return equilibrium(assemble(vehicle, track, settings), speed)


def advance(system, state, h, n_steps, scheme="rk4", model=None):
    """State after `n_steps` steps; asserts that the run went through."""
    after = state.copy()
    status, _, steps, _ = time_loop(
        system,
        work_arrays(system),
        after,
        np.zeros_like(state),
        np.zeros((3, len(state))),
        empty_recorder(model, 1),
        SCHEMES[scheme],
        h,
        Chunk(1, n_steps, NEVER, fresh=1),
    )
    assert (status, steps) == (0, n_steps)
    return after


def evaluate(system, state):
    """Work arrays and derivative of one state."""
    state = np.array(state)  # of a result it can be read only
    work, derivative = work_arrays(system), np.zeros_like(state)
    status, *_ = right_hand_side(system, work, state, derivative)
    assert status == 0
    return work, derivative


def absolute_frame(system, s):
    """Track frame with its origin in global axes."""
    frames = np.zeros((1, FRAME_SIZE))
    cell, u = np.zeros(1, dtype=np.int64), np.zeros(1)
    assert locate_frames(system.track, np.zeros(1), -1, s, frames, cell, u) == 0
    return frames[0]


def rotation(angle, axis):
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def energy(system, state):
    """Kinetic and potential energy [J] in the inertial frame, written anew with matrices.

    The springs' potentials are evaluated from their definitions, not from their forces.
    """
    work, _ = evaluate(system, state)
    n = len(system.bodies.kind)
    total = 0.0
    pose = {}
    for b, kind in enumerate(system.bodies.kind):
        frame = absolute_frame(system, state[-2] + system.frame_offset[system.bodies.frame[b]])
        A = frame[3:12].reshape(3, 3)
        q = state[6 * b : 6 * b + 6]
        v = state[6 * n + 6 * b : 6 * n + 6 * b + 6]
        if kind == AXLEBOX:
            p = system.bodies.parent[b]
            pose[b] = (pose[p][0], pose[p][1] @ rotation(q[4], 1))
            total += 0.5 * system.bodies.inertia[b, 1] * v[4] ** 2
            continue
        omega = state[-1] * frame[12:15]
        r = q[:3] + np.array([0.0, *system.bodies.nominal[b]])
        C = rotation(q[5], 2) @ rotation(q[3], 0)
        if kind != WHEELSET:
            C = C @ rotation(q[4], 1)
        pose[b] = (frame[:3] + A @ r, A @ C)
        velocity = np.array([state[-1], 0, 0]) + v[:3] + np.cross(omega, r)
        mass = system.bodies.mass[b]
        total += 0.5 * mass * velocity @ velocity
        total += 0.5 * np.sum(system.bodies.inertia[b] * v[3:] ** 2)
        total -= mass * system.gravity * pose[b][0][2]
    return (
        total
        + _link_energy(system, pose)
        + _mount_energy(system, pose)
        + _contact_energy(system, work, state)
        + _track_energy(system, state)
    )


def _tracks(system, state):
    """Displacements and rates of the elastic track under each wheelset; zero on rigid rails."""
    wheelsets = len(system.contact.body)
    if not system.support.elastic:
        return np.zeros((wheelsets, 7)), np.zeros((wheelsets, 7))
    end = len(state) - N_SCALARS
    track = state[end - wheelsets * SUPPORT_SIZE : end].reshape(wheelsets, SUPPORT_SIZE)
    return track[:, :7], track[:, 7:14]


def _track_energy(system, state):
    """Rails, pads, sleeper and ballast from their values; y, z of both rails, y, z, roll."""
    mass, sleeper, inertia, pad_y, _, pad_z, _, *ballast = system.support.row[:13]
    displacement, rate = _tracks(system, state)
    total = 0.0
    for u, v in zip(displacement, rate, strict=True):
        total += 0.5 * np.array([mass] * 4 + [sleeper] * 2 + [inertia]) @ v**2
        total += 0.5 * np.array(ballast[::2]) @ u[4:] ** 2
        for side, arm in ((0, -0.75), (2, 0.75)):
            total += 0.5 * pad_y * (u[side] - u[4]) ** 2
            total += 0.5 * pad_z * (u[side + 1] - u[5] - arm * u[6]) ** 2
    return total


def _curve_energy(curves, index, x):
    """Integral of a piecewise linear table from 0 to x."""
    if index < 0:
        return 0.0
    part = slice(curves.start[index], curves.start[index + 1])
    inside = curves.x[part].clip(min(0, x), max(0, x))
    grid = np.unique(np.concatenate([np.linspace(0.0, x, 3), inside]))
    values = np.interp(grid, curves.x[part], curves.f[part])
    return np.sign(x) * np.trapezoid(values, grid)


def _link_energy(system, pose):
    total = 0.0
    for e, (i, j) in enumerate(system.links.body):
        p, q = system.links.point[e]
        length = np.linalg.norm(pose[j][0] + pose[j][1] @ q - pose[i][0] - pose[i][1] @ p)
        x = length - system.links.length[e]
        k, _, preload = system.links.spring[e]
        total += preload * x + 0.5 * k * x * x
        total += _curve_energy(system.curves, system.links.curve[e, 0], x)
    return total


def _mount_energy(system, pose):
    mounts = system.mounts
    total = 0.0
    for e, (i, j) in enumerate(mounts.body):
        p, q = mounts.point[e]
        gap = pose[j][0] + pose[j][1] @ q - pose[i][0] - pose[i][1] @ p
        axes = [pose[i][1], pose[j][1]] if mounts.flags[e, 1] else [pose[i][1]]
        for R in axes if mounts.flags[e, 0] else []:
            d = R.T @ gap
            law = mounts.preload[e] @ d + 0.5 * mounts.stiffness[e] @ d**2
            law += sum(_curve_energy(system.curves, mounts.curve[e, k], d[k]) for k in range(3))
            total += law / len(axes)
        if mounts.flags[e, 2]:
            R = pose[i][1].T @ pose[j][1]
            total += np.trace(np.diag(mounts.rotation[e]) @ (np.eye(3) - R))
    return total


def _contact_energy(system, work, state):
    contact = system.contact
    rails, _ = _tracks(system, state)
    total = 0.0
    out, weights = np.zeros(LOOK_UP_SIZE), np.zeros(N_WEIGHT)
    for w, b in enumerate(contact.body):
        for side, sign in ((0, -1.0), (1, 1.0)):
            y, z, roll, yaw = _over_rail(system, state, b, side)
            y, z = y - rails[w, 2 * side], z - rails[w, 2 * side + 1]
            table = contact.table[w, side]
            stretched, slope = stretched_roll(sign * roll)
            _, iy, ir, iw, ty, tr, tw = find_cell(
                contact, table, sign * y, sign * roll, stretched, yaw**2
            )
            set_cell_weights(contact, ty, tr, slope, weights)
            p, K, K2 = np.zeros(3), np.zeros(3), np.zeros(3)
            for patch in range(3):
                look_up(contact, table, patch, iy, ir, iw, tw, weights, out)
                p[patch], K[patch], K2[patch] = z - out[0], out[1], out[2]
            total += _patch_energy(p, K, K2, contact.coupling[table])
    return total


def _over_rail(system, state, b, side):
    """Lateral position, height, roll and yaw of a wheelset over one of its rails."""
    track = system.track
    s = state[-2] + system.frame_offset[system.bodies.frame[b]] - track.s_start
    cell = int(s / track.ds)
    powers = (s - cell * track.ds) ** np.arange(4)
    y_l, z_l, y_r, z_r = track.rail[cell, :4] @ powers
    slopes = track.rail[cell, :4, 1:] @ (np.arange(1, 4) * powers[:3])
    y, z, roll, _, yaw = state[6 * b + 1 : 6 * b + 6]
    tilt = np.arcsin((z_r - z_l) / 1.5)
    height = system.bodies.nominal[b, 1]
    middle = np.array([0.5 * (y_l + y_r), 0.5 * (z_l + z_r)])
    turn = np.array([[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]])
    y, z = turn @ ([y, z + height] - middle)
    aside = 0.5 * (y_r - y_l) * (2 * side - 1)
    roll += 0.5 * (slopes[1] + slopes[3]) * yaw - tilt
    return y - aside, z - height, roll, yaw - slopes[2 * side]


def _patch_energy(p, K, K2, kappa):
    """sum 2/5 K e^2.5 + K2/3 e^3 + kappa N N with e = p - kappa N, by a damped iteration."""
    coupling = np.array([[0.0, kappa[0], 0.0], [kappa[0], 0.0, kappa[1]], [0.0, kappa[1], 0.0]])
    e = np.maximum(p, 0.0)
    for _ in range(400):
        e = 0.5 * (e + np.maximum(p - coupling @ (K * e**1.5 + K2 * e**2), 0.0))
    N = K * e**1.5 + K2 * e**2
    return np.sum(0.4 * K * e**2.5 + K2 * e**3 / 3.0) + 0.5 * N @ coupling @ N


__all__ = ["Settings", "load_track", "load_vehicle"]
