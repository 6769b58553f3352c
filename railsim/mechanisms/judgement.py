"""Objective and constraints of an optimisation with exact gradients, for one set of parameters.

The objectives of `[optimise]` are sums of squares of residuals, but for the peak of the force:

    follow          ratio less that of the reference at the same height of the output
    constant        ratio less a wanted one
    linear          ratio less one that changes linearly with the height
    constant_force  force over its mean, less 1
    peak_force      largest amount of the force

Constraints that hold at every position are kept at a few of them, and where `Judge.least` finds
their least values between these: the exchange method of semi-infinite programming (R. Hettich,
K. O. Kortanek, Semi-infinite programming, SIAM Review 35, 1993).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.mechanism.definition import Mechanism, Optimise
from railsim.definitions.mechanism.parts import AirSpring, Cylinder, GasSpring
from railsim.definitions.mechanism.values import ends, number, parameter_values
from railsim.errors import Fault, Faults
from railsim.mechanisms.forces import Rates, generalised_force, unit_work
from railsim.mechanisms.inversion import largest
from railsim.mechanisms.kinematics import Motion, derivative, solve, tangents
from railsim.mechanisms.model import Model, build, with_lanes
from railsim.mechanisms.outputs import length_points
from railsim.mechanisms.targets import Positions, drivers_at_heights, positions

FEASIBLE = 1e-7  # breach of a constraint, in its scale, that counts as none
GRID = 17  # positions over the whole travel at which constraints are held
DENSE = 201  # positions from which the least values between them are looked for
RIVAL = 1e-6  # share of the peak by which positions with as large a force may differ
IMPOSSIBLE = 10.0
"""What a breach counts more where nothing moves: dead points, gas springs beyond their strokes."""
SLOWEST = 0.05
"""Smallest rate of the actuator against its mean, and of the driver: away from dead points."""


@dataclass(frozen=True)
class Judgement:
    """Objective and constraints of one set of parameters, with their derivatives by these."""

    residuals: Floats  # of the sum of squares, (residual,)
    jacobian: Floats  # (residual, parameter)
    amounts: Floats  # whose largest is added to the sum of squares, (position,)
    amount_slopes: Floats  # (position, parameter)
    margins: Floats  # in units of each constraint's scale; negative where broken, (constraint,)
    slopes: Floats  # (constraint, parameter)
    firm: Any = False  # constraints without which nothing moves, (constraint,)

    @property
    def objective(self) -> float:
        """What is to be small."""
        return float(self.residuals @ self.residuals) + self.peak

    @property
    def peak(self) -> float:
        """What is added to the sum of squares."""
        return float(np.max(self.amounts))

    @property
    def square_gradient(self) -> Floats:
        """Derivatives of the sum of squares by the parameters."""
        found: Floats = 2.0 * self.jacobian.T @ self.residuals
        return found

    @property
    def rivals(self) -> Floats:
        """Gradients of all positions with as large an amount, (rival, parameter)."""
        return self.amount_slopes[self.amounts >= (1.0 - RIVAL) * self.peak]

    @property
    def violation(self) -> float:
        """Largest breach of a constraint in its own scale; 0 where all are kept."""
        return float(max(0.0, np.max(breach(self.margins, self.firm), initial=0.0)))


def is_firm(name: str) -> bool:
    """Whether a mechanism that breaks a constraint cannot move at all."""
    return name != "max_stroke" and name.endswith(("dead_point", "_stroke"))


def breach(margin: Any, firm: Any) -> Any:
    """Breach of a constraint in its own scale, `IMPOSSIBLE` more of a firm one."""
    return -margin + IMPOSSIBLE * ((margin < -FEASIBLE) & firm)


class Judge:
    """Judges sets of parameters of a mechanism.

    `names`: Parameters that may change. `lower`, `upper` (shape (parameter,)): Their bounds.
    `labels`: Name of every constraint and its scale, in SI. `definition`: With a table [optimise].
    `every`: Take every so many of the positions only, each with as much more weight.
    """

    def __init__(self, definition: Mechanism, every: int = 1) -> None:
        assert definition.optimise is not None
        self.definition = definition
        self.problem: Optimise = definition.optimise
        self.names = list(self.problem.bounds)
        self.values = parameter_values(definition)
        bounds = [[number(b, self.values) for b in self.problem.bounds[n]] for n in self.names]
        self.lower, self.upper = np.array(bounds, dtype=float).T
        self.unknown = definition.held_by
        self.pair = length_points(definition)
        self.output = definition.output.point if definition.output is not None else None
        kind = self.problem.objective
        self.weights = {kind: 1.0} if isinstance(kind, str) else dict(kind)
        # over the whole travel, wherever that takes the output, or at heights of the output
        everywhere = self.problem.range == "travel" and "follow" not in self.weights
        self.by_share = self.output is None or everywhere
        self._check_length()
        full = positions(definition)
        self.every = every
        self.positions = Positions(full.s[::every], full.height[::every], full.ratio[::every])
        self.labels: list[tuple[str, float]] = []
        # whatever the parameters are: a friction of 0 may be a bound
        sizes = [
            getattr(e, "friction", getattr(e, "moment", 0.0)) for e in definition.elements.values()
        ]
        self.rubs = any(size != 0.0 for size in sizes)
        numbers = [n for n, text in definition.parameters.items() if not isinstance(text, str)]
        self.fixed = {n: self.values[n] for n in numbers if n not in self.names}

    def _check_length(self) -> None:
        """Refuse what needs the length of an actuator or an output where there is none."""
        problem, found = self.problem, []
        if self.pair is None or self.output is None:
            missing = "no actuator between two points, or no [output]"
            ratios = self.weights.keys() & {"follow", "constant", "linear"}
            found = [("objective", f"'{kind}': {missing}") for kind in sorted(ratios)]
        if self.pair is None:
            keys = [k for k in ("min_length", "max_stroke") if getattr(problem, k) is not None]
            found += [(key, "no actuator between two points") for key in keys]
        remedy = "[solve] must name one; 'peak_force' and 'constant_force' do without"
        name = self.definition.name
        Faults(Fault(name, f"optimise.{key}", words, remedy) for key, words in found).check()

    def by_name(self, x: Sequence[float] | Floats) -> dict[str, float]:
        """Values of the parameters that may change, by their names."""
        return dict(zip(self.names, map(float, x), strict=True))

    def point_of(self, values: Mapping[str, Any]) -> tuple[Floats, dict[str, float]]:
        """Those of some values that may change, and those that choose an assembly."""
        choice = {name: float(values[name]) for name in self.problem.assemblies}
        return np.array([float(values[name]) for name in self.names]), choice

    def model(self, x: Sequence[float] | Floats, choice: dict[str, float]) -> Model:
        """The model with its lanes for values of the parameters that may change."""
        return build(self.definition, {**self.fixed, **choice, **with_lanes(self.by_name(x))})

    def real_model(self, x: Sequence[float] | Floats, choice: dict[str, float]) -> Model:
        """The same without lanes."""
        return build(self.definition, {**self.fixed, **choice, **self.by_name(x)})

    def grid(self, model: Model, extra: Sequence[float] = ()) -> Floats:
        """Values of the driver at which constraints are held; `extra` are shares of the travel."""
        shares = np.sort(np.concatenate((np.linspace(0.0, 1.0, GRID), extra)))
        return model.start + shares * (model.end - model.start)

    def __call__(
        self, x: Floats, choice: dict[str, float], extra: Sequence[float] = ()
    ) -> Judgement:
        """Judge values of the parameters; raises InputError: the links cannot be assembled."""
        laned = self.model(x, choice)
        model = laned.real()
        grid = self.grid(model, extra)
        if self.by_share:
            s = model.start + (model.end - model.start) * self.positions.share
        else:
            s = drivers_at_heights(model, self.positions.height, self.positions.s)
        both = np.concatenate((grid, s))
        later = np.repeat((0, 1), (len(grid), len(s)))
        at_height = (later == 1) & (not self.by_share)  # whatever the ends of the range are
        drift = np.where(at_height, 0.0, laned.drift(both))
        later[len(grid) - 1] = 2  # of equal values the range's own are the first and the last
        order = np.lexsort((later, model.sense * both))
        motion = tangents(solve(model, both[order]), laned, drift=drift[..., order], second=False)
        rank = np.argsort(order, kind="stable")
        return self._judge(motion, model, rank[: len(grid)], rank[len(grid) :])

    def least(
        self, x: Floats, choice: dict[str, float], near: float = 0.02
    ) -> dict[str, tuple[float, float]]:
        """Least margin of every constraint over the travel, and the share of the travel there.

        Margins above `near` are not refined between the known positions.
        """
        model = self.real_model(x, choice)
        motion = solve(model, np.linspace(model.start, model.end, DENSE))
        least: dict[str, tuple[float, float]] = {}
        for i, (name, _, margins) in enumerate(self._everywhere(motion)):

            def less(m: Motion, i: int = i) -> Any:
                return -next(row for k, row in enumerate(self._everywhere(m)) if k == i)[2]

            k = int(np.argmin(margins))
            place, margin = float(motion.s[k]), float(margins[k])
            if margin < near:
                place, negative = largest(motion, less, -margins)
                margin = -negative
            if name not in least or margin < least[name][0]:
                least[name] = margin, (place - model.start) / (model.end - model.start)
        return least

    def _judge(self, motion: Motion, model: Model, grid: Any, zone: Any) -> Judgement:
        force = self._force(motion)
        ratio = 0.0 * force
        if self.pair is not None and self.output is not None:
            along = motion.point(self.output)[1][..., model.axis]
            ratio = along / motion.length(self.pair)[1]
        height: Any = self.positions.height
        if self.by_share and self.output is not None:
            along = motion.point(self.output)[0][..., model.axis]
            height = along[..., zone] - along[..., :1]
        ratio, force_zone = self._at_height(motion, model, zone, ratio, force)
        whole = [force[..., grid]]
        if self.rubs:
            whole.append(self._force(motion, -1)[..., grid])
        residuals, amounts = self._objective(
            height, ratio, force_zone, np.concatenate(whole, axis=-1)
        )
        margins = self._margins(motion, grid)
        firm = np.array([is_firm(name) for name, _ in self.labels], dtype=bool)
        return Judgement(
            np.real(residuals)[0], derivative(residuals).T,
            np.real(amounts)[0], derivative(amounts).T,
            np.real(margins)[0], derivative(margins).T, firm,
        )  # fmt: skip

    def _at_height(
        self, motion: Motion, model: Model, zone: Any, ratio: Any, force: Any
    ) -> tuple[Any, Any]:
        """Ratio and force in the zone at fixed heights, where parameters move the driver.

        `d/dp at constant y = d/dp - (d/ds) (dy/dp)/y'`.
        """
        if self.by_share or self.output is None:
            return ratio[..., zone], force[..., zone]
        r, _, _ = motion.point(self.output)
        k = model.axis
        drift = np.imag(r[..., zone, k] - r[..., :1, k])
        if not np.any(drift):
            return ratio[..., zone], force[..., zone]
        real = solve(model, np.real(motion.s[0, zone]))
        _, y1, y2 = real.point(self.output)
        slope: Any = 0.0
        if self.pair is not None:
            _, w, w1 = real.length(self.pair)
            slope = (y2[:, k] * w - y1[:, k] * w1) / w**2
        shift = drift / y1[:, k]
        h = 1e-6 * (motion.model.end - motion.model.start)
        known = [self._force(solve(real.model, real.s + d)) for d in (-h, h)]
        bend = (known[1] - known[0]) / (2.0 * h)
        return ratio[..., zone] - 1j * slope * shift, force[..., zone] - 1j * bend * shift

    def _force(self, motion: Motion, way: int = 1) -> Any:
        """Unknown force on the way from start to end, or back, shape (lane, position)."""
        rates = Rates(friction=way * motion.model.sense, trial=True)
        return motion.once(
            ("unknown force", way),
            lambda: -generalised_force(motion, rates) / unit_work(motion, self.unknown),
        )

    def _objective(self, height: Any, ratio: Any, force: Any, whole: Any) -> tuple[Any, Any]:
        """Residuals, shape (lane, residual); amounts whose largest is added to their squares."""
        parts, peaks = [], np.zeros((len(ratio), 1), dtype=complex)
        for kind, weight in self.weights.items():
            root = np.sqrt(weight * self.every)
            if kind == "follow":
                parts.append(root * (ratio - self.positions.ratio))
            elif kind in ("constant", "linear"):
                assert self.problem.target is not None
                target = number(self.problem.target, self.values)
                if kind == "linear":
                    slope = number(self.problem.slope, self.values)
                    target = target + slope * height
                parts.append(root * (ratio - target))
            elif kind == "constant_force":
                parts.append(root * (force / np.mean(force, axis=-1, keepdims=True) - 1.0))
            else:
                both = np.concatenate((whole, force), axis=-1)
                peaks = weight * np.sign(np.real(both[0])) * both
        if not parts:
            parts = [np.zeros((len(ratio), 1), dtype=complex)]
        return np.concatenate(parts, axis=-1), peaks

    def _margins(self, motion: Motion, grid: Any) -> Any:
        """Margins of all constraints, shape (lane, constraint), and their labels."""
        found = [(name, scale, m[..., grid]) for name, scale, m in self._everywhere(motion)]
        if self.problem.max_stroke is not None:
            assert self.pair is not None
            length = motion.length(self.pair)[0][..., grid]
            stroke = length[..., -1:] - length[..., :1]
            stroke = np.where(np.real(stroke) > 0.0, 1.0, -1.0) * stroke
            found.append(("max_stroke", 1.0, motion.model.number(self.problem.max_stroke) - stroke))
        self.labels = [(name, scale) for name, scale, m in found for _ in range(m.shape[-1])]
        return np.concatenate([margin for _, _, margin in found], axis=-1)

    def _everywhere(self, motion: Motion) -> Iterator[tuple[str, float, Any]]:
        """Constraints at all positions: name, scale, margins of shape (..., position)."""
        n, problem = motion.model.number, self.problem
        if problem.min_transmission_angle is not None:
            limit = n(problem.min_transmission_angle)
            for name, angle in motion.model.definition.angles.items():
                if angle.limited:
                    sine = np.sin(motion.angle(name))
                    # (sin^2 mu - sin^2 limit)/sin(2 limit): smooth, and the angle near the limit
                    yield name, 1.0, (sine * sine - np.sin(limit) ** 2) / np.sin(2.0 * limit)
        if self.pair is not None:
            length, rate, _ = motion.length(self.pair)
            if problem.min_length is not None:
                yield "min_length", 1.0, length - n(problem.min_length)
            mean = (length[..., -1:] - length[..., :1]) / (motion.s[..., -1:] - motion.s[..., :1])
            yield "dead_point", 1.0, rate / mean - SLOWEST
            yield "dead_point", 1.0, 1.0 - SLOWEST * rate / mean  # of the driver
        if self.pair is None or ends(self.unknown) != self.pair:
            work = unit_work(motion, self.unknown)
            yield "dead_point", 1.0, work / np.mean(work, axis=-1, keepdims=True) - SLOWEST
        yield from self._forces(motion)
        yield from self._strokes(motion)
        for i, box in enumerate(problem.envelope):
            for point in box.points:
                r = motion.point(point)[0]
                for axis, limits in ((0, box.x), (1, box.y)):
                    if limits is not None:
                        low, high = (n(x) for x in limits)
                        yield f"envelope.{i}", 1.0, r[..., axis] - low
                        yield f"envelope.{i}", 1.0, high - r[..., axis]

    def _forces(self, motion: Motion) -> Iterator[tuple[str, float, Any]]:
        """The available force in both senses; what can only push must not pull."""
        limit, unknown = self.problem.available_force, self.unknown
        one_sided = isinstance(unknown, AirSpring) or (
            isinstance(unknown, Cylinder) and unknown.acts != "both"
        )
        if limit is None:
            return
        available = motion.model.number(limit)
        scale = float(np.ravel(np.real(available))[0])
        for way in (1, -1) if self.rubs else (1,):
            force = self._force(motion, way)
            yield "available_force", scale, (available - force) / scale
            if one_sided:
                yield "pulls", scale, force / scale
            else:
                yield "available_force", scale, (available + force) / scale

    def _strokes(self, motion: Motion) -> Iterator[tuple[str, float, Any]]:
        """Gas springs that what is searched for may take beyond their strokes."""
        n = motion.model.number
        for name, part in self.definition.elements.items():
            if isinstance(part, GasSpring):
                compressed = n(part.extended) - motion.length(part.gas_spring)[0]
                yield f"{name}_stroke", 1.0, compressed
                yield f"{name}_stroke", 1.0, n(part.stroke) - compressed
