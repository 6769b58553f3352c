"""Cube root of the contact forces: that of the library to a few units in the last digit."""

import numpy as np

from railsim.kernels.cube_root import cube_root


def test_cube_root_is_that_of_the_library():
    """Over all magnitudes, and dense over three octaves, where the first guess repeats itself."""
    x = np.concatenate([np.logspace(-280, 280, 2001), np.linspace(1.0, 8.0, 2001)])
    found = np.array([cube_root(value) for value in x])
    assert np.max(np.abs(found / np.cbrt(x) - 1.0)) < 2e-15


def test_not_a_number_stays_one():
    assert np.isnan(cube_root(np.nan))
