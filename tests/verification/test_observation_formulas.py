"""Pieces of a run and what its channels say of each other, of signals that are known."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from railsim.definitions.loading import load_track, load_vehicle
from railsim.errors import InputError
from railsim.linear.track_response import QUANTITIES, TrackResponse
from railsim.measurement import load_measurement
from railsim.observation import contact, irregularity
from railsim.observation.contact import Noise, _smoothed
from railsim.observation.estimate import BANDS, Estimate, estimate_of, join_pieces
from railsim.observation.innovations import (
    Powers,
    Sizes,
    _disagreement,
    disagreeing_channels,
    level_of,
    spectra_of,
)
from railsim.observation.pieces import Piece, on_grid, pieces_of
from railsim.track.irregularity import displacement

N = 2000  # points of a piece
STEP = 0.25  # m


class Made(dict):
    """A result of given histories."""

    status = "complete"


class Run:
    """A measured run with one channel, which is a wave of 12 m with a gap, at a given speed."""

    name, rate = "made", 500.0

    def __init__(self, distance, speed):
        self.distance, self.speed = distance, speed

    def part(self, begin, end):
        rows = (self.distance >= begin) & (self.distance <= end)
        return Run(self.distance[rows], self.speed[rows])

    def __getitem__(self, name):
        wave = np.sin(2.0 * np.pi * self.distance / 12.0)
        lost = (self.distance > 400.0) & (self.distance < 402.0)
        return np.where(lost & (name == "a"), np.nan, np.nan if name == "none" else wave)


@pytest.mark.parametrize(
    ("length", "slow", "gain", "begin"),
    [(500.0, 20.0, 0.0, 0.0), (4700.0, 30.0, 0.03, 5.0), (2600.0, 10.0, 1.5, 0.3),
     (2000.0, 30.0, -0.4, 50.0), (800.0, 8.0, -0.5, 0.0)],
)  # fmt: skip
def test_pieces_cover_a_run_but_its_ends_and_keep_their_speed(length, slow, gain, begin):
    """20 m at both ends are left out; up to 2000 m, speeds in a ratio of 1.06, 300 m at least."""
    s = begin + np.arange(0.0, length, 0.1)
    v = slow * (1.0 + gain * np.linspace(0.0, 1.0, len(s)))
    run = Run(s, v)
    if v.min() < 5.0:
        with pytest.raises(InputError, match="speed"):
            pieces_of(run, ["a"])
        return
    found = pieces_of(run, ["a", "none"])
    assert found[0].grid[0] == pytest.approx(s[0] + 20.0)
    assert found[-1].grid[-1] == pytest.approx(s[-1] - 20.0, abs=STEP)
    for before, after in pairwise(found):
        shared = before.grid[-1] - after.grid[0]
        assert shared == pytest.approx(200.0, abs=STEP)
    for one in found:
        extent = one.grid[-1] - one.grid[0]
        np.testing.assert_allclose(np.diff(one.grid), STEP)
        np.testing.assert_allclose(one.speeds, np.interp(one.grid, s, v), rtol=1e-6)
        assert one.speed == pytest.approx(one.speeds.mean(), rel=5e-3)
        assert extent <= 2000.0 + 100.0 + STEP
        ratio = one.speeds.max() / one.speeds.min()
        assert ratio < 1.061 or extent < 300.0 + 100.0 + STEP
        known = one.valid[0]
        beside = np.abs(one.grid - 401.0) < 1.0 + 8.0 * STEP - 0.1
        assert not known[beside].any()
        assert known[np.abs(one.grid - 401.0) > 1.0 + 10.0 * STEP].all()
        wave = np.sin(2.0 * np.pi * one.grid / 12.0)
        far = np.abs(one.grid - 401.0) > 12.0
        np.testing.assert_allclose(one.signals[0][far], wave[far], atol=5e-3)
        assert not one.signals[1].any()
        assert not one.valid[1].any()


@pytest.mark.parametrize(("wave", "passed"), [(0.4, 0.0), (0.9, 1.0), (5.0, 1.0), (0.5, 0.5)])
def test_a_grid_shows_waves_of_two_steps_and_more(wave, passed):
    s = np.arange(0.0, 200.0, 0.02) + 1e-3 * np.sin(np.arange(10_000))
    grid = np.arange(30.0, 170.0, STEP)
    found = [on_grid(s, of(2.0 * np.pi * s / wave), grid) for of in (np.sin, np.cos)]
    exact = [of(2.0 * np.pi * grid / wave) for of in (np.sin, np.cos)]
    shares = np.mean(np.multiply(found, exact)) * 2.0
    assert shares == pytest.approx(passed, abs=0.02)


@pytest.mark.parametrize("own", [0.02, 0.11, 0.25, 0.4])
def test_a_grid_shows_straight_lines_up_to_both_ends(own):
    """Weights that are symmetric and add up to 1, and ends continued antisymmetrically."""
    s = 10.0 + own * np.arange(round(60.0 / own))
    grid = np.arange(10.0, s[-1], STEP)
    np.testing.assert_allclose(on_grid(s, 3.0 - 0.2 * s, grid), 3.0 - 0.2 * grid, atol=1e-9)


def test_spectra_have_the_power_of_the_signal_whatever_is_left_out():
    """Of white noise its variance; the mean does not count."""
    random = np.random.default_rng(1)
    x = np.array([[0.5], [2.0], [1.0]]) * random.normal(size=(3, N)) + 30.0
    there = np.ones((3, N), dtype=bool)
    there[1, 500:900] = False
    x[~there] = 1e6
    spectra = spectra_of(x, there, 2400)
    power = np.mean(np.abs(spectra) ** 2, axis=1) / 2400.0
    assert power == pytest.approx([0.25, 4.0, 1.0], rel=0.08)
    assert np.abs(spectra[:, 0]) ** 2 / 2400.0 == pytest.approx(0.0, abs=60.0)
    assert not spectra_of(np.zeros((1, N)), there[:1], 2400).any()


def powers(random):
    """Two fields, seen by five channels with noise of 0.02."""
    k = np.fft.rfftfreq(N, STEP)
    track = np.zeros((len(k), 4))
    track[1:, :2] = 1e-2 / (0.02 + k[1:, None] ** 2)
    H = np.zeros((len(k), 5, 8), dtype=complex)
    H[:, :, :2] = random.normal(size=(5, 2)) + 1j * k[:, None, None] * random.normal(size=(5, 2))
    return Powers(N, track, np.zeros((len(k), 4)), H, np.full((len(k), 5), 4e-4))


def channels(random, given):
    fields = random.normal(size=(2, N))
    spectra = np.fft.rfft(fields, axis=1) * np.sqrt(given.track[:, :2].T)
    read = np.fft.irfft(np.einsum("kcq,qk->ck", given.response[:, :, :2], spectra), N, axis=1)
    return read + 0.02 * random.normal(size=read.shape)


@pytest.mark.parametrize(
    ("wrong", "change", "words"),
    [
        (None, lambda x: x, None), (2, lambda x: -x, "opposite sign"),
        (0, lambda x: 9.81 * x, "9.8 times"), (4, lambda x: np.roll(x, 400), "does not agree"),
    ],
)  # fmt: skip
def test_the_channel_that_the_others_contradict_is_named(wrong, change, words):
    random = np.random.default_rng(5)
    given = powers(random)
    read = channels(random, given)
    assert level_of(given, spectra_of(read, np.ones(read.shape, bool), N)) == pytest.approx(
        1.0, rel=0.25
    )
    loud = spectra_of(7.0 * read, np.ones(read.shape, bool), N)
    assert level_of(given, loud) == pytest.approx(7.0, rel=0.25)
    if wrong is not None:
        read[wrong] = change(read[wrong])
    piece = SimpleNamespace(valid=np.ones(read.shape, dtype=bool))
    names = [f"channel {c}" for c in range(5)]
    found, said = disagreeing_channels(given, piece, read, names)
    assert found == (set() if wrong is None else {wrong})
    assert len(said) == len(found)
    if wrong is not None:
        assert said[0].startswith(names[wrong])
        assert words in said[0]


@pytest.mark.parametrize(
    ("correlation", "ratio", "beyond", "words"),
    [
        (-0.31, 1.0, 0.0, "opposite sign"), (-0.29, 1.0, 0.0, ""),
        (0.31, 3.1, 0.0, "3.1 times"), (0.31, 2.9, 0.0, ""), (0.31, 0.32, 0.0, "0.32 times"),
        (0.31, 0.35, 0.0, ""), (0.29, 9.0, 0.0, ""),
        (0.29, 9.0, 31.0, "does not agree"), (0.29, 9.0, 29.0, ""), (0.31, 1.0, 99.0, ""),
        (-0.29, 1.0, 31.0, "does not agree"),
    ],
)  # fmt: skip
def test_a_channel_is_wrong_by_sign_by_size_or_by_what_nobody_else_reads(
    correlation, ratio, beyond, words
):
    """From a correlation of 0.3 on, threefold or a third, with thirty times the errors' power."""
    said = _disagreement(correlation, ratio, beyond)
    assert words in said
    assert bool(said) == bool(words)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("share", "rests"), [(0.2e-9, True), (5e-9, False)])
def test_a_channel_rests_by_its_size_over_the_largest_whatever_the_unit(unit, share, rests):
    """A billionth of the channel that moves most."""
    random = np.random.default_rng(5)
    given = powers(random)
    read = channels(random, given)
    sizes = np.linalg.norm(read, axis=1)
    read[3] *= share * sizes.max() / sizes[3]
    piece = SimpleNamespace(valid=np.ones(read.shape, dtype=bool))
    names = [f"channel {c}" for c in range(5)]
    _, said = disagreeing_channels(given, piece, unit * read, names)
    assert ("channel 3 rests: a dead sensor? It is left out." in said) is rests


@pytest.mark.parametrize(("reading", "found"), [(4, {2}), (3, set())])
def test_of_three_channels_none_can_be_said_to_be_the_wrong_one(reading, found):
    random = np.random.default_rng(5)
    given = powers(random)
    read = channels(random, given)
    read[2] = -read[2]
    there = np.ones(read.shape, dtype=bool)
    there[reading:] = False
    piece = SimpleNamespace(valid=there)
    assert disagreeing_channels(given, piece, read, [f"channel {c}" for c in range(5)])[0] == found


def test_powers_of_sizes_are_those_of_their_parts():
    """Errors of the model are shares of what a channel reads; contacts in y and yaw, z and roll."""
    random = np.random.default_rng(6)
    given = powers(random)
    unknown = random.uniform(1.0, 2.0, (len(given.track), 8))
    given = Powers(N, given.track, unknown, given.response, given.white)
    model = random.uniform(0.01, 0.1, 5)
    fields = given.fields(Sizes(np.array([3.0, 7.0]), model))
    assert fields.power[:, 4:] == pytest.approx(unknown * np.tile([3.0, 7.0, 7.0, 3.0], 2))
    own = np.sum(np.abs(given.response[:, :, :4]) ** 2 * given.track[:, None], axis=2)
    assert given.signal == pytest.approx(own)
    assert fields.errors == pytest.approx(given.white + model**2 * own)


def test_smoothed_spectra_keep_their_mean_and_noise_its_power_at_any_step():
    """Over 15 % of the wave number, and four bins at least; of halved steps half of the power."""
    k = np.arange(400.0)
    row = np.random.default_rng(7).uniform(size=400)
    (found,) = _smoothed(k, row[None])
    for i in (0, 3, 20, 100, 399):
        half = max(4, int(0.15 * i))
        assert found[i] == pytest.approx(np.mean(row[max(0, i - half) : i + half + 1]))
    noise = Noise(k, np.tile(row[:, None], 4), 1e-3)
    assert noise.at(k, 0.25) == pytest.approx(np.tile(row[:, None], 4), abs=2e-12)
    assert noise.at(k, 0.5) == pytest.approx(np.tile(row[:, None] / 2.0, 4), abs=2e-12)


def test_contact_in_the_mean_of_a_run_with_linear_contact_is_that_contact(monkeypatch):
    """Accelerations A x + B u + gain (y - u, yaw and rates); in z and roll known white noise.

    Two wheelsets 4 m apart; one state of an element that follows the first, h' = (3 y + 2 u - h)/T.
    Noise that is alike where both pass counts twice, of opposite signs once.  y has a slow swing,
    whose mean within the window is not zero.
    """
    monkeypatch.setattr(contact, "LENGTH", 400.0)
    random, offsets, hidden, V = np.random.default_rng(5), np.array([2.0, -2.0]), 16, 25.0
    bodies = np.append(np.tile([0, 0, 0, 0, 1, 1, 1, 1], 2), -1)
    components = np.append(np.tile([1, 2, 3, 5], 4), -1)
    position_of = {(int(bodies[i]), int(components[i])): i for i in range(8)}
    A, B = np.zeros((17, 17)), np.zeros((17, 2, 4, 3))
    A[8:16] = random.normal(size=(8, 17))
    B[8:16, :, 0, 0] = random.normal(size=(8, 2))
    T = 0.02  # s
    A[hidden, [hidden, 0]], B[hidden, 0, 0, 0] = np.array([-1.0, 3.0]) / T, 2.0 / T
    rows = np.arange(8, 16).reshape(2, 4)
    tangent = TrackResponse(V, (), offsets, A, B, *np.zeros((3, 0)), rows, *np.zeros((2, 0)))
    gain = random.normal(size=(2, 2, 4))  # of wheelsets, of their y and yaw
    relative = []

    def simulate(vehicle, track, **how):
        s = np.arange(0.0, 400.0, STEP)
        x = random.normal(scale=1e-3, size=(17, len(s)))
        x[0] += 5e-3 * np.cos(2.0 * np.pi * s / 400.0)
        along = s + offsets[:, None]
        u = np.array([displacement(track)(row)[0][[0, 2]].mean(axis=0) for row in along])
        k = 2.0 * np.pi * np.fft.rfftfreq(len(s), STEP)
        x[hidden] = np.fft.irfft(np.fft.rfft(3.0 * x[0] + 2.0 * u[0]) / (1.0 + 1j * k * V * T))
        acceleration = A @ x + np.einsum("nw,ws->ns", B[:, :, 0, 0], u)
        noise = 0.1 * random.normal(size=500 + len(s))
        for w, way in enumerate(u):
            y, yaw = 4 * w, 4 * w + 3
            known = np.array([x[y] - way, x[yaw], x[8 + y], x[8 + yaw]])
            acceleration[[8 + y, 8 + yaw]] += gain[w] @ known
            relative.append(known[0, 250:-250].std())
            begin = 100 + int(offsets[w] / STEP)
            own = noise[begin : begin + len(s)]
            acceleration[[8 + y + 1, 8 + y + 2]] += own, own * (1 - 2 * w)
        result = Made({"distance": s})
        for name, states in (
            ("body_position", x[:8]), ("body_velocity", x[8:16]),
            ("body_acceleration", acceleration[8:16]),
        ):  # fmt: skip
            result[name] = np.zeros((len(s), 2, 6))
            result[name][:, bodies[:8], components[:8]] = states.T
        return result

    monkeypatch.setattr(contact, "simulate", simulate)
    linear = SimpleNamespace(
        at=0.0,
        coordinates=SimpleNamespace(
            bodies=bodies, components=components, n_positions=8, position_of=position_of
        ),
        model=SimpleNamespace(system=SimpleNamespace(contact=SimpleNamespace(body=[0, 1]))),
    )
    rough = {"spectrum": "erri_b176_high", "wavelengths": [3.0, 100.0]}
    track = load_track("straight")
    found, noise = contact.with_mean_contact(None, track, linear, tangent, rough)
    expected, inputs = A.copy(), B.copy()
    for w in range(2):
        states = 4 * w + np.array([0, 3, 8, 11])
        expected[np.ix_(rows[w, [0, 3]], states)] += gain[w]
        inputs[rows[w, [0, 3]], w, 0, 0] -= gain[w, :, 0]
    for matrix, by_hand in ((found.A, expected), (found.B, inputs)):
        assert matrix == pytest.approx(by_hand, abs=3e-3)
    assert noise.amplitude == pytest.approx(np.mean(relative), rel=0.01)
    y, z, roll, yaw = noise.power.T
    assert z.mean() == pytest.approx(2.0 * 0.1**2, rel=0.1)
    assert z == pytest.approx(2.0 * roll, rel=0.05)
    assert max(y.max(), yaw.max()) < 1e-6


def test_what_is_seen_does_not_depend_on_the_size_of_the_irregularities():
    """A share of the assumed power is left, of 1e-12 m3 as of 1 m3; of no power nothing is seen."""
    bins = 257  # of 512 points
    share = np.linspace(0.0, 1.0, bins)
    grid = STEP * np.arange(300)
    piece = Piece(grid, np.zeros((1, 300)), np.ones((1, 300), bool), np.full(300, 21.0), 500.0)
    forces = ("Q.1.left",), np.zeros((bins, 1, 4), dtype=complex), np.zeros((1, 300))
    for size in (1e-12, 1.0):
        covariance = np.zeros((bins, 4, 4), dtype=complex)
        covariance[:, range(3), range(3)] = size * share[:, None]
        power = np.tile([size, size, size, 0.0], (bins, 1))
        found = estimate_of(piece, np.zeros((4, bins), complex), covariance, power, forces)
        assert found.seen[:3] == pytest.approx(np.tile(1.0 - share, (3, 1)))
        assert not found.seen[3].any()


def test_estimate_of_a_piece_adds_up_its_fields_and_leaves_out_what_is_not_seen():
    """Fields with more than half of their power left are not shown; forces are H times the mean."""
    random = np.random.default_rng(8)
    points = 512
    bins = points // 2 + 1
    k = 2.0 * np.pi * np.fft.rfftfreq(points, STEP)
    spectra = np.fft.rfft(random.normal(size=(5, points)), axis=1)
    power = random.uniform(1.0, 2.0, (bins, 4))
    left = np.where(np.arange(bins)[:, None] < 100, 0.05, 0.99) * power
    covariance = np.zeros((bins, 5, 5), dtype=complex)
    covariance[:, range(4), range(4)] = left
    covariance[:, 4, 4] = 0.3
    covariance[:, 0, 4] = 0.02j
    covariance[:, 4, 0] = -0.02j
    H = random.normal(size=(bins, 2, 5)) + 1j * random.normal(size=(bins, 2, 5))
    H[[0, -1]] = H[[0, -1]].real
    grid = STEP * np.arange(300)
    piece = Piece(grid, np.zeros((1, 300)), np.ones((1, 300), bool), np.full(300, 21.0), 500.0)
    base = random.normal(size=(2, 300))
    found = estimate_of(piece, spectra, covariance, power, (("Q.1.left", "Y.1.left"), H, base))
    shown = np.where(np.arange(bins) < 100, spectra[:4], 0.0)
    assert found.values == pytest.approx(np.fft.irfft(shown, points, axis=1)[:, :300])
    error = np.where(np.arange(bins)[:, None] < 100, left, power)
    both = np.full(bins, 2.0)
    both[[0, -1]] = 1.0
    assert found.deviations == pytest.approx(np.sqrt(both @ error / points))
    assert found.seen == pytest.approx(1.0 - (left / power).T)
    outputs = np.einsum("kcq,qk->ck", H, spectra)
    assert found.forces == pytest.approx(np.fft.irfft(outputs, points, axis=1)[:, :300] + base)
    spread = [[(H[i, c] @ covariance[i] @ H[i, c].conj()).real for i in range(bins)]
              for c in range(2)]  # fmt: skip
    assert found.force_deviations == pytest.approx(np.sqrt(spread @ both / points))
    for name, (shortest, longest) in BANDS.items():
        # of order 4 at both ends
        f = k[1:] / (2.0 * np.pi)
        gain = 1.0 / np.sqrt(1.0 + (1.0 / longest / f) ** 8)
        gain = np.append(0.0, gain / np.sqrt(1.0 + (f * shortest) ** 8))
        inside = np.fft.irfft(gain * shown, points, axis=1)[:, :300]
        assert found.bands[name] == pytest.approx(inside)
        spread = np.sqrt((gain**2 * both) @ error / points)
        assert found.band_deviations[name] == pytest.approx(spread)


NAMES = ("Q.1.left", "Y.1.right", "lateral.1")


def made_irregularity(random):
    """One piece of 1001 places; between 5 and 10 m nothing is seen of the level."""
    s, count = 100.0 + STEP * np.arange(1001), len(QUANTITIES)
    k = 2.0 * np.pi * np.fft.rfftfreq(2048, STEP)
    power = np.tile(np.where((k > 0.05) & (k < 2.0), 1.0 / (0.1 + k**2), 0.0), (count, 1))
    seen = np.where(power > 0.0, 0.9, 0.0)
    seen[1, (k > 2.0 * np.pi / 10.0) & (k < 2.0 * np.pi / 5.0)] = 0.2
    values, names = 1e-3 * random.normal(size=(count, len(s))), NAMES
    forces = np.array([[5e4], [2e3], [1e-3]]) * (1.0 + 0.1 * random.normal(size=(3, len(s))))
    piece = Estimate(
        s=s, speed=20.0, values=values, deviations=1e-4 * np.arange(1.0, count + 1.0),
        bands={band: (2.0 + j) * values for j, band in enumerate(BANDS)},
        band_deviations={band: 1e-4 * (3.0 + j) * np.arange(1.0, count + 1.0)
                         for j, band in enumerate(BANDS)},
        wave_numbers=k, seen=seen, power=power, outputs=names, forces=forces,
        force_deviations=np.array([300.0, 200.0, 1e-4]),
    )  # fmt: skip
    return piece, join_pieces("run", "coach", [piece], np.array([1.0]), (), load_track("straight"))


def test_tables_of_an_estimate_are_its_rms_values_and_largest_forces():
    """Forces within 60 m of the ends, many deviations off, are in no largest one."""
    piece, found = made_irregularity(np.random.default_rng(9))
    found.forces[:, [3, -4]] *= 100.0
    rows = {(row["quantity"], row["band"]): row for row in found.table().records()}
    for q, name in enumerate(QUANTITIES):
        for j, (band, (shortest, longest)) in enumerate(BANDS.items()):
            row = rows[name.replace("_", " "), band]
            assert row["rms"] == pytest.approx((2.0 + j) * np.std(piece.values[q]))
            assert row["deviation"] == pytest.approx(1e-4 * (3.0 + j) * (q + 1.0))
            inside = (piece.wave_numbers >= 2.0 * np.pi / longest) & (
                piece.wave_numbers <= 2.0 * np.pi / shortest
            )
            share = np.average(piece.seen[q, inside], weights=piece.power[q, inside])
            assert row["seen"] == pytest.approx(share)
    ((low, high),) = found.unseen()["level"]
    assert (low, high) == pytest.approx((5.0, 10.0), abs=0.25)
    assert not any(found.unseen()[name] for name in QUANTITIES if name != "level")
    assert found.notes[0].startswith("Wavelengths not seen and not filled in, level: ")
    forces = found.forces_table().records()
    assert [row["force"] for row in forces] == ["Q.1.left", "Y.1.right"]
    for row, values, rest in zip(forces, piece.forces, (300.0, 200.0), strict=False):
        known = slice(240, len(values) - 240)
        at = 240 + np.argmax(np.abs(values[known]))
        assert row["largest"] == pytest.approx(np.abs(values[at]))
        assert row["place"] == pytest.approx(piece.s[at])
        assert (row["rms"], row["deviation"]) == pytest.approx((np.std(values[known]), rest))
    assert "Within 60 m of the ends" in found.remarks[-1]


def test_files_of_an_estimate_hold_every_column_in_its_unit(tmp_path):
    piece, found = made_irregularity(np.random.default_rng(10))
    paths = {path.name: path for path in found.write(tmp_path)}
    wanted = {"s_m": piece.s}
    for q, name in enumerate(QUANTITIES):
        wanted[f"{name}_mm"] = 1e3 * piece.values[q]
        wanted[f"{name}_deviation_mm"] = np.full(1001, 0.1 * (q + 1.0))
        for j, band in enumerate(BANDS):
            wanted[f"{name}_{band}_mm"] = 1e3 * (2.0 + j) * piece.values[q]
            wanted[f"{name}_{band}_deviation_mm"] = np.full(1001, 0.1 * (3.0 + j) * (q + 1.0))
    for k, (name, unit, factor) in enumerate(
        (("Q.1.left", "kN", 1e-3), ("Y.1.right", "kN", 1e-3), ("lateral.1", "mm", 1e3))
    ):
        wanted[f"{name}_{unit}"] = factor * piece.forces[k]
        wanted[f"{name}_deviation_{unit}"] = np.full(1001, factor * piece.force_deviations[k])
    columns = {}
    for path in paths.values():
        if path.suffix == ".csv":
            heads = path.read_text().splitlines()[0].split(",")
            rows = np.loadtxt(path, delimiter=",", skiprows=1)
            columns |= dict(zip(heads, rows.T, strict=True))
    for name, values in wanted.items():
        np.testing.assert_allclose(columns[name], values, rtol=1e-5, atol=1e-9, err_msg=name)


def test_a_recording_beyond_100_km_is_read_as_it_was_written(tmp_path):
    _, found = made_irregularity(np.random.default_rng(11))
    far = replace(found, s=found.s + 150e3)
    far.write(tmp_path)
    track = load_track(tmp_path / "track.toml")
    assert track.length >= far.s[-1]
    inner = slice(300, 700)
    y_left, z_left, y_right, z_right = displacement(track)(far.s[inner])[0]
    read = 0.5 * (y_left + y_right), 0.5 * (z_left + z_right), z_right - z_left, y_right - y_left
    np.testing.assert_allclose(read, far.values[:, inner], atol=1e-7)


def test_fewer_simulations_than_none_are_refused():
    run, coach = load_measurement("coach_25t_run"), load_vehicle("coach_25t")
    with pytest.raises(InputError, match="simulations: found -1; 0 or more"):
        irregularity(run, coach, load_track("straight"), simulations=-1)
