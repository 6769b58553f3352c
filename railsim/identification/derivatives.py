"""Derivatives of runs to parameters, with their accuracy: `sensitivity`.

Differences of simulated runs: forward (p + 1 runs) or central (2 p + 1).  The step is controlled:
one-sided differences F+ and F- of an output y that is smooth differ by h y''; a share
r = |F+ - F-| / |F+ + F-| above the tolerance asks for a shorter step, at most a few times.  Where r
does not fall with the step the output has a kink (flange, stop, lifted wheel, sticking friction),
and a derivative means nothing: said so.

The accuracy reported of a central difference is the difference to that of another step, where there
is one, else r^2 (the next term of a series whose terms fall geometrically), and rounding at least;
of a forward difference it is r, from one more run with all parameters changed at once.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import argument_error, nearest
from railsim.identification.parameters import Model, Parameter, parse_keys
from railsim.identification.problem import Workers
from railsim.measurement.counterpart import outputs_for, series
from railsim.processes import available_cores
from railsim.profiles import Profile
from railsim.result import Result
from railsim.simulation import simulate
from railsim.simulation.remarks import silent
from railsim.table import Column, Table

Output = str | Callable[[Result], Any]
FIRST = 1e-2  # step of a coordinate
SHORTER = 8.0
MOST_TIMES = 2  # that the step is shortened
TOLERANCE = 1e-2  # r
KINK = 0.7  # of r at the longer step: r has not fallen
STATUS = 0.1  # share of one instant's derivative: sides differ there
LEAST = 1e-3  # share of either side that a derivative is taken for at least, to compare with


@dataclass(frozen=True, eq=False)
class Derivative:
    """Derivative of one output to one parameter.

    It is the change of the output [SI] for a relative change of the parameter, d y / d ln p; to the
    share of a profile d y / d share.
    """

    value: Floats
    error: float  # estimated, over the norm of the derivative [1]
    step: float  # of the parameter's coordinate
    kinked: float = np.nan  # share of the values at which both sides differ; NaN: forward
    rounding: float = 0.0  # of the output, over the change that the derivative is taken from [1]

    @property
    def is_smooth(self) -> bool:
        """Whether the output has a derivative, within a tenth."""
        return bool(self.error < STATUS)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of some outputs to some parameters.

    Attributes
    ----------
    parameters : tuple of Parameter
    outputs : tuple of str
    result : Result
        The run itself.
    base : dict of str to ndarray
        Outputs of the run [SI].
    derivatives : dict of (str, str) to Derivative
        By output and name of the parameter.
    runs : int
        How many were simulated.
    remarks : tuple of str
    """

    parameters: tuple[Parameter, ...]
    outputs: tuple[str, ...]
    result: Result
    base: Mapping[str, Floats]
    derivatives: Mapping[tuple[str, str], Derivative]
    runs: int
    remarks: tuple[str, ...] = field(default=())

    def __getitem__(self, key: tuple[str, str]) -> Floats:
        """Return the derivative of an output to a parameter, ``[output, parameter]``."""
        if key not in self.derivatives:
            names = map(str, self.derivatives)
            raise KeyError(f"no derivative {key!r}; {nearest(str(key), names)}")
        return self.derivatives[key].value

    def table(self) -> Table:
        """Return norms (rms of histories) and accuracies of all derivatives."""
        rows = []
        for (output, name), derivative in self.derivatives.items():
            base = float(np.sqrt(np.mean(self.base[output] ** 2)))
            size = float(np.sqrt(np.mean(derivative.value**2)))
            smooth = "yes" if derivative.is_smooth else "no"
            rows.append([output, name, base, size, derivative.error, derivative.step, smooth])
        return Table(
            [
                Column("output"),
                Column("parameter"),
                Column("rms", "rms (SI)", format=".4g"),
                Column("derivative", "rms of dy/dln p", format=".4g"),
                Column("error", "relative error", format=".1e"),
                Column("step", format=".1e"),
                Column("smooth"),
            ],
            rows,
        )

    def __repr__(self) -> str:
        return str(self.table())


@dataclass(frozen=True, eq=False)
class _Job:
    """What every variant does."""

    model: Model
    parameters: tuple[Parameter, ...]
    outputs: tuple[Output, ...]
    options: Mapping[str, Any]

    def result(self, x: Floats) -> Result:
        model = self.model.with_parameters(self.parameters, x)
        return simulate(model.vehicle, model.track, profiles=model.profiles, **self.options)

    def variants(self, points: Sequence[Floats], pool: Workers) -> list[list[Floats]]:
        """Return the outputs of variants, which are simulated together."""
        return pool.run([(self.values, (x,)) for x in points])

    def values(self, x: Floats) -> list[Floats]:
        with silent():
            return self.read(self.result(x))

    def read(self, result: Result) -> list[Floats]:
        if result.status != "complete":
            raise argument_error("parameters", f"a variant {result.status}", "a run that ends")
        values = [
            series(result, item) if isinstance(item, str) else item(result) for item in self.outputs
        ]
        return [np.atleast_1d(np.asarray(x, dtype=np.float64)) for x in values]


def sensitivity(
    vehicle: Vehicle,
    track: Track,
    parameters: Sequence[str | Parameter],
    outputs: Sequence[str] | Mapping[str, Output],
    *,
    scheme: str = "central",
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
    workers: int = 1,
    **run: Any,
) -> Sensitivity:
    """Return derivatives of histories and values of a run to parameters.

    Parameters
    ----------
    vehicle, track : Vehicle, Track
    parameters : sequence of str or Parameter
        Keys, see `railsim.identification.parameters`: ``secondary_spring.stiffness.z``.
    outputs : sequence of str, or mapping of str to str or callable
        Quantities with labels (``Q:1:left``); by names also functions of a result that give
        numbers, such as ``{"peak": lambda r: r["Q"].max()}``.
    scheme : {'central', 'forward'}
        2 p + 1 runs, more where the step is shortened; or p + 2 runs.
    settings : Settings, optional
        The step is that of the run itself in all variants.
    profiles : mapping of str to Profile, optional
        As of `simulate`.
    workers : int
        Processes; 0: one for each core.  Functions as outputs need one process.
    **run
        Further arguments of `simulate`: `speed`, `start`, `until`, `duration`.

    Raises
    ------
    InputError
        Wrong parameters, outputs or settings; a variant that does not reach its end.

    Examples
    --------
    >>> import railsim
    >>> coach = railsim.load_vehicle("coach_manchester")
    >>> track = railsim.load_track("curve_r250")
    >>> found = railsim.sensitivity(coach, track, ["bodies.carbody.mass"], ["Q:1:left"],
    ...     scheme="forward", speed=20.0, until=5.0)
    >>> bool(0.0 < found["Q:1:left", "bodies.carbody.mass"][0] < found.base["Q:1:left"][0])
    True
    """
    if scheme not in ("central", "forward"):
        raise argument_error("scheme", scheme, "central or forward")
    selected = dict(outputs) if isinstance(outputs, Mapping) else {name: name for name in outputs}
    chosen = parse_keys(parameters, vehicle, track)
    settings = _settings(settings, selected)
    options = {**run, "settings": settings}
    job = _Job(Model(vehicle, track, profiles), tuple(chosen), tuple(selected.values()), options)
    result = job.result(np.zeros(len(chosen)))
    if settings.drive.mode == "constant":
        fixed = settings.replace(step=float(result.attributes["step"]))
        job = replace(job, options={**run, "settings": fixed})
    try:
        base = job.read(result)
    except KeyError as error:
        raise argument_error("outputs", str(error.args[0])) from None
    differences = _forward if scheme == "forward" else _central
    with Workers(workers or available_cores()) as pool:
        rows, runs = differences(job, base, pool)
    derivatives = {
        (output, parameter.name): rows[k][j]
        for k, output in enumerate(selected)
        for j, parameter in enumerate(chosen)
    }
    remarks = [
        f"{output} does not depend on {name}: what it changes by is within rounding."
        if d.rounding > STATUS
        else f"{output} has no derivative to {name}: its two sides differ by {100 * d.error:.0f}"
        + (f" % ({100 * d.kinked:.3g} % of the values)" if np.isfinite(d.kinked) else " %")
        + "; flange, stop, lifted wheel or sticking friction."
        for (output, name), d in derivatives.items()
        if not d.is_smooth
    ]
    return Sensitivity(
        tuple(chosen), tuple(selected), result,
        dict(zip(selected, base, strict=True)), derivatives, runs, tuple(remarks),
    )  # fmt: skip


def _settings(settings: Settings | None, selected: Mapping[str, Output]) -> Settings:
    """Return settings whose outputs hold what is asked for."""
    settings = settings or Settings()
    selections = [output for output in selected.values() if isinstance(output, str)]
    if not selections:
        return settings
    try:
        needed = outputs_for(selections)
    except KeyError as error:
        raise argument_error("outputs", f"no quantity {error}") from None
    outputs = settings.outputs
    values = {
        key: value
        for key, value in needed.items()
        if key not in ("quantities", "elements") and not getattr(outputs, key)
    }
    if "elements" in needed:
        values["elements"] = (*outputs.elements, *needed["elements"])
    return settings.replace(outputs={**outputs.model_dump(exclude_none=True), **values})


def _size(x: Floats) -> float:
    return float(np.linalg.norm(x))


def _forward(job: _Job, base: list[Floats], pool: Workers) -> tuple[list[list[Derivative]], int]:
    """Return derivatives by output and parameter, and the number of runs with that of `base`."""
    count = len(job.parameters)
    step = FIRST / SHORTER
    *moved, together = job.variants([*(step * np.eye(count)), np.full(count, -step)], pool)
    rows = []
    for k, y in enumerate(base):
        values = [(variant[k] - y) / step for variant in moved]
        linear, whole = -step * np.sum(values, axis=0), together[k] - y
        error = _size(whole - linear) / max(_size(linear), LEAST * _size(whole), 1e-300)
        rows.append(
            [Derivative(v, error, step, rounding=_rounding(y, step * _size(v))) for v in values]
        )
    return rows, count + 2


def _central(job: _Job, base: list[Floats], pool: Workers) -> tuple[list[list[Derivative]], int]:
    """As `_forward`, with steps that are shortened."""
    count, step, runs = len(job.parameters), FIRST, 1
    best: dict[tuple[int, int], Derivative] = {}
    ratios = np.full((len(base), count), np.nan)
    waiting = list(range(count))
    for _ in range(1 + MOST_TIMES):
        points = [sign * step * np.eye(count)[j] for j in waiting for sign in (1.0, -1.0)]
        moved = job.variants(points, pool)
        runs += len(points)
        remaining = []
        for j, above, below in zip(waiting, moved[::2], moved[1::2], strict=True):
            shorter = False
            for k, y in enumerate(base):
                before = best.get((k, j))
                new, ratio = _central_derivative(y, above[k], below[k], step, before)
                if before is None or new.error < before.error:
                    best[k, j] = new
                else:  # with what it does not agree with
                    best[k, j] = replace(before, error=new.error)
                shorter |= ratio > TOLERANCE and not ratio > KINK * ratios[k, j]
                ratios[k, j] = ratio
            remaining += [j] if shorter else []
        waiting = remaining
        step /= SHORTER
        if not waiting:
            break
    return [[best[k, j] for j in range(count)] for k in range(len(base))], runs


def _rounding(y: Floats, change: float) -> float:
    return 1e-13 * _size(y) / max(change, 1e-300)


def _central_derivative(
    y: Floats, above: Floats, below: Floats, step: float, before: Derivative | None
) -> tuple[Derivative, float]:
    """Return a central derivative and the difference of its sides as a share of it."""
    up, down = (above - y) / step, (y - below) / step
    value, sides = 0.5 * (up + down), max(_size(up), _size(down))
    size = max(_size(value), LEAST * sides, 1e-300)
    ratio = 0.5 * _size(up - down) / size
    # of an output that does not depend on the parameter there is nothing to round
    rounding = _rounding(y, step * size) if sides else 0.0
    error = ratio**2 if before is None else _size(value - before.value) / size
    error = max(error, rounding)
    if ratio > STATUS:
        error = max(error, ratio)
    scale = max(float(np.max(np.abs(value))), 1e-300)
    kinked = float(np.mean(np.abs(up - down) > 2.0 * STATUS * scale))
    return Derivative(value, error, step, kinked, rounding), ratio
