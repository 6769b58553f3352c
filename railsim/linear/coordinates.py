"""Coordinates of a vehicle without those that nothing depends on, and their names.

The following parts of the state vector of `railsim.kernels.system` are left out: time, position and
speed, the memory of the fast scheme, the spin angles of the wheelsets (their rates stay), and the
entries that an axlebox does not use.  The reference body's x, which runs hold, is free here: held,
it would be a car body of infinite mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.errors import ModelError
from railsim.kernels import actuators as acts
from railsim.kernels.creep import FASTRIP, FASTSIM, LINEAR
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import N_SCALARS, SPEED, internal_begin, velocity_begin
from railsim.kernels.status import RUNNING
from railsim.kernels.support import DOF, RAIL_DOF, RATE, SUPPORT_SIZE
from railsim.kernels.system import FREE, WHEELSET, Drive, System
from railsim.kernels.track_frame import OMEGA
from railsim.linear.system import Linearisation, jacobian, without_forceless
from railsim.model.assembly import Model
from railsim.model.work import components_of, work_arrays
from railsim.notation import COMPONENTS

OF_RAILS = ("rail.left.y", "rail.left.z", "rail.right.y", "rail.right.z")
TRACK_PARTS = (*OF_RAILS, "sleeper.y", "sleeper.z", "sleeper.roll")
STEP, RATE_STEP, FORCE_STEP = 1e-8, 1e-7, 1.0  # m and rad, m/s and rad/s, N


@dataclass(frozen=True)
class Coordinates:
    """Which entries of the state vector are coordinates of the analysis.

    These are positions and velocities of the bodies, internal states of elements, displacements of
    elastic rails, their rates.
    """

    # ``carbody.y``, ``carbody.y'``, name of an element, ``front.wheelset.rail.left.y``
    names: tuple[str, ...]
    indices: Integers  # in the state vector
    bodies: Integers  # of positions and velocities, -1 of all others
    components: Integers  # likewise
    n_positions: int  # of the bodies
    n_velocities: int  # of the bodies
    steps: Floats  # of difference quotients
    forceless: Integers  # rates of rails without mass: their equations say that the forces balance
    wheelsets: Integers  # to which they and the rails beneath it belong, -1 of all others

    @property
    def positions(self) -> slice:
        """Where the positions stand."""
        return slice(0, self.n_positions)

    @property
    def velocities(self) -> slice:
        """Where the velocities stand."""
        return slice(self.n_positions, self.n_positions + self.n_velocities)

    @cached_property
    def position_of(self) -> dict[tuple[int, int], int]:
        """Index of the position of each body and component."""
        return self._indices(self.positions)

    @cached_property
    def velocity_of(self) -> dict[tuple[int, int], int]:
        """Index of the velocity of each body and component."""
        return self._indices(self.velocities)

    def _indices(self, part: slice) -> dict[tuple[int, int], int]:
        places = zip(self.bodies[part].tolist(), self.components[part].tolist(), strict=True)
        return {place: k for k, place in enumerate(places, start=part.start)}


def coordinates(model: Model, *, held: bool = False, hold: Sequence[str] = ()) -> Coordinates:
    """Return the coordinates of a vehicle.

    `held`: leave out all coordinates of the wheelsets; axleboxes pitch; `hold`: bodies that are
    fixed to the moving track frame where they are in steady rolling.
    """
    positions, velocities = [], []
    n = model.index.n_bodies
    for body, kind in enumerate(model.system.bodies.kind):
        if (kind == WHEELSET and held) or model.index.bodies[body] in hold:
            continue
        for component in components_of(int(kind)):
            if not (kind == WHEELSET and component == 4):
                positions.append((body, component))
            velocities.append((body, component))
    both = [*positions, *velocities]
    names = [f"{model.index.bodies[b]}.{COMPONENTS[k]}" for b, k in positions]
    names += [f"{model.index.bodies[b]}.{COMPONENTS[k]}'" for b, k in velocities]
    rest = _internal_names(model)
    indices = [6 * b + k for b, k in positions]
    indices += [velocity_begin(n) + 6 * b + k for b, k in velocities]
    indices += [internal_begin(n) + i for i in range(len(rest))]
    steps = [STEP] * len(positions) + [RATE_STEP] * len(velocities) + [FORCE_STEP] * len(rest)
    number = {int(body): w for w, body in enumerate(model.system.contact.body)}
    wheelsets = [number.get(b, -1) for b, _ in both] + [-1] * len(rest)
    forceless = []
    support = model.system.support
    if support.elastic and not held:
        first = model.n_state - N_SCALARS - SUPPORT_SIZE * len(number)
        moving = DOF if support.sleeper else RAIL_DOF
        track = [first + SUPPORT_SIZE * w + k for w in range(len(number)) for k in range(moving)]
        parts = [f"{w}.{part}" for w in model.index.wheelsets for part in TRACK_PARTS[:moving]]
        indices += [*track, *(k + RATE for k in track)]
        rest += [*parts, *(f"{part}'" for part in parts)]
        steps += [STEP] * len(track) + [RATE_STEP] * len(track)
        wheelsets += [*np.repeat(range(len(number)), moving)] * 2
        if support.massless:
            forceless = list(range(len(indices) - len(track), len(indices)))
    return Coordinates(
        names=(*names, *rest),
        indices=np.array(indices, dtype=np.int64),
        bodies=np.array([b for b, _ in both] + [-1] * len(rest), dtype=np.int64),
        components=np.array([k for _, k in both] + [-1] * len(rest), dtype=np.int64),
        n_positions=len(positions),
        n_velocities=len(velocities),
        steps=np.array(steps),
        forceless=np.array(forceless, dtype=np.int64),
        wheelsets=np.array(wheelsets, dtype=np.int64),
    )


def _internal_names(model: Model) -> list[str]:
    """Names of the internal states after their elements."""
    system, index = model.system, model.index
    names = dict(zip(system.links.internal.tolist(), index.links, strict=True))
    rows = zip(index.mounts, system.mounts.internal.tolist(), strict=True)
    names |= {i: f"{name}.{axis}" for name, row in rows for axis, i in zip("xyz", row, strict=True)}
    for name, row in zip(index.actuators, system.actuators.codes.tolist(), strict=True):
        names[row[acts.LAG_STATE]] = f"{name}.lag"
        own, first = range(row[acts.USER_STATES]), row[acts.USER_STATE]
        names |= {first + k: f"{name}.state_{k + 1}" for k in own}
    return [names[i] for i in range(len(system.internal.kind))]


class FreeVehicle:
    """x' = f(x) of a vehicle about a state of steady rolling, the reference body's x free.

    The kernels keep the reference body's x; in free running they say by which V' they do so.  Added
    back to all bodies, it gives the motion of the free body seen from frames that move at constant
    speed.  The traction that would keep the speed in a curve does not change the derivatives.

    `model`: with preloads; `system`: on its track; `state`: steady rolling; `held`: whether the
    wheelsets are held; `hold`: other bodies that are held, as in `coordinates`.
    """

    def __init__(
        self,
        model: Model,
        system: System,
        state: Floats,
        *,
        held: bool = False,
        hold: Sequence[str] = (),
    ) -> None:
        self.model = model
        self.coordinates = coordinates(model, held=held, hold=hold)
        self.state = state.copy()
        self.work = work_arrays(system)
        self._n = model.index.n_bodies
        bodies = system.bodies
        self._whole = np.asarray(bodies.whole)
        self._frames = bodies.frame[self._whole]
        self._nominal = np.hstack([np.zeros((len(self._whole), 1)), bodies.nominal[self._whole]])
        reference = bodies.reference
        self._reference = 6 * reference, 6 * self._n + 6 * reference
        self.system = system._replace(drive=Drive(FREE, np.zeros((1, 2)), np.zeros(3)))
        self.evaluate(state)  # for the frames
        self._is_straight = not self.work.frames[:, OMEGA : OMEGA + 3].any()

    @property
    def x(self) -> Floats:
        """The coordinates in the state of steady rolling, float64[n]."""
        return self.state[self.coordinates.indices].copy()

    def tangent(self) -> Floats:
        """Jacobian of `rate` in steady rolling, float64[n, n]; ModelError: it is not finite.

        Where creep forces take most of the time, by a law that costs little; then the blocks in
        which a wheelset and the rails beneath it act on themselves are corrected to the true law,
        those of all wheelsets at once: no other creep force changes (Curtis, Powell and Reid 1974).
        """
        contact, c, law = self.system.contact, self.coordinates, self.system.contact.law
        cheap, own = self.system, np.zeros((0, 0), dtype=np.int64)
        # about a wheelset as reference body all others move as its creep forces change
        if law.number in (FASTSIM, FASTRIP) and self.system.bodies.reference not in contact.body:
            linear = contact._replace(law=law._replace(number=LINEAR))
            cheap = self.system._replace(contact=linear)
            own = np.array([np.flatnonzero(c.wheelsets == w) for w in range(len(contact.body))])

        def correction(moved: Floats) -> Floats:
            x = np.repeat(self.x[None], len(moved), axis=0)
            for columns in own:
                x[:, columns] += moved
            return self.rates(x) - self.rates(x, cheap)

        matrix = jacobian(lambda x: self.rates(x, cheap), self.x, c.steps)
        if own.size:
            blocks = jacobian(correction, np.zeros(own.shape[1]), c.steps[own[0]])
            for block in own:
                matrix[np.ix_(block, block)] += blocks[block]
        if not np.isfinite(matrix).all():
            raise ModelError("the vehicle cannot be linearised: a derivative is not finite")
        return matrix

    def linearisation(self, matrix: Floats) -> Linearisation:
        """Linearisation of a Jacobian of `rate`, with the rates of rails without mass eliminated.

        Of such a rail B_y y + B_w w = 0 is the balance of forces, w its rate: w = -B_w^-1 B_y y.
        The parameter is the speed.
        """
        c, matrix = self.coordinates, without_forceless(matrix, self.coordinates.forceless)
        kept = np.setdiff1d(np.arange(len(c.names)), c.forceless)
        names = tuple(c.names[k] for k in kept)
        return Linearisation(names, matrix, self.x[kept], float(self.state[SPEED]))

    def evaluate(self, state: Floats) -> Floats:
        """Derivative of a whole state, forces left in `work`; ModelError: it is out of range."""
        return np.asarray(self._derivatives(state[None], self.system)[0])

    def _derivatives(self, states: Floats, system: System) -> Floats:
        derivatives = np.empty_like(states)
        status, where, _ = right_hand_sides(system, self.work, states, derivatives)
        if status != RUNNING:
            sentence = self.model.index.sentence(status, where)
            raise ModelError(f"outside the range of the model: {sentence}")
        return derivatives

    def rate(self, x: Floats) -> Floats:
        """Derivative of the coordinates, float64[n]."""
        return np.asarray(self.rates(x[None])[0])

    def rates(self, x: Floats, system: System | None = None) -> Floats:
        """Derivatives of the coordinates, float64[k, n] of as many; of another system if given."""
        trials = np.repeat(self.state[None], len(x), axis=0)
        trials[:, self.coordinates.indices] = x
        derivatives = self._derivatives(trials, system or self.system)
        derivatives[:, self._reference[0]] = trials[:, self._reference[1]]
        of_velocities = slice(velocity_begin(self._n), internal_begin(self._n))
        velocities = derivatives[:, of_velocities].reshape(len(x), -1, 6)
        change = derivatives[:, -1, None]
        if self._is_straight:
            velocities[:, self._whole, 0] += change
        else:
            velocities[:, self._whole, :3] += change[:, None] * self._directions(trials)
        derivatives[:, of_velocities] = velocities.reshape(len(x), -1)
        return np.asarray(derivatives[:, self.coordinates.indices])

    def _directions(self, states: Floats) -> Floats:
        """e_x + omega x r of whole bodies: how they move as their frames go along the track."""
        r = states[:, : 6 * self._n].reshape(len(states), -1, 6)[:, self._whole, :3] + self._nominal
        moved = np.cross(self.work.frames[self._frames, OMEGA : OMEGA + 3], r)
        moved[..., 0] += 1.0
        return moved
