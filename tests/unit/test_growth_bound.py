"""Bounds that spare the eigenvalues of a step: no step is called stable, or wild, that is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.model.time_step import SLIGHT, _bound


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    n=st.integers(1, 30),
    radius=st.sampled_from([0.999, 0.9999, 1.0, 1.0003, 1.001, 1.01, 1.02, 1.1, 2.1, 30.0]),
    spread=st.sampled_from([0.0, 3.0]),
    share=st.sampled_from([0.1, 0.5, 1.0]),
)
def test_bounds_hold(seed, n, radius, spread, share):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(n, n)) * (rng.random((n, n)) < share)
    matrix *= radius / max(np.abs(np.linalg.eigvals(matrix)).max(), 1e-3)
    scale = 10.0 ** rng.uniform(-spread, spread, n)  # units of metres, radians and newtons
    matrix = matrix * scale[:, None] / scale
    largest = np.abs(np.linalg.eigvals(matrix)).max()
    for limit in (3e-4, 7e-4, 1.4e-3):
        bound = _bound(matrix, limit)
        if bound == limit:
            assert largest < np.exp(limit)
        elif bound:
            assert SLIGHT < bound < np.log(largest) + 1e-6


@pytest.mark.parametrize("rate", [-1.0, 0.0, 0.1])
def test_a_slow_mode_is_told_from_an_instability(rate):
    """Modes that neither grow nor decay, and a shear that makes the powers grow for a while."""
    h = 1.4e-3
    matrix = np.diag(np.exp(h * np.array([rate, -20.0, -300.0])))
    matrix[0, 1], matrix[1, 2], matrix[2, 0] = 1e4, 1.0, 1e-12
    assert _bound(matrix, 0.5 * h) == 0.5 * h


def test_growth_beyond_the_limit_is_seen():
    for matrix in (np.diag([1.01, 0.5]), np.array([[0.0, 1.01], [1.01, 0.0]])):
        assert _bound(matrix, 7e-4) == 0.0
    assert _bound(np.full((2, 2), 1e100), 7e-4) in (0.0, pytest.approx(np.log(2e100), rel=0.01))


def test_growth_beyond_any_use_is_found_without_eigenvalues():
    """A wheel on a contact that is too stiff for its step: two modes near -3, others decay."""
    turned, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(32, 32)))
    matrix = turned @ np.diag([-3.0, -3.1, *np.linspace(0.1, 0.99, 30)]) @ turned.T
    assert np.log(2.0) < _bound(matrix, 7e-4) < np.log(3.1) + 1e-6
