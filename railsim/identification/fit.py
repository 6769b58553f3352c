"""`identify`: parameters of a vehicle from measured runs, by least squares.

The weighted residuals r(x) of all runs are minimised (trust region reflective, Branch, Coleman, Li
1999, SIAM J. Sci. Comput. 21, 1), with J their derivatives: the covariance of the coordinates is
(J^T J)^-1 J^T E^-1 J (J^T J)^-1, times the mean square of the residuals where that is above what
the noise explains; E is the share of independent values in each residual, less than 1 by faded ends
and gaps.  A singular value s of E^(1/2) J says that the combination of parameters along its vector
is known to 1/s.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.errors import Faults, argument_error
from railsim.files.access import make_folder
from railsim.identification.identified import (
    AT_BOUND,
    INFINITE,
    NORMAL,
    Channel,
    Identified,
    Place,
    residual_remark,
)
from railsim.identification.parameters import Parameter, parse_keys
from railsim.identification.problem import STRETCH, Problem, Workers
from railsim.identification.residuals import FORMS, Form, banded, whiteness
from railsim.identification.runs import FEWEST, model_of, prepare_run, track_of
from railsim.measurement import Measurement, load_measurement
from railsim.measurement.alignment import common_shift
from railsim.measurement.likeness import suspicions
from railsim.processes import available_cores

LOSSES = ("linear", "soft_l1", "huber", "cauchy")
COARSE, FINE = 0.1, 3e-5  # of the sum of squares; of it and of the coordinates
SILENT = 1e-3  # of the noise of a channel: change that is none
FIRST = 0.05  # of the rms of a channel: least noise that is taken for the first weights
NEGLIGIBLE = 1e-3  # of the rms of a channel: residuals whose whiteness says nothing of the model
SETTLED = 0.05  # change of a weight
MOST_STEPS = 30
CLOSE, MOST_TIMES = 0.1, 4  # standard deviations; times that derivatives are taken at the solution
SAME = 3e-3  # change of a coordinate up to which derivatives are the same
NARROW = 0.01  # of the distance between its bounds, within which a parameter lies at one
PART, LONG = 8.0, 3.0  # s that a first search uses, of runs that are as many times as long
REWEIGHTED = 2  # times that the noise is taken from the residuals
SHARES = 5  # of profiles that are tried before the search
STRETCHED = 1e-3  # of the arc length, from which it is said: its whole 95 % interval
SCALE = 5.0  # weight of a residual in units of the noise beyond which a robust loss yields


def identify(
    vehicle: Vehicle | str | Path | None,
    measured: Measurement | str | Path | Sequence[Measurement | str | Path],
    parameters: Sequence[str | Parameter],
    *,
    track: Track | None = None,
    band: tuple[float, float] = (0.5, 30.0),
    form: str = "history",
    loss: str = "linear",
    place: bool = True,
    workers: int | None = None,
    folder: str | Path | None = None,
    progress: Callable[[int], None] | None = None,
) -> Identified:
    """Identify parameters of a vehicle from measured runs.

    Parameters
    ----------
    vehicle : Vehicle, str or Path, or None
        Where the search starts; None: the vehicle that the measurement names.
    measured : Measurement, str, Path or several
        Runs, each on the track and in the load that its file names.
    parameters : sequence of str or Parameter
        ``KEY[+KEY...][:LOW:HIGH[:SPREAD]]``: factors of the values; see
        `railsim.identification.parameters`.
    track : Track, optional
        Instead of the tracks that the measurements name.
    band : (float, float)
        Frequencies that are compared [Hz].
    form : {'history', 'spectra', 'sections'}
        See `railsim.identification.residuals`.
    loss : {'linear', 'soft_l1', 'huber', 'cauchy'}
        Robust losses weigh residuals beyond five times the noise less.
    place : bool
        Whether shift and stretch of each run along the track are found too (`history` only).
    workers : int, optional
        Processes; by default one for each core.
    folder : str or Path, optional
        Where evaluations are kept: an identification that was interrupted goes on from there.
    progress : callable, optional
        Called with the number of runs simulated so far.

    Raises
    ------
    InputError
        Wrong files, channels or parameters; a band that was not sampled.
    ModelError
        A variant without equilibrium.
    """
    _check_arguments(band, form, loss, workers)
    files = [measured] if isinstance(measured, Measurement | str | Path) else list(measured)
    places = [Path(file).resolve() for file in files if not isinstance(file, Measurement)]
    for name in {place.name for place in places if places.count(place) > 1}:
        words = f"{name} is given twice"
        raise argument_error("measured", words, "each run once", option="MEASURED.toml")
    runs = [file if isinstance(file, Measurement) else load_measurement(file) for file in files]
    if not runs:
        raise argument_error("measured", "none", "one measured run at least")
    model = model_of(vehicle, runs, track)
    chosen = parse_keys(parameters, model.vehicle, model.track)
    ready = [prepare_run(run, model, band, track or track_of(run)) for run in runs]
    if form == "spectra" and any(
        not row.size for p in ready for row in Form(form, band).features(p, p.measured)
    ):
        found, allowed = f"{band[0]:g} to {band[1]:g} Hz", "frequencies in a third-octave band at "
        raise argument_error("band", found, f"{FEWEST} {allowed}least: a wider band, a longer run")
    ready = [replace(p, run=p.run.with_step_of(model)) for p in ready]
    place = place and form == "history"
    cache = None if folder is None else Path(folder)
    if cache is not None:
        make_folder(cache, "folder")
    with Workers(workers or available_cores()) as pool:
        problem = Problem(
            model, chosen, ready, Form(form, band), place, pool, cache, progress or (lambda _: None)
        )
        return _solve(problem, loss)


def _check_arguments(band: tuple[float, float], form: str, loss: str, workers: int | None) -> None:
    faults = Faults()
    found = f"{band[0]:g} to {band[1]:g} Hz"
    rising = 0.0 < band[0] < band[1] < np.inf
    faults.require(rising, "band", found, "two frequencies above 0 that rise")
    whole = workers is None or workers >= 1
    faults.require(whole, "workers", f"found {workers}", "a whole number above 0")
    for name, value, allowed in (("form", form, FORMS), ("loss", loss, LOSSES)):
        faults.require(value in allowed, name, value, "one of " + ", ".join(allowed))
    faults.check()


def _solve(problem: Problem, loss: str) -> Identified:
    x = np.zeros(problem.size)
    if problem.place:
        x[problem.count :] = _places(problem, x)
    remarks = [*_suspicions(problem, x, clocks=False)]
    start = x.copy()
    bounds = np.array([p.bounds for p in problem.parameters]
                      + [(-np.inf, np.inf)] * (problem.size - problem.count)).T  # fmt: skip
    stated = problem.form.kind == "history"
    noise_known = stated and all(np.isfinite(p.noise).all() for p in problem.runs)
    _weigh(problem, x, stated=stated)
    x = _best_shares(problem, x)
    near = stated and all(len(p.run.at) * p.step > LONG * PART for p in problem.runs)
    if near:
        # by the beginnings of the runs: near the solution at a low cost; their stretch says little
        short = problem.shortened(PART)
        _weigh(short, x, stated=True)
        near_x, _ = _least_squares(short, x, bounds, loss, COARSE)
        problem.simulations = short.simulations
        x = np.concatenate([near_x[: problem.count], x[problem.count :]])
        _weigh(problem, x, stated=stated)
    for tolerance in [FINE] if noise_known else [*[COARSE][near:], *[FINE] * REWEIGHTED]:
        x, converged = _least_squares(problem, x, bounds, loss, tolerance)
        if not converged:
            remarks.append(f"The search has not settled after {MOST_STEPS} steps.")
        if noise_known or not _weigh(problem, x, stated=stated):
            break
    x, change = _with_own_derivatives(problem, x, bounds, loss)
    if change > CLOSE:
        remarks.append(f"The last step changed a parameter by {change:.2g} standard deviations.")
    remarks += _suspicions(problem, x, clocks=True)
    remarks += [f"{p.run.name}: {remark}" for p in problem.runs
                for remark in p.measurement.remarks]  # fmt: skip
    # of what is said of the start and of the end with other numbers the latter
    said = {remark.partition(" (correlation")[0]: remark for remark in remarks}
    return _outcome(problem, start, x, loss, list(said.values()))


def _least_squares(
    problem: Problem, x: Floats, bounds: Floats, loss: str, tolerance: float
) -> tuple[Floats, bool]:
    """Return the coordinates with the least sum of squares, and whether the search has settled."""
    from scipy.optimize import least_squares

    def vector(z: Floats) -> Floats:
        return problem.step_residuals(z - 1.0)

    def jacobian(z: Floats) -> Floats:
        return problem.derivatives_near(z - 1.0)

    # about 1, so that the first region of trust has the size of the parameters
    solution = least_squares(
        vector,
        1.0 + np.clip(x, bounds[0] + 1e-9, bounds[1] - 1e-9),
        jacobian,
        tuple(1.0 + bounds),
        method="trf",
        ftol=tolerance,
        xtol=FINE,
        gtol=1e-12,
        loss=loss,  # type: ignore[arg-type]  # checked
        f_scale=SCALE,
        max_nfev=MOST_STEPS,
    )
    return np.asarray(solution.x) - 1.0, bool(solution.success)


def _with_own_derivatives(
    problem: Problem, x: Floats, bounds: Floats, loss: str
) -> tuple[Floats, float]:
    """Return coordinates found with derivatives at the solution itself.

    And the last change of a parameter in standard deviations; 0 where the derivatives are the same.
    """
    change = np.inf
    for _ in range(MOST_TIMES):
        jacobian = problem.derivatives_at(x)
        before, (x, _) = x, _least_squares(problem, x, bounds, loss, FINE)
        deviations = np.sqrt(np.diag(_covariance(problem, x, jacobian, loss)[0]))
        change = float(np.max(np.abs(x - before) / deviations))
        if np.max(np.abs(x - before)[: problem.count]) < SAME:
            change = 0.0
        if change < CLOSE:
            break
    return x, change


def _counting(vector: Floats, loss: str) -> Floats:
    """Return by how much residuals count with a loss, 1 where it does not yield."""
    square = (vector / SCALE) ** 2
    weights = {
        "linear": np.ones(len(vector)), "soft_l1": 1.0 / np.sqrt(1.0 + square),
        "huber": 1.0 / np.sqrt(np.maximum(square, 1.0)), "cauchy": 1.0 / (1.0 + square),
    }  # fmt: skip
    return weights[loss]


def _covariance(problem: Problem, x: Floats, jacobian: Floats, loss: str) -> tuple[Floats, float]:
    """Return the covariance of the coordinates, and by how much residuals above noise raise it."""
    vector = problem.vector(x)
    data = len(vector) - len(problem.before(x))
    counting = _counting(vector, loss)
    jacobian = np.sqrt(counting)[:, None] * jacobian
    square = float(counting[:data] @ vector[:data] ** 2)
    independent = problem.independent(x)
    fitted = problem.size / float(np.mean(independent[:data]))
    square /= max(1.0, float(np.sum(counting[:data])) - fitted)
    inflation = max(1.0, square)  # what the noise that is stated does not explain is noise too
    left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    with np.errstate(divide="ignore"):
        inverse = np.where(singular > 1e-10 * singular[0], 1.0 / singular, 1e6)
    half = inverse[:, None] * right
    return inflation * half.T @ (left.T / independent @ left) @ half, inflation


def _best_shares(problem: Problem, x: Floats) -> Floats:
    """Return coordinates with each share where it fits best: contacts have more than one valley."""
    for k, parameter in enumerate(problem.parameters):
        if parameter.is_share:
            points = list(np.tile(x, (SHARES, 1)))
            for point, share in zip(points, np.linspace(*parameter.bounds, SHARES), strict=True):
                point[k] = share
            sums = [float(row @ row) for row in problem.vectors(points)]
            x = points[int(np.argmin(sums))]
    return x


def _places(problem: Problem, x: Floats) -> Floats:
    """Return shift and stretch of each run by its most telling channels."""
    places = []
    for prepared, values in zip(problem.runs, problem.series(x), strict=True):
        s = prepared.run.at
        signals = [
            (s, measured, s[inside], simulated[inside])
            for measured, simulated in zip(prepared.measured, values, strict=True)
            if (inside := np.isfinite(simulated)).any()
        ]
        best = common_shift(signals)
        places += [0.0, 0.0] if best is None else [best.shift, best.stretch / STRETCH]
    return np.array(places)


def _suspicions(problem: Problem, x: Floats, *, clocks: bool) -> Iterator[str]:
    for prepared, values in zip(problem.placed(x), problem.series(x), strict=True):
        in_band = (
            [banded(row, prepared.step, problem.form.band) for row in rows]
            for rows in (prepared.measured, values)
        )
        measured, simulated = (dict(zip(prepared.names, rows, strict=True)) for rows in in_band)
        quantities = dict(zip(prepared.names, prepared.run.selections, strict=True))
        for sentence in suspicions(measured, simulated, quantities, prepared.step, clocks=clocks):
            yield f"{prepared.run.name}: {sentence}"


def _weigh(problem: Problem, x: Floats, *, stated: bool) -> bool:
    """Set the weights, by noise or residuals; return whether one changes by over `SETTLED`."""
    before, problem.weights = problem.weights, []
    for prepared, rows in zip(problem.placed(x), problem.residuals(x), strict=True):
        noise = problem.form.expected(prepared) if stated else [np.nan] * len(rows)
        floors = problem.form.features(prepared, prepared.measured, measured=True)
        levels = [
            level if np.isfinite(level) else max(_rms(row), (0.0 if before else FIRST) * _rms(all_))
            for row, level, all_ in zip(rows, noise, floors, strict=True)
        ]
        problem.weights.append(np.array([1.0 / level if level > 0.0 else 0.0 for level in levels]))
    if not before:
        return True
    pairs = zip(problem.weights, before, strict=True)
    ratios = [new / np.where(old > 0.0, old, 1.0) for new, old in pairs]
    return bool(np.max(np.abs(np.concatenate(ratios) - 1.0)) > SETTLED)


def _rms(x: Floats) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _outcome(
    problem: Problem, start: Floats, x: Floats, loss: str, remarks: list[str]
) -> Identified:
    count = problem.count
    jacobian = problem.derivatives_near(x)
    # what nothing depends on goes back to the file's value: the search leaves it anywhere
    without_effect = np.linalg.norm(jacobian, axis=0) * INFINITE < 1.0
    reset = np.where(without_effect, start, x)
    if without_effect.any() and np.abs(problem.vector(reset) - problem.vector(x)).max() < SILENT:
        x = reset
    covariance, inflation = _covariance(problem, x, jacobian, loss)
    telling = _counting(problem.vector(x), loss) * problem.independent(x)
    jacobian = np.sqrt(telling)[:, None] * jacobian
    data = len(jacobian) - len(problem.before(x))
    channels = []
    series = zip(
        problem.placed(x), problem.residuals(x), problem.weights, problem.series(start),
        problem.series(x), strict=True,
    )  # fmt: skip
    for p, rows, weights, before, after in series:
        wholes = problem.form.features(p, p.measured, measured=True)
        shares = problem.form.independent(p)
        for j, (name, row, whole) in enumerate(zip(p.names, rows, wholes, strict=True)):
            tested = problem.form.kind == "history" and _rms(row) > NEGLIGIBLE * _rms(whole)
            test = whiteness(row, shares[j]) if tested else (np.nan, np.nan)
            channels.append(Channel(
                p.run.name, name, p.run.selections[j], p.step, p.run.at,
                p.measured[j], before[j], after[j], _rms(weights[j] * row), *test,
            ))  # fmt: skip
    # directions of the parameters alone: what the places of the runs could explain is eliminated
    alone, by_places = jacobian[:data, :count], jacobian[:data, count:]
    if by_places.shape[1]:
        basis, _ = np.linalg.qr(by_places)
        alone = alone - basis @ (basis.T @ alone)
    _, values, vectors = np.linalg.svd(alone, full_matrices=False)
    places = [
        Place(p.run.name, float(shift), STRETCH * float(stretch))
        for p, (shift, stretch) in zip(
            problem.runs if problem.place else (), np.reshape(x[count:], (-1, 2)), strict=True
        )
    ]
    remarks += _stretch_remarks(places, STRETCH * np.sqrt(np.diag(covariance))[count + 1 :: 2])
    remarks += _bound_remarks(problem.parameters, x)
    remarks += filter(None, [residual_remark((c.name, c.is_white) for c in channels)])
    return Identified(
        problem.model.vehicle, tuple(problem.parameters), x[:count], covariance[:count, :count],
        values, vectors, tuple(channels), tuple(places), problem.form.kind, problem.form.band,
        inflation, problem.simulations, tuple(remarks),
    )  # fmt: skip


def _stretch_remarks(places: Sequence[Place], deviations: Floats) -> list[str]:
    """Say whose arc length is stretched, its standard deviation being known: not what is noise."""
    return [
        f"{place.run}: its arc length is stretched by {1e3 * place.stretch:+.2f} m/km: distance, "
        "speed or clock are off by as much; where it is the clock, so are all frequencies."
        for place, deviation in zip(places, deviations, strict=True)
        if abs(place.stretch) - NORMAL * deviation > STRETCHED
    ]


def _bound_remarks(parameters: Sequence[Parameter], x: Floats) -> Iterator[str]:
    """Say which parameters end at a bound; a share of 0 or 1 is one of the profiles itself."""
    for parameter, coordinate in zip(parameters, x, strict=False):
        reach = min(SAME, NARROW * (parameter.bounds[1] - parameter.bounds[0]))
        for bound, end in zip(parameter.bounds, (parameter.low, parameter.high), strict=True):
            if abs(coordinate - bound) < reach and not (parameter.is_share and end in (0.0, 1.0)):
                yield (
                    f"{parameter.name} {AT_BOUND} of {end:g}: the best value may lie beyond it, "
                    "and the intervals do not hold."
                )
