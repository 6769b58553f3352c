"""The track against analytic geometry: circles, clothoids (Fresnel integrals), crests, cant."""

from types import SimpleNamespace as Record

import numpy as np
import pytest
from dynamics import absolute_frame, rotation
from scipy.special import fresnel

from railsim.definitions.loading import load_track
from railsim.definitions.track.definition import Track
from railsim.definitions.track.rounded_profile import RoundedProfile
from railsim.kernels.rhs import locate_frames
from railsim.kernels.track_frame import FRAME_SIZE, OMEGA, OMEGA_S, TrackTables
from railsim.track.alignment import Alignment
from railsim.track.tables import track_tables, usual_cell_length

X, Y, Z, PSI, THETA, PHI = range(6)


def track_of(plan, cant=(), vertical=(), rounding=10.0, **more):
    return Track(
        format="railsim-track/1",
        name="test",
        plan=plan,
        cant=cant,
        vertical=vertical,
        rounding=rounding,
        **more,
    )


def unrounded(track):
    return track.model_copy(update={"rounding": 0.0})


def evaluate(tables, s, row):
    """Value of a row of the tables at arc lengths `s`."""
    cells = np.floor((s - tables.s_start) / tables.ds).astype(int)
    u = s - tables.s_start - cells * tables.ds
    return (tables.coefficients[cells, row] * u[:, None] ** np.arange(4)).sum(axis=1)


def curve(direction=1.0, **more):
    return track_of(
        [
            {"type": "STR", "length": 50.0},
            {"type": "CLO", "length": 60.0},
            {"type": "CIR", "length": 80.0, "radius": 250.0 * direction},
            {"type": "CLO", "length": 60.0},
            {"type": "STR", "length": 50.0},
        ],
        [
            {"type": "CST", "length": 50.0, "cant": 0.0},
            {"type": "LIR", "length": 60.0},
            {"type": "CST", "length": 80.0, "cant": 0.15 * direction},
            {"type": "LIR", "length": 60.0},
            {"type": "CST", "length": 50.0, "cant": 0.0},
        ],
        **more,
    )


def test_a_frame_turns_as_its_axes_do():
    """Of random angles: omega = vee(A^T dA/ds) and its derivative, by differences over s."""
    coefficients = np.random.default_rng(3).normal(size=(1, 6, 4))
    tables = TrackTables(0.0, 2.0, coefficients, np.zeros((1, 6, 4)), 0, 1.5)
    s, h = 0.5, 1e-5
    before, here, after = (absolute_frame(Record(track=tables), at) for at in (s - h, s, s + h))
    axes = [found[3:12].reshape(3, 3) for found in (before, here, after)]
    assert axes[1] @ axes[1].T == pytest.approx(np.eye(3), abs=1e-14)
    turn = axes[1].T @ (axes[2] - axes[0]) / (2.0 * h)
    assert here[OMEGA : OMEGA + 3] == pytest.approx([turn[2, 1], turn[0, 2], turn[1, 0]], abs=1e-6)
    change = (after - before)[OMEGA : OMEGA + 3] / (2.0 * h)
    assert here[OMEGA_S : OMEGA_S + 3] == pytest.approx(change, abs=1e-6)
    place, ahead = (coefficients[0, :4] @ at ** np.arange(4.0) for at in (s, s + 0.3))
    assert here[:3] == pytest.approx(place[:3], abs=1e-14)
    # from the frame at s, with its heading
    frames, where = np.zeros((2, FRAME_SIZE)), (np.zeros(2, dtype=np.int64), np.zeros(2))
    assert locate_frames(tables, np.array([0.0, 0.3]), 0, s, frames, *where) == 0
    moved = rotation(-place[PSI], 2) @ (ahead - place)[:3]
    assert frames[1, :3] == pytest.approx(moved, abs=1e-14)


@pytest.mark.parametrize("radius", [250.0, -400.0])
def test_clothoid_follows_the_fresnel_integrals(radius):
    length = 120.0
    plan = [{"type": "CLO", "length": length, "radius_start": np.inf, "radius_end": radius}]
    tables = track_tables(unrounded(track_of(plan)), cell_length=0.25)
    s = np.linspace(0.0, length, 501)[:-1]
    scale = np.sqrt(np.pi * abs(radius) * length)
    sine, cosine = fresnel(s / scale)
    # round-off of a sum over 500 cells
    np.testing.assert_allclose(evaluate(tables, s, X), scale * cosine, atol=1e-11)
    np.testing.assert_allclose(evaluate(tables, s, Y), np.sign(radius) * scale * sine, atol=1e-11)
    np.testing.assert_allclose(evaluate(tables, s, PSI), s**2 / (2.0 * radius * length), atol=1e-14)


def test_circle_closes():
    radius = 200.0
    circumference = 2.0 * np.pi * radius
    plan = [{"type": "CIR", "length": circumference, "radius": radius}]
    tables = track_tables(track_of(plan))
    end = np.array([0.0, circumference])
    for row in (X, Y):
        start, closed = evaluate(tables, end, row)
        assert closed == pytest.approx(start, abs=1e-10)
    assert evaluate(tables, end, PSI)[1] == pytest.approx(2.0 * np.pi, abs=1e-12)
    half = np.array([0.5 * circumference])
    assert evaluate(tables, half, Y)[0] == pytest.approx(2.0 * radius, abs=1e-10)


def test_rounding_leaves_the_heading_behind_the_curve_unchanged():
    for rounding in (0.1, 4.0, 10.0, 50.0):
        heading = Alignment(curve(rounding=rounding)).heading(np.array([300.0]))
        # 60/2 + 80 + 60/2 m at 1/250
        assert heading[0] == pytest.approx(140.0 / 250.0, abs=1e-12)


def test_box_filter_turns_a_kink_into_a_parabola():
    rounding, slope = 8.0, 0.15 / 60.0
    alignment = Alignment(curve(rounding=rounding))
    s = np.linspace(50.0 - rounding / 2, 50.0 + rounding / 2, 17)
    parabola = slope * (s - s[0]) ** 2 / (2.0 * rounding)
    np.testing.assert_allclose(alignment.cant(s), parabola, atol=1e-15)


@pytest.mark.parametrize("name", ["curvature", "cant_angle", "grade_angle", "heading"])
def test_rates_are_the_derivatives(name):
    vertical = [
        {"type": "CST", "length": 50.0, "gradient": 0.0},
        {"type": "LIR", "length": 60.0},
        {"type": "CST", "length": 100.0, "gradient": 0.02},
    ]
    alignment = Alignment(curve(vertical=vertical, cant_rotation="inner_rail"))
    profile = {"heading": alignment.curvature, "curvature": alignment.curvature.rate}
    rate = profile.get(name) or getattr(alignment, f"{name}_rate")
    s, h = np.linspace(-20.0, 320.0, 331) + 0.013, 1e-4
    value = getattr(alignment, name)
    difference = (value(s + h) - value(s - h)) / (2.0 * h)
    # second-order difference: 1e-8 times a third derivative, and round-off 1e-16 / 1e-4
    np.testing.assert_allclose(rate(s), difference, atol=1e-10)


def test_tables_agree_with_the_exact_functions():
    track = curve()
    tables, alignment = track_tables(track), Alignment(track)
    s = np.random.default_rng(1).uniform(-90.0, 490.0, 2000)
    np.testing.assert_allclose(evaluate(tables, s, PSI), alignment.heading(s), atol=1e-9)
    np.testing.assert_allclose(evaluate(tables, s, PHI), alignment.cant_angle(s), atol=1e-9)
    np.testing.assert_allclose(evaluate(tables, s, THETA), 0.0, atol=0.0)


def test_position_error_falls_with_the_fourth_power_of_the_cell_length():
    track = curve()
    s = np.linspace(0.0, 300.0, 901)[:-1] + 0.1
    exact = evaluate(track_tables(track, cell_length=0.05), s, Y)
    errors = [
        np.abs(evaluate(track_tables(track, cell_length=ds), s, Y) - exact).max()
        for ds in (2.0, 1.0, 0.5)
    ]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx([4.0, 4.0], abs=0.3)
    # h^4/384 times the fourth derivative: the curvature bends by 1/(250 m * 60 m * 10 m)
    assert errors[0] < 1.1 * 2.0**4 / 384.0 / (250.0 * 60.0 * 10.0)


def test_left_hand_curve_is_the_mirror_image_to_the_last_bit():
    right, left = track_tables(curve()).coefficients, track_tables(curve(-1.0)).coefficients
    for row, sign in ((X, 1.0), (Y, -1.0), (Z, 1.0), (PSI, -1.0), (THETA, 1.0), (PHI, -1.0)):
        np.testing.assert_array_equal(left[:, row], sign * right[:, row])


def test_constant_gradient_climbs_by_its_sine():
    vertical = [{"type": "CST", "length": 100.0, "gradient": 0.03}]
    tables = track_tables(track_of([{"type": "STR", "length": 100.0}], vertical=vertical))
    angle = np.arctan(0.03)
    s = np.array([0.0, 40.0, 99.0])
    np.testing.assert_allclose(evaluate(tables, s, Z), -s * np.sin(angle), atol=1e-12)
    np.testing.assert_allclose(evaluate(tables, s, X), s * np.cos(angle), atol=1e-12)
    np.testing.assert_allclose(evaluate(tables, s, THETA), angle, atol=1e-15)


def test_crest_has_the_radius_of_its_ramp():
    vertical = [
        {"type": "CST", "length": 100.0, "gradient": 0.01},
        {"type": "LIR", "length": 40.0},
        {"type": "CST", "length": 100.0, "gradient": -0.01},
    ]
    alignment = Alignment(track_of([{"type": "STR", "length": 240.0}], vertical=vertical))
    # radius 40 m / 0.02 = 2000 m, exactly at the top where the gradient is zero
    assert alignment.grade_angle_rate(120.0) == pytest.approx(-1.0 / 2000.0, rel=1e-12)
    assert alignment.grade_angle(120.0) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_cant_about_the_inner_rail_leaves_the_inner_rail_at_its_height(direction):
    tables = track_tables(curve(direction, cant_rotation="inner_rail"))
    s = np.array([10.0, 80.0, 150.0, 220.0, 290.0])
    sine = np.sin(evaluate(tables, s, PHI))
    inner = evaluate(tables, s, Z) + direction * 0.75 * sine
    # the rounded cant and its rounded half are the same function
    np.testing.assert_allclose(inner, 0.0, atol=1e-9)
    outer = evaluate(tables, s[2:3], Z) - direction * 0.75 * sine[2]
    assert outer[0] == pytest.approx(-0.15, abs=1e-9)


def test_cant_about_the_centre_line_leaves_the_centre_line_level():
    assert np.all(track_tables(curve()).coefficients[:, Z] == 0.0)


def test_reverse_curve_with_cant_through_zero_lifts_either_inner_rail():
    plan = [
        {"type": "CIR", "length": 60.0, "radius": 300.0},
        {"type": "CLO", "length": 80.0},
        {"type": "CIR", "length": 60.0, "radius": -300.0},
    ]
    cant = [
        {"type": "CST", "length": 60.0, "cant": 0.1},
        {"type": "LIR", "length": 80.0},
        {"type": "CST", "length": 60.0, "cant": -0.1},
    ]
    tables = track_tables(track_of(plan, cant, cant_rotation="inner_rail"))
    ends = evaluate(tables, np.array([30.0, 100.0, 170.0]), Z)
    assert ends[2] == pytest.approx(ends[0], abs=1e-9)
    # at zero cant the centre line is lower by half of 0.1 m, but for the rounding (10 m at 1:800)
    assert ends[1] - ends[0] == pytest.approx(0.05, abs=0.5 * 10.0 / 4.0 * 0.2 / 80.0)


@pytest.mark.parametrize("trace", [3e-25, 1e-12])
def test_trace_of_cant_before_a_ramp_to_the_other_side_changes_nothing(trace):
    def height(cant):
        plan = [{"type": "CIR", "length": 120.0, "radius": -300.0}]
        ramp = [
            {"type": "CST", "length": 20.0, "cant": cant},
            {"type": "LIR", "length": 80.0},
            {"type": "CST", "length": 20.0, "cant": -0.1},
        ]
        tables = track_tables(track_of(plan, ramp, cant_rotation="inner_rail"))
        return evaluate(tables, np.linspace(0.0, 120.0, 50), Z)

    # half the cant, where the cant itself is measured from zero
    np.testing.assert_allclose(height(trace), height(0.0), atol=trace + 1e-12)


def test_end_elements_continue_beyond_both_ends():
    plan = [
        {"type": "CIR", "length": 60.0, "radius": 300.0},
        {"type": "CLO", "length": 60.0, "radius_end": 600.0},
    ]
    cant = [{"type": "CST", "length": 30.0, "cant": 0.1}]
    alignment = Alignment(track_of(plan, cant))
    assert alignment.curvature(-80.0) == pytest.approx(1.0 / 300.0, rel=1e-12)
    assert alignment.curvature(300.0) == pytest.approx(1.0 / 600.0, rel=1e-12)
    np.testing.assert_allclose(alignment.cant([-80.0, 20.0, 119.0, 300.0]), 0.1, atol=1e-14)


def test_study_curve_holds_its_radius_and_cant_over_the_circle():
    alignment = Alignment(load_track("curve_r250"))
    s = np.linspace(365.0, 415.0, 11)
    np.testing.assert_allclose(1.0 / alignment.curvature(s), 250.0, rtol=1e-12)
    np.testing.assert_allclose(np.sin(alignment.cant_angle(s)), 0.1, rtol=1e-12)


def test_long_tracks_stay_moderate_and_short_roundings_are_resolved():
    line = track_of([{"type": "STR", "length": 100e3}])
    assert track_tables(line).coefficients.nbytes < 50e6
    assert usual_cell_length(track_of([{"type": "STR", "length": 100.0}], rounding=0.1)) <= 0.025


def test_rounded_profile_without_sections_is_zero():
    profile = RoundedProfile([], 10.0)
    assert profile(3.0) == 0.0
    assert profile.integral(3.0) == 0.0
