"""A test rig for one force element: its second body is moved as prescribed, the force is read.

Also the work of all forces that are not conservative, from positions alone: an independent account
of where a vehicle's energy goes.
"""

import functools
from pathlib import Path

import numpy as np
from dynamics import Settings, absolute_frame, load_track, load_vehicle, rotation

from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels.compiler import entry
from railsim.kernels.internal import AIR, PAD, curve_value, set_decays, state_after
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.step_rk4 import restore_limits
from railsim.kernels.system import AXLEBOX, FORCE, WHEELSET
from railsim.kernels.time_loop import FAST, RK4, Chunk, time_loop
from railsim.model.assembly import assemble
from railsim.model.time_step import empty_recorder
from railsim.model.work import level_track, work_arrays

DATA = Path(__file__).parent.parent / "data" / "vehicles"


def test_vehicle(name):
    """One of the vehicles in tests/data/vehicles."""
    return load_vehicle(str(DATA / f"{name}.toml"))


test_vehicle.__test__ = False  # a helper, not a test


@functools.cache
def coach_and_track():
    """What all rigs take a wheelset and rails of."""
    data = load_vehicle("coach_manchester").model_dump(exclude_none=True)
    return (
        data["assemblies"]["bogie"]["assemblies"]["axle"]["wheelsets"]["wheelset"],
        load_track("straight"),
    )


class Rig:
    """`probe` hangs on `frame` by the element under test and is moved relative to it."""

    def __init__(self, **element):
        wheelset, track = coach_and_track()
        body = {"mass": 1e3, "inertia": [1e3, 1e3, 1e3], "position": [0.0, 0.0, -1.0]}
        vehicle = Vehicle.model_validate(
            {
                "format": "railsim-vehicle/1",
                "name": "rig",
                "wheelsets": {"wheelset": wheelset},
                "bodies": {"frame": body, "probe": body},
                "elements": {
                    "tested": {"bodies": ["frame", "probe"], "preload": 0.0, **element}
                    if element["kind"] == "spring_damper"
                    else {"bodies": ["frame", "probe"], "point": [0.0, 0.0, -1.0], **element}
                },
            }
        )
        model = assemble(vehicle, track, Settings())
        self.system = level_track(model.system)
        self.state = np.zeros(model.n_state)
        self.state[-1] = 1.0
        self.probe = model.index.coordinate("probe", 0)
        self.work, self.derivative = work_arrays(model.system), np.zeros(model.n_state)
        self.n = model.index.n_bodies
        self.body = self.probe // 6
        self.frame = model.index.coordinate("frame", 0) // 6
        arrays = self.system, self.work, self.state[None], self.derivative[None]
        right_hand_sides(*arrays)
        # a call with any arrays takes ten times as long to find their types
        self._evaluate = functools.partial(entry(right_hand_sides, *arrays), *arrays)

    def force(self, axis, deflection, rate=0.0):
        """Force on the frame along `axis`, positive as the probe moves away; sets the drives."""
        self.state[self.probe + axis] = deflection
        self.state[6 * self.n + self.probe + axis] = rate
        status, *_ = self._evaluate()
        assert status == 0
        return -self.work.pose[self.body, FORCE + axis]

    def history(self, axis, time, deflection, rate):
        """Forces along a prescribed motion, internal states advanced as the fast scheme does."""
        unit = np.eye(6)[axis]
        moved = self.path(time, lambda t: unit * deflection(t), lambda t: unit * rate(t))
        return moved[:, axis]

    def forces(self, position, rate):
        """Force and moment about its centre on the frame, six each; sets the drives."""
        self.state[self.probe : self.probe + 6] = position
        self.state[6 * self.n + self.probe : 6 * self.n + self.probe + 6] = rate
        status, *_ = self._evaluate()
        assert status == 0
        return self.work.pose[self.frame, FORCE : FORCE + 6].copy()

    def path(self, time, position, rate):
        """As `history` for a motion in all six coordinates; forces and moments on the frame."""
        internal, curves = self.system.internal, self.system.curves
        h = time[1] - time[0]
        decay = np.zeros(len(internal.kind))
        set_decays(internal, h, decay)
        forces = np.zeros((len(time), 6))
        for k in range(len(time)):
            # a step's drive: a rate counts in its middle, an air spring's deflection too
            forces[k] = self.forces(position(time[k]), rate(time[k]))
            self.forces(position(time[k] + 0.5 * h), rate(time[k] + 0.5 * h))
            for i in range(len(internal.kind)):
                at = 12 * self.n + i
                self.state[at] = state_after(
                    internal,
                    curves,
                    i,
                    self.state[at],
                    self.work.drive[i, 0],
                    self.work.drive[i, 1],
                    h,
                    decay[i],
                )
            restore_limits(internal, curves, 12 * self.n, self.work.drive, self.state)
        return forces


def poses(system, state):
    """Position and attitude of every body in global axes."""
    pose = {}
    for b, kind in enumerate(system.bodies.kind):
        q = state[6 * b : 6 * b + 6]
        if kind == AXLEBOX:
            centre, attitude = pose[system.bodies.parent[b]]
            pose[b] = (centre, attitude @ rotation(q[4], 1))
            continue
        frame = absolute_frame(system, state[-2] + system.frame_offset[system.bodies.frame[b]])
        A = frame[3:12].reshape(3, 3)
        C = rotation(q[5], 2) @ rotation(q[3], 0)
        if kind != WHEELSET:
            C = C @ rotation(q[4], 1)
        pose[b] = (frame[:3] + A @ (q[:3] + np.array([0.0, *system.bodies.nominal[b]])), A @ C)
    return pose


class WorkOfDissipation:
    """Sum of F dd over all dampers, friction pads and air spring reservoirs along a motion [J].

    Deflections come from the poses alone, rates from their differences: nothing of the kernels but
    the internal states themselves.
    """

    def __init__(self, model):
        self.system = model.system
        self.inner = slice(
            12 * model.index.n_bodies, 12 * model.index.n_bodies + len(model.system.internal.kind)
        )
        self.total = 0.0
        self._before = None

    def add(self, state, h):
        """Take up the state after one more step `h`."""
        now = self._deflections(state)
        if self._before is not None:
            inner = 0.5 * (state[self.inner] + self._inner_before)
            self.total += self._links(now[0], self._before[0], inner, h)
            self.total += self._mounts(now[1], self._before[1], inner, h)
            self.total += self._rotations(now[2], self._before[2], h)
        self._before, self._inner_before = now, state[self.inner].copy()

    def _deflections(self, state):
        place, turn = map(np.array, zip(*poses(self.system, state).values(), strict=True))

        def gaps(elements):
            ends = place[elements.body] + np.einsum(
                "ekab,ekb->eka", turn[elements.body], elements.point
            )
            return ends[:, 1] - ends[:, 0]

        links, mounts = self.system.links, self.system.mounts
        first, second = turn[mounts.body[:, 0]], turn[mounts.body[:, 1]]
        axes = np.stack([first, np.where(mounts.flags[:, 1, None, None], second, first)], axis=1)
        ways = np.einsum("ekba,eb->eka", axes, gaps(mounts))
        return np.linalg.norm(gaps(links), axis=1), ways, np.einsum("eba,ebc->eac", first, second)

    def _links(self, now, before, inner, h):
        system, total = self.system, 0.0
        for e, way in enumerate(now - before):
            force = system.links.spring[e, 1] * way / h
            if system.links.internal[e] >= 0:
                force += inner[system.links.internal[e]]
            if system.links.curve[e, 1] >= 0:
                force += curve_value(system.curves, system.links.curve[e, 1], way / h)
            total += force * way
        return total

    def _mounts(self, now, before, inner, h):
        mounts, internal, ways = self.system.mounts, self.system.internal, now - before
        # element, end, axis; the last value where an axis has no internal state, whose number is -1
        own = np.append(inner, 0.0)[mounts.internal][:, None]
        air = (np.append(internal.kind, -1) == AIR)[mounts.internal][:, None]
        stiffness = np.append(internal.parameter[:, 0], 0.0)[mounts.internal][:, None]
        force = np.where(air, stiffness * (0.5 * (now + before) - own), own)
        return 0.5 * np.sum((force + mounts.damping[:, None] * ways / h) * ways)

    def _rotations(self, now, before, h):
        turn = np.einsum("eab,ecb->eac", now - before, 0.5 * (now + before))
        twice = [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0]]
        twice.append(turn[:, 1, 0] - turn[:, 0, 1])
        angles = 0.5 * np.transpose(twice)
        return np.sum(self.system.mounts.rotation_damping * angles**2) / h

    def stored(self, state):
        """Energy that sticking pads and series springs hold for a while [J]."""
        internal, total = self.system.internal, 0.0
        for i, value in enumerate(state[self.inner]):
            if internal.kind[i] == PAD:
                total += 0.5 * value**2 / internal.parameter[i, 0]
            elif internal.kind[i] != AIR:
                total += 0.5 * value**2 / internal.parameter[i, 1]
        return total


def step_by_step(model, state, h, n_steps, scheme="rk4"):
    """States after each of `n_steps` steps."""
    state = state.copy()
    work = work_arrays(model.system)
    derivative, stages = np.zeros_like(state), np.zeros((3, len(state)))
    recorder = empty_recorder(model, 1)
    for step in range(n_steps):
        status, *_ = time_loop(
            model.system,
            work,
            state,
            derivative,
            stages,
            recorder,
            RK4 if scheme == "rk4" else FAST,
            h,
            Chunk(1, 1, 1 << 40, fresh=int(step == 0)),
        )
        assert status == 0
        yield state
