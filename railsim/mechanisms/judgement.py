"""Objective and constraints of an optimisation with exact gradients, for one set of parameters.

The objectives of `[optimise]` are sums of squares of residuals, but for the peak of the force:

    follow          ratio less that of the reference at the same height of the output
    constant        ratio less a wanted one
    linear          ratio less one that changes linearly with the height
    constant_force  force over its mean, less 1
    peak_force      largest force
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railsim.definitions.mechanism import Mechanism, Optimise
from railsim.definitions.mechanism_values import ends, number, parameter_values
from railsim.errors import Fault, InputError
from railsim.mechanisms.analysis import actuator_of
from railsim.mechanisms.forces import generalised_force, unit_work
from railsim.mechanisms.kinematics import Motion, derivative, solve, tangents
from railsim.mechanisms.model import Model, build, with_lanes
from railsim.mechanisms.targets import Positions, drivers_at_heights, positions

Floats = NDArray[np.float64]
GRID = 17
"""Positions over the whole travel at which constraints are held."""
SLOWEST = 0.05
"""Smallest rate of the actuator against its mean: keeps a search away from dead points."""


@dataclass(frozen=True)
class Judgement:
    """Objective and constraints of one set of parameters.

    Attributes
    ----------
    objective : float
    residuals, jacobian : ndarray, shapes (residual,), (residual, parameter)
        Of the sum of squares.
    peak, peak_gradient : float, ndarray of shape (parameter,)
        What is added to the sum of squares.
    margins, slopes : ndarray, shapes (constraint,), (constraint, parameter)
        In units of each constraint's scale; negative where it is broken.
    """

    residuals: Floats
    jacobian: Floats
    peak: float
    peak_gradient: Floats
    margins: Floats
    slopes: Floats

    @property
    def objective(self) -> float:
        """What is to be small."""
        return float(self.residuals @ self.residuals) + self.peak

    @property
    def gradient(self) -> Floats:
        """Its derivatives by the parameters."""
        found: Floats = 2.0 * self.jacobian.T @ self.residuals + self.peak_gradient
        return found

    @property
    def violation(self) -> float:
        """Largest breach of a constraint in its own scale; 0 where all are kept."""
        return float(max(0.0, -np.min(self.margins, initial=0.0)))


class Judge:
    """Judges sets of parameters of a mechanism.

    Parameters
    ----------
    definition : Mechanism
        With a table [optimise].
    every : int
        Take every so many of the positions only, each with as much more weight.

    Attributes
    ----------
    names : list of str
        Parameters that may change.
    lower, upper : ndarray, shape (parameter,)
        Their bounds.
    labels : list of (str, float)
        Name of every constraint and its scale, in SI.
    """

    def __init__(self, definition: Mechanism, every: int = 1) -> None:
        assert definition.optimise is not None
        assert definition.output is not None
        self.definition = definition
        self.wanted: Optimise = definition.optimise
        self.names = list(self.wanted.bounds)
        self.values = parameter_values(definition)
        bounds = [[number(b, self.values) for b in self.wanted.bounds[n]] for n in self.names]
        self.lower, self.upper = np.array(bounds, dtype=float).T
        name = actuator_of(definition)
        pair = ends(definition.actuators[name]) if name is not None else None
        if name is None or pair is None:
            found = "no actuator between two points"
            raise InputError([Fault(definition.name, "optimise", found, "[solve] must name one")])
        self.actuator, self.pair = name, pair
        self.output = definition.output.point
        kind = self.wanted.objective
        self.weights = {kind: 1.0} if isinstance(kind, str) else dict(kind)
        full = positions(definition)
        self.every = every
        self.positions = Positions(full.s[::every], full.height[::every], full.ratio[::every])
        self.labels: list[tuple[str, float]] = []
        self.fixed = {
            n: self.values[n]
            for n, written in definition.parameters.items()
            if not isinstance(written, str) and n not in self.names
        }

    def model(self, x: Sequence[float] | Floats, choice: dict[str, float]) -> Model:
        """The model with its lanes for values of the parameters that may change."""
        values = dict(zip(self.names, map(float, x), strict=True))
        return build(self.definition, {**self.fixed, **choice, **with_lanes(values)})

    def grid(self, model: Model) -> Floats:
        """Values of the driver at which constraints are held."""
        return np.linspace(model.start, model.end, GRID)

    def __call__(self, x: Floats, choice: dict[str, float]) -> Judgement:
        """Judge values of the parameters.

        Raises
        ------
        InputError : the links cannot be assembled over the whole travel.
        """
        moved = self.model(x, choice)
        model = moved.real()
        grid = self.grid(model)
        s = drivers_at_heights(model, self.positions.height, self.positions.s)
        both = np.concatenate((grid, s))
        order = np.argsort(both, kind="stable")
        if model.end < model.start:
            order = order[::-1]
        motion = tangents(solve(model, both[order]), moved, second=False)
        rank = np.argsort(order, kind="stable")
        return self._judged(motion, model, rank[:GRID], rank[GRID:])

    def _judged(self, motion: Motion, model: Model, grid: Any, zone: Any) -> Judgement:
        length, rate, _ = motion.length(self.pair)
        _, r1, _ = motion.point(self.output)
        definition = motion.model.definition
        assert definition.solve is not None
        unknown = definition.solve.unknown
        work = unit_work(motion, definition.actuators[unknown])
        force = -generalised_force(motion) / work
        ratio = r1[..., 1] / rate
        ratio, force_zone = self._at_height(motion, model, zone, ratio, force)
        residuals, peak = self._objective(ratio, force_zone, force[..., grid])
        margins = self._margins(motion, grid, length[..., grid], rate[..., grid], force[..., grid])
        return Judgement(
            np.real(residuals)[0],
            derivative(residuals).T,
            float(np.real(peak)[0]),
            derivative(peak),
            np.real(margins)[0],
            derivative(margins).T,
        )

    def _at_height(
        self, motion: Motion, model: Model, zone: Any, ratio: Any, force: Any
    ) -> tuple[Any, Any]:
        """Ratio and force in the zone at fixed heights, where parameters move the driver.

        `d/dp at constant y = d/dp - (d/ds) (dy/dp)/y'`.
        """
        r, _, _ = motion.point(self.output)
        first = motion.point(self.output)[0][..., :1, 1]
        drift = np.imag(r[..., zone, 1] - first)
        if not np.any(drift):
            return ratio[..., zone], force[..., zone]
        real = solve(model, np.real(motion.s[0, zone]))
        _, y1, y2 = real.point(self.output)
        _, w, w1 = real.length(self.pair)
        slope = (y2[:, 1] * w - y1[:, 1] * w1) / w**2
        shift = drift / y1[:, 1]
        h = 1e-6 * (motion.model.end - motion.model.start)
        known = [self._force(solve(real.model, real.s + d)) for d in (-h, h)]
        bend = (known[1] - known[0]) / (2.0 * h)
        return ratio[..., zone] - 1j * slope * shift, force[..., zone] - 1j * bend * shift

    def _force(self, motion: Motion) -> Any:
        definition = motion.model.definition
        assert definition.solve is not None
        work = unit_work(motion, definition.actuators[definition.solve.unknown])
        return -generalised_force(motion) / work

    def _objective(self, ratio: Any, force: Any, whole: Any) -> tuple[Any, Any]:
        """Residuals, shape (lane, residual), and what is added to their squares, (lane,)."""
        parts, peak = [], np.zeros(len(ratio), dtype=complex)
        number_of = self.values
        for kind, weight in self.weights.items():
            root = np.sqrt(weight * (1.0 if kind == "peak_force" else self.every))
            if kind == "follow":
                parts.append(root * (ratio - self.positions.ratio))
            elif kind in ("constant", "linear"):
                assert self.wanted.target is not None
                target = number(self.wanted.target, number_of)
                if kind == "linear":
                    slope = number(self.wanted.slope, number_of)
                    target = target + slope * self.positions.height
                parts.append(root * (ratio - target))
            elif kind == "constant_force":
                parts.append(root * (force / np.mean(force, axis=-1, keepdims=True) - 1.0))
            else:
                both = np.concatenate((whole, force), axis=-1)
                peak = peak + weight * both[:, int(np.argmax(np.real(both[0])))]
        if not parts:
            parts = [np.zeros((len(ratio), 1), dtype=complex)]
        return np.concatenate(parts, axis=-1), peak

    def _margins(self, motion: Motion, grid: Any, length: Any, rate: Any, force: Any) -> Any:
        """Margins of all constraints, shape (lane, constraint), and their labels."""
        found: list[tuple[str, float, Any]] = []
        model = motion.model
        n = model.number
        wanted = self.wanted
        if wanted.min_transmission_angle is not None:
            limit = n(wanted.min_transmission_angle)
            for name, angle in model.definition.angles.items():
                if angle.limited:
                    sine = np.sin(motion.angle(name)[..., grid])
                    # (sin^2 mu - sin^2 limit)/sin(2 limit): smooth, and the angle near the limit
                    margin = (sine * sine - np.sin(limit) ** 2) / np.sin(2.0 * limit)
                    found.append((name, 1.0, margin))
        if wanted.min_length is not None:
            found.append(("min_length", 1.0, length - n(wanted.min_length)))
        if wanted.max_stroke is not None:
            stroke = np.where(np.real(length[:, -1:] - length[:, :1]) > 0.0, 1.0, -1.0) * (
                length[:, -1:] - length[:, :1]
            )
            found.append(("max_stroke", 1.0, n(wanted.max_stroke) - stroke))
        if wanted.available_force is not None:
            limit = n(wanted.available_force)
            scale = float(np.ravel(np.real(limit))[0])
            found.append(("available_force", scale, (limit - force) / scale))
        mean = np.mean(rate, axis=-1, keepdims=True)
        found.append(("dead_point", 1.0, rate / mean - SLOWEST))
        for i, box in enumerate(wanted.envelope):
            for point in box.points:
                r = motion.point(point)[0][..., grid, :]
                for axis, limits in ((0, box.x), (1, box.y)):
                    if limits is not None:
                        low, high = (n(x) for x in limits)
                        found.append((f"envelope.{i}", 1.0, r[..., axis] - low))
                        found.append((f"envelope.{i}", 1.0, high - r[..., axis]))
        self.labels = [
            (name, scale) for name, scale, margin in found for _ in range(margin.shape[-1])
        ]
        return np.concatenate([margin for _, _, margin in found], axis=-1)
