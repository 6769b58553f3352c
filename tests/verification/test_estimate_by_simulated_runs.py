"""An estimate put right by simulated runs, and sizes of errors that are not known before."""

import numpy as np
import pytest
from scipy.signal import butter, freqs

import railsim
from railsim.definitions.excitations.base import CHANNELS
from railsim.definitions.measurement import Channel
from railsim.observation import Assumed, simulated
from railsim.observation.estimate import _merge_ranges
from railsim.observation.innovations import Powers, likely_sizes, spectra_of
from railsim.observation.pieces import STEP, Piece
from railsim.observation.simulated import CHANGE, Reading, SimulatedRun, _series, refine

N = 400


def smooth(seed=3):
    """Two fields, made of waves of 20 points and longer."""
    rng = np.random.default_rng(seed)
    spectra = np.zeros((2, N // 2 + 1), dtype=complex)
    spectra[:, 1:20] = rng.normal(size=(2, 19)) + 1j * rng.normal(size=(2, 19))
    found = np.fft.irfft(spectra, N, axis=1)
    return found / found.std()


def solved(law, most=40):
    """Channels read law(r); the linear response is r, the gain nearly its inverse."""
    truth = smooth()
    y = law(truth)
    return truth, refine(
        lambda r: Reading(law(r), np.empty((0, N))),
        lambda data: data / 1.001,
        lambda r: r,
        (y, np.ones(y.shape, dtype=bool)),
        (y / 1.001, np.ones(2)),
        most,
    )  # fmt: skip


def test_a_linear_vehicle_keeps_its_linear_estimate():
    truth, found = solved(lambda r: 1.0 * r)
    assert found.change < 1e-9
    assert found.fields == pytest.approx(truth / 1.001)


def test_a_steep_law_is_solved_where_simple_steps_diverge():
    """r + r^3/10 has slopes up to 3.7 at |r| = 3: steps with the gain of r grow there."""
    truth, found = solved(lambda r: r + 0.1 * r**3)
    linear = (truth + 0.1 * truth**3) / 1.001
    simple = linear.copy()
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(20):
            simple = (truth + 0.1 * truth**3 - 0.1 * simple**3) / 1.001
    assert not np.abs(simple - truth).max() < 10.0
    assert found.change < 0.02
    assert np.std(found.fields - truth) < 3.0 * CHANGE < 0.2 * np.std(linear - truth)


def test_gaps_and_constants_of_the_data_change_nothing():
    """r = y less the channel's mean where y is known, whatever stands in its gaps."""
    truth = smooth()
    there = np.ones(truth.shape, dtype=bool)
    there[0, 100:180] = there[1, 50:60] = False
    y = np.where(there, truth + np.array([[5.0], [-3.0]]), 1e3)
    found = refine(
        lambda r: Reading(1.0 * r, np.empty((0, N))), lambda data: data, lambda r: r,
        (y, there), (np.zeros_like(y), np.ones(2)), 40,
    )  # fmt: skip
    mean = np.sum(truth * there, axis=1, keepdims=True) / there.sum(axis=1, keepdims=True)
    assert found.change < CHANGE
    assert np.abs(found.fields - np.where(there, truth - mean, 0.0)).max() < 5.0 * CHANGE


def test_a_run_that_ends_early_is_said():
    found = refine(
        lambda r: "derailed: wheelset 1", lambda y: y, lambda r: r,
        (np.zeros((2, N)), np.ones((2, N), dtype=bool)), (np.zeros((2, N)), np.ones(2)), 5,
    )  # fmt: skip
    assert found == "derailed: wheelset 1"


def test_spectra_are_those_of_the_reversed_track_and_keep_the_power():
    """White noise of 0.3 about 5, with a gap: the rms over the bins is 0.3 within 5 %."""
    x = 5.0 + 0.3 * np.random.default_rng(2).normal(size=(2, 3000))
    there = np.ones(x.shape, dtype=bool)
    there[1, 700:1500] = False
    found = np.abs(spectra_of(x, there, 4096))
    back = np.abs(spectra_of(x[:, ::-1], there[:, ::-1], 4096))
    assert found == pytest.approx(back, rel=1e-6, abs=1e-9)
    assert np.sqrt(np.mean(found**2, axis=1) / 4096) == pytest.approx([0.3, 0.3], rel=0.05)
    # cosines at the ends: of a slope, whose periodic continuation jumps, nothing is left at high k
    slope = np.abs(spectra_of(np.linspace(-1.0, 1.0, 3000)[None], there[:1], 3000))
    assert slope[0, 500:].max() < 1e-5 * slope.max()


def test_sizes_of_errors_are_those_of_the_data():
    """Data drawn with known sizes: found within three standard deviations of such an estimate."""
    k = np.arange(1.0, 769.0) / 768.0
    channels, wheelsets = 24, 2
    rng = np.random.default_rng(1)
    response = rng.normal(size=(len(k), channels, 4 + 4 * wheelsets)) + 0j
    powers = Powers(
        points=2 * (len(k) - 1),
        track=np.tile([1.0, 2.0, 1.5, 0.5], (len(k), 1)),
        unknown=np.full((len(k), 4 * wheelsets), 0.05),
        response=response,
        white=np.full((len(k), channels), 1e-4),
    )
    true_model, true_contact = np.tile([0.02, 0.3, 0.05, 0.1, 0.2, 0.08], 4), (0.5, 4.0)

    def drawn(power):
        return np.sqrt(power / 2.0) * (
            rng.normal(size=power.shape) + 1j * rng.normal(size=power.shape)
        )

    kinds = np.tile([true_contact[0], true_contact[1], true_contact[1], true_contact[0]], wheelsets)
    fields = drawn(np.hstack([powers.track, powers.unknown * kinds]))
    data = np.einsum("kcf,kf->kc", response, fields)
    data += drawn(powers.white + true_model**2 * powers.signal)
    found = likely_sizes(powers, np.sqrt(powers.points) * data.T)
    assert found.model == pytest.approx(true_model, rel=0.3)
    assert found.contact == pytest.approx(true_contact, rel=0.35)


@pytest.mark.parametrize(
    "changes", [{"friction_table": [[0.0, 0.2], [900.0, 0.4]]}, {"gauge_widening": [[0.0, 0.01]]}]
)
def test_a_run_on_track_that_differs_from_place_to_place_begins_at_its_place(changes):
    track, grid = railsim.load_track("straight"), 500.0 + STEP * np.arange(N)
    piece = Piece(grid, np.zeros((0, N)), np.zeros((0, N), dtype=bool), np.full(N, 40.0), 500.0)
    coach = railsim.load_vehicle("coach_manchester")
    assert SimulatedRun(coach, track, piece, {}, []).is_steady
    run = SimulatedRun(coach, track.replace(**changes), piece, {}, [])
    assert not run.is_steady
    assert run._start == pytest.approx(400.0)


@pytest.mark.parametrize("widening", [None, [[0.0, 0.01]]])
def test_readings_and_forces_are_those_of_the_run_at_the_places_of_its_piece(monkeypatch, widening):
    """Each by its name, wave by wave; an amplifier is as late in the run as in the record."""
    track, grid = railsim.load_track("straight"), 500.0 + STEP * np.arange(N)
    track = track.replace(gauge_widening=widening) if widening else track
    moved = 0.0 if widening else 400.0  # where all places are alike a run begins at 0
    time = np.arange(0.0, 40.0, 1.0 / 400.0)
    s = 400.0 + 20.0 * time - moved
    lengths = {
        "axle.y": 11.0, "axle.z": 13.0, "axle.roll_rate": 17.0, "lateral.2": 19.0, "Q.1.left": 23.0,
        "Q.2.right": 29.0, "Y.1.right": 31.0, "sum_Y.2": 37.0,
    }  # fmt: skip
    waves = {name: np.sin(2.0 * np.pi * (s + moved) / L) for name, L in lengths.items()}

    class Run(dict):
        status = "complete"

        def series(self, name, sensor, axis=None):
            return waves[f"{sensor}.{axis or 'roll_rate'}"]

    empty = np.full((len(s), 2, 2), np.nan)
    Q, Y, sums, lateral = empty.copy(), empty.copy(), empty[..., 0].copy(), empty[..., 0].copy()
    Q[:, 0, 0], Q[:, 1, 1], Y[:, 0, 1] = waves["Q.1.left"], waves["Q.2.right"], waves["Y.1.right"]
    sums[:, 1], lateral[:, 1] = waves["sum_Y.2"], waves["lateral.2"]
    run = Run(time=time, distance=s, Q=Q, Y=Y, sum_Y=sums, wheelset_lateral=lateral)
    monkeypatch.setattr(simulated, "simulate", lambda *_, **__: run)
    piece = Piece(grid, np.zeros((0, N)), np.zeros((0, N), dtype=bool), np.full(N, 20.0), 500.0)
    late = Channel(quantity="sensor_acceleration:axle:y", low_pass=4.0)
    plain = Channel(quantity="sensor_acceleration:axle:z")
    outputs = {name: late if name == "axle.y" else plain for name in list(lengths)[:4]}
    coach = railsim.load_vehicle("coach_manchester")
    read = SimulatedRun(coach, track, piece, outputs, list(lengths)[4:])(np.zeros((4, N)))
    found = [*read.channels, *read.forces]
    inside, butterworth = slice(80, -80), freqs(*butter(4, 4.0, analog=True), worN=[20.0 / 11.0])
    for (name, length), values in zip(lengths.items(), found, strict=True):
        answer = butterworth[1][0] if name == "axle.y" else 1.0
        expected = (answer * np.exp(2j * np.pi * grid / length)).imag
        assert values[inside] == pytest.approx(expected[inside], abs=0.01), name


@pytest.mark.parametrize(("widening", "begin"), [(None, 100.0), ([[0.0, 0.01]], 500.0)])
def test_a_run_goes_from_100_m_ahead_of_its_piece_to_15_m_beyond(monkeypatch, widening, begin):
    """On rails that are irregular as far as the smoother has them, whose fields are periodic.

    What lies beyond the end of the grid is ahead of its begin too; where all places are alike the
    run begins at 0.
    """
    seen = {}

    def simulate(vehicle, track, **how):
        seen.update(how, track=track)
        raise LookupError

    monkeypatch.setattr(simulated, "simulate", simulate)
    track, grid = railsim.load_track("straight"), 500.0 + STEP * np.arange(N)
    track = track.replace(gauge_widening=widening) if widening else track
    piece = Piece(grid, np.zeros((0, N)), np.zeros((0, N), dtype=bool), np.full(N, 40.0), 500.0)
    run = SimulatedRun(railsim.load_vehicle("coach_manchester"), track, piece, {}, [])
    more = round(60.0 / STEP)  # beyond the grid
    wave = 1.0 + 0.2 * np.cos(2.0 * np.pi * np.arange(N + more) / (N + more))
    sizes = {"alignment": 4.0, "level": 3.0, "cross_level": 2.0, "gauge": 1.0}  # mm
    with pytest.raises(LookupError):
        run(1e-3 * np.outer(list(sizes.values()), wave))
    end = begin + STEP * (N - 1)
    assert (seen["start"], seen["until"]) == pytest.approx((begin - 100.0, end + 15.0))
    rows = seen["track"].irregularities[0].rows
    assert rows[0][0] <= begin - 100.0
    assert rows[-1][0] > end + 15.0
    assert seen["track"].length > end + 15.0
    # from nothing 60 m ahead of the grid, and to nothing 30 m beyond it, in a straight line
    s, y_left, z_left, y_right, z_right = np.transpose(rows)
    share = np.interp(s, [begin - 60.0, begin, end, end + 30.0], [0.0, 1.0, 1.0, 0.0])
    share *= wave[np.round((s - begin) / STEP).astype(int) % (N + more)]
    for found, name in (
        (0.5 * (y_left + y_right), "alignment"), (0.5 * (z_left + z_right), "level"),
        (z_right - z_left, "cross_level"), (y_right - y_left, "gauge"),
    ):  # fmt: skip
        assert 1e3 * found == pytest.approx(sizes[name] * share, abs=0.02 * sizes[name])


@pytest.mark.parametrize(("spread", "steady"), [(0.009, True), (0.011, False)])
def test_a_speed_is_constant_within_a_hundredth_of_its_mean(spread, steady):
    speeds = 40.0 + np.linspace(-0.5, 0.5, N) * spread * 40.0
    grid = 500.0 + STEP * np.arange(N)
    piece = Piece(grid, np.zeros((0, N)), np.zeros((0, N), dtype=bool), speeds, 500.0)
    coach, track = railsim.load_vehicle("coach_manchester"), railsim.load_track("straight")
    assert SimulatedRun(coach, track, piece, {}, []).is_steady is steady


@pytest.mark.parametrize(
    ("own", "apart", "one"),
    [((), 2.09, True), ((), 2.11, False), ((1.0, 0.5), 2.49, True), ((1.0, 0.5), 2.51, False)],
)
def test_ranges_that_nearly_touch_are_one(own, apart, one):
    """Waves by a twentieth of their length, places by a distance; one within another adds none."""
    found = _merge_ranges([(1.0, 2.0), (1.2, 1.5), (apart, 4.0)], *own)
    assert found == ([(1.0, 4.0)] if one else [(1.0, 2.0), (apart, 4.0)])


def test_forces_of_a_simulated_run_are_those_of_their_wheel_or_wheelset():
    """Wheelsets count from 1, the left wheel before the right one."""
    Q = np.arange(24.0).reshape(3, 4, 2)
    result = {"Q": Q, "Y": -Q, "sum_Y": 100.0 + Q[..., 0], "wheelset_lateral": 200.0 + Q[..., 0]}
    for w in range(4):
        for k, side in enumerate(("left", "right")):
            assert _series(result, f"Q.{w + 1}.{side}").tolist() == Q[:, w, k].tolist()
            assert _series(result, f"Y.{w + 1}.{side}").tolist() == (-Q[:, w, k]).tolist()
        assert _series(result, f"sum_Y.{w + 1}").tolist() == (100.0 + Q[:, w, 0]).tolist()
        assert _series(result, f"lateral.{w + 1}").tolist() == (200.0 + Q[:, w, 0]).tolist()


def test_power_that_is_assumed_has_the_variance_of_the_source_within_the_wavelengths():
    """ERRI B176, low: cross level as an angle, which is a height over 1.5 m; b = 0.75 m.

    Two-sided power over the points of a record: the mean square is its sum over both sides.
    """
    A, omega_c, omega_r, omega_s = (4.032e-7, 0.8246, 0.0206, 0.4380)
    w = np.linspace(2.0 * np.pi / 60.0, 2.0 * np.pi / 4.0, 200_001)
    level = A * omega_c**2 / ((w**2 + omega_r**2) * (w**2 + omega_c**2))
    angle = level * w**2 / (w**2 + omega_s**2) / 0.75**2
    points = 4000
    k = 2.0 * np.pi * np.fft.rfftfreq(points, STEP)
    assumed = Assumed("erri_b176_low", scale=1.3, wavelengths=(4.0, 60.0))
    sums = 2.0 * assumed.power(k, points).sum(axis=0) / points
    found = dict(zip(CHANNELS, sums, strict=True))
    assert found["vertical"] == pytest.approx(1.3**2 * np.trapezoid(level, w), rel=1e-4)
    assert found["cross_level"] == pytest.approx(1.3**2 * 1.5**2 * np.trapezoid(angle, w), rel=1e-4)
