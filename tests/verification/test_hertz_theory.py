"""Hertz contact: closed forms, scaling, symmetry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railsim.contact import hertz
from railsim.errors import ModelError

E, NU = 2.1e11, 0.28
E_STAR = E / (2 * (1 - NU**2))
curvatures = st.floats(1e-3, 1e3)
forces = st.floats(1.0, 1e6)


def test_sphere_on_plane_has_the_closed_form():
    R, N = 0.3, 5e4
    contact = hertz(1 / (2 * R), 1 / (2 * R), N, E, NU)
    a = (0.75 * N * R / E_STAR) ** (1 / 3)
    assert contact.a == pytest.approx(a, rel=1e-12)
    assert contact.b == pytest.approx(a, rel=1e-12)
    assert contact.approach == pytest.approx(a**2 / R, rel=1e-12)


@settings(max_examples=50, deadline=None)
@given(curvatures, curvatures, forces)
def test_swapping_the_directions_swaps_the_semi_axes(A, B, N):
    one, other = hertz(A, B, N, E, NU), hertz(B, A, N, E, NU)
    assert one.a == pytest.approx(other.b, rel=1e-11)
    assert one.approach == pytest.approx(other.approach, rel=1e-11)


@settings(max_examples=50, deadline=None)
@given(curvatures, curvatures, forces, st.floats(0.1, 10.0))
def test_hertz_scales_with_force_and_length(A, B, N, factor):
    one = hertz(A, B, N, E, NU)
    heavier = hertz(A, B, N * factor**3, E, NU)
    assert heavier.a == pytest.approx(one.a * factor, rel=1e-11)
    assert heavier.approach == pytest.approx(one.approach * factor**2, rel=1e-11)
    larger = hertz(A / factor, B / factor, N * factor**2, E, NU)
    assert larger.b == pytest.approx(one.b * factor, rel=1e-11)
    assert larger.p_max == pytest.approx(one.p_max, rel=1e-11)


@settings(max_examples=30, deadline=None)
@given(curvatures, curvatures)
def test_pressure_of_the_ellipse_pushes_both_bodies_to_their_shape(A, B):
    # displacement under the pressure at the centre, by the potential of an ellipsoidal pressure
    contact = hertz(A, B, 1e4, E, NU)
    turn = np.linspace(0.0, np.pi, 4001)[:-1]
    length = 1 / np.sqrt((np.cos(turn) / contact.a) ** 2 + (np.sin(turn) / contact.b) ** 2)
    # mean over direction of the integral of p dr = p_max pi/4 length, both half-planes
    depth = contact.p_max * np.mean(np.pi / 4 * length) * 2 * np.pi / (np.pi * E_STAR)
    if 0.02 < contact.a / contact.b < 50.0:  # else the sum over directions is too coarse
        assert depth == pytest.approx(contact.approach, rel=1e-9)


def test_arrays_broadcast_and_zero_force_is_no_contact():
    contact = hertz(1.0, np.array([[1.0], [2.0]]), np.array([0.0, 1.0, 8.0]), E, NU)
    assert contact.a.shape == (2, 3)
    assert np.all(contact.a[:, 0] == 0.0)
    np.testing.assert_allclose(contact.a[:, 2], 2 * contact.a[:, 1], rtol=1e-13)


@pytest.mark.parametrize(
    ("A", "B", "N"),
    [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0), (np.inf, 1.0, 1.0), (1.0, np.nan, 1.0)],
)
def test_conformal_contact_is_refused(A, B, N):
    with pytest.raises(ModelError):
        hertz(A, B, N, E, NU)
