"""The time step: as long as the scheme stays stable for this vehicle at this speed.

The linearised map of one step is formed by differences about steady rolling, and in flange contact
in the tightest curve (`railsim.simulation.flange`); the step is stable where no mode of the map
grows faster than the vehicle itself does (a vehicle beyond its critical speed grows, and may).  The
margin leaves room for higher wheel loads.
"""

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.errors import ModelError
from railsim.kernels.compiler import entry
from railsim.kernels.contact_columns import PATCH_ROWS, WHEEL_COLUMNS
from railsim.kernels.contact_damping import COUPLING_SPEED
from railsim.kernels.contact_table import N_PATCH
from railsim.kernels.element_outputs import ELEMENT_COLUMNS
from railsim.kernels.internal import PAD
from railsim.kernels.recording import Recorder
from railsim.kernels.rhs import right_hand_sides
from railsim.kernels.state import LAST_STEP, N_SCALARS, SPEED
from railsim.kernels.status import RUNNING
from railsim.kernels.support import LMS, STEP_RATIO, SUPPORT_SIZE
from railsim.kernels.system import (
    IMPLICIT,
    LATERAL,
    MAX_PARTS,
    PART_SHARE,
    SECTIONS,
    SHARE,
    System,
    Work,
)
from railsim.kernels.time_loop import FAST, RK4, Chunk, time_loop
from railsim.model.assembly import Model
from railsim.model.uneven_wheels import longest_part
from railsim.model.work import parts_of_wheel, work_arrays

Situation = tuple[System, Floats]

SCHEMES = {"fast": FAST, "rk4": RK4}
# s; beyond them accuracy, not stability, decides
LONGEST_STEP = {"fast": 1.25e-3, "rk4": 0.5e-3}
# the same on rigid rails below the critical speed where nothing sets a wheel ringing on them, as a
# dip does: 2 mm, 2 m, Q of 93 instead of 85 kN (`coach_manchester`, 40 m/s)
LONGEST_STEP_STEADY = LONGEST_STEP | {"fast": 5e-3 / 3.0}
# rigid rails: longer steps than this, beyond which Verlet's method does not follow the vibration of
# a wheel at 200 Hz with the margin, take the stiffness k of the contact implicitly too: as a
# damping of k times the step times this.  Its error goes with the accelerations of the rails
LONGEST_EXPLICIT, OF_STIFFNESS = 1.3e-3, 0.2
# the same on elastic rails: no vibration of the wheel on its rail at 200 Hz is to be followed
LONGEST_STEP_ELASTIC = LONGEST_STEP | {"fast": 2.5e-3}
# the same with dry friction: an empty wagon on link suspension sticks and slides within few steps
LONGEST_STEP_FRICTION = 1.25e-3
# m of track a step, on rigid and on elastic rails: the shortest waves of irregular track, 3 m, are
# followed in some fifty steps; for a vehicle below its critical speed forty and on elastic rails
# thirty are enough, while one above it lets errors of phase grow
LONGEST_TRAVEL, LONGEST_TRAVEL_STEADY = 0.06, 0.075
LONGEST_TRAVEL_ELASTIC, LONGEST_TRAVEL_STABLE = 0.067, 0.1
SHORTEST_STEP = 1e-6  # s
# a step is taken if one longer by this factor is stable too: a wheel load of twice the static one
# raises the frequency of the contact, which goes with the sixth root of the load, by as much; by at
# most half of it where the contact is in series with rails that are no stiffer than it is
MARGIN, MARGIN_ELASTIC = math.pow(2.0, 1.0 / 6.0), math.pow(2.0, 1.0 / 12.0)


class Division(NamedTuple):
    """How a step of the fast scheme is divided where a wheel lifts or strikes.

    Attributes
    ----------
    part : float         shortest part [s]
    change : float       share of the static wheel load by which a contact force may change in a
                         step that is not divided; on smooth curves none is
    of_part : float      the same of a part, which is no shorter than `part` for it
    sideways : float     what a change of the lateral force counts: flanges strike sideways
    at_sections : float  what a change counts near rails whose section changes
    """

    part: float
    change: float
    of_part: float
    sideways: float
    at_sections: float = 1.0


# a fiftieth of a period of the wheel on a rigid rail, 200 Hz; a twentieth for the reference scheme
RIGID, PART_RK4 = Division(1e-4, 0.15, 0.08, 10.0), 2.5e-4
# there a wheel that leaps magnifies an error by the next blow: Q within 3 instead of 5 %
RIGID_AT_SECTIONS = 3.0
# no such vibration follows a strike
ELASTIC = Division(1.25e-3 / 3.0, 0.2, 0.2, 4.0)
# rails with masses vibrate on the contact at some 700 Hz: the blow of a flat lasts 0.7 ms.  Where
# they change their section, as at the nose of a crossing, it is not foreseen in a step as long as
# the transfer: Q of 61 instead of 81 kN as elsewhere (`wagon_y25`, p2, 10 m/s)
MASSES = ELASTIC._replace(part=1e-5, at_sections=40.0)
# m/s, beyond which a change counts more there, with the cube of the speed: a blow within one step
# is not foreseen at its begin (`coach_manchester`, co-running, 40 m/s: 201 instead of 246 kN)
FORESEEN = 10.0
# s, on rails with masses `change` is that of a step as long as this, and in proportion of shorter
# ones: what they lose of a vibration goes with the rate of the force
CHANGE_WITHIN = 1e-3
# 1/s, growth beyond that of the vehicle that counts as instability of the scheme: on straight track
# and in flange contact, which lasts as long as a curve
GROWTH, GROWTH_IN_FLANGE = 0.5, 1.0
# 1/s, growth up to which a vehicle is below its critical speed: bodies that nothing holds have none
NEUTRAL = 1e-3
NEVER = 1 << 40  # steps: a row every so many is none
# of a map before the norms of its powers are looked at, of these, and the least norm of a square
# that is no round-off; squarings from which on a lower bound need not be ln 2 to be taken, and the
# least mean of a diagonal over its norm that is none
_BALANCING, _SQUARINGS, _LEFT, _SURE, _SEEN = 3, 16, 1e-20, 8, 1e-6


def empty_recorder(
    model: Model, rows: int, chosen: Integers | None = None, patches: bool = False
) -> Recorder:
    """Recorder with room for `rows` outputs.

    `chosen`: elements to record, see `railsim.kernels.element_outputs`; `patches`: whether the
    contact patches are recorded.
    """
    n = model.index.n_bodies
    wheelsets = len(model.index.wheelsets)
    of_wheel = N_PATCH * parts_of_wheel(model.rails.arrays)
    chosen = np.zeros((0, 2), dtype=np.int64) if chosen is None else chosen
    return Recorder(
        state=np.zeros((rows, model.n_state)),
        rates=np.zeros((rows, 6 * n)),
        acceleration=np.zeros((rows, n, 6)),
        wheel=np.zeros((rows, wheelsets, 2, WHEEL_COLUMNS)),
        rail=np.zeros((rows, wheelsets, 2, 2)),
        patch=np.zeros((rows if patches else 0, wheelsets, 2, of_wheel, PATCH_ROWS)),
        selection=chosen,
        element=np.zeros((rows, len(chosen), ELEMENT_COLUMNS)),
    )


def record_state(system: System, state: Floats, recorder: Recorder) -> int:
    """Record a state in one row without a step; return the status."""
    work, rest = work_arrays(system), np.zeros((3, len(state)))
    once = FAST, 1.0, Chunk(0, 0, 1, closing=1)
    status, *_ = time_loop(system, work, state.copy(), rest[0].copy(), rest, recorder, *once)
    return int(status)


def divide_strikes(system: System, work: Work, scheme: int, step: float, speed: float) -> None:
    """Have the time loop divide the steps over which a wheel lifts or strikes.

    `system`, `work`: with which the loop is called; `scheme`, `step`: FAST or RK4; time step [s];
    `speed`: at which wheels pass over flats [m/s].
    """
    how = ELASTIC if system.support.elastic else RIGID
    if how is RIGID and system.contact.rails.range_row.shape[0]:
        how = RIGID._replace(at_sections=RIGID_AT_SECTIONS)
    if system.support.elastic and not system.support.massless:
        within, fast = min(1.0, step / CHANGE_WITHIN), max(1.0, speed / FORESEEN) ** 3
        how = MASSES._replace(change=MASSES.change * within, at_sections=MASSES.at_sections * fast)
    part = min(longest_part(system, speed), how.part if scheme == FAST else PART_RK4)
    parts = math.ceil(step / part * (1.0 - 1e-9))
    work.counts[MAX_PARTS] = parts if parts > 1 else 0
    work.stepping[SHARE], work.stepping[PART_SHARE] = how.change, how.of_part
    work.stepping[LATERAL], work.stepping[SECTIONS] = how.sideways, how.at_sections
    work.stepping[IMPLICIT] = _implicit_share(step)


def _implicit_share(step: float) -> float:
    return OF_STIFFNESS if step > LONGEST_EXPLICIT else 0.0


# Growth in one step up to which friction at its limit may be the cause; steps beyond the stability
# of the scheme grow by more, or less when halved.
SLIGHT = 0.01


class Stability:
    """Judges steps of a model on straight track and in flange contact.

    `system`, `state`: the model on straight and level track; steady rolling there; `scheme`: key of
    `SCHEMES`; `curving`: takes a step that is stable on straight track; returns systems and settled
    states in the tightest curves, and the power of the margin that each has to have; `on_straight`:
    takes a step and what judges it on straight track, and returns the judgement; `steady`: whether
    no wheel is set ringing in the run, by short irregularities, changing sections or radii.
    """

    def __init__(
        self,
        model: Model,
        system: System,
        state: Floats,
        scheme: str,
        curving: Callable[[float], Sequence[tuple[Situation, float]]],
        on_straight: Callable[[float, Callable[[], bool]], bool] = lambda _, judge: judge(),
        steady: bool = False,
    ) -> None:
        self._model, self._scheme, self._curving = model, scheme, curving
        self._steady = steady
        self._on_straight = on_straight
        self._straight = system, state
        self._flange: Sequence[tuple[Situation, float]] | None = None
        self._allowed: dict[int, float] = {}

    @cached_property
    def longest(self) -> float:
        """Longest step that accuracy allows [s]."""
        system, state = self._straight
        speed = float(state[SPEED])
        elastic, scheme = system.support.elastic, self._scheme
        most = (LONGEST_STEP_ELASTIC if elastic else LONGEST_STEP)[scheme]
        longer, travel = LONGEST_STEP_STEADY[scheme], LONGEST_TRAVEL
        if self._steady and not elastic and longer > most and self._is_stable(longer):
            most, travel = longer, LONGEST_TRAVEL_STEADY
        if (system.internal.kind == PAD).any():
            most = min(most, LONGEST_STEP_FRICTION)
        if not elastic:
            return min(most, travel / speed)
        usual = LONGEST_TRAVEL_ELASTIC / speed
        if usual < most and self._is_stable(usual):
            usual = LONGEST_TRAVEL_STABLE / speed
        return min(most, usual)

    def _is_stable(self, h: float) -> bool:
        """Whether the vehicle is below its critical speed: long steps widen the swings of others.

        Hollow treads, 30 m/s on smooth rigid rails: 6 % at 1.67 ms, 1.6 % at 1.25 ms.
        """
        how = self._model, *self._straight, self._scheme, h
        return _step_growth(*how, implicit=_implicit_share(h)) < NEUTRAL

    @property
    def margin(self) -> float:
        """A step is taken where one that is longer by this factor is stable too."""
        return MARGIN_ELASTIC if self._straight[0].support.elastic else MARGIN

    def choose(self, interval: float, holds: Callable[[float], bool] | None = None) -> float:
        """Longest stable step that divides the output interval, with the margin; or ModelError.

        `holds`: says of a step whether it does; by default its own stability decides.
        """
        n = max(1, int(np.ceil(interval / self.longest * (1.0 - 1e-9))))
        while interval / n >= SHORTEST_STEP:
            if holds(interval / n) if holds else self.holds(interval / n, self.margin):
                return interval / n
            n = max(n + 1, int(n * 1.1))
        cause = "an element is too stiff for the masses it connects"
        if self._within(0, *self._straight, interval / n):
            names = " on ".join(profile.name for profile in self._model.profiles.values())
            cause = f"the contact of {names} is too sharp in flange contact"
            if (speed := self._straight[1][SPEED]) < COUPLING_SPEED:
                cause += f", or {speed:g} m/s too slow, with creep forces that stiffen as 1/speed"
        raise ModelError(f"no stable step longer than {SHORTEST_STEP:g} s: {cause}")

    def holds_on_straight(self, h: float, margin: float = 1.0) -> bool:
        """Whether a step `margin` times as long as `h` is stable on straight track."""
        return self._on_straight(margin * h, lambda: self._within(0, *self._straight, h, margin))

    def holds(self, h: float, margin: float = 1.0) -> bool:
        """Whether a step `margin` times as long as `h` is stable, in flange contact too.

        The way into the curve needs a step that is stable on straight track; shorter ones are
        judged in the curve first, where most of those fail that do.
        """
        if first := self._flange is None:
            if not self.holds_on_straight(h, margin):
                return False
            self._flange = self._curving(min(h, self.longest))
        return all(
            self._within(number, *at, h, margin**share)
            for number, (at, share) in enumerate(self._flange, 1)
        ) and (first or self.holds_on_straight(h, margin))

    def _within(
        self, number: int, system: System, state: Floats, h: float, margin: float = 1.0
    ) -> bool:
        """Whether a step `margin` times as long as `h` is stable.

        `number`: 0 on straight track, from 1 in flange contact.
        """
        more, implicit = GROWTH_IN_FLANGE if number else GROWTH, _implicit_share(h)
        h *= margin
        growth = _step_growth(self._model, system, state, self._scheme, h, more, implicit)
        if growth * h > math.log(2.0):  # whatever the vehicle does, such a step does not follow it
            return False
        if growth > more and number not in self._allowed:  # for most the question does not arise
            vehicle_growth = _vehicle_growth(self._model, system, state)
            self._allowed[number] = max(0.0, vehicle_growth) + more
        allowed = self._allowed.get(number, more)
        if SLIGHT / h < growth <= allowed:  # perhaps of a lower bound only
            growth = _step_growth(self._model, system, state, self._scheme, h, 0.0, implicit)
        # a shorter step has less growth where a step is too long, not with dry friction at the
        # limit of sliding: the state has no derivative, its differences grow with 1/sqrt(h)
        how = self._model, system, state, self._scheme
        return growth <= allowed or (
            growth * h < SLIGHT
            and not any(_step_growth(*how, part * h) < growth for part in (0.5, 0.25))
        )


def _vehicle_growth(model: Model, system: System, state: Floats) -> float:
    """Largest real part of the eigenvalues of the linearised vehicle [1/s]."""
    work = work_arrays(system)

    def rates(trials: Floats) -> Floats:
        derivatives = np.zeros_like(trials)
        status, _, _ = right_hand_sides(system, work, trials, derivatives)
        if status != RUNNING:
            raise ModelError("the state of steady rolling lies outside the contact table")
        return derivatives

    columns = _jacobian(rates, system, state)
    return float(np.max(np.linalg.eigvals(columns).real))


def _step_growth(
    model: Model,
    system: System,
    state: Floats,
    scheme: str,
    h: float,
    enough: float = 0.0,
    implicit: float = 0.0,
) -> float:
    """Largest growth rate of the modes of one step of length `h` [1/s]; inf where it fails.

    Where `enough` is given, that is returned instead of what surely is smaller, and a lower bound
    of what surely is larger and more than `SLIGHT` in a step.  `implicit`: see `Work.stepping`.
    """
    if scheme == "fast":
        system, state = _after_step(system, state, h)
    arrays = system, work_arrays(system)
    arrays[1].stepping[IMPLICIT] = implicit
    rest = np.zeros_like(state), np.zeros((3, len(state))), empty_recorder(model, 1)
    one = SCHEMES[scheme], h, Chunk(1, 1, NEVER)

    def after_step(trials: Floats) -> Floats:
        after = trials.copy()
        loop = time_loop
        for k, row in enumerate(after):
            status, *_ = loop(*arrays, row, *rest, *one)
            if status != RUNNING:
                after[k] = np.nan
            if loop is time_loop:  # from now on without a search for types
                loop = entry(time_loop, *arrays, row, *rest, *one)
        return after

    if system.contact.transient:  # of which steady rolling knows nothing before its first step
        state = after_step(state[None])[0]
        if not np.isfinite(state).all():
            return np.inf
    # without masses the reference scheme balances the track's forces to 0.01 N only
    iterates = scheme == "rk4" and system.support.elastic and system.support.massless
    columns = _jacobian(after_step, system, state, 1e-6 if iterates else 1e-8)
    if not np.isfinite(columns).all():
        return np.inf
    if enough > 0.0 and (bound := _bound(columns, enough * h)):
        return bound / h
    return float(np.log(np.max(np.abs(np.linalg.eigvals(columns)))) / h)


def _after_step(system: System, state: Floats, h: float) -> tuple[System, Floats]:
    """Return the system and a state on elastic rails for the map of a step.

    The state is as a step of length `h` [s] leaves it, see `step_compliance`.  The loads of the
    system are so large that no difference of the forces counts as an error of the rails to be
    corrected: the small disturbances of the map must not be corrected in part only.
    """
    state = state.copy()
    state[LAST_STEP] = h
    if not system.support.elastic:
        return system, state
    end = len(state) - N_SCALARS
    state[end - SUPPORT_SIZE * len(system.contact.body) : end][STEP_RATIO::SUPPORT_SIZE] = 0.5
    return system._replace(contact=system.contact._replace(load=1e6 * system.contact.load)), state


def _bound(matrix: Floats, limit: float) -> float:
    """Bound of the largest ln |lambda| of all eigenvalues, as far as powers tell; 0 where not.

    `limit` where that is an upper one: |lambda|^m <= ||A^m||, and squaring A takes a third of the
    time of its eigenvalues.  Row and column k times and over a factor leave these as they are and
    make the norm small.  Half of the limit is left for round-off: of the logarithm of a norm over
    m, single precision is enough.  A lower one where that is above the limit and `SLIGHT`:
    |tr A^m| <= n |lambda|^m.
    """
    coupled = matrix != 0.0
    np.fill_diagonal(coupled, False)
    kept = np.ones(len(matrix), dtype=bool)
    while (alone := kept & ~(coupled[:, kept].any(axis=1) & coupled[kept].any(axis=0))).any():
        kept &= ~alone  # whose eigenvalues are their diagonal entries
    if np.abs(np.diag(matrix)[~kept]).max(initial=0.0) > np.exp(0.5 * limit):
        return 0.0
    power = matrix[np.ix_(kept, kept)]
    for _ in range(_BALANCING):
        sizes = np.abs(power)
        np.fill_diagonal(sizes, 0.0)
        factor = np.sqrt(sizes.sum(axis=0) / sizes.sum(axis=1))
        power = power * factor[:, None] / factor
    logarithm = 0.0  # of the factor by which the power is larger than what is held of it
    for doubled in range(_SQUARINGS):
        norm = float(np.linalg.norm(power))
        if not _LEFT < norm < np.inf:
            break
        logarithm += math.log(norm)
        if logarithm < 0.5 * limit * 2.0**doubled:
            return limit
        power = (power / norm).astype(np.float32)
        trace = abs(float(np.trace(power))) / len(power)
        least = (logarithm + math.log(trace)) / 2.0**doubled if trace > _SEEN else 0.0
        if least > (max(2.0 * limit, SLIGHT) if doubled >= _SURE else math.log(2.0)):
            return least
        power = power @ power
        logarithm *= 2.0
    return 0.0


def _jacobian(
    function: Callable[[Floats], Floats], system: System, state: Floats, step: float = 1e-8
) -> Floats:
    """Jacobian by forward differences of the entries that move; the function takes many states.

    These are not position and speed, nor what slopes have learnt.
    """
    end = len(state) - N_SCALARS
    moving = np.arange(end)
    if system.support.elastic:
        first = end - SUPPORT_SIZE * len(system.contact.body)
        moving = moving[(moving < first) | ((moving - first) % SUPPORT_SIZE < LMS)]
    trials = np.repeat(state[None], moving.size + 1, axis=0)  # the state itself is the first
    changes = step * np.maximum(1.0, np.abs(state[moving]))
    trials[np.arange(1, moving.size + 1), moving] += changes
    found = function(trials)[:, moving]
    return np.ascontiguousarray(((found[1:] - found[0]) / changes[:, None]).T)
