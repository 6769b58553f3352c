"""The least-squares problem: residuals and their derivatives at some coordinates.

Each coordinate is that of a parameter, followed by the shift [m] and stretch [1] of each run's
arc length where its place on the track is sought too.  A derivative is a difference of simulated
runs, forward in the search and central at its end; those to the place come from the splines of one.
They change slowly, so that those of a point serve its neighbourhood (chord method).  Evaluations
are kept in a folder, if one is given, so that an identification that was interrupted goes on where
it was.
"""

import hashlib
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.files.access import read_bytes, whole_file
from railsim.identification.parameters import Model, Parameter
from railsim.identification.residuals import Form
from railsim.identification.runs import PreparedRun
from railsim.processes import WorkerPool
from railsim.profiles import load_profile
from railsim.profiles.used import used_profiles
from railsim.version import __version__

STEP = 0.02  # of a coordinate, for differences: sticking and cells of the contact are not smooth
STRETCH = 1e-4  # scale of the coordinate of the stretch: 0.1 m/km
NEAR = 0.03  # change of a coordinate up to which derivatives serve
LARGEST_KEPT = 2_000_000_000  # bytes

Task = tuple[Callable[..., Any], tuple[Any, ...]]


class Workers(ExitStack):
    """Processes for tasks, within a block; with one worker everything happens in this process."""

    def __init__(self, count: int) -> None:
        super().__init__()
        self.count = count

    @cached_property
    def _pool(self) -> WorkerPool:
        return self.enter_context(WorkerPool(self.count))

    def run(self, tasks: Sequence[Task]) -> list[Any]:
        """Return what the tasks return, in their order; raise the first error of a task."""
        if self.count <= 1 or len(tasks) <= 1:
            return [function(*arguments) for function, arguments in tasks]
        futures = [self._pool.submit(function, *arguments) for function, arguments in tasks]
        return [future.result() for future in futures]


@dataclass(eq=False)
class Problem:
    """Residuals of some runs."""

    model: Model
    parameters: Sequence[Parameter]
    runs: Sequence[PreparedRun]
    form: Form
    place: bool  # whether shift and stretch of each run are sought
    workers: Workers
    folder: Path | None  # where evaluations are kept
    progress: Callable[[int], None]  # called with the number of simulated runs
    # by run and channel: one over the standard deviation of the noise
    weights: list[Floats] = field(default_factory=list)
    simulations: int = 0
    _inputs: str = field(init=False)
    _last: dict[str, Floats] = field(default_factory=dict)
    _derived: Floats | None = None  # where the derivatives were taken
    _central: bool = False  # whether those are central

    def __post_init__(self) -> None:
        digest = hashlib.sha256(__version__.encode())
        for text in (self.model.vehicle.to_toml(), repr(self.parameters), self.form):
            digest.update(repr(text).encode())
        for p in self.runs:
            parts = (p.run.track.to_toml(), p.run.settings.to_toml(), repr(p.run.load))
            filters = [(channel.low_pass, channel.high_pass) for channel in p.run.amplifiers]
            digest.update(repr((*parts, p.run.speed, p.run.selections, filters)).encode())
            digest.update(p.run.at.tobytes())
        # files of profiles may be changed in between
        definitions = self.model.vehicle, *(p.run.track for p in self.runs)
        used = {name for definition in definitions for _, name, _ in used_profiles(definition)}
        for name in sorted(used.union(*(parameter.profiles for parameter in self.parameters))):
            digest.update(load_profile(name).key())
        self._inputs = digest.hexdigest()

    def shortened(self, duration: float) -> "Problem":
        """Return the problem of the first seconds of each run."""
        runs = []
        for prepared in self.runs:
            n = int(duration / prepared.step)
            end = float(prepared.run.at[n]) + 0.2 * prepared.run.speed
            run = replace(prepared.run, at=prepared.run.at[:n], until=min(prepared.run.until, end))
            runs.append(replace(prepared, run=run, measured=prepared.measured[:, :n]))
        return Problem(
            self.model, self.parameters, runs, self.form, self.place, self.workers, self.folder,
            self.progress, simulations=self.simulations,
        )  # fmt: skip

    @property
    def count(self) -> int:
        """Number of parameters."""
        return len(self.parameters)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.count + (2 * len(self.runs) if self.place else 0)

    def placed(self, x: Floats) -> list[PreparedRun]:
        """Return the runs at their places on the track."""
        if not self.place:
            return list(self.runs)
        moves = np.reshape(x[self.count :], (-1, 2))
        return [
            prepared.moved(float(shift), STRETCH * float(stretch))
            for prepared, (shift, stretch) in zip(self.runs, moves, strict=True)
        ]

    def series(self, x: Floats) -> list[Floats]:
        """Return the simulated channels of all runs, float64[channel, time] each."""
        bases = zip(self._bases(x), self.runs, strict=True)
        return [values[: len(prepared.names)] for values, prepared in bases]

    def _bases(self, x: Floats, *, ahead: bool = False) -> list[Floats]:
        """Return the simulated channels, with their slopes below them where places are sought.

        With `ahead` the variants for the derivatives are simulated in the same call.
        """
        requests = [(x, k, self.place) for k in range(len(self.runs))]
        if ahead and any(self._stored(*request) is None for request in requests):
            requests += self._variants(x, central=False)[0]
        return self._simulate(requests)[: len(self.runs)]

    def step_residuals(self, x: Floats) -> Floats:
        """Return `vector` at a step of the search.

        With several workers the variants for the derivatives are simulated in the same call, where
        those of an earlier step do not serve: after almost every step they are wanted next.
        """
        self._bases(x, ahead=self.workers.count > 1 and not self._is_near(x))
        return self.vector(x)

    def _is_near(self, x: Floats) -> bool:
        last = self._derived
        return last is not None and bool(np.max(np.abs((x - last)[: self.count])) <= NEAR)

    def derivatives_near(self, x: Floats) -> Floats:
        """Return derivatives of `vector` at a point near by, if they are known."""
        if not self._is_near(x):
            # levels bend more than histories do
            self._derived, self._central = x.copy(), self.form.kind != "history"
        assert self._derived is not None  # a point near by
        return self.jacobian(self._derived, central=self._central)

    def derivatives_at(self, x: Floats) -> Floats:
        """Return central derivatives of `vector` at a point, which then serve its neighbourhood."""
        self._derived, self._central = x.copy(), True
        return self.jacobian(x, central=True)

    def _variants(
        self, x: Floats, *, central: bool
    ) -> tuple[list[tuple[Floats, int, bool]], list[tuple[int, float]]]:
        """Return what is simulated for the derivatives: of each parameter one step or two."""
        requests: list[tuple[Floats, int, bool]] = []
        steps = []
        for k, parameter in enumerate(self.parameters):
            low, high = parameter.bounds
            steps_inside = [step for step in (STEP, -STEP) if low <= x[k] + step <= high]
            steps_inside = steps_inside or [max(high - x[k], low - x[k], key=abs)]
            for step in steps_inside if central else steps_inside[:1]:
                moved = x.copy()
                moved[k] += step
                steps.append((k, step))
                requests += [(moved, number, False) for number in range(len(self.runs))]
        return requests, steps

    def residuals(self, x: Floats) -> list[list[Floats]]:
        """Return measured less simulated, unweighted, for each run and channel."""
        rows = []
        for prepared, values in zip(self.placed(x), self.series(x), strict=True):
            measured = self.form.features(
                prepared, np.where(np.isfinite(values), prepared.measured, np.nan), measured=True
            )
            features = self.form.features(prepared, values)
            rows.append([m - f for m, f in zip(measured, features, strict=True)])
        return rows

    def vector(self, x: Floats) -> Floats:
        """Return all weighted residuals, those of what was known before at the end."""
        rows = [
            weight * row
            for run, weights in zip(self.residuals(x), self.weights, strict=True)
            for row, weight in zip(run, weights, strict=True)
        ]
        return np.concatenate([*rows, self.before(x)])

    def independent(self, x: Floats) -> Floats:
        """Return the share of independent values in each residual of `vector`."""
        shares = [
            np.full(len(row), share)
            for prepared, rows in zip(self.runs, self.residuals(x), strict=True)
            for row, share in zip(rows, self.form.independent(prepared), strict=True)
        ]
        return np.concatenate([*shares, np.ones(len(self._prior))])

    def vectors(self, points: Sequence[Floats]) -> list[Floats]:
        """Return `vector` at several points, which are simulated together."""
        self._simulate([(x, k, self.place) for x in points for k in range(len(self.runs))])
        return [self.vector(x) for x in points]

    def before(self, x: Floats) -> Floats:
        """Return the weighted residuals of what was known before."""
        return self._prior @ x

    @property
    def _prior(self) -> Floats:
        """Derivatives of the residuals of what was known before, float64[residual, coordinate]."""
        rows = [
            -np.eye(self.size)[k] / parameter.spread
            for k, parameter in enumerate(self.parameters)
            if parameter.spread is not None
        ]
        return np.reshape(rows, (-1, self.size))

    def jacobian(self, x: Floats, *, central: bool) -> Floats:
        """Return the derivatives of `vector`, float64[residual, coordinate]."""
        self._bases(x, ahead=True)
        base = self.series(x)
        requests, steps = self._variants(x, central=central)
        series = self._simulate(requests)
        placed = self.placed(x)
        columns = np.zeros((len(self.vector(x)), self.size))
        for number, (k, step) in enumerate(steps):
            varied = series[number * len(self.runs) : (number + 1) * len(self.runs)]
            sides = sum(index == k for index, _ in steps)
            columns[:, k] += self._difference(placed, base, varied, step) / sides
        for number, prepared in enumerate(placed if self.place else []):
            slope = self._bases(x)[number][len(prepared.names) :]
            along = prepared.run.at - prepared.run.at[0]
            for j, scale in enumerate((1.0, STRETCH * along)):
                along_track = [b + (1e-6 * scale * slope if i == number else 0.0)
                         for i, b in enumerate(base)]  # fmt: skip
                columns[:, self.count + 2 * number + j] = self._difference(
                    placed, base, along_track, 1e-6
                )
        prior = self._prior
        columns[len(columns) - len(prior) :] = prior
        return columns

    def _difference(
        self, placed: list[PreparedRun], base: list[Floats], moved: list[Floats], step: float
    ) -> Floats:
        """Derivative of the residuals by a difference of series; zero of what was known before."""
        rows = []
        for prepared, weights, before, after in zip(placed, self.weights, base, moved, strict=True):
            features = (self.form.features(prepared, values) for values in (before, after))
            rows += [-w * (b - a) / step for w, a, b in zip(weights, *features, strict=True)]
        return np.concatenate([*rows, np.zeros(len(self._prior))])

    def _simulate(self, requests: Sequence[tuple[Floats, int, bool]]) -> list[Floats]:
        """Return series of (coordinates, number of the run, slope or not)."""
        series = [self._stored(*request) for request in requests]
        missing = [number for number, x in enumerate(series) if x is None]
        tasks: list[Task] = []
        for x, k, slope in (requests[number] for number in missing):
            run = self.placed(x)[k].run
            tasks.append((run.simulated, (self.model, self.parameters, x[: self.count], slope)))
        for number, outcome in zip(missing, self.workers.run(tasks), strict=True):
            while len(self._last) >= 3 * (self.count + 2) * len(self.runs):
                del self._last[next(iter(self._last))]
            name = self._name(*requests[number])
            series[number] = self._last[name] = outcome
            if self.folder is not None:
                with whole_file(self.folder / f"{name}.bin") as partial:
                    partial.write_bytes(np.ascontiguousarray(outcome).tobytes())
        self.simulations += len(missing)
        if missing:
            self.progress(self.simulations)
        return [values for values in series if values is not None]

    def _name(self, x: Floats, k: int, slope: bool) -> str:
        text = f"{self._inputs} {x.tolist()!r} {k} {slope}"
        return hashlib.sha256(text.encode()).hexdigest()[:32]

    def _stored(self, x: Floats, k: int, slope: bool) -> Floats | None:
        name = self._name(x, k, slope)
        if name in self._last:
            self._last[name] = self._last.pop(name)  # the last one that is forgotten
            return self._last[name]
        path = self.folder and self.folder / f"{name}.bin"
        if path is None or not path.is_file():
            return None
        rows, instants = self.runs[k].measured.shape
        shape = (2 * rows if slope else rows, instants)
        data = read_bytes(path, LARGEST_KEPT)
        if len(data) != 8 * shape[0] * shape[1]:
            return None
        return np.frombuffer(data, dtype=np.float64).reshape(shape)
