"""Everything that a mechanism file asks for, computed: `analyse` is where to begin reading."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism.definition import Mechanism
from railsim.errors import argument_error, nearest
from railsim.mechanisms.cams import Transition, transitions
from railsim.mechanisms.contact import Contact, Rest, contact_of, positions_of_rest
from railsim.mechanisms.dynamics import FreeMotion, TimedMotion, driven_motion, free_motion
from railsim.mechanisms.forces import Rates, actuator_force, generalised_force, reactions
from railsim.mechanisms.inversion import largest, zeros
from railsim.mechanisms.kinematics import Motion, check_freedom, driver_words, folded, solve
from railsim.mechanisms.model import Model, build
from railsim.mechanisms.outputs import check_pressure, outputs, sampling_positions, zone_drivers

DENSE = 401  # positions from which heights and lengths are looked up


@dataclass(frozen=True)
class Extremes:
    """Least and largest value of a result between start and end, and the driver's values there."""

    least: float
    least_at: float
    most: float
    most_at: float


@dataclass(frozen=True)
class Reaction:
    """Largest reaction of a joint [N], the driver's value there, and all its components."""

    max: float
    at: float
    components: Floats


@dataclass(frozen=True)
class Analysis:
    """Results of a mechanism."""

    definition: Mechanism  # with the parameters of its case
    model: Model  # the same as arrays
    motion: Motion  # positions
    output: dict[str, Floats]  # results at these positions, SI; names and units in `quantities`
    zone: dict[str, dict[str, float]]  # the same at low, work and high height
    force_zeros: tuple[float, ...]  # values of the driver where the unknown force changes its sign
    rests: tuple[Rest, ...]  # positions of rest of a mechanism without an unknown
    reactions: dict[str, Reaction]  # by joint
    transitions: tuple[Transition, ...]  # changes of rollers from arc to arc
    contact: Contact | None  # results of the tables [contact], [motion], [release]
    timed: TimedMotion | None
    release: FreeMotion | None
    case: str | None = None
    known: dict[str, Extremes] = field(default_factory=dict, repr=False, compare=False)
    near: dict[bytes, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def equilibria(self) -> tuple[tuple[float, bool], ...]:
        """Positions of rest of a mechanism without an unknown, each with its stability."""
        return tuple((rest.at, rest.stable) for rest in self.rests)

    @property
    def travel(self) -> float:
        """Range of the driver [rad or m]."""
        return self.model.end - self.model.start

    @property
    def stroke(self) -> float:
        """Range of the actuator's length, NaN where there is no such actuator [m]."""
        if "length" not in self.output:
            return np.nan
        length = self.extremes("length")
        return length.most - length.least

    @property
    def max_force(self) -> float:
        """Largest force of the unknown actuator, with its sign [N]."""
        return self.extremes("force").most if "force" in self.output else np.nan

    @property
    def min_force(self) -> float:
        """Least force of the unknown actuator, with its sign [N]."""
        return self.extremes("force").least if "force" in self.output else np.nan

    @property
    def peak_force(self) -> float:
        """Largest amount of the unknown force in either sense, on the way and on the way back."""
        least, most = either_way(self, "force")
        return max(-least, most)

    @property
    def min_angles(self) -> dict[str, float]:
        """Smallest of every named angle, folded [rad]."""
        return {name: self.extremes(name, folded).least for name in self.definition.angles}

    def extremes(self, name: str, of: Callable[[Any], Any] = np.asarray) -> Extremes:
        """Least and largest value of a result, also between the positions of `output`."""
        if name not in self.known:
            motion, values = self._dense

            def values_at(m: Motion) -> Any:
                # many results have their extremes at an end, the same positions
                key = m.s.tobytes()
                self.near[key] = self.near.get(key) or outputs(m)
                return of(self.near[key][name])

            least, of_least = largest(motion, lambda m: -values_at(m), -of(values[name]))
            most, of_most = largest(motion, values_at, of(values[name]))
            self.known[name] = Extremes(-of_least, least, of_most, most)
        return self.known[name]

    @cached_property
    def _dense(self) -> tuple[Motion, dict[str, Floats]]:
        """Positions from which results are looked up in between, with their values there."""
        if len(self.motion.s) >= DENSE:
            return self.motion, self.output
        motion = solve(self.model, np.linspace(self.model.start, self.model.end, DENSE))
        return motion, outputs(motion)

    def at(self, quantity: str, value: float) -> dict[str, float]:
        """All results at the first position where one of them has a value; see `everywhere`."""
        return self.everywhere(quantity, value)[0]

    def result(self, quantity: str) -> Floats:
        """Return a result of `output` by its name; raises InputError: there is none."""
        if quantity not in self.output:
            found = f"no result '{quantity}'"
            raise argument_error("at", found, nearest(quantity, self.output), key=quantity)
        return self.output[quantity]

    def everywhere(self, quantity: str, value: float) -> list[dict[str, float]]:
        """All results at every position, from start to end, where one of them has a value.

        Of a stretch on which it keeps the value, the first position.

        Raises InputError: there is no such result, or it never has this value.
        """
        self.result(quantity)
        dense, values = self._dense[0], self._dense[1][quantity]
        low, high = np.nanmin(values), np.nanmax(values)
        s = zeros(dense, lambda motion: outputs(motion)[quantity] - value) or [self.model.start]
        results = outputs(solve(self.model, s))
        # where it jumps over the value it does not have it
        near = 1e-6 * max(high - low, abs(value))
        rows = np.flatnonzero(np.abs(results[quantity] - value) <= near)
        if not len(rows):
            found, allowed = f"{value:g} is never reached", f"{low:.6g} to {high:.6g}"
            raise argument_error("at", found, allowed, key=quantity)
        return [{name: float(array[k]) for name, array in results.items()} for k in rows]


def either_way(result: Analysis, name: str) -> tuple[float, float]:
    """Least and largest value, with friction on the way and on the way back; NaN for none."""
    ways = [result.extremes(way) for way in (name, f"{name}_back") if way in result.output]
    least = min((way.least for way in ways), default=np.nan)
    return least, max((way.most for way in ways), default=np.nan)


def analyse(definition: Mechanism, case: str | None = None) -> Analysis:
    """Compute a mechanism: kinematics, forces, reactions, contact force, motion in time.

    Parameters
    ----------
    definition : Mechanism
        What the file says.
    case : str, optional
        Name of one of its cases; by default the base.

    Raises
    ------
    InputError
        What the mechanism cannot do, with joint or key and the driver's value.

    Examples
    --------
    >>> from railsim.definitions.loading import load_mechanism
    >>> result = analyse(load_mechanism("atr95_lift_5"))
    >>> print(f"{result.stroke * 1e3:.3f} mm, {result.max_force:.0f} N")
    113.668 mm, 9803 N
    """
    definition = definition.in_case(case)
    model = build(definition)
    check_freedom(model)
    dense = solve(model, np.linspace(model.start, model.end, DENSE))
    motion = solve(model, sampling_positions(dense))
    output = outputs(motion)
    check_pressure(motion, output)
    at_zone = zone_drivers(dense)
    in_zone = outputs(solve(model, list(at_zone.values()))) if at_zone else {}
    zone = {n: {k: float(v[i]) for k, v in in_zone.items()} for i, n in enumerate(at_zone)}
    rates = Rates(friction=model.sense)
    timed = driven_motion(dense) if definition.motion is not None else None
    forced = definition.solve is not None and np.any(generalised_force(dense, rates))
    turned = zeros(dense, lambda m: generalised_force(m, rates)) if forced else ()
    forces = tuple(turned), positions_of_rest(dense), _reactions(motion, dense)
    found = *forces, transitions(dense), contact_of(dense, motion, at_zone), timed, _release(model)
    return Analysis(definition, model, motion, output, zone, *found, case)


def _reactions(motion: Motion, dense: Motion) -> dict[str, Reaction]:
    definition, found = motion.model.definition, {}
    rows = _multipliers(motion)
    everywhere, whole = (rows, motion) if len(motion.s) >= DENSE else (_multipliers(dense), dense)
    for name, reaction in everywhere.items():
        # the second row of a prismatic joint is a torque
        sized = reaction[:, :1] if hasattr(definition.joints[name], "prismatic") else reaction
        size = np.sqrt(np.sum(sized**2, axis=1))
        k = int(np.argmax(size))
        found[name] = Reaction(float(size[k]), float(whole.s[k]), rows[name])
    return found


def _multipliers(motion: Motion) -> dict[str, Any]:
    """Reactions of all joints while the mechanism is held, with friction of the way on."""
    held, rates = motion.model.definition.solve, Rates(friction=motion.model.sense)
    force = {} if held is None else {held.unknown: actuator_force(motion, held.unknown, rates)}
    return reactions(motion, force, rates)[0]


def _release(model: Model) -> FreeMotion | None:
    release = model.definition.release
    if release is None:
        return None
    start, until = model.number(release.start), model.number(release.until)
    low, high = sorted((model.start, model.end))
    for key, value in (("start", start), ("until", until)):
        if not low - 1e-12 <= value <= high + 1e-12:
            allowed = f"{driver_words(model, low)} to {driver_words(model, high)}"
            raise model.refusal(f"release.{key}", driver_words(model, value), allowed)
    return free_motion(model, start, until, model.number(release.duration))
