"""Identification of models whose runs are known functions of the place: what least squares says.

Two runs are sums of waves over the arc length, of amplitudes that are the parameters; both lie at
places that are not known either.  Solution, covariance and levels are worked out a second time in
the time domain: values less their line, faded at both ends, projected on the waves of the band.
"""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize, stats
from selection import points

import railsim
from railsim.identification.derivatives import Derivative, Sensitivity, _central, _forward
from railsim.identification.fit import _counting, _solve
from railsim.identification.identified import Channel
from railsim.identification.parameters import Parameter, _parse
from railsim.identification.problem import Problem, Workers
from railsim.identification.residuals import Form, whiteness
from railsim.identification.runs import PreparedRun
from railsim.plot import validation as plots
from railsim.profiles import save_profile
from railsim.profiles.used import exchanged_wheels

N, STEP, SPEED, BAND = 1200, 0.01, 20.0, (0.5, 8.0)
FILE = SimpleNamespace(to_toml=lambda: "")
WAVES = np.random.default_rng(3).uniform(3.0, 30.0, (3, 12))  # m
PHASES = np.random.default_rng(4).uniform(0.0, 6.0, (3, 12))
TRUE = {"a": 1.3, "b": 0.7}
PLACES = [(0.8, 3e-4), (-1.1, -2e-4)]
NOISE = np.array([0.6, 0.9])  # standard deviations of the channels, all frequencies


def waves(k, s, slope=False):
    """One of three signals over the arc length, or its slope."""
    turns = 2.0 * np.pi * s[:, None] / WAVES[k] + PHASES[k]
    return np.sum(2.0 * np.pi / WAVES[k] * np.cos(turns) if slope else np.sin(turns), axis=1)


@dataclass(frozen=True)
class Known:
    """A run that is a formula."""

    name: str
    at: np.ndarray = field(repr=False)
    scale: float = 1.0
    speed: float = SPEED
    until: float = 1e4
    load: str | None = None
    selections: tuple[str, ...] = ("one", "other")
    amplifiers: tuple[SimpleNamespace, ...] = ()
    track: SimpleNamespace = field(default_factory=lambda: FILE)
    settings: SimpleNamespace = field(default_factory=lambda: FILE)

    def simulated(self, model, parameters, x, slope):
        a, b = (one.factor(value) for one, value in zip(parameters, x, strict=True))
        rows = []
        for k in (False, True) if slope else (False,):
            u, v, w = (self.scale * waves(i, self.at, k) for i in range(3))
            rows += [a * u + b * v, b * w]
        return np.array(rows)


def runs(random, noise):
    """Two prepared runs of twelve seconds with noise of a standard deviation [1]."""
    found = []
    for number, (shift, stretch) in enumerate(PLACES):
        at = 100.0 * number + SPEED * STEP * np.arange(N)
        run = Known(f"run {number}", at, scale=1.0 + number)
        there = replace(run, at=at + shift + stretch * (at - at[0]))
        keys = [Parameter(name, (name,)) for name in TRUE]
        values = there.simulated(None, keys, np.log(list(TRUE.values())), False)
        values = values + noise * NOISE[:, None] * random.normal(size=(2, N))
        in_band = NOISE * np.sqrt((BAND[1] - BAND[0]) / (0.5 / STEP))
        measurement = SimpleNamespace(remarks=())
        found.append(PreparedRun(run, values, ("one", "other"), in_band, STEP, measurement))
    return found


def identified(ready, parameters, place=True, loss="linear"):
    model = SimpleNamespace(vehicle=FILE)
    form = Form("history", BAND)
    problem = Problem(model, parameters, ready, form, place, Workers(1), None, lambda n: None)
    return _solve(problem, loss)


def projection(present=None):
    """Rows that take mean and drift off a record, fade one second of each end, and give the band.

    And the share of independent values that the ends leave; `present`: where there are values.
    """
    edge = round(1.0 / STEP)
    fade = np.ones(N)
    fade[:edge] = np.sin(0.5 * np.pi * (np.arange(edge) + 0.5) / edge) ** 2
    fade[-edge:] = fade[:edge][::-1]
    fade *= np.sqrt(N / np.sum(fade**2))
    share = np.mean(fade**2) ** 2 / np.mean(fade**4)
    f = np.arange(N // 2) / (N * STEP)
    turns = 2.0 * np.pi * f[(f >= BAND[0]) & (f <= BAND[1]), None] * STEP * np.arange(N)
    rows = np.vstack([np.cos(turns), -np.sin(turns)]) * np.sqrt(2.0 / N)
    there = np.ones(N) if present is None else present
    line, _ = np.linalg.qr(np.stack([there, there * np.arange(N)], axis=1))
    return (rows * fade * there) @ (np.eye(N) - line @ line.T), share


ROWS, INDEPENDENT = projection()


def vector(ready, z, place=True, spread=None):
    """Weighted residuals at logarithms of the factors, shifts and stretches in 0.1 m/km."""
    found = []
    for number, one in enumerate(ready):
        shift, stretch = z[2 + 2 * number : 4 + 2 * number] if place else (0.0, 0.0)
        s = one.run.at
        there = replace(one.run, at=s + shift + 1e-4 * stretch * (s - s[0]))
        keys = [Parameter(name, (name,)) for name in TRUE]
        values = there.simulated(None, keys, z[:2], False)
        found += [
            ROWS @ row / sigma for row, sigma in zip(one.measured - values, NOISE, strict=True)
        ]
    return np.concatenate([*found, [] if spread is None else [-z[1] / spread]])


@points(
    ("place", "spread", "noise"),
    [(True, None, 1.0), (True, 0.02, 2.0), (False, None, 1.0)],
    always=(1, 2),
)
def test_solution_and_covariance_are_those_of_least_squares(place, spread, noise):
    """Above the noise that is stated, what is left is noise too: a factor on the covariance.

    The residuals of white noise have the covariance R R^T, R their projection: that of the solution
    is (J^T J)^-1 J^T R R^T J (J^T J)^-1, and about that of so many independent values as the faded
    ends leave.
    """
    ready = runs(np.random.default_rng(7), noise)
    if not place:
        ready = [one.moved(*at) for one, at in zip(ready, PLACES, strict=True)]
    parameters = [Parameter("a", ("a",)), Parameter("b", ("b",), spread=spread)]
    one = identified(ready, parameters, place)
    begin = [0.2, -0.3, *([0.8, 3.0, -1.1, -2.0] if place else [])]
    best = optimize.least_squares(lambda z: vector(ready, z, place, spread), begin, x_scale="jac")
    count = len(best.fun) - (spread is not None)
    square = np.sum(best.fun[:count] ** 2) / (count - len(begin) / INDEPENDENT)
    inverse, J = np.linalg.inv(best.jac.T @ best.jac), best.jac[:count]
    before = best.jac[count:].T @ best.jac[count:]
    covariance = max(1.0, square) * inverse @ (J.T @ J / INDEPENDENT + before) @ inverse
    noisy = sum(part.T @ ROWS @ ROWS.T @ part for part in np.split(J, 4))
    exact = max(1.0, square) * inverse @ (noisy + before) @ inverse
    assert one.deviations == pytest.approx(np.sqrt(np.diag(exact))[:2], rel=0.01)
    deviations = np.sqrt(np.diag(covariance))
    assert np.abs(one.x - best.x[:2]) == pytest.approx(0.0, abs=0.05 * deviations[:2].min())
    assert one.inflation == pytest.approx(max(1.0, square), rel=1e-3)
    assert one.covariance == pytest.approx(covariance[:2, :2], rel=5e-3)
    assert one.factors == pytest.approx(np.exp(one.x))
    assert one.deviations == pytest.approx(deviations[:2], rel=3e-3)
    normal = stats.norm.ppf(0.975)
    ends = [np.exp(one.x - normal * one.deviations), np.exp(one.x + normal * one.deviations)]
    assert one.intervals == pytest.approx(np.transpose(ends), rel=1e-6)
    assert one.correlation[0, 1] == pytest.approx(
        covariance[0, 1] / np.prod(deviations[:2]), abs=5e-3
    )
    # combinations: what the data alone say of the parameters, whatever the places
    own, places = np.sqrt(INDEPENDENT) * J[:, :2], np.sqrt(INDEPENDENT) * J[:, 2:]
    if place:
        own = own - places @ np.linalg.lstsq(places, own, rcond=None)[0]
    assert one.singular_values == pytest.approx(np.linalg.svd(own)[1], rel=3e-3)
    lines = best.fun[:count].reshape(4, -1)
    for channel, row in zip(one.channels, lines, strict=True):
        assert channel.level == pytest.approx(np.sqrt(np.mean(row**2)), rel=3e-3)
    for number, at in enumerate(one.places):
        d, e = best.x[2 + 2 * number], 1e-4 * best.x[3 + 2 * number]
        assert abs(at.shift - d) < 0.05 * deviations[2 + 2 * number]
        assert abs(at.stretch - e) < 0.05e-4 * deviations[3 + 2 * number]


@pytest.mark.parametrize("gap", [0, 400])
def test_drift_of_a_sensor_is_outside_the_band(gap):
    """Half the rms of a channel over a record left residuals that were not white."""
    one = runs(np.random.default_rng(9), 1.0)[0]
    measured = np.where(np.arange(N) < gap, np.nan, one.measured)
    other = measured + np.outer([3.0, -2.0], np.linspace(-1.0, 4.0, N))
    form = Form("history", BAND)
    same, drifting = (form.features(replace(one, measured=m), m) for m in (measured, other))
    np.testing.assert_allclose(drifting, same, atol=1e-9)


@pytest.mark.parametrize("stated", [True, False])
def test_intervals_of_a_record_with_a_gap_are_those_of_what_is_left(stated):
    """Without a noise that is stated they were those of the whole record, 0.7 of what they are."""
    ready = runs(np.random.default_rng(5), 1.0)
    present = np.abs(np.arange(N) - 0.5 * N) > 0.25 * N
    gaps = [
        replace(
            one.moved(*at),
            measured=np.where(present, one.measured, np.nan),
            noise=one.noise if stated else np.full(2, np.nan),
        )
        for one, at in zip(ready, PLACES, strict=True)
    ]
    found = identified(gaps, [Parameter(name, (name,)) for name in TRUE], place=False)
    rows, _ = projection(present)
    J = []
    for one in gaps:
        u, v, w = (one.run.scale * rows @ waves(k, one.run.at) for k in range(3))
        a, b = found.factors / NOISE[0], found.factors[1] / NOISE[1]
        J += [np.stack([a[0] * u, a[1] * v], axis=1), np.stack([0.0 * w, b * w], axis=1)]
    inverse = np.linalg.inv(sum(part.T @ part for part in J))
    noisy = sum(part.T @ rows @ rows.T @ part for part in J)
    exact = np.sqrt(np.diag(inverse @ noisy @ inverse))
    assert found.deviations == pytest.approx(exact, rel=0.1)
    assert np.mean([channel.level for channel in found.channels]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("loss", ["linear", "soft_l1", "huber", "cauchy"])
def test_weights_of_a_loss_are_the_slopes_of_scipys(loss):
    """rho'(z) at z = (r/5)^2, of the losses as scipy's page of `least_squares` prints them."""
    r = np.linspace(-40.0, 40.0, 81)
    rho = {
        "linear": lambda z: z, "soft_l1": lambda z: 2.0 * ((1.0 + z) ** 0.5 - 1.0),
        "huber": lambda z: np.where(z <= 1.0, z, 2.0 * np.sqrt(np.maximum(z, 0.0)) - 1.0),
        "cauchy": np.log1p,
    }[loss]  # fmt: skip
    z, h = (r / 5.0) ** 2, 1e-6
    slope = (rho(z + h) - rho(z - h)) / (2.0 * h)
    smooth = np.abs(z - 1.0) > 1e-3
    assert _counting(r, loss)[smooth] == pytest.approx(slope[smooth], rel=1e-6)


def test_levels_in_bands_and_sections_are_those_of_the_signal():
    """Of noise the power that is stated is added; a section of 50 m has its mean and deviation."""
    (one, _) = runs(np.random.default_rng(9), 1.0)
    whole = slice(0, int(N * STEP * SPEED / 50.0) * 250)
    rows = Form("sections", BAND).features(one, one.measured)
    for values, row in zip(one.measured[:, whole], rows, strict=True):
        parts = values.reshape(-1, 250)
        count = -(-N // 250)
        assert row[: len(parts)] == pytest.approx(parts.mean(axis=1), abs=1e-12)
        assert row[count : count + len(parts)] == pytest.approx(parts.std(axis=1), rel=1e-9)
    low = 0.53  # Hz: no frequency lies on the border of a band
    form, f = Form("spectra", (low, BAND[1])), np.arange(N // 2) / (N * STEP)
    inside = f[(f >= BAND[0]) & (f <= BAND[1])]
    stated = (BAND[1] - BAND[0]) / (BAND[1] - low)  # noise is that in the band
    for measured in (True, False):
        rows = form.features(one, one.measured, measured=measured)
        for values, sigma, row in zip(one.measured, NOISE, rows, strict=True):
            c = np.sum((ROWS @ values).reshape(2, -1) ** 2, axis=0)
            edges = low * 2.0 ** (np.arange(12) / 3.0)
            parts = [c[(inside >= a) & (inside < a * 2.0 ** (1.0 / 3.0))] for a in edges]
            power = [
                np.mean(p) + (0.0 if measured else 2.0 * stated * sigma**2)
                for p in parts
                if len(p) > 5
            ]
            assert row == pytest.approx(0.5 * np.log(power), rel=1e-6)
    assert form.expected(one) == pytest.approx([np.nan] * 2, nan_ok=True)
    assert Form("history", BAND).expected(one) == pytest.approx(NOISE)


def test_whiteness_is_the_statistic_of_kolmogorov_and_smirnov():
    r = np.random.default_rng(2).normal(size=600) * np.tile(np.linspace(0.8, 1.2, 300), 2)
    power = r[:300] ** 2 + r[300:] ** 2
    shares = np.cumsum(power) / power.sum()
    distance = max(abs(share - (k + 1) / 300.0) for k, share in enumerate(shares))
    statistic, chance = whiteness(r)
    assert statistic == pytest.approx(distance * np.sqrt(300.0))
    series = sum((-1) ** (j - 1) * np.exp(-2.0 * j**2 * statistic**2) for j in range(1, 50))
    assert chance == pytest.approx(2.0 * series, rel=1e-6)


def test_white_residuals_are_white_beside_a_gap_too():
    """Of a record whose half is missing 11 % were not, where 1 % are by chance."""
    rows, share = projection(np.abs(np.arange(N) - 0.5 * N) > 0.25 * N)
    noise = np.random.default_rng(8).normal(size=(400, N))
    probabilities = [whiteness(rows @ row, 0.5 * share)[1] for row in noise]
    assert np.mean(np.array(probabilities) < 0.01) <= 0.02


def outputs_of(x):
    """Three smooth values, a constant, and three with a kink at the parameters themselves."""
    a, b = x
    smooth = np.array([np.exp(2.0 * a + b), np.sin(0.3 + 4.0 * a - 5.0 * b), 2.0 + 3.0 * b])
    kinks = [1.0 + max(a, 0.0)], [2.0 + 4.0 * a, 1.0 + abs(b)], [5.0 + 2.0 * min(b, 0.0)]
    return [smooth, np.array([7.0]), *map(np.array, kinks)]


SLOPES = [
    [[2.0, 4.0 * np.cos(0.3), 0.0], [1.0, -5.0 * np.cos(0.3), 3.0]], [[0.0], [0.0]],
    [[0.5], [0.0]], [[4.0, 0.0], [0.0, 0.0]], [[0.0], [1.0]],
]  # fmt: skip
KINKS = {(2, 0): 1.0, (3, 1): 0.5, (4, 1): 1.0}
"""Share of the values with a kink, by output and parameter."""


def test_derivatives_by_differences_are_those_of_the_functions():
    """Central ones within their error; where sides differ, their mean, and that there is none."""
    asked = []

    def variants(points, pool):
        asked.extend(points)
        return [outputs_of(x) for x in points]

    job = SimpleNamespace(parameters=("a", "b"), variants=variants)
    base = outputs_of(np.zeros(2))
    found, runs = _central(job, base, None)
    assert runs == len(asked) + 1
    for k, row in enumerate(SLOPES):
        for j, slope in enumerate(row):
            one = found[k][j]
            assert one.value == pytest.approx(slope, rel=5e-4, abs=1e-9), (k, j)
            assert one.is_smooth != ((k, j) in KINKS), (k, j)
            assert one.kinked == KINKS.get((k, j), 0.0)
            if one.is_smooth and np.any(slope):
                exact = np.linalg.norm(one.value - slope) / np.linalg.norm(slope)
                assert exact <= 10.0 * one.error + 1e-9  # it is an estimate
            assert one.error < 2e3  # it is told in per cent
    asked.clear()
    found, runs = _forward(job, base, None)
    assert runs == len(asked) + 1 == 4
    step = found[0][0].step
    for j, slope in enumerate(SLOPES[0]):
        assert found[0][j].value == pytest.approx(slope, abs=20.0 * step)
        assert found[0][j].error < 30.0 * step
    # the last variant moves all parameters back: a kink shows
    assert [one.is_smooth for one in (found[1][0], found[2][0], found[4][1])] == [
        True,
        False,
        False,
    ]
    assert all(one.error < 2e3 for row in found for one in row)


def test_table_of_derivatives_shows_root_mean_squares():
    values = np.array([3.0, -4.0, 12.0]), np.array([1.0, 2.0, -2.0])
    one = Derivative(values[1], 0.02, 1e-2, 0.0)
    found = Sensitivity((), ("Q",), None, {"Q": values[0]}, {("Q", "a"): one}, 3)
    (row,) = found.table().records()
    assert row["rms"] == pytest.approx(np.sqrt(169.0 / 3.0))
    assert row["derivative"] == pytest.approx(np.sqrt(9.0 / 3.0))
    assert (row["error"], row["step"], row["smooth"]) == (0.02, 1e-2, "yes")
    assert found["Q", "a"] is one.value


def test_evaluations_that_are_kept_are_of_these_profiles_and_amplifiers(tmp_path):
    """What a run gives depends on the points of a profile and on the low pass of a channel."""
    wheel = tmp_path / "wheel.csv"
    save_profile(railsim.load_profile("S1002"), wheel)
    axle = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"
    vehicle = railsim.load_vehicle("coach_manchester").with_values({axle: str(wheel)})
    keys = [Parameter(one, (one,)) for one in TRUE]
    ready = runs(np.random.default_rng(7), 1.0)[:1]

    def simulated(ready):
        how = Form("history", BAND), False, Workers(1), tmp_path, lambda n: None
        problem = Problem(SimpleNamespace(vehicle=vehicle), keys, ready, *how)
        problem.series(np.zeros(2))
        return problem.simulations

    assert [simulated(ready), simulated(ready)] == [1, 0]
    for corners in ((5.0, None), (None, 5.0)):
        amplifier = SimpleNamespace(low_pass=corners[0], high_pass=corners[1])
        run = replace(ready[0].run, amplifiers=(amplifier,))
        assert simulated([replace(ready[0], run=run)]) == 1
    save_profile(railsim.load_profile("cone_1in40"), wheel)
    assert [simulated(ready), simulated(ready)] == [1, 0]


def test_runs_of_the_first_search_by_a_part_count_with_the_others(monkeypatch):
    """Of runs of 26 s the first 8 s are searched before; every simulated run is counted once."""
    monkeypatch.setitem(globals(), "N", 2600)
    calls, simulated = [], Known.simulated

    def counted(run, *arguments):
        calls.append(len(run.at))
        return simulated(run, *arguments)

    ready = [one.moved(*at) for one, at in zip(runs(np.random.default_rng(7), 1.0), PLACES,
                                               strict=True)]  # fmt: skip
    monkeypatch.setattr(Known, "simulated", counted)
    told = []
    form, parameters = Form("history", BAND), [Parameter(name, (name,)) for name in TRUE]
    model = SimpleNamespace(vehicle=FILE)
    problem = Problem(model, parameters, ready, form, False, Workers(1), None, told.append)
    found = _solve(problem, "linear")
    assert set(calls) == {800, 2600}
    assert found.simulations == told[-1] == len(calls)
    assert told == sorted(told)
    assert found.factors == pytest.approx(list(TRUE.values()), rel=0.02)


@pytest.mark.parametrize(
    ("text", "taken"),
    [
        ("a:0.5:2", True), ("a:0.01:1.01", True), ("a:0:2", False), ("a:-1:2", False),
        ("a:0.5:1", False), ("a:1:2", False), ("a:1.1:2", False), ("a:0.5:0.9", False),
        ("wheel:S1002:S1002", True), ("wheel:S1002:S1002:0:1", True),
        ("wheel:S1002:S1002:0.2:0.4", True), ("wheel:S1002:S1002:-0.01:1", False),
        ("wheel:S1002:S1002:0:1.01", False), ("wheel:S1002:S1002:0.4:0.4", False),
        ("wheel:S1002:S1002:0.4:0.2", False), ("a:0.5:2:0.1", True), ("a:0.5:2:0", False),
        ("a:0.5", False), ("a:0.5:2:0.1:3", False),
    ],
)  # fmt: skip
def test_bounds_of_factors_are_around_1_and_of_shares_from_0_to_1(text, taken):
    if taken:
        numbers = [float(x) for x in text.split(":") if x.replace(".", "").isdigit()]
        found = _parse(text)
        assert (found.low, found.high) == tuple(numbers[:2] or (0.0, 1.0))
        assert found.spread == (numbers[2] if len(numbers) > 2 else None)
    else:
        with pytest.raises(ValueError, match=r"bounds|SPREAD|number"):
            _parse(text)


def test_a_factor_lies_between_a_tenth_and_ten_where_nothing_is_said():
    assert Parameter("a", ("a",)).bounds == pytest.approx((-np.log(10.0), np.log(10.0)))
    assert Parameter("a", ("a",), low=0.5, high=4.0).bounds == pytest.approx(np.log([0.5, 4.0]))


@pytest.mark.parametrize(("probability", "white"), [(0.0105, True), (0.0095, False),
                                                    (np.nan, True)])  # fmt: skip
def test_residuals_are_white_where_chance_gives_their_statistic_once_in_a_hundred(
    probability, white
):
    none = np.zeros(3)
    one = Channel("run", "Q", "Q:1:left", STEP, none, none, none, none, 1.0, 1.6, probability)
    assert one.is_white is white


@pytest.mark.parametrize("stated", [True, False])
def test_residuals_of_data_without_noise_are_not_judged(stated):
    """They are the round-off of the search, of some colour, and say nothing of the model."""
    ready = runs(np.random.default_rng(7), 0.0)
    if not stated:
        ready = [replace(one, noise=np.full(2, np.nan)) for one in ready]
    one = identified(ready, [Parameter(name, (name,)) for name in TRUE])
    assert one.factors == pytest.approx(list(TRUE.values()), rel=1e-9)
    assert all(np.isnan(channel.probability) for channel in one.channels)
    assert not one.remarks


def test_pictures_name_their_run_and_lines_differ_in_black_and_white():
    s = np.arange(600.0)
    one = Channel("run 12", "Q1L", "Q:1:left", 0.02, s, s, s, s, 1.0, 1.6, 0.5)
    found = SimpleNamespace(channels=(one,), band=(0.5, 20.0))
    drawn = plots.fits(found), plots.residual_spectra(found)
    assert [figure.get_suptitle() for figure in drawn] == ["run 12", "run 12"]
    _, before, after = drawn[0].axes[0].lines
    assert before.get_linestyle() != after.get_linestyle()


def test_the_picture_of_residuals_shows_what_is_judged():
    """A static difference in a record with a gap, which does not count, bent the line by 0.8."""
    rest = 50.0 + np.random.default_rng(10).normal(size=2000)
    rest[900:1100] = np.nan
    s = np.arange(2000.0)
    one = Channel("run", "Q1L", "Q:1:left", 0.02, s, rest, 0.0 * s, 0.0 * s, 1.0, 1.0, 0.5)
    figure = plots.residual_spectra(SimpleNamespace(channels=(one,), band=(0.5, 20.0)))
    _, line = figure.axes[0].lines
    f, share = line.get_data()
    assert np.abs(share - (f - 0.5) / 19.5).max() < 0.06


def test_a_stretch_of_more_than_a_metre_in_a_kilometre_is_said(monkeypatch):
    monkeypatch.setitem(globals(), "PLACES", [(0.8, 1.3e-3), (-1.1, -0.9e-3)])
    found = identified(runs(np.random.default_rng(7), 0.1), [Parameter(n, (n,)) for n in TRUE])
    (said,) = [remark for remark in found.remarks if "stretched" in remark]
    assert said.startswith("run 0: its arc length is stretched by +1.30 m/km")


def test_an_identified_profile_is_that_of_the_wheels_that_had_it():
    """Left and right wheel; a wheelset whose profile is not sought keeps its own."""
    axle = "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"
    coach = railsim.load_vehicle("coach_manchester")
    files = {"cone_1in20": "found.csv"}
    for pair, expected in (
        (["cone_1in20", "S1002"], ["found.csv", "S1002"]),
        (["S1002", "cone_1in20"], ["S1002", "found.csv"]),
        (["cone_1in20", "cone_1in20"], ["found.csv", "found.csv"]),
    ):
        assert exchanged_wheels(coach.with_values({axle: pair}), files) == {axle: expected}
    assert exchanged_wheels(coach, files) == {}
