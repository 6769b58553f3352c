"""Smoother of stationary fields against dense Gaussian conditioning and Rauch-Tung-Striebel."""

import numpy as np
import pytest
from scipy.linalg import circulant, solve_discrete_lyapunov

from railsim.errors import ModelError
from railsim.observation import smoother
from railsim.observation.smoother import Fields

M = 48
TIGHT = 1e-12


def two_fields():
    """Two fields seen by three channels that differentiate and delay them; one has a bias."""
    k = 2.0 * np.pi * np.arange(M // 2 + 1) / M
    power = np.stack([1.0 / (0.05 + k**2), 0.3 / (0.1 + k**2)], axis=1)
    response = np.stack([
        np.stack([1j * k, 0.2 * np.exp(3j * k)], axis=1),
        np.stack([np.exp(-2j * k), -(k**2) + 0j], axis=1),
        np.stack([0.5 + 0j * k, 1j * k * np.exp(1j * k)], axis=1),
    ], axis=1)  # fmt: skip
    response[[0, -1]] = response[[0, -1]].real
    errors = np.tile(np.array([0.1, 0.2, 0.15]) ** 2, (len(k), 1))
    errors[0, 1] += M * 0.5
    return Fields(M, power, response, errors)


def dense(spectrum):
    return circulant(np.fft.irfft(spectrum, M))


def dense_model(fields):
    """Covariance of the fields, of the errors, and the matrix between them."""
    prior = np.zeros((2 * M, 2 * M))
    noise, seen = np.zeros((3 * M, 3 * M)), np.zeros((3 * M, 2 * M))
    for q in range(2):
        prior[q * M : (q + 1) * M, q * M : (q + 1) * M] = dense(fields.power[:, q])
    for c in range(3):
        rows = slice(c * M, (c + 1) * M)
        noise[rows, rows] = dense(fields.errors[:, c])
        for q in range(2):
            seen[rows, q * M : (q + 1) * M] = dense(fields.response[:, c, q])
    return prior, noise, seen


@pytest.mark.parametrize("gaps", [False, True])
def test_mean_is_that_of_gaussian_conditioning(gaps):
    """E[r|y] = R H' E' (E (H R H' + N) E')^-1 E y with dense matrices, to 1e-9."""
    fields = two_fields()
    prior, noise, seen = dense_model(fields)
    rng = np.random.default_rng(3)
    y = rng.normal(size=(3, M))
    there = np.ones((3, M), dtype=bool)
    if gaps:
        there = rng.random((3, M)) > 0.3
        there[:, 40:] = False
        there[2] = False  # a channel that is not there at all
    taken = np.eye(3 * M)[there.ravel()]
    whole = seen @ prior @ seen.T + noise
    expected = (
        prior @ seen.T @ taken.T @ np.linalg.solve(taken @ whole @ taken.T, taken @ y.ravel())
    )
    y[~there] = np.nan
    found = fields.mean(y, there, residual=TIGHT)
    assert found.ravel() == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_covariance_is_that_of_gaussian_conditioning():
    fields = two_fields()
    prior, noise, seen = dense_model(fields)
    whole = seen @ prior @ seen.T + noise
    expected = prior - prior @ seen.T @ np.linalg.solve(whole, seen @ prior)
    found = fields.covariance()
    for p in range(2):
        for q in range(2):
            block = expected[p * M : (p + 1) * M, q * M : (q + 1) * M]
            assert np.fft.irfft(found[:, p, q], M) == pytest.approx(block[:, 0], abs=1e-10)


def rauch_tung_striebel(F, G, C, D, q, r, y):
    """Textbook smoother of x' = F x + G w, y = C x + D r + v; returns the state's mean."""
    n = len(F)
    P0 = solve_discrete_lyapunov(F, q * G @ G.T)
    x, P = np.zeros(n), P0
    predicted, filtered = [], []
    for value in y:
        predicted.append((x, P))
        if np.isfinite(value):
            gain = P @ C / (C @ P @ C + r)
            x, P = x + gain * (value - C @ x), P - np.outer(gain, C @ P)
        filtered.append((x, P))
        x, P = F @ x, F @ P @ F.T + q * G @ G.T
    smooth = [filtered[-1][0]]
    for k in range(len(y) - 2, -1, -1):
        gain = filtered[k][1] @ F.T @ np.linalg.pinv(predicted[k + 1][1])
        smooth.append(filtered[k][0] + gain @ (smooth[-1] - predicted[k + 1][0]))
    return np.array(smooth[::-1])


def test_smoother_is_that_of_rauch_tung_striebel():
    """An oscillator driven by coloured noise, with a gap and both ends, to 1e-9.

    The field is r with r' = a r + w, the channel the oscillator's displacement.
    """
    a, q, r, n, points = 0.7, 0.3, 0.04, 120, 600
    turn, decay = 0.5, 0.85
    oscillator = decay * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    drive, C = np.array([0.2, 1.0]), np.array([1.0, 0.0])
    F = np.block([[np.array([[a]]), np.zeros((1, 2))], [drive[:, None], oscillator]])
    G = np.array([[1.0], [0.0], [0.0]])
    rng = np.random.default_rng(1)
    y = rng.normal(size=n)
    y[40:55] = np.nan
    expected = rauch_tung_striebel(F, G, np.array([0.0, *C]), 0.0, q, r, y)[:, 0]
    z = np.exp(2j * np.pi * np.arange(points // 2 + 1) / points)
    power = q / np.abs(z - a) ** 2
    response = np.array([C @ np.linalg.solve(one * np.eye(2) - oscillator, drive) for one in z])
    response[[0, -1]] = response[[0, -1]].real
    fields = Fields(points, power[:, None], response[:, None, None], np.full((len(z), 1), r))
    data = np.full((1, points), np.nan)
    data[0, :n] = y
    found = fields.mean(data, np.isfinite(data), residual=TIGHT)[0, :n]
    assert found == pytest.approx(expected, abs=1e-9)


def test_no_solution_is_said(monkeypatch):
    monkeypatch.setattr(smoother, "MOST_ITERATIONS", 2)
    there = np.ones((3, M), dtype=bool)
    there[:, 10:20] = False
    with pytest.raises(ModelError, match="not solved after 2 iterations"):
        two_fields().mean(np.ones((3, M)), there, residual=TIGHT)
