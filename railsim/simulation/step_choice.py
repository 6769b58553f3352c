"""Step and output interval of a run at any speed.

The longest step that a scheme allows is taken where it is stable for a class of runs: at the lowest
speed and the highest friction of the class, and in flange contact also at the highest speed and the
middle friction.  That is judged once and kept on disk: runs of a study that differ by little share
it, and so do its processes.  Where it does not hold, the run's own speed and friction are judged,
for this step and shorter ones; unless on straight track it does not hold at the other end of the
class either: then a shorter step is judged for the class.  The step depends on the inputs of the
run alone, not on other runs.
"""

import hashlib
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import ModelError, input_error
from railsim.kernels.actuators import BY_BRAKE, LIMIT, MODE
from railsim.kernels.check_rails import DAMPING, STIFFNESS
from railsim.kernels.driving import FULL_BRAKE_SPEED, ROLLING_SHARE
from railsim.kernels.element_columns import LINK_COLUMNS
from railsim.kernels.rhs import STANDSTILL_SPEED
from railsim.kernels.system import BRAKES, RADIUS, SLIP_BEGIN, SLIP_END, Bodies, Drives, System
from railsim.kernels.track_frame import MU_LEFT, MU_RIGHT
from railsim.linear.steady import NotConverged, SteadyRolling
from railsim.model.assembly import Model
from railsim.model.equilibrium import equilibrium
from railsim.model.solutions import solution
from railsim.model.time_step import Situation, Stability
from railsim.model.work import level_track_with_friction, uneven_rigid_rails
from railsim.simulation.auxiliary_track import Progress
from railsim.simulation.flange import (
    at_check_rails,
    at_narrowest_gauge,
    at_rest_with,
    in_flange_contact,
    off_centre,
    under_forces,
)
from railsim.track.irregularity import shortest_wave

CLASS = 1.2  # ratio of the speeds of a class
# part of the output interval by which a given step may miss an integer fraction: six digits
WRITTEN = 1e-5
FRICTION_CLASS = 0.1  # difference of the coefficients of friction of a class
HELD, DRY = 1.6, 0.5  # z in `braked_step` and `slip_control_step`; friction of dry rails
GUIDED = 0.4, 0.6  # h c/m and h sqrt(k/m) in `check_rail_step`
MOST_JUDGED = 10_000
ALIGNMENT = {"name", "source", "speed", "plan", "cant", "rounding"}  # of a track
# whether steps hold in classes that this process has judged or read, by a hash of all inputs
_JUDGED: dict[str, bool] = {}


class StepChoice:
    """Step and output interval of a run, chosen once for each class of speeds where these vary.

    Creep forces stiffen as 1/V, and friction feeds vibrations: a class is judged at its lowest
    speed and highest friction.  In flange contact growth often rises with the speed and is largest
    at some friction in between: there a class is judged at its highest speed and middle friction
    as well, with half of the margin; so is less friction elsewhere along the track.

    `states`: steady rolling on straight track at the speeds where it is known; `inputs`: hash of
    all that the model was made of, friction apart, see `inputs_hash`; `on_straight`: of what counts
    on straight track; `progress`: called while a step is judged, as in
    `railsim.simulation.flange.in_flange_contact`; `periods`: of controllers and samples: no chosen
    step is longer, and one that divides them is preferred [s].
    """

    def __init__(
        self,
        model: Model,
        settings: Settings,
        track: Track,
        states: dict[float, Floats],
        inputs: str,
        on_straight: str,
        progress: Progress | None = None,
        periods: Sequence[float] = (),
    ) -> None:
        self._model = model
        self._track = track
        self._settings = settings
        self._progress = progress
        self._inputs, self._on_straight = inputs, on_straight
        self._periods = periods
        self._longest: dict[float, float] = {}
        self._classes: dict[str, Stability] = {}
        self._states = states
        lightest = model.system.bodies.mass[model.system.contact.body].min()
        self._guided = check_rail_step(model.check.check, float(lightest))
        self._wave = shortest_wave(track)
        self._braked = braked_step(model.system)
        self._slipping = slip_control_step(model.system)
        self.varies = settings.drive.mode != "constant"
        self.smallest = math.inf

    @property
    def too_long_below(self) -> float:
        """Speed below which a given step is too long for slip control [m/s]; 0 without either."""
        return 0.0 if self._settings.step is None else self.smallest / self._slipping

    def at(self, speed: float, rate: float = 0.0) -> tuple[float, int]:
        """Step [s] at `speed`, which changes at `rate`, and number of steps to the next output."""
        interval = self._settings.output_interval(speed)
        if self._settings.output_spacing is not None:
            interval = duration(self._settings.output_spacing, speed, rate)
        key = class_speed(speed) if self.varies else speed
        periods = self._periods if self._settings.step is None else ()
        longest = self._longest.get(key) or self._choose(key, self._settings.output_interval(key))
        self._longest[key] = longest
        if self._settings.step is None:
            elastic = bool(self._model.system.support.elastic)
            waves = self._model.wheels.longest_step(speed, self._wave, elastic=elastic)
            braked = self._braked * min(1.0, ROLLING_SHARE * speed / FULL_BRAKE_SPEED)
            limits = waves, self._guided, braked, self._slipping * speed, *periods
            longest = min(longest, *limits)
        every = max(1, math.ceil(interval / longest * (1.0 - 1e-9)))
        for finer in range(every, 2 * every + 1) if periods else ():
            shares = [every_period / interval * finer for every_period in periods]
            if all(abs(share - round(share)) < WRITTEN for share in shares):
                every = finer
                break
        self.smallest = min(self.smallest, interval / every)
        return interval / every, every

    def _choose(self, speed: float, interval: float) -> float:
        requested = self._settings.step
        if requested is None:
            inputs = f"{self._digest(self._model)} {speed!r} {interval!r}"
            step = solution("step", inputs, lambda: {"step": self._longest_stable(speed, interval)})
            return float(step["step"])
        if not self.varies:  # as written, perhaps with few digits
            requested = interval / max(1, round(interval / requested))
        if self._stability(self._model, speed, self._states.get(speed)).holds(requested):
            return requested
        stable = self._longest_stable(speed, interval)  # taken where none is given
        # a step is too long or not: growth at a shorter one comes from differences across a kink
        if requested <= stable:
            return requested
        found = f"found {requested:.12g} s, unstable at {speed:.12g} m/s"
        raise input_error("settings", found, f"at most {stable:g} s", "step")

    def _longest_stable(self, speed: float, interval: float) -> float:
        """Longest stable step at a speed that divides the output interval."""
        stability = self._stability(self._model, speed, self._states.get(speed))
        by_class = not len(self._model.system.loads.body)  # under which friction decides

        def holds(step: float) -> bool:
            nonlocal by_class
            if by_class and self._in_class(speed, step):
                return True
            if by_class and self._fails_in_class(speed, step):
                return False
            by_class = False  # its ends do not tell, for shorter steps neither
            return stability.holds(step, stability.margin)

        return stability.choose(interval, holds)

    def _digest(self, model: Model) -> str:
        """Hash of all that a model with some friction was made of."""
        system = model.system
        digest = hashlib.sha256(f"{self._inputs} {system.contact.values.shape}".encode())
        digest.update(system.track.rail[:, MU_LEFT : MU_RIGHT + 1, 0].tobytes())
        return digest.hexdigest()

    def _in_class(self, speed: float, step: float) -> bool:
        """Whether a step, with the margin, is stable for the class of a speed and the friction."""
        model = with_class_friction(self._model)
        return self._judge_once("class", model, class_speed(speed), step, Stability.holds)

    def _fails_in_class(self, speed: float, step: float) -> bool:
        """Whether a step is unstable on straight track at the highest speed and lowest friction."""
        model = with_class_friction(self._model, least=True)
        fastest = CLASS * class_speed(speed)

        def fails(stability: Stability, step: float, margin: float) -> bool:
            return not stability.holds_on_straight(step, margin)

        return self._judge_once("end of class", model, fastest, step, fails)

    def _judge_once(
        self,
        kind: str,
        model: Model,
        speed: float,
        step: float,
        judge: Callable[[Stability, float, float], bool],
    ) -> bool:
        """Judgement of a step, with the margin, at one end of a class; made once."""
        end = f"{kind} {self._digest(model)} {speed!r}"

        def judgement() -> dict[str, bool]:
            try:
                if end not in self._classes:
                    self._classes[end] = self._stability(model, speed, None, of_class=True)
                judged = self._classes[end]
                return {"holds": judge(judged, step, judged.margin)}
            except ModelError:  # no steady rolling there: the run's own speed is judged
                return {"holds": False}

        return _once("class", f"{end} {step!r}", judgement)

    def _stability(
        self, model: Model, speed: float, state: Floats | None, *, of_class: bool = False
    ) -> Stability:
        rolling = equilibrium(model, speed, self._inputs).state if state is None else state
        model = replace(model, system=with_steepest_dampers(model.system))
        level, uneven = level_track_with_friction(model.system), uneven_rigid_rails(model.system)
        level = level._replace(track=level.track._replace(has_irregularity=uneven))
        support = model.system.support
        if len(rows := support.variation):
            # judged on the stiffest rails; without masses, on the least damped ones: their rate is
            # (k_contact + k)/c, which `rk4` alone has to follow
            least = support.massless and self._settings.scheme == "rk4"
            factors = np.min(rows, axis=0) if least else np.max(rows, axis=0)
            support = support._replace(variation=factors[None])
            model = replace(model, system=model.system._replace(support=support))
            level = level._replace(support=support)
            with suppress(NotConverged):  # then where the vehicle stands on those without factor
                rolling = SteadyRolling(model, level).solve(rolling, speed)

        ends = [(speed, 0.0)]
        if of_class:
            ends += [(CLASS * speed, 0.5 * FRICTION_CLASS)]
        elif self.varies:
            ends += [(CLASS * speed, 0.0)]

        def curving(step: float) -> list[tuple[Situation, float]]:
            found = []
            begun = in_flange_contact(model, self._track, rolling, step, self._progress)
            begun += off_centre(model, self._track, level, rolling)
            if self._settings.step is None:  # loads may be short: a step that is asked for is taken
                begun += under_forces(model, level, rolling, step)
            for at in begun:
                found.append((at, 1.0))
                where = model, self._track, at
                for place in (at, *at_check_rails(*where), *at_narrowest_gauge(*where)):
                    near = place
                    for other in product(ends, less_friction(self._track)):
                        (end, less), part = other
                        if place is at and end == speed and not part.any():
                            continue
                        with suppress(NotConverged):  # then the others decide alone
                            beside = at_rest_with(model, near, end, less + part)
                            found.append((beside, 0.5))
                            near = place[0], beside[1]
            return found

        digest = hashlib.sha256(f"{self._on_straight} {speed!r}".encode() + rolling.tobytes())
        digest.update(level.track.rail[0, MU_LEFT : MU_RIGHT + 1].tobytes())

        def on_straight(h: float, judge: Callable[[], bool]) -> bool:
            """Judgement that tracks of other curves share."""
            return _once(
                "straight", f"{digest.hexdigest()} {h!r}", lambda: {"holds": bool(judge())}
            )

        shared: dict[str, Any] = {"on_straight": on_straight} if of_class else {}
        ringing = any(part.sets_wheels_ringing() for part in self._track.irregularities)
        shared["steady"] = not (ringing or self._track.sections or self._model.wheels.uneven)
        return Stability(model, level, rolling, self._settings.scheme, curving, **shared)


def _once(kind: str, key: str, judgement: Callable[[], dict[str, bool]]) -> bool:
    """A judgement that this process or another one has made, or that is made now."""
    key = f"{kind} {key}"
    if key not in _JUDGED:
        if len(_JUDGED) >= MOST_JUDGED:
            _JUDGED.clear()
        _JUDGED[key] = bool(solution(kind, key, judgement, shared=True)["holds"])
    return _JUDGED[key]


def class_speed(speed: float) -> float:
    """Return the lowest speed of the class of a speed [m/s].

    Examples
    --------
    >>> [round(class_speed(speed), 2) for speed in (18.5, 20.0, 22.0, 22.5)]
    [18.49, 18.49, 18.49, 22.19]
    """
    # that of a lowest speed is itself: a run of changing speed is judged at the ends of its class
    lowest: float = CLASS ** math.floor(math.log(speed, CLASS) + 1e-9)
    # at a standstill, which ends the run, there is no steady rolling
    return max(lowest, 1.02 * STANDSTILL_SPEED)


def with_class_friction(model: Model, *, least: bool = False) -> Model:
    """Return a model with the highest coefficients of friction of their class, or the `least`."""
    track = model.system.track
    rail = track.rail.copy()
    friction = rail[:, MU_LEFT : MU_RIGHT + 1, 0]
    number = np.maximum(np.ceil(friction / FRICTION_CLASS - 1e-9) - float(least), 0.0)
    rail[:, MU_LEFT : MU_RIGHT + 1, 0] = FRICTION_CLASS * number
    return replace(model, system=model.system._replace(track=track._replace(rail=rail)))


def less_friction(track: Track) -> Floats:
    """By how much friction along a track is less than the largest of each rail.

    float64[part, 2], left and right, in steps of a class, rising; the first part is zero.
    """
    rows = track.friction_table or ((0.0, *track.friction),)
    classes = np.ceil(np.array(rows)[:, 1:] / FRICTION_CLASS - 1e-9)
    less = FRICTION_CLASS * (classes.max(axis=0) - classes)
    return np.unique(np.vstack([np.zeros(2), less]), axis=0)


def braked_step(system: System) -> float:
    """Longest step with which brakes hold a locked wheelset still [s].

    Below the speed v = `BRAKES_FULLY` of its tread a torque M damps the spin by c = M r/v, and the
    spin alternates from z = h c/I = 1.7 on.  A commanded brake is taken at its limit, and not above
    what slides on dry rails.
    """
    drives, bodies = system.drives, system.bodies
    torque = np.zeros(len(bodies.kind))
    for e, w in enumerate(drives.body[:, 1]):
        torque[w] += max(0.0, -_torques(drives, e).min())
    acts, contact = system.actuators, system.contact
    for i in np.flatnonzero(acts.codes[:, MODE] == BY_BRAKE):
        w = acts.body[i, 1]
        dry = DRY * 2.0 * contact.load[contact.body == w].sum() * bodies.row[w, RADIUS]
        torque[w] += min(acts.row[i, LIMIT], dry)
    return _held_step(bodies, torque / FULL_BRAKE_SPEED)


def slip_control_step(system: System) -> float:
    """Longest step with which slip control holds its slip, over the vehicle's speed V [s2/m].

    A torque M that falls to 0 over the slips from a to b damps the spin by c = M r/((b - a) V).
    """
    drives = system.drives
    slope = np.zeros(len(system.bodies.kind))
    for e in map(int, np.flatnonzero(drives.row[:, SLIP_END] > 0.0)):
        band = drives.row[e, SLIP_END] - drives.row[e, SLIP_BEGIN]
        slope[drives.body[e, 1]] += np.abs(_torques(drives, e)).max() / band
    return _held_step(system.bodies, slope)


def _torques(drives: Drives, e: int) -> Floats:
    """Torques of a drive, those of its table times the factors of its demand, forwards positive."""
    first, demand, end = drives.start[2 * e : 2 * e + 3]
    factors = drives.table[demand:end, 1] if end > demand else np.ones(1)
    torque: Floats = np.outer(drives.table[first:demand, 1], factors)
    return -torque if drives.row[e, BRAKES] > 0.0 else torque


def _held_step(bodies: Bodies, slope: Floats) -> float:
    """Longest step with torques that fall by `slope` over the tread's speed [N m/(m/s)]."""
    held = np.flatnonzero(slope)
    rate = slope[held] * bodies.row[held, RADIUS] / bodies.inertia[held, 1]
    return HELD / float(rate.max()) if len(held) else math.inf


def with_steepest_dampers(system: System) -> System:
    """Return the system with dampers that are as steep at rest as their tables are elsewhere."""
    links, curves = system.links, system.curves
    row, curve = links.row.copy(), links.curve.copy()
    for e in np.flatnonzero(curve[:, 1] >= 0):
        first, end = curves.start[curve[e, 1] : curve[e, 1] + 2]
        speed, force = curves.x[first:end], curves.f[first:end]
        slope = np.diff(force) / np.diff(speed)
        at_rest = np.clip(np.searchsorted(speed, 0.0, side="right") - 1, 0, len(slope) - 1)
        if slope.max() > slope[at_rest]:
            row[e, LINK_COLUMNS["damping"]] += slope.max()
            curve[e, 1] = -1
    return system._replace(links=links._replace(row=row, curve=curve))


def check_rail_step(check: Floats, mass: float) -> float:
    """Longest step that follows a wheelset on check rails [s]; `mass`: of the lightest one [kg].

    On the damping c of a rail steps are stable up to h c/m = 1, on its stiffness k up to
    h sqrt(k/m) = 2, and forces are right well below; the judged map knows no check rails.
    """
    rate = check[:, DAMPING] / mass / GUIDED[0], np.sqrt(check[:, STIFFNESS] / mass) / GUIDED[1]
    return float(np.min(1.0 / np.maximum(*rate), initial=math.inf))


def inputs_hash(
    vehicle: Vehicle, track: Track, settings: Settings, model: Model, *, straight: bool = False
) -> str:
    """Return a hash of all that a model was made of, except for the friction of its track.

    `straight`: without the alignment either, and what the track is called.
    """
    digest = hashlib.sha256()
    apart = {"outputs"} if settings.own_creep_law or settings.own_friction else {"outputs", "laws"}
    left_out = {"friction", "friction_table"} | (ALIGNMENT if straight else set())
    texts = (
        vehicle.to_toml(),
        track.model_dump_json(exclude=left_out),
        settings.model_dump_json(exclude=apart),
    )
    for part in (*texts, *sorted(model.profiles)):
        digest.update(part.encode())
    for name in sorted(model.profiles):
        digest.update(model.profiles[name].key())
    return digest.hexdigest()


def duration(distance: float, speed: float, rate: float) -> float:
    """Time to cover `distance` at a speed that changes at `rate` [s]; without it if that stops."""
    square = speed**2 + 2.0 * rate * distance
    return 2.0 * distance / (speed + math.sqrt(square)) if square > 0.0 else distance / speed
