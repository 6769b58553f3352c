"""Static preload, static wheel loads Q0, and the state in which a run begins.

Three steps, each on straight level track:

1. preloads marked `auto` are solved so that every sprung body is in equilibrium in its nominal
   position; where there are more springs than conditions, all deflect alike as far as they can
   (least sum of F^2/k);
2. without friction, Newton's method finds the position at rest; its wheel forces are Q0;
3. with friction and speed, it finds the steady rolling: positions and the spin of the wheelsets.

Where Newton's method fails in 2 or 3 it begins again where the accelerations lead.

A fixed body is first let down on its springs like any other, and held where it then stands; where
it cannot stand by itself it is held in its nominal position.

What cannot be balanced is named: body, component, force or moment.
"""

import hashlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from railsim.arrays import Flags, Floats, Indices
from railsim.errors import ModelError
from railsim.kernels import support as rails
from railsim.kernels.contact_columns import NORMAL, W_C_Z, W_Q
from railsim.kernels.contact_table import K2, K
from railsim.kernels.element_outputs import DEFLECTION, LINK, MOUNT
from railsim.kernels.internal import AIR
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import ARC_LENGTH, N_SCALARS, SPEED, internal_begin, velocity_begin
from railsim.kernels.status import RUNNING
from railsim.kernels.system import AXLEBOX, FIXED, RIGID, WHEELSET, System
from railsim.kernels.track_frame import MU_LEFT, MU_RIGHT, OMEGA
from railsim.model.assembly import Model
from railsim.model.preloads import least_squares, with_preloads, with_these_preloads
from railsim.model.solutions import solution
from railsim.model.time_step import empty_recorder, record_state
from railsim.model.work import components_of, level_track, work_arrays
from railsim.notation import ROLL, SIDES, YAW, Z

RESIDUAL = 1e-7  # largest acceleration left in equilibrium (m/s2, rad/s2)
ONE_SIDED = 0.01  # least friction of a rail in the balance, as a share of the other's
_STEPS = 60
DESCENT = 300  # steps of a descent, at most
FIRST_STEP = 1e-4  # s2, of it
NEAR = 1e-3  # largest acceleration at its end (m/s2, rad/s2)
FURTHEST = 5e-4  # m and rad, in one step


@dataclass(frozen=True)
class Equilibrium:
    """The vehicle at rest and in steady rolling on straight level track."""

    model: Model  # with all preloads filled in
    state: Floats  # steady rolling at s = 0
    Q0: Floats  # static wheel loads [N]
    residual: float  # largest remaining acceleration [m/s2, rad/s2]
    remarks: tuple[str, ...] = ()  # for the reader of results


class AtRest(NamedTuple):
    """A vehicle at rest on straight level track: preloads of links and mounts, state, wheel loads.

    Neither speed nor friction enter, so that the runs of a study share it.
    """

    tension: Floats
    preload: Floats
    state: Floats
    Q0: Floats
    remarks: tuple[str, ...]


MOST_KEPT = 100  # vehicles
_AT_REST: dict[str, AtRest] = {}  # that this process has found


def equilibrium(model: Model, speed: float, inputs: str = "") -> Equilibrium:
    """Find preloads, static wheel loads and the state of steady rolling at `speed` [m/s].

    `inputs`: hash of all that the model was made of, but for the friction of its track; empty where
    it is not known. Raises ModelError: the preloads cannot carry a body, or no equilibrium is
    found; names what is unbalanced.
    """
    key = f"{inputs} {model.system.contact.values.shape}"
    rest = _AT_REST.get(key) if inputs else None
    if rest is None:
        rest = _at_rest(model)
        if inputs:
            if len(_AT_REST) >= MOST_KEPT:
                _AT_REST.clear()
            _AT_REST[key] = rest
    model = with_these_preloads(model, rest.tension, rest.preload)
    level, track = level_track(model.system), model.system.track
    rail = level.track.rail.copy()
    row = min(max(int(-track.s_start / track.ds), 0), len(track.rail) - 1)  # at s = 0
    friction = track.rail[row, MU_LEFT : MU_RIGHT + 1, 0]
    # without friction on one side alone nothing guides the wheelsets, and steady rolling is
    # somewhere in the flange
    rail[:, MU_LEFT : MU_RIGHT + 1, 0] = np.maximum(friction, ONE_SIDED * np.max(friction))
    rough = level._replace(track=level.track._replace(rail=rail))
    rolling = _Balance(model, rough, speed=speed, rolling=True)
    return Equilibrium(model, rolling.solve(rest.state), rest.Q0, rolling.residual, rest.remarks)


def _at_rest(model: Model) -> AtRest:
    """Let the vehicle down on its springs and rails."""
    model, guess, remarks = _let_down(model)
    static = _Balance(model, level_track(model.system), speed=1.0, rolling=False)
    state = static.solve(guess)
    Q0 = static.work.wheel[:, :, W_Q].copy()
    system = model.system
    return AtRest(system.links.spring[:, 2], system.mounts.preload, state, Q0, remarks)


def stored_equilibrium(model: Model, speed: float, inputs: str) -> Equilibrium:
    """As `equilibrium`, from the disk where it was found before; `inputs` as there."""
    friction = model.system.track.rail[:, MU_LEFT : MU_RIGHT + 1, 0]
    digest = hashlib.sha256(f"{inputs} {speed!r} {model.system.contact.values.shape}".encode())
    digest.update(np.ascontiguousarray(friction).data)

    def solve() -> dict[str, Any]:
        found = equilibrium(model, speed, inputs)
        system = found.model.system
        return {
            "tension": system.links.spring[:, 2].tolist(),
            "preload": system.mounts.preload.tolist(),
            "state": found.state.tolist(),
            "Q0": found.Q0.tolist(),
            "residual": found.residual,
            "remarks": list(found.remarks),
        }

    found = solution("equilibrium", digest.hexdigest(), solve)
    return Equilibrium(
        with_these_preloads(model, found["tension"], found["preload"]),
        np.array(found["state"]),
        np.array(found["Q0"]),
        found["residual"],
        tuple(found["remarks"]),
    )


def _let_down(model: Model) -> tuple[Model, Floats, tuple[str, ...]]:
    """Return the model with preloads, a guess of its position with fixed bodies in place, remarks.

    Raises ModelError: the preloads cannot carry a body.
    """
    fixed = model.system.bodies.fixed
    if not len(fixed):
        model = with_preloads(model)
        return model, _first_guess(model, level_track(model.system)), ()
    try:
        released = with_preloads(_release_elements(model))
        level = level_track(released.system)
        balance = _Balance(released, level, speed=1.0, rolling=False)
        guess = balance.solve(_first_guess(released, level))
        system = released.system._replace(bodies=model.system.bodies)
        return replace(released, system=system), guess, ()
    except ModelError:
        model = with_preloads(model)
        names = ", ".join(model.index.bodies[b] for b in fixed)
        remark = (
            f"Held in the nominal position, where it could not stand on its springs alone: {names}."
        )
        guess = _first_guess(model, level_track(model.system))
        for body in fixed:
            guess[6 * body : 6 * body + 6] = 0.0
        return model, guess, (remark,)


def _release_elements(model: Model) -> Model:
    """Return the model with all fixed bodies let loose."""
    bodies = model.system.bodies
    kind = np.where(bodies.kind == FIXED, RIGID, bodies.kind)
    bodies = bodies._replace(kind=kind, fixed=bodies.fixed[:0])
    design = None if model.design is None else _release_elements(model.design)
    return replace(model, system=model.system._replace(bodies=bodies), design=design)


def _first_guess(model: Model, level: System) -> Floats:
    """Nominal position, every wheelset pressed into its rails by its share of the weight.

    Both wheels touch, also where one of them is larger: half a millimetre too deep the elastic
    patches of a table have forces that belong to no load.
    """
    state = np.zeros(model.n_state)
    state[SPEED] = 1.0
    bodies, contact = level.bodies, level.contact
    weight = float(np.sum(bodies.mass)) * level.gravity / len(contact.body)
    iy = round(-contact.y0 / contact.dy)
    iroll = round(-contact.roll0 / contact.droll)
    for w, body in enumerate(contact.body):
        nodes = [contact.values[t, :, 0, iroll, iy] for t in contact.table[w]]
        left, right = (float(np.min(node[:, 0])) for node in nodes)
        touching = [node[np.argmin(node[:, 0])] for node in nodes]
        # at 60 um, what some 50 kN make
        stiffness = sum(float(node[K] + 0.008 * node[K2]) for node in touching)
        state[6 * body + Z] = 0.5 * (left + right) + (weight / stiffness) ** (2.0 / 3.0)
        state[6 * body + ROLL] = (right - left) / level.track.rail_base
    _sink(level, state, weight)
    return state


def _sink(level: System, state: Floats, weight: float) -> None:
    """Let elastic rails give way under `weight` on each wheelset, and the vehicle with them."""
    support = level.support
    if not support.elastic:
        return
    sleeper = weight / support.row[rails.K_BALLAST_Z] if support.sleeper else 0.0
    rail = sleeper + 0.5 * weight / support.row[rails.K_PAD_Z]
    track = tracks_under(level, state)
    track[:, 1 : rails.RAIL_DOF : 2] = rail
    track[:, rails.RAIL_DOF + 1] = sleeper
    for body in level.bodies.whole:
        state[6 * body + Z] += rail


def tracks_under(system: System, state: Floats) -> Floats:
    """View of the states of the track under each wheelset."""
    end = len(state) - N_SCALARS
    wheelsets = len(system.contact.body)
    return state[end - rails.SUPPORT_SIZE * wheelsets : end].reshape(wheelsets, rails.SUPPORT_SIZE)


def conditions(
    model: Model, system: System, *, held: bool = False, rolling: bool = True
) -> tuple[Indices, Indices, Floats]:
    """Unknowns and equations of balance as entries of the state, and the inertias of equations.

    The unknown of a wheelset's spin is its rate, of all others the position; without `rolling` it
    does not spin, and without friction nothing turns it.  `held`: neither wheelsets nor their track
    move.
    """
    n, bodies, support = model.index.n_bodies, system.bodies, system.support
    rolling = rolling and bool(system.track.rail[:, MU_LEFT : MU_RIGHT + 1, 0].any())
    unknowns, equations, inertias = [], [], []
    for body, kind in enumerate(bodies.kind):
        for component in components_of(int(kind)):
            spin = kind == WHEELSET and component == 4
            given = body == bodies.reference and component == 0
            if given or (kind == WHEELSET and held) or (spin and not rolling):
                continue
            unknowns.append((velocity_begin(n) if spin else 0) + 6 * body + component)
            equations.append(velocity_begin(n) + 6 * body + component)
            of_body = (bodies.mass[body],) * 3 + tuple(bodies.inertia[body])
            inertias.append(float(of_body[component]))
    if support.elastic and not held:
        first = model.n_state - N_SCALARS - rails.SUPPORT_SIZE * len(system.contact.body)
        starts = first + rails.SUPPORT_SIZE * np.arange(len(system.contact.body))
        moving = np.arange(rails.DOF if support.sleeper else rails.RAIL_DOF)
        track = (starts[:, None] + moving).ravel().tolist()
        unknowns += track
        equations += [rails.RATE + k for k in track]
        inertias += [rails.REFERENCE_MASS] * len(track)
    air = (internal_begin(n) + np.flatnonzero(system.internal.kind == AIR)).tolist()
    return (
        np.array([*unknowns, *air]),
        np.array([*equations, *air]),
        np.array([*inertias, *[1.0] * len(air)]),
    )


def difference_quotients(
    function: Callable[[Floats], Floats], state: Floats, value: Floats, unknowns: Indices, h: float
) -> Floats:
    """Slopes of a function of several states over some entries of one, where it has `value`."""
    steps = h * np.maximum(1.0, np.abs(state[unknowns]))
    trials = np.repeat(state[None], len(steps), axis=0)
    trials[np.arange(len(steps)), unknowns] += steps
    return np.asarray(((function(trials) - value) / steps[:, None]).T)


def settled(
    accelerations: Callable[[Floats], Floats], state: Floats, unknowns: Indices, limited: Flags
) -> Floats | None:
    """Follow x' = a(x): without friction to a minimum of the potential, with it as steered.

    Where left and right wheels differ, the forces about the middle have next to no slopes and grow
    on the way to where they vanish: steps of Newton's method lead anywhere. Implicit Euler with
    steps that grow (pseudo-transient continuation, Kelley and Keyes 1998). `limited`: unknowns of
    which each step changes little, positions. None: it does not come to rest.
    """
    step = FIRST_STEP
    for _ in range(DESCENT):
        rest = accelerations(state)
        if np.max(np.abs(rest)) < NEAR:
            return state
        slopes = difference_quotients(accelerations, state, rest, unknowns, 1e-9)
        change = least_squares(np.eye(len(rest)) / step - slopes, rest, 1e-13)
        trial = state.copy()
        trial[unknowns] += change
        step *= 0.25
        with suppress(ModelError):
            accelerations(trial)
            if np.max(np.abs(change[limited])) < FURTHEST:
                state, step = trial, 8.0 * step
    return None


class _Balance:
    """Newton's method on the accelerations of all bodies, velocities zero in the track frame."""

    def __init__(self, model: Model, system: System, *, speed: float, rolling: bool) -> None:
        self.model = model
        self.system = system
        self.speed = speed
        self.work = work_arrays(system)
        self.residual = np.inf
        self._unknowns, self._equations, _ = conditions(model, system, rolling=rolling)

    def solve(self, guess: Floats) -> Floats:
        """Return the balanced state; raise ModelError with the unbalanced components."""
        state = guess.copy()
        state[SPEED], state[ARC_LENGTH] = self.speed, 0.0
        wheelsets, spins = self.system.contact.body, 6 * self.model.index.n_bodies + 4
        self._accelerations(state)
        # Rolling without slip where the wheels touch: creep forces near mu N have next to no slopes
        lever, nominal = self.work.wheel[:, :, W_C_Z], self.system.bodies.radius[wheelsets, None]
        radius = np.where(lever > 0.0, lever, nominal).mean(axis=1)
        state[spins + 6 * wheelsets] = -self.speed / radius
        try:
            return self._by_newton(state)
        except ModelError:
            near = self._unknowns < 6 * self.model.index.n_bodies
            if (found := settled(self._accelerations, state, self._unknowns, near)) is None:
                raise
        return self._by_newton(found)

    def _by_newton(self, state: Floats) -> Floats:
        """Newton's method from a guess; raise ModelError with the unbalanced components."""
        rest = self._accelerations(state)
        change = np.zeros(len(self._unknowns))
        for _ in range(_STEPS):
            self.residual = float(np.max(np.abs(rest)))
            if self.residual < RESIDUAL:
                break
            jacobian = difference_quotients(self._accelerations, state, rest, self._unknowns, 1e-9)
            change = least_squares(jacobian, -rest, 1e-13)
            state, rest, shorter = self._line_search(state, rest, change, 2)
            if not shorter:
                state, rest, shorter = self._over_kinks(state, rest, change)
            if not shorter:
                state, rest, shorter = self._line_search(state, rest, change, 12)
            if not shorter:
                break
        self.residual = float(np.max(np.abs(rest)))
        if not self.residual < 1e3 * RESIDUAL:  # so that NaN counts too
            names = self._alternating(state, change)
            both = f"alternating between two branches: {', '.join(names)}; " if names else ""
            left = self.model.index.largest_left(self._equations, rest, 5)
            raise ModelError(f"no static equilibrium of '{self.model.flat.name}'; {both}{left}")
        return state

    def _over_kinks(
        self, state: Floats, rest: Floats, change: Floats
    ) -> tuple[Floats, Floats, bool]:
        """Newton's step with slopes averaged over the way that it would go.

        Where the force of an element or contact has a kink, the slope on this side sends Newton's
        method beyond the kink, and the one on the other side sends it back.  The mean of both
        brings it nearer; the span shrinks until it leaves the kink out.
        """
        for span in 0.25 ** np.arange(10):
            try:
                averaged = self._mean_jacobian(state, span * np.abs(change))
            except ModelError:
                continue
            mean = least_squares(averaged, -rest, 1e-13)
            # where one side is far softer the mean slope gives but a small part of the way
            found = [
                self._line_search(state, rest, factor * direction, 1)
                for factor in (256.0, 64.0, 16.0, 4.0, 1.0, 0.25)
                for direction in (mean, span * change)
            ]
            after, rest_after, shorter = min(found, key=lambda each: float(np.linalg.norm(each[1])))
            if shorter:
                return after, rest_after, True
        return state, rest, False

    def _mean_jacobian(self, state: Floats, spans: Floats) -> Floats:
        """Slopes of the accelerations, averaged over `spans` to both sides of each unknown."""
        columns = []
        for k, span in zip(self._unknowns, spans, strict=True):
            span = max(float(span), 1e-9 * max(1.0, abs(state[k])))
            trials = np.array([state, state])
            trials[:, k] += span, -span
            ahead, behind = self._accelerations(trials)
            columns.append((ahead - behind) / (2.0 * span))
        return np.array(columns).T

    def _accelerations(self, states: Floats) -> Floats:
        """Accelerations of one state, or of several, one a row."""
        rows = np.atleast_2d(states)
        derivatives = np.empty_like(rows)
        status, where, _ = right_hand_sides(self.system, self.work, rows, derivatives)
        if status != RUNNING:
            reason = self.model.index.sentence(status, where)
            raise ModelError(f"no static equilibrium of '{self.model.flat.name}': {reason}")
        return derivatives[:, self._equations].reshape(*states.shape[:-1], -1)

    def _line_search(
        self, state: Floats, rest: Floats, change: Floats, trials: int
    ) -> tuple[Floats, Floats, bool]:
        size = float(np.linalg.norm(rest))
        for factor in 0.5 ** np.arange(trials):
            trial = state.copy()
            trial[self._unknowns] += factor * change
            try:
                trial_rest = self._accelerations(trial)
            except ModelError:
                continue
            if np.linalg.norm(trial_rest) < size:
                return trial, trial_rest, True
        return state, rest, False

    def _alternating(self, state: Floats, change: Floats) -> list[str]:
        """Elements and wheels that are on other branches here than after Newton's step."""
        system, index = self.system, self.model.index
        after = state.copy()
        after[self._unknowns] += change
        links = [[LINK, k] for k in np.flatnonzero((system.links.curve >= 0).any(axis=1))]
        mounts = [[MOUNT, k] for k in np.flatnonzero((system.mounts.curve >= 0).any(axis=1))]
        chosen = np.array(links + mounts, dtype=np.int64).reshape(-1, 2)
        deflections, patches = [], []
        for each in (state, after):
            recorder = empty_recorder(self.model, 1, chosen, patches=True)
            if record_state(system, each, recorder) != RUNNING:
                return []
            deflections.append(recorder.element[0, :, DEFLECTION : DEFLECTION + 3])
            patches.append(recorder.patch[0, :, :, :, NORMAL] > 0.0)
        names = []
        for row, (group, k) in enumerate(chosen.tolist()):
            curves = (system.links if group == LINK else system.mounts).curve[k]
            for axis, curve in enumerate(curves):
                if curve >= 0:
                    nodes = system.curves.x[
                        system.curves.start[curve] : system.curves.start[curve + 1]
                    ]
                    ends = np.sort([d[row, axis if group == MOUNT else 0] for d in deflections])
                    if ((nodes >= ends[0]) & (nodes <= ends[1])).any():
                        names.append((index.links if group == LINK else index.mounts)[k])
        other = (patches[0] != patches[1]).any(axis=2)
        names += [f"{index.wheelsets[w]} {SIDES[side]} (contact)" for w, side in np.argwhere(other)]
        return list(dict.fromkeys(names))


def initial_state(model: Model, balance: Equilibrium, s: float, frames: Floats) -> Floats:
    """Steady rolling transferred to arc length `s`: at rest relative to the moving track frames.

    `frames`: track frames at the bodies' positions for this `s`.
    """
    state = balance.state.copy()
    state[ARC_LENGTH] = s
    n = model.index.n_bodies
    speed = state[SPEED]
    for body, kind in enumerate(model.system.bodies.kind):
        if kind == AXLEBOX:
            continue
        # positions relative to the frame are small: its rate of turn is that of the body
        rate = speed * frames[model.system.bodies.frame[body], OMEGA : OMEGA + 3]
        first = velocity_begin(n) + 6 * body
        state[first + ROLL : first + YAW + 1] += rate
    return state
