"""What is no number, or beyond all integers, never becomes an index of a compiled look-up."""

import math

import numpy as np
import pytest

from railsim.kernels import compiled
from railsim.kernels.track_frame import TrackTables, track_cell
from railsim.kernels.wheel_surface import angle_cell

NOWHERE = (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e19, -1e19)


@compiled
def cell_on_track(track, s):
    return track_cell(track, s)


@compiled
def cell_on_wheel(phi, n_phi):
    return angle_cell(phi, n_phi)


@pytest.mark.parametrize("s", NOWHERE)
def test_track_has_no_cell_beyond_its_table(s):
    track = TrackTables(0.0, 2.0, np.zeros((4, 6, 4)), np.zeros((4, 6, 4)), 0, 0.75)
    assert cell_on_track(track, s)[0] == -1
    assert cell_on_track(track, 7.9) == (3, pytest.approx(1.9))


@pytest.mark.parametrize("phi", NOWHERE)
def test_wheel_has_a_cell_at_any_angle(phi):
    assert 0 <= cell_on_wheel(phi, 96)[0] < 96


@pytest.mark.parametrize("phi", [-1e-18, -0.1, 0.0, 0.1, 2 * math.pi, 100.0, -12345.6])
def test_cells_of_a_wheel_begin_anew_with_every_turn(phi):
    i, part = cell_on_wheel(phi, 96)
    assert 0 <= i < 96
    assert math.remainder((i + part) * 2 * math.pi / 96 - phi, 2 * math.pi) == pytest.approx(0.0)
